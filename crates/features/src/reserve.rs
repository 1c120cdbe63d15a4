//! Forms features so that they take no more of any limit than their share.
//!
//! What each would cost is estimated from thinned stations ([`crowds`]), and the ladder takes those of crowded load
//! modules down ([`fit`]). Then all are formed, and what they really cost corrects the estimate of each load module:
//! twice upwards too, so that room which is left is given back, then downwards until no load module gives too much.

use std::collections::{BTreeMap, BTreeSet, HashMap, HashSet};

use crate::clean::Notes;
use crate::cost::{Cost, cost, modules_of, modules_under};
use crate::forms::{Formed, form};
use crate::ladder::{Claim, Fitted, as_asked, fit, tell};
use crate::members::{Crowd, Crowds, Member, crowds};
use crate::strand::{Graded, Strand};
use crate::{FeatureId, Flaw, Grants, Place, Remark, Remedy, Site};

/// What features may take.
pub trait Room {
    /// Triangles of a load module (row, column).
    fn of(&self, module: (i32, i32)) -> u32;

    /// Leaves less to load modules where this is too much for several of them together.
    fn narrow(&mut self, cost: &Cost);

    /// Leaves more to those of `short` again, as far as this is less than several of them may take together; false
    /// when nothing is left to give.
    fn widen(&mut self, cost: &Cost, short: &BTreeSet<(i32, i32)>) -> bool;
}

/// As many triangles for every load module, and for several as many as for each.
impl Room for u32 {
    fn of(&self, _module: (i32, i32)) -> u32 {
        *self
    }

    fn narrow(&mut self, _cost: &Cost) {}

    fn widen(&mut self, _cost: &Cost, _short: &BTreeSet<(i32, i32)>) -> bool {
        false
    }
}

/// Features as they are formed, and what they cost.
#[derive(Clone, Debug, PartialEq)]
pub struct Reserved {
    /// What features put into the ground.
    pub formed: Formed,
    /// What they cost.
    pub cost: Cost,
    /// What was left to those that were too costly.
    pub grants: Grants,
}

/// Rounds in which load modules that give less than they may get features back, by the estimate and by what features
/// really cost.
const ROUNDS_UP: [usize; 2] = [8, 2];

/// Forms features so that they take no more triangles than there is room for.
///
/// Where they would, the features of that load module go down the ladder. How far is a remark for each.
pub fn reserve(graded: &Graded, strands: &[Strand], site: &Site, room: &mut dyn Room) -> Reserved {
    let mut share = Share::new(crowds(graded, strands, site));
    for round in 0.. {
        room.narrow(&share.cost());
        let up = round < ROUNDS_UP[0] && room.widen(&share.cost(), &share.short());
        if !share.correct(&share.cost(), &*room, up, 1) {
            break;
        }
    }
    let mut round = 0;
    loop {
        let grants = share.grants();
        let mut formed = form(&Graded { grants: &grants, ..*graded }, strands, site);
        let cost = cost(&formed, site);
        room.narrow(&cost);
        let up = round < ROUNDS_UP[1];
        let haste = 1 << round.saturating_sub(ROUNDS_UP[1]).min(16);
        if up {
            room.widen(&cost, &share.short());
        }
        if !share.correct(&cost, &*room, up, haste) && !share.evict(&formed, &cost, site, &*room) {
            formed.remarks.extend(share.remarks(site));
            Remark::sort(&mut formed.remarks);
            return Reserved { formed, cost, grants };
        }
        round += 1;
    }
}

/// What features are left in every load module.
struct Share {
    crowds: Crowds,
    /// All of them as they are asked for.
    asked: BTreeMap<(i32, i32), Fitted>,
    /// What is left where there is less room, and the triangles that the ladder was asked for.
    less: BTreeMap<(i32, i32), (u32, Fitted)>,
    /// Left out of a load module whatever there is room for.
    gone: HashSet<(FeatureId, (i32, i32))>,
    /// Left out wherever they lie, with a place.
    out: BTreeMap<FeatureId, Place>,
    /// The load modules of what is there as a whole or not at all.
    whole: BTreeMap<FeatureId, Vec<(i32, i32)>>,
    /// What is whole and stays at the cost of others, because more would be lost without it.
    first: BTreeSet<FeatureId>,
}

impl Share {
    fn new(crowds: Crowds) -> Self {
        let asked = crowds.iter().map(|(module, crowd)| (*module, as_asked(crowd))).collect();
        let mut whole: BTreeMap<FeatureId, Vec<(i32, i32)>> = BTreeMap::new();
        for (module, crowd) in &crowds {
            for member in crowd.members.iter().filter(|member| member.is_whole) {
                whole.entry(member.id).or_default().push(*module);
            }
        }
        let (less, gone, out, first) = Default::default();
        Self { crowds, asked, less, gone, out, whole, first }
    }

    fn fitted(&self, module: &(i32, i32)) -> &Fitted {
        self.less.get(module).map_or_else(|| &self.asked[module], |(_, fitted)| fitted)
    }

    /// Fits load modules to what the ladder is asked for, and others of what is whole and so went out there.
    fn aim(&mut self, aims: Vec<((i32, i32), u32)>) {
        let mut again: BTreeMap<(i32, i32), u32> = aims.into_iter().collect();
        while !again.is_empty() {
            let mut refused: BTreeMap<FeatureId, Place> = BTreeMap::new();
            for (module, aim) in std::mem::take(&mut again) {
                let Some(crowd) = self.crowds.get(&module) else { continue };
                let fitted = fit(crowd, aim, &|member| self.claim(member, module));
                let whole = crowd.members.iter().zip(&fitted.rungs).filter(|(of, rung)| of.is_whole && rung.is_out());
                let whole = whole.filter(|(member, _)| !self.out.contains_key(&member.id));
                refused.extend(whole.map(|(member, _)| (member.id, member.place)));
                self.less.insert(module, (aim, fitted));
            }
            for (id, place) in refused {
                if self.first.contains(&id) || !self.is_worth_it(id) {
                    self.first.remove(&id);
                    self.out.insert(id, place);
                } else {
                    self.first.insert(id);
                }
                again.extend(self.whole[&id].iter().map(|module| (*module, self.aim_of(module))));
            }
        }
    }

    fn claim(&self, member: &Member, module: (i32, i32)) -> Claim {
        if self.out.contains_key(&member.id) || self.gone.contains(&(member.id, module)) {
            Claim::Gone
        } else if self.first.contains(&member.id) {
            Claim::First
        } else {
            Claim::Usual
        }
    }

    fn aim_of(&self, module: &(i32, i32)) -> u32 {
        self.less.get(module).map_or(self.asked[module].triangles, |(aim, _)| *aim)
    }

    /// Whether more metres of features stay with something whole than without it.
    fn is_worth_it(&self, id: FeatureId) -> bool {
        // None where it cannot stay whatever is done, which is less than anything.
        let kept = |claim: Claim| {
            let mut length = 0;
            for module in &self.whole[&id] {
                let crowd = &self.crowds[module];
                let of = |member: &Member| if member.id == id { claim } else { self.claim(member, *module) };
                let fitted = fit(crowd, self.aim_of(module), &of);
                let mut stays = crowd.members.iter().zip(&fitted.rungs).filter(|(_, rung)| !rung.is_out());
                if claim == Claim::First && !stays.clone().any(|(member, _)| member.id == id) {
                    return None;
                }
                length += stays.by_ref().map(|(member, _)| member.length).sum::<i64>();
            }
            Some(length)
        };
        kept(Claim::Gone) < kept(Claim::First)
    }

    /// The load modules of features, with what the ladder is asked for there.
    fn with_any_of(&self, features: &BTreeSet<FeatureId>) -> Vec<((i32, i32), u32)> {
        if features.is_empty() {
            return Vec::new();
        }
        let holds = |crowd: &Crowd| crowd.members.iter().any(|member| features.contains(&member.id));
        let of = self.crowds.iter().filter(|(_, crowd)| holds(crowd));
        of.map(|(module, _)| (*module, self.aim_of(module))).collect()
    }

    /// What features would cost, by the estimate.
    fn cost(&self) -> Cost {
        self.asked.keys().map(|module| (*module, BTreeMap::from([(0, self.fitted(module).triangles)]))).collect()
    }

    /// Load modules whose features have less than they ask for.
    fn short(&self) -> BTreeSet<(i32, i32)> {
        let is_short = |(module, (_, fitted)): (&(i32, i32), &(u32, Fitted))| {
            (fitted.triangles < self.asked[module].triangles).then_some(*module)
        };
        self.less.iter().filter_map(is_short).collect()
    }

    /// Takes what features cost into account; whether anything changed. Load modules that give too much aim lower by
    /// `haste` times that; those that give less than they may aim higher where `up`.
    fn correct(&mut self, cost: &Cost, room: &dyn Room, up: bool, haste: u32) -> bool {
        let mut aims = Vec::new();
        for (&module, asked) in &self.asked {
            let (taken, most) = (taken_of(cost, module), room.of(module));
            let estimate = self.fitted(&module).triangles;
            if most < taken && 0 < estimate {
                aims.push((module, estimate.saturating_sub((taken - most).saturating_mul(haste))));
            } else if up && estimate < asked.triangles && taken < most {
                aims.push((module, estimate.saturating_add(most - taken)));
            }
        }
        let before = self.less.clone();
        self.aim(aims);
        self.less != before
    }

    /// Leaves out what is still there in load modules that give too much although all of theirs is left out: points
    /// of neighbours on their sides, the corners of wide roads. The lowest class goes first.
    fn evict(&mut self, formed: &Formed, cost: &Cost, site: &Site, room: &dyn Room) -> bool {
        let over: BTreeMap<(i32, i32), u32> = cost
            .keys()
            .map(|&module| (module, taken_of(cost, module).saturating_sub(room.of(module))))
            .filter(|(_, surplus)| 0 < *surplus)
            .collect();
        let mut changed = BTreeSet::new();
        for (module, touching) in touching(formed, site, &over) {
            let mut surplus = over[&module];
            for ((_, id, piece), (triangles, place)) in touching.into_iter().rev() {
                if surplus == 0 {
                    break;
                }
                surplus = surplus.saturating_sub(triangles);
                if !self.gone.insert((id, piece)) {
                    self.out.entry(id).or_insert(place);
                }
                changed.insert(id);
            }
        }
        self.aim(self.with_any_of(&changed));
        !changed.is_empty()
    }

    fn grants(&self) -> Grants {
        let mut grants = Grants::default();
        for (module, (_, fitted)) in &self.less {
            for (member, rung) in self.crowds[module].members.iter().zip(&fitted.rungs) {
                // What is whole is left out wherever it lies, or nowhere.
                if !(member.is_whole && rung.is_out()) {
                    grants.set(member.id, *module, rung.grant());
                }
            }
        }
        self.out.keys().for_each(|id| _ = grants.leave_out(*id));
        grants
    }

    /// What was done to each feature, and where.
    fn remarks(&self, site: &Site) -> Vec<Remark> {
        let mut whole: HashMap<FeatureId, (bool, Place)> = HashMap::new();
        for (module, crowd) in &self.crowds {
            for (member, rung) in crowd.members.iter().zip(&self.fitted(module).rungs) {
                let of = whole.entry(member.id).or_insert((true, member.place));
                *of = (of.0 && rung.is_out(), of.1.min(member.place));
            }
        }
        self.out.iter().for_each(|(id, place)| _ = whole.insert(*id, (true, *place)));
        let mut remarks = Vec::new();
        let write = |remarks: &mut Vec<Remark>, id, place, remedy| {
            Notes { id, lattice: site.lattice, remarks }.write_at(place, Flaw::OverShare, remedy)
        };
        whole.iter().filter(|(_, of)| of.0).for_each(|(id, of)| write(&mut remarks, *id, of.1, Remedy::LeftOut));
        for (module, (_, fitted)) in &self.less {
            let members = self.crowds[module].members.iter().zip(&fitted.rungs);
            for (member, rung) in members.filter(|(member, _)| !whole[&member.id].0) {
                if rung.is_out() {
                    write(&mut remarks, member.id, member.place, Remedy::PartLeftOut);
                } else {
                    tell(member, *rung, site, &mut remarks);
                }
            }
        }
        remarks
    }
}

fn taken_of(cost: &Cost, module: (i32, i32)) -> u32 {
    cost.get(&module).map_or(0, |classes| classes.values().sum())
}

/// What has points in a load module: class, feature and the load module its edges lie in, with triangles and a place.
type Touching = BTreeMap<(u16, FeatureId, (i32, i32)), (u32, Place)>;

fn touching(formed: &Formed, site: &Site, modules: &BTreeMap<(i32, i32), u32>) -> BTreeMap<(i32, i32), Touching> {
    let mut found: BTreeMap<(i32, i32), Touching> = BTreeMap::new();
    let mut count = |module, key, triangles, place| {
        if modules.contains_key(&module) {
            found.entry(module).or_default().entry(key).or_insert((0, place)).0 += triangles;
        }
    };
    for edge in &formed.edges {
        let ends = [edge.a, edge.b].map(|point| formed.points[point as usize].0);
        let key = (edge.class, edge.id, site.module_under(ends[0], ends[1]));
        for place in ends {
            modules_of(place, site).into_iter().for_each(|(module, triangles)| count(module, key, triangles, place));
        }
    }
    for deck in &formed.decks {
        let (from, across) = (deck.corners[0].0, deck.corners[deck.corners.len() / 2].0);
        let key = (deck.class, deck.id, site.module_under(from, across));
        for module in modules_under(deck, site) {
            count(module, key, deck.corners.len() as u32, from);
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Grant;
    use crate::samples::{site, way};
    use crate::{GradeOptions, Network, Numbering, Rounded, grade, sides};

    #[track_caller]
    fn reserved(sources: Vec<crate::Source>, mut most: u32) -> Reserved {
        let Rounded { ways, mut remarks, .. } = crate::samples::rounded(sources);
        let network = Network::of(&ways, site().lattice, &mut remarks);
        let rough = |east: f64, north: f64| north * 2.0 + (east * 3.1 + north * 1.7) % 5.0;
        let ground: Vec<_> = network.nodes.iter().map(|node| crate::samples::ground_at(node.place, &rough)).collect();
        let heights = grade(&network, &ground, &[], &[], GradeOptions::USUAL, &mut remarks);
        let beside = vec![[0, 100]; sides(&network).len()];
        let grants = Grants::default();
        let graded = Graded { network: &network, heights: &heights, beside: &beside, grants: &grants };
        let reserved = reserve(&graded, &[], &site(), &mut most);
        crate::samples::check(&reserved.formed);
        for classes in reserved.cost.values() {
            assert!(classes.values().sum::<u32>() <= most, "a load module gives more than its share");
        }
        reserved
    }

    fn road(number: i64, tag: &str, north: f64) -> crate::Source {
        way(number, &format!("highway={tag}"), &[(5.0, north), (45.0, north)])
    }

    #[test]
    fn a_strip_in_the_middle_of_a_load_module_costs_two_triangles_a_point() {
        let formed = reserved(vec![way(1, "highway=primary", &[(10.0, 20.0), (20.0, 20.0)])], 1000);
        let all: u32 = formed.cost.values().flat_map(|classes| classes.values()).sum();
        assert_eq!(all as usize, 2 * formed.formed.points.len());
    }

    #[test]
    fn the_lowest_class_is_degraded_first_and_everything_before_anything_is_left_out() {
        let sources = vec![road(1, "primary", 10.0), road(2, "service", 30.0)];
        let free = reserved(sources.clone(), 100_000);
        assert!(free.formed.remarks.is_empty());
        let all: u32 = free.cost.values().flat_map(|classes| classes.values()).sum();
        let tight = reserved(sources, all * 2 / 3);
        let id = |number| FeatureId { source: 0, numbering: Numbering::Way, number };
        let of = |number| tight.grants.of(id(number), (0, 0));
        assert!(of(1) == Grant::ALL || of(2).tolerance == 4);
        assert!(
            tight.formed.remarks.iter().all(|remark| remark.flaw == Flaw::OverShare && !remark.remedy.leaves_out())
        );
        assert!(tight.formed.remarks.iter().any(|remark| remark.id == id(2)));
        let benches = tight.formed.remarks.iter().filter(|remark| remark.remedy == Remedy::BecameStrip);
        assert_eq!(benches.count(), 0, "what was no bench does not become a strip");
    }

    #[test]
    fn two_hundred_roads_in_one_load_module_keep_within_their_share() {
        let tags = ["motorway", "primary", "service", "track"];
        let sources = (0..200).map(|number| road(number, tags[number as usize % 4], 1.0 + number as f64 * 0.24));
        let formed = reserved(sources.collect(), 160);
        assert!(formed.formed.remarks.iter().any(|remark| remark.remedy.leaves_out()));
        assert!(formed.formed.edges.iter().any(|edge| edge.class == 0), "motorways go last");
    }

    #[test]
    fn a_crowded_load_module_takes_nothing_from_its_neighbours_and_gives_nearly_what_it_may() {
        // A long road through eight load modules, the first of them full of others.
        let mut sources = vec![way(1, "highway=service", &[(5.0, 25.0), (395.0, 25.0)])];
        sources.extend((2..60).map(|number| road(number, "service", 1.0 + number as f64 * 0.8)));
        let crowded = reserved(sources, 120);
        let taken = |module| crowded.cost.get(&module).map_or(0, |classes| classes.values().sum::<u32>());
        assert!(100 < taken((0, 0)), "{} of 120 triangles are used", taken((0, 0)));
        let id = FeatureId { source: 0, numbering: Numbering::Way, number: 1 };
        assert!((1..8).all(|col| crowded.grants.of(id, (0, col)) == Grant::ALL));
        let east = |point: u32| crowded.formed.points[point as usize].0.col;
        let farthest = crowded.formed.edges.iter().filter(|edge| edge.id == id).map(|edge| east(edge.b)).max();
        assert_eq!(farthest, site().lattice.place_of([395.0, 25.0]).map(|place| place.col));
    }
}
