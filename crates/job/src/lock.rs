//! The lock of a job: what `tiefort fetch` brought, from where, and what it was then.
//!
//! It lies beside the job as `NAME.lock`, and what was brought in `NAME.sources/`. A build reads both and no network.

use std::fmt::Write;
use std::fs;
use std::path::{Path, PathBuf};

use toml::{Table, Value};

use crate::JobError;
use crate::remote::{check_address, without_query};
use crate::setting_list::quoted;

/// Bytes of a lock at most: a few hundred for each of a job's sources.
const BYTES_MAX: u64 = 16 << 20;

/// What was fetched for a job.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Lock {
    /// The area and the spacing that rasters were fetched for, as [`crate::Job::fetch_area`] has them.
    pub area: String,
    /// The files, in the order of the job.
    pub files: Vec<Locked>,
}

/// A file that was fetched.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Locked {
    /// Its address as the job has it, without what follows a `?`.
    pub address: String,
    /// Its name in the folder of fetched files.
    pub file: String,
    /// Bytes of the file there.
    pub len: u64,
    /// BLAKE3 of the file there, in hexadecimal digits.
    pub blake3: String,
    /// The server's mark of this version of what it has; empty where it gives none.
    pub etag: String,
    /// Bytes of what the server has.
    pub remote_len: u64,
    /// The day on which it came, as `2026-11-25`.
    pub date: String,
    /// What is here of a raster: its level, 0 for full resolution, and how many of its strips or tiles; `None` where
    /// all of a file is here.
    pub window: Option<(u64, u64)>,
    /// Under which licence it is, where that is known.
    pub licence: String,
    /// Whom to thank, where that is known.
    pub attribution: String,
}

impl Locked {
    /// Where it lies, for the job at `job`.
    pub fn path(&self, job: &Path) -> PathBuf {
        Lock::folder(job).join(&self.file)
    }
}

impl Lock {
    /// Where the lock of the job at `job` lies.
    pub fn place(job: &Path) -> PathBuf {
        job.with_extension("lock")
    }

    /// The folder of what was fetched for the job at `job`.
    pub fn folder(job: &Path) -> PathBuf {
        job.with_extension("sources")
    }

    /// The file that stands for an address.
    pub fn of(&self, address: &str) -> Option<&Locked> {
        self.files.iter().find(|locked| locked.address == without_query(address))
    }

    /// Where locks in a folder say that what an address names was put, for whichever jobs; what is no lock is passed
    /// over.
    pub fn fetched_beside(folder: &Path, address: &str) -> Vec<PathBuf> {
        let listed = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
        let entries = fs::read_dir(listed).into_iter().flatten().flatten();
        let mut names: Vec<PathBuf> = entries.map(|entry| PathBuf::from(entry.file_name())).collect();
        names.retain(|name| name.extension().is_some_and(|extension| extension == "lock"));
        names.sort();
        let places = names.into_iter().filter_map(|name| {
            // A lock has the name of its job but for the ending.
            let job = folder.join(name);
            let lock = Self::read(&job).ok()??;
            lock.of(address).map(|locked| locked.path(&job))
        });
        places.collect()
    }

    /// Reads the lock of the job at `job`; `None` where there is none.
    ///
    /// # Errors
    /// When it is not as it was written.
    pub fn read(job: &Path) -> Result<Option<Self>, JobError> {
        let path = Self::place(job);
        let broken = |found: String| JobError::BrokenLock { path: path.clone(), found };
        let Ok(data) = fs::metadata(&path) else { return Ok(None) };
        if !data.is_file() || BYTES_MAX < data.len() {
            return Err(broken(format!("what is no file, or one of {} bytes", data.len())));
        }
        let text = fs::read_to_string(&path).map_err(|error| broken(error.to_string()))?;
        let table: Table = text.parse().map_err(|error: toml::de::Error| broken(error.message().to_owned()))?;
        let area = text_of(&table, "area").map_err(broken)?;
        let files = match table.get("file") {
            None => Vec::new(),
            Some(Value::Array(files)) => files.iter().map(locked).collect::<Result<_, _>>().map_err(broken)?,
            Some(_) => return Err(broken("file, which is no list of tables".into())),
        };
        Ok(Some(Self { area, files }))
    }

    /// The lock as text.
    pub fn text(&self) -> String {
        let mut text = String::from(
            "# Written by `tiefort fetch`: what it brought, from where, and what it was then.\n\
             # `tiefort build` takes these files; `tiefort fetch --update` brings newer ones.\n",
        );
        let _ = writeln!(text, "area = {}", quoted(&self.area));
        for file in &self.files {
            let _ = writeln!(text, "\n[[file]]");
            for (key, value) in [
                ("address", &file.address),
                ("file", &file.file),
                ("blake3", &file.blake3),
                ("etag", &file.etag),
                ("date", &file.date),
                ("licence", &file.licence),
                ("attribution", &file.attribution),
            ] {
                let _ = writeln!(text, "{key} = {}", quoted(value));
            }
            let _ = writeln!(text, "bytes = {}\nremote_bytes = {}", file.len, file.remote_len);
            if let Some((level, chunks)) = file.window {
                let _ = writeln!(text, "level = {level}\nchunks = {chunks}");
            }
        }
        text
    }
}

fn locked(value: &Value) -> Result<Locked, String> {
    let table = value.as_table().ok_or("file, which is no table")?;
    let text = |key: &str| text_of(table, key);
    let number = |key: &str| {
        let number = table.get(key).and_then(Value::as_integer).and_then(|number| u64::try_from(number).ok());
        number.ok_or_else(|| format!("{key}, which is no number of bytes"))
    };
    let file = text("file")?;
    if file.is_empty() || file.starts_with('.') || file.contains(['/', '\\', '\0']) {
        return Err(format!("{}, which is no name of a file in the folder of fetched ones", quoted(&file)));
    }
    let address = text("address")?;
    check_address(&address).map_err(|_| format!("{}, which is no address", quoted(without_query(&address))))?;
    let window = match (table.get("level"), table.get("chunks")) {
        (None, None) => None,
        _ => Some((number("level")?, number("chunks")?)),
    };
    Ok(Locked {
        address,
        file,
        len: number("bytes")?,
        blake3: text("blake3")?,
        etag: text("etag")?,
        remote_len: number("remote_bytes")?,
        date: text("date")?,
        window,
        licence: text("licence")?,
        attribution: text("attribution")?,
    })
}

fn text_of(table: &Table, key: &str) -> Result<String, String> {
    let text = table.get(key).and_then(Value::as_str).map(str::to_owned);
    text.ok_or_else(|| format!("no text for {key}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lock() -> Lock {
        let file = Locked {
            address: "https://a.org/x.tif".into(),
            file: "x.tif".into(),
            len: 5,
            blake3: "00".into(),
            etag: "\"e\\1\"".into(),
            remote_len: 9,
            date: "2026-11-25".into(),
            window: Some((1, 4)),
            licence: "CC0".into(),
            attribution: "© a".into(),
        };
        let whole = Locked { address: "s3://b/y.pbf".into(), file: "y.pbf".into(), window: None, ..file.clone() };
        Lock { area: "here".into(), files: vec![file, whole] }
    }

    #[test]
    fn a_lock_is_read_as_it_was_written() {
        let folder = tempfile::tempdir().unwrap();
        let job = folder.path().join("a.toml");
        assert_eq!(Lock::read(&job).unwrap(), None);
        fs::write(folder.path().join("a.lock"), lock().text()).unwrap();
        assert_eq!(Lock::read(&job).unwrap(), Some(lock()));
        assert_eq!(lock().of("https://a.org/x.tif?sig=1").unwrap().file, "x.tif");
    }

    #[test]
    fn what_was_fetched_is_found_by_its_address_for_any_job_of_a_folder() {
        let folder = tempfile::tempdir().unwrap();
        for name in ["a.lock", "b.lock"] {
            fs::write(folder.path().join(name), lock().text()).unwrap();
        }
        fs::write(folder.path().join("Cargo.lock"), "version = 4\n").unwrap();
        let found = |address: &str| Lock::fetched_beside(folder.path(), address);
        let expected = ["a.sources/x.tif", "b.sources/x.tif"].map(|name| folder.path().join(name));
        assert_eq!(found("https://a.org/x.tif?sig=1"), expected);
        assert!(found("https://a.org/z.tif").is_empty());
    }

    #[test]
    fn a_lock_edited_by_hand_is_refused_and_leads_out_of_no_folder() {
        let folder = tempfile::tempdir().unwrap();
        let job = folder.path().join("a.toml");
        for (old, new) in [
            ("\"x.tif\"", "\"../x.tif\""),
            ("\"x.tif\"", "\"/etc/passwd\""),
            ("bytes = 5", "bytes = -5"),
            ("https://a.org", "file:///a"),
            ("area", "aera"),
            ("[[file]]", "[[file"),
        ] {
            fs::write(folder.path().join("a.lock"), lock().text().replacen(old, new, 1)).unwrap();
            let error = Lock::read(&job).unwrap_err();
            assert!(error.to_string().contains("a.lock") && error.hint().contains("tiefort fetch"), "{error}");
        }
    }
}
