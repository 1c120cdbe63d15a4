//! All stages together, through the public functions only, over a ground that is a function of the place.

use std::collections::{BTreeMap, BTreeSet, HashMap};

use features::*;
use proptest::prelude::*;
use terrain::{Post, PostRect, Spacing, in_turn};

use crate::networks::way;

fn site() -> Site {
    let area = PostRect::new(Post::new(0, 0), Post::new(80, 80));
    Site::new(Spacing::from_metres(10.0).unwrap(), area, 20, 40)
}

/// A tag by number, and places in halves of a post.
type Drawn = (usize, Vec<(i32, i32)>);

/// What all stages make of features.
struct Whole {
    reserved: Reserved,
    waters: Waters,
    outlines: Vec<Outline>,
    remarks: Vec<Remark>,
}

fn all_stages(sources: Vec<Source>, metres: &dyn Fn(f64, f64) -> f64, most: u32) -> Whole {
    let site = site();
    let dem = |place: Place| {
        let [east, north] = site.lattice.posts_of(place);
        terrain::quanta_of_metres(metres(east, north))
    };
    let sorted = sort_out(sources, &[], 1.5);
    let mended = mend(sorted.features, &site);
    let mut rounded = round(mended, &site, &in_turn);
    rounded.outlines = split_at_dams(rounded.outlines, &rounded.ways);
    let mut remarks = sorted.remarks;
    remarks.extend(rounded.remarks.clone());
    let roads = Network::of(&travelled(&rounded), site.lattice, &mut remarks);
    let rivers = Network::of(&flowing(&rounded), site.lattice, &mut remarks);

    let shore_of = |outline: &Outline| outline.rings.iter().flat_map(|ring| &ring.places).map(|p| dem(*p)).collect();
    let shores: Vec<Vec<Option<i32>>> = rounded.outlines.iter().map(shore_of).collect();
    let dams = dams(&rounded);
    let has_line = have_line(&rounded.outlines, &rivers, &site);
    let inside = vec![Histogram::new(); shores.len()];
    let of_shores = Shores { heights: &shores, inside: &inside, has_line: &has_line };
    let (is_dam, falls) = (|place: Place| dams.contains(&place), FallOptions::USUAL);
    let mut waters = level(&rounded.outlines, of_shores, &is_dam, falls, site.lattice, &mut remarks);
    let still = lakes_along(&rounded.outlines, &waters.lakes, &rivers, &site);
    let bed: Vec<Option<i32>> = rivers.nodes.iter().map(|node| dem(node.place)).collect();
    let of_bed = Bed { ground: &bed, middle: &bed, lower_bank: &bed };
    let fallen = fall(&rivers, of_bed, &still, &[], falls, &mut remarks);
    for (still, level) in still.iter().zip(&fallen.levels) {
        let of_body = waters.lakes.iter_mut().filter(|lake| lake.body == still.body);
        of_body.for_each(|lake| lake.level = *level);
    }
    let mut strands = channels(&rivers, &fallen);
    for lake in &waters.lakes {
        strands.extend(shore(&rounded.outlines[lake.outline as usize], lake.level));
    }
    let lines = lines_inside(&rounded.outlines, &waters.banks, &rivers, &fallen, &site);
    for (number, line) in waters.banks.iter().zip(&lines) {
        strands.extend(banks(&rounded.outlines[*number as usize], line, &site));
    }
    for &number in &waters.outlines_only {
        strands.extend(outline_only(&rounded.outlines[number as usize], &shores[number as usize]));
    }
    strands.extend(breaklines(&rounded, &dem));

    let ground: Vec<Option<i32>> = roads.nodes.iter().map(|node| dem(node.place)).collect();
    let crossed = water(&strands);
    let afloat = afloat(&rounded.outlines, &waters.lakes, &roads, &sides(&roads), &site);
    let pins = with_water(&roads, Vec::new(), &afloat, &mut remarks);
    let below = Below { water: &crossed, ..Below::WAYS };
    let heights = grade(&roads, [&ground; 2], &pins, below, GradeOptions::USUAL, &mut remarks);
    for (number, edge) in roads.edges.iter().enumerate() {
        let rise = (heights[edge.a as usize] - heights[edge.b as usize]).abs();
        // In whole quanta: half a quantum more is the least that an edge of a few centimetres can rise.
        assert!(2 * rise <= edge.rise_max * 3 + 1, "edge {number} is too steep");
    }
    let beside: Vec<[i32; 2]> = sides(&roads).iter().map(|sides| sides.map(|place| dem(place).unwrap_or(0))).collect();
    let grants = Grants::default();
    let graded = Graded { network: &roads, heights: &heights, beside: &beside, grants: &grants };
    let reserved = reserve(&graded, &strands, &site, &Shares::each([4, 4], most.into()), &|_| None, &in_turn);
    remarks.extend(reserved.formed.remarks.clone());
    Remark::sort(&mut remarks);
    Whole { reserved, waters, outlines: rounded.outlines, remarks }
}

/// What must hold of all features whatever they are.
fn check(whole: &Whole, most: u32) {
    let formed = &whole.reserved.formed;
    let lines: Vec<Vec<Place>> = formed
        .edges
        .iter()
        .map(|edge| vec![formed.points[edge.a as usize].0, formed.points[edge.b as usize].0])
        .collect();
    assert_eq!(touch_at_vertices_only(&lines), Ok(()));
    // Beyond the area nothing is built, so there is room for anything.
    let is_built = |(row, col): &(i32, i32)| (0..4).contains(row) && (0..4).contains(col);
    for (module, classes) in whole.reserved.cost.iter().filter(|(module, _)| is_built(module)) {
        assert!(classes.values().sum::<u32>() <= most, "load module {module:?} gives too much");
    }
    // A lake's shore is level, but where a road crosses it.
    let height: HashMap<Place, i32> = formed.points.iter().copied().collect();
    let mut others: BTreeSet<Place> = BTreeSet::new();
    for edge in formed.edges.iter().filter(|edge| edge.role < Role::Shore) {
        others.extend([edge.a, edge.b].map(|end| formed.points[end as usize].0));
    }
    // A dam makes two levels of one feature.
    let mut levels: BTreeMap<FeatureId, BTreeSet<i32>> = BTreeMap::new();
    for lake in &whole.waters.lakes {
        levels.entry(whole.outlines[lake.outline as usize].id).or_default().insert(lake.level);
    }
    // Inside another lake a shore lies as that does, which is told.
    let disagree = whole.remarks.iter().filter(|remark| remark.flaw == Flaw::LevelsDisagree).map(|remark| remark.id);
    let disagree: BTreeSet<FeatureId> = disagree.collect();
    for edge in formed.edges.iter().filter(|edge| edge.role == Role::Shore) {
        for place in [edge.a, edge.b].map(|end| formed.points[end as usize].0) {
            if let (Some(levels), false) = (levels.get(&edge.id), others.contains(&place)) {
                let level = height[&place];
                let follows = disagree.contains(&edge.id) && whole.waters.lakes.iter().any(|lake| lake.level == level);
                assert!(levels.contains(&level) || follows, "a shore is not level");
            }
        }
    }
}

fn hills(east: f64, north: f64) -> f64 {
    let wave = |at: f64| ((at / 17.0).fract() - 0.5).abs() * 30.0;
    200.0 + wave(east + 0.3 * north) + wave(north) - 0.2 * east
}

#[test]
fn a_small_landscape_is_whole() {
    let lake = [(30.0, 30.0), (45.0, 32.0), (46.0, 44.0), (31.0, 45.0), (30.0, 30.0)];
    let sources = vec![
        way(1, "highway=primary", &[(5.0, 10.0), (70.0, 12.0)]),
        way(2, "highway=track width=wide", &[(20.0, 5.0), (25.0, 40.0), (22.0, 70.0)]),
        way(3, "waterway=river", &[(5.0, 38.0), (31.0, 38.0), (45.5, 38.0), (75.0, 36.0)]),
        way(4, "natural=water ele=205", &lake),
        way(5, "highway=motorway bridge=yes", &[(60.0, 20.0), (60.0, 50.0)]),
        way(6, "highway=motorway", &[(60.0, 0.0), (60.0, 20.0)]),
        way(7, "highway=motorway", &[(60.0, 50.0), (60.0, 79.0)]),
        way(8, "railway=rail tunnel=yes", &[(10.0, 60.0), (70.0, 60.0)]),
    ];
    let whole = all_stages(sources, &hills, 100_000);
    check(&whole, 100_000);
    let flaws: Vec<String> = whole.remarks.iter().map(|remark| remark.to_string()).collect();
    assert!(flaws.iter().any(|text| text.contains("width = \"wide\"")), "{flaws:#?}");
    assert!(flaws.iter().any(|text| text.contains("culvert")), "{flaws:#?}");
    let formed = &whole.reserved.formed;
    assert!(!formed.decks.is_empty() && !formed.faces.is_empty());
    for role in [Role::Side, Role::Channel, Role::Shore] {
        assert!(formed.edges.iter().any(|edge| edge.role == role), "{role:?}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(60))]
    #[test]
    fn whatever_comes_in_all_stages_hold_in_any_order_of_features(
        lines in proptest::collection::vec(
            (0usize..11, proptest::collection::vec((-10..180i32, -10..180i32), 1..6)), 0..10),
        most in prop_oneof![Just(100_000u32), Just(40u32)],
    ) {
        let tags = ["highway=motorway", "highway=primary", "highway=service", "highway=track", "waterway=stream",
            "highway=primary bridge=yes", "railway=rail", "natural=water", "waterway=dam", "natural=water water=river",
            "waterway=river"];
        let of = |(number, (tag, line)): (usize, &Drawn)| {
            let line: Vec<(f64, f64)> = line.iter().map(|(x, y)| (f64::from(*x) / 2.0, f64::from(*y) / 2.0)).collect();
            way(number as i64, tags[*tag], &line)
        };
        let sources: Vec<Source> = lines.iter().enumerate().map(of).collect();
        let there = all_stages(sources.clone(), &hills, most);
        check(&there, most);
        let back = all_stages(sources.into_iter().rev().collect(), &hills, most);
        prop_assert_eq!(there.reserved, back.reserved);
        prop_assert_eq!(there.remarks, back.remarks);
    }
}
