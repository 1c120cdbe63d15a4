//! Rows of numbers as arrays, and figures as dictionaries.

use numpy::{Element, PyArray1, PyArray2, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use store::ReportResidual;

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
