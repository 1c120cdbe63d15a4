//! Methods side by side: the figures of the founding paper's kind, on real ground where it is there.

use std::path::Path;
use std::sync::atomic::AtomicBool;

use build::workbench::{
    CompareGround, CompareMethod, CompareRequest, CompareRow, Comparison, Equivalent, TinMethod, TinRequest,
};
use terrain::{Post, PostRect};

use crate::real_ground::data;
use crate::scene::{Scene, Silent, Words};

fn method(name: &str) -> CompareMethod {
    CompareMethod::NAMED.iter().find(|(known, _)| *known == name).unwrap().1
}

fn compare(ground: CompareGround, window: Option<PostRect>, methods: &[&str], points: &[usize]) -> Comparison {
    let methods = methods.iter().map(|name| method(name)).collect();
    let request = CompareRequest { ground, window, methods, points: points.to_vec(), strict: false };
    build::workbench::compare(&request, &AtomicBool::new(false), &mut |_| ()).unwrap()
}

/// The 460 x 376 posts of the desert that the project's figures were measured on.
fn desert() -> Option<(CompareGround, Option<PostRect>)> {
    let path = data("ntc_scape/ntc_1024x1024_25m_assumed.tif")?;
    let window = PostRect::new(Post::new(648, 481), Post::new(1023, 940));
    Some((CompareGround::Raster { path, crs: None }, Some(window)))
}

#[track_caller]
fn rms(row: &CompareRow) -> f64 {
    row.made.as_ref().unwrap_or_else(|why| panic!("{}: {why}", row.method.name())).residual.rms_m()
}

/// Within 20 % of what a prototype found.
#[track_caller]
fn check_bands(found: &Comparison, expected: &[f64]) {
    assert_eq!(found.rows.len(), expected.len());
    for (row, expected) in found.rows.iter().zip(expected) {
        let ratio = rms(row) / expected;
        assert!((0.8..=1.2).contains(&ratio), "{} {:?}: {} m, {expected} m", row.method.name(), row.asked, rms(row));
    }
}

#[test]
fn vip_and_the_iterative_method_are_as_bad_and_as_good_as_the_prototype_found() {
    let Some((ground, window)) = desert() else { return };
    let found = compare(ground, window, &["vip", "vip-vertical", "iterative"], &[2500, 5000]);
    check_bands(&found, &[45.0, 45.3, 4.06, 34.3, 36.0, 2.50]);
    assert_eq!(found.posts, 172_960);
    // Of 2,500 points, 1,668 are the border.
    let forced = found.rows[0].made.as_ref().unwrap().forced.unwrap();
    assert_eq!(forced.points, 1668);
    let without = compare_one("iterative", 2500 - 1668);
    assert_eq!(forced.iterative_rms_m, Some(rms(&without)));
}

fn compare_one(name: &str, points: usize) -> CompareRow {
    let (ground, window) = desert().unwrap();
    compare(ground, window, &[name], &[points]).rows.remove(0)
}

#[test]
fn the_refined_lattice_and_the_regular_grid_are_as_the_prototype_found() {
    let Some((ground, window)) = desert() else { return };
    check_bands(&compare(ground.clone(), window, &["lattice"], &[2871, 5207]), &[5.2, 2.9]);
    check_bands(&compare(ground, None, &["simnet", "simnet-best"], &[4]), &[3.92, 3.05]);
}

#[test]
fn triangles_split_into_three_are_no_better_than_the_prototype_that_split_edges_too() {
    let Some((ground, window)) = desert() else { return };
    let found = compare(ground, window, &["hierarchical", "hierarchical-best"], &[2500, 5000]);
    for (row, expected) in found.rows.iter().zip([15.7, 15.7, 10.5, 10.5]) {
        assert!(0.8 * expected < rms(row), "{}: {}", row.method.name(), rms(row));
    }
}

#[test]
fn equivalent_points_are_the_fewest_whose_iterative_tin_is_better() {
    let scene = Scene::new(&Words::sample());
    let path = scene.path("dem.tif");
    sample(&path);
    let found = compare(
        CompareGround::Raster { path: path.clone(), crs: None },
        None,
        &["lattice", "regular", "optimised"],
        &[150, 400],
    );
    for row in &found.rows {
        let made = row.made.as_ref().unwrap();
        let Equivalent::Points(points) = made.equivalent else {
            panic!("{}: {:?}", row.method.name(), made.equivalent)
        };
        let iterative = |points: usize| {
            let request = TinRequest { points: Some(points), ..TinRequest::plain(path.clone(), TinMethod::Paper) };
            build::workbench::tin(&request, &AtomicBool::new(false), &mut Silent).unwrap().residual.rms_m
        };
        let theirs = made.residual.rms_m();
        assert!(iterative(points) < theirs, "{} points", points);
        assert!(points == 4 || theirs <= iterative(points - 1), "{} points", points - 1);
    }
}

fn sample(path: &Path) {
    let spacing = terrain::Spacing::from_metres(25.0).unwrap();
    let sample = build::workbench::Sample { seed: 3, size: (161, 161), spacing };
    sample.write_heights(&mut std::fs::File::create(path).unwrap()).unwrap();
}

#[test]
fn every_method_makes_a_row_on_any_ground_and_says_why_where_it_cannot() {
    let scene = Scene::new(&Words::sample());
    let names: Vec<&str> = CompareMethod::NAMED.iter().map(|(name, _)| *name).collect();
    let ground = || CompareGround::Job(Box::new(scene.job.clone()));
    let window = Some(PostRect::new(Post::new(20, 30), Post::new(99, 129)));
    let found = compare(ground(), window, &names, &[400]);
    assert_eq!((found.rows.len(), found.size, found.spacing_m), (names.len(), (80, 100), 25.0));
    for row in &found.rows {
        let made = row.made.as_ref().unwrap_or_else(|why| panic!("{}: {why}", row.method.name()));
        let free = ["highlow", "highlow-plateau", "simnet", "simnet-best", "regular", "contour"];
        let is_exact = !free.contains(&row.method.name().as_str());
        assert!(if is_exact { made.points == 400 } else { row.asked.is_none() || made.points <= 400 });
        let covers_all = !row.method.name().starts_with("highlow");
        assert_eq!(made.covered == found.posts, covers_all, "{}", row.method.name());
    }
    let few = compare(ground(), window, &["vip", "iterative"], &[100]);
    assert_eq!(few.rows[0].made.as_ref().unwrap_err().expected, "356 to 8000 points");
    assert!(few.rows[1].made.is_ok());
    let methods = vec![method("vip")];
    let strict = CompareRequest { ground: ground(), window, methods, points: vec![100], strict: true };
    let refused = build::workbench::compare(&strict, &AtomicBool::new(false), &mut |_| ()).unwrap_err();
    assert_eq!(refused.to_string(), "vip: 100 points, expected 356 to 8000 points");
}

#[test]
fn a_window_outside_the_ground_is_refused() {
    let scene = Scene::new(&Words::sample());
    let ground = CompareGround::Job(Box::new(scene.job.clone()));
    let window = Some(PostRect::new(Post::new(0, 0), Post::new(9, 201)));
    let request = CompareRequest { ground, window, methods: vec![method("regular")], points: vec![9], strict: false };
    let refused = build::workbench::compare(&request, &AtomicBool::new(false), &mut |_| ()).unwrap_err();
    assert!(refused.to_string().ends_with("expected a part of the 181 rows and 201 columns there are"), "{refused}");
}
