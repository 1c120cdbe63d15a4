//! A raster of heights as a surface of its own: on the posts that it has, by window, nothing resampled.

use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

use schedule::Workers;
use source_files::{DemFile, Reading, SourceError, content, plain_datum};
use store::Fingerprint;
use terrain::{Post, PostRect};

use crate::CompileError;
use crate::ground::{GroundError, decode};

/// A raster of heights that is open.
pub struct SurfaceRaster {
    file: DemFile,
    path: PathBuf,
}

/// Heights of a window of a raster, row by row from its south-west post.
pub struct PostHeights {
    /// East and north of the south-west post, in metres.
    pub south_west_m: [f64; 2],
    /// Metres between posts, to the east and to the north.
    pub spacing_m: [f64; 2],
    /// Posts of a row.
    pub cols: usize,
    /// Heights in metres; NaN where a post is void.
    pub heights_m: Vec<f32>,
}

impl SurfaceRaster {
    /// Opens a raster whose coordinate system is one in metres.
    ///
    /// # Errors
    /// When it cannot be read, or its posts do not lie in metres.
    pub fn open(path: &Path) -> Result<Self, CompileError> {
        let file = DemFile::open(path, &Reading::AS_IT_SAYS).map_err(GroundError::from)?;
        file.frame().require_metres().map_err(GroundError::from)?;
        Ok(Self { file, path: path.into() })
    }

    /// The name of its coordinate system, such as `EPSG:32611`.
    pub fn crs(&self) -> String {
        let crs = &self.file.frame().crs;
        crs.epsg().map_or_else(|| crs.name().to_owned(), |epsg| format!("EPSG:{epsg}"))
    }

    /// What it says that heights are measured from; empty where it does not.
    pub fn vertical_datum(&self) -> String {
        self.file.vertical_datum().unwrap_or_default().to_owned()
    }

    /// Its format's name.
    pub fn format(&self) -> &'static str {
        self.file.format()
    }

    /// Metres between its posts, to the east and to the north.
    pub fn spacing_m(&self) -> [f64; 2] {
        self.file.frame().spacing
    }

    /// West, south, east and north of its outermost posts, in metres.
    pub fn extent_m(&self) -> [f64; 4] {
        let frame = self.file.frame();
        let ([west, south], [east, north]) = (frame.south_west, frame.place(frame.rows - 1, frame.cols - 1));
        [west, south, east, north]
    }

    /// The fingerprint of its bytes.
    ///
    /// # Errors
    /// When it cannot be read to its end.
    pub fn fingerprint(&self) -> Result<Fingerprint, CompileError> {
        let reader = content(&self.path).map_err(GroundError::from)?;
        let open = |source| GroundError::from(SourceError::Open { path: self.path.clone(), source });
        Ok(Fingerprint::of_reader(reader).map_err(open)?)
    }

    /// The heights of all posts around a rectangle, which is west, south, east and north in metres; `None` where the
    /// raster has none there.
    ///
    /// # Errors
    /// When a height cannot be decoded.
    pub fn window(
        &self,
        [west, south, east, north]: [f64; 4],
        workers: &Workers,
        stop: &AtomicBool,
    ) -> Result<Option<PostHeights>, CompileError> {
        let frame = self.file.frame();
        let post = |place: [f64; 2], round: fn(f64) -> f64| {
            let [col, row] = [0, 1].map(|axis| round((place[axis] - frame.south_west[axis]) / frame.spacing[axis]));
            Post::new(row as i32, col as i32)
        };
        let wanted = PostRect::new(post([west, south], f64::floor), post([east, north], f64::ceil));
        let Some(rect) = wanted.intersection(&self.file.rect()) else { return Ok(None) };
        let raster = decode(&self.file, rect, workers, stop)?;
        let mut heights_m = Vec::with_capacity(rect.post_count());
        for row in rect.south..=rect.north {
            let heights = (rect.west..=rect.east).map(|col| raster.height_m(Post::new(row, col)));
            heights_m.extend(heights.map(|height_m| height_m.map_or(f32::NAN, |height_m| height_m as f32)));
        }
        let south_west_m = frame.place(rect.south as u32, rect.west as u32);
        Ok(Some(PostHeights { south_west_m, spacing_m: frame.spacing, cols: rect.posts_wide(), heights_m }))
    }
}

/// Whether two names of vertical datums stand for the same one.
pub fn is_same_datum(one: &str, other: &str) -> bool {
    plain_datum(one) == plain_datum(other)
}
