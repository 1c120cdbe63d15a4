//! OpenUSD as text: one file for each tile, which the file of the area names as payloads, z up, in metres.
//!
//! Points of a tile are counted from its own south-west corner and are whole 1/128 m, which a 32-bit float holds
//! exactly; the area's file moves each tile to its place. Ground, decks and objects are meshes of triangles, all but
//! ribbons and woods with a collision schema; classes are subsets of faces with materials. Triangles over holes are
//! left out. Where load modules have coarser levels, a tile has a variant for each, with a file of its own.

use std::fmt::Write as _;

use terrain::{ModuleRect, TileId, metres_of_quanta};

use crate::detail::{Detail, Step, steps};
use crate::mesh::Part;
use crate::objects::Thing;
use crate::sheets::Material;
use crate::{Coordinates, ExportError, Facts, Mesh, Product, Put, Sheet, Texture, Work};

/// Writes `area.usda` and a file for each tile in the folder `tiles`.
///
/// # Errors
/// When a file cannot be written, or the work was asked to stop.
pub fn write_usd(product: &Product, put: &Put, work: &Work) -> Result<(), ExportError> {
    let details = Detail::all(product, Mesh::of(product));
    let tiles = tiles(product);
    work.each("tiles", &tiles, |tile| {
        let texture = product.texture(tile.rect, 0.0)?;
        for detail in &details {
            let name = tile.file(detail.product.level, product);
            let text = tile_text(detail, tile, texture.as_ref());
            put(&name, text.as_bytes())?;
        }
        let Some(texture) = texture else { return Ok(()) };
        put(&format!("tiles/{}.{}", tile.name, product.texture_extension()), &texture.bytes)
    })?;
    let levels = details.iter().map(|detail| &detail.product).collect::<Vec<_>>();
    put("area.usda", area_text(&levels, &tiles).as_bytes())
}

/// The part of a tile that is exported.
struct Tile {
    name: String,
    rect: ModuleRect,
}

impl Tile {
    /// The name of its file at a level of a product.
    fn file(&self, level: usize, product: &Product) -> String {
        let coarser = if level == product.level { String::new() } else { format!("_lod{level}") };
        format!("tiles/{}{coarser}.usda", self.name)
    }
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

fn area_text(levels: &[&Product], tiles: &[Tile]) -> String {
    let product = levels[0];
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
        put_tile(&mut text, levels, tile);
    }
    text.push_str("}\n");
    text
}

/// A tile at its place: its file, or a variant for each of its levels, the finest of which is chosen.
fn put_tile(text: &mut String, levels: &[&Product], tile: &Tile) {
    let product = levels[0];
    let (name, [x, y]) = (&tile.name, corner(product, tile).map(metres_of_quanta));
    let payload = |level: usize| format!("prepend payload = @./{}@", tile.file(level, product));
    let _ = writeln!(text, "    def Xform \"{name}\" (\n        kind = \"component\"");
    let _ = match levels {
        [_] => writeln!(text, "        {}", payload(product.level)),
        _ => writeln!(
            text,
            "        variants = {{\n            string lod = \"lod{}\"\n        }}\n        \
             prepend variantSets = \"lod\"",
            product.level
        ),
    };
    let _ = write!(
        text,
        "    )\n    {{\n        double3 xformOp:translate = ({x}, {y}, 0)\n        \
         uniform token[] xformOpOrder = [\"xformOp:translate\"]\n"
    );
    if 1 < levels.len() {
        text.push_str("        variantSet \"lod\" = {\n");
        for Step { level, error_m, near_m } in steps(levels.iter().copied(), tile.rect) {
            let _ = write!(
                text,
                "            \"lod{level}\" (\n                {}\n            ) {{\n                \
                 custom double lod:error_m = {error_m}\n                \
                 custom double lod:near_m = {near_m}\n            }}\n",
                payload(level)
            );
        }
        text.push_str("        }\n");
    }
    text.push_str("    }\n");
}

/// East and north in quanta from the south-west corner of what is exported to that of a tile.
fn corner(product: &Product, tile: &Tile) -> [i32; 2] {
    product.corner(terrain::ModuleId { row: tile.rect.south, col: tile.rect.west })
}

fn tile_text(detail: &Detail, tile: &Tile, texture: Option<&Texture>) -> String {
    let Detail { product, mesh, normals } = detail;
    let parts = mesh.parts(product, tile.rect);
    let of_part = |(sheet, part): &(Sheet, Part)| {
        let sheet = *sheet;
        part.classes.iter().map(move |&class| Material { sheet, class }.in_library()).collect::<Vec<_>>()
    };
    let mut materials: Vec<Material> = parts.iter().flat_map(of_part).collect();
    materials.sort_unstable();
    materials.dedup();
    let root = &tile.name;
    let mut text = format!("#usda 1.0\n(\n    defaultPrim = \"{root}\"\n{HEAD})\n\ndef Xform \"{root}\"\n{{\n");
    text.push_str("    def Scope \"Materials\"\n    {\n");
    for &material in &materials {
        let photo = texture
            .filter(|_| material.sheet != Sheet::Objects)
            .map(|_| format!("{root}.{}", product.texture_extension()));
        put_material(&mut text, product, root, material, photo.as_deref());
    }
    text.push_str("    }\n");
    let corner = corner(product, tile);
    for (sheet, part) in &parts {
        let draw = |text: &mut String, thing: Option<Thing>, part: &Part| {
            let sheet = *sheet;
            put_mesh(text, &Drawn { product, mesh, normals, texture, corner, root, sheet, thing, part });
        };
        if *sheet != Sheet::Objects {
            draw(&mut text, None, part);
            continue;
        }
        text.push_str("\n    def Scope \"objects\"\n    {\n");
        part.by_thing().iter().for_each(|(thing, part)| draw(&mut text, Some(*thing), part));
        text.push_str("    }\n");
    }
    text.push_str("}\n");
    text
}

/// A material, seen with the texture `photo` where there is one.
fn put_material(text: &mut String, product: &Product, root: &str, material: Material, photo: Option<&str>) {
    let (name, [red, green, blue]) = (material_name(product, material), material.light(product.classes()));
    let color = match photo {
        Some(_) => format!("inputs:diffuseColor.connect = </{root}/Materials/{name}/Photo.outputs:rgb>"),
        None => format!("inputs:diffuseColor = ({red}, {green}, {blue})"),
    };
    let _ = write!(
        text,
        "        def Material \"{name}\"\n        {{\n            \
         token outputs:surface.connect = </{root}/Materials/{name}/Surface.outputs:surface>\n\n            \
         def Shader \"Surface\"\n            {{\n                \
         uniform token info:id = \"UsdPreviewSurface\"\n                \
         color3f {color}\n                \
         float inputs:metallic = 0\n                float inputs:roughness = 1\n                \
         token outputs:surface\n            }}\n"
    );
    if let Some(photo) = photo {
        let _ = write!(
            text,
            "\n            def Shader \"Photo\"\n            {{\n                \
             uniform token info:id = \"UsdUVTexture\"\n                \
             asset inputs:file = @./{photo}@\n                \
             float2 inputs:st.connect = </{root}/Materials/{name}/Places.outputs:result>\n                \
             token inputs:wrapS = \"clamp\"\n                token inputs:wrapT = \"clamp\"\n                \
             token inputs:sourceColorSpace = \"sRGB\"\n                \
             float3 outputs:rgb\n            }}\n\n            \
             def Shader \"Places\"\n            {{\n                \
             uniform token info:id = \"UsdPrimvarReader_float2\"\n                \
             string inputs:varname = \"st\"\n                float2 outputs:result\n            }}\n"
        );
    }
    text.push_str("        }\n");
}

/// A mesh of a tile.
struct Drawn<'a> {
    product: &'a Product,
    mesh: &'a Mesh,
    normals: &'a [[f64; 3]],
    texture: Option<&'a Texture>,
    corner: [i32; 2],
    root: &'a str,
    sheet: Sheet,
    /// Which object it is, where it is one.
    thing: Option<Thing>,
    part: &'a Part,
}

/// What is said of a list with an item for each vertex.
const VERTEX: &str = " (\n            interpolation = \"vertex\"\n        )\n";
/// What a mesh says of itself that bodies hit.
const COLLIDES: &str = " (\n        prepend apiSchemas = [\"PhysicsCollisionAPI\", \"PhysicsMeshCollisionAPI\"]\n    )";

fn put_mesh(text: &mut String, drawn: &Drawn) {
    let Drawn { mesh, normals, texture, corner: [west, south], sheet, thing, part, .. } = drawn;
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
    let name = thing.map_or_else(|| sheet.name().to_owned(), |thing| thing.name());
    let collides = *sheet != Sheet::Ribbons && thing.is_none_or(|thing| thing.kind.is_prism());
    let _ = writeln!(text, "\n    def Mesh \"{name}\"{}\n    {{", if collides { COLLIDES } else { "" });
    if let Some(thing) = thing {
        let (id, class, height) = (thing.id, thing.kind.name(), metres_of_quanta(thing.height));
        let _ = writeln!(
            text,
            "        custom uint64 object:id = {id}\n        custom string object:class = \"{class}\"\n        \
             custom double object:height_m = {height}"
        );
    }
    let _ = writeln!(text, "        uniform bool doubleSided = {}", u8::from(sheet.is_seen_from_below()));
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
    text.push_str(VERTEX);
    if let Some(texture) = texture.filter(|_| *sheet != Sheet::Objects) {
        // From the southern side.
        let places = mesh.uvs(texture, &part.vertices).into_iter().map(|[u, v]| format!("({u}, {})", 1.0 - v));
        put_list(text, "texCoord2f[] primvars:st", places);
        text.pop();
        text.push_str(VERTEX);
    }
    if !part.lanes.is_empty() {
        put_list(text, "texCoord2f[] primvars:lane", part.lanes.iter().map(|[u, v]| format!("({u}, {v})")));
        text.pop();
        text.push_str(VERTEX);
    }
    if collides {
        text.push_str(
            "        bool physics:collisionEnabled = 1\n        uniform token physics:approximation = \"none\"\n",
        );
    }
    put_list(text, "point3f[] points", places.iter().map(|place| point(*place)));
    text.push_str("        uniform token subdivisionScheme = \"none\"\n");
    text.push_str("        uniform token subsetFamily:materialBind:familyType = \"partition\"\n");
    put_subsets(text, drawn);
    text.push_str("    }\n");
}

/// The faces of each material.
fn put_subsets(text: &mut String, Drawn { product, root, sheet, part, .. }: &Drawn) {
    let mut classes = part.classes.clone();
    classes.sort_unstable();
    classes.dedup();
    for class in classes {
        let subset = material_name(product, Material { sheet: *sheet, class }.in_library());
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
fn point([x, y, z]: [i32; 3]) -> String {
    format!("({}, {}, {})", metres_of_quanta(x), metres_of_quanta(y), metres_of_quanta(z))
}

/// The name of a material where names are identifiers: each has another.
fn material_name(product: &Product, material: Material) -> String {
    let classes = product.classes();
    let name = |material: Material| identifier(&material.word(classes), "class");
    let own = name(material);
    if material.sheet == Sheet::Objects {
        return format!("object_{own}");
    }
    // Two names may differ in what no identifier can hold.
    let is_own = |class: &usize| name(Material { class: *class as u8, ..material }) == own;
    let is_alone = (0..product.class_names.len().min(256)).filter(is_own).count() <= 1;
    if is_alone { own } else { format!("{own}_{}", material.class) }
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

    use super::*;
    use crate::samples;

    fn files(product: &Product) -> BTreeMap<String, String> {
        samples::texts(|put, work| write_usd(product, put, work))
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
        assert_eq!(
            [0, 1, 2].map(|class| material_name(&product, Material { sheet: Sheet::Ground, class })),
            ["a_b_0", "a_b_1", "c"]
        );
        assert_eq!(quoted("a \"b\" \\ \n"), "\"a \\\"b\\\" \\\\  \"");
    }
}
