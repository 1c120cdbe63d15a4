//! What is formed: the heights of a network, and lines with heights that are no travelled way; and what the cost of
//! features leaves to each of them, tolerance and form of every edge of a network and every strand.

use crate::{FeatureId, Form, Network, Place, Tolerance};

/// What a stretch is granted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Way {
    /// A place in [`Tolerance::ALL`].
    pub tolerance: u8,
    /// One of the forms below.
    pub form: u8,
}

/// Forms, each of more triangles than the one before.
impl Way {
    pub const LINE: u8 = 0;
    /// A line, but a strip by which it leads onto a deck.
    pub const ONTO_DECKS: u8 = 1;
    pub const STRIP: u8 = 2;
    pub const BENCH: u8 = 3;
}

/// What the cost of features leaves to one of them.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Grant {
    /// What it is thinned with, in [`Tolerance::ALL`].
    pub tolerance: u8,
    /// The most it may be: a bench, a strip or a line.
    pub most: Form,
    /// Whether it is left out.
    pub out: bool,
}

impl Grant {
    /// As asked for.
    pub const ALL: Self = Self { tolerance: 0, most: Form::Bench, out: false };
    /// Nothing.
    pub const OUT: Self = Self { out: true, ..Self::ALL };

    /// How far it may lie from its stations.
    pub fn tolerance(self) -> Tolerance {
        Tolerance::ALL[usize::from(self.tolerance)]
    }
}

/// What the cost of features leaves to each of them; all of it where nothing is said.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Grants {
    /// By edge of the network.
    pub edges: Vec<Grant>,
    /// By strand.
    pub strands: Vec<Grant>,
}

impl Grants {
    /// What an edge of the network may be.
    pub fn of_edge(&self, edge: u32) -> Grant {
        self.edges.get(edge as usize).copied().unwrap_or(Grant::ALL)
    }

    /// What a strand may be.
    pub fn of_strand(&self, strand: usize) -> Grant {
        self.strands.get(strand).copied().unwrap_or(Grant::ALL)
    }
}

pub use terrain::Role;

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

impl Strand {
    /// Whether it ends where it begins.
    pub fn is_closed(&self) -> bool {
        self.stations.first() == self.stations.last()
    }
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
