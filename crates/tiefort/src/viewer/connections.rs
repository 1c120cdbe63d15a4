//! The connections of `tiefort view`: a bounded number of them, each for a bounded time.
//!
//! A client that sends its request byte by byte, or none at all, is ended when its time is over; one that does not read
//! its answer, later. When all places are taken, the connection that asked for something longest ago is ended for the
//! new one. So clients that are slow, by fault or on purpose, take a bounded share of memory, and others do not wait
//! for them.

use std::io;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use axum::Router;
use hyper::server::conn::http1;
use hyper::service::{Service, service_fn};
use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::service::TowerToHyperService;
use tokio::net::{TcpListener, TcpStream};
use tokio::task::AbortHandle;
use tokio::time::{Instant, sleep, timeout_at};

/// Connections at a time: a browser opens six for a page.
const CONNECTIONS_MAX: usize = 64;
/// For a request to arrive whole, and for the next one to begin.
const REQUEST_SECONDS_MAX: Duration = Duration::from_secs(5);
/// For an answer to be made and read: the ground of a large area takes a minute or two.
const ANSWER_SECONDS_MAX: Duration = Duration::from_secs(300);
/// Bytes of a request, whose body is never read: the page's own have some hundreds.
const REQUEST_BYTES_MAX: usize = 16 << 10;
/// Before the next try when the system has no socket left.
const ACCEPT_PAUSE: Duration = Duration::from_millis(100);

/// When a connection was made, or its last request arrived.
type Asked = Arc<Mutex<Instant>>;

/// Serves `routes` to all who connect, for as long as this is polled.
pub async fn serve(listener: TcpListener, routes: Router) {
    let mut open: Vec<(Asked, AbortHandle)> = Vec::new();
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
        if CONNECTIONS_MAX <= open.len()
            && let Some(place) = (0..open.len()).min_by_key(|&place| asked(&open[place].0))
        {
            open.swap_remove(place).1.abort();
        }
        let last = Arc::new(Mutex::new(Instant::now()));
        let task = tokio::spawn(attend(stream, routes.clone(), Arc::clone(&last)));
        open.push((last, task.abort_handle()));
    }
}

fn asked(last: &Asked) -> Instant {
    *last.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Answers the requests of one connection, until it ends or its time is over.
async fn attend(stream: TcpStream, routes: Router, last: Asked) {
    let routes = TowerToHyperService::new(routes);
    let service = service_fn(|request| {
        *last.lock().unwrap_or_else(PoisonError::into_inner) = Instant::now();
        routes.call(request)
    });
    let connection = http1::Builder::new()
        .timer(TokioTimer::new())
        .header_read_timeout(REQUEST_SECONDS_MAX)
        .max_header_size(REQUEST_BYTES_MAX)
        .max_buf_size(REQUEST_BYTES_MAX)
        .serve_connection(TokioIo::new(stream), service);
    let mut connection = std::pin::pin!(connection);
    loop {
        let end = asked(&last) + ANSWER_SECONDS_MAX;
        // What a client does wrong is for the client to know.
        if timeout_at(end, connection.as_mut()).await.is_ok() || asked(&last) + ANSWER_SECONDS_MAX <= Instant::now() {
            return;
        }
    }
}
