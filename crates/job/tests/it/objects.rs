//! `[objects]`: what is read, what is written again, and what is refused.

use std::path::Path;

use job::Job;
use terrain::ObjectKind;

const HEAD: &str = "[area]\nname = \"a\"\ncrs = \"EPSG:32611\"\norigin_m = [0, 0]\nsize_m = [5000, 5000]\n\
    spacing_m = 25\n[dem]\nsource = \"sample\"\n";

fn read(rest: &str) -> Result<Job, String> {
    Job::from_text(&format!("{HEAD}{rest}"), Path::new("jobs/a.toml")).map_err(|error| error.to_string())
}

#[test]
fn every_key_of_objects_is_read_and_written_again() {
    let job = read(
        "[objects]\nsources = [\"town.osm.pbf\", { file = \"h.gpkg\", layer = \"x\", kind = \"building\", \
         height = \"h_m\", crs = \"EPSG:32611\" }]\nrules = [{ where = { building = [\"silo\"] }, height_m = 18 }, \
         { where = { building = [\"ruins\"] }, kind = \"none\" }, { where = {}, kind = \"wood\" }]\n\
         corners_max = 8\narea_min_m2 = 0\nlimits = { per_load_module = 90, per_4km_square = 900 }\n",
    )
    .unwrap();
    let objects = job.objects.as_ref().unwrap();
    assert_eq!((objects.sources[0].kind, objects.sources[1].kind), (None, Some(ObjectKind::Building)));
    assert_eq!(objects.sources[1].height.as_deref(), Some("h_m"));
    assert_eq!(
        objects.rules.iter().map(|rule| (rule.kind, rule.height_m)).collect::<Vec<_>>(),
        [(None, Some(18.0)), (Some(None), None), (Some(Some(ObjectKind::Wood)), None)]
    );
    assert_eq!((objects.options.corners_max, objects.options.area_min_m2), (8, 0.0));
    assert_eq!((objects.per_load_module, objects.per_4km_square), (90, 900));
    let again = Job::from_text(&job.canonical_text(), Path::new("jobs/a.toml")).unwrap();
    assert_eq!(again.objects, job.objects);
    assert_eq!(again.canonical_text(), job.canonical_text());
}

#[test]
fn what_is_left_out_is_as_usual_and_sources_are_those_of_features() {
    let job = read(
        "[features]\nsources = [\"a.osm.pbf\", { file = \"l.gpkg\", layer = \"y\", kind = \"lake\" }, \"sample\"]\n\
         [objects]\n",
    )
    .unwrap();
    let objects = job.objects.unwrap();
    let written: Vec<&str> = objects.sources.iter().map(|source| source.file.written.as_str()).collect();
    assert_eq!(
        (written.as_slice(), objects.sources[1].layer.as_deref()),
        (["a.osm.pbf", "l.gpkg"].as_slice(), Some("y"))
    );
    assert_eq!((objects.options.corners_max, objects.per_load_module, objects.per_4km_square), (15, 400, 12_800));
    assert_eq!(read("").unwrap().objects, None);
    assert!(!read("").unwrap().canonical_text().contains("objects"));
}

#[test]
fn what_cannot_be_is_refused_by_name() {
    for (text, told) in [
        ("[objects]\n", "objects.sources"),
        ("[objects]\nsources = [\"a.gpkg\"]\ncorners_max = 3\n", "objects.corners_max"),
        ("[objects]\nsources = [{ file = \"a.gpkg\", kind = \"house\" }]\n", "building"),
        ("[objects]\nsources = [\"a.gpkg\"]\nlimits = { per_module = 3 }\n", "per_module"),
        ("[objects]\nsources = [\"a.gpkg\"]\nrules = [{ where = {}, kind = \"none\", height_m = 3 }]\n", "none"),
        ("[objects]\nsources = [\"a.gpkg\"]\n[load_modules]\nedges = \"clip\"\n", "[objects]"),
        ("[objects]\nsources = [\"a.gpkg\"]\n[load_modules]\nformat = 2\n", "[objects]"),
    ] {
        let error = read(text).unwrap_err();
        assert!(error.contains(told), "{text}: {error}");
    }
}
