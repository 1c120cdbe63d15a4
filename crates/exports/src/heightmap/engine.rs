//! Game engines, and the sizes of heightmaps that they take.

/// Whose import the tiles are for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Engine {
    /// PNG, the northern row first; tiles count from the north-west.
    Unreal,
    /// RAW, little-endian, the southern row first; tiles count from the south-west.
    Unity,
}

impl Engine {
    /// The sides of a tile that the engine takes, in samples.
    pub fn sizes(self) -> &'static [usize] {
        match self {
            Engine::Unreal => &[127, 253, 505, 1009, 2017, 4033, 8129],
            Engine::Unity => &[33, 65, 129, 257, 513, 1025, 2049, 4097],
        }
    }

    /// The least size with which one tile holds so many samples a side; else the one that is handled well.
    pub(crate) fn size_for(self, samples: usize) -> usize {
        let many = match self {
            Engine::Unreal => 2017,
            Engine::Unity => 2049,
        };
        self.sizes().iter().copied().find(|&size| samples <= size).unwrap_or(many)
    }
}
