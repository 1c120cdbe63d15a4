//! Features into a grown TIN: its posts, the features' vertices and edges and the lines are triangulated together.
//!
//! The grown TIN is the constrained Delaunay triangulation of its posts already, so away from features nothing
//! changes; and a triangulation of a set does not depend on the order in which features are given. Posts nearer to a
//! feature than half a post would make needles and go, as do those without weight, which lie inside strips and water.

use terrain::geometry::Canonical;
use terrain::mesh::constrained_delaunay;
use terrain::{Features, LatticePoint, PostRect};

use crate::optimiser::hold::Hold;
use crate::optimiser::parts::{Layout, NONE, Parts, Vertex};
use crate::optimiser::place::{PER_POST, Place};
use crate::optimiser::weighted_heights::WeightedHeights;

/// Posts nearer to a feature than so many steps go.
const NEAR: i32 = PER_POST / 2;

impl Canonical for Place {
    fn row(self) -> i32 {
        self.y
    }
    fn col(self) -> i32 {
        self.x
    }
}

/// A TIN's parts with the features in them, and the edges that could not be kept, because they cross others or lines.
///
/// # Panics
/// When a vertex of a feature lies outside the tile.
pub(crate) fn weave(
    ground: &WeightedHeights,
    grown: Parts,
    features: &Features,
    rect: PostRect,
    layout: &Layout,
) -> (Parts, Vec<[LatticePoint; 2]>) {
    let features = features.canonical();
    let place = |at: LatticePoint| Place::of(at, rect, features.steps_per_post);
    let places: Vec<Place> = features.vertices.iter().map(|vertex| place(vertex.at)).collect();
    let edges: Vec<[Place; 2]> = features.edges.iter().map(|ends| ends.map(|v| places[v as usize])).collect();
    let far = ground.far();
    let inside = |at: &Place| 0 <= at.x && at.x <= far.x && 0 <= at.y && at.y <= far.y;
    assert!(places.iter().all(inside), "a tile is given what lies inside it");
    let near = Near::of(far, &places, &edges);
    let stays = |vertex: &Vertex| {
        let goes = near.holds(vertex.at) || !ground.counts(vertex.at) || ground.is_forbidden(vertex.at);
        (vertex.hold.is_fixed() || !goes) && places.binary_search(&vertex.at).is_err()
    };
    let mut vertices: Vec<Vertex> = grown.vertices.into_iter().filter(stays).collect();
    let fixed: Vec<Place> = fixed_places(&vertices, &places);
    vertices.extend(features.vertices.iter().zip(&places).map(|(vertex, &at)| Vertex {
        at,
        height: f64::from(vertex.height) - ground.level(),
        edge: NONE,
        hold: layout.line_hold(ground, at).and(Hold::GIVEN),
        has_changed: true,
        cost: f64::NAN,
    }));
    vertices.sort_unstable_by_key(|vertex| vertex.at);
    let at: Vec<Place> = vertices.iter().map(|vertex| vertex.at).collect();
    let number = |place: Place| at.partition_point(|other| *other < place) as u32;
    let lines = along_lines(&vertices, layout.line_step);
    let pieces: Vec<[Place; 2]> = edges.iter().flat_map(|&ends| pieces(ends, &fixed)).collect();
    let wanted: Vec<[u32; 2]> = lines.into_iter().chain(pieces.iter().map(|ends| ends.map(number))).collect();
    let (triangles, found) = constrained_delaunay(&at, &wanted);
    let found = &found[wanted.len() - pieces.len()..];
    let of =
        |is_kept: bool| pieces.iter().zip(found).filter(move |(_, found)| **found == is_kept).map(|(ends, _)| *ends);
    let mut kept: Vec<[Place; 2]> = of(true).collect();
    kept.sort_unstable();
    let left_out = of(false).map(|ends| ends.map(|at| at.lattice_point(rect, PER_POST))).collect();
    for [a, b] in &kept {
        for end in [a, b] {
            let vertex = &mut vertices[number(*end) as usize];
            vertex.hold = vertex.hold.and(Hold::FEATURE);
        }
    }
    (Parts { vertices, triangles, kept }, left_out)
}

/// Places of vertices that stay where they are, those of features among them, in ascending order.
fn fixed_places(vertices: &[Vertex], places: &[Place]) -> Vec<Place> {
    let mut fixed: Vec<Place> =
        vertices.iter().filter(|vertex| vertex.hold.is_fixed()).map(|vertex| vertex.at).collect();
    fixed.extend(places);
    fixed.sort_unstable();
    fixed
}

/// Edges between neighbours on each line; `vertices` are in ascending order.
fn along_lines(vertices: &[Vertex], line_step: Option<i32>) -> Vec<[u32; 2]> {
    if line_step.is_none() {
        // The tile's border is a straight hull, and that is always there.
        return Vec::new();
    }
    let on = |line: Hold, key: fn(Place) -> (i32, i32)| {
        let mut on: Vec<u32> = (0..vertices.len() as u32).filter(|&v| vertices[v as usize].hold.has(line)).collect();
        on.sort_unstable_by_key(|&v| key(vertices[v as usize].at));
        on.windows(2)
            .map(|pair| [pair[0], pair[1]])
            .filter(|pair| {
                let [a, b] = pair.map(|v| key(vertices[v as usize].at));
                a.0 == b.0
            })
            .collect::<Vec<_>>()
    };
    let mut edges = on(Hold::ROW, |at| (at.y, at.x));
    edges.extend(on(Hold::COLUMN, |at| (at.x, at.y)));
    edges
}

/// An edge in pieces, where vertices that stay lie on it.
fn pieces([a, b]: [Place; 2], fixed: &[Place]) -> Vec<[Place; 2]> {
    let first = fixed.partition_point(|place| *place <= a);
    let between = fixed[first..].iter().take_while(|place| **place < b);
    let mut ends = vec![a];
    ends.extend(between.filter(|&&place| Place::orient(a, b, place) == 0).copied());
    ends.push(b);
    ends.windows(2).map(|ends| [ends[0], ends[1]]).collect()
}

/// Posts that lie near a feature.
struct Near {
    far: Place,
    is_near: Vec<bool>,
}

impl Near {
    fn of(far: Place, places: &[Place], edges: &[[Place; 2]]) -> Self {
        let posts = |v: i32| (v / PER_POST + 1) as usize;
        let mut near = Self { far, is_near: vec![false; posts(far.x) * posts(far.y)] };
        places.iter().for_each(|&at| near.mark([at, at]));
        edges.iter().for_each(|&ends| near.mark(ends));
        near
    }

    fn index(&self, row: i32, col: i32) -> usize {
        row as usize * (self.far.x / PER_POST + 1) as usize + col as usize
    }

    /// Marks the posts near an edge, whose lesser end comes first.
    fn mark(&mut self, [a, b]: [Place; 2]) {
        let posts = |low: i32, high: i32, far: i32| {
            let first = (low - NEAR).div_euclid(PER_POST).max(0);
            first..=((high + NEAR) / PER_POST).min(far / PER_POST)
        };
        for row in posts(a.y, b.y, self.far.y) {
            let (south, north) = (a.y.max(row * PER_POST - NEAR), b.y.min(row * PER_POST + NEAR));
            // A step more either side makes up for rounding.
            let x = |y: i32| match b.y - a.y {
                0 => a.x,
                rise => a.x + (i64::from(b.x - a.x) * i64::from(y - a.y) / i64::from(rise)) as i32,
            };
            let (from, to) = if a.y == b.y { (a.x, b.x) } else { (x(south), x(north)) };
            for col in posts(from.min(to) - 1, from.max(to) + 1, self.far.x) {
                if is_near([a, b], Place::new(col * PER_POST, row * PER_POST)) {
                    let index = self.index(row, col);
                    self.is_near[index] = true;
                }
            }
        }
    }

    /// Whether the post at or nearest to a place is near.
    fn holds(&self, at: Place) -> bool {
        let nearest = |v: i32| (v + PER_POST / 2) / PER_POST;
        self.is_near[self.index(nearest(at.y), nearest(at.x))]
    }
}

/// Whether a place lies nearer than [`NEAR`] to an edge.
fn is_near([a, b]: [Place; 2], at: Place) -> bool {
    let (x, y) = (i64::from(b.x - a.x), i64::from(b.y - a.y));
    let along = x * i64::from(at.x - a.x) + y * i64::from(at.y - a.y);
    let (length, near) = (a.squared_distance(b), i64::from(NEAR * NEAR));
    if along <= 0 {
        a.squared_distance(at) < near
    } else if length <= along {
        b.squared_distance(at) < near
    } else {
        let across = i128::from(Place::orient(a, b, at));
        across * across < i128::from(near) * i128::from(length)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_posts_near_an_edge_are_those_found_one_by_one() {
        let far = Place::new(20 * PER_POST, 15 * PER_POST);
        let place = Place::new;
        for ends in [
            [place(3, 5), place(1270, 7)],
            [place(640, 0), place(641, 960)],
            [place(70, 90), place(900, 700)],
            [place(900, 90), place(70, 700)],
            [place(333, 444), place(333, 444)],
            [place(100, 64), place(200, 64)],
        ] {
            let near = Near::of(far, &[], &[ends]);
            for row in 0..=15 {
                for col in 0..=20 {
                    let post = place(col * PER_POST, row * PER_POST);
                    assert_eq!(near.holds(post), is_near(ends, post), "{ends:?} {post:?}");
                }
            }
        }
    }

    #[test]
    fn an_edge_is_cut_where_a_vertex_that_stays_lies_on_it() {
        let place = Place::new;
        let fixed = [place(0, 0), place(64, 64), place(70, 64), place(128, 128), place(640, 640)];
        let cut = pieces([place(0, 0), place(320, 320)], &fixed);
        let ends = [place(0, 0), place(64, 64), place(128, 128), place(320, 320)];
        assert_eq!(cut, [[ends[0], ends[1]], [ends[1], ends[2]], [ends[2], ends[3]]]);
    }
}
