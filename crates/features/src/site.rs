//! Where features are worked on: the lattice, the border at which they are cut, and the lines that cut the ground.

use terrain::{PostRect, Spacing};

use crate::clip::Extent;
use crate::exact::Segment;
use crate::{FeatureLattice, Place};

/// The area as features see it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Site {
    /// The lattice of every place.
    pub lattice: FeatureLattice,
    /// The area's border plus one load module: features are cut here.
    pub extent: Extent,
    /// Posts from one load-module line to the next; line 0 is the area's southern and western border.
    pub module_posts: i32,
    /// Posts from one tile line to the next.
    pub tile_posts: i32,
    /// Whether other areas may be built that meet this one: where features cross its border they have heights that
    /// both know.
    pub is_met: bool,
}

impl Site {
    /// The site of an area of posts.
    pub fn new(spacing: Spacing, area: PostRect, module_posts: i32, tile_posts: i32) -> Self {
        let lattice = FeatureLattice::of(spacing);
        let area = area.grown(module_posts);
        let [south, west, north, east] =
            [area.south, area.west, area.north, area.east].map(|posts| posts * lattice.steps_per_post());
        let extent = Extent { south_west: Place::new(south, west), north_east: Place::new(north, east) };
        Self { lattice, extent, module_posts, tile_posts, is_met: false }
    }

    /// Whether the middle between two places lies in the area or on its border.
    pub fn holds_middle(&self, a: Place, b: Place) -> bool {
        let margin = self.module_posts * self.lattice.steps_per_post();
        let Extent { south_west, north_east } = self.extent;
        let within = |a: i32, b: i32, low: i32, high: i32| 2 * (low + margin) <= a + b && a + b <= 2 * (high - margin);
        within(a.row, b.row, south_west.row, north_east.row) && within(a.col, b.col, south_west.col, north_east.col)
    }

    /// Whether a place lies in the area or on its border.
    pub fn holds(&self, place: Place) -> bool {
        self.holds_middle(place, place)
    }

    /// Whether a place lies on the area's border or beyond it.
    pub fn on_border(&self, place: Place) -> bool {
        let margin = self.module_posts * self.lattice.steps_per_post();
        let Extent { south_west, north_east } = self.extent;
        let inside = |at: i32, low: i32, high: i32| low + margin < at && at < high - margin;
        !(inside(place.row, south_west.row, north_east.row) && inside(place.col, south_west.col, north_east.col))
    }

    /// Where the ground is asked for the height of a feature at a place on a border that others meet: there, and at two
    /// posts to either side along the border, of which the next one to either side come first. None elsewhere.
    pub(crate) fn along_border(&self, place: Place) -> Option<[Place; 5]> {
        let margin = self.module_posts * self.lattice.steps_per_post();
        let Extent { south_west, north_east } = self.extent;
        let is_end = |at: i32, low: i32, high: i32| at == low + margin || at == high - margin;
        let crosses_rows = is_end(place.row, south_west.row, north_east.row);
        let is_on =
            self.is_met && self.holds(place) && (crosses_rows || is_end(place.col, south_west.col, north_east.col));
        let post = self.lattice.steps_per_post();
        let aside = |by: i32| match crosses_rows {
            true => Place::new(place.row, place.col + by * post),
            false => Place::new(place.row + by * post, place.col),
        };
        is_on.then(|| [0, -1, 1, -2, 2].map(aside))
    }

    /// Steps between load-module lines and between tile lines.
    fn line_steps(&self) -> [i32; 2] {
        [self.module_posts, self.tile_posts].map(|posts| posts * self.lattice.steps_per_post())
    }

    /// Whether a place lies on a tile line or a load-module line.
    pub fn on_line(&self, place: Place) -> bool {
        self.lines_at(place).contains(&true)
    }

    /// Whether a tile line or a load-module line runs through a place from west to east, and from south to north.
    pub(crate) fn lines_at(&self, place: Place) -> [bool; 2] {
        [place.row, place.col].map(|at| self.line_steps().iter().any(|steps| at % steps == 0))
    }

    /// The load module (row, column) that holds a place; those west and south of the area are negative.
    pub fn module_of(&self, place: Place) -> (i32, i32) {
        let steps = self.line_steps()[0];
        (place.row.div_euclid(steps), place.col.div_euclid(steps))
    }

    /// The load module that holds a segment that crosses no line between load modules; of one on a line that north or
    /// east of it.
    pub fn module_under(&self, a: Place, b: Place) -> (i32, i32) {
        let doubled = 2 * self.line_steps()[0];
        ((a.row + b.row).div_euclid(doubled), (a.col + b.col).div_euclid(doubled))
    }

    /// Calls `found` with the place of each tile and load-module line that a segment crosses between its ends.
    pub fn crossings(&self, segment: Segment, found: &mut impl FnMut(Place)) {
        let [east, north] = segment.a.to(segment.b);
        for steps in self.line_steps() {
            for (start, end, length, rows) in
                [(segment.a.col, segment.b.col, east, false), (segment.a.row, segment.b.row, north, true)]
            {
                let first = start.min(end).div_euclid(steps) + 1;
                for line in (first..).map(|number| i64::from(number) * i64::from(steps)) {
                    if i64::from(start.max(end)) <= line {
                        break;
                    }
                    let numerator = i128::from((line - i64::from(start)) * length.signum());
                    let mut place = segment.at(numerator, i128::from(length.abs()));
                    // Exact on the line; only the other axis is rounded.
                    if rows {
                        place.row = line as i32
                    } else {
                        place.col = line as i32
                    }
                    found(place);
                }
            }
        }
    }
}
