//! `survey/r02c03.profile`: the ground along the features of one tile. Private to this project.

use std::path::Path;

use serde::{Deserialize, Serialize};
use terrain::TileId;

use crate::frame::{Kind, malformed};
use crate::{DatabaseError, Stamp, codec, frame};

/// Heights of the DEM at the stations of features in one tile, in the order of their places.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Profile {
    /// The tile.
    pub tile: TileId,
    /// Quanta, or nothing over a void.
    pub heights: Vec<Option<i32>>,
}

#[derive(Serialize, Deserialize)]
struct ProfileOnDisk {
    tile: (u32, u32),
    heights: Vec<Option<i32>>,
}

/// The bytes of a profile.
pub fn encode_profile(stamp: &Stamp, profile: &Profile) -> Vec<u8> {
    let Profile { tile, heights } = profile.clone();
    frame::seal(Kind::Profile, stamp, &codec::encode(&ProfileOnDisk { tile: (tile.row, tile.col), heights }))
}

/// The profile whose file, at `path`, has these bytes.
///
/// # Errors
/// When the file is not as it was written.
pub fn decode_profile(path: &Path, bytes: &[u8]) -> Result<(Stamp, Profile), DatabaseError> {
    let (stamp, payload) = frame::open(Kind::Profile, path, bytes)?;
    let ProfileOnDisk { tile: (row, col), heights } = codec::decode(payload).map_err(|what| malformed(path, what))?;
    Ok((stamp, Profile { tile: TileId { row, col }, heights }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::samples;

    #[test]
    fn profiles_survive_their_file_and_every_damage_is_an_error() {
        let path = Path::new("r00c01.profile");
        let profile = Profile { tile: samples::TILE, heights: vec![Some(-7), None, Some(90_000)] };
        let bytes = encode_profile(&samples::stamp(), &profile);
        assert_eq!(decode_profile(path, &bytes).unwrap(), (samples::stamp(), profile));
        samples::check_every_damage(&bytes, |bytes| decode_profile(path, bytes).is_err());
    }
}
