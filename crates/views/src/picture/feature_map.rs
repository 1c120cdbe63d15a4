//! Where roads and water run, what stands beside them, and marks where one was mended, degraded or left out.

use super::color::{BOUND, BREACH, Color, GREY, WHITE, mix};
use super::facets::Facets;
use super::features::{draw_left_out, draw_lines, keys, pixel, shows};
use super::image::Image;
use super::objects::{draw_plans, kinds, object_keys};
use super::relief::{Tints, facets_relief};
use super::scene::Scene;
use super::sheet::{Drawing, Key, Legend, Sheet};
use crate::map_files::outcome;
use crate::table::grouped;

/// What became of a feature, and its colour; the most important last, over the others.
const OUTCOMES: [(&str, Color); 3] = [("mended", GREY), ("degraded", BOUND), ("left out", BREACH)];

/// Half a mark's side in pixels: the more there are, the smaller, so that they do not become one.
fn half_side(remarks: usize) -> i64 {
    match remarks {
        0..=300 => 3,
        301..=3_000 => 2,
        _ => 1,
    }
}

/// Roads and water over a faint relief, with a mark at each remark.
pub(crate) fn feature_map(scene: &Scene, longest: usize) -> Drawing {
    let facets = Facets::of_scene(scene);
    let map_extent = scene.map_extent(longest);
    let relief = facets_relief(&facets, &map_extent, &Tints::new(facets.range_m()));
    let (wide, high) = (map_extent.pixels[0], map_extent.pixels[1]);
    let faint = (0..wide * high).map(|place| mix(relief.pixel(place % wide, place / wide), WHITE, 0.6)).collect();
    let mut map = Image::of(wide, high, faint);
    draw_plans(&mut map, &map_extent, scene);
    let remarks = scene.features.map_or(&[][..], |features| features.remarks);
    let (half, mut counts) = (half_side(remarks.len()), [0_u64; 3]);
    for (number, (word, color)) in OUTCOMES.into_iter().enumerate() {
        for remark in remarks.iter().filter(|remark| outcome(remark) == word) {
            counts[number] += 1;
            let Some(place) = remark.at_m else { continue };
            let [x, y] = pixel(&map_extent, scene, place).map(|at| at.round() as i64);
            map.fill([x - half, y - half, 2 * half + 1, 2 * half + 1], color);
        }
    }
    // What is there stays visible over what is not.
    let has_left_out = draw_left_out(&mut map, &map_extent, scene);
    draw_lines(&mut map, &map_extent, scene, 1.4);
    let marks = OUTCOMES.iter().zip(counts).rev();
    let marks = marks.map(|((word, color), count)| (Key::Filled(*color), format!("{word}: {}", grouped(count))));
    let on_map = [keys(|cover| shows(scene, &facets, cover)), object_keys(&kinds(scene.modules.iter()))].concat();
    let legends = vec![
        Legend::Keys { title: "What is there".into(), keys: on_map },
        Legend::Keys { title: "What became of them".into(), keys: marks.collect() },
    ];
    let dotted = if has_left_out { " Dotted lines are left out of the ground." } else { "" };
    let sheet = Sheet {
        title: format!("{}: roads and water", scene.name),
        subtitle: format!("{}, {} remarks", scene.what(), grouped(remarks.len() as u64)),
        coordinates: scene.coordinates(),
        legends,
        notes: format!("Marks stand where something was wrong; features.geojson says what, and what was done.{dotted}"),
    };
    Drawing { sheet, map, map_extent }
}

#[cfg(test)]
mod tests {
    use super::super::color::{FEATURES, feature_number};
    use super::super::facets::Cover;
    use super::super::scene::{SceneFeatures, SceneLimits};
    use super::*;
    use crate::samples;
    use store::{FeatureLine, FeatureRemark};
    use terrain::Role;
    use terrain::{LineForm, LineKind, LineStorey, LineTraits, ModuleVertex};

    fn line(role: Role, vertices: Vec<[f64; 3]>) -> FeatureLine {
        FeatureLine {
            feature: "way 1".into(),
            class: 1,
            role,
            width_m: 7.0,
            grade_max_ppm: 100_000,
            grade_most_ppm: 150_000,
            moved_m3: [0.0; 2],
            vertices,
        }
    }

    #[test]
    fn a_road_is_drawn_in_the_colour_of_its_class_and_what_was_left_out_is_marked() {
        let names = ["plain", "primary"].map(str::to_owned);
        // The scene is 1500 x 1000 m.
        let lines = [line(Role::Centre, vec![[0.0, 250.0, 0.0], [1500.0, 250.0, 0.0]])];
        let remark = |at_m, leaves_out| FeatureRemark {
            feature: "way 2".into(),
            at_m,
            found: "a spike".into(),
            done: "left out".into(),
            leaves_out,
            degrades: false,
        };
        let remarks = [remark(Some([750.0, 750.0]), true), remark(None, false)];
        let (modules, limits) = (samples::modules(), SceneLimits::default());
        let features = SceneFeatures { names: &names, classes: &[1], lines: &lines, remarks: &remarks };
        let scene = Scene { features: Some(features), ..samples::scene(&modules, &limits) };
        let drawing = feature_map(&scene, 300);
        assert_eq!(drawing.map.pixel(150, 50), BREACH);
        let primary = FEATURES[usize::from(feature_number("primary"))].1;
        assert_eq!(drawing.map.pixel(100, 149), primary);
        assert_ne!(drawing.map.pixel(100, 100), primary);
        let Legend::Keys { keys, .. } = &drawing.sheet.legends[0] else { panic!("keys") };
        assert_eq!(keys.len(), 1);
        assert_eq!(keys[0].1, "primary");
        // Without features there is nothing to draw.
        let bare = feature_map(&samples::scene(&modules, &limits), 300);
        assert_ne!(bare.map.pixel(150, 50), BREACH);
    }

    #[test]
    fn a_road_that_is_left_out_is_dotted() {
        let names = ["plain", "primary"].map(str::to_owned);
        let mut modules = samples::modules();
        let traits = LineTraits {
            kind: LineKind::Travelled,
            form: LineForm::Nothing,
            storey: LineStorey::Ground,
            is_kept: false,
            is_in_ground: false,
            width: 896,
        };
        // On the middle of a row of pixels.
        let vertex = |x| ModuleVertex { y: 31_680, x, z: 0 };
        modules[0].lines = vec![traits.line(1, vec![vertex(0), vertex(64_000)])];
        let limits = SceneLimits::default();
        let features = SceneFeatures { names: &names, classes: &[1], lines: &[], remarks: &[] };
        let scene = Scene { features: Some(features), ..samples::scene(&modules, &limits) };
        let drawing = feature_map(&scene, 300);
        let primary = FEATURES[usize::from(feature_number("primary"))].1;
        // The scene is 1500 x 1000 m: 100 pixels a load module.
        let dots = (0..100).filter(|x| drawing.map.pixel(*x, 150) == primary).count();
        assert!((15..60).contains(&dots), "{dots} pixels of a line of 100");
        assert!(drawing.sheet.notes.contains("Dotted"));
    }

    #[test]
    fn triangles_of_a_class_of_features_are_painted_and_those_of_the_ground_are_not() {
        let names = ["plain", "lake", "rock"].map(str::to_owned);
        let mut modules = samples::modules();
        modules[0].classes = vec![1, 0, 2, 0];
        let limits = SceneLimits::default();
        let features = SceneFeatures { names: &names, classes: &[1], lines: &[], remarks: &[] };
        let scene = Scene { features: Some(features), ..samples::scene(&modules, &limits) };
        let facets = Facets::of_scene(&scene);
        assert_eq!(facets.cover(0), Cover::Feature(feature_number("lake")));
        assert_eq!((facets.cover(1), facets.cover(2)), (Cover::Ground, Cover::Ground));
    }
}
