//! What refining made of one tile.

use serde::{Deserialize, Serialize};

use crate::numbered::numbered;
use crate::{ModuleId, Post, TileId, Tin};

/// The TIN of one tile, as `refine` publishes it. Nothing after it moves a vertex.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TileTin {
    /// Which tile.
    pub tile: TileId,
    /// The initial vertices, then the others: in the order in which they were selected or, where they were optimised,
    /// by row and column.
    pub tin: Tin,
    /// How many of the vertices were there before selection began: corners, load-module corners, border
    /// points, inherited points.
    pub initial_count: u32,
    /// Residual (absolute, in quanta) at which each selected vertex was inserted, in order; empty where the TIN was
    /// optimised, since no vertex is then where it was inserted.
    pub residuals: Vec<u32>,
    /// Triangles charged to this tile: its own points, in every load module they touch.
    pub triangles_charged: u32,
    /// Posts that a limit kept out, largest residual first.
    pub refused: Vec<Refusal>,
    /// Why selection ended.
    pub stop: StopReason,
}

/// A post that would have been inserted next, had a limit not stood in the way.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Refusal {
    /// The refused post.
    pub post: Post,
    /// The load module whose limit, or whose window's limit, it would have exceeded.
    pub module: ModuleId,
    /// Absolute residual at the post, in quanta, when it was refused.
    pub residual: u32,
    /// Which limit.
    pub by: RefusedBy,
}

/// The limit that refused a post.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum RefusedBy {
    /// The limit of a load module.
    Module,
    /// The limit of a window of load modules.
    Window,
    /// What the neighbour's load module keeps free on its inherited side.
    Reservation,
}

/// Why a tile stopped selecting posts.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum StopReason {
    /// All points or triangles allotted to the tile are spent.
    BudgetSpent,
    /// The largest residual is within the tolerance.
    ResidualReached,
    /// The RMS residual is within the target.
    RmsReached,
    /// No selectable post is left: every residual is zero, masked or refused.
    Exhausted,
}

impl RefusedBy {
    /// All of them, by their numbers in files.
    pub const ALL: [Self; 3] = [Self::Module, Self::Window, Self::Reservation];
}

impl StopReason {
    /// All of them, by their numbers in files.
    pub const ALL: [Self; 4] = [Self::BudgetSpent, Self::ResidualReached, Self::RmsReached, Self::Exhausted];
}

numbered!(RefusedBy);
numbered!(StopReason);
