//! `report.html`, drawn from what a build left: by `build` itself, and by `report --format html` later.

use compiler::{Product, Wanted, WantedGround, product};
use database::{Folder, Report, seal_page};
use job::Job;
use views::{Page, PageSetting, report_html};

use crate::failure::Failure;
use crate::scene::SceneParts;

/// Posts of an area up to which a build draws its ground: 16 bytes a post while it does. Later one can ask for it.
const POSTS_MAX: usize = 16 << 20;

/// The page of a job that was just built.
///
/// # Errors
/// When what was published cannot be read back.
pub fn of_build(folder: &Folder, job: &Job, report: &Report, workers: usize) -> Result<String, Failure> {
    let small = job.area.grid.area().post_count() <= POSTS_MAX;
    let ground = if small { WantedGround::Job(job) } else { WantedGround::None };
    let product = product(folder.dir(), &Wanted { part: None, ground, workers })?;
    Ok(page(&product, report))
}

/// The page of a database.
pub fn page(product: &Product, report: &Report) -> String {
    let parts = SceneParts::new(product, Some(product.limit_use()), Some(report));
    let scene = parts.scene(product, product.part, &product.modules);
    let settings: Vec<PageSetting> = product
        .job
        .describe()
        .into_iter()
        .map(|setting| PageSetting { key: setting.key.to_owned(), value: setting.value, meaning: setting.meaning })
        .collect();
    seal_page(&report_html(&Page { report, manifest: &product.manifest, settings: &settings, scene: Some(&scene) }))
}
