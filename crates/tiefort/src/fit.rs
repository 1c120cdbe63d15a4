//! Whether a build fits this machine: the memory and the disk that are free, against what it is expected to take.

use std::path::Path;

use build::Forecast;
use job::Job;
use store::Folder;

use crate::failure::Failure;
use crate::files;
use crate::resources::memory_bytes;

/// Refuses a build with so many workers that will not fit. What the folder of the database holds is no more to come:
/// files of a build take the place of those of the one before, one by one.
///
/// # Errors
/// When more memory or disk is expected to be needed than is free; both numbers are told.
pub fn check(job: &Job, forecast: &Forecast, workers: usize, folder: &Path) -> Result<(), Failure> {
    let memory = Need {
        of: format!("memory of {workers} workers"),
        bytes: forecast.shared_bytes + workers as u64 * forecast.worker_bytes,
        why: "that this job is forecast to take",
        hint: "use fewer --workers, or more and smaller tiles; --force tries all the same",
    };
    memory.check(memory_bytes())?;
    let (bytes, why) = match still_to_come(job, forecast.disk_bytes, folder) {
        bytes if bytes == forecast.disk_bytes => (bytes, "that this job is forecast to take"),
        bytes => (bytes, "that this job is forecast to take beyond what the folder holds"),
    };
    check_disk(folder, bytes, why, "make room, or name another place with --out; --force tries all the same")
}

/// Bytes that a build is to add to the folder of its database. One that was finished by the same job has what it takes,
/// whatever the forecast.
fn still_to_come(job: &Job, forecast_bytes: u64, folder: &Path) -> u64 {
    let is_built = Folder::new(folder).finished().is_ok_and(|manifest| manifest.job == job.canonical_text());
    let there: u64 = files::sizes(folder).iter().map(|(_, bytes)| bytes).sum();
    if is_built { 0 } else { forecast_bytes.saturating_sub(there) }
}

/// Refuses what the disk on which `folder` is, or will be, has no room for.
///
/// # Errors
/// When less is free than `bytes`; both numbers are told.
pub fn check_disk(folder: &Path, bytes: u64, why: &str, hint: &str) -> Result<(), Failure> {
    Need { of: format!("disk of {}", folder.display()), bytes, why, hint }.check(free_disk(folder))
}

/// What is needed of something that a machine has so much of.
struct Need<'a> {
    of: String,
    bytes: u64,
    why: &'a str,
    hint: &'a str,
}

impl Need<'_> {
    fn check(&self, free: Option<u64>) -> Result<(), Failure> {
        let Some(free) = free.filter(|&free| free < self.bytes) else { return Ok(()) };
        let (expected, free) = (files::bytes_text(self.bytes), files::bytes_text(free));
        Err(Failure::new(format!("{}: {free} free, expected the {expected} {}", self.of, self.why), self.hint))
    }
}

/// Bytes free on the disk on which `folder` is, or will be.
pub fn free_disk(folder: &Path) -> Option<u64> {
    let whole = std::path::absolute(folder).ok()?;
    let there = whole.ancestors().find(|folder| folder.exists())?;
    fs4::available_space(there).ok()
}

#[cfg(test)]
mod tests {
    use super::*;
    use build::StageSeconds;

    fn job() -> Job {
        let text = "[area]\nname = \"a\"\ncrs = \"EPSG:32611\"\norigin_m = [505000, 3875000]\nsize_m = [1000, 1000]\n\
                    spacing_m = 25\n[dem]\nsource = \"sample\"\nseed = 1\n";
        Job::from_text(text, Path::new("a.toml")).unwrap()
    }

    #[test]
    fn what_a_folder_holds_is_no_more_to_come() {
        let folder = tempfile::tempdir().unwrap();
        let to_come = |bytes| still_to_come(&job(), bytes, folder.path());
        assert_eq!(to_come(1000), 1000);
        std::fs::create_dir(folder.path().join("tiles")).unwrap();
        std::fs::write(folder.path().join("tiles/0_0.tile"), [0; 300]).unwrap();
        assert_eq!([1000, 200].map(to_come), [700, 0]);
    }

    #[test]
    fn what_no_machine_has_is_refused_with_both_numbers_and_what_all_have_is_not() {
        let forecast = |memory_bytes, disk_bytes| Forecast {
            memory_bytes,
            shared_bytes: memory_bytes,
            worker_bytes: 0,
            seconds: 1.0,
            stages: StageSeconds::default(),
            disk_bytes,
        };
        let here = std::env::temp_dir();
        assert!(check(&job(), &forecast(1 << 20, 1 << 10), 2, &here.join("not/there/yet")).is_ok());
        if memory_bytes().is_some() {
            let refused = check(&job(), &forecast(1 << 60, 1), 2, &here).unwrap_err().to_string();
            assert!(
                refused.contains("memory of 2 workers: ") && refused.contains("--force tries all the same"),
                "{refused}"
            );
        }
        if free_disk(&here).is_some() {
            let refused = check(&job(), &forecast(1, 1 << 62), 2, &here).unwrap_err().to_string();
            assert!(refused.contains("disk of "), "{refused}");
        }
    }
}
