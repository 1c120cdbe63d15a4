//! What `tiefort view` shows where no viewer is built in: the page of the report, with a line on how to get the viewer.

use std::sync::Arc;

use axum::Router;
use axum::http::header;
use axum::response::{IntoResponse, Response};
use axum::routing::get;
use maud::html;

use super::page::Page;
use super::refusal::Refusal;
use crate::failure::Failure;

/// What the page may load: nothing, its pictures lie in it.
const POLICY: &str = "default-src 'none'; style-src 'unsafe-inline'; img-src data:";
const NOTICE_STYLE: &str =
    "margin: 0; padding: .6rem 1rem; background: #335; color: #fff; font: 14px/1.4 system-ui, sans-serif";

/// The page that `draw` makes, below a line that says `how` to get the viewer.
pub fn report_page(how: &str, draw: impl Fn() -> Result<String, Failure> + Send + Sync + 'static) -> Page {
    let notice = html! {
        p style=(NOTICE_STYLE) {
            "This tiefort was built without the viewer, so here is the page of the report. For the viewer, " (how)
            ". Programs ask at " a style="color: #cdf" href="/docs" { "these addresses" } "."
        }
    };
    let known = Arc::new((draw, notice.into_string()));
    let answer = async move || {
        let known = known.clone();
        let drawn = tokio::task::spawn_blocking(move || (known.0)().map(|page| below(&known.1, &page))).await;
        match drawn {
            Ok(Ok(page)) => answered(page),
            Ok(Err(failure)) => Refusal::of(failure).into_response(),
            Err(_) => Refusal::fault().into_response(),
        }
    };
    Page { routes: Router::new().route("/", get(answer)), paths: &[] }
}

fn answered(page: String) -> Response {
    let kinds = [(header::CONTENT_TYPE, "text/html; charset=utf-8"), (header::CONTENT_SECURITY_POLICY, POLICY)];
    (kinds, page).into_response()
}

/// A page with a notice at the top of its body.
fn below(notice: &str, page: &str) -> String {
    let body = page.find("<body").and_then(|at| Some(at + page[at..].find('>')? + 1)).unwrap_or(0);
    [&page[..body], notice, &page[body..]].concat()
}
