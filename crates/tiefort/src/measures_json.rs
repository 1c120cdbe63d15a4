//! Every measure of a surface beside those of the regular grid, for a program: shares from 0 to 1, `null` where nothing
//! was there to measure.

use inspect::{
    ClassResidual, Cover, Drainage, Fidelity, Hausdorff, LineOfSight, Measures, ResidualFigures, SlopeClasses,
};
use serde::Serialize;
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
    let Measures { slope, mesh, .. } = found;
    let registration = found.registration.map(|of| measured(true, &of, json!({ "aside_m": of.aside_m() })));
    let seams = found.seams.map(|of| measured(0 < of.edges, &of, json!({ "ratio": of.ratio() })));
    let of_mesh = json!({ "below_5_degrees": mesh.sliver_share(), "is_sound": mesh.is_sound() });
    let fields = [
        ("residual", residual(&found.residual)),
        ("line_of_sight", sight(&found.line_of_sight)),
        ("slope", measured(0 < slope.posts, slope, json!({}))),
        ("slope_classes", slope_classes(&found.slope_classes)),
        ("hausdorff", hausdorff(&found.hausdorff)),
        ("drainage", drainage(&found.drainage)),
        ("cover", cover(&found.cover)),
        ("registration", json!(registration)),
        ("seams", json!(seams)),
        ("mesh", measured(0 < mesh.triangles, mesh, of_mesh)),
    ];
    fields.into_iter().map(|(name, figures)| (name.to_string(), figures)).collect()
}

/// A figure, or `null` where it is none.
pub fn where_any(is_any: bool, figure: f64) -> Value {
    if is_any { json!(figure) } else { Value::Null }
}

/// The fields of `figures` and those of `more`; all but counts are `null` where nothing was there to measure.
///
/// # Panics
/// When `figures` or `more` has no names for its fields.
pub fn measured(is_any: bool, figures: &impl Serialize, more: Value) -> Value {
    let (Value::Object(mut all), Value::Object(more)) = (json!(figures), more) else { panic!("figures have names") };
    all.extend(more);
    all.values_mut().filter(|figure| !is_any && figure.is_f64()).for_each(|figure| *figure = Value::Null);
    Value::Object(all)
}

/// Residuals of a set of posts.
pub fn residual(found: &ResidualFigures) -> Value {
    measured(0 < found.posts, found, json!({}))
}

fn sight(found: &LineOfSight) -> Value {
    let shares = json!({
        "pairs": found.pairs(),
        "left_out": found.left_out,
        "agreement": found.agreement(),
        "half_width": found.half_width(),
        "false_visible": found.false_visible_share(),
        "false_hidden": found.false_hidden_share(),
        "visible_share_dem": found.visible_share_dem(),
        "visible_share_tin": found.visible_share_tin(),
    });
    measured(0 < found.pairs(), &shares, json!({}))
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
    let [dem_to_tin, tin_to_dem] =
        [found.dem_to_tin, found.tin_to_dem].map(|way| measured(0 < way.places, &way, json!({})));
    let both = json!({ "max_m": found.max_m(), "mean_m": found.mean_m() });
    let ways = json!({ "dem_to_tin": dem_to_tin, "tin_to_dem": tin_to_dem });
    measured(0 < found.dem_to_tin.places, &both, ways)
}

fn drainage(found: &Drainage) -> Value {
    let more = json!({
        "recall": where_any(0 < found.channels_dem, found.recall()),
        "precision": where_any(0 < found.channels_tin, found.precision()),
    });
    measured(true, found, more)
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
