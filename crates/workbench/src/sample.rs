//! The sample terrain as a raster, for other programs.

use std::path::Path;

use compiler::CompileError;
use source_files::{write_classes, write_heights};
use terrain::{GridFrame, PostRect, Spacing};

/// Writes the sample terrain as a GeoTIFF, and its classes as another where asked for; `size` is rows and columns of
/// posts, and no more than a band of rows is ever held.
///
/// # Errors
/// When a file cannot be written.
pub fn sample(
    seed: u64,
    (rows, cols): (usize, usize),
    spacing: Spacing,
    out: &Path,
    classes: Option<&Path>,
) -> Result<(), CompileError> {
    /// EPSG code and origin of the sample terrain: UTM 11 north, near Fort Irwin, as in the project's jobs.
    const PLACE: (u32, f64, f64) = (32_611, 505_000.0, 3_875_000.0);
    let (epsg, origin_east_m, origin_north_m) = PLACE;
    let frame = GridFrame { origin_east_m, origin_north_m, spacing };
    let rect = PostRect::of_size(rows, cols);
    write_heights(out, &frame, rect, epsg, |band| sample_terrain::heights(seed, band, spacing))?;
    if let Some(path) = classes {
        write_classes(path, &frame, rect, epsg, |band| sample_terrain::classes(seed, band, spacing))?;
    }
    Ok(())
}
