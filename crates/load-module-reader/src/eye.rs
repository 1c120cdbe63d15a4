//! Many lines of sight from one place, as for a viewshed: the same answers as one by one, sooner.
//!
//! Ground that lies lower than the line above it needs no look at its triangles: the eye keeps the top of every load
//! module and of every cell of those that it has looked at. And ground that hides a place hides most of the places
//! beside it too, so it is asked first.

use std::cell::OnceCell;

use crate::lookup::Lookup;
use crate::object_lookups::ObjectLookups;
use crate::past::{Stretch, below_top, entered, lost_in};
use crate::sight::{Curvature, Line, crossed_at, hidden_in};
use crate::{LoadedGround, Module, Standing, TerrainModule};

/// Quanta by which ground must stay below a line to be left out: far more than rounding.
const MARGIN: f64 = 2.0;

/// An eye over loaded ground.
pub struct Eye<'a> {
    ground: &'a LoadedGround,
    from_m: [f64; 3],
    from: [f64; 3],
    curvature: Curvature,
    /// Whether it sees nothing at all: below the ground, or nowhere.
    is_blind: bool,
    /// Of each load module the top in quanta, and those of its cells once they were asked for.
    tops: Vec<(f64, OnceCell<Vec<i32>>)>,
    /// The same of its objects.
    object_tops: Vec<OnceCell<ObjectTops>>,
    /// The load module that hid the last place, by row and column.
    blocker: Option<[u32; 2]>,
    /// The load module whose prisms hid the last place that the ground did not hide.
    prism_blocker: Option<[u32; 2]>,
    stretches: Vec<Stretch>,
}

/// How high something rises in quanta: in all, and in each cell of what finds it.
struct Tops {
    highest: f64,
    cells: Vec<i32>,
}

impl Tops {
    fn of(cells: Vec<i32>) -> Self {
        Self { highest: cells.iter().copied().max().map_or(f64::NEG_INFINITY, f64::from), cells }
    }
}

/// How high the objects of a load module rise: prisms, and what each lookup of canopies finds.
struct ObjectTops {
    prisms: Tops,
    canopies: Vec<Tops>,
}

impl ObjectTops {
    fn of(module: &TerrainModule, side: u16, ground: &[i32]) -> Self {
        let (objects, ObjectLookups { prisms, canopies }) = (&module.module().objects, module.objects());
        let roof = |corners: [[i32; 3]; 3]| objects.prisms[corners[0][2] as usize].roof;
        let prisms = Tops::of(prisms.as_ref().map_or_else(Vec::new, |prisms| prisms.tops(roof)));
        let crown = |corners: [[i32; 3]; 3]| {
            let [low, high] = [i32::min, i32::max].map(|end| {
                [0, 1].map(|axis| f64::from(corners.map(|corner| corner[axis]).into_iter().reduce(end).unwrap_or(0)))
            });
            let cells = module.lookup().cells_within(side, [low, high]);
            let under = cells.map(|[row, col]| ground[(row * module.lookup().across() + col) as usize]).max();
            under.unwrap_or(i32::MAX).saturating_add(objects.canopies[corners[0][2] as usize].height.into())
        };
        Self { prisms, canopies: canopies.iter().map(|canopies| Tops::of(canopies.tops(crown))).collect() }
    }
}

impl LoadedGround {
    /// An eye at a place: an easting, a northing and a height above the vertical datum.
    pub fn eye(&self, from_m: [f64; 3], curvature: Curvature) -> Eye<'_> {
        let is_blind = self.is_beyond_any_ground(from_m) || self.is_below(from_m);
        let top = |module: &Module| module.vertices.iter().map(|vertex| vertex.z).max().unwrap_or(i32::MIN);
        let tops = self.modules().iter().map(|module| (f64::from(top(module.module())), OnceCell::new())).collect();
        let object_tops = self.modules().iter().map(|_| OnceCell::new()).collect();
        let from = self.quanta(from_m);
        let (blocker, prism_blocker, stretches) = (None, None, Vec::new());
        Eye { ground: self, from_m, from, curvature, is_blind, tops, object_tops, blocker, prism_blocker, stretches }
    }
}

impl Eye<'_> {
    /// Whether nothing stands between the eye and a place: exactly whether [`LoadedGround::sight_over`] is free.
    pub fn sees(&mut self, to_m: [f64; 3]) -> bool {
        if self.is_blind || self.ground.is_beyond_any_ground(to_m) {
            return false;
        }
        let to = self.ground.quanta(to_m);
        if self.blocker.is_some_and(|[row, col]| self.is_hidden_by(row, col, to)) {
            return false;
        }
        self.blocker = None;
        for [row, col] in self.ground.modules_along(self.from, to) {
            let inside = u32::try_from(row).ok().zip(u32::try_from(col).ok());
            let Some((row, col)) = inside.filter(|&(row, col)| self.ground.block().contains(row, col)) else {
                return false;
            };
            if self.is_hidden_by(row, col, to) {
                self.blocker = Some([row, col]);
                return false;
            }
        }
        !self.ground.is_below(to_m)
    }

    /// The share of light that objects leave from a place which [`Eye::sees`]: what [`LoadedGround::sight_past`] tells,
    /// but 0 where a prism stands between, and where less than a two-hundredth is left.
    pub fn light(&mut self, to_m: [f64; 3], standing: Standing) -> f64 {
        if standing == Standing::None {
            return 1.0;
        }
        let to = self.ground.quanta(to_m);
        if self.prism_blocker.is_some_and(|[row, col]| self.is_behind_prisms(row, col, to)) {
            return 0.0;
        }
        self.prism_blocker = None;
        let length_m = (0..3).map(|axis| (to_m[axis] - self.from_m[axis]).powi(2)).sum::<f64>().sqrt();
        let (most, mut lost) = (-0.005_f64.ln(), 0.0);
        // What hides a place stands before it more often than before the eye.
        for [row, col] in self.ground.modules_along(to, self.from) {
            let (row, col) = (row as u32, col as u32);
            if self.is_behind_prisms(row, col, to) {
                self.prism_blocker = Some([row, col]);
                return 0.0;
            }
            if standing == Standing::All {
                lost += self.lost_in_canopies(row, col, to, length_m);
            }
            if most < lost {
                return 0.0;
            }
        }
        (-lost).exp()
    }

    /// A load module with objects that is loaded, the tops of its ground and of its objects, and the line to a place in
    /// quanta over it.
    fn past_objects(&self, row: u32, col: u32, to: [f64; 3]) -> Option<(&TerrainModule, &[i32], &ObjectTops, Line)> {
        let (ground, side) = (self.ground, self.ground.frame().side);
        let index = ground.block().contains(row, col).then(|| ground.block().index(row, col))?;
        let module = &*ground.modules()[index];
        if module.module().objects.is_empty() {
            return None;
        }
        let of_ground = self.tops[index].1.get_or_init(|| tops_of(module.lookup()));
        let tops = self.object_tops[index].get_or_init(|| ObjectTops::of(module, side, of_ground));
        let corner = [col, row].map(|index| f64::from(index) * f64::from(side));
        Some((module, of_ground, tops, Line::in_module(corner, self.from, to, self.curvature)))
    }

    fn is_behind_prisms(&self, row: u32, col: u32, to: [f64; 3]) -> bool {
        let side = self.ground.frame().side;
        let Some((module, _, tops, line)) = self.past_objects(row, col, to) else { return false };
        let Some(lookup) = &module.objects().prisms else { return false };
        if is_above(&line, [0.0; 2], [f64::from(side); 2], tops.prisms.highest) {
            return false;
        }
        let prisms = &module.module().objects.prisms;
        let (mut is_hidden, mut last) = (false, usize::MAX);
        let wanted = |row, col| may_rise(lookup, side, (&tops.prisms.cells, 0), &line, [row, col]);
        lookup.triangles_along_in(side, line.start, line.end, wanted, |corners| {
            let number = corners[0][2] as usize;
            if !is_hidden && number != std::mem::replace(&mut last, number) {
                is_hidden = entered(&prisms[number], &line).is_finite();
            }
        });
        is_hidden
    }

    /// The logarithm of the share of light that the canopies of one load module take.
    fn lost_in_canopies(&mut self, row: u32, col: u32, to: [f64; 3], length_m: f64) -> f64 {
        let mut stretches = std::mem::take(&mut self.stretches);
        stretches.clear();
        let side = self.ground.frame().side;
        if let Some((module, ground, tops, line)) = self.past_objects(row, col, to) {
            // Where the line stays above all crowns over a cell of the ground, it is in no wood there.
            let wanted = |height, row, col| may_rise(module.lookup(), side, (ground, height), &line, [row, col]);
            for (lookup, tops) in module.objects().canopies.iter().zip(&tops.canopies) {
                if is_above(&line, [0.0; 2], [f64::from(side); 2], tops.highest) {
                    continue;
                }
                let crowns = |row, col| may_rise(lookup, side, (&tops.cells, 0), &line, [row, col]);
                lookup.triangles_along_in(side, line.start, line.end, crowns, |corners| {
                    below_top(module, side, &line, &corners, wanted, &mut stretches);
                });
            }
        }
        let lost = lost_in(&mut stretches, length_m);
        self.stretches = stretches;
        lost
    }

    /// The eye's own place.
    pub fn place_m(&self) -> [f64; 3] {
        self.from_m
    }

    /// Whether a load module that is loaded stands between the eye and a place in quanta.
    fn is_hidden_by(&self, row: u32, col: u32, to: [f64; 3]) -> bool {
        let (ground, side) = (self.ground, self.ground.frame().side);
        let index = ground.block().index(row, col);
        let (module, (top, tops)) = (&ground.modules()[index], &self.tops[index]);
        let wide = f64::from(side);
        let line = Line::in_module([f64::from(col) * wide, f64::from(row) * wide], self.from, to, self.curvature);
        if let Some(decks) = module.decks()
            && crossed_at(decks, side, &line).is_finite()
        {
            return true;
        }
        if is_above(&line, [0.0; 2], [wide; 2], *top) {
            return false;
        }
        let lookup = module.lookup();
        let tops = tops.get_or_init(|| tops_of(lookup));
        hidden_in(lookup, side, &line, |row, col| may_rise(lookup, side, (tops, 0), &line, [row, col])).is_finite()
    }
}

/// Of each cell, row by row, the height in quanta that no triangle which touches it rises above.
fn tops_of(lookup: &Lookup) -> Vec<i32> {
    lookup.tops(|corners| corners.map(|corner| corner[2]).into_iter().max().unwrap_or(i32::MIN))
}

/// Whether a line stays above a height wherever it lies over a rectangle.
fn is_above(line: &Line, low: [f64; 2], high: [f64; 2], top: f64) -> bool {
    let shares = line.shares_over(low, high);
    // Rounding may say that it passes by where it touches a corner.
    shares[0] <= shares[1] && top + MARGIN < line.lowest(shares)
}

/// Whether what stands so many quanta high on the triangles of a cell may rise above a line.
fn may_rise(lookup: &Lookup, side: u16, (tops, up): (&[i32], u16), line: &Line, [row, col]: [u32; 2]) -> bool {
    let ([south, north], [west, east]) = (lookup.lines_of(row, side), lookup.lines_of(col, side));
    let top = f64::from(tops[(row * lookup.across() + col) as usize]) + f64::from(up);
    !is_above(line, [west, south], [east, north], top)
}
