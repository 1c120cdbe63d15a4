//! One tile's refinement: grown to its budget, or grown beyond it and optimised.

use std::collections::HashSet;

use crate::ground::{GivenPost, Window, border_posts, start_posts};
use fidelity::Bodies;
use job::{Effort, Job, Method, Optimising};
use terrain::limits::Allowance;
use terrain::{
    Dem, HeightFit, Importance, Lattice, LatticePoint, Post, PostRect, Spacing, StopReason, THOUSANDTHS, TileFeatures,
    TileTin, Tin, Vertex,
};
use tin::optimiser::{Budget, Optimised, Task, fill, optimise, overshoot, weave_in};
use tin::{Frame, Rule, Stop, TileTask};

/// Room in a window of load modules while a tile is grown beyond its budget.
const NO_LIMIT: u32 = u32::MAX / 4;

/// How features come into a TIN that is not optimised.
const PLAIN: Optimising =
    Optimising { effort: Effort::Fast, height_fit: HeightFit::Off, lattice: Lattice::Post, sight: None };

/// What is to be done for one tile.
#[derive(Clone, Debug)]
pub struct Refinement {
    /// What to select, within which budget.
    pub task: TileTask,
    /// How what is selected is then optimised, if it is.
    pub optimising: Option<Optimising>,
    /// What the finished mesh may have where there are no load modules.
    pub most: Most,
    /// What features put into it: vertices and edges that it keeps whatever it is refined to, and level water.
    pub features: TileFeatures,
    /// How far posts are apart, where features are to have no walls beside them.
    pub spacing: Option<Spacing>,
}

/// Where there are no load modules, the most a mesh may have.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Most {
    /// What the task says.
    AsTask,
    /// So many triangles.
    Triangles(usize),
}

/// The settings of a job's method, where it is the optimised one.
pub(crate) fn optimising(job: &Job) -> Option<Optimising> {
    match job.tin.method {
        Method::Optimised(optimising) => Some(optimising),
        Method::Greedy | Method::Paper { .. } => None,
    }
}

impl Refinement {
    /// Refines the tile. `seeds` are the vertices it inherits or keeps, at the heights they were published with,
    /// whatever the DEM says today. `in_squares` is what posts weigh where it is optimised, if that is another thing.
    pub fn run(&self, window: &Window, in_squares: Option<&Importance>, seeds: &[Vertex]) -> TileTin {
        let mut tin = self.run_as_given(window, in_squares, seeds);
        lay_level(&mut tin.tin, &self.features);
        tin
    }

    fn run_as_given(&self, window: &Window, in_squares: Option<&Importance>, seeds: &[Vertex]) -> TileTin {
        if window.given.is_empty() {
            return self.run_given(window, in_squares, seeds);
        }
        let mut own = self.clone();
        give(&mut own.task, &window.given, window.dem.rect());
        // What is inherited stands as it was published.
        let is_free = |post: &&GivenPost| !seeds.iter().any(|seed| seed.at == post.at.into());
        let given = window.given.iter().filter(is_free);
        let heights = given.filter_map(|post| Some(Vertex { at: post.at.into(), height: post.height? }));
        own.run_given(window, in_squares, &heights.chain(seeds.iter().copied()).collect::<Vec<_>>())
    }

    fn run_given(&self, window: &Window, in_squares: Option<&Importance>, seeds: &[Vertex]) -> TileTin {
        let grown = |task: &TileTask, importance: &Importance| {
            let level = terrain::geometry::widest_level();
            let differs = |seed: &Vertex| seed.at.post().is_some_and(|post| window.dem.height(post) != seed.height);
            if !seeds.iter().any(differs) {
                return tin::refine(&window.dem, importance, task, level);
            }
            tin::refine(&with_heights(&window.dem, seeds), importance, task, level)
        };
        let weighted = &window.importance;
        let Some(optimising) = self.optimising else { return self.woven(window, grown(&self.task, weighted)) };
        // A largest residual is asked of every post alike.
        let even = self.guard().map(|_| evened(weighted));
        let chosen = even.as_ref().unwrap_or(weighted);
        let weighs_alike = even.is_none() || is_even(weighted);
        let in_squares = in_squares.or(even.as_ref().map(|_| weighted));
        let optimised = |own: &Self| {
            let mut task = own.beyond_budget(optimising);
            if let (Rule::LargestSquares { guard }, false) = (&mut task.rule, weighs_alike) {
                *guard = None;
            }
            let grown = grown(&task, if weighs_alike { chosen } else { weighted });
            let task = own.optimisation(optimising, grown.initial_count, &window.forbidden);
            let task = Task { in_squares: in_squares.cloned(), ..task };
            let optimised = optimise(&window.dem, chosen, &grown.tin, &task);
            (grown, optimised)
        };
        let Some((mut own, plain)) = self.to_largest(&|task| grown(task, chosen)) else {
            let (chosen, optimised) = optimised(self);
            let (count, is_short) = (optimised.tin.triangles.len(), !optimised.short.is_empty());
            let best = self.join(chosen, optimised);
            // Between crowded pins nothing may be left that can go: what only grew has not more than it may.
            let is_crowded = is_short && self.task.start.iter().any(|start| start.pinned);
            let plain = is_crowded.then(|| self.woven(window, grown(&self.task, weighted)));
            return plain.filter(|plain| plain.tin.triangles.len() < count).unwrap_or(best);
        };
        loop {
            let (grown, optimised) = optimised(&own);
            let is_reached = optimised.stop == StopReason::ResidualReached;
            if self.features.kept.is_empty() && !is_reached && plain.refused.is_empty() {
                // By its own order of choosing so many do not reach the residual, by worst posts they do.
                return plain;
            }
            if is_reached || own.task == self.task && own.most == self.most {
                return own.join(grown, optimised);
            }
            // Worst posts alone did not know of the features.
            own = own.with_twice_as_much(self);
        }
    }

    /// The largest residual that is asked for, in thousandths of a quantum.
    fn guard(&self) -> Option<u64> {
        match self.task.rule {
            Rule::LargestSquares { guard } => guard,
            Rule::WorstFirst | Rule::Batches { .. } => None,
        }
    }

    /// The same with twice as much to spend, and no more than `full` has.
    fn with_twice_as_much(&self, full: &Self) -> Self {
        let mut own = self.clone();
        match (&mut own.task.frame, &full.task.frame) {
            (Frame::Sides { allowance, .. }, Frame::Sides { allowance: most, .. }) => {
                allowance.triangles = (2 * allowance.triangles.max(1)).min(most.triangles);
            }
            _ => (own.task, own.most) = (full.task.clone(), full.most),
        }
        own
    }

    /// A TIN as it grew, with features among its vertices.
    fn woven(&self, window: &Window, grown: TileTin) -> TileTin {
        if self.features.kept.is_empty() {
            return grown;
        }
        let task = self.optimisation(PLAIN, grown.initial_count, &window.forbidden);
        let woven = weave_in(&window.dem, &window.importance, &grown.tin, &task);
        self.join(grown, woven)
    }

    /// Where a largest residual ends the choosing before the budget does: the TIN that reaches it by worst posts alone,
    /// and this refinement with no more to spend than that took.
    fn to_largest(&self, grown: &impl Fn(&TileTask) -> TileTin) -> Option<(Self, TileTin)> {
        let stop = Stop { value: Some(self.guard()?), rms_quanta: None, ..self.task.stop };
        let plain = grown(&TileTask { rule: Rule::WorstFirst, stop, ..self.task.clone() });
        if plain.stop == StopReason::BudgetSpent {
            return None;
        }
        let mut own = self.clone();
        match (&mut own.task.frame, &mut own.most) {
            (Frame::Sides { allowance, .. }, _) => allowance.triangles = plain.triangles_charged,
            (_, Most::Triangles(most)) => *most = plain.tin.triangles.len().min(*most),
            (_, Most::AsTask) => {
                own.task.stop.points = Some(plain.tin.vertices.len() - plain.initial_count as usize);
            }
        }
        Some((own, plain))
    }

    /// A TIN with as many vertices more as the task's points permit, all counted; what it has is left alone.
    pub fn fill(&self, window: &Window, optimising: Optimising, start: &Tin) -> Tin {
        fill(&window.dem, &window.importance, start, &self.optimisation(optimising, 0, &window.forbidden)).tin
    }

    /// The growth, with room to thin from.
    fn beyond_budget(&self, optimising: Optimising) -> TileTask {
        let times = overshoot(optimising.effort);
        let more = |count: usize| (count as f64 * times) as usize;
        let mut task = self.task.clone();
        if let Frame::Sides { allowance, .. } = &mut task.frame {
            let room = |room: &[u32]| room.iter().map(|&room| more(room as usize) as u32).collect();
            *allowance = Allowance {
                triangles: more(allowance.triangles as usize) as u32,
                module_room: room(&allowance.module_room),
                window_room: vec![NO_LIMIT; allowance.window_room.len()],
                ..allowance.clone()
            };
        }
        let points = match self.most {
            // A post makes two triangles at most, and two are there.
            Most::Triangles(triangles) => Some(more(triangles).saturating_sub(2) / 2),
            Most::AsTask => task.stop.points.map(more),
        };
        task.stop = Stop { points, ..task.stop };
        task
    }

    fn optimisation(&self, optimising: Optimising, initial: u32, forbidden: &[Post]) -> Task {
        let task = &self.task;
        let held = [&task.border, &task.inherited, &task.kept].into_iter().flatten().copied();
        let pinned = task.start.iter().filter(|start| start.pinned).map(|start| start.at);
        let held = held.chain(pinned);
        // Tiles that meet in a corner only agree on it because none of them fits it.
        let held = held.chain(task.rect.corners()).map(LatticePoint::from).collect();
        let budget = match (task.ledger(), self.most) {
            (Some(ledger), _) => Budget::Limits(ledger),
            (None, Most::Triangles(most)) => Budget::Triangles(most),
            (None, Most::AsTask) => {
                Budget::Vertices(task.stop.points.map_or(NO_LIMIT as usize, |points| points + initial as usize))
            }
        };
        Task {
            held,
            features: self.features.kept.clone(),
            spacing: self.spacing,
            open: task.seams,
            line_step: match task.frame {
                Frame::Sides { side_cells, .. } => Some(side_cells),
                Frame::Plain | Frame::Corners { .. } => None,
            },
            budget,
            in_squares: None,
            effort: optimising.effort,
            height_fit: optimising.height_fit,
            lattice: optimising.lattice,
            rms_quanta: task.stop.rms_quanta,
            forbidden: forbidden.to_vec(),
            largest_quanta: self.guard().map(|value| value as f64 / f64::from(THOUSANDTHS)),
        }
    }

    fn join(&self, grown: TileTin, optimised: Optimised) -> TileTin {
        let Optimised { tin, spent, refused, stop, left_out: _, short: _ } = optimised;
        TileTin {
            // What the tile began with may have been thinned out.
            initial_count: grown.initial_count.min(tin.vertices.len() as u32),
            tin,
            residuals: Vec::new(),
            triangles_charged: spent,
            refused: refused.unwrap_or(grown.refused),
            stop,
            ..grown
        }
    }
}

/// Puts vertices inside level water at its height: posts there weigh nothing, so nothing else holds them. Those of
/// features, as of a road over it, stay as they were decided.
fn lay_level(tin: &mut Tin, features: &TileFeatures) {
    let bodies = Bodies::of(features);
    if !bodies.has_lake() {
        return;
    }
    // Both are powers of two.
    let finest = tin.steps_per_post.max(features.kept.steps_per_post);
    let scaled = |at: LatticePoint, steps: i32| LatticePoint::new(at.row * (finest / steps), at.col * (finest / steps));
    let of_feature = |vertex: &Vertex| scaled(vertex.at, features.kept.steps_per_post);
    let decided: HashSet<LatticePoint> = features.kept.vertices.iter().map(of_feature).collect();
    for vertex in &mut tin.vertices {
        if !decided.contains(&scaled(vertex.at, tin.steps_per_post)) {
            vertex.height = bodies.lake_level_in(vertex.at, tin.steps_per_post).unwrap_or(vertex.height);
        }
    }
}

/// Adds what a job gives to a tile's task: points on the area's border to its border, others to what it starts from.
/// None stands between the ends of a feature's edge along a side, which it would split.
pub(crate) fn give(task: &mut TileTask, given: &[GivenPost], rect: PostRect) {
    task.start = start_posts(given, rect, task.seams);
    task.start.retain(|start| !task.kept.contains(&start.at) && task.barred.binary_search(&start.at).is_err());
    let outer: Vec<_> = border_posts(given).filter(|post| !task.border.contains(post)).collect();
    task.border.extend(outer);
    let pinned = task.start.iter().filter(|start| start.pinned).count();
    task.stop.points = task.stop.points.map(|points| points.saturating_sub(pinned));
}

/// The same weight wherever there is one.
pub(crate) fn evened(importance: &Importance) -> Importance {
    let even = |weight: u16| if weight == 0 { 0 } else { THOUSANDTHS };
    let rect = importance.rect();
    match importance.uniform_weight() {
        Some(weight) => Importance::uniform(rect, even(weight)),
        None => {
            let weights = rect.posts().map(|post| even(importance.weight(post))).collect();
            Importance::new(rect, weights, rect.posts().map(|post| importance.class(post)).collect())
        }
    }
}

/// Whether all posts that count weigh the same.
fn is_even(importance: &Importance) -> bool {
    let rect = importance.rect();
    let mut weights = rect.posts().map(|post| importance.weight(post)).filter(|weight| 0 < *weight);
    importance.uniform_weight().is_some() || weights.next().is_none_or(|first| weights.all(|weight| weight == first))
}

/// The DEM with the heights of the seeds.
fn with_heights(dem: &Dem, seeds: &[Vertex]) -> Dem {
    let mut at: Vec<(Post, i32)> = seeds.iter().filter_map(|seed| Some((seed.at.post()?, seed.height))).collect();
    at.sort_unstable();
    let rect = dem.rect();
    Dem::from_row_fn(rect, |row, heights| {
        heights.copy_from_slice(dem.row(row));
        let first = at.partition_point(|&(post, _)| post.row < row);
        let here = at[first..].iter().take_while(|&&(post, _)| post.row == row);
        here.for_each(|&(post, height)| heights[(post.col - rect.west) as usize] = height);
    })
}
