//! What a report says, part by part, for text and page alike: a row or a column is added here and nowhere else.

mod features;

use store::{Report, ReportBreach, ReportHeights, ReportLimit, ReportPlace, ReportStage};

use crate::against::{Residual, told};
use crate::section::Section;
use crate::table::{Align, Cell, Table, decimals, grouped, percent};

pub use features::remarks_in_words;
pub(crate) use features::{is_thin, kept};

/// A part of a report, that text and page have.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Part {
    /// What a link on a page leads to.
    pub id: &'static str,
    /// What stands above it on a page.
    pub name: &'static str,
    pub sections: Vec<Section>,
}

/// Those of which there is something to say, in the order of reading.
pub(crate) fn parts(report: &Report) -> Vec<Part> {
    let limits = [Some(limits(report)), before_removals(report), Some(refusals(report)), bound(report)];
    let residuals = [Some(residuals(report)), Some(working_ground(report)), levels(report)];
    let all = [
        ("limits", "Limits", limits.into_iter().flatten().collect()),
        ("residuals", "Residuals", residuals.into_iter().flatten().collect()),
        ("features", "Roads and water", report.features.as_ref().map(features::features).unwrap_or_default()),
        ("objects", "Buildings and woods", Vec::from_iter(report.objects.as_ref().map(features::objects))),
        ("breaches", "Breaches", vec![breaches(report)]),
        ("times", "Times", Vec::from_iter(stages(&report.stages, report.workers))),
    ];
    let parts = all.into_iter().map(|(id, name, sections)| Part { id, name, sections });
    parts.filter(|part| !part.sections.is_empty()).collect()
}

fn limits(report: &Report) -> Section {
    let (module, window, pool) = (&report.per_load_module, &report.per_4km, &report.pool);
    let mut table = Table::default().words([format!("Limits, in {}", report.count)]);
    table = table.figures(["used", "limit", "use %", "over"]);
    let share = |used: u64, limit: u64| percent(used as f64, limit as f64, 1);
    let is_mean_over = report.breaches.iter().any(|breach| breach.kind == "mean_per_load_module");
    let [mean, mean_limit] = [module.mean, module.mean_limit].map(|mean| format!("{mean:.2}"));
    let rows = [
        (
            Cell::Keyed("largest load module", "limits.per_load_module"),
            [grouped(module.max), grouped(module.limit), share(module.max, module.limit), grouped(module.over)],
        ),
        (
            Cell::Keyed("mean of load modules", "limits.mean_per_load_module"),
            [mean, mean_limit, percent(module.mean, module.mean_limit, 1), u64::from(is_mean_over).to_string()],
        ),
        (
            Cell::Keyed("largest 4 km square", "limits.per_4km_square"),
            [grouped(window.max), grouped(window.limit), share(window.max, window.limit), grouped(window.over)],
        ),
        ("any 4 km square, at most".into(), [grouped(window.worst_9x9), String::new(), String::new(), String::new()]),
        (Cell::Keyed("pool", "limits.pool"), [grouped(pool.used), grouped(pool.size), String::new(), String::new()]),
    ];
    rows.into_iter().for_each(|(name, figures)| table.add([name], figures));
    let any = "Any 4 km square, at whatever offset, holds no more than the fullest square of load modules that is one \
               of them wider.";
    Section { table, explained: vec![any.into()], ..Section::default() }
}

/// What exceeded limits before points made room.
fn before_removals(report: &Report) -> Option<Section> {
    let before = report.before_removals?;
    let (module, window) = (before.per_load_module, before.per_4km);
    let title = format!("Before {} points made room", grouped(before.removed));
    let mut table = Table::default().words([title]).figures(["used", "over"]);
    table.row(["largest load module".into(), grouped(module.max), grouped(module.over)]);
    let is_mean_over = u64::from(module.mean_limit < module.mean);
    table.row(["mean of load modules".into(), format!("{:.2}", module.mean), is_mean_over.to_string()]);
    table.row(["largest 4 km square".into(), grouped(window.max), grouped(window.over)]);
    Some(Section { table, ..Section::default() })
}

fn refusals(report: &Report) -> Section {
    let refused = &report.refusals;
    if refused.count == 0 {
        return Section { title: "Refused posts: none".into(), ..Section::default() };
    }
    let mut table = Table::new(&[Align::Right, Align::Left]);
    table.row([grouped(refused.by_module), "by the limit of a load module".into()]);
    table.row([grouped(refused.by_window), "by the limit of a 4 km square".into()]);
    table.row([grouped(refused.by_reservation), "to keep what a neighbour's side was promised".into()]);
    let (count, largest_m) = (grouped(refused.count), refused.largest_m);
    let title = format!("Refused posts: {count}, largest residual among them {largest_m:.2} m");
    Section { title, table, ..Section::default() }
}

/// Where limits were met by refusing posts, and what that cost.
fn bound(report: &Report) -> Option<Section> {
    let heads = ["count", "limit", "refused", "largest", "RMS m", "without"];
    let mut table = Table::default().words(["limit", "row,col"]).figures(heads).long([10, 25], "report.json");
    for bound in &report.bound {
        let counts = [bound.count, bound.limit, u64::from(bound.refused)].map(grouped);
        let residuals = decimals([(bound.refused_largest_m, 2), (bound.rms_with_m, 3), (bound.rms_without_m, 3)]);
        table.add(limit_at(&bound.kind, bound.place), counts.into_iter().chain(residuals));
    }
    let title = "Limits that refused posts, and the RMS residual without them".into();
    (!report.bound.is_empty()).then(|| Section { title, table, ..Section::default() })
}

fn limit_at(kind: &str, place: ReportPlace) -> [Cell; 2] {
    [Cell::Code(kind.to_owned()), Cell::Place(place)]
}

fn breaches(report: &Report) -> Section {
    if report.breaches.is_empty() {
        return Section { title: "Breaches: none".into(), ..Section::default() };
    }
    let mut table =
        Table::default().words(["limit", "row,col"]).figures(["count", "limit"]).figures_of_page(["excess"]);
    table = table.figures(["refused", "RMS m", "without"]).long([usize::MAX, 100], "breaches.csv");
    for breach in &report.breaches {
        let amounts = [breach.count, breach.limit, breach.excess].map(|count| amount(breach, count));
        let without = breach.rms_without_m.map_or(String::new(), |rms_m| format!("{rms_m:.3}"));
        let found = [breach.refused.to_string(), format!("{:.3}", breach.rms_with_m), without];
        table.add(limit_at(&breach.kind, breach.place), amounts.into_iter().chain(found));
    }
    let title = "Breaches, and the RMS residual without the limit".into();
    let files = "All of them with their places: breaches.csv, breaches.geojson.";
    Section { title, table, explained: vec![files.into()], ..Section::default() }
}

/// A count; of a residual, which is counted in millimetres, the metres.
fn amount(breach: &ReportBreach, count: u64) -> String {
    if breach.kind == "residual" { format!("{}.{:03} m", grouped(count / 1000), count % 1000) } else { grouped(count) }
}

/// Heads of the figures of a residual, and the figures; some of those are not known everywhere.
const RESIDUAL_HEADS: [&str; 5] = ["RMS", "mean abs", "95 %", "99 %", "largest"];

fn residual_cells(residual: Residual) -> [String; 5] {
    let Residual { rms_m, max_m, rest } = residual;
    let [rms, max] = decimals([(rms_m, 3), (max_m, 2)]);
    let [mean_abs, p95, p99] = rest.map_or_else(Default::default, |[a, b, c]| decimals([(a, 3), (b, 2), (c, 2)]));
    [rms, mean_abs, p95, p99, max]
}

fn residuals(report: &Report) -> Section {
    let mut table = Table::default().words(["Residuals in m, against"]).figures(RESIDUAL_HEADS);
    told(report).into_iter().for_each(|(words, residual)| table.add([words], residual_cells(residual)));
    let eta = report.limit.and_then(eta_of).map(|eta| format!("Eta: {eta}."));
    Section { table, explained: Vec::from_iter(eta), ..Section::default() }
}

/// Residuals of classes, and of load modules at the outer border of the area and inside.
fn working_ground(report: &Report) -> Section {
    let mut table = Table::default().words(["Working ground, m"]).figures(["posts", "points"]).figures(RESIDUAL_HEADS);
    let mut row = |name: &str, counts: [String; 2], figures| table.add([name], counts.into_iter().chain(figures));
    let posts: u64 = report.classes.iter().map(|class| class.posts).sum();
    let posts = if report.classes.is_empty() { String::new() } else { grouped(posts) };
    row("all posts", [posts, grouped(report.points.total)], residual_cells(report.residual.into()));
    for class in &report.classes {
        // A hole, or a class that lies nowhere in the area: nothing is measured there.
        let none = || ["-"; 5].map(str::to_owned);
        let posts = if class.posts == 0 { "-".into() } else { grouped(class.posts) };
        let figures = if class.posts == 0 { none() } else { residual_cells(class.residual.into()) };
        row(&class.name, [posts, grouped(class.points)], figures);
    }
    for (name, part) in report.border.iter().flat_map(|of| [("outer border", of.at_border), ("inside", of.inside)]) {
        let residual = Residual { rms_m: part.rms_m, max_m: part.max_m, rest: None };
        row(name, [grouped(part.posts), String::new()], residual_cells(residual));
    }
    let mut notes = Vec::new();
    if 1 < report.classes.len() {
        let by_points = report.overall_point_weighted_rms_m;
        notes.push(format!("RMS of the classes weighted by points, as in the founding paper: {by_points:.3} m."));
    }
    notes.extend(report.heights.as_ref().map(heights_in_words));
    notes.extend(report.dem_accuracy_m.map(|accuracy_m| format!("The source states an accuracy of {accuracy_m} m.")));
    if 0 < report.voids.count {
        let [voids, filled] = [report.voids.count, report.voids.filled].map(grouped);
        notes.push(format!("Posts without a height in the source: {voids}, of which {filled} were filled."));
    }
    Section { table, notes, ..Section::default() }
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

/// Heights of the surface beside those of its sources.
fn heights_in_words(heights: &ReportHeights) -> String {
    let range = |[low, high]: [f64; 2]| format!("{low:.2} to {high:.2} m");
    let surface = format!("Heights {}", range(heights.surface_m));
    match heights.sources_m {
        None => format!("{surface}."),
        Some(sources_m) if heights.outside_m == 0.0 => format!("{surface}, sources {}.", range(sources_m)),
        Some(sources_m) => format!("{surface}, sources {}, {:.2} m beyond.", range(sources_m), heights.outside_m),
    }
}

/// Levels of detail, where there are several.
fn levels(report: &Report) -> Option<Section> {
    let finest = report.levels.first()?.triangles as f64;
    let heads = ["inner share", "triangles", "of level 0", "RMS m", "largest m"];
    let mut table = Table::default().words(["Levels of detail"]).figures(heads);
    for level in &report.levels {
        let of_finest = format!("{} %", percent(level.triangles as f64, finest, 0));
        let counts = [level.level.to_string(), level.inner_share.to_string(), grouped(level.triangles), of_finest];
        table.add(counts, decimals([(level.rms_m, 3), (level.max_m, 2)]));
    }
    let explained = vec!["Limits are about level 0; the others are for what is far away.".into()];
    Some(Section { table, explained, ..Section::default() })
}

/// One row per stage and one for all: wall and CPU seconds, workers, share of the workers' time that was busy, and
/// share of the wall time.
pub(crate) fn stages(stages: &[ReportStage], workers: u32) -> Option<Section> {
    let mut table = Table::default().words(["Stages"]).figures(["wall s", "cpu s", "workers", "busy %", "of all %"]);
    let wall_s: f64 = stages.iter().map(|stage| stage.wall_s).sum();
    let cpu_s: f64 = stages.iter().map(|stage| stage.cpu_s).sum();
    let total = ReportStage { name: "all".into(), wall_s, cpu_s };
    for stage in stages.iter().chain([&total]) {
        let [wall, cpu] = decimals([(stage.wall_s, 2), (stage.cpu_s, 2)]);
        let busy = percent(stage.cpu_s, stage.wall_s * f64::from(workers), 0);
        let share = Cell::Share(percent(stage.wall_s, wall_s, 0), stage.wall_s / wall_s);
        table.add([stage.name.clone(), wall, cpu, workers.to_string(), busy], [share]);
    }
    (!stages.is_empty()).then(|| Section { table, ..Section::default() })
}

/// The table of stages for a terminal: whole lines.
pub fn stages_text(of: &[ReportStage], workers: u32) -> String {
    stages(of, workers).map_or_else(String::new, |section| section.text())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::samples;

    #[test]
    fn levels_are_a_table_where_there_are_several() {
        assert_eq!(levels(&samples::report()), None);
        let text = levels(&samples::with_levels()).unwrap().text();
        let lines: Vec<Vec<&str>> = text.lines().map(|line| line.split_whitespace().collect()).collect();
        assert_eq!(lines.len(), 4);
        assert_eq!(lines[2], ["1", "0.5", "223,000", "70", "%", "4.250", "60.50"]);
    }

    #[test]
    fn a_stage_without_time_has_no_share() {
        let text = stages_text(&[ReportStage { name: "read".into(), wall_s: 0.0, cpu_s: 0.0 }], 2);
        assert!(text.contains('-') && !text.contains("NaN"), "{text}");
    }
}
