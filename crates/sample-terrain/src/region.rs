//! The lie of the land at kilometre scale: where ranges stand, how high basins lie, where playas are.
//!
//! Evaluated on a lattice 400 m wide and interpolated, because it costs seven noises a place. Everything smaller
//! (ridges, gullies, washes) is cut into it by [`crate::drainage`].

use crate::noise::Stream;

/// Range field at which a mountain front would lie if no valley embayed it.
const FRONT: f32 = 0.14;
/// Metres of bedrock per unit of range field, deep inside a range.
const UPLIFT_M: f32 = 1_200.0;
/// Bedrock above this is pressed down, in metres, so that no range outgrows the bounds.
const KNEE_M: f32 = 700.0;
/// What it approaches above the knee, in metres.
const HEAD_M: f32 = 600.0;
/// How deep under a fan bedrock is still cut by valleys, in metres.
const BURIED_M: f32 = 130.0;
/// Metres of alluvium per squared unit of range field above [`TOE`]: the concave profile of a bajada.
const FAN_M: f32 = 150.0;
/// Range field where fans begin to rise from the basin floor.
const TOE: f32 = -0.75;

/// Direction of the ranges: the unit vector (-5, 12) / 13, north by north-west.
const TREND: (f64, f64) = (-5.0 / 13.0, 12.0 / 13.0);

/// What is known of a place before drainage is cut into it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Lie {
    /// Range field: above [`FRONT`] in ranges, below in basins.
    pub(crate) range: f32,
    /// Regional height of basin floors in metres.
    pub(crate) floor_m: f32,
    /// How deeply the washes of this part of a fan are cut, 0..1.
    pub(crate) incision: f32,
}

impl Lie {
    /// Height of the alluvial surface in metres: fans that steepen towards the ranges.
    pub(crate) fn alluvium_m(&self) -> f32 {
        let outer = (self.range.min(FRONT) - TOE).max(0.0);
        let inner = (self.range - FRONT).max(0.0);
        // Quadratic up to the front, levelling off beneath the mountains.
        self.floor_m + FAN_M * outer * (outer + 2.0 * inner / (1.0 + 1.5 * inner))
    }

    /// Bedrock above the alluvial surface in metres, before valleys are cut; below 0 in basins.
    pub(crate) fn bedrock_m(&self) -> f32 {
        let inside = self.range - FRONT;
        // Gentle near the front, so that spurs and embayments reach far; steep behind.
        let rise_m = UPLIFT_M * inside * (inside.abs() + 0.16) / (inside.abs() + 0.36);
        let over_m = (rise_m - KNEE_M).max(0.0);
        rise_m.min(KNEE_M) + over_m / (1.0 + over_m / HEAD_M)
    }

    /// How much the ground is shaped as mountains are: 1 in ranges, 0 out on the fans.
    pub(crate) fn mountain(&self) -> f32 {
        smooth((self.bedrock_m() + BURIED_M) / 190.0)
    }

    /// How much of a wash may be cut here, 0..1: most on upper fans, none on basin floors.
    pub(crate) fn wash(&self) -> f32 {
        self.incision * smooth((self.range - TOE) * (1.6 / (FRONT - TOE)))
    }

    /// The weighted sum of four.
    pub(crate) fn weighed([a, b, c, d]: [&Lie; 4], [wa, wb, wc, wd]: [f32; 4]) -> Lie {
        Lie {
            range: wa * a.range + wb * b.range + wc * c.range + wd * d.range,
            floor_m: wa * a.floor_m + wb * b.floor_m + wc * c.floor_m + wd * d.floor_m,
            incision: wa * a.incision + wb * b.incision + wc * c.incision + wd * d.incision,
        }
    }
}

/// The fields of one seed.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Region {
    bend: [Stream; 2],
    ranges: [Stream; 3],
    floor: Stream,
    incision: Stream,
}

impl Region {
    pub(crate) fn new(seed: u64) -> Self {
        let stream = |layer| Stream::new(seed, layer);
        Self {
            bend: [stream(1), stream(2)],
            ranges: [stream(3), stream(4), stream(5)],
            floor: stream(8),
            incision: stream(9),
        }
    }

    /// The lie of the land at a place, in metres from post (0, 0).
    pub(crate) fn lie(&self, east_m: f64, north_m: f64) -> Lie {
        let (bend_x, bend_y) = (east_m / 9_000.0, north_m / 9_000.0);
        let east = east_m + 1_900.0 * self.bend[0].noise(bend_x, bend_y);
        let north = north_m + 1_900.0 * self.bend[1].noise(bend_x, bend_y);
        let along = east * TREND.0 + north * TREND.1;
        let across = east * TREND.1 - north * TREND.0;
        let [block, spur, hill] = self.ranges;
        let range = 0.98 * block.noise(along / 19_000.0, across / 8_000.0)
            + 0.74 * (0.30 - crease(spur.noise(along / 8_000.0, across / 4_600.0)))
            + 0.15 * hill.noise(along / 3_300.0, across / 2_700.0);
        let floor_m = 900.0 + 140.0 * self.floor.noise(along / 42_000.0, across / 33_000.0);
        let incision = 0.5 + 0.75 * self.incision.noise(east / 2_600.0, north / 2_600.0);
        Lie { range: range as f32, floor_m: floor_m as f32, incision: incision.clamp(0.08, 1.0) as f32 }
    }

    /// Slopes east and north of the ground without drainage, over `base_m` metres on either side.
    pub(crate) fn slope(&self, east_m: f64, north_m: f64, base_m: f64) -> [f32; 2] {
        let height_m = |dx: f64, dy: f64| {
            let lie = self.lie(east_m + dx, north_m + dy);
            lie.alluvium_m() + lie.mountain() * (lie.bedrock_m() + BURIED_M)
        };
        let per_base = 0.5 / base_m as f32;
        let east = (height_m(base_m, 0.0) - height_m(-base_m, 0.0)) * per_base;
        let north = (height_m(0.0, base_m) - height_m(0.0, -base_m)) * per_base;
        [east, north]
    }
}

/// The magnitude of a noise, blunted at 0: negated it is a ridge line.
fn crease(noise: f64) -> f64 {
    (noise * noise + 0.0012).sqrt()
}

/// 0 up to 0, 1 from 1 on, smooth between.
fn smooth(t: f32) -> f32 {
    let t = t.clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}
