//! `tiefort tin`: just a mesh from a raster.

use std::path::{Path, PathBuf};
use std::sync::PoisonError;

use build::workbench::{Mesh, TinMethod, TinRequest, TinStart};
use build::{Stage, Stopwatch};
use clap::{ArgGroup, Args};
use exports::{Coordinates, TinPlace};
use inspect::{Fidelity, Sights};
use job::{Effort, ErrorKey, HeightFit, Lattice, MethodName, Optimising, Sight, Usual};
use serde_json::{Value, json};
use terrain::{Metres, StopReason};
use views::{Align, Table, eta_in_words, grouped};

use crate::arguments::{Workers, choice, coordinates, positive, rows_by_columns, start_method, start_methods};
use crate::clock::SystemClock;
use crate::estimate::Estimate;
use crate::failure::{Failure, Outcome};
use crate::progress::{Listener, Show};
use crate::signals::{self, Signals};
use crate::{events, files, measures, measures_json, terminal};

const AFTER_HELP: &str = "\
Examples:
  tiefort tin dem.tif --points 76500 --out mesh.ply
  tiefort tin dem.tif --max-residual 2 --method greedy --key max --out mesh.obj
  tiefort tin dem.tif --points 5000 --start vip:900 --method paper --out mesh.ply
  tiefort tin dem.tif --points 5000 --start surveyed.csv --out mesh.ply
  tiefort tin dem.tif --points 5000 --measure --out mesh.ply    measures it, too
  tiefort tin dem.tif --levels 1000,2500,5000 --method paper --out mesh.ply
  tiefort tin dem.tif --rms 1.5 --tiles 6x6 --coordinates map --out mesh.ply

A file of points to start from has the columns east,north,height_m.

The first of --points (or --triangles), --max-residual and --rms that is reached
ends it. --levels writes one mesh for each number of vertices: mesh-1000.ply,
mesh-2500.ply and so on. With paper and greedy each is the beginning of one
sequence of posts, and holds all vertices of the smaller ones. With optimised,
whose vertices move, each is made anew, with vertices of its own. Coordinates
are metres from the south-west post (Blender, MeshLab); with --coordinates map
they are eastings and northings in 64 bits (QGIS).";

/// Arguments that say when to stop: at least one is given.
const ENDS: [&str; 5] = ["points", "triangles", "max_residual", "rms", "levels"];

/// One line of all five ends would be wider than a terminal.
const USAGE: &str = "\
tiefort tin [OPTIONS] --out <FILE> <END> <DEM>
  where END is --points <N>|--triangles <N>|--max-residual <M>|--rms <R>
  or --levels <N,N…>";

/// Arguments of `tin`.
#[derive(Args)]
#[command(after_help = AFTER_HELP, override_usage = USAGE)]
#[command(group = ArgGroup::new("end").args(ENDS).required(true).multiple(true))]
pub struct Arguments {
    /// The raster of heights
    #[arg(value_name = "DEM")]
    dem: PathBuf,
    /// Vertices of the mesh
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(4..))]
    points: Option<u32>,
    /// Most triangles of the mesh, instead of --points; for --method optimised only
    #[arg(long, value_name = "N", conflicts_with = "points", value_parser = clap::value_parser!(u32).range(2..))]
    triangles: Option<u32>,
    /// One mesh for each of these numbers of vertices, from few to many: mesh-1000.ply, mesh-2500.ply, …
    #[arg(
        long,
        value_name = "N,N…",
        value_delimiter = ',',
        conflicts_with_all = ["points", "triangles", "max_residual", "rms"],
        value_parser = clap::value_parser!(u32).range(4..)
    )]
    levels: Vec<u32>,
    /// Largest residual in metres
    #[arg(long, value_name = "M", value_parser = positive)]
    max_residual: Option<f64>,
    /// Root mean square of the residuals in metres
    #[arg(long, value_name = "R", value_parser = positive)]
    rms: Option<f64>,
    #[arg(long, value_name = "METHOD:N|FILE", value_parser = start, help = start_help())]
    start: Option<TinStart>,
    /// Refine so many rows and columns of tiles at once, their borders matched, which costs 0.4 % RMS [default: tiles
    /// of about 330 posts and 2,000 points where there are four or more, else 1x1; 1x1 with --max-residual, --rms,
    /// --levels, --start and --method paper]
    #[arg(long, value_name = "ROWSxCOLUMNS", value_parser = rows_by_columns)]
    tiles: Option<(u32, u32)>,
    #[arg(long, value_parser = choice::<MethodName>(), default_value = job::usual_text("tin.method"))]
    #[arg(help = meaning("tin.method"))]
    method: MethodName,
    /// What makes a post worth a point; for --method greedy only
    #[arg(long, value_parser = choice::<ErrorKey>())]
    key: Option<ErrorKey>,
    #[arg(long, value_parser = choice::<Effort>(), help = of_optimised("tin.effort"))]
    effort: Option<Effort>,
    #[arg(long, value_name = "FIT", value_parser = choice::<HeightFit>(), help = of_optimised("tin.height_fit"))]
    height_fit: Option<HeightFit>,
    #[arg(long, value_parser = choice::<Lattice>(), help = of_optimised("tin.lattice"))]
    lattice: Option<Lattice>,
    #[arg(long, value_name = "true|false", help = of_optimised("tin.sight"))]
    sight: Option<bool>,
    /// Coordinate system of a raster that names none [default: metres in a plane]
    #[arg(long, value_name = "EPSG:CODE")]
    crs: Option<String>,
    /// What coordinates are counted from
    #[arg(long, value_parser = coordinates(), default_value = "local")]
    coordinates: Coordinates,
    /// Measure the mesh against the raster, beside a regular grid, as `tiefort fidelity` does
    #[arg(long, conflicts_with = "quiet")]
    measure: bool,
    #[command(flatten)]
    workers: Workers,
    /// Print errors only
    #[arg(long)]
    quiet: bool,
    /// Print events as JSON lines, the last one the summary
    #[arg(long, conflicts_with = "quiet")]
    json: bool,
    /// The mesh to write: .ply, .obj or .glb
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
}

/// Reads the name of a file of points, or as [`start_method`].
fn start(text: &str) -> Result<TinStart, String> {
    match files::extension(Path::new(text)).as_str() {
        "csv" | "geojson" | "json" => Ok(TinStart::File(text.into())),
        _ => start_method(text)
            .map(|(method, points)| TinStart::Method(method, points.unwrap_or(0)))
            .map_err(|error| format!("{error}; or a file whose name ends in .csv or .geojson")),
    }
}

fn start_help() -> String {
    format!(
        "Start from points of another method ({}) and improve what it makes; or from those of a file (.csv, .geojson), \
         fixed where they have a height",
        start_methods()
    )
}

/// What a key of a job means, as help begins.
fn meaning(key: &str) -> String {
    let text = job::key(key).map_or("", |key| key.meaning);
    let first = text.chars().next().into_iter().flat_map(char::to_uppercase);
    first.chain(text.chars().skip(1)).collect()
}

/// The same of a key of the optimised method.
fn of_optimised(key: &str) -> String {
    let usual = match job::key(key).map(|key| key.usual) {
        Some(Usual::Is(usual) | Usual::Otherwise(usual)) => usual,
        Some(Usual::Needed) | None => "none",
    };
    format!("{}; for --method optimised only [default: {usual}]", meaning(key))
}

/// A kind of file a mesh is written to.
#[derive(Clone, Copy)]
pub enum Kind {
    /// Polygon File Format, binary.
    Ply,
    /// Wavefront OBJ.
    Obj,
    /// Binary glTF 2.0.
    Glb,
}

/// Makes the mesh.
pub fn run(arguments: &Arguments) -> Result<Outcome, Failure> {
    let on_map = arguments.coordinates == Coordinates::Map;
    let kind = kind_of(&arguments.out, on_map)?;
    let request = request(arguments)?;
    let outs = outs(arguments);
    outs.iter().try_for_each(|out| files::check_writable(out))?;
    let signals = Signals::watch()?;
    let show = match (arguments.json, arguments.quiet) {
        (true, _) => Show::Json,
        (false, true) => Show::Nothing,
        (false, false) => Show::Progress,
    };
    let (clock, estimate) = (SystemClock::start(), Estimate::of_one_stage(Stage::Refine));
    let mut listener = Listener::start(show, arguments.tiles.unwrap_or((1, 1)), request.workers, estimate, clock);
    let place = listener.place();
    signals.end_in_time(move || {
        let words = place.lock().unwrap_or_else(PoisonError::into_inner).words();
        signals::stopped(&words, "run the same command again; nothing was left half-written")
    });
    let levels: Vec<usize> = arguments.levels.iter().map(|&points| points as usize).collect();
    let mut watched = Stopwatch::start(&clock, &mut listener);
    let meshed = match levels.is_empty() {
        true => build::workbench::tin(&request, signals.stop(), &mut watched).map(|mesh| vec![mesh]),
        false => build::workbench::tin_levels(&request, &levels, signals.stop(), &mut watched),
    };
    listener.finish();
    let seconds = clock.seconds();
    signals.tell_once(|| {});
    let meshes = meshed.map_err(|error| without_job(Failure::of_compiler(&error, signals.exit_code())))?;
    for (mesh, out) in meshes.iter().zip(&outs) {
        write_mesh(mesh, kind, on_map, out)?;
    }
    let measure = |mesh: &Mesh| {
        // Eyes look over voids, too.
        let tin = mesh.with_voids.as_ref().unwrap_or(&mesh.tin);
        arguments.measure.then(|| inspect::measure(tin, &mesh.dem, Metres(mesh.spacing_m.0), Sights::USUAL))
    };
    let measured: Vec<Option<Fidelity>> = meshes.iter().map(measure).collect();
    match show {
        Show::Nothing => {}
        Show::Json => events::print_line(&told_json(&meshes, &measured, &outs, arguments)),
        Show::Progress | Show::Verbose | Show::JsonLog => {
            terminal::tell(&told(&meshes, &measured, &outs, arguments, seconds));
        }
    }
    Ok(Outcome::Sound)
}

/// The same, with a hint that needs no job where a raster's coordinate system is not known.
pub fn without_job(failure: Failure) -> Failure {
    failure.hinted_where("coordinate reference system", "say what it is: --crs EPSG:32611 (your own)")
}

/// The files to write: one, or one for each level with its number of vertices in its name.
fn outs(arguments: &Arguments) -> Vec<PathBuf> {
    let out = &arguments.out;
    if arguments.levels.is_empty() {
        return vec![out.clone()];
    }
    let part = |part: Option<&std::ffi::OsStr>| part.unwrap_or_default().to_string_lossy().into_owned();
    let (stem, extension) = (part(out.file_stem()), part(out.extension()));
    arguments.levels.iter().map(|points| out.with_file_name(format!("{stem}-{points}.{extension}"))).collect()
}

/// What was made, for a program: of levels the last one's figures, and a list of all.
fn told_json(meshes: &[Mesh], measured: &[Option<Fidelity>], outs: &[PathBuf], arguments: &Arguments) -> Value {
    let all: Vec<Value> =
        meshes.iter().zip(measured).map(|(mesh, measured)| summary_json(mesh, measured.as_ref())).collect();
    let mut told = all.last().cloned().unwrap_or_default();
    if !arguments.levels.is_empty() {
        let level = |(mut level, out): (Value, &PathBuf)| {
            level["file"] = json!(out.display().to_string());
            level.as_object_mut().map(|level| level.remove("event"));
            level
        };
        told["levels"] = all.into_iter().zip(outs).map(level).collect();
    }
    told
}

/// What was made, for a person.
fn told(
    meshes: &[Mesh],
    measured: &[Option<Fidelity>],
    outs: &[PathBuf],
    arguments: &Arguments,
    seconds: f64,
) -> String {
    if let ([mesh], true) = (meshes, arguments.levels.is_empty()) {
        let tiles = match (arguments.tiles, mesh.tiles) {
            (Some(_), _) | (None, (1, 1)) => String::new(),
            (None, (rows, cols)) => format!("{rows} x {cols} tiles at once; --tiles 1x1 makes one\n"),
        };
        return summary(mesh, seconds) + &tiles + &measured_text(measured[0].as_ref());
    }
    let mut table = Table::new(&[Align::Left, Align::Right, Align::Right, Align::Right, Align::Right, Align::Right]);
    table.row(["level", "points", "triangles", "RMS m", "99 % m", "largest m"]);
    for (mesh, out) in meshes.iter().zip(outs) {
        let residual = &mesh.residual;
        let [rms_m, p99_m, max_m] = [(residual.rms_m, 3), (residual.p99_m, 2), (residual.max_m, 2)]
            .map(|(metres, digits)| format!("{metres:.digits$}"));
        let name = files::shown(out).display().to_string();
        table.row([name, grouped(mesh.points as u64), grouped(mesh.tin.triangles.len() as u64), rms_m, p99_m, max_m]);
    }
    let mut text = format!("{} levels in {seconds:.1} s\n{}", meshes.len(), table.text(0));
    for ((mesh, out), asked) in meshes.iter().zip(outs).zip(&arguments.levels) {
        if mesh.points < *asked as usize {
            text += &format!("{}: {}\n", files::shown(out).display(), end_in_words(mesh.stop));
        }
    }
    for (measured, out) in measured.iter().zip(outs).filter(|(measured, _)| measured.is_some()) {
        text += &format!("\n{}{}", files::shown(out).display(), measured_text(measured.as_ref()));
    }
    text
}

fn summary_json(mesh: &Mesh, measured: Option<&Fidelity>) -> Value {
    let mut summary = json!({
        "event": "summary",
        "points": mesh.points,
        "triangles": mesh.tin.triangles.len(),
        "residual": mesh.residual,
        "tiles": [mesh.tiles.0, mesh.tiles.1],
        "voids": mesh.dem.void_count(),
    });
    if let Some(limit) = mesh.limit {
        summary["limit"] = json!({
            "triangles": limit.triangles,
            "rms_m": limit.rms_m,
            "eta": limit.eta(mesh.residual.rms_m),
            "rough_share": limit.rough_share,
        });
    }
    if let Some(measured) = measured {
        // The summary has its residual already.
        for (name, figures) in measures_json::fields(measured).into_iter().filter(|(name, _)| name != "residual") {
            summary[name] = figures;
        }
    }
    summary
}

fn measured_text(measured: Option<&Fidelity>) -> String {
    measured.map_or_else(String::new, |found| format!("\n{}", measures::text(found)))
}

/// The kind of file that a name says, with map coordinates where there is room for them.
///
/// # Errors
/// When there is none, or the name says no kind.
pub fn kind_of(out: &Path, on_map: bool) -> Result<Kind, Failure> {
    match files::extension(out).as_str() {
        "ply" => Ok(Kind::Ply),
        "obj" => Ok(Kind::Obj),
        "glb" if on_map => {
            let message = "found --coordinates map with a .glb, which has no room for map coordinates";
            Err(Failure::new(message, "leave --coordinates out, or write .ply or .obj"))
        }
        "glb" => Ok(Kind::Glb),
        found => {
            let path = out.display();
            Err(Failure::new(
                format!("{path}: found the extension {found:?}, expected \"ply\", \"obj\" or \"glb\""),
                "the extension of --out says which kind of mesh is written",
            ))
        }
    }
}

/// What is to be made.
///
/// # Errors
/// When arguments do not fit together.
pub fn request(arguments: &Arguments) -> Result<TinRequest, Failure> {
    Ok(TinRequest {
        dem: arguments.dem.clone(),
        crs: arguments.crs.clone(),
        method: method(arguments)?,
        points: arguments.points.map(|points| points as usize),
        triangles: arguments.triangles.map(|triangles| triangles as usize),
        max_residual_m: arguments.max_residual,
        rms_m: arguments.rms,
        start: arguments.start.clone(),
        tiles: arguments.tiles,
        workers: arguments.workers.count(),
    })
}

fn method(arguments: &Arguments) -> Result<TinMethod, Failure> {
    if arguments.method != MethodName::Optimised {
        refuse_flags_of_optimised(arguments)?;
    }
    match (arguments.method, arguments.key) {
        (MethodName::Greedy, key) => Ok(TinMethod::Greedy { key: key.unwrap_or(ErrorKey::Max) }),
        (MethodName::Optimised, None) => Ok(TinMethod::Optimised(optimising(arguments))),
        (MethodName::Paper, None) => Ok(TinMethod::Paper),
        (_, Some(_)) => {
            let message = "found --key with another method than greedy, expected the method's own";
            Err(Failure::new(message, "leave --key out, or add --method greedy"))
        }
    }
}

fn refuse_flags_of_optimised(arguments: &Arguments) -> Result<(), Failure> {
    if arguments.triangles.is_some() {
        let message = "found --triangles with another method than optimised, expected --points";
        return Err(Failure::new(message, "those methods count points; a mesh has about twice as many triangles"));
    }
    let flags = [
        ("--effort", arguments.effort.is_some()),
        ("--height-fit", arguments.height_fit.is_some()),
        ("--lattice", arguments.lattice.is_some()),
        ("--sight", arguments.sight.is_some()),
    ];
    let Some((flag, _)) = flags.into_iter().find(|&(_, given)| given) else { return Ok(()) };
    let message = format!("found {flag} with another method than optimised, expected the method's own");
    Err(Failure::new(message, format!("leave {flag} out, or add --method optimised")))
}

/// The flags given, over a job's defaults.
fn optimising(arguments: &Arguments) -> Optimising {
    let usual = Optimising::default();
    let effort = arguments.effort.unwrap_or(usual.effort);
    Optimising {
        effort,
        height_fit: arguments.height_fit.unwrap_or(usual.height_fit),
        lattice: arguments.lattice.unwrap_or(usual.lattice),
        sight: arguments.sight.unwrap_or(Sight::is_usual_with(effort)).then(Sight::default),
    }
}

/// Writes a mesh.
///
/// # Errors
/// When it cannot be written; what lay there before is then still there.
pub fn write_mesh(mesh: &Mesh, kind: Kind, on_map: bool, out: &Path) -> Result<(), Failure> {
    let place = TinPlace {
        origin_m: [mesh.east_m, mesh.north_m],
        spacing_m: [mesh.spacing_m.0, mesh.spacing_m.1],
        crs: mesh.epsg.map(|code| format!("EPSG:{code}")),
    };
    let coordinates = if on_map { Coordinates::Map } else { Coordinates::Local };
    files::write_whole(out, |out| match kind {
        Kind::Ply => exports::write_tin_ply(out, &mesh.tin, &place, coordinates),
        Kind::Obj => exports::write_tin_obj(out, &mesh.tin, &place, coordinates),
        Kind::Glb => exports::write_tin_glb(out, &mesh.tin, &place),
    })
}

/// Why a mesh has no more vertices.
pub fn end_in_words(stop: StopReason) -> &'static str {
    match stop {
        StopReason::BudgetSpent => "all points are spent",
        StopReason::ResidualReached => "the largest residual is reached",
        StopReason::RmsReached => "the RMS residual is reached",
        StopReason::Exhausted => "no post is left to choose",
    }
}

fn summary(mesh: &Mesh, seconds: f64) -> String {
    let end = end_in_words(mesh.stop);
    let (points, triangles) = (grouped(mesh.points as u64), grouped(mesh.tin.triangles.len() as u64));
    let (rms_m, p99_m, max_m) = (mesh.residual.rms_m, mesh.residual.p99_m, mesh.residual.max_m);
    let residual = format!("RMS {rms_m:.3} m, 99 % within {p99_m:.2} m, largest {max_m:.2} m");
    let limit = mesh.limit.and_then(|limit| Some((limit, limit.eta(rms_m)?)));
    let eta = limit.map_or_else(String::new, |(limit, eta)| {
        format!("eta: {}\n", eta_in_words(eta, limit.triangles as u64, limit.rough_share))
    });
    let voids = voids_in_words(mesh.dem.void_count(), mesh.dem.rect().post_count());
    format!("{points} points, {triangles} triangles in {seconds:.1} s: {end}\nresidual: {residual}\n{eta}{voids}")
}

/// What a person should know of posts without a height; nothing where there are none.
fn voids_in_words(voids: usize, posts: usize) -> String {
    if voids == 0 {
        return String::new();
    }
    let share = 100.0 * voids as f64 / posts as f64;
    let (voids, posts) = (grouped(voids as u64), grouped(posts as u64));
    format!("voids: {voids} of {posts} posts ({share:.1} %), over which the mesh has holes\n")
}
