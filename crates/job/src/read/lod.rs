//! `[lod]`: coarser levels of load modules.

use crate::bounds::COARSER_LEVELS_MAX;
use crate::entry::{Entry, Section};
use crate::{JobError, LodSpec};

pub(super) fn read(lod: &Section) -> Result<LodSpec, JobError> {
    let inner_shares = lod.optional("levels").map_or(Ok(Vec::new()), |entry| inner_shares(&entry))?;
    let border = match lod.optional("border") {
        Some(entry) if inner_shares.is_empty() => {
            let hint = "it says what coarser levels keep of the sides: add levels, or leave it out";
            return Err(entry.conflict("no levels", "a job without this key", hint));
        }
        _ => lod.word("border")?,
    };
    Ok(LodSpec { inner_shares, border })
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
