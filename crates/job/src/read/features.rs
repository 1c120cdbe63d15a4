//! `[features]`: roads, rivers and lakes that become parts of the ground.

use std::path::Path;

use features::{Clearances, FallOptions, GradeOptions, Rule, RuleKind};
use terrain::HOLE_CLASS;

use crate::bounds::{FEATURE_SOURCES_MAX, NAME_CHARS_MAX, RULES_MAX, TAG_CHARS_MAX, TAGS_MAX};
use crate::entry::{Entry, Section};
use crate::feature_keys::RULES;
use crate::files::{Mention, Place};
use crate::{
    DemSource, Edges, FeatureSource, FeaturesSpec, HOLE_CLASS_NAME, HeightsFrom, ImportanceSpec, JobError, MethodName,
};

/// What the built-in terrain's own features are called among the sources.
pub(crate) const SAMPLE: &str = "sample";

pub(super) fn read(
    features: &Section,
    dem: &DemSource,
    importance: &ImportanceSpec,
    job: &Path,
    mentions: &mut Vec<Mention>,
) -> Result<Option<FeaturesSpec>, JobError> {
    if !features.is_there() {
        return Ok(None);
    }
    let sources = sources(&features.required("sources")?, dem, job, mentions)?;
    let rules = features.optional("rules");
    let smooth_posts = features.maybe("smooth_posts", Entry::number)?;
    let spec = FeaturesSpec {
        sources,
        rules: rules.as_ref().map_or(Ok(Vec::new()), |rules| read_rules(rules, importance))?,
        buildings: features.flag("buildings")?,
        share_main: features.number("share_main")?,
        share_max: features.number("share_max")?,
        left_out_weight: features.number("left_out_weight")?,
        grade_give: features.number("grade_give")?,
        falls: FallOptions {
            tau: (features.number("river_tau")? * 1000.0).round() as u32,
            carve_max: quanta(features, "carve_max_m")?,
            tilt: features.flag("river_tilt")?,
            cut_max: quanta(features, "cut_max_m")?,
            fill_max: quanta(features, "fill_max_m")?,
        },
        options: GradeOptions {
            clearances: Clearances {
                road: quanta(features, "clearance_road_m")?,
                rail: quanta(features, "clearance_rail_m")?,
                water: quanta(features, "clearance_water_m")?,
            },
            bank: quanta(features, "bank_m")?,
            cut_max: quanta(features, "cut_max_m")?,
            fill_max: quanta(features, "fill_max_m")?,
            clip: quanta(features, "clip_m")?,
            smooth_milliposts: smooth_posts.map(|posts| (posts * 1000.0).round() as u32),
        },
    };
    let classes = spec.classes_after(importance).len();
    if let (Some(rules), true) = (rules, usize::from(HOLE_CLASS) < classes) {
        let hint = "let several rules, or several areas in [importance], name the same class";
        return Err(rules.out_of_range_with(format!("at most {HOLE_CLASS} classes in all, not {classes}"), hint));
    }
    Ok(Some(spec))
}

/// Refuses what cannot keep the edges or the levels of features.
pub(super) fn refuse_beside(
    features: &Section,
    [dem, modules, tin]: [&Section; 3],
    edges: Edges,
    method: MethodName,
) -> Result<(), JobError> {
    const BESIDE: &str = "[features]";
    if !features.is_there() {
        return Ok(());
    }
    if let (Edges::Clip(_), Some(entry)) = (edges, modules.optional("edges")) {
        let expected = "\"constrained\", since clipping would cut the edges of features";
        return Err(entry.conflict(BESIDE, expected, "remove edges, or leave [features] out"));
    }
    if let (MethodName::Paper, Some(entry)) = (method, tin.optional("method")) {
        let expected = "\"optimised\" or \"greedy\", since the paper's TIN has no edges that must stay";
        return Err(entry.conflict(BESIDE, expected, "remove method, or leave [features] out"));
    }
    if let Some(entry) = dem.optional("water") {
        let expected = "no water in [dem], since lakes of features lie level by rules of their own";
        let hint = "move the file: sources = [{ file = \"lakes.gpkg\", kind = \"lake\" }] in [features]";
        return Err(entry.conflict(BESIDE, expected, hint));
    }
    Ok(())
}

fn quanta(features: &Section, key: &str) -> Result<i32, JobError> {
    let metres = features.number(key)?;
    Ok(terrain::quanta_of_metres(metres).expect("the key's range lies within that of heights"))
}

fn sources(
    entry: &Entry,
    dem: &DemSource,
    job: &Path,
    mentions: &mut Vec<Mention>,
) -> Result<Vec<FeatureSource>, JobError> {
    // The one word that is no path may stand without a list, as the text of the key says.
    let items = if entry.text().is_ok_and(|text| text == SAMPLE) { vec![entry.clone()] } else { entry.list()? };
    if items.is_empty() || FEATURE_SOURCES_MAX < items.len() {
        return Err(entry.out_of_range(entry.expected()));
    }
    let mut sources = Vec::new();
    for item in &items {
        let source = source(item, dem, job)?;
        match &source {
            FeatureSource::Sample if sources.contains(&source) => {
                return Err(item.conflict("the same before it", "\"sample\" once", "remove one of the two"));
            }
            FeatureSource::Sample => {}
            FeatureSource::File { file, .. } => {
                let place = Place::Features(sources.len());
                mentions.push(Mention::of_list(place, item, file, "a file of lines and polygons")?);
            }
        }
        sources.push(source);
    }
    Ok(sources)
}

/// A path, a table with a path and what is to be known about it, or the built-in terrain's own.
fn source(item: &Entry, dem: &DemSource, job: &Path) -> Result<FeatureSource, JobError> {
    if item.is_table() {
        let table = item.table()?;
        let (layer, crs) = (table.text("layer")?, table.text("crs")?);
        let kind = table.maybe("kind", Entry::word)?;
        return Ok(FeatureSource::File { file: table.required("file")?.file(job)?, layer, kind, crs });
    }
    match (item.text()?, dem) {
        (SAMPLE, DemSource::Sample { .. }) => Ok(FeatureSource::Sample),
        (SAMPLE, DemSource::Files { .. }) => Err(item.conflict(
            "dem.sources",
            "a file, since only the built-in terrain brings features of its own",
            "a file of that name is { file = \"sample\" }",
        )),
        _ => Ok(FeatureSource::File { file: item.file(job)?, layer: None, kind: None, crs: None }),
    }
}

fn read_rules(entry: &Entry, importance: &ImportanceSpec) -> Result<Vec<Rule>, JobError> {
    entry.items_of(0..=RULES_MAX)?.iter().map(|item| rule(item, importance)).collect()
}

fn rule(item: &Entry, importance: &ImportanceSpec) -> Result<Rule, JobError> {
    let table = item.table()?;
    let tags = tags(&table.required("where")?)?;
    let kind = table.maybe("kind", Entry::word)?.unwrap_or(RuleKind::AsBuiltIn);
    let mut others = RULES.iter().map(|key| key.name).filter(|name| !["where", "kind"].contains(name));
    if let (RuleKind::None, Some(other)) = (kind, others.find_map(|key| table.optional(key))) {
        let hint = "remove it, or write another kind";
        return Err(other.conflict("kind = \"none\"", "no more keys, since these features are left out", hint));
    }
    let heights: HeightsFrom = table.word("z")?;
    Ok(Rule {
        tags,
        kind,
        class: table.maybe("class", |entry| class(entry, importance))?,
        width_m: table.maybe("width_m", Entry::number)?,
        grade_max_percent: table.maybe("grade_max_percent", Entry::number)?,
        grade_give: table.maybe("grade_give", Entry::number)?,
        form: table.maybe("form", Entry::word)?,
        pins: heights == HeightsFrom::Feature,
    })
}

/// Tags that a feature must have: of each key one of some values, or any.
pub(super) fn tags(entry: &Entry) -> Result<Vec<(String, Vec<String>)>, JobError> {
    let fits = |text: &str| (1..=TAG_CHARS_MAX).contains(&text.chars().count());
    let mut tags = Vec::new();
    for (key, value) in entry.items()? {
        let values = if value.is_list() { value.list()? } else { vec![value] };
        let values: Result<Vec<String>, JobError> = values.iter().map(|value| Ok(value.text()?.to_owned())).collect();
        let values = values?;
        if !fits(&key) || TAGS_MAX < values.len() || !values.iter().all(|value| fits(value)) {
            return Err(entry.out_of_range(entry.expected()));
        }
        tags.push((key, values));
    }
    if TAGS_MAX < tags.len() {
        return Err(entry.out_of_range(entry.expected()));
    }
    tags.sort();
    Ok(tags)
}

/// The name of a class: one of the job's, or one that is fit to be a name.
fn class(entry: &Entry, importance: &ImportanceSpec) -> Result<String, JobError> {
    let name = entry.text()?;
    if name == HOLE_CLASS_NAME {
        let hint = "ground without heights has the class \"hole\", whatever the job says";
        return Err(entry.out_of_range_with("another name for a class of the job", hint));
    }
    let is_plain = (1..=NAME_CHARS_MAX).contains(&name.len())
        && name.chars().all(|c| c.is_ascii_alphanumeric() || "-_".contains(c));
    match is_plain || importance.classes.iter().any(|class| class == name) {
        true => Ok(name.to_owned()),
        false => Err(entry.out_of_range(entry.expected())),
    }
}
