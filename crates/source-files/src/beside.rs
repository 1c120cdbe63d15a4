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
/// grid that a header describes, the index of a Shapefile (`.shx`).
pub(crate) fn all_beside(path: &Path) -> Vec<PathBuf> {
    let ending = path.extension().map(|ending| ending.to_string_lossy().to_lowercase());
    // A packed file's other name: `a.asc.gz` and `a.prj`.
    let is_packed = matches!(ending.as_deref(), Some("gz" | "zip"));
    let plain = if is_packed { path.with_extension("") } else { path.to_owned() };
    let mut kinds: Vec<&[&str]> = vec![&["prj"]];
    match ending.as_deref() {
        Some("hdr") => kinds.push(&RAW_ENDINGS),
        Some("shp") => kinds.push(&["shx"]),
        _ if is_packed => {}
        _ => kinds.push(&["hdr"]),
    }
    kinds.into_iter().filter_map(|endings| beside(&plain, endings).or_else(|| beside(path, endings))).collect()
}
