//! Heights and classes of the whole area on a fine regular grid: what the page shades distant ground with, and casts
//! shadows by.
//!
//! As bytes: heights across and up, then heights along the side of a load module less one (u32 each), the lowest
//! height and the step between numbers in metres (f32 each); the heights as such numbers (u16), row by row from the
//! south-west; the class at each (u8).

use std::sync::Arc;

use axum::extract::State;
use axum::http::StatusCode;
use axum::response::{IntoResponse, Response};
use load_module_reader::{Area, Block, ReadError};

use super::area::Viewed;
use crate::viewer::plain::{FAULT, bytes};

/// Heights that one texture of any browser holds: 1024 x 1024 and a few lines.
const HEIGHTS_MAX: u64 = 1_100_000;
/// Steps along the side of a load module, the finest first.
const STEPS: [u32; 6] = [20, 10, 8, 5, 4, 2];
/// Beside a height that is not there.
const NOWHERE: u8 = u8::MAX;

/// Answers with the relief of the area.
pub async fn answer(State(viewed): State<Arc<Viewed>>) -> Response {
    match tokio::task::spawn_blocking(move || read(&viewed.area)).await {
        Ok(Ok(found)) => bytes(found.into()),
        Ok(Err(error)) => (StatusCode::CONFLICT, error.to_string()).into_response(),
        Err(_) => (StatusCode::INTERNAL_SERVER_ERROR, FAULT).into_response(),
    }
}

fn steps_of(rows: u32, cols: u32) -> u32 {
    let heights = |steps: &u32| across(rows, *steps) * across(cols, *steps);
    STEPS.into_iter().find(|steps| heights(steps) <= HEIGHTS_MAX).unwrap_or(1)
}

fn across(modules: u32, steps: u32) -> u64 {
    u64::from(modules) * u64::from(steps) + 1
}

/// Reads the load modules row by row.
fn read(area: &Area) -> Result<Vec<u8>, ReadError> {
    let frame = area.frame();
    let steps = steps_of(frame.rows, frame.cols);
    let (wide, high) = (across(frame.cols, steps), across(frame.rows, steps));
    let step_m = frame.side_m() / f64::from(steps);
    let (mut heights, mut classes) = (Vec::new(), Vec::new());
    for row in 0..frame.rows {
        let ground = area.load(Block { south: row, west: 0, north: row + 1, east: frame.cols })?;
        let is_last = row + 1 == frame.rows;
        for line in 0..steps + u32::from(is_last) {
            let north = frame.origin_m[1] + f64::from(row * steps + line) * step_m;
            for place in 0..wide {
                let sample = ground.sample([frame.origin_m[0] + place as f64 * step_m, north]);
                heights.push(sample.as_ref().map_or(f64::NAN, |sample| sample.height_m));
                classes.push(sample.map_or(NOWHERE, |sample| sample.class));
            }
        }
    }
    let low = heights.iter().copied().fold(f64::INFINITY, f64::min);
    let top = heights.iter().copied().fold(low, f64::max);
    let unit = ((top - low) / f64::from(u16::MAX)).max(1e-3);
    let mut out: Vec<u8> = [wide as u32, high as u32, steps].into_iter().flat_map(u32::to_le_bytes).collect();
    out.extend([low, unit].into_iter().flat_map(|metres| (metres as f32).to_le_bytes()));
    // Not a number becomes 0.
    out.extend(heights.iter().flat_map(|height| (((height - low) / unit).round() as u16).to_le_bytes()));
    out.extend(classes);
    Ok(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_relief_is_as_fine_as_one_texture_holds() {
        assert_eq!(steps_of(8, 8), 20);
        assert_eq!(steps_of(100, 100), 10);
        assert_eq!(steps_of(4000, 4000), 1);
    }
}
