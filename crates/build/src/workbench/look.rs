//! A first look at rasters: what they are, and the area, grid and tiles that suit them.

use std::path::{Path, PathBuf};

use crate::CompileError;
use crate::ground::{GroundError, covered, rectangle_around};
use source_files::{
    Crs, DemFile, MosaicRules, MosaicVoids, RasterFrame, Reading, SourceError, Standing, WideMosaic, Windows,
    window_reaching,
};
use terrain::{GridFrame, PostRect, Resampling, Spacing};

use crate::workbench::heights::crs_named;
use crate::workbench::outlook::{Left, Sampled};
use crate::workbench::suiting::{area_crs, posts_m, spacing_for};

/// What a raster is.
#[derive(Clone, Debug)]
pub struct Seen {
    /// The file.
    pub path: PathBuf,
    /// Its format's name.
    pub format: &'static str,
    /// Columns and rows of posts.
    pub size: (u32, u32),
    /// Name of its coordinate system.
    pub crs: String,
    /// Between posts, in the system's units, east then north.
    pub spacing: [f64; 2],
    /// Whether those units are degrees.
    pub is_geographic: bool,
    /// Void posts.
    pub voids: usize,
    /// The value that can only mark voids, where the file has one and does not declare it; its posts count as void.
    pub undeclared: Option<f64>,
    /// Lowest and highest height in metres; `None` when all posts are void.
    pub range_m: Option<(f64, f64)>,
    /// Posts of it that are exactly 0 m high as those around them, as the sea is.
    pub at_sea_level: usize,
    /// What it says heights are measured from.
    pub vertical_datum: Option<String>,
    /// Vertical accuracy that it states, in metres.
    pub accuracy_m: Option<f64>,
    /// Damage that does not keep it from being read, and doubts about its datum.
    pub notes: Vec<String>,
    /// Whether the system was given to it, because it names none.
    pub crs_given: bool,
}

/// An area that suits some rasters.
#[derive(Clone, Debug)]
pub struct Suggestion {
    /// What each raster is, in the order given.
    pub seen: Vec<Seen>,
    /// EPSG code of the area's system.
    pub epsg: u32,
    /// East and north of the south-west post, in metres.
    pub origin_m: [f64; 2],
    /// Width and height in metres.
    pub size_m: [f64; 2],
    /// Width and height in metres of the rectangle around the rasters, in the area's system.
    pub around_m: [f64; 2],
    /// Metres between posts of the working grid.
    pub spacing_m: f64,
    /// Rows and columns of tiles.
    pub tiles: (u32, u32),
    /// Longitude and latitude of the middle, where the area is a part only: the files are too large for one area, or
    /// lie too far apart.
    pub part_around: Option<[f64; 2]>,
    /// Metres between posts of the finest raster, about.
    pub posts_m: f64,
    /// Posts of the area between several rasters, which none of them reaches.
    pub gap_posts: usize,
    looked: Looked,
}

/// What it takes to look at the ground again.
#[derive(Clone, Debug)]
struct Looked {
    crs: Crs,
    spacing: Spacing,
    frames: Vec<RasterFrame>,
    given: Option<String>,
}

/// Looks at the ground at most, to find how many triangles leave a residual.
const LOOKS_MAX: usize = 5;
/// Triangles of a load module that are tried for a residual: the least there can be, and the most a job may have.
const TRIANGLES_TRIED: [f64; 2] = [8.0, 20_000.0];

impl Suggestion {
    /// Load modules of the area.
    pub fn modules(&self) -> u64 {
        let [cols, rows] = self.size_m.map(|metres| (metres / SIDE_M).round() as u64);
        cols * rows
    }

    /// The RMS residual that so many triangles of a load module will leave, in metres, at the posts of the source where
    /// there is one, from a look at windows of the area; `None` where those have no heights.
    ///
    /// # Errors
    /// When a raster cannot be opened or decoded.
    pub fn rms_m(&self, triangles: u32) -> Result<Option<f64>, CompileError> {
        Ok(self.left(triangles)?.map(|left| left.fit_m.hypot(left.resampled_m)))
    }

    fn left(&self, triangles: u32) -> Result<Option<Left>, CompileError> {
        let (grid, rect, side_cells) = self.posts();
        let Looked { crs, frames, .. } = &self.looked;
        let sampled = Sampled { crs, grid, rect, side_cells, triangles: triangles as usize };
        let lowest_m: Vec<f64> = self.seen.iter().map(|seen| seen.range_m.map_or(0.0, |(low, _)| low)).collect();
        sampled.left(frames, &lowest_m, |index| self.open(index))
    }

    fn open(&self, index: usize) -> Result<DemFile, CompileError> {
        let seen = &self.seen[index];
        Ok(open(&seen.path, self.looked.given.as_deref(), seen.undeclared)?.0)
    }

    /// The posts of the area, and how many cells a load module has along a side.
    fn posts(&self) -> (GridFrame, PostRect, usize) {
        let modules = self.size_m.map(|metres| (metres / SIDE_M).round() as usize);
        let side_cells = (SIDE_M / self.spacing_m).round() as usize;
        let [origin_east_m, origin_north_m] = self.origin_m;
        let grid = GridFrame { origin_east_m, origin_north_m, spacing: self.looked.spacing };
        (grid, PostRect::of_size(modules[1] * side_cells + 1, modules[0] * side_cells + 1), side_cells)
    }

    /// Posts that no raster reaches, from headers alone; of an area too large for that, none.
    fn count_gaps(&self) -> Result<usize, CompileError> {
        const POSTS_MAX: usize = 64 << 20;
        const ROWS: usize = 64;
        let (grid, rect, _) = self.posts();
        if POSTS_MAX < rect.post_count() {
            return Ok(0);
        }
        let Looked { crs, frames, .. } = &self.looked;
        let reaching = (0..frames.len()).filter(|&index| window_reaching(&frames[index], crs, &grid, rect).is_some());
        let files = reaching.map(|index| self.open(index)).collect::<Result<Vec<_>, _>>()?;
        let used: Vec<(usize, f64)> = (0..files.len()).map(|index| (index, 0.0)).collect();
        let voids = MosaicVoids { next_source: true, fill_within: 0 };
        let rules = MosaicRules { resampling: Resampling::Bilinear, feather_m: 0.0, voids };
        let mosaic = WideMosaic::new(Windows::new(files, 0), &used, rules, (crs, &grid, rect))?;
        let strips = (rect.south..=rect.north).step_by(ROWS);
        let gaps = strips.map(|south| {
            let north = (south + ROWS as i32 - 1).min(rect.north);
            let reached = mosaic.reached(PostRect { south, north, ..rect });
            reached.standings.iter().filter(|standing| **standing == Standing::Gap).count()
        });
        Ok(gaps.sum())
    }

    /// Triangles of a load module that leave this RMS residual, about: from some looks, between which the logarithm of
    /// the residual is taken as straight over that of the triangles.
    ///
    /// # Errors
    /// As [`Suggestion::rms_m`].
    pub fn triangles_for(&self, rms_m: f64) -> Result<u32, CompileError> {
        let [least, most] = TRIANGLES_TRIED;
        let mut at = f64::from(TRIANGLES);
        let mut before: Option<[f64; 2]> = None;
        for _ in 0..LOOKS_MAX {
            let Some(Left { fit_m: left_m, resampled_m }) = self.left(at.round() as u32)? else { break };
            // What resampling costs no triangle mends: half of what is asked for is left to the fit at least.
            let rms_m = (rms_m * rms_m - resampled_m * resampled_m).max(rms_m * rms_m / 4.0).sqrt();
            if left_m <= 0.0 || (left_m / rms_m).ln().abs() < 0.03 {
                break;
            }
            // Twice the triangles leave half the residual, until two looks say otherwise.
            let slope = before.map_or(-1.0, |[triangles, left_before_m]| {
                ((left_m / left_before_m).ln() / (at / triangles).ln()).clamp(-2.0, -0.3)
            });
            before = Some([at, left_m]);
            let next = (at * ((rms_m / left_m).ln() / slope).exp()).clamp(least, most);
            if (next - at).abs() < 0.5 {
                break;
            }
            at = next;
        }
        Ok(at.round() as u32)
    }
}

/// Values that mark voids where a file does not say so: no land is as low, and none of 32,767 m is as high.
const MARKS: [f64; 7] = [-32768.0, -32767.0, -9999.0, -99999.0, 32767.0, f32::MIN as f64, f32::MAX as f64];
/// Triangles of a load module that are looked at first: the founding paper's mean.
const TRIANGLES: u32 = 32;

/// Width and height of an area that is a part of what there is, in metres, about.
const PART_M: f64 = 50_000.0;

/// Side of a load module that every job has unless it says otherwise, in metres.
const SIDE_M: f64 = 500.0;
/// Load modules along a side of a tile, about: the founding paper's.
const MODULES_A_TILE: f64 = 17.0;
/// Tiles along a side of a smaller area, so that workers find some that are not adjacent, as long as each has
/// [`MODULES_A_TILE_MIN`] load modules along its own.
const TILES_A_SIDE: u32 = 4;
const MODULES_A_TILE_MIN: u32 = 6;

/// Looks at rasters and finds the area that suits them. `given` is the system of those that name none.
///
/// # Errors
/// When one cannot be read, `given` is no system, none has a height, or not even two load modules each way fit inside
/// them.
pub fn look_at(paths: &[PathBuf], given: Option<&str>) -> Result<Suggestion, CompileError> {
    // One that no file needs is named rightly nonetheless.
    given.map_or(Ok(()), |given| crs_named(given).map(drop))?;
    let (mut seen, mut frames) = (Vec::<Seen>::new(), Vec::new());
    for path in paths {
        let (found, frame) = look(path, given)?;
        frames.push(frame);
        seen.push(found);
    }
    let impossible = |found: String, hint: String| {
        GroundError::Impossible {
            key: "FILES".into(),
            found,
            expected: "rasters that an area can be laid into".into(),
            hint,
        }
        .into()
    };
    if seen.iter().all(|seen| seen.range_m.is_none()) {
        let hint = "every post of theirs is void; look at what the files hold, and what marks their voids";
        return Err(impossible("no height at all".into(), hint.into()));
    }
    let none = |none: job::NoArea| impossible(none.found, none.hint);
    let crs = area_crs(&frames).map_err(none)?;
    let spacing = spacing_for(&frames, &crs);
    let (crs, spacing, (origin_m, size_m), part_around) = match covered(&frames, &crs, spacing, SIDE_M) {
        Ok(found) => (crs, spacing, found, None),
        Err(reason) => part(&frames[0]).ok_or(reason).map_err(none)?,
    };
    let epsg = crs.epsg().expect("systems with a code only are chosen");
    let modules = size_m.map(|metres| (metres / SIDE_M).round() as u32);
    if modules.iter().any(|&modules| modules < 2) {
        let found = format!("room for {} x {} load modules of {SIDE_M} m", modules[1], modules[0]);
        return Err(impossible(found, "two each way are the least; give more files, or a larger raster".into()));
    }
    let tiles = modules.map(|modules| {
        let at_once = (modules / MODULES_A_TILE_MIN).min(TILES_A_SIDE);
        ((f64::from(modules) / MODULES_A_TILE).round() as u32).max(at_once).clamp(1, modules / 2)
    });
    let (spacing_m, tiles) = (spacing.metres(), (tiles[1], tiles[0]));
    let posts_m = posts_m(&frames, &crs);
    let around = rectangle_around(&frames, &crs).unwrap_or([origin_m; 2]);
    let around_m = [0, 1].map(|axis| (around[1][axis] - around[0][axis]).max(size_m[axis]));
    let looked = Looked { crs, spacing, frames, given: given.map(str::to_owned) };
    let mut suggestion = Suggestion {
        seen,
        epsg,
        origin_m,
        size_m,
        around_m,
        spacing_m,
        tiles,
        part_around,
        posts_m,
        gap_posts: 0,
        looked,
    };
    if 1 < paths.len() {
        suggestion.gap_posts = suggestion.count_gaps()?;
    }
    Ok(suggestion)
}

/// System, spacing, origin and size of an area in the middle of a raster, and where that middle is; `None` where the
/// raster has no room for one.
#[allow(clippy::type_complexity, reason = "it is taken apart at its only call")]
fn part(frame: &RasterFrame) -> Option<(Crs, Spacing, ([f64; 2], [f64; 2]), Option<[f64; 2]>)> {
    // The system of the middle: the zone of a continent's would not reach its sides.
    let cut = |frame: &RasterFrame, posts: u32| {
        let (rows, cols) = (frame.rows.min(posts), frame.cols.min(posts));
        let south_west = frame.place((frame.rows - rows) / 2, (frame.cols - cols) / 2);
        RasterFrame { south_west, rows, cols, ..frame.clone() }
    };
    let middle = cut(frame, 2);
    let crs = area_crs(std::slice::from_ref(&middle)).ok()?;
    let spacing = spacing_for(std::slice::from_ref(&middle), &crs);
    let inner = cut(frame, (PART_M / posts_m(std::slice::from_ref(&middle), &crs)).ceil() as u32 + 1);
    let found = covered(std::slice::from_ref(&inner), &crs, spacing, SIDE_M).ok()?;
    let around = frame.crs.to(&Crs::wgs84(), middle.south_west)?;
    Some((crs, spacing, found, Some(around)))
}

/// Opens a raster, in the system `given` where it names none; `nodata` marks its voids where it is said.
fn open(path: &Path, given: Option<&str>, nodata: Option<f64>) -> Result<(DemFile, bool), CompileError> {
    let reading = Reading { nodata, ..Reading::AS_IT_SAYS };
    match (DemFile::open(path, &reading), given) {
        (Ok(file), _) => Ok((file, false)),
        (Err(SourceError::NoCrs { .. }), Some(given)) => {
            Ok((DemFile::open(path, &Reading { crs: Some(crs_named(given)?), ..reading })?, true))
        }
        (Err(error), _) => Err(error.into()),
    }
}

/// Looks at every post of a raster, as a build would read it with the job that is suggested.
fn look(path: &Path, given: Option<&str>) -> Result<(Seen, RasterFrame), CompileError> {
    let (mut file, crs_given) = open(path, given, None)?;
    let all = |file: &DemFile| file.look(file.rect(), None, &file.chunks_of(file.rect()));
    let mut found = all(&file);
    let undeclared = match &found {
        // One value marks voids: that which the file declares, where it has it.
        Ok(look) if 0 < look.voids && file.nodata().is_some() => None,
        Ok(look) => look.range_m.and_then(|range_m| undeclared(&file, range_m)),
        Err(_) if file.nodata().is_some() => None,
        // So low or high that no raster may have it.
        Err(SourceError::HeightOutOfRange { found, .. }) => undeclared(&file, (*found, *found)),
        Err(_) => None,
    };
    if undeclared.is_some() {
        (file, _) = open(path, given, undeclared)?;
        found = all(&file);
    }
    let (found, frame) = (found?, file.frame());
    let mut notes: Vec<String> = frame.crs.remark().map(str::to_owned).into_iter().collect();
    notes.extend(found.notes.iter().take(3).cloned());
    let reaches_sea_level = found.range_m.is_some_and(|(low, high)| low <= 0.0 && 0.0 <= high);
    let at_sea_level = if reaches_sea_level { file.posts_at_sea_level()? } else { 0 };
    let seen = Seen {
        path: frame.path.clone(),
        format: file.format(),
        size: (frame.cols, frame.rows),
        crs: frame.crs.name().to_owned(),
        spacing: frame.spacing,
        is_geographic: frame.crs.is_geographic(),
        voids: found.voids,
        undeclared,
        range_m: found.range_m,
        at_sea_level,
        vertical_datum: file.vertical_datum().map(str::to_owned),
        accuracy_m: file.accuracy_m(),
        notes,
        crs_given,
    };
    Ok((seen, frame.clone()))
}

/// The usual mark of a void that is the lowest or the highest height of a file.
fn undeclared(file: &DemFile, (low, high): (f64, f64)) -> Option<f64> {
    let height_m = |mark: f64| file.sample_scale().height_m(mark);
    MARKS.into_iter().find(|&mark| (if mark < 0.0 { low } else { high }) == height_m(mark))
}
