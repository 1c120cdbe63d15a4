//! Tests of what stands on the ground: its bytes, and lines of sight past it against small steps.

use std::sync::Arc;

use fastrand::Rng;

use super::{SIDE, by_search, rough, sample_ground};
use crate::past::holds;
use crate::{
    Canopy, Corner, Curvature, Hider, LoadedGround, Module, ObjectKind, Objects, PastObjects, Prism, ReadError, Sight,
    Standing, TerrainModule,
};

const CORNER: [f64; 2] = [501_500.0, 3_876_000.25];

fn ring(places: &[[u16; 2]]) -> Vec<Corner> {
    places.iter().map(|&[x, y]| Corner { x, y, has_wall: true }).collect()
}

/// Blocks of four walls and woods of two triangles, here and there, some over each other.
fn scattered(seed: u64, module: &Module) -> Objects {
    let mut draw = Rng::with_seed(seed);
    let mut objects = Objects::default();
    for id in 0..40 {
        let [x, y] = [0, 1].map(|_| draw.u16(..SIDE - 6_000));
        let [wide, high] = [0, 1].map(|_| draw.u16(1_000..6_000));
        let low = by_search(module, [f64::from(x), f64::from(y)]) * 128.0;
        let base = low as i32 - if id % 5 == 0 { -1_000 } else { 9_000 };
        let roof = low as i32 + draw.i32(2_000..9_000);
        let rings = vec![ring(&[[x, y], [x + wide, y + 70], [x + wide, y + high], [x, y + high]])];
        objects.prisms.push(Prism { id, kind: ObjectKind::Building, base, roof, rings });
    }
    let court = [[20_000, 20_000], [20_000, 30_000], [30_000, 30_000], [30_000, 20_000]];
    objects.prisms.push(Prism {
        id: 90,
        kind: ObjectKind::Tower,
        base: -90_000,
        roof: 12_000,
        rings: vec![ring(&[[10_000, 10_000], [40_000, 10_000], [40_000, 40_000], [10_000, 40_000]]), ring(&court)],
    });
    for id in 0..12 {
        let [x, y] = [0, 1].map(|_| draw.u16(..SIDE - 9_000));
        let places = vec![[x, y], [x + 9_000, y + 800], [x + 8_000, y + 9_000], [x + 100, y + 7_000]];
        let kind = if id % 3 == 0 { ObjectKind::Row } else { ObjectKind::Wood };
        let triangles = vec![[0, 1, 2], [0, 2, 3]];
        objects.canopies.push(Canopy { id, kind, height: 1_900, fullness: 20, spacing: 512, places, triangles });
    }
    objects
}

fn ground_with(objects: Objects) -> (LoadedGround, Module) {
    let module = Module { objects, ..rough(9, 7) };
    let ground = sample_ground();
    let block = ground.block();
    let prepared = Arc::new(TerrainModule::new(module.clone(), SIDE));
    (ground.with_modules(block, vec![Arc::clone(&prepared), prepared]), module)
}

fn parse(bytes: &[u8]) -> Result<Objects, ReadError> {
    Objects::of_part(bytes, SIDE)
}

#[test]
fn objects_survive_their_bytes_and_no_flipped_byte_is_a_panic() {
    let all = scattered(3, &rough(9, 7));
    let bytes = all.to_part();
    assert_eq!(parse(&bytes).unwrap(), all);
    assert_eq!(all.polygons(), 40 * 5 + 9 + 12 * 2);
    for length in 0..bytes.len() {
        assert!(parse(&bytes[..length]).is_err(), "cut at {length}");
    }
    let mut refused = 0;
    for at in 0..bytes.len() {
        for bit in 0..8 {
            let mut bad = bytes.clone();
            bad[at] ^= 1 << bit;
            // The checksum of the part finds them all; what is left here must be sound.
            match parse(&bad) {
                Ok(other) => assert_eq!(parse(&other.to_part()).unwrap(), other),
                Err(_) => refused += 1,
            }
        }
    }
    assert!(bytes.len() < refused, "{refused}");
}

#[test]
fn promises_that_are_broken_are_refused() {
    let all = scattered(3, &rough(9, 7));
    let mut upside_down = all.clone();
    upside_down.prisms[3].roof = upside_down.prisms[3].base;
    let mut clockwise = all.clone();
    clockwise.prisms[3].rings[0].reverse();
    let mut unsorted = all.clone();
    unsorted.prisms.swap(1, 2);
    let mut clear = all.clone();
    clear.canopies[2].fullness = 0;
    let mut folded = all.clone();
    folded.canopies[2].triangles[1] = [0, 3, 2];
    let mut twice = all.clone();
    twice.canopies[2] = twice.canopies[1].clone();
    let mut of_leaves = all.clone();
    of_leaves.prisms[0].kind = ObjectKind::Wood;
    let mut far = all;
    far.prisms[5].rings[0][1].x = SIDE + 1;
    for (bad, told) in [
        (upside_down, "roof"),
        (clockwise, "doubled area of a ring"),
        (unsorted, "order of prisms"),
        (clear, "fullness"),
        (folded, "doubled area of a canopy's triangle"),
        (twice, "order of canopies"),
        (of_leaves, "kind of an object"),
        (far, "x of an object"),
        (Objects::default(), "prism count"),
    ] {
        let error = parse(&bad.to_part()).unwrap_err().to_string();
        assert!(error.contains(told), "{error}, expected {told}");
    }
}

/// What a line through one load module meets, by small steps: where it is hidden first, by what, and metres in woods
/// before that; `None` where a step more or less would say something else.
fn by_steps(module: &Module, from: [f64; 3], to: [f64; 3]) -> (Option<(f64, Hider)>, f64) {
    const STEPS: usize = 4_000;
    let length_m = [0, 1, 2].map(|axis| to[axis] - from[axis]).iter().map(|run| run * run).sum::<f64>().sqrt();
    let mut wood_m = 0.0;
    for step in 0..=STEPS {
        let share = step as f64 / STEPS as f64;
        let [x, y, z] = [0, 1, 2].map(|axis| from[axis] + share * (to[axis] - from[axis]));
        let place = [x * 128.0, y * 128.0];
        let ground_m = by_search(module, place);
        if z < ground_m {
            return (Some((share, Hider::Ground)), wood_m);
        }
        let z = z * 128.0;
        let inside = |prism: &&Prism| f64::from(prism.base) <= z && z < f64::from(prism.roof) && holds(prism, place);
        if module.objects.prisms.iter().any(|prism| inside(&prism)) {
            return (Some((share, Hider::Building)), wood_m);
        }
        let over = |canopy: &&Canopy| {
            z < ground_m * 128.0 + f64::from(canopy.height)
                && canopy.triangles.iter().any(|triangle| {
                    let at = triangle.map(|index| canopy.places[usize::from(index)].map(f64::from));
                    (0..3).all(|i| {
                        let (a, b) = (at[i], at[(i + 1) % 3]);
                        0.0 <= (b[0] - a[0]) * (place[1] - a[1]) - (b[1] - a[1]) * (place[0] - a[0])
                    })
                })
        };
        wood_m += module.objects.canopies.iter().filter(over).count() as f64 * length_m / STEPS as f64;
    }
    (None, wood_m)
}

#[test]
fn lines_past_objects_agree_with_small_steps() {
    let (ground, module) = ground_with(scattered(5, &rough(9, 7)));
    let mut draw = Rng::with_seed(17);
    let mut counts = [0; 4];
    let past = PastObjects { least: 1e-9, ..PastObjects::all(Curvature::NONE) };
    for _ in 0..400 {
        let mut place = || {
            let [x, y] = [0, 1].map(|_| f64::from(draw.u32(1_000..499_000)) / 1000.0);
            [x, y, by_search(&module, [x * 128.0, y * 128.0]) + 40.0 * draw.f64()]
        };
        let (from, to) = (place(), place());
        let world = |[x, y, z]: [f64; 3]| [CORNER[0] + x, CORNER[1] + y, z];
        let found = ground.sight_past(world(from), world(to), &past);
        let (expected, wood_m) = by_steps(&module, from, to);
        let length_m = [0, 1, 2].map(|axis| to[axis] - from[axis]).iter().map(|run| run * run).sum::<f64>().sqrt();
        match (found.sight, expected) {
            (Sight::Hidden(at), Some((share, by))) => {
                // A corner may be grazed between two steps.
                assert!(at <= share + 1e-3, "{from:?} {to:?}: {found:?}, expected {expected:?}");
                counts[usize::from(by == Hider::Building)] += 1;
                if (share - at).abs() < 1e-3 {
                    assert_eq!(found.by, Some(by));
                    counts[3] += 1;
                    assert!((found.wood_m - wood_m).abs() < 2.0 + 0.01 * length_m, "{found:?} {wood_m} {length_m}");
                }
            }
            (Sight::Free, None) => {
                counts[2] += 1;
                assert!((found.wood_m - wood_m).abs() < 2.0 + 0.01 * length_m, "{found:?} {wood_m} {length_m}");
                let left = (0.8_f64).powf(found.wood_m / 10.0);
                assert!((found.transmission - left).abs() < 1e-9);
            }
            (Sight::Hidden(_), None) => {}
            _ => panic!("{from:?} {to:?}: {found:?}, expected {expected:?}"),
        }
    }
    assert!(20 < counts[0] && 60 < counts[1] && 40 < counts[2], "{counts:?}");
    assert!(counts[0] + counts[1] < counts[3] + counts[0] + 12, "{counts:?}");
}

#[test]
fn a_wood_hides_where_less_light_than_asked_is_left() {
    let (ground, module) = ground_with(Objects {
        prisms: Vec::new(),
        canopies: vec![Canopy {
            id: 1,
            kind: ObjectKind::Wood,
            height: u16::MAX,
            fullness: 50,
            spacing: 512,
            places: vec![[12_800, 0], [SIDE, 0], [SIDE, SIDE], [12_800, SIDE]],
            triangles: vec![[0, 1, 2], [0, 2, 3]],
        }],
    });
    let z = 170.0;
    let line = |past: &PastObjects, to: f64| {
        ground.sight_past([CORNER[0], CORNER[1] + 250.0, z], [CORNER[0] + to, CORNER[1] + 250.0, z], past)
    };
    let all = PastObjects::all(Curvature::NONE);
    assert!(module.vertices.iter().all(|vertex| f64::from(vertex.z) < z * 128.0));
    let seen = line(&all, 109.0);
    assert_eq!((seen.sight, seen.by), (Sight::Free, None));
    assert!((seen.wood_m - 9.0).abs() < 1e-6 && (seen.transmission - 0.5_f64.powf(0.9)).abs() < 1e-9, "{seen:?}");
    let hidden = line(&all, 200.0);
    let Sight::Hidden(at) = hidden.sight else { panic!("{hidden:?}") };
    assert_eq!(hidden.by, Some(Hider::Wood));
    assert!((at * 200.0 - 110.0).abs() < 1e-6 && (hidden.transmission - 0.5_f64.powi(10)).abs() < 1e-9, "{hidden:?}");
    let buildings = PastObjects { standing: Standing::Buildings, ..all };
    assert_eq!(line(&buildings, 200.0).sight, Sight::Free);
    let any = PastObjects { least: 1e-6, ..all };
    assert_eq!(line(&any, 200.0).sight, Sight::Free);
}

#[test]
fn a_line_straight_down_meets_what_one_a_millimetre_off_meets() {
    let (ground, _) = ground_with(scattered(5, &rough(9, 7)));
    let mut draw = Rng::with_seed(8);
    let past = PastObjects { least: 0.9, ..PastObjects::all(Curvature::NONE) };
    let mut hidden = [0; 3];
    for _ in 0..3000 {
        let place = [CORNER[0] + 2.0 + 496.0 * draw.f64(), CORNER[1] + 2.0 + 496.0 * draw.f64()];
        let [from, to] = [200.0 + 100.0 * draw.f64(), 200.0 * draw.f64()];
        let sighted = |off: f64| {
            let line = [[place[0], place[1], from], [place[0] + off, place[1], to]];
            ground.sight_past(line[0], line[1], &past)
        };
        let (plumb, near) = (sighted(0.0), sighted(1e-6));
        let same = |a: f64, b: f64| (a - b).abs() < 1e-4;
        let same_end = match (plumb.sight, near.sight) {
            (Sight::Hidden(a), Sight::Hidden(b)) => same(a, b),
            (a, b) => a == b,
        };
        assert!(same_end && plumb.by == near.by, "{place:?} {from} {to}: {plumb:?} {near:?}");
        assert!(same(plumb.transmission, near.transmission) && same(plumb.wood_m, near.wood_m), "{plumb:?} {near:?}");
        for (count, by) in hidden.iter_mut().zip([Hider::Ground, Hider::Building, Hider::Wood]) {
            *count += usize::from(plumb.by == Some(by));
        }
    }
    assert!(hidden.iter().all(|count| 20 < *count), "{hidden:?}");
}

#[test]
fn without_objects_answers_are_those_of_the_ground_bit_by_bit() {
    let (ground, _) = ground_with(scattered(5, &rough(9, 7)));
    let mut draw = Rng::with_seed(2);
    for curvature in [Curvature::NONE, Curvature(2e-4)] {
        let past = PastObjects { standing: Standing::None, least: 0.5, curvature };
        for _ in 0..300 {
            let mut place = || {
                let [x, y] = [1020.0, 510.0].map(|reach: f64| reach * draw.f64() - 5.0);
                [CORNER[0] + x, CORNER[1] + y, 200.0 * draw.f64()]
            };
            let (from, to) = (place(), place());
            let found = ground.sight_past(from, to, &past);
            assert_eq!(found.sight, ground.sight_over(from, to, curvature));
            assert_eq!((found.transmission, found.wood_m), (1.0, 0.0));
            assert_eq!(found.by.is_some(), matches!(found.sight, Sight::Hidden(_)));
        }
    }
}

#[test]
fn along_a_line_between_load_modules_what_stands_over_it_hides_from_both_ends() {
    let west = [[0, 20_000], [6_000, 20_000], [6_000, 40_000], [0, 40_000]];
    let south = [[20_000, 0], [40_000, 0], [40_000, 6_000], [20_000, 6_000]];
    let prism = |id, places: &[[u16; 2]]| {
        let rings = vec![ring(places)];
        Prism { id, kind: ObjectKind::Building, base: 128_000, roof: 129_000, rings }
    };
    let (ground, _) = ground_with(Objects { prisms: vec![prism(1, &west), prism(2, &south)], ..Objects::default() });
    let past = PastObjects::all(Curvature::NONE);
    let hides = |from: [f64; 2], to: [f64; 2]| {
        let place = |[x, y]: [f64; 2]| [CORNER[0] + x, CORNER[1] + y, 1004.0];
        ground.sight_past(place(from), place(to), &past).by
    };
    for (from, to) in [([500.0, 50.0], [500.0, 450.0]), ([50.0, 0.0], [450.0, 0.0])] {
        assert_eq!([hides(from, to), hides(to, from)], [Some(Hider::Building); 2], "{from:?} {to:?}");
    }
}

#[test]
fn roofs_are_stood_on_and_walls_have_two_sides() {
    let block = |base, roof| Prism {
        id: 1,
        kind: ObjectKind::Building,
        base,
        roof,
        rings: vec![ring(&[[12_800, 12_800], [25_600, 12_800], [25_600, 25_600], [12_800, 25_600]])],
    };
    let past = PastObjects::all(Curvature::NONE);
    let check = |prism: Prism, from: [f64; 3], to: [f64; 3], expected: Option<f64>| {
        let (ground, _) = ground_with(Objects { prisms: vec![prism], canopies: Vec::new() });
        let world = |[x, y, z]: [f64; 3]| [CORNER[0] + x, CORNER[1] + y, z];
        let found = ground.sight_past(world(from), world(to), &past);
        match (found.sight, expected) {
            (Sight::Free, None) => {}
            (Sight::Hidden(at), Some(share)) => {
                assert!((at - share).abs() < 1e-6, "{from:?} {to:?}: {found:?}, expected {share}");
                assert_eq!(found.by, Some(Hider::Building));
            }
            _ => panic!("{from:?} {to:?}: {found:?}, expected {expected:?}"),
        }
    };
    let high = || block(0, 200 * 128);
    check(high(), [50.0, 150.0, 190.0], [300.0, 150.0, 190.0], Some(0.2));
    check(high(), [300.0, 150.0, 190.0], [50.0, 150.0, 190.0], Some(0.4));
    check(high(), [50.0, 150.0, 201.0], [300.0, 150.0, 201.0], None);
    // Along the roof, and from it.
    check(high(), [50.0, 150.0, 200.0], [300.0, 150.0, 200.0], None);
    check(high(), [150.0, 150.0, 200.0], [150.0, 300.0, 260.0], None);
    check(high(), [150.0, 150.0, 202.0], [150.0, 300.0, 190.0], Some(2.0 / 12.0));
    // From inside, into it, and straight down onto it.
    check(high(), [150.0, 150.0, 190.0], [300.0, 150.0, 190.0], Some(0.0));
    check(high(), [300.0, 150.0, 190.0], [150.0, 150.0, 190.0], Some(100.0 / 150.0));
    check(high(), [150.0, 150.0, 210.0], [150.0, 150.0, 190.0], Some(0.5));
    // Past a corner, and under what hangs.
    check(high(), [50.0, 100.0, 190.0], [100.0, 250.0, 190.0], None);
    let hangs = || block(180 * 128, 200 * 128);
    check(hangs(), [50.0, 150.0, 179.0], [300.0, 150.0, 179.0], None);
    check(hangs(), [150.0, 150.0, 170.0], [150.0, 160.0, 190.0], Some(0.5));
}

#[test]
fn tops_and_obstacles_agree_with_places_around() {
    const RADIUS_M: f64 = 4.0;
    let (ground, module) = ground_with(scattered(5, &rough(9, 7)));
    let objects = &module.objects;
    let over = |canopy: &Canopy, place: [f64; 2]| {
        canopy.triangles.iter().any(|triangle| {
            let at = triangle.map(|index| canopy.places[usize::from(index)].map(f64::from));
            let left = |a: [f64; 2], b: [f64; 2]| (b[0] - a[0]) * (place[1] - a[1]) - (b[1] - a[1]) * (place[0] - a[0]);
            (0..3).all(|i| 0.0 <= left(at[i], at[(i + 1) % 3]))
        })
    };
    let mut draw = Rng::with_seed(29);
    let mut counts = [0; 3];
    for _ in 0..600 {
        let [x, y] = [0, 1].map(|_| f64::from(draw.u32(10_000..490_000)) / 1000.0);
        let place = [x * 128.0, y * 128.0];
        let ground_m = by_search(&module, place);
        let world = [CORNER[0] + x, CORNER[1] + y];
        let roofs =
            objects.prisms.iter().filter(|prism| holds(prism, place)).map(|prism| f64::from(prism.roof) / 128.0);
        let crowns = objects.canopies.iter().filter(|canopy| over(canopy, place));
        let crowns = crowns.map(|canopy| ground_m + f64::from(canopy.height) / 128.0);
        let expected = roofs.chain(crowns).fold(ground_m, f64::max);
        let top = ground.top(world).unwrap();
        assert!((top.height_m - expected).abs() < 1e-4, "{x} {y}: {top:?}, expected {expected}");
        assert_eq!(top.of == Hider::Ground, top.height_m == ground.height_m(world).unwrap());

        let wheels_m = ground_m + 20.0 * draw.f64();
        let around = |inside: &dyn Fn([f64; 2]) -> bool| {
            let steps = || (-40..=40).map(|step| f64::from(step) * RADIUS_M / 40.0);
            let places = steps().flat_map(|dx| steps().map(move |dy| [dx, dy]));
            let near = places.filter(|[dx, dy]| inside([place[0] + dx * 128.0, place[1] + dy * 128.0]));
            near.map(|[dx, dy]| dx.hypot(dy)).fold(f64::INFINITY, f64::min)
        };
        let [low, high] = [0.3, 3.0].map(|above| (wheels_m + above) * 128.0);
        let blocks = |prism: &&Prism| f64::from(prism.base) < high && low < f64::from(prism.roof);
        let wall_m = around(&|at| objects.prisms.iter().filter(blocks).any(|prism| holds(prism, at)));
        let stem_m = around(&|at| objects.canopies.iter().any(|canopy| over(canopy, at)));
        match ground.obstacle_at([world[0], world[1], wheels_m], RADIUS_M) {
            Some(found) if found.spacing_m.is_none() => {
                assert!(wall_m - 0.2 < found.distance_m && (found.distance_m < wall_m + 0.2 || 3.8 < found.distance_m));
                counts[0] += 1;
            }
            Some(found) => {
                assert!(3.8 < wall_m && (stem_m < RADIUS_M || 3.8 < found.distance_m), "{found:?} {wall_m} {stem_m}");
                assert_eq!(found.spacing_m, Some(4.0));
                counts[1] += 1;
            }
            None => {
                assert!(3.8 < wall_m && 3.8 < stem_m, "{x} {y}: {wall_m} {stem_m}");
                counts[2] += 1;
            }
        }
    }
    assert!(counts.iter().all(|&count| 60 < count), "{counts:?}");
    assert_eq!(ground.top([0.0, 0.0]), None);
    assert_eq!(ground.obstacle_at([0.0, f64::NAN, 0.0], 3.0), None);
    assert_eq!(ground.obstacle_at([CORNER[0], CORNER[1], 0.0], f64::NAN), None);
}

#[test]
fn an_eye_past_objects_sees_what_single_lines_say() {
    let (ground, _) = ground_with(scattered(5, &rough(9, 7)));
    let mut draw = Rng::with_seed(3);
    let mut counts = [0; 4];
    for curvature in [Curvature::NONE, Curvature(2e-5)] {
        for _ in 0..30 {
            let mut place = |up: f64| {
                let [x, y] = [1000.0, 500.0].map(|reach: f64| reach * draw.f64());
                let height_m = ground.height_m([CORNER[0] + x, CORNER[1] + y]).unwrap();
                [CORNER[0] + x, CORNER[1] + y, height_m + up * draw.f64()]
            };
            let from = place(120.0);
            let eye = ground.eye(from, curvature);
            let mut eyes = [eye.clone(), eye.looking_far(700.0)];
            for _ in 0..200 {
                let to = place(30.0);
                if !eyes.each_mut().map(|eye| eye.sees(to))[0] {
                    counts[0] += 1;
                    continue;
                }
                for standing in [Standing::None, Standing::Buildings, Standing::All] {
                    let all = ground.sight_past(from, to, &PastObjects { standing, least: 1e-9, curvature });
                    let expected = if all.sight == Sight::Free { all.transmission } else { 0.0 };
                    let [light, far] = eyes.each_mut().map(|eye| eye.light(to, standing));
                    assert!((light - far).abs() < 1e-12, "{light}, looking far {far}");
                    assert!((light - expected).abs() < 1e-9 || light == 0.0 && expected < 0.005, "{light} {all:?}");
                    counts[if expected == 0.0 { 1 } else { 2 + usize::from(expected < 1.0) }] += 1;
                }
            }
        }
    }
    assert!(counts.iter().all(|&count| 100 < count), "{counts:?}");
}
