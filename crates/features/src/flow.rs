//! The order in which water flows through a network: circles first found (R. Tarjan, 1972), then from source to mouth.

/// A directed graph of flow: each node's targets.
pub(crate) struct Flow {
    starts: Vec<u32>,
    targets: Vec<u32>,
}

impl Flow {
    /// The graph of edges from a node to another.
    pub fn of(nodes: usize, edges: &[(u32, u32)]) -> Self {
        let mut starts = vec![0u32; nodes + 1];
        edges.iter().for_each(|(from, _)| starts[*from as usize + 1] += 1);
        (1..=nodes).for_each(|node| starts[node] += starts[node - 1]);
        let (mut next, mut targets) = (starts.clone(), vec![0; edges.len()]);
        for &(from, to) in edges {
            targets[next[from as usize] as usize] = to;
            next[from as usize] += 1;
        }
        Self { starts, targets }
    }

    /// Where water flows from a node.
    pub fn targets(&self, node: u32) -> &[u32] {
        &self.targets[self.starts[node as usize] as usize..self.starts[node as usize + 1] as usize]
    }

    /// Groups of nodes that flow in a circle, each node in one group, a group before those it flows to.
    pub fn groups(&self) -> Vec<Vec<u32>> {
        let count = self.starts.len() - 1;
        let mut search = Search {
            index: vec![u32::MAX; count],
            low: vec![0; count],
            on_stack: vec![false; count],
            stack: Vec::new(),
            groups: Vec::new(),
            next: 0,
        };
        for node in 0..count as u32 {
            if search.index[node as usize] == u32::MAX {
                search.visit(self, node);
            }
        }
        search.groups.reverse();
        search.groups
    }
}

struct Search {
    index: Vec<u32>,
    low: Vec<u32>,
    on_stack: Vec<bool>,
    stack: Vec<u32>,
    groups: Vec<Vec<u32>>,
    next: u32,
}

impl Search {
    fn enter(&mut self, node: u32) {
        self.index[node as usize] = self.next;
        self.low[node as usize] = self.next;
        self.next += 1;
        self.stack.push(node);
        self.on_stack[node as usize] = true;
    }

    fn visit(&mut self, flow: &Flow, root: u32) {
        let mut calls: Vec<(u32, usize)> = vec![(root, 0)];
        self.enter(root);
        while let Some((node, at)) = calls.pop() {
            if let Some(&target) = flow.targets(node).get(at) {
                calls.push((node, at + 1));
                if self.index[target as usize] == u32::MAX {
                    self.enter(target);
                    calls.push((target, 0));
                } else if self.on_stack[target as usize] {
                    self.low[node as usize] = self.low[node as usize].min(self.index[target as usize]);
                }
                continue;
            }
            if let Some((parent, _)) = calls.last() {
                self.low[*parent as usize] = self.low[*parent as usize].min(self.low[node as usize]);
            }
            if self.low[node as usize] == self.index[node as usize] {
                let first = self.stack.iter().rposition(|other| *other == node).unwrap_or(0);
                let group: Vec<u32> = self.stack.drain(first..).collect();
                group.iter().for_each(|member| self.on_stack[*member as usize] = false);
                self.groups.push(group);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_group_comes_before_those_it_flows_to_and_a_circle_is_one_group() {
        let flow = Flow::of(6, &[(5, 0), (0, 1), (1, 2), (2, 0), (2, 3), (4, 3)]);
        let mut groups = flow.groups();
        let place = |groups: &[Vec<u32>], node: u32| groups.iter().position(|group| group.contains(&node)).unwrap();
        assert!(place(&groups, 5) < place(&groups, 0) && place(&groups, 2) < place(&groups, 3));
        assert!(place(&groups, 4) < place(&groups, 3));
        groups.iter_mut().for_each(|group| group.sort());
        assert!(groups.contains(&vec![0, 1, 2]));
    }
}
