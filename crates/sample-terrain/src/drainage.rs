//! Ridges, gullies and washes: waves that run down the slope, each octave steered by the ones before.
//!
//! An octave scatters one pivot in every cell of a grid. Each pivot carries a plane wave whose crests run down the
//! slope it stands on; the waves of neighbouring pivots are blended as phasors, so that crests stay whole and join
//! in forks where pivots disagree. The slope of every octave turns the pivots of the next one, so that gullies run
//! off ridges into valleys and the pattern branches as drainage does. It needs no neighbouring heights, so any
//! window can be evaluated alone. The idea is that of erosion filters made of noise and of phasor noise.

use fearless_simd::{Level, Simd, dispatch, f32x8, prelude::*};

use crate::noise::Stream;
use crate::region::Region;

/// Octaves of drainage.
pub(crate) const OCTAVES: usize = 4;
/// Metres from crest to crest of each octave.
pub(crate) const WAVELENGTHS_M: [f32; OCTAVES] = [1400.0, 590.0, 250.0, 112.0];
/// Steepness of the waves' flanks in the mountains, per octave.
pub(crate) const FLANKS: [f32; OCTAVES] = [0.29, 0.27, 0.15, 0.06];
/// Width of the cells in wavelengths, per octave. The middle ones are dense, because gullies turn on every ridge;
/// the first follows smooth ground and the last is too small to show it.
const CELL_WAVELENGTHS: [f32; OCTAVES] = [0.7, 0.5, 0.5, 0.7];
/// How far a pivot reaches, in wavelengths.
const REACH_WAVELENGTHS: f32 = 0.95;
/// How far a pivot may stand from the middle of its cell, in cells.
const JITTER_CELLS: f64 = 0.42;
/// Cells on each side of a place's own whose pivots may reach it: 1.9 + 0.42 + 0.5 cells fall short of the third.
const NEIGHBOURS: i64 = 2;
/// Seed layer of the first octave's pivots.
const LAYER: u64 = 100;
/// Distance over which the slope under the first octave's pivots is taken, in metres.
const SLOPE_BASE_M: f64 = 400.0;
/// Where waves cancel, the blend is weak: added to its size, this lets it fade instead of jumping.
const WEAK: f32 = 0.25;

/// Adding and taking away 1.5 * 2^23 rounds to a whole number without a branch.
const ROUND: f32 = 12_582_912.0;
/// Posts of a row that are worked on at once.
const LANES: usize = 8;

/// The place where one wave has its crest, in metres from the block's south-west corner.
#[derive(Clone, Copy, Debug)]
struct Pivot {
    east_m: f32,
    north_m: f32,
    /// Slope of the ground with all coarser octaves cut into it.
    slope: Slope,
    /// Unit vector across the flow.
    across_east: f32,
    across_north: f32,
}

/// A slope, and how much of the next octave's relief it will feel.
#[derive(Clone, Copy, Debug, Default)]
struct Slope {
    east: f32,
    north: f32,
    /// 1 in the mountains, 0 on fans.
    mountain: f32,
}

/// The pivots of one octave that matter to a block, by cell: south to north, then west to east.
#[derive(Debug)]
pub(crate) struct Octave {
    number: usize,
    pivots: Vec<Pivot>,
    cols: usize,
    first_cell: (i64, i64),
    corner_m: (f64, f64),
}

/// The first `count` octaves of the square whose south-west corner is given in metres, coarsest first.
pub(crate) fn octaves(seed: u64, region: &Region, corner_m: (f64, f64), side_m: f64, count: usize) -> Vec<Octave> {
    let mut octaves: Vec<Octave> = Vec::with_capacity(count);
    for number in 0..count {
        // Finer pivots beyond the border are steered by pivots farther out.
        let margin_m: f32 = (number..count).map(reach_m).sum();
        let octave = match octaves.last() {
            None => Octave::scatter(seed, number, corner_m, side_m, margin_m, |east_m, north_m| {
                let [east, north] = region.slope(corner_m.0 + east_m, corner_m.1 + north_m, SLOPE_BASE_M);
                let mountain = region.lie(corner_m.0 + east_m, corner_m.1 + north_m).mountain();
                Slope { east, north, mountain }
            }),
            Some(coarser) => Octave::scatter(seed, number, corner_m, side_m, margin_m, |east_m, north_m| {
                coarser.slope(east_m as f32, north_m as f32)
            }),
        };
        octaves.push(octave);
    }
    octaves
}

impl Octave {
    fn scatter(
        seed: u64,
        number: usize,
        corner_m: (f64, f64),
        side_m: f64,
        margin_m: f32,
        slope: impl Fn(f64, f64) -> Slope,
    ) -> Self {
        let stream = Stream::new(seed, LAYER + number as u64);
        let cell = f64::from(cell_m(number));
        let cells = |from_m: f64| {
            let first = ((from_m - f64::from(margin_m)) / cell).floor() as i64;
            first..((from_m + side_m + f64::from(margin_m)) / cell).floor() as i64 + 1
        };
        let (easts, norths) = (cells(corner_m.0), cells(corner_m.1));
        let mut pivots = Vec::with_capacity(easts.clone().count() * norths.clone().count());
        for north in norths.clone() {
            for east in easts.clone() {
                let (right, up) = stream.pair(east, north);
                let east_m = (east as f64 + 0.5 + JITTER_CELLS * right) * cell - corner_m.0;
                let north_m = (north as f64 + 0.5 + JITTER_CELLS * up) * cell - corner_m.1;
                pivots.push(Pivot::new(east_m as f32, north_m as f32, slope(east_m, north_m)));
            }
        }
        Self { number, pivots, cols: easts.clone().count(), first_cell: (easts.start, norths.start), corner_m }
    }

    /// Slope of the ground at a place in metres from the block's corner, this octave's waves included.
    fn slope(&self, east_m: f32, north_m: f32) -> Slope {
        let (mut cosine, mut sine, mut weights) = (0.0f32, 0.0f32, 1e-6f32);
        let (mut sum, mut turn_east, mut turn_north) = (Slope::default(), 0.0f32, 0.0f32);
        let per_reach2 = 1.0 / (reach_m(self.number) * reach_m(self.number));
        let per_wave = 1.0 / WAVELENGTHS_M[self.number];
        for pivot in self.near(east_m, north_m) {
            let (dx, dy) = (east_m - pivot.east_m, north_m - pivot.north_m);
            let near = 1.0 - (dx * dx + dy * dy) * per_reach2;
            if near <= 0.0 {
                continue;
            }
            let weight = near * near;
            let (c, s) = wave((dx * pivot.across_east + dy * pivot.across_north) * per_wave);
            cosine += weight * c;
            sine += weight * s;
            turn_east += weight * s * pivot.across_east;
            turn_north += weight * s * pivot.across_north;
            weights += weight;
            sum.east += weight * pivot.slope.east;
            sum.north += weight * pivot.slope.north;
            sum.mountain += weight * pivot.slope.mountain;
        }
        let per_weight = 1.0 / weights;
        let mountain = sum.mountain * per_weight;
        let turn = -1.8 * FLANKS[self.number] * mountain / (cosine.abs() + sine.abs() + WEAK);
        Slope {
            east: sum.east * per_weight + turn * turn_east,
            north: sum.north * per_weight + turn * turn_north,
            mountain,
        }
    }

    /// The pivots that may reach a place.
    fn near(&self, east_m: f32, north_m: f32) -> impl Iterator<Item = &Pivot> {
        let cell = f64::from(cell_m(self.number));
        let middle =
            |from_m: f64, place_m: f32, first: i64| ((from_m + f64::from(place_m)) / cell).floor() as i64 - first;
        let col = middle(self.corner_m.0, east_m, self.first_cell.0);
        let row = middle(self.corner_m.1, north_m, self.first_cell.1);
        let rows = (self.pivots.len() / self.cols) as i64;
        let west = (col - NEIGHBOURS).max(0) as usize;
        let east = ((col + NEIGHBOURS + 1).min(self.cols as i64)).max(0) as usize;
        let cols = west..east.max(west);
        ((row - NEIGHBOURS).max(0)..(row + NEIGHBOURS + 1).min(rows)).flat_map(move |row| {
            let start = row as usize * self.cols;
            self.pivots[start + cols.start..start + cols.end].iter()
        })
    }

    /// The blend of all waves at the posts of a patch, into `blend`.
    pub(crate) fn blend(&self, posts: Posts<'_>, blend: &mut Blend) {
        // Compiled once for each width of lanes; single numbers come out the same in all of them.
        dispatch!(Level::new(), simd => self.blend_in_lanes(simd, posts, blend));
    }

    #[inline(always)]
    fn blend_in_lanes<S: Simd>(&self, simd: S, posts: Posts<'_>, blend: &mut Blend) {
        blend.cosine.fill(0.0);
        blend.sine.fill(0.0);
        let wide = posts.east_m.len();
        let reach_m = reach_m(self.number);
        for pivot in self.around(posts) {
            let cols = posts.reached(posts.east_m, pivot.east_m, reach_m);
            let cols = cols.start / LANES * LANES..cols.end.next_multiple_of(LANES).min(wide);
            for row in posts.reached(posts.north_m, pivot.north_m, reach_m) {
                let dy = posts.north_m[row] - pivot.north_m;
                let (east_m, span) = (&posts.east_m[cols.clone()], row * wide + cols.start..row * wide + cols.end);
                self.blend_span(simd, pivot, dy, east_m, &mut blend.cosine[span.clone()], &mut blend.sine[span]);
            }
        }
    }

    /// The pivots whose cells lie within reach of a patch, in the order in which they are stored.
    #[inline(always)]
    fn around(&self, posts: Posts<'_>) -> impl Iterator<Item = &Pivot> {
        let (cell, reach_m) = (f64::from(cell_m(self.number)), f64::from(reach_m(self.number)));
        let cells = |places: &[f32], corner_m: f64, first: i64, count: usize| {
            let (from, to) = (f64::from(places[0]) - reach_m, f64::from(places[places.len() - 1]) + reach_m);
            let index = |place_m: f64| ((corner_m + place_m) / cell).floor() as i64 - first;
            index(from).max(0) as usize..(index(to) + 1).clamp(0, count as i64) as usize
        };
        let rows = cells(posts.north_m, self.corner_m.1, self.first_cell.1, self.pivots.len() / self.cols);
        let cols = cells(posts.east_m, self.corner_m.0, self.first_cell.0, self.cols);
        rows.flat_map(move |row| &self.pivots[row * self.cols + cols.start..row * self.cols + cols.end])
    }

    /// One pivot's wave along one row, in lanes: spans are short, and posts that the pivot does not reach are cheaper
    /// than an odd end. They weigh 0.
    #[inline(always)]
    fn blend_span<S: Simd>(
        &self,
        simd: S,
        pivot: &Pivot,
        dy: f32,
        east_m: &[f32],
        cosine: &mut [f32],
        sine: &mut [f32],
    ) {
        let per_reach2 = 1.0 / (reach_m(self.number) * reach_m(self.number));
        let per_wave = 1.0 / WAVELENGTHS_M[self.number];
        let (turn_east, turn_row) = (pivot.across_east * per_wave, dy * pivot.across_north * per_wave);
        let rest = 1.0 - dy * dy * per_reach2;
        let add = |east_m: f32, cosine: &mut f32, sine: &mut f32| {
            let dx = east_m - pivot.east_m;
            let near = (rest - dx * dx * per_reach2).max(0.0);
            let weight = near * near;
            let (c, s) = wave(dx * turn_east + turn_row);
            *cosine += weight * c;
            *sine += weight * s;
        };
        let (easts, last_easts) = east_m.as_chunks::<LANES>();
        let (cosines, last_cosines) = cosine.as_chunks_mut::<LANES>();
        let (sines, last_sines) = sine.as_chunks_mut::<LANES>();
        let all = |value: f32| f32x8::splat(simd, value);
        for ((easts, cosines), sines) in easts.iter().zip(cosines).zip(sines) {
            let dx = f32x8::from_slice(simd, easts) - all(pivot.east_m);
            let near = (all(rest) - dx * dx * all(per_reach2)).max(all(0.0));
            let weight = near * near;
            let turns = dx * all(turn_east) + all(turn_row);
            let t = turns - ((turns + all(ROUND)) - all(ROUND));
            let u = all(0.25) - t.abs();
            let (c, s) = (u * (all(8.0) - all(16.0) * u.abs()), t * (all(8.0) - all(16.0) * t.abs()));
            (f32x8::from_slice(simd, cosines) + weight * c).store_slice(cosines);
            (f32x8::from_slice(simd, sines) + weight * s).store_slice(sines);
        }
        for ((&east_m, cosine), sine) in last_easts.iter().zip(last_cosines).zip(last_sines) {
            add(east_m, cosine, sine);
        }
    }
}

impl Pivot {
    fn new(east_m: f32, north_m: f32, slope: Slope) -> Self {
        let length = (slope.east * slope.east + slope.north * slope.north).sqrt().max(1e-9);
        Self { east_m, north_m, slope, across_east: -slope.north / length, across_north: slope.east / length }
    }
}

/// Where the posts of a patch lie: metres from the block's south-west corner, `spacing_m` apart, none empty.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Posts<'a> {
    pub(crate) east_m: &'a [f32],
    pub(crate) north_m: &'a [f32],
    pub(crate) spacing_m: f32,
}

impl Posts<'_> {
    pub(crate) fn count(&self) -> usize {
        self.east_m.len() * self.north_m.len()
    }

    /// Indices of the places within reach of `centre_m`; one more on either side does no harm, it weighs 0.
    #[inline(always)]
    fn reached(&self, places: &[f32], centre_m: f32, reach_m: f32) -> std::ops::Range<usize> {
        let per_spacing = 1.0 / self.spacing_m;
        // A float below 0 becomes index 0.
        let start = ((centre_m - reach_m - places[0]) * per_spacing) as usize;
        let end = ((centre_m + reach_m - places[0]) * per_spacing + 2.0) as usize;
        let end = end.min(places.len());
        start.min(end)..end
    }
}

/// Sums of waves at every post of a patch, row-major.
#[derive(Debug)]
pub(crate) struct Blend {
    cosine: Vec<f32>,
    sine: Vec<f32>,
}

impl Blend {
    pub(crate) fn of_size(count: usize) -> Self {
        Self { cosine: vec![0.0; count], sine: vec![0.0; count] }
    }

    /// The wave at every post.
    pub(crate) fn crests(&self) -> impl Iterator<Item = Crest> {
        self.cosine.iter().zip(&self.sine).map(|(&cosine, &sine)| {
            let blunt = 0.003 * (cosine * cosine + sine * sine);
            let size = cosine.abs() + (sine * sine + blunt).sqrt();
            Crest { relief: cosine / (size + WEAK), line: cosine / (size + 0.01) }
        })
    }
}

/// A triangle wave, -1 in valley lines and 1 on crests, with a slightly blunted crease at both.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Crest {
    /// Fades where neighbouring waves cancel, so that relief has no steps.
    pub(crate) relief: f32,
    /// Does not fade, so that lines are long and fork.
    pub(crate) line: f32,
}

fn cell_m(number: usize) -> f32 {
    WAVELENGTHS_M[number] * CELL_WAVELENGTHS[number]
}

fn reach_m(number: usize) -> f32 {
    WAVELENGTHS_M[number] * REACH_WAVELENGTHS
}

/// Cosine and sine of a number of turns, from parabolas: within 6 %, which is all a wave needs.
#[inline(always)]
fn wave(turns: f32) -> (f32, f32) {
    let t = turns - ((turns + ROUND) - ROUND);
    let u = 0.25 - t.abs();
    (u * (8.0 - 16.0 * u.abs()), t * (8.0 - 16.0 * t.abs()))
}
