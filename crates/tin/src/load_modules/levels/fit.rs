//! Heights of the vertices that are free, inside, at which squared residuals are least.
//!
//! The normal equations couple vertices that share a triangle; conjugate gradients solve them, always in the same
//! order of operations, so the heights are the same on every machine.

use super::level_mesh::LevelMesh;
use super::posts::Posts;

/// Added to every vertex's own coefficient: a vertex that hardly any post asks for stays where it was.
const DAMPING: f64 = 0.01;
/// Steps at most; a few dozen bring the rest below a hundredth of a quantum.
const STEPS_MAX: usize = 300;
/// What is left of the squared, scaled rest when the steps end.
const REST: f64 = 1e-14;
/// Heights that reach their bounds stop there, and the others are fitted anew, so often at most.
const ROUNDS_MAX: usize = 4;

/// One triangle's part of the equations.
struct Element {
    corners: [u16; 3],
    /// Products of shares: of each corner with itself, and of the two others than corner 0, 1, 2.
    own: [f64; 3],
    other: [f64; 3],
}

/// Moves the vertices that are free to the heights that fit best within [`terrain::geometry::height_bounds`], rounded
/// to quanta, and brings squares up to date.
pub(super) fn fit_heights(sheet: &mut LevelMesh, is_free: &[bool], posts: &Posts) {
    if !is_free.contains(&true) {
        return;
    }
    let mut is_free = is_free.to_vec();
    for _ in 0..ROUNDS_MAX {
        let mut pull = vec![0.0; sheet.vertices.len()];
        let elements: Vec<Element> =
            sheet.triangles.iter().map(|&triangle| element(sheet, triangle, posts, &mut pull)).collect();
        let rises = solve(&elements, &pull, &is_free);
        let mut has_stopped = false;
        for (v, rise) in rises.into_iter().enumerate() {
            if !is_free[v] {
                continue;
            }
            let vertex = &mut sheet.vertices[v];
            let wanted = (f64::from(vertex.z) + rise).round();
            let (low, high) = posts.height_bounds(*vertex);
            let bounded = wanted.clamp(f64::from(low), f64::from(high));
            vertex.z = bounded as i32;
            is_free[v] = bounded == wanted;
            has_stopped |= bounded != wanted;
        }
        if !has_stopped {
            break;
        }
    }
    for (index, &triangle) in sheet.triangles.iter().enumerate() {
        sheet.squares[index] = posts.squares(triangle.map(|v| sheet.vertices[usize::from(v)]));
    }
}

/// The products of shares under a triangle; adds the residuals times the shares to `pull`.
fn element(sheet: &LevelMesh, corners: [u16; 3], posts: &Posts, pull: &mut [f64]) -> Element {
    let mut element = Element { corners, own: [0.0; 3], other: [0.0; 3] };
    let mut sums = [0.0; 3];
    posts.each_share(sheet.corners(corners), |shares, residual, weight| {
        for i in 0..3 {
            element.own[i] += weight * shares[i] * shares[i];
            element.other[i] += weight * shares[(i + 1) % 3] * shares[(i + 2) % 3];
            sums[i] += weight * shares[i] * residual;
        }
    });
    corners.iter().zip(sums).for_each(|(&v, sum)| pull[usize::from(v)] += sum);
    element
}

/// How far each free vertex has to rise: the damped equations solved by conjugate gradients, scaled by the diagonal.
fn solve(elements: &[Element], pull: &[f64], is_free: &[bool]) -> Vec<f64> {
    let mut diagonal = vec![DAMPING; pull.len()];
    for element in elements {
        element.corners.iter().zip(element.own).for_each(|(&v, own)| diagonal[usize::from(v)] += own);
    }
    let free = |values: &mut Vec<f64>| {
        values.iter_mut().zip(is_free).filter(|(_, is_free)| !**is_free).for_each(|(value, _)| *value = 0.0);
    };
    let scaled = |rest: &[f64]| -> Vec<f64> { rest.iter().zip(&diagonal).map(|(r, d)| r / d).collect() };
    let dot = |a: &[f64], b: &[f64]| -> f64 { a.iter().zip(b).map(|(a, b)| a * b).sum() };
    let mut rest = pull.to_vec();
    free(&mut rest);
    let (mut rises, mut along) = (vec![0.0; pull.len()], scaled(&rest));
    let mut size = dot(&rest, &along);
    let enough = size * REST;
    for _ in 0..STEPS_MAX {
        if size <= enough {
            break;
        }
        let mut image = times(elements, &along);
        free(&mut image);
        let length = size / dot(&along, &image);
        rises.iter_mut().zip(&along).for_each(|(rise, step)| *rise += length * step);
        rest.iter_mut().zip(&image).for_each(|(rest, image)| *rest -= length * image);
        let next = scaled(&rest);
        let now = dot(&rest, &next);
        let turn = now / size;
        along.iter_mut().zip(&next).for_each(|(along, next)| *along = next + turn * *along);
        size = now;
    }
    rises
}

/// The damped matrix times a vector.
fn times(elements: &[Element], vector: &[f64]) -> Vec<f64> {
    let mut image: Vec<f64> = vector.iter().map(|value| DAMPING * value).collect();
    for element in elements {
        let corners = element.corners.map(usize::from);
        let values = corners.map(|v| vector[v]);
        for i in 0..3 {
            let (j, k) = ((i + 1) % 3, (i + 2) % 3);
            image[corners[i]] +=
                element.own[i] * values[i] + element.other[k] * values[j] + element.other[j] * values[k];
        }
    }
    image
}
