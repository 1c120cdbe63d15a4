//! Our files: one directory per gaming area, in which nothing is ever half-written.
//!
//! ```text
//! ntc.tdb/
//!   lock                 held while a build runs; stays when none does
//!   database.json        what was asked for, what is there: written last
//!   survey/r02c03.curve  gain curves; allocation.json
//!   tiles/r02c03.tin     one tile's TIN
//!   modules/r02c03.slm   one tile's load modules (docs/FORMAT.md)
//!   measured/r02c03.sums what was measured of them
//!   work/                leases and marks of processes that share the directory; gone at the end of a build
//!   report.json …        what a run found; the only files that know times
//! ```
//!
//! Every file is written under a temporary name and renamed into place; every file carries a checksum, so damage
//! is found on reading and named by file and section. `terrain`'s values are mirrored here by private types.

// A test that unwraps says by its line what failed.
#![cfg_attr(test, allow(clippy::unwrap_used))]

/// What files are stamped with.
pub use crate::engine::{Fingerprint, Stamp};
mod error;
pub use error::{DatabaseError, NotADatabase};
mod codec;
mod frame;
mod tile_file;
pub use tile_file::{decode_tile, encode_tile};
mod beside_tile;
pub use beside_tile::{
    Profile, Removals, decode_curve, decode_lines, decode_removals, encode_curve, encode_lines, encode_profile,
    encode_removals,
};
mod level_file;
pub use level_file::{
    AreaLevel, CULVERT, FeatureAmounts, FeatureEnd, FeatureFace, FeatureFarOff, FeatureLeftOut, FeatureLine,
    FeatureRemark, FeatureWhy, StripFigures, encode_level,
};
mod outlines_file;
pub(crate) use outlines_file::encode_outlines;
pub use outlines_file::{AreaOutlines, ModuleOutlines, ObjectLeftOut};
mod buildings_file;
pub(crate) use buildings_file::encode_buildings;
pub use buildings_file::{BUILDING_UNITS_PER_METRE, Building};
mod measured_file;
pub use measured_file::{
    Measured, MeasuredCurvature, MeasuredFeatures, MeasuredModule, MeasuredTally, decode_measured, encode_measured,
};
mod slm;
/// Version of the load-module files.
pub use load_module_reader::{
    VERSION as MODULES_FORMAT_VERSION, VERSION_OF_GROUND as MODULES_FORMAT_VERSION_OF_GROUND,
    VERSION_WITH_DECKS as MODULES_FORMAT_VERSION_WITH_DECKS,
};
pub use slm::{TileModules, decode_levels, encode_levels, encode_modules, load_module};
mod json;
mod page;
pub use page::seal_page;
mod manifest;
pub use manifest::{
    Area, FORMAT_VERSION, FileStamp, Manifest, ManifestState, SourceRecord, TileRecord, TileState, Totals,
};
mod report;
pub use report::{
    ObjectSums, Report, ReportBefore, ReportBorder, ReportBound, ReportBreach, ReportClass, ReportEnough,
    ReportHeights, ReportLevel, ReportLimit, ReportObjectLimit, ReportObjects, ReportPart, ReportPerModule,
    ReportPerWindow, ReportPlace, ReportPoints, ReportPool, ReportRefusals, ReportResidual, ReportStage, ReportStops,
    ReportTile, ReportVoids,
};
mod report_features;
pub use report_features::{
    ReportDeckClearance, ReportEarthwork, ReportEarthworks, ReportFarOff, ReportFeatureChecks, ReportFeatureClass,
    ReportFeatureCost, ReportFeatureRemarks, ReportFeatures,
};
mod lock;
pub use lock::Lock;
mod work;
pub use work::{RUN_DIGITS, TileBudget, Work};
mod folder;
pub use folder::Folder;
mod names;
pub use names::{FOLDERS, files};
mod database;
mod read;
pub use database::Database;
mod verify;
pub use verify::Damage;

#[cfg(test)]
mod samples;

pub mod engine;
