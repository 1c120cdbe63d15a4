//! Takes back what was chosen where it really cost more than there is room for, the least of each load module first.

use std::collections::BTreeSet;

use crate::choice::{Choice, Chosen, Why, ids};
use crate::forms::Formed;
use crate::shares::{Ledger, Limit, modules_of};
use crate::strand::{Strand, Way};
use crate::stubs::take_back;
use crate::tally::Tally;
use crate::{FeatureId, Place};

/// What there is to take back, by load module.
pub(crate) struct TakingBack<'a> {
    choice: &'a Choice<'a>,
    /// The stretches of each load module with their strokes, the least first.
    by_module: Vec<Vec<(u32, u32)>>,
    /// Rounds gone: each asks for more than the one before.
    round: u32,
}

impl<'a> TakingBack<'a> {
    pub fn new(choice: &'a Choice) -> Self {
        let mut by_module: Vec<Vec<(u32, u32)>> = vec![Vec::new(); choice.shares.modules.len()];
        for number in (0..choice.strokes.len() as u32).rev() {
            let stroke = &choice.strokes[number as usize];
            for &(stretch, _) in stroke.stretches.iter().rev() {
                let outlay = &choice.outlays.all[stretch as usize][0];
                let points = outlay.ends.iter().flat_map(|end| choice.outlays.points[end.point as usize]);
                let modules = points.flatten().map(|(module, _)| module);
                let modules: BTreeSet<u32> = modules.chain(outlay.decks.iter().map(|(module, _)| *module)).collect();
                modules.into_iter().for_each(|module| by_module[module as usize].push((stretch, number)));
            }
        }
        Self { choice, by_module, round: 0 }
    }

    /// Takes back what lies over a limit, by what was really taken.
    pub fn take_back(&mut self, chosen: &mut Chosen, taken: &[i64], formed: &Formed, strands: &[Strand]) {
        let choice = self.choice;
        let mut tally = Tally::new(choice.outlays, Ledger::new(choice.shares, &vec![0; taken.len()]));
        let granted: Vec<(u32, Option<Way>)> = (0..).zip(&chosen.ways).map(|(at, way)| (at, way.ok())).collect();
        tally.set(&granted);
        // From here on the ledger holds what was really taken.
        tally.ledger = Ledger::new(choice.shares, taken);
        let more = (1i64 << self.round.min(16)) - 1;
        self.round += 1;
        let over: Vec<u32> = (0..taken.len() as u32).filter(|module| 0 < tally.ledger.surplus_of(*module)).collect();
        let mut why: Vec<Option<Why>> = chosen.ways.iter().map(|way| way.err()).collect();
        let mut changed = false;
        for module in over {
            changed |= self.relieve(module, more, &mut tally, &mut why);
        }
        if !changed {
            self.evict(&mut tally, &mut why, formed, strands);
        }
        take_back(choice, &mut tally, &mut why);
        let ways = tally.granted.iter().zip(&why);
        chosen.ways = ways.map(|(way, why)| way.ok_or(why.unwrap_or(Why::Limit(Limit::Area)))).collect();
        chosen.is_bound = true;
    }

    /// Makes what lies in a load module coarser, then takes it back, until it fits; whether anything changed.
    fn relieve(&self, module: u32, more: i64, tally: &mut Tally, why: &mut [Option<Why>]) -> bool {
        let choice = self.choice;
        let mut changed = false;
        for is_last in [false, true] {
            for &(stretch, stroke) in &self.by_module[module as usize] {
                if tally.ledger.surplus_of(module) + more <= 0 {
                    return changed;
                }
                let Some(way) = tally.granted[stretch as usize] else { continue };
                if is_last {
                    let (row, col) = choice.shares.module(module);
                    tally.set(&[(stretch, None)]);
                    why[stretch as usize] = Some(Why::Limit(Limit::Module(row, col)));
                    changed = true;
                    continue;
                }
                let least = Way { tolerance: choice.stretches.all[stretch as usize].coarsest(), form: Way::LINE };
                if way != least {
                    let stretches = choice.strokes[stroke as usize].stretches.iter();
                    let kept = stretches.filter(|(at, _)| tally.granted[*at as usize].is_some());
                    let all: Vec<(u32, Option<Way>)> = kept.map(|(at, _)| (*at, Some(least))).collect();
                    tally.set(&all);
                    changed = true;
                }
            }
        }
        changed
    }

    /// Takes back what still has points in load modules that give too much although all of theirs is taken back: points
    /// of neighbours on their sides, the corners of wide roads. The lowest class goes first.
    fn evict(&self, tally: &mut Tally, why: &mut [Option<Why>], formed: &Formed, strands: &[Strand]) {
        let choice = self.choice;
        let is_over = |place: Place| {
            let modules = modules_of(place, choice.site).into_iter();
            let mut numbers = modules.filter_map(|(module, _)| choice.shares.number(module));
            numbers.find(|module| 0 < tally.ledger.surplus_of(*module))
        };
        let places = formed
            .edges
            .iter()
            .flat_map(|edge| [edge.a, edge.b].map(|point| (edge.class, edge.id, formed.points[point as usize].0)));
        let decks =
            formed.decks.iter().flat_map(|deck| deck.corners.iter().map(|(place, _)| (deck.class, deck.id, *place)));
        let mut least: Option<(u16, FeatureId, u32)> = None;
        for (class, id, place) in places.chain(decks) {
            if let Some(module) = is_over(place) {
                least = least.max(Some((class, id, module)));
            }
        }
        let Some((_, id, module)) = least else { return };
        let (row, col) = choice.shares.module(module);
        for stretch in 0..choice.stretches.all.len() as u32 {
            if tally.granted[stretch as usize].is_some() && ids(choice, stretch, strands).any(|other| other == id) {
                tally.set(&[(stretch, None)]);
                why[stretch as usize] = Some(Why::Limit(Limit::Module(row, col)));
            }
        }
    }
}
