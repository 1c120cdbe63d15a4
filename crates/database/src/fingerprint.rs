//! Fingerprints: what a result was made from, in 32 bytes.
//!
//! Equal fingerprints mean equal inputs, so a published result with the fingerprint of its present inputs is fresh.
//! Every item is preceded by its kind and its length, so that no two sequences of items feed the same bytes.

use std::fmt;

use serde::{Deserialize, Deserializer, Serialize, Serializer, de};
use terrain::{Dem, Importance, Post, PostRect};

/// Bytes collected before they are hashed: long enough for the hash to use all its lanes.
const BLOCK_BYTES: usize = 1 << 16;

/// A hash of everything a result depends on.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Fingerprint(pub [u8; 32]);

impl Fingerprint {
    /// The fingerprint of a file's content.
    pub fn of_bytes(bytes: &[u8]) -> Self {
        Self(*blake3::hash(bytes).as_bytes())
    }

    /// The same of all that `reader` gives, in bounded memory.
    ///
    /// # Errors
    /// When reading stops.
    pub fn of_reader(reader: impl std::io::Read) -> std::io::Result<Self> {
        let mut hasher = blake3::Hasher::new();
        hasher.update_reader(reader)?;
        Ok(Self(*hasher.finalize().as_bytes()))
    }

    /// The fingerprint of 64 hexadecimal digits; `None` when it is anything else.
    pub fn from_hex(text: &str) -> Option<Self> {
        let lower = text.bytes().all(|byte| matches!(byte, b'0'..=b'9' | b'a'..=b'f'));
        let hash = blake3::Hash::from_hex(text).ok()?;
        lower.then_some(Self(*hash.as_bytes()))
    }
}

impl fmt::Display for Fingerprint {
    /// 64 hexadecimal digits.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&blake3::Hash::from_bytes(self.0).to_hex())
    }
}

impl fmt::Debug for Fingerprint {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Fingerprint({self})")
    }
}

impl Serialize for Fingerprint {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

impl<'de> Deserialize<'de> for Fingerprint {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let text = String::deserialize(deserializer)?;
        Self::from_hex(&text).ok_or_else(|| de::Error::custom(format!("{text:?} is not 64 hexadecimal digits")))
    }
}

/// Collects what a result depends on, item by item; the order of the items counts.
#[derive(Clone)]
pub struct FingerprintBuilder {
    hasher: blake3::Hasher,
    block: Vec<u8>,
}

impl FingerprintBuilder {
    /// Begins a fingerprint of `purpose`; equal items for different purposes give different fingerprints.
    pub fn new(purpose: &str) -> Self {
        let builder = Self { hasher: blake3::Hasher::new(), block: Vec::with_capacity(BLOCK_BYTES) };
        builder.text(purpose)
    }

    /// Adds a whole number.
    #[must_use]
    pub fn number(mut self, number: u64) -> Self {
        self.begin(b'n', 8);
        self.put(&number.to_le_bytes());
        self
    }

    /// Adds bytes.
    #[must_use]
    pub fn bytes(mut self, bytes: &[u8]) -> Self {
        self.begin(b'b', bytes.len());
        self.put(bytes);
        self
    }

    /// Adds a text.
    #[must_use]
    pub fn text(mut self, text: &str) -> Self {
        self.begin(b't', text.len());
        self.put(text.as_bytes());
        self
    }

    /// Adds the fingerprint of something else.
    #[must_use]
    pub fn fingerprint(mut self, fingerprint: Fingerprint) -> Self {
        self.begin(b'f', 32);
        self.put(&fingerprint.0);
        self
    }

    /// Adds a window of heights: where it lies, every height, which posts are void.
    #[must_use]
    pub fn heights(mut self, dem: &Dem) -> Self {
        let rect = dem.rect();
        self.begin(b'h', rect.post_count());
        self.rect(rect);
        for row in rect.south..=rect.north {
            self.put_all(dem.row(row), |height| height.to_le_bytes());
        }
        self.put(&(dem.void_count() as u64).to_le_bytes());
        if 0 < dem.void_count() {
            self.put_posts(rect, |post| u8::from(dem.is_void(post)));
        }
        self
    }

    /// Adds a window of weights and classes: where it lies, every weight, every class.
    #[must_use]
    pub fn importance(mut self, importance: &Importance) -> Self {
        let rect = importance.rect();
        self.begin(b'i', rect.post_count());
        self.rect(rect);
        match importance.uniform_weight() {
            Some(weight) => {
                self.put(b"u");
                self.put(&weight.to_le_bytes());
            }
            None => {
                self.put(b"v");
                for row in rect.south..=rect.north {
                    if let Some(weights) = importance.weights_of_row(row) {
                        self.put_all(weights, |weight| weight.to_le_bytes());
                    }
                }
            }
        }
        self.put_posts(rect, |post| importance.class(post));
        self
    }

    /// The fingerprint of all that was added.
    #[must_use]
    pub fn finish(mut self) -> Fingerprint {
        self.hasher.update(&self.block);
        Fingerprint(*self.hasher.finalize().as_bytes())
    }

    fn begin(&mut self, kind: u8, length: usize) {
        self.put(&[kind]);
        self.put(&(length as u64).to_le_bytes());
    }

    fn rect(&mut self, rect: PostRect) {
        for line in [rect.south, rect.west, rect.north, rect.east] {
            self.put(&line.to_le_bytes());
        }
    }

    fn put_posts(&mut self, rect: PostRect, value: impl Fn(Post) -> u8) {
        for row in rect.south..=rect.north {
            self.block.extend((rect.west..=rect.east).map(|col| value(Post::new(row, col))));
            self.flush_full();
        }
    }

    fn put_all<T: Copy, const N: usize>(&mut self, values: &[T], to_bytes: impl Fn(T) -> [u8; N]) {
        self.block.extend(values.iter().flat_map(|&value| to_bytes(value)));
        self.flush_full();
    }

    fn put(&mut self, bytes: &[u8]) {
        self.block.extend_from_slice(bytes);
        self.flush_full();
    }

    fn flush_full(&mut self) {
        if BLOCK_BYTES <= self.block.len() {
            self.hasher.update(&self.block);
            self.block.clear();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn builder() -> FingerprintBuilder {
        FingerprintBuilder::new("tests")
    }

    #[test]
    fn the_same_bytes_cut_otherwise_give_another_fingerprint() {
        let whole = builder().text("ab").text("c").finish();
        assert_ne!(whole, builder().text("a").text("bc").finish());
        assert_ne!(whole, builder().text("ab").bytes(b"c").finish());
        assert_ne!(whole, FingerprintBuilder::new("others").text("ab").text("c").finish());
        assert_eq!(whole, builder().text("ab").text("c").finish());
    }

    #[test]
    fn every_height_counts_and_so_does_its_place() {
        let rect = PostRect::of_size(200, 300);
        let dem = |odd: Post| Dem::from_fn(rect, |post| Some(if post == odd { 1 } else { 0 }));
        let flat = builder().heights(&dem(Post::new(-1, -1))).finish();
        for odd in [Post::new(0, 0), Post::new(100, 17), Post::new(199, 299)] {
            assert_ne!(flat, builder().heights(&dem(odd)).finish());
        }
        let moved = Dem::from_fn(PostRect::new(Post::new(1, 0), Post::new(200, 299)), |_| Some(0));
        assert_ne!(flat, builder().heights(&moved).finish());
        let holed = Dem::from_fn(rect, |post| (post != Post::new(5, 5)).then_some(0));
        assert_ne!(flat, builder().heights(&holed).finish());
    }

    #[test]
    fn every_weight_and_class_counts() {
        let rect = PostRect::of_size(9, 9);
        let mask = |weight, class| {
            let (mut weights, mut classes) = (vec![8000; 81], vec![0; 81]);
            (weights[40], classes[40]) = (weight, class);
            builder().importance(&Importance::new(rect, weights, classes)).finish()
        };
        let uniform = builder().importance(&Importance::uniform(rect, 8000)).finish();
        assert_eq!(mask(8000, 0), uniform);
        assert_ne!(mask(1000, 0), uniform);
        assert_ne!(mask(8000, 1), uniform);
    }

    #[test]
    fn a_fingerprint_survives_its_text() {
        let fingerprint = builder().number(7).finish();
        assert_eq!(Fingerprint::from_hex(&fingerprint.to_string()), Some(fingerprint));
        assert_eq!(Fingerprint::from_hex("12"), None);
        assert_eq!(Fingerprint::from_hex(&fingerprint.to_string().to_uppercase()), None);
    }

    /// Changing what is hashed, or how, makes every published tile stale: do it knowingly.
    #[test]
    fn fingerprints_do_not_change_between_versions() {
        let dem = Dem::from_fn(PostRect::of_size(3, 3), |post| Some(post.row * 10 + post.col));
        let fingerprint = builder().number(1).heights(&dem).importance(&Importance::uniform(dem.rect(), 8000)).finish();
        assert_eq!(&fingerprint.to_string()[..16], "603f85bcf120cf26");
    }
}
