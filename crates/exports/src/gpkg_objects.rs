//! Layers of a GeoPackage for what stands on the ground: buildings, woods, rows and points.

use std::collections::BTreeMap;

use rusqlite::params;
use source_files::geopackage_parts::{Extent, Layer, Package, point_z, polygons};
use terrain::plans::union;
use terrain::{Canopy, LoadModule, ObjectKind, Prism, QUANTA_PER_METRE, metres_of_quanta};

use crate::classes::Classes;
use crate::gpkg_styles::Style;
use crate::objects::canopy_plans;
use crate::sheets::{Material, object_material};
use crate::{Product, Sheet};

const BUILDINGS: Layer = Layer {
    name: "buildings",
    description: "buildings by their rooflines, heights above the vertical datum",
    columns: &[
        // Text, as in other formats: a number of 64 bits may be larger than SQLite has.
        ("id", "TEXT"),
        ("class", "TEXT"),
        ("base_m", "DOUBLE"),
        ("roof_m", "DOUBLE"),
        ("height_m", "DOUBLE"),
        ("fullness", "DOUBLE"),
        ("spacing_m", "DOUBLE"),
    ],
    geometry: "MULTIPOLYGON",
    has_z: false,
};
const WOODS: Layer = Layer { name: "woods", description: "woods, scrub and orchards", ..BUILDINGS };
const ROWS: Layer = Layer { name: "rows", description: "rows of trees, hedges and walls", ..BUILDINGS };
const POINTS: Layer = Layer {
    name: "points",
    description: "towers, chimneys and the like, at their middle",
    geometry: "POINT",
    has_z: true,
    ..BUILDINGS
};

/// An object whose pieces are put together.
#[derive(Default)]
pub(crate) struct Whole {
    /// Of all pieces, in quanta from the south-west corner of what is exported.
    pub rings: Vec<Vec<[i32; 2]>>,
    /// Of prisms alone, as the roof.
    pub base: Option<i32>,
    pub roof: Option<i32>,
    /// Of canopies alone.
    pub height: Option<i32>,
    fullness: Option<f64>,
    spacing: Option<f64>,
}

/// Adds a layer for each group of kinds that the product has any of; these layers.
pub(crate) fn add_objects(
    package: &Package,
    product: &Product,
    extent: Extent,
) -> rusqlite::Result<Vec<&'static Layer>> {
    let mut layers = Vec::new();
    let wholes = wholes(product);
    for layer in [&BUILDINGS, &WOODS, &ROWS, &POINTS] {
        let own = || wholes.iter().filter(|((kind, _), _)| layer_of(*kind).name == layer.name);
        if own().next().is_none() {
            continue;
        }
        layers.push(layer);
        let mut add = package.begin(layer, extent)?;
        for ((kind, id), whole) in own() {
            let height = whole.height.or_else(|| Some(whole.roof? - whole.base?));
            let geometry = match layer.geometry {
                "POINT" => point_z(package.srs, middle(product, whole)),
                _ => polygons(package.srs, &placed(product, &union(std::slice::from_ref(&whole.rings)))),
            };
            add.execute(params![
                geometry,
                id.to_string(),
                kind.name(),
                whole.base.map(metres_of_quanta),
                whole.roof.map(metres_of_quanta),
                height.map(metres_of_quanta),
                whole.fullness,
                whole.spacing,
            ])?;
        }
    }
    Ok(layers)
}

/// How a layer of objects is drawn: in the colour of the tops of its first kind.
pub(crate) fn style_of(layer: &Layer) -> Style<'static> {
    let own = ObjectKind::ALL.into_iter().find(|kind| layer_of(*kind).name == layer.name);
    let class = own.map_or(0, |kind| object_material(kind, false));
    let color = Material { sheet: Sheet::Objects, class }.color(Classes::default());
    if layer.geometry == "POINT" { Style::Marked(color) } else { Style::Filled(color) }
}

fn layer_of(kind: ObjectKind) -> &'static Layer {
    match kind {
        ObjectKind::Building => &BUILDINGS,
        ObjectKind::Tower => &POINTS,
        ObjectKind::Wall | ObjectKind::Row => &ROWS,
        ObjectKind::Wood | ObjectKind::Scrub | ObjectKind::Orchard => &WOODS,
    }
}

/// All objects by kind and number.
pub(crate) fn wholes(product: &Product) -> BTreeMap<(ObjectKind, u64), Whole> {
    let mut wholes: BTreeMap<(ObjectKind, u64), Whole> = BTreeMap::new();
    for module in &product.modules {
        for prism in &module.objects.prisms {
            let &Prism { id, kind, base, roof, .. } = prism;
            let whole = wholes.entry((kind, id)).or_default();
            whole.rings.extend(moved(product, module, prism.plan()));
            whole.base = Some(whole.base.map_or(base, |other| other.min(base)));
            whole.roof = Some(whole.roof.map_or(roof, |other| other.max(roof)));
        }
        for canopy in &module.objects.canopies {
            let &Canopy { id, kind, height, fullness, spacing, .. } = canopy;
            let whole = wholes.entry((kind, id)).or_default();
            whole.rings.extend(canopy_plans(canopy).into_iter().flat_map(|plan| moved(product, module, plan)));
            whole.height = Some(height.into());
            whole.fullness = Some(f64::from(fullness) / 100.0);
            whole.spacing = Some(metres_of_quanta(spacing.into()));
        }
    }
    wholes
}

/// Rings in quanta from the corner of a load module as such from that of what is exported.
fn moved(product: &Product, module: &LoadModule, rings: Vec<Vec<[i32; 2]>>) -> Vec<Vec<[i32; 2]>> {
    let corner = product.corner(module.id);
    let place = |[x, y]: [i32; 2]| [corner[0] + x, corner[1] + y];
    rings.into_iter().map(|ring| ring.into_iter().map(place).collect()).collect()
}

/// Shapes in quanta from the corner of what is exported as eastings and northings.
fn placed(product: &Product, shapes: &[Vec<Vec<[i32; 2]>>]) -> Vec<Vec<Vec<[f64; 2]>>> {
    let ring = |ring: &Vec<[i32; 2]>| ring.iter().map(|&at| place_m(product, at)).collect();
    shapes.iter().map(|shape| shape.iter().map(ring).collect()).collect()
}

fn place_m(product: &Product, at: [i32; 2]) -> [f64; 2] {
    let corner_m = product.corner_m(product.rect.south, product.rect.west);
    [0, 1].map(|axis| corner_m[axis] + f64::from(at[axis]) / f64::from(QUANTA_PER_METRE))
}

/// The middle of the extent of an object, on its roof.
fn middle(product: &Product, whole: &Whole) -> [f64; 3] {
    let of = |axis: usize| whole.rings.iter().flatten().map(move |place| place[axis]);
    let middle = |axis| of(axis).min().unwrap_or(0).midpoint(of(axis).max().unwrap_or(0));
    let [east, north] = place_m(product, [middle(0), middle(1)]);
    [east, north, whole.roof.map_or(0.0, metres_of_quanta)]
}
