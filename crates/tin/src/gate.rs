//! Which posts the limits still permit.

use terrain::geometry::LocalPost;
use terrain::limits::TileLedger;
use terrain::{ModuleId, POINT_COST, RefusedBy};

/// What stands between a post and the TIN.
pub(crate) enum Gate {
    /// Nothing.
    Open,
    /// The limits of load modules and windows.
    Limits(TileLedger),
}

impl Gate {
    /// The load module and the limit that refuse `post`, if any do.
    pub fn refuses(&self, post: LocalPost) -> Option<(ModuleId, RefusedBy)> {
        let Gate::Limits(ledger) = self else { return None };
        ledger.refuses(post.row(), post.col())
    }

    /// Spends what `post` costs.
    pub fn charge(&mut self, post: LocalPost) {
        if let Gate::Limits(ledger) = self {
            ledger.charge(post.row(), post.col());
        }
    }

    /// Whether the tile cannot afford one more point.
    pub fn is_spent(&self) -> bool {
        matches!(self, Gate::Limits(ledger) if ledger.counts().left() < i64::from(POINT_COST))
    }

    /// Triangles spent so far.
    pub fn spent(&self) -> u32 {
        match self {
            Gate::Open => 0,
            Gate::Limits(ledger) => ledger.counts().spent(),
        }
    }
}
