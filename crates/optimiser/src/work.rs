//! What the steps of an optimisation share: the mesh, its account, and what each kind of change keeps between calls.

use crate::account::Account;
use crate::exchange::{Exchange, Terms, Tools};
use crate::flips::flip_all;
use crate::insertion::Insertion;
use crate::queue::Queue;
use crate::removal::Removal;
use crate::sweep::Mover;
use crate::task::Task;
use crate::thin::{Shears, Until, thin};
use crate::tile_mesh::{Star, TileMesh};

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

/// Everything the steps work with.
pub(crate) struct Work<'a, 'g> {
    pub sheet: TileMesh<'g>,
    pub account: Account,
    pub task: &'a Task,
    pub mover: Mover,
    pub removal: Removal,
    pub insertion: Insertion,
    /// Squares that the least useful vertex of the last exchange explains.
    pub cheapest: Option<f64>,
}

impl Work<'_, '_> {
    /// Every step leaves a mesh whose links agree and whose triangles all face up.
    pub fn check(&self) {
        debug_assert_eq!(self.sheet.fault(), None);
    }

    /// Thins to the budget and a share more; to the limits of load modules and windows from a tenth over on.
    pub fn thin(&mut self, share: f64) {
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

    pub fn thin_until(&mut self, until: Until) {
        let shears = Shears { removal: &mut self.removal, mover: &mut self.mover, largest: None };
        thin(&mut self.sheet, &mut self.account, until, shears);
    }

    /// Rounds of flips, moves and exchange.
    pub fn exchange(&mut self, rounds: usize) {
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

    pub fn exchange_once(&mut self, exchange: &mut Exchange, terms: Terms, most: usize) -> usize {
        let mut tools = Tools { removal: &mut self.removal, insertion: &mut self.insertion };
        exchange.round(&mut self.sheet, &mut self.account, terms, most, &mut tools)
    }

    /// Where limits have refused a vertex that is worth many others, one of these goes for it.
    pub fn relieve(&mut self) {
        let least = RELIEVED_FROM * self.sheet.squares() / self.sheet.triangle_count as f64;
        let mut tools = Tools { removal: &mut self.removal, insertion: &mut self.insertion };
        Exchange::default().relieve(&mut self.sheet, &mut self.account, least, &mut tools);
    }

    /// Inserts where it gains most while there is room.
    pub fn fill_up(&mut self) {
        if self.account.dearest() <= self.account.left() && self.task.rms_quanta.is_none() {
            self.sheet.stir_all();
            self.exchange_once(&mut Exchange::default(), Terms::OnlyInsert, usize::MAX);
        }
    }

    /// Inserts into the triangle of largest squares while there is room: an order that costs a seventh of that by true
    /// gains, since nothing is judged before its turn.
    pub fn fill_by_squares(&mut self) {
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
    pub fn cycle(&mut self) {
        self.account.lend(CYCLE_SHARE);
        self.fill_up();
        self.account.lend(0.0);
        self.sheet.stir_all();
        flip_all(&mut self.sheet);
        self.mover.sweep_and_flip(&mut self.sheet, 1);
        self.thin(0.0);
        self.mover.sweep_and_flip(&mut self.sheet, 2);
    }
}
