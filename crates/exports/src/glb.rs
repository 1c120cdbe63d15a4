//! glTF 2.0 in one binary file: positions and normals as 32-bit floats, a primitive and a material for each class, and
//! decks in nodes of their own below one that is named so.
//!
//! glTF has y up and right-handed axes, so x points east, y up and z south.

use std::collections::BTreeMap;
use std::io::{Result, Write};

use serde_json::{Value, json};
use terrain::{ModuleId, Tin, metres_of_quanta};

use crate::classes::Classes;
use crate::detail::{Detail, Step, coverage, steps};
use crate::glb_features::FoundFeatures;
use crate::mesh::{Part, class_groups, normals};
use crate::modules::{alone, sheet_name};
use crate::objects::Thing;
use crate::sheets::Material;
use crate::{Facts, Mesh, Product, Sheet, Texture, TextureFile, TinPlace};

/// Meshes as they go into a glTF, each in a node of its own.
#[derive(Clone, Debug, Default)]
pub(crate) struct Gltf<'a> {
    /// Nodes of each sheet, in order; none without triangles.
    pub sheets: Vec<(Sheet, Vec<GltfNode>)>,
    /// What materials are called, and their colours.
    pub classes: Classes<'a>,
    /// Whom to thank for the sources.
    pub thanks: String,
    /// What else to tell a reader.
    pub extras: Value,
    /// What all that has places in it is seen with.
    pub texture: Option<Texture>,
}

/// A mesh as it goes into a glTF: axes turned, in metres.
#[derive(Clone, Debug, Default)]
pub(crate) struct GltfNode {
    /// What a reader shows in its tree: `r0003c0017`, a load module by its row and column.
    pub name: String,
    /// x east, y up, z south.
    pub positions: Vec<[f32; 3]>,
    /// Unit vectors.
    pub normals: Vec<[f32; 3]>,
    /// Places in the texture, where there is one.
    pub uvs: Vec<[f32; 2]>,
    /// Places across and along ways, where there are any.
    pub lanes: Vec<[f32; 2]>,
    /// Triangles of each class of ground, in order.
    pub groups: Vec<(u8, Vec<[u32; 3]>)>,
    /// What else to tell a reader.
    pub extras: Value,
    /// What of it a click finds, where that is told.
    pub features: Option<FoundFeatures>,
    /// The same at coarser levels, from fine to coarse.
    pub coarser: Vec<GltfNode>,
    /// The share of a picture from which on a coarser one will do.
    pub coverage: f64,
}

/// Turns east, north, up into glTF's axes.
pub(crate) fn turned([east, north, up]: [f64; 3]) -> [f32; 3] {
    // No negative zero, which some readers print.
    [east as f32, up as f32, 0.0 - north as f32]
}

impl GltfNode {
    /// The triangles of `mesh` by class, over vertices that are placed already.
    pub(crate) fn with_groups(mut self, triangles: &[[u32; 3]], classes: &[u8]) -> Self {
        self.groups = class_groups(triangles, classes);
        self
    }
}

/// What a view is for, in the numbers of OpenGL: vertices, or indices of them.
const ARRAY_BUFFER: u32 = 34962;
const ELEMENT_ARRAY_BUFFER: u32 = 34963;

/// The document and the numbers of a glTF in the making: views of all positions, all normals, all indices, all
/// numbers of features, and all places in a texture.
#[derive(Default)]
struct Parts {
    views: [Vec<u8>; 5],
    accessors: Vec<Value>,
    meshes: Vec<Value>,
    nodes: Vec<Value>,
}

impl Parts {
    const POSITIONS: usize = 0;
    const NORMALS: usize = 1;
    const INDICES: usize = 2;
    const FEATURES: usize = 3;
    const UVS: usize = 4;

    /// Adds an accessor; its number.
    fn accessor(&mut self, view: usize, start: usize, component: u32, count: usize, kind: &str) -> usize {
        self.accessors.push(json!({
            "bufferView": view, "byteOffset": start, "componentType": component, "count": count, "type": kind,
        }));
        self.accessors.len() - 1
    }

    fn vectors(&mut self, view: usize, vectors: &[[f32; 3]]) -> usize {
        self.floats(view, vectors.as_flattened(), "VEC3", vectors.len())
    }

    fn floats(&mut self, view: usize, numbers: &[f32], kind: &str, count: usize) -> usize {
        const F32: u32 = 5126;
        let start = self.views[view].len();
        self.views[view].extend(numbers.iter().flat_map(|number| number.to_le_bytes()));
        self.accessor(view, start, F32, count, kind)
    }

    /// Adds a node of a sheet; `materials` are those of the file.
    fn add(&mut self, node: &GltfNode, sheet: Sheet, materials: &[Material]) {
        let positions = self.vectors(Self::POSITIONS, &node.positions);
        let [low, high] = bounds(&node.positions);
        (self.accessors[positions]["min"], self.accessors[positions]["max"]) = (json!(low), json!(high));
        let normals = self.vectors(Self::NORMALS, &node.normals);
        let mut attributes = json!({ "POSITION": positions, "NORMAL": normals });
        if let Some(features) = &node.features {
            let numbers: Vec<f32> = features.of_vertices.iter().map(|&number| number as f32).collect();
            attributes["_FEATURE_ID_0"] = json!(self.floats(Self::FEATURES, &numbers, "SCALAR", numbers.len()));
        }
        for (number, uvs) in [&node.uvs, &node.lanes].into_iter().filter(|uvs| !uvs.is_empty()).enumerate() {
            let places = self.floats(Self::UVS, uvs.as_flattened(), "VEC2", uvs.len());
            attributes[format!("TEXCOORD_{number}")] = json!(places);
        }
        let mut primitives = Vec::with_capacity(node.groups.len());
        for (class, triangles) in &node.groups {
            let start = self.views[Self::INDICES].len();
            let component = put_indices(&mut self.views[Self::INDICES], triangles, node.positions.len());
            pad(&mut self.views[Self::INDICES], 0);
            let indices = self.accessor(Self::INDICES, start, component, 3 * triangles.len(), "SCALAR");
            let material = materials.iter().position(|of| *of == Material { sheet, class: *class }.by_sides());
            let mut primitive =
                json!({ "attributes": attributes, "indices": indices, "material": material, "mode": 4 });
            if let Some(features) = &node.features {
                primitive["extensions"] = features.primitive();
            }
            primitives.push(primitive);
        }
        let mut named = json!({ "name": node.name, "mesh": self.meshes.len() });
        if !node.extras.is_null() {
            named["extras"] = node.extras.clone();
        }
        self.nodes.push(named);
        self.meshes.push(json!({ "name": node.name, "primitives": primitives }));
    }
}

impl Parts {
    /// The views that hold anything, and their bytes.
    fn put_views(&mut self) -> (Vec<Value>, Vec<u8>) {
        let (mut views, mut binary) = (Vec::new(), Vec::new());
        for (index, bytes) in self.views.iter().enumerate().filter(|(_, bytes)| !bytes.is_empty()) {
            let mut view = json!({ "buffer": 0, "byteOffset": binary.len(), "byteLength": bytes.len() });
            // What several accessors share has to say where the next vertex begins.
            let (target, stride) = match index {
                Self::INDICES => (ELEMENT_ARRAY_BUFFER, None),
                Self::FEATURES => (ARRAY_BUFFER, Some(size_of::<f32>())),
                Self::UVS => (ARRAY_BUFFER, Some(size_of::<[f32; 2]>())),
                _ => (ARRAY_BUFFER, Some(size_of::<[f32; 3]>())),
            };
            view["target"] = json!(target);
            if let Some(stride) = stride {
                view["byteStride"] = json!(stride);
            }
            let at = views.len();
            for accessor in self.accessors.iter_mut().filter(|accessor| accessor["bufferView"] == index) {
                accessor["bufferView"] = json!(at);
            }
            views.push(view);
            binary.extend_from_slice(bytes);
        }
        (views, binary)
    }

    /// Puts what is not ground below a node of its sheet; the nodes at the top.
    fn put_parents(&mut self, sheets: &[(Sheet, Vec<GltfNode>)]) -> Vec<usize> {
        let (mut top, mut first) = (Vec::new(), 0);
        let mut parents = Vec::new();
        for (sheet, nodes) in sheets {
            let own: Vec<usize> = (first..first + nodes.len()).collect();
            first += nodes.len();
            match sheet {
                Sheet::Ground => top.extend(own),
                _ if own.is_empty() => {}
                _ => parents.push(json!({ "name": sheet.name(), "children": own })),
            }
        }
        top.extend(self.nodes.len()..self.nodes.len() + parents.len());
        self.nodes.extend(parents);
        top
    }

    /// Adds the coarser levels of node `of`, which stand in no scene: they take its place.
    fn add_coarser(&mut self, of: usize, node: &GltfNode, sheet: Sheet, materials: &[Material]) {
        let first = self.nodes.len();
        node.coarser.iter().for_each(|coarser| self.add(coarser, sheet, materials));
        let levels = std::iter::once(node).chain(&node.coarser);
        let coverage: Vec<f64> = levels.map(|level| level.coverage).collect();
        self.nodes[of]["extensions"] = json!({ "MSFT_lod": { "ids": (first..self.nodes.len()).collect::<Vec<_>>() } });
        self.nodes[of]["extras"]["MSFT_screencoverage"] = json!(coverage);
    }
}

impl Gltf<'_> {
    /// The bytes of the binary file.
    pub(crate) fn bytes(&self) -> Vec<u8> {
        let mut asset = json!({ "version": "2.0", "generator": "tiefort" });
        if !self.thanks.is_empty() {
            asset["copyright"] = json!(self.thanks);
        }
        if !self.extras.is_null() {
            asset["extras"] = self.extras.clone();
        }
        if self.sheets.iter().all(|(_, nodes)| nodes.is_empty()) {
            // No list may be empty.
            return container(&json!({ "asset": asset, "scene": 0, "scenes": [{ "name": "empty" }] }), &[]);
        }
        let all = || self.sheets.iter().flat_map(|(sheet, nodes)| nodes.iter().map(|node| (*sheet, node)));
        let used = |(sheet, node): (Sheet, &GltfNode)| -> Vec<Material> {
            let groups = std::iter::once(node).chain(&node.coarser).flat_map(|level| &level.groups);
            groups.map(|&(class, _)| Material { sheet, class }.by_sides()).collect()
        };
        let mut materials: Vec<Material> = all().flat_map(used).collect();
        materials.sort_unstable();
        materials.dedup();
        let mut parts = Parts::default();
        all().for_each(|(sheet, node)| parts.add(node, sheet, &materials));
        let top = parts.put_parents(&self.sheets);
        let with_levels = || all().enumerate().filter(|(_, (_, node))| !node.coarser.is_empty());
        with_levels().for_each(|(of, (sheet, node))| parts.add_coarser(of, node, sheet, &materials));
        let (mut views, mut binary) = parts.put_views();
        let material = |of: Material| material_of(self.classes, of, self.texture.is_some());
        let mut document = json!({
            "asset": asset, "scene": 0, "scenes": [{ "nodes": top }],
            "nodes": parts.nodes, "meshes": parts.meshes,
            "materials": materials.into_iter().map(material).collect::<Vec<_>>(),
            "accessors": parts.accessors,
        });
        if with_levels().next().is_some() {
            document["extensionsUsed"] = json!(["MSFT_lod"]);
        }
        if let Some(features) = all().find_map(|(_, node)| node.features.as_ref()) {
            document["extensionsUsed"] = json!(["EXT_mesh_features", "EXT_structural_metadata"]);
            document["extensions"] = json!({ "EXT_structural_metadata": features.metadata(&mut views, &mut binary) });
        }
        if let Some(texture) = &self.texture {
            put_texture(&mut document, &mut views, &mut binary, texture);
        }
        document["bufferViews"] = json!(views);
        document["buffers"] = json!([{ "byteLength": binary.len() }]);
        container(&document, &binary)
    }
}

/// Puts a texture that ends at its borders.
fn put_texture(document: &mut Value, views: &mut Vec<Value>, binary: &mut Vec<u8>, texture: &Texture) {
    const CLAMPED: u32 = 33071;
    const LINEAR: u32 = 9729;
    const LINEAR_BETWEEN_LINEAR: u32 = 9987;
    let view = json!({ "buffer": 0, "byteOffset": binary.len(), "byteLength": texture.bytes.len() });
    binary.extend_from_slice(&texture.bytes);
    pad(binary, 0);
    let kind = if texture.file == TextureFile::Png { "image/png" } else { "image/jpeg" };
    document["images"] = json!([{ "bufferView": views.len(), "mimeType": kind }]);
    document["samplers"] = json!([{
        "magFilter": LINEAR, "minFilter": LINEAR_BETWEEN_LINEAR, "wrapS": CLAMPED, "wrapT": CLAMPED,
    }]);
    document["textures"] = json!([{ "sampler": 0, "source": 0 }]);
    views.push(view);
}

/// The material as glTF describes it.
fn material_of(classes: Classes, material: Material, has_texture: bool) -> Value {
    let [red, green, blue] = material.light(classes);
    let word = material.word(classes);
    let mut value = json!({
        "name": if material.sheet == Sheet::Decks { format!("decks_{word}") } else { word },
        "pbrMetallicRoughness": {
            "baseColorFactor": [red, green, blue, 1.0], "metallicFactor": 0.0, "roughnessFactor": 1.0,
        },
    });
    if has_texture && material.sheet != Sheet::Objects {
        value["pbrMetallicRoughness"]["baseColorFactor"] = json!([1.0, 1.0, 1.0, 1.0]);
        value["pbrMetallicRoughness"]["baseColorTexture"] = json!({ "index": 0 });
    }
    if material.sheet.is_seen_from_below() {
        value["doubleSided"] = json!(true);
    }
    value
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
pub(crate) fn container(document: &Value, binary: &[u8]) -> Vec<u8> {
    let mut json = document.to_string().into_bytes();
    pad(&mut json, b' ');
    let numbers = if binary.is_empty() { 0 } else { 8 + binary.len() };
    let length = 12 + 8 + json.len() + numbers;
    let mut file = Vec::with_capacity(length);
    file.extend_from_slice(b"glTF");
    let mut put = |number: usize| file.extend_from_slice(&(number as u32).to_le_bytes());
    put(2);
    put(length);
    put(json.len());
    file.extend_from_slice(b"JSON");
    file.extend_from_slice(&json);
    if !binary.is_empty() {
        file.extend_from_slice(&(binary.len() as u32).to_le_bytes());
        file.extend_from_slice(b"BIN\0");
        file.extend_from_slice(binary);
    }
    file
}

/// Writes `mesh`, that of a product, as binary glTF, counted from the south-west corner of what is exported: a node for
/// each load module, over vertices of its own, one for its decks and ribbons below nodes `decks` and `ribbons`, and one
/// for each object below a node `objects`.
/// Normals are those of the whole mesh, so that no line shows between two. Coarser levels of load modules are nodes
/// that `MSFT_lod` puts in their places; readers that do not know it show the finest.
///
/// # Errors
/// Those of `out`.
pub fn write_glb(out: &mut impl Write, product: &Product, mesh: &Mesh, texture: Option<Texture>) -> Result<()> {
    let facts = Facts::y_up(product);
    let details = Detail::all(product, mesh.clone());
    let node = |of: &Detail, name: String, sheet: Sheet, part: &Part| {
        let uvs = texture.as_ref().filter(|_| sheet != Sheet::Objects).map(|photo| of.mesh.uvs(photo, &part.vertices));
        let metres = |&v: &u32| turned(of.mesh.vertices[v as usize].map(metres_of_quanta));
        let node = GltfNode {
            name,
            positions: part.vertices.iter().map(metres).collect(),
            normals: part.vertices.iter().map(|&v| turned(of.normals[v as usize])).collect(),
            uvs: uvs.unwrap_or_default(),
            lanes: part.lanes.clone(),
            ..GltfNode::default()
        };
        node.with_groups(&part.triangles, &part.classes)
    };
    // Of all sheets of a load module.
    let of_levels = |id: ModuleId| (id, steps(details.iter().map(|of| &of.product), alone(id)));
    let all_steps: BTreeMap<ModuleId, Vec<Step>> = product.rect.iter().map(of_levels).collect();
    let of_module = |sheet: Sheet, id: ModuleId| {
        let (rect, name) = (alone(id), sheet_name(sheet, alone(id)));
        let steps = &all_steps[&id];
        let coverage = |at: usize| steps.get(at + 1).map_or(0.0, |next| coverage(product.side_m(), next.near_m));
        let level = |(at, of): (usize, &Detail)| {
            let name = if at == 0 { name.clone() } else { format!("{name}_lod{}", of.product.level) };
            let node = node(of, name, sheet, &of.mesh.part(&of.product, sheet, rect));
            GltfNode { coverage: coverage(at), ..node }
        };
        let mut levels = details.iter().enumerate().map(level);
        let finest = levels.next().unwrap_or_default();
        GltfNode { coarser: levels.filter(|node| !node.groups.is_empty()).collect(), ..finest }
    };
    let of_modules = |sheet: Sheet| -> Vec<GltfNode> {
        let all = product.rect.iter().map(|id| of_module(sheet, id));
        all.filter(|node| !node.groups.is_empty()).collect()
    };
    let things = details[0].mesh.part(product, Sheet::Objects, product.rect).by_thing();
    let of_thing = |(thing, part): (Thing, Part)| GltfNode {
        extras: thing.told(),
        ..node(&details[0], thing.name(), Sheet::Objects, &part)
    };
    let sheets = vec![
        (Sheet::Ground, of_modules(Sheet::Ground)),
        (Sheet::Decks, of_modules(Sheet::Decks)),
        (Sheet::Ribbons, of_modules(Sheet::Ribbons)),
        (Sheet::Objects, things.into_iter().map(of_thing).collect()),
    ];
    let gltf = Gltf {
        sheets,
        classes: product.classes(),
        thanks: product.attributions().join("; "),
        extras: json!({
            "crs": product.crs(), "vertical_datum": product.vertical_datum(), "offset_m": facts.offset_m,
            "axes": facts.axes, "attribution": product.attributions(),
        }),
        texture,
    };
    out.write_all(&gltf.bytes())
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
            let posts = |lattice: i32, from: i32| f64::from(lattice) / f64::from(tin.steps_per_post) - f64::from(from);
            let (row, col) = (posts(vertex.at.row, tin.rect.south), posts(vertex.at.col, tin.rect.west));
            [col * dx, row * dy, metres_of_quanta(vertex.height)]
        })
        .collect();
    let south_west = [f64::from(tin.rect.west) * dx, f64::from(tin.rect.south) * dy];
    let node = GltfNode {
        name: "tin".into(),
        positions: places.iter().copied().map(turned).collect(),
        normals: normals(&places, &tin.triangles).into_iter().map(turned).collect(),
        groups: vec![(0, tin.triangles.clone())],
        ..GltfNode::default()
    };
    let gltf = Gltf {
        sheets: vec![(Sheet::Ground, vec![node])],
        classes: Classes::default(),
        extras: json!({
            "crs": place.crs, "axes": "x east, y up, z south",
            "offset_m": [place.origin_m[0] + south_west[0], place.origin_m[1] + south_west[1], 0.0],
        }),
        ..Gltf::default()
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
        write_glb(&mut bytes, &product, &Mesh::of(&product), None).unwrap();
        let word = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap()) as usize;
        assert_eq!((&bytes[..4], word(4), word(8)), (&b"glTF"[..], 2, bytes.len()));
        let document: Value = serde_json::from_slice(&bytes[20..20 + word(12)]).unwrap();
        let binary = word(20 + word(12));
        assert_eq!(28 + word(12) + binary, bytes.len());
        assert_eq!(document["buffers"][0]["byteLength"], binary);
        // Of the western load module; then its normals and two lists of triangles come, then the eastern one.
        assert_eq!(document["accessors"][0]["min"], json!([0.0, 1000.0, -500.0]));
        assert_eq!(document["accessors"][4]["max"], json!([1000.0, 1004.0, 0.0]));
        assert_eq!(document["meshes"][0]["primitives"].as_array().unwrap().len(), 2);
        assert_eq!(document["materials"][1]["name"], "class_1");
        assert_eq!(document["asset"]["extras"]["offset_m"][0], 505_000.0);
        for view in document["bufferViews"].as_array().unwrap() {
            let (start, length) = (view["byteOffset"].as_u64().unwrap(), view["byteLength"].as_u64().unwrap());
            assert!(start % 4 == 0 && start + length <= binary as u64);
        }
        // Of the positions of both load modules, of their normals; lists of indices lie close by themselves.
        assert_eq!(
            [0, 1, 2].map(|view| document["bufferViews"][view]["byteStride"].as_u64()),
            [Some(12), Some(12), None]
        );
    }

    #[test]
    fn decks_are_nodes_below_one_of_their_own_and_materials_have_the_names_and_colours_of_classes() {
        let product = samples::with_bridge();
        let mut bytes = Vec::new();
        write_glb(&mut bytes, &product, &Mesh::of(&product), None).unwrap();
        let length = u32::from_le_bytes(bytes[12..16].try_into().unwrap()) as usize;
        let document: Value = serde_json::from_slice(&bytes[20..20 + length]).unwrap();
        assert_eq!(document["nodes"][4], json!({ "name": "decks", "children": [2, 3] }));
        assert_eq!(
            (&document["scenes"][0]["nodes"], &document["nodes"][3]["name"]),
            (&json!([0, 1, 4]), &json!("decks_r0000c0001"))
        );
        let names: Vec<&str> =
            document["materials"].as_array().unwrap().iter().map(|of| of["name"].as_str().unwrap()).collect();
        assert_eq!(names, ["default", "motorway", "decks_motorway", "decks_track"]);
        let color = &document["materials"][1]["pbrMetallicRoughness"]["baseColorFactor"];
        assert_eq!(
            (color, &document["materials"][2]["doubleSided"]),
            (&json!([0.034, 0.03, 0.027, 1.0]), &json!(true))
        );
        assert_eq!(document["meshes"][3]["primitives"].as_array().unwrap().len(), 2);
    }

    #[test]
    fn nodes_are_named_after_load_modules_and_holes_are_left_out() {
        let names = |product: &Product| -> Vec<(String, u64)> {
            let mut bytes = Vec::new();
            write_glb(&mut bytes, product, &Mesh::of(product), None).unwrap();
            let length = u32::from_le_bytes(bytes[12..16].try_into().unwrap()) as usize;
            let document: Value = serde_json::from_slice(&bytes[20..20 + length]).unwrap();
            let count = |node: &Value| -> u64 {
                let primitives = &document["meshes"][node["mesh"].as_u64().unwrap() as usize]["primitives"];
                let indices = primitives.as_array().unwrap().iter().map(|of| of["indices"].as_u64().unwrap() as usize);
                indices.map(|of| document["accessors"][of]["count"].as_u64().unwrap() / 3).sum()
            };
            let nodes = document["nodes"].as_array().map_or(&[][..], Vec::as_slice);
            nodes.iter().map(|node| (node["name"].as_str().unwrap().to_owned(), count(node))).collect()
        };
        let expected = |counts: &[(&str, u64)]| counts.iter().map(|(name, n)| ((*name).into(), *n)).collect::<Vec<_>>();
        assert_eq!(names(&samples::product()), expected(&[("r0000c0000", 2), ("r0000c0001", 4)]));
        let mut product = samples::with_hole();
        assert_eq!(names(&product), expected(&[("r0000c0000", 2), ("r0000c0001", 2)]));
        product.modules.iter_mut().for_each(|module| module.classes.fill(terrain::HOLE_CLASS));
        assert_eq!(names(&product), []);
    }
}
