//! What is formed: the heights of a network, and lines with heights that are no travelled way.

pub use terrain::Role;

use crate::{FeatureId, Grants, Network, Place};

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
