//! The tiered queue: only keys near the largest live in a heap; when it runs dry, one sweep over the
//! triangles refills it. A quarter faster than one heap of everything (measured on 76,500 points).

use std::collections::BinaryHeap;

use terrain::geometry::LocalPost;
use terrain::mesh::Mesh;

use crate::criterion::Criterion;

/// Order of an entry whose post is not located yet: before every located one of the same key.
const NOT_LOCATED: u32 = u32::MAX;

/// Triangles by key; ties by post, smallest first. Entries die when their triangle is rewritten.
pub(crate) struct Queue<C: Criterion> {
    criterion: C,
    heap: BinaryHeap<Entry>,
    cut: u64,
}

#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Entry {
    key: u64,
    /// The complement of the located post, so that smaller posts come first.
    order: u32,
    triangle: u32,
    /// First corner of the triangle when it was entered: its version.
    version: LocalPost,
}

/// The top of the queue.
#[derive(Clone, Copy)]
pub(crate) struct Top {
    pub key: u64,
    pub triangle: u32,
    /// The post to insert, once located.
    pub post: Option<LocalPost>,
}

impl<C: Criterion> Queue<C> {
    /// An empty queue.
    pub fn new(criterion: C) -> Self {
        Self { criterion, heap: BinaryHeap::new(), cut: u64::MAX }
    }

    /// Enters a triangle with the key it carries.
    #[inline(always)]
    pub fn push(&mut self, mesh: &Mesh, triangle: u32) {
        self.enter(mesh, triangle, NOT_LOCATED);
    }

    /// Enters a triangle whose post is known.
    #[inline(always)]
    pub fn push_located(&mut self, mesh: &Mesh, triangle: u32, post: LocalPost) {
        self.enter(mesh, triangle, !post.bits());
    }

    #[inline(always)]
    fn enter(&mut self, mesh: &Mesh, triangle: u32, order: u32) {
        let record = &mesh.triangles()[triangle as usize];
        // A key of 0 has nothing left to select and must never come up.
        if self.cut <= record.key && record.key != 0 {
            self.heap.push(Entry { key: record.key, order, triangle, version: record.corners[0] });
        }
    }

    /// Takes the triangle of largest key.
    #[inline(always)]
    pub fn pop(&mut self, mesh: &Mesh) -> Option<Top> {
        self.settle(mesh)?;
        self.heap.pop().map(Self::top_of)
    }

    /// The largest key, without taking it.
    pub fn largest(&mut self, mesh: &Mesh) -> Option<u64> {
        self.settle(mesh).map(|entry| entry.key)
    }

    fn top_of(entry: Entry) -> Top {
        let post = (entry.order != NOT_LOCATED).then(|| LocalPost::from_bits(!entry.order));
        Top { key: entry.key, triangle: entry.triangle, post }
    }

    /// Drops dead entries until the top is alive, refilling the heap when it runs dry.
    #[inline(always)]
    fn settle(&mut self, mesh: &Mesh) -> Option<Entry> {
        loop {
            while let Some(&entry) = self.heap.peek() {
                let record = &mesh.triangles()[entry.triangle as usize];
                if record.key == entry.key && record.corners[0] == entry.version {
                    return Some(entry);
                }
                self.heap.pop();
            }
            self.refill(mesh)?;
        }
    }

    #[cold]
    fn refill(&mut self, mesh: &Mesh) -> Option<()> {
        let largest = mesh.triangles().iter().map(|record| record.key).max()?;
        if largest == 0 {
            return None;
        }
        self.cut = self.criterion.cut(largest);
        for triangle in 0..mesh.triangles().len() as u32 {
            self.push(mesh, triangle);
        }
        Some(())
    }
}
