//! Whether two simulators would fight fairly: how far two surfaces of one area agree in heights, slopes and lines of
//! sight, at places drawn from a seed, accepted or not by a plan of acceptance sampling.
//!
//! The same surfaces and the same request give the same figures, whatever the number of workers.

mod statistics;
pub use statistics::{Confusion, Demand, Kappa, Plan, SAMPLES_MAX};
mod surface;
pub use surface::SurfaceFacts;
mod places;
mod shift;
pub use shift::Shift;
mod feet;
pub use feet::Feet;
mod heights;
pub use heights::{DifferenceMap, HeightFigures, SLOPE_CLASSES, SLOPE_ENDS_DEGREES, SlopeFigures};
mod found;
pub use found::{ClassFigures, CorrelateRequest, Correlation, Criterion, SightFigures};
mod criteria;
mod holes;

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::atomic::AtomicBool;

use build::CompileError;
use build::ground::GroundError;
use build::workbench::is_same_datum;
use fidelity::Draw;
use load_module_reader::Standing;
use schedule::Workers;

use found::larger_spacing_m;
use heights::{Place, Slopes};
use holes::has_ground_along;
use places::{Common, Tell};
use surface::{Ground, Surface};

/// Metres above the ground of both ends of lines of sight.
pub const SIGHT_HEIGHTS_M: [f64; 3] = [1.0, 2.5, 10.0];
/// Nearest target, in metres.
pub const NEAREST_M: f64 = 50.0;
/// Number of the first draw of a pair, so that none is drawn with the numbers of a place.
const FIRST_PAIR: u64 = 1 << 40;

/// Compares the terrain database in the folder `first` with the one in `second`, or with a raster of heights. `tell` is
/// told what is looked at, how many of it are done, and of how many, from any thread.
///
/// # Errors
/// When one cannot be read, they have not one coordinate system, datum and area, or no sample is large enough.
pub fn correlate(
    first: &Path,
    second: &Path,
    request: &CorrelateRequest,
    (workers, stop, tell): (usize, &AtomicBool, &Tell<'_>),
) -> Result<Correlation, CompileError> {
    let plan = plan_of(request)?;
    if !first.is_dir() {
        let (key, found) = (first.display().to_string(), "no folder".to_owned());
        let hint = "name the terrain database first; what it is compared with may be a raster";
        return Err(impossible(key, found, "the folder of a terrain database", hint));
    }
    let workers = Workers::new(workers);
    let (a, b) = (Surface::open(first, &workers, stop)?, Surface::open(second, &workers, stop)?);
    let mut notes = check_systems(&a.facts, &b.facts, request.allow_datums)?;
    let common_m = common_area(&a.facts, &b.facts)?;
    let surfaces = [a.facts.clone(), b.facts.clone()];
    let has_both = surfaces.iter().all(|surface| surface.has_objects);
    let standing = if has_both { request.standing } else { Standing::None };
    if standing != request.standing && surfaces.iter().any(|surface| surface.has_objects) {
        notes.push("lines of sight go over the ground alone: only one of both has objects".into());
    }
    let apart_m = larger_spacing_m(&surfaces);
    let reach_m = request.range_m.max(18.0 * apart_m);
    let mut common = Common::new((&a, &b), common_m, reach_m, (&workers, stop, tell))?;
    let places = draw_places(&mut common, plan.samples, request.seed, apart_m)?;
    let pairs = draw_pairs(&mut common, plan.samples, request, standing)?;

    let places_of = |which: usize| {
        places
            .judged
            .iter()
            .filter(move |(_, place)| place.heights_m[which].is_some() && place.heights_m[1 - which].is_none())
    };
    let only_one = [0, 1].map(|which| places_of(which).count() as u64);
    let differences: Vec<([f64; 2], f64)> =
        places.judged.iter().filter_map(|(at, place)| Some((*at, place.difference_m()?))).collect();
    let both: Vec<[f64; 2]> = differences.iter().map(|(at, _)| *at).collect();
    let shift = shift::best_shift(&mut common, &both, apart_m)?;
    let slopes = places.judged.iter().map(|(_, place)| place.slopes);
    let looked = || pairs.judged.iter().map(|(_, looked)| *looked);
    let told = looked().filter_map(|looked| if let Looked::Told(sights) = looked { Some(sights) } else { None });
    let mut found = Correlation {
        request: *request,
        common_m,
        plan,
        notes,
        only_one,
        void_places: places.left_out,
        heights: HeightFigures::of(&differences, request.within_m),
        feet: Feet::of(places.judged.iter().map(|(_, place)| place.heights_m), shift.as_ref()),
        shift,
        slopes: SlopeFigures::of(slopes, apart_m, request.slope_within_degrees),
        classes: by_class(&places.judged, &surfaces[0].classes, request.within_m),
        standing,
        sights: tally_sights(told),
        only_one_pairs: [0, 1].map(|which| looked().filter(|looked| *looked == Looked::OverOne(which)).count() as u64),
        void_pairs: pairs.left_out,
        criteria: Vec::new(),
        causes: Vec::new(),
        map: DifferenceMap::of(&differences, common_m),
        surfaces,
    };
    found.criteria = criteria::criteria(&found);
    found.causes = criteria::causes(&found);
    Ok(found)
}

fn impossible(key: String, found: String, expected: &str, hint: &str) -> CompileError {
    GroundError::Impossible { key, found, expected: expected.into(), hint: hint.into() }.into()
}

/// The plan of a request: its own, or that of as many samples as it asks for.
fn plan_of(request: &CorrelateRequest) -> Result<Plan, CompileError> {
    let Some(samples) = request.samples else {
        return request.demand.plan().ok_or_else(|| {
            let found = format!("more than {SAMPLES_MAX} places to look at");
            impossible("accept, risk".into(), found, "fewer", "ask for a smaller share, or allow a larger risk")
        });
    };
    let failures_max = request.demand.failures_max(samples).ok_or_else(|| {
        let least = request.demand.samples_min().map_or("more".into(), |least| format!("{least} at least"));
        let hint = "with so few, not even agreement at every place keeps the risk: look at more places";
        impossible("samples".into(), samples.to_string(), &least, hint)
    })?;
    Ok(Plan { samples, failures_max })
}

/// Refuses surfaces in different systems; what a person should know about their datums.
fn check_systems(a: &SurfaceFacts, b: &SurfaceFacts, allow_datums: bool) -> Result<Vec<String>, CompileError> {
    if a.crs != b.crs {
        let expected = format!("that of {}, {}", a.path, a.crs);
        let hint = "nothing is converted here: build the database, or warp the raster, in the system of the first";
        return Err(impossible(format!("{}: coordinate system", b.path), b.crs.clone(), &expected, hint));
    }
    let unknown = [a, b].into_iter().filter(|surface| surface.vertical_datum.is_empty());
    let mut notes: Vec<String> = unknown
        .map(|surface| format!("{} does not say what its heights are above; they are taken as they are", surface.path))
        .collect();
    if notes.is_empty() && !is_same_datum(&a.vertical_datum, &b.vertical_datum) {
        if !allow_datums {
            let expected = format!("that of {}, {}", a.path, a.vertical_datum);
            let hint = "bring both to one datum, as dem.vertical_datum and dem.geoids of a job do; or compare heights \
                        as they are: --allow-datums";
            return Err(impossible(format!("{}: vertical datum", b.path), b.vertical_datum.clone(), &expected, hint));
        }
        let [a, b] = [&a.vertical_datum, &b.vertical_datum];
        notes.push(format!("heights of A are above {a}, those of B above {b}; they are compared as they are"));
    }
    Ok(notes)
}

/// What both reach.
fn common_area(a: &SurfaceFacts, b: &SurfaceFacts) -> Result<[f64; 4], CompileError> {
    let inner = |index: usize, choose: fn(f64, f64) -> f64| choose(a.extent_m[index], b.extent_m[index]);
    let common @ [west, south, east, north] =
        [inner(0, f64::max), inner(1, f64::max), inner(2, f64::min), inner(3, f64::min)];
    if west < east && south < north {
        return Ok(common);
    }
    let text = |[west, south, east, north]: [f64; 4]| format!("from {west},{south} to {east},{north}");
    let expected = format!("ground in common with {}, {}", a.path, text(a.extent_m));
    let hint = "name two surfaces of one area";
    Err(impossible(b.path.clone(), format!("ground {}", text(b.extent_m)), &expected, hint))
}

fn draw_places(
    common: &mut Common<'_>,
    wanted: u64,
    seed: u64,
    apart_m: f64,
) -> Result<places::Drawn<[f64; 2], Place>, CompileError> {
    let (size_m, [west, south, east, north]) = (common.size_m(), common.rect_m);
    let half_m = 0.5 * apart_m;
    let is_inside =
        |[x, y]: [f64; 2]| west <= x - half_m && x + half_m <= east && south <= y - half_m && y + half_m <= north;
    let draw = |index: u64| {
        let [x, y] = Draw::new(seed, index).place(size_m);
        Some([west + x, south + y])
    };
    let look = |a: &Ground, b: &Ground, at: &[f64; 2]| {
        let heights_m = [a.height_m(*at), b.height_m(*at)];
        let slopes = match is_inside(*at) {
            true => Slopes::of(heights_m, [a.gradient(*at, apart_m), b.gradient(*at, apart_m)]),
            false => Slopes::Untold,
        };
        let class = a.class(*at);
        heights_m.iter().any(Option::is_some).then_some(Place { heights_m, class, slopes })
    };
    common.drawn("places", wanted, draw, |at| *at, look)
}

/// Whether A and B show the far end, at each height above the ground.
type Sights = [[bool; 2]; SIGHT_HEIGHTS_M.len()];

/// What a pair of places shows.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Looked {
    Told(Sights),
    /// Only this surface, 0 for A and 1 for B, has ground all along the line.
    OverOne(usize),
}

fn draw_pairs(
    common: &mut Common<'_>,
    wanted: u64,
    request: &CorrelateRequest,
    standing: Standing,
) -> Result<places::Drawn<[[f64; 2]; 2], Looked>, CompileError> {
    let (size_m, [west, south, ..], range_m) = (common.size_m(), common.rect_m, request.range_m);
    let draw = |index: u64| {
        let pair = Draw::new(request.seed, FIRST_PAIR + index).pair(size_m, [NEAREST_M, range_m])?;
        Some(pair.map(|[x, y]| [west + x, south + y]))
    };
    let look = |a: &Ground, b: &Ground, pair: &[[f64; 2]; 2]| {
        match [a, b].map(|ground| has_ground_along(ground, *pair)) {
            [true, true] => {}
            [true, false] => return Some(Looked::OverOne(0)),
            [false, true] => return Some(Looked::OverOne(1)),
            [false, false] => return None,
        }
        let mut sights = Sights::default();
        for (sight, above_m) in sights.iter_mut().zip(SIGHT_HEIGHTS_M) {
            *sight = [a.sees(*pair, above_m, standing)?, b.sees(*pair, above_m, standing)?];
        }
        Some(Looked::Told(sights))
    };
    common.drawn("lines of sight", wanted, draw, |pair| pair[0], look)
}

fn tally_sights(pairs: impl Iterator<Item = Sights>) -> Vec<SightFigures> {
    let mut figures = SIGHT_HEIGHTS_M.map(|above_m| SightFigures { above_m, pairs: Confusion([[0; 2]; 2]) });
    for sights in pairs {
        for (figures, [a, b]) in figures.iter_mut().zip(sights) {
            figures.pairs.0[usize::from(a)][usize::from(b)] += 1;
        }
    }
    figures.into()
}

/// Figures by class of A, by number, where places lie in several.
fn by_class(places: &[([f64; 2], Place)], names: &[String], within_m: f64) -> Vec<ClassFigures> {
    let mut classes: BTreeMap<u8, Vec<([f64; 2], f64)>> = BTreeMap::new();
    for (at, place) in places {
        if let Some((class, difference_m)) = place.class.zip(place.difference_m()) {
            classes.entry(class).or_default().push((*at, difference_m));
        }
    }
    if classes.len() < 2 {
        return Vec::new();
    }
    let name = |class: u8| names.get(usize::from(class)).cloned().unwrap_or_else(|| format!("class {class}"));
    let figures = |(class, differences): (u8, Vec<_>)| ClassFigures {
        name: name(class),
        heights: HeightFigures::of(&differences, within_m),
    };
    classes.into_iter().map(figures).collect()
}
