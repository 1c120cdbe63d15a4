//! Edges of triangles seen from above, over a faint relief.

use super::color::{INK, WHITE, mix};
use super::facets::Facets;
use super::image::Image;
use super::plan::Plan;
use super::relief::{Tints, facets_relief};
use super::scene::Scene;
use super::sheet::{Key, Legend, Sheet};
use crate::table::grouped;

/// The edges of triangles, as strong as there is room for them.
pub(crate) fn facets_wireframe(facets: &Facets, plan: &Plan) -> Image {
    let relief = facets_relief(facets, plan, &Tints::new(facets.range_m()));
    let (wide, high) = (plan.pixels[0], plan.pixels[1]);
    let faint = (0..wide * high).map(|place| mix(relief.pixel(place % wide, place / wide), WHITE, 0.55)).collect();
    let mut image = Image::of(wide, high, faint);
    let thick = edge_thickness(facets, plan);
    let side_pixels = facets.side_m.map_or(0.0, |side_m| side_m / plan.metres_per_pixel());
    // A whole number is the middle of a pixel to a line, and its border to a plan.
    let place = |[x, y, _]: [f64; 3]| plan.at([x, y]).map(|at| at - 0.5);
    facets.each_edge(|ends, is_line| {
        let is_strong = is_line && 12.0 <= side_pixels;
        image.line(place(ends[0]), place(ends[1]), if is_strong { thick + 0.8 } else { thick }, INK);
    });
    image
}

/// Thinner where triangles are few pixels wide, so that many of them are grey and not black.
fn edge_thickness(facets: &Facets, plan: &Plan) -> f64 {
    let pixels = (plan.pixels[0] * plan.pixels[1]) as f64;
    let side = (2.0 * pixels / facets.count().max(1) as f64).sqrt();
    (side / 14.0).clamp(0.22, 1.1)
}

/// The wireframe of a scene.
pub(crate) fn wireframe(scene: &Scene, longest: usize) -> Image {
    let facets = Facets::of_modules(scene.modules, scene.grid, scene.frame.spacing);
    let plan = scene.plan(longest);
    let map = facets_wireframe(&facets, &plan);
    let coordinates = scene.coordinates();
    let sheet = Sheet {
        title: format!("{}: wireframe", scene.name),
        subtitle: format!("{}, {} triangles", scene.what(), grouped(facets.count() as u64)),
        coordinates: &coordinates,
        legends: vec![Legend::Keys { title: String::new(), keys: vec![(Key::Line(INK), "edge of a triangle".into())] }],
        notes: "Stronger lines are the sides of load modules, where there is room to tell them apart.".into(),
    };
    sheet.around(&map, &plan)
}
