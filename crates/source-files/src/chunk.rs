//! What every reader gives: a raster's header, and runs of its posts, decoded.

use terrain::PostRect;

use crate::directory::SampleKind;
use crate::frame::SampleScale;
use crate::samples::Samples;
use crate::{DatumShift, RasterFrame};

/// All of a raster but its samples.
#[derive(Clone, Debug)]
pub(crate) struct Header {
    pub frame: RasterFrame,
    pub scale: SampleScale,
    pub kind: SampleKind,
    pub nodata: Option<f64>,
    /// How its heights become those above the datum that is wanted.
    pub shift: Option<DatumShift>,
}

/// Where the posts of a raster lie, what its samples are, and how they come to the datum that is wanted.
pub(crate) type Meaning<'a> = (&'a RasterFrame, (SampleScale, &'a Option<DatumShift>));

/// One strip or tile, or a run of rows or columns, decoded.
#[derive(Debug)]
pub struct Chunk {
    pub(crate) posts: PostRect,
    /// Samples from row to row, padding included.
    pub(crate) stride: usize,
    /// Whether its first row is the southern one.
    pub(crate) south_first: bool,
    /// `None` for a chunk that is not in the file and therefore void.
    pub(crate) samples: Option<Samples>,
    /// What a person should know about it.
    pub(crate) notes: Vec<String>,
}

impl Chunk {
    /// Bytes of memory that its samples take.
    pub(crate) fn bytes(&self) -> u64 {
        const BESIDES: u64 = 128;
        let samples = self.samples.as_ref().map_or(0, |samples| samples.count() as u64 * samples.kind().bytes());
        samples + BESIDES
    }
}
