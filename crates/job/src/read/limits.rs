//! `[limits]`: what the simulator cannot exceed.

use terrain::ModuleGrid;

use crate::bounds::{COUNT_MAX, PER_MODULE_MAX, WINDOW_M};
use crate::entry::Section;
use crate::{Count, JobError, LimitsSpec, WindowLimit};

/// A square is two triangles: no load module has fewer.
const TRIANGLES_MIN: u32 = 2;

pub(super) fn read(limits: &Section, grid: &ModuleGrid, side_m: f64) -> Result<LimitsSpec, JobError> {
    let count = match limits.optional("count") {
        Some(entry) => entry.word(&[("triangles", Count::Triangles), ("polygons", Count::Polygons)])?,
        None => Count::Triangles,
    };
    let per_load_module = match limits.optional("per_load_module") {
        Some(entry) => entry.whole_u32(TRIANGLES_MIN..=PER_MODULE_MAX as u32, "a number of triangles")?,
        None => 100,
    };
    let pool = limits.optional("pool").map_or(Ok(0), |entry| entry.whole(0..=COUNT_MAX, "a number of triangles"))?;
    let mean_per_load_module = match limits.optional("mean_per_load_module") {
        Some(entry) => {
            let (least, most) = (f64::from(TRIANGLES_MIN), PER_MODULE_MAX as f64);
            entry.number_in(least..=most, &format!("a number of triangles from {least} to {most}"))?
        }
        None => 32.0,
    };
    let limit = match limits.optional("per_4km_square") {
        Some(entry) => entry.whole_u32(TRIANGLES_MIN..=COUNT_MAX as u32, "a number of triangles")?,
        None => 4096,
    };
    // Where 4 km is no whole number of load modules the window is the next larger one: what holds there holds in it.
    let side = (WINDOW_M / side_m).ceil() as u32;
    let window = WindowLimit { limit, rows: side.min(grid.rows), cols: side.min(grid.cols) };
    Ok(LimitsSpec { count, per_load_module, pool, mean_per_load_module, window })
}
