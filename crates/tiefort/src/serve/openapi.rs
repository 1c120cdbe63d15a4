//! What can be asked, for programs: an OpenAPI 3.1 document of the addresses of databases, which the router writes as
//! it does.

use serde_json::{Value, json};

const DESCRIPTION: &str = "Terrain databases over HTTP. With one database, all its addresses also work without \
    /{database}. Places are metres of the area's own system, east before north; rows and columns count from the \
    south-west. Every answer comes from one finished build: while a database is being built the answer is 503, and \
    afterwards it is the new one. Files have an ETag (If-None-Match: 304) and come packed with gzip to clients that \
    accept it. Refusals are JSON with error and hint.";

/// The document.
pub fn document() -> Value {
    json!({
        "openapi": "3.1.0",
        "info": { "title": "tiefort serve", "version": env!("CARGO_PKG_VERSION"), "description": DESCRIPTION },
        "servers": [{ "url": "/" }],
        "paths": {
            DATABASES: { "get": get("Every database", "", &[], &[("application/json", "the list")]) },
            DATABASE: {
                "get": get("One database", "System, corner, size.", &["database"], &[("application/json", "it")]),
            },
            LAYER: { "get": get(
                "Terrain for globes: layer.json",
                "CesiumTerrainProvider.fromUrl() takes the address of the folder.",
                &["database"],
                &[("application/json", "the layer, as `tiefort export --format quantized-mesh` writes it")],
            ) },
            TERRAIN: { "get": get(
                "A tile of terrain",
                "Quantized-mesh 1.0 with normals, the bytes of the export.",
                &["database", "z", "x", "file"],
                &[("application/vnd.quantized-mesh", "the tile")],
            ) },
            HOLES: { "get": get(
                "Where terrain is closed over ground without heights",
                "404 where there are no holes.",
                &["database"],
                &[("application/geo+json", "polygons")],
            ) },
            TILESET: { "get": get(
                "3D Tiles for globes: tileset.json",
                "Cesium3DTileset.fromUrl() takes this address.",
                &["database"],
                &[("application/json", "the tileset, as `tiefort export --format 3dtiles` writes it")],
            ) },
            SQUARE: { "get": glb("The coarse mesh of a 4 km square", &["database", "file"]) },
            GROUP: { "get": glb("A group of load modules", &["database", "file"]) },
            LEVEL: { "get": glb("A square at a coarser level of detail", &["database", "level", "file"]) },
            MODULES: { "get": get(
                "The files of load modules",
                "With the load modules in each, its length and its BLAKE3 checksum.",
                &["database"],
                &[("application/json", "the list")],
            ) },
            MODULE: { "get": module() },
            HEIGHTS: { "post": heights() },
            SIGHT: { "post": line_of_sight() },
            VIEWSHED: { "get": viewshed() },
            PROFILE: { "get": profile() },
            OBSTACLE: { "get": obstacle() },
            EXPLAIN: { "get": explain() },
        },
    })
}

fn get(summary: &str, description: &str, parameters: &[&str], kinds: &[(&str, &str)]) -> Value {
    let content: serde_json::Map<String, Value> =
        kinds.iter().map(|(kind, _)| ((*kind).to_owned(), json!({}))).collect();
    let said: Vec<&str> = kinds.iter().map(|(_, said)| *said).collect();
    json!({
        "summary": summary,
        "description": description,
        "parameters": parameters.iter().map(|name| in_path(name)).collect::<Vec<_>>(),
        "responses": {
            "200": { "description": said.join(", "), "content": content },
            "403": { "description": OTHER_HOST },
            "404": { "description": "no such database or file" },
            "409": { "description": "what the database holds does not allow it: error says why" },
            "503": { "description": "the database is being built, damaged or not there: error says which" },
        },
    })
}

fn in_path(name: &str) -> Value {
    let (kind, description) = match name {
        "database" => ("string", "name of the folder"),
        "z" => ("integer", "level of the tile"),
        "x" => ("integer", "column of the tile"),
        "level" => ("integer", "level of detail"),
        _ => ("string", "name of the file"),
    };
    json!({ "name": name, "in": "path", "required": true, "description": description, "schema": { "type": kind } })
}

fn in_query(name: &str, kind: &str, description: &str) -> Value {
    json!({ "name": name, "in": "query", "description": description, "schema": { "type": kind } })
}

fn glb(summary: &str, parameters: &[&str]) -> Value {
    get(summary, "A content of tileset.json.", parameters, &[("model/gltf-binary", "binary glTF 2.0")])
}

fn module() -> Value {
    let description = "r02c03.slm is the file of a tile as it lies in the database, r0012c0034.slm that of one load \
                       module as `tiefort export --format modules` writes it. Range gives a part.";
    let mut operation =
        get("A file of load modules", description, &["database", "file"], &[("application/octet-stream", "the file")]);
    operation["responses"]["206"] = json!({ "description": "the part that Range asks for" });
    operation["responses"]["416"] = json!({ "description": "a range outside the file" });
    operation
}

/// What heights and lines of sight have in common.
fn query(summary: &str, description: &str, query: &[Value], json_body: Value, raw: [&str; 2], answer: Value) -> Value {
    let raw_kind =
        |description: &str| json!({ "schema": { "type": "string", "format": "binary", "description": description } });
    let parameters: Vec<Value> = std::iter::once(in_path("database")).chain(query.iter().cloned()).collect();
    json!({
        "summary": summary,
        "description": description,
        "parameters": parameters,
        "requestBody": {
            "required": true,
            "content": { "application/json": json_body, "application/octet-stream": raw_kind(raw[0]) },
        },
        "responses": {
            "200": {
                "description": format!("as JSON; or, to raw numbers, {}", raw[1]),
                "content": { "application/json": answer, "application/octet-stream": raw_kind(raw[1]) },
            },
            "400": { "description": "a body that cannot be read: error says where, hint what to send" },
            "403": { "description": OTHER_HOST },
            "408": { "description": "a body that came too slowly" },
            "413": { "description": "a body that is too large" },
            "415": { "description": "a body that is neither JSON nor raw numbers, as its Content-Type says" },
            "422": { "description": "a line of sight that is too long" },
            "503": { "description": "the database is being built, damaged or not there: error says which" },
        },
    })
}

fn list(item: Value, description: &str) -> Value {
    json!({ "type": "array", "items": item, "description": description })
}

fn numbers(count: usize) -> Value {
    json!({ "type": "array", "items": { "type": "number" }, "minItems": count, "maxItems": count })
}

fn level() -> Value {
    in_query("level", "integer", "level of detail, 0 being the finest; with raw numbers, JSON has it in its body")
}

fn heights() -> Value {
    let ceiling = "the topmost of ground and decks not above this height; without it, the ground";
    let body = json!({
        "schema": {
            "type": "object",
            "required": ["positions"],
            "additionalProperties": false,
            "description": "positions as [east, north]; level and ceiling may be left out",
            "properties": {
                "positions": list(numbers(2), "east and north"),
                "level": { "type": "integer", "minimum": 0 },
                "ceiling": { "type": "number", "description": ceiling },
                "objects": { "enum": ["none", "buildings", "all"], "default": "none", "description": TOPS },
            },
        },
        "example": { "positions": [[530125.0, 3899310.5], [530150.0, 3899310.5]], "level": 0 },
    });
    let answer = json!({
        "schema": {
            "type": "object",
            "properties": {
                "heights": list(json!({ "type": ["number", "null"] }), "null outside the area"),
                "top_of": list(json!({ "type": ["string", "null"] }), "with objects: what each belongs to"),
            },
        },
    });
    query(
        "Heights at positions",
        "Numbers in JSON are finite, and a height is null outside the area. A raw position that is not a number, \
         infinite or outside is answered with NaN.",
        &[
            level(),
            in_query("ceiling", "number", &format!("with raw numbers: {ceiling}")),
            in_query("objects", "string", &format!("with raw numbers: {TOPS}")),
        ],
        body,
        [
            "little-endian 64-bit floats, two for each position: east, north",
            "little-endian 64-bit floats, one for each position; NaN where there is no height",
        ],
        answer,
    )
}

fn line_of_sight() -> Value {
    let body = json!({
        "schema": {
            "type": "object",
            "required": ["lines"],
            "additionalProperties": false,
            "description": "lines as [east, north, height, east, north, height]",
            "properties": {
                "lines": list(numbers(6), "from, then to"),
                "level": { "type": "integer", "minimum": 0 },
                "objects": { "enum": ["all", "buildings", "none"], "default": "all", "description": OBJECTS },
                "above_ground": { "type": "boolean", "default": false, "description": ABOVE_GROUND },
                "curvature": { "type": "boolean", "default": false, "description": CURVATURE },
            },
        },
        "example": { "lines": [[530125.0, 3899310.5, 720.0, 531600.0, 3899700.0, 715.0]], "objects": "all" },
    });
    let or_null = |of: &str, description: &str| json!({ "type": [of, "null"], "description": description });
    let answer = json!({
        "schema": {
            "type": "object",
            "properties": { "lines": list(json!({
                "type": "object",
                "properties": {
                    "visible": or_null("boolean", "null where it leaves the area before anything blocks it"),
                    "blocked_at": or_null("number", "share of the line at which it ends: at something, or in woods \
                        where less than half of the light is left"),
                    "blocker": or_null("array", "east, north and height of the line there"),
                    "hidden_by": or_null("string", "what it ends at: ground, deck, building, wood, row or wall"),
                    "transmission": or_null("number", "share of light that woods leave on the way"),
                    "wood_m": or_null("number", "metres of the line inside woods"),
                    "ends": list(numbers(3), "with above_ground: east, north and height of both ends"),
                    "clearance_m": or_null("number", "least height above the ground, below 0 where blocked"),
                },
            }), "in the order of the lines") },
        },
    });
    query(
        "Lines of sight",
        "Ground and decks stand in the way, and buildings, walls and woods where the database has some. Heights are \
         above the area's vertical datum, unless above_ground says otherwise.",
        &[
            level(),
            in_query("objects", "string", OBJECTS),
            in_query("above_ground", "boolean", ABOVE_GROUND),
            in_query("curvature", "boolean", CURVATURE),
        ],
        body,
        [
            "little-endian 64-bit floats, six for each line",
            "little-endian 64-bit floats, five for each line: 1 visible, 0 not, NaN unknown; share of the line at \
             which it is blocked; least height above the ground in metres; what hides it, 0 ground, 1 deck, 2 \
             building, 3 wood, 4 row, 5 wall; share of light that woods leave; NaN where there is none",
        ],
        answer,
    )
}

const OTHER_HOST: &str = "a request under another name than this machine's own, unless --host opens the service";
const OBJECTS: &str = "which objects are looked at: all, buildings (with walls) or none";
const TOPS: &str = "of what heights are: none, the ground; buildings, the highest of ground, decks and roofs; all, \
    with the tops of woods and rows";
const ABOVE_GROUND: &str = "whether heights of both ends are metres above the ground";
const CURVATURE: &str = "whether the earth falls away as it does, and air bends light";

/// A question by address; parameters are name, kind, description and an example where it has to be there.
fn asked(summary: &str, description: &str, kind: (&str, &str), query: &[(&str, &str, &str, Option<&str>)]) -> Value {
    let mut operation = get(summary, description, &["database"], &[kind]);
    if let Some(parameters) = operation["parameters"].as_array_mut() {
        for (name, kind, description, example) in query {
            let mut parameter = in_query(name, kind, description);
            if let Some(example) = example {
                parameter["required"] = true.into();
                parameter["example"] = (*example).into();
            }
            parameters.push(parameter);
        }
    }
    operation["responses"]["400"] = json!({ "description": "what cannot be asked: error says why" });
    operation["responses"]["422"] = json!({ "description": "more load modules than are read for one answer" });
    operation
}

fn viewshed() -> Value {
    asked(
        "What is seen around a place",
        "As `tiefort sight --range`. What is hidden by ground, decks or objects, or is left less than half of the \
         light by woods, is not seen.",
        (
            "application/octet-stream",
            "little-endian: places along a side (u32), metres between them (f32); then row by row from the north, west \
             to east, 1 seen, 0 hidden, 255 not looked at (u8); then, in the same order, per cent of the light that is \
             left, 255 not looked at (u8); the eye is in the middle",
        ),
        &[
            ("from", "string", "EAST,NORTH,ABOVE of the eye, the last above the ground", Some("530125,3899310,2.5")),
            ("range_m", "number", "how far it sees", Some("5000")),
            ("target_m", "number", "metres above the ground of what it looks at; else 0", None),
            ("spacing_m", "number", "metres between places; else 25", None),
            ("level", "integer", "level of detail, 0 being the finest", None),
            ("objects", "string", OBJECTS, None),
            ("curvature", "boolean", CURVATURE, None),
            ("target_on", "string", "whether what it looks at stands on the ground or, with roof, on roofs", None),
        ],
    )
}

fn profile() -> Value {
    asked(
        "Heights along a line",
        "As `tiefort profile`: at both ends, and at equal steps between.",
        (
            "application/json",
            "along_m, metres from the beginning; height_m of the ground there, null where it has none; with objects \
             also top_m and top_of",
        ),
        &[
            ("from", "string", "EAST,NORTH of the beginning", Some("530125,3899310")),
            ("to", "string", "EAST,NORTH of the end", Some("531600,3899700")),
            ("spacing_m", "number", "metres between heights; else 25", None),
            ("level", "integer", "level of detail, 0 being the finest", None),
            ("objects", "string", "buildings or all: also the highest of ground, decks, roofs and crowns", None),
        ],
    )
}

fn obstacle() -> Value {
    asked(
        "What a vehicle hits",
        "The nearest building, tower or wall within a radius, else the wood or row whose stems stand closest together.",
        (
            "application/json",
            "obstacle: its kind, id, distance_m and, of what has stems, spacing_m; null where the way is free",
        ),
        &[
            ("at", "string", "EAST,NORTH,ABOVE of its wheels, the last above the ground", Some("530125,3899310,0")),
            ("radius_m", "number", "how far it reaches around that place", Some("2")),
        ],
    )
}

fn explain() -> Value {
    let mut operation = get(
        "One load module, explained",
        "What it holds, what limits refused there. It reads up to 16,384 load modules: one is answered at a time.",
        &["database"],
        &[("application/json", "as `tiefort explain --format json` prints it")],
    );
    if let Some(parameters) = operation["parameters"].as_array_mut() {
        parameters.extend([
            in_query("module", "string", "ROW,COL of the load module"),
            in_query("at", "string", "or EAST,NORTH of a place in it"),
            in_query("one_more", "boolean", "true also reads the sources, and tells what one more point would buy"),
        ]);
    }
    operation["responses"]["400"] = json!({ "description": "neither module nor at, or one that cannot be read" });
    operation
}

pub const DATABASES: &str = "/databases.json";
pub const DATABASE: &str = "/{database}";
pub const LAYER: &str = "/{database}/layer.json";
pub const TERRAIN: &str = "/{database}/{z}/{x}/{file}";
pub const HOLES: &str = "/{database}/holes.geojson";
pub const TILESET: &str = "/{database}/tileset.json";
pub const SQUARE: &str = "/{database}/squares/{file}";
pub const GROUP: &str = "/{database}/groups/{file}";
pub const LEVEL: &str = "/{database}/levels/{level}/{file}";
pub const MODULES: &str = "/{database}/modules";
pub const MODULE: &str = "/{database}/modules/{file}";
pub const HEIGHTS: &str = "/{database}/heights";
pub const SIGHT: &str = "/{database}/line-of-sight";
pub const VIEWSHED: &str = "/{database}/viewshed";
pub const PROFILE: &str = "/{database}/profile";
pub const OBSTACLE: &str = "/{database}/obstacle";
pub const EXPLAIN: &str = "/{database}/explain";
