//! How far the two surfaces lie apart in space: from each post of the DEM to the nearest place of the TIN, and from
//! each vertex of the TIN to the nearest place of the DEM, bilinear between its posts.
//!
//! A residual is taken straight up; on a cliff that stands a little aside it is as high as the cliff, while the nearest
//! place is as near as the shift. Nothing is nearer than what lies straight above or below, so that bounds the search.

use std::cell::Cell;

use serde::Serialize;
use terrain::{Metres, QUANTA_PER_METRE};

use crate::nearest::{BilinearCell, Point, squared_to_triangle};
use crate::{PostHeights, Triangles};

/// How far around a place something nearer is looked for, in posts: 400 m at 25 m. Only ground that is wrong by more
/// than this is not looked at further, and the distance given there may be too large.
const REACH_POSTS: f64 = 16.0;

/// Distances both ways.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Hausdorff {
    /// From posts of the DEM to the TIN.
    pub dem_to_tin: Distances,
    /// From vertices of the TIN to the DEM.
    pub tin_to_dem: Distances,
}

/// Distances from the places of one surface to another.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Distances {
    /// Places asked.
    pub places: u64,
    /// The largest, in metres.
    pub max_m: f64,
    /// Their mean, in metres; 0 without places.
    pub mean_m: f64,
}

impl Hausdorff {
    /// The Hausdorff distance in metres: the larger of the two ways.
    pub fn max_m(&self) -> f64 {
        self.dem_to_tin.max_m.max(self.tin_to_dem.max_m)
    }

    /// The larger of the two mean distances, in metres.
    pub fn mean_m(&self) -> f64 {
        self.dem_to_tin.mean_m.max(self.tin_to_dem.mean_m)
    }
}

impl Distances {
    fn of(distances: impl Iterator<Item = f64>) -> Self {
        let (mut places, mut sum, mut max_m) = (0, 0.0, 0.0_f64);
        for distance in distances {
            places += 1;
            sum += distance;
            max_m = max_m.max(distance);
        }
        Self { places, max_m, mean_m: if places == 0 { 0.0 } else { sum / places as f64 } }
    }
}

/// Measures the distance both ways. Voids of the DEM, and vertices in cells around one, are left out.
pub fn hausdorff(dem: &PostHeights, tin: &PostHeights, triangles: &Triangles, spacing: Metres) -> Hausdorff {
    let ground = Both { dem, tin, triangles, spacing: spacing.0 };
    let from_posts = dem.known().map(|index| ground.post_to_tin(index));
    let from_vertices = (0..triangles.vertices().len()).filter_map(|vertex| ground.vertex_to_dem(vertex));
    Hausdorff { dem_to_tin: Distances::of(from_posts), tin_to_dem: Distances::of(from_vertices) }
}

struct Both<'a> {
    dem: &'a PostHeights,
    tin: &'a PostHeights,
    triangles: &'a Triangles,
    /// Metres between posts.
    spacing: f64,
}

impl Both<'_> {
    fn post_to_tin(&self, index: usize) -> f64 {
        let (row, col) = (index / self.dem.wide(), index % self.dem.wide());
        let rect = self.dem.rect();
        let place = [f64::from(rect.west + col as i32), f64::from(rect.south + row as i32)];
        let above = self.dem.quanta()[index] - self.tin.quanta()[index];
        if above == 0.0 {
            return 0.0;
        }
        let point = self.metres([place[0], place[1], self.dem.quanta()[index]]);
        let straight = above / f64::from(QUANTA_PER_METRE);
        let mut best = straight * straight;
        let reach = Cell::new(self.reach(best));
        self.triangles.cells().each_near(place, &reach, |triangle| {
            let corners = self.triangles.corners_of(triangle).map(|corner| self.metres(corner));
            let squared = squared_to_triangle(point, corners, best);
            if squared < best {
                best = squared;
                reach.set(self.reach(best));
            }
        });
        best.sqrt()
    }

    fn vertex_to_dem(&self, vertex: usize) -> Option<f64> {
        let [x, y, quanta] = self.triangles.vertices()[vertex];
        let rect = self.dem.rect();
        let (x, y) = (x - f64::from(rect.west), y - f64::from(rect.south));
        let last = [rect.cells_wide() - 1, rect.cells_high() - 1];
        let home = [(x.max(0.0) as usize).min(last[0]), (y.max(0.0) as usize).min(last[1])];
        let point = self.metres([x, y, quanta]);
        let mut best = self.cell(home)?.squared_to(point);
        let reach = self.reach(best);
        // Cells whose nearest side is not beyond reach, straight east and straight north.
        let span = |at: f64, last: usize| {
            ((at - reach).max(0.0) as usize).min(last)..=((at + reach).max(0.0) as usize).min(last)
        };
        for row in span(y, last[1]) {
            for col in span(x, last[0]) {
                match self.cell([col, row]) {
                    Some(cell) if [col, row] != home && best > self.squared_to_box(&cell, point) => {
                        best = best.min(cell.squared_to(point));
                    }
                    _ => {}
                }
            }
        }
        Some(best.sqrt())
    }

    /// The cell at a column and a row, in metres from the south-west post; `None` next to a void.
    fn cell(&self, [col, row]: [usize; 2]) -> Option<BilinearCell> {
        let south = row * self.dem.wide() + col;
        let posts = [south, south + 1, south + self.dem.wide(), south + self.dem.wide() + 1];
        let is_whole = posts.iter().all(|&post| !self.dem.is_void(post));
        is_whole.then(|| BilinearCell {
            corner: [col as f64 * self.spacing, row as f64 * self.spacing],
            side: self.spacing,
            heights: posts.map(|post| self.dem.quanta()[post] / f64::from(QUANTA_PER_METRE)),
        })
    }

    /// Squared distance from a point to the box around a cell.
    fn squared_to_box(&self, cell: &BilinearCell, point: Point) -> f64 {
        let low = cell.heights.iter().copied().fold(f64::INFINITY, f64::min);
        let high = cell.heights.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let outside = |at: f64, low: f64, high: f64| (low - at).max(at - high).max(0.0);
        let east = outside(point[0], cell.corner[0], cell.corner[0] + cell.side);
        let north = outside(point[1], cell.corner[1], cell.corner[1] + cell.side);
        let up = outside(point[2], low, high);
        east * east + north * north + up * up
    }

    fn metres(&self, [x, y, quanta]: Point) -> Point {
        [x * self.spacing, y * self.spacing, quanta / f64::from(QUANTA_PER_METRE)]
    }

    /// A squared distance in metres as a distance in posts, as far as anything is looked for.
    fn reach(&self, squared: f64) -> f64 {
        (squared.sqrt() / self.spacing).min(REACH_POSTS)
    }
}

#[cfg(test)]
mod tests {
    use terrain::{Dem, Post, PostRect, Tin};

    use super::*;
    use crate::scene::{full_tin, random_tin};

    const SPACING: Metres = Metres(10.0);

    fn rect() -> PostRect {
        PostRect::new(Post::new(-2, 3), Post::new(38, 53))
    }

    fn dem(height: impl Fn(Post) -> i32) -> Dem {
        Dem::from_fn(rect(), |post| Some(height(post)))
    }

    fn between(dem: &Dem, tin: &Tin) -> Hausdorff {
        let triangles = Triangles::of_tin(tin);
        let posts = PostHeights::of_dem(dem, tin.rect);
        hausdorff(&posts, &PostHeights::of_triangles(&triangles, &posts), &triangles, SPACING)
    }

    fn near(found: f64, expected: f64) -> bool {
        (found - expected).abs() < 1e-6
    }

    #[test]
    fn the_same_surface_is_no_distance_away() {
        let hills = dem(|post| (post.row * 37 + post.col * post.col) % 300);
        let found = between(&hills, &full_tin(&hills));
        assert_eq!((found.max_m(), found.mean_m()), (0.0, 0.0));
        assert_eq!((found.dem_to_tin.places, found.tin_to_dem.places), (41 * 51, 41 * 51));
    }

    #[test]
    fn a_plane_below_a_plane_is_as_far_as_a_perpendicular() {
        // 3 in 4 up, to the east: 7.5 m a post; and 10 m below, which is 8 m straight across.
        let slope = dem(|post| post.col * 960);
        let lower = random_tin(rect(), 200, |at, _| at.col * 120 - 1280, 5);
        let found = between(&slope, &lower);
        // Where no ground lies opposite, near the western border, it is farther, but not farther than straight down.
        assert!(8.0 < found.dem_to_tin.mean_m && found.dem_to_tin.mean_m < 8.1, "{found:?}");
        assert!(8.0 < found.tin_to_dem.mean_m && found.tin_to_dem.mean_m < 8.2, "{found:?}");
        assert!(found.max_m() <= 10.0 + 1e-9, "{found:?}");
        // Level ground 12.5 m lower is 12.5 m away everywhere.
        let found = between(&dem(|_| 1600), &random_tin(rect(), 99, |_, _| 0, 2));
        for distances in [found.dem_to_tin, found.tin_to_dem] {
            assert!(near(distances.max_m, 12.5) && near(distances.mean_m, 12.5), "{found:?}");
        }
    }

    #[test]
    fn a_wall_that_stands_one_post_aside_is_one_post_away() {
        // 50 m high, a post thick: a residual of 50 m, but what it shows is 10 m away.
        let wall = |first: i32| dem(move |post| if post.col < first { 0 } else { 50 * 128 });
        let found = between(&wall(20), &full_tin(&wall(21)));
        // The face falls 50 m in 10 m, so straight across it is nearer still.
        let across = 10.0 * 50.0 / 50.0_f64.hypot(10.0);
        assert!(near(found.max_m(), across), "{found:?}, expected {across}");
        assert!(near(found.dem_to_tin.mean_m, across / 51.0), "{found:?}");
    }

    #[test]
    fn a_cone_that_the_tin_lacks_is_as_far_as_its_top() {
        let cone = dem(|post| (12 - (post.row - 18).abs().max((post.col - 28).abs())).max(0) * 128);
        let flat = Tin { rect: rect(), ..full_tin(&dem(|_| 0)) };
        let found = between(&cone, &flat);
        assert!(near(found.dem_to_tin.max_m, 12.0), "{found:?}");
        // From the level below, what is nearest is the side of the cone, which rises one in ten.
        assert!(11.0 < found.tin_to_dem.max_m && found.tin_to_dem.max_m < 12.0, "{found:?}");
    }

    #[test]
    fn voids_are_not_asked() {
        let mut holed = Dem::from_fn(rect(), |post| (post != Post::new(10, 20)).then_some(0));
        holed.fill_voids(|_| 99_999);
        let found = between(&holed, &random_tin(rect(), 40, |_, _| 0, 1));
        assert_eq!((found.max_m(), found.dem_to_tin.places), (0.0, 41 * 51 - 1));
    }
}
