//! Networks that are hard to choose from: of each as much is in the ground as fits, it is whole, and `verify` counts it
//! from the load modules alone.

use std::f64::consts::TAU;

use inspect::NetworkFound;

use super::drawing::{At, Drawing, Drawn, line, polygon};
use crate::scene::Words;

fn hills(east: f64, north: f64) -> f64 {
    500.0 + 15.0 * ((east * 0.004).sin() + (north * 0.006).cos()) + 0.01 * north
}

/// What load modules hold of the features with these keys and limits, once a build is within limits and sound.
#[track_caller]
fn found(keys: &str, limits: &str, drawn: &[Drawn]) -> NetworkFound {
    let features = format!("{}\n{keys}", Drawing::words().features);
    let drawing = Drawing::of(Words { features, limits: limits.into(), ..Drawing::words() }, hills, drawn);
    drawing.built();
    let verdict = inspect::verify(&drawing.scene.path("area.tdb"), None).unwrap();
    assert_eq!(verdict.problems, Vec::<String>::new());
    let network = verdict.network.expect("a job with features");
    assert_eq!((network.pieces_missing, network.gaps), (0, 0), "{network:?}");
    network
}

/// Limits that hold all that a few roads need.
const WIDE: &str = "per_load_module = 1500\nmean_per_load_module = 500\nper_4km_square = 64000";
/// Those of SIMNET.
const SIMNET: &str = "per_load_module = 100\nmean_per_load_module = 32\nper_4km_square = 4096";

fn ring(tags: &str, (east, north): At, radius: f64) -> Drawn {
    let at = |number: i32| {
        let angle = TAU * f64::from(number % 16) / 16.0;
        (east + radius * angle.cos(), north + radius * angle.sin())
    };
    line(tags, &(0..=16).map(at).collect::<Vec<_>>())
}

#[test]
fn networks_of_one_class_are_kept_whole() {
    for tags in ["highway=motorway", "highway=track", "railway=rail", "waterway=stream"] {
        let drawn = [
            line(tags, &[(-200.0, 900.0), (800.0, 1000.0), (2200.0, 700.0)]),
            line(tags, &[(800.0, 2200.0), (800.0, 1000.0)]),
        ];
        let found = found("", WIDE, &drawn);
        assert!((2900.0..3400.0).contains(&found.kept_m), "{tags}: {found:?}");
        assert_eq!(found.ends, 0, "{tags}");
    }
}

#[test]
fn a_hundred_roads_that_meet_at_one_place_keep_all_limits() {
    let spoke = |number: i32| {
        let angle = TAU * f64::from(number) / 100.0;
        let tags = ["highway=primary", "highway=residential", "highway=track"][number as usize % 3];
        line(tags, &[(1010.0, 990.0), (1010.0 + 800.0 * angle.cos(), 990.0 + 800.0 * angle.sin())])
    };
    let drawn: Vec<Drawn> = (0..100).map(spoke).collect();
    for limits in [WIDE, SIMNET] {
        assert!(0.0 < found("", limits, &drawn).kept_m);
    }
}

#[test]
fn roundabouts_cul_de_sacs_and_a_motorway_with_no_exit_are_whole() {
    let drawn = [
        ring("highway=primary", (700.0, 700.0), 18.0),
        line("highway=primary", &[(718.0, 700.0), (1500.0, 760.0), (2100.0, 700.0)]),
        line("highway=residential", &[(700.0, 718.0), (710.0, 900.0), (700.0, 1100.0)]),
        ring("highway=residential", (700.0, 1112.0), 12.0),
        line("highway=motorway", &[(200.0, 1700.0), (1800.0, 1650.0)]),
    ];
    let found = found("", WIDE, &drawn);
    assert_eq!(found.ends, 0);
    assert!(3400.0 < found.kept_m, "{found:?}");
}

#[test]
fn a_bridge_longer_than_five_load_modules_is_one_way_from_end_to_end() {
    let words = |limits: &str| Words { size: (3, 9), tiles: (1, 3), limits: limits.into(), ..Drawing::words() };
    let drawn = [
        line("highway=primary", &[(-100.0, 740.0), (600.0, 740.0)]),
        line("highway=primary bridge=yes layer=1", &[(600.0, 740.0), (2000.0, 720.0), (3700.0, 760.0)]),
        line("highway=primary", &[(3700.0, 760.0), (4600.0, 740.0)]),
    ];
    for limits in [WIDE, SIMNET] {
        let drawing = Drawing::of(words(limits), hills, &drawn);
        drawing.built();
        let network = inspect::verify(&drawing.scene.path("area.tdb"), None).unwrap().network.unwrap();
        assert!((4400.0..4600.0).contains(&network.kept_m), "{network:?}");
        assert_eq!((network.pieces_missing, network.ends), (0, 0), "{network:?}");
    }
}

#[test]
fn all_of_a_network_in_one_load_module_is_within_its_limit() {
    let street = |number: i32| {
        let along = 520.0 + f64::from(number % 12) * 38.0;
        let places = if number < 12 { [(along, 510.0), (along, 985.0)] } else { [(510.0, along), (985.0, along)] };
        line("highway=residential", &places)
    };
    let mut drawn: Vec<Drawn> = (0..24).map(street).collect();
    drawn.push(polygon("natural=water", &[(600.0, 600.0), (720.0, 610.0), (700.0, 720.0), (610.0, 700.0)]));
    for limits in [WIDE, SIMNET] {
        found("", limits, &drawn);
    }
}

#[test]
fn ways_that_end_a_millimetre_before_or_beyond_the_border_have_no_loose_end() {
    for past in [-0.001, 0.0, 0.001] {
        let drawn = [
            line("highway=primary", &[(1000.0, 1000.0), (2000.0 + past, 1010.0)]),
            line("highway=track", &[(1000.0, 1000.0), (900.0, 0.0 - past)]),
            line("waterway=stream", &[(300.0, 2000.0 + past), (310.0, 300.0)]),
        ];
        let found = found("", WIDE, &drawn);
        assert_eq!(found.ends, 0, "{past}");
        assert!((3650.0..3750.0).contains(&found.kept_m), "{past}: {found:?}");
    }
}

#[test]
fn the_least_share_and_every_share_are_within_limits_and_none_or_two_are_refused() {
    let drawn = [
        line("highway=residential", &[(-100.0, 900.0), (2100.0, 1000.0)]),
        line("waterway=stream", &[(300.0, 2100.0), (500.0, 300.0)]),
    ];
    let least = found("share_max = 0.01\nshare_main = 0.01", WIDE, &drawn);
    assert_eq!(least.ends, 0);
    let all = found("share_max = 1", WIDE, &drawn);
    assert!(least.kept_m <= all.kept_m && 3700.0 < all.kept_m, "{least:?} {all:?}");
    for share in [0, 2] {
        let features = format!("{}\nshare_max = {share}", Drawing::words().features);
        let text = Words { features, ..Drawing::words() }.text();
        let refused = job::Job::from_text(&text, std::path::Path::new("job.toml")).unwrap_err().to_string();
        assert!(refused.contains("features.share_max"), "{refused}");
    }
}

#[test]
fn a_motorway_is_as_wide_as_it_is_although_one_load_module_on_its_way_is_half_full() {
    for (streets, limit, is_wide) in [(2, 100, true), (4, 100, true), (6, 150, true), (8, 100, false)] {
        let street = |number: u32| {
            let east = 1040.0 + 420.0 / f64::from(streets) * f64::from(number);
            line("highway=residential", &[(east, 1100.0), (east + 10.0, 1400.0)])
        };
        let mut drawn: Vec<Drawn> = (0..streets).map(street).collect();
        drawn.push(line("highway=motorway", &[(-50.0, 1210.0), (2050.0, 1230.0)]));
        let limits = format!("per_load_module = {limit}\nmean_per_load_module = 80\nper_4km_square = 64000");
        let drawing = Drawing::of(Words { limits, ..Drawing::words() }, hills, &drawn);
        let classes = drawing.scene.build("area.tdb", 2).report.features.unwrap().classes;
        let of = |name: &str| classes.iter().find(|class| class.name == name).cloned().unwrap();
        // Never at the cost of other ways.
        assert_eq!(of("minor").kept_km, of("minor").wanted_km, "{streets} streets, {limit}");
        let [strip, line] = [of("motorway").strip_km, of("motorway").line_km];
        assert!(if is_wide { line == 0.0 } else { strip == 0.0 }, "{streets} streets, {limit}: {strip} and {line} km");
    }
}

#[test]
fn rules_that_make_every_path_a_motorway_are_followed_within_limits() {
    let rules = "rules = [{ where = { highway = [\"path\", \"footway\"] }, kind = \"motorway\" }]";
    let path = |number: i32| {
        let north = 100.0 + 90.0 * f64::from(number);
        line("highway=path", &[(-50.0, north), (1000.0, north + 30.0), (2050.0, north)])
    };
    let drawn: Vec<Drawn> = (0..20).map(path).collect();
    let [few, all] = [SIMNET, WIDE].map(|limits| found(rules, limits, &drawn).kept_m);
    assert!(0.0 < few && few <= all && 39_000.0 < all, "{few} {all}");
}

#[test]
fn a_stream_below_a_road_is_missing_for_as_far_as_the_road_is_wide() {
    let drawn = [
        line("highway=primary", &[(-100.0, 1010.0), (2100.0, 1030.0)]),
        line("waterway=stream tunnel=culvert layer=-1", &[(900.0, 2050.0), (1010.0, -50.0)]),
        line("waterway=stream", &[(310.0, 2050.0), (300.0, 90.0)]),
    ];
    found("", WIDE, &drawn);
}

#[test]
fn what_is_left_out_ends_nowhere_and_a_lake_goes_before_streets() {
    let street = |number: i32| {
        let along = 40.0 + f64::from(number % 16) * 120.0;
        let places =
            if number < 16 { [(along, -50.0), (along + 20.0, 2050.0)] } else { [(-50.0, along), (2050.0, along)] };
        line("highway=residential", &places)
    };
    let mut drawn: Vec<Drawn> = (0..32).map(street).collect();
    drawn.push(line("highway=primary", &[(-50.0, 1333.0), (2050.0, 1307.0)]));
    drawn.push(polygon("natural=water", &[(430.0, 1530.0), (560.0, 1540.0), (540.0, 1660.0), (450.0, 1640.0)]));
    let drawing = Drawing::of(Words { limits: SIMNET.into(), ..Drawing::words() }, hills, &drawn);
    let report = drawing.scene.build("area.tdb", 2).report;
    // What to change, so that all of it is kept.
    assert!(report.enough.is_some_and(|enough| 32 < enough.mean), "{:?}", report.enough);
    let classes = report.features.unwrap().classes;
    let of = |name: &str| classes.iter().find(|class| class.name == name).cloned().unwrap_or_default();
    assert_eq!((of("lake").lakes_wanted, of("lake").lakes_kept), (1, 1));
    assert_eq!(of("primary").kept_km, of("primary").wanted_km);
    assert!(of("minor").kept_km < of("minor").wanted_km);
    let network = inspect::verify(&drawing.scene.path("area.tdb"), None).unwrap().network.unwrap();
    assert_eq!((network.lakes, network.lakes_off_level), (1, 0));
}
