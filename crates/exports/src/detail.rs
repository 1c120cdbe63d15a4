//! Levels of detail inside files: the one list of a product's levels from fine to coarse, how far each lies from the
//! ground, and from how far away it will do.

use terrain::{ModuleRect, QUANTA_PER_METRE};

use crate::{Mesh, Product};

/// Metres of distance at which a metre of error will do: it is a milliradian there, about a pixel of a picture that is
/// 60 degrees and a thousand pixels wide.
const DISTANCE_PER_ERROR: f64 = 1000.0;
/// How wide that picture is at a distance of one.
const PICTURE_WIDE: f64 = 1.155;

/// One level of a product as a mesh.
pub(crate) struct Detail {
    pub product: Product,
    pub mesh: Mesh,
    pub normals: Vec<[f64; 3]>,
}

/// A level of a unit that a program shows as a whole.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Step {
    /// Level of detail, 0 being the finest.
    pub level: usize,
    /// How far it lies from the ground at most, in metres. What is coarser is never said to be truer.
    pub error_m: f64,
    /// From what distance of its middle on it will do, in metres; 0 for the finest.
    pub near_m: f64,
}

impl Detail {
    /// All levels of a product, from fine to coarse, with all that is above the ground; `finest` is the mesh of the
    /// first.
    pub(crate) fn all(product: &Product, finest: Mesh) -> Vec<Self> {
        let mut finest = Some(finest);
        let detail = |product: Product| {
            let mesh = finest.take().unwrap_or_else(|| Mesh::of(&product)).with_lanes(&product);
            let normals = mesh.normals();
            Self { product, mesh, normals }
        };
        product.levels().map(detail).collect()
    }
}

/// The levels of a rectangle of load modules.
pub(crate) fn steps<'a>(levels: impl IntoIterator<Item = &'a Product>, rect: ModuleRect) -> Vec<Step> {
    let mut error_m: f64 = 0.0;
    let step = |(index, product): (usize, &Product)| {
        error_m = error_m.max(largest_residual_m(product, rect));
        // Of no place of the unit is the eye nearer than that.
        let radius_m = product.side_m() * f64::from(rect.rows()).hypot(f64::from(rect.cols())) / 2.0;
        let near_m = if index == 0 { 0.0 } else { radius_m + DISTANCE_PER_ERROR * error_m };
        Step { level: product.level, error_m, near_m }
    };
    levels.into_iter().enumerate().map(step).collect()
}

/// The largest residual of the load modules of a rectangle, in metres.
pub(crate) fn largest_residual_m(product: &Product, rect: ModuleRect) -> f64 {
    let residuals = rect.iter().filter_map(|id| product.module(id)).map(|module| module.residual.largest);
    f64::from(residuals.max().unwrap_or(0)) / f64::from(QUANTA_PER_METRE)
}

/// The share of a picture that a square of `side_m` fills at most, seen from `away_m`.
pub(crate) fn coverage(side_m: f64, away_m: f64) -> f64 {
    (side_m / (PICTURE_WIDE * away_m)).powi(2).min(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::samples;

    #[test]
    fn what_is_coarser_is_seen_from_farther_away_and_never_said_to_be_truer() {
        let product = samples::with_levels();
        let levels: Vec<Product> = product.levels().collect();
        let found = steps(&levels, product.rect);
        let radius_m = 500.0_f64.hypot(1000.0) / 2.0;
        let error_m = 1200.0 / 128.0;
        let expected = [(0, 300.0 / 128.0, 0.0), (1, error_m, radius_m + 1000.0 * error_m)];
        assert_eq!(found.iter().map(|step| (step.level, step.error_m, step.near_m)).collect::<Vec<_>>(), expected);
        let mut upside_down = levels;
        upside_down.reverse();
        let found = steps(&upside_down, product.rect);
        assert_eq!((found[0].error_m, found[1].error_m), (error_m, error_m));
    }
}
