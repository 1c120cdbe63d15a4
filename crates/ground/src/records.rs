//! What a build was made from: the content of every file that a job names, and its state.

use std::path::Path;

use database::{Fingerprint, SourceRecord};
use job::{AreaShape, DemSource, Job, Start};
use source_files::{FileState, SourceError};

use crate::GroundError;

/// What a job's heights and weights are made from: the content of every file it names, hashed and not decoded.
///
/// # Errors
/// When a file cannot be read.
pub fn records(job: &Job) -> Result<Vec<SourceRecord>, GroundError> {
    let sample = match &job.dem.source {
        DemSource::Sample { seed } => Some(record(&format!("sample seed={seed}"), &seed.to_le_bytes())),
        DemSource::Files { .. } => None,
    };
    let files = named_files(job).into_iter().map(|file| {
        let attribution = file.attribution.map(str::to_owned);
        Ok(SourceRecord { attribution, ..file_record(file.written, file.path)? })
    });
    sample.into_iter().map(Ok).chain(files).collect()
}

/// What the files of a job are like now, so that one that changes during a build is noticed.
///
/// # Errors
/// When one is not there, or no file.
pub fn states(job: &Job) -> Result<Vec<FileState>, GroundError> {
    named_files(job).into_iter().map(|file| Ok(FileState::of(file.path)?)).collect()
}

/// A file that a job names.
struct Named<'a> {
    written: &'a str,
    path: &'a Path,
    attribution: Option<&'a str>,
}

/// Every file that a job names, in the order of their records.
fn named_files(job: &Job) -> Vec<Named<'_>> {
    let mut all = Vec::new();
    if let DemSource::Files { files, .. } = &job.dem.source {
        all.extend(files.iter().map(|file| Named {
            written: &file.written,
            path: &file.path,
            attribution: file.said.attribution.as_deref(),
        }));
    }
    let geoids = job.dem.geoids.iter().map(|geoid| &geoid.file);
    let water = job.dem.water.iter().map(|water| &water.file);
    let start = job.tin.start.iter().filter_map(|start| match start {
        Start::File(file) => Some(file),
        Start::Method { .. } => None,
    });
    let areas = job.importance.areas.iter().filter_map(|area| match &area.shape {
        AreaShape::Polygons { file } | AreaShape::RasterValue { file, .. } => Some(file),
        AreaShape::Slope { .. } | AreaShape::Sample(_) => None,
    });
    let others = geoids.chain(water).chain(start).chain(&job.tin.pins).chain(areas);
    all.extend(others.map(|file| Named { written: &file.written, path: &file.path, attribution: None }));
    all
}

/// The record of a file that a build was made from.
fn file_record(written: &str, path: &Path) -> Result<SourceRecord, GroundError> {
    let content = Fingerprint::of_reader(source_files::content(path)?);
    let blake3 = content.map_err(|source| SourceError::Read { path: path.into(), source })?;
    Ok(SourceRecord { path: written.to_owned(), blake3, attribution: None })
}

/// The record of some content.
fn record(path: &str, content: &[u8]) -> SourceRecord {
    SourceRecord { path: path.to_owned(), blake3: Fingerprint::of_bytes(content), attribution: None }
}
