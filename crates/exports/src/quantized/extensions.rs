//! What a tile of quantized-mesh says beside its triangles: where water is, and which tiles lie below it.

use serde_json::Value;

use super::clip::doubled_area;
use super::lattice::{Node, STEPS};

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
pub(crate) fn put_metadata(bytes: &mut Vec<u8>, metadata: &Value) {
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
