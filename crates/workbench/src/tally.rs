//! Residuals of a TIN without load modules.

use fidelity::Tally;
use geometry::owned::{PostGrid, visit_residuals};
use terrain::{Dem, LATTICE_PER_POST, LatticePoint, Post, Tin, Vertex};

/// Residuals at every post that a TIN covers and that is not void, each counted once.
pub(crate) fn tally_of(dem: &Dem, tin: &Tin) -> Tally {
    let mut tally = Tally::default();
    for triangle in &tin.triangles {
        visit_triangle(dem, triangle.map(|v| tin.vertices[v as usize]), &mut tally);
    }
    tally
}

fn visit_triangle(dem: &Dem, corners: [Vertex; 3], tally: &mut Tally) {
    let rect = dem.rect();
    // Counted from a post near the triangle, its corners stay small in a raster of any size.
    let least = |pick: fn(&Vertex) -> i32| {
        corners.iter().map(pick).min().expect("a triangle has corners").div_euclid(LATTICE_PER_POST)
    };
    let origin = Post::new(least(|vertex| vertex.at.row), least(|vertex| vertex.at.col));
    let from = LatticePoint::from(origin);
    let grid = PostGrid {
        origin,
        units_per_post: LATTICE_PER_POST,
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
