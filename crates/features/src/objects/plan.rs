//! Exact operations on plans: outlines with holes, whose places are whole quanta. All of them are those of
//! `i_overlay`, which computes in whole numbers; its results are put into one order.

use i_overlay::core::fill_rule::FillRule;
use i_overlay::core::overlay::{Overlay, ShapeType};
use i_overlay::core::overlay_rule::OverlayRule;
use i_overlay::i_float::int::point::IntPoint;

/// Quanta of a metre.
pub(super) const METRE: f64 = terrain::QUANTA_PER_METRE as f64;
/// East and north in quanta.
pub type At = [i32; 2];
/// A closed line; the last place is joined to the first.
pub type Ring = Vec<At>;
/// The outer ring counter-clockwise, then holes clockwise.
pub type Plan = Vec<Ring>;

/// Places beyond this, either way, are not computed with: 4,194 km.
pub(super) const FAR: i32 = 1 << 29;

fn to_points(ring: &[At]) -> Vec<IntPoint<i32>> {
    ring.iter().map(|&[x, y]| IntPoint::new(x, y)).collect()
}

fn run(subject: &[Plan], clip: &[Plan], rule: OverlayRule, fill: FillRule) -> Vec<Plan> {
    let all = || subject.iter().chain(clip).flatten();
    let mut overlay = Overlay::<i32>::new(all().map(Vec::len).sum());
    for (plans, role) in [(subject, ShapeType::Subject), (clip, ShapeType::Clip)] {
        plans.iter().flatten().for_each(|ring| overlay.add_contour(&to_points(ring), role));
    }
    let shapes = overlay.overlay(rule, fill);
    let plan = |shape: Vec<Vec<IntPoint<i32>>>| -> Plan {
        let mut rings: Plan = shape.into_iter().map(|ring| from_least(ring.iter().map(|at| [at.x, at.y]))).collect();
        rings[1..].sort();
        rings
    };
    let mut plans: Vec<Plan> = shapes.into_iter().map(plan).filter(|plan| 3 <= plan[0].len()).collect();
    plans.sort();
    plans
}

/// The same ring from its least place on.
fn from_least(ring: impl Iterator<Item = At>) -> Ring {
    let mut ring: Ring = ring.collect();
    let least = (0..ring.len()).min_by_key(|&index| ring[index]).unwrap_or(0);
    ring.rotate_left(least);
    ring
}

/// What rings enclose an odd number of times: a bow tie becomes two, a hole is one whichever way it runs.
pub(super) fn sorted_out(rings: Plan) -> Vec<Plan> {
    run(&[rings], &[], OverlayRule::Subject, FillRule::EvenOdd)
}

/// All that any of the plans covers.
pub(super) fn union(plans: &[Plan]) -> Vec<Plan> {
    run(plans, &[], OverlayRule::Subject, FillRule::NonZero)
}

/// What the first cover and the others do not.
pub(super) fn difference(subject: &[Plan], clip: &[Plan]) -> Vec<Plan> {
    run(subject, clip, OverlayRule::Difference, FillRule::NonZero)
}

/// What both cover.
pub(super) fn common(subject: &[Plan], clip: &[Plan]) -> Vec<Plan> {
    run(subject, clip, OverlayRule::Intersect, FillRule::NonZero)
}

/// Twice the area, holes taken off.
pub(super) fn doubled_area(plan: &Plan) -> i64 {
    plan.iter().map(|ring| ring_area(ring)).sum()
}

/// Twice the area a ring encloses, positive where it runs counter-clockwise.
pub(super) fn ring_area(ring: &[At]) -> i64 {
    let Some(&[east, north]) = ring.first() else { return 0 };
    let from = |[x, y]: At| [i64::from(x) - i64::from(east), i64::from(y) - i64::from(north)];
    edges(ring).map(|(a, b)| (from(a), from(b))).map(|(a, b)| a[0] * b[1] - a[1] * b[0]).sum()
}

/// From each place to the next, the last to the first.
pub(super) fn edges(ring: &[At]) -> impl Iterator<Item = (At, At)> {
    ring.iter().copied().zip(ring.iter().copied().cycle().skip(1))
}

/// Length of a way in quanta.
pub(super) fn length(a: At, b: At) -> f64 {
    let [x, y] = [0, 1].map(|axis| f64::from(b[axis]) - f64::from(a[axis]));
    (x * x + y * y).sqrt()
}

/// The least rectangle along the axes: south-west and north-east corner.
pub(super) fn bounds(plan: &Plan) -> [At; 2] {
    let of = |axis: usize| plan[0].iter().map(move |at| at[axis]);
    let least = |axis: usize| of(axis).min().unwrap_or(0);
    let most = |axis: usize| of(axis).max().unwrap_or(0);
    [[least(0), least(1)], [most(0), most(1)]]
}
