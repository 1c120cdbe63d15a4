//! Pictures inside the page.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use maud::{Markup, html};

use crate::picture::{Image, Map, NO_RESIDUAL, RESIDUAL_SCALE_M, Scene, SceneGround, Shown, draw_map, module_pictures};

/// Pixels along the longer side of a map.
const MAP_PIXELS: usize = 780;
/// The same of each of the two maps of limits.
const LIMITS_PIXELS: usize = 560;
/// Pixels along a picture of one load module.
const MODULE_PIXELS: usize = 260;

/// A picture as an address that holds all of it.
pub(crate) fn data_uri(image: &Image) -> String {
    let mut bytes = Vec::new();
    image.write_png(&mut bytes).expect("memory takes whatever is written to it");
    format!("data:image/png;base64,{}", STANDARD.encode(&bytes))
}

fn figure(image: &Image, caption: &str) -> Markup {
    html! {
        figure {
            img src=(data_uri(image)) width=(image.wide()) height=(image.high()) alt=(caption);
            figcaption { (caption) }
        }
    }
}

/// All maps of the page.
pub(crate) fn maps(scene: &Scene) -> Markup {
    let residuals = scene.ground.is_some().then(|| draw_map(scene, Map::Residuals(RESIDUAL_SCALE_M), MAP_PIXELS));
    html! {
        (figure(
            &draw_map(scene, Map::Relief(Shown::Tin), MAP_PIXELS),
            "The compiled surface, as a simulator loads it.",
        ))
        @match residuals {
            Some(image) => (figure(&image, "Where the triangles lie above (blue) and below (red) the ground.")),
            None => p.quiet {
                "No map of residuals: the ground was not there to be looked at. "
                code { "tiefort report --format html --against DEM" } " draws it."
            },
        }
        (figure(&draw_map(scene, Map::Density, MAP_PIXELS), "Where the triangles went."))
        (figure(
            &draw_map(scene, Map::Limits, LIMITS_PIXELS),
            "How much of each limit is used: per load module, and in every 4 km window around its middle.",
        ))
        (figure(
            &draw_map(scene, Map::Tiles, MAP_PIXELS),
            "How the work was cut, and in which order tiles build on each other.",
        ))
    }
}

/// Wireframe and residuals of one load module.
pub(crate) fn module_images(scene: &Scene, module: &terrain::LoadModule) -> Markup {
    let (row, col) = (module.id.row, module.id.col);
    let (wires, residuals) = module_pictures(scene, module, MODULE_PIXELS);
    html! {
        img src=(data_uri(&wires)) alt={ "wireframe of load module " (row) "," (col) };
        @if let Some(residuals) = residuals {
            img src=(data_uri(&residuals)) alt={ "residuals of load module " (row) "," (col) };
        }
    }
}

/// Residuals of a ground in metres, voids left out.
pub(crate) fn residuals_m<'a>(ground: &SceneGround<'a>) -> impl Iterator<Item = f64> + use<'a> {
    let known = ground.residuals.iter().filter(|&&residual| residual != NO_RESIDUAL);
    known.map(|&residual| terrain::metres_of_quanta(residual))
}
