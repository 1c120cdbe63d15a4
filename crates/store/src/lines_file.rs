//! `survey/r02c03.lines`: what features put into one tile. Private to this project.

use std::path::Path;

use serde::{Deserialize, Serialize};
use terrain::{FEATURE_STEPS_MAX, FeatureSurface, Features, LATTICE_PER_POST, LatticePoint, LineTraits};
use terrain::{Side, SideSpan, SurfaceGround, TileFeatures, TileId, Vertex, WayLine};

use crate::frame::{Kind, malformed};
use crate::slm::{line_numbers, line_of_numbers};
use crate::{DatabaseError, Stamp, codec, frame};

/// Row, column, height.
type Corner = (i32, i32, i32);

/// [`TileFeatures`] as they lie on disk.
#[derive(Serialize, Deserialize)]
struct LinesOnDisk {
    tile: (u32, u32),
    steps_per_post: i32,
    vertices: Vec<Corner>,
    edges: Vec<[u32; 2]>,
    spans: Vec<(u8, i32, i32)>,
    surfaces: Vec<SurfaceOnDisk>,
    shaped: Vec<SurfaceOnDisk>,
    slopes: Vec<[Corner; 2]>,
    decks: Vec<SurfaceOnDisk>,
    lines: Vec<LineOnDisk>,
}

/// Class; kind, form and storey by number; whether it is kept and in the ground; width; vertices.
type LineOnDisk = (u8, [u8; 3], [bool; 2], u16, Vec<Corner>);

#[derive(Serialize, Deserialize)]
struct SurfaceOnDisk {
    class: u8,
    ground: u8,
    body: u32,
    ring: Vec<Corner>,
}

/// The bytes of what features put into a tile.
pub fn encode_lines(stamp: &Stamp, features: &TileFeatures) -> Vec<u8> {
    let TileFeatures { tile, kept, surfaces, shaped, slopes, decks, lines } = features;
    let Features { steps_per_post, vertices, edges, spans } = kept;
    let side = |side: Side| Side::ALL.iter().position(|other| *other == side).expect("a side is one of four") as u8;
    let on_disk = LinesOnDisk {
        tile: (tile.row, tile.col),
        steps_per_post: *steps_per_post,
        vertices: vertices.iter().map(corner).collect(),
        edges: edges.clone(),
        spans: spans.iter().map(|span| (side(span.side), span.from, span.to)).collect(),
        surfaces: surfaces.iter().map(to_disk).collect(),
        shaped: shaped.iter().map(to_disk).collect(),
        slopes: slopes.iter().map(|ends| [corner(&ends[0]), corner(&ends[1])]).collect(),
        decks: decks.iter().map(to_disk).collect(),
        lines: lines.iter().map(line_to_disk).collect(),
    };
    frame::seal(Kind::Lines, stamp, &codec::encode(&on_disk))
}

/// What features put into the tile whose file, at `path`, has these bytes.
///
/// # Errors
/// When the file is not as it was written.
pub fn decode_lines(path: &Path, bytes: &[u8]) -> Result<(Stamp, TileFeatures), DatabaseError> {
    let (stamp, payload) = frame::open(Kind::Lines, path, bytes)?;
    let on_disk: LinesOnDisk = codec::decode(payload).map_err(|what| malformed(path, what))?;
    let steps_per_post = on_disk.steps_per_post;
    if !(LATTICE_PER_POST..=FEATURE_STEPS_MAX).contains(&steps_per_post) || !steps_per_post.count_ones().eq(&1) {
        return Err(malformed(path, format!("found {steps_per_post} steps to a post, expected 8, 16, 32 or 64")));
    }
    let count = on_disk.vertices.len() as u32;
    if on_disk.edges.iter().flatten().any(|vertex| count <= *vertex) {
        return Err(malformed(path, "found an edge to a vertex that is not there"));
    }
    let span = |(side, from, to): (u8, i32, i32)| Some(SideSpan { side: *Side::ALL.get(usize::from(side))?, from, to });
    let spans: Option<Vec<SideSpan>> = on_disk.spans.into_iter().map(span).collect();
    let surfaces: Option<Vec<FeatureSurface>> = on_disk.surfaces.into_iter().map(of_disk).collect();
    let shaped: Option<Vec<FeatureSurface>> = on_disk.shaped.into_iter().map(of_disk).collect();
    let decks: Option<Vec<FeatureSurface>> = on_disk.decks.into_iter().map(of_disk).collect();
    let lines: Option<Vec<WayLine>> = on_disk.lines.into_iter().map(line_of_disk).collect();
    let (Some(spans), Some(surfaces), Some(shaped), Some(decks), Some(lines)) = (spans, surfaces, shaped, decks, lines)
    else {
        return Err(malformed(path, "found a side, a kind of ground or of line that there is not"));
    };
    let vertices = on_disk.vertices.into_iter().map(vertex).collect();
    let features = TileFeatures {
        tile: TileId { row: on_disk.tile.0, col: on_disk.tile.1 },
        kept: Features { steps_per_post, vertices, edges: on_disk.edges, spans },
        surfaces,
        shaped,
        slopes: on_disk.slopes.into_iter().map(|ends| ends.map(vertex)).collect(),
        decks,
        lines,
    };
    Ok((stamp, features))
}

fn corner(vertex: &Vertex) -> Corner {
    (vertex.at.row, vertex.at.col, vertex.height)
}

fn vertex((row, col, height): Corner) -> Vertex {
    Vertex { at: LatticePoint::new(row, col), height }
}

/// By their numbers in the file.
const GROUNDS: [SurfaceGround; 4] =
    [SurfaceGround::Road, SurfaceGround::Lake, SurfaceGround::River, SurfaceGround::Strip];

fn to_disk(surface: &FeatureSurface) -> SurfaceOnDisk {
    let FeatureSurface { class, ground, body, ring } = surface;
    let ground = GROUNDS.iter().position(|other| other == ground).expect("every kind of ground is listed") as u8;
    SurfaceOnDisk { class: *class, ground, body: *body, ring: ring.iter().map(corner).collect() }
}

fn of_disk(surface: SurfaceOnDisk) -> Option<FeatureSurface> {
    let SurfaceOnDisk { class, ground, body, ring } = surface;
    let ground = *GROUNDS.get(usize::from(ground))?;
    Some(FeatureSurface { class, ground, body, ring: ring.into_iter().map(vertex).collect() })
}

fn line_to_disk(line: &WayLine) -> LineOnDisk {
    let WayLine { class, traits, vertices } = line;
    let LineTraits { is_kept, is_in_ground, width, .. } = *traits;
    (*class, line_numbers(traits), [is_kept, is_in_ground], width, vertices.iter().map(corner).collect())
}

fn line_of_disk((class, numbers, [is_kept, is_in_ground], width, vertices): LineOnDisk) -> Option<WayLine> {
    let traits = LineTraits { is_kept, is_in_ground, width, ..line_of_numbers(numbers)? };
    Some(WayLine { class, traits, vertices: vertices.into_iter().map(vertex).collect() })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::samples;
    use terrain::{LineForm, LineKind, LineStorey};

    #[test]
    fn features_survive_their_file_and_every_damage_is_an_error() {
        let path = Path::new("r00c01.lines");
        let vertices = vec![vertex((64, 0, 7)), vertex((-3, 66, -9)), vertex((80, 80, 0))];
        let surface = |ground| FeatureSurface { class: 3, ground, body: 1, ring: vertices.clone() };
        let features = TileFeatures {
            tile: samples::TILE,
            kept: Features {
                steps_per_post: 64,
                vertices: vertices.clone(),
                edges: vec![[0, 1], [1, 2]],
                spans: vec![SideSpan { side: Side::North, from: -5, to: 9 }],
            },
            surfaces: GROUNDS.map(surface).to_vec(),
            shaped: vec![surface(SurfaceGround::Lake)],
            slopes: vec![[vertices[0], vertices[1]]],
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
