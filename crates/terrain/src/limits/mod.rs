//! One definition of what counts against a limit, and the ledger a tile spends from.
//!
//! Identities per load module with `V` inner vertices, `B` vertices on its sides (corners included) and
//! `E` inner edges of its polygons: triangles = 2 V + B - 2, polygons = 1 + E - V.

mod count;
pub use count::{polygons_of, start_triangles, start_triangles_of_area, triangles_of};
mod windows;
pub use windows::Windows;
mod lines;
pub use lines::{Charged, ModuleLines};
mod shortfall;
pub use shortfall::{ShortOf, Shortfall};
mod ledger;
pub use ledger::{Allowance, Ledger};
mod features;
pub use features::{FeatureCost, feature_cost};
mod tile_ledger;
pub use tile_ledger::TileLedger;
