//! The files that a database was built from, found again by what is recorded of them.

use std::path::{Path, PathBuf};

use job::{
    AreaShape, DemSource, FeatureSource, Job, Lock, NamedFile, SourceEntry, SourceFile, SourceSaid, Voids, is_remote,
};
use store::{Fingerprint, Manifest, SourceRecord, files};

use crate::product::ProductError;

/// Points the job at the ground to measure against, and gives its name: that of the database, or rasters of one's own
/// choice. Several are joined as the job joins them. No feature and no water is burned into them, and what is void in
/// all of them is left out.
///
/// # Errors
/// When no file with the recorded content is there.
pub fn choose_ground(
    job: &mut Job,
    manifest: &Manifest,
    folder: &Path,
    against: &[PathBuf],
) -> Result<String, ProductError> {
    let water = job.dem.water.as_mut().map(|water| &mut water.file);
    let shaping = job.dem.geoids.iter_mut().map(|geoid| &mut geoid.file).chain(water);
    locate(shaping, manifest, folder)?;
    if !against.is_empty() {
        let said = SourceSaid::default();
        let names: Vec<String> = against.iter().map(|path| path.display().to_string()).collect();
        let entry = |name: &String| SourceEntry { name: name.clone(), said: said.clone() };
        let file =
            |path: &PathBuf| SourceFile { written: path.display().to_string(), path: path.clone(), said: said.clone() };
        let (written, files) = (names.iter().map(entry).collect(), against.iter().map(file).collect());
        job.dem.source = DemSource::Files { written, files };
        job.dem.voids = Voids::Hole;
        (job.features, job.dem.water) = (None, None);
        return Ok(names.join(", "));
    }
    match &mut job.dem.source {
        DemSource::Sample { seed } => Ok(format!("the sample terrain, seed {seed}")),
        DemSource::Files { files, .. } => {
            for (index, file) in files.iter_mut().enumerate() {
                file.path = find_source(manifest.sources.get(index), folder)?;
            }
            let names: Vec<String> = files.iter().map(|file| file.path.display().to_string()).collect();
            Ok(names.join(", "))
        }
    }
}

/// Points names at the files that a database was built from.
fn locate<'a>(
    files: impl Iterator<Item = &'a mut NamedFile>,
    manifest: &Manifest,
    folder: &Path,
) -> Result<(), ProductError> {
    for file in files {
        let record = manifest.sources.iter().find(|record| record.path == file.written);
        file.path = find_source(record, folder)?;
    }
    Ok(())
}

/// Points the job at the files that say what ground weighs; what tiles started from changes nothing any more.
///
/// # Errors
/// When no file with the recorded content is there.
pub fn locate_weights(job: &mut Job, manifest: &Manifest, folder: &Path) -> Result<(), ProductError> {
    job.tin.start = None;
    let named = job.importance.areas.iter_mut().filter_map(|area| match &mut area.shape {
        AreaShape::Polygons { file } | AreaShape::RasterValue { file, .. } => Some(file),
        AreaShape::Slope { .. } | AreaShape::Level { .. } | AreaShape::Sample(_) => None,
    });
    locate(named.chain(job.tin.pins.as_mut()), manifest, folder)
}

/// Points the job at the files of roads, rivers and lakes.
///
/// # Errors
/// When no file with the recorded content is there.
pub fn locate_features(job: &mut Job, manifest: &Manifest, folder: &Path) -> Result<(), ProductError> {
    let sources = job.features.iter_mut().flat_map(|features| &mut features.sources);
    let files = sources.filter_map(|source| match source {
        FeatureSource::File { file, .. } => Some(file),
        FeatureSource::Sample => None,
    });
    locate(files, manifest, folder)
}

/// A file a database was built from. Its path is written as the job has it, and the job may have lain anywhere; but
/// its content is known, so any file with that content is the one.
fn find_source(record: Option<&SourceRecord>, folder: &Path) -> Result<PathBuf, ProductError> {
    let missing = |found: String| {
        ProductError::impossible(
            folder.join(files::DATABASE).display().to_string(),
            found,
            "the raster the database was built from",
            "name the raster to measure against: --against FILE",
        )
    };
    let Some(record) = record else { return Err(missing("no source".into())) };
    let places = places_of(&record.path, folder);
    let mut other = None;
    for place in &places {
        match source_files::content(place).map(Fingerprint::of_reader) {
            Ok(Ok(content)) if content == record.blake3 => return Ok(place.clone()),
            Ok(_) => other = Some(place),
            Err(_) => {}
        }
    }
    let fetched = if is_remote(&record.path) { ", nor fetched for a job there" } else { "" };
    Err(missing(match other {
        Some(place) => format!("{}, whose content has changed since the build", place.display()),
        None => format!("the source {:?}, which is neither beside the database nor here{fetched}", record.path),
    }))
}

/// Where a source may lie: beside the database, or here. An address is looked up in the locks of jobs there.
fn places_of(written: &str, folder: &Path) -> Vec<PathBuf> {
    let beside = std::path::absolute(folder).ok().and_then(|folder| folder.parent().map(Path::to_path_buf));
    let folders = beside.into_iter().chain([PathBuf::new()]);
    match is_remote(written) {
        true => folders.flat_map(|folder| Lock::fetched_beside(&folder, written)).collect(),
        false => folders.map(|folder| folder.join(written)).collect(),
    }
}
