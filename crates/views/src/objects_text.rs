//! Buildings, walls and woods of a report in words.

use store::{ObjectSums, ReportObjects};

use crate::table::{Align, Table, grouped};

use Align::{Left, Right};

/// Kind, kept and wanted in number, in square metres of silhouette, and the share in per cent.
pub(crate) fn objects_row(sums: &ObjectSums) -> [String; 6] {
    let share = if 0.0 < sums.wanted_m2 { format!("{:.1}", 100.0 * sums.kept_m2 / sums.wanted_m2) } else { "-".into() };
    let [kept_m2, wanted_m2] = [sums.kept_m2, sums.wanted_m2].map(|square| grouped(square.round() as u64));
    [sums.kind.clone(), grouped(sums.kept), grouped(sums.wanted), kept_m2, wanted_m2, share]
}

/// The block of the text report.
pub(crate) fn objects_text(objects: &ReportObjects) -> String {
    let mut table = Table::new(&[Left, Right, Right, Right, Right, Right]);
    table.row(["Objects", "kept", "of", "m2 seen", "of", "%"]);
    for [kind, numbers @ ..] in objects.kinds.iter().map(objects_row) {
        table.row([format!("  {kind}")].into_iter().chain(numbers));
    }
    let of = |found: store::ReportObjectLimit| format!("{} of {}", grouped(found.max), grouped(found.limit));
    format!(
        "{}  {} roofs, walls and triangles of woods; {} in one load module at most, {} in 4 km\n  {} had no room, \
         {} remarks; objects.geojson\n",
        table.text(0),
        grouped(objects.polygons),
        of(objects.per_load_module),
        of(objects.per_4km),
        grouped(objects.left_out),
        grouped(objects.remarks)
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use store::ReportObjectLimit;

    #[test]
    fn what_is_kept_of_what_was_wanted_is_told_by_kind() {
        let sums =
            ObjectSums { kind: "building".into(), wanted: 1_200, kept: 1_150, wanted_m2: 90_000.4, kept_m2: 88_000.0 };
        let limit = ReportObjectLimit { max: 390, limit: 400 };
        let objects = ReportObjects {
            kinds: vec![sums],
            polygons: 6_000,
            per_load_module: limit,
            per_4km: limit,
            left_out: 50,
            remarks: 3,
        };
        let text = objects_text(&objects);
        assert!(text.contains("building  1,150  1,200   88,000  90,000  97.8"), "{text}");
        assert!(text.contains("390 of 400 in one load module"), "{text}");
        assert!(text.contains("50 had no room, 3 remarks"), "{text}");
    }
}
