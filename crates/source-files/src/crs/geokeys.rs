//! The coordinate system that the GeoKeys of a TIFF name or spell out.

use super::parameters::{Datum, Method, Parameters};
use super::system::Crs;

/// The key directory and the numbers that it points to.
#[derive(Clone, Debug, Default)]
pub(crate) struct GeoKeys {
    pub directory: Vec<u16>,
    pub doubles: Vec<f64>,
    pub texts: String,
}

/// What a file says about its system: nothing; or a system, or in words what keeps it from being one.
type Found = Option<Result<Crs, String>>;

mod key {
    pub const MODEL_TYPE: u16 = 1024;
    pub const CITATION: u16 = 1026;
    pub const GEOGRAPHIC_TYPE: u16 = 2048;
    pub const DATUM: u16 = 2050;
    pub const PRIME_MERIDIAN: u16 = 2051;
    pub const ANGULAR_UNITS: u16 = 2054;
    pub const ELLIPSOID: u16 = 2056;
    pub const SEMI_MAJOR: u16 = 2057;
    pub const INVERSE_FLATTENING: u16 = 2059;
    pub const PRIME_MERIDIAN_DEGREES: u16 = 2061;
    pub const TO_WGS84: u16 = 2062;
    pub const PROJECTED_TYPE: u16 = 3072;
    pub const PROJECTION: u16 = 3074;
    pub const METHOD: u16 = 3075;
    pub const LINEAR_UNITS: u16 = 3076;
    pub const LINEAR_UNIT_M: u16 = 3077;
    pub const FIRST_PARALLEL: u16 = 3078;
    pub const SECOND_PARALLEL: u16 = 3079;
    pub const MERIDIAN: [u16; 4] = [3080, 3084, 3088, 3095];
    pub const LATITUDE: [u16; 3] = [3081, 3085, 3089];
    pub const FALSE_EAST: [u16; 3] = [3082, 3086, 3090];
    pub const FALSE_NORTH: [u16; 3] = [3083, 3087, 3091];
    pub const SCALE: [u16; 2] = [3092, 3093];
}
/// Code of a GeoKey whose meaning the file spells out by itself.
const USER_DEFINED: u16 = 32767;

impl GeoKeys {
    /// The value of a key that is held in the directory itself.
    pub(crate) fn short(&self, key: u16) -> Option<u16> {
        self.entry(key).filter(|entry| entry[1] == 0).map(|entry| entry[3])
    }

    fn entry(&self, key: u16) -> Option<&[u16]> {
        self.directory.chunks_exact(4).skip(1).find(|entry| entry[0] == key)
    }

    /// The values of a key that are held among the doubles.
    fn doubles_of(&self, key: u16) -> Option<&[f64]> {
        const DOUBLES: u16 = 34736;
        let entry = self.entry(key).filter(|entry| entry[1] == DOUBLES)?;
        self.doubles.get(usize::from(entry[3])..)?.get(..usize::from(entry[2]))
    }

    fn double(&self, key: u16) -> Option<f64> {
        self.doubles_of(key)?.first().copied()
    }

    fn first_of(&self, keys: &[u16]) -> Option<f64> {
        keys.iter().find_map(|&key| self.double(key))
    }

    fn text(&self, key: u16) -> Option<&str> {
        const TEXTS: u16 = 34737;
        let entry = self.entry(key).filter(|entry| entry[1] == TEXTS)?;
        let text = self.texts.get(usize::from(entry[3])..)?.get(..usize::from(entry[2]))?;
        Some(text.trim_end_matches(['|', '\0']))
    }

    /// The system, if the file says anything about one.
    pub(crate) fn crs(&self) -> Found {
        let (model, projected) = (self.short(key::MODEL_TYPE), self.short(key::PROJECTED_TYPE));
        let geographic = self.short(key::GEOGRAPHIC_TYPE);
        Some(match (model, projected) {
            (None, None) if geographic.is_none() => return None,
            (Some(2), _) | (None, None) => self.geographic(),
            (Some(3), _) => Err("geocentric".into()),
            (_, None | Some(0)) => Err("not named".into()),
            (_, Some(USER_DEFINED)) => self.spelled_out(),
            (_, Some(code)) => self.in_its_unit(code),
        })
    }

    fn geographic(&self) -> Result<Crs, String> {
        if self.short(key::ANGULAR_UNITS).is_some_and(|unit| unit != 9102 && unit != 0) {
            return Err(format!(
                "geographic, in angular units of code {}",
                self.short(key::ANGULAR_UNITS).unwrap_or(0)
            ));
        }
        match self.short(key::GEOGRAPHIC_TYPE) {
            None | Some(0 | USER_DEFINED) => {
                let prime_meridian = self.prime_meridian()?;
                Parameters { prime_meridian, ..Parameters::geographic(self.datum()?) }.crs("")
            }
            Some(code) => Crs::from_epsg(code.into()),
        }
    }

    /// A system by code; a file may say that its coordinates are in another unit than the code's.
    fn in_its_unit(&self, code: u16) -> Result<Crs, String> {
        let crs = Crs::from_epsg(code.into())?;
        let (Some(stated), Some(unit_m)) = (self.unit_m()?, crs.unit_m()) else { return Ok(crs) };
        match (stated - unit_m).abs() <= 1.0e-9 * unit_m {
            true => Ok(crs),
            false => Err(format!("EPSG:{code} in units of {stated} m instead of its own of {unit_m} m")),
        }
    }

    fn unit_m(&self) -> Result<Option<f64>, String> {
        match self.short(key::LINEAR_UNITS) {
            None | Some(0) => Ok(None),
            Some(9001) => Ok(Some(1.0)),
            Some(9002) => Ok(Some(0.3048)),
            Some(9003) => Ok(Some(1200.0 / 3937.0)),
            Some(USER_DEFINED) => {
                let unit_m = self.double(key::LINEAR_UNIT_M).filter(|unit_m| (1.0e-6..=1.0e6).contains(unit_m));
                unit_m.map(Some).ok_or_else(|| "in a unit of the file's own without a size".into())
            }
            Some(code) => Err(format!("in units of code {code}")),
        }
    }

    /// Degrees east of Greenwich from which longitudes count.
    fn prime_meridian(&self) -> Result<f64, String> {
        const GREENWICH: u16 = 8901;
        match (self.short(key::PRIME_MERIDIAN), self.double(key::PRIME_MERIDIAN_DEGREES)) {
            (None | Some(0 | GREENWICH), None) => Ok(0.0),
            (_, Some(degrees)) => Ok(degrees),
            (Some(code), None) => Err(format!("defined by the file, counted from the meridian of code {code}")),
        }
    }

    fn datum(&self) -> Result<Datum, String> {
        match self.short(key::GEOGRAPHIC_TYPE) {
            Some(4326) => return Ok(Datum::Wgs84),
            Some(4269) => return Ok(Datum::Nad83),
            Some(4258) => return Ok(Datum::Etrs89),
            _ => {}
        }
        match self.short(key::DATUM) {
            Some(6326) => return Ok(Datum::Wgs84),
            Some(6269) => return Ok(Datum::Nad83),
            Some(6258) => return Ok(Datum::Etrs89),
            _ => {}
        }
        let shape = match (self.short(key::ELLIPSOID), self.double(key::SEMI_MAJOR)) {
            (Some(7030), _) => Some((6_378_137.0, 298.257_223_563)),
            (Some(7019), _) => Some((6_378_137.0, 298.257_222_101)),
            (_, Some(semi_major_m)) => self.double(key::INVERSE_FLATTENING).map(|inverse| (semi_major_m, inverse)),
            _ => None,
        };
        match (shape, self.doubles_of(key::TO_WGS84)) {
            (Some((semi_major_m, inverse_flattening)), Some(shift)) if matches!(shift.len(), 3 | 7) => {
                Ok(Datum::Shifted { semi_major_m, inverse_flattening, to_wgs84: shift.to_vec() })
            }
            _ => Err("defined by the file, on a datum whose shift to WGS 84 is not known".into()),
        }
    }

    /// A projected system that the file spells out.
    fn spelled_out(&self) -> Result<Crs, String> {
        let name = self.text(key::CITATION).unwrap_or_default();
        if let Some(zone @ (16_001..=16_060 | 16_101..=16_160)) = self.short(key::PROJECTION) {
            return self.utm(zone)?.crs(name);
        }
        let Some(method) = self.short(key::METHOD) else {
            return Err("defined by the file, without a method of projection".into());
        };
        let method = match method {
            1 => Method::TransverseMercator,
            7 => Method::Mercator,
            8 | 9 => Method::LambertConformal,
            10 => Method::LambertAzimuthal,
            11 => Method::Albers,
            15 => Method::PolarStereographic,
            other => return Err(format!("defined by the file, by projection method {other}")),
        };
        let unit_m = self.unit_m()?.unwrap_or(1.0);
        let datum = self.datum()?;
        Parameters {
            method,
            latitude_of_origin: self.first_of(&key::LATITUDE).unwrap_or(0.0),
            central_meridian: self.first_of(&key::MERIDIAN).unwrap_or(0.0),
            first_parallel: self.double(key::FIRST_PARALLEL),
            second_parallel: self.double(key::SECOND_PARALLEL),
            scale: self.first_of(&key::SCALE).unwrap_or(1.0),
            false_east_m: self.first_of(&key::FALSE_EAST).unwrap_or(0.0) * unit_m,
            false_north_m: self.first_of(&key::FALSE_NORTH).unwrap_or(0.0) * unit_m,
            unit_m,
            prime_meridian: self.prime_meridian()?,
            ..Parameters::geographic(datum)
        }
        .crs(name)
    }

    fn utm(&self, zone: u16) -> Result<Parameters, String> {
        let (south, zone) = if 16_100 < zone { (true, zone - 16_100) } else { (false, zone - 16_000) };
        Ok(Parameters {
            method: Method::TransverseMercator,
            central_meridian: f64::from(zone) * 6.0 - 183.0,
            scale: 0.9996,
            false_east_m: 500_000.0,
            false_north_m: if south { 1.0e7 } else { 0.0 },
            unit_m: self.unit_m()?.unwrap_or(1.0),
            prime_meridian: self.prime_meridian()?,
            ..Parameters::geographic(self.datum()?)
        })
    }
}
