//! Where a raster lies: its coordinate system, the place of its posts, and what its samples mean in metres.
//!
//! A post is the centre of its pixel, whichever of the two registrations the file uses.

use std::path::{Path, PathBuf};

use crate::SourceError;

/// Where the posts of a raster lie. Row 0 is the southern one, column 0 the western one.
#[derive(Clone, Debug, PartialEq)]
pub struct RasterFrame {
    /// The file, for messages.
    pub path: PathBuf,
    /// EPSG code of its projected coordinate system.
    pub epsg: u32,
    /// Easting and northing of the south-west post, in metres.
    pub south_west_m: [f64; 2],
    /// Metres between posts, to the east and to the north.
    pub spacing_m: [f64; 2],
    /// Columns of posts.
    pub cols: u32,
    /// Rows of posts.
    pub rows: u32,
}

impl RasterFrame {
    /// Checks that the raster is in the coordinate system with the EPSG code `expected`.
    ///
    /// # Errors
    /// [`SourceError::OtherCrs`] when it is in another.
    pub fn require_epsg(&self, expected: u32) -> Result<(), SourceError> {
        if self.epsg == expected {
            return Ok(());
        }
        Err(SourceError::OtherCrs { path: self.path.clone(), found: self.epsg, expected })
    }

    /// Easting and northing of the post at (row, column), in metres.
    pub fn place_m(&self, row: u32, col: u32) -> [f64; 2] {
        let [east_m, north_m] = self.south_west_m;
        [east_m + f64::from(col) * self.spacing_m[0], north_m + f64::from(row) * self.spacing_m[1]]
    }
}

/// What a sample means: height in metres = (sample * scale + offset) * unit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SampleScale {
    /// Units of height in one step of a sample.
    pub scale: f64,
    /// Height of sample 0, in units of height.
    pub offset: f64,
    /// Metres in a unit of height.
    pub unit_m: f64,
}

impl SampleScale {
    /// The height of a sample in metres.
    pub fn height_m(&self, sample: f64) -> f64 {
        (sample * self.scale + self.offset) * self.unit_m
    }
}

/// The tags that say where a raster lies, as read.
#[derive(Clone, Debug, Default)]
pub(crate) struct GeoTags {
    pub pixel_scale: Option<Vec<f64>>,
    pub tie_points: Option<Vec<f64>>,
    pub transformation: Option<Vec<f64>>,
    pub keys: Option<Vec<u16>>,
    pub gdal_metadata: Option<String>,
}

/// Eastings and northings along the raster as it is stored: place = first post + index * step.
pub(crate) struct Axes {
    pub first_m: [f64; 2],
    pub step_m: [f64; 2],
}

mod key {
    pub const MODEL_TYPE: u16 = 1024;
    pub const RASTER_TYPE: u16 = 1025;
    pub const GEOGRAPHIC_TYPE: u16 = 2048;
    pub const PROJECTED_TYPE: u16 = 3072;
    pub const LINEAR_UNITS: u16 = 3076;
    pub const VERTICAL_UNITS: u16 = 4099;
}
/// Code of a GeoKey whose meaning the file spells out by itself.
const USER_DEFINED: u16 = 32767;
/// Coordinates beyond this (a hundred times around the Earth) are not places.
const PLACE_M_MAX: f64 = 4.0e9;
/// A shear this small against the spacing moves no post of the largest raster by a hundredth of a post.
const SHEAR_MAX: f64 = 1.0e-8;

impl GeoTags {
    /// The EPSG code of the projected coordinate system.
    pub(crate) fn epsg(&self, path: &Path) -> Result<u32, SourceError> {
        let path = || path.into();
        let (model, projected) = (self.key(key::MODEL_TYPE), self.key(key::PROJECTED_TYPE));
        match (model, projected) {
            (None, None) if self.key(key::GEOGRAPHIC_TYPE).is_none() => {
                return Err(SourceError::NoCrs { path: path() });
            }
            (Some(2), _) | (None, None) => {
                let found = match self.key(key::GEOGRAPHIC_TYPE) {
                    None | Some(0 | USER_DEFINED) => "without a code".into(),
                    Some(code) => format!("EPSG:{code}"),
                };
                return Err(SourceError::Geographic { path: path(), found });
            }
            (Some(3), _) => return Err(SourceError::UnnamedCrs { path: path(), found: "geocentric".into() }),
            _ => {}
        }
        if let Some(found) = self.foreign_linear_unit() {
            return Err(SourceError::LinearUnit { path: path(), found });
        }
        match projected {
            None | Some(0) => Err(SourceError::UnnamedCrs { path: path(), found: "not named".into() }),
            Some(USER_DEFINED) => Err(SourceError::UnnamedCrs { path: path(), found: "defined by the file".into() }),
            Some(code) => Ok(code.into()),
        }
    }

    /// The value of a GeoKey that is held in the key directory itself.
    fn key(&self, key: u16) -> Option<u16> {
        let keys = self.keys.as_ref()?;
        keys.chunks_exact(4).skip(1).find(|entry| entry[0] == key && entry[1] == 0).map(|entry| entry[3])
    }

    fn foreign_linear_unit(&self) -> Option<String> {
        match self.key(key::LINEAR_UNITS) {
            None | Some(0 | 9001) => None,
            Some(9002) => Some("feet".into()),
            Some(9003) => Some("US survey feet".into()),
            Some(USER_DEFINED) => Some("a unit of the file's own".into()),
            Some(code) => Some(format!("units of code {code}")),
        }
    }

    /// Whether a pixel's coordinates are those of its centre.
    fn pixel_is_point(&self) -> bool {
        self.key(key::RASTER_TYPE) == Some(2)
    }

    /// What samples mean; `height_unit_m` overrides the unit the file states.
    pub(crate) fn sample_scale(&self, path: &Path, height_unit_m: Option<f64>) -> Result<SampleScale, SourceError> {
        let number = |role: &str, default: f64| match self.metadata_item(role) {
            None => Ok(default),
            Some(text) => text
                .trim()
                .parse()
                .ok()
                .filter(|value: &f64| value.is_finite())
                .ok_or_else(|| malformed(path, &format!("the {role} of the samples"), text.into(), "a number")),
        };
        let unit_m = match height_unit_m {
            Some(unit_m) => unit_m,
            None => self.vertical_unit_m(path)?,
        };
        Ok(SampleScale { scale: number("scale", 1.0)?, offset: number("offset", 0.0)?, unit_m })
    }

    fn vertical_unit_m(&self, path: &Path) -> Result<f64, SourceError> {
        const FOOT_M: f64 = 0.3048;
        const US_FOOT_M: f64 = 1200.0 / 3937.0;
        let unit = match (self.key(key::VERTICAL_UNITS), self.metadata_item("unittype")) {
            (None | Some(0), None) | (Some(9001), _) => Ok(1.0),
            (Some(9002), _) => Ok(FOOT_M),
            (Some(9003), _) => Ok(US_FOOT_M),
            (None | Some(0), Some("" | "m" | "metre" | "meter" | "metres" | "meters")) => Ok(1.0),
            (None | Some(0), Some("ft" | "foot" | "feet")) => Ok(FOOT_M),
            (None | Some(0), Some("US survey foot" | "us-ft" | "ftUS")) => Ok(US_FOOT_M),
            (None | Some(0), Some(other)) => Err(format!("`{other}`")),
            (Some(code), _) => Err(format!("units of code {code}")),
        };
        unit.map_err(|found| SourceError::VerticalUnit { path: path.into(), found })
    }

    /// The text of the first item of GDAL's metadata with this role for band 0.
    fn metadata_item(&self, role: &str) -> Option<&str> {
        let wanted = format!("role=\"{role}\"");
        let items = self.gdal_metadata.as_deref()?.split("<Item ").skip(1);
        items.filter_map(|item| item.split_once('>')).find_map(|(attributes, rest)| {
            let ours = attributes.contains(&wanted) && attributes.contains("sample=\"0\"");
            ours.then(|| rest.split('<').next().unwrap_or_default())
        })
    }

    /// Places of the posts as stored.
    pub(crate) fn axes(&self, path: &Path) -> Result<Axes, SourceError> {
        let [origin_m, step_m] = match (&self.pixel_scale, &self.tie_points, &self.transformation) {
            (Some(scale), Some(tie), _) => tied(path, scale, tie)?,
            (_, _, Some(matrix)) => transformed(path, matrix)?,
            (None, Some(tie), None) => {
                return Err(SourceError::ControlPoints { path: path.into(), found: tie.len() / 6 });
            }
            _ => return Err(SourceError::NoPosition { path: path.into() }),
        };
        let numbers = origin_m.iter().chain(&step_m);
        let sane = numbers.clone().all(|number| number.abs() <= PLACE_M_MAX) && 0.0 < step_m[0] && step_m[1] != 0.0;
        if !sane {
            let found = format!("at {origin_m:?} with steps of {step_m:?}");
            return Err(malformed(path, "the place of the raster", found, "finite metres, and a positive pixel scale"));
        }
        let centre = if self.pixel_is_point() { 0.0 } else { 0.5 };
        Ok(Axes { first_m: [origin_m[0] + centre * step_m[0], origin_m[1] + centre * step_m[1]], step_m })
    }
}

/// Origin and step of the pixels' corners, from a pixel scale and a tie point.
fn tied(path: &Path, scale: &[f64], tie: &[f64]) -> Result<[[f64; 2]; 2], SourceError> {
    let (&[width_m, height_m, ..], &[col, row, _, east_m, north_m, _]) = (scale, tie) else {
        if 6 < tie.len() {
            return Err(SourceError::ControlPoints { path: path.into(), found: tie.len() / 6 });
        }
        let found = format!("{} and {} numbers", scale.len(), tie.len());
        return Err(malformed(path, "the pixel scale and tie point", found, "3 and 6 numbers"));
    };
    if !(0.0 < width_m && 0.0 < height_m) {
        let found = format!("{width_m} x {height_m}");
        return Err(malformed(path, "the pixel scale", found, "two positive numbers"));
    }
    Ok([[east_m - col * width_m, north_m + row * height_m], [width_m, -height_m]])
}

/// Origin and step of the pixels' corners, from a 4 x 4 matrix.
fn transformed(path: &Path, matrix: &[f64]) -> Result<[[f64; 2]; 2], SourceError> {
    let &[a, b, _, d, e, f, _, h, ..] = matrix else {
        let found = format!("{} numbers", matrix.len());
        return Err(malformed(path, "the model transformation", found, "16 numbers"));
    };
    if a.abs() * SHEAR_MAX < b.abs() || f.abs() * SHEAR_MAX < e.abs() || a < 0.0 {
        return Err(SourceError::Rotated { path: path.into(), found: format!("{a} {b} {e} {f}") });
    }
    Ok([[d, h], [a, f]])
}

fn malformed(path: &Path, what: &str, found: String, expected: &str) -> SourceError {
    SourceError::Malformed { path: path.into(), what: what.into(), found, expected: expected.into() }
}
