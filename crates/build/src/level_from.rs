//! What the features of a finished database were made from, for those who check it.

use crate::ground::GamingArea;
use job::Job;
use store::engine::Fingerprint;
use store::{Folder, SourceRecord};
use terrain::in_turn;

use crate::CompileError;
use crate::heard::Heard;
use crate::keys;
use crate::read_features::ReadFeatures;

/// The fingerprint of what features of an area come to, from their files, which `records` name, and from the ground
/// along them as it is published; `None` where that is not the ground along these features, or the job has none.
///
/// # Errors
/// When a file cannot be read.
pub fn level_fingerprint(
    job: &Job,
    area: &GamingArea,
    records: &[SourceRecord],
    folder: &Folder,
) -> Result<Option<Fingerprint>, CompileError> {
    let Some(read) = ReadFeatures::open(job, area, &in_turn)? else { return Ok(None) };
    let mut profiles = Vec::new();
    for (index, &tile) in area.tiles.iter().enumerate() {
        let (.., profile) = folder.read_profile(tile)?;
        let asked = [read.stations(index).len(), read.on_ways(index).len()];
        if asked != [profile.heights.len(), profile.middles.len()] {
            return Ok(None);
        }
        profiles.push(profile);
    }
    let heard = Heard::of(&read, profiles.iter());
    Ok(Some(keys::level(job, &area.budget, records, read.seen(), heard.sounded()).fingerprint()))
}
