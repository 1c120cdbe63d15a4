//! The report as text: what a terrain engineer reads first on top, everything that broke a limit below, no colour,
//! at most 80 columns.

use store::{Report, ReportEnough};

use crate::against::leading;
use crate::parts::{eta_of, parts};
use crate::table::{Align, Table, fold, grouped};

use Align::{Left, Right};

/// The whole report, ending in a line end.
pub fn report_text(report: &Report) -> String {
    let first = [Some(headline(report)), warnings(report), report.enough.as_ref().map(enough)];
    let sections = parts(report).into_iter().flat_map(|part| part.sections);
    let all: Vec<String> = first.into_iter().flatten().chain(sections.map(|section| section.text())).collect();
    fold(&all.join("\n"), 2)
}

fn headline(report: &Report) -> String {
    let points = &report.points;
    let mut table = Table::new(&[Left, Right, Left]);
    table.row(["triangles", &grouped(report.triangles), &format!("{} convex polygons", grouped(report.polygons))]);
    let kinds = format!(
        "{} selected, {} on borders, {} corners of load modules",
        grouped(points.selected),
        grouped(points.border),
        grouped(points.corner)
    );
    table.row(["points", &grouped(points.total), &kinds]);
    let (words, residual) = leading(report);
    let largest = format!("RMS against the {words}, largest {:.2} m", residual.max_m);
    table.row(["residual", &format!("{:.3} m", residual.rms_m), &largest]);
    if let Some(eta) = report.limit.and_then(eta_of) {
        let (figure, meaning) = eta.split_once(' ').unwrap_or_default();
        table.row(["eta", figure, meaning]);
    }
    let verdict = match report.breaches.len() {
        0 => "every limit is met".to_owned(),
        1 => "limit is not met".to_owned(),
        _ => "limits are not met".to_owned(),
    };
    table.row(["breaches", &grouped(report.breaches.len() as u64), &verdict]);
    format!("Gaming area {}\n{}", report.area, table.text(2))
}

fn enough(enough: &ReportEnough) -> String {
    let ReportEnough { mean, per_load_module, per_4km } = *enough;
    format!(
        "What to change: limits.mean_per_load_module = {mean}, per_load_module = {per_load_module} and \
         per_4km_square = {per_4km} would keep nearly all roads and water\n"
    )
}

fn warnings(report: &Report) -> Option<String> {
    if report.warnings.is_empty() {
        return None;
    }
    let lines: String = report.warnings.iter().map(|warning| format!("  {warning}\n")).collect();
    Some(format!("Warnings: {}\n{lines}", report.warnings.len()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::samples;
    use crate::table::COLUMNS_MAX;

    #[test]
    fn the_report_reads_as_the_golden_text() {
        let golden = concat!(env!("CARGO_MANIFEST_DIR"), "/src/report.golden.txt");
        let text = report_text(&samples::report());
        if std::env::var_os("UPDATE_GOLDEN").is_some() {
            std::fs::write(golden, &text).unwrap();
        }
        assert_eq!(text, std::fs::read_to_string(golden).unwrap(), "UPDATE_GOLDEN=1 rewrites {golden}");
    }

    #[test]
    fn no_line_is_wider_than_a_terminal_however_large_the_area() {
        let mut report = samples::with_levels();
        report.features = Some(samples::features());
        report.triangles = 1_000_000_000;
        report.polygons = report.triangles;
        report.points.total = 500_000_000;
        report.points.selected = 400_000_000;
        report.warnings.push("a word and another ".repeat(30));
        for class in &mut report.classes {
            (class.posts, class.points) = (100_000_000, 9_999_999);
        }
        for bound in &mut report.bound {
            (bound.count, bound.limit, bound.rms_with_m, bound.refused_largest_m) = (65_000, 65_000, 123.456, 1234.56);
        }
        for line in report_text(&report).lines() {
            assert!(line.chars().count() <= COLUMNS_MAX, "{} columns: {line}", line.chars().count());
        }
    }

    #[test]
    fn a_report_without_findings_says_so() {
        let mut report = samples::report();
        report.breaches.clear();
        report.refusals = Default::default();
        report.warnings.clear();
        report.stages.clear();
        let text = report_text(&report);
        for expected in ["every limit is met", "Refused posts: none", "Breaches: none"] {
            assert!(text.contains(expected), "{text}");
        }
        assert!(!text.contains("Warnings") && !text.contains("Stages"), "{text}");
    }
}
