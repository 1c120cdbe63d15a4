//! Bands: ways that are lines in the ground, as wide as they are.
//!
//! Where a way turns, the bands before and after it are mitred. Where it turns back, where several ways or unlike
//! widths meet, and where a way ends, a disc joins them.

use std::collections::{BTreeMap, BTreeSet, HashMap};

use crate::plans::{At, Ring, difference, triangles};
use crate::{Draped, Flat, HOLE_CLASS, LineForm, LineKind, LoadModule, ModuleId, ModuleLine, ModuleRect};

/// Travelled ways before channels, each by class: what comes first covers the others.
type Order = (LineKind, u8);

/// Whether a line is a band: a way in the ground that has a width, and no triangles of its own.
pub fn is_band(line: &ModuleLine) -> bool {
    let is_way = line.kind != LineKind::Breakline && line.form == LineForm::Line;
    line.is_in_ground && is_way && 0 < line.width
}

/// Pieces of bands by load module and class. Places are quanta from the south-west corner of the rectangle of load
/// modules that they lie in.
pub struct Bands {
    pieces: BTreeMap<ModuleId, BTreeMap<Order, Vec<Ring>>>,
    /// Classes of ground that bands give way to: those of ways, which strips have, and holes.
    taken: BTreeSet<u8>,
    rect: ModuleRect,
    side: i32,
}

impl Bands {
    /// Those of lines, each of a load module in `rect`, whose sides are `side` quanta.
    pub fn of<'a>(
        lines: impl Iterator<Item = (ModuleId, &'a ModuleLine)> + Clone,
        rect: ModuleRect,
        side: i32,
    ) -> Self {
        let taken = lines.clone().map(|(_, line)| line.class).chain([HOLE_CLASS]).collect();
        let mut all = Self { pieces: BTreeMap::new(), taken, rect, side };
        let bands: Vec<Band> =
            lines.filter(|(_, line)| is_band(line)).map(|(id, line)| Band::of(line, all.corner(id))).collect();
        let ends = Ends::of(&bands);
        for band in &bands {
            for ring in rings(band, &ends) {
                for id in all.under(&ring) {
                    all.pieces.entry(id).or_default().entry(band.order).or_default().push(ring.clone());
                }
            }
        }
        all
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.pieces.is_empty()
    }

    /// The bands over a load module by class, as convex polygons at the height of its ground. No two lie in one place:
    /// those of one class are united, and what one of an earlier class covers, or a strip, is left to that.
    pub fn over(&self, module: &LoadModule) -> Vec<(u8, Vec<Vec<[f64; 3]>>)> {
        let Some(by_order) = self.pieces.get(&module.id) else { return Vec::new() };
        let ground = Draped::of(module, self.corner(module.id)).without(module, &self.taken);
        let mut before: Vec<Ring> = Vec::new();
        let mut over = Vec::new();
        for ((_, class), rings) in by_order {
            let mut polygons = Vec::new();
            for plan in difference(std::slice::from_ref(rings), std::slice::from_ref(&before)) {
                let (places, triangles) = triangles(&plan);
                for corners in triangles {
                    let corners: [Flat; 3] = corners.map(|at| places[at as usize].map(f64::from));
                    polygons.extend(ground.under(&corners));
                }
            }
            before.extend(rings.iter().cloned());
            over.push((*class, polygons));
        }
        over
    }

    fn corner(&self, id: ModuleId) -> At {
        [(id.col - self.rect.west) as i32 * self.side, (id.row - self.rect.south) as i32 * self.side]
    }

    /// The load modules that a ring may reach.
    fn under(&self, ring: &Ring) -> Vec<ModuleId> {
        let Self { rect, side, .. } = *self;
        let span = |axis: usize, count: u32| {
            let of = || ring.iter().map(|at| at[axis].div_euclid(side));
            of().min().unwrap_or(0).max(0)..=of().max().unwrap_or(0).min(count as i32 - 1)
        };
        let (rows, cols) = (span(1, rect.rows()), span(0, rect.cols()));
        let id = |row: i32, col: i32| ModuleId { row: rect.south + row as u32, col: rect.west + col as u32 };
        rows.flat_map(|row| cols.clone().map(move |col| id(row, col))).collect()
    }
}

/// A way in one load module.
struct Band {
    order: Order,
    width: u16,
    /// Two or more places of its middle.
    places: Vec<At>,
}

impl Band {
    /// That of a line of a load module whose south-west corner stands at `corner`.
    fn of(line: &ModuleLine, corner: At) -> Self {
        let place = |vertex: &crate::ModuleVertex| [corner[0] + i32::from(vertex.x), corner[1] + i32::from(vertex.y)];
        Self { order: (line.kind, line.class), width: line.width, places: line.vertices.iter().map(place).collect() }
    }
}

/// Corners of a disc, in halves of the width, counter-clockwise.
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
/// Where a way turns by more than this cosine says, its bands are not mitred.
const MITRE_COSINE_MIN: f64 = -0.3;

/// For each end of bands of one order and width, the places that come next on each band there.
struct Ends(HashMap<(Order, u16, At), Vec<At>>);

impl Ends {
    fn of(bands: &[Band]) -> Self {
        let mut ends: HashMap<_, Vec<At>> = HashMap::new();
        for Band { order, width, places } in bands {
            let last = places.len() - 1;
            for (end, next) in [(places[0], places[1]), (places[last], places[last - 1])] {
                ends.entry((*order, *width, end)).or_default().push(next);
            }
        }
        Self(ends)
    }

    /// Where the way goes on beyond its end, if it goes on once.
    fn beyond(&self, band: &Band, end: At, next: At) -> Option<At> {
        match self.0.get(&(band.order, band.width, end))?.as_slice() {
            [a, b] => Some(if *a == next { *b } else { *a }),
            _ => None,
        }
    }
}

/// The plans of a band, counter-clockwise and convex: a ring for each stretch between two places, and a disc where
/// stretches are not mitred.
fn rings(band: &Band, ends: &Ends) -> Vec<Ring> {
    let Band { width, places, .. } = band;
    let last = places.len() - 1;
    let half = f64::from(*width) / 2.0;
    let mitre_at = |at: usize| {
        let before = if at == 0 { ends.beyond(band, places[0], places[1]) } else { Some(places[at - 1]) };
        let after = if at == last { ends.beyond(band, places[at], places[at - 1]) } else { Some(places[at + 1]) };
        mitre(before?, places[at], after?, half)
    };
    let mitres: Vec<Option<Flat>> = (0..=last).map(mitre_at).collect();
    let beside = |at: usize, reach: Flat, side: f64| -> At {
        [0, 1].map(|axis| (f64::from(places[at][axis]) + side * half * reach[axis]).round() as i32)
    };
    let unmitred = (0..=last).filter(|&at| mitres[at].is_none());
    let discs = unmitred.map(|at| DISC.iter().map(|&corner| beside(at, corner, 1.0)).collect());
    let stretches = (0..last).map(|at| {
        let (along, _) = direction(places[at], places[at + 1]);
        let [from, to] = [at, at + 1].map(|end| mitres[end].unwrap_or([-along[1], along[0]]));
        vec![beside(at, from, -1.0), beside(at + 1, to, -1.0), beside(at + 1, to, 1.0), beside(at, from, 1.0)]
    });
    discs.chain(stretches).collect()
}

/// The way from one place to another, and how far it is.
fn direction(from: At, to: At) -> (Flat, f64) {
    let along = [0, 1].map(|axis| f64::from(to[axis]) - f64::from(from[axis]));
    let length = along[0].hypot(along[1]).max(1.0);
    (along.map(|part| part / length), length)
}

/// From the middle of a way to its left side where it turns, in halves of its width; `None` where it turns back, or so
/// near to its next place that the inner side would reach beyond that.
fn mitre(before: At, at: At, after: At, half: f64) -> Option<Flat> {
    let ((a, from), (b, to)) = (direction(before, at), direction(at, after));
    let cosine = a[0] * b[0] + a[1] * b[1];
    let sine = a[0] * b[1] - a[1] * b[0];
    let reach = |a: f64, b: f64| (a + b) / (1.0 + cosine);
    let has_room = || half * sine.abs() <= (1.0 + cosine) * from.min(to);
    (MITRE_COSINE_MIN < cosine && has_room()).then(|| [-reach(a[1], b[1]), reach(a[0], b[0])])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn road(width: u16, places: &[At]) -> Band {
        Band { order: (LineKind::Travelled, 1), width, places: places.to_vec() }
    }

    fn band_rings(bands: &[Band]) -> Vec<Vec<Ring>> {
        let ends = Ends::of(bands);
        bands.iter().map(|band| rings(band, &ends)).collect()
    }

    fn covers(rings: &[Vec<Ring>], at: At) -> bool {
        let left = |a: At, b: At| {
            let cross = |p: i32, q: i32| i64::from(p) * i64::from(q);
            0 <= cross(b[0] - a[0], at[1] - a[1]) - cross(b[1] - a[1], at[0] - a[0])
        };
        let holds = |ring: &Ring| ring.iter().zip(ring.iter().cycle().skip(1)).all(|(&a, &b)| left(a, b));
        rings.iter().flatten().any(holds)
    }

    #[test]
    fn a_band_that_turns_is_whole_at_its_outer_side() {
        let one = band_rings(&[road(200, &[[0, 0], [1000, 0], [1000, 1000]])]);
        assert!(covers(&one, [1090, -90]) && covers(&one, [910, 90]) && !covers(&one, [880, 120]));
        let two = band_rings(&[road(200, &[[0, 0], [1000, 0]]), road(200, &[[1000, 1000], [1000, 0]])]);
        assert!(covers(&two, [1090, -90]), "two lines that meet end to end are one way");
    }

    #[test]
    fn discs_join_unlike_widths_and_ways_that_turn_back() {
        let widths = band_rings(&[road(200, &[[0, 0], [1000, 0]]), road(300, &[[1000, 0], [1900, 400]])]);
        assert_eq!(widths.iter().map(Vec::len).collect::<Vec<_>>(), [3, 3]);
        assert!(covers(&widths, [1020, -120]) && covers(&widths, [990, 130]));
        let back = band_rings(&[road(200, &[[0, 0], [1000, 0], [0, 100]])]);
        assert!(covers(&back, [1080, 0]) && !covers(&back, [1120, 0]));
        let short = band_rings(&[road(400, &[[0, 0], [1000, 0], [1000, 60], [2000, 60]])]);
        assert_eq!(short[0].len(), 3 + 4, "stretches shorter than their mitres are joined by discs");
    }
}
