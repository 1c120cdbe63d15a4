//! Fewer corners: of buildings so that right angles stay, of woods within a distance.

use terrain::plans::sorted_out;

use super::plan::{At, METRE, Plan, Ring, bounds, doubled_area, edges, length, ring_area};

/// Metres that a corner of a building may move at most.
const MOVE_M_MAX: f64 = 1.0;
/// How far a corner may lie off the line between its neighbours to be none: 12.5 cm.
const STRAIGHT: f64 = METRE / 8.0;

/// The plan of a building with at most `most` corners. First walls go whose neighbours meet within a metre of them, so
/// that directions stay; then jogs, corners and courtyards, what changes the area least for each corner before others,
/// and brings it back to what it was.
pub(super) fn fewer(plan: &Plan, most: usize) -> Plan {
    let mut rings: Plan = plan.iter().map(|ring| straightened(ring)).collect();
    rings.retain(|ring| 3 <= ring.len());
    if rings.is_empty() || ring_area(&rings[0]) <= 0 {
        return vec![least_rectangle(&plan[0])];
    }
    let area = doubled_area(&rings);
    while most < rings.iter().map(Vec::len).sum() {
        let walls = steps(&rings, |ring, index| vec![without_wall(ring, index)]);
        let mut others = steps(&rings, |ring, index| vec![without_jog(ring, index), without_corner(ring, index)]);
        others.extend(rings.iter().enumerate().skip(1).map(|(number, ring)| (number, Step::whole(ring))));
        let off = doubled_area(&rings) - area;
        let first = |mut steps: Vec<(usize, Step)>| {
            steps.sort_by(|(a_ring, a), (b_ring, b)| {
                let place = |ring: &usize, step: &Step| (*ring, step.from, step.gone);
                a.cost(off).total_cmp(&b.cost(off)).then_with(|| place(a_ring, a).cmp(&place(b_ring, b)))
            });
            steps.iter().find_map(|(number, step)| step.taken(&rings, *number))
        };
        match first(walls).or_else(|| first(others)) {
            Some(next) => rings = next,
            None => return vec![least_rectangle(&rings[0])],
        }
    }
    rings
}

/// Corners of a ring that go, and what comes in their place.
struct Step {
    /// By how much twice the area of the plan grows.
    change: i64,
    from: usize,
    gone: usize,
    put: Option<At>,
}

impl Step {
    /// Corners of a ring replaced from one on.
    fn of(ring: &[At], from: usize, gone: usize, put: Option<At>) -> Self {
        let count = ring.len();
        let around: Ring = (0..gone + 2).map(|step| ring[(from + count - 1 + step) % count]).collect();
        let after: Ring = [around[0]].into_iter().chain(put).chain([around[gone + 1]]).collect();
        Self { change: ring_area(&after) - ring_area(&around), from, gone, put }
    }

    /// A whole ring left out.
    fn whole(ring: &[At]) -> Self {
        Self { change: -ring_area(ring), from: 0, gone: ring.len(), put: None }
    }

    /// Twice the area that changes, and by which the plan is off then, for each corner that goes; `off` is by how much
    /// it is now.
    fn cost(&self, off: i64) -> f64 {
        let corners = self.gone - usize::from(self.put.is_some());
        (self.change.abs() + (off + self.change).abs()) as f64 / corners as f64
    }

    /// The rings after the step; `None` where they would cross.
    fn taken(&self, rings: &[Ring], number: usize) -> Option<Plan> {
        let mut plan = rings.to_vec();
        let ring = &mut plan[number];
        ring.rotate_left(self.from);
        ring.splice(..self.gone, self.put);
        *ring = straightened(ring);
        if ring.is_empty() {
            plan.remove(number);
        }
        let is_sound = plan.iter().all(|ring| 3 <= ring.len()) && 0 < ring_area(&plan[0]);
        let is_one = || matches!(sorted_out(plan.clone()).as_slice(), [one] if one.len() == plan.len());
        (is_sound && is_one()).then_some(plan)
    }
}

/// Steps at all corners of rings, each with the number of its ring.
fn steps(rings: &[Ring], at: impl Fn(&[At], usize) -> Vec<Option<Step>>) -> Vec<(usize, Step)> {
    let mut all = Vec::new();
    for (number, ring) in rings.iter().enumerate() {
        let of_ring = (0..ring.len()).flat_map(|index| at(ring, index)).flatten();
        all.extend(of_ring.map(|step| (number, step)));
    }
    all
}

/// Without corners on the line between their neighbours.
fn straightened(ring: &[At]) -> Ring {
    let mut ring: Ring = ring.to_vec();
    let mut index = 0;
    let mut kept = 0;
    while 3 < ring.len() && kept < ring.len() {
        let count = ring.len();
        let [before, at, after] = [index + count - 1, index, index + 1].map(|index| ring[index % count]);
        if off_line(at, before, after) < STRAIGHT {
            ring.remove(index % count);
            kept = 0;
        } else {
            (index, kept) = ((index + 1) % count, kept + 1);
        }
        index %= ring.len();
    }
    ring
}

/// How far a place lies off the line through two others, in quanta.
fn off_line(at: At, a: At, b: At) -> f64 {
    let long = length(a, b);
    let cross = cross(a, b, at) as f64;
    if long == 0.0 { length(a, at) } else { cross.abs() / long }
}

fn cross(a: At, b: At, at: At) -> i64 {
    let run = |to: At, axis: usize| i64::from(to[axis]) - i64::from(a[axis]);
    run(b, 0) * run(at, 1) - run(b, 1) * run(at, 0)
}

/// The step without the wall that begins at a corner: its neighbours are drawn out until they meet, no farther than a
/// corner may move.
fn without_wall(ring: &[At], index: usize) -> Option<Step> {
    let [a, b, c, d] = corners_from(ring, index);
    let meets = meeting([a, b], [d, c]).filter(|at| [b, c].iter().all(|&was| length(was, *at) <= MOVE_M_MAX * METRE));
    // Where the neighbours are parallel, the wall is a jog: both of its corners become the one between them.
    let middle = [0, 1].map(|axis| b[axis] + (c[axis] - b[axis]) / 2);
    let at = meets.or((length(b, c) <= 2.0 * MOVE_M_MAX * METRE).then_some(middle))?;
    Some(Step::of(ring, index, 2, Some(at)))
}

/// The step without the jog that begins at a corner, between parallel walls: the shorter one comes onto the line of the
/// longer one.
fn without_jog(ring: &[At], index: usize) -> Option<Step> {
    let count = ring.len();
    if count < 6 {
        return None;
    }
    let [a, b, c, d] = corners_from(ring, index);
    if meeting([a, b], [d, c]).is_some() {
        return None;
    }
    let is_first = length(c, d) <= length(a, b);
    let [before, beyond] = [ring[(index + count - 2) % count], ring[(index + 3) % count]];
    let at = if is_first { meeting([a, b], [beyond, d])? } else { meeting([d, c], [before, a])? };
    let from = if is_first { index } else { (index + count - 1) % count };
    Some(Step::of(ring, from, 3, Some(at)))
}

/// The step without a corner.
fn without_corner(ring: &[At], index: usize) -> Option<Step> {
    (4 < ring.len()).then(|| Step::of(ring, index, 1, None))
}

/// The corner before one, that one and the next two.
fn corners_from(ring: &[At], index: usize) -> [At; 4] {
    [ring.len() - 1, 0, 1, 2].map(|step| ring[(index + step) % ring.len()])
}

/// Where two lines meet, each through two places.
fn meeting([a, b]: [At; 2], [c, d]: [At; 2]) -> Option<At> {
    let run = |from: At, to: At| [0, 1].map(|axis| f64::from(to[axis]) - f64::from(from[axis]));
    let (u, v, w) = (run(a, b), run(c, d), run(a, c));
    let across = u[0] * v[1] - u[1] * v[0];
    if across.abs() < 0.05 * length(a, b) * length(c, d) {
        return None;
    }
    let share = (w[0] * v[1] - w[1] * v[0]) / across;
    Some([0, 1].map(|axis| (f64::from(a[axis]) + share * u[axis]).round() as i32))
}

/// The least rectangle around a ring that has a side along one of its walls.
fn least_rectangle(ring: &[At]) -> Ring {
    let mut best: Option<(f64, Ring)> = None;
    for (a, b) in edges(ring).filter(|(a, b)| a != b) {
        let along = [0, 1].map(|axis| (f64::from(b[axis]) - f64::from(a[axis])) / length(a, b));
        let place = |at: At| [0, 1].map(|axis| f64::from(at[axis]) - f64::from(a[axis]));
        let forth = |at: At| place(at)[0] * along[0] + place(at)[1] * along[1];
        let left = |at: At| place(at)[1] * along[0] - place(at)[0] * along[1];
        let span = |of: &dyn Fn(At) -> f64| {
            ring.iter().fold([f64::MAX, f64::MIN], |[low, high], &at| [low.min(of(at)), high.max(of(at))])
        };
        let (x, y) = (span(&forth), span(&left));
        let area = (x[1] - x[0]) * (y[1] - y[0]);
        if best.as_ref().is_none_or(|(least, _)| area < *least) {
            let corner = |x: f64, y: f64| {
                let at = [x * along[0] - y * along[1], x * along[1] + y * along[0]];
                [0, 1].map(|axis| (f64::from(a[axis]) + at[axis]).round() as i32)
            };
            let corners = [corner(x[0], y[0]), corner(x[1], y[0]), corner(x[1], y[1]), corner(x[0], y[1])];
            best = Some((area, corners.to_vec()));
        }
    }
    best.map(|(_, ring)| ring).unwrap_or_else(|| {
        let [[west, south], [east, north]] = bounds(&vec![ring.to_vec()]);
        vec![[west, south], [east, south], [east, north], [west, north]]
    })
}

/// The plans of a wood whose border stays within so many quanta of what it was, without clearings and woods whose
/// doubled area is less than `least`.
pub(super) fn smoothed(plan: &Plan, within: f64, least: i64) -> Vec<Plan> {
    let rings: Plan = plan.iter().map(|ring| thinned(ring, within)).filter(|ring| 3 <= ring.len()).collect();
    let mut plans = sorted_out(rings);
    for plan in &mut plans {
        let mut index = 0;
        plan.retain(|ring| {
            index += 1;
            index == 1 || least <= ring_area(ring).abs()
        });
    }
    plans.retain(|plan| least <= doubled_area(plan));
    plans
}

/// A ring of fewer places, none of those left out farther than `within` from it (Douglas and Peucker, from the two
/// places that are farthest west and farthest from that).
fn thinned(ring: &[At], within: f64) -> Ring {
    let far = (0..ring.len()).max_by(|&a, &b| length(ring[0], ring[a]).total_cmp(&length(ring[0], ring[b])));
    let Some(far) = far.filter(|far| 0 < *far) else { return ring.to_vec() };
    let closed: Ring = ring.iter().copied().chain([ring[0]]).collect();
    let mut keeps = vec![false; closed.len()];
    let mut open = vec![(0, far), (far, ring.len())];
    while let Some((from, to)) = open.pop() {
        (keeps[from], keeps[to]) = (true, true);
        let off = |index: usize| off_segment(closed[index], closed[from], closed[to]);
        let most = (from + 1..to).max_by(|&a, &b| off(a).total_cmp(&off(b)).then(b.cmp(&a)));
        if let Some(most) = most.filter(|&most| within < off(most)) {
            open.extend([(from, most), (most, to)]);
        }
    }
    let kept = ring.iter().zip(&keeps).filter(|(_, keeps)| **keeps);
    kept.map(|(&at, _)| at).collect()
}

/// How far a place is from a segment, in quanta.
fn off_segment(at: At, a: At, b: At) -> f64 {
    let run = |to: At, axis: usize| f64::from(to[axis]) - f64::from(a[axis]);
    let ahead = run(b, 0) * run(at, 0) + run(b, 1) * run(at, 1);
    let long = length(a, b);
    if ahead <= 0.0 {
        length(a, at)
    } else if long * long <= ahead {
        length(b, at)
    } else {
        off_line(at, a, b)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const M: i32 = METRE as i32;

    fn ring(places: &[[i32; 2]]) -> Ring {
        places.iter().map(|at| at.map(|metres| metres * M)).collect()
    }

    #[test]
    fn a_jog_and_a_bay_go_and_right_angles_stay() {
        // 20 x 10 m with a bay of half a metre on its southern side.
        let bay = vec![vec![
            [0, 0],
            [8 * M, 0],
            [8 * M, -M / 2],
            [11 * M, -M / 2],
            [11 * M, 0],
            [20 * M, 0],
            [20 * M, 10 * M],
            [0, 10 * M],
        ]];
        let plain = fewer(&bay, 4);
        assert_eq!(plain[0].len(), 4);
        let area = ring_area(&plain[0]) as f64 / f64::from(2 * M * M);
        assert!((area - 201.5).abs() < 20.0, "{area}");
        assert_eq!(fewer(&bay, 15), bay, "what fits stays");
    }

    #[test]
    fn what_has_too_many_corners_keeps_its_shape() {
        // A comb of eight teeth, 3 m wide and 6 m long, on a back of 4 m: no corner can go within a metre.
        let teeth = (0..8).flat_map(|k| [[6 * k, 4], [6 * k, 10], [6 * k + 3, 10], [6 * k + 3, 4]]);
        let comb: Ring =
            ring(&[[45, 0], [0, 0]].into_iter().chain(teeth).collect::<Vec<_>>()).into_iter().rev().collect();
        let area = |plan: &Plan| doubled_area(plan) as f64 / f64::from(2 * M * M);
        let plain = fewer(&vec![comb.clone()], 15);
        let corners: usize = plain.iter().map(Vec::len).sum();
        assert!((10..=15).contains(&corners), "{corners} corners");
        assert!((area(&plain) / area(&vec![comb.clone()]) - 1.0).abs() < 0.25, "{} m2", area(&plain));
        let is_right = |ring: &Ring| edges(ring).all(|(a, b)| a[0] == b[0] || a[1] == b[1]);
        assert!(plain.iter().all(is_right), "right angles stay: {plain:?}");
        // A wing of 20 m by 5 m around three sides of a yard is no rectangle, either.
        let wings = ring(&[[0, 0], [20, 0], [20, 20], [15, 20], [15, 5], [5, 5], [5, 20], [0, 20]]);
        assert!((area(&fewer(&vec![wings], 6)) - 250.0).abs() < 80.0);
    }

    #[test]
    fn courtyards_stay_where_corners_allow_it() {
        let outer = ring(&[[0, 0], [30, 0], [30, 30], [0, 30]]);
        let hole = |at: i32, side: i32| ring(&[[at, at], [at, at + side], [at + side, at + side], [at + side, at]]);
        let plan = vec![outer.clone(), hole(3, 4), hole(10, 9)];
        assert_eq!(fewer(&plan, 15).len(), 3);
        assert_eq!(fewer(&plan, 8), vec![outer.clone(), hole(10, 9)]);
        assert_eq!(fewer(&plan, 7), vec![outer]);
    }

    #[test]
    fn a_wood_loses_small_clearings_and_fine_bends() {
        let mut outer = ring(&[[0, 0], [100, 0], [100, 100], [0, 100]]);
        outer.insert(1, [50 * M, M]);
        let hole = |at: i32, side: i32| ring(&[[at, at], [at, at + side], [at + side, at + side], [at + side, at]]);
        let least = 2 * i64::from(M) * i64::from(M) * 400;
        let smooth = smoothed(&vec![outer, hole(10, 10), hole(40, 30)], 2.0 * METRE, least);
        assert_eq!(smooth.len(), 1);
        assert_eq!(smooth[0].iter().map(Vec::len).collect::<Vec<_>>(), [4, 4]);
        assert!(smoothed(&vec![hole(0, 10).into_iter().rev().collect()], 2.0 * METRE, least).is_empty());
    }
}
