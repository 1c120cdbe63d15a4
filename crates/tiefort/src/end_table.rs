//! The end of a run: a row per stage, findings counted by kind, sizes of what was written.

use std::fmt::Write;
use std::path::Path;

use store::Report;
use views::{Align, Table, grouped, leading, stage_table};

use crate::files;

/// What a run did, and where its result lies.
#[derive(Clone, Copy, Debug)]
pub struct End<'a> {
    /// What it found, stages included.
    pub report: &'a Report,
    /// Which tiles were built and which kept, in words.
    pub tiles: &'a str,
    /// Where the database lies.
    pub folder: &'a Path,
    /// Seconds from start to end.
    pub seconds: f64,
}

/// The end table: whole lines.
pub fn end_table(end: &End) -> String {
    let stages = stage_table(&end.report.stages, end.report.workers).text(0);
    let mut text = format!("\n{stages}\n");
    text += &findings(end.report).text(0);
    text += "\n";
    text += &output(end).text(0);
    text
}

fn findings(report: &Report) -> Table {
    let mut table = Table::new(&[Align::Left, Align::Right, Align::Left]);
    let (against, residual) = leading(report);
    let largest = format!("RMS against the {against}, largest {:.2} m", residual.max_m);
    table.row(["Residual", &format!("{:.3} m", residual.rms_m), &largest]);
    let counted = if report.count == "triangles" { String::new() } else { format!(" {}", report.count) };
    let (mean, points) = (report.per_load_module.mean, grouped(report.points.total));
    let mean = format!("{mean:.2}{counted} per load module, {points} points");
    table.row(["Triangles", &grouped(report.triangles), &mean]);
    table.row(["Breaches", &grouped(report.breaches.len() as u64), &breach_kinds(report)]);
    if let Some(features) = &report.features {
        table.row(["Features", "", &views::remarks_in_words(features)]);
    }
    let refused = &report.refusals;
    let kinds = format!(
        "{} by load modules, {} by 4 km squares, {} by reservations",
        grouped(refused.by_module),
        grouped(refused.by_window),
        grouped(refused.by_reservation)
    );
    table.row(["Refused posts", &grouped(refused.count), if refused.count == 0 { "" } else { &kinds }]);
    table.row(["Warnings", &grouped(report.warnings.len() as u64), ""]);
    for warning in &report.warnings {
        table.row(["", "", warning]);
    }
    table
}

/// Breaches counted by kind, in the order of their first.
fn breach_kinds(report: &Report) -> String {
    let mut kinds: Vec<(&str, u64)> = Vec::new();
    for breach in &report.breaches {
        match kinds.iter_mut().find(|(kind, _)| *kind == breach.kind) {
            Some((_, count)) => *count += 1,
            None => kinds.push((&breach.kind, 1)),
        }
    }
    if kinds.is_empty() {
        return "all limits met".into();
    }
    let mut text = String::new();
    for (kind, count) in kinds {
        let comma = if text.is_empty() { "" } else { ", " };
        write!(text, "{comma}{} {kind}", grouped(count)).expect("a text takes all that is written to it");
    }
    text
}

fn output(end: &End) -> Table {
    let mut table = Table::new(&[Align::Left, Align::Right, Align::Left]);
    let sizes = files::sizes(end.folder);
    let total: u64 = sizes.iter().map(|&(_, bytes)| bytes).sum();
    let parts: Vec<String> =
        sizes.iter().map(|(name, bytes)| format!("{name} {}", files::bytes_text(*bytes))).collect();
    table.row(["Output", &files::bytes_text(total), &parts.join(", ")]);
    table.row(["Tiles", "", end.tiles]);
    table.row(["Database", "", &files::shown(end.folder).display().to_string()]);
    table.row(["Time", &format!("{:.1} s", end.seconds), ""]);
    table
}
