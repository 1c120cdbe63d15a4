//! Lines and rings cut at the sides of a rectangle.
//!
//! A cut is computed from its segment in one direction, whichever way the segment is digitised, and one of its
//! coordinates is exactly that of the side; so equal segments of two features are cut at equal places.

/// A place and its height; the height is NaN where there is none.
pub(crate) type Vertex = [f64; 3];

/// A rectangle: of places in some coordinate system, both sides of each axis included.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Extent {
    /// Least and greatest easting or longitude.
    pub east: [f64; 2],
    /// Least and greatest northing or latitude.
    pub north: [f64; 2],
}

impl Extent {
    /// Everywhere.
    pub(super) const ALL: Self =
        Self { east: [f64::NEG_INFINITY, f64::INFINITY], north: [f64::NEG_INFINITY, f64::INFINITY] };
    /// Nowhere: what grows from it holds what it was grown by.
    pub(super) const NOTHING: Self =
        Self { east: [f64::INFINITY, f64::NEG_INFINITY], north: [f64::INFINITY, f64::NEG_INFINITY] };

    /// The rectangle with `by` more on each side.
    pub(crate) fn grown(&self, by: f64) -> Self {
        Self { east: [self.east[0] - by, self.east[1] + by], north: [self.north[0] - by, self.north[1] + by] }
    }

    /// Whether nothing lies in it.
    pub(crate) fn is_empty(&self) -> bool {
        !(self.east[0] <= self.east[1] && self.north[0] <= self.north[1])
    }

    pub(super) fn around(places: impl IntoIterator<Item = [f64; 2]>) -> Self {
        let mut extent = Self::NOTHING;
        places.into_iter().for_each(|place| extent.hold(place));
        extent
    }

    /// Grows until the place lies in it.
    pub(super) fn hold(&mut self, [east, north]: [f64; 2]) {
        self.east = [self.east[0].min(east), self.east[1].max(east)];
        self.north = [self.north[0].min(north), self.north[1].max(north)];
    }

    pub(super) fn holds(&self, [east, north]: [f64; 2]) -> bool {
        self.east[0] <= east && east <= self.east[1] && self.north[0] <= north && north <= self.north[1]
    }

    pub(super) fn meets(&self, other: &Self) -> bool {
        let meet = |a: [f64; 2], b: [f64; 2]| a[0] <= b[1] && b[0] <= a[1];
        meet(self.east, other.east) && meet(self.north, other.north)
    }

    pub(super) fn contains(&self, other: &Self) -> bool {
        self.holds([other.east[0], other.north[0]]) && self.holds([other.east[1], other.north[1]])
    }

    /// Its sides: axis, place on the axis, and whether what lies beyond is greater.
    fn sides(&self) -> [(usize, f64, bool); 4] {
        [(0, self.east[0], false), (0, self.east[1], true), (1, self.north[0], false), (1, self.north[1], true)]
    }
}

pub(super) fn extent_of(vertices: &[Vertex]) -> Extent {
    Extent::around(vertices.iter().map(|&[east, north, _]| [east, north]))
}

/// The pieces of a line inside a rectangle. A piece that only touches it is none.
pub(super) fn line(vertices: Vec<Vertex>, to: &Extent) -> Vec<Vec<Vertex>> {
    let extent = extent_of(&vertices);
    if to.contains(&extent) {
        return vec![vertices];
    }
    let mut pieces: Vec<Vec<Vertex>> = Vec::new();
    if !to.meets(&extent) {
        return pieces;
    }
    let mut is_open = false;
    for pair in vertices.windows(2) {
        let Some([from, until]) = segment(pair[0], pair[1], to) else {
            is_open = false;
            continue;
        };
        match pieces.last_mut().filter(|piece| is_open && piece.last().is_some_and(|last| same(last, &from))) {
            Some(piece) => piece.push(until),
            None => pieces.push(vec![from, until]),
        }
        is_open = same(&until, &pair[1]);
    }
    pieces
}

/// Places alone tell whether a piece goes on: a height that is not there equals none.
fn same(a: &Vertex, b: &Vertex) -> bool {
    a[..2] == b[..2]
}

/// The part of a segment inside a rectangle (Liang and Barsky).
fn segment(a: Vertex, b: Vertex, to: &Extent) -> Option<[Vertex; 2]> {
    if b[..2] < a[..2] {
        return segment(b, a, to).map(|[from, until]| [until, from]);
    }
    let (mut first, mut last) = ((0.0, None), (1.0, None));
    for (axis, at, beyond_is_greater) in to.sides() {
        let (step, room) = (b[axis] - a[axis], at - a[axis]);
        let (step, room) = if beyond_is_greater { (step, room) } else { (-step, -room) };
        // step: how far the segment goes outwards; room: how far it may.
        if step == 0.0 {
            if room < 0.0 {
                return None;
            }
        } else {
            let share = room / step;
            if 0.0 < step && share < last.0 {
                last = (share, Some((axis, at)));
            } else if step < 0.0 && first.0 < share {
                first = (share, Some((axis, at)));
            }
        }
    }
    // Equal shares of a segment of some length are a touch; a repeated place is kept as it is.
    if last.0 < first.0 || (last.0 == first.0 && (first.1.is_some() || last.1.is_some())) {
        return None;
    }
    let place = |(share, side): (f64, Option<(usize, f64)>), end: Vertex| match side {
        None => end,
        Some((axis, at)) => cut(a, b, share, axis, at),
    };
    Some([place(first, a), place(last, b)])
}

fn cut(a: Vertex, b: Vertex, share: f64, axis: usize, at: f64) -> Vertex {
    let mut place = [0, 1, 2].map(|axis| a[axis] + share * (b[axis] - a[axis]));
    place[axis] = at;
    place
}

/// What of a closed ring lies inside a rectangle, closed along its sides (Sutherland and Hodgman); `None` where
/// nothing does. Parts that hang together only outside are joined along the sides.
pub(super) fn ring(mut vertices: Vec<Vertex>, to: &Extent) -> Option<Vec<Vertex>> {
    let extent = extent_of(&vertices);
    if to.contains(&extent) {
        return Some(vertices);
    }
    if !to.meets(&extent) {
        return None;
    }
    vertices.pop();
    for (axis, at, beyond_is_greater) in to.sides() {
        let is_inside = |vertex: &Vertex| if beyond_is_greater { vertex[axis] <= at } else { at <= vertex[axis] };
        let mut kept = Vec::with_capacity(vertices.len());
        for (index, &vertex) in vertices.iter().enumerate() {
            let before = vertices[(index + vertices.len() - 1) % vertices.len()];
            if is_inside(&before) != is_inside(&vertex) {
                let (a, b) = if vertex[..2] < before[..2] { (vertex, before) } else { (before, vertex) };
                kept.push(cut(a, b, (at - a[axis]) / (b[axis] - a[axis]), axis, at));
            }
            if is_inside(&vertex) {
                kept.push(vertex);
            }
        }
        vertices = kept;
    }
    let [first, _, _, ..] = vertices[..] else { return None };
    vertices.push(first);
    Some(vertices)
}

#[cfg(test)]
mod tests {
    use super::*;

    const BOX: Extent = Extent { east: [0.0, 10.0], north: [0.0, 10.0] };

    fn flat(places: &[[f64; 2]]) -> Vec<Vertex> {
        places.iter().map(|&[east, north]| [east, north, 1.0]).collect()
    }

    #[track_caller]
    fn check_line(places: &[[f64; 2]], expected: &[&[[f64; 2]]]) {
        let expected: Vec<_> = expected.iter().map(|piece| flat(piece)).collect();
        assert_eq!(line(flat(places), &BOX), expected);
        let reversed: Vec<_> = places.iter().rev().copied().collect();
        let turned: Vec<Vec<_>> = expected.iter().rev().map(|piece| piece.iter().rev().copied().collect()).collect();
        assert_eq!(line(flat(&reversed), &BOX), turned, "the other way round");
    }

    #[test]
    fn a_line_is_cut_at_the_sides_and_keeps_every_place_inside() {
        check_line(&[[1.0, 1.0], [2.0, 3.0]], &[&[[1.0, 1.0], [2.0, 3.0]]]);
        check_line(&[[-5.0, 5.0], [5.0, 5.0], [15.0, 5.0]], &[&[[0.0, 5.0], [5.0, 5.0], [10.0, 5.0]]]);
        check_line(&[[-5.0, 5.0], [15.0, 5.0]], &[&[[0.0, 5.0], [10.0, 5.0]]]);
        let twice = [[5.0, 5.0], [15.0, 5.0], [15.0, 7.0], [5.0, 7.0]];
        check_line(&twice, &[&[[5.0, 5.0], [10.0, 5.0]], &[[10.0, 7.0], [5.0, 7.0]]]);
        check_line(
            &[[1.0, 1.0], [1.0, 1.0], [2.0, 2.0], [11.0, 2.0]],
            &[&[[1.0, 1.0], [1.0, 1.0], [2.0, 2.0], [10.0, 2.0]]],
        );
    }

    #[test]
    fn a_line_that_only_touches_a_side_or_passes_by_is_gone() {
        check_line(&[[-5.0, 5.0], [-1.0, 20.0]], &[]);
        check_line(&[[-5.0, 5.0], [5.0, -5.0]], &[]);
        check_line(&[[-5.0, 10.0], [0.0, 5.0], [-5.0, 0.0]], &[]);
        check_line(&[[-5.0, -1.0], [50.0, -1.0]], &[]);
    }

    #[test]
    fn heights_that_are_not_numbers_do_not_break_a_line() {
        let vertices = vec![[1.0, 1.0, f64::NAN], [2.0, 2.0, f64::NAN], [20.0, 2.0, 5.0]];
        let pieces = line(vertices, &BOX);
        assert_eq!((pieces.len(), pieces[0].len()), (1, 3));
        assert_eq!(pieces[0][2][..2], [10.0, 2.0]);
    }

    #[test]
    fn a_cut_has_the_height_between_its_ends() {
        let pieces = line(vec![[5.0, 5.0, 10.0], [15.0, 5.0, 20.0]], &BOX);
        assert_eq!(pieces[0][1], [10.0, 5.0, 15.0]);
    }

    #[test]
    fn a_ring_is_closed_along_the_sides() {
        let square = [[5.0, 5.0], [15.0, 5.0], [15.0, 8.0], [5.0, 8.0], [5.0, 5.0]];
        let cut = ring(flat(&square), &BOX).unwrap();
        assert_eq!(cut.first(), cut.last());
        let area: f64 = cut.windows(2).map(|pair| pair[0][0] * pair[1][1] - pair[1][0] * pair[0][1]).sum();
        assert_eq!(area, 30.0);
        let around = [[-5.0, -5.0], [15.0, -5.0], [15.0, 15.0], [-5.0, 15.0], [-5.0, -5.0]];
        let area = |ring: &[Vertex]| ring.windows(2).map(|p| p[0][0] * p[1][1] - p[1][0] * p[0][1]).sum::<f64>();
        assert_eq!(area(&ring(flat(&around), &BOX).unwrap()), 200.0);
        assert_eq!(ring(flat(&[[20.0, 0.0], [30.0, 0.0], [30.0, 9.0], [20.0, 0.0]]), &BOX), None);
    }
}
