//! A report with something in every part and a small piece of terrain, for the tests of this crate.

use terrain::{GridFrame, LoadModule, ModuleGrid, ModuleId, ModuleVertex, Spacing};

use crate::picture::{Scene, SceneLimits};
use store::{
    Report, ReportBefore, ReportBound, ReportBreach, ReportClass, ReportEarthwork, ReportEarthworks, ReportFarOff,
    ReportFeatureChecks, ReportFeatureClass, ReportFeatureCost, ReportFeatureRemarks, ReportFeatures, ReportLevel,
    ReportPerModule, ReportPerWindow, ReportPlace, ReportPoints, ReportPool, ReportRefusals, ReportResidual,
    ReportStage, ReportStops, ReportVoids,
};

/// 2 x 3 load modules of 20 x 20 cells, 25 m apart.
pub(crate) const GRID: ModuleGrid = ModuleGrid { rows: 2, cols: 3, side_cells: 20 };
pub(crate) fn spacing() -> Spacing {
    Spacing::from_sixteenths(400).unwrap()
}

/// Load modules of four triangles each around a middle vertex, over a slope.
pub(crate) fn modules() -> Vec<LoadModule> {
    let side = 64_000_u16;
    let height = |row: u32, col: u32, x: u16, y: u16| {
        let (x, y) = (i64::from(col) * 64_000 + i64::from(x), i64::from(row) * 64_000 + i64::from(y));
        (64_000 + x / 10 - y / 20) as i32
    };
    let module = |id: ModuleId| {
        let vertex = |(x, y): (u16, u16)| ModuleVertex { x, y, z: height(id.row, id.col, x, y) };
        let places = [(0, 0), (side, 0), (20_000, 30_000), (0, side), (side, side)];
        LoadModule {
            id,
            side,
            vertices: places.into_iter().map(vertex).collect(),
            triangles: vec![[0, 1, 2], [0, 2, 3], [1, 4, 2], [2, 4, 3]],
            classes: vec![0; 4],
            polygon_count: 4,
            ..LoadModule::default()
        }
    };
    GRID.all().iter().map(module).collect()
}

/// The scene of these load modules, without ground or tiles.
pub(crate) fn scene<'a>(modules: &'a [LoadModule], limits: &'a SceneLimits) -> Scene<'a> {
    Scene {
        name: "x",
        crs: "EPSG:32611",
        grid: GRID,
        frame: GridFrame { origin_east_m: 0.0, origin_north_m: 0.0, spacing: spacing() },
        part: GRID.all(),
        modules,
        ground: None,
        limits,
        water: None,
        features: None,
        tiles: &[],
    }
}

pub(crate) fn residual(rms_m: f64) -> ReportResidual {
    ReportResidual { rms_m, max_m: 14.0 * rms_m, mean_abs_m: 0.6 * rms_m, p95_m: 2.0 * rms_m, p99_m: 3.3 * rms_m }
}

fn breach(kind: &str, place: ReportPlace, count: u64, limit: u64, rms_without_m: Option<f64>) -> ReportBreach {
    let excess = count - limit;
    ReportBreach { kind: kind.into(), place, count, limit, excess, refused: 3, rms_with_m: 1.1, rms_without_m }
}

fn bound(kind: &str, place: ReportPlace, count: u64, limit: u64, refused: u32) -> ReportBound {
    let (refused_largest_m, rms_with_m, rms_without_m) = (7.5, 1.1, 0.98);
    ReportBound { kind: kind.into(), place, count, limit, refused, refused_largest_m, rms_with_m, rms_without_m }
}

fn class(name: &str, posts: u64, points: u64, rms_m: f64) -> ReportClass {
    ReportClass { name: name.into(), posts, points, residual: residual(rms_m) }
}

pub(crate) fn report() -> Report {
    let stage = |name: &str, wall_s, cpu_s| ReportStage { name: name.into(), wall_s, cpu_s };
    Report {
        area: "fort_irwin".into(),
        workers: 2,
        stages: vec![stage("read", 0.25, 0.4), stage("survey", 1.5, 3.0), stage("refine", 12.25, 24.0)],
        points: ReportPoints { selected: 76_500, border: 1_200, corner: 10_201, total: 87_901 },
        count: "triangles".into(),
        triangles: 319_998,
        polygons: 319_998,
        per_load_module: ReportPerModule { mean: 31.9998, mean_limit: 32.0, max: 107, limit: 100, over: 1 },
        per_4km: ReportPerWindow { max: 4_100, limit: 4_096, over: 1, worst_9x9: 4_990 },
        pool: ReportPool { size: 500, used: 7 },
        before_removals: Some(ReportBefore {
            removed: 812,
            per_load_module: ReportPerModule { mean: 32.25, mean_limit: 32.0, max: 131, limit: 100, over: 19 },
            per_4km: ReportPerWindow { max: 4_810, limit: 4_096, over: 140, worst_9x9: 5_600 },
        }),
        residual: residual(2.999),
        limit: Some(store::ReportLimit {
            triangles: 319_998,
            rms_m: 2.4375,
            eta: Some(2.999 / 2.4375),
            rough_share: 0.375,
        }),
        border: Some(store::ReportBorder {
            at_border: store::ReportPart { posts: 77_000, rms_m: 3.4, max_m: 31.0 },
            fixed: false,
            inside: store::ReportPart { posts: 3_823_528, rms_m: 3.2, max_m: 36.5 },
        }),
        heights: Some(store::ReportHeights {
            surface_m: [688.5, 1_903.25],
            sources_m: Some([690.0, 1_903.5]),
            outside_m: 1.5,
        }),
        residual_against_source_grid: Some(residual(2.9)),
        residual_against_source: Some(residual(3.1)),
        classes: vec![class("plains", 2_587_215, 64_939, 0.869), class("mountains", 1_313_410, 28_532, 5.268)],
        overall_point_weighted_rms_m: 2.999,
        dem_accuracy_m: Some(2.5),
        voids: ReportVoids { count: 12, filled: 12 },
        breaches: vec![
            breach("per_load_module", ReportPlace::Module([4, 5]), 107, 100, None),
            breach("per_4km_square", ReportPlace::Window([0, 1]), 4_100, 4_096, Some(0.98)),
            breach("mean_per_load_module", ReportPlace::Area, 320_010, 320_000, None),
            breach("residual", ReportPlace::Area, 17_547, 10, None),
        ],
        refusals: ReportRefusals { count: 41, by_module: 30, by_window: 8, by_reservation: 3, largest_m: 7.5 },
        bound: vec![
            bound("per_4km_square", ReportPlace::Window([0, 1]), 4_096, 4_096, 5),
            bound("per_load_module", ReportPlace::Module([4, 5]), 99, 100, 3),
        ],
        stops: ReportStops { budget_spent: 35, exhausted: 1, ..ReportStops::default() },
        warnings: vec!["tile r01c02 is frozen; a build makes it whole".into()],
        ..Report::default()
    }
}

/// The same with two coarser levels.
pub(crate) fn with_levels() -> Report {
    let level =
        |level, inner_share, triangles, rms_m| ReportLevel { level, inner_share, triangles, rms_m, max_m: 60.5 };
    let levels = vec![level(0, 1.0, 319_998, 2.999), level(1, 0.5, 223_000, 4.25), level(2, 0.2, 165_000, 7.875)];
    Report { levels, ..report() }
}

/// Features of two classes.
pub(crate) fn features() -> ReportFeatures {
    let cost = ReportFeatureCost {
        triangles: 41_234,
        module_max: 48,
        module_share: 0.48,
        window_max: 1_024,
        window_share: 0.25,
    };
    let class = |name: &str, line_km, strip_km, lakes| ReportFeatureClass {
        name: name.into(),
        wanted_km: 1.5 * (line_km + strip_km),
        kept_km: line_km + strip_km,
        lakes_wanted: lakes,
        lakes_kept: lakes / 2,
        line_km,
        strip_km,
        lakes,
        cost,
        ..ReportFeatureClass::default()
    };
    let deck_clearances = vec![store::ReportDeckClearance { class: "stream".into(), least_m: 1.25 }];
    ReportFeatures {
        deck_clearances,
        classes: vec![class("primary", 4.0, 8.25, 0), class("lake", 0.0, 0.0, 3)],
        all: cost,
        remarks: ReportFeatureRemarks { mended: 3, degraded: 2, left_out: 1 },
        checks: ReportFeatureChecks {
            edges: 1_234,
            edges_missing: 4,
            outside_rms_m: 1.25,
            ..ReportFeatureChecks::default()
        },
        earthworks: ReportEarthworks {
            classes: vec![ReportEarthwork {
                name: "primary".into(),
                length_km: 12.25,
                off_3m_km: 0.5,
                off_5m_km: 0.25,
                cut_m3: 24_500.0,
                cut_m3_per_km: 2_000.0,
                ..ReportEarthwork::default()
            }],
            worst: vec![ReportFarOff {
                feature: "way 12".into(),
                class: "primary".into(),
                at_m: [543_210.5, 3_912_345.0],
                off_m: -6.25,
                cause: "grade".into(),
            }],
        },
    }
}
