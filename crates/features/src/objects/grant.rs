//! What has room: where a load module or a window would hold more than it may, what hides least is left out; and what
//! woods leave free.

use std::collections::BTreeMap;

use terrain::plans::{difference, sorted_out};
use terrain::{Canopy, ObjectKind, Objects, PRISMS_MAX, Prism};

use super::cut::{Piece, border, canopy_lists, cut, walled};
use super::mend::Outline;
use super::plan::{At, METRE, Plan, bounds, doubled_area};

/// What may stand where, in polygons: a roof and each wall are one, and each triangle of a canopy.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ObjectLimits {
    /// Of each load module, row by row.
    pub modules: Vec<u32>,
    /// Of each window, by the load module in which it begins, row by row.
    pub windows: Vec<u32>,
    /// Of the area.
    pub area: u64,
    /// Rows and columns of load modules in the area.
    pub size: [i32; 2],
    /// Rows and columns of load modules in a window.
    pub window: [i32; 2],
}

impl ObjectLimits {
    /// The same of every load module and of every window, and none of the area.
    pub fn even([per_module, per_window]: [u32; 2], size: [i32; 2], window: [i32; 2]) -> Self {
        let count = (size[0] * size[1]) as usize;
        Self { modules: vec![per_module; count], windows: vec![per_window; count], area: u64::MAX, size, window }
    }
}

/// What of one kind is there.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ObjectTally {
    /// Buildings, towers and stretches of wall; of canopies their parts in single load modules.
    pub count: u64,
    /// Silhouette, square metres.
    pub silhouette_m2: f64,
}

/// An object, or the part of a wood in one load module, that had no room.
#[derive(Clone, Debug, PartialEq)]
pub struct Wanting {
    /// What it is.
    pub kind: ObjectKind,
    /// Its first corner, metres east and north of the place 0, 0.
    pub at_m: [f64; 2],
    /// Its height, metres.
    pub height_m: f64,
    /// Its silhouette, square metres.
    pub silhouette_m2: f64,
    /// What was full, by row and column: a load module, or a window by its first one.
    pub full: Full,
}

/// What was full.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Full {
    /// A load module.
    Module([i32; 2]),
    /// The window that begins at a load module.
    Window([i32; 2]),
    /// The area.
    Area,
}

/// What stands where.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Granted {
    /// By row and column of load modules.
    pub modules: BTreeMap<[i32; 2], Objects>,
    /// By kind: what is there, and what was wanted.
    pub kinds: BTreeMap<ObjectKind, [ObjectTally; 2]>,
    /// What had no room, what hides most first.
    pub left_out: Vec<Wanting>,
    /// Woods that stay over roads, water or buildings, since there is no room for what they would cost without: a
    /// place in each load module, metres east and north.
    pub overlaps: Vec<[f64; 2]>,
}

/// What is granted whole, or not at all.
struct Claim {
    kind: ObjectKind,
    /// Its first corner, metres east and north.
    at_m: [f64; 2],
    height_m: f64,
    silhouette_m2: f64,
    /// What stands in each load module, for so many polygons.
    parts: Vec<([i32; 2], Part, u32)>,
    /// A wood that leaves free what is under it, where that costs much more: in place of its part if there is room.
    cleared: Option<Canopy>,
}

impl Claim {
    fn of(outline: &Outline, silhouette_m2: f64, part: ([i32; 2], Part, u32)) -> Self {
        Self {
            kind: outline.traits.kind,
            at_m: outline.plan[0][0].map(|quanta| f64::from(quanta) / METRE),
            height_m: f64::from(outline.traits.height) / METRE,
            silhouette_m2,
            parts: vec![part],
            cleared: None,
        }
    }
}

enum Part {
    Prism(Prism),
    Canopy(Canopy),
}

/// What outlines of an area would take of limits.
pub struct Claims {
    /// What hides most first; ties go by content, as the order of outlines does.
    claims: Vec<Claim>,
    /// Quanta of a load module's side.
    side: i32,
}

impl Claims {
    /// Those in load modules with a side of so many quanta, `size` of them in rows and columns from the place 0, 0.
    /// Woods leave buildings and `free`, in quanta too, clear where that costs no more than they do or there is room.
    pub fn of(outlines: &[Outline], free: &[Plan], size: [i32; 2], side: i32) -> Self {
        let [rows, cols] = size;
        let solid = outlines.iter().filter(|outline| outline.traits.kind.is_prism()).map(|outline| &outline.plan);
        let has_woods = outlines.iter().any(|outline| !outline.traits.kind.is_prism());
        let clear = if has_woods { Clear::of(solid.chain(free), side) } else { Clear::default() };
        let inside = |[row, col]: [i32; 2]| 0 <= row && row < rows && 0 <= col && col < cols;
        let mut claims = Vec::new();
        for outline in outlines {
            let pieces: Vec<Piece> =
                cut(&outline.plan, side).into_iter().filter(|piece| inside(piece.module)).collect();
            match outline.traits.kind.is_prism() {
                true => claims.extend(prisms(outline, &pieces, side)),
                false => claims.extend(canopies(outline, &pieces, &clear, side)),
            }
        }
        claims.sort_by(|a, b| b.silhouette_m2.total_cmp(&a.silhouette_m2));
        Self { claims, side }
    }

    /// By kind: what would be there within limits, and what was wanted.
    pub fn kept(&self, limits: &ObjectLimits) -> BTreeMap<ObjectKind, [ObjectTally; 2]> {
        let mut kinds = BTreeMap::new();
        self.each(limits, |claim, room| tally(&mut kinds, claim, room.is_ok()));
        kinds
    }

    /// What has room within limits.
    pub fn granted(&self, limits: &ObjectLimits) -> Granted {
        let (mut granted, mut crowded) = (Granted::default(), Vec::new());
        let mut left = self.each(limits, |claim, room| {
            tally(&mut granted.kinds, claim, room.is_ok());
            if let Err(full) = room {
                let Claim { kind, at_m, height_m, silhouette_m2, .. } = *claim;
                granted.left_out.push(Wanting { kind, at_m, height_m, silhouette_m2, full });
                return;
            }
            for (module, part, cost) in &claim.parts {
                let objects = granted.modules.entry(*module).or_default();
                match (part, &claim.cleared) {
                    (Part::Prism(prism), _) => objects.prisms.push(prism.clone()),
                    (Part::Canopy(canopy), None) => objects.canopies.push(canopy.clone()),
                    (Part::Canopy(whole), Some(cleared)) => crowded.push((*module, *cost, [cleared, whole])),
                }
            }
        });
        // All that hides has its room now; what is left is for what woods leave free.
        for (module, cost, [cleared, whole]) in crowded {
            let has_room = left.take(&[(module, cleared.triangles.len() as u32 - cost)]).is_ok();
            let canopy = if has_room { cleared } else { whole };
            if !has_room {
                let [row, col] = module;
                let place = |axis: usize| f64::from([col, row][axis] * self.side) + f64::from(whole.places[0][axis]);
                granted.overlaps.push([0, 1].map(|axis| place(axis) / METRE));
            }
            granted.modules.entry(module).or_default().canopies.push(canopy.clone());
        }
        for objects in granted.modules.values_mut() {
            objects.prisms.sort();
            objects.canopies.sort();
        }
        granted
    }

    /// Calls with each claim in order, and whether it has room; and what room is left.
    fn each<'a, 'l>(&'a self, limits: &'l ObjectLimits, mut told: impl FnMut(&'a Claim, Result<(), Full>)) -> Room<'l> {
        let mut room = Room::new(limits);
        for claim in &self.claims {
            let costs: Vec<([i32; 2], u32)> = claim.parts.iter().map(|(module, _, cost)| (*module, *cost)).collect();
            told(claim, room.take(&costs));
        }
        room
    }
}

fn tally(kinds: &mut BTreeMap<ObjectKind, [ObjectTally; 2]>, claim: &Claim, is_kept: bool) {
    let [kept, wanted] = kinds.entry(claim.kind).or_default();
    for tally in std::iter::once(wanted).chain(is_kept.then_some(kept)) {
        tally.count += 1;
        tally.silhouette_m2 += claim.silhouette_m2;
    }
}

/// A building as one claim; one that is longer or wider than a load module as one for each, since its roof could not
/// be level over so much ground.
fn prisms(outline: &Outline, pieces: &[Piece], side: i32) -> Vec<Claim> {
    let kind = outline.traits.kind;
    let across = |axis: usize| {
        let at = || pieces.iter().map(move |piece| piece.module[axis]);
        at().max().unwrap_or(0) - at().min().unwrap_or(0)
    };
    let is_large = 1 < across(0) || 1 < across(1);
    let mut claims: Vec<Claim> = Vec::new();
    for (index, piece) in pieces.iter().enumerate() {
        let rings = walled(piece, &outline.plan, side);
        let around = border(&rings);
        let own = if is_large { index as u64 + 1 } else { 0 };
        let (base, roof) = (outline.traits.bottom, outline.traits.height);
        let prism = Prism { id: id_of(outline, own), kind, base, roof, rings };
        let cost = prism.polygons() as u32;
        let part = (piece.module, Part::Prism(prism), cost);
        let silhouette_m2 = outline.traits.silhouette_m2(around);
        match claims.last_mut().filter(|_| !is_large) {
            Some(claim) => {
                claim.parts.push(part);
                claim.silhouette_m2 += silhouette_m2;
            }
            None => claims.push(Claim::of(outline, silhouette_m2, part)),
        }
    }
    claims
}

/// A wood as a claim in each load module: it need not be level, and so much need not hang together.
fn canopies(outline: &Outline, pieces: &[Piece], clear: &Clear, side: i32) -> Vec<Claim> {
    /// Triangles that a wood may cost in any case.
    const SMALL: u32 = 40;
    /// Metres between stems of trees, and of what is lower.
    const SPACING_M: [f64; 2] = [4.0, 2.0];
    let traits = &outline.traits;
    let spacing_m = SPACING_M[usize::from(traits.kind != ObjectKind::Wood)];
    let canopy = |pieces: &[Piece]| {
        // Numbered in 16 bits: what has more corners in one load module is no outline that a person drew.
        let fits = pieces.iter().flat_map(|piece| piece.plan.iter()).map(Vec::len).sum::<usize>() < PLACES_MAX;
        let (places, triangles) = if fits { canopy_lists(pieces) } else { Default::default() };
        let cost = if fits { triangles.len() as u32 } else { u32::MAX };
        let (id, kind, fullness) = (id_of(outline, 0), traits.kind, traits.fullness);
        let height = u16::try_from(traits.height).unwrap_or(u16::MAX);
        (Canopy { id, kind, height, fullness, spacing: (spacing_m * METRE) as u16, places, triangles }, cost)
    };
    let claim = |pieces: &[Piece]| {
        let around = pieces.iter().map(|piece| border(&walled(piece, &outline.plan, side))).sum();
        let claim = |(canopy, cost)| {
            Claim::of(outline, traits.silhouette_m2(around), (pieces[0].module, Part::Canopy(canopy), cost))
        };
        let whole = canopy(pieces);
        match clear.cut_out(pieces).map(|without| canopy(&without)) {
            Some(cleared) if cleared.1 <= whole.1.saturating_mul(2).max(SMALL) => claim(cleared),
            cleared => {
                let cleared = cleared.filter(|(_, cost)| *cost < u32::MAX).map(|(canopy, _)| canopy);
                Claim { cleared, ..claim(whole) }
            }
        }
    };
    pieces.chunk_by(|a, b| a.module == b.module).map(claim).filter(|claim| 0 < claim.parts[0].2).collect()
}

/// Corners of a canopy in one load module at most.
const PLACES_MAX: usize = 1 << 15;

/// A number for an outline, by what it is and where (FNV-1a); `part` tells its parts apart.
fn id_of(outline: &Outline, part: u64) -> u64 {
    let traits = &outline.traits;
    let mut id = 0xcbf2_9ce4_8422_2325_u64;
    let mut feed = |number: u64| {
        for byte in number.to_le_bytes() {
            id = (id ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
        }
    };
    [traits.kind as u64, traits.bottom as u64, traits.height as u64, part].into_iter().for_each(&mut feed);
    outline.plan.iter().flatten().flatten().for_each(|&at| feed(u64::from(at.cast_unsigned())));
    id
}

/// What is left of the limits.
struct Room<'a> {
    limits: &'a ObjectLimits,
    modules: Vec<u32>,
    windows: Vec<u32>,
    area: u64,
    window_size: [i32; 2],
    prisms: Vec<u32>,
}

impl<'a> Room<'a> {
    fn new(limits: &'a ObjectLimits) -> Self {
        // An area smaller than a window is one.
        let window_size = [0, 1].map(|axis| limits.window[axis].min(limits.size[axis]).max(1));
        let (modules, windows) = (limits.modules.clone(), limits.windows.clone());
        let prisms = vec![0; modules.len()];
        Self { limits, modules, windows, area: limits.area, window_size, prisms }
    }

    fn index(&self, [row, col]: [i32; 2]) -> usize {
        (row * self.limits.size[1] + col) as usize
    }

    /// The first load modules of the windows that hold one.
    fn windows_over(&self, module: [i32; 2]) -> impl Iterator<Item = [i32; 2]> + use<> {
        let range = [0, 1].map(|axis| {
            let wide = self.window_size[axis];
            (module[axis] - wide + 1).max(0)..=module[axis].min(self.limits.size[axis] - wide)
        });
        let [rows, cols] = range;
        rows.flat_map(move |row| cols.clone().map(move |col| [row, col]))
    }

    /// Takes what these parts cost, or nothing where one of them does not fit.
    fn take(&mut self, costs: &[([i32; 2], u32)]) -> Result<(), Full> {
        let mut of_windows: BTreeMap<[i32; 2], u64> = BTreeMap::new();
        // What crosses the side of a load module may have several parts in it.
        let mut of_modules: BTreeMap<[i32; 2], (u64, usize)> = BTreeMap::new();
        for &(module, cost) in costs {
            let (sum, parts) = of_modules.entry(module).or_default();
            (*sum, *parts) = (*sum + u64::from(cost), *parts + 1);
            self.windows_over(module).for_each(|window| *of_windows.entry(window).or_default() += u64::from(cost));
        }
        for (module, (cost, parts)) in of_modules {
            let index = self.index(module);
            if u64::from(self.modules[index]) < cost || PRISMS_MAX < self.prisms[index] as usize + parts {
                return Err(Full::Module(module));
            }
        }
        let full = of_windows.iter().find(|(window, cost)| u64::from(self.windows[self.index(**window)]) < **cost);
        if let Some((&window, _)) = full {
            return Err(Full::Window(window));
        }
        let cost: u64 = costs.iter().map(|&(_, cost)| u64::from(cost)).sum();
        self.area = self.area.checked_sub(cost).ok_or(Full::Area)?;
        for &(module, cost) in costs {
            let index = self.index(module);
            self.modules[index] -= cost;
            self.prisms[index] += 1;
        }
        for (window, cost) in of_windows {
            let index = self.index(window);
            self.windows[index] -= cost as u32;
        }
        Ok(())
    }
}

/// What is to be free of woods, by load module, in quanta from its corner, each with its bounds.
#[derive(Default)]
struct Clear(BTreeMap<[i32; 2], Vec<([At; 2], Plan)>>);

/// Square metres of the least piece of a wood that is left between what is cut out.
const PIECE_M2_MIN: f64 = 25.0;

impl Clear {
    pub(super) fn of<'a>(plans: impl Iterator<Item = &'a Plan>, side: i32) -> Self {
        let mut free: BTreeMap<[i32; 2], Vec<([At; 2], Plan)>> = BTreeMap::new();
        for piece in plans.flat_map(|plan| sorted_out(plan.clone())).flat_map(|plan| cut(&plan, side)) {
            free.entry(piece.module).or_default().push((bounds(&piece.plan), piece.plan));
        }
        Self(free)
    }

    /// Pieces in one load module less what is to be free there; `None` where nothing is.
    pub(super) fn cut_out(&self, pieces: &[Piece]) -> Option<Vec<Piece>> {
        let module = pieces.first()?.module;
        let around: Vec<[At; 2]> = pieces.iter().map(|piece| bounds(&piece.plan)).collect();
        let meets = |[low, high]: &[At; 2]| {
            let is_apart = |of: &[At; 2], axis: usize| of[1][axis] < low[axis] || high[axis] < of[0][axis];
            around.iter().any(|of| !(0..2).any(|axis| is_apart(of, axis)))
        };
        let near = self.0.get(&module)?.iter().filter(|(bounds, _)| meets(bounds));
        let near: Vec<Plan> = near.map(|(_, plan)| plan.clone()).collect();
        if near.is_empty() {
            return None;
        }
        let plans: Vec<Plan> = pieces.iter().map(|piece| piece.plan.clone()).collect();
        let left = difference(&plans, &near);
        let least = (2.0 * PIECE_M2_MIN * METRE * METRE) as i64;
        Some(left.into_iter().filter(|plan| least <= doubled_area(plan)).map(|plan| Piece { module, plan }).collect())
    }
}
