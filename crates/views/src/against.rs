//! Residuals of the whole area, each with what it is measured against.

use store::{Report, ReportResidual};

/// Residuals in metres; outside features the root mean square and the largest are known.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Residual {
    pub rms_m: f64,
    pub max_m: f64,
    /// Mean absolute one, and what 95 and 99 of 100 posts are within.
    pub rest: Option<[f64; 3]>,
}

impl From<ReportResidual> for Residual {
    fn from(residual: ReportResidual) -> Self {
        let ReportResidual { rms_m, max_m, mean_abs_m, p95_m, p99_m } = residual;
        Self { rms_m, max_m, rest: Some([mean_abs_m, p95_m, p99_m]) }
    }
}

/// Residuals of the whole area against what they say. Those that a build did not measure are absent.
pub(crate) fn told(report: &Report) -> Vec<(&'static str, Residual)> {
    let outside = report.features.as_ref().map(|features| {
        let checks = &features.checks;
        Residual { rms_m: checks.outside_rms_m, max_m: checks.outside_max_m, rest: None }
    });
    let all = [
        (OWN, report.residual_against_source.map(Residual::from)),
        (GRID, report.residual_against_source_grid.map(Residual::from)),
        ("ground outside features", outside),
        (WORKING, Some(report.residual.into())),
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

const WORKING: &str = "working ground";
const GRID: &str = "source at the grid's posts";
const OWN: &str = "source at its own posts";

#[cfg(test)]
mod tests {
    use super::*;
    use crate::samples;

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
}
