//! How far the triangles lie from the ground, on a fixed scale, so that two pictures can be compared.

use terrain::QUANTA_PER_METRE;

use super::color::{NOTHING, RESIDUALS, lit};
use super::image::Image;
use super::plan::{Plan, Posts, SAMPLES};
use super::relief::lights;
use super::scene::{NO_RESIDUAL, Scene, SceneGround};
use super::sheet::{Key, Legend, Sheet};

/// Metres at the ends of the scale, unless something else is asked for.
pub const RESIDUAL_SCALE_M: f64 = 5.0;

/// The mean residual under every pixel, over a faint relief.
pub(crate) fn residual_map(ground: &SceneGround, posts: &Posts, plan: &Plan, scale_m: f64) -> Image {
    let wide = ground.dem.rect().posts_wide();
    let lights = lights(ground.dem, posts.spacing_m, 1.0);
    let mut sums = vec![(0.0_f32, 0.0_f32, 0_u32); plan.pixels[0] * plan.pixels[1]];
    posts.sample(plan, |between| {
        let around = [between.post, between.post + 1, between.post + wide, between.post + wide + 1];
        if around.iter().any(|&post| ground.residuals[post] == NO_RESIDUAL) {
            return;
        }
        let [row, col] = between.sample;
        let sum = &mut sums[row / SAMPLES * plan.pixels[0] + col / SAMPLES];
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
    Image::of(plan.pixels[0], plan.pixels[1], sums.iter().map(color).collect())
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

/// The residual map of a scene that has its ground.
pub(crate) fn residuals(scene: &Scene, ground: &SceneGround, scale_m: f64, longest: usize) -> Image {
    let plan = scene.plan(longest);
    let map = residual_map(ground, &scene.posts(ground), &plan, scale_m);
    let (mut squares, mut largest, mut posts) = (0.0, 0, 0_u64);
    for &residual in ground.residuals.iter().filter(|&&residual| residual != NO_RESIDUAL) {
        squares += f64::from(residual) * f64::from(residual);
        largest = largest.max(residual.unsigned_abs());
        posts += 1;
    }
    let metre = f64::from(QUANTA_PER_METRE);
    let rms_m = if posts == 0 { 0.0 } else { (squares / posts as f64).sqrt() / metre };
    let coordinates = scene.coordinates();
    let sheet = Sheet {
        title: format!("{}: residuals", scene.name),
        subtitle: format!("{}, RMS {rms_m:.3} m, largest {:.2} m", scene.what(), f64::from(largest) / metre),
        coordinates: &coordinates,
        legends: vec![
            residual_legend(scale_m),
            Legend::Keys { title: String::new(), keys: vec![(Key::Filled(NOTHING), "no height".into())] },
        ],
        notes: format!(
            "Red: the ground lies above the triangles; blue: below. Every pixel is the mean of the {0:.1} x {0:.1} m \
             under it; the scale is the same in every picture unless it is asked for.",
            plan.metres_per_pixel()
        ),
    };
    sheet.around(&map, &plan)
}
