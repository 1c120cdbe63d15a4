//! Settings that are one of some words: every word, what it means and what it was measured to cost.
//!
//! From here follow the reader of job files, what `describe` says, the values that the command line takes, the
//! forecast of a build, and the reference in `docs/reference/job-keys.md`.

use std::mem::discriminant;

use terrain::{Effort, HeightFit, LastBatch, Lattice, LodBorder, Resampling, Smooth, TileOrder};

use self::Cost::{Residual, Seconds};
use crate::{
    Allocation, AreaPlace, Borders, ClipHeights, Count, DemSource, Edges, ErrorKey, MethodName, OuterBorder,
    SampleClass, StartMethod,
};

/// A setting that is one of some words.
pub trait Choice: Sized + 'static {
    /// All of them, in the order in which they are listed. What a variant holds besides is not part of its word.
    const WORDS: &'static [Word<Self>];

    /// Its word.
    fn word(&self) -> &'static Word<Self> {
        let is_its = |word: &&Word<Self>| discriminant(&word.value) == discriminant(self);
        Self::WORDS.iter().find(is_its).expect("every variant has a word")
    }

    /// Its word, as a job file writes it.
    fn name(&self) -> &'static str {
        self.word().name
    }

    /// What `name` stands for.
    fn named(name: &str) -> Option<&'static Self> {
        Self::WORDS.iter().find(|word| word.name == name).map(|word| &word.value)
    }
}

/// One word of a setting.
#[derive(Clone, Debug)]
pub struct Word<T> {
    /// As a job file writes it.
    pub name: &'static str,
    /// What it stands for.
    pub value: T,
    /// What it means.
    pub meaning: &'static str,
    /// What it costs.
    pub cost: Cost,
}

/// What a word was measured to cost.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Cost {
    /// Nothing worth telling.
    None,
    /// So much in the residual.
    Residual(&'static str),
    /// Seconds of one core for a million triangles of the finished TIN.
    Seconds(f64),
}

impl Cost {
    /// Seconds of one core for a million triangles, 0 where they are not known.
    pub fn seconds(self) -> f64 {
        if let Cost::Seconds(seconds) = self { seconds } else { 0.0 }
    }

    /// In words; empty where there is none.
    pub fn text(self) -> String {
        match self {
            Cost::None => String::new(),
            Cost::Residual(words) => words.to_owned(),
            Cost::Seconds(seconds) => format!("{seconds} s of a core for a million triangles"),
        }
    }
}

impl<T> Word<T> {
    const fn new(name: &'static str, value: T, meaning: &'static str) -> Self {
        Self { name, value, meaning, cost: Cost::None }
    }

    const fn costing(name: &'static str, value: T, meaning: &'static str, cost: Cost) -> Self {
        Self { name, value, meaning, cost }
    }

    /// Its meaning and its cost.
    pub fn text(&self) -> String {
        match self.cost {
            Cost::None => self.meaning.to_owned(),
            cost => format!("{}; {}", self.meaning, cost.text()),
        }
    }
}

impl Choice for AreaPlace {
    const WORDS: &'static [Word<Self>] =
        &[Word::new("dem", Self::CoverDem, "the largest rectangle of load modules that the sources cover")];
}

impl Choice for DemSource {
    const WORDS: &'static [Word<Self>] =
        &[Word::new("sample", Self::Sample { seed: 0 }, "the built-in basin-and-range terrain")];
}

impl Choice for Resampling {
    const WORDS: &'static [Word<Self>] = &[
        Word::new("bilinear", Self::Bilinear, "heights between posts come from the four around"),
        Word::new("cubic", Self::Cubic, "heights between posts come from the sixteen around"),
    ];
}

impl Choice for SampleClass {
    const WORDS: &'static [Word<Self>] =
        &[Word::new("mountains", Self::Mountains, "mountain blocks of the built-in terrain")];
}

impl Choice for Smooth {
    const WORDS: &'static [Word<Self>] = &[
        Word::new("binomial-7", Self::Binomial7, "weights are softened across 7 x 7 posts"),
        Word::new("none", Self::None, "weights change from post to post"),
    ];
}

impl Choice for TileOrder {
    const WORDS: &'static [Word<Self>] = &[
        Word::new("colour", Self::Color, "four colours: most tiles at once"),
        Word::new("raster", Self::Raster, "row by row: a wave front of tiles"),
    ];
}

impl Choice for Borders {
    const WORDS: &'static [Word<Self>] = &[
        Word::new("inherit", Self::Inherit, "a tile takes over the border points of its lower-ranked neighbours"),
        Word::new("regular", Self::Regular, "seams hold a point every border step, no others"),
    ];
}

impl Choice for OuterBorder {
    const WORDS: &'static [Word<Self>] = &[
        Word::new("refined", Self::Refined, "points on the outer border are chosen as others are, within the limits"),
        Word::new("fixed", Self::Fixed, "a point every border step and no others, as in an area beside this one"),
    ];
}

impl Choice for Edges {
    const WORDS: &'static [Word<Self>] = &[
        Word::new("constrained", Self::Constrained, "module lines are edges of the TIN from the start"),
        Word::new("clip", Self::Clip(ClipHeights::Coplanar), "triangles are cut at module lines after merging"),
    ];
}

impl Choice for ClipHeights {
    const WORDS: &'static [Word<Self>] = &[
        Word::new("coplanar", Self::Coplanar, "pieces of a triangle keep its plane"),
        Word::new("dem", Self::Dem, "cut vertices take the height of the DEM"),
    ];
}

impl Choice for Count {
    const WORDS: &'static [Word<Self>] = &[
        Word::new("triangles", Self::Triangles, "limits count triangles, clipped pieces fanned"),
        Word::new("polygons", Self::Polygons, "limits count convex polygons, as clipping leaves them"),
    ];
}

impl Choice for MethodName {
    const WORDS: &'static [Word<Self>] = &[
        Word::new("optimised", Self::Optimised, "lowest RMS residual under the limits"),
        Word::costing(
            "paper",
            Self::Paper,
            "the founding paper's: largest residual first, in batches",
            Residual("2.3 times the RMS residual"),
        ),
        Word::costing("greedy", Self::Greedy, "one worst post at a time", Residual("twice the RMS residual")),
    ];
}

impl Choice for ErrorKey {
    const WORDS: &'static [Word<Self>] = &[
        Word::new("max", Self::Max, "a post is worth its weighted residual"),
        Word::new("sse", Self::Sse, "a triangle is worth its weighted squared residuals"),
    ];
}

impl Choice for Allocation {
    const WORDS: &'static [Word<Self>] = &[
        Word::new("global", Self::Global, "tiles share by what a survey says they gain"),
        Word::costing("equal", Self::Equal, "every tile gets the same share", Residual("11 to 17 % more RMS residual")),
    ];
}

impl Choice for Effort {
    const WORDS: &'static [Word<Self>] = &[
        Word::costing(
            "fast",
            Self::Fast,
            "chosen posts are moved, edges flipped: 44 % less RMS residual than paper",
            Seconds(3.3),
        ),
        Word::costing(
            "normal",
            Self::Normal,
            "more posts are chosen, thinned, exchanged: 23 % less RMS residual than fast",
            Seconds(36.0),
        ),
        Word::costing(
            "best",
            Self::Best,
            "more still, grown and thinned in turns: 5 % less RMS residual than normal",
            Seconds(137.0),
        ),
    ];
}

impl Choice for HeightFit {
    const WORDS: &'static [Word<Self>] = &[
        Word::costing(
            "l2",
            Self::Squares,
            "vertices stand where squared residuals are least",
            Residual("4 % less RMS residual, crests are shaved"),
        ),
        Word::new(
            "l2_keep_crests",
            Self::SquaresKeepCrests,
            "vertices stand where squared residuals are least, crests at DEM height",
        ),
        Word::costing("off", Self::Off, "vertices stand at DEM height", Residual("16 % more RMS residual")),
    ];
}

impl Choice for Lattice {
    const WORDS: &'static [Word<Self>] = &[
        Word::new("eighth", Self::Eighth, "vertices stand on eighths of a post, those on lines between tiles on posts"),
        Word::costing("post", Self::Post, "vertices stand on posts", Residual("9 to 15 % more RMS residual")),
    ];
}

impl Choice for LastBatch {
    const WORDS: &'static [Word<Self>] = &[
        Word::new("truncate", Self::Truncate, "the last batch is cut to meet the points"),
        Word::new("finish", Self::Finish, "the last batch goes in whole"),
    ];
}

impl Choice for StartMethod {
    const WORDS: &'static [Word<Self>] = &[
        Word::new("vip", Self::Vip, "very important points, no border forced"),
        Word::new("highlow", Self::HighLow, "peaks and pits, whose number is the ground's"),
        Word::new("lattice", Self::Lattice, "a grid refined where it fails"),
        Word::new("fowler-little", Self::FowlerLittle, "ridges and channels first"),
        Word::new("hierarchical", Self::Hierarchical, "triangles split into three"),
        Word::new("earlier", Self::Earlier, "one post for each region of residuals"),
        Word::new("regular", Self::Regular, "a regular grid"),
        Word::new("contour", Self::Contour, "contour lines"),
    ];
}

impl Choice for LodBorder {
    const WORDS: &'static [Word<Self>] = &[
        Word::new("full", Self::Full, "levels keep all vertices on sides: any two fit together"),
        Word::new("own", Self::Own, "levels keep their share on sides, too: equal levels fit together"),
    ];
}
