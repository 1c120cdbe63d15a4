//! One range of bytes over HTTP, with redirects, retries, and a sentence for all that servers do wrong.

use std::io::Read;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::Duration;

use ureq::Agent;
use ureq::http::{HeaderMap, Response};

use super::address::Address;
use super::fault::{Fault, changed};

/// Times that a range is asked for, at most.
const TRIES: u32 = 5;
/// Redirects that are followed, at most.
const REDIRECTS: usize = 5;
/// Seconds until a server is there, and for the answer to one request.
const CONNECT: Duration = Duration::from_secs(20);
const ANSWER: Duration = Duration::from_secs(180);
/// The pause before the second try; before each other it is twice that before.
const PAUSE: Duration = Duration::from_millis(250);

/// A range of bytes of a file.
#[derive(Debug)]
pub struct Answer {
    /// The bytes; fewer than were asked for where the file ends.
    pub bytes: Vec<u8>,
    /// Bytes of the whole file.
    pub total: u64,
    /// The server's mark of this version of the file; empty where it gives none.
    pub etag: String,
}

/// What asks.
pub struct Client<'a> {
    agent: Agent,
    /// Of this machine's own servers.
    direct: Agent,
    stop: &'a AtomicBool,
    variable: &'a (dyn Fn(&str) -> Option<String> + Sync),
    received: AtomicU64,
}

impl<'a> Client<'a> {
    /// A client that ends early once `stop` is raised; `variable` gives variables of the environment.
    pub fn new(stop: &'a AtomicBool, variable: &'a (dyn Fn(&str) -> Option<String> + Sync)) -> Self {
        let config = || {
            Agent::config_builder()
                .http_status_as_error(false)
                // They are followed here, where each is judged.
                .max_redirects(0)
                .user_agent(concat!("tiefort/", env!("CARGO_PKG_VERSION")))
                .timeout_connect(Some(CONNECT))
                .timeout_global(Some(ANSWER))
                .max_idle_connections_per_host(8)
        };
        let (agent, direct) = (config().build().into(), config().proxy(None).build().into());
        Self { agent, direct, stop, variable, received: AtomicU64::new(0) }
    }

    /// Bytes of bodies that have come.
    pub fn received(&self) -> u64 {
        self.received.load(Ordering::Relaxed)
    }

    /// Raised when the work is to end.
    pub fn stop(&self) -> &AtomicBool {
        self.stop
    }

    /// What is asked for a file that a job names.
    ///
    /// # Errors
    /// When it is no address that is followed.
    pub fn address(&self, named: &str) -> Result<Address, Fault> {
        Address::of(named, &|name| (self.variable)(name))
    }

    /// The bytes of a file from `start` on, at most `len`; `etag` is the mark of the version that is wanted.
    ///
    /// # Errors
    /// When the server does not give them, or another version, after several tries.
    pub fn range(&self, address: &Address, start: u64, len: u64, etag: Option<&str>) -> Result<Answer, Fault> {
        self.trying(|| {
            let response = self.ask(address, Some((start, len)))?;
            let (status, headers) = (response.status().as_u16(), response.headers().clone());
            if status == 200 {
                let hint = "fetch the file by other means, and name it by its path";
                let text = format!("{address}: the server gives no parts of files (200 where 206 was expected)");
                return Err(Fault::hinted(text, hint));
            }
            let total = content_range(&headers, start, len).map_err(|found| {
                Fault::last(format!(
                    "{address}: the server gave bytes {found}, expected {start}-{} of it",
                    start + len - 1
                ))
            })?;
            let etag_now = text(&headers, "etag");
            check_version(address, etag, &etag_now)?;
            let bytes = self.body(address, response, len.min(total - start))?;
            Ok(Answer { bytes, total, etag: etag_now })
        })
    }

    /// Whether the server gives parts of a file, its bytes where it tells them, and its mark.
    ///
    /// # Errors
    /// When it does not give the file at all.
    pub fn look(&self, address: &Address) -> Result<(bool, Option<u64>, String), Fault> {
        self.trying(|| {
            let response = self.ask(address, Some((0, 1)))?;
            let headers = response.headers();
            let etag = text(headers, "etag");
            match response.status().as_u16() {
                206 => {
                    let total = content_range(headers, 0, 1);
                    let total =
                        total.map_err(|found| Fault::last(format!("{address}: the server gave bytes {found}")))?;
                    Ok((true, Some(total), etag))
                }
                _ => Ok((false, text(headers, "content-length").parse().ok(), etag)),
            }
        })
    }

    /// The whole file in one answer of `total` bytes, handed on as it comes.
    ///
    /// # Errors
    /// When it does not come whole, or `put` fails.
    pub fn whole(
        &self,
        address: &Address,
        total: u64,
        put: &mut dyn FnMut(&[u8]) -> Result<(), Fault>,
    ) -> Result<(), Fault> {
        let response = self.ask(address, None)?;
        let (mut reader, mut left) = (response.into_body().into_reader(), total);
        let mut buffer = vec![0; 1 << 16];
        loop {
            let read = reader.read(&mut buffer).map_err(|error| Fault::passing(format!("{address}: {error}")))?;
            self.stopped()?;
            self.received.fetch_add(read as u64, Ordering::Relaxed);
            match read as u64 {
                0 if left == 0 => return Ok(()),
                0 => return Err(cut(address, total - left, total)),
                read if left < read => return Err(endless(address, total)),
                read => left -= read,
            }
            put(&buffer[..read])?;
        }
    }

    /// Asks several times where that may help.
    ///
    /// # Errors
    /// That of the last try, or of the first that another would not mend.
    pub fn trying<T>(&self, ask: impl Fn() -> Result<T, Fault>) -> Result<T, Fault> {
        let mut pause = PAUSE;
        for _ in 1..TRIES {
            self.stopped()?;
            match ask() {
                Err(fault) if fault.may_pass() => {}
                end => return end,
            }
            std::thread::sleep(pause);
            pause *= 2;
        }
        ask()
    }

    fn stopped(&self) -> Result<(), Fault> {
        match self.stop.load(Ordering::Relaxed) {
            true => Err(Fault::hinted("stopped".into(), "run the same command again: what has come is kept")),
            false => Ok(()),
        }
    }

    /// One answer of 200 or 206, redirects followed.
    fn ask(&self, address: &Address, range: Option<(u64, u64)>) -> Result<Response<ureq::Body>, Fault> {
        let mut at = address.clone();
        for _ in 0..=REDIRECTS {
            let agent = if at.is_of_this_machine() { &self.direct } else { &self.agent };
            let request = agent.get(at.url());
            let request = match range {
                Some((start, len)) => request.header("Range", format!("bytes={start}-{}", start + len - 1)),
                // A file of gigabytes takes its time; what counts is that it goes on coming.
                None => request.config().timeout_global(None).timeout_per_read(Some(CONNECT)).build(),
            };
            let response = request.call().map_err(|error| transport(address, &error))?;
            match response.status().as_u16() {
                200 | 206 => return Ok(response),
                301 | 302 | 303 | 307 | 308 => at = at.redirected(&text(response.headers(), "location"))?,
                status => return Err(refused(address, status)),
            }
        }
        Err(Fault::last(format!("{address}: it leads on more than {REDIRECTS} times")))
    }

    /// A body of exactly `len` bytes.
    fn body(&self, address: &Address, response: Response<ureq::Body>, len: u64) -> Result<Vec<u8>, Fault> {
        let mut bytes = Vec::with_capacity(len as usize);
        let read = response.into_body().into_reader().take(len + 1).read_to_end(&mut bytes);
        self.received.fetch_add(bytes.len() as u64, Ordering::Relaxed);
        let found = bytes.len() as u64;
        match read {
            _ if len < found => Err(endless(address, len)),
            _ if found < len => Err(cut(address, found, len)),
            Err(error) => Err(Fault::passing(format!("{address}: {error}"))),
            Ok(_) => Ok(bytes),
        }
    }
}

fn text(headers: &HeaderMap, name: &str) -> String {
    headers.get(name).and_then(|value| value.to_str().ok()).unwrap_or_default().trim().to_owned()
}

/// Bytes of the whole file, where an answer holds the range that was asked for; else what it says it holds.
fn content_range(headers: &HeaderMap, start: u64, len: u64) -> Result<u64, String> {
    let said = text(headers, "content-range");
    let parts = said.strip_prefix("bytes ").and_then(|rest| {
        let (range, total) = rest.split_once('/')?;
        let (first, last) = range.split_once('-')?;
        Some([first, last, total].map(|number| number.trim().parse::<u64>().ok()))
    });
    match parts {
        Some([Some(first), Some(last), Some(total)])
            if first == start && start < total && last == (start.saturating_add(len) - 1).min(total - 1) =>
        {
            Ok(total)
        }
        _ if said.is_empty() => Err("without saying which".into()),
        _ => Err(said.trim_start_matches("bytes ").to_owned()),
    }
}

fn check_version(address: &Address, wanted: Option<&str>, found: &str) -> Result<(), Fault> {
    match wanted {
        Some(wanted) if wanted != found => Err(changed(&address.to_string(), wanted, found)),
        _ => Ok(()),
    }
}

fn cut(address: &Address, found: u64, expected: u64) -> Fault {
    Fault::passing(format!("{address}: the answer ended after {found} of {expected} bytes"))
}

fn endless(address: &Address, expected: u64) -> Fault {
    Fault::last(format!("{address}: the answer goes on behind the {expected} bytes that it should have"))
}

fn refused(address: &Address, status: u16) -> Fault {
    let hint = match status {
        401 | 403 => {
            "is it public? an address that is signed for you may go into the job, or fetch the file by other means"
        }
        404 | 410 => "check the address; over the sea a worldwide model has no such file: take the line out of the job",
        _ => "check the address in the job",
    };
    match status {
        408 | 429 | 500 | 502 | 503 | 504 => {
            Fault::passing(format!("{address}: the server is not able to now ({status})"))
        }
        401 | 403 => Fault::hinted(format!("{address}: the server does not give it to strangers ({status})"), hint),
        404 | 410 => Fault::hinted(format!("{address}: there is no such file ({status})"), hint),
        416 => Fault::hinted(format!("{address}: it ends before the bytes that were asked for (416)"), hint),
        _ => Fault::hinted(format!("{address}: the server answered {status}"), hint),
    }
}

/// What the library says, which may hold the address with its signature.
fn transport(address: &Address, error: &ureq::Error) -> Fault {
    let said = error.to_string().replace(address.url(), &address.to_string());
    let said = said.split('?').next().unwrap_or_default().to_owned();
    Fault::passing(format!("{address}: {said}"))
}
