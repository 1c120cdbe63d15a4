//! A Delaunay mesh that takes posts one by one and knows the worst post of each of its triangles.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use terrain::geometry::{LocalPost, Surface, rounded, visit_posts};
use terrain::mesh::{Lines, Mesh};
use terrain::{Dem, Post, Tin};

use crate::methods::dem_window::tin_of;

/// Residual in quanta, the post it is at; larger residuals first, then posts by row and column.
pub(crate) type Worst = (u32, Reverse<LocalPost>);

/// A triangle that waits for its worst post. The first corner is the triangle's version: it changes with every rewrite.
type Entry = (Worst, Reverse<u32>, LocalPost);

pub(crate) struct Growing<'a> {
    dem: &'a Dem,
    surface: Surface<'a>,
    mesh: Mesh,
    order: Vec<LocalPost>,
    hint: u32,
}

impl<'a> Growing<'a> {
    /// The four corners of the window.
    pub fn new(dem: &'a Dem) -> Self {
        let rect = dem.rect();
        let order = rect.corners().map(|corner| LocalPost::of(corner, rect)).to_vec();
        Self { dem, surface: Surface::new(dem), mesh: Mesh::new(rect, Lines::none()), order, hint: 0 }
    }

    /// Inserts posts that are no vertices yet; others are passed over.
    pub fn insert_all(&mut self, posts: impl IntoIterator<Item = Post>) {
        let rect = self.dem.rect();
        for post in posts {
            let post = LocalPost::of(post, rect);
            let triangle = self.mesh.triangle_at(post, self.hint);
            if !self.mesh.triangles()[triangle as usize].corners.contains(&post) {
                self.insert(post, triangle);
            }
        }
    }

    fn insert(&mut self, post: LocalPost, triangle: u32) {
        self.hint = self.mesh.insert(post, triangle)[0];
        self.order.push(post);
    }

    /// How many vertices there are.
    pub fn len(&self) -> usize {
        self.order.len()
    }

    /// The worst post of every triangle that has one above `tolerance` quanta: worst first, each post once.
    pub fn failing(&self, tolerance: u32) -> Vec<Post> {
        let all = 0..self.mesh.triangles().len() as u32;
        let mut worst: Vec<Worst> = all.filter_map(|t| self.worst_of(t)).filter(|worst| tolerance < worst.0).collect();
        worst.sort_unstable_by_key(|&worst| Reverse(worst));
        // A post on a shared side has the same residual in both triangles, so its two entries are neighbours.
        worst.dedup();
        worst.into_iter().map(|(_, Reverse(post))| post.post(self.dem.rect())).collect()
    }

    /// Inserts the worst post of all, again and again, until there are `points` vertices or no residual is above
    /// `tolerance` quanta.
    pub fn grow(&mut self, points: usize, tolerance: u32) {
        let mut heap = BinaryHeap::new();
        (0..self.mesh.triangles().len() as u32).for_each(|t| self.enter(&mut heap, t));
        while self.order.len() < points {
            let Some(((value, Reverse(post)), Reverse(triangle), version)) = heap.pop() else { return };
            if self.mesh.triangles()[triangle as usize].corners[0] != version {
                continue;
            }
            if value <= tolerance {
                return;
            }
            self.insert(post, triangle);
            for index in 0..self.mesh.star().len() {
                self.enter(&mut heap, self.mesh.star()[index]);
            }
        }
    }

    fn enter(&self, heap: &mut BinaryHeap<Entry>, triangle: u32) {
        if let Some(worst) = self.worst_of(triangle) {
            heap.push((worst, Reverse(triangle), self.mesh.triangles()[triangle as usize].corners[0]));
        }
    }

    /// The worst post of a triangle's closure that may be chosen, if any has a residual.
    fn worst_of(&self, triangle: u32) -> Option<Worst> {
        let facet = self.surface.facet(self.mesh.triangles()[triangle as usize].corners);
        let (mut largest, mut at) = (0, None);
        let (rect, whole) = (self.dem.rect(), self.dem.void_count() == 0);
        visit_posts(&self.surface, &facet, |post, numerator| {
            // Rows come from south to north, so the first of equals is the one wanted; but equal after rounding.
            if largest < numerator && (whole || !self.dem.is_void(post.post(rect))) {
                let value = rounded(numerator, facet.den as u64);
                if at.is_none_or(|(before, _)| before < value) && 0 < value {
                    at = Some((value, post));
                }
                largest = numerator;
            }
        });
        at.map(|(value, post)| (value as u32, Reverse(post)))
    }

    /// The TIN; vertices in the order of insertion.
    pub fn tin(&self) -> Tin {
        let rect = self.dem.rect();
        let posts: Vec<Post> = self.order.iter().map(|post| post.post(rect)).collect();
        let wide = rect.posts_wide();
        let place = |post: LocalPost| post.row() as usize * wide + post.col() as usize;
        let mut index_at = vec![u32::MAX; rect.post_count()];
        for (index, &post) in self.order.iter().enumerate() {
            index_at[place(post)] = index as u32;
        }
        let corners = |record: &terrain::mesh::Triangle| record.corners.map(|post| index_at[place(post)]);
        tin_of(self.dem, &posts, self.mesh.triangles().iter().map(corners).collect())
    }
}

/// The Delaunay TIN of the window's corners and `posts`, in that order; a post listed twice is one vertex.
pub(crate) fn delaunay_tin(dem: &Dem, posts: impl IntoIterator<Item = Post>) -> Tin {
    let mut seen = std::collections::HashSet::new();
    let all = dem.rect().corners().into_iter().chain(posts);
    let order: Vec<Post> = all.filter(|&post| seen.insert(post)).collect();
    let triangles = terrain::mesh::delaunay(&order);
    tin_of(dem, &order, triangles)
}
