//! Counts the triangles of features while what is granted to them changes.

use crate::outlay::{End, Outlays};
use crate::shares::{Ledger, Limit, Tier};
use crate::strand::Way;

/// Triangles of what is granted, in every load module.
pub(crate) struct Tally<'a> {
    outlays: &'a Outlays,
    pub ledger: Ledger<'a>,
    /// What each stretch is granted.
    pub granted: Vec<Option<Way>>,
    /// Segments that end at each point: all of them, strips, those with slopes, and those that need no station.
    ends: Vec<[u16; 4]>,
    changes: Vec<(u32, i64)>,
}

impl<'a> Tally<'a> {
    /// Nothing granted yet.
    pub fn new(outlays: &'a Outlays, ledger: Ledger<'a>) -> Self {
        let (granted, ends) = (vec![None; outlays.all.len()], vec![[0; 4]; outlays.points.len()]);
        Self { outlays, ledger, granted, ends, changes: Vec::new() }
    }

    /// Grants some stretches something else.
    pub fn set(&mut self, changed: &[(u32, Option<Way>)]) -> Vec<(u32, i64)> {
        self.changes.clear();
        for &(stretch, way) in changed {
            let before = std::mem::replace(&mut self.granted[stretch as usize], way);
            if before != way {
                self.count(stretch, before, |count| count - 1, -1);
                self.count(stretch, way, |count| count + 1, 1);
            }
        }
        let changes = summed(&mut self.changes);
        self.ledger.add(&changes);
        changes
    }

    /// Grants some stretches something else if no limit is exceeded by it; what it adds to load modules, or the limit.
    pub fn try_set(&mut self, changed: &[(u32, Option<Way>)], tier: Tier) -> Result<Vec<(u32, i64)>, Limit> {
        let before: Vec<(u32, Option<Way>)> =
            changed.iter().map(|(stretch, _)| (*stretch, self.granted[*stretch as usize])).collect();
        let changes = self.set(changed);
        match self.ledger.exceeded(&changes, tier) {
            None => Ok(changes),
            Some(limit) => {
                self.set(&before);
                Err(limit)
            }
        }
    }

    fn count(&mut self, stretch: u32, way: Option<Way>, by: fn(u16) -> u16, sign: i64) {
        let Some(Way { tolerance, form }) = way else { return };
        let outlay = &self.outlays.all[stretch as usize][usize::from(tolerance)];
        self.changes.extend(outlay.decks.iter().map(|(module, triangles)| (*module, sign * i64::from(*triangles))));
        for &End { point, strip_from, bench, free } in &outlay.ends {
            let ends = &mut self.ends[point as usize];
            let before = corners(*ends);
            let is_strip = strip_from.is_some_and(|from| from <= form);
            for (count, is) in ends.iter_mut().zip([true, is_strip, bench && form == Way::BENCH, free]) {
                if is {
                    *count = by(*count);
                }
            }
            let more = corners(*ends) - before;
            if more != 0 {
                let modules = self.outlays.points[point as usize].iter().flatten();
                self.changes.extend(modules.map(|(module, triangles)| (*module, more * i64::from(*triangles))));
            }
        }
    }
}

/// The points that features put where their segments end: none where a stroke needs no station and nothing else meets
/// it; one of lines, two of strips, where more of these meet one between any two; and two more where slopes meet the
/// ground.
fn corners([all, strips, benches, free]: [u16; 4]) -> i64 {
    if free == 2 && all == 2 {
        return 0;
    }
    let own = if 0 < strips { strips.max(2) } else { all.min(1) };
    i64::from(own) + if 0 < benches { 2 } else { 0 }
}

/// Changes with each load module once, in order.
fn summed(changes: &mut [(u32, i64)]) -> Vec<(u32, i64)> {
    changes.sort_unstable_by_key(|(module, _)| *module);
    let sums = changes.chunk_by(|a, b| a.0 == b.0).map(|same| (same[0].0, same.iter().map(|(_, by)| by).sum()));
    sums.filter(|(_, by): &(u32, i64)| *by != 0).collect()
}
