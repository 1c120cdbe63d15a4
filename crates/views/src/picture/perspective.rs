//! The ground as an observer sees it, shaded or as a wireframe: of a DEM, of a TIN, or of load modules.
//!
//! All of them are drawn by the same light, the same tints and the same haze, so that two pictures from one eye differ
//! by their surfaces alone.

use terrain::{Dem, ObjectKind, metres_of_quanta};

use super::camera::{Camera, View};
use super::color::{Color, FEATURES, GREY, HAZE, INK, NOTHING, SKY, WATER, WHITE, lit, mix};
use super::depth::{Corner, DepthImage};
use super::facets::{Cover, Facets};
use super::image::Image;
use super::light::light_of_triangle;
use super::objects::Solid;
use super::relief::{Tints, lights, range_m};

/// What stands in a picture.
#[derive(Clone, Copy, Debug)]
pub enum Surface<'a> {
    /// Every post of a DEM, so many metres apart west to east and south to north, and what each lies over, row by row
    /// from the south-west; empty where all lie over plain ground.
    Posts(&'a Dem, [f64; 2], &'a [Cover]),
    /// Triangles of a TIN or of load modules.
    Triangles(&'a Facets),
}

/// How a surface is drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Look {
    /// The observer.
    pub camera: Camera,
    /// Pixels across and down.
    pub pixels: [usize; 2],
    /// Heights are drawn so many times as large as they are.
    pub times: f64,
    /// Lowest and highest height of the tints, in metres: the same for pictures that are to be compared.
    pub range_m: (f64, f64),
}

impl Look {
    /// From where one overlooks all of a surface in a direction (degrees from north over east), `wide` pixels across:
    /// one look for every picture that is to be compared with that of this surface.
    pub fn overlooking(surface: &Surface, direction_degrees: f64, times: f64, wide: usize) -> Self {
        const FIELD_OF_VIEW: f64 = 40.0;
        let (extent_m, range_m) = (surface.extent_m(), surface.range_m());
        let camera = Camera::overlooking(extent_m, range_m, times, direction_degrees, FIELD_OF_VIEW);
        Self { camera, pixels: [wide, wide * 9 / 16], times, range_m }
    }
}

/// A picture of a surface.
#[derive(Clone, Debug, PartialEq)]
pub struct Drawn {
    /// The picture.
    pub image: Image,
    /// Metres to a pixel where the middle of the picture meets the ground; `None` where it meets the sky.
    pub middle_m: Option<f64>,
}

/// Metres at which haze takes half of a colour, for an extent of one metre.
const HAZE_HALF: f64 = 2.6;
const WALL: Color = [150, 140, 128];

impl Surface<'_> {
    /// West, south, east and north, in metres from the area's south-west post.
    pub(crate) fn extent_m(&self) -> [f64; 4] {
        match self {
            Surface::Triangles(facets) => facets.extent_m,
            Surface::Posts(dem, [x, y], _) => {
                let rect = dem.rect();
                let metres = |posts: i32, spacing_m: &f64| f64::from(posts) * spacing_m;
                [metres(rect.west, x), metres(rect.south, y), metres(rect.east, x), metres(rect.north, y)]
            }
        }
    }

    /// Whether any of it lies over such a thing.
    pub(crate) fn has(&self, cover: Cover) -> bool {
        match self {
            Surface::Triangles(facets) => facets.shows(cover),
            Surface::Posts(.., covers) => covers.contains(&cover),
        }
    }

    /// Kinds of what stands on it.
    pub(crate) fn kinds(&self) -> &[ObjectKind] {
        match self {
            Surface::Triangles(facets) => &facets.kinds,
            Surface::Posts(..) => &[],
        }
    }

    /// Lowest and highest height, in metres.
    pub(crate) fn range_m(&self) -> (f64, f64) {
        match self {
            Surface::Triangles(facets) => facets.range_m(),
            Surface::Posts(dem, ..) => range_m(dem),
        }
    }
}

/// Draws a surface in colours of its heights, under light from the north-west.
pub(crate) fn draw_perspective(surface: &Surface, look: &Look) -> Drawn {
    let tints = Tints::new(look.range_m);
    let mut stage = Stage::new(surface, look, true);
    let half_m = stage.haze_half_m;
    let color = |[height_m, light]: [f64; 2], ahead: f64| {
        // Between three corners of one light it is that light but for rounding.
        let color = match light {
            _ if 0.0 <= light => lit(tints.at(height_m), light as f32),
            _ if (WATER_LIGHT + HOLE_LIGHT) / 2.0 < light => WATER,
            _ if HOLE_LIGHT - 0.5 < light => NOTHING,
            _ => FEATURES[((HOLE_LIGHT - light).round() as usize - 1).min(FEATURES.len() - 1)].1,
        };
        mix(color, HAZE, haze_share(ahead, half_m))
    };
    stage.draw(surface, look.times, &color);
    stage.draw_features(surface, look.times);
    stage.draw_walls(surface, look, |_, ahead| mix(WALL, HAZE, haze_share(ahead, half_m)));
    stage.finish()
}

/// Draws the edges of a surface that the observer sees: of every triangle; of a DEM a line every few posts.
pub(crate) fn draw_wireframe(surface: &Surface, look: &Look) -> Drawn {
    let mut stage = Stage::new(surface, look, false);
    let pale = |_: [f64; 2], _: f64| WHITE;
    stage.draw(surface, look.times, &pale);
    stage.draw_walls(surface, look, pale);
    let place = |[x, y, z]: [f64; 3]| [x, y, z * look.times];
    match surface {
        Surface::Triangles(facets) => facets.each_edge(|ends, is_line| {
            let (thick, ink) = if is_line && facets.side_m.is_some() { (3.0, INK) } else { (2.0, GREY) };
            stage.line(ends.map(place), thick, ink);
        }),
        Surface::Posts(dem, spacing_m, _) => stage.draw_grid(dem, *spacing_m, look.times),
    }
    if let Surface::Triangles(facets) = surface {
        for ([a, b, c], _) in &facets.decks {
            [[a, b], [b, c], [c, a]].into_iter().for_each(|[a, b]| stage.line([place(*a), place(*b)], 2.0, INK));
        }
    }
    stage.finish()
}

/// How much haze lies before something: half of it at `half_m`, and never all. No exponential, so that every machine
/// has the same.
fn haze_share(ahead_m: f64, half_m: f64) -> f64 {
    let far = (ahead_m / half_m) * (ahead_m / half_m);
    0.75 * far / (1.0 + far)
}

/// A picture that is being drawn.
struct Stage {
    depth: DepthImage,
    view: View,
    eye_m: [f64; 3],
    haze_half_m: f64,
}

/// Cells along a side of a block of posts that is drawn at one step.
const BLOCK: i32 = 64;
/// Stand for the light on water and on holes, which have one colour however they lie.
const WATER_LIGHT: f64 = -1.0;
const HOLE_LIGHT: f64 = -2.0;
/// The same for features of a colour: whole numbers below that of holes.
fn feature_light(number: u8) -> f64 {
    HOLE_LIGHT - 1.0 - f64::from(number)
}
/// How high the side of a deck is drawn, and how far below its surface it begins: sides between two triangles of a
/// deck stay hidden.
const DECK_SIDE_M: f64 = 1.5;
const DECK_HUNG_M: f64 = 0.05;
/// Samples that a step of posts may cover: finer ones are not seen.
const STEP_SAMPLES: f64 = 2.0;

impl Stage {
    fn new(surface: &Surface, look: &Look, has_sky: bool) -> Self {
        // The horizon is found before there is a picture, in pixels.
        let horizon = look.camera.view(look.pixels).horizon().clamp(0.0, look.pixels[1] as f64);
        let backdrop = |row: f64| match has_sky {
            true => mix(SKY[0], SKY[1], if horizon <= row { 1.0 } else { row / horizon }),
            false => WHITE,
        };
        let depth = DepthImage::new(look.pixels, backdrop);
        let view = look.camera.view(depth.size());
        let [west, south, east, north] = surface.extent_m();
        let haze_half_m = HAZE_HALF * (east - west).max(north - south);
        Self { depth, view, eye_m: look.camera.eye_m, haze_half_m }
    }

    fn finish(self) -> Drawn {
        let ahead_m = self.depth.middle_m();
        let per_pixel = |ahead_m: f64| ahead_m * super::depth::SAMPLES as f64 / self.view.focal;
        Drawn { middle_m: ahead_m.map(per_pixel), image: self.depth.image() }
    }

    fn line(&mut self, ends: [[f64; 3]; 2], thick: f64, color: Color) {
        self.depth.line(&self.view, ends.map(|end| self.view.turned(end)), thick, color);
    }

    fn draw(&mut self, surface: &Surface, times: f64, color: &impl Fn([f64; 2], f64) -> Color) {
        match surface {
            Surface::Triangles(facets) => {
                let view = self.view;
                let turned: Vec<[f64; 3]> =
                    facets.vertices.iter().map(|&[x, y, z]| view.turned([x, y, z * times])).collect();
                for (index, &corners) in facets.corners.iter().enumerate() {
                    let light = match facets.cover(index) {
                        Cover::Water => WATER_LIGHT,
                        Cover::Hole => HOLE_LIGHT,
                        Cover::Feature(number) => feature_light(number),
                        Cover::Ground => f64::from(light_of_triangle(facets.triangle(corners), times)),
                    };
                    let corner = |v: u32| {
                        let values = [facets.vertices[v as usize][2], light];
                        Corner { turned: turned[v as usize], values }
                    };
                    self.depth.triangle(&view, corners.map(corner), color);
                }
            }
            Surface::Posts(dem, spacing_m, covers) => {
                let lights = lights(dem, *spacing_m, times);
                self.draw_posts(&LitPosts { dem, spacing_m: *spacing_m, times, lights, covers }, color);
            }
        }
    }

    /// Blocks of posts, far ones at wider steps with the light of the posts between.
    fn draw_posts(&mut self, posts: &LitPosts, color: &impl Fn([f64; 2], f64) -> Color) {
        let LitPosts { dem, spacing_m, times, .. } = *posts;
        let rect = dem.rect();
        for south in (rect.south..rect.north).step_by(BLOCK as usize) {
            for west in (rect.west..rect.east).step_by(BLOCK as usize) {
                let (north, east) = ((south + BLOCK).min(rect.north), (west + BLOCK).min(rect.east));
                let ([x0, y0, _], [x1, y1, _]) = (posts.place(south, west), posts.place(north, east));
                let middle = posts.place((south + north) / 2, (west + east) / 2);
                let (low_m, high_m) = range_m(dem);
                let reach = [(x1 - x0) / 2.0, (y1 - y0) / 2.0, (high_m - low_m) * times];
                let radius = (reach[0] * reach[0] + reach[1] * reach[1] + reach[2] * reach[2]).sqrt() + spacing_m[0];
                if self.view.may_see(middle, radius) {
                    let step = self.step([x0, y0, x1, y1], middle[2], spacing_m);
                    self.draw_block(posts, [south, west, north, east], step, color);
                }
            }
        }
    }

    /// Posts between the corners of what is drawn of a block: as many as are no larger than the samples there.
    fn step(&self, [west, south, east, north]: [f64; 4], up: f64, spacing_m: [f64; 2]) -> i32 {
        let [x, y, z] = self.eye_m;
        let beside = [(west - x).max(x - east).max(0.0), (south - y).max(y - north).max(0.0), z - up];
        let away = (beside[0] * beside[0] + beside[1] * beside[1] + beside[2] * beside[2]).sqrt();
        let samples = spacing_m[0].max(spacing_m[1]) * self.view.focal / away.max(1.0);
        let mut step = 1;
        while step < 16 && 2.0 * f64::from(step) * samples <= STEP_SAMPLES {
            step *= 2;
        }
        step
    }

    fn draw_block(
        &mut self,
        posts: &LitPosts,
        [south, west, north, east]: [i32; 4],
        step: i32,
        color: &impl Fn([f64; 2], f64) -> Color,
    ) {
        let lines =
            |first: i32, last: i32| -> Vec<i32> { (first..last).step_by(step as usize).chain([last]).collect() };
        let (rows, cols) = (lines(south, north), lines(west, east));
        let view = self.view;
        let corner = |row: i32, col: i32| posts.corner(&view, row, col, step);
        let mut below: Vec<Corner> = cols.iter().map(|&col| corner(rows[0], col)).collect();
        // On the border of the surface there is no neighbour, and a wall hangs there.
        let rect = posts.dem.rect();
        if south != rect.south {
            self.draw_skirt(posts, &below, step, color);
        }
        let mut sides: [Vec<Corner>; 2] = [vec![below[0]], vec![below[below.len() - 1]]];
        for &row in &rows[1..] {
            let above: Vec<Corner> = cols.iter().map(|&col| corner(row, col)).collect();
            for i in 1..cols.len() {
                let mut cell = [below[i - 1], below[i], above[i], above[i - 1]];
                let light = match posts.cover(row, cols[i]) {
                    Cover::Ground => None,
                    Cover::Water => Some(WATER_LIGHT),
                    Cover::Hole => Some(HOLE_LIGHT),
                    Cover::Feature(number) => Some(feature_light(number)),
                };
                if let Some(light) = light {
                    cell.iter_mut().for_each(|corner| corner.values[1] = light);
                }
                let [a, b, c, d] = cell;
                self.depth.triangle(&view, [a, b, c], color);
                self.depth.triangle(&view, [a, c, d], color);
            }
            sides[0].push(above[0]);
            sides[1].push(above[above.len() - 1]);
            below = above;
        }
        if north != rect.north {
            self.draw_skirt(posts, &below, step, color);
        }
        for (side, is_border) in sides.iter().zip([west == rect.west, east == rect.east]) {
            if !is_border {
                self.draw_skirt(posts, side, step, color);
            }
        }
    }

    /// A strip that hangs from the side of a block and closes the gap to a neighbour drawn at another step.
    fn draw_skirt(&mut self, posts: &LitPosts, side: &[Corner], step: i32, color: &impl Fn([f64; 2], f64) -> Color) {
        let down =
            self.view.turned([self.eye_m[0], self.eye_m[1], self.eye_m[2] - posts.spacing_m[0] * f64::from(step)]);
        let hung = |corner: Corner| {
            let turned = std::array::from_fn(|i| corner.turned[i] + down[i]);
            Corner { turned, ..corner }
        };
        let view = self.view;
        for pair in side.windows(2) {
            let [a, b] = [pair[0], pair[1]];
            self.depth.triangle(&view, [a, b, hung(b)], color);
            self.depth.triangle(&view, [a, hung(b), hung(a)], color);
        }
    }

    /// Lines of features and their bands, what stands on the ground, and bridges with sides that hang from them: else
    /// one seen from a bank would be a line.
    fn draw_features(&mut self, surface: &Surface, times: f64) {
        let Surface::Triangles(facets) = surface else { return };
        let (view, half_m) = (self.view, self.haze_half_m);
        let color = |number: u8| FEATURES[usize::from(number).min(FEATURES.len() - 1)].1;
        for &(ends, number) in &facets.lines {
            self.line(ends.map(|[x, y, z]| [x, y, z * times]), 2.0, color(number));
        }
        let corner = |[x, y, z]: [f64; 3], down_m: f64| Corner {
            turned: view.turned([x, y, z * times - down_m]),
            values: [0.0; 2],
        };
        // After the lines, which show where bands are narrower than a pixel, and would lie on them elsewhere.
        for (corners, number) in &facets.bands {
            let paint = |_: [f64; 2], ahead: f64| mix(color(*number), HAZE, haze_share(ahead, half_m));
            self.depth.triangle(&view, corners.map(|at| corner(at, 0.0)), &paint);
        }
        for (corners, number) in &facets.decks {
            let paint = color(*number);
            let top = |_: [f64; 2], ahead: f64| mix(paint, HAZE, haze_share(ahead, half_m));
            let side = |_: [f64; 2], ahead: f64| mix(lit(paint, 0.7), HAZE, haze_share(ahead, half_m));
            self.depth.triangle(&view, corners.map(|at| corner(at, 0.0)), &top);
            for (a, b) in [(0, 1), (1, 2), (2, 0)] {
                let [a, b] = [corners[a], corners[b]];
                let hung = [corner(a, DECK_SIDE_M), corner(b, DECK_SIDE_M)];
                self.depth.triangle(&view, [corner(a, DECK_HUNG_M), corner(b, DECK_HUNG_M), hung[1]], &side);
                self.depth.triangle(&view, [corner(a, DECK_HUNG_M), hung[1], hung[0]], &side);
            }
        }
        for Solid { corners, color } in &facets.objects {
            let paint = |_: [f64; 2], ahead: f64| mix(*color, HAZE, haze_share(ahead, half_m));
            self.depth.triangle(&view, corners.map(|at| corner(at, 0.0)), &paint);
        }
    }

    /// Sides of the surface down to its lowest height, so that it stands as a block and not as a sheet.
    fn draw_walls(&mut self, surface: &Surface, look: &Look, color: impl Fn([f64; 2], f64) -> Color) {
        let [west, _, east, _] = surface.extent_m();
        let foot = surface.range_m().0 * look.times - 0.02 * (east - west);
        let view = self.view;
        let mut wall = |ends: [[f64; 3]; 2]| {
            let [a, b] = ends;
            let corner = |place: [f64; 3]| Corner { turned: view.turned(place), values: [0.0; 2] };
            let [top_a, top_b] = [a, b].map(|[x, y, z]| corner([x, y, z * look.times]));
            let [foot_a, foot_b] = [a, b].map(|[x, y, _]| corner([x, y, foot]));
            self.depth.triangle(&view, [top_a, top_b, foot_b], &color);
            self.depth.triangle(&view, [top_a, foot_b, foot_a], &color);
        };
        match surface {
            Surface::Triangles(facets) => {
                let [west, south, east, north] = facets.extent_m;
                facets.each_edge(|ends, _| {
                    let on = |axis: usize, line: f64| ends[0][axis] == line && ends[1][axis] == line;
                    if on(0, west) || on(0, east) || on(1, south) || on(1, north) {
                        wall(ends);
                    }
                });
            }
            Surface::Posts(dem, spacing_m, _) => {
                let rect = dem.rect();
                let place = |row: i32, col: i32| place_of(dem, *spacing_m, row, col);
                for col in rect.west..rect.east {
                    wall([place(rect.south, col), place(rect.south, col + 1)]);
                    wall([place(rect.north, col), place(rect.north, col + 1)]);
                }
                for row in rect.south..rect.north {
                    wall([place(row, rect.west), place(row + 1, rect.west)]);
                    wall([place(row, rect.east), place(row + 1, rect.east)]);
                }
            }
        }
    }

    /// Rows and columns of posts, as many of them as stay apart on the picture.
    fn draw_grid(&mut self, dem: &Dem, spacing_m: [f64; 2], times: f64) {
        /// Lines across the longer side, at most.
        const LINES: i32 = 160;
        let rect = dem.rect();
        let cells = rect.cells_wide().max(rect.cells_high()) as i32;
        let step = (cells + LINES - 1) / LINES;
        let place = |row: i32, col: i32| {
            let [x, y, z] = place_of(dem, spacing_m, row, col);
            [x, y, z * times]
        };
        for row in (rect.south..rect.north).step_by(step as usize).chain([rect.north]) {
            for col in rect.west..rect.east {
                self.line([place(row, col), place(row, col + 1)], 2.0, GREY);
            }
        }
        for col in (rect.west..rect.east).step_by(step as usize).chain([rect.east]) {
            for row in rect.south..rect.north {
                self.line([place(row, col), place(row + 1, col)], 2.0, GREY);
            }
        }
    }
}

/// East, north and up of a post, in metres.
fn place_of(dem: &Dem, spacing_m: [f64; 2], row: i32, col: i32) -> [f64; 3] {
    let height_m = metres_of_quanta(dem.height(terrain::Post::new(row, col)));
    [f64::from(col) * spacing_m[0], f64::from(row) * spacing_m[1], height_m]
}

/// Posts with their light.
struct LitPosts<'a> {
    dem: &'a Dem,
    spacing_m: [f64; 2],
    times: f64,
    lights: Vec<f32>,
    covers: &'a [Cover],
}

impl LitPosts<'_> {
    fn cover(&self, row: i32, col: i32) -> Cover {
        let rect = self.dem.rect();
        let place = rect.index(terrain::Post::new(row, col));
        self.covers.get(place).copied().unwrap_or_default()
    }

    /// A post with heights as they are drawn.
    fn place(&self, row: i32, col: i32) -> [f64; 3] {
        let [x, y, z] = place_of(self.dem, self.spacing_m, row, col);
        [x, y, z * self.times]
    }

    fn corner(&self, view: &View, row: i32, col: i32, step: i32) -> Corner {
        let [x, y, z] = place_of(self.dem, self.spacing_m, row, col);
        Corner { turned: view.turned([x, y, z * self.times]), values: [z, self.light(row, col, step)] }
    }

    /// The mean light of the posts that a corner stands for.
    fn light(&self, row: i32, col: i32, step: i32) -> f64 {
        let rect = self.dem.rect();
        let wide = rect.posts_wide();
        let near = |at: i32, first: i32, last: i32| ((at - step / 2).max(first), (at + (step - 1) / 2).min(last));
        let ((south, north), (west, east)) = (near(row, rect.south, rect.north), near(col, rect.west, rect.east));
        let mut sum = 0.0;
        for row in south..=north {
            let start = (row - rect.south) as usize * wide;
            let lights = &self.lights[start + (west - rect.west) as usize..=start + (east - rect.west) as usize];
            sum += lights.iter().map(|&light| f64::from(light)).sum::<f64>();
        }
        sum / f64::from((north - south + 1) * (east - west + 1))
    }
}

#[cfg(test)]
mod tests {
    use terrain::{LatticePoint, Post, PostRect, Tin, Vertex};

    use super::*;

    const SPACING_M: [f64; 2] = [25.0, 25.0];

    /// Hills over so many cells a side.
    fn hills(cells: i32) -> Dem {
        let wave = |at: i32, length: i32| {
            let phase = at.rem_euclid(length) - length / 2;
            phase * phase
        };
        let rect = PostRect { south: 0, west: 0, north: cells, east: cells };
        Dem::from_fn(rect, |post| Some(100_000 + 6 * wave(post.row, 90) + 5 * wave(post.col, 70)))
    }

    /// The TIN that stands on every post of a DEM.
    fn every_post(dem: &Dem) -> Tin {
        let rect = dem.rect();
        let wide = rect.posts_wide() as u32;
        let vertices = (rect.south..=rect.north).flat_map(|row| {
            (rect.west..=rect.east).map(move |col| {
                let post = Post::new(row, col);
                Vertex { at: LatticePoint::from(post), height: dem.height(post) }
            })
        });
        let cells = (0..rect.cells_high() as u32)
            .flat_map(|row| (0..rect.cells_wide() as u32).map(move |col| row * wide + col));
        let triangles = cells.flat_map(|a| [[a, a + 1, a + wide + 1], [a, a + wide + 1, a + wide]]).collect();
        Tin::new(rect, vertices.collect(), triangles)
    }

    #[test]
    fn no_sky_shows_through_the_ground_where_blocks_of_different_steps_meet() {
        let dem = hills(900);
        let camera = Camera {
            eye_m: [11_000.0, 200.0, 950.0],
            direction_degrees: 5.0,
            pitch_degrees: -4.0,
            field_of_view_degrees: 60.0,
        };
        let look = Look { camera, pixels: [240, 135], times: 1.0, range_m: range_m(&dem) };
        let drawn = draw_perspective(&Surface::Posts(&dem, SPACING_M, &[]), &look);
        let empty = hills(1);
        let behind = Camera { direction_degrees: 180.0, ..camera };
        let sky = draw_perspective(&Surface::Posts(&empty, SPACING_M, &[]), &Look { camera: behind, ..look }).image;
        for x in 0..240 {
            let is_sky = |y: &usize| drawn.image.pixel(x, *y) == sky.pixel(x, *y);
            let ground = (0..135).find(|y| !is_sky(y)).unwrap();
            assert_eq!((ground..135).find(is_sky), None, "column {x}: sky below row {ground}");
        }
        assert!(drawn.middle_m.is_some());
    }

    #[test]
    fn a_tin_on_every_post_is_seen_as_the_dem_is() {
        let dem = hills(60);
        let facets = Facets::of_tin(&every_post(&dem), SPACING_M);
        let posts = Surface::Posts(&dem, SPACING_M, &[]);
        let look = Look::overlooking(&posts, 30.0, 1.0, 200);
        let of_posts = draw_perspective(&posts, &look);
        let of_facets = draw_perspective(&Surface::Triangles(&facets), &look);
        let (mut differing, mut inside) = (0, 0);
        for (a, b) in (0..200 * 112)
            .map(|at| (at % 200, at / 200))
            .map(|(x, y)| (of_posts.image.pixel(x, y), of_facets.image.pixel(x, y)))
        {
            inside += usize::from(a != SKY[1]);
            // Flat triangles under the same light as blended posts: nearly, not exactly, the same.
            differing += usize::from((0..3).any(|i| 24 < a[i].abs_diff(b[i])));
        }
        assert!(5000 < inside && differing < inside / 50, "{differing} of {inside}");
    }

    #[test]
    fn bridges_hang_above_the_ground_in_the_colour_of_their_class() {
        let ground = Facets::of_tin(&every_post(&hills(60)), SPACING_M);
        let [west, south, east, north] = ground.extent_m;
        let up = ground.range_m().1 + 40.0;
        let at = |aside: f64, on: f64| [(west + east) / 2.0 + aside, (south + north) / 2.0 + on, up];
        let deck = [at(-300.0, -100.0), at(300.0, -100.0), at(300.0, 100.0)];
        let decked = Facets { decks: vec![(deck, 3)], ..ground.clone() };
        assert!(decked.shows(Cover::Feature(3)) && !decked.has(Cover::Feature(3)));
        let look = Look::overlooking(&Surface::Triangles(&ground), 30.0, 1.0, 200);
        for draw in [draw_perspective, draw_wireframe] {
            let [without, with] = [&ground, &decked].map(|facets| draw(&Surface::Triangles(facets), &look).image);
            let pixels = (0..200 * 112).map(|at| (at % 200, at / 200));
            let changed = pixels.filter(|&(x, y)| without.pixel(x, y) != with.pixel(x, y)).count();
            assert!((20..4000).contains(&changed), "{changed} pixels changed");
        }
        let image = draw_perspective(&Surface::Triangles(&decked), &look).image;
        let [color, haze] = [FEATURES[3].1, HAZE];
        let is_deck =
            |found: [u8; 3]| (0..3).all(|i| (color[i].min(haze[i])..=color[i].max(haze[i])).contains(&found[i]));
        assert!((0..200).any(|x| (0..112).any(|y| is_deck(image.pixel(x, y)))));
    }

    #[test]
    fn water_and_holes_have_one_colour_each_however_they_lie() {
        let dem = hills(60);
        let surface =
            |cover: Cover| Facets { covers: vec![cover; 60 * 60 * 2], ..Facets::of_tin(&every_post(&dem), SPACING_M) };
        let look = Look::overlooking(&Surface::Posts(&dem, SPACING_M, &[]), 30.0, 1.0, 200);
        for (cover, color) in [(Cover::Water, WATER), (Cover::Hole, NOTHING), (Cover::Feature(3), FEATURES[3].1)] {
            let image = draw_perspective(&Surface::Triangles(&surface(cover)), &look).image;
            let is_between =
                |x: [u8; 3], a: [u8; 3], b: [u8; 3]| (0..3).all(|i| a[i].min(b[i]) <= x[i] && x[i] <= a[i].max(b[i]));
            // Inside, away from the walls and the sky, only haze lies over it.
            for (x, y) in (60..140).flat_map(|x| (40..60).map(move |y| (x, y))) {
                let found = image.pixel(x, y);
                assert!(is_between(found, color, HAZE), "{cover:?} at {x},{y}: {found:?}");
            }
        }
    }

    #[test]
    fn a_wireframe_has_ink_on_white_and_nothing_else() {
        let dem = hills(40);
        let posts = Surface::Posts(&dem, SPACING_M, &[]);
        let facets = Facets::of_tin(&every_post(&dem), SPACING_M);
        let look = Look::overlooking(&posts, 0.0, 1.0, 160);
        for surface in [posts, Surface::Triangles(&facets)] {
            let image = draw_wireframe(&surface, &look).image;
            let pixels: Vec<Color> = (0..160 * 90).map(|at| image.pixel(at % 160, at / 160)).collect();
            assert!(pixels.iter().all(|[r, g, b]| r == g && g == b), "only greys");
            let inked = pixels.iter().filter(|pixel| **pixel != WHITE).count();
            assert!(pixels.len() / 20 < inked && inked < pixels.len() * 9 / 10, "{inked}");
        }
    }
}
