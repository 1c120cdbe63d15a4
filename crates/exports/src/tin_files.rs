//! A TIN of a raster's own posts as PLY or OBJ, z up.
//!
//! Most viewers keep coordinates as 32-bit floats, in which a northing of 5,000 km has steps of half a metre. So local
//! coordinates, from the TIN's south-west post, are the default: on a grid with a spacing in sixteenths of a metre
//! every vertex is a whole number of 1/128 m, which a 32-bit float holds exactly up to 131 km. Geographic programs
//! want the place on the map instead; they get 64-bit floats.

use std::io::{Result, Write};

use terrain::{QUANTA_PER_METRE, Tin, metres_of_quanta};

use crate::Coordinates;
use crate::polygon_files::{Ply, put_obj_comments, put_obj_faces, put_obj_vertices, put_ply};

/// Where a TIN of a raster's own posts lies.
#[derive(Clone, Debug, PartialEq)]
pub struct TinPlace {
    /// East and north of post (0, 0), in metres.
    pub origin_m: [f64; 2],
    /// Metres between posts, west to east and south to north.
    pub spacing_m: [f64; 2],
    /// The coordinate system, where it is known.
    pub crs: Option<String>,
}

impl TinPlace {
    /// What coordinates of `tin` are counted from.
    fn zero_m(&self, tin: &Tin, coordinates: Coordinates) -> [f64; 2] {
        let posts = [tin.rect.west, tin.rect.south].map(f64::from);
        match coordinates {
            Coordinates::Local => [0, 1].map(|axis| self.origin_m[axis] + posts[axis] * self.spacing_m[axis]),
            Coordinates::Map => [0.0, 0.0],
        }
    }

    /// East, north and up of the vertices of `tin` in metres, from `zero_m`.
    fn metres<'a>(&self, tin: &'a Tin, zero_m: [f64; 2]) -> impl ExactSizeIterator<Item = [f64; 3]> + use<'a> {
        let (from_m, spacing_m) = ([0, 1].map(|axis| self.origin_m[axis] - zero_m[axis]), self.spacing_m);
        let posts = |lattice: i32| f64::from(lattice) / f64::from(tin.steps_per_post);
        tin.vertices.iter().map(move |vertex| {
            let east_m = from_m[0] + posts(vertex.at.col) * spacing_m[0];
            let north_m = from_m[1] + posts(vertex.at.row) * spacing_m[1];
            [east_m, north_m, metres_of_quanta(vertex.height)]
        })
    }

    /// What a reader needs to know about the place, a line each. QGIS takes the system from `crs …`.
    fn comments(&self, zero_m: [f64; 2], coordinates: Coordinates) -> Vec<String> {
        let mut lines = vec![format!("x east, y north, z up, in metres; heights in steps of 1/{QUANTA_PER_METRE} m")];
        match coordinates {
            Coordinates::Local => {
                let system = self.crs.as_deref().unwrap_or("an unknown coordinate system");
                let [east_m, north_m] = zero_m;
                lines.push(format!("offset east {east_m} north {north_m} in {system}: add it to x and y"));
            }
            Coordinates::Map => lines.extend(self.crs.as_ref().map(|system| format!("crs {system}"))),
        }
        lines
    }
}

/// Writes `tin` as binary little-endian PLY. Nothing is buffered here: give it a `BufWriter`.
///
/// # Errors
/// Those of `out`.
pub fn write_tin_ply(out: &mut impl Write, tin: &Tin, place: &TinPlace, coordinates: Coordinates) -> Result<()> {
    let zero_m = place.zero_m(tin, coordinates);
    let comments = place.comments(zero_m, coordinates);
    let is_short = coordinates == Coordinates::Local;
    let ply = Ply { comments: &comments, is_short, face_count: tin.triangles.len() };
    put_ply(out, &ply, place.metres(tin, zero_m), tin.triangles.iter())
}

/// Writes `tin` as OBJ. Nothing is buffered here: give it a `BufWriter`.
///
/// # Errors
/// Those of `out`.
pub fn write_tin_obj(out: &mut impl Write, tin: &Tin, place: &TinPlace, coordinates: Coordinates) -> Result<()> {
    let zero_m = place.zero_m(tin, coordinates);
    put_obj_comments(out, &place.comments(zero_m, coordinates))?;
    put_obj_vertices(out, place.metres(tin, zero_m))?;
    put_obj_faces(out, tin.triangles.iter(), false)
}

#[cfg(test)]
mod tests {
    use terrain::{LatticePoint, PostRect, Vertex};

    use super::*;

    fn place() -> TinPlace {
        let crs = Some("EPSG:32611".to_owned());
        TinPlace { origin_m: [505_000.0, 3_875_000.0], spacing_m: [25.0, 31.25], crs }
    }

    fn square() -> Tin {
        let rect = PostRect { south: 4, west: 2, north: 6, east: 4 };
        let corner = |(place, post): (usize, terrain::Post)| Vertex { at: post.into(), height: 64 * place as i32 };
        let mut vertices: Vec<_> = rect.corners().into_iter().enumerate().map(corner).collect();
        vertices.push(Vertex { at: LatticePoint::new(41, 25), height: -1 });
        let triangles = vec![[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]];
        Tin::new(rect, vertices, triangles)
    }

    /// Header and body of the PLY.
    fn ply(coordinates: Coordinates) -> (String, Vec<u8>) {
        let mut bytes = Vec::new();
        write_tin_ply(&mut bytes, &square(), &place(), coordinates).unwrap();
        let end = bytes.windows(11).position(|window| window == b"end_header\n").unwrap() + 11;
        (String::from_utf8(bytes[..end].to_vec()).unwrap(), bytes[end..].to_vec())
    }

    #[test]
    fn local_coordinates_lose_nothing_in_32_bits_and_the_offset_is_told() {
        let (header, body) = ply(Coordinates::Local);
        assert!(header.starts_with("ply\nformat binary_little_endian 1.0\ncomment "), "{header}");
        assert!(header.contains("comment offset east 505050 north 3875125 in EPSG:32611"), "{header}");
        assert!(header.contains("element vertex 5\nproperty float x\n"), "{header}");
        assert_eq!(body.len(), 5 * 12 + 4 * 13);
        let floats: Vec<f32> = body[..60].chunks(4).map(|four| f32::from_le_bytes(four.try_into().unwrap())).collect();
        assert_eq!(floats[..3], [0.0, 0.0, 0.0]);
        assert_eq!(floats[6..9], [50.0, 62.5, 1.0]);
        assert_eq!(floats[12..], [28.125, 35.15625, -1.0 / 128.0]);
        assert_eq!(body[60..73], [3, 0, 0, 0, 0, 1, 0, 0, 0, 4, 0, 0, 0]);
    }

    #[test]
    fn map_coordinates_are_64_bits_and_name_their_system() {
        let (header, body) = ply(Coordinates::Map);
        assert!(header.contains("\ncomment crs EPSG:32611\n"), "{header}");
        assert!(header.contains("property double z\n"), "{header}");
        let x = f64::from_le_bytes(body[..8].try_into().unwrap());
        let y = f64::from_le_bytes(body[8..16].try_into().unwrap());
        assert_eq!((x, y), (505_050.0, 3_875_125.0));
    }

    #[test]
    fn an_obj_counts_its_vertices_from_one() {
        let mut bytes = Vec::new();
        write_tin_obj(&mut bytes, &square(), &place(), Coordinates::Local).unwrap();
        let text = String::from_utf8(bytes).unwrap();
        assert!(text.contains("\nv 28.125 35.15625 -0.0078125\nf 1 2 5\n"), "{text}");
        assert_eq!(text.lines().filter(|line| line.starts_with("f ")).count(), 4);
    }
}
