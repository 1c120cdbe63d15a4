//! Heights and weights of a rectangle of posts.

use terrain::{Dem, Importance, Post, PostRect};

use crate::ground::area::GamingArea;
use crate::ground::given::GivenPost;

/// The ground of a rectangle of posts.
#[derive(Clone)]
pub struct Window {
    /// Heights.
    pub dem: Dem,
    /// Weights and classes.
    pub importance: Importance,
    /// Posts that the job gives, of a tile's own window; none of any other.
    pub given: Vec<GivenPost>,
    /// Posts of such a window that it forbids.
    pub forbidden: Vec<Post>,
    /// Posts that features lie on, or whose heights they have changed; in ascending order.
    pub featured: Vec<Post>,
}

impl Window {
    /// Heights and weights of a rectangle.
    pub(crate) fn of(dem: Dem, importance: Importance) -> Self {
        Self { dem, importance, given: Vec::new(), forbidden: Vec::new(), featured: Vec::new() }
    }

    /// One window of several that cover it together and agree about the posts that they share.
    pub(crate) fn joined(rect: PostRect, parts: &[&Self]) -> Self {
        let dems: Vec<_> = parts.iter().map(|part| &part.dem).collect();
        let masks: Vec<_> = parts.iter().map(|part| &part.importance).collect();
        Self::of(Dem::joined(rect, &dems), Importance::joined(rect, &masks))
    }

    /// What load modules of this rectangle are measured against.
    pub fn measured(&self, area: &GamingArea) -> fidelity::Reference<'_> {
        let spacing = area.frame.spacing;
        fidelity::Reference { dem: &self.dem, mask: &self.importance, grid: area.grid, spacing }
    }
}
