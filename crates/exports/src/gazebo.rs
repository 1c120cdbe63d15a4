//! A world for Gazebo (SDF 1.9): a model for each block of load modules, its mesh an OBJ beside it, and levels that
//! load the blocks near a performer.
//!
//! Ribbons are seen alone. Objects are seen as meshes, and hit as boxes: one for each building that is nearly a
//! rectangle, else one for each of its walls; woods are seen alone. x points east, y north, z up; the origin is the
//! south-west corner of what is exported, at height 0.

use std::fmt::Write as _;

use terrain::{ModuleId, ModuleRect, QUANTA_PER_METRE, metres_of_quanta};

use crate::boxes::{UprightBox, boxes};
use crate::earth::{directions, earth_centred};
use crate::gpkg_styles::escaped;
use crate::mesh::{Part, class_groups, dot, minus};
use crate::modules::group_name;
use crate::polygon_files::{put_obj_faces, put_obj_places, put_obj_vertices};
use crate::sheets::Material;
use crate::{Datum, Earth, ExportError, Mesh, Product, Put, Sheet, Texture, Work, obj_materials};

/// Load modules along the side of a block, as many as a level pages at once.
const BLOCK_MODULES: u32 = 4;
/// How far from a performer a block is loaded, in sides of a block.
const BUFFER_BLOCKS: f64 = 2.0;
/// Metres of height that a level's box spans: all that can fly over the Earth's ground.
const LEVEL_HIGH_M: f64 = 60_000.0;
/// The side of the box that stands for the vehicle in the world, in metres, and how far above the ground it begins.
const OBSERVER_M: f64 = 2.0;

/// Writes `area.sdf`, and `meshes/*.obj` with their materials.
///
/// # Errors
/// When a file cannot be written, the area's system cannot be computed, or the work was asked to stop.
pub fn write_gazebo(product: &Product, put: &Put, work: &Work) -> Result<(), ExportError> {
    let mesh = Mesh::of(product);
    // With orthophotos each block has a library of its own, since each has another.
    let materials = if product.textures.is_some() { None } else { obj_materials(product, &mesh, None) };
    let squares = product.squares(BLOCK_MODULES);
    let blocks = work.each("blocks", &squares, |&rect| {
        let (seen, solid): (Vec<_>, Vec<_>) = mesh
            .parts(product, rect)
            .into_iter()
            .partition(|(sheet, _)| matches!(sheet, Sheet::Ribbons | Sheet::Objects));
        let block = Block { rect, is_solid: !solid.is_empty(), is_seen: !seen.is_empty() };
        let (name, texture) = (group_name(rect), product.texture(rect, 0.0)?);
        let library = texture.as_ref().map(|_| format!("{name}.mtl"));
        let library = library.or_else(|| materials.as_ref().map(|_| "classes.mtl".to_owned()));
        for (name, parts) in [(block.solid_name(), &solid), (block.seen_name(), &seen)] {
            if !parts.is_empty() {
                let text = block_text(product, &mesh, (rect, texture.as_ref()), parts, library.as_deref());
                put(&name, text.as_bytes())?;
            }
        }
        if let Some(texture) = texture.filter(|_| block.is_solid || block.is_seen) {
            let photo = format!("{name}.{}", product.texture_extension());
            let text = obj_materials(product, &mesh, Some(&photo)).unwrap_or_default();
            put(&format!("meshes/{name}.mtl"), text.as_bytes())?;
            put(&format!("meshes/{photo}"), &texture.bytes)?;
        }
        Ok(Some(block).filter(|block| block.is_solid || block.is_seen))
    })?;
    if let Some(text) = materials {
        put("meshes/classes.mtl", text.as_bytes())?;
    }
    let blocks: Vec<Block> = blocks.into_iter().flatten().collect();
    let text = world(product, &mesh, &blocks)?;
    put("area.sdf", text.as_bytes())
}

/// A block of load modules, and which meshes it has: one that bodies hit, and one that is seen alone.
#[derive(Clone, Copy)]
struct Block {
    rect: ModuleRect,
    is_solid: bool,
    is_seen: bool,
}

impl Block {
    fn solid_name(&self) -> String {
        format!("meshes/{}.obj", group_name(self.rect))
    }

    fn seen_name(&self) -> String {
        format!("meshes/{}_seen.obj", group_name(self.rect))
    }
}

/// A block as OBJ, counted from its own south-west corner.
fn block_text(
    product: &Product,
    mesh: &Mesh,
    (rect, texture): (ModuleRect, Option<&Texture>),
    parts: &[(Sheet, Part)],
    library: Option<&str>,
) -> String {
    let [west, south] = corner(product, rect);
    let mut bytes: Vec<u8> = Vec::new();
    bytes.extend(library.map_or_else(String::new, |library| format!("mtllib {library}\n")).bytes());
    let metres = |vertex: &u32| {
        let [x, y, z] = mesh.vertices[*vertex as usize];
        [x - west, y - south, z].map(|quanta| f64::from(quanta) / f64::from(QUANTA_PER_METRE))
    };
    let mut first = 0;
    // Nothing fails where bytes go to memory.
    let _ = put_obj_vertices(&mut bytes, parts.iter().flat_map(|(_, part)| &part.vertices).map(metres));
    for (_, part) in parts.iter().filter(|_| texture.is_some()) {
        let _ = put_obj_places(&mut bytes, &texture.map_or_else(Vec::new, |texture| mesh.uvs(texture, &part.vertices)));
    }
    for (sheet, part) in parts {
        bytes.extend(format!("o {}\n", sheet.name()).bytes());
        for (class, triangles) in class_groups(&part.triangles, &part.classes) {
            if library.is_some() {
                let material = Material { sheet: *sheet, class };
                bytes.extend(format!("usemtl {}\n", material.word(product.classes())).bytes());
            }
            let moved: Vec<[u32; 3]> = triangles.iter().map(|triangle| triangle.map(|v| v + first)).collect();
            let has_texture = texture.is_some() && *sheet != Sheet::Objects;
            let _ = put_obj_faces(&mut bytes, moved.iter(), has_texture);
        }
        first += part.vertices.len() as u32;
    }
    String::from_utf8_lossy(&bytes).into_owned()
}

/// East and north in quanta from the south-west corner of what is exported to that of a block.
fn corner(product: &Product, rect: ModuleRect) -> [i32; 2] {
    product.corner(ModuleId { row: rect.south, col: rect.west })
}

fn world(product: &Product, mesh: &Mesh, blocks: &[Block]) -> Result<String, ExportError> {
    let place_m = product.corner_m(product.rect.south, product.rect.west);
    let datum = Datum::named(product.vertical_datum()).unwrap_or(Datum::Ellipsoid);
    let earth = Earth::new(product, Some(datum))?;
    let [longitude, latitude] = earth.lon_lat(place_m)?;
    let (elevation, heading) = (earth.datum_m([longitude, latitude]), heading_deg(product, &earth)?);
    let name = escaped(&product.manifest.area.name);
    let mut text = format!(
        "<?xml version=\"1.0\"?>\n<!-- tiefort: x east, y north of {} {} in {}, z up above {}; metres{} -->\n\
         <sdf version=\"1.9\">\n  <world name=\"{name}\">\n",
        place_m[0],
        place_m[1],
        escaped(product.crs()),
        match product.vertical_datum() {
            "" => "an unknown vertical datum".into(),
            datum => escaped(datum),
        },
        thanks(product),
    );
    for (file, system) in [
        ("gz-sim-physics-system", "Physics"),
        ("gz-sim-user-commands-system", "UserCommands"),
        ("gz-sim-scene-broadcaster-system", "SceneBroadcaster"),
    ] {
        let _ = writeln!(text, "    <plugin filename=\"{file}\" name=\"gz::sim::systems::{system}\"/>");
    }
    let _ = write!(
        text,
        "    <spherical_coordinates>\n      <surface_model>EARTH_WGS84</surface_model>\n      \
         <world_frame_orientation>ENU</world_frame_orientation>\n      \
         <latitude_deg>{latitude:.9}</latitude_deg>\n      <longitude_deg>{longitude:.9}</longitude_deg>\n      \
         <elevation>{elevation:.3}</elevation>\n      <heading_deg>{heading:.9}</heading_deg>\n    \
         </spherical_coordinates>\n    \
         <light type=\"directional\" name=\"sun\">\n      <cast_shadows>true</cast_shadows>\n      \
         <diffuse>0.9 0.9 0.85 1</diffuse>\n      <direction>0.5 -0.4 -0.8</direction>\n    </light>\n"
    );
    for block in blocks {
        put_model(&mut text, product, block);
    }
    put_observer(&mut text, product, mesh);
    text.push_str("    <plugin filename=\"ignored\" name=\"gz::sim\">\n");
    let _ = writeln!(
        text,
        "      <performer name=\"observer\">\n        <ref>observer</ref>\n        \
         <geometry><box><size>{OBSERVER_M} {OBSERVER_M} {OBSERVER_M}</size></box></geometry>\n      </performer>"
    );
    for block in blocks {
        put_level(&mut text, product, block.rect);
    }
    text.push_str("    </plugin>\n  </world>\n</sdf>\n");
    Ok(text)
}

/// By how many degrees the world's y lies left of true north, at the world's origin.
fn heading_deg(product: &Product, earth: &Earth) -> Result<f64, ExportError> {
    let [x, y] = product.corner_m(product.rect.south, product.rect.west);
    // So near that the map is not bent between, and far enough for digits of the places.
    let [from, to] = [earth.lon_lat([x, y])?, earth.lon_lat([x, y + 1.0])?];
    let along = minus(earth_centred(to, 0.0), earth_centred(from, 0.0));
    let [east, north, _] = directions(from).map(|axis| dot(axis, along));
    Ok((-east).atan2(north).to_degrees())
}

/// Whom to thank for the sources, as part of a comment, which must not end there.
fn thanks(product: &Product) -> String {
    let thank = |text: &&str| format!("; source {}", text.replace("--", "- - "));
    product.attributions().iter().map(thank).collect()
}

fn put_model(text: &mut String, product: &Product, block: &Block) {
    let corner = corner(product, block.rect).map(metres_of_quanta);
    let [east, north] = corner;
    let name = group_name(block.rect);
    let _ = writeln!(
        text,
        "    <model name=\"{name}\">\n      <static>true</static>\n      <pose>{east} {north} 0 0 0 0</pose>\n      \
         <link name=\"ground\">"
    );
    let mesh = |text: &mut String, element: &str, name: &str, file: &str| {
        let _ = writeln!(
            text,
            "        <{element} name=\"{name}\">\n          \
             <geometry><mesh><uri>{file}</uri></mesh></geometry>\n        </{element}>"
        );
    };
    if block.is_solid {
        ["collision", "visual"].iter().for_each(|element| mesh(text, element, element, &block.solid_name()));
    }
    if block.is_seen {
        mesh(text, "visual", "seen", &block.seen_name());
    }
    for (number, found) in boxes(product, block.rect).into_iter().enumerate() {
        let UprightBox { middle_m: [x, y, z], size_m: [long, wide, high], turned } = found;
        let _ = writeln!(
            text,
            "        <collision name=\"object_{number}\">\n          \
             <pose>{} {} {z} 0 0 {turned:.6}</pose>\n          \
             <geometry><box><size>{long:.4} {wide:.4} {high:.4}</size></box></geometry>\n        </collision>",
            x - corner[0],
            y - corner[1],
        );
    }
    text.push_str("      </link>\n    </model>\n");
}

/// A box above the middle of the area: what levels follow, until a vehicle takes its place.
fn put_observer(text: &mut String, product: &Product, mesh: &Mesh) {
    let sides = [product.rect.cols(), product.rect.rows()].map(|count| f64::from(count) * product.side_m());
    let middle = sides.map(|side| side / 2.0);
    let away = |[x, y, _]: &[f64; 3]| (x - middle[0]).hypot(y - middle[1]);
    let near = mesh.metres().min_by(|a, b| away(a).total_cmp(&away(b))).unwrap_or([middle[0], middle[1], 0.0]);
    let [east, north, up] = [near[0], near[1], near[2] + OBSERVER_M];
    let size = format!("{OBSERVER_M} {OBSERVER_M} {OBSERVER_M}");
    let _ = write!(
        text,
        "    <model name=\"observer\">\n      <pose>{east} {north} {up} 0 0 0</pose>\n      <link name=\"body\">\n"
    );
    for element in ["collision", "visual"] {
        let _ = writeln!(
            text,
            "        <{element} name=\"{element}\">\n          \
             <geometry><box><size>{size}</size></box></geometry>\n        </{element}>"
        );
    }
    text.push_str("      </link>\n    </model>\n");
}

fn put_level(text: &mut String, product: &Product, rect: ModuleRect) {
    let sides = [rect.cols(), rect.rows()].map(|count| f64::from(count) * product.side_m());
    let corner = corner(product, rect).map(metres_of_quanta);
    let [east, north] = [0, 1].map(|axis| corner[axis] + sides[axis] / 2.0);
    let buffer = BUFFER_BLOCKS * f64::from(BLOCK_MODULES) * product.side_m();
    let name = group_name(rect);
    let _ = writeln!(
        text,
        "      <level name=\"{name}\">\n        <ref>{name}</ref>\n        \
         <pose>{east} {north} 0 0 0 0</pose>\n        \
         <geometry><box><size>{} {} {LEVEL_HIGH_M}</size></box></geometry>\n        \
         <buffer>{buffer}</buffer>\n      </level>",
        sides[0], sides[1]
    );
}

#[cfg(test)]
mod tests {

    use super::*;
    use crate::samples;

    #[test]
    fn a_world_has_a_model_and_a_level_for_each_block_and_a_mesh_for_each_model() {
        let product = samples::with_bridge();
        let files = samples::texts(|put, work| write_gazebo(&product, put, work));
        let names: Vec<&str> = files.keys().map(String::as_str).collect();
        assert_eq!(names, ["area.sdf", "meshes/classes.mtl", "meshes/r0000c0000_r0000c0001.obj"]);
        let world = &files["area.sdf"];
        for part in [
            "<uri>meshes/r0000c0000_r0000c0001.obj</uri>",
            "<level name=\"r0000c0000_r0000c0001\">",
            "<pose>500 250 0 0 0 0</pose>",
            "<buffer>4000</buffer>",
        ] {
            assert!(world.contains(part), "{part} is not in {world}");
        }
        let mesh = &files["meshes/r0000c0000_r0000c0001.obj"];
        let count = |what: &str| mesh.lines().filter(|line| line.starts_with(what)).count();
        let decks = product.deck_triangles();
        assert_eq!((count("f "), count("o ")), (6 + decks, 2), "{mesh}");
        let corners = mesh.lines().filter_map(|line| line.strip_prefix("f ")).flat_map(str::split_whitespace);
        assert!(corners.map(|text| text.parse::<usize>().unwrap()).all(|corner| (1..=count("v ")).contains(&corner)));
    }

    #[test]
    fn a_place_of_the_world_lies_on_the_globe_where_the_area_has_it() {
        // 1.5 degrees east of the meridian of its zone, where the grid is turned by 0.86 degrees.
        let mut product = samples::product();
        product.frame.origin_east_m = 636_000.0;
        product.manifest.area.vertical_datum = "EGM96".into();
        let files = samples::texts(|put, work| write_gazebo(&product, put, work));
        let number = |name: &str| -> f64 {
            let rest = files["area.sdf"].split_once(&format!("<{name}>")).unwrap().1;
            rest.split_once('<').unwrap().0.parse().unwrap()
        };
        let earth = Earth::new(&product, None).unwrap();
        let origin_m = product.corner_m(product.rect.south, product.rect.west);
        let origin = [number("longitude_deg"), number("latitude_deg")];
        assert!((number("elevation") - earth.datum_m(origin)).abs() < 1e-3 && number("elevation") < -10.0);
        assert!((0.8..0.9).contains(&-number("heading_deg")), "{}", number("heading_deg"));
        let (sin, cos) = number("heading_deg").to_radians().sin_cos();
        for [x, y] in [[1000.0, 500.0], [1000.0, 0.0], [0.0, 500.0]] {
            // As Gazebo turns a place of the world to east and north.
            let [east, north] = [x * cos - y * sin, x * sin + y * cos];
            let place = earth.lon_lat([origin_m[0] + x, origin_m[1] + y]).unwrap();
            let expected = minus(earth_centred(place, 0.0), earth_centred(origin, 0.0));
            let [axis_east, axis_north, _] = directions(origin);
            // What is left is the scale of the map there.
            let off = (dot(axis_east, expected) - east).hypot(dot(axis_north, expected) - north);
            assert!(off < 0.5e-3 * x.hypot(y), "{off} m at {x} {y}");
        }
    }

    #[test]
    fn north_of_a_mercator_projection_is_true_north() {
        let mut product = samples::product();
        (product.frame.origin_east_m, product.frame.origin_north_m) = (1_058_000.0, 5_950_000.0);
        product.manifest.area.crs = "EPSG:3857".into();
        let world = &samples::texts(|put, work| write_gazebo(&product, put, work))["area.sdf"];
        let (_, rest) = world.split_once("<heading_deg>").unwrap();
        let heading: f64 = rest.split_once('<').unwrap().0.parse().unwrap();
        assert!(heading.abs() < 1e-6, "{heading}");
    }
}
