//! Smooths the ground along a way: a height of the DEM at a station is no better than its neighbours.

use crate::Network;

/// Most stations either side: beyond them weights are next to nothing.
const STATIONS_MAX: usize = 8;

/// Heights smoothed along chains over twice the width either side, with binomial weights.
///
/// Stations where chains begin and end keep theirs, and so do those near stations without a height.
pub fn smooth(network: &Network, ground: &[Option<i32>]) -> Vec<Option<i32>> {
    let mut smoothed = ground.to_vec();
    for chain in network.chains() {
        let reach = 2 * i64::from(chain.traits.width);
        let mut along = vec![0i64];
        for &edge in &chain.edges {
            along.push(along[along.len() - 1] + i64::from(network.edges[edge as usize].length));
        }
        for at in 1..chain.nodes.len() - 1 {
            let near = |other: usize| (along[at] - along[other]).abs() <= reach;
            let west = (1..=at.min(STATIONS_MAX)).take_while(|by| near(at - by)).count();
            let east = (1..=(chain.nodes.len() - 1 - at).min(STATIONS_MAX)).take_while(|by| near(at + by)).count();
            let each = west.min(east);
            let heights = chain.nodes[at - each..=at + each].iter().map(|node| ground[*node as usize]);
            if let Some(heights) = heights.collect::<Option<Vec<i32>>>().filter(|_| 0 < each) {
                smoothed[chain.nodes[at] as usize] = Some(binomial_mean(&heights));
            }
        }
    }
    smoothed
}

/// The mean of an odd number of heights with binomial weights, rounded half up.
fn binomial_mean(heights: &[i32]) -> i32 {
    let order = heights.len() as i64 - 1;
    let (mut weight, mut sum) = (1i64, 0i64);
    for (at, &height) in (0i64..).zip(heights) {
        sum += weight * i64::from(height);
        weight = weight * (order - at) / (at + 1);
    }
    let all = 1i64 << order;
    (2 * sum + all).div_euclid(2 * all) as i32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_are_binomial() {
        assert_eq!(binomial_mean(&[7]), 7);
        assert_eq!(binomial_mean(&[0, 4, 0]), 2);
        assert_eq!(binomial_mean(&[0, 0, 16, 0, 0]), 6);
        assert_eq!(binomial_mean(&[5; 17]), 5);
    }
}
