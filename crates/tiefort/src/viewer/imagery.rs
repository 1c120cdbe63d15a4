//! Pictures of the ground for the page, square by square.
//!
//! ```text
//!   /api/imagery                  pixels along the side of a square, metres of a pixel at level 0, levels, and names
//!                                 of the files, as JSON; no levels without pictures
//!   /api/imagery/LEVEL/ROW/COL    four bytes a pixel, row by row from the south-west: red, green and blue multiplied
//!                                 with how opaque they are, and that; no content where there is no picture
//! ```
//! Rows and columns count from the south-western corner of the area, at every level.

use std::num::NonZeroUsize;
use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError};

use axum::Router;
use axum::body::Bytes;
use axum::extract::{Path as UrlPath, State};
use axum::http::{HeaderMap, StatusCode, header};
use axum::response::{IntoResponse, Response};
use axum::routing::get;
use build::product::{Drape, DrapedArea, SQUARE_PIXELS};
use load_module_reader::AreaFrame;
use lru::LruCache;
use store::Fingerprint;
use tokio::sync::Semaphore;

use crate::failure::Failure;
use crate::serve::files;
use crate::viewer::plain::FAULT;
use crate::{resources, terminal};

/// Squares that are kept: 64 MiB.
const KEPT_SQUARES: usize = (64 << 20) / (4 * SQUARE_PIXELS * SQUARE_PIXELS);

/// A square's level, row and column.
type Key = (u32, u32, u32);

/// The pictures that the page lays over the ground.
struct Pictures {
    description: String,
    drape: Option<Drape>,
    /// What the name of every square begins with.
    key: String,
    /// Squares drawn last; nothing where there is no picture.
    kept: Mutex<LruCache<Key, Option<Bytes>>>,
    /// Squares drawn at a time: as many as there are cores.
    places: Arc<Semaphore>,
}

/// The routes of the pictures at `paths`.
///
/// # Errors
/// When one cannot be drawn, or lies nowhere in the area.
pub fn routes(paths: &[PathBuf], frame: &AreaFrame) -> Result<Router, Failure> {
    let size_m = [frame.cols, frame.rows].map(|count| f64::from(count) * frame.side_m());
    let area = DrapedArea { crs: &frame.crs, origin_m: frame.origin_m, size_m };
    let drape = if paths.is_empty() { None } else { Some(Drape::open(paths, &area)?) };
    drape.iter().flat_map(Drape::remarks).for_each(|remark| terminal::tell(&format!("warning: {remark}")));
    let capacity = NonZeroUsize::new(KEPT_SQUARES).expect("there is room for some");
    let pictures = Pictures {
        description: description(paths, drape.as_ref()),
        key: drape.as_ref().map(Drape::key).unwrap_or_default(),
        drape,
        kept: Mutex::new(LruCache::new(capacity)),
        places: Arc::new(Semaphore::new(resources::cores())),
    };
    Ok(Router::new()
        .route("/api/imagery", get(describe))
        .route("/api/imagery/{level}/{row}/{col}", get(square))
        .with_state(Arc::new(pictures)))
}

fn description(paths: &[PathBuf], drape: Option<&Drape>) -> String {
    let name = |path: &PathBuf| path.file_name().map(|name| name.to_string_lossy().into_owned());
    serde_json::json!({
        "side": SQUARE_PIXELS,
        "pixel_m": drape.map(Drape::pixel_m),
        "levels": drape.map_or(0, Drape::levels),
        "names": paths.iter().filter_map(name).collect::<Vec<_>>(),
    })
    .to_string()
}

async fn describe(State(pictures): State<Arc<Pictures>>) -> impl IntoResponse {
    ([(header::CONTENT_TYPE, "application/json")], pictures.description.clone())
}

async fn square(State(pictures): State<Arc<Pictures>>, UrlPath(key): UrlPath<Key>, headers: HeaderMap) -> Response {
    let (level, row, col) = key;
    if !pictures.drape.as_ref().is_some_and(|drape| drape.holds(level, row, col)) {
        let found = format!("found level {level}, row {row}, column {col}, expected a square that /api/imagery tells");
        return (StatusCode::NOT_FOUND, found).into_response();
    }
    let tag = files::tag(Fingerprint::of_bytes(format!("{} {key:?}", pictures.key).as_bytes()));
    if files::is_known(&headers, &tag) {
        return files::known(&tag);
    }
    let Ok(place) = Arc::clone(&pictures.places).acquire_owned().await else {
        return (StatusCode::INTERNAL_SERVER_ERROR, FAULT).into_response();
    };
    let drawn = tokio::task::spawn_blocking(move || {
        let _place = place;
        pictures.square(key)
    });
    match drawn.await {
        Ok(Ok(Some(bytes))) => files::content("application/octet-stream", &tag, bytes),
        Ok(Ok(None)) => StatusCode::NO_CONTENT.into_response(),
        Ok(Err(why)) => (StatusCode::CONFLICT, why).into_response(),
        Err(_) => (StatusCode::INTERNAL_SERVER_ERROR, FAULT).into_response(),
    }
}

impl Pictures {
    fn square(&self, key: Key) -> Result<Option<Bytes>, String> {
        let kept = || self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(found) = kept().get(&key) {
            return Ok(found.clone());
        }
        let Some(drape) = &self.drape else { return Ok(None) };
        let drawn = drape.square(key.0, key.1, key.2).map_err(|error| error.to_string())?.map(Bytes::from);
        kept().put(key, drawn.clone());
        Ok(drawn)
    }
}
