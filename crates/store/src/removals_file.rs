//! `tiles/r02c03.removed`: points that the enforcer took out of a tile whose module edges are clipped.
//!
//! The tile's own file is never edited; the list lies beside it. Private to this project.

use std::path::Path;

use serde::{Deserialize, Serialize};
use terrain::{LatticePoint, TileId};

use crate::frame::{Kind, malformed};
use crate::{DatabaseError, Stamp, codec, frame};

/// What the enforcer took out of one tile, in order of removal.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Removals {
    /// The tile whose points they were.
    pub tile: TileId,
    /// Where they stood.
    pub points: Vec<LatticePoint>,
}

/// The bytes of a list of removals.
pub fn encode_removals(stamp: &Stamp, removals: &Removals) -> Vec<u8> {
    frame::seal(Kind::Removals, stamp, &codec::encode(removals))
}

/// The removals whose file, at `path`, has these bytes.
///
/// # Errors
/// When the file is not as it was written.
pub fn decode_removals(path: &Path, bytes: &[u8]) -> Result<(Stamp, Removals), DatabaseError> {
    let (stamp, payload) = frame::open(Kind::Removals, path, bytes)?;
    Ok((stamp, codec::decode(payload).map_err(|what| malformed(path, what))?))
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
