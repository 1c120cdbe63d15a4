//! `tiefort sight`: what is seen from a place.

use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

use clap::Args;
use exports::{ByteRaster, write_byte_raster};
use load_module_reader::{
    Curvature, Eye, Hider, LoadedGround, Look, PastObjects, SEEN, Sight, Standing, TerrainModule, Viewshed,
};
use schedule::Workers;
use terrain::Spacing;
use views::{SeenGround, draw_seen, fold, grouped};

use crate::arguments::{self, positive};
use crate::contents::Opened;
use crate::failure::{Failure, Outcome};
use crate::{files, places, terminal};

const AFTER_HELP: &str = "\
Examples:
  tiefort sight ntc.tdb --from 530000,3899000,2.5 --to 532000,3898000,2
  tiefort sight ntc.tdb --from 530000,3899000,2.5 --range 5 --out seen.tif
  tiefort sight ntc.tdb --from 530000,3899000,30 --range 20 --target 2 \\
      --curvature --out seen.png

With --to: whether one place sees the other, what stands in the way first, and
how far the line stays above the ground. With --range: every place around it,
as a GeoTIFF (1 seen, 0 hidden, 255 not looked at) or as a picture. Where woods
are looked at, a second band tells the per cent of the light that they leave.

Heights of both ends are metres above the ground. Decks of bridges hide what is
behind them, as ground does, and so do buildings and walls where the database
has some ([objects] of its job); woods take light away, and what less than half
of it reaches is hidden. --objects none leaves all of that out. Over holes of
the DEM the ground is the surface that closes them.

Exit codes: 0, whatever is seen; 2 for what cannot be looked at.";

/// Places of a viewshed up to which one is made, and drawn.
const PLACES_MAX: u64 = 1 << 28;
/// See [`PLACES_MAX`].
const PIXELS_MAX: u64 = 1 << 24;
/// Rows that one worker looks at in one go.
const ROWS_AT_ONCE: usize = 16;

/// Arguments of `sight`.
#[derive(Args)]
#[command(after_help = AFTER_HELP)]
pub struct Arguments {
    /// Folder of the terrain database
    #[arg(value_name = "DIR")]
    database: PathBuf,
    /// The eye: east, north, and metres above the ground
    #[arg(long, value_name = "E,N,H", value_parser = places::place_above, allow_hyphen_values = true)]
    from: [f64; 3],
    /// The place looked at: east, north, and metres above the ground
    #[arg(long, value_name = "E,N,H", value_parser = places::place_above, allow_hyphen_values = true,
        conflicts_with_all = ["range", "out", "target", "spacing"], required_unless_present = "range")]
    to: Option<[f64; 3]>,
    /// How far the eye looks in every direction
    #[arg(long, value_name = "KM", value_parser = positive, requires = "out")]
    range: Option<f64>,
    /// Metres above the ground of what it looks at [default: 0]
    #[arg(long, value_name = "M", value_parser = above_ground)]
    target: Option<f64>,
    /// Metres between places that it looks at, a multiple of 1/16 m [default: 25]
    #[arg(long, value_name = "M", value_parser = positive)]
    spacing: Option<f64>,
    /// Let the earth fall away as it does; maps leave that out
    #[arg(long)]
    curvature: bool,
    /// With --curvature: how far air bends light, as a part of the earth's own [default: 0.13]
    #[arg(long, value_name = "K", value_parser = refraction, requires = "curvature")]
    refraction: Option<f64>,
    /// What stands on the ground and is looked at: none, buildings (with walls), or all
    #[arg(long, value_name = "WHICH", value_parser = places::standing, default_value = "all")]
    objects: Standing,
    /// With --range: whether what it looks at stands on the ground or on roofs
    #[arg(long, value_name = "WHERE", value_parser = ["ground", "roof"], default_value = "ground",
        conflicts_with = "to")]
    target_on: String,
    /// The GeoTIFF or picture to write
    #[arg(long, value_name = "FILE.tif|png", requires = "range")]
    out: Option<PathBuf>,
    #[command(flatten)]
    workers: arguments::Workers,
}

fn above_ground(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(number) if (0.0..=places::ABOVE_M_MAX).contains(&number) => Ok(number),
        _ => Err("expected 0 to 1000000".into()),
    }
}

fn refraction(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(number) if (0.0..1.0).contains(&number) => Ok(number),
        _ => Err("expected a number from 0 to less than 1, such as 0.13".into()),
    }
}

/// Looks.
pub fn run(arguments: &Arguments) -> Result<Outcome, Failure> {
    let database = Opened::open(&arguments.database)?;
    let curvature = if arguments.curvature {
        Curvature::of_earth(arguments.refraction.unwrap_or(places::REFRACTION))
    } else {
        Curvature::NONE
    };
    match (arguments.to, arguments.range, &arguments.out) {
        (Some(to), ..) => line(arguments, &database, to, curvature),
        (None, Some(range_km), Some(out)) => around(arguments, &database, 1000.0 * range_km, out, curvature),
        // The arguments say that one of them is there.
        (None, ..) => Err(Failure::new("found neither --to nor --range with --out", "see `tiefort sight --help`")),
    }
}

/// An end of a line of sight, as a height above the vertical datum.
fn end(name: &str, [east, north, above]: [f64; 3], ground: &LoadedGround) -> Result<[f64; 3], Failure> {
    let height_m =
        ground.height_m([east, north]).ok_or_else(|| places::outside(name, [east, north], ground.frame()))?;
    Ok([east, north, height_m + above])
}

/// Whether one place sees another.
fn line(arguments: &Arguments, database: &Opened, to: [f64; 3], curvature: Curvature) -> Result<Outcome, Failure> {
    let plan = |place: [f64; 3]| [place[0], place[1]];
    let ends_m = [plan(arguments.from), plan(to)];
    // A place far outside must not ask for all that lies between.
    for (name, place_m) in ["--from", "--to"].into_iter().zip(ends_m) {
        if !database.area.frame().holds(place_m) {
            return Err(places::outside(name, place_m, database.area.frame()));
        }
    }
    let ground = database.load(places::block_around(&database.area, &ends_m, 0.0)?)?;
    let (from, to) = (end("--from", arguments.from, &ground)?, end("--to", to, &ground)?);
    let run = [0, 1, 2].map(|axis| to[axis] - from[axis]);
    let length_m = (run[0] * run[0] + run[1] * run[1]).sqrt();
    let past = PastObjects { standing: arguments.objects, ..PastObjects::all(curvature) };
    let sighting = ground.sight_past(from, to, &past);
    let by = sighting.by.map_or("ground", Hider::name);
    let seen = match sighting.sight {
        Sight::Free => "visible".to_owned(),
        Sight::Unknown => "unknown: the line leaves the area".to_owned(),
        Sight::Hidden(at) => format!(
            "hidden by {by}, first {:.1} m from the eye, at {:.1},{:.1}",
            at * length_m,
            from[0] + at * run[0],
            from[1] + at * run[1]
        ),
    };
    let mut text = format!("{seen}\n");
    text += &format!("eye        {:.1},{:.1} at {:.2} m\n", from[0], from[1], from[2]);
    text += &format!("target     {:.1},{:.1} at {:.2} m\n", to[0], to[1], to[2]);
    text += &format!("distance   {length_m:.1} m\n");
    if let Some(clearance_m) = ground.clearance_over_m(from, to, curvature) {
        text += &format!("clearance  {clearance_m:.2} m above the ground at least\n");
    }
    if 0.0 < sighting.wood_m {
        let (metres, left) = (sighting.wood_m, 100.0 * sighting.transmission);
        text += &format!("woods      {metres:.1} m inside, which leave {left:.0} % of the light\n");
    }
    let at = |part: f64| [0, 1].map(|axis| from[axis] + part * run[axis]);
    let hider = if let Sight::Hidden(part) = sighting.sight { Some(("what hides it", at(part))) } else { None };
    for (what, place_m) in [("the eye", at(0.0)), ("the target", at(1.0))].into_iter().chain(hider) {
        text += &over_hole(what, place_m, &ground);
    }
    terminal::print(&text)?;
    Ok(Outcome::Sound)
}

/// A line for what lies over a hole of the DEM.
fn over_hole(what: &str, place_m: [f64; 2], ground: &LoadedGround) -> String {
    let is_over = ground.sample(place_m).is_some_and(|sample| sample.class == terrain::HOLE_CLASS);
    if is_over {
        format!("note       {what} lies over a hole of the DEM, the ground of which is made up\n")
    } else {
        String::new()
    }
}

/// What is written.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Kind {
    Tiff,
    Png,
}

fn kind_of(out: &Path) -> Result<Kind, Failure> {
    match files::extension(out).as_str() {
        "tif" | "tiff" => Ok(Kind::Tiff),
        "png" => Ok(Kind::Png),
        _ => Err(Failure::new(
            format!("--out: found {}, expected a name that ends in .tif or .png", out.display()),
            "a GeoTIFF is for maps and programs, a PNG to look at",
        )),
    }
}

/// Every place around the eye.
fn around(
    arguments: &Arguments,
    database: &Opened,
    range_m: f64,
    out: &Path,
    curvature: Curvature,
) -> Result<Outcome, Failure> {
    const SPACING_M: f64 = 25.0;
    let kind = kind_of(out)?;
    let [east, north, eye_m] = arguments.from;
    let spacing_m = arguments.spacing.unwrap_or(SPACING_M);
    let spacing = Spacing::from_metres(spacing_m).ok_or_else(|| {
        Failure::new(format!("--spacing: found {spacing_m}, expected a multiple of 1/16 m"), "such as 25 or 12.5")
    })?;
    let target_m = arguments.target.unwrap_or(0.0);
    let viewshed = Viewshed {
        place_m: [east, north],
        eye_m,
        target_m,
        range_m,
        spacing_m,
        curvature,
        standing: arguments.objects,
        is_on_roofs: arguments.target_on == "roof",
    };
    let most = if kind == Kind::Png { PIXELS_MAX } else { PLACES_MAX };
    let side = viewshed.side();
    if most < side.saturating_mul(side) {
        let message = format!("found {side} x {side} places to look at, expected {} at most", grouped(most));
        return Err(Failure::new(message, "ask for a larger --spacing or a smaller --range"));
    }
    files::check_writable(out)?;
    let ground = database.load(places::block_around(&database.area, &[[east, north]], range_m)?)?;
    let eye = viewshed.eye(&ground).ok_or_else(|| places::outside("--from", [east, north], database.area.frame()))?;
    let looks = Looks { viewshed, ground: &ground, eye, workers: Workers::new(arguments.workers.count()) };
    let seen = match kind {
        Kind::Tiff => write_tiff(&looks, spacing, out)?,
        Kind::Png => write_png(&looks, out)?,
    };
    terminal::print(&(told(&looks, &seen, out) + &over_hole("the eye", [east, north], &ground)))?;
    Ok(Outcome::Sound)
}

/// What looks.
struct Looks<'a> {
    viewshed: Viewshed,
    ground: &'a LoadedGround,
    eye: Eye<'a>,
    workers: Workers,
}

/// Places that were looked at, and of the ground around them what was looked at and what is seen, in cells: at the
/// border of the area a place stands for the part of its cell inside.
#[derive(Default)]
struct Count {
    places: u64,
    cells: f64,
    seen: f64,
}

impl Looks<'_> {
    /// Rows of the viewshed, both included, counted from the north.
    fn rows(&self, first: usize, last: usize, count: &mut Count) -> Vec<Look> {
        let pieces = (last + 1 - first).div_ceil(ROWS_AT_ONCE);
        let found = Mutex::new(vec![Vec::new(); pieces]);
        self.workers.each()(pieces, &|piece| {
            let start = first + piece * ROWS_AT_ONCE;
            let rows = start..=(start + ROWS_AT_ONCE - 1).min(last);
            let mut eye = self.eye.clone();
            let looks = rows.flat_map(|row| self.viewshed.row(self.ground, &mut eye, row as u64)).collect();
            found.lock().unwrap_or_else(PoisonError::into_inner)[piece] = looks;
        });
        let rows = found.into_inner().unwrap_or_else(PoisonError::into_inner).concat();
        let side = self.viewshed.side() as usize;
        for (at, look) in rows.iter().enumerate().filter(|(_, look)| look.seen <= SEEN) {
            let cell = self.cell_inside([at % side, side - 1 - first - at / side]);
            count.places += 1;
            count.cells += cell;
            count.seen += if look.seen == SEEN { cell } else { 0.0 };
        }
        rows
    }

    /// The part inside the area of the cell around a place, columns from the west and rows from the south.
    fn cell_inside(&self, number: [usize; 2]) -> f64 {
        let (frame, step_m) = (self.ground.frame(), self.viewshed.spacing_m);
        let counts = [frame.cols, frame.rows];
        let part = |axis: usize| {
            let middle = self.corner()[axis] + number[axis] as f64 * step_m - frame.origin_m[axis];
            let end = f64::from(counts[axis]) * frame.side_m();
            ((middle + step_m / 2.0).min(end) - (middle - step_m / 2.0).max(0.0)) / step_m
        };
        part(0).max(0.0) * part(1).max(0.0)
    }

    /// Whether there are woods, and they are looked at.
    fn has_woods(&self) -> bool {
        let has_some = |module: &Arc<TerrainModule>| !module.module().objects.canopies.is_empty();
        self.viewshed.standing == Standing::All && self.ground.modules().iter().any(has_some)
    }

    /// South-western place.
    fn corner(&self) -> [f64; 2] {
        let reach_m = f64::from(self.viewshed.reach()) * self.viewshed.spacing_m;
        self.viewshed.place_m.map(|middle| middle - reach_m)
    }
}

fn write_tiff(looks: &Looks, spacing: Spacing, out: &Path) -> Result<Count, Failure> {
    let crs = &looks.ground.frame().crs;
    let epsg = crs.strip_prefix("EPSG:").and_then(|code| code.parse().ok()).ok_or_else(|| {
        Failure::new(
            format!("{}: found the coordinate system {crs:?}, expected one with an EPSG code", out.display()),
            "a GeoTIFF names its system by EPSG code; write a .png instead",
        )
    })?;
    let side = looks.viewshed.side() as usize;
    let bands = if looks.has_woods() { 2 } else { 1 };
    let raster = ByteRaster { origin_m: looks.corner(), spacing, size: [side, side], epsg, bands };
    let mut count = Count::default();
    let mut numbers = |first, last| {
        let rows = looks.rows(first, last, &mut count);
        rows.iter().flat_map(|look| [look.seen, look.light]).step_by(3 - usize::from(bands)).collect()
    };
    files::write_whole(out, |out| write_byte_raster(out, &raster, &mut numbers))?;
    Ok(count)
}

fn write_png(looks: &Looks, out: &Path) -> Result<Count, Failure> {
    let side = looks.viewshed.side() as usize;
    let mut count = Count::default();
    let rows = looks.rows(0, side - 1, &mut count);
    let seen: Vec<Option<bool>> = rows.iter().map(|look| (look.seen <= SEEN).then_some(look.seen == SEEN)).collect();
    let ([west, south], step_m) = (looks.corner(), looks.viewshed.spacing_m);
    let place = |at: usize| [west + (at % side) as f64 * step_m, south + (side - 1 - at / side) as f64 * step_m];
    let height = |at: usize| looks.ground.height_m(place(at)).map_or(f32::NAN, |height_m| height_m as f32);
    let heights: Vec<f32> = (0..side * side).map(height).collect();
    let image = draw_seen(&SeenGround { side, spacing_m: step_m, height_m: &heights, seen: &seen });
    files::write_whole(out, |out| image.write_png(out))?;
    Ok(count)
}

fn told(looks: &Looks, count: &Count, out: &Path) -> String {
    let Viewshed { place_m: [east, north], eye_m, target_m, range_m, spacing_m, .. } = looks.viewshed;
    let km2 = |cells: f64| cells * spacing_m * spacing_m / 1e6;
    let share = if 0.0 < count.cells { 100.0 * count.seen / count.cells } else { 0.0 };
    let text = format!(
        "seen from {east},{north}, {eye_m} m above the ground: {share:.1} % of {:.2} km2, or {:.2} km2 of what stands \
         {target_m} m above the ground, by {} places {spacing_m} m apart within {} km; in {}",
        km2(count.cells),
        km2(count.seen),
        grouped(count.places),
        range_m / 1000.0,
        out.display()
    );
    fold(&text, 0) + "\n"
}
