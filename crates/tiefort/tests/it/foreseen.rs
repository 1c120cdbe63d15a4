//! What a build refuses before it decodes any height, `plan` refuses in the same words.

use std::fs;

use crate::raster::Raster;
use crate::scene::Scene;

/// The lines of an error and its hint.
fn refusal(scene: &Scene, arguments: &[&str]) -> String {
    let said = scene.run_to(2, arguments);
    assert!(said.stdout.is_empty(), "{arguments:?} prints before it refuses: {}", said.stdout);
    let lines = said.stderr.lines().skip_while(|line| !line.starts_with("error: "));
    lines.map(|line| format!("{line}\n")).collect()
}

/// A job by its changes to `raster.toml`, and what lies beside it, must be refused by `plan` and by `build` in one
/// text, which holds `part`; nothing is left behind.
#[track_caller]
fn check(changes: &[(&str, &str)], prepare: impl Fn(&Scene), part: &str) {
    let scene = Scene::with_job("raster.toml", changes);
    Raster::sound().write(&scene.path("dem.tif"));
    prepare(&scene);
    let before = scene.everything();
    let planned = refusal(&scene, &["plan", "job.toml", "--out", "x.tdb"]);
    assert!(before == scene.everything(), "a plan that is refused leaves nothing");
    let built = refusal(&scene, &["build", "job.toml", "--out", "x.tdb"]);
    assert_eq!(planned, built);
    assert!(planned.contains(part), "{part:?} is not in: {planned}");
}

fn nothing(_: &Scene) {}

const SOURCES: &str = "sources = [\"dem.tif\"]";

#[test]
fn keys_and_limits() {
    check(&[("spacing_m = 25", "spacing_m = 24")], nothing, "spacing_m");
    check(&[("[tiles]", "[limits]\nmean_per_load_module = 1\n[tiles]")], nothing, "mean_per_load_module");
    check(&[("size_m = [2000, 2000]", "size_m = [2100, 2000]")], nothing, "size_m");
}

#[test]
fn sources_that_are_none() {
    let remove = |scene: &Scene| fs::remove_file(scene.path("dem.tif")).unwrap();
    check(&[], remove, "dem.tif");
    check(&[], |scene| fs::write(scene.path("dem.tif"), "north is up\n").unwrap(), "a text file, not a raster");
    let cut = |scene: &Scene| {
        let whole = fs::read(scene.path("dem.tif")).unwrap();
        fs::write(scene.path("dem.tif"), &whole[..whole.len() / 2]).unwrap();
    };
    check(&[], cut, "truncated");
    check(&[], |scene| Raster::sound().without_crs().write(&scene.path("dem.tif")), "no coordinate reference system");
    let named = "sources = [{ file = \"dem.tif\", crs = \"EPSG:4267\" }]";
    check(&[(SOURCES, named)], nothing, "needs a grid of shifts");
}

#[test]
fn sources_that_do_not_cover_the_area() {
    let moved = |east_m: f64| move |scene: &Scene| Raster::sound().moved_m(east_m).write(&scene.path("dem.tif"));
    check(&[], moved(100.0), "100.0 m on its west side");
    check(&[], moved(50_000.0), "does not cover the area");
    check(&[], |scene| Raster::sound().geographic().write(&scene.path("dem.tif")), "it lies outside the area");
    let cubic = ("[dem]", "[dem]\nresampling = \"cubic\"");
    check(&[cubic], moved(100.0), "no source reaches 324 of 6561 posts");
    let filled = ("voids = \"fail\"", "voids = { next_source = true, fill_within_posts = 8 }");
    // Two rasters, and a strip between them that neither reaches.
    let two = (SOURCES, "sources = [\"dem.tif\", \"east.tif\"]");
    let apart = |scene: &Scene| {
        Raster::sound().moved_m(-1500.0).write(&scene.path("dem.tif"));
        Raster::sound().moved_m(1000.0).write(&scene.path("east.tif"));
    };
    check(&[two, filled], apart, "posts of the area; # is covered");
    let away = |scene: &Scene| {
        Raster::sound().moved_m(90_000.0).write(&scene.path("dem.tif"));
        Raster::sound().moved_m(90_000.0).write(&scene.path("east.tif"));
    };
    check(&[two, filled], away, "no raster that reaches into the area");
}

#[test]
fn rasters_that_touch_by_a_post_leave_no_gap_in_a_plan() {
    let two = "sources = [\"dem.tif\", \"east.tif\"]";
    let scene = Scene::with_job("raster.toml", &[(SOURCES, two)]);
    Raster::sound().moved_m(-1025.0).write(&scene.path("dem.tif"));
    Raster::sound().moved_m(1000.0).write(&scene.path("east.tif"));
    scene.run_to(0, &["plan", "job.toml"]);
    scene.run_to(0, &["build", "job.toml"]);
}

#[test]
fn datums_and_the_grids_between_them() {
    let above = |said: &str, more: &str| {
        format!("sources = [{{ file = \"dem.tif\", vertical_datum = \"{said}\" }}]\nvertical_datum = \"EGM96\"\n{more}")
    };
    check(&[(SOURCES, &above("ellipsoid", ""))], nothing, "dem.vertical_datum");
    let grid = above("ellipsoid", "geoids = [{ datum = \"EGM96\", file = \"egm.gtx\" }]");
    check(&[(SOURCES, &grid)], nothing, "egm.gtx");
    check(&[(SOURCES, &grid)], |scene| fs::write(scene.path("egm.gtx"), "no grid").unwrap(), "egm.gtx");
}

const SQUARE: &str = r#"{ "type": "Feature", "properties": {}, "geometry": { "type": "Polygon", "coordinates":
    [[[505100, 3875100], [505900, 3875100], [505900, 3875900], [505100, 3875100]]] } }"#;

#[test]
fn water_and_areas_of_importance() {
    let water = [(SOURCES, "sources = [\"dem.tif\"]\nwater = \"lakes.geojson\"")];
    check(&water, nothing, "lakes.geojson");
    check(&water, |scene| fs::write(scene.path("lakes.geojson"), "{}").unwrap(), "lakes.geojson");
    let lines = SQUARE.replace("Polygon", "LineString").replace("[[[", "[[").replace("]]]", "]]");
    check(&water, |scene| fs::write(scene.path("lakes.geojson"), &lines).unwrap(), "a LineString");
    let polygons = "[importance]\nareas = [{ file = \"a.geojson\", class = \"a\", weight = 2 }]\n[tiles]";
    check(&[("[tiles]", polygons)], |scene| fs::write(scene.path("a.geojson"), "[]").unwrap(), "a.geojson");
    let raster = "[importance]\nareas = [{ raster = \"c.tif\", value = 3, class = \"a\", weight = 2 }]\n[tiles]";
    check(&[("[tiles]", raster)], |scene| fs::write(scene.path("c.tif"), "no raster").unwrap(), "c.tif");
    let elsewhere = |scene: &Scene| Raster::sound().without_crs().write(&scene.path("c.tif"));
    check(&[("[tiles]", raster)], elsewhere, "c.tif");
}

#[test]
fn given_points_and_pins() {
    let table = |text: &'static str| move |scene: &Scene| fs::write(scene.path("p.csv"), text).unwrap();
    let start = [("[tiles]", "[tin]\nstart = \"p.csv\"\n[tiles]")];
    check(&start, table("east,north\n400000,3875500\n"), "outside the area");
    check(&start, table("a,b\n1,2\n"), "p.csv");
    let pins = [("[tiles]", "[tin]\npins = \"p.geojson\"\n[tiles]")];
    check(&pins, |scene| fs::write(scene.path("p.geojson"), SQUARE).unwrap(), "a polygon without pin");
}

#[test]
fn the_place_of_the_database() {
    check(&[], |scene| fs::write(scene.path("x.tdb"), "a file").unwrap(), "x.tdb");
    let photos = |scene: &Scene| {
        fs::create_dir(scene.path("x.tdb")).unwrap();
        fs::write(scene.path("x.tdb/summer.jpg"), "a beach").unwrap();
    };
    check(&[], photos, "summer.jpg");
    let other = |scene: &Scene| {
        let job = fs::read_to_string(scene.path("job.toml")).unwrap();
        fs::write(scene.path("other.toml"), job.replace("size_m = [2000, 2000]", "size_m = [1000, 1000]")).unwrap();
        scene.run_to(0, &["build", "other.toml", "--out", "x.tdb"]);
    };
    check(&[], other, "x.tdb");
}

#[cfg(unix)]
#[test]
fn a_place_that_is_a_link_to_nothing_or_below_a_file() {
    let scene = Scene::with_job("raster.toml", &[]);
    Raster::sound().write(&scene.path("dem.tif"));
    std::os::unix::fs::symlink("gone", scene.path("link.tdb")).unwrap();
    for (out, part) in [("link.tdb", "a link that leads nowhere"), ("dem.tif/x.tdb", "dem.tif/x.tdb")] {
        let planned = refusal(&scene, &["plan", "job.toml", "--out", out]);
        assert_eq!(planned, refusal(&scene, &["build", "job.toml", "--out", out]));
        assert!(planned.contains(part), "{planned}");
    }
}

#[cfg(unix)]
#[test]
fn a_folder_that_nothing_may_be_made_in() {
    use std::os::unix::fs::PermissionsExt;
    let scene = Scene::with_job("raster.toml", &[]);
    Raster::sound().write(&scene.path("dem.tif"));
    fs::create_dir(scene.path("closed")).unwrap();
    let allow = |mode| fs::set_permissions(scene.path("closed"), fs::Permissions::from_mode(mode)).unwrap();
    allow(0o555);
    if fs::write(scene.path("closed/probe"), "").is_ok() {
        eprintln!("skipped: this user may write anywhere");
        return;
    }
    for out in ["closed", "closed/x.tdb"] {
        let planned = refusal(&scene, &["plan", "job.toml", "--out", out]);
        assert_eq!(planned, refusal(&scene, &["build", "job.toml", "--out", out]));
    }
    allow(0o755);
}
