//! Whether a packed strip or tile holds as many bytes as its rows have, before it is decoded.
//!
//! The decoder stops when it has what it wants. So it takes a stream that goes on for gigabytes, one that ends in the
//! next strip, or rows that are longer than they should be and shift all after them, for sound ones. Here the stream
//! is followed to its end once, into nowhere, and no further than one byte beyond what the chunk may hold. Where the
//! packing has a checksum, that is held as well.

use std::io::{self, BufRead, BufReader, Read};

use flate2::bufread::ZlibDecoder;
use weezl::{BitOrder, LzwStatus, decode};

/// How strips and tiles are packed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Packing {
    /// Stored as they are.
    None,
    Lzw,
    Deflate,
    PackBits,
    Zstd,
}

/// What a chunk must unpack to.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Promise {
    /// Bytes in a row.
    pub row: u64,
    /// Bytes of the rows that the raster has here.
    pub least: u64,
    /// Bytes of all rows of a chunk: some writers fill the last one up.
    pub most: u64,
}

/// Follows a chunk to its end.
///
/// # Errors
/// In words, when it does not unpack to what its rows have.
pub(crate) fn check(packing: Packing, packed: impl Read, promise: Promise) -> Result<(), String> {
    let packed = BufReader::with_capacity(1 << 15, packed);
    // Whatever comes after the last row is counted no further than this.
    let limit = promise.most + 1;
    let (found, end) = match packing {
        Packing::None => return Ok(()),
        Packing::PackBits => return runs(packed, promise),
        Packing::Deflate => counted(ZlibDecoder::new(packed), limit),
        Packing::Lzw => counted(Lzw::new(packed), limit),
        Packing::Zstd => match zstd::Decoder::with_buffer(packed) {
            Ok(decoder) => counted(decoder.single_frame(), limit),
            Err(error) => (0, Err(error)),
        },
    };
    match end {
        _ if promise.most < found => {
            Err(format!("it unpacks to more than the {} bytes that its rows have", promise.most))
        }
        // Some writers leave out the end of an LZW stream.
        Err(error) if found < promise.least || packing != Packing::Lzw => Err(error.to_string()),
        _ if found < promise.least => {
            Err(format!("it unpacks to {found} bytes, expected the {} that its rows have", promise.least))
        }
        _ => Ok(()),
    }
}

/// How many bytes come, up to a limit, and what ended them.
fn counted(mut unpacked: impl Read, limit: u64) -> (u64, io::Result<()>) {
    let (mut buffer, mut found) = (vec![0; 1 << 16], 0);
    while found < limit {
        let room = buffer.len().min(usize::try_from(limit - found).unwrap_or(usize::MAX));
        match unpacked.read(&mut buffer[..room]) {
            Ok(0) => return (found, Ok(())),
            Ok(count) => found += count as u64,
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            Err(error) => return (found, Err(error)),
        }
    }
    (found, Ok(()))
}

/// Follows runs of PackBits. Each row is packed by itself (TIFF 6.0, section 9), so none goes beyond its row.
fn runs(packed: impl BufRead, promise: Promise) -> Result<(), String> {
    let mut bytes = packed.bytes();
    let mut next = || bytes.next().transpose().map_err(|error| error.to_string());
    let mut found = 0;
    while let Some(head) = next()? {
        // Beyond the last row, nothing is looked at but whether anything is there: some writers end on an even byte.
        let count = match head.cast_signed() {
            -128 => continue,
            head @ 0.. => {
                let count = head as u64 + 1;
                for _ in 0..count {
                    next()?.ok_or("its last run of PackBits is cut off")?;
                }
                count
            }
            head => {
                next()?.ok_or("its last run of PackBits is cut off")?;
                1 + u64::from(head.unsigned_abs())
            }
        };
        let row = found / promise.row;
        if promise.row < found % promise.row + count {
            let (before, expected) = (found % promise.row + count, promise.row);
            return Err(format!("its row {row} unpacks to {before} bytes or more, expected {expected}"));
        }
        found += count;
        if promise.most < found {
            return Err(format!("it unpacks to more than the {} bytes that its rows have", promise.most));
        }
    }
    match found < promise.least {
        true => Err(format!("it unpacks to {found} bytes, expected the {} that its rows have", promise.least)),
        false => Ok(()),
    }
}

/// A stream of LZW as TIFF has it.
pub(crate) struct Lzw<R> {
    packed: R,
    decoder: decode::Decoder,
}

impl<R: BufRead> Lzw<R> {
    pub(crate) fn new(packed: R) -> Self {
        let configuration = decode::Configuration::with_tiff_size_switch(BitOrder::Msb, 8);
        Self { packed, decoder: configuration.with_yield_on_full_buffer(true).build() }
    }
}

impl<R: BufRead> Read for Lzw<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        loop {
            let done = self.decoder.decode_bytes(self.packed.fill_buf()?, buffer);
            self.packed.consume(done.consumed_in);
            match done.status {
                Ok(LzwStatus::Ok) if done.consumed_out == 0 => {}
                Ok(LzwStatus::Ok | LzwStatus::Done) => return Ok(done.consumed_out),
                Ok(LzwStatus::NoProgress) => return Err(io::Error::other("its LZW stream has no end")),
                Err(error) => return Err(io::Error::other(error.to_string())),
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use std::io::Write;

    use flate2::Compression;
    use flate2::write::ZlibEncoder;

    use super::*;

    const ROWS: Promise = Promise { row: 4, least: 8, most: 12 };

    fn deflated(bytes: &[u8]) -> Vec<u8> {
        let mut encoder = ZlibEncoder::new(Vec::new(), Compression::fast());
        encoder.write_all(bytes).unwrap();
        encoder.finish().unwrap()
    }

    fn lzw(bytes: &[u8]) -> Vec<u8> {
        weezl::encode::Encoder::with_tiff_size_switch(BitOrder::Msb, 8).encode(bytes).unwrap()
    }

    #[track_caller]
    fn refused(packing: Packing, packed: &[u8], expected: &str) {
        let error = check(packing, packed, ROWS).unwrap_err();
        assert!(error.contains(expected), "{packing:?}: {error}");
    }

    #[test]
    fn a_chunk_that_holds_its_rows_or_all_rows_of_a_chunk_is_sound() {
        for count in [8, 10, 12] {
            let bytes = vec![7; count];
            let zstd = zstd::encode_all(&bytes[..], 1).unwrap();
            for (packing, packed) in
                [(Packing::Deflate, deflated(&bytes)), (Packing::Lzw, lzw(&bytes)), (Packing::Zstd, zstd)]
            {
                assert_eq!(check(packing, &packed[..], ROWS), Ok(()), "{packing:?}, {count} bytes");
            }
        }
        // Two rows: four equal bytes, and two times two as they are; a byte that means nothing ends them.
        assert_eq!(check(Packing::PackBits, &[253, 9, 1, 1, 2, 1, 3, 4, 128][..], ROWS), Ok(()));
    }

    #[test]
    fn a_chunk_that_unpacks_to_more_or_less_than_its_rows_is_refused() {
        for (count, expected) in [(13, "more than the 12 bytes"), (1 << 20, "more than the 12 bytes"), (7, "7 bytes")] {
            let bytes = vec![0; count];
            refused(Packing::Deflate, &deflated(&bytes), expected);
            refused(Packing::Lzw, &lzw(&bytes), expected);
            refused(Packing::Zstd, &zstd::encode_all(&bytes[..], 1).unwrap(), expected);
        }
    }

    #[test]
    fn a_run_of_packbits_that_leaves_its_row_is_refused() {
        refused(Packing::PackBits, &[252, 9, 253, 9, 253, 9], "row 0 unpacks to 5 bytes or more, expected 4");
        refused(Packing::PackBits, &[253, 9, 4, 1, 2, 3, 4, 5], "row 1 unpacks to 5 bytes");
        refused(Packing::PackBits, &[253, 9], "it unpacks to 4 bytes, expected the 8");
        refused(Packing::PackBits, &[253, 9, 253, 9, 253, 9, 253, 9], "more than the 12 bytes");
        refused(Packing::PackBits, &[253, 9, 3, 1, 2], "cut off");
        refused(Packing::PackBits, &[253], "cut off");
    }

    #[test]
    fn the_checksum_of_a_deflated_chunk_is_held() {
        let mut packed = deflated(&[1, 2, 3, 4, 5, 6, 7, 8]);
        let last = packed.len() - 1;
        packed[last] ^= 1;
        refused(Packing::Deflate, &packed, "corrupt");
    }
}
