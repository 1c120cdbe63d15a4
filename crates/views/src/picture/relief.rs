//! Shaded relief with tints for heights, as the founding paper's Figures 13 and 14.

use terrain::{Dem, metres_of_quanta};

use super::color::{Color, FEATURES, GREY, HEIGHTS, NOTHING, WATER, lit};
use super::facets::{Cover, Facets};
use super::features::{draw_lines, keys as keys_of_features, shows};
use super::image::Image;
use super::light::{light_of, light_of_triangle};
use super::map_extent::{MapExtent, Posts, SAMPLES, Samples};
use super::scene::Scene;
use super::sheet::{Drawing, HATCH_PIXELS, Key, Legend, Sheet, round_marks};

/// Heights in the shading are drawn so many times as large as they are, so that plains show their form.
pub(crate) const SHADING_TIMES: f64 = 2.0;

/// Colours of heights.
#[derive(Clone, Debug)]
pub(crate) struct Tints {
    low_m: f64,
    high_m: f64,
    colors: Vec<Color>,
}

impl Tints {
    /// Tints from the lowest to the highest height, in metres.
    pub fn new((low_m, high_m): (f64, f64)) -> Self {
        Self { low_m, high_m: high_m.max(low_m + 1.0), colors: HEIGHTS.table(256) }
    }

    #[inline]
    pub fn at(&self, height_m: f64) -> Color {
        let share = (height_m - self.low_m) / (self.high_m - self.low_m);
        self.colors[(share.clamp(0.0, 1.0) * 255.0) as usize]
    }

    pub fn legend(&self) -> Legend {
        let marks = round_marks(self.low_m, self.high_m).into_iter();
        let marks = marks.map(|(share, metres)| (share, format!("{metres} m"))).collect();
        Legend::Ramp { title: "Height".into(), ramp: HEIGHTS, marks }
    }

    /// What a surface has: heights, and water and holes where `has` says that there are any. Holes look as `hole`.
    pub fn legends(&self, has: impl Fn(Cover) -> bool, hole: Key) -> Vec<Legend> {
        let keys = [(Cover::Water, Key::Filled(WATER), "water"), (Cover::Hole, hole, "hole: no height")];
        let keys: Vec<_> =
            keys.into_iter().filter(|key| has(key.0)).map(|(_, key, name)| (key, name.to_owned())).collect();
        let keys = (!keys.is_empty()).then_some(Legend::Keys { title: String::new(), keys });
        let features = keys_of_features(has);
        let features = (!features.is_empty()).then(|| Legend::Keys { title: "Roads and water".into(), keys: features });
        [Some(self.legend()), keys, features].into_iter().flatten().collect()
    }
}

/// Which surface a picture shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shown {
    /// The load modules.
    Tin,
    /// The ground they were made from.
    Dem,
    /// Both, side by side.
    Both,
}

/// Relief of triangles.
pub(crate) fn facets_relief(facets: &Facets, map_extent: &MapExtent, tints: &Tints) -> Image {
    let mut samples = Samples::new(map_extent);
    for (index, &corners) in facets.corners.iter().enumerate() {
        let corners = facets.triangle(corners);
        match facets.cover(index) {
            Cover::Water => map_extent.cover(corners, |row, col, _| samples.add(row, col, WATER)),
            Cover::Feature(number) => {
                let color = FEATURES[usize::from(number)].1;
                map_extent.cover(corners, |row, col, _| samples.add(row, col, color));
            }
            Cover::Hole => map_extent.cover(corners, |row, col, _| samples.add(row, col, hatched(row, col))),
            Cover::Ground => {
                let light = light_of_triangle(corners, SHADING_TIMES);
                map_extent.cover(corners, |row, col, height_m| samples.add(row, col, lit(tints.at(height_m), light)));
            }
        }
    }
    samples.image(NOTHING)
}

/// Relief of posts; `covers` says what each of them lies over, and is empty where all lie over plain ground.
pub(crate) fn posts_relief(dem: &Dem, posts: &Posts, map_extent: &MapExtent, tints: &Tints, covers: &[Cover]) -> Image {
    let (wide, lights) = (dem.rect().posts_wide(), lights(dem, posts.spacing_m, SHADING_TIMES));
    let rect = dem.rect();
    let heights: Vec<f32> = (rect.south..=rect.north)
        .flat_map(|row| dem.row(row).iter().map(|&quanta| metres_of_quanta(quanta) as f32))
        .collect();
    let mut samples = Samples::new(map_extent);
    posts.sample(map_extent, |between| {
        let nearest = between.post + usize::from(0.5 < between.share[0]) + usize::from(0.5 < between.share[1]) * wide;
        let [row, col] = between.sample;
        let color = match covers.get(nearest).copied().unwrap_or_default() {
            Cover::Water => WATER,
            Cover::Feature(number) => FEATURES[usize::from(number)].1,
            Cover::Hole => hatched(row, col),
            Cover::Ground => {
                let height_m = f64::from(between.blend(wide, |post| heights[post]));
                lit(tints.at(height_m), between.blend(wide, |post| lights[post]))
            }
        };
        samples.add(row, col, color);
    });
    samples.image(NOTHING)
}

/// The colour of a hole at a sample of a map: lines from south-west to north-east.
fn hatched(row: usize, col: usize) -> Color {
    if (row + col) / SAMPLES % HATCH_PIXELS < 2 { GREY } else { NOTHING }
}

/// How light every post is, row by row from the south-west, with heights drawn `times` as large.
pub(crate) fn lights(dem: &Dem, spacing_m: [f64; 2], times: f64) -> Vec<f32> {
    let rect = dem.rect();
    let scale = spacing_m.map(|metres| times / (metres * f64::from(terrain::QUANTA_PER_METRE)));
    let mut lights = Vec::with_capacity(rect.post_count());
    for row in rect.south..=rect.north {
        let (below, above) = (row.max(rect.south + 1) - 1, row.min(rect.north - 1) + 1);
        let (south, here, north) = (dem.row(below), dem.row(row), dem.row(above));
        let rows = f64::from(above - below);
        for col in 0..here.len() {
            let (before, after) = (col.max(1) - 1, (col + 1).min(here.len() - 1));
            let to_east = f64::from(here[after] - here[before]) / (after - before) as f64 * scale[0];
            let to_north = f64::from(north[col] - south[col]) / rows * scale[1];
            lights.push(light_of(to_east, to_north));
        }
    }
    lights
}

/// Heights of a DEM in metres, lowest and highest.
pub(crate) fn range_m(dem: &Dem) -> (f64, f64) {
    let (low, high) = dem.range();
    (metres_of_quanta(low), metres_of_quanta(high))
}

/// The relief of a scene, its longer side `longest` pixels; the ground only where it is there.
pub(crate) fn relief(scene: &Scene, shown: Shown, longest: usize) -> Vec<Drawing> {
    let facets = Facets::of_scene(scene);
    let map_extent = scene.map_extent(longest);
    let range = scene.ground.map_or_else(|| facets.range_m(), |ground| range_m(ground.dem));
    let tints = Tints::new(range);
    let sheet = |title: &str, detail: String| Sheet {
        title: format!("{}: {title}", scene.name),
        subtitle: format!("{}, {detail}", scene.what()),
        coordinates: scene.coordinates(),
        legends: tints.legends(|cover| shows(scene, &facets, cover), Key::Hatched),
        notes: format!(
            "Light from several directions, most of it from the north-west; heights count {SHADING_TIMES} times in \
             the shading."
        ),
    };
    let tin = || {
        let sheet = sheet("relief of the load modules", scene.triangles_in_words());
        let mut map = facets_relief(&facets, &map_extent, &tints);
        draw_lines(&mut map, &map_extent, scene, 1.0);
        Drawing { sheet, map, map_extent }
    };
    let dem = || {
        let ground = scene.ground.expect("a caller that asks for the ground has it");
        let detail = format!("posts {} m apart", scene.frame.spacing.metres());
        let covers = facets.post_covers(ground.dem, scene.frame.spacing.metres());
        let map = posts_relief(ground.dem, &scene.posts(&ground), &map_extent, &tints, &covers);
        Drawing { sheet: sheet("relief of the DEM", detail), map, map_extent }
    };
    match shown {
        Shown::Tin => vec![tin()],
        Shown::Dem => vec![dem()],
        Shown::Both => vec![dem(), tin()],
    }
}
