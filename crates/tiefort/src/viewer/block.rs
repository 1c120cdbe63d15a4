//! A block of load modules as the page reads it.
//!
//! Load modules follow each other row by row from the south-west, each beginning at a multiple of 4 bytes:
//! thirteen u32 (row, column, vertices, triangles, polygons, posts measured, vertices on the southern, eastern,
//! northern and western side, vertices and triangles of decks, bytes of objects), two f32 (root mean square and largest
//! residual, metres), the vertices (x and y as u16, z as i32, quanta), the triangles (three u16 each), the four sides
//! (u16 each), the classes (u8 each), zeros up to a multiple of 4 bytes; then vertices, triangles and classes of decks
//! likewise, and zeros; then what stands there, as the part *objects* of a file has it (docs/FORMAT.md).

use load_module_reader::{Block, Module, Vertex};

use super::area::Viewed;
use super::overview::residuals_m;

/// The load modules of `block` at a level of detail.
///
/// # Errors
/// In words, when there is no such level, or one cannot be read.
pub fn bytes(viewed: &Viewed, block: Block, level: u16) -> Result<Vec<u8>, String> {
    let ground = viewed.area.load_level(block, level).map_err(|error| error.to_string())?;
    let mut out = Vec::new();
    for module in ground.modules() {
        write(module.module(), &mut out);
    }
    Ok(out)
}

fn write(module: &Module, out: &mut Vec<u8>) {
    let sides = [0, 1, 2, 3].map(|side: usize| module.sides[side].len() as u32);
    let (vertices, triangles) = (module.vertices.len() as u32, module.triangles.len() as u32);
    let counts = [module.row, module.col, vertices, triangles, module.polygon_count, module.residual.posts];
    let decks = [module.decks.vertices.len() as u32, module.decks.triangles.len() as u32];
    let objects = if module.objects.is_empty() { Vec::new() } else { module.objects.to_part() };
    for word in counts.into_iter().chain(sides).chain(decks).chain([objects.len() as u32]) {
        out.extend(word.to_le_bytes());
    }
    for figure in residuals_m(module) {
        out.extend(figure.to_le_bytes());
    }
    write_vertices(&module.vertices, out);
    for index in module.triangles.iter().flatten().chain(module.sides.iter().flatten()) {
        out.extend(index.to_le_bytes());
    }
    out.extend(&module.classes);
    out.resize(out.len().next_multiple_of(4), 0);
    write_vertices(&module.decks.vertices, out);
    for index in module.decks.triangles.iter().flatten() {
        out.extend(index.to_le_bytes());
    }
    out.extend(&module.decks.classes);
    out.resize(out.len().next_multiple_of(4), 0);
    out.extend(objects);
}

fn write_vertices(vertices: &[Vertex], out: &mut Vec<u8>) {
    for vertex in vertices {
        out.extend(vertex.x.to_le_bytes());
        out.extend(vertex.y.to_le_bytes());
        out.extend(vertex.z.to_le_bytes());
    }
}

#[cfg(test)]
mod tests {
    use load_module_reader::{Decks, Residual};

    use super::*;

    #[test]
    fn a_load_module_fills_whole_words_and_begins_with_its_counts() {
        let vertex = |x, y| Vertex { x, y, z: -7 };
        let module = Module {
            row: 3,
            col: 5,
            level: 0,
            vertices: vec![vertex(0, 0), vertex(64000, 0), vertex(0, 64000), vertex(64000, 64000)],
            triangles: vec![[0, 1, 3], [0, 3, 2]],
            classes: vec![0, 1],
            sides: [vec![0, 1], vec![1, 3], vec![2, 3], vec![0, 2]],
            polygon_count: 1,
            residual: Residual { posts: 4, largest: 256, sum_abs: 256, sum_squared: 65536 },
            decks: Decks {
                vertices: vec![vertex(0, 0), vertex(9, 0), vertex(0, 9)],
                triangles: vec![[0, 1, 2]],
                classes: vec![2],
            },
            lines: Vec::new(),
            objects: terrain::Objects::default(),
            unknown_parts: Vec::new(),
        };
        let mut out = Vec::new();
        write(&module, &mut out);
        let ground = 52 + 8 + 4 * 8 + 2 * 6 + 8 * 2 + 4;
        assert_eq!(out.len(), ground + 3 * 8 + 6 + 2);
        let word = |place: usize| u32::from_le_bytes([0, 1, 2, 3].map(|byte| out[4 * place + byte]));
        assert_eq!([0, 1, 2, 3, 4, 5, 6, 9, 10, 11, 12].map(word), [3, 5, 4, 2, 1, 4, 2, 2, 3, 1, 0]);
        assert_eq!([13, 14].map(|place| f32::from_bits(word(place))), [1.0, 2.0]);
        assert_eq!(out[ground - 4..ground], [0, 1, 0, 0]);
        assert_eq!(out[out.len() - 8..], [0, 0, 1, 0, 2, 0, 2, 0]);
    }
}
