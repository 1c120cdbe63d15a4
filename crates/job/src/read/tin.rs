//! `[tin]`: how posts are chosen.
//!
//! Which keys may stand there depends on the method; a key that the method would ignore is refused.

use terrain::QUANTA_PER_METRE;

use crate::bounds::{COUNT_MAX, RESIDUAL_M_MAX};
use crate::entry::{Entry, Section};
use crate::{
    Allocation, Budget, Edges, Effort, ErrorKey, HeightFit, JobError, LastBatch, Lattice, Method, NamedFile,
    Optimising, Proximity, Start, TinSpec,
};

/// The three methods by name, before their own keys are read.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Name {
    Paper,
    Greedy,
    Optimised,
}

const METHODS: [(&str, Name); 3] = [("optimised", Name::Optimised), ("paper", Name::Paper), ("greedy", Name::Greedy)];

pub(super) fn read(
    tin: &Section,
    modules: &Section,
    edges: Edges,
    given: (Option<Start>, Option<NamedFile>),
) -> Result<TinSpec, JobError> {
    let name = tin.optional("method").map_or(Ok(Name::Optimised), |entry| entry.word(&METHODS))?;
    refuse_keys_of_other_methods(tin, name)?;
    let method = match name {
        Name::Paper => Method::Paper { proximity: proximity(tin)?, last_batch: last_batch(tin)? },
        Name::Greedy => Method::Greedy,
        Name::Optimised => Method::Optimised(optimising(tin)?),
    };
    let max_residual_m = residual(tin, "max_residual_m", 0.0)?;
    // About a hundredth of a quantum: heights are rounded to 1/128 m, so a smaller RMS means none at all.
    let target_rms_m = residual(tin, "target_rms_m", 1.0e-4)?;
    let budget = match tin.optional("points") {
        Some(entry) => Budget::Points(entry.whole(1..=COUNT_MAX, "a number of selected points")?),
        None => Budget::Limits,
    };
    let residual_given = max_residual_m.is_some() || target_rms_m.is_some();
    if name == Name::Paper && budget == Budget::Limits && !residual_given {
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
fn refuse_keys_of_other_methods(tin: &Section, name: Name) -> Result<(), JobError> {
    let refused: &[(&str, &str)] = match name {
        Name::Paper => &[("effort", PAPER), ("height_fit", PAPER), ("lattice", PAPER)],
        Name::Greedy => &[
            ("effort", GREEDY),
            ("height_fit", GREEDY),
            ("lattice", GREEDY),
            ("proximity", GREEDY),
            ("proximity_m", GREEDY),
            ("last_batch", GREEDY),
        ],
        Name::Optimised => &[
            ("points", OPTIMISED_POINTS),
            ("residual_quantum_m", OPTIMISED),
            ("proximity", OPTIMISED),
            ("proximity_m", OPTIMISED),
            ("last_batch", OPTIMISED),
        ],
    };
    let method = METHODS.iter().find(|(_, other)| *other == name).map_or("", |(word, _)| word);
    for (key, hint) in refused {
        if let Some(entry) = tin.optional(key) {
            return Err(entry.conflict(&format!("method = \"{method}\""), "a job without this key", hint));
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
fn check_edges(tin: &Section, modules: &Section, edges: Edges, name: Name, endless: bool) -> Result<(), JobError> {
    let (Edges::Clip(_), Some(clip)) = (edges, modules.optional("edges")) else { return Ok(()) };
    if name == Name::Optimised {
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

fn key(tin: &Section, name: Name) -> Result<ErrorKey, JobError> {
    let Some(entry) = tin.optional("key") else {
        return Ok(if name == Name::Optimised { ErrorKey::Sse } else { ErrorKey::Max });
    };
    let key = entry.word(&[("max", ErrorKey::Max), ("sse", ErrorKey::Sse)])?;
    if name == Name::Optimised && key == ErrorKey::Max {
        let hint = "method = \"greedy\" takes either key";
        return Err(entry.conflict("method = \"optimised\"", "\"sse\", which is what it lowers", hint));
    }
    Ok(key)
}

fn allocation(tin: &Section, name: Name) -> Result<Allocation, JobError> {
    match tin.optional("allocation") {
        Some(entry) => entry.word(&[("global", Allocation::Global), ("equal", Allocation::Equal)]),
        None if name == Name::Paper => Ok(Allocation::Equal),
        None => Ok(Allocation::Global),
    }
}

/// A residual to stop at, in metres.
fn residual(tin: &Section, key: &str, least: f64) -> Result<Option<f64>, JobError> {
    let Some(entry) = tin.optional(key) else { return Ok(None) };
    entry.number_in(least..=RESIDUAL_M_MAX, &format!("metres from {least} to {RESIDUAL_M_MAX}")).map(Some)
}

/// Residuals are rounded to this many quanta: a metre, as the paper's, or not at all.
fn residual_quantum(tin: &Section, name: Name) -> Result<u32, JobError> {
    const METRES_MAX: f64 = 1000.0;
    let Some(entry) = tin.optional("residual_quantum_m") else {
        return Ok(if name == Name::Paper { QUANTA_PER_METRE as u32 } else { 1 });
    };
    let expected = format!("metres, a positive multiple of 1/128 m up to {METRES_MAX}");
    let quanta = entry.number_in(0.0..=METRES_MAX, &expected)? * f64::from(QUANTA_PER_METRE);
    if quanta.fract() != 0.0 || quanta < 1.0 {
        return Err(entry.out_of_range(expected));
    }
    Ok(quanta as u32)
}

fn proximity(tin: &Section) -> Result<Option<Proximity>, JobError> {
    let (distances, flag) = (tin.optional("proximity_m"), tin.optional("proximity"));
    let tested = flag.map_or(Ok(true), |entry| entry.flag())?;
    match distances {
        Some(entry) if !tested => {
            Err(entry.conflict("proximity = false", "no distances, since nothing is left out", "remove one of the two"))
        }
        Some(entry) => proximity_of(&entry).map(Some),
        None if !tested => Ok(None),
        None => Ok(Some(Proximity { horizontal_m: 300.0, vertical_m: 20.0 })),
    }
}

fn proximity_of(entry: &Entry) -> Result<Proximity, JobError> {
    let expected = "[horizontal, vertical] in metres, neither negative";
    let [horizontal_m, vertical_m] = entry.pair(expected)?;
    if horizontal_m < 0.0 || vertical_m < 0.0 || RESIDUAL_M_MAX < horizontal_m.max(vertical_m) {
        return Err(entry.out_of_range(format!("{expected} nor above {RESIDUAL_M_MAX}")));
    }
    Ok(Proximity { horizontal_m, vertical_m })
}

fn optimising(tin: &Section) -> Result<Optimising, JobError> {
    let usual = Optimising::default();
    let efforts = [("fast", Effort::Fast), ("normal", Effort::Normal), ("best", Effort::Best)];
    let heights =
        [("l2", HeightFit::Squares), ("l2_keep_crests", HeightFit::SquaresKeepCrests), ("off", HeightFit::Off)];
    let lattices = [("eighth", Lattice::Eighth), ("post", Lattice::Post)];
    Ok(Optimising {
        effort: tin.optional("effort").map_or(Ok(usual.effort), |entry| entry.word(&efforts))?,
        height_fit: tin.optional("height_fit").map_or(Ok(usual.height_fit), |entry| entry.word(&heights))?,
        lattice: tin.optional("lattice").map_or(Ok(usual.lattice), |entry| entry.word(&lattices))?,
    })
}

fn last_batch(tin: &Section) -> Result<LastBatch, JobError> {
    match tin.optional("last_batch") {
        Some(entry) => entry.word(&[("truncate", LastBatch::Truncate), ("finish", LastBatch::Finish)]),
        None => Ok(LastBatch::Truncate),
    }
}
