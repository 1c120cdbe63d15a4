//! The bytes of small builds as they were: they may change only with [`compiler::ALGORITHM_REVISION`].

use std::fs;
use std::path::PathBuf;

use compiler::ALGORITHM_REVISION;
use database::FingerprintBuilder;

use crate::modes;

/// Modes whose bytes are kept.
const KEPT: [&str; 6] =
    ["optimised", "paper", "mountains masked", "clip, paper", "clip, greedy squares", "clip, limits that bind"];

fn golden() -> PathBuf {
    PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/golden/builds.txt"))
}

/// One line per mode: the hash of all files under `tiles` and `modules`.
fn found() -> String {
    let mut text = format!("algorithm revision {ALGORITHM_REVISION}\n");
    for mode in modes::all().into_iter().filter(|mode| KEPT.contains(&mode.0)) {
        let scene = modes::scene(&mode);
        drop(scene.build("area", 2));
        let mut builder = FingerprintBuilder::new("golden");
        for (path, bytes) in scene.product("area") {
            if path.starts_with("tiles") || path.starts_with("modules") {
                builder = builder.text(&path.to_string_lossy()).bytes(&bytes);
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
        "the same jobs give other bytes than before, and ALGORITHM_REVISION in compiler/src/run.rs is still \
         {ALGORITHM_REVISION}: raise it, so that what is published is built again, then run this test with \
         UPDATE_GOLDEN=1\nbefore:\n{kept}\nnow:\n{found}"
    );
    assert!(
        std::env::var_os("UPDATE_GOLDEN").is_some(),
        "ALGORITHM_REVISION was raised: UPDATE_GOLDEN=1 writes the new hashes\nbefore:\n{kept}\nnow:\n{found}"
    );
    fs::write(golden(), found).unwrap();
}
