//! What every reader gives: a raster's header, and runs of its posts, decoded.

use terrain::PostRect;

use crate::RasterFrame;
use crate::directory::SampleKind;
use crate::frame::SampleScale;
use crate::samples::Samples;

/// All of a raster but its samples.
#[derive(Clone, Debug)]
pub(crate) struct Header {
    pub frame: RasterFrame,
    pub scale: SampleScale,
    pub kind: SampleKind,
    pub nodata: Option<f64>,
}

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
