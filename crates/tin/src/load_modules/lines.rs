//! Cuts the middle lines of ways into the squares of load modules.

use terrain::{ModuleLine, ModuleVertex, Vertex, WayLine};

use crate::load_modules::Layout;

/// The lines in each load module of a tile, row by row, in canonical order; `steps_per_post` is the lattice their
/// vertices stand on. What runs along a line between load modules is in the one north or east of it, at the area's
/// border in the one there is.
///
/// # Panics
/// When a line crosses one between load modules and has no vertex there.
pub fn cut_lines(lines: &[WayLine], steps_per_post: i32, layout: &Layout) -> Vec<Vec<ModuleLine>> {
    let step = i64::from(layout.spacing.quanta_per_post() / steps_per_post);
    let mut modules = vec![Vec::new(); layout.modules.count()];
    for line in lines {
        let mut from = 0;
        let squares: Vec<(i64, i64)> =
            line.vertices.windows(2).map(|ends| square_of([ends[0], ends[1]], step, layout)).collect();
        for same in squares.chunk_by(|a, b| a == b) {
            let to = from + same.len();
            let (row, col) = same[0];
            if let Some(slot) = layout.slot(row as i32, col as i32) {
                let vertices = line.vertices[from..=to].iter().map(|&vertex| local(vertex, same[0], step, layout));
                modules[slot].push(line.traits.line(line.class, vertices.collect()));
            }
            from = to;
        }
    }
    for lines in &mut modules {
        lines.sort();
        lines.dedup();
    }
    modules
}

/// Row and column of the square that holds a piece of a line.
fn square_of(ends: [Vertex; 2], step: i64, layout: &Layout) -> (i64, i64) {
    let doubled = 2 * i64::from(layout.side());
    let number = |sum: i32, count: u32| {
        let at = i64::from(sum) * step;
        // A piece along the far border of the area has no square beyond it.
        let is_last = at == doubled * i64::from(count);
        at.div_euclid(doubled) - i64::from(is_last)
    };
    let [a, b] = ends.map(|vertex| vertex.at);
    (number(a.row + b.row, layout.grid.rows), number(a.col + b.col, layout.grid.cols))
}

/// A vertex as the square at a row and a column has it.
fn local(vertex: Vertex, (row, col): (i64, i64), step: i64, layout: &Layout) -> ModuleVertex {
    let side = i64::from(layout.side());
    let within = |at: i32, number: i64| {
        let away = i64::from(at) * step - number * side;
        assert!((0..=side).contains(&away), "a line has a vertex wherever it crosses one between load modules");
        away as u16
    };
    ModuleVertex { y: within(vertex.at.row, row), x: within(vertex.at.col, col), z: vertex.height }
}

#[cfg(test)]
mod tests {
    use super::*;
    use terrain::{LatticePoint, LineForm, LineKind, LineStorey, LineTraits, ModuleGrid, ModuleRect, Spacing};

    /// Two load modules side by side of 500 m, posts of 25 m, 64 steps a post.
    fn layout(modules: ModuleRect) -> Layout {
        let spacing = Spacing::from_metres(25.0).unwrap();
        Layout { grid: ModuleGrid { rows: 1, cols: 2, side_cells: 20 }, modules, spacing }
    }

    const BOTH: ModuleRect = ModuleRect { south: 0, west: 0, north: 1, east: 2 };
    const SIDE: i32 = 20 * 64;

    fn line(places: &[(i32, i32)]) -> WayLine {
        let traits = LineTraits {
            kind: LineKind::Travelled,
            form: LineForm::Line,
            storey: LineStorey::Ground,
            is_kept: true,
            is_in_ground: true,
            width: 384,
        };
        let vertex = |&(row, col): &(i32, i32)| Vertex { at: LatticePoint::new(row, col), height: row + col };
        WayLine { class: 2, traits, vertices: places.iter().map(vertex).collect() }
    }

    #[test]
    fn both_load_modules_of_a_line_have_its_vertex_there() {
        let cut = cut_lines(&[line(&[(64, 64), (64, SIDE), (128, SIDE + 64)])], 64, &layout(BOTH));
        assert_eq!(cut.iter().map(Vec::len).collect::<Vec<_>>(), [1, 1]);
        let (end, start) = (cut[0][0].vertices[1], cut[1][0].vertices[0]);
        assert_eq!((end.x, start.x), (64_000, 0));
        assert_eq!((end.y, end.z), (start.y, start.z));
    }

    #[test]
    fn a_line_along_the_border_of_the_area_is_in_the_load_module_there_is() {
        let along = line(&[(SIDE, 0), (SIDE, 64), (SIDE, SIDE), (SIDE, 2 * SIDE)]);
        let beyond = line(&[(-64, 0), (0, 0)]);
        let cut = cut_lines(&[along.clone(), beyond, along], 64, &layout(BOTH));
        assert_eq!(cut.iter().map(Vec::len).collect::<Vec<_>>(), [1, 1]);
        assert_eq!(cut[0][0].vertices.len(), 3);
        let east = ModuleRect { west: 1, ..BOTH };
        assert_eq!(cut_lines(&[line(&[(9, 9), (9, SIDE), (9, SIDE + 9)])], 64, &layout(east))[0][0].vertices[1].x, 450);
    }
}
