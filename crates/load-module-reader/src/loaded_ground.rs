//! Load modules held in memory around an observer: heights, normals, classes, lines of sight, over and under decks.

use std::sync::Arc;

use crate::frame::steps;
use crate::lookup::{Lookup, STEPS};
use crate::sight::{Curvature, Line, crossed_at, entered_at, hidden_at, least_above};
use crate::{AreaFrame, Block, QUANTA_PER_METRE, Sample, TerrainModule};

/// A block of load modules, loaded. It holds no file open and may be asked from many threads.
#[derive(Clone, Debug)]
pub struct LoadedGround {
    frame: AreaFrame,
    level: u16,
    block: Block,
    /// Row by row from the south-west.
    modules: Vec<Arc<TerrainModule>>,
    /// What finds their triangles, side by side so that a query reads it at once.
    lookups: Vec<Lookup>,
    /// The same for decks; empty where no load module of the block has any.
    decks: Vec<Option<Lookup>>,
    /// Steps of 1/4096 of a quantum along the side of a load module.
    side_steps: i64,
}

/// What stands between two places.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Sight {
    /// Nothing does.
    Free,
    /// The ground or a deck does, for the first time so far along the line: 0 at its beginning, 1 at its end.
    Hidden(f64),
    /// The line leaves what is loaded, and nothing stands in its way before.
    Unknown,
}

impl LoadedGround {
    /// Load modules of one area and level that were loaded in other blocks, row by row from the south-west, as one
    /// block. They are shared, not copied.
    ///
    /// # Panics
    /// When they are not as many as the block has.
    pub fn of_modules(frame: AreaFrame, level: u16, block: Block, modules: Vec<Arc<TerrainModule>>) -> Self {
        assert_eq!(modules.len(), block.count(), "one load module for each place of the block");
        Self::empty(frame, level).with_modules(block, modules)
    }

    /// Nothing loaded yet.
    pub(crate) fn empty(frame: AreaFrame, level: u16) -> Self {
        let side_steps = i64::from(frame.side) * STEPS;
        let block = Block { south: 0, west: 0, north: 0, east: 0 };
        Self { frame, level, block, modules: Vec::new(), lookups: Vec::new(), decks: Vec::new(), side_steps }
    }

    /// The level of detail that is loaded; 0 is the finest.
    pub fn level(&self) -> u16 {
        self.level
    }

    /// The block that is loaded.
    pub fn block(&self) -> Block {
        self.block
    }

    /// Where load modules lie.
    pub fn frame(&self) -> &AreaFrame {
        &self.frame
    }

    /// The load modules, row by row from the south-west.
    pub fn modules(&self) -> &[Arc<TerrainModule>] {
        &self.modules
    }

    /// The load module at (`row`, `col`) of the area, if it is loaded.
    pub fn module(&self, row: u32, col: u32) -> Option<&TerrainModule> {
        self.block.contains(row, col).then(|| &*self.modules[self.block.index(row, col)])
    }

    /// Another block, with its load modules.
    pub(crate) fn with_modules(self, block: Block, modules: Vec<Arc<TerrainModule>>) -> Self {
        let lookups = modules.iter().map(|module| module.lookup().clone()).collect();
        let has_decks = modules.iter().any(|module| module.decks().is_some());
        let of_decks = modules.iter().filter(|_| has_decks).map(|module| module.decks().cloned());
        let decks = of_decks.collect();
        Self { block, modules, lookups, decks, ..self }
    }

    /// The load module under a place, by its place in `modules`, and the place in it in steps. The far sides of the
    /// area belong to it.
    #[inline]
    pub(crate) fn locate(&self, [east_m, north_m]: [f64; 2]) -> Option<(usize, [i64; 2])> {
        let (col, x) = self.steps(east_m - self.frame.origin_m[0], self.frame.cols)?;
        let (row, y) = self.steps(north_m - self.frame.origin_m[1], self.frame.rows)?;
        self.block.contains(row, col).then(|| (self.block.index(row, col), [x, y]))
    }

    /// The row or column of load modules at a distance from the area's side, and the steps from there.
    #[inline]
    fn steps(&self, metres: f64, count: u32) -> Option<(u32, i64)> {
        steps(metres, count, self.side_steps)
    }

    /// Height of the ground at an easting and northing, in metres above the vertical datum, whatever decks hang above
    /// it; `None` where nothing is loaded.
    // In its caller the processor looks further ahead: twice as many a second at random places.
    #[inline(always)]
    pub fn height_m(&self, place_m: [f64; 2]) -> Option<f64> {
        let (index, place) = self.locate(place_m)?;
        self.lookups[index].height_m(place)
    }

    /// Heights at many places at once, in `heights_m`, NaN where nothing is loaded: what [`LoadedGround::height_m`]
    /// gives for each, but faster for places far apart, because memory is asked for several of them before the first is
    /// needed.
    ///
    /// # Panics
    /// When the two lists differ in length.
    pub fn heights_m(&self, places_m: &[[f64; 2]], heights_m: &mut [f64]) {
        const AT_ONCE: usize = 32;
        assert_eq!(places_m.len(), heights_m.len(), "one height for each place");
        for (places, heights) in places_m.chunks(AT_ONCE).zip(heights_m.chunks_mut(AT_ONCE)) {
            let mut located = [None; AT_ONCE];
            places.iter().zip(&mut located).for_each(|(&place, located)| *located = self.locate(place));
            let mut cells = [None; AT_ONCE];
            for (cell, located) in cells.iter_mut().zip(&located) {
                *cell = located.map(|(index, place)| (&self.lookups[index], place, self.lookups[index].cell(place)));
            }
            // Asks for the memory of all cells, and then of all triangles, before the first is searched.
            let touched = cells.iter().map(|cell| cell.map_or(0, |(lookup, _, cell)| lookup.first_word(cell)));
            std::hint::black_box(touched.fold(0, std::ops::BitXor::bitxor));
            for (height, cell) in heights.iter_mut().zip(cells) {
                let found = cell.and_then(|(lookup, place, cell)| lookup.height_in(cell, place));
                *height = found.unwrap_or(f64::NAN);
            }
        }
    }

    /// Height of the topmost of ground and decks that is not above `ceiling_m`, at an easting and northing: with the
    /// height of a vehicle's roof or of its wheels and a step, what it drives on, over a bridge or under it; with
    /// infinity, what lies on top. `None` where nothing is loaded, and where all is above the ceiling or that is not a
    /// number.
    pub fn height_below_m(&self, place_m: [f64; 2], ceiling_m: f64) -> Option<f64> {
        let (index, place) = self.locate(place_m)?;
        let ground = self.lookups[index].height_m(place).filter(|height_m| *height_m <= ceiling_m);
        self.deck_below(index, place, ceiling_m).map_or(ground, |deck| Some(ground.map_or(deck, |m| m.max(deck))))
    }

    /// [`LoadedGround::height_below_m`] at many places at once, each an easting, a northing and a ceiling, in
    /// `heights_m`, NaN where there is none.
    ///
    /// # Panics
    /// When the two lists differ in length.
    pub fn heights_below_m(&self, places_m: &[[f64; 3]], heights_m: &mut [f64]) {
        const AT_ONCE: usize = 32;
        assert_eq!(places_m.len(), heights_m.len(), "one height for each place");
        for (places, heights) in places_m.chunks(AT_ONCE).zip(heights_m.chunks_mut(AT_ONCE)) {
            let mut on_ground = [[0.0; 2]; AT_ONCE];
            on_ground.iter_mut().zip(places).for_each(|(on_ground, &[east, north, _])| *on_ground = [east, north]);
            self.heights_m(&on_ground[..places.len()], heights);
            for (&[east, north, ceiling_m], height_m) in places.iter().zip(heights) {
                *height_m = if *height_m <= ceiling_m { *height_m } else { f64::NAN };
                if self.decks.is_empty() {
                    continue;
                }
                let located = self.locate([east, north]);
                let deck = located.and_then(|(index, place)| self.deck_below(index, place, ceiling_m));
                // The larger of two numbers one of which is not a number is the other.
                *height_m = deck.map_or(*height_m, |deck| deck.max(*height_m));
            }
        }
    }

    /// Height of the topmost deck of a load module that is not above a ceiling, at a place in steps.
    #[inline]
    fn deck_below(&self, index: usize, place: [i64; 2], ceiling_m: f64) -> Option<f64> {
        let decks = self.decks.get(index)?.as_ref()?;
        let below = decks.triangles(place).map(|(_, height_m, _)| height_m).filter(|height_m| *height_m <= ceiling_m);
        below.max_by(f64::total_cmp)
    }

    /// Height, normal and class of the topmost of ground and decks that is not above `ceiling_m`, as
    /// [`LoadedGround::height_below_m`] finds it. Where a deck touches the ground it is the deck.
    pub fn sample_below(&self, place_m: [f64; 2], ceiling_m: f64) -> Option<Sample> {
        let (index, place) = self.locate(place_m)?;
        self.modules[index].sample_below(place, ceiling_m)
    }

    /// Height, normal and class of the ground at an easting and northing; `None` where nothing is loaded. On an edge
    /// it is that of one of the triangles beside it.
    pub fn sample(&self, place_m: [f64; 2]) -> Option<Sample> {
        let (index, place) = self.locate(place_m)?;
        self.modules[index].sample(place)
    }

    /// Whether the ground or a deck stands between two places, each an easting, a northing and a height above the
    /// vertical datum. What only touches the line does not hide it; an end below the ground is hidden. Decks have no
    /// thickness: a line passes over and under them, and is hidden where it goes through one; a place at the height of
    /// a deck stands on it, and is not seen from below. It is unknown where a
    /// coordinate is not finite, or lies further than 1e12 m from the area's south-west corner or from height 0, where
    /// no ground can be. It takes at most as many steps as load modules are crossed.
    pub fn sight(&self, from_m: [f64; 3], to_m: [f64; 3]) -> Sight {
        self.sight_over(from_m, to_m, Curvature::NONE)
    }

    /// [`LoadedGround::sight`] over ground that falls away as the earth does.
    pub fn sight_over(&self, from_m: [f64; 3], to_m: [f64; 3], curvature: Curvature) -> Sight {
        let side = self.frame.side;
        self.walk(from_m, to_m, curvature, |module, line| {
            let nearest = hidden_at(module.lookup(), side, line);
            module.decks().map_or(nearest, |decks| nearest.min(crossed_at(decks, side, line)))
        })
    }

    /// What a line meets first, by what `nearest_in` finds in each load module along it.
    pub(crate) fn walk(
        &self,
        from_m: [f64; 3],
        to_m: [f64; 3],
        curvature: Curvature,
        mut nearest_in: impl FnMut(&TerrainModule, &Line) -> f64,
    ) -> Sight {
        if self.is_beyond_any_ground(from_m) || self.is_beyond_any_ground(to_m) {
            return Sight::Unknown;
        }
        if self.is_below(from_m) {
            return Sight::Hidden(0.0);
        }
        let is_end_below = self.is_below(to_m);
        let (from, to) = (self.quanta(from_m), self.quanta(to_m));
        let side = f64::from(self.frame.side);
        let (mut nearest, mut left_at) = (f64::INFINITY, f64::INFINITY);
        for [row, col] in self.modules_along(from, to) {
            let corner = [col as f64 * side, row as f64 * side];
            let inside = |index: i64| u32::try_from(index).ok();
            let loaded = inside(row).zip(inside(col)).and_then(|(row, col)| self.module(row, col));
            match loaded {
                Some(module) => {
                    let mut line = Line::in_module(corner, from, to, curvature);
                    line.is_end_below = is_end_below;
                    nearest = nearest_in(module, &line);
                }
                None => left_at = entered_at(corner, side, from, to),
            }
            // What comes later lies further along the line; what is not loaded ends the walk whatever rounding says.
            if nearest.is_finite() || loaded.is_none() {
                break;
            }
        }
        match (nearest <= left_at && nearest.is_finite(), left_at.is_finite()) {
            (true, _) => Sight::Hidden(nearest),
            (false, true) => Sight::Unknown,
            (false, false) if is_end_below => Sight::Hidden(1.0),
            (false, false) => Sight::Free,
        }
    }

    /// How far a line between two places stays above the ground at least, in metres: negative where the ground rises
    /// above it. Decks are not looked at. `None` where the line leaves what is loaded.
    pub fn clearance_m(&self, from_m: [f64; 3], to_m: [f64; 3]) -> Option<f64> {
        self.clearance_over_m(from_m, to_m, Curvature::NONE)
    }

    /// [`LoadedGround::clearance_m`] over ground that falls away as the earth does.
    pub fn clearance_over_m(&self, from_m: [f64; 3], to_m: [f64; 3], curvature: Curvature) -> Option<f64> {
        if self.is_beyond_any_ground(from_m) || self.is_beyond_any_ground(to_m) {
            return None;
        }
        let above = |place: [f64; 3]| self.height_m([place[0], place[1]]).map(|height_m| place[2] - height_m);
        let mut least = above(from_m)?.min(above(to_m)?);
        let (from, to) = (self.quanta(from_m), self.quanta(to_m));
        for [row, col] in self.modules_along(from, to) {
            let inside = |index: i64| u32::try_from(index).ok();
            let index = self.block.contains(inside(row)?, inside(col)?).then_some([inside(row)?, inside(col)?])?;
            let corner = [col, row].map(|index| index as f64 * f64::from(self.frame.side));
            let lookup = &self.lookups[self.block.index(index[0], index[1])];
            let line = Line::in_module(corner, from, to, curvature);
            least = least.min(least_above(lookup, self.frame.side, &line) / f64::from(QUANTA_PER_METRE));
        }
        Some(least)
    }

    /// A place in quanta from the area's south-west corner.
    pub(crate) fn quanta(&self, place: [f64; 3]) -> [f64; 3] {
        let metre = f64::from(QUANTA_PER_METRE);
        let (east, north) = (place[0] - self.frame.origin_m[0], place[1] - self.frame.origin_m[1]);
        [east * metre, north * metre, place[2] * metre]
    }

    /// Whether a place is so far away, or no place at all, that nothing can be said of lines to it.
    pub(crate) fn is_beyond_any_ground(&self, place_m: [f64; 3]) -> bool {
        // Areas are at most 2^30 cells a side, of at most 512 m: 5.5e11 m.
        const FAR_M: f64 = 1e12;
        let [east, north] = self.frame.origin_m;
        let distances = [place_m[0] - east, place_m[1] - north, place_m[2]];
        !distances.iter().all(|distance| distance.abs() <= FAR_M)
    }

    /// Whether a place lies below the ground, by more than rounding.
    pub(crate) fn is_below(&self, place_m: [f64; 3]) -> bool {
        const ROUNDING_M: f64 = 1e-6;
        self.height_m([place_m[0], place_m[1]]).is_some_and(|height_m| place_m[2] + ROUNDING_M < height_m)
    }

    /// Rows and columns of the load modules under a line in quanta, from its beginning, where nothing else is between.
    pub(crate) fn modules_along(&self, from: [f64; 3], to: [f64; 3]) -> impl Iterator<Item = [i64; 2]> {
        let side = f64::from(self.frame.side);
        let last = [i64::from(self.frame.cols) - 1, i64::from(self.frame.rows) - 1];
        // The far sides of the area belong to it.
        let index = |quanta: f64, axis: usize| {
            let index = (quanta / side).floor() as i64;
            if quanta == (last[axis] + 1) as f64 * side { last[axis] } else { index }
        };
        let mut at = [index(from[0], 0), index(from[1], 1)];
        let end = [index(to[0], 0), index(to[1], 1)];
        let step = [0, 1].map(|axis| (end[axis] - at[axis]).signum());
        let mut left = [0, 1].map(|axis| (end[axis] - at[axis]).unsigned_abs());
        let mut is_first = true;
        std::iter::from_fn(move || {
            if std::mem::take(&mut is_first) {
                return Some([at[1], at[0]]);
            }
            if left == [0, 0] {
                return None;
            }
            // Share of the line at which the next line of load modules is crossed, east or west and north or south.
            let crossing = |axis: usize| {
                let line = if 0 < step[axis] { at[axis] + 1 } else { at[axis] };
                (line as f64 * side - from[axis]) / (to[axis] - from[axis])
            };
            let axis = match (left[0], left[1]) {
                (0, _) => 1,
                (_, 0) => 0,
                _ => usize::from(crossing(1) < crossing(0)),
            };
            at[axis] += step[axis];
            left[axis] -= 1;
            Some([at[1], at[0]])
        })
    }
}
