//! 3D Tiles 1.1: the area, in it a coarse mesh for each 4 km square, in these groups of load modules, each in binary
//! glTF. A group is halved until it has no more triangles than a viewer likes to load at once. Triangles over holes are
//! left out, and in the coarse mesh load modules that are holes for more than half.
//!
//! Where load modules have coarser levels, those of a square are a mesh between the two, level by level. Decks, ribbons
//! and objects are nodes of their own in the files of groups and levels; a level lacks objects, but for woods, that are
//! no higher than its error, and ribbons that are no wider; the coarse mesh of a square has none of them, and
//! one class for each load module. From sides of squares hang skirts, as neighbours, those of other databases too, may
//! be shown at other levels.
//!
//! Every square has a frame of its own, so that 32-bit floats are fine to a fraction of a millimetre. A geometric error
//! is measured: of a square, how far its load modules lie from it; of a level in it and of a group, the largest
//! residual.

use std::collections::BTreeMap;
use std::sync::{Mutex, PoisonError};

use serde_json::{Value, json};
use terrain::{ModuleRect, ObjectKind, QUANTA_PER_METRE, is_band, metres_of_quanta};

use crate::coarse::Coarse;
use crate::detail::{Step, largest_residual_m, steps};
use crate::earth::{Earth, earth_centred};
use crate::glb::{Gltf, GltfNode, turned};
use crate::glb_features::FoundFeatures;
use crate::globe::{Globe, LocalFrame};
use crate::mesh::{Mesh, Part};
use crate::modules::{group_name, sheet_name};
use crate::objects::Thing;
use crate::openflight::{square_name, square_side};
use crate::skirts::{Depths, Side, Skirt, depths};
use crate::{Datum, ExportError, Product, Put, Sheet, Texture, Work};

/// Texels of a tile are no finer than this part of its error: where viewers go on to what is finer, at an error of 16
/// pixels, a texel is two of these.
pub(crate) const TEXELS_TO_ERROR: f64 = 1.0 / 8.0;

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

    /// The text of `tileset.json`; `square` gives the tile of a square, and how far its skirts hang, in metres.
    fn tileset(
        &self,
        work: &Work,
        square: impl Fn(ModuleRect) -> Result<Option<(Value, f64)>, ExportError> + Sync,
    ) -> Result<String, ExportError> {
        let product = &self.layers[0].product;
        let squares = product.squares(square_side(product));
        let found: Vec<(Value, f64)> =
            work.each("squares", &squares, |&rect| square(rect))?.into_iter().flatten().collect();
        let deepest_m = found.iter().map(|(_, deepest_m)| *deepest_m).fold(0.0, f64::max);
        let children = found.into_iter().map(|(tile, _)| tile).collect();
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
                "boundingVolume": { "region": region(&self.layers[0].globe.lon_lat, low - deepest_m, high) },
                "geometricError": missing_m,
                "refine": "REPLACE",
            },
        });
        put_children(&mut tileset["root"], children);
        Ok(tileset.to_string())
    }

    /// Hands out the files of a square; its tile, if it has any ground, and how far its skirts hang, in metres.
    fn square(&self, rect: ModuleRect, take: &Take) -> Result<Option<(Value, f64)>, ExportError> {
        let finest = &self.layers[0];
        let coarse = Coarse::of(&finest.product, &finest.mesh, rect);
        let middle = coarse.vertices[coarse.vertices.len() / 2] as usize;
        let frame = LocalFrame::at(finest.globe.lon_lat[middle], finest.globe.height_m[middle]);
        let steps = steps(self.layers.iter().map(|layer| &layer.product), rect);
        let (shown, skirt) = self.shown(rect, &coarse, &steps);
        if shown.iter().all(|shown| shown.parts.is_empty()) {
            return Ok(None);
        }
        let places = self.layers.iter().zip(&shown).flat_map(|(layer, shown)| layer.places(&frame, shown));
        let bounds = box_around(places.chain(finest.below(&frame, &coarse.vertices, &skirt)));
        let mut children = finest.groups(&frame, rect, &shown[0].depths, take)?;
        // A viewer would not go on to what is finer if what is coarser were said to be truer.
        for ((layer, shown), step) in self.layers.iter().zip(&shown).zip(&steps).skip(1) {
            let name = square_name(&layer.product, rect, "glb");
            let uri = format!("levels/{}/{name}", step.level);
            let texture = layer.product.texture(rect, TEXELS_TO_ERROR * step.error_m)?;
            take(&uri, &|| layer.gltf(&frame, rect, shown, texture.clone()).bytes())?;
            let mut level = json!({
                "boundingVolume": { "box": bounds },
                "geometricError": step.error_m,
                "content": { "uri": uri },
            });
            put_children(&mut level, children);
            children = vec![level];
        }
        // The coarse mesh lacks what stands on the ground.
        let coarse_error_m = coarse.error_m.max(metres_of_quanta(Mesh::tallest(&shown[0].parts)));
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
            let texture = finest.product.texture(rect, TEXELS_TO_ERROR * coarse.error_m)?;
            take(&uri, &|| {
                let node = finest.node(&frame, group_name(rect), (&coarse.vertices, &skirt), texture.as_ref());
                let nodes = vec![with_skirt(node, &coarse.triangles, &coarse.classes, &skirt)];
                finest.file(vec![(Sheet::Ground, nodes)], texture.clone()).bytes()
            })?;
            tile["content"] = json!({ "uri": uri });
        }
        let skirts = shown.iter().map(|shown| &shown.skirt).chain([&skirt]);
        Ok(Some((tile, skirts.map(Skirt::deepest_m).fold(0.0, f64::max))))
    }

    /// What is shown of a square at each level, and the skirt of its coarse mesh.
    fn shown(&self, rect: ModuleRect, coarse: &Coarse, steps: &[Step]) -> (Vec<Shown>, Skirt) {
        let finest = &self.layers[0];
        let parts: Vec<Parts> = self.layers.iter().zip(steps).map(|(layer, step)| layer.parts(rect, step)).collect();
        let ground =
            |parts: &Parts| parts.iter().find(|(sheet, _)| *sheet == Sheet::Ground).map(|(_, part)| part.clone());
        let of_parts = self.layers.iter().zip(&parts).map(|(layer, parts)| {
            let vertices = ground(parts).unwrap_or_default().vertices;
            vertices.iter().map(|&v| layer.mesh.vertices[v as usize]).collect()
        });
        let of_coarse = coarse.triangles.as_flattened().iter().map(|&v| coarse.vertices[v as usize]);
        let of_coarse = of_coarse.map(|v| finest.mesh.vertices[v as usize]).collect();
        let meshes: Vec<Vec<[i32; 3]>> = of_parts.chain([of_coarse]).collect();
        let mut depths = depths(&Side::of(&finest.product, rect), &meshes);
        let last = depths.pop().expect("the coarse mesh is the last");
        let skirt = Skirt::of(&finest.mesh, &coarse.vertices, &coarse.triangles, &coarse.classes, &last);
        let layers = self.layers.iter().zip(parts).zip(depths);
        (layers.map(|((layer, parts), depths)| Shown::of(layer, parts, depths)).collect(), skirt)
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

/// What a file shows of some load modules.
struct Shown {
    parts: Parts,
    /// How far the skirt of their ground hangs.
    depths: Depths,
    skirt: Skirt,
}

impl Shown {
    fn of(layer: &Layer, parts: Parts, depths: Depths) -> Self {
        let skirt = match parts.first() {
            Some((Sheet::Ground, ground)) => {
                Skirt::of(&layer.mesh, &ground.vertices, &ground.triangles, &ground.classes, &depths)
            }
            _ => Skirt::default(),
        };
        Self { parts, depths, skirt }
    }

    /// The skirt of a sheet.
    fn skirt_of(&self, sheet: Sheet) -> &Skirt {
        const NONE: &Skirt = &Skirt { hung: Vec::new(), triangles: Vec::new(), classes: Vec::new() };
        if sheet == Sheet::Ground { &self.skirt } else { NONE }
    }
}

/// A node with its triangles, and those of its skirt.
fn with_skirt(node: GltfNode, triangles: &[[u32; 3]], classes: &[u8], skirt: &Skirt) -> GltfNode {
    node.with_groups(&[triangles, &skirt.triangles].concat(), &[classes, &skirt.classes].concat())
}

impl Layer {
    /// The sheets of a rectangle; of a coarser level without ribbons, and objects other than woods, whose width or
    /// height is no larger than its error.
    fn parts(&self, rect: ModuleRect, step: &Step) -> Parts {
        let mut parts = self.mesh.parts(&self.product, rect);
        let is_finest = step.near_m == 0.0;
        if is_finest {
            return parts;
        }
        let least = step.error_m * f64::from(QUANTA_PER_METRE);
        let bands = self.product.lines.iter().flatten().filter(|line| is_band(line));
        let widest = bands.map(|line| line.width).max().unwrap_or(0);
        for (sheet, part) in &mut parts {
            match sheet {
                // Woods cover ground, which would have another colour without them.
                Sheet::Objects => {
                    let is_wood = |kind| matches!(kind, ObjectKind::Wood | ObjectKind::Scrub | ObjectKind::Orchard);
                    let is_seen = |thing: &Thing| is_wood(thing.kind) || least < f64::from(thing.height);
                    *part = part.of_things(is_seen);
                }
                Sheet::Ribbons if f64::from(widest) <= least => *part = Part::default(),
                _ => {}
            }
        }
        parts.retain(|(_, part)| !part.triangles.is_empty());
        parts
    }

    /// The sheets of a rectangle, each a node where there is any.
    fn gltf(&self, frame: &LocalFrame, rect: ModuleRect, shown: &Shown, texture: Option<Texture>) -> Gltf<'_> {
        let node = |(sheet, part): &(Sheet, Part)| {
            let features = (*sheet == Sheet::Objects).then(|| FoundFeatures::of(part));
            let texture = texture.as_ref().filter(|_| *sheet != Sheet::Objects);
            let skirt = shown.skirt_of(*sheet);
            let node = self.node(frame, sheet_name(*sheet, rect), (&part.vertices, skirt), texture);
            let mut lanes = part.lanes.clone();
            lanes.extend(skirt.hung.iter().filter_map(|(v, _)| part.lanes.get(*v as usize)));
            let node = GltfNode { features, lanes, ..node };
            (*sheet, vec![with_skirt(node, &part.triangles, &part.classes, skirt)])
        };
        self.file(shown.parts.iter().map(node).collect(), texture)
    }

    fn file(&self, sheets: Vec<(Sheet, Vec<GltfNode>)>, texture: Option<Texture>) -> Gltf<'_> {
        let thanks = self.product.attributions().join("; ");
        Gltf { sheets, classes: self.product.classes(), thanks, texture, ..Gltf::default() }
    }

    /// Hands out a file for each group of load modules of a square, whose skirts hang so far; their tiles.
    fn groups(
        &self,
        frame: &LocalFrame,
        square: ModuleRect,
        depths: &Depths,
        take: &Take,
    ) -> Result<Vec<Value>, ExportError> {
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
            let shown = Shown::of(self, parts, depths.clone());
            take(&uri, &|| self.gltf(frame, rect, &shown, texture.clone()).bytes())?;
            tiles.push(json!({
                "boundingVolume": { "box": box_around(self.places(frame, &shown)) },
                "geometricError": largest_residual_m(&self.product, rect),
                "content": { "uri": uri },
            }));
        }
        Ok(tiles)
    }

    /// Where the vertices of all that is shown lie in a frame.
    fn places<'a>(&'a self, frame: &'a LocalFrame, shown: &'a Shown) -> impl Iterator<Item = [f64; 3]> + 'a {
        let vertices = shown.parts.iter().flat_map(|(_, part)| &part.vertices);
        let ground = shown.parts.first().map_or(&[][..], |(_, part)| &part.vertices);
        vertices.map(|&v| frame.local(self.globe.place[v as usize])).chain(self.below(frame, ground, &shown.skirt))
    }

    /// Where the lower corners of the skirt of vertices of the mesh lie in a frame.
    fn below<'a>(
        &'a self,
        frame: &'a LocalFrame,
        vertices: &'a [u32],
        skirt: &'a Skirt,
    ) -> impl Iterator<Item = [f64; 3]> + 'a {
        skirt.hung.iter().map(move |&(v, depth_m)| {
            let v = vertices[v as usize] as usize;
            frame.local(earth_centred(self.globe.lon_lat[v], self.globe.height_m[v] - depth_m))
        })
    }

    /// Vertices of the mesh in a frame, and those of their skirt, which look as those above them.
    fn node(
        &self,
        frame: &LocalFrame,
        name: String,
        (vertices, skirt): (&[u32], &Skirt),
        texture: Option<&Texture>,
    ) -> GltfNode {
        let place = |&v: &u32| turned(frame.local(self.globe.place[v as usize]));
        let normal = |&v: &u32| turned(frame.turned(self.globe.normal[v as usize]));
        let below = self.below(frame, vertices, skirt).map(turned);
        let positions = vertices.iter().map(place).chain(below).collect();
        let above = skirt.hung.iter().map(|&(v, _)| vertices[v as usize]);
        let like: Vec<u32> = vertices.iter().copied().chain(above).collect();
        GltfNode {
            name,
            positions,
            normals: like.iter().map(normal).collect(),
            uvs: texture.map(|texture| self.mesh.uvs(texture, &like)).unwrap_or_default(),
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
        // Skirts stand upright.
        let ground = |file: &[u8]| {
            let triangles = crate::tests::meshes(file).into_iter().flat_map(|mesh| mesh.triangles);
            triangles.filter(|corners| 0.1 < normal(*corners)[1]).count()
        };
        assert!(ground(&files[group]) < ground(&whole[group]));
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
        let coarse = crate::tests::meshes(&files["squares/r00c00.glb"]);
        assert!(coarse.iter().all(|mesh| mesh.node == names[0]), "{} meshes", coarse.len());
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

    /// A tile with its file, its box and the matrix of its square.
    struct Seen {
        uri: String,
        triangles: Vec<[[f64; 3]; 3]>,
        bounds: Vec<f64>,
    }

    fn numbers(of: &Value) -> Vec<f64> {
        of.as_array().unwrap().iter().map(|number| number.as_f64().unwrap()).collect()
    }

    /// The tiles of a square, their triangles x east, y north, z up in its frame.
    fn seen(tile: &Value, files: &BTreeMap<String, Vec<u8>>) -> Vec<Seen> {
        let uri = tile["content"]["uri"].as_str().unwrap().to_owned();
        let east_north_up = |[x, y, z]: [f64; 3]| [x, -z, y];
        let of_mesh = |mesh: crate::tests::Found| mesh.triangles.into_iter().map(|corners| corners.map(east_north_up));
        let triangles = crate::tests::meshes(&files[&uri]).into_iter().flat_map(of_mesh).collect();
        let own = Seen { uri, triangles, bounds: numbers(&tile["boundingVolume"]["box"]) };
        let children = tile["children"].as_array().into_iter().flatten();
        std::iter::once(own).chain(children.flat_map(|child| seen(child, files))).collect()
    }

    fn normal([a, b, c]: [[f64; 3]; 3]) -> [f64; 3] {
        crate::mesh::unit(crate::mesh::cross(crate::mesh::minus(b, a), crate::mesh::minus(c, a)))
    }

    /// The wall of a tile on the side of its square: its triangles that stand upright.
    fn wall(tile: &Seen) -> Vec<[[f64; 3]; 3]> {
        tile.triangles.iter().copied().filter(|corners| normal(*corners)[2].abs() < 0.1).collect()
    }

    #[test]
    fn no_gap_is_seen_between_squares_whatever_level_each_is_shown_at() {
        let product = samples::across_squares();
        let files = written(&product);
        let tileset: Value = serde_json::from_slice(&files["tileset.json"]).unwrap();
        let squares = tileset["root"]["children"].as_array().unwrap();
        assert_eq!(squares.len(), 2);
        // The line is 500 m long; the pit in its middle is 3384 quanta deep.
        let depth_m = (f64::midpoint(128_256.0, 128_512.0) - 125_000.0) / 128.0;
        for (square, outwards) in squares.iter().zip([1.0, -1.0]) {
            let tiles = seen(square, &files);
            assert_eq!(tiles.len(), 3, "the square, a level, a group");
            for tile in &tiles {
                let wall = wall(tile);
                // The group has the lowest ground: its wall closes what the bulge of the Earth opens.
                let is_finest = tile.uri.starts_with("groups/");
                assert_eq!(wall.len(), if is_finest { 4 } else { 2 }, "{}", tile.uri);
                let heights = || wall.iter().flatten().map(|place| place[2]);
                let height_m = heights().fold(f64::NEG_INFINITY, f64::max) - heights().fold(f64::INFINITY, f64::min);
                // The line rises by 2 m itself.
                let expected_m = if is_finest { 2.0 + depth_m - 1.0 } else { depth_m + 2.0 };
                assert!((height_m - expected_m).abs() < 0.3, "{}: {height_m} {expected_m}", tile.uri);
                for corners in &wall {
                    let [a, b, c] = *corners;
                    let normal = crate::mesh::cross(crate::mesh::minus(b, a), crate::mesh::minus(c, a));
                    assert!(0.0 < normal[0] * outwards, "{} faces the other square", tile.uri);
                }
                let [x, y, z] = [0, 1, 2].map(|axis| tile.bounds[3 + 4 * axis]);
                let inside = |place: &[f64; 3]| {
                    [x, y, z]
                        .iter()
                        .zip(place)
                        .zip(&tile.bounds)
                        .all(|((half, at), mid)| (at - mid).abs() < half + 1e-3)
                };
                assert!(tile.triangles.iter().flatten().all(inside), "{}: its box holds its walls", tile.uri);
            }
        }
        let lowest = numbers(&tileset["root"]["boundingVolume"]["region"])[4];
        let alone = written(&samples::product());
        let alone: Value = serde_json::from_slice(&alone["tileset.json"]).unwrap();
        let of_alone = numbers(&alone["root"]["boundingVolume"]["region"])[4];
        // Without the pit the lowest place is at 127,000 quanta.
        assert!((of_alone - lowest - 2000.0 / 128.0 - depth_m).abs() < 1.0, "{lowest} {of_alone}");
    }

    #[test]
    fn whatever_two_squares_show_the_higher_hangs_below_the_lower() {
        let product = samples::across_squares();
        let layers =
            samples::with_work(|work| Layers::of(&product, Earth::new(&product, None).unwrap(), work)).unwrap();
        let levels = layers.layers.iter().map(|layer| &layer.product);
        // Top and bottom of each mesh of a square in the middle of the common side, in quanta.
        let mut ends = Vec::new();
        for rect in product.squares(8) {
            let coarse = Coarse::of(&layers.layers[0].product, &layers.layers[0].mesh, rect);
            let (shown, skirt) = layers.shown(rect, &coarse, &steps(levels.clone(), rect));
            let tops = [125_000.0, 128_384.0, 128_384.0];
            let deepest = shown.iter().map(|shown| &shown.skirt).chain([&skirt]).map(Skirt::deepest_m);
            ends.push(
                tops.into_iter().zip(deepest).map(|(top, depth_m)| (top, top - 128.0 * depth_m)).collect::<Vec<_>>(),
            );
        }
        for (top, _) in &ends[0] {
            for (other, bottom) in &ends[1] {
                assert!(top >= other || bottom <= top, "{ends:?}");
            }
        }
    }

    #[test]
    fn a_coarser_level_has_objects_and_ribbons_that_are_larger_than_its_error() {
        let mut product = samples::with_objects();
        product.coarser = vec![product.modules.clone()];
        let heights = |uri: &str, product: &Product| -> Vec<String> {
            let files = written(product);
            let meshes = crate::tests::meshes(&files[uri]);
            let mut found: Vec<String> = meshes.into_iter().map(|mesh| mesh.material).collect();
            found.dedup();
            found.retain(|material| !material.starts_with("class"));
            found
        };
        let (level, group) = ("levels/1/r00c00.glb", "groups/r0000c0000_r0000c0001.glb");
        let all = heights(group, &product);
        assert_eq!(heights(level, &product), all, "all are higher than 300 quanta");
        // The chimney is 7100 quanta high, the wood 1920 and the house 1400.
        let with_error = |largest: u32| {
            let mut product = product.clone();
            product.coarser[0].iter_mut().for_each(|module| module.residual.largest = largest);
            product
        };
        assert_eq!(heights(level, &with_error(1399)), all);
        assert_eq!(heights(level, &with_error(1400)), ["tower_roof", "tower_wall", "wood_top", "wood_side"]);
        assert_eq!(heights(level, &with_error(7099)), ["tower_roof", "tower_wall", "wood_top", "wood_side"]);
        assert_eq!(heights(level, &with_error(7100)), ["wood_top", "wood_side"]);
        assert_eq!(heights(group, &with_error(7100)), all);
        // A road of 896 quanta and a stream of 256.
        let mut product = samples::with_ways();
        product.coarser = vec![product.modules.clone()];
        let nodes = |largest: u32| {
            product.coarser[0].iter_mut().for_each(|module| module.residual.largest = largest);
            crate::tests::meshes(&written(&product)[level])
                .into_iter()
                .filter(|mesh| mesh.node.starts_with("ribbons"))
                .count()
        };
        assert_eq!([895, 896].map(nodes), [2, 0]);
    }
}
