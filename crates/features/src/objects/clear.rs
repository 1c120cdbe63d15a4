//! What woods leave free: roads, water and buildings.

use std::collections::BTreeMap;

use terrain::plans::{difference, sorted_out};

use super::cut::{Piece, cut};
use super::plan::{METRE, Plan, doubled_area};

/// What is to be free of woods, by load module, in quanta from its corner.
#[derive(Default)]
pub(super) struct Clear(BTreeMap<[i32; 2], Vec<Plan>>);

/// Square metres of the least piece of a wood that is left between what is cut out.
const PIECE_M2_MIN: f64 = 25.0;

impl Clear {
    pub(super) fn of<'a>(plans: impl Iterator<Item = &'a Plan>, side: i32) -> Self {
        let mut free: BTreeMap<[i32; 2], Vec<Plan>> = BTreeMap::new();
        for piece in plans.flat_map(|plan| sorted_out(plan.clone())).flat_map(|plan| cut(&plan, side)) {
            free.entry(piece.module).or_default().push(piece.plan);
        }
        Self(free)
    }

    /// Pieces in one load module less what is to be free there; `None` where nothing is.
    pub(super) fn cut_out(&self, pieces: &[Piece]) -> Option<Vec<Piece>> {
        let module = pieces.first()?.module;
        let plans: Vec<Plan> = pieces.iter().map(|piece| piece.plan.clone()).collect();
        let left = difference(&plans, self.0.get(&module)?);
        let least = (2.0 * PIECE_M2_MIN * METRE * METRE) as i64;
        Some(left.into_iter().filter(|plan| least <= doubled_area(plan)).map(|plan| Piece { module, plan }).collect())
    }
}
