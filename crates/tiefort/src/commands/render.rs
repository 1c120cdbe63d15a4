//! `tiefort render`: pictures of a database.

use std::path::PathBuf;

use build::product::{Product, SceneParts, Wanted, WantedGround};
use clap::{Args, ValueEnum};
use store::Folder;
use terrain::{LoadModule, ModuleId, ModuleRect};
use views::{Eye, Image, Map, RESIDUAL_SCALE_M, Shown, Sight, Style, draw_map, draw_sight};

use crate::arguments::{Against, Workers, one_of, positive};
use crate::failure::{Failure, Outcome};
use crate::files;

const AFTER_HELP: &str = "\
Examples:
  tiefort render ntc.tdb --view relief --out relief.png
  tiefort render ntc.tdb --view residual --modules 20,30..29,44 --out part.png
  tiefort render ntc.tdb --view perspective --out over.png    all, DEM beside TIN
  tiefort render ntc.tdb --view perspective --eye 521000,3893000,60 \\
      --direction 45 --out from.png
  tiefort render ntc.tdb --view wireframe --eye 521000,3893000 --of tin \\
      --out wires.png

Maps have north up. A perspective without --eye overlooks all load modules asked
for; so does a wireframe with --direction. DEM and TIN are drawn from one eye
under one light. Residuals are DEM less TIN. Rows and columns count from the
south-west corner, row first.";

/// Arguments of `render`.
#[derive(Args)]
#[command(after_help = AFTER_HELP)]
pub struct Arguments {
    /// Folder of the terrain database
    #[arg(value_name = "DIR")]
    database: PathBuf,
    /// What to draw
    #[arg(long, value_enum)]
    view: View,
    /// The picture to write
    #[arg(long, value_name = "PNG")]
    out: PathBuf,
    /// Draw these load modules only, from the south-western to the north-eastern one
    #[arg(long, value_name = "ROW,COL..ROW,COL", value_parser = modules)]
    modules: Option<ModuleRect>,
    /// Which surface; for relief, perspective and wireframe [default: both in perspective, else tin]
    #[arg(long, value_parser = one_of(SURFACES))]
    of: Option<Shown>,
    /// Pixels along the longer side of a map, or across a perspective [default: 1400, 1000 where two are drawn]
    #[arg(long, value_name = "PIXELS", value_parser = clap::value_parser!(u32).range(SIZE))]
    size: Option<u32>,
    /// Metres at the ends of the scale; for residual only
    #[arg(long, value_name = "M", value_parser = positive)]
    scale: Option<f64>,
    /// Where the observer stands: east and north in metres, and metres above the ground [default: 50]
    #[arg(long, value_name = "E,N[,ABOVE]", value_parser = eye, allow_hyphen_values = true)]
    eye: Option<Eye>,
    /// Degrees from north over east [default: towards the middle; north without --eye]
    #[arg(long, value_name = "DEGREES", value_parser = direction, allow_hyphen_values = true)]
    direction: Option<f64>,
    /// Degrees above the horizon, negative below [default: -2; towards the middle without --eye]
    #[arg(long, value_name = "DEGREES", value_parser = pitch, allow_hyphen_values = true)]
    pitch: Option<f64>,
    /// Degrees from edge to edge [default: 60; 40 without --eye]
    #[arg(long, value_name = "DEGREES", value_parser = field_of_view)]
    field_of_view: Option<f64>,
    /// Draw heights so many times as large; for perspectives only [default: 1]
    #[arg(long, value_name = "TIMES", value_parser = positive)]
    exaggeration: Option<f64>,
    #[command(flatten)]
    against: Against,
    #[command(flatten)]
    workers: Workers,
}

/// Pixels that may be asked for: below, titles find no room; above, memory may not.
const SIZE: std::ops::RangeInclusive<i64> = 200..=8000;

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum View {
    /// Shaded relief, colours by height
    Relief,
    /// As an observer sees it
    Perspective,
    /// Edges of the triangles
    Wireframe,
    /// How far triangles lie from the ground
    Residual,
    /// Triangles per load module
    Density,
    /// Use of the limits of load modules and of 4 km windows
    Limits,
    /// Tiles, their order and state
    Tiles,
    /// Roads and water, and where one was mended, degraded or left out
    Features,
}

/// Which surface.
const SURFACES: [(&str, Shown, &str); 3] = [
    ("tin", Shown::Tin, "The load modules"),
    ("dem", Shown::Dem, "The ground they were made from"),
    ("both", Shown::Both, "Both, side by side"),
];

/// Draws.
pub fn run(arguments: &Arguments) -> Result<Outcome, Failure> {
    refuse_flags_without_use(arguments)?;
    if !["", "png"].contains(&files::extension(&arguments.out).as_str()) {
        let message = format!("found --out {}, expected a name that ends in .png", arguments.out.display());
        return Err(Failure::new(message, "pictures are PNG files"));
    }
    files::check_writable(&arguments.out)?;
    // Windows reach beyond any part, and a tile's triangles are counted whole.
    let reads_all = matches!(arguments.view, View::Density | View::Limits | View::Tiles);
    let wanted = Wanted {
        part: if reads_all { None } else { arguments.modules },
        ground: if needs_ground(arguments) { arguments.against.ground() } else { WantedGround::None },
        workers: arguments.workers.count(),
    };
    let product = Product::read(&arguments.database, &wanted)?;
    if let Some(ground) = &product.ground {
        arguments.against.tell_covered(ground.covered());
    }
    let image = draw(arguments, &product, reads_all)?;
    files::write_whole(&arguments.out, |out| image.write_png(out))?;
    Ok(Outcome::Sound)
}

fn draw(arguments: &Arguments, product: &Product, reads_all: bool) -> Result<Image, Failure> {
    let report = if arguments.view == View::Limits { Some(Folder::new(&arguments.database).report()?) } else { None };
    let parts = SceneParts::new(product, reads_all.then(|| product.limit_use()), report.as_ref());
    let part = arguments.modules.unwrap_or(product.part);
    check_inside(part, product)?;
    let chosen: Vec<LoadModule>;
    let modules = if part == product.part {
        &product.modules
    } else {
        chosen = product.modules.iter().filter(|module| part.contains(module.id)).cloned().collect();
        &chosen
    };
    let scene = parts.scene(product, part, modules);
    let (shown, size) = (shown(arguments), size(arguments));
    let map = match arguments.view {
        View::Perspective => return Ok(draw_sight(&scene, shown, Style::Shaded, &sight(arguments), size)),
        View::Wireframe if is_perspective(arguments) => {
            return Ok(draw_sight(&scene, shown, Style::Wireframe, &sight(arguments), size));
        }
        View::Wireframe => Map::Wireframe,
        View::Relief => Map::Relief(shown),
        View::Residual => Map::Residuals(arguments.scale.unwrap_or(RESIDUAL_SCALE_M)),
        View::Density => Map::Density,
        View::Limits => Map::Limits,
        // A tile is drawn whole or not at all.
        View::Tiles => Map::Tiles,
        View::Features if scene.features.is_none() => {
            let message = "found --view features with a database without roads and water, expected one with some";
            return Err(Failure::new(message, "[features] in a job names their files"));
        }
        View::Features => Map::Features,
    };
    Ok(draw_map(&scene, map, size))
}

fn is_perspective(arguments: &Arguments) -> bool {
    let turned = arguments.eye.is_some() || arguments.direction.is_some() || arguments.pitch.is_some();
    match arguments.view {
        View::Perspective => true,
        View::Wireframe => turned || arguments.field_of_view.is_some() || arguments.exaggeration.is_some(),
        _ => false,
    }
}

fn shown(arguments: &Arguments) -> Shown {
    let usual = if is_perspective(arguments) { Shown::Both } else { Shown::Tin };
    arguments.of.unwrap_or(usual)
}

fn needs_ground(arguments: &Arguments) -> bool {
    let of_surface = matches!(arguments.view, View::Relief | View::Perspective) || is_perspective(arguments);
    arguments.view == View::Residual || (of_surface && shown(arguments) != Shown::Tin)
}

fn size(arguments: &Arguments) -> usize {
    let two = arguments.view == View::Limits || (needs_ground(arguments) && shown(arguments) == Shown::Both);
    let usual = if two { 1000 } else { 1400 };
    arguments.size.unwrap_or(usual) as usize
}

fn sight(arguments: &Arguments) -> Sight {
    Sight {
        eye: arguments.eye,
        direction_degrees: arguments.direction,
        pitch_degrees: arguments.pitch,
        field_of_view_degrees: arguments.field_of_view,
        times: arguments.exaggeration.unwrap_or(1.0),
    }
}

/// A flag that changes nothing is a mistake of the caller.
fn refuse_flags_without_use(arguments: &Arguments) -> Result<(), Failure> {
    let perspective = is_perspective(arguments);
    let surface = arguments.view == View::Relief || perspective;
    let flags = [
        ("--of", arguments.of.is_some() && !surface, "relief, perspective, or wireframe with --eye or --direction"),
        ("--scale", arguments.scale.is_some() && arguments.view != View::Residual, "residual"),
        ("--eye", arguments.eye.is_some() && !perspective, "perspective or wireframe"),
        ("--direction", arguments.direction.is_some() && !perspective, "perspective or wireframe"),
        ("--pitch", arguments.pitch.is_some() && !perspective, "perspective or wireframe"),
        ("--field-of-view", arguments.field_of_view.is_some() && !perspective, "perspective or wireframe"),
        ("--exaggeration", arguments.exaggeration.is_some() && !perspective, "perspective or wireframe"),
        ("--against", arguments.against.is_named() && !needs_ground(arguments), "residual, or one that shows the DEM"),
    ];
    match flags.into_iter().find(|&(_, useless, _)| useless) {
        Some((flag, _, use_of)) => {
            let message = format!("found {flag} with a view that has no use for it, expected --view {use_of}");
            Err(Failure::new(message, format!("leave {flag} out, or choose another view")))
        }
        None => Ok(()),
    }
}

fn check_inside(part: ModuleRect, product: &Product) -> Result<(), Failure> {
    let grid = product.grid;
    if part.north <= grid.rows && part.east <= grid.cols {
        return Ok(());
    }
    let (rows, cols) = (grid.rows - 1, grid.cols - 1);
    Err(Failure::new(
        format!(
            "--modules: found up to {},{}, expected rows from 0 to {rows} and columns from 0 to {cols}",
            part.north - 1,
            part.east - 1
        ),
        "rows come first and both count from the south-west",
    ))
}

/// Reads `ROW,COL..ROW,COL`, both included.
fn modules(text: &str) -> Result<ModuleRect, String> {
    let id = |text: &str| {
        let (row, col) = text.split_once(',')?;
        Some(ModuleId { row: row.trim().parse().ok()?, col: col.trim().parse().ok()? })
    };
    let pair = text.split_once("..").unwrap_or((text, text));
    match (id(pair.0), id(pair.1)) {
        (Some(first), Some(last))
            if first.row <= last.row && first.col <= last.col && last.row.max(last.col) < u32::MAX =>
        {
            Ok(ModuleRect { south: first.row, west: first.col, north: last.row + 1, east: last.col + 1 })
        }
        _ => Err("expected ROW,COL..ROW,COL from the south-western to the north-eastern load module, \
                  such as 10,20..17,27"
            .into()),
    }
}

/// Reads `EAST,NORTH` or `EAST,NORTH,ABOVE`.
fn eye(text: &str) -> Result<Eye, String> {
    /// Metres above the ground of who was not told.
    const ABOVE_M: f64 = 50.0;
    let numbers: Option<Vec<f64>> = text.split(',').map(|part| part.trim().parse().ok()).collect();
    match numbers.as_deref() {
        Some(numbers) if numbers.iter().any(|number| !number.is_finite()) => Err("expected finite numbers".into()),
        Some(&[east, north]) => Ok(Eye { place_m: [east, north], above_m: ABOVE_M }),
        Some(&[east, north, above_m]) if 0.0 < above_m => Ok(Eye { place_m: [east, north], above_m }),
        _ => Err("expected EAST,NORTH or EAST,NORTH,ABOVE in metres, such as 521000,3893000,60".into()),
    }
}

fn within(text: &str, low: f64, high: f64) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(number) if low <= number && number <= high => Ok(number),
        _ => Err(format!("expected degrees from {low} to {high}")),
    }
}

fn direction(text: &str) -> Result<f64, String> {
    within(text, -360.0, 360.0)
}

fn pitch(text: &str) -> Result<f64, String> {
    within(text, -89.0, 89.0)
}

fn field_of_view(text: &str) -> Result<f64, String> {
    within(text, 1.0, 150.0)
}
