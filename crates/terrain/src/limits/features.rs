//! What features cost: counted from their vertices alone, exactly, whatever else a TIN holds.
//!
//! Triangles = 2 V + B - 2 in each load module, so a vertex inside adds two and one on a side adds one, and edges add
//! nothing. Corners of load modules are there from the start, and so may posts of the outer border be.

use std::collections::BTreeMap;

use crate::{Features, LatticePoint, ModuleGrid, ModuleId, ModuleRect, POINT_COST, Post};

use crate::limits::{Allowance, Charged, ModuleLines, ShortOf, Shortfall};

/// Triangles that features add to each load module, by load module.
pub type FeatureCost = BTreeMap<ModuleId, u32>;

/// What features cost in the load modules of `grid`; what lies outside of it costs nothing. `border` are the posts that
/// the outer border starts with, in ascending order: a vertex on one of them costs nothing more.
pub fn feature_cost(features: &Features, grid: ModuleGrid, border: &[Post]) -> FeatureCost {
    let steps = features.steps_per_post;
    let south_west = ModuleId { row: 0, col: 0 };
    let side = grid.side_cells * steps;
    let lines = ModuleLines { side, south_west, rows: grid.rows, cols: grid.cols, reach: grid.all() };
    let is_there = |at: LatticePoint| {
        let is_post = at.row % steps == 0 && at.col % steps == 0;
        is_post && border.binary_search(&Post::new(at.row / steps, at.col / steps)).is_ok()
    };
    let mut cost = FeatureCost::new();
    let mut add = |module: ModuleId, triangles: u32| *cost.entry(module).or_insert(0) += triangles;
    let within = |steps: i32, count: u32| (0..=i64::from(side) * i64::from(count)).contains(&i64::from(steps));
    let costs = |at: &LatticePoint| within(at.row, grid.rows) && within(at.col, grid.cols) && !is_there(*at);
    for at in features.vertices.iter().map(|vertex| vertex.at).filter(costs) {
        match lines.charged(at.row, at.col) {
            Some(Charged::Inside(module)) => add(module, POINT_COST),
            Some(Charged::Between(first, second)) => [first, second].into_iter().for_each(|module| add(module, 1)),
            Some(Charged::Beside(module)) => add(module, 1),
            None => {}
        }
    }
    cost
}

impl Allowance {
    /// Takes out what features cost in the load modules `own` of the tile; each load module is paid for by the tile it
    /// lies in. Returns what does not suffice: there, nothing is left.
    pub fn take_features(&mut self, own: ModuleRect, cost: &FeatureCost) -> Vec<Shortfall> {
        let mut short = Vec::new();
        let mut take = |room: &mut u32, of: ShortOf, needed: u32| {
            if *room < needed {
                short.push(Shortfall { of, needed, room: *room });
            }
            *room = room.saturating_sub(needed);
        };
        let of = |modules: ModuleRect| -> u32 {
            let inside = cost.iter().filter(|(module, _)| own.contains(**module) && modules.contains(**module));
            inside.map(|(_, triangles)| triangles).sum()
        };
        for (module, room) in self.modules.iter().zip(&mut self.module_room) {
            let triangles = cost.get(&module).filter(|_| own.contains(module));
            take(room, ShortOf::Module(module), triangles.copied().unwrap_or(0));
        }
        let (rows, cols) = self.window_size;
        for (window, room) in self.windows.iter().zip(&mut self.window_room) {
            let ModuleId { row, col } = window;
            let modules = ModuleRect { south: row, west: col, north: row + rows, east: col + cols };
            take(room, ShortOf::Window(window), of(modules));
        }
        take(&mut self.triangles, ShortOf::Tile, of(own));
        short
    }
}

#[cfg(test)]
mod tests {
    use crate::Vertex;

    use super::*;
    use crate::limits::Windows;

    const GRID: ModuleGrid = ModuleGrid { rows: 3, cols: 4, side_cells: 20 };

    fn features(places: &[(i32, i32)]) -> Features {
        let vertex = |&(row, col): &(i32, i32)| Vertex { at: LatticePoint::new(row, col), height: 0 };
        let vertices = places.iter().map(vertex).collect();
        Features { steps_per_post: 64, vertices, ..Features::default() }
    }

    #[test]
    fn a_vertex_costs_what_it_adds_by_euler() {
        let side = 20 * 64;
        let places = [(5, 7), (side, 9), (9, 2 * side), (0, 64), (0, 128), (side, side)];
        let cost = feature_cost(&features(&places), GRID, &[Post::new(0, 2)]);
        let of = |row, col| cost.get(&ModuleId { row, col }).copied();
        // Inside, on the line to the north, on the outer border; the second of these is there anyway.
        assert_eq!((of(0, 0), of(1, 0)), (Some(2 + 1 + 1), Some(1)));
        assert_eq!((of(0, 1), of(0, 2), of(1, 1)), (Some(1), Some(1), None));
    }

    #[test]
    fn a_vertex_beyond_the_area_costs_nothing() {
        let side = 20 * 64;
        let beyond = [(-5, 7), (9, -1), (-side - 3, -side - 3), (3 * side + 1, 7), (7, 4 * side + 1), (-side, 7)];
        assert_eq!(feature_cost(&features(&beyond), GRID, &[]), FeatureCost::new());
    }

    #[test]
    fn what_does_not_suffice_is_told_and_never_exceeded() {
        let own = ModuleRect { south: 0, west: 0, north: 2, east: 2 };
        let windows = Windows::new(GRID, 2);
        let touching = windows.touching(own);
        let mut allowance = Allowance {
            modules: ModuleRect { south: 0, west: 0, north: 3, east: 3 },
            module_room: vec![5; 9],
            windows: touching,
            window_size: (windows.rows, windows.cols),
            window_room: vec![7; touching.count()],
            triangles: 100,
        };
        let module = |row, col| ModuleId { row, col };
        let cost = FeatureCost::from([(module(0, 0), 6), (module(1, 1), 2), (module(0, 2), 50)]);
        let short = allowance.take_features(own, &cost);
        let found: Vec<_> = short.iter().map(|short| (short.of, short.needed, short.room)).collect();
        assert_eq!(found, [(ShortOf::Module(module(0, 0)), 6, 5), (ShortOf::Window(module(0, 0)), 8, 7)]);
        // Another tile pays for (0, 2).
        assert_eq!(allowance.module_room, [0, 5, 5, 5, 3, 5, 5, 5, 5]);
        assert_eq!(allowance.triangles, 92);
    }
}
