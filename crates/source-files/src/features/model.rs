//! What is wanted of a file of features, and what is read.

use std::fmt;
use std::sync::Arc;

use super::clip::Extent;
use crate::SourceError;
use crate::crs::Crs;
use crate::store::Store;

/// Keys of OpenStreetMap that the built-in table of kinds looks at.
pub const BUILT_IN_KEYS: [&str; 8] =
    ["highway", "railway", "aeroway", "waterway", "natural", "landuse", "water", "man_made"];

/// The key that makes a closed line of a file a building.
pub(super) const BUILDING_KEY: &str = "building";

/// What is wanted of a file of features.
#[derive(Clone, Copy, Debug)]
pub struct Wanted<'a> {
    /// The area's coordinate system, by its EPSG code.
    pub epsg: u32,
    /// Where features count, in metres of that system: the area and one load module on each side. Features are cut
    /// at its sides: a vertex exactly on a side is a cut.
    pub bounds: Extent,
    /// The layer of a GeoPackage, which may be left out where there is only one.
    pub layer: Option<&'a str>,
    /// The system of its coordinates, whatever the file says; OpenStreetMap data needs none.
    pub crs: Option<&'a Crs>,
    /// Keys of OpenStreetMap that make a way or a multipolygon relation wanted, mostly [`BUILT_IN_KEYS`] and those of
    /// the job's own rules. Other formats are read whole.
    pub keys: &'a [&'a str],
    /// Whether buildings are read, too, apart from the features.
    pub buildings: bool,
    /// Whether points are features, too; else they are left out and told.
    pub points: bool,
}

impl Wanted<'_> {
    /// The system of a file's coordinates: as the caller says, else as the file does.
    pub(super) fn system(
        &self,
        of_file: impl FnOnce() -> Result<Option<Crs>, SourceError>,
    ) -> Result<Option<Crs>, SourceError> {
        self.crs.map_or_else(of_file, |crs| Ok(Some(crs.clone())))
    }
}

/// Attributes, sorted by key. Texts that are the same are kept once.
pub type Tags = Vec<(Arc<str>, Arc<str>)>;

/// A line or polygon of a file, or a point where points are wanted.
#[derive(Clone, Debug, PartialEq)]
pub struct VectorFeature {
    /// Its name for people: `way/123`, `relation/5`, `roads.geojson#17`, `hydro.gpkg:rivers#3`. Where a feature has
    /// several parts, or was cut into several, each has its number behind a point: `way/123.2`.
    pub id: String,
    /// What the file says of it.
    pub tags: Tags,
    /// Where it lies.
    pub shape: VectorShape,
}

impl VectorFeature {
    /// The value of a key.
    pub fn tag(&self, key: &str) -> Option<&str> {
        let found = self.tags.binary_search_by(|(other, _)| other.as_ref().cmp(key));
        found.ok().map(|index| self.tags[index].1.as_ref())
    }
}

/// Where a feature lies.
#[derive(Clone, Debug, PartialEq)]
pub enum VectorShape {
    /// Easting and northing in metres of the area's system.
    Point([f64; 2]),
    /// At least two vertices, as digitised.
    Line(Vertices),
    /// The outer ring, then the holes. Rings are closed: the last vertex is the first.
    Polygon(Vec<Vertices>),
}

/// Vertices of a line or ring.
#[derive(Clone, Debug, PartialEq)]
pub struct Vertices {
    /// Easting and northing in metres of the area's system.
    pub places: Vec<[f64; 2]>,
    /// A height in metres for each place, where it has one; empty where the feature has no heights at all.
    pub heights_m: Vec<Option<f64>>,
}

/// Something about a feature that could not be used as it is.
#[derive(Clone, Debug, PartialEq)]
pub struct Remark {
    /// The feature's id.
    pub id: String,
    /// Where, in metres of the area's system, if that can be said.
    pub at: Option<[f64; 2]>,
    /// What was wrong.
    pub found: String,
    /// What was done.
    pub done: Done,
}

/// What was done about something that could not be used as it is, in words.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Done {
    /// The feature, or a part of it, is missing.
    LeftOut(&'static str),
    /// All of it is there.
    Kept(&'static str),
}

impl Done {
    /// The words.
    pub fn text(self) -> &'static str {
        match self {
            Done::LeftOut(text) | Done::Kept(text) => text,
        }
    }
}

impl fmt::Display for Done {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.text())
    }
}

/// The features of a file.
#[derive(Clone, Debug, Default)]
pub struct FeatureFile {
    /// Those inside the bounds: of OpenStreetMap data relations, then ways, by number; of others in file order.
    pub features: Vec<VectorFeature>,
    /// Buildings inside the bounds, by their key `building`, where they were wanted; of OpenStreetMap data they are no
    /// features and have no tags but those of their heights.
    pub buildings: Vec<VectorFeature>,
    /// What was left out or not used as it is, at most [`crate::limits::REMARKS_MAX`]; `notes` counts the rest.
    pub remarks: Vec<Remark>,
    /// What a person should know about the file as a whole.
    pub notes: Vec<String>,
    /// Lines and polygons in the file, inside the bounds or not, and of OpenStreetMap data with a wanted key.
    pub found: u64,
    /// Of these, those that lie outside the bounds.
    pub outside: u64,
    /// Whom to name beside anything drawn from it.
    pub attribution: Option<&'static str>,
}

/// The name of a file, with which the ids of its features begin.
pub(super) fn file_name(store: &Store) -> String {
    store.path().file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default()
}
