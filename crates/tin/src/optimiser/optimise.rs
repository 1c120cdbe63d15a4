//! The order of the steps.

use terrain::limits::Shortfall;
use terrain::{Dem, Importance, LATTICE_PER_POST, LatticePoint, Refusal, StopReason, Tin};

use crate::optimiser::account::Account;
use crate::optimiser::deep_flips::deep_flips;
use crate::optimiser::descent::descend;
use crate::optimiser::flips::flip_all;
use crate::optimiser::heights::{fit_heights, round_heights};
use crate::optimiser::hold::Hold;
use crate::optimiser::insertion::Insertion;
use crate::optimiser::parts::{Layout, Parts};
use crate::optimiser::place::{PER_POST, Place};
use crate::optimiser::recipe::{Recipe, Step};
use crate::optimiser::removal::Removal;
use crate::optimiser::sweep::Mover;
use crate::optimiser::task::Task;
use crate::optimiser::tile_mesh::TileMesh;
use crate::optimiser::weave::weave;
use crate::optimiser::weighted_heights::WeightedHeights;
use crate::optimiser::work::Work;

/// A TIN made truer.
#[derive(Clone, Debug)]
pub struct Optimised {
    /// Its vertices in order of row and column, on the lattice.
    pub tin: Tin,
    /// Triangles spent on vertices that are not held.
    pub spent: u32,
    /// Posts that would have been worth more than some vertex of the tile, had a limit not stood in the way; `None`
    /// where the effort never asks what a vertex is worth.
    pub refused: Option<Vec<Refusal>>,
    /// Why it ended.
    pub stop: StopReason,
    /// Edges of features that cross others or lines and were left out, in 64ths of a post; none that are made as
    /// [`terrain::Features`] asks.
    pub left_out: Vec<[LatticePoint; 2]>,
    /// Limits that are exceeded because nothing is left that may go.
    pub short: Vec<Shortfall>,
}

/// Makes a TIN truer within its budget.
///
/// A pure function of its arguments. The TIN covers the window; it may exceed the budget, see [`super::overshoot`], and
/// is then thinned.
///
/// # Panics
/// When the TIN, the window and the mask do not cover the same posts.
pub fn optimise(dem: &Dem, importance: &Importance, start: &Tin, task: &Task) -> Optimised {
    work_on(dem, importance, start, task, |work| work.run())
}

/// Spends what the budget leaves on new vertices, each in the triangle that explains least, and leaves the rest of the
/// TIN alone but for the flips and heights around them: what a little more would buy, at least.
///
/// # Panics
/// As [`optimise`].
pub fn fill(dem: &Dem, importance: &Importance, start: &Tin, task: &Task) -> Optimised {
    work_on(dem, importance, start, task, |work| {
        work.fill_by_squares();
        round_heights(&mut work.sheet);
    })
}

/// Puts features into a TIN and leaves the rest of it alone, but for what they displace and what is then over a limit.
///
/// # Panics
/// As [`optimise`].
pub fn weave_in(dem: &Dem, importance: &Importance, start: &Tin, task: &Task) -> Optimised {
    work_on(dem, importance, start, task, |work| {
        work.thin_to_goal();
        work.meet_limits();
        round_heights(&mut work.sheet);
    })
}

fn work_on(dem: &Dem, importance: &Importance, start: &Tin, task: &Task, steps: impl Fn(&mut Work)) -> Optimised {
    assert_eq!(dem.rect(), start.rect, "the TIN covers the window");
    assert_eq!(dem.rect(), importance.rect(), "heights and weights cover the same posts");
    let in_squares = task.in_squares.as_ref().unwrap_or(importance);
    assert_eq!(dem.rect(), in_squares.rect(), "heights and weights cover the same posts");
    let mut ground = WeightedHeights::new(dem, (importance, in_squares), task.open, task.height_fit);
    let mut forbidden = task.forbidden.clone();
    forbidden.extend(task.features.barred_posts(dem.rect()));
    forbidden.sort_unstable();
    ground.forbid(forbidden);
    if let Some(spacing) = task.spacing {
        ground.quanta_per_step = f64::from(spacing.quanta_per_post()) / f64::from(PER_POST);
    }
    let mut held: Vec<Place> = task.held.iter().map(|&at| Place::of(at, dem.rect(), LATTICE_PER_POST)).collect();
    held.sort_unstable();
    // What lies on a side that is not open is another tile's, or a fixed outer border of the area.
    let hold = |at: Place| {
        if ground.is_on_closed_side(at) || held.binary_search(&at).is_ok() { Hold::GIVEN } else { ground.height_hold() }
    };
    let layout = Layout { line_step: task.line_step.map(|posts| posts * PER_POST), hold: &hold };
    let grown = Parts::of(&ground, start, &layout);
    let has_features = !task.features.is_empty();
    let (parts, left_out) = match has_features {
        true => weave(&ground, grown, &task.features, start.rect, &layout),
        false => (grown, Vec::new()),
    };
    let sheet = TileMesh::new(&ground, parts, layout.line_step, has_features);
    let account = Account::new(&task.budget, &sheet);
    let mut work = Work {
        sheet,
        account,
        task,
        mover: Mover::new(1),
        removal: Removal::default(),
        insertion: Insertion::default(),
        cheapest: None,
    };
    steps(&mut work);
    let (spent, stop, refused, short) = (work.account.spent(), work.stop(), work.refusals(), work.account.short());
    // Without features in it a TIN is that of a job without any, to the byte.
    let finer = if has_features { task.features.steps_per_post } else { start.steps_per_post };
    let steps_per_post = start.steps_per_post.max(finer);
    Optimised { tin: work.sheet.into_tin(start.rect, steps_per_post), spent, refused, stop, left_out, short }
}

impl Work<'_, '_> {
    fn run(&mut self) {
        self.check();
        for &step in Recipe::of(self.task.effort).steps.iter().copied().flatten() {
            self.take(step);
            self.check();
        }
        self.reach_goal();
        round_heights(&mut self.sheet);
        self.meet_largest();
    }

    fn take(&mut self, step: Step) {
        let final_step = self.final_step();
        let Self { sheet, mover, .. } = self;
        match step {
            Step::OnLattice => mover.step = final_step,
            Step::Flip => {
                sheet.mark_all_changed();
                flip_all(sheet);
            }
            Step::Sweep => {
                sheet.mark_all_changed();
                mover.sweep(sheet);
                flip_all(sheet);
            }
            Step::SweepChanged => {
                mover.sweep(sheet);
                flip_all(sheet);
            }
            Step::Thin(times, by) => {
                self.thin(times, by);
                if times <= 1.0 {
                    self.thin_to_goal();
                }
            }
            Step::DeepFlip(rounds) => deep_flips(sheet, mover, rounds),
            Step::Descend(steps) => descend(sheet, steps, mover.step),
            Step::Grow(times) => self.grow(times),
            Step::Snap => {
                self.thin_to_goal();
                self.meet_limits();
                self.snap();
            }
            Step::FitHeights(steps) => fit_heights(sheet, steps),
        }
    }
}
