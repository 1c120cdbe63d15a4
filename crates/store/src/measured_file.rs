//! `measured/r02c03.sums`: what was measured of a tile's load modules, so that a build that keeps them need neither
//! make nor measure them again.
//!
//! It names the load-module file it speaks of by its bytes, so the two cannot come apart. Private to this project.

use std::path::Path;

use serde::{Deserialize, Serialize};
use terrain::TileId;

use crate::frame::{Kind, malformed};
use crate::{DatabaseError, FileStamp, Stamp, codec, frame};

/// What was measured of the load modules of one tile.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Measured {
    /// The tile.
    pub tile: TileId,
    /// The bytes of the load-module file that was measured.
    #[serde(with = "bare")]
    pub modules_file: FileStamp,
    /// Numbers of each load module, level by level, row by row.
    pub modules: Vec<MeasuredModule>,
    /// Residuals against the working grid, by class of ground.
    pub classes: Vec<MeasuredTally>,
    /// Residuals against the sources' heights at the posts of the working grid, where something is burned into it.
    pub at_source_grid: Option<MeasuredTally>,
    /// Residuals against the source's own posts, where those are others.
    pub at_source: Option<MeasuredTally>,
    /// Points by class of ground.
    pub points: Vec<u64>,
    /// Points on the border that every build starts from.
    pub border: u64,
    /// The lowest and the highest vertex of all levels, in quanta.
    pub heights: [i32; 2],
    /// How much the ground curves.
    pub curvature: MeasuredCurvature,
    /// What was found of features, in jobs with some; it follows the rest, so that files of others end there.
    #[serde(skip)]
    pub features: Option<MeasuredFeatures>,
}

/// How much the ground of a tile curves: what the smallest RMS residual on it is computed from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct MeasuredCurvature {
    /// Cells of ground that is known.
    pub cells: u64,
    /// The integral over them, in millionths.
    pub integral: u64,
    /// Cells of rough ground.
    pub rough_cells: u64,
}

/// What was found of the features of a tile.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct MeasuredFeatures {
    /// Steps between posts, in which `missing` is counted.
    pub steps_per_post: i32,
    /// Edges that the TIN has to keep, those on a line that two tiles share in one of them.
    pub edges: u64,
    /// Those that it lacks: row and column of one end, then of the other.
    pub missing: Vec<[i32; 4]>,
    /// How far any corner of a triangle of water lies from the level of its lake, in quanta.
    pub lake_spread: u32,
    /// Square metres inside the shores of lakes that are banks.
    pub lake_banks_m2: u64,
    /// Posts outside water within a post of a lake.
    pub shore_posts: u64,
    /// Those of them below its level.
    pub shore_below: u64,
    /// Residuals outside features and their slopes.
    pub outside: MeasuredTally,
    /// Places of decks that were looked at, those with ground above them, how far it is at most, and the highest step
    /// onto a deck where its bridge ends, both in quanta.
    pub decks: (u64, u64, u32, u32),
    /// How steep a deck is at most, in thousandths, ends of bridges that hang above the ground, and how far one does at
    /// most, in quanta.
    pub deck_ends: (u32, u64, u32),
    /// Metres of roads that lie inside buildings.
    pub in_buildings_m: u64,
    /// The least height of decks above what they cross of each class, in quanta.
    pub deck_clearance: Vec<(u8, i32)>,
}

/// Counts and residual of one load module.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct MeasuredModule {
    /// Its triangles.
    pub triangles: u32,
    /// Its convex polygons.
    pub polygons: u32,
    /// Posts with a residual.
    pub posts: u32,
    /// Largest absolute residual, in quanta.
    pub largest: u32,
    /// Sum of absolute residuals.
    pub sum_abs: u64,
    /// Sum of squared residuals.
    pub sum_squared: u64,
}

/// Residuals of a set of posts, in quanta.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct MeasuredTally {
    /// Posts.
    pub posts: u64,
    /// Sum of residuals with their signs.
    pub sum: i64,
    /// Sum of absolute residuals.
    pub sum_abs: u64,
    /// Sum of squared residuals: the upper 64 bits, then the lower.
    pub sum_squared: [u64; 2],
    /// Largest absolute residual.
    pub largest: u32,
    /// Bins of the histogram that are not empty, in ascending order, and their posts.
    pub bins: Vec<(u32, u64)>,
}

/// The stamp of a file as its length and its hash.
mod bare {
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    use crate::{FileStamp, Fingerprint};

    pub(super) fn serialize<S: Serializer>(stamp: &FileStamp, serializer: S) -> Result<S::Ok, S::Error> {
        (stamp.length, stamp.blake3.0).serialize(serializer)
    }

    pub(super) fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<FileStamp, D::Error> {
        let (length, blake3) = Deserialize::deserialize(deserializer)?;
        Ok(FileStamp { length, blake3: Fingerprint(blake3) })
    }
}

/// The bytes of what was measured.
pub fn encode_measured(stamp: &Stamp, measured: &Measured) -> Vec<u8> {
    let mut bytes = codec::encode(measured);
    if let Some(features) = &measured.features {
        bytes.extend(codec::encode(features));
    }
    frame::seal(Kind::Measured, stamp, &bytes)
}

/// What was measured, whose file, at `path`, has these bytes.
///
/// # Errors
/// When the file is not as it was written.
pub fn decode_measured(path: &Path, bytes: &[u8]) -> Result<(Stamp, Measured), DatabaseError> {
    let (stamp, payload) = frame::open(Kind::Measured, path, bytes)?;
    let (measured, features): (Measured, _) = codec::decode_two(payload).map_err(|what| malformed(path, what))?;
    Ok((stamp, Measured { features, ..measured }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::samples;

    #[test]
    fn what_was_measured_survives_its_file_and_every_damage_is_an_error() {
        let path = Path::new("r00c01.sums");
        let measured = samples::measured();
        let bytes = encode_measured(&samples::stamp(), &measured);
        assert_eq!(decode_measured(path, &bytes).unwrap(), (samples::stamp(), measured));
        samples::check_every_damage(&bytes, |bytes| decode_measured(path, bytes).is_err());
        let features = MeasuredFeatures { edges: 7, missing: vec![[1, -2, 3, 4]], ..MeasuredFeatures::default() };
        let with = Measured { features: Some(features), ..samples::measured() };
        let longer = encode_measured(&samples::stamp(), &with);
        assert_eq!(decode_measured(path, &longer).unwrap(), (samples::stamp(), with));
        assert!(bytes.len() < longer.len());
    }
}
