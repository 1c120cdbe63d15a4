//! Leaves out what no load module could hold, before anything is compared pair by pair.

use std::collections::HashMap;

use crate::clean::Notes;
use crate::exact::Segment;
use crate::ways::{Area, Way};
use crate::{Flaw, Place, Remark, Remedy, Site};

/// Stations of features in a load module of 20 x 20 posts or less, larger ones in proportion: many times what its
/// triangles could follow, and few enough to round them together in a second even where all of them cross.
pub const STATIONS_PER_MODULE_MAX: u32 = 2_000;

/// Posts a side of a load module that holds so many.
const MODULE_POSTS: u32 = 20;

/// How many stations a feature has in each load module.
type Counts = HashMap<(i32, i32), u32>;

/// Leaves out areas, then ways, the lowest class first, until no load module holds too many stations.
///
/// Both are in the order of their content, the highest class first.
pub fn leave_out_crowds(ways: &mut Vec<Way>, areas: &mut Vec<Area>, site: &Site, remarks: &mut Vec<Remark>) {
    let mut crowd = Crowd { counts: Counts::new(), most: most(site), site };
    ways.iter().for_each(|way| crowd.count(&[way.places.as_slice()]));
    for area in areas.iter() {
        area.walks.iter().for_each(|(walk, _)| crowd.count(&[walk.as_slice()]));
    }
    if crowd.counts.values().all(|count| *count <= crowd.most) {
        return;
    }
    let mut leave_out = |lines: &[&[Place]], id| {
        let place = crowd.relieve(lines);
        let mut notes = Notes { id, lattice: site.lattice, remarks };
        place.into_iter().for_each(|place| notes.write_at(place, Flaw::Crowded, Remedy::LeftOut));
        place.is_none()
    };
    let mut keep: Vec<bool> = ways.iter().rev().map(|way| leave_out(&[way.places.as_slice()], way.id)).collect();
    keep.reverse();
    retain(ways, &keep);
    let mut keep: Vec<bool> = Vec::with_capacity(areas.len());
    for area in areas.iter().rev() {
        let lines: Vec<&[Place]> = area.walks.iter().map(|(walk, _)| walk.as_slice()).collect();
        keep.push(leave_out(&lines, area.id));
    }
    keep.reverse();
    retain(areas, &keep);
}

/// The most stations a load module may hold.
fn most(site: &Site) -> u32 {
    let side = site.module_posts.unsigned_abs().max(MODULE_POSTS);
    (u64::from(STATIONS_PER_MODULE_MAX) * u64::from(side) * u64::from(side) / u64::from(MODULE_POSTS * MODULE_POSTS))
        .min(1 << 30) as u32
}

struct Crowd<'a> {
    counts: Counts,
    most: u32,
    site: &'a Site,
}

impl Crowd<'_> {
    fn count(&mut self, lines: &[&[Place]]) {
        let counts = &mut self.counts;
        stations(lines, self.site, &mut |module, _| *counts.entry(module).or_insert(0) += 1);
    }

    /// Takes a feature out of the counts if one of its load modules is crowded; returns where.
    fn relieve(&mut self, lines: &[&[Place]]) -> Option<Place> {
        let mut crowded = None;
        stations(lines, self.site, &mut |module, place| {
            if crowded.is_none() && self.most < self.counts[&module] {
                crowded = Some(place);
            }
        });
        if crowded.is_some() {
            let counts = &mut self.counts;
            stations(lines, self.site, &mut |module, _| *counts.entry(module).or_insert(1) -= 1);
        }
        crowded
    }
}

/// Calls `found` with about every station that lines will have, and its load module.
fn stations(lines: &[&[Place]], site: &Site, found: &mut impl FnMut((i32, i32), Place)) {
    let post = i64::from(site.lattice.steps_per_post());
    for ends in lines.iter().flat_map(|line| line.windows(2)) {
        let segment = Segment { a: ends[0], b: ends[1] };
        let parts = (segment.a.squared_to(segment.b) as u64).isqrt() as i64 / post + 1;
        for part in 1..=parts {
            let place = segment.at(i128::from(part), i128::from(parts));
            found(site.module_of(place), place);
        }
    }
}

fn retain<T>(items: &mut Vec<T>, keep: &[bool]) {
    let mut keep = keep.iter();
    items.retain(|_| keep.next().copied().unwrap_or(true));
}
