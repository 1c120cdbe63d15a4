//! OpenUSD as text: one file for each tile, which the file of the area names as payloads, z up, in metres.
//!
//! Points of a tile are counted from its own south-west corner and are whole 1/128 m, which a 32-bit float holds
//! exactly; the area's file moves each tile to its place. Ground and decks are meshes of triangles with a collision
//! schema; classes are subsets of faces with materials. Triangles over holes are left out.

use std::fmt::Write as _;

use terrain::{ModuleRect, QUANTA_PER_METRE, TileId};

use crate::mesh::Part;
use crate::{Coordinates, ExportError, Facts, Mesh, Product, Put, Work};

/// Writes `area.usda` and a file for each tile in the folder `tiles`.
///
/// # Errors
/// When a file cannot be written, or the work was asked to stop.
pub fn write_usd(product: &Product, put: &Put, work: &Work) -> Result<(), ExportError> {
    let mesh = Mesh::of(product);
    let normals = mesh.normals();
    let tiles = tiles(product);
    work.each("tiles", &tiles, |tile| {
        let text = tile_text(product, &mesh, &normals, tile);
        let name = format!("tiles/{}.usda", tile.name);
        put(&name, text.as_bytes()).map_err(ExportError::write(&name))
    })?;
    put("area.usda", area_text(product, &tiles).as_bytes()).map_err(ExportError::write("area.usda"))
}

/// The part of a tile that is exported.
struct Tile {
    name: String,
    rect: ModuleRect,
}

/// The tiles of a product that have load modules in it, row by row from the south-west.
fn tiles(product: &Product) -> Vec<Tile> {
    let all = product.rect;
    let mut tiles: Vec<(TileId, ModuleRect)> = product
        .tiles
        .iter()
        .map(|tile| {
            let of = tile.modules;
            let rect = ModuleRect {
                south: of.south.max(all.south),
                west: of.west.max(all.west),
                north: of.north.min(all.north),
                east: of.east.min(all.east),
            };
            (tile.tile, rect)
        })
        .filter(|(_, rect)| rect.south < rect.north && rect.west < rect.east)
        .collect();
    tiles.sort_by_key(|(tile, _)| (tile.row, tile.col));
    tiles
        .into_iter()
        .map(|(tile, rect)| Tile { name: format!("tile_r{:02}c{:02}", tile.row, tile.col), rect })
        .collect()
}

const HEAD: &str = "    metersPerUnit = 1\n    upAxis = \"Z\"\n";

fn area_text(product: &Product, tiles: &[Tile]) -> String {
    let root = identifier(&product.manifest.area.name, "area");
    let facts = Facts::z_up(product, Coordinates::Local);
    let [east, north, up] = facts.offset_m;
    let mut text = format!("#usda 1.0\n(\n    defaultPrim = \"{root}\"\n{HEAD}    customLayerData = {{\n");
    let datum = product.vertical_datum();
    for (key, value) in [("generator", "tiefort"), ("crs", product.crs()), ("vertical_datum", datum)] {
        let _ = writeln!(text, "        string {key} = {}", quoted(value));
    }
    let _ = writeln!(text, "        string attribution = {}", quoted(&product.attributions().join("; ")));
    let _ = writeln!(text, "        string axes = {}", quoted(facts.axes));
    let _ = writeln!(text, "        double3 offset_m = ({east}, {north}, {up})\n    }}\n)\n");
    let _ = writeln!(text, "def Xform \"{root}\" (\n    kind = \"assembly\"\n)\n{{");
    for tile in tiles {
        let [x, y] = corner(product, tile).map(metres);
        let _ = write!(
            text,
            "    def Xform \"{name}\" (\n        kind = \"component\"\n        \
             prepend payload = @./tiles/{name}.usda@\n    )\n    \
             {{\n        double3 xformOp:translate = ({x}, {y}, 0)\n        \
             uniform token[] xformOpOrder = [\"xformOp:translate\"]\n    }}\n",
            name = tile.name
        );
    }
    text.push_str("}\n");
    text
}

/// East and north in quanta from the south-west corner of what is exported to that of a tile.
fn corner(product: &Product, tile: &Tile) -> [i32; 2] {
    product.corner(terrain::ModuleId { row: tile.rect.south, col: tile.rect.west })
}

fn tile_text(product: &Product, mesh: &Mesh, normals: &[[f64; 3]], tile: &Tile) -> String {
    let parts = [("ground", mesh.part(product, tile.rect)), ("decks", mesh.deck_part(product, tile.rect))];
    let mut classes: Vec<u8> = parts.iter().flat_map(|(_, part)| &part.classes).copied().collect();
    classes.sort_unstable();
    classes.dedup();
    let root = &tile.name;
    let mut text = format!("#usda 1.0\n(\n    defaultPrim = \"{root}\"\n{HEAD})\n\ndef Xform \"{root}\"\n{{\n");
    text.push_str("    def Scope \"Materials\"\n    {\n");
    for &class in &classes {
        put_material(&mut text, product, root, class);
    }
    text.push_str("    }\n");
    let corner = corner(product, tile);
    for (name, part) in parts.iter().filter(|(_, part)| !part.triangles.is_empty()) {
        put_mesh(&mut text, &Drawn { product, mesh, normals, corner, root, name, part });
    }
    text.push_str("}\n");
    text
}

fn put_material(text: &mut String, product: &Product, root: &str, class: u8) {
    let (name, [red, green, blue]) = (class_name(product, class), product.classes().light(class));
    let _ = write!(
        text,
        "        def Material \"{name}\"\n        {{\n            \
         token outputs:surface.connect = </{root}/Materials/{name}/Surface.outputs:surface>\n\n            \
         def Shader \"Surface\"\n            {{\n                \
         uniform token info:id = \"UsdPreviewSurface\"\n                \
         color3f inputs:diffuseColor = ({red}, {green}, {blue})\n                \
         float inputs:metallic = 0\n                float inputs:roughness = 1\n                \
         token outputs:surface\n            }}\n        }}\n"
    );
}

/// A mesh of a tile.
struct Drawn<'a> {
    product: &'a Product,
    mesh: &'a Mesh,
    normals: &'a [[f64; 3]],
    corner: [i32; 2],
    root: &'a str,
    name: &'a str,
    part: &'a Part,
}

fn put_mesh(text: &mut String, drawn: &Drawn) {
    let Drawn { product, mesh, normals, corner: [west, south], root, name, part } = drawn;
    let places: Vec<[i32; 3]> = part
        .vertices
        .iter()
        .map(|&vertex| {
            let [x, y, z] = mesh.vertices[vertex as usize];
            [x - west, y - south, z]
        })
        .collect();
    let bound = |pick: fn(i32, i32) -> i32| {
        let picked = places.iter().copied().reduce(|a, b| [0, 1, 2].map(|axis| pick(a[axis], b[axis])));
        point(picked.unwrap_or_default())
    };
    let _ = writeln!(
        text,
        "\n    def Mesh \"{name}\" (\n        \
         prepend apiSchemas = [\"PhysicsCollisionAPI\", \"PhysicsMeshCollisionAPI\"]\n    )\n    {{"
    );
    // A deck has no thickness, and is seen from below too.
    let _ = writeln!(text, "        uniform bool doubleSided = {}", u8::from(*name == "decks"));
    let _ = writeln!(text, "        float3[] extent = [{}, {}]", bound(i32::min), bound(i32::max));
    put_list(text, "int[] faceVertexCounts", part.triangles.iter().map(|_| "3"));
    put_list(text, "int[] faceVertexIndices", part.triangles.as_flattened());
    let of_vertices = part.vertices.iter().map(|&vertex| {
        let [x, y, z] = normals[vertex as usize].map(|part| part as f32);
        format!("({x}, {y}, {z})")
    });
    put_list(text, "normal3f[] normals", of_vertices);
    // The list ends its line; what is said of it follows in brackets.
    text.pop();
    text.push_str(" (\n            interpolation = \"vertex\"\n        )\n");
    text.push_str(
        "        bool physics:collisionEnabled = 1\n        uniform token physics:approximation = \"none\"\n",
    );
    put_list(text, "point3f[] points", places.iter().map(|place| point(*place)));
    text.push_str("        uniform token subdivisionScheme = \"none\"\n");
    text.push_str("        uniform token subsetFamily:materialBind:familyType = \"partition\"\n");
    let mut classes = part.classes.clone();
    classes.sort_unstable();
    classes.dedup();
    for class in classes {
        let subset = class_name(product, class);
        let _ = writeln!(
            text,
            "\n        def GeomSubset \"{subset}\" (\n            \
             prepend apiSchemas = [\"MaterialBindingAPI\"]\n        )\n        \
             {{\n            uniform token elementType = \"face\"\n            \
             uniform token familyName = \"materialBind\""
        );
        text.push_str("    ");
        let faces = part.classes.iter().enumerate().filter(|(_, of)| **of == class).map(|(face, _)| face);
        put_list(text, "int[] indices", faces);
        let _ = writeln!(text, "            rel material:binding = </{root}/Materials/{subset}>\n        }}");
    }
    text.push_str("    }\n");
}

/// A list as one line.
fn put_list<T: std::fmt::Display>(text: &mut String, what: &str, items: impl IntoIterator<Item = T>) {
    let _ = write!(text, "        {what} = [");
    for (number, item) in items.into_iter().enumerate() {
        let _ = write!(text, "{}{item}", if number == 0 { "" } else { ", " });
    }
    text.push_str("]\n");
}

/// Whole 1/128 m, as decimals without an end cut off.
fn metres(quanta: i32) -> f64 {
    f64::from(quanta) / f64::from(QUANTA_PER_METRE)
}

fn point([x, y, z]: [i32; 3]) -> String {
    format!("({}, {}, {})", metres(x), metres(y), metres(z))
}

/// The name of a class where names are identifiers: each class has another.
fn class_name(product: &Product, class: u8) -> String {
    let classes = product.classes();
    let name = |class: u8| identifier(&classes.word(class), "class");
    let own = name(class);
    // Two names may differ in what no identifier can hold.
    let is_alone = (0..product.class_names.len().min(256)).filter(|of| name(*of as u8) == own).count() <= 1;
    if is_alone { own } else { format!("{own}_{class}") }
}

/// A text as the name of a prim: ASCII letters, digits and underscores, no digit first.
fn identifier(text: &str, otherwise: &str) -> String {
    let letter = |c: char| if c.is_ascii_alphanumeric() { c } else { '_' };
    let text: String = text.chars().map(letter).collect();
    match text.chars().next() {
        None => otherwise.into(),
        Some(first) if first.is_ascii_digit() => format!("_{text}"),
        Some(_) => text,
    }
}

/// A string as USD writes it, on one line.
fn quoted(text: &str) -> String {
    let plain = text.chars().map(|c| if c.is_control() { ' ' } else { c });
    let escaped: String =
        plain.flat_map(|c| (matches!(c, '"' | '\\')).then_some('\\').into_iter().chain([c])).collect();
    format!("\"{escaped}\"")
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;
    use std::sync::Mutex;
    use std::sync::atomic::AtomicBool;

    use schedule::Workers;

    use super::*;
    use crate::samples;

    fn files(product: &Product) -> BTreeMap<String, String> {
        let files = Mutex::new(BTreeMap::new());
        let put = |name: &str, bytes: &[u8]| {
            files.lock().unwrap().insert(name.to_owned(), String::from_utf8(bytes.to_vec()).unwrap());
            Ok(())
        };
        let (workers, stop) = (Workers::new(2), AtomicBool::new(false));
        write_usd(product, &put, &Work { workers: &workers, stop: &stop, tell: &|_| {} }).unwrap();
        files.into_inner().unwrap()
    }

    #[test]
    fn the_area_names_its_tiles_and_a_tile_its_points_to_the_last_digit() {
        let files = files(&samples::product());
        let area = &files["area.usda"];
        for part in
            ["upAxis = \"Z\"", "@./tiles/tile_r00c00.usda@", "string crs = \"EPSG:32611\"", "505000, 3875000, 0"]
        {
            assert!(area.contains(part), "{part} is not in {area}");
        }
        let tile = &files["tiles/tile_r00c00.usda"];
        assert!(tile.contains("float3[] extent = [(0, 0, 992.1875), (1000, 500, 1004)]"), "{tile}");
        let faces = tile.split("faceVertexIndices = [").nth(1).unwrap().split(']').next().unwrap();
        assert_eq!(faces.split(',').count(), 18);
        assert_eq!((tile.matches("def GeomSubset").count(), tile.matches("def Material ").count()), (2, 2));
    }

    #[test]
    fn decks_are_a_mesh_that_is_seen_from_both_sides() {
        let files = files(&samples::with_bridge());
        let tile = &files["tiles/tile_r00c00.usda"];
        let decks = &tile[tile.find("def Mesh \"decks\"").unwrap()..];
        assert!(decks.contains("doubleSided = 1") && decks.contains("Materials/motorway>"), "{decks}");
    }

    #[test]
    fn names_that_no_prim_can_have_are_changed_and_stay_apart() {
        assert_eq!(["a b", "7th", "", "é"].map(|text| identifier(text, "area")), ["a_b", "_7th", "area", "_"]);
        let mut product = samples::product();
        product.class_names = ["a b", "a_b", "c"].map(str::to_owned).to_vec();
        assert_eq!([0, 1, 2].map(|class| class_name(&product, class)), ["a_b_0", "a_b_1", "c"]);
        assert_eq!(quoted("a \"b\" \\ \n"), "\"a \\\"b\\\" \\\\  \"");
    }
}
