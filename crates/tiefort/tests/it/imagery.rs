//! `tiefort view --imagery`: squares of pictures over HTTP, and which files are refused.

use std::fs::File;
use std::path::Path;

use serde_json::Value;
use tiff::encoder::TiffEncoder;
use tiff::encoder::colortype::RGB8;
use tiff::tags::Tag;

use crate::scene::Scene;
use crate::server::Server;

/// A picture of 500 x 500 pixels of 2 m, of one colour, with its north-western corner at a place of UTM zone 11.
fn write(path: &Path, [east, north]: [f64; 2], color: [u8; 3]) {
    let mut encoder = TiffEncoder::new(File::create(path).unwrap()).unwrap();
    let mut image = encoder.new_image::<RGB8>(500, 500).unwrap();
    let tags = image.encoder();
    tags.write_tag(Tag::ModelPixelScaleTag, &[2.0, 2.0, 0.0][..]).unwrap();
    tags.write_tag(Tag::ModelTiepointTag, &[0.0, 0.0, 0.0, east, north, 0.0][..]).unwrap();
    let keys: [u16; 16] = [1, 1, 0, 3, 1024, 0, 1, 1, 1025, 0, 1, 1, 3072, 0, 1, 32611];
    tags.write_tag(Tag::GeoKeyDirectoryTag, &keys[..]).unwrap();
    image.write_data(&color.repeat(500 * 500)).unwrap();
}

fn scene() -> Scene {
    let scene = Scene::with_job("small.toml", &[]);
    scene.run_to(0, &["build", "job.toml", "--quiet", "--no-html"]);
    scene
}

#[test]
fn pictures_come_square_by_square_later_ones_above_earlier() {
    let scene = scene();
    // The area is 4 km from 505000, 3875000: one lies at its north-western corner, the other over its eastern half.
    write(&scene.path("a.tif"), [505_000.0, 3_879_000.0], [200, 10, 20]);
    write(&scene.path("b.tif"), [505_500.0, 3_879_000.0], [10, 20, 200]);
    let server = Server::start(scene, &["view", "small.tdb", "--imagery", "a.tif", "--imagery", "b.tif"]);
    let ask = |path: &str, headers: &[&str]| server.ask("GET", path, headers, &[]);
    let about: Value = serde_json::from_slice(&ask("/api/imagery", &[]).body).unwrap();
    assert_eq!((&about["pixel_m"], &about["side"], &about["levels"]), (&2.0.into(), &256.into(), &3.into()));
    assert_eq!(about["names"], serde_json::json!(["a.tif", "b.tif"]));
    // A square has 512 m at level 0: its row 7 from the south ends beyond the area, 4096 m from the corner.
    let first = ask("/api/imagery/0/7/0", &[]);
    assert_eq!((first.status, first.body.len()), (200, 4 * 256 * 256));
    let pixel = |row: usize, col: usize| first.body[4 * (256 * row + col)..][..4].to_vec();
    // 96 m of it lie beyond the pictures' northern edge, and the second picture begins 500 m from the western side.
    assert_eq!(pixel(255, 10), [0, 0, 0, 0]);
    assert_eq!((pixel(207, 249), pixel(207, 250)), (vec![200, 10, 20, 255], vec![10, 20, 200, 255]));
    assert_eq!(pixel(208, 249), [0, 0, 0, 0]);
    let tag = first.header("etag").to_owned();
    assert_eq!(ask("/api/imagery/0/7/0", &[&format!("If-None-Match: {tag}")]).status, 304);
    assert_ne!(ask("/api/imagery/0/7/1", &[]).header("etag"), tag);
    assert_eq!(ask("/api/imagery/0/0/0", &[]).status, 204);
    // The pictures lie in the northern half, of which a square at level 2 takes the west.
    assert_eq!([ask("/api/imagery/2/0/0", &[]).status, ask("/api/imagery/2/1/0", &[]).status], [204, 200]);
    for beyond in ["/api/imagery/0/8/0", "/api/imagery/0/0/8", "/api/imagery/3/0/0"] {
        assert_eq!(ask(beyond, &[]).status, 404, "{beyond}");
    }
    assert_eq!(ask("/api/imagery/a/b/c", &[]).status, 400);
}

#[test]
fn without_pictures_the_page_is_told_that_there_are_none() {
    let server = Server::start(scene(), &["view", "small.tdb"]);
    let about = server.ask("GET", "/api/imagery", &[], &[]);
    assert_eq!(serde_json::from_slice::<Value>(&about.body).unwrap()["levels"], 0);
    assert_eq!(server.ask("GET", "/api/imagery/0/0/0", &[], &[]).status, 404);
}

#[test]
fn a_picture_elsewhere_or_none_at_all_is_refused_before_anything_is_served() {
    let scene = scene();
    write(&scene.path("away.tif"), [605_000.0, 3_879_000.0], [1, 2, 3]);
    std::fs::write(scene.path("a.png"), b"\x89PNG\r\n\x1a\n").unwrap();
    let mut encoder = TiffEncoder::new(File::create(scene.path("bare.tif")).unwrap()).unwrap();
    encoder.write_image::<RGB8>(2, 2, &[7; 12]).unwrap();
    for (file, expected) in [
        (
            "away.tif",
            ["away.tif: a picture of 605001, 3878001 to 605999, 3878999 in EPSG:32611", "reaches into the area"],
        ),
        ("a.png", ["a.png: not a TIFF", "gdal_translate a.png out.tif"]),
        ("job.toml", ["job.toml: a job file, not a raster, expected a GeoTIFF", "name a picture of the ground"]),
        ("bare.tif", ["bare.tif: no coordinate reference system", "-a_srs"]),
        ("none.tif", ["none.tif", "check the path"]),
        ("small.tdb", ["small.tdb", "a terrain database"]),
    ] {
        let told = scene.run_to(2, &["view", "small.tdb", "--imagery", file]).stderr;
        let words = told.split_whitespace().collect::<Vec<_>>().join(" ");
        assert!(expected.iter().all(|part| words.contains(part)), "{file}: {told}");
    }
}
