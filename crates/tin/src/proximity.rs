//! The paper's proximity test: no candidate inside the cylinder of a vertex that is already there.

use terrain::geometry::{LocalPost, LocalRect};

use crate::task::Proximity;

/// Vertices by square cells as wide as the cylinder's radius.
pub(crate) struct NearVertices {
    proximity: Proximity,
    cell_posts: i32,
    cells_wide: usize,
    cells: Vec<Vec<(LocalPost, i32)>>,
    /// Cells that hold something, in the order in which they were first filled.
    filled: Vec<usize>,
}

impl NearVertices {
    /// No vertices yet.
    pub fn new(proximity: Proximity, extent: LocalRect) -> Self {
        let cell_posts = (proximity.posts.ceil() as i32).max(1);
        let cells_wide = (extent.east / cell_posts) as usize + 1;
        let cells_high = (extent.north / cell_posts) as usize + 1;
        Self { proximity, cell_posts, cells_wide, cells: vec![Vec::new(); cells_wide * cells_high], filled: Vec::new() }
    }

    fn cell(&self, post: LocalPost) -> (usize, usize) {
        ((post.row() / self.cell_posts) as usize, (post.col() / self.cell_posts) as usize)
    }

    /// Adds a vertex.
    pub fn add(&mut self, post: LocalPost, height: i32) {
        let (row, col) = self.cell(post);
        let index = row * self.cells_wide + col;
        if self.cells[index].is_empty() {
            self.filled.push(index);
        }
        self.cells[index].push((post, height));
    }

    /// Forgets all vertices.
    pub fn clear(&mut self) {
        for index in self.filled.drain(..) {
            self.cells[index].clear();
        }
    }

    /// Whether some vertex is near: within the radius and within the vertical reach, both inclusive.
    pub fn crowd(&self, post: LocalPost, height: i32) -> bool {
        let (row, col) = self.cell(post);
        let rows = self.cells.chunks(self.cells_wide).skip(row.saturating_sub(1)).take(row.min(1) + 2);
        rows.flat_map(|line| line[col.saturating_sub(1)..(col + 2).min(self.cells_wide)].iter().flatten())
            .any(|&(vertex, at)| is_near(self.proximity, (post, height), (vertex, at)))
    }
}

/// Whether two posts with heights lie in each other's cylinder.
pub(crate) fn is_near(proximity: Proximity, a: (LocalPost, i32), b: (LocalPost, i32)) -> bool {
    let (rows, cols) = (i64::from(a.0.row() - b.0.row()), i64::from(a.0.col() - b.0.col()));
    (rows * rows + cols * cols) as f64 <= proximity.posts * proximity.posts && a.1.abs_diff(b.1) <= proximity.quanta
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_bounds_of_the_cylinder_are_inside_it() {
        let proximity = Proximity { posts: 12.0, quanta: 2560 };
        let mut near = NearVertices::new(proximity, LocalRect { south: 0, west: 0, north: 99, east: 99 });
        near.add(LocalPost::new(40, 40), 1000);
        assert!(near.crowd(LocalPost::new(40, 52), 3560));
        assert!(!near.crowd(LocalPost::new(40, 53), 1000));
        assert!(!near.crowd(LocalPost::new(40, 52), 3561));
        assert!(near.crowd(LocalPost::new(28, 40), -1560));
        assert!(!near.crowd(LocalPost::new(32, 32 - 1), 1000));
    }

    #[test]
    fn the_cells_find_what_a_search_of_all_vertices_finds() {
        let proximity = Proximity { posts: 3.5, quanta: 10 };
        let extent = LocalRect { south: 0, west: 0, north: 24, east: 30 };
        let mut near = NearVertices::new(proximity, extent);
        let vertices: Vec<(LocalPost, i32)> =
            (0..12).map(|i| (LocalPost::new(i * 7 % 25, i * 11 % 31), i * 5 % 23)).collect();
        vertices.iter().for_each(|&(post, height)| near.add(post, height));
        for row in 0..25 {
            for col in 0..31 {
                let candidate = (LocalPost::new(row, col), 9);
                let slow = vertices.iter().any(|&vertex| is_near(proximity, candidate, vertex));
                assert_eq!(near.crowd(candidate.0, candidate.1), slow, "{row},{col}");
            }
        }
    }
}
