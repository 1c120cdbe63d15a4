//! `tiefort explain`: one load module, and why it is as it is.

use std::path::PathBuf;

use clap::Args;
use inspect::{ExplainedFeatures, ExplainedObjects, Explanation, explain};
use serde_json::{Value, json};
use store::{FeatureFarOff, FeatureLeftOut, FeatureRemark, FeatureWhy, ObjectLeftOut, ReportPlace};
use terrain::{ModuleId, RefusedBy, StopReason, TileId};
use views::{Align, Table, fold, grouped};

use crate::arguments::{Against, Format, Workers, row_col};
use crate::failure::{Failure, Outcome};

const AFTER_HELP: &str = "\
Examples:
  tiefort explain ntc.tdb 42,17
  tiefort explain ntc.tdb 42,17 --format json | jq .one_more

A point adds two triangles. What one more would buy is the best split of one
triangle at one post, its height chosen for the least squared residuals; nothing
else moves. An area of more than 16,384 load modules is not read whole: 1,024 of
them, drawn evenly, are compared with.

Exit codes: 0 explained; 2 no such load module, or no database to read.";

/// Arguments of `explain`.
#[derive(Args)]
#[command(after_help = AFTER_HELP)]
pub struct Arguments {
    /// Folder of the terrain database
    #[arg(value_name = "DIR")]
    database: PathBuf,
    /// Row and column of the load module, from the south-west
    #[arg(value_name = "ROW,COL", value_parser = row_col)]
    module: TileId,
    /// For a person or a program
    #[arg(long, value_enum, default_value_t = Format::Text)]
    format: Format,
    #[command(flatten)]
    against: Against,
    #[command(flatten)]
    workers: Workers,
}

/// Explains.
pub fn run(arguments: &Arguments) -> Result<Outcome, Failure> {
    let module = ModuleId { row: arguments.module.row, col: arguments.module.col };
    let found = explain(&arguments.database, module, arguments.against.ground(), arguments.workers.count())?;
    arguments.format.print(|| text(&found), || to_json(&found))?;
    Ok(Outcome::Sound)
}

fn text(found: &Explanation) -> String {
    let [west, south, east, north] = found.extent_m;
    let mut text = format!("Load module {}: east {west} to {east}, north {south} to {north}\n\n", found.module);
    text += &counts(found).text(2);
    text += "\n";
    if let Some(features) = &found.features {
        text += &features_text(features);
        text += "\n";
    }
    if let Some(objects) = &found.objects {
        text += &objects_text(objects);
        text += "\n";
    }
    text += &refused_text(found);
    text += "\n";
    text += &one_more_text(found);
    fold(&text, 2)
}

fn counts(found: &Explanation) -> Table {
    let mut table = Table::new(&[Align::Left, Align::Right, Align::Left]);
    let percent = |count: u32, limit: u32| format!("{:.0} %", 100.0 * f64::from(count) / f64::from(limit));
    let (count, limit) = found.count;
    let granted = if found.granted == 0 { String::new() } else { format!(", {} more from the pool", found.granted) };
    let of_limit = format!("{} of the limit of {limit}{granted}", percent(count, limit));
    table.row([found.count_of.as_str(), &grouped(u64::from(count)), &of_limit]);
    if found.count_of == "triangles" && found.polygons != found.triangles {
        table.row(["polygons", &grouped(u64::from(found.polygons)), "before they were cut into triangles"]);
    }
    let [s, e, n, w] = found.vertices_on_sides;
    let inside = format!("inside; {s}, {e}, {n}, {w} on the southern, eastern, northern and western side");
    table.row(["vertices", &grouped(u64::from(found.vertices_inside)), &inside]);
    let window = found.window;
    let around = format!(
        "{} of the limit of {}, in the fullest window around, {} x {} from {}",
        percent(window.count, window.limit),
        grouped(u64::from(window.limit)),
        window.size[0],
        window.size[1],
        window.origin
    );
    table.row(["window", &grouped(u64::from(window.count)), &around]);
    let [rms_m, mean_m, largest_m] = found.residual_m;
    let place = match share_before(found, found.place.0) {
        Some(share) => format!("{share} have a larger one"),
        None => format!("{} of {} from the worst", grouped(found.place.0 as u64), grouped(found.place.1 as u64)),
    };
    let residual = format!("RMS, mean {mean_m:.2} m, largest {largest_m:.2} m; {place}");
    table.row(["residual", &format!("{rms_m:.3} m"), &residual]);
    let (tile, state, stop) = found.tile;
    let allowed = found.tile_triangles.1.map_or(String::new(), |allowed| format!(" of {} allowed", grouped(allowed)));
    let state = format!("{state:?}").to_lowercase();
    // Points of clipped edges are charged no triangles: those are counted after the cut.
    let charged = match found.tile_triangles.0 {
        0 => String::new(),
        charged => format!(", charged {} triangles{allowed}", grouped(u64::from(charged))),
    };
    table.row(["tile", &tile.to_string(), &format!("{state}{charged}; stopped: {}", stop_text(stop))]);
    for (level, (triangles, rms_m, largest_m)) in found.levels.iter().enumerate().skip(1) {
        let figures = format!("triangles, RMS residual {rms_m:.3} m, largest {largest_m:.2} m");
        table.row([format!("level {level}"), grouped(u64::from(*triangles)), figures]);
    }
    for (class, count) in &found.classes {
        table.row(["class", &grouped(u64::from(*count)), &format!("triangles on {class}")]);
    }
    table
}

/// Remarks that a text lists; the JSON has them all.
const REMARKS_MAX: usize = 10;

/// Whole cubic metres.
fn cubic(metres: f64) -> String {
    grouped(metres.round() as u64)
}

fn features_text(features: &ExplainedFeatures) -> String {
    let percent = |share: f64| format!("{:.0} %", 100.0 * share);
    let mut text = match features.cost.iter().map(|(_, triangles)| triangles).sum::<u32>() {
        0 => "No roads or water.\n".to_owned(),
        all => format!(
            "Roads and water take {all} triangles, {} of the limit; they may take {}, and {} where others than main \
             roads, rails, rivers and lakes go in:\n",
            percent(features.share),
            percent(features.share_max),
            percent(features.share_others)
        ),
    };
    let mut table = Table::new(&[Align::Left, Align::Right, Align::Left]);
    for (class, triangles) in &features.cost {
        table.row([class, &grouped(u64::from(*triangles)), "triangles"]);
    }
    for (class, [cut, fill]) in &features.moved_m3 {
        table.row([class, "", &format!("{} m3 cut, {} m3 filled", cubic(*cut), cubic(*fill))]);
    }
    for far in features.far_off.iter().take(REMARKS_MAX) {
        let ([east, north], off_m) = (far.at_m, far.off_m.abs());
        let what = if far.off_m < 0.0 { "cut" } else { "fill" };
        let (feature, cause) = (&far.feature, far.cause.name());
        table.row([
            "off the ground",
            "",
            &format!("{feature}: {what} of {off_m:.1} m at {east:.0} {north:.0}, {cause}"),
        ]);
    }
    for remark in features.remarks.iter().take(REMARKS_MAX) {
        let FeatureRemark { feature, found, done, .. } = remark;
        table.row(["remark", "", &format!("{feature}: {found}; {done}")]);
    }
    text += &table.text(2);
    let more = features.remarks.len().saturating_sub(REMARKS_MAX);
    if 0 < more {
        text += &format!("  and {} more in features.geojson\n", grouped(more as u64));
    }
    for left in features.left_out.iter().take(REMARKS_MAX) {
        text += &format!("  left out: {}, {:.0} m: {}\n", left.feature, left.length_m, why_text(left.why));
    }
    let more = features.left_out.len().saturating_sub(REMARKS_MAX);
    if 0 < more {
        text += &format!("  and {} more: --format json\n", grouped(more as u64));
    }
    text
}

fn objects_text(objects: &ExplainedObjects) -> String {
    let all: u64 = objects.kinds.iter().map(|(_, [_, polygons])| polygons).sum();
    let limit = grouped(objects.limit.into());
    let mut text = match all {
        0 => "No building and no wood.\n".to_owned(),
        _ => format!("Buildings and woods count {} polygons; the limit is {limit}:\n", grouped(all)),
    };
    let mut table = Table::new(&[Align::Left, Align::Right, Align::Left]);
    for (kind, [count, polygons]) in &objects.kinds {
        table.row([*kind, &grouped(*count), &format!("with {} roofs, walls and triangles", grouped(*polygons))]);
    }
    for remark in objects.remarks.iter().take(REMARKS_MAX) {
        let FeatureRemark { feature, found, done, .. } = remark;
        table.row(["remark", "", &format!("{feature}: {found}; {done}")]);
    }
    text += &table.text(2);
    for left in objects.left_out.iter().take(REMARKS_MAX) {
        let [east, north] = left.at_m;
        text += &format!("  left out: {}, {:.1} m high, at {east:.0} {north:.0}: ", left.kind, left.height_m);
        text += &format!("{}\n", full_text(left));
    }
    let more: usize =
        [objects.left_out.len(), objects.remarks.len()].map(|count| count.saturating_sub(REMARKS_MAX)).iter().sum();
    if 0 < more {
        text += &format!("  and {} more in objects.geojson\n", grouped(more as u64));
    }
    text
}

/// What had no room for an object.
fn full_text(left: &ObjectLeftOut) -> String {
    match left.full {
        ReportPlace::Module([row, col]) => format!("load module {row},{col} has no room"),
        ReportPlace::Window([row, col]) => format!("the 4 km square from load module {row},{col} has no room"),
        ReportPlace::Area => "the area has no room".to_owned(),
    }
}

fn objects_json(objects: &ExplainedObjects) -> Value {
    let kind =
        |(name, [count, polygons]): &(&str, [u64; 2])| json!({ "kind": name, "count": count, "polygons": polygons });
    let left = |left: &ObjectLeftOut| {
        json!({ "kind": left.kind, "place_m": left.at_m, "height_m": left.height_m,
                "silhouette_m2": left.silhouette_m2, "why": full_text(left) })
    };
    let remark = |of: &FeatureRemark| {
        let FeatureRemark { feature, at_m, found, done, .. } = of;
        json!({ "object": feature, "place_m": at_m, "found": found, "done": done })
    };
    json!({
        "kinds": objects.kinds.iter().map(kind).collect::<Vec<_>>(),
        "limit": objects.limit,
        "left_out": objects.left_out.iter().map(left).collect::<Vec<_>>(),
        "remarks": objects.remarks.iter().map(remark).collect::<Vec<_>>(),
    })
}

/// Why something is not in the ground, a limit with its place.
fn why_text(why: FeatureWhy) -> String {
    match why {
        FeatureWhy::Module(row, col) => format!("load module {row},{col} has no room"),
        FeatureWhy::Window(row, col) => format!("the 4 km square from load module {row},{col} has no room"),
        FeatureWhy::Area => "the area has no room".into(),
        FeatureWhy::Stub => "it would lead nowhere".into(),
        FeatureWhy::Alone => "it would hang together with too little".into(),
        FeatureWhy::Pond => "its shore is long for so little water".into(),
    }
}

fn stop_text(stop: StopReason) -> &'static str {
    match stop {
        StopReason::BudgetSpent => "its share was spent",
        StopReason::ResidualReached => "the residual asked for was reached",
        StopReason::RmsReached => "the RMS residual asked for was reached",
        StopReason::Exhausted => "nothing was left to choose",
    }
}

fn by_text(by: RefusedBy) -> &'static str {
    match by {
        RefusedBy::Module => "limits.per_load_module",
        RefusedBy::Window => "limits.per_4km_square",
        RefusedBy::Reservation => "room kept for a neighbour's side",
    }
}

/// Refused posts that a text lists; JSON has them all.
const REFUSED_MAX: usize = 10;

fn refused_text(found: &Explanation) -> String {
    let (count, limit) = found.count;
    if found.refused.is_empty() {
        let why = if count < limit {
            ": it holds what its tile's share of the budget found worth a triangle here"
        } else {
            ""
        };
        return format!("No post was refused here{why}.\n");
    }
    let mut table = Table::new(&[Align::Right, Align::Right, Align::Right, Align::Left]);
    table.row(["east", "north", "residual", "refused by"]);
    for refusal in found.refused.iter().take(REFUSED_MAX) {
        let [east, north] = refusal.place_m.map(|metres| metres.to_string());
        table.row([east, north, format!("{:.2} m", refusal.residual_m), by_text(refusal.by).into()]);
    }
    let more = found.refused.len().saturating_sub(REFUSED_MAX);
    let rest = if more == 0 { String::new() } else { format!("  and {more} more: --format json\n") };
    format!("{} posts were refused here\n{}{rest}", found.refused.len(), table.text(2))
}

/// How many come before a place, as a share of those that were drawn to be compared with, where not all are.
fn share_before(found: &Explanation, place: usize) -> Option<String> {
    found.drawn_of?;
    let of = found.place.1;
    let share = 100.0 * (place - 1) as f64 / of as f64;
    Some(format!("of {} load modules drawn evenly, {share:.0} %", grouped(of as u64)))
}

fn one_more_text(found: &Explanation) -> String {
    match (&found.one_more, &found.no_ground) {
        (Some(more), _) => {
            let [east, north] = more.place_m;
            let (larger, of) = (grouped(more.place as u64 - 1), grouped(found.place.1 as u64));
            let before = share_before(found, more.place).unwrap_or_else(|| format!("{larger} of {of} load modules"));
            format!(
                "One more point, two triangles, would take the RMS residual from {:.3} m to {:.3} m:\n  at {east} \
                 {north}, {:.2} m {} the triangle there; half of that a triangle.\n  \
                 {}{} would gain more.\n",
                more.rms_before_m,
                more.rms_after_m,
                more.raised_m.abs(),
                if more.raised_m < 0.0 { "below" } else { "above" },
                before[..1].to_uppercase(),
                &before[1..],
            )
        }
        (None, Some(why)) => format!(
            "What one more point would buy was not computed: {why}\n  --against DEM names the raster to look at\n"
        ),
        (None, None) => "One more point would buy nothing: no post lies inside a triangle and off it.\n".into(),
    }
}

fn left_out_json(left: &FeatureLeftOut) -> Value {
    json!({ "feature": left.feature, "length_m": left.length_m, "why": why_text(left.why) })
}

fn far_off_json(far: &FeatureFarOff) -> Value {
    json!({ "feature": far.feature, "place_m": far.at_m, "off_m": far.off_m, "cause": far.cause.name() })
}

fn features_json(features: &ExplainedFeatures) -> Value {
    let remark = |remark: &FeatureRemark| {
        json!({
            "feature": remark.feature,
            "place_m": remark.at_m,
            "outcome": views::outcome(remark),
            "found": remark.found,
            "done": remark.done,
        })
    };
    let cost = features.cost.iter().map(|(name, triangles)| json!({ "name": name, "triangles": triangles }));
    let moved = features.moved_m3.iter();
    let moved = moved.map(|(name, [cut, fill])| json!({ "name": name, "cut_m3": cut, "fill_m3": fill }));
    json!({
        "classes": cost.collect::<Vec<_>>(),
        "earthworks": {
            "classes": moved.collect::<Vec<_>>(),
            "worst": features.far_off.iter().map(far_off_json).collect::<Vec<_>>(),
        },
        "share": features.share,
        "share_max": features.share_max,
        "left_out": features.left_out.iter().map(left_out_json).collect::<Vec<_>>(),
        "remarks": features.remarks.iter().map(remark).collect::<Vec<_>>(),
    })
}

/// For a program.
pub fn to_json(found: &Explanation) -> Value {
    let (tile, state, stop) = found.tile;
    let [rms_m, mean_abs_m, max_m] = found.residual_m;
    let window = found.window;
    let classes = found.classes.iter().map(|(name, count)| json!({ "name": name, "triangles": count }));
    let mut value = json!({
        "module": [found.module.row, found.module.col],
        "extent_m": found.extent_m,
        "tile": {
            "row": tile.row,
            "col": tile.col,
            "state": state,
            "stop": stop_text(stop),
            "triangles": found.tile_triangles.0,
            "allowed": found.tile_triangles.1,
        },
        "triangles": found.triangles,
        "polygons": found.polygons,
        "vertices_inside": found.vertices_inside,
        "vertices_on_sides": found.vertices_on_sides,
        "per_load_module": { "count": found.count.0, "limit": found.count.1, "granted": found.granted },
        "per_4km": {
            "window": [window.origin.row, window.origin.col],
            "count": window.count,
            "limit": window.limit,
        },
        "classes": classes.collect::<Vec<_>>(),
        "residual": {
            "posts": found.posts,
            "rms_m": rms_m,
            "mean_abs_m": mean_abs_m,
            "max_m": max_m,
            "place": found.place.0,
            "of": found.place.1,
        },
        "refused": found.refused.iter().map(|refusal| json!({
            "place_m": refusal.place_m,
            "residual_m": refusal.residual_m,
            "by": by_text(refusal.by),
        })).collect::<Vec<_>>(),
        "one_more": found.one_more.map(|more| json!({
            "place_m": more.place_m,
            "raised_m": more.raised_m,
            "triangles": 2,
            "rms_before_m": more.rms_before_m,
            "rms_after_m": more.rms_after_m,
            "place": more.place,
        })),
        "levels": found.levels.iter().map(|(triangles, rms_m, max_m)| json!({
            "triangles": triangles,
            "rms_m": rms_m,
            "max_m": max_m,
        })).collect::<Vec<_>>(),
        "no_ground": found.no_ground,
        "features": found.features.as_ref().map(features_json),
        "objects": found.objects.as_ref().map(objects_json),
    });
    if let Some(all) = found.drawn_of {
        value["residual"]["drawn_of"] = json!(all);
    }
    value
}
