//! A window of a raster in memory: samples as stored, southern row first, and which of them are void.

use std::ops::Range;
use std::sync::Arc;

use terrain::{Dem, Post, PostRect, QUANTA_PER_METRE, quanta_of_metres};

use crate::chunk::{Chunk, Header, Meaning};
use crate::frame::{RasterFrame, SampleScale};
use crate::limits::HEIGHT_M_MAX;
use crate::samples::{Samples, VoidPosts, each, number, union};
use crate::{DatumShift, Reach, SourceError};

/// The posts of a window of a raster. Posts are counted from the south-west post of the whole raster.
#[derive(Clone, Debug)]
pub struct Raster {
    pub(crate) frame: RasterFrame,
    pub(crate) scale: SampleScale,
    pub(crate) window: PostRect,
    pub(crate) samples: Samples,
    pub(crate) voids: VoidPosts,
    /// How its heights become those above the datum that is wanted.
    pub(crate) shift: Option<DatumShift>,
    range_m: Option<(f64, f64)>,
    notes: Vec<String>,
}

impl Raster {
    pub(crate) fn assemble(header: &Header, window: PostRect, chunks: Vec<Chunk>) -> Result<Self, SourceError> {
        let mut samples = Samples::zeroed(header.kind, window.post_count());
        let (mut placed, mut notes) = (0, Vec::new());
        for mut chunk in chunks {
            placed += place(header, window, &chunk, &mut samples);
            notes.append(&mut chunk.notes);
        }
        assert_eq!(placed, window.post_count(), "the chunks of a window hold each of its posts once");
        Self::of_samples(header, window, samples, notes)
    }

    /// Puts a window together from chunks that others may need too; what there is to know of them is told elsewhere.
    pub(crate) fn assemble_shared(
        header: &Header,
        window: PostRect,
        chunks: &[Arc<Chunk>],
    ) -> Result<Self, SourceError> {
        let mut samples = Samples::zeroed(header.kind, window.post_count());
        let placed: usize = chunks.iter().map(|chunk| place(header, window, chunk, &mut samples)).sum();
        assert_eq!(placed, window.post_count(), "the chunks of a window hold each of its posts once");
        Self::of_samples(header, window, samples, Vec::new())
    }

    /// A window whose samples are in place.
    pub(crate) fn of_samples(
        header: &Header,
        window: PostRect,
        samples: Samples,
        notes: Vec<String>,
    ) -> Result<Self, SourceError> {
        let survey = samples.survey(header.nodata);
        let mut voids = VoidPosts::default();
        if survey.voids == 0 {
            voids.clear();
        } else {
            voids = VoidPosts::among(window.post_count());
            samples.visit_voids(header.nodata, |index| voids.mark(index));
        }
        let scale = header.scale;
        // A negative scale turns the order around.
        let heights_m = |(lowest, highest)| (scale.height_m(lowest), scale.height_m(highest));
        let range_m = survey.range.map(heights_m).map(|(a, b): (f64, f64)| (a.min(b), a.max(b)));
        let shift = header.shift.clone();
        let raster = Self { frame: header.frame.clone(), scale, window, samples, voids, shift, range_m, notes };
        raster.check_range(survey.range)?;
        Ok(raster)
    }

    /// A window of samples that others have judged: void at the posts `missing`, by index, heights everywhere else.
    pub(crate) fn joined(
        header: &Header,
        window: PostRect,
        samples: Samples,
        missing: impl Iterator<Item = usize>,
        range_m: Option<(f64, f64)>,
    ) -> Self {
        let mut voids = VoidPosts::among(window.post_count());
        missing.for_each(|index| voids.mark(index));
        voids.settled = voids.count == 0;
        let (frame, scale, shift) = (header.frame.clone(), header.scale, header.shift.clone());
        Self { frame, scale, window, samples, voids, shift, range_m, notes: Vec::new() }
    }

    fn check_range(&self, samples: Option<(f64, f64)>) -> Result<(), SourceError> {
        let Some((lowest, highest)) = samples else { return Ok(()) };
        if lowest.is_infinite() || highest.is_infinite() {
            let index = (0..self.window.post_count()).find(|&index| self.samples.get(index).is_infinite());
            let at = self.place(index.expect("a range that is not finite has a post that is not"));
            return Err(SourceError::Infinite { path: self.frame.path.clone(), at });
        }
        let heights_m = [lowest, highest].map(|sample| self.scale.height_m(sample));
        let inside = |height_m: &f64| height_m.abs() <= HEIGHT_M_MAX;
        match heights_m.into_iter().find(|height_m| !inside(height_m)) {
            None => Ok(()),
            Some(found) => {
                let path = self.frame.path.clone();
                Err(SourceError::HeightOutOfRange { path, found, limit: HEIGHT_M_MAX })
            }
        }
    }

    /// Where the whole raster lies.
    pub fn frame(&self) -> &RasterFrame {
        &self.frame
    }

    /// The posts it holds, counted from the south-west post of the whole raster.
    pub fn window(&self) -> PostRect {
        self.window
    }

    /// What a person should know about the samples that were read.
    pub fn notes(&self) -> &[String] {
        &self.notes
    }

    /// How many posts are void.
    pub fn void_count(&self) -> usize {
        self.voids.count
    }

    /// Lowest and highest height in metres, voids left out; `None` when all are void.
    pub fn range_m(&self) -> Option<(f64, f64)> {
        self.range_m
    }

    /// The same of the posts that others lie among.
    pub fn range_within_m(&self, reach: &Reach) -> Option<(f64, f64)> {
        let mut row_m = Vec::new();
        let ranges = reach.within(self.window).filter_map(|(row, cols)| {
            row_m.clear();
            self.push_row_m(row, cols, &mut row_m);
            row_m.iter().filter(|height| !height.is_nan()).map(|&height| (height, height)).reduce(union)
        });
        ranges.reduce(union)
    }

    /// Has a mosaic bring its heights to another datum.
    pub fn set_shift(&mut self, shift: Option<DatumShift>) {
        self.shift = shift;
    }

    pub(crate) fn meaning(&self) -> Meaning<'_> {
        (&self.frame, (self.scale, &self.shift))
    }

    /// The sample at `post` as stored; `None` where it is void.
    ///
    /// # Panics
    /// When `post` lies outside the window.
    pub fn sample(&self, post: Post) -> Option<f64> {
        assert!(self.window.contains(post), "post {post} lies outside the window");
        let index = self.window.index(post);
        (!self.voids.contains(index)).then(|| self.samples.get(index))
    }

    /// The height at `post` in metres; `None` where it is void.
    ///
    /// # Panics
    /// When `post` lies outside the window.
    pub fn height_m(&self, post: Post) -> Option<f64> {
        self.sample(post).map(|sample| self.scale.height_m(sample))
    }

    /// Appends the heights in metres of some columns of a row; NaN where it is void.
    ///
    /// # Panics
    /// When one of these posts lies outside the window.
    pub fn push_row_m(&self, row: i32, cols: Range<i32>, heights: &mut Vec<f64>) {
        let is_inside = |col: i32| self.window.contains(Post::new(row, col));
        assert!(is_inside(cols.start) && is_inside(cols.end - 1), "posts lie in the window");
        let first = self.window.index(Post::new(row, cols.start));
        let (scale, start) = (self.scale, heights.len());
        each!(&self.samples, posts => {
            let row = &posts[first..first + cols.len()];
            heights.extend(row.iter().map(|&sample| scale.height_m(number(sample))));
        });
        if 0 < self.voids.count {
            let row = &mut heights[start..];
            (first..)
                .zip(row)
                .filter(|&(index, _)| self.voids.contains(index))
                .for_each(|(_, height)| *height = f64::NAN);
        }
    }

    /// Its heights in quanta; voids stay void, with the heights that [`Raster::settle_voids`] gave them.
    pub fn dem(&self) -> Dem {
        let (scale, wide) = (self.scale, self.window.posts_wide());
        if 0 < self.voids.count {
            let mut dem = Dem::from_fn(self.window, |post| self.height_m(post).and_then(quanta_of_metres));
            if self.voids.settled {
                let height = |post| quanta_of_metres(scale.height_m(self.samples.get(self.window.index(post))));
                dem.fill_voids(|post| height(post).unwrap_or(0));
            }
            return dem;
        }
        // The type of samples is asked for once a row, and not once a post.
        Dem::from_row_fn(self.window, |row, heights| {
            let at = (row - self.window.south) as usize * wide;
            match &self.samples {
                // Whole metres need no rounding: a quarter of the time.
                Samples::I16(posts) if scale == SampleScale::METRES => {
                    let metres = heights.iter_mut().zip(&posts[at..]);
                    metres.for_each(|(height, &sample)| *height = i32::from(sample) * QUANTA_PER_METRE);
                }
                samples => each!(samples, posts => {
                    for (height, &sample) in heights.iter_mut().zip(&posts[at..]) {
                        // `check_range` has let no height through that has no quanta.
                        *height = quanta_of_metres(scale.height_m(number(sample))).unwrap_or(0);
                    }
                }),
            }
        })
    }

    /// Where a post of the window lies, by its index, for messages.
    pub(crate) fn place(&self, index: usize) -> String {
        let (row, col) = (index / self.window.posts_wide(), index % self.window.posts_wide());
        self.frame.place_text(self.window.south as u32 + row as u32, self.window.west as u32 + col as u32)
    }
}

/// Copies the part of a chunk that lies in the window; returns the number of posts.
fn place(header: &Header, window: PostRect, chunk: &Chunk, samples: &mut Samples) -> usize {
    let posts = chunk.posts;
    let Some(cut) = posts.intersection(&window) else { return 0 };
    let count = cut.posts_wide();
    for row in cut.south..=cut.north {
        let at = (row - window.south) as usize * window.posts_wide() + (cut.west - window.west) as usize;
        let stored_row = if chunk.south_first { row - posts.south } else { posts.north - row };
        let from = stored_row as usize * chunk.stride + (cut.west - posts.west) as usize;
        match &chunk.samples {
            Some(decoded) => samples.copy(at, decoded, from, count),
            None => samples.fill(at, count, header.nodata.unwrap_or(0.0)),
        }
    }
    cut.post_count()
}
