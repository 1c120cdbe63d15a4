//! A system spelled out: method, parameters, ellipsoid, datum; and the PROJ definition of it.

use super::system::Crs;

/// How a system projects, or that it does not.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Method {
    Geographic,
    TransverseMercator,
    LambertConformal,
    Albers,
    LambertAzimuthal,
    Mercator,
    PolarStereographic,
}

/// What heights above the ellipsoid would be above: an ellipsoid and its shift to WGS 84.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Datum {
    Wgs84,
    Nad83,
    /// GRS 80 and so near to WGS 84 that no shift is made.
    Etrs89,
    /// Another ellipsoid with the parameters of a shift.
    Shifted {
        semi_major_m: f64,
        inverse_flattening: f64,
        to_wgs84: Vec<f64>,
    },
}

/// A system spelled out. Angles are degrees, lengths metres.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Parameters {
    pub method: Method,
    pub datum: Datum,
    /// Longitudes count from here, east of Greenwich.
    pub prime_meridian: f64,
    pub latitude_of_origin: f64,
    pub central_meridian: f64,
    pub first_parallel: Option<f64>,
    pub second_parallel: Option<f64>,
    pub scale: f64,
    pub false_east_m: f64,
    pub false_north_m: f64,
    /// Metres in a unit of the coordinates.
    pub unit_m: f64,
}

impl Parameters {
    pub fn geographic(datum: Datum) -> Self {
        Self {
            method: Method::Geographic,
            datum,
            prime_meridian: 0.0,
            latitude_of_origin: 0.0,
            central_meridian: 0.0,
            first_parallel: None,
            second_parallel: None,
            scale: 1.0,
            false_east_m: 0.0,
            false_north_m: 0.0,
            unit_m: 1.0,
        }
    }

    /// The system; one that has a code of its own gets it, so that it is recognised as the same.
    pub fn crs(&self, name: &str) -> Result<Crs, String> {
        if let Some(code) = self.code() {
            return Crs::horizontal(code);
        }
        let name = if name.is_empty() { "a system of its own".to_owned() } else { name.to_owned() };
        let meridian = if self.prime_meridian == 0.0 { String::new() } else { format!(" +pm={}", self.prime_meridian) };
        Crs::new(format!("{} {}{meridian}", self.projection(), self.ellipsoid()), name, None)
    }

    /// The EPSG code of the plainest systems: degrees, and UTM.
    fn code(&self) -> Option<u32> {
        if self.prime_meridian != 0.0 {
            return None;
        }
        if self.method == Method::Geographic {
            return match self.datum {
                Datum::Wgs84 => Some(4326),
                Datum::Nad83 => Some(4269),
                Datum::Etrs89 => Some(4258),
                Datum::Shifted { .. } => None,
            };
        }
        let zone = (self.central_meridian + 183.0) / 6.0;
        let of_zone = zone.fract() == 0.0 && (1.0..=60.0).contains(&zone);
        let shape = (self.latitude_of_origin, self.scale, self.false_east_m, self.unit_m);
        if self.method != Method::TransverseMercator || !of_zone || shape != (0.0, 0.9996, 500_000.0, 1.0) {
            return None;
        }
        let zone = zone as u32;
        match (&self.datum, self.false_north_m == 0.0, self.false_north_m == 1.0e7) {
            (Datum::Wgs84, true, _) => Some(32_600 + zone),
            (Datum::Wgs84, _, true) => Some(32_700 + zone),
            (Datum::Nad83, true, _) if zone <= 23 => Some(26_900 + zone),
            (Datum::Etrs89, true, _) if (28..=38).contains(&zone) => Some(25_800 + zone),
            _ => None,
        }
    }

    fn projection(&self) -> String {
        let Self { latitude_of_origin: lat_0, central_meridian: lon_0, scale, .. } = self;
        let first = self.first_parallel.unwrap_or(*lat_0);
        let second = self.second_parallel.unwrap_or(first);
        let (x_0, y_0) = (self.false_east_m, self.false_north_m);
        let method = match self.method {
            Method::Geographic => return "+proj=longlat".into(),
            Method::TransverseMercator => format!("+proj=tmerc +lat_0={lat_0} +lon_0={lon_0} +k={scale}"),
            Method::LambertConformal => {
                format!("+proj=lcc +lat_0={lat_0} +lon_0={lon_0} +lat_1={first} +lat_2={second} +k={scale}")
            }
            Method::Albers => format!("+proj=aea +lat_0={lat_0} +lon_0={lon_0} +lat_1={first} +lat_2={second}"),
            Method::LambertAzimuthal => format!("+proj=laea +lat_0={lat_0} +lon_0={lon_0}"),
            Method::Mercator => match self.first_parallel {
                Some(parallel) => format!("+proj=merc +lat_ts={parallel} +lon_0={lon_0}"),
                None => format!("+proj=merc +lon_0={lon_0} +k={scale}"),
            },
            Method::PolarStereographic => {
                // Given either by the latitude that is true to scale, or by the scale at the pole.
                let (pole, at) = if *lat_0 < 0.0 { (-90, lat_0) } else { (90, lat_0) };
                match at.abs() == 90.0 {
                    true => format!("+proj=stere +lat_0={pole} +lon_0={lon_0} +k={scale}"),
                    false => format!("+proj=stere +lat_0={pole} +lat_ts={at} +lon_0={lon_0}"),
                }
            }
        };
        format!("{method} +x_0={x_0} +y_0={y_0} +to_meter={}", self.unit_m)
    }

    fn ellipsoid(&self) -> String {
        match &self.datum {
            Datum::Wgs84 => "+datum=WGS84".into(),
            Datum::Nad83 => "+datum=NAD83".into(),
            Datum::Etrs89 => "+ellps=GRS80 +towgs84=0,0,0".into(),
            Datum::Shifted { semi_major_m, inverse_flattening, to_wgs84 } => {
                let shift: Vec<String> = to_wgs84.iter().map(f64::to_string).collect();
                format!("+a={semi_major_m} +rf={inverse_flattening} +towgs84={}", shift.join(","))
            }
        }
    }
}

/// The datum that goes by a name in well-known text, spelled in any of the usual ways.
pub(super) fn datum_named(name: &str) -> Option<Datum> {
    let plain: String = name.chars().filter(char::is_ascii_alphanumeric).collect::<String>().to_ascii_uppercase();
    let plain = plain.strip_prefix('D').filter(|rest| !rest.starts_with("ATUM")).unwrap_or(&plain);
    let begins = |starts: &[&str]| starts.iter().any(|start| plain.starts_with(start));
    if begins(&["WGS1984", "WGS84", "WORLDGEODETICSYSTEM1984"]) {
        Some(Datum::Wgs84)
    } else if begins(&["NORTHAMERICAN1983", "NORTHAMERICANDATUM1983", "NAD83", "NAD1983"]) {
        Some(Datum::Nad83)
    } else if plain.contains("GRS1980")
        || begins(&["ETRS", "EUROPEANTERRESTRIAL", "GDA", "GEOCENTRICDATUMOFAUSTRALIA", "NZGD2000", "SIRGAS", "JGD20"])
    {
        Some(Datum::Etrs89)
    } else {
        None
    }
}
