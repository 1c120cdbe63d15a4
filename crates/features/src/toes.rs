//! Benches: where the slopes beside a strip meet the ground, cut 1.5 : 1 and filled 2 : 1.

use crate::Place;
use crate::pieces::{Piece, moved, sides};
use crate::strand::{Graded, Role, Strand};
use crate::strips::{Face, Room, Wide};

/// Run over rise of a cut.
pub const CUT_RUN: f64 = 1.5;

/// Run over rise of a fill.
pub const FILL_RUN: f64 = 2.0;

/// A slope reaches no farther from the edge of its strip than this many widths.
const WIDTHS_MAX: f64 = 2.0;

/// The toe lines of all benches: along each side of a piece, as long as it is a strip of its whole width.
pub(crate) fn toes(graded: &Graded, pieces: &[Piece], wide: &[Wide], faces: &[Face]) -> Vec<Strand> {
    let network = graded.network;
    if !pieces.iter().any(|piece| piece.bench) {
        return Vec::new();
    }
    let sides = sides(network);
    let mut toes: Vec<Strand> = Vec::new();
    // Left and right of the present piece, and where both end.
    let mut open: Option<(u32, u32, usize)> = None;
    for face in faces.iter().filter(|face| face.corners.len() == 4 && !face.is_deck) {
        let Some(of) = face.wide.map(|number| wide[number as usize]) else { continue };
        let piece = &pieces[of.piece as usize];
        if !piece.bench || of.room != Room::Whole {
            continue;
        }
        let [right_a, right_b, left_b, left_a] = [0, 1, 2, 3].map(|corner| face.corners[corner].0);
        let toe = |node: u32, corner: Place| toe(graded, &sides, piece, node, corner);
        let goes_on = open.filter(|(number, segment, _)| (*number, *segment) == (of.piece, of.segment));
        let at = goes_on.map_or(toes.len(), |(_, _, at)| at);
        if goes_on.is_none() {
            for corner in [left_a, right_a] {
                let id = piece.id(network, of.segment as usize);
                let stations = vec![toe(of.a, corner)];
                toes.push(Strand { role: Role::Toe, class: piece.traits.class, id, stations });
            }
        }
        for (strand, corner) in [(at, left_b), (at + 1, right_b)] {
            let next = toe(of.b, corner);
            let stations = &mut toes[strand].stations;
            if stations.last().map(|(place, _)| *place) != Some(next.0) {
                stations.push(next);
            }
        }
        open = Some((of.piece, of.segment + 1, at));
    }
    toes.retain(|strand| 2 <= strand.stations.len());
    toes
}

/// Where the slope from a corner of a strip meets the ground, which goes on beyond the corner as it falls across.
fn toe(graded: &Graded, sides: &[[Place; 2]], piece: &Piece, node: u32, corner: Place) -> (Place, i32) {
    let Graded { network, heights, beside, .. } = *graded;
    let (place, height) = (network.nodes[node as usize].place, f64::from(heights[node as usize]));
    let [near, far] = sides_from(sides[node as usize], beside[node as usize], corner);
    let steps_per_quantum = 1.0 / f64::from(network.lattice.quanta_per_step());
    let width = f64::from(piece.traits.width);
    // Rise over run, outwards.
    let ground_slope = (near - far) / width;
    let (sign, slope) = if height < near { (1.0, 1.0 / CUT_RUN) } else { (-1.0, 1.0 / FILL_RUN) };
    let closing = slope - sign * ground_slope;
    let most = WIDTHS_MAX * width;
    let run = if closing <= 0.0 { most } else { ((near - height).abs() / closing).min(most) };
    let [east, north] = place.to(corner).map(|steps| steps as f64);
    let length = (east * east + north * north).sqrt().max(1e-9);
    let out = run * steps_per_quantum / length;
    let at = moved(corner, east * out, north * out);
    // What rounding leaves at the corner has the strip's own height.
    let rise = if at == corner { 0.0 } else { sign * run * slope };
    (at, (height + rise).round() as i32)
}

/// The ground at the side of a node nearer to a corner, and at the other side.
fn sides_from(places: [Place; 2], ground: [i32; 2], corner: Place) -> [f64; 2] {
    let first = places[0].squared_to(corner) <= places[1].squared_to(corner);
    let [near, far] = if first { ground } else { [ground[1], ground[0]] };
    [f64::from(near), f64::from(far)]
}
