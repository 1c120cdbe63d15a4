//! Every mode gives a sound product: no cracks, no T-junctions, exact areas, both identities, limits, true numbers.

use job::{Edges as JobEdges, HeightFit, Job, Lattice, Method, Optimising, OuterBorder};
use terrain::{Dem, Post};

use crate::findings::{check_limits, check_report};
use crate::modes;
use crate::product::{Edges, Product};
use crate::scene::{SIDE_CELLS, Scene, Words, sample_dem};
use crate::surface::sums_of_product;

/// Builds a scene's job and checks all of it against `dem`.
#[track_caller]
pub fn check(scene: &Scene, dem: &Dem) {
    let built = scene.build("area", 2);
    let edges = match scene.job.modules.edges {
        JobEdges::Constrained => Edges::Constrained,
        JobEdges::Clip(_) => Edges::Clipped,
    };
    let product = Product::read(&scene.path("area"));
    product.check(edges);
    check_limits(&scene.job, &product, &built, edges);
    check_report(&scene.job, &product, &built, &sums_of_product(&product, dem));
    check_heights(&scene.job, &product, dem, edges);
    drop(built);
    scene.verify("area");
}

/// Where vertices may stand: corners of load modules and all that is not optimised on posts, the rest on eighths. At
/// DEM height stands a fixed outer border, and all that is not fitted.
#[track_caller]
fn check_heights(job: &Job, product: &Product, dem: &Dem, edges: Edges) {
    let (is_free, is_fitted) = match job.tin.method {
        Method::Optimised(Optimising { height_fit, lattice, .. }) => {
            (lattice == Lattice::Eighth, height_fit != HeightFit::Off)
        }
        Method::Paper { .. } | Method::Greedy => (false, false),
    };
    let is_fixed = job.modules.outer_border == OuterBorder::Fixed;
    let step = product.side / i64::from(SIDE_CELLS);
    for (&(row, col), module) in &product.modules {
        for vertex in &module.vertices {
            let (x, y) = (i64::from(vertex.x), i64::from(vertex.y));
            let on_line = [x % product.side == 0, y % product.side == 0];
            let is_corner = on_line == [true; 2];
            if edges == Edges::Clipped && !is_corner {
                continue;
            }
            let step = if is_free && !is_corner { step / 8 } else { step };
            assert_eq!((x % step, y % step), (0, 0), "load module {row},{col}: a vertex off its lattice");
            let post = Post::new(
                row as i32 * SIDE_CELLS + (y * i64::from(SIDE_CELLS) / product.side) as i32,
                col as i32 * SIDE_CELLS + (x * i64::from(SIDE_CELLS) / product.side) as i32,
            );
            let area = dem.rect();
            let is_on_post =
                (x * i64::from(SIDE_CELLS)) % product.side == 0 && (y * i64::from(SIDE_CELLS)) % product.side == 0;
            let is_outer = is_fixed
                && is_on_post
                && on_line != [false; 2]
                && (post.row == area.south || post.row == area.north || post.col == area.west || post.col == area.east);
            if (!is_fitted && is_on_post) || is_outer {
                assert_eq!(vertex.z, dem.height(post), "load module {row},{col}: height at {post}");
            }
        }
    }
}

#[track_caller]
fn check_modes(modes: Vec<modes::Mode>) {
    let dem = sample_dem(modes[0].1.grid(), 1);
    for mode in modes {
        eprintln!("mode: {}", mode.0);
        check(&modes::scene(&mode), &dem);
    }
}

#[test]
fn every_constrained_mode_is_whole_and_within_its_limits() {
    check_modes(modes::constrained());
}

#[test]
fn every_clipped_mode_is_whole_and_tells_every_limit_it_exceeds() {
    check_modes(modes::clipped());
}

#[test]
fn enforcing_meets_limits_that_can_be_met() {
    for mode in modes::clipped().into_iter().filter(|mode| mode.0.contains("limits that bind")) {
        let scene = modes::scene(&mode);
        let built = scene.build("area", 2);
        assert_eq!(built.report.breaches, [], "{}", mode.0);
        assert!(built.report.points.selected < 800, "{}: no point was taken out", mode.0);
    }
}

#[test]
fn regular_border_points_that_make_room_are_not_counted_as_selected_ones() {
    // Hardly a point is selected, so nearly all that is taken out are points of the regular borders.
    let words = Words {
        size: (7, 3),
        tiles: (3, 1),
        order: "borders = \"regular\"".into(),
        modules: "edges = \"clip\"".into(),
        limits: "per_load_module = 12\nmean_per_load_module = 10\nper_4km_square = 130".into(),
        tin: "method = \"greedy\"\npoints = 3".into(),
        ..Words::sample()
    };
    check(&Scene::new(&words), &sample_dem(words.grid(), 1));
}

#[test]
fn points_to_start_from_go_with_every_effort() {
    for effort in ["fast", "normal"] {
        let tin = format!("effort = \"{effort}\"\nstart = {{ method = \"vip\", points = 500 }}");
        let limits = "per_load_module = 20\nmean_per_load_module = 8".into();
        let scene = Scene::new(&Words { tin, limits, ..Words::sample() });
        drop(scene.build("area", 2));
        scene.verify("area");
    }
}

#[test]
fn limits_that_no_removal_can_meet_are_breaches() {
    // What load modules start with: once a border point is chosen in the merge, its pieces are more.
    let tin = "method = \"paper\"\npoints = 800".into();
    let limits = "per_load_module = 8\nmean_per_load_module = 3.3\nper_4km_square = 192".into();
    let words = Words { modules: "edges = \"clip\"".into(), limits, tin, ..Words::sample() };
    let scene = Scene::new(&words);
    check(&scene, &sample_dem(words.grid(), 1));
    let report = scene.build("area", 2).report;
    assert!(!report.breaches.is_empty());
    assert!(report.breaches.iter().all(|breach| breach.rms_without_m.is_some()), "what the limit cost was computed");
}

#[test]
fn a_refined_outer_border_is_as_true_as_the_ground_inside() {
    for method in ["effort = \"fast\"", ""] {
        let border = |kind: &str| {
            let modules = format!("outer_border = \"{kind}\"");
            let scene = Scene::new(&Words { modules, tin: method.into(), ..Words::sample() });
            let report = scene.build("area", 2).report;
            scene.verify("area");
            Product::read(&scene.path("area")).check(Edges::Constrained);
            assert!(report.per_load_module.max <= 100 && report.per_load_module.mean <= 32.0, "{method} {kind}");
            (report.points.border, report.residual.rms_m, report.border.expect("there is ground inside"))
        };
        let (none, rms_m, refined) = border("refined");
        let (some, fixed_rms_m, fixed) = border("fixed");
        assert!(none == 0 && 0 < some);
        assert!(refined.at_border.rms_m < fixed.at_border.rms_m, "{method}: {refined:?} {fixed:?}");
        assert!(refined.at_border.rms_m < 1.3 * refined.inside.rms_m, "{method}: {refined:?}");
        assert!(rms_m < fixed_rms_m, "{method}: {rms_m} {fixed_rms_m}");
    }
}

#[test]
fn a_fixed_outer_border_holds_a_point_every_border_step_and_no_other() {
    for (name, mut words) in modes::all().into_iter().step_by(5) {
        words.modules += "\nouter_border = \"fixed\"";
        let mode = (name, words);
        let scene = modes::scene(&mode);
        drop(scene.build("area", 2));
        let product = Product::read(&scene.path("area"));
        let along = |row: u32, col: u32, on: fn(&load_module_reader::Vertex, i64) -> Option<u16>| {
            let mut found: Vec<u16> =
                product.modules[&(row, col)].vertices.iter().filter_map(|v| on(v, product.side)).collect();
            found.sort_unstable();
            assert_eq!(found, [0, 16_000, 32_000, 48_000, 64_000], "{}: load module {row},{col}", mode.0);
        };
        for col in 0..product.cols {
            along(0, col, |v, _| (v.y == 0).then_some(v.x));
            along(product.rows - 1, col, |v, side| (i64::from(v.y) == side).then_some(v.x));
        }
        for row in 0..product.rows {
            along(row, 0, |v, _| (v.x == 0).then_some(v.y));
            along(row, product.cols - 1, |v, side| (i64::from(v.x) == side).then_some(v.y));
        }
    }
}
