//! Boxes that stand for buildings, towers and walls where bodies may hit them.

use terrain::{ModuleRect, Prism, QUANTA_PER_METRE};

use crate::Product;

/// Share of its least rectangle that an outline fills at least to be one box; else each of its walls is one: the
/// corners of a box stand farther out the less of it is filled.
const FILLED_MIN: f64 = 0.95;
/// Thickness of the box of a wall, in metres, which lies inside of it.
const WALL_M: f64 = 0.2;

/// An upright box.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct UprightBox {
    /// Its middle in metres, east and north from the south-west corner of what is exported.
    pub middle_m: [f64; 3],
    /// Along its own axes.
    pub size_m: [f64; 3],
    /// From east to its first axis, in radians, counter-clockwise.
    pub turned: f64,
}

/// The boxes of the load modules of a rectangle.
pub(crate) fn boxes(product: &Product, rect: ModuleRect) -> Vec<UprightBox> {
    let modules = rect.iter().filter_map(|id| product.module(id));
    let prisms = modules.flat_map(|module| module.objects.prisms.iter().map(|prism| (module.id, prism)));
    prisms.flat_map(|(id, prism)| boxes_of(prism, product.corner(id))).collect()
}

fn boxes_of(prism: &Prism, corner: [i32; 2]) -> Vec<UprightBox> {
    let metres = |quanta: i32| f64::from(quanta) / f64::from(QUANTA_PER_METRE);
    let rings: Vec<Vec<[f64; 2]>> = prism
        .plan()
        .into_iter()
        .map(|ring| ring.into_iter().map(|[x, y]| [metres(corner[0] + x), metres(corner[1] + y)]).collect())
        .collect();
    let [low, high] = [prism.base, prism.roof].map(metres);
    let upright = |[x, y]: [f64; 2], [long, wide]: [f64; 2], turned: f64| UprightBox {
        middle_m: [x, y, f64::midpoint(low, high)],
        size_m: [long, wide, high - low],
        turned,
    };
    let area: f64 = rings.iter().map(|ring| area(ring)).sum();
    let Some((middle, size, turned)) = least_rectangle(&rings[0]) else { return Vec::new() };
    if FILLED_MIN * size[0] * size[1] <= area {
        return vec![upright(middle, size, turned)];
    }
    let walls = prism.rings.iter().zip(&rings).flat_map(|(corners, ring)| {
        let ends = ring.iter().zip(ring.iter().cycle().skip(1));
        corners.iter().zip(ends).filter(|(corner, _)| corner.has_wall).map(|(_, (a, b))| [*a, *b])
    });
    let wall = |[a, b]: [[f64; 2]; 2]| {
        let along = [b[0] - a[0], b[1] - a[1]];
        let long = along[0].hypot(along[1]);
        let inside = [-along[1] / long * WALL_M / 2.0, along[0] / long * WALL_M / 2.0];
        let middle = [0, 1].map(|axis| f64::midpoint(a[axis], b[axis]) + inside[axis]);
        upright(middle, [long, WALL_M], along[1].atan2(along[0]))
    };
    walls.map(wall).collect()
}

fn area(ring: &[[f64; 2]]) -> f64 {
    ring.iter().zip(ring.iter().cycle().skip(1)).map(|(a, b)| (a[0] * b[1] - a[1] * b[0]) / 2.0).sum()
}

/// Middle, size and direction of the least rectangle around a ring that lies along one of its edges.
pub(crate) fn least_rectangle(ring: &[[f64; 2]]) -> Option<([f64; 2], [f64; 2], f64)> {
    let along = |(a, b): (&[f64; 2], &[f64; 2])| {
        let turned = (b[1] - a[1]).atan2(b[0] - a[0]);
        let (sine, cosine) = turned.sin_cos();
        let ends = |axis: [f64; 2]| {
            let of = || ring.iter().map(|at| at[0] * axis[0] + at[1] * axis[1]);
            [of().fold(f64::INFINITY, f64::min), of().fold(f64::NEG_INFINITY, f64::max)]
        };
        let [u, v] = [ends([cosine, sine]), ends([-sine, cosine])];
        let [x, y] = [f64::midpoint(u[0], u[1]), f64::midpoint(v[0], v[1])];
        ([x * cosine - y * sine, x * sine + y * cosine], [u[1] - u[0], v[1] - v[0]], turned)
    };
    let all = ring.iter().zip(ring.iter().cycle().skip(1)).map(along);
    all.min_by(|(_, a, _), (_, b, _)| (a[0] * a[1]).total_cmp(&(b[0] * b[1])))
}

#[cfg(test)]
mod tests {
    use terrain::{Corner, ObjectKind};

    use super::*;

    fn prism(ring: &[[u16; 2]]) -> Prism {
        let ring = ring.iter().map(|&[x, y]| Corner { x, y, has_wall: true }).collect();
        Prism { id: 1, kind: ObjectKind::Building, base: 1280, roof: 2560, rings: vec![ring] }
    }

    #[test]
    fn a_house_is_one_box_along_its_walls_and_an_angle_has_one_for_each_wall() {
        // Of 10 m by 5 m, turned by a right angle's half.
        let house = boxes_of(&prism(&[[640, 0], [1545, 905], [1092, 1358], [187, 453]]), [0, 0]);
        let [size, turned] = [house[0].size_m, [house[0].turned, 0.0, 0.0]];
        assert!((size[0] - 10.0).abs() < 0.01 && (size[1] - 5.0).abs() < 0.01 && turned[0] > 0.7, "{house:?}");
        assert_eq!(house.len(), 1);
        let angle = boxes_of(&prism(&[[0, 0], [2560, 0], [2560, 256], [256, 256], [256, 2560], [0, 2560]]), [128, 0]);
        assert_eq!((angle.len(), angle[0].size_m), (6, [20.0, WALL_M, 10.0]));
        assert_eq!(angle[0].middle_m, [11.0, 0.1, 15.0]);
    }

    #[test]
    fn a_house_that_lacks_a_tenth_of_its_rectangle_has_a_box_for_each_wall() {
        let cut =
            |by: u16| boxes_of(&prism(&[[0, 0], [2560, 0], [2560, 1280 - by], [2560 - by, 1280], [0, 1280]]), [0, 0]);
        // The corner that is cut off is an eighth and a fiftieth of the rectangle.
        assert_eq!([cut(905), cut(362)].map(|boxes| boxes.len()), [5, 1]);
    }
}
