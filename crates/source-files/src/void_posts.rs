//! Which posts of a window of a raster have no height.

/// Which posts of a window are void.
#[derive(Clone, Debug, Default)]
pub(crate) struct VoidPosts {
    /// One bit per post, row-major; empty when none is void.
    bits: Vec<u64>,
    pub count: usize,
    /// Whether void posts hold a height that keeps the mesh defined.
    pub settled: bool,
}

impl VoidPosts {
    /// None yet of so many posts, of which some will be.
    pub(crate) fn among(count: usize) -> Self {
        Self { bits: vec![0; count.div_ceil(64)], ..Self::default() }
    }

    pub(crate) fn contains(&self, index: usize) -> bool {
        !self.bits.is_empty() && self.bits[index / 64] >> (index % 64) & 1 == 1
    }

    pub(crate) fn mark(&mut self, index: usize) {
        self.bits[index / 64] |= 1 << (index % 64);
        self.count += 1;
    }

    pub(crate) fn clear(&mut self) {
        *self = Self { settled: true, ..Self::default() };
    }

    /// Indices of the void posts, ascending.
    pub(crate) fn iter(&self) -> impl Iterator<Item = usize> {
        let words = self.bits.iter().enumerate().filter(|&(_, &word)| word != 0);
        words
            .flat_map(|(place, &word)| (0..64).filter(move |bit| word >> bit & 1 == 1).map(move |bit| place * 64 + bit))
    }
}
