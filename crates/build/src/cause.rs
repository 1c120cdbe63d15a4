//! Why tiles are refined again, in words.

use store::engine::Cause;
use terrain::TileId;

/// Said of a tile whose sides were held as its neighbours had them.
pub(crate) const FROZEN: &str = "it was frozen";

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
        let causes =
            [(tile(0), Cause::New), (tile(1), border()), (tile(2), Cause::Provisional(FROZEN)), (tile(3), border())];
        let text = summary(4, &causes).unwrap_or_default();
        let expected =
            "3 of 4 tiles are refined again; a neighbour's border changed: r00c01 r00c03; it was frozen: r00c02";
        assert_eq!(text, expected);
        assert_eq!(summary(4, &causes[..1]), None);
    }
}
