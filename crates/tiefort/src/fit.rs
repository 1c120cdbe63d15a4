//! Whether a build fits this machine: the memory and the disk that are free, against what it is expected to take.

use std::path::Path;

use build::Forecast;

use crate::failure::Failure;
use crate::files;
use crate::resources::memory_bytes;

/// Refuses a build with so many workers that will not fit.
///
/// # Errors
/// When more memory or disk is expected to be needed than is free; both numbers are told.
pub fn check(forecast: &Forecast, workers: usize, folder: &Path) -> Result<(), Failure> {
    let needs = [
        (
            format!("memory of {workers} workers"),
            forecast.shared_bytes + workers as u64 * forecast.worker_bytes,
            memory_bytes(),
            "use fewer --workers, or more and smaller tiles",
        ),
        (
            format!("disk of {}", folder.display()),
            forecast.disk_bytes,
            free_disk(folder),
            "make room, or name another place with --out",
        ),
    ];
    for (what, expected, free, hint) in needs {
        if let Some(free) = free.filter(|&free| free < expected) {
            let (expected, free) = (files::bytes_text(expected), files::bytes_text(free));
            let message = format!("{what}: {free} free, expected the {expected} that this job is forecast to take");
            return Err(Failure::new(message, format!("{hint}; --force tries all the same")));
        }
    }
    Ok(())
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
        assert!(check(&forecast(1 << 20, 1 << 10), 2, &here.join("not/there/yet")).is_ok());
        if memory_bytes().is_some() {
            let refused = check(&forecast(1 << 60, 1), 2, &here).unwrap_err().to_string();
            assert!(
                refused.contains("memory of 2 workers: ") && refused.contains("--force tries all the same"),
                "{refused}"
            );
        }
        if free_disk(&here).is_some() {
            let refused = check(&forecast(1, 1 << 62), 2, &here).unwrap_err().to_string();
            assert!(refused.contains("disk of "), "{refused}");
        }
    }
}
