//! Where an area lies that the job leaves open: around a place, or where its rasters have ground.

use job::{AreaFound, AreaPlace, AreaRequest, Job, NoArea, SourceFile};
use source_files::{Crs, DemFile, RasterFrame, turns};
use terrain::Spacing;

use crate::ground::source::reading;

/// Load modules looked at, at most, for the largest rectangle that is covered.
const MODULES_MAX: usize = 1 << 22;

/// Corners of load modules looked for in rasters, at most, to see whether more fit where they begin a part of one
/// farther on.
const CORNERS_MAX: usize = 1 << 18;

/// Finds the area that a job asks for; for [`job::Job::load_with`].
///
/// # Errors
/// When a source cannot be opened, there is no such area, or its coordinate system cannot be computed.
pub fn find_area(request: &AreaRequest, files: &[SourceFile]) -> Result<AreaFound, NoArea> {
    match request.place {
        AreaPlace::Around { latitude, longitude, size_m } => around(request, [longitude, latitude], size_m),
        AreaPlace::CoverDem => {
            let frames = files.iter().map(|file| {
                let reading = reading(file, false).map_err(|error| no_area(error.to_string()))?;
                let opened = DemFile::open(&file.path, &reading).map_err(|error| no_area(error.to_string()))?;
                Ok(opened.frame().clone())
            });
            let frames: Vec<RasterFrame> = frames.collect::<Result<_, NoArea>>()?;
            let crs = match request.epsg {
                Some(epsg) => computed(epsg)?,
                None => utm_of(&frames)?,
            };
            let (origin_m, size_m) = covered(&frames, &crs, request.spacing, request.side_m)?;
            Ok(AreaFound { epsg: code(&crs)?, origin_m, size_m })
        }
    }
}

/// A corner of an area.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Corner {
    /// Which, in words.
    pub name: &'static str,
    /// East and north in metres of the area's system.
    pub place_m: [f64; 2],
    /// Longitude and latitude on WGS 84 in degrees; `None` where the system cannot be computed.
    pub lon_lat: Option<[f64; 2]>,
}

/// The corners of a job's area in its own system and in degrees.
pub fn corners(job: &Job) -> [Corner; 4] {
    let (crs, wgs84) = (Crs::from_epsg(job.area.epsg).ok(), Crs::wgs84());
    let ([west, south], [wide, high]) = (job.area.origin_m, job.area.size_m());
    let corner = |name, place_m| {
        let lon_lat = crs.as_ref().and_then(|crs| crs.to(&wgs84, place_m));
        Corner { name, place_m, lon_lat }
    };
    [
        corner("south-west", [west, south]),
        corner("south-east", [west + wide, south]),
        corner("north-east", [west + wide, south + high]),
        corner("north-west", [west, south + high]),
    ]
}

fn no_area(found: String) -> NoArea {
    NoArea {
        found,
        expected: "an area where the sources have ground".into(),
        hint: "give origin_m and size_m yourself; `tiefort init FILES…` shows where files lie".into(),
    }
}

fn computed(epsg: u32) -> Result<Crs, NoArea> {
    let crs = Crs::from_epsg(epsg).map_err(|found| no_area(format!("EPSG:{epsg}: {found}")))?;
    match crs.unit_m() {
        Some(1.0) => Ok(crs),
        _ => Err(no_area(format!("EPSG:{epsg} is not in metres"))),
    }
}

fn code(crs: &Crs) -> Result<u32, NoArea> {
    crs.epsg().ok_or_else(|| no_area(format!("{} has no EPSG code", crs.name())))
}

fn around(request: &AreaRequest, place: [f64; 2], size_m: [f64; 2]) -> Result<AreaFound, NoArea> {
    let crs = match request.epsg {
        Some(epsg) => computed(epsg)?,
        None => Crs::utm_at(place).map_err(no_area)?,
    };
    let middle = Crs::wgs84().to(&crs, place);
    let middle = middle.ok_or_else(|| no_area(format!("{} does not reach there", crs.name())))?;
    // As many whole load modules as the size needs; decimals of kilometres are not exact.
    let modules = size_m.map(|metres| (metres / request.side_m - 1.0e-9).ceil().max(1.0));
    let size_m = modules.map(|modules| modules * request.side_m);
    let spacing_m = request.spacing.metres();
    let origin_m = [0, 1].map(|axis| ((middle[axis] - size_m[axis] / 2.0) / spacing_m).round() * spacing_m);
    Ok(AreaFound { epsg: code(&crs)?, origin_m, size_m })
}

/// The UTM zone of the middle of some rasters.
///
/// # Errors
/// When there are none, or none lies in a zone.
pub fn utm_of(frames: &[RasterFrame]) -> Result<Crs, NoArea> {
    let wgs84 = Crs::wgs84();
    let middles = frames.iter().filter_map(|frame| {
        let [a, b] = [frame.place(0, 0), frame.place(frame.rows - 1, frame.cols - 1)];
        frame.crs.to(&wgs84, [(a[0] + b[0]) / 2.0, (a[1] + b[1]) / 2.0])
    });
    let mut middles: Vec<[f64; 2]> = middles.collect();
    if middles.is_empty() {
        return Err(no_area("no raster to take the UTM zone from".into()));
    }
    // The mean of 179 east and 179 west is 180, and not 0.
    let around = turns(&middles.iter().map(|&[longitude, _]| [longitude; 2]).collect::<Vec<_>>());
    middles.iter_mut().zip(around).for_each(|(middle, turn)| middle[0] += turn);
    let mean = |axis: usize| middles.iter().map(|middle| middle[axis]).sum::<f64>() / middles.len() as f64;
    Crs::utm_at([mean(0), mean(1)]).map_err(no_area)
}

/// Rasters as seen from the area.
struct Footprints<'a> {
    frames: &'a [RasterFrame],
    crs: &'a Crs,
}

impl Footprints<'_> {
    /// Whether there is ground at a place: inside a raster, or between the outermost posts of two.
    fn holds(&self, place: [f64; 2]) -> bool {
        /// Share of a post by which rounding may put the outermost post outside.
        const EDGE: f64 = 1.0e-3;
        /// Neighbouring files of one grid are a post apart.
        const BETWEEN: f64 = 0.501;
        let mut near = 0;
        for frame in self.frames {
            let Some(at) = self.crs.to(&frame.crs, place).map(|at| frame.nearest(at)) else { continue };
            let posts = [0, 1].map(|axis| (at[axis] - frame.south_west[axis]) / frame.spacing[axis]);
            let last = [f64::from(frame.cols - 1), f64::from(frame.rows - 1)];
            let outside = (0..2).map(|axis| (-posts[axis]).max(posts[axis] - last[axis])).fold(f64::MIN, f64::max);
            if outside <= EDGE {
                return true;
            }
            near += usize::from(outside <= BETWEEN);
        }
        2 <= near
    }

    /// South-west and north-east corner of the box around all rasters, in the area's system.
    fn bounds(&self) -> Option<[[f64; 2]; 2]> {
        const STEPS: u32 = 32;
        let mut bounds: Option<[[f64; 2]; 2]> = None;
        for frame in self.frames {
            let along = |count: u32, step: u32| (u64::from(count - 1) * u64::from(step) / u64::from(STEPS)) as u32;
            let posts = (0..=STEPS).flat_map(|step| {
                let (row, col) = (along(frame.rows, step), along(frame.cols, step));
                [(0, col), (frame.rows - 1, col), (row, 0), (row, frame.cols - 1)]
            });
            for [east, north] in posts.filter_map(|(row, col)| frame.crs.to(self.crs, frame.place(row, col))) {
                let [low, high] = bounds.unwrap_or([[east, north]; 2]);
                bounds = Some([[low[0].min(east), low[1].min(north)], [high[0].max(east), high[1].max(north)]]);
            }
        }
        bounds
    }
}

/// Origin and size of the largest rectangle of whole load modules that rasters cover: the largest of those that begin
/// at posts spread over a load module, as long as these are few enough to look at.
///
/// # Errors
/// When not even one load module is covered, or the rasters lie too far apart to look at everything between.
pub fn covered(
    frames: &[RasterFrame],
    crs: &Crs,
    spacing: Spacing,
    side_m: f64,
) -> Result<([f64; 2], [f64; 2]), NoArea> {
    let footprints = Footprints { frames, crs };
    let [low, high] = footprints.bounds().ok_or_else(|| no_area("no source lies in this coordinate system".into()))?;
    let origin = first_post(frames, crs, low, spacing.metres());
    let [cols, rows] = modules_between(origin, high, side_m);
    if MODULES_MAX < rows.saturating_mul(cols) {
        return Err(no_area(format!("sources spread over {rows} x {cols} load modules")));
    }
    let posts = (side_m / spacing.metres()).round().max(1.0) as usize;
    let looks = (rows + 1) * (cols + 1) * frames.len().max(1);
    let phases = (CORNERS_MAX / looks).isqrt().clamp(1, posts);
    let mut best: Option<([f64; 2], [f64; 2])> = None;
    let extent = |(_, size_m): ([f64; 2], [f64; 2])| size_m[0] * size_m[1];
    for phase in (0..phases * phases).map(|number| [number % phases, number / phases]) {
        let by = phase.map(|phase| (phase * posts / phases) as f64 * spacing.metres());
        let found = covered_from([0, 1].map(|axis| origin[axis] + by[axis]), high, &footprints, side_m);
        if let Some(area) = found
            && best.is_none_or(|best| extent(best) < extent(area))
        {
            best = Some(area);
        }
    }
    best.ok_or_else(|| no_area(format!("not one load module of {side_m} m fits inside the sources")))
}

/// Columns and rows of whole load modules from `low` to `high`.
fn modules_between(low: [f64; 2], high: [f64; 2], side_m: f64) -> [usize; 2] {
    [0, 1].map(|axis| ((high[axis] - low[axis]) / side_m + 1.0e-6).floor().max(0.0) as usize)
}

/// The same of load modules on a grid through `origin`, up to `high`.
fn covered_from(
    origin: [f64; 2],
    high: [f64; 2],
    footprints: &Footprints,
    side_m: f64,
) -> Option<([f64; 2], [f64; 2])> {
    let [cols, rows] = modules_between(origin, high, side_m);
    let corner =
        |row: usize, col: usize| footprints.holds([origin[0] + col as f64 * side_m, origin[1] + row as f64 * side_m]);
    let held: Vec<Vec<bool>> = (0..=rows).map(|row| (0..=cols).map(|col| corner(row, col)).collect()).collect();
    let whole =
        |row: usize, col: usize| held[row][col] && held[row][col + 1] && held[row + 1][col] && held[row + 1][col + 1];
    let [south, west, high, wide] = largest_rectangle(rows, cols, whole)?;
    let place = |axis: usize, modules: usize| origin[axis] + modules as f64 * side_m;
    Some(([place(0, west), place(1, south)], [wide as f64 * side_m, high as f64 * side_m]))
}

/// South-west and north-east corners of the rectangle around rasters, in metres of a system; `None` where none of them
/// can be expressed in it.
pub fn rectangle_around(frames: &[RasterFrame], crs: &Crs) -> Option<[[f64; 2]; 2]> {
    Footprints { frames, crs }.bounds()
}

/// The first post in the south-west: one of the raster's own where it is in the area's system and spacing, else a
/// round number.
fn first_post(frames: &[RasterFrame], crs: &Crs, low: [f64; 2], spacing_m: f64) -> [f64; 2] {
    let own = frames.iter().find(|frame| frame.crs == *crs && frame.spacing == [spacing_m; 2]);
    match own {
        Some(frame) => [0, 1].map(|axis| {
            let posts = ((low[axis] - frame.south_west[axis]) / spacing_m - 1.0e-6).ceil();
            frame.south_west[axis] + posts * spacing_m
        }),
        None => low.map(|metres| (metres / spacing_m - 1.0e-6).ceil() * spacing_m),
    }
}

/// South row, west column, rows and columns of the largest rectangle of cells that all pass; the first of several.
fn largest_rectangle(rows: usize, cols: usize, passes: impl Fn(usize, usize) -> bool) -> Option<[usize; 4]> {
    let mut heights = vec![0; cols + 1];
    let mut best: Option<(usize, [usize; 4])> = None;
    for row in 0..rows {
        for (col, height) in heights[..cols].iter_mut().enumerate() {
            *height = if passes(row, col) { *height + 1 } else { 0 };
        }
        // Columns whose run of cells is still open, each lower than the next.
        let mut open: Vec<(usize, usize)> = Vec::new();
        for (col, &height) in heights.iter().enumerate() {
            let mut first = col;
            while let Some(&(from, tall)) = open.last().filter(|&&(_, tall)| height <= tall) {
                open.pop();
                let area = tall * (col - from);
                if best.is_none_or(|(most, _)| most < area) && 0 < area {
                    best = Some((area, [row + 1 - tall, from, tall, col - from]));
                }
                first = from;
            }
            open.push((first, height));
        }
    }
    best.map(|(_, rectangle)| rectangle)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn check(picture: &[&str], expected: Option<[usize; 4]>) {
        let rows: Vec<&[u8]> = picture.iter().rev().map(|line| line.as_bytes()).collect();
        assert_eq!(largest_rectangle(rows.len(), rows[0].len(), |row, col| rows[row][col] == b'#'), expected);
    }

    #[test]
    fn the_largest_rectangle_of_covered_cells_is_found() {
        check(&["....", "...."], None);
        check(&["#"], Some([0, 0, 1, 1]));
        check(&[".##.", "####", "####", ".##."], Some([1, 0, 2, 4]));
        check(&["######", "#....#", "###..#"], Some([2, 0, 1, 6]));
        check(&["..###", "..###", "#####"], Some([0, 2, 3, 3]));
    }

    #[test]
    fn the_zone_of_rasters_is_that_of_their_middle_where_longitudes_come_around() {
        let frame = |west: f64| RasterFrame {
            path: "a.tif".into(),
            crs: Crs::wgs84(),
            south_west: [west, -17.0],
            spacing: [0.01; 2],
            cols: 101,
            rows: 101,
        };
        let zone = |wests: &[f64]| utm_of(&wests.iter().map(|&west| frame(west)).collect::<Vec<_>>()).unwrap().epsg();
        assert_eq!(zone(&[179.0, -180.0]), Some(32701));
        assert_eq!(zone(&[-180.0, 179.0, 178.0]), Some(32760));
        assert_eq!(zone(&[241.5, -118.0]), Some(32711));
        assert_eq!(zone(&[359.0, 0.0]), Some(32731));
        assert_eq!(zone(&[-118.0, -117.0]), Some(32711));
    }

    #[test]
    fn an_area_around_a_place_is_whole_load_modules_around_it() {
        let request = AreaRequest {
            epsg: None,
            place: AreaPlace::Around { latitude: 35.3, longitude: -116.6, size_m: [10_100.0, 5000.0] },
            spacing: Spacing::from_metres(25.0).unwrap(),
            side_m: 500.0,
        };
        let found = find_area(&request, &[]).unwrap();
        assert_eq!((found.epsg, found.size_m), (32611, [10_500.0, 5000.0]));
        // The middle is 536367.04 E, 3906386.11 N.
        assert_eq!(found.origin_m, [531_125.0, 3_903_875.0]);
        let polar =
            AreaRequest { place: AreaPlace::Around { latitude: 89.0, longitude: 0.0, size_m: [500.0; 2] }, ..request };
        assert!(find_area(&polar, &[]).unwrap_err().found.contains("UTM reaches"));
    }
}
