//! An independent guard: no height of the ground lies outside the range of the sources' own heights.
//!
//! The range is taken while samples are decoded, before voids are filled or anything is resampled, so a mistake in
//! either (a marker of voids that is taken for a height, a curve that swings out) cannot move it.

use terrain::QUANTA_PER_METRE;

use crate::ground::GroundError;

/// The lowest and the highest height that any source has under the area, in quanta, as whole numbers around it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    lowest: i32,
    highest: i32,
}

impl Bounds {
    /// Of heights in metres.
    pub fn of_metres((lowest_m, highest_m): (f64, f64)) -> Self {
        let quanta = |metres: f64| metres * f64::from(QUANTA_PER_METRE);
        // Filled heights are computed in single precision, whose last digit may be worth a quantum.
        Self { lowest: quanta(lowest_m).floor() as i32 - 1, highest: quanta(highest_m).ceil() as i32 + 1 }
    }

    /// The same, for heights that may also be one that a job gives.
    pub fn and(self, quanta: i32) -> Self {
        Self { lowest: self.lowest.min(quanta), highest: self.highest.max(quanta) }
    }

    /// By how many metres a height lies outside; 0 for one inside.
    pub fn metres_outside(self, quanta: i32) -> f64 {
        let outside = (i64::from(self.lowest) - i64::from(quanta)).max(i64::from(quanta) - i64::from(self.highest));
        metres(outside.max(0))
    }

    /// The bounds in metres.
    pub fn metres(self) -> (f64, f64) {
        (metres(self.lowest.into()), metres(self.highest.into()))
    }

    /// Refuses heights that reach beyond.
    ///
    /// # Errors
    /// [`GroundError::OutsideSources`]: then this program is wrong, not the job.
    pub fn hold(self, (lowest, highest): (i32, i32)) -> Result<(), GroundError> {
        if self.lowest <= lowest && highest <= self.highest {
            return Ok(());
        }
        let found_m = (metres(lowest.into()), metres(highest.into()));
        Err(GroundError::OutsideSources { found_m, expected_m: self.metres() })
    }
}

fn metres(quanta: i64) -> f64 {
    quanta as f64 / f64::from(QUANTA_PER_METRE)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_height_a_metre_below_every_source_is_refused_with_both_ranges() {
        let bounds = Bounds::of_metres((10.0, 20.5));
        assert!(bounds.hold((10 * 128, 20 * 128 + 64)).is_ok());
        let text = bounds.hold((9 * 128, 20 * 128)).unwrap_err().to_string();
        assert!(text.contains("from 9.00 m to 20.00 m") && text.contains("9.99 m to 20.51 m"), "{text}");
        assert_eq!(bounds.metres_outside(9 * 128 - 1), 1.0);
        assert_eq!(bounds.and(0).metres_outside(0), 0.0);
    }
}
