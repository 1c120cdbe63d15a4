//! Heights and weights of a rectangle of posts.

use terrain::{Dem, Importance, Post};

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
    /// What load modules of this rectangle are measured against.
    pub fn measured(&self, area: &GamingArea) -> fidelity::Reference<'_> {
        let spacing = area.frame.spacing;
        fidelity::Reference { dem: &self.dem, mask: &self.importance, grid: area.grid, spacing }
    }
}
