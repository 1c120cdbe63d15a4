//! What every GeoPackage that is written has in common: its tables, layers, geometries and spatial indexes.
//!
//! The same layers give the same file, byte by byte: it says of no moment when it was made.

use rusqlite::{Connection, params};

/// `GPKG`, and version 1.3 of it.
const APPLICATION_ID: i32 = 0x4750_4b47;
const VERSION: i32 = 10_300;
/// When the layers are said to have changed: the same database gives the same file.
const CHANGED: &str = "1970-01-01T00:00:00.000Z";

/// A layer.
pub struct Layer {
    /// Its name.
    pub name: &'static str,
    /// What it shows, in words.
    pub description: &'static str,
    /// Names and types of its columns, behind `fid` and `geom`.
    pub columns: &'static [(&'static str, &'static str)],
    /// The kind of its geometry.
    pub geometry: &'static str,
    /// Whether that has heights.
    pub has_z: bool,
}

/// West, south, east and north, in metres.
pub type Extent = [f64; 4];

/// A GeoPackage while it is written.
pub struct Package<'a> {
    /// The database.
    pub connection: &'a Connection,
    /// The coordinate system as the package numbers it.
    pub srs: i32,
}

impl<'a> Package<'a> {
    /// The tables that every package has, and the coordinate system.
    ///
    /// # Errors
    /// When the library cannot write.
    pub fn describe(&self, crs: &str) -> rusqlite::Result<()> {
        self.connection
            .execute_batch(&format!("PRAGMA application_id = {APPLICATION_ID}; PRAGMA user_version = {VERSION};"))?;
        self.connection.execute_batch(include_str!("tables.sql"))?;
        let add = "INSERT INTO gpkg_spatial_ref_sys VALUES (?1, ?2, ?3, ?4, ?5, NULL)";
        let mut add = self.connection.prepare(add)?;
        add.execute(params!["undefined, projected", -1, "NONE", -1, "undefined"])?;
        add.execute(params!["undefined, geographic", 0, "NONE", 0, "undefined"])?;
        let wgs84 = crs_definitions::from_code(4326).map_or("undefined", |known| known.wkt);
        add.execute(params!["WGS 84", 4326, "EPSG", 4326, wgs84])?;
        if ![-1, 0, 4326].contains(&self.srs) {
            let known = u16::try_from(self.srs).ok().and_then(crs_definitions::from_code);
            let definition = known.map_or("undefined", |known| known.wkt);
            add.execute(params![crs, self.srs, "EPSG", self.srs, definition])?;
        }
        Ok(())
    }

    /// Makes the table of a layer and lists it; the statement that adds a feature: geometry first, then its columns.
    ///
    /// # Errors
    /// When the library cannot write.
    pub fn begin(&self, layer: &Layer, extent: Extent) -> rusqlite::Result<rusqlite::Statement<'a>> {
        let Layer { name, description, columns, geometry, has_z } = layer;
        let declared: String = columns.iter().map(|(name, kind)| format!(", {name} {kind}")).collect();
        self.connection.execute_batch(&format!(
            "CREATE TABLE {name} (fid INTEGER PRIMARY KEY AUTOINCREMENT NOT NULL, geom {geometry}{declared});"
        ))?;
        let [west, south, east, north] = extent;
        self.connection.execute(
            "INSERT INTO gpkg_contents VALUES (?1, 'features', ?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8)",
            params![name, description, CHANGED, west, south, east, north, self.srs],
        )?;
        self.connection.execute(
            "INSERT INTO gpkg_geometry_columns VALUES (?1, 'geom', ?2, ?3, ?4, 0)",
            params![name, geometry, self.srs, i32::from(*has_z)],
        )?;
        let names: String = columns.iter().map(|(name, _)| format!(", {name}")).collect();
        let places: String = (2..2 + columns.len()).map(|place| format!(", ?{place}")).collect();
        self.connection.prepare(&format!("INSERT INTO {name} (geom{names}) VALUES (?1{places})"))
    }
}

/// Little-endian, with an extent in x and y.
const FLAGS: u8 = 0b0000_0011;
/// Codes of well-known binary.
const POLYGON: u32 = 3;
const POLYGON_Z: u32 = 1003;
const MULTIPOLYGON: u32 = 6;
const POINT: u32 = 1;
const POINT_Z: u32 = 1001;
const LINE_Z: u32 = 1002;

/// A polygon of one ring; `ring` does not repeat its first place.
pub fn polygon(srs: i32, ring: &[[f64; 2]]) -> Vec<u8> {
    blob(srs, POLYGON, ring)
}

/// The same with heights.
pub fn polygon_z(srs: i32, ring: &[[f64; 3]]) -> Vec<u8> {
    blob(srs, POLYGON_Z, ring)
}

/// A place.
pub fn point(srs: i32, place: [f64; 2]) -> Vec<u8> {
    with_places(head(srs, &[place]), &[POINT], &[place])
}

/// A place with its height.
pub fn point_z(srs: i32, place: [f64; 3]) -> Vec<u8> {
    with_places(head(srs, &[place]), &[POINT_Z], &[place])
}

/// A line with heights.
pub fn line_z(srs: i32, places: &[[f64; 3]]) -> Vec<u8> {
    with_places(head(srs, places), &[LINE_Z, places.len() as u32], places)
}

/// Polygons of an outer ring and holes each; no ring repeats its first place.
pub fn polygons(srs: i32, shapes: &[Vec<Vec<[f64; 2]>>]) -> Vec<u8> {
    let all: Vec<[f64; 2]> = shapes.iter().flatten().flatten().copied().collect();
    let mut bytes = with_places::<2>(head(srs, &all), &[MULTIPOLYGON, shapes.len() as u32], &[]);
    for shape in shapes {
        bytes = with_places::<2>(bytes, &[POLYGON, shape.len() as u32], &[]);
        for ring in shape {
            let closed = ring.iter().chain(ring.first());
            bytes.extend_from_slice(&(ring.len() as u32 + 1).to_le_bytes());
            bytes.extend(closed.flatten().flat_map(|number| number.to_le_bytes()));
        }
    }
    bytes
}

fn blob<const N: usize>(srs: i32, kind: u32, ring: &[[f64; N]]) -> Vec<u8> {
    let closed: Vec<[f64; N]> = ring.iter().chain(ring.first()).copied().collect();
    with_places(head(srs, ring), &[kind, 1, closed.len() as u32], &closed)
}

/// What stands before the well-known binary: the coordinate system and the extent.
fn head<const N: usize>(srs: i32, places: &[[f64; N]]) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(8 + 32 + 13 + 8 * N * (places.len() + 1));
    bytes.extend_from_slice(&[b'G', b'P', 0, FLAGS]);
    bytes.extend_from_slice(&srs.to_le_bytes());
    for axis in 0..2 {
        let values = || places.iter().map(|place| place[axis]);
        for end in [values().fold(f64::INFINITY, f64::min), values().fold(f64::NEG_INFINITY, f64::max)] {
            bytes.extend_from_slice(&end.to_le_bytes());
        }
    }
    bytes
}

/// Well-known binary after a head: little-endian, its numbers, its places.
fn with_places<const N: usize>(mut bytes: Vec<u8>, numbers: &[u32], places: &[[f64; N]]) -> Vec<u8> {
    bytes.push(1);
    numbers.iter().for_each(|number| bytes.extend_from_slice(&number.to_le_bytes()));
    places.iter().flatten().for_each(|number| bytes.extend_from_slice(&number.to_le_bytes()));
    bytes
}

/// What the extension is called, and where it is defined.
const EXTENSION: &str = "gpkg_rtree_index";
const DEFINITION: &str = "http://www.geopackage.org/spec120/#extension_rtree";

/// Builds the index of a layer whose features are all there. Their extents stand at the head of each geometry.
///
/// # Errors
/// When the library cannot write.
pub fn add_index(connection: &Connection, layer: &str) -> rusqlite::Result<()> {
    connection.execute_batch(&format!(
        "CREATE TABLE IF NOT EXISTS gpkg_extensions (
             table_name TEXT, column_name TEXT, extension_name TEXT NOT NULL, definition TEXT NOT NULL,
             scope TEXT NOT NULL, CONSTRAINT ge_tce UNIQUE (table_name, column_name, extension_name));
         CREATE VIRTUAL TABLE rtree_{layer}_geom USING rtree(id, minx, maxx, miny, maxy);"
    ))?;
    connection.execute(
        "INSERT INTO gpkg_extensions VALUES (?1, 'geom', ?2, ?3, 'write-only')",
        params![layer, EXTENSION, DEFINITION],
    )?;
    fill(connection, layer)?;
    connection.execute_batch(&triggers(layer))
}

fn fill(connection: &Connection, layer: &str) -> rusqlite::Result<()> {
    let mut features = connection.prepare(&format!("SELECT fid, geom FROM {layer} WHERE geom NOTNULL"))?;
    let mut add = connection.prepare(&format!("INSERT INTO rtree_{layer}_geom VALUES (?1, ?2, ?3, ?4, ?5)"))?;
    let mut rows = features.query([])?;
    while let Some(row) = rows.next()? {
        let fid: i64 = row.get(0)?;
        let [west, east, south, north] = extent(row.get_ref(1)?.as_blob()?);
        add.execute(params![fid, west, east, south, north])?;
    }
    Ok(())
}

/// Smallest and largest x, then y, of a geometry that we wrote.
fn extent(geometry: &[u8]) -> [f64; 4] {
    std::array::from_fn(|index| {
        let mut number = [0; 8];
        number.copy_from_slice(&geometry[8 + 8 * index..16 + 8 * index]);
        f64::from_le_bytes(number)
    })
}

/// What happens to the index when a feature comes, goes, or changes its shape or its number.
fn triggers(layer: &str) -> String {
    let tree = format!("rtree_{layer}_geom");
    let there = |which: &str| format!("({which}.geom NOTNULL AND NOT ST_IsEmpty({which}.geom))");
    let gone = |which: &str| format!("({which}.geom ISNULL OR ST_IsEmpty({which}.geom))");
    let put = format!(
        "INSERT OR REPLACE INTO {tree} VALUES \
         (NEW.fid, ST_MinX(NEW.geom), ST_MaxX(NEW.geom), ST_MinY(NEW.geom), ST_MaxY(NEW.geom));"
    );
    let take = format!("DELETE FROM {tree} WHERE id = OLD.fid;");
    let (new, none, old) = (there("NEW"), gone("NEW"), "OLD.geom NOTNULL");
    let same = "OLD.fid = NEW.fid";
    let other = "OLD.fid <> NEW.fid";
    let trigger = |name: &str, event: &str, when: &str, what: &str| {
        format!("CREATE TRIGGER {tree}_{name} AFTER {event} ON {layer} WHEN {when} BEGIN {what} END;\n")
    };
    let was = there("OLD");
    let both = format!("{take} DELETE FROM {tree} WHERE id = NEW.fid;");
    let moved = format!("{take} {put}");
    let reshaped = format!(
        "UPDATE {tree} SET minx = ST_MinX(NEW.geom), maxx = ST_MaxX(NEW.geom), \
                            miny = ST_MinY(NEW.geom), maxy = ST_MaxY(NEW.geom) WHERE id = NEW.fid;"
    );
    [
        trigger("insert", "INSERT", &new, &put),
        trigger("update6", "UPDATE OF geom", &format!("{same} AND {new} AND {was}"), &reshaped),
        trigger("update7", "UPDATE OF geom", &format!("{same} AND {new} AND {}", gone("OLD")), &put),
        trigger("update2", "UPDATE OF geom", &format!("{same} AND {none}"), &take),
        trigger("update5", "UPDATE", &format!("{other} AND {new}"), &moved),
        trigger("update4", "UPDATE", &format!("{other} AND {none}"), &both),
        trigger("delete", "DELETE", old, &take),
    ]
    .concat()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_triangle_is_closed_and_its_extent_stands_before_it() {
        let bytes = polygon_z(32611, &[[0.0, 0.0, 5.0], [2.0, 0.0, 6.0], [0.0, 3.0, 7.0]]);
        assert_eq!(bytes.len(), 8 + 32 + 13 + 4 * 24);
        assert_eq!((&bytes[..4], &bytes[4..8]), (&b"GP\0\x03"[..], &32611_i32.to_le_bytes()[..]));
        assert_eq!(bytes[16..24], 2.0_f64.to_le_bytes());
        assert_eq!(bytes[41..45], 1003_u32.to_le_bytes());
        assert_eq!(bytes[53..77], bytes[bytes.len() - 24..]);
        assert_eq!(polygon(1, &[[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]]).len(), 8 + 32 + 13 + 4 * 16);
    }
}
