//! Lines of places in metres: smoothed, thinned, cut. Only `+ - * /` and square roots, so that they are the same on
//! any machine.

/// A place, metres east and north of the terrain's origin.
pub(super) type Place = [f64; 2];

pub(super) fn between(a: Place, b: Place, share: f64) -> Place {
    [a[0] + (b[0] - a[0]) * share, a[1] + (b[1] - a[1]) * share]
}

pub(super) fn distance(a: Place, b: Place) -> f64 {
    let (dx, dy) = (b[0] - a[0], b[1] - a[1]);
    (dx * dx + dy * dy).sqrt()
}

pub(super) fn length(line: &[Place]) -> f64 {
    line.windows(2).map(|leg| distance(leg[0], leg[1])).sum()
}

/// Leaves out each place that lies within its `aside_m` metres of the rest (Douglas and Peucker).
pub(super) fn thin(line: &[Place], aside_m: &[f64]) -> Vec<Place> {
    let mut kept = vec![false; line.len()];
    let mut spans = vec![(0, line.len() - 1)];
    while let Some((first, last)) = spans.pop() {
        (kept[first], kept[last]) = (true, true);
        let aside = |at: usize| aside_of(line[at], line[first], line[last]) / aside_m[at];
        let farthest = (first + 1..last).map(|at| (aside(at), at)).reduce(|a, b| if a.0 < b.0 { b } else { a });
        if let Some((_, at)) = farthest.filter(|(aside, _)| 1.0 < *aside) {
            spans.extend([(first, at), (at, last)]);
        }
    }
    line.iter().zip(kept).filter_map(|(place, kept)| kept.then_some(*place)).collect()
}

/// Metres from `p` to the segment from `a` to `b`.
fn aside_of(p: Place, a: Place, b: Place) -> f64 {
    let (dx, dy) = (b[0] - a[0], b[1] - a[1]);
    let length2 = dx * dx + dy * dy;
    let along = if length2 == 0.0 { 0.0 } else { ((p[0] - a[0]) * dx + (p[1] - a[1]) * dy) / length2 };
    distance(p, between(a, b, along.clamp(0.0, 1.0)))
}

/// Rounds corners: each is cut a quarter into its legs, but no farther than `cut_m`, again and again. Ends stay.
pub(super) fn round_corners(line: &[Place], cut_m: f64, rounds: usize) -> Vec<Place> {
    let (mut line, mut cut_m) = (line.to_vec(), cut_m);
    for _ in 0..rounds {
        let mut next = vec![line[0]];
        for corner in line.windows(3) {
            for end in [corner[0], corner[2]] {
                let leg_m = distance(corner[1], end);
                next.push(between(corner[1], end, 0.25_f64.min(cut_m / leg_m.max(1e-6))));
            }
        }
        next.push(line[line.len() - 1]);
        (line, cut_m) = (next, 0.5 * cut_m);
    }
    line
}

/// Draws every place but the ends towards the middle of its neighbours.
pub(super) fn relax(line: &[Place], rounds: usize) -> Vec<Place> {
    let mut line = line.to_vec();
    for _ in 0..rounds {
        let inner = line.windows(3).map(|near| between(near[1], between(near[0], near[2], 0.5), 0.5));
        let next = [line[0]].into_iter().chain(inner).chain([line[line.len() - 1]]);
        line = next.collect();
    }
    line
}

/// Leaves out places nearer than `apart_m` to the one before. Ends stay.
pub(super) fn space_out(line: &[Place], apart_m: f64) -> Vec<Place> {
    let (first, last) = (line[0], line[line.len() - 1]);
    let mut kept = vec![first];
    for &place in &line[1..line.len() - 1] {
        if apart_m <= distance(kept[kept.len() - 1], place) && 0.5 * apart_m <= distance(place, last) {
            kept.push(place);
        }
    }
    kept.push(last);
    kept
}

/// Shares of the way along each of two segments at which they cross; `None` where they do not, or only touch in line.
pub(super) fn crossing([a, b]: [Place; 2], [c, d]: [Place; 2]) -> Option<(f64, f64)> {
    let (ab, cd, ac) = ([b[0] - a[0], b[1] - a[1]], [d[0] - c[0], d[1] - c[1]], [c[0] - a[0], c[1] - a[1]]);
    let cross = |u: [f64; 2], v: [f64; 2]| u[0] * v[1] - u[1] * v[0];
    let all = cross(ab, cd);
    if all == 0.0 {
        return None;
    }
    let (s, t) = (cross(ac, cd) / all, cross(ac, ab) / all);
    ((0.0..=1.0).contains(&s) && (0.0..=1.0).contains(&t)).then_some((s, t))
}

/// Takes out loops: where a line crosses itself, it goes straight on.
pub(super) fn without_loops(line: &[Place]) -> Vec<Place> {
    /// Legs over which a loop is looked for.
    const LEGS: usize = 80;
    let mut kept: Vec<Place> = Vec::with_capacity(line.len());
    for &place in line {
        if let Some(&last) = kept.last() {
            let legs = kept.len() - 1;
            let loops = (legs.saturating_sub(LEGS)..legs.saturating_sub(1))
                .find_map(|leg| Some((leg, crossing([kept[leg], kept[leg + 1]], [last, place])?)));
            if let Some((leg, (share, _))) = loops {
                let at = between(kept[leg], kept[leg + 1], share);
                kept.truncate(leg + 1);
                kept.push(at);
            }
        }
        kept.push(place);
    }
    kept.dedup();
    kept
}

/// The part of a line between two distances in metres from its first place, its ends exactly there.
pub(super) fn part(line: &[Place], from_m: f64, to_m: f64) -> Vec<Place> {
    const SHORT_M: f64 = 10.0;
    let (mut gone_m, mut kept) = (0.0, vec![place_at(line, from_m)]);
    for leg in line.windows(2) {
        gone_m += distance(leg[0], leg[1]);
        // No leg shorter than a few metres.
        if from_m + SHORT_M < gone_m && gone_m < to_m - SHORT_M {
            kept.push(leg[1]);
        }
    }
    kept.push(place_at(line, to_m));
    kept.dedup();
    kept
}

/// The place a distance along a line; its ends beyond them.
pub(super) fn place_at(line: &[Place], along_m: f64) -> Place {
    let mut left_m = along_m;
    for leg in line.windows(2) {
        let leg_m = distance(leg[0], leg[1]);
        if left_m <= 0.0 {
            return leg[0];
        }
        if left_m < leg_m {
            return between(leg[0], leg[1], left_m / leg_m);
        }
        left_m -= leg_m;
    }
    line[line.len() - 1]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_that_crosses_itself_goes_straight_on() {
        let loops = [[0.0, 0.0], [10.0, 0.0], [10.0, 5.0], [5.0, 5.0], [5.0, -5.0]];
        assert_eq!(without_loops(&loops), [[0.0, 0.0], [5.0, 0.0], [5.0, -5.0]]);
        let open = [[0.0, 0.0], [10.0, 0.0], [10.0, 5.0], [5.0, 5.0], [5.0, 1.0]];
        assert_eq!(without_loops(&open), open);
    }

    #[test]
    fn thinning_keeps_what_lies_farther_aside_than_it_may() {
        let line = [[0.0, 0.0], [10.0, 3.0], [20.0, 0.0], [30.0, 3.0], [40.0, 0.0]];
        assert_eq!(thin(&line, &[4.0; 5]), [[0.0, 0.0], [40.0, 0.0]]);
        assert_eq!(thin(&line, &[4.0, 2.0, 4.0, 4.0, 4.0]), [[0.0, 0.0], [10.0, 3.0], [40.0, 0.0]]);
    }

    #[test]
    fn rounding_and_spacing_out_keep_both_ends() {
        let line = [[0.0, 0.0], [100.0, 0.0], [100.0, 100.0]];
        let round = round_corners(&line, 40.0, 3);
        assert_eq!((round[0], round[round.len() - 1]), (line[0], line[2]));
        assert!(round.iter().all(|place| distance(*place, [100.0, 0.0]) > 5.0), "the corner is cut");
        let spaced = space_out(&round, 30.0);
        assert_eq!((spaced[0], spaced[spaced.len() - 1]), (line[0], line[2]));
        assert!(spaced.windows(2).all(|leg| 14.9 < distance(leg[0], leg[1])));
    }

    #[test]
    fn a_part_of_a_line_ends_where_it_is_cut() {
        let line = [[0.0, 0.0], [100.0, 0.0], [100.0, 100.0]];
        assert_eq!(part(&line, 50.0, 150.0), [[50.0, 0.0], [100.0, 0.0], [100.0, 50.0]]);
        assert_eq!(part(&line, 0.0, 200.0), line);
        assert_eq!(place_at(&line, 130.0), [100.0, 30.0]);
    }
}
