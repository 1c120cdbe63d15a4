//! The residual that a budget will leave, before any build: from some windows spread over the area.
//!
//! Each window is resampled as a build would, and surveyed; their budget is shared out by one threshold of gain, as
//! that of tiles is, and each is refined and optimised with its share. Module lines, which are edges in a build, are
//! not: what they cost is in [`MODULE_LINES`], measured.

use std::sync::atomic::AtomicBool;

use crate::CompileError;
use source_files::{Crs, DemFile, MosaicRules, MosaicVoids, RasterFrame, WideMosaic, Windows};
use terrain::{Dem, GridFrame, Post, PostRect, Resampling};

use crate::workbench::mesh::untiled_together;

/// Windows in a row and in a column, at most: a hill in a plain is not to be missed.
const WINDOWS_A_SIDE: usize = 12;
/// Load modules along a side of a window, at most.
const MODULES_A_SIDE: usize = 2;
/// Posts of all windows, about: a second of one core or two.
const POSTS_MAX: usize = 3_000_000;
/// Bytes of decoded strips and tiles that are kept.
const CACHE_BYTES: u64 = 64 << 20;
/// How much larger the RMS residual of a build is than that of windows without module lines.
const MODULE_LINES: f64 = 1.03;

/// The RMS residual that a build is expected to leave, in metres.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Left {
    /// Against the working grid: more triangles leave less.
    pub fit_m: f64,
    /// Of the working grid against the posts of the one raster, which a finer grid lessens.
    pub resampled_m: f64,
}

/// An area that is looked at.
pub(crate) struct Sampled<'a> {
    pub crs: &'a Crs,
    pub grid: GridFrame,
    pub rect: PostRect,
    /// Cells along a side of a load module.
    pub side_cells: usize,
    /// Triangles of a load module, on average over the area.
    pub triangles: usize,
}

impl Sampled<'_> {
    /// What a build of the area is expected to leave; `None` where no window has heights. `open` opens the raster at a
    /// place of `frames`, whose lowest heights are in `lowest_m`.
    ///
    /// # Errors
    /// When a file cannot be opened or decoded.
    pub fn left(
        &self,
        frames: &[RasterFrame],
        lowest_m: &[f64],
        open: impl Fn(usize) -> Result<DemFile, CompileError>,
    ) -> Result<Option<Left>, CompileError> {
        let windows = self.windows();
        let (mut files, mut used) = (Vec::new(), Vec::new());
        for index in self.reaching(frames, &windows) {
            used.push((files.len(), lowest_m[index]));
            files.push(open(index)?);
        }
        let voids = MosaicVoids { next_source: true, fill_within: 0 };
        let rules = MosaicRules { resampling: Resampling::Bilinear, feather_m: 0.0, voids };
        let place = (self.crs, &self.grid, self.rect);
        let mosaic = WideMosaic::new(Windows::new(files, CACHE_BYTES), &used, rules, place)?;
        let mut grounds: Vec<Dem> = Vec::new();
        let mut resampled = Squares::default();
        for &window in &windows {
            let dem = mosaic.resample(window)?.dem();
            // What is void weighs nothing, and a window of little else says little of the ground.
            if 2 * dem.void_count() < window.post_count() {
                // A build of one raster is measured at its own posts, between which the working grid may have its own.
                mosaic
                    .each_own_post(window, &mut |place, height_m| resampled.add(&self.grid, &dem, place, height_m))?;
                grounds.push(dem);
            }
        }
        if grounds.is_empty() {
            return Ok(None);
        }
        let modules: usize = grounds.iter().map(|dem| dem.rect().cells_wide() * dem.rect().cells_high()).sum();
        let triangles = modules / (self.side_cells * self.side_cells) * self.triangles;
        let spacing_m = self.grid.spacing.metres();
        let residual = untiled_together(&grounds, triangles, spacing_m, &AtomicBool::new(false))?;
        let mean_m2 = |posts: u64, squared: u128| {
            squared as f64 / posts as f64 / f64::from(terrain::QUANTA_PER_METRE * terrain::QUANTA_PER_METRE)
        };
        let residual = residual.filter(|tally| 0 < tally.posts);
        Ok(residual.map(|tally| Left {
            fit_m: MODULE_LINES * mean_m2(tally.posts, tally.sum_squared).sqrt(),
            resampled_m: resampled.mean().sqrt(),
        }))
    }

    /// Places of the rasters that hold a corner, the middle of a side or the middle of a window.
    fn reaching(&self, frames: &[RasterFrame], windows: &[PostRect]) -> Vec<usize> {
        let halves = |low: i32, high: i32| [low, low + (high - low) / 2, high];
        let place = |row: i32, col: i32| [self.grid.east_m(col), self.grid.north_m(row)];
        let of_window = |window: &PostRect| {
            let rows = halves(window.south, window.north);
            let cols = halves(window.west, window.east);
            rows.map(|row| cols.map(|col| place(row, col)))
        };
        let places: Vec<[f64; 2]> = windows.iter().flat_map(of_window).flatten().collect();
        // Projected once for each system: there may be many thousands of rasters, of few.
        let mut systems: Vec<(&Crs, Vec<[f64; 2]>)> = Vec::new();
        let mut found = Vec::new();
        for (index, frame) in frames.iter().enumerate() {
            let known = systems.iter().position(|(crs, _)| **crs == frame.crs).unwrap_or_else(|| {
                let projected = places.iter().filter_map(|&place| self.crs.to(&frame.crs, place)).collect();
                systems.push((&frame.crs, projected));
                systems.len() - 1
            });
            if systems[known].1.iter().any(|&place| holds(frame, place)) {
                found.push(index);
            }
        }
        found
    }

    /// Windows of whole load modules, spread evenly.
    fn windows(&self) -> Vec<PostRect> {
        let side = self.side_cells;
        let [cols, rows] = [self.rect.cells_wide() / side, self.rect.cells_high() / side];
        let posts = |modules: usize| (modules * side + 1).pow(2);
        let fits = |&modules: &usize| {
            let all = WINDOWS_A_SIDE * WINDOWS_A_SIDE * posts(modules);
            all <= POSTS_MAX && modules <= cols && modules <= rows
        };
        let modules = (1..=MODULES_A_SIDE).rev().find(fits).unwrap_or(1);
        let most = (POSTS_MAX / posts(modules)).isqrt().clamp(1, WINDOWS_A_SIDE);
        let firsts = |along: usize| {
            let count = (along / modules).clamp(1, most);
            (0..count).map(move |index| ((2 * index + 1) * along / count).saturating_sub(modules) / 2)
        };
        let window = |row: usize, col: usize| PostRect {
            south: self.rect.south + (row * side) as i32,
            west: self.rect.west + (col * side) as i32,
            north: self.rect.south + ((row + modules) * side) as i32,
            east: self.rect.west + ((col + modules) * side) as i32,
        };
        firsts(rows)
            .flat_map(|row| firsts(cols).map(move |col| (row, col)))
            .map(|(row, col)| window(row, col))
            .collect()
    }
}

/// How far the working grid lies off the posts of a raster between its own.
#[derive(Default)]
struct Squares {
    posts: u64,
    metres_squared: f64,
}

impl Squares {
    /// Adds a post at a place in the area's system.
    fn add(&mut self, grid: &GridFrame, dem: &Dem, [east, north]: [f64; 2], height_m: f64) {
        let spacing_m = grid.spacing.metres();
        let (x, y) = ((east - grid.origin_east_m) / spacing_m, (north - grid.origin_north_m) / spacing_m);
        let (row, col) = (y.floor() as i32, x.floor() as i32);
        let corners = [(0, 0), (0, 1), (1, 0), (1, 1)].map(|(up, right)| Post::new(row + up, col + right));
        if !corners.iter().all(|post| dem.rect().contains(*post) && !dem.is_void(*post)) {
            return;
        }
        let [a, b, c, d] = corners.map(|post| terrain::metres_of_quanta(dem.height(post)));
        let (right, up) = (x - x.floor(), y - y.floor());
        let between = (a * (1.0 - right) + b * right) * (1.0 - up) + (c * (1.0 - right) + d * right) * up;
        self.posts += 1;
        self.metres_squared += (between - height_m).powi(2);
    }

    fn mean(&self) -> f64 {
        if self.posts == 0 { 0.0 } else { self.metres_squared / self.posts as f64 }
    }
}

/// Whether a place in a raster's own system lies in it, or less than a post outside.
fn holds(frame: &RasterFrame, place: [f64; 2]) -> bool {
    let ([east, north], [west, south]) = (frame.nearest(place), frame.south_west);
    let inside = |posts: f64, count: u32| -1.0 < posts && posts < f64::from(count);
    inside((east - west) / frame.spacing[0], frame.cols) && inside((north - south) / frame.spacing[1], frame.rows)
}

#[cfg(test)]
mod tests {
    use terrain::Spacing;

    use super::*;

    #[track_caller]
    fn check(modules: [usize; 2], spacing_m: f64, expected: (usize, usize)) {
        let spacing = Spacing::from_metres(spacing_m).unwrap();
        let side_cells = (500.0 / spacing_m) as usize;
        let grid = GridFrame { origin_east_m: 0.0, origin_north_m: 0.0, spacing };
        let rect = PostRect::of_size(modules[0] * side_cells + 1, modules[1] * side_cells + 1);
        let crs = Crs::from_epsg(32611).unwrap();
        let windows = Sampled { crs: &crs, grid, rect, side_cells, triangles: 32 }.windows();
        assert!(windows.iter().all(|window| rect.contains_rect(window)));
        let apart = |a: &PostRect, b: &PostRect| {
            a.intersection(b).is_none_or(|cut| cut.cells_wide() == 0 || cut.cells_high() == 0)
        };
        for (index, window) in windows.iter().enumerate() {
            assert!(windows[..index].iter().all(|other| apart(window, other)), "no ground is looked at twice");
        }
        assert_eq!((windows.len(), windows[0].cells_wide() / side_cells), expected);
    }

    #[test]
    fn windows_are_spread_over_an_area_of_any_size() {
        check([100, 100], 25.0, (144, 2));
        check([2, 2], 25.0, (1, 2));
        check([4, 30], 12.5, (24, 2));
        check([100, 100], 2.0, (36, 1));
        check([3, 7], 0.5, (1, 1));
    }
}
