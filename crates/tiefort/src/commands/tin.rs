//! `tiefort tin`: just a mesh from a raster.

use std::path::PathBuf;

use clap::{ArgGroup, Args, ValueEnum};
use compiler::{Mesh, TinMethod, TinRequest};
use serde_json::json;
use terrain::StopReason;
use views::{Coordinates, MeshPlace, grouped};

use crate::arguments::{Workers, positive, rows_by_columns};
use crate::failure::{Failure, Outcome};
use crate::progress::{Listener, Show};
use crate::signals::Signals;
use crate::{events, files, terminal};

const AFTER_HELP: &str = "\
Examples:
  tiefort tin dem.tif --points 76500 --out mesh.ply
  tiefort tin dem.tif --max-residual 2 --method greedy --key max --out mesh.obj
  tiefort tin dem.tif --rms 1.5 --tiles 6x6 --workers 8 --coordinates map --out mesh.ply

The first of --points, --max-residual and --rms that is reached ends it. Coordinates are metres from the south-west
post (Blender, MeshLab); with --coordinates map they are eastings and northings in 64 bits (QGIS).";

/// Arguments of `tin`.
#[derive(Args)]
#[command(after_help = AFTER_HELP)]
#[command(group = ArgGroup::new("end").args(["points", "max_residual", "rms"]).required(true).multiple(true))]
pub struct Arguments {
    /// The raster of heights
    #[arg(value_name = "DEM")]
    dem: PathBuf,
    /// Vertices of the mesh
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(4..))]
    points: Option<u32>,
    /// Largest residual in metres
    #[arg(long, value_name = "M", value_parser = positive)]
    max_residual: Option<f64>,
    /// Root mean square of the residuals in metres
    #[arg(long, value_name = "R", value_parser = positive)]
    rms: Option<f64>,
    /// Refine so many rows and columns of tiles at once, their borders matched
    #[arg(long, value_name = "ROWSxCOLUMNS", default_value = "1x1", value_parser = rows_by_columns)]
    tiles: (u32, u32),
    /// How posts are chosen
    #[arg(long, value_enum, default_value_t = Method::Optimised)]
    method: Method,
    /// What makes a post worth a point; for --method greedy only
    #[arg(long, value_enum)]
    key: Option<Key>,
    /// What coordinates are counted from
    #[arg(long, value_enum, default_value_t = Frame::Local)]
    coordinates: Frame,
    #[command(flatten)]
    workers: Workers,
    /// Print errors only
    #[arg(long)]
    quiet: bool,
    /// Print events as JSON lines, the last one the summary
    #[arg(long, conflicts_with = "quiet")]
    json: bool,
    /// The mesh to write: .ply or .obj
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
}

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Method {
    /// Lowest RMS residual
    Optimised,
    /// The founding paper's: batches of posts of the largest residual
    Paper,
    /// One worst post at a time
    Greedy,
}

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Key {
    /// Its own residual
    Max,
    /// The squared residuals in its triangle
    Sse,
}

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Frame {
    /// The south-west post
    Local,
    /// The map's origin
    Map,
}

/// A kind of file a mesh is written to.
#[derive(Clone, Copy)]
enum Kind {
    Ply,
    Obj,
}

/// Makes the mesh.
pub fn run(arguments: &Arguments) -> Result<Outcome, Failure> {
    let kind = kind(arguments)?;
    let request = request(arguments)?;
    files::check_writable(&arguments.out)?;
    let signals = Signals::watch()?;
    let show = match (arguments.json, arguments.quiet) {
        (true, _) => Show::Json,
        (false, true) => Show::Nothing,
        (false, false) => Show::Progress,
    };
    let mut listener = Listener::start(show, arguments.tiles, request.workers);
    let meshed = compiler::tin(&request, signals.stop(), &mut listener);
    let (_, seconds) = listener.finish();
    let mesh = meshed.map_err(|error| Failure::of_compiler(&error, signals.exit_code()))?;
    write(&mesh, kind, arguments)?;
    match show {
        Show::Nothing => {}
        Show::Json => events::print_line(&json!({
            "event": "summary",
            "points": mesh.points,
            "triangles": mesh.tin.triangles.len(),
            "residual": mesh.residual,
        })),
        Show::Progress => terminal::tell(&summary(&mesh, seconds)),
    }
    Ok(Outcome::Sound)
}

fn kind(arguments: &Arguments) -> Result<Kind, Failure> {
    match files::extension(&arguments.out).as_str() {
        "ply" => Ok(Kind::Ply),
        "obj" => Ok(Kind::Obj),
        "glb" => Err(Failure::not_yet("a mesh as .glb", "write .ply or .obj")),
        found => {
            let path = arguments.out.display();
            Err(Failure::new(
                format!("{path}: found the extension {found:?}, expected \"ply\" or \"obj\""),
                "the extension of --out says which kind of mesh is written",
            ))
        }
    }
}

fn request(arguments: &Arguments) -> Result<TinRequest, Failure> {
    let method = match (arguments.method, arguments.key) {
        (Method::Greedy, key) => TinMethod::Greedy { key: job_key(key.unwrap_or(Key::Max)) },
        (Method::Optimised, None) => TinMethod::Optimised,
        (Method::Paper, None) => TinMethod::Paper,
        (_, Some(_)) => {
            let message = "found --key with another method than greedy, expected the method's own";
            return Err(Failure::new(message, "leave --key out, or add --method greedy"));
        }
    };
    Ok(TinRequest {
        dem: arguments.dem.clone(),
        method,
        points: arguments.points.map(|points| points as usize),
        max_residual_m: arguments.max_residual,
        rms_m: arguments.rms,
        tiles: arguments.tiles,
        workers: arguments.workers.count(),
    })
}

fn job_key(key: Key) -> job::ErrorKey {
    match key {
        Key::Max => job::ErrorKey::Max,
        Key::Sse => job::ErrorKey::Sse,
    }
}

fn write(mesh: &Mesh, kind: Kind, arguments: &Arguments) -> Result<(), Failure> {
    let place = MeshPlace {
        east_m: mesh.east_m,
        north_m: mesh.north_m,
        spacing_m: [mesh.spacing_m.0, mesh.spacing_m.1],
        epsg: mesh.epsg,
    };
    let coordinates = match arguments.coordinates {
        Frame::Local => Coordinates::Local,
        Frame::Map => Coordinates::Map,
    };
    files::write_whole(&arguments.out, |out| match kind {
        Kind::Ply => views::write_ply(out, &mesh.tin, &place, coordinates),
        Kind::Obj => views::write_obj(out, &mesh.tin, &place, coordinates),
    })
}

fn summary(mesh: &Mesh, seconds: f64) -> String {
    let end = match mesh.stop {
        StopReason::BudgetSpent => "all points are spent",
        StopReason::ResidualReached => "the largest residual is reached",
        StopReason::RmsReached => "the RMS residual is reached",
        StopReason::Exhausted => "no post is left to choose",
    };
    let (points, triangles) = (grouped(mesh.points as u64), grouped(mesh.tin.triangles.len() as u64));
    let (rms_m, p99_m, max_m) = (mesh.residual.rms_m, mesh.residual.p99_m, mesh.residual.max_m);
    let residual = format!("RMS {rms_m:.3} m, 99 % within {p99_m:.2} m, largest {max_m:.2} m");
    format!("{points} points, {triangles} triangles in {seconds:.1} s: {end}\nresidual: {residual}\n")
}
