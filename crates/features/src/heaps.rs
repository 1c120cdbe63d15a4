//! Heaps of weighted keys that can be melded and shifted as a whole (C. A. Crane's leftist heaps, 1972, with shifts
//! that wait at the top until a heap is opened).

/// No heap.
pub(crate) const EMPTY: u32 = u32::MAX;

/// A key with its weight, and the heaps below it.
#[derive(Clone, Copy)]
struct Entry {
    key: i64,
    weight: i64,
    /// What the keys below have yet to be shifted by.
    shift: i64,
    left: u32,
    right: u32,
    /// Entries on the way to the right until a heap ends.
    rank: u32,
}

/// Many heaps, each known by the number of its top: the least key, of equal ones that with the least number.
#[derive(Default)]
pub(crate) struct Heaps {
    entries: Vec<Entry>,
    free: Vec<u32>,
}

impl Heaps {
    /// The key and the weight at the top of a heap.
    pub fn top(&self, heap: u32) -> Option<(i64, i64)> {
        self.entries.get(heap as usize).map(|entry| (entry.key, entry.weight))
    }

    /// The heap with one more key.
    pub fn push(&mut self, heap: u32, key: i64, weight: i64) -> u32 {
        let entry = Entry { key, weight, shift: 0, left: EMPTY, right: EMPTY, rank: 1 };
        let number = self.free.pop().unwrap_or(self.entries.len() as u32);
        match self.entries.get_mut(number as usize) {
            Some(free) => *free = entry,
            None => self.entries.push(entry),
        }
        self.meld(heap, number)
    }

    /// The heap with `weight` less at its top, which goes when nothing is left of it.
    pub fn take(&mut self, heap: u32, weight: i64) -> u32 {
        let top = &mut self.entries[heap as usize];
        top.weight -= weight;
        if 0 < top.weight {
            return heap;
        }
        self.settle(heap);
        self.free.push(heap);
        let Entry { left, right, .. } = self.entries[heap as usize];
        self.meld(left, right)
    }

    /// Adds to all keys of a heap.
    pub fn shift(&mut self, heap: u32, by: i64) {
        if let Some(top) = self.entries.get_mut(heap as usize) {
            top.key += by;
            top.shift += by;
        }
    }

    /// One heap of two.
    pub fn meld(&mut self, one: u32, other: u32) -> u32 {
        if one == EMPTY || other == EMPTY {
            return if one == EMPTY { other } else { one };
        }
        let order = |heap: u32| (self.entries[heap as usize].key, heap);
        let (top, below) = if order(one) < order(other) { (one, other) } else { (other, one) };
        self.settle(top);
        let right = self.meld(self.entries[top as usize].right, below);
        let rank = |heaps: &Self, heap: u32| heaps.entries.get(heap as usize).map_or(0, |entry| entry.rank);
        let left = self.entries[top as usize].left;
        let (left, right) = if rank(self, left) < rank(self, right) { (right, left) } else { (left, right) };
        let rank = rank(self, right) + 1;
        let entry = &mut self.entries[top as usize];
        (entry.left, entry.right, entry.rank) = (left, right, rank);
        top
    }

    /// Hands the shift of a top on to the heaps below it.
    fn settle(&mut self, heap: u32) {
        let Entry { left, right, shift, .. } = self.entries[heap as usize];
        if shift != 0 {
            self.shift(left, shift);
            self.shift(right, shift);
            self.entries[heap as usize].shift = 0;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn keys_come_out_in_order_whatever_was_melded_and_shifted(
            steps in proptest::collection::vec((0..4u8, -50..50i64, 1..5i64), 1..60),
        ) {
            // Two heaps, and beside each a sorted list of its keys with their weights.
            let mut heaps = Heaps::default();
            let (mut found, mut expected) = ([EMPTY; 2], [Vec::new(), Vec::new()]);
            for (step, key, weight) in steps {
                let at = (key & 1) as usize;
                match step {
                    0 => {
                        found[at] = heaps.shift_of(found[at], key);
                        expected[at].iter_mut().for_each(|(other, _): &mut (i64, i64)| *other += key);
                    }
                    1 => {
                        found[at] = heaps.meld(found[at], found[1 - at]);
                        found[1 - at] = EMPTY;
                        let other = std::mem::take(&mut expected[1 - at]);
                        expected[at].extend(other);
                    }
                    _ => {
                        found[at] = heaps.push(found[at], key, weight);
                        expected[at].push((key, weight));
                    }
                }
            }
            for (mut heap, mut list) in found.into_iter().zip(expected) {
                list.sort_unstable();
                let mut all = Vec::new();
                while let Some((key, weight)) = heaps.top(heap) {
                    all.push((key, weight));
                    heap = heaps.take(heap, weight);
                }
                all.sort_unstable_by_key(|(key, _)| *key);
                let keys = |of: &[(i64, i64)]| of.iter().map(|(key, _)| *key).collect::<Vec<i64>>();
                prop_assert_eq!(keys(&all), keys(&list));
                let weight = |of: &[(i64, i64)]| of.iter().map(|(_, weight)| weight).sum::<i64>();
                prop_assert_eq!(weight(&all), weight(&list));
            }
        }
    }

    impl Heaps {
        fn shift_of(&mut self, heap: u32, by: i64) -> u32 {
            self.shift(heap, by);
            heap
        }
    }
}
