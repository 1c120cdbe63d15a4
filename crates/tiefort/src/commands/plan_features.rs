//! The features of a job as `plan` tells them: the table of kinds that results, and what of each file lies in the area.

use ground::FeatureTable;
use serde_json::{Value, json};
use views::{Align, Table, grouped};

/// What goes before the widths of the table.
const WIDTHS: &str = "Tags of width and lanes go before these widths, but not before those of rules.";

/// The two tables.
pub fn tables_text(features: &FeatureTable) -> String {
    let mut sources = Table::new(&[Align::Left, Align::Right, Align::Right, Align::Right, Align::Right]);
    sources.row(["Features of", "found", "outside", "of no kind", "remarks"]);
    for seen in &features.sources {
        let counts = [seen.found, seen.outside, seen.without_kind, seen.remarks as u64].map(grouped);
        sources.row([seen.name.clone()].into_iter().chain(counts));
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
pub fn tables_json(features: &FeatureTable) -> Value {
    let sources: Vec<Value> = features
        .sources
        .iter()
        .map(|seen| {
            json!({ "name": seen.name, "found": seen.found, "outside": seen.outside,
                    "without_kind": seen.without_kind, "remarks": seen.remarks })
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
    json!({ "sources": sources, "rows": rows, "notes": features.notes })
}
