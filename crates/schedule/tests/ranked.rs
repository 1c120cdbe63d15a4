//! The rules of the walk by rank, traced: order, neighbours, results, panics, errors, stopping.

// A test that unwraps says where it failed, which is all a test has to say.
#![allow(clippy::unwrap_used)]

use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::time::{Duration, Instant};

use schedule::{Event, RankedTasks, ScheduleError, Workers, in_rank_order, in_rank_order_observed};

const ROWS: usize = 6;
const COLS: usize = 6;
const TASKS: usize = ROWS * COLS;

fn touch(a: usize, b: usize) -> bool {
    a != b && (a / COLS).abs_diff(b / COLS) <= 1 && (a % COLS).abs_diff(b % COLS) <= 1
}

fn neighbours() -> Vec<Vec<usize>> {
    (0..TASKS).map(|task| (0..TASKS).filter(|&other| touch(task, other)).collect()).collect()
}

fn four_colours() -> RankedTasks {
    let ranks: Vec<_> = (0..TASKS).map(|t| (2 * (t / COLS % 2) + t % COLS % 2, t)).collect();
    RankedTasks::new(&ranks, &neighbours())
}

fn raster_order() -> RankedTasks {
    RankedTasks::new(&(0..TASKS).collect::<Vec<_>>(), &neighbours())
}

/// Every order in which a plan may hand out its ready tasks that these tests try.
fn variants() -> Vec<RankedTasks> {
    let plans = [four_colours(), raster_order()];
    let orders = |plan: &RankedTasks| {
        std::iter::once(plan.clone()).chain((1..=6).map(|seed| plan.clone().shuffled(seed))).collect::<Vec<_>>()
    };
    plans.iter().flat_map(orders).collect()
}

/// A few microseconds to milliseconds of work, so that tasks really overlap.
fn busy(task: usize) -> u64 {
    (0..(task as u64 * 7919 % 13) * 4000).fold(task as u64, |sum, i| sum.wrapping_mul(31).wrapping_add(i))
}

/// A task whose result depends on its lower-ranked neighbours' results, as a tile's does.
fn chained(plan: &RankedTasks, workers: usize) -> Vec<u64> {
    let published: Vec<Mutex<Option<u64>>> = (0..TASKS).map(|_| Mutex::new(None)).collect();
    let task = |t: usize| {
        let read = |&other: &usize| published[other].lock().unwrap().expect("published before it is read");
        let result = plan.lower(t).iter().map(read).fold(busy(t), |sum, seed| sum.wrapping_mul(7).wrapping_add(seed));
        *published[t].lock().unwrap() = Some(result);
        Ok::<_, String>(result)
    };
    in_rank_order(plan, &Workers::new(workers), &AtomicBool::new(false), task, |_, _| ()).unwrap()
}

#[test]
fn results_are_the_same_for_any_workers_and_any_ready_order() {
    for base in [four_colours(), raster_order()] {
        let expected = chained(&base, 1);
        for workers in [1, 2, 8] {
            for seed in 0..6 {
                assert_eq!(chained(&base.clone().shuffled(seed), workers), expected, "workers {workers}, seed {seed}");
            }
            assert_eq!(chained(&base, workers), expected);
        }
    }
}

#[test]
fn no_two_neighbours_are_ever_in_progress_together() {
    for plan in variants() {
        for workers in [1, 2, 8] {
            // Seen from inside the tasks, and once more from the events told.
            let running = Mutex::new(Vec::new());
            let task = |t: usize| {
                let mut now = running.lock().unwrap();
                assert!(!now.iter().any(|&other| touch(t, other)), "task {t} started beside {now:?}");
                now.push(t);
                drop(now);
                let result = busy(t);
                running.lock().unwrap().retain(|&other| other != t);
                Ok::<_, String>(result)
            };
            let mut open: Vec<usize> = Vec::new();
            let mut most = 0;
            let observe = |event: Event<u64>| match event {
                Event::Started(t) => {
                    assert!(!open.iter().any(|&other| touch(t, other)));
                    open.push(t);
                    most = most.max(open.len());
                }
                Event::Done(t, _) => open.retain(|&other| other != t),
            };
            in_rank_order_observed(&plan, &Workers::new(workers), &AtomicBool::new(false), task, observe).unwrap();
            assert!(open.is_empty() && most <= workers);
        }
    }
}

#[test]
fn as_many_tasks_run_at_once_as_there_are_workers() {
    for workers in [1, 2, 8] {
        // The first tasks, which have no neighbours of lower rank, wait for each other.
        let (plan, arrived) = (four_colours(), AtomicUsize::new(0));
        let task = |t: usize| {
            if plan.place(t) < workers {
                arrived.fetch_add(1, Ordering::Relaxed);
                let begun = Instant::now();
                while arrived.load(Ordering::Relaxed) < workers {
                    assert!(begun.elapsed() < Duration::from_secs(60), "task {t} was left alone");
                    std::thread::yield_now();
                }
            }
            Ok::<_, String>(())
        };
        in_rank_order(&plan, &Workers::new(workers), &AtomicBool::new(false), task, |_, _| ()).unwrap();
    }
}

#[test]
fn a_task_starts_after_all_its_lower_ranked_neighbours_were_told_done() {
    for plan in variants() {
        let mut done = [false; TASKS];
        let observe = |event: Event<()>| match event {
            Event::Started(t) => assert!(plan.lower(t).iter().all(|&other| done[other])),
            Event::Done(t, ()) => done[t] = true,
        };
        let task = |_| Ok::<_, String>(());
        in_rank_order_observed(&plan, &Workers::new(2), &AtomicBool::new(false), task, observe).unwrap();
        assert!(done.iter().all(|&d| d));
    }
}

#[test]
fn one_worker_walks_in_rank_order_on_the_calling_thread() {
    let (plan, caller) = (four_colours(), std::thread::current().id());
    let order = Mutex::new(Vec::new());
    let task = |t: usize| {
        assert_eq!(std::thread::current().id(), caller);
        order.lock().unwrap().push(plan.place(t));
        Ok::<_, String>(())
    };
    in_rank_order(&plan, &Workers::new(1), &AtomicBool::new(false), task, |_, _| ()).unwrap();
    assert_eq!(order.into_inner().unwrap(), (0..TASKS).collect::<Vec<_>>());
}

#[test]
fn a_panic_in_a_task_fails_the_run_with_the_task_named() {
    for workers in [1, 2, 8] {
        for bad in [0, 7, 35] {
            let finished = AtomicUsize::new(0);
            let task = |t: usize| {
                assert!(t != bad, "tile {t} holds no such vertex");
                finished.fetch_add(1, Ordering::Relaxed);
                Ok::<_, String>(())
            };
            let mut told = 0;
            let ended =
                in_rank_order(&four_colours(), &Workers::new(workers), &AtomicBool::new(false), task, |_, _| told += 1);
            let message = format!("tile {bad} holds no such vertex");
            assert_eq!(ended, Err(ScheduleError::Panicked { task: bad, message }));
            assert_eq!(told, finished.into_inner(), "what was running has finished and was told");
        }
    }
}

#[test]
fn an_error_stops_the_run_and_comes_back_whole() {
    for workers in [1, 2, 8] {
        let plan = four_colours();
        let task = |t: usize| if plan.place(t) < 5 { Ok(()) } else { Err(format!("place {}", plan.place(t))) };
        let ended = in_rank_order(&plan, &Workers::new(workers), &AtomicBool::new(false), task, |_, _| ());
        // Place 5 is handed out before any later one, so it is always among those that ran.
        let first = (0..TASKS).find(|&t| plan.place(t) == 5).unwrap();
        assert_eq!(ended, Err(ScheduleError::Failed { task: first, error: "place 5".into() }));
    }
}

#[test]
fn a_raised_flag_keeps_what_is_done_and_starts_nothing_more() {
    for workers in [1, 2, 8] {
        let (plan, stop) = (four_colours(), AtomicBool::new(false));
        let started = AtomicUsize::new(0);
        let task = |t: usize| {
            started.fetch_add(1, Ordering::Relaxed);
            Ok::<_, String>(t * 10)
        };
        let mut told = 0;
        let on_done = |_: usize, _: &usize| {
            told += 1;
            stop.store(4 <= told, Ordering::Relaxed);
        };
        let ended = in_rank_order(&plan, &Workers::new(workers), &stop, task, on_done);
        let Err(ScheduleError::Stopped { done, tasks }) = ended else { panic!("expected to be stopped") };
        assert_eq!((tasks, done.len()), (TASKS, started.into_inner()));
        assert!(4 <= done.len() && done.len() < 4 + workers, "{} done with {workers} workers", done.len());
        assert!(done.iter().all(|&(t, result)| result == t * 10) && done.is_sorted());
    }
}

#[test]
fn a_flag_raised_by_the_last_task_changes_nothing() {
    let stop = AtomicBool::new(false);
    let plan = RankedTasks::new(&[1, 2], &[vec![1], vec![0]]);
    let task = |t: usize| {
        stop.store(t == 1, Ordering::Relaxed);
        Ok::<_, String>(t)
    };
    assert_eq!(in_rank_order(&plan, &Workers::new(2), &stop, task, |_, _| ()), Ok(vec![0, 1]));
}

#[test]
fn a_panic_in_the_observer_sends_the_workers_home() {
    let run = || {
        let task = |t: usize| Ok::<_, String>(busy(t));
        let on_done = |t: usize, _: &u64| assert!(t != 2, "observer");
        in_rank_order(&four_colours(), &Workers::new(2), &AtomicBool::new(false), task, on_done)
    };
    assert!(std::panic::catch_unwind(run).is_err());
}

#[test]
fn no_tasks_give_no_results() {
    let plan = RankedTasks::new(&[0_u8; 0], &[]);
    let ended = in_rank_order(&plan, &Workers::new(4), &AtomicBool::new(true), |_| Ok::<(), ()>(()), |_, _| ());
    assert_eq!(ended, Ok(vec![]));
}
