//! `tiefort inadequate`: where the TIN is not good enough, and what could be done.

use std::collections::BTreeSet;
use std::path::PathBuf;

use clap::Args;
use inspect::{Component, Inadequate};
use serde_json::{Value, json};
use views::{Align, Image, Scene, SceneLimits, Table, draw_errors, draw_module_limits, fold, grouped};

use crate::arguments::{Against, Format, one_of, positive};
use crate::failure::{Failure, OUTDATED, Outcome};
use crate::{files, left_over, terminal};

const AFTER_HELP: &str = "\
Examples:
  tiefort inadequate ntc.tdb
  tiefort inadequate ntc.tdb --tolerance 5 --out maps
  tiefort inadequate desert.tdb --against desert.tif    against your own raster

Writes inadequate.geojson (each piece of ground with its worst post, area, load
modules, what stands in the way and what could be done), error.png (weighted
residuals, darkest at twice the tolerance) and density.png (triangles or
polygons of each load module, darkest at the limit), each with its scale.

What to do about it goes into a file of pins, GeoJSON, which the job names:
[tin] pins = \"pins.geojson\". Points with \"pin\": \"add\", \"forbid\", or \"height\"
with \"height_m\"; polygons with \"pin\": \"importance\" and \"factor\", or \"exclude\".
The next build renews the tiles that the pins reach, and `tiefort diff` says
what they bought.";

/// Pieces of ground that the text shows; the file has them all.
const ROWS_MAX: usize = 10;
/// Pixels along the longer side of a map.
const MAP_PIXELS: usize = 1400;

/// Arguments of `inadequate`.
#[derive(Args)]
#[command(after_help = AFTER_HELP)]
pub struct Arguments {
    /// Folder of the terrain database
    #[arg(value_name = "DIR")]
    database: PathBuf,
    /// Weighted residual in metres that is still good enough [default: 3 times the RMS residual as built]
    #[arg(long, value_name = "M", value_parser = positive)]
    tolerance: Option<f64>,
    #[command(flatten)]
    against: Against,
    /// Folder for the three files, made where it is not there yet [default: that of the database]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// For a person or a program
    #[arg(long, value_parser = one_of(FORMATS), default_value = "text")]
    format: Format,
}

/// Whom it answers.
const FORMATS: [(&str, Format, &str); 2] = [
    ("text", Format::Text, "For a person"),
    ("json", Format::Json, "For a program: the content of inadequate.geojson"),
];

/// Finds, and writes the three files.
pub fn run(arguments: &Arguments) -> Result<Outcome, Failure> {
    let folder = arguments.out.as_ref().unwrap_or(&arguments.database);
    let files = ["inadequate.geojson", "error.png", "density.png"].map(|name| folder.join(name));
    check_folder(arguments, &files)?;
    let found = inspect::inadequate(&arguments.database, arguments.against.rasters(), arguments.tolerance)?;
    arguments.against.tell_covered(found.covered);
    files::make_folder(folder)?;
    let collection = format!("{:#}\n", geojson(&found));
    files::write_whole(&files[0], |out| std::io::Write::write_all(out, collection.as_bytes()))?;
    for (image, path) in maps(&found).iter().zip(&files[1..]) {
        files::write_whole(path, |out| image.write_png(out))?;
    }
    terminal::print(&match arguments.format {
        Format::Text => text(&found, &files, arguments.against.is_named()),
        Format::Json => collection,
    })?;
    Ok(Outcome::Sound)
}

/// Refuses a folder that takes no files, before the work.
fn check_folder(arguments: &Arguments, files: &[PathBuf; 3]) -> Result<(), Failure> {
    match &arguments.out {
        // A folder that is not there is made when there is something to put into it.
        Some(folder) if !left_over::is_taken(folder) => Ok(()),
        Some(folder) => files::make_folder(folder).and_then(|()| files::check_writable(&files[0])),
        // What is no database is told as that.
        None if !arguments.database.is_dir() => Ok(()),
        None => files::check_writable(&files[0])
            .map_err(|failure| Failure::new(failure.message(), "name another folder for the three files: --out DIR")),
    }
}

/// The two maps: of errors, and of what each load module uses of its limit.
fn maps(found: &Inadequate) -> [Image; 2] {
    let limits = SceneLimits {
        count: found.count.to_owned(),
        modules: found.counts.clone(),
        per_load_module: found.per_module,
        ..SceneLimits::default()
    };
    let scene = Scene {
        name: &found.area,
        crs: &found.crs,
        grid: found.grid,
        frame: found.frame,
        part: found.grid.all(),
        modules: &[],
        ground: None,
        limits: &limits,
        water: None,
        features: None,
        tiles: &[],
    };
    [draw_errors(&scene, &found.residual_m, found.tolerance_m, MAP_PIXELS), draw_module_limits(&scene, MAP_PIXELS)]
}

fn text(found: &Inadequate, files: &[PathBuf; 3], is_named: bool) -> String {
    let all = &found.components;
    let posts: u64 = all.iter().map(|component| component.posts).sum();
    let ground = match (is_named, found.is_outdated) {
        (true, _) => found.against.clone(),
        (false, is_outdated) => format!(
            "the ground {}, any roads and water in it; --against FILE measures against FILE itself",
            if is_outdated { "as it is now" } else { "that tiles were refined to" }
        ),
    };
    let mut text = format!(
        "Gaming area {}: {} pieces of ground, {} posts, above {:.2} m\nagainst {ground}\n",
        found.area,
        grouped(all.len() as u64),
        grouped(posts),
        found.tolerance_m
    );
    if found.is_outdated {
        text += &format!("The database is outdated: {OUTDATED}. Until then, no limit need stand in the way.\n");
    }
    if !all.is_empty() {
        let mut table = Table::new(&[Align::Right, Align::Right, Align::Right, Align::Right, Align::Left]);
        table.row(["posts", "worst m", "east", "north", "stands in the way"]);
        all.iter().take(ROWS_MAX).for_each(|component| table.row(row(found, component)));
        text += &format!("\n{}", table.text(0));
        let more = all.len().saturating_sub(ROWS_MAX);
        text += &if more == 0 { String::new() } else { format!("and {} more\n", grouped(more as u64)) };
        text += "\nwhat could be done\n";
        // The same for all that one limit stands in the way of.
        let told: BTreeSet<(&str, &str)> = all.iter().take(ROWS_MAX).map(|one| (blocked_by(one), one.action)).collect();
        let mut table = Table::new(&[Align::Left, Align::Left]);
        told.into_iter().for_each(|(limit, action)| table.row([limit, action]));
        text += &table.text(2);
    }
    let names: Vec<String> = files.iter().map(|path| path.display().to_string()).collect();
    fold(&format!("{text}\nwritten: {}\n", names.join(", ")), 2)
}

/// What stands in the way first.
fn blocked_by(component: &Component) -> &'static str {
    component.blocked_by.first().map_or("nothing", |limit| limit.trim_start_matches("limits."))
}

fn row(found: &Inadequate, component: &Component) -> [String; 5] {
    let [east, north] = place(found, component.worst.row, component.worst.col);
    [
        grouped(component.posts),
        format!("{:.2}", component.largest_m),
        format!("{east:.0}"),
        format!("{north:.0}"),
        blocked_by(component).into(),
    ]
}

fn place(found: &Inadequate, row: i32, col: i32) -> [f64; 2] {
    let [east, north] = found.origin_m;
    [east + f64::from(col) * found.spacing_m, north + f64::from(row) * found.spacing_m]
}

fn geojson(found: &Inadequate) -> Value {
    let features: Vec<Value> = found.components.iter().map(|component| feature(found, component)).collect();
    let name = format!("urn:ogc:def:crs:EPSG::{}", found.epsg);
    json!({
        "type": "FeatureCollection",
        "name": "inadequate",
        "crs": { "type": "name", "properties": { "name": name } },
        "against": found.against,
        "covered": found.covered,
        "tolerance_m": found.tolerance_m,
        "outdated": found.is_outdated,
        "features": features,
    })
}

/// A piece of ground: a rectangle around each run of its posts, half a post wide.
fn feature(found: &Inadequate, component: &Component) -> Value {
    let half = found.spacing_m / 2.0;
    let rectangle = |&(row, first, last): &(i32, i32, i32)| {
        let ([west, middle], [east, _]) = (place(found, row, first), place(found, row, last));
        let (west, east, south, north) = (west - half, east + half, middle - half, middle + half);
        json!([[[west, south], [east, south], [east, north], [west, north], [west, south]]])
    };
    let rectangles: Vec<Value> = component.runs.iter().map(rectangle).collect();
    let modules: Vec<[u32; 2]> = component.modules.iter().map(|module| [module.row, module.col]).collect();
    let [east, north] = place(found, component.worst.row, component.worst.col);
    json!({
        "type": "Feature",
        "geometry": { "type": "MultiPolygon", "coordinates": rectangles },
        "properties": {
            "posts": component.posts,
            "area_m2": component.posts as f64 * found.spacing_m * found.spacing_m,
            "largest_m": component.largest_m,
            "squares_m2": component.squares_m2,
            "worst": {
                "row": component.worst.row,
                "col": component.worst.col,
                "east_m": east,
                "north_m": north,
                "height_m": component.worst_height_m,
            },
            "load_modules": modules,
            "blocked": !component.blocked_by.is_empty(),
            "blocked_by": component.blocked_by,
            "action": component.action,
            "feature": component.far_off.as_ref().map(|far| {
                json!({ "feature": far.feature, "off_m": far.off_m, "cause": far.cause.name() })
            }),
        },
    })
}
