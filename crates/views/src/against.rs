//! What a report says in words: residuals, each with what it is measured against, and buildings, walls and woods.

use Align::{Left, Right};
use store::{ObjectSums, Report, ReportObjects, ReportResidual};

use super::table::{Align, Table, grouped};

/// Residuals in metres; outside features the root mean square and the largest are known.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Residual {
    pub rms_m: f64,
    pub max_m: f64,
    /// Mean absolute one, and what 95 and 99 of 100 posts are within.
    pub rest: Option<[f64; 3]>,
}

/// Residuals of the whole area against what they say. Those that a build did not measure are absent.
pub(crate) fn told(report: &Report) -> Vec<(&'static str, Residual)> {
    let whole = |residual: ReportResidual| {
        let ReportResidual { rms_m, max_m, mean_abs_m, p95_m, p99_m } = residual;
        Residual { rms_m, max_m, rest: Some([mean_abs_m, p95_m, p99_m]) }
    };
    let outside = report.features.as_ref().map(|features| {
        let checks = &features.checks;
        Residual { rms_m: checks.outside_rms_m, max_m: checks.outside_max_m, rest: None }
    });
    let all = [
        (OWN, report.residual_against_source.map(whole)),
        (GRID, report.residual_against_source_grid.map(whole)),
        ("ground outside features", outside),
        (WORKING, Some(whole(report.residual))),
    ];
    all.into_iter().filter_map(|(words, residual)| Some((words, residual?))).collect()
}

/// What a person should see first: against the source, and of its two the one with the larger RMS. Where neither was
/// measured it is that against the working ground.
pub fn leading(report: &Report) -> (&'static str, ReportResidual) {
    let of_source = [(GRID, report.residual_against_source_grid), (OWN, report.residual_against_source)];
    let of_source = of_source.into_iter().filter_map(|(words, residual)| Some((words, residual?)));
    let largest = of_source.max_by(|(_, a), (_, b)| a.rms_m.total_cmp(&b.rms_m));
    largest.unwrap_or((WORKING, report.residual))
}

pub(crate) const WORKING: &str = "working ground";
const GRID: &str = "source at the grid's posts";
const OWN: &str = "source at its own posts";

/// Kind, kept and wanted in number, in square metres of silhouette, and the share in per cent.
pub(crate) fn objects_row(sums: &ObjectSums) -> [String; 6] {
    let share = if 0.0 < sums.wanted_m2 { format!("{:.1}", 100.0 * sums.kept_m2 / sums.wanted_m2) } else { "-".into() };
    let [kept_m2, wanted_m2] = [sums.kept_m2, sums.wanted_m2].map(|square| grouped(square.round() as u64));
    [sums.kind.clone(), grouped(sums.kept), grouped(sums.wanted), kept_m2, wanted_m2, share]
}

/// The block of the text report.
pub(crate) fn objects_text(objects: &ReportObjects) -> String {
    let mut table = Table::new(&[Left, Right, Right, Right, Right, Right]);
    table.row(["Objects", "kept", "of", "m2 seen", "of", "%"]);
    for [kind, numbers @ ..] in objects.kinds.iter().map(objects_row) {
        table.row([format!("  {kind}")].into_iter().chain(numbers));
    }
    let of = |found: store::ReportObjectLimit| format!("{} of {}", grouped(found.max), grouped(found.limit));
    format!(
        "{}  {} roofs, walls and triangles of woods; {} in one load module at most, {} in 4 km\n  {} had no room, \
         {} remarks; objects.geojson\n",
        table.text(0),
        grouped(objects.polygons),
        of(objects.per_load_module),
        of(objects.per_4km),
        grouped(objects.left_out),
        grouped(objects.remarks)
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::samples;
    use store::ReportObjectLimit;

    #[test]
    fn the_source_leads_with_the_larger_of_its_two_figures() {
        let mut report = samples::report();
        assert_eq!(leading(&report).0, "source at its own posts");
        report.residual_against_source_grid = Some(ReportResidual { rms_m: 9.5, ..report.residual });
        assert_eq!(leading(&report), ("source at the grid's posts", report.residual_against_source_grid.unwrap()));
        (report.residual_against_source, report.residual_against_source_grid) = (None, None);
        assert_eq!(leading(&report), ("working ground", report.residual));
    }

    #[test]
    fn four_residuals_are_told_of_an_area_with_features() {
        let report = Report { features: Some(samples::features()), ..samples::report() };
        let rms_m: Vec<f64> = told(&report).iter().map(|(_, residual)| residual.rms_m).collect();
        assert_eq!(rms_m, [3.1, 2.9, 1.25, 2.999]);
    }

    #[test]
    fn what_is_kept_of_what_was_wanted_is_told_by_kind() {
        let sums =
            ObjectSums { kind: "building".into(), wanted: 1_200, kept: 1_150, wanted_m2: 90_000.4, kept_m2: 88_000.0 };
        let limit = ReportObjectLimit { max: 390, limit: 400 };
        let objects = ReportObjects {
            kinds: vec![sums],
            polygons: 6_000,
            per_load_module: limit,
            per_4km: limit,
            left_out: 50,
            remarks: 3,
        };
        let text = objects_text(&objects);
        assert!(text.contains("building  1,150  1,200   88,000  90,000  97.8"), "{text}");
        assert!(text.contains("390 of 400 in one load module"), "{text}");
        assert!(text.contains("50 had no room, 3 remarks"), "{text}");
    }
}
