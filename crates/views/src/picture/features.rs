//! Roads and water on a map: their lines in the colours of their classes.

use terrain::Role;
use terrain::{ModuleVertex, QUANTA_PER_METRE};

use super::color::{Color, FEATURES};
use super::facets::{Cover, Facets};
use super::image::Image;
use super::map_extent::MapExtent;
use super::scene::Scene;
use super::sheet::Key;

/// Whether triangles or lines of a scene show such a thing.
pub(crate) fn shows(scene: &Scene, facets: &Facets, cover: Cover) -> bool {
    let of_lines = |number| scene.features.is_some_and(|features| features.has_lines_of(number));
    facets.has(cover) || matches!(cover, Cover::Feature(number) if of_lines(number))
}

/// Pixels that a line of a role is thick; `None` where it is not drawn.
fn thickness(role: Role) -> Option<f64> {
    match role {
        Role::Centre | Role::Channel => Some(1.6),
        Role::Side | Role::Bank | Role::Shore => Some(0.9),
        Role::Breakline => Some(0.7),
        Role::Toe => None,
    }
}

/// Draws the lines of features over a map, so many times as thick as usual.
pub(crate) fn draw_lines(image: &mut Image, map_extent: &MapExtent, scene: &Scene, times: f64) {
    let Some(features) = scene.features else { return };
    let at = |place| pixel(map_extent, scene, place);
    for line in features.lines {
        let (Some(number), Some(thick)) = (features.color_of(line.class), thickness(line.role)) else { continue };
        let color = FEATURES[usize::from(number)].1;
        for pair in line.vertices.windows(2) {
            let [a, b] = [pair[0], pair[1]].map(|[east, north, _]| at([east, north]));
            if is_near(map_extent, a) || is_near(map_extent, b) {
                image.line(a, b, thick * times, color);
            }
        }
    }
}

/// Pixels from one dot of what is left out to the next, and those that it is long and thick.
const DOTS: [f64; 3] = [4.5, 1.2, 1.4];

/// Draws dots along the ways that load modules say are left out of the ground; whether there are any.
pub(crate) fn draw_left_out(image: &mut Image, map_extent: &MapExtent, scene: &Scene) -> bool {
    let Some(features) = scene.features else { return false };
    let quantum_m = 1.0 / f64::from(QUANTA_PER_METRE);
    let side_m = f64::from(scene.grid.side_cells) * scene.frame.spacing.metres();
    let mut any = false;
    for module in scene.modules {
        let corner = [module.id.col, module.id.row].map(|number| f64::from(number) * side_m);
        for line in module.lines.iter().filter(|line| !line.is_kept) {
            let Some(number) = features.color_of(line.class) else { continue };
            any = true;
            let at = |vertex: &ModuleVertex| {
                let place = [f64::from(vertex.x), f64::from(vertex.y)].map(|quanta| quanta * quantum_m);
                map_extent.at([corner[0] + place[0], corner[1] + place[1]]).map(|at| at - 0.5)
            };
            let places: Vec<[f64; 2]> = line.vertices.iter().map(at).collect();
            dots(image, &places, FEATURES[usize::from(number)].1);
        }
    }
    any
}

/// Dots along a line, evenly apart over its corners.
fn dots(image: &mut Image, places: &[[f64; 2]], color: Color) {
    let [apart, long, thick] = DOTS;
    let mut next = 0.0;
    for pair in places.windows(2) {
        let [east, south] = [pair[1][0] - pair[0][0], pair[1][1] - pair[0][1]];
        let length = (east * east + south * south).sqrt();
        while next < length {
            let on = |along: f64| [pair[0][0] + along / length * east, pair[0][1] + along / length * south];
            image.line(on(next), on((next + long).min(length)), thick, color);
            next += apart;
        }
        next -= length;
    }
}

/// Where a place of the area's coordinate system lies on a map; a whole number is the middle of a pixel.
pub(crate) fn pixel(map_extent: &MapExtent, scene: &Scene, [east, north]: [f64; 2]) -> [f64; 2] {
    let place = [east - scene.frame.origin_east_m, north - scene.frame.origin_north_m];
    map_extent.at(place).map(|at| at - 0.5)
}

fn is_near(map_extent: &MapExtent, [x, y]: [f64; 2]) -> bool {
    let [wide, high] = map_extent.pixels.map(|pixels| pixels as f64);
    -wide <= x && x <= 2.0 * wide && -high <= y && y <= 2.0 * high
}

/// The colours of roads and water that there are.
pub(crate) fn keys(has: impl Fn(Cover) -> bool) -> Vec<(Key, String)> {
    let all = (0..).zip(FEATURES).filter(|(number, _)| has(Cover::Feature(*number)));
    all.map(|(_, (name, color))| (Key::Filled(color), name.to_owned())).collect()
}
