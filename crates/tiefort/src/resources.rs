//! What this process may use: cores and memory, within the limits of its cgroup.

use std::fs;
use std::path::{Path, PathBuf};

use build::Forecast;

use crate::files::bytes_text;

/// Share of the memory that a run plans with; the rest is for what no forecast knows.
const PLANNED_SHARE: f64 = 0.8;

/// Cores this process may use, as the system, its affinity and its cgroup allow.
pub fn cores() -> usize {
    std::thread::available_parallelism().map_or(1, |cores| cores.get())
}

/// Workers for a run that takes what `forecast` says: those asked for, or one per core as far as memory goes; and a
/// remark where memory decides, or is likely to be too little for what was asked.
pub fn workers(asked: Option<usize>, forecast: &Forecast) -> (usize, Option<String>) {
    workers_within(asked, cores(), memory_bytes(), forecast)
}

fn workers_within(
    asked: Option<usize>,
    cores: usize,
    memory: Option<u64>,
    forecast: &Forecast,
) -> (usize, Option<String>) {
    let Some(memory) = memory else { return (asked.unwrap_or(cores), None) };
    let planned = (memory as f64 * PLANNED_SHARE) as u64;
    let fit = planned.saturating_sub(forecast.shared_bytes) / forecast.worker_bytes.max(1);
    let fit = usize::try_from(fit).unwrap_or(usize::MAX).max(1);
    let has = bytes_text(memory);
    match asked {
        Some(asked) if fit < asked => {
            let needs = bytes_text(forecast.shared_bytes + asked as u64 * forecast.worker_bytes);
            (asked, Some(format!("{asked} workers may need {needs} of memory, and {has} are free")))
        }
        Some(asked) => (asked, None),
        None if fit < cores => (
            fit,
            Some(format!("{fit} of {cores} cores are used: {has} of memory are free, each worker needs its part")),
        ),
        None => (cores, None),
    }
}

/// Memory this process may still take: what is available, and what its cgroup and those above it leave.
pub fn memory_bytes() -> Option<u64> {
    let mut least = fs::read_to_string("/proc/meminfo").ok().as_deref().and_then(available);
    for folder in cgroups() {
        let number = |name: &str| fs::read_to_string(folder.join(name)).ok()?.trim().parse::<u64>().ok();
        let pairs = [("memory.max", "memory.current"), ("memory.limit_in_bytes", "memory.usage_in_bytes")];
        for (limit, used) in pairs {
            if let Some(limit) = number(limit) {
                let left = limit.saturating_sub(number(used).unwrap_or(0));
                least = Some(least.map_or(left, |least| least.min(left)));
            }
        }
    }
    least
}

/// `MemAvailable` of `/proc/meminfo`.
fn available(text: &str) -> Option<u64> {
    let line = text.lines().find_map(|line| line.strip_prefix("MemAvailable:"))?;
    Some(line.trim().strip_suffix(" kB")?.trim().parse::<u64>().ok()? * 1024)
}

/// The folders of this process's cgroups and of all above them, of both versions.
fn cgroups() -> Vec<PathBuf> {
    let text = fs::read_to_string("/proc/self/cgroup").unwrap_or_default();
    text.lines().filter_map(mounted).flat_map(|(root, below)| above(&root, &below)).collect()
}

/// Where a line of `/proc/self/cgroup` leads: the mount, and the path below it.
fn mounted(line: &str) -> Option<(PathBuf, PathBuf)> {
    let mut parts = line.splitn(3, ':');
    let (_, controllers, path) = (parts.next()?, parts.next()?, parts.next()?);
    let root = match controllers {
        "" => "/sys/fs/cgroup",
        controllers if controllers.split(',').any(|name| name == "memory") => "/sys/fs/cgroup/memory",
        _ => return None,
    };
    Some((root.into(), path.trim_start_matches('/').into()))
}

fn above(root: &Path, below: &Path) -> Vec<PathBuf> {
    below.ancestors().map(|part| root.join(part)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use build::StageSeconds;

    const FORECAST: Forecast = Forecast {
        memory_bytes: 300 << 20,
        shared_bytes: 100 << 20,
        worker_bytes: 100 << 20,
        seconds: 1.0,
        stages: StageSeconds { survey: 0.0, refine: 1.0, assemble: 0.0, publish: 0.0, page: 0.0 },
        disk_bytes: 1,
    };

    #[track_caller]
    fn check(asked: Option<usize>, memory_mib: u64, expected: usize, remarks: bool) {
        let (workers, remark) = workers_within(asked, 8, Some(memory_mib << 20), &FORECAST);
        assert_eq!((workers, remark.is_some()), (expected, remarks), "{remark:?}");
    }

    #[test]
    fn memory_bounds_the_workers_that_were_not_asked_for() {
        check(None, 16_000, 8, false);
        check(None, 500, 3, true);
        check(None, 50, 1, true);
        check(Some(8), 16_000, 8, false);
        check(Some(8), 500, 8, true);
        assert_eq!(workers_within(None, 4, None, &FORECAST), (4, None));
    }

    #[test]
    fn the_memory_that_is_available_is_read() {
        let text = "MemTotal:       24000000 kB\nMemFree: 1 kB\nMemAvailable:    1000 kB\n";
        assert_eq!(available(text), Some(1_024_000));
        assert_eq!(available("MemTotal: 1 kB"), None);
    }

    #[test]
    fn a_cgroup_is_found_with_all_above_it() {
        let (root, below) = mounted("0::/user.slice/a.scope").unwrap();
        let expected = ["/sys/fs/cgroup/user.slice/a.scope", "/sys/fs/cgroup/user.slice", "/sys/fs/cgroup/"];
        assert_eq!(above(&root, &below), expected.map(PathBuf::from));
        assert_eq!(mounted("5:cpu,cpuacct:/x"), None);
        assert_eq!(mounted("9:memory:/x").unwrap().0, Path::new("/sys/fs/cgroup/memory"));
    }
}
