//! What is formed: the heights of a network, and lines with heights that are no travelled way.

use crate::{FeatureId, Grants, Network, Place};

/// What an edge of the TIN is to its feature.
///
/// Where two have a place in common, what is travelled keeps its height, by class; then the order decides, so that a
/// shore stays level where a river meets it, and a toe, which only follows the ground, comes last.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
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
    /// A line a job names.
    Breakline,
    /// Where the slope of a bench meets the ground.
    Toe,
}

impl Role {
    /// Whether it is the outline of water.
    pub fn is_outline(self) -> bool {
        matches!(self, Role::Shore | Role::Bank)
    }
}

/// A line with heights that is no travelled way: a channel, a shore, a breakline.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Strand {
    /// What it is.
    pub role: Role,
    /// Its class.
    pub class: u16,
    /// Which feature it comes from.
    pub id: FeatureId,
    /// Its places with their heights in quanta, in order, those of a channel downstream; a closed one repeats its
    /// first.
    pub stations: Vec<(Place, i32)>,
}

/// The heights of a network, and what they are formed by.
#[derive(Clone, Copy)]
pub struct Graded<'a> {
    /// The network.
    pub network: &'a Network,
    /// A height for every node, in quanta.
    pub heights: &'a [i32],
    /// The ground at both of the [`crate::sides`] of each node, in quanta.
    pub beside: &'a [[i32; 2]],
    /// What the cost of features leaves to each of them.
    pub grants: &'a Grants,
}
