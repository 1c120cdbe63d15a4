//! A scene as an observer sees it: where he stands and where he looks, from what was asked for and what was not;
//! and what is seen from a place, on shaded ground.

use terrain::{Post, metres_of_quanta};

use crate::table::grouped;

use super::camera::Camera;
use super::color::{BREACH, Color, HEIGHTS, NOTHING, PALE, WHITE, lit, mix};
use super::facets::Facets;
use super::image::Image;
use super::panels::{Panel, Style, draw_panels};
use super::perspective::{Look, Surface};
use super::relief::Shown;
use super::scene::Scene;

/// Where an observer stands.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Eye {
    /// East and north in the area's coordinate system, in metres.
    pub place_m: [f64; 2],
    /// Metres above the ground there.
    pub above_m: f64,
}

/// An observer, as far as was said.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sight {
    /// Where he stands; without it, where he overlooks all of the scene.
    pub eye: Option<Eye>,
    /// Degrees from north over east; without it, towards the middle of the scene, or north.
    pub direction_degrees: Option<f64>,
    /// Degrees above the horizon; without it, a little below, or towards the middle of the scene.
    pub pitch_degrees: Option<f64>,
    /// Degrees from edge to edge.
    pub field_of_view_degrees: Option<f64>,
    /// Heights are drawn so many times as large as they are.
    pub times: f64,
}

/// Field of view from a place on the ground, and of a whole scene, in degrees.
const FIELD_OF_VIEW: (f64, f64) = (60.0, 40.0);
/// Pitch of who stands somewhere and was told nothing, in degrees.
const PITCH: f64 = -2.0;

/// Draws a scene as an observer sees it, each surface `wide` pixels across; the ground only where it is there.
///
/// # Panics
/// When the ground is asked for and the scene has none.
pub fn draw_sight(scene: &Scene, shown: Shown, style: Style, sight: &Sight, wide: usize) -> Image {
    let facets = Facets::of_scene(scene);
    let place_m = place_m(scene, facets.extent_m, sight);
    let facets = facets.seen_from(scene, place_m);
    let covers = scene.ground.map(|ground| facets.post_covers(ground.dem, scene.frame.spacing.metres()));
    let triangles = Surface::Triangles(&facets);
    let tin = || Panel { label: format!("TIN, {}", scene.triangles_in_words()), surface: triangles };
    let dem = || {
        let dem = scene.ground.expect("a caller that asks for the ground has it").dem;
        let spacing_m = scene.frame.spacing.metres();
        let label = format!("DEM, {} posts {spacing_m} m apart", grouped(dem.rect().post_count() as u64));
        Panel { label, surface: Surface::Posts(dem, [spacing_m; 2], covers.as_deref().unwrap_or_default()) }
    };
    let panels = match shown {
        Shown::Tin => vec![tin()],
        Shown::Dem => vec![dem()],
        Shown::Both => vec![dem(), tin()],
    };
    let range_m = panels[0].surface.range_m();
    let camera = camera(scene, &facets, sight, range_m);
    let look = Look { camera, pixels: [wide, wide * 9 / 16], times: sight.times, range_m };
    let what = if style == Style::Wireframe { "wireframe" } else { "perspective" };
    let title = format!("{}: {what}, {}", scene.name, scene.what());
    draw_panels(&title, &eye_text(scene, sight, &camera), &panels, style, &look)
}

/// Where an observer stands, or else what he overlooks, in metres from the area's south-west post.
fn place_m(scene: &Scene, [west, south, east, north]: [f64; 4], sight: &Sight) -> [f64; 2] {
    let origin = [scene.frame.origin_east_m, scene.frame.origin_north_m];
    let of_eye = |eye: Eye| [0, 1].map(|axis| eye.place_m[axis] - origin[axis]);
    sight.eye.map_or([f64::midpoint(west, east), f64::midpoint(south, north)], of_eye)
}

fn camera(scene: &Scene, facets: &Facets, sight: &Sight, range_m: (f64, f64)) -> Camera {
    let extent = facets.extent_m;
    let Some(eye) = sight.eye else {
        let (direction, wide) = (sight.direction_degrees.unwrap_or(0.0), sight.field_of_view_degrees);
        let over = Camera::overlooking(extent, range_m, sight.times, direction, wide.unwrap_or(FIELD_OF_VIEW.1));
        return Camera { pitch_degrees: sight.pitch_degrees.unwrap_or(over.pitch_degrees), ..over };
    };
    let [east, north] = place_m(scene, extent, sight);
    let inside = [east.clamp(extent[0], extent[2]), north.clamp(extent[1], extent[3])];
    let ground_m = ground_m(scene, facets, inside) * sight.times;
    let to_middle = [0.5 * (extent[0] + extent[2]) - east, 0.5 * (extent[1] + extent[3]) - north];
    let towards = libm::atan2(to_middle[0], to_middle[1]).to_degrees();
    Camera {
        eye_m: [east, north, ground_m + eye.above_m],
        direction_degrees: sight.direction_degrees.unwrap_or(towards),
        pitch_degrees: sight.pitch_degrees.unwrap_or(PITCH),
        field_of_view_degrees: sight.field_of_view_degrees.unwrap_or(FIELD_OF_VIEW.0),
    }
}

/// Height of the ground at a place: the higher of DEM and triangles, so that the observer stands above both.
fn ground_m(scene: &Scene, facets: &Facets, [east, north]: [f64; 2]) -> f64 {
    let of_dem = scene.ground.map(|ground| {
        let (spacing_m, rect) = (scene.frame.spacing.metres(), ground.dem.rect());
        let row = ((north / spacing_m).round() as i32).clamp(rect.south, rect.north);
        let col = ((east / spacing_m).round() as i32).clamp(rect.west, rect.east);
        metres_of_quanta(ground.dem.height(Post::new(row, col)))
    });
    let of_facets = facets.height_m([east, north]);
    [of_dem, of_facets].into_iter().flatten().reduce(f64::max).unwrap_or(0.0)
}

fn eye_text(scene: &Scene, sight: &Sight, camera: &Camera) -> String {
    let (east, north) = (scene.frame.origin_east_m + camera.eye_m[0], scene.frame.origin_north_m + camera.eye_m[1]);
    let above = sight
        .eye
        .map_or_else(|| format!("{:.0} m up", camera.eye_m[2]), |eye| format!("{} m above the ground", eye.above_m));
    format!("From {east:.0} {north:.0} in {}, {above}", scene.crs)
}

/// Ground in a square around an eye, row by row from the north-west.
pub struct SeenGround<'a> {
    /// Places along a side; the eye stands at the middle one.
    pub side: usize,
    /// Metres between places.
    pub spacing_m: f64,
    /// Height of each place; not a number where there is none.
    pub height_m: &'a [f32],
    /// Whether each is seen; `None` where none looked.
    pub seen: &'a [Option<bool>],
}

/// Lays what is hidden in the dark: ground that is seen has the colours of heights, what lies beyond the range is pale.
///
/// # Panics
/// When there is not one height and one answer for each place.
pub fn draw_seen(ground: &SeenGround) -> Image {
    let &SeenGround { side, spacing_m, height_m, seen } = ground;
    assert!(height_m.len() == side * side && seen.len() == side * side, "a height and an answer for each place");
    let known = height_m.iter().copied().filter(|height| !height.is_nan());
    let (low, top) = known.fold((f32::INFINITY, f32::NEG_INFINITY), |(low, top), at| (low.min(at), top.max(at)));
    let pixel = |index: usize| -> Color {
        let height = height_m[index];
        if height.is_nan() {
            return NOTHING;
        }
        let share = f64::from(height - low) / f64::from((top - low).max(1e-3));
        // Light from the north-west: what falls off that way is bright.
        let before = |step: usize, is_first: bool| if is_first { height } else { height_m[index - step] };
        let (west, north) = (before(1, index.is_multiple_of(side)), before(side, index < side));
        let falls = if west.is_nan() || north.is_nan() { 0.0 } else { 2.0 * height - west - north };
        let ground = lit(HEIGHTS.at(share), (1.0 + 0.7 * falls / spacing_m as f32).clamp(0.5, 1.3));
        match seen[index] {
            Some(true) => ground,
            Some(false) => mix(lit(ground, 0.55), [70, 62, 78], 0.45),
            None => mix(ground, PALE, 0.75),
        }
    };
    let mut image = Image::of(side, side, (0..side * side).map(pixel).collect());
    let (middle, arm) = (side as i64 / 2, (side as i64 / 80).clamp(3, 14));
    for (wide, high) in [(arm, 1), (1, arm)] {
        image.fill([middle - wide - 1, middle - high - 1, 2 * wide + 3, 2 * high + 3], WHITE);
    }
    for (wide, high) in [(arm, 1), (1, arm)] {
        image.fill([middle - wide, middle - high, 2 * wide + 1, 2 * high + 1], BREACH);
    }
    image
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_hidden_is_darker_than_what_is_seen_and_what_is_beyond_is_pale() {
        let side = 41;
        let seen: Vec<Option<bool>> =
            (0..side * side).map(|at| [Some(true), Some(false), None][at % side / 14]).collect();
        let image = draw_seen(&SeenGround { side, spacing_m: 25.0, height_m: &vec![5.0; side * side], seen: &seen });
        let light = |x: usize| image.pixel(x, 3).iter().map(|&part| u32::from(part)).sum::<u32>();
        assert!(light(20) < light(5) && light(5) < light(35));
    }
}
