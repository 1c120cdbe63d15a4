//! Roads, rails and streams that are lines in the ground, as bands on its triangles.

use terrain::{Bands, LoadModule, ModuleId, QUANTA_PER_METRE};

use super::scene::{Scene, SceneFeatures};

/// How far a band lies above the ground, in metres.
const UP_M: f64 = 0.05;
/// Metres up to which there are bands: farther away the widest are hardly wider than their lines.
const REACH_M: f64 = 6_000.0;

/// A triangle of a band in metres from the area's south-west post, and its place among the colours of features.
type Piece = ([[f64; 3]; 3], u8);

/// The bands of a scene around a place, in metres from the area's south-west post, draped over the ground of its load
/// modules; strips, which have triangles, cover them.
pub(crate) fn bands_of(scene: &Scene, features: &SceneFeatures, place_m: [f64; 2]) -> Vec<Piece> {
    let modules: Vec<&LoadModule> =
        scene.modules.iter().filter(|module| away_m(module.id, scene.side_m(), place_m) < REACH_M).collect();
    let lines = modules.iter().flat_map(|module| module.lines.iter().map(|line| (module.id, line)));
    let side = scene.grid.side_cells * scene.frame.spacing.quanta_per_post();
    let bands = Bands::of(lines, scene.part, side);
    let first = [scene.part.west, scene.part.south].map(|at| f64::from(at) * f64::from(side));
    let metre = f64::from(QUANTA_PER_METRE);
    let place = |[x, y, z]: [f64; 3]| [(x + first[0]) / metre, (y + first[1]) / metre, z / metre + UP_M];
    let mut pieces = Vec::new();
    for (class, polygons) in modules.iter().flat_map(|module| bands.over(module)) {
        let Some(number) = features.color_of(class) else { continue };
        for piece in polygons {
            pieces.extend((2..piece.len()).map(|i| ([piece[0], piece[i - 1], piece[i]].map(place), number)));
        }
    }
    pieces
}

/// How far a load module lies from a place, in metres.
fn away_m(id: ModuleId, side_m: f64, place_m: [f64; 2]) -> f64 {
    let beside = |axis: usize, number: u32| {
        let low = f64::from(number) * side_m;
        (low - place_m[axis]).max(place_m[axis] - low - side_m).max(0.0)
    };
    let (east, north) = (beside(0, id.col), beside(1, id.row));
    (east * east + north * north).sqrt()
}

#[cfg(test)]
mod tests {
    use terrain::{LineForm, LineKind, LineStorey, LineTraits, ModuleVertex};

    use super::super::color::FEATURES;
    use super::super::scene::SceneLimits;
    use super::super::sight::{Eye, Sight, draw_sight};
    use super::super::{Shown, Style};
    use super::*;
    use crate::samples;

    /// A road 10 m wide from west to east through the first load module, and on into the next.
    fn with_road() -> Vec<LoadModule> {
        let traits = LineTraits {
            kind: LineKind::Travelled,
            form: LineForm::Line,
            storey: LineStorey::Ground,
            is_kept: true,
            is_in_ground: true,
            width: 1280,
        };
        let mut modules = samples::modules();
        for module in &mut modules[..2] {
            let vertex = |x| ModuleVertex { y: 32_000, x, z: 0 };
            module.lines = vec![traits.line(1, vec![vertex(0), vertex(64_000)])];
        }
        modules
    }

    #[test]
    fn a_band_is_as_wide_as_its_way_and_lies_on_the_ground() {
        let (modules, limits) = (with_road(), SceneLimits::default());
        let names = ["plain", "primary"].map(str::to_owned);
        let features = SceneFeatures { names: &names, classes: &[1], lines: &[], remarks: &[] };
        let scene = samples::scene(&modules, &limits);
        let pieces = bands_of(&scene, &features, [250.0, 250.0]);
        let doubled = |[a, b, c]: [[f64; 3]; 3]| (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
        let area: f64 = pieces.iter().map(|(at, _)| doubled(*at) / 2.0).sum();
        // Two load modules of 500 m; half a disc at the far end, and none where both meet or the area ends.
        assert!((10_000.0..10_040.0).contains(&area), "{area} m2");
        assert!(bands_of(&scene, &features, [250.0, -REACH_M - 1.0]).is_empty());
        for [x, y, z] in pieces.iter().flat_map(|(at, _)| at) {
            assert!((244.9..255.1).contains(y), "{y}");
            assert!((z - UP_M - (500.0 + x / 10.0 - y / 20.0)).abs() < 0.02, "{x} {y} {z}");
        }
    }

    #[test]
    fn an_observer_sees_a_road_as_wide_as_it_is() {
        let names = ["plain", "motorway"].map(str::to_owned);
        let features = SceneFeatures { names: &names, classes: &[1], lines: &[], remarks: &[] };
        let limits = SceneLimits::default();
        let eye = Eye { place_m: [250.0, 200.0], above_m: 10.0 };
        let sight = Sight {
            eye: Some(eye),
            direction_degrees: Some(0.0),
            pitch_degrees: Some(-10.0),
            field_of_view_degrees: Some(60.0),
            times: 1.0,
        };
        let color = FEATURES[usize::from(features.color_of(1).unwrap())].1;
        let dark = |modules: &[LoadModule]| {
            let scene = Scene { features: Some(features), ..samples::scene(modules, &limits) };
            let image = draw_sight(&scene, Shown::Tin, Style::Shaded, &sight, 400);
            let is_road = |at: [u8; 3]| (0..3).all(|i| at[i].abs_diff(color[i]) < 12);
            (0..400).flat_map(|x| (0..300).map(move |y| (x, y))).filter(|&(x, y)| is_road(image.pixel(x, y))).count()
        };
        let (with, without) = (dark(&with_road()), dark(&samples::modules()));
        assert!(without + 3_000 < with, "{without} dark pixels become {with}");
    }
}
