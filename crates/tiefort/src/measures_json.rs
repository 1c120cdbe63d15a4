//! Every measure of a surface beside those of the regular grid, for a program: shares from 0 to 1, `null` where nothing
//! was there to measure.

use inspect::{
    ClassResidual, Cover, Distances, Drainage, Fidelity, Hausdorff, LineOfSight, Measures, MeshForm, Registration,
    ResidualFigures, SeamVisibility, SlopeClasses, SlopeDifference,
};
use serde_json::{Map, Value, json};

/// All measures of the surface by name, and under `regular_grid` the same of the grid.
pub fn fields(found: &Fidelity) -> Map<String, Value> {
    let mut all = measures(&found.tin);
    let mut grid = measures(&found.grid);
    grid.insert("step_posts".into(), json!(found.grid_step));
    grid.insert("step_m".into(), json!(f64::from(found.grid_step) * found.spacing_m));
    all.insert("polygons".into(), json!(found.polygons));
    if !found.classes.is_empty() {
        let class = |class: &ClassResidual| {
            let (tin, grid) = (residual(&class.tin), residual(&class.grid));
            json!({ "name": class.name, "residual": tin, "regular_grid": { "residual": grid } })
        };
        all.insert("classes".into(), found.classes.iter().map(class).collect());
    }
    all.insert("regular_grid".into(), Value::Object(grid));
    all
}

fn measures(found: &Measures) -> Map<String, Value> {
    let fields = [
        ("residual", residual(&found.residual)),
        ("line_of_sight", sight(&found.line_of_sight)),
        ("slope", slope(&found.slope)),
        ("slope_classes", slope_classes(&found.slope_classes)),
        ("hausdorff", hausdorff(&found.hausdorff)),
        ("drainage", drainage(&found.drainage)),
        ("cover", cover(&found.cover)),
        ("registration", found.registration.as_ref().map_or(Value::Null, registration)),
        ("seams", found.seams.as_ref().map_or(Value::Null, seams)),
        ("mesh", mesh(&found.mesh)),
    ];
    fields.into_iter().map(|(name, figures)| (name.to_string(), figures)).collect()
}

/// A figure, or `null` where it is none.
fn where_any(is_any: bool, figure: f64) -> Value {
    if is_any { json!(figure) } else { Value::Null }
}

/// Residuals of a set of posts.
pub fn residual(found: &ResidualFigures) -> Value {
    let figure = |metres: f64| where_any(0 < found.posts, metres);
    json!({
        "posts": found.posts,
        "rms_m": figure(found.rms_m),
        "mean_m": figure(found.mean_m),
        "mean_abs_m": figure(found.mean_abs_m),
        "p50_m": figure(found.p50_m),
        "p95_m": figure(found.p95_m),
        "p99_m": figure(found.p99_m),
        "max_m": figure(found.max_m),
    })
}

fn sight(found: &LineOfSight) -> Value {
    let share = |share: f64| where_any(0 < found.pairs(), share);
    json!({
        "pairs": found.pairs(),
        "left_out": found.left_out,
        "agreement": share(found.agreement()),
        "half_width": share(found.half_width()),
        "false_visible": share(found.false_visible_share()),
        "false_hidden": share(found.false_hidden_share()),
        "visible_share_dem": share(found.visible_share_dem()),
        "visible_share_tin": share(found.visible_share_tin()),
    })
}

fn slope(found: &SlopeDifference) -> Value {
    let angle = |degrees: f64| where_any(0 < found.posts, degrees);
    json!({
        "posts": found.posts,
        "rms_degrees": angle(found.rms_degrees),
        "normal_mean_degrees": angle(found.normal_mean_degrees),
        "normal_p95_degrees": angle(found.normal_p95_degrees),
    })
}

fn slope_classes(found: &SlopeClasses) -> Value {
    let share = |share: f64| where_any(0 < found.total(), share);
    json!({
        "from_grade": [0.0, inspect::GRADES[0], inspect::GRADES[1], inspect::GRADES[2]],
        "posts_by_class_on_dem_and_tin": found.posts,
        "agreement": share(found.agreement()),
        "gentler_on_tin": share(found.gentler()),
        "steeper_on_tin": share(found.steeper()),
        "shares_dem": found.shares_dem().map(share),
        "shares_tin": found.shares_tin().map(share),
    })
}

fn hausdorff(found: &Hausdorff) -> Value {
    let any = 0 < found.dem_to_tin.places;
    let way = |way: &Distances| {
        let any = 0 < way.places;
        json!({ "places": way.places, "max_m": where_any(any, way.max_m), "mean_m": where_any(any, way.mean_m) })
    };
    json!({
        "max_m": where_any(any, found.max_m()),
        "mean_m": where_any(any, found.mean_m()),
        "dem_to_tin": way(&found.dem_to_tin),
        "tin_to_dem": way(&found.tin_to_dem),
    })
}

fn drainage(found: &Drainage) -> Value {
    json!({
        "channel_posts_dem": found.channels_dem,
        "channel_posts_tin": found.channels_tin,
        "recall": where_any(0 < found.channels_dem, found.recall()),
        "precision": where_any(0 < found.channels_tin, found.precision()),
        "pits_dem": found.pits_dem,
        "pits_tin": found.pits_tin,
        "pits_spurious": found.pits_spurious,
        "pits_missed": found.pits_missed,
    })
}

fn cover(found: &Cover) -> Value {
    let share = |share: f64| where_any(0 < found.posts(), share);
    json!({
        "posts": found.posts(),
        "share_dem": share(found.share_dem()),
        "share_tin": share(found.share_tin()),
        "agreement": share(found.agreement()),
        "kept": where_any(0 < found.both + found.lost, found.kept()),
        "false_cover_posts": found.false_cover,
        "lost_posts": found.lost,
    })
}

fn registration(found: &Registration) -> Value {
    json!({
        "east_m": found.east_m,
        "north_m": found.north_m,
        "up_m": found.up_m,
        "aside_m": found.aside_m(),
        "correlation": found.correlation,
        "best_correlation": found.best_correlation,
        "is_at_end": found.is_at_end,
    })
}

fn seams(found: &SeamVisibility) -> Value {
    let any = 0 < found.edges;
    json!({
        "edges": found.edges,
        "bend_mean_degrees": where_any(any, found.bend_mean_degrees),
        "like_mean_degrees": where_any(any, found.like_mean_degrees),
        "ratio": found.ratio(),
    })
}

fn mesh(found: &MeshForm) -> Value {
    let angle = |degrees: f64| where_any(0 < found.triangles, degrees);
    json!({
        "triangles": found.triangles,
        "angle_min_degrees": angle(found.angle_min_degrees),
        "angle_p5_degrees": angle(found.angle_p5_degrees),
        "angle_median_degrees": angle(found.angle_median_degrees),
        "below_5_degrees": angle(found.sliver_share()),
        "cracks": found.cracks,
        "t_junctions": found.t_junctions,
        "torn": found.torn,
        "wrong_areas": found.wrong_areas,
        "is_sound": found.is_sound(),
    })
}
