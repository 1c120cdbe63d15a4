//! Several rasters as one ground: in order of priority, in any coordinate systems and spacings.
//!
//! Neighbouring files of one grid (DTED cells, HGT tiles, a GeoTIFF cut into pieces) are joined post by post first, so
//! ground between two of them is interpolated as inside one. Whatever is left is a layer of its own. Each post of the
//! working grid is decided by itself, so it does not depend on the window asked for.

use terrain::geometry::resample::{TAP_UNITS, rounded};
use terrain::{Dem, GridFrame, Post, PostRect, QUANTA_PER_METRE, Resampling};

use crate::chunk::Meaning;
use crate::crs::Crs;
use crate::geoid::Shifts;
use crate::join::{Standing, fits, join, overlaps};
use crate::longitudes::to_one_run;
use crate::samples::{Sample, each};
use crate::warp::{Place, Warp};
use crate::{DatumShift, DemFile, Raster, RasterFrame, Reach, SourceError};

/// What becomes of voids in a mosaic.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MosaicVoids {
    /// Whether the next source that has a height gives it.
    pub next_source: bool,
    /// Voids of a source at most this many of its posts from a height of it get one.
    pub fill_within: u32,
}

/// What a mosaic is made by.
#[derive(Clone, Copy, Debug)]
pub struct MosaicRules {
    /// How heights between posts come about.
    pub resampling: Resampling,
    /// Over how many metres from its edge a source fades into those below it; 0 for a plain seam.
    pub feather_m: f64,
    /// What becomes of voids.
    pub voids: MosaicVoids,
}

impl MosaicRules {
    /// Whether a raster becomes one with others: it continues their grid, and is not to fade into one of them.
    pub(crate) fn joins<'a>(&self, mut others: impl Iterator<Item = Meaning<'a>>, raster: Meaning) -> bool {
        let fades = |other: Meaning| 0.0 < self.feather_m && overlaps(other.0, raster.0);
        others.next().is_some_and(|first| fits(first, raster) && !fades(first)) && !others.any(fades)
    }
}

/// Files of one grid, as one raster.
#[derive(Debug)]
pub(crate) struct Layer {
    pub raster: Raster,
    /// One for each post of the raster's window; empty when all are heights.
    pub standings: Vec<Standing>,
    pub warp: Warp,
    pub posts_per_metre: [f64; 2],
}

/// Rasters in order of priority.
#[derive(Debug)]
pub struct Mosaic {
    pub(crate) layers: Vec<Layer>,
    pub(crate) rules: MosaicRules,
    /// System and grid of the area.
    pub(crate) place: (Crs, GridFrame),
    /// Height where no source reaches, when it cannot be that of the nearest edge of one.
    pub(crate) beyond: Option<Beyond>,
}

/// A height for ground that no source reaches, and how it comes to the datum that is wanted.
#[derive(Debug)]
pub(crate) struct Beyond {
    pub quanta: f64,
    pub shift: Option<DatumShift>,
}

/// Heights of a window and how each stands.
#[derive(Clone, Debug, PartialEq)]
pub struct Patch {
    /// The posts.
    pub rect: PostRect,
    /// Quanta of 1/128 m, row-major from the south. Where there is none, one that keeps the mesh defined.
    pub heights: Vec<i32>,
    /// Whether it is one.
    pub standings: Vec<Standing>,
}

/// Posts of a raster that are read around those under the area: cubic resampling reaches two beyond.
pub(crate) const MARGIN: i64 = 4;

/// The posts of a file that lie under `rect`; `None` when there are none.
pub fn window_reaching(frame: &RasterFrame, area: &Crs, grid: &GridFrame, rect: PostRect) -> Option<PostRect> {
    Warp::new(frame, area, grid).window(rect, MARGIN)
}

impl Mosaic {
    /// Of rasters in order of priority, each with the part that [`window_reaching`] names; `rect` is the area.
    ///
    /// # Errors
    /// When joined rasters are together too large.
    pub fn new(
        mut rasters: Vec<Raster>,
        rules: MosaicRules,
        area: &Crs,
        grid: &GridFrame,
        rect: PostRect,
    ) -> Result<Self, SourceError> {
        to_one_run(rasters.iter_mut().map(|raster| &mut raster.frame));
        let mut groups: Vec<Vec<Raster>> = Vec::new();
        for raster in rasters {
            match groups.last_mut() {
                Some(group) if rules.joins(group.iter().map(Raster::meaning), raster.meaning()) => group.push(raster),
                _ => groups.push(vec![raster]),
            }
        }
        let layers = groups.into_iter().map(|group| {
            let (mut raster, mut standings) = join(group)?;
            if !standings.is_empty() {
                for index in raster.fill_around(rules.voids.fill_within) {
                    if standings[index] == Standing::Void {
                        standings[index] = Standing::Filled;
                    }
                }
            }
            let warp = Warp::new(&raster.frame, area, grid);
            let posts_per_metre = warp.posts_per_metre(rect);
            Ok(Layer { raster, standings, warp, posts_per_metre })
        });
        let place = (area.clone(), *grid);
        Ok(Self { layers: layers.collect::<Result<_, SourceError>>()?, rules, place, beyond: None })
    }

    /// How many rasters are left once neighbours of one grid are joined.
    pub fn layer_count(&self) -> usize {
        self.layers.len()
    }

    /// Whether it is one raster, whose posts can be told: rasters of several grids have none in common, and heights
    /// that come from another datum are shifted at the posts of the working grid.
    pub fn has_own_posts(&self) -> bool {
        matches!(self.layers.as_slice(), [layer] if layer.raster.shift.is_none())
    }

    /// Calls `each` with the height in metres at every post of its one raster in and around a rectangle of the working
    /// grid, and with metres east and north in the area's system. Voids are left out.
    pub fn each_own_post(&self, rect: PostRect, each: &mut dyn FnMut([f64; 2], f64)) {
        let [layer] = self.layers.as_slice() else { return };
        let (frame, own) = (&layer.raster.frame, layer.raster.window);
        let Some(window) = layer.warp.window(rect, 1).and_then(|window| window.intersection(&own)) else { return };
        let mut heights = Vec::with_capacity(window.posts_wide());
        for row in window.south..=window.north {
            heights.clear();
            layer.raster.push_row_m(row, window.west..window.east + 1, &mut heights);
            for (col, &height_m) in (window.west..).zip(&heights) {
                let is_height = layer
                    .standings
                    .get(own.index(Post::new(row, col)))
                    .is_none_or(|&standing| standing == Standing::Height);
                let place =
                    [(0, col), (1, row)].map(|(axis, at)| frame.south_west[axis] + f64::from(at) * frame.spacing[axis]);
                if let Some(place) = frame.crs.to(&self.place.0, place).filter(|_| is_height && height_m.is_finite()) {
                    each(place, height_m);
                }
            }
        }
    }

    /// Heights at the posts `rect` of the working grid.
    pub fn resample(&self, rect: PostRect) -> Patch {
        let (heights, standings) = (vec![0; rect.post_count()], vec![Standing::Gap; rect.post_count()]);
        let mut patch = Patch { rect, heights, standings };
        let wide = rect.posts_wide();
        let places: Vec<_> = self.layers.iter().map(|layer| layer.warp.over(rect)).collect();
        let (area, grid) = &self.place;
        let shifts: Vec<Option<Shifts>> = self
            .layers
            .iter()
            .map(|layer| layer.raster.shift.as_ref().map(|shift| shift.over(area, grid, rect)))
            .collect();
        let shift_beyond = self.beyond.as_ref().and_then(|beyond| beyond.shift.as_ref());
        let shift_beyond = shift_beyond.map(|shift| shift.over(area, grid, rect));
        let mut line = vec![(0.0, Standing::Gap); wide];
        let mut best = vec![Best::default(); wide];
        for (index, row) in (rect.south..=rect.north).enumerate() {
            best.fill(Best::default());
            for ((layer, places), shifts) in self.layers.iter().zip(&places).zip(&shifts) {
                if best.iter().all(|best| best.is_settled(self.rules.voids.next_source)) {
                    break;
                }
                layer.sample_line(|col| places.at(row, rect.west + col as i32), self.rules.resampling, &mut line);
                if let Some(shifts) = shifts {
                    line.iter_mut().zip(rect.west..).for_each(|(at, col)| at.0 += shifts.quanta_at(row, col));
                }
                for (col, (best, &(quanta, standing))) in best.iter_mut().zip(&line).enumerate() {
                    if standing == Standing::Gap || best.is_settled(self.rules.voids.next_source) {
                        continue;
                    }
                    let place = || places.at(row, rect.west + col as i32);
                    let share =
                        if 0.0 < self.rules.feather_m { layer.share(place(), self.rules.feather_m) } else { 1.0 };
                    best.add(quanta, standing, share);
                }
            }
            for (col, best) in best.iter().enumerate() {
                let at = index * wide + col;
                (patch.heights[at], patch.standings[at]) = match best.result() {
                    Some((quanta, standing)) => (rounded(quanta), standing),
                    None => {
                        let post = Post::new(row, rect.west + col as i32);
                        (self.beyond(post, &shifts, shift_beyond.as_ref()), Standing::Gap)
                    }
                };
            }
        }
        patch
    }

    /// A height where no source reaches: that of the nearest edge of one, so that the mesh is defined.
    fn beyond(&self, post: Post, shifts: &[Option<Shifts>], shift_beyond: Option<&Shifts>) -> i32 {
        let added = |shifts: Option<&Shifts>| shifts.map_or(0.0, |shifts| shifts.quanta_at(post.row, post.col));
        if let Some(beyond) = &self.beyond {
            return rounded(beyond.quanta + added(shift_beyond));
        }
        let rect = PostRect { south: post.row, west: post.col, north: post.row, east: post.col };
        let clamped = self.layers.iter().zip(shifts).filter_map(|(layer, shifts)| {
            let place = layer.warp.over(rect).at(post.row, post.col)?;
            Some((layer, shifts, layer.clamped(place)))
        });
        let nearest = clamped.min_by_key(|&(_, _, (_, distance))| distance);
        nearest.map_or(0, |(layer, shifts, (index, _))| {
            rounded(layer.quanta(layer.raster.samples.get(index)) + added(shifts.as_ref()))
        })
    }
}

/// What the layers from the first on say about a post.
#[derive(Clone, Copy, Debug)]
struct Best {
    /// Heights that fade into the next, and the share that is left to it.
    height: f64,
    rest: f64,
    seen: bool,
    filled: Option<f64>,
    void: Option<f64>,
}

impl Default for Best {
    fn default() -> Self {
        Self { height: 0.0, rest: 1.0, seen: false, filled: None, void: None }
    }
}

impl Best {
    fn is_settled(&self, next_source: bool) -> bool {
        (self.seen && self.rest <= 0.0)
            || (!next_source && !self.seen && (self.filled.is_some() || self.void.is_some()))
    }

    fn add(&mut self, quanta: f64, standing: Standing, share: f64) {
        match standing {
            Standing::Height => {
                self.height += self.rest * share * quanta;
                self.rest *= 1.0 - share;
                self.seen = true;
            }
            Standing::Filled => self.filled = self.filled.or(Some(quanta)),
            Standing::Void => self.void = self.void.or(Some(quanta)),
            Standing::Gap => {}
        }
    }

    fn result(&self) -> Option<(f64, Standing)> {
        if self.seen && self.rest < 1.0 {
            // Nothing below to fade into: the shares there are make up the whole.
            let whole = if self.rest <= 0.0 { self.height } else { self.height / (1.0 - self.rest) };
            return Some((whole, Standing::Height));
        }
        let filled = self.filled.map(|quanta| (quanta, Standing::Filled));
        filled.or(self.void.map(|quanta| (quanta, Standing::Void)))
    }
}

impl Patch {
    /// The window; a post that has no height of its own is void.
    pub fn dem(&self) -> Dem {
        if self.standings.iter().all(|&standing| standing <= Standing::Filled) {
            return Dem::from_rows(self.rect, &self.heights);
        }
        let index = |post: Post| self.rect.index(post);
        let known = |post| self.standings[index(post)] <= Standing::Filled;
        let mut dem = Dem::from_fn(self.rect, |post| known(post).then(|| self.heights[index(post)]));
        dem.fill_voids(|post| self.heights[index(post)]);
        dem
    }
}

impl Layer {
    fn quanta(&self, sample: f64) -> f64 {
        self.raster.scale.height_m(sample) * f64::from(QUANTA_PER_METRE)
    }

    /// Which part of a height here is this layer's: less than all of it near the raster's edge.
    fn share(&self, place: Place, feather_m: f64) -> f64 {
        let Some(place) = place else { return 0.0 };
        let frame = &self.raster.frame;
        let inside_m = [(0, frame.cols), (1, frame.rows)].map(|(axis, count)| {
            let last = i64::from(count - 1) * i64::from(TAP_UNITS);
            let units = place[axis].min(last - place[axis]).max(0);
            units as f64 / (f64::from(TAP_UNITS) * self.posts_per_metre[axis])
        });
        // Never quite nothing, so that the outermost post of the last layer still counts.
        (inside_m[0].min(inside_m[1]) / feather_m).clamp(1.0e-6, 1.0)
    }

    /// The post of the window nearest to a place, and how far out the place is.
    fn clamped(&self, place: [i64; 2]) -> (usize, i64) {
        let window = self.raster.window;
        let unit = i64::from(TAP_UNITS);
        let near = |units: i64, low: i32, high: i32| {
            let post = ((units + unit / 2).div_euclid(unit)).clamp(i64::from(low), i64::from(high));
            (post, (units - post * unit).abs())
        };
        let (col, across) = near(place[0], window.west, window.east);
        let (row, along) = near(place[1], window.south, window.north);
        let index = (row - i64::from(window.south)) as usize * window.posts_wide();
        (index + (col - i64::from(window.west)) as usize, across.saturating_add(along))
    }

    /// Height in quanta and standing at each place.
    fn sample_line(&self, place: impl Fn(usize) -> Place, how: Resampling, line: &mut [(f64, Standing)]) {
        let wide = self.raster.window.posts_wide();
        each!(&self.raster.samples, posts => {
            let view = View { posts, standings: &self.standings, wide };
            for (col, at) in line.iter_mut().enumerate() {
                let corner = place(col).and_then(|place| self.corner(place));
                *at = match corner {
                    None => (0.0, Standing::Gap),
                    Some(corner) => {
                        let (sample, standing) = match how {
                            Resampling::Cubic => view.cubic(corner, self.raster.window.posts_high()),
                            Resampling::Bilinear => view.bilinear(corner),
                        };
                        (self.quanta(sample), standing)
                    }
                };
            }
        });
    }

    fn corner(&self, place: [i64; 2]) -> Option<Corner> {
        Corner::around(place, &self.raster.frame, self.raster.window)
    }
}

/// Four posts and the weights of the northern and eastern ones, in 1/65536.
#[derive(Clone, Copy)]
pub(crate) struct Corner {
    row: usize,
    col: usize,
    up: f64,
    right: f64,
}

impl Corner {
    /// The south-western of the posts around a place, by row and column in a window, and the weights beyond it.
    pub(crate) fn around(place: [i64; 2], frame: &RasterFrame, window: PostRect) -> Option<Self> {
        /// How far outside a place may lie and still count as the outermost post: what rounding loses.
        const OUTSIDE_UNITS_MAX: i64 = TAP_UNITS as i64 / 1000 + 16;
        let split = |units: i64, low: i32, high: i32, count: u32| {
            let last = i64::from(count - 1) * i64::from(TAP_UNITS);
            let inside = -OUTSIDE_UNITS_MAX <= units && units <= last + OUTSIDE_UNITS_MAX;
            let units = units.clamp(0, last);
            let (near, weight) = (units / i64::from(TAP_UNITS), units % i64::from(TAP_UNITS));
            let far = near + i64::from(0 < weight);
            (inside && i64::from(low) <= near && far <= i64::from(high))
                .then(|| ((near - i64::from(low)) as usize, weight as f64))
        };
        let (col, right) = split(place[0], window.west, window.east, frame.cols)?;
        let (row, up) = split(place[1], window.south, window.north, frame.rows)?;
        Some(Self { row, col, up, right })
    }

    /// The posts that a height there is made from, counted from the window's south-west one.
    pub(crate) fn posts(self) -> PostRect {
        let (south, west) = (self.row as i32, self.col as i32);
        PostRect { south, west, north: south + i32::from(0.0 < self.up), east: west + i32::from(0.0 < self.right) }
    }

    /// The sample there of a raster whose window it is in, whatever is void.
    pub(crate) fn bilinear(self, raster: &Raster) -> f64 {
        let wide = raster.window.posts_wide();
        each!(&raster.samples, posts => View { posts, standings: &[], wide }.bilinear(self).0)
    }
}

/// Samples of one type and how they stand.
struct View<'a, T> {
    posts: &'a [T],
    standings: &'a [Standing],
    wide: usize,
}

impl<T: Sample> View<'_, T> {
    fn standing(&self, index: usize) -> Standing {
        if self.standings.is_empty() { Standing::Height } else { self.standings[index] }
    }

    fn bilinear(&self, Corner { row, col, up, right }: Corner) -> (f64, Standing) {
        let a = row * self.wide + col;
        let (east, north) = (usize::from(0.0 < right), self.wide * usize::from(0.0 < up));
        let corners = [a, a + east, a + north, a + north + east];
        let standing = corners.iter().map(|&index| self.standing(index)).fold(Standing::Height, Standing::max);
        let [a, b, c, d]: [f64; 4] = corners.map(|index| self.posts[index].into());
        let unit = f64::from(TAP_UNITS);
        let near = a * (unit - right) + b * right;
        let far = c * (unit - right) + d * right;
        ((near * (unit - up) + far * up) / (unit * unit), standing)
    }

    /// Bilinear where one of the sixteen posts is missing. Never higher or lower than all of them: beside a cliff the
    /// smooth surface alone swings out to heights that are nowhere.
    fn cubic(&self, corner: Corner, high: usize) -> (f64, Standing) {
        let Corner { row, col, up, right } = corner;
        let inside = 1 <= row && row + 2 < high && 1 <= col && col + 2 < self.wide;
        let first = |r: usize| (row + r - 1) * self.wide + col - 1;
        let whole = || (0..4).all(|r| (first(r)..first(r) + 4).all(|index| self.standing(index) == Standing::Height));
        if !inside || !whole() {
            return self.bilinear(corner);
        }
        let (across, along) = (keys_weights(right), keys_weights(up));
        let (mut sum, mut lowest, mut highest) = (0.0, f64::INFINITY, f64::NEG_INFINITY);
        for (r, weight_along) in along.iter().enumerate() {
            let mut line = 0.0;
            for (c, weight) in across.iter().enumerate() {
                let sample: f64 = self.posts[first(r) + c].into();
                line += weight * sample;
                (lowest, highest) = (lowest.min(sample), highest.max(sample));
            }
            sum += weight_along * line;
        }
        (sum.clamp(lowest, highest), Standing::Height)
    }
}

/// Weights of four posts in a line, a place `units` of 1/65536 beyond the second: Keys' cubic convolution.
fn keys_weights(units: f64) -> [f64; 4] {
    let t = units / f64::from(TAP_UNITS);
    [
        ((2.0 - t) * t - 1.0) * t / 2.0,
        ((3.0 * t - 5.0) * t * t + 2.0) / 2.0,
        ((4.0 - 3.0 * t) * t + 1.0) * t / 2.0,
        (t - 1.0) * t * t / 2.0,
    ]
}

impl DemFile {
    /// The posts that lie under the posts `rect` of a grid in the system `area`; `None` when there are none.
    pub fn window_reaching(&self, area: &Crs, grid: &GridFrame, rect: PostRect) -> Option<PostRect> {
        window_reaching(self.frame(), area, grid, rect)
    }

    /// Its posts that the posts of `rect` lie among: those that interpolation between neighbours takes.
    pub fn reach(&self, area: &Crs, grid: &GridFrame, rect: PostRect) -> Reach {
        Warp::new(self.frame(), area, grid).reach(rect)
    }
}
