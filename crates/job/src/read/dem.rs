//! `[dem]`: where heights come from.

use std::path::Path;

use crate::bounds::{DATUM_CHARS_MAX, FEATHER_M_MAX, FILL_POSTS_MAX, GEOIDS_MAX, SOURCES_MAX};
use crate::entry::{Entry, Section};
use crate::files::{Mention, Place, has_wildcard, leaves_after_wildcard};
use crate::{
    DemSource, DemSpec, GeoidSpec, JobError, NamedFile, Resampling, SourceEntry, SourceFile, SourceSaid, Voids,
};

pub(super) fn read(dem: &Section, job: &Path, mentions: &mut Vec<Mention>) -> Result<DemSpec, JobError> {
    let unit_m = unit(dem)?;
    let source = source(dem, job, unit_m, mentions)?;
    if let (Some(entry), DemSource::Sample { .. }) = (dem.optional("height_unit_m"), &source) {
        return Err(entry.conflict("source = \"sample\"", "no unit, since the sample is in metres", "remove it"));
    }
    let vertical_datum = vertical_datum(dem)?;
    let (voids, next_source) = voids(dem)?;
    let resampling = match dem.optional("resampling") {
        Some(entry) => entry.word(&[("bilinear", Resampling::Bilinear), ("cubic", Resampling::Cubic)])?,
        None => Resampling::Bilinear,
    };
    let feather_m = dem
        .optional("feather_m")
        .map_or(Ok(0.0), |entry| entry.number_in(0.0..=FEATHER_M_MAX, &format!("metres from 0 to {FEATHER_M_MAX}")))?;
    let geoids = geoids(dem, job, mentions)?;
    let (water, strict) = (None, false);
    Ok(DemSpec { source, vertical_datum, voids, next_source, resampling, feather_m, geoids, water, strict })
}

/// Grids for converting between vertical datums.
fn geoids(dem: &Section, job: &Path, mentions: &mut Vec<Mention>) -> Result<Vec<GeoidSpec>, JobError> {
    let Some(entry) = dem.optional("geoids") else { return Ok(Vec::new()) };
    let items = entry.list("a list of grids, each { datum = …, file = … }")?;
    if GEOIDS_MAX < items.len() {
        return Err(entry.out_of_range(format!("at most {GEOIDS_MAX} grids")));
    }
    let mut geoids = Vec::new();
    for item in items {
        let table = item.table()?;
        let expected = "the name of a vertical datum, as sources have it";
        let name = table.required("datum", expected)?;
        let datum = name.text(expected)?.trim().to_owned();
        if datum.is_empty() || DATUM_CHARS_MAX < datum.chars().count() || datum.chars().any(char::is_control) {
            return Err(name.out_of_range(expected));
        }
        if datum.eq_ignore_ascii_case("ellipsoid") {
            let hint = "heights above the ellipsoid need no grid; name the datum on the other side";
            return Err(name.out_of_range_with("a datum other than the ellipsoid itself", hint));
        }
        let file = table.required("file", "the path of a geoid grid")?;
        mentions.push(Mention { place: Place::Geoid(geoids.len()), fault: file.fault("a geoid grid") });
        geoids.push(GeoidSpec { datum, file: file.file(job)? });
    }
    Ok(geoids)
}

/// Metres in a unit of height.
fn unit(table: &Section) -> Result<Option<f64>, JobError> {
    let Some(entry) = table.optional("height_unit_m") else { return Ok(None) };
    let expected = "metres in a unit of height, from 0.000001 to 1000";
    entry.number_in(1.0e-6..=1.0e3, expected).map(Some)
}

fn source(dem: &Section, job: &Path, unit_m: Option<f64>, mentions: &mut Vec<Mention>) -> Result<DemSource, JobError> {
    let (files, sample, seed) = (dem.optional("sources"), dem.optional("source"), dem.optional("seed"));
    match (files, sample) {
        (Some(files), None) => match seed {
            Some(seed) => Err(seed.conflict("sources", "no seed, since files are read", "only the sample has a seed")),
            None => sources(&files, job, unit_m, mentions),
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

fn sources(entry: &Entry, job: &Path, unit_m: Option<f64>, mentions: &mut Vec<Mention>) -> Result<DemSource, JobError> {
    let expected = "a list of paths and patterns of rasters";
    let items = entry.list(expected)?;
    if items.is_empty() || SOURCES_MAX < items.len() {
        return Err(entry.out_of_range(format!("1 to {SOURCES_MAX} paths or patterns")));
    }
    let (mut written, mut files) = (Vec::new(), Vec::new());
    for item in &items {
        let (file, said) = source_entry(item, job)?;
        if has_wildcard(&file.written) && leaves_after_wildcard(&file.written) {
            let mut fault = item.fault("a pattern without .. behind its first wildcard");
            fault.hint = "name the folder first: sources = [\"../other/*.tif\"]".to_owned();
            return Err(JobError::LeavesFolder(fault));
        }
        mentions.push(Mention { place: Place::Source(files.len()), fault: item.fault("a raster file") });
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
    let file = table.required("file", "the path of a raster")?.file(job)?;
    let text = |key: &str, expected: &str, chars_max: usize| match table.optional(key) {
        None => Ok(None),
        Some(entry) => {
            let text = entry.text(expected)?;
            let good = !text.trim().is_empty() && text.chars().count() <= chars_max && !text.contains('\0');
            if good { Ok(Some(text.to_owned())) } else { Err(entry.out_of_range(expected)) }
        }
    };
    let corner = "latitude and longitude in degrees, latitude first";
    let corner = table.optional("corner").map(|entry| match entry.pair(corner)? {
        pair @ [latitude, longitude] if latitude.abs() <= 90.0 && longitude.abs() <= 180.0 => Ok(pair),
        _ => Err(entry.out_of_range(corner)),
    });
    let nodata = table.optional("nodata").map(|entry| entry.number("the value that marks a void"));
    let said = SourceSaid {
        crs: text("crs", "a coordinate system, as \"EPSG:4326\" or well-known text", 1 << 16)?,
        corner: corner.transpose()?,
        height_unit_m: unit(&table)?,
        nodata: nodata.transpose()?,
        vertical_datum: text("vertical_datum", "a name such as \"EGM96\", at most 64 characters", 64)?,
        attribution: text("attribution", "whom to thank, at most 1000 characters", 1000)?,
    };
    Ok((file, said))
}

fn vertical_datum(dem: &Section) -> Result<Option<String>, JobError> {
    let Some(entry) = dem.optional("vertical_datum") else { return Ok(None) };
    let expected = format!("a name such as \"EGM96\", at most {DATUM_CHARS_MAX} characters");
    let name = entry.text(&expected)?;
    if name.trim().is_empty() || DATUM_CHARS_MAX < name.chars().count() || name.chars().any(char::is_control) {
        return Err(entry.out_of_range(expected));
    }
    Ok(Some(name.to_owned()))
}

/// What becomes of voids, and whether the next source is asked first.
fn voids(dem: &Section) -> Result<(Voids, bool), JobError> {
    let Some(entry) = dem.optional("voids") else { return Ok((Voids::Fail, false)) };
    if !entry.is_table() {
        let what = "\"fail\", \"next_source\", \"hole\" or { fill_within_posts = 8 }";
        return match entry.text(what)? {
            "fail" => Ok((Voids::Fail, false)),
            "next_source" => Ok((Voids::Fail, true)),
            "hole" => Ok((Voids::Hole, false)),
            _ => Err(entry.out_of_range(what)),
        };
    }
    let table = entry.table()?;
    let flag = |key| table.optional(key).map_or(Ok(false), |entry| entry.flag());
    let (next_source, hole) = (flag("next_source")?, flag("hole")?);
    let posts = match (table.optional("fill_within_posts"), next_source || hole) {
        (None, true) => None,
        (None, false) => Some(table.required("fill_within_posts", "a number of posts")?),
        (some, _) => some,
    };
    let posts = posts.map(|posts| posts.whole_u32(1..=FILL_POSTS_MAX as u32, "a number of posts")).transpose()?;
    let voids = match (posts, hole) {
        (None, false) => Voids::Fail,
        (None, true) => Voids::Hole,
        (Some(posts), false) => Voids::FillWithinPosts(posts),
        (Some(posts), true) => Voids::FillThenHole(posts),
    };
    Ok((voids, next_source))
}
