//! The posts that triangles of a load module own, and what each counts.

use terrain::geometry::owned::{OwnedRows, PostGrid, visit_residuals};
use terrain::geometry::{Facet, height_bounds};
use terrain::{Dem, Importance, ModuleId, ModuleVertex, Post};

use crate::load_modules::Layout;

/// What levels are fitted to.
#[derive(Clone, Copy, Debug)]
pub struct LevelGround<'a> {
    /// Heights at all posts of the load module; voids count nothing.
    pub dem: &'a Dem,
    /// Weights and classes of the same posts.
    pub mask: &'a Importance,
}

/// The posts of one load module.
pub(super) struct Posts<'a> {
    grid: PostGrid,
    dem: &'a Dem,
    mask: &'a Importance,
    /// The largest weight; `None` where all posts count the same.
    weight_max: Option<u16>,
    whole: bool,
}

impl<'a> Posts<'a> {
    /// # Panics
    /// When the windows of `ground` do not hold the load module.
    pub fn new(id: ModuleId, layout: &Layout, ground: &LevelGround<'a>) -> Self {
        let (dem, mask) = (ground.dem, ground.mask);
        let rect = layout.grid.posts_of(id);
        assert!(dem.rect().contains_rect(&rect), "the DEM window holds load module {id}");
        assert!(mask.rect().contains_rect(&rect), "the mask window holds load module {id}");
        // Where no post has a weight, all are alike.
        let largest = || {
            let skipped = (rect.west - mask.rect().west) as usize;
            let weights = (rect.south..=rect.north).filter_map(|row| mask.weights_of_row(row));
            let own = weights.flat_map(|weights| &weights[skipped..skipped + rect.posts_wide()]);
            own.copied().max().filter(|&weight| 0 < weight)
        };
        let weight_max = if mask.uniform_weight().is_some() { None } else { largest() };
        let grid = PostGrid::of_module(layout.grid, id, layout.spacing);
        Self { grid, dem, mask, weight_max, whole: dem.void_count() == 0 }
    }

    /// Quanta between posts.
    pub fn step(&self) -> i64 {
        i64::from(self.grid.units_per_post)
    }

    /// The lowest and the highest height that a vertex of the load module may have.
    pub fn height_bounds(&self, vertex: ModuleVertex) -> (i32, i32) {
        let along = |post: i32, units: u16| i64::from(post) * self.step() + i64::from(units);
        let place = (along(self.grid.origin.row, vertex.y), along(self.grid.origin.col, vertex.x));
        height_bounds(self.dem, place, self.step())
    }

    fn counts(&self, post: Post) -> bool {
        self.whole || !self.dem.is_void(post)
    }

    /// Squared weighted residuals of the posts that a counter-clockwise triangle owns: an exact sum.
    pub fn squares(&self, corners: [ModuleVertex; 3]) -> u128 {
        let mut sum = 0;
        visit_residuals(&self.grid, &facet(corners), self.dem, |post, residual| {
            if self.counts(post) {
                let weight = self.weight_max.map_or(1, |_| u64::from(self.mask.weight(post)));
                let weighted = weight * u64::from(residual.unsigned_abs());
                sum += u128::from(weighted) * u128::from(weighted);
            }
        });
        sum
    }

    /// Calls `each` with every post that the triangle owns: the shares of its corners, its residual in quanta, and the
    /// square of its weight as a part of the largest.
    pub fn each_share(&self, corners: [ModuleVertex; 3], mut each: impl FnMut([f64; 3], f64, f64)) {
        let facet = facet(corners);
        let [a, b, c] = corners.map(|v| (i64::from(v.x), i64::from(v.y)));
        let left = |from: (i64, i64), to: (i64, i64), (x, y): (i64, i64)| {
            (to.0 - from.0) * (y - from.1) - (to.1 - from.1) * (x - from.0)
        };
        let heights = corners.map(|v| f64::from(v.z));
        let den = facet.den as f64;
        for (row, cols) in OwnedRows::new(&self.grid, &facet) {
            for col in cols {
                let post = Post::new(self.grid.origin.row + row, self.grid.origin.col + col);
                if !self.counts(post) {
                    continue;
                }
                let place = (i64::from(col) * self.step(), i64::from(row) * self.step());
                let shares = [left(b, c, place), left(c, a, place), left(a, b, place)].map(|n| n as f64 / den);
                let plane = shares[0] * heights[0] + shares[1] * heights[1] + shares[2] * heights[2];
                let weight =
                    self.weight_max.map_or(1.0, |largest| f64::from(self.mask.weight(post)) / f64::from(largest));
                each(shares, f64::from(self.dem.height(post)) - plane, weight * weight);
            }
        }
    }
}

fn facet(corners: [ModuleVertex; 3]) -> Facet {
    Facet::new(corners.map(|v| i32::from(v.x)), corners.map(|v| i32::from(v.y)), corners.map(|v| v.z))
}
