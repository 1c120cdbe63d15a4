//! Thinning by true costs: what the squares rise by once the vertices around a hole have moved.
//!
//! Only doing it tells that cost, so vertices wait in the order of a guess, and one whose turn comes is taken out, its
//! ring is moved, and it is put back if that cost more than the next is guessed to.

use crate::optimiser::account::Account;
use crate::optimiser::queue::Queue;
use crate::optimiser::removal::Removal;
use crate::optimiser::sweep::Mover;
use crate::optimiser::thin::is_dearer;
use crate::optimiser::tile_mesh::TileMesh;
use crate::optimiser::undo::Saved;

/// What is known of a vertex that waits.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Known {
    /// A guess for its surroundings as they are.
    Guess,
    /// A guess from before its surroundings changed.
    StaleGuess,
    /// Its true cost.
    Cost,
    /// Nothing yet.
    New,
    /// That it cannot go.
    Stuck,
}

/// Removes vertices until nothing is over the budget, loans included, the cheapest first. `share` is the part of the
/// cost before moves that is left after them, as a guess. Gives what the last one cost.
pub(crate) fn thin_deep(
    sheet: &mut TileMesh,
    account: &mut Account,
    share: f64,
    removal: &mut Removal,
    mover: &mut Mover,
) -> Option<f64> {
    mover.aim(sheet.mean_squares());
    let mut waiting = Waiting { queue: Queue::default(), known: Vec::new(), share };
    waiting.known.resize(sheet.vertices.len(), Known::New);
    for vertex in 0..sheet.vertices.len() as u32 {
        waiting.enter(sheet, account, removal, vertex);
    }
    let mut saved = Saved::default();
    let mut last = None;
    while account.left() < 0 {
        let Some((vertex, worth)) = waiting.queue.pop() else { break };
        let known = waiting.known[vertex as usize];
        let Some(cost) = removal.find(sheet, vertex) else {
            waiting.known[vertex as usize] = Known::Stuck;
            continue;
        };
        sheet.vertices[vertex as usize].cost = cost;
        let record = sheet.vertices[vertex as usize];
        let guess = account.rate(&record, waiting.guess(cost));
        if known == Known::StaleGuess && is_dearer(guess, -worth) {
            waiting.put_back(vertex, guess, Known::Guess);
            continue;
        }
        let ring = &removal.star.ring;
        saved.save(sheet, ring.iter().copied().chain([vertex]));
        sheet.apply(&mut removal.patch);
        for index in 0..removal.star.ring.len() {
            mover.relax(sheet, removal.star.ring[index]);
        }
        let cost = account.rate(&record, saved.rise(sheet));
        if known != Known::Cost && waiting.has_cheaper_than(cost, -worth) {
            saved.restore(sheet);
            waiting.put_back(vertex, cost, Known::Cost);
            continue;
        }
        last = Some(cost);
        account.refund(&record);
        sheet.drop_vertex(vertex);
        let ring = std::mem::take(&mut removal.star.ring);
        ring.iter().for_each(|&other| waiting.unsettle(sheet, account, removal, other));
        removal.star.ring = ring;
    }
    last
}

/// Vertices that may go, the one of lowest cost or guess first.
struct Waiting {
    queue: Queue,
    known: Vec<Known>,
    share: f64,
}

impl Waiting {
    fn guess(&self, cost: f64) -> f64 {
        if 0.0 < cost { self.share * cost } else { cost }
    }

    fn enter(&mut self, sheet: &TileMesh, account: &Account, removal: &mut Removal, vertex: u32) {
        let record = &sheet.vertices[vertex as usize];
        if !record.cost.is_nan() && self.known[vertex as usize] == Known::New {
            return self.put_back(vertex, account.rate(record, self.guess(record.cost)), Known::StaleGuess);
        }
        match removal.find(sheet, vertex) {
            Some(cost) => self.put_back(vertex, account.rate(record, self.guess(cost)), Known::Guess),
            None => self.known[vertex as usize] = Known::Stuck,
        }
    }

    fn put_back(&mut self, vertex: u32, cost: f64, known: Known) {
        self.queue.enter(vertex, -cost);
        self.known[vertex as usize] = known;
    }

    /// Whether another vertex is likely to cost less than one whose turn came at `before`.
    fn has_cheaper_than(&mut self, cost: f64, before: f64) -> bool {
        self.queue.peek().is_some_and(|(_, worth)| is_dearer(cost, before.max(-worth)))
    }

    /// The surroundings of a vertex have changed: what could not go now may.
    fn unsettle(&mut self, sheet: &TileMesh, account: &Account, removal: &mut Removal, vertex: u32) {
        match self.known[vertex as usize] {
            Known::Stuck => self.enter(sheet, account, removal, vertex),
            _ => self.known[vertex as usize] = Known::StaleGuess,
        }
    }
}
