//! `tiefort diff`: what changed from one database to another, and what that bought and cost.

use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use database::{Folder, Manifest, Report};
use serde_json::{Value, json};
use views::{Align, Table, grouped};

use crate::failure::{Failure, Outcome};
use crate::terminal;

const AFTER_HELP: &str = "\
Examples:
  tiefort build mine.toml --out before.tdb     then add pins to the job, and
  tiefort build mine.toml --out after.tdb
  tiefort diff before.tdb after.tdb

Exit codes: 0 compared; 2 a database is missing, or the two are of different areas.";

/// Arguments of `diff`.
#[derive(Args)]
#[command(after_help = AFTER_HELP)]
pub struct Arguments {
    /// Folder of the database before
    #[arg(value_name = "BEFORE")]
    before: PathBuf,
    /// Folder of the database after
    #[arg(value_name = "AFTER")]
    after: PathBuf,
    /// For a person or a program
    #[arg(long, value_enum, default_value_t = Format::Text)]
    format: Format,
}

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Format {
    /// For a person
    Text,
    /// For a program
    Json,
}

/// A finished build.
struct Built {
    manifest: Manifest,
    report: Report,
}

/// A figure before and after.
struct Figure {
    name: String,
    before: f64,
    after: f64,
    /// Digits behind the point.
    digits: usize,
}

/// Compares.
pub fn run(arguments: &Arguments) -> Result<Outcome, Failure> {
    let (before, after) = (read(&arguments.before)?, read(&arguments.after)?);
    if (before.manifest.area.clone(), before.manifest.tiles.len())
        != (after.manifest.area.clone(), after.manifest.tiles.len())
    {
        let (one, other) = (&before.manifest.area.name, &after.manifest.area.name);
        let message = format!("found areas {one} and {other} of other place, size or tiles, expected the same twice");
        return Err(Failure::new(message, "compare two builds of one job"));
    }
    let figures = figures(&before.report, &after.report);
    let settings = changed_settings(&before.manifest.job, &after.manifest.job);
    let tiles = changed_tiles(&before.manifest, &after.manifest);
    terminal::print(&match arguments.format {
        Format::Text => text(&figures, &settings, &tiles, before.manifest.tiles.len()),
        Format::Json => format!("{:#}\n", to_json(&figures, &settings, &tiles)),
    })?;
    Ok(Outcome::Sound)
}

fn read(folder: &Path) -> Result<Built, Failure> {
    let folder = Folder::new(folder);
    Ok(Built { manifest: folder.manifest()?, report: folder.report()? })
}

fn figures(before: &Report, after: &Report) -> Vec<Figure> {
    let whole = |name: &str, of: fn(&Report) -> u64| Figure {
        name: name.into(),
        before: of(before) as f64,
        after: of(after) as f64,
        digits: 0,
    };
    let metres = |name: &str, of: fn(&Report) -> f64| Figure {
        name: name.into(),
        before: of(before),
        after: of(after),
        digits: 3,
    };
    let mut all = vec![
        whole("points", |report| report.points.total),
        whole("triangles", |report| report.triangles),
        whole("polygons", |report| report.polygons),
        whole("largest load module", |report| report.per_load_module.max),
        whole("largest 4 km square", |report| report.per_4km.max),
        whole("breaches", |report| report.breaches.len() as u64),
        whole("refused posts", |report| report.refusals.count),
        metres("RMS residual m", |report| report.residual.rms_m),
        metres("mean residual m", |report| report.residual.mean_abs_m),
        metres("99 % within m", |report| report.residual.p99_m),
        metres("largest residual m", |report| report.residual.max_m),
    ];
    for class in &before.classes {
        let Some(other) = after.classes.iter().find(|other| other.name == class.name) else { continue };
        let (before, after) = (class.residual.rms_m, other.residual.rms_m);
        all.push(Figure { name: format!("RMS of {} m", class.name), before, after, digits: 3 });
    }
    all
}

/// Lines of the job that are in one of the two only.
fn changed_settings(before: &str, after: &str) -> Vec<String> {
    let missing = |from: &str, other: &str, sign: &str| -> Vec<String> {
        from.lines()
            .filter(|line| !other.lines().any(|same| same == *line))
            .map(|line| format!("{sign} {line}"))
            .collect()
    };
    let mut all = missing(before, after, "-");
    all.extend(missing(after, before, "+"));
    all
}

/// Tiles whose load modules are other bytes.
fn changed_tiles(before: &Manifest, after: &Manifest) -> Vec<String> {
    let pairs = before.tiles.iter().zip(&after.tiles);
    pairs.filter(|(one, other)| one.slm != other.slm).map(|(_, tile)| tile.tile().to_string()).collect()
}

fn text(figures: &[Figure], settings: &[String], tiles: &[String], all_tiles: usize) -> String {
    let mut table = Table::new(&[Align::Left, Align::Right, Align::Right, Align::Right]);
    table.row(["", "before", "after", "change"]);
    let number = |value: f64, digits: usize| match digits {
        0 => grouped(value as u64),
        _ => format!("{value:.digits$}"),
    };
    for Figure { name, before, after, digits } in figures {
        let change = format!("{:+.digits$}", after - before);
        table.row([name.clone(), number(*before, *digits), number(*after, *digits), change]);
    }
    let mut text = table.text(0);
    text += &format!("\nTiles whose load modules changed: {} of {all_tiles}", tiles.len());
    text += &if tiles.is_empty() { "\n".to_owned() } else { format!(": {}\n", tiles.join(" ")) };
    if !settings.is_empty() {
        text += &format!("Settings that changed:\n  {}\n", settings.join("\n  "));
    }
    text
}

fn to_json(figures: &[Figure], settings: &[String], tiles: &[String]) -> Value {
    let figure = |figure: &Figure| json!({ "name": figure.name, "before": figure.before, "after": figure.after });
    let figures: Vec<Value> = figures.iter().map(figure).collect();
    json!({ "figures": figures, "changed_settings": settings, "changed_tiles": tiles })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn settings_that_differ_are_told_with_the_side_they_are_on() {
        let changed = changed_settings("[tin]\na = 1\nb = 2\n", "[tin]\nb = 2\npins = \"p\"\n");
        assert_eq!(changed, ["- a = 1", "+ pins = \"p\""]);
    }

    #[test]
    fn every_change_has_its_sign() {
        let figure = Figure { name: "RMS residual m".into(), before: 1.5, after: 1.25, digits: 3 };
        let shown = text(&[figure], &[], &["1,2".into()], 9);
        assert!(shown.contains("1.500  1.250  -0.250") && shown.contains("1 of 9: 1,2"), "{shown}");
    }
}
