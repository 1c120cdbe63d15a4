//! `tiefort profile`: the ground along a line.

use std::fmt::Write;
use std::path::PathBuf;

use clap::{Args, ValueEnum};
use load_module_reader::ProfilePoint;
use serde_json::json;
use views::grouped;

use crate::arguments::positive;
use crate::contents::Opened;
use crate::failure::{Failure, Outcome};
use crate::{places, terminal};

const AFTER_HELP: &str = "\
Examples:
  tiefort profile ntc.tdb 530000,3899000 534000,3897000
  tiefort profile ntc.tdb 530000,3899000 534000,3897000 536000,3897000 \\
      --spacing 5 --format csv > line.csv

Goes straight from place to place; a `--` goes before places that begin with a
minus. Heights are those of the ground; decks of
bridges are in columns of their own. In Python: Database.profile, which answers
the same.";

/// Places along a line at most.
const PLACES_MAX: f64 = 1e7;
/// Columns and lines of the drawing.
const DRAWN: [usize; 2] = [68, 14];

/// Arguments of `profile`.
#[derive(Args)]
#[command(after_help = AFTER_HELP)]
pub struct Arguments {
    /// Folder of the terrain database
    #[arg(value_name = "DIR")]
    database: PathBuf,
    /// Places to go through, two or more: east and north in metres
    #[arg(value_name = "E,N", required = true, num_args = 2.., value_parser = places::place)]
    places: Vec<[f64; 2]>,
    /// Metres between heights at most
    #[arg(long, value_name = "M", value_parser = positive, default_value = "10")]
    spacing: f64,
    /// For a person or a program
    #[arg(long, value_enum, default_value_t = Format::Text)]
    format: Format,
}

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Format {
    /// A drawing and figures
    Text,
    /// A line for each place
    Csv,
    /// One object
    Json,
}

/// Measures it.
pub fn run(arguments: &Arguments) -> Result<Outcome, Failure> {
    let database = Opened::open(&arguments.database)?;
    let area = &database.area;
    for &place_m in &arguments.places {
        if !area.frame().holds(place_m) {
            return Err(places::outside("E,N", place_m, area.frame()));
        }
    }
    let length_m: f64 = arguments.places.windows(2).map(|ends| distance(ends[0], ends[1])).sum();
    if PLACES_MAX < length_m / arguments.spacing {
        let most = grouped(PLACES_MAX as u64);
        let found = format!("--spacing: found {} m on a line of {length_m:.0} m", arguments.spacing);
        let hint = "ask for a larger spacing or a shorter line";
        return Err(Failure::new(format!("{found}, expected {most} places at most"), hint));
    }
    let ground = database.load(places::block_around(area, &arguments.places, 0.0)?)?;
    let points = ground.profile(&arguments.places, arguments.spacing);
    terminal::print(&match arguments.format {
        Format::Text => text(&points),
        Format::Csv => csv(&points),
        Format::Json => format!("{:#}\n", of_points(&points)),
    })?;
    Ok(Outcome::Sound)
}

fn distance(a: [f64; 2], b: [f64; 2]) -> f64 {
    ((b[0] - a[0]) * (b[0] - a[0]) + (b[1] - a[1]) * (b[1] - a[1])).sqrt()
}

fn csv(points: &[ProfilePoint]) -> String {
    let mut text = String::from("along_m,east_m,north_m,height_m,deck_m,class\n");
    for point in points {
        let number = |height: Option<f64>| height.map_or_else(String::new, |height| format!("{height:.4}"));
        let class = point.class.map_or_else(String::new, |class| class.to_string());
        let [east, north] = point.place_m;
        let (height, deck) = (number(point.height_m), number(point.deck_m));
        // Writing into a text cannot go wrong.
        let _ = writeln!(text, "{:.3},{east:.3},{north:.3},{height},{deck},{class}", point.along_m);
    }
    text
}

fn of_points(points: &[ProfilePoint]) -> serde_json::Value {
    json!({ "points": points.iter().map(|point| json!({
        "along_m": point.along_m,
        "place_m": point.place_m,
        "height_m": point.height_m,
        "deck_m": point.deck_m,
        "class": point.class,
    })).collect::<Vec<_>>() })
}

/// What a profile comes to.
struct Figures {
    length_m: f64,
    low_m: f64,
    high_m: f64,
    climb_m: f64,
    fall_m: f64,
    steepest_percent: f64,
}

fn figures(points: &[ProfilePoint]) -> Option<Figures> {
    let heights = || points.iter().filter_map(|point| point.height_m);
    let mut found = Figures {
        length_m: points.last()?.along_m,
        low_m: heights().reduce(f64::min)?,
        high_m: heights().reduce(f64::max)?,
        climb_m: 0.0,
        fall_m: 0.0,
        steepest_percent: 0.0,
    };
    for pair in points.windows(2) {
        let (Some(from), Some(to)) = (pair[0].height_m, pair[1].height_m) else { continue };
        found.climb_m += (to - from).max(0.0);
        found.fall_m += (from - to).max(0.0);
        let run_m = pair[1].along_m - pair[0].along_m;
        if 0.0 < run_m {
            found.steepest_percent = found.steepest_percent.max(100.0 * (to - from).abs() / run_m);
        }
    }
    Some(found)
}

fn text(points: &[ProfilePoint]) -> String {
    let Some(found) = figures(points) else { return "no ground along the line\n".into() };
    let mut text = drawing(points, &found);
    for (name, value) in [
        ("length", format!("{:.1} m", found.length_m)),
        ("height", format!("{:.2} to {:.2} m", found.low_m, found.high_m)),
        ("climb, fall", format!("{:.1} m, {:.1} m", found.climb_m, found.fall_m)),
        ("steepest", format!("{:.1} % between two heights", found.steepest_percent)),
        ("heights", grouped(points.len() as u64)),
    ] {
        let _ = writeln!(text, "{name:<12}{value}");
    }
    text
}

/// The ground as a terminal shows it, its highest place at the top.
fn drawing(points: &[ProfilePoint], found: &Figures) -> String {
    let [columns, lines] = DRAWN;
    let rise_m = (found.high_m - found.low_m).max(1e-9);
    let mut tops = vec![None::<f64>; columns];
    for point in points {
        let share = if found.length_m == 0.0 { 0.0 } else { point.along_m / found.length_m };
        let column = ((share * columns as f64) as usize).min(columns - 1);
        tops[column] = [tops[column], point.height_m].into_iter().flatten().reduce(f64::max);
    }
    // Columns between two heights that lie further apart stand as high as the one before.
    for column in 1..columns {
        tops[column] = tops[column].or(tops[column - 1]);
    }
    let mut text = String::new();
    for line in (0..lines).rev() {
        let label_m = match line {
            0 => Some(found.low_m),
            line if line + 1 == lines => Some(found.high_m),
            _ => None,
        };
        let label = label_m.map_or_else(String::new, |metres| format!("{metres:.0} m"));
        let is_under = |top: &Option<f64>| {
            top.is_some_and(|top| line as f64 <= (top - found.low_m) / rise_m * (lines - 1) as f64 + 1e-9)
        };
        let ground: String = tops.iter().map(|top| if is_under(top) { '#' } else { ' ' }).collect();
        let _ = writeln!(text, "{}", format!("{label:>9}  {ground}").trim_end());
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    fn point(along_m: f64, height_m: Option<f64>) -> ProfilePoint {
        ProfilePoint { along_m, place_m: [along_m, 0.0], height_m, deck_m: None, class: height_m.map(|_| 0) }
    }

    #[test]
    fn a_profile_adds_up_what_it_climbs_and_what_it_falls() {
        let found = figures(&[(0.0, 10.0), (100.0, 30.0), (200.0, 25.0)].map(|(at, m)| point(at, Some(m)))).unwrap();
        assert_eq!([found.climb_m, found.fall_m, found.steepest_percent], [20.0, 5.0, 20.0]);
    }

    #[test]
    fn a_profile_is_drawn_within_eighty_columns_and_without_ground_says_so() {
        let points: Vec<ProfilePoint> = (0..500).map(|at| point(f64::from(at), Some(f64::from(at % 90)))).collect();
        assert!(text(&points).lines().all(|line| line.len() <= 80), "{}", text(&points));
        assert_eq!(text(&[point(0.0, None)]), "no ground along the line\n");
    }
}
