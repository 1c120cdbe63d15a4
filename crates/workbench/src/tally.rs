//! Residuals of a TIN without load modules.

use fidelity::Tally;
use geometry::owned::{PostGrid, visit_residuals};
use terrain::{Dem, Post, Tin};

/// Residuals at every post that a TIN covers and that is not void, each counted once.
pub(crate) fn tally_of(dem: &Dem, tin: &Tin) -> Tally {
    let mut tally = Tally::default();
    for triangle in &tin.triangles {
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
    let facet = geometry::Facet::new(
        corners.map(|vertex| vertex.at.col - from.col),
        corners.map(|vertex| vertex.at.row - from.row),
        corners.map(|vertex| vertex.height),
    );
    visit_residuals(&grid, &facet, dem, |post, residual| {
        if !dem.is_void(post) {
            tally.add(residual);
        }
    });
}
