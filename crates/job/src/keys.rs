//! The keys of a job file by name, and the one that was probably meant.

use crate::sections::TABLES;
use crate::{Choice, Key, KeyTable, Optimising, Sight, Usual};

/// The tables of a job file, the sections first in their order, each before those that stand in it.
pub fn key_tables() -> &'static [KeyTable] {
    &TABLES
}

/// What is known of a key, by its name with its section, as `tin.effort`. An item of a list is known as its list, and
/// what stands in a table of any keys as that table.
pub fn key(name: &str) -> Option<&'static Key> {
    let (place, own) = name.rsplit_once('.')?;
    let keys = table(place);
    if keys.is_empty() {
        return key(place);
    }
    let known = |own: &str| keys.iter().find(|key| key.name == own);
    known(own).or_else(|| known(&own[..own.rfind('[')?]))
}

/// What a key is where a job leaves it out, as the job would write it.
///
/// # Panics
/// Where nothing plain holds.
pub fn usual_text(name: &str) -> &'static str {
    match key(name).map(|key| key.usual) {
        Some(Usual::Is(value)) => value,
        _ => panic!("{name} has no value that holds where a job leaves it out"),
    }
}

/// What a setting of some words is where a job leaves it out.
///
/// # Panics
/// As [`usual_text`].
pub fn usual<T: Choice + Clone>(name: &str) -> T {
    T::named(usual_text(name)).cloned().expect("what holds is one of the words")
}

impl Default for Sight {
    fn default() -> Self {
        let numbers = |name| usual_text(name).trim_matches(['[', ']']).split(", ").map(str::parse::<f64>);
        let numbers = |name| numbers(name).collect::<Result<Vec<f64>, _>>().expect("what holds is a value of its key");
        let (eyes, range) = (numbers("tin.sight_eyes_m"), numbers("tin.sight_range_m"));
        Self::of_metres([eyes[0], eyes[1]], range[0])
    }
}

impl Default for Optimising {
    fn default() -> Self {
        let effort = usual("tin.effort");
        Self {
            effort,
            height_fit: usual("tin.height_fit"),
            lattice: usual("tin.lattice"),
            sight: Sight::is_usual_with(effort).then(Sight::default),
        }
    }
}

/// The keys of a table, by its place in the job: `area`, `dem.voids`, `importance.areas[3]`.
pub(crate) fn table(place: &str) -> &'static [Key] {
    let place = match (place.rfind('['), place.ends_with(']')) {
        (Some(at), true) => format!("{}[]", &place[..at]),
        _ => place.to_owned(),
    };
    let find = |place: &str| TABLES.iter().find(|known| known.place == place);
    // What stands in a table of any keys is an item of it.
    let item = || find(&format!("{}[]", place.rsplit_once('.')?.0));
    find(&place).or_else(item).map_or(&[], |known| known.keys)
}

/// The names of the keys of a table.
pub(crate) fn keys_of(place: &str) -> Vec<&'static str> {
    table(place).iter().map(|key| key.name).collect()
}

/// The sections of a job file.
fn sections() -> impl Iterator<Item = &'static KeyTable> {
    TABLES.iter().filter(|table| !table.place.contains('.'))
}

/// The names of the sections.
pub(crate) fn section_names() -> Vec<&'static str> {
    sections().map(|section| section.place).collect()
}

/// What a key may be, in words.
pub(crate) fn expected(name: &str) -> String {
    key(name).map_or_else(String::new, Key::expected)
}

/// How a key may be written, as a hint; `name` has its section, and an index when it is an item of a list.
pub(crate) fn example(name: &str) -> String {
    match key(name) {
        Some(key) => format!("for example {}", key.example_text()),
        None => SEE_EXAMPLE.to_owned(),
    }
}

/// What to say where nothing better is known.
const SEE_EXAMPLE: &str = "configs/ntc.toml shows the usual keys with what they mean";

/// The word nearest to `found`, if it is near enough to have been meant: few edits away, or abbreviated by it
/// (`cols` for `columns`), or lengthened by it (`clipped` for `clip`).
pub(crate) fn nearest<'a>(found: &str, known: &[&'a str]) -> Option<&'a str> {
    let lower = found.to_lowercase();
    let edits = |word: &&&str| strsim::osa_distance(&lower, word);
    let best = known.iter().min_by_key(edits)?;
    if edits(&best) <= (lower.chars().count() / 4).max(1) {
        return Some(best);
    }
    let meant = |word: &&&str| abbreviates(&lower, word) || (4 <= word.len() && lower.starts_with(**word));
    known.iter().find(meant).copied()
}

/// Whether `short` is `word` with letters left out, the first one kept.
fn abbreviates(short: &str, word: &str) -> bool {
    let mut letters = word.chars();
    3 <= short.len() && short.chars().next() == word.chars().next() && short.chars().all(|c| letters.any(|l| l == c))
}

/// The key that was probably meant where `found` stands in `place`.
pub(crate) fn hint_for_key(place: &str, found: &str) -> String {
    if let Some(name) = section_of(place, found) {
        return format!("did you mean {found} in [{name}]?");
    }
    match nearest(found, &keys_of(place)) {
        Some(key) => format!("did you mean {key}?"),
        None => SEE_EXAMPLE.to_owned(),
    }
}

/// The section that was probably meant where `found` stands outside all sections, or as one.
pub(crate) fn hint_for_section(found: &str) -> String {
    match (found, section_of("", found)) {
        ("sample", _) => "the sample terrain is chosen by source = \"sample\" and seed in [dem]".to_owned(),
        ("roads" | "rivers" | "lakes" | "vectors", _) => "[features] names files of roads, rivers and lakes".to_owned(),
        ("workers" | "out", _) => format!("give it on the command line: --{found}"),
        (_, Some(name)) => format!("did you mean {found} in [{name}]?"),
        _ => match nearest(found, &section_names()) {
            Some(name) => format!("did you mean [{name}]?"),
            None => SEE_EXAMPLE.to_owned(),
        },
    }
}

/// The section, other than `place`, that has exactly this key.
fn section_of(place: &str, key: &str) -> Option<&'static str> {
    let mut others = sections().filter(|section| section.place != place);
    others.find(|section| section.keys.iter().any(|known| known.name == key)).map(|section| section.place)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn check(place: &str, found: &str, expected: &str) {
        assert_eq!(hint_for_key(place, found), expected);
    }

    #[test]
    fn the_key_that_was_meant_is_found_by_edits_by_abbreviation_and_in_other_sections() {
        check("area", "spacing", "did you mean spacing_m?");
        check("area", "orgin_m", "did you mean origin_m?");
        check("tiles", "cols", "did you mean columns?");
        check("tiles", "colums", "did you mean columns?");
        check("tin", "pool", "did you mean pool in [limits]?");
        check("importance.areas[2]", "clas", "did you mean class?");
        check("area", "quux", SEE_EXAMPLE);
    }

    #[test]
    fn every_key_has_an_example() {
        for table in &TABLES {
            for key in table.keys {
                assert!(!key.example_text().is_empty(), "{}.{}", table.place, key.name);
            }
        }
        assert_eq!(example("area.size_m[1]"), "for example size_m = [50000, 50000]");
        assert_eq!(example("importance.areas[1].weight"), "for example weight = 1; 0 excludes posts from selection");
        assert!(example("importance.areas[1]").contains("areas = [{"));
    }
}
