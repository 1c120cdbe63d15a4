//! The canonical Delaunay triangulation of the hole that a removed point leaves.

use terrain::LatticePoint;
use terrain::geometry::{in_circle, orient};

/// Triangles of the hole inside a counter-clockwise ring, as places in the ring.
///
/// The ring is that of an inner point of a canonical Delaunay triangulation, so these are exactly the
/// triangles which that triangulation has there without the point: every new triangle's corners lie on the ring,
/// its circle holds no point at all, and of co-circular points the smallest is the fan's centre.
pub(crate) fn fill(ring: &[LatticePoint]) -> Vec<[usize; 3]> {
    let mut triangles = Vec::with_capacity(ring.len().saturating_sub(2));
    let mut open = vec![(0, ring.len() - 1)];
    // Each entry is a part of the ring and the chord from its end back to its start.
    while let Some((start, end)) = open.pop() {
        if end - start < 2 {
            continue;
        }
        let apex = apex(ring, start, end);
        triangles.push([start, apex, end]);
        open.extend([(start, apex), (apex, end)]);
    }
    triangles
}

/// The corner over the chord from `end` to `start` whose circle holds no other.
fn apex(ring: &[LatticePoint], start: usize, end: usize) -> usize {
    let (a, b) = (ring[end], ring[start]);
    let visible = || (start + 1..end).filter(|&i| 0 < orient(a, b, ring[i]));
    let best = visible().reduce(|best, i| if 0 < in_circle(a, b, ring[best], ring[i]) { i } else { best });
    let best = best.expect("a ring around a point has a corner over every chord");
    // All on that circle, in order from the start of the chord to its end.
    let on_circle: Vec<_> = visible().filter(|&i| i == best || in_circle(a, b, ring[best], ring[i]) == 0).collect();
    let smallest = on_circle.iter().copied().min_by_key(|&i| ring[i]).expect("the best lies on its own circle");
    if ring[smallest] < a.min(b) {
        smallest
    } else if a < b {
        // The fan is centred at the chord's first point: its neighbour triangle ends right after the second.
        on_circle[0]
    } else {
        on_circle[on_circle.len() - 1]
    }
}

#[cfg(test)]
mod tests {
    use fastrand::Rng;
    use std::collections::BTreeSet;

    use terrain::Post;

    use super::*;

    #[test]
    fn filling_a_hole_gives_the_triangulation_without_the_point() {
        for seed in 0..300 {
            let mut draw = Rng::with_seed(seed);
            // Small grids, so that co-circular points are the rule.
            let side = 3 + draw.i32(0..8);
            let share = 3 + draw.u32(..13);
            let corner = |v: i32| v == 0 || v == side;
            let all = (0..=side).flat_map(|row| (0..=side).map(move |col| Post::new(row, col)));
            let points: Vec<LatticePoint> = all
                .filter(|post| corner(post.row) && corner(post.col) || draw.u32(..16) < share)
                .map(LatticePoint::from)
                .collect();
            let triangles = terrain::mesh::delaunay(&points);
            let inner = |at: LatticePoint| !corner(at.row / 8) && !corner(at.col / 8);
            for (v, &point) in points.iter().enumerate().filter(|&(_, &point)| inner(point)) {
                let star: Vec<_> = triangles.iter().filter(|t| t.contains(&(v as u32))).collect();
                let after = |u: u32| {
                    let next = |t: &[u32; 3]| {
                        (0..3).find_map(|i| (t[i] == v as u32 && t[(i + 1) % 3] == u).then(|| t[(i + 2) % 3]))
                    };
                    star.iter().find_map(|t| next(t)).unwrap()
                };
                let first = star[0].iter().copied().find(|&u| u != v as u32).unwrap();
                let mut ring = vec![first];
                while after(ring[ring.len() - 1]) != first {
                    ring.push(after(ring[ring.len() - 1]));
                }
                let ring: Vec<_> = ring.into_iter().map(|u| points[u as usize]).collect();
                let without: Vec<_> = points.iter().copied().filter(|&other| other != point).collect();
                let place = |t: [LatticePoint; 3]| t.into_iter().collect::<BTreeSet<_>>();
                let expected: BTreeSet<_> = terrain::mesh::delaunay(&without)
                    .into_iter()
                    .map(|t| place(t.map(|u| without[u as usize])))
                    .collect();
                let found = fill(&ring);
                assert_eq!(found.len(), ring.len() - 2, "seed {seed}, {point:?}");
                for t in found {
                    let corners = t.map(|i| ring[i]);
                    assert!(0 < orient(corners[0], corners[1], corners[2]), "seed {seed}, {point:?}");
                    assert!(expected.contains(&place(corners)), "seed {seed}, {point:?}: {corners:?}");
                }
            }
        }
    }
}
