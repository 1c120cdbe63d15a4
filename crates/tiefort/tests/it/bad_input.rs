//! Bad rasters and bad places, one by one: a paragraph that names the file, what was found and what was expected,
//! exit code 2, and nothing half-written.

use std::fs;

use crate::raster::Raster;
use crate::scene::Scene;

const BUILD: [&str; 4] = ["build", "job.toml", "--out", "x.tdb"];

/// `raster` beside `raster.toml` must be refused in words that hold all of `parts`.
#[track_caller]
fn check(raster: Raster, parts: &[&str]) {
    let scene = Scene::with_job("raster.toml", &[]);
    raster.write(&scene.path("dem.tif"));
    scene.refuses(&BUILD, parts);
}

#[test]
fn a_sound_raster_is_built() {
    let scene = Scene::with_job("raster.toml", &[]);
    Raster::sound().write(&scene.path("dem.tif"));
    scene.run_to(0, &BUILD);
    scene.run_to(0, &["verify", "x.tdb", "--dem", "dem.tif"]);
}

#[test]
fn a_missing_raster() {
    Scene::with_job("raster.toml", &[]).refuses(&BUILD, &["dem.tif", "dem.sources"]);
}

#[test]
fn a_missing_job() {
    Scene::new().refuses(&BUILD, &["job.toml", "expected a job file"]);
}

#[test]
fn a_raster_that_is_no_tiff() {
    let scene = Scene::with_job("raster.toml", &[]);
    fs::write(scene.path("dem.tif"), "north is up\n").unwrap();
    scene.refuses(&BUILD, &["dem.tif", "a text file, not a raster", "expected GeoTIFF, DTED, HGT"]);
    fs::write(scene.path("dem.tif"), "").unwrap();
    scene.refuses(&BUILD, &["dem.tif"]);
}

#[test]
fn a_truncated_raster() {
    let scene = Scene::with_job("raster.toml", &[]);
    let path = scene.path("dem.tif");
    Raster::sound().write(&path);
    let whole = fs::read(&path).unwrap();
    for length in [4, 8, 100, whole.len() / 2] {
        fs::write(&path, &whole[..length]).unwrap();
        scene.refuses(&BUILD, &["dem.tif", "truncated"]);
    }
    fs::write(&path, &whole[..whole.len() - 1]).unwrap();
    scene.refuses(&BUILD, &["dem.tif", "expected"]);
}

#[test]
fn a_raster_without_a_coordinate_system() {
    check(Raster::sound().without_crs(), &["dem.tif", "no coordinate reference system", "expected one"]);
}

#[test]
fn a_raster_in_longitude_and_latitude() {
    check(Raster::sound().geographic(), &["dem.tif", "it lies outside the area"]);
}

#[test]
fn a_raster_that_does_not_cover_the_area() {
    check(Raster::sound().moved_m(100.0), &["dem.tif", "does not cover the area", "100.0 m on its west side"]);
    check(Raster::sound().moved_m(50_000.0), &["dem.tif", "does not cover the area"]);
}

#[test]
fn a_height_that_is_not_a_number() {
    check(Raster::sound().with_height(f32::NAN), &["dem.tif", "1 void post", "506000.0, 3876000.0"]);
}

#[test]
fn an_infinite_height() {
    check(Raster::sound().with_height(f32::INFINITY), &["dem.tif", "infinite", "506000.0, 3876000.0"]);
    check(Raster::sound().with_height(f32::NEG_INFINITY), &["dem.tif", "infinite"]);
}

#[test]
fn a_height_beyond_any_ground() {
    check(Raster::sound().with_height(3.0e38), &["dem.tif", "131071"]);
}

#[test]
fn a_raster_without_any_height() {
    check(Raster::sound().all_void(), &["dem.tif", "all 6561 posts", "void"]);
}

#[test]
fn a_folder_that_cannot_be_made() {
    let scene = Scene::with_job("small.toml", &[]);
    fs::write(scene.path("file"), "").unwrap();
    scene.refuses(&["build", "job.toml", "--out", "file/x.tdb"], &["file"]);
    scene.refuses(&["build", "job.toml", "--out", "file"], &["file", "expected an empty folder or a terrain database"]);
    scene.refuses(&["sample", "--posts", "9", "--out", "nowhere/dem.tif"], &["nowhere/dem.tif"]);
}

#[cfg(target_os = "linux")]
#[test]
fn a_place_that_cannot_be_written_to() {
    let scene = Scene::with_job("small.toml", &[]);
    scene.refuses(&["build", "job.toml", "--out", "/proc/x.tdb"], &["/proc/x.tdb"]);
}

#[test]
fn a_folder_that_is_not_ours() {
    let scene = Scene::with_job("small.toml", &[]);
    fs::create_dir(scene.path("photos")).unwrap();
    fs::write(scene.path("photos/summer.jpg"), "a beach").unwrap();
    let parts = ["photos", "summer.jpg", "expected an empty folder or a terrain database"];
    scene.refuses(&["build", "job.toml", "--out", "photos"], &parts);
    scene.refuses(&["build", "job.toml", "--fresh", "--out", "photos"], &parts);
}

#[test]
fn commands_that_read_a_database_refuse_what_is_none() {
    let scene = Scene::new();
    fs::create_dir(scene.path("empty")).unwrap();
    for command in ["status", "report", "verify"] {
        scene.refuses(&[command, "missing.tdb"], &["missing.tdb"]);
        scene.refuses(&[command, "empty"], &["empty"]);
    }
}
