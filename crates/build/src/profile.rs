//! The stage `profile`: the ground along features, tile by tile. It reads the features and one tile's heights.

use std::sync::Arc;

use crate::ground::{GamingArea, Window, posts_inside};
use features::{Outline, Place};
use store::engine::{Artifact, Key, Outcome, Stamp, keep_or_make};
use store::{FileStamp, Profile};
use terrain::{Dem, LatticePoint, Post, PostRect, TileId, Vertex};

use crate::keys;
use crate::read_features::{Basin, ReadFeatures};
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
    fn index(&self) -> usize {
        self.run.area.tiling.index(self.tile)
    }

    fn stations(&self) -> impl ExactSizeIterator<Item = Place> + Clone {
        self.read.stations(self.index())
    }

    fn on_ways(&self) -> impl ExactSizeIterator<Item = Place> + Clone + use<> {
        self.read.on_ways(self.index()).into_iter()
    }
}

impl Artifact for Profiling<'_> {
    type Output = (FileStamp, Profile);
    type Error = CompileError;

    fn key(&self) -> Key {
        let steps = self.read.features.site.lattice.steps_per_post();
        keys::profile(
            self.window,
            steps,
            self.stations(),
            self.on_ways(),
            &basins(&self.run.area, self.read, self.tile),
        )
    }

    fn published(&self) -> Result<Option<Stamp>, CompileError> {
        Ok(self.run.database.folder().profile_stamp(self.tile)?)
    }

    fn read(&self, _key: &Key) -> Option<(Stamp, (FileStamp, Profile))> {
        let (stamp, file, profile) = self.run.database.folder().read_profile(self.tile).ok()?;
        let is_whole = profile.heights.len() == self.stations().len() && profile.middles.len() == self.on_ways().len();
        is_whole.then_some((stamp, (file, profile)))
    }

    fn make(&self, _key: &Key, stamp: &Stamp) -> Result<(FileStamp, Profile), CompileError> {
        let profile = sound(&self.run.area, self.read, self.tile, &self.window.dem);
        Ok((self.run.database.write_profile(stamp, &profile)?, profile))
    }
}

/// The ground along the features of a tile, by the heights of its DEM.
pub(crate) fn sound(area: &GamingArea, read: &ReadFeatures, tile: TileId, dem: &Dem) -> Profile {
    let (index, steps) = (area.tiling.index(tile), read.features.site.lattice.steps_per_post());
    let heights = read.stations(index).map(|place| Some(height_at(dem, steps, place))).collect();
    let middles = read.on_ways(index).into_iter().map(|place| middle_at(dem, steps, place)).collect();
    let own = own_posts(area.tiling.rect(tile), area.rect);
    let inside = |(number, outline): (u32, &Outline)| {
        let rings: Vec<Vec<Vertex>> = outline.rings.iter().map(|ring| vertices(&ring.places)).collect();
        let rings: Vec<&[Vertex]> = rings.iter().map(Vec::as_slice).collect();
        let posts = posts_inside(&rings, steps, own).into_iter().filter(|post| !dem.is_void(*post));
        let mut heights: Vec<i32> = posts.map(|post| dem.height(post)).collect();
        heights.sort_unstable();
        let histogram = heights.chunk_by(|a, b| a == b).map(|same| (same[0], same.len() as u32));
        (!heights.is_empty()).then(|| (number, histogram.collect()))
    };
    let inside = basins(area, read, tile).into_iter().filter_map(inside).collect();
    Profile { tile, heights, middles, inside }
}

/// Polygons of water that reach into a tile, by their number.
fn basins<'a>(area: &GamingArea, read: &'a ReadFeatures, tile: TileId) -> Vec<(u32, &'a Outline)> {
    let steps = read.features.site.lattice.steps_per_post();
    let PostRect { south, west, north, east } = area.tiling.rect(tile);
    let reaches = |of: &Basin| {
        let meets = |[least, most]: [i32; 2], low: i32, high: i32| least <= high * steps && low * steps <= most;
        meets(of.rows, south, north) && meets(of.cols, west, east)
    };
    let outlines = read.features.outlines();
    read.basins.iter().filter(|of| reaches(of)).map(|of| (of.outline, &outlines[of.outline as usize])).collect()
}

fn vertices(places: &[Place]) -> Vec<Vertex> {
    places.iter().map(|place| Vertex { at: LatticePoint::new(place.row, place.col), height: 0 }).collect()
}

/// The posts of a tile that are no other tile's: those on a line between two belong to the one north or east of it.
fn own_posts(tile: PostRect, area: PostRect) -> PostRect {
    let north = if tile.north < area.north { tile.north - 1 } else { tile.north };
    let east = if tile.east < area.east { tile.east - 1 } else { tile.east };
    PostRect { north, east, ..tile }
}

/// The middle one of the heights at the post nearest to a place and the eight around it, as far as the DEM reaches and
/// has no hole; nothing where the nearest lies in one.
fn middle_at(dem: &Dem, steps: i32, place: Place) -> Option<i32> {
    let PostRect { south, west, north, east } = dem.rect();
    let near = |at: i32, low: i32, high: i32| {
        let post = (2 * at + steps).div_euclid(2 * steps);
        [-1, 0, 1].map(|by| (post + by).clamp(low, high))
    };
    let (rows, cols) = (near(place.row, south, north), near(place.col, west, east));
    if dem.is_void(Post::new(rows[1], cols[1])) {
        return None;
    }
    let posts = rows.into_iter().flat_map(|row| cols.map(|col| Post::new(row, col)));
    let mut heights: Vec<i32> = posts.filter(|post| !dem.is_void(*post)).map(|post| dem.height(post)).collect();
    heights.sort_unstable();
    Some(heights[heights.len() / 2])
}

/// The height of a DEM at a place between its posts, bilinear and rounded to quanta: over a hole that of the surface
/// that closes it, beyond the DEM that of the nearest place inside.
fn height_at(dem: &Dem, steps: i32, place: Place) -> i32 {
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
        let middle = |row, col| middle_at(&dem, 64, Place::new(row, col));
        assert_eq!((middle(64, 64), middle(100, 100), middle(0, 0)), (Some(110), None, Some(10)));
        assert_eq!((at(-70, -1), at(32, 999), at(-5, 32)), (0, 70, 5), "beyond it the nearest height counts");
    }
}
