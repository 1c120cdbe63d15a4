//! Two reports side by side: what the changes between two builds bought, and what they cost.

use std::path::Path;

use serde_json::{Value, json};
use store::{Folder, Report};
use views::{Align, Table, grouped};

/// A figure of two builds.
struct Figure {
    name: String,
    before: f64,
    after: f64,
    /// Digits behind the point.
    digits: usize,
}

/// The figures of two databases, if both have a report.
pub struct Figures(Vec<Figure>);

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
