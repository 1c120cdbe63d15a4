//! `survey/features.buildings`: buildings that are drawn only, never part of the ground. Private to this project.

use std::path::Path;

use serde::{Deserialize, Serialize};

use crate::frame::{Kind, malformed};
use crate::{DatabaseError, Stamp, codec, frame};

/// A building as a block.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Building {
    /// Its footprint: the outer ring counter-clockwise, then courtyards clockwise, at least three corners each. Quanta
    /// east and north of the area's south-west corner.
    pub rings: Vec<Vec<[i32; 2]>>,
    /// Quanta from the lowest ground under it to where it begins.
    pub bottom: i32,
    /// Quanta from the lowest ground under it to its top.
    pub top: i32,
}

/// [`Building`] as it lies on disk.
#[derive(Serialize, Deserialize)]
struct BuildingOnDisk {
    rings: Vec<Vec<[i32; 2]>>,
    bottom: i32,
    top: i32,
}

/// The bytes of the buildings of an area.
pub fn encode_buildings(stamp: &Stamp, buildings: &[Building]) -> Vec<u8> {
    let to_disk = |building: &Building| {
        let Building { rings, bottom, top } = building.clone();
        BuildingOnDisk { rings, bottom, top }
    };
    let on_disk: Vec<BuildingOnDisk> = buildings.iter().map(to_disk).collect();
    frame::seal(Kind::Buildings, stamp, &codec::encode(&on_disk))
}

/// The buildings whose file, at `path`, has these bytes.
///
/// # Errors
/// When the file is not as it was written.
pub fn decode_buildings(path: &Path, bytes: &[u8]) -> Result<(Stamp, Vec<Building>), DatabaseError> {
    let (stamp, payload) = frame::open(Kind::Buildings, path, bytes)?;
    let on_disk: Vec<BuildingOnDisk> = codec::decode(payload).map_err(|what| malformed(path, what))?;
    let is_sound = |building: &BuildingOnDisk| {
        let is_footprint = !building.rings.is_empty() && building.rings.iter().all(|ring| 3 <= ring.len());
        is_footprint && 0 <= building.bottom && building.bottom < building.top
    };
    if !on_disk.iter().all(is_sound) {
        return Err(malformed(path, "found a building without a footprint or a height"));
    }
    let of_disk = |BuildingOnDisk { rings, bottom, top }| Building { rings, bottom, top };
    Ok((stamp, on_disk.into_iter().map(of_disk).collect()))
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
        let bytes = encode_buildings(&samples::stamp(), std::slice::from_ref(&house));
        assert_eq!(decode_buildings(path, &bytes).unwrap(), (samples::stamp(), vec![house.clone()]));
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
