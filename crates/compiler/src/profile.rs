//! The stage `profile`: the ground along features, tile by tile. It reads the features and one tile's heights.

use std::sync::Arc;

use database::{FileStamp, Profile};
use engine::{Artifact, Key, Outcome, Stamp, keep_or_make};
use features::Place;
use ground::Window;
use terrain::{Dem, Post, PostRect, TileId};

use crate::keys;
use crate::read_features::ReadFeatures;
use crate::run::{ALGORITHM_REVISION, Run};
use crate::{CompileError, Progress, Stage};

/// Finds the ground along the features of every tile; returns it by tile.
pub(crate) fn profile(run: &Run, progress: &mut dyn Progress) -> Result<Vec<Profile>, CompileError> {
    // Before the clock of the stage's tiles runs.
    run.features()?;
    let profiles =
        run.for_each_tile(Stage::Profile, progress, |tile| Ok(profile_tile(run, tile)?.map(|(_, profile)| profile)))?;
    Ok(profiles.into_iter().map(Outcome::into_inner).collect())
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
        let heights = self.stations().map(|place| Some(height_at(&self.window.dem, steps, place))).collect();
        let profile = Profile { tile: self.tile, heights };
        Ok((self.run.database.write_profile(stamp, &profile)?, profile))
    }
}

/// The height of a DEM at a place between its posts, bilinear and rounded to quanta: over a hole that of the surface
/// that closes it, beyond the DEM that of the nearest place inside.
pub(crate) fn height_at(dem: &Dem, steps: i32, place: Place) -> i32 {
    let PostRect { south, west, north, east } = dem.rect();
    let place = Place::new(place.row.clamp(south * steps, north * steps), place.col.clamp(west * steps, east * steps));
    let (row, col) = (place.row.div_euclid(steps), place.col.div_euclid(steps));
    let (north, east) = (i64::from(place.row.rem_euclid(steps)), i64::from(place.col.rem_euclid(steps)));
    let steps = i64::from(steps);
    let corners = [
        (Post::new(row, col), (steps - north) * (steps - east)),
        (Post::new(row, col + 1), (steps - north) * east),
        (Post::new(row + 1, col), north * (steps - east)),
        (Post::new(row + 1, col + 1), north * east),
    ];
    let needed = corners.into_iter().filter(|(_, share)| *share != 0);
    let sum: i64 = needed.map(|(post, share)| share * i64::from(dem.height(post))).sum();
    let whole = steps * steps;
    (2 * sum + whole).div_euclid(2 * whole) as i32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_height_between_posts_is_bilinear_over_holes_too() {
        let rect = PostRect::of_size(3, 3);
        let hole = Post::new(2, 2);
        let mut dem = Dem::from_fn(rect, |post| (post != hole).then_some(100 * post.row + 10 * post.col));
        dem.fill_voids(|_| 300);
        let at = |row, col| height_at(&dem, 64, Place::new(row, col));
        assert_eq!((at(0, 0), at(64, 32), at(32, 32), at(1, 0)), (0, 105, 55, 2));
        // The last post of a row needs none beyond it.
        assert_eq!((at(0, 128), at(32, 128), at(128, 64), at(128, 96)), (20, 70, 210, 255));
        assert_eq!((at(-70, -1), at(32, 999), at(-5, 32)), (0, 70, 5), "beyond it the nearest height counts");
    }
}
