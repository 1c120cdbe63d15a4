//! The files that a job names or finds by pattern.
//!
//! A named file may lie anywhere. A pattern finds files below the folder it begins with, and nothing else: a match
//! whose true place is outside (by a link) is refused, and so is a named file that is a link out of its own folder.
//! So what a job reads can be seen from its text.

use std::collections::BTreeSet;
use std::ffi::OsStr;
use std::fs;
use std::path::{Component, MAIN_SEPARATOR, Path, PathBuf};

use crate::bounds::{FEATURE_SOURCES_MAX, SOURCES_MAX, VISITED_MAX};
use crate::entry::Entry;
use crate::{
    AreaShape, DemSource, Fault, FeatureSource, FeaturesSpec, Job, JobError, NamedFile, ObjectSource, ObjectsSpec,
    SourceFile, Start,
};

/// A file that the job mentions: where its name stands in the job, and the fault to tell if it is not there.
pub(crate) struct Mention {
    pub place: Place,
    pub fault: Box<Fault>,
}

impl Mention {
    /// Of a file or a pattern of a list; `expected` is what kind of file it is to be.
    pub fn of_list(place: Place, item: &Entry, file: &NamedFile, expected: &str) -> Result<Self, JobError> {
        if has_wildcard(&file.written) && leaves_after_wildcard(&file.written) {
            let mut fault = item.fault("a pattern without .. behind its first wildcard");
            fault.hint = format!("name the folder first: sources = [\"../other/{}\"]", place.pattern());
            return Err(JobError::LeavesFolder(fault));
        }
        Ok(Self { place, fault: item.fault(expected) })
    }
}

/// Which list of the job names the file, and where in it.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Place {
    Source(usize),
    ImportanceArea(usize),
    Geoid(usize),
    Water,
    Features(usize),
    Objects(usize),
    Start,
    Pins,
}

impl Place {
    /// A pattern for the files of a folder.
    fn pattern(self) -> &'static str {
        if let Place::Features(_) | Place::Objects(_) = self { "*.gpkg" } else { "*.tif" }
    }
}

/// Whether a name is a pattern.
fn has_wildcard(written: &str) -> bool {
    written.contains(['*', '?', '['])
}

/// Whether a pattern goes up a folder behind its first wildcard.
fn leaves_after_wildcard(written: &str) -> bool {
    let (_, rest) = split_pattern(written);
    rest.components().any(|part| part == Component::ParentDir)
}

/// The folder a pattern begins with, and what is to be matched below it.
fn split_pattern(written: &str) -> (PathBuf, PathBuf) {
    let wild = |part: &Component| has_wildcard(&part.as_os_str().to_string_lossy());
    let parts: Vec<Component> = Path::new(written).components().collect();
    let first = parts.iter().position(wild).unwrap_or(parts.len());
    (parts[..first].iter().collect(), parts[first..].iter().collect())
}

/// Checks every mentioned file and expands the patterns among the sources.
pub(crate) fn locate(job: &mut Job, mentions: Vec<Mention>) -> Result<(), JobError> {
    let folder = job.folder().to_owned();
    locate_sources(&mut job.dem.source, &folder, &mentions)?;
    job.features.as_mut().map_or(Ok(()), |features| locate_features(features, &folder, &mentions))?;
    job.objects.as_mut().map_or(Ok(()), |objects| locate_objects(objects, &folder, &mentions))?;
    for (place, written, path) in all_named(job) {
        // Those of lists are checked with their patterns.
        if !matches!(place, Place::Source(_) | Place::Features(_) | Place::Objects(_)) {
            let mention = mentions.iter().find(|mention| mention.place == place).expect("every file is mentioned");
            check_named((written, path), &folder, mention)?;
        }
    }
    Ok(())
}

/// Every file that a job names: where, its name, and its path.
pub(crate) fn all_named(job: &mut Job) -> Vec<(Place, &mut String, &mut PathBuf)> {
    let mut all = Vec::new();
    if let DemSource::Files { files, .. } = &mut job.dem.source {
        let files = files.iter_mut().enumerate();
        all.extend(files.map(|(index, file)| (Place::Source(index), &mut file.written, &mut file.path)));
    }
    let mut files: Vec<(Place, &mut NamedFile)> = Vec::new();
    for (index, geoid) in job.dem.geoids.iter_mut().enumerate() {
        files.push((Place::Geoid(index), &mut geoid.file));
    }
    files.extend(job.dem.water.iter_mut().map(|water| (Place::Water, &mut water.file)));
    for (index, area) in job.importance.areas.iter_mut().enumerate() {
        if let AreaShape::Polygons { file } | AreaShape::RasterValue { file, .. } = &mut area.shape {
            files.push((Place::ImportanceArea(index), file));
        }
    }
    if let Some(Start::File(file)) = &mut job.tin.start {
        files.push((Place::Start, file));
    }
    files.extend(job.tin.pins.iter_mut().map(|file| (Place::Pins, file)));
    for (index, source) in job.features.iter_mut().flat_map(|features| &mut features.sources).enumerate() {
        if let FeatureSource::File { file, .. } = source {
            files.push((Place::Features(index), file));
        }
    }
    for (index, source) in job.objects.iter_mut().flat_map(|objects| &mut objects.sources).enumerate() {
        files.push((Place::Objects(index), &mut source.file));
    }
    all.extend(files.into_iter().map(|(place, file)| (place, &mut file.written, &mut file.path)));
    all
}

/// Checks every file of `dem.sources` and expands its patterns.
pub(crate) fn locate_sources(source: &mut DemSource, folder: &Path, mentions: &[Mention]) -> Result<(), JobError> {
    let DemSource::Files { files, .. } = source else { return Ok(()) };
    let (mut found, mut seen) = (Vec::new(), BTreeSet::new());
    for mention in mentions {
        let Place::Source(index) = mention.place else { continue };
        let more = source_files(&files[index], folder, mention)?;
        // A file that two entries find keeps the higher priority.
        found.extend(more.into_iter().filter(|file| seen.insert(file.path.clone())));
        if SOURCES_MAX < found.len() {
            return Err(too_many(SOURCES_MAX, &mention.fault));
        }
    }
    *files = found;
    Ok(())
}

/// Checks every file of `features.sources` and expands its patterns.
fn locate_features(features: &mut FeaturesSpec, folder: &Path, mentions: &[Mention]) -> Result<(), JobError> {
    let mention = |index| mentions.iter().find(|mention| mention.place == Place::Features(index));
    let expand = |index: usize, source: &FeatureSource| {
        let FeatureSource::File { file, layer, kind, crs } = source else { return Ok(vec![source.clone()]) };
        let files = named_files(file, folder, mention(index).expect("every file is mentioned"))?.into_iter();
        let source = |file| FeatureSource::File { file, layer: layer.clone(), kind: *kind, crs: crs.clone() };
        Ok(files.map(source).collect())
    };
    features.sources = expanded(&features.sources, expand, mention)?;
    Ok(())
}

/// Checks every file of `objects.sources` and expands its patterns. What is taken over from features may be patterns
/// whose files are checked there already.
fn locate_objects(objects: &mut ObjectsSpec, folder: &Path, mentions: &[Mention]) -> Result<(), JobError> {
    let mention = |index| {
        let own = mentions.iter().find(|mention| mention.place == Place::Objects(index));
        own.or_else(|| mentions.iter().find(|mention| matches!(mention.place, Place::Features(_))))
    };
    let expand = |index: usize, source: &ObjectSource| {
        let files = named_files(&source.file, folder, mention(index).expect("every file is mentioned"))?.into_iter();
        Ok(files.map(|file| ObjectSource { file, ..source.clone() }).collect())
    };
    objects.sources = expanded(&objects.sources, expand, mention)?;
    Ok(())
}

/// What `expand` makes of each source. What two of them find, with nothing else said of it, counts once.
fn expanded<'m, T: PartialEq>(
    sources: &[T],
    expand: impl Fn(usize, &T) -> Result<Vec<T>, JobError>,
    mention: impl Fn(usize) -> Option<&'m Mention>,
) -> Result<Vec<T>, JobError> {
    let mut found: Vec<T> = Vec::new();
    for (index, source) in sources.iter().enumerate() {
        for source in expand(index, source)? {
            if !found.contains(&source) {
                found.push(source);
            }
        }
        if let Some(mention) = mention(index).filter(|_| FEATURE_SOURCES_MAX < found.len()) {
            return Err(too_many(FEATURE_SOURCES_MAX, &mention.fault));
        }
    }
    Ok(found)
}

fn too_many(most: usize, fault: &Fault) -> JobError {
    JobError::OutOfRange(Box::new(Fault { expected: format!("at most {most} files"), ..fault.clone() }))
}

/// The files that one entry of `dem.sources` stands for.
fn source_files(source: &SourceFile, folder: &Path, mention: &Mention) -> Result<Vec<SourceFile>, JobError> {
    let named = NamedFile { written: source.written.clone(), path: source.path.clone() };
    let found = named_files(&named, folder, mention)?.into_iter();
    Ok(found.map(|NamedFile { written, path }| SourceFile { written, path, said: source.said.clone() }).collect())
}

/// The files that a name or a pattern stands for.
fn named_files(named: &NamedFile, folder: &Path, mention: &Mention) -> Result<Vec<NamedFile>, JobError> {
    if has_wildcard(&named.written) && !named.path.exists() {
        return matches_of(&named.written, folder, &mention.fault);
    }
    check_named((&named.written, &named.path), folder, mention)?;
    Ok(vec![named.clone()])
}

fn check_named((written, path): (&str, &Path), folder: &Path, mention: &Mention) -> Result<(), JobError> {
    let fault = &mention.fault;
    let no_such = |found: &str, hint: String| {
        let found = format!("{}, {found}", fault.found);
        JobError::NoSuchFile(Box::new(Fault { found, hint, ..(**fault).clone() }))
    };
    let Ok(data) = fs::metadata(path) else {
        return Err(no_such("which cannot be opened", relative_hint(folder)));
    };
    if data.is_dir() {
        return Err(no_such(
            "which is a folder",
            format!("its files are {}/{}", written.trim_end_matches('/'), mention.place.pattern()),
        ));
    }
    if !data.is_file() {
        let hint = "a pipe or a device cannot be read twice: copy what it gives into a file".to_owned();
        return Err(no_such("which is a pipe, a socket or a device", hint));
    }
    if path.is_symlink() {
        let home = path.parent().unwrap_or(Path::new("")).to_owned();
        refuse_outside(path, &home, fault)?;
    }
    Ok(())
}

fn relative_hint(folder: &Path) -> String {
    let shown = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    format!("paths are relative to the folder of the job file, {}", shown.display())
}

/// Refuses a file whose true place is not below `home`.
fn refuse_outside(path: &Path, home: &Path, fault: &Fault) -> Result<(), JobError> {
    let here = if home.as_os_str().is_empty() { Path::new(".") } else { home };
    let (Ok(file), Ok(home)) = (path.canonicalize(), here.canonicalize()) else { return Ok(()) };
    if file.starts_with(&home) {
        return Ok(());
    }
    let found = format!("{}, where {} is a link to {}", fault.found, path.display(), file.display());
    let expected = format!("files below {}", home.display());
    let hint = "name the file that the link leads to; a named file may lie anywhere".to_owned();
    Err(JobError::LeavesFolder(Box::new(Fault { found, expected, hint, ..fault.clone() })))
}

/// The files that a pattern finds, in the order of their paths.
fn matches_of(written: &str, folder: &Path, fault: &Fault) -> Result<Vec<NamedFile>, JobError> {
    let (start, rest) = split_pattern(written);
    let home = folder.join(&start);
    let mut paths = matches_below(&home, &rest, VISITED_MAX, fault)?;
    paths.sort();
    if paths.is_empty() {
        let (found, expected) =
            (format!("{}, which no file matches", fault.found), format!("a pattern that finds {}", fault.expected));
        let hint = relative_hint(folder);
        return Err(JobError::NoSuchFile(Box::new(Fault { found, expected, hint, ..fault.clone() })));
    }
    paths.into_iter().map(|path| matched(path, folder, &home, fault)).collect()
}

/// The files below `home` that match the pattern `rest`. At most `most` files and folders are looked at: no folder of
/// rasters holds so many. Below `**` links to folders are not followed: in `/proc` they lead to the whole machine
/// again.
fn matches_below(home: &Path, rest: &Path, most: usize, fault: &Fault) -> Result<Vec<PathBuf>, JobError> {
    let options =
        glob::MatchOptions { case_sensitive: true, require_literal_separator: true, require_literal_leading_dot: true };
    let pattern = glob::Pattern::new(&rest.to_string_lossy()).map_err(|error| {
        let (expected, hint) = (format!("a pattern ({})", error.msg), "* is any part of a name, ** any folders".into());
        JobError::OutOfRange(Box::new(Fault { expected, hint, ..fault.clone() }))
    })?;
    let parts: Vec<Component> = rest.components().collect();
    let is_deep = parts.iter().any(|part| part.as_os_str() == "**");
    let depth = if is_deep { usize::MAX } else { parts.len() };
    let is_hidden = |name: &OsStr| name.to_string_lossy().starts_with('.');
    // Wildcards pass over names that begin with a dot.
    let names_hidden = parts.iter().any(|part| is_hidden(part.as_os_str()));
    let start = if home.as_os_str().is_empty() { Path::new(".") } else { home };
    let (mut folders, mut found, mut seen) = (vec![(PathBuf::new(), 1)], Vec::new(), 0);
    while let Some((below, level)) = folders.pop() {
        // One folder alone may hold more than all together may.
        for entry in fs::read_dir(start.join(&below)).into_iter().flatten().flatten().take(most + 1 - seen) {
            seen += 1;
            let (name, path) = (below.join(entry.file_name()), home.join(&below).join(entry.file_name()));
            let is_folder = if is_deep { entry.file_type().is_ok_and(|kind| kind.is_dir()) } else { path.is_dir() };
            if is_folder {
                if level < depth && (names_hidden || !is_hidden(&entry.file_name())) {
                    folders.push((name, level + 1));
                }
            } else if pattern.matches_path_with(&name, options) && path.is_file() {
                found.push(path);
            }
        }
        if most < seen {
            let found = format!("{}, below which there are more than {most} files", fault.found);
            let expected = format!("a pattern that looks at {most} files at most");
            let hint = "begin it with the folder that holds the files, such as \"dem/**/*.tif\"".to_owned();
            return Err(JobError::OutOfRange(Box::new(Fault { found, expected, hint, ..fault.clone() })));
        }
    }
    Ok(found)
}

/// A file that a pattern found, named as the job would name it, on any system with `/` between folders.
fn matched(path: PathBuf, folder: &Path, home: &Path, fault: &Fault) -> Result<NamedFile, JobError> {
    refuse_outside(&path, home, fault)?;
    let written = path.strip_prefix(folder).unwrap_or(&path).to_string_lossy().replace(MAIN_SEPARATOR, "/");
    Ok(NamedFile { written, path })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pattern_looks_at_so_many_files_and_no_more() {
        let folder = tempfile::tempdir().unwrap();
        for name in ["a", "b", ".hidden"] {
            fs::create_dir(folder.path().join(name)).unwrap();
            (0..3).for_each(|file| fs::write(folder.path().join(format!("{name}/{file}.tif")), "").unwrap());
        }
        let [key, found, expected, hint] = ["dem.sources[0]", "\"**/*.tif\"", "a file", ""].map(str::to_owned);
        let fault = Fault { path: "job.toml".into(), line: None, key, found, expected, hint };
        let found = |rest: &str, most| matches_below(folder.path(), Path::new(rest), most, &fault).map(|all| all.len());
        // Three folders and three files in each of two of them; what begins with a dot is passed over.
        assert_eq!(found("**/*.tif", 9).unwrap(), 6);
        let error = found("**/*.tif", 8).unwrap_err().to_string();
        assert!(error.contains("below which there are more than 8 files"), "{error}");
        assert!(found("*.tif", 3).unwrap() == 0 && found("*.tif", 2).is_err());
        assert!(found("*/*.tif", 9).unwrap() == 6 && found("*/*.tif", 8).is_err());
        assert_eq!(found("*/.hidden/*.tif", 12).unwrap() + found(".hidden/*.tif", 12).unwrap(), 3);
    }

    #[cfg(unix)]
    #[test]
    fn a_double_star_does_not_go_in_a_circle_of_links() {
        let folder = tempfile::tempdir().unwrap();
        fs::create_dir_all(folder.path().join("a/b")).unwrap();
        fs::write(folder.path().join("a/b/1.tif"), "").unwrap();
        std::os::unix::fs::symlink(folder.path(), folder.path().join("a/b/up")).unwrap();
        std::os::unix::fs::symlink(folder.path(), folder.path().join("a/up")).unwrap();
        let [key, found, expected, hint] = ["dem.sources[0]", "\"**/*.tif\"", "a file", ""].map(str::to_owned);
        let fault = Fault { path: "job.toml".into(), line: None, key, found, expected, hint };
        let found = matches_below(folder.path(), Path::new("**/*.tif"), 100, &fault).unwrap();
        assert_eq!(found, [folder.path().join("a/b/1.tif")]);
    }

    #[test]
    fn a_pattern_begins_with_the_folders_before_its_first_wildcard() {
        assert_eq!(split_pattern("../dem/*/a.tif"), (PathBuf::from("../dem"), PathBuf::from("*/a.tif")));
        assert!(leaves_after_wildcard("dem/*/../../x.tif"));
        assert!(!leaves_after_wildcard("../dem/*.tif"));
    }
}
