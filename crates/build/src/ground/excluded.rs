//! Polygons in which no vertex may stand.
//!
//! Vertices may come to stand between posts, and what places them asks for the nearest post. So a post is taken when it
//! lies inside, and when the rim passes through the ground that is nearer to it than to any other post.

use terrain::{GridFrame, Post, PostRect, THOUSANDTHS};

/// Ground that counts as nearer to a post than to others, in posts to each side: more than half, since corners of
/// polygons are rounded.
const REACH: f64 = 0.5 + 1.0 / 256.0;
/// No corner lies farther from the grid's origin, in posts; beyond, it is moved in.
const FAR: f64 = 1e9;

/// Where an area lies: what polygons need to be told of it.
pub struct GamingAreaFrame {
    /// Its posts.
    pub rect: PostRect,
    /// Its place.
    pub frame: GridFrame,
}

/// The posts of `rect` that keep vertices out of these polygons, in ascending order.
pub(crate) fn excluded(polygons: &[terrain::mask::Polygon], area: &GamingAreaFrame, rect: PostRect) -> Vec<Post> {
    let mut taken = vec![false; if polygons.is_empty() { 0 } else { rect.post_count() }];
    for polygon in polygons {
        let inside = inside(polygon, area, rect);
        taken.iter_mut().zip(inside).for_each(|(taken, inside)| *taken |= inside);
        for ring in &polygon.rings {
            let next = ring.iter().cycle().skip(1);
            let edges =
                ring.iter().zip(next).map(|(&from, &to)| [from, to].map(|corner| in_posts(corner, &area.frame)));
            edges.for_each(|edge| take_along(edge, rect, &mut taken));
        }
    }
    rect.posts().zip(taken).filter(|(_, taken)| *taken).map(|(post, _)| post).collect()
}

/// Whether each post of a window lies inside a polygon, row-major.
pub(crate) fn inside(polygon: &terrain::mask::Polygon, area: &GamingAreaFrame, rect: PostRect) -> Vec<bool> {
    let shape = terrain::mask::Shape::Polygons(vec![polygon.clone()]);
    let only = terrain::mask::Area { class: "inside".into(), weight: THOUSANDTHS, shape };
    let mask =
        terrain::mask::Mask { default_weight: 0, areas: vec![only], smooth: terrain::Smooth::None, over: Vec::new() };
    let found = terrain::mask::importance(&mask, area.rect, &area.frame, rect);
    rect.posts().map(|post| 0 < found.weight(post)).collect()
}

/// Column and row of a place.
fn in_posts(corner: [f64; 2], frame: &GridFrame) -> [f64; 2] {
    let posts = |metres: f64, origin_m: f64| ((metres - origin_m) / frame.spacing.metres()).clamp(-FAR, FAR);
    [posts(corner[0], frame.origin_east_m), posts(corner[1], frame.origin_north_m)]
}

/// Takes the posts of `rect` through whose ground an edge passes.
fn take_along([from, to]: [[f64; 2]; 2], rect: PostRect, taken: &mut [bool]) {
    let (low, high) = if from[1] <= to[1] { (from, to) } else { (to, from) };
    // Posts whose ground reaches from one number to the other, of those from `first` to `last`.
    let reached = |least: f64, most: f64, first: i32, last: i32| {
        let (least, most) = ((least - REACH).ceil(), (most + REACH).floor());
        (least.max(f64::from(first)) as i32)..=(most.min(f64::from(last)) as i32)
    };
    let rise = high[1] - low[1];
    let col_at = |row: f64| match 0.0 < rise {
        true => low[0] + (high[0] - low[0]) * ((row - low[1]) / rise).clamp(0.0, 1.0),
        false => low[0],
    };
    let wide = rect.posts_wide();
    for row in reached(low[1], high[1], rect.south, rect.north) {
        let middle = f64::from(row);
        let ends = match 0.0 < rise {
            true => [col_at(middle - REACH), col_at(middle + REACH)],
            false => [low[0], high[0]],
        };
        for col in reached(ends[0].min(ends[1]), ends[0].max(ends[1]), rect.west, rect.east) {
            taken[(row - rect.south) as usize * wide + (col - rect.west) as usize] = true;
        }
    }
}

#[cfg(test)]
mod tests {
    use terrain::Spacing;

    use super::*;

    const RECT: PostRect = PostRect { south: 0, west: 0, north: 12, east: 12 };

    fn area() -> GamingAreaFrame {
        let spacing = Spacing::from_metres(10.0).unwrap();
        GamingAreaFrame { rect: RECT, frame: GridFrame { origin_east_m: 0.0, origin_north_m: 0.0, spacing } }
    }

    /// Corners in posts.
    fn of(corners: &[[f64; 2]]) -> Vec<Post> {
        let ring = corners.iter().map(|corner| corner.map(|posts| posts * 10.0)).collect();
        excluded(&[terrain::mask::Polygon { rings: vec![ring] }], &area(), RECT)
    }

    #[test]
    fn posts_inside_and_those_whose_ground_the_rim_crosses_are_taken() {
        let rows = |posts: &[Post]| posts.iter().map(|post| (post.row, post.col)).collect::<Vec<_>>();
        // From 2.4 to 3.6: the posts 2 to 4 reach into it, and no others.
        let square = of(&[[2.4, 2.4], [3.6, 2.4], [3.6, 3.6], [2.4, 3.6]]);
        let expected: Vec<_> = (2..=4).flat_map(|row| (2..=4).map(move |col| (row, col))).collect();
        assert_eq!(rows(&square), expected);
        // A sliver without a post in it.
        let sliver = of(&[[1.0, 5.4], [9.0, 5.4], [9.0, 5.45]]);
        assert_eq!(rows(&sliver), (1..=9).map(|col| (5, col)).collect::<Vec<_>>());
        assert_eq!(of(&[[-80.0, -80.0], [-70.0, -80.0], [-70.0, -70.0]]), []);
    }

    #[test]
    fn no_place_inside_is_nearest_to_a_post_that_is_not_taken() {
        for corners in [
            vec![[1.2, 1.3], [10.7, 2.1], [6.4, 9.9]],
            vec![[0.0, 0.0], [12.0, 0.0], [0.5, 11.0]],
            vec![[-3.0, 5.1], [20.0, 5.9], [20.0, 6.2], [4.0, 6.4], [-3.0, 30.0]],
        ] {
            let taken = of(&corners);
            let ring = corners.iter().map(|corner| corner.map(|posts| posts * 10.0)).collect();
            let polygon = terrain::mask::Polygon { rings: vec![ring] };
            // The same polygon on a grid eight times as fine says which eighths of a post lie inside.
            let spacing = Spacing::from_metres(1.25).unwrap();
            let fine = PostRect { south: 0, west: 0, north: 96, east: 96 };
            let frame = GridFrame { spacing, ..area().frame };
            let inside = inside(&polygon, &GamingAreaFrame { rect: fine, frame }, fine);
            for (place, _) in fine.posts().zip(inside).filter(|(_, inside)| *inside) {
                let nearest = Post::new((place.row + 4) / 8, (place.col + 4) / 8);
                assert!(taken.binary_search(&nearest).is_ok(), "{corners:?}: {place} is nearest to {nearest}");
            }
        }
    }
}
