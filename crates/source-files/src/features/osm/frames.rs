//! The blocks of an `.osm.pbf` file: where each begins, how it is packed, and its bytes once unpacked.

use std::io::{BufReader, Read, Seek, SeekFrom};

use flate2::bufread::ZlibDecoder;

use super::wire::{Fault, Fields};
use crate::SourceError;
use crate::error::at_most;
use crate::limits::{OSM_BLOCK_BYTES_MAX, OSM_HEAD_BYTES_MAX};
use crate::store::{Handle, Store};

/// How every file begins, after four bytes of length.
pub(crate) const MARK: &[u8] = b"\x0a\x09OSMHeader";

/// One block of the file, before it is unpacked.
#[derive(Clone, Copy, Debug)]
pub(super) struct Frame {
    /// Counted from 0.
    pub index: u64,
    /// Where its head begins.
    begins_at: u64,
    packed_at: u64,
    packed_bytes: u64,
    pub kind: FrameKind,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum FrameKind {
    Header,
    Data,
    /// Something that readers are to pass over.
    Other,
}

/// The file with its frames.
pub(super) struct Frames<'a> {
    store: &'a Store,
    file: BufReader<Handle>,
    packed: Vec<u8>,
    unpacked: Vec<u8>,
}

impl<'a> Frames<'a> {
    pub(super) fn open(store: &'a Store) -> Result<Self, SourceError> {
        let file = BufReader::with_capacity(1 << 16, store.handle()?);
        Ok(Self { store, file, packed: Vec::new(), unpacked: Vec::new() })
    }

    /// Where all blocks lie. Only their heads are read.
    pub(super) fn list(&mut self) -> Result<Vec<Frame>, SourceError> {
        let (mut frames, mut at) = (Vec::new(), 0);
        while at < self.store.len() {
            let frame = self.head(frames.len() as u64, at)?;
            at = frame.packed_at + frame.packed_bytes;
            frames.push(frame);
        }
        Ok(frames)
    }

    fn head(&mut self, index: u64, at: u64) -> Result<Frame, SourceError> {
        let name = |what: &str| format!("{what} of block {index} (byte {at})");
        self.store.holds(&name("the length"), at + 4)?;
        let length = self.bytes(at, 4)?;
        let length = u64::from(u32::from_be_bytes([length[0], length[1], length[2], length[3]]));
        if OSM_HEAD_BYTES_MAX < length {
            let (found, expected) = (format!("{length} bytes long"), "at most 65536: a head of OpenStreetMap data");
            return Err(self.store.malformed(&name("the head"), found, expected));
        }
        self.store.holds(&name("the head"), at + 4 + length)?;
        let head = self.bytes(at + 4, length)?;
        let broken = |fault: Fault| self.store.malformed(&name("the head"), fault.into(), "fields of OpenStreetMap");
        let (mut kind, mut packed_bytes) = (FrameKind::Other, 0);
        for field in Fields(&head) {
            match field.map_err(broken)? {
                (1, value) => {
                    kind = match value.bytes().map_err(broken)? {
                        b"OSMHeader" => FrameKind::Header,
                        b"OSMData" => FrameKind::Data,
                        _ => FrameKind::Other,
                    };
                }
                (3, value) => packed_bytes = value.number().map_err(broken)?,
                _ => {}
            }
        }
        at_most(self.store.path(), packed_bytes, OSM_BLOCK_BYTES_MAX, "bytes in a block")?;
        let packed_at = at + 4 + length;
        self.store.holds(&format!("block {index} (byte {at})"), packed_at + packed_bytes)?;
        Ok(Frame { index, begins_at: at, packed_at, packed_bytes, kind })
    }

    fn bytes(&mut self, at: u64, count: u64) -> Result<Vec<u8>, SourceError> {
        let mut bytes = vec![0; usize::try_from(count).expect("heads are short")];
        let read = self.file.seek(SeekFrom::Start(at)).and_then(|_| self.file.read_exact(&mut bytes));
        read.map_err(|source| self.store.stopped(source))?;
        Ok(bytes)
    }

    /// The bytes of a block, unpacked.
    fn unpack(&mut self, frame: &Frame) -> Result<&[u8], SourceError> {
        let mut packed = std::mem::take(&mut self.packed);
        packed.clear();
        let read = self.file.seek(SeekFrom::Start(frame.packed_at));
        let read = read.and_then(|_| self.file.by_ref().take(frame.packed_bytes).read_to_end(&mut packed));
        read.map_err(|source| self.store.stopped(source))?;
        let mut unpacked = std::mem::take(&mut self.unpacked);
        let done = unpack(&packed, &mut unpacked);
        (self.packed, self.unpacked) = (packed, unpacked);
        done.map_err(|refusal| self.refused(frame, refusal))?;
        Ok(&self.unpacked)
    }

    /// What is read of a block once it is unpacked.
    pub(super) fn with_bytes<T, E: Into<Stop>>(
        &mut self,
        frame: &Frame,
        read: impl FnOnce(&[u8]) -> Result<T, E>,
    ) -> Result<T, SourceError> {
        let found = read(self.unpack(frame)?);
        found.map_err(|stop| match stop.into() {
            Stop::Fault(fault) => self.broken(frame, fault),
            Stop::Refused(error) => *error,
        })
    }

    fn refused(&self, frame: &Frame, refusal: Refusal) -> SourceError {
        match refusal {
            Refusal::Broken(reason) => self.broken(frame, &reason),
            Refusal::TooLarge(found) => {
                let (what, limit) = ("bytes in a block once unpacked (or more)", OSM_BLOCK_BYTES_MAX);
                SourceError::TooLarge { path: self.store.path().into(), what, found, limit }
            }
            Refusal::Packing(name) => {
                let found = format!("OpenStreetMap data packed with {name}");
                SourceError::NotFeatures { path: self.store.path().into(), found }
            }
        }
    }

    /// A block that does not hold what it should.
    fn broken(&self, frame: &Frame, reason: &str) -> SourceError {
        let what = format!("block {} (byte {})", frame.index, frame.begins_at);
        self.store.malformed(&what, reason.into(), "a sound block of OpenStreetMap data")
    }
}

/// Why a block is not read on: it is broken, or the file is refused.
pub(super) enum Stop {
    Fault(Fault),
    Refused(Box<SourceError>),
}

impl From<Fault> for Stop {
    fn from(fault: Fault) -> Self {
        Stop::Fault(fault)
    }
}

impl From<SourceError> for Stop {
    fn from(error: SourceError) -> Self {
        Stop::Refused(Box::new(error))
    }
}

enum Refusal {
    Broken(String),
    TooLarge(u64),
    Packing(&'static str),
}

impl From<Fault> for Refusal {
    fn from(fault: Fault) -> Self {
        Refusal::Broken(fault.into())
    }
}

/// Unpacks the message of a block. No more is unpacked than the limit, whatever the block promises.
fn unpack(message: &[u8], unpacked: &mut Vec<u8>) -> Result<(), Refusal> {
    unpacked.clear();
    let (mut promised, mut packing) = (None, None);
    for field in Fields(message) {
        match field? {
            (2, value) => promised = Some(value.number()?),
            (field @ (1 | 3..=7), value) => packing = Some((field, value.bytes()?)),
            _ => {}
        }
    }
    if let Some(promised) = promised.filter(|&promised| OSM_BLOCK_BYTES_MAX < promised) {
        return Err(Refusal::TooLarge(promised));
    }
    let limit = OSM_BLOCK_BYTES_MAX + 1;
    let read = match packing {
        Some((1, bytes)) => bytes.take(limit).read_to_end(unpacked),
        Some((3, bytes)) => ZlibDecoder::new(bytes).take(limit).read_to_end(unpacked),
        Some((7, bytes)) => zstd::Decoder::new(bytes).and_then(|stream| stream.take(limit).read_to_end(unpacked)),
        Some((4, _)) => return Err(Refusal::Packing("LZMA")),
        Some((6, _)) => return Err(Refusal::Packing("LZ4")),
        Some(_) => return Err(Refusal::Packing("bzip2")),
        None => return Err(Refusal::Broken("a block without data".into())),
    };
    read.map_err(|error| Refusal::Broken(format!("data that cannot be unpacked ({error})")))?;
    let found = unpacked.len() as u64;
    match promised {
        _ if OSM_BLOCK_BYTES_MAX < found => Err(Refusal::TooLarge(found)),
        Some(promised) if promised != found => {
            Err(Refusal::Broken(format!("{found} bytes once unpacked, where it promises {promised}")))
        }
        _ => Ok(()),
    }
}
