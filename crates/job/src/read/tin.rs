//! `[tin]`: how posts are chosen, and points that a job gives: `tin.start` and `tin.pins`.
//!
//! Which keys may stand there depends on the method; a key that the method would ignore is refused.

use std::path::Path;

use terrain::QUANTA_PER_METRE;

use crate::bounds::{EYE_M, QUANTUM_M_MAX, RESIDUAL_M_MAX};
use crate::entry::{Entry, Section};
use crate::files::{Mention, Place};
use crate::{
    Allocation, Budget, Choice, Edges, Effort, ErrorKey, JobError, Method, MethodName, NamedFile, Optimising,
    Proximity, Sight, Start, StartMethod, TinSpec, keys,
};

pub(super) fn read(
    tin: &Section,
    modules: &Section,
    edges: Edges,
    given: (Option<Start>, Option<NamedFile>),
) -> Result<TinSpec, JobError> {
    let name = tin.word("method")?;
    refuse_keys_of_other_methods(tin, name)?;
    let method = match name {
        MethodName::Paper => Method::Paper { proximity: proximity(tin)?, last_batch: tin.word("last_batch")? },
        MethodName::Greedy => Method::Greedy,
        MethodName::Optimised => {
            let effort = tin.word("effort")?;
            let (height_fit, lattice) = (tin.word("height_fit")?, tin.word("lattice")?);
            Method::Optimised(Optimising { effort, height_fit, lattice, sight: sight(tin, effort)? })
        }
    };
    let max_residual_m = tin.maybe("max_residual_m", Entry::number)?;
    let target_rms_m = tin.maybe("target_rms_m", Entry::number)?;
    let budget = match tin.optional("points") {
        Some(entry) => Budget::Points(entry.whole()?),
        None => Budget::Limits,
    };
    let residual_given = max_residual_m.is_some() || target_rms_m.is_some();
    if name == MethodName::Paper && budget == Budget::Limits && !residual_given {
        let hint = "the paper's area of 50 km x 50 km has points = 76500; max_residual_m or target_rms_m will do too";
        return Err(tin.missing("points", "a number of selected points, which method = \"paper\" stops at", hint));
    }
    check_edges(tin, modules, edges, name, !residual_given && budget == Budget::Limits)?;
    Ok(TinSpec {
        method,
        key: key(tin, name)?,
        budget,
        allocation: allocation(tin, name)?,
        residual_quantum: residual_quantum(tin, name)?,
        max_residual_m,
        target_rms_m,
        start: given.0,
        pins: given.1,
    })
}

/// Refuses what the chosen method would not look at.
fn refuse_keys_of_other_methods(tin: &Section, name: MethodName) -> Result<(), JobError> {
    for key in keys::table("tin").iter().filter(|key| !key.methods.is_empty() && !key.methods.contains(&name)) {
        let hint = match (name, key.name) {
            (MethodName::Paper, _) => PAPER,
            (MethodName::Greedy, _) => GREEDY,
            (MethodName::Optimised, "points") => OPTIMISED_POINTS,
            (MethodName::Optimised, _) => OPTIMISED,
        };
        if let Some(entry) = tin.optional(key.name) {
            return Err(entry.conflict(&format!("method = \"{}\"", name.name()), "a job without this key", hint));
        }
    }
    Ok(())
}

const PAPER: &str = "it belongs to method = \"optimised\"; the paper's vertices stay on posts at DEM height";
const GREEDY: &str = "greedy takes one worst post at a time; batches belong to \"paper\", fitting to \"optimised\"";
const OPTIMISED: &str = "it belongs to method = \"paper\"";
const OPTIMISED_POINTS: &str =
    "the budget of \"optimised\" is the limits: lower limits.mean_per_load_module, or choose \"greedy\" or \"paper\"";

/// Clipped edges go only with methods whose TIN a merge does not undo, and need an end other than the limits, which
/// are known only after the clip.
fn check_edges(
    tin: &Section,
    modules: &Section,
    edges: Edges,
    name: MethodName,
    endless: bool,
) -> Result<(), JobError> {
    let (Edges::Clip(_), Some(clip)) = (edges, modules.optional("edges")) else { return Ok(()) };
    if name == MethodName::Optimised {
        let entry = tin.optional("method").unwrap_or(clip);
        let beside =
            if tin.optional("method").is_some() { "edges = \"clip\"" } else { "method = \"optimised\" (the default)" };
        return Err(entry.conflict(
            beside,
            "constrained edges, since merging and clipping would undo what is optimised",
            "write edges = \"constrained\" in [load_modules], or method = \"paper\" in [tin]",
        ));
    }
    if endless {
        let hint = "counts are known only after the clip, so give points, max_residual_m or target_rms_m";
        return Err(tin.missing("points", "an end of the choosing, with edges = \"clip\"", hint));
    }
    Ok(())
}

fn key(tin: &Section, name: MethodName) -> Result<ErrorKey, JobError> {
    let Some(entry) = tin.optional("key") else {
        return Ok(if name == MethodName::Optimised { ErrorKey::Sse } else { ErrorKey::Max });
    };
    let key = entry.word()?;
    if name == MethodName::Optimised && key == ErrorKey::Max {
        let hint = "method = \"greedy\" takes either key";
        return Err(entry.conflict("method = \"optimised\"", "\"sse\", which is what it lowers", hint));
    }
    Ok(key)
}

fn allocation(tin: &Section, name: MethodName) -> Result<Allocation, JobError> {
    match tin.optional("allocation") {
        Some(entry) => entry.word(),
        None if name == MethodName::Paper => Ok(Allocation::Equal),
        None => Ok(Allocation::Global),
    }
}

/// Residuals are rounded to this many quanta: a metre, as the paper's, or not at all.
fn residual_quantum(tin: &Section, name: MethodName) -> Result<u32, JobError> {
    let Some(entry) = tin.optional("residual_quantum_m") else {
        return Ok(if name == MethodName::Paper { QUANTA_PER_METRE as u32 } else { 1 });
    };
    let quanta = entry.number()? * f64::from(QUANTA_PER_METRE);
    if quanta.fract() != 0.0 || quanta < 1.0 || QUANTUM_M_MAX * f64::from(QUANTA_PER_METRE) < quanta {
        return Err(entry.out_of_range(entry.expected()));
    }
    Ok(quanta as u32)
}

fn sight(tin: &Section, effort: Effort) -> Result<Option<Sight>, JobError> {
    let said = ["sight_eyes_m", "sight_range_m"].into_iter().find_map(|key| tin.optional(key));
    let asked = tin.maybe("sight", Entry::flag)?;
    match (asked.unwrap_or(Sight::is_usual_with(effort)), said) {
        (false, Some(entry)) => {
            let (beside, hint) = match asked {
                Some(_) => ("sight = false", "remove one of the two"),
                None => ("effort = \"fast\"", "add sight = true, or remove it"),
            };
            Err(entry.conflict(beside, "no such key, since no lines of sight count", hint))
        }
        (false, None) => Ok(None),
        (true, _) => {
            let [lowest, highest] = tin.pair("sight_eyes_m")?;
            if !(EYE_M.contains(&lowest) && EYE_M.contains(&highest) && lowest <= highest)
                && let Some(entry) = tin.optional("sight_eyes_m")
            {
                return Err(entry.out_of_range(entry.expected()));
            }
            Ok(Some(Sight::of_metres([lowest, highest], tin.number("sight_range_m")?)))
        }
    }
}

fn proximity(tin: &Section) -> Result<Option<Proximity>, JobError> {
    match (tin.flag("proximity")?, tin.optional("proximity_m")) {
        (false, Some(entry)) => {
            Err(entry.conflict("proximity = false", "no distances, since nothing is left out", "remove one of the two"))
        }
        (false, None) => Ok(None),
        (true, entry) => {
            let [horizontal_m, vertical_m] = tin.pair("proximity_m")?;
            match entry {
                Some(entry)
                    if horizontal_m < 0.0 || vertical_m < 0.0 || RESIDUAL_M_MAX < horizontal_m.max(vertical_m) =>
                {
                    Err(entry.out_of_range(entry.expected()))
                }
                _ => Ok(Some(Proximity { horizontal_m, vertical_m })),
            }
        }
    }
}

pub(super) fn given_points(
    tin: &Section,
    job: &Path,
    mentions: &mut Vec<Mention>,
) -> Result<(Option<Start>, Option<NamedFile>), JobError> {
    let start = tin.maybe("start", |entry| start(entry, job, mentions))?;
    let pins = tin.maybe("pins", |entry| file(entry, job, Place::Pins, mentions))?;
    Ok((start, pins))
}

fn file(entry: &Entry, job: &Path, place: Place, mentions: &mut Vec<Mention>) -> Result<NamedFile, JobError> {
    mentions.push(Mention { place, fault: entry.fault("a file") });
    entry.file(job)
}

fn start(entry: &Entry, job: &Path, mentions: &mut Vec<Mention>) -> Result<Start, JobError> {
    if !entry.is_table() {
        return file(entry, job, Place::Start, mentions).map(Start::File);
    }
    let table = entry.table()?;
    let method = table.required("method")?.word()?;
    let points = match (method, table.optional("points")) {
        (StartMethod::HighLow, None) => None,
        (StartMethod::HighLow, Some(points)) => {
            let hint = "it takes all peaks and pits: leave points out";
            return Err(points.conflict("method = \"highlow\"", "no number, which is the ground's choice", hint));
        }
        (_, None) => {
            let hint = "points = 1000: so many in the whole area";
            return Err(table.missing("points", "a number of points to start from", hint));
        }
        (_, Some(points)) => Some(points.whole()?),
    };
    Ok(Start::Method { method, points })
}
