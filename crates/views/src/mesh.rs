//! A TIN as PLY or OBJ, for viewers.
//!
//! Most viewers keep coordinates as 32-bit floats, in which a northing of 5,000 km has steps of half a metre. So local
//! coordinates, from the TIN's south-west post, are the default: on a grid with a spacing in sixteenths of a metre
//! every vertex is a whole number of 1/128 m, which a 32-bit float holds exactly up to 131 km. Geographic programs
//! want the place on the map instead; they get 64-bit floats.

use std::io::{Result, Write};

use terrain::{QUANTA_PER_METRE, Tin, Vertex, metres_of_quanta};

/// Where a TIN's lattice lies on the ground.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeshPlace {
    /// Easting of post (0, 0), in metres.
    pub east_m: f64,
    /// Northing of post (0, 0), in metres.
    pub north_m: f64,
    /// Metres between posts, west to east and south to north.
    pub spacing_m: [f64; 2],
    /// EPSG code of the coordinate system, where it is known.
    pub epsg: Option<u32>,
}

/// What coordinates are counted from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Coordinates {
    /// From the TIN's south-west post: 32-bit floats, for Blender, MeshLab and the like.
    Local,
    /// Eastings and northings: 64-bit floats, for QGIS and other geographic programs.
    Map,
}

impl MeshPlace {
    /// East, north and up of a vertex of `tin` in metres, from `origin`.
    fn position(&self, tin: &Tin, vertex: &Vertex, origin: [f64; 2]) -> [f64; 3] {
        let posts = |lattice: i32| f64::from(lattice) / f64::from(tin.steps_per_post);
        let east_m = self.east_m - origin[0] + posts(vertex.at.col) * self.spacing_m[0];
        let north_m = self.north_m - origin[1] + posts(vertex.at.row) * self.spacing_m[1];
        [east_m, north_m, metres_of_quanta(vertex.height)]
    }

    /// What coordinates of `tin` are counted from.
    fn origin(&self, tin: &Tin, coordinates: Coordinates) -> [f64; 2] {
        let (col, row) = (f64::from(tin.rect.west), f64::from(tin.rect.south));
        match coordinates {
            Coordinates::Local => [self.east_m + col * self.spacing_m[0], self.north_m + row * self.spacing_m[1]],
            Coordinates::Map => [0.0, 0.0],
        }
    }

    /// What a reader needs to know about the place, a line each. QGIS takes the system from `crs …`.
    fn comments(&self, origin: [f64; 2], coordinates: Coordinates) -> Vec<String> {
        let system = self.epsg.map(|code| format!("EPSG:{code}"));
        let mut lines = vec![format!("x east, y north, z up, in metres; heights in steps of 1/{QUANTA_PER_METRE} m")];
        match coordinates {
            Coordinates::Local => {
                let system = system.unwrap_or("an unknown coordinate system".into());
                let [east_m, north_m] = origin;
                lines.push(format!("offset east {east_m} north {north_m} in {system}: add it to x and y"));
            }
            Coordinates::Map => lines.extend(system.map(|system| format!("crs {system}"))),
        }
        lines
    }
}

/// Writes `tin` as binary little-endian PLY. Nothing is buffered here: give it a `BufWriter`.
///
/// # Errors
/// Those of `out`.
pub fn write_ply(out: &mut impl Write, tin: &Tin, place: &MeshPlace, coordinates: Coordinates) -> Result<()> {
    let origin = place.origin(tin, coordinates);
    let kind = match coordinates {
        Coordinates::Local => "float",
        Coordinates::Map => "double",
    };
    writeln!(out, "ply\nformat binary_little_endian 1.0")?;
    for line in place.comments(origin, coordinates) {
        writeln!(out, "comment {line}")?;
    }
    writeln!(out, "element vertex {}", tin.vertices.len())?;
    for axis in ["x", "y", "z"] {
        writeln!(out, "property {kind} {axis}")?;
    }
    writeln!(out, "element face {}\nproperty list uchar int vertex_indices\nend_header", tin.triangles.len())?;
    for vertex in &tin.vertices {
        for metres in place.position(tin, vertex, origin) {
            match coordinates {
                Coordinates::Local => out.write_all(&(metres as f32).to_le_bytes())?,
                Coordinates::Map => out.write_all(&metres.to_le_bytes())?,
            }
        }
    }
    for triangle in &tin.triangles {
        out.write_all(&[3])?;
        for corner in triangle {
            out.write_all(&corner.to_le_bytes())?;
        }
    }
    Ok(())
}

/// Writes `tin` as OBJ, z up. Nothing is buffered here: give it a `BufWriter`.
///
/// # Errors
/// Those of `out`.
pub fn write_obj(out: &mut impl Write, tin: &Tin, place: &MeshPlace, coordinates: Coordinates) -> Result<()> {
    let origin = place.origin(tin, coordinates);
    for line in place.comments(origin, coordinates) {
        writeln!(out, "# {line}")?;
    }
    for vertex in &tin.vertices {
        let [x, y, z] = place.position(tin, vertex, origin);
        // The shortest digits that read back as the same number.
        writeln!(out, "v {x} {y} {z}")?;
    }
    for [a, b, c] in &tin.triangles {
        writeln!(out, "f {} {} {}", a + 1, b + 1, c + 1)?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use terrain::{LatticePoint, PostRect};

    const PLACE: MeshPlace =
        MeshPlace { east_m: 505_000.0, north_m: 3_875_000.0, spacing_m: [25.0, 31.25], epsg: Some(32611) };

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
        write_ply(&mut bytes, &square(), &PLACE, coordinates).unwrap();
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
        write_obj(&mut bytes, &square(), &PLACE, Coordinates::Local).unwrap();
        let text = String::from_utf8(bytes).unwrap();
        assert!(text.contains("\nv 28.125 35.15625 -0.0078125\nf 1 2 5\n"), "{text}");
        assert_eq!(text.lines().filter(|line| line.starts_with("f ")).count(), 4);
    }
}
