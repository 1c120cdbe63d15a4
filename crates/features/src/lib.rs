//! Roads, rivers and lakes as parts of the ground: from tags and positions to points and edges a TIN has to keep.
//!
//! The crate knows no file, no raster and no coordinate system. Positions come in posts of the working grid; every
//! place that is decided is one of the [`FeatureLattice`], every height a whole number of quanta; and nothing depends
//! on the order in which features come, or on anything but their content. What is wrong with a feature never stops
//! anything: it is mended or left out, and each time a [`Remark`] says so. In the order of use:
//!
//! ```text
//! sort_out(Vec<Source>, &[Rule], f64) -> Sorted     kinds, classes, widths, grades
//! mend(Vec<Feature>, &Site) -> Mended               ways and areas on the lattice, cut at the area's border
//! round(Mended, &Site) -> Rounded                   stations; lines touch at shared vertices or not at all
//! split_at_dams(rounded.outlines, &rounded.ways) -> Vec<Outline>
//! Network::of(&travelled(&rounded), ..), Network::of(&flowing(&rounded), ..)
//! level(&outlines, &shores, ..) -> Waters           lakes; then lakes_along(..) -> Vec<Still> for the rivers
//! fall(&rivers, Bed, &still, &pins, ..) -> Fallen           rivers; channels(..), shore(..), banks(..) -> Vec<Strand>
//! grade(&roads, [&ground, &middle], &pins, Below { water: &water(&strands), .. }, GradeOptions, ..) -> Vec<i32>
//! reserve(&Graded, &strands, &Site, &Shares, about) -> Reserved
//!     .formed: Formed { points, edges, faces, decks, middles, remarks }, .cost: triangles by load module and class
//! ```
//!
//! The DEM comes in as values: at every `network.nodes[..].place`, at both [`sides`] of each, at the lower bank of
//! rivers, and at every place of the rings of outlines.

// From tags to what a feature is.
mod source;
pub use source::{FeatureId, Numbering, Position, Shape, Source};
mod remark;
pub use remark::{Flaw, Remark, Remedy};
pub mod table;
pub use table::{Form, Kind};
mod lengths;
pub use lengths::{BuildingHeights, building_heights};
mod overview;
pub use overview::{IdleRule, Overview, OverviewRow, RowOrigin, overview};
mod rules;
pub use rules::{Feature, Rule, RuleKind, Sorted, Storey, Traits, class_names, nearest_tags, sort_out};

// What stands on the ground.
pub mod objects;

// Onto the lattice.
mod place;
pub use place::{COORDINATE_MAX, FeatureLattice, Place, STEPS_PER_POST_MAX};
mod exact;
pub use exact::Segment;
mod clip;
pub use clip::Extent;
mod site;
pub use site::Site;
mod quarters;
mod snap;
pub use snap::{Meeting, snap_round, touch_at_vertices_only};
mod clean;
mod crowd;
pub use crowd::STATIONS_PER_MODULE_MAX;
mod gaps;
mod rings;
pub use rings::{Ring, doubled_area, encloses, height_in};
mod ways;
pub use ways::{Area, Way};
mod mend;
pub use mend::{Mended, mend};
mod round;
pub use round::{Outline, Rounded, round};

// Heights.
mod network;
pub use network::{Chain, Edge, Network, Node, WayOf};
mod fit;
mod forest;
mod heaps;
mod smooth;
mod sweep;
pub use sweep::Pin;
mod aground;
pub use aground::DECK_GAP;
mod decks;
mod passing;
pub use decks::{Clearances, Water};
pub use passing::Below;
mod grade;
pub use grade::{GradeOptions, grade, pins};
mod flow;
mod rivers;
pub use rivers::{Bed, FallOptions, Fallen, Still, fall};
mod culverts;
mod dams;
pub use dams::split_at_dams;
mod lakes;
pub use lakes::{Histogram, Lake, Shores, Waters, banks, level, lift_shores, outline_only, shore};
mod afloat;
pub use afloat::{afloat, with_water};
mod roadsides;
pub use roadsides::moved_by_road;
mod toes;
pub use toes::{CUT_RUN, ROADSIDE_REACH_M};
mod watersides;
pub use watersides::{WATERSIDE_REACH_M, Watersides, nearest_on, offs};
mod earthworks;
pub use earthworks::{Earthworks, FarOff, Moved, OFF_M};
mod parts;
pub use parts::{Line, breaklines, channels, dams, flowing, have_line, lakes_along, lines_inside, travelled, water};

// Forms and what they cost.
mod strand;
mod thin;
pub use strand::{Graded, Grant, Grants, Role, Strand};
pub use thin::{Station, Tolerance, thin};
mod pieces;
pub use pieces::{Piece, STRIP_STEPS_MIN, sides};
mod strips;
pub use strips::Face;
mod forms;
mod room;
pub use forms::{Formed, FormedEdge, Surface};
mod inside;
mod middles;
pub use middles::Middle;
mod shares;
pub use shares::{Cost, Limit, Share, Shares, cost};
mod stretches;
pub use stretches::About;
mod choice;
mod choose;
mod outlay;
mod strokes;
mod stubs;
mod tally;
pub use choice::Why;
mod reserve;
mod take_back;
pub use reserve::{Amounts, LeftOut, Reserved, reserve};

// All of it, in its order.
mod area;
pub use area::{AreaFeatures, Levelled, Sounded};

#[cfg(test)]
mod samples;
#[cfg(test)]
mod tests {
    mod bad_ground;
}
