//! Where a raster lies: its coordinate system, the place of its posts, and what its samples mean in metres.
//!
//! A post is the centre of its pixel, whichever of the two registrations the file uses.

use std::path::{Path, PathBuf};

use terrain::{GridFrame, PostRect};

use crate::SourceError;
use crate::crs::datums::{datum_of_code, datum_of_system};
use crate::crs::vertical::{FOOT_M, US_FOOT_M, unit_m};
use crate::crs::{Crs, GeoKeys};

/// Where the posts of a raster lie. Row 0 is the southern one, column 0 the western one.
#[derive(Clone, Debug, PartialEq)]
pub struct RasterFrame {
    /// The file, for messages.
    pub path: PathBuf,
    /// Its coordinate system.
    pub crs: Crs,
    /// Place of the south-west post, east then north, in units of the coordinate system: metres mostly, or degrees.
    pub south_west: [f64; 2],
    /// Units of the coordinate system between posts, to the east and to the north.
    pub spacing: [f64; 2],
    /// Columns of posts.
    pub cols: u32,
    /// Rows of posts.
    pub rows: u32,
}

impl RasterFrame {
    /// All its posts.
    pub(crate) fn rect(&self) -> PostRect {
        PostRect::of_size(self.rows as usize, self.cols as usize)
    }

    /// The frame of a raster stored with these axes, and whether its first row is the southern one.
    pub(crate) fn new(path: &Path, crs: Crs, axes: &Axes, cols: u32, rows: u32) -> Result<(Self, bool), SourceError> {
        let south_first = 0.0 < axes.step[1];
        let last_north = axes.first[1] + axes.step[1] * f64::from(rows - 1);
        let south = if south_first { axes.first[1] } else { last_north };
        let spacing = [axes.step[0], axes.step[1].abs()];
        let frame = Self { path: path.into(), crs, south_west: [axes.first[0], south], spacing, cols, rows };
        let [east, north] = frame.place(rows - 1, cols - 1);
        if frame.crs.is_geographic() && (540.0 < east.abs() || 90.6 < north || south < -90.6) {
            let found = format!("from {}, {south} to {east}, {north} degrees", axes.first[0]);
            return Err(malformed(path, "the place of the raster", found, "degrees of longitude and latitude"));
        }
        Ok((frame, south_first))
    }

    /// Checks that the raster is in the coordinate system with the EPSG code `expected`.
    ///
    /// # Errors
    /// [`SourceError::OtherCrs`] when it is in another.
    pub fn require_epsg(&self, expected: u32) -> Result<(), SourceError> {
        if self.crs.epsg() == Some(expected) {
            return Ok(());
        }
        let found = self.crs.name().to_owned();
        Err(SourceError::OtherCrs { path: self.path.clone(), found, expected })
    }

    /// Checks that the raster's own grid is one of metres.
    ///
    /// # Errors
    /// [`SourceError::Geographic`] or [`SourceError::LinearUnit`] when it is not.
    pub fn require_metres(&self) -> Result<(), SourceError> {
        let path = || self.path.clone();
        match self.crs.unit_m() {
            Some(1.0) => Ok(()),
            None => Err(SourceError::Geographic { path: path(), found: self.crs.name().into() }),
            Some(unit_m) => Err(SourceError::LinearUnit { path: path(), found: unit_name(unit_m) }),
        }
    }

    /// Place of the post at (row, column), east then north, in units of the coordinate system.
    pub fn place(&self, row: u32, col: u32) -> [f64; 2] {
        let [east, north] = self.south_west;
        [east + f64::from(col) * self.spacing[0], north + f64::from(row) * self.spacing[1]]
    }

    /// A place in units of the coordinate system; of degrees, which come around, by the longitude nearest to the
    /// raster's middle.
    pub fn nearest(&self, [mut east, north]: [f64; 2]) -> [f64; 2] {
        if self.crs.is_geographic() {
            let middle = self.south_west[0] + self.spacing[0] * f64::from(self.cols - 1) / 2.0;
            east -= 360.0 * ((east - middle) / 360.0).round();
        }
        [east, north]
    }

    /// The place of a post, for messages.
    pub(crate) fn place_text(&self, row: u32, col: u32) -> String {
        let [east, north] = self.place(row, col);
        match self.crs.is_geographic() {
            true => format!("{east:.5}, {north:.5} degrees"),
            false => format!("{east:.1}, {north:.1} m"),
        }
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
    /// Samples that are metres.
    pub(crate) const METRES: SampleScale = SampleScale { scale: 1.0, offset: 0.0, unit_m: 1.0 };

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
    pub keys: GeoKeys,
    pub gdal_metadata: Option<String>,
}

/// What a file says besides its heights.
#[derive(Clone, Debug)]
pub(crate) struct Facts {
    pub format: &'static str,
    /// Vertical accuracy in metres, as the file states it.
    pub accuracy_m: Option<f64>,
    /// What heights are measured from.
    pub vertical_datum: Option<String>,
}

impl Facts {
    /// Of a format that says nothing.
    pub(crate) fn of(format: &'static str) -> Self {
        Self { format, accuracy_m: None, vertical_datum: None }
    }
}

/// Places along the raster as it is stored: place = first post + index * step, east then north.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Axes {
    pub first: [f64; 2],
    pub step: [f64; 2],
}

impl Axes {
    /// Refuses numbers that are no place.
    pub(crate) fn checked(self, path: &Path) -> Result<Self, SourceError> {
        let Self { first, step } = self;
        let numbers = first.iter().chain(&step);
        let sane = numbers.clone().all(|number| number.abs() <= PLACE_MAX) && 0.0 < step[0];
        if !sane {
            let found = format!("at {first:?} with steps of {step:?}");
            return Err(malformed(path, "the place of the raster", found, "finite metres, and a positive pixel scale"));
        }
        if step.iter().any(|step| step.abs() < STEP_MIN) {
            let (path, found) = (path.into(), format!("{:e} x {:e}", step[0], step[1].abs()));
            return Err(SourceError::TooFine { path, found, limit: STEP_MIN });
        }
        Ok(self)
    }
}

mod key {
    pub const RASTER_TYPE: u16 = 1025;
    pub const VERTICAL_TYPE: u16 = 4096;
    pub const VERTICAL_DATUM: u16 = 4098;
    pub const VERTICAL_UNITS: u16 = 4099;
}
/// Code of a GeoKey whose meaning the file spells out by itself.
const USER_DEFINED: u16 = 32767;
/// Coordinates beyond this (a hundred times around the Earth) are not places.
const PLACE_MAX: f64 = 4.0e9;
/// Posts closer than this, in metres or degrees, are not ground: a tenth of a millimetre at the equator. Between posts
/// at coordinates of millions of metres, a double has room for no much finer step.
const STEP_MIN: f64 = 1.0e-9;
/// A shear this small against the spacing moves no post of the largest raster by a hundredth of a post.
const SHEAR_MAX: f64 = 1.0e-8;

impl GeoTags {
    /// What heights are measured from, by the code of their system, or else by that of their datum.
    pub(crate) fn vertical_datum(&self) -> Option<String> {
        match self.keys.short(key::VERTICAL_TYPE) {
            None | Some(0 | USER_DEFINED) => datum_of_code(self.keys.short(key::VERTICAL_DATUM)?.into()),
            Some(code) => datum_of_system(code.into()),
        }
    }

    /// Whether a pixel's coordinates are those of its centre.
    fn pixel_is_point(&self) -> bool {
        self.keys.short(key::RASTER_TYPE) == Some(2)
    }

    /// What samples mean; `height_unit_m` overrides the unit the file states, `vertical_unit_m` is that of a compound
    /// system.
    pub(crate) fn sample_scale(
        &self,
        path: &Path,
        height_unit_m: Option<f64>,
        vertical_unit_m: Option<f64>,
    ) -> Result<SampleScale, SourceError> {
        let number = |role: &str, default: f64, is_good: fn(f64) -> bool, expected: &str| {
            let Some(text) = self.metadata_item(role) else { return Ok(default) };
            let number = text.trim().parse().ok().filter(|&value: &f64| value.is_finite() && is_good(value));
            number.ok_or_else(|| malformed(path, &format!("the {role} of the samples"), text.into(), expected))
        };
        let unit_m = match height_unit_m {
            Some(unit_m) => unit_m,
            None => self.vertical_unit_m(path, vertical_unit_m)?,
        };
        let scale = number("scale", 1.0, |scale| scale != 0.0, "a number other than 0")?;
        Ok(SampleScale { scale, offset: number("offset", 0.0, |_| true, "a number")?, unit_m })
    }

    /// The unit of heights: that of the vertical system, and what the file says beside it, which must agree.
    fn vertical_unit_m(&self, path: &Path, of_compound: Option<f64>) -> Result<f64, SourceError> {
        let error = |found| SourceError::VerticalUnit { path: path.into(), found };
        let stated = self.stated_unit_m().transpose().map_err(error)?;
        let system = match self.keys.short(key::VERTICAL_TYPE) {
            None | Some(0) => of_compound.map(Ok),
            Some(USER_DEFINED) => Some(Err("a vertical system of the file's own, without a unit".to_owned())),
            Some(code) => Some(unit_m(code)),
        };
        match (stated, system) {
            (None, None) => Ok(1.0),
            (Some(stated), None) => Ok(stated),
            (None, Some(system)) => system.map_err(error),
            // Depths stay depths, whatever their unit.
            (Some(_), Some(Err(found))) if found.contains("downwards") => Err(error(found)),
            (Some(stated), Some(Err(_))) => Ok(stated),
            // A survey foot and a foot differ in the sixth digit, and so do writers' digits.
            (Some(stated), Some(Ok(system))) if (stated - system).abs() <= 1.0e-8 => Ok(system),
            (Some(stated), Some(Ok(system))) => {
                Err(error(format!("units of {stated} m, and by their vertical system in units of {system} m")))
            }
        }
    }

    /// The unit that the file states beside any system.
    fn stated_unit_m(&self) -> Option<Result<f64, String>> {
        Some(match (self.keys.short(key::VERTICAL_UNITS), self.metadata_item("unittype").map(str::trim)) {
            (None | Some(0), None | Some("")) => return None,
            (Some(9001), _) => Ok(1.0),
            (Some(9002), _) => Ok(FOOT_M),
            (Some(9003), _) => Ok(US_FOOT_M),
            (None | Some(0), Some("m" | "metre" | "meter" | "metres" | "meters")) => Ok(1.0),
            (None | Some(0), Some("ft" | "foot" | "feet")) => Ok(FOOT_M),
            (None | Some(0), Some("US survey foot" | "us-ft" | "ftUS")) => Ok(US_FOOT_M),
            (None | Some(0), Some(other)) => Err(format!("`{other}`")),
            (Some(code), _) => Err(format!("units of code {code}")),
        })
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
        let [origin, step] = match (&self.pixel_scale, &self.tie_points, &self.transformation) {
            (Some(scale), Some(tie), _) => tied(path, scale, tie)?,
            (_, _, Some(matrix)) => transformed(path, matrix)?,
            (None, Some(tie), None) => {
                return Err(SourceError::ControlPoints { path: path.into(), found: tie.len() / 6 });
            }
            _ => return Err(SourceError::NoPosition { path: path.into() }),
        };
        let corner = Axes { first: origin, step }.checked(path)?;
        let centre = if self.pixel_is_point() { 0.0 } else { 0.5 };
        let [east, north] = corner.first;
        Ok(Axes { first: [east + centre * step[0], north + centre * step[1]], step })
    }
}

/// What people call a unit of length.
fn unit_name(unit_m: f64) -> String {
    if unit_m == 0.3048 {
        "feet".into()
    } else if (unit_m - 1200.0 / 3937.0).abs() < 1.0e-9 {
        "US survey feet".into()
    } else {
        format!("units of {unit_m} m")
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

/// Where a column of the grid lies, in columns of the raster.
pub(crate) fn col_of(frame: &RasterFrame, grid: &GridFrame, col: i32) -> f64 {
    (grid.east_m(col) - frame.south_west[0]) / frame.spacing[0]
}

/// Where a row of the grid lies, in rows of the raster.
pub(crate) fn row_of(frame: &RasterFrame, grid: &GridFrame, row: i32) -> f64 {
    (grid.north_m(row) - frame.south_west[1]) / frame.spacing[1]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn posts_closer_than_any_ground_is_measured_are_refused_as_such() {
        let axes = |step| Axes { first: [500_000.0, 4.0e6], step };
        for step in [[1.0e-308, -1.0e-308], [25.0, 0.0], [1.0e-12, 1.0]] {
            let error = axes(step).checked(Path::new("a.tif")).unwrap_err();
            assert!(matches!(error, SourceError::TooFine { .. }), "{error}");
        }
        let error = axes([1.0e-308, -1.0e-308]).checked(Path::new("a.tif")).unwrap_err();
        assert!(error.to_string().starts_with("a.tif: its posts are 1e-308 x 1e-308 apart"), "{error}");
        assert!(axes([0.25, -0.25]).checked(Path::new("a.tif")).is_ok());
        assert!(axes([-1.0, 1.0]).checked(Path::new("a.tif")).unwrap_err().to_string().contains("positive"));
    }
}
