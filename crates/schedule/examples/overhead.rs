//! Measures what the walk by rank itself costs, and how busy it keeps workers on a board of tiles.
//!
//! `cargo run --release -p schedule --example overhead`

use std::sync::atomic::AtomicBool;
use std::time::Instant;

use schedule::{RankedTasks, Workers, in_rank_order, simulate};

fn board(rows: usize, cols: usize) -> RankedTasks {
    let near = |a: usize, b: usize| a.abs_diff(b) <= 1;
    let touch = |a: usize, b: usize| a != b && near(a / cols, b / cols) && near(a % cols, b % cols);
    let neighbours: Vec<Vec<usize>> =
        (0..rows * cols).map(|a| (0..rows * cols).filter(|&b| touch(a, b)).collect()).collect();
    let ranks: Vec<_> = (0..rows * cols).map(|t| (2 * (t / cols % 2) + t % cols % 2, t)).collect();
    RankedTasks::new(&ranks, &neighbours)
}

fn main() {
    let (plan, stop) = (board(6, 6), AtomicBool::new(false));
    for count in [1, 2, 8] {
        let workers = Workers::new(count);
        let mut times: Vec<f64> = (0..200)
            .map(|_| {
                let start = Instant::now();
                let run = in_rank_order(&plan, &workers, &stop, Ok::<usize, String>, |_, _| ());
                assert!(run.is_ok(), "trivial tasks succeed");
                start.elapsed().as_secs_f64() * 1e3
            })
            .collect();
        times.sort_by(f64::total_cmp);
        println!("36 trivial tasks, {count} workers: median {:.3} ms, worst {:.3} ms", times[100], times[199]);
    }
    // Mountains cost several times what plains do.
    let uneven: Vec<f64> = (0..36).map(|task| 1.0 + f64::from((task * 7919 + 13) % 31) / 7.5).collect();
    for workers in [1, 2, 4, 8, 16] {
        let even = simulate(&plan, workers, &[1.0; 36]);
        let mixed = simulate(&plan, workers, &uneven);
        println!(
            "{workers:2} workers on 6 x 6 tiles: busy {:5.1} % (even tiles), {:5.1} % (uneven 1 : 5)",
            even.busy * 100.0,
            mixed.busy * 100.0
        );
    }
}
