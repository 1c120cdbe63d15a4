//! The paper's passes: every post of exactly the largest weighted residual, thinned by proximity.
//!
//! A pass takes all triangles on top of the queue whose keys are equal; since every post lies in a closed
//! triangle and posts on shared edges have the same residual in both, that is the global re-scan of the
//! paper without scanning what did not change.

use fearless_simd::Simd;
use terrain::geometry::{LocalPost, LocalRect};
use terrain::{LastBatch, StopReason};

use crate::criterion::{Criterion, Largest};
use crate::growth::{Growth, RunningSquares};
use crate::queue::Queue;
use crate::task::{Proximity, Stop};

/// How passes choose.
pub(crate) struct Passes {
    pub proximity: Option<Proximity>,
    pub last_batch: LastBatch,
}

/// A post of the level now being worked off, in a triangle that is parked (key 0) meanwhile.
#[derive(Clone, Copy)]
struct Candidate {
    post: LocalPost,
    triangle: u32,
    version: LocalPost,
    /// Too near to a vertex. Vertices stay, so this does too.
    crowded: bool,
}

/// Who is near whom, when the job asks.
struct Crowding {
    vertices: NearVertices,
    /// Only what this pass has accepted: the second test, when all candidates were too near a vertex.
    pass: NearVertices,
}

/// State of the passes beside the growth itself.
struct Batch {
    queue: Queue<Largest>,
    near: Option<Crowding>,
    /// Candidates of value `level`, sorted by post.
    waiting: Vec<Candidate>,
    level: u64,
    dirty: Vec<u32>,
}

impl Passes {
    /// Runs passes from the `vertices` already in the mesh until `stop` or until nothing is left.
    #[inline(always)]
    pub fn run<S: Simd>(&self, growth: &mut Growth<S>, vertices: &[LocalPost], stop: &Stop) -> StopReason {
        growth.score_all(Largest);
        let near = self.proximity.map(|proximity| {
            let empty = || NearVertices::new(proximity, growth.ground.extent());
            let mut near = Crowding { vertices: empty(), pass: empty() };
            vertices.iter().for_each(|&post| near.vertices.add(post, growth.ground.height(post)));
            near
        });
        let mut batch = Batch { queue: Queue::new(Largest), near, waiting: Vec::new(), level: 0, dirty: Vec::new() };
        let mut squares = stop.rms_quanta.map(|rms| RunningSquares::new(growth, rms));
        loop {
            if growth.sequence.is_full(stop.points) || growth.gate.is_spent() {
                return StopReason::BudgetSpent;
            }
            if squares.as_ref().is_some_and(RunningSquares::reached) {
                return StopReason::RmsReached;
            }
            if !batch.gather(growth) {
                return StopReason::Exhausted;
            }
            if stop.value.is_some_and(|value| batch.level <= value) {
                return StopReason::ResidualReached;
            }
            let mut accepted = self.accept(growth, &mut batch);
            if self.last_batch == LastBatch::Truncate
                && let Some(points) = stop.points
            {
                accepted.truncate(points - growth.sequence.posts.len());
            }
            batch.insert(growth, &accepted, squares.as_mut());
        }
    }

    /// The candidates of this pass that may go in, in row order; at least one.
    fn accept<S: Simd>(&self, growth: &Growth<S>, batch: &mut Batch) -> Vec<Candidate> {
        let mut accepted: Vec<Candidate> = Vec::new();
        let Some(near) = &mut batch.near else {
            accepted.extend_from_slice(&batch.waiting);
            accepted.dedup_by_key(|candidate| candidate.post);
            return accepted;
        };
        for candidate in &mut batch.waiting {
            let height = growth.ground.height(candidate.post);
            if candidate.crowded || accepted.last().is_some_and(|last| last.post == candidate.post) {
                continue;
            }
            if near.vertices.crowd(candidate.post, height) {
                candidate.crowded = true;
            } else {
                near.vertices.add(candidate.post, height);
                accepted.push(*candidate);
            }
        }
        if !accepted.is_empty() {
            return accepted;
        }
        near.pass.clear();
        for candidate in &batch.waiting {
            let height = growth.ground.height(candidate.post);
            if !near.pass.crowd(candidate.post, height) {
                near.pass.add(candidate.post, height);
                near.vertices.add(candidate.post, height);
                accepted.push(*candidate);
            }
        }
        accepted
    }
}

impl Batch {
    /// Fills `waiting` with all permitted posts of the largest value. False when nothing is left.
    #[inline(always)]
    fn gather<S: Simd>(&mut self, growth: &mut Growth<S>) -> bool {
        self.waiting.retain(|candidate| growth.corners(candidate.triangle)[0] == candidate.version);
        if self.waiting.iter().any(|candidate| growth.gate.refuses(candidate.post).is_some()) {
            self.release(growth);
        }
        loop {
            let largest = self.queue.largest(&growth.mesh);
            if self.waiting.is_empty() {
                let Some(largest) = largest else { return false };
                self.level = largest;
            } else if largest.is_some_and(|largest| self.level < largest) {
                self.release(growth);
                continue;
            }
            while self.queue.largest(&growth.mesh) == Some(self.level) {
                let top = self.queue.pop(&growth.mesh).expect("a queue with a largest key has a top");
                self.gather_from(growth, top.triangle);
            }
            self.waiting.sort_by_key(|candidate| candidate.post);
            if !self.waiting.is_empty() {
                return true;
            }
        }
    }

    /// Parks a triangle and lists its permitted candidates; one without any settles for less.
    #[inline(always)]
    fn gather_from<S: Simd>(&mut self, growth: &mut Growth<S>, triangle: u32) {
        let corners = growth.corners(triangle);
        let before = self.waiting.len();
        let mut refused = None;
        growth.ground.all_of_value(corners, self.level, |post| match growth.gate.refuses(post) {
            None => self.waiting.push(Candidate { post, triangle, version: corners[0], crowded: false }),
            Some(by) => refused = refused.or(Some((post, by))),
        });
        if let Some((post, by)) = refused {
            growth.sequence.refuse(growth.tile, post, growth.ground.residual_at(corners, post), by);
        }
        if before < self.waiting.len() {
            growth.mesh.set_key(triangle, 0);
            return;
        }
        let permitted = growth.ground.worst_where(corners, |post| growth.gate.refuses(post).is_none());
        growth.mesh.set_key(triangle, permitted.map_or(0, |(value, _)| value));
        self.queue.push(&growth.mesh, triangle);
    }

    /// Puts the parked triangles back into the queue.
    fn release<S: Simd>(&mut self, growth: &mut Growth<S>) {
        for candidate in std::mem::take(&mut self.waiting) {
            if growth.mesh.triangles()[candidate.triangle as usize].key == 0 {
                growth.mesh.set_key(candidate.triangle, self.level);
                self.queue.push(&growth.mesh, candidate.triangle);
            }
        }
    }

    /// Inserts the accepted posts, then scores what changed once.
    #[inline(always)]
    fn insert<S: Simd>(
        &mut self,
        growth: &mut Growth<S>,
        accepted: &[Candidate],
        mut squares: Option<&mut RunningSquares>,
    ) {
        self.dirty.clear();
        for candidate in accepted {
            if growth.gate.is_spent() {
                break;
            }
            if growth.gate.refuses(candidate.post).is_some() {
                continue;
            }
            let triangle = growth.mesh.triangle_at(candidate.post, candidate.triangle);
            growth.select(candidate.post, triangle);
            self.dirty.extend_from_slice(growth.mesh.insert(candidate.post, triangle));
            if let Some(squares) = &mut squares {
                squares.update(&growth.ground, &growth.mesh);
            }
        }
        for &triangle in &self.dirty {
            // Rewritten twice in one pass: scored once.
            if growth.mesh.triangles()[triangle as usize].key == 0 {
                let key = Largest.key(&growth.ground, growth.corners(triangle));
                growth.mesh.set_key(triangle, key);
                self.queue.push(&growth.mesh, triangle);
            }
        }
    }
}

/// Vertices by square cells as wide as the cylinder's radius.
struct NearVertices {
    proximity: Proximity,
    cell_posts: i32,
    cells_wide: usize,
    cells: Vec<Vec<(LocalPost, i32)>>,
    /// Cells that hold something, in the order in which they were first filled.
    filled: Vec<usize>,
}

impl NearVertices {
    /// No vertices yet.
    pub fn new(proximity: Proximity, extent: LocalRect) -> Self {
        let cell_posts = (proximity.posts.ceil() as i32).max(1);
        let cells_wide = (extent.east / cell_posts) as usize + 1;
        let cells_high = (extent.north / cell_posts) as usize + 1;
        Self { proximity, cell_posts, cells_wide, cells: vec![Vec::new(); cells_wide * cells_high], filled: Vec::new() }
    }

    fn cell(&self, post: LocalPost) -> (usize, usize) {
        ((post.row() / self.cell_posts) as usize, (post.col() / self.cell_posts) as usize)
    }

    /// Adds a vertex.
    pub fn add(&mut self, post: LocalPost, height: i32) {
        let (row, col) = self.cell(post);
        let index = row * self.cells_wide + col;
        if self.cells[index].is_empty() {
            self.filled.push(index);
        }
        self.cells[index].push((post, height));
    }

    /// Forgets all vertices.
    pub fn clear(&mut self) {
        for index in self.filled.drain(..) {
            self.cells[index].clear();
        }
    }

    /// Whether some vertex is near: within the radius and within the vertical reach, both inclusive.
    pub fn crowd(&self, post: LocalPost, height: i32) -> bool {
        let (row, col) = self.cell(post);
        let rows = self.cells.chunks(self.cells_wide).skip(row.saturating_sub(1)).take(row.min(1) + 2);
        rows.flat_map(|line| line[col.saturating_sub(1)..(col + 2).min(self.cells_wide)].iter().flatten())
            .any(|&(vertex, at)| is_near(self.proximity, (post, height), (vertex, at)))
    }
}

/// Whether two posts with heights lie in each other's cylinder.
pub(crate) fn is_near(proximity: Proximity, a: (LocalPost, i32), b: (LocalPost, i32)) -> bool {
    let (rows, cols) = (i64::from(a.0.row() - b.0.row()), i64::from(a.0.col() - b.0.col()));
    (rows * rows + cols * cols) as f64 <= proximity.posts * proximity.posts && a.1.abs_diff(b.1) <= proximity.quanta
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_bounds_of_the_cylinder_are_inside_it() {
        let proximity = Proximity { posts: 12.0, quanta: 2560 };
        let mut near = NearVertices::new(proximity, LocalRect { south: 0, west: 0, north: 99, east: 99 });
        near.add(LocalPost::new(40, 40), 1000);
        assert!(near.crowd(LocalPost::new(40, 52), 3560));
        assert!(!near.crowd(LocalPost::new(40, 53), 1000));
        assert!(!near.crowd(LocalPost::new(40, 52), 3561));
        assert!(near.crowd(LocalPost::new(28, 40), -1560));
        assert!(!near.crowd(LocalPost::new(32, 32 - 1), 1000));
    }

    #[test]
    fn the_cells_find_what_a_search_of_all_vertices_finds() {
        let proximity = Proximity { posts: 3.5, quanta: 10 };
        let extent = LocalRect { south: 0, west: 0, north: 24, east: 30 };
        let mut near = NearVertices::new(proximity, extent);
        let vertices: Vec<(LocalPost, i32)> =
            (0..12).map(|i| (LocalPost::new(i * 7 % 25, i * 11 % 31), i * 5 % 23)).collect();
        vertices.iter().for_each(|&(post, height)| near.add(post, height));
        for row in 0..25 {
            for col in 0..31 {
                let candidate = (LocalPost::new(row, col), 9);
                let slow = vertices.iter().any(|&vertex| is_near(proximity, candidate, vertex));
                assert_eq!(near.crowd(candidate.0, candidate.1), slow, "{row},{col}");
            }
        }
    }
}
