//! What a report lists as files for maps and for tables: breaches, and what became of features.

use job::Job;
use store::{FeatureRemark, Report, files};
use views::{BreachPlaces, breaches_csv, breaches_geojson, features_geojson};

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
    (files::FEATURES, features_geojson(remarks, job.area.epsg))
}
