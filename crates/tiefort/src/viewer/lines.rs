//! Roads, rails, rivers and streams as the page reads them, to draw each as one ribbon from end to end: the lines of
//! load modules; where these have none, those edges of the TIN that are lines and have no triangles of their own.
//!
//! As bytes, of each edge: row and column of its load module, class (u32 each); width, then east and north from the
//! area's south-west corner and height of both ends (f32 each, metres).

use std::collections::BTreeMap;

use load_module_reader::{
    Area, AreaFrame, Block, Line, LineKind, LineStorey, LoadedGround, Module, QUANTA_PER_METRE, Vertex,
};
use store::{AreaLevel, FeatureLine};
use terrain::Role;

/// Edges of the whole area that the page draws before load modules come.
const EDGES_MAX: usize = 20_000;

/// A piece of a line, from vertex to vertex.
#[derive(Clone, Copy)]
pub struct Edge {
    /// Row and column of its load module.
    module: (u32, u32),
    class: u32,
    width_m: f64,
    /// East, north and height of both ends.
    ends_m: [[f64; 3]; 2],
}

impl Edge {
    fn write(&self, out: &mut Vec<u8>) {
        let words = [self.module.0, self.module.1, self.class];
        out.extend(words.into_iter().flat_map(u32::to_le_bytes));
        let numbers = [self.width_m].into_iter().chain(self.ends_m.into_iter().flatten());
        out.extend(numbers.flat_map(|number| (number as f32).to_le_bytes()));
    }

    /// Square metres on the map: what is wide and long is seen from afar.
    fn area_m2(&self) -> f64 {
        let [from, to] = self.ends_m;
        self.width_m * (to[0] - from[0]).hypot(to[1] - from[1])
    }
}

/// Those edges of an area that are seen best from afar.
#[derive(Default)]
pub struct Longest(Vec<Edge>);

impl Longest {
    pub fn add(&mut self, edges: impl Iterator<Item = Edge>) {
        self.0.extend(edges);
        if 4 * EDGES_MAX < self.0.len() {
            self.thin();
        }
    }

    fn thin(&mut self) {
        self.0.sort_by(|a, b| b.area_m2().total_cmp(&a.area_m2()));
        self.0.truncate(EDGES_MAX);
    }

    /// As the page reads them.
    pub fn bytes(mut self) -> Vec<u8> {
        if EDGES_MAX < self.0.len() {
            self.thin();
        }
        bytes(&self.0)
    }
}

fn bytes<'a>(edges: impl IntoIterator<Item = &'a Edge>) -> Vec<u8> {
    let mut out = Vec::new();
    edges.into_iter().for_each(|edge| edge.write(&mut out));
    out
}

/// The edges of the lines of loaded load modules that are drawn: of all that is kept, but for tunnels, breaklines, and
/// channels on ground of the classes `waters`, which is seen as water without them.
pub fn edges_of<'a>(ground: &'a LoadedGround, waters: &'a [u8]) -> impl Iterator<Item = Edge> + 'a {
    let [east, north] = ground.frame().origin_m;
    let is_seen = move |kind: LineKind, Edge { ends_m: [a, b], .. }: &Edge| {
        let middle = [east + f64::midpoint(a[0], b[0]), north + f64::midpoint(a[1], b[1])];
        let on_water = || ground.sample(middle).is_some_and(|sample| waters.contains(&sample.class));
        kind != LineKind::Channel || !on_water()
    };
    let modules = ground.modules().iter();
    let edges = modules.flat_map(|module| edges_of_module(module.module(), ground.frame().side_m()));
    edges.filter(move |(kind, edge)| is_seen(*kind, edge)).map(|(_, edge)| edge)
}

/// Those of a load module, with the kinds of their lines.
fn edges_of_module(module: &Module, side_m: f64) -> impl Iterator<Item = (LineKind, Edge)> {
    let is_drawn = |line: &&Line| line.is_kept && line.storey != LineStorey::Tunnel && line.kind != LineKind::Breakline;
    let metres = |quanta: i64| quanta as f64 / f64::from(QUANTA_PER_METRE);
    let corner = [module.col, module.row].map(|number| f64::from(number) * side_m);
    let place = move |vertex: Vertex| {
        [corner[0] + metres(vertex.x.into()), corner[1] + metres(vertex.y.into()), metres(vertex.z.into())]
    };
    module.lines.iter().filter(is_drawn).flat_map(move |line| {
        line.vertices.windows(2).map(move |ends| {
            let ends_m = [ends[0], ends[1]].map(place);
            let (class, width_m) = (line.class.into(), metres(line.width.into()));
            (line.kind, Edge { module: (module.row, module.col), class, width_m, ends_m })
        })
    })
}

/// The lines of load modules in a block, on ground of which the classes `waters` are water.
///
/// # Errors
/// In words, when a load module cannot be read.
pub fn of_modules(area: &Area, block: Block, waters: &[u8]) -> Result<Vec<u8>, String> {
    let ground = area.load(block).map_err(|error| error.to_string())?;
    let mut out = Vec::new();
    edges_of(&ground, waters).for_each(|edge| edge.write(&mut out));
    Ok(out)
}

/// The lines of an area by load module, row and column.
#[derive(Default)]
pub struct Lines(BTreeMap<(u32, u32), Vec<Edge>>);

impl Lines {
    /// Those of an area that lie in a load module of its frame.
    pub fn of(level: &AreaLevel, frame: &AreaFrame) -> Self {
        let mut lines = Self::default();
        for line in level.lines.iter().filter(|line| matches!(line.role, Role::Centre | Role::Channel)) {
            for ends in line.vertices.windows(2) {
                lines.add(line, [ends[0], ends[1]], frame);
            }
        }
        lines
    }

    fn add(&mut self, line: &FeatureLine, ends: [[f64; 3]; 2], frame: &AreaFrame) {
        let [east, north] = frame.origin_m;
        let ends_m = ends.map(|end| [end[0] - east, end[1] - north, end[2]]);
        // An edge crosses no side of a load module, so that its middle says which it lies in.
        let number = |axis: usize| ((ends_m[0][axis] + ends_m[1][axis]) / 2.0 / frame.side_m()).floor();
        let (row, col) = (number(1), number(0));
        if row < 0.0 || col < 0.0 || f64::from(frame.rows) <= row || f64::from(frame.cols) <= col {
            return;
        }
        let module = (row as u32, col as u32);
        let edge = Edge { module, class: line.class.into(), width_m: line.width_m, ends_m };
        self.0.entry(module).or_default().push(edge);
    }

    /// Those of a block of load modules.
    pub fn bytes(&self, block: Block) -> Vec<u8> {
        let rows = self.0.range((block.south, 0)..(block.north, 0));
        bytes(rows.filter(|((_, col), _)| (block.west..block.east).contains(col)).flat_map(|(_, edges)| edges))
    }

    /// All of them.
    pub fn edges(&self) -> impl Iterator<Item = Edge> {
        self.0.values().flatten().copied()
    }
}
