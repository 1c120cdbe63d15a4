//! What a simulator would load, checked the slow, obvious way and with nothing of the compiler: cracks, T-junctions,
//! areas, the identities of load modules.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use load_module_reader::{Module, SlmFile};

/// All load modules of an area.
pub struct Product {
    pub rows: u32,
    pub cols: u32,
    /// Side of a load module in quanta.
    pub side: i64,
    pub modules: BTreeMap<(u32, u32), Module>,
}

/// How clipped pieces may differ from triangles of their own.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Edges {
    Constrained,
    Clipped,
}

impl Product {
    #[track_caller]
    pub fn read(database: &Path) -> Self {
        let mut product = Self { rows: 0, cols: 0, side: 0, modules: BTreeMap::new() };
        for entry in std::fs::read_dir(database.join("modules")).unwrap() {
            let file = SlmFile::open(entry.unwrap().path()).unwrap();
            let header = file.header();
            product.rows = header.area_rows;
            product.cols = header.area_cols;
            product.side = i64::from(header.side);
            for module in file.modules() {
                let twice = product.modules.insert((module.row, module.col), module.clone());
                assert!(twice.is_none(), "load module {},{} is in two files", module.row, module.col);
            }
        }
        assert_eq!(product.modules.len() as u32, product.rows * product.cols, "load modules");
        product
    }

    /// Triangles or polygons of every load module, row by row.
    pub fn counts(&self, polygons: bool) -> Vec<u64> {
        let count = |module: &Module| match polygons {
            true => u64::from(module.polygon_count),
            false => module.triangles.len() as u64,
        };
        self.modules.values().map(count).collect()
    }

    /// Every promise about the shape of the product.
    #[track_caller]
    pub fn check(&self, edges: Edges) {
        let mut area = 0;
        for module in self.modules.values() {
            area += check_module(module, self.side, edges);
        }
        let expected = 2 * self.side * self.side * i64::from(self.rows) * i64::from(self.cols);
        assert_eq!(area, expected, "doubled area of all load modules");
        self.check_cracks();
    }

    /// Both load modules of a side hold the same vertices there, heights included.
    #[track_caller]
    pub fn check_cracks(&self) {
        for (&(row, col), module) in &self.modules {
            if let Some(east) = self.modules.get(&(row, col + 1)) {
                let (own, other) = (on_line(module, true, self.side), on_line(east, true, 0));
                assert_eq!(own, other, "east of load module {row},{col}");
            }
            if let Some(north) = self.modules.get(&(row + 1, col)) {
                let (own, other) = (on_line(module, false, self.side), on_line(north, false, 0));
                assert_eq!(own, other, "north of load module {row},{col}");
            }
            if let Some(beyond) = self.modules.get(&(row + 1, col + 1)) {
                let corner = on_line(module, true, self.side).last().map(|at| at.1);
                assert_eq!(corner, on_line(beyond, true, 0).first().map(|at| at.1), "corner of {row},{col}");
            }
        }
    }
}

/// Places along the line x = `at` (or y = `at`) and heights there.
fn on_line(module: &Module, upright: bool, at: i64) -> Vec<(u16, i32)> {
    let across = |v: &&load_module_reader::Vertex| i64::from(if upright { v.x } else { v.y }) == at;
    let mut found: Vec<(u16, i32)> =
        module.vertices.iter().filter(across).map(|v| (if upright { v.y } else { v.x }, v.z)).collect();
    found.sort_unstable();
    found
}

/// Checks one load module, and gives its doubled area in squared quanta.
#[track_caller]
fn check_module(module: &Module, side: i64, edges: Edges) -> i64 {
    let name = format!("load module {},{}", module.row, module.col);
    let place = |v: u16| (i64::from(module.vertices[usize::from(v)].x), i64::from(module.vertices[usize::from(v)].y));
    let is_border = |(x, y): (i64, i64)| x == 0 || y == 0 || x == side || y == side;

    let places: BTreeSet<_> = (0..module.vertices.len()).map(|v| place(v as u16)).collect();
    assert_eq!(places.len(), module.vertices.len(), "{name}: two vertices at one place");
    let used: BTreeSet<u16> = module.triangles.iter().flatten().copied().collect();
    assert_eq!(used.len(), module.vertices.len(), "{name}: vertices that no triangle uses");

    let mut area = 0;
    let mut directed = BTreeSet::new();
    for [a, b, c] in module.triangles.iter().copied() {
        let doubled = cross(place(a), place(b), place(c));
        assert!(0 < doubled, "{name}: a triangle of doubled area {doubled}");
        area += doubled;
        for edge in [(a, b), (b, c), (c, a)] {
            assert!(directed.insert(edge), "{name}: an edge with two triangles on one side");
        }
    }
    assert_eq!(area, 2 * side * side, "{name}: doubled area");
    let outer: Vec<_> = directed.iter().filter(|&&(a, b)| !directed.contains(&(b, a))).collect();
    for &&(a, b) in &outer {
        let (a, b) = (place(a), place(b));
        let along = (a.0 == b.0 && (a.0 == 0 || a.0 == side)) || (a.1 == b.1 && (a.1 == 0 || a.1 == side));
        assert!(along, "{name}: an edge inside it has one triangle only, {a:?} to {b:?}");
    }
    check_no_vertex_inside_an_edge(&name, &directed, &places, place);

    // The identities: triangles = 2 V + B - 2 and polygons = 1 + E - V.
    let border = places.iter().filter(|&&at| is_border(at)).count();
    let inner = places.len() - border;
    assert_eq!(border, outer.len(), "{name}: its sides are not closed");
    assert_eq!(module.triangles.len(), 2 * inner + border - 2, "{name}: triangles");
    let inner_edges = (directed.len() - outer.len()) / 2;
    let polygons = module.polygon_count as usize;
    match edges {
        Edges::Constrained => assert_eq!(polygons, 1 + inner_edges - inner, "{name}: polygons"),
        // A convex piece of a triangle has at most six sides when corners are vertices: four triangles.
        Edges::Clipped => assert!(
            polygons <= module.triangles.len() && module.triangles.len() <= 4 * polygons,
            "{name}: {polygons} polygons fanned into {} triangles",
            module.triangles.len()
        ),
    }
    area
}

/// A T-junction would be a vertex strictly between the ends of an edge.
#[track_caller]
fn check_no_vertex_inside_an_edge(
    name: &str,
    edges: &BTreeSet<(u16, u16)>,
    places: &BTreeSet<(i64, i64)>,
    place: impl Fn(u16) -> (i64, i64),
) {
    for &(a, b) in edges {
        let (a, b) = (place(a), place(b));
        let between = |p: &&(i64, i64)| {
            let along = (p.0 - a.0) * (b.0 - a.0) + (p.1 - a.1) * (b.1 - a.1);
            let whole = (b.0 - a.0).pow(2) + (b.1 - a.1).pow(2);
            cross(a, b, **p) == 0 && 0 < along && along < whole
        };
        assert_eq!(places.iter().find(between), None, "{name}: a T-junction on the edge {a:?} to {b:?}");
    }
}

pub fn cross(a: (i64, i64), b: (i64, i64), c: (i64, i64)) -> i64 {
    (b.0 - a.0) * (c.1 - a.1) - (b.1 - a.1) * (c.0 - a.0)
}
