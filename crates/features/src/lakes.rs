//! Lakes lie level: each water body at one height, its shore with it.

use std::collections::HashMap;

use crate::clean::Notes;
use crate::strand::{Role, Strand};
use crate::{FeatureLattice, Flaw, Kind, Outline, Place, Remark, Remedy, Ring};

/// A level that its source gives may lie this far, in quanta, from the heights of the shore: 10 m.
const LEVEL_OFF_MAX: i32 = 10 * 128;

/// A polygon of a river without a line inside is a lake where its shore varies by less than this, in quanta: 2 m.
const SHORE_SPREAD_MAX: i32 = 2 * 128;

/// Which of a hundred heights of the shore is the level.
const SHORE_PERCENT: usize = 5;

/// A body of water at one level.
#[derive(Clone, Debug, PartialEq)]
pub struct Lake {
    /// Its outline, in the list that was given.
    pub outline: u32,
    /// Its level in quanta.
    pub level: i32,
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

/// Decides the level of each water body. `shores` has a height for each place of each ring of each outline, ring after
/// ring; `has_line` says in which outlines a river runs; `dams` are places on dams, at which two bodies stay apart.
///
/// Outlines of other kinds than water are passed over.
pub fn level(
    outlines: &[Outline],
    shores: &[Vec<Option<i32>>],
    has_line: &[bool],
    dams: &dyn Fn(Place) -> bool,
    lattice: FeatureLattice,
    remarks: &mut Vec<Remark>,
) -> Waters {
    let mut waters = Waters { lakes: Vec::new(), banks: Vec::new(), outlines_only: Vec::new() };
    for (number, outline) in outlines.iter().enumerate() {
        let mut notes = Notes { id: outline.id, lattice, remarks };
        let first = outline.rings.first().and_then(|ring| ring.places.first().copied());
        let mut shore: Vec<i32> = shores[number].iter().copied().flatten().collect();
        shore.sort_unstable();
        let spread = shore.last().zip(shore.first()).map_or(0, |(most, least)| most - least);
        match outline.traits.kind {
            Kind::River if has_line[number] => waters.banks.push(number as u32),
            Kind::River if SHORE_SPREAD_MAX <= spread => {
                notes.write_of(first, Flaw::NoLineInside, Remedy::OutlineOnly);
                waters.outlines_only.push(number as u32);
            }
            Kind::River | Kind::Lake => {
                if outline.traits.kind == Kind::River {
                    notes.write_of(first, Flaw::NoLineInside, Remedy::BecameLake);
                }
                let level = level_of(outline, &shore, first, &mut notes);
                waters.lakes.push(Lake { outline: number as u32, level, fill_m3: 0 });
            }
            _ => {}
        }
    }
    join_bodies(outlines, &mut waters.lakes, dams);
    for lake in &mut waters.lakes {
        let outline = &outlines[lake.outline as usize];
        lake.fill_m3 = fill(outline, &shores[lake.outline as usize], lake.level, lattice);
        if 0 < lake.fill_m3 {
            let first = outline.rings[0].places.first().copied();
            let flaw = Flaw::ShoreBelowWater { cubic_metres: lake.fill_m3 };
            Notes { id: outline.id, lattice, remarks }.write_of(first, flaw, Remedy::Lifted);
        }
    }
    waters
}

/// The level of a source if it fits the shore, else what a twentieth of the shore lies at or below.
fn level_of(outline: &Outline, shore: &[i32], first: Option<Place>, notes: &mut Notes) -> i32 {
    let (least, most) = match (shore.first(), shore.last()) {
        (Some(least), Some(most)) => (*least, *most),
        _ => return outline.traits.level.unwrap_or(0),
    };
    match outline.traits.level {
        Some(level) if least - LEVEL_OFF_MAX <= level && level <= most + LEVEL_OFF_MAX => level,
        found => {
            if let Some(found) = found {
                notes.write_of(first, Flaw::LevelRefused { found }, Remedy::ShoreTaken);
            }
            shore[(shore.len() - 1) * SHORE_PERCENT / 100]
        }
    }
}

/// Bodies that share a stretch of shore are one, at the lowest of their levels; a dam keeps them apart.
fn join_bodies(outlines: &[Outline], lakes: &mut [Lake], dams: &dyn Fn(Place) -> bool) {
    let mut body: Vec<usize> = (0..lakes.len()).collect();
    let root = |body: &[usize], mut at: usize| {
        while body[at] != at {
            at = body[at];
        }
        at
    };
    let mut at_place: HashMap<Place, usize> = HashMap::new();
    for (number, lake) in lakes.iter().enumerate() {
        let places = outlines[lake.outline as usize].rings.iter().flat_map(|ring| &ring.places);
        for place in places.filter(|place| !dams(**place)) {
            let other = *at_place.entry(*place).or_insert(number);
            let (one, other) = (root(&body, number), root(&body, other));
            body[one.max(other)] = one.min(other);
        }
    }
    let mut levels: HashMap<usize, i32> = HashMap::new();
    for (number, lake) in lakes.iter().enumerate() {
        levels.entry(root(&body, number)).and_modify(|level| *level = lake.level.min(*level)).or_insert(lake.level);
    }
    for (number, lake) in lakes.iter_mut().enumerate() {
        lake.level = levels[&root(&body, number)];
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
/// `line` are edges of the river inside the outline, with the heights of their ends.
pub fn banks(outline: &Outline, line: &[([Place; 2], [i32; 2])]) -> Vec<Strand> {
    strands(outline, Role::Bank, &|place, _| nearest_height(line, place).unwrap_or(0))
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
    use crate::{Rounded, Source};

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
        let none = vec![false; shores.len()];
        let waters = level(&rounded.outlines, &shores, &none, dams, site().lattice, &mut remarks);
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
        assert_eq!(levels(vec![lake(1, "", 10.0, 30.0)], slope, &none).0, [110]);
        let (found, flaws, _) = levels(vec![lake(1, "ele=1150", 10.0, 30.0)], slope, &none);
        assert_eq!((found, &flaws[0]), (vec![110], &Flaw::LevelRefused { found: 1150 * 128 }));
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
        let strand = &banks(&rounded.outlines[0], &line)[0];
        for (place, height) in &strand.stations {
            let east = site().lattice.posts_of(*place)[0];
            assert_eq!(*height, 2500 - (east * 50.0) as i32);
        }
        assert_eq!(shore(&rounded.outlines[0], 7)[0].stations[3].1, 7);
    }
}
