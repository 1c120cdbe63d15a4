//! A mesh as PLY or OBJ, z up, with what a reader needs to know of its place as comments.

use std::io::{Result, Write};

use crate::mesh::class_groups;
use crate::sheets::Material;
use crate::{Coordinates, Facts, Mesh, Product, Sheet, Texture};

/// Writes `mesh` as binary little-endian PLY. Faces have corners only, since readers (meshio is one) take all lists to
/// lie one behind the other; so triangles come class by class, those of decks after all of the ground, and comments say
/// which are whose. Coordinates are 32-bit floats where these are exact, else 64-bit ones. Nothing is buffered here:
/// give it a `BufWriter`.
///
/// # Errors
/// Those of `out`.
pub fn write_ply(out: &mut impl Write, product: &Product, mesh: &Mesh, coordinates: Coordinates) -> Result<()> {
    let facts = Facts::z_up(product, coordinates);
    let is_short = coordinates == Coordinates::Local && mesh.fits_floats();
    let mut comments = facts.comments(product);
    let (groups, classes) = (mesh.groups(), product.classes());
    let mut first = 0;
    for &group in &groups {
        let end = first + mesh.of_group(group).count();
        let Material { sheet, class } = group;
        let kind = if sheet == Sheet::Ground { "class".to_owned() } else { format!("{} class", sheet.name()) };
        let is_named = sheet == Sheet::Objects || classes.name(class).is_some();
        let name = if is_named { format!(" {}", group.word(classes)) } else { String::new() };
        comments.push(format!("{kind} {class} faces {first} to {}{name}", end - 1));
        first = end;
    }
    let triangles = groups.iter().flat_map(|&group| mesh.of_group(group));
    let ply = Ply { comments: &comments, is_short, face_count: mesh.triangles.len() };
    put_ply(out, &ply, metres(mesh, product, &facts), triangles)
}

/// Writes `mesh` as OBJ, the triangles of each class as a group, decks as an object of their own, and each building,
/// wood and the like as one. `library` is the
/// name of the file with the materials of [`obj_materials`], where there is one. Nothing is buffered here: give it a
/// `BufWriter`.
///
/// # Errors
/// Those of `out`.
pub fn write_obj(
    out: &mut impl Write,
    product: &Product,
    mesh: &Mesh,
    coordinates: Coordinates,
    library: Option<&str>,
    texture: Option<&Texture>,
) -> Result<()> {
    let facts = Facts::z_up(product, coordinates);
    let mut comments = facts.comments(product);
    let (groups, classes) = (mesh.groups(), product.classes());
    let named = groups.iter().filter(|group| group.sheet == Sheet::Ground && classes.name(group.class).is_some());
    comments.extend(named.map(|group| format!("class {} {}", group.class, classes.word(group.class))));
    put_obj_comments(out, &comments)?;
    if let Some(library) = library {
        writeln!(out, "mtllib {library}")?;
    }
    put_obj_vertices(out, metres(mesh, product, &facts))?;
    if let Some(texture) = texture {
        let all: Vec<u32> = (0..mesh.vertices.len() as u32).collect();
        put_obj_places(out, &mesh.uvs(texture, &all))?;
    }
    let has_materials = library.is_some();
    let mut last = Sheet::Ground;
    for group in groups.into_iter().filter(|group| group.sheet != Sheet::Objects) {
        let Material { sheet, class } = group;
        if sheet != last {
            writeln!(out, "o {}", sheet.name())?;
        }
        last = sheet;
        let prefix = if sheet == Sheet::Ground { String::new() } else { format!("{}_", sheet.name()) };
        writeln!(out, "g {prefix}class_{class}")?;
        if has_materials {
            writeln!(out, "usemtl {}", group.word(classes))?;
        }
        put_obj_faces(out, mesh.of_group(group), texture.is_some())?;
    }
    for (thing, part) in mesh.part(product, Sheet::Objects, product.rect).by_thing() {
        writeln!(out, "o {}", thing.name())?;
        for (class, triangles) in class_groups(&part.triangles, &part.classes) {
            if has_materials {
                writeln!(out, "usemtl {}", Material { sheet: Sheet::Objects, class }.word(classes))?;
            }
            let of_mesh = |triangle: &[u32; 3]| triangle.map(|v| part.vertices[v as usize]);
            put_obj_faces(out, triangles.iter().map(of_mesh).collect::<Vec<_>>().iter(), false)?;
        }
    }
    Ok(())
}

/// The text of a library of materials for an OBJ, one for each class; `None` where all is ground of one class, which
/// needs none. `texture` is the name of the
/// file that all but objects are seen with, where there is one.
pub fn obj_materials(product: &Product, mesh: &Mesh, texture: Option<&str>) -> Option<String> {
    let (groups, classes) = (mesh.groups(), product.classes());
    let mut present: Vec<Material> = groups.iter().map(|group| group.in_library()).collect();
    present.sort_unstable();
    present.dedup();
    let material = |material: Material| {
        let map = texture.filter(|_| material.sheet != Sheet::Objects);
        let color = if map.is_some() { [255; 3] } else { material.color(classes) };
        let [red, green, blue] = color.map(|part| f64::from(part) / 255.0);
        let map = map.map_or_else(String::new, |name| format!("map_Kd {name}\n"));
        format!("newmtl {}\nKd {red:.3} {green:.3} {blue:.3}\nillum 1\n{map}", material.word(classes))
    };
    (1 < groups.len() || texture.is_some()).then(|| present.into_iter().map(material).collect())
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

/// Comments of an OBJ, a line each.
pub(crate) fn put_obj_comments(out: &mut impl Write, comments: &[String]) -> Result<()> {
    comments.iter().try_for_each(|line| writeln!(out, "# {line}"))
}

/// Vertices of an OBJ.
pub(crate) fn put_obj_vertices(out: &mut impl Write, mut vertices: impl Iterator<Item = [f64; 3]>) -> Result<()> {
    // The shortest digits that read back as the same number.
    vertices.try_for_each(|[x, y, z]| writeln!(out, "v {x} {y} {z}"))
}

/// Places of an OBJ's vertices in a texture, which count from its southern side.
pub(crate) fn put_obj_places(out: &mut impl Write, uvs: &[[f32; 2]]) -> Result<()> {
    uvs.iter().try_for_each(|[u, v]| writeln!(out, "vt {u} {}", 1.0 - v))
}

/// Faces of an OBJ, which counts vertices from one; in a texture their corners have the same numbers.
pub(crate) fn put_obj_faces<'a>(
    out: &mut impl Write,
    triangles: impl Iterator<Item = &'a [u32; 3]>,
    has_texture: bool,
) -> Result<()> {
    for triangle in triangles {
        let [a, b, c] = triangle.map(|corner| corner + 1);
        match has_texture {
            true => writeln!(out, "f {a}/{a} {b}/{b} {c}/{c}")?,
            false => writeln!(out, "f {a} {b} {c}")?,
        }
    }
    Ok(())
}

impl Mesh {
    /// The triangles of a material.
    pub(crate) fn of_group(&self, group: Material) -> impl Iterator<Item = &[u32; 3]> {
        let range = self.sheet(group.sheet);
        let all = self.triangles[range.clone()].iter().zip(&self.classes[range]);
        all.filter(move |(_, class)| **class == group.class).map(|(triangle, _)| triangle)
    }

    /// Every material that has a triangle, sheet by sheet.
    pub(crate) fn groups(&self) -> Vec<Material> {
        let present = |sheet: Sheet| {
            let mut present = [false; 256];
            self.classes[self.sheet(sheet)].iter().for_each(|&class| present[usize::from(class)] = true);
            (0..=u8::MAX).filter(move |&class| present[usize::from(class)]).map(move |class| Material { sheet, class })
        };
        Sheet::ALL.into_iter().flat_map(present).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::samples;

    fn text(coordinates: Coordinates) -> String {
        let product = samples::product();
        let mut bytes = Vec::new();
        write_obj(&mut bytes, &product, &Mesh::of(&product), coordinates, None, None).unwrap();
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

    #[test]
    fn decks_are_an_object_of_their_own_and_every_class_has_a_material() {
        let product = samples::with_bridge();
        let mesh = Mesh::of(&product);
        let mut bytes = Vec::new();
        write_obj(&mut bytes, &product, &mesh, Coordinates::Local, Some("a.mtl"), None).unwrap();
        let text = String::from_utf8(bytes).unwrap();
        let words = |line: &&str| !["#", "v ", "f "].iter().any(|start| line.starts_with(start));
        let groups = ["g class_0", "usemtl default", "g class_1", "usemtl motorway"];
        let decks = ["o decks", "g decks_class_1", "usemtl motorway", "g decks_class_2", "usemtl track"];
        let lines: Vec<&str> = text.lines().filter(words).collect();
        assert_eq!(lines, [&["mtllib a.mtl"][..], &groups, &decks].concat());
        assert!(text.contains("\n# class 1 motorway\n") && text.lines().filter(|l| l.starts_with("f ")).count() == 12);
        let materials = obj_materials(&product, &mesh, None).unwrap();
        assert!(materials.contains("newmtl motorway\nKd 0.204 0.188 0.180\n"), "{materials}");
        assert_eq!(materials.matches("newmtl").count(), 3);
        let mut bytes = Vec::new();
        write_ply(&mut bytes, &product, &mesh, Coordinates::Local).unwrap();
        let text = String::from_utf8_lossy(&bytes);
        let decks = ["decks class 1 faces 6 to 9 motorway", "decks class 2 faces 10 to 11 track"];
        for said in ["class 1 faces 3 to 5 motorway", decks[0], decks[1]] {
            assert!(text.contains(&format!("\ncomment {said}")), "{said}");
        }
    }

    #[test]
    fn ground_of_one_class_needs_no_materials() {
        let mut product = samples::product();
        product.modules.iter_mut().for_each(|module| module.classes.fill(0));
        assert_eq!(obj_materials(&product, &Mesh::of(&product), None), None);
    }
}
