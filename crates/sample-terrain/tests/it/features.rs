//! What the features of the sample terrain promise: the same ones for every rectangle, and a map that looks real.

use std::collections::{BTreeMap, BTreeSet};

use sample_terrain::{DEFAULT_SEED, SampleFeature, SampleShape, features, heights};
use terrain::{Dem, Post, PostRect, Spacing, metres_of_quanta};

use crate::check_golden;

/// FNV-1a of the features of [`golden`], little-endian; `UPDATE_GOLDEN=1` prints the new one.
const GOLDEN: &str = "0e42c54ec5a0ef8b";

/// Metres between the posts roads are measured on.
const POST_M: f64 = 25.0;

fn sample_area() -> Vec<SampleFeature> {
    features(DEFAULT_SEED, 0.0, 0.0, 50_000.0, 50_000.0)
}

fn is(feature: &SampleFeature, key: &str, value: &str) -> bool {
    feature.tags.contains(&(key, value))
}

fn is_road(feature: &SampleFeature) -> bool {
    feature.tags.iter().any(|(key, _)| *key == "highway")
}

fn line(feature: &SampleFeature) -> &[[f64; 2]] {
    match &feature.shape {
        SampleShape::Line(line) => line,
        SampleShape::Polygon(rings) => &rings[0],
    }
}

fn length_m(line: &[[f64; 2]]) -> f64 {
    line.windows(2).map(|leg| distance(leg[0], leg[1])).sum()
}

fn distance(a: [f64; 2], b: [f64; 2]) -> f64 {
    (b[0] - a[0]).hypot(b[1] - a[1])
}

fn bits(place: [f64; 2]) -> [u64; 2] {
    place.map(f64::to_bits)
}

#[test]
fn rectangles_that_overlap_show_the_same_features() {
    let whole = features(3, 50_000.0, -9_000.0, 75_000.0, 10_000.0);
    let by_id: BTreeMap<i64, &SampleFeature> = whole.iter().map(|feature| (feature.id, feature)).collect();
    assert_eq!(by_id.len(), whole.len(), "a number is used twice");
    let mut parts = BTreeSet::new();
    for (west_m, east_m) in [(50_000.0, 58_000.0), (58_000.0, 59_000.0), (59_000.0, 75_000.0)] {
        for feature in features(3, west_m, -9_000.0, east_m, 10_000.0) {
            assert_eq!(by_id.get(&feature.id), Some(&&feature));
            parts.insert(feature.id);
        }
    }
    assert_eq!(parts.len(), whole.len(), "a feature is in none of the parts");
}

#[test]
fn the_features_are_the_same_on_any_machine() {
    let golden = features(DEFAULT_SEED, 6_000.0, 10_000.0, 16_000.0, 20_000.0);
    let numbers = golden.iter().flat_map(|feature| {
        let places = line(feature).iter().flat_map(|place| bits(*place));
        [feature.id as u64].into_iter().chain(places).collect::<Vec<_>>()
    });
    check_golden(numbers.flat_map(u64::to_le_bytes), GOLDEN);
}

#[test]
fn the_sample_area_has_what_a_desert_map_shows() {
    let found = sample_area();
    let count = |key: &str, value: &str| found.iter().filter(|feature| is(feature, key, value)).count();
    assert!(1 <= count("highway", "primary"), "no highway");
    assert!(2 <= count("bridge", "yes"), "{} bridges", count("bridge", "yes"));
    assert!(4 <= count("highway", "track"), "{} tracks", count("highway", "track"));
    assert!(20 <= count("waterway", "stream"), "{} washes", count("waterway", "stream"));
    assert!(3 <= count("natural", "water"), "{} lakes", count("natural", "water"));
    let km = |is_one: &dyn Fn(&SampleFeature) -> bool| {
        found.iter().filter(|feature| is_one(feature)).map(|feature| length_m(line(feature))).sum::<f64>() / 1000.0
    };
    let (roads_km, washes_km) = (km(&is_road), km(&|feature| is(feature, "waterway", "stream")));
    assert!((500.0..1_200.0).contains(&roads_km), "{roads_km} km of roads");
    assert!((500.0..1_200.0).contains(&washes_km), "{washes_km} km of washes");
}

#[test]
fn a_small_area_has_a_road_and_a_wash() {
    let found = features(DEFAULT_SEED, 0.0, 0.0, 4_000.0, 4_000.0);
    assert!(found.iter().any(is_road));
    assert!(found.iter().any(|feature| is(feature, "waterway", "stream")));
}

#[test]
fn every_place_is_a_number_and_no_two_neighbours_are_equal() {
    for seed in [DEFAULT_SEED, 2, u64::MAX] {
        for feature in features(seed, -70_000.0, 5_000.0, -50_000.0, 25_000.0) {
            let line = line(&feature);
            assert!(2 <= line.len(), "{feature:?}");
            assert!(line.iter().flatten().all(|axis| axis.is_finite()), "{feature:?}");
            assert!(line.windows(2).all(|leg| leg[0] != leg[1]), "{feature:?}");
        }
    }
}

#[test]
fn far_away_there_are_features_too_and_none_where_there_is_no_rectangle() {
    let far = features(DEFAULT_SEED, -20e6, 30e6, -20e6 + 10_000.0, 30e6 + 10_000.0);
    assert!(far.iter().any(is_road) && far.len() < 200, "{} features", far.len());
    for [west, east] in [[0.0, 0.0], [1.0, 0.0], [f64::NAN, 1.0], [0.0, f64::INFINITY]] {
        assert_eq!(features(DEFAULT_SEED, west, 0.0, east, 1_000.0), []);
    }
}

#[test]
fn tags_are_words_of_the_table_of_kinds() {
    for feature in sample_area() {
        let kinds = [
            ("highway", vec!["primary", "secondary", "unclassified", "track"]),
            ("waterway", vec!["stream"]),
            ("natural", vec!["water"]),
        ];
        let known = kinds.iter().filter(|(key, values)| values.iter().any(|value| is(&feature, key, value)));
        assert_eq!(known.count(), 1, "{:?}", feature.tags);
        let is_area = matches!(feature.shape, SampleShape::Polygon(_));
        assert_eq!(is_area, is(&feature, "natural", "water"));
    }
}

#[test]
fn a_bridge_joins_two_roads_of_its_class_over_a_wash() {
    let found = sample_area();
    for bridge in found.iter().filter(|feature| is(feature, "bridge", "yes")) {
        let deck = line(bridge);
        assert!((40.0 - 0.5..=80.5).contains(&length_m(deck)), "{} m", length_m(deck));
        let class = bridge.tags.iter().find(|(key, _)| *key == "highway").expect("a bridge is a road");
        for end in [deck[0], deck[deck.len() - 1]] {
            let joined = found.iter().filter(|other| {
                let line = line(other);
                let is_end = bits(line[0]) == bits(end) || bits(line[line.len() - 1]) == bits(end);
                other.id != bridge.id && other.tags.contains(class) && is_end
            });
            assert_eq!(joined.count(), 1);
        }
        let washes = found.iter().filter(|feature| is(feature, "waterway", "stream"));
        assert_eq!(washes.filter(|wash| crosses(deck, line(wash))).count(), 1);
    }
}

#[test]
fn roads_meet_at_shared_vertices_only() {
    let found = sample_area();
    let roads: Vec<&[[f64; 2]]> = found.iter().filter(|feature| is_road(feature)).map(line).collect();
    for (number, road) in roads.iter().enumerate() {
        for other in &roads[number + 1..] {
            assert!(!crosses(road, other), "two roads cross near {:?}", road[0]);
        }
    }
    // The network hangs together: nearly every end is an end or a vertex of another road.
    let mut ends: BTreeMap<[u64; 2], usize> = BTreeMap::new();
    for end in roads.iter().flat_map(|road| [road[0], road[road.len() - 1]]) {
        *ends.entry(bits(end)).or_default() += 1;
    }
    let alone = ends.values().filter(|count| **count == 1).count();
    assert!(alone * 3 < ends.len(), "{alone} of {} ends are joined to nothing", ends.len());
}

/// Whether two lines cross away from their vertices.
fn crosses(one: &[[f64; 2]], other: &[[f64; 2]]) -> bool {
    let low = |line: &[[f64; 2]], axis: usize| line.iter().map(|place| place[axis]).fold(f64::MAX, f64::min);
    let high = |line: &[[f64; 2]], axis: usize| line.iter().map(|place| place[axis]).fold(f64::MIN, f64::max);
    if (0..2).any(|axis| high(one, axis) < low(other, axis) || high(other, axis) < low(one, axis)) {
        return false;
    }
    let side = |a: [f64; 2], b: [f64; 2], p: [f64; 2]| (b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0]);
    one.windows(2).any(|ab| {
        other.windows(2).any(|cd| {
            side(ab[0], ab[1], cd[0]) * side(ab[0], ab[1], cd[1]) < 0.0
                && side(cd[0], cd[1], ab[0]) * side(cd[0], cd[1], ab[1]) < 0.0
        })
    })
}

/// The ground of the default area at 25 m.
fn ground() -> Dem {
    heights(DEFAULT_SEED, PostRect::of_size(2001, 2001), Spacing::from_metres(POST_M).expect("a multiple"))
}

/// Metres at a place, between its four posts; nothing outside.
fn height_m(dem: &Dem, place: [f64; 2]) -> Option<f64> {
    let [east, north] = place.map(|axis| axis / POST_M);
    let (col, row) = (east.floor() as i32, north.floor() as i32);
    if !(0..2000).contains(&col) || !(0..2000).contains(&row) {
        return None;
    }
    let (right, up) = (east - f64::from(col), north - f64::from(row));
    let post = |row: i32, col: i32| metres_of_quanta(dem.height(Post::new(row, col)));
    let low = post(row, col) + right * (post(row, col + 1) - post(row, col));
    let high = post(row + 1, col) + right * (post(row + 1, col + 1) - post(row + 1, col));
    Some(low + up * (high - low))
}

/// Grades of the ground along a road, every 25 m or so, smoothed as a road's own heights are.
fn grades(dem: &Dem, road: &[[f64; 2]]) -> Vec<f64> {
    let steps = |leg: &[[f64; 2]]| {
        let count = (distance(leg[0], leg[1]) / POST_M).ceil() as usize;
        let (a, b) = (leg[0], leg[1]);
        (0..count).map(move |step| [0, 1].map(|axis| a[axis] + (b[axis] - a[axis]) * step as f64 / count as f64))
    };
    let places: Vec<[f64; 2]> = road.windows(2).flat_map(steps).collect();
    let heights: Vec<Option<f64>> = places.iter().map(|place| height_m(dem, *place)).collect();
    let smooth: Vec<Option<f64>> =
        heights.windows(3).map(|near| Some(0.25 * near[0]? + 0.5 * near[1]? + 0.25 * near[2]?)).collect();
    let grade = |at: usize| Some((smooth[at + 1]? - smooth[at]?).abs() / distance(places[at + 1], places[at + 2]));
    (0..smooth.len().saturating_sub(1)).filter_map(grade).collect()
}

#[test]
fn highways_are_even_and_tracks_climb_as_a_vehicle_can() {
    let dem = ground();
    let mut of: BTreeMap<&str, Vec<f64>> = BTreeMap::new();
    for road in sample_area().iter().filter(|feature| is_road(feature)) {
        let class = road.tags.iter().find(|(key, _)| *key == "highway").map_or("", |(_, value)| value);
        of.entry(class).or_default().extend(grades(&dem, line(road)));
    }
    let share_over = |class: &str, most: f64| {
        of[class].iter().filter(|grade| most < **grade).count() as f64 / of[class].len() as f64
    };
    let mean = |class: &str| of[class].iter().sum::<f64>() / of[class].len() as f64;
    assert!(mean("primary") < 0.03 && mean("secondary") < 0.03, "{} {}", mean("primary"), mean("secondary"));
    assert!(share_over("primary", 0.10) < 0.02, "{}", share_over("primary", 0.10));
    assert!(share_over("track", 0.25) < 0.04, "{}", share_over("track", 0.25));
    assert!(0.05 < share_over("track", 0.10), "no track climbs over a pass");
}

#[test]
fn lakes_are_level_and_washes_fall() {
    let dem = ground();
    let found = sample_area();
    for lake in found.iter().filter(|feature| is(feature, "natural", "water")) {
        let ring = line(lake);
        assert_eq!(bits(ring[0]), bits(ring[ring.len() - 1]), "a ring is closed");
        let mut shore: Vec<f64> = ring.iter().filter_map(|place| height_m(&dem, *place)).collect();
        shore.sort_by(f64::total_cmp);
        if let [lowest, .., _] = shore[..] {
            assert!(
                shore[shore.len() / 2] - lowest < 1.5,
                "a shore stands {} m above its lake",
                shore[shore.len() / 2] - lowest
            );
        }
    }
    let ends = |wash: &SampleFeature| {
        let line = line(wash);
        Some((height_m(&dem, line[0])?, height_m(&dem, line[line.len() - 1])?))
    };
    let washes: Vec<(f64, f64)> =
        found.iter().filter(|feature| is(feature, "waterway", "stream")).filter_map(ends).collect();
    let rising = washes.iter().filter(|(from, to)| from < to).count();
    assert!(rising * 10 < washes.len(), "{rising} of {} washes end higher than they begin", washes.len());
}

#[test]
fn no_road_leads_through_a_lake() {
    for seed in [DEFAULT_SEED, 2] {
        let found = features(seed, 0.0, 0.0, 50_000.0, 50_000.0);
        for lake in found.iter().filter(|feature| is(feature, "natural", "water")) {
            for road in found.iter().filter(|feature| is_road(feature)) {
                assert!(!crosses(line(lake), line(road)), "seed {seed}: road {} in lake {}", road.id, lake.id);
            }
        }
    }
}
