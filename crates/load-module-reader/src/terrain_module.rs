//! One load module ready to be asked.

use crate::Module;
use crate::lookup::Lookup;

/// The class of triangles over a hole: no source has a height there, and their heights only close the surface.
pub const HOLE_CLASS: u8 = 255;

/// The ground at one place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// Height above the vertical datum.
    pub height_m: f64,
    /// Unit vector out of the ground: east, north, up.
    pub normal: [f64; 3],
    /// Class of the ground; [`HOLE_CLASS`] where no source has a height.
    pub class: u8,
}

impl Sample {
    /// Whether the place lies over a hole, where no source has a height.
    pub fn is_hole(&self) -> bool {
        self.class == HOLE_CLASS
    }
}

/// A load module with what finds its triangles by place.
#[derive(Clone, Debug, PartialEq)]
pub struct TerrainModule {
    module: Module,
    lookup: Lookup,
}

impl TerrainModule {
    /// Prepares a load module whose side is `side` quanta.
    pub fn new(module: Module, side: u16) -> Self {
        let lookup = Lookup::new(&module, side);
        Self { module, lookup }
    }

    /// The load module itself: vertices, triangles, sides, residuals.
    pub fn module(&self) -> &Module {
        &self.module
    }

    pub(crate) fn lookup(&self) -> &Lookup {
        &self.lookup
    }

    /// Height, normal and class at a place in steps.
    pub(crate) fn sample(&self, place: [i64; 2]) -> Option<Sample> {
        let (corners, height_m, index) = self.lookup.triangle(place)?;
        let [a, b, c] = corners.map(|corner| corner.map(f64::from));
        let (u, v) = ([b[0] - a[0], b[1] - a[1], b[2] - a[2]], [c[0] - a[0], c[1] - a[1], c[2] - a[2]]);
        let normal = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
        let length = (normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2]).sqrt();
        let class = self.module.classes.get(index).copied()?;
        Some(Sample { height_m, normal: normal.map(|part| part / length), class })
    }
}
