//! Processes that share a directory: units of work in any order, workers side by side, the bytes of a build.

use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use build::{CompileError, Event, Options, Progress, Sharing, Stage, Unit, UnitEnd};
use job::Job;
use terrain::TileId;

use crate::modes;
use crate::scene::{Scene, SetBy, Silent, Words, assert_same, options, sample_dem, tile};

pub fn perform(scene: &Scene, units: &[Unit]) -> Result<UnitEnd, CompileError> {
    build::perform(&scene.job, &scene.path("area"), units, &options(1, &false.into()), &mut Silent)
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
        tiles().into_iter().rev().for_each(|tile| assert!(perform(scene, &[Unit::of(Stage::Survey, tile)]).is_ok()));
    }
    perform(scene, &[Unit::whole(Stage::Allocate)]).unwrap();
    for tile in tiles() {
        perform(scene, &[Unit::of(Stage::Refine, tile)]).unwrap();
        // Once more does no harm.
        perform(scene, &[Unit::of(Stage::Refine, tile)]).unwrap();
    }
    tiles().into_iter().for_each(|tile| assert!(perform(scene, &[Unit::of(Stage::Assemble, tile)]).is_ok()));
    let end = perform(scene, &[Unit::whole(Stage::Publish)]).unwrap();
    assert!(matches!(end, UnitEnd::Published(_)), "not published: {end:?}");
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
        (vec![Unit::whole(Stage::Allocate)], "survey-r00c00"),
        (vec![Unit::of(Stage::Refine, tile(0, 0))], "allocate"),
        (vec![Unit::of(Stage::Assemble, tile(0, 0))], "refine-r00c00"),
    ] {
        let error = perform(&scene, &units).unwrap_err();
        assert!(error.is_transient() && error.to_string().contains(needs), "{error}");
    }
}

#[test]
fn a_published_tile_that_is_damaged_takes_its_mark_back() {
    let scene = Scene::new(&Words { tin: "method = \"greedy\"\nallocation = \"equal\"".into(), ..Words::sample() });
    drop(scene.build("alone", 2));
    perform(
        &scene,
        &[Unit::whole(Stage::Allocate), Unit::of(Stage::Refine, tile(0, 0)), Unit::of(Stage::Refine, tile(0, 2))],
    )
    .unwrap();
    std::fs::write(scene.path("area/tiles/r00c00.tin"), b"spoilt").unwrap();
    let error = perform(&scene, &[Unit::of(Stage::Refine, tile(0, 1))]).unwrap_err();
    assert!(error.is_transient() && error.to_string().contains("refine-r00c00"), "{error}");
    perform(&scene, &[Unit::of(Stage::Refine, tile(0, 0)), Unit::of(Stage::Refine, tile(0, 1))]).unwrap();
    // Publishing makes whatever is missing.
    assert!(matches!(perform(&scene, &[Unit::whole(Stage::Publish)]).unwrap(), UnitEnd::Published(_)));
    assert_same(&scene.product("alone"), &scene.product("area"), "after damage");
}

#[test]
fn who_comes_to_a_finished_build_removes_what_the_process_that_published_left() {
    let scene = Scene::new(&Words { tin: "method = \"greedy\"\nallocation = \"equal\"".into(), ..Words::sample() });
    drop(scene.build("alone", 2));
    let (area, mut of_run) = (scene.path("area"), None);
    finish_in(&area, &scene.job, || of_run = std::fs::read_dir(area.join("work")).unwrap().next());
    let done = of_run.unwrap().unwrap().path().join("done");
    // As if it was ended between its last two steps: `database.json` says complete, and work is still there.
    for unit in [Unit::whole(Stage::Publish), Unit::of(Stage::Refine, tile(0, 0))] {
        std::fs::create_dir_all(&done).unwrap();
        std::fs::write(done.join("allocate"), b"0").unwrap();
        std::fs::write(area.join(".tiefort-x.part"), b"half").unwrap();
        let end = perform(&scene, &[unit]).unwrap();
        assert!(matches!(end, UnitEnd::Finished(_)), "{unit}: {end:?}");
        assert!(!area.join("work").exists() && !area.join(".tiefort-x.part").exists(), "{unit}");
        assert_same(&scene.product("alone"), &scene.product("area"), "after it was swept");
    }
}

/// Two jobs of one area, whose bytes differ.
fn two_jobs() -> [Scene; 2] {
    let equal = "method = \"greedy\"\nallocation = \"equal\"";
    [equal, ""].map(|tin| Scene::new(&Words { tin: tin.into(), ..Words::sample() }))
}

/// Does units of one job's work in another's folder.
fn perform_in(folder: &Path, job: &Job, units: &[Unit]) -> UnitEnd {
    build::perform(job, folder, units, &options(1, &false.into()), &mut Silent).unwrap()
}

/// Does something when a stage ends.
struct When<F: FnMut() + Send>(Stage, F);

impl<F: FnMut() + Send> Progress for When<F> {
    fn tell(&mut self, event: Event) {
        if event == Event::Leave(self.0) {
            self.1();
        }
    }
}

/// All units but the surveys of a job in a folder, and `before_sweeping` before its work is swept.
fn finish_in(folder: &Path, job: &Job, before_sweeping: impl FnMut() + Send) {
    perform_in(folder, job, &[Unit::whole(Stage::Allocate)]);
    tiles().into_iter().for_each(|tile| drop(perform_in(folder, job, &[Unit::of(Stage::Refine, tile)])));
    tiles().into_iter().for_each(|tile| drop(perform_in(folder, job, &[Unit::of(Stage::Assemble, tile)])));
    let (stop, mut hook) = (AtomicBool::new(false), When(Stage::Publish, before_sweeping));
    let end = build::perform(job, folder, &[Unit::whole(Stage::Publish)], &options(1, &stop), &mut hook).unwrap();
    assert!(matches!(end, UnitEnd::Published(_)), "{end:?}");
}

fn survey_in(folder: &Path, job: &Job) {
    tiles().into_iter().for_each(|tile| drop(perform_in(folder, job, &[Unit::of(Stage::Survey, tile)])));
}

/// Whether a build of another job that would begin in the folder now is told to try again.
#[track_caller]
fn is_kept_out(folder: &Path, job: &Job) {
    let survey = [Unit::of(Stage::Survey, tile(0, 0))];
    let error = build::perform(job, folder, &survey, &options(1, &false.into()), &mut Silent).unwrap_err();
    assert!(error.is_transient() && error.to_string().contains("other processes"), "{error}");
}

#[test]
fn a_build_of_another_job_begins_once_one_has_ended() {
    let [first, next] = two_jobs();
    let folder = first.path("area");
    drop(next.build("area", 2));
    finish_in(&folder, &first.job, || is_kept_out(&folder, &next.job));
    survey_in(&folder, &next.job);
    finish_in(&folder, &next.job, || ());
    assert_same(&next.product("area"), &first.product("area"), "the second job");
    first.verify("area");
}

#[test]
fn as_long_as_a_slow_worker_is_there_no_build_of_another_job_begins() {
    let [first, next] = two_jobs();
    let folder = first.path("area");
    drop(next.build("area", 2));
    // It has read its ground and joined when it looks at the clock for its first lease.
    let (has_read, is_first) = (AtomicBool::new(false), AtomicBool::new(true));
    let clock = || {
        if has_read.load(Ordering::Relaxed) && is_first.swap(false, Ordering::Relaxed) {
            finish_in(&folder, &first.job, || ());
            is_kept_out(&folder, &next.job);
        }
        Duration::ZERO
    };
    let second = Duration::from_secs(1);
    let sharing = Sharing { name: "slow", lease: second, pause: second, holding: &|_| {} };
    let (stop, mut read) = (AtomicBool::new(false), When(Stage::Read, || has_read.store(true, Ordering::Relaxed)));
    let clock = SetBy(clock);
    let options = Options { clock: &clock, ..options(1, &stop) };
    let end = build::work(&first.job, &folder, &options, &sharing, &mut read).unwrap();
    assert!(!is_first.load(Ordering::Relaxed) && end.units == 0 && end.built.is_unchanged, "{end:?}");
    drop(end);
    survey_in(&folder, &next.job);
    finish_in(&folder, &next.job, || ());
    assert_same(&next.product("area"), &first.product("area"), "the second job");
}

#[test]
fn workers_side_by_side_give_the_bytes_of_a_build() {
    let words = Words::raster();
    let scene = Scene::on(&words, &sample_dem(words.grid(), 1));
    drop(scene.build("alone", 2));
    let work = |name: &str| {
        let stop = AtomicBool::new(false);
        let sharing =
            Sharing { name, lease: Duration::from_secs(3600), pause: Duration::from_millis(1), holding: &|_| {} };
        let options = options(1, &stop);
        let end = build::work(&scene.job, &scene.path("area"), &options, &sharing, &mut Silent).unwrap();
        (end.units, !end.built.is_unchanged)
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
    let error = perform(&scene, &[Unit::of(Stage::Survey, tile(0, 0))]).unwrap_err();
    assert!(error.is_transient(), "{error}");
    drop(built);
}
