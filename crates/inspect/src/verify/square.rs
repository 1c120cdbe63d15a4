//! A load module as a square of places in quanta, and what of features is held against it.

use std::collections::{HashMap, HashSet};

use terrain::{FeatureSurface, LatticePoint, LoadModule};

/// A place in quanta north and east of the area's south-west post.
pub(crate) type At = (i64, i64);

/// A load module with its vertices where they are in the area.
pub(crate) struct Square<'a> {
    pub module: &'a LoadModule,
    south_west: At,
    pub heights: HashMap<At, i32>,
    pub edges: HashSet<[At; 2]>,
}

impl<'a> Square<'a> {
    pub fn of(module: &'a LoadModule) -> Self {
        let side = i64::from(module.side);
        let south_west = (i64::from(module.id.row) * side, i64::from(module.id.col) * side);
        let mut square = Self { module, south_west, heights: HashMap::new(), edges: HashSet::new() };
        for vertex in &module.vertices {
            square.heights.insert(square.at(vertex.y, vertex.x), vertex.z);
        }
        for triangle in &module.triangles {
            let [a, b, c] = square.corners(triangle);
            for (from, to) in [(a, b), (b, c), (c, a)] {
                square.edges.insert([from.min(to), from.max(to)]);
            }
        }
        square
    }

    pub fn at(&self, y: u16, x: u16) -> At {
        (self.south_west.0 + i64::from(y), self.south_west.1 + i64::from(x))
    }

    pub fn corners(&self, triangle: &[u16; 3]) -> [At; 3] {
        triangle.map(|v| {
            let vertex = self.module.vertices[usize::from(v)];
            self.at(vertex.y, vertex.x)
        })
    }

    /// Whether a place lies on one of its sides.
    pub fn is_side(&self, (y, x): At) -> bool {
        let [south, west, north, east] = self.reach();
        y == south || y == north || x == west || x == east
    }

    /// Whether a place lies in it or on its sides.
    pub fn holds(&self, (y, x): At) -> bool {
        let (side, (south, west)) = (i64::from(self.module.side), self.south_west);
        (south..=south + side).contains(&y) && (west..=west + side).contains(&x)
    }

    /// South, west, north, east.
    pub fn reach(&self) -> [i64; 4] {
        let (side, (south, west)) = (i64::from(self.module.side), self.south_west);
        [south, west, south + side, west + side]
    }
}

/// The rings of a body.
pub(crate) struct Outline {
    rings: Vec<Vec<At>>,
    /// South, west, north, east.
    pub reach: [i64; 4],
}

impl Outline {
    /// That of a body whose points lie where `at` says.
    pub fn of(body: &[FeatureSurface], at: impl Fn(LatticePoint) -> At) -> Self {
        let ring = |surface: &FeatureSurface| surface.ring.iter().map(|vertex| at(vertex.at)).collect();
        let rings: Vec<Vec<At>> = body.iter().map(ring).collect();
        let mut reach = [i64::MAX, i64::MAX, i64::MIN, i64::MIN];
        for (y, x) in rings.iter().flatten() {
            reach = [reach[0].min(*y), reach[1].min(*x), reach[2].max(*y), reach[3].max(*x)];
        }
        Self { rings, reach }
    }

    /// Whether it may have something in a rectangle: its southern, western, northern and eastern end.
    pub fn reaches(&self, [south, west, north, east]: [i64; 4]) -> bool {
        let [low, left, high, right] = self.reach;
        low <= north && south <= high && left <= east && west <= right
    }

    /// Whether a line from a place to the east crosses the rings an odd number of times.
    pub fn holds(&self, at: At) -> bool {
        if !self.reaches([at.0, at.1, at.0, at.1]) {
            return false;
        }
        let crosses = |a: At, b: At| {
            let (low, high) = if a.0 <= b.0 { (a, b) } else { (b, a) };
            low.0 <= at.0 && at.0 < high.0 && 0 < turn(low, high, at)
        };
        let edges = self.rings.iter().flat_map(|ring| (0..ring.len()).map(|i| (ring[i], ring[(i + 1) % ring.len()])));
        edges.filter(|(a, b)| crosses(*a, *b)).count() % 2 == 1
    }
}

/// Twice the area of a triangle: positive where it turns left, 0 where it is a line.
pub(crate) fn turn(a: At, b: At, c: At) -> i128 {
    let [ay, ax, by, bx, cy, cx] = [a.0, a.1, b.0, b.1, c.0, c.1].map(i128::from);
    (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
}

/// Whether a place lies on the line from `a` to `b`, its ends included.
pub(crate) fn is_on(a: At, b: At, at: At) -> bool {
    let within = |a: i64, b: i64, v: i64| a.min(b) <= v && v <= a.max(b);
    within(a.0, b.0, at.0) && within(a.1, b.1, at.1) && turn(a, b, at) == 0
}
