//! Tests of what is asked of ground with decks above it, against slow and obvious answers.

use std::sync::Arc;

use fastrand::Rng;

use super::{SIDE, rough};
use crate::{Area, Block, Decks, Keep, LoadedGround, Module, Sample, Sight, TerrainModule, TileFile, Vertex, sample};

const BLOCK: Block = Block { south: 2, west: 3, north: 3, east: 5 };
/// South-west corner of load module 2,3.
const CORNER: [f64; 2] = [501_500.0, 3_876_000.25];

fn sample_ground() -> LoadedGround {
    let file = TileFile::of_bytes("sample", Arc::new(sample::with_decks())).unwrap();
    Area::of_files(vec![file]).unwrap().load(BLOCK).unwrap()
}

/// A place in quanta from the corner of load module 2,3.
fn at(x: f64, y: f64) -> [f64; 2] {
    [CORNER[0] + x / 128.0, CORNER[1] + y / 128.0]
}

#[test]
fn a_tank_drives_over_the_bridge_and_another_under_it() {
    let ground = sample_ground();
    // Along the bridge, over the line between the load modules; the upper bridge crosses at 74,000 to 76,000.
    let mut over = 10.0;
    for x in (54_000..=124_000).step_by(500).map(f64::from) {
        let place = at(x, 22_000.0);
        let expected = 10.0 + (x - 64_000.0).max(0.0) / 6000.0;
        over = ground.height_below_m(place, over + 1.5).unwrap();
        assert!((over - expected).abs() < 1e-6, "{over} at {x}, expected {expected}");
        let on_ground = ground.height_m(place).unwrap();
        assert_eq!(ground.height_below_m(place, on_ground + 1.5), Some(on_ground), "under the bridge at {x}");
        let top = if (74_000.0..=76_000.0).contains(&x) { 40.0 } else { over };
        assert_eq!(ground.height_below_m(place, f64::INFINITY), Some(top), "on top at {x}");
    }
    // Beside the bridge there is the ground alone.
    let beside = at(60_000.0, 24_001.0);
    assert_eq!(ground.height_below_m(beside, f64::INFINITY), ground.height_m(beside));
}

#[test]
fn a_ceiling_is_inclusive_and_below_all_there_is_nothing() {
    let ground = sample_ground();
    let place = at(60_000.0, 22_000.0);
    assert_eq!(ground.height_below_m(place, 10.0), Some(10.0));
    assert_eq!(ground.height_below_m(place, 9.999), Some(5.0));
    assert_eq!(ground.height_below_m(place, 5.0), Some(5.0));
    for nothing in [4.999, f64::NEG_INFINITY, f64::NAN] {
        assert_eq!(ground.height_below_m(place, nothing), None, "{nothing}");
        assert_eq!(ground.sample_below(place, nothing), None, "{nothing}");
    }
    assert_eq!(ground.height_below_m([CORNER[0] - 0.01, CORNER[1]], f64::INFINITY), None);
    assert_eq!(ground.sample_below([f64::NAN; 2], f64::INFINITY), None);
}

#[test]
fn a_deck_has_its_own_class_and_normal() {
    let ground = sample_ground();
    let place = at(94_000.0, 22_000.0);
    let Sample { height_m, normal, class, is_deck } = ground.sample_below(place, 100.0).unwrap();
    assert!((height_m - 15.0).abs() < 1e-9 && class == 7 && is_deck);
    // It rises by 1280 quanta in 60,000.
    let slope = 1280.0 / 60_000.0f64;
    assert!((normal[0] + slope / slope.hypot(1.0)).abs() < 1e-12 && normal[1] == 0.0, "{normal:?}");
    assert_eq!(ground.sample_below(at(75_000.0, 22_000.0), 100.0).unwrap().class, 8);
    let under = ground.sample_below(place, 6.0).unwrap();
    assert_eq!((Some(under), under.is_deck), (ground.sample(place), false));
}

#[test]
fn a_line_of_sight_passes_over_and_under_decks_and_ends_in_them() {
    let ground = sample_ground();
    let place = |x: f64, y: f64, up: f64| [at(x, y)[0], at(x, y)[1], up];
    // Along the bridge, across the line between the load modules.
    let sight = |a: f64, b: f64| ground.sight(place(55_000.0, 22_000.0, a), place(73_000.0, 22_000.0, b));
    assert_eq!(sight(11.0, 12.0), Sight::Free);
    assert_eq!(sight(9.0, 9.0), Sight::Free);
    assert!(matches!(sight(11.0, 9.0), Sight::Hidden(_)) && matches!(sight(9.0, 13.0), Sight::Hidden(_)));
    // From one side to the other, in the middle of it.
    let across = |a: f64, b: f64| ground.sight(place(60_000.0, 18_000.0, a), place(60_000.0, 26_000.0, b));
    assert_eq!((across(12.0, 10.5), across(9.0, 9.5)), (Sight::Free, Sight::Free));
    let Sight::Hidden(share) = across(12.0, 8.0) else { panic!("the deck hides") };
    assert!((share - 0.5).abs() < 1e-6, "{share}");
    // What stands on the deck is seen from above and not from below; straight up and down, too.
    let on_deck =
        |east: f64, up: f64| ground.sight(place(60_000.0 + east, 22_000.0, up), place(60_000.0, 22_000.0, 10.0));
    assert_eq!((on_deck(1000.0, 12.0), on_deck(0.0, 12.0)), (Sight::Free, Sight::Free));
    assert!(matches!((on_deck(1000.0, 6.0), on_deck(0.0, 6.0)), (Sight::Hidden(_), Sight::Hidden(_))));
    assert_eq!(ground.sight(place(60_000.0, 22_000.0, 5.5), place(60_000.0, 22_000.0, 9.0)), Sight::Free);
}

#[test]
fn areas_mix_files_with_and_without_decks_and_follow_the_observer() {
    let file = TileFile::of_bytes("decks", Arc::new(sample::with_decks())).unwrap();
    let area = Area::of_files(vec![file]).unwrap();
    let west = area.load(Block { east: 4, ..BLOCK }).unwrap();
    let both = west.moved(&area, BLOCK).unwrap();
    let place = at(94_000.0, 22_000.0);
    assert_eq!((west.height_below_m(place, 99.0), both.height_below_m(place, 99.0)), (None, Some(15.0)));
    // Plain ones of the same place: without decks the topmost is the ground.
    let plain = Area::of_files(vec![TileFile::of_bytes("plain", Arc::new(sample::file())).unwrap()]).unwrap();
    let plain = plain.load(BLOCK).unwrap();
    assert_eq!(plain.height_below_m(place, 99.0), plain.height_m(place));
    assert_eq!(both.height_m(place), plain.height_m(place));
    assert_eq!(both.sample(place), plain.sample(place));
}

#[test]
fn every_damage_of_a_file_with_decks_is_found_when_it_is_paged() {
    let folder = std::env::temp_dir().join(format!("load-module-reader-decks-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let (path, bytes) = (folder.join("r00c01.slm"), sample::with_decks());
    let open = |bytes: &[u8]| {
        std::fs::write(&path, bytes).unwrap();
        Area::open(&folder, Keep::OnDisk).and_then(|area| area.load(BLOCK))
    };
    assert_eq!(open(&bytes).unwrap().height_below_m(at(60_000.0, 22_000.0), 99.0), Some(10.0));
    for length in (0..bytes.len()).step_by(3) {
        assert!(open(&bytes[..length]).is_err(), "the first {length} bytes were accepted");
    }
    for at in 0..bytes.len() {
        let mut damaged = bytes.clone();
        damaged[at] ^= 0x10;
        assert!(open(&damaged).is_err(), "byte {at} was changed and accepted");
    }
    std::fs::remove_dir_all(folder).unwrap();
}

/// Triangles anywhere above a rough load module, some of them above others.
fn with_random_decks(count: u16, seed: u64) -> Module {
    let mut draw = Rng::with_seed(seed);
    let mut decks = Decks::default();
    while decks.triangles.len() < usize::from(count) {
        let mut vertex = || {
            let [x, y] = [0, 1].map(|_| draw.u16(..=SIDE));
            Vertex { x, y, z: draw.i32(0..40_000) }
        };
        let [a, b, c] = [vertex(), vertex(), vertex()];
        let [ax, ay, bx, by, cx, cy] = [a.x, a.y, b.x, b.y, c.x, c.y].map(i64::from);
        let first = decks.vertices.len() as u16;
        if 0 < (bx - ax) * (cy - ay) - (by - ay) * (cx - ax) {
            decks.vertices.extend([a, b, c]);
            decks.triangles.push([first, first + 1, first + 2]);
            decks.classes.push(draw.u8(..9));
        }
    }
    Module { decks, ..rough(9, seed) }
}

fn corners(decks: &Decks, triangle: [u16; 3]) -> [[f64; 3]; 3] {
    triangle.map(|v| decks.vertices[usize::from(v)]).map(|v| [f64::from(v.x), f64::from(v.y), f64::from(v.z)])
}

fn left([ax, ay, _]: [f64; 3], [bx, by, _]: [f64; 3], [x, y]: [f64; 2]) -> f64 {
    (bx - ax) * (y - ay) - (by - ay) * (x - ax)
}

#[test]
fn heights_below_a_ceiling_equal_those_of_a_search_through_all_decks() {
    for (count, seed) in [(1, 1), (7, 2), (60, 3), (500, 4)] {
        let module = with_random_decks(count, seed);
        let prepared = Arc::new(TerrainModule::new(module.clone(), SIDE));
        let ground = sample_ground().with_modules(BLOCK, vec![Arc::clone(&prepared), prepared]);
        let mut draw = Rng::with_seed(seed);
        let mut asked = Vec::new();
        for _ in 0..500 {
            let place = [0, 1].map(|_| f64::from(draw.u16(..SIDE)));
            let ceiling_m = f64::from(draw.u16(..400));
            let held = module.decks.triangles.iter().filter_map(|&triangle| {
                let [a, b, c] = corners(&module.decks, triangle);
                let shares = [left(b, c, place), left(c, a, place), left(a, b, place)];
                let sum: f64 = shares.iter().sum();
                let height = shares[0] * a[2] + shares[1] * b[2] + shares[2] * c[2];
                shares.iter().all(|share| 0.0 <= *share).then_some(height / sum / 128.0)
            });
            let on_ground = ground.height_m(at(place[0], place[1]));
            let below = held.chain(on_ground).filter(|height_m| *height_m <= ceiling_m);
            let expected = below.fold(f64::NEG_INFINITY, f64::max);
            let found = ground.height_below_m(at(place[0], place[1]), ceiling_m);
            let sampled = ground.sample_below(at(place[0], place[1]), ceiling_m);
            assert_eq!(found, sampled.map(|sample| sample.height_m), "seed {seed} at {place:?}");
            let found = found.unwrap_or(f64::NEG_INFINITY);
            assert!(
                found == expected || (found - expected).abs() < 1e-6,
                "seed {seed} at {place:?}: {found}, {expected}"
            );
            asked.push([at(place[0], place[1])[0], at(place[0], place[1])[1], ceiling_m]);
        }
        let mut heights = vec![0.0; asked.len()];
        ground.heights_below_m(&asked, &mut heights);
        for (&[east, north, ceiling_m], height_m) in asked.iter().zip(heights) {
            let one = ground.height_below_m([east, north], ceiling_m);
            assert_eq!(one, (!height_m.is_nan()).then_some(height_m));
        }
    }
}

/// Where a line first goes through a triangle of the decks, each cut with its plane.
fn through(decks: &Decks, from: [f64; 3], to: [f64; 3]) -> f64 {
    let cut = |&triangle: &[u16; 3]| {
        let [a, b, c] = corners(decks, triangle);
        let over = |p: [f64; 3]| {
            let (u, v) = ([b[0] - a[0], b[1] - a[1], b[2] - a[2]], [c[0] - a[0], c[1] - a[1], c[2] - a[2]]);
            let w = [p[0] - a[0], p[1] - a[1], p[2] - a[2]];
            let normal = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
            normal[0] * w[0] + normal[1] * w[1] + normal[2] * w[2]
        };
        let (before, after) = (over(from), over(to));
        let share = before / (before - after);
        let place = [0, 1].map(|axis| from[axis] + share * (to[axis] - from[axis]));
        let inside = [left(a, b, place), left(b, c, place), left(c, a, place)].iter().all(|left| 0.0 <= *left);
        ((before < 0.0) != (after < 0.0) && inside).then_some(share)
    };
    decks.triangles.iter().filter_map(cut).fold(f64::INFINITY, f64::min)
}

#[test]
fn lines_of_sight_end_where_they_go_through_a_deck() {
    let module = with_random_decks(12, 5);
    let bare = Module { decks: Decks::default(), ..module.clone() };
    let ground = |module: Module| {
        let prepared = Arc::new(TerrainModule::new(module, SIDE));
        sample_ground().with_modules(BLOCK, vec![Arc::clone(&prepared), prepared])
    };
    let (bridged, bare) = (ground(module.clone()), ground(bare));
    let mut draw = Rng::with_seed(17);
    let (mut through_decks, mut free) = (0, 0);
    for _ in 0..2000 {
        let mut end = || [0, 1, 2].map(|axis| f64::from(draw.u16(..if axis < 2 { 64_000 } else { 40_000 })));
        let (from, to) = (end(), end());
        let world = |p: [f64; 3]| [at(p[0], p[1])[0], at(p[0], p[1])[1], p[2] / 128.0];
        let of_ground = match bare.sight(world(from), world(to)) {
            Sight::Hidden(share) => share,
            _ => f64::INFINITY,
        };
        let of_decks = through(&module.decks, from, to);
        match bridged.sight(world(from), world(to)) {
            Sight::Hidden(share) => {
                through_decks += i32::from(of_decks < of_ground);
                assert!(
                    (share - of_ground.min(of_decks)).abs() < 1e-4,
                    "{from:?} {to:?}: {share} {of_ground} {of_decks}"
                );
            }
            found => {
                free += 1;
                assert!(
                    found == Sight::Free && of_ground.min(of_decks) == f64::INFINITY,
                    "{from:?} {to:?}: {of_decks}"
                );
            }
        }
    }
    assert!(100 < through_decks && 100 < free, "{through_decks} through decks, {free} free");
}

#[test]
fn no_line_slips_through_where_triangles_of_a_deck_meet() {
    // A deck of 8 x 8 squares, level but for its rounding of z, high above level ground.
    let (n, step) = (8u16, 8000);
    let mut decks = Decks::default();
    for (row, col) in (0..=n).flat_map(|row| (0..=n).map(move |col| (row, col))) {
        decks.vertices.push(Vertex { x: col * step, y: row * step, z: 60_000 + i32::from((row * 7 + col * 5) % 11) });
    }
    for (row, col) in (0..n).flat_map(|row| (0..n).map(move |col| (row, col))) {
        let [a, b, c, d] = [(0, 0), (0, 1), (1, 1), (1, 0)].map(|(up, right)| (row + up) * (n + 1) + col + right);
        decks.triangles.extend([[a, b, c], [a, c, d]]);
    }
    decks.classes = vec![1; decks.triangles.len()];
    let module = Module { decks, ..rough(1, 1) };
    let prepared = Arc::new(TerrainModule::new(module, SIDE));
    let ground = sample_ground().with_modules(BLOCK, vec![Arc::clone(&prepared), prepared]);
    let mut draw = Rng::with_seed(23);
    for _ in 0..3000 {
        // Places on vertices and edges, so that lines run along edges and through vertices.
        let mut place = || [0, 1].map(|_| f64::from(4000 * (1 + draw.u32(..14))));
        let (a, b) = (place(), place());
        let world = |[x, y]: [f64; 2], up: f64| [at(x, y)[0], at(x, y)[1], up];
        let (over, under) = (world(a, 470.0 + f64::from(draw.u8(..9))), world(b, 460.0 - f64::from(draw.u8(..90))));
        assert!(matches!(ground.sight(over, under), Sight::Hidden(share) if 0.0 < share), "{a:?} {b:?}");
        assert!(matches!(ground.sight(under, over), Sight::Hidden(share) if 0.0 < share), "{b:?} {a:?}");
        assert_eq!(ground.sight(over, world(b, 470.0)), Sight::Free);
        assert_eq!(ground.sight(under, world(a, 468.0)), Sight::Free);
        // What stands on the deck is seen from above, not from below.
        let on_deck = ground.height_below_m(world(b, 0.0)[..2].try_into().unwrap(), 1e3).unwrap();
        assert_eq!(ground.sight(over, world(b, on_deck)), Sight::Free, "{a:?} {b:?}");
        assert!(matches!(ground.sight(world(a, 400.0), world(b, on_deck)), Sight::Hidden(_)), "{a:?} {b:?}");
    }
}
