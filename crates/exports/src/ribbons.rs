//! Ribbons: bands for roads, rails and streams that are lines in the ground, which classify none of its triangles.
//!
//! A band is as wide as its way and lies a little above the ground. Bands of one class are united, and what a band of
//! an earlier class covers, or a strip, is left to that; so no two faces lie in one place.

use std::collections::{BTreeMap, BTreeSet, HashMap};

use terrain::plans::{At, Ring, difference, triangles};
use terrain::{Draped, Flat, HOLE_CLASS, LineKind, ModuleId, ModuleLine};

use crate::Product;
use crate::objects::Facet;
use crate::product::is_band;

/// How far a ribbon lies above the ground, in quanta: 5 cm, to the next whole one.
pub(crate) const RIBBON_UP: i32 = 6;
/// Corners of the disc at which bands of several ways meet, or one ends, in halves of their width, counter-clockwise.
const DISC: [Flat; 12] = {
    const S: f64 = 0.866_025_403_784_438_6;
    [
        [1.0, 0.0],
        [S, 0.5],
        [0.5, S],
        [0.0, 1.0],
        [-0.5, S],
        [-S, 0.5],
        [-1.0, 0.0],
        [-S, -0.5],
        [-0.5, -S],
        [0.0, -1.0],
        [0.5, -S],
        [S, -0.5],
    ]
};
/// Where a way turns by more than this cosine says, its bands are not mitred but joined by a disc.
const MITRE_COSINE_MIN: f64 = -0.3;

/// Travelled ways before channels, each by class: what comes first covers the others.
type Order = (LineKind, u8);

/// Pieces of bands of a product, by load module and class.
pub(crate) struct Ribbons {
    pieces: BTreeMap<ModuleId, BTreeMap<Order, Vec<Ring>>>,
    /// Classes of ground that bands give way to: those of ways, which strips have, and holes.
    taken: BTreeSet<u8>,
}

impl Ribbons {
    /// Those of all load modules of a product; `None` where no way is a line in the ground.
    pub(crate) fn of(product: &Product) -> Option<Self> {
        let lines = || {
            product
                .lines
                .iter()
                .zip(&product.modules)
                .flat_map(|(lines, module)| lines.iter().map(|line| (module.id, line)))
        };
        let taken = lines().map(|(_, line)| line.class).chain([HOLE_CLASS]).collect();
        let ways: Vec<Way> =
            lines().filter(|(_, line)| is_band(line)).map(|(id, line)| Way::of(line, product.corner(id))).collect();
        let mut pieces: BTreeMap<ModuleId, BTreeMap<Order, Vec<Ring>>> = BTreeMap::new();
        let ends = Ends::of(&ways);
        for way in &ways {
            for ring in way.rings(&ends) {
                for id in under(product, &ring) {
                    pieces.entry(id).or_default().entry(way.order).or_default().push(ring.clone());
                }
            }
        }
        (!pieces.is_empty()).then_some(Self { pieces, taken })
    }

    /// The ribbons over a load module: a facet for each class, which is its material.
    pub(crate) fn in_module(&self, product: &Product, id: ModuleId) -> Vec<Facet> {
        let (Some(by_class), Some(module)) = (self.pieces.get(&id), product.module(id)) else { return Vec::new() };
        let ground = Draped::of(module, product.corner(id)).without(module, &self.taken);
        let mut before: Vec<Ring> = Vec::new();
        let mut facets = Vec::new();
        for ((_, class), rings) in by_class {
            let mut polygons = Vec::new();
            for plan in difference(std::slice::from_ref(rings), &[before.clone()]) {
                let (places, triangles) = triangles(&plan);
                for corners in triangles {
                    let corners: [Flat; 3] = corners.map(|at| places[at as usize].map(f64::from));
                    let lifted =
                        |[x, y, z]: [f64; 3]| [x.round() as i32, y.round() as i32, z.round() as i32 + RIBBON_UP];
                    let pieces = ground.under(&corners).into_iter();
                    polygons.extend(pieces.map(|piece| piece.into_iter().map(lifted).collect::<Vec<_>>()));
                }
            }
            before.extend(rings.iter().cloned());
            facets.push(Facet { material: *class, polygons });
        }
        facets
    }
}

/// The load modules that a ring may reach.
fn under(product: &Product, ring: &Ring) -> Vec<ModuleId> {
    let side = product.side();
    let span = |axis: usize, count: u32| {
        let of = || ring.iter().map(|at| at[axis].div_euclid(side));
        let low = of().min().unwrap_or(0).max(0);
        let high = of().max().unwrap_or(0).min(count as i32 - 1);
        low..=high
    };
    let (rows, cols) = (span(1, product.rect.rows()), span(0, product.rect.cols()));
    let id =
        |row: i32, col: i32| ModuleId { row: product.rect.south + row as u32, col: product.rect.west + col as u32 };
    rows.flat_map(|row| cols.clone().map(move |col| id(row, col))).collect()
}

/// A way in one load module.
struct Way {
    order: Order,
    width: u16,
    places: Vec<[i32; 2]>,
}

/// For each end of ways of one class and width, the places that come next on each way there.
struct Ends(HashMap<(Order, u16, [i32; 2]), Vec<[i32; 2]>>);

impl Ends {
    fn of(ways: &[Way]) -> Self {
        let mut ends: HashMap<_, Vec<[i32; 2]>> = HashMap::new();
        for Way { order, width, places } in ways {
            let last = places.len() - 1;
            for (end, next) in [(places[0], places[1]), (places[last], places[last - 1])] {
                ends.entry((*order, *width, end)).or_default().push(next);
            }
        }
        Self(ends)
    }

    /// Where the way goes on beyond its end, if it goes on once.
    fn beyond(&self, way: &Way, end: [i32; 2], next: [i32; 2]) -> Option<[i32; 2]> {
        match self.0.get(&(way.order, way.width, end))?.as_slice() {
            [a, b] => Some(if *a == next { *b } else { *a }),
            _ => None,
        }
    }
}

impl Way {
    fn of(line: &ModuleLine, corner: [i32; 2]) -> Self {
        let place = |vertex: &terrain::ModuleVertex| [corner[0] + i32::from(vertex.x), corner[1] + i32::from(vertex.y)];
        let (kind, width) = (line.traits.kind, line.traits.width);
        Self { order: (kind, line.class), width, places: line.vertices.iter().map(place).collect() }
    }

    /// A band for each stretch between two places, counter-clockwise, and a disc where bands are not mitred.
    fn rings(&self, ends: &Ends) -> Vec<Ring> {
        let (count, places) = (self.places.len(), &self.places);
        let before = |at: usize| match at {
            0 => ends.beyond(self, places[0], places[1]),
            at => Some(places[at - 1]),
        };
        let after = |at: usize| match at + 1 < count {
            true => Some(places[at + 1]),
            false => ends.beyond(self, places[at], places[at - 1]),
        };
        let mitre_at = |at: usize| {
            let (before, after) = before(at).zip(after(at))?;
            mitre(before, places[at], after)
        };
        let unmitred = (0..count).filter(|&at| mitre_at(at).is_none());
        let mut rings: Vec<Ring> = unmitred.map(|at| self.disc(places[at])).collect();
        for at in 0..count - 1 {
            let along = direction(places[at], places[at + 1]);
            let side = [-along[1], along[0]];
            let [from, to] = [at, at + 1].map(|end| mitre_at(end).unwrap_or(side));
            rings.push(vec![
                self.beside(places[at], from, -1.0),
                self.beside(places[at + 1], to, -1.0),
                self.beside(places[at + 1], to, 1.0),
                self.beside(places[at], from, 1.0),
            ]);
        }
        rings
    }

    fn beside(&self, at: [i32; 2], reach: Flat, side: f64) -> At {
        let half = side * f64::from(self.width) / 2.0;
        [0, 1].map(|axis| (f64::from(at[axis]) + half * reach[axis]).round() as i32)
    }

    fn disc(&self, at: [i32; 2]) -> Ring {
        DISC.iter().map(|&corner| self.beside(at, corner, 1.0)).collect()
    }
}

fn direction(from: [i32; 2], to: [i32; 2]) -> Flat {
    let along = [0, 1].map(|axis| f64::from(to[axis]) - f64::from(from[axis]));
    let length = along[0].hypot(along[1]).max(1.0);
    along.map(|part| part / length)
}

/// From the middle of a way to its left side where it turns, in halves of its width; `None` where it turns back.
fn mitre(before: [i32; 2], at: [i32; 2], after: [i32; 2]) -> Option<Flat> {
    let (a, b) = (direction(before, at), direction(at, after));
    let cosine = a[0] * b[0] + a[1] * b[1];
    let reach = |a: f64, b: f64| (a + b) / (1.0 + cosine);
    (MITRE_COSINE_MIN < cosine).then(|| [-reach(a[1], b[1]), reach(a[0], b[0])])
}
