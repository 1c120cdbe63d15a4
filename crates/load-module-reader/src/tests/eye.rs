//! Tests of many lines of sight from one place, of the curved earth, and of profiles.

use std::sync::Arc;

use fastrand::Rng;

use super::{SIDE, agrees_with_small_steps, by_search, rough, sample_ground};
use crate::{Curvature, LoadedGround, Look, Module, NOT_LOOKED_AT, SEEN, Sight, Standing, TerrainModule, Viewshed};

const CORNER: [f64; 2] = [501_500.0, 3_876_000.25];
/// A small planet: a middle hangs by metres over half a kilometre.
const CURVED: Curvature = Curvature(2e-4);

/// Two load modules of the same rough ground.
fn rough_ground() -> (LoadedGround, Module) {
    let module = rough(9, 7);
    let ground = sample_ground();
    let block = ground.block();
    let prepared = Arc::new(TerrainModule::new(module.clone(), SIDE));
    (ground.with_modules(block, vec![Arc::clone(&prepared), prepared]), module)
}

#[test]
fn an_eye_sees_exactly_what_lines_of_sight_say() {
    let (ground, _) = rough_ground();
    let mut draw = Rng::with_seed(5);
    let mut seen = 0;
    for curvature in [Curvature::NONE, CURVED] {
        for _ in 0..40 {
            let mut place = |up: f64| {
                // A little beyond what is loaded, too.
                let [x, y] = [1020.0, 510.0].map(|reach: f64| reach * draw.f64() - 5.0);
                let height_m = ground.height_m([CORNER[0] + x, CORNER[1] + y]).unwrap_or(50.0);
                [CORNER[0] + x, CORNER[1] + y, height_m + up * draw.f64() - 0.1]
            };
            let from = place(80.0);
            let eye = ground.eye(from, curvature);
            // To less than it looks at, and beyond.
            let mut eyes = [eye.clone(), eye.clone().looking_far(300.0), eye.looking_far(2000.0)];
            for _ in 0..200 {
                let to = place(12.0);
                let expected = ground.sight_over(from, to, curvature) == Sight::Free;
                assert_eq!(eyes.each_mut().map(|eye| eye.sees(to)), [expected; 3], "from {from:?} to {to:?}");
                seen += u32::from(expected);
            }
        }
    }
    assert!((1000..15_000).contains(&seen), "{seen} of 16,000");
}

#[test]
fn over_a_curved_earth_a_line_of_sight_agrees_with_small_steps() {
    let (ground, module) = rough_ground();
    let mut draw = Rng::with_seed(11);
    let (mut hidden, mut free) = (0, 0);
    for _ in 0..400 {
        let mut place = || [0, 1].map(|_| f64::from(draw.u32(..500_000)) / 1000.0);
        let (from, to): ([f64; 2], [f64; 2]) = (place(), place());
        let (up, over) = (f64::from(draw.u32(..200)), f64::from(draw.u32(..200)));
        let length_m = ((to[0] - from[0]) * (to[0] - from[0]) + (to[1] - from[1]) * (to[1] - from[1])).sqrt();
        let at = |share: f64| {
            let local = [0, 1].map(|axis| from[axis] + share * (to[axis] - from[axis]));
            // The ground falls away from the eye as the place that it looks at does.
            let fallen = |share: f64| CURVED.per_metre() * (share * length_m) * (share * length_m);
            let line = up + share * (over - fallen(1.0) - up);
            line - (by_search(&module, local.map(|metres| metres * 128.0)) - fallen(share))
        };
        let world = |[x, y]: [f64; 2], up: f64| [CORNER[0] + x, CORNER[1] + y, up];
        let (from, to) = (world(from, up), world(to, over));
        let clearance_m = ground.clearance_over_m(from, to, CURVED).unwrap();
        match agrees_with_small_steps(ground.sight_over(from, to, CURVED), clearance_m, at) {
            true => free += 1,
            false => hidden += 1,
        }
    }
    assert!(20 < hidden && 20 < free, "{hidden} hidden, {free} free");
}

#[test]
fn refraction_flattens_the_earth_and_no_number_does_nothing() {
    let [none, light, all, odd] = [0.0, 0.13, 2.0, f64::NAN].map(|k| Curvature::of_earth(k).per_metre());
    assert!(all == 0.0 && light < none && odd == none);
    // 5 km away the ground lies two metres lower.
    assert!((1.9..2.0).contains(&(none * 5000.0 * 5000.0)));
}

#[test]
fn a_viewshed_tells_each_place_as_a_line_of_sight_does() {
    let (ground, _) = rough_ground();
    let place_m = [CORNER[0] + 480.0, CORNER[1] + 250.0];
    let viewshed = Viewshed {
        place_m,
        eye_m: 20.0,
        target_m: 1.0,
        range_m: 300.0,
        spacing_m: 7.0,
        curvature: Curvature::NONE,
        standing: Standing::None,
        is_on_roofs: false,
    };
    let mut eye = viewshed.eye(&ground).unwrap();
    assert_eq!((viewshed.reach(), viewshed.side()), (42, 85));
    let mut counts = [0; 3];
    for row in 0..85 {
        let found = viewshed.row(&ground, &mut eye, row);
        assert_eq!(found.len(), 85);
        for (col, Look { seen: number, light }) in found.into_iter().enumerate() {
            let (right, up) = ((col as f64 - 42.0) * 7.0, (42.0 - row as f64) * 7.0);
            let place = [place_m[0] + right, place_m[1] + up];
            let height = ground.height_m(place).filter(|_| right * right + up * up <= 300.0 * 300.0);
            let expected = height.map_or(NOT_LOOKED_AT, |height_m| {
                u8::from(ground.sight(eye.place_m(), [place[0], place[1], height_m + 1.0]) == Sight::Free)
            });
            assert_eq!(number, expected, "row {row}, column {col}");
            assert_eq!(light, [0, 100, u8::MAX][usize::from(number.min(2))]);
            counts[usize::from(number.min(2))] += 1;
        }
    }
    assert!(counts.iter().all(|&count| 100 < count), "{counts:?}, the middle one seen ({SEEN})");
    let outside = Viewshed { place_m: [0.0, 0.0], ..viewshed };
    assert!(outside.eye(&ground).is_none());
}

#[test]
fn a_profile_goes_through_its_places_at_even_steps() {
    let ground = sample_ground();
    let place = |x: f64, y: f64| [CORNER[0] + x, CORNER[1] + y];
    let points = ground.profile(&[place(10.0, 20.0), place(110.0, 20.0), place(110.0, 50.0)], 25.0);
    let along: Vec<f64> = points.iter().map(|point| point.along_m).collect();
    assert_eq!(along, [0.0, 25.0, 50.0, 75.0, 100.0, 115.0, 130.0]);
    assert!(points.iter().all(|point| point.height_m == Some(5.0) && point.deck_m.is_none()));
    let beyond = ground.profile(&[place(10.0, 20.0), place(-50.0, 20.0)], f64::NAN);
    assert_eq!((beyond.len(), beyond[1].height_m, beyond[1].class), (2, None, None));
    assert!(ground.profile(&[], 1.0).is_empty());
}
