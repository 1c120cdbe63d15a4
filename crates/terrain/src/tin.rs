//! A triangulated irregular network over a rectangle of posts.

use std::collections::HashMap;

use serde::{Deserialize, Serialize};

use crate::{LATTICE_PER_POST, LatticePoint, Post, PostRect};

/// One vertex: a lattice point and its height in quanta of 1/128 m.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct Vertex {
    /// Where it stands.
    pub at: LatticePoint,
    /// Height in quanta.
    pub height: i32,
}

/// A TIN that covers a rectangle of posts exactly once.
///
/// Triangles are counter-clockwise seen from above and name vertices by index.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Tin {
    /// The posts it covers.
    pub rect: PostRect,
    /// Steps between posts of the lattice that places count in: [`LATTICE_PER_POST`], or more where features ask for
    /// them.
    pub steps_per_post: i32,
    /// Vertices, in the order in which they were inserted where that is known.
    pub vertices: Vec<Vertex>,
    /// Corners of each triangle, counter-clockwise.
    pub triangles: Vec<[u32; 3]>,
}

/// Triangles any point adds in all: two inside a load module, or one on each side of a line.
pub const POINT_COST: u32 = 2;

/// What is wrong with a TIN.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum TinFault {
    /// This triangle names a vertex that does not exist.
    NoSuchVertex(usize),
    /// This vertex lies outside the rectangle.
    VertexOutside(usize),
    /// This triangle is clockwise or has no area.
    NotCounterClockwise(usize),
    /// This directed edge belongs to two triangles.
    EdgeUsedTwice([LatticePoint; 2]),
    /// This edge has a triangle on one side only and does not lie on the border.
    Crack([LatticePoint; 2]),
    /// The doubled areas of the triangles add up to the first number, that of the rectangle is the second.
    AreaMissing(i64, i64),
}

impl std::fmt::Display for TinFault {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let place = |at: &LatticePoint| format!("{},{}", at.row, at.col);
        match self {
            Self::NoSuchVertex(triangle) => write!(f, "triangle {triangle} names a vertex that is not there"),
            Self::VertexOutside(vertex) => write!(f, "vertex {vertex} lies outside the tile"),
            Self::NotCounterClockwise(triangle) => write!(f, "triangle {triangle} is clockwise or has no area"),
            Self::EdgeUsedTwice([a, b]) => {
                write!(f, "two triangles lie on one side of the edge {} to {} (row, column)", place(a), place(b))
            }
            Self::Crack([a, b]) => {
                write!(f, "the edge {} to {} (row, column) is not shared by two triangles", place(a), place(b))
            }
            Self::AreaMissing(found, expected) => {
                write!(f, "triangles cover {found} half squares of a step, expected {expected}")
            }
        }
    }
}

impl Tin {
    /// A TIN on the lattice of eighths of a post.
    pub fn new(rect: PostRect, vertices: Vec<Vertex>, triangles: Vec<[u32; 3]>) -> Self {
        Self { rect, steps_per_post: LATTICE_PER_POST, vertices, triangles }
    }

    /// The place of a post on this TIN's lattice.
    pub fn place_of(&self, post: Post) -> LatticePoint {
        LatticePoint::new(post.row * self.steps_per_post, post.col * self.steps_per_post)
    }

    /// The post at a place on this TIN's lattice, if it lies on one.
    pub fn post_at(&self, at: LatticePoint) -> Option<Post> {
        let steps = self.steps_per_post;
        (at.row % steps == 0 && at.col % steps == 0).then(|| Post::new(at.row / steps, at.col / steps))
    }

    /// Doubled area of a triangle in squared lattice steps; positive when counter-clockwise.
    pub(crate) fn doubled_area(&self, triangle: [u32; 3]) -> i64 {
        let [a, b, c] = triangle.map(|v| self.vertices[v as usize].at);
        i64::from(b.col - a.col) * i64::from(c.row - a.row) - i64::from(b.row - a.row) * i64::from(c.col - a.col)
    }

    /// Walks every invariant: indices, orientation, each inner edge shared by two, border edges on the
    /// border, and the area covered exactly once.
    ///
    /// # Errors
    /// The first fault found.
    pub fn check(&self) -> Result<(), TinFault> {
        self.check_vertices()?;
        let area = self.check_triangles()?;
        let cells = (self.rect.cells_wide() * self.rect.cells_high()) as i64;
        let expected = 2 * cells * i64::from(self.steps_per_post * self.steps_per_post);
        if area != expected {
            return Err(TinFault::AreaMissing(area, expected));
        }
        self.check_edges()
    }

    fn check_vertices(&self) -> Result<(), TinFault> {
        let (low, high) = (self.place_of(self.rect.south_west()), self.place_of(self.rect.north_east()));
        let outside = |at: LatticePoint| at.row < low.row || high.row < at.row || at.col < low.col || high.col < at.col;
        match self.vertices.iter().position(|vertex| outside(vertex.at)) {
            Some(vertex) => Err(TinFault::VertexOutside(vertex)),
            None => Ok(()),
        }
    }

    fn check_triangles(&self) -> Result<i64, TinFault> {
        let mut area = 0;
        for (index, &triangle) in self.triangles.iter().enumerate() {
            if triangle.iter().any(|&v| self.vertices.len() <= v as usize) {
                return Err(TinFault::NoSuchVertex(index));
            }
            let doubled = self.doubled_area(triangle);
            if doubled <= 0 {
                return Err(TinFault::NotCounterClockwise(index));
            }
            area += doubled;
        }
        Ok(area)
    }

    fn check_edges(&self) -> Result<(), TinFault> {
        let place = |v: u32| self.vertices[v as usize].at;
        let mut edges = HashMap::new();
        for triangle in &self.triangles {
            for i in 0..3 {
                let (from, to) = (triangle[i], triangle[(i + 1) % 3]);
                if edges.insert((place(from), place(to)), ()).is_some() {
                    return Err(TinFault::EdgeUsedTwice([place(from), place(to)]));
                }
            }
        }
        let mut open: Vec<_> = edges
            .keys()
            .filter(|(from, to)| !edges.contains_key(&(*to, *from)) && !self.on_one_border_line(*from, *to))
            .collect();
        open.sort();
        match open.first() {
            Some(&&(from, to)) => Err(TinFault::Crack([from, to])),
            None => Ok(()),
        }
    }

    fn on_one_border_line(&self, from: LatticePoint, to: LatticePoint) -> bool {
        let (low, high) = (self.place_of(self.rect.south_west()), self.place_of(self.rect.north_east()));
        let same_row = from.row == to.row && (from.row == low.row || from.row == high.row);
        let same_col = from.col == to.col && (from.col == low.col || from.col == high.col);
        same_row || same_col
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square() -> Tin {
        let rect = PostRect::of_size(3, 3);
        let corners = rect.corners().map(|post| Vertex { at: post.into(), height: 0 });
        Tin::new(rect, corners.to_vec(), vec![[0, 1, 2], [0, 2, 3]])
    }

    #[test]
    fn a_square_of_two_triangles_is_sound() {
        assert_eq!(square().check(), Ok(()));
    }

    #[test]
    fn a_missing_triangle_is_found() {
        let mut tin = square();
        tin.triangles.pop();
        assert!(matches!(tin.check(), Err(TinFault::AreaMissing(..))));
    }

    #[test]
    fn a_clockwise_triangle_is_found() {
        let mut tin = square();
        tin.triangles[0] = [0, 2, 1];
        assert_eq!(tin.check(), Err(TinFault::NotCounterClockwise(0)));
    }

    #[test]
    fn a_vertex_inside_a_neighbours_edge_is_a_crack() {
        let mut tin = square();
        tin.vertices.push(Vertex { at: Post::new(1, 1).into(), height: 0 });
        tin.triangles = vec![[0, 1, 4], [1, 2, 4], [0, 2, 3]];
        assert!(matches!(tin.check(), Err(TinFault::Crack(_))));
    }
}
