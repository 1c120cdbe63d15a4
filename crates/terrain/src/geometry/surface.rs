//! The ground under a working tile's triangles: heights, relief, and where candidates may lie.

use crate::Dem;

use crate::geometry::{Facet, LocalPost, LocalRect};

/// Posts a side of a working tile, at most: keeps the 64-bit in-circle test exact.
pub const WORKING_POSTS_MAX: usize = 16_384;

/// Heights of a working tile, addressed by packed posts.
#[derive(Clone, Copy, Debug)]
pub struct Surface<'a> {
    heights: &'a [i32],
    stride: usize,
    relief: i64,
    candidates: LocalRect,
    extent: LocalRect,
}

impl<'a> Surface<'a> {
    /// The whole window; every post may be a candidate.
    ///
    /// # Panics
    /// When the window has more than [`WORKING_POSTS_MAX`] posts a side.
    pub fn new(dem: &'a Dem) -> Self {
        let rect = dem.rect();
        let longest = rect.posts_wide().max(rect.posts_high());
        assert!(longest <= WORKING_POSTS_MAX, "a working tile has at most {WORKING_POSTS_MAX} posts a side");
        let (heights, stride) = dem.padded();
        let (lowest, highest) = dem.range();
        let extent = LocalRect { south: 0, west: 0, north: rect.cells_high() as i32, east: rect.cells_wide() as i32 };
        Self { heights, stride, relief: i64::from(highest) - i64::from(lowest), candidates: extent, extent }
    }

    /// The same ground with candidates confined to `rect`: sides outside it belong to other tiles.
    pub fn with_candidates(self, rect: LocalRect) -> Self {
        Self { candidates: rect, ..self }
    }

    /// Where candidates may lie.
    #[inline(always)]
    pub(crate) fn candidates(&self) -> LocalRect {
        self.candidates
    }

    /// All posts.
    #[inline(always)]
    pub fn extent(&self) -> LocalRect {
        self.extent
    }

    /// Highest minus lowest height, in quanta.
    #[inline(always)]
    pub(crate) fn relief(&self) -> i64 {
        self.relief
    }

    /// Padded heights and posts between rows.
    #[inline(always)]
    pub(crate) fn rows(&self) -> (&'a [i32], usize) {
        (self.heights, self.stride)
    }

    /// Height at a post, in quanta.
    #[inline(always)]
    pub fn height(&self, post: LocalPost) -> i32 {
        self.heights[post.row() as usize * self.stride + post.col() as usize]
    }

    /// The triangle over three posts of the ground.
    #[inline(always)]
    pub fn facet(&self, corners: [LocalPost; 3]) -> Facet {
        Facet::new(corners.map(LocalPost::col), corners.map(LocalPost::row), corners.map(|post| self.height(post)))
    }
}
