//! Arrays of NumPy as heights and places, and rows of numbers as arrays. The package hands over arrays in C order, of
//! the machine's byte order.

use numpy::{Element, PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray2, PyUntypedArrayMethods};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use source_files::PostArray;
use store::ReportResidual;

/// Heights as an array has them, whose rows go from north to south unless `south_first`; and its rows and columns.
///
/// # Errors
/// When it is no such array of float32, float64, int16 or int32.
pub fn posts_of(array: &Bound<'_, PyAny>, south_first: bool) -> PyResult<(PostArray, [usize; 2])> {
    if let Ok(array) = array.extract::<PyReadonlyArray2<'_, f32>>() {
        return rows(&array, south_first).map(|(posts, size)| (PostArray::F32(posts), size));
    }
    if let Ok(array) = array.extract::<PyReadonlyArray2<'_, f64>>() {
        return rows(&array, south_first).map(|(posts, size)| (PostArray::F64(posts), size));
    }
    if let Ok(array) = array.extract::<PyReadonlyArray2<'_, i16>>() {
        return rows(&array, south_first).map(|(posts, size)| (PostArray::I16(posts), size));
    }
    if let Ok(array) = array.extract::<PyReadonlyArray2<'_, i32>>() {
        return rows(&array, south_first).map(|(posts, size)| (PostArray::I32(posts), size));
    }
    Err(PyTypeError::new_err("expected a 2-D array of float32, float64, int16 or int32"))
}

/// The rows of an array, the southern one first.
fn rows<T: Element + Copy>(array: &PyReadonlyArray2<'_, T>, south_first: bool) -> PyResult<(Vec<T>, [usize; 2])> {
    let (all, &[rows, cols]) = (array.as_slice()?, array.shape()) else {
        return Err(PyTypeError::new_err("expected an array of two dimensions"));
    };
    let mut posts = Vec::with_capacity(all.len());
    if south_first || cols == 0 {
        posts.extend_from_slice(all);
    } else {
        all.rchunks_exact(cols).for_each(|row| posts.extend_from_slice(row));
    }
    Ok((posts, [rows, cols]))
}

/// Places as rows of `N` numbers.
///
/// # Errors
/// When there are not so many in a row.
pub fn places<'a, const N: usize>(array: &'a PyReadonlyArray2<'_, f64>) -> PyResult<&'a [[f64; N]]> {
    let (places, rest) = array.as_slice()?.as_chunks::<N>();
    match (array.shape().last() == Some(&N), rest) {
        (true, []) => Ok(places),
        _ => Err(PyTypeError::new_err(format!("expected {N} numbers in a row"))),
    }
}

/// Rows as an array of two dimensions, the second of `N`, made without another copy.
pub fn table<'py, T: Element, const N: usize>(
    py: Python<'py>,
    rows: impl ExactSizeIterator<Item = [T; N]>,
) -> PyResult<Bound<'py, PyArray2<T>>> {
    let count = rows.len();
    let mut numbers = Vec::with_capacity(count * N);
    rows.for_each(|row| numbers.extend(row));
    PyArray1::from_vec(py, numbers).reshape([count, N])
}

/// Figures of residuals, in metres.
pub fn residual_of<'py>(py: Python<'py>, residual: &ReportResidual) -> PyResult<Bound<'py, PyDict>> {
    let ReportResidual { rms_m, max_m, mean_abs_m, p95_m, p99_m } = *residual;
    let figures = PyDict::new(py);
    let all = [("rms_m", rms_m), ("max_m", max_m), ("mean_abs_m", mean_abs_m), ("p95_m", p95_m), ("p99_m", p99_m)];
    all.into_iter().try_for_each(|(name, figure)| figures.set_item(name, figure))?;
    Ok(figures)
}
