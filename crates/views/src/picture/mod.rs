//! Pictures of terrain, drawn here: shaded, from above and in perspective, and maps of what was built.
//!
//! ```text
//!   Scene ─► map_extent ─► relief, residual_map, wireframe, module_maps ─┐
//!   Surface, Camera ─► depth (nearer covers) ─► perspective ─► panels    ├─► sheet ─► Image ─► PNG
//!                                          titles, scales, legends ◄─────┘
//! ```
//! Pictures are pure: the same ground gives the same bytes, on any machine. What is absent: threads, files, clocks.

mod bands;
mod camera;
mod color;
mod depth;
mod errors;
mod facets;
mod feature_map;
mod features;
mod image;
mod light;
mod map_extent;
mod module_maps;
mod objects;
mod panels;
mod perspective;
mod relief;
mod residual_map;
mod scene;
mod sheet;
mod sight;
mod text;
mod wireframe;

pub use camera::Camera;
pub use color::{Color, palette};
pub(crate) use color::{GREY, NOTHING, hex};
pub use errors::{draw_errors, draw_module_limits};
pub use facets::{Cover, Facets};
pub use image::Image;
pub use panels::{Panel, Style, draw_panels};
pub use perspective::{Drawn, Look, Surface};
pub use relief::Shown;
pub use residual_map::RESIDUAL_SCALE_M;
pub use scene::{NO_RESIDUAL, Scene, SceneFeatures, SceneGround, SceneLimits, SceneTile};
pub(crate) use sheet::{Drawing, Key, Legend, length_text, round_length};
pub use sight::{Eye, Sight, draw_sight};
pub use sight::{SeenGround, draw_seen};
pub(crate) use wireframe::module_pictures;

/// A map of a scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Map {
    /// Shaded relief with tints for heights.
    Relief(Shown),
    /// Edges of the triangles.
    Wireframe,
    /// Residuals on a scale that ends at so many metres either way.
    Residuals(f64),
    /// Triangles per load module.
    Density,
    /// Use of both limits.
    Limits,
    /// Tiles, their order and state.
    Tiles,
    /// Roads and water, and what became of them.
    Features,
}

/// Draws a map whose longer side is `longest` pixels, with all that stands around it.
///
/// # Panics
/// When the map needs ground that the scene has not.
pub fn draw_map(scene: &Scene, map: Map, longest: usize) -> Image {
    let images: Vec<Image> = drawings(scene, map, longest).iter().map(Drawing::image).collect();
    Image::beside(&images, 8)
}

/// The same with what stands around it apart, for a page that writes it in letters of its own.
pub(crate) fn drawings(scene: &Scene, map: Map, longest: usize) -> Vec<Drawing> {
    match map {
        Map::Relief(shown) => relief::relief(scene, shown, longest),
        Map::Wireframe => vec![wireframe::wireframe(scene, longest)],
        Map::Residuals(scale_m) => vec![residual_map::residuals(scene, scale_m, longest)],
        Map::Density => vec![module_maps::density(scene, longest)],
        Map::Limits => module_maps::limits(scene, longest).into(),
        Map::Tiles => vec![module_maps::tiles(scene, longest)],
        Map::Features => vec![feature_map::feature_map(scene, longest)],
    }
}
