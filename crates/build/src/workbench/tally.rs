//! Residuals of a TIN without load modules.

use std::sync::atomic::AtomicBool;

use crate::{CompileError, Stage};
use fidelity::{Sums, Tally};
use schedule::Workers;
use terrain::geometry::Facet;
use terrain::geometry::owned::{PostGrid, visit_residuals};
use terrain::{Dem, Post, PostRect, Tin, Vertex};

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
    let tallies = tallies.map_err(|error| CompileError::from_schedule(Stage::Assemble, &[], error))?;
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

/// A triangle, and the posts around it. Counted from a post near it, its corners stay small in a raster of any size.
fn facet_of(rect: PostRect, tin: &Tin, triangle: [u32; 3]) -> (PostGrid, Facet) {
    let steps = tin.steps_per_post;
    let corners = triangle.map(|v| tin.vertices[v as usize]);
    let least = |at: [i32; 3]| at[0].min(at[1]).min(at[2]).div_euclid(steps);
    let origin = Post::new(least(corners.map(|vertex| vertex.at.row)), least(corners.map(|vertex| vertex.at.col)));
    let from = tin.place_of(origin);
    let grid = PostGrid {
        origin,
        units_per_post: steps,
        far_row: Some(rect.north - origin.row),
        far_col: Some(rect.east - origin.col),
    };
    let facet = Facet::new(
        corners.map(|vertex| vertex.at.col - from.col),
        corners.map(|vertex| vertex.at.row - from.row),
        corners.map(|vertex| vertex.height),
    );
    (grid, facet)
}

/// The TIN without the triangles over voids, those most of whose posts are void, and without vertices that no triangle
/// has any more: where nothing is known there is no ground.
pub(crate) fn without_voids(tin: Tin, dem: &Dem) -> Tin {
    if dem.void_count() == 0 {
        return tin;
    }
    let triangles: Vec<[u32; 3]> =
        tin.triangles.iter().copied().filter(|triangle| !lies_over_void(dem, &tin, *triangle)).collect();
    let mut numbers = vec![None; tin.vertices.len()];
    triangles.iter().flatten().for_each(|&corner| numbers[corner as usize] = Some(0));
    for (number, place) in numbers.iter_mut().flatten().zip(0..) {
        *number = place;
    }
    let kept = |(vertex, number): (&Vertex, &Option<u32>)| number.map(|_| *vertex);
    let vertices = tin.vertices.iter().zip(&numbers).filter_map(kept).collect();
    let renumbered = |corner: u32| numbers[corner as usize].expect("corners of triangles are kept");
    Tin { vertices, triangles: triangles.into_iter().map(|triangle| triangle.map(renumbered)).collect(), ..tin }
}

fn lies_over_void(dem: &Dem, tin: &Tin, triangle: [u32; 3]) -> bool {
    let (grid, facet) = facet_of(dem.rect(), tin, triangle);
    let (mut known, mut void) = (0, 0);
    visit_residuals(&grid, &facet, dem, |post, _| if dem.is_void(post) { void += 1 } else { known += 1 });
    if known + void != 0 {
        return known < void;
    }
    // It owns no post: the one nearest to its middle decides.
    let middle = |at: [i32; 3]| (2 * at.iter().sum::<i32>() + 3 * grid.units_per_post) / (6 * grid.units_per_post);
    dem.is_void(Post::new(grid.origin.row + middle(facet.y), grid.origin.col + middle(facet.x)))
}

fn visit_triangle(dem: &Dem, tin: &Tin, triangle: [u32; 3], tally: &mut Tally) {
    let (grid, facet) = facet_of(dem.rect(), tin, triangle);
    let (mut sums, mut histogram, whole) = (Sums::default(), tally.histogram(), dem.void_count() == 0);
    visit_residuals(&grid, &facet, dem, |post, residual| {
        if whole || !dem.is_void(post) {
            sums.add(residual);
            histogram.add(residual);
        }
    });
    tally.add_sums(&sums);
}

#[cfg(test)]
mod tests {
    use terrain::LATTICE_PER_POST;

    use super::*;

    #[test]
    fn over_voids_there_is_no_triangle_and_no_vertex_of_none() {
        let rect = PostRect::new(Post::new(0, 0), Post::new(8, 8));
        let is_void = |at: Post| 2 < at.row && 2 < at.col;
        let dem = Dem::from_fn(rect, |at| (!is_void(at)).then_some(100));
        let corner = |row, col| Vertex { at: Post::new(row, col).into(), height: 100 };
        let vertices = vec![corner(0, 0), corner(0, 8), corner(2, 2), corner(8, 8), corner(8, 0)];
        let triangles = vec![[0, 1, 2], [1, 3, 2], [2, 3, 4], [0, 2, 4]];
        let tin = Tin { rect, steps_per_post: LATTICE_PER_POST, vertices, triangles };
        let left = without_voids(tin.clone(), &dem);
        assert_eq!(left.triangles, [[0, 1, 2], [0, 2, 3]]);
        assert_eq!(left.vertices, [0, 1, 2, 4].map(|at| tin.vertices[at]));
        assert_eq!(without_voids(tin.clone(), &Dem::from_fn(rect, |_| Some(100))), tin);
    }
}
