//! `tiefort serve`: databases over HTTP.

use std::net::IpAddr;
use std::path::PathBuf;

use clap::Args;
use clap::builder::RangedI64ValueParser;
use exports::Datum;

use super::export::datum;
use crate::failure::{Failure, Outcome};

/// Port unless told.
const PORT: u16 = 8380;
/// Mebibytes of a body: a million positions.
const BODY_MIB: u32 = 16;
/// Clients at a time: a browser opens six connections for a page.
const CLIENTS: u32 = 256;
/// Seconds for a request to arrive.
const REQUEST_SECONDS: u32 = 10;
/// Seconds for an answer: a large area is set on the globe in a minute or two.
const ANSWER_SECONDS: u32 = 300;

const AFTER_HELP: &str = "\
Examples:
  tiefort serve ntc.tdb
  tiefort serve ntc.tdb alps.tdb --port 8000 --cors https://example.org
  curl -d '{\"positions\": [[530125, 3899310.5]]}' http://127.0.0.1:8380/heights
  curl 'http://127.0.0.1:8380/ntc.tdb/explain?module=42,17'

Addresses begin with the folder's name; with one DIR they also work without.
  /                          what is served; /docs what can be asked
  /NAME/layer.json           terrain for globes (CesiumJS), made on demand
  /NAME/tileset.json         3D Tiles for globes, made on demand
  /NAME/modules/r02c03.slm   a file of load modules, whole or in part
  /NAME/heights              heights at positions, JSON or raw 64-bit floats
  /NAME/line-of-sight        whether one place is seen from another
  /NAME/explain              one load module, explained

While a database is being built it answers 503, and afterwards from the new
one; no answer mixes two builds. It asks for no password: beyond this machine,
put it behind a proxy that does. Ctrl-C ends it.";

/// Arguments of `serve`.
#[derive(Args)]
#[command(after_help = AFTER_HELP)]
pub struct Arguments {
    /// Folders of terrain databases
    #[arg(value_name = "DIR", required = true)]
    databases: Vec<PathBuf>,
    /// Address to listen at: 127.0.0.1 is this machine alone, 0.0.0.0 whatever reaches it
    #[arg(long, value_name = "ADDRESS", default_value = "127.0.0.1", value_parser = host)]
    host: IpAddr,
    /// Port; 0 takes any that is free
    #[arg(long, value_name = "N", default_value_t = PORT)]
    port: u16,
    /// An origin whose pages may ask, such as https://example.org, or * for all; may be given several times
    #[arg(long, value_name = "ORIGIN", value_parser = origin)]
    cors: Vec<String>,
    /// What to take heights to be above for globes, whatever a database says: EGM96, ellipsoid, or metres that their
    /// datum lies above the ellipsoid
    #[arg(long, value_name = "DATUM", value_parser = datum, allow_hyphen_values = true)]
    assume_datum: Option<Datum>,
    /// MiB of a request's body at most
    #[arg(long, value_name = "MIB", default_value_t = BODY_MIB, value_parser = up_to(1024))]
    max_body: u32,
    /// Connections at a time
    #[arg(long, value_name = "N", default_value_t = CLIENTS, value_parser = up_to(65536))]
    max_clients: u32,
    /// Seconds in which a request must arrive whole
    #[arg(long, value_name = "N", default_value_t = REQUEST_SECONDS, value_parser = up_to(3600))]
    request_seconds: u32,
    /// Seconds in which an answer is made and read
    #[arg(long, value_name = "N", default_value_t = ANSWER_SECONDS, value_parser = up_to(3600))]
    answer_seconds: u32,
}

/// Reads a whole number from 1.
fn up_to(most: i64) -> RangedI64ValueParser<u32> {
    clap::value_parser!(u32).range(1..=most)
}

fn host(text: &str) -> Result<IpAddr, String> {
    let text = if text == "localhost" { "127.0.0.1" } else { text };
    text.parse().map_err(|_| "expected an address of this machine, such as 127.0.0.1, ::1 or 0.0.0.0".into())
}

fn origin(text: &str) -> Result<String, String> {
    let name = text.strip_prefix("https://").or_else(|| text.strip_prefix("http://"));
    let is_origin = name.is_some_and(|name| !name.is_empty() && name.chars().all(|c| c.is_ascii_graphic() && c != '/'));
    if text == "*" || is_origin {
        return Ok(text.to_owned());
    }
    Err("expected an origin, such as https://example.org or http://localhost:3000 without a path, or *".into())
}

/// Serves until Ctrl-C.
#[cfg(feature = "serve")]
pub fn run(arguments: &Arguments) -> Result<Outcome, Failure> {
    crate::serve::serve("serve", &options(arguments), None)?;
    Ok(Outcome::Sound)
}

/// Says how to get a program that can.
#[cfg(not(feature = "serve"))]
pub fn run(_: &Arguments) -> Result<Outcome, Failure> {
    Err(Failure::new(
        "this tiefort was built without the service",
        "build it with `--features serve`, which is the default",
    ))
}

#[cfg(feature = "serve")]
fn options(arguments: &Arguments) -> crate::serve::Options {
    let seconds = |count: u32| std::time::Duration::from_secs(u64::from(count));
    crate::serve::Options {
        folders: arguments.databases.clone(),
        host: arguments.host,
        port: arguments.port,
        cors: arguments.cors.clone(),
        body_max: (arguments.max_body as usize) << 20,
        clients_max: arguments.max_clients as usize,
        request_within: seconds(arguments.request_seconds),
        answer_within: seconds(arguments.answer_seconds),
        assumed: arguments.assume_datum,
    }
}

/// Serves one database with a page beside it, on this machine, until Ctrl-C.
///
/// # Errors
/// When the database cannot be read, or the port is taken.
#[cfg(feature = "serve")]
pub fn run_with_page(database: &std::path::Path, port: u16, page: crate::serve::Page) -> Result<Outcome, Failure> {
    let arguments = Arguments {
        databases: vec![database.to_path_buf()],
        host: std::net::Ipv4Addr::LOCALHOST.into(),
        port,
        cors: Vec::new(),
        assume_datum: None,
        max_body: BODY_MIB,
        max_clients: CLIENTS,
        request_seconds: REQUEST_SECONDS,
        answer_seconds: ANSWER_SECONDS,
    };
    crate::serve::serve("view", &options(&arguments), Some(page))?;
    Ok(Outcome::Sound)
}
