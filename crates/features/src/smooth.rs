//! Smooths the ground along ways where it is noisy: a height of the DEM at a station is no better than its neighbours.

use crate::Network;

/// Stations that a chain has within reach at least, or else they keep their heights.
const STATIONS_MIN: usize = 3;

/// A DEM is noisy along ways whose grade changes by more than this at half of their stations, in parts per million:
/// hardly a road is built so.
const NOISY_PPM: i64 = 20_000;

/// Thousandths of a post over which noisy ground is smoothed either side.
const MILLIPOSTS: u32 = 2000;

/// A chain's lengths are counted in so many units to its reach at most, so that no sum overflows.
const UNITS_MAX: i64 = 1 << 12;

/// Heights smoothed along chains on the ground: at each station that of the straight line that fits those within reach
/// best, in weighted squares. Ends of chains keep theirs, and reach is less beside them.
///
/// `reach` is in thousandths of a post; without it the noise of `raw` heights decides, for each part of the network by
/// itself.
pub fn smooth(network: &Network, heights: &[Option<i32>], raw: &[Option<i32>], reach: Option<u32>) -> Vec<Option<i32>> {
    let mut smoothed = heights.to_vec();
    let on_ground = |edge: u32| network.is_ground(edge);
    let follows = |node: u32| match network.beside(node) {
        [(_, one), (_, other)] => on_ground(*one) && on_ground(*other),
        _ => false,
    };
    let chains = network.runs(&on_ground, &follows);
    let noisy = match reach {
        None => noisy(network, &chains, raw),
        Some(_) => Vec::new(),
    };
    let post = i64::from(network.lattice.steps_per_post()) * i64::from(network.lattice.quanta_per_step());
    for (nodes, edges) in &chains {
        let usual = || if noisy[nodes[0] as usize] { MILLIPOSTS } else { 0 };
        let reach = post * i64::from(reach.unwrap_or_else(usual)) / 1000;
        let known: Option<Vec<i32>> = nodes.iter().map(|node| heights[*node as usize]).collect();
        let (Some(known), true) = (known, 0 < reach) else { continue };
        let along = along(network, edges);
        for at in 1..nodes.len() - 1 {
            smoothed[nodes[at] as usize] = Some(straightened(&along, &known, at, reach));
        }
    }
    smoothed
}

/// Quanta from the first node of a chain to each of them.
fn along(network: &Network, edges: &[u32]) -> Vec<i64> {
    let mut along = vec![0i64];
    edges.iter().for_each(|edge| along.push(along[along.len() - 1] + i64::from(network.edges[*edge as usize].length)));
    along
}

/// The height at a station of the line that fits those within reach best: squares weighted by nearness, and by the
/// length that each stands for.
fn straightened(along: &[i64], heights: &[i32], at: usize, reach: i64) -> i32 {
    let here = along[at];
    let reach = reach.min(here).min(along[along.len() - 1] - here);
    let first = along[..at].partition_point(|other| *other <= here - reach);
    let end = at + along[at..].partition_point(|other| *other < here + reach);
    if end - first < STATIONS_MIN {
        return heights[at];
    }
    let unit = (reach / UNITS_MAX).max(1);
    let [mut s0, mut s1, mut s2, mut b0, mut b1] = [0i128; 5];
    for other in first..end {
        let beside = along[(other + 1).min(along.len() - 1)] - along[other.saturating_sub(1)];
        let x = (along[other] - here) / unit;
        let weight = i128::from((reach / unit - x.abs()).max(0)) * i128::from(beside / unit);
        let (x, height) = (i128::from(x), i128::from(heights[other]));
        s0 += weight;
        s1 += weight * x;
        s2 += weight * x * x;
        b0 += weight * height;
        b1 += weight * x * height;
    }
    let (rise, run) = (b0 * s2 - b1 * s1, s0 * s2 - s1 * s1);
    if run <= 0 { heights[at] } else { (2 * rise + run).div_euclid(2 * run) as i32 }
}

/// Whether each node belongs to a part of the network along which the DEM is noisy.
fn noisy(network: &Network, chains: &[(Vec<u32>, Vec<u32>)], raw: &[Option<i32>]) -> Vec<bool> {
    let part = network.parts();
    let post = i64::from(network.lattice.steps_per_post()) * i64::from(network.lattice.quanta_per_step());
    let mut changes: Vec<Vec<i64>> = vec![Vec::new(); part.iter().map(|part| *part as usize + 1).max().unwrap_or(0)];
    for (nodes, edges) in chains {
        let length = |at: usize| i64::from(network.edges[edges[at] as usize].length);
        for at in 1..nodes.len() - 1 {
            let (before, after) = (length(at - 1), length(at));
            let [from, here, to] = [at - 1, at, at + 1].map(|at| raw[nodes[at] as usize].map(i64::from));
            if let (Some(from), Some(here), Some(to)) = (from, here, to)
                && post <= 2 * before.min(after)
            {
                let grade = |rise: i64, length: i64| rise * 1_000_000 / length;
                changes[part[nodes[at] as usize] as usize]
                    .push((grade(to - here, after) - grade(here - from, before)).abs());
            }
        }
    }
    let is_noisy = |changes: &mut Vec<i64>| {
        changes.sort_unstable();
        changes.get(changes.len() / 2).is_some_and(|median| NOISY_PPM < *median)
    };
    let noisy: Vec<bool> = changes.iter_mut().map(is_noisy).collect();
    part.iter().map(|part| noisy[*part as usize]).collect()
}

/// Heights of all nodes: where there is none, that of the nearest node, in edges, that has one; 0 where none is near.
pub(crate) fn filled(network: &Network, heights: &[Option<i32>]) -> Vec<i32> {
    let mut filled = heights.to_vec();
    let mut front: Vec<u32> = (0..heights.len() as u32).filter(|node| heights[*node as usize].is_some()).collect();
    while !front.is_empty() {
        let mut next = Vec::new();
        for node in front {
            for &(beside, _) in network.beside(node) {
                if filled[beside as usize].is_none() {
                    filled[beside as usize] = filled[node as usize];
                    next.push(beside);
                }
            }
        }
        next.sort_unstable();
        front = next;
    }
    filled.into_iter().map(|height| height.unwrap_or(0)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::samples::{network, way};

    #[test]
    fn a_slope_stays_and_a_spike_on_it_is_worn_down() {
        let along: Vec<i64> = (0..9).map(|at| 100 * at).collect();
        let slope: Vec<i32> = (0..9).map(|at| 7 * at).collect();
        for at in 1..8 {
            assert_eq!(straightened(&along, &slope, at, 250), slope[at]);
        }
        let mut spike = slope.clone();
        spike[4] += 100;
        let found = straightened(&along, &spike, 4, 300);
        assert!((slope[4] + 20..slope[4] + 40).contains(&found), "{found}");
        assert_eq!(straightened(&along, &spike, 4, 100), spike[4], "nothing else is in reach");
    }

    #[test]
    fn only_noisy_ground_is_smoothed_unless_it_is_asked_for() {
        let road = || vec![way(1, "highway=primary", &[(10.0, 10.0), (40.0, 10.0)])];
        let hill = |east: f64, _: f64| (east / 9.0).sin() * 3.0;
        let (of, heights, _) = network(road(), hill);
        assert_eq!(smooth(&of, &heights, &heights, None), heights);
        assert_ne!(smooth(&of, &heights, &heights, Some(3000)), heights);
        let (of, heights, _) = network(road(), |east, _| (east * east * 7919.0) % 13.0);
        assert_ne!(smooth(&of, &heights, &heights, None), heights);
    }
}
