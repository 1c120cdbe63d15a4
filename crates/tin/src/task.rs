//! What `refine` is asked to do for one tile.

use terrain::limits::{Allowance, ModuleLines, TileLedger};
use terrain::{LastBatch, ModuleId, Post, PostRect, SeamSides, TileId};

/// Everything about one tile's refinement but the ground itself.
#[derive(Clone, Debug, PartialEq)]
pub struct TileTask {
    /// Which tile.
    pub tile: TileId,
    /// Its posts, seams included.
    pub rect: PostRect,
    /// What the tile starts from and what its edges must respect.
    pub frame: Frame,
    /// Border points on the area's outer border; part of every start.
    pub border: Vec<Post>,
    /// Border points that lower-ranked neighbours have chosen on the sides shared with them.
    pub inherited: Vec<Post>,
    /// Border points on this tile's own seams that must stay as its neighbours hold them: paid for by this tile.
    pub kept: Vec<Post>,
    /// Posts to start from beside those, in this order; none on a side that belongs to another tile.
    pub start: Vec<StartPost>,
    /// The sides on which this tile may choose posts.
    pub seams: SeamSides,
    /// Posts on its sides where no border point may stand, in ascending order: between the edges of a road that crosses
    /// the side (see [`terrain::Features::barred_posts`]). The paper's passes do not ask.
    pub barred: Vec<Post>,
    /// Which post comes next.
    pub rule: Rule,
    /// When to stop.
    pub stop: Stop,
}

impl TileTask {
    /// Of a tile without load modules that nothing else is said of: closed sides, no points given, no end.
    pub fn plain(tile: TileId, rect: PostRect, rule: Rule) -> Self {
        Self {
            tile,
            rect,
            frame: Frame::Plain,
            border: Vec::new(),
            inherited: Vec::new(),
            kept: Vec::new(),
            start: Vec::new(),
            seams: SeamSides::CLOSED,
            barred: Vec::new(),
            rule,
            stop: Stop::default(),
        }
    }

    /// What the tile may spend, in posts from its south-west post, with room taken for inherited points and kept ones
    /// paid for; `None` where there are no limits.
    pub fn ledger(&self) -> Option<TileLedger> {
        let Frame::Sides { side_cells, south_west, allowance } = &self.frame else { return None };
        let along = |cells: usize| cells as u32 / *side_cells as u32;
        let (rows, cols) = (along(self.rect.cells_high()), along(self.rect.cells_wide()));
        let reach = allowance.modules;
        let lines = ModuleLines { side: *side_cells, south_west: *south_west, rows, cols, reach };
        let mut ledger = TileLedger::new(lines, allowance.clone());
        let local = |post: &Post| (post.row - self.rect.south, post.col - self.rect.west);
        self.inherited.iter().map(local).for_each(|(row, col)| ledger.inherit(row, col));
        self.kept.iter().map(local).for_each(|(row, col)| ledger.charge(row, col));
        let pinned = self.start.iter().filter(|start| start.pinned && self.is_charged(start.at));
        pinned.map(|start| local(&start.at)).for_each(|(row, col)| ledger.book(row, col));
        Some(ledger)
    }

    /// Whether a post that is given costs what a chosen one does: those that are there anyway cost nothing.
    pub(crate) fn is_charged(&self, post: Post) -> bool {
        ![&self.border, &self.inherited, &self.kept].into_iter().any(|posts| posts.contains(&post))
    }
}

/// A post that a tile starts from because the job says so.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StartPost {
    /// The post.
    pub at: Post,
    /// Whether it is in whatever limits say; others are refused like any post.
    pub pinned: bool,
}

/// What a tile starts from.
#[derive(Clone, Debug, PartialEq)]
pub enum Frame {
    /// The tile's four corners; there are no load modules.
    Plain,
    /// Every load-module corner is a vertex; edges are free to cross sides and are clipped later.
    Corners {
        /// Cells along a side of a load module.
        side_cells: i32,
    },
    /// Load-module sides are edges from the start, and no limit is ever exceeded.
    Sides {
        /// Cells along a side of a load module.
        side_cells: i32,
        /// The tile's south-west load module.
        south_west: ModuleId,
        /// What the tile may spend.
        allowance: Allowance,
    },
}

/// Which post comes next.
#[derive(Clone, Debug, PartialEq)]
pub enum Rule {
    /// The one post of largest weighted residual (ties: first by row, then column).
    WorstFirst,
    /// The worst post of the triangle with the largest sum of squared weighted residuals; first of all
    /// every post whose weighted residual exceeds `guard` (see [`Stop::value`] for its unit).
    LargestSquares {
        /// Weighted residual above which a post goes before all sums; `None` to go by sums only.
        guard: Option<u64>,
    },
    /// The paper's passes: all posts of exactly the largest weighted residual, thinned by proximity.
    Batches {
        /// Residuals are rounded to this many quanta before they are compared (128 is 1 m).
        residual_quantum: u32,
        /// Candidates near a vertex wait; `None` to take every candidate.
        proximity: Option<Proximity>,
        /// What happens when a pass has more candidates than points are left.
        last_batch: LastBatch,
    },
}

/// A cylinder around each vertex in which no candidate is taken; both bounds are inside it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Proximity {
    /// Horizontal radius in posts.
    pub posts: f64,
    /// Vertical reach in quanta.
    pub quanta: u32,
}

/// When a tile stops selecting, whichever comes first; it also stops when its allowance is spent or
/// nothing is left to select.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Stop {
    /// Selected points; initial ones do not count.
    pub points: Option<usize>,
    /// Largest weighted residual: weight in thousandths times the residual in units of the rule's
    /// residual quantum (1/128 m unless the rule says otherwise).
    pub value: Option<u64>,
    /// RMS residual over all posts of the tile, in quanta.
    pub rms_quanta: Option<f64>,
}
