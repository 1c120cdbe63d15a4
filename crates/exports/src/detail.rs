//! Levels of detail inside files: the one list of a product's levels from fine to coarse, how far each lies from the
//! ground, and from how far away it will do.

use std::collections::BTreeSet;

use terrain::{HOLE_CLASS, LoadModule, ModuleRect, QUANTA_PER_METRE};

use crate::triangle_index::{cells_of, corners_of, height_in};
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
    /// How far it lies at most from the heights it was built from, at their posts, or, of what is coarser, from the
    /// finest level, in metres. What is coarser is never said to be truer.
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
    let mut finest: Option<&Product> = None;
    let step = |(index, product): (usize, &'a Product)| {
        // Between posts a road or a bank may lie where no residual tells of it.
        let from_finest_m = finest.map_or(0.0, |finest| largest_distance_m(finest, product, rect));
        finest = finest.or(Some(product));
        error_m = error_m.max(largest_residual_m(product, rect)).max(from_finest_m);
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

/// The largest distance, straight up or down, between the ground of two products of the same load modules in a
/// rectangle, in metres; over holes there is no ground. Both are flat between edges, so it is found at a vertex of
/// either, or where edges cross.
fn largest_distance_m(one: &Product, other: &Product, rect: ModuleRect) -> f64 {
    let mut largest = 0.0;
    for id in rect.iter() {
        let Some((one, other)) = one.module(id).zip(other.module(id)) else { continue };
        let cells = cells_of(other);
        for corners in ground_of(one) {
            let mut met = BTreeSet::new();
            cells.any_under(corners.map(|[x, y, _]| [x, y]), |number| {
                met.insert(number);
                false
            });
            for number in met {
                if other.classes[number as usize] != HOLE_CLASS {
                    largest = f64::max(largest, distance(corners, corners_of(other, other.triangles[number as usize])));
                }
            }
        }
    }
    largest / f64::from(QUANTA_PER_METRE)
}

/// The triangles of a load module that have ground.
fn ground_of(module: &LoadModule) -> impl Iterator<Item = [[f64; 3]; 3]> {
    let all = module.triangles.iter().zip(&module.classes);
    all.filter(|(_, class)| **class != HOLE_CLASS).map(|(triangle, _)| corners_of(module, *triangle))
}

/// The largest distance between two triangles over what they have in common, in quanta.
fn distance(one: [[f64; 3]; 3], other: [[f64; 3]; 3]) -> f64 {
    let at_corners = |of: [[f64; 3]; 3], from: [[f64; 3]; 3]| {
        let off = from.map(|[x, y, z]| height_in(of, [x, y]).map_or(0.0, |height| (height - z).abs()));
        off.into_iter().fold(0.0, f64::max)
    };
    let edges = |of: [[f64; 3]; 3]| [[of[0], of[1]], [of[1], of[2]], [of[2], of[0]]];
    let crossings = edges(one).into_iter().flat_map(|[a, b]| {
        edges(other).into_iter().filter_map(move |[c, d]| {
            let turn = (b[0] - a[0]) * (d[1] - c[1]) - (b[1] - a[1]) * (d[0] - c[0]);
            let along = ((c[0] - a[0]) * (d[1] - c[1]) - (c[1] - a[1]) * (d[0] - c[0])) / turn;
            let share = ((c[0] - a[0]) * (b[1] - a[1]) - (c[1] - a[1]) * (b[0] - a[0])) / turn;
            let is_met = (0.0..=1.0).contains(&along) && (0.0..=1.0).contains(&share);
            is_met.then(|| (a[2] + along * (b[2] - a[2]) - c[2] - share * (d[2] - c[2])).abs())
        })
    });
    crossings.fold(at_corners(one, other).max(at_corners(other, one)), f64::max)
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
        // The pit that the coarser level lacks counts even where no post fell into it.
        let mut levels = levels;
        levels[1].modules.iter_mut().for_each(|module| module.residual.largest = 0);
        let pit_m = (128_256.0 - 256.0 * 0.5 - 128.0 * 0.4 - 127_000.0) / 128.0;
        assert!((steps(&levels, product.rect)[1].error_m - pit_m).abs() < 1e-9);
        levels[1].modules[1].residual.largest = 1200;
        let mut upside_down = levels;
        upside_down.reverse();
        let found = steps(&upside_down, product.rect);
        assert_eq!((found[0].error_m, found[1].error_m), (error_m, error_m));
    }
}
