//! The coarser mesh of a square: two triangles to a load module, over the corners that load modules have anyway; and
//! how far the ground lies from it, measured exactly.

use std::collections::BTreeMap;

use terrain::{HOLE_CLASS, LoadModule, ModuleId, ModuleRect, QUANTA_PER_METRE};

use crate::Product;
use crate::mesh::Mesh;

/// Corners of the load modules of a square, and the triangles between them; load modules that are holes for more than
/// half are left out.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Coarse {
    /// Vertices of the mesh, row by row from the south-west.
    pub vertices: Vec<u32>,
    /// Corners by place in `vertices`, counter-clockwise.
    pub triangles: Vec<[u32; 3]>,
    /// For each triangle the class that most of its load module has.
    pub classes: Vec<u8>,
    /// Largest distance, straight up or down, between these triangles and those of the mesh, in metres; a load module's
    /// side where one is a hole in part.
    pub error_m: f64,
}

impl Coarse {
    /// That of the load modules of `rect`.
    pub(crate) fn of(product: &Product, mesh: &Mesh, rect: ModuleRect) -> Self {
        let mut coarse = Self::default();
        for row in rect.south..=rect.north {
            for col in rect.west..=rect.east {
                coarse.vertices.push(corner_vertex(product, mesh, row, col));
            }
        }
        let wide = rect.cols() + 1;
        for (row, col) in (0..rect.rows()).flat_map(|row| (0..rect.cols()).map(move |col| (row, col))) {
            let id = ModuleId { row: rect.south + row, col: rect.west + col };
            let Some(class) = product.module(id).map_or(Some(0), usual_class) else { continue };
            let south_west = row * wide + col;
            let (south_east, north_west) = (south_west + 1, south_west + wide);
            let north_east = north_west + 1;
            coarse.triangles.extend([[south_west, south_east, north_east], [south_west, north_east, north_west]]);
            coarse.classes.extend([class; 2]);
        }
        let modules = || rect.iter().filter_map(|id| product.module(id));
        // Where ground ends inside of a load module, these two triangles are there or not: it may be its side off.
        let ends = modules().filter(|module| has_ground_in_part(module)).map(|module| f64::from(module.side));
        let errors = modules().map(error_quanta).chain(ends);
        coarse.error_m = errors.fold(0.0, f64::max) / f64::from(QUANTA_PER_METRE);
        coarse
    }
}

/// The vertex of the mesh at the south-west corner of load module (row, col), or beyond the last one.
fn corner_vertex(product: &Product, mesh: &Mesh, row: u32, col: u32) -> u32 {
    let rect = product.rect;
    // A load module that has this corner, and which of its corners it is.
    let (module_row, module_col) = (row.min(rect.north - 1), col.min(rect.east - 1));
    let index = ((module_row - rect.south) * rect.cols() + module_col - rect.west) as usize;
    let module = &product.modules[index];
    let (x, y) = ((col - module_col) as u16 * module.side, (row - module_row) as u16 * module.side);
    for (own, whole) in module.triangles.iter().zip(&mesh.triangles[mesh.module_starts()[index]..]) {
        for (v, vertex) in own.iter().zip(whole) {
            let found = module.vertices[usize::from(*v)];
            if (found.x, found.y) == (x, y) {
                return *vertex;
            }
        }
    }
    unreachable!("the triangles of a load module cover its corners")
}

/// Whether a load module has both ground and a hole.
fn has_ground_in_part(module: &LoadModule) -> bool {
    let holes = module.classes.iter().filter(|class| **class == HOLE_CLASS).count();
    0 < holes && holes < module.classes.len()
}

/// The class that covers most of a load module; `None` where no source has a height over more than half of it.
fn usual_class(module: &LoadModule) -> Option<u8> {
    let doubled_area = |triangle: &[u16; 3]| {
        let [a, b, c] = triangle.map(|v| {
            let v = module.vertices[usize::from(v)];
            [i64::from(v.x), i64::from(v.y)]
        });
        (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
    };
    let mut areas = BTreeMap::from([(HOLE_CLASS, 0)]);
    for (triangle, &class) in module.triangles.iter().zip(&module.classes) {
        *areas.entry(class).or_insert(0) += doubled_area(triangle);
    }
    let holes = areas.remove(&HOLE_CLASS).unwrap_or(0);
    let is_hole = i64::from(module.side) * i64::from(module.side) < holes;
    // Of two that cover as much, that of the lower number.
    let widest = areas.into_iter().rev().max_by_key(|(_, area)| *area);
    if is_hole { None } else { widest.map(|(class, _)| class) }
}

/// Largest distance in quanta between a load module and the two triangles over its corners. Both are flat between
/// edges, so it is found at a vertex, or where an edge crosses the diagonal.
fn error_quanta(module: &LoadModule) -> f64 {
    let side = f64::from(module.side);
    let corner = |x: u16, y: u16| module.vertices.iter().find(|v| (v.x, v.y) == (x, y)).map_or(0.0, |v| f64::from(v.z));
    let (last, none) = (module.side, 0);
    let [sw, se, ne, nw] = [corner(none, none), corner(last, none), corner(last, last), corner(none, last)];
    let coarse = |x: f64, y: f64| match y <= x {
        true => sw + (se - sw) * x / side + (ne - se) * y / side,
        false => sw + (nw - sw) * y / side + (ne - nw) * x / side,
    };
    let mut largest: f64 = 0.0;
    for triangle in &module.triangles {
        let corners = triangle.map(|v| {
            let v = module.vertices[usize::from(v)];
            [f64::from(v.x), f64::from(v.y), f64::from(v.z)]
        });
        for (a, b) in [(0, 1), (1, 2), (2, 0)].map(|(a, b)| (corners[a], corners[b])) {
            largest = largest.max((a[2] - coarse(a[0], a[1])).abs());
            let (above_a, above_b) = (a[1] - a[0], b[1] - b[0]);
            if above_a * above_b < 0.0 {
                let share = above_a / (above_a - above_b);
                let [x, y, z] = [0, 1, 2].map(|axis| a[axis] + share * (b[axis] - a[axis]));
                largest = largest.max((z - coarse(x, y)).abs());
            }
        }
    }
    largest
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::samples;

    #[test]
    fn a_coarse_square_has_two_triangles_to_a_load_module_and_a_measured_error() {
        let product = samples::product();
        let mesh = Mesh::whole(&product);
        let coarse = Coarse::of(&product, &mesh, product.rect);
        assert_eq!((coarse.vertices.len(), coarse.triangles.len()), (6, 4));
        let places: Vec<[i32; 3]> = coarse.vertices.iter().map(|&v| mesh.vertices[v as usize]).collect();
        assert_eq!(places[0], [0, 0, 128_000]);
        assert_eq!(places[5], [128_000, 64_000, 127_872]);
        // The western load module is its two triangles; the eastern one has a pit at (250 m, 200 m).
        let coarse_there = 128_256.0 - 256.0 * 0.5 - 128.0 * 0.4;
        let expected = (coarse_there - 127_000.0) / 128.0;
        assert!((coarse.error_m - expected).abs() < 1e-9, "{} {expected}", coarse.error_m);
    }
}
