//! The mesh while it is being improved: half-edges, vertices anywhere on the working lattice, a form per triangle.

use terrain::{PostRect, Tin, Vertex as TinVertex};

use crate::optimiser::form::Form;
use crate::optimiser::hold::Hold;
use crate::optimiser::moments::Sums;
use crate::optimiser::parts::{NONE, Parts, Vertex, line_hold};
use crate::optimiser::place::along_curve;
use crate::optimiser::place::{Place, Shape, is_fit};
use crate::optimiser::weighted_heights::WeightedHeights;

/// One triangle, counter-clockwise. An edge is `4 * triangle + corner it leaves`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Triangle {
    /// The first is [`NONE`] once the triangle is gone.
    pub corners: [u32; 3],
    pub twins: [u32; 3],
    /// Sum of squared residuals.
    pub squares: f64,
}

#[inline(always)]
pub(crate) fn next(edge: u32) -> u32 {
    if edge & 3 == 2 { edge - 2 } else { edge + 1 }
}

#[inline(always)]
pub(crate) fn previous(edge: u32) -> u32 {
    if edge & 3 == 0 { edge + 2 } else { edge - 1 }
}

/// The triangles around a vertex, counter-clockwise.
#[derive(Clone, Debug, Default)]
pub(crate) struct Star {
    /// The edges that leave the vertex, one in each triangle.
    pub edges: Vec<u32>,
    /// Where they lead; a vertex on the border has one more neighbour than triangles.
    pub ring: Vec<u32>,
}

impl Star {
    pub fn is_closed(&self) -> bool {
        self.edges.len() == self.ring.len()
    }

    #[inline(always)]
    pub fn triangles(&self) -> impl ExactSizeIterator<Item = u32> {
        self.edges.iter().map(|&edge| edge >> 2)
    }
}

/// The mesh of a tile.
#[derive(Clone)]
pub(crate) struct TileMesh<'a> {
    pub ground: &'a WeightedHeights<'a>,
    pub vertices: Vec<Vertex>,
    pub triangles: Vec<Triangle>,
    pub forms: Vec<Form>,
    /// Sums west of each triangle's edges: an edge is walked when it comes to be, not whenever it is looked at.
    pub sums: Vec<[Sums; 3]>,
    pub triangle_count: usize,
    pub vertex_count: usize,
    pub(crate) free_vertices: Vec<u32>,
    pub(crate) free_triangles: Vec<u32>,
    line_step: Option<i32>,
    /// Edges of features, by their ends, the lesser first, in ascending order.
    kept: Vec<[Place; 2]>,
    /// Whether there are features, which may stand closer together than a sound triangle is high.
    pub has_features: bool,
}

impl<'a> TileMesh<'a> {
    /// The sheet of some parts, in an order in which neighbours in space are neighbours in memory.
    pub fn new(ground: &'a WeightedHeights<'a>, parts: Parts, line_step: Option<i32>, has_features: bool) -> Self {
        let mut sheet = Self {
            ground,
            vertices: Vec::new(),
            triangles: Vec::new(),
            forms: Vec::new(),
            sums: Vec::new(),
            triangle_count: 0,
            vertex_count: 0,
            free_vertices: Vec::new(),
            free_triangles: Vec::new(),
            line_step,
            kept: parts.kept,
            has_features,
        };
        sheet.fill(parts.vertices, &parts.triangles);
        sheet
    }

    fn fill(&mut self, vertices: Vec<Vertex>, triangles: &[[u32; 3]]) {
        let mut used = vec![false; vertices.len()];
        triangles.iter().flatten().for_each(|&vertex| used[vertex as usize] = true);
        let live = (0..vertices.len() as u32).filter(|&vertex| used[vertex as usize]);
        let order = along_curve(live, |vertex| vertices[vertex as usize].at);
        let mut place = vec![NONE; vertices.len()];
        order.iter().enumerate().for_each(|(index, &vertex)| place[vertex as usize] = index as u32);
        self.vertices = order.iter().map(|&vertex| vertices[vertex as usize]).collect();
        let corners = |triangle: u32| triangles[triangle as usize].map(|vertex| place[vertex as usize]);
        let middle = |triangle: u32| {
            let [a, b, c] = corners(triangle).map(|vertex| self.vertices[vertex as usize].at);
            Place::new((a.x + b.x + c.x) / 3, (a.y + b.y + c.y) / 3)
        };
        let order = along_curve(0..triangles.len() as u32, middle);
        self.triangles = order
            .iter()
            .map(|&triangle| Triangle { corners: corners(triangle), twins: [NONE; 3], squares: 0.0 })
            .collect();
        self.link();
        self.walk_edges();
        self.forms = self.triangles.iter().zip(&self.sums).map(|(record, sums)| self.form_of(record, sums)).collect();
        (0..self.triangles.len() as u32).for_each(|triangle| self.settle(triangle));
        (self.vertex_count, self.triangle_count) = (self.vertices.len(), self.triangles.len());
    }

    /// Finds every edge's twin.
    fn link(&mut self) {
        let mut leaving = vec![NONE; self.vertices.len()];
        let mut beside = vec![NONE; 4 * self.triangles.len()];
        for (triangle, record) in self.triangles.iter().enumerate() {
            for (k, &corner) in record.corners.iter().enumerate() {
                let edge = 4 * triangle as u32 + k as u32;
                beside[edge as usize] = std::mem::replace(&mut leaving[corner as usize], edge);
            }
        }
        for (vertex, &edge) in self.vertices.iter_mut().zip(&leaving) {
            vertex.edge = edge;
        }
        for edge in self.edges() {
            let (from, to) = self.ends(edge);
            let mut other = leaving[to as usize];
            while other != NONE && self.ends(other).1 != from {
                other = beside[other as usize];
            }
            self.triangles[(edge >> 2) as usize].twins[(edge & 3) as usize] = other;
        }
    }

    /// Sums west of every edge; its twin has the same, negative.
    fn walk_edges(&mut self) {
        self.sums.clear();
        for (triangle, record) in self.triangles.iter().enumerate() {
            let [a, b, c] = self.places(record.corners);
            let sums = |k: usize, from: Place, to: Place| match record.twins[k] {
                twin if twin < 4 * triangle as u32 => -self.sums_of(twin),
                _ => self.ground.moments.edge(from, to),
            };
            let sums = [sums(0, a, b), sums(1, b, c), sums(2, c, a)];
            self.sums.push(sums);
        }
    }

    /// Brings sums, forms and squares up to date with all places and heights.
    pub fn sum_again(&mut self) {
        for triangle in 0..self.triangles.len() {
            if !self.is_live(triangle as u32) {
                continue;
            }
            let record = self.triangles[triangle];
            let at = self.places(record.corners);
            for k in 0..3 {
                self.sums[triangle][k] = match record.twins[k] {
                    twin if twin < 4 * triangle as u32 => -self.sums_of(twin),
                    _ => self.ground.moments.edge(at[k], at[(k + 1) % 3]),
                };
            }
            self.forms[triangle] = self.form_of(&record, &self.sums[triangle]);
            self.settle(triangle as u32);
        }
    }

    /// Sums over the posts west of an edge.
    #[inline(always)]
    pub fn sums_of(&self, edge: u32) -> Sums {
        self.sums[(edge >> 2) as usize][(edge & 3) as usize]
    }

    fn edges(&self) -> impl Iterator<Item = u32> + use<> {
        (0..self.triangles.len() as u32).flat_map(|triangle| (0..3).map(move |k| 4 * triangle + k))
    }

    /// What lies on a line may only move along it.
    pub fn line_hold(&self, at: Place) -> Hold {
        line_hold(self.ground, self.line_step, at)
    }

    #[inline(always)]
    pub fn at(&self, vertex: u32) -> Place {
        self.vertices[vertex as usize].at
    }

    #[inline(always)]
    pub fn places(&self, corners: [u32; 3]) -> [Place; 3] {
        [self.at(corners[0]), self.at(corners[1]), self.at(corners[2])]
    }

    #[inline(always)]
    pub fn heights(&self, corners: [u32; 3]) -> [f64; 3] {
        let height = |vertex: u32| self.vertices[vertex as usize].height;
        [height(corners[0]), height(corners[1]), height(corners[2])]
    }

    #[inline(always)]
    pub fn twin(&self, edge: u32) -> u32 {
        self.triangles[(edge >> 2) as usize].twins[(edge & 3) as usize]
    }

    /// The vertices an edge leaves and reaches.
    #[inline(always)]
    pub fn ends(&self, edge: u32) -> (u32, u32) {
        let corners = &self.triangles[(edge >> 2) as usize].corners;
        (corners[(edge & 3) as usize], corners[(next(edge) & 3) as usize])
    }

    /// The corner that `edge` does not touch.
    #[inline(always)]
    pub fn apex(&self, edge: u32) -> u32 {
        self.triangles[(edge >> 2) as usize].corners[(previous(edge) & 3) as usize]
    }

    /// The ends of an inner edge and the two corners beyond it, its own triangle's first.
    #[inline(always)]
    pub fn around_edge(&self, edge: u32) -> [u32; 4] {
        let (a, b) = self.ends(edge);
        [a, b, self.apex(edge), self.apex(self.twin(edge))]
    }

    /// Whether an edge is on the border, or an inner one seen from the higher of its two sides.
    #[inline(always)]
    pub fn is_upper_side(&self, edge: u32) -> bool {
        let twin = self.twin(edge);
        twin == NONE || twin < edge
    }

    pub fn is_live(&self, triangle: u32) -> bool {
        self.triangles[triangle as usize].corners[0] != NONE
    }

    pub fn is_vertex(&self, vertex: u32) -> bool {
        self.vertices[vertex as usize].edge != NONE
    }

    /// Whether the edge between two neighbours lies on a line or belongs to a feature.
    #[inline(always)]
    pub fn is_constrained(&self, a: u32, b: u32) -> bool {
        let (a, b) = (&self.vertices[a as usize], &self.vertices[b as usize]);
        let both = |line: Hold| a.hold.has(line) && b.hold.has(line);
        (a.at.x == b.at.x && both(Hold::COLUMN))
            || (a.at.y == b.at.y && both(Hold::ROW))
            || (both(Hold::FEATURE) && self.keeps(a.at, b.at))
    }

    fn keeps(&self, a: Place, b: Place) -> bool {
        self.kept.binary_search(&[a.min(b), a.max(b)]).is_ok()
    }

    /// Whether a triangle between three vertices is one that ground may have.
    #[inline(always)]
    pub fn is_sound(&self, corners: [u32; 3]) -> bool {
        let [a, b, c] = self.places(corners);
        if !self.has_features {
            return Shape::Sound.admits(a, b, c);
        }
        let holds = corners.map(|corner| self.vertices[corner as usize].hold);
        is_fit([a, b, c], self.heights(corners), holds, self.ground.quanta_per_step)
    }

    /// The same of a triangle between a place, with a height in quanta, and two vertices.
    #[inline(always)]
    pub fn is_sound_at(&self, (at, height): (Place, f64), [a, b]: [u32; 2]) -> bool {
        let [a, b] = [a, b].map(|vertex| &self.vertices[vertex as usize]);
        if !self.has_features {
            return Shape::Sound.admits(at, a.at, b.at);
        }
        let (heights, holds) = ([height, a.height, b.height], [Hold::FREE, a.hold, b.hold]);
        is_fit([at, a.at, b.at], heights, holds, self.ground.quanta_per_step)
    }

    /// The post of largest weighted residual under a triangle where a vertex may come, and that residual in quanta:
    /// on an edge of a feature none may.
    #[inline(always)]
    pub fn worst(&self, corners: [u32; 3]) -> Option<(f64, Place)> {
        let (places, heights) = (self.places(corners), self.heights(corners));
        if !self.has_features {
            return self.ground.worst(places, heights, |_| true);
        }
        let is_kept = [0, 1, 2].map(|k| {
            let both = [k, (k + 1) % 3].map(|k| self.vertices[corners[k] as usize].hold.has(Hold::FEATURE));
            both == [true, true] && self.keeps(places[k], places[(k + 1) % 3])
        });
        self.ground.worst(places, heights, |at| {
            let lies_on = |k: usize| is_kept[k] && Place::orient(places[k], places[(k + 1) % 3], at) == 0;
            !(0..3).any(lies_on) && !self.ground.is_forbidden(at)
        })
    }

    fn form_of(&self, record: &Triangle, sums: &[Sums; 3]) -> Form {
        Form::new(&(sums[0] + sums[1] + sums[2]), self.places(record.corners))
    }

    /// Brings a triangle's squares up to date with its corners' heights.
    #[inline(always)]
    pub fn settle(&mut self, triangle: u32) {
        let heights = self.heights(self.triangles[triangle as usize].corners);
        self.triangles[triangle as usize].squares = self.forms[triangle as usize].squares(heights);
    }

    /// Sum of squared residuals over all posts.
    pub fn squares(&self) -> f64 {
        self.triangles.iter().map(|record| record.squares).sum()
    }

    /// Mean squares of a triangle.
    pub fn mean_squares(&self) -> f64 {
        self.squares() / self.triangle_count as f64
    }

    /// Squares that half of the triangles do not exceed.
    pub fn median_squares(&self) -> f64 {
        let live = self.triangles.iter().filter(|record| record.corners[0] != NONE);
        let mut squares: Vec<f64> = live.map(|record| record.squares).collect();
        let middle = squares.len() / 2;
        *squares.select_nth_unstable_by(middle, f64::total_cmp).1
    }

    /// Sum of squared residuals over all posts, whatever their weights.
    pub fn plain_squares(&self) -> f64 {
        if self.ground.squares_are_plain() {
            return self.squares();
        }
        let live = self.triangles.iter().filter(|record| record.corners[0] != NONE);
        live.map(|record| self.ground.plain_squares(self.places(record.corners), self.heights(record.corners))).sum()
    }

    pub fn mark_all_changed(&mut self) {
        self.vertices.iter_mut().for_each(|vertex| vertex.has_changed = true);
    }

    /// Stirs a vertex and those around it.
    pub fn mark_around(&mut self, vertex: u32, star: &mut Star) {
        self.star(vertex, star);
        self.vertices[vertex as usize].has_changed = true;
        star.ring.iter().for_each(|&other| self.vertices[other as usize].has_changed = true);
    }

    /// Fills `star` with the triangles around a vertex.
    #[inline(always)]
    pub fn star(&self, vertex: u32, star: &mut Star) {
        star.edges.clear();
        star.ring.clear();
        let entry = self.vertices[vertex as usize].edge;
        // Clockwise to the border, if there is one, and then around from there.
        let mut first = entry;
        loop {
            let twin = self.twin(first);
            if twin == NONE {
                break;
            }
            first = next(twin);
            if first == entry {
                break;
            }
        }
        let mut edge = first;
        loop {
            star.edges.push(edge);
            star.ring.push(self.ends(edge).1);
            let back = previous(edge);
            let twin = self.twin(back);
            if twin == NONE {
                star.ring.push(self.ends(back).0);
                return;
            }
            edge = twin;
            if edge == first {
                return;
            }
        }
    }

    /// A new vertex; it belongs to no triangle yet.
    pub fn add_vertex(&mut self, at: Place, height: f64, hold: Hold) -> u32 {
        let vertex = Vertex { at, height, edge: NONE, hold, has_changed: true, cost: f64::NAN };
        match self.free_vertices.pop() {
            Some(index) => {
                self.vertices[index as usize] = vertex;
                index
            }
            None => {
                self.vertices.push(vertex);
                self.vertices.len() as u32 - 1
            }
        }
    }

    /// Gives back a vertex that no triangle has.
    pub fn drop_vertex(&mut self, vertex: u32) {
        self.vertices[vertex as usize].edge = NONE;
        self.free_vertices.push(vertex);
    }

    /// Brings all triangles around a vertex up to date with its height.
    #[inline(always)]
    pub fn settle_around(&mut self, vertex: u32) {
        let entry = self.vertices[vertex as usize].edge;
        let mut edge = entry;
        loop {
            self.settle(edge >> 2);
            let twin = self.twin(previous(edge));
            if twin == NONE {
                break;
            }
            edge = twin;
            if edge == entry {
                return;
            }
        }
        edge = entry;
        loop {
            let twin = self.twin(edge);
            if twin == NONE {
                return;
            }
            edge = next(twin);
            self.settle(edge >> 2);
        }
    }

    /// What is wrong with the links between triangles and vertices, if anything is.
    pub fn fault(&self) -> Option<String> {
        for edge in self.edges().filter(|&edge| self.is_live(edge >> 2)) {
            let (from, to) = self.ends(edge);
            let twin = self.twin(edge);
            if twin != NONE && (!self.is_live(twin >> 2) || self.ends(twin) != (to, from) || self.twin(twin) != edge) {
                return Some(format!("edge {edge} from {from} to {to} and its twin {twin} disagree"));
            }
            if twin == NONE && !self.is_constrained(from, to) {
                return Some(format!("edge {edge} from {from} to {to} has no twin"));
            }
            if self.sums_of(edge) != self.ground.moments.edge(self.at(from), self.at(to)) {
                return Some(format!("edge {edge} from {from} to {to} has the sums of another"));
            }
            if !self.is_vertex(from) {
                return Some(format!("edge {edge} leaves a vertex that is gone"));
            }
        }
        for vertex in (0..self.vertices.len() as u32).filter(|&vertex| self.is_vertex(vertex)) {
            let edge = self.vertices[vertex as usize].edge;
            if !self.is_live(edge >> 2) || self.ends(edge).0 != vertex {
                return Some(format!("vertex {vertex} does not leave edge {edge}"));
            }
            let record = &self.vertices[vertex as usize];
            if record.hold.height_is_free() && self.ground.bounded(record.at, record.height) != record.height {
                return Some(format!("vertex {vertex} stands outside the ground: {record:?}"));
            }
        }
        let flat = |record: &&Triangle| {
            let [a, b, c] = self.places(record.corners);
            Place::orient(a, b, c) <= 0
        };
        self.triangles
            .iter()
            .filter(|record| record.corners[0] != NONE)
            .find(flat)
            .map(|record| format!("{record:?} is flat"))
    }

    /// The finished TIN: first the vertices that were there from the start, then the others, by row and column.
    ///
    /// # Panics
    /// When a vertex lies between points of the lattice with so many steps to a post.
    pub fn into_tin(self, rect: PostRect, steps_per_post: i32) -> Tin {
        let mut order: Vec<u32> = (0..self.vertices.len() as u32).filter(|&vertex| self.is_vertex(vertex)).collect();
        let is_movable = |vertex: u32| !self.vertices[vertex as usize].hold.is_fixed();
        order.sort_unstable_by_key(|&vertex| (is_movable(vertex), self.at(vertex)));
        let mut index = vec![NONE; self.vertices.len()];
        order.iter().enumerate().for_each(|(place, &vertex)| index[vertex as usize] = place as u32);
        let vertices = order.iter().map(|&vertex| {
            let vertex = &self.vertices[vertex as usize];
            let height = (vertex.height + self.ground.level()).round() as i32;
            TinVertex { at: vertex.at.lattice_point(rect, steps_per_post), height }
        });
        let live = self.triangles.iter().filter(|record| record.corners[0] != NONE);
        let triangles = live.map(|record| record.corners.map(|vertex| index[vertex as usize])).collect();
        Tin { rect, steps_per_post, vertices: vertices.collect(), triangles }
    }
}
