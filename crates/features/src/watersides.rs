//! Ground beside water that lies off it: a slope leads from the water to what the DEM has.
//!
//! Ground is moved by as much as the nearest place of the water lies off the DEM, less the farther away, and no farther
//! than to the slope that leaves the water there. So a wall that the DEM has itself stays, and one spike of the DEM
//! under a river digs no crater. Of several pieces of water the farthest move counts, whatever their order.

use std::collections::HashMap;

use terrain::geometry::nearest_share;
use terrain::{LatticePoint, QUANTA_PER_METRE, Role, SideSlope, Vertex};

use crate::{Place, Strand};

/// Metres from water beyond which no slope reaches.
pub const WATERSIDE_REACH_M: f64 = 150.0;

/// Metres along the side of a cell in which pieces are looked up: most reach less far.
const CELL_M: f64 = 32.0;

/// Run over rise of the slope from water to the natural ground: that of dykes. A flatter one moves more of the roads
/// beside rivers far off the DEM.
const BANK_RUN: f64 = 2.0;

/// Pieces of channels, shores and banks that lie off the natural ground at one of their ends at least.
pub(crate) fn watersides(strands: &[Strand], ground: &dyn Fn(Place) -> Option<i32>) -> Vec<SideSlope> {
    let is_water = |strand: &&Strand| strand.role == Role::Channel || strand.role.is_outline() && strand.is_closed();
    let pieces = strands.iter().filter(is_water).flat_map(|strand| strand.stations.windows(2));
    let waterside = |pair: &[(Place, i32)]| {
        let ends = [pair[0], pair[1]].map(|(place, height)| Vertex { at: place.into(), height });
        let ground = [ground(pair[0].0)?, ground(pair[1].0)?];
        (ends.map(|end| end.height) != ground).then_some(SideSlope { ends, ground })
    };
    pieces.filter_map(waterside).collect()
}

/// Pieces of water by cells of the plane, to find those that move the ground at a place.
pub struct Watersides<'a> {
    metres_per_step: f64,
    side: i32,
    cells: HashMap<(i32, i32), Vec<&'a SideSlope>>,
}

impl<'a> Watersides<'a> {
    /// Of pieces on a lattice with so many metres a step.
    pub fn of(pieces: &'a [SideSlope], metres_per_step: f64) -> Self {
        let side = (CELL_M / metres_per_step).ceil() as i32;
        let mut cells: HashMap<(i32, i32), Vec<&SideSlope>> = HashMap::new();
        for piece in pieces {
            let run = offs(piece).map(run_of).into_iter().fold(0.0, f64::max);
            let reach = (run / f64::from(QUANTA_PER_METRE) / metres_per_step).ceil() as i32;
            let span = |a: i32, b: i32| (a.min(b) - reach).div_euclid(side)..=(a.max(b) + reach).div_euclid(side);
            let [a, b] = piece.ends.map(|end| end.at);
            for row in span(a.row, b.row) {
                span(a.col, b.col).for_each(|col| cells.entry((row, col)).or_default().push(piece));
            }
        }
        Self { metres_per_step, side, cells }
    }

    /// The height of the ground at a place, in quanta, of which the DEM says `natural`.
    pub fn ground(&self, at: LatticePoint, natural: i32) -> i32 {
        let cell = (at.row.div_euclid(self.side), at.col.div_euclid(self.side));
        let (mut lowered, mut lifted) = (0.0_f64, 0.0_f64);
        for piece in self.cells.get(&cell).into_iter().flatten() {
            let by = self.moved(piece, at, natural.into());
            (lowered, lifted) = (lowered.min(by), lifted.max(by));
        }
        natural + (lowered + lifted + 0.5).floor() as i32
    }

    /// By how many quanta a piece moves the ground at a place, upwards.
    fn moved(&self, piece: &SideSlope, at: LatticePoint, natural: f64) -> f64 {
        let (steps, share) = nearest_on(piece.ends, at);
        let along = |[a, b]: [f64; 2]| a + share * (b - a);
        let (water, off) = (along(piece.ends.map(|end| f64::from(end.height))), along(offs(piece)));
        moved_beside([water, off], [run_of(off), steps * self.metres_per_step * f64::from(QUANTA_PER_METRE)], natural)
    }
}

/// By how many quanta ground of which the DEM says `natural` is moved upwards, so far `away` from an edge at some
/// height, above which the DEM lies by `off` there; the slope ends after `run`; all in quanta.
pub(crate) fn moved_beside([height, off]: [f64; 2], [run, away]: [f64; 2], natural: f64) -> f64 {
    if run <= away {
        return 0.0;
    }
    let (far, up) = (off.abs(), off.signum());
    let to_slope = (natural - height) * up - far * away / run;
    -up * to_slope.min(far * (1.0 - away / run)).max(0.0)
}

/// Quanta by which the natural ground lies above both ends of an edge.
pub fn offs(piece: &SideSlope) -> [f64; 2] {
    [0, 1].map(|end| f64::from(piece.ground[end] - piece.ends[end].height))
}

/// Quanta from water within which ground is moved.
fn run_of(off: f64) -> f64 {
    (off.abs() * BANK_RUN).min(WATERSIDE_REACH_M * f64::from(QUANTA_PER_METRE))
}

/// How far, in steps, a place lies from an edge, and the share of the edge that lies before the place nearest to it.
pub fn nearest_on([a, b]: [Vertex; 2], at: LatticePoint) -> (f64, f64) {
    let to = |end: LatticePoint| [end.col - a.at.col, end.row - a.at.row].map(f64::from);
    let ([along_x, along_y], [x, y]) = (to(b.at), to(at));
    let share = nearest_share([along_x, along_y], [x, y]);
    let (off_x, off_y) = (x - share * along_x, y - share * along_y);
    ((off_x * off_x + off_y * off_y).sqrt(), share)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A stream along row 0 with steps of a metre: the ground every 10 m away from it.
    fn beside_stream(height: i32, known: i32, natural: impl Fn(i32) -> i32) -> Vec<i32> {
        let ends = [-200, 400].map(|col| Vertex { at: LatticePoint::new(0, col), height });
        let pieces = [SideSlope { ends, ground: [known; 2] }];
        let all = Watersides::of(&pieces, 1.0);
        (0..20).map(|at| all.ground(LatticePoint::new(10 * at, 100), natural(at))).collect()
    }

    #[test]
    fn ground_slopes_to_water_that_lies_off_it_and_is_as_it_was_beyond() {
        // 12 m of cut or fill reach 24 m.
        let (cut, fill) = (beside_stream(-12 * 128, 0, |_| 0), beside_stream(12 * 128, 0, |_| 0));
        assert_eq!(cut[..4], [-1536, -896, -256, 0]);
        assert!(cut.iter().zip(&fill).all(|(cut, fill)| *cut == -fill), "{fill:?}");
        // No slope reaches beyond 150 m, however high.
        assert_eq!(
            beside_stream(0, 500 * 128, |_| 500 * 128)[9..16],
            [38_400, 42_667, 46_933, 51_200, 55_467, 59_733, 64_000]
        );
    }

    #[test]
    fn walls_of_the_dem_stay_as_steep_and_a_spike_under_water_digs_no_crater() {
        let wall = |at: i32| at * 20 * 128;
        assert_eq!(beside_stream(0, 0, wall), (0..20).map(wall).collect::<Vec<_>>());
        let lowered = beside_stream(0, 6 * 128, |at| 6 * 128 + wall(at));
        assert_eq!(lowered[..3], [0, 25 * 128, 46 * 128]);
        assert_eq!(beside_stream(0, 60 * 128, |at| if at == 0 { 60 * 128 } else { 0 }), [0; 20]);
    }
}
