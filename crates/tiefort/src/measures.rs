//! Line of sight and slope in words and as JSON: what `fidelity` and `tin --measure` have in common.

use compiler::{LineOfSight, Measures, SlopeDifference};
use serde_json::{Value, json};
use views::{Align, Table, grouped};

/// A table of measures: what, how much, and what it means.
pub fn table() -> Table {
    Table::new(&[Align::Left, Align::Right, Align::Left])
}

/// Adds line of sight and slope.
pub fn add_rows(table: &mut Table, measures: &Measures) {
    add_sight(table, &measures.line_of_sight);
    add_slope(table, &measures.slope);
}

fn add_sight(table: &mut Table, sight: &LineOfSight) {
    let left_out = if sight.left_out == 0 {
        String::new()
    } else {
        format!(", {} left out (voids, or no room)", grouped(sight.left_out))
    };
    if sight.pairs() == 0 {
        table.row(["Line of sight", "none", &format!("no pair to compare{left_out}")]);
        return;
    }
    let pairs = grouped(sight.pairs());
    let wide = 100.0 * sight.half_width();
    let shares = format!(
        "false visible {}, false hidden {}",
        percent(sight.false_visible_share()),
        percent(sight.false_hidden_share())
    );
    table.row(["Line of sight", &percent(sight.agreement()), &format!("agreement, ± {wide:.2} %; {shares}")]);
    let seen =
        format!("visible on the DEM, {} on the TIN; {pairs} pairs{left_out}", percent(sight.visible_share_tin()));
    table.row(["", &percent(sight.visible_share_dem()), &seen]);
}

fn add_slope(table: &mut Table, slope: &SlopeDifference) {
    if slope.posts == 0 {
        table.row(["Slope", "none", "no inner post to compare"]);
        return;
    }
    let rms = format!("{:.2}°", slope.rms_degrees);
    table.row(["Slope", &rms, &format!("RMS difference, {} inner posts", grouped(slope.posts))]);
    let normals = format!("mean angle between normals, 95 % within {:.2}°", slope.normal_p95_degrees);
    table.row(["", &format!("{:.2}°", slope.normal_mean_degrees), &normals]);
}

fn percent(share: f64) -> String {
    format!("{:.2} %", 100.0 * share)
}

/// Line of sight for a program: shares of pairs, from 0 to 1; `null` where no pair was compared.
pub fn sight_json(sight: &LineOfSight) -> Value {
    let share = |share: f64| if sight.pairs() == 0 { Value::Null } else { json!(share) };
    json!({
        "pairs": sight.pairs(),
        "left_out": sight.left_out,
        "agreement": share(sight.agreement()),
        "half_width": share(sight.half_width()),
        "false_visible": share(sight.false_visible_share()),
        "false_hidden": share(sight.false_hidden_share()),
        "visible_share_dem": share(sight.visible_share_dem()),
        "visible_share_tin": share(sight.visible_share_tin()),
    })
}

/// Slope for a program: angles in degrees; `null` where no post was compared.
pub fn slope_json(slope: &SlopeDifference) -> Value {
    let angle = |degrees: f64| if slope.posts == 0 { Value::Null } else { json!(degrees) };
    json!({
        "posts": slope.posts,
        "rms_degrees": angle(slope.rms_degrees),
        "normal_mean_degrees": angle(slope.normal_mean_degrees),
        "normal_p95_degrees": angle(slope.normal_p95_degrees),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn without_a_pair_or_a_post_there_is_no_figure() {
        let nothing = Measures {
            line_of_sight: LineOfSight { left_out: 9, ..LineOfSight::default() },
            slope: SlopeDifference::default(),
        };
        let mut rows = table();
        add_rows(&mut rows, &nothing);
        let text = rows.text(0);
        assert!(text.contains("no pair to compare, 9 left out") && text.contains("no inner post"), "{text}");
        assert_eq!(sight_json(&nothing.line_of_sight)["agreement"], Value::Null);
        assert_eq!(slope_json(&nothing.slope)["rms_degrees"], Value::Null);
    }

    #[test]
    fn shares_are_told_in_percent() {
        let sight = LineOfSight { visible: 280, hidden: 650, false_visible: 50, false_hidden: 20, left_out: 0 };
        let slope =
            SlopeDifference { posts: 4000, rms_degrees: 2.406, normal_mean_degrees: 1.5, normal_p95_degrees: 4.004 };
        let mut rows = table();
        add_rows(&mut rows, &Measures { line_of_sight: sight, slope });
        let expected = "\
Line of sight  93.00 %  agreement, ± 1.60 %; false visible 5.00 %, false hidden 2.00 %
               30.00 %  visible on the DEM, 33.00 % on the TIN; 1,000 pairs
Slope            2.41°  RMS difference, 4,000 inner posts
                 1.50°  mean angle between normals, 95 % within 4.00°
";
        assert_eq!(rows.text(0), expected);
    }
}
