//! What formed features cost in triangles, counted before any tile is refined.
//!
//! A deck has as many triangles at most as it has corners. On the ground, a point inside a load module adds two
//! triangles and one on its side adds one, whatever else the TIN holds, because triangles = 2 V + B - 2. So the count
//! is exact for what features put there, and a lower bound for their module.

use std::collections::BTreeMap;

use crate::forms::Formed;
use crate::strips::Face;
use crate::{Place, Site};

/// Triangles that features take, by load module (row, column) and class.
pub type Cost = BTreeMap<(i32, i32), BTreeMap<u16, u32>>;

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
pub(crate) fn modules_under(deck: &Face, site: &Site) -> Vec<(i32, i32)> {
    let modules: Vec<(i32, i32)> = deck.corners.iter().map(|(place, _)| site.module_of(*place)).collect();
    let span = |of: fn(&(i32, i32)) -> i32| {
        let all = modules.iter().map(of);
        all.clone().min().unwrap_or(0)..=all.max().unwrap_or(-1)
    };
    span(|module| module.0).flat_map(|row| span(|module| module.1).map(move |col| (row, col))).collect()
}

/// The load modules a point belongs to, with the triangles it adds to each.
pub(crate) fn modules_of(place: Place, site: &Site) -> Vec<((i32, i32), u32)> {
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
