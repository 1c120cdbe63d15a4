//! The load modules of a product as one mesh: vertices on shared sides are one vertex, those of decks and objects their
//! own.

use std::collections::{BTreeMap, HashMap};
use std::ops::Range;

use terrain::{HOLE_CLASS, LoadModule, ModuleId, ModuleRect, ModuleVertex, ObjectKind, QUANTA_PER_METRE};

use crate::lanes::Lanes;
use crate::objects::{Facet, Thing, things_in};
use crate::ribbons::Ribbons;
use crate::{Product, Sheet, Texture};

/// What coordinates are counted from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Coordinates {
    /// From the south-west corner of what is exported: for Blender, MeshLab and the like.
    Local,
    /// Eastings and northings: 64-bit floats, for QGIS and other geographic programs.
    Map,
}

/// Triangles over common vertices.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh {
    /// East, north and up in quanta of 1/128 m; east and north from the mesh's south-west corner.
    pub vertices: Vec<[i32; 3]>,
    /// Corners, counter-clockwise seen from above or from outside, sheet after sheet.
    pub triangles: Vec<[u32; 3]>,
    /// Class of each triangle; of objects, the number of the material.
    pub classes: Vec<u8>,
    /// Of each sheet, the first triangle of each load module, row by row from the south-west, and the end of the last;
    /// empty where no load module has any.
    starts: [Vec<usize>; Sheet::ALL.len()],
    /// Objects with their triangles, in the order of these.
    things: Vec<(Thing, Range<usize>)>,
    /// Triangles that are part of a way, where that is asked for: which way, and the places of their corners on it.
    lanes: HashMap<usize, (u32, [[f32; 2]; 3])>,
}

/// Some load modules of a sheet of a mesh, over vertices of their own.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Part {
    /// Vertices of the mesh, in the order in which they are first used.
    pub vertices: Vec<u32>,
    /// Corners by place in `vertices`.
    pub triangles: Vec<[u32; 3]>,
    /// Class of each triangle.
    pub classes: Vec<u8>,
    /// Each load module, and its triangles among those of the part.
    pub modules: Vec<(ModuleId, Range<usize>)>,
    /// Each object, or piece of one, and its triangles among those of the part.
    pub things: Vec<(Thing, Range<usize>)>,
    /// Where vertices lie across and along their ways; empty where none is part of one.
    pub lanes: Vec<[f32; 2]>,
}

/// An object, and the triangles of its pieces.
type Pieces = (Thing, Vec<Range<usize>>);

impl Part {
    /// Where the corners of a triangle of the part lie across and along their way, where it is part of one.
    pub(crate) fn lane(&self, triangle: [u32; 3]) -> Option<[[f32; 2]; 3]> {
        let places = triangle.map(|v| self.lanes.get(v as usize).copied().unwrap_or_default());
        places.iter().any(|place| *place != [0.0; 2]).then_some(places)
    }

    /// Each object of a part of objects with all of its pieces, over vertices of its own, by kind and number.
    pub(crate) fn by_thing(&self) -> Vec<(Thing, Self)> {
        let mut pieces: BTreeMap<(ObjectKind, u64), Pieces> = BTreeMap::new();
        for (thing, range) in &self.things {
            let (_, ranges) = pieces.entry((thing.kind, thing.id)).or_insert_with(|| (*thing, Vec::new()));
            ranges.push(range.clone());
        }
        let part = |ranges: Vec<Range<usize>>| self.of_triangles(ranges.into_iter().flatten());
        pieces.into_values().map(|(thing, ranges)| (thing, part(ranges))).collect()
    }

    /// The same with some of its objects alone.
    pub(crate) fn of_things(&self, is_wanted: impl Fn(&Thing) -> bool) -> Self {
        let wanted = || self.things.iter().filter(|(thing, _)| is_wanted(thing));
        let mut part = self.of_triangles(wanted().flat_map(|(_, range)| range.clone()));
        let mut end = 0;
        part.things.extend(wanted().map(|(thing, range)| {
            let start = end;
            end += range.len();
            (*thing, start..end)
        }));
        part
    }

    /// Some of its triangles, over vertices of their own.
    fn of_triangles(&self, indices: impl Iterator<Item = usize>) -> Self {
        let (mut part, mut place_of) = (Self::default(), HashMap::new());
        for index in indices {
            let placed = self.triangles[index].map(|v| {
                *place_of.entry(v).or_insert_with(|| {
                    part.vertices.push(self.vertices[v as usize]);
                    part.vertices.len() as u32 - 1
                })
            });
            part.triangles.push(placed);
            part.classes.push(self.classes[index]);
        }
        part
    }
}

/// Extent in quanta up to which every coordinate is exact as a 32-bit float.
const EXACT_QUANTA_MAX: i32 = 1 << 24;

impl Mesh {
    /// All sheets of a product: triangles over holes, where no source has a height, are left out.
    pub fn of(product: &Product) -> Self {
        Self::whole(product).without_holes().with_sheets(product)
    }

    /// The same with all that is above the ground.
    pub(crate) fn with_sheets(self, product: &Product) -> Self {
        self.with_decks(product).with_ribbons(product).with_objects(product)
    }

    /// All ground of a product, triangles over holes too.
    pub(crate) fn whole(product: &Product) -> Self {
        let mut mesh = Self::default();
        let mut shared = HashMap::new();
        for module in &product.modules {
            mesh.begin_module(Sheet::Ground);
            mesh.add(module, product.corner(module.id), &mut shared);
        }
        mesh.begin_module(Sheet::Ground);
        mesh
    }

    /// The same without triangles over holes, and without the vertices that only these have.
    fn without_holes(self) -> Self {
        if !self.classes.contains(&HOLE_CLASS) {
            return self;
        }
        let mut left = Self::default();
        let mut place_of = vec![u32::MAX; self.vertices.len()];
        for range in self.starts[Sheet::Ground as usize].windows(2).map(|ends| ends[0]..ends[1]) {
            left.begin_module(Sheet::Ground);
            for index in range.filter(|&index| self.classes[index] != HOLE_CLASS) {
                let placed = self.triangles[index].map(|v| {
                    let place = &mut place_of[v as usize];
                    if *place == u32::MAX {
                        *place = left.vertices.len() as u32;
                        left.vertices.push(self.vertices[v as usize]);
                    }
                    *place
                });
                left.triangles.push(placed);
                left.classes.push(self.classes[index]);
            }
        }
        left.begin_module(Sheet::Ground);
        left
    }

    /// The same with the decks of its product: they share vertices with each other, and none with the ground.
    fn with_decks(mut self, product: &Product) -> Self {
        if product.deck_triangles() == 0 {
            return self;
        }
        let mut shared = HashMap::new();
        for module in &product.modules {
            self.begin_module(Sheet::Decks);
            let corner = product.corner(module.id);
            let mut place = |vertex: &ModuleVertex| {
                let place = [corner[0] + i32::from(vertex.x), corner[1] + i32::from(vertex.y), vertex.z];
                *shared.entry(place).or_insert_with(|| {
                    self.vertices.push(place);
                    self.vertices.len() as u32 - 1
                })
            };
            let index_of: Vec<u32> = module.decks.vertices.iter().map(&mut place).collect();
            let placed = module.decks.triangles.iter().map(|triangle| triangle.map(|v| index_of[usize::from(v)]));
            self.triangles.extend(placed);
            self.classes.extend_from_slice(&module.decks.classes);
        }
        self.begin_module(Sheet::Decks);
        self
    }

    /// The same with ribbons, unless they are not wanted.
    fn with_ribbons(mut self, product: &Product) -> Self {
        let Some(ribbons) = product.has_ribbons.then(|| Ribbons::of(product)).flatten() else { return self };
        for module in &product.modules {
            self.begin_module(Sheet::Ribbons);
            ribbons.in_module(product, module.id).iter().for_each(|facet| self.add_facet(facet));
        }
        self.begin_module(Sheet::Ribbons);
        self
    }

    /// The same with the objects of its product, each over vertices of its own.
    fn with_objects(mut self, product: &Product) -> Self {
        if product.modules.iter().all(|module| module.objects.is_empty()) {
            return self;
        }
        for module in &product.modules {
            self.begin_module(Sheet::Objects);
            for (thing, facets) in things_in(product, module.id) {
                let first = self.triangles.len();
                facets.iter().for_each(|facet| self.add_facet(facet));
                self.things.push((thing, first..self.triangles.len()));
            }
        }
        self.begin_module(Sheet::Objects);
        // Pieces of one object in several load modules are told the same of: the height of the highest.
        let mut highest: BTreeMap<(ObjectKind, u64), i32> = BTreeMap::new();
        for (thing, _) in &self.things {
            let height = highest.entry((thing.kind, thing.id)).or_insert(thing.height);
            *height = thing.height.max(*height);
        }
        self.things.iter_mut().for_each(|(thing, _)| thing.height = highest[&(thing.kind, thing.id)]);
        self
    }

    /// The same with places along ways, for formats that have room for them.
    pub(crate) fn with_lanes(mut self, product: &Product) -> Self {
        let Some(lanes) = Lanes::of(product) else { return self };
        let ranges = [Sheet::Ground, Sheet::Decks, Sheet::Ribbons].map(|sheet| self.sheet(sheet));
        for index in ranges.into_iter().flatten() {
            let (class, corners) = (self.classes[index], self.triangles[index].map(|v| self.vertices[v as usize]));
            if let Some(way) = lanes.way_of(class, corners) {
                self.lanes.insert(index, (way, corners.map(|corner| lanes.place(class, way, corner))));
            }
        }
        self
    }

    /// Adds a facet: what rounding leaves without an area has no triangle.
    fn add_facet(&mut self, facet: &Facet) {
        let mut shared = HashMap::new();
        for polygon in &facet.polygons {
            for corner in 2..polygon.len() {
                let corners = [polygon[0], polygon[corner - 1], polygon[corner]];
                if !faces_somewhere(corners, polygon) {
                    continue;
                }
                let triangle = corners.map(|place| {
                    *shared.entry(place).or_insert_with(|| {
                        self.vertices.push(place);
                        self.vertices.len() as u32 - 1
                    })
                });
                self.triangles.push(triangle);
                self.classes.push(facet.material);
            }
        }
    }

    fn begin_module(&mut self, sheet: Sheet) {
        self.starts[sheet as usize].push(self.triangles.len());
    }

    /// The first triangle of the ground of each load module, row by row from the south-west.
    pub(crate) fn module_starts(&self) -> &[usize] {
        &self.starts[Sheet::Ground as usize]
    }

    /// The triangles of a sheet.
    pub(crate) fn sheet(&self, sheet: Sheet) -> Range<usize> {
        match self.starts[sheet as usize].as_slice() {
            [first, .., last] => *first..*last,
            _ => 0..0,
        }
    }

    /// A sheet in the load modules of `rect`, which `product`, of which this is the mesh, holds: without holes, and
    /// without triangles where they have none of it.
    pub(crate) fn part(&self, product: &Product, sheet: Sheet, rect: ModuleRect) -> Part {
        let (starts, mut part) = (&self.starts[sheet as usize], Part::default());
        if starts.is_empty() {
            return part;
        }
        let mut place_of = HashMap::new();
        for id in rect.iter() {
            let (row, col) = (id.row - product.rect.south, id.col - product.rect.west);
            let index = (row * product.rect.cols() + col) as usize;
            let own = starts[index]..starts[index + 1];
            let start = part.triangles.len();
            if sheet == Sheet::Objects {
                let first = self.things.partition_point(|(_, range)| range.start < own.start);
                let things = self.things[first..].iter().take_while(|(_, range)| range.start < own.end);
                let moved = |at: usize| start + at - own.start;
                part.things.extend(things.map(|(thing, range)| (*thing, moved(range.start)..moved(range.end))));
            }
            for index in own.filter(|&index| sheet == Sheet::Objects || self.classes[index] != HOLE_CLASS) {
                let lane = if sheet == Sheet::Objects { None } else { self.lanes.get(&index) };
                let placed = [0, 1, 2].map(|corner| {
                    let v = self.triangles[index][corner];
                    // Ways that meet have other places at one vertex.
                    *place_of.entry((v, lane.map(|(way, _)| way))).or_insert_with(|| {
                        part.vertices.push(v);
                        part.lanes.push(lane.map_or([0.0; 2], |(_, places)| places[corner]));
                        part.vertices.len() as u32 - 1
                    })
                });
                part.triangles.push(placed);
                part.classes.push(self.classes[index]);
            }
            part.modules.push((id, start..part.triangles.len()));
        }
        if place_of.keys().all(|(_, way)| way.is_none()) {
            part.lanes.clear();
        }
        part
    }

    /// All sheets in the load modules of `rect` that have a triangle there.
    pub(crate) fn parts(&self, product: &Product, rect: ModuleRect) -> Vec<(Sheet, Part)> {
        let parts = Sheet::ALL.map(|sheet| (sheet, self.part(product, sheet, rect)));
        parts.into_iter().filter(|(_, part)| !part.triangles.is_empty()).collect()
    }

    /// The highest of the objects of a part above what they stand on, in quanta.
    pub(crate) fn tallest(parts: &[(Sheet, Part)]) -> i32 {
        parts.iter().flat_map(|(_, part)| &part.things).map(|(thing, _)| thing.height).max().unwrap_or(0)
    }

    fn add(&mut self, module: &LoadModule, corner: [i32; 2], shared: &mut HashMap<[i32; 2], u32>) {
        let on_side = |v: &ModuleVertex| v.x == 0 || v.y == 0 || v.x == module.side || v.y == module.side;
        let mut index_of = Vec::with_capacity(module.vertices.len());
        for vertex in &module.vertices {
            let (x, y) = (corner[0] + i32::from(vertex.x), corner[1] + i32::from(vertex.y));
            let next = self.vertices.len() as u32;
            let index = if on_side(vertex) { *shared.entry([x, y]).or_insert(next) } else { next };
            if index == next {
                self.vertices.push([x, y, vertex.z]);
            }
            index_of.push(index);
        }
        self.triangles.extend(module.triangles.iter().map(|triangle| triangle.map(|v| index_of[usize::from(v)])));
        self.classes.extend_from_slice(&module.classes);
    }

    /// East, north and up of each vertex in metres from the mesh's south-west corner.
    pub(crate) fn metres(&self) -> impl ExactSizeIterator<Item = [f64; 3]> {
        self.vertices.iter().map(|vertex| vertex.map(|quanta| f64::from(quanta) / f64::from(QUANTA_PER_METRE)))
    }

    /// Where vertices lie in a texture.
    pub(crate) fn uvs(&self, texture: &Texture, vertices: &[u32]) -> Vec<[f32; 2]> {
        let metres = |quanta: i32| f64::from(quanta) / f64::from(QUANTA_PER_METRE);
        let place = |&v: &u32| self.vertices[v as usize].map(metres);
        vertices.iter().map(place).map(|[x, y, _]| texture.uv([x, y])).collect()
    }

    /// Whether every coordinate, counted from the south-west corner, is exact as a 32-bit float.
    pub(crate) fn fits_floats(&self) -> bool {
        self.vertices.iter().flatten().all(|quanta| quanta.abs() <= EXACT_QUANTA_MAX)
    }

    /// The direction the ground faces at each vertex: that of the triangles around it, larger ones counting more.
    pub(crate) fn normals(&self) -> Vec<[f64; 3]> {
        let places: Vec<[f64; 3]> = self.metres().collect();
        normals(&places, &self.triangles)
    }
}

/// Whether three corners of a polygon span a triangle that faces as the polygon does. Seen from above, rounding may
/// turn the narrowest over.
fn faces_somewhere(corners: [[i32; 3]; 3], polygon: &[[i32; 3]]) -> bool {
    let normal = |[a, b, c]: [[i32; 3]; 3]| {
        let [a, b, c] = [a, b, c].map(|place| place.map(f64::from));
        cross(minus(b, a), minus(c, a))
    };
    let of = normal(corners);
    let is_upright = (2..polygon.len()).all(|at| normal([polygon[0], polygon[at - 1], polygon[at]])[2] == 0.0);
    if is_upright { of != [0.0; 3] } else { 0.0 < of[2] }
}

/// Triangles by class, in the order of classes.
pub(crate) fn class_groups(triangles: &[[u32; 3]], classes: &[u8]) -> Vec<(u8, Vec<[u32; 3]>)> {
    let mut by_class = vec![Vec::new(); 256];
    triangles.iter().zip(classes).for_each(|(&triangle, &class)| by_class[usize::from(class)].push(triangle));
    (0..=u8::MAX).zip(by_class).filter(|(_, triangles)| !triangles.is_empty()).collect()
}

/// Unit normals at vertices, of the triangles around each, by area.
pub(crate) fn normals(places: &[[f64; 3]], triangles: &[[u32; 3]]) -> Vec<[f64; 3]> {
    let mut sums = vec![[0.0; 3]; places.len()];
    for &triangle in triangles {
        let [a, b, c] = triangle.map(|v| places[v as usize]);
        let normal = cross(minus(b, a), minus(c, a));
        for v in triangle {
            let sum = &mut sums[v as usize];
            (0..3).for_each(|axis| sum[axis] += normal[axis]);
        }
    }
    sums.into_iter().map(unit).collect()
}

pub(crate) fn minus(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

pub(crate) fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

pub(crate) fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// A vector of length one; up, for a vector without a direction.
pub(crate) fn unit(v: [f64; 3]) -> [f64; 3] {
    let length = dot(v, v).sqrt();
    if length == 0.0 { [0.0, 0.0, 1.0] } else { v.map(|part| part / length) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::samples;

    #[test]
    fn shared_sides_are_welded_and_nothing_else_is() {
        let product = samples::product();
        let mesh = Mesh::of(&product);
        // Two load modules of 4 and 5 vertices that share 2.
        assert_eq!((mesh.vertices.len(), mesh.triangles.len(), mesh.classes.len()), (7, 6, 6));
        let doubled: i64 = mesh
            .triangles
            .iter()
            .map(|triangle| {
                let [a, b, c] = triangle.map(|v| mesh.vertices[v as usize].map(i64::from));
                (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
            })
            .sum();
        assert_eq!(doubled, 2 * 2 * 64_000 * 64_000);
    }

    #[test]
    fn a_part_has_the_triangles_of_its_load_modules_over_its_own_vertices() {
        let product = samples::product();
        let mesh = Mesh::of(&product);
        let part = mesh.part(&product, Sheet::Ground, samples::eastern().rect);
        assert_eq!((part.vertices.len(), part.triangles.len()), (5, 4));
        for (own, whole) in part.triangles.iter().zip(&mesh.triangles[2..]) {
            assert_eq!(own.map(|v| part.vertices[v as usize]), *whole);
        }
        assert_eq!(part.modules, [(ModuleId { row: 0, col: 1 }, 0..4)]);
    }

    #[test]
    fn pieces_of_an_object_in_several_load_modules_have_its_height() {
        let mut product = samples::with_objects();
        let id = product.modules[1].objects.prisms[0].id;
        let whole = |product: &Product| {
            let mesh = Mesh::of(product);
            let own = mesh.things.iter().filter(|(thing, _)| thing.kind == ObjectKind::Building && thing.id == id);
            own.map(|(thing, _)| thing.height).collect::<Vec<i32>>()
        };
        let before = whole(&product);
        assert_eq!(before, vec![before[0]; 2]);
        // The ground lies lower there, and the piece begins lower.
        product.modules[1].objects.prisms[0].base -= 640;
        assert_eq!(whole(&product), vec![before[0] + 640; 2]);
    }

    #[test]
    fn triangles_over_holes_and_their_vertices_are_left_out() {
        let product = samples::with_hole();
        let whole = Mesh::whole(&product);
        assert_eq!((whole.vertices.len(), whole.triangles.len()), (7, 6));
        // The eastern load module, its two western triangles excepted, is a hole, and so is its north-eastern corner.
        let mesh = Mesh::of(&product);
        assert_eq!((mesh.vertices.len(), mesh.triangles.len()), (6, 4));
        assert!(!mesh.classes.contains(&HOLE_CLASS) && mesh.module_starts() == [0, 2, 4]);
        assert!(mesh.triangles.iter().flatten().all(|&v| (v as usize) < mesh.vertices.len()));
        for part in [&mesh, &whole].map(|of| of.part(&product, Sheet::Ground, product.rect)) {
            assert_eq!((part.vertices.len(), part.triangles.len(), part.classes.len()), (6, 4, 4));
            assert_eq!(part.modules[1].1, 2..4);
        }
    }

    #[test]
    fn decks_follow_the_ground_over_vertices_of_their_own() {
        let product = samples::with_bridge();
        let (mesh, ground) = (Mesh::of(&product), Mesh::whole(&product));
        assert_eq!([Sheet::Ground, Sheet::Decks].map(|sheet| mesh.sheet(sheet)), [0..6, 6..12]);
        assert_eq!((&mesh.vertices[..7], &mesh.triangles[..6]), (&ground.vertices[..], &ground.triangles[..]));
        // The lower bridge goes on over the line between the load modules: two vertices are shared.
        assert_eq!((mesh.vertices.len(), &mesh.classes[6..]), (7 + 6 + 4, &[1, 1, 1, 1, 2, 2][..]));
        let (both, east) = (mesh.part(&product, Sheet::Decks, product.rect), samples::eastern().rect);
        assert_eq!((both.vertices.len(), both.triangles.len()), (10, 6));
        assert_eq!(mesh.part(&product, Sheet::Decks, east).modules, [(ModuleId { row: 0, col: 1 }, 0..4)]);
        assert_eq!(mesh.part(&product, Sheet::Ground, east).triangles.len(), 4);
        assert!(ground.part(&product, Sheet::Decks, east).triangles.is_empty());
    }

    #[test]
    fn level_ground_faces_up_and_a_slope_leans() {
        let places = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 1.0, 1.0]];
        let flat = normals(&places, &[[0, 1, 2]]);
        assert_eq!(flat[0], [0.0, 0.0, 1.0]);
        let both = normals(&places, &[[0, 1, 2], [1, 3, 2]]);
        assert!(both[3][0] < 0.0 && both[3][1] < 0.0 && 0.0 < both[3][2]);
        assert!((dot(both[1], both[1]) - 1.0).abs() < 1e-12);
    }
}
