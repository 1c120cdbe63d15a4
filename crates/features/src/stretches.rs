//! What is in the ground as a whole or not at all: stretches of ways from junction to junction, and bodies of water.
//!
//! A stretch ends where three and more meet, where its source ends, at the area's border, and where its class changes.
//! Bridges and tunnels are parts of it.

use std::collections::BTreeMap;

use crate::rings::doubled_area;
use crate::strand::{Graded, Role, Strand};
use crate::{FeatureId, Kind, Place, Site};

/// What a feature is beside what its traits say.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct About {
    /// Its kind.
    pub kind: Kind,
    /// Stands for its name, or for its number where it has none; 0 where it has neither.
    pub name: u64,
}

/// What a stretch is made of.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Part {
    /// Nodes and edges of the network, in order.
    Way(Vec<u32>, Vec<u32>),
    /// Strands by their number: one channel or breakline, or all rings of a body of water.
    Strands(Vec<u32>),
}

/// What is in the ground as a whole or not at all.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Stretch {
    pub kind: Kind,
    pub class: u16,
    pub name: u64,
    pub part: Part,
    /// The joints it begins and ends at; none of what encloses water.
    pub joints: Option<[u32; 2]>,
    /// Quanta of it inside the area, without tunnels.
    pub length: i64,
    /// Twice its area in squares of steps, of water.
    pub doubled_area: i128,
    /// Its least place.
    pub place: Place,
    /// Whether any of it lies in the area.
    pub is_inside: bool,
    /// Whether nothing of it is in the ground: it is a tunnel.
    pub is_hidden: bool,
}

impl Stretch {
    /// What hangs together with it: a number for roads, one for railways, one for runways, one for water.
    pub fn family(&self) -> u8 {
        match self.kind {
            Kind::Rail => 1,
            Kind::Runway => 2,
            kind if kind.is_road() => 0,
            _ => 3,
        }
    }

    /// Whether it is one of the kinds that may use the larger share of limits.
    pub fn is_main(&self, site: &Site) -> bool {
        let hectare = 2.0 * 1e4 / site.lattice.metres_per_step().powi(2);
        match self.kind {
            Kind::Motorway | Kind::Primary | Kind::Rail | Kind::River => true,
            Kind::Lake => hectare <= self.doubled_area as f64,
            _ => false,
        }
    }

    /// The coarsest that it may be thinned with, in [`crate::Tolerance::ALL`].
    pub fn coarsest(&self) -> u8 {
        if matches!(self.kind, Kind::Track | Kind::Stream) { 4 } else { 3 }
    }
}

/// An end of a stretch at a joint.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Arm {
    pub joint: u32,
    pub stretch: u32,
    /// Whether it is the stretch's last.
    pub last: bool,
}

/// All stretches, by their places, and how they meet.
#[derive(Clone, Debug)]
pub(crate) struct Stretches {
    pub all: Vec<Stretch>,
    /// Places of joints.
    pub joints: Vec<Place>,
    /// Arms by joint.
    arms: Vec<Arm>,
}

impl Stretches {
    /// The stretches of a network and of strands.
    pub fn of(graded: &Graded, strands: &[Strand], site: &Site, about: &dyn Fn(FeatureId) -> Option<About>) -> Self {
        let mut all = ways(graded, site, about);
        let mut joints: Vec<Place> = graded.network.nodes.iter().map(|node| node.place).collect();
        all.extend(waters(strands, site, about, &mut joints));
        all.sort_by(|a, b| (a.place, a.kind, a.class, &a.part_key()).cmp(&(b.place, b.kind, b.class, &b.part_key())));
        let mut arms: Vec<Arm> = Vec::new();
        for (stretch, of) in (0..).zip(&all) {
            for (joint, last) in of.joints.into_iter().flat_map(|[from, to]| [(from, false), (to, true)]) {
                arms.push(Arm { joint, stretch, last });
            }
        }
        arms.sort_unstable();
        Self { all, joints, arms }
    }

    /// The arms that meet at a joint.
    pub fn at(&self, joint: u32) -> &[Arm] {
        let first = self.arms.partition_point(|arm| arm.joint < joint);
        let count = self.arms[first..].partition_point(|arm| arm.joint == joint);
        &self.arms[first..first + count]
    }

    /// Arms joint by joint.
    pub fn by_joint(&self) -> impl Iterator<Item = &[Arm]> {
        self.arms.chunk_by(|a, b| a.joint == b.joint)
    }

    /// Whether the source goes on at a joint where a stretch of a family ends: inside the area, and not in itself.
    pub fn goes_on(&self, joint: u32, stretch: u32) -> bool {
        let family = self.all[stretch as usize].family();
        let arms = self.at(joint).iter().filter(|arm| {
            let of = &self.all[arm.stretch as usize];
            of.family() == family && of.is_inside
        });
        1 < arms.count()
    }
}

impl Stretch {
    /// What orders those that begin at one place.
    fn part_key(&self) -> (bool, u32, u32) {
        match &self.part {
            Part::Way(nodes, _) => (false, nodes[0], nodes.get(1).copied().unwrap_or(0)),
            Part::Strands(strands) => (true, strands[0], 0),
        }
    }
}

fn ways(graded: &Graded, site: &Site, about: &dyn Fn(FeatureId) -> Option<About>) -> Vec<Stretch> {
    let network = graded.network;
    let is_inside = |edge: u32| {
        let segment = network.segment(edge);
        site.holds_middle(segment.a, segment.b)
    };
    let of = |edge: u32| (network.traits(edge).kind, network.traits(edge).class, is_inside(edge));
    let follows = |node: u32| matches!(network.beside(node), [(_, one), (_, other)] if of(*one) == of(*other));
    let stretch = |(nodes, edges): (Vec<u32>, Vec<u32>)| {
        let (kind, class, is_inside) = of(edges[0]);
        let is_tunnel = |edge: &u32| network.traits(*edge).storey.is_tunnel();
        let above = || edges.iter().filter(|edge| !is_tunnel(edge));
        let length =
            if is_inside { above().map(|edge| i64::from(network.edges[*edge as usize].length)).sum() } else { 0 };
        let names = edges.iter().map(|edge| network.ways[network.edges[*edge as usize].way as usize].id);
        let name = names.filter_map(about).map(|about| about.name).find(|name| *name != 0).unwrap_or(0);
        let place = nodes.iter().map(|node| network.nodes[*node as usize].place).min().unwrap_or(Place::new(0, 0));
        Stretch {
            kind,
            class,
            name,
            joints: Some([nodes[0], nodes[nodes.len() - 1]]),
            length,
            doubled_area: 0,
            place,
            is_inside,
            is_hidden: above().next().is_none(),
            part: Part::Way(nodes, edges),
        }
    };
    network.runs(&|_| true, &follows).into_iter().map(stretch).collect()
}

fn waters(
    strands: &[Strand],
    site: &Site,
    about: &dyn Fn(FeatureId) -> Option<About>,
    joints: &mut Vec<Place>,
) -> Vec<Stretch> {
    let mut stretches = Vec::new();
    let mut ends: Vec<Place> = Vec::new();
    for strand in strands.iter().filter(|strand| strand.role == Role::Channel) {
        ends.extend([strand.stations.first(), strand.stations.last()].into_iter().flatten().map(|(place, _)| *place));
    }
    ends.sort_unstable();
    ends.dedup();
    let first = joints.len() as u32;
    let joint = |place: Place| first + ends.partition_point(|end| *end < place) as u32;
    // Rings of one body of water are one.
    let mut bodies: BTreeMap<(Role, u16, FeatureId), usize> = BTreeMap::new();
    for (number, strand) in (0..).zip(strands) {
        let known = about(strand.id);
        let kind = known.map_or(kind_of(strand.role), |about| about.kind);
        let places = || strand.stations.iter().map(|(place, _)| *place);
        let ends = (strand.stations.first(), strand.stations.last());
        let (Some(&(from, _)), Some(&(to, _))) = ends else { continue };
        let segments = strand.stations.windows(2).filter(|ends| site.holds_middle(ends[0].0, ends[1].0));
        let length: i64 = segments.map(|ends| site.lattice.length(ends[0].0, ends[1].0)).sum();
        let area = if strand.role.is_outline() { doubled_area(&places().collect::<Vec<Place>>()) } else { 0 };
        let mut stretch = Stretch {
            kind,
            class: strand.class,
            name: known.map_or(0, |about| about.name),
            part: Part::Strands(vec![number]),
            joints: (strand.role == Role::Channel).then(|| [joint(from), joint(to)]),
            length,
            doubled_area: area,
            place: places().min().unwrap_or(from),
            is_inside: strand.role != Role::Channel || 0 < length,
            is_hidden: false,
        };
        if strand.role.is_outline() {
            let at = *bodies.entry((strand.role, strand.class, strand.id)).or_insert(stretches.len());
            if let Some(body) = stretches.get_mut(at) {
                let body: &mut Stretch = body;
                if let Part::Strands(rings) = &mut body.part {
                    rings.push(number);
                }
                body.length += length;
                body.doubled_area += area;
                body.place = body.place.min(stretch.place);
                continue;
            }
            stretch.joints = None;
        }
        stretches.push(stretch);
    }
    joints.extend(ends);
    stretches
}

/// What a strand is where nothing is known of its feature.
fn kind_of(role: Role) -> Kind {
    match role {
        Role::Shore => Kind::Lake,
        Role::Channel | Role::Bank => Kind::River,
        _ => Kind::Breakline,
    }
}
