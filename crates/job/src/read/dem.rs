//! `[dem]`: where heights come from.

use std::path::Path;

use crate::bounds::{FILL_POSTS_MAX, SOURCES_MAX};
use crate::entry::{Entry, Section};
use crate::files::{Mention, Place, has_wildcard, leaves_after_wildcard};
use crate::{DemSource, DemSpec, JobError, Voids};

/// Formats by the ends of their names that belong to a later version.
const LATER_FORMATS: [&str; 10] = ["dt0", "dt1", "dt2", "hgt", "asc", "flt", "dem", "gz", "zip", "vrt"];

pub(super) fn read(dem: &Section, job: &Path, mentions: &mut Vec<Mention>) -> Result<DemSpec, JobError> {
    if let Some(entry) = dem.optional("height_unit_m") {
        return Err(entry.unsupported("heights in metres, without this key", "convert the heights to metres first"));
    }
    let source = source(dem, job, mentions)?;
    let vertical_datum = vertical_datum(dem)?;
    let voids = voids(dem)?;
    Ok(DemSpec { source, vertical_datum, voids })
}

fn source(dem: &Section, job: &Path, mentions: &mut Vec<Mention>) -> Result<DemSource, JobError> {
    let (files, sample, seed) = (dem.optional("sources"), dem.optional("source"), dem.optional("seed"));
    match (files, sample) {
        (Some(files), None) => match seed {
            Some(seed) => Err(seed.conflict("sources", "no seed, since files are read", "only the sample has a seed")),
            None => sources(&files, job, mentions),
        },
        (None, Some(sample)) => {
            sample.word(&[("sample", ())])?;
            let seed = seed.map_or(Ok(1), |entry| entry.whole(0..=i64::MAX as u64, "a seed"))?;
            Ok(DemSource::Sample { seed })
        }
        (Some(_), Some(sample)) => {
            Err(sample.conflict("sources", "either source = \"sample\" or sources = [files]", "remove one of the two"))
        }
        (None, None) => Err(dem.missing(
            "sources",
            "a list of rasters, or source = \"sample\"",
            "sources = [\"dem/*.tif\"], relative to the job file; source = \"sample\" needs no file",
        )),
    }
}

fn sources(entry: &Entry, job: &Path, mentions: &mut Vec<Mention>) -> Result<DemSource, JobError> {
    let expected = "a list of paths and patterns of rasters";
    let items = entry.list(expected)?;
    if items.is_empty() || SOURCES_MAX < items.len() {
        return Err(entry.out_of_range(format!("1 to {SOURCES_MAX} paths or patterns")));
    }
    let (mut written, mut files) = (Vec::new(), Vec::new());
    for item in &items {
        let file = super::named_file(item, job)?;
        refuse_later_format(item, &file.written)?;
        if has_wildcard(&file.written) && leaves_after_wildcard(&file.written) {
            let mut fault = item.fault("a pattern without .. behind its first wildcard");
            fault.hint = "name the folder first: sources = [\"../other/*.tif\"]".to_owned();
            return Err(JobError::LeavesFolder(fault));
        }
        mentions.push(Mention { place: Place::Source(files.len()), fault: item.fault("a raster file") });
        written.push(file.written.clone());
        files.push(file);
    }
    Ok(DemSource::Files { written, files })
}

fn refuse_later_format(entry: &Entry, written: &str) -> Result<(), JobError> {
    let ending = Path::new(written).extension().map(|end| end.to_string_lossy().to_lowercase());
    match ending {
        Some(end) if LATER_FORMATS.contains(&end.as_str()) => {
            Err(entry.unsupported("a GeoTIFF", "convert it first: gdal_translate IN OUT.tif"))
        }
        _ => Ok(()),
    }
}

fn vertical_datum(dem: &Section) -> Result<Option<String>, JobError> {
    const CHARS_MAX: usize = 64;
    let Some(entry) = dem.optional("vertical_datum") else { return Ok(None) };
    let expected = format!("a name such as \"EGM96\", at most {CHARS_MAX} characters");
    let name = entry.text(&expected)?;
    if name.trim().is_empty() || CHARS_MAX < name.chars().count() || name.chars().any(char::is_control) {
        return Err(entry.out_of_range(expected));
    }
    Ok(Some(name.to_owned()))
}

fn voids(dem: &Section) -> Result<Voids, JobError> {
    let Some(entry) = dem.optional("voids") else { return Ok(Voids::Fail) };
    if !entry.is_table() {
        let what = "\"fail\" or { fill_within_posts = 8 }";
        let word = entry.text(what)?;
        return if word == "fail" { Ok(Voids::Fail) } else { Err(entry.out_of_range(what)) };
    }
    let table = entry.table()?;
    let posts = table.required("fill_within_posts", "a number of posts")?;
    let posts = posts.whole_u32(1..=FILL_POSTS_MAX as u32, "a number of posts")?;
    Ok(Voids::FillWithinPosts(posts))
}
