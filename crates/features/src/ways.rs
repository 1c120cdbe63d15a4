//! Lines and polygons of features on the lattice.

use crate::{FeatureId, Place, Traits};

/// A line of a feature on the lattice.
#[derive(Clone, Debug, PartialEq)]
pub struct Way {
    /// What it is.
    pub traits: Traits,
    /// Its places, at least two, no two neighbours equal.
    pub places: Vec<Place>,
    /// Heights its source gives to some of its places, in quanta, sorted.
    pub heights: Vec<(Place, i32)>,
    /// Which feature it comes from.
    pub id: FeatureId,
}

/// A polygon of a feature on the lattice, before it is split into simple rings.
#[derive(Clone, Debug, PartialEq)]
pub struct Area {
    /// What it is.
    pub traits: Traits,
    /// Closed walks, their first place not repeated, and whether they are meant as holes.
    pub walks: Vec<(Vec<Place>, bool)>,
    /// Which feature it comes from.
    pub id: FeatureId,
}
