//! Cuts plans at the lines between load modules.

use std::collections::BTreeSet;

use terrain::Corner;
use terrain::plans::{common, triangles};

use super::plan::{At, Plan, Ring, bounds, edges};

/// A plan in the square of one load module.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Piece {
    /// Row and column, which may lie beyond the area.
    pub module: [i32; 2],
    /// Rings in quanta from the square's south-west corner.
    pub plan: Plan,
}

/// The pieces of a plan, in the order of their squares; of what lies on a line only, there is none. A border that
/// crosses a line gets a place there first, so that both sides have the same.
pub(super) fn cut(plan: &Plan, side: i32) -> Vec<Piece> {
    let mut pieces = Vec::new();
    let split: Plan = plan.iter().map(|ring| with_crossings(ring, side)).collect();
    halve(vec![split], side, &mut pieces);
    pieces.sort_by_key(|piece| piece.module);
    pieces
}

/// Halves plans at lines between squares until each lies in one.
fn halve(plans: Vec<Plan>, side: i32, pieces: &mut Vec<Piece>) {
    let Some(around) = plans
        .iter()
        .map(bounds)
        .reduce(|a, b| [[a[0][0].min(b[0][0]), a[0][1].min(b[0][1])], [a[1][0].max(b[1][0]), a[1][1].max(b[1][1])]])
    else {
        return;
    };
    let first = around[0].map(|quanta| quanta.div_euclid(side));
    // What ends on a line does not reach beyond it.
    let last = around[1].map(|quanta| (quanta - 1).div_euclid(side));
    let squares = [0, 1].map(|axis| last[axis] - first[axis] + 1);
    if squares.iter().all(|&count| count <= 1) {
        let corner = first.map(|number| number * side);
        pieces.extend(plans.into_iter().map(|plan| {
            let local = |at: At| [at[0] - corner[0], at[1] - corner[1]];
            let plan = plan.into_iter().map(|ring| ring.into_iter().map(local).collect()).collect();
            Piece { module: [first[1], first[0]], plan }
        }));
        return;
    }
    let axis = usize::from(squares[0] < squares[1]);
    let middle = (first[axis] + squares[axis] / 2) * side;
    for is_low in [true, false] {
        let [mut low, mut high] = around;
        if is_low {
            high[axis] = middle
        } else {
            low[axis] = middle
        }
        let clip = vec![vec![low, [high[0], low[1]], high, [low[0], high[1]]]];
        halve(common(&plans, &[clip]), side, pieces);
    }
}

/// A ring with a place wherever it crosses a line; computed from the end of an edge that is the lesser one.
fn with_crossings(ring: &[At], side: i32) -> Ring {
    let mut split = Ring::new();
    for (a, b) in edges(ring) {
        let (from, to) = (a.min(b), a.max(b));
        let mut on_way: Vec<At> = vec![];
        for axis in 0..2 {
            let (low, high) = (from[axis].min(to[axis]), from[axis].max(to[axis]));
            let first = low.div_euclid(side) + 1;
            for line in (first..).map(|number| number * side).take_while(|&line| line < high) {
                let other = 1 - axis;
                let run = |axis: usize| f64::from(to[axis]) - f64::from(from[axis]);
                let share = (f64::from(line) - f64::from(from[axis])) / run(axis);
                let mut at = [line; 2];
                at[other] = (f64::from(from[other]) + share * run(other)).round() as i32;
                on_way.push(at);
            }
        }
        let ahead = |at: &At| [0, 1].iter().map(|&axis| (i64::from(at[axis]) - i64::from(a[axis])).abs()).sum::<i64>();
        on_way.sort_by_key(|at| (ahead(at), *at));
        split.push(a);
        split.extend(on_way);
    }
    split.dedup();
    split
}

/// The ring of a piece with its walls: an edge on a side of the square is one only where the plan itself has an edge.
pub(super) fn walled(piece: &Piece, plan: &Plan, side: i32) -> Vec<Vec<Corner>> {
    let corner = [piece.module[1] * side, piece.module[0] * side];
    // Edges of the plan along lines between squares: axis, line, from and to.
    let along: BTreeSet<(usize, i32, i32, i32)> = plan
        .iter()
        .flat_map(|ring| edges(ring))
        .flat_map(|(a, b)| [0, 1].map(|axis| (axis, a, b)))
        .filter(|(axis, a, b)| a[*axis] == b[*axis] && a[*axis].rem_euclid(side) == 0)
        .map(|(axis, a, b)| (axis, a[axis], a[1 - axis].min(b[1 - axis]), a[1 - axis].max(b[1 - axis])))
        .collect();
    let has_wall = |a: At, b: At| {
        let on_side = [0, 1].into_iter().find(|&axis| a[axis] == b[axis] && (a[axis] == 0 || a[axis] == side));
        let Some(axis) = on_side else { return true };
        let line = a[axis] + corner[axis];
        let doubled_middle = i64::from(a[1 - axis]) + i64::from(b[1 - axis]) + 2 * i64::from(corner[1 - axis]);
        let covers =
            |low: i32, high: i32| 2 * i64::from(low) <= doubled_middle && doubled_middle <= 2 * i64::from(high);
        along.range((axis, line, i32::MIN, i32::MIN)..=(axis, line, i32::MAX, i32::MAX)).any(|of| covers(of.2, of.3))
    };
    let place = |at: i32| u16::try_from(at).expect("a piece lies in its square, whose sides are of 16 bits");
    let to_corner = |(a, b): (At, At)| Corner { x: place(a[0]), y: place(a[1]), has_wall: has_wall(a, b) };
    piece.plan.iter().map(|ring| edges(ring).map(to_corner).collect()).collect()
}

/// Quanta of the border of a piece that are border of the plan, too.
pub(super) fn border(rings: &[Vec<Corner>]) -> f64 {
    let mut around = 0.0;
    for ring in rings {
        for (a, b) in ring.iter().zip(ring.iter().cycle().skip(1)).filter(|(a, _)| a.has_wall) {
            let [x, y] = [f64::from(b.x) - f64::from(a.x), f64::from(b.y) - f64::from(a.y)];
            around += (x * x + y * y).sqrt();
        }
    }
    around
}

/// The triangles of pieces in one square, as one canopy has them.
pub(super) fn canopy_lists(pieces: &[Piece]) -> (Vec<[u16; 2]>, Vec<[u16; 3]>) {
    let (mut places, mut all) = (Vec::new(), Vec::new());
    for piece in pieces {
        let (at, made) = triangles(&piece.plan);
        let first = places.len();
        let place = |at: i32| u16::try_from(at).expect("a piece lies in its square, whose sides are of 16 bits");
        places.extend(at.into_iter().map(|at| at.map(place)));
        all.extend(made.into_iter().map(|triangle| triangle.map(|index| (first + index as usize) as u16)));
    }
    (places, all)
}

#[cfg(test)]
mod tests {
    use super::super::plan::doubled_area;
    use super::*;

    const SIDE: i32 = 64_000;

    #[test]
    fn pieces_cover_what_was_cut_and_meet_in_the_same_places() {
        // Across the corner of four squares, with a hole over it, askew.
        let plan = vec![
            vec![[63_000, 62_900], [65_100, 63_300], [64_700, 65_400], [62_600, 65_001]],
            vec![[63_900, 63_901], [63_850, 64_200], [64_120, 64_190], [64_130, 63_890]],
        ];
        let pieces = cut(&plan, SIDE);
        assert_eq!(pieces.iter().map(|piece| piece.module).collect::<Vec<_>>(), [[0, 0], [0, 1], [1, 0], [1, 1]]);
        let all: i64 = pieces.iter().map(|piece| doubled_area(&piece.plan)).sum();
        // Places on lines are rounded to quanta.
        assert!((all - doubled_area(&plan)).abs() < 5_000, "{all} {}", doubled_area(&plan));
        let mut on_line: Vec<Vec<i32>> = Vec::new();
        for (module, x) in [([0, 0], SIDE), ([0, 1], 0)] {
            let piece = pieces.iter().find(|piece| piece.module == module).unwrap();
            let mut at: Vec<i32> = piece.plan.iter().flatten().filter(|at| at[0] == x).map(|at| at[1]).collect();
            at.sort_unstable();
            on_line.push(at);
            let walls = walled(piece, &plan, SIDE);
            let open: Vec<_> = walls.iter().flatten().filter(|corner| !corner.has_wall).collect();
            assert_eq!(open.len(), 2, "{walls:?}");
        }
        assert_eq!(on_line[0], on_line[1]);
    }

    #[test]
    fn a_wall_along_a_line_is_one() {
        let plan = vec![vec![[64_000, 100], [65_000, 100], [65_000, 1_100], [64_000, 1_100]]];
        let pieces = cut(&plan, SIDE);
        assert_eq!((pieces.len(), pieces[0].module), (1, [0, 1]));
        assert!(walled(&pieces[0], &plan, SIDE).iter().flatten().all(|corner| corner.has_wall));
        let below = vec![vec![[-500, -500], [0, -500], [0, 0], [-500, 0]]];
        assert_eq!(cut(&below, SIDE)[0].module, [-1, -1]);
    }
}
