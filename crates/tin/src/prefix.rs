//! A coarser level of a TIN: the first vertices of its insertion sequence.

use terrain::{LatticePoint, TileTin, Tin};

/// The TIN of the first `points` vertices, or of all where there are fewer: what growing would have been when it had so
/// many, because a TIN depends on its vertices only, and each was chosen without regard to those after it.
///
/// `grown` has its vertices in the order in which they were inserted, corners first, and no edges but Delaunay's.
///
/// # Panics
/// When `points` cut into the vertices that growing began with.
pub fn prefix(grown: &TileTin, points: usize) -> Tin {
    assert!(grown.initial_count as usize <= points, "a level holds what its TIN began with");
    let vertices = grown.tin.vertices[..points.min(grown.tin.vertices.len())].to_vec();
    let places: Vec<LatticePoint> = vertices.iter().map(|vertex| vertex.at).collect();
    Tin::new(grown.tin.rect, vertices, terrain::mesh::delaunay(&places))
}
