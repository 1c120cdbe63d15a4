//! `tiefort plan`: what a build would do, before any work.

use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use compiler::{Plan, PlannedTile};
use job::Job;
use serde_json::{Value, json};
use views::{Align, Table, grouped};

use crate::failure::{Failure, Outcome};
use crate::{files, fit, run, terminal};

const AFTER_HELP: &str = "\
Examples:
  tiefort plan configs/ntc.toml
  tiefort plan configs/ntc.toml --simulate 16
  tiefort plan configs/ntc.toml --emit json | jq .forecast";

/// Arguments of `plan`.
#[derive(Args)]
#[command(after_help = AFTER_HELP)]
pub struct Arguments {
    /// The job file
    #[arg(value_name = "JOB.toml")]
    job: PathBuf,
    /// Print it for a program instead of for a person
    #[arg(long, value_name = "FORMAT")]
    emit: Option<Emit>,
    /// Also play the build with so many workers
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=100_000))]
    simulate: Option<u32>,
    /// Plan even what is forecast not to fit this machine
    #[arg(long)]
    force: bool,
}

/// For which program.
#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Emit {
    /// Everything as JSON
    Json,
    /// A batch script for Slurm (not supported yet)
    Slurm,
    /// A script for Dask (not supported yet)
    Dask,
    /// A build file for ninja (not supported yet)
    Ninja,
}

/// Plans.
pub fn run(arguments: &Arguments) -> Result<Outcome, Failure> {
    if let Some(emit @ (Emit::Slurm | Emit::Dask | Emit::Ninja)) = arguments.emit {
        let name = emit.to_possible_value().expect("every format has a name");
        let what = format!("--emit {}", name.get_name());
        return Err(Failure::not_yet(&what, "use --emit json, or build on one machine: `tiefort build`"));
    }
    let job = Job::load_with(&arguments.job, &compiler::find_area)?;
    let plan = compiler::plan(&job)?;
    let text = match arguments.emit {
        Some(_) => json_text(&job, &plan, arguments.simulate),
        None => plan_text(&job, &plan, arguments.simulate),
    };
    terminal::print(&text)?;
    if !arguments.force {
        fit::check(&plan.forecast, Path::new("."))?;
    }
    Ok(Outcome::Sound)
}

fn plan_text(job: &Job, plan: &Plan, simulated: Option<u32>) -> String {
    let mut text = format!("Settings of {}\n{}\n", job.path.display(), run::settings_text(job));
    text += &forecast_table(job, plan).text(0);
    text += &format!("\n{}", corner_table(job).text(0));
    if let Some(workers) = simulated {
        let played = compiler::simulate(plan, workers as usize);
        let (seconds, busy, chain) = (played.makespan, 100.0 * played.busy, played.critical_path);
        text += &format!("\nPlayed with {workers} workers: {seconds:.1} s, {busy:.0} % busy; ");
        text += &format!("the longest chain of tiles takes {chain:.1} s\n");
    }
    text + "\n" + &tile_table(plan).text(0)
}

fn forecast_table(job: &Job, plan: &Plan) -> Table {
    let (forecast, grid) = (&plan.forecast, &job.area.grid);
    let mut table = Table::new(&[Align::Left, Align::Right, Align::Left]);
    table.row(["Tiles", &grouped(plan.tiles.len() as u64), &format!("at most {} at once", plan.workers_useful)]);
    let modules = format!("{} rows, {} columns", grid.rows, grid.cols);
    table.row(["Load modules", &grouped(grid.count() as u64), &modules]);
    table.row(["Triangles", &grouped(plan.budget), &format!("at most, {} before any point", grouped(plan.start))]);
    table.row(["Memory", &files::bytes_text(forecast.memory_bytes), "about, at its peak"]);
    table.row(["Disk", &files::bytes_text(forecast.disk_bytes), "about"]);
    table.row(["Time", &format!("{:.1} s", forecast.seconds), "about"]);
    table
}

fn corner_table(job: &Job) -> Table {
    let mut table = Table::new(&[Align::Left, Align::Right, Align::Right, Align::Right, Align::Right]);
    let system = format!("EPSG:{}", job.area.epsg);
    table.row(["Corners", &format!("{system} east"), "north", "WGS 84 latitude", "longitude"]);
    for corner in compiler::corners(job) {
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

fn json_text(job: &Job, plan: &Plan, simulated: Option<u32>) -> String {
    let played = simulated.map(|workers| {
        let played = compiler::simulate(plan, workers as usize);
        json!({ "workers": workers, "seconds": played.makespan, "busy": played.busy,
                "longest_chain_s": played.critical_path })
    });
    let tiles: Vec<Value> = by_rank(plan).into_iter().map(tile_json).collect();
    let forecast = &plan.forecast;
    let corners: Vec<Value> = compiler::corners(job)
        .iter()
        .map(|corner| json!({ "name": corner.name, "place_m": corner.place_m, "lon_lat": corner.lon_lat }))
        .collect();
    let value = json!({
        "area": job.area.name,
        "budget_triangles": plan.budget,
        "start_triangles": plan.start,
        "workers_useful": plan.workers_useful,
        "corners": corners,
        "forecast": { "memory_bytes": forecast.memory_bytes, "seconds": forecast.seconds,
                      "disk_bytes": forecast.disk_bytes },
        "simulation": played,
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
    })
}
