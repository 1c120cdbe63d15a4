//! A feature as it stands in its file, before it is brought to the area's system.

use super::clip::Vertex;
use super::model::Tags;
use crate::longitudes;

/// A feature in its file's coordinates.
#[derive(Debug)]
pub(super) struct RawFeature {
    pub id: String,
    pub tags: Tags,
    pub shape: RawShape,
}

/// Where a feature lies, in its file's coordinates.
#[derive(Debug, Default)]
pub(crate) struct RawShape {
    /// Whether the file gives heights. Those that it does not give are NaN.
    pub has_heights: bool,
    pub parts: Vec<Part>,
    /// Something in it that is neither a point, a line nor a polygon.
    pub other: Option<&'static str>,
}

/// A point, a line, or a polygon: its outer ring, then its holes.
#[derive(Clone, Debug)]
pub(crate) enum Part {
    Point(Vertex),
    Line(Vec<Vertex>),
    Polygon(Vec<Vec<Vertex>>),
}

impl Part {
    /// Its vertices, ring by ring.
    pub(super) fn runs(&self) -> impl Iterator<Item = &[Vertex]> + Clone {
        let (single, rings) = match self {
            Part::Point(vertex) => (Some(std::slice::from_ref(vertex)), &[][..]),
            Part::Line(line) => (Some(line.as_slice()), &[][..]),
            Part::Polygon(rings) => (None, rings.as_slice()),
        };
        single.into_iter().chain(rings.iter().map(Vec::as_slice))
    }

    /// Brings what crosses the 180th meridian, in degrees, to one run of longitudes.
    pub(super) fn unwrap(&mut self) {
        match self {
            Part::Point(_) => {}
            Part::Line(line) => longitudes::unwrap(line),
            Part::Polygon(rings) => longitudes::unwrap_polygon(rings),
        }
    }

    /// Moves it east by so much.
    pub(super) fn turn(&mut self, by: f64) {
        match self {
            Part::Point(vertex) => vertex[0] += by,
            Part::Line(line) => line.iter_mut().for_each(|vertex| vertex[0] += by),
            Part::Polygon(rings) => rings.iter_mut().flatten().for_each(|vertex| vertex[0] += by),
        }
    }
}

impl RawShape {
    pub(super) fn vertices(&self) -> impl Iterator<Item = &Vertex> {
        self.parts.iter().flat_map(Part::runs).flatten()
    }
}
