//! `survey/r02c03.curve`: what more points would gain in one tile. Private to this project.

use std::path::Path;

use terrain::GainCurve;

use crate::frame::{Kind, malformed};
use crate::{DatabaseError, Stamp, codec, frame};

/// The bytes of a curve file.
///
/// # Panics
/// When the gain rises along the runs.
pub fn encode_curve(stamp: &Stamp, curve: &GainCurve) -> Vec<u8> {
    assert!(curve.is_descending(), "a gain curve runs from the best point to the worst");
    frame::seal(Kind::Curve, stamp, &codec::encode(curve))
}

/// The curve whose file, at `path`, has these bytes.
///
/// # Errors
/// When the file is not as it was written.
pub fn decode_curve(path: &Path, bytes: &[u8]) -> Result<(Stamp, GainCurve), DatabaseError> {
    let (stamp, payload) = frame::open(Kind::Curve, path, bytes)?;
    let curve: GainCurve = codec::decode(payload).map_err(|what| malformed(path, what))?;
    if curve.is_descending() {
        return Ok((stamp, curve));
    }
    Err(malformed(path, "found a gain that rises, expected runs from the best point to the worst"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::samples;

    fn decode(bytes: &[u8]) -> Result<(Stamp, GainCurve), DatabaseError> {
        decode_curve(Path::new("r00c01.curve"), bytes)
    }

    #[test]
    fn a_curve_survives_its_file() {
        let (stamp, curve) = (samples::stamp(), samples::curve());
        assert_eq!(decode(&encode_curve(&stamp, &curve)).unwrap(), (stamp, curve));
    }

    #[test]
    fn every_damage_is_an_error() {
        let bytes = encode_curve(&samples::stamp(), &samples::curve());
        samples::check_every_damage(&bytes, |bytes| decode(bytes).is_err());
    }
}
