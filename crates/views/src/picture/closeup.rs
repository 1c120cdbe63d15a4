//! One load module, without anything around it: for lists of many.

use terrain::{LoadModule, ModuleRect};

use super::facets::Facets;
use super::image::Image;
use super::map_extent::MapExtent;
use super::residual_map::residual_map;
use super::scene::{Scene, SceneGround};
use super::wireframe::facets_wireframe;
use super::{RESIDUAL_SCALE_M, map_extent::Posts};

/// The wireframe of a load module and its residuals, where the scene has its ground.
pub(crate) fn module_pictures(scene: &Scene, module: &LoadModule, pixels: usize) -> (Image, Option<Image>) {
    let (row, col) = (module.id.row, module.id.col);
    let extent_m = scene.extent_m(ModuleRect { south: row, west: col, north: row + 1, east: col + 1 });
    let map_extent = MapExtent::of(extent_m, pixels);
    let wires = facets_wireframe(
        &Facets::of_modules([module], scene.grid, scene.frame.spacing).with_covers_of(scene, [module]),
        &map_extent,
    );
    let residuals = scene.ground.map(|ground| {
        let (rect, whole) = (scene.grid.posts_of(module.id), ground.dem.rect());
        let dem = ground.dem.window(rect);
        let line = |row: i32| {
            let start = (row - whole.south) as usize * whole.posts_wide() + (rect.west - whole.west) as usize;
            &ground.residuals[start..start + rect.posts_wide()]
        };
        let residuals: Vec<i32> = (rect.south..=rect.north).flat_map(line).copied().collect();
        let posts = Posts { rect, spacing_m: [scene.frame.spacing.metres(); 2] };
        residual_map(&SceneGround { dem: &dem, residuals: &residuals }, &posts, &map_extent, RESIDUAL_SCALE_M)
    });
    (wires, residuals)
}
