//! A tile seen on every second post: a quarter of the ground to look at, for a survey that only has to tell how tiles
//! compare.

use ground::Window;
use terrain::{Dem, Importance, ModuleGrid, Post, PostRect};
use tin::{Frame, SurveyTask, TileTask};

/// The window and the survey on every second post; `None` where load modules do not begin and end on such posts.
pub(crate) fn coarse(window: &Window, task: &SurveyTask) -> Option<(Window, SurveyTask)> {
    let growth = &task.growth;
    let Frame::Sides { side_cells, south_west, allowance } = &growth.frame else { return None };
    if side_cells % 2 != 0 {
        return None;
    }
    let rect = half_rect(growth.rect);
    let frame = Frame::Sides { side_cells: side_cells / 2, south_west: *south_west, allowance: allowance.clone() };
    let (border, barred) = (half_posts(&growth.border), half_posts(&growth.barred));
    let growth = TileTask { rect, frame, border, barred, ..growth.clone() };
    let grid = ModuleGrid { side_cells: side_cells / 2, ..task.grid };
    Some((half_window(window, rect), SurveyTask { growth, grid, ..task.clone() }))
}

/// Load modules begin on even posts, so a tile does.
fn half_rect(rect: PostRect) -> PostRect {
    PostRect { south: rect.south / 2, west: rect.west / 2, north: rect.north / 2, east: rect.east / 2 }
}

/// Border points between such posts move north or east along their side.
fn half_posts(posts: &[Post]) -> Vec<Post> {
    let mut half: Vec<Post> = posts.iter().map(|post| Post::new((post.row + 1) / 2, (post.col + 1) / 2)).collect();
    half.sort_unstable();
    half.dedup();
    half
}

fn half_window(window: &Window, rect: PostRect) -> Window {
    let from = window.dem.rect();
    let every_second = |row: i32, to: &mut [i32]| {
        let heights = window.dem.row(2 * row);
        let first = (2 * rect.west - from.west) as usize;
        to.iter_mut().zip(heights[first..].iter().step_by(2)).for_each(|(to, &height)| *to = height);
    };
    let importance = match window.importance.uniform_weight() {
        Some(weight) => Importance::uniform(rect, weight),
        None => {
            let weight = |post: Post| window.importance.weight(Post::new(2 * post.row, 2 * post.col));
            let posts =
                (rect.south..=rect.north).flat_map(|row| (rect.west..=rect.east).map(move |col| Post::new(row, col)));
            Importance::new(rect, posts.map(weight).collect(), vec![0; rect.post_count()])
        }
    };
    Window {
        dem: Dem::from_row_fn(rect, every_second),
        importance,
        given: Vec::new(),
        forbidden: Vec::new(),
        featured: Vec::new(),
    }
}
