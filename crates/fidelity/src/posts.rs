//! Heights at every post of an area: those of the DEM, and those of triangles at the same posts.

use terrain::{Dem, Metres, Post, PostRect, QUANTA_PER_METRE};

use crate::{Tally, Triangles};

/// Heights at the posts of a rectangle, in quanta, row by row from the south-west.
#[derive(Clone, Debug, PartialEq)]
pub struct PostHeights {
    rect: PostRect,
    wide: usize,
    quanta: Vec<f64>,
    /// Whether the DEM has no height there; empty when it has one everywhere.
    voids: Vec<bool>,
}

impl PostHeights {
    /// Those of a DEM, which holds all of `rect`.
    ///
    /// # Panics
    /// When it does not.
    pub fn of_dem(dem: &Dem, rect: PostRect) -> Self {
        assert!(dem.rect().contains_rect(&rect), "the DEM holds the ground of the triangles");
        let skipped = (rect.west - dem.rect().west) as usize;
        let row = |row: i32| dem.row(row)[skipped..][..rect.posts_wide()].iter().map(|&height| f64::from(height));
        let quanta = (rect.south..=rect.north).flat_map(row).collect();
        let voids = if dem.void_count() == 0 {
            Vec::new()
        } else {
            let cols = |row: i32| (rect.west..=rect.east).map(move |col| dem.is_void(Post::new(row, col)));
            (rect.south..=rect.north).flat_map(cols).collect()
        };
        Self { rect, wide: rect.posts_wide(), quanta, voids }
    }

    /// Those of triangles at the posts of a DEM; its voids stay voids.
    pub fn of_triangles(triangles: &Triangles, dem: &PostHeights) -> Self {
        let rect = dem.rect;
        let row = |row: i32| (rect.west..=rect.east).map(move |col| [f64::from(col), f64::from(row)]);
        let quanta = (rect.south..=rect.north).flat_map(row).map(|place| triangles.height_at(place)).collect();
        Self { rect, wide: dem.wide, quanta, voids: dem.voids.clone() }
    }

    /// The posts.
    pub(crate) fn rect(&self) -> PostRect {
        self.rect
    }

    /// Columns of posts.
    pub(crate) fn wide(&self) -> usize {
        self.wide
    }

    /// Rows of posts.
    pub(crate) fn high(&self) -> usize {
        self.quanta.len() / self.wide
    }

    /// All heights.
    pub(crate) fn quanta(&self) -> &[f64] {
        &self.quanta
    }

    /// Whether the DEM has no height at some post.
    pub(crate) fn has_voids(&self) -> bool {
        !self.voids.is_empty()
    }

    /// Whether the DEM has no height at a post.
    pub(crate) fn is_void(&self, index: usize) -> bool {
        !self.voids.is_empty() && self.voids[index]
    }

    /// Posts that are not void, by index.
    pub(crate) fn known(&self) -> impl Iterator<Item = usize> {
        (0..self.quanta.len()).filter(|&index| !self.is_void(index))
    }

    /// Posts inside the border that are not void and have no void beside them, by index.
    pub(crate) fn inner(&self) -> impl Iterator<Item = usize> {
        let (wide, high) = (self.wide, self.high());
        let rows = 1..high.max(2) - 1;
        let all = rows.flat_map(move |row| (1..wide.max(2) - 1).map(move |col| row * wide + col));
        all.filter(|&index| {
            self.voids.is_empty()
                || ![index, index - 1, index + 1, index - self.wide, index + self.wide].iter().any(|&i| self.voids[i])
        })
    }

    /// Metres up for each metre east and north at an inner post, by central differences.
    pub(crate) fn gradient(&self, index: usize, spacing: Metres) -> [f64; 2] {
        let per_quantum = 1.0 / (2.0 * spacing.0 * f64::from(QUANTA_PER_METRE));
        let east = self.quanta[index + 1] - self.quanta[index - 1];
        let north = self.quanta[index + self.wide] - self.quanta[index - self.wide];
        [east * per_quantum, north * per_quantum]
    }
}

/// Residuals of triangles at all posts that are not void, each rounded to a quantum, half away from zero.
pub fn residuals_at_posts(dem: &PostHeights, tin: &PostHeights) -> Tally {
    let mut tally = Tally::default();
    for index in dem.known() {
        tally.add((dem.quanta[index] - tin.quanta[index]).round() as i32);
    }
    tally
}

/// The same for each class of ground, by its number; `class_of` gives that of a post.
pub fn residuals_by_class(dem: &PostHeights, tin: &PostHeights, class_of: impl Fn(Post) -> u8) -> Vec<Tally> {
    let mut tallies = Vec::new();
    for index in dem.known() {
        let (row, col) = ((index / dem.wide) as i32, (index % dem.wide) as i32);
        let class = usize::from(class_of(Post::new(dem.rect.south + row, dem.rect.west + col)));
        if tallies.len() <= class {
            tallies.resize_with(class + 1, Tally::default);
        }
        tallies[class].add((dem.quanta[index] - tin.quanta[index]).round() as i32);
    }
    tallies
}

#[cfg(test)]
mod tests {
    use terrain::Spacing;

    use super::*;
    use crate::scene::{full_tin, grid, module_of, random_tin};
    use crate::{Reference, measure};

    #[test]
    fn residuals_at_posts_equal_those_that_load_modules_count() {
        let spacing = Spacing::from_metres(25.0).unwrap();
        let window = PostRect::of_size(21, 21);
        let mut modules: Vec<_> = (grid(2, 3).all().iter().zip(1..))
            .map(|(id, seed)| module_of(&random_tin(window, 40, |_, _| 700, seed), id, spacing))
            .collect();
        for module in &mut modules {
            // Corners and sides stay level, so that neighbours agree.
            let side = module.side;
            let inner = |v: &&mut terrain::ModuleVertex| 0 < v.x && v.x < side && 0 < v.y && v.y < side;
            module.vertices.iter_mut().filter(inner).for_each(|v| v.z = i32::from(v.x % 977) - 400);
        }
        let area = grid(2, 3).area();
        let mut dem = Dem::from_fn(area, |post| (post.col != 7).then_some(post.row * 31 % 1009));
        dem.fill_voids(|_| 5);
        let mask = terrain::Importance::uniform(area, 1000);
        let exact = measure(&mut modules, &Reference { dem: &dem, mask: &mask, grid: grid(2, 3), spacing }).total();
        let posts = PostHeights::of_dem(&dem, area);
        let tin = PostHeights::of_triangles(&Triangles::of_modules(&modules, grid(2, 3), spacing), &posts);
        assert_eq!(residuals_at_posts(&posts, &tin), exact);
        let by_class = residuals_by_class(&posts, &tin, |post| if post.row < 11 { 0 } else { 2 });
        let share = |rows: std::ops::Range<i32>| rows.len() as u64 * (area.posts_wide() as u64 - 1);
        assert_eq!(by_class.iter().map(|tally| tally.posts).collect::<Vec<_>>(), [share(0..11), 0, share(11..41)]);
        let mut sum = by_class[0].clone();
        sum.merge(&by_class[2]);
        assert_eq!(sum, exact);
    }

    #[test]
    fn heights_of_a_part_of_a_dem_are_those_of_its_posts() {
        let dem = Dem::from_fn(PostRect::of_size(9, 11), |post| (post.col != 4).then_some(post.row * 100 + post.col));
        let rect = PostRect::new(Post::new(2, 3), Post::new(7, 9));
        let posts = PostHeights::of_dem(&dem, rect);
        assert_eq!((posts.wide(), posts.high(), posts.rect()), (7, 6, rect));
        assert_eq!((posts.quanta()[0], posts.quanta()[7 * 5 + 6]), (203.0, 709.0));
        assert_eq!(posts.known().count(), 36);
        // Four columns are next to the border or the void.
        assert_eq!(posts.inner().count(), 3 * 4);
        let whole = Dem::from_fn(rect, |post| Some(post.row * post.col));
        let (posts, triangles) = (PostHeights::of_dem(&whole, rect), Triangles::of_tin(&full_tin(&whole)));
        assert_eq!(PostHeights::of_triangles(&triangles, &posts), posts);
    }
}
