//! Choices of a job that a stage takes as they are; `job` gives them their words.

/// How much work the optimised method does on one tile.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Effort {
    /// From one and a half times the budget, thinned; what is left is moved and edges are flipped.
    Fast,
    /// From two and a half times the budget, thinned by true cost; flips that pay once their vertices have moved.
    Normal,
    /// As normal, and cycles of growing and thinning.
    Best,
}

/// Which vertices leave the height of the DEM. Those on the outer border of an area and the corners of tiles never
/// do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum HeightFit {
    /// All that may: each stands where squared residuals are least.
    Squares,
    /// None.
    Off,
}

/// Where finished vertices stand; those on lines between tiles stand on posts either way.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Lattice {
    /// On eighths of a post.
    Eighth,
    /// On posts.
    Post,
}

/// What becomes of a batch of the paper's method that exceeds the budget.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LastBatch {
    /// The budget is met exactly, in row order.
    Truncate,
    /// The batch goes in whole.
    Finish,
}

/// What the rank of a tile is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TileOrder {
    /// (colour, row, column) with four colours: a quarter of the tiles can run at once.
    Color,
    /// (row, column): a wave front.
    Raster,
}

/// How a height between posts of a source comes about.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Resampling {
    /// From the four posts around it.
    Bilinear,
    /// From the sixteen posts around it, where all have heights: a smooth surface through the posts.
    Cubic,
}

/// How the borders between weights are softened.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Smooth {
    /// The separable 7-tap binomial \[1 6 15 20 15 6 1\]/64, clamped at the borders of the area.
    Binomial7,
    /// Not at all: every post has the weight of its class.
    None,
}

/// What becomes of the vertices on the sides of a load module at coarser levels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LodBorder {
    /// All of them stay: neighbours fit together at any two levels.
    Full,
    /// A level keeps its share of each side's, the ends always: neighbours fit together at the same level.
    Own,
}
