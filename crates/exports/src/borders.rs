//! How areas that were built apart meet: where their ground gapes along a common border, measured exactly.
//!
//! Only ground that both have is compared: beside a hole nothing is known of it.

use terrain::{HOLE_CLASS, LoadModule, QUANTA_PER_METRE};

use crate::skirts::{Line, Side};
use crate::{Earth, ExportError, Product};

/// What grounds lie apart by before it is told: 5 cm, in quanta.
const APART: f64 = 0.05 * QUANTA_PER_METRE as f64;

/// How two areas gape along their common border.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gap {
    /// Their numbers.
    pub areas: [usize; 2],
    /// Along how many metres both have ground.
    pub border_m: f64,
    /// Along how many of these the grounds lie more than 5 cm apart.
    pub gaping_m: f64,
    /// How far apart they lie where they do most, in metres.
    pub most_m: f64,
}

/// The ground along the sides of an area.
pub(crate) struct Border {
    corner_m: [f64; 2],
    /// West, east, south and north; edges of triangles in order, their heights above the ellipsoid.
    sides: [(Side, Vec<Line>); 4],
}

impl Border {
    pub(crate) fn of(product: &Product, earth: &Earth) -> Result<Self, ExportError> {
        let corner_m = product.corner_m(product.rect.south, product.rect.west);
        let raised = |[x, y, z]: [i32; 3]| -> Result<[i32; 3], ExportError> {
            let place_m = [x, y].map(|quanta| f64::from(quanta) / f64::from(QUANTA_PER_METRE));
            let lon_lat = earth.lon_lat([corner_m[0] + place_m[0], corner_m[1] + place_m[1]])?;
            let added = earth.datum_m(lon_lat) * f64::from(QUANTA_PER_METRE);
            Ok([x, y, z + added.round() as i32])
        };
        let edges = |side: Side| -> Result<(Side, Vec<Line>), ExportError> {
            let all = product.modules.iter().flat_map(|module| edges(module, product.corner(module.id), side));
            let line = |[a, b]: [[i32; 3]; 2]| Ok(Line::of(side, &[raised(a)?, raised(b)?]));
            let mut lines = all.map(line).collect::<Result<Vec<_>, ExportError>>()?;
            lines.sort_by_key(|line| line.ends()[0]);
            Ok((side, lines))
        };
        let [west, east, south, north] = Side::of(product, product.rect).map(edges);
        Ok(Self { corner_m, sides: [west?, east?, south?, north?] })
    }

    /// How it gapes against another one: metres of the common border, metres that gape, and how far at most.
    fn against(&self, other: &Self) -> [f64; 3] {
        let quanta = |metres: f64| metres * f64::from(QUANTA_PER_METRE);
        let off = [0, 1].map(|axis| quanta(other.corner_m[axis] - self.corner_m[axis]));
        let [mut border, mut gaping, mut most] = [0.0; 3];
        for (number, (side, lines)) in self.sides.iter().enumerate() {
            // Its west meets the other's east, and its south the other's north.
            let (beyond, others) = &other.sides[number ^ 1];
            let axis = side.axis;
            if 0.5 < (off[axis] + f64::from(beyond.at) - f64::from(side.at)).abs() {
                continue;
            }
            let along = off[1 - axis].round() as i32;
            for line in lines {
                let [from, to] = line.ends().map(|end| end.saturating_sub(along));
                let first = others.partition_point(|other| other.ends()[1] <= from);
                for facing in others[first..].iter().take_while(|other| other.ends()[0] < to) {
                    let ends = [facing.ends()[0].max(from), facing.ends()[1].min(to)];
                    let apart = |at: i32| {
                        let heights = line.height(at + along).zip(facing.height(at));
                        heights.map_or(0.0, |(own, other)| own - other)
                    };
                    let (length, [a, b]) = (f64::from(ends[1] - ends[0]), ends.map(apart));
                    border += length;
                    gaping += length * (share_above(a, b) + share_above(-a, -b));
                    most = most.max(a.abs()).max(b.abs());
                }
            }
        }
        [border, gaping, most].map(|found: f64| found / f64::from(QUANTA_PER_METRE))
    }

    /// How areas with these numbers gape; `None` where they meet, or have no common border.
    pub(crate) fn gap(areas: [usize; 2], [one, other]: [&Self; 2]) -> Option<Gap> {
        let [border_m, gaping_m, most_m] = one.against(other);
        (0.0 < gaping_m).then_some(Gap { areas, border_m, gaping_m, most_m })
    }
}

/// The edges of a load module on a side, from the lower end to the higher.
fn edges(module: &LoadModule, corner: [i32; 2], side: Side) -> Vec<[[i32; 3]; 2]> {
    let ends = [corner[side.axis], corner[side.axis] + i32::from(module.side)];
    if !ends.contains(&side.at) {
        return Vec::new();
    }
    let place = |v: u16| {
        let vertex = module.vertices[usize::from(v)];
        [corner[0] + i32::from(vertex.x), corner[1] + i32::from(vertex.y), vertex.z]
    };
    let ground = module.triangles.iter().zip(&module.classes).filter(|(_, class)| **class != HOLE_CLASS);
    let all = ground.flat_map(|(&[a, b, c], _)| [[a, b], [b, c], [c, a]].map(|edge| edge.map(place)));
    all.filter(|edge| edge.iter().all(|place| side.holds(*place))).collect()
}

/// The share of a stretch on which what is `a` at one end and `b` at the other, and straight between, is too much.
fn share_above(a: f64, b: f64) -> f64 {
    let (low, high) = (a.min(b), a.max(b));
    if high <= APART {
        0.0
    } else if APART <= low {
        1.0
    } else {
        (high - APART) / (high - low)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::samples;

    /// How the western load module of a product meets the eastern one, each as an area of its own.
    fn gap(product: &Product) -> Option<Gap> {
        let part = |at: usize| {
            let mut part = Product { modules: vec![product.modules[at].clone()], ..product.clone() };
            (part.rect.west, part.rect.east) = (at as u32, at as u32 + 1);
            Border::of(&part, &Earth::new(&part, None).unwrap()).unwrap()
        };
        let [west, east] = [0, 1].map(part);
        assert_eq!(Border::gap([0, 0], [&west, &west]), None, "an area has no border in common with itself");
        let found = Border::gap([3, 5], [&west, &east]);
        let back = Border::gap([3, 5], [&east, &west]);
        assert_eq!(found, back);
        found
    }

    #[test]
    fn areas_gape_by_what_their_grounds_lie_apart_on_the_common_border() {
        let mut product = samples::product();
        assert_eq!(gap(&product), None);
        // 5 m at the northern end, nothing at the southern one: one part of a hundred is below 5 cm.
        product.modules[1].vertices[3].z += 5 * QUANTA_PER_METRE;
        let found = gap(&product).unwrap();
        let off = [found.border_m - 500.0, found.gaping_m - 495.0, found.most_m - 5.0];
        assert!(found.areas == [3, 5] && off.iter().all(|off| off.abs() < 1e-6), "{found:?}");
        // A hole on one side.
        product.modules[1].classes[1] = HOLE_CLASS;
        assert_eq!(gap(&product), None);
        // As far apart as is not told, and a point that one side alone has.
        let mut product = samples::product();
        product.modules[0].vertices[3].z -= 6;
        assert_eq!(gap(&product), None);
        let mut product = samples::across_squares();
        product.modules.iter_mut().for_each(|module| module.id.col -= 7);
        product.rect = terrain::ModuleRect { south: 0, west: 0, north: 1, east: 2 };
        assert_eq!(gap(&product), None);
        product.modules[0] = samples::product().modules[0].clone();
        let found = gap(&product).unwrap();
        let expected_m = (128_384.0 - 125_000.0) / 128.0;
        // The geoid is rounded to quanta at both ends and at the point between.
        assert!((found.most_m - expected_m).abs() < 0.01 && 490.0 < found.gaping_m, "{found:?}");
    }
}
