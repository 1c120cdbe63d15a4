//! The table of kinds that results from a job's rules and the built-in ones, and what of the features each row holds.

use std::collections::BTreeMap;

use crate::rules::class_name;
use crate::{Form, Kind, Rule, RuleKind, Source, nearest_tags, table};

/// Where a row of the table comes from. Rows are in the order in which they are tried.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum RowOrigin {
    /// The rule of that number, from 0.
    Rule(usize),
    /// The kind that the job gives to all features of a source.
    Source,
    /// The row of that number of the built-in table, from 0.
    BuiltIn(usize),
}

/// A row of the table.
#[derive(Clone, Debug, PartialEq)]
pub struct OverviewRow {
    /// Where it comes from.
    pub origin: RowOrigin,
    /// The kind; `None` where what matches is left out.
    pub kind: Option<Kind>,
    /// The name of the class.
    pub class: Option<String>,
    /// Tags, each with the values of which one must be there, or any where there are none.
    pub tags: Vec<(String, Vec<String>)>,
    /// Metres wide by a rule.
    pub width_m: Option<f64>,
    /// The greatest grade in percent, where the kind has one.
    pub grade_max_percent: Option<f64>,
    /// The form of what is no polygon.
    pub form: Form,
    /// How many features it decides.
    pub count: usize,
}

/// A rule that decides no feature.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct IdleRule {
    /// Its number, from 0.
    pub rule: usize,
    /// How many features match it that a rule before it has taken.
    pub taken: usize,
    /// Where none does: of each of its tags, the nearest there is.
    pub nearest: Vec<String>,
}

/// The table of kinds that results, and what it holds.
#[derive(Clone, Debug, PartialEq)]
pub struct Overview {
    /// The rows: of the rules, of sources whose kind the job says, and the built-in ones.
    pub rows: Vec<OverviewRow>,
    /// Rules that decide no feature, in their order.
    pub idle: Vec<IdleRule>,
    /// Of each source, by its number, the features that no row matches; they are left out.
    pub unmatched: BTreeMap<u32, usize>,
}

/// Counts what each row decides.
pub fn overview(sources: &[Source], rules: &[Rule]) -> Overview {
    let mut counts: BTreeMap<(RowOrigin, Option<Kind>), usize> = BTreeMap::new();
    for (number, rule) in rules.iter().enumerate() {
        counts.insert((RowOrigin::Rule(number), rule.first_kind()), 0);
    }
    for (number, (_, _, kind)) in table::rows().enumerate() {
        counts.insert((RowOrigin::BuiltIn(number), Some(kind)), 0);
    }
    let mut unmatched = BTreeMap::new();
    for source in sources {
        match decided(source, rules) {
            Some(row) => *counts.entry(row).or_default() += 1,
            None => *unmatched.entry(source.id.source).or_default() += 1,
        }
    }
    let of_rule = |number: usize| {
        let counts = &counts;
        counts.iter().filter(move |((origin, _), _)| *origin == RowOrigin::Rule(number)).map(|(_, count)| *count)
    };
    let is_idle = |number: &usize| of_rule(*number).sum::<usize>() == 0;
    let idle = (0..rules.len()).filter(is_idle).map(|number| idle_rule(number, sources, &rules[number])).collect();
    // A rule for several kinds has a row for each that there is, and for its first where there is none.
    let has_others = |(origin, _): &(RowOrigin, Option<Kind>)| match origin {
        RowOrigin::Rule(number) => of_rule(*number).any(|count| 0 < count),
        _ => false,
    };
    let shown = counts.iter().filter(|(row, count)| 0 < **count || !has_others(row));
    let rows = shown.map(|(&(origin, kind), &count)| row(origin, kind, count, rules)).collect();
    Overview { rows, idle, unmatched }
}

/// Which row decides what a feature is, and its kind; `None` where no row matches.
fn decided(source: &Source, rules: &[Rule]) -> Option<(RowOrigin, Option<Kind>)> {
    let said = source.kind.map(|kind| (RowOrigin::Source, Some(kind)));
    let built_in = || {
        let number = table::row_of(&source.tags)?;
        Some((RowOrigin::BuiltIn(number), table::rows().nth(number).map(|(_, _, kind)| kind)))
    };
    let others = said.or_else(built_in);
    let Some(number) = rules.iter().position(|rule| rule.matches(source)) else { return others };
    let kind = match rules[number].kind {
        RuleKind::None => None,
        RuleKind::Is(kind) => Some(kind),
        RuleKind::AsBuiltIn => others.map_or(Some(Kind::Breakline), |(_, kind)| kind),
    };
    Some((RowOrigin::Rule(number), kind))
}

fn idle_rule(number: usize, sources: &[Source], rule: &Rule) -> IdleRule {
    let taken = sources.iter().filter(|source| rule.matches(source)).count();
    let nearest = if taken == 0 { nearest_tags(rule, sources) } else { Vec::new() };
    IdleRule { rule: number, taken, nearest }
}

fn row(origin: RowOrigin, kind: Option<Kind>, count: usize, rules: &[Rule]) -> OverviewRow {
    let rule = if let RowOrigin::Rule(number) = origin { Some(&rules[number]) } else { None };
    let tags = match origin {
        RowOrigin::Rule(number) => rules[number].tags.clone(),
        RowOrigin::Source => Vec::new(),
        RowOrigin::BuiltIn(number) => table::rows()
            .nth(number)
            .map(|(key, values, _)| (key.to_owned(), values.iter().map(|value| (*value).to_owned()).collect()))
            .into_iter()
            .collect(),
    };
    let usual = kind.filter(|kind| kind.is_travelled()).map(|kind| f64::from(kind.grade_default_ppm()) / 10_000.0);
    OverviewRow {
        origin,
        kind,
        class: kind.map(|kind| class_name(rule, kind).to_owned()),
        tags,
        width_m: rule.and_then(|rule| rule.width_m),
        grade_max_percent: usual.map(|usual| rule.and_then(|rule| rule.grade_max_percent).unwrap_or(usual)),
        form: rule.and_then(|rule| rule.form).unwrap_or(kind.map_or(Form::Line, Kind::form_default)),
        count,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{FeatureId, Numbering, Shape};

    fn source(tags: &[(&str, &str)], kind: Option<Kind>) -> Source {
        let tags = tags.iter().map(|(key, value)| (key.to_string(), value.to_string())).collect();
        let id = FeatureId { source: 0, numbering: Numbering::Row, number: 1 };
        Source { id, tags, kind, shape: Shape::Line(Vec::new()) }
    }

    fn rule(tags: &[(&str, &[&str])], kind: RuleKind, class: Option<&str>) -> Rule {
        let owned = |values: &[&str]| values.iter().map(|value| value.to_string()).collect();
        let tags = tags.iter().map(|(key, values)| (key.to_string(), owned(values))).collect();
        let class = class.map(str::to_owned);
        Rule {
            tags,
            kind,
            class,
            width_m: Some(4.0),
            grade_max_percent: None,
            grade_give: None,
            form: None,
            pins: false,
        }
    }

    /// What rows that decide anything, or are rules, say.
    fn shown(overview: &Overview) -> Vec<(RowOrigin, &'static str, &str, usize)> {
        let rows = overview.rows.iter().filter(|row| 0 < row.count || matches!(row.origin, RowOrigin::Rule(_)));
        let word = |row: &OverviewRow| row.kind.map_or("none", Kind::name);
        rows.map(|row| (row.origin, word(row), row.class.as_deref().unwrap_or(""), row.count)).collect()
    }

    #[test]
    fn each_feature_is_counted_in_the_row_that_decides_it() {
        let sources = [
            source(&[("highway", "track")], None),
            source(&[("highway", "track"), ("surface", "sand")], None),
            source(&[("railway", "rail"), ("surface", "sand")], None),
            source(&[("highway", "path")], None),
            source(&[], Some(Kind::Lake)),
            source(&[("name", "x")], None),
        ];
        let sand = rule(&[("surface", &["sand"])], RuleKind::AsBuiltIn, Some("sandy"));
        let paths = rule(&[("highway", &["path", "steps"])], RuleKind::None, None);
        let overview = overview(&sources, &[sand, paths]);
        let expected = [
            (RowOrigin::Rule(0), "track", "sandy", 1),
            (RowOrigin::Rule(0), "rail", "sandy", 1),
            (RowOrigin::Rule(1), "none", "", 1),
            (RowOrigin::Source, "lake", "lake", 1),
            (RowOrigin::BuiltIn(3), "track", "track", 1),
        ];
        assert_eq!(shown(&overview), expected);
        assert_eq!((&overview.unmatched, overview.idle.len()), (&BTreeMap::from([(0, 1)]), 0));
        assert_eq!(overview.rows.len(), 4 + table::rows().count(), "rows of the built-in table are all listed");
        let counted: usize = overview.rows.iter().map(|row| row.count).sum();
        assert_eq!(counted + overview.unmatched[&0], sources.len());
    }

    #[test]
    fn a_rule_that_decides_nothing_is_told_with_the_nearest_tag_or_with_what_was_taken() {
        let sources = [source(&[("highway", "track")], None), source(&[("highway", "path")], None)];
        let tracks = rule(&[("highway", &["track"])], RuleKind::Is(Kind::Minor), None);
        let typo = rule(&[("higway", &["trak"])], RuleKind::Is(Kind::Track), None);
        let overview = overview(&sources, &[tracks.clone(), typo, tracks]);
        let idle = |rule, taken, nearest: &[&str]| {
            let nearest = nearest.iter().map(|tag| tag.to_string()).collect();
            IdleRule { rule, taken, nearest }
        };
        assert_eq!(overview.idle, [idle(1, 0, &["highway = track"]), idle(2, 1, &[])]);
        assert_eq!(shown(&overview)[1], (RowOrigin::Rule(1), "track", "track", 0));
    }

    #[test]
    fn rows_say_width_grade_and_form_of_the_rule_or_the_kind() {
        let trail = Rule {
            grade_max_percent: Some(30.0),
            form: Some(Form::Bench),
            ..rule(&[("highway", &["path"])], RuleKind::Is(Kind::Track), Some("trail"))
        };
        let overview = overview(&[], &[trail]);
        let row = &overview.rows[0];
        assert_eq!((row.width_m, row.grade_max_percent, row.form), (Some(4.0), Some(30.0), Form::Bench));
        assert_eq!(row.class.as_deref(), Some("trail"));
        let rail = overview.rows.iter().find(|row| row.kind == Some(Kind::Rail)).unwrap();
        assert_eq!((rail.width_m, rail.grade_max_percent, rail.form), (None, Some(3.0), Form::Strip));
        let lake = overview.rows.iter().find(|row| row.kind == Some(Kind::Lake)).unwrap();
        assert_eq!((lake.grade_max_percent, lake.form), (None, Form::Polygon));
    }
}
