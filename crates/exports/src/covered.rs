//! What of an area lies under a finer one: its ground is taken for a hole, and nothing stands on it.
//!
//! A load module on the border of the finer area is cut along it. Where an edge crosses the border, the crossing is
//! computed from the edge's ends in one order and rounded to quanta, so triangles on both sides of the edge have the
//! same.

use std::collections::HashMap;

use source_files::Crs;
use store::Area;
use terrain::geometry::nearest_share;
use terrain::plans::{Plan, common, difference};
use terrain::{Decks, HOLE_CLASS, LoadModule, ModuleVertex, Objects, Prism, QUANTA_PER_METRE};

use crate::{ExportError, Product};

/// What became of an area that others lie above.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Covered {
    /// Load modules that lie under finer areas.
    pub left_out: usize,
    /// Load modules that lie there in part.
    pub cut: usize,
}

/// A finer area, as it is seen from the coordinate system of a coarser one.
pub(crate) struct Cover {
    coarse: Crs,
    fine: Crs,
    low_m: [f64; 2],
    high_m: [f64; 2],
}

/// How much of a load module is covered.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Share {
    Nothing,
    Part,
    Everything,
}

/// What lies nearer to the border of an area lies on it, in metres: a quantum.
const NEAR_M: f64 = 1.0 / QUANTA_PER_METRE as f64;

/// A corner of a polygon that is cut.
#[derive(Clone, Copy)]
struct Corner {
    /// East, north and up in quanta, from the corner of its load module.
    at: [f64; 3],
    /// Easting and northing in the system of the finer area.
    seen_m: [f64; 2],
}

/// Takes what lies under finer areas out of a product.
pub(crate) fn take_out(product: &mut Product, covers: &[Cover]) -> Result<Covered, ExportError> {
    let mut covered = Covered::default();
    if covers.is_empty() {
        return Ok(covered);
    }
    let corner_m = |module: &LoadModule| product.corner_m(module.id.row, module.id.col);
    let corners_m: Vec<[f64; 2]> = product.modules.iter().map(corner_m).collect();
    let levels = std::iter::once(&mut product.modules).chain(&mut product.coarser);
    for (level, modules) in levels.enumerate() {
        for (module, corner_m) in modules.iter_mut().zip(&corners_m) {
            let mut share = Share::Nothing;
            for cover in covers {
                share = share.max(cover.cut(module, *corner_m)?);
            }
            if share == Share::Part && module.classes.iter().all(|class| *class == HOLE_CLASS) {
                share = Share::Everything;
            }
            covered.left_out += usize::from(level == 0 && share == Share::Everything);
            covered.cut += usize::from(level == 0 && share == Share::Part);
        }
    }
    Ok(covered)
}

impl Cover {
    pub(crate) fn of(coarse: &Crs, fine: &Crs, area: &Area) -> Self {
        let side_m = [area.module_cols, area.module_rows].map(|count| f64::from(count) * area.module_side_m);
        let high_m = [0, 1].map(|axis| area.origin_m[axis] + side_m[axis]);
        Self { coarse: coarse.clone(), fine: fine.clone(), low_m: area.origin_m, high_m }
    }

    /// Takes what it covers out of a load module.
    fn cut(&self, module: &mut LoadModule, corner_m: [f64; 2]) -> Result<Share, ExportError> {
        let share = self.share(module.side, corner_m);
        match share {
            Share::Nothing => {}
            Share::Everything => {
                module.classes.fill(HOLE_CLASS);
                (module.decks, module.objects) = (Decks::default(), Objects::default());
            }
            Share::Part => self.cut_in_part(module, corner_m)?,
        }
        Ok(share)
    }

    /// Where a place in quanta from a corner lies in the system of the finer area; `None` where that does not reach.
    fn seen(&self, corner_m: [f64; 2], at: [f64; 2]) -> Option<[f64; 2]> {
        let place_m = [0, 1].map(|axis| corner_m[axis] + at[axis] / f64::from(QUANTA_PER_METRE));
        let seen_m = self.coarse.to(&self.fine, place_m)?;
        let back_m = self.fine.to(&self.coarse, seen_m)?;
        // Far away from where it is made for, a projection may answer with any place.
        (0..2).all(|axis| (back_m[axis] - place_m[axis]).abs() < 1.0).then_some(seen_m)
    }

    /// Least and largest easting and northing of a square in the system of the finer area.
    fn spans(&self, side: u16, corner_m: [f64; 2]) -> Option<[[f64; 2]; 2]> {
        let steps = [0.0, 0.5, 1.0].map(|share| share * f64::from(side));
        let places = steps.iter().flat_map(|&y| steps.map(|x| self.seen(corner_m, [x, y])));
        let places = places.collect::<Option<Vec<_>>>()?;
        let ends = |axis: usize| {
            let values = || places.iter().map(|place| place[axis]);
            [values().fold(f64::INFINITY, f64::min), values().fold(f64::NEG_INFINITY, f64::max)]
        };
        Some([ends(0), ends(1)])
    }

    /// What it covers of a square and of what lies around that, in quanta from the square's corner.
    fn plan_over(&self, side: u16, corner_m: [f64; 2]) -> Option<Plan> {
        let spans = self.spans(side, corner_m)?;
        // A square turned in the other system reaches beyond its corners there.
        let wide = |axis: usize| spans[axis][1] - spans[axis][0];
        let low = [0, 1].map(|axis| self.low_m[axis].max(spans[axis][0] - wide(axis)));
        let high = [0, 1].map(|axis| self.high_m[axis].min(spans[axis][1] + wide(axis)));
        let at = |place_m: [f64; 2]| {
            let own_m = self.fine.to(&self.coarse, place_m)?;
            Some([0, 1].map(|axis| ((own_m[axis] - corner_m[axis]) * f64::from(QUANTA_PER_METRE)).round() as i32))
        };
        let ring = [low, [high[0], low[1]], high, [low[0], high[1]]].into_iter().map(at).collect::<Option<_>>()?;
        Some(vec![ring])
    }

    fn share(&self, side: u16, corner_m: [f64; 2]) -> Share {
        let Some(spans) = self.spans(side, corner_m) else { return Share::Nothing };
        let is_beside =
            |axis: usize| spans[axis][1] <= self.low_m[axis] + NEAR_M || self.high_m[axis] - NEAR_M <= spans[axis][0];
        let is_inside =
            |axis: usize| self.low_m[axis] - NEAR_M <= spans[axis][0] && spans[axis][1] <= self.high_m[axis] + NEAR_M;
        match ((0..2).any(is_beside), (0..2).all(is_inside)) {
            (true, _) => Share::Nothing,
            (_, true) => Share::Everything,
            _ => Share::Part,
        }
    }

    /// A convex polygon in pieces: those outside, then those inside. It is cut along the whole of all four lines, so
    /// that no piece ends in the middle of another one's side.
    fn parted(&self, polygon: Vec<Corner>) -> [Vec<Vec<Corner>>; 2] {
        let mut pieces = vec![polygon];
        for (axis, line_m) in [0, 1].into_iter().flat_map(|axis| [(axis, self.low_m[axis]), (axis, self.high_m[axis])])
        {
            let halves = |piece: Vec<Corner>| [-1.0, 1.0].map(|towards| beyond(&piece, axis, line_m, towards));
            pieces = pieces.into_iter().flat_map(halves).filter(|piece| !piece.is_empty()).collect();
        }
        let middle = |piece: &[Corner], axis: usize| {
            piece.iter().map(|corner| corner.seen_m[axis]).sum::<f64>() / piece.len() as f64
        };
        let is_outside = |piece: &Vec<Corner>| !self.holds([middle(piece, 0), middle(piece, 1)]);
        let (outside, inside) = pieces.into_iter().partition(is_outside);
        [outside, inside]
    }

    fn cut_in_part(&self, module: &mut LoadModule, corner_m: [f64; 2]) -> Result<(), ExportError> {
        let corner = |[x, y, z]: [i32; 3]| {
            let at = [x, y, z].map(f64::from);
            Some(Corner { at, seen_m: self.seen(corner_m, [at[0], at[1]])? })
        };
        let of = |vertex: &ModuleVertex| corner([vertex.x.into(), vertex.y.into(), vertex.z]);
        let Some(corners) = module.vertices.iter().map(of).collect::<Option<Vec<_>>>() else { return Ok(()) };
        let mut ground = Pieces::default();
        for (triangle, class) in module.triangles.iter().zip(&module.classes) {
            let [outside, inside] = self.parted(triangle.map(|v| corners[usize::from(v)]).to_vec());
            outside.iter().for_each(|piece| ground.add(piece, *class));
            inside.iter().for_each(|piece| ground.add(piece, HOLE_CLASS));
        }
        let too_many = || ExportError::Impossible {
            what: format!("load module {}, which is cut where a finer area begins", module.id),
            found: "more than 65,536 vertices".into(),
            expected: "as many as a load module may have".into(),
            hint: "let the finer area end where load modules of the coarser one do".into(),
        };
        let (vertices, triangles) = ground.numbered().ok_or_else(too_many)?;
        let Some(decks) = module.decks.vertices.iter().map(of).collect::<Option<Vec<_>>>() else { return Ok(()) };
        let mut above = Pieces::default();
        for (triangle, class) in module.decks.triangles.iter().zip(&module.decks.classes) {
            let [outside, _] = self.parted(triangle.map(|v| decks[usize::from(v)]).to_vec());
            outside.iter().for_each(|piece| above.add(piece, *class));
        }
        let (deck_vertices, deck_triangles) = above.numbered().ok_or_else(too_many)?;
        module.decks = Decks { vertices: deck_vertices, triangles: deck_triangles, classes: above.classes };
        if let Some(plan) = self.plan_over(module.side, corner_m) {
            let prisms = std::mem::take(&mut module.objects.prisms);
            module.objects.prisms = prisms.into_iter().flat_map(|prism| beside(prism, &plan)).collect();
        }
        for canopy in &mut module.objects.canopies {
            let mut left = Pieces::default();
            for triangle in &canopy.triangles {
                let places = triangle.map(|v| canopy.places[usize::from(v)].map(i32::from));
                let Some(places) = places.map(|[x, y]| corner([x, y, 0])).into_iter().collect() else { continue };
                self.parted(places)[0].iter().for_each(|piece| left.add(piece, 0));
            }
            let (places, triangles) = left.numbered().ok_or_else(too_many)?;
            (canopy.places, canopy.triangles) = (places.iter().map(|place| [place.x, place.y]).collect(), triangles);
        }
        module.objects.canopies.retain(|canopy| !canopy.triangles.is_empty());
        (module.vertices, module.triangles, module.classes) = (vertices, triangles, ground.classes);
        Ok(())
    }

    fn holds(&self, place_m: [f64; 2]) -> bool {
        (0..2).all(|axis| self.low_m[axis] < place_m[axis] && place_m[axis] < self.high_m[axis])
    }
}

/// What of a prism lies beside a plan: as it was where they have nothing in common, else in pieces, which have no wall
/// along the cut: the other area goes on there.
fn beside(prism: Prism, plan: &Plan) -> Vec<Prism> {
    let (own, plan) = ([prism.plan()], std::slice::from_ref(plan));
    if common(&own, plan).is_empty() {
        return vec![prism];
    }
    let corner = |(a, b): ([i32; 2], [i32; 2])| {
        let middle = [0, 1].map(|axis| f64::midpoint(a[axis].into(), b[axis].into()));
        let [x, y] = a.map(|at| at.clamp(0, u16::MAX.into()) as u16);
        terrain::Corner { x, y, has_wall: prism.rings.iter().any(|ring| has_wall_at(ring, middle)) }
    };
    let edges =
        |ring: &Vec<[i32; 2]>| ring.iter().copied().zip(ring.iter().copied().cycle().skip(1)).collect::<Vec<_>>();
    let piece = |left: Plan| Prism {
        rings: left.iter().map(|ring| edges(ring).into_iter().map(corner).collect()).collect(),
        ..prism.clone()
    };
    difference(&own, plan).into_iter().map(piece).collect()
}

/// Whether a wall of a ring passes within two quanta of a place: rounding moves edges by one.
fn has_wall_at(ring: &[terrain::Corner], [x, y]: [f64; 2]) -> bool {
    let passes = |(a, b): (&terrain::Corner, &terrain::Corner)| {
        let [along_x, along_y] = [f64::from(b.x) - f64::from(a.x), f64::from(b.y) - f64::from(a.y)];
        let [to_x, to_y] = [x - f64::from(a.x), y - f64::from(a.y)];
        let share = nearest_share([along_x, along_y], [to_x, to_y]);
        let [off_x, off_y] = [to_x - share * along_x, to_y - share * along_y];
        a.has_wall && off_x * off_x + off_y * off_y <= 4.0
    };
    ring.iter().zip(ring.iter().cycle().skip(1)).any(passes)
}

/// What of a polygon lies on one side of a line; empty where it only touches that.
fn beyond(polygon: &[Corner], axis: usize, line_m: f64, towards: f64) -> Vec<Corner> {
    let depth = |corner: &Corner| {
        let metres = (corner.seen_m[axis] - line_m) * towards;
        if metres.abs() < NEAR_M { 0.0 } else { metres }
    };
    let mut part = Vec::with_capacity(polygon.len() + 1);
    for (a, b) in polygon.iter().zip(polygon.iter().cycle().skip(1)) {
        let (of_a, of_b) = (depth(a), depth(b));
        if 0.0 <= of_a {
            part.push(*a);
        }
        if of_a * of_b < 0.0 {
            part.push(crossing(a, b, axis, line_m));
        }
    }
    if part.iter().any(|corner| 0.0 < depth(corner)) { part } else { Vec::new() }
}

/// Where the edge between two corners crosses a line.
fn crossing(a: &Corner, b: &Corner, axis: usize, line_m: f64) -> Corner {
    let (a, b) = if a.at <= b.at { (a, b) } else { (b, a) };
    let share = (line_m - a.seen_m[axis]) / (b.seen_m[axis] - a.seen_m[axis]);
    let between = |a: f64, b: f64| a + share * (b - a);
    let mut seen_m = [0, 1].map(|axis| between(a.seen_m[axis], b.seen_m[axis]));
    seen_m[axis] = line_m;
    Corner { at: [0, 1, 2].map(|axis| between(a.at[axis], b.at[axis])), seen_m }
}

/// Triangles over vertices in quanta.
#[derive(Default)]
struct Pieces {
    vertices: Vec<[i32; 3]>,
    place_of: HashMap<[i32; 3], usize>,
    triangles: Vec<[usize; 3]>,
    classes: Vec<u8>,
}

impl Pieces {
    /// Adds a convex polygon; what rounding leaves without an area has no triangle.
    fn add(&mut self, polygon: &[Corner], class: u8) {
        let places: Vec<[i32; 3]> =
            polygon.iter().map(|corner| corner.at.map(|quanta| quanta.round() as i32)).collect();
        for last in 2..places.len() {
            let corners = [places[0], places[last - 1], places[last]];
            let [[ax, ay], [bx, by], [cx, cy]] = corners.map(|[x, y, _]| [x, y].map(i64::from));
            if (bx - ax) * (cy - ay) - (by - ay) * (cx - ax) <= 0 {
                continue;
            }
            self.triangles.push(corners.map(|place| {
                *self.place_of.entry(place).or_insert_with(|| {
                    self.vertices.push(place);
                    self.vertices.len() - 1
                })
            }));
            self.classes.push(class);
        }
    }

    /// The same as a load module has them; `None` where there are too many.
    fn numbered(&self) -> Option<(Vec<ModuleVertex>, Vec<[u16; 3]>)> {
        u16::try_from(self.vertices.len().saturating_sub(1)).ok()?;
        let vertex = |&[x, y, z]: &[i32; 3]| ModuleVertex { y: y as u16, x: x as u16, z };
        let triangles = self.triangles.iter().map(|corners| corners.map(|v| v as u16)).collect();
        Some((self.vertices.iter().map(vertex).collect(), triangles))
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;
    use crate::samples;

    /// Twice the area of the triangles of a load module that are ground, or holes, in quanta.
    fn doubled(module: &LoadModule, of_holes: bool) -> i64 {
        let triangles = module.triangles.iter().zip(&module.classes);
        let area = |triangle: &[u16; 3]| {
            let [[ax, ay], [bx, by], [cx, cy]] = triangle.map(|v| {
                let vertex = module.vertices[usize::from(v)];
                [i64::from(vertex.x), i64::from(vertex.y)]
            });
            let doubled = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax);
            assert!(0 < doubled, "{triangle:?} is not counter-clockwise");
            doubled
        };
        triangles.filter(|(_, class)| (**class == HOLE_CLASS) == of_holes).map(|(triangle, _)| area(triangle)).sum()
    }

    /// Edges that no other triangle has the other way round, but for those on the sides.
    fn open_edges(module: &LoadModule) -> usize {
        let edges: BTreeSet<[u16; 2]> =
            module.triangles.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]).collect();
        let on_side = |&&[a, b]: &&[u16; 2]| {
            let [a, b] = [a, b].map(|v| module.vertices[usize::from(v)]);
            [[a.x, b.x], [a.y, b.y]].iter().any(|&[a, b]| a == b && (a == 0 || a == module.side))
        };
        edges.iter().filter(|edge| !on_side(edge)).filter(|&&[a, b]| !edges.contains(&[b, a])).count()
    }

    /// The ground of the eastern load module, flat around a pit.
    fn height(module: &LoadModule, [x, y]: [f64; 2]) -> f64 {
        let at = [x, y];
        let under = terrain::Draped::of(module, [0, 0]).along([at, [x + 1e-3, y]]);
        under.first().map_or(f64::NAN, |place| place[2])
    }

    #[test]
    fn what_a_finer_area_covers_is_a_hole_and_all_else_stays_as_it_was() {
        let mut state = 7_u64;
        let mut draw = |below: u64| {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            ((state >> 33) % below) as f64
        };
        let own = Crs::named("EPSG:32611").unwrap();
        let mut open = 0;
        for (round, fine) in ["EPSG:32611", "EPSG:32612"].into_iter().cycle().take(200).enumerate() {
            let whole = samples::product();
            let fine = Crs::named(fine).unwrap();
            // Seen from the next zone, its sides lean by 3 degrees.
            let corner_m = [505_560.0 + draw(34_000) / 100.0, 3_875_000.0 + draw(40_000) / 100.0];
            let low_m = own.to(&fine, corner_m).unwrap();
            let high_m = [0, 1].map(|axis| low_m[axis] + 1.0 + draw(60_000) / 100.0);
            let cover = Cover { coarse: own.clone(), fine, low_m, high_m };
            let mut product = whole.clone();
            let covered = take_out(&mut product, &[cover]).unwrap();
            assert!(product.modules[0] == whole.modules[0], "round {round}: the western one is touched");
            assert_eq!((covered.left_out, covered.cut), (0, 1), "round {round}");
            let (before, after) = (&whole.modules[1], &product.modules[1]);
            let (ground, hole) = (doubled(after, false), doubled(after, true));
            let all = 2 * i64::from(before.side).pow(2);
            // Rounding moves corners by half a quantum, and slivers that it closes are left out.
            assert!((ground + hole - all).abs() < 400_000, "round {round}: {ground} {hole}");
            let inside = |axis: usize| (high_m[axis] - low_m[axis]) * 128.0;
            assert!(hole as f64 <= 2.0 * inside(0) * inside(1) + 400_000.0, "round {round}: {hole}");
            open += open_edges(after);
            for vertex in &after.vertices {
                let off = height(before, [vertex.x.into(), vertex.y.into()]) - f64::from(vertex.z);
                assert!(off.is_nan() || off.abs() < 2.0, "round {round}: {vertex:?} is {off} quanta off");
            }
        }
        // Where rounding closes a sliver, its three corners lie on one line.
        assert!(open <= 6, "{open} open edges in 200 rounds");
    }

    #[test]
    fn what_lies_wholly_under_a_finer_area_has_nothing_on_it() {
        let own = Crs::named("EPSG:32611").unwrap();
        let mut product = samples::with_objects();
        let (low_m, high_m) = ([505_500.0, 3_875_000.0], [506_000.0, 3_875_500.0]);
        let cover = || Cover { coarse: own.clone(), fine: own.clone(), low_m, high_m };
        let covered = take_out(&mut product, &[cover()]).unwrap();
        assert_eq!(covered, Covered { left_out: 1, cut: 0 });
        assert!(product.modules[0] == samples::with_objects().modules[0], "what only meets it is untouched");
        assert!(product.modules[1].classes.iter().all(|class| *class == HOLE_CLASS));
        assert!(product.modules[1].objects.is_empty());
        // From the middle of the western load module on: its wood is cut there, and its house is gone.
        let mut product = samples::with_objects();
        let half = Cover { low_m: [505_430.0, 3_874_000.0], ..cover() };
        assert_eq!(take_out(&mut product, &[half]).unwrap(), Covered { left_out: 1, cut: 1 });
        let objects = &product.modules[0].objects;
        assert_eq!(objects.prisms.iter().map(|prism| prism.id).collect::<Vec<_>>(), [3]);
        assert_eq!(objects.canopies[0].places.iter().map(|place| place[0]).max(), Some(430 * 128));
        // Through the yard of the house: what is left of it is open along the cut.
        let mut product = samples::with_objects();
        let through = Cover { low_m: [505_484.375, 3_874_000.0], ..cover() };
        assert_eq!(take_out(&mut product, &[through]).unwrap(), Covered { left_out: 1, cut: 1 });
        let prisms = &product.modules[0].objects.prisms;
        assert_eq!(prisms[0], samples::with_objects().modules[0].objects.prisms[0]);
        let of: Vec<_> = prisms[1].rings[0].iter().map(|at| (at.x / 1000, at.y / 1000, at.has_wall)).collect();
        let walls = [(60, 20, true), (62, 20, false), (62, 22, true), (61, 22, true), (61, 24, true)];
        assert_eq!(of, [&walls[..], &[(62, 24, false), (62, 26, true), (60, 26, true)]].concat());
        assert_eq!((prisms.len(), prisms[1].id, prisms[1].rings.len()), (2, 7, 1));
    }
}
