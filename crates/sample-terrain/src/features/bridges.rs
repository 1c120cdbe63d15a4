//! Bridges: highways are cut where they cross the largest washes.

use super::ground::Ground;
use super::lattice::{SIDE, cells};
use super::line::{self, Place, crossing, distance};
use super::roads::Class;

/// Hundredths of a square kilometre that drain to a wash which is worth a bridge.
const AREA_MIN: u32 = 900;
/// Bridges on one stretch of road.
const BRIDGES_MAX: usize = 4;
/// Metres between bridges, and from a bridge to where the road meets another.
const APART_M: f64 = 400.0;
/// Metres on either side of a bridge's middle on which the road crosses no wash twice.
const ALONE_M: f64 = 120.0;

/// A part of a road.
pub(super) struct Way {
    pub(super) line: Vec<Place>,
    pub(super) is_bridge: bool,
}

/// Cuts a road into ways that share their ends: on the ground and on bridges, by turns.
pub(super) fn cut(ground: &mut Ground, road: Vec<Place>, class: Class) -> Vec<Way> {
    let mut bridges = if class < Class::Secondary { Vec::new() } else { bridges(ground, &road) };
    bridges.sort_by(|a, b| a.0.total_cmp(&b.0));
    let whole_m = line::length(&road);
    let (mut ways, mut gone_m) = (Vec::new(), 0.0);
    for (middle_m, half_m) in bridges {
        let (from_m, to_m) = (middle_m - half_m, middle_m + half_m);
        ways.push(Way { line: line::part(&road, gone_m, from_m), is_bridge: false });
        let ends = [line::place_at(&road, from_m), line::place_at(&road, to_m)];
        ways.push(Way { line: ends.to_vec(), is_bridge: true });
        gone_m = to_m;
    }
    if ways.is_empty() {
        return vec![Way { line: road, is_bridge: false }];
    }
    ways.push(Way { line: line::part(&road, gone_m, whole_m), is_bridge: false });
    ways
}

/// Middles and half lengths of the bridges of a road, in metres along it.
fn bridges(ground: &mut Ground, road: &[Place]) -> Vec<(f64, f64)> {
    let whole_m = line::length(road);
    let crossings = crossings(ground, road);
    let is_alone = |at_m: f64| crossings.iter().filter(|other| (other.0 - at_m).abs() < ALONE_M).count() == 1;
    let mut large: Vec<(f64, u32)> = crossings
        .iter()
        .filter(|(at_m, area)| AREA_MIN <= *area && APART_M < *at_m && *at_m < whole_m - APART_M && is_alone(*at_m))
        .copied()
        .collect();
    large.sort_by(|a, b| b.1.cmp(&a.1).then(a.0.total_cmp(&b.0)));
    let mut bridges: Vec<(f64, f64)> = Vec::new();
    for (at_m, area) in large {
        if bridges.len() < BRIDGES_MAX && bridges.iter().all(|other| APART_M < (other.0 - at_m).abs()) {
            // From 40 m to 80 m.
            bridges.push((at_m, (15.0 + 0.005 * f64::from(area)).clamp(20.0, 40.0)));
        }
    }
    bridges
}

/// Where a road crosses washes: metres along it, and what drains to the wash.
fn crossings(ground: &mut Ground, road: &[Place]) -> Vec<(f64, u32)> {
    let mut found = Vec::new();
    let mut gone_m = 0.0;
    for leg in road.windows(2) {
        let leg_m = distance(leg[0], leg[1]);
        let squares = |axis: usize| {
            let (a, b) = (leg[0][axis], leg[1][axis]);
            cells(a.min(b), a.max(b), SIDE)
        };
        for number in squares(1).flat_map(|north| squares(0).map(move |east| (east, north))) {
            for reach in &ground.washes(number).reaches {
                for wash in reach.line.windows(2) {
                    let share = crossing([leg[0], leg[1]], [wash[0], wash[1]]);
                    found.extend(share.map(|(share, _)| (gone_m + share * leg_m, reach.area)));
                }
            }
        }
        gone_m += leg_m;
    }
    found
}
