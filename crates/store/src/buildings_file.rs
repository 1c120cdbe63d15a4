//! `survey/features.buildings`: buildings that are drawn only, never part of the ground. Private to this project.
//!
//! A corner is kept as the step from the one before it, the first of a building from the first of the building before:
//! small numbers take few bytes, and buildings may be the most of what a database of a town holds.

use std::path::Path;

use serde::{Deserialize, Serialize};

use crate::frame::{Kind, malformed};
use crate::{DatabaseError, Stamp, codec, frame};

/// A building as a block.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Building {
    /// Its footprint: the outer ring counter-clockwise, then courtyards clockwise, at least three corners each. East
    /// and north of the area's south-west corner, [`BUILDING_UNITS_PER_METRE`].
    pub rings: Vec<Vec<[i32; 2]>>,
    /// From the lowest ground under it to where it begins, in the same units.
    pub bottom: i32,
    /// From the lowest ground under it to its top.
    pub top: i32,
}

/// A building is as fine as 12.5 cm: maps of buildings are not finer, and nothing but the picture depends on it.
pub const BUILDING_UNITS_PER_METRE: i32 = 8;

/// A building as it lies on disk, its corners as steps.
#[derive(Serialize, Deserialize)]
struct BuildingOnDisk {
    rings: Vec<Vec<[i32; 2]>>,
    bottom: i32,
    top: i32,
}

/// The bytes of the buildings of an area.
pub(crate) fn encode_buildings(stamp: &Stamp, buildings: &[Building]) -> Vec<u8> {
    let mut first = [0; 2];
    let to_disk = |Building { rings, bottom, top }: &Building| {
        let mut last = first;
        let mut steps = |ring: &Vec<[i32; 2]>| ring.iter().map(|&at| difference(at, &mut last)).collect();
        let steps = rings.iter().map(&mut steps).collect();
        first = rings.first().and_then(|ring| ring.first()).copied().unwrap_or(first);
        BuildingOnDisk { rings: steps, bottom: *bottom, top: *top }
    };
    let on_disk: Vec<BuildingOnDisk> = buildings.iter().map(to_disk).collect();
    frame::seal(Kind::Buildings, stamp, &codec::encode_small(&on_disk))
}

/// The buildings whose file, at `path`, has these bytes.
///
/// # Errors
/// When the file is not as it was written.
pub(crate) fn decode_buildings(path: &Path, bytes: &[u8]) -> Result<(Stamp, Vec<Building>), DatabaseError> {
    let (stamp, payload) = frame::open(Kind::Buildings, path, bytes)?;
    let on_disk: Vec<BuildingOnDisk> = codec::decode_small(payload).map_err(|what| malformed(path, what))?;
    let is_sound = |building: &BuildingOnDisk| {
        let is_footprint = !building.rings.is_empty() && building.rings.iter().all(|ring| 3 <= ring.len());
        is_footprint && 0 <= building.bottom && building.bottom < building.top
    };
    if !on_disk.iter().all(is_sound) {
        return Err(malformed(path, "found a building without a footprint or a height"));
    }
    let mut first = [0; 2];
    let of_disk = |BuildingOnDisk { mut rings, bottom, top }| {
        let mut last = first;
        rings.iter_mut().flatten().for_each(|corner| *corner = sum(*corner, &mut last));
        first = rings[0][0];
        Building { rings, bottom, top }
    };
    Ok((stamp, on_disk.into_iter().map(of_disk).collect()))
}

/// The step from the corner before to this one. Numbers may wrap: whatever was written is read.
fn difference(corner: [i32; 2], last: &mut [i32; 2]) -> [i32; 2] {
    let step = [0, 1].map(|axis| corner[axis].wrapping_sub(last[axis]));
    *last = corner;
    step
}

/// The corner at a step from the one before.
fn sum(step: [i32; 2], last: &mut [i32; 2]) -> [i32; 2] {
    *last = [0, 1].map(|axis| step[axis].wrapping_add(last[axis]));
    *last
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::samples;

    #[test]
    fn buildings_survive_their_file_and_every_damage_is_an_error() {
        let path = Path::new("features.buildings");
        let outer = vec![[0, 0], [1280, -5], [1280, 640]];
        let house = Building { rings: vec![outer.clone(), vec![[9, 9], [9, 19], [19, 9]]], bottom: 0, top: 768 };
        let far = vec![[i32::MIN, i32::MAX], [i32::MAX, i32::MIN], [0, 0]];
        let all = vec![house.clone(), Building { rings: vec![far], bottom: 5, top: 6 }, house.clone()];
        let bytes = encode_buildings(&samples::stamp(), &all);
        assert_eq!(decode_buildings(path, &bytes).unwrap(), (samples::stamp(), all));
        samples::check_every_damage(&bytes, |bytes| decode_buildings(path, bytes).is_err());
        let wrong = [
            Building { rings: vec![], ..house.clone() },
            Building { rings: vec![outer[..2].to_vec()], ..house.clone() },
            Building { bottom: 768, ..house.clone() },
            Building { bottom: -1, ..house },
        ];
        for building in wrong {
            assert!(decode_buildings(path, &encode_buildings(&samples::stamp(), &[building])).is_err());
        }
    }
}
