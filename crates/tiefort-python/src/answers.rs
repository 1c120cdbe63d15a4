//! A finished database that answers: heights, normals, classes, lines of sight, load modules.

use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError};

use load_module_reader::{
    Area, Block, Curvature, HOLE_CLASS, Hider, LoadedGround, PastObjects, ProfilePoint, QUANTA_PER_METRE, ReadError,
    Sight, Standing,
};
use numpy::{PyArray1, PyArray2, PyReadonlyArray2};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use store::Folder;
use tiefort::contents::{Opened, damaged};
use tiefort::library::{self, Failure};

use crate::arrays::{places, table};
use crate::raised::{named, raised};
use crate::waiting::wait;

/// Load modules up to which all of a database is loaded at the first question (about 12 kB each).
const WHOLE_MAX: usize = 1 << 14;
/// Questions that are answered before signals are looked for.
const AT_ONCE: usize = 1 << 20;
/// The same of lines of sight, which take longer.
const LINES_AT_ONCE: usize = 1 << 12;
/// Lines from one eye for which it is worth while to keep what it sees over.
const EYE_LINES_MIN: usize = 64;

/// What a database is asked through; nothing once it is closed.
#[pyclass(frozen)]
pub struct Ground {
    path: PathBuf,
    held: Mutex<Option<Held>>,
}

#[derive(Clone)]
struct Held {
    opened: Arc<Opened>,
    ground: Option<Arc<LoadedGround>>,
}

/// Vertices, triangles, the class under each triangle, and figures of the residuals.
type ModuleArrays<'py> =
    (Bound<'py, PyArray2<f64>>, Bound<'py, PyArray2<u32>>, Bound<'py, PyArray1<u8>>, Bound<'py, PyDict>);

impl Ground {
    /// What is held, which the caller may change a copy of.
    fn held(&self, py: Python<'_>) -> PyResult<Held> {
        let held = self.held.lock().unwrap_or_else(PoisonError::into_inner).clone();
        held.ok_or_else(|| {
            let message = format!("{}: found a database that was closed, expected an open one", self.path.display());
            named(py, "ClosedError", &message, "open it again with tiefort.open")
        })
    }

    /// Ground that holds all load modules of a block.
    fn loaded(&self, mut held: Held, wanted: Block) -> Result<Arc<LoadedGround>, Failure> {
        let area = &held.opened.area;
        let whole = area.whole();
        let wanted = if whole.count() <= WHOLE_MAX { whole } else { wanted };
        if let Some(ground) = held.ground.as_ref().filter(|ground| contains(ground.block(), wanted)) {
            return Ok(Arc::clone(ground));
        }
        held.opened.contents.files_of(wanted)?;
        let ground = match &held.ground {
            Some(ground) => ground.moved(area, wanted),
            None => area.load(wanted),
        };
        let ground = Arc::new(ground.map_err(|error| damaged(&error))?);
        held.ground = Some(Arc::clone(&ground));
        let mut kept = self.held.lock().unwrap_or_else(PoisonError::into_inner);
        if kept.is_some() {
            *kept = Some(held);
        }
        Ok(ground)
    }

    /// Asks the ground under some places, so many at once; `each` gets the ground, the places and where answers go.
    fn ask<const N: usize, T: Clone + Send>(
        &self,
        py: Python<'_>,
        (asked, at_once): (&[[f64; N]], usize),
        unknown: T,
        each: impl Fn(&LoadedGround, &[[f64; N]], &mut [T]) + Sync,
    ) -> PyResult<Vec<T>> {
        let mut answers = vec![unknown; asked.len()];
        for (places, answers) in asked.chunks(at_once).zip(answers.chunks_mut(at_once)) {
            let held = self.held(py)?;
            // Python may change its array meanwhile.
            let places = places.to_vec();
            let asked = py.detach(|| {
                let block = around(&held.opened.area, &places);
                self.loaded(held, block).map(|ground| each(&ground, &places, answers))
            });
            asked.map_err(|failure| raised(py, &failure))?;
            py.check_signals()?;
        }
        Ok(answers)
    }
}

/// What stands for a line that nothing hides: beyond its end.
const FREE: f64 = 2.0;

/// Both ends of a line.
fn ends(&[ax, ay, az, bx, by, bz]: &[f64; 6]) -> [[f64; 3]; 2] {
    [[ax, ay, az], [bx, by, bz]]
}

/// Lines that begin at one place, one after the other, with their answers.
fn runs_from_one_eye<'a>(
    lines: &'a [[f64; 6]],
    seen: &'a mut [bool],
) -> impl Iterator<Item = (&'a [[f64; 6]], &'a mut [bool])> {
    let mut rest = seen;
    lines.chunk_by(|a, b| a[..3] == b[..3]).map(move |run| {
        let (these, others) = std::mem::take(&mut rest).split_at_mut(run.len());
        rest = others;
        (run, these)
    })
}

/// Which objects a word stands for.
fn standing(py: Python<'_>, word: &str) -> PyResult<Standing> {
    Standing::named(word).ok_or_else(|| {
        let message = format!("objects: found {word:?}, expected none, buildings or all");
        named(py, "RequestError", &message, "what stands on the ground and is looked at")
    })
}

/// What hides by its place among all, and none behind them.
fn number_of(hider: Option<Hider>) -> f64 {
    hider.map_or(Hider::ALL.len(), |hider| hider as usize) as f64
}

/// Heights at places: at places far apart load module by load module, since each then stays in the processor's cache.
fn heights_by_module(ground: &LoadedGround, places: &[[f64; 2]], heights: &mut [f64]) {
    /// Places in a load module, one after the other, up to which they are sorted.
    const RUN: usize = 8;
    let block = ground.block();
    let outside = block.count();
    let index = |place: &[f64; 2]| {
        let [row, col] = ground.frame().module_at(*place);
        let (row, col) = (row - i64::from(block.south), col - i64::from(block.west));
        let (high, wide) = (i64::from(block.north - block.south), i64::from(block.east - block.west));
        let is_inside = 0 <= row && row < high && 0 <= col && col < wide;
        if is_inside { (row * wide + col) as usize } else { outside }
    };
    let indexes: Vec<u32> = places.iter().map(|place| index(place) as u32).collect();
    let runs = indexes.windows(2).filter(|pair| pair[0] != pair[1]).count();
    if RUN * runs < places.len() || places.len() < outside {
        return ground.heights_m(places, heights);
    }
    let mut starts = vec![0_u32; outside + 2];
    indexes.iter().for_each(|&index| starts[index as usize + 1] += 1);
    (1..starts.len()).for_each(|index| starts[index] += starts[index - 1]);
    let mut sorted = vec![[0.0; 2]; places.len()];
    let mut at = vec![0_u32; places.len()];
    for ((place, &index), at) in places.iter().zip(&indexes).zip(&mut at) {
        let next = &mut starts[index as usize];
        *at = *next;
        sorted[*next as usize] = *place;
        *next += 1;
    }
    let mut found = vec![0.0; places.len()];
    ground.heights_m(&sorted, &mut found);
    heights.iter_mut().zip(at).for_each(|(height, at)| *height = found[at as usize]);
}

fn contains(outer: Block, inner: Block) -> bool {
    inner.count() == 0
        || outer.south <= inner.south
            && inner.north <= outer.north
            && outer.west <= inner.west
            && inner.east <= outer.east
}

/// The load modules under the rectangle around some places: of a line, both ends. None where all lie outside.
fn around<const N: usize>(area: &Area, places: &[[f64; N]]) -> Block {
    let ends =
        |place: &[f64; N]| [[place[0], place[1]], if N == 6 { [place[3], place[4]] } else { [place[0], place[1]] }];
    let known = places.iter().flat_map(ends).filter(|place| place.iter().all(|metres| metres.is_finite()));
    let mut bounds: Option<[[f64; 2]; 2]> = None;
    for [x, y] in known {
        let [low, high] = bounds.unwrap_or([[x, y]; 2]);
        bounds = Some([[low[0].min(x), low[1].min(y)], [high[0].max(x), high[1].max(y)]]);
    }
    let Some([low, high]) = bounds else { return Block { south: 0, west: 0, north: 0, east: 0 } };
    // The far sides of the area belong to it.
    let (low, high) = (area.block_around(low, 1), area.block_around(high, 1));
    Block { south: low.south, west: low.west, north: high.north, east: high.east }
}

#[pymethods]
impl Ground {
    /// Opens the database in a folder.
    #[new]
    fn new(py: Python<'_>, path: PathBuf) -> PyResult<Self> {
        let opened = py.detach(|| Opened::open(&path));
        let opened = opened.map_err(|failure| raised(py, &failure))?;
        let held = Held { opened: Arc::new(opened), ground: None };
        Ok(Self { path, held: Mutex::new(Some(held)) })
    }

    /// Lets go of everything.
    fn close(&self) {
        self.held.lock().unwrap_or_else(PoisonError::into_inner).take();
    }

    /// Where load modules lie: south-west corner, side, rows, columns, levels, system, vertical datum.
    fn frame<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let held = self.held(py)?;
        let (frame, found) = (held.opened.area.frame(), PyDict::new(py));
        found.set_item("origin_m", frame.origin_m)?;
        found.set_item("side_m", frame.side_m())?;
        found.set_item("rows", frame.rows)?;
        found.set_item("cols", frame.cols)?;
        found.set_item("levels", frame.level_count)?;
        found.set_item("crs", &frame.crs)?;
        found.set_item("vertical_datum", &frame.vertical_datum)?;
        Ok(found)
    }

    /// What `database.json` says of the spacing, what `report.json` says, and the names of classes.
    fn told(&self, py: Python<'_>) -> PyResult<(f64, String)> {
        let spacing_m = self.held(py)?.opened.contents.manifest.area.spacing_m;
        let read = py.detach(|| Ok(library::report_json(&Folder::new(&self.path).report()?)));
        read.map(|report| (spacing_m, report)).map_err(|failure: Failure| raised(py, &failure))
    }

    /// Heights at places, each an easting and a northing; not a number where there is no ground.
    fn heights<'py>(&self, py: Python<'py>, xy: PyReadonlyArray2<'py, f64>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        Ok(PyArray1::from_vec(py, self.ask(py, (places(&xy)?, AT_ONCE), f64::NAN, heights_by_module)?))
    }

    /// Unit vectors out of the ground.
    fn normals<'py>(&self, py: Python<'py>, xy: PyReadonlyArray2<'py, f64>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let each = |ground: &LoadedGround, places: &[[f64; 2]], normals: &mut [[f64; 3]]| {
            for (normal, &place) in normals.iter_mut().zip(places) {
                *normal = ground.sample(place).map_or([f64::NAN; 3], |sample| sample.normal);
            }
        };
        table(py, self.ask(py, (places(&xy)?, AT_ONCE), [f64::NAN; 3], each)?.into_iter())
    }

    /// Classes of the ground.
    fn classes<'py>(&self, py: Python<'py>, xy: PyReadonlyArray2<'py, f64>) -> PyResult<Bound<'py, PyArray1<u8>>> {
        let each = |ground: &LoadedGround, places: &[[f64; 2]], classes: &mut [u8]| {
            for (class, &place) in classes.iter_mut().zip(places) {
                *class = ground.sample(place).map_or(HOLE_CLASS, |sample| sample.class);
            }
        };
        Ok(PyArray1::from_vec(py, self.ask(py, (places(&xy)?, AT_ONCE), HOLE_CLASS, each)?))
    }

    /// Whether each line, six numbers from an eye to a target, meets nothing and stays on the ground: lines from one
    /// eye, one after the other, take less time.
    fn seen<'py>(
        &self,
        py: Python<'py>,
        lines: PyReadonlyArray2<'py, f64>,
        objects: &str,
    ) -> PyResult<Bound<'py, PyArray1<bool>>> {
        let past = PastObjects { standing: standing(py, objects)?, ..PastObjects::all(Curvature::NONE) };
        let each = |ground: &LoadedGround, lines: &[[f64; 6]], seen: &mut [bool]| {
            for (lines, seen) in runs_from_one_eye(lines, seen) {
                let mut eye = (EYE_LINES_MIN <= lines.len()).then(|| ground.eye(ends(&lines[0])[0], Curvature::NONE));
                for (line, seen) in lines.iter().zip(seen) {
                    let [from, to] = ends(line);
                    *seen = match &mut eye {
                        Some(eye) => eye.sees(to) && past.least <= eye.light(to, past.standing),
                        None => ground.sight_past(from, to, &past).sight == Sight::Free,
                    };
                }
            }
        };
        Ok(PyArray1::from_vec(py, self.ask(py, (places(&lines)?, LINES_AT_ONCE), false, each)?))
    }

    /// Heights along a line through places: metres along it, east, north, height, that of a deck above it, class.
    fn profile<'py>(
        &self,
        py: Python<'py>,
        xy: PyReadonlyArray2<'py, f64>,
        spacing_m: f64,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let (held, through) = (self.held(py)?, places(&xy)?.to_vec());
        let found = py.detach(|| {
            let block = around(&held.opened.area, &through);
            self.loaded(held, block).map(|ground| ground.profile(&through, spacing_m))
        });
        let row = |point: ProfilePoint| {
            let number = |number: Option<f64>| number.unwrap_or(f64::NAN);
            let [east, north] = point.place_m;
            let class = f64::from(point.class.unwrap_or(HOLE_CLASS));
            [point.along_m, east, north, number(point.height_m), number(point.deck_m), class]
        };
        table(py, found.map_err(|failure| raised(py, &failure))?.into_iter().map(row))
    }

    /// How far along each line something hides the rest, 2 where nothing does and not a number where the line leaves
    /// the ground first; how far the line stays above the ground at least; the share of light that woods leave; and
    /// what hides, by its place in `hiders`.
    fn sights<'py>(
        &self,
        py: Python<'py>,
        lines: PyReadonlyArray2<'py, f64>,
        objects: &str,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let past = PastObjects { standing: standing(py, objects)?, ..PastObjects::all(Curvature::NONE) };
        let each = |ground: &LoadedGround, lines: &[[f64; 6]], sights: &mut [[f64; 4]]| {
            let is_bare = ground.modules().iter().all(|module| {
                let module = module.module();
                module.decks.is_empty() && (past.standing == Standing::None || module.objects.is_empty())
            });
            for (sight, line) in sights.iter_mut().zip(lines) {
                let [from, to] = ends(line);
                let clearance_m = ground.clearance_m(from, to);
                // What never comes below the ground is seen: both questions look at the same crossings.
                *sight = if is_bare && clearance_m.is_some_and(|metres| 0.0 <= metres) {
                    [FREE, clearance_m.unwrap_or(f64::NAN), 1.0, number_of(None)]
                } else {
                    let found = ground.sight_past(from, to, &past);
                    let share = match found.sight {
                        Sight::Free => FREE,
                        Sight::Hidden(share) => share,
                        Sight::Unknown => f64::NAN,
                    };
                    [share, clearance_m.unwrap_or(f64::NAN), found.transmission, number_of(found.by)]
                };
            }
        };
        table(py, self.ask(py, (places(&lines)?, LINES_AT_ONCE), [f64::NAN; 4], each)?.into_iter())
    }

    /// The words for what hides; the last one is for nothing.
    #[staticmethod]
    fn hiders() -> Vec<&'static str> {
        Hider::ALL.iter().map(|hider| hider.name()).chain([""]).collect()
    }

    /// Heights of what lies on top at places: woods and all, or only what can be stood on.
    fn tops<'py>(
        &self,
        py: Python<'py>,
        xy: PyReadonlyArray2<'py, f64>,
        with_woods: bool,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let each = |ground: &LoadedGround, places: &[[f64; 2]], heights: &mut [f64]| {
            for (height, &place) in heights.iter_mut().zip(places) {
                let top = || ground.top(place).map(|top| top.height_m);
                let found = if with_woods { top() } else { ground.roof_m(place) };
                *height = found.unwrap_or(f64::NAN);
            }
        };
        Ok(PyArray1::from_vec(py, self.ask(py, (places(&xy)?, AT_ONCE), f64::NAN, each)?))
    }

    /// What a vehicle hits at a place: word for its kind, id, metres to it, metres between stems.
    fn obstacle(&self, py: Python<'_>, place_m: [f64; 3], radius_m: f64) -> PyResult<Option<Hit>> {
        let held = self.held(py)?;
        let reached = [-1.0, 1.0].map(|side| [place_m[0] + side * radius_m, place_m[1] + side * radius_m]);
        let found = py.detach(|| {
            let block = around(&held.opened.area, &reached);
            self.loaded(held, block).map(|ground| ground.obstacle_at(place_m, radius_m))
        });
        let found = found.map_err(|failure| raised(py, &failure))?;
        Ok(found.map(|found| (found.kind.name(), found.id, found.distance_m, found.spacing_m)))
    }

    /// What stands on the ground: pieces of prisms, and of canopies.
    fn objects(&self, py: Python<'_>) -> PyResult<(Vec<PrismRow>, Vec<CanopyRow>)> {
        let opened = self.held(py)?.opened;
        wait(py, None, move |_, _| objects_of(whole(&opened)?).map_err(|error| damaged(&error)))
    }

    /// One load module at a level of detail.
    fn module<'py>(&self, py: Python<'py>, row: u32, col: u32, level: u16) -> PyResult<ModuleArrays<'py>> {
        let opened = self.held(py)?.opened;
        let area = &opened.area;
        let block = Block { south: row, west: col, north: row.saturating_add(1), east: col.saturating_add(1) };
        py.detach(|| opened.contents.files_of(block).map(drop)).map_err(|failure| raised(py, &failure))?;
        let loaded = py.detach(|| area.load_level(block, level));
        let loaded = loaded.map_err(|error| {
            let (rows, cols) = (area.frame().rows, area.frame().cols);
            let hint = format!("rows go from 0 to {}, columns from 0 to {}, from the south-west", rows - 1, cols - 1);
            named(py, "RequestError", &error.to_string(), &hint)
        })?;
        let Some(module) = loaded.modules().first().map(|module| module.module()) else {
            return Err(raised(py, &Failure::bug()));
        };
        let metres = |quanta: i32| f64::from(quanta) / f64::from(QUANTA_PER_METRE);
        let side_m = area.frame().side_m();
        let [east, north] = area.frame().origin_m;
        let corner = [east + f64::from(col) * side_m, north + f64::from(row) * side_m];
        let vertices = module.vertices.iter().map(|vertex| {
            let [x, y] = [vertex.x, vertex.y].map(i32::from).map(metres);
            [corner[0] + x, corner[1] + y, metres(vertex.z)]
        });
        let residual = PyDict::new(py);
        residual.set_item("posts", module.residual.posts)?;
        residual.set_item("rms_m", module.residual.rms_m())?;
        let mean_abs = module.residual.sum_abs as f64 / f64::from(module.residual.posts);
        residual.set_item("mean_abs_m", mean_abs / f64::from(QUANTA_PER_METRE))?;
        residual.set_item("max_m", f64::from(module.residual.largest) / f64::from(QUANTA_PER_METRE))?;
        let triangles = module.triangles.iter().map(|corners| corners.map(u32::from));
        let classes = PyArray1::from_slice(py, &module.classes);
        Ok((table(py, vertices)?, table(py, triangles)?, classes, residual))
    }

    /// A row for each load module: row, column, triangles, vertices, posts measured, RMS and largest residual.
    fn modules<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let opened = self.held(py)?.opened;
        let rows = wait(py, None, move |_, _| rows_of(whole(&opened)?).map_err(|error| damaged(&error)))?;
        table(py, rows.into_iter())
    }
}

/// Word for the kind, id, metres to it, metres between stems.
type Hit = (&'static str, u64, f64, Option<f64>);
/// Word for the kind, id, metres of base and roof, rings on the map.
type PrismRow = (&'static str, u64, f64, f64, Vec<Vec<[f64; 2]>>);
/// Word for the kind, id, metres of height and between stems, fullness, triangles on the map.
type CanopyRow = (&'static str, u64, f64, f64, f64, Vec<[[f64; 2]; 3]>);

/// All that stands in load modules, row by row from the south-west.
fn objects_of(area: &Area) -> Result<(Vec<PrismRow>, Vec<CanopyRow>), ReadError> {
    let metres = |quanta: i32| f64::from(quanta) / f64::from(QUANTA_PER_METRE);
    let (mut prisms, mut canopies) = (Vec::new(), Vec::new());
    for south in 0..area.frame().rows {
        let ground = area.load(Block { south, west: 0, north: south + 1, east: area.frame().cols })?;
        for module in ground.modules().iter().map(|module| module.module()) {
            let [east, north] = [module.col, module.row].map(|index| f64::from(index) * area.frame().side_m());
            let corner = [area.frame().origin_m[0] + east, area.frame().origin_m[1] + north];
            let place = |x: u16, y: u16| [corner[0] + metres(x.into()), corner[1] + metres(y.into())];
            prisms.extend(module.objects.prisms.iter().map(|prism| {
                let rings = prism.rings.iter().map(|ring| ring.iter().map(|at| place(at.x, at.y)).collect()).collect();
                (prism.kind.name(), prism.id, metres(prism.base), metres(prism.roof), rings)
            }));
            canopies.extend(module.objects.canopies.iter().map(|canopy| {
                let at = |index: u16| canopy.places[usize::from(index)];
                let triangle = |corners: &[u16; 3]| corners.map(|index| place(at(index)[0], at(index)[1]));
                let triangles = canopy.triangles.iter().map(triangle).collect();
                let [height, spacing] = [canopy.height, canopy.spacing].map(|quanta| metres(quanta.into()));
                (canopy.kind.name(), canopy.id, height, spacing, f64::from(canopy.fullness) / 100.0, triangles)
            }));
        }
    }
    Ok((prisms, canopies))
}

/// What there is to tell of every load module.
fn rows_of(area: &Area) -> Result<Vec<[f64; 7]>, ReadError> {
    let mut all = Vec::with_capacity(area.whole().count());
    for south in 0..area.frame().rows {
        let ground = area.load(Block { south, west: 0, north: south + 1, east: area.frame().cols })?;
        all.extend(ground.modules().iter().map(|module| {
            let module = module.module();
            let residual = &module.residual;
            [
                f64::from(module.row),
                f64::from(module.col),
                module.triangles.len() as f64,
                module.vertices.len() as f64,
                f64::from(residual.posts),
                residual.rms_m().unwrap_or(f64::NAN),
                f64::from(residual.largest) / f64::from(QUANTA_PER_METRE),
            ]
        }));
    }
    Ok(all)
}

/// The load modules of a database, all of whose files are of its build.
fn whole(opened: &Opened) -> Result<&Area, Failure> {
    opened.contents.files_of(opened.area.whole())?;
    Ok(&opened.area)
}
