//! Residuals of a TIN without load modules.

use std::sync::atomic::AtomicBool;

use crate::{CompileError, Stage};
use fidelity::{Sums, Tally};
use schedule::Workers;
use terrain::geometry::owned::{PostGrid, visit_residuals};
use terrain::{Dem, Post, TileId, Tin};

/// Residuals at every post that a TIN covers and that is not void, each counted once.
pub(crate) fn tally_of(dem: &Dem, tin: &Tin) -> Tally {
    tally_of_some(dem, tin, &tin.triangles)
}

/// The same on all workers: sums are whole numbers, so it does not matter how triangles are shared out.
///
/// # Errors
/// When it is stopped.
pub(crate) fn tally_on_all(dem: &Dem, tin: &Tin, workers: &Workers, stop: &AtomicBool) -> Result<Tally, CompileError> {
    const PARTS_PER_WORKER: usize = 4;
    let size = tin.triangles.len().div_ceil(PARTS_PER_WORKER * workers.count()).max(1);
    let parts: Vec<&[[u32; 3]]> = tin.triangles.chunks(size).collect();
    let tallies = schedule::for_each_independent(&parts, workers, stop, |_, part| -> Result<Tally, CompileError> {
        Ok(tally_of_some(dem, tin, part))
    });
    let nowhere = vec![TileId { row: 0, col: 0 }; parts.len()];
    let tallies = tallies.map_err(|error| CompileError::from_schedule(Stage::Assemble, &nowhere, error))?;
    let mut all = Tally::default();
    tallies.iter().for_each(|tally| all.merge(tally));
    Ok(all)
}

fn tally_of_some(dem: &Dem, tin: &Tin, triangles: &[[u32; 3]]) -> Tally {
    let mut tally = Tally::default();
    for triangle in triangles {
        visit_triangle(dem, tin, *triangle, &mut tally);
    }
    tally
}

fn visit_triangle(dem: &Dem, tin: &Tin, triangle: [u32; 3], tally: &mut Tally) {
    let (rect, steps) = (dem.rect(), tin.steps_per_post);
    let corners = triangle.map(|v| tin.vertices[v as usize]);
    // Counted from a post near the triangle, its corners stay small in a raster of any size.
    let least = |at: [i32; 3]| at[0].min(at[1]).min(at[2]).div_euclid(steps);
    let origin = Post::new(least(corners.map(|vertex| vertex.at.row)), least(corners.map(|vertex| vertex.at.col)));
    let from = tin.place_of(origin);
    let grid = PostGrid {
        origin,
        units_per_post: steps,
        far_row: Some(rect.north - origin.row),
        far_col: Some(rect.east - origin.col),
    };
    let facet = terrain::geometry::Facet::new(
        corners.map(|vertex| vertex.at.col - from.col),
        corners.map(|vertex| vertex.at.row - from.row),
        corners.map(|vertex| vertex.height),
    );
    let (mut sums, mut histogram, whole) = (Sums::default(), tally.histogram(), dem.void_count() == 0);
    visit_residuals(&grid, &facet, dem, |post, residual| {
        if whole || !dem.is_void(post) {
            sums.add(residual);
            histogram.add(residual);
        }
    });
    tally.add_sums(&sums);
}
