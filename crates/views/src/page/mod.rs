//! `report.html`: one file with everything in it that a person wants to know of a database, for a screen and for paper.
//!
//! It loads nothing: style, charts and pictures are inside. Nothing of it runs.

mod about;
mod advice;
mod charts;
mod maps;
mod marks;
mod section;

pub use about::PageSetting;
pub(crate) use advice::advise;
pub(crate) use advice::place_text;
pub(crate) use marks::Marks;
pub(crate) use section::body;

use maud::{DOCTYPE, Markup, PreEscaped, html};
use store::{Manifest, Report};
use terrain::{Each, LoadModule, ModuleId};

use crate::against::leading;
use crate::parts::{Part, parts};
use crate::picture::{RESIDUAL_SCALE_M, Scene};
use crate::section::Section;
use crate::table::grouped;

use charts::Histogram;
use maps::{Figure, Figures};

/// What the page is made from.
#[derive(Clone, Copy, Debug)]
pub struct Page<'a> {
    /// What stands above it, if the job says so; otherwise the name of the area.
    pub title: Option<&'a str>,
    /// What the build found.
    pub report: &'a Report,
    /// What was built, and from what.
    pub manifest: &'a Manifest,
    /// With which settings.
    pub settings: &'a [PageSetting],
    /// All of it to be drawn; without one, the page has no maps.
    pub scene: Option<&'a Scene<'a>>,
}

/// Metres that an observer sees, unless he is told otherwise.
const VISIBLE_M: f64 = 3500.0;
/// Load modules that are shown as the worst.
const WORST_COUNT: usize = 10;

/// The whole page; `each` draws its maps one beside the other.
pub fn report_html(page: &Page, each: Each) -> String {
    let Page { report, manifest, .. } = page;
    let parts = parts(report);
    let worst_modules = page.scene.map(worst_modules).unwrap_or_default();
    let worst_ids: Vec<ModuleId> = worst_modules.iter().map(|module| module.id).collect();
    let marks = &Marks::of(&parts, page.scene, &worst_ids);
    let figures = page.scene.map(|scene| Figures::of(report, scene, marks, each));
    let chapters = chapters(page, &parts, marks, figures.as_ref(), &worst_modules);
    let title = page.title.map_or_else(|| format!("Gaming area {}", report.area), str::to_owned);
    let body = html! {
        p.quiet { @if page.title.is_some() { "Gaming area " (report.area) ": " } (what_it_is(manifest)) }
        div.first[page.scene.is_some()] {
            @if let Some(figures) = &figures { div { (figures.get(Figure::First)) } }
            div {
                (about::verdict(report))
                @if let Some(features) = &report.features { (about::in_the_ground(features)) }
                (headline(page))
                nav { @for chapter in &chapters { a href={ "#" (chapter.id) } { (chapter.name) } } }
            }
        }
        main {
            @for Chapter { id, title, is_whole, body, .. } in &chapters {
                section.whole[*is_whole] id=(id) { h2 { (title) } (body) }
            }
        }
    };
    document(&title, &body)
}

/// A chapter of the page, to which its beginning links.
struct Chapter<'a> {
    id: &'static str,
    /// What the link says.
    name: &'static str,
    /// What stands above it.
    title: &'a str,
    is_whole: bool,
    body: Markup,
}

/// Parts of the report with what only a page has of them, and in between what lies on maps.
fn chapters<'a>(
    page: &Page,
    parts: &'a [Part],
    marks: &Marks,
    figures: Option<&Figures>,
    worst: &[&LoadModule],
) -> Vec<Chapter<'a>> {
    let chapter = |id, name, is_whole, body| Chapter { id, name, title: name, is_whole, body };
    let mut chapters = Vec::new();
    for Part { id, name, sections } in parts {
        let ways = || html! { @if let Some(figures) = figures { (figures.get(Figure::Features)) } };
        let more = match *id {
            "limits" => about::advice(page.report),
            "residuals" => histograms(page),
            "features" => ways(),
            "objects" if page.report.features.is_none() => ways(),
            _ => html! {},
        };
        if *id == "breaches" {
            match page.scene.zip(figures) {
                Some((scene, figures)) => {
                    chapters.push(chapter("maps", "Maps", true, figures.maps()));
                    let worst = worst_modules_of(page, scene, worst, marks);
                    chapters.push(chapter("worst", "Worst load modules", true, worst));
                }
                None => chapters.push(chapter("maps", "Maps", false, without_maps())),
            }
        }
        let title = if sections[0].title.is_empty() { name } else { sections[0].title.as_str() };
        let body = html! { (in_sections(sections, marks)) (more) };
        chapters.push(Chapter { title, ..chapter(id, name, false, body) });
    }
    let made_from = in_sections(&about::made_from(page.manifest, page.settings), marks);
    chapters.push(chapter("made-from", "Made from", false, html! { div.stack { (made_from) } }));
    chapters
}

/// Sections of a chapter, above which the title of the first stands.
fn in_sections(sections: &[Section], marks: &Marks) -> Markup {
    html! {
        @for (at, section) in sections.iter().enumerate() {
            @if 0 < at && !section.title.is_empty() { h3 { (section.title) } }
            (body(section, marks))
        }
    }
}

/// One file that loads nothing and runs nothing, in the style of all pages.
pub(crate) fn document(title: &str, body: &Markup) -> String {
    let page = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                meta name="color-scheme" content="light dark";
                title { (title) }
                style { (PreEscaped(include_str!("style.css"))) }
            }
            body { h1 { (title) } (body) }
        }
    };
    page.into_string()
}

fn without_maps() -> Markup {
    html! {
        p.quiet {
            "A build draws no maps of an area as large as this, because all its load modules would have to be in "
            "memory at once. " code { "tiefort render DIR --view density --out map.png" } " draws one, "
            code { "tiefort report DIR --format html" } " this page with all of them."
        }
    }
}

fn what_it_is(manifest: &Manifest) -> String {
    let area = &manifest.area;
    let datum = match area.vertical_datum.as_str() {
        "" => "an unknown vertical datum",
        datum => datum,
    };
    format!(
        "{} x {} km from {} {} in {}, heights above {datum}; {} load modules of {} m, posts {} m apart.",
        area.size_m[0] / 1000.0,
        area.size_m[1] / 1000.0,
        area.origin_m[0],
        area.origin_m[1],
        area.crs,
        grouped(u64::from(area.module_rows) * u64::from(area.module_cols)),
        area.module_side_m,
        area.spacing_m
    )
}

fn headline(page: &Page) -> Markup {
    let report = page.report;
    let modules = report.per_load_module;
    let (against, residual) = leading(report);
    let figures = [
        (grouped(report.triangles), format!("triangles, {:.2} in the mean load module", modules.mean)),
        (grouped(report.points.total), "points".into()),
        (format!("{:.3} m", residual.rms_m), format!("RMS residual against the {against}")),
        (format!("{:.2} m", residual.max_m), format!("largest residual against the {against}")),
        (
            format!("{} of {}", grouped(modules.max), grouped(modules.limit)),
            format!("{} in the fullest load module", report.count),
        ),
        (
            format!("{} of {}", grouped(report.per_4km.max), grouped(report.per_4km.limit)),
            format!("{} in the fullest 4 km window", report.count),
        ),
        (grouped(report.breaches.len() as u64), "breaches".into()),
        (grouped(report.refusals.count), "posts refused by limits".into()),
    ];
    let seen = page.scene.and_then(most_seen);
    html! {
        div.figures {
            @for (figure, what) in &figures { div { b { (figure) } span { (what) } } }
            @if let Some((count, module)) = seen {
                div {
                    b { (grouped(count)) }
                    span {
                        "triangles at most within " (VISIBLE_M / 1000.0) " km of an observer, in load module " (module)
                    }
                }
            }
        }
    }
}

/// The most triangles that an observer in the middle of a load module has within his visible range, and in which: those
/// of every load module that any part of lies so near.
fn most_seen(scene: &Scene) -> Option<(u64, ModuleId)> {
    let side_m = scene.side_m();
    let reach = (VISIBLE_M / side_m + 0.5).ceil() as i64;
    let gap = |off: i64| ((off.abs() as f64 - 0.5) * side_m).max(0.0);
    let offsets: Vec<(i64, i64)> = (-reach..=reach)
        .flat_map(|row| (-reach..=reach).map(move |col| (row, col)))
        .filter(|&(row, col)| gap(row) * gap(row) + gap(col) * gap(col) <= VISIBLE_M * VISIBLE_M)
        .collect();
    let counts: Vec<u64> = scene.modules.iter().map(|module| u64::from(module.counts().triangles)).collect();
    let (rows, cols) = (i64::from(scene.grid.rows), i64::from(scene.grid.cols));
    let seen = |module: ModuleId| -> u64 {
        let places = offsets.iter().map(|(row, col)| (i64::from(module.row) + row, i64::from(module.col) + col));
        let inside = places.filter(|&(row, col)| 0 <= row && row < rows && 0 <= col && col < cols);
        inside.map(|(row, col)| counts[(row * cols + col) as usize]).sum()
    };
    // The first of equals, so that the page is the same each time.
    scene
        .grid
        .all()
        .iter()
        .map(|module| (seen(module), module))
        .reduce(|best, next| if best.0 < next.0 { next } else { best })
}

fn histograms(page: &Page) -> Markup {
    let Some(scene) = page.scene else { return html! {} };
    let limits = scene.limits;
    let modules =
        Histogram::of_counts(&limits.modules, limits.per_load_module, &format!("{} in a load module", limits.count));
    let residuals = scene.ground.map(|ground| {
        let reach_m = reach_m(page.report.residual.p99_m);
        Histogram::of_metres(
            maps::residuals_m(&ground),
            reach_m,
            "residual of a post in metres; the ends hold the rest",
        )
    });
    html! {
        div.pair {
            figure { figcaption { "Load modules by " (limits.count) } (PreEscaped(modules.svg())) }
            @if let Some(residuals) = residuals {
                figure { figcaption { "Posts by residual: DEM less TIN" } (PreEscaped(residuals.svg())) }
            }
        }
    }
}

/// A round number of metres that 99 of 100 residuals lie within.
fn reach_m(p99_m: f64) -> f64 {
    [0.1, 0.2, 0.5, 1.0, 2.0, 4.0, 5.0, 10.0, 20.0, 50.0, 100.0]
        .into_iter()
        .find(|reach| p99_m <= *reach)
        .unwrap_or(200.0)
}

fn mean_squares(module: &LoadModule) -> f64 {
    match module.residual.posts {
        0 => 0.0,
        posts => module.residual.sum_squared as f64 / f64::from(posts),
    }
}

/// Those with the largest RMS residual, the largest first.
fn worst_modules<'a>(scene: &Scene<'a>) -> Vec<&'a LoadModule> {
    let mut order: Vec<&LoadModule> = scene.modules.iter().collect();
    // Stable: of equals the first from the south-west.
    order.sort_by(|a, b| mean_squares(b).total_cmp(&mean_squares(a)));
    order.truncate(WORST_COUNT);
    order
}

fn worst_modules_of(page: &Page, scene: &Scene, modules: &[&LoadModule], marks: &Marks) -> Markup {
    let quanta = f64::from(terrain::QUANTA_PER_METRE);
    html! {
        p {
            "Those with the largest RMS residual: their triangles, and where the ground lies above them (orange) and "
            "below (purple), " (RESIDUAL_SCALE_M) " m or more where the colour is darkest."
        }
        div.worst {
            @for module in modules {
                article {
                    h3 { (marks.link(store::ReportPlace::Module([module.id.row, module.id.col]))) }
                    (maps::module_images(scene, module))
                    p {
                        "RMS " (format!("{:.2}", mean_squares(module).sqrt() / quanta)) " m, largest "
                        (format!("{:.2}", f64::from(module.residual.largest) / quanta)) " m; "
                        (scene.limits.modules[scene.grid.index(module.id)]) " of " (scene.limits.per_load_module) " "
                        (scene.limits.count) (refused_text(page.report, module.id)) ". "
                        code { "tiefort explain DIR " (module.id) }
                    }
                }
            }
        }
    }
}

fn refused_text(report: &Report, module: ModuleId) -> String {
    let here = store::ReportPlace::Module([module.row, module.col]);
    let refused: u32 = report.bound.iter().filter(|bound| bound.place == here).map(|bound| bound.refused).sum();
    if refused == 0 { String::new() } else { format!(", {refused} posts refused") }
}

#[cfg(test)]
mod tests;
