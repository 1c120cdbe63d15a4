//! Files of other machines that a job names, and where `tiefort fetch` put them.
//!
//! The path of a file that is not fetched yet is its address with all that follows a `?`; nothing else has that.

use std::path::{Path, PathBuf};

use crate::files::{Mention, Place, all_named};
use crate::lock::Lock;
use crate::remote::is_remote;
use crate::{DemSource, Fault, Job, JobError, NamedFile, SourceFile};

impl Job {
    /// Files of other machines that the job names, each once: what stands for each in messages, and its address. Of a
    /// job whose files are not looked for, as [`Job::load_remote`] reads one.
    pub fn remote_files(&self) -> Vec<NamedFile> {
        let mut job = self.clone();
        let mut found: Vec<NamedFile> = Vec::new();
        for (_, written, path) in all_named(&mut job) {
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

/// Refuses two addresses that differ behind their `?` alone: names, lock and fetched file would be the same.
///
/// # Errors
/// When there are such.
pub(crate) fn check_apart(job: &mut Job, mentions: &[Mention]) -> Result<(), JobError> {
    let mut seen: Vec<(String, PathBuf)> = Vec::new();
    for (place, written, path) in all_named(job) {
        if seen.iter().any(|(other, at)| other == written && at != path) {
            let fault = mention_of(place, mentions);
            let found = format!("{}, which differs from another address behind its ? alone", fault.found);
            let hint = "what follows a ? is kept out of names, since it may be a signature; fetch one of them by other \
                        means, and name it by its path";
            let expected = format!("{} with a name of its own", fault.expected);
            return Err(JobError::NoSuchFile(Box::new(Fault { found, expected, hint: hint.into(), ..fault.clone() })));
        }
        if is_remote(written) {
            seen.push((written.clone(), path.clone()));
        }
    }
    Ok(())
}

/// Puts the fetched files in the places of the addresses that a job names.
///
/// # Errors
/// When the lock is none, or something is not fetched, or for another area, or changed since.
pub(crate) fn settle(job: &mut Job, mentions: &[Mention]) -> Result<(), JobError> {
    if !all_named(job).iter().any(|(_, written, _)| is_remote(written)) {
        return Ok(());
    }
    let lock = Lock::read(&job.path)?;
    let (path, area) = (job.path.clone(), job.fetch_area());
    for (place, written, at) in all_named(job) {
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn addresses_that_differ_behind_their_question_mark_alone_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        let load = |second: &str| {
            let path = folder.path().join("a.toml");
            let text = format!(
                "[area]\nname = \"a\"\ncrs = \"EPSG:32611\"\norigin_m = [0, 0]\nsize_m = [1000, 1000]\nspacing_m = 25\n\
                 [dem]\nsources = [\"https://a.org/dem.tif?tile=1\", \"https://a.org/{second}\"]\n"
            );
            std::fs::write(&path, text).unwrap();
            Job::load_remote(&path, &|_, _| unreachable!("the job says its area"))
        };
        assert_eq!(load("other.tif?tile=1").unwrap().remote_files().len(), 2);
        assert_eq!(load("dem.tif?tile=1").unwrap().remote_files().len(), 1);
        let refused = load("dem.tif?tile=2").unwrap_err();
        assert!(
            refused.to_string().contains("behind its ? alone") && !refused.to_string().contains("tile="),
            "{refused}"
        );
    }
}
