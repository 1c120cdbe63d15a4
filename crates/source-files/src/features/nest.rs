//! Rings that come without saying which lie in which: outer rings with their holes.

use super::clip::{Extent, Vertex, extent_of};

/// Closed rings, each of them nested: its depth is the number of rings that it lies in.
pub(super) struct Nested<R> {
    pub ring: R,
    /// The innermost ring of even depth that it lies in.
    pub inside: Option<usize>,
    pub depth: usize,
}

/// Finds which ring lies in which. Of rings that cross, a vertex decides.
pub(super) fn nested<R>(rings: Vec<R>, vertices: impl Fn(&R) -> &[Vertex]) -> Vec<Nested<R>> {
    let extents: Vec<Extent> = rings.iter().map(|ring| extent_of(vertices(ring))).collect();
    let around = |inner: usize| -> Vec<usize> {
        let is_around = |&outer: &usize| {
            outer != inner
                && extents[outer].contains(&extents[inner])
                && lies_in(vertices(&rings[inner]), vertices(&rings[outer]))
                // Equal rings lie in each other; the later one lies in the earlier.
                && (outer < inner || !lies_in(vertices(&rings[outer]), vertices(&rings[inner])))
        };
        (0..rings.len()).filter(is_around).collect()
    };
    let around: Vec<Vec<usize>> = (0..rings.len()).map(around).collect();
    let depth: Vec<usize> = around.iter().map(Vec::len).collect();
    let rings = rings.into_iter().zip(&around);
    rings
        .map(|(ring, around)| {
            let outer = around.iter().copied().filter(|&outer| depth[outer].is_multiple_of(2));
            let inside = outer.max_by_key(|&outer| depth[outer]);
            Nested { ring, inside, depth: around.len() }
        })
        .collect()
}

/// Polygons of nested rings: those of even depth with those directly in them as holes.
pub(super) fn polygons(rings: Vec<Vec<Vertex>>) -> Vec<Vec<Vec<Vertex>>> {
    let nested = nested(rings, |ring| ring);
    let mut polygons: Vec<(usize, Vec<Vec<Vertex>>)> = Vec::new();
    let mut holes = Vec::new();
    for (index, Nested { ring, inside, depth }) in nested.into_iter().enumerate() {
        match (depth % 2, inside) {
            (1, Some(outer)) => holes.push((outer, ring)),
            _ => polygons.push((index, vec![ring])),
        }
    }
    for (outer, hole) in holes {
        let polygon = polygons.binary_search_by_key(&outer, |(index, _)| *index);
        polygons[polygon.expect("a hole lies in a ring of even depth")].1.push(hole);
    }
    polygons.into_iter().map(|(_, rings)| rings).collect()
}

/// Whether a ring lies in another, by the first of its vertices, or middles of its sides, that is not on the other.
fn lies_in(inner: &[Vertex], outer: &[Vertex]) -> bool {
    let middles = inner.windows(2).map(|pair| [0, 1].map(|axis| (pair[0][axis] + pair[1][axis]) / 2.0));
    let mut places = inner.iter().map(|&[east, north, _]| [east, north]).chain(middles);
    // On the other all along: equal rings.
    places.find_map(|place| side(place, outer)).unwrap_or(true)
}

/// Whether a place lies in a ring; `None` on it.
fn side([east, north]: [f64; 2], ring: &[Vertex]) -> Option<bool> {
    let mut is_inside = false;
    for pair in ring.windows(2) {
        let ([a_east, a_north, _], [b_east, b_north, _]) = (pair[0], pair[1]);
        let turn = (b_east - a_east) * (north - a_north) - (b_north - a_north) * (east - a_east);
        let within = |a: f64, b: f64, place: f64| a.min(b) <= place && place <= a.max(b);
        if turn == 0.0 && within(a_east, b_east, east) && within(a_north, b_north, north) {
            return None;
        }
        if (a_north <= north) != (b_north <= north) && (0.0 < turn) == (a_north < b_north) {
            is_inside = !is_inside;
        }
    }
    Some(is_inside)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square(west: f64, south: f64, side: f64) -> Vec<Vertex> {
        let corners = [[0.0, 0.0], [side, 0.0], [side, side], [0.0, side], [0.0, 0.0]];
        corners.iter().map(|[east, north]| [west + east, south + north, f64::NAN]).collect()
    }

    #[test]
    fn islands_in_lakes_on_islands_are_polygons_of_their_own() {
        let rings = vec![square(4.0, 4.0, 1.0), square(0.0, 0.0, 10.0), square(2.0, 2.0, 6.0), square(20.0, 0.0, 1.0)];
        let sizes: Vec<usize> = polygons(rings).iter().map(Vec::len).collect();
        assert_eq!(sizes, [1, 2, 1], "the island, the lake with its island's shore, and another lake");
    }

    #[test]
    fn rings_that_touch_at_corners_are_nested_by_their_other_places() {
        let inner = [[0.0, 0.0], [10.0, 0.0], [5.0, 5.0], [0.0, 0.0]].map(|[east, north]| [east, north, 0.0]).to_vec();
        assert_eq!(polygons(vec![square(0.0, 0.0, 10.0), inner]).len(), 1);
        let twice = polygons(vec![square(0.0, 0.0, 10.0), square(0.0, 0.0, 10.0)]);
        assert_eq!(twice.iter().map(Vec::len).collect::<Vec<_>>(), [2], "the second of two equal rings is a hole");
    }
}
