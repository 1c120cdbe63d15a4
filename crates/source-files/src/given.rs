//! Points that people give, and what they say of them: GeoJSON, or a table of comma-separated values.
//!
//! Coordinates are told apart as those of polygons are: what the file says, else degrees where numbers can only be
//! degrees, else metres of the area's system.

use std::path::Path;

use geojson::{GeoJson, Geometry, GeometryValue, JsonObject};
use terrain::mask::Polygon;

use crate::SourceError;
use crate::crs::Crs;
use crate::features::clip::Vertex;
use crate::features::raw::Part;
use crate::features::strict::{self, said_in};
use crate::limits::Allowance;
use crate::polygons::projected;
use crate::store::Store;

/// One thing of a file.
#[derive(Clone, Debug, PartialEq)]
pub struct GivenFeature {
    /// Where it stands in the file, for messages: `feature 3`, `line 12`.
    pub place: String,
    /// Where it lies.
    pub shape: GivenShape,
    /// Its `pin` property.
    pub pin: Option<String>,
    /// Its `height_m` property, or a third coordinate.
    pub height_m: Option<f64>,
    /// Its `factor` property.
    pub factor: Option<f64>,
}

/// Where a thing lies, in metres of the area's system.
#[derive(Clone, Debug, PartialEq)]
pub enum GivenShape {
    /// At a place.
    Point([f64; 2]),
    /// Over some ground.
    Polygon(Polygon),
}

/// Reads the points and polygons of the file at `path`, in metres of the system EPSG:`epsg`.
///
/// # Errors
/// When the file is neither GeoJSON nor a table with a header, holds lines or nothing, or its coordinates cannot be
/// brought to the area's system.
pub fn read_given(path: &Path, epsg: u32) -> Result<Vec<GivenFeature>, SourceError> {
    let store = Store::plain(path)?;
    let no_text = || fault(path, "the file", "bytes that are not UTF-8 text", "GeoJSON or comma-separated values");
    let text = &*store.text(no_text)?;
    let is_json = text.trim_start().starts_with('{');
    let (features, said) = if is_json { of_json(path, text)? } else { of_table(path, text)? };
    if features.is_empty() {
        return Err(fault(path, "the file", "nothing", "at least one point"));
    }
    let said = said.or_else(|| features.iter().all(looks_like_degrees).then(Crs::wgs84));
    match said {
        Some(crs) if crs.epsg() != Some(epsg) => brought(&Allowance::new(path, store.len()), features, &crs, epsg),
        _ => Ok(features),
    }
}

fn fault(path: &Path, place: &str, found: impl Into<String>, expected: impl Into<String>) -> SourceError {
    SourceError::Given { path: path.into(), place: place.into(), found: found.into(), expected: expected.into() }
}

fn looks_like_degrees(feature: &GivenFeature) -> bool {
    let is_degrees = |[east, north]: &[f64; 2]| east.abs() <= 360.0 && north.abs() <= 90.0;
    match &feature.shape {
        GivenShape::Point(at) => is_degrees(at),
        GivenShape::Polygon(polygon) => polygon.rings.iter().flatten().all(is_degrees),
    }
}

fn brought(
    allowance: &Allowance,
    features: Vec<GivenFeature>,
    crs: &Crs,
    epsg: u32,
) -> Result<Vec<GivenFeature>, SourceError> {
    let refused = |found: String| SourceError::PolygonCrs { path: allowance.path().into(), found, expected: epsg };
    let area = Crs::from_epsg(epsg).map_err(refused)?;
    let shape = |shape: GivenShape| match shape {
        GivenShape::Point(at) => {
            let placed = crs.to(&area, at).ok_or_else(|| refused(format!("{}, at {at:?}", crs.name())));
            placed.map(GivenShape::Point)
        }
        GivenShape::Polygon(polygon) => {
            let mut all = projected(allowance, vec![polygon], crs, epsg)?;
            Ok(GivenShape::Polygon(all.remove(0)))
        }
    };
    features.into_iter().map(|feature| Ok(GivenFeature { shape: shape(feature.shape)?, ..feature })).collect()
}

fn of_json(path: &Path, text: &str) -> Result<(Vec<GivenFeature>, Option<Crs>), SourceError> {
    let json: GeoJson =
        text.parse().map_err(|error: geojson::Error| fault(path, "the file", error.to_string(), "GeoJSON"))?;
    let said = said_in(path, &json)?;
    let is_alone = matches!(json, GeoJson::Geometry(_));
    let mut found = Vec::new();
    for (index, feature) in strict::features(json).into_iter().enumerate() {
        let place = if is_alone { "the geometry".to_owned() } else { format!("feature {index}") };
        // A feature without a geometry is legal and adds nothing.
        if let Some(geometry) = feature.geometry {
            add(path, &place, geometry, &feature.properties.unwrap_or_default(), &mut found)?;
        }
    }
    Ok((found, said))
}

fn add(
    path: &Path,
    place: &str,
    geometry: Geometry,
    properties: &JsonObject,
    found: &mut Vec<GivenFeature>,
) -> Result<(), SourceError> {
    let (said_m, factor) = (number(path, place, properties, "height_m")?, number(path, place, properties, "factor")?);
    let pin = properties.get("pin").and_then(|pin| pin.as_str()).map(str::to_owned);
    if let GeometryValue::GeometryCollection { .. } = geometry.value {
        return Err(fault(path, place, "a GeometryCollection", "Point or Polygon"));
    }
    let is_finite = |[east, north, _]: &Vertex| east.is_finite() && north.is_finite();
    for part in strict::shape_of(geometry).parts {
        let (shape, height_m) = match part {
            Part::Point(vertex) if is_finite(&vertex) => {
                (GivenShape::Point([vertex[0], vertex[1]]), Some(vertex[2]).filter(|height_m| !height_m.is_nan()))
            }
            Part::Point(_) => return Err(fault(path, place, "no two finite numbers", "a place")),
            Part::Polygon(rings) => {
                let is_ring = |ring: &Vec<Vertex>| {
                    4 <= ring.len() && ring.iter().all(is_finite) && ring[0][..2] == ring[ring.len() - 1][..2]
                };
                if !rings.iter().all(is_ring) {
                    return Err(fault(path, place, "a ring that is not one", "closed rings of 4 corners"));
                }
                let flat = |ring: Vec<Vertex>| ring.into_iter().map(|[east, north, _]| [east, north]).collect();
                (GivenShape::Polygon(Polygon { rings: rings.into_iter().map(flat).collect() }), None)
            }
            Part::Line(_) => {
                return Err(fault(path, place, "a LineString (not supported yet)", "Point or Polygon"));
            }
        };
        let (place, pin, height_m) = (place.to_owned(), pin.clone(), said_m.or(height_m));
        found.push(GivenFeature { place, shape, pin, height_m, factor });
    }
    Ok(())
}

fn number(path: &Path, place: &str, properties: &JsonObject, key: &str) -> Result<Option<f64>, SourceError> {
    match properties.get(key).filter(|value| !value.is_null()) {
        None => Ok(None),
        Some(value) => {
            let number = value.as_f64().filter(|number| number.is_finite());
            number.map(Some).ok_or_else(|| fault(path, place, format!("{key} = {value}"), "a number"))
        }
    }
}

/// Names of columns, first those of the area's metres, then those of degrees.
const EASTS: [&str; 6] = ["east", "easting", "east_m", "x", "lon", "longitude"];
const NORTHS: [&str; 6] = ["north", "northing", "north_m", "y", "lat", "latitude"];
const HEIGHTS: [&str; 5] = ["height_m", "height", "z", "elevation", "elev"];

fn of_table(path: &Path, text: &str) -> Result<(Vec<GivenFeature>, Option<Crs>), SourceError> {
    let mut lines = text.lines().zip(1..).filter(|(line, _)| !line.trim().is_empty());
    let expected = "a header that names its columns, such as east,north,height_m or lon,lat";
    let (header, _) = lines.next().ok_or_else(|| fault(path, "line 1", "nothing", expected))?;
    let names: Vec<String> = header.split(',').map(|name| name.trim().to_lowercase()).collect();
    let column = |known: &[&str]| names.iter().position(|name| known.contains(&name.as_str()));
    let (Some(east), Some(north)) = (column(&EASTS), column(&NORTHS)) else {
        return Err(fault(path, "line 1", format!("{header:?}"), expected));
    };
    let height = column(&HEIGHTS);
    let said = names[east].starts_with("lon").then(Crs::wgs84);
    let mut found = Vec::new();
    for (line, index) in lines {
        let place = format!("line {index}");
        let cells: Vec<&str> = line.split(',').map(str::trim).collect();
        let cell = |column: usize| {
            let text = cells.get(column).copied().unwrap_or("");
            let number = text.parse::<f64>().ok().filter(|number| number.is_finite());
            number.ok_or_else(|| fault(path, &place, format!("{text:?}"), format!("a number for {:?}", names[column])))
        };
        let is_given = |&column: &usize| cells.get(column).is_some_and(|text| !text.is_empty());
        found.push(GivenFeature {
            shape: GivenShape::Point([cell(east)?, cell(north)?]),
            height_m: height.filter(is_given).map(cell).transpose()?,
            pin: None,
            factor: None,
            place: place.clone(),
        });
    }
    Ok((found, said))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(name: &str, text: &str) -> Result<Vec<GivenFeature>, String> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(name);
        std::fs::write(&path, text).unwrap();
        read_given(&path, 32_611).map_err(|error| error.to_string().replace(&path.display().to_string(), "F"))
    }

    #[track_caller]
    fn check_fault(text: &str, expected: &str) {
        assert_eq!(read("given", text).unwrap_err(), expected);
    }

    #[test]
    fn a_table_needs_a_header_and_may_have_heights() {
        let found = read("a.csv", "name, East,North,height\nx,505000,3875000,12.5\n\ny,505025,3875000,\n").unwrap();
        assert_eq!(found[0].shape, GivenShape::Point([505_000.0, 3_875_000.0]));
        assert_eq!((found[0].height_m, found[1].height_m, found[1].place.as_str()), (Some(12.5), None, "line 4"));
        let columns = "a header that names its columns, such as east,north,height_m or lon,lat";
        let marked = read("a.json", "\u{feff}{\"type\":\"Point\",\"coordinates\":[505000,3875000]}").unwrap();
        assert_eq!(marked[0].shape, found[0].shape, "a byte order mark is no part of the text");
        check_fault("a,b\n1,2\n", &format!("F: line 1: found \"a,b\", expected {columns}"));
        check_fault("x,y\n1,\n", "F: line 2: found \"\", expected a number for \"y\"");
        check_fault("x,y\n", "F: the file: found nothing, expected at least one point");
    }

    #[test]
    fn degrees_are_brought_to_the_system_of_the_area() {
        let table = read("a.csv", "lon,lat\n-117,35\n").unwrap();
        let json = read("a.json", r#"{"type":"Point","coordinates":[-117,35]}"#).unwrap();
        let GivenShape::Point([east, north]) = table[0].shape else { panic!("expected a point") };
        assert!((east - 500_000.0).abs() < 0.01 && (north - 3_873_043.0).abs() < 1.0, "{east} {north}");
        assert_eq!(table[0].shape, json[0].shape);
    }

    #[test]
    fn what_a_feature_says_is_read_and_lines_are_refused() {
        let feature = |geometry: &str, said: &str| {
            format!(r#"{{"type":"Feature","geometry":{geometry},"properties":{{{said}}}}}"#)
        };
        let found =
            read("a", &feature(r#"{"type":"Point","coordinates":[505000,3875000,7]}"#, r#""pin":"add""#)).unwrap();
        assert_eq!((found[0].pin.as_deref(), found[0].height_m), (Some("add"), Some(7.0)));
        let ring = "[[505000,3875000],[505100,3875000],[505100,3875100],[505000,3875000]]";
        let polygon = format!(r#"{{"type":"Polygon","coordinates":[{ring}]}}"#);
        let found = read("a", &feature(&polygon, r#""pin":"importance","factor":4"#)).unwrap();
        assert_eq!(found[0].factor, Some(4.0));
        check_fault(
            &feature(r#"{"type":"LineString","coordinates":[[1,2],[3,4]]}"#, ""),
            "F: feature 0: found a LineString (not supported yet), expected Point or Polygon",
        );
        check_fault(&feature(&polygon, r#""factor":"x""#), "F: feature 0: found factor = \"x\", expected a number");
    }
}
