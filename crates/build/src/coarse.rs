//! A tile seen on every second post: a quarter of the ground to look at, for a survey that only has to tell how tiles
//! compare.

use crate::ground::Window;
use terrain::{Importance, ModuleGrid, Post, PostRect};
use tin::{Frame, SurveyTask, TileTask};

/// The window and the survey on every second post; `None` where load modules do not begin and end on such posts.
pub(crate) fn coarse(window: &Window, task: &SurveyTask) -> Option<(Window, SurveyTask)> {
    let growth = &task.growth;
    let Frame::Sides { side_cells, south_west, allowance } = &growth.frame else { return None };
    if side_cells % 2 != 0 {
        return None;
    }
    // Load modules begin on even posts, so a tile does.
    let rect = growth.rect.halved();
    let frame = Frame::Sides { side_cells: side_cells / 2, south_west: *south_west, allowance: allowance.clone() };
    let (border, barred) = (half_posts(&growth.border), half_posts(&growth.barred));
    let growth = TileTask { rect, frame, border, barred, ..growth.clone() };
    let grid = ModuleGrid { side_cells: side_cells / 2, ..task.grid };
    Some((half_window(window, task.growth.rect), SurveyTask { growth, grid, ..task.clone() }))
}

/// Border points between such posts move north or east along their side.
fn half_posts(posts: &[Post]) -> Vec<Post> {
    let mut half: Vec<Post> = posts.iter().map(|post| Post::new((post.row + 1) / 2, (post.col + 1) / 2)).collect();
    half.sort_unstable();
    half.dedup();
    half
}

fn half_window(window: &Window, rect: PostRect) -> Window {
    let dem = window.dem.every_second(rect);
    let importance = match window.importance.uniform_weight() {
        Some(weight) => Importance::uniform(dem.rect(), weight),
        None => {
            let weight = |post: Post| window.importance.weight(Post::new(2 * post.row, 2 * post.col));
            Importance::new(dem.rect(), dem.rect().posts().map(weight).collect(), vec![0; dem.rect().post_count()])
        }
    };
    Window::of(dem, importance)
}
