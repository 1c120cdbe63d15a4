//! All vertices at once, in x, y and height: limited-memory BFGS, preconditioned by each vertex's Gauss-Newton block.
//!
//! Moves of single vertices bring down what is short, and leave what is long: a density of vertices that is a little
//! wrong over many triangles. The gradient is exact, because the surface is continuous: half of it at a corner is its
//! pull times (slope, -1). See Nocedal and Wright, Numerical Optimization, section 7.2.

use std::collections::VecDeque;

use crate::optimiser::heights::is_free;
use crate::optimiser::parts::{NONE, Vertex};
use crate::optimiser::place::{PER_POST, Place};
use crate::optimiser::tile_mesh::TileMesh;

/// Steps that are remembered.
const MEMORY: usize = 6;
/// Parts of a step that are tried.
const STEPS_TRIED: [f64; 3] = [1.0, 0.4, 0.16];
/// Relative and absolute damping of a block in the plane.
const PLANE_DAMPING: (f64, f64) = (0.3, 0.02);
/// Absolute damping of a block in height.
const HEIGHT_DAMPING: f64 = 1e-3;
/// A block's pivot, at least.
const LEAST_PIVOT: f64 = 1e-9;
/// A vertex stays so far from the tile's border, in steps.
const MARGIN: i32 = PER_POST / 4;

/// East, north (posts) and height (quanta).
type Vector = [f64; 3];

/// Moves all vertices that are free down the squares, in so many steps; they stand on multiples of `step` afterwards.
pub(crate) fn descend(sheet: &mut TileMesh, steps: usize, step: i32) {
    let mut free: Vec<Freedom> = sheet.vertices.iter().map(Freedom::of).collect();
    let mut at: Vec<Vector> = sheet.vertices.iter().map(vector).collect();
    let mut slope = gradient(sheet, &at, &free);
    stop(sheet, &mut free, &mut slope);
    let blocks = blocks(sheet, &at, &free);
    let mut memory = Memory::default();
    let mut squares = sheet.squares();
    for _ in 0..steps {
        let direction = memory.direction(&slope, &blocks, &free);
        let is_descent = 0.0 < dot(&slope, &direction);
        let reached = if is_descent { step_down(sheet, &at, &direction, &blocks, &free, step, squares) } else { None };
        let Some((to, fewer)) = reached else {
            if memory.pairs.is_empty() {
                break;
            }
            memory.pairs.clear();
            continue;
        };
        let next = gradient(sheet, &to, &free);
        memory.remember(difference(&to, &at), difference(&next, &slope));
        (at, slope, squares) = (to, next, fewer);
    }
    sheet.mark_all_changed();
}

/// What may change about a vertex.
#[derive(Clone, Copy)]
struct Freedom {
    place: bool,
    height: bool,
}

impl Freedom {
    fn of(vertex: &Vertex) -> Self {
        let height = vertex.edge != NONE && vertex.hold.height_is_free();
        // On a line it moves from lattice point to lattice point, which a step of many vertices cannot see.
        Self { height, place: height && !vertex.hold.is_fixed() && !vertex.hold.is_on_line() }
    }

    fn mask(self, vector: &mut Vector) {
        if !self.place {
            (vector[0], vector[1]) = (0.0, 0.0);
        }
        if !self.height {
            vector[2] = 0.0;
        }
    }
}

/// Leaves alone what would leave the heights that the ground permits.
fn stop(sheet: &TileMesh, free: &mut [Freedom], slope: &mut [Vector]) {
    for ((vertex, free), slope) in sheet.vertices.iter().zip(free).zip(slope) {
        if free.height && !is_free(sheet, vertex, -slope[2]) {
            *free = Freedom { place: false, height: false };
            free.mask(slope);
        }
    }
}

fn vector(vertex: &Vertex) -> Vector {
    let (x, y) = vertex.at.posts();
    [x, y, vertex.height]
}

fn dot(a: &[Vector], b: &[Vector]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a[0] * b[0] + a[1] * b[1] + a[2] * b[2]).sum()
}

fn difference(a: &[Vector], b: &[Vector]) -> Vec<Vector> {
    a.iter().zip(b).map(|(a, b)| [a[0] - b[0], a[1] - b[1], a[2] - b[2]]).collect()
}

/// Adds `part` times `b` to `a`.
fn add(a: &mut [Vector], part: f64, b: &[Vector]) {
    for (a, b) in a.iter_mut().zip(b) {
        for k in 0..3 {
            a[k] += part * b[k];
        }
    }
}

/// Visits every corner of every triangle: the vertex, and the triangle's slope, stiffness and pull there.
fn visit_corners(sheet: &TileMesh, at: &[Vector], mut visit: impl FnMut(usize, [f64; 2], f64, f64)) {
    for (index, record) in sheet.triangles.iter().enumerate() {
        if !sheet.is_live(index as u32) {
            continue;
        }
        let (form, heights) = (&sheet.forms[index], sheet.heights(record.corners));
        let corners = record.corners.map(|corner| corner as usize);
        let [a, b, c] = corners.map(|corner| at[corner]);
        let (bx, by, cx, cy) = (b[0] - a[0], b[1] - a[1], c[0] - a[0], c[1] - a[1]);
        let (hb, hc) = (heights[1] - heights[0], heights[2] - heights[0]);
        let per_area = 1.0 / (bx * cy - by * cx);
        let slope = [(hb * cy - hc * by) * per_area, (hc * bx - hb * cx) * per_area];
        for (k, corner) in corners.into_iter().enumerate() {
            visit(corner, slope, form.aa[k], form.pull(k, heights));
        }
    }
}

/// Half the slope of the squares, for each vertex.
fn gradient(sheet: &TileMesh, at: &[Vector], free: &[Freedom]) -> Vec<Vector> {
    let mut gradient = vec![[0.0; 3]; at.len()];
    visit_corners(sheet, at, |corner, slope, _, pull| {
        let sum = &mut gradient[corner];
        *sum = [sum[0] + pull * slope[0], sum[1] + pull * slope[1], sum[2] - pull];
    });
    gradient.iter_mut().zip(free).for_each(|(gradient, free)| free.mask(gradient));
    gradient
}

/// The Gauss-Newton block of a vertex, lower half, and the mean slope around it.
#[derive(Clone, Copy, Default)]
struct Block {
    xx: f64,
    xy: f64,
    xh: f64,
    yy: f64,
    yh: f64,
    hh: f64,
    tilt: [f64; 2],
}

fn blocks(sheet: &TileMesh, at: &[Vector], free: &[Freedom]) -> Vec<Block> {
    let mut blocks = vec![Block::default(); at.len()];
    visit_corners(sheet, at, |corner, [x, y], stiffness, _| {
        let block = &mut blocks[corner];
        block.xx += stiffness * x * x;
        block.xy += stiffness * x * y;
        block.xh -= stiffness * x;
        block.yy += stiffness * y * y;
        block.yh -= stiffness * y;
        block.hh += stiffness;
    });
    blocks.into_iter().zip(free).map(|(block, free)| block.damped(free.place)).collect()
}

impl Block {
    fn damped(self, has_place: bool) -> Self {
        let Self { xx, xy, xh, yy, yh, hh, .. } = self;
        if !has_place {
            return Self { xx: 1.0, yy: 1.0, hh: hh + HEIGHT_DAMPING, ..Self::default() };
        }
        let per_height = if 0.0 < hh { 1.0 / hh } else { 0.0 };
        // What is left of x and y once the height has followed.
        let left = |square: f64, mixed: f64| (square - mixed * mixed * per_height).max(0.0);
        let damped = |square: f64, mixed: f64| square + PLANE_DAMPING.0 * left(square, mixed) + PLANE_DAMPING.1;
        Self {
            xx: damped(xx, xh),
            xy,
            xh,
            yy: damped(yy, yh),
            yh,
            hh: hh + HEIGHT_DAMPING,
            tilt: [-xh * per_height, -yh * per_height],
        }
    }

    /// The step that the block makes of a gradient, by Cholesky's factors.
    fn solve(&self, [x, y, h]: Vector) -> Vector {
        let root = |pivot: f64| pivot.max(LEAST_PIVOT).sqrt();
        let l = root(self.xx);
        let (m, n) = (self.xy / l, self.xh / l);
        let o = root(self.yy - m * m);
        let p = (self.yh - m * n) / o;
        let q = root(self.hh - n * n - p * p);
        let x = x / l;
        let y = (y - m * x) / o;
        let h = (h - n * x - p * y) / q / q;
        let y = (y - p * h) / o;
        [(x - m * y - n * h) / l, y, h]
    }
}

/// The last steps and what the gradient changed by in each.
#[derive(Default)]
struct Memory {
    pairs: VecDeque<Pair>,
}

struct Pair {
    step: Vec<Vector>,
    change: Vec<Vector>,
    /// One over their product.
    scale: f64,
}

impl Memory {
    /// Downhill is against it.
    fn direction(&self, slope: &[Vector], blocks: &[Block], free: &[Freedom]) -> Vec<Vector> {
        let mut direction = slope.to_vec();
        let mut parts = Vec::with_capacity(self.pairs.len());
        for pair in self.pairs.iter().rev() {
            let part = pair.scale * dot(&pair.step, &direction);
            add(&mut direction, -part, &pair.change);
            parts.push(part);
        }
        for ((direction, block), free) in direction.iter_mut().zip(blocks).zip(free) {
            *direction = block.solve(*direction);
            free.mask(direction);
        }
        for (pair, part) in self.pairs.iter().zip(parts.into_iter().rev()) {
            let back = pair.scale * dot(&pair.change, &direction);
            add(&mut direction, part - back, &pair.step);
        }
        direction
    }

    fn remember(&mut self, step: Vec<Vector>, change: Vec<Vector>) {
        let product = dot(&step, &change);
        if product <= LEAST_PIVOT * dot(&change, &change).sqrt() {
            return;
        }
        if self.pairs.len() == MEMORY {
            self.pairs.pop_front();
        }
        self.pairs.push_back(Pair { step, change, scale: 1.0 / product });
    }
}

/// The first part of a step that lowers the squares: where it leads, and the squares there. Without one, the mesh is
/// as it was.
fn step_down(
    sheet: &mut TileMesh,
    from: &[Vector],
    direction: &[Vector],
    blocks: &[Block],
    free: &[Freedom],
    step: i32,
    squares: f64,
) -> Option<(Vec<Vector>, f64)> {
    let before: Vec<(Place, f64)> = sheet.vertices.iter().map(|vertex| (vertex.at, vertex.height)).collect();
    for part in STEPS_TRIED {
        for (v, block) in blocks.iter().enumerate() {
            let ([x, y, h], [dx, dy, dh]) = (from[v], direction[v]);
            let to = [x - part * dx, y - part * dy, h - part * dh];
            put(sheet, v, to, block, free[v], step);
        }
        take_back_unsound(sheet, &before);
        sheet.sum_again();
        let now = sheet.squares();
        if now < squares {
            return Some((sheet.vertices.iter().map(vector).collect(), now));
        }
        for (vertex, &(at, height)) in sheet.vertices.iter_mut().zip(&before) {
            (vertex.at, vertex.height) = (at, height);
        }
    }
    sheet.sum_again();
    None
}

/// Puts a vertex on the lattice point nearest to where it should go. Its height follows the slope there: without that,
/// rounding would undo what a step gains. Where that height is out of bounds, the vertex stays.
fn put(sheet: &mut TileMesh, vertex: usize, [x, y, h]: Vector, block: &Block, free: Freedom, step: i32) {
    let far = sheet.ground.far();
    let record = &mut sheet.vertices[vertex];
    let mut to = record.at;
    let mut rise = 0.0;
    if free.place {
        let round = |to: f64| (to * f64::from(PER_POST) / f64::from(step)).round() as i32 * step;
        to = Place::new(round(x), round(y));
        let is_inside = |at: i32, far: i32| MARGIN < at && at < far - MARGIN;
        if !is_inside(to.x, far.x) || !is_inside(to.y, far.y) || sheet.ground.is_forbidden(to) {
            return;
        }
        let (east, north) = to.posts();
        rise = block.tilt[0] * (east - x) + block.tilt[1] * (north - y);
    }
    if free.height && sheet.ground.bounded(to, h + rise) == h + rise {
        (record.at, record.height) = (to, h + rise);
    }
}

/// Takes vertices of triangles that are not sound back to where they were, until all are as sound as before.
fn take_back_unsound(sheet: &mut TileMesh, before: &[(Place, f64)]) {
    let mut has_changed = true;
    while has_changed {
        has_changed = false;
        for index in 0..sheet.triangles.len() {
            let corners = sheet.triangles[index].corners;
            if !sheet.is_live(index as u32) || sheet.is_sound(corners) {
                continue;
            }
            for corner in corners {
                let (record, &(at, height)) = (&mut sheet.vertices[corner as usize], &before[corner as usize]);
                if record.at != at {
                    (record.at, record.height) = (at, height);
                    has_changed = true;
                }
            }
        }
    }
}
