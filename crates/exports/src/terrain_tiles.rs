//! 3D Tiles as terrain, as CesiumJS reads them since 1.135: the tiles of quantized-mesh in binary glTF, with heights
//! as 32-bit floats, in two implicit quadtrees of 3D Tiles 1.1 whose subtrees say which tiles there are and where.

use std::collections::BTreeMap;
use std::f64::consts::{FRAC_PI_2, PI};

use serde_json::{Value, json};

use crate::earth::SEMI_MAJOR_M;
use crate::glb::container;
use crate::mesh::minus;
use crate::quantized::{Tile, TileNumbers};
use crate::{Datum, ExportError, Product, Put, QuantizedMesh, Work};

/// Levels of a subtree.
const SUBTREE_LEVELS: u32 = 7;
/// Metres that a tile of level 0 may be off: as viewers take it for heights of 64 samples to a tile.
const ROOT_ERROR_M: f64 = SEMI_MAJOR_M * PI / 2.0 / 128.0;
/// The type of 32-bit floats, and of whole numbers of 32 bits.
const F32: u32 = 5126;
const U32: u32 = 5125;

/// What is said of a tile beside its triangles: heights, sphere and horizon point.
type Facts = [f64; 9];

/// Writes `tileset.json`, and `ROOT/LEVEL/COLUMN/ROW.glb` and `.subtree` below the western root, 0, and the eastern, 1;
/// where there are holes, `holes.geojson`. `assumed` is what to take heights to be above; else the database says it.
/// Returns what was done to heights.
///
/// # Errors
/// When a file cannot be written, heights cannot be brought above the ellipsoid, or the work was asked to stop.
pub fn write_3dtiles_terrain(
    product: &Product,
    assumed: Option<Datum>,
    put: &Put,
    work: &Work,
) -> Result<Datum, ExportError> {
    let terrain = QuantizedMesh::of(product, assumed, work)?;
    let mut all = BTreeMap::new();
    for (what, tiles) in terrain.tiles() {
        let facts = work.each(what, &tiles, |&(level, col, row)| {
            let (bytes, facts) = glb(&terrain.tile(level, col, row));
            let (root, x) = below_root(level, col);
            put(&format!("{root}/{level}/{x}/{row}.glb"), &bytes)?;
            Ok(facts)
        })?;
        all.extend(tiles.into_iter().zip(facts));
    }
    for &(level, col, row) in all.keys().filter(|(level, ..)| level.is_multiple_of(SUBTREE_LEVELS)) {
        let (root, x) = below_root(level, col);
        put(&format!("{root}/{level}/{x}/{row}.subtree"), &subtree(&all, (level, col, row)))?;
    }
    if let Some(holes) = terrain.file("holes.geojson") {
        put("holes.geojson", &holes)?;
    }
    put("tileset.json", tileset(&terrain, product, &all).to_string().as_bytes())?;
    Ok(terrain.datum())
}

/// The root above a tile, and the column of the tile below that.
fn below_root(level: u32, col: i64) -> (i64, i64) {
    (col >> level, col & ((1 << level) - 1))
}

/// Turns a direction of the Earth's axes into those of glTF, which has y up.
fn turned([x, y, z]: [f64; 3]) -> [f64; 3] {
    [x, z, 0.0 - y]
}

/// The file of a tile, and what is said of it.
fn glb(tile: &Tile) -> (Vec<u8>, Facts) {
    let placed = tile.placed();
    let [low_m, high_m] = placed.heights_m();
    let mut binary = Vec::new();
    let (mut views, mut accessors) = (Vec::new(), Vec::new());
    let mut add = |kind: &str, component: u32, numbers: &[[u8; 4]], target: Option<u32>| {
        let mut view = json!({ "buffer": 0, "byteOffset": binary.len(), "byteLength": 4 * numbers.len() });
        if let Some(target) = target {
            view["target"] = json!(target);
        }
        let count = numbers.len() / if kind == "VEC3" { 3 } else { 1 };
        accessors.push(json!({ "bufferView": views.len(), "componentType": component, "count": count, "type": kind }));
        views.push(view);
        binary.extend_from_slice(numbers.as_flattened());
    };
    let floats = |vectors: &[[f64; 3]]| -> Vec<[u8; 4]> {
        vectors.as_flattened().iter().map(|&number| (number as f32).to_le_bytes()).collect()
    };
    let places: Vec<[f64; 3]> = placed.places.iter().map(|&place| turned(minus(place, placed.middle))).collect();
    let normals: Vec<[f64; 3]> = placed.nodes.iter().map(|node| turned(node.normal)).collect();
    add("VEC3", F32, &floats(&places), Some(34962));
    add("VEC3", F32, &floats(&normals), Some(34962));
    let whole = |numbers: &[u32]| -> Vec<[u8; 4]> { numbers.iter().map(|number| number.to_le_bytes()).collect() };
    add("SCALAR", U32, &whole(tile.triangles().as_flattened()), Some(34963));
    let [west, mut south, mut east, north] = tile.edges();
    // Once around, as skirts hang: to the north in the west, to the east in the north, and so on.
    south.reverse();
    east.reverse();
    [west, south, east, north].iter().for_each(|edge| add("SCALAR", U32, &whole(edge), None));
    let end = |pick: fn(f32, f32) -> f32, from: f32| {
        places.iter().fold([from; 3], |end, place| [0, 1, 2].map(|axis| pick(end[axis], place[axis] as f32)))
    };
    accessors[0]["min"] = json!(end(f32::min, f32::INFINITY));
    accessors[0]["max"] = json!(end(f32::max, f32::NEG_INFINITY));
    let [x, y, z] = turned(placed.middle);
    let document = json!({
        "asset": { "version": "2.0", "generator": "tiefort" },
        "extensionsUsed": ["CESIUM_tile_edges"],
        "scene": 0, "scenes": [{ "nodes": [0] }],
        "nodes": [{ "mesh": 0, "matrix": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, x, y, z, 1] }],
        "meshes": [{ "primitives": [{
            "attributes": { "POSITION": 0, "NORMAL": 1 }, "indices": 2, "mode": 4,
            "extensions": { "CESIUM_tile_edges": { "left": 3, "bottom": 4, "right": 5, "top": 6 } },
        }] }],
        "accessors": accessors, "bufferViews": views, "buffers": [{ "byteLength": binary.len() }],
    });
    let ([mx, my, mz], [hx, hy, hz]) = (placed.middle, placed.horizon);
    (container(&document, &binary), [low_m, high_m, mx, my, mz, placed.radius, hx, hy, hz])
}

/// The columns of the table of tiles: name, what it is to a viewer, type, first and end among the facts.
const COLUMNS: [(&str, &str, Kind, [usize; 2]); 4] = [
    ("minimumHeight", "TILE_MINIMUM_HEIGHT", Kind::Number, [0, 1]),
    ("maximumHeight", "TILE_MAXIMUM_HEIGHT", Kind::Number, [1, 2]),
    ("boundingSphere", "TILE_BOUNDING_SPHERE", Kind::Four, [2, 6]),
    ("horizonOcclusionPoint", "TILE_HORIZON_OCCLUSION_POINT", Kind::Vector, [6, 9]),
];

#[derive(Clone, Copy)]
enum Kind {
    Number,
    Four,
    Vector,
}

fn tileset(terrain: &QuantizedMesh<&Product>, product: &Product, all: &BTreeMap<TileNumbers, Facts>) -> Value {
    let heights = |at: usize| all.values().map(move |facts| facts[at]);
    let (low, high) = (heights(0).fold(f64::INFINITY, f64::min), heights(1).fold(f64::NEG_INFINITY, f64::max));
    let levels = all.keys().map(|(level, ..)| level + 1).max().unwrap_or(0);
    let root = |root: usize| {
        let west = [-PI, 0.0][root];
        json!({
            "boundingVolume": { "region": [west, -FRAC_PI_2, west + PI, FRAC_PI_2, low, high] },
            "geometricError": ROOT_ERROR_M,
            "refine": "REPLACE",
            "content": { "uri": format!("{root}/{{level}}/{{x}}/{{y}}.glb") },
            "implicitTiling": {
                "subdivisionScheme": "QUADTREE",
                "subtreeLevels": SUBTREE_LEVELS,
                "availableLevels": levels,
                "subtrees": { "uri": format!("{root}/{{level}}/{{x}}/{{y}}.subtree") },
            },
        })
    };
    let property = |(name, semantic, kind, _): (&str, &str, Kind, _)| {
        let mut property = json!({ "semantic": semantic, "componentType": "FLOAT64", "required": true });
        property["type"] = json!(if matches!(kind, Kind::Vector) { "VEC3" } else { "SCALAR" });
        if matches!(kind, Kind::Four) {
            (property["array"], property["count"]) = (json!(true), json!(4));
        }
        (name.to_owned(), property)
    };
    let properties: serde_json::Map<String, Value> = COLUMNS.into_iter().map(property).collect();
    json!({
        "asset": {
            "version": "1.1",
            "extras": {
                "generator": "tiefort", "area": product.manifest.area.name, "crs": product.crs(),
                "heights": terrain.datum().said(), "attribution": product.attributions(),
            },
        },
        "schema": { "id": "terrain", "classes": { "tile": { "properties": properties } } },
        "geometricError": 2.0 * ROOT_ERROR_M,
        "root": {
            "boundingVolume": { "region": [-PI, -FRAC_PI_2, PI, FRAC_PI_2, low, high] },
            "geometricError": 2.0 * ROOT_ERROR_M,
            "refine": "REPLACE",
            "children": [root(0), root(1)],
        },
    })
}

/// The file of the subtree below a tile: which tiles and which subtrees there are, in Morton order, and the table.
fn subtree(all: &BTreeMap<TileNumbers, Facts>, (level, col, row): TileNumbers) -> Vec<u8> {
    let below = |depth: u32| {
        let at = move |index: i64| {
            let [x, y] = [0, 1].map(|axis| (0..depth).fold(0, |at, bit| at | (index >> (2 * bit + axis) & 1) << bit));
            (level + depth, (col << depth) + x, (row << depth) + y)
        };
        (0..1_i64 << (2 * depth)).map(at)
    };
    let tiles: Vec<_> = (0..SUBTREE_LEVELS).flat_map(below).map(|tile| all.get(&tile)).collect();
    let subtrees: Vec<bool> = below(SUBTREE_LEVELS).map(|tile| all.contains_key(&tile)).collect();
    let there: Vec<&Facts> = tiles.iter().flatten().copied().collect();
    let (mut binary, mut views) = (Vec::new(), Vec::new());
    let mut add = |bytes: Vec<u8>| {
        views.push(json!({ "buffer": 0, "byteOffset": binary.len(), "byteLength": bytes.len() }));
        binary.extend(bytes);
        binary.resize(binary.len().next_multiple_of(8), 0);
        views.len() - 1
    };
    let tile_bits = add(bits(tiles.iter().map(Option::is_some)));
    let children = match subtrees.contains(&true) {
        true => json!({ "bitstream": add(bits(subtrees.iter().copied())) }),
        false => json!({ "constant": 0 }),
    };
    let mut properties = serde_json::Map::new();
    for (name, _, _, [first, end]) in COLUMNS {
        let numbers = there.iter().flat_map(|facts| &facts[first..end]);
        properties
            .insert(name.into(), json!({ "values": add(numbers.flat_map(|number| number.to_le_bytes()).collect()) }));
    }
    let document = json!({
        "buffers": [{ "byteLength": binary.len() }],
        "bufferViews": views,
        "tileAvailability": { "bitstream": tile_bits, "availableCount": there.len() },
        "contentAvailability": [{ "bitstream": tile_bits, "availableCount": there.len() }],
        "childSubtreeAvailability": children,
        "propertyTables": [{ "class": "tile", "count": there.len(), "properties": properties }],
        "tileMetadata": 0,
    });
    let mut text = document.to_string().into_bytes();
    text.resize(text.len().next_multiple_of(8), b' ');
    let mut file = b"subt\x01\0\0\0".to_vec();
    file.extend_from_slice(&(text.len() as u64).to_le_bytes());
    file.extend_from_slice(&(binary.len() as u64).to_le_bytes());
    file.extend(text);
    file.extend(binary);
    file
}

/// Bits as bytes, the first the lowest of its byte.
fn bits(bits: impl Iterator<Item = bool>) -> Vec<u8> {
    let bits: Vec<bool> = bits.collect();
    let byte = |part: &[bool]| (0..).zip(part).fold(0, |byte, (at, &bit)| byte | u8::from(bit) << at);
    bits.chunks(8).map(byte).collect()
}

#[cfg(test)]
mod tests {

    use super::*;
    use crate::samples;

    #[test]
    fn subtrees_have_a_bit_and_a_row_for_each_tile_that_there_is() {
        let files = samples::files(|put, work| write_3dtiles_terrain(&samples::with_hole(), None, put, work));
        assert!(files.contains_key("holes.geojson"));
        let tileset: Value = serde_json::from_slice(&files["tileset.json"]).unwrap();
        let levels = tileset["root"]["children"][1]["implicitTiling"]["availableLevels"].as_u64().unwrap();
        let mut found = 0;
        for (name, bytes) in files.iter().filter(|(name, _)| name.ends_with(".subtree")) {
            let numbers: Vec<i64> =
                name.trim_end_matches(".subtree").split('/').map(|part| part.parse().unwrap()).collect();
            let word = |at: usize| u64::from_le_bytes(bytes[at..at + 8].try_into().unwrap()) as usize;
            assert_eq!((&bytes[..8], bytes.len()), (&b"subt\x01\0\0\0"[..], 24 + word(8) + word(16)));
            let document: Value = serde_json::from_slice(&bytes[24..24 + word(8)]).unwrap();
            let view = |index: &Value| {
                let view = &document["bufferViews"][index.as_u64().unwrap() as usize];
                let [start, length] = ["byteOffset", "byteLength"].map(|key| view[key].as_u64().unwrap() as usize);
                &bytes[24 + word(8) + start..24 + word(8) + start + length]
            };
            let bit = |bits: &[u8], index: usize| bits[index / 8] >> (index % 8) & 1 == 1;
            let tiles = view(&document["tileAvailability"]["bitstream"]);
            let rows = document["propertyTables"][0]["count"].as_u64().unwrap() as usize;
            let lowest = view(&document["propertyTables"][0]["properties"]["minimumHeight"]["values"]);
            assert_eq!((bit(tiles, 0), lowest.len()), (true, 8 * rows), "{name}");
            let (mut at, mut own) = (0, 0);
            for depth in 0..=SUBTREE_LEVELS {
                for morton in 0..1_i64 << (2 * depth) {
                    let [x, y] =
                        [0, 1].map(|axis| (0..depth).map(|bit| (morton >> (2 * bit + axis) & 1) << bit).sum::<i64>());
                    let [level, col, row] =
                        [numbers[1] + i64::from(depth), (numbers[2] << depth) + x, (numbers[3] << depth) + y];
                    let tile = format!("{}/{level}/{col}/{row}", numbers[0]);
                    if depth == SUBTREE_LEVELS {
                        let children = &document["childSubtreeAvailability"]["bitstream"];
                        let has = !children.is_null() && bit(view(children), morton as usize);
                        assert_eq!(has, files.contains_key(&format!("{tile}.subtree")), "{tile}");
                        continue;
                    }
                    assert_eq!(bit(tiles, at), files.contains_key(&format!("{tile}.glb")), "{tile}");
                    own += usize::from(bit(tiles, at));
                    at += 1;
                }
            }
            assert_eq!(own, rows, "{name}");
            found += rows;
        }
        assert_eq!(found, files.keys().filter(|name| name.ends_with(".glb")).count());
        assert!(found as u64 > levels);
    }
}
