//! `tiefort compare`: the founding paper's Table 1 on any DEM.

use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;
use std::time::Instant;

use build::workbench::{
    CompareEvent, CompareGround, CompareMethod, CompareRequest, CompareRow, Comparison, Equivalent, HeldGround, Made,
};
use clap::Args;
use job::{Job, StartMethod};
use serde_json::{Value, json};
use terrain::{Post, PostRect};
use views::{Align, Facets, Image, Look, Panel, Style, Surface, Table, draw_panels, fold, grouped};

use crate::arguments::{Format, start_method};
use crate::commands::tin::without_job;
use crate::failure::{Failure, Outcome};
use crate::new_folder::NewFolder;
use crate::signals::Signals;
use crate::{files, terminal};

const AFTER_HELP: &str = "\
Examples:
  tiefort compare dem.tif
  tiefort compare dem.tif --window 648,481,376x460 --points 2500,5000
  tiefort compare dem.tif --methods vip,iterative --points 5000 --format json
  tiefort compare dem.tif --methods vip,iterative --start vip:1000,highlow
  tiefort compare dem.tif --pictures figures
  tiefort compare mine.toml        on the raster of a job, cut to its area

Methods:
  vip            very important points, every post of the border first (Chen and
                 Guevara); vip-vertical, vip-corners and vip-extend are variants
  highlow        peaks and pits, whose number is the ground's; highlow-plateau
  lattice        a grid of every 16th post, then the worst post of each failing
                 triangle (LATTICETIN)
  fowler-little  ridges and channels, then the worst posts (Fowler and Little)
  hierarchical   triangles split into three (De Floriani); hierarchical-best
  earlier        one post for each region of residuals, edges along the ground
                 (Polis and McKeown, 1992)
  regular        the densest regular grid of so many points; simnet: every 125 m;
                 simnet-best
  contour        contour lines as edges
  iterative      the founding paper's
  optimised      that of tiefort

Equivalent points of a method: the fewest with which the iterative TIN has a
smaller RMS residual. All methods work on the raster's own posts and see no
importance; all points count, corners too.";

/// Most numbers of points in one table.
const NUMBERS_MAX: usize = 20;

/// Arguments of `compare`.
#[derive(Args)]
#[command(after_help = AFTER_HELP)]
pub struct Arguments {
    /// A raster of heights, or a job file
    #[arg(value_name = "DEM|JOB.toml")]
    ground: PathBuf,
    /// Methods by name, with commas [default: vip to optimised, highlow, simnet]
    #[arg(long, value_name = "NAMES", value_delimiter = ',', value_parser = method)]
    methods: Vec<CompareMethod>,
    /// Improve what other methods make: the iterative method from so many points of each, with commas
    #[arg(long, value_name = "METHOD:N", value_delimiter = ',', value_parser = start_method)]
    start: Vec<(StartMethod, Option<usize>)>,
    /// Numbers of points, with commas
    #[arg(long, value_name = "N,N", value_delimiter = ',', default_value = "2500,5000",
          value_parser = clap::value_parser!(u32).range(4..))]
    points: Vec<u32>,
    /// Only these posts: the south-western one, then how many
    #[arg(long, value_name = "ROW,COL,ROWSxCOLUMNS", value_parser = window)]
    window: Option<PostRect>,
    /// Coordinate system of a raster that names none [default: metres in a plane]
    #[arg(long, value_name = "EPSG:CODE")]
    crs: Option<String>,
    /// Draw the ground and every TIN from one eye, shaded and as wires, into a new folder
    #[arg(long, value_name = "DIR")]
    pictures: Option<PathBuf>,
    /// For a person or a program
    #[arg(long, value_enum, default_value_t = Format::Text)]
    format: Format,
    /// Print the table and errors only
    #[arg(long)]
    quiet: bool,
}

fn method(name: &str) -> Result<CompareMethod, String> {
    let found = CompareMethod::NAMED.iter().find(|(known, _)| *known == name).map(|&(_, method)| method);
    let names = || CompareMethod::NAMED.map(|(name, _)| name).join(", ");
    found.ok_or_else(|| format!("expected one of {}", names()))
}

fn window(text: &str) -> Result<PostRect, String> {
    let read = || {
        let (place, size) = text.rsplit_once(',')?;
        let (row, col) = place.split_once(',')?;
        let (rows, cols) = size.split_once('x')?;
        let number = |text: &str| text.parse::<i32>().ok().filter(|number| (0..=1 << 30).contains(number));
        let (low, size) = ((number(row)?, number(col)?), (number(rows)?, number(cols)?));
        let is_any = 0 < size.0 && 0 < size.1;
        let high = Post::new(low.0.checked_add(size.0)? - 1, low.1.checked_add(size.1)? - 1);
        is_any.then(|| PostRect::new(Post::new(low.0, low.1), high))
    };
    read().ok_or_else(|| "expected ROW,COL,ROWSxCOLUMNS, such as 648,481,376x460; row 0 is the southern one".into())
}

/// Compares.
pub fn run(arguments: &Arguments) -> Result<Outcome, Failure> {
    let signals = Signals::watch()?;
    let found = compared(arguments, request(arguments)?, signals.stop());
    let (found, seconds) = found.map_err(|failure| failure.after(signals.exit_code()))?;
    arguments.format.print(|| text(&found, &seconds), || to_json(&found, &seconds))?;
    Ok(Outcome::Sound)
}

/// The comparison for a program; on `ground` instead of what the arguments name, where it is in memory.
///
/// # Errors
/// When the ground cannot be used, or no method can make what was asked for.
pub fn json_text(arguments: &Arguments, ground: Option<HeldGround>, stop: &AtomicBool) -> Result<String, Failure> {
    let mut request = request(arguments)?;
    if let Some(held) = ground {
        request.ground = CompareGround::Held(held);
    }
    let (found, seconds) = compared(arguments, request, stop)?;
    Ok(to_json(&found, &seconds).to_string())
}

/// The comparison, and what each row took; pictures are drawn where they are wanted.
fn compared(
    arguments: &Arguments,
    request: CompareRequest,
    stop: &AtomicBool,
) -> Result<(Comparison, Vec<f64>), Failure> {
    arguments.pictures.as_deref().map_or(Ok(()), NewFolder::check)?;
    let mut watch = Watch { quiet: arguments.quiet, names: Vec::new(), began: Instant::now(), seconds: Vec::new() };
    watch.names = names(&request);
    let is_job = matches!(request.ground, CompareGround::Job(_));
    let found = build::workbench::compare(&request, stop, &mut |event| watch.hear(event)).map_err(Failure::from);
    let found = found.map_err(|failure| if is_job { failure } else { without_job(failure) })?;
    refuse_all(&found)?;
    if let Some(folder) = &arguments.pictures {
        draw(&found, NewFolder::begin(folder)?)?;
    }
    Ok((found, watch.seconds))
}

fn request(arguments: &Arguments) -> Result<CompareRequest, Failure> {
    if NUMBERS_MAX < arguments.points.len() {
        let message = format!("--points: {} numbers, expected at most {NUMBERS_MAX}", arguments.points.len());
        return Err(Failure::new(message, "compare in several runs"));
    }
    let ground = match files::extension(&arguments.ground).as_str() {
        "toml" => CompareGround::Job(Box::new(load(&arguments.ground)?)),
        _ => CompareGround::Raster { path: arguments.ground.clone(), crs: arguments.crs.clone() },
    };
    let mut points: Vec<usize> = arguments.points.iter().map(|&points| points as usize).collect();
    points.dedup();
    let is_chosen = !arguments.methods.is_empty();
    let mut methods = if is_chosen { arguments.methods.clone() } else { CompareMethod::usual() };
    methods.extend(arguments.start.iter().map(|&(start, points)| CompareMethod::IterativeFrom(start, points)));
    methods.dedup();
    Ok(CompareRequest { ground, window: arguments.window, methods, points, strict: is_chosen })
}

fn load(path: &Path) -> Result<Job, Failure> {
    Ok(Job::load_with(path, &build::ground::find_area)?)
}

/// When no method could make the points it was asked for, that is an error.
fn refuse_all(found: &Comparison) -> Result<(), Failure> {
    let mut asked = found.rows.iter().filter(|row| row.asked.is_some());
    let first = asked.clone().find_map(|row| row.made.as_ref().err());
    match first {
        Some(why) if asked.all(|row| row.made.is_err()) => Err(Failure::new(why.to_string(), why.hint.clone())),
        _ => Ok(()),
    }
}

/// Draws the paper's figures 1 to 12: each TIN beside the ground under one light, and its triangles as wires.
fn draw(found: &Comparison, folder: NewFolder) -> Result<(), Failure> {
    const WIDE: usize = 900;
    const FROM_SOUTH_WEST: f64 = 45.0;
    const TIMES: f64 = 2.0;
    let spacing_m = [found.spacing_m; 2];
    let dem = || Panel { label: "DEM".into(), surface: Surface::Posts(&found.dem, spacing_m, &[]) };
    let look = Look::overlooking(&dem().surface, FROM_SOUTH_WEST, TIMES, WIDE);
    let put = |name: String, image: &Image| {
        let mut bytes = Vec::new();
        image.write_png(&mut bytes).and_then(|()| folder.put(&name, &bytes)).map_err(|source| {
            let hint = "check that its folder is writable and has room";
            Failure::new(format!("{name}: cannot be written: {source}"), hint)
        })
    };
    for row in &found.rows {
        let Ok(made) = &row.made else { continue };
        let facets = Facets::of_tin(&made.tin, spacing_m);
        let (name, points) = (row.method.name(), grouped(made.points as u64));
        let label = format!("{name}, {points} points, RMS residual {:.2} m", made.residual.rms_m());
        let tin = || Panel { label: label.clone(), surface: Surface::Triangles(&facets) };
        let ground = Path::new(&found.ground).file_name().map_or("", |file| file.to_str().unwrap_or(""));
        let (title, eye) = (format!("{ground}: {name}"), "From the south-west");
        let shaded = draw_panels(&title, eye, &[dem(), tin()], Style::Shaded, &look);
        let file = name.replace([' ', ':'], "-");
        put(format!("{file}-{}.png", made.points), &shaded)?;
        let wires = draw_panels(&title, eye, &[tin()], Style::Wireframe, &look);
        put(format!("{file}-{}-wires.png", made.points), &wires)?;
    }
    folder.finish()
}

/// Tells of each row as it is done, and keeps its time.
struct Watch {
    quiet: bool,
    names: Vec<String>,
    began: Instant,
    seconds: Vec<f64>,
}

impl Watch {
    fn hear(&mut self, event: CompareEvent) {
        match event {
            CompareEvent::Read(rows) => {
                self.seconds = vec![0.0; rows];
                self.tell(&format!("read, {rows} rows to make"));
            }
            CompareEvent::Started(_) => self.began = Instant::now(),
            CompareEvent::Done(row) => {
                self.seconds[row] = self.began.elapsed().as_secs_f64();
                let line = format!(
                    "{:>3} of {}  {:<28}{:>8.2} s",
                    row + 1,
                    self.seconds.len(),
                    self.names[row],
                    self.seconds[row]
                );
                self.tell(&line);
            }
            CompareEvent::Equivalents => self.tell("equivalent points"),
        }
    }

    fn tell(&self, line: &str) {
        if !self.quiet {
            terminal::tell(line);
        }
    }
}

/// What each row will be, for progress.
fn names(request: &CompareRequest) -> Vec<String> {
    let by_points = request.points.iter().flat_map(|&points| {
        let takes = request.methods.iter().filter(|method| method.takes_points());
        takes.map(move |method| format!("{}, {} points", method.name(), grouped(points as u64)))
    });
    let fixed = request.methods.iter().filter(|method| !method.takes_points()).map(|method| method.name());
    by_points.chain(fixed).collect()
}

fn text(found: &Comparison, seconds: &[f64]) -> String {
    use Align::{Left, Right};
    let mut table = Table::new(&[Left, Right, Right, Right, Right, Right, Right, Right]);
    table.row(["method", "points", "triangles", "RMS m", "max m", "mean m", "equivalent", "s"]);
    for (row, seconds) in found.rows.iter().zip(seconds) {
        if let Ok(made) = &row.made {
            table.row(cells(row.method, made, *seconds));
        }
    }
    let (rows, cols) = found.size;
    let posts = match (rows * cols) as u64 - found.posts {
        0 => format!("{} posts", grouped(found.posts)),
        voids => format!("{} posts, {} more without a height", grouped(found.posts), grouped(voids)),
    };
    let head =
        format!("Methods on {}: {rows} rows, {cols} columns, {posts}, {} m apart", found.ground, found.spacing_m);
    let notes: String = found.rows.iter().filter_map(|row| note(row, found.posts)).collect();
    let gap = if notes.is_empty() { "" } else { "\n" };
    fold(&format!("{head}\n\n{}{gap}{notes}", table.text(0)), 2)
}

fn cells(method: CompareMethod, made: &Made, seconds: f64) -> [String; 8] {
    let residual = &made.residual;
    [
        method.name(),
        grouped(made.points as u64),
        grouped(made.triangles as u64),
        format!("{:.3}", residual.rms_m()),
        format!("{:.1}", residual.max_m()),
        format!("{:.3}", residual.mean_abs_m()),
        match made.equivalent {
            Equivalent::Points(points) => grouped(points as u64),
            Equivalent::MoreThan(points) => format!("> {}", grouped(points as u64)),
            Equivalent::None => "-".into(),
        },
        format!("{seconds:.2}"),
    ]
}

/// What the table cannot say of a row.
fn note(row: &CompareRow, posts: u64) -> Option<String> {
    let name = row.method.name();
    let made = match &row.made {
        Ok(made) => made,
        Err(why) => return Some(format!("{name}: {why}\n  hint: {}\n", why.hint)),
    };
    if let Some(forced) = made.forced {
        let (points, left) = (made.points as u64, made.points as u64 - forced.points as u64);
        let iterative = match forced.iterative_rms_m {
            Some(rms_m) => format!("the iterative method with the other {} has RMS {rms_m:.3} m", grouped(left)),
            None => "no fewer can be compared".to_owned(),
        };
        let (forced, points) = (grouped(forced.points as u64), grouped(points));
        return Some(format!("{name}: {forced} of its {points} points are the border; {iterative}\n"));
    }
    let percent = 100.0 * made.covered as f64 / posts as f64;
    let covers = format!("covers {} of {} posts ({percent:.1} %)", grouped(made.covered), grouped(posts));
    (made.covered < posts).then(|| format!("{name}: {covers}; its residuals are theirs, so they are not comparable\n"))
}

fn to_json(found: &Comparison, seconds: &[f64]) -> Value {
    let rows: Vec<Value> = found.rows.iter().zip(seconds).map(|(row, &seconds)| row_json(row, seconds)).collect();
    json!({
        "ground": found.ground,
        "rows_of_posts": found.size.0,
        "columns_of_posts": found.size.1,
        "spacing_m": found.spacing_m,
        "posts": found.posts,
        "rows": rows,
    })
}

fn row_json(row: &CompareRow, seconds: f64) -> Value {
    let made = match &row.made {
        Ok(made) => made,
        Err(why) => {
            let refused = json!({ "found": why.found, "expected": why.expected, "hint": why.hint });
            return json!({ "method": row.method.name(), "asked": row.asked, "refused": refused });
        }
    };
    let (equivalent, more_than) = match made.equivalent {
        Equivalent::Points(points) => (Some(points), None),
        Equivalent::MoreThan(points) => (None, Some(points)),
        Equivalent::None => (None, None),
    };
    json!({
        "method": row.method.name(),
        "asked": row.asked,
        "points": made.points,
        "triangles": made.triangles,
        "covered": made.covered,
        "rms_m": made.residual.rms_m(),
        "max_m": made.residual.max_m(),
        "mean_abs_m": made.residual.mean_abs_m(),
        "equivalent_points": equivalent,
        "equivalent_points_more_than": more_than,
        "border_points": made.forced.map(|forced| forced.points),
        "iterative_rms_m_without_border_points": made.forced.and_then(|forced| forced.iterative_rms_m),
        "seconds": seconds,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_window_is_its_south_western_post_and_its_size() {
        assert_eq!(window("648,481,376x460"), Ok(PostRect::new(Post::new(648, 481), Post::new(1023, 940))));
        for wrong in ["", "1,2", "1,2,3", "1,2,0x4", "-1,2,3x4", "1,2,3x4x5", "1,2,3x99999999999"] {
            assert!(window(wrong).is_err(), "{wrong:?} was read");
        }
    }

    #[test]
    fn every_method_is_found_by_its_name_and_others_are_not() {
        for (name, found) in CompareMethod::NAMED {
            assert!(method(name) == Ok(found) && found.name() == name);
        }
        assert!(method("vpi").unwrap_err().contains("vip"));
        assert_eq!(CompareMethod::usual().len(), 11);
    }
}
