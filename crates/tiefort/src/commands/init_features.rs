//! The sections of features and objects in a job that `init` writes, and what it tells of each file.

use std::path::Path;

use build::ObjectBudget;
use build::ground::FeaturesSeen;
use build::workbench::SeenFeatures;
use store::ObjectSums;
use views::grouped;

use crate::commands::budgets::share;
use crate::commands::job_words::{comment, quoted, relative};

/// What was found of features, in a line.
pub fn told_of(seen: &SeenFeatures) -> String {
    let layer = seen.layer.as_ref().map_or(String::new(), |layer| format!(", layer {layer}"));
    format!("{}{layer}: {}", seen.path.display(), found_of(seen))
}

/// How many lie in the area, and what they are.
fn found_of(SeenFeatures { seen, kind_by_name, object_by_name, .. }: &SeenFeatures) -> String {
    if seen.found == 0 {
        return "no lines or polygons".to_owned();
    }
    let inside = grouped(seen.found - seen.outside.min(seen.found));
    let mut text = format!("{inside} of {} lie in the area", grouped(seen.found));
    let all = seen.kinds.iter().chain(&seen.objects);
    let mut kinds: Vec<String> = all.map(|(kind, count)| format!("{} {kind}", grouped(*count as u64))).collect();
    match (kind_by_name, seen.without_kind) {
        (Some(kind), _) => kinds.push(format!("no tag says what they are, the name says {kind}")),
        (None, 0) => {}
        (None, count) if kinds.is_empty() => {
            kinds.push(format!(
                "no tag says what they are; add kind = \"…\", or all {} are left out",
                grouped(count as u64)
            ));
        }
        (None, count) => kinds.push(format!("{} of no kind, which are left out", grouped(count as u64))),
    }
    if let Some(kind) = object_by_name {
        kinds = vec![format!("no tag says what they are, the name says {kind}")];
    }
    if !kinds.is_empty() {
        text += &format!(": {}", kinds.join(", "));
    }
    if 0 < seen.coastlines {
        let count = grouped(seen.coastlines as u64);
        text += &format!("; coastlines ({count}) make no sea: give its polygon kind = \"lake\"");
    }
    text
}

/// Whether it is about objects alone.
fn has_objects_only(SeenFeatures { seen, kind_by_name, object_by_name, .. }: &SeenFeatures) -> bool {
    seen.kinds.is_empty() && kind_by_name.is_none() && has_objects(seen, *object_by_name)
}

fn has_objects(seen: &FeaturesSeen, object_by_name: Option<&str>) -> bool {
    !seen.objects.is_empty() || object_by_name.is_some()
}

/// Whether neither a tag nor a name says what anything in it is.
fn has_no_kind(SeenFeatures { seen, kind_by_name, .. }: &SeenFeatures) -> bool {
    seen.kinds.is_empty() && 0 < seen.without_kind && kind_by_name.is_none()
}

/// The entry of a list of sources, indented, with what it holds above it.
fn entry(seen: &SeenFeatures, kind: Option<&str>, is_used: bool, folder: &Path) -> String {
    let mut keys = vec![format!("file = {}", quoted(&relative(&seen.path, folder)))];
    keys.extend(seen.layer.as_ref().map(|layer| format!("layer = {}", quoted(layer))));
    keys.extend(kind.map(|kind| format!("kind = {}", quoted(kind))));
    let wants_kind = has_no_kind(seen) && kind.is_none();
    let entry = match keys.len() {
        1 if !wants_kind => quoted(&relative(&seen.path, folder)),
        _ => format!("{{ {} }}", keys.join(", ")),
    };
    let sign = if is_used { "" } else { "# " };
    let open = if wants_kind { "  # kind = \"…\"" } else { "" };
    format!("{}    {sign}{entry},{open}\n", comment(&found_of(seen)))
}

/// The section `[features]` of a job in `folder`; empty where there are no files of features.
pub fn features_section(all: &[SeenFeatures], folder: &Path) -> String {
    let all: Vec<&SeenFeatures> = all.iter().filter(|seen| !has_objects_only(seen)).collect();
    if all.is_empty() {
        return String::new();
    }
    let mut text = "\n# Roads, rivers and lakes; `tiefort plan` lists the table of their kinds.\n".to_owned();
    let is_used = |seen: &SeenFeatures| 0 < seen.seen.found;
    // A list without entries is no list of sources.
    let sign = if all.iter().any(|seen| is_used(seen)) { "" } else { "# " };
    text += &format!("{sign}[features]\n{sign}sources = [\n");
    text.extend(all.iter().map(|seen| entry(seen, seen.kind_by_name, is_used(seen), folder)));
    text + &format!(
        "{sign}]\n{sign}share_max = {}  # of a load module's limit that they may take\n",
        usual("share_max")
    )
}

/// The section `[objects]` of a job in `folder`, with what limits would keep, the last one chosen; empty where no file
/// has buildings, walls or woods.
pub fn objects_section(all: &[SeenFeatures], tried: &[ObjectBudget], folder: &Path) -> String {
    let has_some = |seen: &SeenFeatures| has_objects(&seen.seen, seen.object_by_name);
    if !all.iter().any(has_some) {
        return String::new();
    }
    let mut text = "\n# Buildings, walls and woods: they hide, and block vehicles.\n[objects]\n".to_owned();
    match all.iter().all(|seen| has_some(seen) && !has_objects_only(seen)) {
        true => text += "# sources = [\"…\"]  # those of [features] unless given\n",
        false => {
            text += "sources = [\n";
            text.extend(
                all.iter().filter(|seen| has_some(seen)).map(|seen| entry(seen, seen.object_by_name, true, folder)),
            );
            text += "]\n";
        }
    }
    let Some(chosen) = tried.last() else { return text };
    text += "[objects.limits]\n# What limits would keep of what they hide:\n";
    for of in tried {
        let own = if of == chosen { "  (this job)" } else { "" };
        text += &format!("#   {:>6}: {}{own}\n", of.per_load_module, kept_text(of));
    }
    text + &format!(
        "per_load_module = {}   # roofs, walls, and triangles of woods\nper_4km_square = {}\n",
        chosen.per_load_module, chosen.per_window
    )
}

/// Kept shares of what objects hide, by kind.
pub fn kept_text(of: &ObjectBudget) -> String {
    let kept = |sums: &ObjectSums| format!("{} {}", share([sums.kept_m2, sums.wanted_m2]), sums.kind);
    of.kinds.iter().map(kept).collect::<Vec<_>>().join(", ")
}

fn usual(key: &str) -> &'static str {
    job::usual_text(&format!("features.{key}"))
}
