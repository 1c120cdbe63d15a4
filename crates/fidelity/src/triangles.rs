//! The triangles of a TIN or of load modules, found by place: how high the ground is there, and what a line crosses.
//!
//! Places are east and north in posts of the working grid, heights are in quanta; both are `f64`. A vertex on the
//! lattice keeps its place exactly, and vertices of two load modules at one place keep equal ones.

use terrain::geometry::Cells;
use terrain::{LoadModule, ModuleGrid, PostRect, Spacing, Tin};

/// Side of a cell in posts, at least and at most.
const CELL_POSTS: (f64, f64) = (2.0, 64.0);

/// All triangles over a rectangle of posts.
#[derive(Clone, Debug)]
pub struct Triangles {
    rect: PostRect,
    /// East and north in posts, height in quanta.
    vertices: Vec<[f64; 3]>,
    corners: Vec<[u32; 3]>,
    cells: Cells,
    /// East and north in whole units, where equal places are equal numbers.
    places: Vec<[i64; 2]>,
    units_per_post: i64,
}

impl Triangles {
    /// Those of a TIN, whose vertices may stand anywhere on the lattice.
    pub fn of_tin(tin: &Tin) -> Self {
        let places = tin.vertices.iter().map(|v| [i64::from(v.at.col), i64::from(v.at.row)]).collect();
        let heights = tin.vertices.iter().map(|vertex| vertex.height);
        Self::new(tin.rect, (places, i64::from(tin.steps_per_post)), heights, tin.triangles.clone())
    }

    /// Those of the load modules of a whole area.
    pub fn of_modules<'a>(
        modules: impl IntoIterator<Item = &'a LoadModule>,
        grid: ModuleGrid,
        spacing: Spacing,
    ) -> Self {
        let (mut places, mut heights, mut corners) = (Vec::new(), Vec::new(), Vec::new());
        let units_per_post = i64::from(spacing.quanta_per_post());
        for module in modules {
            let first = places.len() as u32;
            let side = i64::from(grid.side_cells) * units_per_post;
            let quanta = |index: u32, within: u16| i64::from(index) * side + i64::from(within);
            let (row, col) = (module.id.row, module.id.col);
            places.extend(module.vertices.iter().map(|v| [quanta(col, v.x), quanta(row, v.y)]));
            heights.extend(module.vertices.iter().map(|v| v.z));
            corners.extend(module.triangles.iter().map(|triangle| triangle.map(|v| first + u32::from(v))));
        }
        Self::new(grid.area(), (places, units_per_post), heights, corners)
    }

    fn new(
        rect: PostRect,
        (places, units_per_post): (Vec<[i64; 2]>, i64),
        heights: impl IntoIterator<Item = i32>,
        corners: Vec<[u32; 3]>,
    ) -> Self {
        let posts = |units: i64| units as f64 / units_per_post as f64;
        let vertices: Vec<[f64; 3]> =
            places.iter().zip(heights).map(|(&[x, y], height)| [posts(x), posts(y), f64::from(height)]).collect();
        // About two triangles to a cell.
        let posts = rect.post_count() as f64;
        let side = (2.0 * posts / corners.len().max(1) as f64).sqrt().clamp(CELL_POSTS.0, CELL_POSTS.1);
        let south_west = [f64::from(rect.west), f64::from(rect.south)];
        let north_east = [f64::from(rect.east), f64::from(rect.north)];
        let cells = Cells::new(south_west, north_east, side, corners.len() as u32, |triangle| {
            corners[triangle as usize].map(|v| place_of(vertices[v as usize]))
        });
        Self { rect, vertices, corners, cells, places, units_per_post }
    }

    /// How many there are.
    pub fn count(&self) -> usize {
        self.corners.len()
    }

    /// Corners of all triangles, by vertex.
    pub(crate) fn corners(&self) -> &[[u32; 3]] {
        &self.corners
    }

    /// East and north in posts and height in quanta of all vertices; those of two load modules come twice.
    pub(crate) fn vertices(&self) -> &[[f64; 3]] {
        &self.vertices
    }

    /// East and north of all vertices in whole units, and how many make up a post.
    pub(crate) fn places(&self) -> (&[[i64; 2]], i64) {
        (&self.places, self.units_per_post)
    }

    /// Which triangles may lie under which place.
    pub(crate) fn cells(&self) -> &Cells {
        &self.cells
    }

    /// The posts they cover.
    pub fn rect(&self) -> PostRect {
        self.rect
    }

    /// Height of the triangles at a place inside, in quanta.
    ///
    /// # Panics
    /// When no triangle lies there or next to it: the triangles cover the rectangle.
    pub(crate) fn height_at(&self, place: [f64; 2]) -> f64 {
        // Rounding may put a place on an edge outside both its triangles: then the nearer one has it.
        let mut best = (f64::NEG_INFINITY, 0.0);
        for &triangle in self.cells.at(place) {
            let [a, b, c] = self.corners_of(triangle);
            let [to_a, to_b, to_c] = [a, b, c].map(|corner| [corner[0] - place[0], corner[1] - place[1]]);
            let doubled = [cross(to_b, to_c), cross(to_c, to_a), cross(to_a, to_b)];
            let whole = doubled[0] + doubled[1] + doubled[2];
            let least = doubled[0].min(doubled[1]).min(doubled[2]) / whole;
            if best.0 < least {
                best = (least, a[2] + (doubled[1] * (b[2] - a[2]) + doubled[2] * (c[2] - a[2])) / whole);
            }
            if 0.0 <= least {
                break;
            }
        }
        assert!(f64::NEG_INFINITY < best.0, "triangles cover the place {place:?}");
        best.1
    }

    /// Whether the triangles rise above the straight line from `eye` to `target` somewhere between the two.
    ///
    /// Between two edges the ground is straight, so it is enough to look where an edge is crossed.
    pub(crate) fn hide(&self, eye: [f64; 3], target: [f64; 3]) -> bool {
        let sight = Sight::new(eye, target);
        self.cells.any_under([place_of(eye), place_of(target)], |triangle| {
            let corners = self.corners_of(triangle).map(|corner| sight.seen(corner));
            (0..3).any(|i| sight.is_cut_by(corners[i], corners[(i + 1) % 3]))
        })
    }

    pub(crate) fn corners_of(&self, triangle: u32) -> [[f64; 3]; 3] {
        self.corners[triangle as usize].map(|v| self.vertices[v as usize])
    }
}

/// A line of sight, and how corners lie to it.
struct Sight {
    eye: [f64; 3],
    /// To the target: east, north, up.
    along: [f64; 3],
    length_squared: f64,
}

/// A corner as a line of sight sees it.
#[derive(Clone, Copy)]
struct Seen {
    /// Distance to the left of the line, times its length.
    left: f64,
    /// Distance along it, times its length.
    ahead: f64,
    height: f64,
}

impl Sight {
    fn new(eye: [f64; 3], target: [f64; 3]) -> Self {
        let along = [target[0] - eye[0], target[1] - eye[1], target[2] - eye[2]];
        Self { eye, along, length_squared: along[0] * along[0] + along[1] * along[1] }
    }

    fn seen(&self, corner: [f64; 3]) -> Seen {
        let (dx, dy) = (corner[0] - self.eye[0], corner[1] - self.eye[1]);
        let left = self.along[0] * dy - self.along[1] * dx;
        Seen { left, ahead: self.along[0] * dx + self.along[1] * dy, height: corner[2] }
    }

    /// Whether an edge crosses the line between its ends, and above it. An edge along the line does not cross it,
    /// but edges that begin at its ends do.
    fn is_cut_by(&self, a: Seen, b: Seen) -> bool {
        let one_side = (a.left < 0.0 && b.left < 0.0) || (0.0 < a.left && 0.0 < b.left);
        if one_side || a.left == b.left {
            return false;
        }
        let share = a.left / (a.left - b.left);
        let at = (a.ahead + share * (b.ahead - a.ahead)) / self.length_squared;
        let height = a.height + share * (b.height - a.height);
        0.0 <= at && at <= 1.0 && self.eye[2] + at * self.along[2] < height
    }
}

fn place_of(vertex: [f64; 3]) -> [f64; 2] {
    [vertex[0], vertex[1]]
}

fn cross(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[1] - a[1] * b[0]
}

#[cfg(test)]
mod tests {
    use terrain::{LatticePoint, ModuleId, Post, Vertex};

    use super::*;
    use crate::scene::{grid, height_by_search, module_of, random_tin};
    use crate::sight::Draw;

    fn rect() -> PostRect {
        PostRect::new(Post::new(-7, 30), Post::new(33, 90))
    }

    fn rough(seed: u64, count: usize) -> Tin {
        random_tin(rect(), count, |_, dice| dice.below(4000), seed)
    }

    fn place(draw: &mut Draw) -> [f64; 2] {
        let (wide, high) = (rect().cells_wide() as f64, rect().cells_high() as f64);
        [f64::from(rect().west) + wide * draw.unit(), f64::from(rect().south) + high * draw.unit()]
    }

    #[test]
    fn heights_equal_those_of_a_search_through_all_triangles() {
        for (seed, count) in [(1, 0), (2, 3), (3, 40), (4, 400), (5, 2000)] {
            let tin = rough(seed, count);
            let triangles = Triangles::of_tin(&tin);
            let draw = &mut Draw::new(seed, 0);
            let posts = (-7..=33).flat_map(|row| (30..=90).map(move |col| [f64::from(col), f64::from(row)]));
            for place in posts.chain((0..500).map(|_| place(draw))) {
                let (found, expected) = (triangles.height_at(place), height_by_search(&tin, place));
                assert!((found - expected).abs() < 1e-6, "seed {seed}: {found} at {place:?}, expected {expected}");
            }
            for Vertex { at, height } in &tin.vertices {
                let place = [f64::from(at.col) / 8.0, f64::from(at.row) / 8.0];
                assert_eq!(triangles.height_at(place), f64::from(*height), "seed {seed}");
            }
        }
    }

    /// How far the ground rises above a line, at most, by looking every hundredth of a post.
    fn rise_by_steps(tin: &Tin, eye: [f64; 3], target: [f64; 3]) -> f64 {
        let length = ((target[0] - eye[0]).powi(2) + (target[1] - eye[1]).powi(2)).sqrt();
        let count = (length * 100.0) as u32 + 1;
        let rises = (0..=count).map(|step| {
            let share = f64::from(step) / f64::from(count);
            let [x, y, z] = [0, 1, 2].map(|i| eye[i] + share * (target[i] - eye[i]));
            height_by_search(tin, [x, y]) - z
        });
        rises.fold(f64::NEG_INFINITY, f64::max)
    }

    #[test]
    fn a_line_is_hidden_exactly_where_small_steps_find_ground_above_it() {
        // A hundredth of a post on slopes of at most 40,000 quanta a post hides less than this.
        const BETWEEN_STEPS: f64 = 400.0;
        let (mut hidden, mut seen, mut close) = (0, 0, 0);
        for (seed, count) in [(1, 2), (2, 20), (3, 150)] {
            let tin = rough(seed, count);
            let triangles = Triangles::of_tin(&tin);
            let draw = &mut Draw::new(seed, 1);
            for _ in 0..60 {
                let ends = [place(draw), place(draw)];
                let [eye, target] =
                    ends.map(|[x, y]| [x, y, height_by_search(&tin, [x, y]) + 800.0 * draw.unit() + 1.0]);
                let rise = rise_by_steps(&tin, eye, target);
                if 1e-6 < rise {
                    assert!(triangles.hide(eye, target), "seed {seed}: {eye:?} to {target:?} rises {rise}");
                    hidden += 1;
                } else if rise < -BETWEEN_STEPS {
                    assert!(!triangles.hide(eye, target), "seed {seed}: {eye:?} to {target:?} stays below by {rise}");
                    seen += 1;
                } else {
                    close += 1;
                }
            }
        }
        assert!(40 < hidden && 10 < seen, "{hidden} hidden, {seen} seen, {close} too close to tell");
    }

    #[test]
    fn a_ridge_hides_what_lies_behind_it_even_along_edges_and_through_vertices() {
        // A pyramid of height 100 over a square of 8 posts, whose top stands on the middle post.
        let at = |row, col| LatticePoint::from(Post::new(row, col));
        let vertices = [(0, 0, 0), (0, 8, 0), (8, 8, 0), (8, 0, 0), (4, 4, 100)];
        let tin = Tin::new(
            PostRect::of_size(9, 9),
            vertices.map(|(row, col, height)| Vertex { at: at(row, col), height }).to_vec(),
            vec![[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]],
        );
        let triangles = Triangles::of_tin(&tin);
        for (from, to) in [([0.0, 0.0], [8.0, 8.0]), ([8.0, 0.0], [0.0, 8.0]), ([4.0, 0.0], [4.0, 8.0])] {
            let line = |z: f64| ([from[0], from[1], z], [to[0], to[1], z]);
            let hides = |(eye, target)| triangles.hide(eye, target);
            assert!(hides(line(99.0)) && !hides(line(100.0)), "{from:?} to {to:?}");
            let (eye, target) = line(99.0);
            assert!(hides((target, eye)));
        }
        // Along the border nothing rises.
        assert!(!triangles.hide([0.0, 0.0, 1.0], [8.0, 0.0, 1.0]));
    }

    #[test]
    fn load_modules_are_the_same_ground_as_the_tins_they_hold() {
        let spacing = Spacing::from_metres(25.0).unwrap();
        let window = PostRect::of_size(21, 21);
        // One plane through all load modules, so that sides agree whatever their vertices are.
        let tins: Vec<Tin> = (0..6)
            .map(|i: i32| {
                let (south, west) = (i / 3 * 160, i % 3 * 160);
                random_tin(window, 30, move |at, _| 3 * (at.row + south) - 2 * (at.col + west), i as u64)
            })
            .collect();
        let ids = grid(2, 3).all().iter();
        let modules: Vec<_> = ids.zip(&tins).map(|(id, tin)| module_of(tin, id, spacing)).collect();
        modules.iter().for_each(|module| assert_eq!(module.check(), Ok(())));
        let triangles = Triangles::of_modules(&modules, grid(2, 3), spacing);
        assert_eq!(triangles.rect(), PostRect::of_size(41, 61));
        let draw = &mut Draw::new(4, 4);
        for _ in 0..500 {
            let (x, y) = (60.0 * draw.unit(), 40.0 * draw.unit());
            assert!((triangles.height_at([x, y]) - (24.0 * y - 16.0 * x)).abs() < 1e-6);
        }
        let flat = |x: f64, y: f64, above: f64| [x, y, 24.0 * y - 16.0 * x + above];
        assert!(!triangles.hide(flat(1.0, 2.0, 0.5), flat(58.0, 39.0, 0.5)));
        assert!(triangles.hide(flat(1.0, 2.0, -0.5), flat(58.0, 39.0, -0.5)));
        assert_eq!(modules[5].id, ModuleId { row: 1, col: 2 });
    }
}
