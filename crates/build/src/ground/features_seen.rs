//! What the features of a job are, before any height is looked at: the table of kinds that results, what each of its
//! rows holds, and what of each file lies in the area.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use features::objects::{OBJECT_KEYS, traits};
use features::{
    FeatureId, Form, IdleRule, Kind, Numbering, OverviewRow, RowOrigin, Rule, Shape, Source, overview as overview_of,
};
use job::Choice;
use source_files::{BUILT_IN_KEYS, Extent, VectorFeature, VectorShape, Wanted, read_features};
use terrain::{ObjectKind, in_turn};

use crate::ground::GroundError;
use crate::ground::vectors::{FeaturesRead, Vectors};

/// The features of a job.
#[derive(Clone, Debug, PartialEq)]
pub struct FeatureTable {
    /// The rows in the order in which they are tried.
    pub rows: Vec<FeatureRow>,
    /// What of each source lies in the area.
    pub sources: Vec<SourceSeen>,
    /// What a person should know: rules that decide nothing, files without a feature that could be used.
    pub notes: Vec<String>,
}

/// A row of the table of kinds, in words.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FeatureRow {
    /// The word for the kind, `none` where what matches is left out.
    pub kind: String,
    /// The name of the class.
    pub class: String,
    /// Tags that it takes, and where the row comes from.
    pub from: String,
    /// Its width where no tag of a feature says it, or that of the rule.
    pub width: String,
    /// The greatest grade, or what holds instead.
    pub grade: String,
    /// The form.
    pub form: String,
    /// How many features in the area it decides.
    pub count: usize,
}

/// What of a source lies in the area and one load module on each side.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SourceSeen {
    /// What was read of it.
    pub read: FeaturesRead,
    /// Of its features inside, those that no row of the table takes, and that are left out.
    pub without_kind: u64,
}

/// The features of a file, by the built-in table alone.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FeaturesSeen {
    /// Its lines and polygons.
    pub found: u64,
    /// Of these, those outside the bounds.
    pub outside: u64,
    /// How many inside have which kind, in the table's order.
    pub kinds: Vec<(&'static str, usize)>,
    /// How many inside are objects of which kind, in the order of kinds.
    pub objects: Vec<(&'static str, usize)>,
    /// How many inside are neither.
    pub without_kind: usize,
    /// Of these, coastlines, which say where the sea is and enclose nothing.
    pub coastlines: usize,
    /// Whether all inside are polygons, or all are lines; `None` where there are both, or none.
    pub are_polygons: Option<bool>,
    /// What a person should know.
    pub notes: Vec<String>,
}

impl FeatureTable {
    /// What rules and the built-in table make of features that were read.
    pub fn of(vectors: &Vectors, rules: &[Rule]) -> Self {
        let overview = overview_of(&vectors.sources, rules);
        let mut notes = vectors.notes.clone();
        let mut sources: Vec<SourceSeen> =
            vectors.files.iter().map(|read| SourceSeen { read: read.clone(), without_kind: 0 }).collect();
        for own in vectors.sources.chunk_by(|a, b| a.id.source == b.id.source) {
            let number = own[0].id.source;
            let seen = &mut sources[number as usize];
            seen.without_kind = overview.unmatched.get(&number).map_or(0, |&count| count as u64);
            if own.len() as u64 == seen.without_kind {
                notes.push(no_kind(seen, &columns(own)));
            }
        }
        notes.extend(overview.idle.iter().map(|idle| idle_text(idle, &rules[idle.rule])));
        let rows = overview.rows.iter().map(|row| row_text(row, rules)).collect();
        Self { rows, sources, notes }
    }
}

fn idle_text(idle: &IdleRule, rule: &Rule) -> String {
    let rule = format!("features.rules[{}] ({})", idle.rule, tags_text(&rule.tags));
    match (idle.taken, idle.nearest.as_slice()) {
        (0, []) => format!("{rule} matches nothing: no feature in the area has a tag"),
        (0, nearest) => format!("{rule} matches nothing; the nearest there is: {}", nearest.join(", ")),
        (taken, _) => format!("{rule} decides nothing: rules before it take all {taken} features that match it"),
    }
}

/// What of the file at `path` lies in an area from `origin_m`, `size_m` large, by the built-in table alone.
///
/// # Errors
/// When the file cannot be read.
pub fn features_in(
    path: &Path,
    layer: Option<&str>,
    epsg: u32,
    [origin_m, size_m]: [[f64; 2]; 2],
) -> Result<FeaturesSeen, GroundError> {
    let side = |axis: usize| [origin_m[axis], origin_m[axis] + size_m[axis]];
    let bounds = Extent { east: side(0), north: side(1) };
    let mut keys = [&BUILT_IN_KEYS[..], &OBJECT_KEYS].concat();
    keys.sort_unstable();
    keys.dedup();
    let wanted = Wanted { epsg, bounds, layer, crs: None, keys: &keys, buildings: false, points: true };
    let mut read = read_features(path, &wanted, &in_turn)?;
    let object = |feature: &VectorFeature| traits(|key| feature.tag(key), (None, None), &[]).map(|(of, _)| of.kind);
    let is_point = |feature: &VectorFeature| matches!(feature.shape, VectorShape::Point(_));
    // Crossings, signs and the like are nothing that a job could have left out.
    let all = read.features.len();
    read.features.retain(|feature| !is_point(feature) || object(feature).is_some());
    let found = read.found - (all - read.features.len()) as u64;
    let mut objects: BTreeMap<ObjectKind, usize> = BTreeMap::new();
    read.features.iter().filter_map(object).for_each(|kind| *objects.entry(kind).or_default() += 1);
    read.features.retain(|feature| !is_point(feature));
    let is_polygon = |feature: &VectorFeature| matches!(feature.shape, VectorShape::Polygon(_));
    let first = read.features.first().map(is_polygon);
    let are_polygons = first.filter(|first| read.features.iter().all(|feature| is_polygon(feature) == *first));
    let others = read.features.iter().filter(|feature| object(feature).is_none());
    let others: Vec<Source> = others.map(source_of).collect();
    let sources: Vec<Source> = read.features.iter().map(source_of).collect();
    let without_kind = overview_of(&others, &[]).unmatched.values().sum();
    let coastlines = read.features.iter().filter(|feature| feature.tag("natural") == Some("coastline")).count();
    let overview = overview_of(&sources, &[]);
    let mut kinds: BTreeMap<Kind, usize> = BTreeMap::new();
    for row in overview.rows.iter().filter(|row| 0 < row.count) {
        row.kind.into_iter().for_each(|kind| *kinds.entry(kind).or_default() += row.count);
    }
    Ok(FeaturesSeen {
        found,
        outside: read.outside,
        kinds: kinds.into_iter().map(|(kind, count)| (kind.name(), count)).collect(),
        objects: objects.into_iter().map(|(kind, count)| (kind.name(), count)).collect(),
        without_kind,
        coastlines,
        are_polygons,
        notes: read.notes,
    })
}

/// A feature as the table looks at it: its tags, without its shape.
fn source_of(feature: &VectorFeature) -> Source {
    let tags = feature.tags.iter().map(|(key, value)| (key.to_string(), value.to_string())).collect();
    let id = FeatureId { source: 0, numbering: Numbering::Row, number: 0 };
    Source { id, tags, kind: None, shape: Shape::Line(Vec::new()) }
}

/// Keys of the tags of some features, sorted, and no more than a line of them.
fn columns(features: &[Source]) -> String {
    const SHOWN: usize = 8;
    let keys: BTreeSet<&str> =
        features.iter().flat_map(|feature| feature.tags.iter().map(|(key, _)| key.as_str())).collect();
    let shown: Vec<&str> = keys.iter().copied().take(SHOWN).collect();
    match keys.len() {
        0 => "they have none".to_owned(),
        count if SHOWN < count => format!("{} and {} more", shown.join(", "), count - SHOWN),
        _ => shown.join(", "),
    }
}

fn no_kind(seen: &SourceSeen, columns: &str) -> String {
    format!(
        "{}: its features in the area have no kind by their tags ({columns}) and are left out, {} in all; name one, as \
         {{ file = \"…\", kind = \"track\" }}, or write a rule",
        seen.read.name, seen.without_kind
    )
}

fn tags_text(tags: &[(String, Vec<String>)]) -> String {
    let tag = |(key, values): &(String, Vec<String>)| match values.is_empty() {
        true => format!("{key} = any"),
        false => format!("{key} = {}", values.join(", ")),
    };
    match tags.is_empty() {
        true => "every feature".to_owned(),
        false => tags.iter().map(tag).collect::<Vec<_>>().join("; "),
    }
}

fn row_text(row: &OverviewRow, rules: &[Rule]) -> FeatureRow {
    let tags = tags_text(&row.tags);
    let from = match row.origin {
        RowOrigin::Rule(number) if rules[number].pins => format!("rule {number}: {tags}; heights of the features"),
        RowOrigin::Rule(number) => format!("rule {number}: {tags}"),
        RowOrigin::Source => "sources that say so".to_owned(),
        RowOrigin::BuiltIn(_) => tags,
    };
    let none = || "-".to_owned();
    let Some(kind) = row.kind else {
        let [class, width, grade, form] = [none(), none(), none(), none()];
        return FeatureRow { kind: "none".to_owned(), class, from, width, grade, form, count: row.count };
    };
    let grade = match row.grade_max_percent {
        Some(percent) => format!("{percent} %"),
        None if kind.flows() => "falls".to_owned(),
        None if kind == Kind::Lake => "level".to_owned(),
        None => none(),
    };
    FeatureRow {
        kind: kind.name().to_owned(),
        class: row.class.clone().unwrap_or_default(),
        from,
        width: width_text(kind, row.width_m),
        grade,
        form: if row.form == Form::Polygon { "polygon".to_owned() } else { Choice::name(&row.form).to_owned() },
        count: row.count,
    }
}

/// The width of a rule, or that of the kind where no tag says it.
fn width_text(kind: Kind, of_rule: Option<f64>) -> String {
    let usual = kind.width_default() / terrain::QUANTA_PER_METRE;
    match (of_rule, kind) {
        (Some(metres), _) => format!("{metres} m"),
        (None, Kind::Lake | Kind::Dam | Kind::Breakline) => "-".to_owned(),
        (None, Kind::Runway) => format!("{usual}, 20 m"),
        (None, _) => format!("{usual} m"),
    }
}

#[cfg(test)]
mod tests {
    use job::Job;

    use super::*;
    use crate::ground::area::GamingArea;

    const JOB: &str = "[area]\nname = \"a\"\ncrs = \"EPSG:32611\"\norigin_m = [500000, 3875000]\n\
        size_m = [2000, 2000]\nspacing_m = 25\n[dem]\nsource = \"sample\"\n[features]\n";

    /// A job with these keys in `[features]`, and a file of roads, one of them 100 km away, and a lake without tags.
    fn table_of(keys: &str, files: &[(&str, &str)]) -> Result<FeatureTable, String> {
        let folder = tempfile::tempdir().unwrap();
        let line = |tags: &str, east: f64| {
            let places = format!("[[{east}, 35.02], [{}, 35.025]]", east + 0.01);
            let geometry = format!("{{\"type\":\"LineString\",\"coordinates\":{places}}}");
            format!("{{\"type\":\"Feature\",\"properties\":{{{tags}}},\"geometry\":{geometry}}}")
        };
        let all =
            |features: &[String]| format!("{{\"type\":\"FeatureCollection\",\"features\":[{}]}}", features.join(","));
        let roads = all(&[
            line("\"highway\":\"track\"", -116.995),
            line("\"highway\":\"track\",\"surface\":\"sand\"", -116.99),
            line("\"highway\":\"footway\"", -116.99),
            line("\"highway\":\"track\"", -115.9),
        ]);
        let plain = all(&[line("\"fid\":7,\"level\":\"P\"", -116.99)]);
        for (name, text) in [("r.geojson", roads.as_str()), ("p.geojson", plain.as_str())].iter().chain(files) {
            std::fs::write(folder.path().join(name), text).unwrap();
        }
        std::fs::write(folder.path().join("a.toml"), format!("{JOB}{keys}\n")).unwrap();
        let job = Job::load(&folder.path().join("a.toml")).map_err(|error| error.to_string())?;
        let vectors = Vectors::read(&job, &GamingArea::new(&job).unwrap(), &in_turn);
        let vectors = vectors.map_err(|error| error.to_string().replace(folder.path().to_str().unwrap(), ""))?;
        Ok(FeatureTable::of(&vectors, &job.features.unwrap().rules))
    }

    fn rows(table: &FeatureTable) -> Vec<String> {
        let text = |row: &FeatureRow| {
            let FeatureRow { kind, class, from, width, grade, form, count } = row;
            format!("{kind}|{class}|{count}|{width}|{grade}|{form}|{from}")
        };
        table.rows.iter().filter(|row| 0 < row.count || row.from.starts_with("rule")).map(text).collect()
    }

    #[test]
    fn the_table_of_kinds_counts_what_lies_in_the_area_and_tells_what_lies_outside() {
        let rule = "{ where = { surface = \"sand\" }, class = \"sandy\", width_m = 3.5, grade_max_percent = 20 }";
        let table = table_of(&format!("sources = [\"r.geojson\"]\nrules = [{rule}]"), &[]).unwrap();
        let expected =
            ["track|sandy|1|3.5 m|20 %|line|rule 0: surface = sand", "track|track|1|3 m|25 %|line|highway = track"];
        assert_eq!(rows(&table), expected);
        let seen = &table.sources[0];
        let read = &seen.read;
        assert_eq!((read.name.as_str(), read.found, read.outside, seen.without_kind), ("r.geojson", 4, 1, 1));
        assert_eq!(table.notes, [""; 0]);
    }

    #[test]
    fn the_built_in_terrain_s_own_features_are_counted_as_those_of_files_are() {
        let table = table_of("sources = [\"sample\", \"r.geojson\"]", &[]).unwrap();
        let [own, file] = table.sources.as_slice() else { panic!("there are two") };
        assert_eq!((own.read.name.as_str(), file.read.found), ("sample", 4));
        let counted: usize = table.rows.iter().map(|row| row.count).sum();
        assert!(0 < own.read.found);
        assert_eq!(counted as u64, own.read.found + file.read.found - file.read.outside - file.without_kind);
    }

    #[test]
    fn a_job_says_the_system_of_a_file_that_names_none_or_a_wrong_one() {
        let line = |crs: &str, coordinates: &str| {
            format!(
                "{{\"type\":\"FeatureCollection\",{crs}\"features\":[{{\"type\":\"Feature\",\"properties\":\
                {{\"highway\":\"track\"}},\"geometry\":{{\"type\":\"LineString\",\"coordinates\":{coordinates}}}}}]}}"
            )
        };
        // Zone 12, from which the area's middle is far in the west.
        let west = "[[-47263, 3891727], [-46806, 3891700]]";
        let wrong = "\"crs\":{\"type\":\"name\",\"properties\":{\"name\":\"EPSG:32610\"}},";
        let none = "\"crs\":{\"type\":\"name\",\"properties\":{\"name\":\"the usual\"}},";
        for crs in ["", wrong, none] {
            let files = [("z.geojson", line(crs, west))];
            let files: Vec<(&str, &str)> = files.iter().map(|(name, text)| (*name, text.as_str())).collect();
            let said = table_of("sources = [{ file = \"z.geojson\", crs = \"EPSG:32612\" }]", &files).unwrap();
            assert_eq!((said.sources[0].read.found, said.sources[0].read.outside), (1, 0), "{crs} {:?}", said.notes);
            match table_of("sources = [\"z.geojson\"]", &files) {
                Ok(table) => {
                    assert_eq!(table.sources[0].read.outside, 1, "{crs}");
                    assert!(table.notes.iter().any(|note| note.contains("name it with crs")), "{:?}", table.notes);
                }
                Err(error) => assert!(crs == none && error.contains("the usual"), "{error}"),
            }
        }
        let error = table_of("sources = [{ file = \"r.geojson\", crs = \"EPSG:x\" }]", &[]).unwrap_err();
        assert!(error.starts_with("features.sources: crs of r.geojson: EPSG: without a number"), "{error}");
    }

    #[test]
    fn rules_that_match_nothing_are_told_with_the_nearest_tag() {
        let rules = "rules = [{ where = { higway = \"trak\" }, kind = \"minor\" }, { where = {}, kind = \"none\" }, \
            { where = { highway = \"track\" }, kind = \"track\" }]";
        let table = table_of(&format!("sources = [\"r.geojson\"]\n{rules}"), &[]).unwrap();
        let expected = [
            "features.rules[0] (higway = trak) matches nothing; the nearest there is: highway = track",
            "features.rules[2] (highway = track) decides nothing: rules before it take all 2 features that match it",
        ];
        assert_eq!(table.notes, expected);
        assert_eq!(rows(&table)[1], "none|-|3|-|-|-|rule 1: every feature");
    }

    #[test]
    fn a_file_whose_tags_say_no_kind_is_told_and_one_of_which_the_job_says_it_is_not() {
        let table = table_of("sources = [\"p.geojson\"]", &[]).unwrap();
        assert_eq!(
            table.notes,
            ["p.geojson: its features in the area have no kind by their tags (fid, level) and are left out, 1 in \
              all; name one, as { file = \"…\", kind = \"track\" }, or write a rule"]
        );
        let said = table_of("sources = [{ file = \"p.geojson\", kind = \"rail\" }]", &[]).unwrap();
        assert_eq!(rows(&said), ["rail|rail|1|5 m|3 %|auto|sources that say so"]);
        assert_eq!(said.notes, [""; 0]);
    }

    #[test]
    fn files_without_features_or_with_none_in_the_area_are_told_and_those_that_cannot_be_read_refused() {
        let empty = "{\"type\":\"FeatureCollection\",\"features\":[]}";
        let table = table_of("sources = [\"e.geojson\"]", &[("e.geojson", empty)]).unwrap();
        assert_eq!(table.notes, ["e.geojson: no line or polygon in the file"]);
        let far = "{\"type\":\"LineString\",\"coordinates\":[[10,50],[11,50]]}";
        let table = table_of("sources = [\"f.geojson\"]", &[("f.geojson", far)]).unwrap();
        let note = &table.notes[0];
        assert!(
            note.starts_with("f.geojson: none of its 1 lines and polygons lies inside the area: they lie"),
            "{note}"
        );
        assert_eq!((table.sources[0].read.found, table.sources[0].read.outside), (1, 1));
        for (text, told) in [("{\"type\":", "nor GeoJSON"), ("", "an empty file"), ("PK\x03\x04", "a zip archive")] {
            let error = table_of("sources = [\"b.geojson\"]", &[("b.geojson", text)]).unwrap_err();
            assert!(error.contains("b.geojson") && error.contains(told), "{error}");
        }
        let layer = table_of("sources = [{ file = \"r.geojson\", layer = \"x\" }]", &[]).unwrap_err();
        assert!(layer.contains("the layer `x` named; expected no layer: only GeoPackages have some"), "{layer}");
    }
}
