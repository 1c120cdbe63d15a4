//! One tile run again: with the same DEM, with a changed one, with its borders frozen or released.

use std::collections::BTreeSet;
use std::sync::atomic::AtomicBool;

use build::product::WantedGround;
use job::Job;
use store::TileState;
use terrain::{Dem, ModuleId, Post, TileId};

use crate::modes;
use crate::product::Product;
use crate::scene::{Draw, SIDE_CELLS, Scene, Silent, Words, assert_same, differing, options, sample_dem, tile};

/// Equal allocation: what a tile may spend does not depend on what the DEM of another holds, so a tile that is run
/// again can have the bytes of a fresh build. With a survey the fresh build would share its budget anew.
fn words() -> [(&'static str, Words); 3] {
    let tin = "method = \"greedy\"\nkey = \"sse\"\nallocation = \"equal\"".to_owned();
    let constrained = Words { tin, ..Words::raster() };
    let modules = "edges = \"clip\"".to_owned();
    let tin = "method = \"paper\"\npoints = 800".to_owned();
    let clip = Words { modules, tin, ..Words::raster() };
    let raster = Words { order: "order = \"raster\"".into(), ..constrained.clone() };
    [("constrained", constrained), ("clip", clip), ("raster order", raster)]
}

fn ground() -> Dem {
    sample_dem(Words::raster().grid(), 1)
}

/// `dem` with a round hill of 78 m and 20 posts' radius on it.
fn with_hill(dem: &Dem, top: Post) -> Dem {
    Dem::from_fn(dem.rect(), |post| {
        let far = (post.row - top.row).pow(2) + (post.col - top.col).pow(2);
        Some(dem.height(post) + (400 - far).max(0) * 25)
    })
}

/// `dem` with spikes of up to 100 m within 20 posts: they take all the points a tile has.
fn with_spikes(dem: &Dem, middle: Post) -> Dem {
    let mut draw = Draw(11);
    Dem::from_fn(dem.rect(), |post| {
        let far = (post.row - middle.row).pow(2) + (post.col - middle.col).pow(2);
        Some(dem.height(post) + if far < 400 { draw.below(12_800) as i32 } else { 0 })
    })
}

/// Tiles by rank: four colours, then row, then column.
fn in_rank_order() -> Vec<TileId> {
    let mut tiles: Vec<TileId> = (0..3).flat_map(|row| (0..3).map(move |col| tile(row, col))).collect();
    tiles.sort_by_key(|tile| (2 * (tile.row % 2) + tile.col % 2, tile.row, tile.col));
    tiles
}

/// A post in the middle of a tile, more than a hill's radius from its sides: 9 x 10 load modules make tiles of 3, 3
/// and 3 by 4, 3 and 3.
fn middle(tile: TileId) -> Post {
    Post::new([30, 90, 150][tile.row as usize], [40, 110, 170][tile.col as usize])
}

#[test]
fn a_build_assembled_by_running_every_tile_again_in_rank_order_is_the_full_build() {
    let modes = modes::all();
    let picked = ["optimised", "limits that bind, with a pool", "clip, paper", "clip, limits that bind"];
    for mode in modes.into_iter().filter(|mode| picked.contains(&mode.0)) {
        let scene = modes::scene(&mode);
        drop(scene.build("area", 2));
        let full = scene.product("area");
        for tile in in_rank_order() {
            assert_eq!(scene.tile("area", tile, false), (vec![tile], false), "{}", mode.0);
        }
        assert_same(&full, &scene.product("area"), mode.0);
    }
}

#[test]
fn releasing_every_tile_in_rank_order_turns_one_full_build_into_that_of_another_dem() {
    for (name, words) in words() {
        let other = sample_dem(words.grid(), 2);
        let scene = Scene::on(&words, &ground());
        drop(scene.build("area", 2));
        scene.replace_dem(&other);
        for tile in in_rank_order() {
            let (refined, frozen) = scene.tile("area", tile, true);
            assert!(refined.contains(&tile) && !frozen, "{name}: {tile}");
            Product::read(&scene.path("area")).check_cracks();
        }
        drop(scene.build("fresh", 2));
        assert_same(&scene.product("fresh"), &scene.product("area"), name);
    }
}

#[test]
fn a_change_that_leaves_the_border_as_it_is_changes_that_tile_alone() {
    for (name, words) in words() {
        let (scene, changed) = (Scene::on(&words, &ground()), tile(0, 0));
        drop(scene.build("area", 2));
        let before = scene.product("area");
        // A quantum at a post that is no vertex.
        let (_, tin) = store::Folder::new(scene.path("area")).read_tile(changed).unwrap();
        let is_vertex = |post: Post| tin.tin.vertices.iter().any(|vertex| vertex.at.post() == Some(post));
        let free = (30..60).map(|col| Post::new(30, col)).find(|&post| !is_vertex(post)).unwrap();
        let dem = ground();
        scene.replace_dem(&Dem::from_fn(dem.rect(), |post| Some(dem.height(post) + i32::from(post == free))));
        assert_eq!(scene.tile("area", changed, false), (vec![changed], false), "{name}");
        let after = scene.product("area");
        let tins = differing(&before, &after).into_iter().filter(|file| file.starts_with("tiles"));
        assert_eq!(tins.collect::<Vec<_>>(), ["tiles/r00c00.tin"], "{name}");
        drop(scene.build("fresh", 2));
        assert_same(&scene.product("fresh"), &after, name);
    }
}

#[test]
fn a_tile_whose_border_would_change_is_frozen_until_the_next_build() {
    for (name, words) in words() {
        // Tile 0,0 has the lowest rank: all its inner sides are its own.
        let (scene, changed) = (Scene::on(&words, &ground()), tile(0, 0));
        drop(scene.build("area", 2));
        let before = scene.product("area");
        scene.replace_dem(&with_spikes(&ground(), middle(changed)));
        assert_eq!(scene.tile("area", changed, false), (vec![changed], true), "{name}");

        let status = inspect::status(&scene.path("area")).unwrap();
        assert!(status.is_complete() && status.frozen() == [changed], "{name}: {:?}", status.frozen());
        assert_eq!(status.manifest.tile(changed).unwrap().state, TileState::Frozen);
        scene.verify("area");
        Product::read(&scene.path("area")).check_cracks();
        let tins = differing(&before, &scene.product("area")).into_iter().filter(|file| file.starts_with("tiles"));
        assert_eq!(tins.collect::<Vec<_>>(), ["tiles/r00c00.tin"], "{name}");

        // It stays frozen while others are run again.
        assert_eq!(scene.tile("area", tile(2, 2), false), (vec![tile(2, 2)], false), "{name}");
        assert_eq!(inspect::status(&scene.path("area")).unwrap().frozen(), [changed], "{name}");

        let built = scene.build("area", 2);
        assert!(1 <= built.rebuilt && built.rebuilt < 9, "{name}: {} tiles refined", built.rebuilt);
        drop(built);
        assert!(inspect::status(&scene.path("area")).unwrap().frozen().is_empty(), "{name}");
        drop(scene.build("fresh", 2));
        assert_same(&scene.product("fresh"), &scene.product("area"), name);
    }
}

#[test]
fn released_borders_give_the_fresh_build_of_a_dem_that_changed_in_one_tile() {
    for (name, words) in words() {
        for changed in [tile(0, 0), tile(0, 1), tile(1, 0), tile(1, 1)] {
            let scene = Scene::on(&words, &ground());
            drop(scene.build("area", 2));
            scene.replace_dem(&with_hill(&ground(), middle(changed)));
            let (refined, frozen) = scene.tile("area", changed, true);
            assert!(refined[0] == changed && !frozen, "{name}: {refined:?}");
            assert!(refined.len() < 9, "{name}: {changed} reached every tile");
            drop(scene.build("fresh", 2));
            assert_same(&scene.product("fresh"), &scene.product("area"), &format!("{name}: {changed}"));
        }
    }
}

#[test]
fn with_a_survey_released_borders_are_sound_and_the_next_build_makes_them_whole() {
    let words = Words::raster();
    let (scene, changed) = (Scene::on(&words, &ground()), tile(1, 0));
    drop(scene.build("area", 2));
    scene.replace_dem(&with_hill(&ground(), middle(changed)));
    assert!(!scene.tile("area", changed, true).1);
    Product::read(&scene.path("area")).check_cracks();
    scene.verify("area");
    drop(scene.build("area", 2));
    drop(scene.build("fresh", 2));
    assert_same(&scene.product("fresh"), &scene.product("area"), "after the next build");
}

#[test]
fn until_a_build_has_renewed_the_rest_none_says_that_nothing_changed() {
    let words = Words::raster();
    let scene = Scene::on(&words, &ground());
    drop(scene.build("area", 2));
    scene.tile("area", tile(2, 2), false);
    assert!(scene.build("area", 2).is_unchanged, "a tile of the same ground changes nothing for others");
    scene.replace_dem(&with_hill(&ground(), middle(tile(1, 0))));
    // The second one finds a database of the new ground's files, in which the first one has left old tiles.
    for again in [tile(1, 0), tile(2, 2)] {
        scene.tile("area", again, true);
        assert!(store::Folder::new(scene.path("area")).report().unwrap().outdated, "{again}");
    }
    check_outdated(&scene, true);
    let built = scene.build("area", 2);
    assert!(!built.is_unchanged && !built.report.outdated);
    drop(built);
    assert!(scene.build("area", 2).is_unchanged);
    check_outdated(&scene, false);
    drop(scene.build("fresh", 2));
    assert_same(&scene.product("fresh"), &scene.product("area"), "after the next build");
}

/// Whether all that hold tiles against their ground say that some are of other ground.
#[track_caller]
fn check_outdated(scene: &Scene, expected: bool) {
    let area = scene.path("area");
    assert_eq!(inspect::status(&area).unwrap().is_outdated, expected);
    assert_eq!(inspect::inadequate(&area, &[], None).unwrap().is_outdated, expected);
    let sights = inspect::Sights { pairs: 100, seed: 1 };
    assert_eq!(inspect::fidelity(&area, &[], sights).unwrap().is_outdated, expected);
}

#[test]
fn a_job_with_other_keys_is_refused_with_the_first_of_them() {
    let tin = "effort = \"fast\"";
    let scene = Scene::on(&Words { tin: tin.into(), ..Words::raster() }, &ground());
    drop(scene.build("area", 2));
    for (tin, expected) in [
        (format!("{tin}\ntarget_rms_m = 3"), "`target_rms_m = 3` here alone"),
        (tin.replace("fast", "best"), "`effort = \"fast\"` there, `effort = \"best\"` here"),
    ] {
        let text = Words { tin, ..Words::raster() }.text();
        let job = Job::from_text(&text, &scene.path("job.toml")).unwrap();
        let (area, stop) = (scene.path("area"), AtomicBool::new(false));
        let error = build::rebuild_tile(&job, &area, tile(0, 0), false, &options(1, &stop), &mut Silent).unwrap_err();
        assert!(error.to_string().ends_with(expected), "{error}");
    }
}

#[test]
fn one_more_point_is_not_tried_on_ground_that_a_load_module_was_not_made_from() {
    let words = Words::raster();
    let (dem, scene) = (ground(), Scene::on(&words, &ground()));
    drop(scene.build("area", 2));
    std::fs::copy(scene.path("dem.tif"), scene.path("old.tif")).unwrap();
    scene.replace_dem(&Dem::from_fn(dem.rect(), |post| Some(dem.height(post) + 30 * 128)));
    scene.tile("area", tile(0, 0), true);
    let explain = |module, against: WantedGround| inspect::explain(&scene.path("area"), module, against, 1).unwrap();
    let [near, far] = [ModuleId { row: 0, col: 0 }, ModuleId { row: 8, col: 9 }];
    assert!(explain(near, WantedGround::Recorded).one_more.is_some());
    let found = explain(far, WantedGround::Recorded);
    assert!(found.one_more.is_none() && found.no_ground.unwrap().contains("`tiefort build`"));
    let [old, new] = ["old.tif", "dem.tif"]
        .map(|name| explain(far, WantedGround::Rasters(&[scene.path(name)])).one_more.unwrap().rms_before_m);
    assert!(old < 10.0 && 25.0 < new, "{old} {new}");
}

#[test]
fn a_tile_that_chooses_no_border_is_never_frozen() {
    for (name, words) in words().into_iter().take(2) {
        // Tile 1,1 has the highest rank of 3 x 3: all its sides are its neighbours'.
        let (scene, changed) = (Scene::on(&words, &ground()), tile(1, 1));
        drop(scene.build("area", 2));
        scene.replace_dem(&with_hill(&ground(), middle(changed)));
        assert_eq!(scene.tile("area", changed, false), (vec![changed], false), "{name}");
        drop(scene.build("fresh", 2));
        assert_same(&scene.product("fresh"), &scene.product("area"), name);
    }
}

#[test]
fn ground_that_changed_under_seams_and_tile_corners_opens_no_crack() {
    for (name, words) in words() {
        let grid = words.grid();
        let scene = Scene::on(&words, &ground());
        drop(scene.build("area", 2));
        // The corner of the four south-western tiles, and the seam between two northern ones.
        let corner = Post::new(3 * SIDE_CELLS, 4 * SIDE_CELLS);
        let mut changed = with_hill(&ground(), corner);
        changed = with_hill(&changed, Post::new(150, 7 * SIDE_CELLS));
        scene.replace_dem(&changed);
        let mut frozen = BTreeSet::new();
        for (turn, tile) in [tile(1, 1), tile(0, 1), tile(2, 1), tile(0, 0), tile(1, 0)].into_iter().enumerate() {
            let (_, is_frozen) = scene.tile("area", tile, turn == 2);
            let product = Product::read(&scene.path("area"));
            assert_eq!(product.modules.len(), grid.count());
            product.check_cracks();
            scene.verify("area");
            if is_frozen {
                frozen.insert(tile);
            }
        }
        assert!(frozen.contains(&tile(0, 0)), "{name}: {frozen:?}");
        drop(scene.build("area", 2));
        drop(scene.build("fresh", 2));
        assert_same(&scene.product("fresh"), &scene.product("area"), name);
    }
}

#[test]
fn running_a_tile_again_is_refused_where_there_is_nothing_to_go_on_from() {
    let words = Words::raster();
    let scene = Scene::on(&words, &ground());
    let error = scene.try_tile("none", tile(0, 0), false).unwrap_err();
    assert!(error.to_string().contains("none") && error.hint().is_some(), "{error}");
    assert!(!scene.path("none").exists(), "a refused run left a folder");

    drop(scene.build("area", 2));
    let before = scene.product("area");
    let error = scene.try_tile("area", tile(3, 0), false).unwrap_err();
    assert!(error.to_string().contains("3,0"), "{error}");
    let other = Scene::on(&Words { limits: "per_load_module = 60".into(), ..words }, &ground());
    let folder = scene.path("area");
    let run = build::rebuild_tile(
        &other.job,
        &folder,
        tile(0, 0),
        false,
        &options(1, &false.into()),
        &mut crate::scene::Silent,
    );
    let error = run.unwrap_err();
    assert!(error.to_string().contains("per_load_module = 60"), "{error}");
    assert_same(&before, &scene.product("area"), "refused");
}
