//! Tells the program which commit it is made from, and looks, when the viewer is built in, whether its page is there.

use std::path::Path;
use std::process::Command;

/// Where `scripts/release.sh` writes the commit into an archive of the sources.
const COMMIT_FILE: &str = "../../COMMIT";

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rustc-env=TIEFORT_COMMIT={}", commit().unwrap_or_else(|| "unknown".to_owned()));
    if std::env::var_os("CARGO_FEATURE_VIEWER").is_some() {
        look_for_page();
    }
}

/// The commit of the sources: what the archive says, or git. Programs of developers are made again and again between
/// two commits, so they name none.
fn commit() -> Option<String> {
    if Path::new(COMMIT_FILE).exists() {
        println!("cargo::rerun-if-changed={COMMIT_FILE}");
        let text = std::fs::read_to_string(COMMIT_FILE).ok()?;
        return Some(text.trim().to_owned()).filter(|text| is_commit(text));
    }
    if std::env::var("PROFILE").as_deref() != Ok("release") {
        return None;
    }
    // A folder above that is no checkout of this project is not asked.
    Path::new("../../.git").exists().then_some(())?;
    let log = git(&["rev-parse", "--git-path", "logs/HEAD"])?;
    if Path::new(&log).exists() {
        println!("cargo::rerun-if-changed={log}");
    }
    git(&["rev-parse", "--short=12", "HEAD"]).filter(|text| is_commit(text))
}

fn is_commit(text: &str) -> bool {
    7 <= text.len() && text.bytes().all(|byte| byte.is_ascii_hexdigit())
}

/// What git prints; `None` without git, or where it fails.
fn git(arguments: &[&str]) -> Option<String> {
    let output = Command::new("git").args(arguments).output().ok().filter(|output| output.status.success())?;
    Some(String::from_utf8(output.stdout).ok()?.trim().to_owned())
}

fn look_for_page() {
    const PAGE: &str = "viewer/dist/viewer.js";
    println!("cargo::rerun-if-changed={PAGE}");
    if !Path::new(PAGE).exists() {
        println!("cargo::error=the page of the viewer is missing: run scripts/build_viewer.sh (it needs Node) first");
    }
}
