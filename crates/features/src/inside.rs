//! Which edges of lines lie inside strips that keep their place against them.

use std::collections::HashMap;

use crate::Place;
use crate::rings::encloses;
use crate::strand::{Role, Strand};

/// Which places lie in which strips, after rounding.
pub(crate) struct Inside {
    /// Rings in half steps, with their class and the number of their line.
    rings: Vec<(Vec<Place>, u16, usize)>,
    /// Rings by cells of the plane.
    cells: HashMap<(i32, i32), Vec<u32>>,
    /// The edges of rings with the ring that each belongs to, sorted.
    own: Vec<((Place, Place), u32)>,
    /// What each line is: its class and whether it is an outline.
    lines: Vec<(u16, bool)>,
}

/// Half steps of a cell's side.
const CELL: i32 = 256;

/// Lines whose edges a worker looks at in one piece.
pub(crate) const LINES_AT_ONCE: usize = 1024;

impl Inside {
    /// Outlines of strips among all lines, after they were rounded together.
    pub fn new(lines: &[Strand], rounded: &[Vec<Place>]) -> Self {
        // A toe lies in no strip, whatever their classes.
        let class = |line: &Strand| if line.role == Role::Toe { u16::MAX } else { line.class };
        let of_line = |line: &Strand| (class(line), line.role == Role::Side);
        let mut inside = Self {
            rings: Vec::new(),
            cells: HashMap::new(),
            own: Vec::new(),
            lines: lines.iter().map(of_line).collect(),
        };
        for (number, (line, places)) in lines.iter().zip(rounded).enumerate() {
            if line.role != Role::Side {
                continue;
            }
            let ring = inside.rings.len() as u32;
            for ends in places.windows(2) {
                inside.own.push(((ends[0].min(ends[1]), ends[0].max(ends[1])), ring));
            }
            let doubled: Vec<Place> =
                places[1..].iter().map(|place| Place::new(2 * place.row, 2 * place.col)).collect();
            let span = |of: fn(&Place) -> i32| {
                let (low, high) = (doubled.iter().map(of).min(), doubled.iter().map(of).max());
                low.unwrap_or(0).div_euclid(CELL)..=high.unwrap_or(0).div_euclid(CELL)
            };
            for row in span(|place| place.row) {
                for col in span(|place| place.col) {
                    inside.cells.entry((row, col)).or_default().push(ring);
                }
            }
            inside.rings.push((doubled, line.class, number));
        }
        inside.own.sort_unstable();
        inside
    }

    /// Of each edge of the lines of a piece whether it lies inside a strip that keeps its place against it.
    pub fn covered(&self, piece: usize, rounded: &[Vec<Place>]) -> Vec<bool> {
        let lines = (0..).zip(rounded).skip(piece * LINES_AT_ONCE).take(LINES_AT_ONCE);
        lines
            .flat_map(|(line, places)| places.windows(2).map(move |ends| self.covers(line, ends[0], ends[1])))
            .collect()
    }

    /// Whether an edge of a line lies inside a strip that keeps its place against it.
    fn covers(&self, line: usize, a: Place, b: Place) -> bool {
        let middle = Place::new(a.row + b.row, a.col + b.col);
        let Some(near) = self.cells.get(&(middle.row.div_euclid(CELL), middle.col.div_euclid(CELL))) else {
            return false;
        };
        let is_own = |ring: u32| self.own.binary_search(&((a.min(b), a.max(b)), ring)).is_ok();
        let (class, is_side) = self.lines[line];
        near.iter().any(|ring| {
            let (places, ring_class, ring_line) = &self.rings[*ring as usize];
            let keeps = *ring_class < class || (*ring_class == class && (!is_side || *ring_line < line));
            keeps && encloses(places, middle) && !is_own(*ring)
        })
    }
}
