//! What `tiefort correlate` found, for a program: shares from 0 to 1, `null` where nothing was there to measure.

use inspect::{Confusion, Correlation, Criterion, HeightFigures, SLOPE_ENDS_DEGREES, Shift};
use serde_json::{Value, json};

use crate::measures_json::{measured, where_any};
use crate::places;

/// All of it.
pub fn to_json(found: &Correlation) -> Value {
    let request = &found.request;
    json!({
        "tiefort": env!("CARGO_PKG_VERSION"),
        "accepted": found.is_accepted(),
        "causes": found.causes,
        "notes": found.notes,
        "a": found.surfaces[0],
        "b": found.surfaces[1],
        "common_m": found.common_m,
        "plan": {
            "accept": request.demand.share,
            "risk": request.demand.risk,
            "samples": found.plan.samples,
            "failures_max": found.plan.failures_max,
            "seed": request.seed,
            "within_m": request.within_m,
            "slope_within_degrees": request.slope_within_degrees,
            "range_m": request.range_m,
            "objects": places::standing_word(found.standing),
        },
        "criteria": found.criteria.iter().map(criterion).collect::<Vec<_>>(),
        "places": {
            "ground_in_a_only": found.only_one[0],
            "ground_in_b_only": found.only_one[1],
            "void_in_both": found.void_places,
            "pairs_left_out": found.void_pairs,
        },
        "heights": heights(&found.heights),
        "shift": found.shift.as_ref().map(|shift| shift_json(shift, found)),
        "slopes": {
            "apart_m": found.slopes.apart_m,
            "ends_degrees": SLOPE_ENDS_DEGREES,
            "rms_degrees": where_any(0 < found.slopes.classes.total(), found.slopes.rms_degrees),
            "classes": confusion(&found.slopes.classes),
        },
        "classes": found.classes.iter().map(|class| json!({
            "name": class.name,
            "heights": heights(&class.heights),
        })).collect::<Vec<_>>(),
        "sights": found.sights.iter().map(|sight| json!({
            "above_m": sight.above_m,
            "hidden_seen": confusion(&sight.pairs),
        })).collect::<Vec<_>>(),
        "map": found.map,
    })
}

fn criterion(criterion: &Criterion) -> Value {
    let agreement = criterion.agreement();
    let more = json!({
        "agreement": agreement.map(|(share, _)| share),
        "interval": agreement.map(|(_, interval)| interval),
        "accepted": criterion.is_accepted(),
    });
    measured(true, criterion, more)
}

fn heights(figures: &HeightFigures) -> Value {
    let [p50, p90, p95, p99] = figures.absolute_m;
    let largest_at_m = (0 < figures.places).then_some(figures.largest_at_m);
    let more = json!({ "p50_m": p50, "p90_m": p90, "p95_m": p95, "p99_m": p99, "largest_at_m": largest_at_m });
    measured(0 < figures.places, figures, more)
}

fn shift_json(shift: &Shift, found: &Correlation) -> Value {
    let level = |metres: f64| where_any(shift.is_level_told, metres);
    let part = |of: [f64; 3]| json!({ "east_m": level(of[0]), "north_m": level(of[1]), "up_m": of[2] });
    json!({
        "moves_b_by": part(shift.by_m),
        "standard_error": part(shift.error_m),
        "rms_before_m": shift.rms_m[0],
        "rms_after_m": shift.rms_m[1],
        "is_aside": shift.is_aside(found.spacing_m()),
        "is_up": shift.is_up(found.request.within_m),
    })
}

fn confusion<const N: usize>(table: &Confusion<N>) -> Value {
    let kappa = table.kappa();
    json!({
        "a_by_b": table.0.iter().map(|row| row.to_vec()).collect::<Vec<_>>(),
        "samples": table.total(),
        "agreement": where_any(0 < table.total(), table.agreeing() as f64 / table.total().max(1) as f64),
        "kappa": kappa.map(|kappa| kappa.kappa),
        "kappa_interval": kappa.map(|kappa| kappa.interval),
    })
}
