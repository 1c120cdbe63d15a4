//! Taking a vertex out: the best triangulation of the hole, the heights around it fitted again.
//!
//! Where a limit leaves no choice but that a vertex goes, its hole is filled whatever its shape.

use fearless_simd::{Level, Simd, dispatch};
use terrain::geometry::widest_level;

use crate::optimiser::form::Form;
use crate::optimiser::hold::Hold;
use crate::optimiser::hole::Hole;
use crate::optimiser::patch::Patch;
use crate::optimiser::place::Place;
use crate::optimiser::refit::Fit;
use crate::optimiser::tile_mesh::{Star, TileMesh};

/// What finding a removal needs and leaves behind.
pub(crate) struct Removal {
    level: Level,
    pub star: Star,
    pub patch: Patch,
    pub fit: Fit,
    /// The holes that the last vertex would leave, two where it lies on a line, and what surrounds them.
    holes: [Hole; 2],
    outlines: [Vec<u32>; 2],
}

impl Default for Removal {
    fn default() -> Self {
        Self::at(widest_level())
    }
}

impl Removal {
    /// With lanes of some width; results do not depend on it.
    pub fn at(level: Level) -> Self {
        Self {
            level,
            star: Star::default(),
            patch: Patch::default(),
            fit: Fit::default(),
            holes: Default::default(),
            outlines: Default::default(),
        }
    }

    /// What removing a vertex costs in squares once the heights around it are fitted again; its patch is then ready to
    /// be applied. `None` where it cannot go.
    pub fn find(&mut self, sheet: &TileMesh, vertex: u32) -> Option<f64> {
        let cost = self.cost(sheet, vertex)?;
        self.make_ready();
        let free = |&vertex: &u32| sheet.vertices[vertex as usize].hold.height_is_free();
        self.patch.refit.extend(self.star.ring.iter().copied().filter(free));
        Some(cost - self.fit.refit(sheet, &mut self.patch))
    }

    /// What removing a vertex costs in squares with all heights as they are; [`Removal::make_ready`] makes its patch.
    pub fn cost(&mut self, sheet: &TileMesh, vertex: u32) -> Option<f64> {
        dispatch!(self.level, simd => self.cost_in(simd, sheet, vertex))
    }

    #[inline(always)]
    fn cost_in<S: Simd>(&mut self, simd: S, sheet: &TileMesh, vertex: u32) -> Option<f64> {
        let record = &sheet.vertices[vertex as usize];
        if !sheet.is_vertex(vertex) || record.hold.is_fixed() {
            return None;
        }
        sheet.star(vertex, &mut self.star);
        self.outlines.iter_mut().for_each(Vec::clear);
        let old: f64 = self.star.triangles().map(|triangle| sheet.triangles[triangle as usize].squares).sum();
        let ring = &self.star.ring;
        let spokes: &[u32] = if record.hold.is_on_line() && self.star.is_closed() {
            let (first, second) = self.ends_of_line(sheet, record.hold, record.at)?;
            self.outlines[0].extend_from_slice(&ring[first..=second]);
            self.outlines[1].extend_from_slice(&ring[second..]);
            self.outlines[1].extend_from_slice(&ring[..=first]);
            &[]
        } else {
            self.outlines[0].extend_from_slice(ring);
            &self.star.edges
        };
        let mut new = 0.0;
        for (hole, outline) in self.holes.iter_mut().zip(&self.outlines) {
            new += hole.fill(simd, sheet, outline, spokes)?;
        }
        Some(new - old)
    }

    /// Makes the patch that takes out the vertex whose cost was asked last.
    pub fn make_ready(&mut self) {
        self.patch.clear();
        self.patch.old.extend(self.star.triangles());
        for (hole, outline) in self.holes.iter().zip(&self.outlines) {
            hole.push_triangles(outline, &mut self.patch);
        }
    }

    /// Removing a vertex whatever the shapes of the triangles that fill its hole; its patch is then ready to be
    /// applied. `false` where it is given.
    pub fn find_by_force(&mut self, sheet: &TileMesh, vertex: u32) -> bool {
        let record = &sheet.vertices[vertex as usize];
        if !sheet.is_vertex(vertex) || record.hold.is_fixed() {
            return false;
        }
        sheet.star(vertex, &mut self.star);
        self.patch.clear();
        self.patch.old.extend(self.star.triangles());
        let ring = &self.star.ring;
        if !record.hold.is_on_line() || !self.star.is_closed() {
            return fill_by_ears(sheet, ring, &mut self.patch);
        }
        let Some((first, second)) = self.ends_of_line(sheet, record.hold, record.at) else { return false };
        let beyond = [&ring[second..], &ring[..=first]].concat();
        fill_by_ears(sheet, &ring[first..=second], &mut self.patch) && fill_by_ears(sheet, &beyond, &mut self.patch)
    }

    /// Where in the ring the line runs on through a vertex on it.
    fn ends_of_line(&self, sheet: &TileMesh, hold: Hold, at: Place) -> Option<(usize, usize)> {
        let is_next = |&vertex: &u32| {
            let other = &sheet.vertices[vertex as usize];
            (hold.has(Hold::COLUMN) && other.hold.has(Hold::COLUMN) && other.at.x == at.x)
                || (hold.has(Hold::ROW) && other.hold.has(Hold::ROW) && other.at.y == at.y)
        };
        let first = self.star.ring.iter().position(is_next)?;
        let second = first + 1 + self.star.ring[first + 1..].iter().position(is_next)?;
        Some((first, second))
    }
}

/// Appends triangles that fill a simple counter-clockwise polygon, the best formed first; `false` where the polygon is
/// not simple. Every simple polygon has two ears, so one is always found.
fn fill_by_ears(sheet: &TileMesh, polygon: &[u32], patch: &mut Patch) -> bool {
    let mut left = polygon.to_vec();
    while 3 <= left.len() {
        let ears = (0..left.len()).filter_map(|i| Some((form_of_ear(sheet, &left, i)?, i)));
        let Some((_, ear)) = ears.max_by(|a, b| a.0.total_cmp(&b.0).then(b.1.cmp(&a.1))) else { return false };
        let corners = corners_of(&left, ear);
        let places = sheet.places(corners);
        let edge = |i: usize| sheet.ground.moments.edge(places[i], places[(i + 1) % 3]);
        patch.new.push((corners, Form::new(&(edge(0) + edge(1) + edge(2)), places)));
        left.remove(ear);
    }
    true
}

fn corners_of(polygon: &[u32], i: usize) -> [u32; 3] {
    let n = polygon.len();
    [polygon[(i + n - 1) % n], polygon[i], polygon[(i + 1) % n]]
}

/// Area by the square of the longest side, where corner `i` with its neighbours is a triangle that holds no other
/// corner.
fn form_of_ear(sheet: &TileMesh, polygon: &[u32], i: usize) -> Option<f64> {
    let corners = corners_of(polygon, i);
    let [a, b, c] = sheet.places(corners);
    let area = Place::orient(a, b, c);
    let holds =
        |at: Place| 0 <= Place::orient(a, b, at) && 0 <= Place::orient(b, c, at) && 0 <= Place::orient(c, a, at);
    let is_free = || polygon.iter().filter(|v| !corners.contains(v)).all(|&v| !holds(sheet.at(v)));
    let longest = a.squared_distance(b).max(b.squared_distance(c)).max(c.squared_distance(a));
    (0 < area && is_free()).then_some(area as f64 / longest as f64)
}
