//! What a method is given, and why it may have to say no.

use terrain::{Dem, LatticePoint, Metres, Post, PostRect, QUANTA_PER_METRE, Tin, Vertex};
use thiserror::Error;

/// Largest residual that methods with a tolerance accept unless told otherwise, in metres.
pub const TOLERANCE_M: f64 = 10.0;

/// A window of the DEM and the metres between its posts.
#[derive(Clone, Copy, Debug)]
pub struct DemWindow<'a> {
    /// Heights; voids are never chosen, but for corners.
    pub dem: &'a Dem,
    /// Metres between posts.
    pub spacing: Metres,
}

impl DemWindow<'_> {
    /// Quanta between posts.
    pub(crate) fn spacing_quanta(&self) -> f64 {
        self.spacing.0 * f64::from(QUANTA_PER_METRE)
    }
}

/// Why a method cannot do what it is asked for.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("{found}, expected {expected}")]
pub struct Impossible {
    /// What was asked for.
    pub found: String,
    /// What is possible.
    pub expected: String,
    /// What to do.
    pub hint: String,
}

impl Impossible {
    pub(crate) fn new(found: impl Into<String>, expected: impl Into<String>, hint: impl Into<String>) -> Self {
        Self { found: found.into(), expected: expected.into(), hint: hint.into() }
    }

    /// A number of points outside what is possible.
    pub(crate) fn points(found: usize, expected: String, hint: &str) -> Self {
        Self::new(format!("{found} points"), expected, hint)
    }
}

/// Refuses a length that is negative or no number.
pub(crate) fn tolerance(metres: f64) -> Result<f64, Impossible> {
    if metres.is_finite() && 0.0 <= metres {
        return Ok(metres);
    }
    let hint = "a tolerance is the largest residual that is accepted";
    Err(Impossible::new(format!("a tolerance of {metres} m"), "0 or more metres", hint))
}

/// Refuses a number of points that no triangulation of the window can have.
pub(crate) fn within(rect: PostRect, points: usize) -> Result<(), Impossible> {
    let most = rect.post_count();
    if (4..=most).contains(&points) {
        return Ok(());
    }
    Err(Impossible::points(points, format!("4 to {most} points"), "the 4 corners of the window are always in"))
}

/// The triangles over posts of the window, at the DEM's heights.
pub(crate) fn tin_of(dem: &Dem, posts: &[Post], triangles: Vec<[u32; 3]>) -> Tin {
    let vertex = |&post: &Post| Vertex { at: LatticePoint::from(post), height: dem.height(post) };
    Tin::new(dem.rect(), posts.iter().map(vertex).collect(), triangles)
}

/// The posts of a rectangle that are not on its border lines, by row and column.
pub(crate) fn inner_posts(rect: PostRect) -> impl Iterator<Item = Post> {
    (rect.south + 1..rect.north).flat_map(move |row| (rect.west + 1..rect.east).map(move |col| Post::new(row, col)))
}

/// The eight posts around one, counter-clockwise from the east, as steps in (row, col).
pub(crate) const RING: [(i32, i32); 8] = [(0, 1), (1, 1), (1, 0), (1, -1), (0, -1), (-1, -1), (-1, 0), (-1, 1)];

/// The post a step away.
pub(crate) fn beside(post: Post, (rows, cols): (i32, i32)) -> Post {
    Post::new(post.row + rows, post.col + cols)
}
