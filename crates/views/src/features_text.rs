//! Roads and water of a report in words: a table of what they cost, and what must hold of them.

use store::{
    ReportEarthwork, ReportEarthworks, ReportFeatureChecks, ReportFeatureClass, ReportFeatureCost, ReportFeatures,
};

use crate::table::{Align, Table, grouped};

use Align::{Left, Right};

/// The block of the text report.
pub(crate) fn features_text(features: &ReportFeatures) -> String {
    let mut table = Table::new(&[Left, Right, Right, Right, Right, Right, Right, Right, Right]);
    table.row(["Roads, water", "km", "of", "kept", "strips", "lakes", "triangles", "module", "4 km"]);
    for class in &features.classes {
        let name = format!("  {}", class.name);
        table.row([name].into_iter().chain(amounts(class)).chain(cost(&class.cost)));
    }
    let nothing = [const { String::new() }; 5];
    table.row(["  all".to_owned()].into_iter().chain(nothing).chain(cost(&features.all)));
    let mut checks = Table::new(&[Left, Left]);
    for (what, found) in check_rows(&features.checks) {
        checks.row([what, &found]);
    }
    let clearances = clearances_in_words(features).map(|words| format!("  {words}\n")).unwrap_or_default();
    format!(
        "{}  {}\n{}{clearances}{}",
        table.text(0),
        remarks_in_words(features),
        checks.text(2),
        earthworks_text(&features.earthworks)
    )
}

/// Cut and fill: a table by class, and the worst places; nothing where no class is in the ground.
fn earthworks_text(works: &ReportEarthworks) -> String {
    if works.classes.is_empty() {
        return String::new();
    }
    let mut table = Table::new(&[Left, Right, Right, Right, Right, Right, Right, Right, Right]);
    table.row(["Cut and fill", "km", "% >3 m", ">5", ">10", ">20", "limit", "cut m3/km", "fill"]);
    for class in &works.classes {
        table.row([format!("  {}", class.name)].into_iter().chain(earthwork(class)));
    }
    let mut worst = Table::new(&[Left, Left]);
    for far in &works.worst {
        worst.row(["off the ground", &far_off_in_words(&far.feature, far.at_m, far.off_m, &far.cause)]);
    }
    format!("{}{}", table.text(0), worst.text(2))
}

/// Kilometres of a class, those of them that lie far off the ground in per cent, and cubic metres for each kilometre.
pub(crate) fn earthwork(class: &ReportEarthwork) -> [String; 8] {
    let percent = |km: f64| {
        if 0.0 < km { format!("{:.2}", 100.0 * km / class.length_km) } else { "-".into() }
    };
    let cubic = |metres: f64| grouped(metres.round() as u64);
    [
        format!("{:.2}", class.length_km),
        percent(class.off_3m_km),
        percent(class.off_5m_km),
        percent(class.off_10m_km),
        percent(class.off_20m_km),
        percent(class.over_limit_km),
        cubic(class.cut_m3_per_km),
        cubic(class.fill_m3_per_km),
    ]
}

/// How far a feature lies off the ground, where, and why.
pub fn far_off_in_words(feature: &str, [east, north]: [f64; 2], off_m: f64, cause: &str) -> String {
    let what = if off_m < 0.0 { "cut" } else { "fill" };
    format!("{feature}: {what} of {:.1} m at {east:.0} {north:.0}, {cause}", off_m.abs())
}

/// Kilometres in the ground, of how many, that in per cent, those of strips among them, and lakes of a class; nothing
/// where it has none.
pub(crate) fn amounts(class: &ReportFeatureClass) -> [String; 5] {
    let km = |km: f64| if 0.0 < km { format!("{km:.2}") } else { String::new() };
    let lakes = match (class.lakes, class.lakes_wanted) {
        (0, 0) => String::new(),
        (lakes, _) => grouped(lakes),
    };
    let kept = kept(class).map(|kept| format!("{:.1} %", 100.0 * kept)).unwrap_or_default();
    let in_ground = if 0.0 < class.wanted_km { format!("{:.2}", class.kept_km) } else { String::new() };
    [in_ground, km(class.wanted_km), kept, km(class.strip_km), lakes]
}

/// The share of the kilometres of a class that are in the ground, or of its lakes of a hectare and more.
pub(crate) fn kept(class: &ReportFeatureClass) -> Option<f64> {
    if 0.0 < class.wanted_km {
        Some(class.kept_km / class.wanted_km)
    } else {
        (0 < class.lakes_wanted).then(|| class.lakes_kept as f64 / class.lakes_wanted as f64)
    }
}

/// The least share of a class above tracks that is well kept.
const KEPT_WELL: f64 = 0.95;

/// Classes that are less to a reader where less of them is in the ground.
const SMALL: [&str; 2] = ["track", "stream"];

/// Whether too little of a class is in the ground.
pub(crate) fn is_thin(class: &ReportFeatureClass) -> bool {
    !SMALL.contains(&class.name.as_str()) && kept(class).is_some_and(|kept| kept < KEPT_WELL)
}

/// Triangles, and the most of a limit that they take.
pub(crate) fn cost(cost: &ReportFeatureCost) -> [String; 3] {
    let share = |share: f64| format!("{:.0} %", 100.0 * share);
    [grouped(cost.triangles), share(cost.module_share), share(cost.window_share)]
}

/// How many were mended, degraded and left out.
pub fn remarks_in_words(features: &ReportFeatures) -> String {
    let remarks = &features.remarks;
    let (mended, degraded, out) = (grouped(remarks.mended), grouped(remarks.degraded), grouped(remarks.left_out));
    if remarks.mended + remarks.degraded + remarks.left_out == 0 {
        return "nothing was mended, degraded or left out".into();
    }
    format!("{mended} mended, {degraded} degraded, {out} left out; see features.geojson")
}

/// What must hold, and what was found.
pub(crate) fn check_rows(checks: &ReportFeatureChecks) -> Vec<(&'static str, String)> {
    let of = |count: u64, all: u64| format!("{} of {}", grouped(count), grouped(all));
    vec![
        ("edges missing from the TIN", of(checks.edges_missing, checks.edges)),
        ("pieces of roads too steep", of(checks.stations_steeper, checks.stations)),
        ("largest fall across a strip", format!("{:.3} m", checks.strip_fall_max_m)),
        ("edges of rivers that rise", of(checks.river_edges_rising, checks.river_edges)),
        ("ends where the source goes on", grouped(checks.loose_ends)),
        ("lakes are level to within", format!("{:.3} m", checks.lake_spread_max_m)),
        ("banks of roads inside shores", format!("{} m2", grouped(checks.lake_banks_m2))),
        ("posts of shores below water", of(checks.shore_posts_below, checks.shore_posts)),
        ("square metres of decks under ground", under_ground(checks)),
        ("highest step onto a deck", format!("{:.2} m", checks.deck_step_max_m)),
        ("steepest deck", format!("{:.0} %", checks.deck_slope_max_percent)),
        ("ends of bridges in the air", hanging(checks)),
        ("metres of roads inside buildings", grouped(checks.roads_in_buildings_m)),
        (
            "residual outside features",
            format!("RMS {:.3} m, largest {:.2} m", checks.outside_rms_m, checks.outside_max_m),
        ),
    ]
}

fn hanging(checks: &ReportFeatureChecks) -> String {
    match checks.deck_ends_hanging {
        0 => "0".into(),
        ends => format!("{}, by {:.2} m at most", grouped(ends), checks.deck_end_hangs_max_m),
    }
}

fn under_ground(checks: &ReportFeatureChecks) -> String {
    let of = format!("{} of {}", grouped(checks.deck_samples_under), grouped(checks.deck_samples));
    let deepest = format!(", by {:.2} m at most", checks.deck_under_max_m);
    if checks.deck_samples_under == 0 { of } else { of + &deepest }
}

/// How low decks pass over each class of ways or water, in words; nothing without decks.
pub(crate) fn clearances_in_words(features: &ReportFeatures) -> Option<String> {
    let least = features.deck_clearances.iter().map(|over| format!("{} {:.2} m", over.class, over.least_m));
    let least: Vec<String> = least.collect();
    (!least.is_empty()).then(|| format!("least height of decks over {}", least.join(", ")))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::samples;
    use crate::table::COLUMNS_MAX;

    #[test]
    fn roads_and_water_are_told_in_lines_no_wider_than_a_terminal() {
        let text = features_text(&samples::features());
        for expected in ["primary", "12.25", "4 of 1,234", "3 mended, 2 degraded, 1 left out", "RMS 1.250 m"] {
            assert!(text.contains(expected), "{text}");
        }
        assert!(text.lines().all(|line| line.chars().count() <= COLUMNS_MAX), "{text}");
    }

    #[test]
    fn without_remarks_it_says_so() {
        assert!(features_text(&ReportFeatures::default()).contains("nothing was mended, degraded or left out"));
    }
}
