//! `tiefort correlate`: whether two surfaces of one area agree well enough for a fair fight.

use std::io::Write;
use std::path::PathBuf;
use std::sync::atomic::AtomicBool;

use clap::Args;
use exports::Step;
use inspect::{
    Confusion, CorrelateRequest, Correlation, Criterion, Demand, HeightFigures, SAMPLES_MAX, SLOPE_ENDS_DEGREES, Shift,
};
use load_module_reader::Standing;
use serde_json::{Value, json};
use views::{certificate_html, certificate_text};

use crate::arguments::{Format, Workers, positive};
use crate::certificate::certificate;
use crate::failure::{Failure, Outcome};
use crate::measures_json::{measured, where_any};
use crate::steps::Steps;
use crate::{files, places};

const AFTER_HELP: &str = "\
Examples:
  tiefort correlate before.tdb after.tdb --page certificate.html
  tiefort correlate desert.tdb desert.tif --within 2 --accept 0.9
  tiefort correlate before.tdb after.tdb --format json | jq .causes

Places are drawn at random over what both reach, as many as a plan of acceptance
sampling needs. Each of these is accepted or not: heights, slopes, and lines of
sight 1, 2.5 and 10 m above the ground. A place where only one has ground, and
a line over a hole of one, does not agree; over a hole of both it is drawn again.

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
    arguments.format.print(|| certificate_text(&certificate(&found)), || to_json(&found))?;
    Ok(if found.is_accepted() { Outcome::Sound } else { Outcome::Differ })
}

/// What `--format json` prints with these arguments.
///
/// # Errors
/// When there is nothing to compare, or the page cannot be written.
pub fn json_text(arguments: &Arguments, stop: &AtomicBool) -> Result<String, Failure> {
    Ok(to_json(&found(arguments, stop, &Steps::start(true))?).to_string())
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

/// All of it.
fn to_json(found: &Correlation) -> Value {
    let request = &found.request;
    json!({
        "tiefort": env!("CARGO_PKG_VERSION"),
        "accepted": found.is_accepted(),
        "causes": found.causes,
        "notes": found.notes,
        "a": found.surfaces[0],
        "b": found.surfaces[1],
        "common_m": found.common_m,
        "plan": {
            "accept": request.demand.share,
            "risk": request.demand.risk,
            "samples": found.plan.samples,
            "failures_max": found.plan.failures_max,
            "seed": request.seed,
            "within_m": request.within_m,
            "slope_within_degrees": request.slope_within_degrees,
            "range_m": request.range_m,
            "objects": places::standing_word(found.standing),
        },
        "criteria": found.criteria.iter().map(criterion).collect::<Vec<_>>(),
        "places": {
            "ground_in_a_only": found.only_one[0],
            "ground_in_b_only": found.only_one[1],
            "void_in_both": found.void_places,
            "slopes_in_a_only": found.slopes.only_one[0],
            "slopes_in_b_only": found.slopes.only_one[1],
            "pairs_over_ground_of_a_only": found.only_one_pairs[0],
            "pairs_over_ground_of_b_only": found.only_one_pairs[1],
            "pairs_left_out": found.void_pairs,
        },
        "heights": heights(&found.heights),
        "shift": found.shift.as_ref().map(|shift| shift_json(shift, found)),
        "feet": found.feet.map(|feet| json!({
            "in": if feet.which == 0 { "a" } else { "b" },
            "rms_before": feet.rms[0],
            "rms_after": feet.rms[1],
        })),
        "slopes": {
            "apart_m": found.slopes.apart_m,
            "ends_degrees": SLOPE_ENDS_DEGREES,
            "rms_degrees": where_any(0 < found.slopes.classes.total(), found.slopes.rms_degrees),
            "classes": confusion(&found.slopes.classes),
        },
        "classes": found.classes.iter().map(|class| json!({
            "name": class.name,
            "heights": heights(&class.heights),
        })).collect::<Vec<_>>(),
        "sights": found.sights.iter().map(|sight| json!({
            "above_m": sight.above_m,
            "hidden_seen": confusion(&sight.pairs),
        })).collect::<Vec<_>>(),
        "map": found.map,
    })
}

fn criterion(criterion: &Criterion) -> Value {
    let agreement = criterion.agreement();
    let more = json!({
        "agreement": agreement.map(|(share, _)| share),
        "interval": agreement.map(|(_, interval)| interval),
        "accepted": criterion.is_accepted(),
    });
    measured(true, criterion, more)
}

fn heights(figures: &HeightFigures) -> Value {
    let [p50, p90, p95, p99] = figures.absolute_m;
    let largest_at_m = (0 < figures.places).then_some(figures.largest_at_m);
    let more = json!({ "p50_m": p50, "p90_m": p90, "p95_m": p95, "p99_m": p99, "largest_at_m": largest_at_m });
    measured(0 < figures.places, figures, more)
}

fn shift_json(shift: &Shift, found: &Correlation) -> Value {
    let level = |metres: f64| where_any(shift.is_level_told, metres);
    let part = |of: [f64; 3]| json!({ "east_m": level(of[0]), "north_m": level(of[1]), "up_m": of[2] });
    json!({
        "moves_b_by": part(shift.by_m),
        "standard_error": part(shift.error_m),
        "rms_before_m": shift.rms_m[0],
        "rms_after_m": shift.rms_m[1],
        "is_aside": shift.is_aside(found.spacing_m()),
        "is_up": shift.is_up(found.request.within_m),
    })
}

fn confusion<const N: usize>(table: &Confusion<N>) -> Value {
    let kappa = table.kappa();
    json!({
        "a_by_b": table.0.iter().map(|row| row.to_vec()).collect::<Vec<_>>(),
        "samples": table.total(),
        "agreement": where_any(0 < table.total(), table.agreeing() as f64 / table.total().max(1) as f64),
        "kappa": kappa.map(|kappa| kappa.kappa),
        "kappa_interval": kappa.map(|kappa| kappa.interval),
    })
}
