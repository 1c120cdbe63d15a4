//! From the area's coordinate system to the globe: longitude and latitude, heights above the ellipsoid, and places
//! counted from the middle of the Earth.

use source_files::{Crs, plain_datum};
use store::Area;
use terrain::ModuleRect;

use crate::{ExportError, Product};

/// What heights are measured from, as far as this program can bring them above the ellipsoid of WGS 84.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Datum {
    /// The ellipsoid itself: nothing is added.
    Ellipsoid,
    /// The geoid EGM96, computed from its coefficients.
    Egm96,
    /// The geoid EGM2008, taken for EGM96: they differ by 0.5 m RMS and 10 m at most.
    Egm2008,
    /// A surface that lies so many metres above the ellipsoid everywhere in the area.
    Above(f64),
}

impl Datum {
    /// The datum of a name as people write it; `None` for one that cannot be computed.
    pub fn named(name: &str) -> Option<Self> {
        match plain_datum(name).as_str() {
            "egm96" | "egm96geoid" | "epsg5773" => Some(Self::Egm96),
            "egm2008" | "egm2008geoid" | "epsg3855" => Some(Self::Egm2008),
            "ellipsoid" | "ellipsoidal" | "wgs84" | "wgs84ellipsoid" | "grs80" | "epsg4979" => Some(Self::Ellipsoid),
            _ => None,
        }
    }

    /// What was done to heights, in words.
    pub fn said(&self) -> String {
        match self {
            Self::Ellipsoid => "heights are above the ellipsoid already".into(),
            Self::Egm96 => "the geoid EGM96 was added to heights".into(),
            Self::Egm2008 => {
                "the geoid EGM96 was added to heights above EGM2008: they differ by 0.5 m RMS, 10 m at most".into()
            }
            Self::Above(metres) => format!("{metres} m were added to heights, as told"),
        }
    }
}

/// Half the longest axis of WGS 84's ellipsoid, in metres.
pub(crate) const SEMI_MAJOR_M: f64 = 6_378_137.0;
/// The square of its eccentricity.
const ECCENTRICITY_SQUARED: f64 = {
    const FLATTENING: f64 = 1.0 / 298.257_223_563;
    FLATTENING * (2.0 - FLATTENING)
};

/// Knows where places of a product lie on the globe.
#[derive(Debug)]
pub struct Earth {
    crs: Crs,
    wgs84: Crs,
    outline: Vec<[f64; 2]>,
    datum: Datum,
    geoid: Option<GeoidGrid>,
}

impl Earth {
    /// The globe under a product. `assumed` is what to take its heights to be above; else the database says it.
    ///
    /// # Errors
    /// When the datum is not known or cannot be computed and nothing is assumed, or the coordinate system cannot be
    /// computed.
    pub(crate) fn new(product: &Product, assumed: Option<Datum>) -> Result<Self, ExportError> {
        Self::under(&product.manifest.area, product.rect, assumed)
    }

    /// The same under some load modules of an area.
    pub(crate) fn under(area: &Area, rect: ModuleRect, assumed: Option<Datum>) -> Result<Self, ExportError> {
        let datum = match assumed.or_else(|| Datum::named(&area.vertical_datum)) {
            Some(datum) => datum,
            None => return Err(unknown_datum(&area.vertical_datum)),
        };
        let crs = Crs::named(&area.crs).map_err(|found| ExportError::Impossible {
            what: format!("the coordinate system {}", area.crs),
            found,
            expected: "one that can be computed".into(),
            hint: "this format needs longitude and latitude; export a mesh or a GeoTIFF instead".into(),
        })?;
        let mut earth = Self { crs, wgs84: Crs::wgs84(), outline: Vec::new(), datum, geoid: None };
        earth.outline = outline(area, rect).map(|place_m| earth.lon_lat(place_m)).collect::<Result<_, _>>()?;
        let longitudes = || earth.outline.iter().map(|place| place[0]);
        let (west, east) = (longitudes().fold(180.0, f64::min), longitudes().fold(-180.0, f64::max));
        if 180.0 < east - west {
            return Err(ExportError::Impossible {
                what: "the area".into(),
                found: format!("ground from {west:.3} to {east:.3} degrees, across the 180th meridian or a pole"),
                expected: "ground on one side of it".into(),
                hint: "export the two sides one after the other, with --modules".into(),
            });
        }
        if matches!(datum, Datum::Egm96 | Datum::Egm2008) {
            earth.geoid = Some(GeoidGrid::over(&earth.outline, [0.0; 2]));
        }
        Ok(earth)
    }

    /// The same with one grid of the geoid for all: areas that meet have the same heights where they do.
    pub(crate) fn together(mut all: Vec<Self>) -> Vec<Self> {
        let step = [0, 1].map(|axis| {
            let steps = all.iter().filter_map(|earth| Some(earth.geoid.as_ref()?.step[axis]));
            steps.fold(0.0, f64::max)
        });
        for earth in &mut all {
            earth.geoid = earth.geoid.take().map(|_| GeoidGrid::over(&earth.outline, step));
        }
        all
    }

    /// What was done to heights.
    pub(crate) fn datum(&self) -> Datum {
        self.datum
    }

    /// The area's coordinate system.
    pub(crate) fn crs(&self) -> &Crs {
        &self.crs
    }

    /// Longitude and latitude in degrees of a place in the area's system.
    pub(crate) fn lon_lat(&self, place_m: [f64; 2]) -> Result<[f64; 2], ExportError> {
        self.crs.to(&self.wgs84, place_m).ok_or_else(|| out_of_range(&self.crs, place_m))
    }

    /// The place in the area's system of a longitude and latitude in degrees; `None` where there is none.
    pub(crate) fn place_m(&self, lon_lat: [f64; 2]) -> Option<[f64; 2]> {
        self.wgs84.to(&self.crs, lon_lat)
    }

    /// Metres to add to a height for that above the ellipsoid.
    pub(crate) fn datum_m(&self, lon_lat: [f64; 2]) -> f64 {
        match (&self.geoid, self.datum) {
            (Some(geoid), _) => geoid.at(lon_lat),
            (None, Datum::Above(metres)) => metres,
            (None, _) => 0.0,
        }
    }

    /// Longitudes and latitudes along the sides of what it is under.
    pub(crate) fn outline(&self) -> &[[f64; 2]] {
        &self.outline
    }
}

/// Corners of load modules along the sides of some of an area.
fn outline(area: &Area, rect: ModuleRect) -> impl Iterator<Item = [f64; 2]> {
    let rows = (rect.south..=rect.north).flat_map(move |row| [[rect.west, row], [rect.east, row]]);
    let cols = (rect.west..=rect.east).flat_map(move |col| [[col, rect.south], [col, rect.north]]);
    let corner_m = |at: [u32; 2]| [0, 1].map(|axis| area.origin_m[axis] + f64::from(at[axis]) * area.module_side_m);
    rows.chain(cols).map(corner_m)
}

fn out_of_range(crs: &Crs, place_m: [f64; 2]) -> ExportError {
    ExportError::Impossible {
        what: "the area".into(),
        found: format!("the place {} {}, which {} does not reach", place_m[0], place_m[1], crs.name()),
        expected: "places inside the coordinate system".into(),
        hint: "choose a coordinate system that is made for this area, and build again".into(),
    }
}

fn unknown_datum(found: &str) -> ExportError {
    let found = match found {
        "" => "heights above an unknown datum".to_owned(),
        name => format!("heights above {name}, which cannot be computed"),
    };
    ExportError::Impossible {
        what: "this format wants heights above the ellipsoid".into(),
        found,
        expected: "heights above EGM96 or the ellipsoid".into(),
        hint: "say what to take them for: --assume-datum EGM96, ellipsoid, or the metres to add to every height".into(),
    }
}

/// Heights of the geoid EGM96 on a grid of longitudes and latitudes, interpolated between. Its lines are multiples of
/// the step, whatever the area.
#[derive(Debug)]
struct GeoidGrid {
    south_west: [f64; 2],
    step: [f64; 2],
    columns: usize,
    metres: Vec<f64>,
}

impl GeoidGrid {
    /// Degrees between nodes, where the area is not large: EGM96 knows nothing smaller than half a degree.
    const STEP_DEGREES: f64 = 0.05;
    /// Cells along a side at most, above which the step is doubled: each node takes a sum of 65,000 terms.
    const CELLS_MAX: f64 = 32.0;

    /// That over some places, of steps no smaller than some.
    fn over(places: &[[f64; 2]], step_min: [f64; 2]) -> Self {
        let along = |axis: usize| {
            let values = || places.iter().map(|place| place[axis]);
            let (low, high) = (values().fold(f64::INFINITY, f64::min), values().fold(f64::NEG_INFINITY, f64::max));
            let mut step = Self::STEP_DEGREES.max(step_min[axis]);
            while Self::CELLS_MAX * step < high - low {
                step *= 2.0;
            }
            let first = (low / step).floor();
            (first * step, step, ((high / step).ceil() - first).max(1.0) as usize)
        };
        let [(west, east_step, cols), (south, north_step, rows)] = [along(0), along(1)];
        let (step, columns, rows) = ([east_step, north_step], cols + 1, rows + 1);
        let node = |index: usize| {
            let (row, col) = ((index / columns) as f64, (index % columns) as f64);
            egm96::egm96_compute_altitude_offset((south + row * step[1]).clamp(-90.0, 90.0), west + col * step[0])
        };
        Self { south_west: [west, south], step, columns, metres: (0..rows * columns).map(node).collect() }
    }

    fn at(&self, lon_lat: [f64; 2]) -> f64 {
        let rows = self.metres.len() / self.columns;
        let share = |axis: usize, count: usize| {
            let at = (lon_lat[axis] - self.south_west[axis]) / self.step[axis];
            let cell = (at.floor().max(0.0) as usize).min(count - 2);
            // Beyond the outline, which places of the area do not leave by more than their bulge, it is continued.
            (cell, at - cell as f64)
        };
        let ((col, x), (row, y)) = (share(0, self.columns), share(1, rows));
        let node = |row: usize, col: usize| self.metres[row * self.columns + col];
        let along = |row: usize| node(row, col) + x * (node(row, col + 1) - node(row, col));
        along(row) + y * (along(row + 1) - along(row))
    }
}

/// East, north and up of a place on the globe, as directions of the Earth's own axes.
pub(crate) fn directions([longitude, latitude]: [f64; 2]) -> [[f64; 3]; 3] {
    let ((sin_lon, cos_lon), (sin_lat, cos_lat)) = (longitude.to_radians().sin_cos(), latitude.to_radians().sin_cos());
    [
        [-sin_lon, cos_lon, 0.0],
        [-sin_lat * cos_lon, -sin_lat * sin_lon, cos_lat],
        [cos_lat * cos_lon, cos_lat * sin_lon, sin_lat],
    ]
}

/// Metres from the middle of the Earth along its own axes.
pub(crate) fn earth_centred(lon_lat: [f64; 2], height_m: f64) -> [f64; 3] {
    let [_, _, up] = directions(lon_lat);
    let across = SEMI_MAJOR_M / (1.0 - ECCENTRICITY_SQUARED * up[2] * up[2]).sqrt();
    let polar = across * (1.0 - ECCENTRICITY_SQUARED);
    [(across + height_m) * up[0], (across + height_m) * up[1], (polar + height_m) * up[2]]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::samples;

    #[test]
    fn places_on_the_axes_lie_where_the_ellipsoid_ends() {
        assert_eq!(earth_centred([0.0, 0.0], 100.0), [6_378_237.0, 0.0, 0.0]);
        let pole = earth_centred([0.0, 90.0], 0.0);
        assert!((pole[2] - 6_356_752.314_245).abs() < 1e-5 && pole[0].abs() < 1e-6);
        // As PROJ has it, from EPSG:4979 to EPSG:4978.
        let munich = earth_centred([11.0, 48.0], 500.0);
        let expected = [4_197_489.243_355_404, 815_909.256_725_671, 4_717_247.902_528_144];
        assert!((0..3).all(|axis| (munich[axis] - expected[axis]).abs() < 1e-8), "{munich:?}");
    }

    #[test]
    fn the_geoid_is_added_where_the_datum_is_egm96() {
        let product = samples::product();
        let earth = Earth::new(&product, None).unwrap();
        let place = earth.lon_lat([505_500.0, 3_875_250.0]).unwrap();
        let direct = egm96::egm96_compute_altitude_offset(place[1], place[0]);
        assert!((earth.datum_m(place) - direct).abs() < 0.001);
        // The geoid lies about 30 m below the ellipsoid in the Mojave desert.
        assert!((-35.0..-25.0).contains(&direct), "{direct}");
        let back = earth.place_m(place).unwrap();
        assert!((back[0] - 505_500.0).abs() < 1e-6 && (back[1] - 3_875_250.0).abs() < 1e-6);
    }

    #[test]
    fn the_geoid_is_that_of_its_makers() {
        // Places and heights that come with the makers' own grid, which is interpolated; the sum is not.
        for (latitude, longitude, metres) in [
            (38.628_155, 269.779_155, -31.628),
            (-14.621_217, 305.021_114, -2.969),
            (46.874_319, 102.448_729, -43.575),
            (-23.617_446, 133.874_712, 15.871),
            (38.625_473, 359.999_5, 50.066),
            (-0.466_744, 0.002_3, 17.329),
        ] {
            let found = egm96::egm96_compute_altitude_offset(latitude, longitude);
            assert!((found - metres).abs() < 0.005, "{latitude} {longitude}: {found}, expected {metres}");
        }
    }

    #[test]
    fn an_unknown_datum_is_refused_unless_something_is_assumed() {
        let mut product = samples::product();
        for datum in ["", "NAVD88"] {
            product.manifest.area.vertical_datum = datum.into();
            let error = Earth::new(&product, None).unwrap_err();
            assert!(error.hint().is_some_and(|hint| hint.contains("--assume-datum")), "{error}");
            let earth = Earth::new(&product, Some(Datum::Above(-30.5))).unwrap();
            assert_eq!(earth.datum_m([0.0, 0.0]), -30.5);
        }
        assert_eq!(Datum::named("EGM 96"), Some(Datum::Egm96));
        assert_eq!(Datum::named("WGS 84"), Some(Datum::Ellipsoid));
    }
}
