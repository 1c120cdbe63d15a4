//! Growing one post at a time: the top of the queue, again and again.

use fearless_simd::Simd;
use terrain::geometry::LocalPost;
use terrain::mesh::Mesh;
use terrain::{PostRect, StopReason};

use crate::criterion::Criterion;
use crate::queue::{Queue, Top};
use crate::sequence::{Sequence, Witness};
use crate::start::Gate;
use crate::task::{Stop, TileTask};
use crate::weighted_surface::WeightedSurface;

/// Everything a run changes.
pub(crate) struct Growth<'a, S: Simd> {
    pub tile: PostRect,
    pub ground: WeightedSurface<'a, S>,
    pub mesh: Mesh,
    pub gate: Gate,
    pub sequence: Sequence,
    /// Where no post may be selected.
    pub barred: Barred,
}

/// Posts that are no candidates although they lie among them, in ascending order.
pub(crate) struct Barred(Vec<LocalPost>);

impl Barred {
    /// Those of a task.
    pub fn of(task: &TileTask) -> Self {
        let mut posts: Vec<LocalPost> = task.barred.iter().map(|&post| LocalPost::of(post, task.rect)).collect();
        posts.sort_unstable();
        Self(posts)
    }

    #[inline(always)]
    pub fn holds(&self, post: LocalPost) -> bool {
        !self.0.is_empty() && self.0.binary_search(&post).is_ok()
    }
}

impl<S: Simd> Growth<'_, S> {
    /// Inserts posts by `criterion` until `stop` or until nothing is left.
    #[inline(always)]
    pub fn run<C: Criterion>(&mut self, criterion: C, stop: &Stop, witness: &mut dyn Witness) -> StopReason {
        let mut queue = Queue::new(criterion);
        self.score_all(criterion);
        let mut squares = stop.rms_quanta.map(|rms| RunningSquares::new(self, rms));
        if let Some(squares) = &squares {
            witness.squares(squares.sum);
        }
        let reason = loop {
            if self.sequence.is_full(stop.points) || self.gate.is_spent() {
                break StopReason::BudgetSpent;
            }
            if squares.as_ref().is_some_and(RunningSquares::reached) {
                break StopReason::RmsReached;
            }
            let Some(top) = queue.pop(&self.mesh) else { break StopReason::Exhausted };
            if stop.value.is_some_and(|value| criterion.gain(top.key) <= value as f64) {
                break StopReason::ResidualReached;
            }
            let Some(post) = self.located(criterion, &mut queue, top) else { continue };
            self.select(post, top.triangle);
            witness.selected(post, criterion.gain(top.key));
            self.insert(criterion, &mut queue, post, top.triangle);
            if let Some(squares) = &mut squares {
                squares.update(&self.ground, &self.mesh);
                witness.squares(squares.sum);
            }
        };
        if let Some(squares) = squares {
            witness.squares_left(squares.left(&self.mesh));
        }
        reason
    }

    /// Computes the key of every triangle.
    #[inline(always)]
    pub fn score_all<C: Criterion>(&mut self, criterion: C) {
        for triangle in 0..self.mesh.triangles().len() as u32 {
            let corners = self.corners(triangle);
            self.mesh.set_key(triangle, criterion.key(&self.ground, corners));
        }
    }

    #[inline(always)]
    pub fn corners(&self, triangle: u32) -> [LocalPost; 3] {
        self.mesh.triangles()[triangle as usize].corners
    }

    /// The post of the top triangle, once its turn has come among equal keys and no limit refuses it;
    /// otherwise the triangle is entered again where it now belongs.
    #[inline(always)]
    fn located<C: Criterion>(&mut self, criterion: C, queue: &mut Queue<C>, top: Top) -> Option<LocalPost> {
        let Some(post) = top.post else {
            let post = criterion.post(&self.ground, self.corners(top.triangle), top.key);
            queue.push_located(&self.mesh, top.triangle, post);
            return None;
        };
        let is_barred = self.barred.holds(post);
        let refused = self.gate.refuses(post);
        if !is_barred && refused.is_none() {
            return Some(post);
        }
        let corners = self.corners(top.triangle);
        if let Some(refused) = refused.filter(|_| !is_barred) {
            self.sequence.refuse(self.tile, post, self.ground.residual_at(corners, post), refused);
        }
        // Counters only grow, so what is refused now stays refused and the triangle settles for less.
        match self.ground.worst_where(corners, |post| !self.barred.holds(post) && self.gate.refuses(post).is_none()) {
            Some((value, post)) => {
                self.mesh.set_key(top.triangle, criterion.key_when_confined(top.key, value));
                queue.push_located(&self.mesh, top.triangle, post);
            }
            None => self.mesh.set_key(top.triangle, 0),
        }
        None
    }

    /// Books a post: limits, residual, sequence.
    #[inline(always)]
    pub fn select(&mut self, post: LocalPost, triangle: u32) {
        self.gate.charge(post);
        self.sequence.residuals.push(self.ground.residual_at(self.corners(triangle), post));
        self.sequence.posts.push(post);
    }

    #[inline(always)]
    fn insert<C: Criterion>(&mut self, criterion: C, queue: &mut Queue<C>, post: LocalPost, triangle: u32) {
        let star = self.mesh.insert(post, triangle).len();
        for index in 0..star {
            let triangle = self.mesh.star()[index];
            let key = criterion.key(&self.ground, self.corners(triangle));
            self.mesh.set_key(triangle, key);
            queue.push(&self.mesh, triangle);
        }
    }
}

/// The running sum of squared residuals over the whole tile; exact, since it sums whole numbers.
pub(crate) struct RunningSquares {
    of_triangle: Vec<f64>,
    sum: f64,
    goal: f64,
}

impl RunningSquares {
    #[inline(always)]
    pub fn new<S: Simd>(growth: &Growth<S>, rms_quanta: f64) -> Self {
        let squares = |record: &terrain::mesh::Triangle| growth.ground.plain_squares(record.corners);
        let of_triangle: Vec<f64> = growth.mesh.triangles().iter().map(squares).collect();
        let goal = rms_quanta * rms_quanta * growth.ground.post_count() as f64;
        Self { sum: of_triangle.iter().sum(), of_triangle, goal }
    }

    pub fn reached(&self) -> bool {
        self.sum <= self.goal
    }

    /// What of the sum lies in triangles without a post to choose.
    pub fn left(&self, mesh: &Mesh) -> f64 {
        let of_triangles = self.of_triangle.iter().zip(mesh.triangles());
        of_triangles.filter(|(_, triangle)| triangle.key == 0).map(|(squares, _)| squares).sum()
    }

    /// Accounts for the triangles the last insertion wrote.
    #[inline(always)]
    pub fn update<S: Simd>(&mut self, ground: &WeightedSurface<S>, mesh: &Mesh) {
        self.of_triangle.resize(mesh.triangles().len(), 0.0);
        for &triangle in mesh.star() {
            let squares = ground.plain_squares(mesh.triangles()[triangle as usize].corners);
            let before = std::mem::replace(&mut self.of_triangle[triangle as usize], squares);
            self.sum += squares - before;
        }
    }
}
