//! 3D Tiles 1.1: the area, in it a coarse mesh for each 4 km square, in these groups of load modules, each in binary
//! glTF. A group is halved until it has no more triangles than a viewer likes to load at once. Triangles over holes are
//! left out, and in the coarse mesh load modules that are holes for more than half.
//!
//! Where load modules have coarser levels, those of a square are a mesh between the two, level by level. Decks and
//! objects are nodes of their own in the files of groups and levels; the coarse mesh of a square has none, and one
//! class. Every square has a frame of its own, so that 32-bit floats are fine to a fraction of a millimetre. A
//! geometric error is measured: of a square, how far its load modules lie from it; of a level in it and of a group, the
//! largest residual.

use std::collections::BTreeMap;
use std::sync::{Mutex, PoisonError};

use serde_json::{Value, json};
use terrain::{ModuleRect, metres_of_quanta};

use crate::coarse::Coarse;
use crate::detail::{largest_residual_m, steps};
use crate::earth::Earth;
use crate::glb::{Gltf, GltfNode, turned};
use crate::glb_features::FoundFeatures;
use crate::globe::{Globe, LocalFrame};
use crate::mesh::{Mesh, Part};
use crate::modules::{group_name, sheet_name};
use crate::openflight::{square_name, square_side};
use crate::{Datum, ExportError, Product, Put, Sheet, Texture, Work};

/// Writes `tileset.json`, `squares/*.glb`, `groups/*.glb` and, for coarser levels, `levels/K/*.glb`. `assumed` is what
/// to take heights to be above; else the database says it. Returns what was done to heights.
///
/// # Errors
/// When a file cannot be written, heights cannot be brought above the ellipsoid, or the work was asked to stop.
pub fn write_3dtiles(product: &Product, assumed: Option<Datum>, put: &Put, work: &Work) -> Result<Datum, ExportError> {
    write_on(product, Earth::new(product, assumed)?, put, work)
}

/// The same of a product that is set on the globe.
pub(crate) fn write_on(product: &Product, earth: Earth, put: &Put, work: &Work) -> Result<Datum, ExportError> {
    let layers = Layers::of(product, earth, work)?;
    let tileset = layers.tileset(work, |rect| layers.square(rect, &|name, made| put(name, &made())))?;
    put("tileset.json", tileset.as_bytes())?;
    Ok(layers.earth.datum())
}

/// A product as 3D Tiles, each file of which is made when it is asked for.
pub struct Tileset {
    layers: Layers,
    text: String,
    /// The square of every other file, by its name.
    square_of: BTreeMap<String, ModuleRect>,
}

impl Tileset {
    /// Sets a product on the globe, and measures its squares.
    ///
    /// # Errors
    /// When heights cannot be brought above the ellipsoid, or the work was asked to stop.
    pub fn of(product: &Product, assumed: Option<Datum>, work: &Work) -> Result<Self, ExportError> {
        let layers = Layers::of(product, Earth::new(product, assumed)?, work)?;
        let named = Mutex::new(BTreeMap::new());
        let lock = || named.lock().unwrap_or_else(PoisonError::into_inner);
        let text = layers.tileset(work, |rect| {
            layers.square(rect, &|name, _| {
                lock().insert(name.to_owned(), rect);
                Ok(())
            })
        })?;
        let square_of = named.into_inner().unwrap_or_else(PoisonError::into_inner);
        Ok(Self { layers, text, square_of })
    }

    /// The bytes of a file by its name in the export; `None` where the export has none of this name.
    ///
    /// # Errors
    /// None are known: those of making it.
    pub fn file(&self, name: &str) -> Result<Option<Vec<u8>>, ExportError> {
        if name == "tileset.json" {
            return Ok(Some(self.text.clone().into_bytes()));
        }
        let Some(&rect) = self.square_of.get(name) else { return Ok(None) };
        let found = Mutex::new(None);
        self.layers.square(rect, &|made_name, made| {
            if made_name == name {
                *found.lock().unwrap_or_else(PoisonError::into_inner) = Some(made());
            }
            Ok(())
        })?;
        Ok(found.into_inner().unwrap_or_else(PoisonError::into_inner))
    }
}

/// Takes a file of a tileset by its name, and what makes its bytes.
type Take<'a> = dyn Fn(&str, &dyn Fn() -> Vec<u8>) -> Result<(), ExportError> + Sync + 'a;

/// The longer side of a product, in metres.
fn size_m(product: &Product) -> f64 {
    let ModuleRect { south, west, north, east } = product.rect;
    let [low, high] = [product.corner_m(south, west), product.corner_m(north, east)];
    (high[0] - low[0]).max(high[1] - low[1])
}

/// Adds its children to a tile: the list, where there is one, is not empty.
fn put_children(tile: &mut Value, children: Vec<Value>) {
    if !children.is_empty() {
        tile["children"] = Value::Array(children);
    }
}

/// West, south, east and north in radians, lowest and highest height: what a region is in 3D Tiles.
fn region(lon_lat: &[[f64; 2]], low: f64, high: f64) -> [f64; 6] {
    let ends = |axis: usize| {
        let values = || lon_lat.iter().map(|place| place[axis].to_radians());
        [values().fold(f64::INFINITY, f64::min), values().fold(f64::NEG_INFINITY, f64::max)]
    };
    let ([west, east], [south, north]) = (ends(0), ends(1));
    [west, south, east, north, low, high]
}

/// One level of the product as a mesh on the globe.
struct Layer {
    product: Product,
    mesh: Mesh,
    globe: Globe,
}

/// All levels, from fine to coarse.
struct Layers {
    layers: Vec<Layer>,
    earth: Earth,
}

impl Layers {
    fn of(product: &Product, earth: Earth, work: &Work) -> Result<Self, ExportError> {
        let layer = |product: Product| {
            let mesh = Mesh::whole(&product).with_sheets(&product).with_lanes(&product);
            let globe = Globe::of(&product, &mesh, &earth, work)?;
            Ok(Layer { product, mesh, globe })
        };
        let layers = product.levels().map(layer).collect::<Result<_, ExportError>>()?;
        Ok(Self { layers, earth })
    }

    /// The text of `tileset.json`; `square` gives the tile of a square.
    fn tileset(
        &self,
        work: &Work,
        square: impl Fn(ModuleRect) -> Result<Option<Value>, ExportError> + Sync,
    ) -> Result<String, ExportError> {
        let product = &self.layers[0].product;
        let squares = product.squares(square_side(product));
        let children: Vec<Value> =
            work.each("squares", &squares, |&rect| square(rect))?.into_iter().flatten().collect();
        let heights = || self.layers.iter().flat_map(|layer| layer.globe.height_m.iter().copied());
        let (low, high) = (heights().fold(f64::INFINITY, f64::min), heights().fold(f64::NEG_INFINITY, f64::max));
        // Neither the tileset nor its root has anything to draw, so without their tiles all of the area is missing,
        // however flat it is: viewers draw nothing at all where this error is too small to be seen.
        let missing_m = size_m(product);
        let mut tileset = json!({
            "asset": {
                "version": "1.1",
                "tilesetVersion": "1",
                "extras": {
                    "generator": "tiefort", "area": product.manifest.area.name, "crs": product.crs(),
                    "vertical_datum": product.vertical_datum(), "heights": self.earth.datum().said(),
                    "attribution": product.attributions(),
                },
            },
            "geometricError": missing_m,
            "root": {
                "boundingVolume": { "region": region(&self.layers[0].globe.lon_lat, low, high) },
                "geometricError": missing_m,
                "refine": "REPLACE",
            },
        });
        put_children(&mut tileset["root"], children);
        Ok(tileset.to_string())
    }

    /// Hands out the files of a square; its tile, if it has any ground.
    fn square(&self, rect: ModuleRect, take: &Take) -> Result<Option<Value>, ExportError> {
        let finest = &self.layers[0];
        let coarse = Coarse::of(&finest.product, &finest.mesh, rect);
        let middle = coarse.vertices[coarse.vertices.len() / 2] as usize;
        let frame = LocalFrame::at(finest.globe.lon_lat[middle], finest.globe.height_m[middle]);
        let parts: Vec<Parts> = self.layers.iter().map(|layer| layer.mesh.parts(&layer.product, rect)).collect();
        if parts.iter().all(Vec::is_empty) {
            return Ok(None);
        }
        let bounds = box_around(self.layers.iter().zip(&parts).flat_map(|(layer, parts)| layer.places(&frame, parts)));
        let mut children = finest.groups(&frame, rect, take)?;
        // A viewer would not go on to what is finer if what is coarser were said to be truer.
        let steps = steps(self.layers.iter().map(|layer| &layer.product), rect);
        for ((layer, parts), step) in self.layers.iter().zip(&parts).zip(&steps).skip(1) {
            let name = square_name(&layer.product, rect, "glb");
            let uri = format!("levels/{}/{name}", step.level);
            let texture = layer.product.texture(rect, step.error_m)?;
            take(&uri, &|| layer.gltf(&frame, rect, parts, texture.clone()).bytes())?;
            let mut level = json!({
                "boundingVolume": { "box": bounds },
                "geometricError": step.error_m,
                "content": { "uri": uri },
            });
            put_children(&mut level, children);
            children = vec![level];
        }
        // The coarse mesh lacks what stands on the ground.
        let coarse_error_m = coarse.error_m.max(metres_of_quanta(Mesh::tallest(&parts[0])));
        let mut tile = json!({
            "transform": frame.matrix(),
            "boundingVolume": { "box": bounds },
            "geometricError": match steps.as_slice() {
                [.., _, coarsest] => coarse_error_m.max(coarsest.error_m),
                _ => coarse_error_m,
            },
        });
        put_children(&mut tile, children);
        if !coarse.triangles.is_empty() {
            let uri = format!("squares/{}", square_name(&finest.product, rect, "glb"));
            let texture = finest.product.texture(rect, coarse.error_m)?;
            take(&uri, &|| {
                let classes = vec![0; coarse.triangles.len()];
                let node = finest.node(&frame, group_name(rect), &coarse.vertices, texture.as_ref());
                let nodes = vec![node.with_groups(&coarse.triangles, &classes)];
                Gltf { sheets: vec![(Sheet::Ground, nodes)], texture: texture.clone(), ..Gltf::default() }.bytes()
            })?;
            tile["content"] = json!({ "uri": uri });
        }
        Ok(Some(tile))
    }
}

/// Triangles that a group of load modules has at most, unless a single one has more.
const GROUP_TRIANGLES_MAX: usize = 2048;

/// The two halves of a rectangle, across its longer side.
fn halves(rect: ModuleRect) -> [ModuleRect; 2] {
    if rect.rows() < rect.cols() {
        let middle = rect.west.midpoint(rect.east);
        [ModuleRect { east: middle, ..rect }, ModuleRect { west: middle, ..rect }]
    } else {
        let middle = rect.south.midpoint(rect.north);
        [ModuleRect { north: middle, ..rect }, ModuleRect { south: middle, ..rect }]
    }
}

/// What some load modules have of each sheet.
type Parts = Vec<(Sheet, Part)>;

impl Layer {
    /// The sheets of a rectangle, each a node where there is any.
    fn gltf(&self, frame: &LocalFrame, rect: ModuleRect, parts: &Parts, texture: Option<Texture>) -> Gltf<'_> {
        let node = |(sheet, part): &(Sheet, Part)| {
            let features = (*sheet == Sheet::Objects).then(|| FoundFeatures::of(part));
            let texture = texture.as_ref().filter(|_| *sheet != Sheet::Objects);
            let node = self.node(frame, sheet_name(*sheet, rect), &part.vertices, texture);
            let node = GltfNode { features, lanes: part.lanes.clone(), ..node };
            (*sheet, vec![node.with_groups(&part.triangles, &part.classes)])
        };
        let sheets = parts.iter().map(node).collect();
        let thanks = self.product.attributions().join("; ");
        Gltf { sheets, classes: self.product.classes(), thanks, texture, ..Gltf::default() }
    }

    /// Hands out a file for each group of load modules of a square; their tiles.
    fn groups(&self, frame: &LocalFrame, square: ModuleRect, take: &Take) -> Result<Vec<Value>, ExportError> {
        let mut tiles = Vec::new();
        let mut left = vec![square];
        while let Some(rect) = left.pop() {
            let parts = self.mesh.parts(&self.product, rect);
            let triangles: usize = parts.iter().map(|(_, part)| part.triangles.len()).sum();
            if triangles == 0 {
                continue;
            }
            if GROUP_TRIANGLES_MAX < triangles && 1 < rect.count() {
                left.extend(halves(rect));
                continue;
            }
            let uri = format!("groups/{}.glb", group_name(rect));
            let texture = self.product.texture(rect, 0.0)?;
            take(&uri, &|| self.gltf(frame, rect, &parts, texture.clone()).bytes())?;
            tiles.push(json!({
                "boundingVolume": { "box": box_around(self.places(frame, &parts)) },
                "geometricError": largest_residual_m(&self.product, rect),
                "content": { "uri": uri },
            }));
        }
        Ok(tiles)
    }

    /// Where the vertices of all sheets lie in a frame.
    fn places(&self, frame: &LocalFrame, parts: &Parts) -> impl Iterator<Item = [f64; 3]> {
        let vertices = parts.iter().flat_map(|(_, part)| &part.vertices);
        vertices.map(|&v| frame.local(self.globe.place[v as usize]))
    }

    /// Vertices of the mesh in a frame.
    fn node(&self, frame: &LocalFrame, name: String, vertices: &[u32], texture: Option<&Texture>) -> GltfNode {
        let place = |&v: &u32| turned(frame.local(self.globe.place[v as usize]));
        let normal = |&v: &u32| turned(frame.turned(self.globe.normal[v as usize]));
        GltfNode {
            name,
            positions: vertices.iter().map(place).collect(),
            normals: vertices.iter().map(normal).collect(),
            uvs: texture.map(|texture| self.mesh.uvs(texture, vertices)).unwrap_or_default(),
            ..GltfNode::default()
        }
    }
}

/// The box around places along the axes of their frame: its middle, then half of each side.
fn box_around(places: impl Iterator<Item = [f64; 3]>) -> [f64; 12] {
    let ends = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    let (low, high) =
        places.fold(ends, |(low, high), p| ([0, 1, 2].map(|i| low[i].min(p[i])), [0, 1, 2].map(|i| high[i].max(p[i]))));
    let middle = [0, 1, 2].map(|i| f64::midpoint(low[i], high[i]));
    let [x, y, z] = [0, 1, 2].map(|i| (high[i] - low[i]) / 2.0);
    [middle[0], middle[1], middle[2], x, 0.0, 0.0, 0.0, y, 0.0, 0.0, 0.0, z]
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::*;
    use crate::samples;

    /// The files of a tileset.
    fn written(product: &Product) -> BTreeMap<String, Vec<u8>> {
        samples::files(|put, work| {
            let datum = write_3dtiles(product, None, put, work)?;
            assert_eq!(datum, Datum::Egm96);
            Ok(())
        })
    }

    #[test]
    fn a_file_asked_for_alone_is_that_of_the_export() {
        for product in [samples::product(), samples::with_hole(), samples::with_levels(), samples::with_bridge()] {
            let tileset = samples::with_work(|work| Tileset::of(&product, None, work).unwrap());
            for (name, bytes) in written(&product) {
                assert!(tileset.file(&name).unwrap() == Some(bytes), "{name}");
            }
            for other in ["", "groups/", "squares/r00c99.glb", "groups/r0000c0000.glb/", "/tileset.json"] {
                assert_eq!(tileset.file(other).unwrap(), None, "{other:?}");
            }
        }
    }

    fn error(tile: &Value) -> f64 {
        tile["geometricError"].as_f64().unwrap()
    }

    #[test]
    fn a_tileset_names_every_file_and_its_errors_shrink_on_the_way_down() {
        let files = written(&samples::product());
        let tileset: Value = serde_json::from_slice(&files["tileset.json"]).unwrap();
        let square = &tileset["root"]["children"][0];
        let modules = square["children"].as_array().unwrap();
        // Both load modules have few triangles: one group.
        assert_eq!(modules.len(), 1);
        assert_eq!(modules[0]["content"]["uri"], "groups/r0000c0000_r0000c0001.glb");
        for tile in modules.iter().chain([square]) {
            assert!(files.contains_key(tile["content"]["uri"].as_str().unwrap()), "{tile}");
        }
        assert_eq!(files.len(), 1 + 1 + 1);
        assert!(modules.iter().all(|module| error(module) < error(square)));
        // Where nothing is drawn, two load modules of 500 m are missing.
        assert_eq!((error(&tileset), error(&tileset["root"])), (1000.0, 1000.0));
        let region = tileset["root"]["boundingVolume"]["region"].as_array().unwrap();
        // Heights above EGM96, whose surface lies some 30 m below the ellipsoid here.
        assert!((960.0..965.0).contains(&region[4].as_f64().unwrap()), "{region:?}");
    }

    #[test]
    fn holes_are_left_out_and_a_square_without_ground_is_none() {
        let mut product = samples::with_hole();
        let files = written(&product);
        let whole = written(&samples::product());
        let group = "groups/r0000c0000_r0000c0001.glb";
        assert!(files[group].len() < whole[group].len());
        product.modules[1].classes.fill(terrain::HOLE_CLASS);
        // Of the group only the western load module is left; the coarse mesh has its two triangles alone.
        let files = written(&product);
        assert!(files["squares/r00c00.glb"].len() < whole["squares/r00c00.glb"].len());
        product.modules[0].classes.fill(terrain::HOLE_CLASS);
        let files = written(&product);
        assert_eq!(files.keys().collect::<Vec<_>>(), ["tileset.json"]);
        let tileset: Value = serde_json::from_slice(&files["tileset.json"]).unwrap();
        assert!(tileset["root"].get("children").is_none(), "no list of children may be empty");
    }

    #[test]
    fn decks_are_nodes_of_groups_and_their_boxes_hold_them() {
        let files = written(&samples::with_bridge());
        let file = &files["groups/r0000c0000_r0000c0001.glb"];
        let (document, _) = crate::tests::document(file);
        let names: Vec<&str> =
            document["nodes"].as_array().unwrap().iter().map(|node| node["name"].as_str().unwrap()).collect();
        assert_eq!(names, ["r0000c0000_r0000c0001", "decks_r0000c0000_r0000c0001", "decks"]);
        let tileset: Value = serde_json::from_slice(&files["tileset.json"]).unwrap();
        let bounds = |of: &Value| -> f64 {
            let bounds = &of["boundingVolume"]["box"];
            bounds[2].as_f64().unwrap() + bounds[11].as_f64().unwrap()
        };
        let square = &tileset["root"]["children"][0];
        let highest = |of: &Value| {
            let accessor = document["meshes"][1]["primitives"][0]["attributes"]["POSITION"].as_u64().unwrap();
            document["accessors"][accessor as usize]["max"][1].as_f64().unwrap() - bounds(of)
        };
        assert!(highest(square) <= 1e-3 && highest(&square["children"][0]) <= 1e-3);
        // The coarse mesh of the square is ground alone.
        assert!(files["squares/r00c00.glb"] == written(&samples::product())["squares/r00c00.glb"]);
    }

    #[test]
    fn a_rectangle_is_halved_across_its_longer_side() {
        let rect = ModuleRect { south: 0, west: 8, north: 3, east: 16 };
        let [west, east] = halves(rect);
        assert_eq!((west.east, east.west, west.count() + east.count()), (12, 12, rect.count()));
        let [south, north] = halves(ModuleRect { south: 0, west: 0, north: 3, east: 1 });
        assert_eq!((south.count(), north.count()), (1, 2));
        assert_eq!(group_name(rect), "r0000c0008_r0002c0015");
    }

    #[test]
    fn coarser_levels_stand_between_a_square_and_its_load_modules() {
        let files = written(&samples::with_levels());
        let plain = written(&samples::product());
        let tileset: Value = serde_json::from_slice(&files["tileset.json"]).unwrap();
        let square = &tileset["root"]["children"][0];
        let [level] = square["children"].as_array().unwrap().as_slice() else { panic!("one level between") };
        let uri = level["content"]["uri"].as_str().unwrap();
        assert!(uri.starts_with("levels/1/") && files.contains_key(uri), "{uri}");
        assert_eq!(error(level), 1200.0 / 128.0);
        let modules = level["children"].as_array().unwrap();
        assert!(modules.iter().all(|module| error(module) < error(level)) && error(level) <= error(square));
        assert_eq!((modules.len(), files.len()), (1, plain.len() + 1));
        for (name, bytes) in plain.iter().filter(|(name, _)| name.as_str() != "tileset.json") {
            assert!(files[name] == *bytes, "{name}");
        }
    }
}
