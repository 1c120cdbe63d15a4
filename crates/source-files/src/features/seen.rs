//! How a stretch of one coordinate system lies in another.

use super::clip::{Extent, Vertex};
use crate::crs::Crs;

/// A place on a segment between two vertices, the same whichever way the segment is digitised.
pub(super) fn between(from: Vertex, to: Vertex, step: u32, pieces: u32) -> Vertex {
    let (from, to, step) = if to[..2] < from[..2] { (to, from, pieces - step) } else { (from, to, step) };
    let share = f64::from(step) / f64::from(pieces);
    [0, 1, 2].map(|axis| from[axis] + share * (to[axis] - from[axis]))
}

/// A rectangle of the system `from` as it lies in another: the one round its border, with some more, or everywhere
/// where a part of it cannot be expressed.
pub(super) fn seen_in(from: &Crs, to: &Crs, extent: &Extent) -> Extent {
    const STEPS: u32 = 32;
    let mut seen = Extent::NOTHING;
    for step in 0..=STEPS {
        let share = f64::from(step) / f64::from(STEPS);
        let along = |side: [f64; 2]| side[0] + share * (side[1] - side[0]);
        for side in 0..2 {
            for place in [[along(extent.east), extent.north[side]], [extent.east[side], along(extent.north)]] {
                match from.to(to, place) {
                    Some(place) => seen.hold(place),
                    None => return Extent::ALL,
                }
            }
        }
    }
    // Sides bend between the places that were looked at.
    let widest = (seen.east[1] - seen.east[0]).max(seen.north[1] - seen.north[0]);
    seen.grown(0.05 * widest)
}
