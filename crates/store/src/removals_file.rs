//! `tiles/r02c03.removed`: points that the enforcer took out of a tile whose module edges are clipped.
//!
//! The tile's own file is never edited; the list lies beside it. Private to this project.

use std::path::Path;

use serde::{Deserialize, Serialize};
use terrain::{LatticePoint, TileId};

use crate::frame::{Kind, malformed};
use crate::{DatabaseError, Stamp, codec, frame};

/// What the enforcer took out of one tile, in order of removal.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Removals {
    /// The tile whose points they were.
    pub tile: TileId,
    /// Where they stood.
    pub points: Vec<LatticePoint>,
}

/// [`Removals`] as they lie on disk.
#[derive(Serialize, Deserialize)]
struct RemovalsOnDisk {
    tile: (u32, u32),
    points: Vec<(i32, i32)>,
}

/// The bytes of a list of removals.
pub fn encode_removals(stamp: &Stamp, removals: &Removals) -> Vec<u8> {
    let on_disk = RemovalsOnDisk {
        tile: (removals.tile.row, removals.tile.col),
        points: removals.points.iter().map(|point| (point.row, point.col)).collect(),
    };
    frame::seal(Kind::Removals, stamp, &codec::encode(&on_disk))
}

/// The removals whose file, at `path`, has these bytes.
///
/// # Errors
/// When the file is not as it was written.
pub fn decode_removals(path: &Path, bytes: &[u8]) -> Result<(Stamp, Removals), DatabaseError> {
    let (stamp, payload) = frame::open(Kind::Removals, path, bytes)?;
    let on_disk: RemovalsOnDisk = codec::decode(payload).map_err(|what| malformed(path, what))?;
    let points = on_disk.points.into_iter().map(|(row, col)| LatticePoint::new(row, col)).collect();
    Ok((stamp, Removals { tile: TileId { row: on_disk.tile.0, col: on_disk.tile.1 }, points }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::samples;

    #[test]
    fn removals_survive_their_file_and_every_damage_is_an_error() {
        let path = Path::new("r00c01.removed");
        let removals =
            Removals { tile: samples::TILE, points: vec![LatticePoint::new(8, 16), LatticePoint::new(3, -1)] };
        let bytes = encode_removals(&samples::stamp(), &removals);
        assert_eq!(decode_removals(path, &bytes).unwrap(), (samples::stamp(), removals));
        samples::check_every_damage(&bytes, |bytes| decode_removals(path, bytes).is_err());
    }
}
