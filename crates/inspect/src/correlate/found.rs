//! What is asked of two surfaces, and what was found.

use load_module_reader::Standing;
use serde::Serialize;

use super::feet::Feet;
use super::heights::{DifferenceMap, HeightFigures, SlopeFigures};
use super::shift::Shift;
use super::statistics::{Confusion, Demand, Plan, clopper_pearson};
use super::surface::SurfaceFacts;

/// What is asked.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CorrelateRequest {
    /// What has to agree, and how surely.
    pub demand: Demand,
    /// Places, and pairs of places, to look at; as many as the plan needs without.
    pub samples: Option<u64>,
    /// Metres by which heights may differ.
    pub within_m: f64,
    /// Degrees by which slopes may differ.
    pub slope_within_degrees: f64,
    /// Farthest target of a line of sight, in metres.
    pub range_m: f64,
    /// What lines of sight look at beside the ground.
    pub standing: Standing,
    /// What places are drawn from; the same seed draws the same places.
    pub seed: u64,
    /// Whether heights above different vertical datums are compared as they are.
    pub allow_datums: bool,
}

/// Lines of sight at one height above the ground.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SightFigures {
    /// Metres above the ground, of both ends.
    pub above_m: f64,
    /// Pairs of places over ground that both have: rows hidden and seen on A, columns hidden and seen on B.
    pub pairs: Confusion<2>,
}

/// How the ground of one class of A agrees.
#[derive(Clone, Debug, PartialEq)]
pub struct ClassFigures {
    /// Its name.
    pub name: String,
    /// Differences of heights on it.
    pub heights: HeightFigures,
}

/// What was found.
#[derive(Clone, Debug, PartialEq)]
pub struct Correlation {
    /// What was asked.
    pub request: CorrelateRequest,
    /// A and B.
    pub surfaces: [SurfaceFacts; 2],
    /// West, south, east and north of the area that both reach, in metres.
    pub common_m: [f64; 4],
    /// The plan that was followed.
    pub plan: Plan,
    /// What a person should know before the figures.
    pub notes: Vec<String>,
    /// Places where only A has ground, and where only B has: they agree in nothing.
    pub only_one: [u64; 2],
    /// Places where neither has, which were drawn again.
    pub void_places: u64,
    /// Differences of heights.
    pub heights: HeightFigures,
    /// The shift that brings B closest to A; `None` where too few places have heights.
    pub shift: Option<Shift>,
    /// Slopes.
    pub slopes: SlopeFigures,
    /// Differences by class of A's ground, where it has several.
    pub classes: Vec<ClassFigures>,
    /// Which objects lines of sight looked at: those that both surfaces have.
    pub standing: Standing,
    /// Lines of sight, lowest first.
    pub sights: Vec<SightFigures>,
    /// Pairs over ground that only A has all along, and that only B has: they agree in nothing.
    pub only_one_pairs: [u64; 2],
    /// Pairs over holes of both, or that fitted nowhere: drawn again.
    pub void_pairs: u64,
    /// What is accepted and what is not.
    pub criteria: Vec<Criterion>,
    /// Why, in sentences without their full stops, the likeliest cause first.
    pub causes: Vec<String>,
    /// The unit that one's heights look like, where the other's are metres.
    pub feet: Option<Feet>,
    /// Where heights differ.
    pub map: DifferenceMap,
}

impl Correlation {
    /// Whether every criterion is accepted.
    pub fn is_accepted(&self) -> bool {
        self.criteria.iter().all(Criterion::is_accepted)
    }

    /// Metres of the larger spacing of the posts of both.
    pub fn spacing_m(&self) -> f64 {
        larger_spacing_m(&self.surfaces)
    }
}

pub(super) fn larger_spacing_m(surfaces: &[SurfaceFacts; 2]) -> f64 {
    surfaces.iter().flat_map(|surface| surface.spacing_m).fold(0.0, f64::max)
}

/// One thing that has to agree.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Criterion {
    /// Its name: `heights`, `slopes`, `sight 1 m`.
    pub name: String,
    /// When a place or a pair of places agrees.
    pub agrees_where: String,
    /// Places, or pairs of places, that were judged.
    pub samples: u64,
    /// Those among them that do not agree.
    pub failures: u64,
    /// The most of them that may fail; `None` where so few keep the risk with no failure either.
    pub failures_max: Option<u64>,
}

impl Criterion {
    pub(super) fn new(name: String, agrees_where: String, (samples, failures): (u64, u64), demand: &Demand) -> Self {
        let failures_max = if samples == 0 { None } else { demand.failures_max(samples) };
        Self { name, agrees_where, samples, failures, failures_max }
    }

    /// Whether no more failed than may.
    pub fn is_accepted(&self) -> bool {
        self.failures_max.is_some_and(|most| self.failures <= most)
    }

    /// The share that agrees, and the interval that holds it with 95 % (Clopper and Pearson); `None` without samples.
    pub fn agreement(&self) -> Option<(f64, [f64; 2])> {
        let agreeing = self.samples - self.failures;
        (0 < self.samples).then(|| (agreeing as f64 / self.samples as f64, clopper_pearson(agreeing, self.samples)))
    }
}
