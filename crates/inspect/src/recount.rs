//! Load modules counted anew from their corners and triangles alone: nothing here is shared with the code that makes
//! them, so that a fault there is found here.
//!
//! A load module is whole when its triangles turn left, together cover the square exactly, and every edge is either
//! shared by two of them or lies on a side. Then no crack and no T-junction is inside; two neighbours fit when the
//! edges on their common side are the same.

use std::collections::BTreeMap;
use std::ops::Deref;

use terrain::{Dem, Importance, LoadModule, ModuleGrid, ModuleId, ModuleResidual, Post, Spacing};

/// A corner: east, north, height.
type Corner = (u16, u16, i32);

/// The edges of a load module on its sides, each from its western or southern end to the other, in order.
#[derive(Debug, Default, PartialEq, Eq)]
pub(crate) struct Sides {
    pub south: Vec<(Along, Along)>,
    pub east: Vec<(Along, Along)>,
    pub north: Vec<(Along, Along)>,
    pub west: Vec<(Along, Along)>,
}

/// A place along a side and its height.
type Along = (u16, i32);

/// The sides of a load module, or what is wrong with it.
pub(crate) fn sides(module: &LoadModule) -> Result<Sides, String> {
    let edges = edges(module)?;
    let side = module.side;
    let mut sides = Sides::default();
    for (&(from, to), &count) in &edges {
        if edges.contains_key(&(to, from)) {
            if 1 < count {
                return Err(format!("the edge from {from:?} to {to:?} belongs to {count} triangles on one side"));
            }
            continue;
        }
        let east = |low: Corner, high: Corner| ((low.0, low.2), (high.0, high.2));
        let north = |low: Corner, high: Corner| ((low.1, low.2), (high.1, high.2));
        // Triangles turn left, so the outline does, too.
        match (from, to) {
            ((_, 0, _), (_, 0, _)) if from.0 < to.0 => sides.south.push(east(from, to)),
            ((a, ..), (b, ..)) if a == side && b == side && from.1 < to.1 => sides.east.push(north(from, to)),
            ((_, a, _), (_, b, _)) if a == side && b == side && to.0 < from.0 => sides.north.push(east(to, from)),
            ((0, ..), (0, ..)) if to.1 < from.1 => sides.west.push(north(to, from)),
            _ => return Err(format!("the edge from {from:?} to {to:?} has a triangle on one side only: a crack")),
        }
    }
    for part in [&mut sides.south, &mut sides.east, &mut sides.north, &mut sides.west] {
        part.sort_unstable();
    }
    Ok(sides)
}

/// Every directed edge and how often it occurs; the triangles turn left and cover the square.
fn edges(module: &LoadModule) -> Result<BTreeMap<(Corner, Corner), u32>, String> {
    let mut edges = BTreeMap::new();
    let mut doubled = 0i64;
    for (number, triangle) in module.triangles.iter().enumerate() {
        let mut corners = [(0, 0, 0); 3];
        for (corner, &index) in corners.iter_mut().zip(triangle) {
            let Some(vertex) = module.vertices.get(usize::from(index)) else {
                return Err(format!("triangle {number} names vertex {index}, and there are {}", module.vertices.len()));
            };
            *corner = (vertex.x, vertex.y, vertex.z);
        }
        let [a, b, c] = corners;
        let far = |from: Corner, to: Corner| (i64::from(to.0) - i64::from(from.0), i64::from(to.1) - i64::from(from.1));
        let ((bx, by), (cx, cy)) = (far(a, b), far(a, c));
        let area = bx * cy - by * cx;
        if area <= 0 {
            return Err(format!("triangle {number} does not turn left"));
        }
        doubled += area;
        for edge in [(a, b), (b, c), (c, a)] {
            *edges.entry(edge).or_default() += 1;
        }
    }
    let side = i64::from(module.side);
    if doubled != 2 * side * side {
        return Err(format!("its triangles cover {doubled} half quanta, the square has {}", 2 * side * side));
    }
    Ok(edges)
}

/// The residual of a load module at the posts it owns, post by post: each in the triangle that holds it, or would if
/// it were moved a little east and still less north (inwards at the area's far sides), interpolated in 128 bits.
pub(crate) fn residual(module: &LoadModule, dem: &Dem, grid: ModuleGrid, spacing: Spacing) -> ModuleResidual {
    let mut residual = ModuleResidual::default();
    for number in 0..module.triangles.len() {
        posts_in(module, number, grid, spacing, |post, corners, at| {
            if dem.is_void(post) {
                return;
            }
            let size = height_above(corners, at, dem.height(post)).unsigned_abs();
            residual.posts += 1;
            residual.largest = residual.largest.max(size);
            residual.sum_abs += u64::from(size);
            residual.sum_squared += u64::from(size) * u64::from(size);
        });
    }
    residual
}

/// The posts that a triangle of a load module owns: `each` takes the post, the triangle's corners, and the post's place
/// among them.
fn posts_in(
    module: &LoadModule,
    number: usize,
    grid: ModuleGrid,
    spacing: Spacing,
    mut each: impl FnMut(Post, &[[i128; 3]; 3], [i128; 2]),
) {
    let (rect, area) = (grid.posts_of(module.id), grid.area());
    let quanta = spacing.quanta_per_post();
    // Posts of a load module, as it counts its quanta.
    let south_west = Post::new(module.id.row as i32 * grid.side_cells, module.id.col as i32 * grid.side_cells);
    let corners = module.triangles[number].map(|index| {
        let vertex = module.vertices[usize::from(index)];
        [i128::from(vertex.x), i128::from(vertex.y), i128::from(vertex.z)]
    });
    let span = |axis: usize, from: i32, low: i32, high: i32| {
        let (least, most) = corners
            .iter()
            .fold((i128::MAX, i128::MIN), |(least, most), corner| (least.min(corner[axis]), most.max(corner[axis])));
        let first = from + (least / i128::from(quanta)) as i32;
        let last = from + (most / i128::from(quanta)) as i32;
        first.max(low)..=last.min(high)
    };
    for row in span(1, south_west.row, rect.south, rect.north) {
        for col in span(0, south_west.col, rect.west, rect.east) {
            let at = [(col - south_west.col) * quanta, (row - south_west.row) * quanta].map(i128::from);
            let inwards = [if col == area.east { -1 } else { 1 }, if row == area.north { -1 } else { 1 }];
            if holds(&corners, at, inwards) {
                each(Post::new(row, col), &corners, at);
            }
        }
    }
}

/// Twice the area left of each side of a triangle as seen from a place, opposite to each corner.
fn weights(corners: &[[i128; 3]; 3], at: [i128; 2]) -> [i128; 3] {
    let left =
        |from: [i128; 3], to: [i128; 3]| (to[0] - from[0]) * (at[1] - from[1]) - (to[1] - from[1]) * (at[0] - from[0]);
    let [a, b, c] = *corners;
    [left(b, c), left(c, a), left(a, b)]
}

/// Whether a triangle holds a place, or would if it were moved a little inwards.
fn holds(corners: &[[i128; 3]; 3], at: [i128; 2], inwards: [i128; 2]) -> bool {
    let [a, b, c] = *corners;
    let mut sides = weights(corners, at).into_iter().zip([(b, c), (c, a), (a, b)]);
    sides.all(|(left, (from, to))| {
        let (east, north) = (to[0] - from[0], to[1] - from[1]);
        (left, -north * inwards[0], east * inwards[1]) > (0, 0, 0)
    })
}

/// How far a height stands above a triangle that holds its place, rounded to the nearest quantum, halves outwards.
fn height_above(corners: &[[i128; 3]; 3], at: [i128; 2], height: i32) -> i32 {
    let weights = weights(corners, at);
    let whole: i128 = weights.iter().sum();
    let plane: i128 = corners.iter().zip(weights).map(|(corner, weight)| corner[2] * weight).sum();
    let above = i128::from(height) * whole - plane;
    (above.signum() * ((2 * above.abs() + whole) / (2 * whole))) as i32
}

/// The sum of `counts`, row by row, over every window of `rows` x `columns` load modules, cut to the area: added up
/// one by one. Windows are named by their south-west load module.
pub(crate) fn windows(
    grid: ModuleGrid,
    counts: &[u32],
    rows: u32,
    columns: u32,
) -> impl Iterator<Item = (ModuleId, u64)> + '_ {
    let (rows, columns) = (rows.min(grid.rows), columns.min(grid.cols));
    let at = move |row: u32, col: u32| u64::from(counts[(row * grid.cols + col) as usize]);
    let sum = move |south: u32, west: u32| -> u64 {
        (south..south + rows).map(|row| (west..west + columns).map(|col| at(row, col)).sum::<u64>()).sum()
    };
    let origins = (0..=grid.rows - rows).flat_map(move |row| (0..=grid.cols - columns).map(move |col| (row, col)));
    origins.map(move |(row, col)| (ModuleId { row, col }, sum(row, col)))
}

/// The class of most of the posts that a triangle holds, the smaller one where two have as many; `None` where it holds
/// none: it then has the class of a post beside its centroid.
pub(crate) fn class_of(
    module: &LoadModule,
    number: usize,
    mask: &Importance,
    grid: ModuleGrid,
    spacing: Spacing,
) -> Option<u8> {
    let mut counts = [0u32; 256];
    posts_in(module, number, grid, spacing, |post, _, _| counts[usize::from(mask.class(post))] += 1);
    let most = counts.iter().copied().max().filter(|&most| 0 < most)?;
    counts.iter().position(|&count| count == most).map(|class| class as u8)
}

/// The edges on the sides of the load modules of a row, where these are sound.
pub(crate) struct RowSides(Vec<Option<Sides>>);

impl RowSides {
    /// Those of a row, none beyond the area; `problems` takes a sentence for each load module that is unsound.
    pub fn of<M: Deref<Target = LoadModule>>(
        grid: ModuleGrid,
        row: u32,
        get: impl Fn(&ModuleId) -> Option<M>,
        problems: &mut Vec<String>,
    ) -> Self {
        let mut sides_of = |col| match sides(&*get(&ModuleId { row, col })?) {
            Ok(sides) => Some(sides),
            Err(what) => {
                problems.push(format!("load module {}: {what}", ModuleId { row, col }));
                None
            }
        };
        let cols = if row < grid.rows { grid.cols } else { 0 };
        Self((0..cols).map(&mut sides_of).collect())
    }

    fn at(&self, col: usize) -> Option<&Sides> {
        self.0.get(col)?.as_ref()
    }
}

/// What is wrong where the load modules of a row meet each other and those above, a sentence each.
pub(crate) fn cracks(row: u32, here: &RowSides, above: &RowSides) -> Vec<String> {
    let mut problems = Vec::new();
    for (col, own) in here.0.iter().enumerate().filter_map(|(col, own)| Some((col, own.as_ref()?))) {
        let id = ModuleId { row, col: col as u32 };
        if here.at(col + 1).is_some_and(|east| own.east != east.west) {
            problems.push(format!("load module {id}: its edges on the eastern side are not its neighbour's: a crack"));
        }
        if above.at(col).is_some_and(|north| own.north != north.south) {
            problems.push(format!("load module {id}: its edges on the northern side are not its neighbour's: a crack"));
        }
    }
    problems
}

/// What is wrong where the load modules of a row at one level meet those of another, in this row and above, a sentence
/// each: every one is sound by itself.
pub(crate) fn cracks_between(
    row: u32,
    (here, sides): (usize, &RowSides),
    (there, [beside, above]): (usize, [&RowSides; 2]),
) -> Vec<String> {
    let mut problems = Vec::new();
    for (col, own) in sides.0.iter().enumerate().filter_map(|(col, own)| Some((col, own.as_ref()?))) {
        let id = ModuleId { row, col: col as u32 };
        let beside = beside.at(col + 1).map(|other| ("eastern", own.east == other.west));
        let above = above.at(col).map(|other| ("northern", own.north == other.south));
        for (name, _) in [beside, above].into_iter().flatten().filter(|(_, is_shared)| !is_shared) {
            problems.push(format!(
                "load module {id}: its edges on the {name} side at level {here} are not its neighbour's at level \
                 {there}: a crack"
            ));
        }
    }
    problems
}

#[cfg(test)]
mod tests {
    use terrain::ModuleVertex;

    use super::*;

    /// What is wrong with two load modules at a level, and where they meet.
    fn problems(grid: ModuleGrid, modules: &BTreeMap<ModuleId, LoadModule>) -> Vec<String> {
        let mut problems = Vec::new();
        let [here, above] = [0, 1].map(|row| RowSides::of(grid, row, |id| modules.get(id), &mut problems));
        problems.extend(cracks(0, &here, &above));
        problems
    }

    /// What is wrong where two levels meet.
    fn problems_between(grid: ModuleGrid, levels: &[BTreeMap<ModuleId, LoadModule>; 2]) -> Vec<String> {
        let [one, other] = [0, 1]
            .map(|level: usize| [0, 1].map(|row| RowSides::of(grid, row, |id| levels[level].get(id), &mut Vec::new())));
        let found = cracks_between(0, (0, &one[0]), (1, [&other[0], &other[1]]));
        [found, cracks_between(0, (1, &other[0]), (0, [&one[0], &one[1]]))].concat()
    }

    /// A square of 100 quanta in four triangles around its middle, with another vertex on the eastern side if wanted.
    fn square(col: u32, extra: bool) -> LoadModule {
        let vertex = |(x, y): (u16, u16)| ModuleVertex { y, x, z: 7 };
        let mut places = vec![(0, 0), (100, 0), (100, 100), (0, 100), (50, 50)];
        let mut triangles = vec![[0, 1, 4], [2, 3, 4], [3, 0, 4]];
        if extra {
            places.push((100, 40));
            triangles.extend([[1, 5, 4], [5, 2, 4]]);
        } else {
            triangles.push([1, 2, 4]);
        }
        LoadModule {
            id: ModuleId { row: 0, col },
            side: 100,
            vertices: places.into_iter().map(vertex).collect(),
            classes: vec![0; triangles.len()],
            polygon_count: 1,
            triangles,
            ..LoadModule::default()
        }
    }

    #[track_caller]
    fn check(modules: [LoadModule; 2], expected: &str) {
        let grid = ModuleGrid { rows: 1, cols: 2, side_cells: 4 };
        let found = problems(grid, &modules.into_iter().map(|module| (module.id, module)).collect());
        match expected {
            "" => assert_eq!(found, [""; 0]),
            expected => assert!(found.iter().any(|problem| problem.contains(expected)), "{found:?}"),
        }
    }

    #[test]
    fn cracks_gaps_and_turned_triangles_are_found() {
        check([square(0, false), square(1, false)], "");
        check([square(0, true), square(1, false)], "load module 0,0: its edges on the eastern side");
        let mut higher = square(1, false);
        higher.vertices[0].z += 1;
        check([square(0, false), higher], "a crack");
        let mut turned = square(1, false);
        turned.triangles[0].swap(0, 1);
        check([square(0, false), turned], "load module 0,1: triangle 0 does not turn left");
        let mut torn = square(0, false);
        torn.triangles.pop();
        check([torn, square(1, false)], "cover");
        let mut missing = square(0, false);
        missing.triangles[0][0] = 9;
        check([missing, square(1, false)], "names vertex 9");
        // A vertex in the middle of an edge of the neighbouring triangle.
        let mut junction = square(0, false);
        junction.vertices.push(ModuleVertex { y: 25, x: 25, z: 7 });
        junction.triangles[0] = [0, 1, 5];
        junction.triangles.push([1, 4, 5]);
        check([junction, square(1, false)], "on one side only: a crack");
    }

    #[test]
    fn cracks_between_levels_are_found() {
        let grid = ModuleGrid { rows: 1, cols: 2, side_cells: 4 };
        let level = |extra: bool| -> BTreeMap<_, _> {
            [square(0, extra), square(1, false)].into_iter().map(|module| (module.id, module)).collect()
        };
        assert_eq!(problems_between(grid, &[level(false), level(false)]), [""; 0]);
        let found = problems_between(grid, &[level(false), level(true)]);
        let expected = "load module 0,0: its edges on the eastern side at level 1 are not its neighbour's at level 0: ";
        assert_eq!(found, [format!("{expected}a crack")]);
    }

    #[test]
    fn every_post_is_counted_once_and_halves_are_rounded_outwards() {
        let grid = ModuleGrid { rows: 1, cols: 2, side_cells: 4 };
        let spacing = Spacing::from_sixteenths(4).unwrap();
        let side = u16::try_from(4 * spacing.quanta_per_post()).unwrap();
        let scaled = |col: u32| {
            let mut module = square(col, false);
            let whole = |place: u16| if place == 50 { side / 2 } else { place / 100 * side };
            for vertex in &mut module.vertices {
                (vertex.x, vertex.y) = (whole(vertex.x), whole(vertex.y));
            }
            module.side = side;
            module
        };
        let dem = Dem::from_fn(grid.area(), |post| Some(7 + post.row - 2 * post.col));
        let parts = [0, 1].map(|col| residual(&scaled(col), &dem, grid, spacing));
        assert_eq!(parts.map(|part| part.posts), [20, 25]);
        let sizes: Vec<i64> = (0..5).flat_map(|row| (0..9).map(move |col| i64::from(row - 2 * col))).collect();
        let sum = |of: fn(&ModuleResidual) -> u64| parts.iter().map(of).sum::<u64>();
        assert_eq!(sum(|part| part.sum_abs), sizes.iter().map(|size| size.unsigned_abs()).sum::<u64>());
        assert_eq!(sum(|part| part.sum_squared), sizes.iter().map(|size| (size * size) as u64).sum::<u64>());
        let half = [[0, 0, 0], [4, 0, 0], [0, 4, 2]];
        assert_eq!([1, 0].map(|height| height_above(&half, [1, 1], height)), [1, -1]);
    }

    #[test]
    fn windows_are_added_up_one_by_one() {
        let grid = ModuleGrid { rows: 2, cols: 3, side_cells: 4 };
        let sums = |rows, columns| windows(grid, &[1, 2, 3, 4, 5, 6], rows, columns).map(|(_, sum)| sum);
        assert_eq!(sums(2, 2).collect::<Vec<_>>(), [12, 16]);
        assert_eq!(sums(8, 8).collect::<Vec<_>>(), [21]);
    }
}
