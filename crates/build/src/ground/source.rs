//! One source of heights: how a file of a job is read and decoded, and what a job says of several.

use std::sync::atomic::AtomicBool;

use job::{Job, SourceFile, SourceSaid, Voids};
use schedule::Workers;
use source_files::{
    Crs, DatumShift, DemFile, EdgeStep, Mosaic, MosaicRules, MosaicVoids, Raster, RasterFrame, Reading, WideMosaic,
    Windows,
};
use terrain::PostRect;

use crate::ground::GroundError;
use crate::ground::area::GamingArea;

/// Where heights come from.
pub enum Source {
    /// The built-in terrain, by its seed.
    Sample(u64),
    /// One raster on the area's own system.
    Raster(Box<Raster>),
    /// Any number of rasters.
    Mosaic(Box<Mosaic>),
    /// The same as [`Source::Raster`], read by window; it has no voids.
    Window(Box<Windows>),
    /// The same as [`Source::Mosaic`], read by window.
    Wide(Box<WideMosaic>),
}

/// What was decoded of one file that is used, or of several.
pub struct Decoded<S> {
    pub source: S,
    pub warnings: Vec<String>,
    /// Vertical accuracy of the least accurate, in metres.
    pub accuracy_m: Option<f64>,
    /// Lowest and highest height that was read, in metres.
    pub range_m: Option<(f64, f64)>,
    /// The same of posts that the area's own lie among.
    pub under_m: Option<(f64, f64)>,
}

/// The range of all of some ranges of heights, once each is brought to another datum.
pub fn raised(
    ranges_m: impl IntoIterator<Item = Option<(f64, f64)>>,
    shifts: &[Option<DatumShift>],
    (area, crs): (&GamingArea, &Crs),
) -> Option<(f64, f64)> {
    let each = ranges_m.into_iter().zip(shifts).filter_map(|(range_m, shift)| {
        let shift_m = shift.as_ref().map_or((0.0, 0.0), |shift| shift.range_m(crs, &area.frame, area.rect));
        range_m.map(|(low, high)| (low + shift_m.0, high + shift_m.1))
    });
    each.reduce(|(low, high), (lower, higher)| (low.min(lower), high.max(higher)))
}

pub fn nothing_reaches() -> GroundError {
    GroundError::Impossible {
        key: "dem.sources".into(),
        found: "no raster that reaches into the area".into(),
        expected: "one at least".into(),
        hint: "check area.crs and area.origin_m; `tiefort init FILES…` writes an area that fits".into(),
    }
}

/// What a job says of several sources.
pub fn mosaic_rules(job: &Job) -> MosaicRules {
    let fill_within = match job.dem.voids {
        Voids::FillWithinPosts(posts) | Voids::FillThenHole(posts) => posts,
        Voids::Fail | Voids::Hole => 0,
    };
    MosaicRules {
        resampling: job.dem.resampling,
        feather_m: job.dem.feather_m,
        voids: MosaicVoids { next_source: job.dem.next_source, fill_within },
    }
}

/// The system of the area.
///
/// # Errors
/// When it is not one that can be computed.
pub fn area_crs(job: &Job) -> Result<Crs, GroundError> {
    let impossible = |found: String| GroundError::Impossible {
        key: "area.crs".into(),
        found: format!("EPSG:{}: {found}", job.area.epsg),
        expected: "a projected system in metres that can be computed".into(),
        hint: "UTM zone 11 north on WGS 84 is EPSG:32611, zone 32 north EPSG:32632".into(),
    };
    let crs = Crs::from_epsg(job.area.epsg).map_err(impossible)?;
    match crs.unit_m() {
        Some(1.0) => Ok(crs),
        Some(unit_m) => Err(impossible(format!("its unit is {unit_m} m"))),
        None => Err(impossible("it is in degrees".into())),
    }
}

/// How a file is to be read, as the job says.
///
/// # Errors
/// When the job names a coordinate system that cannot be computed.
pub fn reading(file: &SourceFile, strict: bool) -> Result<Reading, GroundError> {
    let SourceSaid { crs, corner, height_unit_m, nodata, .. } = &file.said;
    let crs = crs.as_deref().map(|text| {
        Crs::named(text).map_err(|found| GroundError::Impossible {
            key: "dem.sources".into(),
            found: format!("crs of {}: {found}", file.written),
            expected: "a system that can be computed".into(),
            hint: "give a code, as crs = \"EPSG:4326\"".into(),
        })
    });
    let corner = corner.map(|[latitude, longitude]| [longitude, latitude]);
    Ok(Reading { crs: crs.transpose()?, corner, height_unit_m: *height_unit_m, nodata: *nodata, strict })
}

/// Decodes a window of a raster on all workers.
pub fn decode(file: &DemFile, window: PostRect, workers: &Workers, stop: &AtomicBool) -> Result<Raster, GroundError> {
    let chunks = file.chunks_of(window);
    let parts: Vec<&[u32]> = chunks.chunks(chunks.len().div_ceil(4 * workers.count()).max(1)).collect();
    let decoded =
        schedule::for_each_independent(&parts, workers, stop, |_, part| file.decode(part).map_err(GroundError::from));
    let decoded = decoded.map_err(|error| GroundError::from_schedule(&[], error))?;
    Ok(file.assemble(window, decoded.into_iter().flatten().collect())?)
}

/// What a person should know about a raster: heights that look like a sentinel that is not declared, and more.
pub fn warnings_of(frame: &RasterFrame, range_m: Option<(f64, f64)>, notes: &[String]) -> Vec<String> {
    const LOWEST_LAND_M: f64 = -450.0;
    const HIGHEST_LAND_M: f64 = 8900.0;
    const NOTES_MAX: usize = 5;
    let (path, crs) = (frame.path.display(), &frame.crs);
    let mut warnings = Vec::new();
    if let Some((lowest, highest)) = range_m
        && (lowest < LOWEST_LAND_M || HIGHEST_LAND_M < highest)
    {
        warnings.push(format!(
            "{path}: heights run from {lowest} m to {highest} m, beyond any land on Earth; \
             a void marker without a nodata tag would look like that"
        ));
    }
    if crs.epsg() == Some(3857) {
        warnings.push(format!("{path}: EPSG:3857 metres are not ground metres away from the equator"));
    }
    warnings.extend(crs.remark().map(|remark| format!("{path}: {}: {remark}", crs.name())));
    warnings.extend(notes.iter().take(NOTES_MAX).cloned());
    if NOTES_MAX < notes.len() {
        warnings.push(format!("{path}: {} more of the same kind", notes.len() - NOTES_MAX));
    }
    warnings
}

/// What a person should know of a step between two rasters: what differs by less is noise of two measurements.
pub fn told<'a>(
    &EdgeStep { upper, lower, height_m }: &EdgeStep,
    frame: impl Fn(usize) -> &'a RasterFrame,
) -> Option<String> {
    const HEIGHT_MAX_M: f64 = 5.0;
    let [upper, lower] = [upper, lower].map(|place| frame(place).path.display());
    (HEIGHT_MAX_M < height_m).then(|| {
        format!(
            "{upper} ends in a step of {height_m:.1} m, beyond which {lower} goes on; dem.feather_m spreads it where \
             they overlap, and vertical_datum of each says what they are above"
        )
    })
}
