//! Roads and water of a report, what must hold of them, what they move; and buildings, walls and woods.

use store::{
    ReportEarthwork, ReportEarthworks, ReportFeatureChecks, ReportFeatureClass, ReportFeatureCost, ReportFeatures,
    ReportObjectLimit, ReportObjects,
};

use crate::section::Section;
use crate::table::{Cell, Table, decimals, grouped, percent};

/// What roads and water cost, and what must hold of them.
pub(super) fn features(features: &ReportFeatures) -> Vec<Section> {
    let mut table = Table::default().words(["Roads, water"]);
    table = table.figures(["km", "of", "kept", "strips", "lakes", "triangles", "module", "4 km"]);
    for class in &features.classes {
        let name = class.name.clone();
        let name = if is_thin(class) { Cell::Thin(name) } else { name.into() };
        table.add([name], amounts(class).into_iter().chain(cost(&class.cost)));
    }
    table.add(["all", "", "", "", "", ""], cost(&features.all));
    let notes = vec![format!("Remarks: {}.", remarks_in_words(features))];
    let explained = "Kilometres in the ground, of how many; of them strips; the most that a class takes of the limit \
                     of a load module, and of that of a 4 km square.";
    let mut sections = vec![Section { table, notes, explained: vec![explained.into()], ..Section::default() }];
    sections.push(checks(features));
    sections.extend(earthworks(&features.earthworks).into_iter().filter(|section| !section.table.is_empty()));
    sections
}

fn checks(features: &ReportFeatures) -> Section {
    let mut table = Table::default().words(["What must hold", "found"]);
    check_rows(&features.checks).into_iter().for_each(|(what, found)| table.row([what, &found]));
    let least = features.deck_clearances.iter().map(|over| format!("{} {:.2} m", over.class, over.least_m));
    let least = least.collect::<Vec<_>>().join(", ");
    let notes = (!least.is_empty()).then(|| format!("Least height of decks over {least}."));
    Section { table, notes: Vec::from_iter(notes), ..Section::default() }
}

/// What roads, rivers and lakes move, and where they lie farthest off the ground; nothing where no class is in it.
fn earthworks(works: &ReportEarthworks) -> [Section; 2] {
    let mut table = Table::default().words(["Cut and fill"]);
    table = table.figures(["km", "% >3 m", ">5", ">10", ">20", "limit", "cut m3/km", "fill"]);
    works.classes.iter().for_each(|class| table.add([&class.name], earthwork(class)));
    let mut worst = Table::default().words(["Farthest off the ground", "class"]).figures(["east", "north", "m above"]);
    worst = worst.words(["because of"]);
    for far in &works.worst {
        let [east, north, off] = decimals([(far.at_m[0], 0), (far.at_m[1], 0), (far.off_m, 1)]);
        worst.row([far.feature.clone(), far.class.clone(), east, north, off, far.cause.clone()]);
    }
    let explained = "Per cent of the kilometres that lie farther off the ground, or farther than their limit; cubic \
                     metres for each kilometre.";
    let all = Section { table, explained: vec![explained.into()], ..Section::default() };
    [all, Section { table: worst, ..Section::default() }]
}

/// How much of what stands on the ground has room: in number, and in square metres of silhouette.
pub(super) fn objects(objects: &ReportObjects) -> Section {
    let mut table = Table::default().words(["Objects"]).figures(["kept", "of", "m2 seen", "of", "%"]);
    for sums in &objects.kinds {
        let [kept_m2, wanted_m2] = [sums.kept_m2, sums.wanted_m2].map(|square| grouped(square.round() as u64));
        let share = percent(sums.kept_m2, sums.wanted_m2, 1);
        table.row([sums.kind.clone(), grouped(sums.kept), grouped(sums.wanted), kept_m2, wanted_m2, share]);
    }
    let most = |found: ReportObjectLimit| format!("{} of {}", grouped(found.max), grouped(found.limit));
    let notes = vec![
        format!(
            "{} roofs, walls and triangles of woods; {} in one load module at most, {} in 4 km.",
            grouped(objects.polygons),
            most(objects.per_load_module),
            most(objects.per_4km)
        ),
        format!(
            "{} had no room, {} remarks; see objects.geojson.",
            grouped(objects.left_out),
            grouped(objects.remarks)
        ),
    ];
    Section { table, notes, ..Section::default() }
}

/// Kilometres of a class, those of them that lie far off the ground in per cent, and cubic metres for each kilometre.
fn earthwork(class: &ReportEarthwork) -> [String; 8] {
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

/// Kilometres in the ground, of how many, that in per cent, those of strips among them, and lakes of a class; nothing
/// where it has none.
fn amounts(class: &ReportFeatureClass) -> [String; 5] {
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
fn cost(cost: &ReportFeatureCost) -> [String; 3] {
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
fn check_rows(checks: &ReportFeatureChecks) -> Vec<(&'static str, String)> {
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::samples;
    use crate::table::COLUMNS_MAX;
    use store::ObjectSums;

    fn text(of: &ReportFeatures) -> String {
        features(of).iter().map(Section::text).collect()
    }

    #[test]
    fn roads_and_water_are_told_in_lines_no_wider_than_a_terminal() {
        let text = text(&samples::features());
        for expected in ["primary", "12.25", "4 of 1,234", "3 mended, 2 degraded, 1 left out", "RMS 1.250 m"] {
            assert!(text.contains(expected), "{text}");
        }
        assert!(text.lines().all(|line| line.chars().count() <= COLUMNS_MAX), "{text}");
    }

    #[test]
    fn without_remarks_it_says_so() {
        assert!(text(&ReportFeatures::default()).contains("nothing was mended, degraded or left out"));
    }

    #[test]
    fn what_is_kept_of_what_was_wanted_is_told_by_kind() {
        let sums =
            ObjectSums { kind: "building".into(), wanted: 1_200, kept: 1_150, wanted_m2: 90_000.4, kept_m2: 88_000.0 };
        let limit = ReportObjectLimit { max: 390, limit: 400 };
        let found = ReportObjects {
            kinds: vec![sums],
            polygons: 6_000,
            per_load_module: limit,
            per_4km: limit,
            left_out: 50,
            remarks: 3,
        };
        let text = objects(&found).text();
        assert!(text.contains("building  1,150  1,200   88,000  90,000  97.8"), "{text}");
        assert!(text.contains("390 of 400 in one load module"), "{text}");
        assert!(text.contains("50 had no room, 3 remarks"), "{text}");
    }
}
