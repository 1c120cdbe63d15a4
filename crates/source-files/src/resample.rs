//! From a raster's posts to the working grid's: bilinear, one rounding, the same for a post in whatever window.

use terrain::geometry::resample::{HeightScale, Tap, Taps, blend_rows, sample_row, tap};
use terrain::{Dem, GridFrame, Post, PostRect, QUANTA_PER_METRE, Side};

use crate::frame::{col_of, row_of};
use crate::{Raster, RasterFrame, SourceError};

/// The posts of a raster that the posts `rect` of the working grid are made of.
///
/// # Errors
/// [`SourceError::NotCovered`] when the raster does not reach all of them, with each side that lacks ground.
pub fn window_under(frame: &RasterFrame, grid: &GridFrame, rect: PostRect) -> Result<PostRect, SourceError> {
    let (cols, rows) = taps(frame, grid, rect)?;
    let first = |taps: &[Tap]| taps.first().expect("a rectangle has posts").near as i32;
    let last = |taps: &[Tap]| taps.last().expect("a rectangle has posts").far as i32;
    Ok(PostRect::new(Post::new(first(&rows), first(&cols)), Post::new(last(&rows), last(&cols))))
}

/// For each column and each row of `rect`, the source posts around it.
fn taps(frame: &RasterFrame, grid: &GridFrame, rect: PostRect) -> Result<(Vec<Tap>, Vec<Tap>), SourceError> {
    let cols: Option<Vec<Tap>> = (rect.west..=rect.east).map(|col| tap(col_of(frame, grid, col), frame.cols)).collect();
    let rows: Option<Vec<Tap>> =
        (rect.south..=rect.north).map(|row| tap(row_of(frame, grid, row), frame.rows)).collect();
    match (cols, rows) {
        (Some(cols), Some(rows)) => Ok((cols, rows)),
        _ => Err(SourceError::NotCovered { path: frame.path.clone(), missing: missing(frame, grid, rect) }),
    }
}

/// The sides on which the raster ends before the area does, and by how many metres.
pub(crate) fn missing(frame: &RasterFrame, grid: &GridFrame, rect: PostRect) -> Vec<(Side, f64)> {
    let past_col = |col| col_of(frame, grid, col) - f64::from(frame.cols - 1);
    let past_row = |row| row_of(frame, grid, row) - f64::from(frame.rows - 1);
    let lacks = [
        (Side::South, -row_of(frame, grid, rect.south), frame.spacing[1]),
        (Side::East, past_col(rect.east), frame.spacing[0]),
        (Side::North, past_row(rect.north), frame.spacing[1]),
        (Side::West, -col_of(frame, grid, rect.west), frame.spacing[0]),
    ];
    let outside = lacks.into_iter().filter(|&(_, posts, _)| tap(-posts, u32::MAX).is_none());
    outside.map(|(side, posts, spacing_m)| (side, posts * spacing_m)).collect()
}

impl Raster {
    /// Heights at the posts `rect` of the working grid. A post is void when a void has weight in it.
    ///
    /// # Errors
    /// [`SourceError::NotCovered`] when the raster does not reach all of them.
    ///
    /// # Panics
    /// When the window read does not hold the posts needed ([`window_under`] says which), or its voids were not
    /// settled by [`Raster::settle_voids`].
    pub fn resample(&self, grid: &GridFrame, rect: PostRect) -> Result<Dem, SourceError> {
        let needed = window_under(&self.frame, grid, rect)?;
        assert!(self.window.contains_rect(&needed), "the window that was read holds the posts that are asked for");
        assert!(self.voids.settled, "voids are settled before heights are asked for");
        let (cols, rows) = taps(&self.frame, grid, rect)?;
        let view = View { raster: self, needed, cols: Taps::new(&cols, needed.west as u32), rows };
        let filled = view.filled(rect);
        if self.voids.count == 0 {
            return Ok(filled);
        }
        let mut dem = view.with_voids(rect, &filled);
        dem.fill_voids(|post| filled.height(post));
        Ok(dem)
    }

    fn height_scale(&self) -> HeightScale {
        let quanta_per_metre = f64::from(QUANTA_PER_METRE) * self.scale.unit_m;
        HeightScale {
            quanta_per_unit: self.scale.scale * quanta_per_metre,
            quanta_at_zero: self.scale.offset * quanta_per_metre,
        }
    }
}

/// The part of a raster under some posts of the working grid.
struct View<'a> {
    raster: &'a Raster,
    needed: PostRect,
    /// Counted from the western column needed.
    cols: Taps,
    /// Counted from the southern row of the raster.
    rows: Vec<Tap>,
}

impl View<'_> {
    /// Heights at `rect`, where the filling of a void is ground like any other.
    fn filled(&self, rect: PostRect) -> Dem {
        let scale = self.raster.height_scale();
        let mut pair = Pair::new(self, false);
        Dem::from_row_fn(rect, |row, heights| {
            let tap = self.rows[(row - rect.south) as usize];
            let (near, far) = pair.rows(tap);
            blend_rows(near, far, tap, scale, heights);
        })
    }

    /// The heights `filled`, void where a void has weight.
    fn with_voids(&self, rect: PostRect, filled: &Dem) -> Dem {
        let mut pair = Pair::new(self, true);
        Dem::from_fn(rect, |post| {
            let (near, far) = pair.rows(self.rows[(post.row - rect.south) as usize]);
            let col = (post.col - rect.west) as usize;
            (!near[col].is_nan() && !far[col].is_nan()).then(|| filled.height(post))
        })
    }

    /// The needed columns of a row of the raster, counted from its southern row.
    fn write_row(&self, row: u32, mark_voids: bool, numbers: &mut [f64]) {
        let window = &self.raster.window;
        let at = (row as i32 - window.south) as usize * window.posts_wide() + (self.needed.west - window.west) as usize;
        self.raster.samples.write_numbers(at, numbers);
        if mark_voids {
            for (col, number) in numbers.iter_mut().enumerate() {
                if self.raster.voids.contains(at + col) {
                    *number = f64::NAN;
                }
            }
        }
    }
}

/// The two source rows around a row of the working grid, sampled at its columns. Rows come from south to north, so
/// the northern source row of one is often the southern one of the next, and is kept.
struct Pair<'a> {
    view: &'a View<'a>,
    mark_voids: bool,
    near: (Option<u32>, Vec<f64>),
    far: (Option<u32>, Vec<f64>),
    /// A source row before it is sampled.
    numbers: Vec<f64>,
}

impl<'a> Pair<'a> {
    fn new(view: &'a View<'a>, mark_voids: bool) -> Self {
        let row = || (None, vec![0.0; view.cols.count()]);
        Self { view, mark_voids, near: row(), far: row(), numbers: vec![0.0; view.needed.posts_wide()] }
    }

    fn rows(&mut self, tap: Tap) -> (&[f64], &[f64]) {
        if self.near.0 != Some(tap.near) && self.far.0 == Some(tap.near) {
            std::mem::swap(&mut self.near, &mut self.far);
        }
        for (row, wanted) in [(&mut self.near, tap.near), (&mut self.far, tap.far)] {
            if row.0 != Some(wanted) {
                self.view.write_row(wanted, self.mark_voids, &mut self.numbers);
                sample_row(&self.numbers, &self.view.cols, &mut row.1);
                row.0 = Some(wanted);
            }
        }
        (&self.near.1, &self.far.1)
    }
}
