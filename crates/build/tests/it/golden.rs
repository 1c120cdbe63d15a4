//! The bytes of small builds as they were: they may change only with [`build::ALGORITHM_REVISION`].

use std::fs;
use std::path::PathBuf;

use build::ALGORITHM_REVISION;
use store::{Fingerprint, Folder, Stamp, TileModules, encode_levels, encode_removals, encode_tile};

use store::engine::FingerprintBuilder;

use crate::modes;

/// Modes whose bytes are kept.
const KEPT: [&str; 10] = [
    "optimised",
    "greedy",
    "paper",
    "raster order",
    "mountains masked",
    "levels of detail",
    "clip, paper",
    "clip, greedy squares",
    "clip, limits that bind",
    "clip, levels of detail",
];

fn golden() -> PathBuf {
    PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/golden/builds.txt"))
}

/// What is hashed in place of what a file was made from: only what it holds counts.
const FROM: Stamp = Stamp { algorithm_revision: 0, fingerprint: Fingerprint([0; 32]) };

/// One line per mode: the hash of all that the files under `tiles` and `modules` hold.
fn found() -> String {
    let mut text = format!("algorithm revision {ALGORITHM_REVISION}\n");
    for mode in modes::all().into_iter().filter(|mode| KEPT.contains(&mode.0)) {
        let scene = modes::scene(&mode);
        drop(scene.build("area", 2));
        let mut builder = FingerprintBuilder::new("golden");
        let folder = Folder::new(scene.path("area"));
        let manifest = folder.manifest().unwrap();
        for record in &manifest.tiles {
            let tile = record.tile();
            let (_, tin) = folder.read_tile(tile).unwrap();
            let (header, levels) = folder.read_levels(&manifest, tile).unwrap();
            let header = TileModules { fingerprint: FROM.fingerprint, ..header };
            builder = builder.bytes(&encode_tile(&FROM, &tin)).bytes(&encode_levels(&header, &levels));
            if record.removed.is_some() {
                builder = builder.bytes(&encode_removals(&FROM, &folder.read_removals(tile).unwrap().1));
            }
        }
        text += &format!("{}  {}\n", builder.finish(), mode.0);
    }
    text
}

#[test]
fn results_change_only_with_the_algorithm_revision() {
    let (kept, found) = (fs::read_to_string(golden()).unwrap_or_default(), found());
    if kept == found {
        return;
    }
    let is_raised = kept.lines().next() != found.lines().next();
    assert!(
        is_raised,
        "the same jobs give other bytes than before, and ALGORITHM_REVISION in build/src/run.rs is still \
         {ALGORITHM_REVISION}: raise it, so that what is published is built again, then run this test with \
         UPDATE_GOLDEN=1\nbefore:\n{kept}\nnow:\n{found}"
    );
    assert!(
        std::env::var_os("UPDATE_GOLDEN").is_some(),
        "ALGORITHM_REVISION was raised: UPDATE_GOLDEN=1 writes the new hashes\nbefore:\n{kept}\nnow:\n{found}"
    );
    fs::write(golden(), found).unwrap();
}
