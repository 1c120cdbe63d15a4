//! Points on the area's outer border: every 125 m, whatever the ground.

use terrain::{Post, PostRect, SeamSides, Side};

/// The sides of `tile` that lie on the border of `area`.
pub fn outer_sides(tile: PostRect, area: PostRect) -> SeamSides {
    SeamSides::from_fn(|side| match side {
        Side::South => tile.south == area.south,
        Side::East => tile.east == area.east,
        Side::North => tile.north == area.north,
        Side::West => tile.west == area.west,
    })
}

/// Posts every `step` cells on the sides of `tile` for which `sides` is open, corners included, in row
/// order and each once.
pub fn outer_border_posts(tile: PostRect, sides: SeamSides, step: i32) -> Vec<Post> {
    let along_row = |row: i32| (tile.west..=tile.east).step_by(step as usize).map(move |col| Post::new(row, col));
    let along_col = |col: i32| (tile.south..=tile.north).step_by(step as usize).map(move |row| Post::new(row, col));
    let mut posts = Vec::new();
    for side in Side::ALL.into_iter().filter(|&side| sides.is_open(side)) {
        match side {
            Side::South => posts.extend(along_row(tile.south)),
            Side::North => posts.extend(along_row(tile.north)),
            Side::West => posts.extend(along_col(tile.west)),
            Side::East => posts.extend(along_col(tile.east)),
        }
    }
    posts.sort_unstable();
    posts.dedup();
    posts
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_paper_s_area_has_1600_border_points_of_which_400_are_load_module_corners() {
        let area = PostRect::of_size(2001, 2001);
        let posts = outer_border_posts(area, outer_sides(area, area), 5);
        assert_eq!(posts.len(), 1600);
        assert_eq!(posts.iter().filter(|post| post.row % 20 == 0 && post.col % 20 == 0).count(), 400);
    }

    #[test]
    fn an_inner_tile_has_no_border_points() {
        let area = PostRect::of_size(101, 101);
        let tile = PostRect::new(Post::new(20, 20), Post::new(40, 40));
        assert!(outer_border_posts(tile, outer_sides(tile, area), 5).is_empty());
    }
}
