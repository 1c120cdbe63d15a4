//! The report as text: what a terrain engineer reads first on top, everything that broke a limit below, no colour,
//! at most 80 columns.

use store::{
    Report, ReportBorder, ReportBound, ReportBreach, ReportEnough, ReportHeights, ReportLimit, ReportPart, ReportPlace,
    ReportResidual, ReportStage,
};

use crate::against::{self, Residual, objects_text};
use crate::features_text::features_text;
use crate::table::{Align, Table, fold, grouped};

use Align::{Left, Right};

/// The whole report, ending in a line end.
pub fn report_text(report: &Report) -> String {
    let parts = [
        headline(report),
        limits(report),
        residuals(report),
        levels(report),
        report.features.as_ref().map(features_text),
        report.objects.as_ref().map(objects_text),
        report.enough.as_ref().map(enough),
        refusals(report),
        bound(report),
        breaches(report),
        warnings(report),
        stages(report),
    ];
    fold(&parts.into_iter().flatten().collect::<Vec<_>>().join("\n"), 2)
}

fn headline(report: &Report) -> Option<String> {
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
    let (words, residual) = against::leading(report);
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
    Some(format!("Gaming area {}\n{}", report.area, table.text(2)))
}

fn limits(report: &Report) -> Option<String> {
    let (module, window, pool) = (&report.per_load_module, &report.per_4km, &report.pool);
    let mut table = Table::new(&[Left, Right, Right, Right]);
    table.row([&format!("Limits, in {}", report.count), "used", "limit", "over"]);
    let number = grouped;
    table.row(["  largest load module".into(), number(module.max), number(module.limit), number(module.over)]);
    let mean = format!("{:.2}", module.mean);
    let mean_breach = report.breaches.iter().find(|breach| breach.kind == "mean_per_load_module");
    let over = mean_breach.map_or("0", |_| "1");
    table.row(["  mean of load modules", &mean, &format!("{:.2}", module.mean_limit), over]);
    table.row(["  largest 4 km square".into(), number(window.max), number(window.limit), number(window.over)]);
    table.row(["  any 4 km square, at most".into(), number(window.worst_9x9), String::new(), String::new()]);
    table.row(["  pool".into(), number(pool.used), number(pool.size), String::new()]);
    Some(table.text(0) + &before_removals(report))
}

/// What exceeded limits before points made room.
fn before_removals(report: &Report) -> String {
    let Some(before) = &report.before_removals else { return String::new() };
    let (module, window) = (&before.per_load_module, &before.per_4km);
    let is_over = if module.mean_limit < module.mean { "1" } else { "0" };
    let mut table = Table::new(&[Left, Right, Right]);
    table.row([&format!("  before {} points were taken out for them", grouped(before.removed)), "used", "over"]);
    table.row(["    largest load module".into(), grouped(module.max), grouped(module.over)]);
    table.row(["    mean of load modules".into(), format!("{:.2}", module.mean), is_over.into()]);
    table.row(["    largest 4 km square".into(), grouped(window.max), grouped(window.over)]);
    table.text(0)
}

fn residuals(report: &Report) -> Option<String> {
    let mut all = Table::new(&[Left, Right, Right, Right, Right, Right]);
    all.row(["Residuals in m, against", "RMS", "mean abs", "95 %", "99 %", "largest"]);
    for (words, Residual { rms_m, max_m, rest }) in against::told(report) {
        let rest = rest.map_or_else(Default::default, |rest| decimals([(rest[0], 3), (rest[1], 2), (rest[2], 2)]));
        let [rms, largest] = decimals([(rms_m, 3), (max_m, 2)]);
        all.row([format!("  {words}"), rms].into_iter().chain(rest).chain([largest]));
    }
    let mut table = Table::new(&[Left, Right, Right, Right, Right, Right, Right, Right]);
    table.row(["Working ground, m", "posts", "points", "RMS", "mean abs", "95 %", "99 %", "largest"]);
    let posts: u64 = report.classes.iter().map(|class| class.posts).sum();
    let posts = if report.classes.is_empty() { String::new() } else { grouped(posts) };
    class_row(&mut table, "all posts", [posts, grouped(report.points.total)], &report.residual);
    for class in &report.classes {
        if class.posts == 0 {
            // A hole, or a class that lies nowhere in the area: nothing is measured there.
            let none = ["-"; 5].map(str::to_owned);
            let name = format!("  {}", class.name);
            table.row([name, "-".to_owned(), grouped(class.points)].into_iter().chain(none));
            continue;
        }
        class_row(&mut table, &class.name, [class.posts, class.points].map(grouped), &class.residual);
    }
    let mut text = format!("{}\n{}", all.text(0), table.text(0));
    if !report.classes.is_empty() {
        let by_points = report.overall_point_weighted_rms_m;
        text += &format!("  RMS of the classes weighted by points, as in the founding paper: {by_points:.3} m\n");
    }
    if let Some(border) = &report.border {
        text += &format!("  at the outer border {}\n", part_in_words(&border.at_border));
        text += &format!("  inside              {}\n", part_in_words(&border.inside));
    }
    if let Some(heights) = &report.heights {
        text += &format!("  {}\n", heights_in_words(heights));
    }
    if let Some(accuracy_m) = report.dem_accuracy_m {
        text += &format!("  the source states an accuracy of {accuracy_m} m\n");
    }
    if 0 < report.voids.count {
        let (voids, filled) = (grouped(report.voids.count), grouped(report.voids.filled));
        text += &format!("  posts without a height in the source: {voids}, of which {filled} were filled\n");
    }
    Some(text)
}

/// The distance from the limit, in words; `None` where there is none, as on a plane.
pub(crate) fn eta_of(limit: ReportLimit) -> Option<String> {
    Some(eta_in_words(limit.eta?, limit.triangles, limit.rough_share))
}

/// The distance from the limit, in words that begin with the figure.
pub fn eta_in_words(eta: f64, triangles: u64, rough_share: f64) -> String {
    let (count, rough) = (grouped(triangles), rough_share * 100.0);
    format!(
        "{eta:.2} times the RMS of the best surface of {count} triangles; {rough:.0} % of the ground is rough for them"
    )
}

/// Residuals of load modules at the outer border of the area, and of those inside.
pub(crate) fn border_in_words(border: &ReportBorder) -> String {
    format!("at the outer border {}; inside {}", part_in_words(&border.at_border), part_in_words(&border.inside))
}

fn part_in_words(part: &ReportPart) -> String {
    format!("RMS {:.3} m, largest {:.2} m", part.rms_m, part.max_m)
}

/// Heights of the surface beside those of its sources.
pub(crate) fn heights_in_words(heights: &ReportHeights) -> String {
    let range = |[low, high]: [f64; 2]| format!("{low:.2} to {high:.2} m");
    let surface = format!("heights {}", range(heights.surface_m));
    match heights.sources_m {
        None => surface,
        Some(sources_m) if heights.outside_m == 0.0 => format!("{surface}, sources {}", range(sources_m)),
        Some(sources_m) => format!("{surface}, sources {}, {:.2} m beyond", range(sources_m), heights.outside_m),
    }
}

fn class_row(table: &mut Table, name: &str, counts: [String; 2], residual: &ReportResidual) {
    let ReportResidual { rms_m, max_m, mean_abs_m, p95_m, p99_m } = *residual;
    let figures = decimals([(rms_m, 3), (mean_abs_m, 3), (p95_m, 2), (p99_m, 2), (max_m, 2)]);
    table.row([format!("  {name}")].into_iter().chain(counts).chain(figures));
}

/// Figures with so many digits behind the point.
pub(crate) fn decimals<const N: usize>(all: [(f64, usize); N]) -> [String; N] {
    all.map(|(figure, digits)| format!("{figure:.digits$}"))
}

/// Levels of detail, where there are several.
fn levels(report: &Report) -> Option<String> {
    let finest = report.levels.first()?;
    let mut table = Table::new(&[Left, Right, Right, Right, Right, Right]);
    table.row(["Levels of detail", "inner share", "triangles", "of level 0", "RMS m", "largest m"]);
    for level in &report.levels {
        table.row([
            format!("  {}", level.level),
            level.inner_share.to_string(),
            grouped(level.triangles),
            format!("{} %", percent(level.triangles as f64, finest.triangles as f64)),
            format!("{:.3}", level.rms_m),
            format!("{:.2}", level.max_m),
        ]);
    }
    Some(table.text(0))
}

fn refusals(report: &Report) -> Option<String> {
    let refused = &report.refusals;
    if refused.count == 0 {
        return Some("Refused posts: none\n".into());
    }
    let mut table = Table::new(&[Right, Left]);
    table.row([grouped(refused.by_module), "by the limit of a load module".into()]);
    table.row([grouped(refused.by_window), "by the limit of a 4 km square".into()]);
    table.row([grouped(refused.by_reservation), "to keep what a neighbour's side was promised".into()]);
    let largest = format!("largest residual among them {:.2} m", refused.largest_m);
    Some(format!("Refused posts: {}, {largest}\n{}", grouped(refused.count), table.text(2)))
}

/// Rows of a long list that a text report shows; the JSON has them all.
const BOUND_ROWS_MAX: usize = 10;

/// Where limits were met by refusing posts, and what that cost.
fn bound(report: &Report) -> Option<String> {
    if report.bound.is_empty() {
        return None;
    }
    let mut table = Table::new(&[Left, Left, Right, Right, Right, Right, Right, Right]);
    table.row(["  limit", "row,col", "count", "limit", "refused", "largest", "RMS m", "without"]);
    for bound in report.bound.iter().take(BOUND_ROWS_MAX) {
        table.row([format!("  {}", bound.kind), place(bound.place)].into_iter().chain(bound_cells(bound)));
    }
    let more = report.bound.len().saturating_sub(BOUND_ROWS_MAX);
    let rest = if more == 0 { String::new() } else { format!("  and {more} more in report.json\n") };
    Some(format!("Limits that refused posts, and the RMS residual without them\n{}{rest}", table.text(0)))
}

fn breaches(report: &Report) -> Option<String> {
    if report.breaches.is_empty() {
        return Some("Breaches: none\n".into());
    }
    let mut table = Table::new(&[Left, Left, Right, Right, Right, Right, Right]);
    table.row(["  limit", "row,col", "count", "limit", "refused", "RMS m", "without"]);
    for breach in &report.breaches {
        table.row([format!("  {}", breach.kind), place(breach.place)].into_iter().chain(breach_cells(breach)));
    }
    Some(format!("Breaches, and the RMS residual without the limit\n{}", table.text(0)))
}

/// A load module, or the south-western one of a window; the kind of the limit says which.
fn place(place: ReportPlace) -> String {
    match place {
        ReportPlace::Module([row, col]) | ReportPlace::Window([row, col]) => format!("{row},{col}"),
        ReportPlace::Area => "area".into(),
    }
}

/// What is counted, the limit, posts refused, and residuals without their place.
pub(crate) fn breach_cells(breach: &ReportBreach) -> [String; 5] {
    [
        amount(breach, breach.count),
        amount(breach, breach.limit),
        breach.refused.to_string(),
        format!("{:.3}", breach.rms_with_m),
        breach.rms_without_m.map_or(String::new(), |rms_m| format!("{rms_m:.3}")),
    ]
}

/// The same of a limit that refused posts, with the largest residual among them.
pub(crate) fn bound_cells(bound: &ReportBound) -> [String; 6] {
    let [count, limit, refused] = [bound.count, bound.limit, u64::from(bound.refused)].map(grouped);
    let residuals = [(bound.refused_largest_m, 2), (bound.rms_with_m, 3), (bound.rms_without_m, 3)];
    let [largest, with, without] = decimals(residuals);
    [count, limit, refused, largest, with, without]
}

/// A count; of a residual, which is counted in millimetres, the metres.
pub(crate) fn amount(breach: &ReportBreach, count: u64) -> String {
    if breach.kind == "residual" { format!("{}.{:03} m", grouped(count / 1000), count % 1000) } else { grouped(count) }
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

fn stages(report: &Report) -> Option<String> {
    (!report.stages.is_empty()).then(|| stage_table(&report.stages, report.workers).text(0))
}

/// One row per stage and one for all: wall and CPU seconds, workers, share of the workers' time that was busy, and
/// share of the wall time.
pub fn stage_table(stages: &[ReportStage], workers: u32) -> Table {
    let mut table = Table::new(&[Left, Right, Right, Right, Right, Right]);
    table.row(["Stages", "wall s", "cpu s", "workers", "busy %", "of all %"]);
    let wall_s: f64 = stages.iter().map(|stage| stage.wall_s).sum();
    let cpu_s: f64 = stages.iter().map(|stage| stage.cpu_s).sum();
    let total = ReportStage { name: "all".into(), wall_s, cpu_s };
    for stage in stages.iter().chain([&total]) {
        table.row([
            format!("  {}", stage.name),
            format!("{:.2}", stage.wall_s),
            format!("{:.2}", stage.cpu_s),
            workers.to_string(),
            percent(stage.cpu_s, stage.wall_s * f64::from(workers)),
            percent(stage.wall_s, wall_s),
        ]);
    }
    table
}

fn percent(part: f64, whole: f64) -> String {
    if 0.0 < whole { format!("{:.0}", 100.0 * part / whole) } else { "-".into() }
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

    #[test]
    fn levels_are_a_table_where_there_are_several() {
        assert_eq!(levels(&samples::report()), None);
        let text = levels(&samples::with_levels()).unwrap();
        let lines: Vec<Vec<&str>> = text.lines().map(|line| line.split_whitespace().collect()).collect();
        assert_eq!(lines.len(), 4);
        assert_eq!(lines[2], ["1", "0.5", "223,000", "70", "%", "4.250", "60.50"]);
    }

    #[test]
    fn a_stage_without_time_has_no_share() {
        let text = stage_table(&[ReportStage { name: "read".into(), wall_s: 0.0, cpu_s: 0.0 }], 2).text(0);
        assert!(text.contains('-') && !text.contains("NaN"), "{text}");
    }
}
