//! What tiles are made from beside their ground, taken apart field by field: a new field does not compile until it is
//! decided whether it counts.

use crate::ground::{GamingArea, Surroundings, Window, feed_post};
use features::objects::{ObjectLimits, Plan};
use features::{AreaFeatures, Clearances, FallOptions, GradeOptions, Outline, Place, Sounded};
use job::{Borders, ClipHeights, Edges, FeaturesSpec, Job, LodBorder, LodSpec, ModulesSpec, ObjectsSpec, OuterBorder};
use store::engine::{Fingerprint, FingerprintBuilder, Key, Part, Stamp};
use store::{Building, SourceRecord};
use terrain::limits::Allowance;
use terrain::{
    FeatureSurface, Features, LastBatch, LatticePoint, LineForm, LineKind, LineStorey, LineTraits, ModuleGrid,
    ModuleId, ModuleRect, Objects, SeamSides, Side, SideSpan, SurfaceGround, TileFeatures, Vertex, WayLine,
};
use tin::tiling::Budget;
use tin::{CostUnit, Frame, Proximity, Rule, Stop, SurveyTask, TileTask};

use crate::left_out::LeftOut;
use crate::refinement::{Most, Refinement};
use crate::run::Run;
use crate::tile_objects::TileObjects;

/// What the published TIN of a tile was made from, by the tile's place.
pub(crate) type StampOf<'a> = dyn Fn(usize) -> Stamp + Sync + 'a;

/// What the job says of selecting and optimising, and the places of a tile's border.
const RULES: Part = Part { name: "rules", changed: "what the job says of selecting changed" };
/// What a tile may spend.
const ALLOWANCE: Part = Part { name: "allowance", changed: "its allowance moved" };
/// The border points that it inherits.
const BORDERS: Part = Part { name: "borders", changed: "a neighbour's border changed" };
/// The ground that lies within sight of it.
const SIGHT: Part = Part { name: "sight", changed: "ground within sight changed" };
/// How load modules are cut.
const CUT: Part = Part { name: "cut", changed: "how load modules are cut changed" };
/// The TINs that load modules are cut from.
const TINS: Part = Part { name: "tins", changed: "a TIN changed" };
/// What roads, rivers and lakes put into it.
const LEFT_OUT: Part = Part { name: "left out", changed: "what coarser levels leave out changed" };
pub(crate) const FEATURES: Part = Part { name: "features", changed: "roads, rivers or lakes in it changed" };
/// The middle lines of ways, in the ground or not.
const LINES: Part = Part { name: "lines", changed: "lines of roads or rivers in it changed" };
/// What stands on the ground.
const OBJECTS: Part = Part { name: "objects", changed: "buildings, walls or woods in it changed" };
/// Buildings, which are drawn only.
const BUILDINGS: Part = Part { name: "buildings", changed: "buildings changed" };
/// The ground along features.
const PROFILES: Part = Part { name: "profiles", changed: "the ground along roads, rivers or lakes changed" };
/// The load modules that were measured.
const MODULES: Part = Part { name: "modules", changed: "the load modules changed" };
/// How they are measured.
const MEASURE: Part = Part { name: "measure", changed: "what is measured changed" };

/// Of what stands on the ground of an area: what the job says of it, where the area lies, the files, what woods leave
/// free, and limits that are not the job's own.
pub(crate) fn outlines(
    job: &Job,
    spec: &ObjectsSpec,
    records: &[SourceRecord],
    (free, limits): (&[Plan], Option<&ObjectLimits>),
) -> Key {
    let is_ours = |record: &&SourceRecord| spec.sources.iter().any(|source| source.file.written == record.path);
    let files: Vec<Fingerprint> = records.iter().filter(is_ours).map(|record| record.blake3).collect();
    let settings: Vec<String> = job
        .describe()
        .into_iter()
        .filter(|setting| setting.key.starts_with("objects."))
        .map(|setting| setting.value)
        .collect();
    let ModuleGrid { rows, cols, side_cells } = job.area.grid;
    Key::new("outlines").part(OBJECTS, |part| {
        let part = part.list(settings.iter(), |part, value| part.text(value));
        let part = part.list(files.into_iter(), FingerprintBuilder::fingerprint);
        let part = part.number(job.area.epsg.into()).number(job.area.spacing.sixteenths().into());
        let part = job.area.origin_m.into_iter().fold(part, FingerprintBuilder::real);
        let part = part.number(rows.into()).number(cols.into()).signed(side_cells.into());
        let part = part.list(free.iter(), |part, plan| {
            part.list(plan.iter(), |part, ring| {
                part.list(ring.iter(), |part, [east, north]| part.signed((*east).into()).signed((*north).into()))
            })
        });
        limits.into_iter().fold(part, |part, limits| {
            let ObjectLimits { modules, windows, area, size: _, window: _ } = limits;
            let each = |part: FingerprintBuilder, most: &u32| part.number((*most).into());
            part.list(modules.iter(), each).list(windows.iter(), each).number(*area)
        })
    })
}

/// Of the buildings of an area.
pub(crate) fn buildings(all: &[Building]) -> Key {
    let corner =
        |part: FingerprintBuilder, [east, north]: &[i32; 2]| part.signed((*east).into()).signed((*north).into());
    Key::new("buildings").part(BUILDINGS, |part| {
        part.list(all.iter(), |part, Building { rings, bottom, top }| {
            let part = part.list(rings.iter(), |part, ring| part.list(ring.iter(), corner));
            part.signed((*bottom).into()).signed((*top).into())
        })
    })
}

/// Of a tile's TIN.
pub(crate) fn tin(
    window: &Window,
    refinement: &Refinement,
    within_sight: Option<&Surroundings>,
    seeds: &[Vertex],
) -> Key {
    let key = window
        .key("tile")
        .part(RULES, |part| feed_rules(part, refinement))
        .part(ALLOWANCE, |part| feed_allowance(part, &refinement.task))
        .part(BORDERS, |part| part.list(seeds.iter(), feed_vertex));
    let key = match within_sight {
        None => key,
        Some(around) => key.part(SIGHT, |part| part.rows(around.rows(), i32::to_le_bytes)),
    };
    // Tiles without features keep the keys they had before there were any.
    match refinement.features.kept.is_empty() {
        true => key,
        false => key.part(FEATURES, |part| feed_kept(part, refinement)),
    }
}

fn feed_kept(builder: FingerprintBuilder, refinement: &Refinement) -> FingerprintBuilder {
    let features = &refinement.features;
    let lakes: Vec<_> = features.bodies().filter(|rings| rings[0].ground == SurfaceGround::Lake).collect();
    feed_features(builder, &features.kept).list(lakes.into_iter(), |builder, rings| {
        builder.list(rings.iter(), |builder, surface| builder.list(surface.ring.iter(), feed_vertex))
    })
}

/// Of the ground along the features of a tile.
pub(crate) fn profile(
    window: &Window,
    steps: i32,
    stations: impl ExactSizeIterator<Item = Place>,
    beds: impl ExactSizeIterator<Item = Place>,
    basins: &[(u32, &Outline)],
) -> Key {
    let feed_place = |part: FingerprintBuilder, Place { row, col }: Place| part.signed(row.into()).signed(col.into());
    window.key("profile").part(FEATURES, |part| {
        let part = part.signed(steps.into()).list(stations, feed_place).list(beds, feed_place);
        part.list(basins.iter(), |part, (number, outline)| {
            part.number((*number).into())
                .list(outline.rings.iter(), |part, ring| part.list(ring.places.iter().copied(), feed_place))
        })
    })
}

/// Of what features of the area come to: where they run, the ground there, and what they may take.
pub(crate) fn level(
    job: &Job,
    budget: &Budget,
    records: &[SourceRecord],
    (features, notes): (&AreaFeatures, &[String]),
    sounded: Sounded,
) -> Key {
    let Budget { grid, border_step, per_module, pool: _, area, per_window, windows, reserved: _ } = budget;
    let ModuleGrid { rows, cols, side_cells } = *grid;
    // What sources and rules come to is in the features; the names of features are those of the files.
    let spec = job.features.as_ref().expect("a stage of jobs with features");
    let FeaturesSpec { share_main, share_max, options, falls, .. } = spec;
    let GradeOptions { clearances, bank, cut_max, fill_max, clip, smooth_milliposts } = *options;
    let Clearances { road, rail, water } = clearances;
    let FallOptions { tau, carve_max, tilt, cut_max: _, fill_max: _ } = *falls;
    let files = spec.files();
    let files = records.iter().filter(|record| files.iter().any(|file| file.written == record.path));
    let files: Vec<Fingerprint> = files.map(|record| record.blake3).collect();
    let mut words = Vec::new();
    features.feed(&mut |word| words.push(word));
    Key::new("level")
        .part(RULES, |part| {
            let part = part.list(job.class_names().iter(), |part, name| part.text(name));
            let part = part.number(LEVEL_REVISION).real(*share_main).real(*share_max);
            let quanta = [road, rail, water, bank, cut_max, fill_max, clip];
            let part = quanta.into_iter().fold(part, |part, quanta| part.signed(quanta.into()));
            let part = part.maybe(smooth_milliposts, |part, thousandths| part.number(thousandths.into()));
            part.number(tau.into()).signed(carve_max.into()).case(tilt.into())
        })
        .part(ALLOWANCE, |part| {
            let part = part.number(rows.into()).number(cols.into()).signed(side_cells.into());
            let part = part.signed((*border_step).into()).number((*per_module).into()).number(*area);
            part.number((*per_window).into()).number(windows.rows.into()).number(windows.cols.into())
        })
        .part(FEATURES, |part| {
            let part = part.list(files.into_iter(), FingerprintBuilder::fingerprint);
            let part = part.list(notes.iter(), |part, note| part.text(note));
            part.rows(std::iter::once(&words[..]), i64::to_le_bytes)
        })
        .part(PROFILES, |part| {
            let Sounded { heights, middles, inside } = sounded;
            let feed = |part: FingerprintBuilder, height: &Option<i32>| {
                part.maybe(*height, |part, height| part.signed(height.into()))
            };
            part.list(heights.iter(), feed).list(middles.iter(), feed).list(inside.iter(), |part, of| {
                part.list(of.iter(), |part, (height, count)| part.signed((*height).into()).number((*count).into()))
            })
        })
}

/// Rises whenever the same features may come to something else, or are written otherwise.
const LEVEL_REVISION: u64 = 4;

fn feed_features(builder: FingerprintBuilder, features: &Features) -> FingerprintBuilder {
    let Features { steps_per_post, vertices, edges, spans } = features;
    let builder = builder.signed((*steps_per_post).into()).list(vertices.iter(), feed_vertex);
    let builder = builder.list(edges.iter(), |builder, [a, b]| builder.number((*a).into()).number((*b).into()));
    builder.list(spans.iter(), |builder, SideSpan { side, from, to }| {
        let side = Side::ALL.iter().position(|other| other == side).unwrap_or(0) as u8;
        builder.case(side).signed((*from).into()).signed((*to).into())
    })
}

/// Classes of the ground inside features, and decks above it; their edges are in the TIN.
fn feed_surfaces(builder: FingerprintBuilder, features: &TileFeatures) -> FingerprintBuilder {
    let TileFeatures { tile: _, kept: _, surfaces, shaped, slopes: _, watersides: _, decks, lines: _ } = features;
    let feed = |builder: FingerprintBuilder, surface: &FeatureSurface| {
        let FeatureSurface { class, ground, body, ring } = surface;
        let ground = match ground {
            SurfaceGround::Road => 0,
            SurfaceGround::Lake => 1,
            SurfaceGround::River => 2,
            SurfaceGround::Strip => 3,
        };
        builder.case(*class).case(ground).number((*body).into()).list(ring.iter(), feed_vertex)
    };
    builder.list(surfaces.iter(), feed).list(shaped.iter(), feed).list(decks.iter(), feed)
}

/// Whether load modules have lines of ways, which they do from version 3 of the format on.
pub(crate) fn have_lines(job: &Job) -> bool {
    3 <= job.modules.format
}

/// Whether a line is that of a bridge with a deck, which ends where the line does.
pub(crate) fn has_deck(traits: &LineTraits) -> bool {
    traits.storey == LineStorey::Bridge && traits.is_kept
}

fn feed_line(builder: FingerprintBuilder, line: &WayLine) -> FingerprintBuilder {
    let WayLine { class, traits: LineTraits { kind, form, storey, is_kept, is_in_ground, width }, vertices } = line;
    let kind = match kind {
        LineKind::Travelled => 0,
        LineKind::Channel => 1,
        LineKind::Breakline => 2,
    };
    let form = match form {
        LineForm::Nothing => 0,
        LineForm::Line => 1,
        LineForm::Strip => 2,
        LineForm::Bench => 3,
    };
    let storey = match storey {
        LineStorey::Ground => 0,
        LineStorey::Bridge => 1,
        LineStorey::Tunnel => 2,
    };
    let builder = builder.case(*class).case(kind).case(form).case(storey);
    let builder = builder.case((*is_kept).into()).case((*is_in_ground).into()).number((*width).into());
    builder.list(vertices.iter(), feed_vertex)
}

/// What the job says of selecting and optimising in a tile, as its record names it.
pub fn rules(refinement: &Refinement) -> String {
    let key = Key::new("tile").part(RULES, |part| feed_rules(part, refinement));
    key.parts().remove(RULES.name).unwrap_or_default()
}

/// What features put into a tile's TIN, as its record names it; nothing of a tile without any.
pub fn kept_features(refinement: &Refinement) -> Option<String> {
    let key = Key::new("tile").part(FEATURES, |part| feed_kept(part, refinement));
    key.parts().remove(FEATURES.name).filter(|_| !refinement.features.kept.is_empty())
}

/// Of a tile's gain curve.
pub(crate) fn curve(window: &Window, task: &SurveyTask) -> Key {
    let SurveyTask { growth, owned, grid, cost, counts_left } = task;
    let ModuleGrid { rows, cols, side_cells } = *grid;
    let unit = match (cost, counts_left) {
        (CostUnit::Triangles, true) => 0,
        (CostUnit::Points, true) => 1,
        (CostUnit::Triangles, false) => 2,
        (CostUnit::Points, false) => 3,
    };
    window
        .key("survey")
        .part(RULES, |part| {
            let part = feed_sides(feed_growth(part, growth), *owned).case(unit);
            part.number(rows.into()).number(cols.into()).signed(side_cells.into())
        })
        .part(ALLOWANCE, |part| feed_allowance(part, growth))
}

/// Of a tile's load modules, from TINs without the points that `removed` lists per tile.
pub fn modules(
    (job, area): (&Job, &GamingArea),
    stamps: &StampOf,
    removed: &[Vec<LatticePoint>],
    (features, left_out): (&TileFeatures, Option<&LeftOut>),
    objects: Option<&TileObjects>,
) -> Key {
    let tile = features.tile;
    let mut reach = match job.modules.edges {
        Edges::Constrained => Vec::new(),
        Edges::Clip(_) => area.tiling.neighbours(tile),
    };
    reach.push(tile);
    let places: Vec<usize> = reach.into_iter().map(|other| area.tiling.index(other)).collect();
    let key = Key::new("modules")
        .part(CUT, |part| {
            let part = feed_modules(part, &job.modules);
            part.maybe((1 < job.lod.level_count()).then_some(&job.lod), feed_levels)
        })
        .part(TINS, |part| {
            part.list(places.into_iter(), |part, place| {
                part.fingerprint(stamps(place).fingerprint).list(removed[place].iter(), feed_point)
            })
        });
    // Load modules without features keep the keys they had before there were any.
    let key = match features.surfaces.is_empty() && features.shaped.is_empty() && features.decks.is_empty() {
        true => key,
        false => key.part(FEATURES, |part| feed_surfaces(part, features)),
    };
    // Decks are lifted by lines of bridges, whatever load modules have.
    let is_needed = |line: &&WayLine| have_lines(job) || has_deck(&line.traits);
    let lines: Vec<&WayLine> = features.lines.iter().filter(is_needed).collect();
    let key = if lines.is_empty() { key } else { key.part(LINES, |part| part.list(lines.into_iter(), feed_line)) };
    let key = match objects.filter(|objects| objects.own.iter().any(|objects| !objects.is_empty())) {
        None => key,
        Some(objects) => key.part(OBJECTS, |part| feed_objects(part, objects, stamps)),
    };
    // What levels leave out is told by the classes of edges, which the TIN does not say.
    match left_out {
        None => key,
        Some(left_out) => key.part(LEFT_OUT, |part| left_out.feed(part, &features.kept, area.frame.spacing)),
    }
}

/// What stands on a tile's load modules, and the ground of other tiles under it.
fn feed_objects(builder: FingerprintBuilder, objects: &TileObjects, stamps: &StampOf) -> FingerprintBuilder {
    let TileObjects { own, beside } = objects;
    let builder = builder
        .list(own.iter(), |builder, objects| builder.rows(std::iter::once(&objects.to_part()[..]), |byte| [byte]));
    builder.list(beside.iter(), |builder, (place, pieces)| {
        let builder = builder.fingerprint(stamps(*place).fingerprint);
        builder.list(pieces.iter(), |builder, (module, prism)| {
            let alone = Objects { prisms: vec![prism.clone()], canopies: Vec::new() };
            let builder = builder.number(module.row.into()).number(module.col.into());
            builder.rows(std::iter::once(&alone.to_part()[..]), |byte| [byte])
        })
    })
}

/// Of what was measured of a tile's load modules.
pub(crate) fn measured(run: &Run, modules: Fingerprint) -> Key {
    let is_regular = match run.job.tiles.borders {
        Borders::Inherit => 0,
        Borders::Regular => 1,
    };
    // Beside the ground of the tile's own window, which its TIN is made from.
    let is_beside = run.ground.relief.has_posts_between() || run.burns_in();
    // What features change of a tile is in its load modules.
    let files = run.job.features.as_ref().map(FeaturesSpec::files).unwrap_or_default();
    let objects = run.job.objects.iter().flat_map(|objects| &objects.sources).map(|source| &source.file);
    let files: Vec<_> = files.into_iter().chain(objects).collect();
    let is_of_ground = |record: &&SourceRecord| !files.iter().any(|file| file.written == record.path);
    let beside: Vec<&SourceRecord> = run.records.iter().filter(|record| is_beside && is_of_ground(record)).collect();
    Key::new("measured").known(MODULES, modules).part(MEASURE, |part| {
        let part = part.number(run.job.class_names().len() as u64).case(is_regular);
        part.list(beside.iter(), |part, record| part.fingerprint(record.blake3))
    })
}

fn feed_rules(builder: FingerprintBuilder, refinement: &Refinement) -> FingerprintBuilder {
    let Refinement { task, optimising, most, features: _, spacing: _ } = refinement;
    let builder = feed_growth(builder, task).list(task.kept.iter(), feed_post);
    let builder = builder.maybe(*optimising, |builder, optimising| {
        let job::Optimising { effort, height_fit, lattice, sight } = optimising;
        let effort = match effort {
            job::Effort::Fast => 0,
            job::Effort::Normal => 1,
            job::Effort::Best => 2,
        };
        let height_fit = match height_fit {
            job::HeightFit::Squares => 0,
            job::HeightFit::Off => 2,
        };
        let lattice = match lattice {
            job::Lattice::Eighth => 0,
            job::Lattice::Post => 1,
        };
        let builder = builder.case(effort).case(height_fit).case(lattice);
        builder.maybe(sight, |builder, job::Sight { eyes_quanta, range_quanta }| {
            let [lowest, highest] = eyes_quanta;
            [lowest, highest, range_quanta].into_iter().fold(builder, |builder, word| builder.signed(word.into()))
        })
    });
    match most {
        Most::AsTask => builder.case(0),
        Most::Triangles(triangles) => builder.case(1).number(*triangles as u64),
    }
}

/// What tiles have in common. What one inherits and starts from is fed as its borders and with its window.
fn feed_growth(builder: FingerprintBuilder, task: &TileTask) -> FingerprintBuilder {
    let TileTask { tile: _, rect: _, frame: _, border, inherited: _, kept: _, start: _, seams, barred, rule, stop } =
        task;
    let Stop { points: _, value, rms_quanta: _ } = stop;
    let builder = match rule {
        Rule::WorstFirst => builder.case(0),
        Rule::LargestSquares { guard } => builder.case(1).maybe(*guard, FingerprintBuilder::number),
        Rule::Batches { residual_quantum, proximity, last_batch } => {
            let last_batch = match last_batch {
                LastBatch::Truncate => 0,
                LastBatch::Finish => 1,
            };
            let builder = builder.case(2).number((*residual_quantum).into()).case(last_batch);
            builder.maybe(*proximity, |builder, Proximity { posts, quanta }| builder.real(posts).number(quanta.into()))
        }
    };
    let builder = feed_sides(builder.maybe(*value, FingerprintBuilder::number), *seams).list(border.iter(), feed_post);
    // Tiles without features keep the keys they had before there were any.
    if barred.is_empty() { builder } else { builder.list(barred.iter(), feed_post) }
}

fn feed_allowance(builder: FingerprintBuilder, task: &TileTask) -> FingerprintBuilder {
    let Stop { points, value: _, rms_quanta } = task.stop;
    let builder = builder.maybe(points, |builder, points| builder.number(points as u64));
    let builder = builder.maybe(rms_quanta, FingerprintBuilder::real);
    match &task.frame {
        Frame::Plain => builder.case(0),
        Frame::Corners { side_cells } => builder.case(1).signed((*side_cells).into()),
        Frame::Sides { side_cells, south_west: ModuleId { row, col }, allowance } => {
            let Allowance { modules, module_room, windows, window_size: (high, wide), window_room, triangles } =
                allowance;
            let builder = builder.case(2).signed((*side_cells).into()).number((*row).into()).number((*col).into());
            let builder = feed_module_rect(feed_module_rect(builder, *modules), *windows);
            let builder = builder.number((*high).into()).number((*wide).into()).number((*triangles).into());
            builder.rows([&module_room[..], &window_room[..]].into_iter(), u32::to_le_bytes)
        }
    }
}

fn feed_modules(builder: FingerprintBuilder, modules: &ModulesSpec) -> FingerprintBuilder {
    let ModulesSpec { side_m, side_quanta, border_step_m, border_step_cells, outer_border, edges, format: _ } = modules;
    let outer_border = match outer_border {
        OuterBorder::Refined => 0,
        OuterBorder::Fixed => 1,
    };
    let edges = match edges {
        Edges::Constrained => 0,
        Edges::Clip(ClipHeights::Coplanar) => 1,
        Edges::Clip(ClipHeights::Dem) => 2,
    };
    let builder = builder.real(*side_m).number((*side_quanta).into()).real(*border_step_m);
    builder.signed((*border_step_cells).into()).case(outer_border).case(edges)
}

fn feed_levels(builder: FingerprintBuilder, lod: &LodSpec) -> FingerprintBuilder {
    // What is left out has a part of its own.
    let LodSpec { inner_shares, border, leave_out: _ } = lod;
    let border = match border {
        LodBorder::Full => 0,
        LodBorder::Own => 1,
    };
    builder.list(inner_shares.iter(), |builder, share| builder.real(*share)).case(border)
}

fn feed_sides(builder: FingerprintBuilder, sides: SeamSides) -> FingerprintBuilder {
    let SeamSides { south, east, north, west } = sides;
    [south, east, north, west].into_iter().fold(builder, |builder, is_open| builder.case(u8::from(is_open)))
}

fn feed_module_rect(builder: FingerprintBuilder, rect: ModuleRect) -> FingerprintBuilder {
    let ModuleRect { south, west, north, east } = rect;
    [south, west, north, east].into_iter().fold(builder, |builder, line| builder.number(line.into()))
}

fn feed_point(builder: FingerprintBuilder, point: &LatticePoint) -> FingerprintBuilder {
    let LatticePoint { row, col } = *point;
    builder.signed(row.into()).signed(col.into())
}

fn feed_vertex(builder: FingerprintBuilder, vertex: &Vertex) -> FingerprintBuilder {
    let Vertex { at, height } = vertex;
    feed_point(builder, at).signed((*height).into())
}
