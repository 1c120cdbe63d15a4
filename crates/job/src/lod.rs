//! Levels of detail, as a job asks for them.

use terrain::LodBorder;

/// Coarser levels of load modules.
#[derive(Clone, Debug, PartialEq)]
pub struct LodSpec {
    /// For each level beside the finest, the share of the finest level's inner vertices that it keeps; strictly
    /// falling, between 0 and 1.
    pub inner_shares: Vec<f64>,
    /// What becomes of the vertices on the sides.
    pub border: LodBorder,
    /// For each of these levels, the classes of features that it leaves out; a coarser one leaves out those of finer
    /// ones, too.
    pub leave_out: Vec<Vec<String>>,
}

impl LodSpec {
    /// Whether any level leaves out features.
    pub fn leaves_out(&self) -> bool {
        self.leave_out.iter().any(|classes| !classes.is_empty())
    }

    /// Levels of a load module, the finest included.
    pub fn level_count(&self) -> usize {
        1 + self.inner_shares.len()
    }
}
