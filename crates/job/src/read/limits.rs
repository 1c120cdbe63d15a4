//! `[limits]`: what the simulator cannot exceed.

use terrain::ModuleGrid;

use crate::bounds::WINDOW_M;
use crate::entry::Section;
use crate::{JobError, LimitsSpec, WindowLimit};

pub(super) fn read(limits: &Section, grid: &ModuleGrid, side_m: f64) -> Result<LimitsSpec, JobError> {
    // Where 4 km is no whole number of load modules the window is the next larger one: what holds there holds in it.
    let side = (WINDOW_M / side_m).ceil() as u32;
    let window = WindowLimit {
        limit: limits.whole_u32("per_4km_square")?,
        rows: side.min(grid.rows),
        cols: side.min(grid.cols),
    };
    Ok(LimitsSpec {
        count: limits.word("count")?,
        per_load_module: limits.whole_u32("per_load_module")?,
        pool: limits.whole("pool")?,
        mean_per_load_module: limits.number("mean_per_load_module")?,
        window,
    })
}
