//! Channels that pass below roads: they have stations close to both sides of the road, so that no more than what lies
//! below it is missing from the ground.

use std::collections::BTreeMap;

use crate::decks::between;
use crate::strand::{Role, Strand};
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
/// How far from the road a station is put in where it would be more, in quanta: 5 m.
const BESIDE: i64 = 5 * 128;

/// The station of a channel beside `road`, on the way to its place `to` where the ground is its own.
pub(crate) fn culvert(line: &Strand, [road, to]: [(Place, i32); 2], site: &Site) -> Option<Culvert> {
    if site.lattice.length(road.0, to.0) < MISSING_MAX {
        return None;
    }
    line.stations.windows(2).find_map(|ends| {
        let is_near = is_near(ends[0].0, ends[1].0, road.0);
        let station = is_near.then(|| beside([ends[0], ends[1]], road.0, to.0, site)).flatten()?;
        Some(Culvert { id: line.id, role: line.role, between: [ends[0].0, ends[1].0], station })
    })
}

/// The place on the line between two stations that lies a little off a road towards `to`, if it has one.
fn beside([a, b]: [(Place, i32); 2], road: Place, to: Place, site: &Site) -> Option<(Place, i32)> {
    let [east, north] = a.0.to(b.0).map(i128::from);
    let along = |place: Place| {
        let [to_east, to_north] = a.0.to(place).map(i128::from);
        east * to_east + north * to_north
    };
    // The line has as many parts as it has squared steps.
    let (squared, length) = (i128::from(a.0.squared_to(b.0)), i128::from(site.lattice.length(a.0, b.0)).max(1));
    let away = i128::from(BESIDE) * squared / length;
    let at = if along(to) < along(road) { along(road) - away } else { along(road) + away };
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
