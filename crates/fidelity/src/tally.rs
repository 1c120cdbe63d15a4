//! Sums and a histogram of residuals, for each class of ground.

use terrain::QUANTA_PER_METRE;
use terrain::geometry::resample::rounded;

/// Residuals below this have a bin for every quantum (32 m); above, 256 bins an octave.
const FINE: u32 = 1 << FINE_BITS;
const FINE_BITS: u32 = 12;
/// Bins an octave has above `FINE`: a percentile there is at most 0.4 % too large.
const OCTAVE_BITS: u32 = 8;
const BINS: usize = FINE as usize + ((u32::BITS - FINE_BITS) << OCTAVE_BITS) as usize;

/// Residuals of a set of posts, in quanta of 1/128 m.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Tally {
    /// Posts counted.
    pub posts: u64,
    /// Sum of residuals with their signs: DEM less TIN.
    pub sum: i64,
    /// Sum of absolute residuals.
    pub sum_abs: u64,
    /// Sum of squared residuals.
    pub sum_squared: u128,
    /// Largest absolute residual.
    pub largest: u32,
    /// Posts by absolute residual; empty as long as no post is counted.
    histogram: Vec<u64>,
}

impl Tally {
    /// Counts one post.
    #[inline]
    pub fn add(&mut self, residual: i32) {
        let size = residual.unsigned_abs();
        self.posts += 1;
        self.sum += i64::from(residual);
        self.sum_abs += u64::from(size);
        self.sum_squared += u128::from(u64::from(size) * u64::from(size));
        self.largest = self.largest.max(size);
        self.bins()[bin(size)] += 1;
    }

    /// The histogram, for those who count posts into sums of their own.
    #[inline]
    pub fn histogram(&mut self) -> Histogram<'_> {
        Histogram(self.bins())
    }

    /// Adds sums whose posts are in the histogram already.
    #[inline]
    pub fn add_sums(&mut self, sums: &Sums) {
        self.posts += u64::from(sums.posts);
        self.largest = self.largest.max(sums.largest);
        self.sum += sums.sum;
        self.sum_abs += sums.sum_abs;
        self.sum_squared += sums.sum_squared;
    }

    /// The bins, made when the first post comes.
    #[inline]
    fn bins(&mut self) -> &mut [u64] {
        if self.histogram.is_empty() {
            self.histogram = vec![0; BINS];
        }
        &mut self.histogram
    }

    /// Bins of the histogram that hold posts, in ascending order, and how many: with the sums, all there is to keep.
    pub fn filled_bins(&self) -> impl Iterator<Item = (u32, u64)> + '_ {
        self.histogram.iter().enumerate().filter(|&(_, &posts)| 0 < posts).map(|(bin, &posts)| (bin as u32, posts))
    }

    /// The same sums with these bins; bins that no tally has are left out.
    #[must_use]
    pub fn with_bins(mut self, bins: impl IntoIterator<Item = (u32, u64)>) -> Self {
        for (bin, posts) in bins {
            if let Some(slot) = self.bins().get_mut(bin as usize) {
                *slot = posts;
            }
        }
        self
    }

    /// Counts the posts of another set too.
    pub fn merge(&mut self, other: &Tally) {
        self.posts += other.posts;
        self.sum += other.sum;
        self.sum_abs += other.sum_abs;
        self.sum_squared += other.sum_squared;
        self.largest = self.largest.max(other.largest);
        if !other.histogram.is_empty() {
            self.bins().iter_mut().zip(&other.histogram).for_each(|(bin, &posts)| *bin += posts);
        }
    }

    /// Root mean square residual in metres; 0 without posts.
    pub fn rms_m(&self) -> f64 {
        self.per_post(self.sum_squared as f64).sqrt() / f64::from(QUANTA_PER_METRE)
    }

    /// Largest absolute residual in metres.
    pub fn max_m(&self) -> f64 {
        f64::from(self.largest) / f64::from(QUANTA_PER_METRE)
    }

    /// Mean absolute residual in metres; 0 without posts.
    pub fn mean_abs_m(&self) -> f64 {
        self.per_post(self.sum_abs as f64) / f64::from(QUANTA_PER_METRE)
    }

    /// Mean residual in metres, positive where the DEM lies above the TIN; 0 without posts.
    pub(crate) fn mean_m(&self) -> f64 {
        self.per_post(self.sum as f64) / f64::from(QUANTA_PER_METRE)
    }

    /// The absolute residual, in metres, that `percent` of the posts do not exceed.
    ///
    /// Exact to the quantum up to 32 m, at most 0.4 % too large above; 0 without posts.
    pub fn percentile_m(&self, percent: f64) -> f64 {
        let rank = (self.posts as f64 * percent / 100.0).ceil().clamp(1.0, self.posts.max(1) as f64) as u64;
        let mut below = 0;
        let reached = self.histogram.iter().position(|&posts| {
            below += posts;
            rank <= below
        });
        let quanta = reached.map_or(0, |bin| bin_end(bin).min(self.largest));
        f64::from(quanta) / f64::from(QUANTA_PER_METRE)
    }

    fn per_post(&self, sum: f64) -> f64 {
        if self.posts == 0 { 0.0 } else { sum / self.posts as f64 }
    }
}

/// Posts by absolute residual.
pub struct Histogram<'a>(&'a mut [u64]);

impl Histogram<'_> {
    /// Counts one post.
    #[inline(always)]
    pub fn add(&mut self, residual: i32) {
        self.0[bin(residual.unsigned_abs())] += 1;
    }
}

/// Sums over the posts of a load module or of a triangle, few enough to stay in registers.
#[derive(Clone, Copy, Debug, Default)]
pub struct Sums {
    pub(crate) posts: u32,
    pub(crate) largest: u32,
    pub(crate) sum: i64,
    pub(crate) sum_abs: u64,
    pub(crate) sum_squared: u128,
}

impl Sums {
    /// Counts one post.
    #[inline(always)]
    pub fn add(&mut self, residual: i32) {
        let size = u64::from(residual.unsigned_abs());
        self.posts += 1;
        self.largest = self.largest.max(residual.unsigned_abs());
        self.sum += i64::from(residual);
        self.sum_abs += size;
        self.sum_squared += u128::from(size * size);
    }

    /// Counts posts by residuals in quanta, rounded half away from zero, here and in a histogram; NaN is left out.
    #[inline(always)]
    pub(crate) fn add_rounded(&mut self, residuals: &[f64], mut histogram: Histogram) {
        let mut whole = [0; TOGETHER];
        for residuals in residuals.chunks(TOGETHER) {
            let mut known = 0;
            for (residual, to) in residuals.iter().zip(&mut whole) {
                *to = rounded(*residual);
                known += usize::from(!residual.is_nan());
            }
            if known < residuals.len() {
                let found = residuals.iter().filter(|residual| !residual.is_nan());
                found.zip(&mut whole).for_each(|(&residual, to)| *to = rounded(residual));
            }
            self.add_all(&whole[..known]);
            whole[..known].iter().for_each(|&residual| histogram.add(residual));
        }
    }

    /// Counts some posts, fewer than 2^16.
    #[inline(always)]
    pub(crate) fn add_all(&mut self, residuals: &[i32]) {
        let (mut sum, mut sum_abs, mut sum_squared) = (0_i64, 0_u64, 0_u64);
        for &residual in residuals {
            let size = u64::from(residual.unsigned_abs());
            sum += i64::from(residual);
            sum_abs += size;
            // Residuals have 24 bits.
            sum_squared += size * size;
            self.largest = self.largest.max(residual.unsigned_abs());
        }
        self.posts += residuals.len() as u32;
        self.sum += sum;
        self.sum_abs += sum_abs;
        self.sum_squared += u128::from(sum_squared);
    }
}

/// Residuals that are counted together.
const TOGETHER: usize = 64;

/// The bin of an absolute residual.
#[inline(always)]
fn bin(size: u32) -> usize {
    if size < FINE {
        return size as usize;
    }
    let octave = size.ilog2();
    let within = (size >> (octave - OCTAVE_BITS)) & ((1 << OCTAVE_BITS) - 1);
    (FINE + ((octave - FINE_BITS) << OCTAVE_BITS) + within) as usize
}

/// The largest absolute residual of a bin.
fn bin_end(bin: usize) -> u32 {
    let bin = bin as u32;
    if bin < FINE {
        return bin;
    }
    let (octave, within) = ((bin - FINE) >> OCTAVE_BITS, (bin - FINE) & ((1 << OCTAVE_BITS) - 1));
    let width = 1 << (octave + FINE_BITS - OCTAVE_BITS);
    // The last bin ends at the largest number there is.
    ((1_u64 << (octave + FINE_BITS)) + u64::from(within + 1) * width - 1) as u32
}

/// Residuals of posts by the class of the ground they lie on.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Residuals {
    /// A tally for each class, by its number; classes above the last one met are left out.
    pub classes: Vec<Tally>,
}

impl Residuals {
    /// The tally of one class.
    #[inline]
    pub(crate) fn class(&mut self, class: u8) -> &mut Tally {
        let class = usize::from(class);
        if self.classes.len() <= class {
            self.classes.resize(class + 1, Tally::default());
        }
        &mut self.classes[class]
    }

    /// Counts the posts of another set too.
    pub fn merge(&mut self, other: &Residuals) {
        for (class, tally) in other.classes.iter().enumerate() {
            self.class(class as u8).merge(tally);
        }
    }

    /// All classes together.
    pub fn total(&self) -> Tally {
        let mut total = Tally::default();
        self.classes.iter().for_each(|tally| total.merge(tally));
        total
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn check(residuals: &[i32], percent: f64, expected: f64) {
        let mut tally = Tally::default();
        residuals.iter().for_each(|&residual| tally.add(residual));
        assert_eq!(tally.percentile_m(percent), expected / 128.0);
    }

    #[test]
    fn a_percentile_is_the_residual_at_its_rank() {
        let hundred: Vec<_> = (1..=100).map(|v| if v % 2 == 0 { v } else { -v }).collect();
        check(&hundred, 50.0, 50.0);
        check(&hundred, 95.0, 95.0);
        check(&hundred, 100.0, 100.0);
        check(&hundred, 0.0, 1.0);
        check(&[], 50.0, 0.0);
        check(&[7_000_001], 50.0, 7_000_001.0);
    }

    #[test]
    fn every_residual_lies_in_its_bin_and_bins_are_narrow() {
        for size in (0..20_000).chain((0..32).map(|bit| 1 << bit)).chain([u32::MAX, (1 << 25) - 1]) {
            let end = bin_end(bin(size));
            assert!(size <= end && f64::from(end - size) <= f64::from(size) / 256.0, "{size} in a bin up to {end}");
            assert!(size == 0 || bin(size - 1) <= bin(size));
        }
        assert_eq!(bin(u32::MAX), BINS - 1);
    }

    #[test]
    fn sums_of_parts_are_the_sums_of_the_whole() {
        let (mut whole, mut west, mut east) = (Residuals::default(), Residuals::default(), Residuals::default());
        for (i, residual) in [3, -4, 5000, 0, -128].into_iter().enumerate() {
            let class = (i % 3) as u8;
            whole.class(class).add(residual);
            if i < 2 { west.class(class).add(residual) } else { east.class(class).add(residual) }
        }
        west.merge(&east);
        assert_eq!(west, whole);
        let total = whole.total();
        assert_eq!((total.posts, total.sum, total.sum_abs, total.largest), (5, 4871, 5135, 5000));
        assert_eq!(total.max_m(), 5000.0 / 128.0);
        assert_eq!(total.rms_m(), ((9 + 16 + 25_000_000 + 16_384) as f64 / 5.0).sqrt() / 128.0);
        assert_eq!((total.mean_m(), total.mean_abs_m()), (4871.0 / 5.0 / 128.0, 5135.0 / 5.0 / 128.0));
    }
}
