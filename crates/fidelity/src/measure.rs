//! The exact pass over the posts that load modules own.

use geometry::Facet;
use geometry::owned::{PostGrid, visit_residuals};
use terrain::{Dem, Importance, LoadModule, ModuleGrid, ModuleResidual, Spacing};

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
    let one_class = ground.mask.classes_of_row(rect.south).is_none();
    let whole = ground.dem.void_count() == 0;
    let mut own = Sums::default();
    match (one_class, whole) {
        (true, true) => {
            let mut histogram = all.class(0).histogram();
            visit(module, ground, |_, residual| {
                own.add(residual);
                histogram.add(residual);
            });
            all.class(0).add_sums(&own);
        }
        _ => visit(module, ground, |post, residual| {
            if whole || !ground.dem.is_void(post) {
                own.add(residual);
                all.class(ground.mask.class(post)).add(residual);
            }
        }),
    }
    // A load module has at most 2^26 posts, so an RMS residual of 4 km fits.
    let sum_squared = own.sum_squared as u64;
    ModuleResidual { posts: own.posts, largest: own.largest, sum_abs: own.sum_abs, sum_squared }
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

#[cfg(test)]
mod tests {
    use terrain::{Decks, ModuleId, ModuleVertex, Post};

    use fastrand::Rng;

    use super::*;

    const GRID: ModuleGrid = ModuleGrid { rows: 2, cols: 3, side_cells: 20 };

    /// A load module over random vertices, `step` quanta apart at least, some on its sides.
    fn random_module(id: ModuleId, spacing: Spacing, step: u32, draw: &mut Rng) -> LoadModule {
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
        let triangles: Vec<_> = mesh::delaunay(&points).into_iter().map(|t| t.map(|v| v as u16)).collect();
        let mut vertex = |(y, x): (u32, u32)| {
            let z = draw.i32(-50_000..50_000);
            ModuleVertex { y: y as u16, x: x as u16, z }
        };
        LoadModule {
            id,
            side: side as u16,
            vertices: places.into_iter().map(&mut vertex).collect(),
            classes: vec![0; triangles.len()],
            polygon_count: triangles.len() as u32,
            triangles,
            residual: ModuleResidual::default(),
            decks: Decks::default(),
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
        let mut draw = Rng::with_seed(seed);
        let spacing = Spacing::from_sixteenths(sixteenths).unwrap();
        let window = GRID.area().grown(3);
        let dem = Dem::from_fn(window, |_| (!voids || 0 < draw.u32(..9)).then(|| draw.i32(-50_000..50_000)));
        let mask = if classes {
            let classes = (0..window.post_count()).map(|_| draw.u8(..4)).collect();
            Importance::new(window, vec![1000; window.post_count()], classes)
        } else {
            Importance::uniform(window, 1000)
        };
        let ground = Reference { dem: &dem, mask: &mask, grid: GRID, spacing };
        let mut modules: Vec<_> = GRID.all().iter().map(|id| random_module(id, spacing, step, &mut draw)).collect();
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
    fn voids_are_in_no_figure_and_classes_are_told_apart() {
        (0..6).for_each(|seed| check(seed, true, true, 400, 400));
        (0..6).for_each(|seed| check(seed, true, false, 400, 1));
        (0..6).for_each(|seed| check(seed, false, true, 404, 1));
    }
}
