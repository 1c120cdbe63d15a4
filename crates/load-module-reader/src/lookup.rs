//! Which triangle of a load module lies under a place, in constant expected time.
//!
//! A grid of square cells lies over the load module, about as many as triangles. Each names the triangles that touch
//! it, those that cover most of it first, so that a query seldom looks at more than two. Grid and corners of triangles
//! lie in one run of memory, of about two kilobytes for a hundred polygons: queries at random places wait for memory
//! most of the time, and the smaller what they read is, the more of it stays in the processor's cache. A place is first
//! rounded to 1/4096 of a quantum (2 micrometres), after which left or right of an edge is a question about whole
//! numbers: some triangle always holds the place, on edges and corners too.
//!
//! Objects of a load module that may lie along a line are found by cells, too.

use std::sync::Arc;

use crate::{Canopy, Objects, QUANTA_PER_METRE, Vertex};

/// Steps of a rounded place to a quantum, as a power of two.
const STEP_BITS: u32 = 12;
/// Steps of a rounded place to a quantum.
pub(crate) const STEPS: i64 = 1 << STEP_BITS;
/// Cells for each triangle: more take more memory, fewer take more tests.
const CELLS_PER_TRIANGLE: f64 = 1.5;
/// Most cells along a side.
const CELLS_MAX: u32 = 128;
/// Cells that the rectangles around all triangles may touch at most, for each triangle. Terrain takes about fifteen; a
/// file of splinters across the whole square would take thousands, and with them gigabytes and minutes.
const TOUCHED_PER_TRIANGLE_MAX: u64 = 64;
/// How much further than its lines a cell reaches, in quanta: a place on a line may be rounded to either side of it.
const REACH: f64 = 2.0;
/// Words of a cell: where the list of its other triangles begins, or 0; then the first triangles, two in a word.
const CELL: usize = 4;
/// Triangles in a cell.
const FIRST: usize = 2 * (CELL - 1);
/// No triangle.
const NONE: u32 = 0xffff;
/// Words of a triangle: x and y in one, z in the next, for each corner.
const TRIANGLE: usize = 6;

/// What finds the triangles of one load module. A clone shares it.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Lookup {
    /// Cells, row by row from the south-west; triangles; lists, each its length and then triangles.
    words: Arc<[u32]>,
    /// Cells along a side.
    across: u32,
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

/// A triangle over a cell, while lists are made.
#[derive(Clone, Copy)]
struct Touch {
    cell: u32,
    triangle: u32,
    /// Grows with the part of the cell that it covers: how far it reaches beyond the middle, 1 where it covers all.
    cover: f32,
}

impl Lookup {
    pub(crate) fn new(mesh: Mesh, side: u16) -> Self {
        let cells = CELLS_PER_TRIANGLE * mesh.triangles.len() as f64;
        let mut lookup = Self::of_cells(cells.sqrt().ceil().clamp(1.0, f64::from(CELLS_MAX)) as u32, side);
        let most = TOUCHED_PER_TRIANGLE_MAX * mesh.triangles.len() as u64;
        while 1 < lookup.across && most < lookup.touched_at_most(mesh) {
            lookup = Self::of_cells(lookup.across / 2, side);
        }
        let mut touches = Vec::new();
        for (index, triangle) in (0..).zip(mesh.triangles) {
            lookup.touch(side, index, &corners_of(mesh, *triangle), &mut touches);
        }
        lookup.words = lookup.words_of(mesh, &touches).into();
        lookup
    }

    /// No lists yet.
    fn of_cells(across: u32, side: u16) -> Self {
        Self { words: Arc::new([]), across, scale: (u64::from(across) << 32) / u64::from(side).max(1) }
    }

    fn cell_count(&self) -> usize {
        (self.across * self.across) as usize
    }

    /// Cells that the rectangles around all triangles touch.
    fn touched_at_most(&self, mesh: Mesh) -> u64 {
        let touched = |triangle: &[u16; 3]| {
            let [[west, east], [south, north]] = self.cells_around(&corners_of(mesh, *triangle));
            u64::from(east - west + 1) * u64::from(north - south + 1)
        };
        mesh.triangles.iter().map(touched).sum()
    }

    /// First and last column, first and last row of the cells that the rectangle around a triangle may touch.
    fn cells_around(&self, corners: &Corners) -> [[u32; 2]; 2] {
        [0, 1].map(|axis| {
            let values = || corners.iter().map(|corner| corner[axis]);
            let low = (values().min().unwrap_or(0) - 1).max(0);
            [self.row(low), self.row(values().max().unwrap_or(0) + 1)]
        })
    }

    /// Adds every cell that a triangle may touch.
    fn touch(&self, side: u16, triangle: u32, corners: &Corners, touches: &mut Vec<Touch>) {
        let [[west, east], [south, north]] = self.cells_around(corners);
        let wide = f64::from(side) / f64::from(self.across);
        let middle = |row: u32| (f64::from(row) + 0.5) * wide;
        // How far left of each edge the middle of the south-western cell lies, in units of what a cell reaches to
        // either side of its middle; and how much further each cell to the east and to the north.
        let edges = [0, 1, 2].map(|i| {
            let [a, b] = [corners[i], corners[(i + 1) % 3]].map(|[x, y, _]| [f64::from(x), f64::from(y)]);
            let along = [b[0] - a[0], b[1] - a[1]];
            let unit = 1.0 / ((wide / 2.0 + REACH) * (along[0].abs() + along[1].abs()));
            let left = along[0] * (middle(south) - a[1]) - along[1] * (middle(west) - a[0]);
            [left * unit, -along[1] * wide * unit, along[0] * wide * unit]
        });
        for row in south..=north {
            for col in west..=east {
                let (right, up) = (f64::from(col - west), f64::from(row - south));
                let reaches = edges.map(|[left, eastwards, northwards]| left + right * eastwards + up * northwards);
                let least = reaches[0].min(reaches[1]).min(reaches[2]);
                // Rounding is far smaller than what a cell reaches beyond its lines.
                if -1.0 <= least {
                    touches.push(Touch { cell: row * self.across + col, triangle, cover: least.min(1.0) as f32 });
                }
            }
        }
    }

    /// Cells, triangles and lists.
    fn words_of(&self, mesh: Mesh, touches: &[Touch]) -> Vec<u32> {
        let count = self.cell_count();
        let mut words = vec![0; CELL * count];
        words.reserve_exact(TRIANGLE * mesh.triangles.len() + touches.len());
        for &triangle in mesh.triangles {
            let corners = corners_of(mesh, triangle);
            words.extend(corners.iter().flat_map(|[x, y, z]| [*x as u32 | (*y as u32) << 16, z.cast_unsigned()]));
        }
        let (touches, ends) = by_cell(touches, count);
        let mut start = 0;
        for (cell, end) in ends.into_iter().enumerate() {
            let over_cell = &touches[start..end as usize];
            start = end as usize;
            let fit = over_cell.iter().take(FIRST).take_while(|touch| touch.triangle < NONE).count();
            for (word, pair) in (CELL * cell + 1..).zip(over_cell[..fit].chunks(2)) {
                words[word] = pair[0].triangle | pair[pair.len() - 1].triangle << 16;
            }
            words[CELL * cell + 1 + fit.div_ceil(2)..CELL * (cell + 1)].fill(NONE | NONE << 16);
            if fit < over_cell.len() {
                words[CELL * cell] = words.len() as u32;
                words.push((over_cell.len() - fit) as u32);
                words.extend(over_cell[fit..].iter().map(|touch| touch.triangle));
            }
        }
        words
    }

    /// Cells along a side.
    pub(crate) fn across(&self) -> u32 {
        self.across
    }

    /// Of each cell, row by row, the largest of what `height` gives for the triangles that touch it.
    pub(crate) fn tops(&self, height: impl Fn(Corners) -> i32) -> Vec<i32> {
        let cells = (0..self.across).flat_map(|row| (0..self.across).map(move |col| (row, col)));
        let highest =
            |(row, col)| self.triangles_of(self.cell_at(row, col)).map(|index| height(self.corners(index))).max();
        cells.map(|cell| highest(cell).unwrap_or(i32::MIN)).collect()
    }

    /// A row or column of cells: its lines in quanta, and a little more.
    pub(crate) fn lines_of(&self, row: u32, side: u16) -> [f64; 2] {
        self.lines(row, side)
    }

    /// Bytes in memory.
    #[cfg(test)]
    pub(crate) fn byte_count(&self) -> usize {
        size_of_val(&*self.words)
    }

    /// The row or column of a coordinate in quanta.
    #[inline]
    fn row(&self, quanta: i32) -> u32 {
        (((quanta as u64) * self.scale) >> 32).min(u64::from(self.across - 1)) as u32
    }

    /// A row or column of cells: its lines in quanta, and a little more.
    fn lines(&self, row: u32, side: u16) -> [f64; 2] {
        let line = |row: u32| f64::from(row) * f64::from(side) / f64::from(self.across);
        [line(row) - REACH, line(row + 1) + REACH]
    }

    /// The cell at a place in steps inside the square.
    #[inline]
    pub(crate) fn cell(&self, [x, y]: [i64; 2]) -> &[u32; CELL] {
        self.cell_at(self.row((y >> STEP_BITS) as i32), self.row((x >> STEP_BITS) as i32))
    }

    #[inline]
    fn cell_at(&self, row: u32, col: u32) -> &[u32; CELL] {
        &self.words.as_chunks().0[(row * self.across + col) as usize]
    }

    /// The triangles of a cell, those that cover most of it first.
    #[inline]
    fn triangles_of(&self, cell: &[u32; CELL]) -> impl Iterator<Item = usize> {
        let pairs = cell[1..].iter().map(|pair| [pair & NONE, pair >> 16]).take_while(|pair| pair[0] != NONE);
        // A pair of one triangle names it twice.
        let first = pairs.flat_map(|[a, b]| [Some(a), (a != b).then_some(b)]).flatten().map(|index| index as usize);
        let list = match cell[0] as usize {
            0 => &[],
            list => &self.words[list + 1..][..self.words[list] as usize],
        };
        first.chain(list.iter().map(|&index| index as usize))
    }

    /// A word of the first triangle of a cell: reading it asks for the memory.
    #[inline]
    pub(crate) fn first_word(&self, cell: &[u32; CELL]) -> u32 {
        let at = CELL * self.cell_count() + TRIANGLE * (cell[1] & NONE) as usize;
        self.words.get(at).copied().unwrap_or(0)
    }

    /// Corners of a triangle.
    #[inline]
    fn corners(&self, index: usize) -> Corners {
        let words = &self.words[CELL * self.cell_count() + TRIANGLE * index..][..TRIANGLE];
        [0, 2, 4].map(|at| [(words[at] & 0xffff) as i32, (words[at] >> 16) as i32, words[at + 1].cast_signed()])
    }

    /// Corners of a triangle, and how much of it lies opposite each, seen from a place in steps: nothing is negative
    /// where it holds the place.
    #[inline]
    fn shares(&self, index: usize, [x, y]: [i64; 2]) -> (Corners, [i64; 3]) {
        let corners = self.corners(index);
        let to = corners.map(|[cx, cy, _]| [(i64::from(cx) << STEP_BITS) - x, (i64::from(cy) << STEP_BITS) - y]);
        // Sides are at most 2^28 steps, so products stay below 2^57.
        let cross = |a: [i64; 2], b: [i64; 2]| a[0] * b[1] - a[1] * b[0];
        (corners, [cross(to[1], to[2]), cross(to[2], to[0]), cross(to[0], to[1])])
    }

    /// Every triangle at a place in steps, where they may lie above each other: its corners, the height there in
    /// metres, and where it stands in the load module.
    pub(crate) fn triangles(&self, place: [i64; 2]) -> impl Iterator<Item = (Corners, f64, usize)> {
        self.triangles_of(self.cell(place)).filter_map(move |index| {
            let (corners, shares) = self.shares(index, place);
            holds(shares).then(|| (corners, height_m(&corners, shares), index))
        })
    }

    /// Corners of the triangle at a place in steps, the height there in metres, and where it stands in the load module.
    pub(crate) fn triangle(&self, place: [i64; 2]) -> Option<(Corners, f64, usize)> {
        self.triangles(place).next()
    }

    /// Height at a place in steps, metres.
    #[inline]
    pub(crate) fn height_m(&self, place: [i64; 2]) -> Option<f64> {
        self.height_in(self.cell(place), place)
    }

    /// The same, where the cell is known.
    #[inline]
    pub(crate) fn height_in(&self, cell: &[u32; CELL], place: [i64; 2]) -> Option<f64> {
        for &pair in &cell[1..] {
            let [first, second] = [pair & NONE, pair >> 16];
            if first == NONE {
                break;
            }
            // Both are tested before a branch: a wrong guess of the processor costs more than the second test.
            let (of_first, of_second) = (self.shares(first as usize, place), self.shares(second as usize, place));
            let in_first = holds(of_first.1);
            if in_first | holds(of_second.1) {
                let (corners, shares) = if in_first { of_first } else { of_second };
                return Some(height_m(&corners, shares));
            }
        }
        self.height_in_list(cell, place)
    }

    /// The same, where the first triangles of the cell do not hold the place.
    #[cold]
    fn height_in_list(&self, cell: &[u32; CELL], place: [i64; 2]) -> Option<f64> {
        let held = self.triangles_of(cell).map(|index| self.shares(index, place)).find(|(_, shares)| holds(*shares));
        held.map(|(corners, shares)| height_m(&corners, shares))
    }

    /// Calls `each` with every triangle that may touch a rectangle between two corners in quanta, with some more than
    /// once.
    pub(crate) fn triangles_within(&self, side: u16, rectangle: [[f64; 2]; 2], mut each: impl FnMut(Corners)) {
        for [row, col] in self.cells_within(side, rectangle) {
            self.triangles_of(self.cell_at(row, col)).for_each(|index| each(self.corners(index)));
        }
    }

    /// Row and column of each cell that a rectangle between two corners in quanta touches.
    pub(crate) fn cells_within(&self, side: u16, [low, high]: [[f64; 2]; 2]) -> impl Iterator<Item = [u32; 2]> {
        let row_at = |quanta: f64| self.row(quanta.clamp(0.0, f64::from(side)) as i32);
        let [rows, cols] = [1, 0].map(|axis| row_at(low[axis])..=row_at(high[axis]));
        rows.flat_map(move |row| cols.clone().map(move |col| [row, col]))
    }

    /// Calls `each` with every triangle that a line between two places in quanta may touch, with some more than once.
    /// Places may lie outside.
    pub(crate) fn triangles_along(&self, side: u16, from: [f64; 2], to: [f64; 2], each: impl FnMut(Corners)) {
        self.triangles_along_in(side, from, to, |_, _| true, each);
    }

    /// The same of the cells, by row and column, that are `wanted`.
    pub(crate) fn triangles_along_in(
        &self,
        side: u16,
        from: [f64; 2],
        to: [f64; 2],
        wanted: impl Fn(u32, u32) -> bool,
        mut each: impl FnMut(Corners),
    ) {
        let (low, high) = if from[1] <= to[1] { (from, to) } else { (to, from) };
        let row_at = |quanta: f64| self.row(quanta.clamp(0.0, f64::from(side)) as i32);
        for row in row_at(low[1])..=row_at(high[1]) {
            let [south, north] = self.lines(row, side);
            let Some([west, east]) = extent_between(low, high, south, north) else { continue };
            if east < 0.0 || f64::from(side) < west {
                continue;
            }
            // Rounding may put the line into the next cell: look a little further.
            for col in row_at(west - 1.0)..=row_at(east + 1.0) {
                if !wanted(row, col) {
                    continue;
                }
                self.triangles_of(self.cell_at(row, col)).for_each(|index| each(self.corners(index)));
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

/// Whether a triangle with such shares holds the place: one question, so that there is one branch.
#[inline]
fn holds(shares: [i64; 3]) -> bool {
    0 <= shares[0] | shares[1] | shares[2]
}

#[inline]
fn height_m(corners: &Corners, shares: [i64; 3]) -> f64 {
    let [a, b, c] = shares.map(|share| share as f64);
    let heights = corners.map(|corner| f64::from(corner[2]));
    let up = b * (heights[1] - heights[0]) + c * (heights[2] - heights[0]);
    (heights[0] + up / (a + b + c)) / f64::from(QUANTA_PER_METRE)
}

/// Touches cell by cell, those that cover most of a cell first, and where those of each cell end.
fn by_cell(touches: &[Touch], cell_count: usize) -> (Vec<Touch>, Vec<u32>) {
    let mut ends = vec![0; cell_count + 1];
    for touch in touches {
        ends[touch.cell as usize + 1] += 1;
    }
    for cell in 1..=cell_count {
        ends[cell] += ends[cell - 1];
    }
    let mut sorted = vec![Touch { cell: 0, triangle: 0, cover: 0.0 }; touches.len()];
    for touch in touches {
        let next = &mut ends[touch.cell as usize];
        sorted[*next as usize] = *touch;
        *next += 1;
    }
    // Each has become where its cell ends.
    ends.pop();
    let mut start = 0;
    for &end in &ends {
        sorted[start as usize..end as usize].sort_by(|a, b| b.cover.total_cmp(&a.cover));
        start = end;
    }
    (sorted, ends)
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

/// What finds the objects of a load module.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct ObjectLookups {
    /// Of the rectangles around prisms, which are numbered by the third coordinate.
    pub prisms: Option<Lookup>,
    /// Of the triangles of canopies, numbered likewise.
    pub canopies: Vec<Lookup>,
}

/// Places of canopies that one lookup finds, unless one canopy has more.
const PLACES_AT_ONCE: usize = 16_384;

impl ObjectLookups {
    pub(crate) fn of(objects: &Objects, side: u16) -> Self {
        let mut vertices = Vec::new();
        for (number, prism) in (0..).zip(&objects.prisms) {
            let corners = || prism.rings[0].iter();
            let [west, east] =
                [corners().map(|c| c.x).min(), corners().map(|c| c.x).max()].map(Option::unwrap_or_default);
            let [south, north] =
                [corners().map(|c| c.y).min(), corners().map(|c| c.y).max()].map(Option::unwrap_or_default);
            let places = [[west, south], [east, south], [east, north], [west, north]];
            vertices.extend(places.map(|[x, y]| Vertex { x, y, z: number }));
        }
        let first = (0..objects.prisms.len()).map(|number| 4 * number as u16);
        let triangles: Vec<[u16; 3]> = first.flat_map(|at| [[at, at + 1, at + 2], [at, at + 2, at + 3]]).collect();
        let mesh = Mesh { vertices: &vertices, triangles: &triangles };
        let prisms = (!triangles.is_empty()).then(|| Lookup::new(mesh, side));
        Self { prisms, canopies: canopy_lookups(&objects.canopies, side) }
    }
}

fn canopy_lookups(canopies: &[Canopy], side: u16) -> Vec<Lookup> {
    let mut lookups = Vec::new();
    let (mut vertices, mut triangles) = (Vec::new(), Vec::new());
    for (number, canopy) in (0..).zip(canopies) {
        if !vertices.is_empty() && PLACES_AT_ONCE < vertices.len() + canopy.places.len() {
            lookups.push(Lookup::new(Mesh { vertices: &vertices, triangles: &triangles }, side));
            (vertices, triangles) = (Vec::new(), Vec::new());
        }
        let first = vertices.len() as u16;
        vertices.extend(canopy.places.iter().map(|&[x, y]| Vertex { x, y, z: number }));
        triangles.extend(canopy.triangles.iter().map(|triangle| triangle.map(|index| first + index)));
    }
    if !triangles.is_empty() {
        lookups.push(Lookup::new(Mesh { vertices: &vertices, triangles: &triangles }, side));
    }
    lookups
}
