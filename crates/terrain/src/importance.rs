//! A window of the importance mask: a weight and a class per post.

use crate::{Post, PostRect};

/// Weights are whole thousandths: weight 8 is 8000.
pub const THOUSANDTHS: u16 = 1000;

/// The class of holes: posts where no source has a height, and the triangles that lie over them. Classes of a job are
/// those below it.
pub const HOLE_CLASS: u8 = 255;

/// Weight (in thousandths, 0 excludes a post from selection) and class at every post of a rectangle.
///
/// Classes are indices into the job's list of classes; class 0 is the default one, [`HOLE_CLASS`] none of
/// them.
#[derive(Clone, Debug, PartialEq)]
pub struct Importance {
    rect: PostRect,
    /// Row-major without padding; empty when all posts weigh the same.
    weights: Vec<u16>,
    /// Row-major without padding; empty when all posts are of class 0.
    classes: Vec<u8>,
    default_weight: u16,
}

impl Importance {
    /// The same weight at every post, all of class 0.
    pub fn uniform(rect: PostRect, weight: u16) -> Self {
        Self { rect, weights: Vec::new(), classes: Vec::new(), default_weight: weight }
    }

    /// Weights and classes per post, row-major from the south.
    ///
    /// # Panics
    /// When either does not hold exactly the posts of `rect`.
    pub fn new(rect: PostRect, weights: Vec<u16>, classes: Vec<u8>) -> Self {
        assert_eq!(weights.len(), rect.post_count(), "one weight per post");
        assert_eq!(classes.len(), rect.post_count(), "one class per post");
        let first = weights[0];
        let weights = if weights.iter().all(|&weight| weight == first) { Vec::new() } else { weights };
        let classes = if classes.iter().all(|&class| class == 0) { Vec::new() } else { classes };
        Self { rect, weights, classes, default_weight: first }
    }

    /// One window of several that cover it together. A post that some of them share is the same in all.
    pub fn joined(rect: PostRect, parts: &[&Self]) -> Self {
        let is_plain = |part: &&Self| part.uniform_weight() == parts[0].uniform_weight() && part.classes.is_empty();
        if let Some(weight) = parts[0].uniform_weight()
            && parts.iter().all(is_plain)
        {
            return Self::uniform(rect, weight);
        }
        let (mut weights, mut classes) = (vec![0; rect.post_count()], vec![0; rect.post_count()]);
        for part in parts {
            for post in part.rect.intersection(&rect).iter().flat_map(PostRect::posts) {
                let index = rect.index(post);
                (weights[index], classes[index]) = (part.weight(post), part.class(post));
            }
        }
        Self::new(rect, weights, classes)
    }

    /// The posts this window holds.
    pub fn rect(&self) -> PostRect {
        self.rect
    }

    /// The one weight of every post, if they all have the same.
    pub fn uniform_weight(&self) -> Option<u16> {
        self.weights.is_empty().then_some(self.default_weight)
    }

    /// Weight at `post`, in thousandths.
    pub fn weight(&self, post: Post) -> u16 {
        if self.weights.is_empty() { self.default_weight } else { self.weights[self.index(post)] }
    }

    /// Class at `post`.
    pub fn class(&self, post: Post) -> u8 {
        if self.classes.is_empty() { 0 } else { self.classes[self.index(post)] }
    }

    /// Weights of one row, west to east; `None` when the weight is uniform.
    pub fn weights_of_row(&self, row: i32) -> Option<&[u16]> {
        (!self.weights.is_empty()).then(|| {
            let start = self.index(Post::new(row, self.rect.west));
            &self.weights[start..start + self.rect.posts_wide()]
        })
    }

    /// Classes of one row, west to east; `None` when all posts are of class 0.
    pub fn classes_of_row(&self, row: i32) -> Option<&[u8]> {
        (!self.classes.is_empty()).then(|| {
            let start = self.index(Post::new(row, self.rect.west));
            &self.classes[start..start + self.rect.posts_wide()]
        })
    }

    fn index(&self, post: Post) -> usize {
        debug_assert!(self.rect.contains(post), "post {post} lies outside the mask window");
        self.rect.index(post)
    }

    /// A copy of part of this window.
    ///
    /// # Panics
    /// When `rect` is not wholly inside.
    pub fn window(&self, rect: PostRect) -> Importance {
        assert!(self.rect.contains_rect(&rect), "a mask window is cut from inside the window that holds it");
        if self.weights.is_empty() && self.classes.is_empty() {
            return Self::uniform(rect, self.default_weight);
        }
        let posts = || {
            (rect.south..=rect.north).flat_map(move |row| (rect.west..=rect.east).map(move |col| Post::new(row, col)))
        };
        let weights = posts().map(|post| self.weight(post)).collect();
        let classes = posts().map(|post| self.class(post)).collect();
        Self::new(rect, weights, classes)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_window_where_all_weights_agree_is_uniform() {
        let rect = PostRect::of_size(4, 4);
        let weights = (0..16).map(|i| if i < 8 { 8000 } else { 1000 }).collect();
        let mask = Importance::new(rect, weights, vec![0; 16]);
        assert_eq!(mask.uniform_weight(), None);
        let south = mask.window(PostRect::new(Post::new(0, 0), Post::new(1, 3)));
        assert_eq!(south.uniform_weight(), Some(8000));
        assert_eq!(mask.weight(Post::new(3, 3)), 1000);
    }

    #[test]
    fn classes_of_a_row_are_absent_when_all_posts_are_of_class_0() {
        let rect = PostRect::of_size(2, 3);
        let mask = Importance::new(rect, vec![8000; 6], vec![0, 0, 0, 1, 2, 0]);
        assert_eq!(mask.classes_of_row(1), Some([1, 2, 0].as_slice()));
        let south = mask.window(PostRect::new(Post::new(0, 0), Post::new(0, 2)));
        assert_eq!(south.classes_of_row(0), None);
    }
}
