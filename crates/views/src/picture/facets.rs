//! Triangles to be drawn: of a TIN or of load modules, in metres from the area's south-west post.

use terrain::{LATTICE_PER_POST, LoadModule, ModuleGrid, QUANTA_PER_METRE, Spacing, Tin, metres_of_quanta};

/// Triangles with the places of their corners: east, north and up, in metres.
///
/// Corners at one place have equal places, bit for bit, even where they come from two load modules; so neither a gap
/// nor a double pixel shows between neighbours.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Facets {
    pub(crate) vertices: Vec<[f64; 3]>,
    pub(crate) corners: Vec<[u32; 3]>,
    /// West, south, east and north of what they cover.
    pub(crate) extent_m: [f64; 4],
    /// Side of the squares whose lines are drawn stronger; `None` where there are none.
    pub(crate) side_m: Option<f64>,
}

impl Facets {
    /// Those of a TIN whose posts are `spacing_m` apart, west to east and south to north.
    pub fn of_tin(tin: &Tin, spacing_m: [f64; 2]) -> Self {
        let metres = |lattice: i32, axis: usize| f64::from(lattice) / f64::from(LATTICE_PER_POST) * spacing_m[axis];
        let vertices = tin.vertices.iter();
        let vertices = vertices.map(|v| [metres(v.at.col, 0), metres(v.at.row, 1), metres_of_quanta(v.height)]);
        let posts = |count: i32, axis: usize| f64::from(count) * spacing_m[axis];
        let rect = tin.rect;
        Self {
            vertices: vertices.collect(),
            corners: tin.triangles.clone(),
            extent_m: [posts(rect.west, 0), posts(rect.south, 1), posts(rect.east, 0), posts(rect.north, 1)],
            side_m: None,
        }
    }

    /// Those of load modules.
    pub fn of_modules<'a>(
        modules: impl IntoIterator<Item = &'a LoadModule>,
        grid: ModuleGrid,
        spacing: Spacing,
    ) -> Self {
        let side = i64::from(grid.side_cells) * i64::from(spacing.quanta_per_post());
        let side_m = side as f64 / f64::from(QUANTA_PER_METRE);
        let metres = |index: u32, quanta: u16| {
            (i64::from(index) * side + i64::from(quanta)) as f64 / f64::from(QUANTA_PER_METRE)
        };
        let mut facets = Self { side_m: Some(side_m), ..Self::default() };
        let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        for module in modules {
            let (row, col) = (module.id.row, module.id.col);
            let first = facets.vertices.len() as u32;
            let vertices = module.vertices.iter();
            facets.vertices.extend(vertices.map(|v| [metres(col, v.x), metres(row, v.y), metres_of_quanta(v.z)]));
            facets.corners.extend(module.triangles.iter().map(|triangle| triangle.map(|v| first + u32::from(v))));
            low = [low[0].min(metres(col, 0)), low[1].min(metres(row, 0))];
            high = [high[0].max(metres(col + 1, 0)), high[1].max(metres(row + 1, 0))];
        }
        facets.extent_m = [low[0], low[1], high[0], high[1]];
        facets
    }

    /// How many triangles.
    pub fn count(&self) -> usize {
        self.corners.len()
    }

    /// Lowest and highest corner, in metres.
    pub(crate) fn range_m(&self) -> (f64, f64) {
        let heights = self.vertices.iter().map(|vertex| vertex[2]);
        heights.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), at| (low.min(at), high.max(at)))
    }

    /// Height at a place in metres; `None` where no triangle lies.
    pub(crate) fn height_m(&self, [x, y]: [f64; 2]) -> Option<f64> {
        self.corners.iter().map(|&corners| self.triangle(corners)).find_map(|[a, b, c]| {
            let left = |p: [f64; 3], q: [f64; 3]| (q[0] - p[0]) * (y - p[1]) - (q[1] - p[1]) * (x - p[0]);
            let inside = 0.0 <= left(a, b) && 0.0 <= left(b, c) && 0.0 <= left(c, a);
            let [to_east, to_north] = slope([a, b, c]);
            inside.then(|| a[2] + to_east * (x - a[0]) + to_north * (y - a[1]))
        })
    }

    pub(crate) fn triangle(&self, corners: [u32; 3]) -> [[f64; 3]; 3] {
        corners.map(|v| self.vertices[v as usize])
    }

    /// Calls `visit` with every edge once, in the order of the triangles; `is_line` says whether it lies on the side of
    /// a square or of all.
    pub(crate) fn each_edge(&self, mut visit: impl FnMut([[f64; 3]; 2], bool)) {
        for &corners in &self.corners {
            for i in 0..3 {
                let (a, b) = (corners[i], corners[(i + 1) % 3]);
                let ends = [a, b].map(|v| self.vertices[v as usize]);
                let is_line = self.is_on_line(ends, 0) || self.is_on_line(ends, 1);
                // An inner edge belongs to two triangles, that run along it both ways; on a line both load modules have
                // corners of their own, so that no index tells, but places do.
                let is_first = if is_line { [ends[0][0], ends[0][1]] < [ends[1][0], ends[1][1]] } else { a < b };
                if is_first || (is_line && self.is_on_border(ends)) {
                    visit(ends, is_line);
                }
            }
        }
    }

    fn is_on_line(&self, ends: [[f64; 3]; 2], axis: usize) -> bool {
        let at = ends[0][axis];
        let on_side = self.side_m.is_some_and(|side_m| (at / side_m).fract() == 0.0);
        at == ends[1][axis] && (on_side || at == self.extent_m[axis] || at == self.extent_m[axis + 2])
    }

    fn is_on_border(&self, ends: [[f64; 3]; 2]) -> bool {
        (0..2).any(|axis| {
            let at = ends[0][axis];
            at == ends[1][axis] && (at == self.extent_m[axis] || at == self.extent_m[axis + 2])
        })
    }
}

/// Where light comes from: the north-west, halfway up, as on maps since Lehmann.
const LIGHT: [f64; 3] = [-0.5, 0.5, std::f64::consts::FRAC_1_SQRT_2];

/// How light a slope is that rises so much per metre to the east and to the north: 1 where it is flat.
pub(crate) fn light_of(to_east: f64, to_north: f64) -> f32 {
    let towards = LIGHT[2] - LIGHT[0] * to_east - LIGHT[1] * to_north;
    let lambert = towards / (1.0 + to_east * to_east + to_north * to_north).sqrt();
    // Shadows keep a quarter of the light of the sky.
    (0.25 + 0.75 * lambert.max(0.0) / LIGHT[2]) as f32
}

/// How light a triangle is whose heights are drawn `times` as large.
pub(crate) fn light_of_triangle([a, b, c]: [[f64; 3]; 3], times: f64) -> f32 {
    let [to_east, to_north] = slope([a, b, c]);
    light_of(to_east * times, to_north * times)
}

/// How much the plane through three corners rises per metre to the east and to the north; 0 without an area.
pub(crate) fn slope([a, b, c]: [[f64; 3]; 3]) -> [f64; 2] {
    let to = |p: [f64; 3]| [p[0] - a[0], p[1] - a[1], p[2] - a[2]];
    let (b, c) = (to(b), to(c));
    let doubled = b[0] * c[1] - c[0] * b[1];
    if doubled == 0.0 {
        return [0.0, 0.0];
    }
    [(b[2] * c[1] - c[2] * b[1]) / doubled, (b[0] * c[2] - c[0] * b[2]) / doubled]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::samples;

    #[test]
    fn every_edge_of_a_sheet_of_load_modules_is_visited_once() {
        let (grid, spacing) = (samples::GRID, samples::spacing());
        let facets = Facets::of_modules(&samples::modules(), grid, spacing);
        let mut edges = Vec::new();
        facets.each_edge(|[a, b], is_line| edges.push((a.min_place(b), is_line)));
        let mut distinct: Vec<_> = edges.iter().map(|(ends, _)| format!("{ends:?}")).collect();
        distinct.sort();
        distinct.dedup();
        assert_eq!(distinct.len(), edges.len(), "no edge is visited twice");
        // Euler: a sheet without holes has as many edges as vertices and triangles together, less one.
        let mut vertices: Vec<_> = facets.vertices.iter().map(|v| format!("{v:?}")).collect();
        vertices.sort();
        vertices.dedup();
        assert_eq!(edges.len(), vertices.len() + facets.count() - 1);
    }

    /// Both ends of an edge, the smaller first.
    trait Ends: Sized {
        fn min_place(self, other: Self) -> [Self; 2];
    }

    impl Ends for [f64; 3] {
        fn min_place(self, other: Self) -> [Self; 2] {
            if self < other { [self, other] } else { [other, self] }
        }
    }

    #[test]
    fn slopes_towards_the_north_west_are_lighter_than_flat_ground_and_others_darker() {
        assert!((light_of(0.0, 0.0) - 1.0).abs() < 1e-6);
        assert!(1.0 < light_of(0.3, -0.3), "rising to the south-east: it faces the light");
        assert!(light_of(-0.3, 0.3) < 1.0);
        let plane = [[0.0, 0.0, 0.0], [10.0, 0.0, 1.0], [0.0, 10.0, -2.0]];
        assert_eq!(slope(plane), [0.1, -0.2]);
    }
}
