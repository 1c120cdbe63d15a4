//! Lakes lie level: each water body at one height, its shore with it.

use std::collections::{BTreeSet, HashMap, HashSet};

use crate::clean::Notes;
use crate::rings::encloses;
use crate::strand::{Role, Strand};
use crate::thin::{Station, Tolerance, thin};
use crate::{FallOptions, FeatureLattice, Flaw, Kind, Outline, Place, Remark, Remedy, Ring, Site};

/// A level that its source gives may lie this far, in quanta, from the heights of the shore: 10 m.
const LEVEL_OFF_MAX: i32 = 10 * 128;

/// A polygon of a river without a line inside is a lake where its shore varies by less than this, in quanta: 2 m.
const SHORE_SPREAD_MAX: i32 = 2 * 128;

/// Posts inside a lake from which they tell whether it is flat.
const INSIDE_MIN: u64 = 9;

/// Half the posts inside a flat lake lie within so many quanta: 1 m.
const FLAT_SPREAD: i32 = 128;

/// A level is uncertain where the upper tenth of heights lies so many quanta above the lower one: 10 m.
const SPREAD_TOLD: i32 = 10 * 128;

/// A body of water at one level.
#[derive(Clone, Debug, PartialEq)]
pub struct Lake {
    /// Its outline, in the list that was given.
    pub outline: u32,
    /// Its level in quanta.
    pub level: i32,
    /// Whether its source says so.
    pub is_fixed: bool,
    /// Its body of water: the number of the first lake with which it shares shore.
    pub body: u32,
    /// Cubic metres of ground that the shore is lifted by, to the level plus one quantum.
    pub fill_m3: i64,
}

/// Lakes, and what else polygons of water became.
#[derive(Clone, Debug, PartialEq)]
pub struct Waters {
    /// Polygons that lie level.
    pub lakes: Vec<Lake>,
    /// Polygons of rivers with a line inside: those numbers of outlines lie level across.
    pub banks: Vec<u32>,
    /// Polygons that are an outline only.
    pub outlines_only: Vec<u32>,
}

/// How often each height occurs at the posts inside a lake, in quanta, ascending.
pub type Histogram = Vec<(i32, u32)>;

/// What the DEM says of the outlines of water: one of each for every outline.
#[derive(Clone, Copy)]
pub struct Shores<'a> {
    /// A height for each place of each ring, ring after ring.
    pub heights: &'a [Vec<Option<i32>>],
    /// Heights of the posts inside.
    pub inside: &'a [Histogram],
    /// Whether a river runs inside.
    pub has_line: &'a [bool],
}

/// Decides the level of each water body by the heights along its shore and inside; `dams` are places on dams, at which
/// two bodies stay apart.
///
/// Outlines of other kinds than water are passed over.
pub fn level(
    outlines: &[Outline],
    shores: Shores,
    dams: &dyn Fn(Place) -> bool,
    options: FallOptions,
    lattice: FeatureLattice,
    remarks: &mut Vec<Remark>,
) -> Waters {
    let mut waters = Waters { lakes: Vec::new(), banks: Vec::new(), outlines_only: Vec::new() };
    for (number, outline) in outlines.iter().enumerate() {
        let mut notes = Notes { id: outline.id, lattice, remarks };
        let first = outline.rings.first().and_then(|ring| ring.places.first().copied());
        let mut shore: Vec<i32> = shores.heights[number].iter().copied().flatten().collect();
        shore.sort_unstable();
        let spread = shore.last().zip(shore.first()).map_or(0, |(most, least)| most - least);
        match outline.traits.kind {
            Kind::River if shores.has_line[number] => waters.banks.push(number as u32),
            Kind::River if SHORE_SPREAD_MAX <= spread => {
                notes.write_of(first, Flaw::NoLineInside, Remedy::OutlineOnly);
                waters.outlines_only.push(number as u32);
            }
            Kind::River | Kind::Lake => {
                if outline.traits.kind == Kind::River {
                    notes.write_of(first, Flaw::NoLineInside, Remedy::BecameLake);
                }
                let (level, is_fixed) = level_of(outline, (&shore, &shores.inside[number]), options, first, &mut notes);
                let body = waters.lakes.len() as u32;
                waters.lakes.push(Lake { outline: number as u32, level, is_fixed, body, fill_m3: 0 });
            }
            _ => {}
        }
    }
    join_bodies(outlines, &mut waters.lakes, dams);
    join_nested(outlines, &mut waters.lakes, lattice, remarks);
    waters
}

/// Counts what shores are lifted by, once levels are decided, and writes it down.
pub fn lift_shores(
    outlines: &[Outline],
    shores: &[Vec<Option<i32>>],
    lakes: &mut [Lake],
    lattice: FeatureLattice,
    remarks: &mut Vec<Remark>,
) {
    for lake in lakes {
        let outline = &outlines[lake.outline as usize];
        lake.fill_m3 = fill(outline, &shores[lake.outline as usize], lake.level, lattice);
        if 0 < lake.fill_m3 {
            let first = outline.rings[0].places.first().copied();
            let flaw = Flaw::ShoreBelowWater { cubic_metres: lake.fill_m3 };
            Notes { id: outline.id, lattice, remarks }.write_of(first, flaw, Remedy::Lifted);
        }
    }
}

/// The level of a source if it fits the shore, else that of the flat inside, else a low one of all heights that cuts
/// and fills no more than may be; and whether it is the source's. `shore` is sorted.
fn level_of(
    outline: &Outline,
    (shore, inside): (&[i32], &Histogram),
    options: FallOptions,
    first: Option<Place>,
    notes: &mut Notes,
) -> (i32, bool) {
    let (least, most) = match (shore.first(), shore.last()) {
        (Some(least), Some(most)) => (*least, *most),
        _ => return (outline.traits.level.unwrap_or(0), outline.traits.level.is_some()),
    };
    match outline.traits.level {
        Some(level) if least - LEVEL_OFF_MAX <= level && level <= most + LEVEL_OFF_MAX => return (level, true),
        Some(found) => notes.write_of(first, Flaw::LevelRefused { found }, Remedy::ShoreTaken),
        None => {}
    }
    if let Some(level) = flat_inside(inside) {
        return (level, false);
    }
    let mut all: Vec<(i32, u32)> = shore.iter().map(|height| (*height, 1)).chain(inside.iter().copied()).collect();
    all.sort_unstable();
    let [low, level, high] = [100, options.tau, 900].map(|thousandths| quantile(&all, thousandths));
    if SPREAD_TOLD < high - low {
        notes.write_of(first, Flaw::LevelUncertain { quanta: high - low }, Remedy::ShoreTaken);
    }
    let (least, most) = (high - options.cut_max, low + options.fill_max);
    (if most < least { (least + most) >> 1 } else { level.clamp(least, most) }, false)
}

/// The middle of the shortest span that holds half of the posts inside, where that is short.
fn flat_inside(inside: &Histogram) -> Option<i32> {
    let count: u64 = inside.iter().map(|(_, count)| u64::from(*count)).sum();
    if count < INSIDE_MIN {
        return None;
    }
    let half = count / 2 + 1;
    let (mut best, mut end, mut held): (Option<(i32, i32)>, usize, u64) = (None, 0, 0);
    for &(from, of_from) in inside {
        while held < half && end < inside.len() {
            held += u64::from(inside[end].1);
            end += 1;
        }
        if held < half {
            break;
        }
        let span = inside[end - 1].0 - from;
        best = Some(best.map_or((span, from), |best| best.min((span, from))));
        held -= u64::from(of_from);
    }
    best.filter(|(span, _)| *span <= FLAT_SPREAD).map(|(span, from)| {
        let held: Vec<(i32, u32)> =
            inside.iter().copied().filter(|(height, _)| (from..=from + span).contains(height)).collect();
        quantile(&held, 500)
    })
}

/// The height below which so many thousandths of some lie; ascending, each so many times.
fn quantile(heights: &[(i32, u32)], thousandths: u32) -> i32 {
    let count: u64 = heights.iter().map(|(_, count)| u64::from(*count)).sum();
    let mut left = count.saturating_sub(1) * u64::from(thousandths) / 1000;
    for &(height, count) in heights {
        if left < u64::from(count) {
            return height;
        }
        left -= u64::from(count);
    }
    heights.last().map_or(0, |(height, _)| *height)
}

/// Bodies that share a stretch of shore are one, at the lowest of their levels; a dam keeps them apart.
fn join_bodies(outlines: &[Outline], lakes: &mut [Lake], dams: &dyn Fn(Place) -> bool) {
    let mut body: Vec<usize> = (0..lakes.len()).collect();
    // Every second one on the way is led past the next, so that no way gets long.
    let root = |body: &mut [usize], mut at: usize| {
        while body[at] != at {
            body[at] = body[body[at]];
            at = body[at];
        }
        at
    };
    let mut at_place: HashMap<Place, usize> = HashMap::new();
    for (number, lake) in lakes.iter().enumerate() {
        let places = outlines[lake.outline as usize].rings.iter().flat_map(|ring| &ring.places);
        for place in places.filter(|place| !dams(**place)) {
            let other = *at_place.entry(*place).or_insert(number);
            let (one, other) = (root(&mut body, number), root(&mut body, other));
            body[one.max(other)] = one.min(other);
        }
    }
    let mut levels: HashMap<usize, (i32, bool)> = HashMap::new();
    for (number, lake) in lakes.iter().enumerate() {
        let level = (lake.level, lake.is_fixed);
        let lower = |other: &mut (i32, bool)| *other = if level.0 < other.0 { level } else { *other };
        levels.entry(root(&mut body, number)).and_modify(lower).or_insert(level);
    }
    for (number, lake) in lakes.iter_mut().enumerate() {
        lake.body = root(&mut body, number) as u32;
        (lake.level, lake.is_fixed) = levels[&(lake.body as usize)];
    }
}

/// What lies inside another lake, and on none of its islands, is water of that lake and lies at its level.
fn join_nested(outlines: &[Outline], lakes: &mut [Lake], lattice: FeatureLattice, remarks: &mut Vec<Remark>) {
    let bounds = |lake: &Lake| {
        let places = || outlines[lake.outline as usize].places();
        let [rows, cols] = [|place: Place| place.row, |place: Place| place.col].map(|at| {
            let along = || places().map(at);
            (along().min().unwrap_or(0), along().max().unwrap_or(0))
        });
        [rows, cols]
    };
    let bounds: Vec<[(i32, i32); 2]> = lakes.iter().map(bounds).collect();
    for inner in 0..lakes.len() {
        let Some(first) = outlines[lakes[inner].outline as usize].places().next() else { continue };
        let is_within = |outer: usize| {
            let within = |axis: usize| {
                bounds[outer][axis].0 < bounds[inner][axis].0 && bounds[inner][axis].1 < bounds[outer][axis].1
            };
            let rings = || &outlines[lakes[outer].outline as usize].rings;
            within(0) && within(1) && rings().iter().filter(|ring| encloses(&ring.places, first)).count() % 2 == 1
        };
        // Of several that do, the outermost.
        let Some(outer) = (0..lakes.len()).filter(|&outer| is_within(outer)).min_by_key(|&outer| bounds[outer][0].0)
        else {
            continue;
        };
        let (from, Lake { level, is_fixed, body, .. }) = (lakes[inner].body, lakes[outer].clone());
        if from == body {
            continue;
        }
        if lakes[inner].level != level {
            let mut notes = Notes { id: outlines[lakes[inner].outline as usize].id, lattice, remarks };
            notes.write_at(first, Flaw::LevelsDisagree, Remedy::Levelled);
        }
        for lake in lakes.iter_mut().filter(|lake| lake.body == from) {
            *lake = Lake { level, is_fixed, body, ..lake.clone() };
        }
    }
}

/// Cubic metres between the shore and the level plus a quantum, over a post's width outside.
fn fill(outline: &Outline, shore: &[Option<i32>], level: i32, lattice: FeatureLattice) -> i64 {
    let post = f64::from(lattice.steps_per_post()) * lattice.metres_per_step();
    let (mut cubic, mut at) = (0.0, 0);
    for ring in &outline.rings {
        for (number, place) in ring.places.iter().enumerate() {
            let next = ring.places[(number + 1) % ring.places.len()];
            let lack = shore[at].map_or(0, |height| (level + 1 - height).max(0));
            cubic +=
                terrain::metres_of_quanta(lack) * terrain::metres_of_quanta(lattice.length(*place, next) as i32) * post;
            at += 1;
        }
    }
    cubic as i64
}

/// The shore of a lake as strands at its level.
pub fn shore(outline: &Outline, level: i32) -> Vec<Strand> {
    strands(outline, Role::Shore, &|_, _| level)
}

/// A polygon of a river level across: each place of its bank has the height of the nearest place of the lines inside.
///
/// `line` are edges of the river inside the outline, with the heights of their ends. Where lines between load modules
/// run inside from bank to bank, they are banks, too, as far as the water does not fall evenly along them: they are
/// edges of the TIN.
pub fn banks(outline: &Outline, line: &[([Place; 2], [i32; 2])], site: &Site) -> Vec<Strand> {
    let height = |place: Place| nearest_height(line, place).unwrap_or(0);
    let mut strands = strands(outline, Role::Bank, &|place, _| height(place));
    for chord in chords(outline, site) {
        let station = |place| Station { place, height: height(place), stays: false, flat: [0; 2] };
        let stations: Vec<Station> = chord.into_iter().map(station).collect();
        let kept = thin(&stations, Tolerance::USUAL, 0, site.lattice);
        if 2 < kept.len() {
            let stations = kept.into_iter().map(|at| &stations[at as usize]).map(|it| (it.place, it.height)).collect();
            strands.push(Strand { role: Role::Bank, class: outline.traits.class, id: outline.id, stations });
        }
    }
    strands
}

/// What of tile and load-module lines lies inside an outline: places a post apart, from bank to bank.
fn chords(outline: &Outline, site: &Site) -> Vec<Vec<Place>> {
    let mut on_lines: BTreeSet<(bool, i32, i32)> = BTreeSet::new();
    for place in outline.places() {
        let [row, col] = site.lines_at(place);
        on_lines.extend(row.then_some((true, place.row, place.col)));
        on_lines.extend(col.then_some((false, place.col, place.row)));
    }
    let mut of_rings: HashSet<(Place, Place)> = HashSet::new();
    for places in outline.rings.iter().map(|ring| &ring.places) {
        of_rings.extend(places.iter().copied().zip(places.iter().copied().cycle().skip(1)));
    }
    let post = site.lattice.steps_per_post() as usize;
    let on_lines: Vec<(bool, i32, i32)> = on_lines.into_iter().collect();
    let chord = |pair: &[(bool, i32, i32)]| {
        let [(is_row, line, from), (other, other_line, to)] = [pair[0], pair[1]];
        let place = |at: i32| if is_row { Place::new(line, at) } else { Place::new(at, line) };
        let (a, b) = (place(from), place(to));
        let is_chord = (is_row, line) == (other, other_line)
            && (post as i32) < to - from
            && !of_rings.contains(&(a, b))
            && !of_rings.contains(&(b, a))
            && outline.rings.iter().filter(|ring| encloses(&ring.places, place(from.midpoint(to)))).count() % 2 == 1;
        is_chord.then(|| (from..to).step_by(post).map(place).chain([b]).collect())
    };
    on_lines.windows(2).filter_map(chord).collect()
}

/// An outline whose heights are those of the ground.
pub fn outline_only(outline: &Outline, shore: &[Option<i32>]) -> Vec<Strand> {
    strands(outline, Role::Breakline, &|_, at| shore[at].unwrap_or(0))
}

fn nearest_height(line: &[([Place; 2], [i32; 2])], place: Place) -> Option<i32> {
    let nearest = line.iter().min_by_key(|(ends, _)| (nearest_squared(*ends, place), *ends))?;
    Some(crate::decks::between(nearest.0, nearest.1, place))
}

/// The squared distance from a place to a segment, in squares of a sixteenth of a step.
fn nearest_squared([a, b]: [Place; 2], place: Place) -> i128 {
    let ([east, north], [to_east, to_north]) = (a.to(b), a.to(place));
    let whole = i128::from(a.squared_to(b)).max(1);
    let along = i128::from(east * to_east + north * to_north).clamp(0, whole);
    let off = |to: i64, length: i64| 16 * i128::from(to) - (16 * i128::from(length) * along).div_euclid(whole);
    let (east, north) = (off(to_east, east), off(to_north, north));
    east * east + north * north
}

/// The rings of an outline as closed strands; `height` is asked for a place and its number in the shore.
fn strands(outline: &Outline, role: Role, height: &dyn Fn(Place, usize) -> i32) -> Vec<Strand> {
    let mut at = 0;
    let mut strand = |ring: &Ring| {
        let mut stations = Vec::with_capacity(ring.places.len() + 1);
        for place in &ring.places {
            stations.push((*place, height(*place, at)));
            at += 1;
        }
        stations.push(stations[0]);
        Strand { role, class: outline.traits.class, id: outline.id, stations }
    };
    outline.rings.iter().map(&mut strand).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::samples::{ground_at, rounded, site, way};
    use crate::{Rounded, Shape, Source};

    fn lake(number: i64, more: &str, west: f64, east: f64) -> Source {
        let ring = [(west, 10.0), (east, 10.0), (east, 30.0), (west, 30.0), (west, 10.0)];
        way(number, &format!("natural=water {more}"), &ring)
    }

    fn levels(
        sources: Vec<Source>,
        ground: impl Fn(f64, f64) -> f64,
        dams: &dyn Fn(Place) -> bool,
    ) -> (Vec<i32>, Vec<Flaw>, Rounded) {
        let rounded = rounded(sources);
        let shore = |outline: &Outline| {
            outline.rings.iter().flat_map(|ring| &ring.places).map(|place| ground_at(*place, &ground)).collect()
        };
        let shores: Vec<Vec<Option<i32>>> = rounded.outlines.iter().map(shore).collect();
        let mut remarks = rounded.remarks.clone();
        let (none, inside) = (vec![false; shores.len()], vec![Vec::new(); shores.len()]);
        let of = Shores { heights: &shores, inside: &inside, has_line: &none };
        let (lattice, options) = (site().lattice, FallOptions::USUAL);
        let mut waters = level(&rounded.outlines, of, dams, options, lattice, &mut remarks);
        lift_shores(&rounded.outlines, &shores, &mut waters.lakes, lattice, &mut remarks);
        let levels = waters.lakes.iter().map(|lake| lake.level / 128).collect();
        (levels, remarks.into_iter().map(|remark| remark.flaw).collect(), rounded)
    }

    fn none(_: Place) -> bool {
        false
    }

    #[test]
    fn a_level_is_that_of_the_source_or_a_low_one_of_the_shore() {
        let slope = |east: f64, _: f64| 100.0 + east;
        assert_eq!(levels(vec![lake(1, "ele=115", 10.0, 30.0)], slope, &none).0, [115]);
        // A lower third of the shore would be 116, but nine tenths of it may be cut by 10 m at most.
        assert_eq!(levels(vec![lake(1, "", 10.0, 30.0)], slope, &none).0, [120]);
        let (found, flaws, _) = levels(vec![lake(1, "ele=1150", 10.0, 30.0)], slope, &none);
        assert_eq!((found, &flaws[0]), (vec![120], &Flaw::LevelRefused { found: 1150 * 128 }));
        assert_eq!(levels(vec![lake(1, "", 10.0, 20.0)], |east, _| 100.0 + east / 4.0, &none).0, [102]);
    }

    #[test]
    fn a_flat_inside_is_the_level_whatever_the_shore_says() {
        let flat = vec![(-900, 3), (500, 2), (510, 4), (600, 3), (640, 1), (9000, 2)];
        assert_eq!(flat_inside(&flat), Some(510));
        assert_eq!(flat_inside(&flat[1..3].to_vec()), None, "too few to tell");
        assert_eq!(flat_inside(&(0..20).map(|at| (100 * at, 1)).collect()), None);
    }

    #[test]
    fn a_quantile_is_one_of_the_heights() {
        let heights = [(1, 2), (5, 1), (9, 7)];
        assert_eq!([0, 100, 200, 300, 1000].map(|share| quantile(&heights, share)), [1, 1, 1, 5, 9]);
    }

    #[test]
    fn shore_below_the_water_is_counted() {
        let (_, flaws, _) = levels(vec![lake(1, "ele=102", 10.0, 30.0)], |_, _| 100.0, &none);
        // 80 posts of shore, two metres and a quantum high, a post wide.
        assert_eq!(flaws, [Flaw::ShoreBelowWater { cubic_metres: 80 * 10 * 10 * 2 + 62 }]);
    }

    #[test]
    fn bodies_that_share_shore_have_one_level_and_a_dam_keeps_them_apart() {
        let sources = || vec![lake(1, "ele=101", 10.0, 20.0), lake(2, "ele=103", 20.0, 30.0)];
        let flat = |_: f64, _: f64| 104.0;
        assert_eq!(levels(sources(), flat, &none).0, [101, 101]);
        let mut found = levels(sources(), flat, &|place| site().lattice.posts_of(place)[0] == 20.0).0;
        found.sort_unstable();
        assert_eq!(found, [101, 103]);
    }

    #[test]
    fn a_lake_inside_another_lies_at_its_level_and_one_on_an_island_at_its_own() {
        let square = |low: f64, high: f64| [(low, low), (high, low), (high, high), (low, high), (low, low)];
        let lake = |number, level, low, high| way(number, &format!("natural=water ele={level}"), &square(low, high));
        let found = |sources| {
            let (mut found, flaws, _) = levels(sources, |_, _| 104.0, &none);
            found.sort_unstable();
            (found, flaws.contains(&Flaw::LevelsDisagree))
        };
        assert_eq!(found(vec![lake(1, 103, 10.0, 40.0), lake(2, 101, 20.0, 30.0)]), (vec![103, 103], true));
        let (mut ring, island) = (lake(1, 103, 10.0, 40.0), lake(3, 0, 15.0, 35.0));
        let rings = [&ring, &island].map(|source| match &source.shape {
            Shape::Line(positions) => positions.clone(),
            Shape::Polygon(_) => Vec::new(),
        });
        ring.shape = Shape::Polygon(rings.into());
        assert_eq!(found(vec![ring, lake(2, 101, 20.0, 30.0)]), (vec![101, 103], false));
    }

    #[test]
    fn a_river_polygon_without_a_line_is_a_lake_if_its_shore_is_level() {
        let polygon = vec![lake(1, "water=river", 10.0, 30.0)];
        let (found, flaws, _) = levels(polygon.clone(), |_, _| 50.0, &none);
        assert_eq!((found, &flaws[0]), (vec![50], &Flaw::NoLineInside));
        let (found, flaws, rounded) = levels(polygon, |east, _| east, &none);
        assert_eq!((found.len(), flaws), (0, vec![Flaw::NoLineInside]));
        assert_eq!(outline_only(&rounded.outlines[0], &vec![Some(9); 80])[0].stations.len(), 81);
    }

    #[test]
    fn banks_lie_level_across() {
        let rounded = rounded(vec![lake(1, "water=river", 10.0, 30.0)]);
        let place = |east: f64| site().lattice.place_of([east, 20.0]).unwrap();
        let line = [([place(10.0), place(30.0)], [2000, 1000])];
        let strand = &banks(&rounded.outlines[0], &line, &site())[0];
        for (place, height) in &strand.stations {
            let east = site().lattice.posts_of(*place)[0];
            assert_eq!(*height, 2500 - (east * 50.0) as i32);
        }
        assert_eq!(shore(&rounded.outlines[0], 7)[0].stations[3].1, 7);
    }

    #[test]
    fn water_that_falls_along_a_load_module_line_falls_on_the_line_as_well() {
        let ring = [(10.0, 40.0), (30.0, 40.0), (30.0, 60.0), (10.0, 60.0), (10.0, 40.0)];
        let rounded = rounded(vec![way(1, "natural=water water=river", &ring)]);
        let place = |east: f64| site().lattice.place_of([east, 49.0]).unwrap();
        let line = [
            ([place(10.0), place(18.0)], [2000, 2000]),
            ([place(18.0), place(22.0)], [2000, 1000]),
            ([place(22.0), place(30.0)], [1000, 1000]),
        ];
        let all = banks(&rounded.outlines[0], &line, &site());
        let row = site().lattice.place_of([10.0, 50.0]).unwrap().row;
        let along = |strand: &&Strand| strand.stations.iter().all(|(place, _)| place.row == row);
        let [chord] = all[1..].iter().filter(along).collect::<Vec<_>>()[..] else { panic!("one along the row") };
        let heights: Vec<i32> = chord.stations.iter().map(|(_, height)| *height).collect();
        assert_eq!(heights, [2000, 2000, 1000, 1000]);
        let easts: Vec<f64> = chord.stations.iter().map(|(place, _)| site().lattice.posts_of(*place)[0]).collect();
        assert_eq!(easts, [10.0, 18.0, 22.0, 30.0]);
    }
}
