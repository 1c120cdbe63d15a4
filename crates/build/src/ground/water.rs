//! Water that lies level: one height for each body, whichever tiles it reaches into.
//!
//! Each tile counts the heights of every body in it; the counts of all tiles are added up, and the level is the median.
//! So no more than counts is ever held for the whole area.

use std::collections::BTreeMap;

use job::Job;
use source_files::{Patch, Standing};
use terrain::mask::Polygon;
use terrain::{Dem, GridFrame, Post, PostRect};

/// Bodies of water, and their levels once they are known.
pub struct Water {
    bodies: Vec<Body>,
    frame: GridFrame,
}

struct Body {
    polygon: Polygon,
    bounds: PostRect,
    /// In quanta.
    level: Option<i32>,
}

/// How often each height occurs in each body, within one tile or several.
pub type Soundings = BTreeMap<usize, BTreeMap<i32, u64>>;

impl Water {
    /// Of the polygons that reach into the area.
    pub fn new(job: &Job, polygons: Vec<Polygon>, frame: GridFrame, area: PostRect) -> Self {
        let level = job.dem.water.as_ref().and_then(|water| water.level_m).and_then(terrain::quanta_of_metres);
        let bodies = polygons.into_iter().filter_map(|polygon| {
            let bounds = polygon.bounds(&frame)?.intersection(&area)?;
            Some(Body { polygon, bounds, level })
        });
        Self { bodies: bodies.collect(), frame }
    }

    /// Levels that are known, in quanta.
    pub fn levels_known(&self) -> impl Iterator<Item = i32> {
        self.bodies.iter().filter_map(|body| body.level)
    }

    /// Whether there is water in a rectangle, as far as can be told from bounds.
    pub fn reaches(&self, rect: PostRect) -> bool {
        self.bodies.iter().any(|body| body.bounds.intersection(&rect).is_some())
    }

    /// Counts the heights of a tile in each body. A post on a side that two tiles share counts in the southern or
    /// western one.
    pub fn sound(&self, dem: &Dem, area: PostRect) -> Soundings {
        let rect = dem.rect();
        let mut own = rect;
        own.south += i32::from(area.south < rect.south);
        own.west += i32::from(area.west < rect.west);
        let mut soundings = Soundings::new();
        for (index, body) in self.bodies.iter().enumerate() {
            if body.bounds.intersection(&own).is_none() {
                continue;
            }
            body.polygon.visit_spans(&self.frame, own, |span| {
                for at in span {
                    let post = Post::new(
                        own.south + (at / own.posts_wide()) as i32,
                        own.west + (at % own.posts_wide()) as i32,
                    );
                    if !dem.is_void(post) {
                        *soundings.entry(index).or_default().entry(dem.height(post)).or_default() += 1;
                    }
                }
            });
        }
        soundings
    }

    /// Sets the level of every body; returns how many have no height at all and so stay as they are.
    pub fn level(&mut self, soundings: &Soundings) -> usize {
        for (index, body) in self.bodies.iter_mut().enumerate().filter(|(_, body)| body.level.is_none()) {
            body.level = soundings.get(&index).and_then(median);
        }
        self.bodies.iter().filter(|body| body.level.is_none()).count()
    }

    /// What a person should know of bodies over ground that lies far off their level: a lake's shore misses that by
    /// little, and a polygon that covers land, or a wrong level, by hills.
    pub fn misfit(&self, soundings: &Soundings) -> Option<String> {
        const OFF_MAX: u32 = 10 * terrain::QUANTA_PER_METRE as u32;
        let (mut bodies, mut posts, mut farthest) = (0, 0, 0);
        for (index, counts) in soundings {
            let Some(level) = self.bodies[*index].level else { continue };
            let off = counts.iter().map(|(height, count)| (height.abs_diff(level), *count));
            let far = off.filter(|(off, _)| OFF_MAX < *off);
            let (count, most) = far.fold((0, 0), |(sum, most), (off, count)| (sum + count, off.max(most)));
            if (counts.values().sum::<u64>() / 100).min(100) < count {
                (bodies, posts, farthest) = (bodies + 1, posts + count, most.max(farthest));
            }
        }
        let told = || {
            format!(
                "dem.water: {bodies} of {} bodies of water lie over ground that is more than 10 m off their level: \
                 {posts} posts, {:.0} m at most; the polygons cover land, or the level is wrong",
                self.bodies.len(),
                f64::from(farthest) / f64::from(terrain::QUANTA_PER_METRE)
            )
        };
        (0 < bodies).then(told)
    }

    /// The level at every post of a rectangle that lies in water; `None` when there is no water at all. Where bodies
    /// overlap the later one counts.
    fn levels(&self, rect: PostRect) -> Option<Vec<Option<i32>>> {
        let mut levels: Option<Vec<Option<i32>>> = None;
        for body in self.bodies.iter().filter(|body| body.level.is_some() && body.bounds.intersection(&rect).is_some())
        {
            let levels = levels.get_or_insert_with(|| vec![None; rect.post_count()]);
            body.polygon.visit_spans(&self.frame, rect, |span| levels[span].fill(body.level));
        }
        levels
    }

    /// The same ground with its water level; a void in water is one no longer.
    pub fn flatten(&self, dem: Dem) -> Dem {
        let rect = dem.rect();
        let Some(levels) = self.levels(rect) else { return dem };
        let level = |post: Post| levels[rect.index(post)];
        let mut flat = Dem::from_fn(rect, |post| level(post).or((!dem.is_void(post)).then(|| dem.height(post))));
        flat.fill_voids(|post| dem.height(post));
        flat
    }

    /// The same before anything is made of it.
    pub fn flatten_patch(&self, mut patch: Patch) -> Patch {
        let Some(levels) = self.levels(patch.rect) else { return patch };
        for (index, level) in levels.into_iter().enumerate() {
            if let Some(level) = level {
                (patch.heights[index], patch.standings[index]) = (level, Standing::Height);
            }
        }
        patch
    }
}

/// The height that half of all are not above; of two, the lower one.
fn median(counts: &BTreeMap<i32, u64>) -> Option<i32> {
    let all: u64 = counts.values().sum();
    let mut below = 0;
    counts.iter().find_map(|(&height, &count)| {
        below += count;
        (all <= 2 * below).then_some(height)
    })
}

/// Adds what another tile counted.
pub fn add(all: &mut Soundings, other: Soundings) {
    for (body, counts) in other {
        let sums = all.entry(body).or_default();
        counts.into_iter().for_each(|(height, count)| *sums.entry(height).or_default() += count);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_level_is_the_middle_height_and_of_two_the_lower() {
        let of = |heights: &[i32]| {
            let mut counts = BTreeMap::new();
            heights.iter().for_each(|&height| *counts.entry(height).or_default() += 1);
            median(&counts)
        };
        assert_eq!([of(&[]), of(&[7]), of(&[1, 9]), of(&[5, 5, 1, 90])], [None, Some(7), Some(1), Some(5)]);
    }
}
