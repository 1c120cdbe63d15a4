//! The lattice that features are laid out on: nodes every 100 m, in squares of 12.8 km.

/// Metres from the terrain's origin, east and north, to the corner of the lattice: a sample area at the origin then
/// lies well inside one cell of roads.
const CORNER_M: f64 = -6_400.0;
/// Metres between nodes.
pub(super) const STEP_M: f64 = 100.0;
/// Steps a side of a square.
pub(super) const SIDE: i64 = 128;
/// Nodes a side of a square, those of all four borders included.
pub(super) const NODES: usize = SIDE as usize + 1;

/// A node of the lattice: steps east and north of its corner.
pub(super) type Node = (i64, i64);

/// Where a node lies, in metres from the terrain's origin.
pub(super) fn place((east, north): Node) -> [f64; 2] {
    [CORNER_M + east as f64 * STEP_M, CORNER_M + north as f64 * STEP_M]
}

/// The numbers of the cells of `side` steps that a span of metres touches.
pub(super) fn cells(from_m: f64, to_m: f64, side: i64) -> std::ops::RangeInclusive<i64> {
    let cell = |place_m: f64| ((place_m - CORNER_M) / (STEP_M * side as f64)).floor() as i64;
    cell(from_m)..=cell(to_m)
}

/// A square of ground.
#[derive(Debug)]
pub(super) struct Square {
    /// Metres at its nodes before playas are filled, row-major from the south-west.
    pub(super) raw_m: Vec<f32>,
    /// Metres at its nodes.
    pub(super) height_m: Vec<f32>,
}

impl Square {
    /// Whether a node lies in a playa.
    pub(super) fn is_playa(&self, at: usize) -> bool {
        self.raw_m[at] < self.height_m[at]
    }
}
