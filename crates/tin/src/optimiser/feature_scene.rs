//! Features for tests: lines that touch at vertices or not at all, cut at the lines of load modules.

use std::collections::{BTreeMap, BTreeSet};

use terrain::{Dem, Features, LatticePoint, Post, PostRect, Tin, Vertex};

/// Steps between posts of the lattice they stand on.
pub(crate) const STEPS: i32 = 64;

/// A place in steps: north, east.
pub(crate) type At = (i32, i32);

/// A small generator (SplitMix64): the same numbers on any machine.
pub(crate) struct Draw(pub u64);

impl Draw {
    pub fn below(&mut self, bound: i32) -> i32 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) % bound as u64) as i32
    }

    pub fn shuffle<T>(&mut self, items: &mut [T]) {
        for i in (1..items.len()).rev() {
            items.swap(i, self.below(i as i32 + 1) as usize);
        }
    }

    pub fn place(&mut self, rect: PostRect) -> At {
        let of = |draw: &mut Self, cells: usize| draw.below(cells as i32 * STEPS + 1);
        (of(self, rect.cells_high()), of(self, rect.cells_wide()))
    }
}

fn orient(a: At, b: At, c: At) -> i64 {
    let of = |p: At| (i64::from(p.0 - a.0), i64::from(p.1 - a.1));
    let ((by, bx), (cy, cx)) = (of(b), of(c));
    bx * cy - by * cx
}

fn lies_within(p: At, [a, b]: [At; 2]) -> bool {
    let between = |p: i32, a: i32, b: i32| a.min(b) <= p && p <= a.max(b);
    p != a && p != b && orient(a, b, p) == 0 && between(p.0, a.0, b.0) && between(p.1, a.1, b.1)
}

fn disagree(one: [At; 2], other: [At; 2]) -> bool {
    let [[a, b], [c, d]] = [one, other];
    let signs = |p: At, q: At, r: At| orient(p, q, r).signum();
    let crosses = signs(a, b, c) * signs(a, b, d) < 0 && signs(c, d, a) * signs(c, d, b) < 0;
    crosses || [c, d].into_iter().any(|p| lies_within(p, one)) || [a, b].into_iter().any(|p| lies_within(p, other))
}

/// Lines as they are put together.
pub(crate) struct Draft {
    rect: PostRect,
    /// Posts along a side of a load module.
    side: i32,
    edges: BTreeSet<[At; 2]>,
}

impl Draft {
    pub fn new(rect: PostRect, side: i32) -> Self {
        Self { rect, side, edges: BTreeSet::new() }
    }

    /// Adds a line, cut at lines of load modules; nothing of it where it would meet another elsewhere than at a vertex.
    pub fn add(&mut self, line: &[At]) -> bool {
        let mut cut = vec![line[0]];
        line.windows(2).for_each(|ends| self.cut(ends[0], ends[1], &mut cut));
        let mut fresh: Vec<[At; 2]> = Vec::new();
        for ends in cut.windows(2).filter(|ends| ends[0] != ends[1]) {
            let edge = [ends[0].min(ends[1]), ends[0].max(ends[1])];
            if self.edges.iter().chain(&fresh).any(|&other| other == edge || disagree(edge, other)) {
                return false;
            }
            fresh.push(edge);
        }
        self.edges.extend(fresh);
        true
    }

    /// Goes on to `b`, by way of the rounded crossing of each line between.
    fn cut(&self, a: At, b: At, into: &mut Vec<At>) {
        let line = self.side * STEPS;
        let between = |a: i32, b: i32| {
            let (low, high) = (a.min(b), a.max(b));
            let first = (low.div_euclid(line) + 1) * line;
            (first < high).then_some(first)
        };
        let along = |from: i32, to: i32, part: i64, whole: i64| {
            let (part, whole) = (part.abs(), whole.abs());
            from + ((2 * i64::from(to - from) * part + whole).div_euclid(2 * whole)) as i32
        };
        let middle = match (between(a.0, b.0), between(a.1, b.1)) {
            (Some(row), _) => (row, along(a.1, b.1, i64::from(row - a.0), i64::from(b.0 - a.0))),
            (None, Some(col)) => (along(a.0, b.0, i64::from(col - a.1), i64::from(b.1 - a.1)), col),
            (None, None) => return into.push(b),
        };
        self.cut(a, middle, into);
        self.cut(middle, b, into);
    }

    /// A place where lines meet already.
    pub fn vertex(&self, draw: &mut Draw) -> Option<At> {
        let edges: Vec<_> = self.edges.iter().collect();
        (!edges.is_empty()).then(|| edges[draw.below(edges.len() as i32) as usize][0])
    }

    /// The features, a little above the ground.
    pub fn features(&self, dem: &Dem) -> Features {
        let places: BTreeSet<At> = self.edges.iter().flatten().copied().collect();
        let number: BTreeMap<At, u32> = places.iter().copied().zip(0..).collect();
        let height = |at: At| {
            let post = |v: i32| (v + STEPS / 2).div_euclid(STEPS);
            dem.height(Post::new(self.rect.south + post(at.0), self.rect.west + post(at.1))) + (at.0 * 7 + at.1) % 50
        };
        let (south, west) = (self.rect.south * STEPS, self.rect.west * STEPS);
        let vertex = |&at: &At| Vertex { at: LatticePoint::new(south + at.0, west + at.1), height: height(at) };
        Features {
            steps_per_post: STEPS,
            vertices: places.iter().map(vertex).collect(),
            edges: self.edges.iter().map(|ends| ends.map(|at| number[&at])).collect(),
            spans: Vec::new(),
        }
    }
}

/// Lines of all kinds over a rectangle of load modules `side` posts wide.
pub(crate) fn mixed(rect: PostRect, side: i32, seed: u64) -> Draft {
    let mut draw = Draw(seed);
    let mut draft = Draft::new(rect, side);
    let line = side * STEPS;
    let (north, east) = (rect.cells_high() as i32 * STEPS, rect.cells_wide() as i32 * STEPS);
    // Through a corner of load modules, along a line of them, and along the tile's border.
    draft.add(&[(line - 300, line - 500), (line, line), (line + 777, line + 123)]);
    draft.add(&[(line, line + 2 * STEPS), (line, line + 9 * STEPS), (line, 2 * line - 7)]);
    draft.add(&[(0, line + 40), (0, line + 400), (0, 2 * line)]);
    draft.add(&[(north - 200, east), (north - 900, east), (north - 1000, east - 600)]);
    // A hairpin whose arms are four steps apart, and a closed ring.
    let (row, col) = draw.place(rect);
    let (row, col) = (row.min(north - 10), col.min(east - 12 * STEPS));
    draft.add(&[(row, col), (row, col + 700), (row + 4, col + 700), (row + 4, col)]);
    let (row, col) = draw.place(rect);
    let (row, col) = (row.clamp(300, north - 300), col.clamp(300, east - 300));
    let ring = [(0, 250), (180, 180), (250, 0), (180, -180), (0, -250), (-180, -180), (-250, 0), (-180, 180), (0, 250)];
    draft.add(&ring.map(|(y, x)| (row + y, col + x)));
    for i in 0..40 {
        let from = match i % 3 {
            0 => draft.vertex(&mut draw).unwrap_or((0, 0)),
            _ => draw.place(rect),
        };
        let mut way = vec![from];
        for _ in 0..1 + draw.below(4) {
            let (row, col) = way[way.len() - 1];
            let mut step = |far: i32, at: i32| (at + draw.below(1201) - 600).clamp(0, far);
            way.push((step(north, row), step(east, col)));
        }
        draft.add(&way);
    }
    draft
}

/// So many short roads in the load module second from the south-west.
pub(crate) fn crowded(rect: PostRect, side: i32, count: usize, seed: u64) -> Draft {
    let mut draw = Draw(seed);
    let mut draft = Draft::new(rect, side);
    let mut added = 0;
    for _ in 0..100 * count {
        let (low, high) = (side * STEPS, 2 * side * STEPS);
        let at = (low + draw.below(high - low), low + draw.below(high - low));
        let to = |at: i32, by: i32| (at + by - 40).clamp(low, high);
        let to = (to(at.0, draw.below(81)), to(at.1, draw.below(81)));
        added += usize::from(at != to && draft.add(&[at, to]));
        if added == count {
            break;
        }
    }
    draft
}

/// Whether every edge of the features is one of the TIN's, or a chain of them that is straight and turns at vertices
/// of `given` only; and every vertex stands where it should.
pub(crate) fn missing(tin: &Tin, features: &Features, given: &dyn Fn(LatticePoint) -> bool) -> Vec<String> {
    let at: BTreeMap<LatticePoint, u32> = tin.vertices.iter().map(|vertex| vertex.at).zip(0..).collect();
    let sides = tin.triangles.iter().flat_map(|&[a, b, c]| [(a, b), (b, c), (c, a), (b, a), (c, b), (a, c)]);
    let edges: BTreeSet<(u32, u32)> = sides.collect();
    let mut missing = Vec::new();
    for vertex in &features.vertices {
        match at.get(&vertex.at) {
            Some(&found) if tin.vertices[found as usize].height == vertex.height => {}
            found => missing.push(format!("{vertex:?}: {found:?}")),
        }
    }
    for ends in &features.edges {
        let [a, b] = ends.map(|v| features.vertices[v as usize].at);
        let pair = |at: LatticePoint| (at.row, at.col);
        let on_it = at.keys().filter(|p| lies_within(pair(**p), [pair(a), pair(b)]));
        let mut chain: Vec<LatticePoint> = on_it.copied().chain([a, b]).collect();
        chain.sort_unstable();
        let strays = chain.iter().any(|&p| p != a && p != b && !given(p));
        let broken = chain.windows(2).any(|pair| {
            let [from, to] = [at.get(&pair[0]), at.get(&pair[1])];
            !matches!((from, to), (Some(&from), Some(&to)) if edges.contains(&(from, to)))
        });
        if strays || broken {
            missing.push(format!("edge {a:?} {b:?}: {chain:?}"));
        }
    }
    missing
}
