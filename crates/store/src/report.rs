//! `report.json`: what a run found. The one file that knows times.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::{FileStamp, ReportFeatures};

/// The content of `report.json`; its keys are a contract. Every number is finite.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Report {
    /// Name of the gaming area.
    pub area: String,
    /// Tasks at once.
    pub workers: u32,
    /// Where the time went, in order.
    pub stages: Vec<ReportStage>,
    /// Points of the area.
    pub points: ReportPoints,
    /// What limits count: `triangles` or `polygons`, followed by `and objects` where those count, too.
    pub count: String,
    /// Triangles of all load modules.
    pub triangles: u64,
    /// Convex polygons of all load modules.
    pub polygons: u64,
    /// Use of `per_load_module`.
    pub per_load_module: ReportPerModule,
    /// Use of `per_4km_square`.
    pub per_4km: ReportPerWindow,
    /// Use of the pool.
    pub pool: ReportPool,
    /// Use of limits before points made room for them, where any did (clipped edges).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub before_removals: Option<ReportBefore>,
    /// Against the working ground, every post counted once: the DEM on the working grid with features and water in it.
    pub residual: ReportResidual,
    /// The same, of load modules at the outer border of the area and of the others apart.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub border: Option<ReportBorder>,
    /// How near `residual` is to that of the best surface of so many triangles; absent where the ground is too small.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub limit: Option<ReportLimit>,
    /// Heights of the surface, and of the sources under it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub heights: Option<ReportHeights>,
    /// Against the sources at the posts of the working grid, with nothing burned into them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub residual_against_source_grid: Option<ReportResidual>,
    /// Against the source at its own posts, where there is one: what resampling costs is in it.
    pub residual_against_source: Option<ReportResidual>,
    /// The same for each class of the mask, in the job's order.
    pub classes: Vec<ReportClass>,
    /// Roads, rivers and lakes, where the job has any.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub features: Option<ReportFeatures>,
    /// Buildings, walls and woods, where the job has any.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub objects: Option<ReportObjects>,
    /// The least mean that would keep nearly all of them, where limits leave out more than a person expects and one of
    /// the means that `plan` tries is enough.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub enough: Option<ReportEnough>,
    /// Levels of detail, the finest first; none where there is only that one.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub levels: Vec<ReportLevel>,
    /// RMS of the residuals of all classes, each weighted by its points as in the founding paper, in metres.
    pub overall_point_weighted_rms_m: f64,
    /// What the source says of its own accuracy, in metres.
    pub dem_accuracy_m: Option<f64>,
    /// Posts without a height in the source.
    pub voids: ReportVoids,
    /// Limits that could not be met.
    pub breaches: Vec<ReportBreach>,
    /// Posts that limits kept out.
    pub refusals: ReportRefusals,
    /// Where limits were met only by refusing posts, most posts first.
    pub bound: Vec<ReportBound>,
    /// Why tiles stopped selecting.
    pub stops: ReportStops,
    /// What else a reader should know, a sentence each.
    pub warnings: Vec<String>,
    /// Whether only some tiles were made again since what all are made from had changed: a build may change others.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub outdated: bool,
    /// What each tile took, where it was worked on in this run.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub tiles: Vec<ReportTile>,
    /// Files written beside the report, `database.json` among them, and how they must look.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub files: BTreeMap<String, FileStamp>,
}

/// Limits with which nearly all roads, rivers and lakes would be in the ground.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct ReportEnough {
    /// Triangles of a load module, on average over the area.
    pub mean: u32,
    /// At most in one load module.
    pub per_load_module: u32,
    /// At most in a square of 4 km.
    pub per_4km: u32,
}

/// Seconds that one tile took.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ReportTile {
    /// Row and column.
    pub tile: [u32; 2],
    /// Seconds on the clock, by stage; a stage that kept the tile is absent.
    pub seconds: BTreeMap<String, f64>,
}

/// One stage of the run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ReportStage {
    /// Its name.
    pub name: String,
    /// Seconds on the clock.
    pub wall_s: f64,
    /// Seconds of all threads together.
    pub cpu_s: f64,
}

/// Points of the area, each counted once.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct ReportPoints {
    /// Selected for their residual.
    pub selected: u64,
    /// Border points, corners not counted.
    pub border: u64,
    /// Corners of load modules.
    pub corner: u64,
    /// All.
    pub total: u64,
}

/// Use of the limit per load module.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ReportPerModule {
    /// Mean count.
    pub mean: f64,
    /// Mean count that the job allows.
    pub mean_limit: f64,
    /// Largest count.
    pub max: u64,
    /// What the job allows.
    pub limit: u64,
    /// Load modules above it, those that the pool covers included.
    pub over: u64,
}

/// Use of the limit per window of 4 km.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct ReportPerWindow {
    /// Largest count of any 4 km square of load modules, 8 x 8 of 500 m.
    pub max: u64,
    /// What the job allows.
    pub limit: u64,
    /// Windows above it.
    pub over: u64,
    /// Largest count of any square that is one load module wider, 9 x 9 of 500 m: bounds a 4 km square at any offset.
    pub worst_9x9: u64,
}

/// Use of the pool.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct ReportPool {
    /// Triangles above the limit that the area may use.
    pub size: u64,
    /// Those it used.
    pub used: u64,
}

/// What was cut, before points were taken out for limits.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ReportBefore {
    /// Points that were taken out.
    pub removed: u64,
    /// Use of `per_load_module`.
    pub per_load_module: ReportPerModule,
    /// Use of `per_4km_square`.
    pub per_4km: ReportPerWindow,
}

/// How far posts lie from the triangles, in metres.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ReportResidual {
    /// Root mean square.
    pub rms_m: f64,
    /// Largest.
    pub max_m: f64,
    /// Mean of the absolute residuals.
    pub mean_abs_m: f64,
    /// 95 of 100 posts are within.
    pub p95_m: f64,
    /// 99 of 100 posts are within.
    pub p99_m: f64,
}

/// Residuals of load modules at the outer border of the area, and of the others.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ReportBorder {
    /// Of load modules with a side on the outer border.
    pub at_border: ReportPart,
    /// Whether that border is fixed: more triangles give it no points.
    #[serde(default)]
    pub fixed: bool,
    /// Of all others.
    pub inside: ReportPart,
}

/// The distance from the limit.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ReportLimit {
    /// Triangles of all load modules, at the finest level.
    pub triangles: u64,
    /// RMS residual of the best surface of so many, in metres.
    pub rms_m: f64,
    /// RMS residual against the working grid over that; absent where that is 0, as on a plane.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub eta: Option<f64>,
    /// Share of the ground that is rough for so many: the limit does not hold there.
    pub rough_share: f64,
}

/// Heights in metres, lowest and highest.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ReportHeights {
    /// Of the surface's vertices, at all levels.
    pub surface_m: [f64; 2],
    /// Of the sources under the area, before voids are filled, with the stated level of water; none for the sample
    /// terrain.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sources_m: Option<[f64; 2]>,
    /// How far the surface reaches beyond the sources.
    pub outside_m: f64,
}

/// Residuals of a part of the area, in metres.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ReportPart {
    /// Posts that count.
    pub posts: u64,
    /// Root mean square.
    pub rms_m: f64,
    /// Largest.
    pub max_m: f64,
}

/// One class of the mask.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ReportClass {
    /// Its name.
    pub name: String,
    /// Posts of the working grid in it.
    pub posts: u64,
    /// Points of the TIN in it.
    pub points: u64,
    /// Its residuals.
    pub residual: ReportResidual,
}

/// One level of detail of all load modules.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ReportLevel {
    /// Its number; 0 is the finest.
    pub level: u32,
    /// The share of the finest level's inner vertices that the job wants.
    pub inner_share: f64,
    /// Triangles of all load modules.
    pub triangles: u64,
    /// Root mean square residual against the working grid, in metres.
    pub rms_m: f64,
    /// Largest residual, in metres.
    pub max_m: f64,
}

/// Posts without a height in the source.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct ReportVoids {
    /// All of them.
    pub count: u64,
    /// Those that were filled.
    pub filled: u64,
}

/// One limit that could not be met.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ReportBreach {
    /// `per_load_module`, `mean_per_load_module`, `per_4km_square` or `residual`.
    pub kind: String,
    /// Where.
    #[serde(rename = "where")]
    pub place: ReportPlace,
    /// What was counted there.
    pub count: u64,
    /// What the limit allows there.
    pub limit: u64,
    /// How far the count is above it.
    pub excess: u64,
    /// Posts refused there.
    pub refused: u32,
    /// RMS residual there as built, in metres.
    pub rms_with_m: f64,
    /// RMS residual there without the limit, in metres, where it was computed.
    pub rms_without_m: Option<f64>,
}

/// Where a limit was not met; rows and columns from the south-west, row first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ReportPlace {
    /// One load module: its row and column.
    Module([u32; 2]),
    /// A window: row and column of its south-west load module.
    Window([u32; 2]),
    /// The whole area.
    Area,
}

/// Posts that limits kept out.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ReportRefusals {
    /// All of them.
    pub count: u64,
    /// By the limit of a load module.
    pub by_module: u64,
    /// By the limit of a window.
    pub by_window: u64,
    /// To keep free what a neighbour's side was promised.
    pub by_reservation: u64,
    /// The largest residual among them, in metres.
    pub largest_m: f64,
}

/// A limit that was met by refusing posts.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ReportBound {
    /// `per_load_module` or `per_4km_square`.
    pub kind: String,
    /// Where.
    #[serde(rename = "where")]
    pub place: ReportPlace,
    /// What was counted there.
    pub count: u64,
    /// What the job allows there, before the pool.
    pub limit: u64,
    /// Posts refused there.
    pub refused: u32,
    /// The largest residual among them when they were refused, in metres.
    pub refused_largest_m: f64,
    /// RMS residual there as built, in metres.
    pub rms_with_m: f64,
    /// RMS residual there had the refused posts been selected, in metres.
    pub rms_without_m: f64,
}

/// How many tiles stopped selecting for which reason.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct ReportStops {
    /// All points or triangles allotted to the tile were spent.
    pub budget_spent: u64,
    /// The residual asked for was reached.
    pub residual_reached: u64,
    /// The RMS residual asked for was reached.
    pub rms_reached: u64,
    /// Nothing was left to select: every residual is zero, masked or refused.
    pub exhausted: u64,
}

/// What stands on the ground, and what had no room.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ReportObjects {
    /// Each kind that is there.
    pub kinds: Vec<ObjectSums>,
    /// Roofs, walls and triangles of canopies that are kept.
    pub polygons: u64,
    /// Of them, in one load module.
    pub per_load_module: ReportObjectLimit,
    /// Of them, in one square of 4 km.
    pub per_4km: ReportObjectLimit,
    /// Objects, or parts of woods, that had no room; `objects.geojson` has each of them.
    pub left_out: u64,
    /// Remarks on what was mended or is no object; `objects.geojson` has each of them, too.
    pub remarks: u64,
}

/// The most there is, and the limit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct ReportObjectLimit {
    /// The most.
    pub max: u64,
    /// The limit.
    pub limit: u64,
}

/// How much there is of a kind of objects.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ObjectSums {
    /// The word for the kind.
    pub kind: String,
    /// Buildings, towers, stretches of wall; of woods and rows their parts in single load modules.
    pub wanted: u64,
    /// Those that had room.
    pub kept: u64,
    /// What is seen of them from the side, in square metres.
    pub wanted_m2: f64,
    /// The same of those that had room.
    pub kept_m2: f64,
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{json, samples};
    use std::path::Path;

    fn report() -> Report {
        let breach = ReportBreach {
            kind: "per_4km_square".into(),
            place: ReportPlace::Window([4, 5]),
            count: 4100,
            limit: 4096,
            excess: 4,
            refused: 3,
            rms_with_m: 1.1,
            rms_without_m: None,
        };
        Report {
            area: "sample".into(),
            workers: 2,
            stages: vec![ReportStage { name: "refine".into(), wall_s: 0.25, cpu_s: 0.5 }],
            points: ReportPoints { selected: 5, border: 16, corner: 4, total: 25 },
            count: "triangles".into(),
            triangles: 32,
            polygons: 32,
            per_load_module: ReportPerModule { mean: 32.0, mean_limit: 32.0, max: 32, limit: 100, over: 0 },
            per_4km: ReportPerWindow { max: 4100, limit: 4096, over: 1, worst_9x9: 4200 },
            before_removals: Some(ReportBefore { removed: 3, ..ReportBefore::default() }),
            residual: ReportResidual { rms_m: 1.1, max_m: 9.0, mean_abs_m: 0.7, p95_m: 2.0, p99_m: 3.3 },
            limit: Some(ReportLimit { triangles: 32, rms_m: 0.75, eta: Some(1.1 / 0.75), rough_share: 0.125 }),
            levels: vec![ReportLevel { level: 1, inner_share: 0.5, triangles: 20, rms_m: 1.5, max_m: 11.25 }],
            overall_point_weighted_rms_m: 1.1,
            dem_accuracy_m: Some(2.5),
            breaches: vec![breach],
            bound: vec![ReportBound {
                kind: "per_4km_square".into(),
                place: ReportPlace::Window([2, 0]),
                count: 4095,
                limit: 4096,
                refused: 7,
                refused_largest_m: 9.5,
                rms_with_m: 1.5,
                rms_without_m: 1.25,
            }],
            stops: ReportStops { budget_spent: 35, exhausted: 1, ..ReportStops::default() },
            warnings: vec!["one tile is frozen".into()],
            tiles: vec![ReportTile { tile: [0, 1], seconds: BTreeMap::from([("refine".into(), 0.5)]) }],
            files: BTreeMap::from([("breaches.geojson".into(), FileStamp::of(b"{}"))]),
            ..Report::default()
        }
    }

    #[test]
    fn the_keys_of_the_contract_are_there() {
        let text = json::encode(Path::new("report.json"), &report()).unwrap();
        let value: serde_json::Value = serde_json::from_str(&text).unwrap();
        for pointer in [
            "/area /workers /stages/0/name /stages/0/wall_s /stages/0/cpu_s /triangles /polygons /pool/size /pool/used",
            "/points/selected /points/border /points/corner /points/total /residual/rms_m /residual/max_m",
            "/residual/mean_abs_m /residual/p95_m /residual/p99_m /residual_against_source /classes /dem_accuracy_m",
            "/per_load_module/mean /per_load_module/max /per_load_module/limit /per_load_module/over",
            "/per_4km/max /per_4km/limit /per_4km/over /per_4km/worst_9x9 /voids/count /voids/filled /warnings",
            "/breaches/0/kind /breaches/0/where /breaches/0/count /breaches/0/limit /breaches/0/excess",
            "/breaches/0/refused /breaches/0/rms_with_m /breaches/0/rms_without_m /levels/0/level /levels/0/triangles",
            "/levels/0/rms_m /levels/0/max_m /limit/triangles /limit/rms_m /limit/eta /limit/rough_share",
        ]
        .iter()
        .flat_map(|line| line.split(' '))
        {
            assert!(value.pointer(pointer).is_some(), "report.json lacks {pointer}");
        }
        assert_eq!(value["breaches"][0]["where"], serde_json::json!({ "window": [4, 5] }));
        assert_eq!(value["breaches"][0]["excess"], 4);
    }

    #[test]
    fn a_report_survives_its_file_and_every_damage_is_an_error() {
        let path = Path::new("report.json");
        let text = json::encode(path, &report()).unwrap();
        assert_eq!(json::decode::<Report>(path, text.as_bytes()).unwrap(), report());
        samples::check_every_damage(text.as_bytes(), |bytes| json::decode::<Report>(path, bytes).is_err());
    }
}
