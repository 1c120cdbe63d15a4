//! The frame around our private files: what kind, made from what, how long, undamaged.
//!
//! ```text
//! offset  0  8 bytes  magic of the kind
//!         8  u32      format version
//!        12  u32      algorithm revision
//!        16  32 bytes fingerprint of the inputs
//!        48  u64      length of the payload
//!        56  u32      CRC-32 of the payload
//!        60  u32      CRC-32 of the 60 bytes before
//!        64           payload
//! ```

use std::path::Path;

use crate::engine::{Fingerprint, Stamp};

use crate::DatabaseError;
use crate::codec::PAYLOAD_BYTES_MAX;

/// Bytes before the payload.
pub(crate) const FRAME_BYTES: usize = 64;

/// What a framed file holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    Tile,
    Curve,
    Removals,
    Measured,
    Profile,
    Lines,
    Level,
    Buildings,
    Objects,
}

impl Kind {
    fn magic(self) -> [u8; 8] {
        match self {
            Kind::Tile => *b"\x89TIN\r\n\x1a\n",
            Kind::Curve => *b"\x89CRV\r\n\x1a\n",
            Kind::Removals => *b"\x89REM\r\n\x1a\n",
            Kind::Measured => *b"\x89SUM\r\n\x1a\n",
            Kind::Profile => *b"\x89PRO\r\n\x1a\n",
            Kind::Lines => *b"\x89LIN\r\n\x1a\n",
            Kind::Level => *b"\x89LEV\r\n\x1a\n",
            Kind::Buildings => *b"\x89BLD\r\n\x1a\n",
            Kind::Objects => *b"\x89OBJ\r\n\x1a\n",
        }
    }

    /// Version of its files. Files of another one are made again.
    fn version(self) -> u32 {
        match self {
            // 2: how much the ground curves; 3: residuals against the sources alone; 4: steps onto decks; 5: steep
            // decks, and such as end in the air.
            Kind::Measured => 5,
            // 2: corners as steps from one to the next.
            Kind::Buildings => 2,
            // 2: nothing over holes.
            Kind::Profile => 2,
            // 2: what lies over holes; 3: what has its width.
            Kind::Level => 3,
            Kind::Tile | Kind::Curve | Kind::Removals | Kind::Lines | Kind::Objects => 1,
        }
    }
}

/// `payload` in its frame.
pub(crate) fn seal(kind: Kind, stamp: &Stamp, payload: &[u8]) -> Vec<u8> {
    let mut file = Vec::with_capacity(FRAME_BYTES + payload.len());
    file.extend_from_slice(&kind.magic());
    file.extend_from_slice(&kind.version().to_le_bytes());
    file.extend_from_slice(&stamp.algorithm_revision.to_le_bytes());
    file.extend_from_slice(&stamp.fingerprint.0);
    file.extend_from_slice(&(payload.len() as u64).to_le_bytes());
    file.extend_from_slice(&crc32fast::hash(payload).to_le_bytes());
    let checksum = crc32fast::hash(&file);
    file.extend_from_slice(&checksum.to_le_bytes());
    file.extend_from_slice(payload);
    file
}

/// The stamp of the framed file that begins with `bytes` (64 are enough), which lies at `path`.
pub(crate) fn read_stamp(kind: Kind, path: &Path, bytes: &[u8]) -> Result<Stamp, DatabaseError> {
    Ok(read_header(kind, path, bytes)?.stamp)
}

/// The stamp and the payload of a whole framed file, which lies at `path`.
pub(crate) fn open<'a>(kind: Kind, path: &Path, bytes: &'a [u8]) -> Result<(Stamp, &'a [u8]), DatabaseError> {
    let header = read_header(kind, path, bytes)?;
    let payload = &bytes[FRAME_BYTES..];
    let found = payload.len() as u64;
    if found != header.payload_length {
        let (path, expected) = (path.to_path_buf(), header.payload_length);
        return Err(DatabaseError::WrongLength { path, section: "payload", found, expected });
    }
    check(path, "payload", crc32fast::hash(payload), header.payload_checksum)?;
    Ok((header.stamp, payload))
}

struct FrameHeader {
    stamp: Stamp,
    payload_length: u64,
    payload_checksum: u32,
}

fn read_header(kind: Kind, path: &Path, bytes: &[u8]) -> Result<FrameHeader, DatabaseError> {
    let Some(header) = bytes.first_chunk::<FRAME_BYTES>() else {
        let (path, found) = (path.to_path_buf(), bytes.len() as u64);
        return Err(DatabaseError::WrongLength { path, section: "header", found, expected: FRAME_BYTES as u64 });
    };
    let word = |at: usize| u32::from_le_bytes(part(header, at));
    let (found, expected): ([u8; 8], _) = (part(header, 0), kind.magic());
    if found != expected {
        return Err(DatabaseError::NotOurFile { path: path.to_path_buf(), found, expected });
    }
    if word(8) != kind.version() {
        let (path, expected) = (path.to_path_buf(), kind.version());
        return Err(DatabaseError::OtherVersion { path, found: word(8), expected });
    }
    check(path, "header", crc32fast::hash(&header[..60]), word(60))?;
    let payload_length = u64::from_le_bytes(part(header, 48));
    if PAYLOAD_BYTES_MAX < payload_length {
        let (found, limit) = (payload_length, PAYLOAD_BYTES_MAX);
        return Err(DatabaseError::TooLarge { path: path.to_path_buf(), found, limit });
    }
    let stamp = Stamp { algorithm_revision: word(12), fingerprint: Fingerprint(part(header, 16)) };
    Ok(FrameHeader { stamp, payload_length, payload_checksum: word(56) })
}

/// `N` bytes of the header from `at`, which all lie inside it.
fn part<const N: usize>(header: &[u8; FRAME_BYTES], at: usize) -> [u8; N] {
    std::array::from_fn(|i| header[at + i])
}

fn check(path: &Path, section: &'static str, found: u32, expected: u32) -> Result<(), DatabaseError> {
    if found == expected {
        return Ok(());
    }
    let (found, expected) = (format!("{found:08x}"), format!("{expected:08x}"));
    Err(DatabaseError::WrongChecksum { path: path.to_path_buf(), section, found, expected })
}

/// That `what` does not make sense in the payload of the file at `path`.
pub(crate) fn malformed(path: &Path, what: impl Into<String>) -> DatabaseError {
    DatabaseError::Malformed { path: path.to_path_buf(), section: "payload", what: what.into() }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check_error(bytes: &[u8], expected: &str) {
        let error = open(Kind::Tile, Path::new("x.tin"), bytes).unwrap_err().to_string();
        assert!(error.starts_with(expected), "{error:?} does not start with {expected:?}");
    }

    #[test]
    fn what_is_wrong_is_named() {
        let stamp = Stamp { algorithm_revision: 3, fingerprint: Fingerprint([9; 32]) };
        let good = seal(Kind::Tile, &stamp, b"payload");
        assert_eq!(open(Kind::Tile, Path::new("x.tin"), &good).unwrap(), (stamp, &b"payload"[..]));
        assert_eq!(read_stamp(Kind::Tile, Path::new("x.tin"), &good[..64]).unwrap(), stamp);
        check_error(&seal(Kind::Curve, &stamp, b"payload"), "x.tin: header: found [89, 43, 52, 56");
        check_error(&good[..20], "x.tin: header: found 20 bytes, expected 64");
        check_error(&good[..70], "x.tin: payload: found 6 bytes, expected 7");
        let with = |at: usize, value: u8| {
            let mut bytes = good.clone();
            bytes[at] = value;
            bytes
        };
        check_error(&with(8, 2), "x.tin: found format version 2, expected 1");
        check_error(&with(20, 2), "x.tin: header: found checksum");
        check_error(&with(64, 2), "x.tin: payload: found checksum");
    }
}
