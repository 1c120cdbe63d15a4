//! What the cost of features leaves to each of them: tolerance and form of every edge of a network and every strand.

use crate::{Form, Tolerance};

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
