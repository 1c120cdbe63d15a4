//! Many lines of sight from one place, as for a viewshed: the same answers as one by one, sooner.
//!
//! Ground that lies lower than the line above it needs no look at its triangles: the eye keeps the top of every load
//! module and of every cell of those that it has looked at. And ground that hides a place hides most of the places
//! beside it too, so it is asked first.

use std::cell::OnceCell;

use crate::lookup::Lookup;
use crate::sight::{Curvature, Line, crossed_at, hidden_in};
use crate::{LoadedGround, Module};

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
    /// The load module that hid the last place, by row and column.
    blocker: Option<[u32; 2]>,
}

impl LoadedGround {
    /// An eye at a place: an easting, a northing and a height above the vertical datum.
    pub fn eye(&self, from_m: [f64; 3], curvature: Curvature) -> Eye<'_> {
        let is_blind = self.is_beyond_any_ground(from_m) || self.is_below(from_m);
        let top = |module: &Module| module.vertices.iter().map(|vertex| vertex.z).max().unwrap_or(i32::MIN);
        let tops = self.modules().iter().map(|module| (f64::from(top(module.module())), OnceCell::new())).collect();
        Eye { ground: self, from_m, from: self.quanta(from_m), curvature, is_blind, tops, blocker: None }
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
        let tops = tops.get_or_init(|| lookup.tops());
        hidden_in(lookup, side, &line, |row, col| may_rise(lookup, side, tops, &line, [row, col])).is_finite()
    }
}

/// Whether a line stays above a height wherever it lies over a rectangle.
fn is_above(line: &Line, low: [f64; 2], high: [f64; 2], top: f64) -> bool {
    let shares = line.shares_over(low, high);
    // Rounding may say that it passes by where it touches a corner.
    shares[0] <= shares[1] && top + MARGIN < line.lowest(shares)
}

/// Whether the triangles of a cell may rise above a line.
fn may_rise(lookup: &Lookup, side: u16, tops: &[i32], line: &Line, [row, col]: [u32; 2]) -> bool {
    let ([south, north], [west, east]) = (lookup.lines_of(row, side), lookup.lines_of(col, side));
    let top = f64::from(tops[(row * lookup.across() + col) as usize]);
    !is_above(line, [west, south], [east, north], top)
}
