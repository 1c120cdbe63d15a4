//! Tests of whole exports, through a decoder of their own.

use super::*;
use crate::samples;

/// A tile as a reader of the format sees it.
struct Decoded {
    foot_m: f32,
    top_m: f32,
    /// u, v and height of each vertex.
    vertices: Vec<[i64; 3]>,
    triangles: Vec<[u32; 3]>,
    /// West, south, east and north.
    edges: [Vec<u32>; 4],
    normals: Vec<[u8; 2]>,
    /// By row from the north, or one for all.
    water: Option<Vec<u8>>,
    metadata: Option<Value>,
}

impl Decoded {
    /// Metres between heights that a vertex may have.
    fn step_m(&self) -> f64 {
        (f64::from(self.top_m) - f64::from(self.foot_m)) / STEPS as f64
    }

    fn height_m(&self, vertex: u32) -> f64 {
        f64::from(self.foot_m) + self.vertices[vertex as usize][2] as f64 * self.step_m()
    }
}

fn decode(bytes: &[u8]) -> Decoded {
    let u16_at = |at: usize| u16::from_le_bytes([bytes[at], bytes[at + 1]]);
    let u32_at = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap());
    let count = u32_at(88) as usize;
    assert!(count <= 65_536);
    let part = |part: usize| {
        let mut sum = 0;
        (0..count)
            .map(|i| {
                let folded = i64::from(u16_at(92 + 2 * (part * count + i)));
                sum += (folded >> 1) ^ -(folded & 1);
                sum
            })
            .collect::<Vec<i64>>()
    };
    let (u, v, h) = (part(0), part(1), part(2));
    let mut at = 92 + 6 * count;
    let triangle_count = u32_at(at) as usize;
    at += 4;
    let mut next = 0;
    let mut indices = Vec::new();
    for i in 0..3 * triangle_count {
        let code = u32::from(u16_at(at + 2 * i));
        indices.push(next - code);
        next += u32::from(code == 0);
    }
    at += 6 * triangle_count;
    let edges = std::array::from_fn(|_| {
        let length = u32_at(at) as usize;
        let edge = (0..length).map(|i| u32::from(u16_at(at + 4 + 2 * i))).collect();
        at += 4 + 2 * length;
        edge
    });
    assert_eq!((bytes[at], u32_at(at + 1) as usize), (1, 2 * count));
    let normals = bytes[at + 5..at + 5 + 2 * count].chunks_exact(2).map(|pair| [pair[0], pair[1]]).collect();
    at += 5 + 2 * count;
    let (mut water, mut metadata) = (None, None);
    while at < bytes.len() {
        let (number, data) = (bytes[at], &bytes[at + 5..at + 5 + u32_at(at + 1) as usize]);
        match number {
            2 => water = Some(data.to_vec()),
            4 => metadata = serde_json::from_slice(&data[4..]).unwrap(),
            _ => panic!("found extension {number}"),
        }
        at += 5 + data.len();
    }
    assert_eq!(at, bytes.len());
    let float = |at: usize| f32::from_le_bytes(bytes[at..at + 4].try_into().unwrap());
    Decoded {
        foot_m: float(24),
        top_m: float(28),
        vertices: (0..count).map(|i| [u[i], v[i], h[i]]).collect(),
        triangles: indices.chunks_exact(3).map(|t| [t[0], t[1], t[2]]).collect(),
        edges,
        normals,
        water,
        metadata,
    }
}

/// The sample where its sides run across meridians: the pole of Lambert's azimuthal projection is far away.
fn slanted() -> Product {
    let mut product = samples::product();
    product.manifest.area.crs = "EPSG:3035".into();
    (product.frame.origin_east_m, product.frame.origin_north_m) = (6_400_000.0, 4_900_000.0);
    product
}

fn exported(product: &Product) -> BTreeMap<String, Vec<u8>> {
    samples::files(|put, work| write_quantized_mesh(product, Some(Datum::Ellipsoid), put, work))
}

fn key(name: &str) -> (u32, i64, i64) {
    let parts: Vec<i64> = name.trim_end_matches(".terrain").split('/').map(|part| part.parse().unwrap()).collect();
    (parts[0] as u32, parts[1], parts[2])
}

#[test]
fn tiles_are_covered_listed_and_agree_on_their_borders() {
    for product in [samples::product(), slanted()] {
        check_tiles(&exported(&product));
    }
}

fn check_tiles(files: &BTreeMap<String, Vec<u8>>) {
    let layer: Value = serde_json::from_slice(&files["layer.json"]).unwrap();
    let available = layer["available"].as_array().unwrap();
    let tiles: BTreeMap<(u32, i64, i64), Decoded> = files
        .iter()
        .filter(|(name, _)| name.ends_with(".terrain"))
        .map(|(name, bytes)| (key(name), decode(bytes)))
        .collect();
    let mut listed = 0;
    for (level, ranges) in available.iter().enumerate() {
        let of = |name: &str| ranges[0][name].as_i64().unwrap();
        for col in of("startX")..=of("endX") {
            for row in of("startY")..=of("endY") {
                assert!(tiles.contains_key(&(level as u32, col, row)), "{level}/{col}/{row} is listed");
                listed += 1;
            }
        }
    }
    assert_eq!(listed, tiles.len());
    check_metadata(&tiles);
    assert!(tiles.contains_key(&(0, 0, 0)) && tiles.contains_key(&(0, 1, 0)));
    let mut compared = 0;
    for (&(level, col, row), tile) in &tiles {
        let area: i64 = tile
            .triangles
            .iter()
            .map(|t| {
                let [a, b, c] = t.map(|v| tile.vertices[v as usize]);
                (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
            })
            .sum();
        assert_eq!(area, 2 * STEPS * STEPS, "{level}/{col}/{row}");
        assert!(tile.vertices.iter().flatten().all(|part| (0..=STEPS).contains(part)));
        // The header has the tile's own lowest and highest height.
        let heights = || tile.vertices.iter().map(|vertex| vertex[2]);
        let highest = if tile.foot_m < tile.top_m { STEPS } else { 0 };
        assert_eq!((heights().min(), heights().max()), (Some(0), Some(highest)), "{level}/{col}/{row}");
        for (neighbour, mine, theirs, along) in [((level, col + 1, row), 2, 0, 1), ((level, col, row + 1), 3, 1, 0)] {
            let Some(other) = tiles.get(&neighbour) else { continue };
            let line = |tile: &Decoded, edge: usize| -> Vec<(i64, [u8; 2])> {
                tile.edges[edge].iter().map(|&v| (tile.vertices[v as usize][along], tile.normals[v as usize])).collect()
            };
            assert_eq!(line(tile, mine), line(other, theirs), "{level}/{col}/{row}");
            for (&own, &their) in tile.edges[mine].iter().zip(&other.edges[theirs]) {
                let [own_m, their_m] = [tile.height_m(own), other.height_m(their)];
                let half_steps_m = (tile.step_m() + other.step_m()) / 2.0;
                assert!((own_m - their_m).abs() <= half_steps_m + 1e-9, "{level}/{col}/{row}: {own_m} {their_m}");
            }
            compared += 1;
        }
    }
    assert!(0 < compared);
}

/// Both roots, and every tile that is told of below them, tell of all tiles.
fn check_metadata(tiles: &BTreeMap<(u32, i64, i64), Decoded>) {
    let mut told: BTreeSet<(u32, i64, i64)> = [(0, 0, 0), (0, 1, 0)].into();
    for (&(level, col, row), tile) in tiles {
        assert_eq!(tile.metadata.is_some(), level % METADATA_LEVELS == 0, "{level}/{col}/{row}");
        for (below, ranges) in tile.metadata.iter().flat_map(|told| told["available"].as_array().unwrap()).enumerate() {
            for range in ranges.as_array().unwrap() {
                let of = |name: &str| range[name].as_i64().unwrap();
                let cols = of("startX")..=of("endX");
                let below = level + 1 + below as u32;
                told.extend(cols.flat_map(|col| (of("startY")..=of("endY")).map(move |row| (below, col, row))));
            }
        }
    }
    assert!(told.iter().eq(tiles.keys()));
}

#[test]
fn a_mask_says_where_water_is_and_there_is_none_without_water() {
    let mut product = samples::product();
    let dry = exported(&product);
    assert!(dry.iter().filter(|(name, _)| name.ends_with("terrain")).all(|(_, bytes)| decode(bytes).water.is_none()));
    // All of its ground; not that around it.
    product.water = vec![product.modules[0].classes[0]];
    let files = exported(&product);
    let layer: Value = serde_json::from_slice(&files["layer.json"]).unwrap();
    assert!(layer["extensions"].as_array().unwrap().contains(&json!("watermask")));
    let earth = Earth::new(&product, Some(Datum::Ellipsoid)).unwrap();
    let level = finest_level(product.side_m());
    let (mut wet, mut off) = (0, 0);
    let mut index = TriangleIndex::new(&product);
    for (name, bytes) in files.iter().filter(|(name, _)| name.ends_with("terrain")) {
        let (of, col, row) = key(name);
        let mask = decode(bytes).water.unwrap();
        assert!([1, 65_536].contains(&mask.len()) && mask.iter().all(|byte| [0, 255].contains(byte)), "{name}");
        for (number, &byte) in mask.iter().enumerate().filter(|_| level - 1 <= of && mask.len() != 1) {
            let (i, j) = (number as i64 % CELLS, CELLS - 1 - number as i64 / CELLS);
            let middle = |tile: i64, cell: i64| tile * STEPS + (2 * cell + 1) * STEPS / (2 * CELLS);
            let place = earth.place_m(lon_lat(of, [middle(col, i), middle(row, j)])).unwrap();
            let [x, y] = [place[0] - 505_000.0, place[1] - 3_875_000.0];
            let is_inside = 0.0 < x && x < 1000.0 && 0.0 < y && y < 500.0;
            let is_water = is_inside && index.at(place).map(|ground| ground.class) == Some(product.water[0]);
            wet += u32::from(is_water);
            off += u32::from((byte == 255) != is_water);
        }
    }
    assert!(1000 < wet && 100 * off < wet, "{off} of {wet}");
}

#[test]
fn the_finest_tiles_have_the_heights_of_the_load_modules() {
    let product = samples::product();
    let files = exported(&product);
    let earth = Earth::new(&product, Some(Datum::Ellipsoid)).unwrap();
    let level = finest_level(product.side_m());
    let mut found = 0;
    let mut index = TriangleIndex::new(&product);
    for (name, bytes) in files.iter().filter(|(name, _)| name.starts_with(&format!("{level}/"))) {
        let (_, col, row) = key(name);
        let tile = decode(bytes);
        for (vertex, &[u, v, _]) in (0..).zip(&tile.vertices) {
            let place = earth.place_m(lon_lat(level, [col * STEPS + u, row * STEPS + v])).unwrap();
            let inside = (505_000.0..506_000.0).contains(&place[0]) && (3_875_000.0..3_875_500.0).contains(&place[1]);
            if inside {
                let height = tile.height_m(vertex);
                let expected = index.at(place).unwrap().height_m;
                assert!((height - expected).abs() < tile.step_m() / 2.0 + 0.02, "{height} {expected}");
                found += 1;
            }
        }
    }
    assert!(3 < found, "{found}");
}

#[test]
fn holes_are_closed_and_a_file_beside_the_tiles_says_where() {
    let product = samples::with_hole();
    let files = exported(&product);
    check_tiles(&files);
    let holes: Value = serde_json::from_slice(&files["holes.geojson"]).unwrap();
    let triangles = holes["features"][0]["geometry"]["coordinates"].as_array().unwrap();
    assert_eq!(triangles.len(), 2);
    let earth = Earth::new(&product, Some(Datum::Ellipsoid)).unwrap();
    for ring in triangles.iter().map(|polygon| polygon[0].as_array().unwrap()) {
        assert!(ring.len() == 4 && ring[0] == ring[3]);
        for place in ring {
            let at = earth.place_m([place[0].as_f64().unwrap(), place[1].as_f64().unwrap()]).unwrap();
            // The eastern load module, whose south-west corner is ground.
            let [east_m, north_m] = [at[0] - 505_500.0, at[1] - 3_875_000.0];
            assert!((-0.1..500.1).contains(&east_m) && 100.0 < east_m + north_m, "{at:?}");
        }
    }
    let layer: Value = serde_json::from_slice(&files["layer.json"]).unwrap();
    assert!(layer["description"].as_str().unwrap().contains("holes.geojson"));
    assert!(!exported(&samples::product()).contains_key("holes.geojson"));
}
