//! A job from its file: the file is read, then what its text says, then the files it names are looked for.

use std::fs;
use std::io::{self, Read};
use std::path::Path;

use toml::de::DeTable;

use crate::bounds::JOB_BYTES_MAX;
use crate::entry::Document;
use crate::{FindArea, Job, JobError, fetched, files, read};

/// Where the job file at `path` says `key`, as `mine.toml:12`; `None` where it does not, or cannot be read.
pub fn place_of(path: &Path, key: &str) -> Option<String> {
    let text = text_of(path).ok()?;
    let root = DeTable::parse(&text).ok()?;
    let (mut table, mut offset) = (Some(root.get_ref()), 0);
    for name in key.split('.') {
        let (found, value) = table?.iter().find(|(found, _)| found.get_ref() == name)?;
        offset = found.span().start;
        table = value.get_ref().as_table();
    }
    Some(format!("{}:{}", path.display(), Document { path, text: &text }.line(offset)))
}

impl Job {
    /// Reads the job file at `path` and finds the files it names.
    ///
    /// # Errors
    /// Everything a [`JobError`] can say; the first thing wrong in reading order.
    pub fn load(path: &Path) -> Result<Job, JobError> {
        Self::load_asking(path, None)
    }

    /// Reads the job file at `path`, whose area `find` may have to find.
    ///
    /// # Errors
    /// As [`Job::load`], and why there is no such area.
    pub fn load_with(path: &Path, find: &FindArea) -> Result<Job, JobError> {
        Self::load_asking(path, Some(find))
    }

    /// The job that `text` holds, as if it were the file at `path`, with the files it names; `find` may have to find
    /// its area.
    ///
    /// # Errors
    /// As [`Job::load_with`], but for those of the job file itself.
    pub fn of_text(text: &str, path: &Path, find: &FindArea) -> Result<Job, JobError> {
        Self::of_text_asking(text, path, Some(find))
    }

    /// Reads the job file at `path`, whose area `find` may have to find, and looks for none of its files: paths of
    /// files of other machines are their addresses.
    ///
    /// # Errors
    /// As [`Job::load_with`], but for those of files.
    pub fn load_remote(path: &Path, find: &FindArea) -> Result<Job, JobError> {
        let (mut job, mentions) = read::read(&text_of(path)?, path, Some(find))?;
        fetched::check_apart(&mut job, &mentions)?;
        Ok(job)
    }

    fn load_asking(path: &Path, find: Option<&FindArea>) -> Result<Job, JobError> {
        Self::of_text_asking(&text_of(path)?, path, find)
    }

    fn of_text_asking(text: &str, path: &Path, find: Option<&FindArea>) -> Result<Job, JobError> {
        let (mut job, mentions) = read::read(text, path, find)?;
        fetched::check_apart(&mut job, &mentions)?;
        fetched::settle(&mut job, &mentions)?;
        files::locate(&mut job, mentions)?;
        Ok(job)
    }

    /// The job that `text` holds, as if it were the file at `path`; the disk is not looked at, so patterns stay
    /// unexpanded and files may be missing.
    ///
    /// # Errors
    /// Whatever is wrong with the text itself.
    pub fn from_text(text: &str, path: &Path) -> Result<Job, JobError> {
        read::read(text, path, None).map(|(job, _)| job)
    }
}

fn text_of(path: &Path) -> Result<String, JobError> {
    if let Some((found, hint)) = other_than_a_job(path) {
        return Err(JobError::NotAJob { path: path.to_owned(), found, hint });
    }
    let unreadable = |source| JobError::Unreadable { path: path.to_owned(), source };
    // A pipe would wait for a writer.
    if fs::metadata(path).is_ok_and(|data| !data.is_file() && !data.is_dir()) {
        return Err(unreadable(io::Error::other("it is a pipe, a socket or a device")));
    }
    let file = fs::File::open(path).map_err(unreadable)?;
    let mut bytes = Vec::new();
    file.take(JOB_BYTES_MAX + 1).read_to_end(&mut bytes).map_err(unreadable)?;
    if JOB_BYTES_MAX < bytes.len() as u64 {
        let found = fs::metadata(path).map_or(bytes.len() as u64, |data| data.len());
        return Err(JobError::TooLong { path: path.to_owned(), found, limit: JOB_BYTES_MAX });
    }
    let text = String::from_utf8(bytes)
        .map_err(|error| JobError::NotText { path: path.to_owned(), after: error.utf8_error().valid_up_to() })?;
    if text.trim_start().starts_with('{') {
        let hint = "a job is TOML: a line [area], below it name = \"ntc\" and so on".to_owned();
        return Err(JobError::NotAJob { path: path.to_owned(), found: "JSON", hint });
    }
    Ok(text)
}

/// What is at `path`, where that cannot be a job, and a hint. Nothing is opened: that of a pipe would wait for ever.
fn other_than_a_job(path: &Path) -> Option<(&'static str, String)> {
    let example = || "give the path of a job file, for example configs/ntc.toml".to_owned();
    let data = match fs::metadata(path) {
        Ok(data) => data,
        Err(_) if path.is_symlink() => return Some(("a link that leads nowhere", example())),
        Err(error) if error.kind() == io::ErrorKind::NotFound => {
            let hint = "check the path; for a raster this writes a job: tiefort init dem.tif --out mine.toml";
            return Some(("nothing there", hint.to_owned()));
        }
        // Opening it says why.
        Err(_) => return None,
    };
    if data.is_dir() && path.join("database.json").is_file() {
        let hint = "name the job it was built from; `tiefort report` and `tiefort status` read a database".to_owned();
        return Some(("the folder of a terrain database", hint));
    }
    match (data.is_dir(), data.is_file(), data.len()) {
        (true, ..) => Some(("a folder", example())),
        (_, true, 0) => Some(("an empty file", "`tiefort init dem.tif` writes a job for a raster".to_owned())),
        (_, true, _) => None,
        _ => Some((
            "a pipe, a socket or a device",
            "paths in a job begin at the folder it lies in: copy it into a file".to_owned(),
        )),
    }
}
