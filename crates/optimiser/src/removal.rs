//! Taking a vertex out: the best triangulation of the hole, the heights around it fitted again.

use fearless_simd::{Level, Simd, dispatch};
use geometry::widest_level;

use crate::ears::fill_by_ears;
use crate::hold::Hold;
use crate::hole::Hole;
use crate::patch::Patch;
use crate::place::Place;
use crate::refit::Fit;
use crate::tile_mesh::{Star, TileMesh};

/// What finding a removal needs and leaves behind.
pub(crate) struct Removal {
    level: Level,
    pub star: Star,
    pub patch: Patch,
    pub fit: Fit,
    hole: Hole,
    other_side: Vec<u32>,
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
            hole: Hole::default(),
            other_side: Vec::new(),
        }
    }

    /// What removing a vertex costs in squares once the heights around it are fitted again; its patch is then ready to
    /// be applied. `None` where it cannot go.
    pub fn find(&mut self, sheet: &TileMesh, vertex: u32) -> Option<f64> {
        let cost = self.find_as_it_is(sheet, vertex)?;
        let free = |&vertex: &u32| sheet.vertices[vertex as usize].hold.height_is_free();
        self.patch.refit.extend(self.star.ring.iter().copied().filter(free));
        Some(cost - self.fit.refit(sheet, &mut self.patch))
    }

    /// The same with all heights as they are.
    pub fn find_as_it_is(&mut self, sheet: &TileMesh, vertex: u32) -> Option<f64> {
        dispatch!(self.level, simd => self.find_in(simd, sheet, vertex))
    }

    #[inline(always)]
    fn find_in<S: Simd>(&mut self, simd: S, sheet: &TileMesh, vertex: u32) -> Option<f64> {
        let record = &sheet.vertices[vertex as usize];
        if !sheet.is_vertex(vertex) || record.hold.is_fixed() {
            return None;
        }
        sheet.star(vertex, &mut self.star);
        self.patch.clear();
        self.patch.old.extend(self.star.triangles());
        let old: f64 = self.star.triangles().map(|triangle| sheet.triangles[triangle as usize].squares).sum();
        let new = if record.hold.is_on_line() && self.star.is_closed() {
            let (first, second) = self.ends_of_line(sheet, record.hold, record.at)?;
            let ring = &self.star.ring;
            self.other_side.clear();
            self.other_side.extend_from_slice(&ring[second..]);
            self.other_side.extend_from_slice(&ring[..=first]);
            self.hole.fill(simd, sheet, &ring[first..=second], &[], &mut self.patch)?
                + self.hole.fill(simd, sheet, &self.other_side, &[], &mut self.patch)?
        } else {
            self.hole.fill(simd, sheet, &self.star.ring, &self.star.edges, &mut self.patch)?
        };
        Some(new - old)
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
        self.other_side.clear();
        self.other_side.extend_from_slice(&ring[second..]);
        self.other_side.extend_from_slice(&ring[..=first]);
        fill_by_ears(sheet, &ring[first..=second], &mut self.patch)
            && fill_by_ears(sheet, &self.other_side, &mut self.patch)
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
