//! Why a request is not answered, as JSON: `error` with what was found and what was expected, and `hint`.

use axum::http::{HeaderValue, StatusCode, header};
use axum::response::{IntoResponse, Response};
use serde_json::json;

use crate::failure::{Cause, Failure};
use crate::terminal;

/// Seconds after which a client may ask again what could not be answered now.
const RETRY_SECONDS: &str = "2";

/// Why a request is not answered.
#[derive(Clone, Debug)]
pub struct Refusal {
    status: StatusCode,
    error: String,
    hint: String,
}

impl Refusal {
    pub fn new(status: StatusCode, error: impl Into<String>, hint: impl Into<String>) -> Self {
        Self { status, error: error.into(), hint: hint.into() }
    }

    /// Something is wrong with what was sent.
    pub fn request(error: impl Into<String>, hint: impl Into<String>) -> Self {
        Self::new(StatusCode::BAD_REQUEST, error, hint)
    }

    /// There is nothing of this name.
    pub fn missing(error: impl Into<String>, hint: impl Into<String>) -> Self {
        Self::new(StatusCode::NOT_FOUND, error, hint)
    }

    /// Not now: the database is being built, or is not there.
    pub fn later(error: impl Into<String>, hint: impl Into<String>) -> Self {
        Self::new(StatusCode::SERVICE_UNAVAILABLE, error, hint)
    }

    /// We are wrong; the terminal says what and where.
    pub fn fault() -> Self {
        let error = "found a fault in tiefort, expected an answer";
        Self::new(StatusCode::INTERNAL_SERVER_ERROR, error, "the terminal of the server says which; please report it")
    }

    /// What went wrong with the database.
    pub fn of(failure: impl Into<Failure>) -> Self {
        let failure = failure.into();
        let status = match failure.cause() {
            Cause::Bug => StatusCode::INTERNAL_SERVER_ERROR,
            Cause::Request | Cause::Job | Cause::Source => StatusCode::CONFLICT,
            Cause::Database | Cause::Busy | Cause::Output | Cause::Stopped => StatusCode::SERVICE_UNAVAILABLE,
        };
        Self::new(status, failure.message(), failure.hint())
    }

    /// What was found and what was expected.
    pub fn error(&self) -> &str {
        &self.error
    }

    /// With another status, where it is `from`.
    pub fn with_status(self, from: StatusCode, to: StatusCode) -> Self {
        if self.status == from { Self { status: to, ..self } } else { self }
    }

    /// Whether what was asked for may be answered later.
    pub fn is_for_now(&self) -> bool {
        self.status == StatusCode::SERVICE_UNAVAILABLE
    }
}

impl IntoResponse for Refusal {
    fn into_response(self) -> Response {
        let text = json!({ "error": terminal::short(&self.error), "hint": terminal::short(&self.hint) });
        let kind = [(header::CONTENT_TYPE, "application/json")];
        let mut response = (self.status, kind, format!("{text}\n")).into_response();
        if self.is_for_now() {
            response.headers_mut().insert(header::RETRY_AFTER, HeaderValue::from_static(RETRY_SECONDS));
        }
        response
    }
}
