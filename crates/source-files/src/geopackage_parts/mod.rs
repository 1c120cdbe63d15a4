//! What every GeoPackage that is written has in common: its tables, layers, geometries and spatial indexes.
//!
//! The same layers give the same file, byte by byte: it says of no moment when it was made.

mod geometry;
mod index;

pub use geometry::{line_z, point, point_z, polygon, polygon_z, polygons};
pub use index::add_index;

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
