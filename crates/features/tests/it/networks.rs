//! What of a network is in the ground where not all of it has room: whole stretches that hang together, by a judge that
//! sees nothing but the edges that are formed.

use std::collections::{BTreeMap, BTreeSet};

use features::*;
use terrain::{Post, PostRect, Spacing, in_turn};

/// Posts of 10 m: 8 x 8 load modules of 500 m, tiles of 4 x 4.
const SIZE: [i32; 2] = [8, 8];

fn site() -> Site {
    let area = PostRect::new(Post::new(0, 0), Post::new(400, 400));
    Site::new(Spacing::from_metres(10.0).unwrap(), area, 50, 200)
}

/// A straight way between two positions in posts, with the number of the first of them that it has one with.
pub fn way(number: i64, tags: &str, line: &[(f64, f64)]) -> Source {
    let tags = tags.split(' ').filter_map(|tag| tag.split_once('='));
    let tags = tags.map(|(key, value)| (key.to_owned(), value.to_owned())).collect();
    let shape = Shape::Line(line.iter().map(|&(east, north)| Position::new(east, north)).collect());
    Source { id: FeatureId { source: 0, numbering: Numbering::Way, number }, tags, kind: None, shape }
}

/// Streets of a town, `count` each way, 10 posts apart, one way from crossing to crossing.
fn grid(count: i64, [east, north]: [f64; 2]) -> Vec<Source> {
    let at = |step: i64, start: f64| start + 10.0 * step as f64;
    let mut ways = Vec::new();
    for row in 0..count {
        for col in 0..count - 1 {
            let number = 2 * (row * count + col);
            let along = [(at(col, east), at(row, north)), (at(col + 1, east), at(row, north))];
            let across = [(at(row, east), at(col, north)), (at(row, east), at(col + 1, north))];
            ways.push(way(number, &format!("highway=residential name=row{row}"), &along));
            ways.push(way(number + 1, &format!("highway=residential name=col{row}"), &across));
        }
    }
    ways
}

fn levelled(sources: &[Source], shares: &Shares) -> Levelled {
    let all = AreaFeatures::of(sources.to_vec(), &[], 1.5, site(), &in_turn);
    let hills = |[east, north]: [f64; 2]| 100.0 + 0.02 * east + ((north / 60.0).fract() - 0.5).abs() * 6.0;
    let ground = |place: &Place| terrain::quanta_of_metres(hills(site().lattice.posts_of(*place)));
    let ground: Vec<Option<i32>> = all.stations().iter().map(ground).collect();
    let inside = vec![Vec::new(); all.outlines().len()];
    let sounded = Sounded { heights: &ground, middles: &ground, inside: &inside };
    let levelled = all.level(sounded, (GradeOptions::USUAL, FallOptions::USUAL), shares, &in_turn);
    check_limits(&levelled, shares);
    levelled
}

/// No limit is exceeded by what is formed.
#[track_caller]
fn check_limits(levelled: &Levelled, shares: &Shares) {
    if shares.modules.is_empty() {
        return;
    }
    let (mut of_module, mut all) = (vec![0; shares.modules.len()], 0);
    for ((row, col), classes) in &levelled.reserved.cost {
        let count: u32 = classes.values().sum();
        if (0..SIZE[0]).contains(row) && (0..SIZE[1]).contains(col) {
            of_module[(row * SIZE[1] + col) as usize] = u64::from(count);
            all += u64::from(count);
        }
    }
    assert!(of_module.iter().zip(&shares.modules).all(|(count, share)| *count <= share.main), "a load module is over");
    assert!(all <= shares.area.main, "the area is over");
    let of_module = &of_module;
    let [rows, cols] = [0, 1].map(|axis| SIZE[axis] - shares.window[axis] + 1);
    for (south, west) in (0..rows).flat_map(|south| (0..cols).map(move |west| (south, west))) {
        let inside = (south..south + shares.window[0])
            .flat_map(|row| (west..west + shares.window[1]).map(move |col| of_module[(row * SIZE[1] + col) as usize]));
        let most = shares.windows.get((south * cols + west) as usize).map_or(u64::MAX, |share| share.main);
        assert!(inside.sum::<u64>() <= most, "a window is over");
    }
}

/// How much of a way lies on edges, from 0 to 1, away from its ends.
fn covered(levelled: &Levelled, source: &Source) -> f64 {
    let Shape::Line(line) = &source.shape else { return 0.0 };
    let formed = &levelled.reserved.formed;
    let lattice = site().lattice;
    let ends: Vec<[[f64; 2]; 2]> = formed
        .edges
        .iter()
        .map(|edge| [edge.a, edge.b].map(|point| lattice.posts_of(formed.points[point as usize].0)))
        .collect();
    let near = |[east, north]: [f64; 2]| {
        ends.iter().any(|[a, b]| {
            let [along_east, along_north] = [b[0] - a[0], b[1] - a[1]];
            let squared = along_east * along_east + along_north * along_north;
            let along = (((east - a[0]) * along_east + (north - a[1]) * along_north) / squared).clamp(0.0, 1.0);
            let [off_east, off_north] = [east - a[0] - along * along_east, north - a[1] - along * along_north];
            off_east * off_east + off_north * off_north < 2.25
        })
    };
    let (mut found, mut all) = (0, 0);
    for pair in line.windows(2) {
        let [a, b] = [&pair[0], &pair[1]].map(|position| [position.east, position.north]);
        let length = ((b[0] - a[0]).powi(2) + (b[1] - a[1]).powi(2)).sqrt();
        for at in (2..(length as usize - 1)).map(|at| at as f64 / length) {
            all += 1;
            found += usize::from(near([a[0] + at * (b[0] - a[0]), a[1] + at * (b[1] - a[1])]));
        }
    }
    f64::from(found as u32) / f64::from(all as u32).max(1.0)
}

/// Ways that are in the ground; each is as a whole, or not at all.
#[track_caller]
fn kept(levelled: &Levelled, sources: &[Source]) -> BTreeSet<i64> {
    let mut kept = BTreeSet::new();
    for source in sources {
        let covered = covered(levelled, source);
        assert!(covered < 0.35 || 0.99 < covered, "{covered} of way {} is in the ground", source.id.number);
        if 0.99 < covered {
            kept.insert(source.id.number);
        }
    }
    kept
}

fn position_of(at: &Position) -> (i64, i64) {
    ((at.east * 100.0).round() as i64, (at.north * 100.0).round() as i64)
}

fn ends_of(source: &Source) -> [(i64, i64); 2] {
    let Shape::Line(line) = &source.shape else { panic!("a line") };
    [position_of(&line[0]), position_of(line.last().unwrap())]
}

/// Kept roads hang together in parts of 3 km and more, or reach the border; no end at which the source goes on lies
/// within 300 m of a junction.
#[track_caller]
fn check_hangs_together(sources: &[Source], kept: &BTreeSet<i64>) {
    let mut at: BTreeMap<(i64, i64), Vec<usize>> = BTreeMap::new();
    let is_kept = |source: &&Source| kept.contains(&source.id.number);
    for (number, source) in sources.iter().enumerate() {
        ends_of(source).into_iter().for_each(|end| at.entry(end).or_default().push(number));
    }
    let count = |end: &(i64, i64)| at[end].iter().filter(|number| is_kept(&&sources[**number])).count();
    for source in sources.iter().filter(is_kept) {
        let [one, other] = ends_of(source);
        for (end, far) in [(one, other), (other, one)] {
            let is_loose = count(&end) == 1 && 1 < at[&end].len();
            assert!(!(is_loose && 2 < count(&far)), "way {} is a stub", source.id.number);
        }
    }
}

#[test]
fn a_town_of_streets_keeps_whole_streets_that_hang_together() {
    let town = grid(20, [100.0, 100.0]);
    let free = levelled(&town, &Shares::all());
    assert_eq!(kept(&free, &town).len(), town.len(), "all of it is there where nothing binds");
    assert!(free.reserved.left_out.is_empty());
    for most in [16, 40] {
        let tight = levelled(&town, &Shares::each(SIZE, most));
        let kept = kept(&tight, &town);
        check_hangs_together(&town, &kept);
        assert!(20 < kept.len() && kept.len() < town.len(), "{} of {} at {most}", kept.len(), town.len());
    }
}

#[test]
fn a_motorway_through_a_town_and_a_ring_road_are_whole_before_any_street() {
    let mut ways = grid(12, [120.0, 120.0]);
    let motorway = way(1000, "highway=motorway", &[(0.0, 203.0), (400.0, 207.0)]);
    let ring: Vec<(f64, f64)> = vec![(111.0, 111.0), (243.0, 111.0), (243.0, 243.0), (111.0, 243.0), (111.0, 111.0)];
    let ring = way(1001, "highway=primary", &ring);
    ways.extend([motorway.clone(), ring.clone()]);
    let tight = levelled(&ways, &Shares::each(SIZE, 24));
    for main in [&motorway, &ring] {
        assert!(0.99 < covered(&tight, main), "way {}", main.id.number);
    }
    assert!(!tight.reserved.left_out.is_empty());
    let is_in = |left: &LeftOut| left.id.number < 1000;
    assert!(tight.reserved.left_out.iter().all(is_in), "{:?}", tight.reserved.left_out);
}

#[test]
fn of_two_carriageways_both_are_there_as_wholes() {
    let ways = [
        way(1, "highway=motorway", &[(0.0, 200.0), (400.0, 204.0)]),
        way(2, "highway=motorway", &[(0.0, 202.5), (400.0, 206.5)]),
    ];
    for most in [12, 20, 60] {
        let levelled = levelled(&ways, &Shares::each(SIZE, most));
        assert_eq!(kept(&levelled, &ways).len(), 2, "at {most}");
    }
}

#[test]
fn a_stroke_that_crosses_a_full_window_is_left_out_from_junction_to_junction() {
    // Three stretches of one road; the window over the middle one's load modules is full of another road of its kind.
    let ways = [
        way(1, "highway=primary name=long", &[(0.0, 210.0), (120.0, 210.0), (280.0, 210.0), (399.0, 210.0)]),
        way(2, "highway=primary", &[(120.0, 210.0), (120.0, 395.0)]),
        way(3, "highway=primary", &[(280.0, 210.0), (280.0, 395.0)]),
    ];
    let mut shares = Shares { window: [1, 2], ..Shares::each(SIZE, 100) };
    let none = Share { main: 3, others: 3 };
    shares.windows = (0..SIZE[0] * (SIZE[1] - 1)).map(|at| if at == 4 * 7 + 3 { none } else { Share::ALL }).collect();
    let levelled = levelled(&ways, &shares);
    let [left] = &levelled.reserved.left_out[..] else { panic!("{:?}", levelled.reserved.left_out) };
    assert_eq!(left.why, Why::Limit(Limit::Window(4, 3)));
    let places: Vec<[f64; 2]> = left.lines[0].iter().map(|(place, _)| site().lattice.posts_of(*place)).collect();
    assert_eq!((places[0], places[places.len() - 1]), ([120.0, 210.0], [280.0, 210.0]));
    for whole in [&ways[1], &ways[2]] {
        assert!(0.99 < covered(&levelled, whole));
    }
}

#[test]
fn a_bridge_inside_a_full_load_module_is_left_out_with_its_road() {
    let road = |number, tags: &str, from: f64, to: f64| way(number, tags, &[(from, 210.0), (to, 210.0)]);
    let ways = [
        road(1, "highway=primary", 0.0, 210.0),
        road(2, "highway=primary bridge=yes", 210.0, 240.0),
        road(3, "highway=primary", 240.0, 400.0),
    ];
    let whole = levelled(&ways, &Shares::each(SIZE, 30));
    assert!(whole.reserved.left_out.is_empty() && !whole.reserved.formed.decks.is_empty());
    let mut shares = Shares::each(SIZE, 30);
    shares.modules[4 * 8 + 4] = Share { main: 3, others: 3 };
    let full = levelled(&ways, &shares);
    assert!(full.reserved.formed.edges.is_empty() && full.reserved.formed.decks.is_empty());
    assert_eq!(
        full.reserved.left_out.iter().map(|left| left.why).collect::<Vec<_>>(),
        [Why::Limit(Limit::Module(4, 4))]
    );
}

#[test]
fn two_hundred_roads_in_one_load_module_and_a_village_on_the_corner_of_four_tiles_keep_every_limit() {
    let tags = ["motorway", "primary", "service", "track"];
    let road = |number: i64| {
        let (tag, north) = (tags[number as usize % 4], 1.0 + number as f64 * 0.24);
        way(number, &format!("highway={tag}"), &[(2.0, north), (48.0, north + 0.1)])
    };
    let roads: Vec<Source> = (0..200).map(road).collect();
    let levelled_roads = levelled(&roads, &Shares::each(SIZE, 80));
    assert!(levelled_roads.reserved.formed.edges.iter().any(|edge| edge.class == 0), "motorways come first");
    let village = grid(10, [155.0, 155.0]);
    for most in [10, 30, 200] {
        let levelled = levelled(&village, &Shares::each(SIZE, most));
        check_hangs_together(&village, &kept(&levelled, &village));
    }
}

#[test]
fn what_is_chosen_depends_on_places_alone() {
    let town = grid(9, [130.0, 170.0]);
    let one = levelled(&town, &Shares::each(SIZE, 30));
    // Other numbers, in another order.
    let mut other = town.clone();
    other.reverse();
    other.iter_mut().for_each(|source| source.id.number = 5000 - source.id.number);
    let other = levelled(&other, &Shares::each(SIZE, 30));
    assert_eq!(one.reserved.formed.points, other.reserved.formed.points);
    assert_eq!(one.reserved.cost, other.reserved.cost);
}

#[test]
fn one_street_more_changes_no_other_grant_where_no_limit_binds() {
    let town = grid(6, [130.0, 170.0]);
    let before = levelled(&town, &Shares::each(SIZE, 100_000));
    let mut more = town.clone();
    more.push(way(900, "highway=residential", &[(20.0, 20.0), (60.0, 20.0)]));
    let after = levelled(&more, &Shares::each(SIZE, 100_000));
    let points: BTreeSet<_> = after.reserved.formed.points.iter().copied().collect();
    assert!(before.reserved.formed.points.iter().all(|point| points.contains(point)));
}

#[test]
fn odd_networks_keep_every_limit() {
    let spokes = (0..100).map(|number| {
        let angle = f64::from(number) * 0.0628;
        way(
            number.into(),
            "highway=residential",
            &[(200.0, 200.0), (200.0 + 60.0 * angle.cos(), 200.0 + 60.0 * angle.sin())],
        )
    });
    let roundabout: Vec<(f64, f64)> = (0..=24)
        .map(|at| {
            let angle = f64::from(at % 24) * std::f64::consts::TAU / 24.0;
            (100.0 + 3.0 * angle.cos(), 100.0 + 3.0 * angle.sin())
        })
        .collect();
    let mut ways: Vec<Source> = spokes.collect();
    ways.push(way(200, "highway=primary", &roundabout));
    ways.push(way(201, "highway=motorway bridge=yes", &[(10.0, 300.0), (390.0, 320.0)]));
    ways.push(way(202, "highway=residential", &[(300.0, 50.0), (399.9999, 50.0)]));
    for most in [0, 1, 6, 50] {
        levelled(&ways, &Shares::each(SIZE, most));
    }
}

#[test]
fn what_an_interchange_takes_of_a_load_module_for_its_width_leaves_no_street_out() {
    // Five motorways cross in one load module, where their sides meet more often than their middle lines.
    let motorway = |number: i64| {
        let (from, by) = (20.0 + 90.0 * number as f64, 4.0 * number as f64);
        way(number, "highway=motorway", &[(from, 20.0), (225.0 + by, 220.0 + by), (250.0, 380.0 - by)])
    };
    let street = |number, tags: &str, from, to| way(number, &format!("highway=residential {tags}"), &[from, to]);
    let elsewhere = |number: i64| {
        let north = 1.5 * number as f64 - 13.0;
        street(number, "", (5.0, north), (395.0, north))
    };
    let mut ways: Vec<Source> = (0..5).map(motorway).chain((10..20).map(elsewhere)).collect();
    ways.extend([
        street(30, "name=through", (120.0, 203.0), (190.0, 203.0)),
        street(31, "name=through", (190.0, 203.0), (260.0, 203.0)),
        street(32, "name=through", (260.0, 203.0), (330.0, 203.0)),
        street(33, "", (190.0, 203.0), (190.0, 130.0)),
        street(34, "", (260.0, 203.0), (260.0, 130.0)),
    ]);
    for others in (68..=92).step_by(4) {
        let mut shares = Shares::each(SIZE, 400);
        shares.modules.fill(Share { main: others * 8 / 5, others });
        let left_out = levelled(&ways, &shares).reserved.left_out;
        assert!(left_out.is_empty(), "{left_out:?} where others have {others}");
    }
}
