//! Systems by the names that files and jobs have for them.

use super::system::{self, Crs};
use super::wkt;

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
    pub fn from_wkt(text: &str) -> Result<Self, String> {
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
