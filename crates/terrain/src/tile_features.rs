//! All that features put into one tile: edges of its TIN, ground of their own class, slopes beside it, decks above it.

use serde::{Deserialize, Serialize};

use crate::numbered::numbered;
use crate::{Features, LineTraits, TileId, Vertex};

/// What features put into a tile. Places are in steps of the feature lattice from the area's south-west post, as in
/// [`Features::steps_per_post`]; heights are in quanta.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct TileFeatures {
    /// The tile.
    pub tile: TileId,
    /// Vertices and edges that its TIN keeps.
    pub kept: Features,
    /// Ground that has the class of a feature, of all that touches the tile.
    pub surfaces: Vec<FeatureSurface>,
    /// Ground that features shape without being in the TIN, of all that touches the tile: where they had no room.
    pub shaped: Vec<FeatureSurface>,
    /// Edges of roads within reach of the tile, beside which the ground slopes to the natural one.
    pub slopes: Vec<SideSlope>,
    /// Pieces of water within reach of the tile, beside which the ground slopes to it.
    pub watersides: Vec<SideSlope>,
    /// Bridges: polygons above the ground, of all that touch the tile. Their rings are simple.
    pub decks: Vec<FeatureSurface>,
    /// Middle lines of all ways that touch the tile, in the ground or not; they change nothing in it.
    pub lines: Vec<WayLine>,
}

/// A piece of an edge of a road, or of a channel, shore or bank, from which the ground slopes to the natural one.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct SideSlope {
    /// Its ends, at the heights of the road or the water.
    pub ends: [Vertex; 2],
    /// Heights of the natural ground there, in quanta.
    pub ground: [i32; 2],
}

/// The middle line of a way, or of a part of it in which nothing changes. It has a vertex wherever it crosses a line
/// between load modules.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct WayLine {
    /// Class of its way.
    pub class: u8,
    /// What else is known of it.
    pub traits: LineTraits,
    /// Two or more.
    pub vertices: Vec<Vertex>,
}

/// A ring of a feature with what lies inside.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct FeatureSurface {
    /// Class of the triangles inside. Where rings overlap, the first in order has the ground.
    pub class: u8,
    /// What kind of ground it is.
    pub ground: SurfaceGround,
    /// Rings of one body inside one another are its holes.
    pub body: u32,
    /// Its vertices, the first not repeated.
    pub ring: Vec<Vertex>,
}

/// What lies inside a ring of a feature.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum SurfaceGround {
    /// Part of a road, at the heights of its ring.
    Road,
    /// The same of a piece of a strip that nothing cuts: its ring has the two corners of its end, then those of its
    /// beginning.
    Strip,
    /// Level water: every vertex of the ring has one height, and no shore lies below it.
    Lake,
    /// Water between banks, which falls along them.
    River,
}

numbered!(SurfaceGround);

impl SurfaceGround {
    /// All of them, by their numbers in files.
    pub const ALL: [Self; 4] = [Self::Road, Self::Lake, Self::River, Self::Strip];

    /// Whether it is part of a road.
    pub fn is_road(self) -> bool {
        matches!(self, Self::Road | Self::Strip)
    }
}

impl FeatureSurface {
    /// The level of a lake; nothing else has one.
    pub fn level(&self) -> Option<i32> {
        self.ring.first().filter(|_| self.ground == SurfaceGround::Lake).map(|vertex| vertex.height)
    }

    fn is_of_one_body(&self, other: &Self) -> bool {
        (self.class, self.ground, self.body) == (other.class, other.ground, other.body)
    }
}

impl TileFeatures {
    /// Those of a tile without any.
    pub fn none(tile: TileId) -> Self {
        Self {
            tile,
            kept: Features::default(),
            surfaces: Vec::new(),
            shaped: Vec::new(),
            slopes: Vec::new(),
            watersides: Vec::new(),
            decks: Vec::new(),
            lines: Vec::new(),
        }
    }

    /// Parts of roads, lakes and rivers, each with its rings; where two overlap, the first has the ground.
    pub fn bodies(&self) -> impl Iterator<Item = &[FeatureSurface]> {
        self.surfaces.chunk_by(FeatureSurface::is_of_one_body)
    }

    /// The same of ground that features shape without being in the TIN.
    pub fn shaped_bodies(&self) -> impl Iterator<Item = &[FeatureSurface]> {
        self.shaped.chunk_by(FeatureSurface::is_of_one_body)
    }
}
