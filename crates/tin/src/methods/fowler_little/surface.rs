//! What a post is, from the posts around it. Equal heights are told apart by row and column.

use terrain::geometry::is_ridge_candidate;
use terrain::{Dem, Post, PostRect};

use crate::methods::dem_window::{RING, beside};

/// What the ring of eight around a post says.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// All lower.
    Peak,
    /// All higher.
    Pit,
    /// Higher and lower change four times or more.
    Pass,
    /// Anything else.
    Slope,
}

/// The kind of a post that is not on the border.
pub fn kind(dem: &Dem, post: Post) -> Kind {
    let higher = RING.map(|step| is_higher(dem, beside(post, step), post));
    let changes = (0..8).filter(|&i| higher[i] != higher[(i + 1) % 8]).count();
    match changes {
        0 if higher[0] => Kind::Pit,
        0 => Kind::Peak,
        2 => Kind::Slope,
        _ => Kind::Pass,
    }
}

/// Whether `a` is higher than `b`.
pub fn is_higher(dem: &Dem, a: Post, b: Post) -> bool {
    (dem.height(b), b) < (dem.height(a), a)
}

/// The ring posts with which the sectors that rise (or fall) from a pass begin: the highest (lowest) of each.
pub fn sectors(dem: &Dem, pass: Post, rising: bool) -> Vec<Post> {
    let ring = RING.map(|step| beside(pass, step));
    let belongs = |i: usize| is_higher(dem, ring[i % 8], pass) == rising;
    let starts = (0..8).filter(|&i| belongs(i) && !belongs(i + 7));
    let best = |start: usize| {
        let sector = (start..start + 8).take_while(|&i| belongs(i)).map(|i| ring[i % 8]);
        sector.reduce(|best, post| if is_higher(dem, post, best) == rising { post } else { best })
    };
    starts.filter_map(best).collect()
}

/// A yes or no for each post of a window.
#[derive(Clone)]
pub struct Flags {
    rect: PostRect,
    bits: Vec<bool>,
}

impl Flags {
    /// All say no.
    pub fn none(rect: PostRect) -> Self {
        Self { rect, bits: vec![false; rect.post_count()] }
    }

    fn index(&self, post: Post) -> usize {
        self.rect.index(post)
    }

    /// What it says of a post; no of those outside.
    pub fn holds(&self, post: Post) -> bool {
        self.rect.contains(post) && self.bits[self.index(post)]
    }

    /// Says so of a post inside.
    pub fn set(&mut self, post: Post, value: bool) {
        let index = self.index(post);
        self.bits[index] = value;
    }

    /// The window.
    pub fn rect(&self) -> PostRect {
        self.rect
    }
}

/// Posts that are the lowest of no cell: they may be on a ridge.
pub fn ridge_candidates(dem: &Dem) -> Flags {
    candidates(dem, dem)
}

/// Posts that are the highest of no cell: they may be in a channel.
pub fn channel_candidates(dem: &Dem) -> Flags {
    let rect = dem.rect();
    // Ground and order of posts turned over, what is highest is lowest.
    let over = |post: Post| Post::new(rect.north + rect.south - post.row, rect.east + rect.west - post.col);
    let turned = Dem::from_fn(rect, |post| Some(-dem.height(over(post))));
    let found = candidates(dem, &turned);
    let mut flags = Flags::none(rect);
    for post in rect.posts() {
        flags.set(post, found.holds(over(post)) && !dem.is_void(post));
    }
    flags
}

fn candidates(dem: &Dem, heights: &Dem) -> Flags {
    let mut flags = Flags::none(dem.rect());
    for post in dem.rect().posts() {
        flags.set(post, is_ridge_candidate(heights, post));
    }
    flags
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::methods::scene;

    #[test]
    fn a_saddle_is_a_pass_with_two_ways_up_and_two_ways_down() {
        let dem = scene::dem(9, 9, |post| 10 * ((post.row - 4).pow(2) - (post.col - 4).pow(2)));
        let pass = Post::new(4, 4);
        assert_eq!(kind(&dem, pass), Kind::Pass);
        assert_eq!(sectors(&dem, pass, true), [Post::new(5, 4), Post::new(3, 4)]);
        let mut down = sectors(&dem, pass, false);
        down.sort_unstable();
        assert_eq!(down, [Post::new(4, 3), Post::new(4, 5)]);
    }

    #[test]
    fn peaks_pits_and_slopes_are_told_apart_and_flat_ground_by_row_and_column() {
        let cone = scene::dem(5, 5, |post| -(post.row - 2).abs() - (post.col - 2).abs());
        assert_eq!(kind(&cone, Post::new(2, 2)), Kind::Peak);
        assert_eq!(kind(&cone, Post::new(2, 1)), Kind::Slope);
        let flat = scene::dem(3, 3, |_| 0);
        assert_eq!(kind(&flat, Post::new(1, 1)), Kind::Slope);
        let pit = scene::dem(3, 3, |post| i32::from(post != Post::new(1, 1)));
        assert_eq!(kind(&pit, Post::new(1, 1)), Kind::Pit);
    }

    #[test]
    fn a_valley_has_its_channel_and_a_roof_its_ridge() {
        let channel: Vec<Post> = (1..8).map(|row| Post::new(row, 4)).collect();
        let inner = |flags: &Flags| -> Vec<Post> {
            crate::methods::dem_window::inner_posts(flags.rect()).filter(|&post| flags.holds(post)).collect()
        };
        let valley = scene::dem(9, 9, |post| 3 * post.row + 20 * (post.col - 4).abs());
        assert_eq!(inner(&channel_candidates(&valley)), channel);
        assert_eq!(inner(&ridge_candidates(&valley)), []);
        let roof = scene::dem(9, 9, |post| 3 * post.row - 20 * (post.col - 4).abs());
        assert_eq!(inner(&ridge_candidates(&roof)), channel);
        assert_eq!(inner(&channel_candidates(&roof)), []);
    }
}
