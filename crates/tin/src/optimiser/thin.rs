//! Thinning: the vertices whose absence costs least go, until what is left fits.

use crate::optimiser::account::Account;
use crate::optimiser::patch::Patch;
use crate::optimiser::queue::Queue;
use crate::optimiser::removal::Removal;
use crate::optimiser::sweep::Mover;
use crate::optimiser::tile_mesh::TileMesh;

/// A vertex whose surroundings have changed and that became dearer by this part is put back and waits its turn again.
pub(crate) const DEARER: f64 = 0.02;
/// Part of the cost of removing a vertex that is left once the heights around it are fitted, as a guess.
const FITTED_SHARE: f64 = 0.4;
/// Quanta squared by which a cost may rise without the vertex being put back.
const DEARER_QUANTA: f64 = 0.02;

/// Whether a cost rose so far that others may now be cheaper. Costs can be negative: fitting the heights around a
/// hole can gain more than the vertex was worth.
pub(crate) fn is_dearer(now: f64, before: f64) -> bool {
    before + DEARER * before.abs() + DEARER_QUANTA < now
}

/// Until when to thin.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Until {
    /// Until nothing is over the budget, loans included.
    Afforded,
    /// Until nothing is over its limit, only there.
    LimitsMet,
    /// While the sum of squares stays below.
    Squares(f64),
}

/// How holes are filled, and what else may change around them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Filling {
    /// Everything around a hole stays as it is: next to nothing is lost while far more vertices are there than will
    /// be in the end.
    AsItIs,
    /// Heights around a hole are fitted, and then its vertices move.
    Fitted,
    /// Everything around a hole stays, and none may leave a weighted residual above this many quanta.
    Below(f64),
}

impl Filling {
    /// What removing a vertex costs.
    fn cost(self, removal: &mut Removal, sheet: &TileMesh, vertex: u32) -> Option<f64> {
        if self == Self::AsItIs { removal.cost(sheet, vertex) } else { removal.find(sheet, vertex) }
    }

    /// What a cost says of that with heights fitted, as a guess for later; NaN where it says nothing.
    fn guess(self, cost: f64) -> f64 {
        match self {
            Self::Fitted => cost,
            Self::AsItIs if 0.0 < cost => FITTED_SHARE * cost,
            Self::AsItIs => cost,
            Self::Below(_) => f64::NAN,
        }
    }

    /// Makes the patch ready that takes out the vertex whose cost was asked last.
    fn make_ready(self, removal: &mut Removal) {
        if self != Self::Fitted {
            removal.make_ready();
        }
    }
}

/// What is known of a vertex that waits.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Known {
    /// What it costs.
    Cost,
    /// What it cost before its surroundings changed.
    StaleCost,
    /// That it cannot go; it may once its surroundings have changed.
    Stuck,
}

/// Vertices in the order in which they go, the cheapest first.
pub(crate) struct Thinning {
    filling: Filling,
    queue: Queue,
    known: Vec<Known>,
    /// Whether all vertices that may go have been entered.
    is_full: bool,
    /// What the last one cost that went.
    pub last: Option<f64>,
}

impl Thinning {
    pub fn by(filling: Filling) -> Self {
        Self { filling, queue: Queue::default(), known: Vec::new(), is_full: false, last: None }
    }

    /// Removes vertices; may be called again, as long as nothing else changes the mesh.
    pub fn run(
        &mut self,
        sheet: &mut TileMesh,
        account: &mut Account,
        until: Until,
        (removal, mover): (&mut Removal, &mut Mover),
    ) {
        if is_done(account, until, sheet.squares()) {
            return;
        }
        mover.aim(sheet.mean_squares());
        self.known.resize(sheet.vertices.len(), Known::Stuck);
        let all = 0..sheet.vertices.len() as u32;
        if matches!(until, Until::LimitsMet) {
            // Nothing comes to be over a limit while vertices go.
            let others = std::mem::take(&mut self.queue);
            for vertex in all {
                if account.relieves(&sheet.vertices[vertex as usize]) {
                    self.enter(sheet, account, removal, vertex);
                }
            }
            let gone = self.remove(sheet, account, until, (removal, mover));
            let left = std::mem::replace(&mut self.queue, others);
            gone.into_iter().for_each(|vertex| self.queue.cancel(vertex));
            left.into_items().for_each(|(vertex, worth)| self.queue.enter(vertex, worth));
        } else {
            if !std::mem::replace(&mut self.is_full, true) {
                all.for_each(|vertex| self.enter(sheet, account, removal, vertex));
            }
            self.remove(sheet, account, until, (removal, mover));
        }
    }

    /// Removes what is in the queue. Gives the vertices that went.
    fn remove(
        &mut self,
        sheet: &mut TileMesh,
        account: &mut Account,
        until: Until,
        (removal, mover): (&mut Removal, &mut Mover),
    ) -> Vec<u32> {
        let mut squares = sheet.squares();
        let mut gone = Vec::new();
        while !is_done(account, until, squares) {
            let Some((vertex, worth)) = self.queue.pop() else { break };
            let record = sheet.vertices[vertex as usize];
            if matches!(until, Until::LimitsMet) && !account.relieves(&record) {
                continue;
            }
            let known = self.known[vertex as usize];
            let Some(cost) = self.cost(sheet, removal, vertex) else { continue };
            let rate = account.rate(&record, cost);
            if known == Known::StaleCost && is_dearer(rate, -worth) {
                self.queue.enter(vertex, -rate);
                continue;
            }
            if matches!(until, Until::Squares(most) if most < squares + cost) {
                break;
            }
            self.filling.make_ready(removal);
            if matches!(self.filling, Filling::Below(largest) if leaves_more_than(largest, sheet, &removal.patch)) {
                continue;
            }
            self.last = Some(rate);
            squares += cost;
            account.refund(&record);
            sheet.apply(&mut removal.patch);
            sheet.drop_vertex(vertex);
            let ring = std::mem::take(&mut removal.star.ring);
            if self.filling == Filling::Fitted {
                ring.iter().for_each(|&other| squares -= mover.relax(sheet, other));
            }
            ring.iter().for_each(|&other| self.unsettle(sheet, account, removal, other));
            removal.star.ring = ring;
            gone.push(vertex);
        }
        gone
    }

    /// Enters a vertex by what it costs, or by what it cost when that was last asked: its turn will tell.
    fn enter(&mut self, sheet: &mut TileMesh, account: &Account, removal: &mut Removal, vertex: u32) {
        let record = sheet.vertices[vertex as usize];
        if self.filling == Filling::Fitted && !record.cost.is_nan() {
            self.queue.enter(vertex, -account.rate(&record, record.cost));
            self.known[vertex as usize] = Known::StaleCost;
        } else if let Some(cost) = self.cost(sheet, removal, vertex) {
            self.queue.enter(vertex, -account.rate(&record, cost));
        }
    }

    /// What removing a vertex costs; notes that it is known.
    fn cost(&mut self, sheet: &mut TileMesh, removal: &mut Removal, vertex: u32) -> Option<f64> {
        let cost = self.filling.cost(removal, sheet, vertex);
        self.known[vertex as usize] = if cost.is_some() { Known::Cost } else { Known::Stuck };
        sheet.vertices[vertex as usize].cost = cost.map_or(f64::NAN, |cost| self.filling.guess(cost));
        cost
    }

    /// The surroundings of a vertex have changed: what could not go now may.
    fn unsettle(&mut self, sheet: &mut TileMesh, account: &Account, removal: &mut Removal, vertex: u32) {
        match self.known[vertex as usize] {
            Known::Stuck => self.enter(sheet, account, removal, vertex),
            Known::Cost | Known::StaleCost => self.known[vertex as usize] = Known::StaleCost,
        }
    }
}

fn is_done(account: &Account, until: Until, squares: f64) -> bool {
    match until {
        Until::Afforded => 0 <= account.left(),
        Until::LimitsMet => !account.is_any_over(),
        Until::Squares(most) => most <= squares,
    }
}

/// Whether the triangles of a patch leave a larger weighted residual somewhere.
fn leaves_more_than(largest: f64, sheet: &TileMesh, patch: &Patch) -> bool {
    patch.new.iter().any(|&(corners, _)| sheet.worst(corners).is_some_and(|(residual, _)| largest < residual))
}
