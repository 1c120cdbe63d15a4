//! One tile from its window to its TIN.

use fearless_simd::{Level, Simd, dispatch};
use terrain::geometry::LocalPost;
use terrain::{Dem, Importance, StopReason, TileTin, Tin, Vertex};

use crate::batch::Passes;
use crate::criterion::{Largest, Squares};
use crate::growth::{Barred, Growth};
use crate::sequence::{Sequence, Unwatched, Witness};
use crate::start::{Start, candidates};
use crate::task::{Rule, Stop, TileTask};
use crate::weighted_surface::WeightedSurface;

/// Refines one tile: its initial points, then the posts that `task.rule` selects until it has to stop.
///
/// A pure function of the window, the mask and the task; every `level` gives the same result.
///
/// # Panics
/// When the window does not cover exactly the tile's posts, or the tile has more than
/// [`terrain::geometry::WORKING_POSTS_MAX`] posts a side.
pub fn refine(dem: &Dem, importance: &Importance, task: &TileTask, level: Level) -> TileTin {
    assert_eq!(dem.rect(), task.rect, "the window covers the tile");
    let start = Start::new(task);
    let initial = start.vertices.clone();
    let (growth, stop) = dispatch!(level, simd => grow(simd, dem, importance, task, start, &mut Unwatched));
    finish(dem, task, &initial, growth, stop)
}

/// What is left of a growth once the lanes are gone.
pub(crate) struct Grown {
    mesh: terrain::mesh::Mesh,
    sequence: Sequence,
    spent: u32,
}

/// Grows the TIN of a tile from its start.
#[inline(always)]
pub(crate) fn grow<S: Simd>(
    simd: S,
    dem: &Dem,
    importance: &Importance,
    task: &TileTask,
    start: Start,
    witness: &mut dyn Witness,
) -> (Grown, StopReason) {
    let unit = match task.rule {
        Rule::Batches { residual_quantum, .. } => residual_quantum,
        Rule::WorstFirst | Rule::LargestSquares { .. } => 1,
    };
    let ground = WeightedSurface::new(simd, dem, importance, candidates(task.rect, task.seams), unit);
    let sequence = Sequence { refused: start.refused, ..Sequence::default() };
    let barred = Barred::of(task);
    let mut growth = Growth { tile: task.rect, ground, mesh: start.mesh, gate: start.gate, sequence, barred };
    let stop = match &task.rule {
        Rule::WorstFirst => growth.run(Largest, &task.stop, witness),
        Rule::LargestSquares { guard } => by_squares(&mut growth, *guard, &task.stop, witness),
        Rule::Batches { proximity, last_batch, .. } => {
            let passes = Passes { proximity: *proximity, last_batch: *last_batch };
            passes.run(&mut growth, &start.vertices, &task.stop)
        }
    };
    (Grown { mesh: growth.mesh, spent: growth.gate.spent(), sequence: growth.sequence }, stop)
}

#[inline(always)]
fn by_squares<S: Simd>(
    growth: &mut Growth<S>,
    guard: Option<u64>,
    stop: &Stop,
    witness: &mut dyn Witness,
) -> StopReason {
    if guard.is_some() {
        let first = growth.run(Largest, &Stop { value: guard, ..*stop }, witness);
        if first != StopReason::ResidualReached {
            return first;
        }
    }
    growth.run(Squares, &Stop { value: None, ..*stop }, witness)
}

fn finish(dem: &Dem, task: &TileTask, initial: &[LocalPost], grown: Grown, stop: StopReason) -> TileTin {
    let order: Vec<LocalPost> = initial.iter().chain(&grown.sequence.posts).copied().collect();
    let mut refused = grown.sequence.refused;
    // A post can come up again in another triangle; its largest residual is the one that counts.
    refused.sort_by_key(|refusal| (refusal.post, std::cmp::Reverse(refusal.residual)));
    refused.dedup_by_key(|refusal| refusal.post);
    refused.sort_by_key(|refusal| (std::cmp::Reverse(refusal.residual), refusal.post));
    TileTin {
        tile: task.tile,
        tin: tin_of(dem, &order, &grown.mesh),
        initial_count: initial.len() as u32,
        residuals: grown.sequence.residuals,
        triangles_charged: grown.spent,
        refused,
        stop,
    }
}

/// The mesh as a TIN whose vertices stand in insertion order at the DEM's heights.
fn tin_of(dem: &Dem, order: &[LocalPost], mesh: &terrain::mesh::Mesh) -> Tin {
    let rect = dem.rect();
    let wide = rect.posts_wide();
    let place = |post: LocalPost| post.row() as usize * wide + post.col() as usize;
    let mut index_at = vec![u32::MAX; rect.post_count()];
    for (index, &post) in order.iter().enumerate() {
        index_at[place(post)] = index as u32;
    }
    let vertex = |local: &LocalPost| {
        let post = local.post(rect);
        Vertex { at: post.into(), height: dem.height(post) }
    };
    let triangles = mesh.triangles().iter().map(|record| record.corners.map(|post| index_at[place(post)])).collect();
    Tin::new(rect, order.iter().map(vertex).collect(), triangles)
}

#[cfg(test)]
mod tests;
