//! Roads that meet level water without a bridge: they take its level, so that no triangle of a lake is tilted by one.

use std::collections::{BTreeSet, HashMap};

use crate::clean::Notes;
use crate::parts::lakes_along;
use crate::rings::encloses;
use crate::sweep::{Pin, bounds};
use crate::{Flaw, Lake, Network, Outline, Place, Remark, Remedy, Site};

/// Rounds in which pins that a road cannot reach are given up.
const ROUNDS: usize = 4;

/// The nodes of a network of roads that lie in a lake or at its shore, each with the lake's level: those whose edges
/// may reach into it, too. Ends of bridges are left out.
pub fn afloat(outlines: &[Outline], lakes: &[Lake], roads: &Network, sides: &[[Place; 2]], site: &Site) -> Vec<Pin> {
    let mut levels: HashMap<u32, i32> = HashMap::new();
    for still in lakes_along(outlines, lakes, roads, site) {
        still.nodes.iter().for_each(|&node| lower(&mut levels, node, still.level));
    }
    let mut cells: HashMap<(i32, i32), Vec<u32>> = HashMap::new();
    for node in (0..roads.nodes.len() as u32).filter(|node| roads.nodes[*node as usize].on_ground) {
        cells.entry(site.module_of(roads.nodes[node as usize].place)).or_default().push(node);
    }
    for lake in lakes {
        let outline = &outlines[lake.outline as usize];
        let wet = nodes_beside(outline, &cells, sides, site);
        for &node in &wet {
            lower(&mut levels, node, lake.level);
            // The edge to the next station passes through the water beside it.
            for (next, edge) in roads.beside(node) {
                if roads.is_ground(*edge) {
                    lower(&mut levels, *next, lake.level);
                }
            }
        }
    }
    let bears_deck = |node: u32| {
        let storeys = roads.beside(node).iter().map(|(_, edge)| roads.traits(*edge).storey);
        storeys.into_iter().any(|storey| storey.is_deck())
    };
    let mut pins: Vec<Pin> = levels.into_iter().map(|(node, height)| Pin { node, height }).collect();
    pins.retain(|pin| !bears_deck(pin.node));
    pins.sort_unstable();
    pins
}

fn lower(levels: &mut HashMap<u32, i32>, node: u32, level: i32) {
    levels.entry(node).and_modify(|other| *other = level.min(*other)).or_insert(level);
}

/// Nodes one of whose sides lies inside an outline.
fn nodes_beside(
    outline: &Outline,
    cells: &HashMap<(i32, i32), Vec<u32>>,
    sides: &[[Place; 2]],
    site: &Site,
) -> BTreeSet<u32> {
    let span = |of: fn(Place) -> i32| (outline.places().map(of).min(), outline.places().map(of).max());
    let ((Some(south), Some(north)), (Some(west), Some(east))) = (span(|place| place.row), span(|place| place.col))
    else {
        return BTreeSet::new();
    };
    let (low, high) = (site.module_of(Place::new(south, west)), site.module_of(Place::new(north, east)));
    let is_inside = |place: &Place| {
        let in_box = (south..=north).contains(&place.row) && (west..=east).contains(&place.col);
        in_box && outline.rings.iter().filter(|ring| encloses(&ring.places, *place)).count() % 2 == 1
    };
    let modules = (low.0 - 1..=high.0 + 1).flat_map(|row| (low.1 - 1..=high.1 + 1).map(move |col| (row, col)));
    let nodes = modules.filter_map(|module| cells.get(&module)).flatten().copied();
    nodes.filter(|node| sides[*node as usize].iter().any(is_inside)).collect()
}

/// Pins, and those of water beside them as far as roads can reach them within the most that their grades give; what
/// is given up is written down.
pub fn with_water(network: &Network, pins: Vec<Pin>, afloat: &[Pin], remarks: &mut Vec<Remark>) -> Vec<Pin> {
    let pinned: BTreeSet<u32> = pins.iter().map(|pin| pin.node).collect();
    let mut afloat: Vec<Pin> = afloat.iter().copied().filter(|pin| !pinned.contains(&pin.node)).collect();
    let costs: Vec<i32> = (0..network.edges.len() as u32).map(|edge| network.relaxed_max(edge)).collect();
    for _ in 0..ROUNDS {
        let all: Vec<Pin> = pins.iter().chain(&afloat).copied().collect();
        let (least, most) = bounds(network, &costs, &all);
        let (kept, torn): (Vec<Pin>, Vec<Pin>) = afloat
            .iter()
            .partition(|pin| least[pin.node as usize] <= pin.height && pin.height <= most[pin.node as usize]);
        for pin in &torn {
            let (_, edge) = network.beside(pin.node)[0];
            let id = network.ways[network.edges[edge as usize].way as usize].id;
            let place = network.nodes[pin.node as usize].place;
            let mut notes = Notes { id, lattice: network.lattice, remarks };
            notes.write_at(place, Flaw::LevelsDisagree, Remedy::LeftAsItIs);
        }
        afloat = kept;
        if torn.is_empty() {
            break;
        }
    }
    let mut all: Vec<Pin> = pins.into_iter().chain(afloat).collect();
    all.sort_unstable();
    all
}
