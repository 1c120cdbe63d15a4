//! Rivers and lakes.

use features::Kind;
use store::FeatureRemark;
use terrain::Role;

use super::drawing::{At, Drawing, Laid, SIDE_M, line, polygon};
use crate::given::write_pins;
use crate::scene::{SIDE_CELLS, Words};

/// Ground that falls to the south with noise of some metres.
fn noisy(east: f64, north: f64) -> f64 {
    400.0 + 0.02 * north + 6.0 * ((east * 0.013).sin() * (north * 0.017).cos()) + 0.01 * (east - 1000.0).abs()
}

#[track_caller]
fn never_rises(laid: &Laid, kind: Kind) {
    let lines = laid.lines(kind, Role::Channel);
    assert!(!lines.is_empty());
    for line in lines {
        let heights: Vec<f64> = line.iter().map(|vertex| vertex[2]).collect();
        assert!(heights.is_sorted() || heights.iter().rev().is_sorted(), "{heights:?}");
    }
}

#[test]
fn a_river_on_noisy_ground_falls_all_the_way() {
    let river: Vec<At> =
        (0..=40).map(|at| (1000.0 + 80.0 * f64::from(at % 5), SIDE_M - 50.0 * f64::from(at))).collect();
    let laid = Drawing::new(noisy, &[line("waterway=river", &river)]).built();
    never_rises(&laid, Kind::River);
}

#[test]
fn a_river_along_a_border_of_fixed_or_given_points_falls_between_its_stations() {
    let fixed = Words { modules: "outer_border = \"fixed\"".into(), ..Drawing::words() };
    let pinned = Words { tin: "pins = \"pins.geojson\"".into(), ..Drawing::words() };
    let river = [(SIDE_M, SIDE_M), (SIDE_M, 1010.0), (SIDE_M, 0.0)];
    for words in [fixed, pinned] {
        let drawing = Drawing::of(words, noisy, &[line("waterway=river", &river)]);
        let pins = [7, 22, 33, 51].map(|row| ("height", row, 4 * SIDE_CELLS, r#","height_m":900"#));
        write_pins(&drawing.scene.path("pins.geojson"), &pins);
        let laid = drawing.built();
        let heights: Vec<f64> = (0..=4 * SIDE_M as u32).map(|at| laid.height((SIDE_M, f64::from(at) / 4.0))).collect();
        let rising = heights.windows(2).position(|pair| pair[1] < pair[0] - 1e-6);
        assert_eq!(rising, None, "quarters of metres from the south at which the surface rises downstream");
    }
}

#[test]
fn a_stream_that_is_left_out_still_runs_through_what_stands_in_its_way() {
    let dam = |_: f64, north: f64| 400.0 + 0.02 * north + if (north - 1000.0).abs() < 40.0 { 5.0 } else { 0.0 };
    let features = format!("{}\nshare_max = 0.01\nshare_main = 0.01", Drawing::words().features);
    let limits = "per_load_module = 100\nmean_per_load_module = 100".into();
    let stream = line("waterway=stream", &[(1000.0, 2050.0), (1000.0, -50.0)]);
    let laid = Drawing::of(Words { features, limits, ..Drawing::words() }, dam, &[stream]).built();
    assert!(laid.was_told("left out"));
    let [through, beside] = [1000.0, 1400.0].map(|east| laid.height((east, 1000.0)));
    assert!(through < 422.5 && 424.0 < beside, "{through} m where it runs, {beside} m beside it");
}

#[test]
fn streams_that_end_at_one_place_both_fall_to_it() {
    let basin = |east: f64, _: f64| 400.0 + 0.03 * (east - 1000.0).abs();
    let drawn = [
        line("waterway=stream", &[(100.0, 800.0), (1000.0, 820.0)]),
        line("waterway=stream", &[(1900.0, 850.0), (1000.0, 820.0)]),
    ];
    let laid = Drawing::new(basin, &drawn).built();
    assert_eq!(laid.lines(Kind::Stream, Role::Channel).len(), 2, "no line runs through the place they end at");
    never_rises(&laid, Kind::Stream);
}

#[test]
fn rivers_that_meet_go_on_at_one_height() {
    let drawn = [
        line("waterway=river", &[(300.0, 1900.0), (1000.0, 1000.0), (1000.0, 50.0)]),
        line("waterway=stream", &[(1700.0, 1900.0), (1000.0, 1000.0)]),
    ];
    let laid = Drawing::new(noisy, &drawn).built();
    never_rises(&laid, Kind::River);
    never_rises(&laid, Kind::Stream);
}

#[test]
fn a_lake_over_four_tiles_with_an_island_is_level_and_no_shore_lies_below_it() {
    let shore = [(700.0, 700.0), (1300.0, 650.0), (1350.0, 1300.0), (720.0, 1280.0)];
    let laid = Drawing::new(noisy, &[polygon("natural=water", &shore)]).built();
    let level = laid.height((1000.0, 1000.0));
    for at in [(750.0, 750.0), (1250.0, 760.0), (1200.0, 1200.0), (999.0, 720.0), (1001.0, 1250.0)] {
        assert!((laid.height(at) - level).abs() < 1.0 / 64.0, "{at:?}: {} and {level}", laid.height(at));
        assert_eq!(laid.class(at), "lake");
    }
    assert_eq!(laid.heights_of(Kind::Lake).len(), 1, "all vertices of the lake have one height");
    for at in [(660.0, 1000.0), (1400.0, 1000.0), (1000.0, 1340.0)] {
        assert!(level - 0.02 <= laid.height(at), "{at:?} lies below the lake");
    }
}

#[test]
fn a_road_through_a_lake_or_along_its_shore_leaves_it_level() {
    let shore = [(700.0, 700.0), (1300.0, 650.0), (1350.0, 1300.0), (720.0, 1280.0)];
    let drawn = [
        polygon("natural=water", &shore),
        line("highway=primary", &[(50.0, 1000.0), (1950.0, 1010.0)]),
        line("highway=residential", &[(697.0, 600.0), (697.0, 700.0), (717.0, 1290.0), (300.0, 1500.0)]),
    ];
    let laid = Drawing::new(noisy, &drawn).built();
    assert_eq!(laid.heights_of(Kind::Lake).len(), 1, "all vertices of the lake have one height");
    let [causeway, water] = [(1000.0, 1005.0), (1000.0, 1040.0)];
    assert_eq!([laid.class(causeway), laid.class(water)], ["primary", "lake"]);
    let above = laid.height(causeway) - laid.height(water);
    assert!(above.abs() < 1.0 / 64.0, "the causeway lies {above} m above the water");
}

#[test]
fn a_dam_keeps_two_levels_apart() {
    let drawn = [
        polygon("natural=water", &[(600.0, 600.0), (1400.0, 600.0), (1400.0, 1400.0), (600.0, 1400.0)]),
        line("waterway=dam", &[(990.0, 500.0), (990.0, 1500.0)]),
    ];
    let laid = Drawing::new(|east, _| if east < 1010.0 { 500.0 } else { 480.0 }, &drawn).built();
    assert!(10.0 < laid.height((800.0, 1000.0)) - laid.height((1200.0, 1000.0)));
}

#[test]
fn a_road_over_a_river_without_a_bridge_is_a_culvert() {
    let drawn = [
        line("waterway=river", &[(1000.0, 1900.0), (1000.0, 100.0)]),
        line("highway=primary", &[(100.0, 1010.0), (1900.0, 1010.0)]),
    ];
    let laid = Drawing::new(noisy, &drawn).built();
    assert!(laid.was_told("a road crosses a river without a bridge"), "{:?}", laid.level.remarks);
    assert!(laid.level.remarks.iter().any(FeatureRemark::is_culvert), "{:?}", laid.level.remarks);
    assert_eq!(laid.class((1000.0, 1010.0)), "primary");
}

#[test]
fn a_river_along_a_tile_line_is_in_both_tiles() {
    let laid = Drawing::new(noisy, &[line("waterway=river", &[(1000.0, SIDE_M), (1000.0, 0.0)])]).built();
    never_rises(&laid, Kind::River);
    let on_line = |index: usize| laid.tiles[index].0.kept.edges.len();
    assert!(0 < on_line(0) && on_line(0) == on_line(1), "{} and {}", on_line(0), on_line(1));
}
