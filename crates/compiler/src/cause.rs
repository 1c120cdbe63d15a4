//! Why a tile that was published before is refined again.

use std::fmt;

use database::{DatabaseError, FingerprintBuilder, MadeFrom, Stamp, TileRecord, TileState};
use ground::Window;
use terrain::TileId;

use crate::refinement::Refinement;
use crate::run::{ALGORITHM_REVISION, Run};

/// Why a tile is refined.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Cause {
    /// Nothing was published.
    New,
    /// What was published is not as it was written.
    Damaged(String),
    /// Another version of the program made it.
    Revision(u32),
    /// Its sides were held as its neighbours had them.
    Frozen,
    /// These parts of what it is made from changed.
    Changed(Vec<&'static str>),
    /// It was made from something else, and nobody has written down from what.
    Other,
}

impl fmt::Display for Cause {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Cause::New => f.write_str("nothing was there"),
            Cause::Damaged(what) => write!(f, "damaged: {what}"),
            Cause::Revision(found) => write!(f, "made by algorithm revision {found}, now {ALGORITHM_REVISION}"),
            Cause::Frozen => f.write_str("it was frozen"),
            Cause::Changed(parts) => f.write_str(&parts.join(" and ")),
            Cause::Other => f.write_str("made from something else by a run that was broken off"),
        }
    }
}

/// What a tile is made from, by parts.
pub(crate) fn made_from(
    window: &Window,
    refinement: &Refinement,
    borders: impl FnOnce(FingerprintBuilder) -> FingerprintBuilder,
) -> MadeFrom {
    let begin = || FingerprintBuilder::new("part");
    let task = &refinement.task;
    let allowance = format!("{:?} {:?} {:?}", task.frame, task.stop.points, task.stop.rms_quanta);
    MadeFrom {
        heights: brief(begin().heights(&window.dem)),
        weights: brief(begin().importance(&window.importance)),
        given: window.given_in_words().map(|given| brief(begin().text(&given))).unwrap_or_default(),
        rules: rules(refinement),
        allowance: brief(begin().text(&allowance)),
        borders: brief(borders(begin())),
    }
}

/// What the job says of selecting and optimising in a tile, as its record names it.
pub fn rules(refinement: &Refinement) -> String {
    let task = &refinement.task;
    let rules = format!(
        "{:?} {:?} {:?} {:?} {:?} {:?}",
        task.rule, task.stop.value, task.seams, task.border, task.kept, refinement.optimising
    );
    brief(FingerprintBuilder::new("part").text(&rules))
}

fn brief(builder: FingerprintBuilder) -> String {
    builder.finish().to_string()[..16].to_owned()
}

/// Why a tile is refined whose inputs are `stamp` and `parts`, given how the stamp of its published file was read.
pub(crate) fn cause(
    run: &Run,
    tile: TileId,
    published: &Result<Option<Stamp>, DatabaseError>,
    stamp: &Stamp,
    parts: &MadeFrom,
) -> Cause {
    let found = match published {
        Err(error) => return Cause::Damaged(error.to_string()),
        Ok(None) => return Cause::New,
        // Its header is as it should be, so what follows is not.
        Ok(Some(found)) if found == stamp => return Cause::Damaged("its content cannot be read".into()),
        Ok(Some(found)) => found,
    };
    if found.algorithm_revision != ALGORITHM_REVISION {
        return Cause::Revision(found.algorithm_revision);
    }
    let record = run.previous.as_ref().and_then(|manifest| manifest.tile(tile));
    match record.filter(|record| record.fingerprint == Some(found.fingerprint)) {
        Some(TileRecord { state: TileState::Frozen, .. }) => Cause::Frozen,
        Some(TileRecord { made_from: Some(before), .. }) => Cause::Changed(differing(before, parts)),
        _ => Cause::Other,
    }
}

fn differing(before: &MadeFrom, now: &MadeFrom) -> Vec<&'static str> {
    let pairs = [
        (&before.heights, &now.heights, "its heights changed"),
        (&before.weights, &now.weights, "its weights changed"),
        (&before.given, &now.given, "the points given for it changed"),
        (&before.rules, &now.rules, "what the job says of selecting changed"),
        (&before.allowance, &now.allowance, "its allowance moved"),
        (&before.borders, &now.borders, "a neighbour's border changed"),
    ];
    pairs.into_iter().filter(|(before, now, _)| before != now).map(|(.., words)| words).collect()
}

/// The tiles that were refined again in one sentence, grouped by cause; nothing where none was there before.
pub(crate) fn summary(tiles: usize, causes: &[(TileId, Cause)]) -> Option<String> {
    /// Tiles that are named for one cause.
    const NAMED_MAX: usize = 12;
    let again: Vec<&(TileId, Cause)> = causes.iter().filter(|(_, cause)| *cause != Cause::New).collect();
    if again.is_empty() {
        return None;
    }
    let mut groups: Vec<(String, Vec<TileId>)> = Vec::new();
    for (tile, cause) in &again {
        let words = cause.to_string();
        match groups.iter_mut().find(|(known, _)| *known == words) {
            Some((_, members)) => members.push(*tile),
            None => groups.push((words, vec![*tile])),
        }
    }
    let sentence = |(words, members): &(String, Vec<TileId>)| {
        let names: Vec<String> = members.iter().take(NAMED_MAX).map(TileId::to_string).collect();
        let more = members.len().saturating_sub(NAMED_MAX);
        let more = if more == 0 { String::new() } else { format!(" and {more} more") };
        format!("{words}: {}{more}", names.join(" "))
    };
    let groups: Vec<String> = groups.iter().map(sentence).collect();
    Some(format!("{} of {tiles} tiles are refined again; {}", again.len(), groups.join("; ")))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tiles_are_told_by_what_reached_them() {
        let tile = |col| TileId { row: 0, col };
        let border = || Cause::Changed(vec!["a neighbour's border changed"]);
        let causes = [(tile(0), Cause::New), (tile(1), border()), (tile(2), Cause::Frozen), (tile(3), border())];
        let text = summary(4, &causes).unwrap_or_default();
        let expected =
            "3 of 4 tiles are refined again; a neighbour's border changed: r00c01 r00c03; it was frozen: r00c02";
        assert_eq!(text, expected);
        assert_eq!(summary(4, &causes[..1]), None);
    }
}
