//! A mesh as PLY or OBJ, z up, with what a reader needs to know of its place as comments.

use std::io::{Result, Write};

use crate::{Coordinates, Facts, Mesh, Product};

/// Writes `mesh` as binary little-endian PLY. Faces have corners only, since readers (meshio is one) take all lists to
/// lie one behind the other; so triangles come class by class, and comments say which are whose. Coordinates are 32-bit
/// floats where these are exact, else 64-bit ones. Nothing is buffered here: give it a `BufWriter`.
///
/// # Errors
/// Those of `out`.
pub fn write_ply(out: &mut impl Write, product: &Product, mesh: &Mesh, coordinates: Coordinates) -> Result<()> {
    let facts = Facts::z_up(product, coordinates);
    let is_short = coordinates == Coordinates::Local && mesh.fits_floats();
    let mut comments = facts.comments(product);
    let mut first = 0;
    for class in mesh.classes_present() {
        let end = first + mesh.of_class(class).count();
        comments.push(format!("class {class} faces {first} to {}", end - 1));
        first = end;
    }
    let triangles = mesh.classes_present().into_iter().flat_map(|class| mesh.of_class(class));
    let ply = Ply { comments: &comments, is_short, face_count: mesh.triangles.len() };
    put_ply(out, &ply, metres(mesh, product, &facts), triangles)
}

/// Writes `mesh` as OBJ, the triangles of each class as a group. Nothing is buffered here: give it a `BufWriter`.
///
/// # Errors
/// Those of `out`.
pub fn write_obj(out: &mut impl Write, product: &Product, mesh: &Mesh, coordinates: Coordinates) -> Result<()> {
    let facts = Facts::z_up(product, coordinates);
    put_obj_vertices(out, &facts.comments(product), metres(mesh, product, &facts))?;
    for class in mesh.classes_present() {
        writeln!(out, "g class_{class}")?;
        put_obj_faces(out, mesh.of_class(class))?;
    }
    Ok(())
}

/// Coordinates of the vertices as the file has them.
fn metres<'a>(mesh: &'a Mesh, product: &Product, facts: &Facts) -> impl ExactSizeIterator<Item = [f64; 3]> + use<'a> {
    let corner_m = Facts::z_up(product, Coordinates::Local).offset_m;
    // What to add to coordinates from the mesh's south-west corner.
    let offset = [0, 1, 2].map(|axis| corner_m[axis] - facts.offset_m[axis]);
    mesh.metres().map(move |place| [0, 1, 2].map(|axis| place[axis] + offset[axis]))
}

/// What a PLY says in its header beside its vertices.
pub(crate) struct Ply<'a> {
    /// A line each.
    pub comments: &'a [String],
    /// Whether coordinates are 32-bit floats, else 64-bit ones.
    pub is_short: bool,
    pub face_count: usize,
}

/// A binary little-endian PLY.
pub(crate) fn put_ply<'a>(
    out: &mut impl Write,
    ply: &Ply,
    vertices: impl ExactSizeIterator<Item = [f64; 3]>,
    triangles: impl Iterator<Item = &'a [u32; 3]>,
) -> Result<()> {
    writeln!(out, "ply\nformat binary_little_endian 1.0")?;
    ply.comments.iter().try_for_each(|line| writeln!(out, "comment {line}"))?;
    writeln!(out, "element vertex {}", vertices.len())?;
    for axis in ["x", "y", "z"] {
        writeln!(out, "property {} {axis}", if ply.is_short { "float" } else { "double" })?;
    }
    writeln!(out, "element face {}", ply.face_count)?;
    writeln!(out, "property list uchar int vertex_indices\nend_header")?;
    for metres in vertices.flatten() {
        match ply.is_short {
            true => out.write_all(&(metres as f32).to_le_bytes())?,
            false => out.write_all(&metres.to_le_bytes())?,
        }
    }
    for triangle in triangles {
        out.write_all(&[3])?;
        triangle.iter().try_for_each(|corner| out.write_all(&corner.to_le_bytes()))?;
    }
    Ok(())
}

/// The beginning of an OBJ, up to its faces.
pub(crate) fn put_obj_vertices(
    out: &mut impl Write,
    comments: &[String],
    mut vertices: impl Iterator<Item = [f64; 3]>,
) -> Result<()> {
    comments.iter().try_for_each(|line| writeln!(out, "# {line}"))?;
    // The shortest digits that read back as the same number.
    vertices.try_for_each(|[x, y, z]| writeln!(out, "v {x} {y} {z}"))
}

/// Faces of an OBJ, which counts vertices from one.
pub(crate) fn put_obj_faces<'a>(out: &mut impl Write, triangles: impl Iterator<Item = &'a [u32; 3]>) -> Result<()> {
    triangles.into_iter().try_for_each(|[a, b, c]| writeln!(out, "f {} {} {}", a + 1, b + 1, c + 1))
}

impl Mesh {
    /// The triangles of a class.
    fn of_class(&self, class: u8) -> impl Iterator<Item = &[u32; 3]> {
        self.triangles.iter().zip(&self.classes).filter(move |(_, of)| **of == class).map(|(triangle, _)| triangle)
    }

    /// Every class that a triangle has, in order.
    pub(crate) fn classes_present(&self) -> Vec<u8> {
        let mut present = [false; 256];
        self.classes.iter().for_each(|&class| present[usize::from(class)] = true);
        (0..=u8::MAX).filter(|&class| present[usize::from(class)]).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::samples;

    fn text(coordinates: Coordinates) -> String {
        let product = samples::product();
        let mut bytes = Vec::new();
        write_obj(&mut bytes, &product, &Mesh::of(&product), coordinates).unwrap();
        String::from_utf8(bytes).unwrap()
    }

    #[test]
    fn an_obj_has_groups_of_classes_and_stands_where_asked() {
        let local = text(Coordinates::Local);
        assert!(local.contains("\nv 0 0 1000\n") && local.contains("\ng class_0\n") && local.contains("\ng class_1\n"));
        assert_eq!(local.lines().filter(|line| line.starts_with("f ")).count(), 6);
        assert!(text(Coordinates::Map).contains("# crs EPSG:32611\nv 505000 3875000 1000\n"));
    }

    #[test]
    fn a_ply_is_as_long_as_its_header_promises() {
        let product = samples::product();
        let mesh = Mesh::of(&product);
        for (coordinates, vertex_bytes) in [(Coordinates::Local, 12), (Coordinates::Map, 24)] {
            let mut bytes = Vec::new();
            write_ply(&mut bytes, &product, &mesh, coordinates).unwrap();
            let header = bytes.windows(11).position(|window| window == b"end_header\n").unwrap() + 11;
            assert_eq!(bytes.len() - header, 7 * vertex_bytes + 6 * 13);
            let text = String::from_utf8_lossy(&bytes[..header]).into_owned();
            assert!(text.contains("\ncomment class 0 faces 0 to 2\ncomment class 1 faces 3 to 5\n"), "{text}");
            // Each line of data has the same length, as readers take it that know no other property than corners.
            assert!(bytes[header + 7 * vertex_bytes..].chunks(13).all(|face| face[0] == 3));
        }
    }
}
