//! What one more point would buy a load module: the best triangle to split, where, and by how much.
//!
//! Splitting a triangle at a post raises a tent over it: 1 at the new corner, 0 along the sides, flat between. Its
//! height is free, and the one that leaves the least squared residuals follows from two sums.
//!
//! ```text
//!         c                     tent at p = the smallest of
//!        /|\                    (share of a corner at p) / (its share at the new corner v)
//!       / v \                   squares saved = (sum tent x residual)^2 / sum tent^2
//!      a-----b
//! ```

use terrain::{LoadModule, Post};

use crate::Reference;
use crate::measure::visit_triangle;

/// The best way to spend one more point, which adds two triangles.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Split {
    /// Where.
    pub post: Post,
    /// How far the new corner would stand above the triangle that is there, in quanta.
    pub raised: f64,
    /// Squared residuals, in squared quanta, that it would save.
    pub squares_saved: f64,
}

/// The split of a load module that saves most; `None` where none saves anything. Splits at posts inside triangles only.
///
/// # Panics
/// When the window of `ground` does not hold all posts of the load module.
pub fn best_split(module: &LoadModule, ground: &Reference) -> Option<Split> {
    let mut best: Option<Split> = None;
    let whole = ground.dem.void_count() == 0;
    let mut posts: Vec<(Post, [f64; 3], f64)> = Vec::new();
    for &triangle in &module.triangles {
        let shares = Shares::new(module, ground, triangle);
        posts.clear();
        visit_triangle(module, ground, triangle, |post, residual| {
            if whole || !ground.dem.is_void(post) {
                posts.push((post, shares.at(post), f64::from(residual)));
            }
        });
        for &(post, corner, _) in posts.iter().filter(|(_, shares, _)| shares.iter().all(|&share| 0.0 < share)) {
            let (mut with_residual, mut squared) = (0.0, 0.0);
            for (_, shares, residual) in &posts {
                let tent = (0..3).map(|i| shares[i] / corner[i]).fold(f64::INFINITY, f64::min).max(0.0);
                with_residual += tent * residual;
                squared += tent * tent;
            }
            let squares_saved = with_residual * with_residual / squared;
            if 0.0 < squares_saved && best.is_none_or(|best| best.squares_saved < squares_saved) {
                best = Some(Split { post, raised: with_residual / squared, squares_saved });
            }
        }
    }
    best
}

/// How near a place is to each corner of a triangle: 1 there, 0 on the side opposite.
struct Shares {
    corners: [[f64; 2]; 3],
    whole: f64,
    origin: Post,
    quanta_per_post: f64,
}

impl Shares {
    fn new(module: &LoadModule, ground: &Reference, triangle: [u16; 3]) -> Self {
        let corners = triangle.map(|v| {
            let vertex = module.vertices[usize::from(v)];
            [f64::from(vertex.x), f64::from(vertex.y)]
        });
        Self {
            corners,
            whole: module.doubled_area(triangle) as f64,
            origin: ground.grid.posts_of(module.id).south_west(),
            quanta_per_post: f64::from(ground.spacing.quanta_per_post()),
        }
    }

    fn at(&self, post: Post) -> [f64; 3] {
        let x = f64::from(post.col - self.origin.col) * self.quanta_per_post;
        let y = f64::from(post.row - self.origin.row) * self.quanta_per_post;
        std::array::from_fn(|i| {
            let (b, c) = (self.corners[(i + 1) % 3], self.corners[(i + 2) % 3]);
            ((b[0] - x) * (c[1] - y) - (c[0] - x) * (b[1] - y)) / self.whole
        })
    }
}

#[cfg(test)]
mod tests {
    use terrain::{Dem, Importance, ModuleGrid, ModuleId, ModuleVertex, Spacing};

    use super::*;

    const GRID: ModuleGrid = ModuleGrid { rows: 1, cols: 1, side_cells: 20 };

    fn two_triangles() -> LoadModule {
        let vertex = |(x, y)| ModuleVertex { x, y, z: 0 };
        LoadModule {
            id: ModuleId { row: 0, col: 0 },
            side: 64_000,
            vertices: [(0, 0), (64_000, 0), (0, 64_000), (64_000, 64_000)].map(vertex).to_vec(),
            triangles: vec![[0, 1, 3], [0, 3, 2]],
            classes: vec![0; 2],
            polygon_count: 2,
            ..LoadModule::default()
        }
    }

    fn split_of(height: impl Fn(Post) -> i32) -> (Option<Split>, f64) {
        let dem = Dem::from_fn(GRID.area(), |post| Some(height(post)));
        let mask = Importance::uniform(GRID.area(), 1000);
        let spacing = Spacing::from_sixteenths(400).unwrap();
        let ground = Reference { dem: &dem, mask: &mask, grid: GRID, spacing };
        let squares = crate::residuals(&two_triangles(), &ground).total().sum_squared as f64;
        (best_split(&two_triangles(), &ground), squares)
    }

    #[test]
    fn a_tent_over_one_triangle_is_found_and_all_of_it_is_saved() {
        // Over the south-eastern triangle, with its top at post (5, 15): shares there are 1/4, 1/2 and 1/4.
        let tent = |post: Post| {
            let (x, y) = (f64::from(post.col) / 20.0, f64::from(post.row) / 20.0);
            let shares = [1.0 - x, x - y, y];
            let top = [0.25, 0.5, 0.25];
            (0..3).map(|i| shares[i] / top[i]).fold(f64::INFINITY, f64::min).max(0.0)
        };
        let (split, squares) = split_of(|post| (tent(post) * 1000.0).round() as i32);
        let split = split.unwrap();
        assert_eq!(split.post, Post::new(5, 15));
        assert!((split.raised - 1000.0).abs() < 1.0, "{split:?}");
        assert!((split.squares_saved / squares - 1.0).abs() < 1e-4, "{split:?} of {squares}");
    }

    #[test]
    fn flat_ground_has_nothing_to_split() {
        assert_eq!(split_of(|_| 0), (None, 0.0));
    }
}
