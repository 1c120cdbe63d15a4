//! Features that hardly fit: lines a step apart, along and through everything, under limits too small for them.

use proptest::prelude::*;
use terrain::limits::{ShortOf, feature_cost};
use terrain::{Effort, Features, HeightFit, Lattice, LatticePoint, ModuleId, ModuleRect};

use crate::optimiser::feature_scene::{At, Draft, STEPS, missing};
use crate::optimiser::feature_tests::{EFFORTS, GRID, RECT, SIDE, assert_kept, counted, task_with};
use crate::optimiser::optimise;
use crate::optimiser::scene::{Caps, even, grid, rough};

const ROWS: i32 = 60;
const COLS: i32 = 80;
const LINE: i32 = SIDE * STEPS;

/// Optimises under limits that hold for features and all else, and checks what has to hold whatever they are: every
/// edge is there, and a limit is exceeded only where features alone exceed it, by what they cost and no more.
#[track_caller]
fn check(features: &Features, caps: Caps, settle: impl Fn(&mut crate::optimiser::Task)) {
    let dem = rough(RECT, 3);
    for effort in EFFORTS {
        let start = grid(&dem, if effort == Effort::Fast { 10 } else { 4 });
        let (mut task, short) = task_with(&start, features.clone(), caps, effort);
        settle(&mut task);
        let done = optimise(&dem, &even(RECT), &start, &task);
        assert_kept(&done, &task);
        assert_eq!(done.short, [], "{effort:?}");
        let border: Vec<_> = task.held.iter().filter_map(|at| at.post()).collect();
        let (cost, count) = (feature_cost(features, GRID, &border), counted(&done.tin, &task));
        let needed = |modules: ModuleRect| modules.iter().map(|module| cost.get(&module).copied().unwrap_or(0)).sum();
        let held = |of: ShortOf, modules: ModuleRect, room: u32| {
            let (found, needed): (u32, u32) = (modules.iter().map(|module| count[&module]).sum(), needed(modules));
            assert!(found <= room.max(needed), "{effort:?} {of:?}: {found}, features {needed}, room {room}");
            let told = short.iter().find(|short| short.of == of).map(|short| (short.needed, short.room));
            assert_eq!(told, (room < needed).then_some((needed, room)), "{effort:?} {of:?}");
        };
        let of = |module: ModuleId, size: u32| ModuleRect {
            south: module.row,
            west: module.col,
            north: module.row + size,
            east: module.col + size,
        };
        GRID.all().iter().for_each(|module| held(ShortOf::Module(module), of(module, 1), caps.per_module));
        let windows = ModuleRect { south: 0, west: 0, north: GRID.rows - 1, east: GRID.cols - 1 };
        windows.iter().for_each(|module| held(ShortOf::Window(module), of(module, 2), caps.per_window));
        held(ShortOf::Tile, GRID.all(), caps.triangles);
    }
}

/// The features of some lines, all of which fit together, under ample and under small limits.
#[track_caller]
fn check_lines(lines: &[&[At]]) {
    let mut draft = Draft::new(RECT, SIDE);
    for line in lines {
        assert!(draft.add(line), "{line:?} touches another elsewhere than at a vertex");
    }
    let features = draft.features(&rough(RECT, 3));
    for room in [0, 60, 400] {
        check(&features, Caps { side: SIDE, per_module: room, per_window: 3 * room, triangles: 8 * room }, |_| {});
    }
}

#[test]
fn lines_one_step_apart_stay_apart() {
    let side_by_side: Vec<Vec<At>> =
        (0..6).map(|by| vec![(700 + by, 300), (703 + by, 2100), (701 + by, 4000)]).collect();
    check_lines(&side_by_side.iter().map(Vec::as_slice).collect::<Vec<_>>());
    check_lines(&[&[(500, 500), (500, 700), (501, 500)], &[(502, 500), (900, 501), (502, 501)]]);
}

#[test]
fn vertices_one_step_from_a_line_of_load_modules_stay_there() {
    let along = |row: i32| -> Vec<At> { (0..40).map(|i| (row + i % 2, 100 + 77 * i)).collect() };
    check_lines(&[&along(LINE + 1), &along(LINE - 2), &[(LINE - 4, LINE - 1), (LINE - 9, LINE - 3)]]);
    check_lines(&[&[(LINE - 1, LINE + 1), (LINE + 1, LINE + 2)], &[(1, 1), (1, 2), (2, 1)], &[(0, 1), (1, 0)]]);
}

#[test]
fn lines_run_along_sides_and_lines_of_load_modules_and_through_corners() {
    let (north, east) = (ROWS * STEPS, COLS * STEPS);
    check_lines(&[&[(0, 0), (0, 5 * STEPS + 1), (0, LINE), (0, east)]]);
    check_lines(&[&[(0, 0), (north, 0)], &[(north, 0), (north, east)], &[(north - 1, 1), (north - 1, east - 1)]]);
    check_lines(&[&[(LINE, 0), (LINE, east)], &[(0, LINE), (LINE, LINE)], &[(LINE, LINE), (north, LINE)]]);
    check_lines(&[&[(0, 0), (LINE, LINE), (2 * LINE, 2 * LINE), (north, 2 * LINE)], &[(north, east), (17, 3 * LINE)]]);
}

#[test]
fn two_hundred_roads_in_one_load_module_leave_nothing_else_there() {
    for seed in [5, 6] {
        let features = crate::optimiser::feature_scene::crowded(RECT, SIDE, 200, seed).features(&rough(RECT, 3));
        for room in [0, 300] {
            check(&features, Caps { side: SIDE, per_module: room, per_window: 2 * room, triangles: 2 * room }, |_| {});
        }
    }
}

#[test]
fn an_edge_that_cannot_be_kept_is_told_and_every_other_is_there() {
    let dem = rough(RECT, 3);
    let mut draft = Draft::new(RECT, SIDE);
    assert!(draft.add(&[(300, 300), (300, 900), (900, 900)]) && draft.add(&[(100, 100), (100, 1100)]));
    let mut features = draft.features(&dem);
    let mut vertex = |row: i32, col: i32| {
        features.vertices.push(terrain::Vertex { at: LatticePoint::new(row, col), height: 7 });
        features.vertices.len() as u32 - 1
    };
    // One crosses an edge that comes before it, one a line of load modules; one runs through the end of another and is
    // there in two pieces.
    let crossing = [vertex(600, 600), vertex(601, 1200)];
    let beyond = [vertex(LINE - 40, 50), vertex(LINE + 40, 51)];
    let through = [vertex(80, 100), vertex(120, 100)];
    features.edges.extend([crossing, beyond, through]);
    let at = |ends: [u32; 2]| ends.map(|v| features.vertices[v as usize].at);
    for effort in EFFORTS {
        let start = grid(&dem, 4);
        let caps = Caps { side: SIDE, per_module: 300, per_window: 900, triangles: 2000 };
        let (task, _) = task_with(&start, features.clone(), caps, effort);
        let done = optimise(&dem, &even(RECT), &start, &task);
        assert_eq!(done.tin.check(), Ok(()));
        assert_eq!(done.left_out.len(), 2, "{:?}", done.left_out);
        assert!([crossing, beyond].into_iter().all(|edge| done.left_out.contains(&at(edge))), "{:?}", done.left_out);
        assert_eq!(missing(&done.tin, &features, &|at| at == LatticePoint::new(100, 100)).len(), 2);
    }
}

/// Places near what is special, lines of load modules, sides of the tile and posts, or anywhere.
fn coordinate(cells: i32) -> impl Strategy<Value = i32> + Clone {
    let (far, lines) = (cells * STEPS, cells / SIDE);
    prop_oneof![
        2 => 0..=far,
        2 => (0..=lines, -2..=2_i32).prop_map(move |(line, by)| (line * LINE + by).clamp(0, far)),
        1 => (0..=cells, -1..=1_i32).prop_map(move |(post, by)| (post * STEPS + by).clamp(0, far)),
    ]
}

/// Where a line goes on: to a place, or a little farther.
#[derive(Clone, Debug)]
enum Step {
    To(At),
    By(At),
}

fn step() -> impl Strategy<Value = Step> {
    let by = || prop_oneof![-2..=2_i32, -70..=70_i32, -1500..=1500_i32];
    prop_oneof![
        1 => (coordinate(ROWS), coordinate(COLS)).prop_map(Step::To),
        3 => (by(), by()).prop_map(Step::By),
    ]
}

/// A start that may be the vertex of another line, and steps from there.
fn way() -> impl Strategy<Value = (At, bool, u64, Vec<Step>)> {
    let start = (coordinate(ROWS), coordinate(COLS));
    (start, any::<bool>(), any::<u64>(), prop::collection::vec(step(), 1..5))
}

fn drawn(ways: &[(At, bool, u64, Vec<Step>)]) -> Draft {
    let mut draft = Draft::new(RECT, SIDE);
    for (start, branches, seed, steps) in ways {
        let vertex = draft.vertex(&mut crate::optimiser::feature_scene::Draw(*seed)).filter(|_| *branches);
        let mut line = vec![vertex.unwrap_or(*start)];
        for step in steps {
            let (row, col) = line[line.len() - 1];
            line.push(match *step {
                Step::To(at) => at,
                Step::By((north, east)) => ((row + north).clamp(0, ROWS * STEPS), (col + east).clamp(0, COLS * STEPS)),
            });
        }
        draft.add(&line);
    }
    draft
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 48, ..ProptestConfig::default() })]

    #[test]
    fn whatever_lines_there_are_they_stay_and_nothing_else_exceeds_a_limit(
        ways in prop::collection::vec(way(), 1..60),
        rooms in (0..200_u32, 0..500_u32, 0..1500_u32),
        largest_quanta in prop::option::of(500.0..9000.0),
        on_posts: bool,
        fits: bool,
    ) {
        let features = drawn(&ways).features(&rough(RECT, 3));
        prop_assume!(!features.is_empty());
        let (per_module, per_window, triangles) = rooms;
        check(&features, Caps { side: SIDE, per_module, per_window, triangles }, |task| {
            task.largest_quanta = largest_quanta;
            task.lattice = if on_posts { Lattice::Post } else { Lattice::Eighth };
            task.height_fit = if fits { HeightFit::Squares } else { HeightFit::Off };
        });
    }
}
