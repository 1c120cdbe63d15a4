//! A tile's TIN, its gain curve, its removals and what was measured of it: with the frame as it is, and with a frame
//! around the bytes, so that the content is reached.
#![no_main]

use std::path::Path;

use store::{
    decode_curve, decode_measured, decode_removals, decode_tile, encode_curve, encode_measured, encode_removals,
    encode_tile,
};
use libfuzzer_sys::fuzz_target;

/// The frame as `store/src/frame.rs` draws it.
fn framed(kind: &[u8; 3], payload: &[u8]) -> Vec<u8> {
    let mut file = [&b"\x89"[..], kind, b"\r\n\x1a\n"].concat();
    file.extend(1u32.to_le_bytes());
    file.extend(1u32.to_le_bytes());
    file.extend([7; 32]);
    file.extend((payload.len() as u64).to_le_bytes());
    file.extend(crc32fast::hash(payload).to_le_bytes());
    let checksum = crc32fast::hash(&file);
    file.extend(checksum.to_le_bytes());
    file.extend(payload);
    file
}

fn check(bytes: &[u8]) {
    let path = Path::new("fuzz");
    if let Ok((stamp, tile)) = decode_tile(path, bytes) {
        // Whatever it holds, asking whether it is sound gives an answer.
        let _ = tile.tin.check();
        assert_eq!(encode_tile(&stamp, &tile), bytes);
    }
    if let Ok((stamp, curve)) = decode_curve(path, bytes) {
        assert_eq!(encode_curve(&stamp, &curve), bytes);
    }
    if let Ok((stamp, removals)) = decode_removals(path, bytes) {
        assert_eq!(encode_removals(&stamp, &removals), bytes);
    }
    if let Ok((stamp, measured)) = decode_measured(path, bytes) {
        assert_eq!(encode_measured(&stamp, &measured), bytes);
    }
}

fuzz_target!(|bytes: &[u8]| {
    check(bytes);
    for kind in [b"TIN", b"CRV", b"REM", b"SUM"] {
        check(&framed(kind, bytes));
    }
});
