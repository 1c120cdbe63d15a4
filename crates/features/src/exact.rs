//! Exact questions about segments on the feature lattice: where two cross, which pixels one runs through.
//!
//! A pixel is the square of one step around a place, its southern and western side inside, the others not: so every
//! point of the plane lies in one pixel.

use crate::Place;
use crate::place::turn;

/// A segment between two places.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Segment {
    /// Its first end.
    pub a: Place,
    /// Its last end.
    pub b: Place,
}

impl Segment {
    /// The segment with its lesser end first, so that both directions are one.
    pub fn canonical(self) -> Self {
        if self.b < self.a { Self { a: self.b, b: self.a } } else { self }
    }

    /// Whether its closed box touches that of `other`.
    pub fn box_touches(&self, other: &Segment) -> bool {
        let apart = |a: i32, b: i32, c: i32, d: i32| a.max(b) < c.min(d) || c.max(d) < a.min(b);
        !apart(self.a.col, self.b.col, other.a.col, other.b.col)
            && !apart(self.a.row, self.b.row, other.a.row, other.b.row)
    }

    /// Whether `place` lies on it, its ends included.
    pub fn holds(&self, place: Place) -> bool {
        turn(self.a, self.b, place) == 0 && self.box_touches(&Segment { a: place, b: place })
    }

    /// The place at `numerator / denominator` of the way from `a` to `b`, rounded half up; the denominator positive.
    pub fn at(&self, numerator: i128, denominator: i128) -> Place {
        let [east, north] = self.a.to(self.b);
        let rounded = |start: i32, length: i64| {
            let doubled = 2 * (i128::from(start) * denominator + i128::from(length) * numerator) + denominator;
            doubled.div_euclid(2 * denominator) as i32
        };
        Place::new(rounded(self.a.row, north), rounded(self.a.col, east))
    }

    /// The pixel in which two segments cross, where they have one point in common that is inside both or an end of
    /// one. Segments that lie on one line have none: their ends say all about them.
    pub fn crossing(&self, other: &Segment) -> Option<Place> {
        if !self.box_touches(other) {
            return None;
        }
        let (c, d) = (turn(self.a, self.b, other.a), turn(self.a, self.b, other.b));
        if (0 < c && 0 < d) || (c < 0 && d < 0) || (c == 0 && d == 0) {
            return None;
        }
        let (a, b) = (turn(other.a, other.b, self.a), turn(other.a, other.b, self.b));
        if (0 < a && 0 < b) || (a < 0 && b < 0) {
            return None;
        }
        let (numerator, denominator) = (i128::from(a), i128::from(a) - i128::from(b));
        let sign = denominator.signum();
        Some(self.at(sign * numerator, sign * denominator))
    }

    /// Whether it runs through the pixel of `place`.
    pub fn runs_through(&self, place: Place) -> bool {
        if self.a == place || self.b == place {
            return true;
        }
        // Most places that are asked for lie beside its box.
        let aside = |a: i32, b: i32, at: i32| at < a.min(b) || a.max(b) < at;
        if aside(self.a.row, self.b.row, place.row) || aside(self.a.col, self.b.col, place.col) {
            return false;
        }
        let [east, north] = self.a.to(self.b);
        let [to_east, to_north] = self.a.to(place);
        // In half steps, so that the sides of a pixel are whole numbers.
        let mut part = Part::WHOLE;
        part.cut(2 * east, 2 * to_east - 1, 2 * to_east + 1)
            && part.cut(2 * north, 2 * to_north - 1, 2 * to_north + 1)
            && part.is_some()
    }
}

/// A fraction with a positive denominator.
#[derive(Clone, Copy)]
struct Fraction(i64, i64);

impl Fraction {
    fn less_than(self, other: Fraction) -> bool {
        i128::from(self.0) * i128::from(other.1) < i128::from(other.0) * i128::from(self.1)
    }
}

/// The part of a segment that lies in a half-open square: from one fraction of it to another.
struct Part {
    from: Fraction,
    from_open: bool,
    to: Fraction,
    to_open: bool,
}

impl Part {
    const WHOLE: Part = Part { from: Fraction(0, 1), from_open: false, to: Fraction(1, 1), to_open: false };

    /// Keeps what lies in `low <= t * length < high`; false when nothing can be left.
    fn cut(&mut self, length: i64, low: i64, high: i64) -> bool {
        if length == 0 {
            return low <= 0 && 0 < high;
        }
        if 0 < length {
            self.begin(Fraction(low, length), false);
            self.end(Fraction(high, length), true);
        } else {
            self.begin(Fraction(-high, -length), true);
            self.end(Fraction(-low, -length), false);
        }
        true
    }

    fn begin(&mut self, at: Fraction, open: bool) {
        if self.from.less_than(at) {
            (self.from, self.from_open) = (at, open);
        } else if !at.less_than(self.from) {
            self.from_open |= open;
        }
    }

    fn end(&mut self, at: Fraction, open: bool) {
        if at.less_than(self.to) {
            (self.to, self.to_open) = (at, open);
        } else if !self.to.less_than(at) {
            self.to_open |= open;
        }
    }

    fn is_some(&self) -> bool {
        self.from.less_than(self.to) || (!self.to.less_than(self.from) && !self.from_open && !self.to_open)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn segment(a: (i32, i32), b: (i32, i32)) -> Segment {
        Segment { a: Place::new(a.0, a.1), b: Place::new(b.0, b.1) }
    }

    #[test]
    fn a_pixel_holds_its_southern_and_western_side_only() {
        // Through the corner between four pixels: only the one to its north-east holds it.
        let diagonal = segment((0, 1), (1, 0));
        assert!(!diagonal.runs_through(Place::new(0, 0)));
        assert!(diagonal.runs_through(Place::new(1, 1)));
        assert!(diagonal.runs_through(Place::new(0, 1)) && diagonal.runs_through(Place::new(1, 0)));
    }

    #[test]
    fn a_crossing_is_rounded_to_its_pixel() {
        assert_eq!(segment((0, 0), (4, 4)).crossing(&segment((0, 3), (4, 0))), Some(Place::new(2, 2)));
        assert_eq!(segment((0, 0), (0, 4)).crossing(&segment((1, 2), (3, 2))), None);
        assert_eq!(segment((0, 0), (0, 4)).crossing(&segment((0, 2), (3, 2))), Some(Place::new(0, 2)));
        assert_eq!(segment((0, 0), (0, 4)).crossing(&segment((0, 2), (0, 6))), None);
    }

    fn places() -> impl Strategy<Value = Place> {
        (-20i32..20, -20i32..20).prop_map(|(row, col)| Place::new(row, col))
    }

    proptest! {
        #[test]
        fn a_segment_runs_through_the_pixel_of_each_of_its_points(a in places(), b in places()) {
            let segment = Segment { a, b };
            for eighth in 0..=800 {
                prop_assert!(segment.runs_through(segment.at(eighth, 800)));
            }
        }

        #[test]
        fn direction_and_order_do_not_matter(a in places(), b in places(), c in places(), d in places()) {
            let (one, other) = (Segment { a, b }, Segment { a: c, b: d });
            let back = Segment { a: b, b: a };
            prop_assert_eq!(one.crossing(&other), other.crossing(&one));
            prop_assert_eq!(one.crossing(&other), back.crossing(&other));
            prop_assert_eq!(one.runs_through(c), back.runs_through(c));
            if let Some(pixel) = one.crossing(&other) {
                prop_assert!(one.runs_through(pixel) && other.runs_through(pixel));
            }
        }
    }
}
