//! A GeoPackage of roads, rivers and lakes as they are in the ground: lines, the nodes where they meet or end, bridges,
//! and what was mended, degraded or left out.

use std::collections::BTreeMap;
use std::path::Path;

use database::{AreaLevel, FeatureLine, FeatureRemark, LineRole};
use rusqlite::{Connection, params};

use crate::gpkg::{Layer, Package};
use crate::gpkg_geometry::{line_z, point, point_z, polygon_z};
use crate::{ExportError, gpkg_index};

const LINES: Layer = Layer {
    name: "lines",
    description: "edges of the TIN as lines of their features, heights above the vertical datum",
    columns: &[
        ("feature", "TEXT"),
        ("class", "TEXT"),
        ("role", "TEXT"),
        ("width_m", "DOUBLE"),
        ("length_m", "DOUBLE"),
        ("grade_max_percent", "DOUBLE"),
        ("grade_found_percent", "DOUBLE"),
    ],
    geometry: "LINESTRING",
    has_z: true,
};
const NODES: Layer = Layer {
    name: "nodes",
    description: "places where centrelines and channels begin, end or meet",
    columns: &[("lines", "INTEGER"), ("height_m", "DOUBLE")],
    geometry: "POINT",
    has_z: true,
};
const DECKS: Layer = Layer {
    name: "decks",
    description: "surfaces of bridges",
    columns: &[("feature", "TEXT"), ("class", "TEXT")],
    geometry: "POLYGON",
    has_z: true,
};
const REMARKS: Layer = Layer {
    name: "remarks",
    description: "what was mended, degraded or left out",
    columns: &[("feature", "TEXT"), ("outcome", "TEXT"), ("found", "TEXT"), ("done", "TEXT")],
    geometry: "POINT",
    has_z: false,
};

/// Roads, rivers and lakes of an area.
#[derive(Clone, Copy, Debug)]
pub struct FeatureLayers<'a> {
    /// Name of the area's coordinate system, such as `EPSG:32611`.
    pub crs: &'a str,
    /// West, south, east and north of the area, in metres.
    pub extent_m: [f64; 4],
    /// Names of the job's classes.
    pub classes: &'a [String],
    /// What features came to.
    pub level: &'a AreaLevel,
    /// What was mended, degraded or left out, and which of these.
    pub remarks: &'a [(&'static str, &'a FeatureRemark)],
}

/// Writes a GeoPackage of features at `path`, where no file may be.
///
/// # Errors
/// When it cannot be written.
pub fn write_features_gpkg(path: &Path, layers: &FeatureLayers) -> Result<(), ExportError> {
    write(path, layers).map_err(|error| ExportError::write("GeoPackage")(std::io::Error::other(error)))
}

fn write(path: &Path, layers: &FeatureLayers) -> rusqlite::Result<()> {
    let mut connection = Connection::open(path)?;
    // The file has a temporary name until it is whole, so nothing has to survive a crash.
    connection.execute_batch("PRAGMA journal_mode = OFF; PRAGMA synchronous = OFF;")?;
    let transaction = connection.transaction()?;
    let epsg = layers.crs.strip_prefix("EPSG:").and_then(|code| code.parse().ok());
    let package = Package { connection: &transaction, srs: epsg.unwrap_or(-1) };
    package.describe(layers.crs)?;
    add_lines(&package, layers)?;
    add_nodes(&package, layers)?;
    add_decks(&package, layers)?;
    add_remarks(&package, layers)?;
    for layer in [LINES, NODES, DECKS, REMARKS] {
        gpkg_index::add(&transaction, layer.name)?;
    }
    transaction.commit()
}

fn class_of(layers: &FeatureLayers, class: u8) -> String {
    layers.classes.get(usize::from(class)).cloned().unwrap_or_default()
}

fn add_lines(package: &Package, layers: &FeatureLayers) -> rusqlite::Result<()> {
    let mut add = package.begin(&LINES, layers.extent_m)?;
    for line in &layers.level.lines {
        let FeatureLine { feature, class, role, width_m, grade_max_ppm, vertices } = line;
        let pairs = || vertices.windows(2).map(|pair| (length_m(pair[0], pair[1]), (pair[1][2] - pair[0][2]).abs()));
        let length: f64 = pairs().map(|(length, _)| length).sum();
        let found = pairs().filter(|pair| 0.0 < pair.0).map(|(length, rise)| 100.0 * rise / length).fold(0.0, f64::max);
        let most = (*grade_max_ppm != 0).then(|| f64::from(*grade_max_ppm) / 1e4);
        add.execute(params![
            line_z(package.srs, vertices),
            feature,
            class_of(layers, *class),
            role.name(),
            width_m,
            length,
            most,
            found
        ])?;
    }
    Ok(())
}

fn add_nodes(package: &Package, layers: &FeatureLayers) -> rusqlite::Result<()> {
    let mut nodes: BTreeMap<[u64; 3], ([f64; 3], u32)> = BTreeMap::new();
    for line in &layers.level.lines {
        if !matches!(line.role, LineRole::Centre | LineRole::Channel) {
            continue;
        }
        for end in line.vertices.first().into_iter().chain(line.vertices.last()) {
            nodes.entry(end.map(f64::to_bits)).or_insert((*end, 0)).1 += 1;
        }
    }
    let mut add = package.begin(&NODES, layers.extent_m)?;
    for (place, lines) in nodes.values() {
        add.execute(params![point_z(package.srs, *place), lines, place[2]])?;
    }
    Ok(())
}

fn add_decks(package: &Package, layers: &FeatureLayers) -> rusqlite::Result<()> {
    let mut add = package.begin(&DECKS, layers.extent_m)?;
    for deck in &layers.level.decks {
        add.execute(params![polygon_z(package.srs, &deck.ring), deck.feature, class_of(layers, deck.class)])?;
    }
    Ok(())
}

/// Those without a place stand in the south-west corner of the area.
fn add_remarks(package: &Package, layers: &FeatureLayers) -> rusqlite::Result<()> {
    let [west, south, ..] = layers.extent_m;
    let mut add = package.begin(&REMARKS, layers.extent_m)?;
    for (outcome, remark) in layers.remarks {
        let place = remark.at_m.unwrap_or([west, south]);
        add.execute(params![point(package.srs, place), remark.feature, outcome, remark.found, remark.done])?;
    }
    Ok(())
}

fn length_m(a: [f64; 3], b: [f64; 3]) -> f64 {
    let [east, north] = [b[0] - a[0], b[1] - a[1]];
    (east * east + north * north).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use database::FeatureFace;

    #[test]
    fn lines_nodes_bridges_and_remarks_are_layers_of_their_own() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("features.gpkg");
        let line = |vertices: Vec<[f64; 3]>| FeatureLine {
            feature: "way 1".into(),
            class: 1,
            role: LineRole::Centre,
            width_m: 7.0,
            grade_max_ppm: 100_000,
            vertices,
        };
        let middle = [30.0, 40.0, 2.5];
        let lines = vec![line(vec![[0.0, 0.0, 0.0], middle]), line(vec![middle, [30.0, 140.0, 2.5]])];
        let deck = FeatureFace { feature: "way 2".into(), class: 1, ring: vec![[0.0; 3], [5.0, 0.0, 1.0], middle] };
        let level = AreaLevel { lines, decks: vec![deck], ..AreaLevel::default() };
        let remark = FeatureRemark {
            feature: "way 3".into(),
            at_m: None,
            found: "a spike".into(),
            done: "left out".into(),
            leaves_out: true,
            degrades: false,
        };
        let classes = ["plain", "primary"].map(str::to_owned);
        let extent_m = [0.0, 0.0, 500.0, 500.0];
        let remarks = [("left out", &remark)];
        let layers = FeatureLayers { crs: "EPSG:32611", extent_m, classes: &classes, level: &level, remarks: &remarks };
        write_features_gpkg(&path, &layers).unwrap();
        let package = Connection::open(&path).unwrap();
        let number = |query: &str| -> f64 { package.query_row(query, [], |row| row.get(0)).unwrap() };
        let counts =
            ["lines", "nodes", "decks", "remarks"].map(|layer| number(&format!("SELECT count(*) + 0.0 FROM {layer}")));
        assert_eq!(counts, [2.0, 3.0, 1.0, 1.0]);
        assert_eq!(number("SELECT grade_found_percent FROM lines WHERE fid = 1"), 5.0);
        assert_eq!(number("SELECT grade_max_percent FROM lines WHERE fid = 2"), 10.0);
        assert_eq!(number("SELECT lines + 0.0 FROM nodes ORDER BY lines DESC LIMIT 1"), 2.0);
        let class: String = package.query_row("SELECT class FROM decks", [], |row| row.get(0)).unwrap();
        assert_eq!(class, "primary");
    }
}
