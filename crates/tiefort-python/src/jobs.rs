//! Jobs, and what is done with them and with databases, as the commands do it.

use std::ffi::OsString;
use std::path::{Path, PathBuf};

use ::build::workbench::HeldGround;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use terrain::{ModuleId, TileId};
use tiefort::library::{self, Failure, SystemClock};

use crate::arrays::residual_of;
use crate::meshes::{ARRAY, Placed, raster_of};
use crate::raised::raised;
use crate::waiting::{Raising, wait, wait_for};

/// A job, read and found good.
#[pyclass(frozen)]
pub struct Job {
    job: job::Job,
}

#[pymethods]
impl Job {
    /// The job that a text holds, as if it were the file at `path`.
    #[staticmethod]
    fn of_text(py: Python<'_>, text: &str, path: PathBuf) -> PyResult<Self> {
        let job = py.detach(|| job::Job::of_text(text, &path, &::build::ground::find_area));
        job.map(|job| Self { job }).map_err(|error| raised(py, &error.into()))
    }

    /// The job of a file.
    #[staticmethod]
    fn load(py: Python<'_>, path: PathBuf) -> PyResult<Self> {
        let job = py.detach(|| job::Job::load_with(&path, &::build::ground::find_area));
        job.map(|job| Self { job }).map_err(|error| raised(py, &error.into()))
    }

    /// Name of the area.
    #[getter]
    fn name(&self) -> &str {
        &self.job.area.name
    }

    /// Every setting: key, value, meaning.
    fn settings(&self) -> Vec<(&'static str, String, String)> {
        self.job.describe().into_iter().map(|setting| (setting.key, setting.value, setting.meaning)).collect()
    }
}

/// How a build goes about it.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct How {
    workers: Option<usize>,
    fresh: bool,
    force: bool,
    strict: bool,
    page: bool,
}

impl How {
    /// The job and the workers that are meant; refused where it would not fit this machine.
    fn begin(&self, job: &Job, folder: &Path) -> Result<(job::Job, usize), Failure> {
        let mut job = job.job.clone();
        job.dem.strict = self.strict;
        let workers = library::workers_for(&job, self.workers);
        if !self.force {
            library::check_fits(&job, workers, folder)?;
        }
        Ok((job, workers))
    }
}

/// What a build found as `report.json` has it, tiles built and kept, and whether nothing had to be done.
#[pyfunction]
pub fn build(
    py: Python<'_>,
    job: &Bound<'_, Job>,
    folder: PathBuf,
    how: How,
    told: Option<&Bound<'_, PyAny>>,
) -> PyResult<(String, usize, usize, bool)> {
    let job = job.get();
    let begun = py.detach(|| how.begin(job, &folder));
    let (job, workers) = begun.map_err(|failure| raised(py, &failure))?;
    wait_for(py, told, Raising::AwaitsIt, move |stop, progress| {
        let clock = SystemClock::start();
        let usual = ::build::Options::new(workers, stop, &clock);
        let options = ::build::Options { fresh: how.fresh, page: how.page, ..usual };
        let built = ::build::build(&job, &folder, &options, progress)?;
        Ok((library::report_json(&built.report), built.rebuilt, built.kept, built.is_unchanged))
    })
}

/// What was found after one tile was made again, and the tiles that were.
#[pyfunction]
pub fn tile(
    py: Python<'_>,
    job: &Bound<'_, Job>,
    id: (u32, u32),
    folder: PathBuf,
    release_borders: bool,
    how: How,
    told: Option<&Bound<'_, PyAny>>,
) -> PyResult<(String, Vec<(u32, u32)>)> {
    let id = TileId { row: id.0, col: id.1 };
    let job = job.get();
    let begun = py.detach(|| how.begin(job, &folder));
    let checked = begun.and_then(|begun| library::check_tile(&begun.0, id).map(|()| begun));
    let (job, workers) = checked.map_err(|failure| raised(py, &failure))?;
    wait_for(py, told, Raising::AwaitsIt, move |stop, progress| {
        let clock = SystemClock::start();
        let options = ::build::Options { page: how.page, ..::build::Options::new(workers, stop, &clock) };
        let rebuilt = ::build::rebuild_tile(&job, &folder, id, release_borders, &options, progress)?;
        let tiles = rebuilt.rebuilt.iter().map(|tile| (tile.row, tile.col)).collect();
        Ok((library::report_json(&rebuilt.report), tiles))
    })
}

/// What a build would take, as JSON.
#[pyfunction]
pub fn plan(py: Python<'_>, job: &Bound<'_, Job>) -> PyResult<String> {
    let job = job.get().job.clone();
    wait(py, None, move |_, _| library::plan(&job))
}

/// Whether a database is sound: problems, what could not be checked, files and load modules checked, residuals.
#[pyfunction]
pub fn verify<'py>(py: Python<'py>, folder: PathBuf, dem: Option<PathBuf>) -> PyResult<Bound<'py, PyDict>> {
    let verdict = wait(py, None, move |_, _| Ok(inspect::verify(&folder, dem.as_deref())?))?;
    let found = PyDict::new(py);
    found.set_item("problems", verdict.problems)?;
    found.set_item("unchecked", verdict.unchecked)?;
    found.set_item("checked_files", verdict.checked_files)?;
    found.set_item("checked_modules", verdict.checked_modules)?;
    found.set_item("residual", verdict.residual.map(|residual| residual_of(py, &residual)).transpose()?)?;
    Ok(found)
}

/// Exports with the words of `tiefort export`; what was exported, in words.
#[pyfunction]
pub fn export(py: Python<'_>, words: Vec<OsString>) -> PyResult<String> {
    wait(py, None, move |stop, _| library::export(words, stop))
}

/// Compares with the words of `tiefort compare`; the table as JSON.
#[pyfunction]
pub fn compare(py: Python<'_>, words: Vec<OsString>) -> PyResult<String> {
    wait(py, None, move |stop, _| library::compare(words, None, stop))
}

/// The same on the heights in an array, which `words` call `array`.
#[pyfunction]
pub fn compare_on_array(
    py: Python<'_>,
    array: &Bound<'_, PyAny>,
    placed: Placed,
    words: Vec<OsString>,
) -> PyResult<String> {
    let make = raster_of(py, array, placed)?;
    wait(py, None, move |stop, _| {
        let ground = HeldGround::of(make()?, ARRAY, stop)?;
        library::compare(words, Some(ground), stop)
    })
}

/// How well two surfaces agree, as JSON, with the words of `tiefort correlate`.
#[pyfunction]
pub fn correlate(py: Python<'_>, words: Vec<OsString>) -> PyResult<String> {
    wait(py, None, move |stop, _| library::correlate(words, stop))
}

/// Everything there is to know about one load module, as JSON.
#[pyfunction]
pub fn explain(py: Python<'_>, folder: PathBuf, id: (u32, u32), against: Option<PathBuf>) -> PyResult<String> {
    wait(py, None, move |_, _| library::explain(&folder, ModuleId { row: id.0, col: id.1 }, against.as_deref()))
}
