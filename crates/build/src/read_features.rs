//! The features of a job on the lattice, which tile asks the DEM at which of their stations, and what it says there.

use features::{AreaFeatures, Histogram, Kind, Outline, Place, Site, Sounded};
use job::{Job, OuterBorder};
use store::Profile;
use terrain::{Each, ModuleId, TileId};

use crate::CompileError;
use crate::ground::{FeatureTable, GamingArea, Vectors, site};

/// The features of a job as they were read, and which tile each of their stations lies in.
pub(crate) struct ReadFeatures {
    pub vectors: Vectors,
    /// What they are, and what a person should know of the files and the rules.
    pub table: FeatureTable,
    pub features: AreaFeatures,
    /// Stations of each tile, by their place among those of the area. What lies beyond the area is in the tile nearest
    /// to it.
    pub by_tile: Vec<Vec<u32>>,
    /// Polygons of water, in their order.
    pub basins: Vec<Basin>,
}

/// A polygon of water, and how far it reaches.
pub(crate) struct Basin {
    /// Its number among the outlines.
    pub outline: u32,
    /// Its least and its greatest row, in steps.
    pub rows: [i32; 2],
    /// Its least and its greatest column, in steps.
    pub cols: [i32; 2],
}

impl Basin {
    /// The box of an outline, where it is one of water.
    fn of((number, outline): (u32, &Outline)) -> Option<Self> {
        let span = |of: fn(Place) -> i32| Some([outline.places().map(of).min()?, outline.places().map(of).max()?]);
        let is_water = matches!(outline.traits.kind, Kind::Lake | Kind::River);
        let (rows, cols) = (span(|place| place.row)?, span(|place| place.col)?);
        is_water.then_some(Self { outline: number, rows, cols })
    }
}

impl ReadFeatures {
    /// Reads the features of a job that has some; `each` runs what falls into pieces.
    ///
    /// # Errors
    /// When a file of them cannot be read at all.
    pub fn open(job: &Job, area: &GamingArea, each: Each) -> Result<Option<Self>, CompileError> {
        let Some(spec) = &job.features else { return Ok(None) };
        let mut vectors = Vectors::read(job, area, each)?;
        let table = FeatureTable::of(&vectors, &spec.rules);
        let site = Site { is_met: job.modules.outer_border == OuterBorder::Fixed, ..site(area) };
        let features = AreaFeatures::of(std::mem::take(&mut vectors.sources), &spec.rules, spec.grade_give, site, each);
        let mut by_tile = vec![Vec::new(); area.tiles.len()];
        for (number, &place) in features.stations().iter().enumerate() {
            by_tile[area.tiling.index(tile_of(area, &features, place))].push(number as u32);
        }
        let basins = (0..).zip(features.outlines()).filter_map(Basin::of).collect();
        Ok(Some(Self { vectors, table, features, by_tile, basins }))
    }

    /// What they are, and what a person should know of their files and rules.
    pub fn seen(&self) -> (&AreaFeatures, &[String]) {
        (&self.features, &self.table.notes)
    }

    /// The stations of a tile through which ways run.
    pub fn on_ways(&self, index: usize) -> Vec<Place> {
        let (stations, is_way) = (self.features.stations(), self.features.is_way());
        let ways = self.by_tile[index].iter().filter(|station| is_way[**station as usize]);
        ways.map(|station| stations[*station as usize]).collect()
    }

    /// The stations of a tile.
    pub fn stations(&self, index: usize) -> impl ExactSizeIterator<Item = Place> + Clone {
        self.by_tile[index].iter().map(|&number| self.features.stations()[number as usize])
    }
}

/// The tile nearest to a place: on a line between two the one north or east of it.
fn tile_of(area: &GamingArea, features: &AreaFeatures, place: Place) -> TileId {
    let side = features.site.lattice.steps_per_post() * area.grid.side_cells;
    let module = |at: i32, count: u32| u32::try_from(at.div_euclid(side)).unwrap_or(0).min(count - 1);
    let (row, col) = (module(place.row, area.grid.rows), module(place.col, area.grid.cols));
    area.tiling.tile_of_module(ModuleId { row, col }, area.grid)
}

/// What the DEM says along features, put together from the profiles of all tiles.
pub(crate) struct Heard {
    heights: Vec<Option<i32>>,
    middles: Vec<Option<i32>>,
    inside: Vec<Histogram>,
}

impl Heard {
    /// Of the profiles of all tiles, in their order.
    pub fn of<'a>(read: &ReadFeatures, profiles: impl Iterator<Item = &'a Profile>) -> Self {
        let (count, is_way) = (read.features.stations().len(), read.features.is_way());
        let (mut heights, mut middles) = (vec![None; count], vec![None; count]);
        let mut inside: Vec<Histogram> = vec![Histogram::new(); read.features.outlines().len()];
        for (profile, stations) in profiles.zip(&read.by_tile) {
            stations.iter().zip(&profile.heights).for_each(|(&station, &height)| heights[station as usize] = height);
            let ways = stations.iter().filter(|station| is_way[**station as usize]);
            ways.zip(&profile.middles).for_each(|(&station, &height)| middles[station as usize] = height);
            for (outline, of) in &profile.inside {
                let Some(inside) = inside.get_mut(*outline as usize) else { continue };
                inside.extend(of);
            }
        }
        inside.iter_mut().for_each(sum_up);
        Self { heights, middles, inside }
    }

    /// The same, as heights are decided by it.
    pub fn sounded(&self) -> Sounded<'_> {
        Sounded { heights: &self.heights, middles: &self.middles, inside: &self.inside }
    }
}

/// Sorts heights, and adds up how often each occurs.
fn sum_up(heights: &mut Histogram) {
    heights.sort_unstable_by_key(|(height, _)| *height);
    heights.dedup_by(|next, kept| {
        let is_same = next.0 == kept.0;
        kept.1 += if is_same { next.1 } else { 0 };
        is_same
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn heights_that_several_tiles_have_are_added_up() {
        let mut heights = vec![(5, 1), (7, 2), (-3, 1), (5, 4), (7, 1), (5, 1)];
        sum_up(&mut heights);
        assert_eq!(heights, [(-3, 1), (5, 6), (7, 3)]);
        sum_up(&mut heights);
        assert_eq!(heights, [(-3, 1), (5, 6), (7, 3)]);
    }
}
