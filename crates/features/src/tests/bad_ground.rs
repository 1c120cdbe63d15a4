//! What roads, rivers and lakes make of DEMs and maps that are wrong: tests over made-up ground.

use std::collections::BTreeMap;

use terrain::in_turn;

use crate::samples::{ground_at, site, way};
use crate::{
    AreaFeatures, FallOptions, Flaw, FormedEdge, GradeOptions, Levelled, Place, Position, Remedy, Role, Rule, RuleKind,
    Shape, Shares, Sounded, Source,
};

/// What features of an area came to, and the ground that they were laid over.
struct Laid {
    levelled: Levelled,
    heights: BTreeMap<Place, i32>,
}

impl Laid {
    /// Features over a ground that is a function of posts (east, north), as a DEM has it: known at whole posts, and
    /// between them by rounding to the nearest.
    fn of(sources: Vec<Source>, metres: impl Fn(f64, f64) -> f64) -> Self {
        Self::by_rules(sources, &[], metres)
    }

    fn by_rules(sources: Vec<Source>, rules: &[Rule], metres: impl Fn(f64, f64) -> f64) -> Self {
        let all = AreaFeatures::of(sources, rules, 1.5, site(), &in_turn);
        let ground: Vec<Option<i32>> = all.stations().iter().map(|place| ground_at(*place, &metres)).collect();
        let middle = |place: &Place| {
            let [east, north] = all.site.lattice.posts_of(*place);
            let around = |at: i32| (f64::from(at % 3 - 1), f64::from(at / 3 - 1));
            let mut nine: Vec<f64> = (0..9).map(around).map(|(x, y)| metres(east + x, north + y)).collect();
            nine.sort_by(f64::total_cmp);
            terrain::quanta_of_metres(nine[4])
        };
        let middles: Vec<Option<i32>> = all.stations().iter().map(middle).collect();
        let inside = vec![Vec::new(); all.outlines().len()];
        let sounded = Sounded { heights: &ground, middles: &middles, inside: &inside };
        let options = (GradeOptions::USUAL, FallOptions::USUAL);
        let levelled = all.level(sounded, options, &Shares::each([8, 8], 1 << 20), &in_turn);
        let heights = levelled.reserved.formed.points.iter().copied().collect();
        let laid = Self { levelled, heights };
        laid.falls();
        laid
    }

    fn edges(&self, role: Role) -> impl Iterator<Item = ([Place; 2], [i32; 2])> + '_ {
        let formed = &self.levelled.reserved.formed;
        let ends = |edge: &FormedEdge| {
            let ends = if edge.backwards { [edge.b, edge.a] } else { [edge.a, edge.b] };
            let [a, b] = ends.map(|end| formed.points[end as usize]);
            ([a.0, b.0], [a.1, b.1])
        };
        formed.edges.iter().filter(move |edge| edge.role == role).map(ends)
    }

    /// No channel rises.
    #[track_caller]
    fn falls(&self) {
        assert!(self.edges(Role::Channel).all(|(_, [from, to])| to <= from), "a channel rises");
    }

    /// Metres above a ground, of what has one of these roles, the farthest.
    fn farthest(&self, roles: &[Role], metres: impl Fn(f64, f64) -> f64) -> f64 {
        let ends = roles.iter().flat_map(|role| self.edges(*role)).flat_map(|(places, _)| places);
        let off = ends.map(|place| {
            let [east, north] = site().lattice.posts_of(place);
            (terrain::metres_of_quanta(self.heights[&place]) - metres(east, north)).abs()
        });
        off.fold(0.0, f64::max)
    }

    fn count(&self, is: fn(&Flaw) -> bool) -> usize {
        self.levelled.remarks.iter().filter(|remark| is(&remark.flaw)).count()
    }
}

/// A hillside that falls to the west and, less, to the south.
fn hill(east: f64, north: f64) -> f64 {
    200.0 + 0.3 * east + 0.1 * north
}

#[test]
fn a_road_over_a_spike_of_the_dem_stays_on_the_ground_around_it() {
    let road = way(1, "highway=secondary", &[(10.0, 20.0), (90.0, 20.0)]);
    // One post, a wall across the road, and five posts along it.
    for (along, across, off_max) in [(0.6, 0.6, 1.0), (0.6, 90.0, 1.0), (2.6, 0.6, 5.0)] {
        let is_in = |east: f64, north: f64| (east - 50.0).abs() < along && (north - 20.0).abs() < across;
        let spiked = |east: f64, north: f64| hill(east, north) + if is_in(east, north) { 300.0 } else { 0.0 };
        let laid = Laid::of(vec![road.clone()], spiked);
        let off = laid.farthest(&[Role::Side, Role::Centre], hill);
        assert!(off < off_max, "{along} {across}: {off} m");
        assert_eq!(laid.levelled.earthworks.far_off[0].off.signum(), -1, "the cut through it is told");
    }
}

/// A wall five posts thick may be ground, as far as anyone can tell. What lies beyond limits weighs twenty times as
/// much as the ground, so the road is lifted until what lies too high outweighs that, however high the wall is.
#[test]
fn a_wall_too_wide_for_a_spike_lifts_a_road_no_more_than_its_limits_weigh() {
    let road = way(1, "highway=secondary", &[(10.0, 20.0), (90.0, 20.0)]);
    let mut before = 0.0;
    for tall in [100.0, 300.0, 1000.0] {
        let walled = |east: f64, north: f64| hill(east, north) + if (east - 50.0).abs() < 2.6 { tall } else { 0.0 };
        let off = Laid::of(vec![road.clone()], walled).farthest(&[Role::Side, Role::Centre], hill);
        assert!(off < 20.0 && (before == 0.0 || before == off), "{tall}: {off} m, as for any height: {before} m");
        before = off;
    }
}

#[test]
fn a_river_over_a_pit_of_the_dem_passes_over_it() {
    let river = way(1, "waterway=river", &[(90.0, 20.0), (10.0, 20.0)]);
    for (along, across, off_max) in [(0.6, 90.0, 1.0), (1.6, 0.6, 2.0), (1.6, 90.0, 6.0)] {
        let is_in = |east: f64, north: f64| (east - 50.0).abs() < along && (north - 20.0).abs() < across;
        let pit = |east: f64, north: f64| hill(east, north) - if is_in(east, north) { 300.0 } else { 0.0 };
        let off = Laid::of(vec![river.clone()], pit).farthest(&[Role::Channel], hill);
        assert!(off < off_max, "{along} {across}: {off} m");
    }
}

#[test]
fn a_dem_that_lies_two_posts_aside_moves_no_more_than_it_must() {
    // A valley that a river winds through, and the DEM of it two posts to the north-east.
    let bed = |east: f64| 40.0 + 6.0 * (east * 0.15).sin();
    let valley = |east: f64, north: f64| 100.0 + 0.1 * east + 4.0 * (north - bed(east)).abs().min(10.0);
    let places: Vec<(f64, f64)> = (0..40).rev().map(|at| (10.0 + 2.0 * f64::from(at), 0.0)).collect();
    let places: Vec<(f64, f64)> = places.into_iter().map(|(east, _)| (east, bed(east))).collect();
    let laid = Laid::of(vec![way(1, "waterway=river", &places)], |east, north| valley(east - 2.0, north - 2.0));
    let work = laid.levelled.earthworks.classes.values().next().unwrap();
    assert!(work.off_m[3] == 0.0 && work.off_m[2] < 0.03 * work.length_m, "{work:?}");
}

#[test]
fn a_road_up_a_cliff_is_no_steeper_than_its_grade_gives_and_its_cut_is_told() {
    let road = way(1, "highway=primary", &[(10.0, 20.0), (90.0, 20.0)]);
    let laid = Laid::of(vec![road], |east, _| if east < 50.0 { 0.0 } else { 60.0 });
    for (places, heights) in laid.edges(Role::Centre) {
        let length = site().lattice.length(places[0], places[1]);
        assert!(i64::from((heights[0] - heights[1]).abs()) * 1000 <= length * 151, "{places:?} {heights:?}");
    }
    assert_eq!(laid.count(|flaw| matches!(flaw, Flaw::GradeRelaxed { .. })), 1);
    let work = laid.levelled.earthworks.classes.values().next().unwrap();
    assert!(0.0 < work.over_limit_m[0], "{work:?}");
}

#[test]
fn a_tenth_of_river_ways_that_run_upstream_are_turned() {
    let piece = |at: i32| {
        let (from, to) = (90.0 - 4.0 * f64::from(at), 86.0 - 4.0 * f64::from(at));
        let ends = if at % 10 == 4 { [(to, 20.0), (from, 20.0)] } else { [(from, 20.0), (to, 20.0)] };
        way(1 + i64::from(at), "waterway=river", &ends)
    };
    let steep = |east: f64, north: f64| hill(10.0 * east, north);
    let laid = Laid::of((0..20).map(piece).collect(), steep);
    assert_eq!(laid.count(|flaw| *flaw == Flaw::FlowsUphill), 2);
    assert!(laid.farthest(&[Role::Channel], steep) < 1.0);
}

#[test]
fn a_river_over_the_border_of_the_area_falls_on_the_ground_inside() {
    // The area ends at 400 posts, and what is known of the ground does.
    let river = way(1, "waterway=river", &[(440.0, 20.0), (360.0, 20.0)]);
    let known = |east: f64, north: f64| hill(east.min(400.0), north);
    let laid = Laid::of(vec![river], known);
    assert!(0 < laid.edges(Role::Channel).count());
    assert!(laid.levelled.earthworks.far_off.is_empty(), "{:?}", laid.levelled.earthworks.far_off);
}

#[test]
fn a_lake_stays_level_where_a_road_crosses_it_to_an_island() {
    let ring = |number, (west, east): (f64, f64), (south, north): (f64, f64)| {
        let places = [(west, south), (east, south), (east, north), (west, north), (west, south)];
        way(number, "natural=water", &places)
    };
    let lake = {
        let (outer, inner) = (ring(1, (20.0, 60.0), (20.0, 60.0)), ring(2, (35.0, 45.0), (35.0, 45.0)));
        let places = |source: &Source| match &source.shape {
            Shape::Line(places) => places.clone(),
            _ => Vec::new(),
        };
        let rings = vec![places(&outer), places(&inner)];
        Source { shape: Shape::Polygon(rings), ..outer }
    };
    let road = way(3, "highway=track", &[(10.0, 40.0), (40.0, 40.0), (40.0, 70.0)]);
    let bowl = |east: f64, north: f64| 100.0 + 0.05 * ((east - 40.0).abs() + (north - 40.0).abs());
    let laid = Laid::of(vec![lake, road], bowl);
    let levels: Vec<i32> = laid.edges(Role::Shore).flat_map(|(_, heights)| heights).collect();
    assert!(!levels.is_empty() && levels.iter().all(|level| *level == levels[0]), "{levels:?}");
}

#[test]
fn a_dam_between_two_lakes_keeps_their_levels_apart() {
    let lake = |number, level: &str, west, east| {
        let ring = [(west, 20.0), (east, 20.0), (east, 40.0), (west, 40.0), (west, 20.0)];
        way(number, &format!("natural=water ele={level}"), &ring)
    };
    let dam = way(3, "waterway=dam", &[(40.0, 18.0), (40.0, 42.0)]);
    let river = way(4, "waterway=river", &[(70.0, 30.0), (10.0, 30.0)]);
    let ground = |east: f64, _: f64| if east < 40.0 { 101.0 } else { 109.0 };
    let laid = Laid::of(vec![lake(1, "100", 20.0, 39.0), lake(2, "108", 41.0, 60.0), dam, river], ground);
    let formed = &laid.levelled.reserved.formed;
    let mut levels: Vec<i32> = formed
        .surfaces
        .iter()
        .filter(|surface| surface.role == Role::Shore)
        .map(|surface| surface.ring[0].1 / 128)
        .collect();
    levels.sort_unstable();
    levels.dedup();
    assert_eq!(levels, [100, 108]);
}

#[test]
fn pins_that_contradict_everything_are_kept_and_told() {
    let rule = Rule {
        tags: vec![("survey".into(), vec!["yes".into()])],
        kind: RuleKind::AsBuiltIn,
        class: None,
        width_m: None,
        grade_max_percent: None,
        grade_give: None,
        form: Some(crate::Form::Line),
        pins: true,
    };
    let rule = Rule { kind: RuleKind::Is(crate::Kind::Primary), ..rule };
    let mut road = way(1, "survey=yes", &[(10.0, 20.0), (50.0, 20.0), (52.0, 20.0), (90.0, 20.0)]);
    let pinned = [Some(0.0), Some(900.0), Some(-400.0), None];
    if let Shape::Line(places) = &mut road.shape {
        places.iter_mut().zip(pinned).for_each(|(place, height_m)| *place = Position { height_m, ..*place });
    }
    let laid = Laid::by_rules(vec![road], &[rule], |_, _| 100.0);
    for (east, height) in [(10.0, 0), (50.0, 900), (52.0, -400)] {
        let place = site().lattice.place_of([east, 20.0]).unwrap();
        assert_eq!(laid.heights.get(&place).copied().map(|z| z / 128), Some(height), "at {east}");
    }
    assert_eq!(laid.count(|flaw| matches!(flaw, Flaw::PinsTooSteep { .. })), 1);
    let told = &laid.levelled.earthworks.far_off[0];
    assert_eq!(told.cause, terrain::OffCause::Pin);
    assert!(laid.levelled.remarks.iter().any(|remark| remark.remedy == Remedy::GradeExceeded));
}

#[test]
fn one_road_more_changes_heights_of_what_it_hangs_together_with_only() {
    let noisy = |east: f64, north: f64| hill(east, north) + (east * 7919.0 + north * 104_729.0).rem_euclid(11.0);
    let near = way(1, "highway=primary", &[(10.0, 20.0), (60.0, 40.0), (90.0, 20.0)]);
    let loops = way(2, "highway=primary", &[(200.0, 20.0), (240.0, 20.0), (240.0, 60.0), (200.0, 60.0), (200.0, 20.0)]);
    let across = way(3, "highway=track", &[(190.0, 40.0), (260.0, 44.0)]);
    let river = way(4, "waterway=stream", &[(300.0, 20.0), (340.0, 90.0)]);
    let more = way(5, "highway=primary", &[(60.0, 40.0), (64.0, 90.0)]);
    let all = vec![near, loops, across, river];
    let (without, with) = (Laid::of(all.clone(), noisy), Laid::of([all, vec![more]].concat(), noisy));
    let far = |laid: &Laid| {
        let is_far = |(place, _): &(&Place, &i32)| 150.0 < site().lattice.posts_of(**place)[0];
        laid.heights.iter().filter(is_far).map(|(place, height)| (*place, *height)).collect::<BTreeMap<Place, i32>>()
    };
    assert!(!far(&without).is_empty());
    assert_eq!(far(&without), far(&with));
    assert_ne!(without.heights, with.heights);
}
