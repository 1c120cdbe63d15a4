//! Files of any size, read by window: what is asked for is decoded then, and kept while there is room.
//!
//! Tiles that lie beside each other need the same strips of a raster, and are worked on one after the other, so a few
//! hundred megabytes of decoded chunks spare nearly all repeated decoding, however large the raster is.

use std::num::NonZeroUsize;
use std::sync::{Arc, Mutex};

use lru::LruCache;
use terrain::PostRect;

use crate::chunk::Chunk;
use crate::directory::SampleKind;
use crate::geotiff::FileDecoder;
use crate::kept::{Kept, locked};
use crate::samples::union;
use crate::{DemFile, Raster, Reach, SourceError};

/// Files that are read by window. Several threads may ask at once; none decodes what another is decoding.
#[derive(Debug)]
pub struct Windows {
    files: Vec<DemFile>,
    cache: ChunkCache,
}

impl Windows {
    /// Of some files, with room for `bytes_max` bytes of decoded samples.
    pub fn new(files: Vec<DemFile>, bytes_max: u64) -> Self {
        Self { files, cache: ChunkCache::new(bytes_max) }
    }

    /// The files, in the order given.
    pub fn files(&self) -> &[DemFile] {
        &self.files
    }

    pub(crate) fn files_mut(&mut self) -> &mut [DemFile] {
        &mut self.files
    }

    /// How many strips or tiles were decoded so far, counting each time.
    pub fn decoded(&self) -> u64 {
        self.cache.decoded()
    }

    /// The posts `window` of the file at place `index`.
    ///
    /// # Errors
    /// As [`DemFile::decode`] and [`DemFile::assemble`].
    ///
    /// # Panics
    /// When there is no such file, or `window` is not inside the raster.
    pub fn read(&self, index: usize, window: PostRect) -> Result<Raster, SourceError> {
        let file = &self.files[index];
        assert!(file.rect().contains_rect(&window), "a window lies inside the raster");
        let chunks = file.chunks_of(window).into_iter().map(|chunk| self.cache.chunk(file, index, chunk));
        Raster::assemble_shared(file.header(), window, &chunks.collect::<Result<Vec<_>, _>>()?)
    }
}

/// What a look at part of a file finds.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Look {
    /// Posts looked at.
    pub posts: usize,
    /// Those that are void.
    pub voids: usize,
    /// Where the first of them lies, for messages.
    pub first_void: Option<String>,
    /// Lowest and highest height in metres.
    pub range_m: Option<(f64, f64)>,
    /// The same of posts within a reach.
    pub reached_m: Option<(f64, f64)>,
    /// What a person should know about it.
    pub notes: Vec<String>,
}

impl Look {
    /// Adds what was found in the part that comes next.
    pub fn add(&mut self, mut other: Look) {
        self.posts += other.posts;
        self.voids += other.voids;
        self.first_void = self.first_void.take().or(other.first_void);
        let of_both = |ranges: [Option<(f64, f64)>; 2]| ranges.into_iter().flatten().reduce(union);
        self.range_m = of_both([self.range_m, other.range_m]);
        self.reached_m = of_both([self.reached_m, other.reached_m]);
        self.notes.append(&mut other.notes);
    }
}

impl DemFile {
    /// Looks at the posts of `window` in some of its chunks, one chunk at a time, and keeps nothing; `reach` is what to
    /// tell the range of, too.
    ///
    /// # Errors
    /// As [`DemFile::decode`] and [`DemFile::assemble`].
    pub fn look(&self, window: PostRect, reach: Option<&Reach>, chunks: &[u32]) -> Result<Look, SourceError> {
        let (mut look, mut kept) = (Look::default(), None);
        for &chunk in chunks {
            let Some(cut) = self.posts_of(chunk).intersection(&window) else { continue };
            let raster = self.assemble(cut, vec![self.decode_one(chunk, &mut kept)?])?;
            let first_void = raster.voids.iter().next().map(|index| raster.place(index));
            look.add(Look {
                posts: cut.post_count(),
                voids: raster.void_count(),
                first_void,
                range_m: raster.range_m(),
                reached_m: reach.and_then(|reach| raster.range_within_m(reach)),
                notes: raster.notes().to_vec(),
            });
        }
        Ok(look)
    }

    /// How many posts are exactly 0 m high as so many beside them in a row, as those of the sea are in most rasters.
    ///
    /// # Errors
    /// As [`DemFile::decode`] and [`DemFile::assemble`].
    pub fn posts_at_sea_level(&self) -> Result<usize, SourceError> {
        /// A plain of whole metres has shorter rows of posts at 0 m.
        const RUN_MIN: usize = 32;
        let (mut found, mut kept, mut row_m) = (0, None, Vec::new());
        for chunk in self.chunks_of(self.rect()) {
            let PostRect { south, west, north, east } = self.posts_of(chunk);
            let raster = self.assemble(self.posts_of(chunk), vec![self.decode_one(chunk, &mut kept)?])?;
            for row in south..=north {
                row_m.clear();
                raster.push_row_m(row, west..east + 1, &mut row_m);
                let runs = row_m.chunk_by(|a, b| (*a == 0.0) == (*b == 0.0));
                found += runs.filter(|run| run[0] == 0.0 && RUN_MIN <= run.len()).map(<[f64]>::len).sum::<usize>();
            }
        }
        Ok(found)
    }

    /// The name of the samples' type, where it is one of fractions.
    pub(crate) fn fractional(&self) -> Option<&'static str> {
        match self.header().kind {
            SampleKind::F32 => Some("32-bit floating point"),
            SampleKind::F64 => Some("64-bit floating point"),
            SampleKind::U8 | SampleKind::U16 | SampleKind::I16 | SampleKind::I32 => None,
        }
    }

    /// Whether a sample of `window` is no whole number; types that hold nothing else are not looked through.
    pub(crate) fn first_fraction(&self, window: PostRect) -> Result<bool, SourceError> {
        if self.fractional().is_none() {
            return Ok(false);
        }
        let mut kept = None;
        for chunk in self.chunks_of(window) {
            let samples = self.decode_one(chunk, &mut kept)?.samples;
            if samples.is_some_and(|samples| !samples.all_whole()) {
                return Ok(true);
            }
        }
        Ok(false)
    }

    /// Bytes that the posts of `window` take in memory, in the file's own type.
    pub fn bytes_of(&self, window: PostRect) -> u64 {
        window.post_count() as u64 * self.header().kind.bytes()
    }
}

/// Open files whose directory is kept read.
const DECODERS_MAX: usize = 32;

/// A file's place in the list it was given in, and a chunk of it.
type Key = (usize, u32);

/// Decoded chunks of any number of files.
struct ChunkCache {
    kept: Kept<Key, Chunk>,
    decoders: Mutex<LruCache<usize, Vec<FileDecoder>>>,
}

impl std::fmt::Debug for ChunkCache {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("ChunkCache").field("bytes_max", &self.kept.bytes_max()).finish_non_exhaustive()
    }
}

impl ChunkCache {
    /// With room for `bytes_max` bytes of samples, and one chunk in any case.
    pub(crate) fn new(bytes_max: u64) -> Self {
        let decoders = LruCache::new(NonZeroUsize::new(DECODERS_MAX).expect("32 is not 0"));
        Self { kept: Kept::new(bytes_max), decoders: Mutex::new(decoders) }
    }

    /// How often a chunk was decoded.
    pub(crate) fn decoded(&self) -> u64 {
        self.kept.decoded()
    }

    /// Chunk `chunk` of `file`, the one at place `index`.
    pub(crate) fn chunk(&self, file: &DemFile, index: usize, chunk: u32) -> Result<Arc<Chunk>, SourceError> {
        self.kept.get((index, chunk), || {
            let decoded = self.decode(file, index, chunk)?;
            let bytes = decoded.bytes();
            Ok((decoded, bytes))
        })
    }

    fn decode(&self, file: &DemFile, index: usize, chunk: u32) -> Result<Chunk, SourceError> {
        let mut kept = locked(&self.decoders).get_mut(&index).and_then(Vec::pop);
        let decoded = file.decode_one(chunk, &mut kept);
        if let Some(decoder) = kept {
            locked(&self.decoders).get_or_insert_mut(index, Vec::new).push(decoder);
        }
        decoded
    }
}
