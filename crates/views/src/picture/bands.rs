//! Roads, rails and streams that are lines in the ground, as bands on its triangles.

use std::collections::{BTreeMap, BTreeSet};

use terrain::plans::{Ring, difference, triangles};
use terrain::{Band, Draped, Flat, HOLE_CLASS, LineKind, LoadModule, ModuleId, QUANTA_PER_METRE, band_rings};

use super::scene::{Scene, SceneFeatures};

/// How far a band lies above the ground, in metres.
const UP_M: f64 = 0.05;
/// Metres up to which there are bands: farther away the widest are hardly wider than their lines.
const REACH_M: f64 = 6_000.0;

/// A triangle of a band in metres from the area's south-west post, and its place among the colours of features.
type Piece = ([[f64; 3]; 3], u8);
/// Rings by kind and class: what comes first covers the others.
type Rings = BTreeMap<(LineKind, u8), Vec<Ring>>;

/// The bands of a scene around a place, in metres from the area's south-west post, draped over the ground of its load
/// modules; strips, which have triangles, cover them.
pub(crate) fn bands_of(scene: &Scene, features: &SceneFeatures, place_m: [f64; 2]) -> Vec<Piece> {
    let frame = Frame::of(scene);
    let modules: Vec<&LoadModule> =
        scene.modules.iter().filter(|module| away_m(module.id, scene.side_m(), place_m) < REACH_M).collect();
    let lines =
        || modules.iter().flat_map(|module| module.lines.iter().map(move |line| (line, frame.corner(module.id))));
    let bands: Vec<Band> = lines().filter_map(|(line, corner)| Band::of(line, corner)).collect();
    let taken: BTreeSet<u8> = lines().map(|(line, _)| line.class).chain([HOLE_CLASS]).collect();
    let mut by_module: BTreeMap<ModuleId, Rings> = BTreeMap::new();
    for (band, rings) in bands.iter().zip(band_rings(&bands)) {
        for ring in rings {
            for id in frame.under(&ring) {
                by_module.entry(id).or_default().entry(band.order).or_default().push(ring.clone());
            }
        }
    }
    let of_module = |module: &&LoadModule| {
        let rings = by_module.get(&module.id)?;
        Some(frame.pieces(module, rings, &taken, features))
    };
    modules.iter().filter_map(of_module).flatten().collect()
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

/// Where load modules lie: places are quanta from the south-west corner of the part that is looked at.
#[derive(Clone, Copy)]
struct Frame {
    side: i32,
    south_west: ModuleId,
    rows: i32,
    cols: i32,
}

impl Frame {
    fn of(scene: &Scene) -> Self {
        let part = scene.part;
        Self {
            side: scene.grid.side_cells * scene.frame.spacing.quanta_per_post(),
            south_west: ModuleId { row: part.south, col: part.west },
            rows: (part.north - part.south) as i32,
            cols: (part.east - part.west) as i32,
        }
    }

    fn corner(&self, id: ModuleId) -> [i32; 2] {
        [(id.col - self.south_west.col) as i32 * self.side, (id.row - self.south_west.row) as i32 * self.side]
    }

    /// The load modules that a ring may reach.
    fn under(&self, ring: &Ring) -> Vec<ModuleId> {
        let span = |axis: usize, count: i32| {
            let of = || ring.iter().map(|at| at[axis].div_euclid(self.side));
            of().min().unwrap_or(0).max(0)..=of().max().unwrap_or(0).min(count - 1)
        };
        let (rows, cols) = (span(1, self.rows), span(0, self.cols));
        let id = |row: i32, col: i32| ModuleId {
            row: self.south_west.row + row as u32,
            col: self.south_west.col + col as u32,
        };
        rows.flat_map(|row| cols.clone().map(move |col| id(row, col))).collect()
    }

    /// The triangles of the bands over a load module.
    fn pieces(&self, module: &LoadModule, rings: &Rings, taken: &BTreeSet<u8>, features: &SceneFeatures) -> Vec<Piece> {
        let ground = Draped::of(module, self.corner(module.id)).without(module, taken);
        let first = [self.south_west.col, self.south_west.row].map(|at| f64::from(at) * f64::from(self.side));
        let metre = f64::from(QUANTA_PER_METRE);
        let place = |[x, y, z]: [f64; 3]| [(x + first[0]) / metre, (y + first[1]) / metre, z / metre + UP_M];
        let mut before: Vec<Ring> = Vec::new();
        let mut pieces = Vec::new();
        for ((_, class), rings) in rings {
            let number = features.color_of(*class);
            for plan in difference(std::slice::from_ref(rings), std::slice::from_ref(&before)) {
                let (places, triangles) = triangles(&plan);
                for corners in triangles {
                    let corners: [Flat; 3] = corners.map(|at| places[at as usize].map(f64::from));
                    for piece in ground.under(&corners) {
                        let fan = (2..piece.len()).map(|i| [piece[0], piece[i - 1], piece[i]].map(place));
                        pieces.extend(number.into_iter().flat_map(|number| fan.clone().map(move |at| (at, number))));
                    }
                }
            }
            before.extend(rings.iter().cloned());
        }
        pieces
    }
}

#[cfg(test)]
mod tests {
    use terrain::{LineForm, LineStorey, LineTraits, ModuleLine, ModuleVertex};

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
            module.lines = vec![ModuleLine { class: 1, traits, vertices: vec![vertex(0), vertex(64_000)] }];
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
