//! Ends a task asks for beside its budget: an RMS residual, a largest residual, limits of load modules.

use terrain::StopReason;

use crate::optimiser::account::Account;
use crate::optimiser::gains::Gains;
use crate::optimiser::heights::round_heights;
use crate::optimiser::parts::NONE;
use crate::optimiser::thin::{Filling, Until};
use crate::optimiser::tile_mesh::TileMesh;
use crate::optimiser::work::Work;

impl Work<'_, '_> {
    /// The weighted sum of squares at which the RMS residual should be good enough, if there is such a goal: plain and
    /// weighted sums are taken to stay in proportion.
    fn goal(&self) -> Option<f64> {
        let rms = self.task.rms_quanta?;
        let (squares, plain) = (self.sheet.squares(), self.sheet.plain_squares());
        let posts = self.sheet.ground.post_count() as f64;
        Some(if 0.0 < plain { rms * rms * posts * (squares / plain) } else { 0.0 })
    }

    pub fn thin_to_goal(&mut self) {
        if let Some(goal) = self.goal() {
            self.thin_until(Until::Squares(goal), Filling::Fitted);
        }
    }

    /// Inserts until the RMS residual is good enough, if it is not.
    pub fn reach_goal(&mut self) {
        const AT_ONCE: usize = 16;
        let mut gains = Gains::default();
        self.sheet.mark_all_changed();
        while self.goal().is_some_and(|goal| goal < self.sheet.squares())
            && 0 < gains.insert(&mut self.sheet, &mut self.account, AT_ONCE, &mut self.insertion)
        {}
    }

    /// Inserts where a residual is larger than it may be, and makes room for that where it can be spared. Where limits
    /// leave too little room, the mesh ends as it was when its largest residual was least: what is taken away to make
    /// room would be missed more.
    pub fn meet_largest(&mut self) {
        const ROUNDS: usize = 20;
        let Some(largest) = self.task.largest_quanta else { return };
        let mut least: Option<(f64, TileMesh, Account)> = None;
        for round in 0..=ROUNDS {
            let above = self.above(largest);
            let Some(&(worst, ..)) = above.first() else { return };
            if least.as_ref().is_none_or(|(least, ..)| worst < *least) {
                least = Some((worst, self.sheet.clone(), self.account.clone()));
            }
            if round == ROUNDS {
                break;
            }
            self.account.keep_back(self.account.dearest() * above.len() as i64);
            self.thin_until(Until::Afforded, Filling::Below(largest));
            self.account.keep_back(0);
            for (_, triangle, corners) in above {
                if self.sheet.triangles[triangle as usize].corners == corners {
                    self.insert_worst(triangle);
                }
            }
            round_heights(&mut self.sheet);
        }
        if let Some((_, sheet, account)) = least {
            (self.sheet, self.account) = (sheet, account);
        }
    }

    /// Triangles with a weighted residual above `largest`, the worst first: the residual, the triangle, its corners.
    fn above(&self, largest: f64) -> Vec<(f64, u32, [u32; 3])> {
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
        above
    }

    /// Inserts at the worst post of a triangle; where there is no room for a vertex, moves the nearest one there, or
    /// takes it out.
    fn insert_worst(&mut self, triangle: u32) {
        let corners = self.sheet.triangles[triangle as usize].corners;
        let Some((_, at)) = self.sheet.worst(corners) else { return };
        let Some(found) = self.insertion.find(&mut self.sheet, triangle) else {
            let away = |corner: &u32| self.sheet.at(*corner).squared_distance(at);
            let mut nearest = corners;
            nearest.sort_unstable_by_key(away);
            let is_put = nearest.into_iter().any(|corner| self.mover.put(&mut self.sheet, corner, at));
            if !is_put {
                // Without one of its corners there is room for the post in the next round.
                let _ = nearest.into_iter().any(|corner| self.take_out(corner));
            }
            return;
        };
        let inserted = self.sheet.vertices[found.vertex as usize];
        if self.account.permits(&inserted) {
            self.account.charge(&inserted);
            // Fitted heights would lift residuals elsewhere; as it stands, the post is met exactly.
            self.insertion.patch.refit.clear();
            self.insertion.patch.rise.clear();
            self.sheet.apply(&mut self.insertion.patch);
        } else {
            self.sheet.drop_vertex(found.vertex);
        }
    }

    /// Where features stand so close together that no sound triangle fills the place of a vertex, thinning leaves it:
    /// such vertices go all the same until every limit is met.
    pub fn meet_limits(&mut self) {
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

    pub fn stop(&self) -> StopReason {
        if self.task.largest_quanta.is_some_and(|largest| self.above(largest).is_empty()) {
            StopReason::ResidualReached
        } else if self.goal().is_some_and(|goal| self.sheet.squares() <= goal) {
            StopReason::RmsReached
        } else if self.account.left() < self.account.dearest() {
            StopReason::BudgetSpent
        } else {
            StopReason::Exhausted
        }
    }
}
