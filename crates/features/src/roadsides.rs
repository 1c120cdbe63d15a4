//! Edges of roads that ground beside them slopes from, with the natural ground there.

use std::collections::HashMap;

use terrain::{QUANTA_PER_METRE, Role, SideSlope};

use crate::forms::Formed;
use crate::toes::{CUT_RUN, FILL_RUN, ROADSIDE_REACH_M};
use crate::watersides::moved_beside;
use crate::{Graded, Place};

/// Metres along the side of a cell in which known ground is looked up: stations stand closer.
const CELL_M: f64 = 32.0;

/// Metres that ground rough beside a road is moved at most where the road lies on it.
const ROUGH_M: f64 = 5.0;

/// By how many quanta ground of which the DEM says `natural` is moved upwards, so far `away` from an edge at some
/// height, above which the DEM lies by `off` there; all in quanta.
///
/// A slope ends where it would on level ground. On a hillside as steep as itself it would never meet the ground, and
/// where it was cut off a wall would stand.
pub fn moved_by_road([height, off]: [f64; 2], away: f64, natural: f64) -> f64 {
    let quanta = |metres: f64| metres * f64::from(QUANTA_PER_METRE);
    let least = quanta(ROUGH_M);
    let moved = |(off, run): (f64, f64)| {
        let run = (off.abs() * run).min(quanta(ROADSIDE_REACH_M));
        moved_beside([height, off], [run, away], natural)
    };
    [(off.max(least), CUT_RUN), (off.min(-least), FILL_RUN)].map(moved).iter().sum()
}

/// Edges and centrelines of roads, in the TIN or not, each with the ground known nearest to its ends, at stations and
/// at their sides; with its own heights where none is known near them.
pub(crate) fn roadsides(
    formed: &Formed,
    graded: &Graded,
    (resting, sides): (&[Option<i32>], &[[Place; 2]]),
) -> Vec<SideSlope> {
    let Graded { network, beside, .. } = *graded;
    let side = (CELL_M / network.lattice.metres_per_step()).ceil() as i32;
    let cell = |place: Place| (place.row.div_euclid(side), place.col.div_euclid(side));
    let mut cells: HashMap<(i32, i32), Vec<(Place, i32)>> = HashMap::new();
    let stations = network.nodes.iter().zip(resting).filter_map(|(node, ground)| Some((node.place, (*ground)?)));
    let sides = sides.iter().flatten().copied().zip(beside.iter().flatten().copied());
    stations.chain(sides).for_each(|(place, ground)| cells.entry(cell(place)).or_default().push((place, ground)));
    let ground = |(place, height): (Place, i32)| {
        let (row, col) = cell(place);
        let around = (-1..=1).flat_map(|north| (-1..=1).map(move |east| (row + north, col + east)));
        let near = around.filter_map(|cell| cells.get(&cell)).flatten();
        near.min_by_key(|(other, ground)| (place.squared_to(*other), *ground)).map_or(height, |(_, ground)| *ground)
    };
    let held = formed.edges.iter().filter(|edge| matches!(edge.role, Role::Side | Role::Centre));
    let held = held.map(|edge| [edge.a, edge.b].map(|point| formed.points[point as usize]));
    let of = |ends: [(Place, i32); 2]| {
        let vertex = |(place, height): (Place, i32)| terrain::Vertex { at: place.into(), height };
        SideSlope { ends: ends.map(vertex), ground: ends.map(ground) }
    };
    held.chain(formed.shaped_slopes.iter().copied()).map(of).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ground_rough_beside_a_road_that_lies_on_it_is_moved_five_metres_at_most() {
        let moved = |natural: f64| moved_by_road([0.0, 0.0], 256.0, natural).round();
        assert_eq!([10_000.0, 170.0, 0.0, -128.0, -10_000.0].map(moved), [-469.0, 0.0, 0.0, 0.0, 512.0]);
        assert_eq!(moved_by_road([0.0, 0.0], 1280.0, -10_000.0), 0.0);
    }

    #[test]
    fn a_slope_meets_the_ground_no_farther_than_on_level_ground() {
        for off in [-3000.0, 2000.0] {
            let run = if off < 0.0 { FILL_RUN } else { CUT_RUN } * f64::abs(off);
            for natural in [-40_000.0, off, 0.0, 40_000.0] {
                assert_eq!(moved_by_road([0.0, off], run.max(1280.0), natural), 0.0);
            }
            assert_eq!(moved_by_road([0.0, off], run / 2.0, off), -off / 2.0);
        }
    }
}
