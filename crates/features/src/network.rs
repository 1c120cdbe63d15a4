//! The network of ways: stations as nodes, what joins them as edges, each stretch of ground once.

use std::borrow::Cow;
use std::collections::{BTreeMap, HashMap};

use crate::clean::Notes;
use crate::exact::Segment;
use crate::{FeatureId, FeatureLattice, Flaw, Form, Place, Remark, Remedy, Storey, Traits, Way};

/// A station.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Node {
    /// Where it stands.
    pub place: Place,
    /// Whether it rests on the ground; inside decks and tunnels it does not.
    pub on_ground: bool,
}

/// What joins two neighbouring stations of a way.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Edge {
    /// The station it comes from, in the direction of its way.
    pub a: u32,
    /// The station it goes to.
    pub b: u32,
    /// Its way, in [`Network::ways`].
    pub way: u32,
    /// Quanta long.
    pub length: i32,
    /// Quanta it may rise or fall.
    pub rise_max: i32,
}

/// What an edge has of its way.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct WayOf {
    /// What it is.
    pub traits: Traits,
    /// Which feature it comes from.
    pub id: FeatureId,
}

/// Edges one after another between stations where something begins, ends, meets or changes.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Chain {
    /// What all of its edges are.
    pub traits: Traits,
    /// Stations in order; the first is the last where it is closed.
    pub nodes: Vec<u32>,
    /// Edges in order, one fewer.
    pub edges: Vec<u32>,
}

/// Ways as nodes and edges. Nodes are in the order of their places.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Network {
    /// Stations.
    pub nodes: Vec<Node>,
    /// Edges: no two join the same stations.
    pub edges: Vec<Edge>,
    /// Ways that have edges, the highest class first.
    pub ways: Vec<WayOf>,
    /// The lattice of its places.
    pub lattice: FeatureLattice,
    starts: Vec<u32>,
    beside: Vec<(u32, u32)>,
}

impl Network {
    /// The network of `ways`, in the order of their content; what two share belongs to the first, and the other is
    /// remarked.
    pub fn of(ways: &[Way], lattice: FeatureLattice, remarks: &mut Vec<Remark>) -> Self {
        let (keys, numbers) = number_nodes(ways);
        let mut nodes: Vec<Node> =
            keys.iter().map(|key| Node { place: key.place, on_ground: key.storey.is_none() }).collect();
        let mut taken: HashMap<(u32, u32), u32> = HashMap::new();
        let mut edges: Vec<Edge> = Vec::new();
        let mut station = numbers.iter().copied();
        for (way, of) in ways.iter().enumerate() {
            let stations: Vec<u32> = station.by_ref().take(of.places.len()).collect();
            let mut shared = None;
            for ends in stations.windows(2) {
                let (a, b) = (ends[0], ends[1]);
                if let Some(other) = taken.insert((a.min(b), a.max(b)), way as u32) {
                    taken.insert((a.min(b), a.max(b)), other);
                    shared = shared.or((other != way as u32).then_some(a));
                    continue;
                }
                let (from, to) = (nodes[a as usize].place, nodes[b as usize].place);
                let length = lattice.length(from, to).min(1 << 28) as i32;
                edges.push(Edge { a, b, way: way as u32, length, rise_max: 0 });
            }
            if let Some(node) = shared {
                let mut notes = Notes { id: of.id, lattice, remarks };
                notes.write_at(nodes[node as usize].place, Flaw::DoubledInPart, Remedy::PartLeftOut);
            }
        }
        let (starts, beside) = neighbours(nodes.len(), &edges);
        // A deck that ends in the air, where no other way takes it on, rests on the ground there, and so does one that
        // runs on in a tunnel; a tunnel that ends so, as where the area ends, is inside a hill.
        let is_tunnel = |edge: u32| {
            let way = &ways[edges[edge as usize].way as usize];
            matches!(way.traits.storey, Storey::Tunnel(_))
        };
        for (number, node) in nodes.iter_mut().enumerate() {
            let of_node = &beside[starts[number] as usize..starts[number + 1] as usize];
            let is_portal = of_node.iter().any(|(_, edge)| is_tunnel(*edge));
            node.on_ground |= match of_node {
                &[(_, edge)] => !is_tunnel(edge),
                _ => is_portal && !of_node.iter().all(|(_, edge)| is_tunnel(*edge)),
            };
        }
        let ways = ways.iter().map(|way| WayOf { traits: way.traits, id: way.id }).collect();
        let mut network = Self { nodes, edges, ways, lattice, starts, beside };
        for edge in 0..network.edges.len() as u32 {
            let Edge { a, b, .. } = network.edges[edge as usize];
            let [from, to] = [a, b].map(|node| network.nodes[node as usize].place);
            let (grade_ppm, flat) =
                (network.traits(edge).grade_ppm, network.flat_at(a, edge) + network.flat_at(b, edge));
            network.edges[edge as usize].rise_max = lattice.rise_max(from, to, grade_ppm, flat);
        }
        network
    }

    /// Quanta of an edge that are level at one of its ends, as far as it runs inside the widest other that may be a
    /// strip, which is level across: where three and more meet on the ground, where it turns off sharply, and what its
    /// inner side lacks in a bend.
    pub fn flat_at(&self, node: u32, edge: u32) -> i32 {
        let meets = self.beside(node);
        if meets.len() < 2 || !self.nodes[node as usize].on_ground {
            return 0;
        }
        let to =
            |next: u32| self.nodes[node as usize].place.to(self.nodes[next as usize].place).map(|steps| steps as f64);
        let Some(&(next, _)) = meets.iter().find(|(_, other)| *other == edge) else { return 0 };
        let own = to(next);
        let inside = |&(next, other): &(u32, u32)| {
            let traits = self.traits(other);
            let is_strip = self.is_ground(other) && !matches!(traits.form, Form::Line | Form::Polygon);
            if !is_strip || other == edge {
                return 0.0;
            }
            let (one, other) = (own, to(next));
            let lengths = ((one[0] * one[0] + one[1] * one[1]) * (other[0] * other[0] + other[1] * other[1])).sqrt();
            let cosine = (one[0] * other[0] + one[1] * other[1]) / lengths;
            let sine = ((one[0] * other[1] - one[1] * other[0]) / lengths).abs();
            let half = f64::from(traits.width) / 2.0;
            match cosine {
                // The strip goes on as this edge does: in a bend its inner side is shorter.
                ..0.0 if meets.len() == 2 => half * sine / (1.0 - cosine),
                ..0.0 => half,
                _ => half / sine.max(0.25),
            }
        };
        meets.iter().map(inside).fold(0.0, f64::max) as i32
    }

    /// Neighbours of a node, each with the edge that leads there, in order.
    pub fn beside(&self, node: u32) -> &[(u32, u32)] {
        &self.beside[self.starts[node as usize] as usize..self.starts[node as usize + 1] as usize]
    }

    /// The number of the connected part of each node, in the order of their first nodes.
    pub(crate) fn parts(&self) -> Vec<u32> {
        let (mut parts, mut count) = (vec![u32::MAX; self.nodes.len()], 0);
        for first in 0..self.nodes.len() as u32 {
            if parts[first as usize] != u32::MAX {
                continue;
            }
            parts[first as usize] = count;
            let mut front = vec![first];
            while let Some(node) = front.pop() {
                for &(next, _) in self.beside(node) {
                    if parts[next as usize] == u32::MAX {
                        parts[next as usize] = count;
                        front.push(next);
                    }
                }
            }
            count += 1;
        }
        parts
    }

    /// Gives the nodes of every connected part that has no height anywhere the heights of `others`.
    pub(crate) fn give_heights(&self, heights: &mut [Option<i32>], others: &dyn Fn(u32) -> Option<i32>) {
        let parts = self.parts();
        let mut known = vec![false; parts.iter().map(|part| *part as usize + 1).max().unwrap_or(0)];
        heights.iter().zip(&parts).for_each(|(height, part)| known[*part as usize] |= height.is_some());
        for (node, height) in (0..).zip(heights).filter(|(node, _)| !known[parts[*node as usize] as usize]) {
            *height = others(node);
        }
    }

    /// Whether every edge at a node is in a tunnel.
    pub(crate) fn is_in_tunnel(&self, node: u32) -> bool {
        self.beside(node).iter().all(|(_, edge)| matches!(self.traits(*edge).storey, Storey::Tunnel(_)))
    }

    /// Decimetres of ways that a node stands for: half of its edges, and one at least.
    pub(crate) fn decimetres_at(&self, node: u32) -> i64 {
        let quanta: i64 = self.beside(node).iter().map(|(_, edge)| i64::from(self.edges[*edge as usize].length)).sum();
        (5 * quanta / i64::from(terrain::QUANTA_PER_METRE)).max(1)
    }

    /// The network in which the edges that are keys are tunnels: itself where there are none.
    pub(crate) fn with_tunnels<T>(&self, edges: &BTreeMap<u32, T>) -> Cow<'_, Self> {
        self.with_storey(edges.keys().copied(), Storey::Tunnel(-1))
    }

    /// The network in which some edges lie on another storey: itself where there are none.
    pub(crate) fn with_storey(&self, others: impl IntoIterator<Item = u32>, storey: Storey) -> Cow<'_, Self> {
        let mut network = Cow::Borrowed(self);
        let mut moved: BTreeMap<u32, u32> = BTreeMap::new();
        for edge in others {
            let Self { edges, ways, .. } = network.to_mut();
            let way = &mut edges[edge as usize].way;
            *way = *moved.entry(*way).or_insert_with(|| {
                let of = ways[*way as usize];
                ways.push(WayOf { traits: Traits { storey, ..of.traits }, ..of });
                ways.len() as u32 - 1
            });
        }
        network
    }

    /// What an edge is.
    pub fn traits(&self, edge: u32) -> &Traits {
        &self.ways[self.edges[edge as usize].way as usize].traits
    }

    /// Quanta that an edge may rise where limits of cut and fill ask for it.
    pub(crate) fn relaxed_max(&self, edge: u32) -> i32 {
        let give = i64::from(self.traits(edge).grade_give);
        (i64::from(self.edges[edge as usize].rise_max) * give / 1000) as i32
    }

    /// The same were nothing of it level for what meets it.
    pub(crate) fn steepest(&self, edge: u32) -> i32 {
        let [from, to] = self.ends(edge).map(|node| self.nodes[node as usize].place);
        self.lattice.rise_max(from, to, self.traits(edge).grade_most_ppm(), 0)
    }

    /// Whether an edge lies on the ground.
    pub fn is_ground(&self, edge: u32) -> bool {
        self.traits(edge).storey == Storey::Ground
    }

    /// The stations of an edge, in the direction of its way.
    pub fn ends(&self, edge: u32) -> [u32; 2] {
        let Edge { a, b, .. } = self.edges[edge as usize];
        [a, b]
    }

    /// The segment of an edge.
    pub fn segment(&self, edge: u32) -> Segment {
        let Edge { a, b, .. } = self.edges[edge as usize];
        Segment { a: self.nodes[a as usize].place, b: self.nodes[b as usize].place }
    }

    /// All edges as chains between stations where degree or traits change, by their first station.
    pub fn chains(&self) -> Vec<Chain> {
        let follows = |node: u32| match self.beside(node) {
            [(_, one), (_, other)] => self.traits(*one) == self.traits(*other),
            _ => false,
        };
        self.runs(&|_| true, &follows)
            .into_iter()
            .map(|(nodes, edges)| Chain { traits: *self.traits(edges[0]), nodes, edges })
            .collect()
    }

    /// Runs of the edges for which `picked` says so, which go on through the nodes for which `follows` does.
    ///
    /// A node to follow has two picked edges. Each run begins at its lesser end; closed ones at their least node.
    pub fn runs(&self, picked: &dyn Fn(u32) -> bool, follows: &dyn Fn(u32) -> bool) -> Vec<(Vec<u32>, Vec<u32>)> {
        let mut done = vec![false; self.edges.len()];
        let mut runs = Vec::new();
        for closed in [false, true] {
            for node in 0..self.nodes.len() as u32 {
                if follows(node) != closed {
                    continue;
                }
                for &(next, edge) in self.beside(node) {
                    if !done[edge as usize] && picked(edge) {
                        runs.push(self.run(node, (next, edge), (picked, follows), &mut done));
                    }
                }
            }
        }
        runs
    }

    fn run(
        &self,
        from: u32,
        (next, edge): (u32, u32),
        (picked, follows): (&dyn Fn(u32) -> bool, &dyn Fn(u32) -> bool),
        done: &mut [bool],
    ) -> (Vec<u32>, Vec<u32>) {
        let (mut nodes, mut edges) = (vec![from, next], vec![edge]);
        done[edge as usize] = true;
        let mut at = next;
        while follows(at) && at != from {
            let onward = self.beside(at).iter().find(|(_, edge)| picked(*edge) && !done[*edge as usize]);
            let Some(&(next, edge)) = onward else { break };
            done[edge as usize] = true;
            nodes.push(next);
            edges.push(edge);
            at = next;
        }
        (nodes, edges)
    }

    /// Bytes this network takes.
    pub fn bytes(&self) -> usize {
        self.nodes.len() * (size_of::<Node>() + 4) + self.edges.len() * (size_of::<Edge>() + 16)
    }
}

/// What makes two stations of ways one: the place, and the storey inside decks and tunnels.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Key {
    place: Place,
    storey: Option<(Storey, bool)>,
}

/// A station of a way before it has a number.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Use {
    place: Place,
    storey: Storey,
    end: bool,
    number: u32,
}

/// The keys of nodes in order, and the node of each station, way by way.
///
/// A deck or a tunnel meets the ground at its ends. Ends that meet where nothing lies on the ground meet one another
/// in the air, and those inside which they end.
fn number_nodes(ways: &[Way]) -> (Vec<Key>, Vec<u32>) {
    let mut uses: Vec<Use> = Vec::with_capacity(ways.iter().map(|way| way.places.len()).sum());
    for way in ways {
        for (at, &place) in way.places.iter().enumerate() {
            let end = at == 0 || at + 1 == way.places.len();
            uses.push(Use { place, storey: way.traits.storey, end, number: uses.len() as u32 });
        }
    }
    uses.sort_unstable();
    let (mut keys, mut numbers): (Vec<Key>, Vec<u32>) = (Vec::new(), vec![0; uses.len()]);
    for at_place in uses.chunk_by(|a, b| a.place == b.place) {
        let ground = at_place.iter().any(|one| one.storey == Storey::Ground);
        let ends_here = |storey: Storey| at_place.iter().any(|other| other.end && other.storey == storey);
        let first = keys.len();
        for one in at_place {
            let storey = match one.storey {
                Storey::Ground => None,
                _ if one.end && ground => None,
                storey if !ground && (one.end || ends_here(storey)) => Some((Storey::Ground, true)),
                storey => Some((storey, false)),
            };
            let key = Key { place: one.place, storey };
            let known = keys[first..].iter().position(|other| *other == key);
            let node = known.map_or(keys.len(), |known| first + known);
            if node == keys.len() {
                keys.push(key);
            }
            numbers[one.number as usize] = node as u32;
        }
    }
    (keys, numbers)
}

fn neighbours(nodes: usize, edges: &[Edge]) -> (Vec<u32>, Vec<(u32, u32)>) {
    let mut starts = vec![0u32; nodes + 1];
    for edge in edges {
        starts[edge.a as usize + 1] += 1;
        starts[edge.b as usize + 1] += 1;
    }
    (1..=nodes).for_each(|node| starts[node] += starts[node - 1]);
    let mut next = starts.clone();
    let mut beside = vec![(0, 0); 2 * edges.len()];
    for (number, edge) in edges.iter().enumerate() {
        for (from, to) in [(edge.a, edge.b), (edge.b, edge.a)] {
            beside[next[from as usize] as usize] = (to, number as u32);
            next[from as usize] += 1;
        }
    }
    for node in 0..nodes {
        beside[starts[node] as usize..starts[node + 1] as usize].sort_unstable();
    }
    (starts, beside)
}

#[cfg(test)]
mod tests {
    use crate::samples::{network, way};
    use crate::{Flaw, Network};

    #[track_caller]
    fn check(network: &Network) {
        for (number, edge) in network.edges.iter().enumerate() {
            for (from, to) in [(edge.a, edge.b), (edge.b, edge.a)] {
                assert!(network.beside(from).contains(&(to, number as u32)));
            }
        }
        let chains = network.chains();
        let edges: usize = chains.iter().map(|chain| chain.edges.len()).sum();
        assert_eq!(edges, network.edges.len(), "every edge is in one chain");
        for chain in &chains {
            for (pair, edge) in chain.nodes.windows(2).zip(&chain.edges) {
                let edge = &network.edges[*edge as usize];
                assert_eq!((edge.a.min(edge.b), edge.a.max(edge.b)), (pair[0].min(pair[1]), pair[0].max(pair[1])));
            }
        }
    }

    fn flat(_: f64, _: f64) -> f64 {
        0.0
    }

    fn forks(network: &Network) -> usize {
        (0..network.nodes.len() as u32).filter(|node| 2 < network.beside(*node).len()).count()
    }

    #[test]
    fn ways_of_one_storey_meet_where_they_cross_and_a_bridge_meets_nothing_below() {
        let east = way(1, "highway=primary", &[(10.0, 20.0), (30.0, 20.0)]);
        let (level, _, _) = network(vec![east.clone(), way(2, "highway=track", &[(20.0, 10.0), (20.0, 30.0)])], flat);
        check(&level);
        assert_eq!((forks(&level), level.chains().len()), (1, 4));
        let (bridge, _, _) =
            network(vec![east, way(2, "highway=track bridge=yes", &[(20.0, 10.0), (20.0, 30.0)])], flat);
        check(&bridge);
        assert_eq!((forks(&bridge), bridge.chains().len()), (0, 2));
        assert_eq!(bridge.nodes.iter().filter(|node| !node.on_ground).count(), 19, "its free ends rest on the ground");
    }

    #[test]
    fn a_bridge_meets_its_approaches_and_a_ramp_meets_the_deck() {
        let sources = vec![
            way(1, "highway=primary", &[(0.0, 20.0), (10.0, 20.0)]),
            way(2, "highway=primary bridge=yes", &[(10.0, 20.0), (20.0, 20.0), (30.0, 20.0)]),
            way(3, "highway=primary", &[(30.0, 20.0), (40.0, 20.0)]),
            way(4, "highway=primary bridge=yes", &[(20.0, 20.0), (20.0, 30.0)]),
            way(5, "highway=primary", &[(20.0, 30.0), (20.0, 40.0)]),
        ];
        let (network, _, _) = network(sources, flat);
        check(&network);
        assert_eq!((forks(&network), network.chains().len()), (1, 6));
    }

    #[test]
    fn what_two_ways_share_belongs_to_the_higher_class_and_is_written_down() {
        let sources = vec![
            way(1, "highway=track", &[(10.0, 20.0), (20.0, 20.0), (20.0, 30.0)]),
            way(2, "highway=primary", &[(5.0, 20.0), (18.0, 20.0)]),
        ];
        let (network, _, remarks) = network(sources, flat);
        check(&network);
        assert_eq!(remarks.iter().map(|remark| &remark.flaw).collect::<Vec<_>>(), [&Flaw::DoubledInPart]);
        assert_eq!((network.nodes.len(), network.edges.len()), (26, 25));
    }
}
