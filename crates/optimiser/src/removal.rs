//! Taking a vertex out: the best triangulation of the hole, the heights around it fitted again.

use crate::ears::fill_by_ears;
use crate::form::{Form, squares};
use crate::hold::Hold;
use crate::moments::Sums;
use crate::patch::Patch;
use crate::place::{Place, Shape, is_eased};
use crate::refit::Fit;
use crate::tile_mesh::{Star, TileMesh, next};

/// Corners of a hole, at most.
const CORNERS_MAX: usize = 13;

/// What finding a removal needs and leaves behind.
#[derive(Default)]
pub(crate) struct Removal {
    pub star: Star,
    pub patch: Patch,
    pub fit: Fit,
    hole: Hole,
    other_side: Vec<u32>,
}

impl Removal {
    /// What removing a vertex costs in squares once the heights around it are fitted again; its patch is then ready to
    /// be applied. `None` where it cannot go.
    #[inline(always)]
    pub fn find(&mut self, sheet: &TileMesh, vertex: u32) -> Option<f64> {
        let cost = self.find_as_it_is(sheet, vertex)?;
        let free = |&vertex: &u32| sheet.vertices[vertex as usize].hold.height_is_free();
        self.patch.refit.extend(self.star.ring.iter().copied().filter(free));
        Some(cost - self.fit.refit(sheet, &mut self.patch))
    }

    /// The same with all heights as they are.
    #[inline(always)]
    pub fn find_as_it_is(&mut self, sheet: &TileMesh, vertex: u32) -> Option<f64> {
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
            self.hole.fill(sheet, &ring[first..=second], &[], &mut self.patch)?
                + self.hole.fill(sheet, &self.other_side, &[], &mut self.patch)?
        } else {
            self.hole.fill(sheet, &self.star.ring, &self.star.edges, &mut self.patch)?
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

/// The best triangulation of a polygon, by dynamic programming over its chords.
struct Hole {
    at: [Place; CORNERS_MAX],
    height: [f64; CORNERS_MAX],
    /// Whether a corner is given; not asked where there are no features.
    is_given: [bool; CORNERS_MAX],
    has_features: bool,
    /// Sums west of the chord from corner i to corner j, for i < j.
    chords: [[Sums; CORNERS_MAX]; CORNERS_MAX],
    /// Least squares of the part between corners i and j, and the corner its last triangle reaches.
    best: [[f64; CORNERS_MAX]; CORNERS_MAX],
    split: [[u8; CORNERS_MAX]; CORNERS_MAX],
}

impl Default for Hole {
    fn default() -> Self {
        const N: usize = CORNERS_MAX;
        Self {
            at: [Place::default(); N],
            height: [0.0; N],
            is_given: [false; N],
            has_features: false,
            chords: [[Sums::default(); N]; N],
            best: [[0.0; N]; N],
            split: [[0; N]; N],
        }
    }
}

impl Hole {
    /// Appends the triangles that fill a counter-clockwise polygon with the fewest squares, and gives these; `None`
    /// where it has no valid triangulation or too many corners. Where the polygon is a star's ring, `spokes` are the
    /// star's edges, and what is summed along the ring is not summed again.
    #[inline(always)]
    fn fill(&mut self, sheet: &TileMesh, polygon: &[u32], spokes: &[u32], patch: &mut Patch) -> Option<f64> {
        let n = polygon.len();
        if n < 3 {
            return Some(0.0);
        }
        if CORNERS_MAX < n {
            return None;
        }
        for (i, &vertex) in polygon.iter().enumerate() {
            let vertex = &sheet.vertices[vertex as usize];
            (self.at[i], self.height[i], self.is_given[i]) = (vertex.at, vertex.height, vertex.hold.is_fixed());
        }
        self.has_features = sheet.has_features;
        for i in 0..n {
            for j in i + 1..n {
                self.chords[i][j] = if j == i + 1 && i < spokes.len() {
                    sheet.sums_of(next(spokes[i]))
                } else if i == 0 && j + 1 == n && spokes.len() == n {
                    -sheet.sums_of(next(spokes[j]))
                } else {
                    sheet.ground.moments.edge(self.at[i], self.at[j])
                };
            }
            if i + 1 < n {
                self.best[i][i + 1] = 0.0;
            }
        }
        for reach in 2..n {
            for i in 0..n - reach {
                self.find_split(i, i + reach);
            }
        }
        if self.best[0][n - 1] == f64::INFINITY {
            return None;
        }
        self.push_triangles(polygon, patch);
        Some(self.best[0][n - 1])
    }

    #[inline(always)]
    fn sums(&self, i: usize, k: usize, j: usize) -> Sums {
        self.chords[i][k] + self.chords[k][j] - self.chords[i][j]
    }

    #[inline(always)]
    fn find_split(&mut self, i: usize, j: usize) {
        let (mut best, mut split) = (f64::INFINITY, 0);
        for k in i + 1..j {
            let parts = self.best[i][k] + self.best[k][j];
            let corners = [self.at[i], self.at[k], self.at[j]];
            if best <= parts || !(Shape::Sound.admits(corners[0], corners[1], corners[2]) || self.is_eased(i, k, j)) {
                continue;
            }
            let heights = [self.height[i], self.height[k], self.height[j]];
            let sum = parts + squares(&self.sums(i, k, j), corners, heights);
            if sum < best {
                (best, split) = (sum, k as u8);
            }
        }
        self.best[i][j] = best;
        self.split[i][j] = split;
    }

    fn is_eased(&self, i: usize, k: usize, j: usize) -> bool {
        let corners = [i, k, j];
        self.has_features && is_eased(corners.map(|i| self.at[i]), corners.map(|i| self.is_given[i]))
    }

    fn push_triangles(&self, polygon: &[u32], patch: &mut Patch) {
        let mut open = [(0, 0); CORNERS_MAX];
        open[0] = (0, polygon.len() - 1);
        let mut count = 1;
        while 0 < count {
            count -= 1;
            let (i, j) = open[count];
            if i + 1 < j {
                let k = usize::from(self.split[i][j]);
                let form = Form::new(&self.sums(i, k, j), [self.at[i], self.at[k], self.at[j]]);
                patch.new.push(([polygon[i], polygon[k], polygon[j]], form));
                (open[count], open[count + 1]) = ((i, k), (k, j));
                count += 2;
            }
        }
    }
}
