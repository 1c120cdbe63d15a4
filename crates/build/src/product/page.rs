//! `report.html`, drawn from what a build left: by the build itself, and on request later.

use job::{Job, Setting};
use schedule::Workers;
use store::{Manifest, Report, seal_page};
use views::{Page, PageSetting, Scene, report_html};

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
pub fn page_without_maps(opened: &Opened, report: &Report) -> String {
    drawn(&opened.job, &opened.manifest, report, None, &Workers::new(1))
}

fn drawn(job: &Job, manifest: &Manifest, report: &Report, scene: Option<&Scene>, workers: &Workers) -> String {
    let setting = |Setting { key, value, meaning, .. }| PageSetting { key: key.to_owned(), value, meaning };
    let settings: Vec<PageSetting> = job.describe().into_iter().map(setting).collect();
    let title = job.area.title.as_deref();
    seal_page(&report_html(&Page { title, report, manifest, settings: &settings, scene }, &workers.each()))
}
