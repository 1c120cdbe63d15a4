//! Forms features so that they take no more of any limit than their share.
//!
//! What is in the ground is chosen by an estimate from thinned stations ([`Choice::choose`]). Then all of it is formed,
//! and what it really cost corrects the estimate of each load module: it is chosen once more, and where that is still
//! too much, the least of it is made coarser and taken back until every limit is kept.
//!
//! What there is no room for still shapes the ground: roads lie flat across, lakes level, between banks water falls.

use std::collections::{BTreeMap, BTreeSet};

use terrain::Each;

use crate::choice::{Amiss, Choice, Chosen, Why, ids};
use crate::clean::Notes;
use crate::forms::{Formed, Scope, Surface, form};
use crate::middles::loose_ends;
use crate::outlay::Outlays;
use crate::pieces::{onto_decks, pieces};
use crate::room::Sharing;
use crate::shares::{Cost, Ledger, Shares, Tier, cost, taken};
use crate::strand::{Graded, Role, Strand, Way};
use crate::stretches::{About, Part, Stretches};
use crate::strokes::strokes;
use crate::take_back::TakingBack;
use crate::{FeatureId, Flaw, Form, Grant, Grants, Kind, Place, Remark, Remedy, Site};

/// Features as they are formed, and what they cost.
#[derive(Clone, Debug, PartialEq)]
pub struct Reserved {
    /// What features put into the ground.
    pub formed: Formed,
    /// What they cost.
    pub cost: Cost,
    /// What was left to each of them.
    pub grants: Grants,
    /// What is not in the ground, in the order of places.
    pub left_out: Vec<LeftOut>,
    /// How much of each class there is, and how much of it is in the ground.
    pub amounts: BTreeMap<u16, Amounts>,
    /// Where what is in the ground ends although its source goes on, with the class and the feature that ends there.
    pub loose_ends: Vec<(Place, u16, FeatureId)>,
}

/// How much there is of a class, and how much of it is in the ground.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Amounts {
    /// Quanta of ways in the area, bridges among them, tunnels not.
    pub wanted: i64,
    /// Those of them that are in the ground.
    pub kept: i64,
    /// Those of these that are to have their width, and those that have it.
    pub wide: [i64; 2],
    /// Whether it is of a kind that may use the larger share of limits.
    pub is_main: bool,
    /// Bodies of water of a hectare and more.
    pub lakes_wanted: u32,
    /// Those of them that are in the ground.
    pub lakes_kept: u32,
}

/// A stretch of a way from junction to junction, or a body of water, that is not in the ground.
#[derive(Clone, Debug, PartialEq)]
pub struct LeftOut {
    /// Its class.
    pub class: u16,
    /// The feature it begins with.
    pub id: FeatureId,
    /// Why.
    pub why: Why,
    /// Quanta of it inside the area.
    pub length: i64,
    /// Its places with their heights in quanta; several lines where it is water with islands.
    pub lines: Vec<Vec<(Place, i32)>>,
}

/// Times that features are chosen by what they really cost.
const ROUNDS: usize = 2;

/// Forms features so that they take no more triangles than there is room for. `about` says of a feature what nothing
/// that is formed does; `each` runs what falls into pieces.
///
/// What has no room is a remark on each of its features.
pub fn reserve(
    graded: &Graded,
    strands: &[Strand],
    site: &Site,
    shares: &Shares,
    about: &dyn Fn(FeatureId) -> Option<About>,
    each: Each,
) -> Reserved {
    let stretches = Stretches::of(graded, strands, site, about);
    let strokes = strokes(&stretches, graded, strands, site);
    let onto_decks = onto_decks(graded.network);
    let outlays = Outlays::of(&stretches, &strokes, (graded, &onto_decks), strands, (shares, site));
    let (stretches, strokes, outlays) = (&stretches, &strokes[..], &outlays);
    let choice = Choice { stretches, strokes, outlays, onto_decks: &onto_decks, shares, graded, site };
    let mut amiss = Amiss::none(shares.modules.len());
    // One full load module on its way makes a line of all of a motorway, so that main kinds may use all of their share
    // for their width, unless other ways lose their place by it.
    let mut wider = Tier::Wide;
    let mut chosen = choice.choose(&amiss, wider);
    let mut taking_back = TakingBack::new(&choice);
    let mut round = 0;
    loop {
        if wider == Tier::Wide && !choice.has_nearly_all(&chosen) {
            (wider, round) = (Tier::Others, 0);
            amiss = Amiss::none(shares.modules.len());
            chosen = choice.choose(&amiss, wider);
            taking_back = TakingBack::new(&choice);
        }
        let grants = grants(&choice, &chosen, strands.len());
        let rounds = (!chosen.is_bound || 0 < round).then_some(Scope::NearChanged);
        let formed = form(&Graded { grants: &grants, ..*graded }, strands, site, each, rounds);
        let cost = cost(&formed, site);
        let taken = taken(&cost, shares);
        let fits = Ledger::new(shares, &taken).surplus().iter().all(|surplus| *surplus == 0);
        if fits && rounds.is_some() {
            return Reserved::of(&choice, &chosen, strands, formed, cost, grants);
        }
        if round < ROUNDS {
            let found = Amiss::of(&chosen, &taken);
            // The second time nothing is offered that the first has refused.
            amiss = if round == 0 { found } else { found.or_more(&amiss) };
            chosen = choice.choose(&amiss, wider);
        } else {
            taking_back.take_back(&mut chosen, &taken, &formed, strands);
        }
        round += 1;
    }
}

impl Reserved {
    fn of(choice: &Choice, chosen: &Chosen, strands: &[Strand], formed: Formed, cost: Cost, grants: Grants) -> Self {
        let (left_out, amounts, ends) = Default::default();
        let mut reserved = Self { formed, cost, grants, left_out, amounts, loose_ends: ends };
        shape(choice, chosen, strands, &mut reserved.formed);
        reserved.formed.remarks.extend(remarks(choice, chosen, strands));
        Remark::sort(&mut reserved.formed.remarks);
        let all = choice.stretches.all.iter().zip(&chosen.ways).zip(0..);
        reserved.left_out = all
            .filter_map(|((of, way), stretch)| {
                let why = way.err().filter(|why| *why != Why::Beyond)?;
                let id = ids(choice, stretch, strands).next()?;
                let lines = lines(choice, stretch, strands);
                Some(LeftOut { class: of.class, id, why, length: of.length, lines })
            })
            .collect();
        for ((stretch, of), way) in (0..).zip(&choice.stretches.all).zip(&chosen.ways) {
            if !of.is_inside {
                continue;
            }
            let amounts = reserved.amounts.entry(of.class).or_default();
            let is_way = of.doubled_area == 0;
            amounts.is_main |= of.is_main(choice.site);
            if is_way {
                amounts.wanted += of.length;
                let Ok(way) = way else { continue };
                amounts.kept += of.length;
                if Way::STRIP <= choice.form_most_of(stretch) {
                    amounts.wide[0] += of.length;
                    amounts.wide[1] += if Way::STRIP <= way.form { of.length } else { 0 };
                }
            } else if of.kind == Kind::Lake && of.is_main(choice.site) {
                amounts.lakes_wanted += 1;
                amounts.lakes_kept += u32::from(way.is_ok());
            }
        }
        let family: BTreeMap<u16, u8> = choice.stretches.all.iter().map(|of| (of.class, of.family())).collect();
        reserved.loose_ends = loose_ends(&reserved.formed.middles, &family, choice.site);
        reserved
    }
}

/// What edges and strands are granted.
fn grants(choice: &Choice, chosen: &Chosen, strands: usize) -> Grants {
    let (mut edges, mut of_strands) = (vec![Grant::OUT; choice.graded.network.edges.len()], vec![Grant::OUT; strands]);
    for (of, way) in choice.stretches.all.iter().zip(&chosen.ways) {
        let grant = way.map_or(Grant::OUT, |Way { tolerance, form }| {
            let most = [Form::Line, Form::Line, Form::StripAlways, Form::Bench][usize::from(form)];
            Grant { tolerance, most, out: false }
        });
        match &of.part {
            Part::Way(_, all) => all.iter().for_each(|edge| {
                let is_wide = way.is_ok_and(|way| way.form == Way::ONTO_DECKS) && choice.onto_decks.contains(edge);
                edges[*edge as usize] = if is_wide { Grant { most: Form::StripAlways, ..grant } } else { grant };
            }),
            Part::Strands(all) => all.iter().for_each(|strand| of_strands[*strand as usize] = grant),
        }
    }
    Grants { edges, strands: of_strands }
}

fn lines(choice: &Choice, stretch: u32, strands: &[Strand]) -> Vec<Vec<(Place, i32)>> {
    let (network, heights) = (choice.graded.network, choice.graded.heights);
    match &choice.stretches.all[stretch as usize].part {
        Part::Way(nodes, _) => {
            let station = |node: &u32| (network.nodes[*node as usize].place, heights[*node as usize]);
            vec![nodes.iter().map(station).collect()]
        }
        Part::Strands(numbers) => numbers.iter().map(|number| strands[*number as usize].stations.clone()).collect(),
    }
}

/// What was done to each feature: left out, as a whole or in part, or coarser than it is asked for.
fn remarks(choice: &Choice, chosen: &Chosen, strands: &[Strand]) -> Vec<Remark> {
    let mut kept: BTreeSet<FeatureId> = BTreeSet::new();
    let mut out: BTreeMap<(FeatureId, Flaw), Place> = BTreeMap::new();
    let mut coarse: BTreeMap<(FeatureId, Remedy), Place> = BTreeMap::new();
    for ((stretch, of), way) in (0..).zip(&choice.stretches.all).zip(&chosen.ways) {
        let mut found = |flaw: Flaw| {
            for id in ids(choice, stretch, strands) {
                let place = out.entry((id, flaw.clone())).or_insert(of.place);
                *place = of.place.min(*place);
            }
        };
        match *way {
            Err(Why::Limit(_)) => found(Flaw::OverShare),
            Err(Why::Stub) => found(Flaw::Stub),
            Err(Why::Alone) => found(Flaw::Alone),
            Err(Why::Pond) => found(Flaw::Pond),
            Err(Why::Beyond) => {}
            Ok(Way { tolerance, form }) => {
                kept.extend(ids(choice, stretch, strands));
                let mut less = |remedy| {
                    for id in ids(choice, stretch, strands) {
                        let place = coarse.entry((id, remedy)).or_insert(of.place);
                        *place = of.place.min(*place);
                    }
                };
                if 0 < tolerance && of.is_inside {
                    less(Remedy::Coarser { times: 1 << tolerance });
                }
                match (form, choice.form_most_of(stretch)) {
                    (..Way::STRIP, Way::STRIP..) if of.is_inside => less(Remedy::BecameLine),
                    (Way::STRIP, Way::BENCH..) if of.is_inside => less(Remedy::BecameStrip),
                    _ => {}
                }
            }
        }
    }
    let mut remarks = Vec::new();
    let mut write = |id, place, flaw, remedy| {
        Notes { id, lattice: choice.site.lattice, remarks: &mut remarks }.write_at(place, flaw, remedy);
    };
    for ((id, flaw), place) in out {
        write(id, place, flaw, if kept.contains(&id) { Remedy::PartLeftOut } else { Remedy::LeftOut });
    }
    coarse.into_iter().for_each(|((id, remedy), place)| write(id, place, Flaw::OverShare, remedy));
    remarks
}

/// Puts the ground of what is left out into what is formed.
fn shape(choice: &Choice, chosen: &Chosen, strands: &[Strand], formed: &mut Formed) {
    let is_out = |way: &Result<_, Why>| way.as_ref().is_err_and(|why: &Why| *why != Why::Beyond);
    let network = choice.graded.network;
    let mut edges = vec![Grant::OUT; network.edges.len()];
    for (of, _) in choice.stretches.all.iter().zip(&chosen.ways).filter(|(_, way)| is_out(way)) {
        match &of.part {
            Part::Way(_, all) => all.iter().for_each(|edge| {
                edges[*edge as usize] = Grant { tolerance: 0, most: Form::StripAlways, out: false };
            }),
            Part::Strands(numbers) => {
                let outlines = numbers.iter().map(|number| &strands[*number as usize]);
                let rings = outlines.filter(|strand| strand.role.is_outline() && strand.is_closed());
                formed.shaped.extend(rings.map(|strand| Surface {
                    class: strand.class,
                    role: strand.role,
                    ring: strand.stations[1..].to_vec(),
                    id: strand.id,
                }));
            }
        }
    }
    let grants = Grants { edges, strands: Vec::new() };
    let pieces = pieces(network, choice.graded.heights, choice.site, &|_| false, &grants);
    let strips = Sharing::of(network, &pieces, choice.graded.heights).faces();
    for face in strips.into_iter().filter(|face| !face.is_deck && 3 <= face.corners.len()) {
        if face.corners.len() == 4 && face.wide.is_some() {
            let [right_a, right_b, left_b, left_a] = [0, 1, 2, 3].map(|corner| face.corners[corner]);
            formed.shaped_slopes.extend([[right_a, right_b], [left_a, left_b]]);
        }
        let (class, id) = (face.class, face.id);
        formed.shaped.push(Surface { class, role: Role::Side, ring: face.corners, id });
    }
    for piece in pieces.iter().filter(|piece| !piece.is_deck()) {
        for (ends, _) in piece.nodes.windows(2).zip(&piece.strips).filter(|(_, is_strip)| !**is_strip) {
            let station = |node: u32| (network.nodes[node as usize].place, choice.graded.heights[node as usize]);
            formed.shaped_slopes.push([station(ends[0]), station(ends[1])]);
        }
    }
    formed.shaped.sort();
    formed.shaped_slopes.sort_unstable();
}
