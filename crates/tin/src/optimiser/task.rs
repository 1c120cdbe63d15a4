//! What the optimiser is asked to do.

use terrain::limits::TileLedger;
use terrain::{Effort, Features, HeightFit, Importance, Lattice, LatticePoint, Post, SeamSides, Spacing};

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
    /// Vertices and edges that the TIN has to keep, those of the tile only. What the budget permits comes on top of
    /// them where it is one of limits, and counts them where it is a number.
    pub features: Features,
    /// How far posts are apart, where that is known: beside features no triangle may come that stands like a wall.
    pub spacing: Option<Spacing>,
    /// Sides on which vertices may be chosen; those on the others are held, too.
    pub open: SeamSides,
    /// Posts between lines that edges may not cross; `None` where only the tile's border is one.
    pub line_step: Option<i32>,
    /// What the mesh may have in the end.
    pub budget: Budget,
    /// What posts weigh where squares are counted, if that is other than what they weigh elsewhere: in the choice of
    /// posts, and for ends that are residuals.
    pub in_squares: Option<Importance>,
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
