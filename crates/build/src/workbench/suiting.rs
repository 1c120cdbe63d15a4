//! The system, the spacing and the grid that suit rasters by themselves.

use crate::CompileError;
use crate::ground::{GroundError, covered, utm_of};
use source_files::{Crs, RasterFrame};
use terrain::{GridFrame, PostRect, Spacing};

/// Posts of every grid divide this, in metres: points on outer borders stand so far apart unless a job says otherwise.
const BORDER_STEP_M: f64 = 125.0;

/// The working grid that suits a raster by itself.
pub(crate) struct SuitingGrid {
    pub crs: Crs,
    pub grid: GridFrame,
    /// Its posts: the largest rectangle inside the raster.
    pub rect: PostRect,
}

/// The grid that an area over one raster would have, without load modules: system and spacing are the same, and the
/// rectangle ends where the raster does, to a 256th of its longer side.
///
/// # Errors
/// When there is no such grid; the hint is a command that makes a raster that needs none.
pub(crate) fn suiting_grid(frame: &RasterFrame) -> Result<SuitingGrid, CompileError> {
    const STEPS: u32 = 256;
    let alone = std::slice::from_ref(frame);
    let refused = |none: job::NoArea| GroundError::Impossible {
        key: frame.path.display().to_string(),
        found: format!("posts that are not square ones in metres, and {}", none.found),
        expected: "a raster that can be resampled to such".into(),
        hint: cut_hint(frame),
    };
    let crs = area_crs(alone).map_err(refused)?;
    let spacing = spacing_for(alone, &crs);
    let posts = f64::from((frame.rows.max(frame.cols) / STEPS).max(1));
    let (origin_m, size_m) = covered(alone, &crs, spacing, spacing.metres() * posts).map_err(refused)?;
    let [cols, rows] = size_m.map(|metres| (metres / spacing.metres()).round() as usize + 1);
    let grid = GridFrame { origin_east_m: origin_m[0], origin_north_m: origin_m[1], spacing };
    Ok(SuitingGrid { crs, grid, rect: PostRect::of_size(rows, cols) })
}

/// A command that cuts a part out of the middle of a raster.
fn cut_hint(frame: &RasterFrame) -> String {
    /// Degrees to either side.
    const HALF: f64 = 0.25;
    let path = frame.path.display();
    let middle = frame.crs.to(&Crs::wgs84(), frame.place(frame.rows / 2, frame.cols / 2));
    let zone = middle.and_then(|middle| Some((middle, Crs::utm_at(middle).ok()?.epsg()?)));
    let Some(([east, north], epsg)) = zone else {
        return format!("resample a part of it: gdalwarp -t_srs EPSG:32611 -tr 25 25 -r bilinear {path} part.tif");
    };
    let [west, south, east, north] = [east - HALF, north - HALF, east + HALF, north + HALF].map(short_degrees);
    format!(
        "cut a part, as its middle: gdalwarp -t_srs EPSG:{epsg} -te_srs EPSG:4326 -te {west} {south} {east} {north} \
         -tr 125 125 -r bilinear {path} part.tif"
    )
}

fn short_degrees(degrees: f64) -> f64 {
    (degrees * 100.0).round() / 100.0
}

/// The rasters' own system where all share one in true metres; else the UTM zone of their middle.
pub(crate) fn area_crs(frames: &[RasterFrame]) -> Result<Crs, job::NoArea> {
    const WEB_MERCATOR: u32 = 3857;
    let first = &frames[0].crs;
    let shared = frames.iter().all(|frame| frame.crs == *first);
    let is_on_ground = first.epsg().is_some_and(|code| code != WEB_MERCATOR) || *first == Crs::plane();
    let metric = first.unit_m() == Some(1.0) && is_on_ground;
    if shared && metric { Ok(first.clone()) } else { utm_of(frames) }
}

/// Metres between posts of the finest raster.
pub(crate) fn posts_m(frames: &[RasterFrame], crs: &Crs) -> f64 {
    let metres = |frame: &RasterFrame| {
        let (row, col) = (frame.rows / 2, frame.cols / 2);
        let places = [(row, col), (row, col + 1), (row + 1, col)].map(|(row, col)| {
            let [east, north] = frame.south_west;
            let place = [east + f64::from(col) * frame.spacing[0], north + f64::from(row) * frame.spacing[1]];
            frame.crs.to(crs, place)
        });
        let [Some(a), Some(b), Some(c)] = places else { return None };
        let apart = |p: [f64; 2], q: [f64; 2]| ((p[0] - q[0]).powi(2) + (p[1] - q[1]).powi(2)).sqrt();
        // Posts of a degree grid are closer east to west; what lies between the two keeps the detail of both.
        Some((apart(a, b) * apart(a, c)).sqrt())
    };
    frames.iter().filter_map(metres).fold(f64::INFINITY, f64::min)
}

/// The spacing nearest to that of the finest raster that divides the border step and is a multiple of 1/16 m. Between
/// posts that lie far apart it is finer: a load module has few of them, and a grid as coarse as they are would cut off
/// every summit between its own (measured: half the RMS residual at posts 77 m apart).
pub(crate) fn spacing_for(frames: &[RasterFrame], crs: &Crs) -> Spacing {
    const FAR_APART_M: f64 = 40.0;
    const FINER: f64 = 1.5;
    let wanted = posts_m(frames, crs);
    let fits = |parts: u32| {
        let metres = BORDER_STEP_M / f64::from(parts);
        Spacing::from_metres(metres).filter(|spacing| spacing.metres() * f64::from(parts) == BORDER_STEP_M)
    };
    let ratio = |spacing: &Spacing| (spacing.metres() / wanted).max(wanted / spacing.metres());
    let mut all = (1..=2000).filter_map(fits);
    let found = match FAR_APART_M < wanted {
        true => all.find(|spacing| FINER * spacing.metres() <= wanted),
        false => all.min_by(|a, b| ratio(a).total_cmp(&ratio(b))),
    };
    found.expect("some part of the border step is fine enough")
}
