//! The triangle of a product's ground at any place, found by the cells of its load module.

use std::collections::BTreeMap;

use terrain::geometry::Cells;
use terrain::{LoadModule, ModuleId, QUANTA_PER_METRE};

use crate::Product;

/// Triangles that meet a cell, on average, about.
const TRIANGLES_PER_CELL: usize = 2;
/// Cells along a side of a load module at most.
const CELLS_MAX: usize = 64;

/// What the ground is at a place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Ground {
    /// Height above the product's datum in metres.
    pub height_m: f64,
    /// Class of the triangle.
    pub class: u8,
}

/// Finds triangles of a product; the cells of a load module are made when it is first asked for.
pub(crate) struct TriangleIndex<'a> {
    product: &'a Product,
    cells: BTreeMap<ModuleId, Cells>,
}

impl<'a> TriangleIndex<'a> {
    /// An index without any cells yet.
    pub(crate) fn new(product: &'a Product) -> Self {
        Self { product, cells: BTreeMap::new() }
    }

    /// The ground at an easting and northing; `None` outside of what is exported.
    pub(crate) fn at(&mut self, place_m: [f64; 2]) -> Option<Ground> {
        let product = self.product;
        let rect = product.rect;
        let (low, high) = (product.corner_m(rect.south, rect.west), product.corner_m(rect.north, rect.east));
        if !(0..2).all(|axis| (low[axis]..=high[axis]).contains(&place_m[axis])) {
            return None;
        }
        let (module, place) = module_at(product, place_m)?;
        let cells = self.cells.entry(module.id).or_insert_with(|| cells_of(module));
        triangle_at(module, cells.at(place), place)
    }
}

/// The triangles of a load module, by number, in cells over its square.
pub(crate) fn cells_of(module: &LoadModule) -> Cells {
    let (side, count) = (f64::from(module.side), module.triangles.len());
    let per_side = (count / TRIANGLES_PER_CELL).isqrt().clamp(1, CELLS_MAX);
    let plan = |number: u32| corners_of(module, module.triangles[number as usize]).map(|[x, y, _]| [x, y]);
    Cells::new([0.0; 2], [side; 2], side / per_side as f64, count as u32, plan)
}

/// The load module at an easting and northing, and the place in it in quanta.
fn module_at(product: &Product, [east_m, north_m]: [f64; 2]) -> Option<(&LoadModule, [f64; 2])> {
    let rect = product.rect;
    let index = |metres: f64, first: u32, last: u32| ((metres / product.side_m()) as u32).clamp(first, last);
    let (x, y) = (east_m - product.frame.origin_east_m, north_m - product.frame.origin_north_m);
    let id = ModuleId { row: index(y, rect.south, rect.north - 1), col: index(x, rect.west, rect.east - 1) };
    let corner = [f64::from(id.col) * product.side_m(), f64::from(id.row) * product.side_m()];
    let quanta = f64::from(QUANTA_PER_METRE);
    Some((product.module(id)?, [(x - corner[0]) * quanta, (y - corner[1]) * quanta]))
}

/// Corners of a triangle of a load module, in quanta.
pub(crate) fn corners_of(module: &LoadModule, triangle: [u16; 3]) -> [[f64; 3]; 3] {
    triangle.map(|v| {
        let v = module.vertices[usize::from(v)];
        [f64::from(v.x), f64::from(v.y), f64::from(v.z)]
    })
}

/// The height of a triangle at a place in it, or on its border.
pub(crate) fn height_in(corners: [[f64; 3]; 3], place: [f64; 2]) -> Option<f64> {
    let (least, height) = plane_at(corners, place);
    (0.0 <= least).then_some(height)
}

/// The least share that a corner of a triangle has in a place, negative outside of it, and the height of its plane.
fn plane_at([a, b, c]: [[f64; 3]; 3], [x, y]: [f64; 2]) -> (f64, f64) {
    let left = |a: [f64; 3], b: [f64; 3]| (b[0] - a[0]) * (y - a[1]) - (b[1] - a[1]) * (x - a[0]);
    let shares = [left(b, c), left(c, a), left(a, b)];
    let whole: f64 = shares.iter().sum();
    let least = shares.iter().fold(f64::INFINITY, |least, share| least.min(share / whole));
    (least, (a[2] * shares[0] + b[2] * shares[1] + c[2] * shares[2]) / whole)
}

/// The ground at a place in quanta, of the first of some triangles that has it, or else of the one next to it.
fn triangle_at(module: &LoadModule, candidates: &[u32], place: [f64; 2]) -> Option<Ground> {
    let mut best = (f64::NEG_INFINITY, None);
    for &number in candidates {
        let (least, height) = plane_at(corners_of(module, module.triangles[number as usize]), place);
        if best.0 < least {
            let height_m = height / f64::from(QUANTA_PER_METRE);
            best = (least, Some(Ground { height_m, class: module.classes[number as usize] }));
        }
        if 0.0 <= least {
            break;
        }
    }
    best.1
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::samples;

    #[test]
    fn cells_find_the_triangle_that_a_search_through_all_finds() {
        let product = samples::product();
        let mut index = TriangleIndex::new(&product);
        for (row, col) in (0..=100).flat_map(|row| (0..=200).map(move |col| (row, col))) {
            let place_m = [505_000.0 + 5.0 * f64::from(col), 3_875_000.0 + 5.0 * f64::from(row)];
            let (module, place) = module_at(&product, place_m).unwrap();
            let all: Vec<u32> = (0..module.triangles.len() as u32).collect();
            assert_eq!(index.at(place_m), triangle_at(module, &all, place));
        }
        assert_eq!(index.at([505_250.0, 3_875_000.0]).unwrap().height_m, 1001.0);
        assert_eq!(index.at([504_999.0, 3_875_000.0]), None);
        assert_eq!(index.at([505_250.0, 3_875_500.5]), None);
    }
}
