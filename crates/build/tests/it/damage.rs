//! Files that were damaged or are gone: `verify` names them and the next build restores their bytes.

use std::fs;
use std::path::Path;

use terrain::Dem;

use crate::scene::{Scene, Words, assert_same, sample_dem};

const SMALL: [&str; 2] = ["constrained", "clip"];

fn scene(kind: &str) -> Scene {
    let small = Words { size: (4, 6), tiles: (2, 2), ..Words::sample() };
    let scene = Scene::new(&match kind {
        "clip" => Words {
            modules: "edges = \"clip\"".into(),
            tin: "method = \"greedy\"\npoints = 200\nallocation = \"global\"".into(),
            ..small
        },
        _ => small,
    });
    drop(scene.build("area", 2));
    scene
}

/// Damages each file of `folders` in turn.
#[track_caller]
fn check(folders: &[&str], damage: impl Fn(&Path)) {
    for kind in SMALL {
        let scene = scene(kind);
        let sound = scene.product("area");
        let names = sound.keys().filter(|name| folders.iter().any(|folder| name.starts_with(folder)));
        let mut tried = 0;
        for name in names {
            damage(&scene.path("area").join(name));
            let problems = inspect::verify(&scene.path("area"), None).unwrap().problems;
            let file = name.file_name().unwrap().to_string_lossy().into_owned();
            assert!(problems.iter().any(|problem| problem.contains(&file)), "{kind}, {file}: {problems:?}");
            drop(scene.build("area", 2));
            assert_same(&sound, &scene.product("area"), &format!("{kind}: {file}"));
            tried += 1;
        }
        assert!(folders.len() * 4 <= tried, "{kind}: {tried} files were tried");
        scene.verify("area");
    }
}

const ALL: [&str; 3] = ["tiles", "modules", "survey"];

#[test]
fn a_file_that_is_gone_is_named_and_made_again() {
    check(&ALL, |path| fs::remove_file(path).unwrap());
}

#[test]
fn a_truncated_file_is_named_and_made_again() {
    check(&ALL, |path| {
        let bytes = fs::read(path).unwrap();
        fs::write(path, &bytes[..bytes.len() * 2 / 3]).unwrap();
    });
}

#[test]
fn a_flipped_byte_is_named_and_made_again() {
    for part in [0, 3, 7] {
        check(&ALL, |path| {
            let mut bytes = fs::read(path).unwrap();
            let at = bytes.len() * part / 8 + 5;
            bytes[at] ^= 0x10;
            fs::write(path, bytes).unwrap();
        });
    }
}

#[test]
fn an_empty_file_is_named_and_made_again() {
    check(&ALL, |path| fs::write(path, []).unwrap());
}

#[test]
fn files_of_two_tiles_that_changed_places_are_named_and_made_again() {
    let scene = scene("constrained");
    let sound = scene.product("area");
    for (folder, kind) in [("tiles", "tin"), ("modules", "slm"), ("survey", "curve")] {
        let path = |tile: &str| scene.path("area").join(folder).join(format!("{tile}.{kind}"));
        let (one, other) = (fs::read(path("r00c00")).unwrap(), fs::read(path("r01c01")).unwrap());
        fs::write(path("r00c00"), other).unwrap();
        fs::write(path("r01c01"), one).unwrap();
        let problems = inspect::verify(&scene.path("area"), None).unwrap().problems;
        assert!(problems.iter().any(|problem| problem.contains(&format!("r00c00.{kind}"))), "{problems:?}");
        drop(scene.build("area", 2));
        assert_same(&sound, &scene.product("area"), folder);
    }
}

#[test]
fn a_damaged_manifest_is_an_error_of_verify_and_the_next_build_writes_it_again() {
    let scene = scene("constrained");
    let sound = scene.product("area");
    let path = scene.path("area").join("database.json");
    let text = fs::read_to_string(&path).unwrap();
    fs::write(&path, text.replacen("\"tiles\"", "\"tails\"", 1)).unwrap();
    let error = inspect::verify(&scene.path("area"), None).unwrap_err();
    assert!(error.to_string().contains("database.json"), "{error}");
    drop(scene.build("area", 2));
    assert_same(&sound, &scene.product("area"), "database.json");
}

#[test]
fn a_manifest_that_was_cut_short_is_written_again_where_all_else_is_ours() {
    let scene = scene("constrained");
    let sound = scene.product("area");
    let path = scene.path("area").join("database.json");
    let text = fs::read_to_string(&path).unwrap();
    for damaged in ["", &text[..text.len() / 2], "{}"] {
        fs::write(&path, damaged).unwrap();
        assert!(inspect::verify(&scene.path("area"), None).unwrap_err().to_string().contains("database.json"));
        drop(scene.build("area", 2));
        assert_same(&sound, &scene.product("area"), "cut short");
    }
}

#[test]
fn without_a_manifest_or_with_something_else_beside_a_damaged_one_a_folder_is_left_alone() {
    let scene = scene("constrained");
    let path = scene.path("area").join("database.json");
    let refused = || {
        let before = scene.product("area");
        let error = scene.try_build("area", 2).unwrap_err();
        assert!(error.to_string().contains("expected an empty folder or a terrain database"), "{error}");
        assert_same(&before, &scene.product("area"), "refused");
    };
    fs::remove_file(&path).unwrap();
    refused();
    fs::write(&path, "{}").unwrap();
    fs::write(scene.path("area").join("notes.txt"), "mine").unwrap();
    refused();
}

#[test]
fn what_an_earlier_dem_or_its_limits_left_behind_is_not_in_the_next_build() {
    // Both western tiles are flat afterwards: nothing is taken out of them any more.
    let words = Words {
        size: (4, 8),
        tiles: (2, 2),
        modules: "edges = \"clip\"".into(),
        limits: "per_load_module = 40".into(),
        tin: "method = \"paper\"\npoints = 350".into(),
        ..Words::raster()
    };
    let rough = sample_dem(words.grid(), 1);
    let half = Dem::from_fn(rough.rect(), |post| Some(if post.col < 120 { 0 } else { rough.height(post) }));
    let scene = Scene::on(&words, &rough);
    let removed = |name: &str| {
        let files = scene.product(name).into_keys();
        files.filter(|file| file.extension().is_some_and(|kind| kind == "removed")).count()
    };
    drop(scene.build("area", 2));
    let before = removed("area");
    scene.replace_dem(&half);
    drop(scene.build("area", 2));
    drop(scene.build("fresh", 2));
    assert!(removed("fresh") < before, "{} lists of removals, {before} before", removed("fresh"));
    assert_same(&scene.product("fresh"), &scene.product("area"), "after the change");
}
