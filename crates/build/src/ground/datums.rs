//! What heights are measured from: one datum for the product, and grids to bring sources to it.

use std::sync::Arc;

use job::{Job, SourceFile};
use source_files::{Crs, DatumShift, DemFile, Geoid, plain_datum};

use crate::ground::GroundError;
use crate::ground::area::GamingArea;
use crate::ground::source::area_crs;

/// What the heights of a file are measured from: as the job says, else as the file does.
pub fn datum_of(file: &SourceFile, opened: &DemFile) -> Option<String> {
    file.said.vertical_datum.clone().or_else(|| opened.vertical_datum().map(str::to_owned))
}

/// How each source's heights become those of the datum that is wanted, and what a person should know.
pub struct Datums {
    /// In the order of the sources; `None` where they are as wanted, or unknown.
    pub shifts: Vec<Option<DatumShift>>,
    pub warnings: Vec<String>,
}

/// Finds a way to one datum for all sources; tells of those whose datum is unknown.
///
/// # Errors
/// When a source is above another datum than is wanted and the job names no grid for the way, or a grid cannot be used.
pub fn judge_datums(
    job: &Job,
    area: &GamingArea,
    datums: &[(&SourceFile, Option<String>)],
) -> Result<Datums, GroundError> {
    let mut found = Datums { shifts: vec![None; datums.len()], warnings: Vec::new() };
    let known = datums.iter().find_map(|(_, datum)| datum.clone());
    // Where no source says anything, the job's word stands for all, unless it names grids to bring one to another.
    if known.is_none() && job.dem.geoids.is_empty() {
        return Ok(found);
    }
    let Some(wanted) = job.dem.vertical_datum.clone().or(known) else { return Ok(found) };
    let mut grids = Grids { job, area, read: Vec::new() };
    for (shift, (file, datum)) in found.shifts.iter_mut().zip(datums) {
        match datum {
            Some(datum) if is_taken_as_equal(job, datum, &wanted) => found.warnings.push(format!(
                "{}: heights above {datum} are taken as above {wanted}: the two geoids differ by 0.5 m RMS and 10 m at \
                 most; grids of both in dem.geoids bring one to the other",
                file.written
            )),
            Some(datum) if plain_datum(datum) != plain_datum(&wanted) => {
                *shift = Some(grids.shift(file, datum, &wanted)?);
            }
            Some(_) => {}
            None => found.warnings.push(format!(
                "{}: it does not say what its heights are measured from; they are carried as they are",
                file.path.display()
            )),
        }
    }
    Ok(found)
}

/// Whether two datums are the geoids EGM96 and EGM2008, for neither of which the job names a grid.
fn is_taken_as_equal(job: &Job, datum: &str, wanted: &str) -> bool {
    let pair = [plain_datum(datum), plain_datum(wanted)];
    let has_grid = |name: &String| job.dem.geoids.iter().any(|geoid| plain_datum(&geoid.datum) == *name);
    (pair == ["egm96", "egm2008"] || pair == ["egm2008", "egm96"]) && !pair.iter().any(has_grid)
}

/// The grids of a job, each read once.
struct Grids<'a> {
    job: &'a Job,
    area: &'a GamingArea,
    read: Vec<(String, Arc<Geoid>)>,
}

impl Grids<'_> {
    fn shift(&mut self, file: &SourceFile, from: &str, to: &str) -> Result<DatumShift, GroundError> {
        let (from_grid, to_grid) = (self.grid(file, from, (from, to))?, self.grid(file, to, (from, to))?);
        let shift = DatumShift { from: plain_datum(from), to: plain_datum(to), from_grid, to_grid };
        let crs = area_crs(self.job)?;
        if !shift.covers(&crs, &self.area.frame, self.area.rect) {
            return Err(GroundError::Impossible {
                key: "dem.geoids".into(),
                found: format!("grids that do not reach all of the area, from {from} to {to}"),
                expected: "grids that cover it".into(),
                hint: "a worldwide grid does, as egm96_15.gtx".into(),
            });
        }
        Ok(shift)
    }

    /// The grid of a datum; `None` for the ellipsoid, which needs none.
    fn grid(
        &mut self,
        file: &SourceFile,
        datum: &str,
        (from, to): (&str, &str),
    ) -> Result<Option<Arc<Geoid>>, GroundError> {
        let plain = plain_datum(datum);
        if plain.contains("ellipsoid") {
            return Ok(None);
        }
        if let Some((_, grid)) = self.read.iter().find(|(name, _)| *name == plain) {
            return Ok(Some(grid.clone()));
        }
        let Some(spec) = self.job.dem.geoids.iter().find(|geoid| plain_datum(&geoid.datum) == plain) else {
            return Err(GroundError::Impossible {
                key: "dem.vertical_datum".into(),
                found: format!("heights of {} above {from}, where {to} is wanted", file.written),
                expected: format!("one datum, or a geoid grid of {datum} to convert with"),
                hint: format!(
                    "name the grid: geoids = [{{ datum = \"{datum}\", file = \"….gtx\" }}] in [dem], or correct what \
                     the job says of the source"
                ),
            });
        };
        let (south, north) = latitudes(self.job, self.area)?;
        let grid = Arc::new(Geoid::read(&spec.file.path, south, north)?);
        self.read.push((plain, grid.clone()));
        Ok(Some(grid))
    }
}

/// The southernmost and northernmost latitude of the area, in degrees.
fn latitudes(job: &Job, area: &GamingArea) -> Result<(f64, f64), GroundError> {
    const STEPS: i32 = 32;
    let (crs, wgs84) = (area_crs(job)?, Crs::wgs84());
    let along = |low: i32, high: i32, step: i32| low + (i64::from(high - low) * i64::from(step) / 32) as i32;
    let rect = area.rect;
    let places = (0..=STEPS).flat_map(|step| {
        let (row, col) = (along(rect.south, rect.north, step), along(rect.west, rect.east, step));
        [(rect.south, col), (rect.north, col), (row, rect.west), (row, rect.east)]
    });
    let latitudes = places
        .filter_map(|(row, col)| crs.to(&wgs84, [area.frame.east_m(col), area.frame.north_m(row)]))
        .map(|[_, latitude]| latitude);
    let range = latitudes.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), at| (low.min(at), high.max(at)));
    Ok(range)
}
