//! Ends that a job asks for: a largest residual, an RMS residual.

use build::Built;
use terrain::Dem;

use crate::scene::{Scene, Words};

fn built(tin: &str) -> Built {
    let words = Words { size: (6, 6), tiles: (2, 2), tin: tin.into(), ..Words::sample() };
    let scene = Scene::new(&words);
    let built = scene.build("area", 2);
    scene.verify("area");
    built
}

fn triangles(built: &Built) -> u64 {
    built.report.triangles
}

#[test]
fn a_largest_residual_ends_the_choosing_whatever_the_method() {
    for method in ["", "effort = \"fast\"\n", "method = \"greedy\"\n"] {
        let within = |metres: f64| built(&format!("{method}max_residual_m = {metres}"));
        let unbound = triangles(&built(method));
        let mut before = unbound + 1;
        for metres in [20.0, 50.0, 150.0] {
            let built = within(metres);
            let triangles = triangles(&built);
            assert!(triangles < before, "{method}{metres} m: {triangles} triangles after {before}");
            let largest = built.report.residual.max_m;
            assert!(largest <= metres, "{method}{metres} m: {largest} m is left");
            before = triangles;
        }
    }
}

#[test]
fn a_largest_residual_holds_where_ground_weighs_little() {
    let steep = "default = 8\nareas = [{ slope_above_percent = 15, smooth_m = 50, class = \"steep\", weight = 1 }]";
    let limits = "per_load_module = 1000\nmean_per_load_module = 400\nper_4km_square = 50000";
    for method in ["", "method = \"greedy\"\n"] {
        let words = Words {
            size: (6, 6),
            tiles: (2, 2),
            importance: steep.into(),
            limits: limits.into(),
            tin: format!("{method}max_residual_m = 20"),
            ..Words::sample()
        };
        let scene = Scene::new(&words);
        let largest = scene.build("area", 2).report.residual.max_m;
        assert!(largest <= 20.0, "{method}{largest} m is left");
    }
}

#[test]
fn a_tile_that_needs_most_of_the_budget_for_a_largest_residual_gets_it() {
    let limits = "per_load_module = 400\nmean_per_load_module = 30\nper_4km_square = 50000";
    for method in ["", "effort = \"fast\"\n", "method = \"greedy\"\n"] {
        let words = Words {
            size: (6, 6),
            tiles: (3, 3),
            limits: limits.into(),
            tin: format!("{method}max_residual_m = 10"),
            ..Words::raster()
        };
        // Noise that no tile has to follow, and bumps that one has to.
        let dem = Dem::from_fn(words.grid().area(), |post| {
            let noise = (post.row * 7919 + post.col * 104_729).rem_euclid(1201) - 600;
            let is_rough = post.row < 40 && post.col < 40;
            let bumps = if is_rough {
                60.0 * (f64::from(post.row) * 0.5).sin() * (f64::from(post.col) * 0.5).cos()
            } else {
                0.0
            };
            Some((bumps * 128.0) as i32 + noise)
        });
        let report = Scene::on(&words, &dem).build("area", 2).report;
        assert!(
            report.residual.max_m <= 10.0,
            "{method}{} m is left with {} triangles",
            report.residual.max_m,
            report.triangles
        );
    }
}

#[test]
fn an_optimised_area_needs_no_more_triangles_for_a_largest_residual_than_worst_posts_first() {
    for metres in [20, 50, 150] {
        let of = |method: &str| triangles(&built(&format!("{method}max_residual_m = {metres}")));
        let (greedy, optimised) = (of("method = \"greedy\"\n"), of(""));
        assert!(optimised <= greedy, "{metres} m: {optimised} triangles, worst posts first take {greedy}");
    }
}

#[test]
fn what_the_limits_do_not_reach_is_as_true_as_they_permit() {
    let rms = |tin: &str| built(tin).report.residual.rms_m;
    let (plain, asked) = (rms(""), rms("max_residual_m = 0.5"));
    assert!(asked < 2.0 * plain, "RMS {asked} m where a residual is asked for that is out of reach, {plain} m without");
}

#[test]
fn an_rms_residual_ends_the_choosing_whatever_the_method() {
    for method in ["", "effort = \"fast\"\n", "method = \"greedy\"\n"] {
        let mut before = triangles(&built(method)) + 1;
        for metres in [6.0, 9.0, 20.0] {
            let built = built(&format!("{method}target_rms_m = {metres}"));
            let (triangles, rms) = (triangles(&built), built.report.residual.rms_m);
            assert!(triangles < before && rms <= metres, "{method}{metres} m: {triangles} triangles, RMS {rms} m");
            before = triangles;
        }
    }
}
