//! Roads and water on a map: their lines in the colours of their classes.

use database::LineRole;

use super::color::FEATURES;
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
fn thickness(role: LineRole) -> Option<f64> {
    match role {
        LineRole::Centre | LineRole::Channel => Some(1.6),
        LineRole::Side | LineRole::Bank | LineRole::Shore => Some(0.9),
        LineRole::Breakline => Some(0.7),
        LineRole::Toe => None,
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
