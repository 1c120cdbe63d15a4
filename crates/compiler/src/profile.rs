//! The stage `profile`: the ground along features, tile by tile. It reads the features and one tile's heights.

use std::sync::Arc;

use database::{FileStamp, Profile};
use engine::{Artifact, Key, Outcome, Stamp, keep_or_make};
use features::{AreaFeatures, Place};
use ground::{GamingArea, Vectors, Window, area_features};
use job::Job;
use terrain::{Dem, ModuleId, Post, TileId};

use crate::keys;
use crate::run::{ALGORITHM_REVISION, Run};
use crate::{CompileError, Progress, Stage};

/// The features of a job as they were read, and which tile each of their stations lies in.
pub(crate) struct ReadFeatures {
    pub vectors: Vectors,
    pub features: AreaFeatures,
    /// Stations of each tile, by their place among those of the area. What lies beyond the area is in none.
    pub by_tile: Vec<Vec<u32>>,
}

impl ReadFeatures {
    /// Reads the features of a job that has some.
    ///
    /// # Errors
    /// When a file of them cannot be read at all.
    pub fn open(job: &Job, area: &GamingArea) -> Result<Option<Self>, CompileError> {
        let Some((vectors, features)) = area_features(job, area)? else { return Ok(None) };
        let mut by_tile = vec![Vec::new(); area.tiles.len()];
        for (number, &place) in features.stations().iter().enumerate() {
            if let Some(tile) = tile_of(area, &features, place) {
                by_tile[area.tiling.index(tile)].push(number as u32);
            }
        }
        Ok(Some(Self { vectors, features, by_tile }))
    }

    /// The stations of a tile.
    fn stations(&self, index: usize) -> impl ExactSizeIterator<Item = Place> + Clone {
        self.by_tile[index].iter().map(|&number| self.features.stations()[number as usize])
    }
}

/// The tile of a place: on a line between two the one north or east of it, but for the area's own border.
fn tile_of(area: &GamingArea, features: &AreaFeatures, place: Place) -> Option<TileId> {
    let side = features.site.lattice.steps_per_post() * area.grid.side_cells;
    let module = |at: i32, count: u32| {
        let number = u32::try_from(at.div_euclid(side)).ok()?;
        let on_border = at.rem_euclid(side) == 0 && number == count;
        (number < count || on_border).then_some(number.min(count - 1))
    };
    let (row, col) = (module(place.row, area.grid.rows)?, module(place.col, area.grid.cols)?);
    Some(area.tiling.tile_of_module(ModuleId { row, col }, area.grid))
}

/// Finds the ground along the features of every tile.
pub(crate) fn profile(run: &Run, progress: &mut dyn Progress) -> Result<(), CompileError> {
    // Before the clock of the stage's tiles runs.
    run.features()?;
    run.for_each_tile(Stage::Profile, progress, |tile| Ok(profile_tile(run, tile)?.map(drop))).map(drop)
}

/// The ground along the features of a tile, or what is published and fresh.
pub(crate) fn profile_tile(run: &Run, tile: TileId) -> Result<Outcome<(FileStamp, Profile)>, CompileError> {
    let (read, window) = (run.features()?, run.ground.natural_tile(&run.area, tile)?);
    keep_or_make(&Profiling { run, read: &read, window: &window, tile }, ALGORITHM_REVISION)
}

/// A tile's profile, as the engine asks for it.
struct Profiling<'a> {
    run: &'a Run<'a>,
    read: &'a ReadFeatures,
    window: &'a Arc<Window>,
    tile: TileId,
}

impl Profiling<'_> {
    fn stations(&self) -> impl ExactSizeIterator<Item = Place> + Clone {
        self.read.stations(self.run.area.tiling.index(self.tile))
    }
}

impl Artifact for Profiling<'_> {
    type Output = (FileStamp, Profile);
    type Error = CompileError;

    fn key(&self) -> Key {
        keys::profile(self.window, self.read.features.site.lattice.steps_per_post(), self.stations())
    }

    fn published(&self) -> Result<Option<Stamp>, CompileError> {
        Ok(self.run.database.folder().profile_stamp(self.tile)?)
    }

    fn read(&self, _key: &Key) -> Option<(Stamp, (FileStamp, Profile))> {
        let (stamp, file, profile) = self.run.database.folder().read_profile(self.tile).ok()?;
        (profile.heights.len() == self.stations().len()).then_some((stamp, (file, profile)))
    }

    fn make(&self, _key: &Key, stamp: &Stamp) -> Result<(FileStamp, Profile), CompileError> {
        let steps = self.read.features.site.lattice.steps_per_post();
        let heights = self.stations().map(|place| height_at(&self.window.dem, steps, place)).collect();
        let profile = Profile { tile: self.tile, heights };
        Ok((self.run.database.write_profile(stamp, &profile)?, profile))
    }
}

/// The height of a DEM at a place between its posts, bilinear and rounded to quanta; nothing where one of the posts
/// around it is a void.
fn height_at(dem: &Dem, steps: i32, place: Place) -> Option<i32> {
    let (row, col) = (place.row.div_euclid(steps), place.col.div_euclid(steps));
    let (north, east) = (i64::from(place.row.rem_euclid(steps)), i64::from(place.col.rem_euclid(steps)));
    let steps = i64::from(steps);
    let corners = [
        (Post::new(row, col), (steps - north) * (steps - east)),
        (Post::new(row, col + 1), (steps - north) * east),
        (Post::new(row + 1, col), north * (steps - east)),
        (Post::new(row + 1, col + 1), north * east),
    ];
    let mut sum = 0;
    for (post, share) in corners.into_iter().filter(|(_, share)| *share != 0) {
        if dem.is_void(post) {
            return None;
        }
        sum += share * i64::from(dem.height(post));
    }
    let whole = steps * steps;
    Some((2 * sum + whole).div_euclid(2 * whole) as i32)
}

#[cfg(test)]
mod tests {
    use super::*;
    use terrain::PostRect;

    #[test]
    fn a_height_between_posts_is_bilinear_and_a_void_beside_it_is_one() {
        let rect = PostRect::of_size(3, 3);
        let dem = Dem::from_fn(rect, |post| (post != Post::new(2, 2)).then_some(100 * post.row + 10 * post.col));
        let at = |row, col| height_at(&dem, 64, Place::new(row, col));
        assert_eq!((at(0, 0), at(64, 32), at(32, 32), at(1, 0)), (Some(0), Some(105), Some(55), Some(2)));
        // The last post of a row needs none beyond it.
        assert_eq!((at(0, 128), at(32, 128)), (Some(20), Some(70)));
        assert_eq!((at(127, 127), at(128, 127), at(128, 64)), (None, None, Some(210)));
    }
}
