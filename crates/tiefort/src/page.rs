//! `report.html`, drawn from what a build left: by `build` itself, and by `report --format html` later.

use compiler::{PAGE_MODULES_MAX, PAGE_POSTS_MAX};
use database::{Folder, Report, seal_page};
use inspect::{Product, Wanted, WantedGround, product};
use job::Job;
use views::{Page, PageSetting, report_html};

use crate::failure::Failure;
use crate::scene::SceneParts;

/// The page of a job that was just built: with the ground as long as the area has no more than [`PAGE_POSTS_MAX`] posts
/// (16 bytes each while it is drawn), with maps as long as it has no more than [`PAGE_MODULES_MAX`] load modules (a
/// kilobyte each). Later one can ask for them.
///
/// # Errors
/// When what was published cannot be read back.
pub fn of_build(folder: &Folder, job: &Job, report: &Report, workers: usize) -> Result<String, Failure> {
    let grid = job.area.grid;
    if PAGE_MODULES_MAX < grid.count() {
        let settings = settings(job);
        let manifest = &folder.manifest()?;
        let title = job.area.title.as_deref();
        return Ok(seal_page(&report_html(&Page { title, report, manifest, settings: &settings, scene: None })));
    }
    let small = grid.area().post_count() <= PAGE_POSTS_MAX;
    let ground = if small { WantedGround::Job(job) } else { WantedGround::None };
    let read = |ground| product(folder.dir(), &Wanted { part: None, ground, workers });
    // A source may have gone since the build ended, which is finished all the same.
    let product = read(ground).or_else(|_| read(WantedGround::None))?;
    Ok(page(&product, report))
}

/// The page of a database.
pub fn page(product: &Product, report: &Report) -> String {
    let parts = SceneParts::new(product, Some(product.limit_use()), Some(report));
    let scene = parts.scene(product, product.part, &product.modules);
    let settings = settings(&product.job);
    let (title, manifest) = (product.job.area.title.as_deref(), &product.manifest);
    seal_page(&report_html(&Page { title, report, manifest, settings: &settings, scene: Some(&scene) }))
}

fn settings(job: &Job) -> Vec<PageSetting> {
    let setting = |setting: job::Setting| PageSetting {
        key: setting.key.to_owned(),
        value: setting.value,
        meaning: setting.meaning,
    };
    job.describe().into_iter().map(setting).collect()
}
