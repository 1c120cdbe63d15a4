//! `tiles/r02c03.tin`: one tile's TIN as `refine` made it. Private to this project; never edited.

use std::path::Path;

use serde::{Deserialize, Serialize};
use terrain::{
    FEATURE_STEPS_MAX, LATTICE_PER_POST, LatticePoint, Post, PostRect, Refusal, StopReason, TileId, TileTin, Tin,
    Vertex,
};

use crate::frame::{Kind, malformed};
use crate::{DatabaseError, Stamp, codec, frame};

/// Posts from the area's origin that a file may name: eighths of them still fit 32 bits, and so do differences.
const POSTS_MAX: i32 = 1 << 27;

/// [`TileTin`] as it lies on disk.
#[derive(Serialize, Deserialize)]
struct TileOnDisk {
    tile: TileId,
    rect: PostRect,
    vertices: Vec<Vertex>,
    triangles: Vec<[u32; 3]>,
    initial_count: u32,
    residuals: Vec<u32>,
    triangles_charged: u32,
    refused: Vec<Refusal>,
    /// Why selection ended, in the lower four bits; in the upper ones how often the lattice halves an eighth of a post.
    stop: u8,
}

/// The bytes of a tile file.
pub fn encode_tile(stamp: &Stamp, tile: &TileTin) -> Vec<u8> {
    let on_disk = TileOnDisk {
        tile: tile.tile,
        rect: tile.tin.rect,
        vertices: tile.tin.vertices.clone(),
        triangles: tile.tin.triangles.clone(),
        initial_count: tile.initial_count,
        residuals: tile.residuals.clone(),
        triangles_charged: tile.triangles_charged,
        refused: tile.refused.clone(),
        stop: tile.stop.number() | halvings(tile.tin.steps_per_post) << 4,
    };
    frame::seal(Kind::Tile, stamp, &codec::encode(&on_disk))
}

/// The tile whose file, at `path`, has these bytes. Indices and places are checked, cracks are not: see
/// [`terrain::Tin::check`].
///
/// # Errors
/// When the file is not as it was written.
pub fn decode_tile(path: &Path, bytes: &[u8]) -> Result<(Stamp, TileTin), DatabaseError> {
    let (stamp, payload) = frame::open(Kind::Tile, path, bytes)?;
    let tile = codec::decode(payload).and_then(from_disk).map_err(|what| malformed(path, what))?;
    Ok((stamp, tile))
}

fn from_disk(on_disk: TileOnDisk) -> Result<TileTin, String> {
    let rect = on_disk.rect;
    check_rect(rect)?;
    let steps_per_post = steps_from_disk(on_disk.stop >> 4, rect)?;
    let (low, high) = (rect.south_west(), rect.north_east());
    let place = |post: Post| LatticePoint::new(post.row * steps_per_post, post.col * steps_per_post);
    let (low, high) = (place(low), place(high));
    let inside =
        |Vertex { at, .. }: &Vertex| (low.row..=high.row).contains(&at.row) && (low.col..=high.col).contains(&at.col);
    if let Some(vertex) = on_disk.vertices.iter().position(|vertex| !inside(vertex)) {
        return Err(format!("vertex {vertex} lies outside the tile"));
    }
    let count = on_disk.vertices.len();
    let exists = |vertex: &u32| (*vertex as usize) < count;
    if let Some(triangle) = on_disk.triangles.iter().position(|triangle| !triangle.iter().all(exists)) {
        return Err(format!("triangle {triangle} names a vertex of {count} that does not exist"));
    }
    if count < on_disk.initial_count as usize {
        return Err(format!("found {} initial vertices, expected at most {count}", on_disk.initial_count));
    }
    let stop = on_disk.stop & 15;
    let unknown = || format!("found stop reason {stop}, expected below {}", StopReason::ALL.len());
    Ok(TileTin {
        tile: on_disk.tile,
        tin: Tin { rect, steps_per_post, vertices: on_disk.vertices, triangles: on_disk.triangles },
        initial_count: on_disk.initial_count,
        residuals: on_disk.residuals,
        triangles_charged: on_disk.triangles_charged,
        refused: on_disk.refused,
        stop: StopReason::of_number(stop).ok_or_else(unknown)?,
    })
}

fn check_rect(PostRect { south, west, north, east }: PostRect) -> Result<(), String> {
    let bounded = [south, west, north, east].iter().all(|line| (-POSTS_MAX..=POSTS_MAX).contains(line));
    if bounded && south <= north && west <= east {
        return Ok(());
    }
    Err(format!("rows {south} to {north}, columns {west} to {east} are no rectangle of posts"))
}

/// How often the steps of a lattice halve an eighth of a post.
fn halvings(steps_per_post: i32) -> u8 {
    (steps_per_post / LATTICE_PER_POST).trailing_zeros() as u8
}

fn steps_from_disk(halvings: u8, rect: PostRect) -> Result<i32, String> {
    let steps = LATTICE_PER_POST << halvings;
    if FEATURE_STEPS_MAX < steps {
        return Err(format!("found {steps} steps to a post, expected at most {FEATURE_STEPS_MAX}"));
    }
    let most = POSTS_MAX / (steps / LATTICE_PER_POST);
    let lines = [rect.south, rect.west, rect.north, rect.east];
    match lines.iter().find(|line| !(-most..=most).contains(*line)) {
        Some(line) => {
            Err(format!("found line {line}, expected at most {most} on a lattice of {steps} steps to a post"))
        }
        None => Ok(steps),
    }
}

const _: () = assert!(POSTS_MAX as i64 * LATTICE_PER_POST as i64 * 2 <= 1 << 31, "lattice differences fit 32 bits");

#[cfg(test)]
mod tests {
    use super::*;
    use crate::samples;
    use terrain::RefusedBy;

    fn decode(bytes: &[u8]) -> Result<(Stamp, TileTin), DatabaseError> {
        decode_tile(Path::new("r00c01.tin"), bytes)
    }

    #[test]
    fn a_tile_survives_its_file() {
        let (stamp, tile) = (samples::stamp(), samples::tile());
        let bytes = encode_tile(&stamp, &tile);
        assert_eq!(decode(&bytes).unwrap(), (stamp, tile.clone()));
        assert_eq!(encode_tile(&stamp, &tile), bytes);
    }

    #[test]
    fn a_finer_lattice_survives_and_costs_no_byte() {
        let eighths = encode_tile(&samples::stamp(), &samples::tile());
        for steps_per_post in [16, 32, 64] {
            let mut tile = samples::tile();
            tile.tin.steps_per_post = steps_per_post;
            for vertex in &mut tile.tin.vertices {
                vertex.at.row *= steps_per_post / LATTICE_PER_POST;
                vertex.at.col *= steps_per_post / LATTICE_PER_POST;
            }
            let bytes = encode_tile(&samples::stamp(), &tile);
            assert_eq!((decode(&bytes).unwrap().1, bytes.len()), (tile, eighths.len()));
        }
        let mut odd = eighths[frame::FRAME_BYTES..].to_vec();
        *odd.last_mut().unwrap() |= 4 << 4;
        assert!(decode(&frame::seal(Kind::Tile, &samples::stamp(), &odd)).is_err(), "128 steps to a post are too fine");
    }

    #[test]
    fn every_reason_survives() {
        for (stop, by) in StopReason::ALL.into_iter().zip(RefusedBy::ALL.into_iter().cycle()) {
            let mut tile = samples::tile();
            tile.stop = stop;
            tile.refused[0].by = by;
            let (_, read) = decode(&encode_tile(&samples::stamp(), &tile)).unwrap();
            assert_eq!((read.stop, read.refused[0].by), (stop, by));
        }
    }

    #[test]
    fn every_damage_is_an_error() {
        samples::check_every_damage(&encode_tile(&samples::stamp(), &samples::tile()), |bytes| decode(bytes).is_err());
    }

    #[test]
    fn a_payload_that_makes_no_sense_is_an_error_and_no_panic() {
        let (stamp, tile) = (samples::stamp(), samples::tile());
        let payload = encode_tile(&stamp, &tile)[frame::FRAME_BYTES..].to_vec();
        for at in 0..payload.len() {
            for value in [0, 0x7f, 0x80, 0xff] {
                let mut odd = payload.clone();
                odd[at] = value;
                if let Ok((_, tile)) = decode(&frame::seal(Kind::Tile, &stamp, &odd)) {
                    let _ = tile.tin.check();
                }
            }
        }
    }

    #[test]
    fn a_triangle_of_a_missing_vertex_is_named() {
        let mut tile = samples::tile();
        tile.tin.triangles[1][2] = 77;
        let error = decode(&encode_tile(&samples::stamp(), &tile)).unwrap_err();
        let expected = "r00c01.tin: payload: triangle 1 names a vertex of 5 that does not exist";
        assert_eq!(error.to_string(), expected);
    }

    /// The codec is no longer maintained: another decoder must find the same values in the same bytes.
    #[test]
    fn a_tile_can_be_decoded_by_another_crate() {
        type OnDisk = (
            (u32, u32),
            [i32; 4],
            Vec<[i32; 3]>,
            Vec<[u32; 3]>,
            u32,
            Vec<u32>,
            u32,
            Vec<((i32, i32), (u32, u32), u32, u8)>,
            u8,
        );
        let tile = samples::tile();
        let bytes = encode_tile(&samples::stamp(), &tile);
        let read: OnDisk = wincode::deserialize(&bytes[frame::FRAME_BYTES..]).unwrap();
        assert_eq!(read.0, (tile.tile.row, tile.tile.col));
        assert_eq!(read.2.len(), tile.tin.vertices.len());
        assert_eq!(read.3, tile.tin.triangles);
        assert_eq!(read.5, tile.residuals);
        assert_eq!(read.7.len(), tile.refused.len());
        assert_eq!(read.8, tile.stop.number());
    }
}
