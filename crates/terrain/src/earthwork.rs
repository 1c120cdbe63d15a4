//! What features do to the ground: what an edge is to its feature, what is cut and filled, and why something lies off.

use serde::{Deserialize, Serialize};

/// What an edge of the TIN is to its feature.
///
/// Where two have a place in common, what is travelled keeps its height, by class; then the order decides, so that a
/// shore stays level where a river meets it, and a toe, which only follows the ground, comes last.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub enum Role {
    /// Part of the outline of a strip or a junction.
    Side,
    /// A centreline.
    Centre,
    /// The outline of level water.
    Shore,
    /// The middle of a river or stream.
    Channel,
    /// The outline of a river.
    Bank,
    /// A line that a job names.
    Breakline,
    /// Where the slope of a bench meets the ground.
    Toe,
}

impl Role {
    /// The word for it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Side => "side",
            Self::Centre => "centreline",
            Self::Shore => "shore",
            Self::Channel => "channel",
            Self::Bank => "bank",
            Self::Breakline => "breakline",
            Self::Toe => "toe",
        }
    }

    /// Whether it is the outline of water.
    pub fn is_outline(self) -> bool {
        matches!(self, Self::Shore | Self::Bank)
    }
}

/// Why a feature lies off the ground.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub enum OffCause {
    /// Its greatest grade.
    Grade,
    /// It falls downstream.
    Falling,
    /// It lies level: in a lake, in a circle, or as the lake that a road meets.
    Level,
    /// A height that is pinned.
    Pin,
}

impl OffCause {
    /// The word for it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Grade => "grade",
            Self::Falling => "falling",
            Self::Level => "level",
            Self::Pin => "pin",
        }
    }
}

/// What features of a class move, inside the area.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Earthwork {
    /// Metres of ways on the ground, or of the shores of lakes.
    pub length_m: f64,
    /// Metres of them that lie more than 3, 5, 10 and 20 m off the ground.
    pub off_m: [f64; 4],
    /// Metres of these that lie farther off than the limits of cut and fill, and than twice these.
    pub over_limit_m: [f64; 2],
    /// Cubic metres cut and filled.
    pub moved_m3: [f64; 2],
    /// Metres of ways over holes, whose ground is not known: they count as on the ground above.
    pub over_holes_m: f64,
}
