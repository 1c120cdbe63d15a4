//! What the DEM says along features, from the profiles of tiles.

use features::{Histogram, Sounded};
use store::Profile;

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
        let (count, is_way) = (read.features.stations().len(), read.features.is_way());
        let (mut heights, mut middles) = (vec![None; count], vec![None; count]);
        let mut inside: Vec<Histogram> = vec![Histogram::new(); read.features.outlines().len()];
        for (profile, stations) in profiles.zip(&read.by_tile) {
            stations.iter().zip(&profile.heights).for_each(|(&station, &height)| heights[station as usize] = height);
            let ways = stations.iter().filter(|station| is_way[**station as usize]);
            ways.zip(&profile.middles).for_each(|(&station, &height)| middles[station as usize] = Some(height));
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
