//! What woods leave free: roads, water and buildings.

use std::collections::BTreeMap;

use terrain::plans::{difference, sorted_out};

use super::cut::{Piece, cut};
use super::plan::{At, METRE, Plan, bounds, doubled_area};

/// What is to be free of woods, by load module, in quanta from its corner, each with its bounds.
#[derive(Default)]
pub(super) struct Clear(BTreeMap<[i32; 2], Vec<([At; 2], Plan)>>);

/// Square metres of the least piece of a wood that is left between what is cut out.
const PIECE_M2_MIN: f64 = 25.0;

impl Clear {
    pub(super) fn of<'a>(plans: impl Iterator<Item = &'a Plan>, side: i32) -> Self {
        let mut free: BTreeMap<[i32; 2], Vec<([At; 2], Plan)>> = BTreeMap::new();
        for piece in plans.flat_map(|plan| sorted_out(plan.clone())).flat_map(|plan| cut(&plan, side)) {
            free.entry(piece.module).or_default().push((bounds(&piece.plan), piece.plan));
        }
        Self(free)
    }

    /// Pieces in one load module less what is to be free there; `None` where nothing is.
    pub(super) fn cut_out(&self, pieces: &[Piece]) -> Option<Vec<Piece>> {
        let module = pieces.first()?.module;
        let around: Vec<[At; 2]> = pieces.iter().map(|piece| bounds(&piece.plan)).collect();
        let meets = |[low, high]: &[At; 2]| {
            let is_apart = |of: &[At; 2], axis: usize| of[1][axis] < low[axis] || high[axis] < of[0][axis];
            around.iter().any(|of| !(0..2).any(|axis| is_apart(of, axis)))
        };
        let near = self.0.get(&module)?.iter().filter(|(bounds, _)| meets(bounds));
        let near: Vec<Plan> = near.map(|(_, plan)| plan.clone()).collect();
        if near.is_empty() {
            return None;
        }
        let plans: Vec<Plan> = pieces.iter().map(|piece| piece.plan.clone()).collect();
        let left = difference(&plans, &near);
        let least = (2.0 * PIECE_M2_MIN * METRE * METRE) as i64;
        Some(left.into_iter().filter(|plan| least <= doubled_area(plan)).map(|plan| Piece { module, plan }).collect())
    }
}
