//! What the sample terrain promises.

// A test that unwraps says by its line what failed.
#![allow(clippy::unwrap_used)]

mod features;
mod ground;

/// Holds the FNV-1a hash of `bytes` against `golden`; `UPDATE_GOLDEN=1` prints the new one.
#[track_caller]
fn check_golden(bytes: impl Iterator<Item = u8>, golden: &str) {
    let hash = |hash: u64, byte: u8| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
    let found = format!("{:016x}", bytes.fold(0xcbf2_9ce4_8422_2325_u64, hash));
    if std::env::var_os("UPDATE_GOLDEN").is_some() {
        eprintln!("GOLDEN is now {found}");
        return;
    }
    assert_eq!(found, golden);
}
