//! The iterative method's residual after every point.

use crate::CompileError;
use fidelity::Tally;
use terrain::QUANTA_PER_METRE;

use super::made::Equivalent;
use super::subject::{Subject, Until};
use crate::workbench::TinMethod;

/// Sums of squared residuals of the iterative TIN, from its corners on.
pub(super) struct Curve {
    /// In quanta squared, after each point.
    squares: Vec<u64>,
    posts: u64,
}

/// Vertices of the first TIN of the curve: the corners.
const CORNERS: usize = 4;

impl Curve {
    /// Grows the iterative TIN until its RMS residual is below `least_m` and it has `points` at least, or can have no
    /// more.
    ///
    /// # Errors
    /// When the ground cannot be used.
    pub fn of(subject: &Subject, least_m: f64, points: usize) -> Result<Self, CompileError> {
        // The last batch is cut in row order, so a TIN of fewer points is a beginning of one of more.
        let below_m = least_m * (1.0 - 1e-9);
        let tin = match subject.refine(TinMethod::Paper, None, Until::RmsM(below_m)) {
            Ok(tin) if tin.vertices.len() < points => subject.refine(TinMethod::Paper, None, Until::Points(points)),
            other => other,
        }?;
        let posts: Vec<_> = tin.vertices[CORNERS..].iter().filter_map(|vertex| vertex.at.post()).collect();
        Ok(Self { squares: tin::methods::running_squares(&subject.dem, &posts), posts: subject.posts() })
    }

    /// The smallest number of points whose RMS residual is below that of `tally`, exactly.
    pub fn equivalent(&self, tally: &Tally) -> Equivalent {
        let theirs = tally.sum_squared * u128::from(self.posts);
        let is_below = |&squares: &u64| u128::from(squares) * u128::from(tally.posts) < theirs;
        match self.squares.iter().position(is_below) {
            Some(after) => Equivalent::Points(CORNERS + after),
            None => Equivalent::MoreThan(CORNERS + self.squares.len() - 1),
        }
    }

    /// RMS residual of so many points, in metres.
    pub fn rms_m(&self, points: usize) -> Option<f64> {
        let squares = *self.squares.get(points.checked_sub(CORNERS)?)?;
        Some((squares as f64 / self.posts as f64).sqrt() / f64::from(QUANTA_PER_METRE))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn check(squares: &[u64], residual: i32, expected: Equivalent) {
        let mut tally = Tally::default();
        tally.add(residual);
        assert_eq!(Curve { squares: squares.to_vec(), posts: 2 }.equivalent(&tally), expected);
    }

    #[test]
    fn equivalent_points_are_the_first_below_even_where_the_curve_rises_again() {
        check(&[50, 8, 7, 9, 3], 2, Equivalent::Points(6));
        check(&[50, 18, 7, 9, 3], 3, Equivalent::Points(6));
        check(&[50, 18, 7, 9, 3], 1, Equivalent::MoreThan(8));
        check(&[50], 6, Equivalent::Points(4));
    }

    #[test]
    fn the_residual_after_some_points_is_that_of_their_beginning() {
        let curve = Curve { squares: vec![2 * 128 * 128, 0], posts: 2 };
        assert_eq!(
            (curve.rms_m(3), curve.rms_m(4), curve.rms_m(5), curve.rms_m(6)),
            (None, Some(1.0), Some(0.0), None)
        );
    }
}
