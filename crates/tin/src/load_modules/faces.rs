//! The classes that features give the ground inside them: rings asked with the centres of triangles.
//!
//! No centre lies on an edge of its own TIN, so where a ring's edges are edges of the TIN, each triangle lies wholly
//! on the side of its centre. Where one is missing, because it was left out, a triangle across it takes the side of its
//! centre and no other triangle is touched; filling from edge to edge would give the whole ground the road's class.
//!
//! A centre is inside where a ray from it to the east crosses the rings an odd number of times. Whole numbers decide
//! it, and an edge holds its southern end and not its northern one: where faces share edges, every place but a corner
//! of the ground belongs to one of them, so the pieces of a road leave no gap.

use std::collections::BTreeMap;
use std::ops::Range;

use terrain::{LatticePoint, Tin};

/// Posts along a cell of the search: about as long as an edge of a strip.
const CELL_POSTS: i32 = 4;

/// A part of the ground that a feature gives a class.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Face {
    /// Its class.
    pub class: u8,
    /// The height of level water: only triangles all of whose corners have it are of the face. What something else
    /// tilts is the bank of it.
    pub level: Option<i32>,
    /// Closed rings, the first corner not repeated, in either direction: what lies inside an odd number of them belongs
    /// to the face, so an island is a ring like the shore.
    pub rings: Vec<Vec<LatticePoint>>,
}

/// Faces of a tile, found by place.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Faces {
    steps_per_post: i32,
    /// What the faces have in each row of cells.
    parts: Vec<Part>,
    /// Edges of the parts, their southern ends first.
    edges: Vec<[LatticePoint; 2]>,
    /// The parts in each cell, by row and column, in the order of their faces.
    cells: BTreeMap<[i32; 2], Vec<u32>>,
    /// Faces whose outlines triangles need not keep: they give their class where they cover more than half of one.
    loose: Option<Box<Faces>>,
}

/// Parts of a side into which a triangle is cut to see how much of it a face covers.
const PARTS: i64 = 4;

/// The edges of a face that reach into one row of cells.
#[derive(Clone, Debug, PartialEq, Eq)]
struct Part {
    class: u8,
    level: Option<i32>,
    edges: Range<u32>,
}

impl Faces {
    /// Faces whose rings count in steps of which so many make a post. Of faces that overlap the first wins.
    pub fn new(faces: &[Face], steps_per_post: i32) -> Self {
        let mut index =
            Self { steps_per_post, parts: Vec::new(), edges: Vec::new(), cells: BTreeMap::new(), loose: None };
        faces.iter().for_each(|face| index.add(face));
        index
    }

    /// Adds faces whose outlines triangles need not keep.
    #[must_use]
    pub fn with_loose(self, faces: &[Face]) -> Self {
        let loose = (!faces.is_empty()).then(|| Box::new(Self::new(faces, self.steps_per_post)));
        Self { loose, ..self }
    }

    /// The class that covers more than half of a triangle, by the centres of its parts.
    fn class_over(&self, corners: [[i64; 2]; 3], units_per_post: i32, has_level: &dyn Fn(i32) -> bool) -> Option<u8> {
        let [a, b, c] = corners;
        // Places in parts of a side along two of them.
        let at =
            |i: i64, j: i64| [0, 1].map(|axis| PARTS * a[axis] + i * (b[axis] - a[axis]) + j * (c[axis] - a[axis]));
        let mut found: BTreeMap<u8, i64> = BTreeMap::new();
        for (i, j) in (0..PARTS).flat_map(|i| (0..PARTS - i).map(move |j| (i, j))) {
            let up = [at(i, j), at(i + 1, j), at(i, j + 1)];
            let down = (i + j < PARTS - 1).then(|| [at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)]);
            for part in std::iter::once(up).chain(down) {
                if let Some(class) = self.class_in(part, units_per_post * PARTS as i32, has_level) {
                    *found.entry(class).or_default() += 1;
                }
            }
        }
        found.into_iter().find(|(_, count)| PARTS * PARTS < 2 * count).map(|(class, _)| class)
    }

    /// The class of each triangle that lies inside a face, by the triangles' order.
    pub fn of_triangles(&self, tin: &Tin) -> Vec<Option<u8>> {
        let corner = |v: u32| {
            let at = tin.vertices[v as usize].at;
            [at.row, at.col].map(i64::from)
        };
        let height = |v: u32| tin.vertices[v as usize].height;
        let class = |triangle: &[u32; 3]| self.class_at(triangle.map(corner), triangle.map(height), tin.steps_per_post);
        tin.triangles.iter().map(class).collect()
    }

    /// The class of a triangle of three corners (row, column) with their heights, by its centre. Corners count in units
    /// of which so many make a post.
    pub(crate) fn class_at(&self, corners: [[i64; 2]; 3], heights: [i32; 3], units_per_post: i32) -> Option<u8> {
        let has_level = |level: i32| heights == [level; 3];
        let own = self.class_in(corners, units_per_post, &has_level);
        own.or_else(|| self.loose.as_ref()?.class_over(corners, units_per_post, &has_level))
    }

    /// The class of the first face that holds the centre of three corners and, where it is level, `has_level` allows.
    fn class_in(&self, corners: [[i64; 2]; 3], units_per_post: i32, has_level: &dyn Fn(i32) -> bool) -> Option<u8> {
        let centre = Centre::of(corners, self.steps_per_post, units_per_post);
        let cell = i128::from(CELL_POSTS * self.steps_per_post) * centre.den;
        let [row, col] = [centre.row, centre.col].map(|at| i32::try_from(at.div_euclid(cell)).ok());
        let parts = self.cells.get(&[row?, col?]).into_iter().flatten().map(|&part| &self.parts[part as usize]);
        let is_inside = |part: &&Part| {
            let edges = &self.edges[part.edges.start as usize..part.edges.end as usize];
            edges.iter().filter(|edge| centre.is_west_of(**edge)).count() % 2 == 1
        };
        let mut here = parts.into_iter().filter(is_inside);
        here.find(|part| part.level.is_none_or(has_level)).map(|part| part.class)
    }

    fn add(&mut self, face: &Face) {
        let cell = CELL_POSTS * self.steps_per_post;
        let mut rows: BTreeMap<i32, Vec<[LatticePoint; 2]>> = BTreeMap::new();
        for edge in face.rings.iter().flat_map(|ring| edges(ring)) {
            for row in edge[0].row.div_euclid(cell)..=(edge[1].row - 1).div_euclid(cell) {
                rows.entry(row).or_default().push(edge);
            }
        }
        for (row, edges) in rows {
            let part = self.parts.len() as u32;
            let (mut west, mut east) = (i32::MAX, i32::MIN);
            for &edge in &edges {
                let reach = reach(edge, row * cell, (row + 1) * cell);
                (west, east) = (west.min(reach.start), east.max(reach.end));
            }
            for col in west.div_euclid(cell)..=east.div_euclid(cell) {
                self.cells.entry([row, col]).or_default().push(part);
            }
            let first = self.edges.len() as u32;
            self.edges.extend(edges);
            self.parts.push(Part { class: face.class, level: face.level, edges: first..self.edges.len() as u32 });
        }
    }
}

/// The edges of a ring that cross rows, their southern ends first.
fn edges(ring: &[LatticePoint]) -> impl Iterator<Item = [LatticePoint; 2]> {
    let next = ring.iter().cycle().skip(1);
    ring.iter().zip(next).filter(|(a, b)| a.row != b.row).map(|(&a, &b)| if a.row < b.row { [a, b] } else { [b, a] })
}

/// The columns of an edge between two rows, rounded outward.
fn reach([low, high]: [LatticePoint; 2], south: i32, north: i32) -> Range<i32> {
    let rise = i64::from(high.row) - i64::from(low.row);
    let col = |row: i32| {
        let part =
            i128::from(i64::from(row) - i64::from(low.row)) * i128::from(i64::from(high.col) - i64::from(low.col));
        low.col + part.div_euclid(i128::from(rise)) as i32
    };
    let (a, b) = (col(low.row.max(south)), col(high.row.min(north)));
    a.min(b)..a.max(b) + 1
}

/// The centre of a triangle in steps: numerators and what they are divided by.
struct Centre {
    row: i128,
    col: i128,
    den: i128,
}

impl Centre {
    fn of(corners: [[i64; 2]; 3], steps_per_post: i32, units_per_post: i32) -> Self {
        let of = |axis: usize| {
            i128::from(corners.iter().map(|corner| corner[axis]).sum::<i64>() * i64::from(steps_per_post))
        };
        Self { row: of(0), col: of(1), den: 3 * i128::from(units_per_post) }
    }

    /// Whether a ray to the east crosses an edge.
    fn is_west_of(&self, [low, high]: [LatticePoint; 2]) -> bool {
        let from =
            |at: LatticePoint| [self.row - i128::from(at.row) * self.den, self.col - i128::from(at.col) * self.den];
        let ([up, right], down) = (from(low), from(high)[0]);
        let (rise, run) = (i128::from(high.row) - i128::from(low.row), i128::from(high.col) - i128::from(low.col));
        0 <= up && down < 0 && right * rise < run * up
    }
}

#[cfg(test)]
mod tests {
    use fastrand::Rng;
    use terrain::geometry::orient;
    use terrain::mesh::{constrained_delaunay, delaunay};
    use terrain::{PostRect, Vertex};

    use super::*;

    const STEPS: i32 = 64;

    fn place(row: i32, col: i32) -> LatticePoint {
        LatticePoint::new(row, col)
    }

    fn face(class: u8, rings: &[&[(i32, i32)]]) -> Face {
        let ring = |ring: &&[(i32, i32)]| ring.iter().map(|&(row, col)| place(row, col)).collect();
        Face { class, level: None, rings: rings.iter().map(ring).collect() }
    }

    /// The class at a place, as that of a triangle all of whose corners lie there.
    fn class_of(faces: &Faces, at: LatticePoint) -> Option<u8> {
        faces.class_at([[i64::from(at.row), i64::from(at.col)]; 3], [0; 3], STEPS)
    }

    /// Places without repeats in a square, its corners among them.
    fn scatter(random: &mut Rng, side: i32, count: usize) -> Vec<LatticePoint> {
        let mut places = vec![place(0, 0), place(0, side), place(side, 0), place(side, side)];
        places.extend((0..count).map(|_| place(random.i32(0..=side), random.i32(0..=side))));
        places.sort_unstable();
        places.dedup();
        places
    }

    #[test]
    fn each_triangle_has_the_class_of_the_face_it_lies_in() {
        for seed in 0..40 {
            let mut random = Rng::with_seed(seed);
            // From faces of many cells to faces far smaller than one; some places of the ground are in none.
            let posts = [1, 8, 60][seed as usize % 3];
            let coarse = scatter(&mut random, posts * STEPS, 40);
            let corners = delaunay(&coarse);
            let classes: Vec<u8> = (0..corners.len()).map(|_| random.u8(0..5)).collect();
            let given: Vec<Face> = (corners.iter().zip(&classes).filter(|(_, class)| **class != 0))
                .map(|(triangle, &class)| {
                    let mut ring = triangle.map(|v| coarse[v as usize]).to_vec();
                    random.shuffle(&mut ring);
                    Face { class, level: None, rings: vec![ring] }
                })
                .collect();
            let mut fine = coarse.clone();
            fine.extend(scatter(&mut random, posts * STEPS, 200));
            fine.sort_unstable();
            fine.dedup();
            let number = |v: u32| fine.partition_point(|at| *at < coarse[v as usize]) as u32;
            let edges: Vec<[u32; 2]> =
                corners.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]].map(|ends| ends.map(number))).collect();
            let (triangles, kept) = constrained_delaunay(&fine, &edges);
            assert!(!kept.contains(&false));
            let lies_in = |triangle: &[u32; 3], face: &[u32; 3]| {
                let [a, b, c] = face.map(|v| coarse[v as usize]);
                triangle.iter().all(|&v| {
                    let at = fine[v as usize];
                    0 <= orient(a, b, at) && 0 <= orient(b, c, at) && 0 <= orient(c, a, at)
                })
            };
            let expected = triangles.iter().map(|triangle| {
                let face = corners.iter().position(|face| lies_in(triangle, face)).unwrap();
                (classes[face] != 0).then_some(classes[face])
            });
            let vertices = fine.iter().map(|&at| Vertex { at, height: 0 }).collect();
            let rect = PostRect::of_size(posts as usize + 1, posts as usize + 1);
            let tin = Tin { rect, steps_per_post: STEPS, vertices, triangles: triangles.clone() };
            tin.check().unwrap();
            let found = Faces::new(&given, STEPS).of_triangles(&tin);
            assert_eq!(found, expected.collect::<Vec<_>>(), "seed {seed}");
        }
    }

    #[test]
    fn every_place_lies_in_one_of_the_faces_that_cover_the_ground() {
        let mut random = Rng::with_seed(7);
        let places = scatter(&mut random, 20, 12);
        let ring = |triangle: [u32; 3]| vec![triangle.map(|v| places[v as usize]).to_vec()];
        let faces: Vec<Faces> = (delaunay(&places).into_iter())
            .map(|triangle| Faces::new(&[Face { class: 1, level: None, rings: ring(triangle) }], STEPS))
            .collect();
        for (row, col) in (0..20).flat_map(|row| (0..20).map(move |col| (row, col))) {
            let holders = faces.iter().filter(|faces| class_of(faces, place(row, col)).is_some());
            assert_eq!(holders.count(), 1, "{row},{col}");
        }
    }

    #[test]
    fn an_island_is_no_water_and_of_faces_that_overlap_the_first_wins() {
        let shore = [(-900, -900), (-900, 900), (900, 900), (900, -900)];
        let island = [(-300, -300), (300, -300), (300, 300), (-300, 300)];
        let road = [(-5, -2000), (5, -2000), (5, 2000), (-5, 2000)];
        let faces = Faces::new(&[face(3, &[&road]), face(9, &[&shore, &island])], STEPS);
        let expected = [(0, 0, Some(3)), (0, 600, Some(3)), (100, 0, None), (100, 600, Some(9)), (100, 1200, None)];
        for (row, col, class) in expected {
            assert_eq!(class_of(&faces, place(row, col)), class, "{row},{col}");
        }
    }

    #[test]
    fn an_edge_that_the_tin_does_not_have_touches_no_triangle_but_those_across_it() {
        let places = [place(0, 0), place(0, 640), place(640, 0), place(640, 640), place(100, 300)];
        let triangles = delaunay(&places);
        let tin = Tin {
            rect: PostRect::of_size(11, 11),
            steps_per_post: STEPS,
            vertices: places.map(|at| Vertex { at, height: 0 }).to_vec(),
            triangles,
        };
        let ring = face(2, &[&[(0, 0), (0, 640), (100, 300)]]);
        let across = face(4, &[&[(110, 310), (400, 610), (400, 300)]]);
        let classes = Faces::new(&[ring, across], STEPS).of_triangles(&tin);
        assert_eq!(classes.iter().filter(|class| **class == Some(2)).count(), 1);
        assert!(classes.iter().filter(|class| class.is_some()).count() <= 2, "{classes:?}");
    }

    #[test]
    fn rings_without_area_are_no_faces() {
        let given = [face(1, &[]), face(1, &[&[]]), face(1, &[&[(3, 3)]]), face(1, &[&[(0, 0), (90, 90)]])];
        let faces = Faces::new(&given, STEPS);
        assert!((0..90).all(|at| class_of(&faces, place(at, at)).is_none()));
    }

    #[test]
    fn only_what_is_level_is_water() {
        let pond = face(3, &[&[(0, 0), (0, 640), (640, 640), (640, 0)]]);
        let faces =
            Faces::new(&[Face { level: Some(7), ..pond.clone() }, face(4, &[&[(0, 0), (0, 9), (9, 9)]])], STEPS);
        let corners = [[0, 0], [640, 0], [0, 640]];
        assert_eq!(faces.class_at(corners, [7; 3], STEPS), Some(3));
        assert_eq!(faces.class_at(corners, [7, 8, 7], STEPS), None);
        assert_eq!(faces.class_at([[1, 4], [1, 5], [2, 5]], [8; 3], STEPS), Some(4), "what lies below has it");
        assert_eq!(Faces::new(std::slice::from_ref(&pond), STEPS).class_at(corners, [7, 8, 7], STEPS), Some(3));
        // The same of what is not in the TIN.
        let loose = Faces::new(&[], STEPS).with_loose(&[Face { level: Some(7), ..pond }]);
        assert_eq!(loose.class_at(corners, [7; 3], STEPS), Some(3));
        assert_eq!(loose.class_at(corners, [7, 8, 7], STEPS), None);
    }
}
