//! glTF 2.0 in one binary file: positions and normals as 32-bit floats, a primitive for each class of ground.
//!
//! glTF has y up and right-handed axes, so x points east, y up and z south.

use std::io::{Result, Write};

use serde_json::{Value, json};
use terrain::{LATTICE_PER_POST, Tin, metres_of_quanta};

use crate::mesh::normals;
use crate::{Facts, Mesh, Product};

/// Base colours of classes, in order and over again: tell apart by the colour-blind, too.
pub(crate) const COLOURS: [[f64; 3]; 8] = [
    [0.55, 0.50, 0.36],
    [0.34, 0.42, 0.30],
    [0.10, 0.27, 0.45],
    [0.62, 0.36, 0.12],
    [0.46, 0.46, 0.46],
    [0.17, 0.48, 0.43],
    [0.60, 0.56, 0.20],
    [0.42, 0.24, 0.38],
];

/// A mesh as it goes into a glTF: axes turned, in metres.
#[derive(Clone, Debug, Default)]
pub(crate) struct Gltf {
    /// x east, y up, z south.
    pub positions: Vec<[f32; 3]>,
    /// Unit vectors.
    pub normals: Vec<[f32; 3]>,
    /// Triangles of each class of ground, in order.
    pub groups: Vec<(u8, Vec<[u32; 3]>)>,
    /// What else to tell a reader.
    pub extras: Value,
}

/// Turns east, north, up into glTF's axes.
pub(crate) fn turned([east, north, up]: [f64; 3]) -> [f32; 3] {
    // No negative zero, which some readers print.
    [east as f32, up as f32, 0.0 - north as f32]
}

impl Gltf {
    /// The triangles of `mesh` by class, over vertices that are placed already.
    pub(crate) fn with_groups(mut self, triangles: &[[u32; 3]], classes: &[u8]) -> Self {
        let mut by_class = vec![Vec::new(); 256];
        triangles.iter().zip(classes).for_each(|(&triangle, &class)| by_class[usize::from(class)].push(triangle));
        let groups = (0..=u8::MAX).zip(by_class).filter(|(_, triangles)| !triangles.is_empty());
        self.groups = groups.collect();
        self
    }

    /// The bytes of the binary file.
    pub(crate) fn bytes(&self) -> Vec<u8> {
        let mut binary = Vec::with_capacity(self.positions.len() * 24);
        let mut views = Vec::new();
        let mut accessors = Vec::new();
        for (place, vectors) in [&self.positions, &self.normals].into_iter().enumerate() {
            let start = binary.len();
            vectors.as_flattened().iter().for_each(|number| binary.extend_from_slice(&number.to_le_bytes()));
            views
                .push(json!({ "buffer": 0, "byteOffset": start, "byteLength": binary.len() - start, "target": 34962 }));
            let mut accessor =
                json!({ "bufferView": place, "componentType": 5126, "count": vectors.len(), "type": "VEC3" });
            if place == 0 {
                let [low, high] = bounds(vectors);
                (accessor["min"], accessor["max"]) = (json!(low), json!(high));
            }
            accessors.push(accessor);
        }
        let (mut primitives, mut materials) = (Vec::new(), Vec::new());
        for (class, triangles) in &self.groups {
            let start = binary.len();
            let component = put_indices(&mut binary, triangles, self.positions.len());
            let length = binary.len() - start;
            pad(&mut binary, 0);
            views.push(json!({ "buffer": 0, "byteOffset": start, "byteLength": length, "target": 34963 }));
            let count = 3 * triangles.len();
            accessors.push(json!({ "bufferView": views.len() - 1, "componentType": component, "count": count,
                                   "type": "SCALAR" }));
            primitives.push(json!({ "attributes": { "POSITION": 0, "NORMAL": 1 }, "indices": accessors.len() - 1,
                                    "material": materials.len(), "mode": 4 }));
            materials.push(material(*class));
        }
        let mut asset = json!({ "version": "2.0", "generator": "tiefort" });
        if !self.extras.is_null() {
            asset["extras"] = self.extras.clone();
        }
        let document = json!({
            "asset": asset, "scene": 0, "scenes": [{ "nodes": [0] }], "nodes": [{ "mesh": 0 }],
            "meshes": [{ "primitives": primitives }], "materials": materials,
            "accessors": accessors, "bufferViews": views, "buffers": [{ "byteLength": binary.len() }],
        });
        container(&document, &binary)
    }
}

fn material(class: u8) -> Value {
    let [red, green, blue] = COLOURS[usize::from(class) % COLOURS.len()];
    json!({
        "name": format!("class_{class}"),
        "pbrMetallicRoughness": {
            "baseColorFactor": [red, green, blue, 1.0], "metallicFactor": 0.0, "roughnessFactor": 1.0,
        },
    })
}

fn bounds(vectors: &[[f32; 3]]) -> [[f32; 3]; 2] {
    vectors.iter().fold([[f32::INFINITY; 3], [f32::NEG_INFINITY; 3]], |[low, high], vector| {
        [[0, 1, 2].map(|i| low[i].min(vector[i])), [0, 1, 2].map(|i| high[i].max(vector[i]))]
    })
}

/// Writes the indices in the shortest type that holds them; the type's code.
fn put_indices(binary: &mut Vec<u8>, triangles: &[[u32; 3]], vertex_count: usize) -> u32 {
    const U16: u32 = 5123;
    const U32: u32 = 5125;
    // The largest value of a type means a new strip.
    if vertex_count <= usize::from(u16::MAX) {
        triangles.as_flattened().iter().for_each(|&index| binary.extend_from_slice(&(index as u16).to_le_bytes()));
        return U16;
    }
    triangles.as_flattened().iter().for_each(|index| binary.extend_from_slice(&index.to_le_bytes()));
    U32
}

fn pad(bytes: &mut Vec<u8>, filler: u8) {
    bytes.resize(bytes.len().next_multiple_of(4), filler);
}

/// The file: a header, a chunk of JSON and a chunk of numbers, each a multiple of four bytes long.
fn container(document: &Value, binary: &[u8]) -> Vec<u8> {
    let mut json = document.to_string().into_bytes();
    pad(&mut json, b' ');
    let length = 12 + 8 + json.len() + 8 + binary.len();
    let mut file = Vec::with_capacity(length);
    file.extend_from_slice(b"glTF");
    let mut put = |number: usize| file.extend_from_slice(&(number as u32).to_le_bytes());
    put(2);
    put(length);
    put(json.len());
    file.extend_from_slice(b"JSON");
    file.extend_from_slice(&json);
    file.extend_from_slice(&(binary.len() as u32).to_le_bytes());
    file.extend_from_slice(b"BIN\0");
    file.extend_from_slice(binary);
    file
}

/// Writes `mesh` as binary glTF, counted from the south-west corner of what is exported.
///
/// # Errors
/// Those of `out`.
pub fn write_glb(out: &mut impl Write, product: &Product, mesh: &Mesh) -> Result<()> {
    let facts = Facts::y_up(product);
    let gltf = Gltf {
        positions: mesh.metres().map(turned).collect(),
        normals: mesh.normals().into_iter().map(turned).collect(),
        groups: Vec::new(),
        extras: json!({
            "crs": product.crs(), "vertical_datum": product.vertical_datum(), "offset_m": facts.offset_m,
            "axes": facts.axes, "attribution": product.attributions(),
        }),
    };
    out.write_all(&gltf.with_groups(&mesh.triangles, &mesh.classes).bytes())
}

/// Where a TIN of a raster's own posts lies.
#[derive(Clone, Debug, PartialEq)]
pub struct TinPlace {
    /// East and north of post (0, 0), in metres.
    pub origin_m: [f64; 2],
    /// Metres between posts, west to east and south to north.
    pub spacing_m: [f64; 2],
    /// The coordinate system, where it is known.
    pub crs: Option<String>,
}

/// Writes a TIN as binary glTF, counted from its south-west post.
///
/// # Errors
/// Those of `out`.
pub fn write_tin_glb(out: &mut impl Write, tin: &Tin, place: &TinPlace) -> Result<()> {
    let [dx, dy] = place.spacing_m;
    let places: Vec<[f64; 3]> = tin
        .vertices
        .iter()
        .map(|vertex| {
            let posts = |lattice: i32, from: i32| f64::from(lattice) / f64::from(LATTICE_PER_POST) - f64::from(from);
            let (row, col) = (posts(vertex.at.row, tin.rect.south), posts(vertex.at.col, tin.rect.west));
            [col * dx, row * dy, metres_of_quanta(vertex.height)]
        })
        .collect();
    let south_west = [f64::from(tin.rect.west) * dx, f64::from(tin.rect.south) * dy];
    let gltf = Gltf {
        positions: places.iter().copied().map(turned).collect(),
        normals: normals(&places, &tin.triangles).into_iter().map(turned).collect(),
        groups: vec![(0, tin.triangles.clone())],
        extras: json!({
            "crs": place.crs, "axes": "x east, y up, z south",
            "offset_m": [place.origin_m[0] + south_west[0], place.origin_m[1] + south_west[1], 0.0],
        }),
    };
    out.write_all(&gltf.bytes())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::samples;

    #[test]
    fn a_glb_is_two_chunks_whose_lengths_add_up_and_whose_views_fit() {
        let product = samples::product();
        let mut bytes = Vec::new();
        write_glb(&mut bytes, &product, &Mesh::of(&product)).unwrap();
        let word = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap()) as usize;
        assert_eq!((&bytes[..4], word(4), word(8)), (&b"glTF"[..], 2, bytes.len()));
        let document: Value = serde_json::from_slice(&bytes[20..20 + word(12)]).unwrap();
        let binary = word(20 + word(12));
        assert_eq!(28 + word(12) + binary, bytes.len());
        assert_eq!(document["buffers"][0]["byteLength"], binary);
        assert_eq!(document["accessors"][0]["min"], json!([0.0, 127_000.0 / 128.0, -500.0]));
        assert_eq!(document["accessors"][0]["max"], json!([1000.0, 1004.0, 0.0]));
        assert_eq!(document["meshes"][0]["primitives"].as_array().unwrap().len(), 2);
        assert_eq!(document["materials"][1]["name"], "class_1");
        assert_eq!(document["asset"]["extras"]["offset_m"][0], 505_000.0);
        for view in document["bufferViews"].as_array().unwrap() {
            let (start, length) = (view["byteOffset"].as_u64().unwrap(), view["byteLength"].as_u64().unwrap());
            assert!(start % 4 == 0 && start + length <= binary as u64);
        }
    }
}
