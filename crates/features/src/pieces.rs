//! Chains cut into pieces whose stations are thinned, each segment of which is a line or a strip.

use std::collections::BTreeSet;

use crate::thin::{Station, thin};
use crate::{FeatureId, FeatureLattice, Form, Grant, Grants, Network, Place, Site, Traits};

/// Steps of the lattice below which a strip is a line.
pub const STRIP_STEPS_MIN: i32 = 4;

/// Thinned stations of one chain.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Piece {
    /// What it is.
    pub traits: Traits,
    /// Nodes of the network, in order.
    pub nodes: Vec<u32>,
    /// Of each segment, the edge of the network it begins with.
    pub edges: Vec<u32>,
    /// Of each segment, whether it is a strip.
    pub strips: Vec<bool>,
    /// Whether it has slopes.
    pub bench: bool,
}

impl Piece {
    /// The feature a segment comes from.
    pub fn id(&self, network: &Network, segment: usize) -> FeatureId {
        network.ways[network.edges[self.edges[segment] as usize].way as usize].id
    }

    /// Whether it is a deck.
    pub fn is_deck(&self) -> bool {
        self.traits.storey.is_deck()
    }
}

/// Where a way has its left and right edge at each node, half its width aside: what `profile` asks the DEM for beside
/// the node itself. Nodes at which no way is wide have their own place twice.
pub fn sides(network: &Network) -> Vec<[Place; 2]> {
    let mut sides: Vec<[Place; 2]> = network.nodes.iter().map(|node| [node.place; 2]).collect();
    for chain in network.chains() {
        let half = f64::from(strip_width(&chain.traits, network.lattice))
            / (2.0 * f64::from(network.lattice.quanta_per_step()));
        let place = |at: usize| network.nodes[chain.nodes[at] as usize].place;
        for (at, &node) in chain.nodes.iter().enumerate() {
            let [east, north] = place(at.saturating_sub(1)).to(place((at + 1).min(chain.nodes.len() - 1)));
            let [east, north] = [east as f64, north as f64];
            let length = (east * east + north * north).sqrt().max(1.0);
            let aside = |sign: f64| moved(place(at), -sign * half * north / length, sign * half * east / length);
            // Where ways meet, the widest one says how wide.
            let here = [aside(1.0), aside(-1.0)];
            let wider = sides[node as usize][0].squared_to(sides[node as usize][1]) < here[0].squared_to(here[1]);
            if wider {
                sides[node as usize] = here;
            }
        }
    }
    sides
}

/// A place moved by steps east and north, rounded half up.
pub(crate) fn moved(place: Place, east: f64, north: f64) -> Place {
    let rounded = |start: i32, by: f64| start + (by + 0.5).floor() as i32;
    Place::new(rounded(place.row, north), rounded(place.col, east))
}

/// Cuts a network into pieces. `shared` says which places others use, so that they stay; `grants` says what their cost
/// leaves to them.
pub fn pieces(
    network: &Network,
    heights: &[i32],
    site: &Site,
    shared: &dyn Fn(Place) -> bool,
    grants: &Grants,
) -> Vec<Piece> {
    let grant = |edge: u32| grants.of_edge(edge);
    let picked = |edge: u32| !grant(edge).out && !network.traits(edge).storey.is_tunnel();
    // Where only two of those that meet are in the ground, the way goes on.
    let follows = |node: u32| {
        let mut meet = network.beside(node).iter().map(|(_, edge)| *edge).filter(|edge| picked(*edge));
        match (meet.next(), meet.next(), meet.next()) {
            (Some(one), Some(other), None) => {
                network.traits(one) == network.traits(other) && grant(one) == grant(other)
            }
            _ => false,
        }
    };
    let runs = network.runs(&picked, &follows).into_iter();
    runs.map(|(nodes, edges)| {
        let traits = *network.traits(edges[0]);
        let grant = grant(edges[0]);
        let station = |(at, &node): (usize, &u32)| {
            let place = network.nodes[node as usize].place;
            let flat = |edge: Option<&u32>| edge.map_or(0, |edge| network.flat_at(node, *edge));
            let flat = [flat(at.checked_sub(1).and_then(|before| edges.get(before))), flat(edges.get(at))];
            let stays = site.on_line(place) || shared(place);
            Station { place, height: heights[node as usize], stays, flat }
        };
        let stations: Vec<Station> = nodes.iter().enumerate().map(station).collect();
        // Where the grade has given way, so do the edges of what is thinned.
        let gives = |(ends, edge): (&[u32], &u32)| {
            let rise = (heights[ends[0] as usize] - heights[ends[1] as usize]).abs();
            network.edges[*edge as usize].rise_max < rise
        };
        let has_given = nodes.windows(2).zip(&edges).any(gives);
        let grade_ppm = if has_given { traits.grade_most_ppm() } else { traits.grade_ppm };
        let kept = thin(&stations, grant.tolerance(), grade_ppm, network.lattice);
        let form = form_of(&traits, grant, network);
        Piece {
            traits,
            strips: vec![matches!(form, Form::StripAlways | Form::Bench); kept.len() - 1],
            nodes: kept.iter().map(|at| nodes[*at as usize]).collect(),
            edges: kept[..kept.len() - 1].iter().map(|at| edges[*at as usize]).collect(),
            bench: form == Form::Bench,
        }
    })
    .collect()
}

/// The edges by which ways that may be strips lead onto wide decks. They become strips before all others: a line would
/// be a ridge there, and the ground beside it far below both sides of the deck.
pub(crate) fn onto_decks(network: &Network) -> BTreeSet<u32> {
    let is_wide = |edge: u32| !is_narrow(network.traits(edge), network);
    let is_deck = |edge: &u32| network.traits(*edge).storey.is_deck() && is_wide(*edge);
    let leads = |edge: &u32| {
        let form = network.traits(*edge).form;
        network.is_ground(*edge) && is_wide(*edge) && !matches!(form, Form::Line | Form::Polygon)
    };
    let decks = (0..network.edges.len() as u32).filter(is_deck);
    let ends = decks.flat_map(|edge| network.ends(edge)).filter(|node| network.nodes[*node as usize].on_ground);
    ends.flat_map(|node| network.beside(node)).map(|(_, edge)| *edge).filter(leads).collect()
}

/// Whether a way is too narrow for a strip.
pub(crate) fn is_narrow(traits: &Traits, network: &Network) -> bool {
    strip_width(traits, network.lattice) < strip_width_min(network.lattice)
}

/// The width of a way's strip, in quanta. A deck is as wide as a strip has to be, since without one there is no bridge.
pub(crate) fn strip_width(traits: &Traits, lattice: FeatureLattice) -> i32 {
    if traits.storey.is_deck() { traits.width.max(strip_width_min(lattice)) } else { traits.width }
}

/// The least width of a strip, in quanta.
fn strip_width_min(lattice: FeatureLattice) -> i32 {
    STRIP_STEPS_MIN * lattice.quanta_per_step()
}

/// The form a way may have: the lesser of what it asks for and what it is granted; decks are always wide.
fn form_of(traits: &Traits, grant: Grant, network: &Network) -> Form {
    if is_narrow(traits, network) {
        return Form::Line;
    }
    if traits.storey.is_deck() {
        return Form::StripAlways;
    }
    match (traits.form, grant.most) {
        (Form::Polygon, _) | (_, Form::Line) | (Form::Line, _) => Form::Line,
        (Form::Bench, Form::Bench) => Form::Bench,
        (Form::Strip | Form::Bench | Form::StripAlways, _) => Form::StripAlways,
    }
}
