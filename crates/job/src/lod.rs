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
}

impl LodSpec {
    /// Levels of a load module, the finest included.
    pub fn level_count(&self) -> usize {
        1 + self.inner_shares.len()
    }
}
