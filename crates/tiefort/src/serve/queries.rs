//! Heights and lines of sight: positions in, numbers out, as JSON or as little-endian 64-bit floats.
//!
//! JSON has finite numbers only, and `null` where there is no answer. Among raw numbers a position that is not a
//! number, infinite or outside the area is answered with NaN, as the reader's own functions do.

use load_module_reader::Sight;
use serde::{Deserialize, Serialize};

use super::body::Received;
use super::refusal::Refusal;
use super::snapshot::Snapshot;

/// What may stand behind the question mark of a raw request.
#[derive(Clone, Copy, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RawQuery {
    #[serde(default)]
    pub level: u16,
    pub ceiling: Option<f64>,
}

impl RawQuery {
    /// Refuses what would be overlooked: JSON says these things itself.
    fn refuse_beside_json(self) -> Result<(), Refusal> {
        match (self.level, self.ceiling) {
            (0, None) => Ok(()),
            _ => Err(Refusal::request(
                "found level or ceiling behind the question mark, expected them in the JSON",
                r#"as {"positions": [[EAST, NORTH]], "level": 1}; behind the question mark they go with raw numbers"#,
            )),
        }
    }
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct HeightsAsked {
    positions: Vec<[f64; 2]>,
    #[serde(default)]
    level: u16,
    ceiling: Option<f64>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct LinesAsked {
    lines: Vec<[f64; 6]>,
    #[serde(default)]
    level: u16,
}

#[derive(Serialize)]
struct HeightsAnswer {
    heights: Vec<Option<f64>>,
}

#[derive(Serialize)]
struct LinesAnswer {
    lines: Vec<LineAnswer>,
}

/// What is said of one line.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
struct LineAnswer {
    /// Whether its end is seen from its beginning; unknown where it leaves the area.
    visible: Option<bool>,
    /// Share of the line at which something first stands in its way.
    blocked_at: Option<f64>,
    /// East, north and height there.
    blocker: Option<[f64; 3]>,
    /// How far it stays above the ground at least.
    clearance_m: Option<f64>,
}

/// What was asked of heights.
pub struct Heights {
    positions: Vec<[f64; 2]>,
    level: u16,
    ceiling: Option<f64>,
    is_raw: bool,
}

impl Heights {
    /// What a body asks for.
    ///
    /// # Errors
    /// When it cannot be read.
    pub fn of(body: &Received, query: RawQuery) -> Result<Self, Refusal> {
        if body.is_raw() {
            let RawQuery { level, ceiling } = query;
            return Ok(Self { positions: body.numbers()?, level, ceiling, is_raw: true });
        }
        query.refuse_beside_json()?;
        let HeightsAsked { positions, level, ceiling } =
            body.json(r#"{"positions": [[EAST, NORTH], …], "level": 0, "ceiling": HEIGHT}"#)?;
        Ok(Self { positions, level, ceiling, is_raw: false })
    }

    /// The answer in the bytes of its kind.
    ///
    /// # Errors
    /// When a file cannot be read.
    pub fn answer(&self, snapshot: &Snapshot) -> Result<Vec<u8>, Refusal> {
        let mut heights = vec![f64::NAN; self.positions.len()];
        snapshot.ground.under(&snapshot.contents, self.level, &self.positions, |ground, indices| {
            let mut found = vec![f64::NAN; indices.len()];
            match self.ceiling {
                None => {
                    let places: Vec<[f64; 2]> = indices.iter().map(|&index| self.positions[index]).collect();
                    ground.heights_m(&places, &mut found);
                }
                Some(ceiling) => {
                    let place = |&index: &usize| [self.positions[index][0], self.positions[index][1], ceiling];
                    ground.heights_below_m(&indices.iter().map(place).collect::<Vec<_>>(), &mut found);
                }
            }
            indices.iter().zip(found).for_each(|(&index, height)| heights[index] = height);
        })?;
        if self.is_raw {
            return Ok(heights.into_iter().flat_map(f64::to_le_bytes).collect());
        }
        json(&HeightsAnswer { heights: heights.into_iter().map(finite).collect() })
    }
}

/// What was asked of lines of sight.
pub struct Lines {
    lines: Vec<[f64; 6]>,
    level: u16,
    is_raw: bool,
}

impl Lines {
    /// What a body asks for.
    ///
    /// # Errors
    /// When it cannot be read.
    pub fn of(body: &Received, query: RawQuery) -> Result<Self, Refusal> {
        if query.ceiling.is_some() {
            return Err(Refusal::request("found ceiling with lines of sight, expected none", "only heights have one"));
        }
        if body.is_raw() {
            return Ok(Self { lines: body.numbers()?, level: query.level, is_raw: true });
        }
        query.refuse_beside_json()?;
        let LinesAsked { lines, level } =
            body.json(r#"{"lines": [[EAST, NORTH, HEIGHT, EAST, NORTH, HEIGHT], …], "level": 0}"#)?;
        Ok(Self { lines, level, is_raw: false })
    }

    /// The answer in the bytes of its kind.
    ///
    /// # Errors
    /// When a line is too long, or a file cannot be read.
    pub fn answer(&self, snapshot: &Snapshot) -> Result<Vec<u8>, Refusal> {
        let mut answers = Vec::with_capacity(self.lines.len());
        // Ground under all lines at once, where that is not too much; else line by line.
        let mut held = self
            .around_all(snapshot)
            .and_then(|ends| snapshot.ground.around(&snapshot.contents, self.level, ends, None).ok());
        for &[from_east, from_north, from_height, to_east, to_north, to_height] in &self.lines {
            let (from, to) = ([from_east, from_north, from_height], [to_east, to_north, to_height]);
            // It begins outside: there is nothing to look at.
            if snapshot.contents.frame.module_under([from_east, from_north]).is_none() {
                answers.push(LineAnswer { visible: None, blocked_at: None, blocker: None, clearance_m: None });
                continue;
            }
            let ends = [[from_east, from_north], [to_east, to_north]];
            let ground = snapshot.ground.around(&snapshot.contents, self.level, ends, held.take())?;
            let (visible, blocked_at) = match ground.sight(from, to) {
                Sight::Free => (Some(true), None),
                Sight::Hidden(share) => (Some(false), Some(share)),
                Sight::Unknown => (None, None),
            };
            let along = |share: f64| [0, 1, 2].map(|axis| from[axis] + share * (to[axis] - from[axis]));
            let clearance_m = ground.clearance_m(from, to).and_then(finite);
            answers.push(LineAnswer { visible, blocked_at, blocker: blocked_at.map(along), clearance_m });
            held = Some(ground);
        }
        if self.is_raw {
            return Ok(answers.iter().flat_map(LineAnswer::numbers).flat_map(f64::to_le_bytes).collect());
        }
        json(&LinesAnswer { lines: answers })
    }

    /// South-west and north-east corner of the rectangle around all lines that begin in the area.
    fn around_all(&self, snapshot: &Snapshot) -> Option<[[f64; 2]; 2]> {
        let inside =
            self.lines.iter().filter(|line| snapshot.contents.frame.module_under([line[0], line[1]]).is_some());
        inside.flat_map(|line| [[line[0], line[1]], [line[3], line[4]]]).fold(None, |around, [east, north]| {
            let [low, high] = around.unwrap_or([[f64::INFINITY; 2], [f64::NEG_INFINITY; 2]]);
            Some([[low[0].min(east), low[1].min(north)], [high[0].max(east), high[1].max(north)]])
        })
    }
}

impl LineAnswer {
    /// 1 where it is visible and 0 where not; the share of the line at which it is blocked; the clearance in metres.
    fn numbers(&self) -> [f64; 3] {
        let visible = self.visible.map_or(f64::NAN, |visible| f64::from(u8::from(visible)));
        [visible, self.blocked_at.unwrap_or(f64::NAN), self.clearance_m.unwrap_or(f64::NAN)]
    }
}

fn finite(number: f64) -> Option<f64> {
    number.is_finite().then_some(number)
}

fn json(answer: &impl Serialize) -> Result<Vec<u8>, Refusal> {
    let mut bytes = serde_json::to_vec(answer).map_err(|_| Refusal::fault())?;
    bytes.push(b'\n');
    Ok(bytes)
}
