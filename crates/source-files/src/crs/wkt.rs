//! Well-known text of coordinate systems, version 1, in the dialects of ESRI and GDAL; of version 2, only what names
//! a code.

use super::datums::{datum_in_name, datum_of_code, datum_of_system};
use super::parameters::{Datum, Method, Parameters, datum_named};
use super::system::{Crs, Vertical};
use super::vertical::unit_m;
use super::wkt_nodes::{Node, Parser};

/// Longer texts describe no system in use.
const CHARS_MAX: usize = 1 << 16;
pub(super) fn read(text: &str) -> Result<Crs, String> {
    if CHARS_MAX < text.len() {
        return Err(format!("text of {} bytes", text.len()));
    }
    let mut parser = Parser { rest: text.trim_start_matches('\u{feff}').trim(), depth: 0 };
    let root = parser.node()?;
    // ESRI's writers put the vertical system behind the other.
    let mut vertical = root.vertical().map(heights);
    while vertical.is_none() && parser.rest.trim_start().starts_with(',') {
        parser.rest = parser.rest.trim_start().trim_start_matches(',').trim_start();
        vertical = parser.node()?.vertical().map(heights);
    }
    let (vertical, crs) = (vertical.transpose()?, system(&root)?);
    Ok(match vertical {
        Some(vertical) => crs.with_vertical(vertical),
        None => crs,
    })
}

/// Unit and datum of a vertical system.
fn heights(vertical: &Node) -> Result<Vertical, String> {
    let datum_node = ["VERT_DATUM", "VDATUM", "VERTICALDATUM"].iter().find_map(|keyword| vertical.child(keyword));
    let datum = match (vertical.code(), datum_node.and_then(Node::code)) {
        (Some(code), _) => datum_of_system(code),
        (None, Some(code)) => datum_of_code(code),
        (None, None) => vertical.texts.first().and_then(|name| datum_in_name(name)),
    };
    Ok(Vertical { unit_m: unit_of_heights(vertical)?, datum })
}

/// Metres in a unit of a vertical system.
fn unit_of_heights(vertical: &Node) -> Result<f64, String> {
    if let Some(code) = vertical.code().and_then(|code| u16::try_from(code).ok())
        && let Ok(unit_m) = unit_m(code)
    {
        return Ok(unit_m);
    }
    let axis = vertical.child("AXIS");
    let unit = vertical.unit().or_else(|| axis.and_then(Node::unit)).filter(|unit_m| (1.0e-6..=1.0e6).contains(unit_m));
    unit.ok_or_else(|| "one whose vertical part has no unit".into())
}

fn system(root: &Node) -> Result<Crs, String> {
    // By its horizontal part, whatever code the whole has.
    if matches!(root.keyword.as_str(), "COMPD_CS" | "COMPOUNDCRS") {
        return system(root.children.first().ok_or("a compound system without parts")?);
    }
    if let Some(code) = root.code() {
        return Crs::horizontal(code);
    }
    let name = root.texts.first().map_or("", String::as_str);
    match root.keyword.as_str() {
        "GEOGCS" => {
            Parameters { prime_meridian: prime_meridian(root), ..Parameters::geographic(datum(root)?) }.crs(name)
        }
        "PROJCS" if is_web_mercator(root) => Crs::horizontal(3857),
        "PROJCS" => projected(root)?.crs(name),
        "BOUNDCRS" => system(root.children.first().ok_or("a compound system without parts")?),
        "PROJCRS" | "GEOGCRS" | "GEODCRS" => Err(format!("version 2 of well-known text without a code ({name})")),
        "LOCAL_CS" | "ENGCRS" => Err(format!("a local system ({name})")),
        other => Err(format!("a system of kind {other}")),
    }
}

/// Whether it is Web Mercator as ESRI's writers spell it out: on a sphere, of places on the ellipsoid of WGS 84.
fn is_web_mercator(root: &Node) -> bool {
    let is_of = |keyword: &str, name: &str| {
        let of = root.child(keyword).and_then(|node| node.texts.first());
        of.is_some_and(|of| of.eq_ignore_ascii_case(name))
    };
    let parameters = root.children.iter().filter(|node| node.keyword == "PARAMETER");
    let mut numbers = parameters.filter_map(|node| node.numbers.first());
    let datum = root.child("GEOGCS").and_then(|geographic| datum(geographic).ok());
    is_of("PROJECTION", "Mercator_Auxiliary_Sphere")
        && datum == Some(Datum::Wgs84)
        && root.child("GEOGCS").is_some_and(|geographic| prime_meridian(geographic) == 0.0)
        && root.child("UNIT").and_then(|unit| unit.numbers.first()) == Some(&1.0)
        && numbers.all(|number| *number == 0.0)
}

fn projected(root: &Node) -> Result<Parameters, String> {
    let geographic = root.child("GEOGCS").ok_or("a projection without its geographic system")?;
    let degrees = angle_unit(geographic)?;
    let method = root.child("PROJECTION").and_then(|node| node.texts.first()).ok_or("no projection named")?;
    let unit_m = root.child("UNIT").and_then(|node| node.numbers.first().copied()).unwrap_or(1.0);
    if !(1.0e-6..=1.0e6).contains(&unit_m) {
        return Err(format!("in units of {unit_m} m"));
    }
    let parameter = |names: &[&str]| {
        let is = |node: &&Node| node.texts.first().is_some_and(|text| names.contains(&text.to_lowercase().as_str()));
        let mut nodes = root.children.iter().filter(|node| node.keyword == "PARAMETER");
        nodes.find(is).and_then(|node| node.numbers.first().copied())
    };
    let angle = |names: &[&str]| parameter(names).map(|value| value * degrees);
    if parameter(&["azimuth", "rectified_grid_angle"]).is_some_and(|azimuth| azimuth != 0.0) {
        return Err(format!("projection {method}"));
    }
    Ok(Parameters {
        method: method_named(method)?,
        datum: datum(geographic)?,
        prime_meridian: prime_meridian(geographic),
        latitude_of_origin: angle(&["latitude_of_origin", "latitude_of_center"])
            .or_else(|| angle(&["standard_parallel_1"]))
            .unwrap_or(0.0),
        central_meridian: angle(&["central_meridian", "longitude_of_center", "longitude_of_origin"]).unwrap_or(0.0),
        first_parallel: angle(&["standard_parallel_1"]),
        second_parallel: angle(&["standard_parallel_2"]),
        scale: parameter(&["scale_factor"]).unwrap_or(1.0),
        false_east_m: parameter(&["false_easting"]).unwrap_or(0.0) * unit_m,
        false_north_m: parameter(&["false_northing"]).unwrap_or(0.0) * unit_m,
        unit_m,
    })
}

fn method_named(name: &str) -> Result<Method, String> {
    let plain: String = name.chars().filter(char::is_ascii_alphanumeric).collect::<String>().to_lowercase();
    Ok(match plain.as_str() {
        "transversemercator" | "gausskruger" => Method::TransverseMercator,
        "lambertconformalconic" | "lambertconformalconic1sp" | "lambertconformalconic2sp" => Method::LambertConformal,
        "albers" | "albersconicequalarea" => Method::Albers,
        "lambertazimuthalequalarea" => Method::LambertAzimuthal,
        "mercator" | "mercator1sp" | "mercator2sp" => Method::Mercator,
        "polarstereographic" | "stereographicnorthpole" | "stereographicsouthpole" => Method::PolarStereographic,
        _ => return Err(format!("projection {name}")),
    })
}

fn angle_unit(geographic: &Node) -> Result<f64, String> {
    let radians = geographic.child("UNIT").and_then(|node| node.numbers.first().copied());
    let degrees = radians.unwrap_or(1.0_f64.to_radians()).to_degrees();
    // Writers give the factor with ten to sixteen digits.
    if (degrees - 1.0).abs() < 1.0e-9 { Ok(1.0) } else { Err(format!("angles in units of {degrees} degrees")) }
}

/// Degrees east of Greenwich, whatever the unit of other angles.
fn prime_meridian(geographic: &Node) -> f64 {
    geographic.child("PRIMEM").and_then(|node| node.numbers.first().copied()).unwrap_or(0.0)
}

fn datum(geographic: &Node) -> Result<Datum, String> {
    angle_unit(geographic)?;
    let node = geographic.child("DATUM").ok_or("no datum named")?;
    let name = node.texts.first().map_or("", String::as_str);
    if let Some(datum) = datum_named(name) {
        return Ok(datum);
    }
    let ellipsoid = node.child("SPHEROID").or_else(|| node.child("ELLIPSOID")).map(|node| node.numbers.as_slice());
    match (node.child("TOWGS84"), ellipsoid) {
        (Some(shift), Some(&[semi_major_m, inverse_flattening, ..])) if matches!(shift.numbers.len(), 3 | 7) => {
            Ok(Datum::Shifted { semi_major_m, inverse_flattening, to_wgs84: shift.numbers.clone() })
        }
        _ => Err(format!("on datum {name}, whose shift to WGS 84 is not known")),
    }
}
