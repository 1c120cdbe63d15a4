//! Coordinate reference systems: by EPSG code, by well-known text, by GeoKeys; and from one to another.
//!
//! A system is a PROJ definition that `proj4rs` computes. Only systems whose datum is known are taken: one that
//! agrees with WGS 84 within a metre or so (WGS 84, NAD83, ETRS89 and their kin), or one with the parameters of a
//! shift, which is [`Crs::remark`]ed. A datum that needs a grid of shifts is refused by name.

mod system;
pub use system::Crs;
pub(crate) mod datums;
pub use datums::{plain_datum, vertical_code};
mod geokeys;
mod parameters;
mod shifts;
pub(crate) mod vertical;
mod wkt;
mod wkt_nodes;
use datums::datum_of_system;
pub(crate) use geokeys::GeoKeys;
use system::Vertical;

/// Compound systems that are younger than the table of systems: codes of each, of its places and of its heights.
const COMPOUND: [(u16, u16, u16); 16] = [
    (9286, 4258, 5709),
    (9422, 4258, 9389),
    (9424, 4258, 5701),
    (9462, 7844, 9458),
    (9463, 7844, 5711),
    (9464, 4283, 5711),
    (9505, 4258, 5782),
    (9518, 4326, 3855),
    (9527, 4167, 4440),
    (9528, 4167, 7839),
    (9705, 4326, 5714),
    (9707, 4326, 5773),
    (9897, 2169, 5774),
    (9907, 4258, 5710),
    (9924, 4258, 7837),
    (10245, 4765, 8690),
];

impl Crs {
    /// The system with an EPSG code.
    ///
    /// # Errors
    /// In words, what is wrong with it, when the code is not known or its system cannot be computed.
    pub fn from_epsg(code: u32) -> Result<Self, String> {
        if let Some((_, places, heights)) = COMPOUND.iter().find(|(compound, ..)| u32::from(*compound) == code) {
            let vertical = Vertical { unit_m: vertical::unit_m(*heights)?, datum: datum_of_system((*heights).into()) };
            return Ok(Self::horizontal((*places).into())?.with_vertical(vertical));
        }
        let known = system::known(code)?;
        if system::is_compound(&known) { wkt::read(known.wkt) } else { Self::horizontal(code) }
    }

    /// The system that a well-known text describes: that of a `.prj` file, or of a GeoPackage.
    ///
    /// # Errors
    /// In words, what is wrong with it.
    pub(crate) fn from_wkt(text: &str) -> Result<Self, String> {
        wkt::read(text)
    }

    /// The same with heights above another datum: those of a vertical system by its EPSG code, or by its name and the
    /// unit that is spelled out.
    ///
    /// # Errors
    /// In words, what is wrong with it.
    #[cfg(feature = "geoparquet")]
    pub(crate) fn with_heights(self, code: Option<u32>, name: &str, unit_m: Option<f64>) -> Result<Self, String> {
        let of_code = code.and_then(|code| u16::try_from(code).ok()).map(vertical::unit_m);
        let unit_m = match (of_code, unit_m.filter(|unit_m| (1.0e-6..=1.0e6).contains(unit_m))) {
            (Some(Ok(unit_m)), _) | (_, Some(unit_m)) => unit_m,
            (Some(Err(found)), None) => return Err(found),
            (None, None) => return Err("one whose vertical part has no unit".into()),
        };
        let datum = code.map_or_else(|| datums::datum_in_name(name), datum_of_system);
        Ok(self.with_vertical(Vertical { unit_m, datum }))
    }

    /// The system that `text` names: `EPSG:32611`, or well-known text.
    ///
    /// # Errors
    /// In words, what is wrong with it.
    pub fn named(text: &str) -> Result<Self, String> {
        let code = text.trim().to_ascii_uppercase();
        match code.strip_prefix("EPSG:").map(str::parse) {
            Some(Ok(code)) => Self::from_epsg(code),
            Some(Err(_)) => Err("EPSG: without a number behind it".into()),
            None => Self::from_wkt(text),
        }
    }
}

#[cfg(test)]
mod tests;
