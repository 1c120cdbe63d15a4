//! A part of the ground with a class and a weight of its own.

use std::ops::Range;

use crate::{GridFrame, PostRect};

use crate::mask::Polygon;

/// Which posts of a window belong, row-major from the south: one answer per post, the same for a post in whatever
/// window it is asked for.
pub type Membership<'a> = dyn Fn(PostRect) -> Vec<bool> + Send + Sync + 'a;

/// A part of the ground with a class and a weight of its own.
#[derive(Debug)]
pub struct Area<'a> {
    /// Name of the class.
    pub class: String,
    /// Weight in thousandths; 0 excludes its posts from selection.
    pub weight: u16,
    /// Which posts it claims.
    pub shape: Shape<'a>,
}

/// Which posts an area claims.
pub enum Shape<'a> {
    /// Those inside any of the polygons.
    Polygons(Vec<Polygon>),
    /// Those a class overlay says belong.
    Members(Box<Membership<'a>>),
}

impl std::fmt::Debug for Shape<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Shape::Polygons(polygons) => f.debug_tuple("Polygons").field(polygons).finish(),
            Shape::Members(_) => f.write_str("Members"),
        }
    }
}

impl Shape<'_> {
    /// Calls `claim` with ranges of row-major indices into `rect` that together hold exactly the posts claimed.
    pub(crate) fn visit_spans(&self, frame: &GridFrame, rect: PostRect, mut claim: impl FnMut(Range<usize>)) {
        match self {
            Shape::Polygons(polygons) => {
                for polygon in polygons {
                    polygon.visit_spans(frame, rect, &mut claim);
                }
            }
            Shape::Members(members) => {
                let members = members(rect);
                assert_eq!(members.len(), rect.post_count(), "an overlay answers for every post of the window");
                for (index, _) in members.iter().enumerate().filter(|&(_, &member)| member) {
                    claim(index..index + 1);
                }
            }
        }
    }
}
