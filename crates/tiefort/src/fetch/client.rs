//! One range of bytes over HTTP, with redirects, retries, and a sentence for all that servers do wrong.

use std::collections::{BTreeMap, BTreeSet};
use std::io::{self, Read};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use ureq::http::{HeaderMap, Response};
use ureq::{Agent, Timeout};

use super::address::Address;
use super::fault::{Fault, changed, page};
use super::s3::{Credentials, Listed, fits, listed};
use super::silence::{Heard, Silence};
use crate::clock::now;

/// Requests at a time, whatever they are for.
pub const REQUESTS: usize = 8;
/// Files of a list at most: those of all the Earth's buildings are some hundred.
const LISTED_MAX: usize = 10_000;
/// Bytes of a thousand files in a list.
const LIST_BYTES_MAX: u64 = 4 << 20;
/// Times that a range is asked for, at most.
const TRIES: u32 = 5;
/// Redirects that are followed, at most.
const REDIRECTS: usize = 5;
/// Times that a range is asked for, at most, of a server that is silent.
const SILENT_TRIES: u32 = 3;
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

/// How long a server is waited for.
#[derive(Clone, Copy, Debug)]
pub struct Patience {
    /// Until its name is found, and again until it is connected.
    pub connect: Duration,
    /// While it sends no byte.
    pub silence: Duration,
}

impl Patience {
    /// A server that is at work on an answer sends its head within seconds; the rest may come as slowly as it will.
    pub const USUAL: Self = Self { connect: Duration::from_secs(10), silence: Duration::from_secs(30) };
}

/// What asks.
pub struct Client<'a> {
    patience: Patience,
    silence: Arc<Silence>,
    /// Hosts that were given up, and why.
    given_up: Mutex<BTreeMap<String, Fault>>,
    agent: Agent,
    /// Of this machine's own servers.
    direct: Agent,
    stop: &'a AtomicBool,
    variable: &'a (dyn Fn(&str) -> Option<String> + Sync),
    received: AtomicU64,
    /// How many more requests may be made now, and who waits for that.
    free: (Mutex<usize>, Condvar),
    /// Access keys, where there are some.
    credentials: Option<Credentials>,
    /// Buckets that give nothing to strangers.
    closed: Mutex<BTreeSet<String>>,
}

/// Leave to ask for one thing, several times if need be.
struct Leave<'c>(&'c (Mutex<usize>, Condvar), &'c Silence);

impl Drop for Leave<'_> {
    fn drop(&mut self) {
        self.1.end();
        *locked(&self.0.0) += 1;
        self.0.1.notify_one();
    }
}

fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl<'a> Client<'a> {
    /// A client that ends early once `stop` is raised; `variable` gives variables of the environment.
    pub fn new(
        stop: &'a AtomicBool,
        variable: &'a (dyn Fn(&str) -> Option<String> + Sync),
        patience: Patience,
    ) -> Self {
        let config = || {
            Agent::config_builder()
                .http_status_as_error(false)
                // They are followed here, where each is judged.
                .max_redirects(0)
                .user_agent(concat!("tiefort/", env!("CARGO_PKG_VERSION")))
                .timeout_resolve(Some(patience.connect))
                .timeout_connect(Some(patience.connect))
                .timeout_per_write(Some(patience.silence))
                // A file of gigabytes takes its time; what counts is that it goes on coming.
                .timeout_per_read(Some(patience.silence))
                .max_idle_connections_per_host(8)
        };
        let (agent, direct) = (config().build().into(), config().proxy(None).build().into());
        Self {
            patience,
            silence: Arc::default(),
            given_up: Mutex::default(),
            agent,
            direct,
            stop,
            variable,
            received: AtomicU64::new(0),
            free: (Mutex::new(REQUESTS), Condvar::new()),
            credentials: Credentials::find(&|name| variable(name)),
            closed: Mutex::default(),
        }
    }

    /// Bytes of bodies that have come.
    pub fn received(&self) -> u64 {
        self.received.load(Ordering::Relaxed)
    }

    /// What tells whether servers send something.
    pub fn silence(&self) -> &Arc<Silence> {
        &self.silence
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

    /// The files of a bucket that fit a pattern, in the order of their keys.
    ///
    /// # Errors
    /// When the bucket does not list them, or none fits.
    pub fn list(&self, bucket: &str, pattern: &str) -> Result<Vec<Listed>, Fault> {
        let prefix = pattern.split('*').next().unwrap_or_default();
        let (mut found, mut seen, mut token) = (Vec::new(), 0, None::<String>);
        loop {
            let variable = |name: &str| (self.variable)(name);
            let address = Address::of_list(bucket, prefix, token.as_deref(), &variable)?;
            let text = self.trying(&address, || {
                let response = self.ask(&address, None)?;
                let mut text = String::new();
                let read = self.heard(response).take(LIST_BYTES_MAX).read_to_string(&mut text);
                read.map_err(|error| self.unread(&address, &error))?;
                Ok(text)
            })?;
            let (files, next) = listed(&text).ok_or_else(|| {
                let hint = "name its files one by one, each with an address of its own";
                Fault::hinted(format!("{address}: the answer is no list of files"), hint)
            })?;
            seen += files.len();
            found.extend(files.into_iter().filter(|file| fits(pattern, &file.key)));
            if LISTED_MAX < seen {
                let text = format!("s3://{bucket}/{pattern}: found more than {LISTED_MAX} files to choose from");
                return Err(Fault::hinted(text, "write more of their common beginning before the *"));
            }
            match next {
                Some(next) if token.as_ref() != Some(&next) => token = Some(next),
                _ => break,
            }
        }
        found.sort_by(|a, b| a.key.cmp(&b.key));
        match found.is_empty() {
            true => Err(Fault::hinted(
                format!("s3://{bucket}/{pattern}: no file fits"),
                "check the address; old releases go: https://docs.overturemaps.org/release-calendar lists them",
            )),
            false => Ok(found),
        }
    }

    /// The bytes of a file from `start` on, at most `len`; `etag` is the mark of the version that is wanted.
    ///
    /// # Errors
    /// When the server does not give them, or another version, after several tries.
    pub fn range(&self, address: &Address, start: u64, len: u64, etag: Option<&str>) -> Result<Answer, Fault> {
        self.trying(address, || {
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
        self.trying(address, || {
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
        let (mut reader, mut left) = (self.heard(self.ask(address, None)?), total);
        let mut buffer = vec![0; 1 << 16];
        loop {
            let read = reader.read(&mut buffer).map_err(|error| self.unread(address, &error))?;
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

    /// Asks several times where that may help, once there are few enough at work. A host that does not answer is given
    /// up for all that is asked of it.
    ///
    /// # Errors
    /// That of the last try, or of the first that another would not mend; why the host was given up.
    pub fn trying<T>(&self, address: &Address, ask: impl Fn() -> Result<T, Fault>) -> Result<T, Fault> {
        let _leave = self.leave(address.host());
        let (mut pause, mut tries, mut silences) = (PAUSE, 0, 0);
        loop {
            self.stopped()?;
            if let Some(fault) = locked(&self.given_up).get(address.host()) {
                return Err(fault.clone());
            }
            let fault = match ask() {
                Err(fault) if fault.may_pass() => fault,
                end => return end,
            };
            tries += 1;
            silences += u32::from(fault.is_silent());
            if tries == TRIES || silences == SILENT_TRIES {
                locked(&self.given_up).entry(address.host().to_owned()).or_insert(fault.clone());
                return Err(fault);
            }
            std::thread::sleep(pause);
            pause *= 2;
        }
    }

    /// Whether the work may go on.
    ///
    /// # Errors
    /// When a person stopped it.
    pub fn stopped(&self) -> Result<(), Fault> {
        match self.stop.load(Ordering::Relaxed) {
            true => Err(Fault::hinted("stopped".into(), "run the same command again: what has come is kept")),
            false => Ok(()),
        }
    }

    /// One answer of 200 or 206, redirects followed.
    fn ask(&self, address: &Address, range: Option<(u64, u64)>) -> Result<Response<ureq::Body>, Fault> {
        let mut at = address.clone();
        for _ in 0..=REDIRECTS {
            let is_signed = at.bucket().is_some_and(|bucket| locked(&self.closed).contains(bucket));
            let response = self.one(&at, range, is_signed).map_err(|error| self.transport(address, &error))?;
            self.silence.heard();
            match response.status().as_u16() {
                200 | 206 if is_page(response.headers()) => return Err(page(&address.to_string())),
                200 | 206 if is_packed(response.headers(), address) => return Err(packed(address)),
                200 | 206 => return Ok(response),
                301 | 302 | 303 | 307 | 308 => at = at.redirected(&text(response.headers(), "location"))?,
                401 | 403 if !is_signed && self.closes(&at) => {}
                status => return Err(refused(address, status)),
            }
        }
        Err(Fault::last(format!("{address}: it leads on more than {REDIRECTS} times")))
    }

    fn leave(&self, host: &str) -> Leave<'_> {
        let (free, told) = &self.free;
        let mut free = told.wait_while(locked(free), |free| *free == 0).unwrap_or_else(PoisonError::into_inner);
        *free -= 1;
        self.silence.begin(host);
        Leave(&self.free, &self.silence)
    }

    /// One request, signed or not.
    fn one(
        &self,
        at: &Address,
        range: Option<(u64, u64)>,
        is_signed: bool,
    ) -> Result<Response<ureq::Body>, ureq::Error> {
        let agent = if at.is_of_this_machine() { &self.direct } else { &self.agent };
        // A range is of the file, not of what a server would pack it to on its way.
        let mut request = agent.get(at.url()).header("Accept-Encoding", "identity");
        if let Some(credentials) = self.credentials.as_ref().filter(|_| is_signed) {
            for (name, value) in credentials.headers(at.url(), now()) {
                request = request.header(name, value);
            }
        }
        match range {
            Some((start, len)) => request.header("Range", format!("bytes={start}-{}", start + len - 1)).call(),
            None => request.call(),
        }
    }

    /// Takes note of a bucket that refused a stranger; whether there are access keys to ask once more with.
    fn closes(&self, at: &Address) -> bool {
        let Some(bucket) = at.bucket().filter(|_| self.credentials.is_some()) else { return false };
        locked(&self.closed).insert(bucket.to_owned());
        true
    }

    /// A body of exactly `len` bytes.
    fn body(&self, address: &Address, response: Response<ureq::Body>, len: u64) -> Result<Vec<u8>, Fault> {
        let mut bytes = Vec::with_capacity(len as usize);
        let read = self.heard(response).take(len + 1).read_to_end(&mut bytes);
        self.received.fetch_add(bytes.len() as u64, Ordering::Relaxed);
        let found = bytes.len() as u64;
        match read {
            _ if len < found => Err(endless(address, len)),
            Err(error) if is_timeout(&error) => Err(self.silent(address)),
            _ if found < len => Err(cut(address, found, len)),
            Err(error) => Err(self.unread(address, &error)),
            Ok(_) => Ok(bytes),
        }
    }

    fn heard(&self, response: Response<ureq::Body>) -> Heard<'_, ureq::BodyReader<'static>> {
        Heard { body: response.into_body().into_reader(), silence: &self.silence }
    }

    /// Why a body was not read to its end.
    fn unread(&self, address: &Address, error: &io::Error) -> Fault {
        match is_timeout(error) {
            true => self.silent(address),
            false => Fault::passing(format!("{address}: {error}")),
        }
    }

    fn silent(&self, address: &Address) -> Fault {
        let seconds = self.patience.silence.as_secs();
        Fault::silent(format!("{address}: no byte came for {seconds} s, in {SILENT_TRIES} tries"))
    }

    /// What the library says, which may hold the address with its signature.
    fn transport(&self, address: &Address, error: &ureq::Error) -> Fault {
        match error {
            ureq::Error::Timeout(Timeout::Resolve | Timeout::Connect) => {
                let seconds = self.patience.connect.as_secs();
                Fault::silent(format!("{address}: no connection within {seconds} s, in {SILENT_TRIES} tries"))
            }
            ureq::Error::Timeout(_) => self.silent(address),
            error => {
                let said = error.to_string().replace(address.url(), &address.to_string());
                let said = said.split('?').next().unwrap_or_default().to_owned();
                Fault::passing(format!("{address}: {said}"))
            }
        }
    }
}

/// Whether a server says that it sends a web page: to log in, or of an error that it does not own to.
fn is_page(headers: &HeaderMap) -> bool {
    text(headers, "content-type").to_ascii_lowercase().starts_with("text/html")
}

/// Whether a body is packed for its way all the same; of files that are packed themselves some servers say that, too.
fn is_packed(headers: &HeaderMap, address: &Address) -> bool {
    let encoding = text(headers, "content-encoding").to_ascii_lowercase();
    let name = address.to_string().to_ascii_lowercase();
    !matches!(encoding.as_str(), "" | "identity") && !name.ends_with(".gz") && !name.ends_with(".tgz")
}

fn packed(address: &Address) -> Fault {
    let hint = "fetch the file by other means, such as `curl --compressed`, and name it by its path";
    Fault::hinted(format!("{address}: the server packs it on its way, though it was asked not to"), hint)
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
            "is it public? access keys of its bucket may be in AWS_ACCESS_KEY_ID, AWS_SECRET_ACCESS_KEY, AWS_REGION, \
             or an address that is signed for you in the job"
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

/// Whether a body was not read because nothing came; the library wraps its own error.
fn is_timeout(error: &io::Error) -> bool {
    let inner = error.get_ref().and_then(|inner| inner.downcast_ref::<ureq::Error>());
    matches!(inner, Some(ureq::Error::Timeout(_)))
}

#[cfg(test)]
mod tests {
    use std::io::Write;
    use std::net::TcpListener;
    use std::time::Instant;

    use super::*;

    /// Asks a server that sends so much and then nothing more for two ranges at once; how it ends, and how many asked.
    fn asked(sent: &'static str) -> ([String; 2], usize) {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let url = format!("http://{}/a.tif", listener.local_addr().unwrap());
        let asked = Arc::new(Mutex::new(Vec::new()));
        let held = Arc::clone(&asked);
        std::thread::spawn(move || {
            for mut stream in listener.incoming().flatten() {
                let _ = stream.write_all(sent.as_bytes());
                locked(&held).push(stream);
            }
        });
        let (stop, variable) = (AtomicBool::new(false), |_: &str| None);
        let patience = Patience { connect: Duration::from_secs(5), silence: Duration::from_millis(200) };
        let client = Client::new(&stop, &variable, patience);
        let address = client.address(&url).unwrap();
        let start = Instant::now();
        let faults = [0, 10].map(|start| client.range(&address, start, 10, None).unwrap_err().text);
        assert!(start.elapsed() < Duration::from_secs(20));
        let count = locked(&asked).len();
        (faults, count)
    }

    #[test]
    fn a_silent_server_is_given_up_after_three_tries_also_for_what_is_asked_later() {
        const HEAD: &str = "HTTP/1.1 206 Partial Content\r\nContent-Length: 10\r\n\
                            Content-Range: bytes 0-9/99\r\n\r\n1234";
        for sent in ["", "HTTP/1.1 206 Par", HEAD] {
            let (faults, count) = asked(sent);
            assert!(faults[0].contains("no byte came for 0 s, in 3 tries"), "{sent:?}: {faults:?}");
            assert_eq!((&faults[0], count), (&faults[1], 3), "{sent:?}");
        }
    }
}
