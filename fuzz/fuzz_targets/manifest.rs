//! `database.json`, `report.json` and the shares of tiles: with the checksum as it is, and with a right one.
#![no_main]

use std::fs;

use store::Folder;
use libfuzzer_sys::fuzz_target;
use terrain::TileId;

fuzz_target!(|bytes: &[u8]| {
    let folder = std::env::temp_dir().join(format!("tiefort-fuzz-{}", std::process::id()));
    fs::create_dir_all(folder.join("work/run/shares")).expect("there is room for a few files");
    for bytes in [bytes.to_vec(), sealed(bytes)] {
        for name in ["database.json", "report.json", "work/run/shares/r00c00.json"] {
            fs::write(folder.join(name), &bytes).expect("there is room for a few files");
        }
        let read = Folder::new(&folder);
        if let Ok(manifest) = read.manifest() {
            // What it lists is not there, which is a finding and no fault.
            let _ = read.verify_bytes(&manifest);
            let _ = manifest.tile(TILE);
        }
        let _ = read.report();
        let _ = read.work("run").read_share(TILE);
    }
});

const TILE: TileId = TileId { row: 0, col: 0 };

/// The bytes as the text of an object up to its closing brace, with the checksum that belongs there.
fn sealed(bytes: &[u8]) -> Vec<u8> {
    let open = String::from_utf8_lossy(bytes);
    let open = open.trim_end().trim_end_matches('}').trim_end();
    let checksum = blake3::hash(format!("{open}\n}}\n").as_bytes());
    format!("{open},\n  \"checksum\": \"{checksum}\"\n}}\n").into_bytes()
}
