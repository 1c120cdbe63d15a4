//! Leaves out what no load module could hold, before anything is compared pair by pair.

use std::collections::HashMap;

use crate::clean::Notes;
use crate::ways::{Area, Way};
use crate::{Flaw, Place, Remark, Remedy, Site};

/// Segments of features in a load module: many times what its triangles could follow, and few enough to round them
/// with one another in little time, even where each crosses most others.
pub const SEGMENTS_PER_MODULE_MAX: u32 = 5_000;

type Counts = HashMap<(i32, i32), u32>;

/// Leaves out areas, then ways, the lowest class first, until no load module holds too many segments.
///
/// Both are in the order of their content, the highest class first.
pub fn leave_out_crowds(ways: &mut Vec<Way>, areas: &mut Vec<Area>, site: &Site, remarks: &mut Vec<Remark>) {
    let mut counts = Counts::new();
    let mut count = |places: &[Place]| {
        for place in places {
            *counts.entry(site.module_of(*place)).or_insert(0) += 1;
        }
    };
    ways.iter().for_each(|way| count(&way.places));
    areas.iter().flat_map(|area| &area.walks).for_each(|(walk, _)| count(walk));
    if counts.values().all(|count| *count <= SEGMENTS_PER_MODULE_MAX) {
        return;
    }
    let mut keep_ways = vec![true; ways.len()];
    for (number, way) in ways.iter().enumerate().rev() {
        if let Some(place) = relieve(&mut counts, site, way.places.iter()) {
            keep_ways[number] = false;
            let mut notes = Notes { id: way.id, lattice: site.lattice, remarks };
            notes.write_at(place, Flaw::Crowded, Remedy::LeftOut);
        }
    }
    let mut keep_areas = vec![true; areas.len()];
    for (number, area) in areas.iter().enumerate().rev() {
        if let Some(place) = relieve(&mut counts, site, area.walks.iter().flat_map(|(walk, _)| walk)) {
            keep_areas[number] = false;
            let mut notes = Notes { id: area.id, lattice: site.lattice, remarks };
            notes.write_at(place, Flaw::Crowded, Remedy::LeftOut);
        }
    }
    retain(ways, &keep_ways);
    retain(areas, &keep_areas);
}

/// Takes a feature out of the counts if one of its load modules is crowded; returns where.
fn relieve<'a>(counts: &mut Counts, site: &Site, places: impl Iterator<Item = &'a Place> + Clone) -> Option<Place> {
    let mut crowded = places.clone();
    let crowded = crowded.find(|place| SEGMENTS_PER_MODULE_MAX < counts[&site.module_of(**place)])?;
    for place in places {
        if let Some(count) = counts.get_mut(&site.module_of(*place)) {
            *count -= 1;
        }
    }
    Some(*crowded)
}

fn retain<T>(items: &mut Vec<T>, keep: &[bool]) {
    let mut keep = keep.iter();
    items.retain(|_| keep.next().copied().unwrap_or(true));
}
