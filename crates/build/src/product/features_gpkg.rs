//! A GeoPackage of roads, rivers and lakes as they are in the ground: lines, the nodes where they meet or end, bridges,
//! and what was mended, degraded or left out.

use std::collections::BTreeMap;

use job::Job;
use rusqlite::{Connection, params};
use source_files::geopackage_parts::{Extent, Layer, Package, add_index, line_z, point, point_z, polygon_z};
use store::{AreaLevel, FeatureLine, FeatureRemark};
use terrain::Role;
use views::outcome;

use crate::product::ProductError;
use crate::product::told::length_m;

const LINES: Layer = Layer {
    name: "lines",
    description: "edges of the TIN as lines of their features, heights above the vertical datum",
    columns: &[
        ("feature", "TEXT"),
        ("class", "TEXT"),
        ("form", "TEXT"),
        ("role", "TEXT"),
        ("width_m", "DOUBLE"),
        ("length_m", "DOUBLE"),
        ("grade_max_percent", "DOUBLE"),
        ("grade_found_percent", "DOUBLE"),
        ("cut_m3", "DOUBLE"),
        ("fill_m3", "DOUBLE"),
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
/// What was decided of roads and water where they cross.
const CULVERTS: Layer = Layer {
    name: "culverts",
    description: "places where a channel passes below a road",
    columns: &[("feature", "TEXT")],
    geometry: "POINT",
    has_z: false,
};

/// What features of a job came to in this area, as a GeoPackage. The same always gives the same bytes.
///
/// # Errors
/// When there is no room to make it.
pub fn features_package(job: &Job, level: &AreaLevel, remarks: &[FeatureRemark]) -> Result<Vec<u8>, ProductError> {
    let ([west, south], [wide, high]) = (job.area.origin_m, job.area.size_m());
    let layers = FeatureLayers {
        epsg: job.area.epsg,
        extent_m: [west, south, west + wide, south + high],
        classes: &job.class_names(),
        level,
        remarks,
    };
    write(&layers).map_err(|error| ProductError::Package { message: error.to_string() })
}

struct FeatureLayers<'a> {
    epsg: u32,
    extent_m: Extent,
    classes: &'a [String],
    level: &'a AreaLevel,
    remarks: &'a [FeatureRemark],
}

/// In memory: what a file holds besides depends on where it lies.
fn write(layers: &FeatureLayers) -> rusqlite::Result<Vec<u8>> {
    let mut connection = Connection::open_in_memory()?;
    let transaction = connection.transaction()?;
    let package = Package { connection: &transaction, srs: layers.epsg.cast_signed() };
    package.describe(&format!("EPSG:{}", layers.epsg))?;
    add_lines(&package, layers)?;
    add_nodes(&package, layers)?;
    add_decks(&package, layers)?;
    add_culverts(&package, layers)?;
    add_remarks(&package, layers)?;
    for layer in [LINES, NODES, DECKS, CULVERTS, REMARKS] {
        add_index(&transaction, layer.name)?;
    }
    transaction.commit()?;
    Ok(connection.serialize("main")?.to_vec())
}

fn class_of(layers: &FeatureLayers, class: u8) -> String {
    layers.classes.get(usize::from(class)).cloned().unwrap_or_default()
}

/// The form that a line belongs to.
fn form_of(role: Role) -> &'static str {
    match role {
        Role::Centre | Role::Channel | Role::Breakline => "line",
        Role::Side => "strip",
        Role::Toe => "bench",
        Role::Shore | Role::Bank => "polygon",
    }
}

fn add_lines(package: &Package, layers: &FeatureLayers) -> rusqlite::Result<()> {
    let mut add = package.begin(&LINES, layers.extent_m)?;
    for line in &layers.level.lines {
        let FeatureLine { feature, class, role, width_m, grade_max_ppm, grade_most_ppm: _, moved_m3, vertices } = line;
        let [cut, fill] = *moved_m3;
        let pairs = || vertices.windows(2).map(|pair| (length_m(pair[0], pair[1]), (pair[1][2] - pair[0][2]).abs()));
        let length: f64 = pairs().map(|(length, _)| length).sum();
        let found = pairs().filter(|pair| 0.0 < pair.0).map(|(length, rise)| 100.0 * rise / length).fold(0.0, f64::max);
        let most = (*grade_max_ppm != 0).then(|| f64::from(*grade_max_ppm) / 1e4);
        add.execute(params![
            line_z(package.srs, vertices),
            feature,
            class_of(layers, *class),
            form_of(*role),
            role.name(),
            width_m,
            length,
            most,
            found,
            cut,
            fill
        ])?;
    }
    Ok(())
}

fn add_nodes(package: &Package, layers: &FeatureLayers) -> rusqlite::Result<()> {
    let mut nodes: BTreeMap<[u64; 3], ([f64; 3], u32)> = BTreeMap::new();
    for line in &layers.level.lines {
        if !matches!(line.role, Role::Centre | Role::Channel) {
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

fn add_culverts(package: &Package, layers: &FeatureLayers) -> rusqlite::Result<()> {
    let mut add = package.begin(&CULVERTS, layers.extent_m)?;
    for remark in layers.remarks.iter().filter(|remark| remark.is_culvert()) {
        add.execute(params![remark.at_m.map(|place| point(package.srs, place)), remark.feature])?;
    }
    Ok(())
}

/// Those without a place have no geometry.
fn add_remarks(package: &Package, layers: &FeatureLayers) -> rusqlite::Result<()> {
    let mut add = package.begin(&REMARKS, layers.extent_m)?;
    for remark in layers.remarks {
        let FeatureRemark { feature, at_m, found, done, .. } = remark;
        add.execute(params![at_m.map(|place| point(package.srs, place)), feature, outcome(remark), found, done])?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use store::{CULVERT, FeatureFace};

    fn remark(at_m: Option<[f64; 2]>, done: &str) -> FeatureRemark {
        let (feature, found) = ("way 3".to_owned(), "a spike".to_owned());
        FeatureRemark { feature, at_m, found, done: done.into(), leaves_out: true, degrades: false }
    }

    fn package() -> Vec<u8> {
        let line = |role, vertices: Vec<[f64; 3]>| FeatureLine {
            feature: "way 1".into(),
            class: 1,
            role,
            width_m: 7.0,
            grade_max_ppm: 100_000,
            grade_most_ppm: 150_000,
            moved_m3: [12.5, 0.0],
            vertices,
        };
        let middle = [30.0, 40.0, 2.5];
        let lines = vec![
            line(Role::Centre, vec![[0.0, 0.0, 0.0], middle]),
            line(Role::Centre, vec![middle, [30.0, 140.0, 2.5]]),
            line(Role::Side, vec![middle, [60.0, 140.0, 2.5]]),
        ];
        let deck = FeatureFace { feature: "way 2".into(), class: 1, ring: vec![[0.0; 3], [5.0, 0.0, 1.0], middle] };
        let level = AreaLevel { lines, decks: vec![deck], ..AreaLevel::default() };
        let classes = ["plain", "primary"].map(str::to_owned);
        let remarks = [remark(None, "left out"), remark(Some([5.0, 6.0]), CULVERT)];
        let extent_m = [0.0, 0.0, 500.0, 500.0];
        write(&FeatureLayers { epsg: 32611, extent_m, classes: &classes, level: &level, remarks: &remarks }).unwrap()
    }

    #[test]
    fn lines_nodes_bridges_culverts_and_remarks_are_layers_of_their_own() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("features.gpkg");
        std::fs::write(&path, package()).unwrap();
        let package = Connection::open(&path).unwrap();
        let number = |query: &str| -> f64 { package.query_row(query, [], |row| row.get(0)).unwrap() };
        let counts = ["lines", "nodes", "decks", "culverts", "remarks", "remarks WHERE geom IS NULL"]
            .map(|layer| number(&format!("SELECT count(*) + 0.0 FROM {layer}")));
        assert_eq!(counts, [3.0, 3.0, 1.0, 1.0, 2.0, 1.0]);
        assert_eq!(number("SELECT grade_found_percent FROM lines WHERE fid = 1"), 5.0);
        assert_eq!(number("SELECT grade_max_percent FROM lines WHERE fid = 2"), 10.0);
        assert_eq!(number("SELECT sum(cut_m3) + sum(fill_m3) FROM lines"), 37.5);
        assert_eq!(number("SELECT lines + 0.0 FROM nodes ORDER BY lines DESC LIMIT 1"), 2.0);
        let text = |query: &str| -> String { package.query_row(query, [], |row| row.get(0)).unwrap() };
        assert_eq!(text("SELECT class FROM decks"), "primary");
        assert_eq!(text("SELECT group_concat(form) FROM lines"), "line,line,strip");
        assert_eq!(text("PRAGMA integrity_check"), "ok");
    }

    #[test]
    fn the_same_features_give_the_same_bytes() {
        assert!(package() == package());
    }
}
