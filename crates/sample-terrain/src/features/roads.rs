//! Which roads there are: the network of one cell of 64 km, on nodes 400 m apart.
//!
//! Highways cross the cell from gate to gate, places on its border that neighbouring cells agree on, and keep to the
//! basins. Then every 8 km some place wants a road: the lowest saddle of a range, joined to the roads on both sides of
//! it; a camp in a plain, joined to two roads; a mine in the mountains, joined to one. Cheapest paths use roads that
//! are there already, so that ways meet and run on together.

use crate::noise::Stream;
use crate::playa::Playa;
use crate::region::Region;

use super::ground::Ground;
use super::lattice::{Cost, Node, STEP_M, least_cost_path, place, step_cost};

/// Steps of the lattice of the ground a side of a cell.
pub(super) const CELL: i64 = COARSE * (WIDE as i64 - 1);
/// Steps between the nodes of roads.
pub(super) const COARSE: i64 = 4;
/// Nodes of roads a side of a cell, those of all four borders included.
pub(super) const WIDE: usize = 161;

/// Nodes between places that want a road.
const WANT: usize = 20;
/// Such places a side of a cell.
const WANTS: usize = (WIDE - 1) / WANT;
/// Nodes from a road within which no place wants another.
const NEAR: usize = 5;
/// Nodes that the two joints of a place's roads lie apart.
const APART: usize = 12;
/// Nodes beside the first road to a place on which the second one is dear.
const BESIDE: usize = 4;
/// Times the cost of the first way for the second one to be worth it.
const DETOUR: f64 = 2.5;
/// Seed layers: of gates, and of wanted places, in two rounds.
const LAYERS: [u64; 3] = [60, 61, 64];

/// What a road is, the lowest first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Class {
    Track,
    Minor,
    Secondary,
    Primary,
}

/// The eight neighbours of a node, counter-clockwise from east: columns, rows.
const DIRECTIONS: [(isize, isize); 8] = [(1, 0), (1, 1), (0, 1), (-1, 1), (-1, 0), (-1, -1), (0, -1), (1, -1)];

/// Nodes of one class between two at which a road begins, ends, meets others or changes.
#[derive(Clone, Debug)]
pub(super) struct Chain {
    pub(super) class: Class,
    /// Numbers of nodes in the cell.
    pub(super) nodes: Vec<usize>,
}

/// The network of a cell.
pub(super) struct Roads {
    /// Cell number, east and north.
    pub(super) cell: (i64, i64),
    /// Roads from every node in all directions.
    links: Vec<[Option<Class>; 8]>,
    height_m: Vec<f32>,
    bedrock_m: Vec<f32>,
    is_closed: Vec<bool>,
}

/// How a road is laid out.
#[derive(Clone, Copy)]
struct Style {
    class: Class,
    /// Grade that costs as much as the way itself.
    grade: f64,
    /// What a stretch costs where there is a road already.
    reuse: f64,
}

impl Roads {
    /// Lays out the roads of a cell.
    pub(super) fn of(ground: &mut Ground, cell: (i64, i64)) -> Self {
        let corner = place((cell.0 * CELL, cell.1 * CELL));
        let side_m = CELL as f64 * STEP_M;
        let playas = ground.playas((corner[0], corner[1]), (side_m, side_m));
        let mut roads = Self::without(&ground.region, &playas, cell);
        roads.lay_highways(ground);
        let squares = || (0..WANTS).flat_map(|row| (0..WANTS).map(move |col| (row, col)));
        for (row, col) in squares() {
            if let Some(saddle) = roads.lowest_saddle(row * WANT, col * WANT) {
                roads.lay_wanted(saddle, Class::Track, true);
            }
        }
        let rounds = [1, 2].map(|round| Stream::new(ground.seed, LAYERS[round]));
        for (wants, (row, col)) in rounds.iter().flat_map(|wants| squares().map(move |square| (wants, square))) {
            let (right, up) = wants.pair(cell.0 * WANTS as i64 + col as i64, cell.1 * WANTS as i64 + row as i64);
            let drawn = |share: f64| ((0.5 + 0.35 * share) * WANT as f64) as usize;
            let place = (row * WANT + drawn(up)) * WIDE + col * WANT + drawn(right);
            let is_camp = roads.bedrock_m[place] < -20.0;
            let class = if is_camp { Class::Minor } else { Class::Track };
            roads.lay_wanted(place, class, is_camp);
        }
        roads
    }

    fn without(region: &Region, playas: &[Playa], cell: (i64, i64)) -> Self {
        let count = WIDE * WIDE;
        let (mut height_m, mut bedrock_m) = (Vec::with_capacity(count), Vec::with_capacity(count));
        let mut is_closed = Vec::with_capacity(count);
        for at in 0..count {
            let [east_m, north_m] = place(node_of(cell, at));
            let lie = region.lie(east_m, north_m);
            let (alluvium_m, bedrock) = (lie.alluvium_m(), lie.bedrock_m());
            height_m.push(alluvium_m + bedrock.max(0.0));
            bedrock_m.push(bedrock);
            let is_wet = |playa: &Playa| playa.is_near([east_m, north_m]) && alluvium_m < playa.level_m as f32 + 2.0;
            is_closed.push(!is_inside(at) || playas.iter().any(is_wet));
        }
        Self { cell, links: vec![[None; 8]; count], height_m, bedrock_m, is_closed }
    }

    fn lay_highways(&mut self, ground: &mut Ground) {
        let (east, north) = self.cell;
        for half in 0..2 {
            let gate = |line: i64| gate(ground.seed, &ground.region, true, line, (east, half));
            let (south, far) = (gate(north), gate(north + 1));
            let style = Style { class: Class::Primary, grade: 0.02, reuse: 0.3 };
            self.lay_through([south, (WIDE - 1) * WIDE + far], WIDE as isize, style);
        }
        for half in 0..2 {
            let gate = |line: i64| gate(ground.seed, &ground.region, false, line, (north, half));
            let (west, far) = (gate(east), gate(east + 1));
            let style = Style { class: Class::Secondary, grade: 0.02, reuse: 0.3 };
            self.lay_through([west * WIDE, far * WIDE + WIDE - 1], 1, style);
        }
    }

    /// A highway between two gates on opposite borders, which it crosses straight.
    fn lay_through(&mut self, gates: [usize; 2], inward: isize, style: Style) {
        let steps = |from: usize, sign: isize| [0, 1, 2].map(|by| from.wrapping_add_signed(sign * by * inward));
        let (first, mut last) = (steps(gates[0], 1), steps(gates[1], -1));
        if let Some(path) = self.path(first[2], &|at| at == last[2], &|_| 1.0, style) {
            last.reverse();
            let whole: Vec<usize> = first[..2].iter().chain(&path).chain(&last[1..]).copied().collect();
            self.link(&whole, style.class);
        }
    }

    /// The lowest saddle of the mountains in a square of nodes.
    fn lowest_saddle(&self, south: usize, west: usize) -> Option<usize> {
        let span = |from: usize| from + 2..from + WANT - 1;
        let inside = span(south).flat_map(|row| span(west).map(move |col| row * WIDE + col));
        let saddles = inside.filter(|&at| is_well_inside(at) && 40.0 < self.bedrock_m[at] && self.is_saddle(at));
        saddles.reduce(|low, at| if self.height_m[at] < self.height_m[low] { at } else { low })
    }

    /// A road from a place that wants one to the nearest, and another on if it is to lead through.
    fn lay_wanted(&mut self, wanted: usize, class: Class, leads_through: bool) {
        if self.is_closed[wanted] || !is_well_inside(wanted) || self.is_road_near(wanted, NEAR) {
            return;
        }
        let style = Style { class, grade: 0.06, reuse: 1.0 };
        let Some(first) = self.path(wanted, &|at| self.is_road(at), &|_| 1.0, style) else { return };
        let joint = first[first.len() - 1];
        self.link(&first, class);
        if leads_through {
            let beside = |at: usize| {
                if first[1..].contains(&at) {
                    return 1_000.0;
                }
                let is_beside = first[1..].iter().any(|&other| apart(at, other) < BESIDE);
                if is_beside && 1 < apart(at, wanted) { 8.0 } else { 1.0 }
            };
            let goal = |at: usize| self.is_road(at) && APART <= apart(at, joint) && !first.contains(&at);
            let Some(second) = self.path(wanted, &goal, &beside, style) else { return };
            if second.len() as f64 <= DETOUR * first.len() as f64 + 25.0 {
                self.link(&second, Class::Track);
            }
        }
    }

    /// Whether ground falls on two sides and rises on the two between.
    fn is_saddle(&self, at: usize) -> bool {
        let rises = DIRECTIONS.map(|(right, up)| {
            let ring = at.wrapping_add_signed(3 * (up * WIDE as isize + right));
            self.height_m[at] < self.height_m[ring]
        });
        (0..8).filter(|&side| rises[side] != rises[(side + 1) % 8]).count() == 4
    }

    fn is_road(&self, at: usize) -> bool {
        self.links[at].iter().any(Option::is_some)
    }

    fn is_road_near(&self, at: usize, nodes: usize) -> bool {
        let (col, row) = (at % WIDE, at / WIDE);
        let span = |middle: usize| middle.saturating_sub(nodes)..=(middle + nodes).min(WIDE - 1);
        span(row).any(|row| span(col).any(|col| self.is_road(row * WIDE + col)))
    }

    fn path(
        &self,
        start: usize,
        is_goal: &dyn Fn(usize) -> bool,
        times: &dyn Fn(usize) -> f64,
        style: Style,
    ) -> Option<Vec<usize>> {
        least_cost_path(WIDE * WIDE, start, is_goal, |at, beside| {
            for (number, (right, up)) in DIRECTIONS.into_iter().enumerate() {
                let next = at.wrapping_add_signed(up * WIDE as isize + right);
                if self.is_closed[next] {
                    continue;
                }
                let length_m = STEP_M * COARSE as f64 * if right * up == 0 { 1.0 } else { std::f64::consts::SQRT_2 };
                let rise_m = f64::from(self.height_m[next] - self.height_m[at]);
                let mut cost = step_cost(length_m, rise_m, style.grade) * times(next);
                if self.links[at][number].is_some() {
                    cost *= style.reuse;
                } else if right * up != 0 {
                    // Ways meet at nodes only: not where two diagonals cross.
                    let across = at.wrapping_add_signed(right);
                    let back = DIRECTIONS.iter().position(|&other| other == (-right, up)).unwrap_or_default();
                    if self.links[across][back].is_some() {
                        continue;
                    }
                }
                beside.push((next, cost as Cost));
            }
        })
    }

    fn link(&mut self, path: &[usize], class: Class) {
        for leg in path.windows(2) {
            for (a, b) in [(leg[0], leg[1]), (leg[1], leg[0])] {
                let is_way = |&(right, up): &(isize, isize)| a.wrapping_add_signed(up * WIDE as isize + right) == b;
                if let Some(number) = DIRECTIONS.iter().position(is_way) {
                    let link = &mut self.links[a][number];
                    *link = (*link).max(Some(class));
                }
            }
        }
    }

    /// All roads, cut where they begin, end, meet or change.
    pub(super) fn chains(&self) -> Vec<Chain> {
        let links_of = |at: usize| (0..8).filter_map(move |number| Some((number, self.links[at][number]?)));
        let is_end = |at: usize| {
            let classes: Vec<Class> = links_of(at).map(|(_, class)| class).collect();
            !matches!(classes[..], [a, b] if a == b)
        };
        let onward = |at: usize, number: usize| {
            let (right, up) = DIRECTIONS[number];
            at.wrapping_add_signed(up * WIDE as isize + right)
        };
        let mut chains = Vec::new();
        for start in (0..WIDE * WIDE).filter(|&at| self.is_road(at) && is_end(at)) {
            for (number, class) in links_of(start) {
                let (mut nodes, mut came) = (vec![start, onward(start, number)], (number + 4) % 8);
                loop {
                    let at = nodes[nodes.len() - 1];
                    if is_end(at) {
                        break;
                    }
                    let Some((number, _)) = links_of(at).find(|&(number, _)| number != came) else { break };
                    nodes.push(onward(at, number));
                    came = (number + 4) % 8;
                }
                let last = nodes[nodes.len() - 1];
                // Each is walked from both ends.
                if (start, nodes[1]) < (last, nodes[nodes.len() - 2]) {
                    chains.push(Chain { class, nodes });
                }
            }
        }
        chains
    }

    /// Whether a node is a gate to the next cell.
    pub(super) fn is_gate(at: usize) -> bool {
        !is_inside(at)
    }
}

/// The node of the ground's lattice under a node of a cell's roads.
pub(super) fn node_of(cell: (i64, i64), at: usize) -> Node {
    (cell.0 * CELL + COARSE * (at % WIDE) as i64, cell.1 * CELL + COARSE * (at / WIDE) as i64)
}

fn is_inside(at: usize) -> bool {
    (1..WIDE - 1).contains(&(at % WIDE)) && (1..WIDE - 1).contains(&(at / WIDE))
}

/// Far enough inside for a ring of nodes around it.
fn is_well_inside(at: usize) -> bool {
    (3..WIDE - 3).contains(&(at % WIDE)) && (3..WIDE - 3).contains(&(at / WIDE))
}

/// Columns or rows between two nodes, whichever are more.
fn apart(a: usize, b: usize) -> usize {
    (a % WIDE).abs_diff(b % WIDE).max((a / WIDE).abs_diff(b / WIDE))
}

/// Where a highway crosses half a border of a cell: on a line of columns or rows of cells, the node along it whose
/// neighbourhood is most like the foot of a fan.
fn gate(seed: u64, region: &Region, is_row: bool, line: i64, (along, half): (i64, usize)) -> usize {
    /// Range field at the foot of a fan, above playas and below gullies.
    const FOOT: f32 = -0.42;
    let stream = Stream::new(seed, LAYERS[0]);
    let range = |node: usize| {
        let (across, along) = (line * CELL, along * CELL + COARSE * node as i64);
        let [east_m, north_m] = place(if is_row { (along, across) } else { (across, along) });
        region.lie(east_m, north_m).range
    };
    let first = 10 + half * 80;
    let misfit: Vec<f32> = (first - 4..=first + 64).map(|node| (range(node) - FOOT).abs()).collect();
    let score = |node: usize| {
        let around = misfit[node - first..=node - first + 8].iter().sum::<f32>();
        let (chance, _) = stream.pair(line * 1024 + node as i64, along * 2 + i64::from(is_row));
        around + 0.2 * chance as f32
    };
    (first..=first + 60)
        .map(|node| (score(node), node))
        .reduce(|a, b| if b.0 < a.0 { b } else { a })
        .map_or(first, |a| a.1)
}
