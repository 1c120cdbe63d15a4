//! How steeply things rise before an eye: what stays lower than the line to a place cannot hide it.
//!
//! Heights are taken less what the earth falls away at their distance. Then a line of sight over a curved earth is
//! straight, and a thing stands above it exactly where its slope from the eye is larger than that of the line.

use std::cmp::Ordering;

use crate::QUANTA_PER_METRE;

/// Quanta by which a thing must stay below a line to be left out: far more than rounding.
const MARGIN: f64 = 2.0;

/// An eye in quanta, and how many quanta the earth falls away at a quantum's distance; it falls with that squared.
#[derive(Clone, Copy)]
pub(crate) struct Vantage {
    pub place: [f64; 3],
    pub fall: f64,
}

/// The largest slope from an eye at which something over a rectangle may rise.
#[derive(Clone, Copy)]
pub(crate) struct Slope {
    rise: f32,
    /// What a quantum more of height adds to it.
    per_quantum: f32,
}

impl Vantage {
    /// The slope at which the line to a place leaves the eye.
    pub(crate) fn slope_to(&self, to: [f64; 3]) -> f64 {
        let far = (to[0] - self.place[0]).hypot(to[1] - self.place[1]);
        (to[2] - self.place[2]) / far - self.fall * far
    }

    /// How far a rectangle is from the eye, at its nearest and at its furthest.
    pub(crate) fn reach(&self, [low, high]: [[f64; 2]; 2]) -> [f64; 2] {
        let offs = [0, 1].map(|axis| [low[axis] - self.place[axis], self.place[axis] - high[axis]]);
        let near = offs.map(|[below, above]| below.max(above).max(0.0));
        let far = offs.map(|[below, above]| below.abs().max(above.abs()));
        [near[0].hypot(near[1]), far[0].hypot(far[1])]
    }

    /// The slope of what is nowhere higher than `top` between two distances.
    pub(crate) fn slope(&self, [near, far]: [f64; 2], top: f64) -> Slope {
        let up = top + MARGIN - self.place[2];
        let rise = up / if 0.0 <= up { near } else { far } - self.fall * near;
        Slope { rise: rise as f32, per_quantum: near.recip() as f32 }
    }
}

impl Slope {
    /// What rises nowhere.
    pub(crate) const NONE: Self = Self { rise: f32::NEG_INFINITY, per_quantum: 0.0 };

    /// Whether what is so many quanta higher may still rise above a line of a slope.
    pub(crate) fn may_rise(self, up: u16, line: f64) -> bool {
        let rise = self.rise + f32::from(up) * self.per_quantum;
        // What is no number may.
        f64::from(rise).partial_cmp(&line) != Some(Ordering::Less)
    }

    /// The larger of two.
    pub(crate) fn max(self, other: Self) -> Self {
        Self { rise: self.rise.max(other.rise), per_quantum: self.per_quantum.max(other.per_quantum) }
    }
}

/// Directions around an eye that are told apart.
const SECTORS: usize = 2048;
/// Rings around an eye that are told apart, at most.
const RINGS: f64 = 256.0;
/// Quanta across a ring, at least.
const WIDTH_MIN: f64 = 25.0 * QUANTA_PER_METRE as f64;

/// How far lines of sight from an eye stay above everything, by their slope: told from the end of the first ring, since
/// all directions meet inside.
#[derive(Clone)]
pub(crate) struct Horizon {
    vantage: Vantage,
    /// Quanta across a ring.
    width: f64,
    rings: usize,
    /// Of each sector, ring by ring from the second, the largest slope of what stands in it or nearer.
    rises: Vec<f32>,
}

impl Horizon {
    /// Nothing yet, within so many quanta.
    pub(crate) fn new(vantage: Vantage, range: f64) -> Self {
        let width = (range / RINGS).max(WIDTH_MIN);
        let rings = (range / width).max(0.0) as usize;
        Self { vantage, width, rings, rises: vec![f32::NEG_INFINITY; SECTORS * rings] }
    }

    /// The end of the first ring.
    pub(crate) fn begin(&self) -> f64 {
        self.width
    }

    /// The end of the last ring.
    pub(crate) fn end(&self) -> f64 {
        self.width * (self.rings + 1) as f64
    }

    /// Lets something stand over a rectangle, nowhere higher than `top`.
    pub(crate) fn add(&mut self, rectangle: [[f64; 2]; 2], top: i32) {
        if top == i32::MIN {
            return;
        }
        let [near, far] = self.vantage.reach(rectangle);
        let first = near.max(self.width);
        let rings = (first / self.width) as usize - 1..self.rings.min((far / self.width) as usize);
        if rings.is_empty() {
            return;
        }
        let rise = self.vantage.slope([first, far.max(first)], f64::from(top)).rise;
        // All around where the eye stands in it.
        let mut sectors = 0..=SECTORS - 1;
        if 0.0 < near {
            let [low, high] = rectangle;
            let turns = [low, [high[0], low[1]], high, [low[0], high[1]]].map(|corner| self.turn(corner));
            // Less than half a turn from one of them.
            let off =
                turns.map(|turn| (turn - turns[0] + 1.5 * SECTORS as f64) % SECTORS as f64 - SECTORS as f64 / 2.0);
            let [right, left] = [off.iter().fold(0.0, |a, b| b.min(a)), off.iter().fold(0.0, |a, b| b.max(a))];
            let right = turns[0] + right - ROUNDING + SECTORS as f64;
            sectors = right as usize..=(turns[0] + left + ROUNDING + SECTORS as f64) as usize;
        }
        for sector in sectors {
            let row = &mut self.rises[sector % SECTORS * self.rings..][..self.rings];
            row[rings.clone()].iter_mut().for_each(|highest| *highest = highest.max(rise));
        }
    }

    /// The same, in which what stands nearer counts for all that is further away; nothing is added from here on.
    pub(crate) fn closed(mut self) -> Self {
        for sector in self.rises.chunks_mut(self.rings.max(1)) {
            let mut highest = f32::NEG_INFINITY;
            for rise in sector {
                highest = highest.max(*rise);
                *rise = highest;
            }
        }
        self
    }

    /// How far the line to a place stays above everything, from the end of the first ring.
    pub(crate) fn clear_to(&self, to: [f64; 3]) -> f64 {
        let slope = self.vantage.slope_to(to);
        let sector = self.turn([to[0], to[1]]) as usize % SECTORS;
        let sector = &self.rises[sector * self.rings..][..self.rings];
        let clear = sector.partition_point(|&rise| f64::from(rise) < slope);
        self.width * (clear + 1) as f64
    }

    /// The direction of a place among the sectors, which grows with its angle: along the sides of a square, so that no
    /// angle is computed.
    fn turn(&self, place: [f64; 2]) -> f64 {
        let [east, north] = [0, 1].map(|axis| place[axis] - self.vantage.place[axis]);
        let share = north / (east.abs() + north.abs());
        let quarters = match (0.0 <= east, 0.0 <= north) {
            (true, true) => share,
            (false, _) => 2.0 - share,
            (true, false) => 4.0 + share,
        };
        quarters * SECTORS as f64 / 4.0
    }
}

/// Sectors by which a direction may be off.
const ROUNDING: f64 = 1e-6;
