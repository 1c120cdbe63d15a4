//! Exact operations on plans: outlines with holes, whose places are whole quanta. All of them are those of
//! `i_overlay` and `i_triangle`, which compute in whole numbers; what covers a place is put into one order.

use i_overlay::core::fill_rule::FillRule;
use i_overlay::core::overlay::{Overlay, ShapeType};
use i_overlay::core::overlay_rule::OverlayRule;
use i_overlay::i_float::int::point::IntPoint;
use i_triangle::int::triangulatable::IntTriangulatable;

/// East and north in quanta.
pub type At = [i32; 2];
/// A closed line; the last place is joined to the first.
pub type Ring = Vec<At>;
/// The outer ring counter-clockwise, then holes clockwise.
pub type Plan = Vec<Ring>;

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
pub fn sorted_out(rings: Plan) -> Vec<Plan> {
    run(&[rings], &[], OverlayRule::Subject, FillRule::EvenOdd)
}

/// All that any of the plans covers.
pub fn union(plans: &[Plan]) -> Vec<Plan> {
    run(plans, &[], OverlayRule::Subject, FillRule::NonZero)
}

/// What the first cover and the others do not.
pub fn difference(subject: &[Plan], clip: &[Plan]) -> Vec<Plan> {
    run(subject, clip, OverlayRule::Difference, FillRule::NonZero)
}

/// What both cover.
pub fn common(subject: &[Plan], clip: &[Plan]) -> Vec<Plan> {
    run(subject, clip, OverlayRule::Intersect, FillRule::NonZero)
}

/// Places and triangles, counter-clockwise, that cover a plan exactly once: its outer ring counter-clockwise, then
/// holes clockwise, in whole quanta. Places of several triangles are there once.
pub fn triangles(plan: &[Ring]) -> (Vec<At>, Vec<[u32; 3]>) {
    let shape: Vec<Vec<IntPoint<i32>>> = plan.iter().map(|ring| to_points(ring)).collect();
    let made = shape.triangulate().to_triangulation::<u32>();
    (made.points.iter().map(|at| [at.x, at.y]).collect(), made.indices.as_chunks().0.to_vec())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn triangles_cover_a_plan_with_a_hole_once() {
        let outer = vec![[0, 0], [100, 0], [100, 100], [50, 20], [0, 100]];
        let hole = vec![[10, 10], [10, 20], [20, 20], [20, 10]];
        let (places, made) = triangles(&[outer, hole]);
        let doubled = |[a, b, c]: [u32; 3]| {
            let [a, b, c] = [a, b, c].map(|at| places[at as usize]);
            (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
        };
        assert!(made.iter().all(|&triangle| 0 < doubled(triangle)));
        assert_eq!(made.iter().map(|&triangle| doubled(triangle)).sum::<i32>(), 2 * (10_000 - 4_000 - 100));
    }
}
