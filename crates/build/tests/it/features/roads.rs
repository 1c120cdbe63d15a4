//! Roads, junctions, bridges and tunnels.

use build::ground::GamingArea;
use features::Kind;
use store::Folder;
use terrain::Role;

use super::drawing::{At, Drawing, Drawn, Laid, SIDE_M, line, polygon};
use crate::given::write_pins;
use crate::scene::Words;

/// The fall across a road at a place, between points so far to the left and to the right.
#[track_caller]
fn fall_across(laid: &Laid, (east, north): At, (x, y): At) -> f64 {
    (laid.height((east - x, north - y)) - laid.height((east + x, north + y))).abs()
}

#[test]
fn a_road_across_a_side_slope_of_thirty_percent_is_level_across() {
    let laid =
        Drawing::new(|_, north| 500.0 + 0.3 * north, &[line("highway=primary", &[(0.0, 900.0), (SIDE_M, 910.0)])])
            .built();
    assert!(!laid.lines(Kind::Primary, Role::Side).is_empty(), "the slope asks for a strip");
    for place in [130.0, 777.0, 1410.0] {
        let at = (place, 900.0 + place / 200.0);
        assert!(fall_across(&laid, at, (0.0, 3.0)) < 0.05, "{}", fall_across(&laid, at, (0.0, 3.0)));
        assert_eq!(laid.class(at), "primary");
        assert_eq!(laid.class((place, at.1 + 40.0)), "default");
    }
}

#[test]
fn heights_of_pins_on_roads_and_in_water_are_not_taken_and_told() {
    let shore = [(1200.0, 1200.0), (1600.0, 1200.0), (1600.0, 1600.0), (1200.0, 1600.0)];
    let drawn = [line("highway=primary", &[(0.0, 900.0), (SIDE_M, 900.0)]), polygon("natural=water", &shore)];
    let words = Words { tin: "pins = \"pins.geojson\"".into(), ..Drawing::words() };
    let drawing = Drawing::of(words, |_, _| 500.0, &drawn);
    let height = |row, col| ("height", row, col, r#","height_m":505"#);
    write_pins(&drawing.scene.path("pins.geojson"), &[height(36, 33), height(56, 56), height(20, 20)]);
    let warnings = drawing.scene.build("area.tdb", 2).report.warnings;
    let [told] = &warnings[..] else { panic!("expected one warning: {warnings:?}") };
    assert!(told.contains("pins.geojson: feature 0: a height of 505.00 m lies on primary"), "{told}");
    assert!(told.ends_with("; 2 such heights in all"), "{told}");
    let laid = drawing.built();
    assert_eq!([(825.0, 900.0), (1400.0, 1400.0), (500.0, 500.0)].map(|at| laid.height(at)), [500.0, 500.0, 505.0]);
}

#[test]
fn a_hairpin_keeps_its_two_legs_apart_and_its_grade() {
    let bend: Vec<At> = vec![(200.0, 300.0), (1500.0, 700.0), (1560.0, 740.0), (1500.0, 790.0), (250.0, 1250.0)];
    let laid = Drawing::new(|_, north| 500.0 + 0.25 * north, &[line("highway=track", &bend)]).built();
    let lower = laid.height((800.0, 300.0 + 600.0 * 400.0 / 1300.0));
    let upper = laid.height((800.0, 790.0 + 700.0 * 460.0 / 1250.0));
    assert!(lower + 50.0 < upper, "{lower} {upper}");
}

#[test]
fn roads_that_meet_on_a_slope_have_one_height_where_they_meet() {
    let drawn = [
        line("highway=primary", &[(100.0, 1000.0), (1000.0, 1000.0), (1900.0, 1000.0)]),
        line("highway=service", &[(1000.0, 1000.0), (1000.0, 1900.0)]),
    ];
    let laid = Drawing::new(|east, north| 500.0 + 0.12 * north + 0.03 * east, &drawn).built();
    let through = laid.height((1000.0, 1000.0));
    assert!((laid.height((1000.0, 1004.0)) - through).abs() < 1.0);
    assert!(!laid.was_told("grade"), "{:?}", laid.level.remarks);
}

#[test]
fn a_bridge_leaves_the_ground_below_it_alone_and_its_approaches_stay_up() {
    // A gorge 60 m deep and 100 m wide whose banks sag.
    let gorge = |east: f64, _: f64| 600.0 - 60.0 * (1.0 - ((east - 1000.0).abs() / 100.0).min(1.0));
    let drawn = [
        line("highway=primary", &[(100.0, 700.0), (910.0, 700.0)]),
        line("highway=primary bridge=yes layer=1", &[(910.0, 700.0), (1090.0, 700.0)]),
        line("highway=primary", &[(1090.0, 700.0), (1900.0, 700.0)]),
    ];
    let (with, without) = (Drawing::new(gorge, &drawn), Drawing::new(gorge, &drawn[..0]));
    let (with, without) = (with.built(), without.built());
    let bottom = (1000.0, 700.0);
    assert!((with.height(bottom) - without.height(bottom)).abs() < 3.0, "the gorge stays open");
    assert!(590.0 < with.height((905.0, 700.0)), "{}", with.height((905.0, 700.0)));
    // Over the bridge, and under it.
    let (over, under) = (with.height_below(bottom, 1000.0), with.height_below(bottom, 580.0));
    assert!(590.0 < over && (under - with.height(bottom)).abs() < 0.02, "{over} {under}");
    assert_eq!(with.height_below((1000.0, 760.0), 1000.0), with.height((1000.0, 760.0)));
}

#[test]
fn a_tunnel_leaves_the_mountain_alone() {
    let mountain = |east: f64, _: f64| 600.0 + 200.0 * (1.0 - ((east - 1000.0).abs() / 300.0).min(1.0));
    let drawn = [
        line("highway=primary", &[(100.0, 1300.0), (650.0, 1300.0)]),
        line("highway=primary tunnel=yes layer=-1", &[(650.0, 1300.0), (1350.0, 1300.0)]),
        line("highway=primary", &[(1350.0, 1300.0), (1900.0, 1300.0)]),
    ];
    let laid = Drawing::new(mountain, &drawn).built();
    assert!(780.0 < laid.height((1000.0, 1300.0)), "{}", laid.height((1000.0, 1300.0)));
    assert_eq!(laid.class((1000.0, 1300.0)), "default");
}

#[test]
fn a_road_on_a_causeway_stands_above_low_ground() {
    // A dip that the road's grade does not allow to follow.
    let dip = |east: f64, _: f64| 500.0 - 40.0 * (1.0 - ((east - 1000.0).abs() / 150.0).min(1.0));
    let laid = Drawing::new(dip, &[line("highway=motorway", &[(50.0, 1100.0), (1950.0, 1100.0)])]).built();
    assert!(470.0 < laid.height((1000.0, 1100.0)), "{}", laid.height((1000.0, 1100.0)));
    assert!(laid.height((1000.0, 1180.0)) < 465.0, "the dip beside it stays");
}

#[test]
fn two_hundred_roads_in_one_load_module_keep_all_limits() {
    let tags = ["highway=motorway", "highway=primary", "highway=service", "highway=track"];
    let road = |number: usize| {
        let north = 505.0 + number as f64 * 2.4;
        line(tags[number % 4], &[(510.0, north), (990.0, north + 1.0)])
    };
    let laid = Drawing::new(|_, north| 500.0 + 0.1 * north, &(0..200).map(road).collect::<Vec<_>>()).built();
    assert!(laid.was_told("left out"), "not all of them fit");
}

/// Streets 61 m apart and a few degrees off north, broken off here and there, every fifth of them a main one.
fn streets() -> Vec<Drawn> {
    const APART_M: f64 = 61.0;
    let place = |along: f64, across: f64| (along - 0.05 * across + 200.0, across + 0.05 * along - 30.0);
    let street = |number: usize, is_east: bool| {
        let class = if number.is_multiple_of(5) { "highway=primary" } else { "highway=residential" };
        let at = |crossing: usize| {
            let (along, across) = (crossing as f64 * APART_M, number as f64 * APART_M);
            if is_east { place(along, across) } else { place(across, along) }
        };
        let pieces = (0..30).step_by(6).filter(move |first| (first + number) % 4 != 3);
        pieces.map(move |first| line(class, &(first..=first + 6).map(at).collect::<Vec<_>>())).collect::<Vec<_>>()
    };
    (0..30).flat_map(|number| [true, false].map(|is_east| street(number, is_east))).flatten().collect()
}

#[test]
fn a_grid_of_streets_on_slopes_is_sound_whatever_the_side_of_a_load_module() {
    let hills = |east: f64, north: f64| 500.0 + 60.0 * ((east * 0.009).sin() + (north * 0.011).cos()) + 0.1 * north;
    for side in [125, 250, 500] {
        let modules = format!("side_m = {side}");
        let limits = "per_load_module = 8000\nmean_per_load_module = 2000\nper_4km_square = 900000".into();
        let words = Words { modules, limits, ..Drawing::words() };
        let drawing = Drawing::of(words, hills, &streets());
        drawing.scene.build("area.tdb", 2);
        drawing.scene.verify("area.tdb");
        let level = Folder::new(drawing.scene.path("area.tdb")).read_level().unwrap().2;
        assert!(level.strips.iter().all(|strips| 50 < strips.pieces), "{side} m: {:?}", level.strips);
    }
}

#[test]
fn bow_ties_doubles_and_gaps_are_mended_and_told() {
    let drawn = [
        line("highway=track", &[(100.0, 100.0), (900.0, 100.0)]),
        line("highway=track", &[(900.0, 100.0), (100.0, 100.0)]),
        line("highway=track", &[(900.4, 100.0), (1500.0, 400.0)]),
        line("highway=track", &[(300.0, 600.0), (300.0, 600.0)]),
        polygon("natural=water", &[(1000.0, 1000.0), (1400.0, 1400.0), (1400.0, 1000.0), (1000.0, 1400.0)]),
    ];
    let laid = Drawing::new(|east, _| 500.0 + 0.01 * east, &drawn).built();
    for words in ["copy of another", "misses another way", "ring crosses itself"] {
        assert!(laid.was_told(words), "{words}: {:?}", laid.level.remarks);
    }
}

#[test]
fn a_road_through_the_corner_of_four_tiles_and_one_along_the_border_are_built() {
    let drawn = [
        line("highway=primary", &[(400.0, 400.0), (1000.0, 1000.0), (1600.0, 1600.0)]),
        line("highway=secondary", &[(0.0, 0.0), (SIDE_M, 0.0)]),
        line("highway=track", &[(SIDE_M, 200.0), (SIDE_M, 1800.0)]),
    ];
    Drawing::new(|east, north| 500.0 + 0.05 * east + 0.08 * north, &drawn).built();
}

#[test]
fn decks_are_the_same_whether_load_modules_have_lines_or_not() {
    // Ridges and hollows along a slope, with bridges of 20 m between two bends of roads.
    let ground = |east: f64, north: f64| 500.0 + 0.4 * north + 12.0 * (east / 17.0).sin() * (north / 23.0).cos();
    let road = |number: i32| {
        let north = 110.0 + 90.0 * f64::from(number);
        let bridge = 300.0 + 70.0 * f64::from(number);
        [
            line("highway=primary", &[(bridge - 200.0, north), (bridge, north)]),
            line("highway=primary bridge=yes layer=1", &[(bridge, north), (bridge + 20.0, north)]),
            line("highway=primary", &[(bridge + 20.0, north), (bridge + 220.0, north)]),
        ]
    };
    let drawn: Vec<Drawn> = (0..18).flat_map(road).collect();
    let decks = |modules: &str| {
        let words = Words { modules: modules.into(), ..Drawing::words() };
        let drawing = Drawing::of(words, ground, &drawn);
        drawing.scene.build("area.tdb", 2);
        let folder = Folder::new(drawing.scene.path("area.tdb"));
        let manifest = folder.manifest().unwrap();
        let tiles = GamingArea::new(&drawing.scene.job).unwrap().tiles;
        let modules = tiles.iter().flat_map(|tile| folder.read_modules(&manifest, *tile).unwrap().1);
        modules.map(|module| (module.lines.len(), module.decks)).collect::<Vec<_>>()
    };
    let [with, without] = [decks("format = 3"), decks("format = 2")];
    assert!(with.iter().any(|(lines, _)| 0 < *lines) && without.iter().all(|(lines, _)| *lines == 0));
    assert!(with.iter().filter(|(_, decks)| !decks.is_empty()).count() > 4);
    let only = |of: &[(usize, terrain::Decks)]| of.iter().map(|(_, decks)| decks.clone()).collect::<Vec<_>>();
    assert!(only(&with) == only(&without), "decks of bridges differ");
}
