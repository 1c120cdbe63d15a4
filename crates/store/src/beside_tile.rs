//! What lies beside the TIN of one tile, each private to this project: `survey/*.curve`, what more points would gain;
//! `survey/*.lines`, what features put into it; `survey/*.profile`, the ground along its features; and
//! `tiles/*.removed`, points that the enforcer took out where module edges are clipped. The tile's own file is never
//! edited.

use std::path::Path;

use serde::{Deserialize, Serialize};
use terrain::{FEATURE_STEPS_MAX, GainCurve, LATTICE_PER_POST, LatticePoint, TileFeatures, TileId};

use super::frame::{Kind, malformed};
use super::{DatabaseError, Stamp, codec, frame};

/// The bytes of a curve file.
///
/// # Panics
/// When the gain rises along the runs.
pub fn encode_curve(stamp: &Stamp, curve: &GainCurve) -> Vec<u8> {
    assert!(curve.is_descending(), "a gain curve runs from the best point to the worst");
    frame::seal(Kind::Curve, stamp, &codec::encode(curve))
}

/// The curve whose file, at `path`, has these bytes.
///
/// # Errors
/// When the file is not as it was written.
pub fn decode_curve(path: &Path, bytes: &[u8]) -> Result<(Stamp, GainCurve), DatabaseError> {
    let (stamp, payload) = frame::open(Kind::Curve, path, bytes)?;
    let curve: GainCurve = codec::decode(payload).map_err(|what| malformed(path, what))?;
    if curve.is_descending() {
        return Ok((stamp, curve));
    }
    Err(malformed(path, "found a gain that rises, expected runs from the best point to the worst"))
}

/// What the DEM says along features in one tile.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Profile {
    /// The tile.
    pub tile: TileId,
    /// Its height at each of their stations, in the order of places, in quanta; nothing over a void.
    pub heights: Vec<Option<i32>>,
    /// The middle one of nine heights around each of those stations through which a way runs, in quanta; nothing over a
    /// hole.
    pub middles: Vec<Option<i32>>,
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
pub(crate) fn decode_profile(path: &Path, bytes: &[u8]) -> Result<(Stamp, Profile), DatabaseError> {
    let (stamp, payload) = frame::open(Kind::Profile, path, bytes)?;
    Ok((stamp, codec::decode(payload).map_err(|what| malformed(path, what))?))
}

/// The bytes of what features put into a tile.
pub fn encode_lines(stamp: &Stamp, features: &TileFeatures) -> Vec<u8> {
    frame::seal(Kind::Lines, stamp, &codec::encode(features))
}

/// What features put into the tile whose file, at `path`, has these bytes.
///
/// # Errors
/// When the file is not as it was written.
pub fn decode_lines(path: &Path, bytes: &[u8]) -> Result<(Stamp, TileFeatures), DatabaseError> {
    let (stamp, payload) = frame::open(Kind::Lines, path, bytes)?;
    let features: TileFeatures = codec::decode(payload).map_err(|what| malformed(path, what))?;
    let steps_per_post = features.kept.steps_per_post;
    if !(LATTICE_PER_POST..=FEATURE_STEPS_MAX).contains(&steps_per_post) || !steps_per_post.count_ones().eq(&1) {
        return Err(malformed(path, format!("found {steps_per_post} steps to a post, expected 8, 16, 32 or 64")));
    }
    let count = features.kept.vertices.len() as u32;
    if features.kept.edges.iter().flatten().any(|vertex| count <= *vertex) {
        return Err(malformed(path, "found an edge to a vertex that is not there"));
    }
    Ok((stamp, features))
}

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
    use terrain::{
        FeatureSurface, Features, LatticePoint, LineForm, LineKind, LineStorey, LineTraits, Side, SideSlope, SideSpan,
        SurfaceGround, Vertex, WayLine,
    };

    fn decode_damaged(bytes: &[u8]) -> Result<(Stamp, GainCurve), DatabaseError> {
        decode_curve(Path::new("r00c01.curve"), bytes)
    }

    #[test]
    fn a_curve_survives_its_file() {
        let (stamp, curve) = (samples::stamp(), samples::curve());
        assert_eq!(decode_damaged(&encode_curve(&stamp, &curve)).unwrap(), (stamp, curve));
    }

    #[test]
    fn every_damage_of_a_curve_is_an_error() {
        let bytes = encode_curve(&samples::stamp(), &samples::curve());
        samples::check_every_damage(&bytes, |bytes| decode_damaged(bytes).is_err());
    }

    #[test]
    fn profiles_survive_their_file_and_every_damage_is_an_error() {
        let path = Path::new("r00c01.profile");
        let heights = vec![Some(-7), None, Some(90_000)];
        let inside = vec![(2, vec![(-7, 3), (12, 1)])];
        let profile = Profile { tile: samples::TILE, heights, middles: vec![Some(9), None], inside };
        let bytes = encode_profile(&samples::stamp(), &profile);
        assert_eq!(decode_profile(path, &bytes).unwrap(), (samples::stamp(), profile));
        samples::check_every_damage(&bytes, |bytes| decode_profile(path, bytes).is_err());
    }

    #[test]
    fn features_survive_their_file_and_every_damage_is_an_error() {
        let path = Path::new("r00c01.lines");
        let vertex = |row, col, height| Vertex { at: LatticePoint::new(row, col), height };
        let vertices = vec![vertex(64, 0, 7), vertex(-3, 66, -9), vertex(80, 80, 0)];
        let surface = |ground| FeatureSurface { class: 3, ground, body: 1, ring: vertices.clone() };
        let features = TileFeatures {
            tile: samples::TILE,
            kept: Features {
                steps_per_post: 64,
                vertices: vertices.clone(),
                edges: vec![[0, 1], [1, 2]],
                spans: vec![SideSpan { side: Side::North, from: -5, to: 9 }],
            },
            surfaces: SurfaceGround::ALL.map(surface).to_vec(),
            shaped: vec![surface(SurfaceGround::Lake)],
            slopes: vec![SideSlope { ends: [vertices[0], vertices[1]], ground: [7, 8] }],
            watersides: vec![SideSlope { ends: [vertices[1], vertices[2]], ground: [5, -6] }],
            decks: vec![surface(SurfaceGround::Road)],
            lines: vec![WayLine {
                class: 4,
                traits: LineTraits {
                    kind: LineKind::Channel,
                    form: LineForm::Line,
                    storey: LineStorey::Ground,
                    is_kept: true,
                    is_in_ground: true,
                    width: 128,
                },
                vertices: vertices.clone(),
            }],
        };
        let bytes = encode_lines(&samples::stamp(), &features);
        assert_eq!(decode_lines(path, &bytes).unwrap(), (samples::stamp(), features.clone()));
        samples::check_every_damage(&bytes, |bytes| decode_lines(path, bytes).is_err());
        let beyond = TileFeatures { kept: Features { edges: vec![[0, 3]], ..features.kept.clone() }, ..features };
        assert!(decode_lines(path, &encode_lines(&samples::stamp(), &beyond)).is_err());
    }

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
