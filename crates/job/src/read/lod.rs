//! `[lod]`: coarser levels of load modules.

use crate::bounds::COARSER_LEVELS_MAX;
use crate::entry::{Entry, Section};
use crate::{FeaturesSpec, JobError, LodSpec};

pub(super) fn read(lod: &Section, features: Option<&FeaturesSpec>) -> Result<LodSpec, JobError> {
    let inner_shares = lod.maybe("levels", inner_shares)?.unwrap_or_default();
    let border = match lod.optional("border") {
        Some(entry) if inner_shares.is_empty() => {
            let hint = "it says what coarser levels keep of the sides: add levels, or leave it out";
            return Err(entry.conflict("no levels", "a job without this key", hint));
        }
        _ => lod.word("border")?,
    };
    let leave_out = match lod.optional("levels") {
        Some(entry) => entry.list()?.iter().map(|level| leave_out(level, features)).collect::<Result<_, _>>()?,
        None => Vec::new(),
    };
    Ok(LodSpec { inner_shares, border, leave_out })
}

/// Classes of features that a level leaves out.
fn leave_out(level: &Entry, features: Option<&FeaturesSpec>) -> Result<Vec<String>, JobError> {
    let Some(entry) = level.table()?.optional("leave_out") else { return Ok(Vec::new()) };
    let Some(features) = features else {
        let hint = "remove it, or name files of roads and water in [features]";
        return Err(entry.conflict("no [features]", "a job with roads and water", hint));
    };
    let known = features.classes();
    let mut classes = Vec::new();
    for item in entry.list()? {
        let name = item.text()?;
        if !known.iter().any(|class| class == name) {
            let hint = format!("they are {}", known.join(", "));
            return Err(item.out_of_range_with("a class of features", hint));
        }
        classes.push(name.to_owned());
    }
    Ok(classes)
}

fn inner_shares(levels: &Entry) -> Result<Vec<f64>, JobError> {
    let entries = levels.list()?;
    if COARSER_LEVELS_MAX < entries.len() {
        let hint = "the finest level is always there and is not listed";
        return Err(levels.out_of_range_with(levels.expected(), hint));
    }
    let mut shares: Vec<f64> = Vec::new();
    for entry in entries {
        let share = entry.table()?.required("inner_share")?;
        let number = share.number()?;
        if number <= 0.0 || 1.0 <= number {
            return Err(share.out_of_range(share.expected()));
        }
        if let Some(&finer) = shares.last().filter(|&&finer| finer <= number) {
            let expected = format!("less than {finer}, the share of the level before");
            return Err(share.out_of_range_with(expected, "levels go from fine to coarse"));
        }
        shares.push(number);
    }
    Ok(shares)
}
