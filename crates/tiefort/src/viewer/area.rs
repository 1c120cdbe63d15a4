//! A database opened for the viewer: its load modules, and what the page is told about it first.

use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use axum::body::Bytes;
use build::product::{Product, ProductGround, Wanted, WantedGround, water};
use job::{Choice, Job};
use load_module_reader::Area;
use serde_json::json;
use terrain::{HOLE_CLASS, ModuleGrid, ModuleRect, named_class_color};
use views::{RESIDUAL_SCALE_M, palette};

use super::buildings::Buildings;
use super::lines::Lines;
use super::overview::Overview;
use crate::contents::{Opened, damaged};
use crate::failure::Failure;

/// The version of the format from which on load modules have lines.
const VERSION_WITH_LINES: u32 = 3;
/// How far the observer sees load modules.
const VISIBLE_RANGE_M: f64 = 3500.0;

/// A database that is looked at.
pub struct Viewed {
    /// Its folder.
    pub folder: PathBuf,
    /// Its load modules.
    pub area: Area,
    /// All load modules of the area.
    pub grid: ModuleGrid,
    /// What the page is told, as JSON.
    pub description: String,
    /// What the page draws far away and on its map.
    pub overview: Bytes,
    /// Roads and streams that have no triangles of their own; `None` where load modules have lines.
    pub lines: Option<Lines>,
    /// Classes of ground that is a river or a lake.
    pub waters: Vec<u8>,
    /// Roads and streams that are seen before load modules come.
    pub far_lines: Bytes,
    /// Buildings that are drawn only; none where load modules have objects.
    pub buildings: Buildings,
    /// The ground, once it was asked for, or why there is none.
    pub ground: OnceLock<Result<ProductGround, String>>,
}

impl Viewed {
    /// Reads every load module once, for figures and coarse heights.
    ///
    /// # Errors
    /// When the database is unfinished, damaged or missing.
    pub fn open(folder: &Path) -> Result<Self, Failure> {
        let first = ModuleRect { south: 0, west: 0, north: 1, east: 1 };
        let product = Product::read(folder, &Wanted { part: Some(first), ground: WantedGround::None, workers: 1 })?;
        let Opened { contents, area } = Opened::open(folder)?;
        contents.files_of(area.whole())?;
        let waters = waters(&product.job);
        let mut overview = Overview::read(&area).map_err(|error| damaged(&error))?;
        let level = product.features.as_ref().map(|(level, _)| level);
        let in_modules = level.is_some() && VERSION_WITH_LINES <= product.job.modules.format;
        let lines = (!in_modules).then(|| level.map(|level| Lines::of(level, area.frame())).unwrap_or_default());
        overview.lines.add(lines.iter().flat_map(Lines::edges));
        let far_lines: Bytes = std::mem::take(&mut overview.lines).bytes().into();
        let has_objects = !overview.objects().is_empty();
        let buildings =
            if has_objects { Buildings::default() } else { Buildings::read(&store::Folder::new(folder), &area) };
        Ok(Self {
            folder: folder.to_path_buf(),
            grid: product.grid,
            description: description(&product, &area, &overview, !far_lines.is_empty(), buildings.count()),
            overview: overview.bytes().into(),
            lines,
            waters,
            far_lines,
            buildings,
            ground: OnceLock::new(),
            area,
        })
    }
}

/// Classes of ground that is a river or a lake: those named so, and that of water.
fn waters(job: &Job) -> Vec<u8> {
    let is_named = |name: &String| ["lake", "river"].contains(&name.as_str());
    let named = (0..).zip(job.class_names()).filter(|(_, name)| is_named(name)).map(|(number, _)| number);
    named.chain(water(job)).collect()
}

fn description(product: &Product, area: &Area, overview: &Overview, has_lines: bool, buildings: usize) -> String {
    let (frame, manifest) = (area.frame(), &product.manifest);
    let (limits, totals) = (&product.job.limits, &manifest.totals);
    let window = limits.window;
    json!({
        "name": manifest.area.name,
        "crs": frame.crs,
        "vertical_datum": frame.vertical_datum,
        "rows": frame.rows,
        "cols": frame.cols,
        "levels": match product.job.lod.border {
            job::LodBorder::Full => frame.level_count,
            // Neighbours at two levels would not fit together.
            job::LodBorder::Own => 1,
        },
        "side_m": frame.side_m(),
        "side_cells": product.grid.side_cells,
        "spacing_m": manifest.area.spacing_m,
        "origin_m": frame.origin_m,
        "range_m": VISIBLE_RANGE_M,
        "coarse_steps": overview.steps,
        "has_lines": has_lines,
        "buildings": buildings,
        "objects": overview.objects(),
        "is_desert": matches!(product.job.dem.source, job::DemSource::Sample { .. }),
        "height_m": overview.range_m,
        "residual_scale_m": RESIDUAL_SCALE_M,
        "palette": palette(),
        "water": water(&product.job),
        "hole": HOLE_CLASS,
        "triangles": totals.triangles,
        "polygons": totals.polygons,
        "classes": product.job.class_names(),
        "class_colors": class_colors(&product.job.class_names()),
        "limits": {
            "count": limits.count.name(),
            "per_load_module": limits.per_load_module,
            "mean_per_load_module": limits.mean_per_load_module,
            "window": { "rows": window.rows, "cols": window.cols, "limit": window.limit },
        },
    })
    .to_string()
}

/// The colours of classes whose names say them, as `#547a4e`; nothing for the others.
fn class_colors(names: &[String]) -> Vec<Option<String>> {
    let hex = |[red, green, blue]: [u8; 3]| format!("#{red:02x}{green:02x}{blue:02x}");
    names.iter().map(|name| named_class_color(name).map(hex)).collect()
}
