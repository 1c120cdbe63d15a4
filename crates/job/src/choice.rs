//! Settings that are one of some words: every word, what it means and what it was measured to cost.
//!
//! From here follow the reader of job files, what `describe` says, the values that the command line takes, the
//! forecast of a build, and the reference in `docs/reference/job-keys.md`.

use std::mem::discriminant;

use features::{Form, Kind, RuleKind};
use terrain::{Effort, HeightFit, LastBatch, Lattice, LodBorder, ObjectKind, Resampling, Smooth, TileOrder};

use self::Cost::{Residual, Seconds};
use crate::{
    Allocation, AreaPlace, Borders, ClipHeights, Count, DemSource, Edges, ErrorKey, HeightsFrom, MethodName,
    OuterBorder, SampleClass, StartMethod,
};

/// A setting that is one of some words.
pub trait Choice: Sized + 'static {
    /// All of them, in the order in which they are listed. What a variant holds besides is not part of its word.
    const WORDS: &'static [Word<Self>];

    /// Words that there were, and what is there instead.
    const GONE: &'static [(&'static str, &'static str)] = &[];

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
#[derive(Clone, Copy, Debug)]
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

/// Kinds, with what the built-in table says of each.
const KINDS: [Word<Kind>; 11] = [
    Word::new("motorway", Kind::Motorway, "motorways and trunk roads: 12 m wide, at most 6 %, form auto"),
    Word::new("primary", Kind::Primary, "primary to tertiary roads: 7 m wide, at most 10 %, form auto"),
    Word::new("minor", Kind::Minor, "streets and other small roads: 5 m wide, at most 15 %, form auto"),
    Word::new("track", Kind::Track, "tracks: 3 m wide, at most 25 %, form line"),
    Word::new("rail", Kind::Rail, "railways: 5 m wide, at most 3 %, form auto"),
    Word::new("runway", Kind::Runway, "runways, taxiways and aprons: 45 m wide, at most 2 %, form auto"),
    Word::new("river", Kind::River, "rivers and canals: 10 m wide, falling, form line, or the polygon of its banks"),
    Word::new("stream", Kind::Stream, "streams, ditches and drains: 1 m wide, falling, form line"),
    Word::new("lake", Kind::Lake, "lakes and reservoirs: level, a polygon"),
    Word::new("dam", Kind::Dam, "dams and weirs: they split water and stay ground"),
    Word::new("breakline", Kind::Breakline, "lines that become edges of the TIN, as high as the ground or as they say"),
];

impl Choice for Kind {
    const WORDS: &'static [Word<Self>] = &KINDS;
}

impl Choice for ObjectKind {
    const WORDS: &'static [Word<Self>] = &[
        Word::new("building", Self::Building, "level roof, walls to the ground; 6 m high where nothing says more"),
        Word::new("tower", Self::Tower, "the same of towers, chimneys, silos and tanks; 30 m"),
        Word::new("wall", Self::Wall, "stretches of wall along a line, 0.5 m wide; 2 m"),
        Word::new("wood", Self::Wood, "a canopy that takes 90 % of the light in 10 m; 15 m"),
        Word::new("scrub", Self::Scrub, "a canopy that takes 50 %; 3 m"),
        Word::new("orchard", Self::Orchard, "a canopy that takes 50 %; 4 m"),
        Word::new("row", Self::Row, "a canopy along a line: a hedge, 2 m wide and high, or a row of trees, 6 and 12 m"),
    ];
}

impl Choice for RuleKind {
    const WORDS: &'static [Word<Self>] = &RULE_KINDS;

    fn word(&self) -> &'static Word<Self> {
        // All kinds are one variant.
        Self::WORDS.iter().find(|word| word.value == *self).expect("only what a job can say is asked for its word")
    }
}

/// What a rule can say of its kind: the kinds, and that there is none.
const RULE_KINDS: [Word<RuleKind>; 12] = {
    let none = Word::new("none", RuleKind::None, "left out");
    let mut words = [none; 12];
    let mut at = 0;
    while at < KINDS.len() {
        words[at] = Word::new(KINDS[at].name, RuleKind::Is(KINDS[at].value), KINDS[at].meaning);
        at += 1;
    }
    words
};

impl Choice for Form {
    /// Polygons have no word: shapes and tags say what is one.
    const WORDS: &'static [Word<Self>] = &[
        Word::new("line", Self::Line, "the centreline: about 2 triangles a station"),
        Word::new("auto", Self::Strip, "a strip over the whole of a road where limits leave room, else a line"),
        Word::new("strip", Self::StripAlways, "both edges, level across: about 4 triangles a station"),
        Word::new("bench", Self::Bench, "a strip, and where its slopes meet the ground: about 8 triangles a station"),
    ];
}

impl Choice for HeightsFrom {
    const WORDS: &'static [Word<Self>] = &[
        Word::new("dem", Self::Dem, "heights come from the DEM"),
        Word::new("feature", Self::Feature, "heights of the features' own vertices are hard"),
    ];
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
            Residual("2.5 times the RMS residual"),
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
            "more posts are chosen, thinned, moved: 53 % less RMS residual than paper",
            Seconds(3.0),
        ),
        Word::costing(
            "normal",
            Self::Normal,
            "more still, thinned by true cost, deep flips: 16 % less RMS residual than fast",
            Seconds(24.0),
        ),
        Word::costing(
            "best",
            Self::Best,
            "grown and thinned again, three times: 2 % less RMS residual than normal",
            Seconds(62.0),
        ),
    ];
}

impl Choice for HeightFit {
    const GONE: &'static [(&'static str, &'static str)] =
        &[("l2_keep_crests", "crests are kept by sight = true, at less RMS residual: leave the key out")];
    const WORDS: &'static [Word<Self>] = &[
        Word::new("l2", Self::Squares, "vertices stand where squared residuals are least"),
        Word::costing("off", Self::Off, "vertices stand at DEM height", Residual("23 % more RMS residual")),
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
