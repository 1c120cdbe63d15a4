//! Which triangle of a load module lies under a place, in constant expected time.
//!
//! A grid of square cells over the load module, about as many as triangles, lists for each cell the corners of the
//! triangles that touch it, so that a query reads memory in two places only. A place is first rounded to 1/4096 of a
//! quantum (2 micrometres), after which left or right of an edge is a question about whole numbers: some triangle
//! always holds the place, on edges and corners too.

use std::sync::Arc;

use crate::{QUANTA_PER_METRE, Vertex};

/// Steps of a rounded place to a quantum, as a power of two.
const STEP_BITS: u32 = 12;
/// Steps of a rounded place to a quantum.
pub(crate) const STEPS: i64 = 1 << STEP_BITS;
/// Most cells along a side.
const CELLS_MAX: u32 = 128;
/// Cells that the rectangles around all triangles may touch at most, for each triangle. Terrain takes about ten; a file
/// of splinters across the whole square would take thousands, and with them gigabytes and minutes.
const CELLS_PER_TRIANGLE_MAX: u64 = 64;
/// Words of a triangle in a list: x and y in one, z in the next, for each corner; then its place in the load module.
const ENTRY: usize = 7;

/// The lists of one load module.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Lookup {
    /// Where each cell's list begins, row by row from the south-west, and the end of the last; then the lists.
    words: Arc<[u32]>,
    /// Cells along a side.
    cells: u32,
    /// Cells in a quantum, times 2^32.
    scale: u64,
}

/// Corners of a triangle: x, y, z in quanta.
pub(crate) type Corners = [[i32; 3]; 3];

/// Triangles of a load module: its ground, or its decks.
#[derive(Clone, Copy)]
pub(crate) struct Mesh<'a> {
    pub vertices: &'a [Vertex],
    pub triangles: &'a [[u16; 3]],
}

impl Lookup {
    pub(crate) fn new(mesh: Mesh, side: u16) -> Self {
        let cells = (mesh.triangles.len() as f64).sqrt().ceil().clamp(1.0, f64::from(CELLS_MAX)) as u32;
        let mut lookup = Self::of_cells(cells, side);
        while 1 < lookup.cells && !lookup.is_affordable(mesh) {
            lookup = Self::of_cells(lookup.cells / 2, side);
        }
        let cells = lookup.cells;
        let first = (cells * cells) as usize + 1;
        let mut words = vec![0; first];
        lookup.visit_cells(mesh, side, |cell, _, _| words[cell + 1] += ENTRY as u32);
        words[0] = first as u32;
        for cell in 1..first {
            words[cell] += words[cell - 1];
        }
        words.resize(words[first - 1] as usize, 0);
        let mut next = words[..first].to_vec();
        lookup.visit_cells(mesh, side, |cell, index, corners| {
            let at = next[cell] as usize;
            for (place, [x, y, z]) in corners.iter().enumerate() {
                words[at + 2 * place] = *x as u32 | (*y as u32) << 16;
                words[at + 2 * place + 1] = z.cast_unsigned();
            }
            words[at + 6] = index as u32;
            next[cell] += ENTRY as u32;
        });
        lookup.words = words.into();
        lookup
    }

    /// No lists yet.
    fn of_cells(cells: u32, side: u16) -> Self {
        Self { words: Arc::new([]), cells, scale: (u64::from(cells) << 32) / u64::from(side).max(1) }
    }

    /// Whether lists of so many cells take a bounded share of memory and time.
    fn is_affordable(&self, mesh: Mesh) -> bool {
        let touched = |triangle: &[u16; 3]| {
            let [[west, east], [south, north]] = self.cells_around(&corners_of(mesh, *triangle));
            u64::from(east - west + 1) * u64::from(north - south + 1)
        };
        mesh.triangles.iter().map(touched).sum::<u64>() <= CELLS_PER_TRIANGLE_MAX * mesh.triangles.len() as u64
    }

    /// First and last column, first and last row of the cells that the rectangle around a triangle may touch.
    fn cells_around(&self, corners: &Corners) -> [[u32; 2]; 2] {
        [0, 1].map(|axis| {
            let values = || corners.iter().map(|corner| corner[axis]);
            // A place on a line of cells may be rounded to either side of it.
            let low = (values().min().unwrap_or(0) - 1).max(0);
            [self.cell(low), self.cell(values().max().unwrap_or(0) + 1)]
        })
    }

    /// Calls `each` with every cell that a triangle may touch, the triangle's place and its corners.
    fn visit_cells(&self, mesh: Mesh, side: u16, mut each: impl FnMut(usize, usize, &Corners)) {
        for (index, triangle) in mesh.triangles.iter().enumerate() {
            let corners = corners_of(mesh, *triangle);
            let [[west, east], [south, north]] = self.cells_around(&corners);
            for row in south..=north {
                for col in west..=east {
                    if touches(&corners, self.lines(row, side), self.lines(col, side)) {
                        each((row * self.cells + col) as usize, index, &corners);
                    }
                }
            }
        }
    }

    /// Words in memory.
    #[cfg(test)]
    pub(crate) fn word_count(&self) -> usize {
        self.words.len()
    }

    /// The cell of a coordinate in quanta.
    #[inline]
    fn cell(&self, quanta: i32) -> u32 {
        (((quanta as u64) * self.scale) >> 32).min(u64::from(self.cells - 1)) as u32
    }

    /// A row or column of cells: its lines in quanta, and a little more.
    fn lines(&self, cell: u32, side: u16) -> [i64; 2] {
        let line = |cell: u32| i64::from(cell) * i64::from(side) / i64::from(self.cells);
        [line(cell) - 2, line(cell + 1) + 2]
    }

    /// The list of the cell at a place in steps inside the square.
    #[inline]
    pub(crate) fn list(&self, [x, y]: [i64; 2]) -> &[u32] {
        let cell = self.cell((y >> STEP_BITS) as i32) * self.cells + self.cell((x >> STEP_BITS) as i32);
        let (from, to) = (self.words[cell as usize] as usize, self.words[cell as usize + 1] as usize);
        &self.words[from..to]
    }

    /// The triangle of a cell's list at a place in steps: its corners, how much of it lies opposite each, and where it
    /// stands in the load module.
    #[inline]
    fn find(list: &[u32], [x, y]: [i64; 2]) -> Option<(Corners, [i64; 3], usize)> {
        list.chunks_exact(ENTRY).find_map(|entry| {
            let corner = |place: usize| {
                let [xy, z] = [entry[2 * place], entry[2 * place + 1]];
                [(xy & 0xffff) as i32, (xy >> 16) as i32, z.cast_signed()]
            };
            let corners = [corner(0), corner(1), corner(2)];
            let to = corners.map(|[cx, cy, _]| [(i64::from(cx) << STEP_BITS) - x, (i64::from(cy) << STEP_BITS) - y]);
            // Sides are at most 2^28 steps, so products stay below 2^57.
            let cross = |a: [i64; 2], b: [i64; 2]| a[0] * b[1] - a[1] * b[0];
            let shares = [cross(to[1], to[2]), cross(to[2], to[0]), cross(to[0], to[1])];
            (0 <= shares[0] && 0 <= shares[1] && 0 <= shares[2]).then_some((corners, shares, entry[6] as usize))
        })
    }

    /// Every triangle at a place in steps, where they may lie above each other: as [`Lookup::triangle`] gives one.
    pub(crate) fn triangles(&self, place: [i64; 2]) -> impl Iterator<Item = (Corners, f64, usize)> {
        let held = self.list(place).chunks_exact(ENTRY).filter_map(move |entry| Self::find(entry, place));
        held.map(|(corners, shares, index)| (corners, height_m(&corners, shares), index))
    }

    /// Height at a place in steps, metres.
    #[inline]
    pub(crate) fn height_m(&self, place: [i64; 2]) -> Option<f64> {
        Self::height_in(self.list(place), place)
    }

    /// The same, where the cell's list is known.
    #[inline]
    pub(crate) fn height_in(list: &[u32], place: [i64; 2]) -> Option<f64> {
        let (corners, shares, _) = Self::find(list, place)?;
        Some(height_m(&corners, shares))
    }

    /// Corners of the triangle at a place in steps, the height there in metres, and where it stands in the load module.
    pub(crate) fn triangle(&self, place: [i64; 2]) -> Option<(Corners, f64, usize)> {
        let (corners, shares, index) = Self::find(self.list(place), place)?;
        Some((corners, height_m(&corners, shares), index))
    }

    /// Calls `each` with every triangle that a line between two places in quanta may touch, with some more than once.
    /// Places may lie outside.
    pub(crate) fn triangles_along(&self, side: u16, from: [f64; 2], to: [f64; 2], mut each: impl FnMut(Corners)) {
        let (low, high) = if from[1] <= to[1] { (from, to) } else { (to, from) };
        let cell = |quanta: f64| self.cell(quanta.clamp(0.0, f64::from(side)) as i32);
        for row in cell(low[1])..=cell(high[1]) {
            let [south, north] = self.lines(row, side).map(|quanta| quanta as f64);
            let Some([west, east]) = extent_between(low, high, south, north) else { continue };
            if east < 0.0 || f64::from(side) < west {
                continue;
            }
            // Rounding may put the line into the next cell: look a little further.
            for col in cell(west - 1.0)..=cell(east + 1.0) {
                let place = (row * self.cells + col) as usize;
                let (from, to) = (self.words[place] as usize, self.words[place + 1] as usize);
                for entry in self.words[from..to].chunks_exact(ENTRY) {
                    each([0, 2, 4].map(|at| {
                        [(entry[at] & 0xffff) as i32, (entry[at] >> 16) as i32, entry[at + 1].cast_signed()]
                    }));
                }
            }
        }
    }
}

fn corners_of(mesh: Mesh, triangle: [u16; 3]) -> Corners {
    triangle.map(|v| {
        let v = &mesh.vertices[usize::from(v)];
        [i32::from(v.x), i32::from(v.y), v.z]
    })
}

#[inline]
fn height_m(corners: &Corners, shares: [i64; 3]) -> f64 {
    let [a, b, c] = shares.map(|share| share as f64);
    let heights = corners.map(|corner| f64::from(corner[2]));
    let up = b * (heights[1] - heights[0]) + c * (heights[2] - heights[0]);
    (heights[0] + up / (a + b + c)) / f64::from(QUANTA_PER_METRE)
}

/// Whether a cell lies not wholly beyond one of a triangle's edges.
fn touches(corners: &Corners, [south, north]: [i64; 2], [west, east]: [i64; 2]) -> bool {
    (0..3).all(|i| {
        let [a, b] = [corners[i], corners[(i + 1) % 3]].map(|[x, y, _]| [i64::from(x), i64::from(y)]);
        // The corner of the cell that lies furthest to the left of the edge.
        let x = if a[1] < b[1] { west } else { east };
        let y = if a[0] < b[0] { north } else { south };
        0 <= (b[0] - a[0]) * (y - a[1]) - (b[1] - a[1]) * (x - a[0])
    })
}

/// The westernmost and easternmost x of the part of a line, from its lower to its upper end, between two parallels.
fn extent_between(low: [f64; 2], high: [f64; 2], south: f64, north: f64) -> Option<[f64; 2]> {
    if high[1] < south || north < low[1] {
        return None;
    }
    // Where the line does not rise, both ends lie between the parallels.
    let at = |y: f64| low[0] + (y - low[1]) / (high[1] - low[1]) * (high[0] - low[0]);
    let first = if low[1] < south { at(south) } else { low[0] };
    let last = if north < high[1] { at(north) } else { high[0] };
    Some([first.min(last), first.max(last)])
}
