//! What stands on the ground, seen from the triangles of load modules: whether all that was granted is there, walls
//! reach the ground, roofs stand over it, pieces fit together, and limits hold. It looks at places along walls and at
//! corners of the ground; nothing is shared with the code that stands objects.

use std::collections::{BTreeMap, BTreeSet};
use std::rc::Rc;

use job::ObjectsSpec;
use store::{AreaOutlines, ModuleOutlines, ReportObjects};
use terrain::{Corner, LoadModule, ModuleId, ObjectKind, Objects, Prism, QUANTA_PER_METRE};

use super::modules::Modules;
use crate::recount;
use build::ground::GamingArea;

/// What was found of the objects of a database.
#[derive(Debug, Default)]
pub(crate) struct Standing {
    pub problems: Vec<String>,
    /// What all of them come to, in words.
    pub told: String,
}

/// Quanta between places along a wall that are looked at.
const STEP: f64 = 64.0;
/// Quanta by which rounding may put a base above the ground, or a roof beside it.
const ROUNDING: i32 = 1;

/// A place in quanta.
type At = [f64; 2];

/// Checks what stands in all load modules.
pub(crate) fn check(
    area: &GamingArea,
    spec: &ObjectsSpec,
    levels: &[Modules],
    outlines: &AreaOutlines,
    report: Option<&ReportObjects>,
) -> Standing {
    let mut problems = Vec::new();
    let granted: BTreeMap<ModuleId, &Objects> = outlines
        .modules
        .iter()
        .map(|ModuleOutlines { row, col, objects }| (ModuleId { row: *row, col: *col }, objects))
        .collect();
    let nothing = Objects::default();
    let mut pieces: BTreeMap<u64, Vec<Piece>> = BTreeMap::new();
    let mut kinds: BTreeMap<ObjectKind, BTreeSet<u64>> = BTreeMap::new();
    let mut counts = vec![0; area.grid.count()];
    for module in levels[0].values() {
        let id = module.id;
        counts[area.grid.index(id)] = polygons(&module);
        for (kind, thing) in things(&module.objects) {
            kinds.entry(kind).or_default().insert(thing);
        }
        let granted = granted.get(&id).copied().unwrap_or(&nothing);
        if !are_alike(&module.objects, granted) {
            problems.push(format!("load module {id}: what stands there is not what had room"));
            continue;
        }
        for prism in &module.objects.prisms {
            if let Some(fault) = torn(prism, module.side) {
                problems.push(format!("load module {id}: {} {:016x}: {fault}", prism.kind, prism.id));
            }
            let ground = ground_under(prism, levels.iter().filter_map(|modules| modules.get(&id)));
            let lifted = granted.prisms.iter().find(|other| other.id == prism.id).map(|other| [other.base, other.roof]);
            pieces.entry(prism.id).or_default().push(Piece {
                id,
                kind: prism.kind,
                base: prism.base,
                roof: prism.roof,
                ground,
                lifted: lifted.unwrap_or([0; 2]),
            });
        }
    }
    problems.extend(pieces.iter().flat_map(|(thing, pieces)| wrong_heights(*thing, pieces)));
    problems.extend(over_limits(area, spec, &counts));
    let all: u64 = counts.iter().map(|&count| u64::from(count)).sum();
    if let Some(report) = report.filter(|report| report.polygons != all) {
        problems.push(format!("report.json: {} polygons of objects, load modules have {all}", report.polygons));
    }
    Standing { problems, told: told(&kinds, all) }
}

/// A prism in one load module.
struct Piece {
    id: ModuleId,
    kind: ObjectKind,
    base: i32,
    roof: i32,
    /// The lowest ground under it at any level, and the highest at the finest.
    ground: [i32; 2],
    /// Its base and its roof above the highest ground under all pieces; a base of 0 is on the ground.
    lifted: [i32; 2],
}

/// Whether objects are the same but for heights of prisms.
fn are_alike(found: &Objects, granted: &Objects) -> bool {
    let plans = |objects: &Objects| -> BTreeSet<(u64, Vec<Vec<Corner>>)> {
        objects.prisms.iter().map(|prism| (prism.id, prism.rings.clone())).collect()
    };
    plans(found) == plans(granted) && found.canopies == granted.canopies
}

/// An edge without a wall that is no cut at a side of the load module.
fn torn(prism: &Prism, side: u16) -> Option<String> {
    let on_side =
        |a: &Corner, b: &Corner| a.x == b.x && (a.x == 0 || a.x == side) || a.y == b.y && (a.y == 0 || a.y == side);
    let torn = prism.rings.iter().flat_map(|ring| edges(ring)).any(|(a, b)| !a.has_wall && !on_side(&a, &b));
    torn.then(|| "an edge inside the square has no wall".to_owned())
}

fn edges(ring: &[Corner]) -> impl Iterator<Item = (Corner, Corner)> {
    ring.iter().copied().zip(ring.iter().copied().cycle().skip(1))
}

/// What is wrong with the heights of the pieces of one prism.
fn wrong_heights(thing: u64, pieces: &[Piece]) -> Vec<String> {
    let highest = pieces.iter().map(|piece| piece.ground[1]).max().unwrap_or(i32::MIN);
    let metres = |quanta: i32| f64::from(quanta) / f64::from(QUANTA_PER_METRE);
    let mut problems = Vec::new();
    for Piece { id, kind, base: of_base, roof: of_roof, ground: [low, _], lifted: [base, roof] } in pieces {
        let mut tell = |what: String| {
            problems.push(format!("load module {id}: {kind} {thing:016x}: {what}"));
        };
        let over = of_roof - roof - highest;
        if over < -ROUNDING {
            tell(format!("its roof is {:.2} m too low over the ground", metres(-over)));
        }
        if *of_roof != pieces[0].roof {
            tell("its pieces have different roofs".to_owned());
        }
        match *base {
            0 if low + ROUNDING < *of_base => {
                tell(format!("it floats {:.2} m above the ground", metres(of_base - low)));
            }
            0 => {}
            base if of_roof - roof != of_base - base => tell("it hangs at another height".to_owned()),
            _ => {}
        }
    }
    problems
}

/// The lowest ground of any of these levels at places under a prism, and the highest of the first.
fn ground_under(prism: &Prism, levels: impl Iterator<Item = Rc<LoadModule>>) -> [i32; 2] {
    let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
    for (level, module) in levels.enumerate() {
        let mut see = |height: f64| {
            low = low.min(height);
            high = if level == 0 { high.max(height) } else { high };
        };
        let around = prism.rings[0].iter().map(|corner| [f64::from(corner.x), f64::from(corner.y)]);
        let around = around.fold([[f64::INFINITY; 2], [f64::NEG_INFINITY; 2]], |[low, high], at| {
            [[low[0].min(at[0]), low[1].min(at[1])], [high[0].max(at[0]), high[1].max(at[1])]]
        });
        for triangle in &module.triangles {
            let corners = triangle.map(|index| {
                let vertex = &module.vertices[usize::from(index)];
                [f64::from(vertex.x), f64::from(vertex.y), f64::from(vertex.z)]
            });
            let apart = |axis: usize| {
                let of =
                    |end: fn(f64, f64) -> f64| corners.iter().map(|corner| corner[axis]).reduce(end).unwrap_or(0.0);
                of(f64::max) < around[0][axis] || around[1][axis] < of(f64::min)
            };
            if apart(0) || apart(1) {
                continue;
            }
            corners.iter().filter(|[x, y, _]| is_within(prism, [*x, *y])).for_each(|corner| see(corner[2]));
            for (a, b) in prism.rings.iter().flat_map(|ring| edges(ring)) {
                along(&corners, [a, b].map(|c| [f64::from(c.x), f64::from(c.y)]), &mut see);
            }
        }
    }
    [low.floor() as i32, high.ceil() as i32]
}

/// Looks at the heights of a triangle at places along a wall.
fn along(corners: &[[f64; 3]; 3], [a, b]: [At; 2], see: &mut impl FnMut(f64)) {
    let run = [b[0] - a[0], b[1] - a[1]];
    let steps = (run[0].hypot(run[1]) / STEP).ceil().max(1.0) as usize;
    for step in 0..=steps {
        let share = step as f64 / steps as f64;
        height_at(corners, [a[0] + share * run[0], a[1] + share * run[1]]).into_iter().for_each(&mut *see);
    }
}

/// Height of a triangle at a place in it.
pub(super) fn height_at([a, b, c]: &[[f64; 3]; 3], [x, y]: At) -> Option<f64> {
    let (ux, uy, vx, vy) = (b[0] - a[0], b[1] - a[1], c[0] - a[0], c[1] - a[1]);
    let all = ux * vy - uy * vx;
    let (px, py) = (x - a[0], y - a[1]);
    let (s, t) = ((px * vy - py * vx) / all, (ux * py - uy * px) / all);
    (0.0 <= s && 0.0 <= t && s + t <= 1.0).then(|| a[2] + s * (b[2] - a[2]) + t * (c[2] - a[2]))
}

/// Whether a place lies inside a prism's plan, by the edges that pass east of it.
fn is_within(prism: &Prism, [x, y]: At) -> bool {
    let passes = |(a, b): &(Corner, Corner)| {
        let ([ax, ay], [bx, by]) = ([a.x, a.y].map(f64::from), [b.x, b.y].map(f64::from));
        (y < ay) != (y < by) && x < ax + (bx - ax) * (y - ay) / (by - ay)
    };
    prism.rings.iter().flat_map(|ring| edges(ring)).filter(passes).count() % 2 == 1
}

fn polygons(module: &LoadModule) -> u32 {
    let walls = |prism: &Prism| prism.rings.iter().flatten().filter(|corner| corner.has_wall).count();
    let prisms: usize = module.objects.prisms.iter().map(|prism| 1 + walls(prism)).sum();
    (prisms + module.objects.canopies.iter().map(|canopy| canopy.triangles.len()).sum::<usize>()) as u32
}

fn over_limits(area: &GamingArea, spec: &ObjectsSpec, counts: &[u32]) -> Vec<String> {
    let (most, in_window) = (spec.per_load_module, spec.per_4km_square);
    let of_modules = area.grid.all().iter().zip(counts).filter(|(_, count)| most < **count);
    let mut problems: Vec<String> = of_modules
        .map(|(id, count)| format!("load module {id}: {count} against objects.limits.per_load_module = {most}"))
        .collect();
    let sums = recount::windows(area.grid, counts, area.budget.windows.rows, area.budget.windows.cols);
    problems.extend(sums.filter(|(_, sum)| u64::from(in_window) < *sum).map(|(id, sum)| {
        format!("the window from load module {id}: {sum} against objects.limits.per_4km_square = {in_window}")
    }));
    problems
}

/// Kind and number of each object, of which a load module may have several pieces.
fn things(objects: &Objects) -> impl Iterator<Item = (ObjectKind, u64)> + '_ {
    let prisms = objects.prisms.iter().map(|prism| (prism.kind, prism.id));
    prisms.chain(objects.canopies.iter().map(|canopy| (canopy.kind, canopy.id)))
}

fn told(kinds: &BTreeMap<ObjectKind, BTreeSet<u64>>, polygons: u64) -> String {
    let kinds: Vec<String> = kinds.iter().map(|(kind, ids)| format!("{} {kind}", ids.len())).collect();
    if kinds.is_empty() { "none".to_owned() } else { format!("{}; {polygons} polygons", kinds.join(", ")) }
}
