//! What the steps of an optimisation share: the mesh, its account, and what each kind of change keeps between calls.

use crate::account::Account;
use crate::deep_thinning::thin_deep;
use crate::gains::Gains;
use crate::insertion::Insertion;
use crate::queue::Queue;
use crate::recipe::Thinning;
use crate::removal::Removal;
use crate::sweep::Mover;
use crate::task::Task;
use crate::thin::{Filling, Until, thin};
use crate::tile_mesh::{Star, TileMesh};

/// Limits of load modules and windows are met once the whole is this share over its budget: earlier, too much would
/// go where ground is rough.
const LIMITS_FROM: f64 = 0.1;

/// Everything the steps work with.
pub(crate) struct Work<'a, 'g> {
    pub sheet: TileMesh<'g>,
    pub account: Account,
    pub task: &'a Task,
    pub mover: Mover,
    pub removal: Removal,
    pub insertion: Insertion,
    /// Squares that the least useful vertex explains, as far as thinning has found.
    pub cheapest: Option<f64>,
}

impl Work<'_, '_> {
    /// Every step leaves a mesh whose links agree and whose triangles all face up.
    pub fn check(&self) {
        debug_assert_eq!(self.sheet.fault(), None);
    }

    /// Thins to so many times the budget; to the limits of load modules and windows from a tenth over on.
    pub fn thin(&mut self, times: f64, by: Thinning) {
        let share = times - 1.0;
        let filling = if by == Thinning::AsItIs { Filling::AsItIs } else { Filling::Fitted };
        if self.account.is_any_over() {
            self.account.allow_beyond(share.max(LIMITS_FROM));
            self.thin_until(Until::Afforded, filling);
            if share <= LIMITS_FROM {
                self.thin_until(Until::LimitsMet, filling);
            }
        }
        self.account.allow_beyond(share);
        let last = match by {
            Thinning::Deep(rest) => {
                thin_deep(&mut self.sheet, &mut self.account, rest, &mut self.removal, &mut self.mover)
            }
            Thinning::AsItIs | Thinning::Fitted => self.thin_until(Until::Afforded, filling),
        };
        self.account.allow_beyond(0.0);
        self.cheapest = Some(last.unwrap_or(0.0).max(0.0));
        self.sheet.renumber();
    }

    pub fn thin_until(&mut self, until: Until, filling: Filling) -> Option<f64> {
        thin(&mut self.sheet, &mut self.account, until, filling, (&mut self.removal, &mut self.mover))
    }

    /// Inserts where it gains most while there is room.
    pub fn fill_up(&mut self) {
        if self.account.dearest() <= self.account.left() && self.task.rms_quanta.is_none() {
            self.sheet.mark_all_changed();
            Gains::default().insert(&mut self.sheet, &mut self.account, usize::MAX, &mut self.insertion);
        }
    }

    /// Grows to so many times the budget, where that is one.
    pub fn grow(&mut self, times: f64) {
        if self.task.rms_quanta.is_none() {
            self.account.allow_beyond(times - 1.0);
            self.insertion.tries_middles = true;
            self.fill_by_squares();
            self.insertion.tries_middles = false;
            self.account.allow_beyond(0.0);
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
            let inserted = self.sheet.vertices[found.vertex as usize];
            if found.gain <= 0.0 || !self.account.permits(&inserted) {
                self.sheet.drop_vertex(found.vertex);
                continue;
            }
            self.account.charge(&inserted);
            self.insertion.patch.old.iter().for_each(|&old| queue.cancel(old));
            self.sheet.apply(&mut self.insertion.patch);
            self.sheet.star(found.vertex, &mut star);
            star.triangles().for_each(|triangle| queue.enter(triangle, squares(&self.sheet, triangle)));
        }
    }
}
