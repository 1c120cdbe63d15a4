//! Thins the stations of a chain once their heights are known: Douglas and Peucker's method, aside and in height.
//!
//! Stations on tile and load-module lines stay, and so do those that others share; no edge that results is steeper
//! than its grade.

use terrain::geometry::nearest_share;

use crate::{FeatureLattice, Place};

/// How far a thinned line may lie from its stations.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tolerance {
    /// Metres aside.
    pub aside_m: f64,
    /// Metres in height.
    pub height_m: f64,
}

impl Tolerance {
    /// 0.5 m aside and 0.15 m in height.
    pub const USUAL: Self = Self::of(0.5, 0.15);

    /// What features are thinned with, the finest first.
    pub const ALL: [Self; 5] =
        [Self::USUAL, Self::of(1.0, 0.3), Self::of(2.0, 0.6), Self::of(4.0, 1.0), Self::of(8.0, 2.0)];

    const fn of(aside_m: f64, height_m: f64) -> Self {
        Self { aside_m, height_m }
    }
}

/// A station with its height in quanta, and whether it has to stay.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Station {
    /// Where it stands.
    pub place: Place,
    /// Its height in quanta.
    pub height: i32,
    /// Whether it stays whatever it costs.
    pub stays: bool,
    /// Quanta of the line that are level before it and after it.
    pub flat: [i32; 2],
}

/// The numbers of the stations that stay, in order; the first and the last do.
///
/// `grade_ppm` of 0 stands for a line without a greatest grade.
pub fn thin(stations: &[Station], tolerance: Tolerance, grade_ppm: u32, lattice: FeatureLattice) -> Vec<u32> {
    let last = stations.len().saturating_sub(1);
    let mut kept: Vec<bool> = stations.iter().map(|station| station.stays).collect();
    for end in [0, last] {
        kept.get_mut(end).into_iter().for_each(|kept| *kept = true);
    }
    let anchors: Vec<usize> = (0..stations.len()).filter(|&at| kept[at]).collect();
    let mut spans: Vec<(usize, usize)> = anchors.windows(2).map(|pair| (pair[0], pair[1])).collect();
    let aside = tolerance.aside_m / lattice.metres_per_step();
    let height = tolerance.height_m * f64::from(terrain::QUANTA_PER_METRE);
    while let Some((from, to)) = spans.pop() {
        if to - from < 2 {
            continue;
        }
        let worst = (from + 1..to)
            .map(|at| (at, excess(stations[from], stations[to], stations[at], aside, height)))
            .max_by(|a, b| a.1.total_cmp(&b.1).then(b.0.cmp(&a.0)));
        let Some((at, excess)) = worst else { continue };
        if 1.0 < excess || is_too_steep(stations[from], stations[to], grade_ppm, lattice) {
            kept[at] = true;
            spans.extend([(from, at), (at, to)]);
        }
    }
    (0..stations.len() as u32).filter(|at| kept[*at as usize]).collect()
}

fn is_too_steep(a: Station, b: Station, grade_ppm: u32, lattice: FeatureLattice) -> bool {
    let rise_max = lattice.rise_max(a.place, b.place, grade_ppm, a.flat[1] + b.flat[0]);
    0 < grade_ppm && rise_max < (a.height - b.height).abs()
}

/// How many times a tolerance a station lies off the line from `a` to `b`.
fn excess(a: Station, b: Station, station: Station, aside: f64, height: f64) -> f64 {
    let ([east, north], [to_east, to_north]) =
        (a.place.to(b.place).map(|d| d as f64), a.place.to(station.place).map(|d| d as f64));
    let along = nearest_share([east, north], [to_east, to_north]);
    let (off_east, off_north) = (to_east - along * east, to_north - along * north);
    let off = (off_east * off_east + off_north * off_north).sqrt();
    let level = f64::from(a.height) + along * f64::from(b.height - a.height);
    (off / aside).max((f64::from(station.height) - level).abs() / height)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn lattice() -> FeatureLattice {
        FeatureLattice::of(terrain::Spacing::from_metres(25.0).unwrap())
    }

    fn line(heights: &[i32]) -> Vec<Station> {
        let station = |(at, height): (usize, &i32)| Station {
            place: Place::new(0, 64 * at as i32),
            height: *height,
            stays: false,
            flat: [0; 2],
        };
        heights.iter().enumerate().map(station).collect()
    }

    #[test]
    fn a_straight_line_keeps_its_ends_and_what_has_to_stay() {
        let mut stations = line(&[0, 10, 20, 30, 40]);
        assert_eq!(thin(&stations, Tolerance::USUAL, 60_000, lattice()), [0, 4]);
        stations[3].stays = true;
        assert_eq!(thin(&stations, Tolerance::USUAL, 60_000, lattice()), [0, 3, 4]);
    }

    #[test]
    fn a_line_that_begins_level_is_not_as_long_as_it_looks() {
        let mut stations = line(&[0, 180, 360]);
        assert_eq!(thin(&stations, Tolerance::USUAL, 60_000, lattice()), [0, 2]);
        stations[0].flat = [0, 800];
        assert_eq!(thin(&stations, Tolerance::USUAL, 60_000, lattice()), [0, 1, 2]);
    }

    #[test]
    fn a_hump_higher_than_the_tolerance_stays() {
        assert_eq!(thin(&line(&[0, 10, 25, 10, 0]), Tolerance::USUAL, 0, lattice()), [0, 2, 4]);
        assert_eq!(thin(&line(&[0, 10, 15, 10, 0]), Tolerance::USUAL, 0, lattice()), [0, 4]);
        assert_eq!(thin(&line(&[0, 10, 25, 10, 0]), Tolerance::ALL[1], 0, lattice()), [0, 4]);
    }

    proptest! {
        #[test]
        fn no_station_left_out_lies_farther_than_the_tolerance_and_no_edge_is_too_steep(
            rises in proptest::collection::vec((-192..=192i32, -40..40i32), 2..40)
        ) {
            let (mut height, mut stations) = (0, Vec::new());
            for (at, (rise, row)) in rises.iter().enumerate() {
                let place = Place::new(*row, 64 * at as i32);
                stations.push(Station { place, height, stays: at % 7 == 3, flat: [0; 2] });
                height += rise;
            }
            let kept = thin(&stations, Tolerance::USUAL, 60_000, lattice());
            for pair in kept.windows(2) {
                let (from, to) = (stations[pair[0] as usize], stations[pair[1] as usize]);
                prop_assert!(!is_too_steep(from, to, 60_000, lattice()));
                for at in pair[0] + 1..pair[1] {
                    prop_assert!(!stations[at as usize].stays);
                    let aside = 0.5 / lattice().metres_per_step();
                    prop_assert!(excess(from, to, stations[at as usize], aside, 0.15 * 128.0) <= 1.0);
                }
            }
        }
    }
}
