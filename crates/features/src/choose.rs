//! Chooses what is in the ground: whole stretches in the order of their strokes, then finer tolerances and wider forms.
//!
//! 1. Each stretch is granted as a line of the coarsest tolerance where every limit on its way has room for it.
//! 2. What only dangles is taken back ([`crate::stubs`]), and the room that became free is offered once more.
//! 3. Tolerances go down and forms up, the step first that gains the whole stroke most for its triangles.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use crate::choice::{Amiss, Choice, Chosen, Why, less};
use crate::shares::{Ledger, Tier};
use crate::strand::Way;
use crate::stretches::Stretch;
use crate::strokes::Stroke;
use crate::stubs::take_back;
use crate::tally::Tally;
use crate::thin::Tolerance;

/// Posts of area below which a body of water is granted only where it is cheap.
const POND_POSTS: i128 = 12;

impl Choice<'_> {
    /// Chooses where forming took `amiss` of each load module beyond the last estimate. Main kinds become wider within
    /// the share of `wider`.
    pub fn choose(&self, amiss: &Amiss, wider: Tier) -> Chosen {
        let mut tally = Tally::new(self.outlays, Ledger::new(self.shares, &amiss.of_lines));
        let mut why: Vec<Option<Why>> = vec![None; self.stretches.all.len()];
        self.offer(&mut tally, &mut why);
        if take_back(self, &mut tally, &mut why) {
            self.offer(&mut tally, &mut why);
            take_back(self, &mut tally, &mut why);
        }
        let lines = less(tally.ledger.modules(), &amiss.of_lines);
        tally.ledger.add_to_each(&less(&amiss.of_all, &amiss.of_lines));
        let held = self.refine(&mut tally, wider);
        self.beyond(&mut tally, &mut why);
        let is_bound = held || why.iter().flatten().any(|why| *why != Why::Beyond);
        let ways = tally.granted.iter().zip(&why).map(|(way, why)| way.ok_or(why.unwrap_or(Why::Beyond))).collect();
        Chosen { ways, lines, estimate: less(tally.ledger.modules(), &amiss.of_all), is_bound }
    }

    /// Grants every stretch that is not there yet, and was not taken back, what there is room for.
    fn offer(&self, tally: &mut Tally, why: &mut [Option<Why>]) {
        for &(stretch, _) in self.strokes.iter().flat_map(|stroke| &stroke.stretches) {
            let of = &self.stretches.all[stretch as usize];
            let is_open = !matches!(why[stretch as usize], Some(Why::Stub | Why::Alone));
            if tally.granted[stretch as usize].is_some() || !of.is_inside || !is_open {
                continue;
            }
            why[stretch as usize] = self.grant(tally, stretch, of).err();
        }
    }

    fn grant(&self, tally: &mut Tally, stretch: u32, of: &Stretch) -> Result<(), Why> {
        let tier = if of.is_main(self.site) { Tier::Main } else { Tier::Others };
        let way = Some(Way { tolerance: of.coarsest(), form: Way::LINE });
        let changes = tally.try_set(&[(stretch, way)], tier).map_err(Why::Limit)?;
        let post = i128::from(self.site.lattice.steps_per_post());
        let is_pond = 0 < of.doubled_area && of.doubled_area < 2 * POND_POSTS * post * post;
        let free = |module: u32| self.shares.modules[module as usize].others;
        if is_pond && changes.iter().any(|(module, by)| free(*module) <= 2 * by.unsigned_abs()) {
            tally.set(&[(stretch, None)]);
            return Err(Why::Pond);
        }
        Ok(())
    }

    /// Makes strokes finer and wider as far as there is room; whether a limit held one of them back.
    fn refine(&self, tally: &mut Tally, wider: Tier) -> bool {
        let kept = |stroke: &Stroke, tally: &Tally| -> Vec<(u32, Way)> {
            let granted = |(stretch, _): &(u32, bool)| Some((*stretch, tally.granted[*stretch as usize]?));
            stroke.stretches.iter().filter_map(granted).collect()
        };
        let mut heap: BinaryHeap<(u64, Reverse<u32>, Step)> = BinaryHeap::new();
        for (number, stroke) in (0..).zip(self.strokes) {
            let Some((_, way)) = kept(stroke, tally).first().copied() else { continue };
            for step in [Step::Finer, Step::Wider] {
                heap.extend(self.gain(stroke, way, step, tally).map(|gain| (gain, Reverse(number), step)));
            }
        }
        let mut held = false;
        while let Some((_, Reverse(number), step)) = heap.pop() {
            let stroke = &self.strokes[number as usize];
            let of = kept(stroke, tally);
            let changed: Vec<(u32, Option<Way>)> = of.iter().map(|(at, way)| (*at, Some(step.of(*way)))).collect();
            let is_main = self.stretches.all[of[0].0 as usize].is_main(self.site);
            let tier = if is_main && step == Step::Wider { wider } else { Tier::Others };
            match tally.try_set(&changed, tier) {
                Ok(_) => {
                    let way = step.of(of[0].1);
                    heap.extend(self.gain(stroke, way, step, tally).map(|gain| (gain, Reverse(number), step)));
                }
                Err(_) => held = true,
            }
        }
        held
    }

    /// What a step gains a stroke for each triangle; none where there is no such step.
    fn gain(&self, stroke: &Stroke, way: Way, step: Step, tally: &mut Tally) -> Option<u64> {
        let quanta = f64::from(terrain::QUANTA_PER_METRE);
        let gain = match step {
            Step::Finer => {
                let to = usize::from(way.tolerance.checked_sub(1)?);
                Tolerance::ALL[to + 1].aside_m - Tolerance::ALL[to].aside_m
            }
            Step::Wider => {
                let (form, width) = self.form_most(stroke);
                if form <= way.form {
                    return None;
                }
                f64::from(width) / (2.0 * quanta)
            }
        };
        let kept = stroke.stretches.iter().filter(|(stretch, _)| tally.granted[*stretch as usize].is_some());
        let kept: Vec<u32> = kept.map(|(stretch, _)| *stretch).collect();
        let length: i64 = kept.iter().map(|stretch| self.stretches.all[*stretch as usize].length).sum();
        let set = |to: Way| kept.iter().map(|stretch| (*stretch, Some(to))).collect::<Vec<_>>();
        let changes = tally.set(&set(step.of(way)));
        tally.set(&set(way));
        let cost: i64 = changes.iter().map(|(_, by)| by).sum();
        let gain = (gain * quanta) as u64;
        Some((length.unsigned_abs() * gain).checked_div(cost.max(0).unsigned_abs()).unwrap_or(u64::MAX))
    }

    /// The widest form that any part of a stroke may have, and the width of that part.
    fn form_most(&self, stroke: &Stroke) -> (u8, i32) {
        let widest = stroke.stretches.iter().map(|(stretch, _)| self.widest(*stretch)).max();
        widest.unwrap_or_default()
    }

    /// What lies beyond the area goes on as what leads there.
    fn beyond(&self, tally: &mut Tally, why: &mut [Option<Why>]) {
        for (stretch, of) in (0..).zip(&self.stretches.all).filter(|(_, of)| !of.is_inside) {
            let arms = of.joints.into_iter().flatten().flat_map(|joint| self.stretches.at(joint));
            let leads = arms.filter(|arm| {
                let other = &self.stretches.all[arm.stretch as usize];
                other.is_inside && other.class == of.class
            });
            let way = leads.filter_map(|arm| tally.granted[arm.stretch as usize]).next();
            tally.set(&[(stretch, way)]);
            if way.is_none() {
                why[stretch as usize] = Some(Why::Beyond);
            }
        }
    }
}

/// A step to more.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Step {
    Finer,
    Wider,
}

impl Step {
    fn of(self, way: Way) -> Way {
        match self {
            Step::Finer => Way { tolerance: way.tolerance.saturating_sub(1), ..way },
            Step::Wider => Way { form: way.form + 1, ..way },
        }
    }
}
