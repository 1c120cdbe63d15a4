//! `tiefort diff`: which load modules of two databases differ, and by how much.
//!
//! Two reports side by side say what the changes between two builds bought, and what they cost.

use std::path::{Path, PathBuf};

use clap::Args;
use inspect::{Difference, ModuleDifference, difference};
use serde_json::{Value, json};
use store::{Folder, Report};
use views::{Align, Table, grouped};

use crate::arguments::{Format, Workers};
use crate::failure::{Failure, Outcome};

const AFTER_HELP: &str = "\
Examples:
  tiefort diff before.tdb after.tdb
  tiefort diff before.tdb after.tdb --format json | jq '.changed[].module'

\"apart\" is how far the two surfaces of the finest level lie apart at most, at
posts of the working grid. Exit codes: 0 all load modules alike, at every level;
1 some differ; 2 nothing to compare.";

/// Arguments of `diff`.
#[derive(Args)]
#[command(after_help = AFTER_HELP)]
pub struct Arguments {
    /// Folder of a terrain database
    #[arg(value_name = "A")]
    first: PathBuf,
    /// Folder of another one of the same area
    #[arg(value_name = "B")]
    second: PathBuf,
    /// List every load module that differs, not only those farthest apart
    #[arg(long)]
    all: bool,
    /// For a person or a program
    #[arg(long, value_enum, default_value_t = Format::Text)]
    format: Format,
    #[command(flatten)]
    workers: Workers,
}

/// Rows of the list, unless all are asked for.
const ROWS_MAX: usize = 20;

/// Compares.
pub fn run(arguments: &Arguments) -> Result<Outcome, Failure> {
    let found = difference(&arguments.first, &arguments.second, arguments.workers.count())?;
    let figures = Figures::of(&arguments.first, &arguments.second);
    let rows = if arguments.all { usize::MAX } else { ROWS_MAX };
    arguments.format.print(|| text(&found, &figures, rows), || to_json(&found, &figures))?;
    Ok(if found.changed.is_empty() { Outcome::Sound } else { Outcome::Differ })
}

fn text(found: &Difference, figures: &Figures, rows: usize) -> String {
    let (changed, modules) = (grouped(found.changed.len() as u64), grouped(found.modules as u64));
    let mut text = match found.changed.len() {
        0 => format!("All {modules} load modules are alike.\n"),
        _ => format!("{changed} of {modules} load modules differ.\n"),
    };
    if !found.settings.is_empty() {
        text += "\nsettings\n";
        let mut table = Table::new(&[Align::Left, Align::Left, Align::Left]);
        for setting in &found.settings {
            // Each value on a line of its own: a list of sources is longer than any column.
            table.row([setting.key.as_str(), "A", &setting.values[0]]);
            table.row(["", "B", &setting.values[1]]);
        }
        text += &table.text(2);
    }
    if found.changed.is_empty() {
        return text;
    }
    format!("{text}\n{}\n{}", figures.text(), list(found, rows))
}

/// The load modules that differ, those farthest apart first.
fn list(found: &Difference, rows: usize) -> String {
    let mut order: Vec<&ModuleDifference> = found.changed.iter().collect();
    order.sort_by(|a, b| b.apart_m.total_cmp(&a.apart_m).then(a.module.cmp(&b.module)));
    let columns = [Align::Left, Align::Right, Align::Right, Align::Right, Align::Right, Align::Right, Align::Left];
    let mut table = Table::new(&columns);
    table.row(["load module", "apart", "triangles A", "B", "RMS A", "B", "differs in"]);
    for module in order.iter().take(rows) {
        table.row([
            module.module.to_string(),
            format!("{:.2} m", module.apart_m),
            module.triangles[0].to_string(),
            module.triangles[1].to_string(),
            format!("{:.3} m", module.rms_m[0]),
            format!("{:.3} m", module.rms_m[1]),
            module.differs.join(", "),
        ]);
    }
    let more = order.len().saturating_sub(rows);
    let rest = if more == 0 { String::new() } else { format!("and {} more: --all\n", grouped(more as u64)) };
    table.text(0) + &rest
}

fn to_json(found: &Difference, figures: &Figures) -> Value {
    let mut told = json!(found);
    told["figures"] = figures.to_json();
    told
}

/// A figure of two builds.
struct Figure {
    name: String,
    before: f64,
    after: f64,
    /// Digits behind the point.
    digits: usize,
}

/// The figures of two databases, if both have a report.
struct Figures(Vec<Figure>);

impl Figures {
    /// Reads both reports; no figures where one is missing, for instance because its build is not finished.
    pub fn of(first: &Path, second: &Path) -> Self {
        let report = |folder: &Path| Folder::new(folder).report().ok();
        match (report(first), report(second)) {
            (Some(first), Some(second)) => Self(figures(&first, &second)),
            _ => Self(Vec::new()),
        }
    }

    /// A table for a person; empty where there are no figures.
    pub fn text(&self) -> String {
        if self.0.is_empty() {
            return String::new();
        }
        let mut table = Table::new(&[Align::Left, Align::Right, Align::Right, Align::Right]);
        table.row(["", "A", "B", "change"]);
        let number = |value: f64, digits: usize| match digits {
            0 => grouped(value as u64),
            _ => format!("{value:.digits$}"),
        };
        for Figure { name, before, after, digits } in &self.0 {
            let change = format!("{:+.digits$}", after - before);
            table.row([name.clone(), number(*before, *digits), number(*after, *digits), change]);
        }
        table.text(0)
    }

    /// The same for a program.
    pub fn to_json(&self) -> Value {
        let figure = |figure: &Figure| json!({ "name": figure.name, "values": [figure.before, figure.after] });
        self.0.iter().map(figure).collect()
    }
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
    for level in &before.levels {
        let Some(other) = after.levels.iter().find(|other| other.level == level.level) else { continue };
        let figure = |what: &str, [before, after]: [f64; 2], digits| {
            let name = format!("{what} at level {}", level.level);
            Figure { name, before, after, digits }
        };
        all.push(figure("triangles", [level.triangles, other.triangles].map(|count| count as f64), 0));
        all.push(figure("RMS m", [level.rms_m, other.rms_m], 3));
    }
    for kind in before.objects.iter().flat_map(|objects| &objects.kinds) {
        let others = after.objects.iter().flat_map(|objects| &objects.kinds);
        let after = others.filter(|other| other.kind == kind.kind).map(|other| other.kept).sum::<u64>() as f64;
        all.push(Figure { name: format!("kept of {}", kind.kind), before: kind.kept as f64, after, digits: 0 });
    }
    for class in &before.classes {
        let Some(other) = after.classes.iter().find(|other| other.name == class.name) else { continue };
        let (before, after) = (class.residual.rms_m, other.residual.rms_m);
        all.push(Figure { name: format!("RMS of {} m", class.name), before, after, digits: 3 });
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_change_has_its_sign() {
        let figure = Figure { name: "RMS residual m".into(), before: 1.5, after: 1.25, digits: 3 };
        let shown = Figures(vec![figure]).text();
        assert!(shown.contains("1.500  1.250  -0.250"), "{shown}");
    }
}
