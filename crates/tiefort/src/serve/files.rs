//! Files as HTTP has them: named by a checksum, whole or in part, or not at all where the client has them already.

use axum::body::Bytes;
use axum::http::{HeaderMap, HeaderValue, StatusCode, header};
use axum::response::{IntoResponse, Response};
use http_range_header::parse_range_header;
use store::Fingerprint;

use super::refusal::Refusal;

/// Digits of a checksum in a name: 128 bits.
const TAG_DIGITS: usize = 32;

/// The name of a file's content, for `ETag`.
pub fn tag(of: Fingerprint) -> String {
    format!("\"{:.TAG_DIGITS$}\"", of.to_string())
}

/// Whether the client has a content already.
pub fn is_known(headers: &HeaderMap, tag: &str) -> bool {
    let known = headers.get_all(header::IF_NONE_MATCH).iter().filter_map(|value| value.to_str().ok());
    // A packed content is named W/"…": it says the same.
    known.flat_map(|list| list.split(',')).map(str::trim).any(|one| one.trim_start_matches("W/") == tag)
}

/// The answer to a client that has a content already.
pub fn known(tag: &str) -> Response {
    (StatusCode::NOT_MODIFIED, named(tag)).into_response()
}

/// A content with its name.
pub fn content(kind: &'static str, tag: &str, bytes: impl Into<Bytes>) -> Response {
    ([(header::CONTENT_TYPE, kind)], named(tag), bytes.into()).into_response()
}

fn named(tag: &str) -> [(header::HeaderName, HeaderValue); 2] {
    // Kept by a client, and asked for by its name each time: the database may be built again.
    let tag = HeaderValue::from_str(tag).expect("a tag is made of digits and quotes");
    [(header::ETAG, tag), (header::CACHE_CONTROL, HeaderValue::from_static("no-cache"))]
}

/// Which bytes of a file are asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Part {
    Whole,
    /// First and last byte, both inside.
    Bytes(u64, u64),
}

impl Part {
    /// What a client asks of a file of this name and length; `None` for a range outside it. Several ranges at once are
    /// answered with the whole file, as is one of a content that the client has of another build.
    pub fn asked(headers: &HeaderMap, tag: &str, length: u64) -> Option<Self> {
        let text = |name: header::HeaderName| headers.get(name).and_then(|value| value.to_str().ok());
        let Some(range) = text(header::RANGE) else { return Some(Part::Whole) };
        if text(header::IF_RANGE).is_some_and(|same| same != tag) {
            return Some(Part::Whole);
        }
        let Ok(parsed) = parse_range_header(range) else { return Some(Part::Whole) };
        match parsed.validate(length).ok()?.as_slice() {
            [one] => Some(Part::Bytes(*one.start(), *one.end())),
            _ => Some(Part::Whole),
        }
    }

    /// The answer with these bytes of a file of `length`.
    pub fn answer(self, tag: &str, length: u64, bytes: Bytes) -> Response {
        let mut response = content("application/octet-stream", tag, bytes);
        let headers = response.headers_mut();
        headers.insert(header::ACCEPT_RANGES, HeaderValue::from_static("bytes"));
        if let Part::Bytes(first, last) = self {
            headers.insert(header::CONTENT_RANGE, range_value(&format!("bytes {first}-{last}/{length}")));
            *response.status_mut() = StatusCode::PARTIAL_CONTENT;
        }
        response
    }
}

/// The answer to a range outside a file of this length.
pub fn outside(length: u64) -> Response {
    let refusal = Refusal::new(
        StatusCode::RANGE_NOT_SATISFIABLE,
        format!("found a range outside the file, expected one within its {length} bytes"),
        "the last byte is one less than the length",
    );
    let mut response = refusal.into_response();
    response.headers_mut().insert(header::CONTENT_RANGE, range_value(&format!("bytes */{length}")));
    response
}

fn range_value(text: &str) -> HeaderValue {
    HeaderValue::from_str(text).expect("it is made of digits")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn headers(pairs: &[(header::HeaderName, &'static str)]) -> HeaderMap {
        pairs.iter().map(|(name, value)| (name.clone(), HeaderValue::from_static(value))).collect()
    }

    #[test]
    fn a_content_is_known_by_its_name_alone_in_a_list_or_packed() {
        let tag = "\"00ff\"";
        for known in ["\"00ff\"", "W/\"00ff\"", "\"1\", \"00ff\""] {
            assert!(is_known(&headers(&[(header::IF_NONE_MATCH, known)]), tag), "{known}");
        }
        for other in ["\"00fe\"", "00ff", "*", ""] {
            assert!(!is_known(&headers(&[(header::IF_NONE_MATCH, other)]), tag), "{other}");
        }
    }

    #[test]
    fn a_range_is_one_run_of_bytes_inside_the_file_of_the_same_build() {
        let asked = |range| Part::asked(&headers(&[(header::RANGE, range)]), "\"a\"", 100);
        assert_eq!(asked("bytes=0-9"), Some(Part::Bytes(0, 9)));
        assert_eq!(asked("bytes=90-"), Some(Part::Bytes(90, 99)));
        assert_eq!(asked("bytes=-1"), Some(Part::Bytes(99, 99)));
        assert_eq!(asked("bytes=90-200"), Some(Part::Bytes(90, 99)));
        assert_eq!(asked("bytes=0-1,3-4"), Some(Part::Whole));
        assert_eq!(asked("lines=1-2"), Some(Part::Whole));
        assert_eq!(asked("bytes=100-"), None);
        let of_another_build = headers(&[(header::RANGE, "bytes=0-9"), (header::IF_RANGE, "\"b\"")]);
        assert_eq!(Part::asked(&of_another_build, "\"a\"", 100), Some(Part::Whole));
    }
}
