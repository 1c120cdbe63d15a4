//! Longitudes come around: rasters on both sides of the 180th meridian, or of which some count to 360 and others from
//! -180, are brought to one run of longitudes before they are joined.

use crate::RasterFrame;

/// Degrees by which a run must be shorter for anything to be shifted: what rounding loses is far less.
const SHORTER_BY: f64 = 1.0e-6;

/// Degrees to add to each of some stretches of longitude, from west to east, so that all lie in the shortest run that
/// holds them. These are multiples of 360, and 0 for the first; all are 0 where no run is shorter than the present one.
pub fn turns(stretches: &[[f64; 2]]) -> Vec<f64> {
    let plain = stretches
        .iter()
        .fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], &[west, east]| [low.min(west), high.max(east)]);
    // From 0 to 360 by where each begins; a run begins where one of them does, and has those before it a turn later.
    let mut around: Vec<(usize, [f64; 2])> = stretches
        .iter()
        .map(|&[west, east]| (west.rem_euclid(360.0), east - west))
        .map(|(west, wide)| [west, west + wide])
        .enumerate()
        .collect();
    around.sort_by(|(_, a), (_, b)| a[0].total_cmp(&b[0]));
    let mut east_from = vec![f64::NEG_INFINITY; around.len() + 1];
    for (at, (_, [_, east])) in around.iter().enumerate().rev() {
        east_from[at] = east_from[at + 1].max(*east);
    }
    let (mut shortest, mut east_before) = ((plain[1] - plain[0] - SHORTER_BY, None), f64::NEG_INFINITY);
    for (at, &(_, [west, east])) in around.iter().enumerate() {
        let long = east_from[at].max(east_before + 360.0) - west;
        if long < shortest.0 {
            shortest = (long, Some(at));
        }
        east_before = east_before.max(east);
    }
    let mut turns = vec![0.0; stretches.len()];
    let Some(first) = shortest.1 else { return turns };
    for (at, &(index, [west, _])) in around.iter().enumerate() {
        let later = if at < first { 360.0 } else { 0.0 };
        turns[index] = ((west + later - stretches[index][0]) / 360.0).round() * 360.0;
    }
    let of_first = turns[0];
    turns.iter_mut().for_each(|turn| *turn -= of_first);
    turns
}

/// Brings rasters in degrees to one run of longitudes, as [`turns`] has it; others stay where they are.
pub(crate) fn to_one_run<'a>(frames: impl Iterator<Item = &'a mut RasterFrame>) {
    let mut frames: Vec<&mut RasterFrame> = frames.filter(|frame| frame.crs.is_geographic()).collect();
    let stretches: Vec<[f64; 2]> =
        frames.iter().map(|frame| [0, frame.cols - 1].map(|col| frame.place(0, col)[0])).collect();
    for (frame, turn) in frames.iter_mut().zip(turns(&stretches)) {
        frame.south_west[0] += turn;
    }
}

/// Brings a line or ring in degrees that crosses the 180th meridian to one run of longitudes. A step of more than half
/// a turn can only mean the crossing, as each side is drawn the shorter way; one of a whole turn is the side of a box
/// of the whole Earth. Rings round a pole have no such run and stay as they are.
pub(crate) fn unwrap<const N: usize>(run: &mut [[f64; N]]) {
    let crosses = |pair: &[[f64; N]]| {
        let step = pair[1][0] - pair[0][0];
        180.0 < step.abs() && step.abs() < 360.0
    };
    if !run.windows(2).any(crosses) {
        return;
    }
    let is_ring = run.first().zip(run.last()).is_some_and(|(first, last)| first[..2] == last[..2]);
    let mut turn = 0.0;
    let turns: Vec<f64> = run
        .windows(2)
        .map(|pair| {
            let step = pair[1][0] - pair[0][0];
            turn -= if crosses(pair) { 360.0_f64.copysign(step) } else { 0.0 };
            turn
        })
        .collect();
    if is_ring && turn != 0.0 {
        return;
    }
    for (vertex, turn) in run[1..].iter_mut().zip(turns) {
        vertex[0] += turn;
    }
}

/// The same of the rings of a polygon; its holes stay in it.
pub(crate) fn unwrap_polygon<const N: usize>(rings: &mut [Vec<[f64; N]>]) {
    rings.iter_mut().for_each(|ring| unwrap(ring));
    let Some((outer, holes)) = rings.split_first_mut() else { return };
    let middle = |ring: &[[f64; N]]| {
        let (low, high) = ring
            .iter()
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), vertex| (low.min(vertex[0]), high.max(vertex[0])));
        (low + high) / 2.0
    };
    let outer = middle(outer);
    for hole in holes {
        let turn = ((outer - middle(hole)) / 360.0).round() * 360.0;
        if turn != 0.0 {
            hole.iter_mut().for_each(|vertex| vertex[0] += turn);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn check(stretches: &[[f64; 2]], expected: &[f64]) {
        assert_eq!(turns(stretches), expected, "{stretches:?}");
    }

    #[test]
    fn stretches_lie_in_the_shortest_run_with_the_first_as_it_was() {
        check(&[], &[]);
        check(&[[179.0, 180.0], [-180.0, -179.0]], &[0.0, 360.0]);
        check(&[[-180.0, -179.0], [179.0, 180.0]], &[0.0, -360.0]);
        check(&[[241.9, 242.0], [-118.0, -117.9]], &[0.0, 360.0]);
        check(&[[359.9, 360.0], [0.0, 0.1], [-0.2, -0.1]], &[0.0, 360.0, 360.0]);
        check(&[[-170.0, -160.0], [150.0, 170.0], [175.0, 185.0], [-200.0, -190.0]], &[0.0, -360.0, -360.0, 0.0]);
    }

    #[test]
    fn what_lies_in_a_run_or_goes_all_around_is_not_turned() {
        check(&[[-117.0, -116.0], [-116.0, -115.0]], &[0.0, 0.0]);
        check(&[[200.0, 210.0], [190.0, 200.0]], &[0.0, 0.0]);
        check(&[[5.0, 6.0]], &[0.0]);
        let world: Vec<[f64; 2]> = (-180..180).map(|west| [f64::from(west), f64::from(west) + 0.999]).collect();
        check(&world, &[0.0; 360]);
        check(&[[-180.0, 180.0], [10.0, 11.0]], &[0.0, 0.0]);
    }

    #[test]
    fn lines_and_rings_across_the_180th_meridian_lie_in_one_run() {
        let run = |longitudes: &[f64]| {
            let mut run: Vec<[f64; 3]> = longitudes.iter().map(|&east| [east, 0.0, f64::NAN]).collect();
            unwrap(&mut run);
            run.iter().map(|vertex| vertex[0]).collect::<Vec<f64>>()
        };
        assert_eq!(run(&[179.5, -179.5, -179.0, 179.75]), [179.5, 180.5, 181.0, 179.75]);
        assert_eq!(run(&[-179.5, 179.5, 179.0]), [-179.5, -180.5, -181.0]);
        assert_eq!(run(&[179.5, -179.5, 179.5]), [179.5, 180.5, 179.5], "a ring");
        for as_they_are in [&[359.5, 360.5][..], &[-180.0, 180.0, -180.0], &[-100.0, 0.0, 100.0, -100.0], &[], &[7.0]] {
            assert_eq!(run(as_they_are), as_they_are, "round a pole, round the Earth, or no crossing");
        }
        let ring = |longitudes: [f64; 3]| longitudes.map(|east| [east, 0.0, 0.0]).to_vec();
        let mut rings = [ring([179.0, -179.0, 179.0]), ring([-179.5, -179.25, -179.5])];
        unwrap_polygon(&mut rings);
        assert_eq!(rings[1], ring([180.5, 180.75, 180.5]), "a hole in it");
    }
}
