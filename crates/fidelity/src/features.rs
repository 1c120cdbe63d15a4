//! How true a tile is to its features: whether its TIN has their edges, whether lakes lie level and no shore below
//! them, and how far the ground outside of them lies from the TIN.

use std::collections::{BTreeMap, BTreeSet, HashMap};

use terrain::geometry::nearest_share;
use terrain::{
    Dem, FeatureSurface, Features, LatticePoint, LoadModule, Post, PostRect, QUANTA_PER_METRE, SurfaceGround,
    TileFeatures,
};
use terrain::{Tin, Vertex};

use crate::{DeckFigures, Reference, Tally, each_residual};

/// What was found of the features of a tile, or of several.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FeatureFigures {
    /// Steps between posts, in which `missing` is counted.
    pub steps_per_post: i32,
    /// Edges that the TIN has to keep, those on a line that two tiles share in one of them.
    pub edges: u64,
    /// Those that it lacks, by place, each once.
    pub missing: Vec<[LatticePoint; 2]>,
    /// How far any corner of a triangle of water lies from the level of its lake, in quanta.
    pub lake_spread: u32,
    /// Square metres inside the shores of lakes that something else tilts, which are banks and no water.
    pub lake_banks_m2: u64,
    /// Posts outside features within a post of a lake.
    pub shore_posts: u64,
    /// Those of them below its level.
    pub shore_below: u64,
    /// Residuals outside features and their slopes.
    pub outside: Tally,
    /// How far decks stand above the ground.
    pub decks: DeckFigures,
    /// Metres of roads that lie inside buildings, counted once these stand on the ground.
    pub in_buildings_m: u64,
}

impl FeatureFigures {
    /// Those of one tile of an area that covers `area`: its TIN, its load modules, the ground that they are measured
    /// against, and the posts that features lie on or have changed.
    pub fn of(
        (tin, modules): (&Tin, &[LoadModule]),
        features: &TileFeatures,
        ground: &Reference,
        featured: &[Post],
        area: PostRect,
    ) -> Self {
        let bodies = Bodies::of(features);
        let (shore_posts, shore_below) = bodies.shore(ground.dem, tin.rect);
        let lakes = bodies.lakes(modules, ground);
        Self {
            steps_per_post: features.kept.steps_per_post,
            edges: owned_edges(&features.kept, tin.rect, area),
            missing: missing_edges(tin, &features.kept),
            lake_spread: lakes[0] as u32,
            lake_banks_m2: lakes[1],
            shore_posts,
            shore_below,
            outside: residuals_without(modules, ground, featured),
            decks: deck_figures(modules),
            in_buildings_m: 0,
        }
    }

    /// Adds those of another tile.
    pub fn merge(&mut self, other: &Self) {
        self.steps_per_post = self.steps_per_post.max(other.steps_per_post);
        self.edges += other.edges;
        self.missing.extend(&other.missing);
        self.missing.sort_unstable();
        self.missing.dedup();
        self.lake_spread = self.lake_spread.max(other.lake_spread);
        self.lake_banks_m2 += other.lake_banks_m2;
        self.shore_posts += other.shore_posts;
        self.shore_below += other.shore_below;
        self.outside.merge(&other.outside);
        self.decks.merge(&other.decks);
        self.in_buildings_m += other.in_buildings_m;
    }
}

/// How far the decks of load modules stand above the ground.
pub(crate) fn deck_figures<'a>(modules: impl IntoIterator<Item = &'a LoadModule>) -> DeckFigures {
    let mut all = DeckFigures::default();
    modules
        .into_iter()
        .filter(|module| !module.decks.is_empty())
        .for_each(|module| all.merge(&DeckFigures::of(module)));
    all
}

/// Edges of features that a tile counts as its own: those on its northern and eastern side are a neighbour's.
fn owned_edges(kept: &Features, rect: PostRect, area: PostRect) -> u64 {
    let steps = kept.steps_per_post;
    let is_owned = |[a, b]: &&[u32; 2]| {
        let [a, b] = [a, b].map(|end| kept.vertices[*end as usize].at);
        let north = rect.north != area.north && [a.row, b.row] == [rect.north * steps; 2];
        let east = rect.east != area.east && [a.col, b.col] == [rect.east * steps; 2];
        !north && !east
    };
    kept.edges.iter().filter(is_owned).count() as u64
}

/// Edges of features that a TIN has neither whole nor in collinear parts, by place in steps of the features' lattice.
pub(crate) fn missing_edges(tin: &Tin, kept: &Features) -> Vec<[LatticePoint; 2]> {
    if kept.edges.is_empty() {
        return Vec::new();
    }
    let (to_common, to_tin) = common(kept.steps_per_post, tin.steps_per_post);
    let at: Vec<LatticePoint> = tin.vertices.iter().map(|vertex| scaled(vertex.at, to_tin)).collect();
    let number: HashMap<LatticePoint, u32> = at.iter().zip(0..).map(|(&at, number)| (at, number)).collect();
    let mut beside: Vec<(u32, u32)> =
        tin.triangles.iter().flat_map(|&[a, b, c]| [(a, b), (b, a), (b, c), (c, b), (c, a), (a, c)]).collect();
    beside.sort_unstable();
    beside.dedup();
    let next = |from: u32| &beside[beside.partition_point(|pair| pair.0 < from)..];
    let is_there = |a: LatticePoint, b: LatticePoint| {
        let (Some(&from), Some(&end)) = (number.get(&a), number.get(&b)) else { return false };
        let mut here = from;
        while here != end {
            let from = at[here as usize];
            let on = |to: LatticePoint| cross(from, b, to) == 0 && between(from, b, to);
            let neighbours = next(here).iter().take_while(|pair| pair.0 == here).map(|pair| pair.1);
            match neighbours.into_iter().find(|to| on(at[*to as usize])) {
                Some(to) => here = to,
                None => return false,
            }
        }
        true
    };
    let ends = |[a, b]: &[u32; 2]| [a, b].map(|end| kept.vertices[*end as usize].at);
    let missing = kept.edges.iter().map(ends).filter(|&[a, b]| !is_there(scaled(a, to_common), scaled(b, to_common)));
    missing.collect()
}

/// What steps of two lattices are multiplied by to be steps of the finer one: both are powers of two.
fn common(one: i32, other: i32) -> (i32, i32) {
    let finest = one.max(other);
    (finest / one, finest / other)
}

fn scaled(at: LatticePoint, by: i32) -> LatticePoint {
    LatticePoint::new(at.row * by, at.col * by)
}

fn cross(a: LatticePoint, b: LatticePoint, c: LatticePoint) -> i64 {
    let [bx, by, cx, cy] = [b.col - a.col, b.row - a.row, c.col - a.col, c.row - a.row].map(i64::from);
    bx * cy - by * cx
}

/// Whether a place on the line from `a` to `b` lies beyond `a` and no farther than `b`.
fn between(a: LatticePoint, b: LatticePoint, at: LatticePoint) -> bool {
    at != a
        && (a.row.min(b.row)..=a.row.max(b.row)).contains(&at.row)
        && (a.col.min(b.col)..=a.col.max(b.col)).contains(&at.col)
}

/// Residuals of the posts that load modules own, but for those that are left out.
fn residuals_without(modules: &[LoadModule], ground: &Reference, left_out: &[Post]) -> Tally {
    let rect = ground.dem.rect();
    let mut is_left_out = vec![false; rect.post_count()];
    left_out.iter().filter(|post| rect.contains(**post)).for_each(|&post| is_left_out[rect.index(post)] = true);
    let mut tally = Tally::default();
    for module in modules {
        each_residual(module, ground, |post, residual| {
            if !is_left_out[rect.index(post)] {
                tally.add(residual);
            }
        });
    }
    tally
}

/// Ground of features with its rings, in the order in which they have a place.
pub struct Bodies<'a> {
    steps: i32,
    bodies: Vec<Body<'a>>,
    /// Bodies by the blocks of posts that they reach into, in their order.
    blocks: HashMap<(i32, i32), Vec<u32>>,
}

/// Posts a side of a block.
const BLOCK: i32 = 8;

struct Body<'a> {
    ground: SurfaceGround,
    class: u8,
    /// The height of its first vertex: of a lake its level.
    level: i32,
    rings: Vec<&'a [Vertex]>,
    /// Edges of its rings by the rows of posts that they touch.
    rows: BTreeMap<i32, Vec<[LatticePoint; 2]>>,
    /// South, west, north and east.
    reach: [i32; 4],
}

impl<'a> Bodies<'a> {
    /// Those of a tile.
    pub fn of(features: &'a TileFeatures) -> Self {
        let steps = features.kept.steps_per_post;
        let bodies: Vec<Body> = features.bodies().map(|surfaces| Body::of(surfaces, steps)).collect();
        let mut blocks: HashMap<(i32, i32), Vec<u32>> = HashMap::new();
        for (number, body) in (0..).zip(&bodies) {
            let [south, west, north, east] = body.reach.map(|at| at.div_euclid(BLOCK * steps.max(1)));
            for block in (south..=north).flat_map(|row| (west..=east).map(move |col| (row, col))) {
                blocks.entry(block).or_default().push(number);
            }
        }
        Self { steps, bodies, blocks }
    }

    /// The bodies that may hold a place, in their order.
    fn near(&self, at: LatticePoint) -> impl Iterator<Item = &Body<'a>> {
        let side = BLOCK * self.steps.max(1);
        let block = self.blocks.get(&(at.row.div_euclid(side), at.col.div_euclid(side)));
        block.into_iter().flatten().map(|number| &self.bodies[*number as usize])
    }

    /// Whether there is a lake.
    pub fn has_lake(&self) -> bool {
        self.bodies.iter().any(|body| body.ground == SurfaceGround::Lake)
    }

    /// The level of the lake that a place, in steps of the features' lattice, lies in or on the shore of.
    pub(crate) fn lake_level(&self, at: LatticePoint) -> Option<i32> {
        let first = self.near(at).find(|body| body.holds(at, self.steps))?;
        (first.ground == SurfaceGround::Lake).then_some(first.level)
    }

    /// The same of a place in a lattice of so many steps a post; one between the places of features lies south-west.
    pub fn lake_level_in(&self, at: LatticePoint, steps_per_post: i32) -> Option<i32> {
        let (to_common, to_own) = common(self.steps, steps_per_post);
        let at = scaled(at, to_own);
        self.lake_level(LatticePoint::new(at.row.div_euclid(to_common), at.col.div_euclid(to_common)))
    }

    /// How far any corner of a triangle of water lies from the level of its lake, in quanta, and square metres inside
    /// shores that are no water because something tilts them.
    fn lakes(&self, modules: &[LoadModule], ground: &Reference) -> [u64; 2] {
        let (mut spread, mut banks) = (0, 0);
        if !self.has_lake() {
            return [0, 0];
        }
        let units = i64::from(ground.spacing.quanta_per_post());
        for module in modules {
            let origin = [module.id.row, module.id.col].map(|line| i64::from(line) * i64::from(module.side));
            for (triangle, class) in module.triangles.iter().zip(&module.classes) {
                let corners = triangle.map(|v| module.vertices[usize::from(v)]);
                let [a, b, c] = corners.map(|v| [origin[0] + i64::from(v.y), origin[1] + i64::from(v.x)]);
                // A place inside: twice the first corner and both others, a quarter of it.
                let inside = [0, 1].map(|axis| {
                    let sum = 2 * a[axis] + b[axis] + c[axis];
                    (sum * i64::from(self.steps)).div_euclid(4 * units) as i32
                });
                let at = LatticePoint::new(inside[0], inside[1]);
                let first = self.near(at).find(|body| body.holds(at, self.steps));
                let Some(lake) = first.filter(|body| body.ground == SurfaceGround::Lake) else { continue };
                let off = corners.iter().map(|vertex| vertex.z.abs_diff(lake.level)).max().unwrap_or(0);
                if *class == lake.class {
                    spread = spread.max(u64::from(off));
                } else if 0 < off {
                    let ([up, right], [to_up, to_right]) = ([b[0] - a[0], b[1] - a[1]], [c[0] - a[0], c[1] - a[1]]);
                    banks += (right * to_up - up * to_right).unsigned_abs();
                }
            }
        }
        let quanta = u64::from(QUANTA_PER_METRE.unsigned_abs());
        [spread, banks.div_ceil(2 * quanta * quanta)]
    }

    /// Posts of `rect` outside all features that lie within a post of a lake, and those of them below its level.
    fn shore(&self, dem: &Dem, rect: PostRect) -> (u64, u64) {
        let (mut posts, mut below) = (BTreeSet::new(), BTreeSet::new());
        for lake in self.bodies.iter().filter(|body| body.ground == SurfaceGround::Lake) {
            for [a, b] in lake.rings.iter().flat_map(|ring| edges(ring)) {
                for post in posts_near(a, b, self.steps, rect) {
                    let at = LatticePoint::new(post.row * self.steps, post.col * self.steps);
                    let is_shore = is_within(a, b, at, self.steps)
                        && !dem.is_void(post)
                        && !self.near(at).any(|body| body.holds(at, self.steps));
                    if is_shore {
                        posts.insert(post);
                    }
                    if is_shore && dem.height(post) < lake.level {
                        below.insert(post);
                    }
                }
            }
        }
        (posts.len() as u64, below.len() as u64)
    }
}

impl<'a> Body<'a> {
    fn of(surfaces: &'a [FeatureSurface], steps: i32) -> Self {
        let rings: Vec<&[Vertex]> = surfaces.iter().map(|surface| &surface.ring[..]).collect();
        let mut rows: BTreeMap<i32, Vec<[LatticePoint; 2]>> = BTreeMap::new();
        let mut reach = [i32::MAX, i32::MAX, i32::MIN, i32::MIN];
        for [a, b] in rings.iter().flat_map(|ring| edges(ring)) {
            for row in a.row.min(b.row).div_euclid(steps)..=a.row.max(b.row).div_euclid(steps) {
                rows.entry(row).or_default().push([a, b]);
            }
            reach = [reach[0].min(a.row), reach[1].min(a.col), reach[2].max(a.row), reach[3].max(a.col)];
        }
        let level = rings.first().and_then(|ring| ring.first()).map_or(0, |vertex| vertex.height);
        Self { ground: surfaces[0].ground, class: surfaces[0].class, level, rings, rows, reach }
    }

    fn near(&self, at: LatticePoint, steps: i32) -> &[[LatticePoint; 2]] {
        let [south, west, north, east] = self.reach;
        let inside = south <= at.row && at.row <= north && west <= at.col && at.col <= east;
        self.rows.get(&at.row.div_euclid(steps)).filter(|_| inside).map_or(&[], |edges| edges)
    }

    fn is_on_ring(&self, at: LatticePoint, steps: i32) -> bool {
        self.near(at, steps).iter().any(|&[a, b]| at == a || (cross(a, b, at) == 0 && between(a, b, at)))
    }

    /// Whether a place lies inside or on a ring.
    fn holds(&self, at: LatticePoint, steps: i32) -> bool {
        self.is_on_ring(at, steps) || self.is_inside(at, steps)
    }

    /// Whether an odd number of edges lies west of a place.
    fn is_inside(&self, at: LatticePoint, steps: i32) -> bool {
        let crossed = |[a, b]: &&[LatticePoint; 2]| {
            let (low, high) = if a.row < b.row { (*a, *b) } else { (*b, *a) };
            low.row <= at.row && at.row < high.row && cross(low, high, at) < 0
        };
        self.near(at, steps).iter().filter(crossed).count() % 2 == 1
    }
}

/// The edges of a ring.
fn edges(ring: &[Vertex]) -> impl Iterator<Item = [LatticePoint; 2]> + '_ {
    ring.iter().enumerate().map(|(at, vertex)| [vertex.at, ring[(at + 1) % ring.len()].at])
}

/// Posts of `rect` in the box around an edge and one post farther.
fn posts_near(a: LatticePoint, b: LatticePoint, steps: i32, rect: PostRect) -> impl Iterator<Item = Post> {
    let span = |a: i32, b: i32| (a.min(b).div_euclid(steps) - 1, a.max(b).div_euclid(steps) + 2);
    let ((south, north), (west, east)) = (span(a.row, b.row), span(a.col, b.col));
    PostRect { south, west, north, east }.intersection(&rect).into_iter().flat_map(|rect| rect.posts())
}

/// Whether a place lies within so many steps of an edge.
fn is_within(a: LatticePoint, b: LatticePoint, at: LatticePoint, steps: i32) -> bool {
    let to = |end: LatticePoint| [end.col - a.col, end.row - a.row].map(f64::from);
    let ([along_x, along_y], [x, y]) = (to(b), to(at));
    let share = nearest_share([along_x, along_y], [x, y]);
    let (off_x, off_y) = (x - share * along_x, y - share * along_y);
    off_x * off_x + off_y * off_y <= f64::from(steps) * f64::from(steps)
}

#[cfg(test)]
mod tests {
    use super::*;
    use terrain::{Importance, ModuleGrid, ModuleId, ModuleVertex, Spacing, TileId};

    const STEPS: i32 = 16;
    const RECT: PostRect = PostRect { south: 0, west: 0, north: 8, east: 8 };

    fn vertex(row: i32, col: i32, height: i32) -> Vertex {
        Vertex { at: LatticePoint::new(row, col), height }
    }

    /// A square of two triangles with a point in the middle of its diagonal, in eighths of a post.
    fn tin() -> Tin {
        let corners = [vertex(0, 0, 0), vertex(0, 64, 0), vertex(64, 64, 0), vertex(64, 0, 0), vertex(32, 32, 5)];
        Tin::new(RECT, corners.to_vec(), vec![[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]])
    }

    fn kept(edges: &[[(i32, i32); 2]]) -> Features {
        let mut kept = Features { steps_per_post: STEPS, ..Features::default() };
        for ends in edges {
            let first = kept.vertices.len() as u32;
            kept.vertices.extend(ends.map(|(row, col)| vertex(row, col, 0)));
            kept.edges.push([first, first + 1]);
        }
        kept
    }

    #[test]
    fn an_edge_is_there_whole_or_in_parts_and_missing_otherwise() {
        let diagonal = [(0, 0), (128, 128)];
        let (side, half) = ([(0, 0), (0, 128)], [(64, 64), (0, 128)]);
        let (absent, to_nowhere) = ([(0, 64), (64, 64)], [(0, 0), (64, 65)]);
        let missing = missing_edges(&tin(), &kept(&[diagonal, side, half, absent, to_nowhere]));
        let place = |(row, col)| LatticePoint::new(row, col);
        assert_eq!(missing, [absent.map(place), to_nowhere.map(place)]);
    }

    #[test]
    fn an_edge_on_a_line_between_tiles_is_counted_by_one_of_them() {
        let kept = kept(&[[(128, 0), (128, 64)], [(0, 128), (64, 128)], [(0, 0), (0, 64)], [(128, 0), (0, 128)]]);
        let wide = PostRect { north: 16, east: 16, ..RECT };
        assert_eq!((owned_edges(&kept, RECT, wide), owned_edges(&kept, RECT, RECT)), (2, 4));
    }

    fn lake(level: i32) -> TileFeatures {
        lake_within(24, 104, level)
    }

    fn lake_within(low: i32, high: i32, level: i32) -> TileFeatures {
        let ring = [(low, low), (low, high), (high, high), (high, low)].map(|(row, col)| vertex(row, col, level));
        let ring = ring.to_vec();
        let surface = FeatureSurface { class: 2, ground: SurfaceGround::Lake, body: 0, ring: ring.clone() };
        let kept = Features { steps_per_post: STEPS, vertices: ring, ..Features::default() }.canonical();
        TileFeatures { kept, surfaces: vec![surface], ..TileFeatures::none(TileId { row: 0, col: 0 }) }
    }

    #[test]
    fn a_corner_of_water_lies_on_its_level_or_is_told_and_what_is_tilted_is_bank() {
        let spacing = Spacing::from_metres(10.0).unwrap();
        let units = spacing.quanta_per_post();
        // Two triangles of 8 x 8 posts, one corner 5 quanta above the others.
        let corner = |x: i32, y: i32, z| ModuleVertex { x: (x * units) as u16, y: (y * units) as u16, z };
        let module = |classes: [u8; 2]| LoadModule {
            side: (8 * units) as u16,
            vertices: vec![corner(0, 0, 0), corner(8, 0, 0), corner(8, 8, 5), corner(0, 8, 0)],
            triangles: vec![[0, 1, 3], [1, 2, 3]],
            classes: classes.to_vec(),
            id: ModuleId { row: 0, col: 0 },
            polygon_count: 2,
            ..LoadModule::default()
        };
        let mask = Importance::uniform(RECT, 1000);
        let dem = Dem::from_fn(RECT, |_| Some(0));
        let grid = ModuleGrid { rows: 1, cols: 1, side_cells: 8 };
        let ground = Reference { dem: &dem, mask: &mask, grid, spacing };
        let found = |features: &TileFeatures, classes| Bodies::of(features).lakes(&[module(classes)], &ground);
        assert_eq!(found(&lake_within(0, 128, 0), [2, 2]), [5, 0]);
        assert_eq!(found(&lake_within(0, 128, 0), [2, 0]), [0, 3200]);
        assert_eq!(found(&lake_within(0, 128, 5), [2, 2]), [5, 0]);
        assert_eq!(found(&TileFeatures::none(TileId { row: 0, col: 0 }), [2, 2]), [0, 0]);
    }

    #[test]
    fn shore_below_a_lake_is_counted_and_what_lies_farther_is_not() {
        let features = lake(50);
        let bodies = Bodies::of(&features);
        // The lake reaches from 1.5 to 6.5 posts: its shore are the posts of lines 1 and 7.
        assert_eq!(bodies.shore(&Dem::from_fn(RECT, |_| Some(51)), RECT), (24, 0));
        assert_eq!(bodies.shore(&Dem::from_fn(RECT, |post| Some(50 - i32::from(post.row == 1))), RECT), (24, 7));
        assert_eq!(bodies.shore(&Dem::from_fn(RECT, |post| (post.row != 1).then_some(0)), RECT), (17, 17));
        assert_eq!(bodies.lake_level(LatticePoint::new(24, 60)), Some(50));
        assert_eq!(bodies.lake_level(LatticePoint::new(23, 60)), None);
    }
}
