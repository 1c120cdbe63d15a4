//! All measures of one surface against one DEM, what is asked of the DEM alone only once; and the regular grid that a
//! TIN is held against: as many triangles, all alike, over the same DEM.

use serde::Serialize;
use terrain::{Dem, Metres, Post, PostRect, Tin, Vertex};

use crate::edges::Edges;
use crate::form::form_with;
use crate::seam::seams_with;
use crate::{
    Cover, Defilade, Drainage, Hausdorff, LineOfSight, MeshForm, PostHeights, Registration, SeamVisibility,
    SlopeClasses, SlopeDifference, Streams, Tally, Triangles, cover, drainage, hausdorff, line_of_sight, registration,
    residuals_at_posts, residuals_by_class, slope, slope_classes,
};

/// How true a surface is to a DEM, and what its mesh is like.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measures {
    /// DEM less surface, straight up at every post.
    pub residual: ResidualFigures,
    /// What is seen.
    pub line_of_sight: LineOfSight,
    /// How steep it is, and which way it falls.
    pub slope: SlopeDifference,
    /// Which vehicles can climb it.
    pub slope_classes: SlopeClasses,
    /// How far the surfaces lie apart in space.
    pub hausdorff: Hausdorff,
    /// Where water runs and stands.
    pub drainage: Drainage,
    /// Where a vehicle hides.
    pub cover: Cover,
    /// Whether it lies aside; `None` where that cannot be told.
    pub registration: Option<Registration>,
    /// Whether lines between load modules show; `None` without load modules.
    pub seams: Option<SeamVisibility>,
    /// The triangles themselves.
    pub mesh: MeshForm,
}

/// Residuals of all posts that are not void, in metres.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct ResidualFigures {
    /// Posts measured.
    pub posts: u64,
    /// Root mean square.
    pub rms_m: f64,
    /// Mean with its sign: positive where the DEM lies higher.
    pub mean_m: f64,
    /// Mean absolute one.
    pub mean_abs_m: f64,
    /// What half of the posts do not exceed.
    pub p50_m: f64,
    /// What 95 % of the posts do not exceed.
    pub p95_m: f64,
    /// What 99 % of the posts do not exceed.
    pub p99_m: f64,
    /// Largest absolute one.
    pub max_m: f64,
}

impl From<&Tally> for ResidualFigures {
    fn from(tally: &Tally) -> Self {
        Self {
            posts: tally.posts,
            rms_m: tally.rms_m(),
            mean_m: tally.mean_m(),
            mean_abs_m: tally.mean_abs_m(),
            p50_m: tally.percentile_m(50.0),
            p95_m: tally.percentile_m(95.0),
            p99_m: tally.percentile_m(99.0),
            max_m: tally.max_m(),
        }
    }
}

/// A DEM to measure surfaces against, and what is known of it without them.
pub struct DemGround<'a> {
    dem: &'a Dem,
    spacing: Metres,
    posts: PostHeights,
    streams: Streams,
    defilade: Defilade,
}

impl<'a> DemGround<'a> {
    /// The part of a DEM that surfaces over `rect` are measured against.
    ///
    /// # Panics
    /// When the DEM does not hold all of `rect`.
    pub fn new(dem: &'a Dem, rect: PostRect, spacing: Metres) -> Self {
        let posts = PostHeights::of_dem(dem, rect);
        let (streams, defilade) = (Streams::of(&posts), Defilade::of(&posts, spacing));
        Self { dem, spacing, posts, streams, defilade }
    }

    /// Measures a surface. Lines of sight are drawn from `seed`; load modules, if there are any that no triangle
    /// reaches over, have `module_cells` a side from post (0, 0) on.
    ///
    /// # Panics
    /// When the triangles cover other posts than this ground.
    pub fn measure(&self, triangles: &Triangles, pairs: u32, seed: u64, module_cells: Option<i32>) -> Measures {
        assert_eq!(triangles.rect(), self.posts.rect(), "the surface covers the ground it is measured against");
        let tin = PostHeights::of_triangles(triangles, &self.posts);
        let edges = Edges::of(triangles);
        Measures {
            residual: ResidualFigures::from(&residuals_at_posts(&self.posts, &tin)),
            line_of_sight: line_of_sight(self.dem, triangles, self.spacing, pairs, seed),
            slope: slope(&self.posts, &tin, self.spacing),
            slope_classes: slope_classes(&self.posts, &tin, self.spacing),
            hausdorff: hausdorff(&self.posts, &tin, triangles, self.spacing),
            drainage: drainage(&self.posts, &self.streams, &Streams::of(&tin)),
            cover: cover(&self.posts, &self.defilade, &Defilade::of(&tin, self.spacing)),
            registration: registration(&self.posts, &tin, self.spacing),
            seams: module_cells.map(|cells| seams_with(triangles, cells, self.spacing, &edges)),
            mesh: form_with(triangles, module_cells, &edges),
        }
    }

    /// Residuals of a surface for each class of ground, by its number; `class_of` gives that of a post.
    ///
    /// # Panics
    /// When the triangles cover other posts than this ground.
    pub fn residuals_by_class(&self, triangles: &Triangles, class_of: impl Fn(Post) -> u8) -> Vec<ResidualFigures> {
        assert_eq!(triangles.rect(), self.posts.rect(), "the surface covers the ground it is measured against");
        let tin = PostHeights::of_triangles(triangles, &self.posts);
        residuals_by_class(&self.posts, &tin, class_of).iter().map(ResidualFigures::from).collect()
    }
}

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
    use crate::regular_grid;
    use crate::scene::full_tin;

    use super::*;

    const SPACING: Metres = Metres(25.0);

    /// Hills of about 30 m with valleys between them, over 120 x 160 cells from a post on.
    fn hills(south_west: Post) -> Dem {
        let north_east = Post::new(south_west.row + 120, south_west.col + 160);
        Dem::from_fn(PostRect::new(south_west, north_east), |post| {
            let (x, y) = (f64::from(post.col), f64::from(post.row));
            let height = 30.0 * (x * 0.23).sin() * (y * 0.19).cos() + 9.0 * (x * 0.7 - y * 0.41).sin() + 0.6 * x;
            Some((height * 128.0).round() as i32)
        })
    }

    #[test]
    fn a_tin_through_every_post_is_perfect_in_every_measure() {
        let dem = hills(Post::new(2, -3));
        let found =
            DemGround::new(&dem, dem.rect(), SPACING).measure(&Triangles::of_tin(&full_tin(&dem)), 500, 1, None);
        assert_eq!((found.residual.max_m, found.residual.posts), (0.0, 121 * 161));
        assert_eq!((found.slope.rms_degrees, found.slope_classes.agreement()), (0.0, 1.0));
        assert_eq!((found.hausdorff.max_m(), found.cover.agreement()), (0.0, 1.0));
        assert_eq!((found.drainage.recall(), found.drainage.precision()), (1.0, 1.0));
        assert_eq!((found.drainage.pits_spurious, found.drainage.pits_missed), (0, 0));
        let aside = found.registration.unwrap();
        assert!((aside.correlation - 1.0).abs() < 1e-12 && aside.aside_m() < 2.0 && aside.up_m == 0.0, "{aside:?}");
        assert!(found.mesh.is_sound() && found.seams.is_none() && 0.97 < found.line_of_sight.agreement());
    }

    #[test]
    fn the_coarser_the_grid_the_worse_every_measure() {
        let dem = hills(Post::new(0, 0));
        let ground = DemGround::new(&dem, dem.rect(), SPACING);
        let measured = |triangles: u64| {
            let grid = regular_grid(&dem, dem.rect(), triangles);
            ground.measure(&Triangles::of_tin(&grid.tin), 3000, 1, Some(20))
        };
        let (fine, coarse) = (measured(9600), measured(384));
        let pairs = |a: &Measures| {
            [
                a.residual.rms_m,
                a.residual.p95_m,
                a.residual.p99_m,
                a.slope.rms_degrees,
                a.slope.normal_p95_degrees,
                a.hausdorff.mean_m(),
                a.hausdorff.max_m(),
                1.0 - a.line_of_sight.agreement(),
                1.0 - a.slope_classes.agreement(),
                1.0 - a.cover.agreement(),
                1.0 - a.drainage.recall(),
                1.0 - a.registration.unwrap().correlation,
            ]
        };
        for (number, (fine, coarse)) in pairs(&fine).into_iter().zip(pairs(&coarse)).enumerate() {
            assert!(fine < coarse, "measure {number}: {fine} on the fine grid, {coarse} on the coarse one");
        }
        // What lies straight below is never nearer than the nearest place.
        assert!(coarse.hausdorff.dem_to_tin.max_m <= coarse.residual.max_m);
        assert!(fine.mesh.is_sound() && fine.seams.is_some());
    }

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
