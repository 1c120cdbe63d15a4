//! Heights and lines of sight between the posts of a raster, which is bilinear in every cell.

use build::workbench::PostHeights;

/// Metres by which a line may touch the ground.
const ROUNDING_M: f64 = 1e-6;

/// Height at a place, an easting and a northing, in metres; `None` outside, and where a post that counts is void.
pub(super) fn height_m(posts: &PostHeights, place_m: [f64; 2]) -> Option<f64> {
    in_posts(posts, place_m).and_then(|place| height_at(posts, place))
}

/// Whether nothing of the raster stands between two places, each an easting, a northing and a height; `None` where the
/// line leaves it, or goes over a void.
///
/// In a cell the ground under a line is a parabola. The line is cut wherever it crosses a row or a column of posts, so
/// that each piece lies in one cell, and the parabola through its ends and its middle is looked at where it is highest.
pub(super) fn is_free(posts: &PostHeights, from_m: [f64; 3], to_m: [f64; 3]) -> Option<bool> {
    let from = in_posts(posts, [from_m[0], from_m[1]])?;
    let to = in_posts(posts, [to_m[0], to_m[1]])?;
    let mut cuts = vec![0.0, 1.0];
    for axis in 0..2 {
        let (low, high) = (from[axis].min(to[axis]), from[axis].max(to[axis]));
        let lines = (low.ceil() as i64)..=(high.floor() as i64);
        cuts.extend(lines.map(|line| (line as f64 - from[axis]) / (to[axis] - from[axis])));
    }
    // Ends on a line of posts divide by nothing.
    cuts.retain(|cut| (0.0..=1.0).contains(cut));
    cuts.sort_by(f64::total_cmp);
    let above = |share: f64| {
        let place = [0, 1].map(|axis| from[axis] + share * (to[axis] - from[axis]));
        height_at(posts, place).map(|height_m| height_m - (from_m[2] + share * (to_m[2] - from_m[2])))
    };
    let mut start = above(0.0)?;
    for ends in cuts.windows(2).filter(|ends| ends[0] < ends[1]) {
        let (middle, end) = (above(0.5 * (ends[0] + ends[1]))?, above(ends[1])?);
        if ROUNDING_M < highest(start, middle, end) {
            return Some(false);
        }
        start = end;
    }
    Some(true)
}

/// The highest value of the parabola through three values at 0, one half and 1, between 0 and 1.
fn highest(start: f64, middle: f64, end: f64) -> f64 {
    let (bend, rise) = (2.0 * (start - 2.0 * middle + end), 4.0 * middle - 3.0 * start - end);
    let ends = start.max(end);
    let top = -rise / (2.0 * bend);
    if bend < 0.0 && 0.0 < top && top < 1.0 { ends.max(start + rise * top + bend * top * top) } else { ends }
}

/// A place counted in posts from the south-west one, east then north; `None` outside.
fn in_posts(posts: &PostHeights, place_m: [f64; 2]) -> Option<[f64; 2]> {
    let rows = posts.heights_m.len() / posts.cols;
    let place = [0, 1].map(|axis| (place_m[axis] - posts.south_west_m[axis]) / posts.spacing_m[axis]);
    let is_inside = |at: f64, count: usize| (0.0..=(count - 1) as f64).contains(&at);
    (is_inside(place[0], posts.cols) && is_inside(place[1], rows)).then_some(place)
}

/// Height at a place in posts; `None` where a post that counts is void.
fn height_at(posts: &PostHeights, place: [f64; 2]) -> Option<f64> {
    let rows = posts.heights_m.len() / posts.cols;
    let first = |at: f64, count: usize| (at.max(0.0) as usize).min(count.saturating_sub(2));
    let (col, row) = (first(place[0], posts.cols), first(place[1], rows));
    let (x, y) = ((place[0] - col as f64).clamp(0.0, 1.0), (place[1] - row as f64).clamp(0.0, 1.0));
    let mut height_m = 0.0;
    for (dx, dy, share) in [(0, 0, (1.0 - x) * (1.0 - y)), (1, 0, x * (1.0 - y)), (0, 1, (1.0 - x) * y), (1, 1, x * y)]
    {
        if share != 0.0 {
            height_m += share * f64::from(posts.heights_m[(row + dy) * posts.cols + col + dx]);
        }
    }
    (!height_m.is_nan()).then_some(height_m)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn posts(cols: usize, rows: usize, height_m: impl Fn(usize, usize) -> f32) -> PostHeights {
        let heights_m =
            (0..rows).flat_map(|row| (0..cols).map(move |col| (row, col))).map(|(row, col)| height_m(row, col));
        PostHeights { south_west_m: [1000.0, 2000.0], spacing_m: [10.0, 20.0], cols, heights_m: heights_m.collect() }
    }

    #[test]
    fn heights_are_bilinear_and_none_beside_voids_and_outside() {
        let posts = posts(4, 3, |row, col| if (row, col) == (2, 3) { f32::NAN } else { (row * 100 + col) as f32 });
        assert_eq!(height_m(&posts, [1000.0, 2000.0]), Some(0.0));
        assert_eq!(height_m(&posts, [1015.0, 2010.0]), Some(51.5));
        assert_eq!(height_m(&posts, [1030.0, 2020.0]), Some(103.0));
        assert_eq!(height_m(&posts, [1025.0, 2021.0]), None);
        assert_eq!(height_m(&posts, [1030.0, 2040.0]), None);
        assert_eq!(height_m(&posts, [1020.0, 2040.0]), Some(202.0));
        assert_eq!(height_m(&posts, [999.9, 2000.0]), None);
        assert_eq!(height_m(&posts, [1000.0, f64::NAN]), None);
    }

    #[test]
    fn a_line_is_hidden_exactly_where_many_looks_find_ground_above_it() {
        let mut dice = fidelity::Draw::new(5, 0);
        let rough: Vec<f32> = (0..400).map(|_| (30.0 * dice.unit()) as f32).collect();
        let posts = posts(20, 20, |row, col| rough[row * 20 + col]);
        let (mut seen, mut hidden) = (0, 0);
        for index in 0..2000 {
            let pair = fidelity::Draw::new(6, index).pair([190.0, 380.0], [5.0, 60.0]).unwrap();
            let [from, to] = pair.map(|[x, y]| {
                let place = [1000.0 + x, 2000.0 + y];
                [place[0], place[1], height_m(&posts, place).unwrap() + 4.0]
            });
            let most = (0..=4000).map(|step| {
                let share = f64::from(step) / 4000.0;
                let place = [0, 1, 2].map(|axis| from[axis] + share * (to[axis] - from[axis]));
                height_m(&posts, [place[0], place[1]]).unwrap() - place[2]
            });
            let most = most.fold(f64::NEG_INFINITY, f64::max);
            let is_seen = is_free(&posts, from, to).unwrap();
            // Looks between which the ground just touches the line decide nothing.
            if 1e-4 < most.abs() {
                assert_eq!(is_seen, most < 0.0, "pair {index}");
            }
            *(if is_seen { &mut seen } else { &mut hidden }) += 1;
        }
        assert!(200 < seen && 200 < hidden, "{seen} {hidden}");
    }

    #[test]
    fn a_line_over_a_void_is_unknown() {
        let posts = posts(9, 9, |row, col| if (row, col) == (4, 4) { f32::NAN } else { 0.0 });
        assert_eq!(is_free(&posts, [1000.0, 2080.0, 5.0], [1080.0, 2080.0, 5.0]), None);
        assert_eq!(is_free(&posts, [1000.0, 2020.0, 5.0], [1080.0, 2020.0, 5.0]), Some(true));
        assert_eq!(is_free(&posts, [1000.0, 2020.0, 5.0], [1090.0, 2020.0, 5.0]), None);
    }
}
