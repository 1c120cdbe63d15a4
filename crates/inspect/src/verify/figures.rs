//! Sums over the load modules, added up again in 128 bits, against what `measured/`, `database.json` and the report
//! say.

use std::rc::Rc;

use fidelity::Residuals;
use job::Job;
use store::{Folder, Manifest, Measured, MeasuredModule, MeasuredTally, Report, ReportResidual};
use terrain::{LoadModule, ModuleCounts, ModuleResidual, StopReason, metres_of_quanta};

use super::exceeded::Exceeded;
use super::modules::Modules;
use super::tins::OfTins;
use super::total::{LevelSums, Total, squares};
use crate::recount;
use build::ground::GamingArea;
use build::{Adding, Sums, limit_of, residual_of, sums_of};

/// The first revision that measures the heights of all levels, not of the finest alone.
const ALL_LEVELS_SINCE: u32 = 10;

/// Statistics of a load module that no residuals of that many posts have.
pub(crate) fn impossible(area: &GamingArea, module: &LoadModule) -> Option<String> {
    let ModuleResidual { posts, largest, sum_abs, sum_squared } = module.residual;
    let owned = area.grid.posts_of(module.id).post_count() as u128;
    let possible = u128::from(posts) <= owned && is_possible(posts.into(), largest, sum_abs.into(), sum_squared.into());
    (!possible).then(|| format!("load module {}: no residuals have the sums in its file", module.id))
}

/// Whether `posts` numbers up to `largest` can have these sums.
fn is_possible(posts: u128, largest: u32, sum_abs: u128, sum_squared: u128) -> bool {
    let largest = u128::from(largest);
    largest <= sum_abs
        && sum_abs <= posts.saturating_mul(largest)
        && largest * largest <= sum_squared
        && sum_squared <= largest.saturating_mul(sum_abs)
        && sum_abs <= sum_squared
}

/// What was measured of every tile, where it agrees with the load modules.
pub(crate) struct OfMeasured {
    /// Their sums; absent where something is wrong.
    pub sums: Option<Sums>,
    pub problems: Vec<String>,
}

/// Reads what was measured and holds it against load modules and TINs.
pub(crate) fn measured(
    folder: &Folder,
    manifest: &Manifest,
    area: &GamingArea,
    levels: &[Modules],
    tins: &OfTins,
) -> OfMeasured {
    let (mut problems, adding) = (Vec::new(), Adding::default());
    for (record, &points) in manifest.tiles.iter().zip(&tins.points) {
        let tile = record.tile();
        let read = match folder.read_measured(tile) {
            Ok((.., read)) => read,
            Err(error) => {
                problems.push(error.to_string());
                continue;
            }
        };
        let of_tile: Vec<Rc<LoadModule>> = levels.iter().flat_map(|level| level.of_tile(tile)).collect();
        let of_files = (record.slm, manifest.algorithm_revision);
        let finest = area.tiling.modules(tile, area.grid).count();
        let wrong = differing(&read, of_files, &of_tile, finest, points);
        problems.extend(wrong.into_iter().map(|what| format!("measured/{tile}.sums: {what}")));
        if problems.is_empty() {
            adding.add(sums_of(read));
        }
    }
    OfMeasured { sums: problems.is_empty().then(|| adding.finish()), problems }
}

fn differing(
    read: &Measured,
    (slm, revision): (Option<store::FileStamp>, u32),
    modules: &[Rc<LoadModule>],
    finest: usize,
    points: u64,
) -> Vec<&'static str> {
    let mut problems = Vec::new();
    if Some(read.modules_file) != slm {
        problems.push("was measured of another load-module file");
    }
    if !read.modules.iter().copied().eq(modules.iter().map(|module| numbers(module))) {
        problems.push("its numbers of load modules are not those of the load-module file");
    }
    let finest = &modules[..finest.min(modules.len())];
    let tallies = read.classes.iter().chain(&read.at_source_grid).chain(&read.at_source);
    if Total::of_tallies(&read.classes) != Total::of(finest.iter().map(|module| module.residual)) {
        problems.push("its residuals by class do not add up to those of the load modules");
    }
    let is_sound = |tally: &MeasuredTally| {
        let bins: u128 = tally.bins.iter().map(|&(_, posts)| u128::from(posts)).sum();
        let sums = is_possible(tally.posts.into(), tally.largest, tally.sum_abs.into(), squares(tally));
        bins == u128::from(tally.posts) && sums && tally.sum.unsigned_abs() <= tally.sum_abs
    };
    if !tallies.into_iter().all(is_sound) {
        problems.push("no residuals have the sums and the histogram that it has");
    }
    if read.points.iter().map(|&points| u128::from(points)).sum::<u128>() != u128::from(points) {
        problems.push("its points by class do not add up to those of the TIN");
    }
    let of_heights = if revision < ALL_LEVELS_SINCE { finest } else { modules };
    let heights = || of_heights.iter().flat_map(|module| &module.vertices).map(|vertex| vertex.z);
    if Some(read.heights[0]) != heights().min() || Some(read.heights[1]) != heights().max() {
        problems.push("its lowest and highest vertex are not those of the load modules");
    }
    problems
}

fn numbers(module: &LoadModule) -> MeasuredModule {
    let ModuleResidual { posts, largest, sum_abs, sum_squared } = module.residual;
    let ModuleCounts { triangles, polygons } = module.counts();
    MeasuredModule { triangles, polygons, posts, largest, sum_abs, sum_squared }
}

/// Totals of `database.json` that are not those of the files.
pub(crate) fn differing_totals(
    manifest: &Manifest,
    area: &GamingArea,
    sums: &LevelSums,
    (counts, exceeded): (&[u32], &[Exceeded]),
    tins: &OfTins,
) -> Vec<String> {
    let residual = sums.residual;
    let over = counts.iter().filter(|&&count| area.budget.per_module < count).count();
    let totals = &manifest.totals;
    let pairs = [
        ("points", tins.points.iter().map(|&points| u128::from(points)).sum(), totals.points),
        ("triangles", sums.triangles.into(), totals.triangles),
        ("polygons", sums.polygons.into(), totals.polygons),
        ("load modules above the limit", over as u128, totals.modules_over),
        ("limits exceeded", exceeded.len() as u128, totals.breaches),
        ("refused posts", tins.refused.iter().map(|&count| u128::from(count)).sum(), totals.refused),
        ("posts", residual.posts, totals.residual_posts),
        ("largest residual", residual.largest.into(), totals.residual_largest),
        ("sum of absolute residuals", residual.sum_abs, totals.residual_sum_abs),
        ("sum of squared residuals", residual.sum_squared, totals.residual_sum_squared),
    ];
    let differing = pairs.into_iter().filter(|&(_, found, listed)| found != u128::from(listed));
    differing.map(|(what, found, listed)| format!("{what}: {found} in the files, {listed} in database.json")).collect()
}

/// Whether a report says itself that tiles were made from other ground than it measured residuals against.
pub(super) fn is_of_other_ground(report: &Report) -> bool {
    report.warnings.iter().any(|warning| warning.contains("made from other ground"))
}

/// Numbers of the report that are not those of the files, by key.
pub(crate) fn differing_report(
    report: &Report,
    job: &Job,
    area: &GamingArea,
    levels: &[LevelSums],
    (counts, tins, sums): (&[u32], &OfTins, Option<&Sums>),
) -> Vec<String> {
    let mut figures = Figures::default();
    of_counts(&mut figures, report, job, area, &levels[0], counts);
    of_points(&mut figures, report, area, tins);
    of_levels(&mut figures, report, job, levels);
    if let Some(sums) = sums.filter(|_| !is_of_other_ground(report)) {
        of_residuals(&mut figures, report, job, &levels[0], sums);
    }
    let mut problems = figures.problems();
    if report.area != job.area.name {
        problems.push(format!("report.json: area is \"{}\", the job's is \"{}\"", report.area, job.area.name));
    }
    let word = job.counted_words();
    if report.count != word {
        problems.push(format!("report.json: count is \"{}\", the job's is \"{word}\"", report.count));
    }
    problems
}

/// Residuals of the report, overall and of these classes, that are not those measured now.
pub(crate) fn differing_residuals(report: &Report, measured: &Residuals, classes: &[String]) -> Vec<String> {
    let mut figures = Figures::default();
    figures.residual("residual", &residual_of(&measured.total()), &report.residual);
    for ((name, tally), listed) in classes.iter().zip(&measured.classes).zip(&report.classes) {
        figures.residual(&format!("residual of class \"{name}\""), &residual_of(tally), &listed.residual);
    }
    figures.problems()
}

/// Keys, what the files say, what the report says.
#[derive(Default)]
struct Figures(Vec<(String, f64, f64)>);

impl Figures {
    /// Counts below 2^53 are compared as they are.
    fn count(&mut self, key: &str, found: impl TryInto<u64>, listed: u64) {
        let found = found.try_into().unwrap_or(u64::MAX);
        self.number(key, found as f64, listed as f64);
    }

    fn number(&mut self, key: &str, found: f64, listed: f64) {
        self.0.push((key.to_owned(), found, listed));
    }

    fn residual(&mut self, key: &str, found: &ReportResidual, listed: &ReportResidual) {
        let pairs = [
            ("rms_m", found.rms_m, listed.rms_m),
            ("max_m", found.max_m, listed.max_m),
            ("mean_abs_m", found.mean_abs_m, listed.mean_abs_m),
            ("p95_m", found.p95_m, listed.p95_m),
            ("p99_m", found.p99_m, listed.p99_m),
        ];
        pairs.into_iter().for_each(|(name, found, listed)| self.number(&format!("{key}.{name}"), found, listed));
    }

    fn problems(self) -> Vec<String> {
        // Quotients and roots may differ in their last digits where they are written in another order.
        let differ = |found: f64, listed: f64| {
            let is_near = (found - listed).abs() <= 1e-9 * (1.0 + found.abs());
            !is_near
        };
        let wrong = self.0.into_iter().filter(|&(_, found, listed)| differ(found, listed));
        wrong.map(|(key, found, listed)| format!("report.json: {key} is {listed}, the files say {found}")).collect()
    }
}

fn of_counts(figures: &mut Figures, report: &Report, job: &Job, area: &GamingArea, sums: &LevelSums, counts: &[u32]) {
    let budget = &area.budget;
    let limit = u64::from(budget.per_module);
    let all: u64 = counts.iter().map(|&count| u64::from(count)).sum();
    let over = |count: &&u32| limit < u64::from(**count);
    let above: u64 = counts.iter().map(|&count| u64::from(count).saturating_sub(limit)).sum();
    figures.count("triangles", sums.triangles, report.triangles);
    figures.count("polygons", sums.polygons, report.polygons);
    let listed = &report.per_load_module;
    figures.number("per_load_module.mean", all as f64 / counts.len() as f64, listed.mean);
    figures.number("per_load_module.mean_limit", job.limits.mean_per_load_module, listed.mean_limit);
    figures.count("per_load_module.max", counts.iter().copied().max().unwrap_or(0), listed.max);
    figures.count("per_load_module.limit", limit, listed.limit);
    figures.count("per_load_module.over", counts.iter().filter(over).count(), listed.over);
    let windows = |rows: u32, cols: u32| recount::windows(area.grid, counts, rows, cols).map(|(_, count)| count);
    let (rows, cols) = (budget.windows.rows, budget.windows.cols);
    let window_limit = u64::from(budget.per_window);
    let listed = &report.per_4km;
    figures.count("per_4km.max", windows(rows, cols).max().unwrap_or(0), listed.max);
    figures.count("per_4km.limit", window_limit, listed.limit);
    figures.count("per_4km.over", windows(rows, cols).filter(|&count| window_limit < count).count(), listed.over);
    figures.count("per_4km.worst_9x9", windows(rows + 1, cols + 1).max().unwrap_or(0), listed.worst_9x9);
    figures.count("pool.size", budget.pool, report.pool.size);
    figures.count("pool.used", above.min(budget.pool), report.pool.used);
}

fn of_points(figures: &mut Figures, report: &Report, area: &GamingArea, tins: &OfTins) {
    let total: u64 = tins.points.iter().sum();
    let corner = u64::from(area.grid.rows + 1) * u64::from(area.grid.cols + 1);
    figures.count("points.total", total, report.points.total);
    figures.count("points.corner", corner, report.points.corner);
    figures.count("points.border", tins.border, report.points.border);
    figures.count("points.selected", total.saturating_sub(corner + tins.border), report.points.selected);
    let [by_module, by_window, by_reservation] = tins.refused;
    let listed = &report.refusals;
    figures.count("refusals.count", tins.refused.iter().sum::<u64>(), listed.count);
    figures.count("refusals.by_module", by_module, listed.by_module);
    figures.count("refusals.by_window", by_window, listed.by_window);
    figures.count("refusals.by_reservation", by_reservation, listed.by_reservation);
    figures.number("refusals.largest_m", metres_of_quanta(tins.refused_largest as i32), listed.largest_m);
    let stopped = |reason| tins.stops.iter().filter(|&&stop| stop == reason).count();
    figures.count("stops.budget_spent", stopped(StopReason::BudgetSpent), report.stops.budget_spent);
    figures.count("stops.residual_reached", stopped(StopReason::ResidualReached), report.stops.residual_reached);
    figures.count("stops.rms_reached", stopped(StopReason::RmsReached), report.stops.rms_reached);
    figures.count("stops.exhausted", stopped(StopReason::Exhausted), report.stops.exhausted);
}

fn of_levels(figures: &mut Figures, report: &Report, job: &Job, levels: &[LevelSums]) {
    let wanted = if job.lod.inner_shares.is_empty() { 0 } else { levels.len() };
    figures.count("number of levels", wanted, report.levels.len() as u64);
    let shares = std::iter::once(1.0).chain(job.lod.inner_shares.iter().copied());
    for ((at, listed), (sums, share)) in report.levels.iter().enumerate().zip(levels.iter().zip(shares)) {
        let key = |name: &str| format!("levels[{at}].{name}");
        let total = sums.residual;
        figures.count(&key("level"), at, listed.level.into());
        figures.number(&key("inner_share"), share, listed.inner_share);
        figures.count(&key("triangles"), sums.triangles, listed.triangles);
        figures.number(&key("rms_m"), total.rms_m(), listed.rms_m);
        figures.number(&key("max_m"), total.max_m(), listed.max_m);
    }
}

fn of_residuals(figures: &mut Figures, report: &Report, job: &Job, finest: &LevelSums, sums: &Sums) {
    let total = sums.residuals.total();
    figures.residual("residual", &residual_of(&total), &report.residual);
    if let (Some(found), Some(listed)) = (limit_of(&sums.curvature, report.triangles, &total), &report.limit) {
        figures.count("limit.triangles", found.triangles, listed.triangles);
        figures.number("limit.rms_m", found.rms_m, listed.rms_m);
        figures.number("limit.eta", found.eta.unwrap_or(0.0), listed.eta.unwrap_or(0.0));
        figures.number("limit.rough_share", found.rough_share, listed.rough_share);
    }
    let at_grid = sums.at_source_grid.as_ref().unwrap_or(&total);
    if let Some(listed) = &report.residual_against_source_grid {
        figures.residual("residual_against_source_grid", &residual_of(at_grid), listed);
    }
    if let Some(listed) = &report.residual_against_source {
        let found = if sums.has_source { &sums.at_source } else { at_grid };
        figures.residual("residual_against_source", &residual_of(found), listed);
    }
    if let Some(listed) = &report.border {
        let parts = [("at_border", finest.at_border, &listed.at_border), ("inside", finest.inside, &listed.inside)];
        for (name, part, listed) in parts {
            figures.count(&format!("border.{name}.posts"), part.posts, listed.posts);
            figures.number(&format!("border.{name}.rms_m"), part.rms_m(), listed.rms_m);
            figures.number(&format!("border.{name}.max_m"), part.max_m(), listed.max_m);
        }
    }
    if let Some(listed) = &report.heights {
        let (low, high) = sums.heights;
        figures.number("heights.surface_m[0]", metres_of_quanta(low), listed.surface_m[0]);
        figures.number("heights.surface_m[1]", metres_of_quanta(high), listed.surface_m[1]);
    }
    let (mut squares, mut points) = (0.0, 0.0);
    for (at, name) in job.class_names().iter().enumerate() {
        let tally = sums.residuals.classes.get(at).cloned().unwrap_or_default();
        let own = sums.points.get(at).copied().unwrap_or(0);
        if 0 < tally.posts {
            squares += own as f64 * tally.rms_m() * tally.rms_m();
            points += own as f64;
        }
        let Some(listed) = report.classes.get(at).filter(|listed| listed.name == *name) else {
            figures.count(&format!("number of classes named \"{name}\""), 1u64, 0);
            continue;
        };
        figures.count(&format!("classes[{at}].posts"), tally.posts, listed.posts);
        figures.count(&format!("classes[{at}].points"), own, listed.points);
        figures.residual(&format!("classes[{at}].residual"), &residual_of(&tally), &listed.residual);
    }
    let weighted: f64 = if points == 0.0 { 0.0 } else { f64::sqrt(squares / points) };
    figures.number("overall_point_weighted_rms_m", weighted, report.overall_point_weighted_rms_m);
}
