//! One tile of quantized-mesh 1.0, with oct-encoded normals.
//!
//! Beside its triangles a tile says where water is, and which tiles lie below it.

use std::collections::HashMap;

use serde_json::Value;

use super::clip::{GONE, doubled_area, right};
use super::lattice::{Ladder, Node, STEPS, height_m, lon_lat};
use crate::earth::earth_centred;
use crate::mesh::{cross, dot, minus, unit};

/// Half axes of WGS 84's ellipsoid.
const HALF_AXES_M: [f64; 3] = [6_378_137.0, 6_378_137.0, 6_356_752.314_245_179];

/// A tile in the making.
#[derive(Debug)]
pub(crate) struct Tile {
    level: u32,
    col: i64,
    row: i64,
    /// In the order in which triangles first use them.
    nodes: Vec<Node>,
    place_of: HashMap<(i64, i64), u32>,
    /// Of the nodes that fall on one place of the lattice the lowest, whichever comes first: so neighbours agree.
    lowest: HashMap<(i64, i64), Node>,
    triangles: Vec<[u32; 3]>,
    /// Where it has water, if anything exported has.
    pub water: Option<WaterMask>,
    /// What it says of the tiles below it, if it is one that does.
    pub metadata: Option<Value>,
}

impl Tile {
    pub(crate) fn new(level: u32, col: i64, row: i64) -> Self {
        let (place_of, lowest) = (HashMap::new(), HashMap::new());
        let (nodes, triangles) = (Vec::new(), Vec::new());
        Self { level, col, row, nodes, place_of, lowest, triangles, water: None, metadata: None }
    }

    /// Adds a convex polygon as a fan, without triangles two corners of which fall on one place.
    pub(crate) fn add(&mut self, polygon: &[Node]) {
        for node in polygon {
            let lowest = self.lowest.entry((node.x, node.y)).or_insert(*node);
            if (node.h, node.normal) < (lowest.h, lowest.normal) {
                *lowest = *node;
            }
        }
        for i in 1..polygon.len().saturating_sub(1) {
            let corners = [polygon[0], polygon[i], polygon[i + 1]];
            let [a, b, c] = corners.map(|node| (node.x, node.y));
            if a != b && b != c && c != a {
                let triangle = corners.map(|node| self.place(node));
                self.triangles.push(triangle);
            }
        }
    }

    /// Makes one surface of what was added: triangles are counter-clockwise, and no edge inside of the tile is torn.
    pub(crate) fn close(&mut self) {
        let mut triangles = std::mem::take(&mut self.triangles);
        right(&self.nodes, &mut triangles);
        self.place_of.clear();
        let nodes = std::mem::take(&mut self.nodes);
        for triangle in triangles.into_iter().filter(|triangle| *triangle != GONE) {
            let triangle = triangle.map(|v| self.place(nodes[v as usize]));
            self.triangles.push(triangle);
        }
        assert_eq!(self.torn(), 0, "every edge inside of tile {}/{}/{} has two sides", self.level, self.col, self.row);
    }

    /// Edges that have a triangle on one side alone, but for those along the tile's border.
    pub(crate) fn torn(&self) -> usize {
        let mut sides: HashMap<(u32, u32), i32> = HashMap::new();
        for &[a, b, c] in &self.triangles {
            for (from, to) in [(a, b), (b, c), (c, a)] {
                *sides.entry((from.min(to), from.max(to))).or_default() += if from < to { 1 } else { -1 };
            }
        }
        sides.into_iter().filter(|&((a, b), sides)| sides != 0 && !self.is_on_border(a, b)).count()
    }

    /// Whether an edge lies on one of the tile's four sides.
    fn is_on_border(&self, a: u32, b: u32) -> bool {
        let [a, b] = [a, b].map(|v| self.nodes[v as usize]);
        let is_end = |at: i64, tile: i64| at == tile * STEPS || at == (tile + 1) * STEPS;
        a.x == b.x && is_end(a.x, self.col) || a.y == b.y && is_end(a.y, self.row)
    }

    /// Doubled areas of its triangles, in steps.
    pub(crate) fn areas(&self) -> impl Iterator<Item = i64> {
        let node = |v: u32| &self.nodes[v as usize];
        self.triangles.iter().map(move |&[a, b, c]| doubled_area(node(a), node(b), node(c)))
    }

    /// The vertex at a node's place: numbered when it is first used, as the format wants it.
    fn place(&mut self, node: Node) -> u32 {
        let next = self.nodes.len() as u32;
        let place = *self.place_of.entry((node.x, node.y)).or_insert(next);
        if place == next {
            self.nodes.push(node);
        }
        place
    }

    /// Share of the tile that its triangles cover.
    pub(crate) fn covered(&self) -> f64 {
        self.areas().sum::<i64>() as f64 / (2 * STEPS * STEPS) as f64
    }

    /// Where it lies on the globe.
    pub(crate) fn placed(&self) -> Placed {
        let nodes: Vec<Node> = self.nodes.iter().map(|node| self.lowest[&(node.x, node.y)]).collect();
        let place = |node: &Node| earth_centred(lon_lat(self.level, [node.x, node.y]), height_m(node.h));
        let places: Vec<[f64; 3]> = nodes.iter().map(place).collect();
        let end = |pick: fn(f64, f64) -> f64, from: f64| {
            places.iter().fold([from; 3], |end, place| [0, 1, 2].map(|axis| pick(end[axis], place[axis])))
        };
        let (low, high) = (end(f64::min, f64::INFINITY), end(f64::max, f64::NEG_INFINITY));
        let middle = [0, 1, 2].map(|axis| f64::midpoint(low[axis], high[axis]));
        let distance = |place: &[f64; 3]| dot(minus(*place, middle), minus(*place, middle)).sqrt();
        let radius = places.iter().map(distance).fold(0.0, f64::max);
        let horizon = horizon_point(middle, &places);
        Placed { ladder: Ladder::of(&nodes), nodes, places, middle, radius, horizon }
    }

    /// The bytes of its file.
    pub(crate) fn bytes(&self) -> Vec<u8> {
        let placed = self.placed();
        let (nodes, ladder) = (&placed.nodes, &placed.ladder);
        let mut bytes = Vec::with_capacity(128 + 10 * nodes.len() + 6 * self.triangles.len());
        placed.put_header(&mut bytes);
        bytes.extend_from_slice(&(nodes.len() as u32).to_le_bytes());
        let (west, south) = (self.col * STEPS, self.row * STEPS);
        let parts: [&dyn Fn(&Node) -> i64; 3] = [&|n| n.x - west, &|n| n.y - south, &|n| ladder.rung(n.h)];
        for part in parts {
            let mut before = 0;
            for node in nodes {
                bytes.extend_from_slice(&zigzag(part(node) - before).to_le_bytes());
                before = part(node);
            }
        }
        let wide = usize::from(u16::MAX) + 1 < nodes.len();
        if wide {
            bytes.resize(bytes.len().next_multiple_of(4), 0);
        }
        self.put_triangles(&mut bytes, wide);
        for along in self.edges() {
            bytes.extend_from_slice(&(along.len() as u32).to_le_bytes());
            along.iter().for_each(|&index| put_index(&mut bytes, index, wide));
        }
        put_normals(&mut bytes, nodes);
        self.water.iter().for_each(|water| water.put(&mut bytes));
        self.metadata.iter().for_each(|metadata| put_metadata(&mut bytes, metadata));
        bytes
    }

    /// Corners of its triangles among its nodes.
    pub(crate) fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// Triangles by "high water mark": how far below the next new vertex each one is.
    fn put_triangles(&self, bytes: &mut Vec<u8>, wide: bool) {
        bytes.extend_from_slice(&(self.triangles.len() as u32).to_le_bytes());
        let mut next = 0;
        for &vertex in self.triangles.as_flattened() {
            put_index(bytes, next - vertex, wide);
            next += u32::from(vertex == next);
        }
    }

    /// Vertices on the western, southern, eastern and northern border, each from the south or the west.
    pub(crate) fn edges(&self) -> [Vec<u32>; 4] {
        let (west, south) = (self.col * STEPS, self.row * STEPS);
        let edges: [&Along; 4] = [
            &|n| (n.x == west).then_some(n.y),
            &|n| (n.y == south).then_some(n.x),
            &|n| (n.x == west + STEPS).then_some(n.y),
            &|n| (n.y == south + STEPS).then_some(n.x),
        ];
        edges.map(|edge| {
            let mut along: Vec<(i64, u32)> =
                (0..).zip(&self.nodes).filter_map(|(index, node)| Some((edge(node)?, index))).collect();
            along.sort_unstable();
            along.into_iter().map(|(_, index)| index).collect()
        })
    }
}

/// A tile on the globe, in metres from the middle of the Earth.
pub(crate) struct Placed {
    /// Its vertices: of those at one place of the lattice the lowest.
    pub nodes: Vec<Node>,
    /// Where they lie.
    pub places: Vec<[f64; 3]>,
    /// The middle of the sphere around them.
    pub middle: [f64; 3],
    /// Half of what it measures.
    pub radius: f64,
    /// The point that is hidden by the horizon only if all of the tile is, in axes in which the ellipsoid is a sphere
    /// of radius one.
    pub horizon: [f64; 3],
    ladder: Ladder,
}

impl Placed {
    /// The lowest and the highest height above the ellipsoid, in metres.
    pub(crate) fn heights_m(&self) -> [f64; 2] {
        [self.ladder.low, self.ladder.high].map(height_m)
    }

    fn put_header(&self, bytes: &mut Vec<u8>) {
        self.middle.iter().for_each(|number| bytes.extend_from_slice(&number.to_le_bytes()));
        self.heights_m().iter().for_each(|&height_m| bytes.extend_from_slice(&(height_m as f32).to_le_bytes()));
        for number in self.middle.into_iter().chain([self.radius]).chain(self.horizon) {
            bytes.extend_from_slice(&number.to_le_bytes());
        }
    }
}

/// How far along a border a node on it lies.
type Along<'a> = dyn Fn(&Node) -> Option<i64> + 'a;

fn put_index(bytes: &mut Vec<u8>, index: u32, wide: bool) {
    match wide {
        true => bytes.extend_from_slice(&index.to_le_bytes()),
        false => bytes.extend_from_slice(&(index as u16).to_le_bytes()),
    }
}

fn zigzag(step: i64) -> u16 {
    ((step << 1) ^ (step >> 63)) as u16
}

/// The extension with the normals: its number, its length, two bytes for each vertex.
fn put_normals(bytes: &mut Vec<u8>, nodes: &[Node]) {
    const OCT_NORMALS: u8 = 1;
    bytes.push(OCT_NORMALS);
    bytes.extend_from_slice(&(2 * nodes.len() as u32).to_le_bytes());
    nodes.iter().for_each(|node| bytes.extend_from_slice(&oct(node.normal)));
}

/// A unit vector as a place on an unfolded octahedron.
fn oct(normal: [f64; 3]) -> [u8; 2] {
    let sum: f64 = normal.iter().map(|part| part.abs()).sum();
    let [x, y] = [normal[0] / sum, normal[1] / sum];
    let sign = |v: f64| if v < 0.0 { -1.0 } else { 1.0 };
    let folded = match normal[2] < 0.0 {
        true => [(1.0 - y.abs()) * sign(x), (1.0 - x.abs()) * sign(y)],
        false => [x, y],
    };
    folded.map(|part| ((part.clamp(-1.0, 1.0) * 0.5 + 0.5) * 255.0).round() as u8)
}

/// The point that is hidden by the horizon only if all of the tile is, in axes in which the ellipsoid is a sphere of
/// radius one.
fn horizon_point(middle: [f64; 3], places: &[[f64; 3]]) -> [f64; 3] {
    /// A height, in radii, from which nothing is ever hidden.
    const NEVER_HIDDEN: f64 = 100.0;
    let scaled = |place: [f64; 3]| [0, 1, 2].map(|axis| place[axis] / HALF_AXES_M[axis]);
    let towards = unit(scaled(middle));
    let reach = |place: &[f64; 3]| {
        let place = scaled(*place);
        let (squared, direction) = (dot(place, place).max(1.0), unit(place));
        let (cos_a, sin_a) =
            (dot(direction, towards), dot(cross(direction, towards), cross(direction, towards)).sqrt());
        let cos_b = 1.0 / squared.sqrt();
        let sin_b = (squared - 1.0).sqrt() * cos_b;
        let reach = 1.0 / (cos_a * cos_b - sin_a * sin_b);
        if reach.is_finite() && 0.0 < reach { reach.min(NEVER_HIDDEN) } else { NEVER_HIDDEN }
    };
    let furthest = places.iter().map(reach).fold(1.0, f64::max);
    towards.map(|part| part * furthest)
}

/// Cells along a side of a mask of water.
pub(crate) const CELLS: i64 = 256;

/// Which cells of a tile lie over water: row by row from the north, each from the west.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct WaterMask(Vec<bool>);

impl WaterMask {
    /// A tile without water.
    pub(crate) fn dry() -> Self {
        Self(vec![false; (CELLS * CELLS) as usize])
    }

    /// A tile in whose cells, by column from the west and row from the south, `is_water` tells.
    pub(crate) fn of(mut is_water: impl FnMut(i64, i64) -> bool) -> Self {
        let rows = (0..CELLS).rev();
        Self(rows.flat_map(|row| (0..CELLS).map(move |col| (col, row))).map(|(col, row)| is_water(col, row)).collect())
    }

    /// Marks the cells whose middles lie in a triangle, on the lattice of the tile's level.
    pub(crate) fn add(&mut self, triangle: [Node; 3], [west, south]: [i64; 2]) {
        // In parts of a step in which the middles of cells are whole numbers.
        let parts = 2 * CELLS;
        let [a, b, c] = triangle.map(|node| Node { x: (node.x - west) * parts, y: (node.y - south) * parts, ..node });
        let middle = |cell: i64| (2 * cell + 1) * STEPS;
        let cells = |of: fn(&Node) -> i64| {
            let at = [&a, &b, &c].map(|node| of(node).div_euclid(2 * STEPS).clamp(0, CELLS - 1));
            at[0].min(at[1]).min(at[2])..=at[0].max(at[1]).max(at[2])
        };
        for row in cells(|node| node.y) {
            for col in cells(|node| node.x) {
                let at = Node { x: middle(col), y: middle(row), ..a };
                if [(&a, &b), (&b, &c), (&c, &a)].iter().all(|(from, to)| 0 <= doubled_area(from, to, &at)) {
                    self.0[((CELLS - 1 - row) * CELLS + col) as usize] = true;
                }
            }
        }
    }

    /// The extension: its number, its length, and a byte for each cell, or one where all are the same.
    pub(crate) fn put(&self, bytes: &mut Vec<u8>) {
        const WATER_MASK: u8 = 2;
        let byte = |is_water: &bool| if *is_water { u8::MAX } else { 0 };
        let cells = if self.0.iter().all(|cell| *cell == self.0[0]) { &self.0[..1] } else { &self.0[..] };
        bytes.push(WATER_MASK);
        bytes.extend_from_slice(&(cells.len() as u32).to_le_bytes());
        bytes.extend(cells.iter().map(byte));
    }
}

/// The extension with the tiles below a tile: its number, its length, the length of the text, the text.
fn put_metadata(bytes: &mut Vec<u8>, metadata: &Value) {
    const METADATA: u8 = 4;
    let text = metadata.to_string();
    bytes.push(METADATA);
    bytes.extend_from_slice(&(text.len() as u32 + 4).to_le_bytes());
    bytes.extend_from_slice(&(text.len() as u32).to_le_bytes());
    bytes.extend_from_slice(text.as_bytes());
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_are_folded_and_normals_unfold_again() {
        assert_eq!([zigzag(0), zigzag(-1), zigzag(1), zigzag(-32_767), zigzag(32_767)], [0, 1, 2, 65_533, 65_534]);
        for normal in [[0.0, 0.0, 1.0], [0.6, -0.48, 0.64], [-0.6, 0.48, -0.64], [0.0, 0.0, -1.0]] {
            let [x, y] = oct(normal).map(|byte| f64::from(byte) / 255.0 * 2.0 - 1.0);
            let z = 1.0 - x.abs() - y.abs();
            let sign = |v: f64| if v < 0.0 { -1.0 } else { 1.0 };
            let [x, y] = if z < 0.0 { [(1.0 - y.abs()) * sign(x), (1.0 - x.abs()) * sign(y)] } else { [x, y] };
            assert!(0.999 < dot(unit([x, y, z]), normal), "{normal:?}");
        }
    }

    #[test]
    fn a_tile_of_one_square_has_every_part_at_its_place() {
        let node = |x, y, h| Node { x, y, h, normal: [0.0, 0.0, 1.0] };
        let mut tile = Tile::new(1, 2, 1);
        let (west, south) = (2 * STEPS, STEPS);
        let square = [
            node(west, south, 0),
            node(west + STEPS, south, 1000),
            node(west + STEPS, south + STEPS, 102_400),
            node(west, south + STEPS, 0),
        ];
        tile.add(&square);
        assert_eq!(tile.covered(), 1.0);
        let bytes = tile.bytes();
        assert_eq!(bytes.len(), 88 + 4 + 4 * 6 + 4 + 12 + 4 * (4 + 4) + 5 + 8);
        let word = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap());
        assert_eq!((word(88), word(116)), (4, 2));
        // From 0 to 100 m.
        assert_eq!((word(24), word(28)), (0.0_f32.to_bits(), 100.0_f32.to_bits()));
        // 0 1 2, 0 2 3: each new vertex is a zero.
        let indices: Vec<u16> = bytes[120..132].chunks(2).map(|b| u16::from_le_bytes([b[0], b[1]])).collect();
        assert_eq!(indices, [0, 0, 0, 3, 1, 0]);
        assert_eq!(word(132), 2);
        assert_eq!(&bytes[136..140], [0, 0, 3, 0]);
    }

    #[test]
    fn of_vertices_at_one_place_the_lowest_is_written_whichever_comes_first() {
        let node = |x, y, h| Node { x, y, h, normal: [0.0, 0.0, 1.0] };
        let one = [node(0, 0, 5), node(STEPS, 0, 40), node(STEPS, STEPS, 90)];
        // Thinner than the lattice, and yet it has a say: a neighbour may have more of it.
        let two = [node(0, 0, 3), node(STEPS, STEPS, 80), node(0, 0, 7)];
        let (mut tile, mut other) = (Tile::new(3, 0, 0), Tile::new(3, 0, 0));
        [one, two].iter().for_each(|polygon| tile.add(polygon));
        [two, one].iter().for_each(|polygon| other.add(polygon));
        assert_eq!(tile.bytes(), other.bytes());
        let float = |at: usize| f32::from_le_bytes(tile.bytes()[at..at + 4].try_into().unwrap());
        assert_eq!([float(24), float(28)], [3.0 / 1024.0, 80.0 / 1024.0]);
    }

    #[test]
    fn a_mask_has_the_cells_whose_middles_lie_in_a_triangle_the_northern_row_first() {
        let node = |x, y| Node { x, y, h: 0, normal: [0.0, 0.0, 1.0] };
        let (west, south) = (7 * STEPS, 3 * STEPS);
        let mut mask = WaterMask::dry();
        let mut bytes = Vec::new();
        mask.put(&mut bytes);
        assert_eq!(bytes, [2, 1, 0, 0, 0, 0]);
        // The half south-east of the diagonal, reaching beyond the tile.
        mask.add(
            [node(west, south), node(west + 2 * STEPS, south), node(west + 2 * STEPS, south + 2 * STEPS)],
            [west, south],
        );
        assert_eq!(mask, WaterMask::of(|col, row| row <= col));
        bytes.clear();
        mask.put(&mut bytes);
        assert_eq!((bytes.len(), bytes[5], bytes[5 + 255], bytes[5 + 255 * 256]), (5 + 65_536, 0, 255, 255));
        let whole = WaterMask::of(|_, _| true);
        bytes.clear();
        whole.put(&mut bytes);
        assert_eq!(bytes, [2, 1, 0, 0, 0, 255]);
    }
}
