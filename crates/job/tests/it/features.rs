//! `[features]` of a sound job: what is read, what is written again, and which files are found.

use std::fs;
use std::path::Path;

use features::{Clearances, Form, GradeOptions, Kind, Rule, RuleKind};
use job::{FeatureSource, Job};

const HEAD: &str = "[area]\nname = \"a\"\ncrs = \"EPSG:32611\"\norigin_m = [0, 0]\nsize_m = [5000, 5000]\n\
    spacing_m = 25\n[dem]\nsource = \"sample\"\n";

fn job(rest: &str) -> Job {
    Job::from_text(&format!("{HEAD}{rest}"), Path::new("jobs/a.toml")).unwrap()
}

const FULL: &str = "[features]\nsources = [\"roads.osm.pbf\", { file = \"hydro.gpkg\", layer = \"rivers\" }, \
    { file = \"lakes.shp\", kind = \"lake\", crs = \"EPSG:32611\" }, \"sample\", { file = \"sample\" }]\n\
    rules = [{ where = { highway = [\"track\"], surface = \"sand\" }, class = \"trail\", width_m = 3, \
    grade_max_percent = 25, grade_give = 1.2, \
    form = \"strip\", z = \"feature\" }, { where = { bridge = [] }, kind = \"none\" }, \
    { where = {}, kind = \"breakline\", form = \"auto\" }]\n\
    buildings = false\nshare_max = 0.25\nclearance_road_m = 5\n\
    clearance_rail_m = 6.5\nclearance_water_m = 0\nbank_m = 50\n\
    cut_max_m = 5\nfill_max_m = 6\nclip_m = 2\nsmooth_posts = 1.5\ngrade_give = 1.25\n\
    river_tau = 0.4\ncarve_max_m = 1\nriver_tilt = false\n";

#[test]
fn every_key_of_features_is_read() {
    let features = job(FULL).features.unwrap();
    let [roads, rivers, lakes, own, named] = features.sources.as_slice() else { panic!("there are five") };
    let is = |source: &FeatureSource, written: &str, layer: Option<&str>, kind, crs: Option<&str>| {
        let FeatureSource::File { file, layer: found, kind: of, crs: named } = source else { panic!("it is a file") };
        assert_eq!((file.written.as_str(), found.as_deref(), *of), (written, layer, kind));
        assert_eq!(named.as_deref(), crs);
    };
    is(roads, "roads.osm.pbf", None, None, None);
    is(rivers, "hydro.gpkg", Some("rivers"), None, None);
    is(lakes, "lakes.shp", None, Some(Kind::Lake), Some("EPSG:32611"));
    assert_eq!(own, &FeatureSource::Sample);
    is(named, "sample", None, None, None);
    let tags = |tags: &[(&str, &[&str])]| -> Vec<(String, Vec<String>)> {
        tags.iter().map(|(key, all)| (key.to_string(), all.iter().map(|value| value.to_string()).collect())).collect()
    };
    let rule = Rule {
        tags: tags(&[("highway", &["track"]), ("surface", &["sand"])]),
        kind: RuleKind::AsBuiltIn,
        class: Some("trail".into()),
        width_m: Some(3.0),
        grade_max_percent: Some(25.0),
        grade_give: Some(1.2),
        form: Some(Form::StripAlways),
        pins: true,
    };
    let bare = Rule {
        class: None,
        width_m: None,
        grade_max_percent: None,
        grade_give: None,
        form: None,
        pins: false,
        ..rule.clone()
    };
    let none = Rule { tags: tags(&[("bridge", &[])]), kind: RuleKind::None, ..bare.clone() };
    let rest = Rule { tags: vec![], kind: RuleKind::Is(Kind::Breakline), form: Some(Form::Strip), ..bare };
    assert_eq!(features.rules, [rule, none, rest]);
    assert_eq!((features.share_max, features.grade_give, features.buildings), (0.25, 1.25, false));
    let clearances = Clearances { road: 640, rail: 832, water: 0 };
    assert_eq!(
        features.options,
        GradeOptions { clearances, bank: 6400, cut_max: 640, fill_max: 768, clip: 256, smooth_milliposts: Some(1500) }
    );
}

#[test]
fn what_a_job_leaves_out_is_as_usual_and_without_the_section_there_are_no_features() {
    let features = job("[features]\nsources = [\"sample\"]\n").features.unwrap();
    let word_alone = job("[features]\nsources = \"sample\"\n").features.unwrap();
    assert_eq!(word_alone.sources, features.sources);
    assert_eq!((features.share_max, features.options), (0.5, GradeOptions::USUAL));
    assert!(features.buildings && !features.has_buildings(), "the built-in terrain has none");
    assert!(features.rules.is_empty());
    assert_eq!(job("").features, None);
    assert!(!job("").canonical_text().contains("features"));
}

#[test]
fn the_canonical_text_of_features_reads_back_the_same() {
    let first = job(FULL);
    let text = first.canonical_text();
    let again = Job::from_text(&text, Path::new("jobs/a.toml")).unwrap();
    assert_eq!(again.features, first.features);
    assert_eq!(again.canonical_text(), text);
}

#[test]
fn meanings_of_kinds_say_the_widths_and_grades_of_the_built_in_table() {
    use job::Choice;
    for kind in Kind::ALL {
        let meaning = kind.word().meaning;
        let says = |text: String| assert!(meaning.contains(&text), "{}: {text}", kind.word().name);
        match (kind, kind.width_default() / 128) {
            (Kind::Lake | Kind::Dam | Kind::Breakline, _) => {}
            (_, metres) => says(format!("{metres} m wide")),
        }
        match kind.grade_default_ppm() / 10_000 {
            0 => assert!(!meaning.contains('%')),
            percent => says(format!("at most {percent} %")),
        }
        match kind.form_default() {
            Form::Strip => says("form auto".into()),
            Form::Line if kind.width_default() != 0 => says("form line".into()),
            Form::Polygon => says("a polygon".into()),
            _ => {}
        }
    }
}

#[test]
fn classes_of_features_follow_from_the_job_in_the_tables_order() {
    let rules = "rules = [{ where = { highway = \"track\" }, class = \"trail\" }, \
        { where = { waterway = \"stream\" }, class = \"m\" }, { where = { fence = \"yes\" }, class = \"fence\" }, \
        { where = {}, kind = \"none\" }, { where = { a = \"b\" }, kind = \"rail\", class = \"tram\" }]\n";
    let importance = "[importance]\nareas = [{ sample = \"mountains\", class = \"m\", weight = 1 }]\n";
    let job = job(&format!("{importance}[features]\nsources = [\"sample\"]\n{rules}"));
    let features = job.features.unwrap();
    let all = "motorway primary minor trail track tram rail runway river m stream lake dam fence breakline";
    assert_eq!(features::class_names(&features.rules).join(" "), all);
    // The mountains have one of them, so that there is one class of that name.
    let ground = "default m motorway primary minor trail track tram rail runway river stream lake dam fence breakline";
    assert_eq!(features.classes_after(&job.importance).join(" "), ground);
    assert_eq!(features.keys(), ["a", "fence", "highway", "waterway"]);
}

#[test]
fn files_of_features_are_found_by_name_and_pattern_and_what_is_missing_is_told() {
    let folder = tempfile::tempdir().unwrap();
    let load = |sources: &str| {
        let path = folder.path().join("a.toml");
        fs::write(&path, format!("{HEAD}[features]\nsources = [{sources}]\n")).unwrap();
        Job::load(&path)
            .map_err(|error| format!("{error} hint: {}", error.hint()).replace(folder.path().to_str().unwrap(), "ROOT"))
    };
    for name in ["b.gpkg", "a.gpkg", "c.txt"] {
        fs::write(folder.path().join(name), "x").unwrap();
    }
    let found = |sources: &str| -> Vec<String> {
        let features = load(sources).unwrap().features.unwrap();
        assert!(features.files().iter().all(|file| file.path.is_file()));
        features.files().iter().map(|file| file.written.clone()).collect()
    };
    assert_eq!(found("\"*.gpkg\", \"a.gpkg\", \"sample\""), ["a.gpkg", "b.gpkg"]);
    let layers = "{ file = \"b.gpkg\", layer = \"x\" }, { file = \"b.gpkg\", layer = \"y\" }";
    assert_eq!(found(layers), ["b.gpkg"]);
    assert_eq!(load(layers).unwrap().features.unwrap().sources.len(), 2);
    let told = |sources: &str| load(sources).unwrap_err();
    assert_eq!(
        told("\"no.gpkg\""),
        "ROOT/a.toml:10: features.sources[0]: found \"no.gpkg\", which cannot be opened, expected a file of lines and \
         polygons hint: paths are relative to the folder of the job file, ROOT"
    );
    fs::create_dir(folder.path().join("roads")).unwrap();
    assert!(told("\"roads/\"").ends_with("hint: its files are roads/*.gpkg"));
    assert!(told("\"*.shp\"").contains("which no file matches, expected a pattern that finds a file of lines and"));
}

#[test]
fn levels_leave_out_classes_of_features_that_there_are() {
    let with = |levels: &str, features: &str| format!("{features}[lod]\nlevels = [{levels}]\n");
    let refused = |text: &str| {
        let error = Job::from_text(&format!("{HEAD}{text}"), Path::new("jobs/a.toml")).unwrap_err();
        error.to_string()
    };
    let some = "[features]\nsources = [\"sample\"]\n";
    let levels = "{ inner_share = 0.5 }, { inner_share = 0.2, leave_out = [\"track\", \"stream\"] }";
    let read = job(&with(levels, some));
    assert_eq!(read.lod.leave_out, [vec![], vec!["track".to_owned(), "stream".to_owned()]]);
    assert!(read.lod.leaves_out() && !job(&with("{ inner_share = 0.5 }", some)).lod.leaves_out());
    assert!(read.canonical_text().contains("{ inner_share = 0.2, leave_out = [\"track\", \"stream\"] }"));
    let error = refused(&with("{ inner_share = 0.5, leave_out = [\"trak\"] }", some));
    assert!(error.contains("expected a class of features"), "{error}");
    let error = refused(&with("{ inner_share = 0.5, leave_out = [\"track\"] }", ""));
    assert!(error.contains("expected a job with roads and water"), "{error}");
}
