//! Geometries as a GeoPackage stores them: a header with the extent, then well-known binary.

/// Little-endian, with an extent in x and y.
const FLAGS: u8 = 0b0000_0011;
/// Codes of well-known binary.
const POLYGON: u32 = 3;
const POLYGON_Z: u32 = 1003;
const MULTIPOLYGON: u32 = 6;
const POINT: u32 = 1;
const POINT_Z: u32 = 1001;
const LINE_Z: u32 = 1002;

/// A polygon of one ring; `ring` does not repeat its first place.
pub fn polygon(srs: i32, ring: &[[f64; 2]]) -> Vec<u8> {
    blob(srs, POLYGON, ring)
}

/// The same with heights.
pub fn polygon_z(srs: i32, ring: &[[f64; 3]]) -> Vec<u8> {
    blob(srs, POLYGON_Z, ring)
}

/// A place.
pub fn point(srs: i32, place: [f64; 2]) -> Vec<u8> {
    with_places(head(srs, &[place]), &[POINT], &[place])
}

/// A place with its height.
pub fn point_z(srs: i32, place: [f64; 3]) -> Vec<u8> {
    with_places(head(srs, &[place]), &[POINT_Z], &[place])
}

/// A line with heights.
pub fn line_z(srs: i32, places: &[[f64; 3]]) -> Vec<u8> {
    with_places(head(srs, places), &[LINE_Z, places.len() as u32], places)
}

/// Polygons of an outer ring and holes each; no ring repeats its first place.
pub fn polygons(srs: i32, shapes: &[Vec<Vec<[f64; 2]>>]) -> Vec<u8> {
    let all: Vec<[f64; 2]> = shapes.iter().flatten().flatten().copied().collect();
    let mut bytes = with_places::<2>(head(srs, &all), &[MULTIPOLYGON, shapes.len() as u32], &[]);
    for shape in shapes {
        bytes = with_places::<2>(bytes, &[POLYGON, shape.len() as u32], &[]);
        for ring in shape {
            let closed = ring.iter().chain(ring.first());
            bytes.extend_from_slice(&(ring.len() as u32 + 1).to_le_bytes());
            bytes.extend(closed.flatten().flat_map(|number| number.to_le_bytes()));
        }
    }
    bytes
}

fn blob<const N: usize>(srs: i32, kind: u32, ring: &[[f64; N]]) -> Vec<u8> {
    let closed: Vec<[f64; N]> = ring.iter().chain(ring.first()).copied().collect();
    with_places(head(srs, ring), &[kind, 1, closed.len() as u32], &closed)
}

/// What stands before the well-known binary: the coordinate system and the extent.
fn head<const N: usize>(srs: i32, places: &[[f64; N]]) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(8 + 32 + 13 + 8 * N * (places.len() + 1));
    bytes.extend_from_slice(&[b'G', b'P', 0, FLAGS]);
    bytes.extend_from_slice(&srs.to_le_bytes());
    for axis in 0..2 {
        let values = || places.iter().map(|place| place[axis]);
        for end in [values().fold(f64::INFINITY, f64::min), values().fold(f64::NEG_INFINITY, f64::max)] {
            bytes.extend_from_slice(&end.to_le_bytes());
        }
    }
    bytes
}

/// Well-known binary after a head: little-endian, its numbers, its places.
fn with_places<const N: usize>(mut bytes: Vec<u8>, numbers: &[u32], places: &[[f64; N]]) -> Vec<u8> {
    bytes.push(1);
    numbers.iter().for_each(|number| bytes.extend_from_slice(&number.to_le_bytes()));
    places.iter().flatten().for_each(|number| bytes.extend_from_slice(&number.to_le_bytes()));
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_triangle_is_closed_and_its_extent_stands_before_it() {
        let bytes = polygon_z(32611, &[[0.0, 0.0, 5.0], [2.0, 0.0, 6.0], [0.0, 3.0, 7.0]]);
        assert_eq!(bytes.len(), 8 + 32 + 13 + 4 * 24);
        assert_eq!((&bytes[..4], &bytes[4..8]), (&b"GP\0\x03"[..], &32611_i32.to_le_bytes()[..]));
        assert_eq!(bytes[16..24], 2.0_f64.to_le_bytes());
        assert_eq!(bytes[41..45], 1003_u32.to_le_bytes());
        assert_eq!(bytes[53..77], bytes[bytes.len() - 24..]);
        assert_eq!(polygon(1, &[[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]]).len(), 8 + 32 + 13 + 4 * 16);
    }
}
