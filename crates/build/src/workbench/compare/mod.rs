//! Methods side by side on one ground: the founding paper's Table 1 on any DEM.
//!
//! Each method makes its TIN, one after the other, so that times can be compared; the TIN is measured at every post it
//! covers. Then the iterative method runs until it is better than all of them, and the smallest number of its points
//! whose RMS residual is below a method's is that method's number of equivalent points.

mod choose;
mod made;
mod subject;

pub use choose::CompareMethod;
pub use made::{CompareGround, Equivalent, Forced, HeldGround, Made};
pub use tin::methods::Impossible;

use std::sync::atomic::{AtomicBool, Ordering};

use fidelity::Tally;
use terrain::{Dem, PostRect, QUANTA_PER_METRE};

use crate::ground::{GroundError, TaskError};
use crate::workbench::TinMethod;
use crate::workbench::compare::subject::{Subject, Until};
use crate::{CompileError, Stage};

/// Methods to compare.
#[derive(Clone, Debug)]
pub struct CompareRequest {
    /// On what.
    pub ground: CompareGround,
    /// Only these posts, counted from the south-west post of the ground.
    pub window: Option<PostRect>,
    /// Which methods, in the order of the table.
    pub methods: Vec<CompareMethod>,
    /// Numbers of points.
    pub points: Vec<usize>,
    /// Whether a method that cannot make so many points is an error, not a row that says so.
    pub strict: bool,
}

/// What happens while methods are compared.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CompareEvent {
    /// The ground is read; so many rows are to be made.
    Read(usize),
    /// A row's method begins.
    Started(usize),
    /// Its TIN is there, or the method said no.
    Done(usize),
    /// The iterative method begins to run ahead for equivalent points.
    Equivalents,
}

/// A row of the table: one method at one number of points.
#[derive(Clone, Debug)]
pub struct CompareRow {
    /// The method.
    pub method: CompareMethod,
    /// The number of points asked for; none where it cannot be chosen.
    pub asked: Option<usize>,
    /// What it made, or why it cannot.
    pub made: Result<Made, Impossible>,
}

/// The table.
#[derive(Clone, Debug)]
pub struct Comparison {
    /// What was compared on.
    pub ground: String,
    /// Rows and columns of posts.
    pub size: (usize, usize),
    /// Its heights.
    pub dem: Dem,
    /// Metres between posts.
    pub spacing_m: f64,
    /// Posts with a height.
    pub posts: u64,
    /// The rows, points by points.
    pub rows: Vec<CompareRow>,
}

/// Compares methods.
///
/// # Errors
/// When the ground cannot be used, or it was asked to stop; of a strict request, when a method cannot make so many
/// points, which is a row of any other.
pub fn compare(
    request: &CompareRequest,
    stop: &AtomicBool,
    tell: &mut dyn FnMut(CompareEvent),
) -> Result<Comparison, CompileError> {
    let subject = Subject::open(&request.ground, request.window, stop)?;
    let mut rows = planned(&request.methods, &request.points);
    tell(CompareEvent::Read(rows.len()));
    let total = rows.len();
    for (index, row) in rows.iter_mut().enumerate() {
        if stop.load(Ordering::Relaxed) {
            return Err(TaskError::Stopped { stage: Stage::Refine.name(), done: index, total }.into());
        }
        tell(CompareEvent::Started(index));
        let tin = row.method.make(&subject, row.asked)?;
        tell(CompareEvent::Done(index));
        row.made = tin.map(|tin| subject.measure(tin));
        if request.strict {
            refuse(row)?;
        }
    }
    if rows.iter().any(|row| row.made.is_ok()) {
        tell(CompareEvent::Equivalents);
        equate(&subject, &mut rows)?;
    }
    let posts = subject.posts();
    let Subject { dem, spacing, name } = subject;
    let size = (dem.rect().posts_high(), dem.rect().posts_wide());
    Ok(Comparison { ground: name, size, dem, spacing_m: spacing.0, posts, rows })
}

/// Makes an error of a row without a TIN.
fn refuse(row: &CompareRow) -> Result<(), CompileError> {
    let Err(why) = &row.made else { return Ok(()) };
    Err(GroundError::Impossible {
        key: row.method.name(),
        found: why.found.clone(),
        expected: why.expected.clone(),
        hint: why.hint.clone(),
    }
    .into())
}

/// The rows to make: what no number of points is chosen for comes once, at the end.
fn planned(methods: &[CompareMethod], points: &[usize]) -> Vec<CompareRow> {
    let nothing = || Err(Impossible { found: String::new(), expected: String::new(), hint: String::new() });
    let row = |method, asked| CompareRow { method, asked, made: nothing() };
    let chosen = methods.iter().filter(|method| method.takes_points());
    let fixed = methods.iter().filter(|method| !method.takes_points());
    let by_points = points.iter().flat_map(|&points| chosen.clone().map(move |&method| (method, Some(points))));
    by_points.chain(fixed.map(|&method| (method, None))).map(|(method, asked)| row(method, asked)).collect()
}

/// Fills in equivalent points, and what forced points cost.
fn equate(subject: &Subject, rows: &mut [CompareRow]) -> Result<(), CompileError> {
    let whole = subject.posts();
    let comparable = |row: &CompareRow| row.method.is_comparable();
    let tallies = rows.iter().filter(|row| comparable(row)).filter_map(|row| row.made.as_ref().ok());
    let least_m = tallies.map(|made| made.residual.rms_m()).fold(f64::INFINITY, f64::min);
    let most = rows.iter().filter_map(|row| row.asked).max().unwrap_or(0);
    let curve = Curve::of(subject, least_m, most)?;
    for row in rows {
        let forced = row.method.forced(subject.dem.rect());
        let (is_comparable, asked) = (comparable(row), row.asked);
        let Ok(made) = &mut row.made else { continue };
        if is_comparable && made.covered == whole {
            made.equivalent = curve.equivalent(&made.residual);
        }
        made.forced = forced.map(|points| {
            let left = asked.and_then(|asked| asked.checked_sub(points));
            Forced { points, iterative_rms_m: left.and_then(|left| curve.rms_m(left)) }
        });
    }
    Ok(())
}

/// Sums of squared residuals of the iterative TIN, from its corners on.
struct Curve {
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
