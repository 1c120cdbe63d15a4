//! Files the command line itself touches: meshes it writes, sizes it tells.

use std::fs;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use tempfile::NamedTempFile;

use crate::failure::Failure;
use crate::left_over;
use crate::signals;

/// Writes a file that appears under its name only when it is whole, and on the disk.
///
/// # Errors
/// When it cannot be written; what lay there before is then still there.
pub fn write_whole(
    path: &Path,
    write: impl FnOnce(&mut BufWriter<&fs::File>) -> io::Result<()>,
) -> Result<(), Failure> {
    write_whole_or(path, |out| write(out).map_err(|error| Failure::output(path, &error)))
}

/// The same where writing may fail for other reasons.
///
/// # Errors
/// Those of `write`, and when the file cannot be written.
pub fn write_whole_or(
    path: &Path,
    write: impl FnOnce(&mut BufWriter<&fs::File>) -> Result<(), Failure>,
) -> Result<(), Failure> {
    let fault = |error: io::Error| Failure::output(path, &error);
    let file = temporary_beside(path)?;
    // Others leave it alone while this process lives. Locked as it is open here: Windows lets only that one write.
    let _ = file.as_file().try_lock();
    let _making = signals::making(file.path());
    let mut out = BufWriter::new(file.as_file());
    write(&mut out)?;
    out.flush().map_err(fault)?;
    drop(out);
    file.as_file().sync_all().map_err(fault)?;
    file.persist(path).map_err(|error| fault(error.error))?;
    Ok(())
}

/// Lets `make` write a file under a temporary name, then gives it its own.
///
/// # Errors
/// Those of `make`, and when the file cannot be made.
pub fn make_whole(path: &Path, make: impl FnOnce(&Path) -> Result<(), Failure>) -> Result<(), Failure> {
    let fault = |error: io::Error| Failure::output(path, &error);
    refuse_special(path)?;
    left_over::sweep(folder_of(path));
    // In a folder of its own, which this process holds: what makes the file may lock it in its own way, and put others
    // beside it.
    let folder = tempfile::Builder::new().prefix(left_over::PREFIX).tempdir_in(folder_of(path)).map_err(fault)?;
    let _held = left_over::hold(folder.path());
    let _making = signals::making(folder.path());
    let file = folder.path().join(path.file_name().unwrap_or("part".as_ref()));
    make(&file)?;
    fs::rename(&file, path).map_err(fault)
}

fn temporary_beside(path: &Path) -> Result<NamedTempFile, Failure> {
    refuse_special(path)?;
    left_over::sweep(folder_of(path));
    let mut builder = tempfile::Builder::new();
    builder.prefix(left_over::PREFIX);
    // A temporary file is private by default; this one is about to be an ordinary file.
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    builder.tempfile_in(folder_of(path)).map_err(|error| Failure::output(path, &error))
}

/// Writes a text file where there is none yet.
///
/// # Errors
/// When there is one, or it cannot be written.
pub fn write_new(path: &Path, text: &str) -> Result<(), Failure> {
    check_free(path)?;
    write_whole(path, |out| out.write_all(text.as_bytes()))
}

/// Whether a text file can be made where there is none yet, asked before long work.
///
/// # Errors
/// When there is one, or its folder is missing or not writable.
pub fn check_free(path: &Path) -> Result<(), Failure> {
    if left_over::is_taken(path) {
        let found = if path.is_dir() { "a folder" } else { left_over::named(path) };
        let message = format!("{}: found {found}, expected a name that is free", path.display());
        return Err(Failure::new(message, "give another name; a job that is there is never written over"));
    }
    check_writable(path)
}

/// Refuses to put a file in the place of a pipe, a socket or a device: what is renamed into place would replace it.
fn refuse_special(path: &Path) -> Result<(), Failure> {
    match fs::metadata(path) {
        Ok(found) if !found.is_file() && !found.is_dir() => {
            let message = format!("{}: found a pipe, a socket or a device, expected a file name", path.display());
            Err(Failure::new(message, "name a file that is to be made or replaced"))
        }
        _ => Ok(()),
    }
}

/// Makes a folder for files that are to be written, and those around it, where it is not there yet.
///
/// # Errors
/// When it cannot be made, or something else has its name.
pub fn make_folder(path: &Path) -> Result<(), Failure> {
    if left_over::is_taken(path) && !path.is_dir() {
        let message = format!("{}: found {}, expected a folder", path.display(), left_over::named(path));
        return Err(Failure::new(message, "give the name of a folder; it is made where it is not there yet"));
    }
    fs::create_dir_all(path).map_err(|error| Failure::output(path, &error))
}

/// The folder a file is to appear in.
fn folder_of(path: &Path) -> &Path {
    path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// Whether a file can be made at `path`, asked before long work.
///
/// # Errors
/// When the folder is missing or not writable, or `path` is a folder.
pub fn check_writable(path: &Path) -> Result<(), Failure> {
    if path.is_dir() {
        let hint = format!("name the file, such as {}", path.join("NAME").display());
        return Err(Failure::new(format!("{}: found a folder, expected a file name", path.display()), hint));
    }
    refuse_special(path)?;
    if path.is_symlink() && !path.exists() {
        let message = format!("{}: found a link that leads nowhere, expected a file name", path.display());
        return Err(Failure::new(message, "remove the link, or give another name"));
    }
    let probe = tempfile::Builder::new().prefix(left_over::PREFIX).tempfile_in(folder_of(path));
    probe.map(drop).map_err(|error| Failure::output(path, &error))
}

/// Bytes of each part of a database that is there: its folders, then its other files together.
pub fn sizes(database: &Path) -> Vec<(&'static str, u64)> {
    let mut sizes: Vec<_> = store::FOLDERS.into_iter().map(|name| (name, bytes_in(&database.join(name)))).collect();
    sizes.push(("reports and the rest", bytes_in(database)));
    sizes.retain(|&(_, bytes)| 0 < bytes);
    sizes
}

/// Bytes of the files directly in `folder`; nothing where it cannot be read.
fn bytes_in(folder: &Path) -> u64 {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    let files = entries.filter_map(|entry| entry.metadata().ok()).filter(fs::Metadata::is_file);
    files.map(|data| data.len()).sum()
}

/// A size as people say it: 1.2 MB.
pub fn bytes_text(bytes: u64) -> String {
    const UNITS: [&str; 4] = ["kB", "MB", "GB", "TB"];
    if bytes < 1000 {
        return format!("{bytes} bytes");
    }
    let mut size = bytes as f64 / 1000.0;
    let mut unit = 0;
    while 999.95 <= size && unit + 1 < UNITS.len() {
        size /= 1000.0;
        unit += 1;
    }
    format!("{size:.1} {}", UNITS[unit])
}

/// The extension of a file, in small letters; empty when there is none.
pub fn extension(path: &Path) -> String {
    path.extension().map(|extension| extension.to_string_lossy().to_lowercase()).unwrap_or_default()
}

/// `path` with what a person needs to find it.
pub fn shown(path: &Path) -> PathBuf {
    if path.is_relative() && path.components().count() == 1 { Path::new(".").join(path) } else { path.to_path_buf() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_read_as_people_say_them() {
        for (bytes, text) in
            [(0, "0 bytes"), (999, "999 bytes"), (1000, "1.0 kB"), (999_999, "1.0 MB"), (12_340_000, "12.3 MB")]
        {
            assert_eq!(bytes_text(bytes), text);
        }
    }

    #[test]
    fn what_a_killed_process_leaves_of_a_file_in_the_making_is_swept_as_all_else() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.gpkg");
        make_whole(&path, |file| {
            let making = file.parent().unwrap();
            let name = making.file_name().unwrap().to_str().unwrap();
            assert!(making.parent() == Some(folder.path()) && name.starts_with(left_over::PREFIX), "{name}");
            assert_eq!(name.len(), left_over::PREFIX.len() + 6, "{name} is none of those that are swept");
            assert!(left_over::hold(making).is_none(), "it is not held");
            fs::write(file, "whole").map_err(|error| Failure::output(file, &error))
        })
        .unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"whole");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[test]
    fn a_file_that_fails_half_way_leaves_what_was_there() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("mesh.ply");
        write_whole(&path, |out| out.write_all(b"old")).unwrap();
        let broken = write_whole(&path, |out| out.write_all(b"new").and(Err(io::Error::other("full"))));
        assert!(broken.unwrap_err().to_string().contains("mesh.ply: cannot be written: full"));
        assert_eq!(fs::read(&path).unwrap(), b"old");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }
}
