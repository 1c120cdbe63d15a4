//! `tin.start` and `tin.pins`: points that a job gives.

use std::path::Path;

use crate::entry::{Entry, Section};
use crate::files::{Mention, Place};
use crate::{JobError, NamedFile, Start, StartMethod};

pub(super) fn read(
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
