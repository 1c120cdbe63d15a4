//! What the page asks of the ground: lines of sight, viewsheds, profiles, and places in other coordinates.
//!
//! ```text
//!   /api/sight/EAST,NORTH,ABOVE/EAST,NORTH,ABOVE/EARTH    whether one place sees the other, as JSON
//!   /api/viewshed/EAST,NORTH,ABOVE/TARGET/RANGE/SPACING/EARTH   places a side (u32), metres between them (f32), then
//!                                                   row by row from the north 1 seen, 0 hidden, 255 neither (u8)
//!   /api/profile/SPACING/EAST,NORTH/EAST,NORTH      heights along a line, as JSON
//!   /api/find/WORDS                                 a place of the area's system, of coordinates as people write them
//!   /api/where/EAST,NORTH                           longitude and latitude, as JSON
//!   /api/degrees/EAST,NORTH;EAST,NORTH              longitude and latitude of each, as JSON, at most 200
//! ```
//! EARTH is `flat` or `round`: with the curvature of the earth and the usual bending of light, as `--curvature` has it.
//! The answers are those of `tiefort sight` and `tiefort profile`: the reader library gives them.

use std::sync::Arc;

use axum::Router;
use axum::extract::{Path as UrlPath, State};
use axum::http::{StatusCode, header};
use axum::response::{IntoResponse, Response};
use axum::routing::get;
use exports::Crs;
use load_module_reader::{Curvature, Sight, Viewshed};
use serde_json::{Value, json};

use super::area::Viewed;
use super::plain::{FAULT, bytes};
use crate::failure::Failure;
use crate::places::{self, REFRACTION, ground_around, place, place_above};

/// Places along a side of a viewshed, and along a profile.
const SIDE_MAX: u64 = 1025;
/// Places whose degrees are asked for at once: an address holds some thousand characters.
const DEGREES_MAX: usize = 200;
/// See [`SIDE_MAX`].
const STEPS_MAX: f64 = 20_000.0;

/// The routes of the tools.
pub fn routes() -> Router<Arc<Viewed>> {
    Router::new()
        .route("/api/sight/{from}/{to}/{earth}", get(sight))
        .route("/api/viewshed/{from}/{target}/{range}/{spacing}/{earth}", get(viewshed))
        .route("/api/profile/{spacing}/{from}/{to}", get(profile))
        .route("/api/find/{words}", get(find))
        .route("/api/where/{place}", get(where_is))
        .route("/api/degrees/{places}", get(degrees))
}

async fn sight(
    State(viewed): State<Arc<Viewed>>,
    UrlPath((from, to, earth)): UrlPath<(String, String, String)>,
) -> Response {
    answer(move || sight_of(&viewed, [&from, &to], curvature(&earth)?)).await
}

async fn viewshed(
    State(viewed): State<Arc<Viewed>>,
    UrlPath((from, target, range, spacing, earth)): UrlPath<(String, f64, f64, f64, String)>,
) -> Response {
    let ask = move || viewshed_of(&viewed, &from, [target, range, spacing], curvature(&earth)?);
    match tokio::task::spawn_blocking(ask).await {
        Ok(Ok(found)) => bytes(found.into()),
        Ok(Err(why)) => (StatusCode::CONFLICT, why).into_response(),
        Err(_) => (StatusCode::INTERNAL_SERVER_ERROR, FAULT).into_response(),
    }
}

async fn profile(
    State(viewed): State<Arc<Viewed>>,
    UrlPath((spacing, from, to)): UrlPath<(f64, String, String)>,
) -> Response {
    answer(move || profile_of(&viewed, spacing, &from, &to)).await
}

async fn find(State(viewed): State<Arc<Viewed>>, UrlPath(words): UrlPath<String>) -> Response {
    answer(move || found(&viewed, &words)).await
}

async fn where_is(State(viewed): State<Arc<Viewed>>, UrlPath(words): UrlPath<String>) -> Response {
    answer(move || {
        let crs = Crs::named(&viewed.area.frame().crs)?;
        let [longitude, latitude] = in_degrees(&crs, &words)?;
        Ok(json!({ "longitude": longitude, "latitude": latitude }))
    })
    .await
}

async fn degrees(State(viewed): State<Arc<Viewed>>, UrlPath(words): UrlPath<String>) -> Response {
    answer(move || {
        let crs = Crs::named(&viewed.area.frame().crs)?;
        let places: Vec<&str> = words.split(';').collect();
        if DEGREES_MAX < places.len() {
            return Err(format!("found {} places, expected {DEGREES_MAX} at most", places.len()));
        }
        let found: Result<Vec<[f64; 2]>, String> = places.iter().map(|words| in_degrees(&crs, words)).collect();
        Ok(json!(found?))
    })
    .await
}

/// Longitude and latitude of a place of a system.
fn in_degrees(crs: &Crs, words: &str) -> Result<[f64; 2], String> {
    crs.to(&Crs::wgs84(), place(words)?).ok_or_else(|| "found no such place on the globe".into())
}

fn curvature(earth: &str) -> Result<Curvature, String> {
    match earth {
        "flat" => Ok(Curvature::NONE),
        "round" => Ok(Curvature::of_earth(REFRACTION)),
        _ => Err("expected flat or round".into()),
    }
}

/// What `ask` says, asked where it may wait for the disk.
async fn answer(ask: impl FnOnce() -> Result<Value, String> + Send + 'static) -> Response {
    match tokio::task::spawn_blocking(ask).await {
        Ok(Ok(value)) => ([(header::CONTENT_TYPE, "application/json")], value.to_string()).into_response(),
        Ok(Err(why)) => (StatusCode::CONFLICT, why).into_response(),
        Err(_) => (StatusCode::INTERNAL_SERVER_ERROR, FAULT).into_response(),
    }
}

/// What went wrong, on one line.
fn in_words(failure: &Failure) -> String {
    format!("{}; {}", failure.message(), failure.hint())
}

/// An end of a line, inside the area.
fn inside(viewed: &Viewed, [east, north]: [f64; 2]) -> Result<[f64; 2], String> {
    let frame = viewed.area.frame();
    let outside = || places::outside("place", [east, north], frame);
    if frame.holds([east, north]) { Ok([east, north]) } else { Err(in_words(&outside())) }
}

fn sight_of(viewed: &Viewed, [from, to]: [&str; 2], curvature: Curvature) -> Result<Value, String> {
    let (from, to) = (place_above(from)?, place_above(to)?);
    let plan = |end: [f64; 3]| inside(viewed, [end[0], end[1]]);
    let ends_m = [plan(from)?, plan(to)?];
    let ground = ground_around(&viewed.area, &ends_m, 0.0).map_err(|failure| in_words(&failure))?;
    let stands = |end: [f64; 3]| {
        let height_m = ground.height_m([end[0], end[1]]).ok_or("found a place without ground")?;
        Ok::<_, String>([end[0], end[1], height_m + end[2]])
    };
    let (from, to) = (stands(from)?, stands(to)?);
    let hidden_at = match ground.sight_over(from, to, curvature) {
        Sight::Hidden(at) => Some(at),
        Sight::Free => None,
        Sight::Unknown => return Err("the line leaves the area".into()),
    };
    let blocker = hidden_at.map(|at| [0, 1, 2].map(|axis| from[axis] + at * (to[axis] - from[axis])));
    let clearance_m = ground.clearance_over_m(from, to, curvature);
    Ok(json!({
        "visible": hidden_at.is_none(),
        "from": from,
        "to": to,
        "blocker": blocker,
        "clearance_m": clearance_m,
    }))
}

fn viewshed_of(
    viewed: &Viewed,
    from: &str,
    [target_m, range_m, spacing_m]: [f64; 3],
    curvature: Curvature,
) -> Result<Vec<u8>, String> {
    let [east, north, eye_m] = place_above(from)?;
    let place_m = inside(viewed, [east, north])?;
    let numbers = [target_m, range_m, spacing_m];
    if !numbers.iter().all(|number| number.is_finite() && 0.0 <= *number) || range_m == 0.0 || spacing_m == 0.0 {
        return Err("expected a range and a spacing above 0, and a target of 0 or more metres".into());
    }
    let viewshed = Viewshed {
        place_m,
        eye_m,
        target_m,
        range_m,
        spacing_m,
        curvature,
        standing: load_module_reader::Standing::None,
        is_on_roofs: false,
    };
    let side = viewshed.side();
    if SIDE_MAX < side {
        return Err(format!("found {side} places along a side, expected {SIDE_MAX} at most"));
    }
    let ground = ground_around(&viewed.area, &[place_m], range_m).map_err(|failure| in_words(&failure))?;
    let mut eye = viewshed.eye(&ground).ok_or("found a place without ground")?;
    let mut out: Vec<u8> = (side as u32).to_le_bytes().to_vec();
    out.extend((spacing_m as f32).to_le_bytes());
    out.extend((0..side).flat_map(|row| viewshed.row(&ground, &mut eye, row)).map(|look| look.seen));
    Ok(out)
}

fn profile_of(viewed: &Viewed, spacing_m: f64, from: &str, to: &str) -> Result<Value, String> {
    let ends_m = [inside(viewed, place(from)?)?, inside(viewed, place(to)?)?];
    let run = [ends_m[1][0] - ends_m[0][0], ends_m[1][1] - ends_m[0][1]];
    let steps = (run[0] * run[0] + run[1] * run[1]).sqrt() / spacing_m;
    if !(0.0..=STEPS_MAX).contains(&steps) {
        return Err(format!("found {steps} steps along the line, expected {STEPS_MAX} at most"));
    }
    let ground = ground_around(&viewed.area, &ends_m, 0.0).map_err(|failure| in_words(&failure))?;
    let points = ground.profile(&ends_m, spacing_m);
    Ok(json!({
        "along_m": points.iter().map(|point| point.along_m).collect::<Vec<_>>(),
        "height_m": points.iter().map(|point| point.height_m).collect::<Vec<_>>(),
    }))
}

/// A place of coordinates: `EAST NORTH` of the area's system, `LATITUDE LONGITUDE` in degrees, or `ZONE EAST NORTH` of
/// UTM, such as `11S 530000 3899000`, whose letter is that of the band.
fn found(viewed: &Viewed, words: &str) -> Result<Value, String> {
    const EXPECTED: &str = "expected EAST NORTH, LATITUDE LONGITUDE, or 11S EAST NORTH";
    let crs = Crs::named(&viewed.area.frame().crs)?;
    let parts: Vec<&str> = words.split([',', ' ', ';']).filter(|part| !part.is_empty()).collect();
    let number = |text: &str| text.parse::<f64>().ok().filter(|number| number.is_finite());
    let (system, given) = match parts[..] {
        [first, second] => {
            let pair = number(first).zip(number(second)).ok_or(EXPECTED)?;
            let is_degrees = pair.0.abs() <= 90.0 && pair.1.abs() <= 180.0;
            // No conversion there and back: what was given is what is meant.
            if is_degrees { (Some(Crs::wgs84()), [pair.1, pair.0]) } else { (None, [pair.0, pair.1]) }
        }
        [zone, east, north] => {
            let pair = number(east).zip(number(north)).ok_or(EXPECTED)?;
            (Some(utm(zone).ok_or(EXPECTED)??), [pair.0, pair.1])
        }
        _ => return Err(EXPECTED.into()),
    };
    let place_m = system.map_or(Some(given), |system| system.to(&crs, given));
    let place_m = inside(viewed, place_m.ok_or("found a place that the area's system cannot tell")?)?;
    Ok(json!({ "place_m": place_m }))
}

/// The system of a UTM zone such as `11S`, by its band: N and later letters lie north of the equator.
fn utm(zone: &str) -> Option<Result<Crs, String>> {
    let letter = zone.chars().last().filter(char::is_ascii_alphabetic)?.to_ascii_uppercase();
    let number: u32 = zone[..zone.len() - 1].parse().ok().filter(|number| (1..=60).contains(number))?;
    Some(Crs::from_epsg(if letter < 'N' { 32700 } else { 32600 } + number))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_zone_of_utm_is_named_by_its_band() {
        let epsg = |zone| utm(zone).and_then(Result::ok).and_then(|crs| crs.epsg());
        assert_eq!(
            ["11S", "33n", "19H", "61S", "11", "S"].map(epsg),
            [Some(32611), Some(32633), Some(32719), None, None, None]
        );
    }
}
