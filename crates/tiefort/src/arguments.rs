//! Arguments that several commands share, and how their values are read.

use std::path::PathBuf;

use build::product::WantedGround;
use clap::builder::{PossibleValue, PossibleValuesParser, StyledStr, TypedValueParser};
use clap::{Args, ValueEnum};
use exports::Coordinates;
use job::{Choice, Job, StartMethod};
use serde_json::Value;
use terrain::TileId;

use crate::resources;
use crate::terminal::{self, NotPrinted};

/// Most workers that may be asked for: each is a thread with a tile's memory.
const WORKERS_MAX: i64 = 1024;

/// Whom a command answers.
#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Format {
    /// For a person
    Text,
    /// For a program
    Json,
}

impl Format {
    /// Prints what was found: as text, or as an object, indented.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn print(self, text: impl FnOnce() -> String, json: impl FnOnce() -> Value) -> Result<(), NotPrinted> {
        terminal::print(&match self {
            Format::Text => text(),
            Format::Json => format!("{:#}\n", json()),
        })
    }
}

/// How many tasks run at once.
#[derive(Args, Clone, Debug)]
pub struct Workers {
    /// Tasks at once [default: one per core, fewer where memory or a cgroup is short]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=WORKERS_MAX))]
    workers: Option<u32>,
}

impl Workers {
    /// What was asked for, or one worker per core that this process may use.
    pub fn count(&self) -> usize {
        self.workers.map_or_else(resources::cores, |workers| workers as usize)
    }

    /// What was asked for, or as many as cores and memory allow for `job`; and a remark where memory decides.
    pub fn for_job(&self, job: &Job) -> (usize, Option<String>) {
        let forecast = build::plan(job).map(|plan| plan.forecast);
        match forecast {
            Ok(forecast) => resources::workers(self.workers.map(|workers| workers as usize), &forecast),
            // The run itself says what is wrong with the job.
            Err(_) => (self.count(), None),
        }
    }
}

/// What a database is measured against.
#[derive(Args, Clone, Debug)]
pub struct Against {
    /// A raster to take for the ground; several are joined as those of a job are [default: what the database was built
    /// from]
    #[arg(long = "against", value_name = "DEM")]
    rasters: Vec<PathBuf>,
}

impl Against {
    /// The rasters that were named; none where it is the ground that the database was built from.
    pub fn rasters(&self) -> &[PathBuf] {
        &self.rasters
    }

    /// Whether rasters were named.
    pub fn is_named(&self) -> bool {
        !self.rasters.is_empty()
    }

    /// The ground that is wanted.
    pub fn ground(&self) -> WantedGround<'_> {
        wanted_ground(&self.rasters)
    }

    /// Tells where rasters that were named have a height at a share of the posts only.
    pub fn tell_covered(&self, share: f64) {
        if self.is_named() && share < 1.0 {
            let names: Vec<String> = self.rasters.iter().map(|path| path.display().to_string()).collect();
            // A few posts without a height are never told as all of them.
            let percent = (1000.0 * share).floor() / 10.0;
            terminal::tell(&format!(
                "note: {}: heights at {percent:.1} % of the posts; the rest is in no figure\n\
                 hint: --against may be given several times: rasters are joined",
                names.join(", ")
            ));
        }
    }
}

/// The ground of rasters, or that a database was built from where there are none.
pub fn wanted_ground(rasters: &[PathBuf]) -> WantedGround<'_> {
    if rasters.is_empty() { WantedGround::Recorded } else { WantedGround::Rasters(rasters) }
}

/// How a run is followed on stderr.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Log {
    /// Words
    Text,
    /// One JSON object a line
    Json,
}

/// What `build` and `tile` have in common.
#[derive(Args, Clone, Debug)]
pub struct RunArguments {
    /// Folder of the terrain database [default: NAME.tdb here, NAME being area.name of the job]
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    #[command(flatten)]
    pub workers: Workers,
    /// Do not draw report.html; `tiefort report --format html` does later
    #[arg(long)]
    pub no_html: bool,
    /// Exit with 2 on any warning or breach
    #[arg(long)]
    pub strict: bool,
    /// Print errors only
    #[arg(long)]
    pub quiet: bool,
    /// Tell everything on stderr: every tile, how long it took and why it was made again
    #[arg(short, long, conflicts_with = "quiet")]
    pub verbose: bool,
    /// How everything is told on stderr; json implies -v
    #[arg(long, value_name = "FORMAT", conflicts_with = "quiet")]
    pub log: Option<Log>,
    /// Print events as JSON lines on stdout; the last one, "summary", holds the report
    #[arg(long)]
    pub json: bool,
}

impl RunArguments {
    /// Where the database of `job` goes.
    pub fn folder(&self, job: &Job) -> PathBuf {
        self.out.clone().unwrap_or_else(|| PathBuf::from(format!("{}.tdb", job.area.name)))
    }
}

/// Reads `ROW,COL`.
///
/// # Errors
/// In words, when it is anything else.
pub fn row_col(text: &str) -> Result<TileId, String> {
    let pair = text.split_once(',').and_then(|(row, col)| Some((row.parse().ok()?, col.parse().ok()?)));
    let (row, col) = pair.ok_or("expected ROW,COL, two whole numbers counted from the south-west, such as 2,3")?;
    Ok(TileId { row, col })
}

/// Reads `ROWSxCOLUMNS`, each at least 1.
///
/// # Errors
/// In words, when it is anything else.
pub fn rows_by_columns(text: &str) -> Result<(u32, u32), String> {
    let pair = text.split_once('x').and_then(|(rows, columns)| Some((rows.parse().ok()?, columns.parse().ok()?)));
    match pair {
        Some((rows, columns)) if 0 < rows && 0 < columns => Ok((rows, columns)),
        _ => Err("expected ROWSxCOLUMNS, such as 6x6".into()),
    }
}

/// Reads what the coordinates of a mesh are counted from.
pub fn coordinates() -> impl TypedValueParser<Value = Coordinates> {
    one_of([
        ("local", Coordinates::Local, "The south-west corner of what is written"),
        ("map", Coordinates::Map, "The map's origin"),
    ])
}

/// Reads a finite number above zero.
///
/// # Errors
/// In words, when it is anything else.
pub fn positive(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(number) if number.is_finite() && 0.0 < number => Ok(number),
        _ => Err("expected a number above 0".into()),
    }
}

/// Reads `METHOD:N`, or `METHOD` alone of one whose number is the ground's choice.
pub fn start_method(text: &str) -> Result<(StartMethod, Option<usize>), String> {
    let (name, points) = text.split_once(':').map_or((text, None), |(name, points)| (name, Some(points)));
    let method =
        *StartMethod::named(name).ok_or_else(|| format!("expected METHOD:N with one of {}", start_methods()))?;
    match (method, points) {
        (StartMethod::HighLow, None) => Ok((method, None)),
        (StartMethod::HighLow, Some(_)) => Err("expected highlow alone: it takes all peaks and pits".into()),
        (_, points) => {
            let points = points.and_then(|points| points.parse().ok()).filter(|&points| 0 < points);
            let points = points.ok_or_else(|| format!("expected {name}:N, such as {name}:1000"))?;
            Ok((method, Some(points)))
        }
    }
}

/// The names of the methods that a mesh can start from.
pub fn start_methods() -> String {
    StartMethod::WORDS.iter().map(|word| word.name).collect::<Vec<_>>().join(", ")
}

/// Reads one of the words of a job's setting.
pub fn choice<T: Choice + Clone + Send + Sync>() -> impl TypedValueParser<Value = T> {
    one_of(T::WORDS.iter().map(|word| (word.name, word.value.clone(), word.text())))
}

/// Reads one of these words, each with what it stands for; help lists them with their meanings.
pub fn one_of<T: Clone + Send + Sync + 'static>(
    words: impl IntoIterator<Item = (&'static str, T, impl Into<StyledStr>)>,
) -> impl TypedValueParser<Value = T> {
    let (possible, known): (Vec<PossibleValue>, Vec<(&str, T)>) = words
        .into_iter()
        .map(|(word, value, meaning)| (PossibleValue::new(word).help(meaning.into()), (word, value)))
        .unzip();
    PossibleValuesParser::new(possible).map(move |found| {
        let known = known.iter().find(|(word, _)| *word == found);
        known.expect("only these words are possible").1.clone()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tile_is_two_whole_numbers_row_first() {
        assert_eq!(row_col("2,3"), Ok(TileId { row: 2, col: 3 }));
        for wrong in ["2", "2,", "-1,0", "2x3", "2,3,4", "2, 3", ""] {
            assert!(row_col(wrong).is_err(), "{wrong:?} was read");
        }
    }

    #[test]
    fn a_grid_of_tiles_has_at_least_one() {
        assert_eq!(rows_by_columns("6x4"), Ok((6, 4)));
        for wrong in ["6", "0x1", "1x0", "6,4", "6x4x2"] {
            assert!(rows_by_columns(wrong).is_err(), "{wrong:?} was read");
        }
    }

    #[test]
    fn a_length_is_finite_and_above_zero() {
        assert_eq!(positive("31.25"), Ok(31.25));
        for wrong in ["0", "-1", "inf", "nan", "1e999", "x"] {
            assert!(positive(wrong).is_err(), "{wrong:?} was read");
        }
    }
}
