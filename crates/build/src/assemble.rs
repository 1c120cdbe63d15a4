//! Load modules of every tile, their residuals and counts, and the file that keeps what is known of them.

use std::collections::{BTreeMap, BTreeSet};

use fidelity::{Curvature, FeatureFigures, Residuals, Tally};
use job::{Borders, ClipHeights as JobClipHeights, Edges, Job, OuterBorder};
use store::engine::{Artifact, Fingerprint, Key, Outcome, Stamp, keep_or_make};
use store::{FileStamp, Measured, MeasuredModule, TileModules};
use terrain::{
    Decks, Dem, HOLE_CLASS, Importance, LatticePoint, LineTraits, LoadModule, ModuleCounts, ModuleLine, ModuleResidual,
    Post, PostRect, TileId, Tin, Vertex, in_turn,
};
use tin::load_modules::{
    ClipHeights, Layout, classify_natural, clip, concatenate, cut_decks, cut_lines, highest_in, lift_decks, put_decks,
    stand,
};

use crate::ground::Window;
use crate::keys::{self, StampOf};
use crate::levels::{all_levels, faces};
use crate::order::Unit;
use crate::product::{from_curvature, from_features, from_tally, to_curvature, to_features, to_tally};
use crate::refine::Published;
use crate::run::{ALGORITHM_REVISION, Run};
use crate::sums::{Adding, Assembled, ModuleNumbers, Sums};
use crate::tile_objects::TileObjects;
use crate::{CompileError, Progress, Stage};

/// Assembles every tile.
pub(crate) fn assemble(
    run: &Run,
    tins: &[Published],
    progress: &mut dyn Progress,
) -> Result<(Vec<Assembled>, Sums), CompileError> {
    let (none, adding) = (vec![Vec::new(); tins.len()], Adding::default());
    let done = run.for_each_tile(Stage::Assemble, progress, |tile| {
        Ok(assemble_tile(run, &|index| tins[index].stamp, &none, tile)?.map(|(assembled, sums)| {
            adding.add(sums);
            assembled
        }))
    })?;
    Ok((done.into_iter().map(Outcome::into_inner).collect(), adding.finish()))
}

/// Assembles, measures and publishes one tile, without the points that `removed` lists per tile; or keeps what is
/// published and fresh.
pub(crate) fn assemble_tile(
    run: &Run,
    stamps: &StampOf,
    removed: &[Vec<LatticePoint>],
    tile: TileId,
) -> Result<Outcome<(Assembled, Sums)>, CompileError> {
    let objects = run.outlines.as_ref().map(|(_, outlines)| TileObjects::of(outlines, &run.area, tile));
    let modules = made_from(run, stamps, removed, tile, objects.as_ref())?;
    keep_or_make(&Assembling { run, stamps, removed, tile, objects, modules }, ALGORITHM_REVISION)
}

/// Of all that the load modules of a tile are made from.
fn made_from(
    run: &Run,
    stamps: &StampOf,
    removed: &[Vec<LatticePoint>],
    tile: TileId,
    objects: Option<&TileObjects>,
) -> Result<Fingerprint, CompileError> {
    let left_out = (&*run.tile_features(tile)?, run.left_out());
    Ok(keys::modules((run.job, &run.area), stamps, removed, left_out, objects).fingerprint())
}

/// A tile's load modules and what is measured of them, as the engine asks for them.
struct Assembling<'a> {
    run: &'a Run<'a>,
    stamps: &'a StampOf<'a>,
    removed: &'a [Vec<LatticePoint>],
    tile: TileId,
    objects: Option<TileObjects>,
    /// Of all that the load modules are made from.
    modules: Fingerprint,
}

impl Artifact for Assembling<'_> {
    type Output = (Assembled, Sums);
    type Error = CompileError;

    fn key(&self) -> Key {
        keys::measured(self.run, self.modules)
    }

    fn published(&self) -> Result<Option<Stamp>, CompileError> {
        Ok(self.run.database.folder().measured_stamp(self.tile)?)
    }

    fn read(&self, _key: &Key) -> Option<(Stamp, (Assembled, Sums))> {
        let (area, folder, tile) = (&self.run.area, self.run.database.folder(), self.tile);
        let (stamp, file, measured) = folder.read_measured(tile).ok()?;
        let count = area.tiling.modules(tile, area.grid).count();
        let (levels, has_features) = (self.run.job.lod.level_count(), self.run.level.is_some());
        let is_whole = |measured: &Measured| {
            measured.modules.len() == count * levels && measured.features.is_some() == has_features
        };
        folder.check_file(&folder.modules_path(tile), &measured.modules_file).ok().filter(|()| is_whole(&measured))?;
        Some((stamp, from_measured(measured, count, file)))
    }

    fn make(&self, _key: &Key, stamp: &Stamp) -> Result<(Assembled, Sums), CompileError> {
        make(self, stamp)
    }
}

fn make(assembling: &Assembling, stamp: &Stamp) -> Result<(Assembled, Sums), CompileError> {
    let &Assembling { run, stamps, removed, tile, ref objects, modules: fingerprint } = assembling;
    let area = &run.area;
    let window = run.window(tile)?;
    let layout = Layout { grid: area.grid, modules: area.tiling.modules(tile, area.grid), spacing: area.frame.spacing };
    let own = run.tin(tile, &stamps(area.tiling.index(tile)))?;
    let features = run.tile_features(tile)?;
    let faces = faces(&features, &BTreeSet::new());
    // What is no feature has the class that the ground has without any.
    let natural = run.ground.natural_tile(area, tile)?;
    let mut modules = match run.job.modules.edges {
        Edges::Constrained => concatenate(&own.tin, &layout, &natural.importance, faces.as_ref()),
        Edges::Clip(heights) => {
            let points = points_around(run, stamps, removed, tile)?;
            let heights = match heights {
                JobClipHeights::Coplanar => ClipHeights::Coplanar,
                JobClipHeights::Dem => ClipHeights::Dem(&window.dem),
            };
            clip(&points, &layout, heights, &window.importance)
        }
    };
    let steps_per_post = features.kept.steps_per_post;
    let lines = cut_lines(&features.lines, steps_per_post, &layout);
    let bridges = |lines: &Vec<ModuleLine>| -> Vec<ModuleLine> {
        lines.iter().filter(|line| keys::has_deck(&LineTraits::of(line))).cloned().collect()
    };
    let decks = cut_decks(&features.decks, steps_per_post, &layout).into_iter();
    let decks: Vec<_> = decks.zip(lines.iter().map(bridges)).collect();
    let is_of_features = |class: u8| class == HOLE_CLASS || run.job.is_of_features(class);
    let bare =
        |(module, ((decks, _), _)): (&LoadModule, &((Decks, usize), _))| (!decks.is_empty()).then(|| module.clone());
    let mut bare: Vec<Option<LoadModule>> = modules.iter().zip(&decks).map(bare).collect();
    for ((module, lines), ((decks, most), bridges)) in modules.iter_mut().zip(&lines).zip(&decks) {
        if !decks.is_empty() {
            let before = module.triangles.len();
            put_decks(module, (decks, bridges), lines, is_of_features, *most);
            if before < module.triangles.len() {
                classify_natural(module, &layout, &natural.importance, faces.as_ref(), is_of_features);
            }
        }
    }
    if keys::have_lines(run.job) {
        modules.iter_mut().zip(lines).for_each(|(module, lines)| module.lines = lines);
    }
    let residuals = fidelity::measure(&mut modules, &window.measured(area));
    let at_source = at_source(run, tile, &modules, &natural.dem)?;
    let mut figures = feature_figures(run, tile, (&own.tin, &modules), &window)?;
    // Coarser levels are made of vertices of the TIN: those that lowered the ground onto decks are none.
    swap_grounds(&mut modules, &mut bare);
    let mut levels = all_levels(run, modules, (&layout, &window.dem, &natural.importance), &features);
    swap_grounds(&mut levels[0], &mut bare);
    levels[1..].iter_mut().for_each(|level| lift(level, &decks));
    levels[1..].iter_mut().for_each(|level| drop(fidelity::measure(level, &window.measured(area))));
    place_objects(run, stamps, &mut levels, objects.as_ref(), &layout)?;
    if let Some(figures) = &mut figures {
        figures.in_buildings_m = levels[0].iter().map(fidelity::metres_in_buildings).sum();
    }
    let file = publish(run, tile, &layout, fingerprint, &levels)?;
    let counted = count_points(run, &own.tin, &removed[area.tiling.index(tile)], &window.importance);
    let ground = (heights_of(&levels), curvature(run, tile, &levels[0], &window));
    let (modules, coarser) = numbers_of(&levels);
    let mut done = Assembled { file, measured: FileStamp::of(&[]), modules, coarser };
    let sums = Sums { features: figures, ..sums(residuals, at_source, counted, ground) };
    done.measured = run.database.write_measured(stamp, &to_measured(tile, &done, &sums))?;
    Ok((done, sums))
}

/// Gives load modules of all levels what stands on them.
fn place_objects(
    run: &Run,
    stamps: &StampOf,
    levels: &mut [Vec<LoadModule>],
    objects: Option<&TileObjects>,
    layout: &Layout,
) -> Result<(), CompileError> {
    let Some(TileObjects { own, beside }) = objects else { return Ok(()) };
    let mut highest = BTreeMap::new();
    for (&place, pieces) in beside {
        let tin = run.tin(run.area.tiles[place], &stamps(place))?;
        let pieces: Vec<_> = pieces.iter().map(|(module, prism)| (*module, prism)).collect();
        highest_in(&tin.tin, &pieces, layout, &mut highest);
    }
    let standing = stand(own, levels, &highest);
    for level in levels {
        level.iter_mut().zip(&standing).for_each(|(module, objects)| module.objects.clone_from(objects));
    }
    Ok(())
}

/// Gives load modules the ground of others, and these theirs.
fn swap_grounds(modules: &mut [LoadModule], others: &mut [Option<LoadModule>]) {
    for (module, other) in modules.iter_mut().zip(others).filter_map(|(module, other)| Some((module, other.as_mut()?)))
    {
        std::mem::swap(&mut module.vertices, &mut other.vertices);
        std::mem::swap(&mut module.triangles, &mut other.triangles);
        std::mem::swap(&mut module.classes, &mut other.classes);
        std::mem::swap(&mut module.polygon_count, &mut other.polygon_count);
    }
}

/// Gives load modules of a coarser level their decks, with how many triangles these may have and the lines of their
/// bridges, raised onto the ground of each.
fn lift(modules: &mut [LoadModule], decks: &[((Decks, usize), Vec<ModuleLine>)]) {
    let are_there = modules.iter_mut().zip(decks).filter(|(_, ((decks, _), _))| !decks.is_empty());
    for (module, ((decks, most), bridges)) in are_there {
        module.decks = lift_decks(decks, bridges, module, *most);
    }
}

/// Residuals against the sources alone: at the posts of the working grid, where features or water are burned into it,
/// and at the source's own posts, where those are others.
fn at_source(
    run: &Run,
    tile: TileId,
    modules: &[LoadModule],
    natural: &Dem,
) -> Result<[Option<Tally>; 2], CompileError> {
    let (area, relief) = (&run.area, &run.ground.relief);
    let rect = area.tiling.rect(tile);
    let own_posts = relief.residuals_at_source(modules, area, rect)?;
    if !run.burns_in() {
        return Ok([None, own_posts]);
    }
    // Natural ground has level water, where a job says so.
    let dry = relief.water.is_some().then(|| relief.dry(rect)).transpose()?;
    let (dem, mask) = (dry.as_ref().unwrap_or(natural), Importance::uniform(rect, 0));
    let source = fidelity::Reference { dem, mask: &mask, grid: area.grid, spacing: area.frame.spacing };
    let mut at_grid = Tally::default();
    modules.iter().for_each(|module| at_grid.merge(&fidelity::residuals(module, &source).total()));
    Ok([Some(at_grid), own_posts])
}

fn sums(
    residuals: Residuals,
    [at_source_grid, at_source]: [Option<Tally>; 2],
    (points, border): (Vec<u64>, u64),
    (heights, curvature): ((i32, i32), Curvature),
) -> Sums {
    let (has_source, at_source) = (at_source.is_some(), at_source.unwrap_or_default());
    Sums { residuals, at_source_grid, has_source, at_source, points, border, heights, curvature, features: None }
}

/// How much the ground of a tile curves, for triangles as large as these load modules have them.
fn curvature(run: &Run, tile: TileId, modules: &[LoadModule], window: &Window) -> Curvature {
    let triangles = modules.iter().map(|module| module.triangles.len()).sum();
    fidelity::curvature(&window.dem, run.area.tiling.rect(tile), triangles, &in_turn)
}

/// How true a tile is to its features, in jobs with some.
fn feature_figures(
    run: &Run,
    tile: TileId,
    (tin, modules): (&Tin, &[LoadModule]),
    window: &Window,
) -> Result<Option<FeatureFigures>, CompileError> {
    if run.level.is_none() {
        return Ok(None);
    }
    let (features, area) = (run.tile_features(tile)?, &run.area);
    let ground = window.measured(area);
    Ok(Some(FeatureFigures::of((tin, modules), &features, &ground, &window.featured, area.rect)))
}

/// The lowest and the highest vertex of all levels of load modules, in quanta.
fn heights_of(levels: &[Vec<LoadModule>]) -> (i32, i32) {
    let heights = levels.iter().flatten().flat_map(|module| &module.vertices).map(|vertex| vertex.z);
    heights.fold((i32::MAX, i32::MIN), |(low, high), z| (low.min(z), high.max(z)))
}

/// The published load modules of a tile as they are: their own numbers, and residuals against today's ground. `None`
/// where they were made from another TIN, or from what features or objects were then.
pub(crate) fn read_assembled(
    run: &Run,
    tins: &[Published],
    removed: &[Vec<LatticePoint>],
    tile: TileId,
) -> Result<Option<(Assembled, Sums)>, CompileError> {
    let (area, folder, window) = (&run.area, run.database.folder(), run.window(tile)?);
    let manifest = run.previous.as_ref().expect("a tile is run again only where a build has ended");
    let (header, mut levels) = folder.read_levels(manifest, tile)?;
    let objects = run.outlines.as_ref().map(|(_, outlines)| TileObjects::of(outlines, area, tile));
    if header.fingerprint != made_from(run, &|index| tins[index].stamp, removed, tile, objects.as_ref())? {
        return Ok(None);
    }
    let file = folder.stamp_file(&folder.modules_path(tile))?;
    let (modules, coarser) = numbers_of(&levels);
    let residuals = fidelity::measure(&mut levels[0], &window.measured(area));
    let at_source = at_source(run, tile, &levels[0], &run.ground.natural_tile(area, tile)?.dem)?;
    let own = run.tin(tile, &tins[area.tiling.index(tile)].stamp)?;
    let counted = count_points(run, &own.tin, &[], &window.importance);
    let features = feature_figures(run, tile, (&own.tin, &levels[0]), &window)?;
    let measured = folder.stamp_file(&folder.measured_path(tile))?;
    let done = Assembled { file, measured, modules, coarser };
    let ground = (heights_of(&levels), curvature(run, tile, &levels[0], &window));
    Ok(Some((done, Sums { features, ..sums(residuals, at_source, counted, ground) })))
}

/// Numbers of the finest level, and of each of the others.
fn numbers_of(levels: &[Vec<LoadModule>]) -> (Vec<ModuleNumbers>, Vec<Vec<ModuleNumbers>>) {
    let mut all = levels.iter().map(|level| level.iter().map(numbers).collect());
    (all.next().unwrap_or_default(), all.collect())
}

fn numbers(module: &LoadModule) -> ModuleNumbers {
    let ModuleCounts { triangles, polygons } = module.counts();
    ModuleNumbers { triangles, polygons, residual: module.residual }
}

/// The points in and around a tile that clipping needs.
pub(crate) fn points_around(
    run: &Run,
    stamps: &StampOf,
    removed: &[Vec<LatticePoint>],
    tile: TileId,
) -> Result<Vec<Vertex>, CompileError> {
    let mut near = run.area.tiling.neighbours(tile);
    near.push(tile);
    let index = |&other: &TileId| run.area.tiling.index(other);
    let mut gone: Vec<LatticePoint> = near.iter().flat_map(|other| removed[index(other)].iter().copied()).collect();
    gone.sort_unstable();
    let mut all = Vec::new();
    for other in &near {
        let tin = run.tin(*other, &stamps(index(other)))?;
        all.extend(tin.tin.vertices.iter().filter(|vertex| gone.binary_search(&vertex.at).is_err()));
    }
    Ok(all)
}

/// Writes the file of a tile's load modules.
fn publish(
    run: &Run,
    tile: TileId,
    layout: &Layout,
    fingerprint: Fingerprint,
    levels: &[Vec<LoadModule>],
) -> Result<FileStamp, CompileError> {
    let header = TileModules {
        tile,
        grid: layout.grid,
        modules: layout.modules,
        frame: run.area.frame,
        crs: crs(run.job),
        vertical_datum: run.job.dem.vertical_datum.clone().unwrap_or_default(),
        fingerprint,
    };
    Ok(run.database.write_modules(&header, levels)?)
}

/// The area's coordinate reference system, as files name it.
pub(crate) fn crs(job: &Job) -> String {
    format!("EPSG:{}", job.area.epsg)
}

/// Points by class of the post they stand on, or next south-west of them, those over holes after the job's classes if
/// there are any; and how many of them are border points that every build starts from.
/// A point on a seam counts in the tile that owns the post.
fn count_points(run: &Run, own: &Tin, removed: &[LatticePoint], importance: &Importance) -> (Vec<u64>, u64) {
    let (rect, area) = (own.rect, run.area.rect);
    let steps = own.steps_per_post;
    let side = run.area.grid.side_cells * steps;
    let is_regular = run.job.tiles.borders == Borders::Regular;
    let is_fixed = run.job.modules.outer_border == OuterBorder::Fixed;
    let mut points = vec![0; run.job.class_names().len()];
    let holes = points.len();
    let mut border = 0;
    let removed: std::collections::BTreeSet<&LatticePoint> = removed.iter().collect();
    for vertex in own.vertices.iter().filter(|vertex| !removed.contains(&vertex.at)) {
        let at = vertex.at;
        let is_at = |place: i32, line: i32| place == line * steps;
        let beyond = (is_at(at.row, rect.north) && rect.north != area.north)
            || (is_at(at.col, rect.east) && rect.east != area.east);
        if beyond {
            continue;
        }
        let post = Post::new(at.row.div_euclid(steps), at.col.div_euclid(steps));
        match importance.class(post) {
            HOLE_CLASS => {
                points.resize(holes + 1, 0);
                points[holes] += 1;
            }
            class => points[usize::from(class)] += 1,
        }
        let on_line = |rect: PostRect| {
            is_at(at.row, rect.south)
                || is_at(at.row, rect.north)
                || is_at(at.col, rect.west)
                || is_at(at.col, rect.east)
        };
        let is_corner = at.row % side == 0 && at.col % side == 0;
        border += u64::from(!is_corner && ((is_fixed && on_line(area)) || (is_regular && on_line(rect))));
    }
    (points, border)
}

/// What is kept of a tile's load modules.
fn to_measured(tile: TileId, assembled: &Assembled, sums: &Sums) -> Measured {
    let module = |numbers: &ModuleNumbers| MeasuredModule {
        triangles: numbers.triangles,
        polygons: numbers.polygons,
        posts: numbers.residual.posts,
        largest: numbers.residual.largest,
        sum_abs: numbers.residual.sum_abs,
        sum_squared: numbers.residual.sum_squared,
    };
    Measured {
        tile,
        modules_file: assembled.file,
        modules: std::iter::once(&assembled.modules).chain(&assembled.coarser).flatten().map(module).collect(),
        classes: sums.residuals.classes.iter().map(to_tally).collect(),
        at_source_grid: sums.at_source_grid.as_ref().map(to_tally),
        at_source: sums.has_source.then(|| to_tally(&sums.at_source)),
        points: sums.points.clone(),
        border: sums.border,
        heights: sums.heights.into(),
        curvature: to_curvature(sums.curvature),
        features: sums.features.as_ref().map(to_features),
    }
}

/// What was kept of a tile of `count` load modules, in a file of this stamp.
fn from_measured(measured: Measured, count: usize, file: FileStamp) -> (Assembled, Sums) {
    let module = |module: &MeasuredModule| ModuleNumbers {
        triangles: module.triangles,
        polygons: module.polygons,
        residual: ModuleResidual {
            posts: module.posts,
            largest: module.largest,
            sum_abs: module.sum_abs,
            sum_squared: module.sum_squared,
        },
    };
    let mut levels = measured.modules.chunks(count.max(1)).map(|level| level.iter().map(module).collect());
    let (modules, coarser) = (levels.next().unwrap_or_default(), levels.collect());
    let done = Assembled { file: measured.modules_file, measured: file, modules, coarser };
    (done, sums_of(measured))
}

impl Sums {
    /// Those of every tile as `assembled` says that it is published.
    ///
    /// # Errors
    /// When a file cannot be read; [`CompileError::NotReady`] when another process has changed it since.
    pub(crate) fn published(run: &Run, assembled: &[Assembled]) -> Result<Sums, CompileError> {
        let (tiles, adding) = (&run.area.tiles, Adding::default());
        let folder = run.database.folder();
        let read = |place: usize, &tile: &terrain::TileId| -> Result<(), CompileError> {
            let (_, file, measured) = folder.read_measured(tile)?;
            if file != assembled[place].measured {
                let [unit, needs] =
                    [Unit::whole(Stage::Publish), Unit::of(Stage::Assemble, tile)].map(|unit| unit.to_string());
                return Err(CompileError::NotReady { unit, needs });
            }
            adding.add(sums_of(measured));
            Ok(())
        };
        schedule::for_each_independent(tiles, &run.workers, run.stop, read)
            .map_err(|error| CompileError::from_schedule(Stage::Enforce, tiles, error))?;
        Ok(adding.finish())
    }
}

/// What was kept of a tile's residuals and points.
pub fn sums_of(measured: Measured) -> Sums {
    Sums {
        residuals: Residuals { classes: measured.classes.iter().map(from_tally).collect() },
        at_source_grid: measured.at_source_grid.as_ref().map(from_tally),
        at_source: measured.at_source.as_ref().map(from_tally).unwrap_or_default(),
        has_source: measured.at_source.is_some(),
        points: measured.points,
        border: measured.border,
        heights: measured.heights.into(),
        curvature: from_curvature(measured.curvature),
        features: measured.features.as_ref().map(from_features),
    }
}
