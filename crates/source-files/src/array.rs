//! A raster that a program holds in memory, instead of a file: judged by the same rules, read into the same samples.

use std::path::PathBuf;

use terrain::PostRect;

use crate::chunk::Header;
use crate::directory::SampleKind;
use crate::frame::Axes;
use crate::limits::{POSTS_A_SIDE_MAX, POSTS_MAX};
use crate::samples::Samples;
use crate::{Crs, Raster, RasterFrame, SampleScale, SourceError};

/// Heights of posts, row by row from the southern one, each row from west to east.
#[derive(Clone, Debug)]
pub enum PostArray {
    /// Whole numbers of 16 bits.
    I16(Vec<i16>),
    /// Whole numbers of 32 bits.
    I32(Vec<i32>),
    /// Floats of 32 bits; not a number is void.
    F32(Vec<f32>),
    /// Floats of 64 bits; not a number is void.
    F64(Vec<f64>),
}

/// What is known of heights in memory.
#[derive(Clone, Debug)]
pub struct ArrayRaster {
    /// What messages call it.
    pub name: PathBuf,
    /// Its coordinate system; without one its posts lie in a plane of metres.
    pub crs: Option<Crs>,
    /// East and north of the south-west post, in units of the coordinate system.
    pub south_west: [f64; 2],
    /// Units between posts, to the east and to the north.
    pub spacing: [f64; 2],
    /// Rows and columns of posts.
    pub size: [usize; 2],
    /// The value that marks a void post.
    pub nodata: Option<f64>,
}

impl Raster {
    /// Heights that a program holds in memory, in metres.
    ///
    /// # Errors
    /// When there are too few or too many, a place or a height is infinite, or one lies beyond the limit.
    ///
    /// # Panics
    /// When there are not as many heights as posts.
    pub fn of_array(about: ArrayRaster, posts: PostArray) -> Result<Self, SourceError> {
        let ArrayRaster { name, crs, south_west, spacing, size, nodata } = about;
        let too_large = |what, found, limit| Err(SourceError::TooLarge { path: name.clone(), what, found, limit });
        let [rows, cols] = size.map(|posts| posts as u64);
        if rows == 0 || cols == 0 {
            let (what, expected) = ("the number of posts".into(), "at least one row and one column".into());
            return Err(SourceError::Malformed { path: name, what, found: format!("{rows} x {cols}"), expected });
        }
        if POSTS_A_SIDE_MAX < rows.max(cols) {
            return too_large("posts a side", rows.max(cols), POSTS_A_SIDE_MAX);
        }
        if POSTS_MAX < rows * cols {
            return too_large("posts", rows * cols, POSTS_MAX);
        }
        let samples = match posts {
            PostArray::I16(posts) => Samples::I16(posts),
            PostArray::I32(posts) => Samples::I32(posts),
            PostArray::F32(posts) => Samples::F32(posts),
            PostArray::F64(posts) => Samples::F64(posts),
        };
        let axes = Axes { first: south_west, step: spacing }.checked(&name)?;
        let crs = crs.unwrap_or_else(Crs::plane);
        let (frame, _) = RasterFrame::new(&name, crs, &axes, cols as u32, rows as u32)?;
        let kind: SampleKind = samples.kind();
        let header = Header { frame, scale: SampleScale::METRES, kind, nodata, shift: None };
        let window = PostRect::of_size(size[0], size[1]);
        assert_eq!(samples.count(), window.post_count(), "one height for each post");
        Self::of_samples(&header, window, samples, Vec::new())
    }
}

#[cfg(test)]
mod tests {
    use terrain::Post;

    use super::*;

    fn about(size: [usize; 2]) -> ArrayRaster {
        let (south_west, spacing) = ([0.0; 2], [25.0; 2]);
        ArrayRaster { name: "array".into(), crs: None, south_west, spacing, size, nodata: Some(-1.0) }
    }

    #[test]
    fn heights_in_memory_are_samples_from_the_south_and_voids_are_marked() {
        let raster = Raster::of_array(about([2, 3]), PostArray::I16(vec![1, 2, 3, 4, -1, 6])).unwrap();
        assert_eq!(raster.height_m(Post::new(0, 2)), Some(3.0));
        assert_eq!((raster.height_m(Post::new(1, 0)), raster.height_m(Post::new(1, 1))), (Some(4.0), None));
        assert_eq!((raster.frame().crs.unit_m(), raster.frame().crs.epsg()), (Some(1.0), None));
    }

    #[test]
    fn heights_that_are_none_are_refused_as_those_of_a_file() {
        let posts = PostArray::F32(vec![0.0, f32::INFINITY, f32::NAN, 0.0]);
        let error = Raster::of_array(about([2, 2]), posts).unwrap_err().to_string();
        assert!(error.starts_with("array: an infinite height at 25.0, 0.0 m"), "{error}");
        let nowhere = ArrayRaster { south_west: [f64::NAN, 0.0], ..about([1, 1]) };
        assert!(Raster::of_array(nowhere, PostArray::F64(vec![0.0])).is_err());
        assert!(Raster::of_array(about([0, 5]), PostArray::F64(Vec::new())).is_err());
    }
}
