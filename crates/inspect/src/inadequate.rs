//! Where the TIN of a finished database is not good enough, what stands in the way, and what could be done.
//!
//! The first half of "machine-assisted improvement", the successor of the authors' ADAPT: connected posts whose
//! weighted residual is above a tolerance. The second half are pins, which feed the next build.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

use build::CompileError;
use build::ground::{GamingArea, Ground, Window};
use build::product::{Opened, choose_ground, locate_weights};
use schedule::Workers;
use store::FeatureFarOff;
use terrain::OffCause;
use terrain::geometry::Facet;
use terrain::geometry::owned::{PostGrid, visit_residuals};
use terrain::{
    Dem, GridFrame, Importance, LoadModule, ModuleGrid, ModuleId, ModuleRect, Post, PostRect, THOUSANDTHS,
    metres_of_quanta,
};

use crate::measures::{covered, read_modules};
use crate::status::is_outdated;

/// Where a database is not good enough.
#[derive(Clone, Debug)]
pub struct Inadequate {
    /// Name of the area.
    pub area: String,
    /// Name of its coordinate system.
    pub crs: String,
    /// EPSG code of that.
    pub epsg: u32,
    /// Whether some of its tiles were made from other ground than the rest, as `report.json` says.
    pub is_outdated: bool,
    /// What it is measured against: the terrain it was built from, or rasters.
    pub against: String,
    /// Share of its posts at which that has a height.
    pub covered: f64,
    /// Where its posts lie.
    pub frame: GridFrame,
    /// East and north of its south-west post, in metres.
    pub origin_m: [f64; 2],
    /// Metres between posts.
    pub spacing_m: f64,
    /// Its posts.
    pub rect: PostRect,
    /// The weighted residual that is still good enough, in metres where the ground matters most.
    pub tolerance_m: f64,
    /// Weighted residual of each post in metres, row-major from the south; 0 at voids.
    pub residual_m: Vec<f32>,
    /// Its load modules.
    pub grid: ModuleGrid,
    /// What limits count, in words, as [`job::Job::counted_words`] has them.
    pub count: &'static str,
    /// What each load module has of that, row-major.
    pub counts: Vec<u32>,
    /// What it may have.
    pub per_module: u32,
    /// Connected posts above the tolerance, the largest sum of squares first.
    pub components: Vec<Component>,
}

/// Connected posts whose weighted residual is above the tolerance.
#[derive(Clone, Debug)]
pub struct Component {
    /// Posts of it in each row: the row, its first and its last column.
    pub runs: Vec<(i32, i32, i32)>,
    /// How many posts.
    pub posts: u64,
    /// The post of the largest weighted residual.
    pub worst: Post,
    /// Its height on the ground, in metres.
    pub worst_height_m: f64,
    /// Its weighted residual, in metres.
    pub largest_m: f64,
    /// Sum of squared weighted residuals, in square metres.
    pub squares_m2: f64,
    /// Load modules it reaches, by row and column.
    pub modules: Vec<ModuleId>,
    /// Limits that kept points out of it, as jobs name them.
    pub blocked_by: Vec<&'static str>,
    /// The feature that lies off the ground there, where one does.
    pub far_off: Option<FeatureFarOff>,
    /// What could be done.
    pub action: &'static str,
}

/// Finds where a finished database has weighted residuals above `tolerance_m`, thrice its RMS residual where none is
/// given: against the ground it was built from, or against the rasters `against` where there are some.
///
/// # Errors
/// When the database is missing, unfinished or damaged, or the ground cannot be found or used.
pub fn inadequate(folder: &Path, against: &[PathBuf], tolerance_m: Option<f64>) -> Result<Inadequate, CompileError> {
    let Opened { folder, manifest, mut job, area } = Opened::open(folder)?;
    let has_features = job.features.is_some();
    let against = choose_ground(&mut job, &manifest, folder.dir(), against)?;
    locate_weights(&mut job, &manifest, folder.dir())?;
    let ground = Ground::open_built(&job, &area, (&Workers::new(1), &AtomicBool::new(false)), &folder)?;
    let window = ground.window(area.rect)?;
    let modules = read_modules(&folder, &manifest)?;
    let totals = &manifest.totals;
    let rms_m = (totals.residual_sum_squared as f64 / totals.residual_posts.max(1) as f64).sqrt();
    let tolerance_m = tolerance_m.unwrap_or(3.0 * rms_m / f64::from(terrain::QUANTA_PER_METRE));
    // What roads that had no room weigh beyond that says nothing of the ground beside them.
    let natural = job.features.as_ref().map(|_| ground.natural(area.rect)).transpose()?;
    let heaviest =
        heaviest(&natural.as_ref().unwrap_or(&window).importance, job.dem.water.as_ref().map(|water| water.class));
    let residual_m = weighted(modules.values(), &area, &window, heaviest);
    let counts: Vec<u32> = modules.values().map(|module| job.counted(module)).collect();
    let mut refused = BTreeSet::new();
    for &tile in &area.tiles {
        refused.extend(folder.read_tile(tile)?.1.refused.iter().map(|refusal| refusal.post));
    }
    let far_off = if has_features { folder.read_level()?.2.far_off } else { Vec::new() };
    let seen = Seen {
        area: &area,
        dem: &window.dem,
        residual_m: &residual_m,
        counts: &counts,
        refused: &refused,
        far_off: &far_off,
    };
    let components = seen.components(tolerance_m);
    let frame = &area.frame;
    Ok(Inadequate {
        area: manifest.area.name.clone(),
        crs: manifest.area.crs.clone(),
        epsg: job.area.epsg,
        is_outdated: is_outdated(&folder),
        origin_m: [frame.origin_east_m, frame.origin_north_m],
        spacing_m: frame.spacing.metres(),
        rect: area.rect,
        tolerance_m,
        against,
        covered: covered(&window.dem),
        frame: *frame,
        grid: area.grid,
        count: job.counted_words(),
        per_module: area.budget.per_module,
        components,
        counts,
        residual_m,
    })
}

/// The weighted residual of each post: as it is where the ground matters most, in proportion elsewhere.
fn weighted<'a>(
    modules: impl Iterator<Item = &'a LoadModule>,
    area: &GamingArea,
    window: &Window,
    heaviest: f64,
) -> Vec<f32> {
    let Window { dem, importance, .. } = window;
    let mut all = vec![0.0; area.rect.post_count()];
    for module in modules {
        let grid = PostGrid::of_module(area.grid, module.id, area.frame.spacing);
        for &triangle in &module.triangles {
            let corners = triangle.map(|v| module.vertices[usize::from(v)]);
            let (x, y) = (corners.map(|v| i32::from(v.x)), corners.map(|v| i32::from(v.y)));
            visit_residuals(&grid, &Facet::new(x, y, corners.map(|v| v.z)), dem, |post, residual| {
                if !dem.is_void(post) {
                    let share = (f64::from(importance.weight(post)) / heaviest).min(1.0);
                    all[area.rect.index(post)] = (metres_of_quanta(residual.abs()) * share) as f32;
                }
            });
        }
    }
    all
}

/// The largest weight of any ground; that of water only keeps it level.
fn heaviest(importance: &Importance, water: Option<u8>) -> f64 {
    if let Some(weight) = importance.uniform_weight() {
        return f64::from(weight.max(1));
    }
    let rect = importance.rect();
    let weight = |(&weight, &class): (&u16, &u8)| (Some(class) != water).then_some(weight);
    let in_row = |row| -> Option<u16> {
        let weights = importance.weights_of_row(row)?;
        match importance.classes_of_row(row) {
            Some(classes) => weights.iter().zip(classes).filter_map(weight).max(),
            None => weights.iter().copied().max(),
        }
    };
    f64::from((rect.south..=rect.north).filter_map(in_row).max().unwrap_or(THOUSANDTHS).max(1))
}

/// All that components are found in.
struct Seen<'a> {
    area: &'a GamingArea,
    dem: &'a Dem,
    residual_m: &'a [f32],
    counts: &'a [u32],
    refused: &'a BTreeSet<Post>,
    /// Where features lie far off the ground, the farthest first.
    far_off: &'a [FeatureFarOff],
}

impl Seen<'_> {
    fn components(&self, tolerance_m: f64) -> Vec<Component> {
        let rect = self.area.rect;
        let above = |post: Post| tolerance_m < f64::from(self.residual_m[rect.index(post)]);
        let mut met = vec![false; rect.post_count()];
        let mut found = Vec::new();
        let posts =
            (rect.south..=rect.north).flat_map(|row| (rect.west..=rect.east).map(move |col| Post::new(row, col)));
        for post in posts.filter(|&post| above(post)) {
            if std::mem::replace(&mut met[rect.index(post)], true) {
                continue;
            }
            let mut posts = vec![post];
            let mut next = 0;
            while let Some(&at) = posts.get(next) {
                next += 1;
                for (rows, cols) in [(-1, -1), (-1, 0), (-1, 1), (0, -1), (0, 1), (1, -1), (1, 0), (1, 1)] {
                    let beside = Post::new(at.row + rows, at.col + cols);
                    let fresh = rect.contains(beside) && above(beside);
                    if fresh && !std::mem::replace(&mut met[rect.index(beside)], true) {
                        posts.push(beside);
                    }
                }
            }
            posts.sort_unstable();
            found.push(self.component(&posts));
        }
        found.sort_by(|a, b| b.squares_m2.total_cmp(&a.squares_m2).then(a.worst.cmp(&b.worst)));
        found
    }

    fn component(&self, posts: &[Post]) -> Component {
        let rect = self.area.rect;
        let residual = |post: Post| f64::from(self.residual_m[rect.index(post)]);
        let worst = posts.iter().copied().reduce(|a, b| if residual(a) < residual(b) { b } else { a });
        let worst = worst.expect("a component has posts");
        let modules: BTreeSet<ModuleId> = posts.iter().map(|&post| self.module_of(post)).collect();
        let modules: Vec<ModuleId> = modules.into_iter().collect();
        let was_refused = posts.iter().any(|post| self.refused.contains(post));
        let far_off = self.far_off(&runs(posts)).cloned();
        let blocked_by = match far_off {
            Some(_) => vec!["features"],
            None => self.blocked_by(&modules, was_refused),
        };
        Component {
            runs: runs(posts),
            posts: posts.len() as u64,
            worst,
            worst_height_m: metres_of_quanta(self.dem.height(worst)),
            largest_m: residual(worst),
            squares_m2: posts.iter().map(|&post| residual(post) * residual(post)).sum(),
            action: far_off.as_ref().map_or_else(|| action(&blocked_by), |far| action_on(far.cause)),
            far_off,
            modules,
            blocked_by,
        }
    }

    fn module_of(&self, post: Post) -> ModuleId {
        let grid = self.area.grid;
        let along = |v: i32, count: u32| ((v / grid.side_cells) as u32).min(count - 1);
        ModuleId { row: along(post.row, grid.rows), col: along(post.col, grid.cols) }
    }

    /// The feature that lies farthest off the ground where its slopes reach some posts: no limit is in their way.
    fn far_off(&self, runs: &[(i32, i32, i32)]) -> Option<&FeatureFarOff> {
        let (frame, post_m) = (self.area.frame, self.area.frame.spacing.metres());
        self.far_off.iter().find(|far| {
            let [east, north] = far.at_m;
            let (row, col) = ((north - frame.origin_north_m) / post_m, (east - frame.origin_east_m) / post_m);
            let reach = SLOPE_RUN * far.off_m.abs() / post_m + 1.0;
            runs.iter().any(|&(at, first, last)| {
                let beside = (f64::from(first) - col).max(col - f64::from(last)).max(0.0);
                (f64::from(at) - row).abs() <= reach && beside <= reach
            })
        })
    }

    /// The limits that are used up around a component: a point more costs two of what they count.
    fn blocked_by(&self, modules: &[ModuleId], was_refused: bool) -> Vec<&'static str> {
        let budget = &self.area.budget;
        let is_full = |count: u64, limit: u64| limit < count + u64::from(terrain::POINT_COST);
        let count = |module: ModuleId| u64::from(self.counts[self.area.grid.index(module)]);
        let mut found = Vec::new();
        if modules.iter().any(|&module| is_full(count(module), u64::from(budget.per_module))) {
            found.push("limits.per_load_module");
        }
        let windows = modules.iter().flat_map(|module| {
            let here = ModuleRect { south: module.row, west: module.col, north: module.row + 1, east: module.col + 1 };
            budget.windows.touching(here).iter().collect::<Vec<_>>()
        });
        let sum = |origin| budget.windows.modules_of(origin).iter().map(count).sum::<u64>();
        // A tile keeps its own part of a window, so where posts were refused one is used up before its sum says so.
        let fullest = windows.map(sum).max().unwrap_or(0);
        if is_full(fullest, u64::from(budget.per_window)) || (was_refused && found.is_empty()) {
            found.push("limits.per_4km_square");
        }
        let all: u64 = self.counts.iter().map(|&count| u64::from(count)).sum();
        // What tiles leave of their parts is about a hundredth.
        if budget.area <= all + budget.area / 100 {
            found.push("limits.mean_per_load_module");
        }
        found
    }
}

/// Metres that the flatter slope beside a feature runs for each metre of height.
const SLOPE_RUN: f64 = 2.0;

/// What could be done about a feature that lies off the ground.
fn action_on(cause: OffCause) -> &'static str {
    match cause {
        OffCause::Grade => "a road is too steep for its grade: give it a steeper one, a bridge or a tunnel",
        OffCause::Falling => "a river has to fall: mend its line or the DEM, or raise features.river_tau",
        OffCause::Level => "water lies level: give the lake its height, or mend its outline",
        OffCause::Pin => "a pinned height is off the ground: mend it",
    }
}

fn action(blocked_by: &[&'static str]) -> &'static str {
    match blocked_by.first() {
        Some(&"limits.per_load_module") => "raise limits.per_load_module, or give limits.pool",
        Some(&"limits.per_4km_square") => "raise limits.per_4km_square, or exclude ground nearby with a pin",
        Some(_) => "draw points here with an importance pin, or raise limits.mean_per_load_module",
        None => "add the worst post with a pin, or ask for more points",
    }
}

/// Posts in ascending order as runs along rows.
fn runs(posts: &[Post]) -> Vec<(i32, i32, i32)> {
    let mut found: Vec<(i32, i32, i32)> = Vec::new();
    for post in posts {
        match found.last_mut() {
            Some((row, _, last)) if *row == post.row && *last + 1 == post.col => *last = post.col,
            _ => found.push((post.row, post.col, post.col)),
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn posts_of_a_row_that_follow_each_other_are_one_run() {
        let posts = [(0, 1), (0, 2), (0, 4), (1, 4), (1, 5)].map(|(row, col)| Post::new(row, col));
        assert_eq!(runs(&posts), [(0, 1, 2), (0, 4, 4), (1, 4, 5)]);
    }

    #[test]
    fn the_nearest_limit_decides_what_to_do() {
        assert!(action(&["limits.per_load_module", "limits.mean_per_load_module"]).contains("pool"));
        assert!(action(&[]).contains("pin"));
    }
}
