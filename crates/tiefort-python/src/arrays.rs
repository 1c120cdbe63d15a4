//! Arrays of NumPy as heights and places. The package hands over arrays in C order, of the machine's byte order.

use numpy::{Element, PyReadonlyArray2, PyUntypedArrayMethods};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use source_files::PostArray;

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
