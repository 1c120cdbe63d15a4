//! Files of other machines that a job names, and where `tiefort fetch` put them.
//!
//! The path of a file that is not fetched yet is its address with all that follows a `?`; nothing else has that.

use std::path::{Path, PathBuf};

use crate::files::{Mention, Place};
use crate::lock::Lock;
use crate::remote::is_remote;
use crate::{AreaShape, DemSource, Fault, FeatureSource, Job, JobError, NamedFile, SourceFile, Start};

impl Job {
    /// Files of other machines that the job names, each once: what stands for each in messages, and its address. Of a
    /// job whose files are not looked for, as [`Job::load_remote`] reads one.
    pub fn remote_files(&self) -> Vec<NamedFile> {
        let mut job = self.clone();
        let mut found: Vec<NamedFile> = Vec::new();
        for (_, written, path) in named(&mut job) {
            if is_remote(written) && !found.iter().any(|other| other.written == *written) {
                found.push(NamedFile { written: written.clone(), path: path.clone() });
            }
        }
        found
    }

    /// The rasters among them, in the order of the job.
    pub fn remote_rasters(&self) -> Vec<&SourceFile> {
        let DemSource::Files { files, .. } = &self.dem.source else { return Vec::new() };
        files.iter().filter(|file| is_remote(&file.written)).collect()
    }

    /// The area as a lock has it: rasters are fetched for one area and one spacing.
    pub fn fetch_area(&self) -> String {
        let ([east, north], [wide, high]) = (self.area.origin_m, self.area.size_m());
        let spacing_m = self.area.spacing.metres();
        format!("EPSG:{} from {east}, {north}, {wide} x {high} m, posts {spacing_m} m apart", self.area.epsg)
    }
}

/// Every file that a job names: where, its name, and its path.
fn named(job: &mut Job) -> Vec<(Place, &mut String, &mut PathBuf)> {
    let mut all = Vec::new();
    if let DemSource::Files { files, .. } = &mut job.dem.source {
        let files = files.iter_mut().enumerate();
        all.extend(files.map(|(index, file)| (Place::Source(index), &mut file.written, &mut file.path)));
    }
    let mut files: Vec<(Place, &mut NamedFile)> = Vec::new();
    for (index, geoid) in job.dem.geoids.iter_mut().enumerate() {
        files.push((Place::Geoid(index), &mut geoid.file));
    }
    files.extend(job.dem.water.iter_mut().map(|water| (Place::Water, &mut water.file)));
    for (index, area) in job.importance.areas.iter_mut().enumerate() {
        if let AreaShape::Polygons { file } | AreaShape::RasterValue { file, .. } = &mut area.shape {
            files.push((Place::ImportanceArea(index), file));
        }
    }
    if let Some(Start::File(file)) = &mut job.tin.start {
        files.push((Place::Start, file));
    }
    files.extend(job.tin.pins.iter_mut().map(|file| (Place::Pins, file)));
    for (index, source) in job.features.iter_mut().flat_map(|features| &mut features.sources).enumerate() {
        if let FeatureSource::File { file, .. } = source {
            files.push((Place::Features(index), file));
        }
    }
    for (index, source) in job.objects.iter_mut().flat_map(|objects| &mut objects.sources).enumerate() {
        files.push((Place::Objects(index), &mut source.file));
    }
    all.extend(files.into_iter().map(|(place, file)| (place, &mut file.written, &mut file.path)));
    all
}

/// Puts the fetched files in the places of the addresses that a job names.
///
/// # Errors
/// When the lock is none, or something is not fetched, or for another area, or changed since.
pub(crate) fn settle(job: &mut Job, mentions: &[Mention]) -> Result<(), JobError> {
    if !named(job).iter().any(|(_, written, _)| is_remote(written)) {
        return Ok(());
    }
    let lock = Lock::read(&job.path)?;
    let (path, area) = (job.path.clone(), job.fetch_area());
    for (place, written, at) in named(job) {
        if is_remote(written) {
            let found = fetched(lock.as_ref(), written, &area, &path);
            *at = found.map_err(|reason| unfetched(mention_of(place, mentions), &reason, &path))?;
        }
    }
    if let (Some(lock), DemSource::Files { files, .. }) = (&lock, &mut job.dem.source) {
        for file in files.iter_mut().filter(|file| file.said.attribution.is_none()) {
            let attribution = lock.of(&file.written).map(|locked| locked.attribution.clone());
            file.said.attribution = attribution.filter(|text| !text.is_empty());
        }
    }
    Ok(())
}

/// Where what an address names was put, or why that will not do.
fn fetched(lock: Option<&Lock>, written: &str, area: &str, job: &Path) -> Result<PathBuf, String> {
    let not = || "which is not fetched".to_owned();
    let lock = lock.ok_or_else(not)?;
    let locked = lock.of(written).ok_or_else(not)?;
    if locked.window.is_some() && lock.area != area {
        return Err("which is fetched for another area or spacing".into());
    }
    let path = locked.path(job);
    match std::fs::metadata(&path).map(|data| data.len()) {
        Ok(len) if len == locked.len => Ok(path),
        Ok(len) => Err(format!("whose fetched file has {len} bytes and {} in the lock", locked.len)),
        Err(_) => Err("whose fetched file is gone".into()),
    }
}

fn mention_of(place: Place, mentions: &[Mention]) -> &Fault {
    let own = mentions.iter().find(|mention| mention.place == place);
    &own.or(mentions.first()).expect("every file is mentioned").fault
}

fn unfetched(fault: &Fault, reason: &str, job: &Path) -> JobError {
    let found = format!("{}, {reason}", fault.found);
    let hint = format!("a build never touches a network; bring it here: tiefort fetch {}", job.display());
    let expected = format!("{} on this machine", fault.expected);
    JobError::NoSuchFile(Box::new(Fault { found, expected, hint, ..fault.clone() }))
}
