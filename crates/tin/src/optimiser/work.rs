//! What the steps of an optimisation share: the mesh, its account, and what each kind of change keeps between calls.

use terrain::{LATTICE_PER_POST, Lattice, Refusal};

use crate::optimiser::account::Account;
use crate::optimiser::deep_thinning::thin_deep;
use crate::optimiser::gains::Gains;
use crate::optimiser::insertion::Insertion;
use crate::optimiser::place::{PER_POST, Place, Shape};
use crate::optimiser::queue::Queue;
use crate::optimiser::recipe::ThinBy;
use crate::optimiser::removal::Removal;
use crate::optimiser::sweep::Mover;
use crate::optimiser::task::Task;
use crate::optimiser::thin::{Filling, Thinning, Until};
use crate::optimiser::tile_mesh::{Star, TileMesh};

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
    pub fn thin(&mut self, times: f64, by: ThinBy) {
        let share = times - 1.0;
        let filling = if by == ThinBy::AsItIs { Filling::AsItIs } else { Filling::Fitted };
        let mut thinning = Thinning::by(filling);
        if self.account.is_any_over() {
            self.account.allow_beyond(share.max(LIMITS_FROM));
            self.thin_on(&mut thinning, Until::Afforded);
            if share <= LIMITS_FROM {
                self.thin_on(&mut thinning, Until::LimitsMet);
            }
        }
        self.account.allow_beyond(share);
        let last = match by {
            ThinBy::Deep(rest) => {
                thin_deep(&mut self.sheet, &mut self.account, rest, &mut self.removal, &mut self.mover)
            }
            ThinBy::AsItIs | ThinBy::Fitted => {
                thinning.last = None;
                self.thin_on(&mut thinning, Until::Afforded);
                thinning.last
            }
        };
        self.account.allow_beyond(0.0);
        self.cheapest = Some(last.unwrap_or(0.0).max(0.0));
        self.sheet.renumber();
    }

    /// Removes vertices, the cheapest first. Gives what the last one cost.
    pub fn thin_until(&mut self, until: Until, filling: Filling) -> Option<f64> {
        let mut thinning = Thinning::by(filling);
        self.thin_on(&mut thinning, until);
        thinning.last
    }

    fn thin_on(&mut self, thinning: &mut Thinning, until: Until) {
        thinning.run(&mut self.sheet, &mut self.account, until, (&mut self.removal, &mut self.mover));
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
            // So much will change that what is known of costs is no guess at them.
            self.sheet.vertices.iter_mut().for_each(|vertex| vertex.cost = f64::NAN);
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

impl Work<'_, '_> {
    /// The posts that limits keep out, largest residual first.
    pub fn refusals(&mut self) -> Option<Vec<Refusal>> {
        let cheapest = self.cheapest?;
        let mut refused = Vec::new();
        self.account.look_again();
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

impl Work<'_, '_> {
    /// The step of the final lattice.
    pub fn final_step(&self) -> i32 {
        match self.task.lattice {
            Lattice::Eighth => PER_POST / LATTICE_PER_POST,
            Lattice::Post => PER_POST,
        }
    }

    /// Puts every vertex on the final lattice; those without a place there go, and what they cost is spent again.
    pub fn snap(&mut self) {
        self.mover.step = self.final_step();
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
    pub fn take_out(&mut self, vertex: u32) -> bool {
        let can_go = self.removal.find(&self.sheet, vertex).is_some();
        can_go && self.let_go(vertex)
    }

    /// Takes a vertex out whatever the triangles look like that fill its place.
    pub fn force_out(&mut self, vertex: u32) -> bool {
        self.removal.find_by_force(&self.sheet, vertex) && self.let_go(vertex)
    }

    /// Takes a vertex out as the removal has found it.
    fn let_go(&mut self, vertex: u32) -> bool {
        self.account.refund(&self.sheet.vertices[vertex as usize]);
        self.sheet.apply(&mut self.removal.patch);
        self.sheet.drop_vertex(vertex);
        true
    }
}
