//! From tags to what a feature is: the job's rules in order, then the built-in table.

use std::collections::BTreeSet;

use crate::lengths::{self, height_of};
use crate::{FeatureId, Flaw, Form, Kind, Remark, Remedy, Shape, Source, table};

/// Metres of road a lane takes.
const LANE_M: f64 = 3.5;

/// What a rule makes of the features it matches.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RuleKind {
    /// What the built-in table says; a breakline where it says nothing.
    AsBuiltIn,
    /// This kind.
    Is(Kind),
    /// They are left out.
    None,
}

/// A rule of the job.
#[derive(Clone, Debug, PartialEq)]
pub struct Rule {
    /// Tags and the values of which one must be there; an empty list of values means any.
    pub tags: Vec<(String, Vec<String>)>,
    /// The kind of what matches.
    pub kind: RuleKind,
    /// The name of its class; the kind's name unless said.
    pub class: Option<String>,
    /// Metres wide, instead of tags and defaults.
    pub width_m: Option<f64>,
    /// The greatest grade in percent.
    pub grade_max_percent: Option<f64>,
    /// How many times that grade it may be where limits of cut and fill ask for it, from 1.
    pub grade_give: Option<f64>,
    /// The form.
    pub form: Option<Form>,
    /// Whether heights of the feature are pins (`z = "feature"`).
    pub pins: bool,
}

impl Rule {
    /// The first kind that what it matches may have; `None` where that is left out.
    pub(crate) fn first_kind(&self) -> Option<Kind> {
        match self.kind {
            RuleKind::None => None,
            RuleKind::Is(kind) => Some(kind),
            RuleKind::AsBuiltIn => {
                let tag = |(key, values): &(String, Vec<String>)| {
                    values.iter().map(|value| (key.clone(), value.clone())).collect()
                };
                let tags: Vec<Vec<(String, String)>> = self.tags.iter().map(tag).collect();
                let kinds = tags.iter().flatten().filter_map(|tag| table::kind_of(std::slice::from_ref(tag)));
                Some(kinds.min().unwrap_or(Kind::Breakline))
            }
        }
    }

    pub(crate) fn matches(&self, feature: &Source) -> bool {
        self.tags.iter().all(|(key, values)| {
            feature.tag(key).is_some_and(|found| values.is_empty() || values.iter().any(|value| value == found))
        })
    }
}

/// Where a way runs. Only ways at one storey meet in mid-line.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Storey {
    /// On the ground, whatever its `layer`: two ways on the ground are both in it.
    Ground,
    /// On a bridge of this layer.
    Deck(i8),
    /// In a tunnel of this layer.
    Tunnel(i8),
}

impl Storey {
    /// Whether it is a bridge.
    pub fn is_deck(self) -> bool {
        matches!(self, Self::Deck(_))
    }

    /// Whether it is a tunnel.
    pub fn is_tunnel(self) -> bool {
        matches!(self, Self::Tunnel(_))
    }
}

/// All that later stages ask of a feature, but its id and its shape.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Traits {
    /// Number of its class in [`class_names`]; lower numbers keep their heights.
    pub class: u16,
    /// Its kind.
    pub kind: Kind,
    /// Where it runs.
    pub storey: Storey,
    /// Quanta wide.
    pub width: i32,
    /// Greatest rise over run, in parts per million.
    pub grade_ppm: u32,
    /// Thousandths of that grade that it may be where limits of cut and fill ask for it: 1000 where it never gives way.
    pub grade_give: u32,
    /// How it stands in the TIN where the ground asks for it.
    pub form: Form,
    /// The level its source gives, in quanta.
    pub level: Option<i32>,
    /// Whether heights of its vertices are pins.
    pub pins: bool,
}

impl Traits {
    /// The steepest that it may be where limits of cut and fill ask for it, in parts per million.
    pub fn grade_most_ppm(&self) -> u32 {
        (u64::from(self.grade_ppm) * u64::from(self.grade_give) / 1000).min(u64::from(u32::MAX)) as u32
    }

    /// Returns all that they are, word by word.
    pub(crate) fn feed(&self, word: &mut dyn FnMut(i64)) {
        let Traits { class, kind, storey, width, grade_ppm, grade_give, form, level, pins } = *self;
        let (storey, layer) = match storey {
            Storey::Ground => (0, 0),
            Storey::Deck(layer) => (1, layer),
            Storey::Tunnel(layer) => (2, layer),
        };
        let form = match form {
            Form::Line => 0,
            Form::Strip => 1,
            Form::StripAlways => 2,
            Form::Bench => 3,
            Form::Polygon => 4,
        };
        let kind = Kind::ALL.iter().position(|other| *other == kind).unwrap_or(Kind::ALL.len()) as i64;
        let numbers =
            [class.into(), kind, storey, layer.into(), width.into(), grade_ppm.into(), grade_give.into(), form];
        word(pins.into());
        numbers.into_iter().for_each(&mut *word);
        word(level.is_some().into());
        word(level.unwrap_or(0).into());
    }
}

/// A feature whose kind is known.
#[derive(Clone, Debug, PartialEq)]
pub struct Feature {
    /// Which one it is.
    pub id: FeatureId,
    /// What it is.
    pub traits: Traits,
    /// Its shape as read.
    pub shape: Shape,
}

/// What came of the rules.
#[derive(Clone, Debug, PartialEq)]
pub struct Sorted {
    /// Features with a kind, in no order that matters.
    pub features: Vec<Feature>,
    /// Values that were refused.
    pub remarks: Vec<Remark>,
}

/// Says what each feature is: the first of `rules` that matches decides, then the built-in table. `grade_give` is how
/// many times its grade a road may be where limits ask for it and no rule says so; railways and runways never are.
pub fn sort_out(sources: Vec<Source>, rules: &[Rule], grade_give: f64) -> Sorted {
    let built_in = |source: &Source| source.kind.or_else(|| table::kind_of(&source.tags));
    let kind_of = |source: &Source| -> (Option<usize>, Option<Kind>) {
        let rule = rules.iter().position(|rule| rule.matches(source));
        let kind = match rule.map(|rule| rules[rule].kind) {
            Some(RuleKind::None) => None,
            Some(RuleKind::Is(kind)) => Some(kind),
            Some(RuleKind::AsBuiltIn) => Some(built_in(source).unwrap_or(Kind::Breakline)),
            None => built_in(source),
        };
        (rule, kind)
    };
    let kinds: Vec<_> = sources.iter().map(kind_of).collect();
    let classes = class_names(rules);
    let (mut features, mut remarks) = (Vec::new(), Vec::new());
    for (source, (rule, kind)) in sources.into_iter().zip(kinds) {
        let Some(kind) = kind else { continue };
        let rule = rule.map(|rule| &rules[rule]);
        let class = class_name(rule, kind);
        let class = classes.iter().position(|name| name == class).unwrap_or_default() as u16;
        let traits = traits(&source, kind, class, (rule, grade_give), &mut remarks);
        features.push(Feature { id: source.id, traits, shape: source.shape });
    }
    Remark::sort(&mut remarks);
    Sorted { features, remarks }
}

/// Names of the classes that features may have, whatever there is of them: those of all kinds in the table's order, a
/// rule's own before that of its kind.
pub fn class_names(rules: &[Rule]) -> Vec<String> {
    let mut names: Vec<String> = Vec::new();
    let mut add = |name: &str| {
        if !names.iter().any(|other| other == name) {
            names.push(name.to_owned());
        }
    };
    for kind in Kind::ALL {
        rules.iter().filter(|rule| rule.first_kind() == Some(kind)).for_each(|rule| add(class_name(Some(rule), kind)));
        add(kind.name());
    }
    names
}

pub(crate) fn class_name(rule: Option<&Rule>, kind: Kind) -> &str {
    rule.and_then(|rule| rule.class.as_deref()).unwrap_or(kind.name())
}

/// Collects what was refused while one feature is looked at.
struct Reader<'a> {
    source: &'a Source,
    remarks: &'a mut Vec<Remark>,
}

impl Reader<'_> {
    /// The value of the first of `keys` that is there and can be read; what cannot is remarked.
    fn read<T>(&mut self, keys: &[&str], parse: impl Fn(&str) -> Option<T>) -> Option<T> {
        for key in keys {
            let Some(text) = self.source.tag(key) else { continue };
            if let Some(value) = parse(text) {
                return Some(value);
            }
            let flaw = Flaw::BadTag { key: (*key).to_owned(), found: text.chars().take(40).collect() };
            self.remark(flaw, Remedy::DefaultTaken);
        }
        None
    }

    fn remark(&mut self, flaw: Flaw, remedy: Remedy) {
        let posts = self.source.shape.first().map(|position| [position.east, position.north]);
        let posts = posts.filter(|posts| posts.iter().all(|axis| axis.is_finite()));
        self.remarks.push(Remark { id: self.source.id, posts, flaw, remedy });
    }

    fn is_set(&self, key: &str) -> bool {
        self.source.tag(key).is_some_and(|value| !["no", "false", "0", ""].contains(&value))
    }
}

fn traits(
    source: &Source,
    kind: Kind,
    class: u16,
    (rule, grade_give): (Option<&Rule>, f64),
    remarks: &mut Vec<Remark>,
) -> Traits {
    let mut reader = Reader { source, remarks };
    let width = width(&mut reader, kind, rule);
    let storey = storey(&mut reader, kind);
    let level_m = if kind == Kind::Lake { reader.read(&["level_m", "ele"], height_of) } else { None };
    let grade = rule.and_then(|rule| rule.grade_max_percent).map(|percent| (percent * 10_000.0).round() as u32);
    let gives = !matches!(kind, Kind::Rail | Kind::Runway);
    let give = rule.and_then(|rule| rule.grade_give).unwrap_or(if gives { grade_give } else { 1.0 });
    let is_area = is_area(source, kind);
    Traits {
        class,
        kind,
        storey,
        width,
        grade_ppm: grade.unwrap_or(kind.grade_default_ppm()),
        grade_give: (give * 1000.0).round() as u32,
        form: if is_area { Form::Polygon } else { rule.and_then(|rule| rule.form).unwrap_or(kind.form_default()) },
        level: level_m.and_then(terrain::quanta_of_metres),
        pins: rule.is_some_and(|rule| rule.pins),
    }
}

/// Whether a closed line of this feature encloses something: its tags or its shape say so.
fn is_area(source: &Source, kind: Kind) -> bool {
    let says = |key: &str, value: &str| source.tag(key) == Some(value);
    let tagged = says("area", "yes")
        || says("natural", "water")
        || says("waterway", "riverbank")
        || says("water", "river")
        || says("aeroway", "apron");
    kind == Kind::Lake || !matches!(source.shape, Shape::Line(_)) || (tagged && !kind.is_road())
}

/// Quanta of the width: the rule's, the tag's, that of its lanes, or the kind's.
fn width(reader: &mut Reader, kind: Kind, rule: Option<&Rule>) -> i32 {
    let of_rule = rule.and_then(|rule| rule.width_m);
    let metres = of_rule.or_else(|| {
        let tagged = reader.read(&["width"], lengths::width_of);
        let mut lanes = || kind.has_lanes().then(|| reader.read(&["lanes"], lengths::lanes_of)).flatten();
        tagged.or_else(|| lanes().map(|lanes| lanes * LANE_M))
    });
    let is_taxiway = kind == Kind::Runway && reader.source.tag("aeroway") == Some("taxiway");
    let default = if is_taxiway { 20 * 128 } else { kind.width_default() };
    metres.and_then(terrain::quanta_of_metres).unwrap_or(default)
}

/// Where a way runs, by `bridge`, `tunnel` and `layer`.
fn storey(reader: &mut Reader, kind: Kind) -> Storey {
    if matches!(kind, Kind::Lake | Kind::Dam | Kind::Breakline) {
        return Storey::Ground;
    }
    let layer = |text: &str| text.trim().parse::<i8>().ok().filter(|layer| layer.abs() <= 20);
    let layer = reader.read(&["layer"], layer);
    // A passage through a building lies on the ground.
    let tunnel = reader.is_set("tunnel") && reader.source.tag("tunnel") != Some("building_passage");
    let bridge = reader.is_set("bridge");
    if bridge && tunnel {
        reader.remark(Flaw::BridgeAndTunnel, Remedy::BridgeKept);
    }
    match (bridge, tunnel) {
        (true, _) => Storey::Deck(layer.unwrap_or(1)),
        (false, true) => Storey::Tunnel(layer.unwrap_or(-1)),
        (false, false) => Storey::Ground,
    }
}

/// For a rule that matches nothing: of each of its tags, the nearest tag and value there is, by edits.
pub fn nearest_tags(rule: &Rule, sources: &[Source]) -> Vec<String> {
    let all: BTreeSet<(&str, &str)> =
        sources.iter().flat_map(|source| source.tags.iter().map(|(key, value)| (&**key, &**value))).collect();
    let keys: BTreeSet<&str> = all.iter().map(|(key, _)| *key).collect();
    let mut nearest = Vec::new();
    for (key, values) in &rule.tags {
        let Some(near_key) = nearest_word(key, keys.iter().copied()) else { continue };
        let there = all.iter().filter(|(key, _)| *key == near_key).map(|(_, value)| *value);
        let by_value = values.iter().filter_map(|value| nearest_word(value, there.clone()));
        let near_value = by_value.min_by_key(|near| {
            values.iter().map(|value| strsim::osa_distance(value, near)).min().unwrap_or(usize::MAX)
        });
        nearest.push(near_value.map_or(near_key.to_owned(), |value| format!("{near_key} = {value}")));
    }
    nearest
}

fn nearest_word<'a>(word: &str, words: impl Iterator<Item = &'a str>) -> Option<&'a str> {
    words.min_by_key(|candidate| (strsim::osa_distance(&word.to_lowercase(), &candidate.to_lowercase()), *candidate))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Numbering, Position};

    fn source(number: i64, tags: &[(&str, &str)]) -> Source {
        let tags = tags.iter().map(|(key, value)| (key.to_string(), value.to_string())).collect();
        let shape = Shape::Line(vec![Position::new(1.0, 2.0), Position::new(3.0, 2.0)]);
        Source { id: FeatureId { source: 0, numbering: Numbering::Way, number }, tags, kind: None, shape }
    }

    fn rule(key: &str, value: &str) -> Rule {
        Rule {
            tags: vec![(key.into(), vec![value.into()])],
            kind: RuleKind::AsBuiltIn,
            class: None,
            width_m: None,
            grade_max_percent: None,
            grade_give: None,
            form: None,
            pins: false,
        }
    }

    #[track_caller]
    fn traits_of(tags: &[(&str, &str)]) -> (Traits, Vec<Remark>) {
        let sorted = sort_out(vec![source(1, tags)], &[], 1.5);
        (sorted.features[0].traits, sorted.remarks)
    }

    #[test]
    fn a_width_is_that_of_its_tag_or_of_its_lanes_or_of_its_kind() {
        assert_eq!(traits_of(&[("highway", "primary"), ("width", "9 m"), ("lanes", "4")]).0.width, 9 * 128);
        assert_eq!(traits_of(&[("highway", "primary"), ("lanes", "4")]).0.width, 14 * 128);
        assert_eq!(traits_of(&[("highway", "primary")]).0.width, 7 * 128);
        assert_eq!(traits_of(&[("aeroway", "taxiway")]).0.width, 20 * 128);
        assert_eq!(traits_of(&[("railway", "rail"), ("lanes", "9")]).0.width, 5 * 128);
    }

    #[test]
    fn a_width_that_is_none_is_written_down_and_the_lanes_are_asked() {
        for bad in ["0", "-3", "wide", "1e9"] {
            let (traits, remarks) = traits_of(&[("highway", "primary"), ("width", bad), ("lanes", "2")]);
            assert_eq!(traits.width, 7 * 128);
            assert_eq!(remarks.len(), 1);
            assert_eq!(remarks[0].flaw, Flaw::BadTag { key: "width".into(), found: bad.into() });
            assert_eq!(remarks[0].posts, Some([1.0, 2.0]));
        }
    }

    #[test]
    fn a_bridge_that_is_a_tunnel_too_is_a_bridge() {
        let (traits, remarks) = traits_of(&[("highway", "primary"), ("bridge", "yes"), ("tunnel", "yes")]);
        assert_eq!(traits.storey, Storey::Deck(1));
        assert_eq!(remarks[0].flaw, Flaw::BridgeAndTunnel);
        let (traits, remarks) = traits_of(&[("highway", "primary"), ("tunnel", "yes"), ("layer", "2;1")]);
        assert_eq!((traits.storey, remarks.len()), (Storey::Tunnel(-1), 1));
        assert_eq!(traits_of(&[("highway", "primary"), ("bridge", "no"), ("layer", "1")]).0.storey, Storey::Ground);
    }

    #[test]
    fn rules_of_the_job_go_first_and_may_leave_features_out() {
        let track = Rule {
            class: Some("desert track".into()),
            width_m: Some(4.0),
            grade_max_percent: Some(12.5),
            grade_give: None,
            form: Some(Form::Bench),
            ..rule("highway", "track")
        };
        let none = Rule { kind: RuleKind::None, ..rule("highway", "service") };
        let named = rule("man_made", "embankment");
        let sources = vec![
            source(1, &[("highway", "track")]),
            source(2, &[("highway", "service")]),
            source(3, &[("man_made", "embankment")]),
            source(4, &[("highway", "motorway")]),
        ];
        let rules = [track, none, named];
        let classes = class_names(&rules);
        assert_eq!(classes[..5], ["motorway", "primary", "minor", "desert track", "track"]);
        let sorted = sort_out(sources, &rules, 1.5);
        let traits = sorted.features[0].traits;
        assert_eq!((traits.width, traits.grade_ppm, traits.form, traits.class), (512, 125_000, Form::Bench, 3));
        assert_eq!(sorted.features.len(), 3);
    }

    #[test]
    fn a_rule_that_matches_nothing_is_told_the_nearest_tag() {
        let sources = [source(1, &[("highway", "track"), ("surface", "gravel")]), source(2, &[("highway", "path")])];
        assert_eq!(nearest_tags(&rule("higway", "trakc"), &sources), ["highway = track"]);
        assert_eq!(nearest_tags(&rule("highway", "tracks"), &sources), ["highway = track"]);
        assert!(nearest_tags(&rule("highway", "track"), &[]).is_empty());
    }
}
