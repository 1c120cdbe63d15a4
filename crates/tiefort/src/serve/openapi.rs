//! What can be asked, for programs: an OpenAPI 3.1 document of the addresses in [`super::paths`].

use serde_json::{Value, json};

use super::paths;

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
            paths::DATABASES: { "get": get("Every database", "", &[], &[("application/json", "the list")]) },
            paths::DATABASE: {
                "get": get("One database", "System, corner, size.", &["database"], &[("application/json", "it")]),
            },
            paths::LAYER: { "get": get(
                "Terrain for globes: layer.json",
                "CesiumTerrainProvider.fromUrl() takes the address of the folder.",
                &["database"],
                &[("application/json", "the layer, as `tiefort export --format quantized-mesh` writes it")],
            ) },
            paths::TERRAIN: { "get": get(
                "A tile of terrain",
                "Quantized-mesh 1.0 with normals, the bytes of the export.",
                &["database", "z", "x", "file"],
                &[("application/vnd.quantized-mesh", "the tile")],
            ) },
            paths::HOLES: { "get": get(
                "Where terrain is closed over ground without heights",
                "404 where there are no holes.",
                &["database"],
                &[("application/geo+json", "polygons")],
            ) },
            paths::TILESET: { "get": get(
                "3D Tiles for globes: tileset.json",
                "Cesium3DTileset.fromUrl() takes this address.",
                &["database"],
                &[("application/json", "the tileset, as `tiefort export --format 3dtiles` writes it")],
            ) },
            paths::SQUARE: { "get": glb("The coarse mesh of a 4 km square", &["database", "file"]) },
            paths::GROUP: { "get": glb("A group of load modules", &["database", "file"]) },
            paths::LEVEL: { "get": glb("A square at a coarser level of detail", &["database", "level", "file"]) },
            paths::MODULES: { "get": get(
                "The files of load modules",
                "With the load modules in each, its length and its BLAKE3 checksum.",
                &["database"],
                &[("application/json", "the list")],
            ) },
            paths::MODULE: { "get": module() },
            paths::HEIGHTS: { "post": heights() },
            paths::SIGHT: { "post": line_of_sight() },
            paths::EXPLAIN: { "get": explain() },
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
            "404": { "description": "no such database or file" },
            "409": { "description": "what the database holds does not allow it: error says why" },
            "503": { "description": "the database is being built, or not there: ask again" },
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
            "408": { "description": "a body that came too slowly" },
            "413": { "description": "a body that is too large" },
            "422": { "description": "a line of sight that is too long" },
            "503": { "description": "the database is being built, or not there: ask again" },
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
            },
        },
        "example": { "positions": [[530125.0, 3899310.5], [530150.0, 3899310.5]], "level": 0 },
    });
    let answer = json!({
        "schema": {
            "type": "object",
            "properties": { "heights": list(json!({ "type": ["number", "null"] }), "null outside the area") },
        },
    });
    query(
        "Heights at positions",
        "Numbers in JSON are finite, and a height is null outside the area. A raw position that is not a number, \
         infinite or outside is answered with NaN.",
        &[level(), in_query("ceiling", "number", &format!("with raw numbers: {ceiling}"))],
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
            },
        },
        "example": { "lines": [[530125.0, 3899310.5, 720.0, 531600.0, 3899700.0, 715.0]] },
    });
    let or_null = |of: &str, description: &str| json!({ "type": [of, "null"], "description": description });
    let answer = json!({
        "schema": {
            "type": "object",
            "properties": { "lines": list(json!({
                "type": "object",
                "properties": {
                    "visible": or_null("boolean", "null where it leaves the area before anything blocks it"),
                    "blocked_at": or_null("number", "share of the line at which something first stands in its way"),
                    "blocker": or_null("array", "east, north and height of the line there"),
                    "clearance_m": or_null("number", "least height above the ground, below 0 where blocked"),
                },
            }), "in the order of the lines") },
        },
    });
    query(
        "Lines of sight",
        "Ground and decks stand in the way. Heights are above the area's vertical datum.",
        &[level()],
        body,
        [
            "little-endian 64-bit floats, six for each line",
            "little-endian 64-bit floats, three for each line: 1 visible, 0 not, NaN unknown; share of the line at \
             which it is blocked; least height above the ground in metres; NaN where there is none",
        ],
        answer,
    )
}

fn explain() -> Value {
    let mut operation = get(
        "One load module, explained",
        "What it holds, what limits refused there. It reads the whole database: one is answered at a time.",
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
