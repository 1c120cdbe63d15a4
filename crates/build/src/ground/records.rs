//! What a build was made from: the content of every file that a job names, and its state.

use std::path::Path;

use job::{AreaShape, DemSource, FeaturesSpec, Job, NamedFile, Start};
use source_files::{FileState, SourceError};
use store::{Fingerprint, SourceRecord};

use crate::ground::GroundError;

/// What a job's heights and weights are made from: the content of every file it names, hashed and not decoded.
///
/// # Errors
/// When a file cannot be read.
pub fn records(job: &Job) -> Result<Vec<SourceRecord>, GroundError> {
    let sample = match &job.dem.source {
        DemSource::Sample { seed } => Some(record(&format!("sample seed={seed}"), &seed.to_le_bytes())),
        DemSource::Files { .. } => None,
    };
    let files = named_files(job).into_iter().map(|file| {
        // What a file of features is drawn from, its format tells.
        let of_format = || file.is_features.then(|| source_files::feature_attribution(file.path)).flatten();
        let attribution = file.attribution.or_else(of_format).map(str::to_owned);
        Ok(SourceRecord { attribution, ..file_record(file.written, file.path)? })
    });
    sample.into_iter().map(Ok).chain(files).collect()
}

/// What the files of a job are like now, so that one that changes during a build is noticed.
///
/// # Errors
/// When one is not there, or no file.
pub fn states(job: &Job) -> Result<Vec<FileState>, GroundError> {
    named_files(job).into_iter().map(|file| Ok(FileState::of(file.path)?)).collect()
}

/// A file that a job names.
struct Named<'a> {
    written: &'a str,
    path: &'a Path,
    attribution: Option<&'a str>,
    is_features: bool,
}

/// Every file that a job names, in the order of their records.
fn named_files<'a>(job: &'a Job) -> Vec<Named<'a>> {
    let mut all = Vec::new();
    if let DemSource::Files { files, .. } = &job.dem.source {
        all.extend(files.iter().map(|file| Named {
            written: &file.written,
            path: &file.path,
            attribution: file.said.attribution.as_deref(),
            is_features: false,
        }));
    }
    let geoids = job.dem.geoids.iter().map(|geoid| &geoid.file);
    let water = job.dem.water.iter().map(|water| &water.file);
    let start = job.tin.start.iter().filter_map(|start| match start {
        Start::File(file) => Some(file),
        Start::Method { .. } => None,
    });
    let areas = job.importance.areas.iter().filter_map(|area| match &area.shape {
        AreaShape::Polygons { file } | AreaShape::RasterValue { file, .. } => Some(file),
        AreaShape::Slope { .. } | AreaShape::Level { .. } | AreaShape::Sample(_) => None,
    });
    let others = geoids.chain(water).chain(start).chain(&job.tin.pins).chain(areas);
    let named = |file: &'a NamedFile, is_features| Named {
        written: &file.written,
        path: &file.path,
        attribution: None,
        is_features,
    };
    all.extend(others.map(|file| named(file, false)));
    all.extend(job.features.iter().flat_map(FeaturesSpec::files).map(|file| named(file, true)));
    for source in job.objects.iter().flat_map(|objects| &objects.sources) {
        // Hashed with what lies beside it, and once, where features are read from it, too.
        if !all.iter().any(|other| other.is_features && other.path == source.file.path) {
            all.push(named(&source.file, true));
        }
    }
    all
}

/// The record of a file that a build was made from.
fn file_record(written: &str, path: &Path) -> Result<SourceRecord, GroundError> {
    let content = Fingerprint::of_reader(source_files::content(path)?);
    let blake3 = content.map_err(|source| SourceError::Read { path: path.into(), source })?;
    Ok(SourceRecord { path: written.to_owned(), blake3, attribution: None })
}

/// The record of some content.
fn record(path: &str, content: &[u8]) -> SourceRecord {
    SourceRecord { path: path.to_owned(), blake3: Fingerprint::of_bytes(content), attribution: None }
}

#[cfg(test)]
mod tests {
    use super::*;

    const JOB: &str = "[area]\nname = \"a\"\ncrs = \"EPSG:32611\"\norigin_m = [0, 0]\nsize_m = [1000, 1000]\n\
        spacing_m = 25\n[dem]\nsource = \"sample\"\n";

    #[test]
    fn files_of_features_are_hashed_with_those_beside_them_each_once() {
        let folder = tempfile::tempdir().unwrap();
        let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
        ["r.shp", "r.shx", "r.dbf", "r.prj"].into_iter().for_each(|name| write(name, name));
        // A block of OpenStreetMap data begins with the length of its head and the name of its kind.
        write("w.osm.pbf", "\0\0\0\x0d\n\tOSMHeader");
        let sources = "[\"r.shp\", { file = \"w.osm.pbf\" }, { file = \"r.shp\", kind = \"lake\" }, \"sample\"]";
        write("a.toml", &format!("{JOB}[features]\nsources = {sources}\n"));
        let job = || Job::load(&folder.path().join("a.toml")).unwrap();
        let before = records(&job()).unwrap();
        let names: Vec<&str> = before.iter().map(|record| record.path.as_str()).collect();
        assert_eq!(names, ["sample seed=1", "r.shp", "w.osm.pbf"]);
        let osm = before[2].attribution.as_deref();
        assert_eq!(
            (before[1].attribution.as_deref(), osm.map(|text| text.contains("OpenStreetMap"))),
            (None, Some(true))
        );
        let states = states(&job()).unwrap();
        write("r.dbf", "another");
        assert_ne!(records(&job()).unwrap()[1].blake3, before[1].blake3);
        assert!(states.iter().any(|state| state.check().is_err()), "a table that changes is noticed");
    }
}
