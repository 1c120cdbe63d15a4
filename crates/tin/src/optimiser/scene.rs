//! Ground and meshes for tests.

use terrain::limits::{Allowance, ModuleLines, TileLedger, Windows};
use terrain::{
    Dem, Effort, Features, HeightFit, Importance, Lattice, LatticePoint, ModuleGrid, ModuleId, ModuleRect, Post,
    PostRect, SeamSides, THOUSANDTHS, Tin, Vertex,
};

use crate::optimiser::task::{Budget, Task};

/// A number from 0 to 1 that a place decides.
fn noise(row: i32, col: i32, seed: u64) -> f64 {
    let mut bits = seed ^ (row as u64) << 32 ^ col as u32 as u64;
    for _ in 0..3 {
        bits = (bits ^ bits >> 31).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    }
    (bits >> 11) as f64 / (1u64 << 53) as f64
}

/// Rough ground: bilinear noise of several octaves, in quanta.
pub(crate) fn rough(rect: PostRect, seed: u64) -> Dem {
    Dem::from_fn(rect, |post| {
        let height: f64 = [32, 16, 8, 4, 2, 1].iter().map(|&cell| octave(post, cell, seed)).sum();
        Some((height * 300.0) as i32)
    })
}

fn octave(post: Post, cell: i32, seed: u64) -> f64 {
    let (row, col) = (post.row.div_euclid(cell), post.col.div_euclid(cell));
    let (y, x) = (post.row.rem_euclid(cell) as f64 / cell as f64, post.col.rem_euclid(cell) as f64 / cell as f64);
    let at = |row, col| noise(row, col, seed + cell as u64);
    let south = at(row, col) * (1.0 - x) + at(row, col + 1) * x;
    let north = at(row + 1, col) * (1.0 - x) + at(row + 1, col + 1) * x;
    cell as f64 * (south * (1.0 - y) + north * y)
}

/// Weights from 1 to 8 in patches of 16 posts.
pub(crate) fn patchy(rect: PostRect, seed: u64) -> Importance {
    let posts = (rect.south..=rect.north).flat_map(|row| (rect.west..=rect.east).map(move |col| (row, col)));
    let weight = |(row, col): (i32, i32)| (1000.0 + 7000.0 * noise(row / 16, col / 16, seed)) as u16;
    let weights: Vec<u16> = posts.map(weight).collect();
    let classes = vec![0; weights.len()];
    Importance::new(rect, weights, classes)
}

pub(crate) fn even(rect: PostRect) -> Importance {
    Importance::uniform(rect, THOUSANDTHS)
}

/// A mesh of two triangles to every square of `step` posts, at the DEM's heights.
pub(crate) fn grid(dem: &Dem, step: i32) -> Tin {
    let rect = dem.rect();
    let (rows, cols) = (rect.cells_high() as i32 / step, rect.cells_wide() as i32 / step);
    let mut vertices = Vec::new();
    for row in 0..=rows {
        for col in 0..=cols {
            let post = Post::new(rect.south + row * step, rect.west + col * step);
            vertices.push(Vertex { at: post.into(), height: dem.height(post) });
        }
    }
    let index = |row: i32, col: i32| (row * (cols + 1) + col) as u32;
    let mut triangles = Vec::new();
    for row in 0..rows {
        for col in 0..cols {
            let (sw, se) = (index(row, col), index(row, col + 1));
            let (nw, ne) = (index(row + 1, col), index(row + 1, col + 1));
            triangles.extend([[sw, se, ne], [sw, ne, nw]]);
        }
    }
    Tin::new(rect, vertices, triangles)
}

/// A task without load modules.
pub(crate) fn free(triangles: usize, effort: Effort) -> Task {
    Task {
        held: Vec::new(),
        features: Features::default(),
        spacing: None,
        open: SeamSides::OPEN,
        line_step: None,
        budget: Budget::Triangles(triangles),
        in_squares: None,
        effort,
        height_fit: HeightFit::Squares,
        lattice: Lattice::Eighth,
        rms_quanta: None,
        largest_quanta: None,
        forbidden: Vec::new(),
    }
}

/// Limits of a tile of its own, as `confined` gives them.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Caps {
    pub side: i32,
    pub per_module: u32,
    /// Of 2 x 2 load modules.
    pub per_window: u32,
    pub triangles: u32,
}

/// A task under the limits of load modules, the outer border held as the mesh has it.
pub(crate) fn confined(start: &Tin, caps: Caps, effort: Effort) -> Task {
    let rect = start.rect;
    let (low, high) = (LatticePoint::from(rect.south_west()), LatticePoint::from(rect.north_east()));
    let is_outer =
        |at: LatticePoint| at.row == low.row || at.row == high.row || at.col == low.col || at.col == high.col;
    Task {
        held: start.vertices.iter().map(|vertex| vertex.at).filter(|&at| is_outer(at)).collect(),
        open: SeamSides::CLOSED,
        line_step: Some(caps.side),
        budget: Budget::Limits(ledger(rect, caps, allowance(rect, caps))),
        ..free(0, effort)
    }
}

fn modules(rect: PostRect, caps: Caps) -> ModuleRect {
    let count = |cells: usize| cells as u32 / caps.side as u32;
    ModuleRect { south: 0, west: 0, north: count(rect.cells_high()), east: count(rect.cells_wide()) }
}

/// What a tile of its own may spend.
pub(crate) fn allowance(rect: PostRect, caps: Caps) -> Allowance {
    let modules = modules(rect, caps);
    let grid = ModuleGrid { rows: modules.rows(), cols: modules.cols(), side_cells: caps.side };
    let windows = Windows::new(grid, 2);
    Allowance {
        modules,
        module_room: vec![caps.per_module; modules.count()],
        windows: windows.origins,
        window_size: (windows.rows, windows.cols),
        window_room: vec![caps.per_window; windows.origins.count()],
        triangles: caps.triangles,
    }
}

/// The ledger of a tile of its own.
pub(crate) fn ledger(rect: PostRect, caps: Caps, allowance: Allowance) -> TileLedger {
    let reach = modules(rect, caps);
    let south_west = ModuleId { row: 0, col: 0 };
    let lines = ModuleLines { side: caps.side, south_west, rows: reach.rows(), cols: reach.cols(), reach };
    TileLedger::new(lines, allowance)
}

/// What each load module has been given beyond its corners and the held border: triangles, row-major.
pub(crate) fn spent(tin: &Tin, task: &Task, side: i32) -> Vec<u32> {
    let rect = tin.rect;
    let (rows, cols) = (rect.cells_high() as i32 / side, rect.cells_wide() as i32 / side);
    let mut counts = vec![0; (rows * cols) as usize];
    let step = side * terrain::LATTICE_PER_POST;
    for vertex in tin.vertices.iter().filter(|vertex| !task.held.contains(&vertex.at)) {
        let (row, col) = (vertex.at.row, vertex.at.col);
        let mut add = |row: i32, col: i32, count: u32| counts[(row * cols + col) as usize] += count;
        match (row % step == 0, col % step == 0) {
            (true, true) => {}
            (false, false) => add(row / step, col / step, 2),
            (true, false) => {
                add(row / step - 1, col / step, 1);
                add(row / step, col / step, 1);
            }
            (false, true) => {
                add(row / step, col / step - 1, 1);
                add(row / step, col / step, 1);
            }
        }
    }
    counts
}

/// Sum of squared residuals of a finished mesh over every post, found post by post and triangle by triangle, and the
/// largest residual; every post has to lie in some triangle.
pub(crate) fn measured(tin: &Tin, dem: &Dem) -> (f64, f64) {
    let rect = dem.rect();
    let mut residuals: Vec<Option<f64>> = vec![None; rect.post_count()];
    for triangle in &tin.triangles {
        let corners = triangle.map(|vertex| tin.vertices[vertex as usize]);
        let at = corners.map(|vertex| (f64::from(vertex.at.col) / 8.0, f64::from(vertex.at.row) / 8.0));
        let cross = |a: (f64, f64), b: (f64, f64), c: (f64, f64)| (b.0 - a.0) * (c.1 - a.1) - (b.1 - a.1) * (c.0 - a.0);
        let area = cross(at[0], at[1], at[2]);
        let range = |pick: fn(&(f64, f64)) -> f64| {
            let low = at.iter().map(pick).fold(f64::INFINITY, f64::min).ceil() as i32;
            low..=at.iter().map(pick).fold(f64::NEG_INFINITY, f64::max).floor() as i32
        };
        for row in range(|at| at.1) {
            for col in range(|at| at.0) {
                let p = (f64::from(col), f64::from(row));
                let part = [cross(at[1], at[2], p), cross(at[2], at[0], p), cross(at[0], at[1], p)];
                if part.iter().all(|&part| 0.0 <= part) {
                    let height: f64 = (0..3).map(|i| part[i] / area * f64::from(corners[i].height)).sum();
                    let place = rect.index(Post::new(row, col));
                    residuals[place] = Some(f64::from(dem.height(Post::new(row, col))) - height);
                }
            }
        }
    }
    let residuals = residuals.into_iter().map(|residual| residual.expect("every post lies in a triangle"));
    residuals
        .fold((0.0, 0.0), |(sum, largest), residual| (sum + residual * residual, f64::max(largest, residual.abs())))
}
