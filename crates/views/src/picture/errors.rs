//! What `inadequate` draws: residuals that importance weighs, at every post, and how full load modules are.

use super::color::{ERRORS, NOTHING};
use super::image::Image;
use super::module_maps::module_limits;
use super::scene::Scene;
use super::sheet::{Drawing, Legend, Sheet, round_marks};

/// Draws the weighted residual of every post of a scene in metres, given row by row from the south-west, on a scale
/// that ends at twice what is still good enough. Where a pixel holds several posts it shows the largest.
pub fn draw_errors(scene: &Scene, residual_m: &[f32], tolerance_m: f64, longest: usize) -> Image {
    let (map_extent, rect, spacing_m) = (scene.map_extent(longest), scene.grid.area(), scene.frame.spacing.metres());
    let mut largest = vec![f32::NEG_INFINITY; map_extent.pixels[0] * map_extent.pixels[1]];
    // The pixels of a post: those that the square around it reaches, and one at least.
    let pixels = |at: i32, axis: usize| {
        let [near, far] = [-0.5, 0.5].map(|half| (f64::from(at) + half) * spacing_m);
        let [a, b] = [map_extent.at([near; 2])[axis], map_extent.at([far; 2])[axis]];
        let (first, last) = (a.min(b).round().max(0.0) as usize, a.max(b).round().max(0.0) as usize);
        let first = first.min(map_extent.pixels[axis] - 1);
        first..last.clamp(first + 1, map_extent.pixels[axis].max(first + 1))
    };
    for (row, line) in (rect.south..=rect.north).zip(residual_m.chunks(rect.posts_wide())) {
        for (col, &metres) in (rect.west..=rect.east).zip(line) {
            for y in pixels(row, 1) {
                for x in pixels(col, 0) {
                    let pixel = &mut largest[y * map_extent.pixels[0] + x];
                    *pixel = pixel.max(metres);
                }
            }
        }
    }
    let end_m = 2.0 * tolerance_m.max(1e-3);
    let color = |&metres: &f32| if metres.is_finite() { ERRORS.at(f64::from(metres) / end_m) } else { NOTHING };
    let map = Image::of(map_extent.pixels[0], map_extent.pixels[1], largest.iter().map(color).collect());
    let worst_m = residual_m.iter().copied().fold(0.0, f32::max);
    let marks = round_marks(0.0, end_m).into_iter().map(|(share, metres)| (share, format!("{metres} m")));
    let sheet = Sheet {
        title: format!("{}: where the triangles are not good enough", scene.name),
        subtitle: format!("{}, up to {tolerance_m:.2} m is good enough, largest {worst_m:.2} m", scene.what()),
        coordinates: scene.coordinates(),
        legends: vec![Legend::Ramp { title: "Weighted residual".into(), ramp: ERRORS, marks: marks.collect() }],
        notes: "A residual counts as it is where the ground matters most, and in proportion elsewhere. Every pixel \
                shows the largest of its posts; the scale ends at twice what is good enough."
            .into(),
    };
    Drawing { sheet, map, map_extent }.image()
}

/// Draws how much of its limit every load module uses.
pub fn draw_module_limits(scene: &Scene, longest: usize) -> Image {
    module_limits(scene, longest).image()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::picture::SceneLimits;
    use crate::samples;

    #[test]
    fn one_bad_post_shows_at_its_place_however_small_it_is() {
        let limits = SceneLimits::default();
        let scene = samples::scene(&[], &limits);
        let rect = samples::GRID.area();
        let mut residual_m = vec![0.0; rect.post_count()];
        // 300 m east and 100 m north, of 1500 x 1000 m.
        residual_m[4 * rect.posts_wide() + 12] = 9.0;
        for longest in [30, 600] {
            let image = draw_errors(&scene, &residual_m, 2.0, longest);
            let scale = longest as f64 / 1500.0;
            let at = |east: f64, north: f64| {
                let (left, top) = (92.0, 16.0 + 24.0 + 16.0);
                (left + east * scale, top + (1000.0 - north) * scale)
            };
            let found = (0..image.wide() * image.high())
                .map(|at| (at % image.wide(), at / image.wide()))
                .filter(|&(x, y)| x < 92 + longest && image.pixel(x, y) == ERRORS.at(1.0))
                .collect::<Vec<_>>();
            assert!(!found.is_empty(), "{longest}");
            let (x, _) = at(300.0, 100.0);
            assert!(found.iter().all(|&(found, _)| (found as f64 - x).abs() <= 1.0 + 13.0 * scale), "{found:?}");
        }
    }
}
