//! The settings of `[features]` and `[objects]`: as TOML, and with what they mean.

use features::objects::ObjectRule;
use features::{Clearances, FallOptions, GradeOptions, Rule, RuleKind};
use terrain::metres_of_quanta;

use crate::setting_list::{List, counted, number, quoted};
use crate::{Choice, FeatureSource, FeaturesSpec, ObjectSource, ObjectsSpec, usual_text};

pub(crate) fn describe(features: &FeaturesSpec, list: &mut List) {
    let sources: Vec<String> = features.sources.iter().map(source_text).collect();
    let text = format!("[{}]", sources.join(", "));
    list.add_with("features.sources", text, counted(sources.len(), "source"));
    if !features.rules.is_empty() {
        let rules: Vec<String> = features.rules.iter().map(rule_text).collect();
        list.add_with("features.rules", format!("[{}]", rules.join(", ")), counted(rules.len(), "rule"));
    }
    list.add("features.buildings", features.buildings.to_string());
    list.add("features.share_main", number(features.share_main));
    list.add("features.share_max", number(features.share_max));
    list.add("features.left_out_weight", number(features.left_out_weight));
    let GradeOptions { clearances, bank, cut_max, fill_max, clip, smooth_milliposts } = features.options;
    let Clearances { road, rail, water } = clearances;
    let lengths = [
        ("features.clearance_road_m", road),
        ("features.clearance_rail_m", rail),
        ("features.clearance_water_m", water),
        ("features.bank_m", bank),
        ("features.cut_max_m", cut_max),
        ("features.fill_max_m", fill_max),
        ("features.clip_m", clip),
    ];
    lengths.into_iter().for_each(|(key, quanta)| list.add(key, number(metres_of_quanta(quanta))));
    list.add("features.grade_give", number(features.grade_give));
    let FallOptions { tau, carve_max, tilt, cut_max: _, fill_max: _ } = features.falls;
    list.add("features.river_tau", number(f64::from(tau) / 1000.0));
    list.add("features.carve_max_m", number(metres_of_quanta(carve_max)));
    list.add("features.river_tilt", tilt.to_string());
    let smooth_posts = smooth_milliposts.map(|thousandths| number(f64::from(thousandths) / 1000.0));
    smooth_posts.into_iter().for_each(|posts| list.add("features.smooth_posts", posts));
}

fn source_text(source: &FeatureSource) -> String {
    let FeatureSource::File { file, layer, kind, crs } = source else { return quoted("sample") };
    let mut keys = vec![format!("file = {}", quoted(&file.written))];
    keys.extend(layer.as_ref().map(|layer| format!("layer = {}", quoted(layer))));
    keys.extend(kind.map(|kind| format!("kind = {}", quoted(Choice::name(&kind)))));
    keys.extend(crs.as_ref().map(|crs| format!("crs = {}", quoted(crs))));
    // A file that is called as the built-in terrain's features are needs its table.
    match keys.len() == 1 && file.written != "sample" {
        true => quoted(&file.written),
        false => format!("{{ {} }}", keys.join(", ")),
    }
}

fn rule_text(rule: &Rule) -> String {
    let mut keys = vec![format!("where = {}", tags_text(&rule.tags))];
    if rule.kind != RuleKind::AsBuiltIn {
        keys.push(format!("kind = {}", quoted(rule.kind.name())));
    }
    keys.extend(rule.class.as_ref().map(|class| format!("class = {}", quoted(class))));
    keys.extend(rule.width_m.map(|width_m| format!("width_m = {}", number(width_m))));
    keys.extend(rule.grade_max_percent.map(|percent| format!("grade_max_percent = {}", number(percent))));
    keys.extend(rule.grade_give.map(|give| format!("grade_give = {}", number(give))));
    keys.extend(rule.form.map(|form| format!("form = {}", quoted(form.name()))));
    if rule.pins {
        keys.push("z = \"feature\"".to_owned());
    }
    format!("{{ {} }}", keys.join(", "))
}

pub(crate) fn tags_text(tags: &[(String, Vec<String>)]) -> String {
    let tag = |(key, values): &(String, Vec<String>)| {
        let values: Vec<String> = values.iter().map(|value| quoted(value)).collect();
        format!("{} = [{}]", quoted(key), values.join(", "))
    };
    match tags.is_empty() {
        true => "{}".to_owned(),
        false => format!("{{ {} }}", tags.iter().map(tag).collect::<Vec<_>>().join(", ")),
    }
}

/// Adds the settings of `[objects]`.
pub(crate) fn describe_objects(objects: &ObjectsSpec, list: &mut List) {
    let sources: Vec<String> = objects.sources.iter().map(object_source_text).collect();
    list.add_with("objects.sources", format!("[{}]", sources.join(", ")), counted(sources.len(), "source"));
    if !objects.rules.is_empty() {
        let rules: Vec<String> = objects.rules.iter().map(object_rule_text).collect();
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

fn object_source_text(source: &ObjectSource) -> String {
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

fn object_rule_text(rule: &ObjectRule) -> String {
    let mut keys = vec![format!("where = {}", tags_text(&rule.tags))];
    keys.extend(rule.kind.map(|kind| format!("kind = {}", quoted(kind.map_or("none", |kind| Choice::name(&kind))))));
    keys.extend(rule.height_m.map(|height_m| format!("height_m = {}", number(height_m))));
    format!("{{ {} }}", keys.join(", "))
}
