//! A scene as an observer sees it: where he stands and where he looks, from what was asked for and what was not.

use terrain::{Post, metres_of_quanta};

use super::camera::Camera;
use super::facets::Facets;
use super::image::Image;
use super::panels::{Panel, Style, draw_panels};
use super::perspective::{Look, Surface};
use super::relief::Shown;
use super::scene::Scene;
use crate::table::grouped;

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

fn camera(scene: &Scene, facets: &Facets, sight: &Sight, range_m: (f64, f64)) -> Camera {
    let extent = facets.extent_m;
    let Some(eye) = sight.eye else {
        let (direction, wide) = (sight.direction_degrees.unwrap_or(0.0), sight.field_of_view_degrees);
        let over = Camera::overlooking(extent, range_m, sight.times, direction, wide.unwrap_or(FIELD_OF_VIEW.1));
        return Camera { pitch_degrees: sight.pitch_degrees.unwrap_or(over.pitch_degrees), ..over };
    };
    let [east, north] = [eye.place_m[0] - scene.frame.origin_east_m, eye.place_m[1] - scene.frame.origin_north_m];
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
