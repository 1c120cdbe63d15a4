//! What a report lists as files for maps and for tables: breaches, and what became of features.

use job::Job;
use store::{AreaOutlines, FeatureRemark, ObjectLeftOut, Report, ReportPlace, files};
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
    (files::FEATURES, features_geojson("features", remarks, job.area.epsg))
}

/// Name and text of the file that lists which objects of this job had no room, and what was mended.
pub fn objects_file(job: &Job, outlines: &AreaOutlines) -> (&'static str, String) {
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
