//! Many lines of sight from one place, as for a viewshed: the same answers as one by one, sooner.
//!
//! What lies lower than the line above it needs no look at its triangles: the eye knows how steeply the cells of load
//! modules rise before it, those that it has looked at, or, where it looks far, all around it. And ground that hides a
//! place hides most of the places beside it too, so it is asked first.

use std::cell::Cell;
use std::sync::{Arc, OnceLock};

use crate::horizon::{Horizon, Slope, Vantage};
use crate::lookup::{Corners, Lookup, ObjectLookups};
use crate::past::{Part, Stretch, entered, in_canopies, lost_in, over_canopies};
use crate::sight::{Curvature, Line, crossed_at, risen_at};
use crate::{LoadedGround, QUANTA_PER_METRE, Standing, TerrainModule};

/// An eye over loaded ground. A clone looks for itself, and shares what this one knows of the ground.
#[derive(Clone)]
pub struct Eye<'a> {
    ground: &'a LoadedGround,
    from_m: [f64; 3],
    vantage: Vantage,
    curvature: Curvature,
    /// Whether it sees nothing at all: below the ground, or nowhere.
    is_blind: bool,
    /// How steeply each load module rises, once it was asked for.
    rises: Arc<[OnceLock<Rises>]>,
    /// Of ground and decks, and of objects, where it looks far.
    horizons: Option<Arc<[Horizon; 2]>>,
    /// The load module that hid the last place, by row and column, and the triangle of its ground that did.
    blocker: Option<([u32; 2], Option<Corners>)>,
    /// The load module whose prisms hid the last place that the ground did not hide.
    prism_blocker: Option<[u32; 2]>,
    /// Room for what is found along a line.
    parts: Vec<Part>,
    stretches: Vec<Stretch>,
}

/// How high something rises: each cell of the lookup that finds it, row by row, and its top in quanta.
type Tops = Vec<([[f64; 2]; 2], i32)>;

/// How high all of a load module rises.
struct AllTops {
    ground: Tops,
    decks: Tops,
    prisms: Tops,
    /// What each lookup of canopies finds.
    canopies: Vec<Tops>,
}

impl AllTops {
    /// Of a load module with this south-western corner.
    fn of(module: &TerrainModule, side: u16, [x, y]: [f64; 2]) -> Self {
        let with_cells = |lookup: &Lookup, tops: Vec<i32>| -> Tops {
            let cell = |(cell, top)| {
                let [[south, north], [west, east]] =
                    [cell / lookup.across(), cell % lookup.across()].map(|row| lookup.lines_of(row, side));
                ([[x + west, y + south], [x + east, y + north]], top)
            };
            (0..).zip(tops).map(cell).collect()
        };
        let highest = |lookup: &Lookup| {
            let heights = |corners: [[i32; 3]; 3]| corners.map(|corner| corner[2]).into_iter().max();
            with_cells(lookup, lookup.tops(|corners| heights(corners).unwrap_or(i32::MAX)))
        };
        let (objects, ObjectLookups { prisms, canopies }) = (&module.module().objects, module.objects());
        let roof = |corners: [[i32; 3]; 3]| objects.prisms[corners[0][2] as usize].roof;
        let ground = highest(module.lookup());
        let crown = |corners: [[i32; 3]; 3]| {
            let [low, high] = [i32::min, i32::max].map(|end| {
                [0, 1].map(|axis| f64::from(corners.map(|corner| corner[axis]).into_iter().reduce(end).unwrap_or(0)))
            });
            let cells = module.lookup().cells_within(side, [low, high]);
            let under = cells.map(|[row, col]| ground[(row * module.lookup().across() + col) as usize].1).max();
            under.unwrap_or(i32::MAX).saturating_add(objects.canopies[corners[0][2] as usize].height.into())
        };
        Self {
            decks: module.decks().map(highest).unwrap_or_default(),
            prisms: prisms.as_ref().map(|prisms| with_cells(prisms, prisms.tops(roof))).unwrap_or_default(),
            canopies: canopies.iter().map(|canopies| with_cells(canopies, canopies.tops(crown))).collect(),
            ground,
        }
    }
}

/// How steeply all of a load module rises before an eye, and how far it is, at its nearest and its furthest, in quanta.
struct Rises {
    reach: [f64; 2],
    ground: Slopes,
    decks: Slopes,
    prisms: Slopes,
    canopies: Vec<Slopes>,
}

/// Slopes of the cells of a lookup, row by row, and the largest of them.
struct Slopes {
    highest: Slope,
    cells: Vec<Slope>,
}

impl Rises {
    fn of(vantage: &Vantage, reach: [f64; 2], tops: &AllTops) -> Self {
        let slopes = |tops: &Tops| {
            let cells = tops.iter().map(|&(cell, top)| vantage.slope(vantage.reach(cell), f64::from(top)));
            let cells: Vec<Slope> = cells.collect();
            Slopes { highest: cells.iter().copied().fold(Slope::NONE, Slope::max), cells }
        };
        let [ground, decks, prisms] = [&tops.ground, &tops.decks, &tops.prisms].map(slopes);
        Self { reach, ground, decks, prisms, canopies: tops.canopies.iter().map(slopes).collect() }
    }
}

impl Slopes {
    /// Whether what stands so many quanta high on the triangles of a cell may rise above a line of a slope.
    fn may_rise(&self, lookup: &Lookup, up: u16, line: f64, [row, col]: [u32; 2]) -> bool {
        self.cells[(row * lookup.across() + col) as usize].may_rise(up, line)
    }
}

impl LoadedGround {
    /// An eye at a place: an easting, a northing and a height above the vertical datum.
    pub fn eye(&self, from_m: [f64; 3], curvature: Curvature) -> Eye<'_> {
        let is_blind = self.is_beyond_any_ground(from_m) || self.is_below(from_m);
        let fall = curvature.per_metre() / f64::from(QUANTA_PER_METRE);
        let vantage = Vantage { place: self.quanta(from_m), fall };
        let rises = self.modules().iter().map(|_| OnceLock::new()).collect();
        Eye {
            ground: self,
            from_m,
            vantage,
            curvature,
            is_blind,
            rises,
            horizons: None,
            blocker: None,
            prism_blocker: None,
            parts: Vec::new(),
            stretches: Vec::new(),
        }
    }
}

impl Eye<'_> {
    /// The same eye, which knows all around it so many metres far: sooner for thousands of places.
    #[must_use]
    pub fn looking_far(self, range_m: f64) -> Self {
        if self.is_blind {
            return self;
        }
        let range = range_m * f64::from(QUANTA_PER_METRE);
        let mut horizons = [0, 1].map(|_| Horizon::new(self.vantage, range));
        for index in 0..self.rises.len() {
            let reach = self.vantage.reach(self.rectangle(index));
            if horizons[0].end() < reach[0] {
                continue;
            }
            let tops = AllTops::of(&self.ground.modules()[index], self.ground.frame().side, self.rectangle(index)[0]);
            let mut add = |which: usize, tops: &Tops| {
                tops.iter().for_each(|&(cell, top)| horizons[which].add(cell, top));
            };
            add(0, &tops.ground);
            add(0, &tops.decks);
            add(1, &tops.prisms);
            tops.canopies.iter().for_each(|tops| add(1, tops));
            self.rises[index].get_or_init(|| Rises::of(&self.vantage, reach, &tops));
        }
        Self { horizons: Some(Arc::new(horizons.map(Horizon::closed))), ..self }
    }

    /// Whether nothing stands between the eye and a place: exactly whether [`LoadedGround::sight_over`] is free.
    pub fn sees(&mut self, to_m: [f64; 3]) -> bool {
        if self.is_blind || self.ground.is_beyond_any_ground(to_m) {
            return false;
        }
        let ray = self.ray(to_m, 0);
        if let Some(([row, col], corners)) = self.blocker.take() {
            let line = self.line(self.ground.block().index(row, col), &ray);
            if corners.is_some_and(|corners| 0.0 < line.length_squared && risen_at(&corners, &line).is_finite()) {
                self.blocker = Some(([row, col], corners));
                return false;
            }
            self.blocker = self.hidden_by(row, col, &ray);
            if self.blocker.is_some() {
                return false;
            }
        }
        for [row, col] in self.ground.modules_along(self.vantage.place, ray.to) {
            let inside = u32::try_from(row).ok().zip(u32::try_from(col).ok());
            let Some((row, col)) = inside.filter(|&(row, col)| self.ground.block().contains(row, col)) else {
                return false;
            };
            self.blocker = self.hidden_by(row, col, &ray);
            if self.blocker.is_some() {
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
        let ray = self.ray(to_m, 1);
        if self.prism_blocker.is_some_and(|[row, col]| self.is_behind_prisms(row, col, &ray)) {
            return 0.0;
        }
        self.prism_blocker = None;
        let length_m = (0..3).map(|axis| (to_m[axis] - self.from_m[axis]).powi(2)).sum::<f64>().sqrt();
        let (most, mut lost) = (-0.005_f64.ln(), 0.0);
        // What hides a place stands before it more often than before the eye.
        for [row, col] in self.ground.modules_along(ray.to, self.vantage.place) {
            let (row, col) = (row as u32, col as u32);
            if self.is_behind_prisms(row, col, &ray) {
                self.prism_blocker = Some([row, col]);
                return 0.0;
            }
            if standing == Standing::All {
                lost += self.lost_in_canopies(row, col, &ray, length_m);
            }
            if most < lost {
                return 0.0;
            }
        }
        (-lost).exp()
    }

    /// The eye's own place.
    pub fn place_m(&self) -> [f64; 3] {
        self.from_m
    }

    /// The line to a place, which one of the horizons leaves free.
    fn ray(&self, to_m: [f64; 3], horizon: usize) -> Ray {
        let to = self.ground.quanta(to_m);
        let horizon = self.horizons.as_ref().map(|horizons| &horizons[horizon]);
        let free = horizon.map_or([0.0; 2], |horizon| [horizon.begin(), horizon.clear_to(to)]);
        Ray { to, slope: self.vantage.slope_to(to), free }
    }

    /// The south-western and the north-eastern corner of a load module, in quanta.
    fn rectangle(&self, index: usize) -> [[f64; 2]; 2] {
        let (block, side) = (self.ground.block(), f64::from(self.ground.frame().side));
        let [row, col] = block.place(index);
        let corner = [col, row].map(|index| f64::from(index) * side);
        [corner, corner.map(|axis| axis + side)]
    }

    /// A load module, how steeply it rises, and the line to a place over it; `None` where it rises nowhere above that.
    fn past(&self, index: usize, ray: &Ray) -> Option<(&TerrainModule, &Rises, Line)> {
        let rectangle = self.rectangle(index);
        let module = &*self.ground.modules()[index];
        let rises = self.rises[index].get_or_init(|| {
            let tops = AllTops::of(module, self.ground.frame().side, rectangle[0]);
            Rises::of(&self.vantage, self.vantage.reach(rectangle), &tops)
        });
        let is_free = ray.free[0] <= rises.reach[0] && rises.reach[1] <= ray.free[1];
        (!is_free).then(|| (module, rises, self.line(index, ray)))
    }

    /// The line to a place over a load module.
    fn line(&self, index: usize, ray: &Ray) -> Line {
        Line::in_module(self.rectangle(index)[0], self.vantage.place, ray.to, self.curvature)
    }

    /// The same for its objects, where it is loaded and has some.
    fn past_objects(&self, row: u32, col: u32, ray: &Ray) -> Option<(&TerrainModule, &Rises, Line)> {
        let block = self.ground.block();
        let index = block.contains(row, col).then(|| block.index(row, col))?;
        let has_some = !self.ground.modules()[index].module().objects.is_empty();
        has_some.then(|| self.past(index, ray)).flatten()
    }

    fn is_behind_prisms(&self, row: u32, col: u32, ray: &Ray) -> bool {
        let side = self.ground.frame().side;
        let Some((module, rises, line)) = self.past_objects(row, col, ray) else { return false };
        let Some(lookup) = &module.objects().prisms else { return false };
        if !rises.prisms.highest.may_rise(0, ray.slope) {
            return false;
        }
        let prisms = &module.module().objects.prisms;
        let (mut is_hidden, mut last) = (false, usize::MAX);
        let wanted = |row, col| rises.prisms.may_rise(lookup, 0, ray.slope, [row, col]);
        lookup.triangles_along_in(side, line.start, line.end, wanted, |corners| {
            let number = corners[0][2] as usize;
            if !is_hidden && number != std::mem::replace(&mut last, number) {
                is_hidden = entered(&prisms[number], &line).is_finite();
            }
        });
        is_hidden
    }

    /// The logarithm of the share of light that the canopies of one load module take.
    fn lost_in_canopies(&mut self, row: u32, col: u32, ray: &Ray, length_m: f64) -> f64 {
        let (mut parts, mut stretches) = (std::mem::take(&mut self.parts), std::mem::take(&mut self.stretches));
        parts.clear();
        stretches.clear();
        let side = self.ground.frame().side;
        if let Some((module, rises, line)) = self.past_objects(row, col, ray) {
            // Where the line stays above all crowns over a cell of the ground, it is in no wood there.
            let wanted = |height, row, col| rises.ground.may_rise(module.lookup(), height, ray.slope, [row, col]);
            for (lookup, slopes) in module.objects().canopies.iter().zip(&rises.canopies) {
                if !slopes.highest.may_rise(0, ray.slope) {
                    continue;
                }
                let crowns = |row, col| slopes.may_rise(lookup, 0, ray.slope, [row, col]);
                over_canopies(lookup, side, &line, line.end, crowns, &mut parts);
            }
            in_canopies(module, side, &line, &mut parts, wanted, &mut stretches);
        }
        let lost = lost_in(&mut stretches, length_m);
        (self.parts, self.stretches) = (parts, stretches);
        lost
    }

    /// A load module that is loaded, if it stands between the eye and a place, and its triangle that does.
    fn hidden_by(&self, row: u32, col: u32, ray: &Ray) -> Option<([u32; 2], Option<Corners>)> {
        let side = self.ground.frame().side;
        let (module, rises, line) = self.past(self.ground.block().index(row, col), ray)?;
        if let Some(decks) = module.decks()
            && rises.decks.highest.may_rise(0, ray.slope)
            && crossed_at(decks, side, &line).is_finite()
        {
            return Some(([row, col], None));
        }
        if line.length_squared == 0.0 || !rises.ground.highest.may_rise(0, ray.slope) {
            return None;
        }
        let (lookup, found) = (module.lookup(), Cell::new(None));
        let wanted = |row, col| found.get().is_none() && rises.ground.may_rise(lookup, 0, ray.slope, [row, col]);
        lookup.triangles_along_in(side, line.start, line.end, wanted, |corners| {
            if found.get().is_none() && risen_at(&corners, &line).is_finite() {
                found.set(Some(corners));
            }
        });
        found.get().map(|corners| ([row, col], Some(corners)))
    }
}

/// The line from an eye to a place in quanta.
struct Ray {
    to: [f64; 3],
    slope: f64,
    /// Between which distances it surely stays above everything.
    free: [f64; 2],
}
