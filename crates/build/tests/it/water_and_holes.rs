//! Water lies level whatever it weighs, and holes are a class of their own.

use std::path::Path;

use terrain::{Dem, HOLE_CLASS, Post, PostRect};

use crate::features::{Drawn, geojson, line, polygon};
use crate::product::Product;
use crate::scene::{ORIGIN_M, SIDE_CELLS, Scene, Words, sample_dem, write_dem};
use crate::surface::sums_of_product;

/// Posts of a lake over the middle of the area, where four tiles meet; south and west of it counts.
const LAKE: PostRect = PostRect { south: 55, west: 50, north: 110, east: 135 };
/// Its level in metres: ground under it lies up to 360 m lower and 150 m higher.
const LEVEL_M: f64 = 1850.0;

fn is_water(post: Post) -> bool {
    (LAKE.south..LAKE.north).contains(&post.row) && (LAKE.west..LAKE.east).contains(&post.col)
}

fn write_lake(folder: &Path) {
    let metres = |post: i32, origin: f64| origin + f64::from(post) * 25.0;
    let (west, east) = (metres(LAKE.west, ORIGIN_M[0]), metres(LAKE.east, ORIGIN_M[0]));
    let (south, north) = (metres(LAKE.south, ORIGIN_M[1]), metres(LAKE.north, ORIGIN_M[1]));
    let ring = format!("[[{west},{south}],[{east},{south}],[{east},{north}],[{west},{north}],[{west},{south}]]");
    std::fs::write(folder.join("lake.json"), format!(r#"{{"type":"Polygon","coordinates":[{ring}]}}"#)).unwrap();
}

/// Builds a job with the lake, and looks at every post of it with a reader of its own.
#[track_caller]
fn check_level(keys: &str, importance: &str, tin: &str, most_m: f64) {
    let water = format!("water = {{ file = \"lake.json\", level_m = {LEVEL_M}{keys} }}");
    let words =
        Words { dem: format!("source = \"sample\"\nseed = 1\n{water}"), importance: importance.into(), ..tinned(tin) };
    let scene = Scene::with_files(&words, write_lake);
    drop(scene.build("area", 2));
    let rect = PostRect::of_size(181, 201);
    let lake = Dem::from_fn(rect, |post| is_water(post).then_some((LEVEL_M * 128.0) as i32));
    let found = sums_of_product(&Product::read(&scene.path("area")), &lake);
    assert_eq!(found.posts, 55 * 85, "every post of the lake is looked at");
    assert!(found.max_m() <= most_m, "{keys} {importance} {tin}: {:.2} m off the level", found.max_m());
}

fn tinned(tin: &str) -> Words {
    Words { tin: tin.into(), limits: "mean_per_load_module = 32".into(), ..Words::sample() }
}

#[test]
fn water_lies_level_whatever_it_weighs() {
    for keys in ["", ", weight = 0", ", weight = 1", ", weight = 60"] {
        check_level(keys, "", "", 0.5);
    }
}

#[test]
fn water_lies_level_beside_ground_of_several_weights_and_by_every_method() {
    let steep = "default = 2\nareas = [{ slope_above_percent = 20, smooth_m = 500, class = \"steep\", weight = 0.25 }]";
    check_level(", weight = 0", steep, "", 0.5);
    check_level(", weight = 0", "default = 0.5", "effort = \"fast\"", 0.5);
    check_level(", weight = 0", "", "method = \"greedy\"", 0.5);
}

#[test]
fn water_lies_level_beside_ground_of_any_weight() {
    // Above 2.047 all weights are made smaller, so that water can weigh more.
    for weight in [2.0, 8.0, 65.535] {
        check_level("", &format!("default = {weight}"), "", 0.5);
    }
}

#[test]
fn water_that_lies_elsewhere_is_told() {
    let water = "water = { file = \"lake.json\", level_m = 5 }";
    let words = Words { dem: format!("source = \"sample\"\nseed = 1\n{water}"), ..tinned("") };
    let scene = Scene::with_files(&words, |folder| {
        let ring = "[[1e6,5e6],[1.1e6,5e6],[1.1e6,5.1e6],[1e6,5e6]]";
        let text = format!(r#"{{"type":"Polygon","coordinates":[{ring}]}}"#);
        std::fs::write(folder.join("lake.json"), text).unwrap();
    });
    let warnings = scene.build("area", 2).report.warnings;
    assert!(warnings.iter().any(|warning| warning.contains("none of its polygons reaches")), "{warnings:?}");
}

#[test]
fn triangles_over_a_hole_have_its_class_and_others_have_theirs() {
    let words = Words {
        dem: "sources = [\"dem.tif\"]\nvoids = \"hole\"".into(),
        importance: "areas = [{ slope_above_percent = 20, smooth_m = 500, class = \"steep\", weight = 1 }]".into(),
        ..tinned("")
    };
    let scene = Scene::on(&words, &holed(&words));
    let report = scene.build("area", 2).report;
    let hole = report.classes.last().unwrap();
    assert_eq!((hole.name.as_str(), hole.posts), ("hole", 0));
    let product = Product::read(&scene.path("area"));
    let classes_of = |row: u32, col: u32| &product.modules[&(row, col)].classes;
    // Load modules wholly inside the hole, wholly outside, and across its side.
    let all_of = |row, col| classes_of(row, col).iter().all(|&class| class == HOLE_CLASS);
    let any_of = |row, col| classes_of(row, col).contains(&HOLE_CLASS);
    assert!(all_of(2, 3) && all_of(3, 4), "inside");
    assert!(!any_of(0, 0) && !any_of(7, 8), "outside");
    assert!(any_of(1, 3) && !all_of(1, 3), "across");
    assert_eq!(SIDE_CELLS, 20, "what the places above were counted with");
}

/// Ground with a square hole of 65 x 60 posts.
fn holed(words: &Words) -> Dem {
    let sound = sample_dem(words.grid(), 1);
    let is_hole = |post: Post| (30..90).contains(&post.row) && (50..115).contains(&post.col);
    Dem::from_fn(sound.rect(), |post| (!is_hole(post)).then(|| sound.height(post)))
}

/// Builds with these features, and looks at every height that a simulator reads.
#[track_caller]
fn check_features_over_a_hole(voids: &str, drawn: &[Drawn]) {
    let words = Words {
        dem: format!("sources = [\"dem.tif\"]\nvoids = {voids}"),
        features: "sources = [\"features.geojson\"]".into(),
        // Fitted heights may stand out of the ground beside a gorge; these have to lie on it.
        ..tinned("height_fit = \"off\"")
    };
    let (dem, drawn) = (holed(&words), geojson(drawn));
    let scene = Scene::with_files(&words, |folder| {
        write_dem(&folder.join("dem.tif"), &dem);
        std::fs::write(folder.join("features.geojson"), &drawn).unwrap();
    });
    drop(scene.build("area", 2));
    scene.verify("area");
    let product = Product::read(&scene.path("area"));
    product.check_cracks();
    let known = dem.rect().posts().filter(|&post| !dem.is_void(post)).map(|post| i64::from(dem.height(post)));
    let (low, high) = known.fold((i64::MAX, i64::MIN), |(low, high), z| (low.min(z), high.max(z)));
    let slack = 30 * 128;
    for z in product.modules.values().flat_map(|module| &module.vertices).map(|vertex| i64::from(vertex.z)) {
        assert!((low - slack..=high + slack).contains(&z), "{voids}: {} m in {drawn}", z / 128);
    }
}

#[test]
fn roads_and_water_over_a_hole_pull_no_ground_away() {
    // The hole lies from 1250 to 2850 m east and from 750 to 2225 m north.
    let all = [
        line("highway=primary", &[(500.0, 1500.0), (3900.0, 1520.0)]),
        line("highway=track", &[(1500.0, 900.0), (2600.0, 2000.0)]),
        line("waterway=river", &[(2000.0, 4000.0), (2100.0, 1200.0)]),
        polygon("natural=water", &[(900.0, 1000.0), (1600.0, 1000.0), (1600.0, 1400.0), (900.0, 1400.0)]),
        polygon("natural=water", &[(2200.0, 1700.0), (2500.0, 1700.0), (2500.0, 2000.0), (2200.0, 2000.0)]),
    ];
    for voids in ["\"hole\"", "{ fill_within_posts = 8, hole = true }"] {
        all.iter().for_each(|one| check_features_over_a_hole(voids, std::slice::from_ref(one)));
        check_features_over_a_hole(voids, &all);
    }
}
