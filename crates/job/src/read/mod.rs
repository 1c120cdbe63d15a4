//! From the text of a job file to a [`Job`]: one function per section.

mod area;
mod dem;
mod features;
mod importance;
mod objects;
mod tin;

use std::path::Path;

use terrain::{MaterialName, ModuleGrid, OBJECT_MATERIALS};
use toml::de::DeTable;

use crate::bounds::{COARSER_LEVELS_MAX, MODULES_PER_TILE_MIN, TILES_MAX, WINDOW_M};
use crate::entry::{Document, Entry, Section, check_sections, in_32_bits};
use crate::files::Mention;
use crate::keys::{nearest, usual_text};
use crate::{
    AreaPlace, DemSource, Fault, FeaturesSpec, FindArea, Job, JobError, LimitsSpec, LodSpec, NoArea, SourceFile,
    TilesSpec, WindowLimit, files, is_remote,
};

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
    let tiles = read_tiles(&sections.tiles, &area.grid)?;
    let limits = read_limits(&sections.limits, &area.grid, modules.side_m)?;
    let given = tin::given_points(&sections.tin, path, &mut mentions)?;
    let tin = tin::read(&sections.tin, &sections.modules, modules.edges, given)?;
    let others = [&sections.dem, &sections.modules, &sections.tin];
    features::refuse_beside(&sections.features, others, modules.edges, tin.method.name())?;
    modules.outer_border = area::outer_border(&sections.modules, modules.edges, tin.method)?;
    let lod = read_lod(&sections.lod, features.as_ref())?;
    let (path, materials) = (path.to_owned(), Vec::new());
    let mut job = Job { path, area, dem, importance, features, objects, tiles, modules, limits, tin, lod, materials };
    job.materials = read_exports(&sections.exports, &job.class_names())?;
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

/// Names of materials; `classes` are the job's.
fn read_exports(exports: &Section, classes: &[String]) -> Result<Vec<MaterialName>, JobError> {
    let Some(entry) = exports.optional("materials") else { return Ok(Vec::new()) };
    let known: Vec<&str> = classes.iter().map(String::as_str).chain(OBJECT_MATERIALS).collect();
    let material = |(of, entry): (String, Entry)| {
        if !known.contains(&of.as_str()) {
            let hint = match nearest(&of, &known) {
                Some(name) => format!("did you mean \"{name}\"?"),
                None => format!("they are {}", known.join(", ")),
            };
            let found = "a material that nothing is of".to_owned();
            let fault = entry.fault("the name of a class, or of a material of objects");
            return Err(JobError::UnknownKey(Box::new(Fault { found, hint, ..*fault })));
        }
        let table = if entry.is_table() { Some(entry.table()?) } else { None };
        let name = match &table {
            Some(table) => table.required("name")?,
            None => entry,
        };
        let code = |key: &str| -> Result<Option<u16>, JobError> {
            let entry = table.as_ref().and_then(|table| table.optional(key));
            entry.map(|entry| entry.whole().map(|code| code as u16)).transpose()
        };
        let (surface_code, feature_id) = (code("surface_code")?, code("feature_id")?);
        Ok(MaterialName { of, name: name.name("formats have room for no other names")?, surface_code, feature_id })
    };
    entry.items()?.into_iter().map(material).collect()
}

fn read_limits(limits: &Section, grid: &ModuleGrid, side_m: f64) -> Result<LimitsSpec, JobError> {
    // Where 4 km is no whole number of load modules the window is the next larger one: what holds there holds in it.
    let side = (WINDOW_M / side_m).ceil() as u32;
    let window = WindowLimit {
        limit: limits.whole_u32("per_4km_square")?,
        rows: side.min(grid.rows),
        cols: side.min(grid.cols),
    };
    Ok(LimitsSpec {
        count: limits.word("count")?,
        per_load_module: limits.whole_u32("per_load_module")?,
        pool: limits.whole("pool")?,
        mean_per_load_module: limits.number("mean_per_load_module")?,
        window,
    })
}

fn read_tiles(tiles: &Section, grid: &ModuleGrid) -> Result<TilesSpec, JobError> {
    let rows = along(tiles, "rows", grid.rows)?;
    let columns = along(tiles, "columns", grid.cols)?;
    if let Some(entry) = tiles.optional("rows").or_else(|| tiles.optional("columns"))
        && TILES_MAX < u64::from(rows) * u64::from(columns)
    {
        return Err(entry.out_of_range(format!("at most {TILES_MAX} tiles, rows times columns")));
    }
    match tiles.optional("borders") {
        Some(entry) if entry.text()? == "line" => {
            Err(entry.unsupported(&entry.expected(), "\"inherit\" is the usual one"))
        }
        _ => Ok(TilesSpec { rows, columns, order: tiles.word("order")?, borders: tiles.word("borders")? }),
    }
}

/// How many tiles there are along one side of the area: as the job says, or the usual number, fewer where they
/// would be too narrow.
fn along(tiles: &Section, key: &str, modules: u32) -> Result<u32, JobError> {
    let most = (modules / MODULES_PER_TILE_MIN).max(1);
    let what = format!("tiles of {modules} load modules, at least two each");
    match tiles.optional(key) {
        Some(entry) => entry.whole_in(&(1..=most.into()), &what).map(in_32_bits).map_err(|error| match error {
            // The usual number may be more than there can be here.
            JobError::OutOfRange(fault) if usual_text(&fault.key).parse().is_ok_and(|usual: u32| most < usual) => {
                JobError::OutOfRange(Box::new(Fault { hint: format!("for example {key} = {most}"), ..*fault }))
            }
            error => error,
        }),
        None => tiles.whole_u32(key).map(|usual| usual.min(most)),
    }
}

fn read_lod(lod: &Section, features: Option<&FeaturesSpec>) -> Result<LodSpec, JobError> {
    let inner_shares = lod.maybe("levels", inner_shares)?.unwrap_or_default();
    let border = match lod.optional("border") {
        Some(entry) if inner_shares.is_empty() => {
            let hint = "it says what coarser levels keep of the sides: add levels, or leave it out";
            return Err(entry.conflict("no levels", "a job without this key", hint));
        }
        _ => lod.word("border")?,
    };
    let leave_out = match lod.optional("levels") {
        Some(entry) => entry.list()?.iter().map(|level| leave_out(level, features)).collect::<Result<_, _>>()?,
        None => Vec::new(),
    };
    Ok(LodSpec { inner_shares, border, leave_out })
}

/// Classes of features that a level leaves out.
fn leave_out(level: &Entry, features: Option<&FeaturesSpec>) -> Result<Vec<String>, JobError> {
    let Some(entry) = level.table()?.optional("leave_out") else { return Ok(Vec::new()) };
    let Some(features) = features else {
        let hint = "remove it, or name files of roads and water in [features]";
        return Err(entry.conflict("no [features]", "a job with roads and water", hint));
    };
    let known = features.classes();
    let mut classes = Vec::new();
    for item in entry.list()? {
        let name = item.text()?;
        if !known.iter().any(|class| class == name) {
            let hint = format!("they are {}", known.join(", "));
            return Err(item.out_of_range_with("a class of features", hint));
        }
        classes.push(name.to_owned());
    }
    Ok(classes)
}

fn inner_shares(levels: &Entry) -> Result<Vec<f64>, JobError> {
    let entries = levels.list()?;
    if COARSER_LEVELS_MAX < entries.len() {
        let hint = "the finest level is always there and is not listed";
        return Err(levels.out_of_range_with(levels.expected(), hint));
    }
    let mut shares: Vec<f64> = Vec::new();
    for entry in entries {
        let share = entry.table()?.required("inner_share")?;
        let number = share.number()?;
        if number <= 0.0 || 1.0 <= number {
            return Err(share.out_of_range(share.expected()));
        }
        if let Some(&finer) = shares.last().filter(|&&finer| finer <= number) {
            let expected = format!("less than {finer}, the share of the level before");
            return Err(share.out_of_range_with(expected, "levels go from fine to coarse"));
        }
        shares.push(number);
    }
    Ok(shares)
}
