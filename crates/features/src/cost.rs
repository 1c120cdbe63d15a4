//! What features cost in triangles, counted before any tile is refined, and what becomes of those that cost too much.
//!
//! A deck has as many triangles at most as it has corners. On the ground, a point inside a load module adds two
//! triangles and one on its side adds one, whatever else the TIN holds, because triangles = 2 V + B - 2. So the count
//! is exact for what features put there, and a lower bound for their module.

use std::collections::{BTreeMap, HashMap};

use crate::clean::Notes;
use crate::forms::{Formed, form};
use crate::pieces::Grant;
use crate::strand::{Graded, Role, Strand};
use crate::strips::Face;
use crate::{FeatureId, Flaw, Form, Grants, Place, Remark, Remedy, Site};

/// Triangles that features take, by load module (row, column) and class.
pub type Cost = BTreeMap<(i32, i32), BTreeMap<u16, u32>>;

/// A step of the ladder that features of a class go down together in one load module.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Step {
    Double,
    Fourfold,
    NoBench,
    NoStrip,
    Out,
}

/// The ladder: everything is made coarser before anything is left out.
const LADDER: [Step; 5] = [Step::Double, Step::Fourfold, Step::NoBench, Step::NoStrip, Step::Out];

impl Step {
    fn apply(self, grant: Grant) -> Grant {
        match self {
            Step::Double => Grant { tolerance: grant.tolerance.max(2), ..grant },
            Step::Fourfold => Grant { tolerance: grant.tolerance.max(4), ..grant },
            Step::NoBench => Grant { most: grant.most.min(Form::StripAlways), ..grant },
            Step::NoStrip => Grant { most: Form::Line, ..grant },
            Step::Out => Grant { out: true, ..grant },
        }
    }

    /// Whether a feature that asks for a form has anything to lose by it.
    fn concerns(self, form: Form) -> bool {
        match self {
            Step::NoBench => form == Form::Bench,
            Step::NoStrip => !matches!(form, Form::Line | Form::Polygon),
            _ => true,
        }
    }

    fn remedy(self) -> Remedy {
        match self {
            Step::Double => Remedy::ToleranceDoubled,
            Step::Fourfold => Remedy::ToleranceFourfold,
            Step::NoBench => Remedy::BecameStrip,
            Step::NoStrip => Remedy::BecameLine,
            Step::Out => Remedy::LeftOut,
        }
    }
}

/// What formed features cost.
pub fn cost(formed: &Formed, site: &Site) -> Cost {
    let mut class = vec![u16::MAX; formed.points.len()];
    for edge in &formed.edges {
        for point in [edge.a, edge.b] {
            class[point as usize] = class[point as usize].min(edge.class);
        }
    }
    let mut cost = Cost::new();
    for ((place, _), class) in formed.points.iter().zip(class) {
        for (module, triangles) in modules_of(*place, site) {
            *cost.entry(module).or_default().entry(class).or_insert(0) += triangles;
        }
    }
    for deck in &formed.decks {
        for module in modules_under(deck, site) {
            *cost.entry(module).or_default().entry(deck.class).or_insert(0) += deck.corners.len() as u32;
        }
    }
    cost
}

/// The load modules that a deck may lie over. In none of them it has more triangles than it has corners, also where a
/// corner of the load module cuts it.
fn modules_under(deck: &Face, site: &Site) -> Vec<(i32, i32)> {
    let modules: Vec<(i32, i32)> = deck.corners.iter().map(|(place, _)| site.module_of(*place)).collect();
    let span = |of: fn(&(i32, i32)) -> i32| {
        let all = modules.iter().map(of);
        all.clone().min().unwrap_or(0)..=all.max().unwrap_or(-1)
    };
    span(|module| module.0).flat_map(|row| span(|module| module.1).map(move |col| (row, col))).collect()
}

/// The load modules a point belongs to, with the triangles it adds to each.
fn modules_of(place: Place, site: &Site) -> Vec<((i32, i32), u32)> {
    let (row, col) = site.module_of(place);
    let steps = site.module_posts * site.lattice.steps_per_post();
    let (on_row, on_col) = (place.row % steps == 0, place.col % steps == 0);
    match (on_row, on_col) {
        (false, false) => vec![((row, col), 2)],
        (true, false) => vec![((row, col), 1), ((row - 1, col), 1)],
        (false, true) => vec![((row, col), 1), ((row, col - 1), 1)],
        // A corner of load modules is there anyway.
        (true, true) => Vec::new(),
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

/// Forms features so that they take no more triangles of a load module than `triangles_max` says for it.
///
/// Where they would, those features go down the ladder, the lowest class first at each step: tolerances doubled, then
/// fourfold, a bench becomes a strip, a strip a line, and only then is left out what they have in that load module; of
/// water that is enclosed, all. Every step is a remark.
pub fn reserve(
    graded: &Graded,
    strands: &[Strand],
    site: &Site,
    triangles_max: &dyn Fn((i32, i32)) -> u32,
) -> Reserved {
    let mut grants = graded.grants.clone();
    let mut remarks = Vec::new();
    let mut reached: BTreeMap<(i32, i32), (usize, u16)> = BTreeMap::new();
    let forms: HashMap<FeatureId, Form> = graded.network.ways.iter().map(|way| (way.id, way.traits.form)).collect();
    loop {
        let mut formed = form(&Graded { grants: &grants, ..*graded }, strands, site);
        let cost = cost(&formed, site);
        let surplus = |(module, classes): (&(i32, i32), &BTreeMap<u16, u32>)| {
            let surplus = classes.values().sum::<u32>().saturating_sub(triangles_max(*module));
            (0 < surplus).then_some((*module, surplus))
        };
        let over: BTreeMap<(i32, i32), u32> = cost.iter().filter_map(surplus).collect();
        let mut changed = false;
        for (module, features) in features_of(&formed, site, &over) {
            let surplus = over[&module];
            let is_far = triangles_max(module) < surplus;
            let crowd = Crowd { features, surplus, is_far, site, forms: &forms };
            let reached = reached.entry(module).or_insert((0, u16::MAX));
            changed |= degrade(&crowd, reached, &mut grants, &mut remarks);
        }
        if !changed {
            formed.remarks.extend(remarks);
            Remark::sort(&mut formed.remarks);
            return Reserved { formed, cost, grants };
        }
    }
}

/// Parts of a triangle in which shares of features are counted.
const PARTS: u32 = 120;

/// A feature in one load module.
#[derive(Clone, Copy)]
struct Member {
    class: u16,
    id: FeatureId,
    place: Place,
    /// The load module in which the edges lie, which may only touch the other.
    piece: (i32, i32),
    /// Whether it encloses water, and so is there as a whole or not at all.
    is_whole: bool,
    /// How many triangles it takes there, in 120ths: a point of several features is shared among its edges.
    parts: u32,
}

/// The features of a load module that gives too much.
struct Crowd<'a> {
    features: Vec<Member>,
    surplus: u32,
    /// Whether it gives more than twice its share: then a step is taken for all classes at once.
    is_far: bool,
    site: &'a Site,
    /// The form each travelled way asks for; all others are lines.
    forms: &'a HashMap<FeatureId, Form>,
}

fn features_of(formed: &Formed, site: &Site, modules: &BTreeMap<(i32, i32), u32>) -> BTreeMap<(i32, i32), Vec<Member>> {
    let mut features: BTreeMap<(i32, i32), BTreeMap<(u16, FeatureId, (i32, i32)), Member>> = BTreeMap::new();
    let mut degree = vec![0; formed.points.len()];
    formed.edges.iter().flat_map(|edge| [edge.a, edge.b]).for_each(|point| degree[point as usize] += 1);
    for edge in &formed.edges {
        let [a, b] = [edge.a, edge.b].map(|point| formed.points[point as usize].0);
        let (piece, is_whole) = (site.module_under(a, b), matches!(edge.role, Role::Shore | Role::Bank));
        for point in [edge.a, edge.b] {
            let place = formed.points[point as usize].0;
            for (module, triangles) in modules_of(place, site) {
                if modules.contains_key(&module) {
                    let member = Member { class: edge.class, id: edge.id, place, piece, is_whole, parts: 0 };
                    let key = (edge.class, edge.id, piece);
                    let of = features.entry(module).or_default().entry(key).or_insert(member);
                    of.parts += PARTS * triangles / degree[point as usize];
                }
            }
        }
    }
    for deck in &formed.decks {
        for module in modules_under(deck, site).into_iter().filter(|module| modules.contains_key(module)) {
            let (from, across) = (deck.corners[0].0, deck.corners[deck.corners.len() / 2].0);
            let piece = site.module_under(from, across);
            let member = Member { class: deck.class, id: deck.id, place: from, piece, is_whole: false, parts: 0 };
            let of = features.entry(module).or_default().entry((deck.class, deck.id, piece)).or_insert(member);
            of.parts += PARTS * deck.corners.len() as u32;
        }
    }
    features.into_iter().map(|(module, found)| (module, found.into_values().collect())).collect()
}

/// Takes the features of one load module down by one step of one class; false when nothing is left to take.
fn degrade(crowd: &Crowd, reached: &mut (usize, u16), grants: &mut Grants, remarks: &mut Vec<Remark>) -> bool {
    let mut changed = false;
    while let Some(step) = LADDER.get(reached.0) {
        // The next class upwards at this step: numbers fall as classes rise.
        let below = crowd.features.iter().map(|member| member.class).filter(|class| *class < reached.1).max();
        let Some(class) = below else {
            *reached = (reached.0 + 1, u16::MAX);
            if changed {
                return true;
            }
            continue;
        };
        reached.1 = class;
        let mut members: Vec<Member> = crowd
            .features
            .iter()
            .filter(|member| member.class == class && !grants.of(member.id).out)
            .copied()
            .collect();
        if *step == Step::Out {
            // No more than has to be, the smallest first; the next round asks again.
            let is_gap = |member: &Member| grants.is_out(member.id, member.piece);
            members.sort_by_key(|member| (is_gap(member), member.parts, member.place, member.id));
            let mut gone = 0;
            members.retain(|member| {
                let needed = gone < PARTS * crowd.surplus;
                gone += member.parts;
                needed
            });
            reached.1 = if members.is_empty() { class } else { class + 1 };
        }
        changed |= apply(*step, &members, crowd, grants, remarks);
        if changed && (!crowd.is_far || *step == Step::Out) {
            return true;
        }
    }
    // What came into the load module while the ladder was used, because a higher class made room for it.
    let late: Vec<Member> = crowd.features.iter().filter(|member| !grants.of(member.id).out).copied().collect();
    apply(Step::Out, &late, crowd, grants, remarks)
}

/// Leaves less to some features; whether any of them had more.
fn apply(step: Step, members: &[Member], crowd: &Crowd, grants: &mut Grants, remarks: &mut Vec<Remark>) -> bool {
    let mut changed = false;
    for member in members {
        if step == Step::Out && !member.is_whole && grants.leave_out(member.id, member.piece) {
            changed = true;
            let mut notes = Notes { id: member.id, lattice: crowd.site.lattice, remarks };
            notes.write_at(member.place, Flaw::OverShare, Remedy::PartLeftOut);
            continue;
        }
        // What is still there although it was left out, such as the corner of a wide road, goes with all of the feature.
        let form = crowd.forms.get(&member.id).copied().unwrap_or(Form::Line);
        let (before, after) = (grants.of(member.id), step.apply(grants.of(member.id)));
        if before != after && step.concerns(form) {
            grants.set(member.id, after);
            changed = true;
            let mut notes = Notes { id: member.id, lattice: crowd.site.lattice, remarks };
            notes.write_at(member.place, Flaw::OverShare, step.remedy());
        }
    }
    changed
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::samples::{site, way};
    use crate::{GradeOptions, Network, Numbering, Rounded, grade, sides};

    #[track_caller]
    fn reserved(sources: Vec<crate::Source>, most: u32) -> Reserved {
        let Rounded { ways, mut remarks, .. } = crate::samples::rounded(sources);
        let network = Network::of(&ways, site().lattice, &mut remarks);
        let rough = |east: f64, north: f64| north * 2.0 + (east * 3.1 + north * 1.7) % 5.0;
        let ground: Vec<_> = network.nodes.iter().map(|node| crate::samples::ground_at(node.place, &rough)).collect();
        let heights = grade(&network, &ground, &[], &[], GradeOptions::USUAL, &mut remarks);
        let beside = vec![[0, 100]; sides(&network).len()];
        let grants = Grants::default();
        let graded = Graded { network: &network, heights: &heights, beside: &beside, grants: &grants };
        let reserved = reserve(&graded, &[], &site(), &|_| most);
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
        assert!(tight.grants.of(id(1)) == Grant::ALL || tight.grants.of(id(2)).tolerance == 4);
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
}
