//! Neighbouring files of one grid as one raster.

use terrain::{Post, PostRect};

use crate::chunk::{Header, Meaning};
use crate::directory::SampleKind;
use crate::samples::{Samples, union};
use crate::{Raster, RasterFrame, SourceError};

/// Whether a post has a height, and of which kind; a blend is the worst of its posts.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Standing {
    /// As the source has it.
    Height,
    /// Filled in from around a void.
    Filled,
    /// A void of a source.
    Void,
    /// In no source.
    Gap,
}

/// Whether a raster continues another's grid: same system, spacing and meaning of samples, whole posts apart.
pub(crate) fn fits((a, first): Meaning, (b, other): Meaning) -> bool {
    const PHASE_MAX: f64 = 1.0e-3;
    let same = a.crs == b.crs && first == other;
    let near = |axis: usize| {
        let posts = (b.south_west[axis] - a.south_west[axis]) / a.spacing[axis];
        // Off by less than a hundredth of a post after all of either raster.
        let drift =
            (a.spacing[axis] / b.spacing[axis] - 1.0).abs() * f64::from(b.cols.max(b.rows).max(a.cols.max(a.rows)));
        drift < PHASE_MAX * 10.0 && (posts - posts.round()).abs() < PHASE_MAX && posts.abs() < 1.0e9
    };
    same && near(0) && near(1)
}

/// Whether rasters of one grid have more in common than a row or a column of posts.
pub(crate) fn overlaps(a: &RasterFrame, b: &RasterFrame) -> bool {
    let offset = offset(a, b);
    let in_common = |axis: usize, a: u32, b: u32| {
        let (low, high) = (offset[axis].max(0), i64::from(a).min(offset[axis] + i64::from(b)));
        1 < high - low
    };
    in_common(0, a.cols, b.cols) && in_common(1, a.rows, b.rows)
}

/// One raster of several of one grid, the earlier before the later; and how its posts stand.
pub(crate) fn join(mut rasters: Vec<Raster>) -> Result<(Raster, Vec<Standing>), SourceError> {
    if let [raster] = rasters.as_mut_slice() {
        let standing = |index| if raster.voids.contains(index) { Standing::Void } else { Standing::Height };
        let count = if raster.voids.count == 0 { 0 } else { raster.window.post_count() };
        let standings = (0..count).map(standing).collect();
        return Ok((rasters.remove(0), standings));
    }
    let offsets: Vec<[i64; 2]> = rasters.iter().map(|raster| offset(&rasters[0].frame, &raster.frame)).collect();
    let whole = Whole::of(&rasters, &offsets)?;
    let kind = common_kind(rasters.iter().map(|raster| raster.samples.kind()));
    let mut samples = Samples::zeroed(kind, whole.window.post_count());
    let mut standings = vec![Standing::Gap; whole.window.post_count()];
    for (raster, offset) in rasters.iter().zip(&offsets) {
        let window = raster.window;
        for (index, post) in (window.south..=window.north)
            .flat_map(|row| (window.west..=window.east).map(move |col| Post::new(row, col)))
            .enumerate()
        {
            let standing = if raster.voids.contains(index) { Standing::Void } else { Standing::Height };
            let at = whole.index(post, whole.extent.shift(*offset));
            if standing < standings[at] {
                standings[at] = standing;
                // What marks a void is a number in this file only.
                if standing == Standing::Height {
                    samples.set(at, raster.samples.get(index));
                }
            }
        }
    }
    let range_m = rasters.iter().filter_map(Raster::range_m).reduce(union);
    let first = rasters.remove(0);
    let frame = whole.extent.frame(&first.frame);
    let header = Header { frame, scale: first.scale, kind, nodata: None, shift: first.shift.clone() };
    let missing = standings.iter().enumerate().filter(|&(_, &standing)| Standing::Void <= standing);
    let raster = Raster::joined(&header, whole.window, samples, missing.map(|(index, _)| index), range_m);
    if raster.voids.count == 0 {
        standings.clear();
    }
    Ok((raster, standings))
}

/// The type that holds samples of several.
pub(crate) fn common_kind(mut kinds: impl Iterator<Item = SampleKind>) -> SampleKind {
    let first = kinds.next().expect("a group holds rasters");
    if kinds.all(|kind| kind == first) { first } else { SampleKind::F64 }
}

/// Whole posts from one raster's south-west post to another's.
pub(crate) fn offset(from: &RasterFrame, to: &RasterFrame) -> [i64; 2] {
    [0, 1].map(|axis| ((to.south_west[axis] - from.south_west[axis]) / from.spacing[axis]).round() as i64)
}

/// The extent of several rasters, in posts of the first.
pub(crate) struct Extent {
    /// Its south-west post.
    low: [i64; 2],
    size: [u32; 2],
}

impl Extent {
    pub(crate) fn of(frames: &[&RasterFrame], offsets: &[[i64; 2]]) -> Result<Self, SourceError> {
        let all = || frames.iter().zip(offsets);
        let low = [0, 1].map(|axis| offsets.iter().map(|offset| offset[axis]).min().unwrap_or(0));
        let size = |axis: usize, count: fn(&RasterFrame) -> u32| {
            all().map(|(frame, offset)| offset[axis] + i64::from(count(frame))).max().unwrap_or(0) - low[axis]
        };
        let size = [size(0, |frame| frame.cols), size(1, |frame| frame.rows)];
        let limit = crate::limits::POSTS_A_SIDE_MAX;
        if let Some(&found) = size.iter().find(|&&size| limit as i64 <= size) {
            let (path, what) = (frames[0].path.clone(), "posts a side of joined files");
            return Err(SourceError::TooLarge { path, what, found: found as u64, limit });
        }
        Ok(Self { low, size: size.map(|size| size as u32) })
    }

    /// Columns and rows from the extent's south-west post to that of a raster.
    pub(crate) fn shift(&self, offset: [i64; 2]) -> [i32; 2] {
        [0, 1].map(|axis| (offset[axis] - self.low[axis]) as i32)
    }

    pub(crate) fn frame(&self, first: &RasterFrame) -> RasterFrame {
        let south_west = [0, 1].map(|axis| first.south_west[axis] + self.low[axis] as f64 * first.spacing[axis]);
        RasterFrame { south_west, cols: self.size[0], rows: self.size[1], ..first.clone() }
    }
}

/// Posts of a raster, counted from elsewhere: `east` columns and `north` rows on.
pub(crate) fn shifted(rect: PostRect, [east, north]: [i32; 2]) -> PostRect {
    PostRect { south: rect.south + north, west: rect.west + east, north: rect.north + north, east: rect.east + east }
}

/// The extent of several rasters, and the posts of it that they were read for.
struct Whole {
    extent: Extent,
    window: PostRect,
}

impl Whole {
    fn of(rasters: &[Raster], offsets: &[[i64; 2]]) -> Result<Self, SourceError> {
        let frames: Vec<&RasterFrame> = rasters.iter().map(|raster| &raster.frame).collect();
        let extent = Extent::of(&frames, offsets)?;
        let windows = rasters.iter().zip(offsets).map(|(raster, offset)| shifted(raster.window, extent.shift(*offset)));
        let union = windows.reduce(|a, b| PostRect {
            south: a.south.min(b.south),
            west: a.west.min(b.west),
            north: a.north.max(b.north),
            east: a.east.max(b.east),
        });
        let window = union.expect("a group holds rasters");
        let (found, limit) = (window.post_count() as u64, crate::limits::POSTS_MAX);
        if limit < found {
            let path = rasters[0].frame.path.clone();
            return Err(SourceError::TooLarge { path, what: "posts of joined files", found, limit });
        }
        Ok(Self { extent, window })
    }

    /// Index in the window of a post of one of the rasters.
    fn index(&self, post: Post, [east, north]: [i32; 2]) -> usize {
        let (row, col) = (post.row + north - self.window.south, post.col + east - self.window.west);
        row as usize * self.window.posts_wide() + col as usize
    }
}
