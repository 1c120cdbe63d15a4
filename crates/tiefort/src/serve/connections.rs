//! The connections of the service: a bounded number of them, each for a bounded time.
//!
//! A client that sends its request byte by byte, or none at all, is ended when its time is over; one that does not read
//! its answer, later. When all places are taken, the connection without a request at work that asked for something
//! longest ago is ended for the new one; where every connection has one, the new client is told to come again. So
//! clients that are slow, by fault or on purpose, take a bounded share of memory, and others do not wait for them.

use std::io;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use axum::Router;
use axum::http::{Request, Uri};
use hyper::body::Incoming;
use hyper::server::conn::http1;
use hyper::service::{Service, service_fn};
use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::service::TowerToHyperService;
use tokio::net::{TcpListener, TcpStream};
use tokio::task::AbortHandle;
use tokio::time::{Instant, sleep, timeout_at};

/// What clients may take.
#[derive(Clone, Copy, Debug)]
pub struct Limits {
    /// Connections at a time.
    pub clients: usize,
    /// For a request to arrive whole, and for the next one to begin.
    pub request: Duration,
    /// For an answer to be made and read.
    pub answer: Duration,
}

/// Bytes of a request before its body: those of browsers have some hundreds.
const REQUEST_BYTES_MAX: usize = 16 << 10;
/// Before the next try when the system has no socket left.
const ACCEPT_PAUSE: Duration = Duration::from_millis(100);

/// What a client is told when all places are taken by requests at work.
const ALL_TAKEN: &[u8] = b"HTTP/1.1 503 Service Unavailable\r\nContent-Type: application/json\r\nRetry-After: 1\r\n\
    Connection: close\r\nContent-Length: 118\r\n\r\n\
    {\"error\":\"found all places taken, expected a free one\",\
    \"hint\":\"ask again; --max-clients of `tiefort serve` has more\"}\n";

/// How a connection stands.
#[derive(Clone, Copy)]
struct Standing {
    /// When it was made, or its last request arrived.
    asked: Instant,
    /// Whether a request is at work.
    at_work: bool,
}

type Shared = Arc<Mutex<Standing>>;

/// Serves `routes` to all who connect, for as long as this is polled; `find` gives a request its address in them.
pub async fn serve(
    listener: TcpListener,
    routes: Router,
    limits: Limits,
    find: impl Fn(&mut Uri) + Clone + Send + Sync + 'static,
) {
    let mut open: Vec<(Shared, AbortHandle)> = Vec::new();
    loop {
        let stream = match listener.accept().await {
            Ok((stream, _)) => stream,
            // The client went away meanwhile, or there are too many files open.
            Err(error) if error.kind() == io::ErrorKind::ConnectionAborted => continue,
            Err(_) => {
                sleep(ACCEPT_PAUSE).await;
                continue;
            }
        };
        open.retain(|(_, task)| !task.is_finished());
        if limits.clients <= open.len() {
            let idle = (0..open.len()).filter(|&place| !standing(&open[place].0).at_work);
            match idle.min_by_key(|&place| standing(&open[place].0).asked) {
                Some(place) => open.swap_remove(place).1.abort(),
                None => {
                    // A socket that was just made takes so much at once, or its client waits for nothing.
                    let _ = stream.try_write(ALL_TAKEN);
                    continue;
                }
            }
        }
        let shared = Arc::new(Mutex::new(Standing { asked: Instant::now(), at_work: false }));
        let task = tokio::spawn(attend(stream, routes.clone(), limits, find.clone(), Arc::clone(&shared)));
        open.push((shared, task.abort_handle()));
    }
}

fn standing(shared: &Shared) -> Standing {
    *shared.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Answers the requests of one connection, until it ends or its time is over.
async fn attend(stream: TcpStream, routes: Router, limits: Limits, find: impl Fn(&mut Uri) + Clone, shared: Shared) {
    let routes = TowerToHyperService::new(routes);
    let service = service_fn(|mut request: Request<Incoming>| {
        find(request.uri_mut());
        let stands = |at_work| {
            *shared.lock().unwrap_or_else(PoisonError::into_inner) = Standing { asked: Instant::now(), at_work };
        };
        stands(true);
        let answer = routes.call(request);
        async move {
            let answer = answer.await;
            stands(false);
            answer
        }
    });
    // Small answers are not to wait for more.
    let _ = stream.set_nodelay(true);
    let connection = http1::Builder::new()
        .timer(TokioTimer::new())
        .header_read_timeout(limits.request)
        .max_header_size(REQUEST_BYTES_MAX)
        .max_buf_size(REQUEST_BYTES_MAX)
        .serve_connection(TokioIo::new(stream), service);
    let mut connection = std::pin::pin!(connection);
    loop {
        let end = standing(&shared).asked + limits.answer;
        // What a client does wrong is for the client to know.
        if timeout_at(end, connection.as_mut()).await.is_ok()
            || standing(&shared).asked + limits.answer <= Instant::now()
        {
            return;
        }
    }
}
