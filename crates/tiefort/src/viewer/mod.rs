//! The page of `tiefort view` and the load modules it asks for, beside the addresses of the service (serve/mod.rs).
//!
//! ```text
//!   /                                      the page, /viewer.js its program
//!   /api/area                              what the area is, as JSON
//!   /api/overview                          coarse heights and the figures of every load module (overview.rs)
//!   /api/modules/SOUTH/WEST/NORTH/EAST     a block of load modules, whole, with what stands there
//!   /api/levels/LEVEL/SOUTH/WEST/NORTH/EAST   the same at a level of detail
//!   /api/lines                             roads and streams of the whole area that are seen from afar (lines.rs)
//!   /api/lines/SOUTH/WEST/NORTH/EAST       all of a block
//!   /api/buildings/SOUTH/WEST/NORTH/EAST   buildings there, drawn only (buildings.rs)
//!   /api/relief                            heights and classes on a fine grid, for shades and shadows (relief.rs)
//!   /api/dem                               whether the sources can be read, as JSON; else `why` says why not
//!   /api/dem/SOUTH/WEST/NORTH/EAST         the posts of such a block
//! ```
//! What the tools of the page ask is listed in tools.rs, squares of pictures of the ground in imagery.rs.
//! Blocks are half-open. Everything is little-endian. An answer other than 200 is a sentence for a person.

mod area;
mod buildings;
mod imagery;
mod lines;
mod overview;
mod plain;
mod relief;
mod tools;

use std::path::{Path, PathBuf};
use std::sync::Arc;

use axum::Router;
use axum::extract::{Path as UrlPath, State};
use axum::http::{StatusCode, header};
use axum::response::{IntoResponse, Response};
use axum::routing::get;
use build::product::{NO_RESIDUAL, Product, ProductGround, Wanted, WantedGround};
use load_module_reader::{Block, Module, QUANTA_PER_METRE, Vertex};
use terrain::{ModuleRect, Post};

use crate::failure::Failure;
use crate::serve::Page;
use crate::viewer::area::Viewed;
use crate::viewer::overview::residuals_m;
use crate::viewer::plain::{FAULT, bytes};

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
    answer(sides, viewed, |viewed, block| block_bytes(viewed, block, 0)).await
}

async fn level(
    State(viewed): State<Arc<Viewed>>,
    UrlPath((level, south, west, north, east)): UrlPath<(u16, u32, u32, u32, u32)>,
) -> Response {
    answer([south, west, north, east], viewed, move |viewed, block| block_bytes(viewed, block, level)).await
}

async fn far_lines(State(viewed): State<Arc<Viewed>>) -> Response {
    bytes(viewed.far_lines.clone())
}

async fn lines(State(viewed): State<Arc<Viewed>>, UrlPath(sides): UrlPath<[u32; 4]>) -> Response {
    let read = |viewed: &Viewed, block| match &viewed.lines {
        Some(lines) => Ok(lines.bytes(block)),
        None => lines::of_modules(&viewed.area, block, &viewed.waters),
    };
    answer(sides, viewed, read).await
}

async fn standing(State(viewed): State<Arc<Viewed>>, UrlPath(sides): UrlPath<[u32; 4]>) -> Response {
    answer(sides, viewed, |viewed, block| viewed.buildings.bytes(&viewed.area, block)).await
}

async fn ground(State(viewed): State<Arc<Viewed>>) -> impl IntoResponse {
    let why = tokio::task::spawn_blocking(move || ground_of(&viewed).err()).await;
    let why = why.unwrap_or_else(|_| Some(FAULT.into()));
    ([(header::CONTENT_TYPE, "application/json")], serde_json::json!({ "why": why }).to_string())
}

async fn dem(State(viewed): State<Arc<Viewed>>, UrlPath(sides): UrlPath<[u32; 4]>) -> Response {
    answer(sides, viewed, post_bytes).await
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

/// The load modules of `block` at a level of detail, as the page reads them.
///
/// They follow each other row by row from the south-west, each beginning at a multiple of 4 bytes:
/// thirteen u32 (row, column, vertices, triangles, polygons, posts measured, vertices on the southern, eastern,
/// northern and western side, vertices and triangles of decks, bytes of objects), two f32 (root mean square and largest
/// residual, metres), the vertices (x and y as u16, z as i32, quanta), the triangles (three u16 each), the four sides
/// (u16 each), the classes (u8 each), zeros up to a multiple of 4 bytes; then vertices, triangles and classes of decks
/// likewise, and zeros; then what stands there, as the part *objects* of a file has it (docs/FORMAT.md).
///
/// # Errors
/// In words, when there is no such level, or one cannot be read.
fn block_bytes(viewed: &Viewed, block: Block, level: u16) -> Result<Vec<u8>, String> {
    let ground = viewed.area.load_level(block, level).map_err(|error| error.to_string())?;
    let mut out = Vec::new();
    for module in ground.modules() {
        write_module(module.module(), &mut out);
    }
    Ok(out)
}

fn write_module(module: &Module, out: &mut Vec<u8>) {
    let sides = [0, 1, 2, 3].map(|side: usize| module.sides[side].len() as u32);
    let (vertices, triangles) = (module.vertices.len() as u32, module.triangles.len() as u32);
    let counts = [module.row, module.col, vertices, triangles, module.polygon_count, module.residual.posts];
    let decks = [module.decks.vertices.len() as u32, module.decks.triangles.len() as u32];
    let objects = if module.objects.is_empty() { Vec::new() } else { module.objects.to_part() };
    for word in counts.into_iter().chain(sides).chain(decks).chain([objects.len() as u32]) {
        out.extend(word.to_le_bytes());
    }
    for figure in residuals_m(module) {
        out.extend(figure.to_le_bytes());
    }
    write_vertices(&module.vertices, out);
    for index in module.triangles.iter().flatten().chain(module.sides.iter().flatten()) {
        out.extend(index.to_le_bytes());
    }
    out.extend(&module.classes);
    out.resize(out.len().next_multiple_of(4), 0);
    write_vertices(&module.decks.vertices, out);
    for index in module.decks.triangles.iter().flatten() {
        out.extend(index.to_le_bytes());
    }
    out.extend(&module.decks.classes);
    out.resize(out.len().next_multiple_of(4), 0);
    out.extend(objects);
}

fn write_vertices(vertices: &[Vertex], out: &mut Vec<u8>) {
    for vertex in vertices {
        out.extend(vertex.x.to_le_bytes());
        out.extend(vertex.y.to_le_bytes());
        out.extend(vertex.z.to_le_bytes());
    }
}

/// Posts of an area up to which the ground is held: 12 bytes each.
const POSTS_MAX: usize = 32 << 20;

/// The DEM's posts under `block`, where the sources of the database can be read.
///
/// As bytes: heights of all posts of the block, its four border lines included, in metres (f32), row by row from the
/// south-west; then the residual of each, DEM less triangles (f32; not a number at voids).
///
/// # Errors
/// In words, when there is no ground to show.
fn post_bytes(viewed: &Viewed, block: Block) -> Result<Vec<u8>, String> {
    let ground = ground_of(viewed)?;
    let Block { south, west, north, east } = block;
    let rect = viewed.grid.posts_of_rect(ModuleRect { south, west, north, east });
    let whole = ground.dem.rect();
    let metres = |quanta: i32| quanta as f32 / QUANTA_PER_METRE as f32;
    let posts = (rect.south..=rect.north).flat_map(|row| (rect.west..=rect.east).map(move |col| Post::new(row, col)));
    let residual = |post: Post| {
        let place = whole.index(post);
        match ground.residuals[place] {
            NO_RESIDUAL => f32::NAN,
            quanta => metres(quanta),
        }
    };
    let heights = posts.clone().map(|post| metres(ground.dem.height(post)));
    Ok(heights.chain(posts.map(residual)).flat_map(f32::to_le_bytes).collect())
}

/// The ground of the whole area, read when it is first asked for.
///
/// # Errors
/// In words, when the sources cannot be read, or too large.
fn ground_of(viewed: &Viewed) -> Result<&ProductGround, String> {
    viewed.ground.get_or_init(|| read(viewed)).as_ref().map_err(Clone::clone)
}

fn read(viewed: &Viewed) -> Result<ProductGround, String> {
    let posts = viewed.grid.posts_of_rect(viewed.grid.all()).post_count();
    if POSTS_MAX < posts {
        return Err(format!("the area has {posts} posts, and the viewer holds at most {POSTS_MAX}"));
    }
    let wanted = Wanted { part: None, ground: WantedGround::Recorded, workers: 2 };
    let product = Product::read(&viewed.folder, &wanted).map_err(|error| error.to_string())?;
    product.ground.ok_or_else(|| "the database names no ground".into())
}

#[cfg(test)]
mod tests {
    use super::*;
    use load_module_reader::{Decks, Residual};

    #[test]
    fn a_load_module_fills_whole_words_and_begins_with_its_counts() {
        let vertex = |x, y| Vertex { x, y, z: -7 };
        let module = Module {
            row: 3,
            col: 5,
            level: 0,
            vertices: vec![vertex(0, 0), vertex(64000, 0), vertex(0, 64000), vertex(64000, 64000)],
            triangles: vec![[0, 1, 3], [0, 3, 2]],
            classes: vec![0, 1],
            sides: [vec![0, 1], vec![1, 3], vec![2, 3], vec![0, 2]],
            polygon_count: 1,
            residual: Residual { posts: 4, largest: 256, sum_abs: 256, sum_squared: 65536 },
            decks: Decks {
                vertices: vec![vertex(0, 0), vertex(9, 0), vertex(0, 9)],
                triangles: vec![[0, 1, 2]],
                classes: vec![2],
            },
            lines: Vec::new(),
            objects: terrain::Objects::default(),
            unknown_parts: Vec::new(),
        };
        let mut out = Vec::new();
        write_module(&module, &mut out);
        let ground = 52 + 8 + 4 * 8 + 2 * 6 + 8 * 2 + 4;
        assert_eq!(out.len(), ground + 3 * 8 + 6 + 2);
        let word = |place: usize| u32::from_le_bytes([0, 1, 2, 3].map(|byte| out[4 * place + byte]));
        assert_eq!([0, 1, 2, 3, 4, 5, 6, 9, 10, 11, 12].map(word), [3, 5, 4, 2, 1, 4, 2, 2, 3, 1, 0]);
        assert_eq!([13, 14].map(|place| f32::from_bits(word(place))), [1.0, 2.0]);
        assert_eq!(out[ground - 4..ground], [0, 1, 0, 0]);
        assert_eq!(out[out.len() - 8..], [0, 0, 1, 0, 2, 0, 2, 0]);
    }
}
