//! Fingerprints: what a result was made from, in 32 bytes.
//!
//! Equal fingerprints mean equal inputs, so a published result with the fingerprint of its present inputs is fresh.
//! Every item is preceded by its kind and its length, so that no two sequences of items feed the same bytes.

use std::fmt;

use serde::{Deserialize, Deserializer, Serialize, Serializer, de};

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
    pub(crate) fn from_hex(text: &str) -> Option<Self> {
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

    /// Adds a whole number that may be negative.
    #[must_use]
    pub fn signed(self, number: i64) -> Self {
        self.number(number as u64)
    }

    /// Adds a number, bit by bit.
    #[must_use]
    pub fn real(self, number: f64) -> Self {
        self.number(number.to_bits())
    }

    /// Adds which of several cases it is.
    #[must_use]
    pub fn case(mut self, case: u8) -> Self {
        self.begin(b'c', 1);
        self.put(&[case]);
        self
    }

    /// Adds what may be absent.
    #[must_use]
    pub fn maybe<T>(self, value: Option<T>, add: impl FnOnce(Self, T) -> Self) -> Self {
        match value {
            None => self.case(0),
            Some(value) => add(self.case(1), value),
        }
    }

    /// Adds a list: how many there are, then each.
    #[must_use]
    pub fn list<T>(self, values: impl ExactSizeIterator<Item = T>, add: impl Fn(Self, T) -> Self) -> Self {
        let counted = self.number(values.len() as u64);
        values.fold(counted, add)
    }

    /// Adds rows of values, as long as the first says, one after the other.
    #[must_use]
    pub fn rows<'a, T: Copy + 'a, const N: usize>(
        mut self,
        rows: impl ExactSizeIterator<Item = &'a [T]>,
        to_bytes: impl Fn(T) -> [u8; N],
    ) -> Self {
        self.begin(b'r', rows.len());
        for row in rows {
            self.block.extend_from_slice(&(row.len() as u64).to_le_bytes());
            self.block.extend(row.iter().flat_map(|&value| to_bytes(value)));
            self.flush_full();
        }
        self
    }

    /// Adds `count` bytes, made one by one.
    #[must_use]
    pub fn stream(mut self, count: usize, mut bytes: impl Iterator<Item = u8>) -> Self {
        self.begin(b's', count);
        let mut left = count;
        while 0 < left {
            let now = left.min(BLOCK_BYTES);
            self.block.extend(bytes.by_ref().take(now));
            self.flush_full();
            left -= now;
        }
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
    fn every_value_of_long_rows_counts() {
        let rows = |odd: usize| {
            let mut values = vec![7i32; 60_000];
            values[odd] = 8;
            builder().rows(values.chunks(300), i32::to_le_bytes).finish()
        };
        let all = [rows(0), rows(30_017), rows(59_999)];
        assert!(all[0] != all[1] && all[1] != all[2] && all[0] != all[2]);
        let flat = [7i32; 600];
        assert_ne!(
            builder().rows(flat.chunks(300), i32::to_le_bytes).finish(),
            builder().rows(flat.chunks(200), i32::to_le_bytes).finish()
        );
        let stream = |odd: usize| builder().stream(200_000, (0..200_000).map(|at| u8::from(at == odd))).finish();
        assert_ne!(stream(199_999), stream(200_000));
    }

    #[test]
    fn what_is_absent_differs_from_every_value() {
        let maybe = |value: Option<u64>| builder().maybe(value, FingerprintBuilder::number).finish();
        assert!(maybe(None) != maybe(Some(0)) && maybe(Some(0)) != maybe(Some(1)));
        let list = |values: &[u64]| builder().list(values.iter(), |b, &value| b.number(value)).number(3).finish();
        assert_ne!(list(&[1, 2]), list(&[1, 2, 3]));
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
        let values = [1i32, 2, 3, 4];
        let fingerprint = builder().number(1).case(2).text("a").rows(values.chunks(2), i32::to_le_bytes).finish();
        assert_eq!(&fingerprint.to_string()[..16], "e543bbcd54a81e1d");
    }
}
