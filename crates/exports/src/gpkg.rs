//! A GeoPackage for QGIS: load modules, breaches, tiles, the triangles themselves, decks and objects, as layers of one
//! file.
//!
//! The one export that opens its file itself, because the library does; it is given a temporary name.

use std::collections::BTreeMap;
use std::path::Path;

use rusqlite::{Connection, ToSql, params};
use source_files::geopackage_parts::{Extent, Layer, Package, add_index, line_z, polygon, polygon_z};
use store::{Manifest, Report, ReportPlace};
use terrain::{
    Decks, HOLE_CLASS, LineForm, LineKind, LineStorey, ModuleId, ModuleLine, ModuleRect, ModuleVertex,
    QUANTA_PER_METRE, metres_of_quanta,
};

use crate::classes::HOLE_NAME;
use crate::gpkg_objects::{add_objects, style_of};
use crate::gpkg_styles::Style;
use crate::{ExportError, Product, Step, Work, gpkg_styles};

const MODULES: Layer = Layer {
    name: "load_modules",
    description: "load modules with their counts and residuals",
    columns: &[
        ("row", "INTEGER"),
        ("col", "INTEGER"),
        ("triangles", "INTEGER"),
        ("polygons", "INTEGER"),
        ("vertices", "INTEGER"),
        ("posts", "INTEGER"),
        ("rms_m", "DOUBLE"),
        ("mean_abs_m", "DOUBLE"),
        ("max_m", "DOUBLE"),
        ("lowest_m", "DOUBLE"),
        ("highest_m", "DOUBLE"),
    ],
    geometry: "POLYGON",
    has_z: false,
};
const BREACHES: Layer = Layer {
    name: "breaches",
    description: "limits that could not be met",
    columns: &[
        ("kind", "TEXT"),
        ("place", "TEXT"),
        ("row", "INTEGER"),
        ("col", "INTEGER"),
        ("count", "INTEGER"),
        ("limit_there", "INTEGER"),
        ("excess", "INTEGER"),
        ("refused", "INTEGER"),
        ("rms_with_m", "DOUBLE"),
        ("rms_without_m", "DOUBLE"),
    ],
    geometry: "POLYGON",
    has_z: false,
};
const TILES: Layer = Layer {
    name: "tiles",
    description: "tiles, the units of work",
    columns: &[("row", "INTEGER"), ("col", "INTEGER"), ("state", "TEXT")],
    geometry: "POLYGON",
    has_z: false,
};
const TRIANGLES: Layer = Layer {
    name: "triangles",
    description: "the triangles of the TIN, heights above the vertical datum",
    columns: &[
        ("module_row", "INTEGER"),
        ("module_col", "INTEGER"),
        ("class", "INTEGER"),
        ("class_name", "TEXT"),
        ("slope_degrees", "DOUBLE"),
        ("area_m2", "DOUBLE"),
    ],
    geometry: "POLYGON",
    has_z: true,
};

/// Listed only where there are decks.
const DECKS: Layer = Layer { name: "decks", description: "triangles of the decks of bridges", ..TRIANGLES };

/// Listed only where there are ways.
const LINES: Layer = Layer {
    name: "lines",
    description: "middle lines of roads, rails, rivers and breaklines, whether they are in the ground or not",
    columns: &[
        ("module_row", "INTEGER"),
        ("module_col", "INTEGER"),
        ("class", "INTEGER"),
        ("class_name", "TEXT"),
        ("kind", "TEXT"),
        ("form", "TEXT"),
        ("storey", "TEXT"),
        ("kept", "BOOLEAN"),
        ("in_ground", "BOOLEAN"),
        ("width_m", "DOUBLE"),
    ],
    geometry: "LINESTRING",
    has_z: true,
};

/// Writes a GeoPackage at `path`, where no file may be. `window` is the rows and columns of load modules that a window
/// of the report has.
///
/// # Errors
/// When it cannot be written, or the work was asked to stop.
pub fn write_gpkg(
    path: &Path,
    product: &Product,
    report: &Report,
    window: [u32; 2],
    work: &Work,
) -> Result<(), ExportError> {
    let fault = |error: rusqlite::Error| ExportError::write("GeoPackage")(std::io::Error::other(error));
    let mut connection = Connection::open(path).map_err(fault)?;
    // The file has a temporary name until it is whole, so nothing has to survive a crash.
    connection.execute_batch("PRAGMA journal_mode = OFF; PRAGMA synchronous = OFF;").map_err(fault)?;
    let transaction = connection.transaction().map_err(fault)?;
    let package = Package { connection: &transaction, srs: product.epsg().map_or(-1, |code| code as i32) };
    package.describe(product.crs()).map_err(fault)?;
    let package = Layers(package);
    package.add_modules(product).map_err(fault)?;
    package.add_breaches(product, report, window).map_err(fault)?;
    package.add_tiles(product).map_err(fault)?;
    let names: Vec<&str> = report.classes.iter().map(|class| class.name.as_str()).collect();
    package.add_triangles(product, &names, work, fault)?;
    let (ground, ways) = (class_values(product, &names), way_values(product, &names));
    let mut layers = vec![
        (&MODULES, Style::Outlined("70,70,70")),
        (&BREACHES, Style::Outlined("200,40,20")),
        (&TILES, Style::Outlined("0,70,160")),
        (&TRIANGLES, Style::ByClass(&ground)),
    ];
    if 0 < product.deck_triangles() {
        package.add_decks(product, &names).map_err(fault)?;
        layers.push((&DECKS, Style::ByClass(&ground)));
    }
    if !ways.is_empty() {
        package.add_lines(product, &names).map_err(fault)?;
        layers.push((&LINES, Style::LinesByClass(&ways)));
    }
    let objects = add_objects(&package.0, product, extent(product, product.rect)).map_err(fault)?;
    layers.extend(objects.into_iter().map(|layer| (layer, style_of(layer))));
    let styles: Vec<(&str, Style)> = layers.into_iter().map(|(layer, style)| (layer.name, style)).collect();
    gpkg_styles::add(&transaction, &styles).map_err(fault)?;
    for (layer, _) in styles {
        add_index(&transaction, layer).map_err(fault)?;
    }
    transaction.commit().map_err(fault)
}

/// The name of a class of ground, where the job gave it one.
fn class_name(names: &[&str], class: u8) -> String {
    let name = names.get(usize::from(class)).map_or_else(|| format!("class {class}"), |name| (*name).to_owned());
    if class == HOLE_CLASS { HOLE_NAME.into() } else { name }
}

/// The name of every class that a triangle of ground or decks has, and its number.
fn class_values(product: &Product, names: &[&str]) -> BTreeMap<u8, String> {
    let classes = product.modules.iter().flat_map(|module| module.classes.iter().chain(&module.decks.classes));
    classes.map(|&class| (class, class_name(names, class))).collect()
}

/// The name of every class that a way has, and its number.
fn way_values(product: &Product, names: &[&str]) -> BTreeMap<u8, String> {
    product.lines.iter().flatten().map(|line| (line.class, class_name(names, line.class))).collect()
}

/// What a line is called by its kind, its form and where it runs.
fn way_words(line: &ModuleLine) -> [&'static str; 3] {
    let kind = match line.kind {
        LineKind::Travelled => "travelled",
        LineKind::Channel => "channel",
        LineKind::Breakline => "breakline",
    };
    let form = match line.form {
        LineForm::Nothing => "none",
        LineForm::Line => "line",
        LineForm::Strip => "strip",
        LineForm::Bench => "bench",
    };
    let storey = match line.storey {
        LineStorey::Ground => "ground",
        LineStorey::Bridge => "bridge",
        LineStorey::Tunnel => "tunnel",
    };
    [kind, form, storey]
}

/// The triangles of a load module's ground, or of its decks.
struct Triangles<'a> {
    vertices: &'a [ModuleVertex],
    corners: &'a [[u16; 3]],
    classes: &'a [u8],
}

/// The package, as the layers of a product are added to it.
struct Layers<'a>(Package<'a>);

impl Layers<'_> {
    fn add_modules(&self, product: &Product) -> rusqlite::Result<()> {
        let mut add = self.0.begin(&MODULES, extent(product, product.rect))?;
        for module in &product.modules {
            let (row, col) = (module.id.row, module.id.col);
            let geometry =
                self.rectangle(extent(product, ModuleRect { south: row, west: col, north: row + 1, east: col + 1 }));
            let (metre, posts) = (f64::from(QUANTA_PER_METRE), f64::from(module.residual.posts));
            let mean = |sum: u64| (0 < module.residual.posts).then(|| sum as f64 / posts);
            let heights = || module.vertices.iter().map(|vertex| vertex.z);
            add.execute(params![
                geometry,
                row,
                col,
                i64::from(module.counts().triangles),
                module.counts().polygons,
                module.vertices.len() as i64,
                module.residual.posts,
                mean(module.residual.sum_squared).map(|mean| mean.sqrt() / metre),
                mean(module.residual.sum_abs).map(|mean| mean / metre),
                f64::from(module.residual.largest) / metre,
                heights().min().map(metres_of_quanta),
                heights().max().map(metres_of_quanta),
            ])?;
        }
        Ok(())
    }

    fn add_breaches(&self, product: &Product, report: &Report, window: [u32; 2]) -> rusqlite::Result<()> {
        let mut add = self.0.begin(&BREACHES, extent(product, product.grid.all()))?;
        for breach in &report.breaches {
            let (place, at, [rows, cols]) = match breach.place {
                ReportPlace::Module(at) => ("module", Some(at), [1, 1]),
                ReportPlace::Window(at) => ("window", Some(at), window),
                ReportPlace::Area => ("area", None, [product.grid.rows, product.grid.cols]),
            };
            let [row, col] = at.unwrap_or([0, 0]);
            let rect = ModuleRect { south: row, west: col, north: row + rows, east: col + cols };
            add.execute(params![
                self.rectangle(extent(product, rect)),
                breach.kind,
                place,
                at.map(|at| at[0]),
                at.map(|at| at[1]),
                breach.count as i64,
                breach.limit as i64,
                breach.excess as i64,
                breach.refused,
                breach.rms_with_m,
                breach.rms_without_m,
            ])?;
        }
        Ok(())
    }

    fn add_tiles(&self, product: &Product) -> rusqlite::Result<()> {
        let mut add = self.0.begin(&TILES, extent(product, product.grid.all()))?;
        let is_exported = |modules: &ModuleRect| modules.intersection(product.rect).is_some();
        let Manifest { tiles, area, .. } = &product.manifest;
        for record in tiles {
            let Some(modules) = area.modules_of(record.tile()).filter(is_exported) else { continue };
            let state = serde_json::json!(record.state).as_str().map(str::to_owned);
            add.execute(params![self.rectangle(extent(product, modules)), record.row, record.col, state])?;
        }
        Ok(())
    }

    fn add_triangles(
        &self,
        product: &Product,
        names: &[&str],
        work: &Work,
        fault: impl Fn(rusqlite::Error) -> ExportError,
    ) -> Result<(), ExportError> {
        let mut add = self.0.begin(&TRIANGLES, extent(product, product.rect)).map_err(&fault)?;
        let total = product.modules.len();
        for (done, module) in product.modules.iter().enumerate() {
            if work.stop.load(std::sync::atomic::Ordering::Relaxed) {
                return Err(ExportError::Stopped { what: "load modules", done, total });
            }
            let ground = Triangles { vertices: &module.vertices, corners: &module.triangles, classes: &module.classes };
            self.add_triangles_of(&mut add, product, names, (module.id, ground)).map_err(&fault)?;
            (work.tell)(Step { what: "load modules", done: done + 1, total });
        }
        Ok(())
    }

    fn add_decks(&self, product: &Product, names: &[&str]) -> rusqlite::Result<()> {
        let mut add = self.0.begin(&DECKS, extent(product, product.rect))?;
        for module in &product.modules {
            let Decks { vertices, triangles, classes } = &module.decks;
            let decks = Triangles { vertices, corners: triangles, classes };
            self.add_triangles_of(&mut add, product, names, (module.id, decks))?;
        }
        Ok(())
    }

    fn add_lines(&self, product: &Product, names: &[&str]) -> rusqlite::Result<()> {
        let mut add = self.0.begin(&LINES, extent(product, product.rect))?;
        for (module, lines) in product.modules.iter().zip(&product.lines) {
            for line in lines {
                let places: Vec<[f64; 3]> = line.vertices.iter().map(|v| place_m(product, module.id, *v)).collect();
                let [kind, form, storey] = way_words(line);
                add.execute(params![
                    line_z(self.0.srs, &places),
                    module.id.row,
                    module.id.col,
                    line.class,
                    class_name(names, line.class),
                    kind,
                    form,
                    storey,
                    line.is_kept,
                    line.is_in_ground,
                    metres_of_quanta(line.width.into()),
                ])?;
            }
        }
        Ok(())
    }

    fn add_triangles_of(
        &self,
        add: &mut rusqlite::Statement,
        product: &Product,
        names: &[&str],
        (id, triangles): (ModuleId, Triangles),
    ) -> rusqlite::Result<()> {
        for (&triangle, class) in triangles.corners.iter().zip(triangles.classes) {
            let corners = triangle.map(|v| place_m(product, id, triangles.vertices[usize::from(v)]));
            let [a, b, c] = corners;
            let normal = crate::mesh::cross(crate::mesh::minus(b, a), crate::mesh::minus(c, a));
            let slope = normal[0].hypot(normal[1]).atan2(normal[2]).to_degrees();
            let (geometry, name) = (polygon_z(self.0.srs, &corners), class_name(names, *class));
            let values: [&dyn ToSql; 7] = [&geometry, &id.row, &id.col, class, &name, &slope, &(normal[2] / 2.0)];
            add.execute(values)?;
        }
        Ok(())
    }

    fn rectangle(&self, [west, south, east, north]: Extent) -> Vec<u8> {
        polygon(self.0.srs, &[[west, south], [east, south], [east, north], [west, north]])
    }
}

/// Easting, northing and height of a vertex of a load module.
fn place_m(product: &Product, id: ModuleId, vertex: ModuleVertex) -> [f64; 3] {
    let [east_m, north_m] = product.corner_m(id.row, id.col);
    let [x_m, y_m] = [vertex.x, vertex.y].map(|quanta| f64::from(quanta) / f64::from(QUANTA_PER_METRE));
    [east_m + x_m, north_m + y_m, metres_of_quanta(vertex.z)]
}

fn extent(product: &Product, rect: ModuleRect) -> Extent {
    let [west, south] = product.corner_m(rect.south, rect.west);
    let [east, north] = product.corner_m(rect.north, rect.east);
    [west, south, east, north]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::samples::{self, with_work};

    #[test]
    fn decks_are_a_layer_of_their_own_with_a_style() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.gpkg");
        with_work(|work| write_gpkg(&path, &samples::with_bridge(), &samples::report(), [8, 8], work).unwrap());
        let package = Connection::open(&path).unwrap();
        let count = |what: &str| -> i64 { package.query_row(what, [], |row| row.get(0)).unwrap() };
        let counts = ["triangles", "decks", "decks WHERE class = 2", "rtree_decks_geom", "layer_styles"]
            .map(|layer| count(&format!("SELECT count(*) FROM {layer}")));
        assert_eq!(counts, [6, 6, 2, 6, 5]);
        assert_eq!(count("SELECT sum(triangles) FROM load_modules"), 12);
        assert_eq!(count("SELECT styleQML LIKE '%value=\"2\"%' FROM layer_styles WHERE f_table_name = 'decks'"), 1);
    }

    #[test]
    fn classes_have_the_names_of_the_job_and_holes_are_called_so() {
        let names = ["plain", "road"];
        let found = class_values(&samples::with_hole(), &names);
        assert_eq!(found.into_values().collect::<Vec<_>>(), ["plain", "road", "hole"]);
        assert_eq!(class_name(&names, 7), "class 7");
    }

    #[test]
    fn a_package_has_its_layers_with_a_feature_for_each_thing() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.gpkg");
        with_work(|work| write_gpkg(&path, &samples::product(), &samples::report(), [8, 8], work).unwrap());
        let package = Connection::open(&path).unwrap();
        let count = |layer: &str| -> i64 {
            package.query_row(&format!("SELECT count(*) FROM {layer}"), [], |row| row.get(0)).unwrap()
        };
        assert_eq!([count("load_modules"), count("breaches"), count("tiles"), count("triangles")], [2, 1, 1, 6]);
        assert_eq!([count("gpkg_contents"), count("gpkg_extensions"), count("layer_styles")], [5, 4, 4]);
        let found: i64 = package
            .query_row("SELECT count(*) FROM rtree_triangles_geom WHERE 505400 < maxx AND minx < 505490", [], |row| {
                row.get(0)
            })
            .unwrap();
        assert_eq!((count("rtree_triangles_geom"), found), (6, 2));
        let styled: i64 = package
            .query_row(
                "SELECT count(*) FROM layer_styles JOIN gpkg_geometry_columns ON f_table_name = table_name
                 AND f_geometry_column = column_name WHERE useAsDefault AND styleQML LIKE '<qgis %'",
                [],
                |row| row.get(0),
            )
            .unwrap();
        assert_eq!(styled, 4);
        let id: i32 = package.query_row("PRAGMA application_id", [], |row| row.get(0)).unwrap();
        assert_eq!(id.to_be_bytes(), *b"GPKG");
        let rms: f64 = package.query_row("SELECT rms_m FROM load_modules WHERE col = 0", [], |row| row.get(0)).unwrap();
        assert!((rms - (3_276_800.0_f64 / 400.0).sqrt() / 128.0).abs() < 1e-12);
        let area: f64 = package.query_row("SELECT sum(area_m2) FROM triangles", [], |row| row.get(0)).unwrap();
        assert_eq!(area, 500_000.0);
        let wkt: String = package
            .query_row("SELECT definition FROM gpkg_spatial_ref_sys WHERE srs_id = 32611", [], |row| row.get(0))
            .unwrap();
        assert!(wkt.contains("UTM zone 11N"), "{wkt}");
    }
}
