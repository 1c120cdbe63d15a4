//! Mends features: what comes out are ways and areas on the lattice, and a remark for whatever was changed.

use std::collections::{HashMap, HashSet};

use crate::clean::{Cleaned, Notes, clean, leave_out_spikes, leave_out_spikes_of_ring};
use crate::clip::Extent;
use crate::crowd::leave_out_crowds;
use crate::rings::{close, doubled_area};
use crate::ways::{Area, Way};
use crate::{Feature, FeatureLattice, Flaw, Form, Place, Position, Remark, Remedy, Shape, Site, gaps};

/// What is left of features after mending, in an order of their content.
#[derive(Clone, Debug, PartialEq)]
pub struct Mended {
    /// Lines.
    pub ways: Vec<Way>,
    /// Polygons.
    pub areas: Vec<Area>,
    /// What was changed or left out.
    pub remarks: Vec<Remark>,
}

/// Mends features and cuts them at the border of the area plus one load module.
pub fn mend(features: Vec<Feature>, site: &Site) -> Mended {
    let (lattice, extent) = (site.lattice, site.extent);
    let mut mended = Mended { ways: Vec::new(), areas: Vec::new(), remarks: Vec::new() };
    let junctions = junctions(&features, lattice);
    for feature in features {
        let mut notes = Notes { id: feature.id, lattice, remarks: &mut mended.remarks };
        let found = match &feature.shape {
            Shape::Line(positions) if feature.traits.form != Form::Polygon => {
                let ways = ways_of(&feature, positions, (extent, &junctions), &mut notes);
                let any = !ways.is_empty();
                mended.ways.extend(ways);
                any
            }
            _ if feature.traits.kind.is_road() => {
                notes.write_of(None, Flaw::WrongShape, Remedy::LeftOut);
                true
            }
            shape => {
                let area = area_of(&feature, shape, extent, &mut notes);
                let any = area.is_some();
                mended.areas.extend(area);
                any
            }
        };
        debug_assert!(found || !mended.remarks.is_empty(), "a feature was left out in silence");
    }
    order(&mut mended);
    leave_out_copies(&mut mended, lattice);
    leave_out_crowds(&mut mended.ways, &mut mended.areas, site, &mut mended.remarks);
    gaps::join(&mut mended.ways, lattice, &mut mended.remarks);
    order(&mut mended);
    Remark::sort(&mut mended.remarks);
    mended
}

/// Sorts by content, so that nothing depends on the order of files; ids only part what is equal otherwise.
fn order(mended: &mut Mended) {
    mended.ways.sort_by(|a, b| (&a.traits, &a.places, &a.heights, a.id).cmp(&(&b.traits, &b.places, &b.heights, b.id)));
    mended.areas.sort_by(|a, b| (&a.traits, &a.walks, a.id).cmp(&(&b.traits, &b.walks, b.id)));
}

/// Places that lines of two features have, with the family of both.
fn junctions(features: &[Feature], lattice: FeatureLattice) -> HashSet<(u8, Place)> {
    let (mut first, mut junctions) = (HashMap::new(), HashSet::new());
    for (number, feature) in features.iter().enumerate() {
        let Shape::Line(positions) = &feature.shape else { continue };
        for place in positions.iter().filter_map(|at| lattice.place_of([at.east, at.north])) {
            let at = (gaps::family(feature.traits.kind), place);
            if *first.entry(at).or_insert(number) != number {
                junctions.insert(at);
            }
        }
    }
    junctions
}

fn ways_of(
    feature: &Feature,
    positions: &[Position],
    (extent, junctions): (Extent, &HashSet<(u8, Place)>),
    notes: &mut Notes,
) -> Vec<Way> {
    let Cleaned { mut places, mut heights } = clean(positions, notes);
    let first = places.first().copied();
    if places.len() < 2 {
        notes.write_of(first, Flaw::ZeroLength, Remedy::LeftOut);
        return Vec::new();
    }
    let family = gaps::family(feature.traits.kind);
    leave_out_spikes(&mut places, &|place| junctions.contains(&(family, place)), notes);
    if places.len() < 2 {
        notes.write_of(first, Flaw::ZeroLength, Remedy::LeftOut);
        return Vec::new();
    }
    if !feature.traits.pins {
        heights.clear();
    }
    let parts = extent.cut_line(&places);
    if parts.is_empty() {
        notes.write_of(first, Flaw::Outside, Remedy::LeftOut);
    }
    let of_part = |places: Vec<Place>| {
        let held: HashSet<Place> = places.iter().copied().collect();
        let heights = heights.iter().copied().filter(|(place, _)| held.contains(place)).collect();
        Way { traits: feature.traits, places, heights, id: feature.id }
    };
    parts.into_iter().map(of_part).collect()
}

fn area_of(feature: &Feature, shape: &Shape, extent: Extent, notes: &mut Notes) -> Option<Area> {
    let mut walks: Vec<(Vec<Place>, bool)> = match shape {
        Shape::Line(positions) => {
            close(clean(positions, notes).places, notes).map(|ring| (ring, false)).into_iter().collect()
        }
        Shape::Polygon(rings) => {
            let closed = rings.iter().enumerate().filter_map(|(number, ring)| {
                // Formats of polygons may leave out the last position; that is no flaw.
                let mut places = clean(ring, notes).places;
                if places.first() == places.last() {
                    places.pop();
                }
                (3 <= places.len()).then_some((places, 0 < number))
            });
            closed.collect()
        }
    };
    let first = walks.first().and_then(|(walk, _)| walk.first().copied());
    for (walk, _) in &mut walks {
        leave_out_spikes_of_ring(walk, notes);
    }
    if !walks.iter().any(|(walk, hole)| !hole && 3 <= walk.len()) {
        notes.write_of(first, Flaw::ZeroArea, Remedy::LeftOut);
        return None;
    }
    for (walk, _) in &mut walks {
        *walk = canonical_walk(extent.cut_ring(walk));
    }
    walks.retain(|(walk, _)| 3 <= walk.len());
    walks.sort();
    if walks.iter().all(|(_, hole)| *hole) {
        notes.write_of(first, Flaw::Outside, Remedy::LeftOut);
        return None;
    }
    Some(Area { traits: feature.traits, walks, id: feature.id })
}

/// A closed walk from its least place on, counter-clockwise as a whole, so that equal rings are equal walks.
fn canonical_walk(mut walk: Vec<Place>) -> Vec<Place> {
    while 2 <= walk.len() && walk.first() == walk.last() {
        walk.pop();
    }
    let first = (0..walk.len()).min_by_key(|&number| walk[number]).unwrap_or(0);
    walk.rotate_left(first);
    if doubled_area(&walk) < 0 {
        walk[1..].reverse();
    }
    walk
}

/// Of features with the same places, the one of the highest class stays.
fn leave_out_copies(mended: &mut Mended, lattice: FeatureLattice) {
    let Mended { ways, areas, remarks } = mended;
    let mut seen: HashMap<(u8, crate::Storey, Vec<Place>), ()> = HashMap::new();
    ways.retain(|way| {
        let mut places = way.places.clone();
        if way.places.last() < way.places.first() {
            places.reverse();
        }
        let new = seen.insert((gaps::family(way.traits.kind), way.traits.storey, places), ()).is_none();
        if !new {
            Notes { id: way.id, lattice, remarks }.write_at(way.places[0], Flaw::Doubled, Remedy::LeftOut);
        }
        new
    });
    let mut seen: HashMap<Vec<(Vec<Place>, bool)>, ()> = HashMap::new();
    areas.retain(|area| {
        let new = seen.insert(area.walks.clone(), ()).is_none();
        if !new {
            let first = area.walks.first().and_then(|(walk, _)| walk.first().copied());
            Notes { id: area.id, lattice, remarks }.write_of(first, Flaw::Doubled, Remedy::LeftOut);
        }
        new
    });
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::snap::touch_at_vertices_only;
    use crate::{FeatureId, Numbering, Rounded, Source, round, sort_out};
    use proptest::prelude::*;
    use terrain::{Post, PostRect, Spacing, in_turn};

    fn site() -> Site {
        let area = PostRect::new(Post::new(0, 0), Post::new(40, 40));
        Site::new(Spacing::from_metres(25.0).unwrap(), area, 20, 40)
    }

    fn source(number: i64, tag: (&str, &str), positions: &[(f64, f64)]) -> Source {
        let shape = Shape::Line(positions.iter().map(|&(east, north)| Position::new(east, north)).collect());
        let id = FeatureId { source: 0, numbering: Numbering::Way, number };
        Source { id, tags: vec![(tag.0.into(), tag.1.into())], kind: None, shape }
    }

    fn road(number: i64, positions: &[(f64, f64)]) -> Source {
        source(number, ("highway", "primary"), positions)
    }

    fn mended(sources: Vec<Source>) -> Mended {
        mend(sort_out(sources, &[], 1.5).features, &site())
    }

    #[track_caller]
    fn check(sources: Vec<Source>, ways: usize, flaws: &[(Flaw, Remedy)]) -> Rounded {
        let rounded = round(mended(sources), &site(), &in_turn);
        let found: Vec<_> = rounded.remarks.iter().map(|remark| (remark.flaw.clone(), remark.remedy)).collect();
        assert_eq!((rounded.ways.len(), found), (ways, flaws.to_vec()));
        rounded
    }

    #[test]
    fn copies_are_left_out_whatever_their_direction_and_class() {
        let there = [(1.0, 1.0), (5.0, 5.0), (9.0, 5.0)];
        let back: Vec<_> = there.iter().rev().copied().collect();
        let copy = source(2, ("highway", "track"), &back);
        let rounded = check(vec![copy, road(3, &there)], 1, &[(Flaw::Doubled, Remedy::LeftOut)]);
        assert_eq!(rounded.ways[0].id.number, 3);
    }

    #[test]
    fn two_carriageways_that_close_at_a_junction_keep_it() {
        let divided = road(1, &[(1.0, 1.0), (5.0, 5.0), (1.02, 1.0)]);
        let check = |other: Source, flaws: &[(Flaw, Remedy)], keeps: bool| {
            let rounded = check(vec![divided.clone(), other], 2, flaws);
            let tip = site().lattice.place_of([5.0, 5.0]).unwrap();
            assert_eq!(rounded.ways.iter().filter(|way| way.places.contains(&tip)).count() == 2, keeps);
        };
        check(road(2, &[(5.0, 5.0), (9.0, 9.0)]), &[], true);
        // What only flows there is no junction, and neither is a way that ends elsewhere.
        check(
            source(2, ("waterway", "stream"), &[(5.0, 5.0), (9.0, 9.0)]),
            &[(Flaw::Spike, Remedy::PointLeftOut)],
            false,
        );
        check(road(2, &[(6.0, 5.0), (9.0, 9.0)]), &[(Flaw::Spike, Remedy::PointLeftOut)], false);
    }

    #[test]
    fn an_end_that_misses_a_way_by_less_than_a_metre_is_joined() {
        let through = road(1, &[(1.0, 1.0), (9.0, 1.0)]);
        let stub = road(2, &[(5.0, 5.0), (5.0, 1.02)]);
        let rounded = check(vec![through, stub], 2, &[(Flaw::Gap, Remedy::Joined)]);
        let end = *rounded.ways.iter().find(|way| way.id.number == 2).unwrap().places.last().unwrap();
        assert!(rounded.ways.iter().find(|way| way.id.number == 1).unwrap().places.contains(&end));
        let on_it = road(2, &[(5.0, 5.0), (5.0, 1.1)]);
        check(vec![road(1, &[(1.0, 1.0), (9.0, 1.0)]), on_it], 2, &[(Flaw::Gap, Remedy::Joined)]);
        let far = road(2, &[(5.0, 5.0), (5.0, 1.25)]);
        check(vec![road(1, &[(1.0, 1.0), (9.0, 1.0)]), far], 2, &[]);
    }

    #[test]
    fn two_ends_that_miss_one_another_meet_in_one() {
        let rounded = check(
            vec![road(1, &[(1.0, 1.0), (5.0, 1.0)]), road(2, &[(5.02, 1.01), (9.0, 4.0)])],
            2,
            &[(Flaw::Gap, Remedy::Joined)],
        );
        assert_eq!(rounded.ways[0].places.last(), rounded.ways[1].places.first());
    }

    #[test]
    fn what_lies_outside_or_has_no_length_is_left_out_and_said() {
        check(vec![road(1, &[(100.0, 100.0), (120.0, 100.0)])], 0, &[(Flaw::Outside, Remedy::LeftOut)]);
        check(vec![road(1, &[(1.0, 1.0)])], 0, &[(Flaw::ZeroLength, Remedy::LeftOut)]);
        check(vec![road(1, &[])], 0, &[(Flaw::ZeroLength, Remedy::LeftOut)]);
    }

    #[test]
    fn a_bow_tie_lake_has_two_wings_and_a_line_without_end_is_closed() {
        let bow = source(1, ("natural", "water"), &[(1.0, 1.0), (5.0, 5.0), (5.0, 1.0), (1.0, 5.0), (1.0, 1.0)]);
        let rounded = check(vec![bow], 0, &[(Flaw::BowTie, Remedy::Split)]);
        assert_eq!(rounded.outlines[0].rings.len(), 2);
        let open = source(1, ("natural", "water"), &[(1.0, 1.0), (5.0, 1.0), (5.0, 5.0), (1.0, 2.0)]);
        let rounded = check(vec![open], 0, &[(Flaw::UnclosedRing, Remedy::Closed)]);
        assert_eq!(rounded.outlines.len(), 1);
    }

    #[test]
    fn too_many_segments_in_a_load_module_leave_out_the_lowest_class() {
        let tangle = |number: i64, tag: &str| {
            let at = |n: i64| (1.0 + (n * 7919 % 1709) as f64 / 100.0, 1.0 + (n * 104_729 % 1801) as f64 / 100.0);
            let positions: Vec<_> = (0..15_000).map(|n| at(n + 31 * number)).collect();
            source(number, ("highway", tag), &positions)
        };
        let mut sources = vec![tangle(1, "track"), tangle(2, "track")];
        sources.push(road(3, &[(1.0, 1.0), (9.0, 9.0)]));
        let mended = mended(sources);
        assert_eq!(mended.ways.iter().filter(|way| way.id.number == 3).count(), 1);
        assert!(mended.remarks.iter().any(|remark| remark.flaw == Flaw::Crowded));
    }

    fn positions() -> impl Strategy<Value = Vec<(f64, f64)>> {
        let coordinate = prop_oneof![
            8 => (0i32..80).prop_map(|half| f64::from(half) / 2.0),
            4 => -30.0..70.0f64,
            1 => prop_oneof![Just(f64::NAN), Just(f64::INFINITY), Just(1e300), Just(-1e9)],
        ];
        proptest::collection::vec((coordinate.clone(), coordinate), 0..8)
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(200))]
        #[test]
        fn whatever_comes_in_lines_touch_at_vertices_only_and_the_order_of_files_is_none(
            lines in proptest::collection::vec((positions(), 0usize..6), 0..12)
        ) {
            let tags = [("highway", "primary"), ("highway", "track"), ("railway", "rail"), ("waterway", "stream"),
                ("natural", "water"), ("waterway", "dam")];
            let sources: Vec<Source> =
                lines.iter().enumerate().map(|(n, (line, tag))| source(n as i64, tags[*tag], line)).collect();
            let mut reversed = sources.clone();
            reversed.reverse();
            let rounded = round(mended(sources), &site(), &in_turn);
            let mut all: Vec<Vec<Place>> = rounded.ways.iter().map(|way| way.places.clone()).collect();
            for ring in rounded.outlines.iter().flat_map(|outline| &outline.rings) {
                all.push(ring.places.iter().chain(ring.places.first()).copied().collect());
            }
            prop_assert_eq!(touch_at_vertices_only(&all), Ok(()));
            for pair in all.iter().flat_map(|line| line.windows(2)) {
                let mut crossed = Vec::new();
                site().crossings(crate::exact::Segment { a: pair[0], b: pair[1] }, &mut |place| crossed.push(place));
                prop_assert!(crossed.is_empty(), "{:?} crosses a line at {:?}", pair, crossed);
            }
            prop_assert_eq!(round(mended(reversed), &site(), &in_turn), rounded);
        }
    }
}
