//! Overture's columns as tags of OpenStreetMap, by which kinds and objects are told; and segments cut where one of
//! their rules begins or ends.

use super::clip::Vertex;

/// Whom to name beside anything drawn from it.
pub(super) const ATTRIBUTION: &str = "(c) OpenStreetMap contributors, Overture Maps Foundation, ODbL 1.0";
/// Columns that all of its types have, and together hardly anything else.
pub(super) const MARKS: [&str; 5] = ["id", "geometry", "bbox", "version", "sources"];
/// Columns of one text or number that are looked at.
pub(super) const PLAIN: [&str; 13] = [
    "id",
    "subtype",
    "class",
    "subclass",
    "height",
    "num_floors",
    "min_height",
    "min_floor",
    "building_id",
    "has_parts",
    "is_intermittent",
    "is_underground",
    "surface",
];
/// Columns of rules, each of which holds between two places of a segment: the column, and the key of its values;
/// empty where [`FLAGS`] and [`SUBCLASSES`] have it.
pub(super) const RULES: [(&str, &str); 6] = [
    ("road_flags", ""),
    ("rail_flags", ""),
    ("subclass_rules", ""),
    ("road_surface", "surface"),
    ("width_rules", "width"),
    ("level_rules", "layer"),
];

/// What is looked at of a value: any, or one of some.
type Values = &'static [&'static str];
const ANY: Values = &[];

/// Which geometries a row of the table is for.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Form {
    Line,
    Polygon,
    Each,
}

/// `subtype`, `class`, geometry, and the tag that they stand for; `=` stands for the class. All rows that fit count.
const TABLE: [(Values, Values, Form, &str, &str); 28] = [
    (&["road"], &["unknown"], Form::Each, "highway", "road"),
    (&["road"], ANY, Form::Each, "highway", "="),
    (&["rail"], &["standard_gauge", "unknown"], Form::Each, "railway", "rail"),
    (&["rail"], ANY, Form::Each, "railway", "="),
    (&["river", "stream", "canal"], ANY, Form::Line, "waterway", "="),
    (&["river", "stream", "canal", "lake", "pond", "reservoir"], ANY, Form::Polygon, "natural", "water"),
    (&["river", "stream", "canal", "lake", "pond", "reservoir"], ANY, Form::Polygon, "water", "="),
    (&["water"], &["water", "lagoon", "oxbow", "wastewater"], Form::Polygon, "natural", "water"),
    (&["water"], &["lagoon", "oxbow", "wastewater"], Form::Polygon, "water", "="),
    (&["water"], &["dam", "weir"], Form::Each, "waterway", "="),
    (&["human_made"], &["fish_pond", "reflecting_pool", "salt_pool"], Form::Polygon, "natural", "water"),
    (&["ocean"], ANY, Form::Polygon, "water", "ocean"),
    (&["forest"], ANY, Form::Each, "natural", "wood"),
    (&["shrub"], &["", "shrub", "scrub", "shrubbery"], Form::Each, "natural", "scrub"),
    (&["tree"], ANY, Form::Each, "natural", "="),
    (&["mangrove", "wetland"], ANY, Form::Each, "natural", "wetland"),
    (&["shrub", "grass", "rock", "sand", "glacier"], ANY, Form::Each, "natural", "="),
    (&["barren"], ANY, Form::Each, "natural", "bare_rock"),
    (&["crop"], ANY, Form::Each, "landuse", "farmland"),
    (&["agriculture", "horticulture", "managed", "resource_extraction"], ANY, Form::Each, "landuse", "="),
    (
        &["residential", "developed", "military", "cemetery", "landfill", "construction"],
        ANY,
        Form::Each,
        "landuse",
        "=",
    ),
    (&["barrier"], ANY, Form::Each, "barrier", "="),
    (&["airport"], &["runway", "taxiway", "apron"], Form::Each, "aeroway", "="),
    (&["power"], &["power_tower"], Form::Each, "power", "tower"),
    (&["tower"], &["cooling"], Form::Each, "man_made", "cooling_tower"),
    (&["tower", "communication"], &["communication_tower", "mobile_phone_tower"], Form::Each, "man_made", "mast"),
    (&["tower", "utility"], &["silo", "gasometer", "storage_tank", "water_tower"], Form::Each, "man_made", "="),
    (
        &["tower"],
        &["bell_tower", "defensive", "minaret", "observation", "radar", "watchtower"],
        Form::Each,
        "man_made",
        "tower",
    ),
];

/// Numbers of buildings and their parts, and whether they lie below the ground.
const NUMBERS: [(&str, &str); 5] = [
    ("height", "height"),
    ("num_floors", "building:levels"),
    ("min_height", "min_height"),
    ("min_floor", "building:min_level"),
    ("is_underground", "is_underground"),
];

/// Flags, and the tags that they stand for; `highway` stands for the key of the class, too.
const FLAGS: [(&str, &str, &str); 7] = [
    ("is_bridge", "bridge", "yes"),
    ("is_tunnel", "tunnel", "yes"),
    ("is_covered", "covered", "yes"),
    ("is_indoor", "indoor", "yes"),
    ("is_under_construction", "highway", "construction"),
    ("is_abandoned", "highway", "abandoned"),
    ("is_disused", "highway", "disused"),
];

/// Subclasses, and the tags that they stand for. A link has its class with `_link` behind it.
const SUBCLASSES: [(&str, &str, &str); 6] = [
    ("parking_aisle", "service", "parking_aisle"),
    ("driveway", "service", "driveway"),
    ("alley", "service", "alley"),
    ("sidewalk", "footway", "sidewalk"),
    ("crosswalk", "footway", "crossing"),
    ("cycle_crossing", "cycleway", "crossing"),
];

/// A value of a column that holds along a part of a segment, from 0 to 1.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Rule {
    /// The column.
    pub column: &'static str,
    /// The value.
    pub value: String,
    /// From where to where.
    pub between: [f64; 2],
}

/// What a file holds, where it is more than its rows say.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Holds {
    Buildings,
    BuildingParts,
    Other,
}

impl Holds {
    /// By the columns of a file.
    pub(super) fn of(has: impl Fn(&str) -> bool) -> Self {
        match () {
            () if has("building_id") => Self::BuildingParts,
            () if has("has_parts") => Self::Buildings,
            () => Self::Other,
        }
    }
}

/// Tags, in no order.
pub(super) type Said = Vec<(String, String)>;

/// Gives a key a value, whatever it had.
fn set(tags: &mut Said, key: &str, value: &str) {
    tags.retain(|(other, _)| other != key);
    tags.push((key.into(), value.into()));
}

/// The tags of a feature by its columns of one value; whether it is a line, and whether it is a polygon.
pub(super) fn tags<'a>(
    holds: Holds,
    column: &dyn Fn(&str) -> Option<&'a str>,
    [is_line, is_polygon]: [bool; 2],
) -> Said {
    let (subtype, class) = (column("subtype").unwrap_or_default(), column("class").unwrap_or_default());
    let mut tags = Said::new();
    let said = |key: &'static str| column(key).map(|value| (key.to_owned(), value.to_owned()));
    tags.extend(["subtype", "class", "subclass", "surface"].into_iter().filter_map(said));
    for (name, key) in NUMBERS {
        column(name).into_iter().for_each(|value| set(&mut tags, key, value));
    }
    let key = match holds {
        Holds::Buildings => Some("building"),
        Holds::BuildingParts => Some("building:part"),
        Holds::Other => None,
    };
    key.into_iter().for_each(|key| set(&mut tags, key, if class.is_empty() { "yes" } else { class }));
    let fits = |values: Values, value: &str| values.is_empty() || values.contains(&value);
    for (subtypes, classes, form, key, value) in TABLE.iter().filter(|_| holds == Holds::Other && !subtype.is_empty()) {
        let is_formed = match form {
            Form::Line => is_line,
            Form::Polygon => is_polygon,
            Form::Each => true,
        };
        let value = if *value == "=" { class } else { value };
        let is_new = !value.is_empty() && tags.iter().all(|(other, _)| other != key);
        if is_formed && is_new && fits(subtypes, subtype) && fits(classes, class) {
            set(&mut tags, key, value);
        }
    }
    if column("is_intermittent") == Some("true") {
        set(&mut tags, "intermittent", "yes");
    }
    tags
}

/// Adds what a rule says to the tags of a part of a segment.
fn add(tags: &mut Said, Rule { column, value, .. }: &Rule) {
    let key = RULES.iter().find(|(name, _)| name == column).map_or("", |(_, key)| key);
    let of_class = ["highway", "railway"].into_iter().find(|key| tags.iter().any(|(other, _)| other == key));
    let known = FLAGS.iter().chain(&SUBCLASSES).find(|(name, ..)| name == value);
    match (key, of_class, value.as_str(), known) {
        // What is not known is not said.
        (_, _, "unknown", _) => {}
        ("", Some(key), "link" | "is_link", _) => {
            let class = tags.iter().find(|(other, _)| other == key).map(|(_, class)| class.clone());
            if let Some(class) = class.filter(|class| !class.ends_with("_link")) {
                set(tags, key, &format!("{class}_link"));
            }
        }
        ("", of_class, _, Some((_, "highway", value))) => set(tags, of_class.unwrap_or("highway"), value),
        ("", _, _, Some((_, key, value))) => set(tags, key, value),
        ("", ..) => {}
        (key, _, value, _) => set(tags, key, value),
    }
}

/// The parts of a segment from 0 to 1, along each of which the same rules hold, with its tags there. Neighbours with
/// the same tags are one part.
pub(super) fn parts(tags: &Said, rules: &[Rule]) -> Vec<([f64; 2], Said)> {
    let ends = rules.iter().flat_map(|rule| rule.between).filter(|end| 0.0 < *end && *end < 1.0);
    let mut ends: Vec<f64> = [0.0, 1.0].into_iter().chain(ends).collect();
    ends.sort_by(f64::total_cmp);
    ends.dedup();
    let mut parts: Vec<([f64; 2], Said)> = Vec::new();
    for pair in ends.windows(2) {
        let mut own = tags.clone();
        let holds = |rule: &&Rule| rule.between[0] <= pair[0] && pair[1] <= rule.between[1];
        rules.iter().filter(holds).for_each(|rule| add(&mut own, rule));
        own.sort();
        match parts.last_mut() {
            Some((between, last)) if *last == own => between[1] = pair[1],
            _ => parts.push(([pair[0], pair[1]], own)),
        }
    }
    parts
}

/// What of a line in degrees lies between two of its places, which are told by their share of its length; its own
/// vertices are taken where they are within a decimetre of one.
pub(super) fn cut(line: &[Vertex], between: [f64; 2]) -> Vec<Vertex> {
    let mut passed_m = vec![0.0];
    for pair in line.windows(2) {
        passed_m.push(passed_m[passed_m.len() - 1] + metres(pair[0], pair[1]));
    }
    let whole_m = passed_m[line.len() - 1];
    let [from, to] = between.map(|share| stop(line, &passed_m, share * whole_m));
    let inside = (from.0.floor() as usize + 1..line.len()).take_while(|&index| (index as f64) < to.0);
    let mut cut = vec![from.1];
    cut.extend(inside.map(|index| line[index]));
    cut.push(to.1);
    cut
}

/// Where a line is after so many metres: between which vertices, as a number, and the place itself.
fn stop(line: &[Vertex], passed_m: &[f64], at_m: f64) -> (f64, Vertex) {
    const NEAR_M: f64 = 0.1;
    let after = passed_m.partition_point(|&passed_m| passed_m < at_m).clamp(1, line.len() - 1);
    let (before_m, after_m) = (passed_m[after - 1], passed_m[after]);
    match () {
        () if at_m - before_m <= NEAR_M && at_m - before_m <= after_m - at_m => ((after - 1) as f64, line[after - 1]),
        () if after_m - at_m <= NEAR_M => (after as f64, line[after]),
        () => {
            let share = (at_m - before_m) / (after_m - before_m);
            let place =
                [0, 1, 2].map(|axis| line[after - 1][axis] + share * (line[after][axis] - line[after - 1][axis]));
            ((after - 1) as f64 + share, place)
        }
    }
}

/// Metres of a short way on the ellipsoid.
fn metres(a: Vertex, b: Vertex) -> f64 {
    const RADIUS_M: f64 = 6_378_137.0;
    const FLATNESS: f64 = 0.006_694_379_990_14;
    const DEGREE: f64 = std::f64::consts::PI / 180.0;
    let cosine = (f64::midpoint(a[1], b[1]) * DEGREE).cos();
    let bulge = 1.0 - FLATNESS * (1.0 - cosine * cosine);
    let across_m = RADIUS_M / bulge.sqrt();
    let along_m = across_m * (1.0 - FLATNESS) / bulge;
    let (east, north) = ((b[0] - a[0]) * DEGREE * across_m * cosine, (b[1] - a[1]) * DEGREE * along_m);
    (east * east + north * north).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn check(columns: &[(&str, &str)], holds: Holds, form: [bool; 2], expected: &[(&str, &str)]) {
        let column = |name: &str| columns.iter().find(|(key, _)| *key == name).map(|(_, value)| *value);
        let found = tags(holds, &column, form);
        let found: Vec<(&str, &str)> = found.iter().map(|(key, value)| (key.as_str(), value.as_str())).collect();
        let told = found.iter().filter(|(key, _)| !["subtype", "class", "subclass"].contains(key));
        assert_eq!(told.copied().collect::<Vec<_>>(), expected, "{columns:?}");
    }

    #[test]
    fn columns_become_the_tags_that_the_table_says() {
        let (line, polygon) = ([true, false], [false, true]);
        let of = |subtype, class| [("subtype", subtype), ("class", class)];
        check(&of("road", "trunk"), Holds::Other, line, &[("highway", "trunk")]);
        check(&of("rail", "standard_gauge"), Holds::Other, line, &[("railway", "rail")]);
        check(&of("rail", "tram"), Holds::Other, line, &[("railway", "tram")]);
        check(&of("stream", "ditch"), Holds::Other, line, &[("waterway", "ditch")]);
        check(&of("river", "river"), Holds::Other, polygon, &[("natural", "water"), ("water", "river")]);
        check(&of("lake", "lake"), Holds::Other, polygon, &[("natural", "water"), ("water", "lake")]);
        check(&of("ocean", "ocean"), Holds::Other, polygon, &[("water", "ocean")]);
        check(&[("subtype", "forest")], Holds::Other, polygon, &[("natural", "wood")]);
        check(&of("barrier", "wall"), Holds::Other, line, &[("barrier", "wall")]);
        let building = [("class", "barn"), ("height", "7.5"), ("num_floors", "2"), ("subtype", "agricultural")];
        check(
            &building,
            Holds::Buildings,
            polygon,
            &[("height", "7.5"), ("building:levels", "2"), ("building", "barn")],
        );
        check(&[("min_height", "3")], Holds::BuildingParts, polygon, &[("min_height", "3"), ("building:part", "yes")]);
    }

    fn rule(column: &'static str, value: &str, between: [f64; 2]) -> Rule {
        Rule { column, value: value.into(), between }
    }

    #[test]
    fn rules_hold_along_their_part_and_equal_neighbours_are_one() {
        let tags = vec![("highway".to_owned(), "primary".to_owned())];
        let rules = [
            rule("road_flags", "is_bridge", [0.2, 0.5]),
            rule("level_rules", "1", [0.2, 0.5]),
            rule("road_surface", "unknown", [0.6, 0.7]),
            rule("subclass_rules", "link", [0.0, 1.0]),
        ];
        let parts = parts(&tags, &rules);
        let text: Vec<String> = parts.iter().map(|(between, tags)| format!("{between:?} {tags:?}")).collect();
        let link = "[(\"highway\", \"primary_link\")]";
        let bridge = "[(\"bridge\", \"yes\"), (\"highway\", \"primary_link\"), (\"layer\", \"1\")]";
        assert_eq!(text, [format!("[0.0, 0.2] {link}"), format!("[0.2, 0.5] {bridge}"), format!("[0.5, 1.0] {link}"),]);
        let built = super::parts(&tags, &[rule("road_flags", "is_under_construction", [0.0, 1.0])]);
        assert_eq!(built[0].1, [("highway".to_owned(), "construction".to_owned())]);
    }

    #[test]
    fn cuts_meet_and_take_the_vertices_that_are_there() {
        let line: Vec<Vertex> = [[0.0, 60.0], [0.01, 60.0], [0.01, 60.005], [0.03, 60.005]]
            .map(|[east, north]| [east, north, f64::NAN])
            .to_vec();
        // About 558, 557 and 1115 m.
        let whole: f64 = line.windows(2).map(|pair| metres(pair[0], pair[1])).sum();
        assert!((whole - 2230.5).abs() < 1.0, "{whole}");
        let share = metres(line[0], line[1]) / whole;
        let (first, second) = (cut(&line, [0.0, share]), cut(&line, [share, 0.75]));
        assert_eq!((first.len(), second.len()), (2, 3));
        assert_eq!(first[1][..2], line[1][..2]);
        assert_eq!(second[0][..2], line[1][..2]);
        let last = cut(&line, [0.75, 1.0]);
        assert_eq!((last[0][..2].to_vec(), last.len()), (second[2][..2].to_vec(), 2));
        assert!((last[0][0] - 0.02).abs() < 1e-4, "{last:?}");
    }
}
