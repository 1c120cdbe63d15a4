//! What may not change about a vertex.

/// What may not change about a vertex.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub(crate) struct Hold(u8);

impl Hold {
    pub const FREE: Self = Self(0);
    /// It stays on its line of constant x.
    pub const COLUMN: Self = Self(1);
    /// It stays on its line of constant y.
    pub const ROW: Self = Self(2);
    /// It neither moves nor goes.
    pub const PLACE: Self = Self(4);
    /// It keeps its height.
    pub const HEIGHT: Self = Self(8);
    /// It stands at the DEM's height wherever it moves.
    pub const ON_GROUND: Self = Self(16);
    /// It is an end of an edge that stays.
    pub const FEATURE: Self = Self(32);
    /// Neither place nor height is the optimiser's to choose.
    pub const GIVEN: Self = Self(4 | 8);

    pub const fn and(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }

    #[inline(always)]
    pub const fn has(self, other: Self) -> bool {
        self.0 & other.0 != 0
    }

    /// Whether it may neither move nor be removed: held, or a corner of load modules.
    #[inline(always)]
    pub const fn is_fixed(self) -> bool {
        self.has(Self::PLACE) || self.is_corner()
    }

    #[inline(always)]
    const fn is_corner(self) -> bool {
        self.0 & 3 == 3
    }

    /// Whether it lies on a line and may move along it.
    #[inline(always)]
    pub const fn is_on_line(self) -> bool {
        self.0 & 3 != 0
    }

    /// Whether its height is free to be fitted.
    #[inline(always)]
    pub const fn height_is_free(self) -> bool {
        !self.has(Self::HEIGHT) && !self.has(Self::ON_GROUND)
    }
}
