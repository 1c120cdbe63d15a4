//! What a build says it found, held against what lies in its files.

use std::collections::BTreeSet;

use build::Built;
use job::{Count, Job};
use store::{ReportBreach, ReportPlace};
use terrain::{LATTICE_PER_POST, LatticePoint};

use crate::product::{Edges, Product};
use crate::scene::SIDE_CELLS;
use crate::surface::Sums;

/// Limits and counts, found again from the load modules alone.
pub struct Counted {
    counts: Vec<u64>,
    rows: usize,
    cols: usize,
    window: (usize, usize),
}

impl Counted {
    pub fn new(job: &Job, product: &Product) -> Self {
        let (rows, cols) = (product.rows as usize, product.cols as usize);
        // 4 km of load modules of 500 m, cut to a smaller area.
        let window = (rows.min(8), cols.min(8));
        Self { counts: product.counts(job.limits.count == Count::Polygons), rows, cols, window }
    }

    fn total(&self) -> u64 {
        self.counts.iter().sum()
    }

    /// Every window with its south-west load module.
    fn windows(&self) -> Vec<([u32; 2], u64)> {
        let (high, wide) = self.window;
        let mut windows = Vec::new();
        for row in 0..=self.rows - high {
            for col in 0..=self.cols - wide {
                let inside = (row..row + high).flat_map(|row| (col..col + wide).map(move |col| (row, col)));
                let sum = inside.map(|(row, col)| self.counts[row * self.cols + col]).sum();
                windows.push(([row as u32, col as u32], sum));
            }
        }
        windows
    }

    fn over(&self, limit: u64) -> BTreeSet<([u32; 2], u64)> {
        let place = |index: usize| [(index / self.cols) as u32, (index % self.cols) as u32];
        let over = self.counts.iter().enumerate().filter(|&(_, &count)| limit < count);
        over.map(|(index, &count)| (place(index), count)).collect()
    }
}

/// With constrained edges nothing is exceeded; with clipped ones what is exceeded is a breach, and nothing else is.
#[track_caller]
pub fn check_limits(job: &Job, product: &Product, built: &Built, edges: Edges) {
    let counted = Counted::new(job, product);
    let limits = &job.limits;
    let breaches = &built.report.breaches;
    let of_kind = |kind: &str| breaches.iter().filter(|breach| breach.kind == kind).collect::<Vec<_>>();
    if edges == Edges::Constrained {
        let unmet = breaches.iter().filter(|breach| breach.kind != "residual").count();
        assert_eq!(unmet, 0, "breaches with constrained edges: {breaches:?}");
    }

    let over = counted.over(u64::from(limits.per_load_module));
    let told = places(&of_kind("per_load_module"));
    assert!(told.is_subset(&over), "breaches {told:?} of load modules over their limit {over:?}");
    let pooled: u64 = over.difference(&told).map(|&(_, count)| count - u64::from(limits.per_load_module)).sum();
    assert!(pooled <= limits.pool, "{pooled} above the limit without a breach, the pool has {}", limits.pool);

    let windows = counted.windows();
    let over: BTreeSet<_> = windows.iter().copied().filter(|&(_, sum)| u64::from(limits.window.limit) < sum).collect();
    assert_eq!(over, places(&of_kind("per_4km_square")), "windows over their limit, and breaches");

    let budget = (limits.mean_per_load_module * counted.counts.len() as f64).floor() as u64;
    let told: Vec<u64> = of_kind("mean_per_load_module").iter().map(|breach| breach.count).collect();
    let expected = if budget < counted.total() { vec![counted.total()] } else { vec![] };
    assert_eq!(told, expected, "the whole area's limit is {budget}");
    for breach in breaches {
        assert_eq!(breach.excess, breach.count - breach.limit, "{breach:?}");
    }
}

fn places(breaches: &[&ReportBreach]) -> BTreeSet<([u32; 2], u64)> {
    let place = |breach: &&ReportBreach| match breach.place {
        ReportPlace::Module(at) | ReportPlace::Window(at) => (at, breach.count),
        ReportPlace::Area => panic!("a breach of the area among those of places"),
    };
    breaches.iter().map(place).collect()
}

/// The report's numbers are those of the files.
#[track_caller]
pub fn check_report(job: &Job, product: &Product, built: &Built, sums: &Sums) {
    let report = &built.report;
    let counted = Counted::new(job, product);
    let total = |polygons: bool| product.counts(polygons).iter().sum::<u64>();
    assert_eq!((report.triangles, report.polygons), (total(false), total(true)), "triangles and polygons");
    let most = counted.counts.iter().copied().max().unwrap();
    assert_eq!(report.per_load_module.max, most);
    assert_eq!(report.per_load_module.over, counted.over(report.per_load_module.limit).len() as u64);
    let mean = counted.total() as f64 / counted.counts.len() as f64;
    assert!((report.per_load_module.mean - mean).abs() < 1e-9);
    assert_eq!(report.per_4km.max, counted.windows().iter().map(|window| window.1).max().unwrap());

    assert!((report.residual.rms_m - sums.rms_m()).abs() < 1e-9, "{} is not {}", report.residual.rms_m, sums.rms_m());
    assert!((report.residual.max_m - sums.max_m()).abs() < 1e-9);
    assert!((report.residual.mean_abs_m - sums.sum_abs as f64 / sums.posts as f64 / 128.0).abs() < 1e-9);
    assert_eq!(report.classes.iter().map(|class| class.posts).sum::<u64>(), sums.posts, "posts of all classes");
    let totals = built.database.folder().manifest().unwrap().totals;
    let found = Sums {
        posts: totals.residual_posts,
        largest: totals.residual_largest,
        sum_abs: totals.residual_sum_abs,
        sum_squared: totals.residual_sum_squared,
    };
    assert_eq!(found, *sums, "sums of residuals in database.json");
    check_points(job, product, built);
}

/// A point of a tile's TIN is one of the report's points if it is still a vertex of a load module: enforcing may have
/// taken it out.
#[track_caller]
fn check_points(job: &Job, product: &Product, built: &Built) {
    let points = &built.report.points;
    let folder = built.database.folder();
    let left = lattice_points(product);
    // Where enforcing took out a point of a module line, a triangle may be cut in the very same place: such a post
    // looks as if the point were still there.
    let on_line = |at: LatticePoint| at.row % (8 * SIDE_CELLS) == 0 || at.col % (8 * SIDE_CELLS) == 0;
    let (mut all, mut selected) = (BTreeSet::new(), BTreeSet::new());
    for record in &folder.manifest().unwrap().tiles {
        let (_, tile) = folder.read_tile(record.tile()).unwrap();
        tile.tin.check().unwrap();
        let is_left = |at: &LatticePoint| left.contains(at);
        let vertices: Vec<_> = tile.tin.vertices.iter().map(|vertex| vertex.at).collect();
        all.extend(vertices.iter().copied().filter(is_left));
        selected.extend(vertices[tile.initial_count as usize..].iter().copied().filter(is_left));
    }
    let grid = job.area.grid;
    assert_eq!(points.corner, u64::from(grid.rows + 1) * u64::from(grid.cols + 1));
    assert_eq!(points.selected + points.border + points.corner, points.total);
    for (told, found) in [(points.total, &all), (points.selected, &selected)] {
        let certain = found.iter().filter(|&&at| !on_line(at)).count() as u64;
        let range = certain..=found.len() as u64;
        assert!(range.contains(&told), "{told} points told, {range:?} found");
    }
    if job.modules.edges == job::Edges::Constrained {
        assert_eq!((points.total, points.selected), (all.len() as u64, selected.len() as u64));
    }
}

/// The lattice points on which load modules have vertices.
fn lattice_points(product: &Product) -> BTreeSet<LatticePoint> {
    let side = SIDE_CELLS * LATTICE_PER_POST;
    let step = product.side / i64::from(side);
    let mut points = BTreeSet::new();
    for (&(row, col), module) in &product.modules {
        let on_lattice = module.vertices.iter().map(|v| (i64::from(v.y), i64::from(v.x)));
        let on_lattice = on_lattice.filter(|(y, x)| y % step == 0 && x % step == 0);
        let (south, west) = (row as i32 * side, col as i32 * side);
        points.extend(on_lattice.map(|(y, x)| LatticePoint::new(south + (y / step) as i32, west + (x / step) as i32)));
    }
    points
}
