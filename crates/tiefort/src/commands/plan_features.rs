//! The features of a job as `plan` tells them: the table of kinds that results, what of each file lies in the area, and
//! what they are forecast to cost.

use build::FeaturesForeseen;
use build::ground::{FeatureTable, SourceSeen};
use job::Job;
use serde_json::{Value, json};
use store::ReportFeatureCost;
use views::{Align, Table, grouped};

/// What goes before the widths of the table.
const WIDTHS: &str = "Tags of width and lanes go before these widths, but not before those of rules.";

/// What the forecast stands on.
const FORECAST: &str = "Counted on level ground, before heights are known and anything is degraded: slopes bring \
                        strips and more stations, and what costs more than its share is made coarser or left out.";

/// All tables.
pub fn tables_text(features: &FeaturesForeseen, job: &Job) -> String {
    let buildings = features.buildings.map_or_else(String::new, |count| format!("\n{}", buildings_text(count)));
    format!("{}\n{}{buildings}", kinds_text(&features.table), forecast_text(features, job))
}

fn buildings_text(count: usize) -> String {
    format!(
        "Buildings: {}, kept beside the ground to be drawn; they cost no triangle. features.buildings = false \
         leaves them out.\n",
        grouped(count as u64)
    )
}

fn forecast_text(features: &FeaturesForeseen, job: &Job) -> String {
    let FeaturesForeseen { cost, crowded, over_share, within_share, .. } = features;
    if crowded.is_empty() {
        return "Forecast of features: none of them costs a triangle.\n".to_owned();
    }
    let mut table = Table::new(&[Align::Left, Align::Right, Align::Right, Align::Right]);
    let window = job.limits.window;
    let square = format!("{} x {} of them", window.rows, window.cols);
    table.row(["Forecast of features", "triangles", "a load module", &square]);
    let classes = cost.classes.iter().map(|class| (class.name.as_str(), &class.cost)).chain([("all", &cost.all)]);
    for (name, cost) in classes {
        let most = |count: u64, share: f64| format!("{} ({:.0} %)", grouped(count), 100.0 * share);
        let [module, window] = [most(cost.module_max, cost.module_share), most(cost.window_max, cost.window_share)];
        table.row([name.to_owned(), grouped(cost.triangles), module, window]);
    }
    let crowded: Vec<String> = crowded
        .iter()
        .map(|(id, triangles)| format!("{},{} ({})", id.row, id.col, grouped(u64::from(*triangles))))
        .collect();
    let share = job.features.as_ref().map_or(1.0, |spec| spec.share_max);
    let over = match over_share {
        0 => format!("None asks for more than share_max = {share} of its limit"),
        1 => format!(
            "1 asks for more than share_max = {share} of its limit; at most {} triangles are left",
            grouped(*within_share)
        ),
        count => format!(
            "{} ask for more than share_max = {share} of their limit; at most {} triangles are left",
            grouped(*count as u64),
            grouped(*within_share)
        ),
    };
    format!("{}The most crowded load modules: {}. {over}.\n{FORECAST}\n", table.text(0), crowded.join(", "))
}

fn kinds_text(features: &FeatureTable) -> String {
    let mut sources = Table::new(&[Align::Left, Align::Right, Align::Right, Align::Right, Align::Right]);
    sources.row(["Features of", "found", "outside", "of no kind", "remarks"]);
    for SourceSeen { read, without_kind } in &features.sources {
        let counts = [read.found, read.outside, *without_kind, read.remarks as u64].map(grouped);
        sources.row([read.name.clone()].into_iter().chain(counts));
    }
    let left = [Align::Left, Align::Left, Align::Right, Align::Left, Align::Left, Align::Left, Align::Left];
    let mut rows = Table::new(&left);
    rows.row(["Kind", "class", "features", "width", "grade", "form", "from"]);
    for row in &features.rows {
        let count = grouped(row.count as u64);
        rows.row([&row.kind, &row.class, &count, &row.width, &row.grade, &row.form, &row.from].map(String::as_str));
    }
    format!("{}\n{}{WIDTHS}\n", sources.text(0), rows.text(0))
}

/// The same for a program.
pub fn tables_json(foreseen: &FeaturesForeseen) -> Value {
    let FeaturesForeseen { table: features, cost, crowded, over_share, within_share, buildings } = foreseen;
    let sources: Vec<Value> = features
        .sources
        .iter()
        .map(|SourceSeen { read, without_kind }| {
            json!({ "name": read.name, "found": read.found, "outside": read.outside,
                    "without_kind": without_kind, "remarks": read.remarks })
        })
        .collect();
    let rows: Vec<Value> = features
        .rows
        .iter()
        .map(|row| {
            json!({ "kind": row.kind, "class": row.class, "features": row.count, "width": row.width,
                    "grade": row.grade, "form": row.form, "from": row.from })
        })
        .collect();
    let cost_json = |name: &str, cost: &ReportFeatureCost| {
        let ReportFeatureCost { triangles, module_max, module_share, window_max, window_share } = *cost;
        json!({ "class": name, "triangles": triangles, "module_max": module_max, "module_share": module_share,
                "window_max": window_max, "window_share": window_share })
    };
    let classes: Vec<Value> = cost.classes.iter().map(|class| cost_json(&class.name, &class.cost)).collect();
    let crowded: Vec<Value> =
        crowded.iter().map(|(id, triangles)| json!({ "module": [id.row, id.col], "triangles": triangles })).collect();
    let forecast = json!({ "classes": classes, "all": cost_json("all", &cost.all), "crowded": crowded,
                           "modules_over_share": over_share, "triangles_within_share": within_share });
    json!({ "sources": sources, "rows": rows, "notes": features.notes, "forecast": forecast,
            "buildings": buildings })
}
