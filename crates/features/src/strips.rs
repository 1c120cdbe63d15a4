//! Edges of strips: at every station a left and a right corner, where neighbouring edges meet, at the station's height.
//!
//! ```text
//!        left ──────┬────── left          At a station of two segments both share the corners; where more meet,
//!   a ──────────────b──────────────c      the corners between neighbouring arms are a polygon of their own.
//!       right ──────┴────── right
//! ```

use crate::pieces::{Piece, STRIP_STEPS_MIN, moved, strip_width};
use crate::rings::doubled_area;
use crate::{FeatureId, Network, Place};

/// A mitre reaches no farther from its station than this many half widths: twice the width.
const MITRE_HALVES_MAX: f64 = 4.0;

/// A corner reaches no farther along a segment than this share of its length.
const ALONG_SHARE_MAX: f64 = 0.49;

/// Arms whose directions differ from straight on by less than this (as a cross product of units) have one side.
const STRAIGHT_MAX: f64 = 0.02;

/// Arms that lead apart by more than 135 degrees (as a dot product of units) are one road, and a corner between them
/// lies at their mean width: sides of two widths meet far along it, and the road would be level along itself.
const ONWARD_MAX: f64 = -0.7;

/// How wide a segment is, after others of higher class took their room.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(crate) enum Room {
    Whole,
    Half,
    None,
}

impl Room {
    /// The next less.
    pub fn less(self) -> Self {
        if self == Self::Whole { Self::Half } else { Self::None }
    }
}

/// A segment of a piece that is a strip.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Wide {
    pub piece: u32,
    pub segment: u32,
    pub a: u32,
    pub b: u32,
    pub room: Room,
}

/// A convex or at least simple polygon of a feature, its corners counter-clockwise, each with a height in quanta.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Face {
    /// Its class.
    pub class: u16,
    /// Which feature it comes from.
    pub id: FeatureId,
    /// Corners, the first not repeated.
    pub corners: Vec<(Place, i32)>,
    /// Whether it is part of a deck and not of the ground.
    pub is_deck: bool,
    /// The stations of its centreline, of a segment; none for a junction.
    pub centreline: Option<[Place; 2]>,
    /// Nodes of the network it belongs to.
    pub(crate) nodes: Vec<u32>,
    /// Which strip segment it is; none for a junction.
    pub(crate) wide: Option<u32>,
}

impl Face {
    /// The places of its corners.
    pub fn places(&self) -> Vec<Place> {
        self.corners.iter().map(|(place, _)| *place).collect()
    }
}

/// Whether a segment of a piece is a strip that has room; `wide` as [`wide_segments`] has it.
pub(crate) fn has_room(wide: &[Wide], piece: u32, segment: u32) -> bool {
    let found = wide.binary_search_by_key(&(piece, segment), |of| (of.piece, of.segment));
    found.is_ok_and(|number| wide[number].room != Room::None)
}

/// The segments of pieces that are strips, on the ground or on decks, in the order of pieces and segments.
pub(crate) fn wide_segments(pieces: &[Piece]) -> Vec<Wide> {
    let mut wide = Vec::new();
    for (piece, of) in pieces.iter().enumerate() {
        for segment in (0..of.strips.len()).filter(|&segment| of.strips[segment]) {
            let (a, b) = (of.nodes[segment], of.nodes[segment + 1]);
            wide.push(Wide { piece: piece as u32, segment: segment as u32, a, b, room: Room::Whole });
        }
    }
    wide
}

/// An arm of a station: a strip segment as seen from there.
#[derive(Clone, Copy)]
pub(crate) struct Arm {
    node: u32,
    wide: u32,
    /// Whether the station is the segment's last.
    last: bool,
    /// Steps to either side where it has all of its room.
    half: f64,
    length: f64,
    /// Unit vector away from the station.
    unit: [f64; 2],
    to: [i64; 2],
}

/// The faces of all strips: one for each segment that has room, one for each junction of three and more. `all` are the
/// [`arms`] of `wide`.
pub(crate) fn faces(network: &Network, pieces: &[Piece], (wide, all): (&[Wide], &[Arm]), heights: &[i32]) -> Vec<Face> {
    let mut corners: Vec<[[Place; 2]; 2]> = vec![[[Place::new(0, 0); 2]; 2]; wide.len()];
    let (mut junctions, mut at_node) = (Vec::new(), Vec::new());
    for all_at_node in all.chunk_by(|a, b| a.node == b.node) {
        at_node.clear();
        at_node.extend(all_at_node.iter().filter_map(|arm| arm.within(wide[arm.wide as usize].room)));
        let Some(&Arm { node, .. }) = at_node.first() else { continue };
        let place = network.nodes[node as usize].place;
        let count = at_node.len();
        // The corner counter-clockwise of each arm.
        let between: Vec<Place> = (0..count).map(|at| corner(place, at_node[at], at_node[(at + 1) % count])).collect();
        for (at, arm) in at_node.iter().enumerate() {
            let (left, right) = match count {
                1 => (beside(place, arm, 1.0), beside(place, arm, -1.0)),
                _ => (between[at], between[(at + count - 1) % count]),
            };
            // Seen from the segment's other end, left is right.
            corners[arm.wide as usize][usize::from(arm.last)] = if arm.last { [right, left] } else { [left, right] };
        }
        if 2 < count {
            let piece = |arm: &Arm| &pieces[wide[arm.wide as usize].piece as usize];
            let highest = at_node.iter().min_by_key(|arm| (piece(arm).is_deck(), piece(arm).traits.class));
            let of = &wide[highest.map_or(0, |arm| arm.wide) as usize];
            junctions.push(face(
                network,
                pieces,
                of,
                between.iter().map(|p| (*p, heights[node as usize])).collect(),
                vec![node],
            ));
        }
    }
    let mut faces = Vec::new();
    for (number, of) in wide.iter().enumerate().filter(|(_, of)| of.room != Room::None) {
        let [[left_a, right_a], [left_b, right_b]] = corners[number];
        let (a, b) = (heights[of.a as usize], heights[of.b as usize]);
        let ring = vec![(right_a, a), (right_b, b), (left_b, b), (left_a, a)];
        let mut face = face(network, pieces, of, ring, vec![of.a, of.b]);
        face.wide = Some(number as u32);
        face.centreline = Some([of.a, of.b].map(|node| network.nodes[node as usize].place));
        faces.push(face);
    }
    faces.extend(junctions);
    // What rounding turned inside out is no strip.
    faces.retain(|face| 0 < doubled_area(&face.places()));
    faces
}

fn face(network: &Network, pieces: &[Piece], of: &Wide, mut corners: Vec<(Place, i32)>, nodes: Vec<u32>) -> Face {
    let piece = &pieces[of.piece as usize];
    corners.dedup_by_key(|(place, _)| *place);
    while 1 < corners.len() && corners.first().map(|corner| corner.0) == corners.last().map(|corner| corner.0) {
        corners.pop();
    }
    let (class, id) = (piece.traits.class, piece.id(network, of.segment as usize));
    Face { class, id, corners, is_deck: piece.is_deck(), nodes, wide: None, centreline: None }
}

/// The arms of all strip segments, whatever room they have: by station, and counter-clockwise.
pub(crate) fn arms(network: &Network, pieces: &[Piece], wide: &[Wide]) -> Vec<Arm> {
    let mut arms = Vec::with_capacity(2 * wide.len());
    for (number, of) in (0..).zip(wide) {
        let width = strip_width(&pieces[of.piece as usize].traits, network.lattice);
        let half = f64::from(width) / f64::from(network.lattice.quanta_per_step()) / 2.0;
        for (node, other, last) in [(of.a, of.b, false), (of.b, of.a, true)] {
            let to = network.nodes[node as usize].place.to(network.nodes[other as usize].place);
            let [east, north] = to.map(|steps| steps as f64);
            let length = (east * east + north * north).sqrt();
            let unit = [east / length, north / length];
            arms.push(Arm { node, wide: number, last, half, length, unit, to });
        }
    }
    arms.sort_by(|a, b| a.node.cmp(&b.node).then_with(|| by_angle(a.to, b.to)).then(a.wide.cmp(&b.wide)));
    arms
}

impl Arm {
    /// It with the room that is left to its segment; none where that is none.
    fn within(&self, room: Room) -> Option<Self> {
        let half = match room {
            Room::Whole => self.half,
            Room::Half => (self.half / 2.0).max(f64::from(STRIP_STEPS_MIN) / 2.0),
            Room::None => return None,
        };
        Some(Self { half, ..*self })
    }
}

/// Counter-clockwise from the east, exactly.
fn by_angle(a: [i64; 2], b: [i64; 2]) -> std::cmp::Ordering {
    let upper = |[east, north]: [i64; 2]| !(0 < north || (north == 0 && 0 < east));
    upper(a).cmp(&upper(b)).then_with(|| (b[0] * a[1]).cmp(&(a[0] * b[1])))
}

/// Half a width beside a station, on the left of an arm (1) or on its right (-1).
fn beside(place: Place, arm: &Arm, sign: f64) -> Place {
    moved(place, -sign * arm.half * arm.unit[1], sign * arm.half * arm.unit[0])
}

/// The corner between an arm and the next one counter-clockwise: where the left side of the one meets the right side
/// of the other, no farther away than a mitre may reach and no farther along than half of either arm.
fn corner(place: Place, mut arm: Arm, mut next: Arm) -> Place {
    let (u, v) = (arm.unit, next.unit);
    let cross = u[0] * v[1] - u[1] * v[0];
    let dot = u[0] * v[0] + u[1] * v[1];
    if dot < ONWARD_MAX {
        let mean = (arm.half + next.half) / 2.0;
        (arm.half, next.half) = (mean, mean);
    }
    let (left, right) = ([-arm.half * u[1], arm.half * u[0]], [next.half * v[1], -next.half * v[0]]);
    let straight = cross.abs() < STRAIGHT_MAX && dot < 0.0;
    let [mut east, mut north] = if straight {
        [(left[0] + right[0]) / 2.0, (left[1] + right[1]) / 2.0]
    } else if cross.abs() < 1e-9 {
        // Two arms in one direction: nothing lies between them.
        [u[0] * arm.half, u[1] * arm.half]
    } else {
        [(u[0] * next.half + v[0] * arm.half) / cross, (u[1] * next.half + v[1] * arm.half) / cross]
    };
    let reach = (east * east + north * north).sqrt();
    let mut scale = (MITRE_HALVES_MAX * arm.half.max(next.half) / reach.max(1e-9)).min(1.0);
    for (unit, length) in [(u, arm.length), (v, next.length)] {
        let along = east * unit[0] + north * unit[1];
        if ALONG_SHARE_MAX * length < along * scale {
            scale = ALONG_SHARE_MAX * length / along;
        }
    }
    east *= scale;
    north *= scale;
    moved(place, east, north)
}
