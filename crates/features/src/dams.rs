//! Dams split bodies of water: each part draws back from the dam by two steps, so that the dam between them is ground.
//!
//! ```text
//!   ┌───────p───────┐        ┌─────p'  p''────┐
//!   │ upper │ lower │   ->   │ upper│ │ lower │     the dam runs from p to q
//!   └───────q───────┘        └─────q'  q''────┘
//! ```

use std::collections::HashMap;

use crate::pieces::moved;
use crate::rings::{Ring, doubled_area, encloses};
use crate::{Kind, Outline, Place, Way};

/// Steps that water draws back from a dam on either side.
const BACK_STEPS: f64 = 2.0;

/// Splits outlines of lakes and rivers where a dam runs through them from shore to shore.
///
/// Places are those of one rounding, so a dam and a shore that meet share a place.
pub fn split_at_dams(outlines: Vec<Outline>, ways: &[Way]) -> Vec<Outline> {
    let dams: Vec<&Way> = ways.iter().filter(|way| way.traits.kind == Kind::Dam).collect();
    if dams.is_empty() {
        return outlines;
    }
    let mut at_place: HashMap<Place, Vec<usize>> = HashMap::new();
    for (number, dam) in dams.iter().enumerate() {
        dam.places.iter().for_each(|place| at_place.entry(*place).or_default().push(number));
    }
    let mut split = Vec::with_capacity(outlines.len());
    for outline in outlines {
        let mut near: Vec<usize> = outline
            .rings
            .iter()
            .flat_map(|ring| &ring.places)
            .filter_map(|place| at_place.get(place))
            .flatten()
            .copied()
            .collect();
        near.sort_unstable();
        near.dedup();
        if near.is_empty() || !matches!(outline.traits.kind, Kind::Lake | Kind::River) {
            split.push(outline);
            continue;
        }
        let mut outers: Vec<Vec<Place>> =
            outline.rings.iter().filter(|ring| !ring.hole).map(|ring| ring.places.clone()).collect();
        for number in near {
            outers = outers.into_iter().flat_map(|ring| cut(ring, &dams[number].places)).collect();
        }
        outers.sort();
        for outer in outers {
            let holes = outline.rings.iter().filter(|ring| ring.hole && encloses(&outer, ring.places[0])).cloned();
            let mut rings = vec![Ring { places: outer.clone(), hole: false }];
            rings.extend(holes);
            split.push(Outline { traits: outline.traits, rings, id: outline.id });
        }
    }
    split
}

/// A ring cut by the first stretch of a dam that runs through it; the parts are cut again by the rest of the dam.
fn cut(ring: Vec<Place>, dam: &[Place]) -> Vec<Vec<Place>> {
    let on_ring: HashMap<Place, usize> = ring.iter().enumerate().map(|(at, place)| (*place, at)).collect();
    let mut start = None;
    for (at, place) in dam.iter().enumerate() {
        let Some(&here) = on_ring.get(place) else { continue };
        if let Some((from, from_at)) = start {
            let path = &dam[from_at..=at];
            if runs_inside(&ring, path) {
                let parts = [part(&ring, from, here, path), part(&ring, here, from, &reversed(path))];
                let rest = &dam[at..];
                return parts
                    .into_iter()
                    .filter(|part| 0 < doubled_area(part))
                    .flat_map(|part| cut(part, rest))
                    .collect();
            }
        }
        start = Some((here, at));
    }
    vec![ring]
}

fn reversed(path: &[Place]) -> Vec<Place> {
    path.iter().rev().copied().collect()
}

/// Whether a path between two places of a ring lies inside it and not along it.
fn runs_inside(ring: &[Place], path: &[Place]) -> bool {
    let doubled: Vec<Place> = ring.iter().map(|place| Place::new(2 * place.row, 2 * place.col)).collect();
    let count = ring.len();
    let along = (0..count).any(|at| {
        let edge = [ring[at], ring[(at + 1) % count]];
        path.windows(2).any(|pair| pair == edge || pair == [edge[1], edge[0]])
    });
    let middle = Place::new(path[0].row + path[1].row, path[0].col + path[1].col);
    !along && encloses(&doubled, middle)
}

/// The part of a counter-clockwise ring from one place to another, closed by the path back, two steps to its left.
///
/// `path` runs from the first place to the second; the part lies on its right, seen that way.
fn part(ring: &[Place], from: usize, to: usize, path: &[Place]) -> Vec<Place> {
    let count = ring.len();
    let length = (to + count - from) % count;
    let mut places: Vec<Place> = (1..length).map(|by| ring[(from + by) % count]).collect();
    let aside = |at: usize| {
        let (before, after) = (path[at.saturating_sub(1)], path[(at + 1).min(path.len() - 1)]);
        let [east, north] = before.to(after).map(|steps| steps as f64);
        let length = (east * east + north * north).sqrt().max(1e-9);
        moved(path[at], BACK_STEPS * north / length, -BACK_STEPS * east / length)
    };
    // At the shore it draws back along the shore itself.
    let along = |shore: Place, inward: Place| {
        let [east, north] = shore.to(inward).map(|steps| steps as f64);
        let length = (east * east + north * north).sqrt();
        (BACK_STEPS < length).then(|| moved(shore, BACK_STEPS * east / length, BACK_STEPS * north / length))
    };
    let (first, last) = (path[0], path[path.len() - 1]);
    places.extend(along(last, ring[(to + count - 1) % count]));
    places.extend((1..path.len() - 1).rev().map(aside));
    places.extend(along(first, ring[(from + 1) % count]));
    places.dedup();
    let least = (0..places.len()).min_by_key(|&at| places[at]).unwrap_or(0);
    places.rotate_left(least);
    places
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::samples::{rounded, way};

    #[test]
    fn a_dam_through_a_lake_makes_two_that_share_no_place() {
        let lake = [(10.0, 10.0), (50.0, 10.0), (50.0, 30.0), (10.0, 30.0), (10.0, 10.0)];
        let sources =
            vec![way(1, "natural=water", &lake), way(2, "waterway=dam", &[(30.0, 5.0), (31.0, 20.0), (30.0, 35.0)])];
        let rounded = rounded(sources);
        let split = split_at_dams(rounded.outlines.clone(), &rounded.ways);
        assert_eq!(split.len(), 2);
        let areas: Vec<i128> = split.iter().map(|part| doubled_area(&part.rings[0].places)).collect();
        let whole = doubled_area(&rounded.outlines[0].rings[0].places);
        assert!(areas.iter().all(|area| whole * 2 / 5 < *area) && areas.iter().sum::<i128>() < whole);
        let dam = &rounded.ways[0].places;
        for part in &split {
            assert!(part.rings[0].places.iter().all(|place| !dam.contains(place)));
        }
        assert!(split[0].rings[0].places.iter().all(|place| !split[1].rings[0].places.contains(place)));
    }

    #[test]
    fn a_dam_that_ends_in_the_water_or_runs_along_its_shore_splits_nothing() {
        let lake = [(10.0, 10.0), (50.0, 10.0), (50.0, 30.0), (10.0, 30.0), (10.0, 10.0)];
        for dam in [[(30.0, 5.0), (30.0, 20.0)], [(10.0, 10.0), (50.0, 10.0)]] {
            let rounded = rounded(vec![way(1, "natural=water", &lake), way(2, "waterway=dam", &dam)]);
            assert_eq!(split_at_dams(rounded.outlines.clone(), &rounded.ways), rounded.outlines);
        }
    }
}
