//! Triangles that cover a plan, for roofs and woods.

use i_triangle::i_overlay::i_float::int::point::IntPoint;
use i_triangle::int::triangulatable::IntTriangulatable;

/// Places and triangles, counter-clockwise, that cover a plan exactly once: its outer ring counter-clockwise, then
/// holes clockwise, in whole quanta. Places of several triangles are there once.
pub fn plan_triangles(rings: &[Vec<[i32; 2]>]) -> (Vec<[i32; 2]>, Vec<[u32; 3]>) {
    let points = |ring: &Vec<[i32; 2]>| ring.iter().map(|&[x, y]| IntPoint::new(x, y)).collect();
    let shape: Vec<Vec<IntPoint<i32>>> = rings.iter().map(points).collect();
    let made = shape.triangulate().to_triangulation::<u32>();
    (made.points.iter().map(|at| [at.x, at.y]).collect(), made.indices.as_chunks().0.to_vec())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn triangles_cover_a_plan_with_a_hole_once() {
        let outer = vec![[0, 0], [100, 0], [100, 100], [50, 20], [0, 100]];
        let hole = vec![[10, 10], [10, 20], [20, 20], [20, 10]];
        let (places, triangles) = plan_triangles(&[outer, hole]);
        let doubled = |[a, b, c]: [u32; 3]| {
            let [a, b, c] = [a, b, c].map(|at| places[at as usize]);
            (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
        };
        assert!(triangles.iter().all(|&triangle| 0 < doubled(triangle)));
        assert_eq!(triangles.iter().map(|&triangle| doubled(triangle)).sum::<i32>(), 2 * (10_000 - 4_000 - 100));
    }
}
