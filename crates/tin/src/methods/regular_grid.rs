//! The regular grid of the SIMNET databases: a vertex every 125 m.

use terrain::geometry::{Facet, rounded};
use terrain::{Dem, Metres, Post, PostRect, Tin};

use crate::methods::dem_window::{DemWindow, Impossible, tin_of};
use crate::methods::lattice_tin::{lattice, lines};

/// Which diagonal cuts a cell of the grid.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Diagonal {
    /// From its north-west to its south-east.
    Fixed,
    /// Whichever leaves less squared residual; the fixed one of equals.
    Best,
}

/// Posts between lines so that they are as near to `metres` apart as can be.
pub fn step_of_spacing(spacing: Metres, metres: Metres) -> i32 {
    ((metres.0 / spacing.0).round() as i32).max(1)
}

/// Posts between lines so that there are as many points as can be, but not more than `points`.
pub fn step_of_points(rect: PostRect, points: usize) -> i32 {
    let longest = rect.cells_wide().max(rect.cells_high()).max(1) as i32;
    let count = |step: i32| {
        let along = |cells: usize| cells.div_ceil(step as usize) + 1;
        along(rect.cells_wide()) * along(rect.cells_high())
    };
    (1..=longest).find(|&step| count(step) <= points).unwrap_or(longest)
}

/// The grid of every `step`-th row and column, the last of each included.
///
/// # Errors
/// When `step` is below 1.
pub fn regular_grid(ground: &DemWindow, step: i32, diagonal: Diagonal) -> Result<Tin, Impossible> {
    if step < 1 {
        return Err(Impossible::new(format!("a step of {step} posts"), "1 or more", "at 30 m the usual step is 4"));
    }
    let rect = ground.dem.rect();
    let posts = lattice(rect, step);
    let (rows, cols) = (lines(rect.south, rect.north, step), lines(rect.west, rect.east, step));
    let wide = cols.len() as u32;
    let mut triangles = Vec::with_capacity(2 * posts.len());
    for row in 0..rows.len() as u32 - 1 {
        for col in 0..wide - 1 {
            let at = |north: u32, east: u32| (row + north) * wide + col + east;
            let (sw, se, ne, nw) = (at(0, 0), at(0, 1), at(1, 1), at(1, 0));
            let fixed = [[sw, se, nw], [se, ne, nw]];
            let other = [[sw, se, ne], [sw, ne, nw]];
            let squares = |pair: &[[u32; 3]; 2]| cell_squares(ground.dem, pair.map(|t| t.map(|v| posts[v as usize])));
            let best = diagonal == Diagonal::Best && squares(&other) < squares(&fixed);
            triangles.extend(if best { other } else { fixed });
        }
    }
    Ok(tin_of(ground.dem, &posts, triangles))
}

/// Squared residuals of the posts strictly inside a cell cut in two; each under the first triangle that holds it.
fn cell_squares(dem: &Dem, pair: [[Post; 3]; 2]) -> u64 {
    let all = || pair.iter().flatten();
    let sw = pair[0][0];
    let north = all().map(|post| post.row).max().unwrap_or(sw.row);
    let east = all().map(|post| post.col).max().unwrap_or(sw.col);
    let facets =
        pair.map(|corners| Facet::new(corners.map(|p| p.col), corners.map(|p| p.row), corners.map(|p| dem.height(p))));
    let mut sum = 0;
    for post in (sw.row + 1..north).flat_map(|row| (sw.col + 1..east).map(move |col| Post::new(row, col))) {
        let inside = pair.iter().position(|&[a, b, c]| {
            [(a, b), (b, c), (c, a)].into_iter().all(|(from, to)| 0 <= terrain::geometry::orient(from, to, post))
        });
        let facet = &facets[inside.expect("the two halves cover the cell")];
        if !dem.is_void(post) {
            let residual = residual(dem, facet, post);
            sum += residual * residual;
        }
    }
    sum
}

/// The absolute residual at a post under a plane, in quanta.
pub(crate) fn residual(dem: &Dem, facet: &Facet, post: Post) -> u64 {
    let (east, north) = (i64::from(post.col - facet.x[0]), i64::from(post.row - facet.y[0]));
    let above = i64::from(dem.height(post) - facet.z[0]) * facet.den - facet.px * east - facet.py * north;
    rounded(above.unsigned_abs(), facet.den as u64)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::methods::scene::{self, metres, rms_m};

    #[test]
    fn the_step_is_the_whole_number_of_posts_nearest_to_125_m() {
        for (spacing, step) in [(30.0, 4), (25.0, 5), (29.0, 4), (125.0, 1), (400.0, 1)] {
            assert_eq!(step_of_spacing(Metres(spacing), Metres(125.0)), step, "{spacing} m");
        }
    }

    #[test]
    fn the_step_of_a_number_of_points_is_the_finest_that_does_not_exceed_it() {
        let rect = PostRect::of_size(376, 460);
        for points in [4, 100, 2500, 5000, 172_960] {
            let step = step_of_points(rect, points);
            assert!(lattice(rect, step).len() <= points);
            assert!(step == 1 || points < lattice(rect, step - 1).len());
        }
    }

    #[test]
    fn last_rows_and_columns_are_in_and_every_load_module_of_500_m_has_32_triangles() {
        let dem = scene::rough(41, 61);
        let tin = regular_grid(&scene::ground(&dem), 5, Diagonal::Fixed).unwrap();
        assert_eq!((tin.check(), tin.triangles.len()), (Ok(()), 2 * 3 * 32));
        let ragged = scene::rough(43, 60);
        let tin = regular_grid(&scene::ground(&ragged), 5, Diagonal::Best).unwrap();
        assert_eq!((tin.check(), tin.vertices.len()), (Ok(()), 10 * 13));
    }

    #[test]
    fn the_best_diagonal_follows_a_ridge_and_is_never_worse() {
        let ridge = scene::dem(13, 13, |post| -metres(f64::from((post.row - post.col).abs())));
        let ground = scene::ground(&ridge);
        let rms = |diagonal| rms_m(&ridge, &regular_grid(&ground, 4, diagonal).unwrap());
        assert_eq!(rms(Diagonal::Best), 0.0);
        assert!(0.0 < rms(Diagonal::Fixed));
        let rough = scene::rough(61, 61);
        let rms = |diagonal| rms_m(&rough, &regular_grid(&scene::ground(&rough), 6, diagonal).unwrap());
        assert!(rms(Diagonal::Best) < rms(Diagonal::Fixed));
    }
}
