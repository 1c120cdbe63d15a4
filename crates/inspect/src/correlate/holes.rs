//! Whether a surface has ground all along the line between two places.

use load_module_reader::{HOLE_CLASS, LoadedGround, TerrainModule};

use super::surface::{Ground, cuts, height_at, in_posts};

/// Whether a surface has ground at both places, each an easting and a northing, and at all places between them.
pub(super) fn has_ground_along(ground: &Ground, pair_m: [[f64; 2]; 2]) -> bool {
    let has_ends = pair_m.iter().all(|place_m| ground.height_m(*place_m).is_some());
    has_ends
        && match ground {
            Ground::Modules(modules) => !crosses_holes(modules, pair_m),
            Ground::Posts(posts) => {
                let Some((from, to)) = in_posts(posts, pair_m[0]).zip(in_posts(posts, pair_m[1])) else { return false };
                // In the middle of a piece all the posts count that count somewhere in it.
                let place = |share: f64| [0, 1].map(|axis| from[axis] + share * (to[axis] - from[axis]));
                let middles = cuts(from, to);
                middles.windows(2).all(|ends| height_at(posts, place(0.5 * (ends[0] + ends[1]))).is_some())
            }
            Ground::None => false,
        }
}

/// Whether a line goes over a triangle that closes a hole.
fn crosses_holes(ground: &LoadedGround, pair_m: [[f64; 2]; 2]) -> bool {
    let frame = ground.frame();
    let ends = pair_m.map(|place_m| frame.module_at(place_m));
    let range = |axis: usize, count: u32| {
        let last = i64::from(count).saturating_sub(1);
        let index = |end: usize| ends[end][axis].clamp(0, last) as u32;
        index(0).min(index(1))..=index(0).max(index(1))
    };
    let per_m = f64::from(frame.side) / frame.side_m();
    let crosses = |row: u32, col: u32| {
        let Some(module) = ground.module(row, col) else { return false };
        let corner = [f64::from(col), f64::from(row)].map(|index| index * f64::from(frame.side));
        let [from, to] =
            pair_m.map(|place_m| [0, 1].map(|axis| (place_m[axis] - frame.origin_m[axis]) * per_m - corner[axis]));
        is_over_a_hole(module, from, to)
    };
    range(0, frame.rows).any(|row| range(1, frame.cols).any(|col| crosses(row, col)))
}

/// Whether a line, in quanta from the south-west corner of a load module, goes over a hole of it.
fn is_over_a_hole(module: &TerrainModule, from: [f64; 2], to: [f64; 2]) -> bool {
    let module = module.module();
    let holes = module.triangles.iter().zip(&module.classes).filter(|(_, class)| **class == HOLE_CLASS);
    let place = |corner: u16| {
        let vertex = module.vertices[usize::from(corner)];
        [f64::from(vertex.x), f64::from(vertex.y)]
    };
    holes.into_iter().any(|(triangle, _)| is_over(triangle.map(place), from, to))
}

/// Whether a line goes over a triangle, whose corners go counter-clockwise, and not only past its edge.
fn is_over(corners: [[f64; 2]; 3], from: [f64; 2], to: [f64; 2]) -> bool {
    let (mut first, mut last) = (0.0_f64, 1.0_f64);
    for (a, b) in [(0, 1), (1, 2), (2, 0)].map(|(a, b)| (corners[a], corners[b])) {
        // How far left of the edge, times its length.
        let left = |place: [f64; 2]| (b[0] - a[0]) * (place[1] - a[1]) - (b[1] - a[1]) * (place[0] - a[0]);
        let (start, end) = (left(from), left(to));
        if start <= 0.0 && end <= 0.0 {
            return false;
        }
        let crossing = start / (start - end);
        if start < 0.0 {
            first = first.max(crossing);
        } else if end < 0.0 {
            last = last.min(crossing);
        }
    }
    first < last
}

#[cfg(test)]
mod tests {
    use build::workbench::PostHeights;

    use super::*;

    #[test]
    fn a_line_is_over_a_triangle_where_some_of_it_lies_inside() {
        let corners = [[0.0, 0.0], [4.0, 0.0], [0.0, 4.0]];
        for (from, to) in [([-1.0, 1.0], [9.0, 1.0]), ([1.0, 1.0], [9.0, 9.0]), ([1.0, 1.0], [1.5, 1.0])] {
            assert!(is_over(corners, from, to) && is_over(corners, to, from), "{from:?} {to:?}");
        }
        // Beside it, ending before it, along an edge, through a corner.
        for (from, to) in [
            ([-1.0, 5.0], [5.0, 5.0]),
            ([-2.0, 1.0], [-1.0, 1.0]),
            ([-1.0, 0.0], [9.0, 0.0]),
            ([-1.0, 1.0], [1.0, -1.0]),
        ] {
            assert!(!is_over(corners, from, to) && !is_over(corners, to, from), "{from:?} {to:?}");
        }
    }

    #[test]
    fn posts_have_ground_along_a_line_unless_a_void_counts_somewhere_on_it() {
        let heights_m = (0..81).map(|index| if index == 4 * 9 + 4 { f32::NAN } else { 0.0 }).collect();
        let posts = PostHeights { south_west_m: [1000.0, 2000.0], spacing_m: [10.0, 20.0], cols: 9, heights_m };
        let ground = Ground::Posts(posts);
        let has = |from: [f64; 2], to: [f64; 2]| has_ground_along(&ground, [from, to]);
        assert!(!has([1000.0, 2080.0], [1080.0, 2080.0]) && !has([1031.0, 2000.0], [1031.0, 2160.0]));
        assert!(has([1000.0, 2060.0], [1080.0, 2060.0]) && has([1030.0, 2000.0], [1030.0, 2160.0]));
        assert!(!has([1000.0, 2060.0], [1090.0, 2060.0]) && !has([1040.0, 2080.0], [1080.0, 2160.0]));
    }
}
