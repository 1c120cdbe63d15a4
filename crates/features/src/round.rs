//! Brings mended features to the lattice: stations a post apart, a vertex on every tile and load-module line, and
//! lines that touch at shared vertices or not at all.

use std::collections::BTreeMap;

use terrain::Each;

use crate::clean::Notes;
use crate::exact::Segment;
use crate::gaps::family;
use crate::mend::Mended;
use crate::rings::{Ring, simple_rings};
use crate::snap::{Meeting, snap_round};
use crate::ways::Way;
use crate::{FeatureId, Flaw, Place, Remark, Remedy, Site, Storey, Traits};

/// A polygon whose rings are simple and touch one another at vertices only.
#[derive(Clone, Debug, PartialEq)]
pub struct Outline {
    /// What it is.
    pub traits: Traits,
    /// Its rings.
    pub rings: Vec<Ring>,
    /// Which feature it comes from.
    pub id: FeatureId,
}

impl Outline {
    /// The places of its rings, ring after ring.
    pub fn places(&self) -> impl Iterator<Item = Place> {
        self.rings.iter().flat_map(|ring| &ring.places).copied()
    }
}

/// Features on the lattice.
#[derive(Clone, Debug, PartialEq)]
pub struct Rounded {
    /// Lines: every place is a station.
    pub ways: Vec<Way>,
    /// Polygons.
    pub outlines: Vec<Outline>,
    /// What was changed.
    pub remarks: Vec<Remark>,
}

/// Puts in stations and shared vertices. Ways of different storeys do not see one another; outlines lie on the ground.
/// `each` runs what falls into pieces.
pub fn round(mended: Mended, site: &Site, each: Each) -> Rounded {
    let Mended { mut ways, areas, mut remarks } = mended;
    let mut groups: BTreeMap<Storey, Vec<usize>> = BTreeMap::new();
    for (number, way) in ways.iter().enumerate() {
        groups.entry(way.traits.storey).or_default().push(number);
    }
    groups.entry(Storey::Ground).or_default();
    let mut outlines = Vec::new();
    for (storey, numbers) in groups {
        let mut lines: Vec<Vec<Place>> =
            numbers.iter().map(|&number| with_stations(&ways[number].places, site)).collect();
        if storey == Storey::Ground {
            let walks = areas.iter().flat_map(|area| &area.walks);
            lines.extend(walks.map(|(walk, _)| {
                let closed: Vec<Place> = walk.iter().chain(walk.first()).copied().collect();
                with_stations(&closed, site)
            }));
        }
        let hot = line_crossings(&lines, site);
        let meetings = snap_round(&mut lines, &hot, each);
        remark_meetings(&meetings, &numbers, &ways, site, &mut remarks);
        let mut lines = lines.into_iter();
        for &number in &numbers {
            ways[number].places = lines.next().unwrap_or_default();
        }
        if storey == Storey::Ground {
            for area in &areas {
                let mut notes = Notes { id: area.id, lattice: site.lattice, remarks: &mut remarks };
                let walks: Vec<(Vec<Place>, bool)> =
                    area.walks.iter().zip(&mut lines).map(|((_, hole), line)| (opened(line), *hole)).collect();
                let rings = simple_rings(&walks, &mut notes);
                if rings.iter().all(|ring| ring.hole) {
                    notes.write_of(area.walks[0].0.first().copied(), Flaw::ZeroArea, Remedy::LeftOut);
                } else {
                    outlines.push(Outline { traits: area.traits, rings, id: area.id });
                }
            }
        }
    }
    Remark::sort(&mut remarks);
    Rounded { ways, outlines, remarks }
}

fn opened(mut walk: Vec<Place>) -> Vec<Place> {
    walk.pop();
    walk
}

/// A line with places at most one post apart, the same in both directions.
fn with_stations(line: &[Place], site: &Site) -> Vec<Place> {
    let post = i64::from(site.lattice.steps_per_post());
    let mut places = Vec::with_capacity(line.len());
    places.extend(line.first());
    for ends in line.windows(2) {
        let segment = Segment { a: ends[0], b: ends[1] };
        let length = (segment.a.squared_to(segment.b) as u64).isqrt() as i64;
        let parts = (length + post) / post;
        // Exactly n posts need n parts.
        let parts =
            if (parts - 1) * post * (parts - 1) * post == segment.a.squared_to(segment.b) { parts - 1 } else { parts };
        places.extend((1..parts).map(|part| segment.at(i128::from(part), i128::from(parts))));
        places.push(segment.b);
    }
    places
}

fn line_crossings(lines: &[Vec<Place>], site: &Site) -> Vec<Place> {
    let mut hot = Vec::new();
    for ends in lines.iter().flat_map(|line| line.windows(2)) {
        site.crossings(Segment { a: ends[0], b: ends[1] }, &mut |place| hot.push(place));
    }
    hot
}

/// Writes down crossings that became vertices: of a way with itself, and of two ways that had none there.
fn remark_meetings(meetings: &[Meeting], numbers: &[usize], ways: &[Way], site: &Site, remarks: &mut Vec<Remark>) {
    for meeting in meetings {
        let way = |line: u32| numbers.get(line as usize).map(|&number| &ways[number]);
        let (Some(one), Some(other)) = (way(meeting.one), way(meeting.other)) else { continue };
        let flaw = if meeting.one == meeting.other {
            Flaw::SelfCrossing
        } else if family(one.traits.kind) == family(other.traits.kind) {
            Flaw::CrossingUnjoined
        } else {
            continue;
        };
        let mut notes = Notes { id: other.id, lattice: site.lattice, remarks };
        notes.write_at(meeting.place, flaw, Remedy::VertexShared);
    }
}
