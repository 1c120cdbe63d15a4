//! The two pages of the service: what is served, and what can be asked. They load nothing from elsewhere.

use axum::http::header;
use axum::response::{IntoResponse, Response};
use maud::{DOCTYPE, Markup, PreEscaped, html};
use serde_json::Value;

/// What a page may load: itself.
const POLICY: &str = "default-src 'none'; style-src 'unsafe-inline'";
const STYLE: &str = "
body { font: 16px/1.5 system-ui, sans-serif; max-width: 60rem; margin: 2rem auto; padding: 0 1rem }
:root { color-scheme: light dark }
table { border-collapse: collapse } td, th { text-align: left; padding: .2rem 1rem .2rem 0; vertical-align: top }
code, pre { font-family: ui-monospace, monospace; font-size: 90% } pre { overflow-x: auto; padding: .5rem 0 }
h3 code { font-weight: bold }";

fn page(title: &str, body: Markup) -> Response {
    let page = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                title { (title) }
                style { (PreEscaped(STYLE)) }
            }
            body { h1 { (title) } (body) }
        }
    };
    let kinds = [(header::CONTENT_TYPE, "text/html; charset=utf-8"), (header::CONTENT_SECURITY_POLICY, POLICY)];
    (kinds, page.into_string()).into_response()
}

/// What is served: `databases` as `/databases.json` has them.
pub fn index(databases: &[Value]) -> Response {
    let text = |value: &Value| value.as_str().unwrap_or_default().to_owned();
    page(
        "Terrain databases",
        html! {
            p { a href="/docs" { "What can be asked" } ", for programs as " a href="/openapi.json" { "OpenAPI" }
                ", and this list as " a href="/databases.json" { "JSON" } "." }
            @for database in databases {
                h2 { (text(&database["name"])) }
                @if let Some(error) = database["error"].as_str() {
                    p { "Cannot be read: " (error) }
                } @else {
                    table {
                        tr { th { "Area" } td { (text(&database["area"])) } }
                        tr { th { "Coordinates" } td { (text(&database["crs"])) } }
                        tr { th { "Heights above" } td { (known(&text(&database["vertical_datum"]))) } }
                        tr { th { "South-west corner" } td { code { (database["origin_m"]) } } }
                        tr { th { "Size in metres" } td { code { (database["size_m"]) } } }
                        tr { th { "Rows and columns of load modules" } td { code { (database["load_modules"]) } } }
                        tr { th { "Levels of detail" } td { (database["levels"]) } }
                        tr { th { "Triangles" } td { (database["triangles"]) } }
                    }
                    p { "For globes: " a href=(text(&database["links"]["terrain"])) { "quantized-mesh terrain" } ", "
                        a href=(text(&database["links"]["tileset"])) { "3D Tiles" } ". Files: "
                        a href=(text(&database["links"]["modules"])) { "load modules" } "." }
                }
            }
        },
    )
}

fn known(datum: &str) -> &str {
    if datum.is_empty() { "an unknown datum" } else { datum }
}

/// What can be asked, from the OpenAPI document.
pub fn docs(document: &Value) -> Response {
    let text = |value: &Value| value.as_str().unwrap_or_default().to_owned();
    let empty = serde_json::Map::new();
    let paths = document["paths"].as_object().unwrap_or(&empty);
    page(
        "What can be asked",
        html! {
            p { (text(&document["info"]["description"])) }
            @for (path, methods) in paths {
                @for (method, operation) in methods.as_object().unwrap_or(&empty) {
                    h3 { code { (method.to_uppercase()) " " (path) } }
                    p { strong { (text(&operation["summary"])) ". " } (text(&operation["description"])) }
                    @if let Some(parameters) = operation["parameters"].as_array() {
                        table { @for parameter in parameters {
                            tr { td { code { (text(&parameter["name"])) } } td { (text(&parameter["description"])) } }
                        } }
                    }
                    @if let Some(contents) = operation["requestBody"]["content"].as_object() {
                        @for (kind, content) in contents {
                            p { "Body as " code { (kind) } ": " (text(&content["schema"]["description"])) }
                            @if content.get("example").is_some() { pre { (content["example"]) } }
                        }
                    }
                    table { @for (status, response) in operation["responses"].as_object().unwrap_or(&empty) {
                        tr { td { code { (status) } } td { (text(&response["description"])) } }
                    } }
                }
            }
        },
    )
}
