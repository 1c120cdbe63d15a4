//! Measures mending, rounding and heights on a synthetic grid of roads: `measure KILOMETRES_WIDE LINES_EACH_WAY`.
//!
//! The grid lies over an area 1000 km long; its stations are 25 m apart. With 1000 and 50 it has 100,000 km of road.

use std::time::Instant;

use features::{
    Below, FeatureId, GradeOptions, Network, Numbering, Position, Shape, Site, Source, grade, mend, round, sides,
    sort_out,
};
use terrain::{Post, PostRect, Spacing, in_turn};

const POSTS_LONG: i32 = 40_000;

fn roads(posts_wide: i32, lines: i32) -> Vec<Source> {
    let mut roads = Vec::new();
    let mut road = |from: (i32, i32), to: (i32, i32)| {
        // A bend every kilometre, so that lines are not along rows and columns.
        let count = ((to.0 - from.0).max(to.1 - from.1) / 40).max(1);
        let at = |n: i32| {
            let wave = f64::from((n * 7919) % 13) * 0.37;
            let along = |a: i32, b: i32| f64::from(a) + f64::from(b - a) * f64::from(n) / f64::from(count);
            Position::new(along(from.0, to.0) + wave, along(from.1, to.1) + wave)
        };
        let id = FeatureId { source: 0, numbering: Numbering::Way, number: roads.len() as i64 };
        let tags = vec![("highway".to_owned(), "primary".to_owned())];
        roads.push(Source { id, tags, kind: None, shape: Shape::Line((0..=count).map(at).collect()) });
    };
    let across = (i64::from(lines) * i64::from(posts_wide) / i64::from(POSTS_LONG)).max(1) as i32;
    for line in 0..lines {
        let row = POSTS_LONG / lines * line + 100;
        road((0, row), (posts_wide, row));
    }
    for line in 0..across {
        let col = posts_wide / across * line + 100;
        road((col, 0), (col, POSTS_LONG));
    }
    roads
}

/// The greatest resident memory so far, in megabytes, where the system tells it.
fn peak_mb() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
    let kilobytes = line.and_then(|line| line.split_whitespace().next()?.parse::<u64>().ok());
    kilobytes.unwrap_or(0) / 1024
}

fn main() {
    let mut arguments = std::env::args().skip(1).map(|word| word.parse::<i32>().expect("a whole number"));
    let (wide_km, lines) = (arguments.next().unwrap_or(100), arguments.next().unwrap_or(50));
    let posts_wide = wide_km * 40;
    let area = PostRect::new(Post::new(0, 0), Post::new(POSTS_LONG, posts_wide));
    let site = Site::new(Spacing::from_metres(25.0).expect("25 m"), area, 20, 200);
    let mut clock = Instant::now();
    let mut lap = |what: &str| {
        println!("{what}: {:.2} s, peak {} MB", clock.elapsed().as_secs_f64(), peak_mb());
        clock = Instant::now();
    };
    let sources = roads(posts_wide, lines);
    lap("roads");
    let mended = mend(sort_out(sources, &[], 1.5).features, &site);
    lap("sorted out and mended");
    let rounded = round(mended, &site, &in_turn);
    lap("rounded");
    let mut remarks = Vec::new();
    let network = Network::of(&rounded.ways, site.lattice, &mut remarks);
    drop(rounded);
    lap("network");
    let hills = |post: f64| ((post * 0.01).fract() - 0.5).abs();
    let ground = |place| {
        let [east, north] = site.lattice.posts_of(place);
        Some(((hills(east) + hills(north * 1.3) + hills(east * 7.1 + north) * 0.2) * 40_000.0) as i32)
    };
    let ground: Vec<Option<i32>> = network.nodes.iter().map(|node| ground(node.place)).collect();
    lap("ground");
    let heights = grade(&network, [&ground; 2], &[], Below::WAYS, GradeOptions::USUAL, &mut remarks);
    lap("grade");
    let moved = heights.iter().zip(&ground).filter(|(height, ground)| Some(**height) != **ground).count();
    let stations = network.nodes.len();
    println!("sides: {}", sides(&network).len());
    lap("sides");
    println!(
        "{stations} stations, {:.0} km, {moved} off the ground, {} bytes a station in the network",
        network.edges.iter().map(|edge| f64::from(edge.length)).sum::<f64>() / 128_000.0,
        network.bytes() / stations.max(1),
    );
}
