//! How far decks stand above the ground, from triangles alone.

use std::collections::BTreeMap;

use terrain::{LoadModule, ModuleVertex};

use crate::places::{each_under, height_in};

/// Quanta between places at which decks are sampled: a metre.
const SAMPLE: i32 = 128;

/// Quanta that a deck may lie under the ground on which it rests: 5 cm, which is what raising its corners leaves.
const ROUNDING: i32 = 6;

/// What lies under decks, a place in every square metre.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct DeckFigures {
    /// Places of decks that were looked at.
    pub samples: u64,
    /// Those of them at which the ground stands above the deck.
    pub under: u64,
    /// How far it does at most, in quanta.
    pub deepest: u32,
    /// The least height of a deck above the ground of each class, in quanta.
    pub clearance: BTreeMap<u8, i32>,
}

impl DeckFigures {
    /// Those of the decks of a load module.
    pub fn of(module: &LoadModule) -> Self {
        let places = samples(module);
        let mut figures = Self { samples: places.len() as u64, ..Self::default() };
        let mut above = vec![f64::INFINITY; places.len()];
        each_under(module, f64::from(module.side), &places, &mut |index, triangle, plane| {
            let height = places[index][2] - plane;
            above[index] = above[index].min(height);
            let least = figures.clearance.entry(module.classes[triangle]).or_insert(i32::MAX);
            *least = (*least).min(height.floor() as i32);
        });
        for under in above.into_iter().map(|above| -above.floor() as i32).filter(|under| ROUNDING < *under) {
            figures.under += 1;
            figures.deepest = figures.deepest.max(under.unsigned_abs());
        }
        figures
    }

    /// Adds those of others.
    pub fn merge(&mut self, other: &Self) {
        self.samples += other.samples;
        self.under += other.under;
        self.deepest = self.deepest.max(other.deepest);
        for (&class, &least) in &other.clearance {
            let own = self.clearance.entry(class).or_insert(least);
            *own = least.min(*own);
        }
    }
}

/// Places of decks with their heights: the middles of square metres of the load module that a triangle of a deck holds.
fn samples(module: &LoadModule) -> Vec<[f64; 3]> {
    let decks = &module.decks;
    let mut places = Vec::new();
    for triangle in &decks.triangles {
        let corners = triangle.map(|corner| decks.vertices[usize::from(corner)]);
        let span = |of: fn(&ModuleVertex) -> u16| {
            let low = corners.iter().map(|corner| i32::from(of(corner))).min().unwrap_or(0);
            let high = corners.iter().map(|corner| i32::from(of(corner))).max().unwrap_or(-1);
            (low.div_euclid(SAMPLE)..=high.div_euclid(SAMPLE)).map(|square| square * SAMPLE + SAMPLE / 2)
        };
        let corners = corners.map(|corner| [f64::from(corner.x), f64::from(corner.y), f64::from(corner.z)]);
        for y in span(|corner| corner.y) {
            for x in span(|corner| corner.x) {
                let place = [f64::from(x), f64::from(y)];
                places.extend(height_in(corners, place).map(|height| [place[0], place[1], height]));
            }
        }
    }
    places
}

#[cfg(test)]
mod tests {
    use super::*;
    use terrain::{Decks, ModuleId, ModuleResidual};

    fn vertex(x: u16, y: u16, z: i32) -> ModuleVertex {
        ModuleVertex { y, x, z }
    }

    /// A load module of 100 m at height 0, its northern half of class 1, under a deck of 20 m by 10 m over both halves.
    fn module(heights: [i32; 4]) -> LoadModule {
        let [a, b, c, d] = [(4000, 5000), (5280, 5000), (5280, 7560), (4000, 7560)];
        let corners = [a, b, c, d].into_iter().zip(heights).map(|((x, y), z)| vertex(x, y, z));
        let corners: Vec<ModuleVertex> = corners.collect();
        let triangles = [[0, 1, 2], [0, 2, 3]].map(|triangle| (triangle.map(|corner| corners[corner]), 3));
        LoadModule {
            id: ModuleId { row: 0, col: 0 },
            side: 12_800,
            vertices: vec![
                vertex(0, 0, 0),
                vertex(12_800, 0, 0),
                vertex(0, 6400, 0),
                vertex(12_800, 6400, 0),
                vertex(0, 12_800, 0),
                vertex(12_800, 12_800, 0),
            ],
            triangles: vec![[0, 1, 3], [0, 3, 2], [2, 3, 5], [2, 5, 4]],
            classes: vec![0, 0, 1, 1],
            polygon_count: 4,
            residual: ModuleResidual::default(),
            decks: Decks::of_triangles(triangles.to_vec()),
            lines: Vec::new(),
            objects: terrain::Objects::default(),
        }
    }

    #[test]
    fn a_deck_above_the_ground_has_its_least_height_over_each_class_and_no_place_under_it() {
        let found = DeckFigures::of(&module([256, 256, 768, 768]));
        assert_eq!((found.samples, found.under, found.deepest), (200, 0, 0));
        let [south, north] = [found.clearance[&0], found.clearance[&1]];
        assert!((256..300).contains(&south) && (500..600).contains(&north), "{south} {north}");
    }

    #[test]
    fn places_of_a_deck_under_the_ground_are_counted_and_a_quantum_is_not() {
        let found = DeckFigures::of(&module([-640, -640, 640, 640]));
        assert!((90..=110).contains(&found.under) && (550..640).contains(&found.deepest), "{found:?}");
        assert_eq!(DeckFigures::of(&module([-1; 4])).under, 0);
    }
}
