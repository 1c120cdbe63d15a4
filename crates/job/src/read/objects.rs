//! `[objects]`: buildings, walls and woods that stand on the ground.

use std::path::Path;

use features::objects::{ObjectOptions, ObjectRule};
use terrain::ObjectKind;

use super::features::tags;
use crate::bounds::{FEATURE_SOURCES_MAX, RULES_MAX};
use crate::entry::{Entry, Section};
use crate::files::{Mention, Place};
use crate::{Edges, FeatureSource, FeaturesSpec, JobError, NamedFile, ObjectSource, ObjectsSpec, usual_text};

pub(super) fn read(
    objects: &Section,
    features: Option<&FeaturesSpec>,
    job: &Path,
    mentions: &mut Vec<Mention>,
) -> Result<Option<ObjectsSpec>, JobError> {
    if !objects.is_there() {
        return Ok(None);
    }
    let sources = match objects.optional("sources") {
        Some(entry) => sources(&entry, job, mentions)?,
        None => of_features(objects, features)?,
    };
    let rules = objects.maybe("rules", read_rules)?.unwrap_or_default();
    let limits = match objects.optional("limits") {
        Some(limits) => limits.table()?,
        None => objects.absent("limits"),
    };
    Ok(Some(ObjectsSpec {
        sources,
        rules,
        options: ObjectOptions {
            corners_max: objects.whole("corners_max")? as usize,
            area_min_m2: objects.number("area_min_m2")?,
        },
        per_load_module: limits.whole_u32("per_load_module")?,
        per_4km_square: limits.whole_u32("per_4km_square")?,
        joint: limits.flag("joint")?,
    }))
}

/// Refuses what cannot hold objects.
pub(super) fn refuse_beside(objects: &Section, modules: &Section, edges: Edges, format: u32) -> Result<(), JobError> {
    const BESIDE: &str = "[objects]";
    if !objects.is_there() {
        return Ok(());
    }
    if let (Edges::Clip(_), Some(entry)) = (edges, modules.optional("edges")) {
        let expected = "\"constrained\", since objects stand on ground that is settled before it is cut";
        return Err(entry.conflict(BESIDE, expected, "remove edges, or leave [objects] out"));
    }
    if let (true, Some(entry)) = (format < 3, modules.optional("format")) {
        return Err(entry.conflict(
            BESIDE,
            "3, the first version with objects",
            "remove format, or leave [objects] out",
        ));
    }
    Ok(())
}

/// The files of `[features]`.
fn of_features(objects: &Section, features: Option<&FeaturesSpec>) -> Result<Vec<ObjectSource>, JobError> {
    let mut sources: Vec<ObjectSource> = Vec::new();
    for source in features.iter().flat_map(|features| &features.sources) {
        let FeatureSource::File { file, layer, kind: _, crs } = source else { continue };
        let (file, layer, crs) = (file.clone(), layer.clone(), crs.clone());
        let source = ObjectSource { layer, crs, ..plain(file) };
        if !sources.contains(&source) {
            sources.push(source);
        }
    }
    match sources.is_empty() {
        // Where patterns of features find no file there is an error already.
        true => objects.required("sources").map(|_| sources),
        false => Ok(sources),
    }
}

fn sources(entry: &Entry, job: &Path, mentions: &mut Vec<Mention>) -> Result<Vec<ObjectSource>, JobError> {
    let mut sources = Vec::new();
    for item in &entry.items_of(1..=FEATURE_SOURCES_MAX)? {
        let source = source(item, job)?;
        let place = Place::Objects(sources.len());
        mentions.push(Mention::of_list(place, item, &source.file, "a file of polygons and lines")?);
        sources.push(source);
    }
    Ok(sources)
}

/// A file of which nothing more is said.
fn plain(file: NamedFile) -> ObjectSource {
    let usual = |key: &str| usual_text(&format!("objects.sources[].{key}")).parse().expect("what holds is a number");
    let (least_m, cell_m) = (usual("least_m"), usual("cell_m"));
    ObjectSource { file, layer: None, kind: None, height: None, crs: None, least_m, cell_m }
}

fn source(item: &Entry, job: &Path) -> Result<ObjectSource, JobError> {
    if !item.is_table() {
        return Ok(plain(item.file(job)?));
    }
    let table = item.table()?;
    Ok(ObjectSource {
        file: table.required("file")?.file(job)?,
        layer: table.text("layer")?,
        kind: table.maybe("kind", Entry::word)?,
        height: table.text("height")?,
        crs: table.text("crs")?,
        least_m: table.number("least_m")?,
        cell_m: table.number("cell_m")?,
    })
}

fn read_rules(entry: &Entry) -> Result<Vec<ObjectRule>, JobError> {
    entry.items_of(0..=RULES_MAX)?.iter().map(rule).collect()
}

fn rule(item: &Entry) -> Result<ObjectRule, JobError> {
    let table = item.table()?;
    let tags = tags(&table.required("where")?)?;
    let kind = table.maybe("kind", kind_of)?;
    if let (Some(None), Some(other)) = (kind, table.optional("height_m")) {
        let hint = "remove it, or write another kind";
        return Err(other.conflict("kind = \"none\"", "no more keys, since these objects are left out", hint));
    }
    Ok(ObjectRule { tags, kind, height_m: table.maybe("height_m", Entry::number)? })
}

fn kind_of(entry: &Entry) -> Result<Option<ObjectKind>, JobError> {
    match entry.text()? {
        "none" => Ok(None),
        _ => Ok(Some(entry.word()?)),
    }
}
