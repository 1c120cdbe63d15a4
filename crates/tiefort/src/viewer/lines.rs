//! Roads, rails, rivers and streams as the page reads them, to draw each as one ribbon from end to end: the lines of
//! load modules; where these have none, those edges of the TIN that are lines and have no triangles of their own.
//!
//! As bytes, of each edge: row and column of its load module, class (u32 each); width, then east and north from the
//! area's south-west corner and height of both ends (f32 each, metres).

use std::collections::BTreeMap;

use load_module_reader::{Area, AreaFrame, Block, Line, LineKind, LineStorey, QUANTA_PER_METRE, Vertex};
use store::{AreaLevel, FeatureLine};
use terrain::Role;

/// The lines of an area by load module, row and column.
#[derive(Default)]
pub struct Lines(BTreeMap<(u32, u32), Vec<u8>>);

/// The lines of load modules in a block that are drawn: all that is kept, but for tunnels and breaklines.
///
/// # Errors
/// In words, when a load module cannot be read.
pub fn of_modules(area: &Area, block: Block) -> Result<Vec<u8>, String> {
    let ground = area.load(block).map_err(|error| error.to_string())?;
    let is_drawn = |line: &&Line| line.is_kept && line.storey != LineStorey::Tunnel && line.kind != LineKind::Breakline;
    let metres = |quanta: i64| quanta as f64 / f64::from(QUANTA_PER_METRE);
    let mut bytes = Vec::new();
    for module in ground.modules().iter().map(|module| module.module()) {
        let corner = [module.col, module.row].map(|number| f64::from(number) * area.frame().side_m());
        let place = |vertex: &Vertex| {
            [corner[0] + metres(vertex.x.into()), corner[1] + metres(vertex.y.into()), metres(vertex.z.into())]
        };
        for line in module.lines.iter().filter(is_drawn) {
            for ends in line.vertices.windows(2) {
                let words = [module.row, module.col, line.class.into()];
                let numbers = [metres(line.width.into())].into_iter().chain(ends.iter().flat_map(place));
                bytes.extend(words.into_iter().flat_map(u32::to_le_bytes));
                bytes.extend(numbers.flat_map(|number| (number as f32).to_le_bytes()));
            }
        }
    }
    Ok(bytes)
}

impl Lines {
    /// Those of an area that lie in a load module of its frame.
    pub fn of(level: &AreaLevel, frame: &AreaFrame) -> Self {
        let mut lines = Self::default();
        for line in level.lines.iter().filter(|line| matches!(line.role, Role::Centre | Role::Channel)) {
            for ends in line.vertices.windows(2) {
                lines.add(line, [ends[0], ends[1]], frame);
            }
        }
        lines
    }

    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    fn add(&mut self, line: &FeatureLine, ends: [[f64; 3]; 2], frame: &AreaFrame) {
        let away = |axis: usize, place: f64| place - frame.origin_m[axis];
        // An edge crosses no side of a load module, so that its middle says which it lies in.
        let middle = |axis: usize| (away(axis, ends[0][axis]) + away(axis, ends[1][axis])) / 2.0;
        let number = |axis: usize| (middle(axis) / frame.side_m()).floor();
        let (row, col) = (number(1), number(0));
        if row < 0.0 || col < 0.0 || f64::from(frame.rows) <= row || f64::from(frame.cols) <= col {
            return;
        }
        let module = (row as u32, col as u32);
        let words = [module.0, module.1, line.class.into()];
        let metres = ends.into_iter().flat_map(|[east, north, height]| [away(0, east), away(1, north), height]);
        let bytes = self.0.entry(module).or_default();
        bytes.extend(words.into_iter().flat_map(u32::to_le_bytes));
        bytes.extend([line.width_m].into_iter().chain(metres).flat_map(|number| (number as f32).to_le_bytes()));
    }

    /// Those of a block of load modules.
    pub fn bytes(&self, block: Block) -> Vec<u8> {
        let rows = self.0.range((block.south, 0)..(block.north, 0));
        let inside = rows.filter(|((_, col), _)| (block.west..block.east).contains(col));
        inside.flat_map(|(_, bytes)| bytes).copied().collect()
    }
}
