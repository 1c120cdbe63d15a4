//! What a GeoParquet file says of its geometries: the text `geo` among its metadata.

use geojson::JsonValue;

use crate::crs::Crs;

/// The column of geometries and their system.
#[derive(Clone, Debug)]
pub(crate) struct Geo {
    /// The column's name.
    pub column: String,
    /// The system of its coordinates: none where the file says that it is not known; or what is wrong with it.
    pub crs: Result<Option<Crs>, String>,
    /// Whether all places can be degrees, where the file says between which its features lie.
    pub looks_like_degrees: bool,
    /// Paths of the columns of the least and the greatest easting and northing, where the file has such.
    pub boxes: Option<[[Vec<String>; 2]; 2]>,
}

impl Geo {
    /// From the text.
    ///
    /// # Errors
    /// What it is, and what it should be.
    pub fn read(text: &str) -> Result<Self, (String, &'static str)> {
        let broken = || ("no description of geometries".to_owned(), "what GeoParquet says of it");
        let all: JsonValue = text.parse().map_err(|_| broken())?;
        let name = all.get("primary_column").and_then(JsonValue::as_str).ok_or_else(broken)?;
        let column = all.get("columns").and_then(|columns| columns.get(name)).ok_or_else(broken)?;
        match column.get("encoding").and_then(JsonValue::as_str) {
            Some("WKB") => {}
            other => return Err((format!("geometries encoded as {}", other.unwrap_or("nothing")), "WKB")),
        }
        let boxes = column.get("covering").and_then(|covering| covering.get("bbox")).and_then(|boxes| {
            let path = |name: &str| {
                let parts = boxes.get(name)?.as_array()?.iter();
                parts.map(|part| part.as_str().map(str::to_owned)).collect::<Option<Vec<_>>>()
            };
            Some([[path("xmin")?, path("xmax")?], [path("ymin")?, path("ymax")?]])
        });
        let extent: Vec<f64> = column
            .get("bbox")
            .and_then(JsonValue::as_array)
            .into_iter()
            .flatten()
            .filter_map(JsonValue::as_f64)
            .collect();
        let looks_like_degrees = match extent.as_slice() {
            [west, south, east, north] | [west, south, _, east, north, _] => {
                west.abs().max(east.abs()) <= 360.0 && south.abs().max(north.abs()) <= 90.0
            }
            _ => false,
        };
        let crs = match column.get("crs") {
            None => Ok(Some(Crs::wgs84())),
            Some(JsonValue::Null) => Ok(None),
            Some(JsonValue::String(text)) => Crs::named(text).map(Some),
            Some(json) => of_projjson(json).map(Some),
        };
        Ok(Self { column: name.to_owned(), crs, looks_like_degrees, boxes })
    }
}

/// The system that PROJJSON describes, by its code: that of the whole, or of its part on the ground.
fn of_projjson(json: &JsonValue) -> Result<Crs, String> {
    let code = |json: &JsonValue| {
        let id = json.get("id")?;
        let code = id.get("code")?;
        let code = code.as_str().map_or_else(|| code.to_string(), str::to_owned);
        Some((id.get("authority")?.as_str()?.to_ascii_uppercase(), code))
    };
    let ground = json.get("components").and_then(|parts| parts.get(0)).or_else(|| json.get("source_crs"));
    let (authority, code) = code(json).or_else(|| code(ground?)).ok_or_else(|| {
        let name = json.get("name").and_then(JsonValue::as_str).unwrap_or("without a name");
        format!("{name}, without a code")
    })?;
    match (authority.as_str(), code.as_str()) {
        ("OGC", "CRS84" | "CRS84h") => Ok(Crs::wgs84()),
        ("EPSG", number) => {
            let found = number.parse().map_err(|_| "no number".to_owned()).and_then(Crs::from_epsg);
            found.map_err(|found| format!("EPSG:{number}: {found}"))
        }
        _ => Err(format!("{authority}:{code}")),
    }
}
