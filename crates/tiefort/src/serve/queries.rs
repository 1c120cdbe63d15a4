//! Heights and lines of sight: positions in, numbers out, as JSON or as little-endian 64-bit floats.
//!
//! JSON has finite numbers only, and `null` where there is no answer. Among raw numbers a position that is not a
//! number, infinite or outside the area is answered with NaN, as the reader's own functions do.

use load_module_reader::{Curvature, Hider, LoadedGround, PastObjects, Sight, Standing, Top};
use serde::{Deserialize, Deserializer, Serialize};

use super::body::Received;
use super::refusal::Refusal;
use super::snapshot::Snapshot;
use crate::places;

/// Heights that are asked for, and which; behind the question mark of raw numbers no positions.
#[derive(Clone, Debug, Deserialize, PartialEq)]
#[serde(default, deny_unknown_fields)]
pub struct HeightsAsked {
    positions: Option<Vec<[f64; 2]>>,
    level: u16,
    ceiling: Option<f64>,
    /// Of which the tops are meant, and not the ground.
    #[serde(deserialize_with = "standing")]
    objects: Standing,
}

/// Lines of sight that are asked for, and how they are looked along; behind the question mark of raw numbers no lines.
#[derive(Debug, Deserialize, PartialEq)]
#[serde(default, deny_unknown_fields)]
pub struct Looking {
    lines: Option<Vec<[f64; 6]>>,
    level: u16,
    /// Which objects are looked at.
    #[serde(deserialize_with = "standing")]
    objects: Standing,
    /// Whether heights of both ends are metres above the ground.
    above_ground: bool,
    /// Whether the earth falls away as it does.
    curvature: bool,
}

impl Default for HeightsAsked {
    fn default() -> Self {
        Self { positions: None, level: 0, ceiling: None, objects: Standing::None }
    }
}

impl Default for Looking {
    fn default() -> Self {
        Self { lines: None, level: 0, objects: Standing::All, above_ground: false, curvature: false }
    }
}

/// Reads which objects are looked at.
pub fn standing<'a, D: Deserializer<'a>>(words: D) -> Result<Standing, D::Error> {
    places::standing(&String::deserialize(words)?).map_err(serde::de::Error::custom)
}

/// The earth that is looked along, as `--curvature` of the commands has it.
pub fn earth(is_round: bool) -> Curvature {
    if is_round { Curvature::of_earth(places::REFRACTION) } else { Curvature::NONE }
}

/// Refuses what would be overlooked: JSON says what stands behind the question mark of raw numbers itself.
fn refuse_beside_json<T: Default + PartialEq>(query: &T) -> Result<(), Refusal> {
    if *query == T::default() {
        return Ok(());
    }
    Err(Refusal::request(
        "found a level or more behind the question mark, expected it in the JSON",
        r#"as {"positions": [[EAST, NORTH]], "level": 1}; behind the question mark it goes with raw numbers"#,
    ))
}

#[derive(Serialize)]
struct HeightsAnswer {
    heights: Vec<Option<f64>>,
    /// What each belongs to, where objects were asked for.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    top_of: Vec<Option<&'static str>>,
}

#[derive(Serialize)]
struct LinesAnswer {
    lines: Vec<LineAnswer>,
}

/// What is said of one line.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
struct LineAnswer {
    /// Whether its end is seen from its beginning; unknown where it leaves the area.
    visible: Option<bool>,
    /// Share of the line at which it ends: at something, or in woods that leave too little light.
    blocked_at: Option<f64>,
    /// East, north and height there.
    blocker: Option<[f64; 3]>,
    /// What it ends at.
    #[serde(serialize_with = "in_a_word")]
    hidden_by: Option<Hider>,
    /// How far it stays above the ground at least.
    clearance_m: Option<f64>,
    /// The share of light that woods leave, and metres inside them.
    transmission: Option<f64>,
    wood_m: Option<f64>,
    /// East, north and height of both ends, where they were asked for above the ground.
    #[serde(skip_serializing_if = "Option::is_none")]
    ends: Option<[[f64; 3]; 2]>,
}

fn in_a_word<S: serde::Serializer>(hider: &Option<Hider>, to: S) -> Result<S::Ok, S::Error> {
    hider.map(Hider::name).serialize(to)
}

/// What was asked of heights.
pub struct Heights {
    positions: Vec<[f64; 2]>,
    asked: HeightsAsked,
    is_raw: bool,
}

/// The highest of ground, decks and roofs at a place, and of crowns where all objects are looked at.
pub fn top(ground: &LoadedGround, place_m: [f64; 2], objects: Standing) -> Option<Top> {
    let top = ground.top(place_m)?;
    let is_crown = matches!(top.of, Hider::Wood | Hider::Row);
    let roof_m = (objects == Standing::Buildings && is_crown).then(|| ground.roof_m(place_m)).flatten();
    // Below a crown stands what is as high as the roof there.
    let of = |height_m: f64| if ground.height_m(place_m) == Some(height_m) { Hider::Ground } else { Hider::Building };
    Some(roof_m.map_or(top, |height_m| Top { height_m, of: of(height_m) }))
}

impl Heights {
    /// What a body asks for.
    ///
    /// # Errors
    /// When it cannot be read.
    pub fn of(body: &Received, query: HeightsAsked) -> Result<Self, Refusal> {
        let expected = r#"{"positions": [[EAST, NORTH], …], "level": 0, "ceiling": HEIGHT}"#;
        let (positions, asked, is_raw) = if body.is_raw() {
            (Some(body.numbers()?), query, true)
        } else {
            refuse_beside_json(&query)?;
            let mut asked: HeightsAsked = body.json(expected)?;
            (asked.positions.take(), asked, false)
        };
        if asked.ceiling.is_some() && asked.objects != Standing::None {
            let error = "found objects and a ceiling, expected one of them";
            return Err(Refusal::request(error, "with a ceiling heights are of ground and decks"));
        }
        let missing = || Refusal::request(format!("found no positions, expected {expected}"), "/docs shows an example");
        Ok(Self { positions: positions.ok_or_else(missing)?, asked, is_raw })
    }

    /// The answer in the bytes of its kind.
    ///
    /// # Errors
    /// When a file cannot be read.
    pub fn answer(&self, snapshot: &Snapshot) -> Result<Vec<u8>, Refusal> {
        let HeightsAsked { level, ceiling, objects, .. } = self.asked;
        let mut heights = vec![f64::NAN; self.positions.len()];
        let mut top_of = vec![None; if objects == Standing::None { 0 } else { heights.len() }];
        snapshot.ground.under(&snapshot.contents, level, &self.positions, |ground, indices| {
            let mut found = vec![f64::NAN; indices.len()];
            let places = indices.iter().map(|&index| self.positions[index]);
            match (ceiling, objects) {
                (None, Standing::None) => ground.heights_m(&places.collect::<Vec<_>>(), &mut found),
                (Some(ceiling), _) => {
                    let places = places.map(|[east, north]| [east, north, ceiling]);
                    ground.heights_below_m(&places.collect::<Vec<_>>(), &mut found);
                }
                (None, objects) => {
                    for ((&index, place), found) in indices.iter().zip(places).zip(&mut found) {
                        let Some(top) = top(ground, place, objects) else { continue };
                        (*found, top_of[index]) = (top.height_m, Some(top.of.name()));
                    }
                }
            }
            indices.iter().zip(found).for_each(|(&index, height)| heights[index] = height);
        })?;
        if self.is_raw {
            return Ok(heights.into_iter().flat_map(f64::to_le_bytes).collect());
        }
        json(&HeightsAnswer { heights: heights.into_iter().map(finite).collect(), top_of })
    }
}

/// What was asked of lines of sight.
pub struct Lines {
    lines: Vec<[f64; 6]>,
    looking: Looking,
    is_raw: bool,
}

impl Lines {
    /// What a body asks for.
    ///
    /// # Errors
    /// When it cannot be read.
    pub fn of(body: &Received, query: Looking) -> Result<Self, Refusal> {
        if body.is_raw() {
            return Ok(Self { lines: body.numbers()?, looking: query, is_raw: true });
        }
        refuse_beside_json(&query)?;
        let expected = r#"{"lines": [[EAST, NORTH, HEIGHT, EAST, NORTH, HEIGHT], …], "objects": "all"}"#;
        let mut looking: Looking = body.json(expected)?;
        let lines = looking.lines.take();
        let missing = || Refusal::request(format!("found no lines, expected {expected}"), "/docs shows an example");
        Ok(Self { lines: lines.ok_or_else(missing)?, looking, is_raw: false })
    }

    /// The answer in the bytes of its kind.
    ///
    /// # Errors
    /// When a line is too long, or a file cannot be read.
    pub fn answer(&self, snapshot: &Snapshot) -> Result<Vec<u8>, Refusal> {
        let level = self.looking.level;
        let mut answers = Vec::with_capacity(self.lines.len());
        // Ground under all lines at once, where that is not too much; else line by line.
        let mut held = self
            .around_all(snapshot)
            .and_then(|ends| snapshot.ground.around(&snapshot.contents, level, ends, None).ok());
        for &[from_east, from_north, from_height, to_east, to_north, to_height] in &self.lines {
            // It begins outside: there is nothing to look at.
            if snapshot.contents.frame.module_under([from_east, from_north]).is_none() {
                answers.push(LineAnswer::default());
                continue;
            }
            let ends = [[from_east, from_north], [to_east, to_north]];
            let ground = snapshot.ground.around(&snapshot.contents, level, ends, held.take())?;
            let ends = [[from_east, from_north, from_height], [to_east, to_north, to_height]];
            answers.push(self.looking.along(&ground, ends));
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

impl Looking {
    /// What is said of a line.
    fn along(&self, ground: &LoadedGround, ends: [[f64; 3]; 2]) -> LineAnswer {
        let stands = |[east, north, above]: [f64; 3]| Some([east, north, ground.height_m([east, north])? + above]);
        let stand = |ends: [[f64; 3]; 2]| Some([stands(ends[0])?, stands(ends[1])?]);
        let Some([from, to]) = (if self.above_ground { stand(ends) } else { Some(ends) }) else {
            return LineAnswer::default();
        };
        let curvature = earth(self.curvature);
        let past = PastObjects { standing: self.objects, ..PastObjects::all(curvature) };
        let sighting = ground.sight_past(from, to, &past);
        let (visible, blocked_at) = match sighting.sight {
            Sight::Free => (Some(true), None),
            Sight::Hidden(share) => (Some(false), Some(share)),
            Sight::Unknown => (None, None),
        };
        let place = |share: f64| [0, 1, 2].map(|axis| from[axis] + share * (to[axis] - from[axis]));
        let is_known = visible.is_some();
        LineAnswer {
            visible,
            blocked_at,
            blocker: blocked_at.map(place),
            hidden_by: sighting.by.filter(|_| blocked_at.is_some()),
            clearance_m: ground.clearance_over_m(from, to, curvature).and_then(finite),
            transmission: is_known.then_some(sighting.transmission),
            wood_m: is_known.then_some(sighting.wood_m),
            ends: self.above_ground.then_some([from, to]),
        }
    }
}

impl LineAnswer {
    /// 1 where it is visible and 0 where not; the share of the line at which it is blocked; the clearance in metres;
    /// what it ends at, as a number from 0; the share of light that woods leave.
    fn numbers(&self) -> [f64; 5] {
        let visible = self.visible.map(|visible| f64::from(u8::from(visible)));
        let hider = self.hidden_by.map(|hider| f64::from(hider as u8));
        [visible, self.blocked_at, self.clearance_m, hider, self.transmission].map(|one| one.unwrap_or(f64::NAN))
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
