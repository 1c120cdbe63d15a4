//! The header: which tile, on which grid, in which frame.

use crate::bytes::{Cursor, check_section};
use crate::{FIXED_HEADER_BYTES, LEVELS_MAX, MAGIC, QUANTA_PER_METRE, ReadError, Section, VERSION, VERSION_OF_GROUND};

/// Bytes of the longest header: two texts of 65,535 bytes, padding, checksum.
const HEADER_BYTES_MAX: u32 = (FIXED_HEADER_BYTES as u32 + 2 * u16::MAX as u32).next_multiple_of(4) + 4;
/// Cells along a side of the area at most: a thousand times what a job allows.
const AREA_CELLS_MAX: u32 = 1 << 30;
/// Metres of the area's south-west corner from the origin of its coordinates at most: ten times what a job allows.
const ORIGIN_M_MAX: f64 = 1e9;

/// What holds for all load modules of a file. Rows and columns count load modules from the area's south-west.
#[derive(Clone, Debug, PartialEq)]
pub struct Header {
    /// Version of the format: [`VERSION`] with a table of parts for each load module, [`crate::VERSION_WITH_DECKS`]
    /// with decks alone, [`VERSION_OF_GROUND`] without either.
    pub version: u16,
    /// Levels of every load module, the finest first.
    pub level_count: u16,
    /// Row of the tile.
    pub tile_row: u32,
    /// Column of the tile.
    pub tile_col: u32,
    /// Rows of load modules in the whole area.
    pub area_rows: u32,
    /// Columns of load modules in the whole area.
    pub area_cols: u32,
    /// First row of load modules in this file.
    pub south: u32,
    /// First column of load modules in this file.
    pub west: u32,
    /// One past the last row of load modules in this file.
    pub north: u32,
    /// One past the last column of load modules in this file.
    pub east: u32,
    /// Length of a load module's side in quanta of 1/128 m.
    pub side: u16,
    /// Cells of the working grid along a load module's side.
    pub side_cells: u32,
    /// Spacing of the working grid in sixteenths of a metre.
    pub spacing_sixteenths: u32,
    /// Easting and northing of the area's south-west corner in metres of `crs`.
    pub origin_m: [f64; 2],
    /// The coordinate reference system, such as `EPSG:32611`.
    pub crs: String,
    /// What heights are above, such as `EGM96`; empty when unknown.
    pub vertical_datum: String,
    /// Of all that this file was made from: equal fingerprints, equal ground.
    pub fingerprint: [u8; 32],
}

impl Header {
    /// Length of a load module's side in metres.
    pub fn side_m(&self) -> f64 {
        f64::from(self.side) / f64::from(QUANTA_PER_METRE)
    }

    /// Easting and northing of a load module's south-west corner, in metres: the same bits whichever file asks.
    pub fn module_origin_m(&self, row: u32, col: u32) -> [f64; 2] {
        let [east, north] = self.origin_m;
        [east + f64::from(col) * self.side_m(), north + f64::from(row) * self.side_m()]
    }

    /// Load modules in the file, each of which has all levels.
    pub fn module_count(&self) -> u64 {
        u64::from(self.north - self.south) * u64::from(self.east - self.west)
    }

    /// Place of a load module in row-major order, if the file holds it.
    pub fn index_of(&self, row: u32, col: u32) -> Option<usize> {
        let inside = self.south <= row && row < self.north && self.west <= col && col < self.east;
        inside.then(|| (row - self.south) as usize * (self.east - self.west) as usize + (col - self.west) as usize)
    }

    /// The header at the start of a file of `file_bytes` bytes, of which `file` is the beginning, and its length.
    pub(crate) fn parse(file: &[u8], file_bytes: u64) -> Result<(Self, usize), ReadError> {
        let mut cursor = Cursor::new(file, 0, Section::Header);
        let version = check_start(&mut cursor)?;
        let offset = cursor.offset();
        let level_count = cursor.u16()?;
        let header_length = cursor.u32()?;
        let lengths = (FIXED_HEADER_BYTES as i64 + 4, i64::from(HEADER_BYTES_MAX));
        cursor.within(offset + 2, "header length", i64::from(header_length), lengths)?;
        let header_length = header_length as usize;
        let file_length = cursor.u64()?;
        let bytes = file.get(..header_length).ok_or(ReadError::Truncated {
            section: Section::Header,
            offset: 0,
            found: file.len() as u64,
            expected: header_length as u64,
        })?;
        check_section(bytes, 0, Section::Header)?;
        cursor.within(offset, "level count", i64::from(level_count), (1, i64::from(LEVELS_MAX)))?;
        let header = Self::parse_fields(version, level_count, Cursor::new(bytes, 0, Section::Header))?;
        if file_bytes == file_length {
            return Ok((header, header_length));
        }
        Err(ReadError::WrongLength { found: file_bytes, expected: file_length })
    }

    /// All after the lengths, up to the end of the header.
    fn parse_fields(version: u16, level_count: u16, mut cursor: Cursor) -> Result<Self, ReadError> {
        cursor.take(12)?;
        let length = cursor.u32()?;
        cursor.take(8)?;
        let (tile_row, tile_col) = (cursor.u32()?, cursor.u32()?);
        let (area_rows, area_cols) = (cursor.u32()?, cursor.u32()?);
        let (south, north) = read_range(&mut cursor, area_rows, ["south", "north"])?;
        let (west, east) = read_range(&mut cursor, area_cols, ["west", "east"])?;
        let (side, side_cells, spacing_sixteenths) = read_side(&mut cursor)?;
        let count_max = i64::from(AREA_CELLS_MAX / side_cells);
        cursor.within(32, "area rows", i64::from(area_rows), (1, count_max))?;
        cursor.within(36, "area columns", i64::from(area_cols), (1, count_max))?;
        cursor.expect_u32("quanta per metre", QUANTA_PER_METRE)?;
        let origin_m = [read_origin(&mut cursor, "origin east")?, read_origin(&mut cursor, "origin north")?];
        let (crs_length, datum_length) = (cursor.u16()?, cursor.u16()?);
        let fingerprint = cursor.array()?;
        let crs = cursor.text(crs_length, "crs")?;
        let vertical_datum = cursor.text(datum_length, "vertical datum")?;
        cursor.padding()?;
        cursor.checksum()?;
        cursor.expect(12, "header length", i64::from(length), cursor.offset() as i64)?;
        Ok(Self {
            version,
            level_count,
            tile_row,
            tile_col,
            area_rows,
            area_cols,
            south,
            west,
            north,
            east,
            side,
            side_cells,
            spacing_sixteenths,
            origin_m,
            crs,
            vertical_datum,
            fingerprint,
        })
    }
}

/// Magic and version: what must be right before anything else can be understood.
fn check_start(cursor: &mut Cursor) -> Result<u16, ReadError> {
    let found = cursor.array()?;
    if found != MAGIC {
        return Err(ReadError::NotALoadModuleFile { found });
    }
    let found = cursor.u16()?;
    if !(VERSION_OF_GROUND..=VERSION).contains(&found) {
        return Err(ReadError::UnsupportedVersion { found, newest: VERSION });
    }
    Ok(found)
}

/// A half-open, non-empty range of rows or columns of load modules inside the area.
fn read_range(cursor: &mut Cursor, count: u32, [low, high]: [&'static str; 2]) -> Result<(u32, u32), ReadError> {
    let offset = cursor.offset();
    let (first, end) = (cursor.u32()?, cursor.u32()?);
    cursor.within(offset + 4, high, i64::from(end), (1, i64::from(count)))?;
    cursor.within(offset, low, i64::from(first), (0, i64::from(end) - 1))?;
    Ok((first, end))
}

/// One coordinate of the area's south-west corner.
fn read_origin(cursor: &mut Cursor, field: &'static str) -> Result<f64, ReadError> {
    let offset = cursor.offset();
    let metres = cursor.metres(field)?;
    let limit = ORIGIN_M_MAX as i64;
    // In whole metres for the message; what is too large for that becomes the largest number there is.
    let outwards = if metres < 0.0 { metres.floor() } else { metres.ceil() };
    cursor.within(offset, field, outwards as i64, (-limit, limit))?;
    Ok(metres)
}

/// Side in quanta, side in cells, spacing: three numbers of which the first follows from the others.
fn read_side(cursor: &mut Cursor) -> Result<(u16, u32, u32), ReadError> {
    let offset = cursor.offset();
    let (side, cells, sixteenths) = (cursor.u32()?, cursor.u32()?, cursor.u32()?);
    cursor.within(offset, "side", i64::from(side), (1, i64::from(u16::MAX)))?;
    cursor.within(offset + 4, "side in cells", i64::from(cells), (1, i64::from(u16::MAX)))?;
    cursor.within(offset + 8, "spacing", i64::from(sixteenths), (1, i64::from(u16::MAX)))?;
    let expected = i64::from(cells) * i64::from(sixteenths) * i64::from(QUANTA_PER_METRE / 16);
    cursor.expect(offset, "side", i64::from(side), expected)?;
    // In range, as checked above.
    Ok((side as u16, cells, sixteenths))
}
