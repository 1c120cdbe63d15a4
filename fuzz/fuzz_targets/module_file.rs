//! Load-module files: whatever the bytes, an answer or an error, and what is read is sound.
#![no_main]

use std::path::Path;

use libfuzzer_sys::fuzz_target;
use load_module_reader::{
    DECK_ENTRY_BYTES, DecksEntry, FIXED_TABLE_BYTES, INDEX_ENTRY_BYTES, PARTS_ENTRY_BYTES, SlmFile, TABLE_ENTRY_BYTES,
    VERSION, VERSION_WITH_DECKS,
};

/// The same with right checksums of the header, the index, each section, its decks and its parts, as far as the lengths
/// in the file say where those are: they stand in the way of everything behind them.
fn with_checksums(bytes: &[u8]) -> Vec<u8> {
    let mut bytes = bytes.to_vec();
    let word = |bytes: &[u8], at: usize| -> usize {
        let part = bytes.get(at..).and_then(|part| part.first_chunk::<4>());
        part.map_or(0, |part| u32::from_le_bytes(*part) as usize)
    };
    let header = word(&bytes, 12);
    let rows = word(&bytes, 44).saturating_sub(word(&bytes, 40));
    let columns = word(&bytes, 52).saturating_sub(word(&bytes, 48));
    let levels = word(&bytes, 8) >> 16;
    let entries = rows.saturating_mul(columns).saturating_mul(levels);
    let version = (word(&bytes, 8) & 0xffff) as u16;
    let entry_bytes = INDEX_ENTRY_BYTES
        + match version {
            VERSION => PARTS_ENTRY_BYTES,
            VERSION_WITH_DECKS => DECK_ENTRY_BYTES,
            _ => 0,
        };
    let index = header.saturating_add(entries.saturating_mul(entry_bytes)).saturating_add(4);
    for entry in (header..index.min(bytes.len())).step_by(entry_bytes) {
        let (offset, length) = (word(&bytes, entry), word(&bytes, entry + 8));
        let end = offset.saturating_add(length);
        seal(&mut bytes, offset, end);
        let [vertex_count, triangle_count] = [32, 36].map(|at| word(&bytes, entry + at).min(1 << 17) as u32);
        if version == VERSION {
            seal_parts(&mut bytes, end, &word);
        }
        if version == VERSION_WITH_DECKS {
            let decks = DecksEntry { vertex_count, triangle_count, ..DecksEntry::default() };
            seal(&mut bytes, end, end.saturating_add(decks.length() as usize));
        }
    }
    seal(&mut bytes, header, index);
    seal(&mut bytes, 0, header);
    bytes
}

/// Puts the checksums of parts into their table at `start`, and its own.
fn seal_parts(bytes: &mut [u8], start: usize, word: &impl Fn(&[u8], usize) -> usize) {
    let first = start.saturating_add(FIXED_TABLE_BYTES);
    let count = word(bytes, first.saturating_sub(4)).min(bytes.len() / TABLE_ENTRY_BYTES);
    let end = first.saturating_add(count * TABLE_ENTRY_BYTES).saturating_add(4);
    let mut part = end;
    for entry in (0..count).map(|number| first.saturating_add(number * TABLE_ENTRY_BYTES)) {
        let next = part.saturating_add(word(bytes, entry.saturating_add(4)));
        if let Some(sum) = bytes.get(part..next).map(crc32fast::hash)
            && let Some(checksum) = bytes.get_mut(entry + 8..).and_then(|rest| rest.first_chunk_mut())
        {
            *checksum = sum.to_le_bytes();
        }
        part = next;
    }
    seal(bytes, start, end);
}

/// Puts the checksum of what is before them into the last four bytes of a section.
fn seal(bytes: &mut [u8], from: usize, to: usize) {
    if from.saturating_add(4) <= to && to <= bytes.len() {
        let sum = crc32fast::hash(&bytes[from..to - 4]);
        bytes[to - 4..to].copy_from_slice(&sum.to_le_bytes());
    }
}

fuzz_target!(|bytes: &[u8]| {
    for bytes in [bytes.to_vec(), with_checksums(bytes)] {
        let direct = SlmFile::parse(&bytes);
        let decoded = store::decode_levels(Path::new("fuzz.slm"), &bytes);
        assert!(direct.is_ok() || decoded.is_err(), "the database read what the reader refuses");
        // What is not known is not written again.
        let is_known = |file: &SlmFile| {
            let levels = (0..file.header().level_count).filter_map(|level| file.level(level));
            levels.flatten().all(|module| module.unknown_parts.is_empty())
        };
        if let Ok((header, levels)) = decoded
            && direct.as_ref().is_ok_and(is_known)
        {
            assert_eq!(store::encode_levels(&header, &levels), bytes, "read, written and not the same");
        }
    }
});
