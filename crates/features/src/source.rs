//! What others hand in: features with ids, tags and positions in posts; nothing about them is trusted.

use std::fmt;

/// What numbers a feature in its source.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Numbering {
    /// A way of OpenStreetMap.
    Way,
    /// A relation of OpenStreetMap.
    Relation,
    /// A row, record or feature of any other format.
    Row,
}

/// One feature of one source. It names a feature in remarks and decides nothing but between equal features.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct FeatureId {
    /// Which of the job's sources.
    pub source: u32,
    /// What the number counts.
    pub numbering: Numbering,
    /// The number.
    pub number: i64,
}

impl fmt::Display for FeatureId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let word = match self.numbering {
            Numbering::Way => "way",
            Numbering::Relation => "relation",
            Numbering::Row => "feature",
        };
        write!(f, "{word} {}", self.number)
    }
}

/// A position as read: posts east and north of the area's south-west post, and a height if there is one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Position {
    /// Posts east.
    pub east: f64,
    /// Posts north.
    pub north: f64,
    /// Metres, as the source has it.
    pub height_m: Option<f64>,
}

impl Position {
    /// A position without a height.
    pub const fn new(east: f64, north: f64) -> Self {
        Self { east, north, height_m: None }
    }
}

/// The shape of a feature as read.
#[derive(Clone, Debug, PartialEq)]
pub enum Shape {
    /// A line. A closed one is a polygon where its kind is one.
    Line(Vec<Position>),
    /// Rings, the outer one first; the last position may repeat the first.
    Polygon(Vec<Vec<Position>>),
}

impl Shape {
    /// The first position, where a remark about all of it is placed.
    pub fn first(&self) -> Option<Position> {
        match self {
            Shape::Line(positions) => positions.first().copied(),
            Shape::Polygon(rings) => rings.iter().flatten().next().copied(),
        }
    }
}

/// A feature as read from a source.
#[derive(Clone, Debug, PartialEq)]
pub struct Source {
    /// Which one it is.
    pub id: FeatureId,
    /// Tags or attribute columns, in any order.
    pub tags: Vec<(String, String)>,
    /// What the job says of the whole source, e.g. `kind = "lake"` for a shapefile without tags.
    pub kind: Option<crate::Kind>,
    /// Its shape.
    pub shape: Shape,
}

impl Source {
    /// The value of a tag.
    pub fn tag(&self, key: &str) -> Option<&str> {
        self.tags.iter().find(|(name, _)| name == key).map(|(_, value)| value.as_str())
    }
}
