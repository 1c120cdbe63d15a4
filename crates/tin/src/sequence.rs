//! What happened while a tile was refined: selected posts, refusals, and who wants to know; and coarser levels, the
//! first vertices of the sequence.

use terrain::geometry::LocalPost;
use terrain::{LatticePoint, ModuleId, PostRect, Refusal, RefusedBy, TileTin, Tin};

/// Told of every post as it is selected, with the gain that selected it.
pub(crate) trait Witness {
    fn selected(&mut self, post: LocalPost, gain: f64);

    /// Told, where the job asks for an RMS residual, what the sum of squared residuals has come to.
    fn squares(&mut self, _sum: f64) {}

    /// Told at the end how much of that sum lies in triangles that no post may be chosen in.
    fn squares_left(&mut self, _sum: f64) {}
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

/// The TIN of the first `points` vertices, or of all where there are fewer: what growing would have been when it had so
/// many, because a TIN depends on its vertices only, and each was chosen without regard to those after it.
///
/// `grown` has its vertices in the order in which they were inserted, corners first, and no edges but Delaunay's.
///
/// # Panics
/// When `points` cut into the vertices that growing began with.
pub fn prefix(grown: &TileTin, points: usize) -> Tin {
    assert!(grown.initial_count as usize <= points, "a level holds what its TIN began with");
    let vertices = grown.tin.vertices[..points.min(grown.tin.vertices.len())].to_vec();
    let places: Vec<LatticePoint> = vertices.iter().map(|vertex| vertex.at).collect();
    Tin::new(grown.tin.rect, vertices, terrain::mesh::delaunay(&places))
}
