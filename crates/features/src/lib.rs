//! Roads, rivers and lakes as parts of the ground.
mod place;
pub use place::{COORDINATE_MAX, FeatureLattice, Place, STEPS_PER_POST_MAX};
mod source;
pub use source::{FeatureId, Member, Numbering, Position, Shape, Source};
mod remark;
pub use remark::{Flaw, Remark, Remedy};
pub mod table;
pub use table::{Form, Kind};
mod lengths;
mod rules;
pub use rules::{Feature, Rule, RuleKind, Sorted, Storey, Traits, nearest_tags, sort_out};
mod exact;
mod quarters;
mod snap;
pub use snap::{Meeting, snap_round, touch_at_vertices_only};
