//! Triangles to be drawn: of a TIN or of load modules, in metres from the area's south-west post.

use terrain::Role;
use terrain::{
    Dem, HOLE_CLASS, LoadModule, ModuleGrid, ObjectKind, Post, QUANTA_PER_METRE, Spacing, Tin, metres_of_quanta,
};

use super::bands::bands_of;
use super::map_extent::slope;
use super::objects::{Solid, kinds, solids};
use super::scene::{Scene, SceneFeatures};

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
    /// What each triangle lies over; empty where all lie over plain ground.
    pub(crate) covers: Vec<Cover>,
    /// Triangles of bridges, which hang above the others, and their place among the colours of features.
    pub(crate) decks: Vec<([[f64; 3]; 3], u8)>,
    /// Edges that are the middle of a road, a river or a stream, and their place among the colours of features.
    pub(crate) lines: Vec<([[f64; 3]; 2], u8)>,
    /// Triangles of the bands that some of these are where one stands on the ground, a little above it.
    pub(crate) bands: Vec<([[f64; 3]; 3], u8)>,
    /// What stands on the ground.
    pub(crate) objects: Vec<Solid>,
    /// Kinds of these.
    pub(crate) kinds: Vec<ObjectKind>,
}

/// What a triangle or a post lies over.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Cover {
    /// Ground, which is drawn by its height.
    #[default]
    Ground,
    /// Water.
    Water,
    /// A hole: no source has a height there.
    Hole,
    /// A road or water of a feature: its place among the colours of these.
    Feature(u8),
}

impl Facets {
    /// Those of a TIN whose posts are `spacing_m` apart, west to east and south to north.
    pub fn of_tin(tin: &Tin, spacing_m: [f64; 2]) -> Self {
        let metres = |lattice: i32, axis: usize| f64::from(lattice) / f64::from(tin.steps_per_post) * spacing_m[axis];
        let vertices = tin.vertices.iter();
        let vertices = vertices.map(|v| [metres(v.at.col, 0), metres(v.at.row, 1), metres_of_quanta(v.height)]);
        let posts = |count: i32, axis: usize| f64::from(count) * spacing_m[axis];
        let rect = tin.rect;
        Self {
            vertices: vertices.collect(),
            corners: tin.triangles.clone(),
            extent_m: [posts(rect.west, 0), posts(rect.south, 1), posts(rect.east, 0), posts(rect.north, 1)],
            side_m: None,
            covers: Vec::new(),
            decks: Vec::new(),
            lines: Vec::new(),
            bands: Vec::new(),
            objects: Vec::new(),
            kinds: Vec::new(),
        }
    }

    /// Those of a scene.
    pub(crate) fn of_scene(scene: &Scene) -> Self {
        Self::of_modules(scene.modules, scene.grid, scene.frame.spacing).with_covers_of(scene, scene.modules)
    }

    /// The facets of a scene with what stands on its ground, and with the bands of its ways around a place, in metres
    /// from the area's south-west post. Maps draw both otherwise, and objects of a large area take more memory than all
    /// else.
    pub(crate) fn seen_from(self, scene: &Scene, place_m: [f64; 2]) -> Self {
        let bands = scene.features.map(|features| bands_of(scene, &features, place_m)).unwrap_or_default();
        let corner =
            |module: &LoadModule| [module.id.col, module.id.row].map(|index| f64::from(index) * scene.side_m());
        let objects = scene.modules.iter().flat_map(|module| solids(module, corner(module))).collect();
        Self { bands, objects, kinds: kinds(scene.modules.iter()), ..self }
    }

    /// The facets of these load modules, told which of them lie over holes and which over water: those of a class.
    pub(crate) fn with_covers<'a>(
        mut self,
        modules: impl IntoIterator<Item = &'a LoadModule>,
        water: Option<u8>,
    ) -> Self {
        let cover = |&class: &u8| match class {
            HOLE_CLASS => Cover::Hole,
            class if Some(class) == water => Cover::Water,
            _ => Cover::Ground,
        };
        self.covers = modules.into_iter().flat_map(|module| &module.classes).map(cover).collect();
        self
    }

    /// The facets of these load modules, told what they lie over in a scene.
    pub(crate) fn with_covers_of<'a>(
        self,
        scene: &Scene,
        modules: impl IntoIterator<Item = &'a LoadModule, IntoIter: Clone> + Clone,
    ) -> Self {
        let mut facets = self.with_covers(modules.clone(), scene.water);
        if let Some(features) = scene.features {
            let decks = modules.clone().into_iter().filter(|module| !module.decks.is_empty());
            facets.decks = decks.flat_map(|module| decks_of(module, scene, &features)).collect();
            facets.lines = lines_of(scene, &features, facets.extent_m);
            let classes = modules.into_iter().flat_map(|module| &module.classes);
            for (cover, &class) in facets.covers.iter_mut().zip(classes) {
                if let Some(number) = features.color_of(class) {
                    *cover = Cover::Feature(number);
                }
            }
        }
        facets
    }

    /// What a triangle lies over.
    pub(crate) fn cover(&self, triangle: usize) -> Cover {
        self.covers.get(triangle).copied().unwrap_or_default()
    }

    /// Whether any triangle lies over such a thing.
    pub(crate) fn has(&self, cover: Cover) -> bool {
        self.covers.contains(&cover)
    }

    /// Whether any triangle lies over such a thing, or a line or a bridge is one.
    pub(crate) fn shows(&self, cover: Cover) -> bool {
        let Cover::Feature(number) = cover else { return self.has(cover) };
        let is_it = |of: &u8| *of == number;
        self.has(cover)
            || self.decks.iter().map(|(_, of)| of).any(is_it)
            || self.lines.iter().map(|(_, of)| of).any(is_it)
    }

    /// What the posts of a DEM lie over, row by row from the south-west; empty where all lie over plain ground.
    pub(crate) fn post_covers(&self, dem: &Dem, spacing_m: f64) -> Vec<Cover> {
        let rect = dem.rect();
        let is_painted = |cover: Cover| matches!(cover, Cover::Water | Cover::Feature(_));
        if !self.covers.iter().any(|cover| is_painted(*cover)) && dem.void_count() == 0 {
            return Vec::new();
        }
        let posts =
            (rect.south..=rect.north).flat_map(|row| (rect.west..=rect.east).map(move |col| Post::new(row, col)));
        let cover = |post| if dem.is_void(post) { Cover::Hole } else { Cover::Ground };
        let mut posts: Vec<Cover> = posts.map(cover).collect();
        let triangles = self.corners.iter().enumerate().map(|(index, corners)| (self.cover(index), corners));
        for (cover, &corners) in triangles.filter(|(cover, _)| is_painted(*cover)) {
            let [a, b, c] = self.triangle(corners).map(|[x, y, _]| [x / spacing_m, y / spacing_m]);
            let left = |p: [f64; 2], q: [f64; 2], at: [f64; 2]| {
                (q[0] - p[0]) * (at[1] - p[1]) - (q[1] - p[1]) * (at[0] - p[0])
            };
            let range = |axis: usize, first: i32, last: i32| {
                let (low, high) = (a[axis].min(b[axis]).min(c[axis]), a[axis].max(b[axis]).max(c[axis]));
                (low.ceil() as i32).max(first)..=(high.floor() as i32).min(last)
            };
            for row in range(1, rect.south, rect.north) {
                for col in range(0, rect.west, rect.east) {
                    let at = [f64::from(col), f64::from(row)];
                    if 0.0 <= left(a, b, at) && 0.0 <= left(b, c, at) && 0.0 <= left(c, a, at) {
                        let place = rect.index(Post::new(row, col));
                        posts[place] = cover;
                    }
                }
            }
        }
        posts
    }

    /// Those of load modules.
    pub(crate) fn of_modules<'a>(
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

    /// How many triangles of the ground, bridges not among them.
    pub(crate) fn count(&self) -> usize {
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

/// The triangles of bridges of a load module, and their place among the colours of features.
fn decks_of(module: &LoadModule, scene: &Scene, features: &SceneFeatures) -> Vec<([[f64; 3]; 3], u8)> {
    let side = i64::from(scene.grid.side_cells) * i64::from(scene.frame.spacing.quanta_per_post());
    let metres =
        |index: u32, quanta: u16| (i64::from(index) * side + i64::from(quanta)) as f64 / f64::from(QUANTA_PER_METRE);
    let place = |v: u16| {
        let v = module.decks.vertices[usize::from(v)];
        [metres(module.id.col, v.x), metres(module.id.row, v.y), metres_of_quanta(v.z)]
    };
    let triangles = module.decks.triangles.iter().zip(&module.decks.classes);
    triangles.map(|(corners, &class)| (corners.map(place), features.color_of(class).unwrap_or(u8::MAX))).collect()
}

/// The middles of roads, rivers and streams inside an extent.
fn lines_of(scene: &Scene, features: &SceneFeatures, [west, south, east, north]: [f64; 4]) -> Vec<([[f64; 3]; 2], u8)> {
    let origin = [scene.frame.origin_east_m, scene.frame.origin_north_m];
    let is_inside = |[x, y, _]: &[f64; 3]| west <= *x && *x <= east && south <= *y && *y <= north;
    let mut all = Vec::new();
    for line in features.lines.iter().filter(|line| matches!(line.role, Role::Centre | Role::Channel)) {
        let Some(number) = features.color_of(line.class) else { continue };
        for pair in line.vertices.windows(2) {
            let ends = [pair[0], pair[1]].map(|[x, y, z]| [x - origin[0], y - origin[1], z]);
            if ends.iter().all(is_inside) {
                all.push((ends, number));
            }
        }
    }
    all
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
    fn posts_under_water_are_those_of_its_class_and_holes_those_without_a_height() {
        let mut modules = samples::modules();
        modules[1].classes = vec![3; 4];
        let facets = Facets::of_modules(&modules, samples::GRID, samples::spacing());
        let area = samples::GRID.area();
        let sound = Dem::from_fn(area, |_| Some(0));
        assert!(facets.clone().with_covers(&modules, None).post_covers(&sound, 25.0).is_empty());
        assert!(facets.clone().with_covers(&modules, Some(9)).post_covers(&sound, 25.0).is_empty());
        let facets = facets.with_covers(&modules, Some(3));
        let posts = facets.post_covers(&sound, 25.0);
        let wet = |row: usize, col: usize| posts[row * area.posts_wide() + col] == Cover::Water;
        assert!(wet(10, 30) && wet(0, 20) && wet(20, 40) && !wet(10, 19) && !wet(21, 30));
        assert_eq!(posts.iter().filter(|cover| **cover == Cover::Water).count(), 21 * 21);
        let holed = Dem::from_fn(area, |post| (post.row != 30).then_some(0));
        let posts = facets.post_covers(&holed, 25.0);
        assert_eq!(posts.iter().filter(|cover| **cover == Cover::Hole).count(), area.posts_wide());
        modules[0].classes[2] = HOLE_CLASS;
        let facets = Facets::of_modules(&modules, samples::GRID, samples::spacing()).with_covers(&modules, None);
        assert_eq!(facets.covers.iter().filter(|cover| **cover != Cover::Ground).count(), 1);
        assert_eq!(facets.cover(2), Cover::Hole);
    }
}
