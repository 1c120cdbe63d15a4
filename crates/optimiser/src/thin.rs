//! Thinning: the vertices whose absence costs least go, until what is left fits.

use crate::account::Account;
use crate::patch::Patch;
use crate::queue::Queue;
use crate::removal::Removal;
use crate::sweep::Mover;
use crate::tile_mesh::TileMesh;

/// A vertex whose surroundings have changed and that became dearer by this part is put back and waits its turn again.
pub(crate) const DEARER: f64 = 0.02;
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
    /// What removing a vertex costs; its patch is then ready to be applied.
    fn find(self, removal: &mut Removal, sheet: &TileMesh, vertex: u32) -> Option<f64> {
        if self == Self::AsItIs {
            return removal.find_as_it_is(sheet, vertex);
        }
        let cost = removal.find(sheet, vertex);
        if self != Self::Fitted {
            removal.patch.refit.clear();
            removal.patch.rise.clear();
        }
        cost
    }
}

/// Removes vertices, the cheapest first. Gives what the last one cost.
pub(crate) fn thin(
    sheet: &mut TileMesh,
    account: &mut Account,
    until: Until,
    filling: Filling,
    (removal, mover): (&mut Removal, &mut Mover),
) -> Option<f64> {
    mover.aim(sheet.mean_squares());
    if is_done(account, until, sheet.squares()) {
        return None;
    }
    let mut queue = Queue::default();
    let mut is_stale = vec![false; sheet.vertices.len()];
    // What cannot go now may go once its surroundings have changed.
    let mut is_stuck = vec![false; sheet.vertices.len()];
    for vertex in 0..sheet.vertices.len() as u32 {
        match filling.find(removal, sheet, vertex) {
            Some(cost) => queue.enter(vertex, -cost),
            None => is_stuck[vertex as usize] = true,
        }
    }
    let (mut unstuck, mut last) = (Vec::new(), None);
    let mut squares = sheet.squares();
    while !is_done(account, until, squares) {
        let Some((vertex, worth)) = queue.pop() else { break };
        let record = sheet.vertices[vertex as usize];
        if matches!(until, Until::LimitsMet) && !account.relieves(&record) {
            continue;
        }
        let Some(cost) = filling.find(removal, sheet, vertex) else {
            is_stuck[vertex as usize] = true;
            continue;
        };
        let was_stale = std::mem::replace(&mut is_stale[vertex as usize], false);
        if was_stale && is_dearer(cost, -worth) {
            queue.enter(vertex, -cost);
            continue;
        }
        if matches!(until, Until::Squares(most) if most < squares + cost) {
            break;
        }
        if matches!(filling, Filling::Below(largest) if leaves_more_than(largest, sheet, &removal.patch)) {
            continue;
        }
        last = Some(cost);
        squares += cost;
        account.refund(&record);
        sheet.apply(&mut removal.patch);
        sheet.drop_vertex(vertex);
        for index in 0..removal.star.ring.len() {
            let other = removal.star.ring[index];
            if filling == Filling::Fitted {
                squares -= mover.relax(sheet, other);
            }
            is_stale[other as usize] = true;
            if std::mem::replace(&mut is_stuck[other as usize], false)
                && !sheet.vertices[other as usize].hold.is_fixed()
            {
                unstuck.push(other);
            }
        }
        for other in unstuck.drain(..) {
            match filling.find(removal, sheet, other) {
                Some(cost) => queue.enter(other, -cost),
                None => is_stuck[other as usize] = true,
            }
        }
    }
    last
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
