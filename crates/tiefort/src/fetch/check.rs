//! Whether what came is what a build can read: damage of a server, or on the way, is told here and not by a build.

use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

use build::ground::reading;
use job::SourceFile;
use source_files::DemFile;

use super::client::Client;
use super::fault::Fault;

/// Strips or tiles that are decoded before it is asked whether to stop.
const CHUNKS_AT_ONCE: usize = 16;
/// Bytes in which the beginning of a web page is looked for.
const HEAD_BYTES: u64 = 64;

/// What is wrong with a raster that came.
pub enum Refused {
    /// Its header cannot be used: it may be damaged, or lack what the job or a file beside it has to say.
    Header(String),
    /// A strip or tile of it cannot be decoded.
    Heights(String),
    /// A person stopped the work.
    Stopped(Fault),
}

/// Reads every strip or tile of a raster once, of which only those that came are there.
///
/// # Errors
/// Why a build would refuse it.
pub fn check_raster(client: &Client, file: &SourceFile, path: &Path) -> Result<(), Refused> {
    let reading = reading(file, false).map_err(|error| Refused::Header(error.to_string()))?;
    let opened = DemFile::open(path, &reading).map_err(|error| Refused::Header(error.to_string()))?;
    for chunks in opened.chunks_of(opened.rect()).chunks(CHUNKS_AT_ONCE) {
        client.stopped().map_err(Refused::Stopped)?;
        opened.decode(chunks).map_err(|error| Refused::Heights(error.to_string()))?;
    }
    Ok(())
}

/// Whether a file begins as a web page does, which servers send in the place of what they give to known persons only.
pub fn is_page(path: &Path) -> io::Result<bool> {
    let mut head = Vec::new();
    File::open(path)?.take(HEAD_BYTES).read_to_end(&mut head)?;
    Ok(begins_page(&head))
}

fn begins_page(head: &[u8]) -> bool {
    let head = head.strip_prefix(b"\xef\xbb\xbf").unwrap_or(head).trim_ascii_start().to_ascii_lowercase();
    [&b"<!doctype html"[..], b"<html"].iter().any(|start| head.starts_with(start))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_web_page_is_told_by_its_beginning() {
        for page in ["<html><body>Log in", "\u{feff}\r\n<!DOCTYPE HTML PUBLIC", "  <HTML lang=\"en\">"] {
            assert!(begins_page(page.as_bytes()), "{page:?}");
        }
        for file in ["", "{\"type\": \"FeatureCollection\"}", "<?xml version=\"1.0\"?><osm>", "<osm>", "ncols 4"] {
            assert!(!begins_page(file.as_bytes()), "{file:?}");
        }
    }
}
