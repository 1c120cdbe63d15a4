//! Exports read back by decoders of their own, and looked at from above.

use std::path::Path;
use std::sync::Arc;

use rusqlite::Connection;
use serde_json::Value;
use terrain::{Draped, ModuleRect};
use tiff::encoder::TiffEncoder;
use tiff::encoder::colortype::Gray8;
use tiff::tags::Tag;

use crate::samples::{self, files, with_work};
use crate::{ByteRaster, Coordinates, Mesh, Product, TextureFile, Textures};

/// A mesh of a binary glTF: its name and material, and its triangles with y up.
pub(crate) struct Found {
    pub node: String,
    pub material: String,
    pub triangles: Vec<[[f64; 3]; 3]>,
}

/// The document of a binary glTF, and its numbers.
pub(crate) fn document(bytes: &[u8]) -> (Value, &[u8]) {
    let word = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap()) as usize;
    let json = word(12);
    (serde_json::from_slice(&bytes[20..20 + json]).unwrap(), &bytes[28 + json..])
}

fn number(value: &Value) -> usize {
    value.as_u64().unwrap() as usize
}

/// The numbers of an accessor, vector by vector.
fn accessor(document: &Value, binary: &[u8], index: &Value) -> Vec<Vec<f64>> {
    let accessor = &document["accessors"][number(index)];
    let view = &document["bufferViews"][number(&accessor["bufferView"])];
    let start = number(&view["byteOffset"]) + number(&accessor["byteOffset"]);
    let parts = match accessor["type"].as_str().unwrap() {
        "VEC3" => 3,
        "VEC2" => 2,
        _ => 1,
    };
    let size = match number(&accessor["componentType"]) {
        5121 => 1,
        5123 => 2,
        _ => 4,
    };
    let stride = view["byteStride"].as_u64().map_or(parts * size, |stride| stride as usize);
    let read = |at: usize| match number(&accessor["componentType"]) {
        5121 => f64::from(binary[at]),
        5123 => f64::from(u16::from_le_bytes([binary[at], binary[at + 1]])),
        5125 => f64::from(u32::from_le_bytes(binary[at..at + 4].try_into().unwrap())),
        _ => f64::from(f32::from_le_bytes(binary[at..at + 4].try_into().unwrap())),
    };
    let vector = |n: usize| (0..parts).map(|part| read(start + n * stride + part * size)).collect();
    (0..number(&accessor["count"])).map(vector).collect()
}

/// The meshes of a binary glTF.
pub(crate) fn meshes(bytes: &[u8]) -> Vec<Found> {
    let (document, binary) = document(bytes);
    let mut found = Vec::new();
    for node in document["nodes"].as_array().unwrap().iter().filter(|node| node.get("mesh").is_some()) {
        for primitive in document["meshes"][number(&node["mesh"])]["primitives"].as_array().unwrap() {
            let places = accessor(&document, binary, &primitive["attributes"]["POSITION"]);
            let corners: Vec<[f64; 3]> = accessor(&document, binary, &primitive["indices"])
                .into_iter()
                .map(|index| <[f64; 3]>::try_from(places[index[0] as usize].clone()).unwrap())
                .collect();
            found.push(Found {
                node: node["name"].as_str().unwrap().to_owned(),
                material: document["materials"][number(&primitive["material"])]["name"].as_str().unwrap().to_owned(),
                triangles: corners.as_chunks::<3>().0.to_vec(),
            });
        }
    }
    found
}

/// The highest triangle over a place, by its height and its material.
fn from_above(meshes: &[Found], [east, north]: [f64; 2]) -> Option<(f64, &str)> {
    let hit = |[a, b, c]: &[[f64; 3]; 3]| {
        let side = |p: &[f64; 3], q: &[f64; 3]| (q[0] - p[0]) * (north + p[2]) - (p[2] - q[2]) * (east - p[0]);
        let (of_a, of_b, of_c) = (side(b, c), side(c, a), side(a, b));
        let all = of_a + of_b + of_c;
        let is_over = 0.0 < all && [of_a, of_b, of_c].iter().all(|part| -1e-9 * all <= *part);
        is_over.then(|| (of_a * a[1] + of_b * b[1] + of_c * c[1]) / all)
    };
    let all = meshes.iter().flat_map(|mesh| mesh.triangles.iter().map(move |triangle| (hit(triangle), mesh)));
    let hits = all.filter_map(|(height, mesh)| Some((height?, mesh.material.as_str())));
    hits.max_by(|(a, _), (b, _)| a.total_cmp(b))
}

fn glb(product: &Product) -> Vec<u8> {
    let mut bytes = Vec::new();
    let texture = product.texture(product.rect, 0.0).unwrap();
    crate::write_glb(&mut bytes, product, &Mesh::of(product), texture).unwrap();
    bytes
}

#[test]
fn rays_from_above_meet_roofs_woods_and_the_ground_of_courtyards() {
    let product = samples::with_objects();
    let found = meshes(&glb(&product));
    let at = |x: f64, y: f64| from_above(&found, [x / 128.0, y / 128.0]).unwrap();
    assert_eq!(at(60_500.0, 25_000.0), (129_500.0 / 128.0, "building_roof"));
    assert_eq!(at(66_000.0, 23_000.0), (129_500.0 / 128.0, "building_roof"));
    assert_eq!(at(1_200.0, 1_300.0), (135_000.0 / 128.0, "tower_roof"));
    assert_eq!(at(62_000.0, 23_000.0).1, "class_0", "a courtyard");
    // 15 m above the ground right below, on both sides of the line between load modules.
    let bare = meshes(&glb(&samples::product()));
    for (x, y) in [(51_000.0, 41_000.0), (60_000.0, 49_000.0), (70_000.0, 41_500.0), (90_000.0, 48_500.0)] {
        let ground = from_above(&bare, [x / 128.0, y / 128.0]).unwrap().0;
        let (top, material) = at(x, y);
        assert!((top - ground - 15.0).abs() < 0.01 && material == "wood_top", "{top} {ground} {material}");
    }
}

#[test]
fn an_object_is_a_node_with_its_number_and_has_no_wall_where_it_goes_on() {
    let bytes = glb(&samples::with_objects());
    let (document, _) = document(&bytes);
    let nodes = document["nodes"].as_array().unwrap();
    let house = nodes.iter().find(|node| node["name"] == "building_7").unwrap();
    assert_eq!(house["extras"], serde_json::json!({ "id": "7", "class": "building", "height_m": 10.9375 }));
    let parent = nodes.iter().find(|node| node["name"] == "objects").unwrap();
    assert_eq!(parent["children"].as_array().unwrap().len(), 3);
    let on_line = |found: &Found| {
        let upright = |triangle: &&[[f64; 3]; 3]| triangle.iter().all(|place| place[0] == 500.0);
        found.triangles.iter().filter(upright).count()
    };
    let found = meshes(&bytes);
    assert_eq!(found.iter().filter(|mesh| mesh.node != "r0000c0000").map(on_line).sum::<usize>(), 0);
    // Three walls of the western piece, four of the courtyard, three of the eastern piece.
    let walls = found.iter().find(|mesh| mesh.material == "building_wall").unwrap();
    assert_eq!(walls.triangles.len(), 2 * (3 + 4 + 3));
    // Seen from outside, walls run counter-clockwise: away from the middle of the house, or of its courtyard.
    let closed = found.iter().filter(|mesh| mesh.node == "tower_3").flat_map(|mesh| &mesh.triangles);
    let volume: f64 = closed
        .map(|[a, b, c]| {
            let [a, b, c] = [a, b, c].map(|p| [p[0] - 10.0, p[1] - 127_900.0 / 128.0, p[2] + 10.0]);
            (a[0] * (b[1] * c[2] - b[2] * c[1])
                + a[1] * (b[2] * c[0] - b[0] * c[2])
                + a[2] * (b[0] * c[1] - b[1] * c[0]))
                / 6.0
        })
        .sum();
    let expected = (500.0_f64 / 128.0).powi(2) * 7_100.0 / 128.0;
    assert!((volume / expected - 1.0).abs() < 1e-3, "{volume} {expected}");
}

#[test]
fn every_format_of_meshes_has_the_objects() {
    let product = samples::with_objects();
    let obj = |coordinates, library| {
        let mut bytes = Vec::new();
        crate::write_obj(&mut bytes, &product, &Mesh::of(&product), coordinates, library, None).unwrap();
        String::from_utf8(bytes).unwrap()
    };
    let text = obj(Coordinates::Local, Some("a.mtl"));
    for part in ["\no building_7\nusemtl building_roof\n", "\no tower_3\n", "\no wood_9\nusemtl wood_top\n"] {
        assert!(text.contains(part), "{part} is not in {text}");
    }
    assert!(crate::obj_materials(&product, &Mesh::of(&product), None).unwrap().contains("newmtl building_wall\n"));
    let usd = files(|put, work| crate::write_usd(&product, put, work));
    let tile = String::from_utf8_lossy(&usd["tiles/tile_r00c00.usda"]).into_owned();
    assert!(tile.contains("def Mesh \"building_7\" (") && tile.contains("uint64 object:id = 7\n"), "{tile}");
    assert!(tile.contains("def Mesh \"wood_9\"\n") && tile.contains("</tile_r00c00/Materials/object_wood_top>"));
    let gazebo = files(|put, work| crate::write_gazebo(&product, put, work));
    let world = String::from_utf8_lossy(&gazebo["area.sdf"]).into_owned();
    // A chimney, the eastern piece of the house, and the walls of the western one, whose courtyard leaves 83 % of it.
    assert_eq!(world.matches("<collision name=\"object_").count(), 9, "{world}");
    assert!(gazebo.contains_key("meshes/r0000c0000_r0000c0001_seen.obj"));
    let flight = files(|put, work| crate::write_openflight(&product, put, work));
    let square = &flight["squares/r00c00.flt"];
    assert!(square.windows(10).any(|window| window == b"building_7") && square.windows(6).any(|w| w == b"wood_9"));
    let tiles = files(|put, work| crate::write_3dtiles(&product, None, put, work));
    let group = meshes(&tiles["groups/r0000c0000_r0000c0001.glb"]);
    assert!(group.iter().any(|mesh| mesh.node == "objects_r0000c0000_r0000c0001" && mesh.material == "wood_side"));
}

#[test]
fn a_package_has_objects_as_layers_whose_pieces_are_one() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.gpkg");
    let write = |path: &Path, product: &Product| {
        with_work(|work| crate::write_gpkg(path, product, &samples::report(), [8, 8], work).unwrap());
    };
    write(&path, &samples::with_objects());
    let package = Connection::open(&path).unwrap();
    let told = |layer: &str| -> (i64, String, Option<f64>, f64, Option<f64>, Vec<u8>) {
        let columns = "count(*), class, roof_m, height_m, fullness, geom";
        let query = format!("SELECT {columns} FROM {layer}");
        package
            .query_row(&query, [], |row| {
                Ok((row.get(0)?, row.get(1)?, row.get(2)?, row.get(3)?, row.get(4)?, row.get(5)?))
            })
            .unwrap()
    };
    let (count, class, roof, height, fullness, geometry) = told("buildings");
    assert_eq!((count, class.as_str(), roof, height, fullness), (1, "building", Some(1011.71875), 10.9375, None));
    let id: String = package.query_row("SELECT id FROM buildings", [], |row| row.get(0)).unwrap();
    assert_eq!(id, "7", "text, as an object of any number has it elsewhere");
    let word = |at: usize| u32::from_le_bytes(geometry[at..at + 4].try_into().unwrap());
    // One polygon over both load modules, with a courtyard.
    assert_eq!([word(41), word(45), word(50), word(54)], [6, 1, 3, 2]);
    let double = |at: usize| f64::from_le_bytes(geometry[at..at + 8].try_into().unwrap());
    let extent = [60_000.0, 67_000.0].map(|quanta| 505_000.0 + quanta / 128.0);
    assert_eq!([double(8), double(16)], extent);
    let (count, class, roof, height, fullness, geometry) = told("woods");
    assert_eq!((count, class.as_str(), roof, height, fullness), (1, "wood", None, 15.0, Some(0.9)));
    assert_eq!(u32::from_le_bytes(geometry[45..49].try_into().unwrap()), 1);
    assert_eq!(told("points").1, "tower");
    let rows: i64 = package
        .query_row("SELECT count(*) FROM gpkg_contents WHERE table_name = 'rows'", [], |row| row.get(0))
        .unwrap();
    assert_eq!(rows, 0, "what there is none of has no layer");
}

#[test]
fn ribbons_lie_5_cm_over_the_ground_as_wide_as_their_ways_and_once() {
    let product = samples::with_ways();
    let found = meshes(&glb(&product));
    let bare = meshes(&glb(&Product { has_ribbons: false, ..product.clone() }));
    let seen = |x: f64, y: f64| {
        let (top, material) = from_above(&found, [x, y]).unwrap();
        let up = top - from_above(&bare, [x, y]).unwrap().0;
        assert!(material == "default" && up == 0.0 || (up - 0.05).abs() < 0.01, "{up} {material} at {x} {y}");
        material
    };
    // On both sides of the line between load modules, where the road bends, to the edge and beyond it.
    for (x, y, expected) in [
        (400.0, 30_000.0 / 128.0, "minor"),
        (450.0, 30_000.0 / 128.0 + 3.4, "minor"),
        (450.0, 30_000.0 / 128.0 + 3.6, "default"),
        (499.9, 30_000.0 / 128.0, "minor"),
        (500.1, 30_000.0 / 128.0 - 3.4, "minor"),
        (600.0, 30_000.0 / 128.0 + 100.0, "minor"),
        (600.0, 30_000.0 / 128.0 + 106.0, "default"),
        (50_000.0 / 128.0, 30_000.0 / 128.0, "minor"),
        (50_000.0 / 128.0, 300.0, "stream"),
        (50_000.0 / 128.0 + 1.1, 300.0, "default"),
    ] {
        assert_eq!(seen(x, y), expected, "{x} {y}");
    }
    // Areas of the bands, but for what the road takes from the stream: no place is covered twice.
    let area = |material: &str| -> f64 {
        let own = found.iter().filter(|mesh| mesh.node.starts_with("ribbons") && mesh.material == material);
        let plan = |[a, b, c]: &[[f64; 3]; 3]| ((b[0] - a[0]) * (a[2] - c[2]) - (a[2] - b[2]) * (c[0] - a[0])) / 2.0;
        own.flat_map(|mesh| &mesh.triangles).map(plan).sum()
    };
    let along = |x: f64, y: f64| x.hypot(y) / 128.0;
    let road = along(30_000.0, 10_000.0) + along(24_000.0, 0.0) + along(30_000.0, 30_000.0);
    // Half a disc of twelve corners at both ends.
    assert!((area("minor") - 7.0 * road - 3.0 * 3.5 * 3.5).abs() < 3.0, "{}", area("minor"));
    assert!((area("stream") - 2.0 * (500.0 - 7.0)).abs() < 1.0, "{}", area("stream"));
    let (document, _) = document(&glb(&product));
    assert!(document["nodes"].as_array().unwrap().iter().any(|node| node["name"] == "ribbons_r0000c0001"));
}

#[test]
fn a_level_has_no_ribbons_of_what_it_leaves_out() {
    let mut product = samples::with_ways();
    product.coarser = vec![product.modules.clone(); 2];
    let product = product.leaving_out(&[vec![], vec!["stream".into()]]);
    let ribbons = |product: &Product| -> Vec<String> {
        let found = meshes(&glb(product)).into_iter().filter(|mesh| mesh.node.starts_with("ribbons"));
        found.map(|mesh| mesh.material).collect::<std::collections::BTreeSet<_>>().into_iter().collect()
    };
    let levels: Vec<_> = product.levels().map(|level| ribbons(&level)).collect();
    assert_eq!(levels, [vec!["minor", "stream"], vec!["minor", "stream"], vec!["minor"]]);
    // A level that is exported alone.
    let alone = Product { level: 2, ..samples::with_ways() }.leaving_out(&[vec!["minor".into()], vec![]]);
    assert_eq!(ribbons(&alone), ["stream"]);
}

/// An orthophoto of a metre a pixel over all of the sample, in dark and light squares of 20 m, dark in the south-west.
fn checkerboard(path: &Path) {
    let is_light = |east: usize, north: usize| (east / 20 + north / 20) % 2 == 1;
    let raster = ByteRaster {
        origin_m: [505_000.5, 3_875_000.5],
        spacing: terrain::Spacing::from_metres(1.0).unwrap(),
        size: [1000, 500],
        epsg: 32_611,
        bands: 1,
    };
    let row = |row: usize| (0..1000).map(move |col| if is_light(col, 499 - row) { 235 } else { 20 });
    let mut file = std::fs::File::create(path).unwrap();
    crate::write_byte_raster(&mut file, &raster, |first, last| (first..=last).flat_map(row).collect()).unwrap();
}

/// A grey orthophoto from the north-western corner of the sample on, in strips.
fn photo(path: &Path, [cols, rows]: [u32; 2], (pixel_m, rows_per_strip): (f64, u32), data: &[u8]) {
    let mut encoder = TiffEncoder::new(std::fs::File::create(path).unwrap()).unwrap();
    let mut image = encoder.new_image::<Gray8>(cols, rows).unwrap();
    image.rows_per_strip(rows_per_strip).unwrap();
    let tags = image.encoder();
    tags.write_tag(Tag::ModelPixelScaleTag, &[pixel_m, pixel_m, 0.0][..]).unwrap();
    tags.write_tag(Tag::ModelTiepointTag, &[0.0, 0.0, 0.0, 505_000.0, 3_875_500.0, 0.0][..]).unwrap();
    let keys: [u16; 16] = [1, 1, 0, 3, 1024, 0, 1, 1, 1025, 0, 1, 1, 3072, 0, 1, 32611];
    tags.write_tag(Tag::GeoKeyDirectoryTag, &keys[..]).unwrap();
    image.write_data(data).unwrap();
}

/// Brightness and sides of a picture.
fn decoded(jpeg: &[u8]) -> (Vec<u8>, usize, usize) {
    let mut decoder = zune_jpeg::JpegDecoder::new(std::io::Cursor::new(jpeg));
    let colors = decoder.decode().unwrap();
    let (wide, high) = decoder.dimensions().unwrap();
    assert_eq!(colors.len(), 3 * wide * high);
    (colors.chunks(3).map(|color| color[1]).collect(), wide, high)
}

fn textured(folder: &Path, product: Product, texel_m: f64) -> Product {
    let path = folder.join("board.tif");
    checkerboard(&path);
    let ends = [[505_000.0, 3_875_000.0], [506_000.0, 3_875_500.0]];
    let textures = Textures::open(&[path], product.crs(), ends, Some(texel_m), (TextureFile::Jpeg, 4096)).unwrap();
    Product { textures: Some(Arc::new(textures)), ..product }
}

#[test]
fn a_checkerboard_lies_on_the_ground_where_it_lies_in_its_photo() {
    let folder = tempfile::tempdir().unwrap();
    let bytes = glb(&textured(folder.path(), samples::product(), 1.0));
    let (document, binary) = document(&bytes);
    let view = &document["bufferViews"][number(&document["images"][0]["bufferView"])];
    let start = number(&view["byteOffset"]);
    let (texels, wide, high) = decoded(&binary[start..start + number(&view["byteLength"])]);
    assert_eq!((wide, high), (1002, 502), "one texel to each metre, and one beyond each border");
    assert_eq!(document["samplers"][0]["wrapS"], 33071);
    let mut seen = 0;
    for mesh in document["meshes"].as_array().unwrap() {
        for primitive in mesh["primitives"].as_array().unwrap() {
            let material = &document["materials"][number(&primitive["material"])]["pbrMetallicRoughness"];
            assert_eq!(material["baseColorTexture"]["index"], 0);
            let read = |name: &str| accessor(&document, binary, &primitive["attributes"][name]);
            let (places, uvs) = (read("POSITION"), read("TEXCOORD_0"));
            let indices: Vec<usize> =
                accessor(&document, binary, &primitive["indices"]).iter().map(|index| index[0] as usize).collect();
            for corners in indices.as_chunks::<3>().0 {
                for (a, b) in (1..40).flat_map(|a| (1..40 - a).map(move |b| (f64::from(a) / 40.0, f64::from(b) / 40.0)))
                {
                    let blend = |of: &[Vec<f64>], part: usize| {
                        let [p, q, r] = corners.map(|corner| of[corner][part]);
                        p + a * (q - p) + b * (r - p)
                    };
                    let [east, north] = [blend(&places, 0), -blend(&places, 2)];
                    let from_edge = |at: f64| (at % 20.0).min(20.0 - at % 20.0);
                    if from_edge(east).min(from_edge(north)) < 2.0 {
                        continue;
                    }
                    let [col, row] = [blend(&uvs, 0) * wide as f64, blend(&uvs, 1) * high as f64].map(|at| at as usize);
                    let is_light = ((east / 20.0) as usize + (north / 20.0) as usize) % 2 == 1;
                    assert_eq!(128 < texels[row * wide + col], is_light, "{east} {north} {col} {row}");
                    seen += 1;
                }
            }
        }
    }
    assert!(2000 < seen, "{seen}");
}

#[test]
fn textures_of_neighbours_agree_on_their_border_and_hold_to_a_size() {
    let folder = tempfile::tempdir().unwrap();
    let product = textured(folder.path(), samples::product(), 1.0);
    let of = |west: u32| ModuleRect { south: 0, west, north: 1, east: west + 1 };
    let texture = |rect: ModuleRect, texel_m: f64| decoded(&product.texture(rect, texel_m).unwrap().unwrap().bytes);
    let ((west, wide, high), (east, _, _)) = (texture(of(0), 0.0), texture(of(1), 0.0));
    assert_eq!((wide, high), (502, 502));
    // The last two of the one are the first two of the other.
    let of_both = |row: usize, at: usize| [west[row * wide + wide - 2 + at], east[row * wide + at]];
    let off = (0..high).flat_map(|row| [of_both(row, 0), of_both(row, 1)]).map(|[a, b]| a.abs_diff(b)).max().unwrap();
    assert!(off < 40, "{off}, of 215 between dark and light");
    // Texels of 3 m do not divide a load module of 500 m: they are a little larger.
    assert_eq!(texture(of(0), 3.0).1, 168);
    assert_eq!(texture(product.rect, 700.0).1, 4);
    let tiles = files(|put, work| crate::write_3dtiles(&product, None, put, work));
    let (document, _) = document(&tiles["groups/r0000c0000_r0000c0001.glb"]);
    assert_eq!(document["images"][0]["mimeType"], "image/jpeg");
    let same = files(|put, work| crate::write_3dtiles(&product, None, put, work));
    assert!(tiles == same);
}

#[test]
fn every_texel_is_that_of_the_photo_however_its_file_is_cut() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("noise.tif");
    // Its pixels are as large as texels, and lie where these do.
    let (pixel_m, cols, rows) = (0.3125, 3200_u32, 1600_u32);
    let grey = |col: u32, row: u32| -> u32 {
        let at = (row.min(rows - 1) * cols + col.min(cols - 1)).wrapping_mul(0x9e37_79b1);
        (at ^ at >> 15).wrapping_mul(0x85eb_ca6b) >> 24
    };
    let data: Vec<u8> = (0..cols * rows).map(|at| grey(at % cols, at / cols) as u8).collect();
    let ends = [[505_000.0, 3_875_000.0], [506_000.0, 3_875_500.0]];
    for rows_per_strip in [1, 64, rows] {
        photo(&path, [cols, rows], (pixel_m, rows_per_strip), &data);
        let file = (TextureFile::Rgb, 4096);
        let product = samples::product();
        let textures = Textures::open(std::slice::from_ref(&path), product.crs(), ends, None, file).unwrap();
        let product = Product { textures: Some(Arc::new(textures)), ..product };
        let bytes = product.texture(product.rect, 0.0).unwrap().unwrap().bytes;
        let (wide, high) = (cols as usize + 2, rows as usize + 2);
        assert_eq!(bytes.len(), 512 + 3 * wide * high);
        for (row, col) in (0..rows).flat_map(|row| (0..cols).map(move |col| (row, col))) {
            let texel = u32::from(bytes[512 + (high - 2 - row as usize) * wide + col as usize + 1]);
            assert_eq!(texel, grey(col, row), "{rows_per_strip}: at {col},{row}");
        }
        assert_eq!(product.textures.as_ref().unwrap().coarser_m(), None);
    }
}

#[test]
fn draped_pieces_cover_a_polygon_once_and_lie_on_the_ground() {
    let ground = Draped::of(&samples::product().modules[1], [64_000, 0]);
    let polygon = [[70_000.0, 10_000.0], [120_000.0, 12_000.0], [90_000.0, 60_000.0]];
    let pieces = ground.under(&polygon);
    let doubled = |ring: &[[f64; 2]]| -> f64 {
        let next = ring.iter().cycle().skip(1);
        ring.iter().zip(next).map(|(a, b)| a[0] * b[1] - a[1] * b[0]).sum()
    };
    let flat = |piece: &Vec<[f64; 3]>| piece.iter().map(|&[x, y, _]| [x, y]).collect::<Vec<_>>();
    let all: f64 = pieces.iter().map(|piece| doubled(&flat(piece))).sum();
    assert!((all / doubled(&polygon) - 1.0).abs() < 1e-9 && pieces.len() == 4, "{pieces:?}");
    // The lowest place of the ground, in the middle of its four triangles.
    let lowest = pieces.iter().flatten().fold(f64::INFINITY, |low, place| low.min(place[2]));
    assert!((lowest - 127_000.0).abs() < 1e-6, "{lowest}");
}

#[test]
fn a_draped_edge_bends_where_the_ground_does() {
    let ground = Draped::of(&samples::product().modules[1], [0, 0]);
    // From the western side through the middle to the eastern one.
    let places = ground.along([[0.0, 25_600.0], [64_000.0, 25_600.0]]);
    let shares: Vec<[f64; 2]> = places.iter().map(|place| [place[0], place[2].round()]).collect();
    assert_eq!(shares, [[0.0, 128_358.0], [32_000.0, 127_000.0], [64_000.0, 127_949.0]]);
    // Along a line that triangles share, and backwards.
    let back = ground.along([[64_000.0, 64_000.0], [0.0, 0.0]]);
    assert_eq!((back.len() <= 4, back[0][2], back[back.len() - 1][2]), (true, 127_872.0, 128_256.0));
}

/// Whether a place lies where its texture has it: 1002 x 502 texels, the first south-west of the corner.
#[track_caller]
fn check_place([east, north]: [f64; 2], [u, v]: [f64; 2]) {
    let expected = [(east + 1.0) / 1002.0, (north + 1.0) / 502.0];
    assert!((expected[0] - u).abs() < 1e-6 && (expected[1] - v).abs() < 1e-6, "{east} {north}: {u} {v}, {expected:?}");
}

/// The numbers of a text, whatever stands between them.
fn numbers(text: &str) -> Vec<f64> {
    text.split(|c: char| !matches!(c, '0'..='9' | '.' | '-' | 'e')).filter_map(|part| part.parse().ok()).collect()
}

#[test]
fn engines_and_simulators_find_the_photo_where_their_vertices_lie() {
    let folder = tempfile::tempdir().unwrap();
    let product = textured(folder.path(), samples::product(), 1.0);

    let usd = files(|put, work| crate::write_usd(&product, put, work));
    assert_eq!(decoded(&usd["tiles/tile_r00c00.jpg"]).1, 1002);
    let text = String::from_utf8_lossy(&usd["tiles/tile_r00c00.usda"]).into_owned();
    let list = |name: &str| {
        let line = text.lines().find(|line| line.trim_start().starts_with(name)).unwrap_or_else(|| panic!("{text}"));
        numbers(&line[line.find('=').unwrap()..])
    };
    let (points, places) = (list("point3f[] points"), list("texCoord2f[] primvars:st"));
    assert_eq!(points.len() / 3, places.len() / 2);
    points.as_chunks::<3>().0.iter().zip(places.as_chunks().0).for_each(|(at, uv)| check_place([at[0], at[1]], *uv));
    assert!(text.contains("@./tile_r00c00.jpg@") && text.contains("Photo.outputs:rgb"));

    let flt = files(|put, work| crate::write_openflight(&product, put, work));
    assert_eq!(decoded(&flt["squares/r00c00.jpg"]).1, 1002);
    let bytes = &flt["squares/r00c00.flt"];
    let (mut at, mut vertices, mut named) = (0, 0, false);
    while at < bytes.len() {
        let word = |at: usize| u16::from_be_bytes([bytes[at], bytes[at + 1]]);
        let double = |from: usize| f64::from_be_bytes(bytes[at + from..][..8].try_into().unwrap());
        let float = |from: usize| f64::from(f32::from_be_bytes(bytes[at + from..][..4].try_into().unwrap()));
        match word(at) {
            64 => named = bytes[at + 4..].starts_with(b"r00c00.jpg\0"),
            70 => {
                check_place([double(8), double(16)], [float(44), float(48)]);
                vertices += 1;
            }
            // Faces have it, and their own colour is white.
            5 => assert_eq!((word(at + 28), &bytes[at + 56..at + 60]), (0, &[255; 4][..])),
            _ => {}
        }
        at += usize::from(word(at + 2));
    }
    assert!(named && 4 < vertices, "{vertices}");

    let gazebo = files(|put, work| crate::write_gazebo(&product, put, work));
    let name = gazebo.keys().find_map(|name| name.strip_suffix(".jpg")).unwrap().to_owned();
    assert_eq!(decoded(&gazebo[&format!("{name}.jpg")]).1, 1002);
    let text = |end: &str| String::from_utf8_lossy(&gazebo[&format!("{name}.{end}")]).into_owned();
    let file = name.strip_prefix("meshes/").unwrap();
    assert!(text("mtl").contains(&format!("map_Kd {file}.jpg")));
    let obj = text("obj");
    let of = |mark: &str| obj.lines().filter(|line| line.starts_with(mark)).map(numbers).collect::<Vec<_>>();
    let (points, places) = (of("v "), of("vt "));
    assert_eq!(points.len(), places.len());
    points.iter().zip(&places).for_each(|(at, uv)| check_place([at[0], at[1]], [uv[0], uv[1]]));
    assert!(obj.contains(&format!("mtllib {file}.mtl\n")) && obj.contains("/1 "));
}

#[test]
fn places_along_a_way_go_on_where_it_does_and_across_it_from_its_left_edge_to_its_right_one() {
    let bytes = glb(&samples::with_ways());
    let (document, binary) = document(&bytes);
    let mut triangles = Vec::new();
    for mesh in document["meshes"].as_array().unwrap() {
        for primitive in mesh["primitives"].as_array().unwrap() {
            let material = &document["materials"][number(&primitive["material"])]["name"];
            let Some(lanes) = primitive["attributes"].get("TEXCOORD_0") else {
                assert_eq!(material, "default", "ribbons alone have lanes here");
                continue;
            };
            let read = |index: &Value| accessor(&document, binary, index);
            let (places, lanes) = (read(&primitive["attributes"]["POSITION"]), read(lanes));
            let corners = read(&primitive["indices"]).into_iter().map(|index| index[0] as usize);
            let corner = |at: usize| [places[at][0], -places[at][2], lanes[at][0], lanes[at][1]];
            let all: Vec<[f64; 4]> = corners.map(corner).collect();
            triangles.extend(all.as_chunks::<3>().0.iter().map(|corners| (*corners, material == "minor")));
        }
    }
    // Across and along at a place of the road, or of the stream.
    let at = |[x, y]: [f64; 2], is_road: bool| -> [f64; 2] {
        let side = |p: &[f64; 4], q: &[f64; 4]| (q[0] - p[0]) * (y - p[1]) - (q[1] - p[1]) * (x - p[0]);
        let over = |[a, b, c]: &[[f64; 4]; 3]| {
            let parts = [side(b, c), side(c, a), side(a, b)];
            let all: f64 = parts.iter().sum();
            let is_over = 0.0 < all && parts.iter().all(|part| -1e-9 * all <= *part);
            is_over.then(|| [2, 3].map(|of| (parts[0] * a[of] + parts[1] * b[of] + parts[2] * c[of]) / all))
        };
        triangles.iter().filter(|(_, of)| *of == is_road).find_map(|(corners, _)| over(corners)).unwrap()
    };
    let [first, second] = [30_000.0_f64.hypot(10_000.0), 24_000.0].map(|quanta| quanta / 128.0);
    let y = 30_000.0 / 128.0;
    for (place, expected) in [
        ([450.0, y], [0.5, first + 450.0 - 312.5]),
        ([450.0, y + 3.0], [0.5 - 3.0 / 7.0, first + 450.0 - 312.5]),
        ([450.0, y - 3.0], [0.5 + 3.0 / 7.0, first + 450.0 - 312.5]),
        // Beyond the line between load modules, where the road turns to the north-east.
        ([600.0, y + 100.0], [0.5, first + second + 100.0 * 2.0_f64.sqrt()]),
    ] {
        let found = at(place, true);
        let off = [found[0] - expected[0], found[1] - expected[1]];
        assert!(off[0].abs() < 0.05 && off[1].abs() < 2.0, "{place:?}: {found:?} {expected:?}");
    }
    let stream = at([50_000.0 / 128.0 + 0.5, 300.0], false);
    assert!((stream[0] - 0.75).abs() < 0.01 && (stream[1] - 300.0).abs() < 0.01, "{stream:?}");
}

#[test]
fn coarser_levels_are_nodes_that_take_the_place_of_finer_ones() {
    let product = samples::with_levels();
    let (document, _) = document(&glb(&product));
    let nodes = document["nodes"].as_array().unwrap();
    assert_eq!(document["extensionsUsed"], serde_json::json!(["MSFT_lod"]));
    assert_eq!(document["scenes"][0]["nodes"], serde_json::json!([0, 1]));
    let east = nodes.iter().find(|node| node["name"] == "r0000c0001").unwrap();
    let coarser = &nodes[number(&east["extensions"]["MSFT_lod"]["ids"][0])];
    let triangles = |node: &Value| -> usize {
        let primitives = document["meshes"][number(&node["mesh"])]["primitives"].as_array().unwrap();
        primitives.iter().map(|of| number(&document["accessors"][number(&of["indices"])]["count"]) / 3).sum()
    };
    assert_eq!((coarser["name"].as_str(), triangles(east), triangles(coarser)), (Some("r0000c0001_lod1"), 4, 2));
    let shares: Vec<f64> =
        east["extras"]["MSFT_screencoverage"].as_array().unwrap().iter().map(|of| of.as_f64().unwrap()).collect();
    assert!(0.0 < shares[0] && shares[0] < 0.01 && shares[1] == 0.0, "{shares:?}");

    let flt = files(|put, work| crate::write_openflight(&product, put, work));
    let (bytes, mut at, mut levels) = (&flt["squares/r00c00.flt"], 0, Vec::new());
    while at < bytes.len() {
        let word = |at: usize| u16::from_be_bytes([bytes[at], bytes[at + 1]]);
        let double = |from: usize| f64::from_be_bytes(bytes[at + from..][..8].try_into().unwrap());
        if word(at) == 73 {
            levels.push([double(24), double(16)]);
        }
        at += usize::from(word(at + 2));
    }
    // From where one is no longer shown the other is.
    assert!(levels.len() == 2 && levels[0] == [0.0, levels[1][0]] && 9000.0 < levels[1][0], "{levels:?}");

    let usd = files(|put, work| crate::write_usd(&product, put, work));
    assert_eq!(usd.keys().collect::<Vec<_>>(), ["area.usda", "tiles/tile_r00c00.usda", "tiles/tile_r00c00_lod1.usda"]);
    let text = String::from_utf8_lossy(&usd["area.usda"]);
    for part in ["string lod = \"lod0\"", "\"lod1\" (", "@./tiles/tile_r00c00_lod1.usda@", "lod:error_m = 9.375"] {
        assert!(text.contains(part), "{part}: {text}");
    }
}
