//! Polygons from a GeoPackage: all layers of polygons in it, each in its own coordinate system.
//!
//! The file is a database, and one that somebody made to do harm can hold programs (views, triggers, virtual tables).
//! So it is opened for reading only, and only plain tables of it are looked at.

use std::path::Path;

use rusqlite::{Connection, OpenFlags, OptionalExtension};

use crate::SourceError;
use crate::crs::Crs;
use crate::limits::{LAYERS_MAX, ROWS_MAX};

/// How every one begins.
pub(crate) const MARK: &[u8] = b"SQLite format 3\0";

/// Rings of corners of a polygon.
type Rings = Vec<Vec<[f64; 2]>>;

/// A layer of polygons: its coordinate system, where it names one, and the rings of each polygon.
pub(crate) struct Layer {
    pub crs: Option<Crs>,
    pub polygons: Vec<Rings>,
}

/// The layers of the GeoPackage at `path` that hold polygons.
pub(crate) fn layers(path: &Path) -> Result<Vec<Layer>, SourceError> {
    let package = Package { path };
    let flags = OpenFlags::SQLITE_OPEN_READ_ONLY | OpenFlags::SQLITE_OPEN_NO_MUTEX;
    let database = Connection::open_with_flags(path, flags).map_err(|error| package.broken(error))?;
    let guards = "PRAGMA trusted_schema = OFF; PRAGMA query_only = ON; PRAGMA cell_size_check = ON; \
                  PRAGMA mmap_size = 0;";
    database.execute_batch(guards).map_err(|error| package.broken(error))?;
    let mut layers = Vec::new();
    for Table { name, column, srs } in package.tables(&database)? {
        let polygons = package.polygons(&database, &name, &column)?;
        if !polygons.is_empty() {
            layers.push(Layer { crs: package.crs(&database, srs)?, polygons });
        }
    }
    Ok(layers)
}

/// A table of features, its column of geometries and their system.
struct Table {
    name: String,
    column: String,
    srs: i64,
}

struct Package<'a> {
    path: &'a Path,
}

impl Package<'_> {
    fn broken(&self, error: impl std::fmt::Display) -> SourceError {
        self.malformed(error.to_string(), "a sound GeoPackage")
    }

    fn malformed(&self, found: String, expected: &str) -> SourceError {
        let (what, expected) = ("the GeoPackage".into(), expected.into());
        SourceError::Malformed { path: self.path.into(), what, found, expected }
    }

    fn is_table(&self, database: &Connection, name: &str) -> Result<bool, SourceError> {
        // A virtual table has no page of its own to begin on.
        let plain = "SELECT 1 FROM sqlite_schema WHERE type = 'table' AND rootpage > 0 AND lower(name) = lower(?1)";
        let found = database.query_row(plain, [name], |_| Ok(())).optional();
        found.map(|found| found.is_some()).map_err(|error| self.broken(error))
    }

    fn tables(&self, database: &Connection) -> Result<Vec<Table>, SourceError> {
        const LIST: &str = "gpkg_geometry_columns";
        if !self.is_table(database, LIST)? {
            return Err(self.malformed("a database without layers".into(), "a GeoPackage with a layer of polygons"));
        }
        let query = format!("SELECT table_name, column_name, srs_id FROM {LIST} LIMIT {}", LAYERS_MAX + 1);
        let mut statement = database.prepare(&query).map_err(|error| self.broken(error))?;
        let rows =
            statement.query_map([], |row| Ok(Table { name: row.get(0)?, column: row.get(1)?, srs: row.get(2)? }));
        let tables: Result<Vec<Table>, _> = rows.map_err(|error| self.broken(error))?.collect();
        let tables = tables.map_err(|error| self.broken(error))?;
        if LAYERS_MAX < tables.len() {
            let (found, limit) = (tables.len() as u64, LAYERS_MAX as u64);
            return Err(SourceError::TooLarge { path: self.path.into(), what: "layers", found, limit });
        }
        for table in &tables {
            if !self.is_table(database, &table.name)? {
                return Err(self.malformed(format!("a layer `{}` that is no table", table.name), "plain tables"));
            }
        }
        Ok(tables)
    }

    fn crs(&self, database: &Connection, srs: i64) -> Result<Option<Crs>, SourceError> {
        // Undefined, projected and geographic: nobody knows which.
        if srs <= 0 || !self.is_table(database, "gpkg_spatial_ref_sys")? {
            return Ok(None);
        }
        let query = "SELECT organization, organization_coordsys_id FROM gpkg_spatial_ref_sys WHERE srs_id = ?1";
        let named = database.query_row(query, [srs], |row| Ok((row.get::<_, String>(0)?, row.get::<_, i64>(1)?)));
        let Some((who, code)) = named.optional().map_err(|error| self.broken(error))? else { return Ok(None) };
        let refused = |found: String| SourceError::UnnamedCrs { path: self.path.into(), found };
        match (who.eq_ignore_ascii_case("EPSG"), u32::try_from(code)) {
            (true, Ok(code)) => {
                Crs::from_epsg(code).map(Some).map_err(|found| refused(format!("EPSG:{code}: {found}")))
            }
            _ => Err(refused(format!("{who}:{code}"))),
        }
    }

    fn polygons(&self, database: &Connection, table: &str, column: &str) -> Result<Vec<Rings>, SourceError> {
        let quoted = |name: &str| format!("\"{}\"", name.replace('"', "\"\""));
        let query = format!("SELECT {} FROM {} LIMIT {}", quoted(column), quoted(table), ROWS_MAX + 1);
        let mut statement = database.prepare(&query).map_err(|error| self.broken(error))?;
        let mut rows = statement.query([]).map_err(|error| self.broken(error))?;
        let (mut polygons, mut count) = (Vec::new(), 0);
        while let Some(row) = rows.next().map_err(|error| self.broken(error))? {
            count += 1;
            if ROWS_MAX < count {
                let (what, found, limit) = ("features (or more)", count, ROWS_MAX);
                return Err(SourceError::TooLarge { path: self.path.into(), what, found, limit });
            }
            let value = row.get_ref(0).map_err(|error| self.broken(error))?;
            // A feature without a geometry is legal and adds nothing.
            if let Some(blob) = value.as_blob_or_null().map_err(|error| self.broken(error))? {
                self.geometry(blob, &mut polygons)?;
            }
        }
        Ok(polygons)
    }

    /// A geometry as GeoPackages store it: a header with a box around it, then well-known binary.
    fn geometry(&self, blob: &[u8], polygons: &mut Vec<Rings>) -> Result<(), SourceError> {
        let cut = || self.malformed("a geometry that is cut short".into(), "whole ones");
        let &[b'G', b'P', _, flags, ..] = blob else {
            return Err(self.malformed("a geometry without its mark".into(), "GP"));
        };
        let numbers = match flags >> 1 & 7 {
            0 => 0,
            1 => 4,
            2 | 3 => 6,
            4 => 8,
            other => return Err(self.malformed(format!("a box of kind {other}"), "0 to 4")),
        };
        let binary = blob.get(8 + 8 * numbers..).ok_or_else(cut)?;
        Binary { package: self, bytes: binary, at: 0 }.shape(polygons, 0)
    }
}

/// Well-known binary, read from the front.
struct Binary<'a> {
    package: &'a Package<'a>,
    bytes: &'a [u8],
    at: usize,
}

impl Binary<'_> {
    fn take<const N: usize>(&mut self) -> Result<[u8; N], SourceError> {
        let taken = self.bytes.get(self.at..self.at + N).and_then(|bytes| bytes.try_into().ok());
        self.at += N;
        taken.ok_or_else(|| self.package.malformed("a geometry that is cut short".into(), "whole ones"))
    }

    fn number(&mut self, little: bool) -> Result<u32, SourceError> {
        let bytes = self.take()?;
        Ok(if little { u32::from_le_bytes(bytes) } else { u32::from_be_bytes(bytes) })
    }

    fn place(&mut self, little: bool, axes: usize) -> Result<[f64; 2], SourceError> {
        let mut number = || {
            let bytes = self.take()?;
            Ok(if little { f64::from_le_bytes(bytes) } else { f64::from_be_bytes(bytes) })
        };
        let place = [number()?, number()?];
        (2..axes).try_for_each(|_| number().map(drop))?;
        Ok(place)
    }

    fn shape(&mut self, polygons: &mut Vec<Rings>, depth: usize) -> Result<(), SourceError> {
        /// Collections in collections.
        const DEPTH_MAX: usize = 8;
        if DEPTH_MAX < depth {
            return Err(self.package.malformed("collections in collections in collections".into(), "flat ones"));
        }
        let [order] = self.take()?;
        let little = order == 1;
        let code = self.number(little)?;
        // Heights and measures are told by thousands, or by the highest bits.
        let (kind, flags) = (code & 0x0fff_ffff, code >> 28);
        let axes = match kind / 1000 {
            0 => 2 + usize::from(flags & 8 != 0) + usize::from(flags & 4 != 0),
            1 | 2 => 3,
            _ => 4,
        };
        let found = match kind % 1000 {
            3 => {
                let count = self.number(little)?;
                let rings = (0..count).map(|_| self.ring(little, axes)).collect::<Result<Rings, _>>()?;
                // POLYGON EMPTY has no rings.
                polygons.extend((!rings.is_empty()).then_some(rings));
                return Ok(());
            }
            6 | 7 => {
                let count = self.number(little)?;
                return (0..count).try_for_each(|_| self.shape(polygons, depth + 1));
            }
            1 => "Point",
            2 => "LineString",
            4 => "MultiPoint",
            5 => "MultiLineString",
            _ => "geometry of some other kind",
        };
        Err(SourceError::NotPolygons { path: self.package.path.into(), found })
    }

    fn ring(&mut self, little: bool, axes: usize) -> Result<Vec<[f64; 2]>, SourceError> {
        let count = self.number(little)?;
        // Grown as places are found, so that a number alone asks for no memory.
        (0..count).map(|_| self.place(little, axes)).collect()
    }
}
