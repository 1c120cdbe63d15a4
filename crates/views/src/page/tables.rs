//! Tables of the page: limits and advice, residuals, breaches, times, sources.

use maud::{Markup, html};
use store::{Manifest, Report, ReportEarthworks, ReportFeatures, ReportObjectLimit, ReportObjects, ReportResidual};

use super::advise;
use super::marks::{BOUND_ROWS_MAX, Marks, ROWS_MAX};
use crate::against::{Residual, WORKING, objects_row, told};
use crate::features_text::{
    amounts, check_rows, clearances_in_words, cost, earthwork, is_thin, kept, remarks_in_words,
};
use crate::report::{amount, border_in_words, bound_cells, breach_cells, decimals, eta_of, heights_in_words};
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

/// Heads of columns: first those of texts, then those of figures.
pub(super) fn heads(texts: &[&str], figures: &[&str]) -> Markup {
    html! { @for head in texts { th { (head) } } @for head in figures { th.n { (head) } } }
}

/// Cells of columns of figures.
fn figures(cells: impl IntoIterator<Item = String>) -> Markup {
    html! { @for cell in cells { td.n { (cell) } } }
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
        (table(heads(&[&format!("Limit, in {}", report.count)], &["most used", "limit", "use", "above"]), html! {
            @for (name, used, limit, share, over) in rows {
                tr { td { code { (name) } } (figures([used, limit, format!("{:.1} %", 100.0 * share), grouped(over)])) }
            }
            tr {
                td { code { "limits.pool" } }
                (figures([grouped(report.pool.used), grouped(report.pool.size), String::new(), String::new()]))
            }
        }))
        p.quiet { "A 4 km square at any offset holds " (grouped(windows.worst_9x9)) " " (report.count) " at most, "
            "as many as the fullest square of load modules that is one of them wider." }
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
            @let columns = ["count", "limit", "refused", "largest, m", "RMS, m", "RMS without the limit, m"];
            (table(heads(&["Limit", "Where"], &columns), html! {
                @for bound in report.bound.iter().take(BOUND_ROWS_MAX) {
                    @let [count, limit, _, rest @ ..] = bound_cells(bound);
                    @let cells = [count, limit, bound.refused.to_string()].into_iter().chain(rest);
                    tr { td { code { (bound.kind) } } td { (marks.link(bound.place)) } (figures(cells)) }
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
    let row = |name: &str, counts: [String; 2], [rms_m, max_m]: [f64; 2], rest: Option<[f64; 3]>| {
        let rest = rest.map_or_else(Default::default, |rest| decimals([(rest[0], 3), (rest[1], 2), (rest[2], 2)]));
        let cells = counts.into_iter().chain(decimals([(rms_m, 3), (max_m, 2)])).chain(rest);
        html! { tr { td { (name) } (figures(cells)) } }
    };
    let posts = grouped(report.classes.iter().map(|class| class.posts).sum());
    html! {
        @let columns = ["posts", "points", "RMS", "largest", "mean", "95 %", "99 %"];
        (table(heads(&["Residuals in metres, against"], &columns), html! {
            @for (words, Residual { rms_m, max_m, rest }) in told(report) {
                @let all = [posts.clone(), grouped(report.points.total)];
                @let counts = if words == WORKING { all } else { Default::default() };
                (row(words, counts, [rms_m, max_m], rest))
            }
            @for class in &report.classes {
                @if class.posts == 0 {
                    @let none = ["-"; 5].map(str::to_owned);
                    tr {
                        td { "of it " (&class.name) }
                        (figures(["-".to_owned(), grouped(class.points)].into_iter().chain(none)))
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
            @let columns = ["inner vertices", "triangles", "of level 0", "RMS, m", "largest, m"];
            (table(heads(&["Level"], &columns), html! {
                @for level in &report.levels {
                    @let shares = [level.inner_share, level.triangles as f64 / finest.max(1) as f64];
                    @let [inner, of_finest] = shares.map(|share| 100.0 * share);
                    @let counts = [format!("{inner} %"), grouped(level.triangles), format!("{of_finest:.1} %")];
                    @let residuals = decimals([(level.rms_m, 3), (level.max_m, 2)]);
                    tr { td { (level.level) } (figures(counts.into_iter().chain(residuals))) }
                }
            }))
            p.quiet { "Limits are about level 0; the others are for what is far away." }
        }
    }
}

/// What roads and water cost, and what must hold of them.
pub(super) fn features(features: &ReportFeatures) -> Markup {
    let row = |name: &str, is_thin: bool, amounts: [String; 5], costs: [String; 3]| {
        html! { tr { td.thin[is_thin] { (name) } (figures(amounts.into_iter().chain(costs))) } }
    };
    let amount_heads = ["km", "of km wanted", "kept", "as strips, km", "lakes"];
    let columns = [&amount_heads[..], &["triangles", "most of a load module", "most of a 4 km square"]].concat();
    html! {
        (table(heads(&["Class"], &columns), html! {
            @for class in &features.classes { (row(&class.name, is_thin(class), amounts(class), cost(&class.cost))) }
            (row("all", false, [const { String::new() }; 5], cost(&features.all)))
        }))
        p { (remarks_in_words(features)) "." }
        (table(heads(&["What must hold", "found"], &[]), html! {
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
        (table(heads(&["Kind"], &["kept", "of", "m2 seen from the side", "of", "kept"]), html! {
            @for [kind, numbers @ ..] in objects.kinds.iter().map(objects_row) {
                tr { td { (kind) } (figures(numbers)) }
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
    let far = ["km", "% > 3 m off", "> 5 m", "> 10 m", "> 20 m", "over limit"];
    html! {
        (table(heads(&["Cut and fill"], &[&far[..], &["cut, m3/km", "fill, m3/km"]].concat()), html! {
            @for class in &works.classes { tr { td { (class.name) } (figures(earthwork(class))) } }
        }))
        @if !works.worst.is_empty() {
            (table(html! { th { "Farthest off the ground" } th { "class" } th.n { "east" } th.n { "north" }
                th.n { "m above" } th { "because of" } }, html! {
                @for far in &works.worst {
                    @let cells = decimals([(far.at_m[0], 0), (far.at_m[1], 0), (far.off_m, 1)]);
                    tr { td { (far.feature) } td { (far.class) } (figures(cells)) td { (far.cause) } }
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
        @let columns = ["count", "limit", "excess", "refused", "RMS, m", "RMS without the limit, m"];
        (table(heads(&["Limit", "Where"], &columns), html! {
            @for breach in report.breaches.iter().take(ROWS_MAX) {
                @let [count, limit, rest @ ..] = breach_cells(breach);
                @let cells = [count, limit, amount(breach, breach.excess)].into_iter().chain(rest);
                tr { td { code { (breach.kind) } } td { (marks.link(breach.place)) } (figures(cells)) }
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
                    td { (stage.name) } (figures(decimals([(stage.wall_s, 2), (stage.cpu_s, 2)])))
                    td.share { span.bar style=(format!("width:{:.1}%", 100.0 * stage.wall_s / wall_s.max(1e-9))) {} }
                }
            }
            tr { td { b { "all" } } (figures(decimals([(wall_s, 2), (cpu_s, 2)]))) td {} }
        }))
    }
}

pub(super) fn sources(manifest: &Manifest) -> Markup {
    html! {
        div.stack { (table(heads(&["Source", "BLAKE3 of its content", "Attribution"], &[]), html! {
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
