//! What `report.json` says of roads, rivers and lakes.

use serde::{Deserialize, Serialize};

/// What features of an area cost, how true they are, and what became of those that could not be as they were wanted.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ReportFeatures {
    /// Each class of features that is there, in the job's order.
    pub classes: Vec<ReportFeatureClass>,
    /// What all of them take together.
    pub all: ReportFeatureCost,
    /// Remarks by what was done; `features.geojson` has each of them.
    pub remarks: ReportFeatureRemarks,
    /// What must hold of features, in figures.
    pub checks: ReportFeatureChecks,
    /// How low decks pass over ways and water of each class.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub deck_clearances: Vec<ReportDeckClearance>,
    /// What they move.
    pub earthworks: ReportEarthworks,
}

/// What roads, rivers and lakes in the ground cut and fill, against the ground under them.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ReportEarthworks {
    /// Each class that is in the ground, in the job's order.
    pub classes: Vec<ReportEarthwork>,
    /// The ten features that lie farthest off the ground, where they do by more than 3 m, each at its worst place.
    pub worst: Vec<ReportFarOff>,
}

/// What a class moves, inside the area.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ReportEarthwork {
    /// Its name.
    pub name: String,
    /// Kilometres of ways on the ground, or of the shores of lakes.
    pub length_km: f64,
    /// Those of them that lie more than 3 m off the ground, above or below.
    pub off_3m_km: f64,
    /// Those that lie more than 5 m off.
    pub off_5m_km: f64,
    /// Those that lie more than 10 m off.
    pub off_10m_km: f64,
    /// Those that lie more than 20 m off.
    pub off_20m_km: f64,
    /// Kilometres of ways that lie farther off than `cut_max_m` and `fill_max_m` allow.
    pub over_limit_km: f64,
    /// Kilometres of ways that lie farther off than twice as much.
    pub over_twice_limit_km: f64,
    /// Cubic metres that are cut, slopes with them.
    pub cut_m3: f64,
    /// Cubic metres that are filled.
    pub fill_m3: f64,
    /// Cubic metres that are cut for each kilometre.
    pub cut_m3_per_km: f64,
    /// Cubic metres that are filled for each kilometre.
    pub fill_m3_per_km: f64,
}

/// A place where a feature lies far off the ground.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ReportFarOff {
    /// The feature, as its file names it.
    pub feature: String,
    /// Its class.
    pub class: String,
    /// Easting and northing, in metres.
    pub at_m: [f64; 2],
    /// Metres above the ground; below it less than 0.
    pub off_m: f64,
    /// `grade`, `falling`, `level` or `pin`.
    pub cause: String,
}

/// One class of features.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ReportFeatureClass {
    /// Its name.
    pub name: String,
    /// Kilometres of ways in the sources that are to be in the ground: mended and cut at the area's border, each
    /// stretch once, bridges among them, without tunnels.
    pub wanted_km: f64,
    /// Those of them that are in the ground.
    pub kept_km: f64,
    /// Lakes of a hectare and more.
    pub lakes_wanted: u64,
    /// Those of them that are in the ground.
    pub lakes_kept: u64,
    /// Kilometres that are lines of the TIN: roads as centrelines, breaklines.
    pub line_km: f64,
    /// Kilometres that are strips with a left and a right edge.
    pub strip_km: f64,
    /// Kilometres of rivers and streams.
    pub channel_km: f64,
    /// Lakes.
    pub lakes: u64,
    /// Polygons of bridges.
    pub deck_polygons: u64,
    /// What it takes.
    pub cost: ReportFeatureCost,
}

/// Triangles that features take, as they were reserved before any tile was refined.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ReportFeatureCost {
    /// Triangles of the whole area.
    pub triangles: u64,
    /// Most triangles of a load module.
    pub module_max: u64,
    /// That, as a share of the limit of a load module.
    pub module_share: f64,
    /// Most triangles of a window.
    pub window_max: u64,
    /// That, as a share of the limit of a window.
    pub window_share: f64,
}

/// Remarks on features, each counted once, by the worst that was done.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct ReportFeatureRemarks {
    /// Something was put right.
    pub mended: u64,
    /// A feature is coarser than was asked for.
    pub degraded: u64,
    /// A feature, or a part of it, is not in the ground.
    pub left_out: u64,
}

/// What must hold of features.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ReportFeatureChecks {
    /// Edges that the TIN has to keep.
    pub edges: u64,
    /// Those that it lacks; each is listed as degraded.
    pub edges_missing: u64,
    /// Pieces of roads from one station to the next.
    pub stations: u64,
    /// Those that are steeper than the greatest grade of their road by more than a quantum of height.
    pub stations_steeper: u64,
    /// Ends of pieces of strips.
    pub strip_stations: u64,
    /// The largest difference in height between the two edges of a strip at one of them, in metres.
    pub strip_fall_max_m: f64,
    /// Edges of rivers and streams.
    pub river_edges: u64,
    /// Those that rise downstream.
    pub river_edges_rising: u64,
    /// Ends of what is in the ground at which its source goes on; `features.geojson` has each of them.
    pub loose_ends: u64,
    /// Lakes.
    pub lakes: u64,
    /// How far any corner of a triangle of water lies from the level of its lake, in metres.
    pub lake_spread_max_m: f64,
    /// Square metres inside the shores of lakes that a road tilts, which are its banks and no water.
    pub lake_banks_m2: u64,
    /// Posts outside water within a post of a lake.
    pub shore_posts: u64,
    /// Those of them that lie below its level.
    pub shore_posts_below: u64,
    /// Posts outside features and their slopes.
    pub outside_posts: u64,
    /// RMS residual of these against the source's heights, in metres.
    pub outside_rms_m: f64,
    /// The largest of them, in metres.
    pub outside_max_m: f64,
    /// Places of decks that were looked at, one in each square metre.
    #[serde(default)]
    pub deck_samples: u64,
    /// Those of them at which the ground stands above the deck.
    #[serde(default)]
    pub deck_samples_under: u64,
    /// How far it does at most, in metres.
    #[serde(default)]
    pub deck_under_max_m: f64,
    /// How far a corner of a deck stands above the road, and the ground under it, at most where its bridge ends on the
    /// ground, in metres.
    #[serde(default)]
    pub deck_step_max_m: f64,
    /// How steep a triangle of a deck is at most, of a square metre and more, in per cent.
    #[serde(default)]
    pub deck_slope_max_percent: f64,
    /// Ends of bridges from which no way goes on, and which hang more than 0.25 m above the ground.
    #[serde(default)]
    pub deck_ends_hanging: u64,
    /// How far one of them does at most, in metres.
    #[serde(default)]
    pub deck_end_hangs_max_m: f64,
    /// Metres of roads in the ground that lie inside buildings.
    #[serde(default)]
    pub roads_in_buildings_m: u64,
}

/// How low decks pass over one class of ways or water.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ReportDeckClearance {
    /// Name of the class.
    pub class: String,
    /// The least height of a deck above what it crosses of the class, in metres: where middle lines cross or run
    /// below it apart from its ends, and over level water.
    pub least_m: f64,
}
