//! `survey/r02c03.curve`: what more points would gain in one tile. Private to this project.

use std::path::Path;

use serde::{Deserialize, Serialize};
use terrain::{GainCurve, GainRun, ModuleId, TileId};

use crate::frame::{Kind, malformed};
use crate::{DatabaseError, Stamp, codec, frame};

/// [`GainCurve`] as it lies on disk.
#[derive(Serialize, Deserialize)]
struct CurveOnDisk {
    tile: (u32, u32),
    runs: Vec<RunOnDisk>,
    squares: Vec<(i32, f64)>,
}

#[derive(Serialize, Deserialize)]
struct RunOnDisk {
    module: (u32, u32),
    bin: i32,
    cost: u32,
}

/// The bytes of a curve file.
///
/// # Panics
/// When the gain rises along the runs.
pub fn encode_curve(stamp: &Stamp, curve: &GainCurve) -> Vec<u8> {
    assert!(curve.is_descending(), "a gain curve runs from the best point to the worst");
    let run = |run: &GainRun| RunOnDisk { module: (run.module.row, run.module.col), bin: run.bin, cost: run.cost };
    let on_disk = CurveOnDisk {
        tile: (curve.tile.row, curve.tile.col),
        runs: curve.runs.iter().map(run).collect(),
        squares: curve.squares.clone(),
    };
    frame::seal(Kind::Curve, stamp, &codec::encode(&on_disk))
}

/// The curve whose file, at `path`, has these bytes.
///
/// # Errors
/// When the file is not as it was written.
pub fn decode_curve(path: &Path, bytes: &[u8]) -> Result<(Stamp, GainCurve), DatabaseError> {
    let (stamp, payload) = frame::open(Kind::Curve, path, bytes)?;
    let on_disk: CurveOnDisk = codec::decode(payload).map_err(|what| malformed(path, what))?;
    let run = |run: RunOnDisk| GainRun {
        module: ModuleId { row: run.module.0, col: run.module.1 },
        bin: run.bin,
        cost: run.cost,
    };
    let tile = TileId { row: on_disk.tile.0, col: on_disk.tile.1 };
    let curve = GainCurve { tile, runs: on_disk.runs.into_iter().map(run).collect(), squares: on_disk.squares };
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
