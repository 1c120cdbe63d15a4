//! The figures of ALGORITHMS 2.12, 4.4 and 6.10 on the 460 x 376 window of the real desert, residuals within a fifth.

use build::workbench::{TinMethod, TinRequest};
use fidelity::{PostHeights, Triangles};
use job::ErrorKey;
use terrain::{Dem, Importance, LastBatch, Metres, Post, PostRect, SeamSides, THOUSANDTHS, TileId, Tin};
use tin::{Frame, Proximity, Rule, Stop, TileTask};

use crate::real_ground::{data, read_dem};
use crate::scene::{Silent, write_dem};
use crate::surface::{Sums, sums_of_tin};

/// Columns 481 to 940 and rows 0 to 375 from the north: in southern rows, 648 to 1023.
fn window() -> Option<Dem> {
    let path = data("ntc_scape/ntc_1024x1024_25m_assumed.tif")?;
    let dem = read_dem(&path, |_| PostRect::new(Post::new(648, 481), Post::new(1023, 940)));
    let rect = PostRect::of_size(376, 460);
    Some(Dem::from_fn(rect, |post| Some(dem.height(Post::new(post.row + 648, post.col + 481)))))
}

/// The TIN of `points` vertices in all.
fn refined(dem: &Dem, rule: Rule, points: usize) -> Tin {
    let task = TileTask {
        tile: TileId { row: 0, col: 0 },
        rect: dem.rect(),
        frame: Frame::Plain,
        border: Vec::new(),
        inherited: Vec::new(),
        kept: Vec::new(),
        start: Vec::new(),
        seams: SeamSides::OPEN,
        barred: Vec::new(),
        rule,
        stop: Stop { points: Some(points - 4), ..Stop::default() },
    };
    let weights = Importance::uniform(dem.rect(), THOUSANDTHS);
    tin::refine(dem, &weights, &task, terrain::geometry::widest_level()).tin
}

fn batches(residual_quantum: u32, is_thinned: bool) -> Rule {
    let proximity = is_thinned.then_some(Proximity { posts: 12.0, quanta: 20 * 128 });
    Rule::Batches { residual_quantum, proximity, last_batch: LastBatch::Truncate }
}

#[track_caller]
fn check(dem: &Dem, rule: Rule, points: usize, rms_m: f64) -> Sums {
    let tin = refined(dem, rule, points);
    tin.check().unwrap();
    assert_eq!(tin.vertices.len(), points);
    let sums = sums_of_tin(&tin, dem);
    assert_eq!(sums.posts, 172_960);
    let found = sums.rms_m();
    assert!(
        (0.8 * rms_m..=1.2 * rms_m).contains(&found),
        "{points} points: {found} m, expected {rms_m} within a fifth"
    );
    sums
}

#[test]
fn the_papers_passes_come_as_near_to_the_ground_as_measured() {
    let Some(dem) = window() else { return };
    check(&dem, batches(128, true), 2500, 4.06);
    check(&dem, batches(128, true), 5000, 2.50);
}

#[test]
fn without_the_proximity_test_whole_metres_cost_a_quarter_of_the_truth() {
    let Some(dem) = window() else { return };
    for (points, with, without) in [(2500, 4.06, 5.43), (5000, 2.50, 3.12)] {
        let thinned = check(&dem, batches(128, true), points, with);
        let plain = check(&dem, batches(128, false), points, without);
        assert!(1.1 * thinned.rms_m() < plain.rms_m(), "{} and {}", thinned.rms_m(), plain.rms_m());
    }
}

#[test]
fn at_full_precision_the_proximity_test_changes_next_to_nothing() {
    let Some(dem) = window() else { return };
    for (points, rms_m) in [(2500, 4.15), (5000, 2.55)] {
        let thinned = check(&dem, batches(1, true), points, rms_m);
        let plain = check(&dem, batches(1, false), points, rms_m);
        assert!((thinned.rms_m() / plain.rms_m() - 1.0).abs() < 0.03, "{} and {}", thinned.rms_m(), plain.rms_m());
    }
}

#[test]
fn squares_are_nearer_to_the_ground_than_the_worst_post() {
    let Some(dem) = window() else { return };
    let worst = check(&dem, Rule::WorstFirst, 5000, 2.55);
    let squares = check(&dem, Rule::LargestSquares { guard: None }, 5000, 2.31);
    let gain = 1.0 - squares.rms_m() / worst.rms_m();
    assert!((0.05..0.25).contains(&gain), "squares are {gain} better");
}

/// What is seen and how steep it is: agreement, share visible on the TIN, RMS difference of slopes in degrees.
#[track_caller]
fn check_measures(dem: &Dem, rule: Rule, [agreement, visible, slope]: [f64; 3]) {
    let triangles = Triangles::of_tin(&refined(dem, rule, 5000));
    let sight = fidelity::line_of_sight(dem, &triangles, Metres(25.0), 20_000, 1);
    let posts = PostHeights::of_dem(dem, triangles.rect());
    let steepness = fidelity::slope(&posts, &PostHeights::of_triangles(&triangles, &posts), Metres(25.0));
    assert_eq!((sight.pairs(), steepness.posts), (20_000, 458 * 374));
    let expected = [agreement, visible, 0.283, slope];
    let found = [sight.agreement(), sight.visible_share_tin(), sight.visible_share_dem(), steepness.rms_degrees];
    // Two half widths of 20,000 pairs for shares, a twentieth for slopes.
    let within = [0.008, 0.012, 0.012, slope / 20.0];
    let is_near = (0..4).all(|i| (found[i] - expected[i]).abs() <= within[i]);
    assert!(is_near, "found {found:?}, expected {expected:?} within {within:?}");
}

#[test]
fn the_worst_post_shows_what_the_desert_hides_as_measured() {
    let Some(dem) = window() else { return };
    check_measures(&dem, Rule::WorstFirst, [0.919, 0.311, 2.41]);
}

#[test]
fn a_mesh_from_a_raster_is_that_of_the_method_and_tiles_cost_little() {
    let Some(dem) = window() else { return };
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("window.tif");
    write_dem(&path, &dem);
    let mesh = |method, tiles, workers| {
        let request =
            TinRequest { points: Some(5000), tiles: Some(tiles), workers, ..TinRequest::plain(path.clone(), method) };
        let mesh = build::workbench::tin(&request, &false.into(), &mut Silent).unwrap();
        mesh.tin.check().unwrap();
        let sums = sums_of_tin(&mesh.tin, &dem);
        assert!((mesh.residual.rms_m - sums.rms_m()).abs() < 1e-9, "{method:?} {tiles:?}");
        mesh
    };
    for (method, rule) in [
        (TinMethod::Paper, batches(128, true)),
        (TinMethod::Greedy { key: ErrorKey::Max }, Rule::WorstFirst),
        (TinMethod::Greedy { key: ErrorKey::Sse }, Rule::LargestSquares { guard: None }),
    ] {
        let untiled = mesh(method, (1, 1), 1);
        assert_eq!(untiled.tin, refined(&dem, rule, 5000), "{method:?}");
        let tiled = mesh(method, (3, 4), 2);
        assert_eq!(tiled.points, 5000, "{method:?}: points of tiles add up");
        assert_eq!(tiled.tin, mesh(method, (3, 4), 1).tin, "{method:?}: one worker and two");
        let ratio = tiled.residual.rms_m / untiled.residual.rms_m;
        assert!((0.9..1.05).contains(&ratio), "{method:?}: tiles cost {ratio}");
    }
}
