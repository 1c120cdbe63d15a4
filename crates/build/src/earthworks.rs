//! What features move, as people ask for it: by class, by load module, by line, and where they lie farthest off.

use std::collections::{BTreeMap, HashMap};

use features::{Earthworks, FeatureId, Moved, Place};
use store::FeatureFarOff;
use terrain::{Earthwork, ModuleGrid, ModuleId, metres_of_quanta};

/// What features of each class of the job move; `classes` has the job's number of each.
pub(crate) fn by_class(works: &Earthworks, classes: &[u8]) -> Vec<(u8, Earthwork)> {
    let mut all: Vec<_> = works.classes.iter().map(|(class, work)| (classes[usize::from(*class)], *work)).collect();
    all.sort_by_key(|(class, _)| *class);
    all
}

/// Cubic metres cut and filled in each load module, by class.
pub(crate) fn by_module(works: &Earthworks, grid: ModuleGrid, classes: &[u8]) -> Vec<(u32, u8, [f64; 2])> {
    let inside = works.modules.iter().filter_map(|((module, class), moved)| {
        Some((number(*module, grid)?, classes[usize::from(*class)], *moved)).filter(|_| *moved != [0.0; 2])
    });
    let mut all: Vec<(u32, u8, [f64; 2])> = inside.collect();
    all.sort_by_key(|(module, class, _)| (*module, *class));
    all
}

/// Where features lie far off the ground; `metres` gives easting and northing of a place.
pub(crate) fn far_off(
    works: &Earthworks,
    (grid, module_of): (ModuleGrid, &dyn Fn(Place) -> (i32, i32)),
    classes: &[u8],
    (name, metres): (impl Fn(FeatureId) -> String, impl Fn(Place) -> [f64; 2]),
) -> Vec<FeatureFarOff> {
    let told = works.far_off.iter().map(|far| FeatureFarOff {
        feature: name(far.id),
        class: classes[usize::from(far.class)],
        module: number(module_of(far.place), grid).unwrap_or(0),
        at_m: metres(far.place),
        off_m: metres_of_quanta(far.off),
        cause: far.cause,
    });
    told.collect()
}

/// The place of a load module in the area; one on the northern or eastern border is that inside of it.
fn number((row, col): (i32, i32), grid: ModuleGrid) -> Option<u32> {
    let (row, col) = (u32::try_from(row).ok()?, u32::try_from(col).ok()?);
    let inside = row <= grid.rows && col <= grid.cols;
    inside.then(|| grid.index(ModuleId { row: row.min(grid.rows - 1), col: col.min(grid.cols - 1) }) as u32)
}

/// Cubic metres cut and filled along each of some lines: what a feature moves between two stations counts for the line
/// that has the first of them, or else for that of the piece before it.
///
/// `places` are those of each line, each with the feature and the class of its line.
pub(crate) fn by_line(pieces: &[Moved], places: &[(FeatureId, u16, Vec<Place>)]) -> Vec<[f64; 2]> {
    let mut line_at: HashMap<(FeatureId, u16, Place), usize> = HashMap::new();
    let mut first: BTreeMap<(FeatureId, u16), usize> = BTreeMap::new();
    for (line, (id, class, places)) in places.iter().enumerate() {
        first.entry((*id, *class)).or_insert(line);
        for place in places {
            line_at.entry((*id, *class, *place)).or_insert(line);
        }
    }
    let mut moved = vec![[0.0; 2]; places.len()];
    let mut last: Option<((FeatureId, u16), usize)> = None;
    for piece in pieces {
        let of = (piece.id, piece.class);
        let here = piece.ends.iter().find_map(|place| line_at.get(&(piece.id, piece.class, *place)).copied());
        let before = last.filter(|(other, _)| *other == of).map(|(_, line)| line);
        let Some(line) = here.or(before).or_else(|| first.get(&of).copied()) else { continue };
        last = Some((of, line));
        moved[line].iter_mut().zip(piece.moved_m3).for_each(|(sum, more)| *sum += more);
    }
    moved
}

#[cfg(test)]
mod tests {
    use features::Numbering;

    use super::*;

    #[test]
    fn what_a_feature_moves_is_shared_out_among_its_lines() {
        let id = FeatureId { source: 0, numbering: Numbering::Way, number: 1 };
        let other = FeatureId { number: 2, ..id };
        let at = |col: i32| Place::new(0, col);
        let piece = |id, col, cut| Moved { id, class: 3, ends: [at(col), at(col + 1)], moved_m3: [cut, 1.0] };
        let pieces = [piece(id, 0, 2.0), piece(id, 1, 3.0), piece(id, 9, 4.0), piece(other, 2, 5.0)];
        let lines = [(id, 3, vec![at(0), at(5)]), (id, 3, vec![at(9), at(5)])];
        assert_eq!(by_line(&pieces, &lines), [[5.0, 2.0], [4.0, 1.0]]);
    }
}
