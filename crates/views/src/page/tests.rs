//! The page as a whole: complete, self-contained, and safe whatever names it is given.

use store::{Area, Fingerprint, Manifest, SourceRecord};
use terrain::{Dem, GridFrame, in_turn};

use super::*;
use crate::picture::{SceneGround, SceneLimits};
use crate::samples;

fn manifest(name: &str) -> Manifest {
    let area = Area {
        name: name.into(),
        crs: "EPSG:32611".into(),
        vertical_datum: String::new(),
        origin_m: [505_000.0, 3_875_000.0],
        size_m: [1500.0, 1000.0],
        spacing_m: 25.0,
        module_side_m: 500.0,
        module_rows: 2,
        module_cols: 3,
        tile_rows: 1,
        tile_cols: 1,
    };
    let mut manifest = Manifest::new(area, "[area]\n".into(), 3);
    let blake3 = Fingerprint::of_bytes(b"ground");
    manifest.sources.push(SourceRecord { path: "dem/<b>.tif".into(), blake3, attribution: Some("R & D".into()) });
    manifest
}

fn limits() -> SceneLimits {
    SceneLimits {
        count: "triangles".into(),
        modules: vec![4, 4, 4, 4, 4, 101],
        per_load_module: 100,
        window: [2, 2],
        windows: vec![16, 113],
        per_window: 4096,
        ..SceneLimits::default()
    }
}

/// The page of the sample terrain, with its ground or without.
fn page_of(name: &str, with_ground: bool) -> String {
    let (modules, limits, mut report) = (samples::modules(), limits(), samples::report());
    (report.area, report.features) = (name.into(), Some(samples::features()));
    report.objects = Some(store::ReportObjects::default());
    let frame = GridFrame { origin_east_m: 505_000.0, origin_north_m: 3_875_000.0, spacing: samples::spacing() };
    let dem = Dem::from_fn(samples::GRID.area(), |post| Some(64_000 + post.col * 320 - post.row * 160));
    let residuals = vec![64; dem.rect().post_count()];
    let scene = Scene {
        name,
        crs: "EPSG:32611",
        grid: samples::GRID,
        frame,
        part: samples::GRID.all(),
        modules: &modules,
        ground: with_ground.then_some(SceneGround { dem: &dem, residuals: &residuals }),
        limits: &limits,
        water: None,
        features: None,
        tiles: &[],
    };
    let settings = [PageSetting { key: "area.name".into(), value: format!("\"{name}\""), meaning: "its name".into() }];
    let (title, scene) = (None, Some(&scene));
    report_html(&Page { title, report: &report, manifest: &manifest(name), settings: &settings, scene }, &in_turn)
}

#[test]
fn a_page_without_maps_says_how_to_come_by_them() {
    let (report, manifest) = (samples::report(), manifest("x"));
    let page =
        report_html(&Page { title: None, report: &report, manifest: &manifest, settings: &[], scene: None }, &in_turn);
    assert!(page.contains("tiefort render DIR") && page.contains("tiefort report DIR --format html"));
    assert!(!page.contains("#worst") && !page.contains("#features"), "a link leads nowhere");
}

#[test]
fn the_page_is_one_file_that_loads_and_runs_nothing() {
    let page = page_of("fort", true);
    for forbidden in ["http://", "https://", "<script", "<link", "@import", "url(", "onload", "src=\"/"] {
        assert!(!page.contains(forbidden), "{forbidden}");
    }
    let sources = page.matches("src=\"").count();
    assert_eq!(sources, page.matches("src=\"data:image/png;base64,").count());
    // Seven maps (two of them of limits), and two pictures of each of the six load modules.
    assert_eq!(sources, 7 + 2 * 6);
}

#[test]
fn every_section_that_is_linked_is_there() {
    let page = page_of("fort", true);
    for id in ["limits", "residuals", "features", "objects", "maps", "worst", "breaches", "times", "made-from"] {
        assert!(page.contains(&format!("href=\"#{id}\"")) && page.contains(&format!("id=\"{id}\"")), "{id}");
    }
    for part in [
        "raise-module-limit",
        "fullest 4 km window",
        "within 3.5 km",
        "Posts by residual",
        "survey",
        "BLAKE3",
        "Before 812 points made room",
        "excess",
        "load module 4,5",
    ] {
        assert!(page.contains(part), "{part}");
    }
}

#[test]
fn names_from_outside_are_text_and_never_markup() {
    let page = page_of("<i>&\"fort\"", true);
    assert!(!page.contains("<i>") && !page.contains("<b>.tif"));
    assert!(page.contains("&lt;i&gt;&amp;&quot;fort&quot;") && page.contains("R &amp; D"));
}

#[test]
fn a_page_without_ground_says_so() {
    let page = page_of("fort", false);
    assert!(page.contains("No map of residuals") && !page.contains("Posts by residual"));
    assert_eq!(page.matches("src=\"data:").count(), 6 + 6);
}

#[test]
fn the_most_that_is_seen_counts_load_modules_that_any_part_of_lies_near() {
    let (modules, limits) = (samples::modules(), limits());
    let frame = GridFrame { origin_east_m: 0.0, origin_north_m: 0.0, spacing: samples::spacing() };
    let scene = Scene {
        name: "x",
        crs: "",
        grid: samples::GRID,
        frame,
        part: samples::GRID.all(),
        modules: &modules,
        ground: None,
        limits: &limits,
        water: None,
        features: None,
        tiles: &[],
    };
    assert_eq!(most_seen(&scene), Some((24, ModuleId { row: 0, col: 0 })));
}

#[test]
fn the_picture_comes_first_and_the_title_is_that_of_the_job() {
    let page = page_of("fort", true);
    assert!(page.find("<img").unwrap() < page.find("class=\"verdict").unwrap());
    assert!(page.contains("<h1>Gaming area fort</h1>"));
    let (report, manifest) = (samples::report(), manifest("x"));
    let titled =
        Page { title: Some("West & <east>"), report: &report, manifest: &manifest, settings: &[], scene: None };
    let page = report_html(&titled, &in_turn);
    assert!(
        page.contains("<h1>West &amp; &lt;east&gt;</h1>") && page.contains("<title>West &amp; &lt;east&gt;</title>")
    );
    assert!(page.contains("Gaming area fort_irwin: "), "its name is still told");
}

#[test]
fn every_link_of_the_page_leads_to_a_place_on_it() {
    let page = page_of("fort", true);
    let links: Vec<&str> = page.split("href=\"#").skip(1).map(|rest| rest.split('"').next().unwrap()).collect();
    assert!(links.iter().any(|link| link.starts_with("module-")), "load modules are linked to the map");
    for link in links {
        assert_eq!(page.matches(&format!(" id=\"{link}\"")).count(), 1, "{link}");
    }
}

#[test]
fn no_table_makes_a_narrow_screen_scroll_and_every_table_repeats_its_head_on_paper() {
    let page = page_of("fort", true);
    let tables = page.matches("<table").count();
    assert!(5 < tables);
    assert_eq!(page.matches("<div class=\"wide\" tabindex=\"0\"><table><thead>").count(), tables);
    for rule in ["overflow-x: auto", "prefers-color-scheme: dark", "table-header-group", "page-break-inside: avoid"] {
        assert!(page.contains(rule), "{rule}");
    }
}
