//! Heights within triangles, which cells over them find, about as many as there are triangles.

use numpy::{PyArray1, PyReadonlyArray2};
use pyo3::exceptions::PyIndexError;
use pyo3::prelude::*;
use terrain::geometry::Cells;

use crate::arrays::places;

/// Most cells along a side.
const CELLS_MAX: f64 = 2048.0;
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
    let corners = |number: u32| triangles[number as usize].map(|v| vertices[v as usize]);
    let cells = cells_of(vertices, triangles.len(), |number| corners(number).map(|[x, y, _]| [x, y]));
    let height = |place: &[f64; 2]| {
        cells.at(*place).iter().find_map(|&number| height_in(corners(number), *place)).unwrap_or(f64::NAN)
    };
    xy.iter().map(height).collect()
}

/// Cells over so many triangles, about as many.
fn cells_of(vertices: &[[f64; 3]], count: usize, outline: impl Fn(u32) -> [[f64; 2]; 3]) -> Cells {
    let ends = |axis: usize| {
        let along = vertices.iter().map(|vertex| vertex[axis]);
        along.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], at| [low.min(at), high.max(at)])
    };
    let ([west, east], [south, north]) = (ends(0), ends(1));
    let (wide, high) = (east - west, north - south);
    let even = (wide * high / count.max(1) as f64).sqrt();
    let side = even.max(wide.max(high) / CELLS_MAX).max(f64::MIN_POSITIVE);
    Cells::new([west, south], [east, north], side, count as u32, outline)
}

/// Height of a triangle at a place, where that lies in it.
fn height_in([a, b, c]: [[f64; 3]; 3], [x, y]: [f64; 2]) -> Option<f64> {
    let cross = |p: [f64; 3], q: [f64; 3]| (p[0] - x) * (q[1] - y) - (p[1] - y) * (q[0] - x);
    let shares = [cross(b, c), cross(c, a), cross(a, b)];
    let whole = shares[0] + shares[1] + shares[2];
    let inside = 0.0 < whole && shares.iter().all(|&share| -ROUNDING * whole <= share);
    inside.then(|| (shares[0] * a[2] + shares[1] * b[2] + shares[2] * c[2]) / whole)
}
