//! Skirts: walls that hang from the sides of a square of 3D Tiles. A neighbour, of this database or of one beside it,
//! may be shown at another level, whose ground is lower or higher along their common side; walls close what would be a
//! gap.

use std::collections::HashMap;

use terrain::{ModuleId, ModuleRect, QUANTA_PER_METRE};

use crate::{Mesh, Product};

/// A side of a square: places of the mesh that have the same easting, or northing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Side {
    pub axis: usize,
    pub at: i32,
}

impl Side {
    /// The sides of a rectangle.
    pub(crate) fn of(product: &Product, rect: ModuleRect) -> [Self; 4] {
        let [west, south] = product.corner(ModuleId { row: rect.south, col: rect.west });
        let [east, north] = product.corner(ModuleId { row: rect.north, col: rect.east });
        [(0, west), (0, east), (1, south), (1, north)].map(|(axis, at)| Self { axis, at })
    }

    pub(crate) fn holds(self, place: [i32; 3]) -> bool {
        place[self.axis] == self.at
    }
}

/// How far a skirt hangs from each side, in metres.
pub(crate) type Depths = Vec<(Side, f64)>;

/// How far skirts have to hang from each side of a square, for each mesh that is shown there; `meshes` has the places
/// of the vertices of each. A skirt ends no higher than the lowest of them at any place of a side.
pub(crate) fn depths(sides: &[Side], meshes: &[Vec<[i32; 3]>]) -> Vec<Depths> {
    let mut depths = vec![Depths::new(); meshes.len()];
    for &side in sides {
        let lines: Vec<Line> = meshes.iter().map(|places| Line::of(side, places)).collect();
        for (line, depths) in lines.iter().zip(&mut depths) {
            let others = lines.iter().filter(|other| *other != line);
            let deepest_m = others.map(|other| line.above_m(other)).fold(0.0, f64::max);
            if 0.0 < deepest_m {
                depths.push((side, deepest_m));
            }
        }
    }
    depths
}

/// A mesh along a side: places on that, in order, and their heights, in quanta.
#[derive(Debug, PartialEq)]
pub(crate) struct Line(Vec<[i32; 2]>);

impl Line {
    pub(crate) fn of(side: Side, places: &[[i32; 3]]) -> Self {
        let on_side = places.iter().filter(|place| side.holds(**place));
        let mut line: Vec<[i32; 2]> = on_side.map(|place| [place[1 - side.axis], place[2]]).collect();
        line.sort_unstable();
        line.dedup();
        Self(line)
    }

    /// Where it begins and ends; both at 0 where it has no place.
    pub(crate) fn ends(&self) -> [i32; 2] {
        [self.0.first(), self.0.last()].map(|end| end.map_or(0, |[along, _]| *along))
    }

    /// The height at a place between its ends.
    pub(crate) fn height(&self, at: i32) -> Option<f64> {
        let next = self.0.partition_point(|[along, _]| *along < at);
        let [b, height] = *self.0.get(next)?;
        if b == at {
            return Some(height.into());
        }
        let [a, before] = self.0[next.checked_sub(1)?];
        let share = f64::from(at - a) / f64::from(b - a);
        Some(f64::from(before) + share * (f64::from(height) - f64::from(before)))
    }

    /// How far it lies above another one where it does most, in metres: both are straight between their places, but for
    /// the bulge of the Earth, which counts as if it were all between two places.
    fn above_m(&self, other: &Self) -> f64 {
        const EARTH_RADIUS_M: f64 = 6_371_000.0;
        let places = || self.0.iter().chain(&other.0).map(|[along, _]| *along);
        let above = places().filter_map(|at| Some(self.height(at)? - other.height(at)?)).fold(0.0, f64::max);
        let steps = [self, other].into_iter().flat_map(|line| line.0.windows(2)).map(|pair| pair[1][0] - pair[0][0]);
        let longest_m = f64::from(steps.max().unwrap_or(0)) / f64::from(QUANTA_PER_METRE);
        above / f64::from(QUANTA_PER_METRE) + longest_m * longest_m / (8.0 * EARTH_RADIUS_M)
    }
}

/// The walls that hang from a mesh.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Skirt {
    /// For each lower corner the vertex above it, by its place among the vertices of the mesh, and how many metres it
    /// lies below that.
    pub hung: Vec<(u32, f64)>,
    /// Corners by place among the vertices of the mesh, behind which `hung` goes on; they face away from the ground.
    pub triangles: Vec<[u32; 3]>,
    /// Classes of the triangles that they hang from.
    pub classes: Vec<u8>,
}

impl Skirt {
    /// The walls that hang from triangles over vertices of a mesh.
    pub(crate) fn of(mesh: &Mesh, vertices: &[u32], triangles: &[[u32; 3]], classes: &[u8], depths: &Depths) -> Self {
        let (mut skirt, mut place_of) = (Self::default(), HashMap::new());
        if depths.is_empty() {
            return skirt;
        }
        let place = |v: u32| mesh.vertices[vertices[v as usize] as usize];
        for (&[a, b, c], &class) in triangles.iter().zip(classes) {
            for (a, b) in [(a, b), (b, c), (c, a)] {
                let is_below = |(side, _): &&(Side, f64)| side.holds(place(a)) && side.holds(place(b));
                let Some(number) = depths.iter().position(|depth| is_below(&depth)) else { continue };
                let mut below = |v: u32| {
                    *place_of.entry((v, number)).or_insert_with(|| {
                        skirt.hung.push((v, depths[number].1));
                        (vertices.len() + skirt.hung.len() - 1) as u32
                    })
                };
                let (below_a, below_b) = (below(a), below(b));
                skirt.triangles.extend([[below_a, below_b, b], [below_a, b, a]]);
                skirt.classes.extend([class; 2]);
            }
        }
        skirt
    }

    /// How far it hangs where it hangs most, in metres.
    pub(crate) fn deepest_m(&self) -> f64 {
        self.hung.iter().map(|(_, depth_m)| *depth_m).fold(0.0, f64::max)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_skirt_hangs_as_far_as_another_mesh_lies_below() {
        let side = Side { axis: 0, at: 640 };
        let high = [[640, 0, 0], [640, 12_800, 1280], [0, 0, -9000], [640, 25_600, 0]];
        let flat = [[640, 0, 0], [640, 25_600, 256], [640, 30_000, -5000]];
        let found = depths(&[side], &[high.to_vec(), flat.to_vec(), high.to_vec()]);
        // Steps of 200 m are the longest: 0.8 mm.
        let bulge_m = 200.0_f64 * 200.0 / (8.0 * 6_371_000.0);
        // In the middle one lies 9 m above the other, at the end 2 m below it.
        for (depths, expected_m) in found.iter().zip([9.0, 2.0, 9.0]) {
            let [(of, depth_m)] = depths.as_slice() else { panic!("one side") };
            assert!(*of == side && (depth_m - expected_m - bulge_m).abs() < 1e-9, "{depth_m} {expected_m}");
        }
        assert!(depths(&[side], &[high.to_vec(), high.to_vec()]).iter().all(Vec::is_empty));
        assert!(depths(&[], &[high.to_vec(), flat.to_vec()]).iter().all(Vec::is_empty));
    }
}
