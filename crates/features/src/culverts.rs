//! Channels that pass below roads: they have stations close to the feet of the road's banks on both sides, so that no
//! more than what lies below these is missing from the ground. One that came back to the surface nearer to the road
//! would cut its bank down to the channel's height there, or stand out of the cut.

use std::collections::BTreeMap;

use crate::decks::between;
use crate::strand::{Role, Strand};
use crate::toes::{CUT_RUN, FILL_RUN, ROADSIDE_REACH_M};
use crate::{FeatureId, Place, Site};

/// A station that a channel is to have close to a road under which it passes, so that no more of it is missing there.
pub(crate) struct Culvert {
    id: FeatureId,
    role: Role,
    /// The stations between which it lies.
    between: [Place; 2],
    station: (Place, i32),
}

/// How much of a channel may be missing on one side of a road, in quanta: 15 m.
const MISSING_MAX: i64 = 15 * 128;
/// How far from the foot of the bank a station is put in where it would be more, in quanta: 5 m.
const BESIDE: i64 = 5 * 128;
/// How far a bank reaches at most, in quanta.
const BANK_MAX: i64 = ROADSIDE_REACH_M as i64 * 128;
/// Times that the foot of a bank is found again from the height of the channel there.
const ROUNDS: usize = 3;

/// A place of a channel in a road's bank, or on what it passes below.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) struct Bank {
    /// The height of what it passes below, in quanta.
    height: i32,
    /// How far along the channel that is, in quanta.
    away: i64,
}

impl Bank {
    /// What a channel passes below at this very place.
    pub fn at(height: i32) -> Self {
        Self { height, away: 0 }
    }

    /// How much farther the bank reaches where the channel has this height.
    fn rest(self, channel: i32) -> i64 {
        let off = i64::from(self.height) - i64::from(channel);
        let run = off.unsigned_abs() as f64 * if 0 < off { FILL_RUN } else { CUT_RUN };
        (run as i64).min(BANK_MAX) - self.away
    }
}

/// For each place of a channel the bank in which it lies, if it lies in one; its own heights are `own`, and `road` has
/// the height of a road that it passes below there.
pub(crate) fn in_banks(
    places: &[Place],
    own: &[i32],
    road: impl Fn(usize) -> Option<i32>,
    site: &Site,
) -> Vec<Option<Bank>> {
    let mut banks: Vec<Option<Bank>> = vec![None; places.len()];
    for (at, height) in (0..places.len()).filter_map(|at| Some((at, road(at)?))) {
        banks[at] = Some(Bank::at(height));
        let mut follow = |others: &mut dyn Iterator<Item = usize>| {
            let (mut from, mut away) = (places[at], 0);
            for other in others {
                away += site.lattice.length(from, places[other]);
                from = places[other];
                let bank = Bank { height, away };
                if bank.rest(own[other]) <= 0 {
                    break;
                }
                if banks[other].is_none_or(|known| known.rest(own[other]) < bank.rest(own[other])) {
                    banks[other] = Some(bank);
                }
            }
        };
        follow(&mut (at + 1..places.len()));
        follow(&mut (0..at).rev());
    }
    banks
}

/// The station of a channel beside the foot of the bank in which its place `hidden` lies, on the way to its place `to`,
/// which lies in none.
pub(crate) fn culvert(line: &Strand, [hidden, to]: [(Place, i32); 2], bank: Bank, site: &Site) -> Option<Culvert> {
    let length = site.lattice.length(hidden.0, to.0);
    if length < MISSING_MAX {
        return None;
    }
    let mut rest = bank.rest(hidden.1).max(0);
    for _ in 0..ROUNDS {
        let along = (i64::from(to.1) - i64::from(hidden.1)) * rest.min(length) / length;
        rest = bank.rest(hidden.1 + along as i32).max(0);
    }
    line.stations.windows(2).find_map(|ends| {
        let is_near = is_near(ends[0].0, ends[1].0, hidden.0);
        let beside = || beside([ends[0], ends[1]], [hidden.0, to.0], rest + BESIDE, site);
        let station = is_near.then(beside).flatten()?;
        Some(Culvert { id: line.id, role: line.role, between: [ends[0].0, ends[1].0], station })
    })
}

/// The place on the line between two stations that lies so many quanta from a place of it towards another, if it has
/// one.
fn beside([a, b]: [(Place, i32); 2], [from, to]: [Place; 2], away: i64, site: &Site) -> Option<(Place, i32)> {
    let [east, north] = a.0.to(b.0).map(i128::from);
    let along = |place: Place| {
        let [to_east, to_north] = a.0.to(place).map(i128::from);
        east * to_east + north * to_north
    };
    // The line has as many parts as it has squared steps.
    let (squared, length) = (i128::from(a.0.squared_to(b.0)), i128::from(site.lattice.length(a.0, b.0)).max(1));
    let away = i128::from(away) * squared / length;
    let at = if along(to) < along(from) { along(from) - away } else { along(from) + away };
    if at <= 0 || squared <= at {
        return None;
    }
    let steps = |of: i128| ((2 * of * at + squared).div_euclid(2 * squared)) as i32;
    let place = Place::new(a.0.row + steps(north), a.0.col + steps(east));
    (place != a.0 && place != b.0).then(|| (place, between([a.0, b.0], [a.1, b.1], place)))
}

/// Gives channels the stations of their culverts; whether there were any.
pub(crate) fn enter_culverts(strands: &mut [Strand], culverts: Vec<Culvert>) -> bool {
    let mut of: BTreeMap<(FeatureId, Role), Vec<Culvert>> = BTreeMap::new();
    let is_any = !culverts.is_empty();
    culverts.into_iter().for_each(|culvert| of.entry((culvert.id, culvert.role)).or_default().push(culvert));
    for strand in strands {
        let Some(culverts) = of.get(&(strand.id, strand.role)) else { continue };
        let mut stations = Vec::with_capacity(strand.stations.len());
        for ends in strand.stations.windows(2) {
            stations.push(ends[0]);
            let between = culverts.iter().filter(|culvert| culvert.between == [ends[0].0, ends[1].0]);
            let mut new: Vec<(Place, i32)> = between.map(|culvert| culvert.station).collect();
            new.sort_by_key(|(place, _)| ends[0].0.squared_to(*place));
            stations.extend(new);
        }
        stations.extend(strand.stations.last());
        stations.dedup_by_key(|(place, _)| *place);
        strand.stations = stations;
    }
    is_any
}

/// Whether a place lies within a step of the line between two others, and beside it.
pub(crate) fn is_near(a: Place, b: Place, place: Place) -> bool {
    let ([east, north], [to_east, to_north]) = (a.to(b), a.to(place));
    let (cross, dot) = (east * to_north - north * to_east, east * to_east + north * to_north);
    let squared = east * east + north * north;
    (0..=squared).contains(&dot) && i128::from(cross) * i128::from(cross) <= i128::from(squared)
}
