//! Meshes of heights: made from an array or a file, as arrays, written, and asked for heights.

use std::ffi::OsString;
use std::path::{Path, PathBuf};

use build::CompileError;
use build::workbench::Mesh;
use numpy::{PyArray1, PyArray2, PyReadonlyArray2};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use source_files::{ArrayRaster, Crs, Raster};
use terrain::metres_of_quanta;
use tiefort::library::{self, Failure, SystemClock};

use crate::arrays::{places, posts_of, residual_of, table};
use crate::raised::raised;
use crate::waiting::wait;
use crate::within::within;

/// A mesh as the library made it.
#[pyclass(frozen)]
pub struct Tin {
    mesh: Mesh,
    /// What the library took.
    seconds: f64,
}

/// Where the posts of an array lie: the system, the south-west post, the spacing to the east and to the north, the
/// value that marks voids, and whether the first row is the southern one.
pub type Placed = (Option<String>, [f64; 2], [f64; 2], Option<f64>, bool);

/// A mesh of the heights in an array; `words` are those of `tiefort tin`.
#[pyfunction]
pub fn tin_of_array(
    py: Python<'_>,
    array: &Bound<'_, PyAny>,
    placed: Placed,
    words: Vec<OsString>,
    told: Option<&Bound<'_, PyAny>>,
) -> PyResult<Tin> {
    let request = library::tin_request(Path::new(ARRAY), words).map_err(|failure| raised(py, &failure))?;
    let make = raster_of(py, array, placed)?;
    wait(py, told, move |stop, progress| {
        let clock = SystemClock::start();
        let mesh = build::workbench::tin_of_raster(make()?, &request, stop, progress)?;
        Ok(Tin { mesh, seconds: clock.seconds() })
    })
}

/// What messages call an array.
pub const ARRAY: &str = "array";

/// What makes a raster of the heights in an array, once Python's lock is not held.
///
/// # Errors
/// When the system cannot be computed, or the array holds no heights.
pub fn raster_of(
    py: Python<'_>,
    array: &Bound<'_, PyAny>,
    placed: Placed,
) -> PyResult<impl FnOnce() -> Result<Raster, CompileError> + Send + use<>> {
    let (crs, south_west, spacing, nodata, south_first) = placed;
    let crs = crs.map(|text| system(&text)).transpose().map_err(|failure| raised(py, &failure))?;
    let (posts, size) = posts_of(array, south_first)?;
    let told = ArrayRaster { name: ARRAY.into(), crs, south_west, spacing, size, nodata };
    Ok(move || Raster::of_array(told, posts).map_err(CompileError::from))
}

/// A mesh of the heights in a file; `words` are those of `tiefort tin`.
#[pyfunction]
pub fn tin_of_file(
    py: Python<'_>,
    path: PathBuf,
    words: Vec<OsString>,
    told: Option<&Bound<'_, PyAny>>,
) -> PyResult<Tin> {
    let request = library::tin_request(&path, words).map_err(|failure| raised(py, &failure))?;
    wait(py, told, move |stop, progress| {
        let clock = SystemClock::start();
        let mesh = build::workbench::tin(&request, stop, progress)?;
        Ok(Tin { mesh, seconds: clock.seconds() })
    })
}

fn system(text: &str) -> Result<Crs, Failure> {
    Crs::named(text).map_err(|found| {
        Failure::new(
            format!("crs: found {found}, expected a system that can be computed"),
            "give a code, as crs=\"EPSG:32611\"",
        )
    })
}

#[pymethods]
impl Tin {
    /// East, north and height of each vertex in metres.
    fn vertices<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let Mesh { tin, east_m, north_m, spacing_m, .. } = &self.mesh;
        let posts = |lattice: i32| f64::from(lattice) / f64::from(tin.steps_per_post);
        let place = |vertex: &terrain::Vertex| {
            let (east, north) = (posts(vertex.at.col) * spacing_m.0, posts(vertex.at.row) * spacing_m.1);
            [east_m + east, north_m + north, metres_of_quanta(vertex.height)]
        };
        table(py, tin.vertices.iter().map(place))
    }

    /// Three vertices of each triangle, counter-clockwise seen from above.
    fn triangles<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<u32>>> {
        table(py, self.mesh.tin.triangles.iter().copied())
    }

    /// Figures of the residuals in metres.
    fn residual<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        residual_of(py, &self.mesh.residual)
    }

    /// The EPSG code of its system.
    #[getter]
    fn epsg(&self) -> Option<u32> {
        self.mesh.epsg
    }

    /// East and north of the south-west post, metres between posts to the east and to the north, rows and columns.
    #[getter]
    fn grid(&self) -> ([f64; 2], [f64; 2], [usize; 2]) {
        let Mesh { dem, east_m, north_m, spacing_m, .. } = &self.mesh;
        let rect = dem.rect();
        ([*east_m, *north_m], [spacing_m.0, spacing_m.1], [rect.posts_high(), rect.posts_wide()])
    }

    /// Seconds that the library took to make it.
    #[getter]
    fn seconds(&self) -> f64 {
        self.seconds
    }

    /// Why it has no more vertices.
    #[getter]
    fn stop(&self) -> &'static str {
        library::end_in_words(self.mesh.stop)
    }

    /// Writes it as `tiefort tin --out` does.
    fn save(&self, py: Python<'_>, path: PathBuf, on_map: bool) -> PyResult<()> {
        let written = py.detach(|| write(&self.mesh, &path, on_map));
        written.map_err(|failure| raised(py, &failure))
    }

    /// Heights at places, each an easting and a northing.
    fn heights<'py>(&self, py: Python<'py>, xy: PyReadonlyArray2<'py, f64>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let xy: Vec<[f64; 2]> = places(&xy)?.to_vec();
        let Mesh { tin, east_m, north_m, spacing_m, .. } = &self.mesh;
        let steps = f64::from(tin.steps_per_post);
        let heights = py.detach(|| {
            let vertex = |vertex: &terrain::Vertex| {
                [f64::from(vertex.at.col), f64::from(vertex.at.row), metres_of_quanta(vertex.height)]
            };
            let vertices: Vec<[f64; 3]> = tin.vertices.iter().map(vertex).collect();
            let place = |&[east, north]: &[f64; 2]| {
                [(east - east_m) / spacing_m.0 * steps, (north - north_m) / spacing_m.1 * steps]
            };
            let places: Vec<[f64; 2]> = xy.iter().map(place).collect();
            within(&vertices, &tin.triangles, &places)
        });
        Ok(PyArray1::from_vec(py, heights))
    }
}

fn write(mesh: &Mesh, path: &Path, on_map: bool) -> Result<(), Failure> {
    library::check_writable(path)?;
    library::write_mesh(mesh, path, on_map)
}
