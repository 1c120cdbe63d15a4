//! A system that can be computed with: its PROJ definition, and places from one to another.

use proj4rs::Proj;
use proj4rs::transform::transform;

use super::datums::datum_of_system;

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
        let crs = Self::new(definition, format!("EPSG:{code}"), Some(code))?;
        let is_three_dimensional = known.wkt.contains("CS[ellipsoidal,3]");
        Ok(Self { ellipsoidal: is_three_dimensional.then(|| datum_of_system(code)).flatten(), ..crs })
    }

    /// A system from its PROJ definition.
    pub(super) fn new(definition: String, name: String, epsg: Option<u32>) -> Result<Self, String> {
        let definition = with_known_datum(&definition)?;
        let remark = remark(&definition);
        let proj = Proj::from_proj_string(&definition).map_err(|error| {
            let projection = definition.split_whitespace().find_map(|word| word.strip_prefix("+proj="));
            format!("projection {} ({error})", projection.unwrap_or("without a name"))
        })?;
        if proj.is_geocent() {
            return Err("geocentric".into());
        }
        if !proj.is_normalized_axis() {
            return Err("a system whose axes do not run east and north".into());
        }
        Ok(Self { epsg, name, definition, remark, vertical: None, ellipsoidal: None, proj })
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
        let mut place = if self.is_geographic() { (x.to_radians(), y.to_radians(), 0.0) } else { (x, y, 0.0) };
        transform(&self.proj, &other.proj, &mut place).ok()?;
        let (x, y, _) = place;
        let [x, y] = if other.is_geographic() { [x.to_degrees(), y.to_degrees()] } else { [x, y] };
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

fn remark(definition: &str) -> Option<String> {
    let shift = definition.split_whitespace().find_map(|word| word.strip_prefix("+towgs84="));
    let shifts = shift.is_some_and(|shift| shift.split(',').any(|number| number.parse() != Ok(0.0)));
    let named = SHIFTED.iter().any(|datum| definition.contains(datum));
    (shifts || named).then(|| "its datum is shifted to WGS 84 by a few parameters, good to some metres".to_owned())
}
