//! Water lies level whatever it weighs, and holes are a class of their own.

use std::path::Path;

use terrain::{Dem, HOLE_CLASS, Post, PostRect};

use crate::product::Product;
use crate::scene::{ORIGIN_M, SIDE_CELLS, Scene, Words, sample_dem};
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
fn triangles_over_a_hole_have_its_class_and_others_have_theirs() {
    let words = Words {
        dem: "sources = [\"dem.tif\"]\nvoids = \"hole\"".into(),
        importance: "areas = [{ slope_above_percent = 20, smooth_m = 500, class = \"steep\", weight = 1 }]".into(),
        ..tinned("")
    };
    let sound = sample_dem(words.grid(), 1);
    let is_hole = |post: Post| (30..90).contains(&post.row) && (50..115).contains(&post.col);
    let holed = Dem::from_fn(sound.rect(), |post| (!is_hole(post)).then(|| sound.height(post)));
    let scene = Scene::on(&words, &holed);
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
