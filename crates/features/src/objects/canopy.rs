//! Woods from heights of leaves above the ground, which come in cells.

use terrain::plans::{Plan, union};

use super::corners::smoothed;
use super::mend::{CLASS_M, FoundObject, FoundShape, WOOD_M2_MIN};
use super::plan::METRE;
use super::table::Traits;

/// Neighbouring cells of one row whose leaves are of one class of heights.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CanopyRun {
    /// Its row, from the south.
    pub row: i32,
    /// Its first column, from the west, and the one after its last.
    pub cols: [i32; 2],
    /// See [`canopy_class`].
    pub class: i32,
}

/// The class of a height in metres: those of one class make one layer.
pub fn canopy_class(height_m: f64) -> i32 {
    (height_m / CLASS_M).floor() as i32
}

/// The woods that runs of cells make, as high as the middle of their class, with borders that stay within a cell's
/// side. `corner` is the south-west corner of cell 0, 0 and `side_m` the side of a cell, both in metres.
pub fn canopy_woods(
    runs: &[CanopyRun],
    corner: [f64; 2],
    side_m: f64,
    (name, traits): (&str, Traits),
) -> Vec<FoundObject> {
    let quanta = |cell: i32, axis: usize| ((corner[axis] + f64::from(cell) * side_m) * METRE).round() as i32;
    let mut classes: Vec<i32> = runs.iter().map(|run| run.class).collect();
    classes.sort_unstable();
    classes.dedup();
    let mut woods = Vec::new();
    for class in classes {
        let rectangle = |run: &CanopyRun| -> Plan {
            let [west, east] = run.cols.map(|col| quanta(col, 0));
            let [south, north] = [run.row, run.row + 1].map(|row| quanta(row, 1));
            vec![vec![[west, south], [east, south], [east, north], [west, north]]]
        };
        let cells: Vec<Plan> = runs.iter().filter(|run| run.class == class).map(rectangle).collect();
        let height = ((f64::from(class) + 0.5) * CLASS_M * METRE).round() as i32;
        let least = (2.0 * WOOD_M2_MIN * METRE * METRE) as i64;
        let plans = union(&cells).into_iter().flat_map(|plan| smoothed(&plan, BORDER * side_m * METRE, least));
        for (number, plan) in plans.enumerate() {
            let ring =
                |ring: &Vec<[i32; 2]>| ring.iter().map(|at| at.map(|quanta| f64::from(quanta) / METRE)).collect();
            woods.push(FoundObject {
                name: format!("{name}#{}.{number}", class),
                traits: Traits { height, ..traits },
                bad_tags: Vec::new(),
                shape: FoundShape::Polygon(plan.iter().map(ring).collect()),
            });
        }
    }
    woods
}

/// How far a border may move, in sides of a cell: more than the half diagonal, so that stairs become slopes.
const BORDER: f64 = 0.75;

#[cfg(test)]
mod tests {
    use terrain::ObjectKind;

    use super::super::{ObjectOptions, mended, traits};
    use super::*;

    #[test]
    fn cells_of_one_class_are_one_wood_whose_stairs_are_slopes() {
        // A triangle of stairs, and a lone cell, which is too small.
        let stairs = (0..20).map(|row| CanopyRun { row, cols: [0, 20 - row], class: 4 });
        let runs: Vec<CanopyRun> = stairs.chain([CanopyRun { row: 0, cols: [40, 41], class: 4 }]).collect();
        let (traits, _) = traits(|_| None, (Some(ObjectKind::Wood), None), &[]).unwrap();
        let woods = canopy_woods(&runs, [100.0, 200.0], 12.5, ("chm.tif", traits));
        assert_eq!((woods.len(), woods[0].name.as_str()), (1, "chm.tif#4.0"));
        let (outlines, remarks) = mended(woods, &ObjectOptions { corners_max: 15, area_min_m2: 20.0 });
        assert_eq!((outlines.len(), remarks.len()), (1, 0));
        assert_eq!(outlines[0].traits.height, 1_728, "13.5 m");
        assert!(outlines[0].plan[0].len() <= 5, "{:?}", outlines[0].plan);
        let area_m2 = super::super::plan::doubled_area(&outlines[0].plan) as f64 / (2.0 * METRE * METRE);
        let cells_m2 = 210.0 * 12.5 * 12.5;
        assert!((area_m2 / cells_m2 - 1.0).abs() < 0.1, "{area_m2} of {cells_m2}");
    }
}
