//! GeoTIFF files in: opened and judged at once, decoded strip by strip or tile by tile on the caller's threads.
//!
//! [`GeoTiff::open`] reads the directory only. [`GeoTiff::decode`] is called with disjoint lists of chunks from any
//! number of threads, each with a file handle of its own, and [`GeoTiff::assemble`] puts the chunks of a window
//! together, southern row first.

use std::io::{BufReader, ErrorKind, Read, Seek, SeekFrom};
use std::path::Path;

use terrain::PostRect;
use tiff::decoder::{Decoder, DecodingResult, Limits};
use tiff::tags::Tag;
use tiff::{TiffError, TiffResult};

use crate::chunk::{Chunk, Header};
use crate::crs::{Crs, GeoKeys};
use crate::directory::{Layout, read_layout};
use crate::frame::{GeoTags, RasterFrame, SampleScale};
use crate::limits::{CHUNK_BYTES_MAX, DIRECTORIES_MAX};
use crate::samples::Samples;
use crate::store::{Handle, Store};
use crate::unpacked::{self, Packing, Promise};
use crate::{Raster, SourceError};

const GDAL_METADATA: Tag = Tag::Unknown(42112);

/// A GeoTIFF whose directory was read and found good; nothing is decoded yet.
#[derive(Clone, Debug)]
pub struct GeoTiff {
    store: Store,
    frame: RasterFrame,
    scale: SampleScale,
    layout: Layout,
    nodata: Option<f64>,
    /// Whether the first stored row is the southern one. Nearly always it is the northern one.
    south_first: bool,
    /// Where each chunk begins in the file, and its bytes; 0 where the writer left out a chunk that is all void.
    chunks: Vec<(u64, u64)>,
    vertical_datum: Option<String>,
}

impl GeoTiff {
    /// Opens the file at `path`, which is in a projected system in metres with an EPSG code, and reads its directory.
    /// `height_unit_m` (metres in a unit of height) overrides what the file says.
    ///
    /// # Errors
    /// Whatever makes it unusable: not a TIFF, broken, too large, or of a kind that is not supported.
    pub fn open(path: &Path, height_unit_m: Option<f64>) -> Result<Self, SourceError> {
        let file = Self::read_directory(&Store::plain(path)?, height_unit_m, |own| named(path, own))?;
        file.frame.require_metres()?;
        Ok(file)
    }

    /// Reads the directory; `crs` judges what the file says of its system.
    pub(crate) fn read_directory(
        store: &Store,
        height_unit_m: Option<f64>,
        crs: impl FnOnce(Option<Result<Crs, String>>) -> Result<Crs, SourceError>,
    ) -> Result<Self, SourceError> {
        let path = store.path();
        let mut file = store.handle()?;
        let layout = read_layout(store, &mut file)?;
        let mut decoder = decoder(path, file)?;
        refuse_masks(path, &mut decoder)?;
        let tags = geo_tags(path, &mut decoder)?;
        let (crs, axes) = (crs(tags.keys.crs())?, tags.axes(path)?);
        let scale = tags.sample_scale(path, height_unit_m, crs.vertical_unit_m())?;
        let (frame, south_first) = RasterFrame::new(path, crs, &axes, layout.cols, layout.rows)?;
        let nodata = nodata(path, &mut decoder)?;
        let chunks = chunks(path, &mut decoder, &layout, store.len())?;
        let vertical_datum = tags.vertical_datum().or(frame.crs.vertical_datum().map(str::to_owned));
        Ok(Self { store: store.clone(), frame, scale, layout, nodata, south_first, chunks, vertical_datum })
    }

    /// Where its posts lie.
    pub fn frame(&self) -> &RasterFrame {
        &self.frame
    }

    /// What its samples mean.
    pub fn sample_scale(&self) -> SampleScale {
        self.scale
    }

    /// All its posts.
    pub fn rect(&self) -> PostRect {
        PostRect::of_size(self.layout.rows as usize, self.layout.cols as usize)
    }

    /// The strips or tiles that hold posts of `window`, in file order.
    pub(crate) fn chunks_of(&self, window: PostRect) -> Vec<u32> {
        let Some(cut) = self.rect().intersection(&window) else { return Vec::new() };
        let layout = &self.layout;
        let stored = |row: i32| if self.south_first { row as u32 } else { layout.rows - 1 - row as u32 };
        let (first, last) = (stored(cut.south).min(stored(cut.north)), stored(cut.south).max(stored(cut.north)));
        let (west, east) = (cut.west as u32 / layout.chunk_cols, cut.east as u32 / layout.chunk_cols);
        let down = first / layout.chunk_rows..=last / layout.chunk_rows;
        down.flat_map(|down| (west..=east).map(move |across| down * layout.chunks_across() + across)).collect()
    }

    /// Posts of a strip or tile, padding left out.
    pub(crate) fn posts_of(&self, chunk: u32) -> PostRect {
        let layout = &self.layout;
        let (down, across) = (chunk / layout.chunks_across(), chunk % layout.chunks_across());
        let (first_row, west) = (down * layout.chunk_rows, across * layout.chunk_cols);
        let last_row = (first_row + layout.chunk_rows).min(layout.rows) - 1;
        let east = (west + layout.chunk_cols).min(layout.cols) - 1;
        let flipped = |row: u32| if self.south_first { row } else { layout.rows - 1 - row } as i32;
        let (south, north) = (flipped(first_row).min(flipped(last_row)), flipped(first_row).max(flipped(last_row)));
        PostRect { south, west: west as i32, north, east: east as i32 }
    }

    pub(crate) fn header(&self) -> Header {
        let kind = self.layout.sample;
        Header { frame: self.frame.clone(), scale: self.scale, kind, nodata: self.nodata, shift: None }
    }

    pub(crate) fn vertical_datum(&self) -> Option<String> {
        self.vertical_datum.clone()
    }

    /// Decodes some strips or tiles. May be called from several threads at once.
    ///
    /// # Errors
    /// When the file is gone, or a chunk cannot be decoded.
    pub(crate) fn decode(&self, chunks: &[u32]) -> Result<Vec<Chunk>, SourceError> {
        let mut decoder = self.decoder()?;
        chunks.iter().map(|&index| self.decode_with(&mut decoder, index)).collect()
    }

    /// A decoder of its own: it reads the directory once, for any number of chunks.
    pub(crate) fn decoder(&self) -> Result<FileDecoder, SourceError> {
        decoder(&self.frame.path, self.store.handle()?)
    }

    pub(crate) fn decode_with(&self, decoder: &mut FileDecoder, index: u32) -> Result<Chunk, SourceError> {
        let (stride, south_first) = (self.layout.chunk_cols as usize, self.south_first);
        let chunk = |samples| Chunk { posts: self.posts_of(index), stride, south_first, samples, notes: Vec::new() };
        let (offset, size) = self.chunks[index as usize];
        if size == 0 {
            return Ok(chunk(None));
        }
        self.check_unpacked(index, decoder.inner().get_mut(), (offset, size))?;
        let samples = self.decode_one(decoder, index).map_err(|error| error.to_string());
        let samples = samples.and_then(|samples| self.as_promised(index, samples));
        let samples = samples.map_err(|reason| self.chunk_error(index, reason))?;
        Ok(chunk(Some(samples)))
    }

    /// Refuses a packed chunk that does not unpack to its rows.
    fn check_unpacked(&self, index: u32, file: &mut Handle, (offset, size): (u64, u64)) -> Result<(), SourceError> {
        let layout = &self.layout;
        if layout.packing == Packing::None {
            return Ok(());
        }
        let row = u64::from(layout.chunk_cols) * layout.sample.bytes();
        let promise = Promise { row, least: layout.rows_of(index) * row, most: u64::from(layout.chunk_rows) * row };
        file.seek(SeekFrom::Start(offset)).map_err(|source| self.store.stopped(source))?;
        let checked = unpacked::check(layout.packing, file.take(size), promise);
        checked.map_err(|reason| self.chunk_error(index, reason))
    }

    /// Decodes whole rows, padding included. Asked to leave the padding out, the decoder reads row by row, which is
    /// slower and at times loses the end of an LZW stream.
    fn decode_one(&self, decoder: &mut FileDecoder, index: u32) -> TiffResult<DecodingResult> {
        let mut samples = DecodingResult::U8(Vec::new());
        let row_bytes = u64::from(self.layout.chunk_cols) * self.layout.sample.bytes();
        decoder.read_chunk_to_buffer(&mut samples, index, row_bytes as usize)?;
        Ok(samples)
    }

    /// The decoder reads the directory for itself. Should it ever see other sizes there than we did, or the file have
    /// been replaced in between, it ends here.
    fn as_promised(&self, index: u32, decoded: DecodingResult) -> Result<Samples, String> {
        let expected = (self.layout.sample, self.posts_of(index).posts_high() * self.layout.chunk_cols as usize);
        let samples = samples_in(decoded).ok_or("it holds samples of a kind that is not read")?;
        match (samples.kind(), samples.count()) {
            found if found == expected => Ok(samples),
            found => Err(format!("it holds {found:?} samples, expected {expected:?}")),
        }
    }

    fn chunk_error(&self, chunk: u32, reason: String) -> SourceError {
        let chunks = self.layout.chunk_count();
        SourceError::BrokenChunk { path: self.frame.path.clone(), chunk, chunks, reason }
    }

    /// Puts the chunks of `window` together.
    ///
    /// # Errors
    /// When a height is infinite or beyond the limit.
    ///
    /// # Panics
    /// When `window` is not inside the raster or a chunk of it is missing.
    pub(crate) fn assemble(&self, window: PostRect, chunks: Vec<Chunk>) -> Result<Raster, SourceError> {
        assert!(self.rect().contains_rect(&window), "a window lies inside the raster");
        Raster::assemble(&self.header(), window, chunks)
    }

    /// Decodes and assembles the posts of `window` in this thread.
    ///
    /// # Errors
    /// When the file is gone, a chunk cannot be decoded, or a height is infinite or beyond the limit.
    pub fn read(&self, window: PostRect) -> Result<Raster, SourceError> {
        self.assemble(window, self.decode(&self.chunks_of(window))?)
    }
}

/// The system that the file names, by a code of its own.
fn named(path: &Path, own: Option<Result<Crs, String>>) -> Result<Crs, SourceError> {
    let path = || path.into();
    let crs = own.ok_or_else(|| SourceError::NoCrs { path: path() })?;
    let crs = crs.map_err(|found| SourceError::UnnamedCrs { path: path(), found })?;
    match crs.epsg() {
        Some(_) => Ok(crs),
        None => Err(SourceError::UnnamedCrs { path: path(), found: "defined by the file".into() }),
    }
}

/// Decoded samples; `None` for kinds that are not read.
fn samples_in(decoded: DecodingResult) -> Option<Samples> {
    match decoded {
        DecodingResult::U8(samples) => Some(Samples::U8(samples)),
        DecodingResult::U16(samples) => Some(Samples::U16(samples)),
        DecodingResult::I16(samples) => Some(Samples::I16(samples)),
        DecodingResult::I32(samples) => Some(Samples::I32(samples)),
        DecodingResult::F32(samples) => Some(Samples::F32(samples)),
        DecodingResult::F64(samples) => Some(Samples::F64(samples)),
        _ => None,
    }
}

/// The library's decoder on one open source.
pub(crate) type FileDecoder = Decoder<BufReader<Handle>>;

pub(crate) fn decoder(path: &Path, file: Handle) -> Result<FileDecoder, SourceError> {
    let mut limits = Limits::default();
    limits.decoding_buffer_size = CHUNK_BYTES_MAX as usize;
    limits.intermediate_buffer_size = CHUNK_BYTES_MAX as usize;
    // `read_layout` reads the same handle, and a decoder starts where the handle stands.
    let mut reader = BufReader::new(file);
    reader.rewind().map_err(|source| SourceError::Read { path: path.into(), source })?;
    let decoder = Decoder::new(reader).map_err(|error| directory_error(path, error))?;
    Ok(decoder.with_limits(limits))
}

pub(crate) fn directory_error(path: &Path, error: TiffError) -> SourceError {
    let path = path.into();
    match error {
        TiffError::IoError(source) if source.kind() != ErrorKind::UnexpectedEof => SourceError::Read { path, source },
        TiffError::UnsupportedError(error) => SourceError::TiffFeature { path, found: error.to_string() },
        error => SourceError::Malformed {
            path,
            what: "the directory".into(),
            found: error.to_string(),
            expected: "a sound one".into(),
        },
    }
}

/// Refuses a file whose first directory is an overview or whose voids are in a mask of their own, which would
/// otherwise be read as ground.
fn refuse_masks(path: &Path, decoder: &mut FileDecoder) -> Result<(), SourceError> {
    const REDUCED: u32 = 1;
    const MASK: u32 = 4;
    let error = |error| directory_error(path, error);
    let first: u32 = decoder.find_tag_unsigned(Tag::NewSubfileType).map_err(error)?.unwrap_or(0);
    if first & (REDUCED | MASK) != 0 {
        return Err(SourceError::NotFullRaster { path: path.into() });
    }
    let mut next = decoder.image_ifd().directory().next();
    for _ in 0..DIRECTORIES_MAX {
        let Some(pointer) = next else { break };
        let directory = decoder.read_directory(pointer).map_err(error)?;
        let mut tags = decoder.read_directory_tags(&directory);
        if tags.find_tag_unsigned::<u32>(Tag::NewSubfileType).map_err(error)?.unwrap_or(0) & MASK != 0 {
            return Err(SourceError::InternalMask { path: path.into() });
        }
        next = directory.next();
    }
    Ok(())
}

pub(crate) fn geo_tags(path: &Path, decoder: &mut FileDecoder) -> Result<GeoTags, SourceError> {
    let mut value = |tag| decoder.find_tag(tag).map_err(|error| directory_error(path, error));
    let doubles = |value: Option<tiff::decoder::ifd::Value>| {
        value.map(|value| value.into_f64_vec()).transpose().map_err(|error| directory_error(path, error))
    };
    let error = |error| directory_error(path, error);
    let keys = value(Tag::GeoKeyDirectoryTag)?.map(|value| value.into_u16_vec()).transpose().map_err(error)?;
    let key_doubles = doubles(value(Tag::GeoDoubleParamsTag)?)?;
    let key_texts = value(Tag::GeoAsciiParamsTag)?.map(|value| value.into_string()).transpose().map_err(error)?;
    let metadata = value(GDAL_METADATA)?.map(|value| value.into_string()).transpose().map_err(error)?;
    Ok(GeoTags {
        pixel_scale: doubles(value(Tag::ModelPixelScaleTag)?)?,
        tie_points: doubles(value(Tag::ModelTiepointTag)?)?,
        transformation: doubles(value(Tag::ModelTransformationTag)?)?,
        keys: GeoKeys {
            directory: keys.unwrap_or_default(),
            doubles: key_doubles.unwrap_or_default(),
            texts: key_texts.unwrap_or_default(),
        },
        gdal_metadata: metadata,
    })
}

/// The value that marks a void post.
pub(crate) fn nodata(path: &Path, decoder: &mut FileDecoder) -> Result<Option<f64>, SourceError> {
    let value = decoder.find_tag(Tag::GdalNodata).map_err(|error| directory_error(path, error))?;
    let Some(value) = value else { return Ok(None) };
    let text = value.into_string().map_err(|error| directory_error(path, error))?;
    let text = text.trim_matches(['\0', ' ', '\n']);
    let number = text.parse().map_err(|_| SourceError::Malformed {
        path: path.into(),
        what: "the nodata tag".into(),
        found: format!("`{text}`"),
        expected: "a number".into(),
    });
    number.map(Some)
}

/// Where each chunk begins and its bytes, once all are known to lie inside the file.
fn chunks(
    path: &Path,
    decoder: &mut FileDecoder,
    layout: &Layout,
    file_size: u64,
) -> Result<Vec<(u64, u64)>, SourceError> {
    let (offsets, sizes) = match layout.tiled {
        true => (Tag::TileOffsets, Tag::TileByteCounts),
        false => (Tag::StripOffsets, Tag::StripByteCounts),
    };
    let error = |error| directory_error(path, error);
    let offsets = decoder.get_tag_u64_vec(offsets).map_err(error)?;
    let sizes = decoder.get_tag_u64_vec(sizes).map_err(error)?;
    let chunks = layout.chunk_count() as usize;
    if offsets.len() != chunks || sizes.len() != chunks {
        return Err(SourceError::Malformed {
            path: path.into(),
            what: "the table of strips or tiles".into(),
            found: format!("{} offsets and {} lengths", offsets.len(), sizes.len()),
            expected: format!("{chunks} of each"),
        });
    }
    let chunks: Vec<(u64, u64)> = offsets.into_iter().zip(sizes).collect();
    for (chunk, &place) in chunks.iter().enumerate() {
        check_chunk(path, layout, chunk as u32, place, file_size)?;
    }
    Ok(chunks)
}

fn check_chunk(
    path: &Path,
    layout: &Layout,
    chunk: u32,
    (offset, size): (u64, u64),
    file_size: u64,
) -> Result<(), SourceError> {
    let end = offset.saturating_add(size);
    if file_size < end {
        let what = format!("strip or tile {chunk} of {}", layout.chunk_count());
        return Err(SourceError::Truncated { path: path.into(), what, expected: end, found: file_size });
    }
    // The decoder takes as many bytes as it needs, beyond the chunk's end if it must, and they would be another's.
    let needed = layout.rows_of(chunk) * u64::from(layout.chunk_cols) * layout.sample.bytes();
    if layout.packing == Packing::None && 0 < size && size < needed {
        return Err(SourceError::Malformed {
            path: path.into(),
            what: format!("the length of strip or tile {chunk}"),
            found: size.to_string(),
            expected: needed.to_string(),
        });
    }
    Ok(())
}
