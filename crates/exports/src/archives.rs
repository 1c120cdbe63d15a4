//! What is a folder of many files as one file: 3D Tiles as an archive (3TZ), quantized-mesh and maps in SQLite
//! (MBTiles).

use std::collections::BTreeMap;
use std::io::{Cursor, Write};
use std::path::Path;
use std::sync::Mutex;

use md5::{Digest, Md5};
use rusqlite::{Connection, params};
use serde_json::Value;
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipArchive, ZipWriter};

use crate::{Datum, ExportError, Product, Put, Work, write_quantized_mesh};

/// The last file of a 3TZ: where every other begins, by the MD5 sum of its name (3D Tiles Archive Format 1.3).
const INDEX: &str = "@3dtilesIndex1@";

/// Writes the files of 3D Tiles that `write` makes as one archive of stored files with an index. Returns what that
/// returns.
///
/// # Errors
/// Those of `write`, and when the archive cannot be written.
pub fn write_3tz<R, E: From<ExportError>>(
    out: &mut impl Write,
    write: impl FnOnce(&Put) -> Result<R, E>,
) -> Result<R, E> {
    let (files, told) = gathered(write)?;
    let bytes = archive(&files).map_err(|error| ExportError::write("3TZ")(std::io::Error::other(error)))?;
    out.write_all(&bytes).map_err(ExportError::write("3TZ"))?;
    Ok(told)
}

/// Files of a folder by name.
pub(crate) type Files = BTreeMap<String, Vec<u8>>;

/// The files that `write` makes, and what it returns.
pub(crate) fn gathered<R, E>(write: impl FnOnce(&Put) -> Result<R, E>) -> Result<(Files, R), E> {
    let files = Mutex::new(Files::new());
    let put = |name: &str, bytes: &[u8]| {
        let mut files = files.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        files.insert(name.to_owned(), bytes.to_vec());
        Ok(())
    };
    let told = write(&put)?;
    Ok((files.into_inner().unwrap_or_else(std::sync::PoisonError::into_inner), told))
}

fn archive(files: &Files) -> zip::result::ZipResult<Vec<u8>> {
    // Without times, so that equal contents are equal bytes.
    let options = SimpleFileOptions::default().compression_method(CompressionMethod::Stored);
    let mut writer = ZipWriter::new(Cursor::new(Vec::new()));
    for (name, bytes) in files {
        writer.start_file(name, options)?;
        writer.write_all(bytes)?;
    }
    let bytes = writer.finish()?.into_inner();
    let mut index: Vec<([u8; 16], u64)> = Vec::with_capacity(files.len());
    let mut read = ZipArchive::new(Cursor::new(&bytes))?;
    for number in 0..read.len() {
        let file = read.by_index_raw(number)?;
        index.push((Md5::digest(file.name()?.as_bytes()).into(), file.header_start()));
    }
    // By the sum as two little-endian numbers of 64 bits.
    let half = |sum: &[u8; 16], from: usize| (0..8).fold(0, |all, at| all | u64::from(sum[from + at]) << (8 * at));
    index.sort_unstable_by_key(|(sum, _)| (half(sum, 0), half(sum, 8)));
    let mut writer = ZipWriter::new_append(Cursor::new(bytes))?;
    writer.start_file(INDEX, options)?;
    for (sum, start) in index {
        writer.write_all(&sum)?;
        writer.write_all(&start.to_le_bytes())?;
    }
    Ok(writer.finish()?.into_inner())
}

/// Writes quantized-mesh terrain as one SQLite file at `path`, rows from the south as in MBTiles 1.3. Returns what
/// was done to heights.
///
/// # Errors
/// Those of [`write_quantized_mesh`].
pub fn write_mbtiles(
    path: &Path,
    product: &Product,
    assumed: Option<Datum>,
    work: &Work,
) -> Result<Datum, ExportError> {
    let (files, datum) = gathered(|put| write_quantized_mesh(product, assumed, put, work))?;
    let tiles = files.iter().filter_map(|(name, bytes)| Some((tile_numbers(name)?, bytes.as_slice())));
    write_tables(path, &about(product, &files), tiles)?;
    Ok(datum)
}

/// What is said of all tiles.
fn about(product: &Product, files: &Files) -> Vec<(&'static str, String)> {
    let levels: Vec<i64> = files.keys().filter_map(|name| tile_numbers(name)).map(|[level, ..]| level).collect();
    let layer: Value = files.get("layer.json").and_then(|bytes| serde_json::from_slice(bytes).ok()).unwrap_or_default();
    let bounds = layer["bounds"].as_array().map(|bounds| bounds.iter().map(Value::to_string).collect::<Vec<_>>());
    let text = |number: Option<&i64>| number.map(i64::to_string).unwrap_or_default();
    let mut about = vec![
        ("name", product.manifest.area.name.clone()),
        ("format", "application/vnd.quantized-mesh".into()),
        ("scheme", "tms".into()),
        ("crs", "EPSG:4326".into()),
        ("bounds", bounds.unwrap_or_default().join(",")),
        ("minzoom", text(levels.iter().min())),
        ("maxzoom", text(levels.iter().max())),
        ("attribution", product.attributions().join("; ")),
        ("type", "baselayer".into()),
        ("version", "1".into()),
        ("json", layer.to_string()),
    ];
    about.extend(files.get("holes.geojson").map(|holes| ("holes", String::from_utf8_lossy(holes).into_owned())));
    about
}

/// Level, column and row of `LEVEL/COLUMN/ROW.terrain`.
fn tile_numbers(name: &str) -> Option<[i64; 3]> {
    let mut parts = name.strip_suffix(".terrain")?.split('/').map(str::parse);
    let numbers = [parts.next()?.ok()?, parts.next()?.ok()?, parts.next()?.ok()?];
    parts.next().is_none().then_some(numbers)
}

/// Writes tiles, each by its level, column and row counted from the south, and what is said of them at `path`.
///
/// # Errors
/// When the file cannot be written.
pub(crate) fn write_tables<'a>(
    path: &Path,
    about: &[(&str, String)],
    tiles: impl Iterator<Item = ([i64; 3], &'a [u8])>,
) -> Result<(), ExportError> {
    tables(path, about, tiles).map_err(|error| ExportError::write("MBTiles")(std::io::Error::other(error)))
}

fn tables<'a>(
    path: &Path,
    about: &[(&str, String)],
    tiles: impl Iterator<Item = ([i64; 3], &'a [u8])>,
) -> rusqlite::Result<()> {
    let mut connection = Connection::open(path)?;
    // The file has a temporary name until it is whole, so nothing has to survive a crash.
    connection.execute_batch(
        "PRAGMA journal_mode = OFF; PRAGMA synchronous = OFF; PRAGMA application_id = 0x4d504258;
        CREATE TABLE metadata (name TEXT PRIMARY KEY, value TEXT);
        CREATE TABLE tiles (zoom_level INTEGER, tile_column INTEGER, tile_row INTEGER, tile_data BLOB);",
    )?;
    let transaction = connection.transaction()?;
    for ([level, column, row], bytes) in tiles {
        transaction.execute("INSERT INTO tiles VALUES (?1, ?2, ?3, ?4)", params![level, column, row, bytes])?;
    }
    for (name, value) in about {
        transaction.execute("INSERT INTO metadata VALUES (?1, ?2)", params![name, value])?;
    }
    transaction.execute_batch("CREATE UNIQUE INDEX tile_index ON tiles (zoom_level, tile_column, tile_row);")?;
    transaction.commit()
}

#[cfg(test)]
mod tests {
    use std::io::Read;
    use std::sync::atomic::AtomicBool;

    use rusqlite::Connection;
    use schedule::Workers;

    use super::*;
    use crate::{samples, write_3dtiles};

    #[test]
    fn an_archive_holds_the_files_of_the_folder_and_its_index_says_where_each_begins() {
        let (workers, stop) = (Workers::new(2), AtomicBool::new(false));
        let work = Work { workers: &workers, stop: &stop, tell: &|_| {} };
        let product = samples::product();
        let mut out = Cursor::new(Vec::new());
        let write = |put: &Put| write_3dtiles(&product, Some(Datum::Ellipsoid), put, &work);
        write_3tz(&mut out, write).unwrap();
        let (files, _) = gathered(write).unwrap();
        let bytes = out.into_inner();
        let mut read = ZipArchive::new(Cursor::new(&bytes)).unwrap();
        assert_eq!(read.len(), files.len() + 1);
        let mut index = Vec::new();
        read.by_name(INDEX).unwrap().read_to_end(&mut index).unwrap();
        assert_eq!(read.by_index(files.len()).unwrap().name().unwrap(), INDEX, "the index is the last file");
        for (name, expected) in &files {
            let mut found = Vec::new();
            read.by_name(name).unwrap().read_to_end(&mut found).unwrap();
            assert_eq!(&found, expected);
            let sum: [u8; 16] = Md5::digest(name.as_bytes()).into();
            let entry = index.chunks(24).find(|entry| entry[..16] == sum).unwrap();
            let start = u64::from_le_bytes(entry[16..].try_into().unwrap()) as usize;
            assert_eq!(bytes[start..start + 4], *b"PK\x03\x04");
            assert_eq!(bytes[start + 30..start + 30 + name.len()], *name.as_bytes());
        }
    }

    #[test]
    fn mbtiles_hold_the_tiles_of_the_folder_by_level_column_and_row() {
        let (workers, stop) = (Workers::new(2), AtomicBool::new(false));
        let work = Work { workers: &workers, stop: &stop, tell: &|_| {} };
        let product = samples::product();
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.mbtiles");
        write_mbtiles(&path, &product, Some(Datum::Ellipsoid), &work).unwrap();
        let (files, _) = gathered(|put| write_quantized_mesh(&product, Some(Datum::Ellipsoid), put, &work)).unwrap();
        let connection = Connection::open(&path).unwrap();
        let count: i64 = connection.query_row("SELECT count(*) FROM tiles", [], |row| row.get(0)).unwrap();
        assert_eq!(count as usize, files.keys().filter(|name| tile_numbers(name).is_some()).count());
        for (name, expected) in files.iter().filter(|(name, _)| tile_numbers(name).is_some()) {
            let asked = "SELECT tile_data FROM tiles WHERE zoom_level = ?1 AND tile_column = ?2 AND tile_row = ?3";
            let found: Vec<u8> = connection.query_row(asked, tile_numbers(name).unwrap(), |row| row.get(0)).unwrap();
            assert_eq!(&found, expected);
        }
        let bounds = "SELECT value FROM metadata WHERE name = 'bounds'";
        let bounds: String = connection.query_row(bounds, [], |row| row.get(0)).unwrap();
        assert_eq!(bounds.split(',').count(), 4);
    }
}
