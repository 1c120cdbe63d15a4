//! Posts that may lie on a ridge.

use crate::{Dem, Post};

/// Whether a post is the lowest of none of the cells of 2 x 2 posts that it belongs to: a ridge candidate of Fowler
/// and Little, "Automatic extraction of irregular network digital terrain models" (SIGGRAPH 1979). Of equally low
/// posts the first by row and column is the lowest.
///
/// # Panics
/// When the post lies outside the window.
pub fn is_ridge_candidate(dem: &Dem, post: Post) -> bool {
    let rect = dem.rect();
    let own = (dem.height(post), post);
    let is_lowest = |row: i32, col: i32| {
        let cell = [(row, col), (row, post.col), (post.row, col)].map(|(row, col)| Post::new(row, col));
        cell.into_iter().all(|other| own < (dem.height(other), other))
    };
    let rows = [post.row - 1, post.row + 1].into_iter().filter(|row| (rect.south..=rect.north).contains(row));
    let mut cells = rows.flat_map(|row| {
        let cols = [post.col - 1, post.col + 1].into_iter().filter(|col| (rect.west..=rect.east).contains(col));
        cols.map(move |col| (row, col))
    });
    !cells.any(|(row, col)| is_lowest(row, col))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::PostRect;

    fn candidates(height: impl Fn(Post) -> i32) -> Vec<Post> {
        let dem = Dem::from_fn(PostRect::of_size(9, 9), |post| Some(height(post)));
        let posts = (1..8).flat_map(|row| (1..8).map(move |col| Post::new(row, col)));
        posts.filter(|&post| is_ridge_candidate(&dem, post)).collect()
    }

    #[test]
    fn a_roof_has_its_ridge_and_nothing_else() {
        let ridge: Vec<Post> = (1..8).map(|row| Post::new(row, 4)).collect();
        assert_eq!(candidates(|post| 3 * post.row - 20 * (post.col - 4).abs()), ridge);
    }

    #[test]
    fn slopes_valleys_and_plains_have_none() {
        assert_eq!(candidates(|post| 5 * post.row + 3 * post.col), []);
        assert_eq!(candidates(|post| 3 * post.row + 20 * (post.col - 4).abs()), []);
        assert_eq!(candidates(|_| 7), []);
    }
}
