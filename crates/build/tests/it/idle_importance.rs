//! Areas of importance that hold no post are told, from whichever tiles and workers a database comes.

use std::fs;
use std::path::Path;

use crate::scene::{ORIGIN_M, SIDE_CELLS, Scene, Words};

/// A raster of classes from 1 to 4 in stripes, 5 where nothing is said, and its system beside it.
fn write_classes(folder: &Path) {
    let posts = 4 * SIDE_CELLS + 1;
    let class = |row: i32, col: i32| if row < 3 { 5 } else { 1 + col % 4 };
    let line = |row: i32| (0..posts).map(|col| class(row, col).to_string()).collect::<Vec<_>>().join(" ");
    let lines: Vec<String> = (0..posts).map(line).collect();
    let [west, south] = ORIGIN_M;
    let head = format!("ncols {posts}\nnrows {posts}\nxllcenter {west}\nyllcenter {south}\ncellsize 25\n");
    fs::write(folder.join("c.asc"), format!("{head}NODATA_value 5\n{}\n", lines.join("\n"))).unwrap();
    fs::write(folder.join("c.prj"), r#"PROJCS["x",AUTHORITY["EPSG","32611"]]"#).unwrap();
}

/// A square of so many metres, so far east of the area's corner.
fn write_square(path: &Path, [at, side]: [f64; 2]) {
    let corner = |east: f64, north: f64| format!("[{}, {}]", ORIGIN_M[0] + at + east, ORIGIN_M[1] + 210.0 + north);
    let ring =
        [(0.0, 0.0), (side, 0.0), (side, side), (0.0, side), (0.0, 0.0)].map(|(east, north)| corner(east, north));
    let crs = r#""crs":{"type":"name","properties":{"name":"EPSG:32611"}}"#;
    let ring = ring.join(",");
    fs::write(path, format!("{{\"type\":\"Polygon\",{crs},\"coordinates\":[[{ring}]]}}")).unwrap();
}

/// What builds of a job with these areas tell, and that it is the same from one worker, from two, from tiles that were
/// kept, and from a database with nothing to do.
#[track_caller]
fn check(areas: &[&str], expected: &[&str]) {
    let importance = format!("default = 2\nareas = [{}]", areas.join(", "));
    let words = Words { size: (4, 4), tiles: (2, 2), importance, ..Words::sample() };
    let scene = Scene::with_files(&words, |folder| {
        write_classes(folder);
        write_square(&folder.join("here.geojson"), [210.0, 400.0]);
        write_square(&folder.join("between.geojson"), [210.0, 5.0]);
        write_square(&folder.join("far.geojson"), [50_000.0, 400.0]);
    });
    let told = scene.build("one", 1).report.warnings;
    assert_eq!(told, expected, "{areas:?}");
    assert_eq!(scene.build("two", 2).report.warnings, told);
    assert_eq!(scene.build("two", 2).report.warnings, told, "nothing to do");
    scene.forget_report("two");
    let again = scene.build("two", 2);
    assert_eq!((again.kept, again.report.warnings), (4, told), "from kept tiles");
}

#[test]
fn areas_of_importance_that_hold_no_post_are_told() {
    let raster =
        |value: i64, class: &str| format!("{{ raster = \"c.asc\", value = {value}, class = \"{class}\", weight = 1 }}");
    let file = |name: &str, class: &str| format!("{{ file = \"{name}.geojson\", class = \"{class}\", weight = 1 }}");
    check(&[&raster(3, "a"), &file("here", "b"), &raster(4, "default"), &file("here", "a")], &[]);
    // Later areas lie over it, which is meant.
    check(&[&file("here", "a"), &raster(1, "b"), &raster(2, "b"), &raster(3, "b"), &raster(4, "b")], &[]);
    check(
        &[&raster(3, "a"), &raster(77, "b"), &raster(5, "a"), &file("far", "c"), &file("between", "a")],
        &[
            "importance.areas[1] (c.asc, value = 77) matches nothing: no post of the area has that value; there are 1, \
             2, 3, 4",
            "importance.areas[2] (c.asc, value = 5) matches nothing: the file marks what has no class with that value; \
             there are 1, 2, 3, 4",
            "importance.areas[3] (far.geojson) matches nothing: none of its 1 polygons holds a post of the area",
            "importance.areas[4] (between.geojson) matches nothing: none of its 1 polygons holds a post of the area",
        ],
    );
}
