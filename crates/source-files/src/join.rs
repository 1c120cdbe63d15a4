//! Neighbouring files of one grid as one raster.

use terrain::{Post, PostRect};

use crate::chunk::Header;
use crate::samples::Samples;
use crate::{Raster, RasterFrame, SourceError, Standing};

/// Whether a raster continues another's grid: same system, spacing and meaning of samples, whole posts apart.
pub(crate) fn fits(first: &Raster, other: &Raster) -> bool {
    const PHASE_MAX: f64 = 1.0e-3;
    let (a, b) = (&first.frame, &other.frame);
    let same = a.crs == b.crs && first.scale == other.scale;
    let near = |axis: usize| {
        let posts = (b.south_west[axis] - a.south_west[axis]) / a.spacing[axis];
        // Off by less than a hundredth of a post after all of either raster.
        let drift =
            (a.spacing[axis] / b.spacing[axis] - 1.0).abs() * f64::from(b.cols.max(b.rows).max(a.cols.max(a.rows)));
        drift < PHASE_MAX * 10.0 && (posts - posts.round()).abs() < PHASE_MAX && posts.abs() < 1.0e9
    };
    same && near(0) && near(1)
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
    let same_kind = rasters.iter().all(|raster| raster.samples.kind() == rasters[0].samples.kind());
    let kind = if same_kind { rasters[0].samples.kind() } else { crate::directory::SampleKind::F64 };
    let mut samples = Samples::zeroed(kind, whole.window.post_count());
    let mut standings = vec![Standing::Gap; whole.window.post_count()];
    for (raster, offset) in rasters.iter().zip(&offsets) {
        let window = raster.window;
        for (index, post) in (window.south..=window.north)
            .flat_map(|row| (window.west..=window.east).map(move |col| Post::new(row, col)))
            .enumerate()
        {
            let standing = if raster.voids.contains(index) { Standing::Void } else { Standing::Height };
            let at = whole.index(post, *offset);
            if standing < standings[at] {
                standings[at] = standing;
                samples.set(at, raster.samples.get(index));
            }
        }
    }
    let first = rasters.remove(0);
    let frame = whole.frame(&first.frame);
    let header = Header { frame, scale: first.scale, kind, nodata: None };
    let mut raster = Raster::of_samples(&header, whole.window, samples, Vec::new())?;
    let missing = standings.iter().enumerate().filter(|&(_, &standing)| Standing::Void <= standing);
    raster.mark_voids(missing.map(|(index, _)| index));
    if raster.voids.count == 0 {
        standings.clear();
    }
    Ok((raster, standings))
}

/// Whole posts from one raster's south-west post to another's.
fn offset(from: &RasterFrame, to: &RasterFrame) -> [i64; 2] {
    [0, 1].map(|axis| ((to.south_west[axis] - from.south_west[axis]) / from.spacing[axis]).round() as i64)
}

/// The extent of several rasters, in posts of the first.
struct Whole {
    /// Its south-west post.
    low: [i64; 2],
    size: [u32; 2],
    window: PostRect,
}

impl Whole {
    fn of(rasters: &[Raster], offsets: &[[i64; 2]]) -> Result<Self, SourceError> {
        let frames = || rasters.iter().map(|raster| &raster.frame).zip(offsets);
        let low = [0, 1].map(|axis| offsets.iter().map(|offset| offset[axis]).min().unwrap_or(0));
        let size = |axis: usize, count: fn(&RasterFrame) -> u32| {
            frames().map(|(frame, offset)| offset[axis] + i64::from(count(frame))).max().unwrap_or(0) - low[axis]
        };
        let size = [size(0, |frame| frame.cols), size(1, |frame| frame.rows)];
        let limit = crate::limits::POSTS_A_SIDE_MAX;
        if let Some(&found) = size.iter().find(|&&size| limit as i64 <= size) {
            let path = rasters[0].frame.path.clone();
            return Err(SourceError::TooLarge {
                path,
                what: "posts a side of joined files",
                found: found as u64,
                limit,
            });
        }
        let windows = rasters.iter().zip(offsets).map(|(raster, offset)| {
            let (east, north) = ((offset[0] - low[0]) as i32, (offset[1] - low[1]) as i32);
            let window = raster.window;
            [window.south + north, window.west + east, window.north + north, window.east + east]
        });
        let union = windows.reduce(|a, b| [a[0].min(b[0]), a[1].min(b[1]), a[2].max(b[2]), a[3].max(b[3])]);
        let [south, west, north, east] = union.expect("a group holds rasters");
        let window = PostRect { south, west, north, east };
        let (found, limit) = (window.post_count() as u64, crate::limits::POSTS_MAX);
        if limit < found {
            let path = rasters[0].frame.path.clone();
            return Err(SourceError::TooLarge { path, what: "posts of joined files", found, limit });
        }
        Ok(Self { low, size: size.map(|size| size as u32), window })
    }

    /// Index in the window of a post of one of the rasters.
    fn index(&self, post: Post, offset: [i64; 2]) -> usize {
        let row = i64::from(post.row) + offset[1] - self.low[1] - i64::from(self.window.south);
        let col = i64::from(post.col) + offset[0] - self.low[0] - i64::from(self.window.west);
        row as usize * self.window.posts_wide() + col as usize
    }

    fn frame(&self, first: &RasterFrame) -> RasterFrame {
        let south_west = [0, 1].map(|axis| first.south_west[axis] + self.low[axis] as f64 * first.spacing[axis]);
        RasterFrame { south_west, cols: self.size[0], rows: self.size[1], ..first.clone() }
    }
}
