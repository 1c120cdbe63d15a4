//! Tables of the page: limits and advice, residuals, breaches, times, sources.

use maud::{Markup, html};
use store::{Manifest, Report, ReportEarthworks, ReportFeatures, ReportObjectLimit, ReportObjects, ReportResidual};

use super::advise;
use super::marks::{BOUND_ROWS_MAX, Marks, ROWS_MAX};
use crate::against::{Residual, WORKING, told};
use crate::features_text::{
    amounts, check_rows, clearances_in_words, cost, earthwork, is_thin, kept, remarks_in_words,
};
use crate::objects_text::objects_row;
use crate::report::{border_in_words, eta_of, heights_in_words};
use crate::table::grouped;

pub(super) fn verdict(report: &Report) -> Markup {
    let breaches = report.breaches.len() as u64;
    let is_short = 0 < breaches || !report.warnings.is_empty();
    html! {
        div.verdict.breached[is_short] {
            @if 0 < breaches {
                p {
                    b { (grouped(breaches)) } @if breaches == 1 { " limit is" } @else { " limits are" }
                    " not met: see " a href="#breaches" { "breaches" } "."
                }
            }
            @for warning in &report.warnings { p { b { "Warning: " } (warning) } }
            @if breaches == 0 { p { "Every limit is met." } }
        }
    }
}

/// How much of every class is in the ground, in a line; too little of one stands out.
pub(super) fn in_the_ground(features: &ReportFeatures) -> Markup {
    let told: Vec<_> = features.classes.iter().filter_map(|class| Some((class, kept(class)?))).collect();
    html! {
        @if !told.is_empty() {
            p.kept { "In the ground: "
                @for (at, (class, kept)) in told.iter().enumerate() {
                    @if 0 < at { ", " }
                    span.thin[is_thin(class)] {
                        (class.name) " " (format!("{:.1} %", 100.0 * kept))
                        @if 0.0 < class.wanted_km { (format!(" of {:.1} km", class.wanted_km)) }
                        @else { " of " (grouped(class.lakes_wanted)) " lakes of a hectare" }
                    }
                }
                "."
            }
        }
    }
}

/// A table that scrolls by itself where it is wider than the screen, and repeats its head where it goes on on paper.
pub(crate) fn table(head: Markup, rows: Markup) -> Markup {
    html! { div.wide tabindex="0" { table { thead { tr { (head) } } tbody { (rows) } } } }
}

pub(super) fn limits(report: &Report, marks: &Marks) -> Markup {
    let (modules, windows) = (report.per_load_module, report.per_4km);
    let rows = [
        (
            "limits.per_load_module",
            grouped(modules.max),
            grouped(modules.limit),
            modules.max as f64 / modules.limit as f64,
            modules.over,
        ),
        (
            "limits.mean_per_load_module",
            format!("{:.2}", modules.mean),
            modules.mean_limit.to_string(),
            modules.mean / modules.mean_limit,
            u64::from(modules.mean_limit < modules.mean),
        ),
        (
            "limits.per_4km_square",
            grouped(windows.max),
            grouped(windows.limit),
            windows.max as f64 / windows.limit as f64,
            windows.over,
        ),
    ];
    html! {
        (table(html! {
            th { "Limit, in " (report.count) } th.n { "most used" } th.n { "limit" }
            th.n { "use" } th.n { "above" }
        }, html! {
            @for (name, used, limit, share, over) in rows {
                tr {
                    td { code { (name) } } td.n { (used) } td.n { (limit) }
                    td.n { (format!("{:.1} %", 100.0 * share)) } td.n { (grouped(over)) }
                }
            }
            tr {
                td { code { "limits.pool" } } td.n { (grouped(report.pool.used)) } td.n { (grouped(report.pool.size)) }
                td.n {} td.n {}
            }
        }))
        p.quiet { "The fullest 9 x 9 load modules, which bound a 4 km square at any offset, hold "
            (grouped(windows.worst_9x9)) " " (report.count) "." }
        (bound(report, marks))
    }
}

/// Where limits were met by refusing posts, and what that cost.
fn bound(report: &Report, marks: &Marks) -> Markup {
    let refused = &report.refusals;
    if refused.count == 0 {
        return html! { p { "No limit kept a post out." } };
    }
    html! {
        h3 { "Where limits kept posts out" }
        p {
            (grouped(refused.count)) " posts were refused: "
            (grouped(refused.by_module)) " by the limit of a load module, "
            (grouped(refused.by_window)) " by that of a 4 km square, " (grouped(refused.by_reservation))
            " to keep what a neighbour's side was promised. The largest residual among them is "
            (format!("{:.2} m", refused.largest_m)) "."
        }
        @if !report.bound.is_empty() {
            (table(html! { th { "Limit" } th { "Where" } th.n { "count" } th.n { "limit" } th.n { "refused" }
                    th.n { "largest, m" } th.n { "RMS, m" } th.n { "RMS without the limit, m" } }, html! {
                @for bound in report.bound.iter().take(BOUND_ROWS_MAX) {
                    tr {
                        td { code { (bound.kind) } } td { (marks.link(bound.place)) } td.n { (grouped(bound.count)) }
                        td.n { (grouped(bound.limit)) } td.n { (bound.refused) }
                        td.n { (format!("{:.2}", bound.refused_largest_m)) }
                        td.n { (format!("{:.3}", bound.rms_with_m)) }
                        td.n { (format!("{:.3}", bound.rms_without_m)) }
                    }
                }
        }))
            (more(report.bound.len(), BOUND_ROWS_MAX, "report.json"))
        }
    }
}

fn more(rows: usize, shown: usize, file: &str) -> Markup {
    html! {
        @if shown < rows { p.quiet { "and " (grouped((rows - shown) as u64)) " more in " code { (file) } "." } }
    }
}

pub(super) fn advice(report: &Report) -> Markup {
    let advice = advise(report);
    html! {
        h3 { "What to change" }
        @if advice.is_empty() { p { "Nothing binds: more would need finer ground, not other limits." } }
        @for advice in advice {
            div.advice {
                p { b { (advice.policy) } ": " (advice.found) }
                p { code { (advice.change) } }
                p { (advice.effect) }
            }
        }
    }
}

pub(super) fn residuals(report: &Report) -> Markup {
    let row = |name: &str, [posts, points]: [String; 2], [rms_m, max_m]: [f64; 2], rest: Option<[f64; 3]>| {
        html! {
            tr {
                td { (name) } td.n { (posts) } td.n { (points) }
                td.n { (format!("{rms_m:.3}")) } td.n { (format!("{max_m:.2}")) }
                @match rest {
                    Some([mean_abs_m, p95_m, p99_m]) => {
                        td.n { (format!("{mean_abs_m:.3}")) } td.n { (format!("{p95_m:.2}")) }
                        td.n { (format!("{p99_m:.2}")) }
                    }
                    None => @for _ in 0..3 { td.n {} }
                }
            }
        }
    };
    let posts = grouped(report.classes.iter().map(|class| class.posts).sum());
    html! {
        (table(html! { th { "Residuals in metres, against" } th.n { "posts" } th.n { "points" }
                th.n { "RMS" } th.n { "largest" }
                th.n { "mean" } th.n { "95 %" } th.n { "99 %" } }, html! {
            @for (words, Residual { rms_m, max_m, rest }) in told(report) {
                @let all = [posts.clone(), grouped(report.points.total)];
                @let counts = if words == WORKING { all } else { Default::default() };
                (row(words, counts, [rms_m, max_m], rest))
            }
            @for class in &report.classes {
                @if class.posts == 0 {
                    tr {
                        td { "of it " (&class.name) }
                        td.n { "-" }
                        td.n { (grouped(class.points)) }
                        @for _ in 0..5 { td.n { "-" } }
                    }
                } @else {
                    @let ReportResidual { rms_m, max_m, mean_abs_m, p95_m, p99_m } = class.residual;
                    @let counts = [grouped(class.posts), grouped(class.points)];
                    (row(&format!("of it {}", class.name), counts, [rms_m, max_m], Some([mean_abs_m, p95_m, p99_m])))
                }
            }
        }))
        @if 1 < report.classes.len() {
            p.quiet {
                "Pooled by points, as the founding paper's Table 2 prints its overall figure: RMS "
                (format!("{:.3} m", report.overall_point_weighted_rms_m)) "."
            }
        }
        @if let Some(eta) = report.limit.and_then(eta_of) {
            p.quiet { "Eta: " (eta) "." }
        }
        @if let Some(border) = &report.border {
            p.quiet { "Load modules " (border_in_words(border)) "." }
        }
        @if let Some(heights) = &report.heights {
            p.quiet { "Surface: " (heights_in_words(heights)) "." }
        }
        @if let Some(accuracy_m) = report.dem_accuracy_m {
            p.quiet { "The source states an accuracy of " (accuracy_m) " m." }
        }
        @if 0 < report.voids.count {
            p.quiet {
                "Posts without a height in the source: " (grouped(report.voids.count)) ", of which "
                (grouped(report.voids.filled)) " were filled."
            }
        }
    }
}

/// Levels of detail, where there are several.
pub(super) fn levels(report: &Report) -> Markup {
    let finest = report.levels.first().map_or(0, |level| level.triangles);
    html! {
        @if !report.levels.is_empty() {
            h3 { "Levels of detail" }
            (table(html! { th { "Level" } th.n { "inner vertices" } th.n { "triangles" } th.n { "of level 0" }
                    th.n { "RMS, m" } th.n { "largest, m" } }, html! {
                @for level in &report.levels {
                    tr {
                        td { (level.level) } td.n { (format!("{} %", 100.0 * level.inner_share)) }
                        td.n { (grouped(level.triangles)) }
                        td.n { (format!("{:.1} %", 100.0 * level.triangles as f64 / finest.max(1) as f64)) }
                        td.n { (format!("{:.3}", level.rms_m)) } td.n { (format!("{:.2}", level.max_m)) }
                    }
                }
        }))
            p.quiet { "Limits are about level 0; the others are for what is far away." }
        }
    }
}

/// What roads and water cost, and what must hold of them.
pub(super) fn features(features: &ReportFeatures) -> Markup {
    let row = |name: &str, is_thin: bool, amounts: [String; 5], costs: [String; 3]| {
        html! { tr { td.thin[is_thin] { (name) } @for cell in amounts.iter().chain(&costs) { td.n { (cell) } } } }
    };
    html! {
        (table(html! { th { "Class" } th.n { "km" } th.n { "of km wanted" } th.n { "kept" } th.n { "as strips, km" }
            th.n { "lakes" }
                th.n { "triangles" } th.n { "most of a load module" } th.n { "most of a 4 km square" } }, html! {
            @for class in &features.classes { (row(&class.name, is_thin(class), amounts(class), cost(&class.cost))) }
            (row("all", false, [const { String::new() }; 5], cost(&features.all)))
        }))
        p { (remarks_in_words(features)) "." }
        (table(html! { th { "What must hold" } th { "found" } }, html! {
            @for (what, found) in check_rows(&features.checks) { tr { td { (what) } td { (found) } } }
        }))
        @if let Some(words) = clearances_in_words(features) { p.quiet { "The " (words) "." } }
        @if !features.earthworks.classes.is_empty() { (earthworks(&features.earthworks)) }
    }
}

/// How much of what stands on the ground has room.
pub(super) fn objects(objects: &ReportObjects) -> Markup {
    let limit = |of: ReportObjectLimit| format!("{} of {}", grouped(of.max), grouped(of.limit));
    html! {
        (table(html! { th { "Kind" } th.n { "kept" } th.n { "of" } th.n { "m2 seen from the side" } th.n { "of" }
            th.n { "kept" } }, html! {
            @for [kind, numbers @ ..] in objects.kinds.iter().map(objects_row) {
                tr { td { (kind) } @for cell in numbers { td.n { (cell) } } }
            }
        }))
        p {
            (grouped(objects.polygons)) " roofs, walls and triangles of woods: " (limit(objects.per_load_module))
            " in the fullest load module, " (limit(objects.per_4km)) " in the fullest square of 4 km. "
            (grouped(objects.left_out)) " had no room; " (grouped(objects.remarks)) " remarks, in objects.geojson."
        }
    }
}

/// What roads, rivers and lakes move, and where they lie farthest off the ground.
fn earthworks(works: &ReportEarthworks) -> Markup {
    html! {
        (table(html! { th { "Cut and fill" } th.n { "km" } th.n { "% > 3 m off" } th.n { "> 5 m" } th.n { "> 10 m" }
            th.n { "> 20 m" } th.n { "over limit" } th.n { "cut, m3/km" } th.n { "fill, m3/km" } }, html! {
            @for class in &works.classes {
                tr { td { (class.name) } @for cell in earthwork(class) { td.n { (cell) } } }
            }
        }))
        @if !works.worst.is_empty() {
            (table(html! { th { "Farthest off the ground" } th { "class" } th.n { "east" } th.n { "north" }
                th.n { "m above" } th { "because of" } }, html! {
                @for far in &works.worst {
                    tr { td { (far.feature) } td { (far.class) } td.n { (format!("{:.0}", far.at_m[0])) }
                        td.n { (format!("{:.0}", far.at_m[1])) } td.n { (format!("{:.1}", far.off_m)) }
                        td { (far.cause) } }
                }
            }))
        }
    }
}

pub(super) fn breaches(report: &Report, marks: &Marks) -> Markup {
    if report.breaches.is_empty() {
        return html! { p { "None." } };
    }
    html! {
        p { "All of them with their places: " code { "breaches.csv" } ", " code { "breaches.geojson" } "." }
        (table(html! {
            th { "Limit" } th { "Where" } th.n { "count" } th.n { "limit" } th.n { "excess" } th.n { "refused" }
            th.n { "RMS, m" } th.n { "RMS without the limit, m" } }, html! {
            @for breach in report.breaches.iter().take(ROWS_MAX) {
                tr {
                    td { code { (breach.kind) } } td { (marks.link(breach.place)) }
                    @for count in [breach.count, breach.limit, breach.excess] {
                        td.n { (crate::report::amount(breach, count)) }
                    }
                    td.n { (breach.refused) } td.n { (format!("{:.3}", breach.rms_with_m)) }
                    td.n { @if let Some(rms_m) = breach.rms_without_m { (format!("{rms_m:.3}")) } }
                }
            }
        }))
        (more(report.breaches.len(), ROWS_MAX, "breaches.csv"))
    }
}

pub(super) fn stages(report: &Report) -> Markup {
    let wall_s: f64 = report.stages.iter().map(|stage| stage.wall_s).sum();
    let cpu_s: f64 = report.stages.iter().map(|stage| stage.cpu_s).sum();
    html! {
        p.quiet { (format!("{wall_s:.2} s with {} workers.", report.workers)) }
        (table(html! { th { "Stage" } th.n { "wall, s" } th.n { "cpu, s" } th { "share of the time" } }, html! {
            @for stage in &report.stages {
                tr {
                    td { (stage.name) }
                    td.n { (format!("{:.2}", stage.wall_s)) } td.n { (format!("{:.2}", stage.cpu_s)) }
                    td.share { span.bar style=(format!("width:{:.1}%", 100.0 * stage.wall_s / wall_s.max(1e-9))) {} }
                }
            }
            tr { td { b { "all" } } td.n { (format!("{wall_s:.2}")) } td.n { (format!("{cpu_s:.2}")) } td {} }
        }))
    }
}

pub(super) fn sources(manifest: &Manifest) -> Markup {
    html! {
        div.stack { (table(html! { th { "Source" } th { "BLAKE3 of its content" } th { "Attribution" } }, html! {
            @for source in &manifest.sources {
                tr {
                    td { code { (source.path) } } td { code { (source.blake3.to_string()) } }
                    td { (source.attribution.as_deref().unwrap_or("")) }
                }
            }
        })) }
        p.quiet {
            "Algorithm revision " (manifest.algorithm_revision) ", database format " (manifest.format_version) "."
        }
    }
}
