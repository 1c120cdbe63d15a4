//! One load module ready to be asked.

use crate::lookup::{Corners, Lookup, Mesh, ObjectLookups};
use crate::{HOLE_CLASS, Module};

/// The ground, or a deck, at one place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// Height above the vertical datum.
    pub height_m: f64,
    /// Unit vector out of the ground: east, north, up.
    pub normal: [f64; 3],
    /// Class of the ground or the deck; [`HOLE_CLASS`] where no source has a height.
    pub class: u8,
    /// Whether it is a deck.
    pub is_deck: bool,
}

impl Sample {
    /// Whether the place lies over a hole, where no source has a height.
    pub fn is_hole(&self) -> bool {
        self.class == HOLE_CLASS
    }

    fn of(corners: &Corners, height_m: f64, class: u8, is_deck: bool) -> Self {
        let [a, b, c] = corners.map(|corner| corner.map(f64::from));
        let (u, v) = ([b[0] - a[0], b[1] - a[1], b[2] - a[2]], [c[0] - a[0], c[1] - a[1], c[2] - a[2]]);
        let normal = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
        let length = (normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2]).sqrt();
        Self { height_m, normal: normal.map(|part| part / length), class, is_deck }
    }
}

/// A load module with what finds its triangles by place.
#[derive(Clone, Debug, PartialEq)]
pub struct TerrainModule {
    module: Module,
    lookup: Lookup,
    /// Of the decks, where there are any.
    decks: Option<Lookup>,
    objects: ObjectLookups,
}

impl TerrainModule {
    /// Prepares a load module whose side is `side` quanta.
    pub fn new(module: Module, side: u16) -> Self {
        let lookup = Lookup::new(Mesh { vertices: &module.vertices, triangles: &module.triangles }, side);
        let decks = Mesh { vertices: &module.decks.vertices, triangles: &module.decks.triangles };
        let decks = (!module.decks.is_empty()).then(|| Lookup::new(decks, side));
        let objects = ObjectLookups::of(&module.objects, side);
        Self { module, lookup, decks, objects }
    }

    /// The load module itself: vertices, triangles, sides, residuals, decks.
    pub fn module(&self) -> &Module {
        &self.module
    }

    pub(crate) fn lookup(&self) -> &Lookup {
        &self.lookup
    }

    /// What finds the decks, where there are any.
    pub(crate) fn decks(&self) -> Option<&Lookup> {
        self.decks.as_ref()
    }

    /// What finds the objects.
    pub(crate) fn objects(&self) -> &ObjectLookups {
        &self.objects
    }

    /// Height, normal and class of the ground at a place in steps.
    pub(crate) fn sample(&self, place: [i64; 2]) -> Option<Sample> {
        let (corners, height_m, index) = self.lookup.triangle(place)?;
        let class = self.module.classes.get(index).copied()?;
        Some(Sample::of(&corners, height_m, class, false))
    }

    /// The same of the topmost of ground and decks that is not above a ceiling. A deck that touches the ground lies on
    /// it.
    pub(crate) fn sample_below(&self, place: [i64; 2], ceiling_m: f64) -> Option<Sample> {
        let ground = self.sample(place).filter(|ground| ground.height_m <= ceiling_m);
        let all = self.decks.iter().flat_map(|decks| decks.triangles(place));
        let below = all.filter(|(_, height_m, _)| *height_m <= ceiling_m);
        let Some((corners, height_m, index)) = below.max_by(|a, b| a.1.total_cmp(&b.1)) else { return ground };
        if ground.is_some_and(|ground| height_m < ground.height_m) {
            return ground;
        }
        let class = self.module.decks.classes.get(index).copied()?;
        Some(Sample::of(&corners, height_m, class, true))
    }
}
