//! What there is to choose from, and what came of it.

use std::collections::{BTreeMap, BTreeSet};

use crate::outlay::Outlays;
use crate::pieces::is_narrow;
use crate::shares::{Limit, Shares};
use crate::strand::{Graded, Strand, Way};
use crate::stretches::{Part, Stretches};
use crate::strokes::Stroke;
use crate::{FeatureId, Form, Site};

/// Why a stretch is not in the ground.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Why {
    /// A limit has no room for it.
    Limit(Limit),
    /// It would end where its source goes on, soon after a junction or inside one load module.
    Stub,
    /// It would hang together with too little.
    Alone,
    /// A small body of water that would cost too much.
    Pond,
    /// It lies beyond the area, and nothing in the ground leads to it.
    Beyond,
}

/// What there is to choose from.
pub(crate) struct Choice<'a> {
    pub stretches: &'a Stretches,
    pub strokes: &'a [Stroke],
    pub outlays: &'a Outlays,
    /// Edges by which ways lead onto decks ([`crate::pieces::onto_decks`]).
    pub onto_decks: &'a BTreeSet<u32>,
    pub shares: &'a Shares,
    pub graded: &'a Graded<'a>,
    pub site: &'a Site,
}

/// What was chosen: of each stretch what it is granted, or why it is not.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Chosen {
    pub ways: Vec<Result<Way, Why>>,
    /// Triangles of each load module by the estimate, while all were lines of the coarsest tolerance.
    pub lines: Vec<i64>,
    /// The same of what was chosen in the end.
    pub estimate: Vec<i64>,
    /// Whether any limit was in the way of anything.
    pub is_bound: bool,
}

/// Triangles of each load module that forming took beyond the estimate.
#[derive(Clone, Debug)]
pub(crate) struct Amiss {
    /// The part that lines pay for, before any became finer or wider: what wide roads take of a load module beyond the
    /// estimate is no reason to leave other ways out.
    pub of_lines: Vec<i64>,
    /// All of it.
    pub of_all: Vec<i64>,
}

impl Amiss {
    /// Nothing yet, in so many load modules.
    pub fn none(modules: usize) -> Self {
        Self { of_lines: vec![0; modules], of_all: vec![0; modules] }
    }

    /// What was `taken` beyond the estimate of what was chosen: lines pay by their part of the estimate.
    pub fn of(chosen: &Chosen, taken: &[i64]) -> Self {
        let of_all = less(taken, &chosen.estimate);
        let estimates = chosen.lines.iter().zip(&chosen.estimate);
        let of_lines = of_all.iter().zip(estimates).map(|(all, (lines, estimate))| match estimate {
            1.. => all * lines / estimate,
            _ => *all,
        });
        Self { of_lines: of_lines.collect(), of_all }
    }

    /// The greater of both, in each load module.
    pub fn or_more(self, other: &Self) -> Self {
        let most =
            |one: Vec<i64>, other: &[i64]| one.into_iter().zip(other).map(|(one, other)| one.max(*other)).collect();
        Self { of_lines: most(self.of_lines, &other.of_lines), of_all: most(self.of_all, &other.of_all) }
    }
}

/// Differences, load module by load module.
pub(crate) fn less(all: &[i64], some: &[i64]) -> Vec<i64> {
    all.iter().zip(some).map(|(all, some)| all - some).collect()
}

/// One part in so many may be left out where nearly everything is in the ground.
const LEFT_OUT_PARTS: i64 = 20;

impl Choice<'_> {
    /// Whether nearly everything inside the area was chosen, by length, of each class.
    pub fn has_nearly_all(&self, chosen: &Chosen) -> bool {
        let mut of_class: BTreeMap<u16, [i64; 2]> = BTreeMap::new();
        for (of, way) in self.stretches.all.iter().zip(&chosen.ways).filter(|(of, _)| of.is_inside) {
            let [all, out] = of_class.entry(of.class).or_default();
            *all += of.length;
            *out += if way.is_err() { of.length } else { 0 };
        }
        of_class.values().all(|[all, out]| LEFT_OUT_PARTS * out <= *all)
    }

    /// The widest form that any part of a stretch may have.
    pub fn form_most_of(&self, stretch: u32) -> u8 {
        self.widest(stretch).0
    }

    /// The widest form that any part of a stretch may have, and the width of that part.
    pub fn widest(&self, stretch: u32) -> (u8, i32) {
        let network = self.graded.network;
        let mut most = (Way::LINE, 0);
        if let Part::Way(_, edges) = &self.stretches.all[stretch as usize].part {
            for traits in edges.iter().map(|edge| network.traits(*edge)).filter(|traits| !is_narrow(traits, network)) {
                let form = match traits.form {
                    Form::Line | Form::Polygon => Way::LINE,
                    Form::Strip | Form::StripAlways => Way::STRIP,
                    Form::Bench => Way::BENCH,
                };
                most = most.max((form, traits.width));
            }
        }
        most
    }
}

/// The features of a stretch.
pub(crate) fn ids<'a>(
    choice: &'a Choice,
    stretch: u32,
    strands: &'a [Strand],
) -> Box<dyn Iterator<Item = FeatureId> + 'a> {
    let network = choice.graded.network;
    match &choice.stretches.all[stretch as usize].part {
        Part::Way(_, edges) => {
            Box::new(edges.iter().map(|edge| network.ways[network.edges[*edge as usize].way as usize].id))
        }
        Part::Strands(numbers) => Box::new(numbers.iter().map(|number| strands[*number as usize].id)),
    }
}
