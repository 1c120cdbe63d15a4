//! `tiefort correlate`: whether two surfaces of one area agree well enough for a fair fight.

use std::io::Write;
use std::path::PathBuf;
use std::sync::atomic::AtomicBool;

use clap::Args;
use exports::Step;
use inspect::{CorrelateRequest, Correlation, Demand, SAMPLES_MAX};
use load_module_reader::Standing;
use views::{certificate_html, certificate_text};

use crate::arguments::{Format, Workers, positive};
use crate::certificate::certificate;
use crate::failure::{Failure, Outcome};
use crate::steps::Steps;
use crate::{correlation_json, files, places};

const AFTER_HELP: &str = "\
Examples:
  tiefort correlate before.tdb after.tdb --page certificate.html
  tiefort correlate desert.tdb desert.tif --within 2 --accept 0.9
  tiefort correlate before.tdb after.tdb --format json | jq .causes

Places are drawn at random over what both reach, as many as a plan of acceptance
sampling needs. Each of these is accepted or not: heights, slopes, and lines of
sight 1, 2.5 and 10 m above the ground. A place where only one has ground does
not agree; one where neither has is drawn again.

Exit codes: 0 accepted; 1 not accepted; 2 nothing to compare.";

/// Arguments of `correlate`.
#[derive(Args)]
#[command(after_help = AFTER_HELP)]
pub struct Arguments {
    /// Folder of a terrain database
    #[arg(value_name = "A")]
    first: PathBuf,
    /// Folder of another one, or a raster of heights, in the same coordinate system
    #[arg(value_name = "B")]
    second: PathBuf,
    /// The share of the area, and of the lines of sight, that has to agree
    #[arg(long, value_name = "SHARE", default_value_t = 0.95, value_parser = share)]
    accept: f64,
    /// The chance of accepting where less than that agrees
    #[arg(long, value_name = "CHANCE", default_value_t = 0.05, value_parser = risk)]
    risk: f64,
    /// Metres by which heights may differ
    #[arg(long, value_name = "M", default_value_t = 1.0, value_parser = positive)]
    within: f64,
    /// Degrees by which slopes may differ
    #[arg(long, value_name = "DEGREES", default_value_t = 5.0, value_parser = positive)]
    slope_within: f64,
    /// Places, and pairs of places, to look at [default: as many as the plan needs]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=SAMPLES_MAX))]
    samples: Option<u64>,
    /// Farthest target of a line of sight, in metres
    #[arg(long, value_name = "M", default_value_t = 3000.0, value_parser = range)]
    range: f64,
    /// What lines of sight look at where both have it: none, buildings (with walls), or all
    #[arg(long, value_name = "WHICH", value_parser = places::standing, default_value = "all")]
    objects: Standing,
    /// What places are drawn from: the same seed, the same places
    #[arg(long, value_name = "S", default_value_t = 1)]
    seed: u64,
    /// Compare heights above different vertical datums as they are
    #[arg(long)]
    allow_datums: bool,
    /// Also write the certificate as a page
    #[arg(long, value_name = "FILE.html")]
    page: Option<PathBuf>,
    /// For a person or a program
    #[arg(long, value_enum, default_value_t = Format::Text)]
    format: Format,
    #[command(flatten)]
    workers: Workers,
    /// Show no progress
    #[arg(long)]
    quiet: bool,
}

/// Farthest target that may be asked for, in metres: the ground as far around is held in memory.
const RANGE_M_MAX: f64 = 50_000.0;

fn share(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(share) if 0.0 < share && share < 1.0 => Ok(share),
        Ok(1.0) => Err("expected a share below 1: no sample shows that all of an area agrees".into()),
        _ => Err("expected a share above 0 and below 1, such as 0.95".into()),
    }
}

fn risk(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(risk) if 0.0 < risk && risk <= 0.5 => Ok(risk),
        Ok(0.0) => Err("expected a chance above 0: every sample may mislead".into()),
        _ => Err("expected a chance above 0 and at most 0.5, such as 0.05".into()),
    }
}

fn range(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(range_m) if (inspect::NEAREST_M..=RANGE_M_MAX).contains(&range_m) => Ok(range_m),
        _ => Err(format!("expected {} to {RANGE_M_MAX} m", inspect::NEAREST_M)),
    }
}

/// Compares.
pub fn run(arguments: &Arguments) -> Result<Outcome, Failure> {
    let steps = Steps::start(arguments.quiet);
    let found = found(arguments, &AtomicBool::new(false), &steps)?;
    arguments.format.print(|| certificate_text(&certificate(&found)), || correlation_json::to_json(&found))?;
    Ok(if found.is_accepted() { Outcome::Sound } else { Outcome::Differ })
}

/// What `--format json` prints with these arguments.
///
/// # Errors
/// When there is nothing to compare, or the page cannot be written.
pub fn json_text(arguments: &Arguments, stop: &AtomicBool) -> Result<String, Failure> {
    Ok(correlation_json::to_json(&found(arguments, stop, &Steps::start(true))?).to_string())
}

/// What is found, with the page written where one is asked for.
fn found(arguments: &Arguments, stop: &AtomicBool, steps: &Steps) -> Result<Correlation, Failure> {
    if let Some(path) = &arguments.page {
        files::check_writable(path)?;
    }
    let request = CorrelateRequest {
        demand: Demand { share: arguments.accept, risk: arguments.risk },
        samples: arguments.samples,
        within_m: arguments.within,
        slope_within_degrees: arguments.slope_within,
        range_m: arguments.range,
        standing: arguments.objects,
        seed: arguments.seed,
        allow_datums: arguments.allow_datums,
    };
    let (first, second) = (&arguments.first, &arguments.second);
    let tell = |what, done, total| steps.tell(Step { what, done, total });
    let found = inspect::correlate(first, second, &request, (arguments.workers.count(), stop, &tell));
    steps.finish();
    let found = found?;
    if let Some(path) = &arguments.page {
        files::write_whole(path, |out| out.write_all(certificate_html(&certificate(&found)).as_bytes()))?;
    }
    Ok(found)
}
