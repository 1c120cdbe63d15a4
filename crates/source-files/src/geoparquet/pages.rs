//! The bytes of a local file for the library, which unpacks what a page promises: its header is looked at first.

use std::collections::BTreeSet;
use std::fs::File;
use std::io::{Cursor, Read, Seek, SeekFrom};
use std::path::Path;
use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};

use bytes::Bytes;
use parquet::errors::{ParquetError, Result};
use parquet::file::reader::{ChunkReader, Length};

use super::thrift;
use crate::kept::locked;
use crate::limits::{PARQUET_PAGE_BYTES_MAX, PARQUET_VALUES_A_BYTE, PARQUET_VALUES_FREE};

/// Bytes that the header of a page may have: its statistics hold two values of a column, which may be geometries.
const HEADER_BYTES: u64 = 64 << 10;

/// A local file.
pub(super) struct Pages {
    file: Mutex<File>,
    len: u64,
    /// Where pages begin behind headers that were looked at.
    bodies: Mutex<BTreeSet<u64>>,
    /// Values that pages promised so far.
    values: AtomicU64,
}

impl Pages {
    pub fn open(path: &Path, len: u64) -> std::io::Result<Self> {
        Ok(Self { file: Mutex::new(File::open(path)?), len, bodies: Mutex::default(), values: AtomicU64::new(0) })
    }

    fn bytes(&self, start: u64, length: u64) -> Result<Vec<u8>> {
        let mut bytes = Vec::new();
        let mut file = locked(&self.file);
        file.seek(SeekFrom::Start(start))?;
        (&mut *file).take(length).read_to_end(&mut bytes)?;
        Ok(bytes)
    }
}

impl Length for Pages {
    fn len(&self) -> u64 {
        self.len
    }
}

impl ChunkReader for Pages {
    type T = Cursor<Vec<u8>>;

    /// The library asks so for the header of a page, and for the page behind it where it has read that.
    fn get_read(&self, start: u64) -> Result<Self::T> {
        let broken = |text: String| ParquetError::General(text);
        let bytes = self.bytes(start, HEADER_BYTES)?;
        if locked(&self.bodies).contains(&start) {
            return Ok(Cursor::new(bytes));
        }
        let page = thrift::page(&bytes).ok_or_else(|| broken("a page without a header".into()))?;
        if PARQUET_PAGE_BYTES_MAX < page.bytes {
            return Err(broken(format!("a page of {} bytes, at most {PARQUET_PAGE_BYTES_MAX} are read", page.bytes)));
        }
        let limit = PARQUET_VALUES_FREE + PARQUET_VALUES_A_BYTE * self.len;
        let values = self.values.fetch_add(page.values, Ordering::Relaxed).saturating_add(page.values);
        if limit < values {
            return Err(broken(format!("pages of {values} values, at most {limit} are read of a file of that size")));
        }
        locked(&self.bodies).insert(start + page.header);
        Ok(Cursor::new(bytes))
    }

    fn get_bytes(&self, start: u64, length: usize) -> Result<Bytes> {
        locked(&self.bodies).remove(&start);
        let bytes = self.bytes(start, length as u64)?;
        match bytes.len() == length {
            true => Ok(bytes.into()),
            false => Err(ParquetError::EOF(format!("expected {length} bytes from {start}, found {}", bytes.len()))),
        }
    }
}
