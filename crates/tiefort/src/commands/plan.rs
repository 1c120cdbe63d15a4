//! `tiefort plan`: what a build would do, before any work.

use std::path::PathBuf;

use build::ground::{FeatureTable, PlannedTile, SourceSeen};
use build::{FeaturesForeseen, Plan, Played};
use clap::{Args, ValueEnum};
use job::Job;
use serde_json::{Value, json};
use store::ReportFeatureCost;
use views::{Align, Table, fold, grouped};

use crate::arguments::rows_by_columns;
use crate::commands::budgets::{self, Tried};
use crate::engines::{self, Glue, costs_of};
use crate::failure::{Failure, Outcome};
use crate::{files, fit, run, terminal};

const AFTER_HELP: &str = "\
Examples:
  tiefort plan configs/ntc.toml
  tiefort plan configs/ntc.toml --simulate 1,2,16
  tiefort plan configs/ntc.toml --simulate 1,100,10000 --tiles 6x6,1000x1000
  tiefort plan configs/ntc.toml --emit json | jq .forecast
  tiefort plan ntc.toml --emit ninja --out ntc.tdb > build.ninja && ninja
  tiefort plan ntc.toml --emit slurm --out /share/ntc.tdb > ntc.sh && bash ntc.sh
  tiefort plan ntc.toml --emit dask --out /share/ntc.tdb > ntc.py \\
      && python3 ntc.py scheduler:8786
  tiefort plan ntc.toml --emit snakemake --out ntc.tdb > Snakefile \\
      && snakemake --cores 4
  tiefort plan ntc.toml --emit kubernetes --out /share/ntc.tdb > ntc.yaml

A simulation takes what tiles cost from the report of a database that was built
from this job, and forecasts it where there is none. Tiles that touch never run
at once, so at most a quarter of them does: choose 10 to 32 tiles for each
worker.";

/// Arguments of `plan`.
#[derive(Args)]
#[command(after_help = AFTER_HELP)]
pub struct Arguments {
    /// The job file
    #[arg(value_name = "JOB.toml")]
    pub(super) job: PathBuf,
    /// Print it for a program instead of for a person
    #[arg(long, value_name = "FORMAT")]
    emit: Option<Emit>,
    /// Also play the build with so many workers
    #[arg(long, value_name = "N", value_delimiter = ',', value_parser = clap::value_parser!(u32).range(1..=100_000))]
    simulate: Vec<u32>,
    /// Play it in so many tiles; more tiles than load modules make a larger area
    #[arg(long, value_name = "ROWSxCOLUMNS", value_delimiter = ',', requires = "simulate")]
    #[arg(value_parser = rows_by_columns)]
    tiles: Vec<(u32, u32)>,
    /// Folder of the terrain database [default: NAME.tdb here]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Tiles that a task of an engine does, one after the other [default: so many that it takes half a minute]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=65_536))]
    pack: Option<u32>,
    /// Plan even what is forecast not to fit this machine
    #[arg(long)]
    force: bool,
}

/// Workers for which memory is forecast.
const PLANNED_WORKERS: usize = 2;
/// Tiles that are played at most.
const PLAYED_TILES_MAX: u64 = 1 << 20;
/// Tiles that are listed one by one for a person.
const LISTED_TILES_MAX: usize = 1024;

/// For which program.
#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Emit {
    /// Everything as JSON
    Json,
    /// A script that submits everything to Slurm
    Slurm,
    /// A Python program for a Dask cluster
    Dask,
    /// A build file for ninja, on one machine
    Ninja,
    /// A Snakefile
    Snakemake,
    /// An Indexed Job for Kubernetes: workers that share a volume
    Kubernetes,
}

/// Plans.
pub fn run(arguments: &Arguments) -> Result<Outcome, Failure> {
    let job = Job::load_with(&arguments.job, &build::ground::find_area)?;
    let plan = build::plan(&job)?;
    let default = PathBuf::from(format!("{}.tdb", job.area.name));
    let folder = arguments.out.as_ref().unwrap_or(&default);
    let told = build::foresee(&job, folder)?;
    let features = build::foresee_features(&job)?;
    let told = told.iter().chain(features.iter().flat_map(|features| &features.table.notes));
    told.for_each(|note| terminal::tell(&format!("note: {}", terminal::short(note))));
    let played = played(&job, &plan, arguments)?;
    let glue = || Glue::new(&job, &plan, arguments.out.as_deref(), arguments.pack);
    let text = match arguments.emit {
        Some(Emit::Json) => json_text(&job, &plan, (features.as_ref(), &Tried::of_job(&job)), &played),
        Some(Emit::Ninja) => engines::ninja(&glue()?),
        Some(Emit::Slurm) => engines::slurm(&glue()?),
        Some(Emit::Dask) => engines::dask(&glue()?),
        Some(Emit::Snakemake) => engines::snakemake(&glue()?),
        Some(Emit::Kubernetes) => engines::kubernetes(&glue()?)?,
        None => {
            // What budgets keep may take longer than a build does, and all else is known before.
            terminal::print(&fold(&known_text(&job, &plan, features.as_ref()), 2))?;
            fold(&tried_text(&job, &plan, &Tried::of_job(&job), &played), 2)
        }
    };
    terminal::print(&text)?;
    if !arguments.force {
        fit::check(&job, &plan.forecast, PLANNED_WORKERS, folder)?;
    }
    Ok(Outcome::Sound)
}

/// The build played with every number of workers, in every number of tiles.
fn played(job: &Job, plan: &Plan, arguments: &Arguments) -> Result<Vec<Played>, Failure> {
    if let Some((rows, columns)) =
        arguments.tiles.iter().find(|(r, c)| PLAYED_TILES_MAX < u64::from(*r) * u64::from(*c))
    {
        let message = format!("--tiles: found {rows}x{columns}, expected at most {PLAYED_TILES_MAX} tiles");
        return Err(Failure::new(message, "the largest that is played is 1024x1024"));
    }
    let default = PathBuf::from(format!("{}.tdb", job.area.name));
    let costs = costs_of(job, plan, arguments.out.as_ref().unwrap_or(&default));
    let own = (job.tiles.rows, job.tiles.columns);
    let tiles = if arguments.tiles.is_empty() { &[own][..] } else { &arguments.tiles };
    let workers: Vec<usize> = arguments.simulate.iter().map(|&workers| workers as usize).collect();
    if workers.is_empty() {
        return Ok(Vec::new());
    }
    let modules = job.area.grid.count() as u64;
    Ok(tiles.iter().flat_map(|&tiles| build::play(&costs, tiles, modules, job.tiles.order, &workers)).collect())
}

fn known_text(job: &Job, plan: &Plan, features: Option<&FeaturesForeseen>) -> String {
    let mut text = format!("Settings of {}\n{}\n", job.path.display(), run::settings_text(job));
    text += &forecast_table(job, plan).text(0);
    text += &format!("\n{}", corner_table(job).text(0));
    if let Some(features) = features {
        text += &format!("\n{}", tables_text(features, job));
    }
    text
}

fn tried_text(job: &Job, plan: &Plan, tried: &Tried, played: &[Played]) -> String {
    let mut text = budgets::table_text(&tried.features);
    text += &budgets::objects_text(job, &tried.objects);
    if !played.is_empty() {
        text += &format!("\n{}", played_table(played).text(0));
    }
    if plan.tiles.len() <= LISTED_TILES_MAX {
        text += &format!("\n{}", tile_table(plan).text(0));
    }
    text
}

fn played_table(played: &[Played]) -> Table {
    let mut table = Table::new(&[Align::Right; 8]);
    table.row(["tiles", "area", "workers", "time", "busy", "longest chain", "at once", "memory"]);
    for run in played {
        let (rows, columns) = run.tiles;
        table.row([
            format!("{rows} x {columns}"),
            format!("{} x", grouped(run.area_times.round() as u64)),
            grouped(run.workers as u64),
            format!("{:.1} s", run.seconds),
            format!("{:.1} %", 100.0 * run.busy),
            format!("{:.1} s", run.longest_chain_s),
            grouped(run.at_once as u64),
            files::bytes_text(run.coordinator_bytes),
        ]);
    }
    table
}

fn forecast_table(job: &Job, plan: &Plan) -> Table {
    let (forecast, grid) = (&plan.forecast, &job.area.grid);
    let mut table = Table::new(&[Align::Left, Align::Right, Align::Left]);
    table.row(["Tiles", &grouped(plan.tiles.len() as u64), &format!("at most {} at once", plan.workers_useful)]);
    let modules = format!("{} rows, {} columns", grid.rows, grid.cols);
    table.row(["Load modules", &grouped(grid.count() as u64), &modules]);
    table.row(["Triangles", &grouped(plan.budget), &format!("at most, {} before any point", grouped(plan.start))]);
    table.row(["Memory", &files::bytes_text(forecast.memory_bytes), "about, at its peak with two workers"]);
    table.row(["Disk", &files::bytes_text(forecast.disk_bytes), "about"]);
    let shared = match plan.workers_useful {
        1 => String::new(),
        _ => format!(", {:.1} s on two", forecast.seconds / 2.0),
    };
    table.row(["Time", &format!("{:.1} s", forecast.seconds), &format!("about, on one core{shared}")]);
    if let Some(metres) = job.tin.target_rms_m.or(job.tin.max_residual_m) {
        let words =
            "asked for may end it long before: all of this is the most; tiefort init --rms measures what it takes";
        table.row(["Residual", &format!("{metres} m"), words]);
    }
    table
}

fn corner_table(job: &Job) -> Table {
    let mut table = Table::new(&[Align::Left, Align::Right, Align::Right, Align::Right, Align::Right]);
    let system = format!("EPSG:{}", job.area.epsg);
    table.row(["Corners", &format!("{system} east"), "north", "WGS 84 latitude", "longitude"]);
    for corner in build::ground::corners(job) {
        let [east_m, north_m] = corner.place_m.map(|metres| format!("{metres:.2}"));
        let degrees = corner.lon_lat.map(|[longitude, latitude]| [latitude, longitude]);
        let [latitude, longitude] = match degrees {
            Some(degrees) => degrees.map(|degrees| format!("{degrees:.7}")),
            None => ["unknown".to_owned(), "unknown".to_owned()],
        };
        table.row([corner.name.to_owned(), east_m, north_m, latitude, longitude]);
    }
    table
}

fn tile_table(plan: &Plan) -> Table {
    let mut table = Table::new(&[Align::Right, Align::Left, Align::Right, Align::Left, Align::Left, Align::Left]);
    table.row(["rank", "tile", "colour", "modules (rows x columns)", "posts", "takes borders over from"]);
    for tile in by_rank(plan) {
        let from: Vec<String> = tile.inherits_from.iter().map(|id| format!("{},{}", id.row, id.col)).collect();
        table.row([
            tile.rank.to_string(),
            format!("{},{}", tile.tile.row, tile.tile.col),
            tile.color.to_string(),
            format!("{} x {}", tile.modules.rows(), tile.modules.cols()),
            format!("{} x {}", tile.rect.posts_high(), tile.rect.posts_wide()),
            from.join("  "),
        ]);
    }
    table
}

fn by_rank(plan: &Plan) -> Vec<&PlannedTile> {
    let mut tiles: Vec<&PlannedTile> = plan.tiles.iter().collect();
    tiles.sort_by_key(|tile| tile.rank);
    tiles
}

/// For a program.
pub fn json_text(
    job: &Job,
    plan: &Plan,
    (features, tried): (Option<&FeaturesForeseen>, &Tried),
    played: &[Played],
) -> String {
    let simulation: Vec<Value> = played
        .iter()
        .map(|run| {
            json!({ "tiles": [run.tiles.0, run.tiles.1], "workers": run.workers, "seconds": run.seconds,
                    "busy": run.busy, "longest_chain_s": run.longest_chain_s, "at_once": run.at_once,
                    "coordinator_bytes": run.coordinator_bytes, "area_times": run.area_times })
        })
        .collect();
    let tiles: Vec<Value> = by_rank(plan).into_iter().map(tile_json).collect();
    let forecast = &plan.forecast;
    let corners: Vec<Value> = build::ground::corners(job)
        .iter()
        .map(|corner| json!({ "name": corner.name, "place_m": corner.place_m, "lon_lat": corner.lon_lat }))
        .collect();
    let value = json!({
        "area": job.area.name,
        "budget_triangles": plan.budget,
        "start_triangles": plan.start,
        "workers_useful": plan.workers_useful,
        "corners": corners,
        "forecast": { "memory_bytes": forecast.memory_bytes, "shared_bytes": forecast.shared_bytes,
                      "worker_bytes": forecast.worker_bytes, "seconds": forecast.seconds,
                      "disk_bytes": forecast.disk_bytes },
        "features": features.map(tables_json),
        "budgets": budgets::table_json(&tried.features),
        "objects": budgets::objects_json(&tried.objects),
        "simulation": simulation,
        "tiles": tiles,
    });
    format!("{value:#}\n")
}

fn tile_json(tile: &PlannedTile) -> Value {
    let (posts, modules) = (&tile.rect, &tile.modules);
    let from: Vec<[u32; 2]> = tile.inherits_from.iter().map(|id| [id.row, id.col]).collect();
    json!({
        "tile": [tile.tile.row, tile.tile.col],
        "rank": tile.rank,
        "color": tile.color,
        "first_post": [posts.south, posts.west],
        "posts": [posts.posts_high(), posts.posts_wide()],
        "first_module": [modules.south, modules.west],
        "modules": [modules.rows(), modules.cols()],
        "inherits_from": from,
        "after": tile.after.iter().map(|id| [id.row, id.col]).collect::<Vec<_>>(),
    })
}

/// What goes before the widths of the table.
const WIDTHS: &str = "Tags of width and lanes go before these widths, but not before those of rules.";

/// What the forecast stands on.
const FORECAST: &str = "Counted on level ground, before heights are known and anything is degraded: slopes bring \
                        strips and more stations, and what costs more than its share is made coarser or left out.";

/// All tables.
fn tables_text(features: &FeaturesForeseen, job: &Job) -> String {
    let buildings = features.buildings.map_or_else(String::new, |count| format!("\n{}", buildings_text(count)));
    format!("{}\n{}{buildings}", kinds_text(&features.table), forecast_text(features, job))
}

fn buildings_text(count: usize) -> String {
    format!(
        "Buildings: {}, kept beside the ground to be drawn; they cost no triangle. features.buildings = false \
         leaves them out.\n",
        grouped(count as u64)
    )
}

fn forecast_text(features: &FeaturesForeseen, job: &Job) -> String {
    let FeaturesForeseen { cost, crowded, over_share, within_share, .. } = features;
    if crowded.is_empty() {
        return "Forecast of features: none of them costs a triangle.\n".to_owned();
    }
    let mut table = Table::new(&[Align::Left, Align::Right, Align::Right, Align::Right]);
    let window = job.limits.window;
    let square = format!("{} x {} of them", window.rows, window.cols);
    table.row(["Forecast of features", "triangles", "a load module", &square]);
    let classes = cost.classes.iter().map(|class| (class.name.as_str(), &class.cost)).chain([("all", &cost.all)]);
    for (name, cost) in classes {
        let most = |count: u64, share: f64| format!("{} ({:.0} %)", grouped(count), 100.0 * share);
        let [module, window] = [most(cost.module_max, cost.module_share), most(cost.window_max, cost.window_share)];
        table.row([name.to_owned(), grouped(cost.triangles), module, window]);
    }
    let crowded: Vec<String> = crowded
        .iter()
        .map(|(id, triangles)| format!("{},{} ({})", id.row, id.col, grouped(u64::from(*triangles))))
        .collect();
    let share = job.features.as_ref().map_or(1.0, |spec| spec.share_max);
    let over = match over_share {
        0 => format!("None asks for more than share_max = {share} of its limit"),
        1 => format!(
            "1 asks for more than share_max = {share} of its limit; at most {} triangles are left",
            grouped(*within_share)
        ),
        count => format!(
            "{} ask for more than share_max = {share} of their limit; at most {} triangles are left",
            grouped(*count as u64),
            grouped(*within_share)
        ),
    };
    format!("{}The most crowded load modules: {}. {over}.\n{FORECAST}\n", table.text(0), crowded.join(", "))
}

fn kinds_text(features: &FeatureTable) -> String {
    let mut sources = Table::new(&[Align::Left, Align::Right, Align::Right, Align::Right, Align::Right]);
    sources.row(["Features of", "found", "outside", "of no kind", "remarks"]);
    for SourceSeen { read, without_kind } in &features.sources {
        let counts = [read.found, read.outside, *without_kind, read.remarks as u64].map(grouped);
        sources.row([read.name.clone()].into_iter().chain(counts));
    }
    let left = [Align::Left, Align::Left, Align::Right, Align::Left, Align::Left, Align::Left, Align::Left];
    let mut rows = Table::new(&left);
    rows.row(["Kind", "class", "features", "width", "grade", "form", "from"]);
    for row in &features.rows {
        let count = grouped(row.count as u64);
        rows.row([&row.kind, &row.class, &count, &row.width, &row.grade, &row.form, &row.from].map(String::as_str));
    }
    format!("{}\n{}{WIDTHS}\n", sources.text(0), rows.text(0))
}

/// The same for a program.
fn tables_json(foreseen: &FeaturesForeseen) -> Value {
    let FeaturesForeseen { table: features, cost, crowded, over_share, within_share, buildings } = foreseen;
    let sources: Vec<Value> = features
        .sources
        .iter()
        .map(|SourceSeen { read, without_kind }| {
            json!({ "name": read.name, "found": read.found, "outside": read.outside,
                    "without_kind": without_kind, "remarks": read.remarks })
        })
        .collect();
    let rows: Vec<Value> = features
        .rows
        .iter()
        .map(|row| {
            json!({ "kind": row.kind, "class": row.class, "features": row.count, "width": row.width,
                    "grade": row.grade, "form": row.form, "from": row.from })
        })
        .collect();
    let cost_json = |name: &str, cost: &ReportFeatureCost| {
        let ReportFeatureCost { triangles, module_max, module_share, window_max, window_share } = *cost;
        json!({ "class": name, "triangles": triangles, "module_max": module_max, "module_share": module_share,
                "window_max": window_max, "window_share": window_share })
    };
    let classes: Vec<Value> = cost.classes.iter().map(|class| cost_json(&class.name, &class.cost)).collect();
    let crowded: Vec<Value> =
        crowded.iter().map(|(id, triangles)| json!({ "module": [id.row, id.col], "triangles": triangles })).collect();
    let forecast = json!({ "classes": classes, "all": cost_json("all", &cost.all), "crowded": crowded,
                           "modules_over_share": over_share, "triangles_within_share": within_share });
    json!({ "sources": sources, "rows": rows, "notes": features.notes, "forecast": forecast,
            "buildings": buildings })
}
