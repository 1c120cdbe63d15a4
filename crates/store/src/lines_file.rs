//! `survey/r02c03.lines`: what features put into one tile. Private to this project.

use std::path::Path;

use terrain::{FEATURE_STEPS_MAX, LATTICE_PER_POST, TileFeatures};

use crate::frame::{Kind, malformed};
use crate::{DatabaseError, Stamp, codec, frame};

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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::samples;
    use terrain::{
        FeatureSurface, Features, LatticePoint, LineForm, LineKind, LineStorey, LineTraits, Side, SideSlope, SideSpan,
        SurfaceGround, Vertex, WayLine,
    };

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
}
