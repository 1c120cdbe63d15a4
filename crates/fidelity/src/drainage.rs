//! Drainage: do the streams run where they do, and does water stand where it does not?
//!
//! A channel is a post through which more than 500 posts drain. The TIN's are found on its heights at the same posts.
//! A channel counts as found where the other surface has one within two posts. A pit is ground that a flood from
//! outside covers; it is spurious where the DEM, under it, is nowhere flooded even half as deep.

use serde::Serialize;
use terrain::QUANTA_PER_METRE;

use crate::PostHeights;
use crate::flood::{flood, neighbours};

/// Posts that drain through a channel, at least one more.
pub const CHANNEL_POSTS: u32 = 500;
/// How deep a pit is, in metres, that counts.
pub const PIT_M: f64 = 1.0;
/// How far aside a channel is still the same one, in posts, squared.
const ASIDE_SQUARED: i32 = 4;

/// Channels and pits of both surfaces.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Drainage {
    /// Channel posts of the DEM, and how many of them the TIN has.
    #[serde(rename = "channel_posts_dem")]
    pub channels_dem: u64,
    /// Those of them with a channel of the TIN within two posts.
    #[serde(skip)]
    pub channels_found: u64,
    /// Channel posts of the TIN.
    #[serde(rename = "channel_posts_tin")]
    pub channels_tin: u64,
    /// Those of them with a channel of the DEM within two posts.
    #[serde(skip)]
    pub channels_true: u64,
    /// Pits of the DEM deeper than 1 m.
    pub pits_dem: u64,
    /// Pits of the TIN deeper than 1 m.
    pub pits_tin: u64,
    /// Those of them where the DEM has none.
    pub pits_spurious: u64,
    /// Pits of the DEM deeper than 1 m where the TIN has none.
    pub pits_missed: u64,
}

impl Drainage {
    /// Share of the DEM's channels that the TIN has; 1 without channels.
    pub fn recall(&self) -> f64 {
        share(self.channels_found, self.channels_dem)
    }

    /// Share of the TIN's channels that the DEM has; 1 without channels.
    pub fn precision(&self) -> f64 {
        share(self.channels_true, self.channels_tin)
    }
}

fn share(part: u64, whole: u64) -> f64 {
    if whole == 0 { 1.0 } else { part as f64 / whole as f64 }
}

/// Channels and pits of one surface.
#[derive(Clone, Debug)]
pub struct Streams {
    is_channel: Vec<bool>,
    /// How deep each post lies under its flood, in metres.
    depth_m: Vec<f32>,
    pits: Vec<Pit>,
}

/// One pit: its posts by index, and its depth in metres.
#[derive(Clone, Debug)]
struct Pit {
    posts: Vec<u32>,
    depth_m: f32,
}

impl Streams {
    /// Those of heights at posts.
    pub fn of(posts: &PostHeights) -> Self {
        let found = flood(posts);
        let is_channel = found.drained.iter().map(|&drained| CHANNEL_POSTS < drained).collect();
        let depth_m: Vec<f32> = found.depth.iter().map(|quanta| quanta / QUANTA_PER_METRE as f32).collect();
        let pits = pits(posts, &depth_m);
        Self { is_channel, depth_m, pits }
    }

    /// Channel posts with a channel of `other` within two posts, and all channel posts.
    fn channels_near(&self, other: &Streams, wide: usize) -> (u64, u64) {
        let (mut near, mut all) = (0, 0);
        for index in (0..self.is_channel.len()).filter(|&index| self.is_channel[index]) {
            all += 1;
            near += u64::from(other.has_channel_near(index, wide));
        }
        (near, all)
    }

    fn has_channel_near(&self, index: usize, wide: usize) -> bool {
        let (row, col) = ((index / wide) as i32, (index % wide) as i32);
        let high = (self.is_channel.len() / wide) as i32;
        (-2..=2).any(|up: i32| {
            (-2..=2).any(|right: i32| {
                let (row, col) = (row + up, col + right);
                let is_post = 0 <= row && row < high && 0 <= col && col < wide as i32;
                is_post
                    && up * up + right * right <= ASIDE_SQUARED
                    && self.is_channel[row as usize * wide + col as usize]
            })
        })
    }

    /// Pits under which `other` is nowhere flooded even half as deep.
    fn pits_alone(&self, other: &Streams) -> u64 {
        let is_alone = |pit: &&Pit| pit.posts.iter().all(|&post| other.depth_m[post as usize] < pit.depth_m / 2.0);
        self.pits.iter().filter(is_alone).count() as u64
    }
}

/// Flooded ground in one piece, where its deepest post is deep enough.
fn pits(posts: &PostHeights, depth_m: &[f32]) -> Vec<Pit> {
    let mut pits = Vec::new();
    let mut is_seen = vec![false; depth_m.len()];
    for start in 0..depth_m.len() {
        if is_seen[start] || depth_m[start] <= 0.0 {
            continue;
        }
        is_seen[start] = true;
        let mut pit = Pit { posts: vec![start as u32], depth_m: 0.0 };
        let mut next = 0;
        while let Some(&post) = pit.posts.get(next) {
            next += 1;
            pit.depth_m = pit.depth_m.max(depth_m[post as usize]);
            for (_, beside) in neighbours(posts, post as usize) {
                if !is_seen[beside] && 0.0 < depth_m[beside] {
                    is_seen[beside] = true;
                    pit.posts.push(beside as u32);
                }
            }
        }
        if PIT_M < f64::from(pit.depth_m) {
            pits.push(pit);
        }
    }
    pits
}

/// Compares the water of two surfaces over the same posts.
pub fn drainage(posts: &PostHeights, dem: &Streams, tin: &Streams) -> Drainage {
    let wide = posts.wide();
    let (channels_found, channels_dem) = dem.channels_near(tin, wide);
    let (channels_true, channels_tin) = tin.channels_near(dem, wide);
    Drainage {
        channels_dem,
        channels_found,
        channels_tin,
        channels_true,
        pits_dem: dem.pits.len() as u64,
        pits_tin: tin.pits.len() as u64,
        pits_spurious: tin.pits_alone(dem),
        pits_missed: dem.pits_alone(tin),
    }
}

#[cfg(test)]
mod tests {
    use terrain::{Dem, Post, PostRect};

    use super::*;

    fn posts(height: impl Fn(Post) -> i32) -> PostHeights {
        let dem = Dem::from_fn(PostRect::of_size(80, 120), |post| Some(height(post)));
        PostHeights::of_dem(&dem, dem.rect())
    }

    fn between(dem: &PostHeights, tin: &PostHeights) -> Drainage {
        drainage(dem, &Streams::of(dem), &Streams::of(tin))
    }

    /// A valley that falls to the west along row 40, shifted north by some rows.
    fn valley(north: i32) -> PostHeights {
        posts(move |post| 200 * (post.row - 40 - north).abs() + 10 * post.col)
    }

    #[test]
    fn the_same_ground_drains_the_same_way() {
        let found = between(&valley(0), &valley(0));
        assert_eq!((found.recall(), found.precision(), found.pits_dem, found.pits_spurious), (1.0, 1.0, 0, 0));
        // Over 500 posts come together after seven columns of 78 inner rows, down to the border.
        assert!((110..=119).contains(&found.channels_dem), "{found:?}");
    }

    #[test]
    fn a_stream_two_posts_aside_is_found_and_one_three_aside_is_lost() {
        let near = between(&valley(0), &valley(2));
        assert!(0.99 < near.recall() && 0.99 < near.precision(), "{near:?}");
        let far = between(&valley(0), &valley(3));
        assert!(far.recall() < 0.02 && far.precision() < 0.02 && 100 < far.channels_tin, "{far:?}");
        let none = between(&valley(0), &posts(|post| 100 * (post.row - 40) * (40 - post.row)));
        assert_eq!((none.recall(), none.precision(), none.channels_tin), (0.0, 1.0, 0));
    }

    #[test]
    fn a_cone_has_no_channel_and_its_mould_one_pit() {
        let cone = |sign: i32| {
            posts(move |post| {
                let away = ((post.row - 40) as f64).hypot(f64::from(post.col - 60));
                sign * (6400.0 - 128.0 * away).round() as i32
            })
        };
        let found = between(&cone(1), &cone(1));
        assert_eq!((found.channels_dem, found.pits_dem), (0, 0));
        let mould = between(&cone(1), &cone(-1));
        assert_eq!((mould.pits_dem, mould.pits_tin, mould.pits_spurious, mould.pits_missed), (0, 1, 1, 0));
        let lost = between(&cone(-1), &cone(1));
        assert_eq!((lost.pits_dem, lost.pits_tin, lost.pits_spurious, lost.pits_missed), (1, 0, 0, 1));
    }

    #[test]
    fn a_pit_is_spurious_unless_the_dem_is_half_as_deep_there_and_shallow_ones_do_not_count() {
        let holes = |deep: [i32; 3]| {
            posts(move |post| {
                let hole = (0..3).find(|&i| (post.row - 40).abs() <= 2 && (post.col - 30 - 30 * i).abs() <= 2);
                hole.map_or(0, |i| -deep[i as usize])
            })
        };
        // 1.25 m over 0.6 m, over nothing, over ground as deep; then 0.9 m over nothing.
        let found = between(&holes([80, 0, 160]), &holes([160, 160, 160]));
        assert_eq!((found.pits_tin, found.pits_spurious, found.pits_dem, found.pits_missed), (3, 1, 1, 0));
        let shallow = between(&holes([0, 0, 0]), &holes([115, 0, 129]));
        assert_eq!((shallow.pits_tin, shallow.pits_spurious), (1, 1));
    }
}
