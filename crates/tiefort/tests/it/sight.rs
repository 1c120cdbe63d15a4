//! What is seen from a place, and the ground along a line.

use std::fs::File;

use load_module_reader::{Area, Keep, LoadedGround, Sight};
use tiff::decoder::{Decoder, DecodingResult};
use tiff::tags::Tag;

use crate::scene::Scene;

const EYE: &str = "507000,3876500,20";

fn ground(scene: &Scene) -> LoadedGround {
    let area = Area::open(scene.path("small.tdb"), Keep::InMemory).unwrap();
    area.load(area.whole()).unwrap()
}

/// Pixels, places along a side, and the easting and northing of the north-western corner.
fn read(scene: &Scene, name: &str) -> (Vec<u8>, usize, [f64; 2]) {
    let mut file = Decoder::new(File::open(scene.path(name)).unwrap()).unwrap();
    let (wide, high) = file.dimensions().unwrap();
    assert_eq!(wide, high);
    let tie = file.get_tag_f64_vec(Tag::ModelTiepointTag).unwrap();
    let DecodingResult::U8(pixels) = file.read_image().unwrap() else { panic!("bytes") };
    (pixels, wide as usize, [tie[3], tie[4]])
}

#[test]
fn a_viewshed_is_what_lines_of_sight_say_place_by_place() {
    let scene = Scene::built();
    let wanted = ["sight", "small.tdb", "--from", EYE, "--range", "1.8", "--target", "1", "--spacing", "50"];
    for (workers, out) in [("1", "a.tif"), ("2", "b.tif")] {
        let said = scene.run_to(0, &[&wanted[..], &["--workers", workers, "--out", out]].concat());
        assert!(said.stdout.contains("% of ") && said.stdout.contains(out), "{}", said.stdout);
    }
    assert_eq!(std::fs::read(scene.path("a.tif")).unwrap(), std::fs::read(scene.path("b.tif")).unwrap());
    let (pixels, side, [west, north]) = read(&scene, "a.tif");
    assert_eq!((side, west, north), (73, 507_000.0 - 36.5 * 50.0, 3_876_500.0 + 36.5 * 50.0));
    let ground = ground(&scene);
    let eye = [507_000.0, 3_876_500.0, ground.height_m([507_000.0, 3_876_500.0]).unwrap() + 20.0];
    for (index, pixel) in pixels.iter().enumerate() {
        let place = [west + 50.0 * (0.5 + (index % side) as f64), north - 50.0 * (0.5 + (index / side) as f64)];
        let away = [place[0] - eye[0], place[1] - eye[1]];
        let height = ground.height_m(place).filter(|_| away[0] * away[0] + away[1] * away[1] <= 1800.0 * 1800.0);
        let free = |height_m: f64| ground.sight(eye, [place[0], place[1], height_m + 1.0]) == Sight::Free;
        assert_eq!(*pixel, height.map_or(255, |height_m| u8::from(free(height_m))), "{place:?}");
    }
    assert!([0, 1, 255].iter().all(|kind| 100 < pixels.iter().filter(|pixel| *pixel == kind).count()));
    scene.run_to(0, &[&wanted[..], &["--curvature", "--out", "a.png"]].concat());
}

/// The numbers before ` km2` and ` %` in what a viewshed says.
fn figures(said: &str) -> Vec<f64> {
    let words: Vec<&str> = said.split_whitespace().collect();
    let is_figure = |pair: &&[&str]| ["km2", "km2,", "%"].contains(&pair[1]);
    words.windows(2).filter(is_figure).map(|pair| pair[0].parse().unwrap()).collect()
}

#[test]
fn the_share_of_a_viewshed_and_its_area_agree_up_to_the_border() {
    let scene = Scene::built();
    // As far as every corner of the area of 4 x 4 km.
    let wanted = ["sight", "small.tdb", "--from", EYE, "--range", "5", "--spacing", "50", "--out", "all.png"];
    let said = scene.run_to(0, &wanted).stdout;
    let [share, all_km2, seen_km2] = figures(&said)[..] else { panic!("{said}") };
    let frame = ground(&scene).frame().clone();
    let [wide, high] = [frame.cols, frame.rows].map(|count| f64::from(count) * frame.side_m() / 1000.0);
    assert!((all_km2 - wide * high).abs() < 0.006, "{all_km2} of {wide} x {high} km: {said}");
    assert!((seen_km2 - share / 100.0 * all_km2).abs() < 0.02, "{said}");
}

#[test]
fn one_place_sees_another_or_is_told_what_hides_it() {
    let scene = Scene::built();
    let near = scene.run_to(0, &["sight", "small.tdb", "--from", EYE, "--to", "507010,3876500,30"]);
    assert!(near.stdout.starts_with("visible\n") && near.stdout.contains("distance   10.0 m"), "{}", near.stdout);
    let ground = ground(&scene);
    let height = |place: [f64; 2]| ground.height_m(place).unwrap();
    let (from, to) = ([506_000.0, 3_875_500.0], [508_500.0, 3_878_500.0]);
    let sight = ground.sight([from[0], from[1], height(from) + 1.0], [to[0], to[1], height(to) + 1.0]);
    let far = scene.run_to(0, &["sight", "small.tdb", "--from", "506000,3875500,1", "--to", "508500,3878500,1"]);
    let Sight::Hidden(at) = sight else { panic!("{sight:?}, {}", far.stdout) };
    let place = format!("at {:.1},{:.1}\n", from[0] + at * 2500.0, from[1] + at * 3000.0);
    assert!(
        far.stdout.starts_with("hidden by ground, first ") && far.stdout.contains(&place),
        "{place}: {}",
        far.stdout
    );
}

#[test]
fn a_profile_is_told_as_a_drawing_as_lines_and_as_an_object() {
    let scene = Scene::built();
    let line = ["profile", "small.tdb", "506000,3876000", "507000,3876000", "507000,3876500", "--spacing", "100"];
    let text = scene.run_to(0, &line).stdout;
    assert!(text.contains("length      1500.0 m") && text.lines().all(|line| line.len() <= 80), "{text}");
    let csv = scene.run_to(0, &[&line[..], &["--format", "csv"]].concat()).stdout;
    let ground = ground(&scene);
    let height = ground.height_m([506_300.0, 3_876_000.0]).unwrap();
    assert!(csv.starts_with("along_m,east_m,north_m,height_m,deck_m,class\n"), "{csv}");
    assert!(csv.contains(&format!("\n300.000,506300.000,3876000.000,{height:.4},,")) && csv.lines().count() == 17);
    let json = scene.run_to(0, &[&line[..], &["--format", "json"]].concat()).stdout;
    let value: serde_json::Value = serde_json::from_str(&json).unwrap();
    assert_eq!(value["points"][3]["height_m"].as_f64(), Some(height));
}

#[test]
fn what_cannot_be_looked_at_is_told_with_what_could() {
    let scene = Scene::built();
    let sight = |more: &[&'static str]| [&["sight", "small.tdb", "--from"], more].concat();
    for (more, parts) in [
        (&["1,2,3", "--range", "1", "--out", "a.tif"][..], &["--from: found 1,2", "where there is no ground"][..]),
        (&["1,2,3", "--to", "507010,3876500,30"], &["--from: found 1,2"]),
        (&[EYE, "--to", "9,9,9"], &["--to: found 9,9"]),
        (&[EYE, "--range", "1", "--out", "a.jpg"], &["a.jpg", ".tif or .png"]),
        (&[EYE, "--range", "1", "--out", "none/a.tif"], &["none"]),
        (&[EYE, "--range", "1", "--spacing", "0.3", "--out", "a.tif"], &["--spacing: found 0.3", "1/16"]),
        (&[EYE, "--range", "900", "--out", "a.png"], &["72001 x 72001 places"]),
    ] {
        scene.refuses(&sight(more), parts);
    }
    for wrong in [
        &["507000,3876500,NaN", "--range", "1", "--out", "a.tif"][..],
        &[EYE, "--range", "0", "--out", "a.tif"],
        &[EYE, "--range", "1"],
        &[EYE],
        &[EYE, "--range", "1", "--refraction", "0.1", "--out", "a.tif"],
        &[EYE, "--range", "1", "--curvature", "--refraction", "1", "--out", "a.tif"],
    ] {
        scene.run_to(2, &sight(wrong));
    }
    scene.refuses(&["profile", "small.tdb", "507000,3876500", "1,2"], &["found 1,2"]);
    scene.refuses(
        &["profile", "small.tdb", "507000,3876500", "507100,3876500", "--spacing", "0.0000001"],
        &["places at most"],
    );
    scene.refuses(&["profile", "none.tdb", "1,2", "3,4"], &["none.tdb"]);
}
