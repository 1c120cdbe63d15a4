//! Candidates by what they are worth; an entry dies when its candidate is entered again or cancelled.

use std::collections::BinaryHeap;

/// Candidates by number, the one of largest worth first; ties by number, smallest first.
#[derive(Default)]
pub(crate) struct Queue {
    heap: BinaryHeap<Entry>,
    stamps: Vec<u32>,
}

#[derive(Clone, Copy, PartialEq)]
struct Entry {
    worth: f64,
    item: u32,
    stamp: u32,
}

impl Eq for Entry {}

impl Ord for Entry {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        self.worth.total_cmp(&other.worth).then(other.item.cmp(&self.item)).then(self.stamp.cmp(&other.stamp))
    }
}

impl PartialOrd for Entry {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

impl Queue {
    /// Enters an item, or enters it again with another worth.
    pub fn enter(&mut self, item: u32, worth: f64) {
        let stamp = self.renew(item);
        self.heap.push(Entry { worth, item, stamp });
    }

    /// Takes an item out, wherever it stands.
    pub fn cancel(&mut self, item: u32) {
        self.renew(item);
    }

    fn renew(&mut self, item: u32) -> u32 {
        let index = item as usize;
        if self.stamps.len() <= index {
            self.stamps.resize(index + 1, 0);
        }
        self.stamps[index] += 1;
        self.stamps[index]
    }

    /// The item of largest worth.
    pub fn peek(&mut self) -> Option<(u32, f64)> {
        while let Some(top) = self.heap.peek() {
            if self.stamps[top.item as usize] == top.stamp {
                return Some((top.item, top.worth));
            }
            self.heap.pop();
        }
        None
    }

    /// All items, in the order of their worth.
    pub fn into_items(mut self) -> impl Iterator<Item = (u32, f64)> {
        std::iter::from_fn(move || self.pop())
    }

    /// Takes the item of largest worth.
    pub fn pop(&mut self) -> Option<(u32, f64)> {
        let top = self.peek()?;
        self.heap.pop();
        Some(top)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_item_entered_again_or_cancelled_comes_up_as_it_is_now() {
        let mut queue = Queue::default();
        for (item, worth) in [(3, 5.0), (1, 7.0), (2, 7.0), (3, 9.0), (1, 1.0), (4, 8.0)] {
            queue.enter(item, worth);
        }
        queue.cancel(4);
        let all: Vec<_> = std::iter::from_fn(|| queue.pop()).collect();
        assert_eq!(all, [(3, 9.0), (2, 7.0), (1, 1.0)]);
    }

    #[test]
    fn costs_below_zero_are_ordered_too() {
        let mut queue = Queue::default();
        queue.enter(0, -2.0);
        queue.enter(1, 3.0);
        queue.enter(2, -1.0);
        assert_eq!(queue.pop(), Some((1, 3.0)));
        assert_eq!(queue.pop(), Some((2, -1.0)));
    }
}
