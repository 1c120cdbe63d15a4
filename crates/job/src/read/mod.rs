//! From the text of a job file to a [`Job`]: one function per section.

mod area;
mod dem;
mod exports;
mod features;
mod given;
mod importance;
mod limits;
mod lod;
mod objects;
mod tiles;
mod tin;

use std::path::Path;

use toml::de::DeTable;

use crate::entry::{Document, Section, check_sections};
use crate::files::Mention;
use crate::{AreaPlace, DemSource, FindArea, Job, JobError, NoArea, SourceFile, files, is_remote};

/// The sections of a job file, their keys known.
struct Sections<'a> {
    area: Section<'a>,
    dem: Section<'a>,
    importance: Section<'a>,
    features: Section<'a>,
    objects: Section<'a>,
    tiles: Section<'a>,
    modules: Section<'a>,
    limits: Section<'a>,
    tin: Section<'a>,
    lod: Section<'a>,
    exports: Section<'a>,
}

/// Reads a job and lists the files it mentions; does not look at the disk.
///
/// Unknown keys are told before anything else: a key with a typo is the likely reason for one that is missing.
pub(crate) fn read<'a>(
    text: &'a str,
    path: &'a Path,
    find: Option<&FindArea>,
) -> Result<(Job, Vec<Mention>), JobError> {
    let document = Document { path, text };
    let root = DeTable::parse(text).map_err(|error| syntax(document, &error))?;
    let root = root.get_ref();
    check_sections(document, root)?;
    let section = |name| Section::of(document, root, name);
    let sections = Sections {
        area: section("area")?,
        dem: section("dem")?,
        importance: section("importance")?,
        features: section("features")?,
        objects: section("objects")?,
        tiles: section("tiles")?,
        modules: section("load_modules")?,
        limits: section("limits")?,
        tin: section("tin")?,
        lod: section("lod")?,
        exports: section("exports")?,
    };
    job_of(&sections, path, find)
}

fn job_of(sections: &Sections, path: &Path, find: Option<&FindArea>) -> Result<(Job, Vec<Mention>), JobError> {
    let mut mentions = Vec::new();
    let (area, mut modules) = area::read(&sections.area, &sections.modules, &mut |request, entry| {
        let alone = || NoArea {
            found: "an area that only a job file on the disk can have".into(),
            expected: "origin_m and size_m".into(),
            hint: "give numbers, or a job file".into(),
        };
        let find = find.ok_or_else(|| entry.no_area(alone()))?;
        let files = match request.place {
            AreaPlace::CoverDem => files_of(&sections.dem, path)?,
            AreaPlace::Around { .. } => Vec::new(),
        };
        find(request, &files).map_err(|none| entry.no_area(none))
    })?;
    let mut dem = dem::read(&sections.dem, path, &mut mentions)?;
    let mut importance = importance::read(&sections.importance, &dem.source, path, &mut mentions)?;
    dem.water = importance::water(&sections.dem, &mut importance, path, &mut mentions)?;
    let features = features::read(&sections.features, &dem.source, &importance, path, &mut mentions)?;
    let objects = objects::read(&sections.objects, features.as_ref(), path, &mut mentions)?;
    objects::refuse_beside(&sections.objects, &sections.modules, modules.edges, modules.format)?;
    let tiles = tiles::read(&sections.tiles, &area.grid)?;
    let limits = limits::read(&sections.limits, &area.grid, modules.side_m)?;
    let given = given::read(&sections.tin, path, &mut mentions)?;
    let tin = tin::read(&sections.tin, &sections.modules, modules.edges, given)?;
    let others = [&sections.dem, &sections.modules, &sections.tin];
    features::refuse_beside(&sections.features, others, modules.edges, tin.method.name())?;
    modules.outer_border = area::outer_border(&sections.modules, modules.edges, tin.method)?;
    let lod = lod::read(&sections.lod, features.as_ref())?;
    let (path, materials) = (path.to_owned(), Vec::new());
    let mut job = Job { path, area, dem, importance, features, objects, tiles, modules, limits, tin, lod, materials };
    job.materials = exports::read(&sections.exports, &job.class_names())?;
    Ok((job, mentions))
}

/// The files of `dem.sources`, patterns expanded.
fn files_of(dem: &Section, path: &Path) -> Result<Vec<SourceFile>, JobError> {
    let mut mentions = Vec::new();
    let mut spec = dem::read(dem, path, &mut mentions)?;
    if let DemSource::Files { files, .. } = &spec.source
        && files.iter().any(|file| is_remote(&file.written))
    {
        let hint = "rasters of other machines are fetched for an area: give around, or origin_m and size_m";
        return Err(dem.required("sources")?.conflict("area.cover", "files of this machine", hint));
    }
    files::locate_sources(&mut spec.source, path.parent().unwrap_or(Path::new("")), &mentions)?;
    match spec.source {
        DemSource::Files { files, .. } => Ok(files),
        DemSource::Sample { .. } => Ok(Vec::new()),
    }
}

fn syntax(document: Document, error: &toml::de::Error) -> JobError {
    let at = error.span().map_or(0, |span| span.start.min(document.text.len()));
    let before = document.text.get(..at).unwrap_or("");
    let column = 1 + before.chars().rev().take_while(|c| *c != '\n').count();
    let message = error.message().lines().next().unwrap_or("unreadable").to_owned();
    JobError::Syntax { path: document.path.to_owned(), line: 1 + before.matches('\n').count(), column, message }
}
