//! Heights within triangles: a grid of squares, about as many as triangles, lists for each the triangles that reach it.

use numpy::{PyArray1, PyReadonlyArray2};
use pyo3::exceptions::PyIndexError;
use pyo3::prelude::*;

use crate::arrays::places;

/// Most squares along a side.
const SQUARES_MAX: usize = 2048;
/// What rounding may put a place outside of the triangle that it is on the side of, as a share of the triangle.
const ROUNDING: f64 = 1e-9;

/// Heights at places, each an easting and a northing, within triangles; not a number outside of all.
#[pyfunction]
pub fn heights_within<'py>(
    py: Python<'py>,
    vertices: PyReadonlyArray2<'py, f64>,
    triangles: PyReadonlyArray2<'py, u32>,
    xy: PyReadonlyArray2<'py, f64>,
) -> PyResult<Bound<'py, PyArray1<f64>>> {
    let (vertices, xy) = (places::<3>(&vertices)?.to_vec(), places::<2>(&xy)?.to_vec());
    let (triangles, _) = triangles.as_slice()?.as_chunks::<3>();
    if triangles.as_flattened().iter().any(|&v| vertices.len() <= v as usize) {
        return Err(PyIndexError::new_err("a triangle names a vertex that is not there"));
    }
    let triangles = triangles.to_vec();
    Ok(PyArray1::from_vec(py, py.detach(|| within(&vertices, &triangles, &xy))))
}

/// The same.
///
/// # Panics
/// When a triangle names a vertex that is not there.
pub fn within(vertices: &[[f64; 3]], triangles: &[[u32; 3]], xy: &[[f64; 2]]) -> Vec<f64> {
    let squares = Squares::of(vertices, triangles);
    let height = |place: &[f64; 2]| {
        let near = squares.near(*place).iter();
        let mut found =
            near.filter_map(|&index| height_in(triangles[index as usize].map(|v| vertices[v as usize]), *place));
        found.next().unwrap_or(f64::NAN)
    };
    xy.iter().map(height).collect()
}

/// Height of a triangle at a place, where that lies in it.
fn height_in([a, b, c]: [[f64; 3]; 3], [x, y]: [f64; 2]) -> Option<f64> {
    let cross = |p: [f64; 3], q: [f64; 3]| (p[0] - x) * (q[1] - y) - (p[1] - y) * (q[0] - x);
    let shares = [cross(b, c), cross(c, a), cross(a, b)];
    let whole = shares[0] + shares[1] + shares[2];
    let inside = 0.0 < whole && shares.iter().all(|&share| -ROUNDING * whole <= share);
    inside.then(|| (shares[0] * a[2] + shares[1] * b[2] + shares[2] * c[2]) / whole)
}

/// Squares over the triangles.
struct Squares {
    low: [f64; 2],
    /// Squares in a unit.
    scale: [f64; 2],
    count: usize,
    /// Where the list of each square begins, and the end of the last.
    starts: Vec<u32>,
    lists: Vec<u32>,
}

impl Squares {
    fn of(vertices: &[[f64; 3]], triangles: &[[u32; 3]]) -> Self {
        let along = |axis: usize| vertices.iter().map(move |vertex| vertex[axis]);
        let low = [0, 1].map(|axis| along(axis).fold(f64::INFINITY, f64::min));
        let high = [0, 1].map(|axis| along(axis).fold(f64::NEG_INFINITY, f64::max));
        let count = ((triangles.len() as f64).sqrt() as usize).clamp(1, SQUARES_MAX);
        let scale = [0, 1].map(|axis| count as f64 / (high[axis] - low[axis]).max(f64::MIN_POSITIVE));
        let mut squares = Self { low, scale, count, starts: vec![0; count * count + 1], lists: Vec::new() };
        let each = |squares: &Self, visit: &mut dyn FnMut(usize, u32)| {
            for (index, triangle) in triangles.iter().enumerate() {
                let corners = triangle.map(|v| vertices[v as usize]);
                let reach = |axis: usize| {
                    let along = corners.map(|corner| corner[axis]);
                    let ends = [
                        along.into_iter().fold(f64::INFINITY, f64::min),
                        along.into_iter().fold(f64::NEG_INFINITY, f64::max),
                    ];
                    ends.map(|end| squares.square(axis, end))
                };
                let ([west, east], [south, north]) = (reach(0), reach(1));
                (south..=north).for_each(|row| (west..=east).for_each(|col| visit(row * count + col, index as u32)));
            }
        };
        let mut starts = squares.starts.clone();
        each(&squares, &mut |square, _| starts[square + 1] += 1);
        (1..starts.len()).for_each(|square| starts[square] += starts[square - 1]);
        let mut lists = vec![0; starts[count * count] as usize];
        let mut next = starts.clone();
        each(&squares, &mut |square, index| {
            lists[next[square] as usize] = index;
            next[square] += 1;
        });
        (squares.starts, squares.lists) = (starts, lists);
        squares
    }

    /// The row or column of squares at a coordinate; what lies outside is in the last ones.
    fn square(&self, axis: usize, at: f64) -> usize {
        (((at - self.low[axis]) * self.scale[axis]) as usize).min(self.count - 1)
    }

    fn near(&self, [x, y]: [f64; 2]) -> &[u32] {
        let square = self.square(1, y) * self.count + self.square(0, x);
        &self.lists[self.starts[square] as usize..self.starts[square + 1] as usize]
    }
}
