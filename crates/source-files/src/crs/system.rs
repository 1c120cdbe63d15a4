//! A system that can be computed with: its PROJ definition, and places from one to another.

use proj4rs::Proj;
use proj4rs::transform::transform;

use super::datums::datum_of_system;
use super::shifts;
use super::wkt_nodes::geographic_code;

/// A coordinate reference system with everything needed to compute with it.
#[derive(Clone)]
pub struct Crs {
    epsg: Option<u32>,
    name: String,
    definition: String,
    remark: Option<String>,
    /// The heights of a compound system.
    vertical: Option<Vertical>,
    /// What heights of a system of three dimensions are above.
    ellipsoidal: Option<String>,
    /// Degrees east of Greenwich from which its longitudes count; 0 for a projected system, in which the library adds
    /// them.
    meridian: f64,
    proj: Proj,
}

/// What a compound system says of heights.
#[derive(Clone, Debug)]
pub(super) struct Vertical {
    /// Metres in a unit of them.
    pub unit_m: f64,
    /// What they are measured from, where that is known.
    pub datum: Option<String>,
}

impl std::fmt::Debug for Crs {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} ({})", self.name, self.definition)
    }
}

/// Two systems are one when their definitions are.
impl PartialEq for Crs {
    fn eq(&self, other: &Self) -> bool {
        self.definition == other.definition
    }
}

/// Datums that PROJ's definitions name and that lie within a metre or two of WGS 84.
const NEAR_WGS84: [&str; 2] = ["+datum=WGS84", "+datum=NAD83"];
/// Datums that PROJ's definitions name and that have the parameters of a shift.
const SHIFTED: [&str; 7] = [
    "+datum=GGRS87",
    "+datum=potsdam",
    "+datum=carthage",
    "+datum=hermannskogel",
    "+datum=ire65",
    "+datum=nzgd49",
    "+datum=OSGB36",
];

/// Meridians that PROJ's definitions name, in degrees east of Greenwich, as the EPSG registry has them.
const MERIDIANS: [(&str, f64); 13] = [
    ("lisbon", -9.131_906_111_111),
    ("paris", 2.337_229_166_667),
    ("bogota", -74.080_916_666_667),
    ("madrid", -3.687_938_888_889),
    ("rome", 12.452_333_333_333),
    ("bern", 7.439_583_333_333),
    ("jakarta", 106.807_719_444_444),
    ("ferro", -17.666_666_666_667),
    ("brussels", 4.367_975),
    ("stockholm", 18.058_277_777_778),
    ("athens", 23.716_337_5),
    ("oslo", 10.722_916_666_667),
    ("copenhagen", 12.577_88),
];

impl Crs {
    /// Longitude and latitude in degrees on WGS 84.
    pub fn wgs84() -> Self {
        Self::horizontal(4326).expect("every table of systems has this one")
    }

    /// Metres in a plane that lies nowhere on Earth: that of heights whose system is not known.
    pub fn plane() -> Self {
        let anywhere = "+proj=tmerc +lat_0=0 +lon_0=0 +k=1 +x_0=0 +y_0=0 +datum=WGS84 +units=m";
        Self::new(anywhere.into(), "no coordinate system".into(), None).expect("a projection that is known")
    }

    /// The system of places on the ground with an EPSG code.
    ///
    /// # Errors
    /// In words, what is wrong with it, when the code is not known, stands for heights too, or cannot be computed.
    pub(super) fn horizontal(code: u32) -> Result<Self, String> {
        let known = known(code)?;
        if is_compound(&known) {
            return Err(format!("EPSG:{code}, a compound system, where one without heights is expected"));
        }
        // No grid of shifts means none at all: longitude and latitude are taken over as they are.
        let definition = known.proj4.replace(" +nadgrids=@null", "").replace(" +wktext", "");
        // The library knows the scale by this name only.
        let definition = definition.replace("+k_0=", "+k=");
        if known.wkt.starts_with("GEOGCS") && known.wkt.contains("UNIT[\"grad\"") {
            return Err(format!(
                "EPSG:{code}, whose angles are grads; bring it to degrees: gdalwarp or ogr2ogr -t_srs"
            ));
        }
        let is_shifted = !NEAR_WGS84.iter().any(|datum| definition.contains(datum));
        let geographic = if is_shifted { geographic_code(known.wkt) } else { None };
        let mut crs = Self::new(shifts::corrected(definition, code, geographic)?, format!("EPSG:{code}"), Some(code))?;
        crs.remark = crs.remark.map(|_| shifts::remark(geographic));
        let is_three_dimensional = known.wkt.contains("CS[ellipsoidal,3]");
        Ok(Self { ellipsoidal: is_three_dimensional.then(|| datum_of_system(code)).flatten(), ..crs })
    }

    /// A system from its PROJ definition.
    pub(super) fn new(definition: String, name: String, epsg: Option<u32>) -> Result<Self, String> {
        let definition = with_known_datum(&definition)?;
        let remark = remark(&definition);
        let (computed, meridian) = counted_from(&definition)?;
        let proj = Proj::from_proj_string(&computed).map_err(|error| {
            let projection = definition.split_whitespace().find_map(|word| word.strip_prefix("+proj="));
            format!("projection {} ({error})", projection.unwrap_or("without a name"))
        })?;
        if proj.is_geocent() {
            return Err("geocentric".into());
        }
        if !proj.is_normalized_axis() {
            return Err("a system whose axes do not run east and north".into());
        }
        let meridian = if proj.is_latlong() { meridian } else { 0.0 };
        Ok(Self { epsg, name, definition, remark, vertical: None, ellipsoidal: None, meridian, proj })
    }

    /// The same with heights, as a compound system says.
    pub(super) fn with_vertical(self, vertical: Vertical) -> Self {
        Self { vertical: Some(vertical), ..self }
    }

    /// Its EPSG code, where it has one.
    pub fn epsg(&self) -> Option<u32> {
        self.epsg
    }

    /// Its name for people: `EPSG:32611`, or what the file calls it.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Whether coordinates are degrees of longitude and latitude.
    pub fn is_geographic(&self) -> bool {
        self.proj.is_latlong()
    }

    /// Metres in one unit of its coordinates; `None` for degrees.
    pub fn unit_m(&self) -> Option<f64> {
        (!self.is_geographic()).then(|| self.proj.to_meter())
    }

    /// Metres in a unit of heights, where it is a compound system, which says so.
    pub(crate) fn vertical_unit_m(&self) -> Option<f64> {
        self.vertical.as_ref().map(|vertical| vertical.unit_m)
    }

    /// What heights are measured from, where it is a system of heights, too, that says so.
    pub(crate) fn vertical_datum(&self) -> Option<&str> {
        self.vertical.as_ref().map_or(self.ellipsoidal.as_deref(), |vertical| vertical.datum.as_deref())
    }

    /// What a person should know about its datum.
    pub fn remark(&self) -> Option<&str> {
        self.remark.as_deref()
    }

    /// Where a place of this system lies in another. Degrees are longitude, then latitude. `None` outside either's
    /// range.
    pub fn to(&self, other: &Crs, [x, y]: [f64; 2]) -> Option<[f64; 2]> {
        if self == other {
            return Some([x, y]);
        }
        let [x, y] = self.refined([x, y]);
        let longitude = x + self.meridian;
        let mut place = if self.is_geographic() { (longitude.to_radians(), y.to_radians(), 0.0) } else { (x, y, 0.0) };
        transform(&self.proj, &other.proj, &mut place).ok()?;
        let (x, y, _) = place;
        let [x, y] = if other.is_geographic() { [x.to_degrees() - other.meridian, y.to_degrees()] } else { [x, y] };
        (x.is_finite() && y.is_finite()).then_some([x, y])
    }

    /// The place to ask the library for, so that it answers with the longitude and latitude of the place wanted: its
    /// inverse of Lambert's azimuthal projection is a millimetre or two off, which shows on the way back.
    fn refined(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        if self.proj.projname() != "laea" {
            return [x, y];
        }
        let mut there_and_back = (x, y, 0.0);
        let degrees = Proj::from_proj_string("+proj=longlat +ellps=GRS80 +towgs84=0,0,0");
        let Ok(degrees) = degrees else { return [x, y] };
        let went = transform(&self.proj, &degrees, &mut there_and_back)
            .and_then(|()| transform(&degrees, &self.proj, &mut there_and_back));
        match went {
            Ok(()) => [2.0 * x - there_and_back.0, 2.0 * y - there_and_back.1],
            Err(_) => [x, y],
        }
    }

    /// The UTM zone on WGS 84 in which a place in degrees lies, the exceptions of Norway and Svalbard left out.
    ///
    /// # Errors
    /// In words, where there is no zone: nearer to a pole than 84 degrees north or 80 south.
    pub fn utm_at([longitude, latitude]: [f64; 2]) -> Result<Self, String> {
        if !(-80.0..=84.0).contains(&latitude) || 360.0 < longitude.abs() {
            return Err(format!("UTM reaches from 80 south to 84 north, not to {latitude:.3}, {longitude:.3}"));
        }
        let zone = ((longitude + 180.0).rem_euclid(360.0) / 6.0).floor() as u32 + 1;
        Self::horizontal(if latitude < 0.0 { 32_700 } else { 32_600 } + zone)
    }
}

/// What an EPSG code stands for.
///
/// # Errors
/// In words, when it is not known.
pub(super) fn known(code: u32) -> Result<crs_definitions::Def, String> {
    let known = u16::try_from(code).ok().and_then(crs_definitions::from_code);
    known.ok_or_else(|| "a code that is not in the table of systems".to_owned())
}

/// Whether a code stands for places and heights together.
pub(super) fn is_compound(known: &crs_definitions::Def) -> bool {
    known.wkt.starts_with("COMPD_CS")
}

/// The definition with its shift to WGS 84 stated, and with the accurate transverse Mercator.
fn with_known_datum(definition: &str) -> Result<String, String> {
    // Web Mercator, and what else is computed on a sphere from places on an ellipsoid.
    if definition.contains("+R=") || definition.contains("+a=6378137 +b=6378137") {
        return Ok(definition.to_owned());
    }
    // Under its old name the library still has the short series, which is good for some zones only.
    let known = definition.replace("+proj=tmerc", "+proj=etmerc");
    let has = |words: &[&str]| words.iter().any(|word| known.contains(word));
    if has(&["+nadgrids", "+datum=NAD27"]) {
        return Err("on a datum that needs a grid of shifts".into());
    }
    if has(&NEAR_WGS84) || has(&SHIFTED) || has(&["+towgs84"]) {
        return Ok(known);
    }
    if has(&["+datum="]) {
        return Err("on a datum without a known shift to WGS 84".into());
    }
    if has(&["+ellps=GRS80", "+ellps=WGS84"]) {
        return Ok(known.replace(" +no_defs", "") + " +towgs84=0,0,0");
    }
    Err("on a datum without a known shift to WGS 84".into())
}

fn word_of<'a>(definition: &'a str, key: &str) -> Option<&'a str> {
    definition.split_whitespace().find_map(|word| word.strip_prefix(key))
}

/// A definition with the flattening of its ellipsoid where it has both axes instead: the library takes that for the
/// part of the lesser axis, not of the greater, with which transverse Mercator is tens of metres off.
fn with_flattening(definition: &str) -> String {
    let is = |words: [&str; 2]| words.iter().any(|word| definition.split_whitespace().any(|other| other == *word));
    let axis = |key: &str| word_of(definition, key).and_then(|axis| axis.parse::<f64>().ok());
    let inverse = match (axis("+a="), axis("+b=")) {
        (Some(greater), Some(lesser)) if lesser < greater => greater / (greater - lesser),
        _ if is(["+ellps=clrk66", "+datum=NAD27"]) => 294.978_698_213_898_2,
        _ if is(["+ellps=mod_airy", "+datum=ire65"]) => 299.324_964_6,
        _ => return definition.to_owned(),
    };
    format!("{definition} +rf={inverse}")
}

/// A definition as the library is to have it, and the degrees east of Greenwich from which its longitudes count. The
/// library takes a meridian for radians, also where it knows its degrees by a name; and it leaves it out where nothing
/// is projected.
fn counted_from(definition: &str) -> Result<(String, f64), String> {
    let definition = with_flattening(definition);
    let Some(stated) = word_of(&definition, "+pm=") else { return Ok((definition, 0.0)) };
    let named = MERIDIANS.iter().find(|(name, _)| *name == stated).map(|(_, degrees)| *degrees);
    let degrees = named.or_else(|| stated.parse().ok()).filter(|degrees: &f64| degrees.abs() <= 180.0);
    let degrees = degrees.ok_or_else(|| format!("counted from the meridian {stated}, which is not known"))?;
    Ok((definition.replace(&format!("+pm={stated}"), &format!("+pm={}", degrees.to_radians())), degrees))
}

fn remark(definition: &str) -> Option<String> {
    let shift = definition.split_whitespace().find_map(|word| word.strip_prefix("+towgs84="));
    let is_shifted = shift.is_some_and(|shift| shift.split(',').any(|number| number.parse() != Ok(0.0)));
    let named = SHIFTED.iter().any(|datum| definition.contains(datum));
    (is_shifted || named).then(|| shifts::remark(None))
}
