//! Residuals at places anywhere: those of a source whose coordinate system is another.

use std::collections::BTreeMap;

use terrain::{LoadModule, ModuleGrid, Spacing};

use crate::Tally;

/// Cells along a side of a load module in which places are looked up.
const CELLS: usize = 32;

/// Share of the triangle by which rounding may put a place on an edge outside both sides of it.
pub(crate) const ON_EDGE: f64 = 1e-9;

/// Residuals at places inside `modules`, each counted once: one on a side belongs to the load module north or east of
/// it, on the area's far borders to the one there.
///
/// Places are east and north of the area's south-west post and a height, all in quanta of 1/128 m.
pub fn residuals_at_places(modules: &[LoadModule], grid: ModuleGrid, spacing: Spacing, places: &[[f64; 3]]) -> Tally {
    let side = f64::from(grid.side_cells) * f64::from(spacing.quanta_per_post());
    let number = |at: f64, count: u32| {
        let number = (at / side).floor();
        let is_far = at == side * f64::from(count);
        let number = if is_far { f64::from(count) - 1.0 } else { number };
        (0.0 <= number && number < f64::from(count)).then_some(number as u32)
    };
    let mut of_module: BTreeMap<(u32, u32), Vec<[f64; 3]>> = BTreeMap::new();
    for &[east, north, height] in places {
        if let (Some(row), Some(col)) = (number(north, grid.rows), number(east, grid.cols)) {
            let local = [east - f64::from(col) * side, north - f64::from(row) * side, height];
            of_module.entry((row, col)).or_default().push(local);
        }
    }
    let mut tally = Tally::default();
    for module in modules {
        if let Some(places) = of_module.get(&(module.id.row, module.id.col)) {
            count(module, side, places, &mut tally);
        }
    }
    tally
}

/// Counts places of one load module, from its south-west corner.
fn count(module: &LoadModule, side: f64, places: &[[f64; 3]], tally: &mut Tally) {
    let mut is_counted = vec![false; places.len()];
    each_under(module, side, places, &mut |index, _, plane| {
        if !std::mem::replace(&mut is_counted[index], true) {
            tally.add((places[index][2] - plane).round() as i32);
        }
    });
}

/// Calls `each` with every place that a triangle of the ground holds, by its number, the triangle's, and the height of
/// its plane there; one on an edge comes more than once.
pub(crate) fn each_under(module: &LoadModule, side: f64, places: &[[f64; 3]], each: &mut dyn FnMut(usize, usize, f64)) {
    let cell = |at: f64| ((at / side * CELLS as f64) as usize).min(CELLS - 1);
    let mut cells: Vec<Vec<usize>> = vec![Vec::new(); CELLS * CELLS];
    for (index, [x, y, _]) in places.iter().enumerate() {
        cells[cell(*y) * CELLS + cell(*x)].push(index);
    }
    for (number, triangle) in module.triangles.iter().enumerate() {
        let corners = triangle.map(|corner| {
            let vertex = module.vertices[usize::from(corner)];
            [f64::from(vertex.x), f64::from(vertex.y), f64::from(vertex.z)]
        });
        let span = |axis: usize| {
            let low = corners.iter().map(|corner| corner[axis]).fold(f64::INFINITY, f64::min);
            let high = corners.iter().map(|corner| corner[axis]).fold(0.0, f64::max);
            cell(low)..=cell(high)
        };
        for row in span(1) {
            for index in span(0).flat_map(|col| &cells[row * CELLS + col]) {
                let [x, y, _] = places[*index];
                if let Some(plane) = height_in(corners, [x, y]) {
                    each(*index, number, plane);
                }
            }
        }
    }
}

/// The height of a closed triangle at a place in it.
pub(crate) fn height_in([a, b, c]: [[f64; 3]; 3], [x, y]: [f64; 2]) -> Option<f64> {
    let whole = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
    let of_b = ((x - a[0]) * (c[1] - a[1]) - (y - a[1]) * (c[0] - a[0])) / whole;
    let of_c = ((b[0] - a[0]) * (y - a[1]) - (b[1] - a[1]) * (x - a[0])) / whole;
    let is_inside = -ON_EDGE <= of_b && -ON_EDGE <= of_c && of_b + of_c <= 1.0 + ON_EDGE;
    is_inside.then(|| a[2] + of_b * (b[2] - a[2]) + of_c * (c[2] - a[2]))
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use terrain::{ModuleId, ModuleVertex};

    /// A load module of 100 m at `col` on a plane that rises 1 m every 10 m to the east.
    pub(crate) fn ramp(col: u32) -> LoadModule {
        let vertex = |y, x: u16| ModuleVertex { y, x, z: (i32::from(x) + col as i32 * 12_800) / 10 };
        LoadModule {
            id: ModuleId { row: 0, col },
            side: 12_800,
            vertices: vec![vertex(0, 0), vertex(0, 12_800), vertex(12_800, 0), vertex(12_800, 12_800)],
            triangles: vec![[0, 1, 3], [0, 3, 2]],
            classes: vec![0, 0],
            polygon_count: 2,
            ..LoadModule::default()
        }
    }

    #[test]
    fn every_place_in_the_area_is_counted_once_and_others_are_not() {
        let (grid, spacing) = (ModuleGrid { rows: 1, cols: 2, side_cells: 4 }, Spacing::from_metres(25.0).unwrap());
        let place = |east: f64, north: f64| [east * 128.0, north * 128.0, (east / 10.0 + 1.0) * 128.0];
        // A corner, the line between both, the far corner, a place inside; then two outside.
        let inside = [place(0.0, 0.0), place(100.0, 50.0), place(200.0, 100.0), place(33.3, 66.6)];
        let all: Vec<[f64; 3]> = inside.into_iter().chain([place(-1.0, 5.0), place(5.0, 100.5)]).collect();
        let tally = residuals_at_places(&[ramp(0), ramp(1)], grid, spacing, &all);
        assert_eq!((tally.posts, tally.largest), (4, 128));
        assert_eq!(residuals_at_places(&[ramp(1)], grid, spacing, &all).posts, 2);
    }
}
