//! The settings of `[features]`: as TOML, and with what they mean.

use features::{Clearances, FallOptions, GradeOptions, Rule, RuleKind};
use terrain::metres_of_quanta;

use crate::setting_list::{List, counted, number, quoted};
use crate::{Choice, FeatureSource, FeaturesSpec};

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
