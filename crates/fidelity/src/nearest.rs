//! The nearest point of a triangle, and of a bilinear cell, in space.

/// A point or a direction, all three in one unit.
pub(crate) type Point = [f64; 3];

pub(crate) fn less(a: Point, b: Point) -> Point {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

pub(crate) fn dot(a: Point, b: Point) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

pub(crate) fn cross(a: Point, b: Point) -> Point {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// Squared distance from a point to a triangle, or anything not below `best` where it is no nearer than that.
pub(crate) fn squared_to_triangle(point: Point, [a, b, c]: [Point; 3], best: f64) -> f64 {
    let normal = cross(less(b, a), less(c, a));
    let above = dot(less(point, a), normal);
    let to_plane = above * above / dot(normal, normal);
    if best <= to_plane {
        return to_plane;
    }
    let inside = |from: Point, to: Point| 0.0 <= dot(cross(less(to, from), less(point, from)), normal);
    if inside(a, b) && inside(b, c) && inside(c, a) {
        return to_plane;
    }
    squared_to_edge(point, a, b).min(squared_to_edge(point, b, c)).min(squared_to_edge(point, c, a))
}

fn squared_to_edge(point: Point, from: Point, to: Point) -> f64 {
    let (along, off) = (less(to, from), less(point, from));
    let share = share_of(dot(off, along), dot(along, along));
    let left = less(off, along.map(|length| share * length));
    dot(left, left)
}

/// How far along a line from 0 to 1 the nearest place lies.
fn share_of(ahead: f64, length_squared: f64) -> f64 {
    if length_squared == 0.0 { 0.0 } else { (ahead / length_squared).clamp(0.0, 1.0) }
}

/// One cell of the DEM: its heights south-west, south-east, north-west, north-east, around a square with sides of
/// `side` whose south-west corner is `corner`, bilinear in between.
pub(crate) struct BilinearCell {
    pub corner: [f64; 2],
    pub side: f64,
    pub heights: [f64; 4],
}

impl BilinearCell {
    /// Squared distance from a point, at most by rounding and by a millionth too large.
    ///
    /// For a fixed northing the cell is a straight line, for a fixed easting too; so the nearest place on the one and
    /// on the other in turn comes ever nearer.
    pub fn squared_to(&self, point: Point) -> f64 {
        const ROUNDS_MAX: u32 = 64;
        const SETTLED: f64 = 1e-9;
        let start = [0, 1].map(|axis| ((point[axis] - self.corner[axis]) / self.side).clamp(0.0, 1.0));
        let mut at = start;
        for _ in 0..ROUNDS_MAX {
            let before = at;
            at[0] = self.nearest_share(point, [0.0, at[1]], [1.0, at[1]]);
            at[1] = self.nearest_share(point, [at[0], 0.0], [at[0], 1.0]);
            if (at[0] - before[0]).abs() + (at[1] - before[1]).abs() < SETTLED {
                break;
            }
        }
        let left = less(point, self.place(at));
        dot(left, left)
    }

    fn nearest_share(&self, point: Point, from: [f64; 2], to: [f64; 2]) -> f64 {
        let from = self.place(from);
        let along = less(self.place(to), from);
        share_of(dot(less(point, from), along), dot(along, along))
    }

    fn place(&self, [x, y]: [f64; 2]) -> Point {
        let [south_west, south_east, north_west, north_east] = self.heights;
        let south = south_west + x * (south_east - south_west);
        let north = north_west + x * (north_east - north_west);
        [self.corner[0] + x * self.side, self.corner[1] + y * self.side, south + y * (north - south)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sight::Draw;

    fn point(draw: &mut Draw, size: f64) -> Point {
        [0; 3].map(|_| size * (draw.unit() - 0.5))
    }

    #[test]
    fn a_triangle_is_as_near_as_its_nearest_place() {
        let draw = &mut Draw::new(3, 3);
        for _ in 0..300 {
            let corners = [point(draw, 10.0), point(draw, 10.0), point(draw, 10.0)];
            let from = point(draw, 20.0);
            let found = squared_to_triangle(from, corners, f64::INFINITY).sqrt();
            let steps = 60;
            let mut nearest = f64::INFINITY;
            for i in 0..=steps {
                for j in 0..=steps - i {
                    let (u, v) = (f64::from(i) / f64::from(steps), f64::from(j) / f64::from(steps));
                    let place = [0, 1, 2].map(|k| {
                        corners[0][k] + u * (corners[1][k] - corners[0][k]) + v * (corners[2][k] - corners[0][k])
                    });
                    let left = less(from, place);
                    nearest = nearest.min(dot(left, left).sqrt());
                }
            }
            assert!(found <= nearest + 1e-9 && nearest < found + 0.25, "{found}, by steps {nearest}");
            // With a bound it is the same below, and not below the bound otherwise.
            for bound in [found * found * 0.9, found * found * 1.1] {
                let bounded = squared_to_triangle(from, corners, bound);
                assert!(if bounded < bound { (bounded.sqrt() - found).abs() < 1e-9 } else { bound <= bounded });
            }
        }
    }

    #[test]
    fn a_bilinear_cell_is_as_near_as_its_nearest_place() {
        let draw = &mut Draw::new(4, 4);
        for _ in 0..300 {
            let heights = [0; 4].map(|_| 8.0 * draw.unit());
            let cell = BilinearCell { corner: [2.0, -3.0], side: 5.0, heights };
            let [x, y, z] = point(draw, 8.0);
            let from = [x + 4.5, y - 0.5, z + 4.0];
            let found = cell.squared_to(from).sqrt();
            let places = (0..=80).flat_map(|i| (0..=80).map(move |j| [f64::from(i) / 80.0, f64::from(j) / 80.0]));
            let nearest = places
                .map(|at| less(from, cell.place(at)))
                .map(|left| dot(left, left).sqrt())
                .fold(f64::INFINITY, f64::min);
            // A warped cell may have two places that are nearest around them.
            assert!(found <= nearest + 0.05 && nearest < found + 0.15, "{found}, by steps {nearest}");
        }
    }
}
