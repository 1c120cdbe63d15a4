//! The regular grid that a TIN is held against: as many triangles, all alike, over the same DEM.

use terrain::{Dem, Post, PostRect, Tin, Vertex};

/// Right-angled triangles over every so many posts.
#[derive(Clone, Debug)]
pub struct RegularGrid {
    /// Posts between its vertices; less at the far borders where that does not divide the area.
    pub step: i32,
    /// Its triangles, two to a square, split from north-west to south-east.
    pub tin: Tin,
}

/// The grid over `rect` whose number of triangles is nearest to `triangles`; the finer one of two.
///
/// # Panics
/// When the DEM does not hold all of `rect`.
pub fn regular_grid(dem: &Dem, rect: PostRect, triangles: u64) -> RegularGrid {
    let longest = rect.cells_wide().max(rect.cells_high()).max(1) as i32;
    let count = |step: i32| 2 * squares(rect.cells_wide(), step) as u64 * squares(rect.cells_high(), step) as u64;
    let step = (1..=longest).min_by_key(|&step| (count(step).abs_diff(triangles), step)).unwrap_or(1);
    RegularGrid { step, tin: grid_of(dem, rect, step) }
}

fn squares(cells: usize, step: i32) -> usize {
    cells.div_ceil(step as usize)
}

fn grid_of(dem: &Dem, rect: PostRect, step: i32) -> Tin {
    let rows = 0..=squares(rect.cells_high(), step) as i32;
    let (wide, high) = (squares(rect.cells_wide(), step) as u32, squares(rect.cells_high(), step) as u32);
    let vertex = |row: i32, col: i32| {
        let post = Post::new((rect.south + row * step).min(rect.north), (rect.west + col * step).min(rect.east));
        Vertex { at: post.into(), height: dem.height(post) }
    };
    let vertices = rows.flat_map(|row| (0..=wide as i32).map(move |col| vertex(row, col))).collect();
    let mut triangles = Vec::with_capacity(2 * (wide * high) as usize);
    for row in 0..high {
        for col in 0..wide {
            let south_west = row * (wide + 1) + col;
            let (south_east, north_west) = (south_west + 1, south_west + wide + 1);
            triangles.push([south_west, south_east, north_west]);
            triangles.push([south_east, north_west + 1, north_west]);
        }
    }
    Tin::new(rect, vertices, triangles)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_step_is_the_one_nearest_to_the_number_of_triangles() {
        let rect = PostRect::new(Post::new(-5, 10), Post::new(35, 70));
        let dem = Dem::from_fn(rect, |post| Some(post.row * 100 + post.col));
        for (wanted, step) in [(9_999_999, 1), (4800, 1), (1200, 2), (560, 3), (310, 4), (192, 5), (2, 60), (0, 60)] {
            let grid = regular_grid(&dem, rect, wanted);
            assert_eq!(grid.tin.check(), Ok(()));
            assert_eq!(grid.step, step, "{wanted} triangles wanted, {} found", grid.tin.triangles.len());
            let on_ground = |vertex: &Vertex| vertex.at.post().map(|post| dem.height(post)) == Some(vertex.height);
            assert!(grid.tin.vertices.iter().all(on_ground));
        }
    }
}
