//! The order of the steps.

use limits::Shortfall;
use terrain::{Dem, Importance, LATTICE_PER_POST, Lattice, LatticePoint, Refusal, StopReason, Tin};

use crate::account::Account;
use crate::exchange::{Exchange, Terms, Tools};
use crate::flips::flip_all;
use crate::hold::Hold;
use crate::insertion::Insertion;
use crate::parts::{Layout, NONE, Parts};
use crate::place::{PER_POST, Place, Shape};
use crate::queue::Queue;
use crate::recipe::Recipe;
use crate::removal::Removal;
use crate::sweep::{Mover, Steps};
use crate::task::Task;
use crate::thin::{Shears, Until, thin};
use crate::tile_mesh::{Star, TileMesh};
use crate::weave::weave;
use crate::weighted_heights::WeightedHeights;

/// A TIN made truer.
#[derive(Clone, Debug)]
pub struct Optimised {
    /// Its vertices in order of row and column, on the lattice.
    pub tin: Tin,
    /// Triangles spent on vertices that are not held.
    pub spent: u32,
    /// Posts that would have been worth more than some vertex of the tile, had a limit not stood in the way; `None`
    /// where the effort never asks what a vertex is worth.
    pub refused: Option<Vec<Refusal>>,
    /// Why it ended.
    pub stop: StopReason,
    /// Edges of features that cross others or lines and were left out, in 64ths of a post; none that are made as
    /// [`terrain::Features`] asks.
    pub left_out: Vec<[LatticePoint; 2]>,
    /// Limits that are exceeded because nothing is left that may go.
    pub short: Vec<Shortfall>,
}

/// Limits of load modules and windows are met once the whole is this share over its budget: earlier, too much would
/// go where ground is rough.
const LIMITS_FROM: f64 = 0.1;
/// One vertex in so many is exchanged in a round, at most.
const ROUND_SHARE: usize = 10;
/// Exchange ends with a round in which less than one vertex in so many was exchanged.
const IDLE_SHARE: usize = 1000;
/// Times the mean squares of a triangle above which a fast tile gives it a vertex in exchange for another: a lone post
/// of many metres that a full window has refused.
const RELIEVED_FROM: f64 = 25.0;
/// How far a cycle grows beyond the budget.
const CYCLE_SHARE: f64 = 0.2;

/// Makes a TIN truer within its budget.
///
/// A pure function of its arguments. The TIN covers the window; it may exceed the budget, see [`crate::overshoot`],
/// and is then thinned.
///
/// # Panics
/// When the TIN, the window and the mask do not cover the same posts.
pub fn optimise(dem: &Dem, importance: &Importance, start: &Tin, task: &Task) -> Optimised {
    work_on(dem, importance, start, task, |work| work.run())
}

/// Spends what the budget leaves on new vertices, each in the triangle that explains least, and leaves the rest of the
/// TIN alone but for the flips and heights around them: what a little more would buy, at least.
///
/// # Panics
/// As [`optimise`].
pub fn fill(dem: &Dem, importance: &Importance, start: &Tin, task: &Task) -> Optimised {
    work_on(dem, importance, start, task, |work| {
        work.fill_by_squares();
        work.sheet.round_heights();
    })
}

/// Puts features into a TIN and leaves the rest of it alone, but for what they displace and what is then over a limit.
///
/// # Panics
/// As [`optimise`].
pub fn weave_in(dem: &Dem, importance: &Importance, start: &Tin, task: &Task) -> Optimised {
    work_on(dem, importance, start, task, |work| {
        work.thin_to_goal();
        work.meet_limits();
        work.sheet.round_heights();
    })
}

fn work_on(dem: &Dem, importance: &Importance, start: &Tin, task: &Task, steps: impl Fn(&mut Work)) -> Optimised {
    assert_eq!(dem.rect(), start.rect, "the TIN covers the window");
    assert_eq!(dem.rect(), importance.rect(), "heights and weights cover the same posts");
    let mut ground = WeightedHeights::new(dem, importance, task.open, task.height_fit);
    let mut forbidden = task.forbidden.clone();
    forbidden.extend(task.features.barred_posts(dem.rect()));
    forbidden.sort_unstable();
    ground.forbid(forbidden);
    let mut held: Vec<Place> = task.held.iter().map(|&at| Place::of(at, dem.rect(), LATTICE_PER_POST)).collect();
    held.sort_unstable();
    // What lies on a side that is not open is another tile's, or a fixed outer border of the area.
    let hold = |at: Place| {
        if ground.is_on_closed_side(at) || held.binary_search(&at).is_ok() {
            Hold::GIVEN
        } else {
            ground.height_hold(at)
        }
    };
    let layout = Layout { line_step: task.line_step.map(|posts| posts * PER_POST), hold: &hold };
    let grown = Parts::of(&ground, start, &layout);
    let has_features = !task.features.is_empty();
    let (parts, left_out) = match has_features {
        true => weave(&ground, grown, &task.features, start.rect, &layout),
        false => (grown, Vec::new()),
    };
    let sheet = TileMesh::new(&ground, parts, layout.line_step, has_features);
    let account = Account::new(&task.budget, &sheet);
    let mut work = Work {
        sheet,
        account,
        task,
        mover: Mover::new(Steps { inner: 1, pattern: false }),
        removal: Removal::default(),
        insertion: Insertion::default(),
        cheapest: None,
    };
    steps(&mut work);
    let (spent, stop, refused, short) = (work.account.spent(), work.stop(), work.refusals(), work.account.short());
    let steps_per_post = start.steps_per_post.max(task.features.steps_per_post);
    Optimised { tin: work.sheet.into_tin(start.rect, steps_per_post), spent, refused, stop, left_out, short }
}

/// Everything the steps work with.
struct Work<'a, 'g> {
    sheet: TileMesh<'g>,
    account: Account,
    task: &'a Task,
    mover: Mover,
    removal: Removal,
    insertion: Insertion,
    /// Squares that the least useful vertex of the last exchange explains.
    cheapest: Option<f64>,
}

impl Work<'_, '_> {
    /// Measured: flips first, or the sweep moves vertices of a mesh that no flip has adapted yet; thinning between
    /// sweeps, because a vertex is worth what it is worth once its neighbours stand well.
    fn run(&mut self) {
        let recipe = Recipe::of(self.task.effort);
        if recipe.stages.is_empty() {
            // Moved on the final lattice from the start, nothing has to be snapped: a third sweep costs less and gains
            // more.
            self.mover.steps.inner = self.final_step();
        }
        self.check();
        flip_all(&mut self.sheet);
        self.check();
        for stage in recipe.stages {
            self.mover.sweep_and_flip(&mut self.sheet, 1);
            self.check();
            self.thin(stage - 1.0);
            self.check();
        }
        self.thin_to_goal();
        self.mover.sweep_and_flip(&mut self.sheet, recipe.sweeps);
        if recipe.rounds == 0 {
            self.relieve();
        }
        self.exchange(recipe.rounds);
        for _ in 0..recipe.cycles {
            self.cycle();
        }
        self.check();
        self.thin_to_goal();
        self.meet_limits();
        self.snap();
        self.check();
        self.mover.steps.pattern = true;
        self.mover.sweep_and_flip(&mut self.sheet, recipe.last_sweeps);
        self.reach_goal();
        self.sheet.round_heights();
        self.meet_largest();
    }

    /// Every step leaves a mesh whose links agree and whose triangles all face up.
    fn check(&self) {
        debug_assert_eq!(self.sheet.fault(), None);
    }

    /// Thins to the budget and a share more; to the limits of load modules and windows from a tenth over on.
    fn thin(&mut self, share: f64) {
        if self.account.is_any_over() {
            self.account.lend(share.max(LIMITS_FROM));
            self.thin_until(Until::Afforded);
            if share <= LIMITS_FROM {
                self.thin_until(Until::LimitsMet);
            }
        }
        self.account.lend(share);
        self.thin_until(Until::Afforded);
        self.account.lend(0.0);
        self.sheet.renumber();
    }

    fn thin_until(&mut self, until: Until) {
        let shears = Shears { removal: &mut self.removal, mover: &mut self.mover, largest: None };
        thin(&mut self.sheet, &mut self.account, until, shears);
    }

    /// Rounds of flips, moves and exchange.
    fn exchange(&mut self, rounds: usize) {
        let mut exchange = Exchange::default();
        self.sheet.stir_all();
        for _ in 0..rounds {
            flip_all(&mut self.sheet);
            self.mover.sweep(&mut self.sheet, true);
            self.mover.sweep(&mut self.sheet, true);
            flip_all(&mut self.sheet);
            let most = self.sheet.vertex_count / ROUND_SHARE;
            if self.exchange_once(&mut exchange, Terms::OneForOne, most) <= self.sheet.vertex_count / IDLE_SHARE {
                break;
            }
        }
        // Without a round nobody knows what a vertex is worth.
        self.cheapest = (0 < rounds).then(|| exchange.cheapest().unwrap_or(0.0));
    }

    fn exchange_once(&mut self, exchange: &mut Exchange, terms: Terms, most: usize) -> usize {
        let mut tools = Tools { removal: &mut self.removal, insertion: &mut self.insertion };
        exchange.round(&mut self.sheet, &mut self.account, terms, most, &mut tools)
    }

    /// Where limits have refused a vertex that is worth many others, one of these goes for it.
    fn relieve(&mut self) {
        let least = RELIEVED_FROM * self.sheet.squares() / self.sheet.triangle_count as f64;
        let mut tools = Tools { removal: &mut self.removal, insertion: &mut self.insertion };
        Exchange::default().relieve(&mut self.sheet, &mut self.account, least, &mut tools);
    }

    /// Inserts where it gains most while there is room.
    fn fill_up(&mut self) {
        if self.account.dearest() <= self.account.left() && self.task.rms_quanta.is_none() {
            self.sheet.stir_all();
            self.exchange_once(&mut Exchange::default(), Terms::OnlyInsert, usize::MAX);
        }
    }

    /// Inserts into the triangle of largest squares while there is room: an order that costs a seventh of that by true
    /// gains, since nothing is judged before its turn.
    fn fill_by_squares(&mut self) {
        let mut queue = Queue::default();
        let squares = |sheet: &TileMesh, triangle: u32| sheet.triangles[triangle as usize].squares;
        (0..self.sheet.triangles.len() as u32)
            .for_each(|triangle| queue.enter(triangle, squares(&self.sheet, triangle)));
        let mut star = Star::default();
        while self.account.dearest() <= self.account.left() {
            let Some((triangle, _)) = queue.pop() else { return };
            let Some(found) = self.insertion.find(&mut self.sheet, triangle) else { continue };
            let guest = self.sheet.vertices[found.vertex as usize];
            if found.gain <= 0.0 || !self.account.permits(&guest) {
                self.sheet.drop_vertex(found.vertex);
                continue;
            }
            self.account.charge(&guest);
            self.insertion.patch.old.iter().for_each(|&old| queue.cancel(old));
            self.sheet.apply(&mut self.insertion.patch);
            self.sheet.star(found.vertex, &mut star);
            star.triangles().for_each(|triangle| queue.enter(triangle, squares(&self.sheet, triangle)));
        }
    }

    /// Grows beyond the budget by true gains and thins again: out of one local optimum and into a better one.
    fn cycle(&mut self) {
        self.account.lend(CYCLE_SHARE);
        self.fill_up();
        self.account.lend(0.0);
        self.sheet.stir_all();
        flip_all(&mut self.sheet);
        self.mover.sweep_and_flip(&mut self.sheet, 1);
        self.thin(0.0);
        self.mover.sweep_and_flip(&mut self.sheet, 2);
    }

    /// The weighted sum of squares at which the RMS residual should be good enough, if there is such a goal: plain and
    /// weighted sums are taken to stay in proportion.
    fn goal(&self) -> Option<f64> {
        let rms = self.task.rms_quanta?;
        let (squares, plain) = (self.sheet.squares(), self.sheet.plain_squares());
        let posts = self.sheet.ground.post_count() as f64;
        Some(if 0.0 < plain { rms * rms * posts * (squares / plain) } else { 0.0 })
    }

    fn thin_to_goal(&mut self) {
        if let Some(goal) = self.goal() {
            self.thin_until(Until::Squares(goal));
        }
    }

    /// Inserts until the RMS residual is good enough, if it is not.
    fn reach_goal(&mut self) {
        const AT_ONCE: usize = 16;
        let mut exchange = Exchange::default();
        self.sheet.stir_all();
        while self.goal().is_some_and(|goal| goal < self.sheet.squares())
            && 0 < self.exchange_once(&mut exchange, Terms::OnlyInsert, AT_ONCE)
        {}
    }

    /// Inserts where a residual is larger than it may be, and makes room for that where it can be spared.
    fn meet_largest(&mut self) {
        const ROUNDS: usize = 20;
        let Some(largest) = self.task.largest_quanta else { return };
        for _ in 0..ROUNDS {
            let above = self.above(largest);
            if above.is_empty() {
                return;
            }
            self.account.keep_back(self.account.dearest() * above.len() as i64);
            let shears = Shears { removal: &mut self.removal, mover: &mut self.mover, largest: Some(largest) };
            thin(&mut self.sheet, &mut self.account, Until::Afforded, shears);
            self.account.keep_back(0);
            for (triangle, corners) in above {
                if self.sheet.triangles[triangle as usize].corners == corners {
                    self.insert_worst(triangle);
                }
            }
            self.sheet.round_heights();
        }
    }

    /// Triangles with a weighted residual above `largest`, the worst first, and their corners.
    fn above(&self, largest: f64) -> Vec<(u32, [u32; 3])> {
        let mut above = Vec::new();
        for (triangle, record) in
            self.sheet.triangles.iter().enumerate().filter(|(_, record)| record.corners[0] != NONE)
        {
            if let Some((residual, _)) = self.sheet.worst(record.corners)
                && largest < residual
            {
                above.push((residual, triangle as u32, record.corners));
            }
        }
        above.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        above.into_iter().map(|(_, triangle, corners)| (triangle, corners)).collect()
    }

    /// Inserts at the worst post of a triangle; where there is no room for a vertex, moves the nearest one there.
    fn insert_worst(&mut self, triangle: u32) {
        let corners = self.sheet.triangles[triangle as usize].corners;
        let Some((_, at)) = self.sheet.worst(corners) else { return };
        let Some(found) = self.insertion.find(&mut self.sheet, triangle) else {
            let away = |corner: &u32| self.sheet.at(*corner).squared_distance(at);
            let mut nearest = corners;
            nearest.sort_unstable_by_key(away);
            let _ = nearest.into_iter().any(|corner| self.mover.put(&mut self.sheet, corner, at));
            return;
        };
        let guest = self.sheet.vertices[found.vertex as usize];
        if self.account.permits(&guest) {
            self.account.charge(&guest);
            // Fitted heights would lift residuals elsewhere; as it stands, the post is met exactly.
            self.insertion.patch.refit.clear();
            self.insertion.patch.rise.clear();
            self.sheet.apply(&mut self.insertion.patch);
        } else {
            self.sheet.drop_vertex(found.vertex);
        }
    }

    /// The step of the final lattice.
    fn final_step(&self) -> i32 {
        match self.task.lattice {
            Lattice::Eighth => PER_POST / LATTICE_PER_POST,
            Lattice::Post => PER_POST,
        }
    }

    /// Puts every vertex on the final lattice; those without a place there go, and what they cost is spent again.
    fn snap(&mut self) {
        self.mover.steps.inner = self.final_step();
        let all = 0..self.sheet.vertices.len() as u32;
        let mut homeless: Vec<u32> = all.filter(|&vertex| !self.has_place(vertex, Shape::Sound)).collect();
        // Once its neighbours stand on the lattice, a vertex finds a place or can go; a place between triangles of any
        // shape comes next, then room made by a neighbour that goes; only features leave less than that.
        while !homeless.is_empty() {
            homeless.retain(|&vertex| !self.has_place(vertex, Shape::Sound) && !self.take_out(vertex));
            homeless.retain(|&vertex| !self.has_place(vertex, Shape::Upright) && !self.take_out(vertex));
            let has_room = homeless.iter().any(|&vertex| self.make_room(vertex));
            if !has_room && !homeless.iter().any(|&vertex| self.force_out(vertex)) {
                break;
            }
        }
        assert!(homeless.is_empty(), "{} vertices have no place on the lattice and cannot go", homeless.len());
        self.fill_up();
    }

    /// Whether a vertex stands on the final lattice now, or is gone.
    fn has_place(&mut self, vertex: u32, shape: Shape) -> bool {
        !self.sheet.is_vertex(vertex) || self.mover.snap(&mut self.sheet, vertex, shape)
    }

    /// Takes out one of the vertices around another, if one can go.
    fn make_room(&mut self, vertex: u32) -> bool {
        let mut star = Star::default();
        self.sheet.star(vertex, &mut star);
        star.ring.iter().any(|&beside| self.take_out(beside))
    }

    /// Takes a vertex out, if that leaves a valid mesh.
    fn take_out(&mut self, vertex: u32) -> bool {
        let can_go = self.removal.find(&self.sheet, vertex).is_some();
        can_go && self.let_go(vertex)
    }

    /// Takes a vertex out whatever the triangles look like that fill its place.
    fn force_out(&mut self, vertex: u32) -> bool {
        self.removal.find_by_force(&self.sheet, vertex) && self.let_go(vertex)
    }

    /// Takes a vertex out as the removal has found it.
    fn let_go(&mut self, vertex: u32) -> bool {
        self.account.refund(&self.sheet.vertices[vertex as usize]);
        self.sheet.apply(&mut self.removal.patch);
        self.sheet.drop_vertex(vertex);
        true
    }

    /// Where features stand so close together that no sound triangle fills the place of a vertex, thinning leaves it:
    /// such vertices go all the same until every limit is met.
    fn meet_limits(&mut self) {
        if !self.sheet.has_features {
            return;
        }
        for vertex in 0..self.sheet.vertices.len() as u32 {
            let record = self.sheet.vertices[vertex as usize];
            let is_over = self.account.left() < 0 || self.account.relieves(&record);
            if is_over && self.sheet.is_vertex(vertex) {
                self.force_out(vertex);
            }
        }
    }

    fn stop(&self) -> StopReason {
        if self.goal().is_some_and(|goal| self.sheet.squares() <= goal) {
            StopReason::RmsReached
        } else if self.account.left() < self.account.dearest() {
            StopReason::BudgetSpent
        } else {
            StopReason::Exhausted
        }
    }

    /// The posts that limits keep out, largest residual first.
    fn refusals(&mut self) -> Option<Vec<Refusal>> {
        let cheapest = self.cheapest?;
        let mut refused = Vec::new();
        for triangle in 0..self.sheet.triangles.len() as u32 {
            let corners = self.sheet.triangles[triangle as usize].corners;
            if !self.sheet.is_live(triangle) || self.account.refuses(middle(self.sheet.places(corners))).is_none() {
                continue;
            }
            let Some(found) = self.insertion.find(&mut self.sheet, triangle) else { continue };
            let at = self.sheet.at(found.vertex);
            self.sheet.drop_vertex(found.vertex);
            if cheapest < found.gain
                && let Some((module, by)) = self.account.refuses(at)
            {
                let residual = self.sheet.ground.residual(self.sheet.places(corners), self.sheet.heights(corners), at);
                refused.push(Refusal { post: self.sheet.ground.post_at(at), module, residual: residual as u32, by });
            }
        }
        refused.sort_by_key(|refusal| (std::cmp::Reverse(refusal.residual), refusal.post));
        Some(refused)
    }
}

/// A place inside a triangle that is not on a line.
fn middle([a, b, c]: [Place; 3]) -> Place {
    Place::new((a.x + b.x + c.x) / 3, (a.y + b.y + c.y) / 3)
}
