//! `[dem]`: where heights come from.

use std::path::Path;

use crate::bounds::{GEOIDS_MAX, SOURCES_MAX};
use crate::entry::{Entry, Section};
use crate::files::{Mention, Place};
use crate::{
    DemSource, DemSpec, GeoidSpec, JobError, NamedFile, SourceEntry, SourceFile, SourceSaid, Voids, usual_text,
};

pub(super) fn read(dem: &Section, job: &Path, mentions: &mut Vec<Mention>) -> Result<DemSpec, JobError> {
    let unit_m = dem.maybe("height_unit_m", Entry::number)?;
    let source = source(dem, job, unit_m, mentions)?;
    if let (Some(entry), DemSource::Sample { .. }) = (dem.optional("height_unit_m"), &source) {
        return Err(entry.conflict("source = \"sample\"", "no unit, since the sample is in metres", "remove it"));
    }
    let vertical_datum = dem.maybe("vertical_datum", |entry| entry.prose(char::is_control))?;
    let (voids, next_source) = voids(dem)?;
    let (resampling, feather_m) = (dem.word("resampling")?, dem.number("feather_m")?);
    let geoids = geoids(dem, job, mentions)?;
    let (water, strict) = (None, false);
    Ok(DemSpec { source, vertical_datum, voids, next_source, resampling, feather_m, geoids, water, strict })
}

/// Grids for converting between vertical datums.
fn geoids(dem: &Section, job: &Path, mentions: &mut Vec<Mention>) -> Result<Vec<GeoidSpec>, JobError> {
    let Some(entry) = dem.optional("geoids") else { return Ok(Vec::new()) };
    let mut geoids = Vec::new();
    for item in entry.items_of(0..=GEOIDS_MAX)? {
        let table = item.table()?;
        let name = table.required("datum")?;
        let datum = name.prose(char::is_control)?.trim().to_owned();
        if datum.eq_ignore_ascii_case("ellipsoid") {
            let hint = "heights above the ellipsoid need no grid; name the datum on the other side";
            return Err(name.out_of_range_with("a datum other than the ellipsoid itself", hint));
        }
        let file = table.required("file")?;
        mentions.push(Mention { place: Place::Geoid(geoids.len()), fault: file.fault("a geoid grid") });
        geoids.push(GeoidSpec { datum, file: file.file(job)? });
    }
    Ok(geoids)
}

fn source(dem: &Section, job: &Path, unit_m: Option<f64>, mentions: &mut Vec<Mention>) -> Result<DemSource, JobError> {
    let (files, sample, seed) = (dem.optional("sources"), dem.optional("source"), dem.optional("seed"));
    match (files, sample) {
        (Some(files), None) => match seed {
            Some(seed) => Err(seed.conflict("sources", "no seed, since files are read", "only the sample has a seed")),
            None => sources(&files, job, unit_m, mentions),
        },
        (None, Some(sample)) => {
            sample.word::<DemSource>()?;
            Ok(DemSource::Sample { seed: dem.whole("seed")? })
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

fn sources(entry: &Entry, job: &Path, unit_m: Option<f64>, mentions: &mut Vec<Mention>) -> Result<DemSource, JobError> {
    let (mut written, mut files) = (Vec::new(), Vec::new());
    for item in &entry.items_of(1..=SOURCES_MAX)? {
        let (file, said) = source_entry(item, job)?;
        mentions.push(Mention::of_list(Place::Source(files.len()), item, &file, "a raster file")?);
        let said = SourceSaid { height_unit_m: said.height_unit_m.or(unit_m), ..said };
        written.push(SourceEntry { name: file.written.clone(), said: said.clone() });
        files.push(SourceFile { written: file.written, path: file.path, said });
    }
    Ok(DemSource::Files { written, files })
}

/// A path, or a table with a path and what is to be known about it.
fn source_entry(item: &Entry, job: &Path) -> Result<(NamedFile, SourceSaid), JobError> {
    if !item.is_table() {
        return Ok((item.file(job)?, SourceSaid::default()));
    }
    let table = item.table()?;
    let file = table.required("file")?.file(job)?;
    let corner = |entry: &Entry| match entry.pair()? {
        pair @ [latitude, longitude] if latitude.abs() <= 90.0 && longitude.abs() <= 180.0 => Ok(pair),
        _ => Err(entry.out_of_range(entry.expected())),
    };
    let said = SourceSaid {
        crs: table.text("crs")?,
        corner: table.maybe("corner", corner)?,
        height_unit_m: table.maybe("height_unit_m", Entry::number)?,
        nodata: table.maybe("nodata", Entry::number)?,
        vertical_datum: table.text("vertical_datum")?,
        attribution: table.text("attribution")?,
    };
    Ok((file, said))
}

/// What becomes of voids, and whether the next source is asked first.
fn voids(dem: &Section) -> Result<(Voids, bool), JobError> {
    let named = |word: &str| match word {
        "fail" => Some((Voids::Fail, false)),
        "next_source" => Some((Voids::Fail, true)),
        "hole" => Some((Voids::Hole, false)),
        _ => None,
    };
    let usual = || named(usual_text("dem.voids").trim_matches('"')).expect("what holds is one of the words");
    let Some(entry) = dem.optional("voids") else { return Ok(usual()) };
    if !entry.is_table() {
        return named(entry.text()?).ok_or_else(|| entry.out_of_range(entry.expected()));
    }
    let table = entry.table()?;
    let (next_source, hole) = (table.flag("next_source")?, table.flag("hole")?);
    // A table that says no to both says `"fail"`; an empty one says nothing.
    let says_more = ["next_source", "hole"].iter().any(|key| table.optional(key).is_some());
    let posts = match (table.optional("fill_within_posts"), says_more) {
        (None, true) => None,
        (None, false) => Some(table.required("fill_within_posts")?),
        (some, _) => some,
    };
    let posts = posts.map(|posts| posts.whole_u32()).transpose()?;
    let voids = match (posts, hole) {
        (None, false) => Voids::Fail,
        (None, true) => Voids::Hole,
        (Some(posts), false) => Voids::FillWithinPosts(posts),
        (Some(posts), true) => Voids::FillThenHole(posts),
    };
    Ok((voids, next_source))
}
