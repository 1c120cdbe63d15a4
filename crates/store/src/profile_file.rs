//! `survey/r02c03.profile`: the ground along the features of one tile. Private to this project.

use std::path::Path;

use serde::{Deserialize, Serialize};
use terrain::TileId;

use crate::frame::{Kind, malformed};
use crate::{DatabaseError, Stamp, codec, frame};

/// What the DEM says along features in one tile.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Profile {
    /// The tile.
    pub tile: TileId,
    /// Its height at each of their stations, in the order of places, in quanta; nothing over a void.
    pub heights: Vec<Option<i32>>,
    /// The middle one of nine heights around each of those stations through which a way runs, in quanta.
    pub middles: Vec<i32>,
    /// Of polygons of water by their number: how often each height occurs at the posts inside, in quanta, ascending.
    pub inside: Vec<(u32, Vec<(i32, u32)>)>,
}

/// The bytes of a profile.
pub fn encode_profile(stamp: &Stamp, profile: &Profile) -> Vec<u8> {
    frame::seal(Kind::Profile, stamp, &codec::encode(profile))
}

/// The profile whose file, at `path`, has these bytes.
///
/// # Errors
/// When the file is not as it was written.
pub fn decode_profile(path: &Path, bytes: &[u8]) -> Result<(Stamp, Profile), DatabaseError> {
    let (stamp, payload) = frame::open(Kind::Profile, path, bytes)?;
    Ok((stamp, codec::decode(payload).map_err(|what| malformed(path, what))?))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::samples;

    #[test]
    fn profiles_survive_their_file_and_every_damage_is_an_error() {
        let path = Path::new("r00c01.profile");
        let heights = vec![Some(-7), None, Some(90_000)];
        let inside = vec![(2, vec![(-7, 3), (12, 1)])];
        let profile = Profile { tile: samples::TILE, heights, middles: vec![9, -9], inside };
        let bytes = encode_profile(&samples::stamp(), &profile);
        assert_eq!(decode_profile(path, &bytes).unwrap(), (samples::stamp(), profile));
        samples::check_every_damage(&bytes, |bytes| decode_profile(path, bytes).is_err());
    }
}
