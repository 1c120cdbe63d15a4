//! The exact pass over the posts that load modules own.

use std::ops::Range;

use fearless_simd::prelude::*;
use fearless_simd::{Simd, dispatch, f64x8, i32x8, mask64x8};
use terrain::geometry::Facet;
use terrain::geometry::owned::{PostGrid, visit_residuals};
use terrain::{Dem, Importance, LoadModule, ModuleGrid, ModuleResidual, Post, Spacing};

use crate::tally::{Residuals, Sums};

/// The ground that load modules are measured against.
#[derive(Clone, Copy, Debug)]
pub struct Reference<'a> {
    /// Heights at all posts of the load modules; voids are skipped.
    pub dem: &'a Dem,
    /// Classes of the same posts. Weights are not used: every post counts once.
    pub mask: &'a Importance,
    /// Where load modules lie.
    pub grid: ModuleGrid,
    /// Metres between posts.
    pub spacing: Spacing,
}

/// Measures load modules against the posts they own, writes each one's residual into it, and gives the
/// residuals of all of them.
///
/// # Panics
/// When the windows of `ground` do not hold all posts of the load modules.
pub fn measure(modules: &mut [LoadModule], ground: &Reference) -> Residuals {
    let mut all = Residuals::default();
    for module in modules {
        module.residual = count(module, ground, &mut all);
    }
    all
}

/// The residuals of the posts that one load module owns.
///
/// # Panics
/// When the windows of `ground` do not hold all posts of the load module.
pub fn residuals(module: &LoadModule, ground: &Reference) -> Residuals {
    let mut all = Residuals::default();
    count(module, ground, &mut all);
    all
}

/// Calls `each` with every post that a load module owns and its residual: DEM less triangles, in quanta. Voids are left
/// out.
///
/// # Panics
/// When the window of `ground` does not hold all posts of the load module.
pub fn each_residual(module: &LoadModule, ground: &Reference, mut each: impl FnMut(terrain::Post, i32)) {
    let whole = ground.dem.void_count() == 0;
    visit(module, ground, |post, residual| {
        if whole || !ground.dem.is_void(post) {
            each(post, residual);
        }
    });
}

fn count(module: &LoadModule, ground: &Reference, all: &mut Residuals) -> ModuleResidual {
    let rect = ground.grid.posts_of(module.id);
    assert!(ground.dem.rect().contains_rect(&rect), "the DEM window holds load module {}", module.id);
    assert!(ground.mask.rect().contains_rect(&rect), "the mask window holds load module {}", module.id);
    let level = terrain::geometry::widest_level();
    let own = dispatch!(level, simd => sums(simd, module, ground, all));
    // A load module has at most 2^26 posts, so an RMS residual of 4 km fits.
    let sum_squared = own.sum_squared as u64;
    ModuleResidual { posts: own.posts, largest: own.largest, sum_abs: own.sum_abs, sum_squared }
}

#[inline(always)]
fn sums<S: Simd>(simd: S, module: &LoadModule, ground: &Reference, all: &mut Residuals) -> Sums {
    let rect = ground.grid.posts_of(module.id);
    let owned = Owned::new(module, ground);
    let residuals = owned.residuals(simd);
    let one_class = ground.mask.classes_of_row(rect.south).is_none();
    let mut own = Sums::default();
    if one_class && ground.dem.void_count() == 0 {
        own.add_rounded(residuals.values(), all.class(0).histogram());
        all.class(0).add_sums(&own);
        return own;
    }
    let posts = (0..owned.high).flat_map(|row| (0..owned.wide).map(move |col| (row, col)));
    for ((row, col), &residual) in posts.zip(residuals.values()) {
        let post = Post::new(rect.south + row as i32, rect.west + col as i32);
        if !residual.is_nan() && !ground.dem.is_void(post) {
            own.add(residual as i32);
            all.class(ground.mask.class(post)).add(residual as i32);
        }
    }
    own
}

/// The posts that a load module owns.
struct Owned<'a> {
    module: &'a LoadModule,
    dem: &'a Dem,
    posts: PostGrid,
    high: usize,
    wide: usize,
    /// Bound of what its heights differ from those of its posts by, in quanta; none where one has more than 24 bits.
    relief: Option<i64>,
}

impl<'a> Owned<'a> {
    #[inline(always)]
    fn new(module: &'a LoadModule, ground: &Reference<'a>) -> Self {
        let posts = PostGrid::of_module(ground.grid, module.id, ground.spacing);
        let owned = |far: Option<i32>| (ground.grid.side_cells + i32::from(far.is_some())) as usize;
        let (high, wide) = (owned(posts.far_row), owned(posts.far_col));
        let (dem, rect) = (ground.dem, ground.grid.posts_of(module.id));
        let rows = (rect.south..=rect.north).map(|row| &dem.row(row)[(rect.west - dem.rect().west) as usize..][..wide]);
        let between = |(low, top): (i32, i32), height: i32| (low.min(height), top.max(height));
        let of_row = |ends, row: &[i32]| row.iter().copied().fold(ends, between);
        let ends = rows.fold((i32::MAX, i32::MIN), of_row);
        let (low, top) = module.vertices.iter().map(|vertex| vertex.z).fold(ends, between);
        let fits = -terrain::geometry::WIDENED_MAX <= low && top <= terrain::geometry::WIDENED_MAX;
        let relief = fits.then(|| i64::from(top) - i64::from(low));
        Self { module, dem, posts, high, wide, relief }
    }

    /// The residual at each post, rounded to quanta; NaN where no triangle is.
    #[inline(always)]
    fn residuals<S: Simd>(&self, simd: S) -> ByPost {
        let mut residuals = ByPost::new(self.high, self.wide);
        for &triangle in &self.module.triangles {
            let facet = facet(self.module, triangle);
            if self.is_exact(&facet) {
                self.lay(simd, &facet, &mut residuals);
            } else {
                visit_residuals(&self.posts, &facet, self.dem, |post, residual| {
                    let (row, col) = (post.row - self.posts.origin.row, post.col - self.posts.origin.col);
                    residuals.set(row as usize, col as usize, f64::from(residual));
                });
            }
        }
        residuals
    }

    /// Whether numerators of residuals are whole numbers that `f64` holds; not at the area's far borders, where other
    /// triangles own posts on edges.
    #[inline(always)]
    fn is_exact(&self, facet: &Facet) -> bool {
        let reach = 2 * i64::from(self.module.side);
        let plane = (facet.px.abs() + facet.py.abs()) * reach;
        let is_inner = self.posts.far_row.is_none() && self.posts.far_col.is_none();
        is_inner && self.relief.is_some_and(|relief| facet.den * relief + plane < 1 << 51)
    }

    #[inline(always)]
    fn lay<S: Simd>(&self, simd: S, facet: &Facet, residuals: &mut ByPost) {
        let step = self.posts.units_per_post;
        let (west, east, south, north) = facet.bounds();
        let range = |low: i32, high: i32, end: usize| {
            (low as usize).div_ceil(step as usize)..(high as usize / step as usize + 1).min(end)
        };
        let (rows, cols) = (range(south, north, self.high), range(west, east, self.wide));
        let splat = |v: f64| f64x8::splat(simd, v);
        let edges = [0, 1, 2].map(|edge| {
            let (dx, dy) = facet.edge(edge);
            // A post on an edge lies inside after the shift, or outside; all else is whole.
            let on_edge = if facet.owns_edge(edge) { 0.5 } else { 0.0 };
            let (north, east) = (i64::from(dx) * i64::from(step), i64::from(dy) * i64::from(step));
            (facet.edge_at(edge, 0, 0) as f64 + on_edge, north as f64, splat(east as f64))
        });
        let division = Division::by(simd, facet.den);
        let (z0, den, zero) = (splat(f64::from(facet.z[0])), splat(facet.den as f64), splat(0.0));
        let east = splat((facet.px * i64::from(step)) as f64);
        let (heights, stride) = self.dem.padded();
        let first = self.posts.origin;
        let first = (first.row - self.dem.rect().south) as usize * stride + (first.col - self.dem.rect().west) as usize;
        residuals.write(simd, (rows, cols), |row, col, cols| {
            let [a, b, c] = edges.map(|(start, north, east)| splat(start + row as f64 * north) - cols * east);
            let is_inside = a.simd_gt(zero) & b.simd_gt(zero) & c.simd_gt(zero);
            let y = row as i64 * i64::from(step) - i64::from(facet.y[0]);
            let plane = splat((facet.py * y - facet.px * i64::from(facet.x[0])) as f64) + cols * east;
            let heights = &heights[first + row * stride + col..][..8];
            let above = terrain::geometry::widened(simd, i32x8::from_slice(simd, heights)) - z0;
            (is_inside, division.rounded(above * den - plane))
        });
    }
}

/// Division of eight whole numbers below 2^52 by one, half away from zero: a reciprocal guesses, the remainder decides.
#[derive(Clone, Copy)]
struct Division<S: Simd> {
    den: f64x8<S>,
    reciprocal: f64x8<S>,
    half: f64x8<S>,
    one: f64x8<S>,
    zero: f64x8<S>,
}

impl<S: Simd> Division<S> {
    #[inline(always)]
    fn by(simd: S, den: i64) -> Self {
        let den = den as f64;
        let splat = |v: f64| f64x8::splat(simd, v);
        Self { den: splat(den), reciprocal: splat(1.0 / den), half: splat(0.5), one: splat(1.0), zero: splat(0.0) }
    }

    #[inline(always)]
    fn rounded(&self, numerator: f64x8<S>) -> f64x8<S> {
        let guess = (numerator * self.reciprocal + self.half).floor();
        let rest = numerator - guess * self.den;
        // Twice the rest is whole; a half more decides where it is the denominator.
        let doubled = rest + rest + self.half.copysign(numerator);
        let up = doubled.simd_gt(self.den).select(self.one, self.zero);
        let down = doubled.simd_lt(-self.den).select(self.one, self.zero);
        guess + up - down
    }
}

/// Calls `each` with every post that one triangle of a load module owns and its residual, voids included.
pub(crate) fn visit_triangle(
    module: &LoadModule,
    ground: &Reference,
    triangle: [u16; 3],
    each: impl FnMut(terrain::Post, i32),
) {
    let posts = PostGrid::of_module(ground.grid, module.id, ground.spacing);
    visit_residuals(&posts, &facet(module, triangle), ground.dem, each);
}

#[inline(always)]
fn facet(module: &LoadModule, triangle: [u16; 3]) -> Facet {
    let corners = triangle.map(|v| module.vertices[usize::from(v)]);
    Facet::new(corners.map(|v| i32::from(v.x)), corners.map(|v| i32::from(v.y)), corners.map(|v| v.z))
}

#[inline(always)]
fn visit(module: &LoadModule, ground: &Reference, mut each: impl FnMut(terrain::Post, i32)) {
    let posts = PostGrid::of_module(ground.grid, module.id, ground.spacing);
    for &triangle in &module.triangles {
        visit_residuals(&posts, &facet(module, triangle), ground.dem, &mut each);
    }
}

/// Posts that are written together.
const LANES: usize = 8;
const IOTA: [f64; LANES] = [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0];

/// One value a post, by rows from the south-west post on; NaN where none was written.
pub(crate) struct ByPost {
    values: Vec<f64>,
    wide: usize,
}

impl ByPost {
    pub fn new(high: usize, wide: usize) -> Self {
        // The last row may be written beyond its end.
        Self { values: vec![f64::NAN; high * wide + LANES], wide }
    }

    /// The values, row by row.
    pub fn values(&self) -> &[f64] {
        &self.values[..self.values.len() - LANES]
    }

    pub fn set(&mut self, row: usize, col: usize, value: f64) {
        self.values[row * self.wide + col] = value;
    }

    /// Writes to the posts of some rows and columns. For a row, the first of eight columns and the eight as numbers,
    /// `value` tells which of them to write, none outside of the rectangle, and what.
    #[inline(always)]
    pub fn write<S: Simd>(
        &mut self,
        simd: S,
        (rows, cols): (Range<usize>, Range<usize>),
        mut value: impl FnMut(usize, usize, f64x8<S>) -> (mask64x8<S>, f64x8<S>),
    ) {
        let first = f64x8::from_slice(simd, &IOTA);
        for row in rows {
            for col in cols.clone().step_by(LANES) {
                let (is_inside, new) = value(row, col, first + f64x8::splat(simd, col as f64));
                let held = &mut self.values[row * self.wide + col..][..LANES];
                is_inside.select(new, f64x8::from_slice(simd, held)).store_slice(held);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use std::ops::Range;

    use fastrand::Rng;
    use terrain::{ModuleId, ModuleVertex, Post};

    use super::*;

    const GRID: ModuleGrid = ModuleGrid { rows: 2, cols: 3, side_cells: 20 };

    /// A load module over random vertices, `step` quanta apart at least, some on its sides.
    fn random_module(id: ModuleId, spacing: Spacing, step: u32, heights: Range<i32>, draw: &mut Rng) -> LoadModule {
        let side = (GRID.side_cells * spacing.quanta_per_post()) as u32;
        let mut places: Vec<_> = [(0, 0), (0, side), (side, 0), (side, side)].to_vec();
        for i in 0..17 {
            let mut place = || draw.u32(..=side / step) * step;
            places.push(if i % 4 == 0 { (place(), 0) } else { (place(), place()) });
            places.push(if i % 4 == 0 { (side, place()) } else { (place(), place()) });
        }
        places.sort_unstable();
        places.dedup();
        let points: Vec<_> = places.iter().map(|&(y, x)| Post::new(y as i32, x as i32)).collect();
        let triangles: Vec<_> = terrain::mesh::delaunay(&points).into_iter().map(|t| t.map(|v| v as u16)).collect();
        let mut vertex = |(y, x): (u32, u32)| {
            let z = draw.i32(heights.clone());
            ModuleVertex { y: y as u16, x: x as u16, z }
        };
        LoadModule {
            id,
            side: side as u16,
            vertices: places.into_iter().map(&mut vertex).collect(),
            classes: vec![0; triangles.len()],
            polygon_count: triangles.len() as u32,
            triangles,
            ..LoadModule::default()
        }
    }

    /// The residual at `post`, from the one triangle that holds it after the shift, in 128 bits.
    fn residual_by_search(module: &LoadModule, ground: &Reference, post: Post) -> Option<i32> {
        let (rect, area, q) = (ground.grid.posts_of(module.id), ground.grid.area(), ground.spacing.quanta_per_post());
        let (x, y) = (i128::from((post.col - rect.west) * q), i128::from((post.row - rect.south) * q));
        let east = if post.col == area.east { -1 } else { 1 };
        let north = if post.row == area.north { -1 } else { 1 };
        module.triangles.iter().find_map(|&triangle| {
            let [a, b, c] = triangle.map(|v| {
                let v = module.vertices[usize::from(v)];
                (i128::from(v.x), i128::from(v.y), i128::from(v.z))
            });
            let side = |(ax, ay, _): (i128, i128, i128), (bx, by, _): (i128, i128, i128)| {
                let at_post = (bx - ax) * (y - ay) - (by - ay) * (x - ax);
                (at_post, (at_post, -(by - ay) * east, (bx - ax) * north) > (0, 0, 0))
            };
            let ((bc, in_a), (ca, in_b), (ab, in_c)) = (side(b, c), side(c, a), side(a, b));
            let den = ab + bc + ca;
            let numerator = i128::from(ground.dem.height(post)) * den - (a.2 * bc + b.2 * ca + c.2 * ab);
            let rounded = numerator.signum() * ((2 * numerator.abs() + den) / (2 * den));
            (in_a && in_b && in_c).then_some(rounded as i32)
        })
    }

    fn by_search(modules: &[LoadModule], ground: &Reference) -> Residuals {
        let mut all = Residuals::default();
        let area = ground.grid.area();
        for post in area.posts() {
            let module_of = |v: i32, far: u32| (v / ground.grid.side_cells).min(far as i32 - 1) as u32;
            let id = ModuleId { row: module_of(post.row, GRID.rows), col: module_of(post.col, GRID.cols) };
            let module = &modules[GRID.index(id)];
            let residual = residual_by_search(module, ground, post).expect("every post has an owner");
            if !ground.dem.is_void(post) {
                all.class(ground.mask.class(post)).add(residual);
            }
        }
        all
    }

    /// The scan and the search agree, in every sum and bin, and each module's figures add up to the whole.
    #[track_caller]
    fn check(seed: u64, voids: bool, classes: bool, sixteenths: u32, step: u32) {
        check_between(-50_000..50_000, seed, voids, classes, sixteenths, step);
    }

    /// The same for heights of some range, in quanta.
    #[track_caller]
    fn check_between(heights: Range<i32>, seed: u64, voids: bool, classes: bool, sixteenths: u32, step: u32) {
        let mut draw = Rng::with_seed(seed);
        let spacing = Spacing::from_sixteenths(sixteenths).unwrap();
        let window = GRID.area().grown(3);
        let dem = Dem::from_fn(window, |_| (!voids || 0 < draw.u32(..9)).then(|| draw.i32(heights.clone())));
        let mask = if classes {
            let classes = (0..window.post_count()).map(|_| draw.u8(..4)).collect();
            Importance::new(window, vec![1000; window.post_count()], classes)
        } else {
            Importance::uniform(window, 1000)
        };
        let ground = Reference { dem: &dem, mask: &mask, grid: GRID, spacing };
        let mut modules: Vec<_> =
            GRID.all().iter().map(|id| random_module(id, spacing, step, heights.clone(), &mut draw)).collect();
        modules.iter().for_each(|module| assert_eq!(module.check(), Ok(()), "seed {seed}"));
        let found = measure(&mut modules, &ground);
        assert_eq!(found, by_search(&modules, &ground), "seed {seed}");
        let mut merged = Residuals::default();
        for module in &modules {
            let own = residuals(module, &ground);
            let total = own.total();
            let figures = (u64::from(module.residual.posts), module.residual.sum_abs, module.residual.largest);
            assert_eq!(figures, (total.posts, total.sum_abs, total.largest));
            assert_eq!(u128::from(module.residual.sum_squared), total.sum_squared);
            merged.merge(&own);
        }
        assert_eq!(merged, found);
        let counted = GRID.area().posts().filter(|&post| !dem.is_void(post)).count();
        assert_eq!(found.total().posts, counted as u64);
    }

    #[test]
    fn the_scan_equals_the_search_for_vertices_on_the_lattice() {
        (0..12).for_each(|seed| check(seed, false, false, 400, 400));
    }

    #[test]
    fn the_scan_equals_the_search_for_vertices_on_posts() {
        (0..12).for_each(|seed| check(seed, false, false, 16, 128));
    }

    #[test]
    fn the_scan_equals_the_search_for_vertices_anywhere() {
        (0..12).for_each(|seed| check(seed, false, false, 400, 1));
    }

    #[test]
    fn the_scan_equals_the_search_where_some_triangles_are_too_large_and_steep_for_lanes() {
        for top in [5_000_000, 20_000_000, 90_000_000] {
            (0..6).for_each(|seed| check_between(-top..top, seed, false, false, 400, 1));
        }
    }

    #[test]
    fn the_scan_equals_the_search_at_heights_of_more_bits_than_lanes_hold() {
        for base in [-200_000_001, (1 << 24) - 300, 200_000_001] {
            (0..3).for_each(|seed| check_between(base..base + 500, seed, false, false, 400, 1));
        }
    }

    #[test]
    fn voids_are_in_no_figure_and_classes_are_told_apart() {
        (0..6).for_each(|seed| check(seed, true, true, 400, 400));
        (0..6).for_each(|seed| check(seed, true, false, 400, 1));
        (0..6).for_each(|seed| check(seed, false, true, 404, 1));
    }
}
