//! Features in a tile: whatever is moved, flipped, thinned and grown around them, they stay.

use std::collections::BTreeMap;

use terrain::limits::{Shortfall, feature_cost};
use terrain::{
    Dem, Effort, Features, Importance, LatticePoint, ModuleGrid, ModuleId, ModuleRect, Post, PostRect, Side, SideSpan,
    Tin,
};

use crate::optimiser::feature_scene::{Draft, Draw, STEPS, crowded, missing, mixed};
use crate::optimiser::scene::{Caps, confined, even, free, grid, rough};
use crate::optimiser::{Budget, Optimised, Task, optimise};

pub(crate) const RECT: PostRect = PostRect { south: 0, west: 0, north: 60, east: 80 };
pub(crate) const SIDE: i32 = 20;
pub(crate) const GRID: ModuleGrid = ModuleGrid { rows: 3, cols: 4, side_cells: SIDE };
pub(crate) const EFFORTS: [Effort; 3] = [Effort::Fast, Effort::Normal, Effort::Best];

fn sloped(seed: u64) -> Dem {
    let noise = rough(RECT, seed);
    Dem::from_fn(RECT, |post| Some(noise.height(post) / 20 + 300 * post.col - 500 * post.row))
}

/// A task under limits that hold for features and all else together, and what features alone exceed.
pub(crate) fn task_with(start: &Tin, features: Features, caps: Caps, effort: Effort) -> (Task, Vec<Shortfall>) {
    let mut task = confined(start, caps, effort);
    let border: Vec<Post> = task.held.iter().filter_map(|at| at.post()).collect();
    let cost = feature_cost(&features, GRID, &border);
    let mut allowance = crate::optimiser::scene::allowance(RECT, caps);
    let short = allowance.take_features(GRID.all(), &cost);
    task.budget = Budget::Limits(crate::optimiser::scene::ledger(RECT, caps, allowance));
    task.features = features;
    (task, short)
}

/// Triangles of each load module but the two of a bare square, and those of its held border: by their centres alone.
pub(crate) fn counted(tin: &Tin, task: &Task) -> BTreeMap<ModuleId, u32> {
    let mut count: BTreeMap<ModuleId, i64> = GRID.all().iter().map(|module| (module, -2)).collect();
    let line = i64::from(SIDE * tin.steps_per_post);
    for triangle in &tin.triangles {
        let corners = triangle.map(|v| tin.vertices[v as usize].at);
        let of = |pick: fn(&LatticePoint) -> i32| {
            (corners.iter().map(|at| i64::from(pick(at))).sum::<i64>() / (3 * line)) as u32
        };
        *count
            .get_mut(&ModuleId { row: of(|at| at.row), col: of(|at| at.col) })
            .expect("triangles lie in load modules") += 1;
    }
    for post in task.held.iter().filter_map(|at| at.post()) {
        let is_corner = post.row % SIDE == 0 && post.col % SIDE == 0;
        let module = |v: i32, last: u32| (v / SIDE).min(last as i32 - 1) as u32;
        if !is_corner {
            let module = ModuleId { row: module(post.row, GRID.rows), col: module(post.col, GRID.cols) };
            *count.get_mut(&module).expect("held posts lie in load modules") -= 1;
        }
    }
    count
        .into_iter()
        .map(|(module, count)| (module, u32::try_from(count).expect("a load module has two triangles at least")))
        .collect()
}

#[track_caller]
pub(crate) fn assert_kept(done: &Optimised, task: &Task) {
    assert_eq!(done.tin.check(), Ok(()));
    assert!(done.left_out.is_empty(), "{:?}", done.left_out);
    assert_eq!(done.tin.steps_per_post, STEPS);
    let is_given = |at: LatticePoint| {
        let held = |held: &LatticePoint| LatticePoint::new(held.row * 8, held.col * 8) == at;
        task.held.iter().any(held) || (at.row % (SIDE * STEPS) == 0 && at.col % (SIDE * STEPS) == 0)
    };
    let missing = missing(&done.tin, &task.features, &is_given);
    assert!(missing.is_empty(), "{} of {}: {missing:?}", missing.len(), task.features.edges.len());
}

#[track_caller]
fn assert_within(done: &Optimised, task: &Task, caps: Caps) {
    assert_eq!(done.short, []);
    let count = counted(&done.tin, task);
    for (module, count) in &count {
        assert!(*count <= caps.per_module, "load module {module}: {count} of {}", caps.per_module);
    }
    for (south, west) in [(0, 0), (0, 1), (0, 2), (1, 0), (1, 1), (1, 2)] {
        let window = ModuleRect { south, west, north: south + 2, east: west + 2 };
        let sum: u32 = window.iter().map(|module| count[&module]).sum();
        assert!(sum <= caps.per_window, "window {south},{west}: {sum} of {}", caps.per_window);
    }
    assert!(count.values().sum::<u32>() <= caps.triangles);
}

#[test]
fn every_edge_and_every_vertex_of_features_is_in_the_tin_at_every_effort_and_limits_hold() {
    for seed in 0..8 {
        let dem = if seed % 2 == 0 { rough(RECT, seed) } else { sloped(seed) };
        let features = mixed(RECT, SIDE, seed).features(&dem);
        assert!(40 < features.edges.len(), "{} edges", features.edges.len());
        let dearest = feature_cost(&features, GRID, &[]).into_values().max().expect("features cost something");
        for effort in EFFORTS {
            // A fast tile is not thinned: it is grown within its budget.
            let start = grid(&dem, if effort == Effort::Fast { 10 } else { 4 });
            let per_module = dearest + 20;
            let caps = Caps { side: SIDE, per_module, per_window: 3 * per_module, triangles: 8 * per_module };
            let (task, short) = task_with(&start, features.clone(), caps, effort);
            assert_eq!(short, []);
            let done = optimise(&dem, &even(RECT), &start, &task);
            assert_kept(&done, &task);
            assert_within(&done, &task, caps);
        }
    }
}

#[test]
fn two_hundred_short_roads_in_one_load_module_stay_within_its_limit() {
    let dem = rough(RECT, 5);
    let features = crowded(RECT, SIDE, 200, 5).features(&dem);
    assert_eq!(features.edges.len(), 200);
    let cost = feature_cost(&features, GRID, &[]);
    let crowd = cost[&ModuleId { row: 1, col: 1 }];
    for effort in [Effort::Normal, Effort::Best] {
        let start = grid(&dem, 4);
        let caps = Caps { side: SIDE, per_module: crowd + 2, per_window: crowd + 60, triangles: crowd + 300 };
        let (task, short) = task_with(&start, features.clone(), caps, effort);
        assert_eq!(short, []);
        let done = optimise(&dem, &even(RECT), &start, &task);
        assert_kept(&done, &task);
        assert_within(&done, &task, caps);
    }
}

#[test]
fn features_that_alone_exceed_a_limit_are_told_and_nothing_else_is_put_there() {
    let dem = rough(RECT, 6);
    let features = crowded(RECT, SIDE, 60, 6).features(&dem);
    let crowd = ModuleId { row: 1, col: 1 };
    let cost = feature_cost(&features, GRID, &[])[&crowd];
    let start = grid(&dem, 4);
    let caps = Caps { side: SIDE, per_module: cost - 10, per_window: 10_000, triangles: 10_000 };
    let (task, short) = task_with(&start, features, caps, Effort::Normal);
    let found: Vec<_> = short.iter().map(|short| (short.of, short.needed, short.room)).collect();
    assert_eq!(found, [(terrain::limits::ShortOf::Module(crowd), cost, cost - 10)]);
    let done = optimise(&dem, &even(RECT), &start, &task);
    assert_kept(&done, &task);
    assert_eq!(counted(&done.tin, &task)[&crowd], cost, "features and nothing else");
    assert_eq!(done.short, [], "what is not features keeps to what is left");
}

#[test]
fn a_number_of_triangles_counts_features_and_tells_where_they_exceed_it() {
    let dem = rough(RECT, 7);
    let features = mixed(RECT, SIDE, 7).features(&dem);
    for (triangles, fits) in [(900, true), (40, false)] {
        let task = Task { features: features.clone(), ..free(triangles, Effort::Normal) };
        let done = optimise(&dem, &even(RECT), &grid(&dem, 4), &task);
        assert_eq!(done.tin.check(), Ok(()));
        assert_eq!(done.tin.triangles.len() <= triangles, fits);
        assert_eq!(done.short.is_empty(), fits);
    }
}

#[test]
fn the_order_in_which_features_are_given_changes_no_bit() {
    let dem = rough(RECT, 8);
    let features = mixed(RECT, SIDE, 8).features(&dem);
    let start = grid(&dem, 4);
    let caps = Caps { side: SIDE, per_module: 200, per_window: 600, triangles: 1500 };
    let done = |features: Features| {
        let (task, _) = task_with(&start, features, caps, Effort::Normal);
        optimise(&dem, &even(RECT), &start, &task).tin
    };
    let expected = done(features.clone());
    let mut draw = Draw(8);
    let mut order: Vec<u32> = (0..features.vertices.len() as u32).collect();
    draw.shuffle(&mut order);
    let mut other = features.clone();
    other.vertices = order.iter().map(|&v| features.vertices[v as usize]).collect();
    let place = |v: u32| order.iter().position(|&w| w == v).expect("the order names all") as u32;
    other.edges = features.edges.iter().map(|&[a, b]| [place(b), place(a)]).collect();
    draw.shuffle(&mut other.edges);
    assert_eq!(done(other), expected);
}

#[test]
fn without_features_a_line_that_is_none_changes_nothing() {
    let dem = rough(RECT, 9);
    let start = grid(&dem, 4);
    let task = free(300, Effort::Normal);
    let finer = Task { features: Features { steps_per_post: STEPS, ..Features::default() }, ..task.clone() };
    let [one, other] = [&task, &finer].map(|task| optimise(&dem, &even(RECT), &start, task).tin);
    let at =
        |tin: &Tin| tin.vertices.iter().map(|v| (v.at.row * 64 / tin.steps_per_post, v.height)).collect::<Vec<_>>();
    assert_eq!((at(&one), &one.triangles), (at(&other), &other.triangles));
}

#[test]
fn posts_without_weight_hold_no_vertex_once_there_are_features() {
    // A pond: its shore is a feature, its posts have no weight.
    let dem = rough(RECT, 10);
    let mut draft = Draft::new(RECT, SIDE);
    let (low, high) = (22 * STEPS + 30, 37 * STEPS + 10);
    assert!(draft.add(&[(low, low), (low, high), (high, high), (high, low), (low, low)]));
    let features = draft.features(&dem);
    let is_wet = |post: Post| 23 <= post.row && post.row <= 37 && 23 <= post.col && post.col <= 37;
    let posts = (0..=60).flat_map(|row| (0..=80).map(move |col| Post::new(row, col)));
    let weights = posts.map(|post| if is_wet(post) { 0 } else { 1000 }).collect();
    let importance = Importance::new(RECT, weights, vec![0; RECT.post_count()]);
    for effort in EFFORTS {
        let start = grid(&dem, 4);
        let caps = Caps { side: SIDE, per_module: 100, per_window: 300, triangles: 900 };
        let (task, _) = task_with(&start, features.clone(), caps, effort);
        let done = optimise(&dem, &importance, &start, &task);
        assert_kept(&done, &task);
        let within = |v: i32| low < v && v < high;
        let inside = done.tin.vertices.iter().filter(|vertex| within(vertex.at.row) && within(vertex.at.col));
        assert_eq!(inside.count(), 0, "{effort:?}");
    }
}

#[test]
fn no_vertex_comes_to_stand_between_the_edges_of_a_strip_on_a_side() {
    let dem = rough(RECT, 11);
    let mut draft = Draft::new(RECT, SIDE);
    let (west, east) = (30 * STEPS + 20, 36 * STEPS - 9);
    let north = 60 * STEPS;
    for col in [west, east] {
        assert!(draft.add(&[(north - 700, col), (north, col)]));
    }
    let spans = vec![SideSpan { side: Side::North, from: west, to: east }];
    let features = Features { spans, ..draft.features(&dem) };
    for effort in EFFORTS {
        let start = grid(&dem, 4);
        let task = Task { features: features.clone(), ..free(1200, effort) };
        let done = optimise(&dem, &even(RECT), &start, &task);
        assert_eq!(done.tin.check(), Ok(()));
        let between = done.tin.vertices.iter().filter(|v| v.at.row == north && west < v.at.col && v.at.col < east);
        assert_eq!(between.count(), 0, "{effort:?}");
    }
}

#[test]
fn edges_that_cross_are_told_and_the_others_stay() {
    let dem = rough(RECT, 12);
    let mut features = mixed(RECT, SIDE, 12).features(&dem);
    let far = features.vertices.len() as u32;
    for (row, col) in [(3 * STEPS, 3 * STEPS), (57 * STEPS, 77 * STEPS)] {
        features.vertices.push(terrain::Vertex { at: LatticePoint::new(row, col), height: 0 });
    }
    features.edges.push([far, far + 1]);
    let start = grid(&dem, 4);
    let caps = Caps { side: SIDE, per_module: 300, per_window: 900, triangles: 2000 };
    let (task, _) = task_with(&start, features, caps, Effort::Normal);
    let done = optimise(&dem, &even(RECT), &start, &task);
    assert_eq!(done.tin.check(), Ok(()));
    let left_out = missing(&done.tin, &task.features, &|_| true).len();
    assert!(0 < left_out && left_out <= done.left_out.len(), "{left_out} of {}", done.left_out.len());
}
