//! Which address is answered by what, and what holds for all of them: packing, names of contents, leave for other
//! origins, refusals in JSON.

use std::collections::BTreeSet;
use std::net::SocketAddr;
use std::sync::Arc;

use axum::Router;
use axum::body::to_bytes;
use axum::extract::{DefaultBodyLimit, Request, State};
use axum::http::{HeaderValue, Method, StatusCode, Uri, header};
use axum::middleware::{self, Next, from_fn};
use axum::response::{IntoResponse, Response};
use axum::routing::{get, post};
use percent_encoding::percent_decode_str;
use tower_http::CompressionLevel;
use tower_http::compression::CompressionLayer;
use tower_http::compression::predicate::{NotForContentType, Predicate, SizeAbove};
use tower_http::cors::{AllowOrigin, CorsLayer};

use super::answers::{self, Context, Shared, path_of};
use super::refusal::Refusal;
use super::{openapi, pages};

/// Addresses that belong to no database.
const OF_ALL: [&str; 4] = ["/", "/docs", "/openapi.json", openapi::DATABASES];
/// A refusal in words is this long at most.
const WORDS_MAX: usize = 4 << 10;
/// Answers below this gain nothing by packing.
const PACKED_MIN: u64 = 512;

/// All addresses of the service; without an index where another page is first.
pub fn routes(shared: Arc<Shared>, cors: &[String], has_index: bool) -> Router {
    let packing = CompressionLayer::new()
        .gzip(true)
        .quality(CompressionLevel::Fastest)
        .compress_when(SizeAbove::new(PACKED_MIN).and(NotForContentType::const_new("application/octet-stream")));
    let first = if has_index { Router::new().route("/", get(index)) } else { Router::new() };
    let router = first
        .route("/docs", get(async || pages::docs(&openapi::document())))
        .route("/openapi.json", get(openapi_document))
        .route(openapi::DATABASES, get(answers::databases))
        .route(openapi::DATABASE, get(answers::database))
        .route("/{database}/", get(answers::database))
        .route(openapi::LAYER, get(answers::layer))
        .route(openapi::TERRAIN, get(answers::terrain_tile))
        .route(openapi::HOLES, get(answers::holes))
        .route(openapi::TILESET, get(answers::tileset))
        .route(openapi::SQUARE, get(answers::square))
        .route(openapi::GROUP, get(answers::group))
        .route(openapi::LEVEL, get(answers::level_of_square))
        .route(openapi::MODULES, get(answers::modules))
        .route(openapi::MODULE, get(answers::module_file))
        .route(openapi::HEIGHTS, post(answers::heights))
        .route(openapi::SIGHT, post(answers::line_of_sight))
        .route(openapi::VIEWSHED, get(answers::viewshed))
        .route(openapi::PROFILE, get(answers::profile))
        .route(openapi::OBSTACLE, get(answers::obstacle))
        .route(openapi::EXPLAIN, get(answers::explained))
        .fallback(async |uri: Uri| {
            Refusal::missing(format!("found {}, expected an address that /docs lists", uri.path()), "/ lists databases")
        })
        // Bodies have a limit of their own.
        .layer(DefaultBodyLimit::disable())
        .with_state(shared)
        .layer(from_fn(in_json))
        .layer(packing)
        .layer(from_fn(packed_by_another_name));
    if cors.is_empty() { router } else { router.layer(leave(cors)) }
}

async fn index(State(shared): Context) -> Result<Response, Refusal> {
    let databases = answers::described_all(&shared).await?;
    Ok(pages::index(&databases))
}

async fn openapi_document() -> Response {
    ([(header::CONTENT_TYPE, "application/json")], format!("{:#}\n", openapi::document())).into_response()
}

/// Leave for pages of these origins to ask; `*` is all.
fn leave(origins: &[String]) -> CorsLayer {
    let origin = match origins.iter().any(|origin| origin == "*") {
        true => AllowOrigin::any(),
        false => AllowOrigin::list(origins.iter().filter_map(|origin| HeaderValue::from_str(origin).ok())),
    };
    CorsLayer::new()
        .allow_origin(origin)
        .allow_methods([Method::GET, Method::HEAD, Method::POST])
        .allow_headers([header::CONTENT_TYPE, header::RANGE, header::IF_NONE_MATCH, header::IF_RANGE, header::ACCEPT])
        .expose_headers([header::ETAG, header::CONTENT_RANGE, header::ACCEPT_RANGES, header::RETRY_AFTER])
}

/// A packed content has other bytes: its name says that only the meaning is the same.
async fn packed_by_another_name(request: Request, next: Next) -> Response {
    let mut response = next.run(request).await;
    let headers = response.headers_mut();
    if headers.contains_key(header::CONTENT_ENCODING)
        && let Some(tag) = headers.get(header::ETAG).and_then(|tag| tag.to_str().ok())
        && let Ok(weak) = HeaderValue::from_str(&format!("W/{tag}"))
    {
        headers.insert(header::ETAG, weak);
    }
    headers.insert(header::X_CONTENT_TYPE_OPTIONS, HeaderValue::from_static("nosniff"));
    response
}

/// Refusals of the router itself in the form of all others.
async fn in_json(request: Request, next: Next) -> Response {
    let method = request.method().clone();
    let response = next.run(request).await;
    let status = response.status();
    let is_json = response.headers().get(header::CONTENT_TYPE).is_some_and(|kind| kind == "application/json");
    if is_json || !(status.is_client_error() || status.is_server_error()) {
        return response;
    }
    let (head, body) = response.into_parts();
    let said = to_bytes(body, WORDS_MAX).await.unwrap_or_default();
    let refusal = match status {
        // Every address takes one of the two.
        StatusCode::METHOD_NOT_ALLOWED => {
            let expected = match method {
                Method::GET | Method::HEAD => "POST",
                Method::POST => "GET",
                _ => "GET or POST",
            };
            Refusal::new(status, format!("found {method}, expected {expected}"), "/docs lists what can be asked")
        }
        status => {
            let error = format!("found a request that cannot be read: {}", String::from_utf8_lossy(&said));
            Refusal::new(status, error, "/docs lists what can be asked")
        }
    };
    let mut refused = refusal.into_response();
    if let Some(allowed) = head.headers.get(header::ALLOW) {
        refused.headers_mut().insert(header::ALLOW, allowed.clone());
    }
    refused
}

/// Refuses requests under another name than this machine's own, which a page from elsewhere could have had sent.
pub fn only_from_here(router: Router, address: SocketAddr) -> Router {
    router.layer(middleware::from_fn(move |request: Request, next: Next| async move {
        let host = request.headers().get(header::HOST).and_then(|host| host.to_str().ok()).unwrap_or_default();
        let port = address.port();
        let names = [address.to_string(), format!("127.0.0.1:{port}"), format!("localhost:{port}")];
        if names.iter().any(|name| name == host) {
            return next.run(request).await;
        }
        let error = format!("found a request for {host:?}, expected {}", names[0]);
        Refusal::new(StatusCode::FORBIDDEN, error, "--host of `tiefort serve` opens it to other machines")
            .into_response()
    }))
}

/// Gives a request its address: where there is one database, its name may be left out.
#[derive(Clone)]
pub struct Find {
    names: BTreeSet<String>,
    /// What is no database's, whole or up to a `*`.
    of_others: &'static [&'static str],
}

impl Find {
    pub fn new(names: impl Iterator<Item = String>, of_others: &'static [&'static str]) -> Self {
        Self { names: names.collect(), of_others }
    }

    pub fn find(&self, uri: &mut Uri) {
        if let Some(path) = self.found(uri.path())
            && let Ok(found) = uri.query().map_or(path.clone(), |query| format!("{path}?{query}")).parse()
        {
            *uri = found;
        }
    }

    /// The whole path of one without a database's name.
    fn found(&self, path: &str) -> Option<String> {
        let only = self.names.first().filter(|_| self.names.len() == 1)?;
        let matches = |other: &&str| other.strip_suffix('*').map_or(*other == path, |start| path.starts_with(start));
        if OF_ALL.contains(&path) || self.of_others.iter().any(matches) {
            return None;
        }
        let first = path.trim_start_matches('/').split('/').next().unwrap_or_default();
        let first = percent_decode_str(first).decode_utf8_lossy();
        (first != *only).then(|| format!("{}{path}", path_of(only)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_name_of_the_only_database_may_be_left_out() {
        let one = Find::new(["a b.tdb".to_owned()].into_iter(), &["/api/*"]);
        assert_eq!(one.found("/layer.json").as_deref(), Some("/a%20b.tdb/layer.json"));
        assert_eq!(one.found("/3/1/2.terrain").as_deref(), Some("/a%20b.tdb/3/1/2.terrain"));
        for whole in ["/", "/docs", "/a%20b.tdb/layer.json", "/a%20b.tdb", "/api/area"] {
            assert_eq!(one.found(whole), None, "{whole}");
        }
        let two = Find::new(["a".to_owned(), "b".to_owned()].into_iter(), &[]);
        assert_eq!(two.found("/layer.json"), None);
    }
}
