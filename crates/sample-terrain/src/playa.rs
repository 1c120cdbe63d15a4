//! Playas: the dead flat floors of closed basins.

use crate::drainage::Posts;
use crate::noise::Stream;
use crate::region::Region;

/// One playa is looked for in every cell of this many metres.
const CELL_M: f64 = 12_000.0;
/// How far from where the search began a playa's middle may be, in metres.
const SEARCH_M: f64 = 9_000.0;
/// How far a playa may stretch from its middle, in metres: the radius that holds the highest level is taken.
const RADII_M: [f64; 3] = [1_500.0, 3_000.0, 4_500.0];
/// The largest of them.
pub(crate) const RADIUS_M_MAX: f64 = 4_500.0;
/// Part of the radius out to which the level is flat.
const FLAT: f64 = 0.8;
/// Fall of the level beyond, in metres per metre, so that where a wash leaves the basin there is no cliff.
const BANK: f64 = 0.05;
/// Metres of sediment above the lowest place.
const DEPTH_M: f64 = 14.0;

/// A flat surface; the ground is nowhere below it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Playa {
    /// Search cell, east and north, that it was found from.
    pub(crate) cell: (i64, i64),
    /// Its lowest ground, in metres east and north.
    pub(crate) middle: (f64, f64),
    /// How far it may stretch.
    pub(crate) radius_m: f64,
    /// Its height.
    pub(crate) level_m: f64,
}

impl Playa {
    /// The playa of one search cell: at the bottom of the closed basin the cell's ground drains to, if it is near.
    pub(crate) fn find(region: &Region, stream: Stream, (east, north): (i64, i64)) -> Option<Self> {
        let (right, up) = stream.pair(east, north);
        let start = ((east as f64 + 0.5 + 0.5 * right) * CELL_M, (north as f64 + 0.5 + 0.5 * up) * CELL_M);
        let height_m = |east_m, north_m| f64::from(region.lie(east_m, north_m).alluvium_m());
        let (mut middle, mut lowest_m) = (start, height_m(start.0, start.1));
        let mut step_m = 1_600.0;
        while 50.0 < step_m {
            let before = lowest_m;
            let centre = middle;
            for (dx, dy) in ring(8) {
                let place = (centre.0 + dx * step_m, centre.1 + dy * step_m);
                let level_m = height_m(place.0, place.1);
                if level_m < lowest_m {
                    (middle, lowest_m) = (place, level_m);
                }
            }
            let (dx, dy) = (middle.0 - start.0, middle.1 - start.1);
            if SEARCH_M * SEARCH_M < dx * dx + dy * dy {
                return None;
            }
            if before <= lowest_m {
                step_m *= 0.5;
            }
        }
        // Ground all round is higher than the level, so the playa ends within its radius by itself.
        let level_m = |radius_m: f64| {
            let rim = ring(32).map(|(dx, dy)| height_m(middle.0 + dx * radius_m, middle.1 + dy * radius_m));
            (rim.fold(lowest_m + DEPTH_M, f64::min) - 1.0).floor()
        };
        let playas = RADII_M.map(|radius_m| Self { cell: (east, north), middle, radius_m, level_m: level_m(radius_m) });
        let best = playas.into_iter().reduce(|best, next| if best.level_m < next.level_m { next } else { best });
        best.filter(|playa| lowest_m + 1.0 < playa.level_m)
    }

    /// The playas that matter in a square of ground, in order of their search cells.
    pub(crate) fn around(seed: u64, region: &Region, corner_m: (f64, f64), size_m: (f64, f64)) -> Vec<Self> {
        let stream = Self::stream(seed);
        Self::cells(corner_m, size_m, 0.0).filter_map(|cell| Self::find(region, stream, cell)).collect()
    }

    /// The numbers that searches begin with.
    pub(crate) fn stream(seed: u64) -> Stream {
        Stream::new(seed, 50)
    }

    /// Search cells of playas that may come within `beyond_m` metres of a rectangle of ground.
    pub(crate) fn cells(corner_m: (f64, f64), size_m: (f64, f64), beyond_m: f64) -> impl Iterator<Item = (i64, i64)> {
        let cells = move |from_m: f64, size_m: f64| {
            let margin_m = SEARCH_M + RADIUS_M_MAX + beyond_m;
            ((from_m - margin_m) / CELL_M).floor() as i64..=((from_m + size_m + margin_m) / CELL_M).floor() as i64
        };
        cells(corner_m.1, size_m.1).flat_map(move |north| cells(corner_m.0, size_m.0).map(move |east| (east, north)))
    }

    /// Whether any of a square of ground lies within the playa's reach.
    pub(crate) fn touches(&self, corner_m: (f64, f64), side_m: f64) -> bool {
        let beyond = |place: f64, from: f64| (from - place).max(place - from - side_m).max(0.0);
        let (dx, dy) = (beyond(self.middle.0, corner_m.0), beyond(self.middle.1, corner_m.1));
        dx * dx + dy * dy < self.radius_m * self.radius_m
    }

    /// How far in metres its level is flat, from its middle.
    pub(crate) fn flat_m(&self) -> f64 {
        FLAT * self.radius_m
    }

    /// Whether a place in metres lies where the level is flat.
    pub(crate) fn is_near(&self, [east_m, north_m]: [f64; 2]) -> bool {
        let (dx, dy) = (east_m - self.middle.0, north_m - self.middle.1);
        dx * dx + dy * dy <= self.flat_m() * self.flat_m()
    }

    /// Raises the heights of a patch to the playa's level where they are lower.
    pub(crate) fn fill(&self, corner_m: (f64, f64), posts: Posts<'_>, heights_m: &mut [f32]) {
        for (row, &north_m) in heights_m.chunks_mut(posts.east_m.len()).zip(posts.north_m) {
            let dy = corner_m.1 + f64::from(north_m) - self.middle.1;
            for (height_m, &east_m) in row.iter_mut().zip(posts.east_m) {
                let dx = corner_m.0 + f64::from(east_m) - self.middle.0;
                let away2 = dx * dx + dy * dy;
                if away2 <= self.radius_m * self.radius_m {
                    let beyond_m = (away2.sqrt() - FLAT * self.radius_m).max(0.0);
                    *height_m = height_m.max((self.level_m - BANK * beyond_m) as f32);
                }
            }
        }
    }
}

/// `count` places on the unit circle, from a rational parametrisation: evenly enough spread for a search.
fn ring(count: u32) -> impl Iterator<Item = (f64, f64)> {
    (0..count).map(move |place| {
        let quarter = f64::from(place * 4 % count) / f64::from(count);
        let t = quarter * (0.83 + 0.17 * quarter);
        let (x, y) = ((1.0 - t * t) / (1.0 + t * t), 2.0 * t / (1.0 + t * t));
        match place * 4 / count {
            0 => (x, y),
            1 => (-y, x),
            2 => (-x, -y),
            _ => (y, -x),
        }
    })
}
