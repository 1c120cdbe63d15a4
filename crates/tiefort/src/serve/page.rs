//! A page of its own beside the service.

use axum::Router;

/// A page and what it asks.
pub struct Page {
    /// Its addresses.
    pub routes: Router,
    /// The same, whole or up to a `*`.
    pub paths: &'static [&'static str],
}
