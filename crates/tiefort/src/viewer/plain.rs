//! Answers that need no more than a header.

use axum::body::Bytes;
use axum::http::header;
use axum::response::{IntoResponse, Response};

/// What a person is told when a handler fails without a reason of its own.
pub const FAULT: &str = "a fault in tiefort; the terminal says which";

/// Numbers for the page.
pub fn bytes(body: Bytes) -> Response {
    ([(header::CONTENT_TYPE, "application/octet-stream")], body).into_response()
}
