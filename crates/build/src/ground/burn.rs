//! The working ground: the DEM with features burned in, as tiles are refined against it.
//!
//! On a road a post has the road's height, in water the level. Beside roads and water the ground slopes from their
//! edges to the natural one, and no shore lies below its lake. Under decks and close beside them what stands in their
//! way is cut. Posts on roads and in water weigh nothing: their heights are decided.

use std::collections::{HashMap, HashSet};

use features::{
    CUT_RUN, DECK_GAP, ROADSIDE_REACH_M, WATERSIDE_REACH_M, Watersides, height_in, moved_by_road, nearest_on, offs,
};
use terrain::{Dem, Importance, LatticePoint, Post, PostRect, QUANTA_PER_METRE, SurfaceGround, TileFeatures};
use terrain::{Spacing, Vertex};

use crate::ground::window::Window;

/// Posts from the edge of a road within which slopes may reach.
pub fn roadside_reach(spacing: Spacing) -> i32 {
    (ROADSIDE_REACH_M / spacing.metres()).ceil() as i32
}

/// Posts from water within which slopes may reach.
pub fn waterside_reach(spacing: Spacing) -> i32 {
    (WATERSIDE_REACH_M / spacing.metres()).ceil() as i32
}

/// A window of natural ground in a tile, with what features put into the tile. A post is burned the same whichever tile
/// it lies in and whichever window of it asks.
pub fn burn(window: Window, features: &TileFeatures, (spacing, left_out_weight): (Spacing, f64)) -> Window {
    let TileFeatures { surfaces, shaped, slopes, watersides, decks, .. } = features;
    let is_empty = surfaces.is_empty() && shaped.is_empty() && decks.is_empty();
    if is_empty && slopes.is_empty() && watersides.is_empty() {
        return window;
    }
    let mut burning = Burning::new(&window, features, spacing);
    burning.watersides();
    burning.slopes();
    burning.decks();
    burning.surfaces();
    burning.shores();
    let Burning { rect, heights, class_of, is_shaped, .. } = burning;
    let importance = importance(&window.importance, rect, &class_of, (&is_shaped, left_out_weight));
    let mut dem = Dem::from_fn(rect, |post| heights[rect.index(post)]);
    // Holes keep the heights that close the surface over them.
    dem.fill_voids(|post| window.dem.height(post));
    let is_changed =
        |post: &Post| dem.is_void(*post) != window.dem.is_void(*post) || dem.height(*post) != window.dem.height(*post);
    let is_featured = |post: &Post| {
        let index = rect.index(*post);
        class_of[index].is_some() || (is_changed(post) && !is_shaped[index])
    };
    let featured = rect.posts().filter(is_featured).collect();
    let decided = rect.posts().filter(|post| class_of[rect.index(*post)].is_some()).collect();
    Window { dem, importance, featured, decided, ..window }
}

/// Posts on features weigh nothing and have the class of the feature, also where a lake closes a hole. Posts on what is
/// not in the TIN weigh so many times what they did.
fn importance(
    before: &Importance,
    rect: PostRect,
    class_of: &[Option<u8>],
    (is_shaped, times): (&[bool], f64),
) -> Importance {
    if class_of.iter().all(Option::is_none) && !is_shaped.contains(&true) {
        return before.clone();
    }
    let more = |weight: u16| (f64::from(weight) * times).min(f64::from(u16::MAX)) as u16;
    let of = |post: Post| match class_of[rect.index(post)] {
        Some(class) => (0, class),
        None if is_shaped[rect.index(post)] => (more(before.weight(post)), before.class(post)),
        None => (before.weight(post), before.class(post)),
    };
    let (weights, classes) = rect.posts().map(of).unzip();
    Importance::new(rect, weights, classes)
}

struct Burning<'a> {
    rect: PostRect,
    features: &'a TileFeatures,
    spacing: Spacing,
    /// Steps between posts.
    steps: i32,
    heights: Vec<Option<i32>>,
    /// The class of the feature that a post lies on.
    class_of: Vec<Option<u8>>,
    /// Whether a post lies on a feature that is not in the TIN.
    is_shaped: Vec<bool>,
}

impl<'a> Burning<'a> {
    fn new(window: &Window, features: &'a TileFeatures, spacing: Spacing) -> Self {
        let rect = window.dem.rect();
        let heights: Vec<Option<i32>> =
            rect.posts().map(|post| (!window.dem.is_void(post)).then(|| window.dem.height(post))).collect();
        let (class_of, is_shaped) = (vec![None; heights.len()], vec![false; heights.len()]);
        Self { rect, features, spacing, steps: features.kept.steps_per_post, heights, class_of, is_shaped }
    }

    /// Leads the ground beside water to it.
    fn watersides(&mut self) {
        let metres_per_step = self.spacing.metres() / f64::from(self.steps);
        let watersides = Watersides::of(&self.features.watersides, metres_per_step);
        for post in self.rect.posts() {
            let index = self.rect.index(post);
            self.heights[index] = self.heights[index].map(|natural| watersides.ground(self.place(post), natural));
        }
    }

    /// Lowers and lifts the ground beside roads, each post by the edge nearest to it.
    fn slopes(&mut self) {
        let reach = roadside_reach(self.spacing);
        let quanta_per_step = self.spacing.metres() / f64::from(self.steps) * f64::from(QUANTA_PER_METRE);
        let mut nearest: HashMap<usize, (f64, [f64; 2])> = HashMap::new();
        for slope in &self.features.slopes {
            for post in self.posts_near(&slope.ends, reach) {
                let (steps, share) = nearest_on(slope.ends, self.place(post));
                let along = |[a, b]: [f64; 2]| a + share * (b - a);
                let edge = [slope.ends.map(|end| f64::from(end.height)), offs(slope)].map(along);
                let known = nearest.entry(self.rect.index(post)).or_insert((f64::INFINITY, edge));
                if (steps, edge) < *known {
                    *known = (steps, edge);
                }
            }
        }
        for (index, (steps, edge)) in nearest {
            let moved = |natural: i32| rounded(moved_by_road(edge, steps * quanta_per_step, natural.into()));
            self.heights[index] = self.heights[index].map(|natural| natural + moved(natural));
        }
    }

    /// Cuts what stands in the way of decks: under them to where ground may stay, and within a post of them as steep as
    /// a cut is. A triangle that reaches under a deck has its corners there.
    fn decks(&mut self) {
        let quanta_per_step = self.spacing.metres() / f64::from(self.steps) * f64::from(QUANTA_PER_METRE);
        for deck in &self.features.decks {
            let ring = &deck.ring[..];
            let under: HashSet<Post> = posts_inside(&[ring], self.steps, self.rect).into_iter().collect();
            for post in self.posts_near(ring, 1) {
                let at = self.place(post);
                let beside = |(a, b): (&Vertex, &Vertex)| {
                    let (steps, share) = nearest_on([*a, *b], at);
                    let height = f64::from(a.height) + share * f64::from(b.height - a.height);
                    (steps <= f64::from(self.steps)).then(|| rounded(height + steps * quanta_per_step / CUT_RUN))
                };
                let highest = match under.contains(&post) {
                    true => Some(height_in(&[ring], at) - DECK_GAP),
                    false => ring.iter().zip(ring.iter().cycle().skip(1)).filter_map(beside).min(),
                };
                let index = self.rect.index(post);
                let ground = self.heights[index];
                self.heights[index] = ground.map(|ground| highest.map_or(ground, |highest| ground.min(highest)));
            }
        }
    }

    /// Puts posts on features at the features' heights; where two overlap, the first has the post, and those in the TIN
    /// come first.
    fn surfaces(&mut self) {
        let features = self.features;
        let bodies = features.bodies().map(|body| (body, true));
        for (body, is_held) in bodies.chain(features.shaped_bodies().map(|body| (body, false))) {
            let rings: Vec<&[Vertex]> = body.iter().map(|surface| &surface.ring[..]).collect();
            let banks = (body[0].ground == SurfaceGround::River).then(|| Near::of(&rings, self.steps));
            for post in posts_inside(&rings, self.steps, self.rect) {
                let index = self.rect.index(post);
                if self.class_of[index].is_some() || self.is_shaped[index] {
                    continue;
                }
                let height = match body[0].ground {
                    // A hole of the ground stays one under a road.
                    _ if !is_held && self.heights[index].is_none() => continue,
                    SurfaceGround::Road | SurfaceGround::Strip if self.heights[index].is_none() => continue,
                    SurfaceGround::Road | SurfaceGround::Strip => height_in(&rings, self.place(post)),
                    SurfaceGround::Lake => rings[0][0].height,
                    SurfaceGround::River => {
                        banks.as_ref().map_or(rings[0][0].height, |banks| banks.height(self.place(post)))
                    }
                };
                self.heights[index] = Some(height);
                self.class_of[index] = is_held.then_some(body[0].class);
                self.is_shaped[index] = !is_held;
            }
        }
    }

    /// Lifts what lies within a post of a lake and lower than it.
    fn shores(&mut self) {
        let all = self.features.surfaces.iter().chain(&self.features.shaped);
        for lake in all.filter(|surface| surface.ground == SurfaceGround::Lake) {
            let ring = &lake.ring;
            for (at, &a) in ring.iter().enumerate() {
                let b = ring[(at + 1) % ring.len()];
                for post in self.posts_near(&[a, b], 1) {
                    let index = self.rect.index(post);
                    let is_near = nearest_on([a, b], self.place(post)).0 <= f64::from(self.steps);
                    let is_free = is_near && self.class_of[index].is_none() && !self.is_shaped[index];
                    let ground = self.heights[index].filter(|_| is_free);
                    self.heights[index] = ground.map(|ground| ground.max(a.height + 1)).or(self.heights[index]);
                }
            }
        }
    }

    fn place(&self, post: Post) -> LatticePoint {
        LatticePoint::new(post.row * self.steps, post.col * self.steps)
    }

    /// Posts of the window in the box around some vertices, grown by `reach` posts.
    fn posts_near(&self, vertices: &[Vertex], reach: i32) -> impl Iterator<Item = Post> + use<> {
        let floor = |v: i32| v.div_euclid(self.steps);
        let rows = vertices.iter().map(|vertex| floor(vertex.at.row));
        let cols = vertices.iter().map(|vertex| floor(vertex.at.col));
        let south = rows.clone().min().unwrap_or(0) - reach;
        let north = rows.max().unwrap_or(-1) + 1 + reach;
        let west = cols.clone().min().unwrap_or(0) - reach;
        let east = cols.max().unwrap_or(-1) + 1 + reach;
        let near = PostRect { south, west, north, east }.intersection(&self.rect);
        near.into_iter().flat_map(|rect| rect.posts())
    }
}

fn rounded(quanta: f64) -> i32 {
    (quanta + 0.5).floor() as i32
}

/// Posts inside rings, holes left out: row by row, those between an odd and an even crossing. Vertices stand on a
/// lattice of so many steps a post.
pub fn posts_inside(rings: &[&[Vertex]], steps: i32, rect: PostRect) -> Vec<Post> {
    let mut crossings: HashMap<i32, Vec<i32>> = HashMap::new();
    for ring in rings {
        for (at, a) in ring.iter().enumerate() {
            let (a, b) = (a.at, ring[(at + 1) % ring.len()].at);
            let (low, high) = if a.row < b.row { (a, b) } else { (b, a) };
            // Rows of posts in [low, high): each crossing once, whatever meets at a vertex.
            let first = low.row.div_euclid(steps) + i32::from(low.row.rem_euclid(steps) != 0);
            for row in first.max(rect.south)..=rect.north {
                let place = i64::from(row) * i64::from(steps);
                if i64::from(high.row) <= place {
                    break;
                }
                let (rise, run) = (i64::from(high.row) - i64::from(low.row), i64::from(high.col) - i64::from(low.col));
                let across = (place - i64::from(low.row)) * run;
                // The first post at or east of the crossing.
                let col = i64::from(low.col) + across.div_euclid(rise) + i64::from(across.rem_euclid(rise) != 0);
                let post = col.div_euclid(i64::from(steps)) + i64::from(col.rem_euclid(i64::from(steps)) != 0);
                crossings.entry(row).or_default().push(post as i32);
            }
        }
    }
    let mut rows: Vec<(i32, Vec<i32>)> = crossings.into_iter().collect();
    rows.sort_unstable();
    let mut posts = Vec::new();
    for (row, mut cols) in rows {
        cols.sort_unstable();
        for pair in cols.chunks_exact(2) {
            posts.extend((pair[0].max(rect.west)..pair[1].min(rect.east + 1)).map(|col| Post::new(row, col)));
        }
    }
    posts
}

/// The squared distance of two places, in squared steps.
fn squared(a: LatticePoint, b: LatticePoint) -> i64 {
    let [rows, cols] = [a.row - b.row, a.col - b.col].map(i64::from);
    rows * rows + cols * cols
}

/// Vertices of rings by cells, to find the nearest one.
struct Near<'a> {
    cells: HashMap<(i32, i32), Vec<&'a Vertex>>,
    side: i32,
}

impl<'a> Near<'a> {
    fn of(rings: &[&'a [Vertex]], steps: i32) -> Self {
        let side = 4 * steps;
        let mut cells: HashMap<(i32, i32), Vec<&Vertex>> = HashMap::new();
        for vertex in rings.iter().copied().flatten() {
            cells.entry((vertex.at.row.div_euclid(side), vertex.at.col.div_euclid(side))).or_default().push(vertex);
        }
        Self { cells, side }
    }

    /// The height of the nearest vertex; of several as near the lowest.
    fn height(&self, at: LatticePoint) -> i32 {
        let (row, col) = (at.row.div_euclid(self.side), at.col.div_euclid(self.side));
        let mut best: Option<(i64, i32)> = None;
        for away in 0.. {
            for (r, c) in around(row, col, away) {
                for vertex in self.cells.get(&(r, c)).into_iter().flatten() {
                    let here = (squared(vertex.at, at), vertex.height);
                    best = Some(best.map_or(here, |best| best.min(here)));
                }
            }
            // Nothing in a cell farther out is nearer than its own side.
            let reached = i64::from(away) * i64::from(self.side);
            if let Some((squared, height)) = best
                && squared <= reached * reached
            {
                return height;
            }
        }
        unreachable!("a ring has vertices")
    }
}

/// Cells `away` from one, all around.
fn around(row: i32, col: i32, away: i32) -> Vec<(i32, i32)> {
    let all = (row - away..=row + away).flat_map(move |r| (col - away..=col + away).map(move |c| (r, c)));
    all.filter(|(r, c)| (r - row).abs().max((c - col).abs()) == away).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use terrain::{FeatureSurface, Features, HOLE_CLASS, SideSlope, TileId};

    const STEPS: i32 = 64;

    fn window(height: impl Fn(Post) -> Option<i32>) -> Window {
        let rect = PostRect::new(Post::new(0, 0), Post::new(20, 20));
        let dem = Dem::from_fn(rect, height);
        let importance = Importance::uniform(rect, 1000);
        Window::of(dem, importance)
    }

    /// A vertex at posts (row, column) and a height.
    fn vertex(row: f64, col: f64, height: i32) -> Vertex {
        let steps = |posts: f64| (posts * f64::from(STEPS)) as i32;
        Vertex { at: LatticePoint::new(steps(row), steps(col)), height }
    }

    fn features(surfaces: Vec<FeatureSurface>, slopes: Vec<SideSlope>) -> TileFeatures {
        let kept = Features { steps_per_post: STEPS, ..Features::default() };
        TileFeatures { kept, surfaces, slopes, ..TileFeatures::none(TileId { row: 0, col: 0 }) }
    }

    fn surface(ground: SurfaceGround, ring: Vec<Vertex>) -> FeatureSurface {
        FeatureSurface { class: 4, ground, body: 0, ring }
    }

    fn burned(window: Window, features: &TileFeatures) -> Window {
        burn(window, features, (Spacing::from_metres(10.0).unwrap(), 2.0))
    }

    #[test]
    fn a_lake_is_level_with_an_island_and_no_shore_lies_below_it() {
        let ring = |low: f64, high: f64| {
            vec![vertex(low, low, 500), vertex(low, high, 500), vertex(high, high, 500), vertex(high, low, 500)]
        };
        let outer = surface(SurfaceGround::Lake, ring(4.5, 15.5));
        let island = surface(SurfaceGround::Lake, ring(8.5, 11.5));
        let window = burned(window(|post| Some(post.col * 40)), &features(vec![outer, island], Vec::new()));
        let at = |row, col| (window.dem.height(Post::new(row, col)), window.importance.class(Post::new(row, col)));
        assert_eq!((at(5, 5), at(15, 15), at(10, 6)), ((500, 4), (500, 4), (500, 4)));
        assert_eq!(window.importance.weight(Post::new(5, 5)), 0);
        // The island keeps its heights and weight but for its shore; lower shore is lifted; the rest is as it was.
        assert_eq!((at(9, 9), at(10, 4), at(10, 3), at(10, 17)), ((501, 0), (501, 0), (120, 0), (680, 0)));
        assert_eq!(at(10, 10), (400, 0));
        assert_eq!(window.importance.weight(Post::new(10, 10)), 1000);
    }

    #[test]
    fn a_post_on_a_road_has_its_height_and_a_hole_stays_one() {
        let ring = vec![vertex(9.0, 2.0, 100), vertex(9.0, 18.0, 260), vertex(11.0, 18.0, 260), vertex(11.0, 2.0, 100)];
        let road = features(vec![surface(SurfaceGround::Road, ring)], Vec::new());
        let hole = Post::new(10, 7);
        let mut ground = window(|post| (post != hole).then_some(9));
        ground.dem.fill_voids(|_| 8);
        let window = burned(ground, &road);
        assert_eq!(window.dem.height(Post::new(10, 10)), 180);
        assert_eq!(window.dem.height(Post::new(12, 10)), 9);
        assert!(window.dem.is_void(hole));
        assert_eq!(window.dem.height(hole), 8, "the surface over a hole is where it was");
    }

    #[test]
    fn a_lake_that_is_not_in_the_tin_is_level_and_its_posts_weigh_twice() {
        let corners = [(4.5, 4.5), (4.5, 15.5), (15.5, 15.5), (15.5, 4.5)];
        let ring = corners.map(|(row, col)| vertex(row, col, 500)).to_vec();
        let shaped = vec![surface(SurfaceGround::Lake, ring)];
        let features = TileFeatures { shaped, ..features(Vec::new(), Vec::new()) };
        let window = burned(window(|post| Some(post.col * 40)), &features);
        let at = |row, col| (window.dem.height(Post::new(row, col)), window.importance.weight(Post::new(row, col)));
        // The shore is lifted; nothing counts as a part of features but what is beside them.
        assert_eq!((at(10, 10), at(10, 4), at(10, 3)), ((500, 2000), (501, 1000), (120, 1000)));
        assert!(!window.featured.contains(&Post::new(10, 10)) && window.featured.contains(&Post::new(10, 4)));
        assert_eq!(window.importance.class(Post::new(10, 10)), 0);
    }

    #[test]
    fn a_lake_closes_a_hole_with_its_level_and_class() {
        let corners = [(4.5, 4.5), (4.5, 15.5), (15.5, 15.5), (15.5, 4.5)];
        let ring = corners.map(|(row, col)| vertex(row, col, 500)).to_vec();
        let is_hole = |post: Post| 10 <= post.col && 10 <= post.row;
        let mut ground = window(|post| (!is_hole(post)).then_some(400));
        let classes = ground.dem.rect().posts().map(|post| if is_hole(post) { HOLE_CLASS } else { 0 }).collect();
        ground.importance = Importance::new(ground.dem.rect(), vec![1000; ground.dem.rect().post_count()], classes);
        ground.dem.fill_voids(|_| 399);
        let window = burned(ground, &features(vec![surface(SurfaceGround::Lake, ring)], Vec::new()));
        for post in window.dem.rect().posts() {
            let is_of_hole = window.importance.class(post) == HOLE_CLASS;
            assert_eq!(window.dem.is_void(post), is_of_hole, "{post}: a post of the class of holes has no height");
        }
        let at = |row, col| (window.dem.height(Post::new(row, col)), window.importance.class(Post::new(row, col)));
        assert_eq!((at(12, 12), at(12, 18)), ((500, 4), (399, HOLE_CLASS)));
    }

    #[test]
    fn ground_beside_a_road_is_cut_and_filled_until_slopes_end_as_on_level_ground() {
        let heights = |off: i32, ground: &dyn Fn(i32) -> i32| -> Vec<i32> {
            let ends = [vertex(10.0, -5.0, 1280), vertex(10.0, 25.0, 1280)];
            let slopes = vec![SideSlope { ends, ground: [1280 + off; 2] }];
            let window = burned(window(|post| Some(ground(post.row - 10))), &features(Vec::new(), slopes));
            (11..16).map(|row| window.dem.height(Post::new(row, 10)) - ground(row - 10)).collect()
        };
        // A post is 1,280 quanta wide.
        assert_eq!(heights(-1280, &|_| 0), [640, 0, 0, 0, 0]);
        assert_eq!(heights(2560, &|_| 3840), [-1707, -853, 0, 0, 0]);
        // A hillside as steep as the slope, and steeper: no wall stands where it ends.
        assert_eq!(heights(-1280, &|posts| -640 * posts), [640, 0, 0, 0, 0]);
        assert_eq!(heights(-2560, &|posts| -1280 * (posts + 1)), [1920, 1280, 640, 0, 0]);
        // A wall that the DEM has stays where no rough ground beside the road is reached.
        assert_eq!(heights(0, &|posts| 12_800 * posts), [0; 5]);
    }

    #[test]
    fn ground_above_a_deck_is_cut_and_roads_below_stay() {
        // A deck at 10 m along row 10 of a plain at 20 m, with a road at 3 m across beneath it.
        let ring = |[south, west, north, east]: [f64; 4], z: i32| {
            vec![vertex(south, west, z), vertex(south, east, z), vertex(north, east, z), vertex(north, west, z)]
        };
        let road = surface(SurfaceGround::Road, ring([0.0, 9.5, 20.0, 10.5], 3 * 128));
        let deck = surface(SurfaceGround::Road, ring([9.5, 4.5, 10.5, 15.5], 10 * 128));
        let features = TileFeatures { decks: vec![deck], ..features(vec![road], Vec::new()) };
        let window = burned(window(|_| Some(20 * 128)), &features);
        let metres = |row, col| f64::from(window.dem.height(Post::new(row, col))) / 128.0;
        assert_eq!((metres(10, 7), metres(10, 10), metres(10, 3), metres(10, 17)), (9.5, 3.0, 20.0, 20.0));
        // Half a post from it as steep as a cut.
        assert!((metres(11, 7) - (10.0 + 5.0 / 1.5)).abs() < 0.01, "{}", metres(11, 7));
        // What lies below a deck stays.
        let low = burned(self::window(|_| Some(5 * 128)), &TileFeatures { surfaces: Vec::new(), ..features });
        assert!(low.dem.rect().posts().all(|post| low.dem.height(post) == 5 * 128));
    }

    #[test]
    fn ground_beside_water_slopes_to_it() {
        let ends = [vertex(10.0, -20.0, -1536), vertex(10.0, 40.0, -1536)];
        let watersides = vec![SideSlope { ends, ground: [0; 2] }];
        let window = burned(window(|_| Some(0)), &TileFeatures { watersides, ..features(Vec::new(), Vec::new()) });
        let height = |row| window.dem.height(Post::new(row, 10));
        assert_eq!([10, 11, 12, 13].map(height), [-1536, -896, -256, 0]);
        assert!(window.featured.contains(&Post::new(8, 3)) && !window.featured.contains(&Post::new(7, 3)));
    }

    #[test]
    fn a_river_falls_along_its_banks() {
        let ring = vec![vertex(2.0, 2.0, 900), vertex(2.0, 18.0, 100), vertex(6.0, 18.0, 100), vertex(6.0, 2.0, 900)];
        let river = features(vec![surface(SurfaceGround::River, ring)], Vec::new());
        let window = burned(window(|_| Some(5000)), &river);
        assert_eq!((window.dem.height(Post::new(4, 3)), window.dem.height(Post::new(4, 17))), (900, 100));
    }

    #[test]
    fn where_surfaces_overlap_the_first_has_the_post() {
        let ring = |height| {
            vec![vertex(1.0, 1.0, height), vertex(1.0, 9.0, height), vertex(9.0, 9.0, height), vertex(9.0, 1.0, height)]
        };
        let road = surface(SurfaceGround::Road, ring(70));
        let lake = FeatureSurface { class: 9, ..surface(SurfaceGround::Lake, ring(50)) };
        let window = burned(window(|_| Some(10)), &features(vec![road, lake], Vec::new()));
        assert_eq!((window.dem.height(Post::new(4, 4)), window.importance.class(Post::new(4, 4))), (70, 4));
    }
}
