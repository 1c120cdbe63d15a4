//! The numbers of a finished build, as the report gives them. Times are added by the caller, who holds the clock.

use std::collections::{BTreeMap, BTreeSet};

use crate::product::Told;
use fidelity::{Curvature, Residuals, Tally};
use job::{HOLE_CLASS_NAME, OuterBorder};
use store::{
    Report, ReportBefore, ReportBorder, ReportBreach, ReportClass, ReportEnough, ReportHeights, ReportLevel,
    ReportLimit, ReportPart, ReportPerModule, ReportPerWindow, ReportPlace, ReportPoints, ReportPool, ReportRefusals,
    ReportResidual, ReportStops, ReportVoids, Totals,
};
use terrain::limits::Windows;
use terrain::{ModuleId, ModuleResidual, RefusedBy, StopReason, metres_of_quanta};

use crate::CompileError;
use crate::bound::{bound, of_area};
use crate::budgets::{Budgeted, enough_for};
use crate::enforce::{ByModule, Enforced, counted};
use crate::refine::Published;
use crate::run::Run;
use crate::sums::{Assembled, ModuleNumbers, RefusedPosts, Sums};

/// Millimetres in a metre: the unit in which a residual's breach is counted.
const MILLIMETRES: f64 = 1000.0;

/// What limits kept out, by load module.
type Refused = BTreeMap<ModuleId, RefusedPosts>;

/// All that a report says but times.
pub(crate) struct Findings<'a> {
    pub run: &'a Run<'a>,
    pub tins: &'a [Published],
    pub assembled: &'a [Assembled],
    pub sums: &'a Sums,
    pub enforced: &'a Enforced,
}

impl Findings<'_> {
    /// The report.
    ///
    /// # Errors
    /// When what a limit cost cannot be computed.
    pub fn report(&self) -> Result<Report, CompileError> {
        let run = self.run;
        let residuals = &self.sums.residuals;
        let total = residuals.total();
        let refused = of_area(self.tins);
        let counts = self.counts();
        let points = self.points();
        let breaches = self.breaches(&counts, &refused, &total);
        let numbers = self.by_module();
        let sum = |count: fn(&ModuleNumbers) -> u32| -> u64 { numbers.iter().map(|one| u64::from(count(one))).sum() };
        let bound = bound(run, self.tins, &refused, &counts, &numbers)?;
        Ok(Report {
            area: run.job.area.name.clone(),
            workers: run.workers.count() as u32,
            stages: Vec::new(),
            points,
            count: run.job.counted_words().into(),
            triangles: sum(|numbers| numbers.triangles),
            polygons: sum(|numbers| numbers.polygons),
            per_load_module: self.per_module(&counts),
            per_4km: self.per_window(&counts),
            pool: self.pool(&counts),
            before_removals: self.before_removals(),
            residual: residual_of(&total),
            limit: limit_of(&self.sums.curvature, sum(|numbers| numbers.triangles), &total),
            border: self.border(),
            heights: Some(self.heights()),
            residual_against_source_grid: Some(residual_of(self.at_source_grid(&total))),
            residual_against_source: run.ground.relief.has_source_posts().then(|| self.at_source(&total)),
            classes: self.classes(residuals),
            features: None,
            objects: None,
            enough: self.enough()?,
            levels: self.levels(),
            overall_point_weighted_rms_m: self.point_weighted_rms_m(residuals),
            dem_accuracy_m: run.ground.accuracy_m,
            voids: ReportVoids {
                count: (run.ground.voids.filled + run.ground.voids.left) as u64,
                filled: run.ground.voids.filled as u64,
            },
            breaches,
            refusals: refusals(&refused),
            bound,
            stops: self.stops(),
            warnings: run.warnings()?,
            outdated: false,
            tiles: Vec::new(),
            files: BTreeMap::new(),
        })
    }

    /// What is told of features, in jobs with some.
    pub fn told(&self) -> Option<Told> {
        let (settled, figures) = (self.run.level.as_ref()?, self.sums.features.as_ref()?);
        Some(crate::product::told(self.run.job, &self.run.area, &settled.level, figures))
    }

    /// Limits that would keep nearly all features, where too much had no room.
    fn enough(&self) -> Result<Option<ReportEnough>, CompileError> {
        let level = self.run.level.as_ref().map(|settled| &settled.level);
        if !level.is_some_and(|level| crate::product::leaves_much_out(self.run.job, level)) {
            return Ok(None);
        }
        let enough = enough_for(self.run)?;
        Ok(enough.map(|Budgeted { mean, per_load_module, per_window, .. }| ReportEnough {
            mean,
            per_load_module,
            per_4km: per_window,
        }))
    }

    fn stops(&self) -> ReportStops {
        let count = |reason| self.tins.iter().filter(|tile| tile.stop == reason).count() as u64;
        ReportStops {
            budget_spent: count(StopReason::BudgetSpent),
            residual_reached: count(StopReason::ResidualReached),
            rms_reached: count(StopReason::RmsReached),
            exhausted: count(StopReason::Exhausted),
        }
    }

    /// The sums of the manifest.
    pub fn totals(&self, report: &Report) -> Totals {
        // From the load modules' own numbers, which `verify` adds up again.
        let of_modules = self.by_module();
        let sum = |of: fn(&ModuleNumbers) -> u64| of_modules.iter().map(of).sum::<u64>();
        Totals {
            points: report.points.total,
            triangles: report.triangles,
            polygons: report.polygons,
            modules_over: report.per_load_module.over,
            breaches: report.breaches.len() as u64,
            refused: report.refusals.count,
            residual_posts: sum(|numbers| u64::from(numbers.residual.posts)),
            residual_largest: of_modules.iter().map(|numbers| u64::from(numbers.residual.largest)).max().unwrap_or(0),
            residual_sum_abs: sum(|numbers| numbers.residual.sum_abs),
            residual_sum_squared: sum(|numbers| numbers.residual.sum_squared),
        }
    }

    fn by_module(&self) -> ByModule<'_> {
        ByModule { run: self.run, assembled: self.assembled }
    }

    /// Against the source's heights alone; the working ground's where nothing is burned into that.
    fn at_source_grid<'a>(&'a self, total: &'a Tally) -> &'a Tally {
        self.sums.at_source_grid.as_ref().unwrap_or(total)
    }

    /// Against the source's posts; the working grid's where those are the same.
    fn at_source(&self, total: &Tally) -> ReportResidual {
        residual_of(if self.sums.has_source { &self.sums.at_source } else { self.at_source_grid(total) })
    }

    fn counts(&self) -> Vec<u32> {
        let mut counts: Vec<u32> = self.by_module().iter().map(|numbers| counted(self.run, numbers)).collect();
        counts.iter_mut().zip(self.run.joint_objects()).for_each(|(count, objects)| *count += objects);
        counts
    }

    fn points(&self) -> ReportPoints {
        let grid = self.run.area.grid;
        let total: u64 = self.sums.points.iter().sum();
        let corner = u64::from(grid.rows + 1) * u64::from(grid.cols + 1);
        let border = self.sums.border;
        ReportPoints { selected: total - corner - border, border, corner, total }
    }

    fn per_module(&self, counts: &[u32]) -> ReportPerModule {
        let limit = self.run.area.budget.per_module;
        let sum: u64 = counts.iter().map(|&count| u64::from(count)).sum();
        ReportPerModule {
            mean: sum as f64 / counts.len() as f64,
            mean_limit: self.run.job.limits.mean_per_load_module,
            max: u64::from(counts.iter().copied().max().unwrap_or(0)),
            limit: u64::from(limit),
            over: counts.iter().filter(|&&count| limit < count).count() as u64,
        }
    }

    fn per_window(&self, counts: &[u32]) -> ReportPerWindow {
        let budget = &self.run.area.budget;
        let largest = |windows: &Windows| u64::from(windows.sums(budget.grid, counts).into_iter().max().unwrap_or(0));
        let sums = budget.windows.sums(budget.grid, counts);
        let wider = Windows::of_size(budget.grid, budget.windows.rows + 1, budget.windows.cols + 1);
        ReportPerWindow {
            max: largest(&budget.windows),
            limit: u64::from(budget.per_window),
            over: sums.iter().filter(|&&sum| budget.per_window < sum).count() as u64,
            worst_9x9: largest(&wider),
        }
    }

    fn before_removals(&self) -> Option<ReportBefore> {
        let before = self.enforced.before.as_ref()?;
        let counts: Vec<u32> = before.iter().map(|numbers| counted(self.run, numbers)).collect();
        Some(ReportBefore {
            // A point on a line between tiles is in the lists of both.
            removed: self.enforced.removed.iter().flatten().collect::<BTreeSet<_>>().len() as u64,
            per_load_module: self.per_module(&counts),
            per_4km: self.per_window(&counts),
        })
    }

    fn pool(&self, counts: &[u32]) -> ReportPool {
        let limit = self.run.area.budget.per_module;
        let above: u64 = counts.iter().map(|&count| u64::from(count.saturating_sub(limit))).sum();
        ReportPool { size: self.run.area.budget.pool, used: above.min(self.run.area.budget.pool) }
    }

    /// Load modules at the outer border and the others apart; `None` where there are no others.
    fn border(&self) -> Option<ReportBorder> {
        let grid = self.run.area.grid;
        let at_border = |id: ModuleId| id.row == 0 || id.col == 0 || id.row + 1 == grid.rows || id.col + 1 == grid.cols;
        let numbers = self.by_module();
        let part = |wanted: bool| {
            let modules = grid.all().iter().filter(|&id| at_border(id) == wanted);
            part_of(modules.map(|id| numbers.get(id).residual))
        };
        let inside = part(false);
        let fixed = self.run.job.modules.outer_border == OuterBorder::Fixed;
        (0 < inside.posts).then(|| ReportBorder { at_border: part(true), fixed, inside })
    }

    fn heights(&self) -> ReportHeights {
        let (low, high) = self.sums.heights;
        let bounds = self.run.ground.bounds();
        let outside_m = bounds.map_or(0.0, |bounds| bounds.metres_outside(low).max(bounds.metres_outside(high)));
        let sources_m = bounds.map(|bounds| bounds.metres().into());
        ReportHeights { surface_m: [low, high].map(metres_of_quanta), sources_m, outside_m }
    }

    fn classes(&self, residuals: &Residuals) -> Vec<ReportClass> {
        let nothing = Tally::default();
        let class = |(index, name): (usize, &String)| {
            let tally = residuals.classes.get(index).unwrap_or(&nothing);
            let points = self.sums.points[index];
            ReportClass { name: name.clone(), posts: tally.posts, points, residual: residual_of(tally) }
        };
        let names = &self.run.job.class_names();
        let mut classes: Vec<_> = names.iter().enumerate().map(class).collect();
        let (left, over_holes) = (self.run.ground.voids.left, self.sums.points.get(names.len()));
        if 0 < left || over_holes.is_some() {
            // Nothing is known there to measure against.
            let (points, residual) = (over_holes.copied().unwrap_or(0), residual_of(&nothing));
            classes.push(ReportClass { name: HOLE_CLASS_NAME.into(), posts: 0, points, residual });
        }
        classes
    }

    /// Figures of every level, where there are several.
    fn levels(&self) -> Vec<ReportLevel> {
        let shares = &self.run.job.lod.inner_shares;
        if shares.is_empty() {
            return Vec::new();
        }
        let finest = self.assembled.iter().flat_map(|tile| &tile.modules);
        let coarser = |at: usize| self.assembled.iter().filter_map(move |tile| tile.coarser.get(at)).flatten();
        let first = level_figures(0, 1.0, finest);
        let rest = shares.iter().enumerate().map(|(at, &share)| level_figures(at as u32 + 1, share, coarser(at)));
        std::iter::once(first).chain(rest).collect()
    }

    /// The paper's way to pool classes: each by its points, not by its posts.
    fn point_weighted_rms_m(&self, residuals: &Residuals) -> f64 {
        let (mut squares, mut points) = (0.0, 0.0);
        for (index, tally) in residuals.classes.iter().enumerate().filter(|(_, tally)| 0 < tally.posts) {
            let weight = self.sums.points[index] as f64;
            squares += weight * tally.rms_m() * tally.rms_m();
            points += weight;
        }
        if points == 0.0 { 0.0 } else { (squares / points).sqrt() }
    }

    fn breaches(&self, counts: &[u32], refused: &Refused, total: &Tally) -> Vec<ReportBreach> {
        let budget = &self.run.area.budget;
        let mut breaches = self.module_breaches(counts, refused);
        let sums = budget.windows.sums(budget.grid, counts);
        for (origin, &sum) in budget.windows.origins.iter().zip(&sums).filter(|&(_, &sum)| budget.per_window < sum) {
            let inside: Vec<ModuleId> = budget.windows.modules_of(origin).iter().collect();
            let place = ReportPlace::Window([origin.row, origin.col]);
            breaches.push(self.breach("per_4km_square", place, sum, budget.per_window, (&inside, refused)));
        }
        let sum: u64 = counts.iter().map(|&count| u64::from(count)).sum();
        if budget.area < sum {
            let breach = self.breach("mean_per_load_module", ReportPlace::Area, 0, 0, (&[], refused));
            let (count, limit, excess, rms_with_m) = (sum, budget.area, sum - budget.area, total.rms_m());
            breaches.push(ReportBreach { count, limit, excess, rms_with_m, ..breach });
        }
        breaches.extend(self.residual_breaches(refused, total));
        breaches
    }

    fn module_breaches(&self, counts: &[u32], refused: &Refused) -> Vec<ReportBreach> {
        let budget = &self.run.area.budget;
        let mut over: Vec<(u32, ModuleId)> = budget
            .grid
            .all()
            .iter()
            .zip(counts)
            .filter(|&(_, &count)| budget.per_module < count)
            .map(|(module, &count)| (count, module))
            .collect();
        over.sort_unstable();
        let mut pool = budget.pool;
        let mut breaches = Vec::new();
        for (count, module) in over {
            let excess = u64::from(count - budget.per_module);
            if excess <= pool {
                pool -= excess;
                continue;
            }
            let place = ReportPlace::Module([module.row, module.col]);
            let here = (&[module][..], refused);
            breaches.push(self.breach("per_load_module", place, count, budget.per_module, here));
        }
        breaches
    }

    fn breach(
        &self,
        kind: &str,
        place: ReportPlace,
        count: u32,
        limit: u32,
        (inside, refused): (&[ModuleId], &Refused),
    ) -> ReportBreach {
        let (grid, now) = (self.run.area.grid, self.by_module());
        let before = self.enforced.before.as_ref();
        let rms =
            |of: &dyn Fn(ModuleId) -> ModuleNumbers| part_of(inside.iter().map(|&module| of(module).residual)).rms_m;
        ReportBreach {
            kind: kind.into(),
            place,
            count: u64::from(count),
            limit: u64::from(limit),
            excess: u64::from(count.saturating_sub(limit)),
            refused: inside.iter().filter_map(|module| refused.get(module)).map(RefusedPosts::count).sum(),
            rms_with_m: rms(&|module| *now.get(module)),
            rms_without_m: before.map(|before| rms(&|module| before[grid.index(module)])),
        }
    }

    /// Residuals that the job asked for and that something else kept from being reached.
    fn residual_breaches(&self, refused: &Refused, total: &Tally) -> Vec<ReportBreach> {
        let tin = &self.run.job.tin;
        let asked = [(tin.max_residual_m, total.max_m()), (tin.target_rms_m, total.rms_m())];
        let missed = asked.into_iter().filter_map(|(limit, found)| Some((limit?, found)));
        missed
            .filter(|(limit, found)| limit < found)
            .map(|(limit, found)| {
                let (count, limit) = ((found * MILLIMETRES).ceil() as u64, (limit * MILLIMETRES).floor() as u64);
                ReportBreach {
                    kind: "residual".into(),
                    place: ReportPlace::Area,
                    count,
                    limit,
                    excess: count.saturating_sub(limit),
                    refused: refused.values().map(RefusedPosts::count).sum(),
                    rms_with_m: total.rms_m(),
                    rms_without_m: None,
                }
            })
            .collect()
    }
}

/// Figures of one level from those of its load modules.
fn level_figures<'a>(level: u32, inner_share: f64, modules: impl Iterator<Item = &'a ModuleNumbers>) -> ReportLevel {
    let mut triangles = 0;
    let ReportPart { rms_m, max_m, .. } = part_of(modules.map(|numbers| {
        triangles += u64::from(numbers.triangles);
        numbers.residual
    }));
    ReportLevel { level, inner_share, triangles, rms_m, max_m }
}

/// Residuals of some load modules together.
fn part_of(residuals: impl Iterator<Item = ModuleResidual>) -> ReportPart {
    let (mut posts, mut squares, mut largest) = (0, 0u128, 0);
    for residual in residuals {
        posts += u64::from(residual.posts);
        squares += u128::from(residual.sum_squared);
        largest = largest.max(residual.largest);
    }
    let metre = f64::from(terrain::QUANTA_PER_METRE);
    let rms_m = if posts == 0 { 0.0 } else { (squares as f64 / posts as f64).sqrt() / metre };
    ReportPart { posts, rms_m, max_m: f64::from(largest) / metre }
}

fn refusals(refused: &Refused) -> ReportRefusals {
    let mut all = RefusedPosts::default();
    refused.values().for_each(|posts| all.merge(posts));
    let count = |by| u64::from(all.count_by(by));
    ReportRefusals {
        count: u64::from(all.count()),
        by_module: count(RefusedBy::Module),
        by_window: count(RefusedBy::Window),
        by_reservation: count(RefusedBy::Reservation),
        largest_m: metres_of_quanta(all.largest() as i32),
    }
}

/// How near residuals are to those of the best surface of so many triangles; `None` where the ground is too small.
pub fn limit_of(curvature: &Curvature, triangles: u64, total: &Tally) -> Option<ReportLimit> {
    let limit = curvature.limit(usize::try_from(triangles).unwrap_or(usize::MAX))?;
    let eta = limit.eta(total.rms_m());
    Some(ReportLimit { triangles, rms_m: limit.rms_m, eta, rough_share: limit.rough_share })
}

/// A tally as the report gives it.
pub fn residual_of(tally: &Tally) -> ReportResidual {
    if tally.posts == 0 {
        return ReportResidual::default();
    }
    ReportResidual {
        rms_m: tally.rms_m(),
        max_m: tally.max_m(),
        mean_abs_m: tally.mean_abs_m(),
        p95_m: tally.percentile_m(95.0),
        p99_m: tally.percentile_m(99.0),
    }
}
