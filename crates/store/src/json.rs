//! Our JSON files: indented, keys in the order of their types, and a checksum as the last key.
//!
//! The checksum is the BLAKE3 hash of the text as it would stand without that key, so the file stays plain JSON and
//! yet no byte of it can change unnoticed.

use std::path::Path;

use serde::Serialize;
use serde::de::DeserializeOwned;

use crate::{DatabaseError, Fingerprint};

/// What stands before the checksum's 64 digits, in place of the closing brace.
const BEFORE: &str = ",\n  \"checksum\": \"";
/// What stands after them.
const AFTER: &str = "\"\n}\n";
/// How every text ends before it is sealed.
const END: &str = "\n}\n";

/// The text of `value`, which must be a struct or a map with at least one key.
///
/// # Errors
/// When `value` has a map whose keys are no texts, or is no object.
pub(crate) fn encode(path: &Path, value: &impl Serialize) -> Result<String, DatabaseError> {
    let mut text = serde_json::to_string_pretty(value).map_err(|error| malformed(path, error.to_string()))?;
    let Some(open) = text.strip_suffix("\n}") else {
        return Err(malformed(path, "found a value without keys, expected an object"));
    };
    // Sealed in place: the report of a large area is a hundred megabytes.
    let (length, tail) = (open.len(), tail(open.as_bytes()));
    text.truncate(length);
    text.push_str(&tail);
    Ok(text)
}

/// What follows a text that is open, which is the text up to its closing brace.
fn tail(open: &[u8]) -> String {
    let mut hasher = blake3::Hasher::new();
    hasher.update(open).update(END.as_bytes());
    format!("{BEFORE}{}{AFTER}", Fingerprint(*hasher.finalize().as_bytes()))
}

/// The value whose text, in the file at `path`, these bytes are.
///
/// # Errors
/// When a byte is not as it was written, or the text has other keys than `T`.
pub(crate) fn decode<T: DeserializeOwned>(path: &Path, bytes: &[u8]) -> Result<T, DatabaseError> {
    let at = bytes.windows(BEFORE.len()).rposition(|bytes| bytes == BEFORE.as_bytes());
    let (open, stored) = bytes.split_at(at.ok_or_else(|| malformed(path, "no checksum at the end"))?);
    let computed = tail(open);
    if computed.as_bytes() != stored {
        let stored = String::from_utf8_lossy(&stored[BEFORE.len()..]);
        let computed = computed[BEFORE.len()..].trim_end_matches(AFTER);
        let (found, expected) = (computed.to_string(), stored.trim_end_matches(AFTER).to_string());
        return Err(DatabaseError::WrongChecksum { path: path.to_path_buf(), section: "text", found, expected });
    }
    let open = std::str::from_utf8(open).map_err(|error| malformed(path, error.to_string()))?;
    serde_json::from_str(&format!("{open}{END}")).map_err(|error| malformed(path, error.to_string()))
}

fn malformed(path: &Path, what: impl Into<String>) -> DatabaseError {
    DatabaseError::Malformed { path: path.to_path_buf(), section: "JSON", what: what.into() }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::*;
    use crate::samples;

    #[test]
    fn every_damage_is_an_error() {
        let path = Path::new("x.json");
        let value = BTreeMap::from([("a".to_string(), 1.5), ("checksum \" \n".to_string(), 0.1 + 0.2)]);
        let text = encode(path, &value).unwrap();
        assert_eq!(decode::<BTreeMap<String, f64>>(path, text.as_bytes()).unwrap(), value);
        samples::check_every_damage(text.as_bytes(), |bytes| decode::<BTreeMap<String, f64>>(path, bytes).is_err());
    }

    #[test]
    fn the_checksum_is_an_ordinary_last_key() {
        let text = encode(Path::new("x.json"), &BTreeMap::from([("a", 1)])).unwrap();
        let value: serde_json::Value = serde_json::from_str(&text).unwrap();
        assert_eq!(value["a"], 1);
        assert_eq!(value["checksum"].as_str().unwrap().len(), 64);
    }

    #[test]
    fn a_value_without_keys_is_an_error() {
        assert!(encode(Path::new("x.json"), &7).is_err());
        assert!(encode(Path::new("x.json"), &BTreeMap::<String, u8>::new()).is_err());
    }
}
