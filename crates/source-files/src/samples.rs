//! The samples of a raster, kept in the type the file has: 16-bit heights take 16 bits.

use tiff::decoder::DecodingResult;

use crate::directory::SampleKind;

/// Samples of one of the kinds that are read.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Samples {
    U8(Vec<u8>),
    U16(Vec<u16>),
    I16(Vec<i16>),
    I32(Vec<i32>),
    F32(Vec<f32>),
    F64(Vec<f64>),
}

/// Runs the same code on the vector inside, whatever its type; a generic function cannot be passed as a value.
macro_rules! each {
    ($samples:expr, $posts:ident => $code:expr) => {
        match $samples {
            Samples::U8($posts) => $code,
            Samples::U16($posts) => $code,
            Samples::I16($posts) => $code,
            Samples::I32($posts) => $code,
            Samples::F32($posts) => $code,
            Samples::F64($posts) => $code,
        }
    };
}

/// A type samples are stored in.
pub(crate) trait Sample: Copy + Default + PartialOrd + Into<f64> {
    /// The nearest value this type holds.
    fn nearest(value: f64) -> Self;
    /// What a post holds that equals the nodata tag, if this type can hold it.
    fn equal_to(nodata: f64) -> Option<Self>;
}

macro_rules! whole_numbers {
    ($($kind:ty),*) => {$(
        impl Sample for $kind {
            fn nearest(value: f64) -> Self {
                value.round() as Self
            }
            fn equal_to(nodata: f64) -> Option<Self> {
                (f64::from(nodata as Self) == nodata).then_some(nodata as Self)
            }
        }
    )*};
}
whole_numbers!(u8, u16, i16, i32);

impl Sample for f32 {
    fn nearest(value: f64) -> Self {
        value as Self
    }
    // The tag is written in decimals, which need not be exact.
    fn equal_to(nodata: f64) -> Option<Self> {
        Some(nodata as Self)
    }
}

impl Sample for f64 {
    fn nearest(value: f64) -> Self {
        value
    }
    fn equal_to(nodata: f64) -> Option<Self> {
        Some(nodata)
    }
}

/// What a look at every sample finds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Survey {
    pub voids: usize,
    /// Lowest and highest sample that is not void.
    pub range: Option<(f64, f64)>,
}

impl Samples {
    pub(crate) fn zeroed(kind: SampleKind, count: usize) -> Self {
        match kind {
            SampleKind::U8 => Samples::U8(vec![0; count]),
            SampleKind::U16 => Samples::U16(vec![0; count]),
            SampleKind::I16 => Samples::I16(vec![0; count]),
            SampleKind::I32 => Samples::I32(vec![0; count]),
            SampleKind::F32 => Samples::F32(vec![0.0; count]),
            SampleKind::F64 => Samples::F64(vec![0.0; count]),
        }
    }

    /// Copies `count` samples of a decoded chunk.
    ///
    /// # Panics
    /// When the chunk is of another kind: the directory was checked, and the decoder keeps to it.
    pub(crate) fn copy(&mut self, at: usize, chunk: &DecodingResult, from: usize, count: usize) {
        match (self, chunk) {
            (Samples::U8(to), DecodingResult::U8(chunk)) => copy(to, at, chunk, from, count),
            (Samples::U16(to), DecodingResult::U16(chunk)) => copy(to, at, chunk, from, count),
            (Samples::I16(to), DecodingResult::I16(chunk)) => copy(to, at, chunk, from, count),
            (Samples::I32(to), DecodingResult::I32(chunk)) => copy(to, at, chunk, from, count),
            (Samples::F32(to), DecodingResult::F32(chunk)) => copy(to, at, chunk, from, count),
            (Samples::F64(to), DecodingResult::F64(chunk)) => copy(to, at, chunk, from, count),
            _ => panic!("the decoder gives samples of the kind the directory names"),
        }
    }

    /// Sets `count` samples to one value.
    pub(crate) fn fill(&mut self, at: usize, count: usize, value: f64) {
        each!(self, posts => posts[at..at + count].fill(Sample::nearest(value)));
    }

    pub(crate) fn set(&mut self, at: usize, value: f64) {
        each!(self, posts => posts[at] = Sample::nearest(value));
    }

    pub(crate) fn get(&self, at: usize) -> f64 {
        each!(self, posts => number(posts[at]))
    }

    /// Writes a run of samples as numbers.
    pub(crate) fn write_numbers(&self, at: usize, numbers: &mut [f64]) {
        each!(self, posts => {
            for (number, &post) in numbers.iter_mut().zip(&posts[at..]) {
                *number = self::number(post);
            }
        });
    }

    pub(crate) fn survey(&self, nodata: Option<f64>) -> Survey {
        each!(self, posts => survey(posts, nodata))
    }

    /// Calls `visit` with the index of every void sample.
    pub(crate) fn visit_voids(&self, nodata: Option<f64>, mut visit: impl FnMut(usize)) {
        each!(self, posts => {
            let mark = nodata.and_then(Sample::equal_to);
            for (index, &post) in posts.iter().enumerate() {
                if is_void(post, mark) {
                    visit(index);
                }
            }
        });
    }

    /// The type's name, for types that are no whole numbers.
    pub(crate) fn fractional(&self) -> Option<&'static str> {
        match self {
            Samples::F32(_) => Some("32-bit floating point"),
            Samples::F64(_) => Some("64-bit floating point"),
            _ => None,
        }
    }
}

fn number<T: Sample>(sample: T) -> f64 {
    sample.into()
}

fn copy<T: Copy>(to: &mut [T], at: usize, chunk: &[T], from: usize, count: usize) {
    to[at..at + count].copy_from_slice(&chunk[from..from + count]);
}

/// Void is what equals the mark, and what is no number.
fn is_void<T: Sample>(post: T, mark: Option<T>) -> bool {
    mark == Some(post) || post.partial_cmp(&post).is_none()
}

fn survey<T: Sample>(posts: &[T], nodata: Option<f64>) -> Survey {
    let mark = nodata.and_then(T::equal_to);
    let Some(&first) = posts.iter().find(|&&post| !is_void(post, mark)) else {
        return Survey { voids: posts.len(), range: None };
    };
    let (mut lowest, mut highest, mut voids) = (first, first, 0);
    for run in posts.chunks(1 << 12) {
        // A void counts as a height already seen: no branch, so this runs in lanes.
        let mut voids_of_run = 0_u32;
        for &post in run {
            let void = is_void(post, mark);
            let post = if void { first } else { post };
            voids_of_run += u32::from(void);
            lowest = if post < lowest { post } else { lowest };
            highest = if highest < post { post } else { highest };
        }
        voids += voids_of_run as usize;
    }
    Survey { voids, range: Some((lowest.into(), highest.into())) }
}
