//! The ground a simulator would see, looked at post by post: residuals found by trying every triangle.

use terrain::{Dem, Post, Tin};

use crate::product::{Product, cross};
use crate::scene::SIDE_CELLS;

/// Sums over posts, in quanta of 1/128 m.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Sums {
    pub posts: u64,
    pub largest: u64,
    pub sum_abs: u64,
    pub sum_squared: u64,
}

impl Sums {
    fn add(&mut self, residual: u64) {
        self.posts += 1;
        self.largest = self.largest.max(residual);
        self.sum_abs += residual;
        self.sum_squared += residual * residual;
    }

    pub fn rms_m(&self) -> f64 {
        (self.sum_squared as f64 / self.posts as f64).sqrt() / 128.0
    }

    pub fn max_m(&self) -> f64 {
        self.largest as f64 / 128.0
    }
}

/// Residuals of a product at every post of `dem` that is not void, each once.
pub fn sums_of_product(product: &Product, dem: &Dem) -> Sums {
    let mut sums = Sums::default();
    let step = product.side / i64::from(SIDE_CELLS);
    for (&(row, col), module) in &product.modules {
        // Posts on a side shared with the next load module are looked at there.
        let reach = |last: bool| if last { SIDE_CELLS } else { SIDE_CELLS - 1 };
        let (south, west) = (row as i32 * SIDE_CELLS, col as i32 * SIDE_CELLS);
        let triangles: Vec<[(i64, i64, i64); 3]> = module
            .triangles
            .iter()
            .map(|corners| corners.map(|v| module.vertices[usize::from(v)]))
            .map(|corners| corners.map(|v| (i64::from(v.x), i64::from(v.y), i64::from(v.z))))
            .collect();
        for up in 0..=reach(row + 1 == product.rows) {
            for right in 0..=reach(col + 1 == product.cols) {
                let post = Post::new(south + up, west + right);
                if !dem.is_void(post) {
                    let at = (i64::from(right) * step, i64::from(up) * step);
                    sums.add(residual_under(&triangles, at, dem.height(post)));
                }
            }
        }
    }
    sums
}

/// Residuals of a TIN on the posts of `dem` that are not void.
pub fn sums_of_tin(tin: &Tin, dem: &Dem) -> Sums {
    let mut sums = Sums::default();
    let rect = dem.rect();
    let mut done = vec![false; rect.post_count()];
    for corners in &tin.triangles {
        let corners = corners.map(|v| tin.vertices[v as usize]);
        let posts = corners.map(|v| v.at.post().unwrap());
        let ends = |of: fn(Post) -> i32| (posts.map(of).into_iter().min().unwrap(), posts.map(of).into_iter().max());
        let ((south, north), (west, east)) = (ends(|post| post.row), ends(|post| post.col));
        let triangle = [0, 1, 2].map(|k| (posts[k].col.into(), posts[k].row.into(), corners[k].height.into()));
        for post in (south..=north.unwrap()).flat_map(|row| (west..=east.unwrap()).map(move |col| Post::new(row, col)))
        {
            let index = rect.index(post);
            let at = (i64::from(post.col), i64::from(post.row));
            if !done[index] && contains(&triangle, at) {
                done[index] = true;
                if !dem.is_void(post) {
                    sums.add(residual(&triangle, at, dem.height(post)));
                }
            }
        }
    }
    // At the rims of voids a few may not.
    let bare = rect.posts().filter(|post| !done[rect.index(*post)] && !dem.is_void(*post)).count();
    assert!(bare <= dem.void_count() / 4, "every post lies under a triangle, not so {bare}");
    sums
}

type Triangle = [(i64, i64, i64); 3];

fn flat((x, y, _): (i64, i64, i64)) -> (i64, i64) {
    (x, y)
}

fn contains(&[a, b, c]: &Triangle, at: (i64, i64)) -> bool {
    let (a, b, c) = (flat(a), flat(b), flat(c));
    0 <= cross(a, b, at) && 0 <= cross(b, c, at) && 0 <= cross(c, a, at)
}

fn residual_under(triangles: &[Triangle], at: (i64, i64), height: i32) -> u64 {
    let over = triangles.iter().find(|triangle| contains(triangle, at));
    residual(over.unwrap_or_else(|| panic!("no triangle over {at:?}")), at, height)
}

/// |height - plane|, rounded half away from zero.
fn residual(&[a, b, c]: &Triangle, at: (i64, i64), height: i32) -> u64 {
    let area = cross(flat(a), flat(b), flat(c));
    let weights = [cross(flat(b), flat(c), at), cross(flat(c), flat(a), at), cross(flat(a), flat(b), at)];
    let plane: i128 = weights.iter().zip([a, b, c]).map(|(&weight, v)| i128::from(weight) * i128::from(v.2)).sum();
    let numerator = (plane - i128::from(height) * i128::from(area)).unsigned_abs();
    let area = area as u128;
    ((2 * numerator + area) / (2 * area)) as u64
}
