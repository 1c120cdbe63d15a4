//! Edges of features one after another, as lines.

use std::collections::BTreeMap;

use features::{FormedEdge, Role};

/// Edges one after another, as far as exactly two meet. Those of channels run downstream, others from the least end on.
pub(crate) fn chains(edges: &[&FormedEdge]) -> Vec<Vec<u32>> {
    if edges.iter().any(|edge| edge.role == Role::Channel) {
        return downstream(edges);
    }
    let mut beside: BTreeMap<u32, Vec<(u32, usize)>> = BTreeMap::new();
    for (number, edge) in edges.iter().enumerate() {
        beside.entry(edge.a).or_default().push((edge.b, number));
        beside.entry(edge.b).or_default().push((edge.a, number));
    }
    let mut done = vec![false; edges.len()];
    let mut chains = Vec::new();
    // Open ends and forks first; what is left are rings.
    for through in [false, true] {
        for (&from, next) in &beside {
            if (next.len() == 2) != through {
                continue;
            }
            for &(to, number) in next {
                if done[number] {
                    continue;
                }
                done[number] = true;
                let mut chain = vec![from, to];
                let mut at = to;
                while let [one, other] = beside[&at][..]
                    && let Some(&(to, number)) = [one, other].iter().find(|(_, number)| !done[*number])
                {
                    done[number] = true;
                    chain.push(to);
                    at = to;
                }
                chains.push(chain);
            }
        }
    }
    chains
}

/// Edges of channels from where no single one flows to its beginning, as long as a single one flows on.
fn downstream(edges: &[&FormedEdge]) -> Vec<Vec<u32>> {
    let directed = edges.iter().map(|edge| if edge.backwards { (edge.b, edge.a) } else { (edge.a, edge.b) });
    let mut onward: BTreeMap<u32, Vec<(u32, usize)>> = BTreeMap::new();
    let mut degree: BTreeMap<u32, [u32; 2]> = BTreeMap::new();
    for (number, (from, to)) in directed.enumerate() {
        onward.entry(from).or_default().push((to, number));
        degree.entry(from).or_default()[0] += 1;
        degree.entry(to).or_default()[1] += 1;
    }
    let mut done = vec![false; edges.len()];
    let mut chains = Vec::new();
    // Beginnings first; what is left are circles.
    for in_circle in [false, true] {
        for (&from, next) in &onward {
            if (degree[&from] == [1, 1]) != in_circle {
                continue;
            }
            for &(to, number) in next {
                let mut chain = vec![from];
                let mut step = Some((to, number)).filter(|(_, number)| !done[*number]);
                while let Some((to, number)) = step {
                    done[number] = true;
                    chain.push(to);
                    let follows = onward.get(&to).filter(|_| degree[&to] == [1, 1]);
                    step = follows.map(|next| next[0]).filter(|(_, number)| !done[*number]);
                }
                chains.extend((1 < chain.len()).then_some(chain));
            }
        }
    }
    chains
}
