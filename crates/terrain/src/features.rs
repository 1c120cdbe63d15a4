//! What roads, rivers and shores put into the TIN of a tile: vertices that stay where they are, edges between them.

use serde::{Deserialize, Serialize};

use crate::{LATTICE_PER_POST, LatticePoint, Post, PostRect, Side, Vertex};

/// The finest lattice that vertices of features stand on has this many steps between posts.
pub const FEATURE_STEPS_MAX: i32 = 64;

/// Vertices and edges that a TIN has to keep.
///
/// No two edges cross, none runs through a vertex or through a tile or load-module line between its ends; two
/// vertices never share a place.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Features {
    /// Steps between posts of the lattice that the vertices stand on: a power of two from [`LATTICE_PER_POST`] to
    /// [`FEATURE_STEPS_MAX`].
    pub steps_per_post: i32,
    /// The vertices: their places in steps from the area's south-west post, their heights in quanta.
    pub vertices: Vec<Vertex>,
    /// Edges between them.
    pub edges: Vec<[u32; 2]>,
    /// Stretches of the tile's sides on which no border point may stand.
    pub spans: Vec<SideSpan>,
}

/// A stretch of a tile's side between two vertices of features, both included: the width of a road that crosses it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct SideSpan {
    /// Which side.
    pub side: Side,
    /// Where it begins: steps from the area's south-west post, along the side.
    pub from: i32,
    /// Where it ends.
    pub to: i32,
}

impl Default for Features {
    fn default() -> Self {
        Self { steps_per_post: LATTICE_PER_POST, vertices: Vec::new(), edges: Vec::new(), spans: Vec::new() }
    }
}

impl Features {
    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.vertices.is_empty() && self.spans.is_empty()
    }

    /// Whether a vertex stands on a post.
    pub fn has_post(&self, post: Post) -> bool {
        let at = LatticePoint::new(post.row * self.steps_per_post, post.col * self.steps_per_post);
        // In canonical order, as tiles have them.
        self.vertices.binary_search_by_key(&at, |vertex| vertex.at).is_ok()
    }

    /// Those of the tile that covers `rect`: what lies inside or on its sides. A line that two tiles share gives both
    /// the same vertices and edges; `spans` are taken as they are.
    pub fn within(&self, rect: PostRect) -> Self {
        let inside = |at: LatticePoint| {
            let of = |v: i32, low: i32, high: i32| low * self.steps_per_post <= v && v <= high * self.steps_per_post;
            of(at.row, rect.south, rect.north) && of(at.col, rect.west, rect.east)
        };
        let mut number = vec![None; self.vertices.len()];
        let mut vertices = Vec::new();
        for (vertex, number) in self.vertices.iter().zip(&mut number) {
            if inside(vertex.at) {
                *number = Some(vertices.len() as u32);
                vertices.push(*vertex);
            }
        }
        let edges = self.edges.iter().filter_map(|&[a, b]| Some([number[a as usize]?, number[b as usize]?])).collect();
        Self { vertices, edges, spans: self.spans.clone(), ..*self }
    }

    /// The same in one order, whatever the order they are given in: vertices by place, edges by their ends.
    ///
    /// Of vertices at one place the lowest stays.
    pub fn canonical(&self) -> Self {
        let mut vertices = self.vertices.clone();
        vertices.sort_unstable();
        vertices.dedup_by_key(|vertex| vertex.at);
        let place = |v: u32| vertices.partition_point(|vertex| vertex.at < self.vertices[v as usize].at) as u32;
        let ends = |&[a, b]: &[u32; 2]| (place(a).min(place(b)), place(a).max(place(b)));
        let mut edges: Vec<[u32; 2]> =
            self.edges.iter().map(ends).filter(|(a, b)| a != b).map(|(a, b)| [a, b]).collect();
        edges.sort_unstable();
        edges.dedup();
        let mut spans = self.spans.clone();
        spans.sort_unstable();
        spans.dedup();
        Self { vertices, edges, spans, ..*self }
    }

    /// Posts on the sides of the tile that covers `rect` where no border point may stand, in ascending order: on the
    /// width of a road that crosses, and between the ends of an edge that runs along a side.
    pub fn barred_posts(&self, rect: PostRect) -> Vec<Post> {
        let mut posts = Vec::new();
        for SideSpan { side, from, to } in &self.spans {
            let steps = self.steps_per_post;
            let first = from.div_euclid(steps) + i32::from(from.rem_euclid(steps) != 0);
            posts.extend((first..=to.div_euclid(steps)).map(|along| match side {
                Side::South => Post::new(rect.south, along),
                Side::North => Post::new(rect.north, along),
                Side::West => Post::new(along, rect.west),
                Side::East => Post::new(along, rect.east),
            }));
        }
        posts.extend(self.edges.iter().flat_map(|ends| self.posts_between(*ends, rect)));
        posts.retain(|&post| rect.contains(post));
        posts.sort_unstable();
        posts.dedup();
        posts
    }

    /// Posts between the ends of an edge that runs along a side of `rect`; none where it does not.
    fn posts_between(&self, ends: [u32; 2], rect: PostRect) -> Vec<Post> {
        let [a, b] = ends.map(|end| self.vertices[end as usize].at);
        let steps = self.steps_per_post;
        let along =
            |one: i32, other: i32| one.min(other).div_euclid(steps) + 1..=(one.max(other) - 1).div_euclid(steps);
        let is_side =
            |line: i32, sides: [i32; 2]| sides.contains(&line.div_euclid(steps)) && line.rem_euclid(steps) == 0;
        if a.row == b.row && is_side(a.row, [rect.south, rect.north]) {
            return along(a.col, b.col).map(|col| Post::new(a.row / steps, col)).collect();
        }
        if a.col == b.col && is_side(a.col, [rect.west, rect.east]) {
            return along(a.row, b.row).map(|row| Post::new(row, a.col / steps)).collect();
        }
        Vec::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn vertex(row: i32, col: i32) -> Vertex {
        Vertex { at: LatticePoint::new(row, col), height: row + col }
    }

    #[test]
    fn the_order_in_which_features_are_given_does_not_show() {
        let vertices = vec![vertex(64, 0), vertex(0, 64), vertex(32, 40)];
        let one = Features { vertices, edges: vec![[0, 1], [1, 2]], ..Features::default() };
        let vertices = vec![vertex(32, 40), vertex(64, 0), vertex(0, 64)];
        let other = Features { vertices, edges: vec![[0, 2], [2, 1], [1, 2]], ..Features::default() };
        assert_eq!(one.canonical(), other.canonical());
    }

    #[test]
    fn two_tiles_get_the_same_vertices_and_edges_on_the_line_they_share() {
        let vertices = vec![vertex(8, 80), vertex(16, 80), vertex(8, 0), vertex(8, 160)];
        let all = Features { vertices, edges: vec![[0, 1], [2, 0], [0, 3]], ..Features::default() };
        let tile = |west| all.within(PostRect { south: 0, west, north: 10, east: west + 10 });
        assert_eq!((tile(0).vertices.len(), tile(10).vertices.len()), (3, 3));
        assert_eq!((tile(0).edges, tile(10).edges), (vec![[0, 1], [2, 0]], vec![[0, 1], [0, 2]]));
    }

    #[test]
    fn posts_between_the_edges_of_a_strip_are_barred_and_those_beside_it_are_not() {
        let span = |side, from, to| SideSpan { side, from, to };
        let spans = vec![span(Side::North, 150, 256), span(Side::West, 640, 641), span(Side::West, 65, 66)];
        let features = Features { steps_per_post: 64, spans, ..Features::default() };
        let rect = PostRect { south: 0, west: 0, north: 20, east: 20 };
        assert_eq!(features.barred_posts(rect), [Post::new(10, 0), Post::new(20, 3), Post::new(20, 4)]);
    }

    #[test]
    fn posts_between_the_ends_of_an_edge_along_a_side_are_barred() {
        let vertices =
            vec![vertex(160, 0), vertex(160, 24), vertex(160, 33), vertex(80, 8), vertex(80, 80), vertex(8, 0)];
        let features = Features { vertices, edges: vec![[0, 1], [2, 1], [3, 4], [5, 0]], ..Features::default() };
        let rect = PostRect { south: 0, west: 0, north: 20, east: 20 };
        let north = [1, 2, 4].map(|col| Post::new(20, col));
        let west = (2..20).map(|row| Post::new(row, 0));
        assert_eq!(features.barred_posts(rect), west.chain(north).collect::<Vec<_>>());
    }
}
