//! Random small jobs on random ground: whatever is asked for, the product is whole and the limits are told truly.
//!
//! A failure prints its seed; `TIEFORT_SEED=n` runs that one alone, `TIEFORT_JOBS=n` the first n. Seeds that once
//! failed stay in `KEPT`.

use build::CompileError;
use build::ground::GroundError;
use terrain::Dem;

use crate::modes::write_polygon;
use crate::scene::{Draw, Scene, Words, sample_dem, write_dem};
use crate::soundness::check;

/// Jobs tried in every run.
const JOBS: u64 = 60;
/// Seeds that once showed a fault.
const KEPT: [u64; 0] = [];

/// Prints the seed of the job during which a test panics.
pub struct Seed(pub u64);

impl Drop for Seed {
    fn drop(&mut self) {
        if std::thread::panicking() {
            eprintln!("TIEFORT_SEED={}", self.0);
        }
    }
}

/// Some ground.
pub fn ground(draw: &mut Draw, words: &Words) -> Dem {
    let (grid, rect) = (words.grid(), words.grid().area());
    match draw.below(5) {
        0 | 1 => sample_dem(grid, u64::from(draw.below(50))),
        // Spikes and pits on a plain.
        2 => {
            let rare = draw.within(2, 60);
            Dem::from_fn(rect, |_| Some(if draw.below(rare) == 0 { draw.below(60_000) as i32 - 30_000 } else { 0 }))
        }
        // Noise.
        3 => {
            let high = draw.one_of(&[2, 300, 200_000]);
            Dem::from_fn(rect, |_| Some(draw.below(high) as i32))
        }
        // Terraces: many posts of one value.
        _ => {
            let (step, rise) = (draw.within(3, 30) as i32, draw.within(1, 5000) as i32);
            Dem::from_fn(rect, |post| Some((post.row / step + 2 * (post.col / step) % 3) * rise))
        }
    }
}

fn tin(draw: &mut Draw, clip: bool) -> String {
    let points = draw.one_of(&[1, 20, 150, 400]);
    let allocation = draw.one_of(&["equal", "global"]);
    let proximity = draw.one_of(&["true", "false"]);
    let key = draw.one_of(&["max", "sse"]);
    match (draw.below(3), clip) {
        (0, _) => {
            format!("method = \"paper\"\npoints = {points}\nallocation = \"{allocation}\"\nproximity = {proximity}")
        }
        (1, _) | (_, true) => {
            let end = draw.one_of(&["points", "max_residual_m", "target_rms_m"]);
            let at = if end == "points" { f64::from(points) } else { draw.one_of(&[0.5, 4.0, 30.0]) };
            format!("method = \"greedy\"\nkey = \"{key}\"\n{end} = {at}\nallocation = \"{allocation}\"")
        }
        _ => format!("allocation = \"{allocation}\""),
    }
}

/// Limits from hardly more than the initial points need to more than any of these jobs spends.
fn limits(draw: &mut Draw, (rows, cols): (u32, u32)) -> String {
    let start = 2 * rows * cols + 6 * (rows + cols);
    let mean = f64::from(start) / f64::from(rows * cols) + f64::from(draw.one_of(&[0, 1, 6, 20, 200])) + 0.01;
    let window = start + draw.one_of(&[0, 40, 400, 4000]);
    let (module, pool) = (draw.one_of(&[8, 9, 11, 20, 40, 100]), draw.one_of(&[0, 0, 3, 50, 1000]));
    let count = draw.one_of(&["triangles", "polygons"]);
    format!(
        "count = \"{count}\"\nper_load_module = {module}\npool = {pool}\nmean_per_load_module = {mean}\n\
         per_4km_square = {window}"
    )
}

fn words(draw: &mut Draw) -> Words {
    let size = (draw.within(2, 7), draw.within(2, 10));
    let tiles = (draw.within(1, size.0 / 2), draw.within(1, size.1 / 2));
    let clip = draw.below(2) == 0;
    let heights = draw.one_of(&["coplanar", "dem"]);
    let outer_border = draw.one_of(&["", "outer_border = \"fixed\""]);
    let weight = draw.one_of(&[0, 0, 1, 8]);
    let smooth = draw.one_of(&["none", "binomial-7"]);
    let area = format!("areas = [{{ file = \"area.geojson\", class = \"area\", weight = {weight} }}]");
    let borders = if clip { draw.one_of(&["inherit", "inherit", "regular"]) } else { "inherit" };
    Words {
        size,
        tiles,
        order: format!("order = \"{}\"\nborders = \"{borders}\"", draw.one_of(&["colour", "raster"])),
        importance: format!("default = 2\nsmooth = \"{smooth}\"\n{}", if draw.below(2) == 0 { "" } else { &area }),
        modules: if clip { format!("edges = \"clip\"\nclip_heights = \"{heights}\"") } else { outer_border.into() },
        limits: limits(draw, size),
        tin: tin(draw, clip),
        ..Words::raster()
    }
}

/// Up to three levels of detail beside the finest.
fn lod(draw: &mut Draw) -> String {
    let shares = draw.one_of(&["", "0.5", "0.9 0.01", "0.75 0.5 0.25"]);
    let levels: Vec<String> = shares.split_whitespace().map(|share| format!("{{ inner_share = {share} }}")).collect();
    let border = draw.one_of(&["full", "own"]);
    match levels.is_empty() {
        true => String::new(),
        false => format!("\n[lod]\nlevels = [{}]\nborder = \"{border}\"", levels.join(", ")),
    }
}

/// Runs the job of a seed; returns whether it was possible at all.
fn run(seed: u64) -> bool {
    let _seed = Seed(seed);
    // Spread, since neighbouring states of the generator draw alike.
    let mut draw = Draw(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15));
    let mut words = words(&mut draw);
    let dem = ground(&mut draw, &words);
    let mut along = |modules: u32| f64::from(draw.below(modules * 500));
    let (west, south) = (along(words.size.1), along(words.size.0));
    words.tin += &lod(&mut draw);
    let scene = Scene::with_files(&words, |folder| {
        write_dem(&folder.join("dem.tif"), &dem);
        write_polygon(&folder.join("area.geojson"), [west, south, west + 1500.0, south + 900.0]);
    });
    match build::plan(&scene.job) {
        Ok(_) => {
            check(&scene, &dem);
            true
        }
        Err(CompileError::Ground(GroundError::Impossible { .. })) => {
            let error = scene.try_build("area", 1).expect_err("a build that the plan refuses");
            assert!(error.hint().is_some() && !scene.path("area").exists(), "{error}");
            false
        }
        Err(error) => panic!("{error}"),
    }
}

#[test]
fn random_jobs_are_whole_and_tell_every_limit_truly() {
    if let Ok(seed) = std::env::var("TIEFORT_SEED") {
        run(seed.parse().unwrap());
        return;
    }
    let jobs = std::env::var("TIEFORT_JOBS").map_or(JOBS, |jobs| jobs.parse().unwrap());
    let possible = (0..jobs).chain(KEPT).filter(|&seed| run(seed)).count();
    assert!(jobs / 2 < possible as u64, "only {possible} jobs were possible");
}
