//! Edges of triangles seen from above, over a faint relief; one load module alone, for lists of many.

use terrain::{LoadModule, ModuleRect};

use super::RESIDUAL_SCALE_M;
use super::color::{INK, WHITE, mix};
use super::facets::Facets;
use super::image::Image;
use super::map_extent::{MapExtent, Posts};
use super::module_maps::density;
use super::relief::{Tints, facets_relief};
use super::residual_map::residual_map;
use super::scene::{Scene, SceneGround};
use super::sheet::{Drawing, Key, Legend, Sheet};

/// The edges of triangles, as strong as there is room for them.
pub(crate) fn facets_wireframe(facets: &Facets, map_extent: &MapExtent) -> Image {
    let relief = facets_relief(facets, map_extent, &Tints::new(facets.range_m()));
    let (wide, high) = (map_extent.pixels[0], map_extent.pixels[1]);
    let faint = (0..wide * high).map(|place| mix(relief.pixel(place % wide, place / wide), WHITE, 0.55)).collect();
    let mut image = Image::of(wide, high, faint);
    let thick = edge_thickness(facets, map_extent);
    let side_pixels = facets.side_m.map_or(0.0, |side_m| side_m / map_extent.metres_per_pixel());
    // A whole number is the middle of a pixel to a line, and its border to a map.
    let place = |[x, y, _]: [f64; 3]| map_extent.at([x, y]).map(|at| at - 0.5);
    facets.each_edge(|ends, is_line| {
        let is_strong = is_line && 12.0 <= side_pixels;
        image.line(place(ends[0]), place(ends[1]), if is_strong { thick + 0.8 } else { thick }, INK);
    });
    image
}

/// Thinner where triangles are few pixels wide, so that many of them are grey and not black.
fn edge_thickness(facets: &Facets, map_extent: &MapExtent) -> f64 {
    let pixels = (map_extent.pixels[0] * map_extent.pixels[1]) as f64;
    let side = (2.0 * pixels / facets.count().max(1) as f64).sqrt();
    (side / 14.0).clamp(0.22, 1.1)
}

/// Square pixels to a triangle below which edges would run into one grey.
const PIXELS_MIN: f64 = 4.0;

/// The wireframe of a scene; where triangles are as small as pixels, how many there are in every load module.
pub(crate) fn wireframe(scene: &Scene, longest: usize) -> Drawing {
    let facets = Facets::of_scene(scene);
    let map_extent = scene.map_extent(longest);
    if ((map_extent.pixels[0] * map_extent.pixels[1]) as f64) < PIXELS_MIN * facets.count() as f64 {
        let mut drawing = density(scene, longest);
        drawing.sheet.notes = "Instead of a wireframe: its triangles would be smaller than pixels. A part of the area \
                               (--modules) or a larger picture (--size) shows them."
            .into();
        return drawing;
    }
    let map = facets_wireframe(&facets, &map_extent);
    let sheet = Sheet {
        title: format!("{}: wireframe", scene.name),
        subtitle: format!("{}, {}", scene.what(), scene.triangles_in_words()),
        coordinates: scene.coordinates(),
        legends: vec![Legend::Keys { title: String::new(), keys: vec![(Key::Line(INK), "edge of a triangle".into())] }],
        notes: "Stronger lines are the sides of load modules, where there is room to tell them apart.".into(),
    };
    Drawing { sheet, map, map_extent }
}

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

#[cfg(test)]
mod tests {
    use super::super::relief::{Shown, relief};
    use super::super::scene::SceneLimits;
    use super::*;
    use crate::samples;
    use terrain::{Decks, LoadModule, ModuleVertex};

    #[test]
    fn a_caption_counts_the_triangles_of_bridges_as_the_report_does() {
        let mut modules = samples::modules();
        let limits = SceneLimits { count: "triangles".into(), ..SceneLimits::default() };
        let captions = |modules: &[LoadModule]| {
            let scene = samples::scene(modules, &limits);
            [wireframe(&scene, 300), relief(&scene, Shown::Tin, 300).remove(0)].map(|drawing| drawing.sheet.subtitle)
        };
        assert!(captions(&modules).iter().all(|text| text.ends_with(", 24 triangles")), "{:?}", captions(&modules));
        let corner = |x, y| ModuleVertex { x, y, z: 90_000 };
        modules[0].decks = Decks::of_triangles([([corner(0, 0), corner(640, 0), corner(640, 640)], 0)]);
        assert!(captions(&modules).iter().all(|text| text.ends_with(", 25 triangles")), "{:?}", captions(&modules));
    }

    #[test]
    fn triangles_smaller_than_pixels_are_counted_and_not_drawn() {
        let modules = samples::modules();
        let limits = SceneLimits { count: "triangles".into(), ..SceneLimits::default() };
        let scene = samples::scene(&modules, &limits);
        assert!(wireframe(&scene, 300).sheet.title.ends_with("wireframe"));
        let drawing = wireframe(&scene, 9);
        assert!(drawing.sheet.title.ends_with("triangles per load module"), "{}", drawing.sheet.title);
        assert!(drawing.sheet.notes.contains("--modules"));
    }
}
