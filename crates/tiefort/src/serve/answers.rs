//! What each address answers.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::path::Path;
use std::sync::Arc;

use axum::body::Bytes;
use axum::extract::{Path as UrlPath, Query, Request, State};
use axum::http::{HeaderMap, StatusCode, header};
use axum::response::{IntoResponse, Response};
use build::product::WantedGround;
use inspect::explain;
use load_module_reader::Block;
use serde::Deserialize;
use serde_json::{Value, json};
use store::{Fingerprint, Folder};
use terrain::ModuleId;
use tokio::sync::Semaphore;
use tokio::task::spawn_blocking;

use super::body::{Bodies, Received};
use super::files::{self, Part};
use super::globe::{HOLES, Kind};
use super::looks::{ObstacleAsked, ProfileAsked, ViewshedAsked};
use super::queries::{Heights, HeightsAsked, Lines, Looking};
use super::refusal::Refusal;
use super::snapshot::{Served, Snapshot};
use crate::arguments::row_col;
use crate::commands::explain::to_json;
use crate::contents::TileModulesFile;
use crate::failure::Failure;
use crate::resources;

/// What all answers are made from.
pub struct Shared {
    /// The databases by name.
    pub served: BTreeMap<String, Arc<Served>>,
    pub bodies: Bodies,
    /// Queries at a time, and files that are read: as many as there are cores.
    queries: Arc<Semaphore>,
    /// Files for globes that are made at a time; the first of a database sets it on the globe, others wait for that.
    makers: Arc<Semaphore>,
    /// Explanations at a time: each reads the whole database.
    explanations: Arc<Semaphore>,
}

/// The state that handlers get.
pub type Context = State<Arc<Shared>>;
type Answer = Result<Response, Refusal>;

impl Shared {
    pub fn new(served: BTreeMap<String, Arc<Served>>, bodies: Bodies) -> Self {
        let places = |count| Arc::new(Semaphore::new(count));
        let (queries, makers) = (places(resources::cores()), places(resources::cores()));
        Self { served, bodies, queries, makers, explanations: places(1) }
    }

    fn named(&self, name: &str) -> Result<Arc<Served>, Refusal> {
        self.served.get(name).cloned().ok_or_else(|| {
            let names: Vec<&str> = self.served.keys().map(String::as_str).collect();
            Refusal::missing(
                format!("found no database {name:?}, expected one of {}", names.join(", ")),
                "/ lists them",
            )
        })
    }
}

/// Waits for a place, then does `work` where it may take long.
async fn at_a_place<R: Send + 'static>(
    places: &Arc<Semaphore>,
    work: impl FnOnce() -> Result<R, Refusal> + Send + 'static,
) -> Result<R, Refusal> {
    let place = Arc::clone(places).acquire_owned().await.map_err(|_| Refusal::fault())?;
    let working = spawn_blocking(move || {
        let _place = place;
        work()
    });
    working.await.unwrap_or_else(|_| Err(Refusal::fault()))
}

fn json_answer(value: &Value) -> Response {
    ([(header::CONTENT_TYPE, "application/json")], format!("{value:#}\n")).into_response()
}

/// What is told of every database; of one that cannot be read, why.
pub async fn described_all(shared: &Shared) -> Result<Vec<Value>, Refusal> {
    let served: Vec<Arc<Served>> = shared.served.values().cloned().collect();
    let described = |served: &Arc<Served>| {
        let found = served.ask(|snapshot| Ok(described(&served.name, snapshot)));
        let name = &served.name;
        found.unwrap_or_else(|refusal| json!({ "name": name, "path": path_of(name), "error": refusal.error() }))
    };
    at_a_place(&shared.queries, move || Ok(served.iter().map(described).collect())).await
}

/// All databases.
pub async fn databases(State(shared): Context) -> Answer {
    Ok(json_answer(&json!({ "databases": described_all(&shared).await? })))
}

/// One database.
pub async fn database(State(shared): Context, UrlPath(name): UrlPath<String>) -> Answer {
    let served = shared.named(&name)?;
    let look = move || served.ask(|snapshot| Ok(described(&served.name, snapshot)));
    Ok(json_answer(&at_a_place(&shared.queries, look).await?))
}

/// What the addresses of a database begin with.
pub fn path_of(name: &str) -> String {
    format!("/{}", percent_encoding::utf8_percent_encode(name, percent_encoding::NON_ALPHANUMERIC))
        .replace("%2E", ".")
        .replace("%2D", "-")
        .replace("%5F", "_")
}

fn described(name: &str, snapshot: &Snapshot) -> Value {
    let (area, totals, frame) =
        (&snapshot.contents.manifest.area, &snapshot.contents.manifest.totals, &snapshot.contents.frame);
    let path = path_of(name);
    let at = |what: &str| format!("{path}/{what}");
    json!({
        "name": name,
        "path": path,
        "area": area.name,
        "crs": area.crs,
        "vertical_datum": area.vertical_datum,
        "origin_m": area.origin_m,
        "size_m": area.size_m,
        "load_module_side_m": area.module_side_m,
        "load_modules": [frame.rows, frame.cols],
        "levels": frame.level_count,
        "triangles": totals.triangles,
        "fingerprint": snapshot.contents.fingerprint.to_string(),
        "links": {
            "terrain": at("layer.json"),
            "tileset": at("tileset.json"),
            "modules": at("modules"),
            "heights": at("heights"),
            "line_of_sight": at("line-of-sight"),
            "viewshed": at("viewshed"),
            "profile": at("profile"),
            "obstacle": at("obstacle"),
            "explain": at("explain"),
        },
    })
}

/// A file for globes, by its name in the export.
async fn globe_file(shared: &Shared, headers: &HeaderMap, name: &str, kind: Kind, file: String) -> Answer {
    let served = shared.named(name)?;
    let headers = headers.clone();
    let made = at_a_place(&shared.makers, move || {
        served.ask(|snapshot| {
            let key = format!("{} {} {file}", snapshot.contents.fingerprint, snapshot.globes.key());
            let tag = files::tag(Fingerprint::of_bytes(key.as_bytes()));
            if files::is_known(&headers, &tag) {
                return Ok(files::known(&tag));
            }
            let bytes = snapshot.globes.file(&snapshot.contents, kind, &file)?;
            Ok(files::content(content_type(&file), &tag, bytes))
        })
    });
    made.await
}

fn content_type(file: &str) -> &'static str {
    match Path::new(file).extension().and_then(|extension| extension.to_str()) {
        Some("terrain") => "application/vnd.quantized-mesh",
        Some("glb") => "model/gltf-binary",
        Some("geojson") => "application/geo+json",
        _ => "application/json",
    }
}

pub async fn layer(State(shared): Context, UrlPath(name): UrlPath<String>, headers: HeaderMap) -> Answer {
    globe_file(&shared, &headers, &name, Kind::Terrain, "layer.json".into()).await
}

pub async fn holes(State(shared): Context, UrlPath(name): UrlPath<String>, headers: HeaderMap) -> Answer {
    globe_file(&shared, &headers, &name, Kind::Terrain, HOLES.into()).await
}

pub async fn terrain_tile(
    State(shared): Context,
    UrlPath((name, level, col, row)): UrlPath<(String, String, String, String)>,
    headers: HeaderMap,
) -> Answer {
    globe_file(&shared, &headers, &name, Kind::Terrain, format!("{level}/{col}/{row}")).await
}

pub async fn tileset(State(shared): Context, UrlPath(name): UrlPath<String>, headers: HeaderMap) -> Answer {
    globe_file(&shared, &headers, &name, Kind::Tileset, "tileset.json".into()).await
}

pub async fn square(
    State(shared): Context,
    UrlPath((name, file)): UrlPath<(String, String)>,
    headers: HeaderMap,
) -> Answer {
    globe_file(&shared, &headers, &name, Kind::Tileset, format!("squares/{file}")).await
}

pub async fn group(
    State(shared): Context,
    UrlPath((name, file)): UrlPath<(String, String)>,
    headers: HeaderMap,
) -> Answer {
    globe_file(&shared, &headers, &name, Kind::Tileset, format!("groups/{file}")).await
}

pub async fn level_of_square(
    State(shared): Context,
    UrlPath((name, level, file)): UrlPath<(String, String, String)>,
    headers: HeaderMap,
) -> Answer {
    globe_file(&shared, &headers, &name, Kind::Tileset, format!("levels/{level}/{file}")).await
}

/// The files of load modules.
pub async fn modules(State(shared): Context, UrlPath(name): UrlPath<String>) -> Answer {
    let served = shared.named(&name)?;
    let listed = |file: &TileModulesFile| {
        let Block { south, west, north, east } = file.block;
        json!({
            "name": file_name(file),
            "tile": [file.tile.row, file.tile.col],
            "load_modules": { "south": south, "west": west, "north": north, "east": east },
            "bytes": file.stamp.length,
            "blake3": file.stamp.blake3.to_string(),
        })
    };
    let look = move || served.ask(|snapshot| Ok(snapshot.contents.files.iter().map(listed).collect::<Vec<_>>()));
    Ok(json_answer(&json!({ "files": at_a_place(&shared.queries, look).await? })))
}

fn file_name(file: &TileModulesFile) -> &str {
    file.path.file_name().and_then(|name| name.to_str()).unwrap_or_default()
}

/// The file of a tile's load modules, or of one load module, whole or in part.
pub async fn module_file(
    State(shared): Context,
    UrlPath((name, file)): UrlPath<(String, String)>,
    headers: HeaderMap,
) -> Answer {
    let served = shared.named(&name)?;
    let read = move || {
        served.ask(|snapshot| {
            if let Some(of_tile) = snapshot.contents.files.iter().find(|of_tile| file_name(of_tile) == file) {
                return tile_file(snapshot, of_tile, &headers);
            }
            let id = module_id(&file).ok_or_else(|| no_file(&file))?;
            let of_tile = snapshot.contents.files.iter().find(|of_tile| of_tile.block.contains(id.row, id.col));
            one_module(snapshot, of_tile.ok_or_else(|| no_file(&file))?, id, &headers)
        })
    };
    at_a_place(&shared.queries, read).await
}

fn no_file(file: &str) -> Refusal {
    Refusal::missing(
        format!("found no {file}, expected the file of a tile, r02c03.slm, or of a load module, r0012c0034.slm"),
        "/modules of the database lists the tiles with their load modules",
    )
}

/// The load module of `r0012c0034.slm`.
fn module_id(file: &str) -> Option<ModuleId> {
    let (row, col) = file.strip_suffix(".slm")?.strip_prefix('r')?.split_once('c')?;
    let id = ModuleId { row: row.parse().ok()?, col: col.parse().ok()? };
    (format!("r{:04}c{:04}.slm", id.row, id.col) == file).then_some(id)
}

/// The bytes of a file that are asked for, as they lie on the disk, once the file was found to be the one of the build.
fn tile_file(snapshot: &Snapshot, of_tile: &TileModulesFile, headers: &HeaderMap) -> Answer {
    let tag = files::tag(of_tile.stamp.blake3);
    if files::is_known(headers, &tag) {
        return Ok(files::known(&tag));
    }
    let length = of_tile.stamp.length;
    let Some(part) = Part::asked(headers, &tag, length) else { return Ok(files::outside(length)) };
    let (first, end) = match part {
        Part::Whole => (0, length),
        Part::Bytes(first, last) => (first, last + 1),
    };
    snapshot.contents.check(of_tile).map_err(Refusal::of)?;
    let read = || {
        let mut file = File::open(&of_tile.path)?;
        file.seek(SeekFrom::Start(first))?;
        let mut bytes = vec![0; (end - first) as usize];
        file.read_exact(&mut bytes).map(|()| bytes)
    };
    let bytes = read().map_err(|error| {
        let error = format!("{}: cannot be read: {error}", of_tile.path.display());
        Refusal::later(error, "`tiefort verify` says what is damaged")
    })?;
    // What was read is what was checked, unless another file came between.
    snapshot.contents.check(of_tile).map_err(Refusal::of)?;
    Ok(part.answer(&tag, length, bytes.into()))
}

/// The bytes of the file of one load module, as `tiefort export --format modules` writes it.
fn one_module(snapshot: &Snapshot, of_tile: &TileModulesFile, id: ModuleId, headers: &HeaderMap) -> Answer {
    let key = format!("{} {} {id}", of_tile.stamp.blake3, env!("CARGO_PKG_VERSION"));
    let tag = files::tag(Fingerprint::of_bytes(key.as_bytes()));
    if files::is_known(headers, &tag) {
        return Ok(files::known(&tag));
    }
    let read = Folder::new(&snapshot.contents.folder).read_levels(&snapshot.contents.manifest, of_tile.tile);
    let (header, levels) = read.map_err(|error| Refusal::of(Failure::from(error)))?;
    let bytes: Bytes = exports::module_file(&header, &levels, id).ok_or_else(Refusal::fault)?.into();
    let length = bytes.len() as u64;
    let Some(part) = Part::asked(headers, &tag, length) else { return Ok(files::outside(length)) };
    let bytes = match part {
        Part::Whole => bytes,
        Part::Bytes(first, last) => bytes.slice(first as usize..=last as usize),
    };
    Ok(part.answer(&tag, length, bytes))
}

pub async fn heights(
    State(shared): Context,
    UrlPath(name): UrlPath<String>,
    Query(query): Query<HeightsAsked>,
    request: Request,
) -> Answer {
    numbers(&shared, &name, request, move |body| Heights::of(body, query), Heights::answer).await
}

pub async fn line_of_sight(
    State(shared): Context,
    UrlPath(name): UrlPath<String>,
    Query(query): Query<Looking>,
    request: Request,
) -> Answer {
    numbers(&shared, &name, request, move |body| Lines::of(body, query), Lines::answer).await
}

/// What `answer` says to what `read` finds in a body, in the kind of numbers that the body has.
async fn numbers<T: 'static>(
    shared: &Shared,
    name: &str,
    request: Request,
    read: impl FnOnce(&Received) -> Result<T, Refusal> + Send + 'static,
    answer: fn(&T, &Snapshot) -> Result<Vec<u8>, Refusal>,
) -> Answer {
    let served = shared.named(name)?;
    let body = shared.bodies.receive(request).await?;
    let look = move || {
        let asked = read(&body)?;
        let answer = served.ask(|snapshot| answer(&asked, snapshot))?;
        let kind = if body.is_raw() { "application/octet-stream" } else { "application/json" };
        Ok(([(header::CONTENT_TYPE, kind)], answer).into_response())
    };
    at_a_place(&shared.queries, look).await
}

pub async fn viewshed(
    State(shared): Context,
    UrlPath(name): UrlPath<String>,
    Query(asked): Query<ViewshedAsked>,
) -> Answer {
    let served = shared.named(&name)?;
    let look = move || served.ask(|snapshot| asked.answer(snapshot));
    let seen = at_a_place(&shared.queries, look).await?;
    Ok(([(header::CONTENT_TYPE, "application/octet-stream")], seen).into_response())
}

pub async fn profile(
    State(shared): Context,
    UrlPath(name): UrlPath<String>,
    Query(asked): Query<ProfileAsked>,
) -> Answer {
    value(&shared, &name, move |snapshot| asked.answer(snapshot)).await
}

pub async fn obstacle(
    State(shared): Context,
    UrlPath(name): UrlPath<String>,
    Query(asked): Query<ObstacleAsked>,
) -> Answer {
    value(&shared, &name, move |snapshot| asked.answer(snapshot)).await
}

/// What `ask` says, as JSON.
async fn value(
    shared: &Shared,
    name: &str,
    ask: impl Fn(&Snapshot) -> Result<Value, Refusal> + Send + 'static,
) -> Answer {
    let served = shared.named(name)?;
    Ok(json_answer(&at_a_place(&shared.queries, move || served.ask(ask)).await?))
}

/// What may stand behind the question mark of `explain`.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ExplainQuery {
    /// `ROW,COL` of a load module.
    module: Option<String>,
    /// `EAST,NORTH` of a place in it.
    at: Option<String>,
    /// Whether the sources are read for what one more point would buy.
    #[serde(default)]
    one_more: bool,
}

pub async fn explained(
    State(shared): Context,
    UrlPath(name): UrlPath<String>,
    Query(query): Query<ExplainQuery>,
) -> Answer {
    let served = shared.named(&name)?;
    let read = move || {
        served.ask(|snapshot| {
            let module = asked_module(snapshot, &query)?;
            let ground = if query.one_more { WantedGround::Recorded } else { WantedGround::None };
            let found = explain(&snapshot.contents.folder, module, ground, resources::cores());
            let found = found.map_err(|error| {
                Refusal::of(Failure::from(error)).with_status(StatusCode::CONFLICT, StatusCode::NOT_FOUND)
            })?;
            Ok(json_answer(&to_json(&found)))
        })
    };
    at_a_place(&shared.explanations, read).await
}

fn asked_module(snapshot: &Snapshot, query: &ExplainQuery) -> Result<ModuleId, Refusal> {
    let wrong = |found: &str| {
        Refusal::request(
            format!("found {found}, expected module=ROW,COL or at=EAST,NORTH"),
            "rows come first and both count from the south-west; places are metres of the area's system",
        )
    };
    match (&query.module, &query.at) {
        (Some(text), None) => {
            let id = row_col(text).map_err(|_| wrong(&format!("module={text}")))?;
            Ok(ModuleId { row: id.row, col: id.col })
        }
        (None, Some(text)) => {
            let pair = text.split_once(',').and_then(|(east, north)| Some([east.parse().ok()?, north.parse().ok()?]));
            let place: [f64; 2] = pair.ok_or_else(|| wrong(&format!("at={text}")))?;
            let [row, col] = snapshot.contents.frame.module_under(place).ok_or_else(|| outside(snapshot, text))?;
            Ok(ModuleId { row, col })
        }
        (None, None) => Err(wrong("neither module nor at")),
        (Some(_), Some(_)) => Err(wrong("both module and at")),
    }
}

fn outside(snapshot: &Snapshot, text: &str) -> Refusal {
    let area = &snapshot.contents.manifest.area;
    let [[west, east], [south, north]] =
        [0, 1].map(|axis| [area.origin_m[axis], area.origin_m[axis] + area.size_m[axis]]);
    Refusal::missing(
        format!("found at={text}, expected a place from {west} to {east} east and from {south} to {north} north"),
        format!("places are metres of {}", area.crs),
    )
}
