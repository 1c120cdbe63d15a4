//! What a request brings: a body of bounded size in bounded time, as JSON or as numbers.

use std::sync::Arc;
use std::time::Duration;

use axum::body::{Body, Bytes, to_bytes};
use axum::extract::Request;
use axum::http::{HeaderMap, StatusCode, header};
use serde::de::DeserializeOwned;
use tokio::sync::Semaphore;
use tokio::time::timeout;

use super::refusal::Refusal;

/// Bodies of the largest size that are in memory at a time.
const LARGE_AT_ONCE: usize = 8;
/// What bodies are counted in.
const UNIT: usize = 16 << 10;

/// What bodies may take.
pub struct Bodies {
    bytes_max: usize,
    within: Duration,
    room: Arc<Semaphore>,
}

/// A body, and the room it takes until it is dropped.
pub struct Received {
    bytes: Bytes,
    is_raw: bool,
    _room: tokio::sync::OwnedSemaphorePermit,
}

impl Bodies {
    pub fn new(bytes_max: usize, within: Duration) -> Self {
        let room = Arc::new(Semaphore::new(LARGE_AT_ONCE * units(bytes_max) as usize));
        Self { bytes_max, within, room }
    }

    /// The body of a request.
    ///
    /// # Errors
    /// When it is too large, too slow, or of another kind.
    pub async fn receive(&self, request: Request) -> Result<Received, Refusal> {
        let (head, body) = request.into_parts();
        let is_raw = is_raw(&head.headers)?;
        let told =
            head.headers.get(header::CONTENT_LENGTH).and_then(|length| length.to_str().ok()?.parse::<u64>().ok());
        let most = self.bytes_max as u64;
        if told.is_some_and(|told| most < told) {
            return Err(self.too_large(told));
        }
        // A body of unknown length may be of any that is allowed.
        let length = told.map_or(self.bytes_max, |told| told as usize);
        let receiving = async {
            let room = Arc::clone(&self.room).acquire_many_owned(units(length)).await.map_err(|_| Refusal::fault())?;
            Ok(Received { bytes: self.read(body).await?, is_raw, _room: room })
        };
        timeout(self.within, receiving).await.unwrap_or_else(|_| {
            Err(Refusal::new(
                StatusCode::REQUEST_TIMEOUT,
                format!("found a body that was not whole after {} s", self.within.as_secs()),
                "send it faster or in smaller pieces; --request-seconds of `tiefort serve` allows more time",
            ))
        })
    }

    async fn read(&self, body: Body) -> Result<Bytes, Refusal> {
        to_bytes(body, self.bytes_max).await.map_err(|error| {
            let mut cause: Option<&dyn std::error::Error> = Some(&error);
            while let Some(error) = cause {
                // A body that breaks off has other causes.
                if error.to_string().contains("length limit") {
                    return self.too_large(None);
                }
                cause = error.source();
            }
            Refusal::request("found a body that breaks off, expected a whole one", "send it again")
        })
    }

    fn too_large(&self, found: Option<u64>) -> Refusal {
        let found = found.map_or("more".to_owned(), |found| format!("{found} bytes"));
        Refusal::new(
            StatusCode::PAYLOAD_TOO_LARGE,
            format!("found a body of {found}, expected at most {} bytes", self.bytes_max),
            "ask for fewer places at a time; --max-body of `tiefort serve` allows more",
        )
    }
}

fn units(bytes: usize) -> u32 {
    u32::try_from(bytes.div_ceil(UNIT).max(1)).unwrap_or(u32::MAX)
}

/// Whether a body is numbers, and not JSON.
fn is_raw(headers: &HeaderMap) -> Result<bool, Refusal> {
    let Some(kind) = headers.get(header::CONTENT_TYPE) else { return Ok(false) };
    let kind = kind.to_str().unwrap_or_default().split(';').next().unwrap_or_default().trim().to_ascii_lowercase();
    match kind.as_str() {
        "application/octet-stream" => Ok(true),
        // What curl says of data whose kind it was not told.
        "application/json" | "application/x-www-form-urlencoded" | "" => Ok(false),
        _ => Err(Refusal::new(
            StatusCode::UNSUPPORTED_MEDIA_TYPE,
            format!("found a body of {kind}, expected application/json or application/octet-stream"),
            "the latter holds little-endian 64-bit floats",
        )),
    }
}

impl Received {
    /// Whether it is numbers, and not JSON.
    pub fn is_raw(&self) -> bool {
        self.is_raw
    }

    /// What it says as JSON.
    ///
    /// # Errors
    /// When it says anything else; `expected` is what to send.
    pub fn json<T: DeserializeOwned>(&self, expected: &str) -> Result<T, Refusal> {
        serde_json::from_slice(&self.bytes).map_err(|error| {
            Refusal::request(format!("found a body that cannot be read ({error}), expected {expected}"), JSON_HINT)
        })
    }

    /// Its numbers, `N` at a time.
    ///
    /// # Errors
    /// When its length is no multiple of that.
    pub fn numbers<const N: usize>(&self) -> Result<Vec<[f64; N]>, Refusal> {
        let (numbers, rest) = self.bytes.as_chunks::<8>();
        if !rest.is_empty() || numbers.len() % N != 0 {
            let (found, expected) = (self.bytes.len(), 8 * N);
            return Err(Refusal::request(
                format!("found a body of {found} bytes, expected a multiple of {expected}"),
                format!("send little-endian 64-bit floats, {N} for each place or line"),
            ));
        }
        let number = |bytes: &[u8; 8]| f64::from_le_bytes(*bytes);
        Ok(numbers.chunks_exact(N).map(|chunk| std::array::from_fn(|index| number(&chunk[index]))).collect())
    }
}

const JSON_HINT: &str = "numbers are finite in JSON; /docs shows an example";
