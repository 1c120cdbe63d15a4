//! HIGHLOW: peaks and pits.
//!
//! Without the corners of the window, so its hull is smaller than the DEM and its residuals are those of the ground it
//! covers; and how many points there are is the ground's choice.

use std::collections::HashSet;

use terrain::{Dem, Post, Tin};

use crate::methods::dem_window::{DemWindow, Impossible, RING, beside, inner_posts, tin_of};

/// What counts as a peak or a pit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Extrema {
    /// A post above, or below, all eight around it.
    Strict,
    /// Also the most central post of flat ground that is above, or below, everything around it.
    Plateau,
}

/// The TIN of all peaks and pits that are not on the window's border. It does not cover the whole window.
///
/// # Errors
/// When they make no triangle.
pub fn highlow(ground: &DemWindow, extrema: Extrema) -> Result<Tin, Impossible> {
    let posts = match extrema {
        Extrema::Strict => {
            let all = inner_posts(ground.dem.rect());
            all.filter(|&post| !ground.dem.is_void(post) && is_extreme(ground.dem, &[post])).collect()
        }
        Extrema::Plateau => plateaus(ground.dem),
    };
    let triangles = terrain::mesh::delaunay(&posts);
    if triangles.is_empty() {
        return Err(Impossible::new(
            format!("{} peaks and pits", posts.len()),
            "at least 3 that are not on one line",
            "HIGHLOW takes what there is; its number of points cannot be chosen",
        ));
    }
    Ok(tin_of(ground.dem, &posts, triangles))
}

/// Whether equally high posts stand strictly above, or strictly below, all posts around them.
fn is_extreme(dem: &Dem, flat: &[Post]) -> bool {
    let height = dem.height(flat[0]);
    let inside = |post: Post| 1 < flat.len() && flat.binary_search(&post).is_ok();
    let around = || flat.iter().flat_map(|&post| RING.map(|step| beside(post, step))).filter(|&post| !inside(post));
    around().all(|post| dem.height(post) < height) || around().all(|post| height < dem.height(post))
}

/// The most central post of each extreme piece of flat ground, by row and column.
fn plateaus(dem: &Dem) -> Vec<Post> {
    let rect = dem.rect();
    let mut seen = HashSet::new();
    let mut found = Vec::new();
    for post in inner_posts(rect) {
        if !seen.insert(post) {
            continue;
        }
        let mut flat = vec![post];
        let mut next = 0;
        while next < flat.len() {
            for step in RING {
                let other = beside(flat[next], step);
                if rect.contains(other) && dem.height(other) == dem.height(post) && seen.insert(other) {
                    flat.push(other);
                }
            }
            next += 1;
        }
        flat.sort_unstable();
        let is_whole = !flat.iter().any(|&post| rect.has_on_border(post) || dem.is_void(post));
        if is_whole && is_extreme(dem, &flat) {
            found.push(most_central(&flat));
        }
    }
    found.sort_unstable();
    found
}

/// The post nearest to the middle of all.
fn most_central(posts: &[Post]) -> Post {
    let count = posts.len() as i64;
    let sum = posts.iter().fold((0, 0), |(rows, cols), p| (rows + i64::from(p.row), cols + i64::from(p.col)));
    let distance = |post: &Post| {
        let (rows, cols) = (i64::from(post.row) * count - sum.0, i64::from(post.col) * count - sum.1);
        i128::from(rows) * i128::from(rows) + i128::from(cols) * i128::from(cols)
    };
    *posts.iter().min_by_key(|&post| (distance(post), *post)).expect("flat ground has posts")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::methods::scene;

    fn posts(tin: &Tin) -> Vec<Post> {
        tin.vertices.iter().map(|vertex| vertex.at.post().unwrap()).collect()
    }

    #[test]
    fn its_hull_is_smaller_than_the_dem() {
        let dem = scene::rough(80, 90);
        let tin = highlow(&scene::ground(&dem), Extrema::Strict).unwrap();
        assert!(matches!(tin.check(), Err(terrain::TinFault::AreaMissing(covered, whole)) if covered < whole));
        let (posts, _) = crate::methods::squares::of_tin(&dem, &tin);
        assert!(0 < posts && posts < dem.rect().post_count() as u64);
        assert!(tin.vertices.iter().all(|vertex| !dem.rect().has_on_border(vertex.at.post().unwrap())));
    }

    #[test]
    fn peaks_and_pits_are_found_and_a_flat_top_has_one_point_as_a_plateau() {
        let peaks = [Post::new(2, 2), Post::new(2, 7)];
        let pit = Post::new(7, 3);
        let mesa = |post: Post| (6..=8).contains(&post.row) && (6..=8).contains(&post.col);
        let dem = scene::dem(11, 11, |post| match post {
            _ if peaks.contains(&post) => 50,
            _ if post == pit => -50,
            _ if mesa(post) => 40,
            _ => 0,
        });
        let found = highlow(&scene::ground(&dem), Extrema::Strict).unwrap();
        assert_eq!(posts(&found), [peaks[0], peaks[1], pit]);
        let found = highlow(&scene::ground(&dem), Extrema::Plateau).unwrap();
        assert_eq!(posts(&found), [peaks[0], peaks[1], pit, Post::new(7, 7)]);
    }

    #[test]
    fn ground_without_peaks_is_refused_with_the_reason() {
        let dem = scene::dem(20, 20, |post| 3 * post.row);
        let refused = highlow(&scene::ground(&dem), Extrema::Strict).unwrap_err();
        assert_eq!(refused.to_string(), "0 peaks and pits, expected at least 3 that are not on one line");
        assert!(highlow(&scene::ground(&dem), Extrema::Plateau).is_err());
    }
}
