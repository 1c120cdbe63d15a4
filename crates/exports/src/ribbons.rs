//! Ribbons: bands for roads, rails and streams that are lines in the ground, which classify none of its triangles.
//! They lie a little above it, as wide as their ways.

use terrain::{Bands, ModuleId};

use crate::Product;
use crate::objects::Facet;

/// How far a ribbon lies above the ground, in quanta: 5 cm, to the next whole one.
pub(crate) const RIBBON_UP: i32 = 6;

/// The bands of a product.
pub(crate) struct Ribbons(Bands);

impl Ribbons {
    /// Those of all load modules of a product; `None` where no way is a line in the ground.
    pub(crate) fn of(product: &Product) -> Option<Self> {
        let by_module = product.lines.iter().zip(&product.modules);
        let lines = by_module.flat_map(|(lines, module)| lines.iter().map(|line| (module.id, line)));
        let bands = Bands::of(lines, product.rect, product.side());
        (!bands.is_empty()).then_some(Self(bands))
    }

    /// The ribbons over a load module: a facet for each class, which is its material.
    pub(crate) fn in_module(&self, product: &Product, id: ModuleId) -> Vec<Facet> {
        let Some(module) = product.module(id) else { return Vec::new() };
        let lifted = |[x, y, z]: [f64; 3]| [x.round() as i32, y.round() as i32, z.round() as i32 + RIBBON_UP];
        let facet = |(material, pieces): (u8, Vec<Vec<[f64; 3]>>)| Facet {
            material,
            polygons: pieces.into_iter().map(|piece| piece.into_iter().map(lifted).collect()).collect(),
        };
        self.0.over(module).into_iter().map(facet).collect()
    }
}
