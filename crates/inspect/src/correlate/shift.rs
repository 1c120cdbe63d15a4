//! The shift that brings one surface closest to another: least squares over places, with slopes (the method of C. Nuth
//! and A. Kääb, 2011, for elevation models).

use build::CompileError;

use super::places::Common;

/// Rounds, each from where the last one ended.
const ROUNDS_MAX: usize = 12;
/// Places that the shift is found from at most: more tell nothing new.
const PLACES_MAX: usize = 20_000;
/// How many standard errors a shift has to be away from none to be taken for one.
const ERRORS: f64 = 3.0;
/// Metres of a step below which nothing changes any more.
const STEP_M: f64 = 1e-3;

/// A move of B that brings it closest to A.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shift {
    /// Metres to the east, north and up.
    pub by_m: [f64; 3],
    /// Standard errors of these, as far as chance goes.
    pub error_m: [f64; 3],
    /// Whether the ground has slopes enough to tell a shift to the east and north.
    pub is_level_told: bool,
    /// Root mean square of differences before, and after it, at the same places, in metres.
    pub rms_m: [f64; 2],
}

impl Shift {
    /// Whether it goes to a side by more than a tenth of a post and than chance does.
    pub fn is_aside(&self, spacing_m: f64) -> bool {
        let far = |axis: usize| ERRORS * self.error_m[axis] < self.by_m[axis].abs();
        self.is_level_told && (far(0) || far(1)) && spacing_m < 10.0 * self.by_m[0].hypot(self.by_m[1])
    }

    /// Whether it goes up or down by more than a tenth of what is allowed and than chance does.
    pub fn is_up(&self, within_m: f64) -> bool {
        (ERRORS * self.error_m[2]).max(0.1 * within_m) < self.by_m[2].abs()
    }
}

/// One place: height of A less that of B, and the gradient of B.
type Row = (f64, [f64; 2]);

/// Finds the shift from places where both have heights; `None` from fewer than four.
///
/// # Errors
/// When ground cannot be read.
pub(super) fn best_shift(
    common: &mut Common<'_>,
    places_m: &[[f64; 2]],
    apart_m: f64,
) -> Result<Option<Shift>, CompileError> {
    let places_m = &places_m[..places_m.len().min(PLACES_MAX)];
    let mut rows_at = |[east, north]: [f64; 2]| -> Result<Vec<Option<Row>>, CompileError> {
        let row = |a: &super::surface::Ground, b: &super::surface::Ground, place: &[f64; 2]| {
            let from = [place[0] - east, place[1] - north];
            Some((a.height_m(*place)? - b.height_m(from)?, b.gradient(from, apart_m)?))
        };
        common.each("places shifted", places_m, |place| *place, row)
    };
    let start = rows_at([0.0; 2])?;
    let mut step = solve(&start.iter().copied().flatten().collect::<Vec<_>>());
    let Some(first) = step else { return Ok(None) };
    // Beyond this nothing of B is held, and slopes at a place say nothing of the ground there.
    let far_m = 16.0 * apart_m;
    let (mut at, mut best) = ([0.0; 2], None);
    for _ in 0..ROUNDS_MAX {
        let Some(Step { along_m: Some(along), .. }) = step else { break };
        at = [at[0] + along[0], at[1] + along[1]];
        if far_m < at[0].hypot(at[1]) {
            break;
        }
        let rows = rows_at(at)?;
        let both: Vec<[Row; 2]> = start.iter().zip(&rows).filter_map(|(a, b)| Some([(*a)?, (*b)?])).collect();
        let [before, after] = [0, 1].map(|which| both.iter().map(|rows| rows[which]).collect::<Vec<Row>>());
        step = solve(&after);
        let Some(solved) = &step else { break };
        let mean = after.iter().map(|row| row.0).sum::<f64>() / after.len().max(1) as f64;
        let shift = Shift {
            by_m: [at[0], at[1], mean],
            error_m: solved.error_m,
            is_level_told: true,
            rms_m: [rms(&before, 0.0), rms(&after, mean)],
        };
        if best.is_none_or(|best: Shift| shift.rms_m[1] < best.rms_m[1]) {
            best = Some(shift);
        }
        if along[0].hypot(along[1]) < STEP_M {
            break;
        }
    }
    let rows: Vec<Row> = start.into_iter().flatten().collect();
    let mean = rows.iter().map(|row| row.0).sum::<f64>() / rows.len() as f64;
    let spread = rms(&rows, mean);
    let up_alone = Shift {
        by_m: [0.0, 0.0, mean],
        error_m: [0.0, 0.0, spread / (rows.len() as f64).sqrt()],
        is_level_told: first.along_m.is_some(),
        rms_m: [rms(&rows, 0.0), spread],
    };
    Ok(Some(best.filter(|best| best.rms_m[1] <= spread).unwrap_or(up_alone)))
}

fn rms(rows: &[Row], up_m: f64) -> f64 {
    let squares = rows.iter().map(|row| (row.0 - up_m) * (row.0 - up_m)).sum::<f64>();
    (squares / rows.len().max(1) as f64).sqrt()
}

/// What one round of least squares says.
#[derive(Clone, Copy, Debug)]
struct Step {
    /// How much farther to the east and north; `None` where slopes are too much alike to tell.
    along_m: Option<[f64; 2]>,
    error_m: [f64; 3],
}

/// Least squares of A less B = up - east * slope to the east - north * slope to the north.
fn solve(rows: &[Row]) -> Option<Step> {
    const ROWS_MIN: usize = 4;
    if rows.len() < ROWS_MIN {
        return None;
    }
    let count = rows.len() as f64;
    let mean = |of: &dyn Fn(&Row) -> f64| rows.iter().map(of).sum::<f64>() / count;
    let means = [mean(&|row| row.1[0]), mean(&|row| row.1[1]), mean(&|row| row.0)];
    let product = |one: &dyn Fn(&Row) -> f64, other: &dyn Fn(&Row) -> f64| mean(&|row| one(row) * other(row));
    let [x, y] = [0, 1].map(|axis| move |row: &Row| row.1[axis] - means[axis]);
    let d = move |row: &Row| row.0 - means[2];
    let (xx, xy, yy) = (product(&x, &x), product(&x, &y), product(&y, &y));
    let (xd, yd, dd) = (product(&x, &d), product(&y, &d), product(&d, &d));
    let determinant = xx * yy - xy * xy;
    /// Product of the variances of slopes below which the ground is flat, or slopes one way only.
    const FLAT: f64 = 1e-14;
    if determinant <= FLAT.max(1e-6 * xx * yy) {
        return Some(Step { along_m: None, error_m: [0.0, 0.0, (dd / count).sqrt()] });
    }
    let along = [-(yy * xd - xy * yd) / determinant, -(xx * yd - xy * xd) / determinant];
    let left = (dd + along[0] * xd + along[1] * yd).max(0.0) / (count - 3.0).max(1.0);
    let error = [yy / determinant, xx / determinant, 1.0].map(|share| (left * share).sqrt());
    Some(Step { along_m: Some(along), error_m: error })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_plane_cut_by_noise_is_solved_for() {
        let mut dice = fidelity::Draw::new(3, 0);
        let rows: Vec<Row> = (0..4000)
            .map(|_| {
                let slope = [dice.unit() - 0.5, dice.unit() - 0.5];
                (7.0 - 12.5 * slope[0] + 3.0 * slope[1] + dice.unit() - 0.5, slope)
            })
            .collect();
        let step = solve(&rows).unwrap();
        let [east, north] = step.along_m.unwrap();
        assert!((east - 12.5).abs() < 3.0 * step.error_m[0] && (north + 3.0).abs() < 3.0 * step.error_m[1], "{step:?}");
        assert!(step.error_m[0] < 0.03 && step.error_m[2] < 0.01, "{step:?}");
    }

    #[test]
    fn flat_ground_and_a_single_ramp_tell_no_shift_to_a_side() {
        let flat: Vec<Row> = (0..9).map(|_| (2.0, [0.0, 0.0])).collect();
        assert!(solve(&flat).unwrap().along_m.is_none());
        let ramp: Vec<Row> = (0..9).map(|index| (f64::from(index), [0.5, 0.25])).collect();
        assert!(solve(&ramp).unwrap().along_m.is_none());
        assert!(solve(&flat[..3]).is_none());
    }
}
