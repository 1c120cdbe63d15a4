//! Looks, when the viewer is built in, whether its page has been made, and says what makes it.

fn main() {
    const PAGE: &str = "viewer/dist/viewer.js";
    println!("cargo::rerun-if-changed=build.rs");
    if std::env::var_os("CARGO_FEATURE_VIEWER").is_none() {
        return;
    }
    println!("cargo::rerun-if-changed={PAGE}");
    if !std::path::Path::new(PAGE).exists() {
        println!("cargo::error=the page of the viewer is missing: run scripts/build_viewer.sh (it needs Node) first");
    }
}
