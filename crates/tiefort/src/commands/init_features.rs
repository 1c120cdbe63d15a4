//! The section of features in a job that `init` writes, and what it tells of each file.

use std::path::Path;

use build::workbench::SeenFeatures;
use views::grouped;

use crate::commands::job_words::{comment, quoted, relative};

/// What was found of features, in a line.
pub fn told_of(seen: &SeenFeatures) -> String {
    let layer = seen.layer.as_ref().map_or(String::new(), |layer| format!(", layer {layer}"));
    format!("{}{layer}: {}", seen.path.display(), found_of(seen))
}

/// How many lie in the area, and what they are.
fn found_of(SeenFeatures { seen, kind_by_name, .. }: &SeenFeatures) -> String {
    if seen.found == 0 {
        return "no lines or polygons".to_owned();
    }
    let inside = grouped(seen.found - seen.outside.min(seen.found));
    let mut text = format!("{inside} of {} lie in the area", grouped(seen.found));
    let mut kinds: Vec<String> =
        seen.kinds.iter().map(|(kind, count)| format!("{} {kind}", grouped(*count as u64))).collect();
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
    if !kinds.is_empty() {
        text += &format!(": {}", kinds.join(", "));
    }
    text
}

/// Whether neither a tag nor a name says what anything in it is.
fn has_no_kind(SeenFeatures { seen, kind_by_name, .. }: &SeenFeatures) -> bool {
    seen.kinds.is_empty() && 0 < seen.without_kind && kind_by_name.is_none()
}

/// The section `[features]` of a job in `folder`; empty where there are no files of features.
pub fn features_section(all: &[SeenFeatures], folder: &Path) -> String {
    if all.is_empty() {
        return String::new();
    }
    let mut text = "\n# Roads, rivers and lakes; `tiefort plan` lists the table of their kinds.\n".to_owned();
    let is_used = |seen: &SeenFeatures| 0 < seen.seen.found;
    // A list without entries is no list of sources.
    let sign = if all.iter().any(is_used) { "" } else { "# " };
    text += &format!("{sign}[features]\n{sign}sources = [\n");
    for seen in all {
        let mut keys = vec![format!("file = {}", quoted(&relative(&seen.path, folder)))];
        keys.extend(seen.layer.as_ref().map(|layer| format!("layer = {}", quoted(layer))));
        keys.extend(seen.kind_by_name.map(|kind| format!("kind = {}", quoted(kind))));
        let wants_kind = has_no_kind(seen);
        let entry = match keys.len() {
            1 if !wants_kind => quoted(&relative(&seen.path, folder)),
            _ => format!("{{ {} }}", keys.join(", ")),
        };
        let sign = if is_used(seen) { "" } else { "# " };
        let kind = if wants_kind { "  # kind = \"…\"" } else { "" };
        text += &format!("{}    {sign}{entry},{kind}\n", comment(&found_of(seen)));
    }
    text + &format!(
        "{sign}]\n{sign}share_max = {}  # of a load module's limit that they may take\n",
        usual("share_max")
    )
}

fn usual(key: &str) -> &'static str {
    job::usual_text(&format!("features.{key}"))
}
