//! What people look at: pictures, the report as text and as a page, breaches on a map.
//!
//! Pure: values in, bytes or text out. Nothing here opens a file, reads a clock or asks what the terminal can do;
//! delete this crate and the load modules still come out the same.

// A test that unwraps says by its line what failed.
#![cfg_attr(test, allow(clippy::unwrap_used))]

mod against;
pub use against::leading;
mod map_files;
pub use map_files::{BreachPlaces, breaches_csv, breaches_geojson, features_geojson, outcome};
mod parts;
pub use parts::{eta_in_words, remarks_in_words, stages_text};
mod section;
pub use section::Section;
mod certificate;
mod page;
pub use certificate::{Certificate, CertificateMap, certificate_html, certificate_text};
pub use page::{Page, PageSetting, report_html};
mod picture;
pub use picture::{
    Camera, Color, Cover, Drawn, Eye, Facets, Image, Look, Map, NO_RESIDUAL, Panel, RESIDUAL_SCALE_M, Scene,
    SceneFeatures, SceneGround, SceneLimits, SceneTile, SeenGround, Shown, Sight, Style, Surface, draw_errors,
    draw_map, draw_module_limits, draw_panels, draw_seen, draw_sight, palette,
};
mod table;
pub use table::{Align, COLUMNS_MAX, Cell, Table, fold, grouped};
mod report;
pub use report::report_text;

#[cfg(test)]
mod samples;
