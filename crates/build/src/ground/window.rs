//! Heights and weights of a rectangle of posts, and the key of what is made from them.

use store::engine::{FingerprintBuilder, Key, Part};
use terrain::{Dem, Importance, Post, PostRect};

use crate::ground::area::GamingArea;
use crate::ground::given::GivenPost;

/// The ground of a rectangle of posts.
#[derive(Clone)]
pub struct Window {
    /// Heights.
    pub dem: Dem,
    /// Weights and classes.
    pub importance: Importance,
    /// Posts that the job gives, of a tile's own window; none of any other.
    pub given: Vec<GivenPost>,
    /// Posts of such a window that it forbids.
    pub forbidden: Vec<Post>,
    /// Posts that features lie on, or whose heights they have changed; in ascending order.
    pub featured: Vec<Post>,
    /// Those of them that lie on a road or in water, whose height stands whatever the job gives there.
    pub decided: Vec<Post>,
}

impl Window {
    /// Heights and weights of a rectangle.
    pub(crate) fn of(dem: Dem, importance: Importance) -> Self {
        Self { dem, importance, given: Vec::new(), forbidden: Vec::new(), featured: Vec::new(), decided: Vec::new() }
    }

    /// One window of several that cover it together and agree about the posts that they share.
    pub(crate) fn joined(rect: PostRect, parts: &[&Self]) -> Self {
        let dems: Vec<_> = parts.iter().map(|part| &part.dem).collect();
        let masks: Vec<_> = parts.iter().map(|part| &part.importance).collect();
        Self::of(Dem::joined(rect, &dems), Importance::joined(rect, &masks))
    }

    /// What load modules of this rectangle are measured against.
    pub fn measured(&self, area: &GamingArea) -> fidelity::Reference<'_> {
        let spacing = area.frame.spacing;
        fidelity::Reference { dem: &self.dem, mask: &self.importance, grid: area.grid, spacing }
    }
}

/// Heights of a window, and which of them are void.
const HEIGHTS: Part = Part { name: "heights", changed: "its heights changed" };
/// Weights and classes.
const WEIGHTS: Part = Part { name: "weights", changed: "its weights changed" };
/// Points that the job gives or forbids.
const GIVEN: Part = Part { name: "given", changed: "the points given for it changed" };

impl Window {
    /// The key of what is made from this window, with the window's own parts in it.
    pub fn key(&self, purpose: &'static str) -> Key {
        // What features have changed shows in heights and weights.
        let Self { dem, importance, given, forbidden, featured: _, decided: _ } = self;
        Key::new(purpose)
            .part(HEIGHTS, |part| feed_heights(part, dem))
            .part(WEIGHTS, |part| feed_weights(part, importance))
            .part(GIVEN, |part| part.list(given.iter(), feed_given).list(forbidden.iter(), feed_post))
    }
}

/// Feeds where a post lies.
pub fn feed_post(builder: FingerprintBuilder, post: &Post) -> FingerprintBuilder {
    let Post { row, col } = *post;
    builder.signed(row.into()).signed(col.into())
}

fn feed_rect(builder: FingerprintBuilder, rect: PostRect) -> FingerprintBuilder {
    let PostRect { south, west, north, east } = rect;
    [south, west, north, east].into_iter().fold(builder, |builder, line| builder.signed(line.into()))
}

fn feed_heights(builder: FingerprintBuilder, dem: &Dem) -> FingerprintBuilder {
    let rect = dem.rect();
    let rows = (0..rect.posts_high()).map(|row| dem.row(rect.south + row as i32));
    let builder = feed_rect(builder, rect).rows(rows, i32::to_le_bytes).number(dem.void_count() as u64);
    match dem.void_count() {
        0 => builder,
        _ => builder.stream(rect.post_count(), rect.posts().map(|post| u8::from(dem.is_void(post)))),
    }
}

fn feed_weights(builder: FingerprintBuilder, importance: &Importance) -> FingerprintBuilder {
    let rect = importance.rect();
    let rows = || (0..rect.posts_high()).map(|row| rect.south + row as i32);
    let weights: Vec<&[u16]> = rows().filter_map(|row| importance.weights_of_row(row)).collect();
    let classes: Vec<&[u8]> = rows().filter_map(|row| importance.classes_of_row(row)).collect();
    feed_rect(builder, rect)
        .maybe(importance.uniform_weight(), |builder, weight| builder.number(weight.into()))
        .rows(weights.into_iter(), u16::to_le_bytes)
        .rows(classes.into_iter(), u8::to_le_bytes)
}

fn feed_given(builder: FingerprintBuilder, given: &GivenPost) -> FingerprintBuilder {
    let GivenPost { at, pinned, outer, height } = given;
    let builder = feed_post(builder, at).case(u8::from(*pinned)).case(u8::from(*outer));
    builder.maybe(*height, |builder, height| builder.signed(height.into()))
}

#[cfg(test)]
mod tests {
    use store::engine::Fingerprint;

    use super::*;

    fn key(window: &Window) -> Fingerprint {
        window.key("tests").fingerprint()
    }

    fn window(dem: Dem, importance: Importance) -> Window {
        Window::of(dem, importance)
    }

    fn flat(rect: PostRect, odd: Post) -> Window {
        let dem = Dem::from_fn(rect, |post| Some(if post == odd { 1 } else { 0 }));
        window(dem, Importance::uniform(rect, 8000))
    }

    #[test]
    fn every_height_counts_and_so_does_its_place() {
        let rect = PostRect::of_size(200, 300);
        let even = key(&flat(rect, Post::new(-1, -1)));
        for odd in [Post::new(0, 0), Post::new(100, 17), Post::new(199, 299)] {
            assert_ne!(even, key(&flat(rect, odd)));
        }
        let moved = PostRect::new(Post::new(1, 0), Post::new(200, 299));
        assert_ne!(even, key(&flat(moved, Post::new(-1, -1))));
        let holed = Dem::from_fn(rect, |post| (post != Post::new(5, 5)).then_some(0));
        assert_ne!(even, key(&window(holed, Importance::uniform(rect, 8000))));
    }

    #[test]
    fn every_weight_class_and_given_point_counts() {
        let rect = PostRect::of_size(9, 9);
        let mask = |weight, class| {
            let (mut weights, mut classes) = (vec![8000; 81], vec![0; 81]);
            (weights[40], classes[40]) = (weight, class);
            window(Dem::from_fn(rect, |_| Some(0)), Importance::new(rect, weights, classes))
        };
        let uniform = key(&flat(rect, Post::new(-1, -1)));
        assert_eq!(key(&mask(8000, 0)), uniform);
        assert_ne!(key(&mask(1000, 0)), uniform);
        assert_ne!(key(&mask(8000, 1)), uniform);
        let at = Post::new(3, 4);
        let given = GivenPost { at, pinned: true, outer: false, height: None };
        let all = [
            Window { given: vec![given], ..mask(8000, 0) },
            Window { given: vec![GivenPost { pinned: false, ..given }], ..mask(8000, 0) },
            Window { given: vec![GivenPost { outer: true, ..given }], ..mask(8000, 0) },
            Window { given: vec![GivenPost { height: Some(0), ..given }], ..mask(8000, 0) },
            Window { forbidden: vec![at], ..mask(8000, 0) },
        ];
        let mut keys: Vec<Fingerprint> = all.iter().map(key).chain([uniform]).collect();
        keys.sort_unstable();
        keys.dedup();
        assert_eq!(keys.len(), all.len() + 1);
    }
}
