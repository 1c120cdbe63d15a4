//! What the optimiser is asked to do.

use limits::TileLedger;
use terrain::{Features, LatticePoint, Post, SeamSides};

/// How much time to spend on one tile.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Effort {
    /// Moves and flips only.
    Fast,
    /// From twice the budget, thinned by true cost, and exchange.
    Normal,
    /// As normal from three times the budget, and cycles of growing and thinning.
    Best,
}

/// How heights are chosen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum HeightFit {
    /// Least squares everywhere.
    Squares,
    /// Least squares, but vertices at ridges stand at the DEM's height, so that crests keep hiding what they hide.
    SquaresKeepCrests,
    /// Every vertex stands at the DEM's height.
    Off,
}

/// Where finished vertices stand.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Lattice {
    /// On eighths of a post; on the tile's border, on posts.
    Eighth,
    /// On posts.
    Post,
}

/// What the finished mesh may have.
#[derive(Clone, Debug)]
pub enum Budget {
    /// So many triangles.
    Triangles(usize),
    /// So many vertices.
    Vertices(usize),
    /// What the limits of load modules permit: what is left for vertices that are not held.
    Limits(TileLedger),
}

/// Everything about one tile's optimisation but its ground and the TIN it starts from.
#[derive(Clone, Debug)]
pub struct Task {
    /// Vertices that keep place and height.
    pub held: Vec<LatticePoint>,
    /// Posts that no vertex may come nearer to than to any other post, in ascending order; candidates they are none.
    pub forbidden: Vec<Post>,
    /// Vertices and edges that the TIN has to keep, those of the tile only. What the budget permits comes on top of them
    /// where it is one of limits, and counts them where it is a number.
    pub features: Features,
    /// Sides on which vertices may be chosen; those on the others are held, too.
    pub open: SeamSides,
    /// Posts between lines that edges may not cross; `None` where only the tile's border is one.
    pub line_step: Option<i32>,
    /// What the mesh may have in the end.
    pub budget: Budget,
    /// How much time to spend.
    pub effort: Effort,
    /// How heights are chosen.
    pub height_fit: HeightFit,
    /// Where finished vertices stand.
    pub lattice: Lattice,
    /// An RMS residual (quanta, over all posts) that is good enough: no more is spent than reaches it.
    pub rms_quanta: Option<f64>,
    /// A weighted residual (quanta) that no candidate post may exceed, as far as the budget goes.
    pub largest_quanta: Option<f64>,
}
