//! Putting a vertex in: where the residual under a triangle is largest, with the flips around it that gain.

use crate::optimiser::form::{Form, squares};
use crate::optimiser::hold::Hold;
use crate::optimiser::moments::Sums;
use crate::optimiser::parts::NONE;
use crate::optimiser::patch::Patch;
use crate::optimiser::place::Place;
use crate::optimiser::refit::Fit;
use crate::optimiser::tile_mesh::{TileMesh, next, previous};

/// Triangles one insertion may rewrite.
const REACH_MAX: usize = 14;
/// Part of two triangles' squares that a flip around a new vertex has to gain.
const LEAST_FLIP_GAIN: f64 = 1e-3;

/// What finding an insertion needs and leaves behind.
#[derive(Default)]
pub(crate) struct Insertion {
    pub patch: Patch,
    pub fit: Fit,
    /// Whether the middles of edges are tried beside the worst post: they stand on no lattice yet.
    pub tries_middles: bool,
    /// The new vertex's star, counter-clockwise but for the order of its parts.
    faces: Vec<Face>,
}

/// A triangle of the new vertex, by its opposite edge.
#[derive(Clone, Copy)]
struct Face {
    from: u32,
    to: u32,
    /// The opposite edge from outside.
    twin: u32,
    /// Sums west of the edges to `from`, along the opposite edge, and to `to`.
    sums: [Sums; 3],
    squares: f64,
}

/// Where a vertex may come: the edge it splits, if any, and what holds it there.
#[derive(Clone, Copy)]
struct Site {
    on_edge: Option<u32>,
    at: Place,
    hold: Hold,
}

/// A vertex to be.
#[derive(Clone, Copy)]
struct Inserted {
    at: Place,
    height: f64,
    vertex: u32,
}

/// How an insertion was found.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Found {
    /// Squares gained.
    pub gain: f64,
    /// The new vertex: it belongs to the sheet's arrays, but to no triangle before the patch is applied.
    pub vertex: u32,
}

impl Insertion {
    /// The gain of a new vertex in `triangle`; its patch is then ready to be applied, and the vertex has to be dropped
    /// if it is not. `None` where nothing can be inserted.
    #[inline(always)]
    pub fn find(&mut self, sheet: &mut TileMesh, triangle: u32) -> Option<Found> {
        let worst = self.worst_site(sheet, triangle);
        if !self.tries_middles {
            return self.try_site(sheet, triangle, worst?);
        }
        let middles: [Option<Site>; 3] = [0, 1, 2].map(|k| middle_site(sheet, triangle, k));
        let mut best: Option<(f64, Site)> = None;
        for site in worst.into_iter().chain(middles.into_iter().flatten()) {
            let Some(Found { gain, vertex }) = self.try_site(sheet, triangle, site) else { continue };
            sheet.drop_vertex(vertex);
            if best.is_none_or(|(most, _)| most < gain) {
                best = Some((gain, site));
            }
        }
        let (_, site) = best?;
        self.try_site(sheet, triangle, site)
    }

    /// Where the residual is largest.
    #[inline(always)]
    fn worst_site(&self, sheet: &TileMesh, triangle: u32) -> Option<Site> {
        let corners = sheet.triangles[triangle as usize].corners;
        let places = sheet.places(corners);
        let (_, at) = sheet.worst(corners)?;
        let (on_edge, hold) = self.classify(sheet, triangle, places, at)?;
        Some(Site { on_edge, at, hold: hold.and(sheet.ground.height_hold()) })
    }

    #[inline(always)]
    fn try_site(&mut self, sheet: &mut TileMesh, triangle: u32, site: Site) -> Option<Found> {
        let vertex = sheet.add_vertex(site.at, sheet.ground.height(site.at), site.hold);
        let found = self.split(sheet, triangle, site.on_edge, vertex);
        if found.is_none() {
            sheet.drop_vertex(vertex);
        }
        found.map(|gain| Found { gain, vertex })
    }

    /// The edge a place lies on, if any, and what holds a vertex there.
    fn classify(&self, sheet: &TileMesh, triangle: u32, places: [Place; 3], at: Place) -> Option<(Option<u32>, Hold)> {
        let mut on_edge = None;
        for k in 0..3 {
            let side = Place::orient(places[k], places[(k + 1) % 3], at);
            if side < 0 || (side == 0 && on_edge.is_some()) {
                return None;
            }
            if side == 0 {
                on_edge = Some(4 * triangle + k as u32);
            }
        }
        Some((on_edge, sheet.line_hold(at)))
    }

    /// Splits the triangle, flips around the new vertex, fits heights. Gives the gain.
    fn split(&mut self, sheet: &TileMesh, triangle: u32, on_edge: Option<u32>, vertex: u32) -> Option<f64> {
        let record = &sheet.vertices[vertex as usize];
        let inserted = Inserted { at: record.at, height: record.height, vertex };
        self.patch.clear();
        self.faces.clear();
        self.patch.old.push(triangle);
        for k in 0..3 {
            let edge = 4 * triangle + k;
            if on_edge != Some(edge) {
                self.push_face(sheet, inserted, edge);
                continue;
            }
            let twin = sheet.twin(edge);
            if twin != NONE {
                self.patch.old.push(twin >> 2);
                self.push_face(sheet, inserted, next(twin));
                self.push_face(sheet, inserted, previous(twin));
            }
        }
        self.flip_around(sheet, inserted);
        let valid = |face: &Face| sheet.is_sound_at((inserted.at, inserted.height), [face.from, face.to]);
        if !self.faces.iter().all(valid) {
            return None;
        }
        let old: f64 = self.patch.old.iter().map(|&old| sheet.triangles[old as usize].squares).sum();
        let new: f64 = self.faces.iter().map(|face| face.squares).sum();
        self.fill_patch(sheet, inserted);
        Some(old - new + self.fit.refit(sheet, &mut self.patch))
    }

    /// The triangle between the new vertex and an edge seen from inside.
    #[inline(always)]
    fn push_face(&mut self, sheet: &TileMesh, inserted: Inserted, edge: u32) {
        let (from, to) = sheet.ends(edge);
        let (a, b) = (sheet.at(from), sheet.at(to));
        let moments = &sheet.ground.moments;
        let sums = [moments.edge(inserted.at, a), sheet.sums_of(edge), moments.edge(inserted.at, b)];
        self.faces.push(Face::new(sheet, inserted, (from, to), sheet.twin(edge), sums));
    }

    /// Takes neighbours in while the flip of the edge to them gains.
    fn flip_around(&mut self, sheet: &TileMesh, inserted: Inserted) {
        const TRIES_MAX: usize = 60;
        let mut index = 0;
        for _ in 0..TRIES_MAX {
            let Some(&face) = self.faces.get(index) else { return };
            match self.flipped(sheet, inserted, &face) {
                Some([first, second]) => {
                    self.patch.old.push(face.twin >> 2);
                    self.faces[index] = first;
                    self.faces.push(second);
                }
                None => index += 1,
            }
        }
    }

    #[inline(always)]
    fn flipped(&self, sheet: &TileMesh, inserted: Inserted, face: &Face) -> Option<[Face; 2]> {
        let beyond = face.twin >> 2;
        if face.twin == NONE
            || REACH_MAX <= self.patch.old.len()
            || sheet.is_constrained(face.from, face.to)
            || self.patch.old.contains(&beyond)
        {
            return None;
        }
        let apex = sheet.apex(face.twin);
        let d = sheet.at(apex);
        if !sheet.is_sound_at((inserted.at, inserted.height), [face.from, apex])
            || !sheet.is_sound_at((inserted.at, inserted.height), [apex, face.to])
        {
            return None;
        }
        let old = face.squares + sheet.triangles[beyond as usize].squares;
        let spoke = sheet.ground.moments.edge(inserted.at, d);
        let (first_rim, second_rim) = (next(face.twin), previous(face.twin));
        let sums = [face.sums[0], sheet.sums_of(first_rim), spoke];
        let first = Face::new(sheet, inserted, (face.from, apex), sheet.twin(first_rim), sums);
        if old <= first.squares {
            return None;
        }
        let sums = [spoke, sheet.sums_of(second_rim), face.sums[2]];
        let second = Face::new(sheet, inserted, (apex, face.to), sheet.twin(second_rim), sums);
        (first.squares + second.squares < old * (1.0 - LEAST_FLIP_GAIN)).then_some([first, second])
    }

    fn fill_patch(&mut self, sheet: &TileMesh, inserted: Inserted) {
        for face in &self.faces {
            let corners = [inserted.vertex, face.from, face.to];
            self.patch.new.push((corners, Form::new(&face.all(), sheet.places(corners))));
        }
        for vertex in std::iter::once(inserted.vertex).chain(self.faces.iter().flat_map(|face| [face.from, face.to])) {
            if sheet.vertices[vertex as usize].hold.height_is_free() && !self.patch.refit.contains(&vertex) {
                self.patch.refit.push(vertex);
            }
        }
    }
}

/// The middle of an edge that is free to be split, where nothing holds a vertex.
fn middle_site(sheet: &TileMesh, triangle: u32, k: usize) -> Option<Site> {
    let edge = 4 * triangle + k as u32;
    let (from, to) = sheet.ends(edge);
    if sheet.twin(edge) == NONE || sheet.is_constrained(from, to) {
        return None;
    }
    let (a, b) = (sheet.at(from), sheet.at(to));
    let at = Place::new((a.x + b.x) / 2, (a.y + b.y) / 2);
    let hold = sheet.line_hold(at).and(sheet.ground.height_hold());
    (hold == Hold::FREE && !sheet.ground.is_forbidden(at)).then_some(Site { on_edge: Some(edge), at, hold })
}

impl Face {
    #[inline(always)]
    fn new(sheet: &TileMesh, inserted: Inserted, (from, to): (u32, u32), twin: u32, sums: [Sums; 3]) -> Self {
        let mut face = Self { from, to, twin, sums, squares: 0.0 };
        let (a, b) = (&sheet.vertices[from as usize], &sheet.vertices[to as usize]);
        let corners = [inserted.at, a.at, b.at];
        // A first triangle may be too thin to have a plane; a flip may still mend it, and if not, it is refused.
        if Place::orient(corners[0], corners[1], corners[2]) != 0 {
            face.squares = squares(&face.all(), corners, [inserted.height, a.height, b.height]);
        }
        face
    }

    #[inline(always)]
    fn all(&self) -> Sums {
        self.sums[0] + self.sums[1] - self.sums[2]
    }
}
