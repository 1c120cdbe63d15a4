//! Clipped edges: the paper's merge. The points of a tile and of its surroundings are triangulated again and
//! every triangle is clipped to the load modules it lies in (Polis and McKeown, AutoCarto 11, 1993).
//!
//! The merge stays local. Every load module has its corners among the points, so an empty circle centred inside
//! the area has a radius of at most side / sqrt 2; one centred outside reaches in only over a chord between two
//! points of the outer border, less than a side long. So every point of a triangle that reaches into
//! the tile, and every point on its circle, lies within side * sqrt 2 of the tile, and a tile finds the same
//! triangles alone as the whole area would.

use terrain::geometry::cut::{Line, crossing};
use terrain::geometry::{LocalPost, WORKING_POSTS_MAX};
use terrain::mesh::Mesh;
use terrain::{Dem, Importance, LATTICE_PER_POST, LatticePoint, LoadModule, ModuleRect, Post, Vertex};

use crate::load_modules::Layout;
use crate::load_modules::outline::{Mark, What, outline, reach};
use crate::load_modules::pieces::{Corner, Pieces};

/// Where the height of a crossing comes from.
#[derive(Clone, Copy, Debug)]
pub enum ClipHeights<'a> {
    /// The edge that crosses: pieces stay in their triangle's plane. The paper's.
    Coplanar,
    /// The DEM along the module line, bilinear: the paper's untried alternative. The window holds the tile.
    Dem(&'a Dem),
}

/// How many posts around a tile its load modules depend on.
pub fn halo_posts(side_cells: i32) -> i32 {
    (2 * i64::from(side_cells) * i64::from(side_cells)).isqrt() as i32
}

/// The load modules of a tile, row by row, from the points in and around it.
///
/// `points` stand on whole posts and hold every point of the area within [`halo_posts`] of the tile, in any
/// order; further ones and equal ones more than once do no harm. Corners of load modules are among them, and the outer
/// border has points no further apart than a side. `mask` gives the classes of the tile's posts. Residuals
/// are left empty.
///
/// # Panics
/// When the corner of a load module in or beside the tile is no point.
pub fn clip(points: &[Vertex], layout: &Layout, heights: ClipHeights, mask: &Importance) -> Vec<LoadModule> {
    let points = points_around(points, layout);
    assert_corners(&points, layout);
    let mut clipper = Clipper::new(layout, heights);
    triangulate(&points, layout, |triangle| clipper.add(triangle));
    let modules = layout.modules.iter().zip(&clipper.pieces);
    modules.map(|(id, pieces)| pieces.load_module(id, layout, mask, None)).collect()
}

/// The points a tile's load modules depend on, each once, in canonical order.
///
/// # Panics
/// When a point is given with two heights, or lies between posts.
pub(crate) fn points_around(points: &[Vertex], layout: &Layout) -> Vec<Vertex> {
    let halo = halo_posts(layout.grid.side_cells);
    let window = layout.grid.posts_of_rect(layout.modules).grown(halo);
    let (low, high) = (LatticePoint::from(window.south_west()), LatticePoint::from(window.north_east()));
    let around = |at: LatticePoint| low.row <= at.row && at.row <= high.row && low.col <= at.col && at.col <= high.col;
    let mut near: Vec<_> = points.iter().copied().filter(|vertex| around(vertex.at)).collect();
    near.sort_unstable();
    near.dedup();
    assert!(near.iter().all(|vertex| vertex.at.post().is_some()), "points to clip stand on whole posts");
    let distinct = near.windows(2).all(|pair| pair[0].at < pair[1].at);
    assert!(distinct, "a point has one height in every tile that lists it");
    near
}

/// Calls `each` with the triangles of the canonical Delaunay triangulation that may reach into the tile.
///
/// The mesh grows from corners of load modules up to two sides away. Some of those may be no points: no circle that
/// reaches into the tile comes that far, so their triangles are others.
fn triangulate(points: &[Vertex], layout: &Layout, mut each: impl FnMut([Vertex; 3])) {
    let (grid, tile) = (layout.grid, layout.modules);
    let wide = ModuleRect {
        south: tile.south.saturating_sub(2),
        west: tile.west.saturating_sub(2),
        north: (tile.north + 2).min(grid.rows),
        east: (tile.east + 2).min(grid.cols),
    };
    let window = grid.posts_of_rect(wide);
    if WORKING_POSTS_MAX < window.posts_high().max(window.posts_wide()) {
        let places: Vec<_> = points.iter().map(|vertex| vertex.at).collect();
        return terrain::mesh::delaunay(&places)
            .into_iter()
            .for_each(|triangle| each(triangle.map(|v| points[v as usize])));
    }
    let mut mesh = Mesh::with_corners_every(window, grid.side_cells);
    mesh.reserve(points.len());
    let mut hint = 0;
    for vertex in points {
        let at = vertex.at.post().expect("points to clip stand on whole posts");
        let post = LocalPost::of(at, window);
        let triangle = mesh.triangle_at(post, hint);
        if !mesh.triangles()[triangle as usize].corners.contains(&post) {
            hint = mesh.insert(post, triangle)[0];
        }
    }
    // Where each row of posts begins among the points.
    let start = |row: i32| points.partition_point(|vertex| vertex.at < Post::new(row, window.west).into());
    let starts: Vec<usize> = (window.south..=window.north + 1).map(start).collect();
    for triangle in mesh.triangles() {
        let corners = triangle.corners.map(|corner| {
            let row = &points[starts[corner.row() as usize]..starts[corner.row() as usize + 1]];
            let place = row.binary_search_by_key(&corner.post(window).into(), |vertex| vertex.at);
            place.ok().map(|place| row[place])
        });
        if let [Some(a), Some(b), Some(c)] = corners {
            each([a, b, c]);
        }
    }
}

/// Where a mark is: north and east of the area's corner, height (all in quanta), whether it is a crossing.
type Place = (i64, i64, i32, bool);

struct Clipper<'a> {
    layout: &'a Layout,
    heights: ClipHeights<'a>,
    side: i32,
    pieces: Vec<Pieces>,
    marks: Vec<Mark>,
    places: Vec<Place>,
}

impl<'a> Clipper<'a> {
    fn new(layout: &'a Layout, heights: ClipHeights<'a>) -> Self {
        let pieces = vec![Pieces::default(); layout.modules.count()];
        Self { layout, heights, side: layout.side_lattice(), pieces, marks: Vec::new(), places: Vec::new() }
    }

    /// Adds the pieces that a triangle has in the load modules of the tile.
    fn add(&mut self, triangle: [Vertex; 3]) {
        let corners = triangle.map(|vertex| vertex.at);
        let (rows, cols) = reach(corners, self.side);
        let tile = self.layout.modules;
        let (south, north) = (rows.0.max(tile.south as i32), rows.1.min(tile.north as i32 - 1));
        let (west, east) = (cols.0.max(tile.west as i32), cols.1.min(tile.east as i32 - 1));
        if north < south || east < west {
            return;
        }
        if rows.0 == rows.1 && cols.0 == cols.1 {
            // Most triangles lie in one load module and are a piece as they are.
            return self.push(rows.0, cols.0, triangle.map(|vertex| self.vertex(vertex)).into_iter());
        }
        outline(corners, self.side, &mut self.marks);
        self.place_marks(&triangle);
        for row in south..=north {
            for col in west..=east {
                let inside = |(mark, place): (&Mark, &Place)| mark.lies_in(row, col).then_some(*place);
                let piece: Vec<_> = self.marks.iter().zip(&self.places).filter_map(inside).collect();
                if 3 <= piece.len() {
                    self.push(row, col, piece.into_iter());
                }
            }
        }
    }

    fn push(&mut self, row: i32, col: i32, piece: impl Iterator<Item = Place>) {
        let slot = self.layout.slot(row, col).expect("pieces are made for load modules of the tile");
        let side = i64::from(self.layout.side());
        let (south, west) = (i64::from(row) * side, i64::from(col) * side);
        self.pieces[slot].push(piece.map(|(y, x, z, is_crossing)| Corner::new(y - south, x - west, z, is_crossing)));
    }

    fn place_marks(&mut self, triangle: &[Vertex; 3]) {
        self.places.clear();
        for mark in &self.marks {
            let place = match mark.what {
                What::Corner(i) => self.vertex(triangle[i]),
                What::Crossing(i, line) if self.holds(mark) => self.crossing(triangle[i], triangle[(i + 1) % 3], line),
                // No load module of the tile asks for it, and the DEM window may not reach it.
                What::Crossing(..) => (0, 0, 0, true),
            };
            self.places.push(place);
        }
    }

    fn holds(&self, mark: &Mark) -> bool {
        let rows = [mark.rows.0, mark.rows.1];
        rows.into_iter().any(|row| self.layout.slot(row, mark.cols.0).or(self.layout.slot(row, mark.cols.1)).is_some())
    }

    fn vertex(&self, vertex: Vertex) -> Place {
        let step = i64::from(self.layout.spacing.quanta_per_lattice_step());
        (i64::from(vertex.at.row) * step, i64::from(vertex.at.col) * step, vertex.height, false)
    }

    fn crossing(&self, a: Vertex, b: Vertex, line: Line) -> Place {
        let crossing = crossing(a, b, line, self.layout.spacing);
        let height = match self.heights {
            ClipHeights::Coplanar => crossing.height,
            ClipHeights::Dem(dem) => height_on_line(dem, line, crossing.along, self.layout.spacing.quanta_per_post()),
        };
        let step = i64::from(self.layout.spacing.quanta_per_lattice_step());
        match line {
            Line::Row(row) => (i64::from(row) * step, crossing.along, height, true),
            Line::Col(col) => (crossing.along, i64::from(col) * step, height, true),
        }
    }
}

/// Height of the DEM on a module line, between its two posts there, half away from zero.
fn height_on_line(dem: &Dem, line: Line, along: i64, quanta_per_post: i32) -> i32 {
    let step = i64::from(quanta_per_post);
    let (before, part) = ((along / step) as i32, along % step);
    let at = |along: i32| match line {
        Line::Row(row) => i64::from(dem.height(Post::new(row / LATTICE_PER_POST, along))),
        Line::Col(col) => i64::from(dem.height(Post::new(along, col / LATTICE_PER_POST))),
    };
    let numerator = at(before) * (step - part) + if part == 0 { 0 } else { at(before + 1) * part };
    (numerator.signum() * ((2 * numerator.abs() + step) / (2 * step))) as i32
}

/// Holds what the halo rests on: corners of the load modules in and beside the tile are points.
fn assert_corners(points: &[Vertex], layout: &Layout) {
    let area = layout.grid.area();
    let around = layout.grid.posts_of_rect(layout.modules).grown(layout.grid.side_cells);
    let lines = |low: i32, high: i32| (low..=high).step_by(layout.grid.side_cells as usize);
    for row in lines(around.south, around.north) {
        for col in lines(around.west, around.east) {
            let corner = Post::new(row, col);
            let is_point = points.binary_search_by_key(&corner.into(), |vertex| vertex.at).is_ok();
            assert!(is_point || !area.contains(corner), "points are missing: a load module has its corner at {corner}");
        }
    }
}

#[cfg(test)]
mod tests {
    use fastrand::Rng;
    use terrain::{ModuleGrid, ModuleRect, Spacing};

    use super::*;
    use crate::load_modules::sheets::{assert_sides_are_shared, points, side_list};

    fn whole(grid: ModuleGrid, spacing_m: f64) -> Layout {
        Layout { grid, modules: grid.all(), spacing: Spacing::from_metres(spacing_m).unwrap() }
    }

    fn clip_all(points: &[Vertex], layout: &Layout, mask: &Importance) -> Vec<LoadModule> {
        clip(points, layout, ClipHeights::Coplanar, mask)
    }

    /// Classes in bands that no load module line follows.
    fn mask(layout: &Layout) -> Importance {
        let area = layout.grid.area();
        let classes = area.posts().map(|post| ((post.row + 2 * post.col) / 17 % 3) as u8).collect();
        Importance::new(area, vec![1000; area.post_count()], classes)
    }

    /// Every load module is sound and agrees with its neighbours; what one tile after the other makes from the
    /// points around it is what the whole area makes.
    #[track_caller]
    fn check(points: &[Vertex], layout: &Layout, mask: &Importance, cuts: (&[u32], &[u32])) {
        let all = clip_all(points, layout, mask);
        all.iter().for_each(|module| assert_eq!(module.check(), Ok(()), "load module {}", module.id));
        assert_sides_are_shared(&all, layout.modules);
        let halo = halo_posts(layout.grid.side_cells);
        for rows in cuts.0.windows(2) {
            for cols in cuts.1.windows(2) {
                let modules = ModuleRect { south: rows[0], north: rows[1], west: cols[0], east: cols[1] };
                let tile = Layout { modules, ..*layout };
                let window = layout.grid.posts_of_rect(modules).grown(halo);
                let near: Vec<_> =
                    points.iter().copied().filter(|v| window.contains(v.at.post().unwrap())).rev().collect();
                let expected: Vec<_> = all.iter().filter(|module| modules.contains(module.id)).cloned().collect();
                assert_eq!(clip_all(&near, &tile, mask), expected, "tile {modules:?}");
            }
        }
    }

    #[test]
    fn a_tile_with_its_halo_makes_the_load_modules_of_the_whole_area() {
        for seed in 0..12 {
            let grid = ModuleGrid { rows: 6, cols: 7, side_cells: 20 };
            // From nearly empty load modules, whose triangles are largest, to full ones.
            let count = [0, 5, 20, 60, 200, 900][seed as usize % 6];
            let points = points(grid, [5, 20, 10][seed as usize % 3], count, seed);
            let layout = whole(grid, 25.0);
            let mask = mask(&layout);
            check(&points, &layout, &mask, (&[0, 2, 4, 6], &[0, 2, 4, 7]));
            check(&points, &layout, &mask, (&[0, 3, 6], &[0, 1, 6, 7]));
            check(&points, &layout, &mask, (&[0, 1, 2, 3, 4, 5, 6], &[0, 7]));
        }
    }

    /// Corners and outer border of 2 x 3 load modules of 4000 cells, and small clusters far from each other, some
    /// beside a module line: edges between clusters run so close that their crossings round together.
    fn clusters(grid: ModuleGrid, seed: u64) -> Vec<Vertex> {
        let (mut draw, area) = (Rng::with_seed(seed), grid.area());
        let mut places = std::collections::BTreeSet::new();
        for row in (0..=area.north).step_by(grid.side_cells as usize) {
            for col in (0..=area.east).step_by(grid.side_cells as usize) {
                places.insert(Post::new(row, col));
            }
        }
        for i in 0..14 {
            let at = |far: i32, draw: &mut Rng| draw.i32(10..far - 10);
            let (row, mut col) = (at(area.north, &mut draw), at(area.east, &mut draw));
            if i % 2 == 0 {
                col = grid.side_cells - 3;
            }
            for _ in 0..2 + draw.u32(..9) {
                places.insert(Post::new(row + draw.i32(0..5), col + draw.i32(0..7)));
            }
        }
        places.into_iter().map(|post| Vertex { at: post.into(), height: draw.i32(0..999) }).collect()
    }

    #[test]
    fn a_window_too_large_for_the_mesh_kernel_has_the_same_load_modules() {
        // The whole is 20,000 posts wide, and what surrounds the outer tiles 12,000.
        let grid = ModuleGrid { rows: 1, cols: 5, side_cells: 4000 };
        let layout = whole(grid, 0.0625);
        for seed in 0..10 {
            check(&clusters(grid, seed), &layout, &Importance::uniform(grid.area(), 1000), (&[0, 1], &[0, 1, 4, 5]));
        }
    }

    #[test]
    fn crossings_that_round_to_one_quantum_leave_load_modules_sound() {
        // Posts 1/16 m apart are 8 quanta apart.
        let grid = ModuleGrid { rows: 2, cols: 3, side_cells: 4000 };
        let layout = whole(grid, 0.0625);
        let (mut cut, mut kept) = (0, 0);
        for seed in 0..100 {
            let points = clusters(grid, seed);
            check(&points, &layout, &Importance::uniform(grid.area(), 1000), (&[0, 1, 2], &[0, 1, 3]));
            cut += piece_count(&points, &layout);
            kept += clip_all(&points, &layout, &Importance::uniform(grid.area(), 1000))
                .iter()
                .map(|module| module.polygon_count as usize)
                .sum::<usize>();
        }
        assert!(kept < cut, "some of {cut} pieces are welded away");
    }

    /// Pieces before any are welded away.
    fn piece_count(points: &[Vertex], layout: &Layout) -> usize {
        let places: Vec<_> = points.iter().map(|v| v.at).collect();
        let mut marks = Vec::new();
        let mut count = 0;
        for triangle in terrain::mesh::delaunay(&places) {
            outline(triangle.map(|v| places[v as usize]), layout.side_lattice(), &mut marks);
            let sides =
                |id: &terrain::ModuleId| marks.iter().filter(|m| m.lies_in(id.row as i32, id.col as i32)).count();
            count += layout.modules.iter().filter(|id| 3 <= sides(id)).count();
        }
        count
    }

    #[test]
    fn pieces_stay_in_the_plane_of_their_triangle_within_a_quantum() {
        let grid = ModuleGrid { rows: 4, cols: 4, side_cells: 20 };
        let layout = whole(grid, 25.0);
        // A plane: every crossing of every edge must lie on it.
        let height = |y: i64, x: i64| (3 * y + 5 * x) as f64 / 1000.0;
        let mut points = points(grid, 5, 60, 8);
        for point in &mut points {
            let place = (i64::from(point.at.row) * 400, i64::from(point.at.col) * 400);
            point.height = height(place.0, place.1).round() as i32;
        }
        for module in clip_all(&points, &layout, &mask(&layout)) {
            let (south, west) = (i64::from(module.id.row) * 64_000, i64::from(module.id.col) * 64_000);
            for v in &module.vertices {
                let plane = height(south + i64::from(v.y), west + i64::from(v.x));
                assert!((f64::from(v.z) - plane).abs() <= 1.01);
            }
        }
    }

    #[test]
    fn heights_of_crossings_can_come_from_the_dem() {
        let grid = ModuleGrid { rows: 3, cols: 3, side_cells: 20 };
        let layout = whole(grid, 25.0);
        let points = points(grid, 5, 50, 4);
        let dem = Dem::from_fn(grid.area(), |post| Some(post.row * 700 - post.col * 31 * (post.col % 3)));
        let modules = clip(&points, &layout, ClipHeights::Dem(&dem), &mask(&layout));
        assert_sides_are_shared(&modules, layout.modules);
        let middle = &modules[4];
        let on_dem = side_list(middle, terrain::Side::West).into_iter().filter(|&(y, z)| {
            let (row, part) = (20 + i32::from(y) / 3200, i64::from(y) % 3200);
            let of = |row: i32| i64::from(dem.height(Post::new(row, 20)));
            let exact = (of(row) * (3200 - part) + of((row + 1).min(60)) * part) as f64 / 3200.0;
            (f64::from(z) - exact).abs() <= 0.5
        });
        // The two corners are points with heights of their own.
        assert_eq!(on_dem.count() + 2, middle.side_vertices(terrain::Side::West).len());
        let tile = Layout { modules: ModuleRect { south: 1, west: 1, north: 2, east: 2 }, ..layout };
        let window = dem.window(grid.posts_of_rect(tile.modules));
        assert_eq!(&clip(&points, &tile, ClipHeights::Dem(&window), &mask(&layout))[0], middle);
    }

    #[test]
    fn polygons_are_fewer_than_triangles_where_edges_are_cut() {
        let grid = ModuleGrid { rows: 3, cols: 3, side_cells: 20 };
        let layout = whole(grid, 25.0);
        let modules = clip_all(&points(grid, 5, 60, 2), &layout, &mask(&layout));
        let sum = |of: fn(&LoadModule) -> usize| modules.iter().map(of).sum::<usize>();
        let (polygons, triangles) = (sum(|m| m.polygon_count as usize), sum(|m| m.triangles.len()));
        assert!(polygons < triangles && triangles < 2 * polygons, "{polygons} polygons, {triangles} triangles");
    }

    #[test]
    #[should_panic(expected = "points are missing")]
    fn a_hole_in_the_points_larger_than_the_halo_is_found() {
        let grid = ModuleGrid { rows: 6, cols: 6, side_cells: 20 };
        let mut points = points(grid, 5, 0, 2);
        points.retain(|v| v.at.post() != Some(Post::new(60, 60)));
        let modules = ModuleRect { south: 2, west: 2, north: 4, east: 4 };
        let layout = Layout { modules, ..whole(grid, 25.0) };
        clip_all(&points, &layout, &mask(&layout));
    }

    #[test]
    #[should_panic(expected = "a point has one height")]
    fn a_point_with_two_heights_is_refused() {
        let grid = ModuleGrid { rows: 1, cols: 1, side_cells: 20 };
        let mut points = points(grid, 5, 3, 2);
        points.push(Vertex { height: points[0].height + 1, ..points[0] });
        let layout = whole(grid, 25.0);
        clip_all(&points, &layout, &mask(&layout));
    }
}
