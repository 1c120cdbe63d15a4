//! What is seen around a place, heights along a line, and what a vehicle hits: asked by address, one at a time.

use load_module_reader::{Look, Obstacle, ProfilePoint, Standing, Viewshed};
use serde::Deserialize;
use serde_json::{Value, json};

use super::queries::{earth, standing, top};
use super::refusal::Refusal;
use super::snapshot::Snapshot;
use crate::places;

/// Places along a side of a viewshed at most: a minute's work.
const SIDE_MAX: u64 = 2049;
/// Heights of a profile at most.
const STEPS_MAX: f64 = 20_000.0;

/// Metres around a vehicle at most.
const RADIUS_M_MAX: f64 = 1000.0;

/// A viewshed that is asked for.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ViewshedAsked {
    /// `EAST,NORTH,ABOVE` of the eye.
    from: String,
    range_m: f64,
    #[serde(default)]
    target_m: f64,
    #[serde(default = "spacing_m")]
    spacing_m: f64,
    #[serde(default)]
    level: u16,
    #[serde(default = "all", deserialize_with = "standing")]
    objects: Standing,
    #[serde(default)]
    curvature: bool,
    #[serde(default)]
    target_on: TargetOn,
}

/// What the places that are looked at stand on.
#[derive(Clone, Copy, Debug, Default, Deserialize, PartialEq)]
#[serde(rename_all = "lowercase")]
enum TargetOn {
    #[default]
    Ground,
    Roof,
}

/// A profile that is asked for.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ProfileAsked {
    /// `EAST,NORTH` of both ends.
    from: String,
    to: String,
    #[serde(default = "spacing_m")]
    spacing_m: f64,
    #[serde(default)]
    level: u16,
    /// Of which the tops are told, too.
    #[serde(default = "none", deserialize_with = "standing")]
    objects: Standing,
}

/// What a vehicle hits, that is asked for.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ObstacleAsked {
    /// `EAST,NORTH,ABOVE` of its wheels.
    at: String,
    radius_m: f64,
}

fn spacing_m() -> f64 {
    25.0
}

fn all() -> Standing {
    Standing::All
}

fn none() -> Standing {
    Standing::None
}

fn refused(what: &str, why: String) -> Refusal {
    Refusal::request(format!("found {what}: {why}"), "/docs shows an example")
}

/// A place of the area that was asked for.
fn inside(snapshot: &Snapshot, name: &str, place_m: [f64; 2]) -> Result<[f64; 2], Refusal> {
    if snapshot.contents.frame.holds(place_m) {
        return Ok(place_m);
    }
    let outside = places::outside(name, place_m, &snapshot.contents.frame);
    Err(Refusal::request(outside.message(), outside.hint()))
}

/// A number above 0.
fn positive(name: &str, number: f64) -> Result<f64, Refusal> {
    if 0.0 < number && number.is_finite() { Ok(number) } else { Err(above(name, number, "above 0")) }
}

fn above(name: &str, number: f64, expected: &str) -> Refusal {
    Refusal::request(format!("found {name}={number}, expected a number {expected}"), "it is in metres")
}

impl ViewshedAsked {
    /// Places along a side (u32), metres between them (f32), then row by row from the north 1 seen, 0 hidden, 255
    /// neither (u8); and in the same way per cent of the light that is left, 255 where not looked at.
    ///
    /// # Errors
    /// When it is too large, or a file cannot be read.
    pub fn answer(&self, snapshot: &Snapshot) -> Result<Vec<u8>, Refusal> {
        let [east, north, eye_m] = places::place_above(&self.from).map_err(|why| refused("from", why))?;
        let place_m = inside(snapshot, "from", [east, north])?;
        let (range_m, spacing_m) = (positive("range_m", self.range_m)?, positive("spacing_m", self.spacing_m)?);
        if !(0.0..f64::INFINITY).contains(&self.target_m) {
            return Err(above("target_m", self.target_m, "from 0"));
        }
        let (curvature, standing) = (earth(self.curvature), self.objects);
        let viewshed = Viewshed {
            place_m,
            eye_m,
            target_m: self.target_m,
            range_m,
            spacing_m,
            curvature,
            standing,
            is_on_roofs: self.target_on == TargetOn::Roof,
        };
        let side = viewshed.side();
        if SIDE_MAX < side {
            let error = format!("found {side} places along a side, expected {SIDE_MAX} at most");
            return Err(Refusal::request(error, "ask for a larger spacing_m or a smaller range_m"));
        }
        let ends = [-range_m, range_m].map(|reach| place_m.map(|middle| middle + reach));
        let ground = snapshot.ground.around(&snapshot.contents, self.level, ends, None)?;
        let mut eye = viewshed.eye(&ground).ok_or_else(|| refused("from", "a place without ground".into()))?;
        let mut out: Vec<u8> = (side as u32).to_le_bytes().to_vec();
        out.extend((spacing_m as f32).to_le_bytes());
        let looks: Vec<Look> = (0..side).flat_map(|row| viewshed.row(&ground, &mut eye, row)).collect();
        out.extend(looks.iter().map(|look| look.seen).chain(looks.iter().map(|look| look.light)));
        Ok(out)
    }
}

impl ProfileAsked {
    /// Metres along the line and heights there.
    ///
    /// # Errors
    /// When it has too many, or a file cannot be read.
    pub fn answer(&self, snapshot: &Snapshot) -> Result<Value, Refusal> {
        let end =
            |name: &str, text: &str| inside(snapshot, name, places::place(text).map_err(|why| refused(name, why))?);
        let ends_m = [end("from", &self.from)?, end("to", &self.to)?];
        let spacing_m = positive("spacing_m", self.spacing_m)?;
        let steps = (ends_m[1][0] - ends_m[0][0]).hypot(ends_m[1][1] - ends_m[0][1]) / spacing_m;
        if STEPS_MAX < steps {
            let error = format!("found {steps:.0} steps along the line, expected {STEPS_MAX} at most");
            return Err(Refusal::request(error, "ask for a larger spacing_m"));
        }
        let ground = snapshot.ground.around(&snapshot.contents, self.level, ends_m, None)?;
        let points = ground.profile(&ends_m, spacing_m);
        let all = |of: fn(&ProfilePoint) -> Option<f64>| points.iter().map(of).collect::<Vec<_>>();
        let mut answer =
            json!({ "along_m": all(|point| Some(point.along_m)), "height_m": all(|point| point.height_m) });
        if self.objects != Standing::None {
            let tops: Vec<_> = points.iter().map(|point| top(&ground, point.place_m, self.objects)).collect();
            answer["top_m"] = tops.iter().map(|top| top.map(|top| top.height_m)).collect();
            answer["top_of"] = tops.iter().map(|top| top.map(|top| top.of.name())).collect();
        }
        Ok(answer)
    }
}

impl ObstacleAsked {
    /// What is hit; `null` where the way is free.
    ///
    /// # Errors
    /// When the place lies outside, or a file cannot be read.
    pub fn answer(&self, snapshot: &Snapshot) -> Result<Value, Refusal> {
        let [east, north, above_m] = places::place_above(&self.at).map_err(|why| refused("at", why))?;
        let place_m = inside(snapshot, "at", [east, north])?;
        if !(0.0..=RADIUS_M_MAX).contains(&self.radius_m) {
            return Err(above("radius_m", self.radius_m, "from 0 to 1000"));
        }
        let ends = [-self.radius_m, self.radius_m].map(|reach| place_m.map(|middle| middle + reach));
        let ground = snapshot.ground.around(&snapshot.contents, 0, ends, None)?;
        let height_m = ground.height_m(place_m).ok_or_else(|| refused("at", "a place without ground".into()))?;
        let found = ground.obstacle_at([east, north, height_m + above_m], self.radius_m);
        let told = |obstacle: Obstacle| {
            let Obstacle { kind, id, distance_m, spacing_m } = obstacle;
            // Programs that read numbers of JSON as floats would change it.
            json!({ "kind": kind.name(), "id": id.to_string(), "distance_m": distance_m, "spacing_m": spacing_m })
        };
        Ok(json!({ "obstacle": found.map(told) }))
    }
}
