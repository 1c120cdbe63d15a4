//! The samples of a raster, kept in the type the file has: 16-bit heights take 16 bits; and which posts have
//! none.

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
            $crate::samples::Samples::U8($posts) => $code,
            $crate::samples::Samples::U16($posts) => $code,
            $crate::samples::Samples::I16($posts) => $code,
            $crate::samples::Samples::I32($posts) => $code,
            $crate::samples::Samples::F32($posts) => $code,
            $crate::samples::Samples::F64($posts) => $code,
        }
    };
}
pub(crate) use each;

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

/// The range of what lies in either of two.
pub(crate) fn union((low, high): (f64, f64), (lower, higher): (f64, f64)) -> (f64, f64) {
    (low.min(lower), high.max(higher))
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

    /// Samples that are stored as they are.
    pub(crate) fn from_bytes(kind: SampleKind, big_endian: bool, bytes: &[u8]) -> Self {
        macro_rules! numbers {
            ($kind:ty) => {{
                let (numbers, _) = bytes.as_chunks::<{ size_of::<$kind>() }>();
                let number = if big_endian { <$kind>::from_be_bytes } else { <$kind>::from_le_bytes };
                numbers.iter().map(|&bytes| number(bytes)).collect()
            }};
        }
        match kind {
            SampleKind::U8 => Samples::U8(bytes.to_vec()),
            SampleKind::U16 => Samples::U16(numbers!(u16)),
            SampleKind::I16 => Samples::I16(numbers!(i16)),
            SampleKind::I32 => Samples::I32(numbers!(i32)),
            SampleKind::F32 => Samples::F32(numbers!(f32)),
            SampleKind::F64 => Samples::F64(numbers!(f64)),
        }
    }

    /// How they are stored.
    pub(crate) fn kind(&self) -> SampleKind {
        match self {
            Samples::U8(_) => SampleKind::U8,
            Samples::U16(_) => SampleKind::U16,
            Samples::I16(_) => SampleKind::I16,
            Samples::I32(_) => SampleKind::I32,
            Samples::F32(_) => SampleKind::F32,
            Samples::F64(_) => SampleKind::F64,
        }
    }

    pub(crate) fn count(&self) -> usize {
        each!(self, posts => posts.len())
    }

    /// Copies `count` samples of others of the same kind.
    ///
    /// # Panics
    /// When they are of another kind: a reader gives what its header names.
    pub(crate) fn copy(&mut self, at: usize, chunk: &Samples, from: usize, count: usize) {
        match (self, chunk) {
            (Samples::U8(to), Samples::U8(chunk)) => copy(to, at, chunk, from, count),
            (Samples::U16(to), Samples::U16(chunk)) => copy(to, at, chunk, from, count),
            (Samples::I16(to), Samples::I16(chunk)) => copy(to, at, chunk, from, count),
            (Samples::I32(to), Samples::I32(chunk)) => copy(to, at, chunk, from, count),
            (Samples::F32(to), Samples::F32(chunk)) => copy(to, at, chunk, from, count),
            (Samples::F64(to), Samples::F64(chunk)) => copy(to, at, chunk, from, count),
            _ => panic!("a reader gives samples of the kind its header names"),
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

    /// Whether every sample that is a number is a whole one.
    pub(crate) fn all_whole(&self) -> bool {
        each!(self, posts => posts.iter().all(|&post| {
            let number = number(post);
            number.is_nan() || number.fract() == 0.0
        }))
    }
}

/// A sample as a number.
pub(crate) fn number<T: Sample>(sample: T) -> f64 {
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

/// Which posts of a window are void.
#[derive(Clone, Debug, Default)]
pub(crate) struct VoidPosts {
    /// One bit per post, row-major; empty when none is void.
    bits: Vec<u64>,
    pub count: usize,
    /// Whether void posts hold a height that keeps the mesh defined.
    pub settled: bool,
}

impl VoidPosts {
    /// None yet of so many posts, of which some will be.
    pub(crate) fn among(count: usize) -> Self {
        Self { bits: vec![0; count.div_ceil(64)], ..Self::default() }
    }

    pub(crate) fn contains(&self, index: usize) -> bool {
        !self.bits.is_empty() && self.bits[index / 64] >> (index % 64) & 1 == 1
    }

    pub(crate) fn mark(&mut self, index: usize) {
        self.bits[index / 64] |= 1 << (index % 64);
        self.count += 1;
    }

    pub(crate) fn clear(&mut self) {
        *self = Self { settled: true, ..Self::default() };
    }

    /// Indices of the void posts, ascending.
    pub(crate) fn iter(&self) -> impl Iterator<Item = usize> {
        let words = self.bits.iter().enumerate().filter(|&(_, &word)| word != 0);
        words
            .flat_map(|(place, &word)| (0..64).filter(move |bit| word >> bit & 1 == 1).map(move |bit| place * 64 + bit))
    }
}
