//! A raster file of any format that is read, told by its content and never by its name's ending.

use std::path::Path;

use terrain::PostRect;

use crate::chunk::{Chunk, Header};
use crate::content::{RAW_ENDINGS, beside};
use crate::crs::Crs;
use crate::dted::{self, Dted};
use crate::error::{A_JOB, A_TEXT};
use crate::features::osm::frames::MARK as OSM_MARK;
use crate::frame::{Axes, Facts};
use crate::geotiff::{FileDecoder, GeoTiff};
use crate::rows::Rows;
use crate::store::Store;
use crate::text_grid::{self, AsciiGrid, Keys};
use crate::{DatumShift, Raster, RasterFrame, SampleScale, SourceError, hgt, shapefile, side_files};

/// How a file is to be read, where that is not as the file itself says.
#[derive(Clone, Debug)]
pub struct Reading {
    /// Its coordinate system, whatever the file says or leaves out.
    pub crs: Option<Crs>,
    /// Degrees east and north of the south-west post of an HGT tile whose name does not say.
    pub corner: Option<[f64; 2]>,
    /// Metres in a unit of height.
    pub height_unit_m: Option<f64>,
    /// The value that marks a void post.
    pub nodata: Option<f64>,
    /// Whether what could be warned about is an error.
    pub strict: bool,
}

impl Reading {
    /// Everything as the file says.
    pub const AS_IT_SAYS: Reading =
        Reading { crs: None, corner: None, height_unit_m: None, nodata: None, strict: false };

    /// What the system that is said here measures heights from, whatever the file says.
    fn vertical_datum(&self) -> Option<String> {
        self.crs.as_ref().and_then(Crs::vertical_datum).map(str::to_owned)
    }
}

/// A raster file whose headers were read and found good; no height is decoded yet.
#[derive(Clone, Debug)]
pub struct DemFile {
    header: Header,
    facts: Facts,
    reader: Reader,
}

#[derive(Clone, Debug)]
enum Reader {
    GeoTiff(Box<GeoTiff>),
    Dted(Dted),
    Rows(Rows),
    Ascii(AsciiGrid),
}

/// What a format's reader finds in a file, before the file is placed.
struct Found {
    reader: Reader,
    size: (u32, u32),
    axes: Axes,
    facts: Facts,
    crs: Option<Result<Crs, String>>,
}

impl DemFile {
    /// Opens the file at `path` and reads its headers.
    ///
    /// # Errors
    /// Whatever makes it unusable: a format that is not read, by name; broken, too large, or nowhere on Earth.
    pub fn open(path: &Path, reading: &Reading) -> Result<Self, SourceError> {
        let store = Store::open(path)?;
        let file = Self::of(&store, reading)?;
        side_files::check(path, file.header.nodata, file.header.scale)?;
        Ok(file)
    }

    fn of(store: &Store, reading: &Reading) -> Result<Self, SourceError> {
        let start = store.start(512)?;
        if matches!(start.get(..4), Some(b"II\x2a\0" | b"MM\0\x2a" | b"II\x2b\0" | b"MM\0\x2b")) {
            return Self::geotiff(store, reading);
        }
        let found = match dted::start(&start) {
            Some(at) => of_dted(store, at, reading)?,
            None if text_grid::begins_like_one(&start) => of_text(store)?,
            None => of_bare_rows(store, &start, reading)?,
        };
        found.placed(store, reading)
    }

    fn geotiff(store: &Store, reading: &Reading) -> Result<Self, SourceError> {
        let crs = |own| crs_of(store, own, reading);
        let tiff = GeoTiff::read_directory(store, reading.height_unit_m, crs)?;
        let mut header = tiff.header();
        header.nodata = reading.nodata.or(header.nodata);
        let vertical_datum = reading.vertical_datum().or(tiff.vertical_datum());
        let facts = Facts { format: "GeoTIFF", accuracy_m: None, vertical_datum };
        Ok(Self { header, facts, reader: Reader::GeoTiff(Box::new(tiff)) })
    }

    /// Where its posts lie.
    pub fn frame(&self) -> &RasterFrame {
        &self.header.frame
    }

    /// What its samples mean.
    pub fn sample_scale(&self) -> SampleScale {
        self.header.scale
    }

    /// Has a mosaic bring its heights to another datum.
    pub fn set_shift(&mut self, shift: Option<DatumShift>) {
        self.header.shift = shift;
    }

    /// The sample that marks a void post, where one does.
    pub fn nodata(&self) -> Option<f64> {
        self.header.nodata
    }

    /// The format's name.
    pub fn format(&self) -> &'static str {
        self.facts.format
    }

    /// The vertical accuracy that it states, in metres: nine of ten heights are at least as good.
    pub fn accuracy_m(&self) -> Option<f64> {
        self.facts.accuracy_m
    }

    /// What it says heights are measured from.
    pub fn vertical_datum(&self) -> Option<&str> {
        self.facts.vertical_datum.as_deref()
    }

    /// All its posts.
    pub fn rect(&self) -> PostRect {
        self.header.frame.rect()
    }

    /// The chunks that hold posts of `window`, in file order.
    pub fn chunks_of(&self, window: PostRect) -> Vec<u32> {
        let Some(cut) = self.rect().intersection(&window) else { return Vec::new() };
        match &self.reader {
            Reader::GeoTiff(tiff) => tiff.chunks_of(cut),
            Reader::Dted(dted) => dted.chunks_of(cut.west, cut.east).collect(),
            Reader::Rows(rows) => rows.chunks().holding(cut.south, cut.north).collect(),
            Reader::Ascii(grid) => grid.chunks().holding(cut.south, cut.north).collect(),
        }
    }

    /// The posts of one chunk.
    pub(crate) fn posts_of(&self, chunk: u32) -> PostRect {
        match &self.reader {
            Reader::GeoTiff(tiff) => tiff.posts_of(chunk),
            Reader::Dted(dted) => dted.posts_of(chunk),
            Reader::Rows(rows) => rows.chunks().posts_of(chunk),
            Reader::Ascii(grid) => grid.chunks().posts_of(chunk),
        }
    }

    /// Decodes one chunk with the decoder `kept`, which is made where the format needs one and there is none yet.
    pub(crate) fn decode_one(&self, chunk: u32, kept: &mut Option<FileDecoder>) -> Result<Chunk, SourceError> {
        match &self.reader {
            Reader::GeoTiff(tiff) => {
                let mut decoder = kept.take().map_or_else(|| tiff.decoder(), Ok)?;
                let decoded = tiff.decode_with(&mut decoder, chunk);
                *kept = Some(decoder);
                decoded
            }
            Reader::Dted(dted) => dted.decode(chunk),
            Reader::Rows(rows) => rows.decode(chunk),
            Reader::Ascii(grid) => grid.decode_rows(chunk),
        }
    }

    pub(crate) fn frame_mut(&mut self) -> &mut RasterFrame {
        &mut self.header.frame
    }

    pub(crate) fn header(&self) -> &Header {
        &self.header
    }

    /// Decodes some chunks. May be called from several threads at once.
    ///
    /// # Errors
    /// When the file is gone, or a chunk cannot be decoded.
    pub fn decode(&self, chunks: &[u32]) -> Result<Vec<Chunk>, SourceError> {
        match &self.reader {
            Reader::GeoTiff(tiff) => tiff.decode(chunks),
            Reader::Dted(dted) => chunks.iter().map(|&chunk| dted.decode(chunk)).collect(),
            Reader::Rows(rows) => chunks.iter().map(|&chunk| rows.decode(chunk)).collect(),
            // Text is read from its beginning, so all of it at once unless a part is asked for.
            Reader::Ascii(grid) => grid.decode(chunks),
        }
    }

    /// Puts the chunks of `window` together.
    ///
    /// # Errors
    /// When a height is infinite or beyond the limit.
    ///
    /// # Panics
    /// When `window` is not inside the raster or a chunk of it is missing.
    pub fn assemble(&self, window: PostRect, chunks: Vec<Chunk>) -> Result<Raster, SourceError> {
        assert!(self.rect().contains_rect(&window), "a window lies inside the raster");
        Raster::assemble(&self.header, window, chunks)
    }

    /// Decodes and assembles the posts of `window` in this thread.
    ///
    /// # Errors
    /// As [`DemFile::decode`] and [`DemFile::assemble`].
    pub fn read(&self, window: PostRect) -> Result<Raster, SourceError> {
        self.assemble(window, self.decode(&self.chunks_of(window))?)
    }
}

impl Found {
    fn placed(self, store: &Store, reading: &Reading) -> Result<DemFile, SourceError> {
        let (path, (cols, rows)) = (store.path(), self.size);
        let crs = crs_of(store, self.crs, reading)?;
        let unit_m = reading.height_unit_m.or(crs.vertical_unit_m()).unwrap_or(1.0);
        let (frame, _) = RasterFrame::new(path, crs, &self.axes, cols, rows)?;
        let mut header = match &self.reader {
            Reader::GeoTiff(tiff) => tiff.header(),
            Reader::Dted(dted) => dted.header(frame),
            Reader::Rows(rows) => rows.header(frame, unit_m),
            Reader::Ascii(grid) => grid.header(frame, unit_m),
        };
        header.nodata = reading.nodata.or(header.nodata);
        let of_crs = header.frame.crs.vertical_datum().map(str::to_owned);
        let vertical_datum = reading.vertical_datum().or(self.facts.vertical_datum).or(of_crs);
        Ok(DemFile { header, facts: Facts { vertical_datum, ..self.facts }, reader: self.reader })
    }
}

fn of_dted(store: &Store, at: u64, reading: &Reading) -> Result<Found, SourceError> {
    let dted::Opened { reader, axes, facts, crs } = Dted::open(store, at, reading.strict)?;
    let size = reader.size();
    Ok(Found { reader: Reader::Dted(reader), size, axes, facts, crs: Some(crs) })
}

/// An ASCII grid, or the header of a raw one, in whose place the raw file is meant.
fn of_text(store: &Store) -> Result<Found, SourceError> {
    let (keys, _) = Keys::read(store)?;
    if !keys.is_of_raw() {
        let (grid, axes) = AsciiGrid::open(store)?;
        let facts = Facts::of("Esri ASCII grid");
        return Ok(Found { size: grid.size(), reader: Reader::Ascii(grid), axes, facts, crs: None });
    }
    let data = (!store.is_packed()).then(|| beside(store.path(), &RAW_ENDINGS)).flatten();
    let data = data.ok_or_else(|| SourceError::HeaderAlone { path: store.path().into() })?;
    of_raw(&Store::plain(&data)?, &keys)
}

fn of_raw(data: &Store, keys: &Keys) -> Result<Found, SourceError> {
    let rows = keys.rows(data)?;
    let facts = Facts::of("raw grid with a header");
    Ok(Found { size: (rows.cols, rows.rows), reader: Reader::Rows(rows), axes: keys.axes()?, facts, crs: None })
}

/// Bytes without a mark of their own: described by a header beside them, or an HGT tile.
fn of_bare_rows(store: &Store, start: &[u8], reading: &Reading) -> Result<Found, SourceError> {
    if store.len() == 0 {
        return Err(SourceError::Empty { path: store.path().into() });
    }
    if let Some(found) = text_in(store.path(), start).or_else(|| known_but_not_read(start)) {
        return Err(SourceError::OtherFormat { path: store.path().into(), found });
    }
    if let Some(header) = (!store.is_packed()).then(|| beside(store.path(), &["hdr"])).flatten() {
        let header = Store::plain(&header)?;
        if text_grid::begins_like_one(&header.start(512)?) {
            return of_raw(store, &Keys::read(&header)?.0);
        }
    }
    let Some(rows) = hgt::rows(store) else {
        if hgt::is_named_so(store.name()) {
            let (path, found, expected) = (store.path().into(), store.len(), hgt::sizes_text());
            return Err(SourceError::NotHgtSize { path, found, expected });
        }
        let found = start.iter().take(8).map(|byte| format!("{byte:02x}")).collect::<Vec<_>>().join(" ");
        return Err(SourceError::UnknownFormat { path: store.path().into(), found });
    };
    let corner = reading.corner.or_else(|| hgt::corner_in(store.name()));
    let corner = corner.ok_or_else(|| SourceError::NoCorner { path: store.path().into() })?;
    // All that comes in this form, of SRTM and after it, is above that geoid.
    let (axes, facts) = (hgt::axes(&rows, corner), Facts { vertical_datum: Some("EGM96".into()), ..Facts::of("HGT") });
    Ok(Found { size: (rows.cols, rows.rows), reader: Reader::Rows(rows), axes, facts, crs: Some(Ok(Crs::wgs84())) })
}

/// The coordinate system: what the job says, else what the file says, else what a `.prj` beside it says.
pub(crate) fn crs_of(store: &Store, own: Option<Result<Crs, String>>, reading: &Reading) -> Result<Crs, SourceError> {
    if let Some(crs) = &reading.crs {
        return Ok(crs.clone());
    }
    let path = || store.path().to_owned();
    if let Some(own) = own {
        return own.map_err(|found| SourceError::UnnamedCrs { path: path(), found });
    }
    // A packed file's other name: `a.asc.gz` and `a.prj`.
    let names = [store.path().to_owned(), store.path().with_file_name(store.name())];
    let Some(prj) = names.iter().find_map(|name| beside(name, &["prj"])) else {
        return Err(SourceError::NoCrs { path: path() });
    };
    let text = Store::plain(&prj)?.start(1 << 16)?;
    let crs = Crs::from_wkt(&String::from_utf8_lossy(&text));
    crs.map_err(|found| SourceError::UnnamedCrs { path: prj, found })
}

/// Formats that people have heights in and that are not read, by how they begin.
pub(crate) fn known_but_not_read(start: &[u8]) -> Option<&'static str> {
    const MARKS: [(&[u8], &str); 14] = [
        (b"EHFA_HEADER_TAG", "an ERDAS Imagine file"),
        (b"\x89HDF\r\n", "an HDF5 or netCDF 4 file"),
        (b"CDF\x01", "a netCDF file"),
        (b"CDF\x02", "a netCDF file"),
        (b"NITF", "a NITF file"),
        (b"DSAA", "a Surfer grid"),
        (b"DSBB", "a Surfer grid"),
        (b"DSRB", "a Surfer grid"),
        (b"\x89PNG", "a PNG image"),
        (b"\xff\xd8\xff", "a JPEG image"),
        (b"\0\0\0\x0cjP  ", "a JPEG 2000 image"),
        (b"Lerc2 ", "a LERC raster"),
        (b"CntZImage ", "a LERC raster"),
        (b"SQLite format 3", "a database (GeoPackage or MBTiles)"),
    ];
    if let Some((_, name)) = MARKS.iter().find(|(mark, _)| start.starts_with(mark)) {
        return Some(name);
    }
    if start.starts_with(&shapefile::MARK) {
        return Some("a Shapefile of features, not a raster");
    }
    if start.get(4..).is_some_and(|start| start.starts_with(OSM_MARK)) {
        return Some("OpenStreetMap features, not a raster");
    }
    let text = String::from_utf8_lossy(start);
    let text = text.trim_start();
    if text.starts_with("<VRTDataset") {
        return Some("a GDAL virtual raster");
    }
    if text.starts_with('<') {
        return Some("a page of HTML or XML, not a raster");
    }
    if text.starts_with('{') {
        return Some("a JSON file, not a raster");
    }
    None
}

/// What a file is that begins as a text does, of no other kind that is known.
pub(crate) fn text_in(path: &Path, start: &[u8]) -> Option<&'static str> {
    // The last character may be cut off.
    let whole = std::str::from_utf8(start).map_or_else(|error| error.valid_up_to(), str::len);
    let text = std::str::from_utf8(&start[..whole]).unwrap_or_default();
    let is_text = start.len() < whole + 4 && !text.contains(|c: char| c.is_control() && !c.is_whitespace());
    let is_known = known_but_not_read(start).is_some();
    if text.trim().is_empty() || !is_text || is_known {
        return None;
    }
    let is_number = |word: &str| word.parse::<f64>().is_ok();
    let words: Vec<&str> = text.lines().next()?.split([' ', ',', ';', '\t']).filter(|word| !word.is_empty()).collect();
    // Fixed columns: the level of the DEM, and the code of its pattern.
    let code = |at: usize| text.get(at..at + 6).is_some_and(|word| matches!(word.trim(), "1" | "2" | "3" | "4"));
    Some(match () {
        () if path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("toml")) => A_JOB,
        () if code(144) && code(150) => "a USGS DEM",
        () if words.len() == 3 && words.iter().all(|word| is_number(word)) => "a list of heights (XYZ)",
        () => A_TEXT,
    })
}
