//! Takes back what only dangles: ends at which the source goes on and nothing that is granted does, soon after a
//! junction, and small pieces of the road network that hang together with nothing.

use std::cmp::Reverse;
use std::collections::BTreeSet;

use terrain::QUANTA_PER_METRE;

use crate::choice::{Choice, Why};
use crate::strand::Way;
use crate::stretches::{Arm, Stretches};
use crate::tally::Tally;

/// Shorter than this, in quanta, what dangles is taken back: 300 m.
const STUB_MAX: i64 = 300 * QUANTA_PER_METRE as i64;

/// Shorter than this, in quanta, roads that reach neither the border nor others are taken back: 3 km.
const ALONE_MAX: i64 = 3000 * QUANTA_PER_METRE as i64;

/// Takes back what dangles; whether there was any.
pub(crate) fn take_back(choice: &Choice, tally: &mut Tally, why: &mut [Option<Why>]) -> bool {
    let dangling = Dangling { choice, stroke_of: stroke_of(choice) };
    let stubs = dangling.take_back_stubs(tally, why);
    let alone = dangling.take_back_alone(tally, why);
    stubs || alone
}

/// The stroke of each stretch.
fn stroke_of(choice: &Choice) -> Vec<u32> {
    let mut of = vec![0; choice.stretches.all.len()];
    for (number, stroke) in (0..).zip(choice.strokes) {
        stroke.stretches.iter().for_each(|(stretch, _)| of[*stretch as usize] = number);
    }
    of
}

/// The arms at a joint of what is granted of one family and lies in the area.
fn granted_at<'a>(
    stretches: &'a Stretches,
    granted: &'a [Option<Way>],
    joint: u32,
    family: u8,
) -> impl Iterator<Item = Arm> + Clone + 'a {
    stretches.at(joint).iter().copied().filter(move |arm| {
        let of = &stretches.all[arm.stretch as usize];
        of.family() == family && of.is_inside && granted[arm.stretch as usize].is_some()
    })
}

struct Dangling<'a> {
    choice: &'a Choice<'a>,
    stroke_of: Vec<u32>,
}

impl Dangling<'_> {
    /// Whether what is granted ends at a joint where the source goes on.
    fn is_loose(&self, granted: &[Option<Way>], stretch: u32, joint: u32) -> bool {
        let stretches = self.choice.stretches;
        let of = &stretches.all[stretch as usize];
        let meet = granted_at(stretches, granted, joint, of.family()).take(2).count();
        let is_border = self.choice.site.on_border(stretches.joints[joint as usize]);
        !of.is_hidden && meet == 1 && !is_border && stretches.goes_on(joint, stretch)
    }

    fn take_back_stubs(&self, tally: &mut Tally, why: &mut [Option<Why>]) -> bool {
        let stretches = self.choice.stretches;
        // The lowest class first; of one, those granted last.
        let key = |stretch: u32| (Reverse(self.stroke_of[stretch as usize]), Reverse(stretch));
        let mut open = BTreeSet::new();
        for stretch in (0..stretches.all.len() as u32).filter(|at| tally.granted[*at as usize].is_some()) {
            let joints = stretches.all[stretch as usize].joints.into_iter().flatten();
            open.extend(joints.map(|joint| (key(stretch), joint)));
        }
        let mut found = false;
        while let Some(((_, Reverse(stretch)), joint)) = open.pop_first() {
            let of = &stretches.all[stretch as usize];
            let is_there = of.is_inside && tally.granted[stretch as usize].is_some();
            if !is_there
                || !self.is_loose(&tally.granted, stretch, joint)
                || !self.is_stub(&tally.granted, stretch, joint)
            {
                continue;
            }
            tally.set(&[(stretch, None)]);
            why[stretch as usize] = Some(Why::Stub);
            found = true;
            for joint in of.joints.into_iter().flatten() {
                let next = granted_at(stretches, &tally.granted, joint, of.family());
                open.extend(next.map(|arm| (key(arm.stretch), joint)));
            }
        }
        found
    }

    /// Whether what ends at a joint is too short from there to the next junction, or lies in one load module.
    fn is_stub(&self, granted: &[Option<Way>], stretch: u32, joint: u32) -> bool {
        let stretches = self.choice.stretches;
        let (mut length, mut at, mut from) = (0, stretch, joint);
        loop {
            let of = &stretches.all[at as usize];
            length += of.length;
            if STUB_MAX <= length {
                return self.is_in_one_module(granted, stretch);
            }
            let Some([first, last]) = of.joints else { return false };
            let to = if first == from { last } else { first };
            let mut others = granted_at(stretches, granted, to, of.family()).filter(|arm| arm.stretch != at);
            let is_border = self.choice.site.on_border(stretches.joints[to as usize]);
            match (others.next(), others.next()) {
                (Some(next), None) if !is_border && next.stretch != stretch => (at, from) = (next.stretch, to),
                _ => return true,
            }
        }
    }

    /// Whether all that is granted of the stroke of a stretch lies in one load module.
    fn is_in_one_module(&self, granted: &[Option<Way>], stretch: u32) -> bool {
        let (choice, mut module) = (self.choice, None);
        let stroke = &choice.strokes[self.stroke_of[stretch as usize] as usize];
        for (stretch, _) in stroke.stretches.iter().filter(|(at, _)| granted[*at as usize].is_some()) {
            for ends in choice.outlays.all[*stretch as usize][0].ends.iter() {
                let mut modules = choice.outlays.points[ends.point as usize].iter().flatten();
                if let (Some((own, _)), None) = (modules.next(), modules.next())
                    && *module.get_or_insert(*own) != *own
                {
                    return false;
                }
            }
        }
        module.is_some()
    }

    /// Takes back roads that hang together with less than 3 km and do not reach the border, where their source goes on.
    fn take_back_alone(&self, tally: &mut Tally, why: &mut [Option<Why>]) -> bool {
        let stretches = self.choice.stretches;
        let is_meant = |at: u32, tally: &Tally| {
            let of = &stretches.all[at as usize];
            of.family() == 0 && of.is_inside && tally.granted[at as usize].is_some()
        };
        let mut seen = vec![false; stretches.all.len()];
        let mut found = false;
        for first in 0..stretches.all.len() as u32 {
            if seen[first as usize] || !is_meant(first, tally) {
                continue;
            }
            let (mut part, mut at) = (vec![first], 0);
            seen[first as usize] = true;
            let (mut length, mut stays) = (0, false);
            let mut is_whole = true;
            while let Some(&stretch) = part.get(at) {
                at += 1;
                let of = &stretches.all[stretch as usize];
                length += of.length;
                for joint in of.joints.into_iter().flatten() {
                    stays |= self.choice.site.on_border(stretches.joints[joint as usize]);
                    for arm in stretches.at(joint) {
                        let other = &stretches.all[arm.stretch as usize];
                        if is_meant(arm.stretch, tally) {
                            if !std::mem::replace(&mut seen[arm.stretch as usize], true) {
                                part.push(arm.stretch);
                            }
                        } else if other.family() == 0 && other.is_inside {
                            is_whole = false;
                        }
                    }
                }
            }
            if !stays && !is_whole && length < ALONE_MAX {
                let changed: Vec<_> = part.iter().map(|stretch| (*stretch, None)).collect();
                tally.set(&changed);
                part.iter().for_each(|stretch| why[*stretch as usize] = Some(Why::Alone));
                found = true;
            }
        }
        found
    }
}
