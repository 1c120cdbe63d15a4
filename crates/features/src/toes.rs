//! Benches: where the slopes beside a strip meet the ground, cut 1.5 : 1 and filled 2 : 1.

use std::collections::HashSet;

use crate::Place;
use crate::exact::Segment;
use crate::pieces::{Piece, moved, sides};
use crate::quarters::SegmentPairs;
use crate::strand::{Graded, Role, Strand};
use crate::strips::{Face, Room, Wide};

/// Run over rise of a cut.
pub const CUT_RUN: f64 = 1.5;

/// Run over rise of a fill.
pub const FILL_RUN: f64 = 2.0;

/// Metres from the edge of a road beyond which no slope reaches.
pub const ROADSIDE_REACH_M: f64 = 60.0;

/// A slope reaches no farther from the edge of its strip than this many widths.
const WIDTHS_MAX: f64 = 2.0;

/// The toe lines of all benches: along each side of a piece, as long as it is a strip of its whole width and its slope
/// meets the ground before another strip.
pub(crate) fn toes(graded: &Graded, pieces: &[Piece], wide: &[Wide], faces: &[Face]) -> Vec<Strand> {
    let network = graded.network;
    if !pieces.iter().any(|piece| piece.bench) {
        return Vec::new();
    }
    let sides = sides(network);
    let mut toes: Vec<Strand> = Vec::new();
    // Of each station, from which corner of the strip its slope falls.
    let mut corners: Vec<Vec<Place>> = Vec::new();
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
                corners.push(vec![corner]);
            }
        }
        for (strand, corner) in [(at, left_b), (at + 1, right_b)] {
            let next = toe(of.b, corner);
            let stations = &mut toes[strand].stations;
            if stations.last().map(|(place, _)| *place) != Some(next.0) {
                stations.push(next);
                corners[strand].push(corner);
            }
        }
        open = Some((of.piece, of.segment + 1, at));
    }
    end_at_strips(toes, &corners, faces)
}

/// What is left of toes of which no slope meets another strip than its own before the ground.
fn end_at_strips(toes: Vec<Strand>, corners: &[Vec<Place>], faces: &[Face]) -> Vec<Strand> {
    let slopes = toes.iter().zip(corners).flat_map(|(toe, corners)| corners.iter().zip(&toe.stations));
    let slopes: Vec<Segment> = slopes.map(|(&a, &(b, _))| Segment { a, b }).collect();
    let met = met_by_strips(&slopes, faces);
    let (mut ended, mut number) = (Vec::new(), 0);
    for toe in toes {
        let numbered: Vec<(u32, (Place, i32))> = (number..).zip(toe.stations).collect();
        number += numbered.len() as u32;
        for part in numbered.split(|(number, _)| met.contains(number)).filter(|part| 2 <= part.len()) {
            ended.push(Strand { stations: part.iter().map(|(_, station)| *station).collect(), ..toe });
        }
    }
    ended
}

/// The numbers of slopes that meet a strip which does not begin where they do.
fn met_by_strips(slopes: &[Segment], faces: &[Face]) -> HashSet<u32> {
    let count = slopes.len() as u32;
    let mut segments = slopes.to_vec();
    for face in faces.iter().filter(|face| !face.is_deck) {
        let ends = face.corners.iter().zip(face.corners.iter().cycle().skip(1));
        segments.extend(ends.map(|(&(a, _), &(b, _))| Segment { a, b }));
    }
    let mut met = HashSet::new();
    let pairs = SegmentPairs::of(&segments);
    for row in 0..pairs.rows() {
        pairs.in_row(row, &|number| number < count, &mut |slope, side| {
            if slope < count && count <= side {
                let [slope_of, side] = [slope, side].map(|number| segments[number as usize]);
                if !side.holds(slope_of.a) && side.crossing(&slope_of).is_some() {
                    met.insert(slope);
                }
            }
        });
    }
    met
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

#[cfg(test)]
mod tests {
    use crate::Form;
    use crate::samples::{formed_as, way};
    use crate::strand::Role;

    #[test]
    fn slopes_of_a_bench_end_at_the_strip_beside_it() {
        // 14 m apart on ground that rises 0.5 : 1, so that each slope would meet the ground beyond the other strip.
        let south = way(1, "highway=primary width=8", &[(10.0, 10.0), (40.0, 10.0)]);
        let north = way(2, "highway=track width=8", &[(10.0, 11.4), (40.0, 11.4)]);
        let formed = formed_as(vec![south, north], |_, north| 5.0 * north, Form::Bench);
        let toes = || formed.edges.iter().filter(|edge| edge.role == Role::Toe);
        let rows = |number: i64| {
            let ends = toes().filter(|edge| edge.id.number == number).flat_map(|edge| [edge.a, edge.b]);
            let mut rows: Vec<i32> = ends.map(|point| formed.points[point as usize].0.row).collect();
            rows.sort_unstable();
            rows.dedup();
            rows
        };
        let post = crate::samples::site().lattice.steps_per_post();
        assert!(matches!(rows(1)[..], [row] if row < 10 * post), "{:?}", rows(1));
        assert!(matches!(rows(2)[..], [row] if 11 * post < row), "{:?}", rows(2));
    }
}
