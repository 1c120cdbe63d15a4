//! The stage `outlines`: what stands on the ground of the area and has room, before its heights are known. It sees
//! vectors, never a raster.

use features::objects::{Claims, Full, Granted, ObjectLimits, ObjectRemark, ObjectTally, Plan, Wanting, mended};
use job::{Job, ObjectsSpec};
use schedule::Workers;
use store::engine::{Artifact, Key, Outcome, Stamp, keep_or_make};
use store::{
    AreaOutlines, FeatureRemark, FileStamp, ModuleOutlines, ObjectLeftOut, ObjectSums, ReportObjectLimit,
    ReportObjects, ReportPlace,
};
use terrain::Each;
use tin::tiling::Budget;

use crate::budgets::Budgets;
use crate::ground::{FoundObjects, GamingArea};
use crate::keys;
use crate::run::{ALGORITHM_REVISION, Run};
use crate::{CompileError, Event, Progress, Stage};

/// What stands on the ground, where the job wants it: from here on load modules are assembled with it.
pub(crate) fn decide_objects(run: &mut Run, progress: &mut dyn Progress) -> Result<(), CompileError> {
    if run.job.objects.is_none() {
        return Ok(());
    }
    progress.tell(Event::Enter(Stage::Outlines, 0));
    let (file, outlines) = outlines_area(run)?.into_inner();
    progress.tell(Event::Leave(Stage::Outlines));
    outlines.notes.iter().for_each(|note| progress.tell(Event::Note(note.clone())));
    run.stand(file, outlines);
    Ok(())
}

/// The same of one process among others.
pub(crate) fn outlines_area(run: &Run) -> Result<Outcome<(FileStamp, AreaOutlines)>, CompileError> {
    let spec = run.job.objects.as_ref().expect("a stage of jobs with objects");
    let free = if run.job.features.is_some() { run.features()?.features.covered() } else { Vec::new() };
    // What objects themselves have already been granted is not taken off.
    let limits = limits_of(spec, &Budget { reserved: run.reserved_by_features(), ..run.area.budget.clone() });
    keep_or_make(&Outlining { run, spec, free, limits }, ALGORITHM_REVISION)
}

/// What stands on the ground, as the engine asks for it.
struct Outlining<'a> {
    run: &'a Run<'a>,
    spec: &'a ObjectsSpec,
    /// What woods leave free.
    free: Vec<Plan>,
    limits: ObjectLimits,
}

impl Artifact for Outlining<'_> {
    type Output = (FileStamp, AreaOutlines);
    type Error = CompileError;

    fn key(&self) -> Key {
        let limits = self.spec.joint.then_some(&self.limits);
        keys::outlines(self.run.job, self.spec, &self.run.records, (&self.free, limits))
    }

    fn published(&self) -> Result<Option<Stamp>, CompileError> {
        Ok(self.run.database.folder().outlines_stamp()?)
    }

    fn read(&self, _key: &Key) -> Option<(Stamp, (FileStamp, AreaOutlines))> {
        let (stamp, file, outlines) = self.run.database.folder().read_outlines().ok()?;
        Some((stamp, (file, outlines)))
    }

    fn make(&self, _key: &Key, stamp: &Stamp) -> Result<(FileStamp, AreaOutlines), CompileError> {
        let each = self.run.workers.each();
        let outlines = outlines_of(self.run.job, (self.spec, &self.free, &self.limits), &self.run.area, &each)?;
        Ok((self.run.database.write_outlines(stamp, &outlines)?, outlines))
    }
}

/// The objects of a job, on which limits are tried.
pub struct ObjectBudgets {
    spec: ObjectsSpec,
    budget: Budget,
    claims: Claims,
}

/// What a limit would keep of objects.
#[derive(Clone, Debug, PartialEq)]
pub struct ObjectBudget {
    /// Polygons of objects in a load module at most.
    pub per_load_module: u32,
    /// The same in a square of 4 km.
    pub per_window: u32,
    /// By kind.
    pub kinds: Vec<ObjectSums>,
}

impl ObjectBudget {
    /// Whether nearly all is kept that hides: 95 % of the silhouette of each kind.
    pub fn holds(&self) -> bool {
        const KEPT_MIN: f64 = 0.95;
        self.kinds.iter().all(|sums| KEPT_MIN * sums.wanted_m2 <= sums.kept_m2)
    }
}

/// Polygons of objects in a load module at most that are tried, from the usual limit on.
pub const OBJECT_BUDGETS: [u32; 7] = [400, 800, 1600, 3200, 6400, 12_800, 25_600];

impl ObjectBudgets {
    /// Reads the objects of a job, which leave its features free; `None` for a job without any.
    ///
    /// # Errors
    /// When a file cannot be read, or the job is impossible.
    pub fn open(job: &Job, features: Option<&Budgets>, workers: usize) -> Result<Option<Self>, CompileError> {
        let Some(spec) = &job.objects else { return Ok(None) };
        let (workers, area) = (Workers::new(workers), GamingArea::new(job)?);
        let found = FoundObjects::read(job, spec, &area, &workers.each())?;
        let free = features.map_or_else(Vec::new, Budgets::covered);
        let outlines = mended(found.objects, &spec.options).0;
        let mut budget = area.budget;
        if let Some(features) = features.filter(|_| spec.joint) {
            budget.reserved = features.reserved()?;
        }
        let limits = limits_of(spec, &budget);
        let claims = Claims::of(&outlines, &free, limits.size, job.modules.side_quanta.into());
        Ok(Some(Self { spec: spec.clone(), budget, claims }))
    }

    /// What would be kept with so many polygons in a load module, and 32 times as many in a square of 4 km.
    pub fn of(&self, per_load_module: u32) -> ObjectBudget {
        let spec = ObjectsSpec { per_load_module, per_4km_square: 32 * per_load_module, ..self.spec.clone() };
        let kinds = self.claims.kept(&limits_of(&spec, &self.budget)).into_iter().map(sums_of).collect();
        ObjectBudget { per_load_module, per_window: spec.per_4km_square, kinds }
    }
}

/// What stands on the ground of a job's area within its limits.
pub(crate) fn outlines_of(
    job: &Job,
    (spec, free, limits): (&ObjectsSpec, &[Plan], &ObjectLimits),
    area: &GamingArea,
    each: Each,
) -> Result<AreaOutlines, CompileError> {
    let FoundObjects { objects: found, remarks, notes } = FoundObjects::read(job, spec, area, each)?;
    let (outlines, mended) = mended(found, &spec.options);
    let granted = Claims::of(&outlines, free, limits.size, job.modules.side_quanta.into()).granted(limits);
    Ok(AreaOutlines { notes, ..to_outlines(job, granted, mended, remarks) })
}

/// The limits of objects in a job. Where they count together with the ground, they take at most half of what the points
/// that every build starts from and features leave in each load module, in each window and in the area.
fn limits_of(spec: &ObjectsSpec, budget: &Budget) -> ObjectLimits {
    let (grid, windows) = (budget.grid, &budget.windows);
    let pair = |rows: u32, cols: u32| [rows as i32, cols as i32];
    let most = [spec.per_load_module, spec.per_4km_square];
    let mut limits = ObjectLimits::even(most, pair(grid.rows, grid.cols), pair(windows.rows, windows.cols));
    if spec.joint {
        let start = budget.start();
        let lower = |most: &mut u32, limit: u32, start: u32| *most = (*most).min(limit.saturating_sub(start) / 2);
        limits.modules.iter_mut().zip(&start).for_each(|(most, &start)| lower(most, budget.per_module, start));
        for (origin, start) in windows.origins.iter().zip(windows.sums(grid, &start)) {
            lower(&mut limits.windows[grid.index(origin)], budget.per_window, start);
        }
        limits.area = budget.area.saturating_sub(budget.start_total()) / 2;
    }
    limits
}

fn sums_of((kind, [kept, wanted]): (terrain::ObjectKind, [ObjectTally; 2])) -> ObjectSums {
    ObjectSums {
        kind: kind.name().to_owned(),
        wanted: wanted.count,
        kept: kept.count,
        wanted_m2: wanted.silhouette_m2,
        kept_m2: kept.silhouette_m2,
    }
}

fn to_outlines(
    job: &Job,
    granted: Granted,
    mended: Vec<ObjectRemark>,
    mut remarks: Vec<FeatureRemark>,
) -> AreaOutlines {
    let Granted { modules, kinds, left_out, overlaps } = granted;
    let map = |[east, north]: [f64; 2]| [job.area.origin_m[0] + east, job.area.origin_m[1] + north];
    remarks.extend(mended.into_iter().map(|ObjectRemark { name, at_m, found, done }| FeatureRemark {
        feature: name,
        at_m: at_m.map(map),
        found,
        leaves_out: done.is_none(),
        done: done.unwrap_or("left out").to_owned(),
        degrades: false,
    }));
    remarks.extend(overlaps.into_iter().map(|at_m| FeatureRemark {
        feature: "wood".to_owned(),
        at_m: Some(map(at_m)),
        found: "roads, water or buildings under it, and no room for a wood that leaves them free".to_owned(),
        done: "left over them".to_owned(),
        leaves_out: false,
        degrades: false,
    }));
    let wanting = |Wanting { kind, at_m, height_m, silhouette_m2, full }: Wanting| {
        // Those beyond the area are granted nothing.
        let full = match full {
            Full::Module(module) => ReportPlace::Module(module.map(|at| at as u32)),
            Full::Window(window) => ReportPlace::Window(window.map(|at| at as u32)),
            Full::Area => ReportPlace::Area,
        };
        ObjectLeftOut { kind: kind.name().to_owned(), at_m: map(at_m), height_m, silhouette_m2, full }
    };
    let module = |([row, col], objects): ([i32; 2], terrain::Objects)| ModuleOutlines {
        // Those beyond the area are granted nothing.
        row: row as u32,
        col: col as u32,
        objects,
    };
    AreaOutlines {
        side: job.modules.side_quanta,
        modules: modules.into_iter().map(module).collect(),
        kinds: kinds.into_iter().map(sums_of).collect(),
        left_out: left_out.into_iter().map(wanting).collect(),
        remarks,
        notes: Vec::new(),
    }
}

/// What the report says of objects: how much of them has room, and how full load modules and windows are.
pub(crate) fn objects_report(run: &Run, outlines: &AreaOutlines) -> ReportObjects {
    let spec = run.job.objects.as_ref().expect("a stage of jobs with objects");
    let grid = run.area.grid;
    let counts = outlines.counts(grid);
    let sums = run.area.budget.windows.sums(grid, &counts);
    ReportObjects {
        kinds: outlines.kinds.clone(),
        polygons: counts.iter().map(|&count| u64::from(count)).sum(),
        per_load_module: ReportObjectLimit {
            max: counts.iter().max().copied().unwrap_or(0).into(),
            limit: spec.per_load_module.into(),
        },
        per_4km: ReportObjectLimit {
            max: sums.iter().max().copied().unwrap_or(0).into(),
            limit: spec.per_4km_square.into(),
        },
        left_out: outlines.left_out.len() as u64,
        remarks: outlines.remarks.len() as u64,
    }
}
