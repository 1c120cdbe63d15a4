//! Files beside a source that say how it is to be read, found by its name: they are a part of what a build is made
//! from.

use std::path::{Path, PathBuf};

/// Endings of raw grids, which a header of the same name describes.
pub(crate) const RAW_ENDINGS: [&str; 8] = ["flt", "bil", "bin", "raw", "img", "bsq", "bip", "dem"];

/// The file of the same name with one of some endings.
pub(crate) fn beside(path: &Path, endings: &[&str]) -> Option<PathBuf> {
    let mut names = endings.iter().flat_map(|ending| [ending.to_string(), ending.to_uppercase()]);
    names.find_map(|ending| Some(path.with_extension(ending)).filter(|other| other != path && other.is_file()))
}

/// The files that a reader of `path` may look at besides it: a coordinate system (`.prj`), a header (`.hdr`) or the
/// grid that a header describes, the index and the table of a Shapefile (`.shx`, `.dbf`, `.cpg`), what was written to
/// a GeoPackage last (`.gpkg-wal`).
pub(crate) fn all_beside(path: &Path) -> Vec<PathBuf> {
    let ending = path.extension().map(|ending| ending.to_string_lossy().to_lowercase());
    // A packed file's other name: `a.asc.gz` and `a.prj`.
    let is_packed = matches!(ending.as_deref(), Some("gz" | "zip"));
    let plain = if is_packed { path.with_extension("") } else { path.to_owned() };
    let mut kinds: Vec<&[&str]> = vec![&["prj"]];
    match ending.as_deref() {
        Some("hdr") => kinds.push(&RAW_ENDINGS),
        Some("shp") => kinds.extend([&["shx"][..], &["dbf"], &["cpg"]]),
        _ if is_packed => {}
        _ => kinds.push(&["hdr"]),
    }
    let named = kinds.into_iter().filter_map(|endings| beside(&plain, endings).or_else(|| beside(path, endings)));
    named.chain((ending.as_deref() == Some("gpkg")).then(|| log_beside(path)).flatten()).collect()
}

/// The log beside a database, which holds what has not been brought into it yet. Readers leave empty ones behind.
fn log_beside(path: &Path) -> Option<PathBuf> {
    let mut name = path.as_os_str().to_owned();
    name.push("-wal");
    let log = PathBuf::from(name);
    log.metadata().is_ok_and(|data| data.is_file() && 0 < data.len()).then_some(log)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_files_that_a_shapefile_or_a_geopackage_consists_of_are_found() {
        let folder = tempfile::tempdir().unwrap();
        let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
        for name in ["a.shp", "a.shx", "a.dbf", "a.PRJ", "a.cpg", "a.sbn", "b.gpkg", "b.gpkg-wal", "c.gpkg"] {
            write(name, "x");
        }
        write("c.gpkg-wal", "");
        let found = |name: &str| -> Vec<String> {
            let all = all_beside(&folder.path().join(name));
            all.iter().map(|path| path.file_name().unwrap().to_string_lossy().into_owned()).collect()
        };
        assert_eq!(found("a.shp"), ["a.PRJ", "a.shx", "a.dbf", "a.cpg"]);
        assert_eq!(found("b.gpkg"), ["b.gpkg-wal"]);
        assert_eq!(found("c.gpkg"), [""; 0], "an empty log holds nothing");
    }
}
