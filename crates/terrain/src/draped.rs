//! What follows the ground of a load module: polygons and edges are cut along its triangles.

use std::collections::BTreeSet;

use crate::LoadModule;

/// A place on the plan, in quanta.
pub type Flat = [f64; 2];

/// The triangles of a load module's ground, holes closed.
pub struct Draped {
    triangles: Vec<([[f64; 3]; 3], [Flat; 2])>,
}

impl Draped {
    /// Those of a load module whose south-west corner stands at `corner`.
    pub fn of(module: &LoadModule, corner: [i32; 2]) -> Self {
        let place = |index: u16| {
            let vertex = &module.vertices[usize::from(index)];
            [corner[0] + i32::from(vertex.x), corner[1] + i32::from(vertex.y), vertex.z].map(f64::from)
        };
        let triangle = |corners: &[u16; 3]| {
            let corners = corners.map(place);
            (corners, bounds(&corners.map(flat)))
        };
        Self { triangles: module.triangles.iter().map(triangle).collect() }
    }

    /// The same without the triangles of some classes; `module` is that whose ground it is.
    pub fn without(mut self, module: &LoadModule, classes: &BTreeSet<u8>) -> Self {
        let mut own = module.classes.iter();
        self.triangles.retain(|_| own.next().is_some_and(|class| !classes.contains(class)));
        self
    }

    /// The triangles whose bounds meet those of places.
    fn near(&self, places: &[Flat]) -> impl Iterator<Item = &[[f64; 3]; 3]> {
        let [low, high] = bounds(places);
        let meets = move |own: &[Flat; 2]| (0..2).all(|axis| own[0][axis] <= high[axis] && low[axis] <= own[1][axis]);
        self.triangles.iter().filter(move |(_, own)| meets(own)).map(|(corners, _)| corners)
    }

    /// The pieces of a convex polygon, counter-clockwise, on each triangle, at the height of the ground.
    pub fn under(&self, polygon: &[Flat]) -> Vec<Vec<[f64; 3]>> {
        let pieces = self.near(polygon).map(|corners| {
            let [a, b, c] = corners.map(flat);
            let piece = clipped(&clipped(&clipped(polygon, a, b), b, c), c, a);
            piece.into_iter().map(|at| [at[0], at[1], height(corners, at)]).collect::<Vec<_>>()
        });
        pieces.filter(|piece| 3 <= piece.len()).collect()
    }

    /// Places along an edge at which the ground bends, its ends among them, at the height of the ground.
    pub fn along(&self, [from, to]: [Flat; 2]) -> Vec<[f64; 3]> {
        let at = |share: f64| [0, 1].map(|axis| from[axis] + share * (to[axis] - from[axis]));
        let mut spans: Vec<([f64; 2], &[[f64; 3]; 3])> =
            self.near(&[from, to]).filter_map(|corners| Some((span(corners, [from, to])?, corners))).collect();
        spans.sort_by(|(a, _), (b, _)| a[0].total_cmp(&b[0]));
        let mut places: Vec<[f64; 3]> = Vec::new();
        let mut reached = -1.0;
        for ([start, end], corners) in spans {
            let new = [start, end].into_iter().filter(|share| reached + SHARE_MIN < *share).collect::<Vec<_>>();
            for share in new {
                let [x, y] = at(share);
                places.push([x, y, height(corners, [x, y])]);
                reached = share;
            }
        }
        places
    }
}

/// Parts of an edge shorter than this share of it are none.
const SHARE_MIN: f64 = 1e-9;

/// East and north of a place.
fn flat([x, y, _]: [f64; 3]) -> Flat {
    [x, y]
}

fn bounds(places: &[Flat]) -> [Flat; 2] {
    let of = |axis: usize| places.iter().map(move |place| place[axis]);
    [
        [0, 1].map(|axis| of(axis).fold(f64::INFINITY, f64::min)),
        [0, 1].map(|axis| of(axis).fold(f64::NEG_INFINITY, f64::max)),
    ]
}

/// How far left of a line from `a` to `b` a place lies, times its length.
fn left(a: Flat, b: Flat, at: Flat) -> f64 {
    (b[0] - a[0]) * (at[1] - a[1]) - (b[1] - a[1]) * (at[0] - a[0])
}

/// What of a convex polygon lies left of the line from `a` to `b`.
fn clipped(polygon: &[Flat], a: Flat, b: Flat) -> Vec<Flat> {
    let mut kept = Vec::with_capacity(polygon.len() + 1);
    for (&p, &q) in polygon.iter().zip(polygon.iter().cycle().skip(1)) {
        let (of_p, of_q) = (left(a, b, p), left(a, b, q));
        if 0.0 <= of_p {
            kept.push(p);
        }
        if (of_p < 0.0 && 0.0 < of_q) || (of_q < 0.0 && 0.0 < of_p) {
            let share = of_p / (of_p - of_q);
            kept.push([0, 1].map(|axis| p[axis] + share * (q[axis] - p[axis])));
        }
    }
    kept
}

/// The part of an edge over a triangle, as shares of it; `None` where it is none.
fn span(corners: &[[f64; 3]; 3], [from, to]: [Flat; 2]) -> Option<[f64; 2]> {
    let (mut start, mut end) = (0.0_f64, 1.0_f64);
    for side in 0..3 {
        let (a, b) = (flat(corners[side]), flat(corners[(side + 1) % 3]));
        let (of_from, of_to) = (left(a, b, from), left(a, b, to));
        match (of_from < 0.0, of_to < 0.0) {
            (true, true) => return None,
            (true, false) => start = start.max(of_from / (of_from - of_to)),
            (false, true) => end = end.min(of_from / (of_from - of_to)),
            (false, false) => {}
        }
    }
    (start + SHARE_MIN < end).then_some([start, end])
}

/// The height of the plane of a triangle.
fn height(corners: &[[f64; 3]; 3], at: Flat) -> f64 {
    let [a, b, c] = corners.map(flat);
    let (of_b, of_c, all) = (left(c, a, at), left(a, b, at), left(a, b, c));
    corners[0][2] + (of_b * (corners[1][2] - corners[0][2]) + of_c * (corners[2][2] - corners[0][2])) / all
}
