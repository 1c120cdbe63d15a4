//! Moving one vertex after another, in x, y and height, to where the squares around it are least.
//!
//! A vertex that moves by (dx, dy, dh) changes the surface at a post of an incident triangle by
//! l (dh - gx dx - gy dy), where l is the vertex's barycentric coordinate there and (gx, gy) the triangle's slope: the
//! surface is continuous, so posts that change hands do not matter. The normal equations of such a step need only the
//! forms of the triangles. No post is read.

use fearless_simd::{Level, Simd, dispatch};
use terrain::geometry::widest_level;

use crate::optimiser::form::{Form, Hinge};
use crate::optimiser::hold::Hold;
use crate::optimiser::lanes::{LANES, StarLanes, Totals};
use crate::optimiser::moments::Sums;
use crate::optimiser::normal::Normal;
use crate::optimiser::parts::Vertex;
use crate::optimiser::place::{PER_POST, Place, Shape};
use crate::optimiser::refit::DAMPING;
use crate::optimiser::tile_mesh::{Star, TileMesh, next};

/// Lattice places that are tried for a vertex, of 36 around it: more gain nothing (measured).
const SNAPS_TRIED: usize = 3;
/// Parts of a Gauss-Newton step that are tried; the first that beats a change of height alone is taken. The ground
/// bends less than its linearisation at the vertex says, so steps beyond the whole one pay most.
const STEPS_TRIED: [f64; 2] = [1.6, 0.5];
/// Steps that promise less than this part of the mean squares of a triangle are not tried.
const LEAST_PROMISE: f64 = 0.008;
/// A move that gains this part of the mean squares of a triangle marks as changed its surroundings.
const LEAST_CHANGE_SHARE: f64 = 0.005;
/// Quanta squared that a move has to gain at least.
const LEAST_GAIN: f64 = 1e-5;

/// Moves vertices of a sheet.
pub(crate) struct Mover {
    level: Level,
    /// In 64ths of a post. On the tile's border, where a neighbour goes on from posts, vertices move from post to post.
    pub step: i32,
    /// Squares that a step has to promise.
    least_promise: f64,
    /// Gain above which a move marks as changed its surroundings.
    least_change: f64,
    star: Star,
    around: Vec<(Place, f64)>,
    /// The same star in lanes, where it has no more triangles than these.
    lanes: StarLanes,
    in_lanes: bool,
    /// Sums west of the edges from the vertex, and of those opposite to it.
    spokes: Vec<Sums>,
    /// The place the spokes were summed from.
    hub: Option<Place>,
    rims: Vec<Sums>,
    candidates: Vec<Place>,
    /// Lattice places by what the normal equations promise of them.
    ranked: Vec<(f64, Place)>,
}

/// A place and a height for a vertex, and what the squares around it then come to.
#[derive(Clone, Copy)]
struct Stand {
    at: Place,
    height: f64,
    squares: f64,
    /// Whether its best height lies further from the ground than it may.
    is_stopped: bool,
}

impl Mover {
    pub fn new(step: i32) -> Self {
        Self::at(widest_level(), step)
    }

    /// With lanes of some width; results do not depend on it.
    pub fn at(level: Level, step: i32) -> Self {
        Self {
            level,
            step,
            least_promise: 0.0,
            least_change: f64::INFINITY,
            star: Star::default(),
            around: Vec::new(),
            lanes: StarLanes::default(),
            in_lanes: false,
            spokes: Vec::new(),
            hub: None,
            rims: Vec::new(),
            candidates: Vec::new(),
            ranked: Vec::new(),
        }
    }

    /// Sets what counts as little, by the mean squares of a triangle.
    pub fn aim(&mut self, mean_squares: f64) {
        self.least_promise = LEAST_PROMISE * mean_squares;
    }

    /// Moves every changed vertex once; only what moves far is changed afterwards.
    pub fn sweep(&mut self, sheet: &mut TileMesh) {
        let mean = sheet.mean_squares();
        self.aim(mean);
        let all = 0..sheet.vertices.len() as u32;
        let changed: Vec<u32> = all.filter(|&v| sheet.is_vertex(v) && sheet.vertices[v as usize].has_changed).collect();
        sheet.vertices.iter_mut().for_each(|vertex| vertex.has_changed = false);
        self.least_change = LEAST_CHANGE_SHARE * mean;
        for vertex in changed {
            self.relax(sheet, vertex);
        }
        self.least_change = f64::INFINITY;
    }

    /// Moves one vertex to a better place, if there is one, and to its best height. Gives the squares gained.
    pub fn relax(&mut self, sheet: &mut TileMesh, vertex: u32) -> f64 {
        dispatch!(self.level, simd => self.relax_in(simd, sheet, vertex))
    }

    #[inline(always)]
    fn relax_in<S: Simd>(&mut self, simd: S, sheet: &mut TileMesh, vertex: u32) -> f64 {
        let record = sheet.vertices[vertex as usize];
        if record.hold.has(Hold::PLACE) {
            return 0.0;
        }
        sheet.star(vertex, &mut self.star);
        self.look_around(sheet);
        let normal = self.normal(simd, sheet, vertex, record.hold.has(Hold::ON_GROUND));
        let stay = height_only(sheet, &record, &normal);
        self.candidates.clear();
        if !record.hold.is_fixed() {
            if stay.is_stopped {
                // Where the ground ends its rise, it rises and falls with the ground.
                let along = self.normal(simd, sheet, vertex, true);
                self.find_candidates(sheet, &record, &along);
            } else {
                self.find_candidates(sheet, &record, &normal);
            }
        }
        let mut best = stay;
        let mut has_rims = false;
        for index in 0..self.candidates.len() {
            let at = self.candidates[index];
            if sheet.ground.is_forbidden(at) || !self.leaves(sheet, (at, record.height), Shape::Sound) {
                continue;
            }
            if !has_rims {
                self.sum_rims(sheet);
                has_rims = true;
            }
            let most = best.squares - LEAST_GAIN;
            let stand = self.stand(simd, sheet, at, &record, most);
            if stand.squares < most {
                best = stand;
                break;
            }
        }
        self.settle(simd, sheet, vertex, best);
        let gain = normal.squares - best.squares;
        if self.least_change < gain {
            sheet.vertices[vertex as usize].has_changed = true;
            self.star.ring.iter().for_each(|&other| sheet.vertices[other as usize].has_changed = true);
        }
        gain
    }

    /// Moves one vertex to the DEM's height at a place of one's own choice; `false` where it may not stand there.
    pub fn put(&mut self, sheet: &mut TileMesh, vertex: u32, at: Place) -> bool {
        dispatch!(self.level, simd => self.put_in(simd, sheet, vertex, at))
    }

    #[inline(always)]
    fn put_in<S: Simd>(&mut self, simd: S, sheet: &mut TileMesh, vertex: u32, at: Place) -> bool {
        let record = sheet.vertices[vertex as usize];
        let strays = || held_to_line(at, record.at, record.hold) != at;
        if record.hold.is_fixed() || strays() || sheet.ground.is_forbidden(at) {
            return false;
        }
        sheet.star(vertex, &mut self.star);
        self.look_around(sheet);
        if !self.leaves(sheet, (at, record.height), Shape::Large) {
            return false;
        }
        self.sum_rims(sheet);
        self.settle(
            simd,
            sheet,
            vertex,
            Stand { at, height: sheet.ground.height(at), squares: 0.0, is_stopped: false },
        );
        true
    }

    /// Moves one vertex to the best of the lattice places around it that leave every triangle its shape;
    /// `false` where there is none.
    ///
    /// The normal equations say in which order the places are promising, and the first few valid ones are tried.
    pub fn snap(&mut self, sheet: &mut TileMesh, vertex: u32, shape: Shape) -> bool {
        dispatch!(self.level, simd => self.snap_in(simd, sheet, vertex, shape))
    }

    #[inline(always)]
    fn snap_in<S: Simd>(&mut self, simd: S, sheet: &mut TileMesh, vertex: u32, shape: Shape) -> bool {
        let record = sheet.vertices[vertex as usize];
        let step = self.step_of(sheet, &record);
        if record.hold.is_fixed() || (record.at.x % step == 0 && record.at.y % step == 0) {
            return true;
        }
        sheet.star(vertex, &mut self.star);
        self.look_around(sheet);
        self.sum_rims(sheet);
        self.rank_places(simd, sheet, vertex, step);
        let mut best = None;
        let mut tried = 0;
        let mut last = None;
        while let Some(at) = self.most_promising() {
            // On a line several places are one.
            if last.replace(at) == Some(at) || !self.leaves(sheet, (at, record.height), shape) {
                continue;
            }
            let most = best.map_or(f64::INFINITY, |best: Stand| best.squares);
            let stand = self.stand(simd, sheet, at, &record, most);
            if stand.squares < most {
                best = Some(stand);
            }
            tried += 1;
            if tried == SNAPS_TRIED {
                break;
            }
        }
        best.inspect(|&best| self.settle(simd, sheet, vertex, best)).is_some()
    }

    /// Fills `ranked` with the lattice places around a vertex.
    #[inline(always)]
    fn rank_places<S: Simd>(&mut self, simd: S, sheet: &TileMesh, vertex: u32, step: i32) {
        const RINGS: i32 = 2;
        let record = sheet.vertices[vertex as usize];
        let plane = self.normal(simd, sheet, vertex, record.hold.has(Hold::ON_GROUND)).plane();
        let (x, y) = (record.at.x - record.at.x % step, record.at.y - record.at.y % step);
        self.ranked.clear();
        for j in -RINGS..=RINGS + 1 {
            for i in -RINGS..=RINGS + 1 {
                let at = held_to_line(Place::new(x + i * step, y + j * step), record.at, record.hold);
                if is_inside(sheet, at) && !sheet.ground.is_forbidden(at) {
                    let (dx, dy) = Place::new(at.x - record.at.x, at.y - record.at.y).posts();
                    self.ranked.push((plane.rise(dx, dy), at));
                }
            }
        }
    }

    /// Takes the most promising of the places that are left: few are looked at, so sorting all would cost more.
    #[inline(always)]
    fn most_promising(&mut self) -> Option<Place> {
        let order = |a: &(f64, Place), b: &(f64, Place)| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1));
        let best = (0..self.ranked.len()).min_by(|&a, &b| order(&self.ranked[a], &self.ranked[b]))?;
        Some(self.ranked.swap_remove(best).1)
    }

    #[inline(always)]
    fn step_of(&self, sheet: &TileMesh, record: &Vertex) -> i32 {
        let (at, far) = (record.at, sheet.ground.far());
        let is_on_border = at.x == 0 || at.y == 0 || at.x == far.x || at.y == far.y;
        if is_on_border { PER_POST } else { self.step }
    }

    #[inline(always)]
    fn look_around(&mut self, sheet: &TileMesh) {
        self.around.clear();
        self.hub = None;
        let look = |&vertex: &u32| (sheet.at(vertex), sheet.vertices[vertex as usize].height);
        self.around.extend(self.star.ring.iter().map(look));
        self.in_lanes = self.lanes.enter(&self.around, self.star.edges.len());
    }

    /// The places and heights that triangle `i` of the star has beside the vertex.
    #[inline(always)]
    fn opposite(&self, i: usize) -> [(Place, f64); 2] {
        [self.around[i], self.around[self.after(i)]]
    }

    /// The neighbour after neighbour `i`.
    #[inline(always)]
    fn after(&self, i: usize) -> usize {
        if i + 1 == self.around.len() { 0 } else { i + 1 }
    }

    /// Whether a vertex at a place, with a height in quanta, leaves every triangle around it such a shape.
    #[inline(always)]
    fn leaves(&self, sheet: &TileMesh, (at, height): (Place, f64), shape: Shape) -> bool {
        (0..self.star.edges.len()).all(|i| {
            if shape == Shape::Sound && sheet.has_features {
                return sheet.is_sound_at((at, height), [self.star.ring[i], self.star.ring[self.after(i)]]);
            }
            let [a, b] = self.opposite(i);
            shape.admits(at, a.0, b.0)
        })
    }

    #[inline(always)]
    fn normal<S: Simd>(&self, simd: S, sheet: &TileMesh, vertex: u32, keeps_to_ground: bool) -> Normal {
        let record = &sheet.vertices[vertex as usize];
        let ground_slope = keeps_to_ground.then(|| sheet.ground.slope(record.at));
        if self.in_lanes {
            return self.normal_in_lanes(simd, sheet, record, ground_slope);
        }
        let mut normal = Normal::default();
        for (i, &edge) in self.star.edges.iter().enumerate() {
            let (triangle, k) = ((edge >> 2) as usize, (edge & 3) as usize);
            let (face, form) = (&sheet.triangles[triangle], &sheet.forms[triangle]);
            let pull = form.pull(k, sheet.heights(face.corners));
            let [a, b] = self.opposite(i);
            let (ax, ay) = Place::new(a.0.x - record.at.x, a.0.y - record.at.y).posts();
            let (bx, by) = Place::new(b.0.x - record.at.x, b.0.y - record.at.y).posts();
            let (ha, hb) = (a.1 - record.height, b.1 - record.height);
            let per_area = 1.0 / (ax * by - ay * bx);
            let slope = [(ha * by - hb * ay) * per_area, (hb * ax - ha * bx) * per_area];
            // A vertex that keeps to the ground rises with it.
            let toward = match ground_slope {
                Some(ground) => [ground[0] - slope[0], ground[1] - slope[1], 0.0],
                None => [-slope[0], -slope[1], 1.0],
            };
            normal.add(toward, form.aa[k], pull);
            normal.squares += face.squares;
            normal.reach = normal.reach.max(ax.abs()).max(ay.abs());
        }
        normal
    }

    #[inline(always)]
    fn normal_in_lanes<S: Simd>(
        &self,
        simd: S,
        sheet: &TileMesh,
        record: &Vertex,
        ground_slope: Option<[f64; 2]>,
    ) -> Normal {
        let (mut stiffness, mut pull) = ([0.0; LANES], [0.0; LANES]);
        let mut normal = Normal::default();
        for (i, &edge) in self.star.edges.iter().enumerate() {
            let (triangle, k) = ((edge >> 2) as usize, (edge & 3) as usize);
            let (face, form) = (&sheet.triangles[triangle], &sheet.forms[triangle]);
            (stiffness[i], pull[i]) = (form.aa[k], form.pull(k, sheet.heights(face.corners)));
            normal.squares += face.squares;
            normal.stiffness += stiffness[i];
            normal.height_pull += pull[i];
        }
        let all = self.lanes.totals(simd, (record.at, record.height), &stiffness, &pull, ground_slope);
        let Totals { xx, xy, xh, yy, yh, hh, pull, reach } = all;
        normal.matrix = [[xx, xy, xh], [xy, yy, yh], [xh, yh, hh]];
        Normal { pull, reach, ..normal }
    }

    #[inline(always)]
    fn find_candidates(&mut self, sheet: &TileMesh, record: &Vertex, normal: &Normal) {
        let step = self.step_of(sheet, record);
        let (from, hold) = (record.at, record.hold);
        let plane = normal.plane();
        let Some((dx, dy)) = normal.step(&plane, hold) else { return };
        if plane.u * dx + plane.w * dy < self.least_promise {
            return;
        }
        for part in STEPS_TRIED {
            let round = |from: i32, by: f64| {
                let to = f64::from(from) + part * by * f64::from(PER_POST);
                (to / f64::from(step)).round() as i32 * step
            };
            let at = held_to_line(Place::new(round(from.x, dx), round(from.y, dy)), from, hold);
            if at != from && is_inside(sheet, at) && !self.candidates.contains(&at) {
                self.candidates.push(at);
            }
        }
    }

    #[inline(always)]
    fn sum_rims(&mut self, sheet: &TileMesh) {
        self.rims.clear();
        for (i, &edge) in self.star.edges.iter().enumerate() {
            let sums = sheet.sums_of(next(edge));
            self.rims.push(sums);
            if self.in_lanes {
                self.lanes.put_rim(i, &sums);
            }
        }
    }

    #[inline(always)]
    fn sum_spokes<S: Simd>(&mut self, simd: S, sheet: &TileMesh, at: Place) {
        if self.hub != Some(at) {
            self.spokes.clear();
            for (i, &(to, _)) in self.around.iter().enumerate() {
                let sums = sheet.ground.moments.edge_in(simd, at, to);
                self.spokes.push(sums);
                if self.in_lanes {
                    self.lanes.put_spoke(i, self.around.len(), &sums);
                }
            }
            self.hub = Some(at);
        }
    }

    /// The sums of triangle `i` of the star, spokes and rims being summed.
    #[inline(always)]
    fn sums(&self, i: usize) -> Sums {
        self.spokes[i] + self.rims[i] - self.spokes[self.after(i)]
    }

    /// What comes of standing at a valid place, at the best height there; where squares are `most` or more, at the best
    /// height whatever the ground permits.
    #[inline(always)]
    fn stand<S: Simd>(&mut self, simd: S, sheet: &TileMesh, at: Place, record: &Vertex, most: f64) -> Stand {
        self.sum_spokes(simd, sheet, at);
        let hold = record.hold;
        let height = if hold.has(Hold::ON_GROUND) { sheet.ground.height(at) } else { record.height };
        let all = if self.in_lanes { self.lanes.hinge(simd, at, height) } else { self.hinge(at, height) };
        if !hold.height_is_free() {
            return Stand { at, height, squares: all.squares, is_stopped: false };
        }
        let least = |rise: f64| all.squares - rise * (2.0 * all.pull - rise * all.stiffness);
        let rise = all.pull / (all.stiffness + DAMPING);
        let free = Stand { at, height: height + rise, squares: least(rise), is_stopped: false };
        // What the ground permits is no better, and not asked of a place that is not good enough anyway.
        if most <= free.squares {
            return free;
        }
        let bounded = sheet.ground.bounded(at, free.height);
        if bounded == free.height {
            return free;
        }
        Stand { height: bounded, squares: least(bounded - height), is_stopped: true, ..free }
    }

    /// What all triangles say about the height of the vertex at a place, one after the other.
    fn hinge(&self, at: Place, height: f64) -> Hinge {
        let mut all = Hinge::default();
        for i in 0..self.star.edges.len() {
            let [a, b] = self.opposite(i);
            all += Hinge::new(&self.sums(i), [at, a.0, b.0], [height, a.1, b.1]);
        }
        all
    }

    /// Puts the vertex where it is to stand.
    #[inline(always)]
    fn settle<S: Simd>(&mut self, simd: S, sheet: &mut TileMesh, vertex: u32, stand: Stand) {
        let record = &mut sheet.vertices[vertex as usize];
        record.height = stand.height;
        let moved = record.at != stand.at;
        if moved {
            record.at = stand.at;
            self.sum_spokes(simd, sheet, stand.at);
        }
        for i in 0..self.star.edges.len() {
            let (triangle, k) = (self.star.edges[i] >> 2, (self.star.edges[i] & 3) as usize);
            if moved {
                let corners = sheet.triangles[triangle as usize].corners;
                // Its own corners in their order: forms are rounded, and not alike from another corner.
                sheet.forms[triangle as usize] = Form::new(&self.sums(i), sheet.places(corners));
                let sums = &mut sheet.sums[triangle as usize];
                (sums[k], sums[(k + 2) % 3]) = (self.spokes[i], -self.spokes[self.after(i)]);
            }
            sheet.settle(triangle);
        }
    }
}

/// The best height where the vertex stands.
#[inline(always)]
fn height_only(sheet: &TileMesh, record: &Vertex, normal: &Normal) -> Stand {
    if !record.hold.height_is_free() {
        return Stand { at: record.at, height: record.height, squares: normal.squares, is_stopped: false };
    }
    let best = record.height + normal.height_pull / (normal.stiffness + DAMPING);
    let height = sheet.ground.bounded(record.at, best);
    let rise = height - record.height;
    let gain = rise * (2.0 * normal.height_pull - rise * normal.stiffness);
    Stand { at: record.at, height, squares: normal.squares - gain, is_stopped: height != best }
}

fn held_to_line(to: Place, from: Place, hold: Hold) -> Place {
    Place::new(if hold.has(Hold::COLUMN) { from.x } else { to.x }, if hold.has(Hold::ROW) { from.y } else { to.y })
}

fn is_inside(sheet: &TileMesh, at: Place) -> bool {
    let far = sheet.ground.far();
    0 <= at.x && 0 <= at.y && at.x <= far.x && at.y <= far.y
}
