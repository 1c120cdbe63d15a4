//! What each feature would put into each load module it runs through, at every step of the ladder: an estimate from
//! thinned stations alone, before anything is rounded together.

use std::collections::{BTreeMap, HashMap};

use crate::cost::modules_of;
use crate::forms::{shared_places, thinned};
use crate::pieces::pieces;
use crate::strand::{Graded, Strand};
use crate::{FeatureId, Form, Grant, Grants, Place, Site};

/// Tolerances of the ladder, as multiples of the usual one.
pub(crate) const TOLERANCES: [u8; 3] = [1, 2, 4];

/// Forms of the ladder: the most a feature may be.
pub(crate) const FORMS: [Form; 3] = [Form::Bench, Form::StripAlways, Form::Line];

/// The end of a segment between two stations that stay.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct End {
    /// Its place, in [`Crowd::points`].
    pub point: u32,
    /// Whether the segment is a strip where it may be one.
    pub wide: bool,
    /// Whether it has slopes where it may.
    pub bench: bool,
}

/// A feature in one load module.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Member {
    pub class: u16,
    pub id: FeatureId,
    /// Its least place there.
    pub place: Place,
    /// Quanta of it that lie there.
    pub length: i64,
    /// Whether it is there as a whole or not at all: what encloses water, and decks.
    pub is_whole: bool,
    /// Both ends of each of its segments, by tolerance.
    pub ends: [Vec<End>; 3],
    /// Triangles of its decks, by tolerance.
    pub decks: [u32; 3],
}

/// The features of one load module, in the order of class and feature.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Crowd {
    pub members: Vec<Member>,
    /// The triangles that each place adds to the load module.
    pub points: Vec<u32>,
}

/// Features by load module (row, column).
pub(crate) type Crowds = BTreeMap<(i32, i32), Crowd>;

/// A segment of a feature between two stations that stay.
struct Arm {
    module: (i32, i32),
    class: u16,
    id: FeatureId,
    ends: [Place; 2],
    wide: bool,
    bench: bool,
    is_deck: bool,
    is_whole: bool,
}

/// All features in their load modules.
pub(crate) fn crowds(graded: &Graded, strands: &[Strand], site: &Site) -> Crowds {
    let shared = shared_places(graded.network, strands);
    let mut crowds: BTreeMap<(i32, i32), Counting> = BTreeMap::new();
    for (number, tolerance) in TOLERANCES.into_iter().enumerate() {
        let grants = Grants::same(Grant { tolerance, ..Grant::ALL });
        for arm in arms(&Graded { grants: &grants, ..*graded }, strands, site, &|place| shared.contains(&place)) {
            let Counting { members, points } = crowds.entry(arm.module).or_default();
            let member = members.entry((arm.class, arm.id)).or_insert_with(|| Member {
                class: arm.class,
                id: arm.id,
                place: arm.ends[0],
                length: 0,
                is_whole: false,
                ends: Default::default(),
                decks: [0; 3],
            });
            member.place = member.place.min(arm.ends[0]).min(arm.ends[1]);
            member.is_whole |= arm.is_whole;
            if number == 0 {
                member.length += site.lattice.length(arm.ends[0], arm.ends[1]);
            }
            if arm.is_deck {
                // As many triangles at most as it has corners.
                member.decks[number] += 4;
            } else {
                let end =
                    |place| End { point: points.number(place, arm.module, site), wide: arm.wide, bench: arm.bench };
                member.ends[number].extend(arm.ends.map(end));
            }
        }
    }
    let crowd = |Counting { members, points }: Counting| Crowd {
        members: members.into_values().collect(),
        points: points.triangles,
    };
    crowds.into_iter().map(|(module, found)| (module, crowd(found))).collect()
}

/// A load module while its features are counted, by class and feature.
#[derive(Default)]
struct Counting {
    members: BTreeMap<(u16, FeatureId), Member>,
    points: Points,
}

/// The places of one load module in the order in which they are met.
#[derive(Default)]
struct Points {
    numbers: HashMap<Place, u32>,
    triangles: Vec<u32>,
}

impl Points {
    fn number(&mut self, place: Place, module: (i32, i32), site: &Site) -> u32 {
        let triangles = &mut self.triangles;
        *self.numbers.entry(place).or_insert_with(|| {
            let here = modules_of(place, site).into_iter().find(|(of, _)| *of == module);
            triangles.push(here.map_or(0, |(_, triangles)| triangles));
            triangles.len() as u32 - 1
        })
    }
}

fn arms(graded: &Graded, strands: &[Strand], site: &Site, shared: &dyn Fn(Place) -> bool) -> Vec<Arm> {
    let Graded { network, heights, beside, grants } = *graded;
    let mut arms = Vec::new();
    for piece in pieces(network, heights, beside, site, shared, grants) {
        for (segment, nodes) in piece.nodes.windows(2).enumerate() {
            let ends = [nodes[0], nodes[1]].map(|node| network.nodes[node as usize].place);
            arms.push(Arm {
                module: site.module_under(ends[0], ends[1]),
                class: piece.traits.class,
                id: piece.id(network, segment),
                ends,
                wide: piece.strips[segment],
                bench: piece.bench,
                is_deck: piece.is_deck(),
                is_whole: piece.is_deck(),
            });
        }
    }
    for strand in strands.iter().flat_map(|strand| thinned(strand, grants, site, shared)) {
        for stations in strand.stations.windows(2) {
            let ends = [stations[0].0, stations[1].0];
            arms.push(Arm {
                module: site.module_under(ends[0], ends[1]),
                class: strand.class,
                id: strand.id,
                ends,
                wide: false,
                bench: false,
                is_deck: false,
                is_whole: strand.role.is_whole(),
            });
        }
    }
    arms
}
