//! Sources that change while a build reads them: one state of each file, or no database.

use std::fs;
use std::path::Path;
use std::sync::atomic::AtomicBool;

use build::{Event, Progress, Stage};

use crate::scene::{ORIGIN_M, Scene, Words, assert_same};

/// Does something once, when a stage begins.
struct When<'a> {
    stage: Stage,
    act: Option<Box<dyn FnOnce() + Send + 'a>>,
}

impl Progress for When<'_> {
    fn tell(&mut self, event: Event) {
        if matches!(event, Event::Enter(stage, _) if stage == self.stage)
            && let Some(act) = self.act.take()
        {
            act();
        }
    }
}

/// A raw grid with its header and its system beside it: every file that is looked at.
fn write_grid(folder: &Path) {
    let height = |row: i32, col: i32| (700 + (row * row / 9 + 3 * col * row / 7) % 211) as f32;
    let bytes = (0..181).flat_map(|row| (0..201).flat_map(move |col| height(row, col).to_le_bytes()));
    fs::write(folder.join("dem.flt"), bytes.collect::<Vec<u8>>()).unwrap();
    let [east, north] = ORIGIN_M;
    let header =
        format!("ncols 201\nnrows 181\nxllcenter {east}\nyllcenter {north}\ncellsize 25\nbyteorder LSBFIRST\n");
    fs::write(folder.join("dem.hdr"), header).unwrap();
    fs::write(folder.join("dem.prj"), r#"PROJCS["x",AUTHORITY["EPSG","32611"]]"#).unwrap();
}

fn scene() -> Scene {
    let words = Words { dem: "sources = [\"dem.flt\"]".into(), ..Words::sample() };
    Scene::with_files(&words, write_grid)
}

/// A build during which `act` is done at a stage ends with `expected` and leaves no complete database; the next one, of
/// files as they were, comes to the bytes of an undisturbed build.
#[track_caller]
fn check(stage: Stage, expected: &[&str], act: impl FnOnce(&Scene) + Send) {
    let scene = scene();
    drop(scene.build("undisturbed", 1));
    let mut progress = When { stage, act: Some(Box::new(|| act(&scene))) };
    let error = scene.build_watched("area", 1, &AtomicBool::new(false), &mut progress).expect_err("a source changed");
    let message = error.to_string();
    assert!(expected.iter().all(|part| message.contains(part)), "{message}");
    assert!(error.hint().is_some_and(|hint| hint.contains("leave sources alone")), "{:?}", error.hint());
    drop(progress);
    assert!(!inspect::status(&scene.path("area")).unwrap().is_complete());
    write_grid(&scene.path(""));
    drop(scene.build("area", 1));
    assert_same(&scene.product("undisturbed"), &scene.product("area"), "sources as they were");
}

#[test]
fn a_source_that_is_cut_off_replaced_rewritten_or_removed_ends_the_build() {
    for stage in [Stage::Survey, Stage::Refine, Stage::Assemble, Stage::Publish] {
        check(stage, &["dem.flt: 1000 bytes long instead of 145524"], |scene| {
            fs::File::options().write(true).open(scene.path("dem.flt")).unwrap().set_len(1000).unwrap();
        });
        check(stage, &["dem.flt: replaced by another file"], |scene| {
            fs::copy(scene.path("dem.flt"), scene.path("new")).unwrap();
            fs::rename(scene.path("new"), scene.path("dem.flt")).unwrap();
        });
        check(stage, &["dem.flt: gone"], |scene| fs::remove_file(scene.path("dem.flt")).unwrap());
    }
    check(Stage::Refine, &["dem.flt: written to"], |scene| {
        let bytes = fs::read(scene.path("dem.flt")).unwrap();
        fs::write(scene.path("dem.flt"), bytes.iter().map(|byte| byte ^ 1).collect::<Vec<_>>()).unwrap();
    });
}

#[test]
fn a_file_beside_a_source_that_says_how_it_is_read_is_a_part_of_it() {
    for name in ["dem.hdr", "dem.prj"] {
        check(Stage::Refine, &[name, "gone"], |scene| fs::remove_file(scene.path(name)).unwrap());
        check(Stage::Assemble, &[name, "bytes long instead of"], |scene| {
            fs::write(scene.path(name), "another").unwrap();
        });
    }
}
