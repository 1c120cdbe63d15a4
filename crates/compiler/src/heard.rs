//! What the DEM says along features, from the profiles of tiles.

use std::collections::BTreeMap;

use database::Profile;
use features::{Histogram, Sounded};

use crate::read_features::ReadFeatures;

/// What the DEM says along features, put together from the profiles of all tiles.
pub(crate) struct Heard {
    heights: Vec<Option<i32>>,
    middles: Vec<Option<i32>>,
    inside: Vec<Histogram>,
}

impl Heard {
    /// Of the profiles of all tiles, in their order.
    pub fn of<'a>(read: &ReadFeatures, profiles: impl Iterator<Item = &'a Profile>) -> Self {
        let (count, is_bed) = (read.features.stations().len(), read.features.is_bed());
        let (mut heights, mut middles) = (vec![None; count], vec![None; count]);
        let mut inside: Vec<BTreeMap<i32, u32>> = vec![BTreeMap::new(); read.features.outlines().len()];
        for (profile, stations) in profiles.zip(&read.by_tile) {
            stations.iter().zip(&profile.heights).for_each(|(&station, &height)| heights[station as usize] = height);
            let beds = stations.iter().filter(|station| is_bed[**station as usize]);
            beds.zip(&profile.middles).for_each(|(&station, &height)| middles[station as usize] = Some(height));
            for (outline, of) in &profile.inside {
                let Some(inside) = inside.get_mut(*outline as usize) else { continue };
                of.iter().for_each(|(height, count)| *inside.entry(*height).or_default() += count);
            }
        }
        let inside = inside.into_iter().map(|of| of.into_iter().collect()).collect();
        Self { heights, middles, inside }
    }

    /// The same, as heights are decided by it.
    pub fn sounded(&self) -> Sounded<'_> {
        Sounded { heights: &self.heights, middles: &self.middles, inside: &self.inside }
    }
}
