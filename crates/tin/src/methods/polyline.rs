//! Douglas and Peucker's simplification of lines, for every tolerance at once.
//!
//! Douglas and Peucker, "Algorithms for the reduction of the number of points required to represent a digitized line"
//! (Cartographica 10, 1973): the point farthest from the chord splits the line, again and again, while it is farther
//! than a tolerance. Which point splits which piece does not depend on the tolerance, so each point has one distance
//! above which it is dropped.

/// A point in metres; plane lines have the same height everywhere.
pub(crate) type Point = [f64; 3];

/// For each point of a line, the tolerance up to which (exclusively) it is kept; ends are always kept. In a closed line
/// the first and last point are equal.
pub(crate) fn tolerances(line: &[Point]) -> Vec<f64> {
    let mut kept_below = vec![f64::INFINITY; line.len()];
    let mut pieces = vec![(0, line.len().saturating_sub(1), f64::INFINITY)];
    while let Some((from, to, above)) = pieces.pop() {
        if to - from < 2 {
            continue;
        }
        let distance = |i: usize| distance_squared(line[i], line[from], line[to]);
        let mut farthest = (from + 1, distance(from + 1));
        for i in from + 2..to {
            let found = distance(i);
            if farthest.1 < found {
                farthest = (i, found);
            }
        }
        // A piece is reached only while the points that made it are kept.
        let own = farthest.1.sqrt().min(above);
        kept_below[farthest.0] = own;
        pieces.push((from, farthest.0, own));
        pieces.push((farthest.0, to, own));
    }
    kept_below
}

/// The squared distance of `p` from the straight piece between `a` and `b`.
fn distance_squared(p: Point, a: Point, b: Point) -> f64 {
    let (along, from) = (minus(b, a), minus(p, a));
    let length = dot(along, along);
    let share = if length == 0.0 { 0.0 } else { (dot(from, along) / length).clamp(0.0, 1.0) };
    let off = minus(from, along.map(|v| v * share));
    dot(off, off)
}

fn minus(a: Point, b: Point) -> Point {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

fn dot(a: Point, b: Point) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The textbook: the indices kept at a tolerance.
    fn simplified(line: &[Point], tolerance: f64, from: usize, to: usize, kept: &mut Vec<usize>) {
        let farthest = (from + 1..to).max_by(|&i, &j| {
            let distance = |i| distance_squared(line[i], line[from], line[to]);
            distance(i).total_cmp(&distance(j)).then(j.cmp(&i))
        });
        let Some(i) = farthest else { return };
        if tolerance < distance_squared(line[i], line[from], line[to]).sqrt() {
            simplified(line, tolerance, from, i, kept);
            kept.push(i);
            simplified(line, tolerance, i, to, kept);
        }
    }

    #[test]
    fn one_pass_keeps_what_the_textbook_keeps_at_every_tolerance() {
        let wave = |i: i32| {
            let x = f64::from(i);
            [x, f64::from(i * i % 17), f64::from(i * 7 % 5)]
        };
        let line: Vec<Point> = (0..60).map(wave).collect();
        let all = tolerances(&line);
        for step in 0..90 {
            let tolerance = f64::from(step) / 7.0;
            let mut kept = Vec::new();
            simplified(&line, tolerance, 0, line.len() - 1, &mut kept);
            let ours: Vec<usize> = (1..line.len() - 1).filter(|&i| tolerance < all[i]).collect();
            assert_eq!(ours, kept, "tolerance {tolerance}");
        }
    }

    #[test]
    fn a_closed_line_and_a_line_of_two_points_keep_their_ends() {
        assert_eq!(tolerances(&[[0.0; 3], [1.0; 3]]), [f64::INFINITY; 2]);
        let square = [[0.0; 3], [4.0, 0.0, 0.0], [4.0, 4.0, 0.0], [0.0, 4.0, 0.0], [0.0; 3]];
        let all = tolerances(&square);
        assert_eq!((all[0], all[4]), (f64::INFINITY, f64::INFINITY));
        assert!(all[2] == 32f64.sqrt() && 2.0 < all[1] && 2.0 < all[3]);
    }
}
