//! What a run leaves in a database is written by the library, and a database is complete only with all of it.

use std::fs;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::Duration;

use build::{Event, Options, Progress, Sharing, Stage, Unit, UnitEnd};
use store::{Folder, Report, files};

use crate::scene::{Scene, SetBy, Silent, Still, Words, assert_same, options, sample_dem, tile};

/// Four tiles from a raster.
fn scene() -> Scene {
    let words = Words { size: (4, 4), tiles: (2, 2), ..Words::raster() };
    Scene::on(&words, &sample_dem(words.grid(), 1))
}

/// Does something at one event.
struct At<F: FnMut() + Send>(Event, F);

impl<F: FnMut() + Send> Progress for At<F> {
    fn tell(&mut self, event: Event) {
        if event == self.0 {
            self.1();
        }
    }
}

/// A report without what times and machines decide: the page tells times, too.
fn timeless(report: &Report) -> Report {
    let mut report = Report { stages: Vec::new(), tiles: Vec::new(), ..report.clone() };
    report.files.remove(files::REPORT_HTML);
    report
}

/// The report of a database that is complete, with everything that a run leaves in it and nothing else.
#[track_caller]
fn complete(scene: &Scene, folder: &str, has_page: bool) -> Report {
    assert!(inspect::status(&scene.path(folder)).unwrap().is_complete());
    scene.verify(folder);
    let there = Folder::new(scene.path(folder));
    for name in [files::REPORT, files::BREACHES, files::BREACHES_CSV] {
        assert!(there.path(name).exists(), "{name} is missing");
    }
    assert_eq!(there.path(files::REPORT_HTML).exists(), has_page, "the page");
    assert!(!there.path("work").exists(), "what processes left for one another is still there");
    there.report().unwrap()
}

/// Builds with a page and a clock that goes on by a second whenever it is looked at.
fn build_with_page(scene: &Scene, folder: &str, progress: &mut dyn Progress) -> build::Built {
    let (now, stop) = (AtomicU64::new(0), AtomicBool::new(false));
    let clock = SetBy(|| Duration::from_secs(now.fetch_add(1, Ordering::Relaxed) + 1));
    build::build(&scene.job, &scene.path(folder), &Options::new(2, &stop, &clock), progress).unwrap()
}

#[test]
fn a_build_by_the_library_alone_leaves_a_database_with_everything_in_it() {
    let scene = scene();
    let built = build_with_page(&scene, "area", &mut Silent);
    let report = complete(&scene, "area", true);
    assert_eq!(timeless(&report), timeless(&built.report));
    let names = |report: &Report| report.stages.iter().map(|row| row.name.clone()).collect::<Vec<_>>();
    let stages = ["read", "survey", "allocate", "refine", "assemble", "publish"].map(str::to_owned).to_vec();
    let and = |more: &[&str]| [&stages[..], &more.iter().map(|&name| name.to_owned()).collect::<Vec<_>>()].concat();
    assert_eq!(names(&report), and(&["between"]));
    assert_eq!(names(&built.report), and(&["page", "between"]), "the page is drawn from what the report says");
    assert!(report.stages.iter().all(|row| 1.0 <= row.wall_s), "{:?}", report.stages);
    let worked_on: Vec<Vec<&str>> =
        report.tiles.iter().map(|tile| tile.seconds.keys().map(String::as_str).collect()).collect();
    assert_eq!(worked_on, vec![vec!["assemble", "refine", "survey"]; 4]);
}

#[test]
fn without_a_page_that_of_an_earlier_build_goes() {
    let scene = scene();
    drop(build_with_page(&scene, "area", &mut Silent));
    scene.replace_dem(&sample_dem(Words { size: (4, 4), ..Words::raster() }.grid(), 2));
    drop(scene.build("area", 2));
    complete(&scene, "area", false);
}

#[test]
fn a_report_does_not_depend_on_who_asks_for_the_build() {
    let scene = scene();
    drop(scene.build("build", 1));
    let expected = complete(&scene, "build", false);

    let stop = AtomicBool::new(false);
    let tiles = [tile(0, 0), tile(0, 1), tile(1, 0), tile(1, 1)];
    let [surveys, refines, assembles] =
        [Stage::Survey, Stage::Refine, Stage::Assemble].map(|stage| tiles.map(|tile| Unit::of(stage, tile)).to_vec());
    let units =
        [surveys, vec![Unit::whole(Stage::Allocate)], refines, assembles, vec![Unit::whole(Stage::Publish)]].concat();
    let end = build::perform(&scene.job, &scene.path("units"), &units, &options(1, &stop), &mut Silent).unwrap();
    assert!(matches!(end, UnitEnd::Published(_)), "{end:?}");

    let second = Duration::from_secs(1);
    let sharing = Sharing { name: "one", lease: second, pause: second, holding: &|_| {} };
    let end = build::work(&scene.job, &scene.path("worker"), &options(1, &stop), &sharing, &mut Silent).unwrap();
    assert!(!end.built.is_unchanged, "{end:?}");

    drop(scene.build("tile", 1));
    let rebuilt =
        build::rebuild_tile(&scene.job, &scene.path("tile"), tile(1, 1), false, &options(1, &stop), &mut Silent);
    drop(rebuilt.unwrap());
    for folder in ["units", "worker", "tile"] {
        assert_eq!(timeless(&complete(&scene, folder, false)), timeless(&expected), "{folder}");
        assert_same(&scene.product("build"), &scene.product(folder), folder);
    }
}

#[test]
fn a_build_that_ends_at_any_step_of_publishing_is_whole_after_the_next() {
    let scene = scene();
    drop(build_with_page(&scene, "undisturbed", &mut Silent));
    let expected = timeless(&complete(&scene, "undisturbed", true));
    let there = Folder::new(scene.path("area"));
    // Where it ended, and what is there then.
    let steps = [
        (Event::Enter(Stage::Publish, 0), false, false),
        (Event::Enter(Stage::Page, 0), false, false),
        (Event::Leave(Stage::Page), false, true),
    ];
    for (event, has_report, has_page) in steps {
        for units in [false, true] {
            let step = format!("{event:?}, {units}");
            let mut ending = At(event.clone(), || panic!("ended here"));
            catch_unwind(AssertUnwindSafe(|| build_with_page(&scene, "area", &mut ending))).unwrap_err();
            assert_eq!(
                (there.path(files::REPORT).exists(), there.path(files::REPORT_HTML).exists()),
                (has_report, has_page)
            );
            assert!(!inspect::status(there.dir()).unwrap().is_complete(), "{step}");
            let verdict = inspect::verify(there.dir(), None).unwrap();
            assert!(verdict.problems.iter().any(|problem| problem.contains("incomplete")), "{step}: {verdict:?}");
            if units {
                let stop = AtomicBool::new(false);
                let whole = Options::new(2, &stop, &Still);
                let end = build::perform(&scene.job, there.dir(), &[Unit::whole(Stage::Publish)], &whole, &mut Silent)
                    .unwrap();
                assert!(matches!(end, UnitEnd::Published(_)), "{step}: {end:?}");
            } else {
                let again = build_with_page(&scene, "area", &mut Silent);
                assert!(!again.is_unchanged && again.kept == 4, "{step}: {again:?}");
            }
            assert_eq!(timeless(&complete(&scene, "area", true)), expected, "{step}");
            assert_same(&scene.product("undisturbed"), &scene.product("area"), &step);
            fs::remove_dir_all(there.dir()).unwrap();
        }
    }
}

#[test]
fn a_finished_database_whose_report_is_gone_gets_it_again_from_any_process() {
    let scene = scene();
    drop(scene.build("area", 1));
    let expected = timeless(&complete(&scene, "area", false));
    for is_shared in [false, true] {
        scene.forget_report("area");
        if is_shared {
            let stop = AtomicBool::new(false);
            let units = [Unit::whole(Stage::Publish)];
            let end = build::perform(&scene.job, &scene.path("area"), &units, &options(1, &stop), &mut Silent);
            assert!(matches!(end, Ok(UnitEnd::Published(_))), "{end:?}");
        } else {
            assert!(!scene.build("area", 1).is_unchanged);
        }
        assert_eq!(timeless(&complete(&scene, "area", false)), expected, "{is_shared}");
    }
    assert!(scene.build("area", 1).is_unchanged);
}

#[test]
fn a_page_is_drawn_with_the_ground_that_the_build_has_open() {
    let scene = scene();
    drop(build_with_page(&scene, "with", &mut Silent));
    let mut gone = At(Event::Enter(Stage::Page, 0), || fs::remove_file(scene.path("dem.tif")).unwrap());
    drop(build_with_page(&scene, "without", &mut gone));
    complete(&scene, "without", true);
    let pictures = |folder: &str| {
        let page = fs::read_to_string(scene.path(folder).join(files::REPORT_HTML)).unwrap();
        page.matches("data:image").count()
    };
    assert_eq!(pictures("without"), pictures("with"), "its source may have gone meanwhile");
}
