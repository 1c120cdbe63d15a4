//! What a build leaves for people to look at: `report.html`, drawn by the build itself and on request later; and files
//! for maps and for tables that list breaches, and what became of features.

use job::{Job, Setting};
use schedule::Workers;
use store::{AreaOutlines, FeatureRemark, Manifest, ObjectLeftOut, Report, ReportPlace, files, seal_page};
use views::{BreachPlaces, Page, PageSetting, Scene, breaches_csv, breaches_geojson, features_geojson, report_html};

use crate::product::{Opened, Product, SceneParts};

/// Maps of a page that are drawn at once, however many workers there are: each takes memory of its own.
pub(crate) const DRAWN_AT_ONCE: usize = 2;

/// The page of a database, its maps drawn by so many workers.
pub fn page(product: &Product, report: &Report, workers: usize) -> String {
    let parts = SceneParts::new(product, Some(product.limit_use()), Some(report));
    let scene = parts.scene(product, product.part, &product.modules);
    drawn(&product.job, &product.manifest, report, Some(&scene), &Workers::new(workers.min(DRAWN_AT_ONCE)))
}

/// The page of a database whose load modules are too many to be drawn.
pub(crate) fn page_without_maps(opened: &Opened, report: &Report) -> String {
    drawn(&opened.job, &opened.manifest, report, None, &Workers::new(1))
}

fn drawn(job: &Job, manifest: &Manifest, report: &Report, scene: Option<&Scene>, workers: &Workers) -> String {
    let setting = |Setting { key, value, meaning, .. }| PageSetting { key: key.to_owned(), value, meaning };
    let settings: Vec<PageSetting> = job.describe().into_iter().map(setting).collect();
    let title = job.area.title.as_deref();
    seal_page(&report_html(&Page { title, report, manifest, settings: &settings, scene }, &workers.each()))
}

/// Names and texts of the files that list the breaches of `report`, whose job this is.
pub fn breaches(job: &Job, report: &Report) -> [(&'static str, String); 2] {
    let (area, window) = (&job.area, &job.limits.window);
    let places = BreachPlaces {
        origin_m: area.origin_m,
        module_side_m: job.modules.side_m,
        modules: [area.grid.rows, area.grid.cols],
        window: [window.rows, window.cols],
        epsg: area.epsg,
    };
    [(files::BREACHES, breaches_geojson(report, &places)), (files::BREACHES_CSV, breaches_csv(report, &places))]
}

/// Name and text of the file that lists what was mended, degraded or left out of the features of this job.
pub fn features_file(job: &Job, remarks: &[FeatureRemark]) -> (&'static str, String) {
    (files::FEATURES, features_geojson("features", remarks, job.area.epsg))
}

/// Name and text of the file that lists which objects of this job had no room, and what was mended.
pub(crate) fn objects_file(job: &Job, outlines: &AreaOutlines) -> (&'static str, String) {
    let left_out = |object: &ObjectLeftOut| {
        let ObjectLeftOut { kind, at_m, height_m, silhouette_m2, full } = object;
        let place = match full {
            ReportPlace::Module([row, col]) => format!("load module {row},{col}"),
            ReportPlace::Window([row, col]) => format!("the square of 4 km from load module {row},{col}"),
            ReportPlace::Area => "the area".to_owned(),
        };
        FeatureRemark {
            feature: format!("{kind}, {height_m:.1} m high"),
            at_m: Some(*at_m),
            found: format!("{place} is full of what hides more than {silhouette_m2:.1} m2"),
            done: "left out".to_owned(),
            leaves_out: true,
            degrades: false,
        }
    };
    let all: Vec<FeatureRemark> =
        outlines.left_out.iter().map(left_out).chain(outlines.remarks.iter().cloned()).collect();
    (files::OBJECTS, features_geojson("objects", &all, job.area.epsg))
}
