//! Lines of sight past what stands on the ground: prisms hide, canopies take light away.

use crate::lookup::Lookup;
use crate::objects::ObjectKind;
use crate::sight::{Curvature, Line, crossed_at, hidden_at, part_over, steps_of};
use crate::{LoadedGround, Prism, QUANTA_PER_METRE, Sight, TerrainModule};

/// Which objects a line of sight looks at.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Standing {
    /// None: the ground and decks alone.
    None,
    /// Buildings, towers and walls.
    Buildings,
    /// All of them.
    All,
}

impl Standing {
    /// That of a word: none, buildings or all.
    pub fn named(word: &str) -> Option<Self> {
        match word {
            "none" => Some(Self::None),
            "buildings" => Some(Self::Buildings),
            "all" => Some(Self::All),
            _ => None,
        }
    }
}

/// How a line of sight takes objects.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PastObjects {
    /// Which are looked at.
    pub standing: Standing,
    /// The share of light, over 0 up to 1, that still counts as seen.
    pub least: f64,
    /// How the earth falls away.
    pub curvature: Curvature,
}

impl PastObjects {
    /// All objects; what half of the light reaches is seen.
    pub const fn all(curvature: Curvature) -> Self {
        Self { standing: Standing::All, least: 0.5, curvature }
    }
}

/// What a line of sight ends at.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Hider {
    /// The ground.
    Ground,
    /// A deck.
    Deck,
    /// A building or a tower.
    Building,
    /// A wood, scrub or an orchard, or several.
    Wood,
    /// A hedge or a row of trees.
    Row,
    /// A wall.
    Wall,
}

impl Hider {
    /// All of them, in order.
    pub const ALL: [Self; 6] = [Self::Ground, Self::Deck, Self::Building, Self::Wood, Self::Row, Self::Wall];

    /// The word for it.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Ground => "ground",
            Self::Deck => "deck",
            Self::Building => "building",
            Self::Wood => "wood",
            Self::Row => "row",
            Self::Wall => "wall",
        }
    }

    pub(crate) const fn of(kind: ObjectKind) -> Self {
        match kind {
            ObjectKind::Building | ObjectKind::Tower => Self::Building,
            ObjectKind::Wall => Self::Wall,
            ObjectKind::Row => Self::Row,
            ObjectKind::Wood | ObjectKind::Scrub | ObjectKind::Orchard => Self::Wood,
        }
    }
}

/// What a line of sight past objects comes to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sighting {
    /// Whether the far end is seen, and if not, where the line ends: in a wood where less light than asked is left.
    pub sight: Sight,
    /// What it ends at.
    pub by: Option<Hider>,
    /// The share of light that woods leave on the way to the far end, or to the first thing that lets none through.
    pub transmission: f64,
    /// Metres inside woods on that way; where several overlap, those of each.
    pub wood_m: f64,
}

/// A stretch of a line inside a canopy: where it begins and ends along the line, what it takes a metre.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Stretch {
    /// Which canopy of its load module: two may begin and end together.
    canopy: i32,
    from: f64,
    to: f64,
    per_metre: f64,
    by: Hider,
}

impl LoadedGround {
    /// [`LoadedGround::sight_over`] past what stands on the ground. Prisms let no light through: a line is hidden where
    /// it goes through a wall or a roof, and at its beginning where that lies inside one; what only touches does not
    /// hide. Of the light that enters a canopy of fullness f, the part (1 - f) ^ (d / 10 m) is left after d metres in
    /// it, between the ground and its top; the ends of the line may lie inside.
    pub fn sight_past(&self, from_m: [f64; 3], to_m: [f64; 3], past: &PastObjects) -> Sighting {
        let (mut by, mut stretches) = (None, Vec::new());
        let side = self.frame().side;
        let sight = self.walk(from_m, to_m, past.curvature, |module, line| {
            let mut nearest = hidden_at(module.lookup(), side, line);
            by = nearest.is_finite().then_some(Hider::Ground);
            let mut nearer = |at: f64, hider: Hider| {
                if at < nearest {
                    (nearest, by) = (at, Some(hider));
                }
            };
            if let Some(decks) = module.decks() {
                nearer(crossed_at(decks, side, line), Hider::Deck);
            }
            if past.standing != Standing::None {
                prisms_along(module, side, line, |kind, at| {
                    // Walls reach below the ground, and a line that meets one there has met the ground before.
                    let is_buried = line.height(at) + ROUNDING < ground_under(module, side, line.place(at));
                    nearer(at, if is_buried { Hider::Ground } else { Hider::of(kind) });
                });
            }
            if past.standing == Standing::All {
                canopies_along(module, side, line, nearest.min(1.0), &mut stretches);
            }
            nearest
        });
        let end = match sight {
            Sight::Hidden(at) => at,
            Sight::Free | Sight::Unknown => 1.0,
        };
        // An end below the ground is found without a load module being looked at.
        let by = by.or((sight == Sight::Hidden(end)).then_some(Hider::Ground));
        let hard = Sighting { sight, by, transmission: 1.0, wood_m: 0.0 };
        stretches.iter_mut().for_each(|stretch| stretch.to = stretch.to.min(end));
        stretches.retain(|stretch| stretch.from < stretch.to);
        if stretches.is_empty() { hard } else { dimmed(hard, length_m(from_m, to_m), stretches, past.least) }
    }
}

/// Height of the ground in quanta at a place in quanta of a load module.
fn ground_under(module: &TerrainModule, side: u16, place: [f64; 2]) -> f64 {
    module
        .lookup()
        .height_m(steps_of(place, side))
        .map_or(f64::NEG_INFINITY, |height_m| height_m * f64::from(QUANTA_PER_METRE))
}

fn length_m(from_m: [f64; 3], to_m: [f64; 3]) -> f64 {
    [0, 1, 2].map(|axis| to_m[axis] - from_m[axis]).iter().map(|run| run * run).sum::<f64>().sqrt()
}

/// The logarithm of the share of light that stretches take, which are sorted and told once each: a triangle may be met
/// more than once.
pub(crate) fn lost_in(stretches: &mut Vec<Stretch>, length_m: f64) -> f64 {
    stretches.sort_by(|a, b| a.from.total_cmp(&b.from).then(a.to.total_cmp(&b.to)).then(a.canopy.cmp(&b.canopy)));
    stretches.dedup();
    stretches.iter().map(|stretch| (stretch.to - stretch.from) * length_m * stretch.per_metre).sum()
}

/// What woods leave of the light, by the stretches of a line in them up to where it ends otherwise.
fn dimmed(hard: Sighting, length_m: f64, mut stretches: Vec<Stretch>, least: f64) -> Sighting {
    let lost = lost_in(&mut stretches, length_m);
    let wood_m = stretches.iter().map(|stretch| (stretch.to - stretch.from) * length_m).sum();
    let all = Sighting { transmission: (-lost).exp(), wood_m, ..hard };
    let most = -least.ln();
    if lost <= most {
        return all;
    }
    // Where the light falls below what is asked: stretches taken from the front, in pieces between their ends.
    let mut ends: Vec<f64> = stretches.iter().flat_map(|stretch| [stretch.from, stretch.to]).collect();
    ends.sort_by(f64::total_cmp);
    let mut before = 0.0;
    for piece in ends.windows(2) {
        let over = || stretches.iter().filter(|stretch| stretch.from <= piece[0] && piece[1] <= stretch.to);
        let per_share = over().map(|stretch| stretch.per_metre).sum::<f64>() * length_m;
        let after = before + per_share * (piece[1] - piece[0]);
        if most < after {
            let by = over().map(|stretch| stretch.by).find(|by| *by == Hider::Wood).unwrap_or(Hider::Row);
            let at = piece[0] + (most - before) / per_share;
            return Sighting { sight: Sight::Hidden(at.min(piece[1])), by: Some(by), ..all };
        }
        before = after;
    }
    all
}

/// Quanta by which a place may lie too low on a roof, for rounding.
const ROUNDING: f64 = 1e-6 * QUANTA_PER_METRE as f64;

/// Calls `found` with where a line first goes into each prism that it meets, and the prism's kind.
fn prisms_along(module: &TerrainModule, side: u16, line: &Line, mut found: impl FnMut(ObjectKind, f64)) {
    let Some(lookup) = &module.objects().prisms else { return };
    let prisms = &module.module().objects.prisms;
    let lowest = line.lowest([0.0, 1.0]);
    let mut last = usize::MAX;
    lookup.triangles_along(side, line.start, line.end, |corners| {
        let number = corners[0][2] as usize;
        if number == std::mem::replace(&mut last, number) || f64::from(prisms[number].roof) < lowest {
            return;
        }
        let at = entered(&prisms[number], line);
        if at.is_finite() {
            found(prisms[number].kind, at);
        }
    });
}

/// Where a line first is inside a prism; infinity where it never is.
pub(crate) fn entered(prism: &Prism, line: &Line) -> f64 {
    let [base, roof] = [prism.base, prism.roof].map(f64::from);
    let is_level_with = |height: f64| base <= height && height + ROUNDING < roof;
    if is_level_with(line.height(0.0)) && holds(prism, line.start) {
        return 0.0;
    }
    let mut nearest = f64::INFINITY;
    for ring in &prism.rings {
        for (a, b) in ring.iter().zip(ring.iter().cycle().skip(1)).filter(|(a, _)| a.has_wall) {
            let [a, b] = [a, b].map(|corner| [f64::from(corner.x), f64::from(corner.y), 0.0]);
            let ((left_a, ahead_a), (left_b, ahead_b)) = (line.seen(a), line.seen(b));
            if line.is_left(left_a) == line.is_left(left_b) {
                continue;
            }
            let share = left_a / (left_a - left_b);
            let at = (ahead_a + share * (ahead_b - ahead_a)) / line.length_squared;
            if (0.0..=1.0).contains(&at) && at < nearest && is_level_with(line.height(at)) {
                nearest = at;
            }
        }
    }
    // From above through the roof, and from below where it hangs above the ground.
    for (height, is_falling) in [(roof - ROUNDING, true), (base, false)] {
        for at in line.shares_at(height).into_iter().flatten() {
            if at < nearest && (line.height(at + 1e-9) < height) == is_falling && holds(prism, line.place(at)) {
                nearest = at;
            }
        }
    }
    nearest
}

/// Whether a place in quanta lies in a prism's plan.
pub(crate) fn holds(prism: &Prism, [x, y]: [f64; 2]) -> bool {
    let mut inside = false;
    for ring in &prism.rings {
        for (a, b) in ring.iter().zip(ring.iter().cycle().skip(1)) {
            let [ax, ay, bx, by] = [a.x, a.y, b.x, b.y].map(f64::from);
            if (ay <= y) != (by <= y) && x < ax + (y - ay) / (by - ay) * (bx - ax) {
                inside = !inside;
            }
        }
    }
    inside
}

/// Adds the stretches of a line inside the canopies of a load module, up to a share of the line and a little more.
fn canopies_along(module: &TerrainModule, side: u16, line: &Line, last: f64, stretches: &mut Vec<Stretch>) {
    let mut parts = Vec::new();
    for lookup in &module.objects().canopies {
        over_canopies(lookup, side, line, line.place(last), |_, _| true, &mut parts);
    }
    in_canopies(module, side, line, &mut parts, |_, _, _| true, stretches);
}

/// A part of a line over one canopy of a load module: which one, and where along the line it begins and ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Part {
    canopy: i32,
    from: f64,
    to: f64,
}

/// Adds the parts of a line, up to a place, over the triangles of canopies in those cells that are wanted, by row and
/// column; some more than once.
pub(crate) fn over_canopies(
    lookup: &Lookup,
    side: u16,
    line: &Line,
    end: [f64; 2],
    wanted: impl Fn(u32, u32) -> bool,
    parts: &mut Vec<Part>,
) {
    if line.length_squared == 0.0 {
        let over = lookup.triangles(steps_of(line.start, side));
        parts.extend(over.map(|(corners, ..)| Part { canopy: corners[0][2], from: 0.0, to: 1.0 }));
        return;
    }
    lookup.triangles_along_in(side, line.start, end, wanted, |corners| {
        if let Some([from, to]) = part_over(&corners, line).map(|ends| ends.map(|end| end[0]))
            && from < to
        {
            parts.push(Part { canopy: corners[0][2], from, to });
        }
    });
}

/// Adds the stretches in which those parts of a line lie below the tops of canopies, by triangles of the ground, in
/// cells of it that are wanted: by the canopy's height in quanta, row and column. Parts are joined where they meet.
pub(crate) fn in_canopies(
    module: &TerrainModule,
    side: u16,
    line: &Line,
    parts: &mut Vec<Part>,
    wanted: impl Fn(u16, u32, u32) -> bool,
    stretches: &mut Vec<Stretch>,
) {
    parts.sort_by(|a, b| a.canopy.cmp(&b.canopy).then(a.from.total_cmp(&b.from)));
    parts.dedup_by(|next, last| {
        let is_met = next.canopy == last.canopy && next.from <= last.to;
        if is_met {
            last.to = last.to.max(next.to);
        }
        is_met
    });
    for part in parts {
        below_top(module, side, line, part, &wanted, stretches);
    }
}

fn below_top(
    module: &TerrainModule,
    side: u16,
    line: &Line,
    part: &Part,
    wanted: impl Fn(u16, u32, u32) -> bool,
    stretches: &mut Vec<Stretch>,
) {
    const DEPTH_M: f64 = 10.0;
    let canopy = &module.module().objects.canopies[part.canopy as usize];
    let per_metre = -(1.0 - f64::from(canopy.fullness) / 100.0).ln() / DEPTH_M;
    let by = Hider::of(canopy.kind);
    let wanted = |row, col| wanted(canopy.height, row, col);
    let mut below = |[from, to]: [[f64; 2]; 2]| {
        // How far the line is above the top; along so short a way the earth's curvature is nothing.
        let above = |[at, ground]: [f64; 2]| line.height(at) - ground - f64::from(canopy.height);
        let (a, b) = (above(from), above(to));
        if 0.0 <= a && 0.0 <= b || to[0] <= from[0] {
            return;
        }
        let crossing = || from[0] + (to[0] - from[0]) * (a / (a - b));
        let from_at = if a < 0.0 { from[0] } else { crossing() };
        let to_at = if b < 0.0 { to[0] } else { crossing() };
        let (from, to) = (from_at.max(part.from), to_at.min(part.to));
        if from < to {
            stretches.push(Stretch { canopy: part.canopy, from, to, per_metre, by });
        }
    };
    if line.length_squared == 0.0 {
        let ground = ground_under(module, side, line.start);
        return below([[0.0, ground], [1.0, ground]]);
    }
    module.lookup().triangles_along_in(side, line.place(part.from), line.place(part.to), wanted, |corners| {
        part_over(&corners, line).into_iter().for_each(&mut below);
    });
}
