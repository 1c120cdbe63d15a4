//! How heights and slopes of two surfaces differ at places drawn over the area.

use serde::Serialize;

use super::statistics::Confusion;

/// Where classes of slope end, in degrees.
pub const SLOPE_ENDS_DEGREES: [f64; 5] = [2.0, 5.0, 10.0, 20.0, 30.0];
/// Classes of slope.
pub const SLOPE_CLASSES: usize = SLOPE_ENDS_DEGREES.len() + 1;

/// Both grounds at a place; one of them has a height at least.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Place {
    /// Height of each, in metres.
    pub heights_m: [Option<f64>; 2],
    /// Class of A's ground.
    pub class: Option<u8>,
    /// Slopes.
    pub slopes: Slopes,
}

/// Slopes of both grounds at a place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Slopes {
    /// Gradients of both.
    Both([[f64; 2]; 2]),
    /// Only this one, 0 for A and 1 for B, has ground there, or a slope.
    One(usize),
    /// Neither has one, or the place lies beside the border, where slopes are not told.
    Untold,
}

impl Slopes {
    /// From the heights and gradients that each has at a place inside the border.
    pub fn of(heights_m: [Option<f64>; 2], gradients: [Option<[f64; 2]>; 2]) -> Self {
        match gradients {
            [Some(a), Some(b)] => Self::Both([a, b]),
            [Some(_), None] => Self::One(0),
            [None, Some(_)] => Self::One(1),
            // Beside a hole of one, over a hole of the other.
            [None, None] => match heights_m.map(|height_m| height_m.is_some()) {
                [true, false] => Self::One(0),
                [false, true] => Self::One(1),
                _ => Self::Untold,
            },
        }
    }
}

impl Place {
    /// Height of B less that of A, in metres.
    pub fn difference_m(&self) -> Option<f64> {
        Some(self.heights_m[1]? - self.heights_m[0]?)
    }
}

/// How heights differ: those of B less those of A.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct HeightFigures {
    /// Places where both have a height.
    pub places: u64,
    /// Places among them where they differ by no more than is allowed.
    pub within: u64,
    /// Mean difference, in metres.
    pub mean_m: f64,
    /// Root mean square of differences, in metres.
    pub rms_m: f64,
    /// The absolute difference that half of the places do not exceed, then 90, 95 and 99 %, in metres.
    #[serde(skip)]
    pub absolute_m: [f64; 4],
    /// The difference that is farthest from 0, in metres.
    pub largest_m: f64,
    /// Where that is: an easting and a northing.
    pub largest_at_m: [f64; 2],
}

impl HeightFigures {
    /// Figures of differences in metres, each with its place.
    pub(super) fn of(differences: &[([f64; 2], f64)], within_m: f64) -> Self {
        let mut figures = Self { places: differences.len() as u64, ..Self::default() };
        if differences.is_empty() {
            return figures;
        }
        let count = figures.places as f64;
        for &(place_m, difference_m) in differences {
            figures.mean_m += difference_m / count;
            figures.rms_m += difference_m * difference_m / count;
            figures.within += u64::from(difference_m.abs() <= within_m);
            if figures.largest_m.abs() < difference_m.abs() {
                (figures.largest_m, figures.largest_at_m) = (difference_m, place_m);
            }
        }
        figures.rms_m = figures.rms_m.sqrt();
        let mut sorted: Vec<f64> = differences.iter().map(|(_, difference_m)| difference_m.abs()).collect();
        sorted.sort_by(f64::total_cmp);
        let rank = |percent: usize| (sorted.len() * percent).div_ceil(100).max(1) - 1;
        figures.absolute_m = [50, 90, 95, 99].map(|percent| sorted[rank(percent)]);
        figures
    }
}

/// How slopes differ, in degrees, over the same distance on both.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SlopeFigures {
    /// Metres over which slopes are taken.
    pub apart_m: f64,
    /// Places by class of slope on both: rows are those of A, columns those of B.
    pub classes: Confusion<SLOPE_CLASSES>,
    /// Places where slopes differ by no more than is allowed.
    pub within: u64,
    /// Places where only A has a slope, and where only B has: they agree in nothing.
    pub only_one: [u64; 2],
    /// Root mean square of the differences, in degrees; 0 without places.
    pub rms_degrees: f64,
}

impl SlopeFigures {
    pub(super) fn of(slopes: impl Iterator<Item = Slopes>, apart_m: f64, within_degrees: f64) -> Self {
        let classes = Confusion([[0; SLOPE_CLASSES]; SLOPE_CLASSES]);
        let mut figures = Self { apart_m, classes, within: 0, only_one: [0; 2], rms_degrees: 0.0 };
        for slopes in slopes {
            let both = match slopes {
                Slopes::Both(both) => both,
                Slopes::One(which) => {
                    figures.only_one[which] += 1;
                    continue;
                }
                Slopes::Untold => continue,
            };
            // The same on every machine, because it decides.
            let [a, b] = both.map(|[x, y]| libm::atan((x * x + y * y).sqrt()).to_degrees());
            let class = |degrees: f64| SLOPE_ENDS_DEGREES.iter().filter(|&&end| end <= degrees).count();
            figures.classes.0[class(a)][class(b)] += 1;
            figures.within += u64::from((a - b).abs() <= within_degrees);
            figures.rms_degrees += (a - b) * (a - b);
        }
        figures.rms_degrees = (figures.rms_degrees / figures.classes.total().max(1) as f64).sqrt();
        figures
    }

    /// Places where slopes agree or do not, those among them that only one has included.
    pub fn judged(&self) -> u64 {
        self.classes.total() + self.only_one[0] + self.only_one[1]
    }
}

/// Means of differences over squares of the area, for a picture.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct DifferenceMap {
    /// Rows of squares, from the south.
    pub rows: usize,
    /// Columns of squares, from the west.
    pub cols: usize,
    /// Mean difference of the places in each, B less A in metres, row by row; `None` without any.
    pub means_m: Vec<Option<f64>>,
}

impl DifferenceMap {
    pub(super) fn of(differences: &[([f64; 2], f64)], [west, south, east, north]: [f64; 4]) -> Self {
        const PLACES_EACH: f64 = 6.0;
        const SQUARES_MAX: f64 = 48.0;
        let (wide, high) = (east - west, north - south);
        let longer = (differences.len() as f64 / PLACES_EACH * wide.max(high) / wide.min(high)).sqrt();
        let side_m = wide.max(high) / longer.clamp(1.0, SQUARES_MAX).floor();
        let [cols, rows] = [wide, high].map(|far| ((far / side_m).round() as usize).max(1));
        let mut sums = vec![(0.0, 0_u32); rows * cols];
        for &([x, y], difference_m) in differences {
            let square = |far: f64, whole: f64, count: usize| ((far / whole * count as f64) as usize).min(count - 1);
            let (sum, count) = &mut sums[square(y - south, high, rows) * cols + square(x - west, wide, cols)];
            (*sum, *count) = (*sum + difference_m, *count + 1);
        }
        let mean = |(sum, count): (f64, u32)| (0 < count).then(|| sum / f64::from(count));
        Self { rows, cols, means_m: sums.into_iter().map(mean).collect() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn figures_are_those_of_a_hundred_places() {
        let differences: Vec<_> = (1..=100).map(|index| ([f64::from(index), 7.0], -f64::from(index))).collect();
        let found = HeightFigures::of(&differences, 42.0);
        assert_eq!((found.places, found.within, found.absolute_m), (100, 42, [50.0, 90.0, 95.0, 99.0]));
        assert_eq!((found.largest_m, found.largest_at_m), (-100.0, [100.0, 7.0]));
        assert!((found.mean_m + 50.5).abs() < 1e-9 && (found.rms_m - 3383.5_f64.sqrt()).abs() < 1e-9);
        assert_eq!(HeightFigures::of(&[], 1.0), HeightFigures::default());
    }

    #[test]
    fn a_slope_at_the_end_of_a_class_is_of_the_next() {
        let slope = |degrees: f64| [degrees.to_radians().tan(), 0.0];
        let both = [[slope(1.0), slope(45.0)], [slope(4.0), slope(3.0)]].map(Slopes::Both);
        let more = [Slopes::One(0), Slopes::Untold, Slopes::One(0), Slopes::One(1)];
        let found = SlopeFigures::of(both.into_iter().chain(more), 25.0, 5.0);
        assert_eq!((found.classes.0[0][5], found.classes.0[1][1], found.within), (1, 1, 1));
        assert_eq!((found.only_one, found.judged()), ([2, 1], 5));
        assert!((found.rms_degrees - (1937.0_f64 / 2.0).sqrt()).abs() < 1e-9);
    }

    #[test]
    fn a_slope_that_one_does_not_have_fails_and_one_that_neither_has_is_untold() {
        let (ground, none, slope) = (Some(5.0), None, Some([0.5, 0.0]));
        assert_eq!(Slopes::of([ground; 2], [slope; 2]), Slopes::Both([[0.5, 0.0]; 2]));
        assert_eq!(Slopes::of([ground; 2], [slope, None]), Slopes::One(0));
        assert_eq!(Slopes::of([none, ground], [None, slope]), Slopes::One(1));
        assert_eq!(Slopes::of([none, ground], [None; 2]), Slopes::One(1));
        assert_eq!(Slopes::of([ground; 2], [None; 2]), Slopes::Untold);
    }

    #[test]
    fn squares_of_the_map_cover_long_areas_too() {
        let differences: Vec<_> = (0..600).map(|index| ([f64::from(index), 5.0], f64::from(index))).collect();
        let map = DifferenceMap::of(&differences, [0.0, 0.0, 600.0, 60.0]);
        assert_eq!((map.rows, map.cols, map.means_m.len()), (3, 31, 93));
        assert!(map.means_m[0].unwrap() < map.means_m[30].unwrap() && map.means_m[31].is_none());
    }
}
