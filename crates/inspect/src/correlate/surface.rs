//! The two surfaces: what each is, and its ground around a rectangle, held in memory and asked by place.
//!
//! A raster is bilinear in every cell.

use std::path::Path;
use std::sync::atomic::AtomicBool;

use build::CompileError;
use build::ground::GroundError;
use build::product::Opened;
use build::workbench::{PostHeights, SurfaceRaster};
use load_module_reader::{
    Area, Block, Curvature, Keep, LoadedGround, PastObjects, ReadError, Sight, Standing, open_file,
};
use schedule::{ScheduleError, Workers};
use serde::Serialize;
use store::{DatabaseError, Fingerprint};
use terrain::TileId;

/// What a surface is, as a certificate names it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SurfaceFacts {
    /// The path that was given.
    pub path: String,
    /// Its kind: `terrain database`, or the format of a raster.
    pub kind: String,
    /// Name of the area of a database; empty of a raster.
    pub name: String,
    /// Its coordinate system, such as `EPSG:32611`.
    pub crs: String,
    /// What its heights are above; empty where that is unknown.
    pub vertical_datum: String,
    /// West, south, east and north of its ground, in metres.
    pub extent_m: [f64; 4],
    /// Metres between its posts, or those of the working grid it was built on, to the east and to the north.
    pub spacing_m: [f64; 2],
    /// Load modules of a database.
    pub modules: Option<u64>,
    /// Names of the classes of a database's ground, by number.
    #[serde(skip)]
    pub classes: Vec<String>,
    /// Whether a database has buildings or woods.
    pub has_objects: bool,
    /// Fingerprint (BLAKE3) of `database.json`, which holds those of all load modules, or of the raster.
    #[serde(rename = "blake3")]
    pub fingerprint: String,
}

/// A surface that is open.
pub(super) struct Surface {
    pub facts: SurfaceFacts,
    source: Source,
}

enum Source {
    Modules(Box<Area>),
    Posts(Box<SurfaceRaster>),
}

/// The ground of a surface around a rectangle.
pub(super) enum Ground {
    Modules(Box<LoadedGround>),
    Posts(PostHeights),
    /// The surface has none there.
    None,
}

impl Surface {
    /// Opens a terrain database, which is a folder, or a raster of heights.
    ///
    /// # Errors
    /// When it is missing, unfinished or damaged, holds load modules of another build, or is not in metres.
    pub fn open(path: &Path, workers: &Workers, stop: &AtomicBool) -> Result<Self, CompileError> {
        if path.is_dir() { Self::database(path, workers, stop) } else { Self::raster(path) }
    }

    fn database(path: &Path, workers: &Workers, stop: &AtomicBool) -> Result<Self, CompileError> {
        let Opened { folder, manifest, job, area } = Opened::open(path)?;
        // The certificate names the load modules by the list that holds their fingerprints.
        let check = |_: usize, &tile: &TileId| Ok(folder.check_modules(&manifest, tile)?);
        schedule::for_each_independent(&area.tiles, workers, stop, check).map_err(ended)?;
        let modules = Area::open(folder.dir(), Keep::OnDisk).map_err(|error| damaged(path, error))?;
        let (frame, [west, south]) = (modules.frame(), modules.frame().origin_m);
        let [wide, high] = [frame.cols, frame.rows].map(|count| f64::from(count) * frame.side_m());
        let list = folder.path("database.json");
        let bytes = open_file(&list).map_err(|error| damaged(&list, error))?;
        let unreadable = |source| damaged(&list, ReadError::Unreadable { path: list.clone(), source });
        let facts = SurfaceFacts {
            path: path.display().to_string(),
            kind: "terrain database".into(),
            name: manifest.area.name.clone(),
            crs: frame.crs.clone(),
            vertical_datum: frame.vertical_datum.clone(),
            extent_m: [west, south, west + wide, south + high],
            spacing_m: [area.frame.spacing.metres(); 2],
            modules: Some(u64::from(frame.rows) * u64::from(frame.cols)),
            classes: job.class_names(),
            has_objects: job.objects.is_some(),
            fingerprint: Fingerprint::of_reader(bytes).map_err(unreadable)?.to_string(),
        };
        Ok(Self { facts, source: Source::Modules(Box::new(modules)) })
    }

    fn raster(path: &Path) -> Result<Self, CompileError> {
        let raster = SurfaceRaster::open(path)?;
        let facts = SurfaceFacts {
            path: path.display().to_string(),
            kind: raster.format().into(),
            name: String::new(),
            crs: raster.crs(),
            vertical_datum: raster.vertical_datum(),
            extent_m: raster.extent_m(),
            spacing_m: raster.spacing_m(),
            modules: None,
            classes: Vec::new(),
            has_objects: false,
            fingerprint: raster.fingerprint()?.to_string(),
        };
        Ok(Self { facts, source: Source::Posts(Box::new(raster)) })
    }

    /// Bytes, about, that the ground of a square of a side in metres takes in memory.
    pub fn bytes_of(&self, side_m: f64) -> f64 {
        const MODULE_BYTES: f64 = 12e3;
        const POST_BYTES: f64 = 4.0;
        let (apart_m, bytes) = match &self.source {
            Source::Modules(area) => ([area.frame().side_m(); 2], MODULE_BYTES),
            Source::Posts(raster) => (raster.spacing_m(), POST_BYTES),
        };
        let [west, south, east, north] = self.facts.extent_m;
        (side_m.min(east - west) / apart_m[0] + 1.0) * (side_m.min(north - south) / apart_m[1] + 1.0) * bytes
    }

    /// The ground around a rectangle, which is west, south, east and north in metres.
    ///
    /// # Errors
    /// When a load module or the raster is damaged, or it was asked to stop.
    pub fn load(&self, rect_m: [f64; 4], workers: &Workers, stop: &AtomicBool) -> Result<Ground, CompileError> {
        match &self.source {
            Source::Posts(raster) => Ok(raster.window(rect_m, workers, stop)?.map_or(Ground::None, Ground::Posts)),
            Source::Modules(area) => {
                let [south_west, north_east] = [[rect_m[0], rect_m[1]], [rect_m[2], rect_m[3]]];
                let [first, last] = [south_west, north_east].map(|corner| area.frame().module_at(corner));
                let cut = |at: i64, count: u32| at.clamp(0, i64::from(count)) as u32;
                let block = Block {
                    south: cut(first[0], area.frame().rows),
                    west: cut(first[1], area.frame().cols),
                    north: cut(last[0].saturating_add(1), area.frame().rows),
                    east: cut(last[1].saturating_add(1), area.frame().cols),
                };
                let read = |error| damaged(Path::new(&self.facts.path), error);
                Ok(Ground::Modules(Box::new(load_rows(area, block, workers, stop, read)?)))
            }
        }
    }
}

/// A block, row by row of load modules on all workers.
fn load_rows(
    area: &Area,
    block: Block,
    workers: &Workers,
    stop: &AtomicBool,
    read: impl Fn(ReadError) -> CompileError + Sync,
) -> Result<LoadedGround, CompileError> {
    if block.count() == 0 {
        return area.load(block).map_err(read);
    }
    let rows: Vec<u32> = (block.south..block.north).collect();
    let load = |_: usize, &row: &u32| area.load(Block { south: row, north: row + 1, ..block }).map_err(&read);
    let rows = schedule::for_each_independent(&rows, workers, stop, load).map_err(ended)?;
    let modules = rows.iter().flat_map(|row| row.modules().iter().cloned()).collect();
    Ok(LoadedGround::of_modules(area.frame().clone(), 0, block, modules))
}

/// Why work on all workers ended early.
pub(super) fn ended<R>(error: ScheduleError<R, CompileError>) -> CompileError {
    GroundError::from_schedule(&[], error)
}

fn damaged(path: &Path, error: ReadError) -> CompileError {
    DatabaseError::Modules { path: path.into(), fault: Box::new(error) }.into()
}

impl Ground {
    /// Height at a place, an easting and a northing, in metres; `None` in a hole, over a void post, and outside.
    pub fn height_m(&self, place_m: [f64; 2]) -> Option<f64> {
        match self {
            Self::Modules(ground) => ground.sample(place_m).filter(|sample| !sample.is_hole()).map(|at| at.height_m),
            Self::Posts(posts) => height_of_posts_m(posts, place_m),
            Self::None => None,
        }
    }

    /// Number of the class of the ground at a place; `None` where it has none.
    pub fn class(&self, place_m: [f64; 2]) -> Option<u8> {
        match self {
            Self::Modules(ground) => ground.sample(place_m).filter(|sample| !sample.is_hole()).map(|at| at.class),
            Self::Posts(_) | Self::None => None,
        }
    }

    /// Metres up for each metre east and north at a place, between places half of `apart_m` away on either side.
    pub fn gradient(&self, place_m: [f64; 2], apart_m: f64) -> Option<[f64; 2]> {
        let at = |east: f64, north: f64| self.height_m([place_m[0] + east, place_m[1] + north]);
        let half = 0.5 * apart_m;
        Some([(at(half, 0.0)? - at(-half, 0.0)?) / apart_m, (at(0.0, half)? - at(0.0, -half)?) / apart_m])
    }

    /// Whether one place sees another, both the same metres above this ground; `None` where an end has no ground, or
    /// the line leaves what has a height.
    pub fn sees(&self, pair: [[f64; 2]; 2], above_m: f64, standing: Standing) -> Option<bool> {
        let [from, to] = [0, 1].map(|end| {
            let [east, north] = pair[end];
            self.height_m([east, north]).map(|height_m| [east, north, height_m + above_m])
        });
        let (from, to) = (from?, to?);
        match self {
            Self::Modules(ground) => {
                let past = PastObjects { standing, ..PastObjects::all(Curvature::NONE) };
                match ground.sight_past(from, to, &past).sight {
                    Sight::Free => Some(true),
                    Sight::Hidden(_) => Some(false),
                    Sight::Unknown => None,
                }
            }
            Self::Posts(posts) => is_free_over_posts(posts, from, to),
            Self::None => None,
        }
    }
}

/// Metres by which a line may touch the ground.
const ROUNDING_M: f64 = 1e-6;

/// Height at a place, an easting and a northing, in metres; `None` outside, and where a post that counts is void.
fn height_of_posts_m(posts: &PostHeights, place_m: [f64; 2]) -> Option<f64> {
    in_posts(posts, place_m).and_then(|place| height_at(posts, place))
}

/// Whether nothing of the raster stands between two places, each an easting, a northing and a height; `None` where the
/// line leaves it, or goes over a void.
///
/// In a cell the ground under a line is a parabola. The line is cut wherever it crosses a row or a column of posts, so
/// that each piece lies in one cell, and the parabola through its ends and its middle is looked at where it is highest.
fn is_free_over_posts(posts: &PostHeights, from_m: [f64; 3], to_m: [f64; 3]) -> Option<bool> {
    let from = in_posts(posts, [from_m[0], from_m[1]])?;
    let to = in_posts(posts, [to_m[0], to_m[1]])?;
    let above = |share: f64| {
        let place = [0, 1].map(|axis| from[axis] + share * (to[axis] - from[axis]));
        height_at(posts, place).map(|height_m| height_m - (from_m[2] + share * (to_m[2] - from_m[2])))
    };
    let mut start = above(0.0)?;
    for ends in cuts(from, to).windows(2) {
        let (middle, end) = (above(0.5 * (ends[0] + ends[1]))?, above(ends[1])?);
        if ROUNDING_M < highest(start, middle, end) {
            return Some(false);
        }
        start = end;
    }
    Some(true)
}

/// Shares of a line between two places in posts at which it begins, crosses rows and columns of posts, and ends.
pub(super) fn cuts(from: [f64; 2], to: [f64; 2]) -> Vec<f64> {
    let mut cuts = vec![0.0, 1.0];
    for axis in 0..2 {
        let (low, high) = (from[axis].min(to[axis]), from[axis].max(to[axis]));
        let lines = (low.ceil() as i64)..=(high.floor() as i64);
        cuts.extend(lines.map(|line| (line as f64 - from[axis]) / (to[axis] - from[axis])));
    }
    // Ends on a line of posts divide by nothing.
    cuts.retain(|cut| (0.0..=1.0).contains(cut));
    cuts.sort_by(f64::total_cmp);
    cuts.dedup();
    cuts
}

/// The highest value of the parabola through three values at 0, one half and 1, between 0 and 1.
fn highest(start: f64, middle: f64, end: f64) -> f64 {
    let (bend, rise) = (2.0 * (start - 2.0 * middle + end), 4.0 * middle - 3.0 * start - end);
    let ends = start.max(end);
    let top = -rise / (2.0 * bend);
    if bend < 0.0 && 0.0 < top && top < 1.0 { ends.max(start + rise * top + bend * top * top) } else { ends }
}

/// A place counted in posts from the south-west one, east then north; `None` outside.
pub(super) fn in_posts(posts: &PostHeights, place_m: [f64; 2]) -> Option<[f64; 2]> {
    let rows = posts.heights_m.len() / posts.cols;
    let place = [0, 1].map(|axis| (place_m[axis] - posts.south_west_m[axis]) / posts.spacing_m[axis]);
    let is_inside = |at: f64, count: usize| (0.0..=(count - 1) as f64).contains(&at);
    (is_inside(place[0], posts.cols) && is_inside(place[1], rows)).then_some(place)
}

/// Height at a place in posts; `None` where a post that counts is void.
pub(super) fn height_at(posts: &PostHeights, place: [f64; 2]) -> Option<f64> {
    let rows = posts.heights_m.len() / posts.cols;
    let first = |at: f64, count: usize| (at.max(0.0) as usize).min(count.saturating_sub(2));
    let (col, row) = (first(place[0], posts.cols), first(place[1], rows));
    let (x, y) = ((place[0] - col as f64).clamp(0.0, 1.0), (place[1] - row as f64).clamp(0.0, 1.0));
    let mut height_m = 0.0;
    for (dx, dy, share) in [(0, 0, (1.0 - x) * (1.0 - y)), (1, 0, x * (1.0 - y)), (0, 1, (1.0 - x) * y), (1, 1, x * y)]
    {
        if share != 0.0 {
            height_m += share * f64::from(posts.heights_m[(row + dy) * posts.cols + col + dx]);
        }
    }
    (!height_m.is_nan()).then_some(height_m)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn posts(cols: usize, rows: usize, height_m: impl Fn(usize, usize) -> f32) -> PostHeights {
        let heights_m =
            (0..rows).flat_map(|row| (0..cols).map(move |col| (row, col))).map(|(row, col)| height_m(row, col));
        PostHeights { south_west_m: [1000.0, 2000.0], spacing_m: [10.0, 20.0], cols, heights_m: heights_m.collect() }
    }

    #[test]
    fn heights_are_bilinear_and_none_beside_voids_and_outside() {
        let posts = posts(4, 3, |row, col| if (row, col) == (2, 3) { f32::NAN } else { (row * 100 + col) as f32 });
        assert_eq!(height_of_posts_m(&posts, [1000.0, 2000.0]), Some(0.0));
        assert_eq!(height_of_posts_m(&posts, [1015.0, 2010.0]), Some(51.5));
        assert_eq!(height_of_posts_m(&posts, [1030.0, 2020.0]), Some(103.0));
        assert_eq!(height_of_posts_m(&posts, [1025.0, 2021.0]), None);
        assert_eq!(height_of_posts_m(&posts, [1030.0, 2040.0]), None);
        assert_eq!(height_of_posts_m(&posts, [1020.0, 2040.0]), Some(202.0));
        assert_eq!(height_of_posts_m(&posts, [999.9, 2000.0]), None);
        assert_eq!(height_of_posts_m(&posts, [1000.0, f64::NAN]), None);
    }

    #[test]
    fn a_line_is_hidden_exactly_where_many_looks_find_ground_above_it() {
        let mut dice = fidelity::Draw::new(5, 0);
        let rough: Vec<f32> = (0..400).map(|_| (30.0 * dice.unit()) as f32).collect();
        let posts = posts(20, 20, |row, col| rough[row * 20 + col]);
        let (mut seen, mut hidden) = (0, 0);
        for index in 0..2000 {
            let pair = fidelity::Draw::new(6, index).pair([190.0, 380.0], [5.0, 60.0]).unwrap();
            let [from, to] = pair.map(|[x, y]| {
                let place = [1000.0 + x, 2000.0 + y];
                [place[0], place[1], height_of_posts_m(&posts, place).unwrap() + 4.0]
            });
            let most = (0..=4000).map(|step| {
                let share = f64::from(step) / 4000.0;
                let place = [0, 1, 2].map(|axis| from[axis] + share * (to[axis] - from[axis]));
                height_of_posts_m(&posts, [place[0], place[1]]).unwrap() - place[2]
            });
            let most = most.fold(f64::NEG_INFINITY, f64::max);
            let is_seen = is_free_over_posts(&posts, from, to).unwrap();
            // Looks between which the ground just touches the line decide nothing.
            if 1e-4 < most.abs() {
                assert_eq!(is_seen, most < 0.0, "pair {index}");
            }
            *(if is_seen { &mut seen } else { &mut hidden }) += 1;
        }
        assert!(200 < seen && 200 < hidden, "{seen} {hidden}");
    }

    #[test]
    fn a_line_over_a_void_is_unknown() {
        let posts = posts(9, 9, |row, col| if (row, col) == (4, 4) { f32::NAN } else { 0.0 });
        assert_eq!(is_free_over_posts(&posts, [1000.0, 2080.0, 5.0], [1080.0, 2080.0, 5.0]), None);
        assert_eq!(is_free_over_posts(&posts, [1000.0, 2020.0, 5.0], [1080.0, 2020.0, 5.0]), Some(true));
        assert_eq!(is_free_over_posts(&posts, [1000.0, 2020.0, 5.0], [1090.0, 2020.0, 5.0]), None);
    }
}
