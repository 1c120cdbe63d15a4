//! What budgets of different size would keep of the roads and water of a job: heights are read along features once, and
//! each budget is tried on them, as the stages `profile` and `level` do. No TIN is made.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use crate::ground::{GamingArea, Ground};
use features::objects::Plan;
use features::{AreaFeatures, Formed, Kind, Levelled};
use job::{Job, LimitsSpec};
use schedule::Workers;
use store::Profile;
use terrain::{LineStorey, QUANTA_PER_METRE, TileId};

use crate::CompileError;
use crate::level::shares;
use crate::pieces::cost_of;
use crate::product::WIDE_MIN;
use crate::profile::sound;
use crate::read_features::{Heard, ReadFeatures};
use crate::run::Run;

/// Triangles of a load module on average that are tried: SIMNET's first.
pub const BUDGETS: [u32; 7] = [32, 64, 125, 250, 500, 1000, 2000];
/// Of a mean, what a load module may have at most, and a square of 4 km.
pub const BUDGET_TIMES: [u32; 2] = [3, 128];
/// What SIMNET's hardware held of a load module and of a square of 4 km.
pub const SIMNET: [u32; 2] = [100, 4096];
/// The share of the length of each kind that a budget is to keep: of motorways, primaries, rails and rivers, and of
/// every other kind.
pub const KEPT_MIN: [f64; 2] = [0.995, 0.95];
/// What a budget would keep of the features of an area.
#[derive(Clone, Debug, PartialEq)]
pub struct Budgeted {
    /// Triangles of a load module, on average over the area.
    pub mean: u32,
    /// At most in one load module.
    pub per_load_module: u32,
    /// At most in a window of 4 km.
    pub per_window: u32,
    /// Metres of ways by kind, in the table's order: kept, and all there are, tunnels not among them.
    pub kinds: Vec<(Kind, [f64; 2])>,
    /// Metres of motorways, primaries and rails in the ground: those that have their width, and those that are to.
    pub wide_m: [f64; 2],
    /// Lakes of 1 ha and more: kept, and all there are.
    pub lakes: [u32; 2],
    /// Triangles that features would take.
    pub triangles: u64,
    /// Whether these are the limits of the job itself.
    pub is_own: bool,
}

impl Budgeted {
    /// Whether it keeps nearly all: 99.5 % of motorways, primaries, rails and rivers, 95 % of every other kind, the
    /// width of 95 % of main ways, and every lake of 1 ha.
    pub fn holds(&self) -> bool {
        let enough = |&(kind, [kept, all]): &(Kind, [f64; 2])| {
            let is_main = matches!(kind, Kind::Motorway | Kind::Primary | Kind::Rail | Kind::River);
            KEPT_MIN[usize::from(!is_main)] * all <= kept
        };
        let [wide, all] = self.wide_m;
        self.lakes[0] == self.lakes[1] && self.kinds.iter().all(enough) && WIDE_MIN * all <= wide
    }

    /// Whether it keeps all there is, main ways in their width.
    pub fn is_whole(&self) -> bool {
        let [wide, all] = self.wide_m;
        self.lakes[0] == self.lakes[1] && all - wide < 1.0 && self.kinds.iter().all(|(_, [kept, all])| all - kept < 1.0)
    }

    /// Metres of all kinds for which `picked` says so: kept, and all there are.
    pub fn metres(&self, picked: impl Fn(Kind) -> bool) -> [f64; 2] {
        let of = self.kinds.iter().filter(|(kind, _)| picked(*kind)).map(|(_, metres)| *metres);
        of.fold([0.0; 2], |[kept, all], [more_kept, more]| [kept + more_kept, all + more])
    }
}

/// The limits of a mean: those of SIMNET for its own, else three times as much for a load module and 128 times as much
/// for a square of 4 km.
pub fn limits_of(mean: u32) -> [u32; 2] {
    if mean == BUDGETS[0] { SIMNET } else { BUDGET_TIMES.map(|times| mean.saturating_mul(times)) }
}

/// The features of a job with the heights along them, on which budgets are tried.
pub struct Budgets {
    job: Job,
    read: Arc<ReadFeatures>,
    heard: Heard,
    workers: Workers,
}

impl Budgets {
    /// Reads the features of a job and the ground along them; `None` for a job without any.
    ///
    /// # Errors
    /// When features or rasters cannot be read, or the job is impossible.
    pub fn open(job: &Job, workers: usize) -> Result<Option<Self>, CompileError> {
        let (workers, stop) = (Workers::new(workers), AtomicBool::new(false));
        let area = GamingArea::new(job)?;
        let Some(read) = ReadFeatures::open(job, &area, &workers.each())? else { return Ok(None) };
        let source = Ground::open(job, &area, &workers, &stop)?;
        let sounded = |&tile| Ok(sound(&area, &read, tile, &source.natural_tile(&area, tile)?.dem));
        let profiles: Vec<Profile> = area.tiles.iter().map(sounded).collect::<Result<_, CompileError>>()?;
        let heard = Heard::of(&read, profiles.iter());
        Ok(Some(Self { job: job.clone(), read: Arc::new(read), heard, workers }))
    }

    /// What ground they cover, in quanta.
    pub(crate) fn covered(&self) -> Vec<Plan> {
        self.read.features.covered()
    }

    /// What a mean and its limits would keep.
    ///
    /// # Errors
    /// When the job is impossible with these limits.
    pub fn of_mean(&self, mean: u32) -> Result<Budgeted, CompileError> {
        let mut limits = self.job.limits;
        [limits.per_load_module, limits.window.limit] = limits_of(mean);
        limits.mean_per_load_module = f64::from(mean);
        self.of_limits(limits)
    }

    /// What the limits of the job itself would keep.
    ///
    /// # Errors
    /// When the job is impossible.
    pub fn of_job(&self) -> Result<Budgeted, CompileError> {
        self.of_limits(self.job.limits)
    }

    fn of_limits(&self, limits: LimitsSpec) -> Result<Budgeted, CompileError> {
        let job = Job { limits, ..self.job.clone() };
        let Levelled { reserved, .. } = self.levelled(&job, &GamingArea::new(&job)?);
        let lakes = reserved.amounts.values();
        let lakes = lakes.fold([0; 2], |[kept, all], of| [kept + of.lakes_kept, all + of.lakes_wanted]);
        let triangles = reserved.cost.values().flat_map(BTreeMap::values).map(|&count| u64::from(count)).sum();
        let metres = |quanta: i64| quanta as f64 / f64::from(QUANTA_PER_METRE);
        let main = reserved.amounts.values().filter(|of| of.is_main);
        let wide = main.fold([0; 2], |[wide, all], of| [wide + of.wide[1], all + of.wide[0]]);
        let (kinds, wide_m) = (self.kinds(&reserved.formed), wide.map(metres));
        Ok(Budgeted {
            // A mean that is no whole number is told as the nearest one.
            mean: limits.mean_per_load_module.round() as u32,
            per_load_module: limits.per_load_module,
            per_window: limits.window.limit,
            kinds,
            wide_m,
            lakes,
            triangles,
            is_own: limits == self.job.limits,
        })
    }

    /// Triangles of each load module that features take within the limits of the job itself, row by row.
    ///
    /// # Errors
    /// When the job is impossible.
    pub(crate) fn reserved(&self) -> Result<Vec<u32>, CompileError> {
        let area = GamingArea::new(&self.job)?;
        let cost = cost_of(&self.job, area.grid, &self.levelled(&self.job, &area).reserved.cost);
        let mut reserved = vec![0; area.grid.count()];
        cost.iter().for_each(|&(module, _, triangles)| reserved[module as usize] += triangles);
        Ok(reserved)
    }

    fn levelled(&self, job: &Job, area: &GamingArea) -> Levelled {
        let spec = job.features.as_ref().expect("a job with features");
        let shares = shares(&area.budget, spec);
        self.read.features.level(self.heard.sounded(), (spec.options, spec.falls), &shares, &self.workers.each())
    }

    /// Metres by kind, kept and all, of what lies in the area and in no tunnel.
    fn kinds(&self, formed: &Formed) -> Vec<(Kind, [f64; 2])> {
        let features: &AreaFeatures = &self.read.features;
        let traits = features.traits_by_id();
        let metres = features.site.lattice.metres_per_step();
        let mut kinds: BTreeMap<Kind, [f64; 2]> = BTreeMap::new();
        for middle in formed.middles.iter().filter(|middle| middle.traits.storey != LineStorey::Tunnel) {
            let Some(of) = traits.get(&middle.id).filter(|of| !of.storey.is_tunnel()) else {
                continue;
            };
            let [kept, all] = kinds.entry(of.kind).or_default();
            for ends in middle.stations.windows(2) {
                let (a, b) = (ends[0].0, ends[1].0);
                if features.site.holds_middle(a, b) {
                    let length = (a.squared_to(b) as f64).sqrt() * metres;
                    *all += length;
                    *kept += if middle.traits.is_kept { length } else { 0.0 };
                }
            }
        }
        kinds.into_iter().filter(|(_, [_, all])| 0.0 < *all).collect()
    }
}

/// The least of [`BUDGETS`] above a run's own mean that would keep nearly all of its features, by the ground along
/// them that is published; `None` where none would.
///
/// # Errors
/// When a file cannot be read.
pub(crate) fn enough_for(run: &Run) -> Result<Option<Budgeted>, CompileError> {
    let read = run.features()?;
    let profile = |&tile: &TileId| Ok(run.database.folder().read_profile(tile)?.2);
    let profiles: Vec<Profile> = run.area.tiles.iter().map(profile).collect::<Result<_, CompileError>>()?;
    let heard = Heard::of(&read, profiles.iter());
    let workers = Workers::new(run.workers.count());
    let budgets = Budgets { job: run.job.clone(), read, heard, workers };
    let own = run.job.limits.mean_per_load_module;
    for mean in BUDGETS.into_iter().filter(|mean| own < f64::from(*mean)) {
        let budgeted = budgets.of_mean(mean)?;
        if budgeted.holds() {
            return Ok(Some(budgeted));
        }
    }
    Ok(None)
}
