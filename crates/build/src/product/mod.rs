//! A finished database read back, and how it is shown: load modules, the ground under them, residuals, the page.
//!
//! [`Opened`] is the one way to open a finished database with its job.

mod error;
pub use error::ProductError;
mod opened;
pub use opened::{BuiltFrom, Opened};
mod sources;
pub use sources::{choose_ground, locate_features, locate_weights};
mod product;
pub use product::{LimitUse, Product, ProductGround, Wanted, WantedGround};
/// Stands for the residual of a void.
pub use views::NO_RESIDUAL;
mod page;
mod scene;
pub use page::{breaches, features_file, page};
pub(crate) use page::{objects_file, page_without_maps};
pub use scene::{SceneParts, water};
mod features_gpkg;
pub use features_gpkg::features_package;
mod kept;
pub use kept::from_features;
pub(crate) use kept::{from_curvature, from_tally, to_curvature, to_features, to_tally};
mod warnings;
pub use warnings::{Made, table as warnings_table, warnings};
pub(crate) use warnings::{WIDE_MIN, leaves_much_out};
mod earthworks;
mod told;
pub use told::{Told, read_told, told};
mod drape;
pub use drape::{Drape, DrapedArea, SQUARE_PIXELS};
pub(crate) use page::DRAWN_AT_ONCE;
