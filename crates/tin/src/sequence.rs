//! What happened while a tile was refined: selected posts, refusals, and who wants to know.

use terrain::geometry::LocalPost;
use terrain::{ModuleId, PostRect, Refusal, RefusedBy};

/// Told of every post as it is selected, with the gain that selected it.
pub(crate) trait Witness {
    fn selected(&mut self, post: LocalPost, gain: f64);

    /// Told, where the job asks for an RMS residual, what the sum of squared residuals has come to.
    fn squares(&mut self, _sum: f64) {}
}

/// Witnesses nothing.
pub(crate) struct Unwatched;

impl Witness for Unwatched {
    fn selected(&mut self, _post: LocalPost, _gain: f64) {}
}

/// The record of one run.
#[derive(Default)]
pub(crate) struct Sequence {
    pub posts: Vec<LocalPost>,
    /// Absolute residual (quanta) at which each post was selected.
    pub residuals: Vec<u32>,
    pub refused: Vec<Refusal>,
}

impl Sequence {
    /// Whether as many points are in as may be.
    pub fn is_full(&self, points: Option<usize>) -> bool {
        points.is_some_and(|points| points <= self.posts.len())
    }

    /// Notes a refusal.
    pub fn refuse(&mut self, tile: PostRect, post: LocalPost, residual: u32, (module, by): (ModuleId, RefusedBy)) {
        self.refused.push(Refusal { post: post.post(tile), module, residual, by });
    }
}
