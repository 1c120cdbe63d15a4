//! What the page asks beside the service (serve/queries.rs, serve/looks.rs): places in other coordinates.
//!
//! ```text
//!   /api/find/WORDS                                 a place of the area's system, of coordinates as people write them
//!   /api/where/EAST,NORTH                           longitude and latitude, as JSON
//!   /api/degrees/EAST,NORTH;EAST,NORTH              longitude and latitude of each, as JSON, at most 200
//! ```

use std::sync::Arc;

use axum::Router;
use axum::extract::{Path as UrlPath, State};
use axum::http::{StatusCode, header};
use axum::response::{IntoResponse, Response};
use axum::routing::get;
use exports::Crs;
use serde_json::{Value, json};

use super::area::Viewed;
use crate::failure::Failure;
use crate::places::{self, place};
use crate::viewer::plain::FAULT;

/// Places whose degrees are asked for at once: an address holds some thousand characters.
const DEGREES_MAX: usize = 200;

/// The routes of the tools.
pub fn routes() -> Router<Arc<Viewed>> {
    Router::new()
        .route("/api/find/{words}", get(find))
        .route("/api/where/{place}", get(where_is))
        .route("/api/degrees/{places}", get(degrees))
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
