//! Which objects of a load module may lie along a line.

use crate::lookup::{Lookup, Mesh};
use crate::{Canopy, Objects, Vertex};

/// What finds the objects of a load module.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct ObjectLookups {
    /// Of the rectangles around prisms, which are numbered by the third coordinate.
    pub prisms: Option<Lookup>,
    /// Of the triangles of canopies, numbered likewise.
    pub canopies: Vec<Lookup>,
}

/// Places of canopies that one lookup finds, unless one canopy has more.
const PLACES_AT_ONCE: usize = 16_384;

impl ObjectLookups {
    pub(crate) fn of(objects: &Objects, side: u16) -> Self {
        let mut vertices = Vec::new();
        for (number, prism) in (0..).zip(&objects.prisms) {
            let corners = || prism.rings[0].iter();
            let [west, east] =
                [corners().map(|c| c.x).min(), corners().map(|c| c.x).max()].map(Option::unwrap_or_default);
            let [south, north] =
                [corners().map(|c| c.y).min(), corners().map(|c| c.y).max()].map(Option::unwrap_or_default);
            let places = [[west, south], [east, south], [east, north], [west, north]];
            vertices.extend(places.map(|[x, y]| Vertex { x, y, z: number }));
        }
        let first = (0..objects.prisms.len()).map(|number| 4 * number as u16);
        let triangles: Vec<[u16; 3]> = first.flat_map(|at| [[at, at + 1, at + 2], [at, at + 2, at + 3]]).collect();
        let mesh = Mesh { vertices: &vertices, triangles: &triangles };
        let prisms = (!triangles.is_empty()).then(|| Lookup::new(mesh, side));
        Self { prisms, canopies: canopy_lookups(&objects.canopies, side) }
    }
}

fn canopy_lookups(canopies: &[Canopy], side: u16) -> Vec<Lookup> {
    let mut lookups = Vec::new();
    let (mut vertices, mut triangles) = (Vec::new(), Vec::new());
    for (number, canopy) in (0..).zip(canopies) {
        if !vertices.is_empty() && PLACES_AT_ONCE < vertices.len() + canopy.places.len() {
            lookups.push(Lookup::new(Mesh { vertices: &vertices, triangles: &triangles }, side));
            (vertices, triangles) = (Vec::new(), Vec::new());
        }
        let first = vertices.len() as u16;
        vertices.extend(canopy.places.iter().map(|&[x, y]| Vertex { x, y, z: number }));
        triangles.extend(canopy.triangles.iter().map(|triangle| triangle.map(|index| first + index)));
    }
    if !triangles.is_empty() {
        lookups.push(Lookup::new(Mesh { vertices: &vertices, triangles: &triangles }, side));
    }
    lookups
}
