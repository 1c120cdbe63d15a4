//! Jobs on real ground, where the folder of shared terrain exists.

use std::path::{Path, PathBuf};

use build::Built;
use job::{Edges as JobEdges, Job};
use terrain::{Dem, Post, PostRect, quanta_of_metres};

use crate::findings::{check_limits, check_report};
use crate::product::{Edges, Product};
use crate::scene::{Silent, assert_same, options, tree};
use crate::surface::sums_of_product;

/// A file of the shared terrain; says aloud when it is not there.
pub fn data(file: &str) -> Option<PathBuf> {
    let path = data_folder().join(file);
    if !path.exists() {
        eprintln!("skipped: {} is not there", path.display());
    }
    path.exists().then_some(path)
}

fn data_folder() -> PathBuf {
    let beside = concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/data");
    std::env::var_os("TIEFORT_DATA").map_or_else(|| beside.into(), PathBuf::from)
}

/// A raster's posts as they are, row 0 the southern one.
pub fn read_dem(path: &Path, window: impl FnOnce(PostRect) -> PostRect) -> Dem {
    let file = source_files::GeoTiff::open(path, None).unwrap();
    let window = window(file.rect());
    let (raster, scale) = (file.read(window).unwrap(), file.sample_scale());
    Dem::from_fn(window, |post: Post| raster.sample(post).and_then(|sample| quanta_of_metres(scale.height_m(sample))))
}

/// A job of `tests/jobs`, with the shared terrain where it is.
fn job(name: &str, changes: &[(&str, &str)]) -> Job {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/jobs").join(name);
    let mut text = std::fs::read_to_string(&path).unwrap();
    assert!(text.contains("../../../shared/data"), "{name} reads the shared terrain");
    text = text.replace("../../../shared/data", &data_folder().canonicalize().unwrap().to_string_lossy());
    for (from, to) in changes {
        assert!(text.contains(from), "{name} does not hold {from:?}");
        text = text.replacen(from, to, 1);
    }
    Job::from_text(&text, &path).unwrap()
}

/// Builds a job in `folder` and checks all that can be checked without its DEM.
fn build(job: &Job, folder: &Path, workers: usize) -> (Built, Product) {
    let built = build::build(job, folder, &options(workers, &false.into()), &mut Silent).unwrap();
    let edges = match job.modules.edges {
        JobEdges::Constrained => Edges::Constrained,
        JobEdges::Clip(_) => Edges::Clipped,
    };
    let product = Product::read(folder);
    product.check(edges);
    check_limits(job, &product, &built, edges);
    (built, product)
}

/// ALGORITHMS 5.6 gives 0.82 m optimised and 1.643 m selected only; its figures hold within a fifth.
#[track_caller]
fn check_band(found: f64, expected: f64) {
    let band = 0.8 * expected..=1.2 * expected;
    assert!(band.contains(&found), "found {found}, expected {expected} within a fifth");
}

/// One of its vertices finds no place on a post, and none of its triangles lets it go.
#[test]
fn the_desert_is_sound_on_posts_alone() {
    if data("ntc_scape/ntc_1024x1024_25m_assumed.tif").is_none() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let job = job("desert.toml", &[("[tin]", "[tin]\nlattice = \"post\"")]);
    let (built, _) = build(&job, folder.path(), 2);
    check_band(built.report.residual.rms_m, 0.92);
}

#[test]
fn the_desert_is_sound_as_true_as_specified_and_the_same_for_one_worker_and_two() {
    let Some(path) = data("ntc_scape/ntc_1024x1024_25m_assumed.tif") else { return };
    let dem = read_dem(&path, |_| PostRect::of_size(1021, 1021));
    let folder = tempfile::tempdir().unwrap();
    let job = job("desert.toml", &[]);
    let (two, product) = build(&job, &folder.path().join("two"), 2);
    check_report(&job, &product, &two, &sums_of_product(&product, &dem));
    check_band(two.report.residual.rms_m, 0.82);
    drop(two);
    drop(build(&job, &folder.path().join("one"), 1));
    let trees = ["one", "two"].map(|name| {
        let mut tree = tree(&folder.path().join(name));
        // A report tells times.
        tree.retain(|path, _| !path.ends_with("lock") && !path.ends_with("report.json"));
        tree
    });
    assert_same(&trees[0], &trees[1], "one worker and two");
    let verdict = inspect::verify(&folder.path().join("one"), Some(&path)).unwrap();
    assert!(verdict.problems.is_empty(), "{:?}", verdict.problems);
    assert_eq!((verdict.checked_modules, verdict.checked_files), (51 * 51, 4 * 36 + 1));
    check_band(verdict.residual.unwrap().rms_m, 0.82);
}

#[test]
fn the_desert_by_the_largest_residual_is_as_true_as_specified() {
    if data("ntc_scape/ntc_1024x1024_25m_assumed.tif").is_none() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    // The figure is of a run without caps.
    let free = [
        ("method = \"optimised\"", "method = \"greedy\""),
        ("per_load_module = 100", "per_load_module = 1000"),
        ("mean_per_load_module = 32", "mean_per_load_module = 31.7"),
        ("per_4km_square = 4096", "per_4km_square = 40000"),
    ];
    let (built, _) = build(&job("desert.toml", &free), folder.path(), 2);
    check_band(built.report.residual.rms_m, 1.687);
}

#[test]
fn the_desert_clipped_is_as_true_as_specified_and_equal_shares_cost_a_seventh() {
    let Some(path) = data("ntc_scape/ntc_1024x1024_25m_assumed.tif") else { return };
    let dem = read_dem(&path, |_| PostRect::of_size(1021, 1021));
    let folder = tempfile::tempdir().unwrap();
    // The paper's share of 76,500 points in 10,000 load modules.
    let [global, equal] = ["global", "equal"].map(|allocation| {
        let tin = format!("method = \"paper\"\npoints = 19897\nallocation = \"{allocation}\"");
        let limits = "[load_modules]\nedges = \"clip\"\n[limits]\ncount = \"polygons\"";
        let job = job("desert.toml", &[("method = \"optimised\"", &tin), ("[limits]", limits)]);
        let (built, product) = build(&job, &folder.path().join(allocation), 2);
        check_report(&job, &product, &built, &sums_of_product(&product, &dem));
        built.report
    });
    check_band(global.residual.rms_m, 2.28);
    check_band(global.polygons as f64 / 2601.0, 21.9);
    check_band(global.triangles as f64 / 2601.0, 24.2);
    let cost = equal.residual.rms_m / global.residual.rms_m;
    assert!((1.05..1.25).contains(&cost), "equal shares cost {cost}");
}

#[test]
fn the_alps_are_sound_in_both_kinds_of_edges() {
    let Some(path) = data("ntc_standin/bavarian_alps_50km_1979x1979_utm32n.tif") else { return };
    let folder = tempfile::tempdir().unwrap();
    let (built, product) = build(&job("alps.toml", &[]), &folder.path().join("constrained"), 2);
    assert_eq!(product.modules.len(), 99 * 99);
    // The whole budget is spent but for the rung of the ladder: 32 triangles for every load module.
    let spent = built.report.triangles as f64 / (32.0 * 99.0 * 99.0);
    assert!((0.97..=1.0).contains(&spent), "{spent} of the budget is spent");
    drop(built);
    let verdict = inspect::verify(&folder.path().join("constrained"), Some(&path)).unwrap();
    assert!(verdict.problems.is_empty(), "{:?}", verdict.problems);

    let paper = [
        ("method = \"optimised\"", "method = \"paper\"\npoints = 74978"),
        ("[limits]", "[load_modules]\nedges = \"clip\"\n[limits]\ncount = \"polygons\""),
    ];
    let (built, _) = build(&job("alps.toml", &paper), &folder.path().join("clip"), 2);
    assert_eq!(built.report.points.selected + removed(&built), 74_978);
    drop(built);
    let verdict = inspect::verify(&folder.path().join("clip"), None).unwrap();
    assert!(verdict.problems.is_empty(), "{:?}", verdict.problems);
}

/// Points that enforcing took out: those of the tiles' TINs that the report no longer counts.
fn removed(built: &Built) -> u64 {
    let folder = built.database.folder();
    let tiles = folder.manifest().unwrap().tiles;
    let selected = tiles.iter().map(|record| folder.read_tile(record.tile()).unwrap().1.residuals.len() as u64);
    selected.sum::<u64>() - built.report.points.selected
}
