//! Whole runs: what they promise of any mesh they are given.

use proptest::prelude::*;
use terrain::{Dem, Effort, HeightFit, Importance, Lattice, Post, PostRect, Tin, Vertex};

use crate::optimiser::scene::{Caps, confined, even, free, grid, measured, patchy, rough, spent};
use crate::optimiser::{Task, optimise};

const RECT: PostRect = PostRect { south: 0, west: 0, north: 80, east: 120 };

fn squares(dem: &Dem, step: i32, triangles: usize, effort: Effort) -> f64 {
    let done = optimise(dem, &even(RECT), &grid(dem, step), &free(triangles, effort));
    done.tin.check().unwrap();
    assert!(done.tin.triangles.len() <= triangles, "{} of {triangles}", done.tin.triangles.len());
    measured(&done.tin, dem).0
}

#[test]
fn more_effort_leaves_less() {
    let grounds = [1, 2, 3, 4].map(|seed| rough(RECT, seed));
    let sum = |of: &dyn Fn(&Dem) -> f64| grounds.iter().map(of).sum::<f64>();
    let regular = sum(&|dem| measured(&grid(dem, 10), dem).0);
    let fast = sum(&|dem| squares(dem, 10, 192, Effort::Fast));
    // Thinned from four times as many.
    let normal = sum(&|dem| squares(dem, 5, 192, Effort::Normal));
    let best = sum(&|dem| squares(dem, 5, 192, Effort::Best));
    assert!(best < normal && normal < 0.8 * fast && fast < 0.6 * regular, "{best} {normal} {fast} {regular}");
}

#[test]
fn the_budget_is_met_to_the_last_vertex() {
    let dem = rough(RECT, 2);
    for triangles in [301, 302, 303, 304] {
        let done = optimise(&dem, &even(RECT), &grid(&dem, 5), &free(triangles, Effort::Normal));
        let count = done.tin.triangles.len();
        assert!(count == triangles || count + 1 == triangles, "{count} of {triangles}");
    }
}

#[test]
fn an_rms_residual_asked_for_is_met_with_no_more_than_it_takes() {
    let dem = rough(RECT, 3);
    let rms = 900.0;
    let mut task = free(usize::MAX >> 1, Effort::Normal);
    task.rms_quanta = Some(rms);
    let done = optimise(&dem, &even(RECT), &grid(&dem, 4), &task);
    let found = (measured(&done.tin, &dem).0 / RECT.post_count() as f64).sqrt();
    assert!(0.9 * rms < found && found <= rms, "{found}");
}

#[test]
fn a_largest_residual_asked_for_is_met_where_the_budget_allows_it() {
    let dem = rough(RECT, 4);
    let mut task = free(1200, Effort::Normal);
    let before = measured(&optimise(&dem, &even(RECT), &grid(&dem, 4), &task).tin, &dem).1;
    task = free(1600, Effort::Normal);
    task.largest_quanta = Some(0.8 * before);
    let done = optimise(&dem, &even(RECT), &grid(&dem, 4), &task);
    done.tin.check().unwrap();
    let after = measured(&done.tin, &dem).1;
    assert!(after <= 0.8 * before, "{after} of {before}");
    assert!(done.tin.triangles.len() <= 1600);
}

#[test]
fn a_largest_residual_that_no_budget_reaches_makes_nothing_worse() {
    let dem = rough(RECT, 4);
    for effort in [Effort::Fast, Effort::Normal] {
        let mut task = free(1200, effort);
        let (squares, before) = measured(&optimise(&dem, &even(RECT), &grid(&dem, 4), &task).tin, &dem);
        for share in [0.0, 0.1, 0.5] {
            task.largest_quanta = Some(share * before);
            let done = optimise(&dem, &even(RECT), &grid(&dem, 4), &task);
            done.tin.check().unwrap();
            let (with_goal, after) = measured(&done.tin, &dem);
            assert!(after <= before, "{effort:?}, {share}: {after} of {before}");
            assert!(with_goal <= 1.3 * squares, "{effort:?}, {share}: {with_goal} of {squares}");
            assert!(done.tin.triangles.len() <= 1200);
        }
    }
}

/// Rough ground, cliffs of 100 m across it and a tower on every 100th post.
fn broken(rect: PostRect, seed: u64) -> Dem {
    let ground = rough(rect, seed);
    Dem::from_fn(rect, |post| {
        let cliff = if (post.col + post.row / 3) % 50 < 25 { 12_800 } else { 0 };
        let tower = if (31 * post.row + post.col) % 100 == 0 { 5_000 } else { 0 };
        Some(ground.height(post) / 4 + cliff + tower)
    })
}

/// How far a vertex stands outside the 5 x 5 posts around it, and how far it may.
fn outside(dem: &Dem, tin: &Tin, vertex: &Vertex) -> (i32, i32) {
    let nearest = |at: i32| (2 * at + tin.steps_per_post).div_euclid(2 * tin.steps_per_post);
    let (row, col) = (nearest(vertex.at.row), nearest(vertex.at.col));
    let around = (row - 2..=row + 2).flat_map(|row| (col - 2..=col + 2).map(move |col| Post::new(row, col)));
    let heights: Vec<i32> = around.filter(|&post| dem.rect().contains(post)).map(|post| dem.height(post)).collect();
    let (low, high) = (*heights.iter().min().unwrap(), *heights.iter().max().unwrap());
    ((low - vertex.height).max(vertex.height - high), ((high - low) / 10).max(128))
}

#[test]
fn no_vertex_stands_far_outside_the_posts_around_it() {
    for (seed, effort) in [(1, Effort::Fast), (2, Effort::Normal), (3, Effort::Best)] {
        let dem = broken(RECT, seed);
        for (importance, lattice) in [(even(RECT), Lattice::Eighth), (patchy(RECT, seed), Lattice::Post)] {
            let task = Task { lattice, largest_quanta: Some(4_000.0), ..free(400, effort) };
            let done = optimise(&dem, &importance, &grid(&dem, 5), &task);
            let found: Vec<_> = done.tin.vertices.iter().map(|vertex| outside(&dem, &done.tin, vertex)).collect();
            assert!(found.iter().all(|(beyond, most)| beyond <= most), "{effort:?}, {lattice:?}: {found:?}");
            // Fitted heights do leave them.
            assert!(found.iter().any(|(beyond, _)| 0 < *beyond), "{effort:?}, {lattice:?}");
        }
    }
}

#[test]
fn ground_that_weighs_nothing_is_left_alone() {
    let dem = rough(RECT, 5);
    let nothing = Importance::uniform(RECT, 0);
    for effort in [Effort::Fast, Effort::Normal, Effort::Best] {
        let done = optimise(&dem, &nothing, &grid(&dem, 10), &free(100, effort));
        done.tin.check().unwrap();
        assert!(done.tin.triangles.len() <= 192);
    }
}

#[test]
fn flat_ground_needs_two_triangles_and_keeps_its_height() {
    let dem = Dem::from_fn(RECT, |_| Some(4711));
    let done = optimise(&dem, &even(RECT), &grid(&dem, 10), &free(2, Effort::Normal));
    done.tin.check().unwrap();
    assert_eq!(done.tin.triangles.len(), 2);
    assert!(done.tin.vertices.iter().all(|vertex| vertex.height == 4711));
}

#[test]
fn a_plane_is_met_exactly() {
    let dem = Dem::from_fn(RECT, |post| Some(800 + 24 * post.row - 16 * post.col));
    let done = optimise(&dem, &even(RECT), &grid(&dem, 10), &free(60, Effort::Normal));
    assert_eq!(measured(&done.tin, &dem).1.round(), 0.0);
}

#[test]
fn on_posts_means_on_posts() {
    let dem = rough(RECT, 6);
    let mut task = free(300, Effort::Normal);
    task.lattice = Lattice::Post;
    let done = optimise(&dem, &even(RECT), &grid(&dem, 5), &task);
    done.tin.check().unwrap();
    assert!(done.tin.vertices.iter().all(|vertex| vertex.at.post().is_some()));
}

#[test]
fn unfitted_heights_are_the_dems() {
    let dem = rough(RECT, 7);
    let mut task = free(300, Effort::Normal);
    task.height_fit = HeightFit::Off;
    task.lattice = Lattice::Post;
    let done = optimise(&dem, &even(RECT), &grid(&dem, 5), &task);
    for vertex in &done.tin.vertices {
        let post = vertex.at.post().unwrap();
        assert_eq!(vertex.height, dem.height(post), "{post}");
    }
}

#[test]
fn vertices_go_where_posts_weigh_more_in_squares_and_goals_stay_what_they_are() {
    let dem = rough(RECT, 11);
    let is_west = |col: i32| col < RECT.east / 2;
    let weights: Vec<u16> = RECT.posts().map(|post| if is_west(post.col) { 4000 } else { 1000 }).collect();
    let heavy = Importance::new(RECT, weights, vec![0; RECT.post_count()]);
    let west = |in_squares: Option<Importance>| {
        let task = Task { in_squares, ..free(300, Effort::Normal) };
        let tin = optimise(&dem, &even(RECT), &grid(&dem, 5), &task).tin;
        tin.check().unwrap();
        tin.vertices.iter().filter(|vertex| is_west(vertex.at.col / 8)).count()
    };
    let plain = west(None);
    assert_eq!(west(Some(even(RECT))), plain);
    assert!(5 * plain < 4 * west(Some(heavy.clone())), "{plain}");
    let largest = 1500.0;
    let task = Task { in_squares: Some(heavy), largest_quanta: Some(largest), ..free(2500, Effort::Normal) };
    let met = measured(&optimise(&dem, &even(RECT), &grid(&dem, 2), &task).tin, &dem).1;
    assert!(met <= largest + 1.0, "{met}");
}

#[test]
fn a_spike_field_in_one_load_module_stays_within_its_limit() {
    let spiky = |post: Post| 20 <= post.row && post.row < 40 && 20 <= post.col && post.col < 40;
    let dem =
        Dem::from_fn(RECT, |post| Some(if spiky(post) { (post.row * 7919 + post.col * 104_729) % 3000 } else { 0 }));
    let start = grid(&dem, 4);
    let caps = Caps { side: 20, per_module: 30, per_window: 90, triangles: 700 };
    let task = confined(&start, caps, Effort::Normal);
    let done = optimise(&dem, &even(RECT), &start, &task);
    done.tin.check().unwrap();
    let counts = spent(&done.tin, &task, 20);
    assert_eq!(counts.iter().max(), Some(&30), "{counts:?}");
    assert!(done.refused.is_some_and(|refused| !refused.is_empty()), "what is kept out is told");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn no_limit_is_exceeded_and_no_mesh_is_broken(
        seed in 0u64..1000,
        per_module in 2u32..60,
        per_window in 8u32..160,
        triangles in 40u32..900,
        effort in prop_oneof![Just(Effort::Fast), Just(Effort::Normal), Just(Effort::Best)],
        weighted in any::<bool>(),
    ) {
        let rect = PostRect { south: 0, west: 0, north: 60, east: 80 };
        let dem = rough(rect, seed);
        let importance = if weighted { patchy(rect, seed) } else { even(rect) };
        let start = grid(&dem, 4);
        let caps = Caps { side: 20, per_module, per_window, triangles };
        let task = confined(&start, caps, effort);
        let done = optimise(&dem, &importance, &start, &task);
        prop_assert_eq!(done.tin.check(), Ok(()));
        let counts = spent(&done.tin, &task, 20);
        prop_assert!(counts.iter().all(|&count| count <= per_module), "{:?}", counts);
        for row in 0..2 {
            for col in 0..3 {
                let window: u32 = [0, 1, 4, 5].iter().map(|at| counts[row * 4 + col + at]).sum();
                prop_assert!(window <= per_window, "{} of {}", window, per_window);
            }
        }
        let total: u32 = counts.iter().sum();
        prop_assert!(total <= triangles && total == done.spent, "{} of {}, {} told", total, triangles, done.spent);
        for at in &task.held {
            prop_assert!(done.tin.vertices.iter().any(|vertex| vertex.at == *at), "held vertices stay");
        }
    }
}
