//! Single steps: each does what it says it gains, and keeps every post once.

use terrain::{Dem, HeightFit, Importance, PostRect, SeamSides};

use crate::optimiser::account::Account;
use crate::optimiser::deep_flips::deep_flips;
use crate::optimiser::deep_thinning::thin_deep;
use crate::optimiser::descent::descend;
use crate::optimiser::flips::{Scale, flip_all, flip_all_by};
use crate::optimiser::gains::Gains;
use crate::optimiser::heights::fit_heights;
use crate::optimiser::hold::Hold;
use crate::optimiser::insertion::Insertion;
use crate::optimiser::parts::{Layout, NONE, Parts};
use crate::optimiser::patch::Patch;
use crate::optimiser::place::{PER_POST, Place, is_needle};
use crate::optimiser::removal::Removal;
use crate::optimiser::scene::{even, grid, patchy, rough};
use crate::optimiser::sweep::Mover;
use crate::optimiser::task::Budget;
use crate::optimiser::thin::{Filling, Thinning, Until, is_dearer};
use crate::optimiser::tile_mesh::{Star, TileMesh};
use crate::optimiser::undo::Saved;
use crate::optimiser::weighted_heights::WeightedHeights;

const RECT: PostRect = PostRect { south: 7, west: -3, north: 67, east: 77 };

fn sheet_of<'a>(ground: &'a WeightedHeights<'a>, tin: &terrain::Tin, layout: &Layout) -> TileMesh<'a> {
    TileMesh::new(ground, Parts::of(ground, tin, layout), layout.line_step, false)
}

/// Runs a test on rough ground under a grid of lines every 20 posts, with even and with patchy weights.
fn with_sheet(mut test: impl FnMut(&mut TileMesh, &Dem)) {
    for seed in [1, 2, 3] {
        let dem = rough(RECT, seed);
        for importance in [even(RECT), patchy(RECT, seed)] {
            let ground = WeightedHeights::new(&dem, (&importance, &importance), SeamSides::CLOSED, HeightFit::Squares);
            let hold = |_: Place| Hold::FREE;
            let layout = Layout { line_step: Some(20 * PER_POST), hold: &hold };
            let mut sheet = sheet_of(&ground, &grid(&dem, 4), &layout);
            test(&mut sheet, &dem);
            assert_eq!(sheet.fault(), None);
        }
    }
}

fn sweep_all(mover: &mut Mover, sheet: &mut TileMesh) {
    sheet.mark_all_changed();
    mover.sweep(sheet);
    flip_all(sheet);
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
    let ground = WeightedHeights::new(&dem, (&importance, &importance), SeamSides::OPEN, HeightFit::Squares);
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
    let mut mover = Mover::new(1);
    sweep_all(&mut mover, &mut sheet);
    check(&sheet, "moves");
    let (mut removal, mut insertion) = (Removal::default(), Insertion::default());
    for (triangles, filling) in [(400, Filling::AsItIs), (300, Filling::Fitted)] {
        let mut account = Account::new(&Budget::Triangles(triangles), &sheet);
        Thinning::by(filling).run(&mut sheet, &mut account, Until::Afforded, (&mut removal, &mut mover));
        check(&sheet, "removals");
    }
    let mut account = Account::new(&Budget::Triangles(200), &sheet);
    thin_deep(&mut sheet, &mut account, 0.4, &mut removal, &mut mover);
    check(&sheet, "removals by true costs");
    assert!(sheet.triangle_count <= 200);
    deep_flips(&mut sheet, &mut mover, 3);
    check(&sheet, "deep flips");
    descend(&mut sheet, 4, 1);
    check(&sheet, "a descent");
    sheet.renumber();
    check(&sheet, "another order");
    // A little room, so that something comes in even where thinning left nothing to gain.
    let mut account = Account::new(&Budget::Triangles(220), &sheet);
    insertion.tries_middles = true;
    assert!(0 < Gains::default().insert(&mut sheet, &mut account, 50, &mut insertion));
    check(&sheet, "insertions");
}

#[test]
fn flips_and_sweeps_never_raise_the_squares() {
    with_sheet(|sheet, _| {
        let mut mover = Mover::new(1);
        let mut before = sheet.squares();
        for _ in 0..3 {
            sheet.mark_all_changed();
            flip_all(sheet);
            let flipped = sheet.squares();
            assert!(flipped <= before);
            sheet.mark_all_changed();
            mover.sweep(sheet);
            before = sheet.squares();
            assert!(before <= flipped);
        }
    });
}

#[test]
fn flips_leave_fewer_needles_where_needles_count() {
    let needles = |sheet: &TileMesh| {
        let corners = sheet.triangles.iter().map(|record| record.corners).filter(|corners| corners[0] != NONE);
        corners.map(|corners| sheet.places(corners)).filter(|&[a, b, c]| is_needle(a, b, c)).count()
    };
    let left = |part: f64| {
        let mut left = 0;
        with_sheet(|sheet, _| {
            // Vertices that wander towards crests leave needles.
            sheet.mark_all_changed();
            Mover::new(1).sweep(sheet);
            let mut scale = Scale::of(sheet);
            scale.needle *= part;
            let count = |sheet: &TileMesh| sheet.squares() + scale.needle * needles(sheet) as f64;
            let before = count(sheet);
            sheet.mark_all_changed();
            flip_all_by(sheet, &scale);
            assert!(count(sheet) < before);
            left += needles(sheet);
        });
        left
    };
    let [counted, free] = [1.0, 0.0].map(left);
    assert!(counted < free, "{counted} needles where they count, {free} where not");
}

#[test]
fn thinning_in_several_goes_is_thinning_in_one() {
    let thinned = |goes: &[f64]| {
        let mut meshes = Vec::new();
        with_sheet(|sheet, _| {
            let mut account = Account::new(&Budget::Triangles(300), sheet);
            let (mut removal, mut mover) = (Removal::default(), Mover::new(1));
            let mut thinning = Thinning::by(Filling::AsItIs);
            for &beyond in goes {
                account.allow_beyond(beyond);
                thinning.run(sheet, &mut account, Until::Afforded, (&mut removal, &mut mover));
            }
            meshes.push(format!("{:?}", sheet.triangles));
        });
        meshes
    };
    assert!(thinned(&[0.5, 0.2, 0.0]) == thinned(&[0.0]));
}

#[test]
fn every_instruction_level_gives_the_same_mesh() {
    let mut meshes = Vec::new();
    for (name, level) in terrain::geometry::levels_available() {
        let dem = rough(RECT, 11);
        let importance = patchy(RECT, 11);
        let ground = WeightedHeights::new(&dem, (&importance, &importance), SeamSides::OPEN, HeightFit::Squares);
        let hold = |_: Place| Hold::FREE;
        let mut sheet = sheet_of(&ground, &grid(&dem, 4), &Layout { line_step: None, hold: &hold });
        let (mut mover, mut removal) = (Mover::at(level, 1), Removal::at(level));
        sweep_all(&mut mover, &mut sheet);
        let mut account = Account::new(&Budget::Triangles(200), &sheet);
        thin_deep(&mut sheet, &mut account, 0.4, &mut removal, &mut mover);
        sheet.renumber();
        assert_eq!(sheet.fault(), None);
        deep_flips(&mut sheet, &mut mover, 3);
        meshes.push((name, format!("{:?} {:?}", sheet.vertices, sheet.triangles)));
    }
    for pair in meshes.windows(2) {
        assert!(pair[0].1 == pair[1].1, "{} and {}", pair[0].0, pair[1].0);
    }
}

#[test]
fn deep_flips_gain_where_plain_ones_do_not() {
    with_sheet(|sheet, _| {
        let mut mover = Mover::new(1);
        (0..8).for_each(|_| sweep_all(&mut mover, sheet));
        let before = sheet.squares();
        sheet.mark_all_changed();
        deep_flips(sheet, &mut mover, 3);
        assert!(sheet.squares() < 0.99 * before, "{} of {before}", sheet.squares());
    });
}

#[test]
fn a_descent_lowers_the_squares_and_leaves_lines_where_they_are() {
    with_sheet(|sheet, _| {
        let on_lines = |sheet: &TileMesh| {
            let held = sheet.vertices.iter().filter(|vertex| vertex.hold.is_on_line());
            held.map(|vertex| vertex.at).collect::<Vec<Place>>()
        };
        let (before, lines) = (sheet.squares(), on_lines(sheet));
        descend(sheet, 10, 8);
        assert!(sheet.squares() < 0.7 * before, "{} of {before}", sheet.squares());
        assert_eq!(on_lines(sheet), lines);
        assert!(sheet.vertices.iter().all(|vertex| vertex.at.x % 8 == 0 && vertex.at.y % 8 == 0));
        let told = sheet.squares();
        sheet.sum_again();
        assert_eq!(told, sheet.squares());
    });
}

#[test]
fn heights_fitted_at_once_leave_no_single_one_to_fit() {
    with_sheet(|sheet, _| {
        // Each time damping has less left to hold on to, and fewer heights reach their bounds while others are fitted.
        for _ in 0..8 {
            fit_heights(sheet, 200);
        }
        let fitted = sheet.squares();
        let mut star = Star::default();
        for vertex in (0..sheet.vertices.len() as u32).step_by(11) {
            for by in [-8.0, 8.0] {
                let record = &sheet.vertices[vertex as usize];
                if sheet.ground.bounded(record.at, record.height + by) != record.height + by {
                    continue;
                }
                sheet.vertices[vertex as usize].height += by;
                sheet.star(vertex, &mut star);
                star.triangles().for_each(|triangle| sheet.settle(triangle));
                assert!(fitted <= sheet.squares() + 1e-6 * fitted);
                sheet.vertices[vertex as usize].height -= by;
                star.triangles().for_each(|triangle| sheet.settle(triangle));
            }
        }
    });
}

#[test]
fn a_height_that_rises_to_its_bound_stands_there_exactly() {
    with_sheet(|sheet, _| {
        let mut patch = Patch::default();
        for vertex in (0..sheet.vertices.len() as u32).filter(|&vertex| sheet.is_vertex(vertex)).collect::<Vec<_>>() {
            let at = sheet.vertices[vertex as usize].at;
            for (part, far) in [(7.0, 1e9), (11.0, -1e9)] {
                let bound = sheet.ground.bounded(at, far);
                let height = sheet.ground.bounded(at, bound / part);
                sheet.vertices[vertex as usize].height = height;
                patch.clear();
                patch.refit.push(vertex);
                patch.rise.push(bound - height);
                sheet.apply(&mut patch);
                assert_eq!(sheet.vertices[vertex as usize].height, bound);
            }
        }
    });
}

#[test]
fn what_is_undone_is_as_it_was() {
    with_sheet(|sheet, _| {
        let (mut removal, mut mover, mut saved) = (Removal::default(), Mover::new(1), Saved::default());
        for vertex in (0..sheet.vertices.len() as u32).step_by(7) {
            if removal.find(sheet, vertex).is_none() {
                continue;
            }
            let text = |sheet: &TileMesh| {
                format!("{:?} {:?} {:?} {:?}", sheet.vertices, sheet.triangles, sheet.forms, sheet.free_triangles)
            };
            let (before, squares) = (text(sheet), sheet.squares());
            saved.save(sheet, removal.star.ring.iter().copied().chain([vertex]));
            sheet.apply(&mut removal.patch);
            removal.star.ring.iter().for_each(|&other| {
                mover.relax(sheet, other);
            });
            assert!((saved.rise(sheet) - (sheet.squares() - squares)).abs() <= 1e-6 * squares);
            saved.restore(sheet);
            assert_eq!(text(sheet), before);
            assert_eq!(sheet.fault(), None);
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
        sweep_all(&mut Mover::new(1), sheet);
        let live = sheet.triangles.iter().filter(|record| record.corners[0] != NONE);
        for record in live {
            let (places, heights) = (sheet.places(record.corners), sheet.heights(record.corners));
            let mut sum = 0.0;
            sheet.ground.visit_owned(places, |row, col| {
                let at = crate::optimiser::place::Place::new(col * PER_POST, row * PER_POST);
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
    let ground = WeightedHeights::new(&dem, (&importance, &importance), SeamSides::OPEN, HeightFit::Squares);
    let place = crate::optimiser::place::Place::new;
    let thin = [place(1000, 1010), place(3400, 1012), place(1001, 1020)];
    assert_eq!(ground.moments.triangle(thin), crate::optimiser::moments::Sums::default());
}
