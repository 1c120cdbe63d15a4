//! Two databases of one area, compared load module by load module.

use std::path::Path;
use std::sync::atomic::AtomicBool;

use build::CompileError;
use build::ground::{GamingArea, GroundError};
use build::product::{Opened, Product, ProductError};
use fidelity::each_residual;
use schedule::Workers;
use serde::Serialize;
use terrain::{Decks, Dem, Importance, LoadModule, ModuleGrid, ModuleId, Objects, QUANTA_PER_METRE, TileId};

/// What differs between two databases.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Difference {
    /// Load modules that each has.
    pub modules: usize,
    /// Those that differ, in row order.
    pub changed: Vec<ModuleDifference>,
    /// Settings that differ.
    pub settings: Vec<SettingDifference>,
    /// Triangles of each.
    pub triangles: [u64; 2],
    /// RMS residual of each against its own ground, in metres.
    pub rms_m: [f64; 2],
}

/// A load module before and after.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ModuleDifference {
    /// Which.
    #[serde(serialize_with = "crate::row_col")]
    pub module: ModuleId,
    /// Triangles of each.
    pub triangles: [u32; 2],
    /// Convex polygons of each.
    pub polygons: [u32; 2],
    /// RMS residual of each, in metres.
    pub rms_m: [f64; 2],
    /// Largest residual of each, in metres.
    #[serde(rename = "max_m")]
    pub largest_m: [f64; 2],
    /// Middle lines of ways of each.
    pub lines: [usize; 2],
    /// Buildings, walls and woods of each.
    pub objects: [usize; 2],
    /// What is not alike: `ground`, `decks`, `lines`, `objects`, `level 1` and on, for whatever of a coarser level.
    pub differs: Vec<String>,
    /// How far the two surfaces of the finest level lie apart at most, at posts, in metres; 0 where only triangles,
    /// classes, or what is not ground differ.
    pub apart_m: f64,
}

/// A setting that differs; empty where one has it not.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct SettingDifference {
    /// The key with its section.
    pub key: String,
    /// Both values.
    pub values: [String; 2],
}

/// Compares two finished databases.
///
/// # Errors
/// When one is missing, unfinished or damaged, or they are not of the same ground.
pub fn difference(first: &Path, second: &Path, workers: usize) -> Result<Difference, CompileError> {
    let (first_is, second_is) = (Opened::open(first)?, Opened::open(second)?);
    check_same_ground(&first_is, &second_is, second)?;
    let area = &first_is.area;
    // A tile of the first at a time: both are never held whole.
    let of_tile = |_: usize, tile: &TileId| -> Result<Vec<ModuleDifference>, ProductError> {
        let part = area.tiling.modules(*tile, area.grid);
        let both = [Product::levels_in(&first_is, part)?, Product::levels_in(&second_is, part)?];
        let compared = |at: usize| {
            let [a, b] = both.each_ref().map(|levels| levels.iter().map(|level| &level[at]).collect::<Vec<_>>());
            let differs = differing(&a, &b);
            (!differs.is_empty()).then(|| module_difference(area, (a[0], b[0]), differs))
        };
        Ok((0..part.count()).filter_map(compared).collect())
    };
    let changed = schedule::for_each_independent(&area.tiles, &Workers::new(workers), &AtomicBool::new(false), of_tile)
        .map_err(|error| GroundError::from_schedule(&area.tiles, error))?;
    let mut changed = changed.concat();
    changed.sort_by_key(|of| of.module);
    Ok(Difference {
        modules: area.grid.count(),
        changed,
        settings: settings(&first_is, &second_is),
        triangles: [&first_is, &second_is].map(|opened| opened.manifest.totals.triangles),
        rms_m: [&first_is, &second_is].map(|opened| {
            let totals = opened.manifest.totals;
            rms_m(totals.residual_sum_squared, totals.residual_posts)
        }),
    })
}

/// Whether load modules of both cover the same squares at the same posts; names may differ.
fn check_same_ground(first: &Opened, second: &Opened, path: &Path) -> Result<(), CompileError> {
    let (mut area, other) = (first.manifest.area.clone(), &second.manifest.area);
    area.name.clone_from(&other.name);
    let Some((key, expected, found)) = area.difference(other) else { return Ok(()) };
    Err(GroundError::Impossible {
        key: format!("{}: {key}", path.display()),
        found,
        expected,
        hint: "load modules can be compared where both databases divide the same ground alike".into(),
    }
    .into())
}

/// What is not alike of two load modules, each at its levels.
fn differing(a: &[&LoadModule], b: &[&LoadModule]) -> Vec<String> {
    let (finest, other) = (a[0], b[0]);
    let parts = [
        ("decks", finest.decks != other.decks),
        ("lines", finest.lines != other.lines),
        ("objects", finest.objects != other.objects),
    ];
    let mut all: Vec<String> = parts.iter().filter(|(_, differs)| *differs).map(|(name, _)| (*name).into()).collect();
    let ground = |module: &LoadModule| LoadModule {
        decks: Decks::default(),
        lines: Vec::new(),
        objects: Objects::default(),
        ..module.clone()
    };
    if finest != other && ground(finest) != ground(other) {
        all.insert(0, "ground".into());
    }
    let levels = 1..a.len().max(b.len());
    all.extend(levels.filter(|level| a.get(*level) != b.get(*level)).map(|level| format!("level {level}")));
    all
}

fn module_difference(area: &GamingArea, (a, b): (&LoadModule, &LoadModule), differs: Vec<String>) -> ModuleDifference {
    let rms = |module: &LoadModule| rms_m(module.residual.sum_squared, u64::from(module.residual.posts));
    let largest = |module: &LoadModule| f64::from(module.residual.largest) / f64::from(QUANTA_PER_METRE);
    ModuleDifference {
        module: a.id,
        triangles: [a, b].map(|module| module.counts().triangles),
        polygons: [a, b].map(|module| module.counts().polygons),
        rms_m: [rms(a), rms(b)],
        largest_m: [largest(a), largest(b)],
        lines: [a, b].map(|module| module.lines.len()),
        objects: [a, b].map(|module| module.objects.prisms.len() + module.objects.canopies.len()),
        differs,
        apart_m: f64::from(apart(area, a, b)) / f64::from(QUANTA_PER_METRE),
    }
}

/// How far two surfaces lie apart at most, in quanta: the difference of their residuals against any ground, such as
/// flat one.
fn apart(area: &GamingArea, a: &LoadModule, b: &LoadModule) -> u32 {
    let rect = area.grid.posts_of(a.id);
    let flat = Dem::from_fn(rect, |_| Some(0));
    let mask = Importance::uniform(rect, terrain::THOUSANDTHS);
    // As the last of its row and column, a load module owns the posts of all of its sides.
    let grid = ModuleGrid { rows: a.id.row + 1, cols: a.id.col + 1, ..area.grid };
    let ground = fidelity::Reference { dem: &flat, mask: &mask, grid, spacing: area.frame.spacing };
    let wide = rect.posts_wide();
    let mut heights = vec![0; rect.post_count()];
    let place = |post: terrain::Post| (post.row - rect.south) as usize * wide + (post.col - rect.west) as usize;
    each_residual(a, &ground, |post, residual| heights[place(post)] = residual);
    let mut most = 0;
    each_residual(b, &ground, |post, residual| most = most.max(heights[place(post)].abs_diff(residual)));
    most
}

fn rms_m(squares: u64, posts: u64) -> f64 {
    (squares as f64 / posts.max(1) as f64).sqrt() / f64::from(QUANTA_PER_METRE)
}

/// Settings that differ, in the order of the first, then those that only the second has.
fn settings(first: &Opened, second: &Opened) -> Vec<SettingDifference> {
    let (before, after) = (first.job.describe(), second.job.describe());
    let value = |list: &[job::Setting], key: &str| {
        list.iter().find(|setting| setting.key == key).map_or(String::new(), |setting| setting.value.clone())
    };
    let new = after.iter().filter(|setting| before.iter().all(|known| known.key != setting.key));
    before
        .iter()
        .chain(new)
        .map(|setting| SettingDifference {
            key: setting.key.to_owned(),
            values: [value(&before, setting.key), value(&after, setting.key)],
        })
        .filter(|setting| setting.values[0] != setting.values[1])
        .collect()
}
