//! Coordinate reference systems: by EPSG code, by well-known text, by GeoKeys; and from one to another.
//!
//! A system is a PROJ definition that `proj4rs` computes. Only systems whose datum is known are taken: one that
//! agrees with WGS 84 within a metre or so (WGS 84, NAD83, ETRS89 and their kin), or one with the parameters of a
//! shift, which is [`Crs::remark`]ed. A datum that needs a grid of shifts is refused by name.

mod system;
pub use system::Crs;
mod geokeys;
mod parameters;
pub(crate) mod vertical;
mod wkt;
pub(crate) use geokeys::GeoKeys;

impl Crs {
    /// The system with an EPSG code.
    ///
    /// # Errors
    /// In words, what is wrong with it, when the code is not known or its system cannot be computed.
    pub fn from_epsg(code: u32) -> Result<Self, String> {
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
