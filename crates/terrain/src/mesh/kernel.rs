//! The array mesh: one 32-byte record per triangle, posts inserted by cavity.

use crate::PostRect;
use crate::geometry::LocalPost;

/// An edge as `triangle * 4 + index of its first corner`.
pub type EdgeRef = u32;

/// The twin of an edge on the border of the tile.
pub(crate) const NO_TWIN: EdgeRef = u32::MAX;

/// One triangle. A post is inserted by rewriting triangles whose first corner is then that post, so
/// (triangle, first corner) names one state of a record and serves as its version.
#[derive(Clone, Copy, Debug)]
#[repr(align(32))]
pub struct Triangle {
    /// Corners, counter-clockwise.
    pub corners: [LocalPost; 3],
    /// For each edge (corner i to corner i + 1) the same edge seen from the other side.
    pub twins: [EdgeRef; 3],
    /// Left to the caller: what the triangle is worth.
    pub key: u64,
}

/// A triangulation of all posts of a rectangular tile's corners and of every post inserted since.
///
/// Invariant: constrained Delaunay with canonical ties for the posts it holds.
#[derive(Clone, Debug)]
pub struct Mesh {
    triangles: Vec<Triangle>,
    lines: Lines,
    ring: Vec<RingEdge>,
    slots: Vec<u32>,
    stack: Vec<EdgeRef>,
}

/// One edge of the boundary of a cavity, and what lies beyond it.
#[derive(Clone, Copy, Debug)]
struct RingEdge {
    from: LocalPost,
    to: LocalPost,
    twin: EdgeRef,
}

#[inline(always)]
fn following(index: u32) -> u32 {
    if index == 2 { 0 } else { index + 1 }
}

impl Mesh {
    /// The mesh of a tile without inner posts: two triangles, or two for each square between lines.
    ///
    /// Diagonals run from south-west to north-east, which is what the canonical rule makes of a grid.
    ///
    /// # Panics
    /// When lines do not divide the tile evenly.
    pub fn new(tile: PostRect, lines: Lines) -> Self {
        let (rows, cols) = (tile.cells_high() as i32, tile.cells_wide() as i32);
        match lines.step() {
            Some(step) => {
                assert!(rows % step == 0 && cols % step == 0, "a tile is a whole number of load modules");
                Self::grid(rows / step, cols / step, step, step, lines)
            }
            None => Self::grid(1, 1, rows, cols, lines),
        }
    }

    /// The mesh of a tile with a vertex every `step` posts, its edges free to move (clip mode's start).
    ///
    /// # Panics
    /// When `step` does not divide the tile evenly.
    pub fn with_corners_every(tile: PostRect, step: i32) -> Self {
        Self { lines: Lines::none(), ..Self::new(tile, Lines::every(step)) }
    }

    fn grid(rows: i32, cols: i32, high: i32, wide: i32, lines: Lines) -> Self {
        let mut triangles = Vec::with_capacity(2 * (rows * cols) as usize);
        let edge = |row: i32, col: i32, half: i32, index: u32| -> EdgeRef {
            if row < 0 || col < 0 || rows <= row || cols <= col {
                return NO_TWIN;
            }
            ((row * cols + col) * 2 + half) as u32 * 4 + index
        };
        for row in 0..rows {
            for col in 0..cols {
                let post = |r: i32, c: i32| LocalPost::new((row + r) * high, (col + c) * wide);
                let (sw, se, ne, nw) = (post(0, 0), post(0, 1), post(1, 1), post(1, 0));
                let south_east = [edge(row - 1, col, 1, 1), edge(row, col + 1, 1, 2), edge(row, col, 1, 0)];
                let north_west = [edge(row, col, 0, 2), edge(row + 1, col, 0, 0), edge(row, col - 1, 0, 1)];
                triangles.push(Triangle { corners: [sw, se, ne], twins: south_east, key: 0 });
                triangles.push(Triangle { corners: [sw, ne, nw], twins: north_west, key: 0 });
            }
        }
        Self { triangles, lines, ring: Vec::new(), slots: Vec::new(), stack: Vec::new() }
    }

    /// All triangles.
    #[inline(always)]
    pub fn triangles(&self) -> &[Triangle] {
        &self.triangles
    }

    /// Makes room for `posts` more posts.
    pub fn reserve(&mut self, posts: usize) {
        self.triangles.reserve(2 * posts);
    }

    /// Sets what a triangle is worth.
    #[inline(always)]
    pub fn set_key(&mut self, triangle: u32, key: u64) {
        self.triangles[triangle as usize].key = key;
    }

    /// A triangle whose closure holds `post`, found by walking from `hint`.
    pub fn triangle_at(&self, post: LocalPost, hint: u32) -> u32 {
        let mut triangle = hint;
        // A straight walk in a Delaunay mesh does not cycle; in a constrained one, turning over every edge
        // that separates still ends, since each step comes closer across convex squares.
        for _ in 0..=2 * self.triangles.len() {
            let record = &self.triangles[triangle as usize];
            let separates = |i: usize| LocalPost::orient(record.corners[i], record.corners[(i + 1) % 3], post) < 0;
            match (0..3).find(|&i| separates(i)) {
                None => return triangle,
                Some(i) => {
                    let twin = record.twins[i];
                    assert!(twin != NO_TWIN, "post {post:?} lies outside the mesh");
                    triangle = twin >> 2;
                }
            }
        }
        unreachable!("the walk to {post:?} does not end: the mesh is broken")
    }

    /// Triangles written by the last insertion.
    #[inline(always)]
    pub fn star(&self) -> &[u32] {
        &self.slots
    }

    /// Inserts `post`, which lies in the closure of `triangle` and is no vertex yet. Returns the triangles
    /// of its star, which are exactly those written; their first corner is `post`.
    ///
    /// The cavity is found depth-first over edges in counter-clockwise order, so its boundary ring comes
    /// out directly; each new triangle is written once.
    #[inline(always)]
    pub fn insert(&mut self, post: LocalPost, triangle: u32) -> &[u32] {
        let gap = self.find_cavity(post, triangle);
        let edges = self.ring.len();
        if let Some(gap) = gap {
            self.ring.rotate_left(gap % edges);
        }
        let freed = self.slots.len();
        let fresh = self.triangles.len() as u32;
        self.slots.extend((freed..edges).map(|i| fresh + (i - freed) as u32));
        self.triangles.resize(self.triangles.len() + edges - freed, self.triangles[triangle as usize]);
        let closed = gap.is_none();
        for i in 0..edges {
            let RingEdge { from, to, twin } = self.ring[i];
            let slot = self.slots[i];
            let before = match i {
                0 if closed => self.slots[edges - 1] * 4 + 2,
                0 => NO_TWIN,
                _ => self.slots[i - 1] * 4 + 2,
            };
            let after = match i + 1 {
                next if next < edges => self.slots[next] * 4,
                _ if closed => self.slots[0] * 4,
                _ => NO_TWIN,
            };
            if twin != NO_TWIN {
                self.triangles[(twin >> 2) as usize].twins[(twin & 3) as usize] = slot * 4 + 1;
            }
            self.triangles[slot as usize] =
                Triangle { corners: [post, from, to], twins: [before, twin, after], key: 0 };
        }
        &self.slots
    }

    /// Fills `ring` and `slots`; the place in the ring where a border edge through `post` was left out.
    #[inline(always)]
    fn find_cavity(&mut self, post: LocalPost, triangle: u32) -> Option<usize> {
        self.ring.clear();
        self.slots.clear();
        self.stack.clear();
        self.slots.push(triangle);
        self.stack.extend([triangle * 4 + 2, triangle * 4 + 1, triangle * 4]);
        let mut gap = None;
        while let Some(edge) = self.stack.pop() {
            let record = &self.triangles[(edge >> 2) as usize];
            let index = edge & 3;
            let (from, to) = (record.corners[index as usize], record.corners[following(index) as usize]);
            let twin = record.twins[index as usize];
            if twin == NO_TWIN {
                if LocalPost::orient(from, to, post) == 0 {
                    gap = Some(self.ring.len());
                } else {
                    self.ring.push(RingEdge { from, to, twin });
                }
                continue;
            }
            let beyond = &self.triangles[(twin >> 2) as usize];
            let second = following(twin & 3);
            let third = following(second);
            // What lies beyond a line is not visible, unless the post stands on that very edge.
            let hidden = self.lines.constrain(from, to) && LocalPost::orient(from, to, post) != 0;
            if !hidden && LocalPost::in_circle(&beyond.corners, post, beyond.corners[third as usize]) {
                self.slots.push(twin >> 2);
                self.stack.push((twin & !3) + third);
                self.stack.push((twin & !3) + second);
            } else {
                self.ring.push(RingEdge { from, to, twin });
            }
        }
        gap
    }
}

/// Constraint lines of a working tile: every `step` posts from its south-west corner, or none.
///
/// An edge is constrained exactly when both its ends lie on the same line, so no flag is stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Lines {
    /// Posts between lines; `u32::MAX` where there are none.
    step: u32,
    /// `ceil(2^32 / step)`: a multiple of `step` times this wraps to less than `reciprocal`.
    reciprocal: u32,
}

impl Lines {
    /// Lines every `step` posts, from the tile's south-west corner.
    ///
    /// # Panics
    /// When `step` is below 2: every post would lie on a line.
    pub fn every(step: i32) -> Self {
        assert!(2 <= step, "load modules are at least two cells wide");
        Self { step: step as u32, reciprocal: (u32::MAX / step as u32) + 1 }
    }

    /// No lines: a mesh free to be Delaunay.
    pub fn none() -> Self {
        Self { step: u32::MAX, reciprocal: 0 }
    }

    /// Posts between lines, if there are any.
    pub(crate) fn step(&self) -> Option<i32> {
        (self.step != u32::MAX).then_some(self.step as i32)
    }

    #[inline(always)]
    fn holds(&self, at: i32) -> bool {
        // Divisibility by multiplication: exact for `at` below 2^16 (the packed range).
        (at as u32).wrapping_mul(self.reciprocal) < self.reciprocal
    }

    /// Whether `post` lies on a line of posts running east.
    #[inline(always)]
    pub(crate) fn holds_row(&self, post: LocalPost) -> bool {
        self.holds(post.row())
    }

    /// Whether `post` lies on a line of posts running north.
    #[inline(always)]
    pub(crate) fn holds_col(&self, post: LocalPost) -> bool {
        self.holds(post.col())
    }

    /// Whether the edge `a`, `b` lies on a line.
    #[inline(always)]
    pub(crate) fn constrain(&self, a: LocalPost, b: LocalPost) -> bool {
        (a.row() == b.row() && self.holds_row(a)) || (a.col() == b.col() && self.holds_col(a))
    }
}

#[cfg(test)]
mod tests;
