//! Stands objects on the ground: walls reach its lowest place under them, roofs stand over its highest.

use std::collections::BTreeMap;

use terrain::{LoadModule, ModuleId, Objects, Prism, Tin};

use crate::load_modules::Layout;

/// Corners in quanta from the south-west corner of a load module, and their heights.
type Corners = [[f64; 3]; 3];

/// Of each prism, by its id, the highest ground under what of it stands on the load modules of `tin`, another tile's;
/// `pieces` are those load modules with what stands there.
pub fn highest_in(tin: &Tin, pieces: &[(ModuleId, &Prism)], layout: &Layout, highest: &mut BTreeMap<u64, i32>) {
    let quanta = i64::from(layout.spacing.quanta_per_post() / tin.steps_per_post);
    let side = i64::from(layout.side());
    // Of each load module that is asked for, the triangles over it.
    let mut over: BTreeMap<ModuleId, Vec<Corners>> = pieces.iter().map(|(module, _)| (*module, Vec::new())).collect();
    for triangle in &tin.triangles {
        let vertices = triangle.map(|index| &tin.vertices[index as usize]);
        let places = vertices.map(|vertex| [vertex.at.col, vertex.at.row].map(|step| i64::from(step) * quanta));
        let range = |axis: usize| {
            let of = |end: fn(i64, i64) -> i64| places.map(|at| at[axis]).into_iter().reduce(end).unwrap_or(0);
            // On a line it lies over both.
            let index = |at: i64| at.div_euclid(side).max(0) as u32;
            index(of(i64::min) - 1)..=index(of(i64::max))
        };
        for (row, col) in range(1).flat_map(|row| range(0).map(move |col| (row, col))) {
            if let Some(over) = over.get_mut(&ModuleId { row, col }) {
                let corner = [i64::from(col) * side, i64::from(row) * side];
                over.push([0, 1, 2].map(|k| {
                    let [x, y] = [0, 1].map(|axis| (places[k][axis] - corner[axis]) as f64);
                    [x, y, f64::from(vertices[k].height)]
                }));
            }
        }
    }
    for (module, prism) in pieces {
        if let Some([_, high]) = under(prism, over[module].iter().copied()) {
            raise(highest, prism.id, high);
        }
    }
}

fn raise(highest: &mut BTreeMap<u64, i32>, id: u64, height: i32) {
    highest.entry(id).and_modify(|before| *before = height.max(*before)).or_insert(height);
}

/// What stands in each load module, with heights above the vertical datum. `levels` are the load modules of a tile, the
/// finest first, and `objects` what stands in each, its heights above the ground. `highest` has what is known of the
/// ground under pieces in other tiles.
///
/// A roof is over the highest ground of the finest level under all pieces of the prism. A base is at the lowest ground
/// of any level under the piece, or as much above the highest as it hangs in the air.
pub fn stand(objects: &[Objects], levels: &[Vec<LoadModule>], highest: &BTreeMap<u64, i32>) -> Vec<Objects> {
    let mut highest = highest.clone();
    let mut lowest = Vec::new();
    for (slot, objects) in objects.iter().enumerate() {
        for prism in &objects.prisms {
            let of = |level: &Vec<LoadModule>| under(prism, triangles_of(&level[slot])).expect("the ground has no gap");
            raise(&mut highest, prism.id, of(&levels[0])[1]);
            lowest.push(levels.iter().map(|level| of(level)[0]).min().unwrap_or(0));
        }
    }
    let mut lowest = lowest.into_iter();
    let mut standing = objects.to_vec();
    for prism in standing.iter_mut().flat_map(|objects| &mut objects.prisms) {
        let (low, high) = (lowest.next().expect("one for each"), highest[&prism.id]);
        (prism.base, prism.roof) = (if 0 < prism.base { high + prism.base } else { low }, high + prism.roof);
    }
    // Pieces of one object in one load module may have changed places.
    standing.iter_mut().for_each(|objects| objects.prisms.sort());
    standing
}

fn triangles_of(module: &LoadModule) -> impl Iterator<Item = Corners> {
    let place = |index: u16| {
        let vertex = &module.vertices[usize::from(index)];
        [f64::from(vertex.x), f64::from(vertex.y), f64::from(vertex.z)]
    };
    module.triangles.iter().map(move |triangle| triangle.map(place))
}

/// The lowest and the highest of some ground under a prism, in quanta; `None` where it has none of it. A surface of
/// triangles has both at their corners, under the prism's corners, or where edges of both cross.
fn under(prism: &Prism, triangles: impl Iterator<Item = Corners>) -> Option<[i32; 2]> {
    let walls: Vec<[[f64; 2]; 2]> = prism
        .rings
        .iter()
        .flat_map(|ring| ring.iter().zip(ring.iter().cycle().skip(1)))
        .map(|(a, b)| [[f64::from(a.x), f64::from(a.y)], [f64::from(b.x), f64::from(b.y)]])
        .collect();
    let around = bounds(walls.iter().map(|wall| wall[0]));
    let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
    let mut see = |height: f64| (low, high) = (low.min(height), high.max(height));
    for corners in triangles {
        let own = bounds(corners.iter().map(|corner| [corner[0], corner[1]]));
        if (0..2).any(|axis| own[1][axis] < around[0][axis] || around[1][axis] < own[0][axis]) {
            continue;
        }
        corners.iter().filter(|corner| is_inside(&walls, [corner[0], corner[1]])).for_each(|corner| see(corner[2]));
        for wall in &walls {
            height_in(&corners, wall[0]).into_iter().for_each(&mut see);
            for edge in [[0, 1], [1, 2], [2, 0]] {
                crossing(edge.map(|index: usize| corners[index]), *wall).into_iter().for_each(&mut see);
            }
        }
    }
    (low <= high).then(|| [low.floor() as i32, high.ceil() as i32])
}

fn bounds(places: impl Iterator<Item = [f64; 2]>) -> [[f64; 2]; 2] {
    let none = [[f64::INFINITY; 2], [f64::NEG_INFINITY; 2]];
    places.fold(none, |[low, high], at| {
        [[0, 1].map(|axis| low[axis].min(at[axis])), [0, 1].map(|axis| high[axis].max(at[axis]))]
    })
}

/// How far left of a line from `a` to `b` a place lies, times its length; exact for whole quanta.
fn left(a: [f64; 2], b: [f64; 2], at: [f64; 2]) -> f64 {
    (b[0] - a[0]) * (at[1] - a[1]) - (b[1] - a[1]) * (at[0] - a[0])
}

/// Whether a place lies inside of a ring, given as its edges in any order.
pub(crate) fn is_inside(walls: &[[[f64; 2]; 2]], at: [f64; 2]) -> bool {
    let crosses =
        |[a, b]: &[[f64; 2]; 2]| (a[1] <= at[1]) != (b[1] <= at[1]) && (0.0 < left(*a, *b, at)) == (a[1] < b[1]);
    walls.iter().filter(|wall| crosses(wall)).count() % 2 == 1
}

/// The height of a triangle at a place inside it or on its edges.
fn height_in(corners: &Corners, at: [f64; 2]) -> Option<f64> {
    let plan = corners.map(|corner| [corner[0], corner[1]]);
    let shares = [left(plan[1], plan[2], at), left(plan[2], plan[0], at), left(plan[0], plan[1], at)];
    let all = shares[0] + shares[1] + shares[2];
    let is_over = 0.0 < all && shares.iter().all(|share| 0.0 <= *share);
    let rise = |corner: usize| corners[corner][2] - corners[0][2];
    is_over.then(|| corners[0][2] + (shares[1] * rise(1) + shares[2] * rise(2)) / all)
}

/// The height of an edge where a wall crosses it.
fn crossing([a, b]: [[f64; 3]; 2], [c, d]: [[f64; 2]; 2]) -> Option<f64> {
    let [from, to] = [a, b].map(|end| [end[0], end[1]]);
    let (of_from, of_to) = (left(c, d, from), left(c, d, to));
    let (of_c, of_d) = (left(from, to, c), left(from, to, d));
    let crosses = (of_from <= 0.0) != (of_to <= 0.0) && (of_c <= 0.0) != (of_d <= 0.0);
    crosses.then(|| a[2] + (b[2] - a[2]) * (of_from / (of_from - of_to)))
}

#[cfg(test)]
mod tests {
    use terrain::{Corner, ModuleVertex, ObjectKind};

    use super::*;

    const SIDE: u16 = 64_000;

    /// A square that rises 64 quanta a metre to the east, with a top of so many quanta in its middle.
    fn ground(top: i32) -> LoadModule {
        let at = |x: u16, y: u16, z: i32| ModuleVertex { y, x, z };
        let vertices =
            vec![at(0, 0, 0), at(SIDE, 0, 32_000), at(SIDE / 2, SIDE / 2, top), at(0, SIDE, 0), at(SIDE, SIDE, 32_000)];
        LoadModule {
            id: ModuleId { row: 0, col: 0 },
            side: SIDE,
            vertices,
            triangles: vec![[0, 1, 2], [0, 2, 3], [1, 4, 2], [2, 4, 3]],
            classes: vec![0; 4],
            polygon_count: 4,
            ..LoadModule::default()
        }
    }

    fn block([x, y]: [u16; 2], wide: u16, [base, roof]: [i32; 2]) -> Prism {
        let corners = [[x, y], [x + wide, y], [x + wide, y + wide], [x, y + wide]];
        let ring = corners.map(|[x, y]| Corner { x, y, has_wall: true }).to_vec();
        Prism { id: 7, kind: ObjectKind::Building, base, roof, rings: vec![ring] }
    }

    #[track_caller]
    fn check(prism: Prism, levels: &[i32], elsewhere: Option<i32>, expected: [i32; 2]) {
        let levels: Vec<Vec<LoadModule>> = levels.iter().map(|&top| vec![ground(top)]).collect();
        let objects = [Objects { prisms: vec![prism], canopies: Vec::new() }];
        let highest = elsewhere.map(|height| (7, height)).into_iter().collect();
        let standing = stand(&objects, &levels, &highest);
        assert_eq!([standing[0].prisms[0].base, standing[0].prisms[0].roof], expected);
    }

    #[test]
    fn walls_reach_the_lowest_ground_of_any_level_and_roofs_stand_over_the_highest() {
        // On an even slope: 0.5 quanta a quantum.
        check(block([1_000, 31_000], 1_280, [0, 768]), &[16_000], None, [500, 1_140 + 768]);
        // Over the top, which no corner of the house is near; a coarser level lies lower.
        check(block([31_000, 31_000], 2_000, [0, 768]), &[40_000, 16_000], None, [15_500, 40_768]);
        // A piece in another tile stands higher; what hangs, hangs above the highest.
        check(block([1_000, 31_000], 1_280, [0, 768]), &[16_000], Some(5_000), [500, 5_768]);
        check(block([1_000, 31_000], 1_280, [384, 768]), &[16_000], Some(5_000), [5_384, 5_768]);
        // What covers all of a load module.
        check(block([0, 0], SIDE, [0, 10]), &[-90], None, [-90, 32_010]);
    }

    #[test]
    fn no_ground_under_a_prism_lies_outside_what_is_found() {
        let module = ground(3_000);
        let mut draw = 12_345_u32;
        let mut next = |below: u32| {
            draw = draw.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            ((draw >> 8) % below) as u16
        };
        for _ in 0..200 {
            let prism = block([next(60_000), next(60_000)], 100 + next(3_900), [0, 1]);
            let [low, high] = under(&prism, triangles_of(&module)).unwrap();
            for _ in 0..50 {
                let [x, y] = [0, 1].map(|_| next(4_000));
                let ring = &prism.rings[0];
                let at = [
                    f64::from(ring[0].x + x % (ring[1].x - ring[0].x)),
                    f64::from(ring[0].y + y % (ring[1].x - ring[0].x)),
                ];
                let height = triangles_of(&module).find_map(|corners| height_in(&corners, at)).unwrap();
                assert!(f64::from(low) <= height && height <= f64::from(high), "{prism:?} {at:?}");
            }
        }
    }
}
