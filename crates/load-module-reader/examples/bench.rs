//! How fast the ground answers: `bench DIR [QUERIES]` on a terrain database.
//!
//! Prints heights a second over random places of the whole area, around an observer and along a drive, lines of sight
//! a second, and the time to load a block of 15 x 15 load modules: the first time, and from the system's cache.
//! Seconds of queries are those of the processor where the system tells them, so that a busy machine disturbs less.

use std::hint::black_box;
use std::time::Instant;

use fastrand::Rng;
use load_module_reader::{Area, Keep, LoadedGround, ReadError, Sight};

/// Seconds this thread has run, or else seconds on the clock.
fn seconds(start: Instant) -> f64 {
    let told = std::fs::read_to_string("/proc/thread-self/schedstat").ok();
    let nanoseconds = told.and_then(|text| text.split_whitespace().next().and_then(|word| word.parse::<f64>().ok()));
    nanoseconds.map_or_else(|| start.elapsed().as_secs_f64(), |nanoseconds| nanoseconds / 1e9)
}

fn main() -> Result<(), ReadError> {
    let mut arguments = std::env::args().skip(1);
    let dir = arguments.next().unwrap_or_else(|| "ntc.tdb".into());
    let queries: usize = arguments.next().and_then(|text| text.parse().ok()).unwrap_or(5_000_000);
    let start = Instant::now();
    let area = Area::open(&dir, Keep::OnDisk)?;
    println!("open: {:.2} ms", start.elapsed().as_secs_f64() * 1e3);
    load_blocks(&area)?;
    let start = Instant::now();
    let ground = area.load(area.whole())?;
    let modules = ground.modules().len();
    println!("load all {modules} load modules: {:.0} ms", start.elapsed().as_secs_f64() * 1e3);
    heights(&area, &ground, queries);
    sights(&area, &ground, queries / 50);
    Ok(())
}

fn size_m(area: &Area) -> [f64; 2] {
    let frame = area.frame();
    [f64::from(frame.cols) * frame.side_m(), f64::from(frame.rows) * frame.side_m()]
}

/// 15 x 15 load modules around random places; each timing loads a whole block anew.
fn load_blocks(area: &Area) -> Result<(), ReadError> {
    let (mut draw, size, origin) = (Rng::with_seed(1), size_m(area), area.frame().origin_m);
    let mut times = Vec::new();
    for _ in 0..50 {
        let place = [0, 1].map(|axis| origin[axis] + size[axis] * (0.1 + 0.8 * draw.f64()));
        let block = area.block_around(place, 7);
        let start = Instant::now();
        black_box(area.load(block)?);
        times.push(start.elapsed().as_secs_f64() * 1e3);
    }
    let first = times[0];
    times.sort_by(f64::total_cmp);
    println!(
        "block of 15 x 15: first {first:.2} ms, best {:.2}, median {:.2}, worst {:.2}",
        times[0], times[25], times[49]
    );
    Ok(())
}

fn heights(area: &Area, ground: &LoadedGround, queries: usize) {
    let (mut draw, size, origin) = (Rng::with_seed(2), size_m(area), area.frame().origin_m);
    let random: Vec<[f64; 2]> =
        (0..queries).map(|_| [0, 1].map(|axis| origin[axis] + size[axis] * draw.f64())).collect();
    // A drive from the south-west to the north-east, a query every 5 cm or so.
    let drive: Vec<[f64; 2]> =
        (0..queries).map(|i| [0, 1].map(|axis| origin[axis] + size[axis] * i as f64 / queries as f64)).collect();
    // What a simulator asks: anywhere within 3.5 km of the observer.
    let around: Vec<[f64; 2]> = (0..queries)
        .map(|_| [0, 1].map(|axis| origin[axis] + size[axis] / 2.0 + 7000.0 * (draw.f64() - 0.5)))
        .collect();
    let clock = Instant::now();
    for (name, places) in [("random places of the area", &random), ("around an observer", &around), ("a drive", &drive)]
    {
        let mut best = f64::INFINITY;
        for _ in 0..5 {
            let start = seconds(clock);
            let sum: f64 = places.iter().map(|&place| ground.height_m(place).unwrap_or(f64::NAN)).sum();
            best = best.min(seconds(clock) - start);
            assert!(!black_box(sum).is_nan() || name == "around an observer", "every place of the area has a height");
        }
        let mut at_once = f64::INFINITY;
        let mut found = vec![0.0; queries];
        for _ in 0..5 {
            let start = seconds(clock);
            ground.heights_m(places, &mut found);
            at_once = at_once.min(seconds(clock) - start);
            black_box(&found);
        }
        let [one, many] = [best, at_once].map(|seconds| queries as f64 / seconds / 1e6);
        println!("heights, {name}: {one:.1} million a second on one core, {many:.1} many at once");
    }
}

fn sights(area: &Area, ground: &LoadedGround, queries: usize) {
    let (mut draw, size, origin) = (Rng::with_seed(3), size_m(area), area.frame().origin_m);
    let mut place = || [0, 1].map(|axis| origin[axis] + size[axis] * (0.1 + 0.8 * draw.f64()));
    let pairs: Vec<[[f64; 3]; 2]> = (0..queries)
        .map(|_| {
            let (a, b) = (place(), place());
            let length = (b[0] - a[0]).hypot(b[1] - a[1]).max(1.0);
            let b = [0, 1].map(|axis| a[axis] + (b[axis] - a[axis]) * 3500.0 / length);
            [a, b].map(|[x, y]| [x, y, ground.height_m([x, y]).unwrap_or(0.0) + 2.5])
        })
        .collect();
    let clock = Instant::now();
    let start = seconds(clock);
    let free = pairs.iter().filter(|[a, b]| ground.sight(*a, *b) == Sight::Free).count();
    let thousands = queries as f64 / (seconds(clock) - start) / 1e3;
    println!("lines of sight of 3.5 km: {thousands:.0} thousand a second on one core, {free} of {queries} free");
}
