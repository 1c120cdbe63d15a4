//! Buildings, walls and woods: from tags and shapes to what stands in the square of each load module.
//!
//! ```text
//! traits(tags, kind, rules) -> Traits          what it is, how high, how dense
//! mended(found, options) -> Vec<Outline>       on the lattice, without flaws, few corners; woods united
//! Claims::of(outlines, free, ..)               cut at load-module lines; woods leave roads free
//!     .granted(limits) -> Granted              what hides least is left out without room
//! ```
//!
//! Heights are above the ground, which is not known here: the roof of a prism is that of its highest ground plus
//! `roof`, and one with a `base` above 0 hangs in the air. Nothing depends on the order in which objects come.

mod canopy;
mod corners;
mod cut;
mod grant;
mod mend;
mod plan;
mod table;

pub use canopy::{CanopyRun, canopy_class, canopy_woods};
pub use grant::{Claims, Full, Granted, ObjectLimits, ObjectTally, Wanting};
pub use mend::{FoundObject, FoundShape, ObjectOptions, ObjectRemark, Outline, mended, strips};
pub use plan::Plan;
pub use table::{OBJECT_KEYS, ObjectRule, Traits, traits};

#[cfg(test)]
mod tests;
