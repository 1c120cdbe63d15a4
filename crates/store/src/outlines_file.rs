//! `survey/objects.outlines`: what stands on the ground of an area, before its heights are known. Private to this
//! project.

use std::path::Path;

use load_module_reader::Objects;
use serde::{Deserialize, Serialize};
use terrain::{ModuleGrid, ModuleId};

use crate::frame::{Kind, malformed};
use crate::{DatabaseError, FeatureRemark, ObjectSums, ReportPlace, Stamp, codec, frame};

/// What stands on the ground of an area. Heights of prisms are above the highest ground under each.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct AreaOutlines {
    /// Side of a load module in quanta.
    pub side: u16,
    /// By row and column; load modules on which nothing stands are left out.
    pub modules: Vec<ModuleOutlines>,
    /// How much there is of each kind, in their order.
    pub kinds: Vec<ObjectSums>,
    /// What had no room, what hides most first.
    pub left_out: Vec<ObjectLeftOut>,
    /// What was mended or left out.
    pub remarks: Vec<FeatureRemark>,
    /// What a person should know of files.
    pub notes: Vec<String>,
}

/// What stands on a load module.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ModuleOutlines {
    /// Its row.
    pub row: u32,
    /// Its column.
    pub col: u32,
    /// What stands there.
    pub objects: Objects,
}

/// An object that had no room.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ObjectLeftOut {
    /// The word for its kind.
    pub kind: String,
    /// Easting and northing of a corner, in metres.
    pub at_m: [f64; 2],
    /// How high it is.
    pub height_m: f64,
    /// What is seen of it from the side, in square metres.
    pub silhouette_m2: f64,
    /// What was full.
    pub full: ReportPlace,
}

/// The same as it lies on disk: objects as in a file of load modules.
#[derive(Serialize, Deserialize)]
struct OutlinesOnDisk {
    side: u16,
    modules: Vec<(u32, u32, Vec<u8>)>,
    kinds: Vec<ObjectSums>,
    left_out: Vec<ObjectLeftOut>,
    remarks: Vec<FeatureRemark>,
    notes: Vec<String>,
}

impl AreaOutlines {
    /// What stands on a load module.
    pub fn of_module(&self, row: u32, col: u32) -> Option<&Objects> {
        let found = self.modules.binary_search_by_key(&(row, col), |module| (module.row, module.col));
        found.ok().map(|index| &self.modules[index].objects)
    }

    /// Polygons of what stands on each load module of the area, row by row.
    pub fn counts(&self, grid: ModuleGrid) -> Vec<u32> {
        let mut counts = vec![0; grid.count()];
        for &ModuleOutlines { row, col, ref objects } in &self.modules {
            counts[grid.index(ModuleId { row, col })] = objects.polygons() as u32;
        }
        counts
    }
}

/// The bytes of what stands on the ground of an area.
pub(crate) fn encode_outlines(stamp: &Stamp, outlines: &AreaOutlines) -> Vec<u8> {
    let AreaOutlines { side, modules, kinds, left_out, remarks, notes } = outlines;
    let module = |module: &ModuleOutlines| (module.row, module.col, module.objects.to_part());
    let on_disk = OutlinesOnDisk {
        side: *side,
        modules: modules.iter().map(module).collect(),
        kinds: kinds.clone(),
        left_out: left_out.clone(),
        remarks: remarks.clone(),
        notes: notes.clone(),
    };
    frame::seal(Kind::Objects, stamp, &codec::encode(&on_disk))
}

/// What stands on the ground of the area whose file, at `path`, has these bytes.
///
/// # Errors
/// When the file is not as it was written.
pub(crate) fn decode_outlines(path: &Path, bytes: &[u8]) -> Result<(Stamp, AreaOutlines), DatabaseError> {
    let (stamp, payload) = frame::open(Kind::Objects, path, bytes)?;
    let OutlinesOnDisk { side, modules, kinds, left_out, remarks, notes } =
        codec::decode(payload).map_err(|what| malformed(path, what))?;
    let module = |(row, col, part): (u32, u32, Vec<u8>)| {
        let objects = Objects::of_part(&part, side).map_err(|error| malformed(path, error.to_string()))?;
        Ok(ModuleOutlines { row, col, objects })
    };
    let modules = modules.into_iter().map(module).collect::<Result<Vec<_>, DatabaseError>>()?;
    if !modules.is_sorted_by_key(|module| (module.row, module.col)) {
        return Err(malformed(path, "found load modules out of order"));
    }
    Ok((stamp, AreaOutlines { side, modules, kinds, left_out, remarks, notes }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::samples;

    #[test]
    fn outlines_survive_their_file_and_every_damage_is_an_error() {
        let path = Path::new("objects.outlines");
        let outlines = AreaOutlines {
            side: 64_000,
            modules: vec![ModuleOutlines { row: 2, col: 3, objects: samples::objects() }],
            kinds: vec![ObjectSums { kind: "building".into(), wanted: 2, kept: 1, wanted_m2: 90.5, kept_m2: 60.25 }],
            left_out: vec![ObjectLeftOut {
                kind: "building".into(),
                at_m: [1.0, 2.0],
                height_m: 6.0,
                silhouette_m2: 30.25,
                full: ReportPlace::Window([1, 0]),
            }],
            remarks: Vec::new(),
            notes: vec!["a note".into()],
        };
        let bytes = encode_outlines(&samples::stamp(), &outlines);
        assert_eq!(decode_outlines(path, &bytes).unwrap(), (samples::stamp(), outlines.clone()));
        samples::check_every_damage(&bytes, |bytes| decode_outlines(path, bytes).is_err());
        assert_eq!(outlines.of_module(2, 3), Some(&samples::objects()));
        assert_eq!(outlines.of_module(2, 4), None);
    }
}
