//! A build that is asked to stop goes on from there: the bytes are those of an undisturbed one.

use std::sync::atomic::{AtomicBool, Ordering};

use build::{CompileError, Event, Progress, Stage};
use inspect::Sights;
use store::DatabaseError;

use crate::modes;
use crate::scene::{Scene, Words, assert_same, sample_dem, tile};

/// Raises the flag when so many tiles of a stage are done.
struct StopAfter<'a> {
    stage: Stage,
    left: usize,
    flag: &'a AtomicBool,
}

impl Progress for StopAfter<'_> {
    fn tell(&mut self, event: Event) {
        if matches!(event, Event::Done(stage, _) if stage == self.stage) {
            self.left = self.left.saturating_sub(1);
            if self.left == 0 {
                self.flag.store(true, Ordering::SeqCst);
            }
        }
    }
}

/// Builds until so many tiles of a stage are done.
#[track_caller]
fn build_and_stop(scene: &Scene, stage: Stage, tiles: usize, workers: usize) {
    let flag = AtomicBool::new(false);
    let mut progress = StopAfter { stage, left: tiles, flag: &flag };
    let error = scene.build_watched("area", workers, &flag, &mut progress).expect_err("the build was stopped");
    assert!(error.is_stopped() && error.hint().is_some(), "{error}");
    assert!(error.to_string().contains(stage.name()), "{error}");
    let status = inspect::status(&scene.path("area")).unwrap();
    assert!(!status.is_complete() && status.held == store::engine::Held::Free);
    let verdict = inspect::verify(&scene.path("area"), None).unwrap();
    assert!(verdict.problems.iter().any(|problem| problem.contains("incomplete")), "{:?}", verdict.problems);
    let measured = inspect::fidelity(&scene.path("area"), &[], Sights::USUAL);
    assert!(matches!(measured, Err(CompileError::Database(DatabaseError::Unfinished { .. }))), "{measured:?}");
}

#[test]
fn a_stopped_build_goes_on_to_the_bytes_of_an_undisturbed_one() {
    for mode in modes::all().into_iter().filter(|mode| ["optimised", "clip, limits that bind"].contains(&mode.0)) {
        let scene = modes::scene(&mode);
        drop(scene.build("undisturbed", 2));
        let stages: &[Stage] = match mode.0 {
            "optimised" => &[Stage::Survey, Stage::Refine, Stage::Assemble],
            _ => &[Stage::Refine, Stage::Assemble, Stage::Enforce],
        };
        for &stage in stages {
            for (tiles, workers) in [(1, 1), (4, 2)] {
                build_and_stop(&scene, stage, tiles, workers);
                let built = scene.build("area", 2);
                let kept = built.kept;
                drop(built);
                assert!(stage != Stage::Refine || tiles <= kept, "{}: {kept} tiles kept after {tiles}", mode.0);
                assert_same(&scene.product("undisturbed"), &scene.product("area"), &format!("{}: {stage:?}", mode.0));
                std::fs::remove_dir_all(scene.path("area")).unwrap();
            }
        }
    }
}

#[test]
fn a_build_stopped_again_and_again_comes_to_its_end() {
    let scene = Scene::new(&Words::sample());
    drop(scene.build("undisturbed", 2));
    for _ in 0..8 {
        build_and_stop(&scene, Stage::Refine, 1, 1);
    }
    let built = scene.build("area", 1);
    assert_eq!((built.kept, built.rebuilt), (8, 1));
    drop(built);
    assert_same(&scene.product("undisturbed"), &scene.product("area"), "stopped eight times");
}

#[test]
fn a_stopped_update_is_incomplete_until_a_build_ends_it() {
    let words = Words::raster();
    let scene = Scene::on(&words, &sample_dem(words.grid(), 1));
    drop(scene.build("area", 2));
    scene.verify("area");
    scene.replace_dem(&sample_dem(words.grid(), 2));
    build_and_stop(&scene, Stage::Refine, 3, 1);
    // One tile among others of two different DEMs would open cracks.
    let error = scene.try_tile("area", tile(0, 0), false).expect_err("no whole database to go on from");
    assert!(error.to_string().contains("incomplete") && error.hint().is_some(), "{error}");
    assert!(!inspect::status(&scene.path("area")).unwrap().is_complete());
    drop(scene.build("area", 2));
    drop(scene.build("fresh", 2));
    assert_same(&scene.product("fresh"), &scene.product("area"), "the update");
}

#[test]
fn a_second_build_of_a_folder_at_work_is_told_to_try_again() {
    let scene = Scene::new(&Words { size: (4, 4), tiles: (1, 1), ..Words::sample() });
    let first = scene.build("area", 1);
    let error = scene.try_build("area", 1).unwrap_err();
    assert!(error.is_transient() && error.hint().is_some(), "{error}");
    assert_eq!(inspect::status(&scene.path("area")).unwrap().held, store::engine::Held::Alone);
    drop(first);
    assert_eq!(inspect::status(&scene.path("area")).unwrap().held, store::engine::Held::Free);
    drop(scene.build("area", 1));
}
