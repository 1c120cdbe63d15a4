//! Weighted residuals under a triangle: the scan of `geometry`, times the importance mask.

use fearless_simd::Simd;
use terrain::geometry::{
    Blocks, Facet, LocalPost, LocalRect, Surface, largest_numerator, locate_all, rounded, squares_sum,
};
use terrain::geometry::{locate, visit_owned, visit_posts};
use terrain::{Dem, Importance, THOUSANDTHS};

/// Side of the blocks that know their smallest and largest weight, in posts.
const BLOCK: usize = 16;

/// The ground of one tile as selection sees it. A value is weight (thousandths) x rounded residual.
pub(crate) struct WeightedSurface<'a, S: Simd> {
    simd: S,
    surface: Surface<'a>,
    everywhere: Surface<'a>,
    blocks: Blocks<'a>,
    weights: Weights<'a>,
    /// Quanta in one unit of residual.
    unit: u64,
}

enum Weights<'a> {
    Uniform(u64),
    Varying { importance: &'a Importance, blocks: Vec<(u16, u16)>, blocks_wide: usize },
}

impl<'a, S: Simd> WeightedSurface<'a, S> {
    /// The ground of a window, candidates confined to `candidates`.
    pub fn new(simd: S, dem: &'a Dem, importance: &'a Importance, candidates: LocalRect, unit: u32) -> Self {
        assert_eq!(dem.rect(), importance.rect(), "heights and weights cover the same posts");
        let everywhere = Surface::new(dem);
        let weights = match importance.uniform_weight() {
            Some(weight) => Weights::Uniform(u64::from(weight)),
            None => {
                let (blocks, blocks_wide) = block_ranges(importance);
                Weights::Varying { importance, blocks, blocks_wide }
            }
        };
        Self {
            simd,
            surface: everywhere.with_candidates(candidates),
            everywhere,
            blocks: Blocks::of(dem),
            weights,
            unit: u64::from(unit),
        }
    }

    /// The one weight under a triangle, if it is known to be uniform there.
    #[inline(always)]
    fn weight_under(&self, facet: &Facet) -> Option<u64> {
        match &self.weights {
            Weights::Uniform(weight) => Some(*weight),
            Weights::Varying { blocks, blocks_wide, .. } => {
                let (x0, x1, y0, y1) = facet.bounds();
                let block = |at: i32| at as usize / BLOCK;
                let first = blocks[block(y0) * blocks_wide + block(x0)];
                let same = first.0 == first.1
                    && (block(y0)..=block(y1)).all(|row| {
                        let row = &blocks[row * blocks_wide..][..*blocks_wide];
                        row[block(x0)..=block(x1)].iter().all(|&range| range == first)
                    });
                same.then_some(u64::from(first.0))
            }
        }
    }

    #[inline(always)]
    fn weight_at(&self, post: LocalPost) -> u64 {
        match &self.weights {
            Weights::Uniform(weight) => *weight,
            Weights::Varying { importance, .. } => u64::from(importance.weight(post.post(importance.rect()))),
        }
    }

    /// Residual at a post of a triangle in units, given the scan's numerator.
    #[inline(always)]
    fn units(&self, facet: &Facet, numerator: u64) -> u64 {
        rounded(numerator, facet.den as u64 * self.unit)
    }

    /// Smallest numerator that rounds to `value` under weight `weight`.
    #[inline(always)]
    fn threshold(&self, facet: &Facet, value: u64, weight: u64) -> u64 {
        ((2 * (value / weight) - 1) * facet.den as u64 * self.unit).div_ceil(2)
    }

    /// Largest value over the candidates of the closed triangle.
    #[inline(always)]
    pub fn largest_value(&self, corners: [LocalPost; 3]) -> u64 {
        let facet = self.surface.facet(corners);
        match self.weight_under(&facet) {
            Some(0) => 0,
            Some(weight) => {
                weight * self.units(&facet, largest_numerator(self.simd, &self.surface, &self.blocks, &facet))
            }
            None => self.worst_where(corners, |_| true).map_or(0, |(value, _)| value),
        }
    }

    /// The first candidate, row by row, whose value is `value`, the largest of the triangle and positive.
    #[inline(always)]
    pub fn first_of_value(&self, corners: [LocalPost; 3], value: u64) -> LocalPost {
        let facet = self.surface.facet(corners);
        let found = match self.weight_under(&facet) {
            Some(weight) => locate(self.simd, &self.surface, &facet, self.threshold(&facet, value, weight)),
            None => self.worst_where(corners, |_| true).map(|(_, post)| post),
        };
        found.expect("a triangle's largest value belongs to one of its candidates")
    }

    /// Every candidate whose value is `value`, the largest of the triangle and positive, row by row.
    #[inline(always)]
    pub fn all_of_value(&self, corners: [LocalPost; 3], value: u64, mut visit: impl FnMut(LocalPost)) {
        let facet = self.surface.facet(corners);
        match self.weight_under(&facet) {
            Some(weight) => {
                let threshold = self.threshold(&facet, value, weight);
                locate_all(self.simd, &self.surface, &facet, threshold, visit);
            }
            None => visit_posts(&self.surface, &facet, |post, numerator| {
                if value == self.weight_at(post) * self.units(&facet, numerator) {
                    visit(post);
                }
            }),
        }
    }

    /// Largest value, and its first post, among the candidates that `allowed` lets through.
    pub fn worst_where(
        &self,
        corners: [LocalPost; 3],
        allowed: impl Fn(LocalPost) -> bool,
    ) -> Option<(u64, LocalPost)> {
        let facet = self.surface.facet(corners);
        let mut worst = (0, LocalPost::new(0, 0));
        visit_posts(&self.surface, &facet, |post, numerator| {
            let value = self.weight_at(post) * self.units(&facet, numerator);
            if worst.0 < value && allowed(post) {
                worst = (value, post);
            }
        });
        (0 < worst.0).then_some(worst)
    }

    /// Sum of squared weighted residuals over the candidates the triangle owns, in quanta squared.
    #[inline(always)]
    pub fn weighted_squares(&self, corners: [LocalPost; 3]) -> f64 {
        let facet = self.surface.facet(corners);
        let per_thousandth = 1.0 / f64::from(THOUSANDTHS);
        match self.weight_under(&facet) {
            Some(0) => 0.0,
            Some(weight) => {
                let weight = weight as f64 * per_thousandth;
                weight * weight * squares_sum(self.simd, &self.surface, &facet)
            }
            None => {
                let mut sum = 0.0;
                visit_owned(&self.surface, &facet, |post, numerator| {
                    let weight = self.weight_at(post) as f64 * per_thousandth;
                    let residual = weight * rounded(numerator, facet.den as u64) as f64;
                    sum += residual * residual;
                });
                sum
            }
        }
    }

    /// Sum of squared residuals over all posts the triangle owns, masked ones included, in quanta squared.
    #[inline(always)]
    pub fn plain_squares(&self, corners: [LocalPost; 3]) -> f64 {
        squares_sum(self.simd, &self.everywhere, &self.everywhere.facet(corners))
    }

    /// Absolute residual at `post` under a triangle, in quanta.
    #[inline(always)]
    pub fn residual_at(&self, corners: [LocalPost; 3], post: LocalPost) -> u32 {
        let facet = self.surface.facet(corners);
        let plane = facet.origin() + facet.px * i64::from(post.col()) + facet.py * i64::from(post.row());
        let numerator = (i64::from(self.surface.height(post)) * facet.den - plane).unsigned_abs();
        rounded(numerator, facet.den as u64) as u32
    }

    /// Height at `post`, in quanta.
    #[inline(always)]
    pub fn height(&self, post: LocalPost) -> i32 {
        self.surface.height(post)
    }

    /// All posts of the window.
    #[inline(always)]
    pub fn extent(&self) -> LocalRect {
        self.surface.extent()
    }

    /// Posts of the window.
    pub fn post_count(&self) -> usize {
        let extent = self.surface.extent();
        (extent.north as usize + 1) * (extent.east as usize + 1)
    }
}

/// Smallest and largest weight of each block of 16 x 16 posts, and blocks in a row.
fn block_ranges(importance: &Importance) -> (Vec<(u16, u16)>, usize) {
    let rect = importance.rect();
    let blocks_wide = rect.posts_wide().div_ceil(BLOCK);
    let mut blocks = vec![(u16::MAX, 0); blocks_wide * rect.posts_high().div_ceil(BLOCK)];
    for (index, row) in (rect.south..=rect.north).enumerate() {
        let line = &mut blocks[index / BLOCK * blocks_wide..][..blocks_wide];
        let weights = importance.weights_of_row(row).unwrap_or(&[]);
        for (range, posts) in line.iter_mut().zip(weights.chunks(BLOCK)) {
            for &weight in posts {
                *range = (range.0.min(weight), range.1.max(weight));
            }
        }
    }
    (blocks, blocks_wide)
}
