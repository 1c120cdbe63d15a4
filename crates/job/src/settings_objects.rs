//! The settings of `[objects]`: as TOML, and with what they mean.

use features::objects::ObjectRule;

use crate::setting_list::{List, counted, number, quoted};
use crate::settings_features::tags_text;
use crate::{Choice, ObjectSource, ObjectsSpec, usual_text};

/// Adds the settings of `[objects]`.
pub(crate) fn describe(objects: &ObjectsSpec, list: &mut List) {
    let sources: Vec<String> = objects.sources.iter().map(source_text).collect();
    list.add_with("objects.sources", format!("[{}]", sources.join(", ")), counted(sources.len(), "source"));
    if !objects.rules.is_empty() {
        let rules: Vec<String> = objects.rules.iter().map(rule_text).collect();
        list.add_with("objects.rules", format!("[{}]", rules.join(", ")), counted(rules.len(), "rule"));
    }
    list.add("objects.corners_max", objects.options.corners_max.to_string());
    list.add("objects.area_min_m2", number(objects.options.area_min_m2));
    list.add("objects.limits.per_load_module", objects.per_load_module.to_string());
    list.add("objects.limits.per_4km_square", objects.per_4km_square.to_string());
    if objects.joint {
        list.add_with("objects.limits.joint", "true".to_owned(), "they count in [limits], too".to_owned());
    }
}

fn source_text(source: &ObjectSource) -> String {
    let ObjectSource { file, layer, kind, height, crs, least_m, cell_m } = source;
    let mut keys = vec![format!("file = {}", quoted(&file.written))];
    keys.extend(layer.as_ref().map(|layer| format!("layer = {}", quoted(layer))));
    keys.extend(kind.map(|kind| format!("kind = {}", quoted(Choice::name(&kind)))));
    keys.extend(height.as_ref().map(|height| format!("height = {}", quoted(height))));
    keys.extend(crs.as_ref().map(|crs| format!("crs = {}", quoted(crs))));
    for (key, text) in [("least_m", number(*least_m)), ("cell_m", number(*cell_m))] {
        keys.extend((text != usual_text(&format!("objects.sources[].{key}"))).then(|| format!("{key} = {text}")));
    }
    if keys.len() == 1 { quoted(&file.written) } else { format!("{{ {} }}", keys.join(", ")) }
}

fn rule_text(rule: &ObjectRule) -> String {
    let mut keys = vec![format!("where = {}", tags_text(&rule.tags))];
    keys.extend(rule.kind.map(|kind| format!("kind = {}", quoted(kind.map_or("none", |kind| Choice::name(&kind))))));
    keys.extend(rule.height_m.map(|height_m| format!("height_m = {}", number(height_m))));
    format!("{{ {} }}", keys.join(", "))
}
