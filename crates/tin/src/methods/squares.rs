//! Squared residuals of a TIN that grows post by post.

use terrain::geometry::owned::{PostGrid, visit_residuals};
use terrain::geometry::{Facet, LocalPost};
use terrain::mesh::{Lines, Mesh};
use terrain::{Dem, Post};

/// The sum of squared residuals, in quanta squared, of the Delaunay TIN of the window's corners and each beginning of
/// `posts`: of the corners alone, with the first post, with the first two and so on. Voids are not counted; corners
/// among `posts` and posts listed twice change nothing.
pub fn running_squares(dem: &Dem, posts: &[Post]) -> Vec<u64> {
    let rect = dem.rect();
    let mut mesh = Mesh::new(rect, Lines::none());
    let mut of_triangle: Vec<u64> = Vec::new();
    let squares = |mesh: &Mesh, triangle: u32| of_corners(dem, mesh.triangles()[triangle as usize].corners);
    of_triangle.extend((0..mesh.triangles().len() as u32).map(|triangle| squares(&mesh, triangle)));
    let mut sum: u64 = of_triangle.iter().sum();
    let mut all = vec![sum];
    let mut hint = 0;
    for &post in posts {
        let post = LocalPost::of(post, rect);
        hint = mesh.triangle_at(post, hint);
        if !mesh.triangles()[hint as usize].corners.contains(&post) {
            mesh.insert(post, hint);
            of_triangle.resize(mesh.triangles().len(), 0);
            // What a post replaces is what its star now covers, so every old triangle is rewritten here.
            for &triangle in mesh.star() {
                let now = squares(&mesh, triangle);
                sum = sum - std::mem::replace(&mut of_triangle[triangle as usize], now) + now;
            }
        }
        all.push(sum);
    }
    all
}

fn of_corners(dem: &Dem, corners: [LocalPost; 3]) -> u64 {
    let rect = dem.rect();
    let heights = corners.map(|corner| dem.height(corner.post(rect)));
    let facet = Facet::new(corners.map(LocalPost::col), corners.map(LocalPost::row), heights);
    let mut sum = 0;
    visit(dem, &facet, |residual| sum += residual * residual);
    sum
}

fn visit(dem: &Dem, facet: &Facet, mut each: impl FnMut(u64)) {
    let whole = dem.void_count() == 0;
    visit_residuals(&PostGrid::of_area(dem.rect()), facet, dem, |post, residual| {
        if whole || !dem.is_void(post) {
            each(u64::from(residual.unsigned_abs()));
        }
    });
}

/// Posts that a TIN over posts owns, and the sum of their squared residuals.
#[cfg(test)]
pub fn of_tin(dem: &Dem, tin: &terrain::Tin) -> (u64, u64) {
    let (mut posts, mut squares) = (0, 0);
    for triangle in &tin.triangles {
        let corners = triangle.map(|v| tin.vertices[v as usize]);
        let at =
            corners.map(|vertex| LocalPost::of(vertex.at.post().expect("methods put vertices on posts"), dem.rect()));
        let facet = Facet::new(at.map(LocalPost::col), at.map(LocalPost::row), corners.map(|vertex| vertex.height));
        visit(dem, &facet, |residual| {
            posts += 1;
            squares += residual * residual;
        });
    }
    (posts, squares)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::methods::growing::{Growing, delaunay_tin};
    use crate::methods::scene;

    #[test]
    fn every_beginning_has_the_squares_of_its_own_triangulation() {
        let dem = scene::rough(40, 50);
        let mut growing = Growing::new(&dem);
        growing.grow(60, 0);
        let order: Vec<Post> = growing.tin().vertices.iter().map(|vertex| vertex.at.post().unwrap()).collect();
        let all = running_squares(&dem, &order[4..]);
        assert_eq!(all.len(), 57);
        for (count, &squares) in all.iter().enumerate() {
            let tin = delaunay_tin(&dem, order[4..4 + count].iter().copied());
            assert_eq!(of_tin(&dem, &tin), (2000, squares), "after {count} posts");
        }
    }

    #[test]
    fn voids_and_posts_listed_twice_change_nothing() {
        let dem = scene::rough(20, 20);
        let post = Post::new(7, 8);
        let all = running_squares(&dem, &[post, post, Post::new(0, 0)]);
        assert!(all[1] == all[2] && all[2] == all[3]);
        let holes = Dem::from_fn(dem.rect(), |at| (at != Post::new(3, 3)).then(|| dem.height(at)));
        assert!(running_squares(&holes, &[post])[1] <= all[1] + 1);
    }
}
