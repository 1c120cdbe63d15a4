//! The page of `tiefort view` and the load modules it asks for, beside the addresses of the service (serve/mod.rs).
//!
//! ```text
//!   /                                      the page, /viewer.js its program
//!   /api/area                              what the area is, as JSON
//!   /api/overview                          coarse heights and the figures of every load module (overview.rs)
//!   /api/modules/SOUTH/WEST/NORTH/EAST     a block of load modules, whole, with what stands there (block.rs)
//!   /api/levels/LEVEL/SOUTH/WEST/NORTH/EAST   the same at a level of detail
//!   /api/lines                             roads and streams of the whole area that are seen from afar (lines.rs)
//!   /api/lines/SOUTH/WEST/NORTH/EAST       all of a block
//!   /api/buildings/SOUTH/WEST/NORTH/EAST   buildings there, drawn only (buildings.rs)
//!   /api/relief                            heights and classes on a fine grid, for shades and shadows (relief.rs)
//!   /api/dem                               whether the sources can be read, as JSON; else `why` says why not
//!   /api/dem/SOUTH/WEST/NORTH/EAST         the posts of such a block (posts.rs)
//! ```
//! What the tools of the page ask is listed in tools.rs, squares of pictures of the ground in imagery.rs.
//! Blocks are half-open. Everything is little-endian. An answer other than 200 is a sentence for a person.

mod area;
mod block;
mod buildings;
mod imagery;
mod lines;
mod overview;
mod plain;
mod posts;
mod relief;
mod tools;

use std::path::{Path, PathBuf};
use std::sync::Arc;

use axum::Router;
use axum::extract::{Path as UrlPath, State};
use axum::http::{StatusCode, header};
use axum::response::{IntoResponse, Response};
use axum::routing::get;
use load_module_reader::Block;

use crate::failure::Failure;
use crate::serve::Page;
use area::Viewed;
use plain::{FAULT, bytes};

const PAGE: &str = include_str!("../../viewer/index.html");
const PROGRAM: &str = include_str!("../../viewer/dist/viewer.js");
/// What the page may load and ask: itself.
const POLICY: &str = "default-src 'self'; style-src 'self' 'unsafe-inline'; img-src 'self' data:";
/// Load modules in one answer at most: a view of 8 km each way.
const BLOCK_MODULES_MAX: usize = 1024;

/// The page of the database in `folder`, and what it asks; `imagery` are pictures to lay over the ground.
///
/// # Errors
/// When the database or a picture cannot be read.
pub fn page(folder: &Path, imagery: &[PathBuf]) -> Result<Page, Failure> {
    let viewed = Viewed::open(folder)?;
    let pictures = imagery::routes(imagery, viewed.area.frame())?;
    let routes = Router::new()
        .route("/", get(async || text("text/html; charset=utf-8", PAGE)))
        .route("/viewer.js", get(async || text("text/javascript; charset=utf-8", PROGRAM)))
        .route("/api/area", get(area))
        .route("/api/overview", get(overview))
        .route("/api/modules/{south}/{west}/{north}/{east}", get(modules))
        .route("/api/levels/{level}/{south}/{west}/{north}/{east}", get(level))
        .route("/api/lines", get(far_lines))
        .route("/api/lines/{south}/{west}/{north}/{east}", get(lines))
        .route("/api/buildings/{south}/{west}/{north}/{east}", get(standing))
        .route("/api/relief", get(relief::answer))
        .route("/api/dem", get(ground))
        .route("/api/dem/{south}/{west}/{north}/{east}", get(dem))
        .merge(tools::routes())
        .with_state(Arc::new(viewed))
        .merge(pictures);
    Ok(Page { routes, paths: &["/viewer.js", "/api/*"] })
}

fn text(kind: &'static str, body: &'static str) -> impl IntoResponse {
    ([(header::CONTENT_TYPE, kind), (header::CONTENT_SECURITY_POLICY, POLICY)], body)
}

async fn area(State(viewed): State<Arc<Viewed>>) -> impl IntoResponse {
    ([(header::CONTENT_TYPE, "application/json")], viewed.description.clone())
}

async fn overview(State(viewed): State<Arc<Viewed>>) -> Response {
    bytes(viewed.overview.clone())
}

async fn modules(State(viewed): State<Arc<Viewed>>, UrlPath(sides): UrlPath<[u32; 4]>) -> Response {
    answer(sides, viewed, |viewed, block| block::bytes(viewed, block, 0)).await
}

async fn level(
    State(viewed): State<Arc<Viewed>>,
    UrlPath((level, south, west, north, east)): UrlPath<(u16, u32, u32, u32, u32)>,
) -> Response {
    answer([south, west, north, east], viewed, move |viewed, block| block::bytes(viewed, block, level)).await
}

async fn far_lines(State(viewed): State<Arc<Viewed>>) -> Response {
    bytes(viewed.far_lines.clone())
}

async fn lines(State(viewed): State<Arc<Viewed>>, UrlPath(sides): UrlPath<[u32; 4]>) -> Response {
    let read = |viewed: &Viewed, block| match &viewed.lines {
        Some(lines) => Ok(lines.bytes(block)),
        None => lines::of_modules(&viewed.area, block),
    };
    answer(sides, viewed, read).await
}

async fn standing(State(viewed): State<Arc<Viewed>>, UrlPath(sides): UrlPath<[u32; 4]>) -> Response {
    answer(sides, viewed, |viewed, block| viewed.buildings.bytes(&viewed.area, block)).await
}

async fn ground(State(viewed): State<Arc<Viewed>>) -> impl IntoResponse {
    let why = tokio::task::spawn_blocking(move || posts::ground(&viewed).err()).await;
    let why = why.unwrap_or_else(|_| Some(FAULT.into()));
    ([(header::CONTENT_TYPE, "application/json")], serde_json::json!({ "why": why }).to_string())
}

async fn dem(State(viewed): State<Arc<Viewed>>, UrlPath(sides): UrlPath<[u32; 4]>) -> Response {
    answer(sides, viewed, posts::bytes).await
}

/// What `read` says of a block, read where it may wait for the disk.
async fn answer(
    [south, west, north, east]: [u32; 4],
    viewed: Arc<Viewed>,
    read: impl FnOnce(&Viewed, Block) -> Result<Vec<u8>, String> + Send + 'static,
) -> Response {
    let all = viewed.area.whole();
    let sides_in_order = south < north && west < east && north <= all.north && east <= all.east;
    let block = Block { south, west, north, east };
    if !sides_in_order || BLOCK_MODULES_MAX < block.count() {
        let expected = format!("a block of at most {BLOCK_MODULES_MAX} of {} x {} load modules", all.north, all.east);
        return (StatusCode::NOT_FOUND, format!("found {south},{west} to {north},{east}, expected {expected}"))
            .into_response();
    }
    match tokio::task::spawn_blocking(move || read(&viewed, block)).await {
        Ok(Ok(found)) => bytes(found.into()),
        Ok(Err(why)) => (StatusCode::CONFLICT, why).into_response(),
        Err(_) => (StatusCode::INTERNAL_SERVER_ERROR, FAULT).into_response(),
    }
}
