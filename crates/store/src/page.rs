//! Our page: HTML whose last line is a comment with a checksum of everything before it.
//!
//! One that `tiefort report` draws later and a person lays into the database is in no list, so it vouches for itself.

use std::path::Path;

use crate::{DatabaseError, Fingerprint};

const BEFORE: &str = "<!-- checksum ";
const AFTER: &str = " -->\n";

/// The page of this text, with its checksum.
pub fn seal_page(text: &str) -> String {
    let line = if text.is_empty() || text.ends_with('\n') { "" } else { "\n" };
    let text = format!("{text}{line}");
    let checksum = Fingerprint::of_bytes(text.as_bytes());
    format!("{text}{BEFORE}{checksum}{AFTER}")
}

/// Whether the page in the file at `path` is as it was sealed.
///
/// # Errors
/// When a byte is not as it was written, or nothing was sealed.
pub(crate) fn check_page(path: &Path, bytes: &[u8]) -> Result<(), DatabaseError> {
    let at = bytes.len().saturating_sub(BEFORE.len() + 64 + AFTER.len());
    let (text, line) = bytes.split_at(at);
    let expected = format!("{BEFORE}{}{AFTER}", Fingerprint::of_bytes(text));
    if line == expected.as_bytes() {
        return Ok(());
    }
    Err(DatabaseError::WrongChecksum {
        path: path.to_path_buf(),
        section: "whole page, against its last line",
        found: expected.trim_end().to_owned(),
        expected: String::from_utf8_lossy(line).trim_end().to_owned(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_changed_byte_of_a_page_is_found() {
        let path = Path::new("report.html");
        for text in ["", "<!doctype html>\n<p>9 tiles</p>\n", "<p>no line end</p>"] {
            let page = seal_page(text);
            assert!(page.starts_with(text) && check_page(path, page.as_bytes()).is_ok());
            for at in 0..page.len() {
                let mut bytes = page.clone().into_bytes();
                bytes[at] ^= 4;
                check_page(path, &bytes).unwrap_err();
                check_page(path, &bytes[..at]).unwrap_err();
            }
        }
    }
}
