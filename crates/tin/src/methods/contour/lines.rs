//! Contour lines by marching squares.
//!
//! A line crosses an edge between neighbouring posts of which one is at its level or above and the other below, so
//! every edge is crossed at most once a level, and each cell joins its crossings in pairs.

use std::collections::HashMap;

use terrain::{Dem, Post};

/// One contour line; closed when its ends are equal.
pub struct Line {
    /// Its height in quanta.
    pub level: i32,
    /// Its points in order.
    pub points: Vec<Point>,
}

/// Where a line crosses an edge between two posts.
#[derive(Clone, Copy)]
pub struct Point {
    /// Rows from the southern edge.
    pub row: f64,
    /// Columns from the western edge.
    pub col: f64,
    /// The nearer of the two posts.
    pub nearest: Post,
}

/// An edge between neighbouring posts: its south-western post, and whether it runs north.
type Edge = (Post, bool);

/// Levels `interval` quanta apart, counted from one at `from`.
#[derive(Clone, Copy)]
pub struct Levels {
    /// Where one of them is.
    pub from: i32,
    /// How far apart they are.
    pub interval: i32,
}

/// Contours at all `levels`, lowest first; of one level, lines that end at the border first.
pub fn contours(dem: &Dem, levels: Levels) -> Vec<Line> {
    let mut segments = segments(dem, levels);
    segments.sort_by_key(|segment| segment.0);
    segments.chunk_by(|a, b| a.0 == b.0).flat_map(|level| join(dem, level)).collect()
}

fn segments(dem: &Dem, Levels { from, interval }: Levels) -> Vec<(i32, [Edge; 2])> {
    let rect = dem.rect();
    let mut found = Vec::new();
    for row in rect.south..rect.north {
        for col in rect.west..rect.east {
            let corners = [(0, 0), (0, 1), (1, 1), (1, 0)].map(|(r, c)| Post::new(row + r, col + c));
            let heights = corners.map(|post| dem.height(post));
            let (low, high) = (heights.into_iter().min(), heights.into_iter().max());
            let (Some(low), Some(high)) = (low, high) else { continue };
            // Levels above the lowest, up to the highest.
            for step in (low - from).div_euclid(interval) + 1..=(high - from).div_euclid(interval) {
                cell(corners, heights, from + step * interval, &mut found);
            }
        }
    }
    found
}

fn cell(corners: [Post; 4], heights: [i32; 4], level: i32, found: &mut Vec<(i32, [Edge; 2])>) {
    let [sw, se, _, nw] = corners;
    // South, east, north, west, each between two corners that follow each other.
    let edges: [Edge; 4] = [(sw, false), (se, true), (nw, false), (sw, true)];
    let above = heights.map(|height| level <= height);
    let crossed: Vec<usize> = (0..4).filter(|&i| above[i] != above[(i + 1) % 4]).collect();
    match crossed[..] {
        [a, b] => found.push((level, [edges[a], edges[b]])),
        [_, _, _, _] => {
            // A saddle: its middle says which corners are joined.
            let sum: i64 = heights.iter().map(|&height| i64::from(height)).sum();
            let middle = 4 * i64::from(level) <= sum;
            // Cut off the corners that the middle does not side with.
            let pairs = if above[0] == middle { [[0, 1], [2, 3]] } else { [[3, 0], [1, 2]] };
            found.extend(pairs.map(|[a, b]| (level, [edges[a], edges[b]])));
        }
        _ => {}
    }
}

/// Lines of one level from its segments.
fn join(dem: &Dem, segments: &[(i32, [Edge; 2])]) -> Vec<Line> {
    let mut at: HashMap<Edge, Vec<usize>> = HashMap::new();
    for (index, (_, edges)) in segments.iter().enumerate() {
        edges.iter().for_each(|&edge| at.entry(edge).or_default().push(index));
    }
    let mut used = vec![false; segments.len()];
    let mut lines = Vec::new();
    let is_end = |edge: &Edge| at[edge].len() == 1;
    let open = (0..segments.len()).filter_map(|i| segments[i].1.into_iter().find(is_end).map(|edge| (i, edge)));
    let closed = (0..segments.len()).map(|i| (i, segments[i].1[0]));
    for (start, edge) in open.chain(closed) {
        if used[start] {
            continue;
        }
        let level = segments[start].0;
        let mut points = vec![crossing(dem, edge, level)];
        let (mut segment, mut edge) = (start, edge);
        loop {
            used[segment] = true;
            let [a, b] = segments[segment].1;
            edge = if a == edge { b } else { a };
            points.push(crossing(dem, edge, level));
            let Some(&next) = at[&edge].iter().find(|&&next| !used[next]) else { break };
            segment = next;
        }
        lines.push(Line { level, points });
    }
    lines
}

fn crossing(dem: &Dem, (from, north): Edge, level: i32) -> Point {
    let to = if north { Post::new(from.row + 1, from.col) } else { Post::new(from.row, from.col + 1) };
    let (a, b) = (f64::from(dem.height(from)), f64::from(dem.height(to)));
    let share = (f64::from(level) - a) / (b - a);
    let along = |is_along: bool| if is_along { share } else { 0.0 };
    Point {
        row: f64::from(from.row) + along(north),
        col: f64::from(from.col) + along(!north),
        nearest: if share <= 0.5 { from } else { to },
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::methods::scene;

    #[test]
    fn a_slope_has_one_straight_line_a_level_from_border_to_border() {
        let dem = scene::dem(11, 11, |post| 10 * post.row + 5);
        let all = contours(&dem, Levels { from: 0, interval: 20 });
        assert_eq!(all.iter().map(|line| line.level).collect::<Vec<_>>(), [20, 40, 60, 80, 100]);
        for line in &all {
            assert_eq!(line.points.len(), 11);
            assert!(line.points.iter().all(|point| point.row * 10.0 + 5.0 == f64::from(line.level)));
        }
    }

    #[test]
    fn a_hill_has_closed_lines_and_a_saddle_does_not_tangle_them() {
        let dem = scene::dem(21, 21, |post| 100 - (post.row - 10).pow(2) - (post.col - 10).pow(2));
        let all = contours(&dem, Levels { from: 0, interval: 30 });
        let ends = |line: &Line| {
            let [first, last] = [line.points[0], line.points[line.points.len() - 1]];
            (first.row, first.col) == (last.row, last.col)
        };
        assert!(all.iter().filter(|line| 10 <= line.level).all(ends));
        let saddle =
            scene::dem(3, 3, |post| [[0, 10, 0], [10, 0, 10], [0, 10, 0]][post.row as usize][post.col as usize]);
        let points: usize = contours(&saddle, Levels { from: 0, interval: 5 })
            .iter()
            .filter(|line| line.level == 5)
            .map(|line| line.points.len() - 1)
            .sum();
        assert_eq!(points, 8, "two pieces in each of four cells");
    }
}
