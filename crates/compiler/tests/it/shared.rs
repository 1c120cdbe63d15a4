//! Processes that share a directory: units of work in any order, workers side by side, the bytes of a build.

use std::cell::Cell;
use std::path::Path;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

use compiler::{CompileError, Options, Sharing, Unit, UnitEnd};
use engine::Lease;
use job::Job;
use terrain::TileId;

use crate::modes;
use crate::scene::{Scene, Silent, Words, assert_same, sample_dem, tile};

fn perform(scene: &Scene, units: &[Unit]) -> Result<UnitEnd, CompileError> {
    let options = Options { workers: 1, fresh: false, stop: &AtomicBool::new(false) };
    compiler::perform(&scene.job, &scene.path("area"), units, &options, &mut Silent)
}

fn tiles() -> Vec<TileId> {
    let mut tiles: Vec<TileId> = (0..3).flat_map(|row| (0..3).map(move |col| tile(row, col))).collect();
    tiles.sort_by_key(|tile| (2 * (tile.row % 2) + tile.col % 2, tile.row, tile.col));
    tiles
}

/// Every unit in an order in which it may be done, each in a session of its own as processes would.
#[track_caller]
fn by_units(scene: &Scene, surveys: bool) {
    if surveys {
        tiles().into_iter().rev().for_each(|tile| assert!(perform(scene, &[Unit::Survey(tile)]).is_ok()));
    }
    perform(scene, &[Unit::Allocate]).unwrap();
    for tile in tiles() {
        perform(scene, &[Unit::Refine(tile)]).unwrap();
        // Once more does no harm.
        perform(scene, &[Unit::Refine(tile)]).unwrap();
    }
    tiles().into_iter().for_each(|tile| assert!(perform(scene, &[Unit::Assemble(tile)]).is_ok()));
    let end = perform(scene, &[Unit::Publish]).unwrap();
    let UnitEnd::Published(built) = end else { panic!("not published: {end:?}") };
    built.database.remove_work().unwrap();
}

#[test]
fn units_of_work_one_by_one_give_the_bytes_of_a_build() {
    let picked = ["optimised", "paper", "limits that bind, with a pool", "clip, paper", "clip, limits that bind"];
    let is_picked = |name: &str| picked.contains(&name) || name.contains("levels of detail");
    for mode in modes::all().into_iter().filter(|mode| is_picked(mode.0)) {
        let scene = modes::scene(&mode);
        drop(scene.build("alone", 2));
        by_units(&scene, ["optimised", "limits that bind, with a pool", "levels of detail"].contains(&mode.0));
        assert_same(&scene.product("alone"), &scene.product("area"), mode.0);
        scene.verify("area");
    }
}

#[test]
fn a_unit_whose_needs_are_not_done_is_worth_trying_again() {
    let scene = Scene::new(&Words::sample());
    for (units, needs) in [
        (vec![Unit::Allocate], "survey-r00c00"),
        (vec![Unit::Refine(tile(0, 0))], "allocate"),
        (vec![Unit::Assemble(tile(0, 0))], "refine-r00c00"),
    ] {
        let error = perform(&scene, &units).unwrap_err();
        assert!(error.is_transient() && error.to_string().contains(needs), "{error}");
    }
}

#[test]
fn a_published_tile_that_is_damaged_takes_its_mark_back() {
    let scene = Scene::new(&Words { tin: "method = \"greedy\"\nallocation = \"equal\"".into(), ..Words::sample() });
    drop(scene.build("alone", 2));
    perform(&scene, &[Unit::Allocate, Unit::Refine(tile(0, 0)), Unit::Refine(tile(0, 2))]).unwrap();
    std::fs::write(scene.path("area/tiles/r00c00.tin"), b"spoilt").unwrap();
    let error = perform(&scene, &[Unit::Refine(tile(0, 1))]).unwrap_err();
    assert!(error.is_transient() && error.to_string().contains("refine-r00c00"), "{error}");
    perform(&scene, &[Unit::Refine(tile(0, 0)), Unit::Refine(tile(0, 1))]).unwrap();
    // Publishing makes whatever is missing.
    let UnitEnd::Published(built) = perform(&scene, &[Unit::Publish]).unwrap() else { panic!("not published") };
    built.database.remove_work().unwrap();
    drop(built);
    assert_same(&scene.product("alone"), &scene.product("area"), "after damage");
}

/// Two jobs of one area, whose bytes differ.
fn two_jobs() -> [Scene; 2] {
    let equal = "method = \"greedy\"\nallocation = \"equal\"";
    [equal, ""].map(|tin| Scene::new(&Words { tin: tin.into(), ..Words::sample() }))
}

/// Does units of one job's work in another's folder.
fn perform_in(folder: &Path, job: &Job, units: &[Unit]) -> UnitEnd {
    let options = Options { workers: 1, fresh: false, stop: &AtomicBool::new(false) };
    compiler::perform(job, folder, units, &options, &mut Silent).unwrap()
}

/// All units but the surveys of a job in a folder, its report, and `before_sweeping` before its work is swept.
fn finish_in(folder: &Path, job: &Job, before_sweeping: impl FnOnce()) {
    perform_in(folder, job, &[Unit::Allocate]);
    tiles().into_iter().for_each(|tile| drop(perform_in(folder, job, &[Unit::Refine(tile)])));
    tiles().into_iter().for_each(|tile| drop(perform_in(folder, job, &[Unit::Assemble(tile)])));
    let UnitEnd::Published(built) = perform_in(folder, job, &[Unit::Publish]) else { panic!("not published") };
    built.database.write_json(database::files::REPORT, &built.report).unwrap();
    before_sweeping();
    built.work.as_ref().unwrap().sweep();
}

fn survey_in(folder: &Path, job: &Job) {
    tiles().into_iter().for_each(|tile| drop(perform_in(folder, job, &[Unit::Survey(tile)])));
}

#[test]
fn a_build_of_another_job_that_begins_as_one_ends_keeps_its_work() {
    let [first, next] = two_jobs();
    let folder = first.path("area");
    drop(next.build("area", 2));
    finish_in(&folder, &first.job, || survey_in(&folder, &next.job));
    finish_in(&folder, &next.job, || ());
    assert_same(&next.product("area"), &first.product("area"), "the second job");
    first.verify("area");
}

#[test]
fn a_worker_that_was_slow_while_its_build_ended_and_another_began_does_no_harm() {
    let [first, next] = two_jobs();
    let folder = first.path("area");
    drop(next.build("area", 2));
    let is_first = Cell::new(true);
    let now = || {
        if is_first.replace(false) {
            finish_in(&folder, &first.job, || survey_in(&folder, &next.job));
        }
        Duration::ZERO
    };
    let (wait, holding) = (|_: Duration| {}, |_: Option<Lease>| {});
    let second = Duration::from_secs(1);
    let sharing = Sharing { name: "slow", lease: second, pause: second, now: &now, wait: &wait, holding: &holding };
    let options = Options { workers: 1, fresh: false, stop: &AtomicBool::new(false) };
    let end = compiler::work(&first.job, &folder, &options, &sharing, &mut Silent).unwrap();
    assert!(end.units == 0 && end.published.is_none(), "{end:?}");
    finish_in(&folder, &next.job, || ());
    assert_same(&next.product("area"), &first.product("area"), "the second job");
}

#[test]
fn workers_side_by_side_give_the_bytes_of_a_build() {
    let words = Words::raster();
    let scene = Scene::on(&words, &sample_dem(words.grid(), 1));
    drop(scene.build("alone", 2));
    let work = |name: &str| {
        let clock = Cell::new(Duration::ZERO);
        let stop = AtomicBool::new(false);
        let sharing = Sharing {
            name,
            lease: Duration::from_secs(3600),
            pause: Duration::from_millis(1),
            now: &|| clock.get(),
            wait: &|pause| {
                clock.set(clock.get() + pause);
                std::thread::yield_now();
            },
            holding: &|_| {},
        };
        let options = Options { workers: 1, fresh: false, stop: &stop };
        let end = compiler::work(&scene.job, &scene.path("area"), &options, &sharing, &mut Silent).unwrap();
        if let Some(built) = &end.published {
            built.database.write_json(database::files::REPORT, &built.report).unwrap();
            built.database.remove_work().unwrap();
        }
        (end.units, end.published.is_some())
    };
    let ends = std::thread::scope(|scope| {
        let started = ["one", "two", "three"].map(|name| scope.spawn(move || work(name)));
        started.map(|thread| thread.join().unwrap())
    });
    let units: usize = ends.iter().map(|(units, _)| units).sum();
    // Nine tiles in three stages, one allocation, one publication.
    assert_eq!((units, ends.iter().filter(|(_, published)| *published).count()), (29, 1), "{ends:?}");
    assert_same(&scene.product("alone"), &scene.product("area"), "three workers");
    scene.verify("area");
    assert_eq!(work("late"), (0, false));
}

#[test]
fn a_build_and_a_worker_keep_out_of_each_others_way() {
    let scene = Scene::new(&Words::sample());
    let built = scene.build("area", 1);
    let error = perform(&scene, &[Unit::Survey(tile(0, 0))]).unwrap_err();
    assert!(error.is_transient(), "{error}");
    drop(built);
}
