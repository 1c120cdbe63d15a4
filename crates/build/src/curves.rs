//! The gain curves of an area: each in its file, and read back in bands.
//!
//! Those of a large area take gigabytes, and nothing but the allocation looks at them. It takes the best gains first,
//! so it is handed all runs of the highest steps of the ladder, then those of the next, and stops long before the last.

use std::collections::{BTreeMap, BTreeSet};

use terrain::{GainCurve, GainRun, TileId};
use tin::tiling::SquaresOfArea;

use crate::run::Run;
use crate::{CompileError, Stage};

/// Bytes of the runs in a band, at most, unless one step has more.
pub(crate) const BAND_BYTES_MAX: usize = 64 << 20;
/// The same in runs.
const BAND_RUNS_MAX: usize = BAND_BYTES_MAX / size_of::<GainRun>();

/// The published gain curves of an area.
pub(crate) struct Curves<'a> {
    run: &'a Run<'a>,
    profile: Profile,
    band_runs_max: usize,
}

/// What has to be known of all curves before any is read back.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Profile {
    /// Runs on each step of the ladder.
    runs: BTreeMap<i32, usize>,
    /// Steps at which sums of squares were recorded.
    squares: BTreeSet<i32>,
}

impl Profile {
    /// Takes in one more curve. Their order does not matter.
    pub fn add(&mut self, curve: &GainCurve) {
        for runs in curve.runs.chunk_by(|a, b| a.bin == b.bin) {
            *self.runs.entry(runs[0].bin).or_default() += runs.len();
        }
        self.squares.extend(curve.squares.iter().map(|&(step, _)| step));
    }

    /// Lowest and highest step of each band, the highest band first.
    fn bands(&self, runs_max: usize) -> Vec<(i32, i32)> {
        let mut bands: Vec<(i32, i32)> = Vec::new();
        let mut inside = 0;
        for (&step, &runs) in self.runs.iter().rev() {
            match bands.last_mut().filter(|_| inside + runs <= runs_max) {
                Some(band) => band.0 = step,
                None => {
                    bands.push((step, step));
                    inside = 0;
                }
            }
            inside += runs;
        }
        bands
    }
}

impl<'a> Curves<'a> {
    /// The curves that this run has published and `profile` has taken in.
    pub fn new(run: &'a Run<'a>, profile: Profile) -> Self {
        Self { run, profile, band_runs_max: BAND_RUNS_MAX }
    }

    /// The curves that are published, as `read` gives them.
    ///
    /// # Errors
    /// The first of `read`.
    pub fn published(
        run: &'a Run<'a>,
        read: impl Fn(TileId) -> Result<GainCurve, CompileError>,
    ) -> Result<Self, CompileError> {
        let mut profile = Profile::default();
        run.area.tiles.iter().try_for_each(|&tile| {
            profile.add(&read(tile)?);
            Ok::<_, CompileError>(())
        })?;
        Ok(Self::new(run, profile))
    }

    /// The bands, as the allocation takes them.
    pub fn bands(&self) -> Bands<'_> {
        let left = self.profile.bands(self.band_runs_max).into_iter();
        Bands { curves: self, left, fault: None }
    }

    /// Sums of squared residuals of the whole area.
    ///
    /// # Errors
    /// When a curve cannot be read back.
    pub fn squares(&self) -> Result<SquaresOfArea, CompileError> {
        let mut sums = SquaresOfArea::at(&self.profile.squares);
        for &tile in &self.run.area.tiles {
            sums.add(&self.read(tile)?);
        }
        Ok(sums)
    }

    /// One curve, whole.
    ///
    /// # Errors
    /// When it cannot be read back.
    pub fn read(&self, tile: TileId) -> Result<GainCurve, CompileError> {
        Ok(self.run.database.folder().read_curve(tile)?.1)
    }

    /// The runs of all tiles from step `low` to step `high`.
    fn band(&self, (low, high): (i32, i32)) -> Result<Vec<GainCurve>, CompileError> {
        let Run { area, workers, stop, .. } = self.run;
        let read = |_: usize, &tile: &TileId| {
            let curve = self.read(tile)?;
            let from = curve.runs.partition_point(|run| high < run.bin);
            let to = curve.runs.partition_point(|run| low <= run.bin);
            Ok(GainCurve { tile, runs: curve.runs[from..to].to_vec(), squares: Vec::new() })
        };
        schedule::for_each_independent(&area.tiles, workers, stop, read)
            .map_err(|error| CompileError::from_schedule(Stage::Allocate, &area.tiles, error))
    }
}

/// Walks through the bands, and ends early when one cannot be read.
pub(crate) struct Bands<'c> {
    curves: &'c Curves<'c>,
    left: std::vec::IntoIter<(i32, i32)>,
    fault: Option<CompileError>,
}

impl Bands<'_> {
    /// `done`, which was made from the bands, unless one of them could not be read.
    ///
    /// # Errors
    /// Why it could not.
    pub fn vouch<T>(self, done: T) -> Result<T, CompileError> {
        self.fault.map_or(Ok(done), Err)
    }
}

impl Iterator for Bands<'_> {
    type Item = Vec<GainCurve>;

    fn next(&mut self) -> Option<Vec<GainCurve>> {
        match self.curves.band(self.left.next()?) {
            Ok(band) => Some(band),
            Err(error) => {
                self.fault = Some(error);
                self.left = Vec::new().into_iter();
                None
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use terrain::ModuleId;

    #[test]
    fn a_band_holds_whole_steps_and_as_many_as_fit() {
        let run = |bin| GainRun { module: ModuleId { row: 0, col: 0 }, bin, cost: 2 };
        let mut profile = Profile::default();
        for bins in [&[9, 9, 7, 2][..], &[9, 8, 2, -3], &[]] {
            let runs = bins.iter().map(|&bin| run(bin)).collect();
            profile.add(&GainCurve { tile: TileId { row: 0, col: 0 }, runs, squares: Vec::new() });
        }
        assert_eq!(profile.bands(100), [(-3, 9)]);
        assert_eq!(profile.bands(4), [(8, 9), (-3, 7)]);
        assert_eq!(profile.bands(1), [(9, 9), (8, 8), (7, 7), (2, 2), (-3, -3)]);
        assert_eq!(Profile::default().bands(4), []);
    }
}
