//! Game engines and the sizes of heightmaps that they take; and what stands on the ground as placements: a class, a
//! place, a heading and a size in the axes of an engine.

use std::fmt::Write;

use serde_json::{Value, json};
use terrain::plans::union;
use terrain::{QUANTA_PER_METRE, metres_of_quanta};

use crate::Product;
use crate::boxes::least_rectangle;
use crate::gpkg_objects::wholes;
use crate::triangle_index::TriangleIndex;

/// Whose import the tiles are for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Engine {
    /// PNG, the northern row first; tiles count from the north-west.
    Unreal,
    /// RAW, little-endian, the southern row first; tiles count from the south-west.
    Unity,
}

impl Engine {
    /// The sides of a tile that the engine takes, in samples.
    pub(crate) fn sizes(self) -> &'static [usize] {
        match self {
            Engine::Unreal => &[127, 253, 505, 1009, 2017, 4033, 8129],
            Engine::Unity => &[33, 65, 129, 257, 513, 1025, 2049, 4097],
        }
    }

    /// The least size with which one tile holds so many samples a side; else the one that is handled well.
    pub(crate) fn size_for(self, samples: usize) -> usize {
        let many = match self {
            Engine::Unreal => 2017,
            Engine::Unity => 2049,
        };
        self.sizes().iter().copied().find(|&size| samples <= size).unwrap_or(many)
    }
}

/// The name of the file.
pub(crate) const FILE: &str = "objects.csv";

/// What the columns of the file mean.
pub(crate) fn told(engine: Engine) -> Value {
    let (axes, heading) = match engine {
        Engine::Unreal => (
            "x east, y south, z up, in centimetres from the middle of the landscape",
            "yaw in degrees of a box whose length lies along x",
        ),
        Engine::Unity => (
            "x east, y up, z north, in metres from the south-western corner of the terrain",
            "rotation about y in degrees of a box whose length lies along z",
        ),
    };
    json!({
        "file": FILE,
        "axes": axes,
        "place": "the middle of the least rectangle around an object, at its base or on the ground",
        "heading": heading,
        "size": "length and width of that rectangle, and height, in the unit of the axes",
    })
}

/// A line for each object; `None` where there are none.
pub(crate) fn placements(product: &Product, engine: Engine) -> Option<String> {
    let wholes = wholes(product);
    if wholes.is_empty() {
        return None;
    }
    let corner_m = product.corner_m(product.rect.south, product.rect.west);
    let mut index = TriangleIndex::new(product);
    let mut text = "class,id,x,y,z,heading,length,width,height\n".to_owned();
    for ((kind, id), whole) in &wholes {
        let metres = |[x, y]: [i32; 2]| [x, y].map(|quanta| f64::from(quanta) / f64::from(QUANTA_PER_METRE));
        let outlines =
            union(std::slice::from_ref(&whole.rings)).into_iter().filter_map(|shape| shape.into_iter().next());
        let ring: Vec<[f64; 2]> = outlines.flatten().map(metres).collect();
        let Some((middle, size, turned)) = least_rectangle(&ring) else { continue };
        let ground_m = || {
            let ground = index.at([corner_m[0] + middle[0], corner_m[1] + middle[1]]);
            ground.map_or(0.0, |ground| ground.height_m)
        };
        let base_m = whole.base.map_or_else(ground_m, metres_of_quanta);
        let height = whole.height.or_else(|| Some(whole.roof? - whole.base?)).map_or(0.0, metres_of_quanta);
        // The length is the longer side.
        let is_across = size[0] < size[1];
        let east_degrees = turned.to_degrees() + if is_across { 90.0 } else { 0.0 };
        let [length, width] = if is_across { [size[1], size[0]] } else { size };
        let (place, heading, unit) = match engine {
            Engine::Unreal => {
                let half =
                    [product.rect.cols(), product.rect.rows()].map(|count| f64::from(count) * product.side_m() / 2.0);
                ([middle[0] - half[0], half[1] - middle[1], base_m], -east_degrees, 100.0)
            }
            Engine::Unity => ([middle[0], base_m, middle[1]], 90.0 - east_degrees, 1.0),
        };
        let [x, y, z] = place.map(|metres| metres * unit);
        let [length, width, height] = [length, width, height].map(|metres| metres * unit);
        // A rectangle is the same after half a turn.
        let heading = heading.rem_euclid(180.0);
        let _ =
            writeln!(text, "{},{id},{x:.3},{y:.3},{z:.3},{heading:.3},{length:.3},{width:.3},{height:.3}", kind.name());
    }
    Some(text)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::samples;

    #[test]
    fn an_object_is_placed_once_in_the_axes_of_its_engine() {
        assert_eq!(placements(&samples::product(), Engine::Unreal), None);
        let unreal = placements(&samples::with_objects(), Engine::Unreal).unwrap();
        let unity = placements(&samples::with_objects(), Engine::Unity).unwrap();
        let row = |text: &str, class: &str| -> Vec<f64> {
            let line = text.lines().find(|line| line.starts_with(class)).unwrap();
            line.split(',').skip(2).map(|number| number.parse().unwrap()).collect()
        };
        assert_eq!((unreal.lines().count(), unity.lines().count()), (4, 4));
        // Both pieces of a house of 54.688 m by 46.875 m, over the line at 500 m.
        let [base_m, height_m] = [128_100.0 / 128.0, 1400.0 / 128.0];
        let near = |found: &[f64], expected: &[f64]| {
            assert_eq!(found.len(), expected.len());
            let is_near = found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 0.001);
            assert!(is_near, "{found:?} {expected:?}");
        };
        let middle = [(468.75 + 523.4375) / 2.0, (156.25 + 203.125) / 2.0];
        let (length, width) = (54.6875, 46.875);
        near(&row(&unity, "building"), &[middle[0], base_m, middle[1], 90.0, length, width, height_m]);
        let cm = [100.0 * (middle[0] - 500.0), 100.0 * (250.0 - middle[1]), 100.0 * base_m];
        let size = [100.0 * length, 100.0 * width, 100.0 * height_m];
        near(&row(&unreal, "building"), &[&cm[..], &[0.0], &size[..]].concat());
    }
}
