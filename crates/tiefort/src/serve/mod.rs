//! The service of `tiefort serve`: built databases over HTTP.
//!
//! ```text
//!   connections   a bounded number of clients, each for a bounded time
//!   routes        address to answer; packing, other origins, refusals in JSON
//!   answers       what each address answers, from a
//!   snapshot      database as one build left it: opened again when its record changed   (contents)
//!   ground        load modules in memory, for queries       (queries, body, looks)
//!   globe         terrain and 3D Tiles, file by file        (files)
//!   openapi, pages   what can be asked
//!   report_page   what a browser shows where no viewer is built in
//! ```
//! An answer comes from one finished build or says to ask later. All that stays in memory is bounded.

mod answers;
mod body;
mod connections;
pub mod files;
mod globe;
mod ground;
mod looks;
mod openapi;
mod page;
mod pages;
mod queries;
mod refusal;
#[cfg(not(feature = "viewer"))]
mod report_page;
mod routes;
mod snapshot;

use std::collections::BTreeMap;
use std::net::{IpAddr, SocketAddr};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

use axum::Router;
use exports::Datum;
use tokio::net::TcpListener;
use tokio::runtime;

use crate::failure::Failure;
use crate::terminal;
use answers::Shared;
use body::Bodies;
use connections::Limits;
pub use page::Page;
#[cfg(not(feature = "viewer"))]
pub use report_page::report_page;
use routes::Find;
use snapshot::Served;

/// What is served, to whom, and how much of this machine it may take.
pub struct Options {
    /// The databases.
    pub folders: Vec<PathBuf>,
    /// Where it listens.
    pub host: IpAddr,
    /// See there; 0 takes any that is free.
    pub port: u16,
    /// Origins whose pages may ask; `*` is all.
    pub cors: Vec<String>,
    /// Bytes of a body at most.
    pub body_max: usize,
    /// Connections at a time.
    pub clients_max: usize,
    /// For a request to arrive whole.
    pub request_within: Duration,
    /// For an answer to be made and read.
    pub answer_within: Duration,
    /// What to take heights to be above, whatever databases say.
    pub assumed: Option<Datum>,
}

/// Serves until Ctrl-C; `command` is the word that began it.
///
/// # Errors
/// When a database cannot be read, or the port is taken.
pub fn serve(command: &str, options: &Options, page: Option<Page>) -> Result<(), Failure> {
    let served = opened(options)?;
    let address = SocketAddr::new(options.host, options.port);
    let refused = |error: std::io::Error| {
        let hint = match error.kind() {
            std::io::ErrorKind::AddrNotAvailable => "--host is an address of this machine; 127.0.0.1 always is",
            _ => "choose another --port, or 0 for a free one",
        };
        Failure::new(format!("{address}: cannot be served: {error}"), hint)
    };
    // What waits for the disk has a thread each; places in queues bound how many are at work (answers.rs).
    let runtime = runtime::Builder::new_multi_thread().worker_threads(2).enable_all().build().map_err(refused)?;
    runtime.block_on(async {
        // Before the address is told: a signal may follow at once.
        let stopped = Stopped::watch().map_err(refused)?;
        let listener = TcpListener::bind(address).await.map_err(refused)?;
        let address = listener.local_addr().map_err(refused)?;
        terminal::print(&format!("http://{address}/\n"))?;
        terminal::tell(&announcement(command, options, address));
        let find = Find::new(served.keys().cloned(), page.as_ref().map_or(&[], |page| page.paths));
        let bodies = Bodies::new(options.body_max, options.request_within);
        let own = routes::routes(Arc::new(Shared::new(served, bodies)), &options.cors, page.is_none());
        let all = page.map_or_else(Router::new, |page| page.routes).merge(own);
        let all = if address.ip().is_loopback() { routes::only_from_here(all, address) } else { all };
        let limits =
            Limits { clients: options.clients_max, request: options.request_within, answer: options.answer_within };
        let server = tokio::spawn(connections::serve(listener, all, limits, move |uri| find.find(uri)));
        let stopped = stopped.come().await;
        // Clients may hold their connections open for minutes: they end with the process.
        server.abort();
        stopped.map_err(refused)
    })?;
    runtime.shutdown_background();
    Ok(())
}

/// Ctrl-C, or the word of a supervisor.
struct Stopped {
    #[cfg(unix)]
    signals: [tokio::signal::unix::Signal; 2],
}

impl Stopped {
    /// Begins to watch: from here on a signal does not end the process.
    fn watch() -> std::io::Result<Self> {
        #[cfg(unix)]
        {
            use tokio::signal::unix::{SignalKind, signal};
            Ok(Self { signals: [signal(SignalKind::interrupt())?, signal(SignalKind::terminate())?] })
        }
        #[cfg(not(unix))]
        Ok(Self {})
    }

    /// Waits for it.
    async fn come(self) -> std::io::Result<()> {
        #[cfg(unix)]
        {
            use std::task::{Context, Poll};
            let [mut interrupt, mut terminate] = self.signals;
            let come = |context: &mut Context| match interrupt.poll_recv(context) {
                Poll::Pending => terminate.poll_recv(context),
                come => come,
            };
            std::future::poll_fn(come).await;
            Ok(())
        }
        #[cfg(not(unix))]
        tokio::signal::ctrl_c().await
    }
}

fn opened(options: &Options) -> Result<BTreeMap<String, Arc<Served>>, Failure> {
    let mut served = BTreeMap::new();
    for folder in &options.folders {
        let name = name_of(folder)?;
        let opened = Served::open(name.clone(), folder, options.assumed)?;
        if served.insert(name.clone(), Arc::new(opened)).is_some() {
            return Err(Failure::new(
                format!("{}: found a second folder of the name {name:?}, expected one of each name", folder.display()),
                "addresses begin with the folder's name: rename one, or serve it on another --port",
            ));
        }
    }
    Ok(served)
}

/// The name of a folder, also of `.` and `..`.
fn name_of(folder: &Path) -> Result<String, Failure> {
    let named = folder.file_name().map(Path::new).map(Path::to_path_buf);
    let name = named.or_else(|| folder.canonicalize().ok()?.file_name().map(PathBuf::from));
    name.map(|name| name.to_string_lossy().into_owned()).ok_or_else(|| {
        let message =
            format!("{}: found a folder without a name, expected one to begin addresses with", folder.display());
        Failure::new(message, "name a folder below it")
    })
}

/// What is served and who can reach it.
fn announcement(command: &str, options: &Options, address: SocketAddr) -> String {
    let folders: Vec<String> = options.folders.iter().map(|folder| folder.display().to_string()).collect();
    let whom = match address.ip() {
        ip if ip.is_loopback() => "programs on this machine only".to_owned(),
        ip if ip.is_unspecified() => {
            format!("everyone who reaches port {} of this machine, without a password", address.port())
        }
        ip => format!("everyone who reaches {ip}, without a password"),
    };
    let pages = match options.cors.is_empty() {
        true => String::new(),
        false => format!(", and to pages of {}", options.cors.join(", ")),
    };
    format!("tiefort {command}: {}; open to {whom}{pages}; Ctrl-C ends this", folders.join(", "))
}
