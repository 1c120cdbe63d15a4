//! What points gain, tile by tile, as the surveys say.

use terrain::GainCurve;

/// What the surveys say, the best first.
///
/// The curves of a large area do not fit into memory together, so they come in bands: each holds one curve per tile,
/// row-major, with all its runs on some steps of the ladder, which are higher than those of the next band. A band is
/// asked for when all before it have been taken.
pub struct Gains<'a> {
    /// The bands; costs in triangles, or in points where points are shared out.
    pub bands: &'a mut dyn Iterator<Item = Vec<GainCurve>>,
    /// Tiles from the lowest rank, by row-major place.
    pub by_rank: &'a [usize],
    /// Gains below this step of the ladder are not wanted: the RMS residual asked for is reached without them.
    pub floor: Option<i32>,
}

/// The highest rung among the next runs of all curves.
pub(crate) fn highest_rung(curves: &[GainCurve], next: &[usize]) -> Option<i32> {
    curves.iter().zip(next).filter_map(|(curve, &at)| Some(curve.runs.get(at)?.bin)).max()
}
