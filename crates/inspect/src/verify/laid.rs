//! What features put into a tile against its load modules as a simulator reads them: places, heights, edges, classes,
//! lakes, decks. Nothing here is shared with the code that makes them, so that a fault there is found here.

use std::collections::{BTreeMap, BTreeSet, HashMap, HashSet};

use build::ground::GamingArea;
use terrain::{FeatureSurface, Features, HOLE_CLASS, LatticePoint, SurfaceGround, TileFeatures, Vertex};

use super::deck::wrong_decks;
use super::modules::Modules;
use super::square::{At, Square, is_on, turn};

/// What features put into a tile.
pub(crate) struct Laid<'a> {
    pub area: &'a GamingArea,
    pub features: &'a TileFeatures,
    /// Edges that the build says its TIN lacks.
    pub told: &'a [[LatticePoint; 2]],
    /// The first class that no ground has but that of features.
    pub first_class: usize,
}

impl Laid<'_> {
    /// What is wrong with the load modules of the tile, a sentence for each load module and kind.
    pub fn problems(&self, modules: &Modules) -> Vec<String> {
        let kept = self.kept();
        let bodies = self.bodies();
        let shaped: BTreeSet<u8> = self.features.shaped.iter().map(|surface| surface.class).collect();
        let water = self.classes_of_lakes();
        let mut problems = Vec::new();
        for id in self.area.tiling.modules(self.features.tile, self.area.grid).iter() {
            let Some(module) = modules.get(&id) else { continue };
            let square = Square::of(&module);
            let found = [
                kept.lacking_vertex(&square),
                kept.lacking_edge(&square),
                wrong_class(&square, &bodies, &shaped, self.first_class),
                uneven(&square, &bodies, &kept),
                tilted_water(&square, &water),
                wrong_decks(&self.features.decks, &|place| self.at(place), &square),
            ];
            problems.extend(found.into_iter().flatten().map(|what| format!("load module {id}: {what}")));
        }
        problems.extend(bodies.iter().filter_map(|body| self.tilted(body, &bodies, &kept)));
        problems
    }

    /// Classes that lakes have and nothing else.
    fn classes_of_lakes(&self) -> BTreeSet<u8> {
        let all = || self.features.surfaces.iter().chain(&self.features.shaped);
        let of = |is_lake: bool| {
            let found = all().filter(move |surface| (surface.ground == SurfaceGround::Lake) == is_lake);
            found.map(|surface| surface.class).collect::<BTreeSet<u8>>()
        };
        of(true).difference(&of(false)).copied().filter(|class| self.first_class <= usize::from(*class)).collect()
    }

    /// Quanta between places of the features' lattice.
    pub fn step(&self) -> i64 {
        i64::from(self.area.frame.spacing.quanta_per_post()) / i64::from(self.features.kept.steps_per_post)
    }

    pub fn at(&self, place: LatticePoint) -> At {
        (i64::from(place.row) * self.step(), i64::from(place.col) * self.step())
    }

    fn kept(&self) -> Kept {
        let Features { vertices, edges, .. } = &self.features.kept;
        let told: HashSet<[LatticePoint; 2]> = self.told.iter().flat_map(|&[a, b]| [[a, b], [b, a]]).collect();
        let ends = |edge: &[u32; 2]| edge.map(|end| vertices[end as usize].at);
        let edges = edges.iter().map(ends).filter(|edge| !told.contains(edge)).map(|edge| edge.map(|end| self.at(end)));
        Kept {
            heights: vertices.iter().map(|vertex| (self.at(vertex.at), vertex.height)).collect(),
            edges: edges.collect(),
        }
    }

    fn bodies(&self) -> Vec<Body> {
        let same = |a: &FeatureSurface, b: &FeatureSurface| (a.class, a.ground, a.body) == (b.class, b.ground, b.body);
        self.features.surfaces.chunk_by(same).map(|of| Body::of(of, |at| self.at(at))).collect()
    }

    /// A lake whose shore has another height than most of it, where no other feature gives it one.
    fn tilted(&self, lake: &Body, bodies: &[Body], kept: &Kept) -> Option<String> {
        let level = lake.level()?;
        let own: HashSet<[At; 2]> = lake.edges().flat_map(|[a, b]| [[a, b], [b, a]]).collect();
        let edges = kept.edges.iter().filter(|edge| !own.contains(*edge)).flatten().copied();
        // Roads may share edges with a shore, and so may other water.
        let roads = self.features.slopes.iter().flat_map(|slope| slope.ends).map(|vertex| self.at(vertex.at));
        let rings =
            bodies.iter().filter(|body| !std::ptr::eq(*body, lake)).flat_map(|body| body.rings.iter().flatten());
        let others: HashSet<At> = edges.chain(roads).chain(rings.map(|(at, _)| *at)).collect();
        let ring = lake.rings.iter().flatten();
        let found = ring.filter_map(|(at, height)| {
            let stands = kept.heights.get(at).filter(|_| !others.contains(at)).unwrap_or(height);
            (*height != level || *stands != level).then_some((at, if *height == level { stands } else { height }))
        });
        let (at, height) = found.min()?;
        let [found, expected] = [*height, level].map(terrain::metres_of_quanta);
        let (tile, place) = (self.features.tile, place_text(self.area, *at));
        Some(format!("survey/{tile}.lines: a lake is not level: {found} m {place}, and {expected} m along its shore"))
    }
}

/// A place as people ask for it.
pub(crate) fn place_text(area: &GamingArea, (north, east): At) -> String {
    let metres = |origin: f64, quanta: i64| origin + quanta as f64 / f64::from(terrain::QUANTA_PER_METRE);
    let (east, north) = (metres(area.frame.origin_east_m, east), metres(area.frame.origin_north_m, north));
    format!("at {east:.1} m east, {north:.1} m north")
}

/// Vertices and edges that the TIN has to keep, but for edges that it is told to lack.
struct Kept {
    heights: HashMap<At, i32>,
    edges: Vec<[At; 2]>,
}

impl Kept {
    fn lacking_vertex(&self, square: &Square) -> Option<String> {
        let mut wrong: Vec<(At, i32)> = self
            .heights
            .iter()
            .filter(|(at, height)| square.holds(**at) && square.heights.get(*at) != Some(*height))
            .map(|(at, height)| (*at, *height))
            .collect();
        wrong.sort_unstable();
        let (at, height) = wrong.first()?;
        let [expected, here] =
            [Some(*height), square.heights.get(at).copied()].map(|of| of.map(terrain::metres_of_quanta));
        let found = here.map_or("none".to_owned(), |height| format!("one at {height} m"));
        let (expected, count) = (expected.unwrap_or_default(), wrong.len());
        Some(format!(
            "{count} vertices of roads or water are not as decided, the first: expected {expected} m, found {found}"
        ))
    }

    fn lacking_edge(&self, square: &Square) -> Option<String> {
        let is_there = |&[a, b]: &[At; 2]| {
            let mut between: Vec<At> = square.heights.keys().copied().filter(|&at| is_on(a, b, at)).collect();
            between.sort_unstable();
            between.windows(2).all(|pair| square.edges.contains(&[pair[0], pair[1]])) && 2 <= between.len()
        };
        let own = self.edges.iter().filter(|edge| edge.iter().all(|end| square.holds(*end)));
        let lacking = own.filter(|edge| !is_there(edge)).count();
        (0 < lacking).then(|| format!("lacks {lacking} edges of roads or water that nothing tells of"))
    }
}

/// Ground of features.
struct Body {
    class: u8,
    is_lake: bool,
    rings: Vec<Vec<(At, i32)>>,
    /// South, west, north, east.
    reach: [i64; 4],
}

impl Body {
    fn of(surfaces: &[FeatureSurface], at: impl Fn(LatticePoint) -> At) -> Self {
        let corner = |vertex: &Vertex| (at(vertex.at), vertex.height);
        let rings: Vec<Vec<(At, i32)>> =
            surfaces.iter().map(|surface| surface.ring.iter().map(corner).collect()).collect();
        let mut reach = [i64::MAX, i64::MAX, i64::MIN, i64::MIN];
        for ((y, x), _) in rings.iter().flatten() {
            reach = [reach[0].min(*y), reach[1].min(*x), reach[2].max(*y), reach[3].max(*x)];
        }
        Self { class: surfaces[0].class, is_lake: surfaces[0].ground == SurfaceGround::Lake, rings, reach }
    }

    /// The height that most of a lake's shore has.
    fn level(&self) -> Option<i32> {
        let mut counts: BTreeMap<i32, usize> = BTreeMap::new();
        self.rings.iter().flatten().for_each(|(_, height)| *counts.entry(*height).or_default() += 1);
        let most = counts.into_iter().max_by_key(|(height, count)| (*count, -i64::from(*height)));
        most.filter(|_| self.is_lake).map(|(height, _)| height)
    }

    fn edges(&self) -> impl Iterator<Item = [At; 2]> + '_ {
        let of_ring = |ring: &'_ Vec<(At, i32)>| -> Vec<[At; 2]> {
            (0..ring.len()).map(|at| [ring[at].0, ring[(at + 1) % ring.len()].0]).collect()
        };
        self.rings.iter().flat_map(of_ring)
    }

    /// Whether a line from the centre of a triangle to the east crosses its rings an odd number of times. An edge
    /// has its southern end and not its northern one.
    fn holds_centre(&self, corners: [At; 3]) -> bool {
        let centre = corners.iter().fold((0, 0), |sum, corner| (sum.0 + corner.0, sum.1 + corner.1));
        let [south, west, north, east] = self.reach.map(|line| 3 * line);
        if centre.0 < south || north < centre.0 || centre.1 < west || east < centre.1 {
            return false;
        }
        let thrice = |(y, x): At| (3 * y, 3 * x);
        let crosses = |[a, b]: &[At; 2]| {
            let (low, high) = (thrice(*a.min(b)), thrice(*a.max(b)));
            low.0 <= centre.0 && centre.0 < high.0 && 0 < turn(low, high, centre)
        };
        self.edges().filter(crosses).count() % 2 == 1
    }
}

/// The first body that each triangle lies in, of those that reach a load module.
fn bodies_under<'a>(square: &Square, bodies: &'a [Body]) -> Vec<Option<&'a Body>> {
    let [south, west, north, east] = square.reach();
    let near: Vec<&Body> = bodies
        .iter()
        .filter(|body| {
            body.reach[0] <= north && south <= body.reach[2] && body.reach[1] <= east && west <= body.reach[3]
        })
        .collect();
    let under = |triangle: &[u16; 3]| {
        let corners = square.corners(triangle);
        near.iter().find(|body| body.holds_centre(corners)).copied()
    };
    square.module.triangles.iter().map(under).collect()
}

fn wrong_class(square: &Square, bodies: &[Body], shaped: &BTreeSet<u8>, first_class: usize) -> Option<String> {
    let under = bodies_under(square, bodies);
    let is_level =
        |triangle: &[u16; 3], level: i32| triangle.iter().all(|v| square.module.vertices[usize::from(*v)].z == level);
    // Of a lake only what is level is water: what a road tilts is its bank.
    let is_wrong = |((class, triangle), body): &((&u8, &[u16; 3]), &Option<&Body>)| match body {
        _ if **class == HOLE_CLASS => false,
        Some(body) if body.level().is_none_or(|level| is_level(triangle, level)) => **class != body.class,
        Some(body) if **class == body.class => true,
        // What is not in the TIN may cover most of a triangle.
        _ => first_class <= usize::from(**class) && !shaped.contains(*class),
    };
    let of_triangles = square.module.classes.iter().zip(&square.module.triangles);
    let wrong = of_triangles.zip(&under).filter(is_wrong).count();
    (0 < wrong).then(|| format!("{wrong} triangles have not the class of the road or water under them"))
}

/// Water in a load module whose corners differ in height, whatever else is there.
fn tilted_water(square: &Square, water: &BTreeSet<u8>) -> Option<String> {
    let z = |v: u16| square.module.vertices[usize::from(v)].z;
    let of_triangles = square.module.triangles.iter().zip(&square.module.classes);
    let is_tilted =
        |(triangle, class): &(&[u16; 3], &u8)| water.contains(class) && triangle.map(z) != [z(triangle[0]); 3];
    let tilted = of_triangles.filter(is_tilted).count();
    (0 < tilted).then(|| format!("{tilted} triangles of water are not level"))
}

/// A lake in a load module with a vertex that is not on its level, and is no other feature's.
fn uneven(square: &Square, bodies: &[Body], kept: &Kept) -> Option<String> {
    let lakes: BTreeSet<usize> = (0..bodies.len()).filter(|&at| bodies[at].is_lake).collect();
    if lakes.is_empty() {
        return None;
    }
    let under = bodies_under(square, bodies);
    let is_uneven = |(triangle, body): (&[u16; 3], &Option<&Body>)| {
        let Some(level) = body.and_then(Body::level) else { return false };
        let corner = |v: &u16| {
            let vertex = square.module.vertices[usize::from(*v)];
            vertex.z != level && !kept.heights.contains_key(&square.at(vertex.y, vertex.x))
        };
        triangle.iter().any(corner)
    };
    let uneven = square.module.triangles.iter().zip(&under).any(is_uneven);
    uneven.then(|| "a lake in it is not level".to_owned())
}
