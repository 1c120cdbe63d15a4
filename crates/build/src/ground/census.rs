//! What a mosaic has for every post of the area: heights, fillings, voids, nothing; and the map of it.

use job::{Job, Voids};
use source_files::{Patch, SourceError, Standing, VoidSummary};
use terrain::{Dem, Post, PostRect};

use crate::ground::GroundError;
use crate::ground::area::GamingArea;

/// How many posts of the area stand how, and where there is nothing.
#[derive(Clone)]
pub struct Census {
    pub filled: usize,
    pub void: usize,
    pub gap: usize,
    first_void: Option<Post>,
    /// Posts without a source and posts in all, by part of the area, the southern row first.
    parts: Vec<(usize, usize)>,
}

/// Columns and rows of the map of what is covered.
const MAP_COLS: usize = 48;
const MAP_ROWS: usize = 24;

impl Census {
    pub fn new() -> Self {
        Self { filled: 0, void: 0, gap: 0, first_void: None, parts: vec![(0, 0); MAP_COLS * MAP_ROWS] }
    }

    /// Of one tile; a post on a side that two tiles share counts in the southern or western one.
    pub fn of(patch: &Patch, area: PostRect) -> Self {
        Self::of_posts(patch.rect, area, |post| patch.standings[patch.rect.index(post)])
    }

    /// The same of a tile's heights, of which some are void.
    pub fn of_dem(dem: &Dem, area: PostRect) -> Self {
        Self::of_posts(dem.rect(), area, |post| if dem.is_void(post) { Standing::Void } else { Standing::Height })
    }

    fn of_posts(rect: PostRect, area: PostRect, standing: impl Fn(Post) -> Standing) -> Self {
        let mut census = Self::new();
        for row in rect.south + i32::from(area.south < rect.south)..=rect.north {
            for col in rect.west + i32::from(area.west < rect.west)..=rect.east {
                let part = (row - area.south) as usize * MAP_ROWS / area.posts_high() * MAP_COLS
                    + (col - area.west) as usize * MAP_COLS / area.posts_wide();
                census.parts[part].1 += 1;
                match standing(Post::new(row, col)) {
                    Standing::Height => {}
                    Standing::Filled => census.filled += 1,
                    Standing::Void => {
                        census.void += 1;
                        census.first_void = census.first_void.or(Some(Post::new(row, col)));
                    }
                    Standing::Gap => {
                        census.gap += 1;
                        census.parts[part].0 += 1;
                    }
                }
            }
        }
        census
    }

    pub fn add(&mut self, other: &Census) {
        self.filled += other.filled;
        self.void += other.void;
        self.gap += other.gap;
        self.first_void = self.first_void.or(other.first_void);
        for (sum, part) in self.parts.iter_mut().zip(&other.parts) {
            *sum = (sum.0 + part.0, sum.1 + part.1);
        }
    }

    /// What the job's voids make of it.
    ///
    /// # Errors
    /// When ground is missing and the job wants none to be.
    pub fn judge(&self, job: &Job, area: &GamingArea) -> Result<VoidSummary, GroundError> {
        let of = area.rect.post_count();
        if self.gap + self.void == of {
            return Err(GroundError::Impossible {
                key: "dem.sources".into(),
                found: "no height in the whole area".into(),
                expected: "heights in some of it at least".into(),
                hint: "check area.crs and area.origin_m, and the void markers of the files".into(),
            });
        }
        if !matches!(job.dem.voids, Voids::Hole | Voids::FillThenHole(_)) {
            if 0 < self.gap {
                return Err(SourceError::Gaps { found: self.gap, of, map: self.map() }.into());
            }
            if let Some(first) = self.first_void {
                let [east_m, north_m] = area.frame.place_m(first);
                let first = format!("{east_m:.1}, {north_m:.1} m");
                return Err(SourceError::MosaicVoids { found: self.void, of, first }.into());
            }
        }
        Ok(VoidSummary { filled: self.filled, left: self.void + self.gap })
    }

    /// What is covered, north up: `#` wholly, `+` in part, `.` not at all.
    pub fn map(&self) -> String {
        let mark = |&(gap, of): &(usize, usize)| match (gap, of) {
            (_, 0) => None,
            (0, _) => Some('#'),
            (gap, of) if gap < of => Some('+'),
            _ => Some('.'),
        };
        let lines = self.parts.chunks(MAP_COLS).rev().map(|line| line.iter().filter_map(mark).collect::<String>());
        lines.filter(|line| !line.is_empty()).map(|line| format!("    {line}")).collect::<Vec<_>>().join("\n")
    }
}
