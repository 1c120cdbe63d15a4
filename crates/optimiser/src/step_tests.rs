//! Single steps: each does what it says it gains, and keeps every post once.

use terrain::{Dem, Effort, HeightFit, Importance, PostRect, SeamSides};

use crate::account::Account;
use crate::exchange::{Exchange, Terms, Tools};
use crate::flips::flip_all;
use crate::hold::Hold;
use crate::insertion::Insertion;
use crate::parts::{Layout, NONE, Parts};
use crate::place::{PER_POST, Place};
use crate::removal::Removal;
use crate::scene::{Caps, confined, even, grid, patchy, rough, spent};
use crate::sweep::{Mover, Steps};
use crate::task::Budget;
use crate::thin::{Shears, Until, is_dearer, thin};
use crate::tile_mesh::TileMesh;
use crate::weighted_heights::WeightedHeights;

const RECT: PostRect = PostRect { south: 7, west: -3, north: 67, east: 77 };
const STEPS: Steps = Steps { inner: 1, pattern: false };

fn sheet_of<'a>(ground: &'a WeightedHeights<'a>, tin: &terrain::Tin, layout: &Layout) -> TileMesh<'a> {
    TileMesh::new(ground, Parts::of(ground, tin, layout), layout.line_step, false)
}

/// Runs a test on rough ground under a grid of lines every 20 posts, with even and with patchy weights.
fn with_sheet(test: impl Fn(&mut TileMesh, &Dem)) {
    for seed in [1, 2, 3] {
        let dem = rough(RECT, seed);
        for importance in [even(RECT), patchy(RECT, seed)] {
            let ground = WeightedHeights::new(&dem, &importance, SeamSides::CLOSED, HeightFit::Squares);
            let hold = |_: Place| Hold::FREE;
            let layout = Layout { line_step: Some(20 * PER_POST), hold: &hold };
            let mut sheet = sheet_of(&ground, &grid(&dem, 4), &layout);
            test(&mut sheet, &dem);
            assert_eq!(sheet.fault(), None);
        }
    }
}

/// Posts that all triangles own together, by the rows of each, and by the sums of each.
fn owned(sheet: &TileMesh) -> (Vec<u32>, f64) {
    let mut owners = vec![0; RECT.post_count()];
    let mut count = 0.0;
    for record in sheet.triangles.iter().filter(|record| record.corners[0] != NONE) {
        let places = sheet.places(record.corners);
        sheet.ground.visit_owned(places, |row, col| owners[row as usize * RECT.posts_wide() + col as usize] += 1);
        count += sheet.ground.moments.triangle(places).weight();
    }
    (owners, count)
}

#[test]
fn every_post_is_owned_once_after_every_kind_of_change() {
    let dem = rough(RECT, 9);
    let importance = even(RECT);
    let ground = WeightedHeights::new(&dem, &importance, SeamSides::OPEN, HeightFit::Squares);
    let hold = |_: Place| Hold::FREE;
    let mut sheet = sheet_of(&ground, &grid(&dem, 4), &Layout { line_step: None, hold: &hold });
    let check = |sheet: &TileMesh, step: &str| {
        let (owners, count) = owned(sheet);
        assert!(owners.iter().all(|&owners| owners == 1), "{step}");
        assert_eq!(count, RECT.post_count() as f64, "{step}");
    };
    check(&sheet, "start");
    flip_all(&mut sheet);
    check(&sheet, "flips");
    let mut mover = Mover::new(STEPS);
    mover.sweep_and_flip(&mut sheet, 2);
    check(&sheet, "moves");
    let mut account = Account::new(&Budget::Triangles(200), &sheet);
    let (mut removal, mut insertion) = (Removal::default(), Insertion::default());
    let shears = Shears { removal: &mut removal, mover: &mut mover, largest: None };
    thin(&mut sheet, &mut account, Until::Afforded, shears);
    check(&sheet, "removals");
    sheet.renumber();
    check(&sheet, "another order");
    // A little room, so that something comes in even where thinning left nothing to gain.
    let mut account = Account::new(&Budget::Triangles(220), &sheet);
    let mut tools = Tools { removal: &mut removal, insertion: &mut insertion };
    assert!(0 < Exchange::default().round(&mut sheet, &mut account, Terms::OneForOne, 50, &mut tools));
    check(&sheet, "exchange");
}

#[test]
fn whoever_comes_where_a_limit_is_met_takes_somebodys_place() {
    const SIDE: i32 = 20;
    const NO_LIMIT: u32 = 10_000;
    let rect = PostRect { south: 0, west: 0, north: 40, east: 40 };
    let dem = rough(rect, 6);
    let importance = even(rect);
    let start = grid(&dem, 4);
    // All four load modules have the same, so that either all of them are full or the one window is.
    let no_limit = Caps { side: SIDE, per_module: NO_LIMIT, per_window: NO_LIMIT, triangles: NO_LIMIT };
    let full = spent(&start, &confined(&start, no_limit, Effort::Normal), SIDE)[0];
    for (per_module, per_window) in [(full, NO_LIMIT), (NO_LIMIT, 4 * full)] {
        let caps = Caps { per_module, per_window, ..no_limit };
        let task = confined(&start, caps, Effort::Normal);
        let ground = WeightedHeights::new(&dem, &importance, SeamSides::CLOSED, HeightFit::Squares);
        let held: Vec<Place> = task.held.iter().map(|&at| Place::of(at, rect, 8)).collect();
        let hold = |at: Place| match held.contains(&at) {
            true => Hold::GIVEN,
            false => Hold::FREE,
        };
        let layout = Layout { line_step: Some(SIDE * PER_POST), hold: &hold };
        let mut sheet = sheet_of(&ground, &start, &layout);
        let mut account = Account::new(&task.budget, &sheet);
        let before = sheet.squares();
        let (mut removal, mut insertion) = (Removal::default(), Insertion::default());
        let mut tools = Tools { removal: &mut removal, insertion: &mut insertion };
        let count = Exchange::default().round(&mut sheet, &mut account, Terms::OneForOne, 20, &mut tools);
        assert!(0 < count && sheet.squares() < before, "{count} came");
        assert_eq!(sheet.fault(), None);
        sheet.round_heights();
        let after = spent(&sheet.into_tin(rect, 8), &task, SIDE);
        assert!(after.iter().all(|&after| after <= per_module), "{after:?}");
        assert!(after.iter().sum::<u32>() <= per_window, "{after:?}");
    }
}

#[test]
fn flips_and_sweeps_never_raise_the_squares() {
    with_sheet(|sheet, _| {
        let mut mover = Mover::new(STEPS);
        let mut before = sheet.squares();
        for _ in 0..3 {
            sheet.stir_all();
            flip_all(sheet);
            let flipped = sheet.squares();
            assert!(flipped <= before);
            let gain = mover.sweep(sheet, false);
            before = sheet.squares();
            assert!(0.0 <= gain && (flipped - before - gain).abs() <= 1e-6 * flipped, "{gain} told");
        }
    });
}

#[test]
fn what_a_removal_costs_and_an_insertion_gains_is_told_before() {
    with_sheet(|sheet, _| {
        let mut removal = Removal::default();
        for vertex in (0..sheet.vertices.len() as u32).step_by(7) {
            let before = sheet.squares();
            let Some(cost) = removal.find(sheet, vertex) else { continue };
            sheet.apply(&mut removal.patch);
            sheet.drop_vertex(vertex);
            assert!((sheet.squares() - before - cost).abs() <= 1e-6 * before, "vertex {vertex}: {cost}");
        }
        let mut insertion = Insertion::default();
        for triangle in (0..sheet.triangles.len() as u32).step_by(5) {
            if !sheet.is_live(triangle) {
                continue;
            }
            let before = sheet.squares();
            let Some(found) = insertion.find(sheet, triangle) else { continue };
            sheet.apply(&mut insertion.patch);
            assert!((before - sheet.squares() - found.gain).abs() <= 1e-6 * before, "{found:?}");
        }
        let (owners, _) = owned(sheet);
        assert!(owners.iter().all(|&owners| owners == 1));
    });
}

#[test]
fn squares_are_those_of_the_posts() {
    with_sheet(|sheet, dem| {
        Mover::new(STEPS).sweep_and_flip(sheet, 1);
        let live = sheet.triangles.iter().filter(|record| record.corners[0] != NONE);
        for record in live {
            let (places, heights) = (sheet.places(record.corners), sheet.heights(record.corners));
            let mut sum = 0.0;
            sheet.ground.visit_owned(places, |row, col| {
                let at = crate::place::Place::new(col * PER_POST, row * PER_POST);
                let post = sheet.ground.post_at(at);
                let residual = f64::from(dem.height(post)) - sheet.ground.plane_height(places, heights, at);
                sum += sheet.ground.moments.weight_at(row, col) * residual * residual;
            });
            assert!((sum - record.squares).abs() <= 1e-6 * (1.0 + sum), "{sum} {}", record.squares);
        }
    });
}

#[test]
fn a_cost_below_zero_is_not_put_back_for_ever() {
    assert!(!is_dearer(-100.0, -100.0) && !is_dearer(-99.0, -100.0));
    assert!(is_dearer(-90.0, -100.0) && is_dearer(3.0, 2.0));
}

#[test]
fn a_triangle_without_posts_is_exactly_nothing() {
    let dem = rough(RECT, 4);
    let importance: Importance = patchy(RECT, 4);
    let ground = WeightedHeights::new(&dem, &importance, SeamSides::OPEN, HeightFit::Squares);
    let place = crate::place::Place::new;
    let thin = [place(1000, 1010), place(3400, 1012), place(1001, 1020)];
    assert_eq!(ground.moments.triangle(thin), crate::moments::Sums::default());
}
