//! Buildings of the sources of features, as blocks that are drawn only: no height of the ground depends on them.

use features::building_heights;
use source_files::{VectorFeature, VectorShape, Vertices};
use store::{BUILDING_UNITS_PER_METRE, Building};

use crate::ground::area::GamingArea;

/// Buildings of an area at most: about 100 bytes each in memory, and 30 in the file.
const BUILDINGS_MAX: usize = 1 << 21;
/// Corners of a building at most: the largest halls and terraces have some hundreds.
const CORNERS_MAX: usize = 2048;
/// Twice the least area of a footprint, in its units squared: a square metre.
const TWICE_AREA_MIN: i64 = 2 * (BUILDING_UNITS_PER_METRE as i64) * (BUILDING_UNITS_PER_METRE as i64);

/// Adds those of `found` that stand in the area.
pub(crate) fn add(found: &[VectorFeature], area: &GamingArea, buildings: &mut Vec<Building>) {
    let room = BUILDINGS_MAX.saturating_sub(buildings.len());
    buildings.extend(found.iter().filter_map(|feature| building(feature, area)).take(room));
}

/// In an order that does not depend on that of the sources, each once.
pub(crate) fn settle(buildings: &mut Vec<Building>) {
    buildings.sort_unstable();
    buildings.dedup();
    buildings.shrink_to_fit();
}

/// A polygon with the tags of a building, whose middle lies in the area.
fn building(feature: &VectorFeature, area: &GamingArea) -> Option<Building> {
    let heights = building_heights(|key| feature.tag(key))?;
    let VectorShape::Polygon(rings) = &feature.shape else { return None };
    if CORNERS_MAX < rings.iter().map(|ring| ring.places.len()).sum() {
        return None;
    }
    let mut placed = Vec::with_capacity(rings.len());
    for (index, ring) in rings.iter().enumerate() {
        match ring_of(ring, area, index == 0) {
            Some(ring) => placed.push(ring),
            // Without its outer ring there is nothing to have courtyards.
            None if index == 0 => return None,
            None => {}
        }
    }
    let (bottom, top) = (units(heights.bottom_m)?, units(heights.top_m)?);
    (stands_inside(&placed[0], area) && bottom < top).then_some(Building { rings: placed, bottom, top })
}

/// A ring in units from the area's south-west corner, the outer one counter-clockwise, others clockwise; `None` where
/// it encloses nothing.
fn ring_of(ring: &Vertices, area: &GamingArea, is_outer: bool) -> Option<Vec<[i32; 2]>> {
    let spacing = area.frame.spacing.metres();
    let corner = [
        area.frame.origin_east_m + f64::from(area.rect.west) * spacing,
        area.frame.origin_north_m + f64::from(area.rect.south) * spacing,
    ];
    let mut placed = Vec::with_capacity(ring.places.len());
    for place in &ring.places {
        let at = [0, 1].map(|axis| units(place[axis] - corner[axis]));
        let [Some(east), Some(north)] = at else { return None };
        if placed.last() != Some(&[east, north]) {
            placed.push([east, north]);
        }
    }
    if placed.first() == placed.last() {
        placed.pop();
    }
    let twice = twice_area(&placed);
    if placed.len() < 3 || twice.abs() < TWICE_AREA_MIN {
        return None;
    }
    if (0 < twice) != is_outer {
        placed.reverse();
    }
    Some(placed)
}

/// A length in the units of buildings; `None` beyond what 32 bits hold.
fn units(metres: f64) -> Option<i32> {
    let units = (metres * f64::from(BUILDING_UNITS_PER_METRE)).round();
    (units.abs() <= f64::from(i32::MAX)).then_some(units as i32)
}

/// Twice the area that a ring encloses, positive where it runs counter-clockwise.
fn twice_area(ring: &[[i32; 2]]) -> i64 {
    let Some(&[east, north]) = ring.first() else { return 0 };
    let from = |[x, y]: [i32; 2]| [i64::from(x) - i64::from(east), i64::from(y) - i64::from(north)];
    let next = ring.iter().cycle().skip(1);
    ring.iter().zip(next).map(|(&a, &b)| (from(a), from(b))).map(|(a, b)| a[0] * b[1] - a[1] * b[0]).sum()
}

/// Whether the middle of a ring's extent lies in the area.
fn stands_inside(ring: &[[i32; 2]], area: &GamingArea) -> bool {
    let units = |cells: f64| cells * area.frame.spacing.metres() * f64::from(BUILDING_UNITS_PER_METRE);
    let reach = [units(area.rect.cells_wide() as f64), units(area.rect.cells_high() as f64)];
    [0, 1].into_iter().all(|axis| {
        let along = ring.iter().map(|corner| i64::from(corner[axis]));
        let (low, top) = (along.clone().min().unwrap_or(0), along.max().unwrap_or(0));
        let middle = (low + top) as f64 / 2.0;
        0.0 <= middle && middle < reach[axis]
    })
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use job::Job;

    use super::*;

    const JOB: &str = "[area]\nname = \"a\"\ncrs = \"EPSG:32611\"\norigin_m = [1000, 2000]\nsize_m = [5000, 5000]\n\
        spacing_m = 25\n[dem]\nsource = \"sample\"\n";

    fn area() -> GamingArea {
        GamingArea::new(&Job::from_text(JOB, Path::new("a.toml")).unwrap()).unwrap()
    }

    fn polygon(rings: &[&[[f64; 2]]], value: &str) -> VectorFeature {
        let ring = |places: &&[[f64; 2]]| Vertices { places: places.to_vec(), heights_m: Vec::new() };
        VectorFeature {
            id: "way/1".into(),
            tags: vec![("building".into(), value.into())],
            shape: VectorShape::Polygon(rings.iter().map(ring).collect()),
        }
    }

    /// A closed square with its south-west corner at a place, clockwise.
    fn square([east, north]: [f64; 2], side: f64) -> [[f64; 2]; 5] {
        [[0.0, 0.0], [0.0, side], [side, side], [side, 0.0], [0.0, 0.0]].map(|[x, y]| [east + x, north + y])
    }

    fn found(features: &[VectorFeature]) -> Vec<Building> {
        let mut buildings = Vec::new();
        add(features, &area(), &mut buildings);
        settle(&mut buildings);
        buildings
    }

    #[test]
    fn a_footprint_runs_counter_clockwise_from_the_areas_corner_and_its_courtyard_the_other_way() {
        let house = polygon(&[&square([1010.0, 2020.0], 10.0), &square([1012.0, 2022.0], 4.0)], "yes");
        let expected = Building {
            rings: vec![
                vec![[160, 160], [160, 240], [80, 240], [80, 160]],
                vec![[96, 176], [96, 208], [128, 208], [128, 176]],
            ],
            bottom: 0,
            top: 48,
        };
        let all = found(&[house.clone(), house]);
        assert_eq!(all.len(), 1, "what two sources have is there once");
        assert_eq!(all[0].rings.iter().map(|ring| twice_area(ring).signum()).collect::<Vec<_>>(), [1, -1]);
        let sorted = |building: &Building| {
            let mut rings = building.rings.clone();
            rings.iter_mut().for_each(|ring| ring.sort_unstable());
            (rings, building.bottom, building.top)
        };
        assert_eq!(sorted(&all[0]), sorted(&expected));
    }

    #[test]
    fn what_lies_outside_is_too_small_or_is_no_building_is_left_out() {
        let outside = polygon(&[&square([900.0, 2500.0], 10.0)], "yes");
        let tiny = polygon(&[&square([1100.0, 2500.0], 0.5)], "yes");
        let no = polygon(&[&square([1100.0, 2500.0], 10.0)], "no");
        let line = VectorFeature {
            shape: VectorShape::Line(Vertices { places: square([1100.0, 2500.0], 10.0).to_vec(), heights_m: vec![] }),
            ..outside.clone()
        };
        let over_the_border = polygon(&[&square([996.0, 2500.0], 10.0)], "yes");
        assert_eq!(found(&[outside, tiny, no, line]), []);
        assert_eq!(found(&[over_the_border]).len(), 1);
    }
}
