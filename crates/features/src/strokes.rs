//! Strokes: stretches of one class that continue one another, as a person would follow them on a map.
//!
//! At a joint those of one name continue each other, then the straightest pairs that turn by no more than 45 degrees;
//! each is taken once.

use std::cmp::Reverse;

use crate::strand::{Graded, Strand};
use crate::stretches::{Arm, Part, Stretches};
use crate::{Kind, Place, Site};

/// The cosine of the greatest turn of two that continue each other without a name.
const STRAIGHT: f64 = std::f64::consts::FRAC_1_SQRT_2;

/// Stretches that continue one another, each with whether it runs against the stroke.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Stroke {
    pub stretches: Vec<(u32, bool)>,
    /// Quanta long, inside the area; of water twice its area.
    pub size: i128,
}

/// All strokes in the order in which they are granted room: main kinds before all others, then by kind, the longest
/// first, then by place.
pub(crate) fn strokes(stretches: &Stretches, graded: &Graded, strands: &[Strand], site: &Site) -> Vec<Stroke> {
    let mates = mates(stretches, graded, strands);
    let count = stretches.all.len();
    let mut done = vec![false; count];
    let mut strokes = Vec::new();
    // Those that end somewhere first, then those that are closed.
    for closed in [false, true] {
        for stretch in 0..count as u32 {
            for last in [false, true] {
                if !done[stretch as usize] && (closed || mates[end(stretch, last)].is_none()) {
                    strokes.push(walk(stretches, &mates, (stretch, last), &mut done));
                }
            }
        }
    }
    let key = |stroke: &Stroke| {
        let first = &stretches.all[stroke.stretches[0].0 as usize];
        let places = stroke.stretches.iter().map(|(stretch, _)| *stretch);
        let is_ring = 0 < first.doubled_area;
        (!first.is_main(site), rank(first.kind), is_ring, Reverse(stroke.size), first.class, places.min())
    };
    strokes.sort_by_cached_key(key);
    strokes
}

/// The row of a kind in the table.
fn rank(kind: Kind) -> usize {
    Kind::ALL.iter().position(|other| *other == kind).unwrap_or(Kind::ALL.len())
}

fn end(stretch: u32, last: bool) -> usize {
    2 * stretch as usize + usize::from(last)
}

fn walk(stretches: &Stretches, mates: &[Option<Arm>], from: (u32, bool), done: &mut [bool]) -> Stroke {
    let (mut at, mut stroke) = (from, Stroke { stretches: Vec::new(), size: 0 });
    loop {
        let (stretch, against) = at;
        done[stretch as usize] = true;
        let of = &stretches.all[stretch as usize];
        stroke.stretches.push((stretch, against));
        stroke.size += if of.doubled_area == 0 { i128::from(of.length) } else { of.doubled_area };
        // It is left at its first joint where it runs against the stroke.
        match mates[end(stretch, !against)] {
            Some(next) if !done[next.stretch as usize] => at = (next.stretch, next.last),
            _ => return stroke,
        }
    }
}

/// What continues each end of each stretch.
fn mates(stretches: &Stretches, graded: &Graded, strands: &[Strand]) -> Vec<Option<Arm>> {
    let mut mates = vec![None; 2 * stretches.all.len()];
    for arms in stretches.by_joint().filter(|arms| 1 < arms.len()) {
        let ways: Vec<[f64; 2]> = arms.iter().map(|arm| unit(stretches, graded, strands, *arm)).collect();
        let mut pairs: Vec<(bool, f64, usize, usize)> = Vec::new();
        for one in 0..arms.len() {
            for other in one + 1..arms.len() {
                let [a, b] = [one, other].map(|at| &stretches.all[arms[at].stretch as usize]);
                let cosine = -(ways[one][0] * ways[other][0] + ways[one][1] * ways[other][1]);
                let is_named = a.name != 0 && a.name == b.name;
                let fits = a.kind == b.kind && a.class == b.class && a.is_inside == b.is_inside;
                if fits && arms[one].stretch != arms[other].stretch && (is_named || STRAIGHT <= cosine) {
                    pairs.push((!is_named, cosine, one, other));
                }
            }
        }
        pairs.sort_by(|a, b| a.0.cmp(&b.0).then(b.1.total_cmp(&a.1)).then((a.2, a.3).cmp(&(b.2, b.3))));
        for (_, _, one, other) in pairs {
            let ends = [one, other].map(|at| end(arms[at].stretch, arms[at].last));
            if ends.iter().all(|end| mates[*end].is_none()) {
                mates[ends[0]] = Some(arms[other]);
                mates[ends[1]] = Some(arms[one]);
            }
        }
    }
    mates
}

/// The direction in which a stretch leaves a joint.
fn unit(stretches: &Stretches, graded: &Graded, strands: &[Strand], arm: Arm) -> [f64; 2] {
    let ends = |count: usize| if arm.last { [count - 1, count - 2] } else { [0, 1] };
    let places: [Place; 2] = match &stretches.all[arm.stretch as usize].part {
        Part::Way(nodes, _) => ends(nodes.len()).map(|at| graded.network.nodes[nodes[at] as usize].place),
        Part::Strands(numbers) => {
            let stations = &strands[numbers[0] as usize].stations;
            ends(stations.len()).map(|at| stations[at].0)
        }
    };
    let [east, north] = places[0].to(places[1]).map(|steps| steps as f64);
    let length = (east * east + north * north).sqrt().max(1.0);
    [east / length, north / length]
}
