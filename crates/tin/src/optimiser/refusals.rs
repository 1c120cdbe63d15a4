//! What limits keep out that would have been worth its triangles.

use terrain::Refusal;

use crate::optimiser::place::Place;
use crate::optimiser::work::Work;

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
