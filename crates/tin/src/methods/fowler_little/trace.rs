//! Lines of posts: from passes up ridges to peaks, down channels to pits, and what candidates are left over.

use terrain::{Dem, Post};

use super::surface::{Flags, Kind, channel_candidates, is_higher, kind, ridge_candidates, sectors};
use crate::methods::dem_window::{RING, beside, inner_posts};

/// Posts that a line of leftover candidates has at least.
const LEFTOVER_POSTS_MIN: usize = 5;

/// All lines, each from end to end.
pub fn chains(dem: &Dem) -> Vec<Vec<Post>> {
    let passes: Vec<Post> =
        inner_posts(dem.rect()).filter(|&post| !dem.is_void(post) && kind(dem, post) == Kind::Pass).collect();
    let mut all = Vec::new();
    for rising in [true, false] {
        let candidates = if rising { ridge_candidates(dem) } else { channel_candidates(dem) };
        let mut traced = Flags::none(dem.rect());
        for &pass in &passes {
            for first in sectors(dem, pass, rising) {
                let chain = Walk { dem, candidates: &candidates, rising }.from(pass, first, &traced);
                chain.iter().for_each(|&post| traced.set(post, true));
                all.push(chain);
            }
        }
        all.extend(leftovers(&candidates, &traced));
    }
    all
}

/// A walk up a ridge or down a channel.
struct Walk<'a> {
    dem: &'a Dem,
    candidates: &'a Flags,
    rising: bool,
}

impl Walk<'_> {
    /// From a pass over the first post of a sector to a peak, a pit, a line traced before, or, downwards, the border.
    fn from(&self, pass: Post, first: Post, traced: &Flags) -> Vec<Post> {
        let mut chain = vec![pass, first];
        let mut at = first;
        while !traced.holds(at) && (self.rising || !self.dem.rect().has_on_border(at)) {
            let Some(next) = self.next(at) else { break };
            chain.push(next);
            at = next;
        }
        chain
    }

    /// The highest (lowest) post beside one, candidates before others; none from a peak (pit).
    fn next(&self, at: Post) -> Option<Post> {
        let rect = self.dem.rect();
        let around = RING.map(|step| beside(at, step));
        let onward = around.into_iter().filter(|&post| rect.contains(post));
        let onward = onward.filter(|&post| is_higher(self.dem, post, at) == self.rising);
        onward.reduce(|best, post| {
            let (is_best, is_post) = (self.candidates.holds(best), self.candidates.holds(post));
            let better = if is_best == is_post { is_higher(self.dem, post, best) == self.rising } else { is_post };
            if better { post } else { best }
        })
    }
}

/// Lines of candidates that no walk has met, thinned to one post across.
fn leftovers(candidates: &Flags, traced: &Flags) -> Vec<Vec<Post>> {
    let mut left = Flags::none(candidates.rect());
    for post in candidates.rect().posts() {
        left.set(post, candidates.holds(post) && !traced.holds(post));
    }
    thin(&mut left);
    lines(&left).into_iter().filter(|line| LEFTOVER_POSTS_MIN <= line.len()).collect()
}

/// Takes posts off the sides of broad lines until they are one post across.
///
/// Zhang and Suen, "A fast parallel algorithm for thinning digital patterns" (CACM 27, 1984).
fn thin(flags: &mut Flags) {
    let posts: Vec<Post> = flags.rect().posts().filter(|&post| flags.holds(post)).collect();
    let mut left = posts;
    loop {
        let before = left.len();
        for turn in [false, true] {
            let taken: Vec<bool> = left.iter().map(|&post| is_taken(flags, post, turn)).collect();
            let mut taken = taken.into_iter();
            left.retain(|&post| {
                let is_taken = taken.next().unwrap_or(false);
                if is_taken {
                    flags.set(post, false);
                }
                !is_taken
            });
        }
        if left.len() == before {
            return;
        }
    }
}

fn is_taken(flags: &Flags, post: Post, turn: bool) -> bool {
    let ring = RING.map(|step| flags.holds(beside(post, step)));
    let count = ring.iter().filter(|&&held| held).count();
    let rises = (0..8).filter(|&i| !ring[i] && ring[(i + 1) % 8]).count();
    let [east, _, north, _, west, _, south, _] = ring;
    let open = if turn { !(north && west && (east || south)) } else { !(east && south && (north || west)) };
    (2..=6).contains(&count) && rises == 1 && open
}

/// Lines of a thin pattern, cut where three or more meet; then its closed lines.
fn lines(flags: &Flags) -> Vec<Vec<Post>> {
    let around = |post: Post| RING.map(|step| beside(post, step)).into_iter().filter(|&other| flags.holds(other));
    let mut used = Flags::none(flags.rect());
    let mut found = Vec::new();
    let all: Vec<Post> = flags.rect().posts().filter(|&post| flags.holds(post)).collect();
    let is_end = |post: &Post| around(*post).count() != 2;
    let ends = all.iter().filter(|post| is_end(post));
    let rest = all.iter().filter(|post| !is_end(post));
    for &start in ends.chain(rest) {
        if used.holds(start) {
            continue;
        }
        used.set(start, true);
        for first in around(start) {
            if used.holds(first) {
                continue;
            }
            let mut line = vec![start];
            let mut at = Some(first);
            while let Some(post) = at {
                line.push(post);
                if is_end(&post) {
                    break;
                }
                used.set(post, true);
                at = around(post).find(|&next| !used.holds(next));
            }
            found.push(line);
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::methods::scene;

    #[test]
    fn from_a_saddle_lines_run_to_both_peaks_and_down_to_the_border() {
        // Two hills beside each other, their saddle at (10, 20).
        let height = |post: Post| {
            let hill = |col: i32| 500 - (post.row - 10).pow(2) * 3 - (post.col - col).pow(2) * 2;
            hill(10).max(hill(30))
        };
        let dem = scene::dem(21, 41, height);
        let all = chains(&dem);
        let reaches = |post: Post| all.iter().any(|chain| chain.last() == Some(&post));
        assert!(reaches(Post::new(10, 10)) && reaches(Post::new(10, 30)), "{all:?}");
        let to_border = all.iter().filter(|chain| chain.last().is_some_and(|&end| dem.rect().has_on_border(end)));
        assert!(2 <= to_border.count());
        let touch = |pair: &[Post]| (pair[0].row - pair[1].row).abs() <= 1 && (pair[0].col - pair[1].col).abs() <= 1;
        assert!(all.iter().all(|chain| chain.windows(2).all(touch)));
    }

    #[test]
    fn a_broad_bar_is_thinned_to_a_line_of_one_post() {
        let mut flags = Flags::none(terrain::PostRect::of_size(15, 40));
        for post in flags.rect().posts() {
            flags.set(post, (6..=8).contains(&post.row) && (5..35).contains(&post.col));
        }
        thin(&mut flags);
        let all = lines(&flags);
        assert_eq!(all.len(), 1);
        assert!(25 <= all[0].len() && all[0].iter().all(|post| post.row == 7), "{all:?}");
    }

    #[test]
    fn lines_are_cut_where_three_meet_and_closed_ones_are_found() {
        let mut flags = Flags::none(terrain::PostRect::of_size(20, 20));
        for i in 1..9 {
            flags.set(Post::new(5, i), true);
            flags.set(Post::new(5 + i, 9), true);
            flags.set(Post::new(5 - i.min(4), 9), true);
        }
        flags.set(Post::new(5, 9), true);
        assert_eq!(lines(&flags).iter().filter(|line| 4 <= line.len()).count(), 3, "{:?}", lines(&flags));
        let mut ring = Flags::none(terrain::PostRect::of_size(9, 9));
        for post in ring.rect().posts() {
            ring.set(post, (post.row - 4).abs() + (post.col - 4).abs() == 3);
        }
        assert_eq!(lines(&ring).iter().map(Vec::len).collect::<Vec<_>>(), [12]);
    }
}
