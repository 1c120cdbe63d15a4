//! Esri's ASCII grid, and the header beside a raw grid, which is written in the same way.

use std::io::{BufRead, BufReader, Read};
use std::sync::{Arc, OnceLock};

use crate::SourceError;
use crate::chunk::{Chunk, Header};
use crate::directory::SampleKind;
use crate::frame::{Axes, SampleScale};
use crate::limits::POSTS_A_SIDE_MAX;
use crate::rows::{RowChunks, Rows};
use crate::samples::Samples;
use crate::store::{Handle, Store};

/// Keys and values of a header, keys in lower case, in the order of the file.
pub(crate) struct Keys<'a> {
    store: &'a Store,
    pairs: Vec<(String, String)>,
}

/// Longest header there is, and longest number in a grid.
const HEADER_BYTES_MAX: u64 = 1 << 14;
const NUMBER_BYTES_MAX: u64 = 64;
/// What the format takes for a void where the header does not say.
const VOID: f64 = -9999.0;

/// Whether a file begins like a header.
pub(crate) fn begins_like_one(start: &[u8]) -> bool {
    let text = String::from_utf8_lossy(start).to_ascii_lowercase();
    let word = text.trim_start_matches('\u{feff}').split_whitespace().next().unwrap_or_default().to_owned();
    const FIRST: [&str; 12] = [
        "ncols",
        "nrows",
        "xllcorner",
        "xllcenter",
        "yllcorner",
        "yllcenter",
        "cellsize",
        "nodata_value",
        "byteorder",
        "layout",
        "nbands",
        "nbits",
    ];
    FIRST.contains(&word.as_str())
}

impl<'a> Keys<'a> {
    /// The lines of `store` that hold a word and a value, up to the first line that begins with a number; and how
    /// many bytes they take.
    pub(crate) fn read(store: &'a Store) -> Result<(Self, u64), SourceError> {
        let mut reader = BufReader::new(store.handle()?).take(HEADER_BYTES_MAX);
        let (mut pairs, mut bytes) = (Vec::new(), 0);
        let mut line = Vec::new();
        while reader.read_until(b'\n', &mut line).map_err(|source| store.stopped(source))? != 0 {
            let text = String::from_utf8_lossy(&line).into_owned();
            let mut words = text.trim_start_matches('\u{feff}').split_whitespace();
            match (words.next(), words.next()) {
                (Some(key), _) if key.starts_with(|c: char| c.is_ascii_digit() || "-+.".contains(c)) => break,
                (Some(key), value) => pairs.push((key.to_lowercase(), value.unwrap_or_default().to_owned())),
                (None, _) => {}
            }
            bytes += line.len() as u64;
            line.clear();
        }
        Ok((Self { store, pairs }, bytes))
    }

    fn text(&self, key: &str) -> Option<&str> {
        self.pairs.iter().find(|(known, _)| known == key).map(|(_, value)| value.as_str())
    }

    fn number(&self, key: &str) -> Result<Option<f64>, SourceError> {
        let Some(text) = self.text(key) else { return Ok(None) };
        let number = text.parse().ok().filter(|number: &f64| !number.is_infinite());
        number.map(Some).ok_or_else(|| self.store.malformed(key, format!("`{text}`"), "a number"))
    }

    fn whole(&self, key: &str) -> Result<Option<u64>, SourceError> {
        let Some(text) = self.text(key) else { return Ok(None) };
        text.parse().map(Some).map_err(|_| self.store.malformed(key, format!("`{text}`"), "a whole number"))
    }

    fn side(&self, key: &str) -> Result<u32, SourceError> {
        let path = || self.store.path().into();
        let posts = self.whole(key)?.filter(|&posts| 0 < posts);
        let posts = posts.ok_or_else(|| self.store.malformed(key, "missing or 0".into(), "a positive number"))?;
        match posts <= POSTS_A_SIDE_MAX {
            true => Ok(posts as u32),
            false => {
                Err(SourceError::TooLarge { path: path(), what: "posts a side", found: posts, limit: POSTS_A_SIDE_MAX })
            }
        }
    }

    pub(crate) fn size(&self) -> Result<(u32, u32), SourceError> {
        let (cols, rows) = (self.side("ncols")?, self.side("nrows")?);
        let (found, limit) = (u64::from(cols) * u64::from(rows), crate::limits::POSTS_MAX);
        match found <= limit {
            true => Ok((cols, rows)),
            false => Err(SourceError::TooLarge { path: self.store.path().into(), what: "posts", found, limit }),
        }
    }

    /// Places of the posts, the northern row first.
    pub(crate) fn axes(&self) -> Result<Axes, SourceError> {
        let (_, rows) = self.size()?;
        let cell = self.number("cellsize")?;
        let step = |keys: [&str; 2]| -> Result<Option<f64>, SourceError> {
            let own = keys.into_iter().map(|key| self.number(key)).collect::<Result<Vec<_>, _>>()?;
            Ok(own.into_iter().flatten().next().or(cell))
        };
        let missing = || SourceError::NoPosition { path: self.store.path().into() };
        let dx = step(["dx", "xdim"])?.ok_or_else(missing)?;
        let dy = step(["dy", "ydim"])?.ok_or_else(missing)?;
        let first_row_north = |south: f64| south + f64::from(rows - 1) * dy;
        let east = match (self.number("xllcorner")?, self.number("xllcenter")?, self.number("ulxmap")?) {
            (Some(corner), _, _) => corner + 0.5 * dx,
            (_, Some(centre), _) | (_, _, Some(centre)) => centre,
            _ => return Err(missing()),
        };
        let north = match (self.number("yllcorner")?, self.number("yllcenter")?, self.number("ulymap")?) {
            (Some(corner), _, _) => first_row_north(corner + 0.5 * dy),
            (_, Some(centre), _) => first_row_north(centre),
            (_, _, Some(centre)) => centre,
            _ => return Err(missing()),
        };
        Axes { first: [east, north], step: [dx, -dy] }.checked(self.store.path())
    }

    fn nodata(&self) -> Result<Option<f64>, SourceError> {
        Ok(self.number("nodata_value")?.or(self.number("nodata")?))
    }

    /// Whether it describes numbers in another file.
    pub(crate) fn is_of_raw(&self) -> bool {
        ["byteorder", "nbits", "layout", "pixeltype"].iter().any(|key| self.text(key).is_some())
    }

    /// The rows in `data` that this header describes.
    pub(crate) fn rows(&self, data: &Store) -> Result<Rows, SourceError> {
        let (cols, rows) = self.size()?;
        let layout = self.text("layout").map(str::to_lowercase);
        let bands = self.whole("nbands")?.unwrap_or(1);
        if bands != 1 {
            return Err(SourceError::Bands { path: data.path().into(), found: bands });
        }
        if layout.as_deref().is_some_and(|layout| !matches!(layout, "bil" | "bip" | "bsq")) {
            let found = layout.unwrap_or_default();
            return Err(self.store.malformed("layout", found, "BIL, BIP or BSQ"));
        }
        let kind = self.kind()?;
        let wide = u64::from(cols) * kind.bytes();
        let row_bytes = self.whole("totalrowbytes")?.or(self.whole("bandrowbytes")?).unwrap_or(wide);
        if row_bytes < wide {
            return Err(self.store.malformed("totalrowbytes", row_bytes.to_string(), &format!("at least {wide}")));
        }
        let order = self.text("byteorder").unwrap_or("i").to_lowercase();
        let big_endian = match order.as_str() {
            "i" | "lsbfirst" | "vms" => false,
            "m" | "msbfirst" => true,
            _ => return Err(self.store.malformed("byteorder", order, "LSBFIRST, MSBFIRST, I or M")),
        };
        let skipped = self.whole("skipbytes")?.unwrap_or(0);
        let nodata = self.nodata()?;
        let found = Rows { store: data.clone(), cols, rows, skipped, row_bytes, kind, big_endian, nodata };
        found.check()?;
        Ok(found)
    }

    /// GridFloat has no key for its type; the others give bits and kind.
    fn kind(&self) -> Result<SampleKind, SourceError> {
        let bits = self.whole("nbits")?;
        let pixel = self.text("pixeltype").unwrap_or_default().to_lowercase();
        match (bits, pixel.as_str()) {
            (None, "" | "float") | (Some(32), "float") => Ok(SampleKind::F32),
            (Some(64), "float") => Ok(SampleKind::F64),
            (Some(8), "" | "unsignedint") => Ok(SampleKind::U8),
            (Some(16), "unsignedint") => Ok(SampleKind::U16),
            (Some(16), "" | "signedint") => Ok(SampleKind::I16),
            (Some(32), "" | "signedint") => Ok(SampleKind::I32),
            (bits, pixel) => {
                let found = format!("{} bits, pixeltype `{pixel}`", bits.map_or("no".into(), |bits| bits.to_string()));
                Err(SourceError::SampleFormat { path: self.store.path().into(), found })
            }
        }
    }
}

/// An ASCII grid whose header was read.
#[derive(Clone, Debug)]
pub(crate) struct AsciiGrid {
    store: Store,
    cols: u32,
    rows: u32,
    nodata: f64,
    header_bytes: u64,
    /// Byte at which each chunk of rows begins, once the numbers before it are counted.
    starts: Arc<OnceLock<Vec<u64>>>,
}

/// Posts decoded at once, about.
const CHUNK_POSTS: u32 = 1 << 18;

impl AsciiGrid {
    pub(crate) fn open(store: &Store) -> Result<(Self, Axes), SourceError> {
        let (keys, header_bytes) = Keys::read(store)?;
        let (cols, rows) = keys.size()?;
        let nodata = keys.nodata()?.unwrap_or(VOID);
        // Two bytes a post is the least that text can take, so a small file cannot ask for a large raster.
        store.holds("the last number", header_bytes.saturating_add(2 * u64::from(cols) * u64::from(rows) - 1))?;
        let starts = Arc::default();
        Ok((Self { store: store.clone(), cols, rows, nodata, header_bytes, starts }, keys.axes()?))
    }

    pub(crate) fn size(&self) -> (u32, u32) {
        (self.cols, self.rows)
    }

    pub(crate) fn header(&self, frame: crate::RasterFrame, unit_m: f64) -> Header {
        let scale = SampleScale { unit_m, ..SampleScale::METRES };
        Header { frame, scale, kind: SampleKind::F32, nodata: Some(self.nodata), shift: None }
    }

    fn rows_per_chunk(&self) -> u32 {
        (CHUNK_POSTS / self.cols).clamp(1, self.rows)
    }

    /// How its rows fall into chunks.
    pub(crate) fn chunks(&self) -> RowChunks {
        RowChunks { cols: self.cols, rows: self.rows, rows_per_chunk: self.rows_per_chunk() }
    }

    pub(crate) fn decode(&self, chunks: &[u32]) -> Result<Vec<Chunk>, SourceError> {
        chunks.iter().map(|&chunk| self.decode_rows(chunk)).collect()
    }

    fn reader_at(&self, byte: u64) -> Result<BufReader<Handle>, SourceError> {
        let mut handle = self.store.handle()?;
        std::io::Seek::seek(&mut handle, std::io::SeekFrom::Start(byte))
            .map_err(|source| self.store.stopped(source))?;
        Ok(BufReader::with_capacity(1 << 16, handle))
    }

    /// Where chunks begin: text cannot be read from the middle, so its numbers are counted once.
    fn starts(&self) -> Result<&[u64], SourceError> {
        if let Some(starts) = self.starts.get() {
            return Ok(starts);
        }
        let (count, per_chunk) =
            (u64::from(self.cols) * u64::from(self.rows), u64::from(self.cols) * u64::from(self.rows_per_chunk()));
        let mut reader = self.reader_at(self.header_bytes)?;
        let (mut starts, mut found, mut byte, mut word) = (vec![self.header_bytes], 0, self.header_bytes, Vec::new());
        while let Some(taken) = next_word(&mut reader, &mut word).map_err(|source| self.store.stopped(source))? {
            (found, byte) = (found + 1, byte + taken);
            if found % per_chunk == 0 && found < count {
                starts.push(byte);
            }
            if count < found {
                return Err(self.store.malformed("the grid", format!("more than {count} numbers"), &count.to_string()));
            }
        }
        if found != count {
            return Err(self.store.malformed("the grid", format!("{found} numbers"), &count.to_string()));
        }
        Ok(self.starts.get_or_init(|| starts))
    }

    pub(crate) fn decode_rows(&self, chunk: u32) -> Result<Chunk, SourceError> {
        let posts = self.chunks().posts_of(chunk);
        let mut reader = self.reader_at(self.starts()?[chunk as usize])?;
        let before = chunk as usize * self.rows_per_chunk() as usize * self.cols as usize;
        let mut samples: Vec<f32> = Vec::with_capacity(posts.post_count());
        let mut word = Vec::new();
        while samples.len() < posts.post_count() {
            let found = next_word(&mut reader, &mut word).map_err(|source| self.store.stopped(source))?;
            // What is not text is not a number either.
            let text = std::str::from_utf8(&word).unwrap_or("bytes that are no text");
            let number = text.parse::<f64>().ok().filter(|_| found.is_some());
            samples.push(number.ok_or_else(|| self.unexpected(before + samples.len(), text))? as f32);
        }
        let (stride, samples) = (self.cols as usize, Some(Samples::F32(samples)));
        Ok(Chunk { posts, stride, south_first: false, samples, notes: Vec::new() })
    }

    fn unexpected(&self, place: usize, text: &str) -> SourceError {
        let (row, col) = (place / self.cols as usize, place % self.cols as usize);
        let shown: String = text.chars().take(20).collect();
        self.store.malformed(&format!("number {col} of line {row}"), format!("`{shown}`"), "a number")
    }
}

/// Reads the next run of bytes that are not white space into `word`; returns the bytes it took, white space and all.
fn next_word(reader: &mut impl BufRead, word: &mut Vec<u8>) -> std::io::Result<Option<u64>> {
    word.clear();
    let mut read = 0;
    loop {
        let buffer = reader.fill_buf()?;
        if buffer.is_empty() {
            break;
        }
        let skipped = if word.is_empty() { buffer.iter().take_while(|b| b.is_ascii_whitespace()).count() } else { 0 };
        let rest = &buffer[skipped..];
        let taken = rest.iter().take_while(|b| !b.is_ascii_whitespace()).count();
        word.extend_from_slice(&rest[..taken]);
        let ended = taken < rest.len() && !word.is_empty();
        reader.consume(skipped + taken);
        read += (skipped + taken) as u64;
        if ended || NUMBER_BYTES_MAX < word.len() as u64 {
            break;
        }
    }
    Ok((!word.is_empty()).then_some(read))
}
