//! The files that a first look is of: those named, and those in the folders named.

use std::path::{Path, PathBuf};

use crate::failure::Failure;
use crate::terminal;

/// Endings of rasters, those of the usual formats first.
const ENDINGS: [&str; 12] = ["tif", "tiff", "dt0", "dt1", "dt2", "hgt", "asc", "flt", "bil", "img", "zip", "gz"];
/// Endings of files of lines and polygons.
const OF_FEATURES: [&str; 7] = ["pbf", "gpkg", "shp", "geojson", "json", "parquet", "geoparquet"];

/// The files named, and the rasters and files of features in the folders named, by name: those directly in one, or
/// where there are none those in its folders, as trees of DTED have a folder for each degree.
pub fn named_files(named: &[PathBuf]) -> Result<Vec<PathBuf>, Failure> {
    let mut all = Vec::new();
    for path in named {
        if !path.is_dir() {
            all.push(path.clone());
            continue;
        }
        let (mut inside, folders) = in_folder(path)?;
        let mut deeper = Vec::new();
        for folder in folders.iter().filter(|folder| !folder.join("database.json").exists()) {
            deeper.push(in_folder(folder).map(|(files, _)| files).unwrap_or_default());
        }
        deeper.retain(|files| !files.is_empty());
        if inside.is_empty() {
            inside = deeper.concat();
        } else if !deeper.is_empty() {
            let (count, path) = (deeper.len(), path.display());
            let folders = if count == 1 { "a folder".to_owned() } else { format!("{count} folders") };
            terminal::tell(&format!("note: files in {folders} in {path} are not taken; name them to have them, too"));
        }
        if inside.is_empty() {
            let message = format!("{}: found a folder without rasters, expected some in it", path.display());
            return Err(Failure::new(message, format!("names of rasters end in .{}", ENDINGS[..9].join(", ."))));
        }
        all.append(&mut inside);
    }
    Ok(all)
}

/// The rasters and files of features directly in a folder, and its folders, each by name.
fn in_folder(path: &Path) -> Result<(Vec<PathBuf>, Vec<PathBuf>), Failure> {
    let entries = std::fs::read_dir(path)
        .map_err(|error| Failure::new(format!("{}: {error}", path.display()), "check the path and its permissions"))?;
    let mut inside: Vec<PathBuf> = entries.flatten().map(|entry| entry.path()).collect();
    inside.sort();
    let (folders, mut files): (Vec<PathBuf>, Vec<PathBuf>) = inside.into_iter().partition(|path| path.is_dir());
    files.retain(|path| {
        let ending = crate::files::extension(path);
        let is_of = |endings: &[&str]| endings.contains(&ending.as_str());
        path.is_file() && (is_of(&ENDINGS) || is_of(&OF_FEATURES) && build::workbench::is_feature_file(path))
    });
    Ok((files, folders))
}
