//! 3D Tiles 1.1: the area, in it a coarse mesh for each 4 km square, in these the load modules, each in binary glTF.
//!
//! Where load modules have coarser levels, those of a square are a mesh between the two, level by level.
//! Every square has a frame of its own, so that 32-bit floats are fine to a fraction of a millimetre. A geometric error
//! is measured: of a square, how far its load modules lie from it; of a level in it and of a load module, the largest
//! residual.

use serde_json::{Value, json};
use terrain::{ModuleRect, QUANTA_PER_METRE};

use crate::coarse::Coarse;
use crate::earth::Earth;
use crate::glb::{Gltf, turned};
use crate::globe::{Globe, LocalFrame};
use crate::mesh::{Mesh, Part};
use crate::modules::file_name;
use crate::openflight::{square_name, square_side};
use crate::{Datum, ExportError, Product, Put, Work};

/// Writes `tileset.json`, `squares/*.glb`, `modules/*.glb` and, for coarser levels, `levels/K/*.glb`. `assumed` is what
/// to take heights to be above; else the database says it. Gives what was done to heights.
///
/// # Errors
/// When a file cannot be written, heights cannot be brought above the ellipsoid, or the work was asked to stop.
pub fn write_3dtiles(product: &Product, assumed: Option<Datum>, put: &Put, work: &Work) -> Result<Datum, ExportError> {
    let earth = Earth::new(product, assumed)?;
    let layer = |product: Product| {
        let mesh = Mesh::of(&product);
        let globe = Globe::of(&product, &mesh, &earth, work)?;
        Ok(Layer { product, mesh, globe })
    };
    let scene = Scene { layers: product.levels().map(layer).collect::<Result<_, ExportError>>()? };
    let squares = product.squares(square_side(product));
    let children = work.each("squares", &squares, |&rect| scene.square(rect, put))?;
    let heights = || scene.layers.iter().flat_map(|layer| layer.globe.height_m.iter().copied());
    let (low, high) = (heights().fold(f64::INFINITY, f64::min), heights().fold(f64::NEG_INFINITY, f64::max));
    // Without any tile the ground is as good as flat.
    let flat_m = high - low;
    let tileset = json!({
        "asset": {
            "version": "1.1",
            "tilesetVersion": "1",
            "extras": {
                "generator": "tiefort", "area": product.manifest.area.name, "crs": product.crs(),
                "vertical_datum": product.vertical_datum(), "heights": earth.datum().said(),
                "attribution": product.attributions(),
            },
        },
        "geometricError": flat_m,
        "root": {
            "boundingVolume": { "region": region(&scene.layers[0].globe.lon_lat, low, high) },
            "geometricError": flat_m,
            "refine": "REPLACE",
            "children": children,
        },
    });
    put("tileset.json", tileset.to_string().as_bytes()).map_err(ExportError::write("tileset.json"))?;
    Ok(earth.datum())
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
struct Scene {
    layers: Vec<Layer>,
}

impl Scene {
    /// Writes the files of a square; its tile.
    fn square(&self, rect: ModuleRect, put: &Put) -> Result<Value, ExportError> {
        let finest = &self.layers[0];
        let coarse = Coarse::of(&finest.product, &finest.mesh, rect);
        let middle = coarse.vertices[coarse.vertices.len() / 2] as usize;
        let frame = LocalFrame::at(finest.globe.lon_lat[middle], finest.globe.height_m[middle]);
        let parts: Vec<Part> = self.layers.iter().map(|layer| layer.mesh.part(&layer.product, rect)).collect();
        let bounds = box_around(self.layers.iter().zip(&parts).flat_map(|(layer, part)| layer.places(&frame, part)));
        let name = format!("squares/{}", square_name(&finest.product, rect, "glb"));
        let classes = vec![0; coarse.triangles.len()];
        let gltf = finest.gltf(&frame, &coarse.vertices).with_groups(&coarse.triangles, &classes);
        put(&name, &gltf.bytes()).map_err(ExportError::write(&name))?;
        let mut children = finest.modules(&frame, &parts[0], put)?;
        let mut error_m = finest.error_m(rect);
        for (layer, part) in self.layers.iter().zip(&parts).skip(1) {
            let name = format!("levels/{}/{}", layer.product.level, square_name(&layer.product, rect, "glb"));
            let gltf = layer.gltf(&frame, &part.vertices).with_groups(&part.triangles, &part.classes);
            put(&name, &gltf.bytes()).map_err(ExportError::write(&name))?;
            // What is coarser is never said to be truer, or a viewer would not go on to the finer.
            error_m = error_m.max(layer.error_m(rect));
            children = vec![json!({
                "boundingVolume": { "box": bounds },
                "geometricError": error_m,
                "content": { "uri": name },
                "children": children,
            })];
        }
        Ok(json!({
            "transform": frame.matrix(),
            "boundingVolume": { "box": bounds },
            "geometricError": if self.layers.len() == 1 { coarse.error_m } else { coarse.error_m.max(error_m) },
            "content": { "uri": name },
            "children": children,
        }))
    }
}

impl Layer {
    /// Writes a file for each load module of a part; their tiles.
    fn modules(&self, frame: &LocalFrame, part: &Part, put: &Put) -> Result<Vec<Value>, ExportError> {
        let mut tiles = Vec::with_capacity(part.modules.len());
        for (id, triangles) in &part.modules {
            let mut vertices: Vec<u32> = Vec::new();
            let mut place_of = vec![u32::MAX; part.vertices.len()];
            let own: Vec<[u32; 3]> = part.triangles[triangles.clone()]
                .iter()
                .map(|triangle| {
                    triangle.map(|v| {
                        let place = &mut place_of[v as usize];
                        if *place == u32::MAX {
                            *place = vertices.len() as u32;
                            vertices.push(part.vertices[v as usize]);
                        }
                        *place
                    })
                })
                .collect();
            let name = format!("modules/{}", file_name(*id, "glb"));
            let gltf = self.gltf(frame, &vertices).with_groups(&own, &part.classes[triangles.clone()]);
            put(&name, &gltf.bytes()).map_err(ExportError::write(&name))?;
            let residual = self.product.module(*id).map_or(0, |module| module.residual.largest);
            let places = vertices.iter().map(|&v| frame.local(self.globe.place[v as usize]));
            tiles.push(json!({
                "boundingVolume": { "box": box_around(places) },
                "geometricError": f64::from(residual) / f64::from(QUANTA_PER_METRE),
                "content": { "uri": name },
            }));
        }
        Ok(tiles)
    }

    /// The largest residual of the load modules of a rectangle, in metres.
    fn error_m(&self, rect: ModuleRect) -> f64 {
        let residuals = rect.iter().filter_map(|id| self.product.module(id)).map(|module| module.residual.largest);
        f64::from(residuals.max().unwrap_or(0)) / f64::from(QUANTA_PER_METRE)
    }

    /// Where the vertices of a part lie in a frame.
    fn places(&self, frame: &LocalFrame, part: &Part) -> impl Iterator<Item = [f64; 3]> {
        part.vertices.iter().map(|&v| frame.local(self.globe.place[v as usize]))
    }

    /// Vertices of the mesh in a frame.
    fn gltf(&self, frame: &LocalFrame, vertices: &[u32]) -> Gltf {
        let place = |&v: &u32| turned(frame.local(self.globe.place[v as usize]));
        let normal = |&v: &u32| turned(frame.turned(self.globe.normal[v as usize]));
        Gltf {
            positions: vertices.iter().map(place).collect(),
            normals: vertices.iter().map(normal).collect(),
            ..Gltf::default()
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
    use std::sync::Mutex;
    use std::sync::atomic::AtomicBool;

    use schedule::Workers;

    use super::*;
    use crate::samples;

    /// The files of a tileset.
    fn written(product: &Product) -> BTreeMap<String, Vec<u8>> {
        let files = Mutex::new(BTreeMap::new());
        let put = |name: &str, bytes: &[u8]| {
            files.lock().unwrap().insert(name.to_owned(), bytes.to_vec());
            Ok(())
        };
        let (workers, stop) = (Workers::new(2), AtomicBool::new(false));
        let work = Work { workers: &workers, stop: &stop, tell: &|_| {} };
        assert_eq!(write_3dtiles(product, None, &put, &work).unwrap(), Datum::Egm96);
        files.into_inner().unwrap()
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
        assert_eq!(modules.len(), 2);
        for tile in modules.iter().chain([square]) {
            assert!(files.contains_key(tile["content"]["uri"].as_str().unwrap()), "{tile}");
        }
        assert_eq!(files.len(), 1 + 1 + 2);
        assert!(modules.iter().all(|module| error(module) < error(square)));
        let region = tileset["root"]["boundingVolume"]["region"].as_array().unwrap();
        // Heights above EGM96, whose surface lies some 30 m below the ellipsoid here.
        assert!((960.0..965.0).contains(&region[4].as_f64().unwrap()), "{region:?}");
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
        assert_eq!((modules.len(), files.len()), (2, plain.len() + 1));
        for (name, bytes) in plain.iter().filter(|(name, _)| name.as_str() != "tileset.json") {
            assert!(files[name] == *bytes, "{name}");
        }
    }
}
