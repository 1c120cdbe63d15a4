//! How far the triangles lie from the ground, on a fixed scale, so that two pictures can be compared.

use terrain::{ModuleResidual, QUANTA_PER_METRE};

use super::color::{ERRORS, NOTHING, RESIDUALS, lit};
use super::image::Image;
use super::map_extent::{MapExtent, Posts, SAMPLES};
use super::module_maps::{fill, one};
use super::relief::lights;
use super::scene::{NO_RESIDUAL, Scene, SceneGround};
use super::sheet::{Drawing, Key, Legend, Sheet, round_marks};

/// Metres at the ends of the scale, unless something else is asked for.
pub const RESIDUAL_SCALE_M: f64 = 5.0;

/// The mean residual under every pixel, over a faint relief.
pub(crate) fn residual_map(ground: &SceneGround, posts: &Posts, map_extent: &MapExtent, scale_m: f64) -> Image {
    let wide = ground.dem.rect().posts_wide();
    let lights = lights(ground.dem, posts.spacing_m, 1.0);
    let mut sums = vec![(0.0_f32, 0.0_f32, 0_u32); map_extent.pixels[0] * map_extent.pixels[1]];
    posts.sample(map_extent, |between| {
        let around = [between.post, between.post + 1, between.post + wide, between.post + wide + 1];
        if around.iter().any(|&post| ground.residuals[post] == NO_RESIDUAL) {
            return;
        }
        let [row, col] = between.sample;
        let sum = &mut sums[row / SAMPLES * map_extent.pixels[0] + col / SAMPLES];
        sum.0 += between.blend(wide, |post| ground.residuals[post] as f32);
        sum.1 += between.blend(wide, |post| lights[post]);
        sum.2 += 1;
    });
    let table = RESIDUALS.table(511);
    let per_metre = 1.0 / (f64::from(QUANTA_PER_METRE) * scale_m);
    let color = |&(residual, light, count): &(f32, f32, u32)| {
        if count == 0 {
            return NOTHING;
        }
        let mean = f64::from(residual) / f64::from(count) * per_metre;
        let color = table[((mean.clamp(-1.0, 1.0) + 1.0) * 255.0 + 0.5) as usize];
        // A hint of the ground, so that one finds one's way.
        lit(color, 1.0 + (light / count as f32 - 1.0).clamp(-0.6, 0.0) * 0.35)
    };
    Image::of(map_extent.pixels[0], map_extent.pixels[1], sums.iter().map(color).collect())
}

pub(crate) fn residual_legend(scale_m: f64) -> Legend {
    let marks = [-1.0, -0.5, 0.0, 0.5, 1.0].map(|share: f64| {
        let metres = share * scale_m;
        let text = match share {
            -1.0 => format!("{metres} m and less"),
            1.0 => format!("+{metres} m and more"),
            0.0 => "0 m".into(),
            _ if share < 0.0 => format!("{metres} m"),
            _ => format!("+{metres} m"),
        };
        (share / 2.0 + 0.5, text)
    });
    Legend::Ramp { title: "Residual: DEM less TIN".into(), ramp: RESIDUALS, marks: marks.into() }
}

/// The residual map of a scene: of every post where posts are as large as pixels, and the RMS of every load module
/// where they are smaller, because the mean of what lies above and what lies below is nothing.
///
/// # Panics
/// When the posts are to be shown and the scene has no ground.
pub(crate) fn residuals(scene: &Scene, scale_m: f64, longest: usize) -> Drawing {
    let map_extent = scene.map_extent(longest);
    if scene.frame.spacing.metres() < map_extent.metres_per_pixel() {
        return rms_by_module(scene, scale_m, map_extent);
    }
    let ground = scene.ground.expect("residuals of posts are drawn of a scene with its ground");
    let map = residual_map(&ground, &scene.posts(&ground), &map_extent, scale_m);
    let sheet = Sheet {
        title: format!("{}: residuals", scene.name),
        subtitle: format!("{}, {}", scene.what(), figures(&of_scene(scene))),
        coordinates: scene.coordinates(),
        legends: vec![
            residual_legend(scale_m),
            Legend::Keys { title: String::new(), keys: vec![(Key::Filled(NOTHING), "no height".into())] },
        ],
        notes: format!(
            "Orange: the ground lies above the triangles; purple: below. Every pixel is the mean of the \
             {0:.1} x {0:.1} m under it; the scale is the same in every picture unless it is asked for.",
            map_extent.metres_per_pixel()
        ),
    };
    Drawing { sheet, map, map_extent }
}

/// RMS residual of every load module.
fn rms_by_module(scene: &Scene, scale_m: f64, map_extent: MapExtent) -> Drawing {
    let all = of_scene(scene);
    let mut map = Image::new(map_extent.pixels[0], map_extent.pixels[1], NOTHING);
    for (module, residual) in scene.part.iter().zip(&all) {
        if let Some(rms_m) = residual.rms_m() {
            fill(&mut map, scene, &map_extent, one(module), ERRORS.at(rms_m / scale_m));
        }
    }
    let mut marks: Vec<(f64, String)> =
        round_marks(0.0, scale_m).into_iter().map(|(share, metres)| (share, format!("{metres} m"))).collect();
    match marks.last_mut() {
        Some((share, text)) if 0.999 < *share => *text += " and more",
        _ => marks.push((1.0, format!("{scale_m} m and more"))),
    }
    let sheet = Sheet {
        title: format!("{}: residuals by load module", scene.name),
        subtitle: format!("{}, {}", scene.what(), figures(&all)),
        coordinates: scene.coordinates(),
        legends: vec![
            Legend::Ramp { title: "RMS residual in a load module".into(), ramp: ERRORS, marks },
            Legend::Keys { title: String::new(), keys: vec![(Key::Filled(NOTHING), "no height".into())] },
        ],
        notes: format!(
            "Posts, {} m apart, are smaller than pixels here; a part of the area (--modules) shows each of them. The \
             scale is the same in every picture unless it is asked for.",
            scene.frame.spacing.metres()
        ),
    };
    Drawing { sheet, map, map_extent }
}

/// Residuals of the load modules of a scene: measured against its ground where there is one, which may be another than
/// that of the build, and those of the build otherwise.
fn of_scene(scene: &Scene) -> Vec<ModuleResidual> {
    let Some(ground) = scene.ground else { return scene.modules.iter().map(|module| module.residual).collect() };
    let (part, rect, side) = (scene.part, ground.dem.rect(), scene.grid.side_cells);
    let wide = (part.east - part.west) as usize;
    let mut all = vec![ModuleResidual::default(); part.iter().count()];
    // A post on a line is of the load module north and east of it, on the last line of that before it.
    let along = |at: i32, first: u32, last: u32| ((at / side) as u32).clamp(first, last - 1) - first;
    for (row, line) in (rect.south..).zip(ground.residuals.chunks(rect.posts_wide())) {
        let first = along(row, part.south, part.north) as usize * wide;
        for (col, &residual) in (rect.west..).zip(line) {
            if residual != NO_RESIDUAL {
                let sum = &mut all[first + along(col, part.west, part.east) as usize];
                let size = residual.unsigned_abs();
                sum.posts += 1;
                sum.largest = sum.largest.max(size);
                sum.sum_abs += u64::from(size);
                sum.sum_squared += u64::from(size) * u64::from(size);
            }
        }
    }
    all
}

/// RMS and largest of all, in words.
fn figures(all: &[ModuleResidual]) -> String {
    let (mut squares, mut posts, mut largest) = (0.0, 0_u64, 0);
    for residual in all {
        squares += residual.sum_squared as f64;
        posts += u64::from(residual.posts);
        largest = largest.max(residual.largest);
    }
    let metre = f64::from(QUANTA_PER_METRE);
    let rms_m = if posts == 0 { 0.0 } else { (squares / posts as f64).sqrt() / metre };
    format!("RMS {rms_m:.3} m, largest {:.2} m", f64::from(largest) / metre)
}

#[cfg(test)]
mod tests {
    use terrain::Dem;

    use super::*;
    use crate::picture::SceneLimits;
    use crate::samples;

    #[test]
    fn where_posts_are_smaller_than_pixels_a_load_module_has_the_colour_of_its_rms() {
        let mut modules = samples::modules();
        for (index, module) in modules.iter_mut().enumerate() {
            let metres = index as u64;
            module.residual =
                ModuleResidual { posts: 400, sum_squared: 400 * (128 * metres).pow(2), ..module.residual };
        }
        let limits = SceneLimits::default();
        let scene = samples::scene(&modules, &limits);
        let drawing = residuals(&scene, 5.0, 30);
        for (module, metres) in scene.part.iter().zip(0..) {
            let [left, top, wide, high] = drawing.map_extent.rect(scene.extent_m(one(module)));
            let color = drawing.map.pixel((left + wide / 2) as usize, (top + high / 2) as usize);
            assert_eq!(color, ERRORS.at(f64::from(metres) / 5.0), "{module}");
        }
        assert!(drawing.sheet.title.ends_with("by load module"));
        let Legend::Ramp { marks, .. } = &drawing.sheet.legends[0] else { panic!("a scale") };
        let texts: Vec<&str> = marks.iter().map(|(_, text)| text.as_str()).collect();
        assert_eq!(texts, ["0 m", "1 m", "2 m", "3 m", "4 m", "5 m and more"]);
    }

    #[test]
    fn residuals_of_the_ground_that_is_there_count_before_those_of_the_build() {
        let (modules, limits) = (samples::modules(), SceneLimits::default());
        let dem = Dem::from_fn(samples::GRID.area(), |_| Some(0));
        let mut residuals = vec![-256; dem.rect().post_count()];
        residuals[0] = NO_RESIDUAL;
        let ground = Some(SceneGround { dem: &dem, residuals: &residuals });
        let all = of_scene(&Scene { ground, ..samples::scene(&modules, &limits) });
        assert_eq!(all.iter().map(|residual| residual.posts).collect::<Vec<_>>(), [399, 400, 420, 420, 420, 441]);
        assert!(all.iter().all(|residual| residual.rms_m() == Some(2.0)));
    }
}
