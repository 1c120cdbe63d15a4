//! From a job's words to one tile's task.

use std::ops::Deref;

use crate::ground::GamingArea;
use job::{Allocation, Borders, Budget as PointBudget, Edges, Effort, ErrorKey, Job, Method, OuterBorder};
use store::TileBudget;
use terrain::limits::Allowance;
use terrain::{
    Features, ModuleId, ModuleRect, Post, SeamSides, Side, THOUSANDTHS, TileFeatures, TileId, TileTin, Vertex,
};
use tin::tiling::{Budget, Tiling, outer_border_posts, outer_sides};
use tin::{CostUnit, Frame, Proximity, Rule, Stop, SurveyTask, TileTask};

use crate::CompileError;
use crate::refinement::{Most, Refinement, optimising};

/// A survey looks so many halves of an equal share far.
const SURVEY_REACH: u64 = 6;
/// The same, for a quick look: few tiles deserve more, and a fast build does not wait for them.
const SURVEY_REACH_OF_FAST: u64 = 3;
/// The same, where an RMS residual is asked for that optimising reaches within the budget and selection alone does not.
const SURVEY_REACH_TO_RMS: u64 = 10;
/// The same, where a largest residual ends the survey, which goes no further than that takes.
const SURVEY_REACH_TO_LARGEST: u64 = 40;

/// The refinement of one tile, optimised if the job says so.
pub fn tile_refinement(
    job: &Job,
    area: &GamingArea,
    tile: TileId,
    budget: &TileBudget,
    inherited: Vec<Post>,
    features: &TileFeatures,
) -> Refinement {
    let barred = features.kept.barred_posts(area.tiling.rect(tile));
    let task = TileTask { barred, ..tile_task(job, area, tile, budget, inherited) };
    let spacing = Some(area.frame.spacing);
    Refinement { task, optimising: optimising(job), most: Most::AsTask, features: features.clone(), spacing }
}

/// The growth of one tile, inheriting `inherited` from its lower-ranked neighbours.
fn tile_task(job: &Job, area: &GamingArea, tile: TileId, budget: &TileBudget, inherited: Vec<Post>) -> TileTask {
    let rect = area.tiling.rect(tile);
    let (border, seams) = match job.tiles.borders {
        Borders::Regular => {
            (outer_border_posts(rect, SeamSides::OPEN, job.modules.border_step_cells), SeamSides::CLOSED)
        }
        Borders::Inherit => (
            outer_border_posts(rect, outer_sides(rect, area.rect), job.outer_step_cells()),
            with_outer_sides(job, area, tile, area.tiling.owned_sides(tile)),
        ),
    };
    let points = budget.points;
    TileTask {
        tile,
        rect,
        frame: frame(job, area, tile, budget.allowance.clone()),
        border,
        inherited,
        kept: Vec::new(),
        start: Vec::new(),
        seams,
        barred: Vec::new(),
        rule: rule(job, area),
        stop: Stop {
            points,
            value: if is_by_squares(job) { None } else { largest_value(job) },
            // Shared out globally, the RMS is the area's: the allocation sees to it.
            rms_quanta: match is_surveyed(job) {
                true => budget.rms_quanta,
                false => job.tin.target_rms_m.map(|rms| rms * f64::from(terrain::QUANTA_PER_METRE)),
            },
        },
    }
}

/// `sides` of a tile, and those on the outer border where points are chosen there: nothing but limits binds them.
pub(crate) fn with_outer_sides(job: &Job, area: &GamingArea, tile: TileId, sides: SeamSides) -> SeamSides {
    match job.modules.outer_border {
        OuterBorder::Fixed => sides,
        OuterBorder::Refined => {
            let outer = outer_sides(area.tiling.rect(tile), area.rect);
            SeamSides::from_fn(|side| sides.is_open(side) || outer.is_open(side))
        }
    }
}

fn frame(job: &Job, area: &GamingArea, tile: TileId, allowance: Option<Allowance>) -> Frame {
    let side_cells = area.grid.side_cells;
    match (job.modules.edges, allowance) {
        (Edges::Constrained, Some(allowance)) => {
            let modules = area.tiling.modules(tile, area.grid);
            let south_west = ModuleId { row: modules.south, col: modules.west };
            Frame::Sides { side_cells, south_west, allowance }
        }
        (Edges::Constrained, None) => unreachable!("constrained edges are allocated triangles"),
        (Edges::Clip(_), _) => Frame::Corners { side_cells },
    }
}

/// Whether what a tile may spend depends on what it would gain: a budget shared out globally. Clipped edges without
/// a number of points have no budget to share, only an end to reach.
pub fn is_surveyed(job: &Job) -> bool {
    let has_budget = job.tin.budget != PointBudget::Limits || job.modules.edges == Edges::Constrained;
    job.tin.allocation == Allocation::Global && has_budget
}

/// Whether the survey may be coarse: what it misjudges costs a fast build less than looking closer would.
pub(crate) fn is_surveyed_in_haste(job: &Job) -> bool {
    let is_fast = optimising(job).is_some_and(|optimising| optimising.effort == Effort::Fast);
    is_fast && job.tin.target_rms_m.is_none() && job.tin.max_residual_m.is_none()
}

fn is_by_squares(job: &Job) -> bool {
    // Where a residual is the only end, it is reached by worst posts; sums of squares would go on past it.
    let ends_at_residual = job.tin.max_residual_m.is_some() && job.tin.budget == PointBudget::Limits;
    match job.tin.method {
        Method::Optimised(_) => true,
        Method::Greedy => job.tin.key == ErrorKey::Sse && !ends_at_residual,
        Method::Paper { .. } => job.tin.key == ErrorKey::Sse,
    }
}

/// Which post comes next.
pub(crate) fn rule(job: &Job, area: &GamingArea) -> Rule {
    match job.tin.method {
        _ if is_by_squares(job) => Rule::LargestSquares { guard: largest_value(job) },
        Method::Optimised(_) | Method::Greedy => Rule::WorstFirst,
        Method::Paper { proximity, last_batch } => Rule::Batches {
            residual_quantum: job.tin.residual_quantum,
            proximity: proximity.map(|proximity| Proximity {
                posts: proximity.horizontal_m / area.frame.spacing.metres(),
                quanta: (proximity.vertical_m * f64::from(terrain::QUANTA_PER_METRE)).round() as u32,
            }),
            last_batch,
        },
    }
}

/// `max_residual_m` as a value: no post may have more, whatever it weighs. Where posts are optimised none weighs more
/// than another for that; otherwise they are weighted, and those that weigh least come last.
fn largest_value(job: &Job) -> Option<u64> {
    let quantum = if matches!(job.tin.method, Method::Paper { .. }) { job.tin.residual_quantum } else { 1 };
    let is_optimised = matches!(job.tin.method, Method::Optimised(_));
    let weight = if is_optimised { THOUSANDTHS } else { job.importance.lightest() };
    job.tin.max_residual_m.map(|metres| u64::from(weight) * units_within(metres, quantum))
}

/// The most steps of so many quanta at which a residual, rounded to them, is surely no larger than so many metres.
pub(crate) fn units_within(metres: f64, quantum: u32) -> u64 {
    let rounded_away = if quantum == 1 { 0.0 } else { f64::from(quantum) / 2.0 };
    ((metres * f64::from(terrain::QUANTA_PER_METRE) - rounded_away) / f64::from(quantum)).max(0.0) as u64
}

/// The survey of one tile: all it would select if it were alone.
pub(crate) fn survey_task(job: &Job, area: &GamingArea, tile: TileId, features: &Features) -> SurveyTask {
    let modules = area.tiling.modules(tile, area.grid);
    let largest = largest_in_survey(job);
    let reach = match optimising(job) {
        _ if largest.is_some() => SURVEY_REACH_TO_LARGEST,
        Some(_) if job.tin.target_rms_m.is_some() => SURVEY_REACH_TO_RMS,
        Some(_) if is_surveyed_in_haste(job) => SURVEY_REACH_OF_FAST,
        _ if job.tin.budget == PointBudget::Limits => SURVEY_REACH.min(reach_of_windows(area, modules)),
        _ => SURVEY_REACH,
    };
    let share = |total: u64| reach * total * modules.count() as u64 / area.grid.count() as u64 / 2;
    let (points, cost) = match job.tin.budget {
        PointBudget::Points(points) => (Some(share(points) as usize), CostUnit::Points),
        PointBudget::Limits => (None, CostUnit::Triangles),
    };
    let room = area.budget.area - area.budget.start_total();
    let allowance = survey_allowance(area, modules, share(room).min(u32::MAX.into()) as u32);
    let budget = TileBudget { points, allowance: Some(allowance), rms_quanta: None };
    let mut growth = tile_task(job, area, tile, &budget, Vec::new());
    growth.seams = with_outer_sides(job, area, tile, area.tiling.shared_sides(tile));
    growth.barred = features.barred_posts(growth.rect);
    // An RMS of 0 is never reached, but has the sums of squares recorded.
    growth.stop = Stop { points, value: largest, rms_quanta: job.tin.target_rms_m.map(|_| 0.0) };
    growth.rule = match growth.rule {
        Rule::LargestSquares { .. } if largest.is_none() => Rule::LargestSquares { guard: None },
        _ => Rule::WorstFirst,
    };
    let owned = with_outer_sides(job, area, tile, area.tiling.owned_sides(tile));
    let is_masked = job.importance.weights().any(|weight| weight == 0);
    SurveyTask { growth, owned, grid: area.grid, cost, counts_left: is_masked || job.features.is_none() }
}

/// The largest residual at which a survey ends: where it ends the choosing and no RMS residual does, a tile gets what
/// worst posts take to it, and no gain in squares takes that from another.
fn largest_in_survey(job: &Job) -> Option<u64> {
    let is_batched = matches!(job.tin.method, Method::Paper { .. });
    largest_value(job).filter(|_| job.tin.target_rms_m.is_none() && !is_batched)
}

/// How many halves of an equal share the limit of windows lets a tile come to, where it is twice as large as they are:
/// what lies beyond is never asked for. A smaller tile may have the most of its windows for itself.
fn reach_of_windows(area: &GamingArea, modules: ModuleRect) -> u64 {
    let Budget { grid, per_window, windows, area: total, .. } = &area.budget;
    if modules.rows() < 2 * windows.rows || modules.cols() < 2 * windows.cols {
        return u64::MAX;
    }
    let of_window = u64::from(windows.rows) * u64::from(windows.cols);
    (2 * u64::from(*per_window) * grid.count() as u64).div_ceil(of_window * (*total).max(1))
}

/// Load modules to their limit (or beyond it by the pool), no windows.
fn survey_allowance(area: &GamingArea, modules: ModuleRect, triangles: u32) -> Allowance {
    let ring = ModuleRect {
        south: modules.south.saturating_sub(1),
        west: modules.west.saturating_sub(1),
        north: (modules.north + 1).min(area.grid.rows),
        east: (modules.east + 1).min(area.grid.cols),
    };
    let cap = area.budget.per_module.saturating_add(u32::try_from(area.budget.pool).unwrap_or(u32::MAX));
    let room = |module| cap.saturating_sub(area.budget.start_of(module));
    Allowance {
        modules: ring,
        module_room: ring.iter().map(room).collect(),
        windows: ModuleRect { south: 0, west: 0, north: 0, east: 0 },
        window_size: (area.budget.windows.rows, area.budget.windows.cols),
        window_room: Vec::new(),
        triangles,
    }
}

/// The border points a tile's TIN has on one of its sides, in canonical order: vertices on posts, counted in eighths
/// whatever lattice the TIN stands on. Vertices of features between posts both tiles have from the features.
fn side_vertices(tin: &TileTin, side: Side) -> Vec<Vertex> {
    let rect = tin.tin.rect;
    let on_side = |post: Post| match side {
        Side::South => post.row == rect.south,
        Side::East => post.col == rect.east,
        Side::North => post.row == rect.north,
        Side::West => post.col == rect.west,
    };
    let on_post = |vertex: &Vertex| {
        let post = tin.tin.post_at(vertex.at).filter(|&post| on_side(post))?;
        Some(Vertex { at: post.into(), height: vertex.height })
    };
    let mut found: Vec<Vertex> = tin.tin.vertices.iter().filter_map(on_post).collect();
    found.sort_unstable();
    found
}

/// The vertices on one side of a TIN that stand on posts and are none of features, in canonical order.
pub(crate) fn seam_points(tin: &TileTin, side: Side, features: &Features) -> Vec<Vertex> {
    let is_of_feature = |vertex: &Vertex| vertex.at.post().is_some_and(|post| features.has_post(post));
    let mut found = side_vertices(tin, side);
    found.retain(|vertex| !is_of_feature(vertex));
    found
}

/// What a tile inherits: the border points of its lower-ranked neighbours on the sides they share, but for vertices of
/// `features`, which all of them have from the start.
///
/// # Errors
/// The first of `published`.
pub fn inherited<T: Deref<Target = TileTin>>(
    tiling: &Tiling,
    tile: TileId,
    features: &Features,
    published: impl Fn(TileId) -> Result<T, CompileError>,
) -> Result<Vec<Vertex>, CompileError> {
    let mut all = Vec::new();
    for side in Side::ALL.into_iter().filter(|&side| tiling.inherits(tile, side)) {
        if let Some(other) = tiling.beyond(tile, side) {
            all.extend(seam_points(&*published(other)?, side.opposite(), features));
        }
    }
    all.sort_unstable();
    all.dedup();
    Ok(all)
}

/// The posts that vertices stand on.
///
/// # Panics
/// When one stands between posts: seam vertices never do.
pub fn posts_of(vertices: &[Vertex]) -> Vec<Post> {
    vertices.iter().map(|vertex| vertex.at.post().expect("seam vertices stand on posts")).collect()
}

#[cfg(test)]
mod tests {
    use terrain::{LatticePoint, PostRect, StopReason, Tin};

    use super::*;

    #[test]
    fn a_residual_within_so_many_steps_is_no_larger_when_it_is_rounded_to_them() {
        for (metres, quantum) in [(1.0, 1), (1.0, 64), (0.3, 128), (2.5, 100), (0.0, 7)] {
            let units = units_within(metres, quantum);
            let most = units * u64::from(quantum) + if quantum == 1 { 0 } else { u64::from(quantum) / 2 };
            let room = metres * f64::from(terrain::QUANTA_PER_METRE);
            assert!(units == 0 || most as f64 <= room, "{metres} m in steps of {quantum}");
            assert!(room < (most + u64::from(quantum)) as f64, "{metres} m in steps of {quantum} leaves out a step");
        }
    }

    #[test]
    fn border_points_are_handed_on_in_eighths_and_features_between_posts_are_not() {
        let vertex = |row: i32, col: i32, height: i32| Vertex { at: LatticePoint::new(row, col), height };
        let rect = PostRect { south: 2, west: 1, north: 4, east: 5 };
        let vertices = vec![vertex(256, 320, 5), vertex(256, 64, 1), vertex(256, 128, 2), vertex(256, 150, 3)];
        let tin = Tin { steps_per_post: 64, ..Tin::new(rect, vertices, Vec::new()) };
        let tin = TileTin {
            tile: TileId { row: 0, col: 0 },
            tin,
            initial_count: 0,
            residuals: Vec::new(),
            triangles_charged: 0,
            refused: Vec::new(),
            stop: StopReason::Exhausted,
        };
        let north = [vertex(32, 8, 1), vertex(32, 16, 2), vertex(32, 40, 5)];
        assert_eq!(side_vertices(&tin, Side::North), north);
        assert_eq!(side_vertices(&tin, Side::East), north[2..]);
        assert_eq!(side_vertices(&tin, Side::South), []);
        assert_eq!(posts_of(&north), [Post::new(4, 1), Post::new(4, 2), Post::new(4, 5)]);
    }
}
