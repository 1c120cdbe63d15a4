//! What features came to, in the pieces that tiles need, and in the lines that people ask for.

use std::collections::{BTreeMap, BTreeSet, HashMap};

use crate::ground::{GamingArea, roadside_reach, waterside_reach};
use features::{
    Cost, Earthworks, Face, FeatureId, Formed, FormedEdge, Levelled, Limit, Middle, Place, Remark, Reserved, Role,
    Surface, Traits, Why,
};
use job::Job;
use store::{
    AreaLevel, FeatureAmounts, FeatureEnd, FeatureFace, FeatureLeftOut, FeatureLine, FeatureRemark, FeatureWhy,
};
use terrain::{
    FeatureSurface, Features, LATTICE_PER_POST, LatticePoint, LineTraits, ModuleGrid, ModuleId, PostRect, Side,
    SideSlope, SideSpan, SurfaceGround, TileFeatures, TileId, Vertex, WayLine,
};
use tin::load_modules::{Layout, cut_decks};
use tin::tiling::{outer_border_posts, outer_sides};

use crate::chains::chains;
use crate::earthworks;
use crate::read_features::ReadFeatures;
use crate::run::Run;
use crate::strips::{is_one_of, strips, whole_strips};

/// What features put into each tile, row-major.
pub(crate) fn pieces(run: &Run, features: &features::AreaFeatures, levelled: &Levelled) -> Vec<TileFeatures> {
    let formed = &levelled.reserved.formed;
    let steps = features.site.lattice.steps_per_post();
    let mut cutting = Cutting { area: &run.area, steps, classes: classes_of(run.job), pieces: Vec::new() };
    cutting.pieces = run.area.tiles.iter().map(|&tile| Piece::of(tile, steps)).collect();
    cutting.edges(formed);
    let whole = whole_strips(formed);
    cutting.surfaces(&formed.surfaces, true, &whole);
    cutting.surfaces(&formed.shaped, false, &BTreeSet::new());
    cutting.decks(&formed.decks);
    let spacing = run.area.frame.spacing;
    cutting.slopes(&levelled.roadsides, roadside_reach(spacing), |features| &mut features.slopes);
    cutting.slopes(&levelled.watersides, waterside_reach(spacing), |features| &mut features.watersides);
    cutting.lines(&formed.middles, &features.traits_by_id());
    let Cutting { area, pieces, .. } = cutting;
    pieces
        .into_iter()
        .map(|piece| {
            let rect = area.tiling.rect(piece.features.tile);
            piece.finish(rect)
        })
        .collect()
}

/// The job's number of each class of features.
fn classes_of(job: &Job) -> Vec<u8> {
    let names = job.class_names();
    let spec = job.features.as_ref().expect("a stage of jobs with features");
    let number = |class: &String| names.iter().position(|name| name == class).expect("a job has its features' classes");
    features::class_names(&spec.rules).iter().map(|class| number(class) as u8).collect()
}

/// A tile's features while they are put together.
struct Piece {
    features: TileFeatures,
    numbers: HashMap<Place, u32>,
    /// Rings of each body.
    bodies: Vec<Vec<FeatureSurface>>,
    /// The same of what is not in the TIN.
    shaped: Vec<Vec<FeatureSurface>>,
}

impl Piece {
    fn of(tile: TileId, steps: i32) -> Self {
        let kept = Features { steps_per_post: steps, ..Features::default() };
        let features = TileFeatures { kept, ..TileFeatures::none(tile) };
        let (numbers, bodies, shaped) = Default::default();
        Self { features, numbers, bodies, shaped }
    }

    fn vertex(&mut self, place: Place, height: i32) -> u32 {
        let vertices = &mut self.features.kept.vertices;
        *self.numbers.entry(place).or_insert_with(|| {
            vertices.push(vertex((place, height)));
            vertices.len() as u32 - 1
        })
    }

    /// In an order that depends on nothing but the content.
    fn finish(self, rect: PostRect) -> TileFeatures {
        let Self { mut features, bodies, shaped, .. } = self;
        (features.surfaces, features.shaped) = (in_order(bodies), in_order(shaped));
        features.decks.sort();
        features.decks = (0..).zip(features.decks).flat_map(|(body, deck)| with_body(vec![deck], body)).collect();
        features.slopes.sort_unstable();
        features.watersides.sort_unstable();
        features.lines.sort();
        features.kept.spans = spans(&features.surfaces, rect, features.kept.steps_per_post);
        features.kept = features.kept.canonical();
        features
    }
}

/// Rings of bodies, which are numbered in an order that depends on nothing but the content.
fn in_order(mut bodies: Vec<Vec<FeatureSurface>>) -> Vec<FeatureSurface> {
    bodies.iter_mut().for_each(|rings| rings.sort());
    bodies.sort();
    (0..).zip(bodies).flat_map(|(body, rings)| with_body(rings, body)).collect()
}

fn with_body(rings: Vec<FeatureSurface>, body: u32) -> impl Iterator<Item = FeatureSurface> {
    rings.into_iter().map(move |ring| FeatureSurface { body, ..ring })
}

fn vertex((place, height): (Place, i32)) -> Vertex {
    Vertex { at: LatticePoint::new(place.row, place.col), height }
}

struct Cutting<'a> {
    area: &'a GamingArea,
    steps: i32,
    classes: Vec<u8>,
    pieces: Vec<Piece>,
}

impl Cutting<'_> {
    /// The pieces of the tiles that touch a box of places, grown by `reach` steps.
    fn touching(&self, places: impl Iterator<Item = Place> + Clone, reach: i32) -> Vec<usize> {
        let side = self.steps * self.area.grid.side_cells;
        let span = |of: fn(&Place) -> i32, count: u32| {
            let all = places.clone();
            let low = all.clone().map(|place| of(&place)).min()? - reach;
            let high = all.map(|place| of(&place)).max()? + reach;
            // A place on a line touches the load modules on both sides of it.
            let (first, last) = ((low - 1).div_euclid(side).max(0), high.div_euclid(side).min(count as i32 - 1));
            (first <= last).then_some((first as u32, last as u32))
        };
        let grid = self.area.grid;
        let (Some(rows), Some(cols)) = (span(|place| place.row, grid.rows), span(|place| place.col, grid.cols)) else {
            return Vec::new();
        };
        let tile = |row, col| self.area.tiling.tile_of_module(ModuleId { row, col }, grid);
        let (low, high) = (tile(rows.0, cols.0), tile(rows.1, cols.1));
        let tiles = (low.row..=high.row).flat_map(|row| (low.col..=high.col).map(move |col| TileId { row, col }));
        tiles.map(|tile| self.area.tiling.index(tile)).collect()
    }

    /// Vertices and edges; those on a line between tiles go to all of them.
    fn edges(&mut self, formed: &Formed) {
        let inside = |place: Place| {
            let rect = self.area.rect;
            let within = |v: i32, low: i32, high: i32| low * self.steps <= v && v <= high * self.steps;
            within(place.row, rect.south, rect.north) && within(place.col, rect.west, rect.east)
        };
        let is_inside: Vec<bool> = formed.points.iter().map(|(place, _)| inside(*place)).collect();
        let used: BTreeSet<u32> = formed
            .edges
            .iter()
            .filter(|edge| is_inside[edge.a as usize] && is_inside[edge.b as usize])
            .flat_map(|edge| [edge.a, edge.b])
            .collect();
        for point in used {
            let (place, height) = formed.points[point as usize];
            for index in self.touching(std::iter::once(place), 0) {
                self.pieces[index].vertex(place, height);
            }
        }
        for edge in &formed.edges {
            let ends = [edge.a, edge.b].map(|point| formed.points[point as usize].0);
            for index in self.touching(ends.into_iter(), 0) {
                let piece = &mut self.pieces[index];
                let [Some(&a), Some(&b)] = ends.map(|end| piece.numbers.get(&end)) else { continue };
                piece.features.kept.edges.push([a, b]);
            }
        }
    }

    /// Ground that features cover, and whether its outline is in the TIN; `whole` are pieces of strips, uncut.
    fn surfaces(&mut self, surfaces: &[Surface], is_held: bool, whole: &BTreeSet<(u16, Vec<Place>)>) {
        let is_whole = |surface: &Surface| is_one_of(whole, surface);
        // Rings of one feature and role at one level are one body; strips are bodies of their own.
        let mut bodies: BTreeMap<(u16, Role, FeatureId, i32, usize), Vec<&Surface>> = BTreeMap::new();
        for (number, surface) in surfaces.iter().enumerate() {
            let level = if surface.role == Role::Shore { surface.ring[0].1 } else { 0 };
            let own = if surface.role == Role::Side { number } else { 0 };
            bodies.entry((surface.class, surface.role, surface.id, level, own)).or_default().push(surface);
        }
        for body in bodies.values() {
            let ground = match body[0].role {
                Role::Shore => SurfaceGround::Lake,
                Role::Bank => SurfaceGround::River,
                _ if is_whole(body[0]) => SurfaceGround::Strip,
                _ => SurfaceGround::Road,
            };
            let class = self.classes[usize::from(body[0].class)];
            let of = |surface: &&Surface| {
                let ring = surface.ring.iter().copied().map(vertex).collect();
                FeatureSurface { class, ground, body: 0, ring }
            };
            let rings: Vec<FeatureSurface> = body.iter().map(of).collect();
            // A shore lifts the ground within a post of it.
            let reach = if ground == SurfaceGround::Lake { self.steps } else { 0 };
            let touching = |ring: &&Surface| self.touching(ring.ring.iter().map(|(place, _)| *place), reach);
            // All that one ring touches have the whole body, so that bodies stand in one order everywhere and a post
            // on a line between tiles has the same bank nearest to it.
            let tiles: BTreeSet<usize> = body.iter().flat_map(touching).collect();
            for index in tiles {
                let Piece { bodies, shaped, .. } = &mut self.pieces[index];
                if is_held { bodies } else { shaped }.push(rings.clone());
            }
        }
    }

    fn decks(&mut self, decks: &[Face]) {
        for deck in decks {
            let class = self.classes[usize::from(deck.class)];
            let ring: Vec<Vertex> = deck.corners.iter().copied().map(vertex).collect();
            // Within a post of a deck the ground is cut.
            for index in self.touching(deck.corners.iter().map(|(place, _)| *place), 2 * self.steps) {
                let deck = FeatureSurface { class, ground: SurfaceGround::Road, body: 0, ring: ring.clone() };
                self.pieces[index].features.decks.push(deck);
            }
        }
    }

    /// Middle lines of ways, each for all tiles that it touches.
    fn lines(&mut self, middles: &[Middle], traits: &BTreeMap<FeatureId, Traits>) {
        for middle in middles {
            let class = self.classes[usize::from(middle.class)];
            let width = traits.get(&middle.id).map_or(0, |of| of.width.clamp(0, u16::MAX.into()) as u16);
            let traits = LineTraits { width, ..middle.traits };
            let vertices: Vec<Vertex> = middle.stations.iter().copied().map(vertex).collect();
            // A long line touches the box of many tiles; what touches none of its pieces is not given it.
            let pieces = middle.stations.windows(2);
            let tiles: BTreeSet<usize> =
                pieces.flat_map(|ends| self.touching(ends.iter().map(|(place, _)| *place), 0)).collect();
            for index in tiles {
                self.pieces[index].features.lines.push(WayLine { class, traits, vertices: vertices.clone() });
            }
        }
    }

    /// Edges of roads or pieces of water, for all tiles into which slopes may reach that go so many posts far.
    fn slopes(&mut self, slopes: &[SideSlope], posts: i32, of: fn(&mut TileFeatures) -> &mut Vec<SideSlope>) {
        for slope in slopes {
            let places = slope.ends.map(|end| Place::new(end.at.row, end.at.col));
            for index in self.touching(places.into_iter(), (posts + 1) * self.steps) {
                of(&mut self.pieces[index].features).push(*slope);
            }
        }
    }
}

/// Stretches of the sides of a tile that roads cover from edge to edge.
fn spans(surfaces: &[FeatureSurface], rect: PostRect, steps: i32) -> Vec<SideSpan> {
    let mut spans = Vec::new();
    for surface in surfaces.iter().filter(|surface| surface.ground.is_road()) {
        for side in Side::ALL {
            let on_side = |at: LatticePoint| match side {
                Side::South => (at.row == rect.south * steps).then_some(at.col),
                Side::North => (at.row == rect.north * steps).then_some(at.col),
                Side::West => (at.col == rect.west * steps).then_some(at.row),
                Side::East => (at.col == rect.east * steps).then_some(at.row),
            };
            let along = || surface.ring.iter().filter_map(|vertex| on_side(vertex.at));
            if let (Some(from), Some(to)) = (along().min(), along().max())
                && from < to
            {
                spans.push(SideSpan { side, from, to });
            }
        }
    }
    spans
}

/// What features take of each load module of the area, by its place and the class of the job, in ascending order.
pub(crate) fn cost_of(job: &Job, grid: ModuleGrid, cost: &Cost) -> Vec<(u32, u8, u32)> {
    let classes = classes_of(job);
    let mut all: Vec<(u32, u8, u32)> = Vec::new();
    for (&(row, col), of) in cost {
        let (Ok(row), Ok(col)) = (u32::try_from(row), u32::try_from(col)) else { continue };
        if row < grid.rows && col < grid.cols {
            let place = grid.index(ModuleId { row, col }) as u32;
            all.extend(of.iter().map(|(class, count)| (place, classes[usize::from(*class)], *count)));
        }
    }
    all.sort_unstable();
    all
}

/// What is told of the whole area.
pub(crate) fn area_level(run: &Run, read: &ReadFeatures, levelled: &Levelled) -> AreaLevel {
    let classes = classes_of(run.job);
    let told = |remark: &Remark| {
        let at_m = remark.posts.map(|[east, north]| {
            let metres = |posts: f64| posts * run.area.frame.spacing.metres();
            [run.area.frame.origin_east_m + metres(east), run.area.frame.origin_north_m + metres(north)]
        });
        FeatureRemark {
            feature: read.vectors.name(remark.id).to_owned(),
            at_m,
            found: remark.flaw.to_string(),
            done: remark.remedy.to_string(),
            leaves_out: remark.remedy.leaves_out(),
            degrades: remark.remedy.degrades(),
        }
    };
    let remarks = read.vectors.remarks.iter().cloned().chain(levelled.remarks.iter().map(told)).collect();
    let (formed, works, site) = (&levelled.reserved.formed, &levelled.earthworks, read.features.site);
    let to_metres = metres_of(run, read);
    let east_north = |place: Place| {
        let [east, north, _] = to_metres((place, 0));
        [east, north]
    };
    let (name, module_of) = (|id| read.vectors.name(id).to_owned(), |place| site.module_of(place));
    AreaLevel {
        tiles: Vec::new(),
        cost: cost_of(run.job, run.area.grid, &levelled.reserved.cost),
        reserved: Vec::new(),
        amounts: amounts(&levelled.reserved, &classes),
        left_out: left_out(run, read, &levelled.reserved, &classes),
        ends: ends(run, read, &levelled.reserved, &classes),
        lines: lines(run, read, (formed, works), &classes),
        strips: strips(&read.features, formed, &classes, run.area.rect),
        decks: decks(run, read, &formed.decks, &classes),
        earthworks: earthworks::by_class(works, &classes),
        moved: earthworks::by_module(works, run.area.grid, &classes),
        far_off: earthworks::far_off(works, (run.area.grid, &module_of), &classes, (name, east_north)),
        through_hills_m: levelled.through_hills as f64 / f64::from(terrain::QUANTA_PER_METRE),
        remarks,
        notes: read.table.notes.clone(),
    }
}

/// How much there is of each class of the job, and how much of it is in the ground.
fn amounts(reserved: &Reserved, classes: &[u8]) -> Vec<FeatureAmounts> {
    let metres = |quanta: i64| quanta as f64 / f64::from(terrain::QUANTA_PER_METRE);
    let amounts = reserved.amounts.iter().map(|(class, amounts)| FeatureAmounts {
        class: classes[usize::from(*class)],
        wanted_m: metres(amounts.wanted),
        kept_m: metres(amounts.kept),
        wide_m: amounts.wide.map(metres),
        is_main: amounts.is_main,
        lakes_wanted: amounts.lakes_wanted,
        lakes_kept: amounts.lakes_kept,
    });
    let mut amounts: Vec<FeatureAmounts> = amounts.collect();
    amounts.sort_by_key(|amounts| amounts.class);
    amounts
}

/// What is not in the ground, as people ask for it.
fn left_out(run: &Run, read: &ReadFeatures, reserved: &Reserved, classes: &[u8]) -> Vec<FeatureLeftOut> {
    let metres = metres_of(run, read);
    let why = |why: Why| match why {
        Why::Limit(Limit::Module(row, col)) => FeatureWhy::Module(row as u32, col as u32),
        Why::Limit(Limit::Window(row, col)) => FeatureWhy::Window(row as u32, col as u32),
        Why::Limit(Limit::Area) => FeatureWhy::Area,
        Why::Stub => FeatureWhy::Stub,
        Why::Alone | Why::Beyond => FeatureWhy::Alone,
        Why::Pond => FeatureWhy::Pond,
    };
    let left_out = reserved.left_out.iter().map(|left| FeatureLeftOut {
        feature: read.vectors.name(left.id).to_owned(),
        class: classes[usize::from(left.class)],
        why: why(left.why),
        length_m: left.length as f64 / f64::from(terrain::QUANTA_PER_METRE),
        lines: left.lines.iter().map(|line| line.iter().map(|&station| metres(station)).collect()).collect(),
    });
    left_out.collect()
}

/// Where what is in the ground ends although its source goes on.
fn ends(run: &Run, read: &ReadFeatures, reserved: &Reserved, classes: &[u8]) -> Vec<FeatureEnd> {
    let metres = metres_of(run, read);
    let ends = reserved.loose_ends.iter().map(|&(place, class, id)| {
        let [east, north, _] = metres((place, 0));
        FeatureEnd {
            feature: read.vectors.name(id).to_owned(),
            class: classes[usize::from(class)],
            at_m: [east, north],
        }
    });
    ends.collect()
}

/// The surfaces of bridges as people ask for them.
fn decks(run: &Run, read: &ReadFeatures, decks: &[Face], classes: &[u8]) -> Vec<FeatureFace> {
    let metres = metres_of(run, read);
    let face = |deck: &Face| FeatureFace {
        feature: read.vectors.name(deck.id).to_owned(),
        class: classes[usize::from(deck.class)],
        ring: deck.corners.iter().map(|&corner| metres(corner)).collect(),
    };
    decks.iter().map(face).collect()
}

/// Easting, northing and height of a place, in metres.
fn metres_of(run: &Run, read: &ReadFeatures) -> impl Fn((Place, i32)) -> [f64; 3] {
    let (lattice, frame) = (read.features.site.lattice, run.area.frame);
    move |(place, height)| {
        let [east, north] = lattice.posts_of(place).map(|posts| posts * frame.spacing.metres());
        [frame.origin_east_m + east, frame.origin_north_m + north, terrain::metres_of_quanta(height)]
    }
}

/// Triangles that features add to each load module, whatever else it holds, by its place: of the ground, and decks
/// with what raising them may add.
pub(crate) fn reserved(run: &Run, formed: &Formed, pieces: &[TileFeatures]) -> Vec<(u32, u32)> {
    let (area, job) = (&run.area, run.job);
    let steps_per_post = pieces.first().map_or(LATTICE_PER_POST, |piece| piece.kept.steps_per_post);
    let vertices = formed.points.iter().copied().map(vertex).collect();
    let kept = Features { steps_per_post, vertices, ..Features::default() };
    let mut border = outer_border_posts(area.rect, outer_sides(area.rect, area.rect), job.outer_step_cells());
    border.sort_unstable();
    let mut cost = terrain::limits::feature_cost(&kept, area.grid, &border);
    for piece in pieces.iter().filter(|piece| !piece.decks.is_empty()) {
        let modules = area.tiling.modules(piece.tile, area.grid);
        let layout = Layout { grid: area.grid, modules, spacing: area.frame.spacing };
        let decks = cut_decks(&piece.decks, piece.kept.steps_per_post, &layout);
        for (module, (_, most)) in modules.iter().zip(decks).filter(|(_, (decks, _))| !decks.is_empty()) {
            *cost.entry(module).or_insert(0) += most as u32;
        }
    }
    cost.into_iter().map(|(module, triangles)| (area.grid.index(module) as u32, triangles)).collect()
}

/// Edges as lines of their features.
fn lines(run: &Run, read: &ReadFeatures, (formed, works): (&Formed, &Earthworks), classes: &[u8]) -> Vec<FeatureLine> {
    let mut groups: BTreeMap<(FeatureId, Role, u16), Vec<&FormedEdge>> = BTreeMap::new();
    for edge in &formed.edges {
        groups.entry((edge.id, edge.role, edge.class)).or_default().push(edge);
    }
    let to_metres = metres_of(run, read);
    let metres = |point: u32| to_metres(formed.points[point as usize]);
    let traits = read.features.traits_by_id();
    let (mut lines, mut places) = (Vec::new(), Vec::new());
    for ((id, role, class), edges) in groups {
        let of = traits.get(&id);
        for chain in chains(&edges) {
            let moves = matches!(role, Role::Side | Role::Centre | Role::Channel);
            let of_chain = chain.iter().filter(|_| moves).map(|point| formed.points[*point as usize].0);
            places.push((id, class, of_chain.collect::<Vec<Place>>()));
            lines.push(FeatureLine {
                feature: read.vectors.name(id).to_owned(),
                class: classes[usize::from(class)],
                role,
                width_m: of.map_or(0.0, |of| terrain::metres_of_quanta(of.width)),
                grade_max_ppm: of.map_or(0, |of| of.grade_ppm),
                grade_most_ppm: of.map_or(0, |of| of.grade_most_ppm()),
                moved_m3: [0.0; 2],
                vertices: chain.into_iter().map(metres).collect(),
            });
        }
    }
    let moved = earthworks::by_line(&works.pieces, &places);
    lines.iter_mut().zip(moved).for_each(|(line, moved)| line.moved_m3 = moved);
    lines
}
