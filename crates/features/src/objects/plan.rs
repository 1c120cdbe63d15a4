//! Measures of plans.

pub use terrain::plans::{At, Plan, Ring};

/// Quanta of a metre.
pub(super) const METRE: f64 = terrain::QUANTA_PER_METRE as f64;
/// Places beyond this, either way, are not computed with: 4,194 km.
pub(super) const FAR: i32 = 1 << 29;

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
