//! Residuals at the posts of the source DEM, which need not be those of the working grid.

use terrain::{LoadModule, ModuleGrid, Post, PostRect, Spacing};

use crate::Tally;

/// Where the source's posts lie, in horizontal quanta of 1/128 m from the area's south-west post.
pub struct SourcePosts<'a> {
    /// The posts there are, by the source's own rows and columns.
    pub window: PostRect,
    /// East and north of the source's post (0, 0).
    pub south_west: [f64; 2],
    /// Between posts, to the east and to the north.
    pub step: [f64; 2],
    /// Height in metres; `None` where the source has none.
    pub height_m: &'a (dyn Fn(Post) -> Option<f64> + Sync),
}

/// Residuals at the source's posts inside `modules`, each counted once: a post on a side belongs to the load module
/// north or east of it, on the area's far borders to the one there.
pub fn residuals_at_source(modules: &[LoadModule], grid: ModuleGrid, spacing: Spacing, source: &SourcePosts) -> Tally {
    let mut tally = Tally::default();
    let side = f64::from(grid.side_cells) * f64::from(spacing.quanta_per_post());
    for module in modules {
        let west = f64::from(module.id.col) * side;
        let south = f64::from(module.id.row) * side;
        let cols = inside(source.south_west[0], source.step[0], west, side, module.id.col + 1 == grid.cols);
        let rows = inside(source.south_west[1], source.step[1], south, side, module.id.row + 1 == grid.rows);
        let Some(posts) = posts(rows, cols).and_then(|posts| posts.intersection(&source.window)) else { continue };
        let ground = Ground { module, source, posts, corner: [west, south] };
        ground.count(&mut tally);
    }
    tally
}

/// First and last post of one axis in `[low, low + side)`, or in `[low, low + side]` at the far border.
fn inside(first: f64, step: f64, low: f64, side: f64, is_last: bool) -> (f64, f64) {
    let end = (low + side - first) / step;
    let last = if is_last { end.floor() } else { end.ceil() - 1.0 };
    (((low - first) / step).ceil(), last)
}

fn posts((south, north): (f64, f64), (west, east): (f64, f64)) -> Option<PostRect> {
    let fits = south <= north && west <= east;
    fits.then(|| PostRect::new(Post::new(south as i32, west as i32), Post::new(north as i32, east as i32)))
}

/// One load module and the source posts in it.
struct Ground<'a> {
    module: &'a LoadModule,
    source: &'a SourcePosts<'a>,
    posts: PostRect,
    corner: [f64; 2],
}

impl Ground<'_> {
    fn count(&self, tally: &mut Tally) {
        let wide = self.posts.posts_wide();
        let mut counted = vec![false; self.posts.post_count()];
        for triangle in &self.module.triangles {
            let corners = triangle.map(|v| {
                let vertex = self.module.vertices[usize::from(v)];
                [f64::from(vertex.x), f64::from(vertex.y), f64::from(vertex.z)]
            });
            self.visit(corners, |post, plane| {
                let index = (post.row - self.posts.south) as usize * wide + (post.col - self.posts.west) as usize;
                if !std::mem::replace(&mut counted[index], true)
                    && let Some(height_m) = (self.source.height_m)(post)
                {
                    let quanta = height_m * f64::from(terrain::QUANTA_PER_METRE);
                    tally.add((quanta - plane).round() as i32);
                }
            });
        }
    }

    /// Calls `visit` with each post of the closed triangle and the plane's height there, in quanta.
    fn visit(&self, [a, b, c]: [[f64; 3]; 3], mut visit: impl FnMut(Post, f64)) {
        /// Share of the triangle by which rounding may put a post on an edge outside both sides of it.
        const ON_EDGE: f64 = 1e-9;
        let den = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
        let range = |axis: usize, low: i32, high: i32| {
            let (first, step) = (self.source.south_west[axis] - self.corner[axis], self.source.step[axis]);
            let least = a[axis].min(b[axis]).min(c[axis]);
            let most = a[axis].max(b[axis]).max(c[axis]);
            (((least - first) / step - ON_EDGE).ceil() as i32).max(low)
                ..=(((most - first) / step + ON_EDGE).floor() as i32).min(high)
        };
        let place = |axis: usize, at: i32| {
            self.source.south_west[axis] + f64::from(at) * self.source.step[axis] - self.corner[axis]
        };
        for row in range(1, self.posts.south, self.posts.north) {
            let y = place(1, row);
            for col in range(0, self.posts.west, self.posts.east) {
                let x = place(0, col);
                let at_b = ((x - a[0]) * (c[1] - a[1]) - (y - a[1]) * (c[0] - a[0])) / den;
                let at_c = ((b[0] - a[0]) * (y - a[1]) - (b[1] - a[1]) * (x - a[0])) / den;
                if -ON_EDGE <= at_b && -ON_EDGE <= at_c && at_b + at_c <= 1.0 + ON_EDGE {
                    visit(Post::new(row, col), a[2] + at_b * (b[2] - a[2]) + at_c * (c[2] - a[2]));
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use terrain::{ModuleId, ModuleResidual, ModuleVertex};

    const GRID: ModuleGrid = ModuleGrid { rows: 1, cols: 2, side_cells: 4 };

    /// Two load modules of 100 m on a plane that rises 1 m every 10 m to the east.
    fn ramp() -> Vec<LoadModule> {
        let module = |col: u32| {
            let z = |x: u16| (i32::from(x) + col as i32 * 12_800) / 10;
            let vertex = |y, x| ModuleVertex { y, x, z: z(x) };
            LoadModule {
                id: ModuleId { row: 0, col },
                side: 12_800,
                vertices: vec![vertex(0, 0), vertex(0, 12_800), vertex(12_800, 0), vertex(12_800, 12_800)],
                triangles: vec![[0, 1, 3], [0, 3, 2]],
                classes: vec![0, 0],
                polygon_count: 2,
                residual: ModuleResidual::default(),
            }
        };
        vec![module(0), module(1)]
    }

    #[test]
    fn every_source_post_in_the_area_is_counted_once_with_its_residual() {
        let spacing = Spacing::from_metres(25.0).unwrap();
        // Posts every 20 m from 10 m outside the area: 10 x 5 inside; one metre above the ramp.
        let height_m = |post: Post| Some((f64::from(post.col) * 20.0 - 10.0) / 10.0 + 1.0);
        let source = SourcePosts {
            window: PostRect::of_size(7, 12),
            south_west: [-1280.0, -1280.0],
            step: [2560.0, 2560.0],
            height_m: &height_m,
        };
        let tally = residuals_at_source(&ramp(), GRID, spacing, &source);
        assert_eq!((tally.posts, tally.largest), (50, 128));
        assert!((tally.rms_m() - 1.0).abs() < 1e-12);
    }

    #[test]
    fn posts_on_the_far_border_count_and_voids_do_not() {
        let spacing = Spacing::from_metres(25.0).unwrap();
        // Posts on every fourth cell: 3 x 2 of them on corners of load modules, one void.
        let height_m = |post: Post| (post.col != 1 || post.row != 1).then(|| f64::from(post.col) * 10.0);
        let source = SourcePosts {
            window: PostRect::of_size(2, 3),
            south_west: [0.0, 0.0],
            step: [12_800.0, 12_800.0],
            height_m: &height_m,
        };
        let tally = residuals_at_source(&ramp(), GRID, spacing, &source);
        assert_eq!((tally.posts, tally.largest), (5, 0));
    }
}
